!> Reads the datasets of an HDF5 file: their shapes and values, with messages about faults.
!>
!> HDF5 converts numbers of any kind to reals. Module `hdf5_handle` explains how faults are reported.
module hdf5_reader
   use, intrinsic :: iso_c_binding, only : c_loc, c_ptr
   use asperity_errors, only : error_file, error_input, error_type, fail
   use asperity_precision, only : dp
   use hdf5_attributes, only : hdf5_attributes_type
   use hdf5_c_objects, only : h5oclose
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_values, only : get_reals, shape_of_dataset
   use hdf5_virtual, only : check_sources
   use memory_limits, only : check_allocation
   use text_tools, only : to_text
   implicit none
   private

   public :: hdf5_reader_type

   !> An open file whose datasets can be read.
   type, extends(hdf5_attributes_type) :: hdf5_reader_type
   contains
      procedure :: dataset_shape
      procedure :: open_values
      procedure, private :: read_real_0, read_real_1, read_real_2, read_real_3
      !> Read a whole dataset.
      generic :: read => read_real_0, read_real_1, read_real_2, read_real_3
   end type hdf5_reader_type

contains

   !> Shape of a dataset in Fortran's order; of size 0 for a single value and after a fault.
   subroutine dataset_shape(self, path, extent, error)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, allocatable, intent(out) :: extent(:)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hid_t) :: dataset
      integer(hsize_t), allocatable :: long_extent(:)
      integer :: status, ignored

      allocate (extent(0))
      if (self%has_failed(error)) return
      if (self%has_group(path)) then
         call fail(fault, error_file, self%path//': "'//trim(path)// &
            '" is a group, not a dataset; there are: '//self%listing())
      else if (.not. self%has_dataset(path)) then
         call fail(fault, error_file, self%path//': there is no dataset "'//trim(path)// &
            '"; there are: '//self%listing())
      else
         call self%open_object(path, dataset, fault)
      end if
      if (.not. allocated(fault)) then
         call shape_of_dataset(dataset, long_extent, status)
         call self%checked(status, 'the dataset cannot be read', path, fault)
         if (status >= 0) ignored = h5oclose(dataset)
      end if
      if (.not. allocated(fault)) then
         if (all(long_extent <= huge(1))) then
            extent = int(long_extent)
         else
            call fail(fault, error_input, self%path//': '//trim(path)//': has '// &
               to_text(maxval(long_extent))//' values along one side: at most '// &
               to_text(huge(1))//' are allowed')
         end if
      end if
      call self%settle(fault, error)
   end subroutine dataset_shape

   !> Get the shape of a dataset that must have a given number of dimensions.
   subroutine get_shape(self, path, rank, extent, fault)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: rank
      integer, intent(out) :: extent(rank)
      type(error_type), allocatable, intent(out) :: fault
      integer, allocatable :: found(:)
      character(80) :: text

      extent = 0
      call self%dataset_shape(path, found, fault)
      if (allocated(fault)) return
      if (size(found) == rank) then
         extent = found
      else
         write (text, '("has ", i0, " dimensions, not ", i0)') size(found), rank
         call fail(fault, error_input, self%path//': '//trim(path)//': '//trim(text))
      end if
   end subroutine get_shape

   !> Open a dataset for reading. It is a fault if some of its values are missing.
   subroutine open_values(self, path, dataset, fault)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: dataset      !! the caller closes it if there is no fault
      type(error_type), allocatable, intent(out) :: fault
      character(:), allocatable :: reason
      integer :: ignored

      call self%open_object(path, dataset, fault)
      if (allocated(fault)) return
      call check_sources(self%path, dataset, reason)
      if (reason == '') return
      call fail(fault, error_file, self%path//': '//trim(path)// &
         ': is a virtual dataset, and '//reason//': copy the values into a dataset of their own')
      ignored = h5oclose(dataset)
   end subroutine open_values

   !> Read a whole dataset into memory.
   subroutine load(self, path, buffer, fault)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: fault
      integer(hid_t) :: dataset
      integer :: status, ignored

      call self%open_values(path, dataset, fault)
      if (allocated(fault)) return
      call get_reals(dataset, buffer, status)
      call self%checked(status, 'the dataset cannot be read', path, fault)
      ignored = h5oclose(dataset)
   end subroutine load

   !> Read a single real; 0 after a fault.
   subroutine read_real_0(self, path, value, error)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      real(dp), target :: buffer(1)
      integer :: none(0)

      value = 0.0_dp
      if (self%has_failed(error)) return
      buffer = 0.0_dp
      call get_shape(self, path, 0, none, fault)
      if (.not. allocated(fault)) call load(self, path, c_loc(buffer), fault)
      value = buffer(1)
      call self%settle(fault, error)
   end subroutine read_real_0

   !> Read a vector of reals. Numbers of any other kind are converted. After a fault the values have
   !> no meaning; the size is 0 if the shape is not known.
   subroutine read_real_1(self, path, values, error)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: extent(1), status

      allocate (values(0))
      if (self%has_failed(error)) return
      call get_shape(self, path, 1, extent, fault)
      if (.not. allocated(fault)) then
         deallocate (values)
         allocate (values(extent(1)), stat=status)
         call check_allocation(self%path//': '//trim(path), extent, status, fault)
      end if
      if (.not. allocated(fault) .and. all(extent > 0)) call load(self, path, c_loc(values), fault)
      call self%settle(fault, error)
   end subroutine read_real_1

   !> Read a field of reals.
   subroutine read_real_2(self, path, values, error)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: extent(2), status

      allocate (values(0, 0))
      if (self%has_failed(error)) return
      call get_shape(self, path, 2, extent, fault)
      if (.not. allocated(fault)) then
         deallocate (values)
         allocate (values(extent(1), extent(2)), stat=status)
         call check_allocation(self%path//': '//trim(path), extent, status, fault)
      end if
      if (.not. allocated(fault) .and. all(extent > 0)) call load(self, path, c_loc(values), fault)
      call self%settle(fault, error)
   end subroutine read_real_2

   !> Read several fields of reals.
   subroutine read_real_3(self, path, values, error)
      class(hdf5_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :, :)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: extent(3), status

      allocate (values(0, 0, 0))
      if (self%has_failed(error)) return
      call get_shape(self, path, 3, extent, fault)
      if (.not. allocated(fault)) then
         deallocate (values)
         allocate (values(extent(1), extent(2), extent(3)), stat=status)
         call check_allocation(self%path//': '//trim(path), extent, status, fault)
      end if
      if (.not. allocated(fault) .and. all(extent > 0)) call load(self, path, c_loc(values), fault)
      call self%settle(fault, error)
   end subroutine read_real_3

end module hdf5_reader
