!> The snapshots of a result: which ones it has, and the one that is being written.
!>
!> A snapshot is written as a group that is not part of the file yet, and appears as a whole when it is
!> finished (see `hdf5_tree`). The file remembers the first fault of these calls (see `hdf5_handle`).
module result_snapshots
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use hdf5_chunk_writer, only : chunk_writer_type
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : copy_field, create_field
   use regular_grid, only : grid_type
   use result_frame, only : height_path, write_axes
   use result_restart, only : stop_mark
   use snapshot_fields, only : field_type, find_field
   use xdmf, only : snapshot_name, snapshot_type
   implicit none
   private

   public :: result_snapshots_type

   !> The snapshots of an open result.
   type :: result_snapshots_type
      type(snapshot_type), allocatable :: written(:)      !! those that the file shows
      type(snapshot_type), private :: current             !! the one under construction ...
      character(:), allocatable, private :: group         !! ... and its group
   contains
      procedure :: forget
      procedure :: last
      procedure :: begin
      procedure :: start_field
      procedure :: copy_height
      procedure :: finish
   end type result_snapshots_type

contains

   !> Begin with a result that has none.
   subroutine forget(self)
      class(result_snapshots_type), intent(inout) :: self

      if (allocated(self%written)) deallocate (self%written)
      allocate (self%written(0))
   end subroutine forget

   !> Row of the last snapshot; -1 if there is none.
   pure function last(self) result(step)
      class(result_snapshots_type), intent(in) :: self
      integer :: step

      step = -1
      if (size(self%written) > 0) step = maxval(self%written%step)
   end function last

   !> Start a snapshot.
   subroutine begin(self, file, step, time, phase, at_stop)
      class(result_snapshots_type), intent(inout) :: self
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: step           !! row of the history
      real(dp), intent(in) :: time          !! s
      integer, intent(in) :: phase          !! number of the phase, from 1
      logical, intent(in), optional :: at_stop   !! written by a stop; default no

      self%group = '/snapshots/'//snapshot_name(step)
      self%current%step = step
      self%current%time = time
      if (allocated(self%current%fields)) deallocate (self%current%fields)
      allocate (self%current%fields(0))
      call file%stage_group(self%group)
      call file%write_attribute(self%group, 'step', step)
      call file%write_attribute(self%group, 'time', time)
      call file%write_attribute(self%group, 'phase', phase)
      if (present(at_stop)) then
         if (at_stop) call file%write_attribute(self%group, stop_mark, 1)
      end if
   end subroutine begin

   !> Start a field of the snapshot, which the writer then writes in slabs of rows.
   subroutine start_field(self, file, writer, name, grid, compression, error)
      class(result_snapshots_type), intent(inout) :: self
      type(hdf5_file_type), intent(inout) :: file
      type(chunk_writer_type), intent(inout) :: writer
      character(*), intent(in) :: name      !! one of `known_fields`, such as 'pressure'
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: compression    !! 0 none to 9 smallest
      type(error_type), allocatable, intent(out) :: error
      type(field_type) :: field
      character(:), allocatable :: path
      integer :: extent(2)
      logical :: states

      field = find_field(name)
      if (field%name == '') then
         call fail(error, error_input, 'snapshots have no field "'//trim(name)//'"')
         return
      end if
      self%current%fields = [character(24) :: self%current%fields, name]
      call writer%finish(file)              ! the field before
      path = self%group//'/'//trim(name)
      extent = [grid%nx, grid%ny]
      states = name == 'contact'
      call create_field(file, path, extent, states, trim(field%units), trim(field%long_name), compression)
      call writer%start(file, path, extent, states, compression)
      call file%report(error)
   end subroutine start_field

   !> Add the height of a road that stands where it was at the start of the run: a copy of the map of the result.
   subroutine copy_height(self, file, writer, error)
      class(result_snapshots_type), intent(inout) :: self
      type(hdf5_file_type), intent(inout) :: file
      type(chunk_writer_type), intent(inout) :: writer
      type(error_type), allocatable, intent(out) :: error
      character(*), parameter :: name = 'road_height'
      type(field_type) :: field

      field = find_field(name)
      self%current%fields = [character(24) :: self%current%fields, name]
      call writer%finish(file)              ! the field before
      call copy_field(file, height_path, self%group//'/'//name, trim(field%units), trim(field%long_name))
      call file%report(error)
   end subroutine copy_height

   !> Let the snapshot appear. Its last field has been written.
   subroutine finish(self, file, grid, compression, error)
      class(result_snapshots_type), intent(inout) :: self
      type(hdf5_file_type), intent(inout) :: file
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: compression    !! 0 none to 9 smallest
      type(error_type), allocatable, intent(out) :: error

      call write_axes(file, self%group, grid, self%current%fields, compression)
      call file%publish_group()
      call file%report(error)
      if (.not. allocated(error)) self%written = [self%written, self%current]
   end subroutine finish

end module result_snapshots
