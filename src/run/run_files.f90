!> The files of a run: its lock, its result and its checkpoint.
!>
!> Only the first process opens the files. All procedures are collective: after a fault on one process all of
!> them return the same error (module `process_agreement`).
!>
!> The procedures whose `error` is `intent(inout)` do nothing if it is already set. A caller may therefore
!> call several in sequence, and check the error once at the end.
module run_files
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type, &
      remove_checkpoint
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : exchanged_bytes, is_first_process, process_count, share
   use asperity_precision, only : dp
   use asperity_simulation, only : simulation_type
   use case_identity, only : identity_of
   use case_memory, only : most_snapshots
   use case_record, only : checksums_of_maps, map_lines, material_record
   use case_report, only : resolved_input
   use file_lock, only : file_lock_type
   use path_identity, only : real_path
   use process_agreement, only : agree
   use result_file, only : result_file_type, result_plan_type
   use result_names, only : checkpoint_path, sibling_path
   use result_target, only : check_place, check_replaced, damage_of_result
   use simulation_state, only : load_state, save_state
   use snapshot_writer, only : write_height, write_snapshot
   use steady_losses, only : longest_wave
   use step_watches, only : step_of_warning
   use text_tools, only : add_line, next_line, to_text
   implicit none
   private

   public :: run_files_type

   !> The files of a run. A variable of this type must not be copied.
   type :: run_files_type
      character(:), allocatable :: path                !! of the result
      type(result_file_type), private :: result
      type(file_lock_type), private :: lock            !! prevents other runs from writing this result
      logical, private :: writes = .false.             !! whether this run has begun to write the result
      character(:), allocatable, private :: settings   !! every resolved setting, one per line
      character(:), allocatable, private :: identity   !! settings that must agree for a restart
      character(:), allocatable, private :: warnings   !! all of the run, one per line
   contains
      procedure :: lock_place
      procedure :: begin
      procedure :: resume
      procedure :: write_row
      procedure :: snapshot
      procedure :: save
      procedure :: note_warnings
      procedure :: write_outcome
      procedure :: finish
      procedure :: close => close_files
   end type run_files_type

