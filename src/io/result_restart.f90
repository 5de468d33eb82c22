!> Changes to a result whose run is continued after a given row: later snapshots and losses are
!> removed. `result_history` shortens the history.
!>
!> The file remembers the first fault of these calls, and the caller asks for it once at the end
!> (see `hdf5_handle`). After a fault nothing is removed or written any more.
module result_restart
   use hdf5_file, only : hdf5_file_type
   use hdf5_tree, only : name_length
   use result_frame, only : axes
   use xdmf, only : snapshot_type
   implicit none
   private

   public :: drop_snapshots

   !> Attribute of a snapshot that was written because the run was stopped
   character(*), parameter, public :: stop_mark = 'at_stop'

contains

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
