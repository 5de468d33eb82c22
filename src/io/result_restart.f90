!> Prepares a result for a run that is continued after a given row: later rows, snapshots and losses are
!> removed.
!>
!> The file remembers the first fault of these calls, and the caller checks it once at the end
!> (see `hdf5_handle`). After a fault nothing is removed or written any more.
module result_restart
   use asperity_errors, only : error_file, error_type, fail
   use hdf5_file, only : hdf5_file_type
   use hdf5_tree, only : name_length
   use regular_grid, only : grid_type
   use result_frame, only : axes, read_grid
   use result_history, only : count_history_rows, shorten_history
   use result_losses, only : drop_losses
   use xdmf, only : snapshot_type
   implicit none
   private

   public :: go_back

   !> Attribute of a snapshot that was written because the run was stopped
   character(*), parameter, public :: stop_mark = 'at_stop'

contains

   !> Remove everything that belongs to later rows, and return what the file then contains.
   subroutine go_back(file, last_step, grid, expected_rows, snapshots, error)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: last_step           !! the last row to keep, from 0
      type(grid_type), intent(inout) :: grid
      integer, intent(inout) :: expected_rows    !! of the whole run
      type(snapshot_type), allocatable, intent(inout) :: snapshots(:)   !! those that are left
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(120) :: text
      integer :: rows
      logical :: shortened

      if (allocated(error)) return
      rows = count_history_rows(file)
      call file%report(error)
      if (allocated(error)) return
      if (last_step < 0 .or. last_step >= rows) then
         write (text, '(": the history has ", i0, " rows, the run would continue after row ", i0)') rows, last_step
         call fail(error, error_file, file%path//trim(text))
         return
      end if
      call read_grid(file, grid)
      call file%read_attribute('/', 'expected_rows', expected_rows)
      shortened = rows > last_step + 1
      if (shortened) call shorten_history(file, last_step + 1, expected_rows)
      call drop_snapshots(file, last_step, snapshots)
      call drop_losses(file, last_step)
      call file%flush()
      if (shortened) call file%publish_group()
   end subroutine go_back

   !> Remove the snapshots of later rows and that of a stop, and list the others.
   subroutine drop_snapshots(file, last_step, kept)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: last_step
      type(snapshot_type), allocatable, intent(out) :: kept(:)
      character(name_length), allocatable :: names(:), fields(:)
      type(snapshot_type) :: snapshot
      integer :: i, j
      character(:), allocatable :: path

      allocate (kept(0))
      call file%members('/snapshots', names)
      do i = 1, size(names)
         path = '/snapshots/'//trim(names(i))
         call file%read_attribute(path, 'step', snapshot%step)
         if (snapshot%step > last_step .or. file%has_attribute(path, stop_mark)) then
            call file%remove(path)
            cycle
         end if
         call file%read_attribute(path, 'time', snapshot%time)
         call file%members(path, fields)
         fields = pack(fields, fields /= axes(1) .and. fields /= axes(2))
         if (allocated(snapshot%fields)) deallocate (snapshot%fields)
         allocate (snapshot%fields(size(fields)))
         do j = 1, size(fields)
            snapshot%fields(j) = fields(j) (:len(snapshot%fields))
         end do
         kept = [kept, snapshot]
      end do
   end subroutine drop_snapshots

end module result_restart
