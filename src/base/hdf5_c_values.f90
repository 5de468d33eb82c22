!> C functions of HDF5 for attributes, datasets, dataspaces and types, under their own names.
!> Their results and arguments are explained in `hdf5_c_objects`.
module hdf5_c_values
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_int8_t, c_ptr
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   implicit none
   private

   public :: h5aclose, h5acreate2, h5aexists, h5aget_space, h5aget_type, h5aopen, h5aread, &
      h5awrite, h5dclose, h5dcreate2, h5dget_create_plist, h5dget_space, h5dopen2, h5dread, h5dset_extent, &
      h5dvlen_reclaim, h5dwrite, h5dwrite_chunk, h5sclose, h5screate, h5screate_simple, h5sget_simple_extent_dims, &
      h5sget_simple_extent_ndims, h5sselect_hyperslab, h5tclose, h5tcopy, h5tget_size, &
      h5tis_variable_str, h5tset_cset, h5tset_size, h5tset_strpad

   interface

      function h5acreate2(object, name, type, space, creation, access) &
         bind(c, name='H5Acreate2') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: object
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: type, space, creation, access
         integer(hid_t) :: found
      end function h5acreate2

      function h5aexists(object, name) bind(c, name='H5Aexists') result(status)
         import :: c_char, c_int, hid_t
         integer(hid_t), value :: object
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int) :: status
      end function h5aexists

      function h5aopen(object, name, access) bind(c, name='H5Aopen') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: object
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: access
         integer(hid_t) :: found
      end function h5aopen

      function h5aget_space(attribute) bind(c, name='H5Aget_space') result(found)
         import :: hid_t
         integer(hid_t), value :: attribute
         integer(hid_t) :: found
      end function h5aget_space

      function h5aget_type(attribute) bind(c, name='H5Aget_type') result(found)
         import :: hid_t
         integer(hid_t), value :: attribute
         integer(hid_t) :: found
      end function h5aget_type

      function h5aread(attribute, type, buffer) bind(c, name='H5Aread') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: attribute, type
         type(c_ptr), value :: buffer
         integer(c_int) :: status
      end function h5aread

      function h5awrite(attribute, type, buffer) bind(c, name='H5Awrite') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: attribute, type
         type(c_ptr), value :: buffer
         integer(c_int) :: status
      end function h5awrite

      function h5aclose(attribute) bind(c, name='H5Aclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: attribute
         integer(c_int) :: status
      end function h5aclose

      function h5dcreate2(location, name, type, space, links, creation, access) &
         bind(c, name='H5Dcreate2') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: type, space, links, creation, access
         integer(hid_t) :: found
      end function h5dcreate2

      function h5dopen2(location, name, access) bind(c, name='H5Dopen2') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: access
         integer(hid_t) :: found
      end function h5dopen2

      function h5dget_space(dataset) bind(c, name='H5Dget_space') result(found)
         import :: hid_t
         integer(hid_t), value :: dataset
         integer(hid_t) :: found
      end function h5dget_space

      function h5dget_create_plist(dataset) bind(c, name='H5Dget_create_plist') result(list)
         import :: hid_t
         integer(hid_t), value :: dataset
         integer(hid_t) :: list
      end function h5dget_create_plist

      function h5dset_extent(dataset, extent) bind(c, name='H5Dset_extent') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: dataset
         integer(hsize_t), intent(in) :: extent(*)
         integer(c_int) :: status
      end function h5dset_extent

      function h5dread(dataset, type, memory, file, transfer, buffer) &
         bind(c, name='H5Dread') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: dataset, type, memory, file, transfer
         type(c_ptr), value :: buffer
         integer(c_int) :: status
      end function h5dread

      function h5dwrite(dataset, type, memory, file, transfer, buffer) &
         bind(c, name='H5Dwrite') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: dataset, type, memory, file, transfer
         type(c_ptr), value :: buffer
         integer(c_int) :: status
      end function h5dwrite

      function h5dwrite_chunk(dataset, transfer, filters, start, length, buffer) &
         bind(c, name='H5Dwrite_chunk') result(status)
         import :: c_int, c_int8_t, hid_t, hsize_t, size_t
         integer(hid_t), value :: dataset, transfer
         integer(c_int), value :: filters        !! a bit for each filter that was left out
         integer(hsize_t), intent(in) :: start(*)
         integer(size_t), value :: length        !! bytes
         integer(c_int8_t), intent(in) :: buffer(*)
         integer(c_int) :: status
      end function h5dwrite_chunk

      function h5dvlen_reclaim(type, space, transfer, buffer) &
         bind(c, name='H5Dvlen_reclaim') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: type, space, transfer
         type(c_ptr), value :: buffer
         integer(c_int) :: status
      end function h5dvlen_reclaim

      function h5dclose(dataset) bind(c, name='H5Dclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: dataset
         integer(c_int) :: status
      end function h5dclose

      function h5screate(kind) bind(c, name='H5Screate') result(found)
         import :: c_int, hid_t
         integer(c_int), value :: kind
         integer(hid_t) :: found
      end function h5screate

      function h5screate_simple(rank, extent, largest) &
         bind(c, name='H5Screate_simple') result(found)
         import :: c_int, c_ptr, hid_t, hsize_t
         integer(c_int), value :: rank
         integer(hsize_t), intent(in) :: extent(*)
         type(c_ptr), value :: largest
         integer(hid_t) :: found
      end function h5screate_simple

      function h5sget_simple_extent_ndims(space) &
         bind(c, name='H5Sget_simple_extent_ndims') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: space
         integer(c_int) :: status
      end function h5sget_simple_extent_ndims

      function h5sget_simple_extent_dims(space, extent, largest) &
         bind(c, name='H5Sget_simple_extent_dims') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: space
         integer(hsize_t), intent(out) :: extent(*), largest(*)
         integer(c_int) :: status
      end function h5sget_simple_extent_dims

      function h5sselect_hyperslab(space, operator, start, stride, count, block) &
         bind(c, name='H5Sselect_hyperslab') result(status)
         import :: c_int, c_ptr, hid_t, hsize_t
         integer(hid_t), value :: space
         integer(c_int), value :: operator
         integer(hsize_t), intent(in) :: start(*)
         type(c_ptr), value :: stride
         integer(hsize_t), intent(in) :: count(*)
         type(c_ptr), value :: block
         integer(c_int) :: status
      end function h5sselect_hyperslab

      function h5sclose(space) bind(c, name='H5Sclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: space
         integer(c_int) :: status
      end function h5sclose

      function h5tcopy(type) bind(c, name='H5Tcopy') result(found)
         import :: hid_t
         integer(hid_t), value :: type
         integer(hid_t) :: found
      end function h5tcopy

      function h5tget_size(type) bind(c, name='H5Tget_size') result(length_found)
         import :: hid_t, size_t
         integer(hid_t), value :: type
         integer(size_t) :: length_found
      end function h5tget_size

      function h5tset_size(type, length) bind(c, name='H5Tset_size') result(status)
         import :: c_int, hid_t, size_t
         integer(hid_t), value :: type
         integer(size_t), value :: length
         integer(c_int) :: status
      end function h5tset_size

      function h5tset_cset(type, set) bind(c, name='H5Tset_cset') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: type
         integer(c_int), value :: set
         integer(c_int) :: status
      end function h5tset_cset

      function h5tset_strpad(type, padding) bind(c, name='H5Tset_strpad') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: type
         integer(c_int), value :: padding
         integer(c_int) :: status
      end function h5tset_strpad

      function h5tis_variable_str(type) bind(c, name='H5Tis_variable_str') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: type
         integer(c_int) :: status
      end function h5tis_variable_str

      function h5tclose(type) bind(c, name='H5Tclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: type
         integer(c_int) :: status
      end function h5tclose
   end interface

end module hdf5_c_values
