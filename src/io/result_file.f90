!> The result of a run: one HDF5 file that is written step by step and can be read at any moment.
!>
!> A file is built under the name FILE.new and is renamed once it contains everything but the rows of the
!> history. A row counts when all columns have it, so that readers use the length of the shortest column. A
!> snapshot appears as a whole (see `hdf5_tree`), and then in the XDMF file beside the result.
!>
!> Procedures with an optional `error` belong to chains: without it, the file remembers the first
!> fault and later calls do nothing. `report`, `end_snapshot`, `append_row`, `finish` and `close`
!> return that fault (see `hdf5_handle`).
module result_file
   use asperity_errors, only : error_file, error_input, error_type, fail
   use asperity_precision, only : dp, int8
   use checkpoint_link, only : add_link, remove_link
   use file_kind, only : file_start
   use file_system, only : file_exists, remove_file, rename_file
   use hdf5_chunk_writer, only : chunk_writer_type
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : slab_rows
   use history_row, only : history_row_type
   use history_table, only : row_values
   use random_id, only : new_id
   use regular_grid, only : grid_type
   use result_frame, only : height_path, result_plan_type, write_frame
   use result_losses, only : put_losses
   use result_history, only : append_values, create_history_columns
   use result_names, only : checkpoint_path, sibling_path
   use result_restart, only : go_back
   use result_snapshots, only : result_snapshots_type
   use result_target, only : check_place
   use xdmf, only : write_xdmf
   implicit none
   private

   public :: result_file_type, result_plan_type

   integer, parameter :: renewal = 128               !! snapshots after which the file is opened anew
   integer, parameter :: many_listed = 16            !! snapshots from which on not each new one is listed at once

   !> An open result.
   type :: result_file_type
      private
      type(hdf5_file_type) :: file
      type(chunk_writer_type) :: writer              !! of the field that was started last
      type(grid_type) :: grid
      integer :: expected_rows = 0
      integer :: compression = 0
      character(:), allocatable :: xdmf_path
      type(result_snapshots_type) :: snapshots
      integer :: listed = 0                          !! snapshots that the XDMF file lists
      character(:), allocatable, public :: path      !! name of the file
      character(:), allocatable, public :: id        !! identity, which a checkpoint names
      integer, public :: rows = 0                    !! rows of the history
   contains
      procedure :: create => create_result
      procedure :: write_height_rows
      procedure :: publish => publish_result
      procedure :: reopen => reopen_result
      procedure :: write_text
      procedure :: write_number
      procedure :: read_text
      procedure :: append_row
      procedure :: begin_snapshot
      procedure :: start_field
      procedure :: copy_height
      procedure, private :: write_real_rows, write_state_rows
      !> Write rows of the field that was started last.
      generic :: write_rows => write_real_rows, write_state_rows
      procedure :: end_snapshot
      procedure :: list_snapshots
      procedure :: write_losses
      procedure :: last_snapshot
      procedure :: link_checkpoint
      procedure :: unlink_checkpoint
      procedure :: report
      procedure :: finish => finish_result
      procedure :: close => close_result
   end type result_file_type

