!> C functions of HDF5 for the library, files, groups, links and objects, under their own names.
!>
!> The C library is called directly, as FFTW is. HDF5's own Fortran modules are not used, because
!> only the compiler that made them can read them. The functions take their arguments in the order
!> of HDF5's manual. An argument that is `unsigned` in C is an integer of the same size. A negative
!> result means failure. `hdf5_library` has what Fortran needs in addition.
!>
!> Many of these functions have arguments of the same types. They do not share an abstract
!> interface, because gfortran 12 then passes some arguments that C takes by value by reference.
module hdf5_c_objects
   use, intrinsic :: iso_c_binding, only : c_bool, c_char, c_funptr, c_int, c_int64_t, c_long, c_ptr
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   implicit none
   private

   public :: group_info_type, h5dont_atexit, h5eset_auto2, h5fclose, h5fcreate, h5fflush, &
      h5fget_filesize, h5fget_vfd_handle, h5fis_hdf5, h5fopen, h5gclose, h5gcreate2, h5gcreate_anon, &
      h5gget_info_by_name, h5iget_type, h5lcreate_external, h5ldelete, h5lexists, &
      h5lget_name_by_idx, h5oclose, h5ocopy, h5olink, h5oopen, h5open

   !> What HDF5 reports about a group.
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

      function h5fget_vfd_handle(file, access, handle) bind(c, name='H5Fget_vfd_handle') result(status)
         import :: c_int, c_ptr, hid_t
         integer(hid_t), value :: file, access
         type(c_ptr), intent(out) :: handle
         integer(c_int) :: status
      end function h5fget_vfd_handle

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

      function h5ocopy(source, name, location, copy, options, creation) bind(c, name='H5Ocopy') result(status)
         import :: c_char, c_int, hid_t
         integer(hid_t), value :: source
         character(kind=c_char), intent(in) :: name(*)
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: copy(*)
         integer(hid_t), value :: options, creation
         integer(c_int) :: status
      end function h5ocopy

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
   end interface

end module hdf5_c_objects
