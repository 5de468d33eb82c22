!> Dimension scales: what the axes of a dataset are.
!>
!> A dataset says by its attribute DIMENSION_LIST which vectors of the same file, its scales, hold the
!> coordinates along its axes; a scale says by CLASS and NAME that it is one, and by REFERENCE_LIST
!> whose. These attributes are those of the "HDF5 Dimension Scale Specification", which netCDF, xarray
!> and MATLAB read. They are written here and not by HDF5's library of high-level calls, which would be
!> one more library to carry, and which writes the growing REFERENCE_LIST anew for each dataset.
module hdf5_scales
   use, intrinsic :: iso_c_binding, only : c_char, c_funloc, c_int, c_int64_t, c_loc, c_null_char, c_ptr, &
      c_size_t
   use hdf5_c, only : h5t_c_s1_g, h5tset_size, hid_t, hsize_t, value_of
   use hdf5_library, only : h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5dopen_f, H5S_SCALAR_F, &
      h5sclose_f, h5screate_f, h5screate_simple_f, H5T_STD_I32LE, h5tclose_f, h5tcopy_f
   implicit none
   private

   public :: attach_scales

   integer(c_int), parameter :: class_compound = 6       !! H5T_COMPOUND
   integer(c_int), parameter :: to_object = 0            !! H5R_OBJECT
   integer(c_size_t), parameter :: pair_size = 16        !! bytes of `pair_type`

   !> A vector of variable length, as HDF5 takes it (hvl_t).
   type, bind(c) :: sequence_type
      integer(c_size_t) :: length = 1
      type(c_ptr) :: first
   end type sequence_type

   !> An entry of REFERENCE_LIST: a dataset, and which of its axes the scale belongs to.
   type, bind(c) :: pair_type
      integer(c_int64_t) :: dataset
      integer(c_int) :: axis
      integer(c_int) :: padding = 0
   end type pair_type

   interface
      function h5rcreate(reference, location, name, kind, space) bind(c, name='H5Rcreate') result(status)
         import :: c_char, c_int, c_int64_t, hid_t
         integer(c_int64_t), intent(out) :: reference
         integer(hid_t), value :: location
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: kind
         integer(hid_t), value :: space
         integer(c_int) :: status
      end function h5rcreate

      function h5tvlen_create(base) bind(c, name='H5Tvlen_create') result(found)
         import :: hid_t
         integer(hid_t), value :: base
         integer(hid_t) :: found
      end function h5tvlen_create

      function h5tcreate(class, length) bind(c, name='H5Tcreate') result(found)
         import :: c_int, c_size_t, hid_t
         integer(c_int), value :: class
         integer(c_size_t), value :: length
         integer(hid_t) :: found
      end function h5tcreate

      function h5tinsert(type, name, offset, member) bind(c, name='H5Tinsert') result(status)
         import :: c_char, c_int, c_size_t, hid_t
         integer(hid_t), value :: type
         character(kind=c_char), intent(in) :: name(*)
         integer(c_size_t), value :: offset
         integer(hid_t), value :: member
         integer(c_int) :: status
      end function h5tinsert

      subroutine h5t_std_ref_obj_g() bind(c, name='H5T_STD_REF_OBJ_g')
      end subroutine h5t_std_ref_obj_g
   end interface