contains

   !> Start a result as FILE.new. The heights of the road follow (`write_height_rows`), and then
   !> `publish` lets it take its place.
   subroutine create_result(self, path, grid, plan, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: path               !! name of the file
      type(grid_type), intent(in) :: grid
      type(result_plan_type), intent(in) :: plan
      type(error_type), allocatable, intent(out) :: error

      self%grid = grid
      self%expected_rows = plan%rows
      self%compression = plan%compression
      self%rows = 0
      self%path = trim(path)
      self%id = new_id()
      self%xdmf_path = sibling_path(path, '.xdmf')
      call self%snapshots%forget()
      self%listed = 0

      call check_place(self%path, error)
      if (allocated(error)) return
      call write_frame(self%file, new_path(self), self%id, grid, plan)
      ! The link is added and removed at once, so that the root group has space for its name from the
      ! start.
      call self%link_checkpoint()
      call self%unlink_checkpoint()
      call self%writer%start(self%file, height_path, [grid%nx, grid%ny], .false., self%compression)
      call self%file%report(error)
      if (allocated(error)) call give_up(self, error)
   end subroutine create_result

   !> Write a slab of the height map as it is before any sliding. The slabs have `slab_rows(nx)` rows; the last one
   !> may have fewer.
   subroutine write_height_rows(self, first, height, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: first                     !! first row, from 1
      real(dp), intent(in), contiguous :: height(:, :) !! m [nx, rows]
      type(error_type), allocatable, intent(out), optional :: error

      call self%writer%add(self%file, first, height)
      call self%file%report(error)
   end subroutine write_height_rows

   !> Give the new result its final name. A result of the same name is replaced, and its checkpoint is removed.
   subroutine publish_result(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%writer%finish(self%file)
      call self%file%flush()
      call self%file%report(error)
      if (allocated(error)) then
         call give_up(self, error)
         return
      end if
      call remove_file(checkpoint_path(self%path))
      call remove_file(self%xdmf_path)
      call rename_file(new_path(self), self%path, error)
      if (.not. allocated(error)) self%file%path = self%path
   end subroutine publish_result

   !> Remove a new result that cannot be written. The message gives the final name of the file, because the user
   !> does not know the other one.
   subroutine give_up(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! the fault, which is set
      character(:), allocatable :: temporary

      call self%writer%finish(self%file)
      temporary = new_path(self)
      if (index(error%message, temporary//':') == 1) &
         error%message = self%path//error%message(len(temporary) + 1:)
      call self%file%close()
      call remove_file(temporary)
   end subroutine give_up

   !> Name of a result that does not have its final name yet.
   pure function new_path(self) result(path)
      class(result_file_type), intent(in) :: self
      character(:), allocatable :: path

      path = self%path//'.new'
   end function new_path

   !> Write a number as an attribute of the file.
   subroutine write_number(self, name, value, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error

      call self%file%write_attribute('/', name, value, error)
   end subroutine write_number

   !> Write a text as an attribute of the file, such as the name of a case.
   subroutine write_text(self, name, value, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error

      call self%file%write_attribute('/', name, value, error)
   end subroutine write_text

   !> Read a text attribute of the result; '' if there is none.
   subroutine read_text(self, name, value, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error

      value = ''
      if (self%file%has_attribute('/', name)) call self%file%read_attribute('/', name, value, error)
   end subroutine read_text

   !> Add a row to the history, and flush it: a run that is killed later keeps it.
   subroutine append_row(self, row, error)
      class(result_file_type), intent(inout) :: self
      type(history_row_type), intent(in) :: row
      type(error_type), allocatable, intent(out) :: error

      if (self%rows == 0) then
         ! The first row allocates the columns, which takes several writes. They go into a new group
         ! that replaces the empty one, so that a killed run never leaves half of the columns.
         call self%file%flush()
         call self%file%stage_group('/history')
         call create_history_columns(self%file, self%expected_rows)
      end if
      call append_values(self%file, self%rows, row_values(row))
      if (self%rows == 0) then
         call self%file%publish_group()
      else
         call self%file%flush()
      end if
      call self%file%report(error)
      if (.not. allocated(error)) self%rows = self%rows + 1
   end subroutine append_row

   ! --- snapshots ----------------------------------------------------------------------------

   !> Start a snapshot.
   subroutine begin_snapshot(self, step, time, phase, error, at_stop)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: step           !! row of the history
      real(dp), intent(in) :: time          !! s
      integer, intent(in) :: phase          !! number of the phase, from 1
      type(error_type), allocatable, intent(out), optional :: error
      logical, intent(in), optional :: at_stop   !! written by a stop; default no

      call self%snapshots%begin(self%file, step, time, phase, at_stop)
      call self%file%report(error)
   end subroutine begin_snapshot

   !> Start a field of the snapshot under construction, which is then written in slabs of rows.
   subroutine start_field(self, name, rows, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name      !! one of `known_fields`, such as 'pressure'
      integer, intent(out) :: rows          !! of each slab; the last one may have fewer
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault

      rows = slab_rows(self%grid%nx)
      call self%snapshots%start_field(self%file, self%writer, name, self%grid, self%compression, fault)
      call self%file%settle(fault, error)
   end subroutine start_field

   !> Add the height of a road that has not moved to the snapshot under construction.
   subroutine copy_height(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault

      call self%snapshots%copy_height(self%file, self%writer, fault)
      call self%file%settle(fault, error)
   end subroutine copy_height

   !> Write a slab of the field that was started last.
   subroutine write_real_rows(self, first, values, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: first                     !! first row, from 1
      real(dp), intent(in), contiguous :: values(:, :) !! [nx, rows]
      type(error_type), allocatable, intent(out), optional :: error

      call self%writer%add(self%file, first, values)
      call self%file%report(error)
   end subroutine write_real_rows

   !> Write a slab of a field of contact states, as `write_real_rows` does for numbers.
   subroutine write_state_rows(self, first, values, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: first
      integer(int8), intent(in), contiguous :: values(:, :)
      type(error_type), allocatable, intent(out), optional :: error

      call self%writer%add(self%file, first, values)
      call self%file%report(error)
   end subroutine write_state_rows

   !> Let the snapshot appear in the result. It appears in the XDMF file, too, unless that already lists many: the whole
   !> list is written each time, which would take longer than the run if it were done for each of thousands of snapshots.
   subroutine end_snapshot(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%writer%finish(self%file)
      call self%snapshots%finish(self%file, self%grid, self%compression, error)
      if (modulo(size(self%snapshots%written), renewal) == 0) call self%file%renew(error)
      if (size(self%snapshots%written) - self%listed > self%listed/many_listed) call self%list_snapshots(error)
   end subroutine end_snapshot

   !> List all snapshots in the XDMF file, if it lacks some.
   subroutine list_snapshots(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (self%listed == size(self%snapshots%written)) return
      call write_xdmf(self%xdmf_path, self%path, self%grid, self%snapshots%written, error)
      if (.not. allocated(error)) self%listed = size(self%snapshots%written)
   end subroutine list_snapshots

   !> Row of the last snapshot; -1 if there is none.
   pure function last_snapshot(self) result(step)
      class(result_file_type), intent(in) :: self
      integer :: step

      step = self%snapshots%last()
   end function last_snapshot

   !> Write where a state of steady sliding loses its energy, as a group /losses/NNNNNN.
   subroutine write_losses(self, step, wavelength, octave, prony_tau, arm, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: step                          !! row of the history
      real(dp), intent(in), contiguous :: wavelength(:)    !! longest of each octave, m
      real(dp), intent(in), contiguous :: octave(:)        !! rate of loss of each octave, W
      real(dp), intent(in), contiguous :: prony_tau(:)     !! relaxation time of each arm, s
      real(dp), intent(in), contiguous :: arm(:)           !! rate of loss of each arm, W
      type(error_type), allocatable, intent(out) :: error

      call put_losses(self%file, step, wavelength, octave, prony_tau, arm, self%compression)
      call self%file%publish_group(error)
   end subroutine write_losses

   ! --- the checkpoint, the end, and a restart -----------------------------------------------

   !> Add the link /checkpoint to the file of the checkpoint (see `checkpoint_link`).
   subroutine link_checkpoint(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error

      call add_link(self%file, self%path, error)
   end subroutine link_checkpoint

   !> Remove the link /checkpoint.
   subroutine unlink_checkpoint(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error

      call remove_link(self%file, error)
   end subroutine unlink_checkpoint

   !> Get the first fault of the calls that had no `error`.
   subroutine report(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%report(error)
   end subroutine report

   !> Write whether the run has finished, as the attribute `finished`: 1 or 0.
   subroutine finish_result(self, finished, error)
      class(result_file_type), intent(inout) :: self
      logical, intent(in) :: finished
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error)) return
      call self%file%write_attribute('/', 'finished', merge(1, 0, finished))
      call self%file%flush(error)
   end subroutine finish_result

   !> Close the file.
   subroutine close_result(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%writer%finish(self%file)
      call self%file%close(error)
   end subroutine close_result

   !> Open a result to continue it after a given row. Later rows and snapshots are removed.
   subroutine reopen_result(self, path, id, last_step, compression, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: id        !! of the result that the checkpoint belongs to
      integer, intent(in) :: last_step      !! the last row to keep, from 0
      integer, intent(in) :: compression    !! of fields, 0 none to 9 smallest
      type(error_type), allocatable, intent(out) :: error

      self%path = trim(path)
      self%compression = compression
      self%xdmf_path = sibling_path(path, '.xdmf')
      if (file_exists(self%path) .and. file_start(self%path, 1) == '') then
         call fail(error, error_file, self%path//': is empty: --overwrite starts the run again')
         return
      end if
      call self%file%open(self%path, 'append')
      call self%read_text('id', self%id)
      call self%report(error)
      if (.not. allocated(error)) then
         if (self%id /= id) call fail(error, error_input, self%path//': is not the result that '// &
            checkpoint_path(path)//' belongs to')
      end if
      call go_back(self%file, last_step, self%grid, self%expected_rows, self%snapshots%written, error)
      call self%finish(.false., error)
      self%listed = -1                ! the list may be older or newer than the result
      call self%list_snapshots(error)
      self%rows = last_step + 1
      if (allocated(error)) call self%file%close()
   end subroutine reopen_result

end module result_file
