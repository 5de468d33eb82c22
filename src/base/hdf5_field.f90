!> Reads fields from HDF5 files of any origin, such as height maps, in slabs of rows.
module hdf5_field
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   use hdf5_slab_reader, only : slab_reader_type
   use hdf5_slabs, only : slab_rows
   use trial_process, only : trial_type
   implicit none
   private

   public :: field_reader_type

   !> A field in a file that is open.
   type :: field_reader_type
      integer :: extent(2) = 0               !! nx, ny of the dataset, whose shape is (ny, nx)
      type(hdf5_file_type), private :: file
      type(slab_reader_type), private :: slabs
   contains
      procedure :: open => open_field
      procedure :: read => read_rows
      procedure :: close => close_field
   end type field_reader_type

contains

   !> Open a field. HDF5 may crash or hang on a damaged file. Therefore a separate process first tries to
   !> read the whole field, provided that it has the expected shape.
   subroutine open_field(self, path, dataset, wanted, error)
      class(field_reader_type), intent(inout) :: self
      character(*), intent(in) :: path       !! name of the file
      character(*), intent(in) :: dataset    !! '': 'surface/height', or otherwise 'surface'
      integer, intent(in) :: wanted(2)       !! nx, ny; the caller compares them with `extent`
      type(error_type), allocatable, intent(out) :: error
      real(dp), parameter :: slowest = 2.0e6_dp          !! bytes/s from the slowest disk
      type(trial_type) :: trial

      call trial%start(60 + int(min(8.0_dp*product(real(wanted, dp))/slowest, 1.0e6_dp)))
      if (trial%is_copy) then
         call try_field(self, path, dataset, wanted)
         call trial%leave()
      end if
      call trial%verdict(path, error)
      if (.not. allocated(error)) call open_dataset(self, path, dataset, error)
   end subroutine open_field

   !> Open a field, and read all of it if it has the expected shape.
   subroutine try_field(self, path, dataset, wanted)
      class(field_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset
      integer, intent(in) :: wanted(2)
      type(error_type), allocatable :: error
      real(dp), allocatable :: slab(:, :)
      integer :: first, rows

      call open_dataset(self, path, dataset, error)
      if (allocated(error)) return
      if (any(self%extent /= wanted)) return
      allocate (slab(wanted(1), min(slab_rows(wanted(1)), wanted(2))))
      do first = 1, wanted(2), size(slab, 2)
         rows = min(size(slab, 2), wanted(2) - first + 1)
         call self%slabs%read(self%file, first, slab(:, :rows))   ! after a fault nothing more is read
      end do
   end subroutine try_field

   !> Open a field without a trial.
   subroutine open_dataset(self, path, dataset, error)
      class(field_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      real(dp), allocatable :: field(:, :)
      integer, allocatable :: found(:)

      self%extent = 0
      call self%file%open(path, 'read')
      name = trim(dataset)
      if (name == '') then
         name = 'surface/height'
         if (.not. self%file%has_dataset(name)) then
            if (self%file%has_dataset('surface')) name = 'surface'
         end if
      end if
      call self%file%dataset_shape(name, found)
      if (size(found) == 2) then
         self%extent = found
         call self%slabs%open(self%file, name)
      else
         call self%file%read(name, field)    ! this fails and reports the wrong number of dimensions
      end if
      call self%file%report(error)
      if (allocated(error)) call self%close()
   end subroutine open_dataset

   !> Read some rows.
   subroutine read_rows(self, first, values, error)
      class(field_reader_type), intent(inout) :: self
      integer, intent(in) :: first           !! the first of them, from 1
      real(dp), intent(out), contiguous :: values(:, :)  !! [nx, rows]
      type(error_type), allocatable, intent(out) :: error

      call self%slabs%read(self%file, first, values, error)
   end subroutine read_rows

   !> Close the file.
   subroutine close_field(self)
      class(field_reader_type), intent(inout) :: self
      type(error_type), allocatable :: error

      call self%slabs%close()
      call self%file%close(error)            ! everything has been read, so a fault has no consequences
   end subroutine close_field

end module hdf5_field