contains

   !> Make vectors of a group the scales of datasets in it, each of which has all of these axes. Scales
   !> that belong to no dataset are marked as scales.
   subroutine attach_scales(location, folder, scales, datasets, status)
      integer(hid_t), intent(in) :: location      !! the file or a group
      character(*), intent(in) :: folder          !! the group of them all, seen from there
      character(*), intent(in) :: scales(:)       !! names of the scales in the order of HDF5's axes
      character(*), intent(in) :: datasets(:)     !! names of the datasets
      integer, intent(out) :: status              !! negative: failed
      integer(c_int64_t), target :: references(size(scales))
      type(pair_type), target :: pairs(size(datasets))
      integer(hid_t) :: dataset
      integer :: i, k

      status = 0
      do k = 1, size(scales)
         if (status >= 0) status = reference_to(location, folder, scales(k), references(k))
      end do
      do i = 1, size(datasets)
         if (status < 0) return
         status = reference_to(location, folder, datasets(i), pairs(i)%dataset)
         if (status >= 0) call h5dopen_f(location, path_of(folder, datasets(i)), dataset, status)
         if (status >= 0) call list_axes(dataset, references, status)
         if (status >= 0) call h5dclose_f(dataset, status)
      end do
      do k = 1, size(scales)
         if (status < 0) return
         pairs%axis = k - 1
         call h5dopen_f(location, path_of(folder, scales(k)), dataset, status)
         if (status >= 0) call put_fixed_text(dataset, 'CLASS', 'DIMENSION_SCALE', status)
         if (status >= 0) call put_fixed_text(dataset, 'NAME', trim(scales(k)), status)
         if (status >= 0 .and. size(pairs) > 0) call list_users(dataset, pairs, status)
         if (status >= 0) call h5dclose_f(dataset, status)
      end do
   end subroutine attach_scales

   !> Name of an object of a group.
   pure function path_of(folder, name) result(path)
      character(*), intent(in) :: folder, name
      character(:), allocatable :: path

      path = trim(folder)//'/'//trim(name)
   end function path_of

   !> Where an object lies; the status is negative where that is not found.
   function reference_to(location, folder, name, reference) result(status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: folder, name
      integer(c_int64_t), intent(out) :: reference
      integer :: status

      status = h5rcreate(reference, location, path_of(folder, name)//c_null_char, to_object, -1_hid_t)
   end function reference_to

   !> DIMENSION_LIST of a dataset: one scale for each axis.
   subroutine list_axes(dataset, references, status)
      integer(hid_t), intent(in) :: dataset
      integer(c_int64_t), intent(in), target :: references(:)
      integer, intent(out) :: status
      type(sequence_type), target :: axes(size(references))
      integer(hid_t) :: file_type
      integer :: ignored, k

      do k = 1, size(axes)
         axes(k)%first = c_loc(references(k))
      end do
      file_type = h5tvlen_create(value_of(c_funloc(h5t_std_ref_obj_g)))
      status = merge(-1, 0, file_type < 0)
      if (status >= 0) call put_vector(dataset, 'DIMENSION_LIST', file_type, size(axes), c_loc(axes), status)
      if (status >= 0) call h5tclose_f(file_type, ignored)
   end subroutine list_axes

   !> REFERENCE_LIST of a scale: the datasets that have it, and along which axis.
   subroutine list_users(scale, pairs, status)
      integer(hid_t), intent(in) :: scale
      type(pair_type), intent(in), target :: pairs(:)
      integer, intent(out) :: status
      integer(hid_t) :: file_type
      integer :: ignored

      file_type = h5tcreate(class_compound, pair_size)
      status = merge(-1, 0, file_type < 0)
      if (status >= 0) status = h5tinsert(file_type, 'dataset'//c_null_char, 0_c_size_t, &
         value_of(c_funloc(h5t_std_ref_obj_g)))
      if (status >= 0) status = h5tinsert(file_type, 'dimension'//c_null_char, 8_c_size_t, H5T_STD_I32LE)
      if (status >= 0) call put_vector(scale, 'REFERENCE_LIST', file_type, size(pairs), c_loc(pairs), status)
      if (status >= 0) call h5tclose_f(file_type, ignored)
   end subroutine list_users

   !> Write an attribute that is a vector; its type is the same in memory.
   subroutine put_vector(object, name, type, length, buffer, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type
      integer, intent(in) :: length
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      integer(hid_t) :: attribute, space
      integer :: ignored

      call h5screate_simple_f(1, [int(length, hsize_t)], space, status)
      if (status >= 0) call h5acreate_f(object, name, type, space, attribute, status)
      if (status >= 0) call h5awrite_f(attribute, type, buffer, status)
      if (status < 0) return
      call h5aclose_f(attribute, ignored)
      call h5sclose_f(space, ignored)
   end subroutine put_vector

   !> Write a text of fixed length, with the null at its end, as the specification wants it.
   subroutine put_fixed_text(object, name, text, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name, text
      integer, intent(out) :: status
      character(kind=c_char), target :: letters(len(text) + 1)
      integer(hid_t) :: attribute, space, text_type
      integer :: i, ignored

      do i = 1, len(text)
         letters(i) = text(i:i)
      end do
      letters(len(text) + 1) = c_null_char
      call h5tcopy_f(value_of(c_funloc(h5t_c_s1_g)), text_type, status)
      if (status >= 0) status = h5tset_size(text_type, int(size(letters), c_size_t))
      if (status >= 0) call h5screate_f(H5S_SCALAR_F, space, status)
      if (status >= 0) call h5acreate_f(object, name, text_type, space, attribute, status)
      if (status >= 0) call h5awrite_f(attribute, text_type, c_loc(letters), status)
      if (status < 0) return
      call h5aclose_f(attribute, ignored)
      call h5sclose_f(space, ignored)
      call h5tclose_f(text_type, ignored)
   end subroutine put_fixed_text

end module hdf5_scales
