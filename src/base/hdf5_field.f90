!> One field of an HDF5 file that anyone may have written, such as a height map.
module hdf5_field
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   use trial_process, only : trial_type
   implicit none
   private

   public :: read_field

contains

   !> Read a field. HDF5 may crash or hang on a damaged file, so that a separate process tries
   !> first.
   subroutine read_field(path, dataset, extent, field, error)
      character(*), intent(in) :: path      !! name of the file
      character(*), intent(in) :: dataset   !! '': 'surface/height', or otherwise 'surface'
      !> On entry the shape that is wanted, on return that of the dataset. The field is read only if
      !> they agree.
      integer, intent(inout) :: extent(2)
      real(dp), allocatable, intent(out) :: field(:, :)  !! [nx, ny] from a dataset (ny, nx)
      type(error_type), allocatable, intent(out) :: error
      real(dp), parameter :: slowest = 2.0e6_dp          !! bytes/s from the slowest disk
      type(trial_type) :: trial

      call trial%start(60 + int(min(8.0_dp*product(real(extent, dp))/slowest, 1.0e6_dp)))
      if (trial%is_copy) then
         call load_field(path, dataset, extent, field, error)
         call trial%leave()
      end if
      call trial%verdict(path, error)
      if (.not. allocated(error)) call load_field(path, dataset, extent, field, error)
   end subroutine read_field

   !> The same without a trial.
   subroutine load_field(path, dataset, extent, field, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset
      integer, intent(inout) :: extent(2)
      real(dp), allocatable, intent(out) :: field(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      character(:), allocatable :: name
      integer, allocatable :: found(:)

      call file%open(path, 'read')
      name = trim(dataset)
      if (name == '') then
         name = 'surface/height'
         if (.not. file%has_dataset(name)) then
            if (file%has_dataset('surface')) name = 'surface'
         end if
      end if
      call file%dataset_shape(name, found)
      if (size(found) /= 2) then
         call file%read(name, field)        ! this reports that the number of dimensions is wrong
         extent = 0
      else
         if (all(found == extent)) call file%read(name, field)
         extent = found
      end if
      call file%close(error)
   end subroutine load_field

end module hdf5_field
