!> Interfaces to the C functions of HDF5 that are used here, under their own names.
!>
!> The C library is called directly, as FFTW is, so that neither HDF5's Fortran modules, which only
!> the compiler that made them can read, nor its Fortran library are needed. Arguments that C calls
!> `unsigned` are integers of the same size. `hdf5_library` has the calls as Fortran writes them.
!>
!> HDF5 keeps the numbers of its predefined types and property classes in global variables of C.
!> They stand here as procedures that nothing calls: `value_of` reads the variable behind such a name.
module hdf5_c
   use, intrinsic :: iso_c_binding, only : c_bool, c_char, c_double, c_f_pointer, &
      c_funptr, c_int, c_int64_t, c_long, c_null_ptr, c_ptr, c_size_t
   implicit none
   public

   integer, parameter :: hid_t = c_int64_t
   integer, parameter :: hsize_t = c_int64_t
   integer, parameter :: size_t = c_size_t

   !> What HDF5 tells about a group.
   type, bind(c) :: group_info_type
      integer(c_int) :: storage
      integer(hsize_t) :: links
      integer(c_int64_t) :: largest_creation_order
      logical(c_bool) :: is_mount_point
   end type group_info_type

   interface

      function h5open() bind(c, name='H5open') result(status)
         import :: c_int
         integer(c_int) :: status
      end function h5open

      function h5dont_atexit() bind(c, name='H5dont_atexit') result(status)
         import :: c_int
         integer(c_int) :: status
      end function h5dont_atexit

      function h5eset_auto2(stack, visit, context) bind(c, name='H5Eset_auto2') result(status)
         import :: c_funptr, c_int, c_ptr, hid_t
         integer(hid_t), value :: stack
         type(c_funptr), value :: visit
         type(c_ptr), value :: context
         integer(c_int) :: status
      end function h5eset_auto2

      function h5fopen(name, flags, access) bind(c, name='H5Fopen') result(found)
         import :: c_char, c_int, hid_t
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: flags
         integer(hid_t), value :: access
         integer(hid_t) :: found
      end function h5fopen

      function h5fcreate(name, flags, creation, access) bind(c, name='H5Fcreate') result(found)
         import :: c_char, c_int, hid_t
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: flags
         integer(hid_t), value :: creation, access
         integer(hid_t) :: found
      end function h5fcreate

      function h5fclose(file) bind(c, name='H5Fclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: file
         integer(c_int) :: status
      end function h5fclose

      function h5fflush(object, scope) bind(c, name='H5Fflush') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: object
         integer(c_int), value :: scope
         integer(c_int) :: status
      end function h5fflush

      function h5fget_filesize(file, length) bind(c, name='H5Fget_filesize') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: file
         integer(hsize_t), intent(out) :: length
         integer(c_int) :: status
      end function h5fget_filesize

      function h5fis_hdf5(name) bind(c, name='H5Fis_hdf5') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int) :: status
      end function h5fis_hdf5

      function h5gcreate2(location, name, links, creation, access) &
         bind(c, name='H5Gcreate2') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: links, creation, access
         integer(hid_t) :: found
      end function h5gcreate2

      function h5gcreate_anon(location, creation, access) &
         bind(c, name='H5Gcreate_anon') result(found)
         import :: hid_t
         integer(hid_t), value :: location, creation, access
         integer(hid_t) :: found
      end function h5gcreate_anon

      function h5gclose(group) bind(c, name='H5Gclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: group
         integer(c_int) :: status
      end function h5gclose

      function h5gget_info_by_name(location, name, info, access) &
         bind(c, name='H5Gget_info_by_name') result(status)
         import :: c_char, c_int, group_info_type, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         type(group_info_type), intent(out) :: info
         integer(hid_t), value :: access
         integer(c_int) :: status
      end function h5gget_info_by_name

      function h5lget_name_by_idx(location, group, index, order, n, name, length, access) &
         bind(c, name='H5Lget_name_by_idx') result(length_found)
         import :: c_char, c_int, c_long, hid_t, hsize_t, size_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: group(*)
         integer(c_int), value :: index, order
         integer(hsize_t), value :: n
         character(kind=c_char), intent(inout) :: name(*)
         integer(size_t), value :: length
         integer(hid_t), value :: access
         integer(c_long) :: length_found
      end function h5lget_name_by_idx

      function h5lexists(location, name, access) bind(c, name='H5Lexists') result(status)
         import :: c_char, c_int, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: access
         integer(c_int) :: status
      end function h5lexists

      function h5ldelete(location, name, access) bind(c, name='H5Ldelete') result(status)
         import :: c_char, c_int, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: access
         integer(c_int) :: status
      end function h5ldelete

      function h5lcreate_external(file, object, location, name, creation, access) &
         bind(c, name='H5Lcreate_external') result(status)
         import :: c_char, c_int, hid_t
         character(kind=c_char), intent(in) :: file(*), object(*)
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: creation, access
         integer(c_int) :: status
      end function h5lcreate_external

      function h5oopen(location, name, access) bind(c, name='H5Oopen') result(found)
         import :: c_char, hid_t
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: access
         integer(hid_t) :: found
      end function h5oopen

      function h5oclose(object) bind(c, name='H5Oclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: object
         integer(c_int) :: status
      end function h5oclose

      function h5olink(object, location, name, creation, access) &
         bind(c, name='H5Olink') result(status)
         import :: c_char, c_int, hid_t
         integer(hid_t), value :: object, location
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: creation, access
         integer(c_int) :: status
      end function h5olink

      function h5iget_type(object) bind(c, name='H5Iget_type') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: object
         integer(c_int) :: status
      end function h5iget_type

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

      function h5pcreate(class) bind(c, name='H5Pcreate') result(found)
         import :: hid_t
         integer(hid_t), value :: class
         integer(hid_t) :: found
      end function h5pcreate

      function h5pclose(list) bind(c, name='H5Pclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pclose

      function h5pset_libver_bounds(list, low, high) &
         bind(c, name='H5Pset_libver_bounds') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: low, high
         integer(c_int) :: status
      end function h5pset_libver_bounds

      function h5pset_fclose_degree(list, degree) &
         bind(c, name='H5Pset_fclose_degree') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: degree
         integer(c_int) :: status
      end function h5pset_fclose_degree

      function h5pset_meta_block_size(list, length) &
         bind(c, name='H5Pset_meta_block_size') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_meta_block_size

      function h5pset_small_data_block_size(list, length) &
         bind(c, name='H5Pset_small_data_block_size') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_small_data_block_size

      function h5pset_userblock(list, length) bind(c, name='H5Pset_userblock') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_userblock

      function h5pset_alignment(list, threshold, alignment) &
         bind(c, name='H5Pset_alignment') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: threshold, alignment
         integer(c_int) :: status
      end function h5pset_alignment

      function h5pset_link_phase_change(list, most, least) &
         bind(c, name='H5Pset_link_phase_change') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: most, least
         integer(c_int) :: status
      end function h5pset_link_phase_change

      function h5pset_attr_phase_change(list, most, least) &
         bind(c, name='H5Pset_attr_phase_change') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: most, least
         integer(c_int) :: status
      end function h5pset_attr_phase_change

      function h5pset_est_link_info(list, count, length) &
         bind(c, name='H5Pset_est_link_info') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: count, length
         integer(c_int) :: status
      end function h5pset_est_link_info

      function h5pset_create_intermediate_group(list, create) &
         bind(c, name='H5Pset_create_intermediate_group') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: create
         integer(c_int) :: status
      end function h5pset_create_intermediate_group

      function h5pset_fill_time(list, when) bind(c, name='H5Pset_fill_time') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: when
         integer(c_int) :: status
      end function h5pset_fill_time

      function h5pset_chunk(list, rank, extent) bind(c, name='H5Pset_chunk') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(c_int), value :: rank
         integer(hsize_t), intent(in) :: extent(*)
         integer(c_int) :: status
      end function h5pset_chunk

      function h5pset_chunk_cache(list, slots, bytes, preemption) &
         bind(c, name='H5Pset_chunk_cache') result(status)
         import :: c_double, c_int, hid_t, size_t
         integer(hid_t), value :: list
         integer(size_t), value :: slots, bytes
         real(c_double), value :: preemption
         integer(c_int) :: status
      end function h5pset_chunk_cache

      function h5pset_shuffle(list) bind(c, name='H5Pset_shuffle') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pset_shuffle

      function h5pset_fletcher32(list) bind(c, name='H5Pset_fletcher32') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pset_fletcher32

      function h5pset_deflate(list, level) bind(c, name='H5Pset_deflate') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: level
         integer(c_int) :: status
      end function h5pset_deflate

      subroutine h5t_native_double_g() bind(c, name='H5T_NATIVE_DOUBLE_g')
      end subroutine h5t_native_double_g

      subroutine h5t_native_int_g() bind(c, name='H5T_NATIVE_INT_g')
      end subroutine h5t_native_int_g

      subroutine h5t_native_int8_g() bind(c, name='H5T_NATIVE_INT8_g')
      end subroutine h5t_native_int8_g

      subroutine h5t_ieee_f64le_g() bind(c, name='H5T_IEEE_F64LE_g')
      end subroutine h5t_ieee_f64le_g

      subroutine h5t_std_i32le_g() bind(c, name='H5T_STD_I32LE_g')
      end subroutine h5t_std_i32le_g

      subroutine h5t_std_i8le_g() bind(c, name='H5T_STD_I8LE_g')
      end subroutine h5t_std_i8le_g

      subroutine h5t_c_s1_g() bind(c, name='H5T_C_S1_g')
      end subroutine h5t_c_s1_g

      subroutine h5p_cls_dataset_access_id_g() bind(c, name='H5P_CLS_DATASET_ACCESS_ID_g')
      end subroutine h5p_cls_dataset_access_id_g

      subroutine h5p_cls_dataset_create_id_g() bind(c, name='H5P_CLS_DATASET_CREATE_ID_g')
      end subroutine h5p_cls_dataset_create_id_g

      subroutine h5p_cls_file_access_id_g() bind(c, name='H5P_CLS_FILE_ACCESS_ID_g')
      end subroutine h5p_cls_file_access_id_g

      subroutine h5p_cls_file_create_id_g() bind(c, name='H5P_CLS_FILE_CREATE_ID_g')
      end subroutine h5p_cls_file_create_id_g

      subroutine h5p_cls_group_create_id_g() bind(c, name='H5P_CLS_GROUP_CREATE_ID_g')
      end subroutine h5p_cls_group_create_id_g

      subroutine h5p_cls_link_create_id_g() bind(c, name='H5P_CLS_LINK_CREATE_ID_g')
      end subroutine h5p_cls_link_create_id_g
   end interface

   private :: c_bool, c_char, c_double, c_f_pointer, c_funptr, c_int, c_int64_t, c_long, &
      c_null_ptr, c_ptr, c_size_t

contains

   !> The value of the global variable behind a name of HDF5, after `h5open`.
   function value_of(variable) result(found)
      type(c_funptr), value :: variable     !! `c_funloc` of the name
      integer(hid_t) :: found
      integer(hid_t), pointer :: content

      call c_f_pointer(transfer(variable, c_null_ptr), content)
      found = content
   end function value_of

end module hdf5_c