contains

   !> Lock the place of the result and check that it may be written.
   subroutine lock_place(self, path, restart, overwrite, error)
      class(run_files_type), intent(inout) :: self
      character(*), intent(in) :: path             !! of the result
      logical, intent(in) :: restart               !! continue from the checkpoint of the result
      logical, intent(in) :: overwrite             !! replace an unfinished run and its checkpoint
      type(error_type), allocatable, intent(out) :: error

      self%path = path
      self%warnings = ''
      if (is_first_process()) call check_and_lock(self, restart, overwrite, error)
      call agree(error)
   end subroutine lock_place

   !> Check that the result can be written under the name that the case gives, that no other run writes it, and
   !> that no data are lost.
   subroutine check_and_lock(self, restart, overwrite, error)
      type(run_files_type), intent(inout) :: self
      logical, intent(in) :: restart, overwrite
      type(error_type), allocatable, intent(out) :: error
      logical :: exists

      call check_place(self%path, error)
      ! If the name is a link, the lock is that of its target.
      call self%lock%acquire(sibling_path(real_path(self%path), '.lock'), self%path, error)
      if (restart) then
         inquire (file=self%path, exist=exists)
         if (exists) call damage_of_result(self%path, error)
      else if (.not. overwrite) then
         call check_replaced(self%path, error)
      end if
   end subroutine check_and_lock

   !> Create a result with everything that is known before the first row.
   subroutine begin(self, sim, rows, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: rows                  !! of the whole run
      type(error_type), allocatable, intent(out) :: error
      type(result_plan_type) :: plan

      call describe(self, sim)
      associate (case => sim%case)
         plan%title = trim(case%title)
         plan%input = case%input
         plan%settings = self%settings
         plan%material = material_record(case%material)
         plan%rows = rows
         plan%snapshots = most_snapshots(case)
         if (sim%has_steady) plan%losses = count(case%phases%steady)
         plan%compression = case%output%compression

         if (is_first_process()) call self%result%create(self%path, sim%grid, plan, error)
         call agree(error)
         self%writes = .not. allocated(error)
         if (allocated(error)) return

         call write_height(self%result, sim)
         if (is_first_process()) then
            call self%result%publish(error)
            if (.not. allocated(error)) then
               call self%result%write_text('height_maps', checksums_of_maps(sim))
               call self%result%write_text('warnings', case%warnings)
               call self%result%write_text('outcome', 'running')
               call self%result%report(error)
            end if
         end if
      end associate
      call agree(error)
   end subroutine begin

   !> Keep the settings of a run, and those that must agree for a restart.
   subroutine describe(self, sim)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim

      self%settings = resolved_input(sim%case)
      self%identity = identity_of(self%settings)//map_lines(sim)
   end subroutine describe

   !> Continue from the checkpoint: read the state, and remove later rows from the result.
   subroutine resume(self, sim, last_snapshot, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim
      integer, intent(out) :: last_snapshot        !! row of the last snapshot in the result; -1 if none
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_reader_type) :: reader
      character(:), allocatable :: warnings        ! unallocated if the checkpoint has none

      last_snapshot = -1
      call describe(self, sim)
      if (is_first_process()) call open_checkpoint(self, sim, reader, error)
      call agree(error)
      if (allocated(error)) return
      call load_state(sim, reader, error)
      if (is_first_process()) then
         if (.not. allocated(error)) call reader%get_text('run_warnings', warnings, error)
         call reader%close()
         call resume_result(self, sim, reader%result_id, error)
         if (.not. allocated(error)) call resume_warnings(self, sim, warnings, error)
         if (.not. allocated(error)) last_snapshot = self%result%last_snapshot()
      end if
      call agree(error)
      if (.not. allocated(error)) call share(last_snapshot)
   end subroutine resume

   !> Open the checkpoint, and check that it belongs to the case. Only the first process calls this.
   subroutine open_checkpoint(self, sim, reader, error)
      type(run_files_type), intent(in) :: self
      type(simulation_type), intent(in) :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error

      call reader%open(self%path, error)
      call reader%compare(self%identity, error)
      call compare_map(self, sim, reader, error)
      if (allocated(error)) call reader%close()
   end subroutine open_checkpoint

   !> Open the result, to continue after the last row of the checkpoint. Only the first process calls this.
   subroutine resume_result(self, sim, id, error)
      type(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      character(*), intent(in) :: id               !! of the result that the checkpoint belongs to
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call self%result%reopen(self%path, id, sim%state%row%step, &
         sim%case%output%compression, error)
      self%writes = .not. allocated(error)
      if (self%writes) call self%result%write_text('outcome', 'running', error)
   end subroutine resume_result

   !> Check that the height map is that of the checkpoint. For maps from files the checksums in the identity ensure
   !> this; a computed map may differ by rounding on another machine.
   subroutine compare_map(self, sim, reader, error)
      type(run_files_type), intent(in) :: self
      type(simulation_type), intent(in) :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(inout) :: error
      real(dp), parameter :: rounding = 1e-9_dp
      real(dp) :: rms_height, summit, allowed

      if (allocated(error)) return
      call reader%get_number('rms_height', rms_height)
      call reader%get_number('summit', summit, error)
      if (allocated(error)) return
      allowed = rounding*max(sim%rms_height, abs(sim%summit))
      if (abs(rms_height - sim%rms_height) <= allowed .and. &
         abs(summit - sim%summit) <= allowed) return
      call fail(error, error_input, checkpoint_path(self%path)//': the height map has the rms height '// &
         to_text(rms_height)//' m and the summit '//to_text(summit)//' m in the checkpoint, '// &
         to_text(sim%rms_height)//' m and '//to_text(sim%summit)//' m in the case')
   end subroutine compare_map

   !> Recover the earlier warnings of the run. Older checkpoints do not have them: the warnings are then read from
   !> the result, which has them if the run was stopped and not killed, except those of rows that are computed again.
   subroutine resume_warnings(self, sim, saved, error)
      type(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      character(:), allocatable, intent(in) :: saved   !! in the checkpoint; unallocated if it has none
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: left, line
      integer :: at

      if (allocated(saved)) then
         self%warnings = saved
         return
      end if
      call self%result%read_text('run_warnings', left, error)
      if (allocated(error)) return
      at = 1
      do while (at <= len(left))
         call next_line(left, at, line)
         if (step_of_warning(line) > sim%state%row%step) cycle
         call add_line(self%warnings, line)
      end do
   end subroutine resume_warnings

   !> Write the last row of the history and, if it is one of steady sliding, its losses by wavelength and arm.
   subroutine write_row(self, sim, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (is_first_process()) call append(self, sim, error)
      call agree(error)
   end subroutine write_row

   !> Write the last row on the first process, which has the file.
   subroutine append(self, sim, error)
      type(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      integer :: k

      call self%result%append_row(sim%state%row, error)
      if (allocated(error) .or. .not. sim%state%steady%now) return
      associate (losses => sim%steady%losses)
         call self%result%write_losses(sim%state%row%step, &
            [(longest_wave(sim%grid)/2.0_dp**(k - 1), k = 1, size(losses%octave))], losses%octave, &
            sim%case%material%prony_tau, losses%arm, error)
      end associate
   end subroutine append

   !> Write the requested fields.
   subroutine snapshot(self, sim, error, at_stop)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(inout) :: error
      logical, intent(in), optional :: at_stop     !! written for a stop only: a restart drops it

      if (.not. allocated(error)) call write_snapshot(self%result, sim, error, at_stop)
   end subroutine snapshot

   !> Write a checkpoint of the state after the last row.
   subroutine save(self, sim, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim
      type(error_type), allocatable, intent(inout) :: error
      type(checkpoint_writer_type) :: writer

      if (allocated(error)) return
      if (is_first_process()) then
         call writer%start(self%path, self%result%id, self%identity)
         call writer%put_number('rms_height', sim%rms_height)
         call writer%put_number('summit', sim%summit)
         call writer%put_text('run_warnings', self%warnings)
      end if
      call save_state(sim, writer)
      if (is_first_process()) then
         call writer%commit(error)                 ! returns the first fault of all these calls
         if (.not. allocated(error)) call self%result%link_checkpoint(error)
      end if
      call agree(error)
   end subroutine save

   !> Keep new warnings for the result.
   subroutine note_warnings(self, lines)
      class(run_files_type), intent(inout) :: self
      character(*), intent(in) :: lines

      call add_line(self%warnings, lines)
   end subroutine note_warnings

   !> Write to the result how the run ended, and its warnings.
   subroutine write_outcome(self, outcome, error)
      class(run_files_type), intent(inout) :: self
      character(*), intent(in) :: outcome
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (is_first_process()) then
         if (len(self%warnings) > 0) call self%result%write_text('run_warnings', self%warnings)
         call self%result%write_text('outcome', outcome)
         call self%result%report(error)            ! the first fault of the two calls above
         call self%result%list_snapshots(error)
      end if
      call agree(error)
   end subroutine write_outcome

   !> Finish the result of a complete run, and then remove its checkpoint. A process that dies in between loses
   !> nothing.
   subroutine finish(self, error)
      class(run_files_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      real(dp) :: exchanged

      if (allocated(error)) return
      exchanged = exchanged_bytes()
      if (is_first_process()) then
         call self%result%write_number('processes', real(process_count(), dp))
         call self%result%write_number('exchanged_bytes', exchanged)
         call self%result%unlink_checkpoint(error)
      end if
      call agree(error)
      call self%write_outcome('finished', error)
      if (is_first_process()) then
         call self%result%finish(.true., error)
         if (.not. allocated(error)) call remove_checkpoint(self%path)
      end if
      call agree(error)
   end subroutine finish

   !> Close the result and release the lock.
   subroutine close_files(self, error)
      class(run_files_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (is_first_process()) then
         call self%result%close(error)
         call self%lock%release(used=self%writes)
      end if
      call agree(error)
   end subroutine close_files

end module run_files
