!> Dimension scales: the coordinates along the axes of a dataset.
!>
!> The attribute DIMENSION_LIST of a dataset refers to vectors of the same file, its scales, which
!> hold the coordinates along its axes. The attributes CLASS and NAME mark a vector as a scale, and
!> its REFERENCE_LIST refers to the datasets that use it. These attributes follow the "HDF5
!> Dimension Scale Specification", which netCDF, xarray and MATLAB read. They are written here
!> instead of by the high-level library of HDF5, because that is one more library to install, and
!> because it rewrites the growing REFERENCE_LIST for each dataset.
module hdf5_scales
   use, intrinsic :: iso_c_binding, only : c_char, c_funloc, c_int, c_int64_t, c_loc, c_null_char, c_ptr, &
      c_size_t
   use hdf5_c_lists, only : h5t_c_s1_g, value_of
   use hdf5_c_values, only : h5aclose, h5acreate2, h5awrite, h5dclose, h5dopen2, h5sclose, &
      h5screate, h5tclose, h5tcopy, h5tset_size
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_library, only : c_text, h5p_default, h5s_scalar, h5t_std_i32le, simple_space, status_of
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

   !> Make vectors of a group the scales of datasets in it, each of which has all of these axes.
   !> Without datasets the vectors are only marked as scales.
   subroutine attach_scales(location, folder, scales, datasets, status)
      integer(hid_t), intent(in) :: location      !! the file or a group
      character(*), intent(in) :: folder          !! path from there to the group that contains all of them
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
         if (status >= 0) call open_dataset(location, path_of(folder, datasets(i)), dataset, status)
         if (status >= 0) call list_axes(dataset, references, status)
         if (status >= 0) status = h5dclose(dataset)
      end do
      do k = 1, size(scales)
         if (status < 0) return
         pairs%axis = k - 1
         call open_dataset(location, path_of(folder, scales(k)), dataset, status)
         if (status >= 0) call put_fixed_text(dataset, 'CLASS', 'DIMENSION_SCALE', status)
         if (status >= 0) call put_fixed_text(dataset, 'NAME', trim(scales(k)), status)
         if (status >= 0 .and. size(pairs) > 0) call list_users(dataset, pairs, status)
         if (status >= 0) status = h5dclose(dataset)
      end do
   end subroutine attach_scales

   !> Open a dataset.
   subroutine open_dataset(location, path, dataset, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status

      dataset = h5dopen2(location, c_text(path), h5p_default)
      status = status_of(dataset)
   end subroutine open_dataset

   !> Path of an object in a group.
   pure function path_of(folder, name) result(path)
      character(*), intent(in) :: folder, name
      character(:), allocatable :: path

      path = trim(folder)//'/'//trim(name)
   end function path_of

   !> A reference to an object; the status is negative if there is no such object.
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
      status = status_of(file_type)
      if (status >= 0) call put_vector(dataset, 'DIMENSION_LIST', file_type, size(axes), c_loc(axes), status)
      if (status >= 0) ignored = h5tclose(file_type)
   end subroutine list_axes

   !> REFERENCE_LIST of a scale: the datasets that use it, and along which axis.
   subroutine list_users(scale, pairs, status)
      integer(hid_t), intent(in) :: scale
      type(pair_type), intent(in), target :: pairs(:)
      integer, intent(out) :: status
      integer(hid_t) :: file_type
      integer :: ignored

      file_type = h5tcreate(class_compound, pair_size)
      status = status_of(file_type)
      if (status >= 0) status = h5tinsert(file_type, 'dataset'//c_null_char, 0_c_size_t, &
         value_of(c_funloc(h5t_std_ref_obj_g)))
      if (status >= 0) status = h5tinsert(file_type, 'dimension'//c_null_char, 8_c_size_t, h5t_std_i32le)
      if (status >= 0) call put_vector(scale, 'REFERENCE_LIST', file_type, size(pairs), c_loc(pairs), status)
      if (status >= 0) ignored = h5tclose(file_type)
   end subroutine list_users

   !> Write a vector as an attribute.
   subroutine put_vector(object, name, type, length, buffer, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type          !! of an element, in the file and in memory
      integer, intent(in) :: length
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      integer(hid_t) :: attribute, space
      integer :: ignored

      space = simple_space([int(length, hsize_t)])
      attribute = h5acreate2(object, c_text(name), type, space, h5p_default, h5p_default)
      status = status_of(attribute)
      if (status >= 0) status = h5awrite(attribute, type, buffer)
      if (status < 0) return
      ignored = h5aclose(attribute)
      ignored = h5sclose(space)
   end subroutine put_vector

   !> Write a text of fixed length with a null at its end, as the specification requires.
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
      text_type = h5tcopy(value_of(c_funloc(h5t_c_s1_g)))
      status = h5tset_size(text_type, int(size(letters), c_size_t))
      if (status < 0) return
      space = h5screate(h5s_scalar)
      attribute = h5acreate2(object, c_text(name), text_type, space, h5p_default, h5p_default)
      status = status_of(attribute)
      if (status >= 0) status = h5awrite(attribute, text_type, c_loc(letters))
      if (status < 0) return
      ignored = h5aclose(attribute)
      ignored = h5sclose(space)
      ignored = h5tclose(text_type)
   end subroutine put_fixed_text

end module hdf5_scales
