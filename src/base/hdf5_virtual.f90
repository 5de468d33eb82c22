!> The source files of a virtual dataset.
!>
!> A virtual dataset is a view of datasets in other files. If one of these is missing, or if the
!> view has a gap, HDF5 returns the fill value, usually zero, without an error.
module hdf5_virtual
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_long, c_null_char, c_size_t
   use asperity_errors, only : error_type
   use file_system, only : file_exists, folder_of
   use hdf5_c_lists, only : h5pclose, h5pget_layout
   use hdf5_c_values, only : h5dget_create_plist, h5dget_space, h5sclose
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_tree, only : hdf5_tree_type
   implicit none
   private

   public :: check_sources

   integer(c_int), parameter :: layout_virtual = 3      !! H5D_VIRTUAL
   integer, parameter :: longest_name = 4096

   !> A dataset in another file.
   type :: source_type
      character(:), allocatable :: file                 !! as stored; '.' is the file itself
      character(:), allocatable :: dataset
   end type source_type

   interface
      function h5pget_virtual_count(list, count) bind(c, name='H5Pget_virtual_count') result(status)
         import :: c_int, c_size_t, hid_t
         integer(hid_t), value :: list
         integer(c_size_t), intent(out) :: count
         integer(c_int) :: status
      end function h5pget_virtual_count

      function h5pget_virtual_filename(list, i, name, size) &
         bind(c, name='H5Pget_virtual_filename') result(length)
         import :: c_char, c_long, c_size_t, hid_t
         integer(hid_t), value :: list
         integer(c_size_t), value :: i
         character(kind=c_char), intent(inout) :: name(*)
         integer(c_size_t), value :: size
         integer(c_long) :: length
      end function h5pget_virtual_filename

      function h5pget_virtual_dsetname(list, i, name, size) &
         bind(c, name='H5Pget_virtual_dsetname') result(length)
         import :: c_char, c_long, c_size_t, hid_t
         integer(hid_t), value :: list
         integer(c_size_t), value :: i
         character(kind=c_char), intent(inout) :: name(*)
         integer(c_size_t), value :: size
         integer(c_long) :: length
      end function h5pget_virtual_dsetname

      function h5pget_virtual_vspace(list, i) bind(c, name='H5Pget_virtual_vspace') result(space)
         import :: c_size_t, hid_t
         integer(hid_t), value :: list
         integer(c_size_t), value :: i
         integer(hid_t) :: space
      end function h5pget_virtual_vspace

      function h5sget_select_npoints(space) bind(c, name='H5Sget_select_npoints') result(points)
         import :: hid_t, hsize_t
         integer(hid_t), value :: space
         integer(hsize_t) :: points
      end function h5sget_select_npoints

      function h5sget_simple_extent_npoints(space) &
         bind(c, name='H5Sget_simple_extent_npoints') result(points)
         import :: hid_t, hsize_t
         integer(hid_t), value :: space
         integer(hsize_t) :: points
      end function h5sget_simple_extent_npoints
   end interface

contains

   !> Check that all sources of a virtual dataset exist.
   subroutine check_sources(path, dataset, fault)
      character(*), intent(in) :: path                       !! of the file with the dataset
      integer(hid_t), intent(in) :: dataset
      character(:), allocatable, intent(out) :: fault        !! '' if all is well
      type(source_type), allocatable :: sources(:)
      type(hdf5_tree_type) :: file
      type(error_type), allocatable :: error
      character(:), allocatable :: name
      logical :: complete
      integer :: i

      call list_sources(dataset, sources, complete)
      fault = ''
      if (.not. complete) fault = 'parts of it have no source'
      do i = 1, size(sources)
         if (fault /= '') exit
         name = sources(i)%file
         if (name == '.') cycle
         if (index(name//sources(i)%dataset, '%') > 0) then
            fault = 'its sources are named by a pattern, "'//name//'"'
            exit
         end if
         if (name(1:1) /= '/' .and. file_exists(folder_of(path)//'/'//name)) &
            name = folder_of(path)//'/'//name
         call file%open(name, 'read', error)
         if (allocated(error)) then
            fault = 'its source "'//sources(i)%file//'" cannot be opened'
         else if (.not. file%has_dataset(sources(i)%dataset)) then
            fault = 'its source "'//sources(i)%file//'" has no dataset "'//sources(i)%dataset//'"'
         end if
         call file%close()
      end do
   end subroutine check_sources

   !> The sources of a dataset, and whether they cover all of it. A dataset that is not virtual has
   !> none.
   subroutine list_sources(dataset, sources, complete)
      integer(hid_t), intent(in) :: dataset
      type(source_type), allocatable, intent(out) :: sources(:)
      logical, intent(out) :: complete
      character(longest_name, kind=c_char) :: file, name
      integer(hid_t) :: list, space
      integer(hsize_t) :: covered
      integer(c_size_t) :: count
      integer :: i, ignored

      complete = .true.
      allocate (sources(0))
      list = h5dget_create_plist(dataset)
      if (list < 0) return

      if (h5pget_layout(list) == layout_virtual) then
         if (h5pget_virtual_count(list, count) < 0) count = 0
         deallocate (sources)
         allocate (sources(count))
         covered = 0
         do i = 1, int(count)
            file = c_null_char
            name = c_null_char
            if (h5pget_virtual_filename(list, i - 1_c_size_t, file, int(longest_name, c_size_t)) < 0 &
               .or. h5pget_virtual_dsetname(list, i - 1_c_size_t, name, int(longest_name, c_size_t)) &
               < 0) complete = .false.
            sources(i)%file = file(:index(file, c_null_char) - 1)
            sources(i)%dataset = name(:index(name, c_null_char) - 1)
            space = h5pget_virtual_vspace(list, i - 1_c_size_t)
            covered = covered + max(0_hsize_t, h5sget_select_npoints(space))
            ignored = h5sclose(space)
         end do
         space = h5dget_space(dataset)
         complete = complete .and. covered >= h5sget_simple_extent_npoints(space)
         ignored = h5sclose(space)
      end if
      ignored = h5pclose(list)
   end subroutine list_sources

end module hdf5_virtual
