!> A run of a case with its result file: rows, snapshots, checkpoints, the restart.
!>
!> The program and the Python package drive it alike: `open`, `step` until `finished`, `close`. A stop
!> between two steps writes a checkpoint; a failing solver keeps all there is in the result.
!>
!> Several processes do the same, each on its rows of the fields. The first one has the files; what
!> fails on one process fails on all of them, with the same message (module `process_agreement`).
module case_run
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use case_identity, only : identity_of
   use case_record, only : checksums_of_maps, map_lines, write_material
   use case_memory, only : memory_needed
   use case_report, only : resolved_input
   use case_settings, only : case_type
   use asperity_checkpoint, only : checkpoint_path, checkpoint_reader_type, checkpoint_writer_type, &
      remove_checkpoint
   use asperity_errors, only : error_convergence, error_input, error_type, fail
   use file_lock, only : file_lock_type
   use history_row, only : row_values
   use memory_limits, only : need_memory
   use asperity_parallel, only : exchanged_bytes, global_max, is_first_process, process_count, &
      processes_of_machine, share
   use asperity_threads, only : set_threads
   use path_identity, only : real_path
   use process_agreement, only : agree
   use regular_grid, only : grid_type
   use asperity_precision, only : dp, int64
   use result_file, only : result_file_type, result_plan_type
   use result_names, only : sibling_path
   use result_target, only : check_place, check_replaced, damage_of_result
   use asperity_schedule, only : count_rows
   use steady_losses, only : longest_wave
   use asperity_simulation, only : new_simulation, simulation_type
   use simulation_state, only : load_state, save_state
   use snapshot_writer, only : write_height, write_snapshot
   use text_tools, only : to_text
   implicit none
   private

   public :: run_type

   !> A run in hand. Not to be copied.
   type :: run_type
      type(simulation_type) :: sim
      integer :: rows = 0                          !! rows of the whole run
      logical :: finished = .false.
      character(:), allocatable :: warnings        !! new ones, a line each; the caller clears them
      character(:), allocatable, private :: all_warnings
      type(result_file_type), private :: result
      type(file_lock_type), private :: lock        !! no other run writes this result meanwhile
      character(:), allocatable, private :: path   !! of the result
      character(:), allocatable, private :: settings   !! every resolved setting, one per line
      character(:), allocatable, private :: identity   !! what must agree for a restart
      integer, private :: next_time = 1            !! next of the times for snapshots
      integer, private :: last_snapshot = -1       !! row of the last snapshot
      integer(int64), private :: saved_at = 0      !! clock of the last checkpoint
   contains
      procedure :: open => open_run
      procedure :: step => step_run
      procedure :: interrupt => interrupt_run
      procedure :: save => save_run
      procedure :: close => close_run
   end type run_type

contains

   !> Prepare a run and its result, or take an interrupted one up again.
   subroutine open_run(self, case, restart, overwrite, error)
      class(run_type), intent(inout) :: self
      type(case_type), intent(in) :: case
      logical, intent(in) :: restart               !! go on from the checkpoint of the result
      logical, intent(in) :: overwrite             !! replace an unfinished run and its checkpoint
      type(error_type), allocatable, intent(out) :: error

      call set_threads(case%solver%threads)
      self%path = trim(case%output%file)
      self%warnings = ''
      self%all_warnings = ''
      self%rows = count_rows(case%phases)
      self%finished = .false.
      self%next_time = 1
      self%last_snapshot = -1
      call system_clock(self%saved_at)
      if (is_first_process()) call take_place(self, restart, overwrite, error)
      call agree(error)
      if (allocated(error)) return
      call look_at_memory(case, error)
      if (allocated(error)) return
      call new_simulation(self%sim, case, error)
      call agree(error)
      if (allocated(error)) return
      self%settings = resolved_input(self%sim%case)
      self%identity = identity_of(self%settings)//map_lines(self%sim)
      if (restart) then
         call take_up(self, error)
      else
         call create_result(self, error)
      end if
      call collect_warnings(self)
   end subroutine open_run

   !> See that every machine has the memory that its processes need. Collective.
   subroutine look_at_memory(case, error)
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(out) :: error
      type(grid_type) :: grid

      grid = case%grid
      call grid%share_rows()
      call need_memory(memory_needed(case, nint(global_max(real(grid%rows(), dp)))), 'the run', error, &
         processes_of_machine())
      call agree(error)
   end subroutine look_at_memory

   !> See that the result can be written where the case wants it, that no other run writes it, and
   !> that nothing is lost by it.
   subroutine take_place(self, restart, overwrite, error)
      type(run_type), intent(inout) :: self
      logical, intent(in) :: restart, overwrite
      type(error_type), allocatable, intent(out) :: error
      logical :: exists

      call check_place(self%path, error)
      if (allocated(error)) return
      ! A link to a result has the lock of the result.
      call self%lock%acquire(sibling_path(real_path(self%path), '.lock'), self%path, error)
      if (allocated(error)) return
      if (restart) then
         inquire (file=self%path, exist=exists)
         if (exists) call damage_of_result(self%path, error)
      else if (.not. overwrite) then
         call check_replaced(self%path, error)
      end if
   end subroutine take_place

   !> Create a result with everything that is known before the first row.
   subroutine create_result(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(result_plan_type) :: plan

      associate (case => self%sim%case)
         plan%title = trim(case%title)
         plan%input = case%input
         plan%settings = self%settings
         plan%rows = self%rows
         plan%snapshots = size(case%output%snapshot_times) + 1
         if (case%output%snapshot_every > 0) &
            plan%snapshots = plan%snapshots + self%rows/case%output%snapshot_every
         if (self%sim%has_steady) plan%losses = count(case%phases%steady)
         plan%compression = case%output%compression
         if (is_first_process()) call self%result%create(self%path, self%sim%grid, plan, error)
         call agree(error)
         if (allocated(error)) return
         call write_height(self%result, self%sim)
         if (is_first_process()) then
            call self%result%publish(error)
            if (.not. allocated(error)) then
               call write_material(self%result, case%material)
               call self%result%write_text('height_maps', checksums_of_maps(self%sim))
               call self%result%write_text('warnings', case%warnings)
               call self%result%write_text('outcome', 'running')
               call self%result%report(error)
            end if
         end if
      end associate
      call agree(error)
   end subroutine create_result

   !> Go on from the checkpoint: the state, and a result without what came later.
   subroutine take_up(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_reader_type) :: reader

      if (is_first_process()) call open_checkpoint(self, reader, error)
      call agree(error)
      if (allocated(error)) return
      call load_state(self%sim, reader, error)
      if (is_first_process()) then
         call reader%close()
         if (.not. allocated(error)) call take_up_result(self, reader%result_id, error)
      end if
      call agree(error)
      if (allocated(error)) return
      self%finished = self%sim%finished
      call share(self%last_snapshot)
      associate (times => self%sim%case%output%snapshot_times)
         do while (self%next_time <= size(times))
            if (times(self%next_time) > self%sim%state%row%time) exit
            self%next_time = self%next_time + 1
         end do
      end associate
   end subroutine take_up

   !> Open the checkpoint, and see that it is that of the case. On the first process.
   subroutine open_checkpoint(self, reader, error)
      type(run_type), intent(in) :: self
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error

      call reader%open(self%path, error)
      if (allocated(error)) return
      call reader%compare(self%identity, error)
      if (.not. allocated(error)) call compare_map(self, reader, error)
      if (allocated(error)) call reader%close()
   end subroutine open_checkpoint

   !> Open the result to go on after the last row of the checkpoint. On the first process.
   subroutine take_up_result(self, id, error)
      type(run_type), intent(inout) :: self
      character(*), intent(in) :: id               !! of the result that the checkpoint belongs to
      type(error_type), allocatable, intent(out) :: error

      call self%result%reopen(self%path, id, self%sim%state%row%step, &
         self%sim%case%output%compression, error)
      if (allocated(error)) return
      self%last_snapshot = self%result%last_snapshot()
      call self%result%write_text('outcome', 'running', error)
      if (.not. allocated(error)) call take_up_warnings(self, error)
   end subroutine take_up_result

   !> See that the height map is that of the checkpoint. Maps from files are bound by their checksums
   !> in the identity; a map that is computed may differ by rounding on another machine.
   subroutine compare_map(self, reader, error)
      type(run_type), intent(in) :: self
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      real(dp), parameter :: rounding = 1e-9_dp
      real(dp) :: rms_height, summit, allowed

      call reader%get_number('rms_height', rms_height, error)
      if (allocated(error)) return
      call reader%get_number('summit', summit, error)
      if (allocated(error)) return
      allowed = rounding*max(self%sim%rms_height, abs(self%sim%summit))
      if (abs(rms_height - self%sim%rms_height) <= allowed .and. &
         abs(summit - self%sim%summit) <= allowed) return
      call fail(error, error_input, checkpoint_path(self%path)//': the height map has the rms height '// &
         to_text(rms_height)//' m and the summit '//to_text(summit)//' m in the checkpoint, '// &
         to_text(self%sim%rms_height)//' m and '//to_text(self%sim%summit)//' m in the case')
   end subroutine compare_map

   !> The warnings that the run had left, but for those of rows that are done again.
   subroutine take_up_warnings(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: left, line
      integer :: at, next, step, status

      call self%result%read_text('run_warnings', left, error)
      if (allocated(error)) return
      at = 1
      do while (at <= len(left))
         next = index(left(at:), new_line('a'))
         if (next == 0) next = len(left) - at + 2
         line = left(at:at + next - 2)
         at = at + next
         read (line(min(6, len(line)):max(5, index(line, ',') - 1)), *, iostat=status) step
         if (status == 0 .and. step > self%sim%state%row%step) cycle
         if (len(self%all_warnings) > 0) self%all_warnings = self%all_warnings//new_line('a')
         self%all_warnings = self%all_warnings//line
      end do
   end subroutine take_up_warnings

   !> Leave in the result how the run ended, and what it warned of. Collective.
   subroutine leave_word(self, outcome, error)
      type(run_type), intent(inout) :: self
      character(*), intent(in) :: outcome
      type(error_type), allocatable, intent(out) :: error

      if (is_first_process()) then
         if (len(self%all_warnings) > 0) &
            call self%result%write_text('run_warnings', self%all_warnings, error)
         if (.not. allocated(error)) call self%result%write_text('outcome', outcome, error)
      end if
      call agree(error)
   end subroutine leave_word

   !> Do a row, and write what is due. With status error_convergence the row is kept all the same. A row
   !> that is given up because a stop was asked for leaves the run as it was.
   subroutine step_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: outcome

      call self%sim%advance(error)
      call agree(error)
      if (allocated(error) .or. self%sim%stop%given_up) return
      if (.not. all(ieee_is_finite(row_values(self%sim%state%row)))) then
         self%sim%converged = .false.
         self%sim%reason = 'a value is not a finite number'
      end if
      self%finished = self%sim%finished
      call collect_warnings(self)
      if (is_first_process()) call write_row(self, error)
      call agree(error)
      if (allocated(error)) return
      if (snapshot_due(self)) call snapshot(self, error)
      if (allocated(error)) return
      if (.not. self%sim%converged) then
         outcome = 'step '//to_text(self%sim%state%row%step)//' of phase '//to_text(self%sim%state%row%phase)// &
            ', t = '//to_text(self%sim%state%row%time)//' s: the solver did not converge: '// &
            trim(self%sim%reason)//'; residual '//to_text(self%sim%residual)//', allowed '// &
            to_text(self%sim%allowed)
         call leave_word(self, outcome, error)
         if (allocated(error)) return
         call fail(error, error_convergence, self%path//': '//outcome// &
            '; all steps up to this one are kept')
         return
      end if
      if (self%finished) then
         call finish_run(self, error)
      else if (checkpoint_due(self)) then
         call self%save(error)
      end if
   end subroutine step_run

   !> The run is complete: there is nothing to go on with. Collective.
   subroutine finish_run(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: exchanged

      exchanged = exchanged_bytes()
      if (is_first_process()) then
         call self%result%write_number('processes', real(process_count(), dp))
         call self%result%write_number('exchanged_bytes', exchanged)
         call self%result%unlink_checkpoint(error)
         if (.not. allocated(error)) call remove_checkpoint(self%path)
      end if
      call agree(error)
      if (allocated(error)) return
      call leave_word(self, 'finished', error)
      if (allocated(error)) return
      if (is_first_process()) call self%result%finish(.true., error)
      call agree(error)
   end subroutine finish_run

   !> Write the last row of the history and, if it is one of steady sliding, where it loses its energy. On
   !> the first process.
   subroutine write_row(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: k

      call self%result%append_row(self%sim%state%row, error)
      if (allocated(error) .or. .not. self%sim%state%steady%now) return
      associate (losses => self%sim%steady%losses)
         call self%result%write_losses(self%sim%state%row%step, &
            [(longest_wave(self%sim%grid)/2.0_dp**(k - 1), k = 1, size(losses%octave))], losses%octave, &
            self%sim%case%material%prony_tau, losses%arm, error)
      end associate
   end subroutine write_row

   !> Is a snapshot of the last row due?
   function snapshot_due(self) result(due)
      type(run_type), intent(inout) :: self
      logical :: due
      real(dp) :: now

      associate (output => self%sim%case%output)
         due = self%finished .or. .not. self%sim%converged
         if (output%snapshot_every > 0) &
            due = due .or. mod(self%sim%state%row%step, output%snapshot_every) == 0
         ! A time counts as reached within round-off.
         now = self%sim%state%row%time*(1.0_dp + 1e-12_dp)
         do while (self%next_time <= size(output%snapshot_times))
            if (output%snapshot_times(self%next_time) > now) exit
            due = .true.
            self%next_time = self%next_time + 1
         end do
      end associate
   end function snapshot_due

   !> Write the fields that were asked for.
   subroutine snapshot(self, error, at_stop)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: at_stop     !! written for a stop only: a restart drops it

      call write_snapshot(self%result, self%sim, error, at_stop)
      self%last_snapshot = self%sim%state%row%step
   end subroutine snapshot

   !> Is a checkpoint due after the last row? The clock of the first process says so to all. Collective.
   function checkpoint_due(self) result(due)
      type(run_type), intent(in) :: self
      logical :: due
      integer(int64) :: now, rate

      associate (output => self%sim%case%output)
         due = .false.
         if (output%checkpoint_every > 0) &
            due = mod(self%sim%state%row%step, output%checkpoint_every) == 0 .and. self%sim%state%row%step > 0
         if (output%checkpoint_minutes > 0.0_dp) then
            call system_clock(now, rate)
            due = due .or. real(now - self%saved_at, dp) > 60.0_dp*output%checkpoint_minutes*rate
            call share(due)
         end if
      end associate
   end function checkpoint_due

   !> Write a checkpoint of the state after the last row.
   subroutine save_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_writer_type) :: writer

      if (is_first_process()) then
         call writer%start(self%path, self%result%id, self%identity)
         call writer%put_number('rms_height', self%sim%rms_height)
         call writer%put_number('summit', self%sim%summit)
      end if
      call save_state(self%sim, writer)
      if (is_first_process()) then
         call writer%commit(error)                 ! reports the first fault of all these calls
         if (.not. allocated(error)) call self%result%link_checkpoint(error)
      end if
      call agree(error)
      call system_clock(self%saved_at)
   end subroutine save_run

   !> Stop between two steps: a snapshot of where the run stands, and a checkpoint. A snapshot that
   !> is not due is dropped by a restart: the result is that of a run that never stopped. After a row
   !> that was given up there is no snapshot, because slip and road are not part of the state.
   subroutine interrupt_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (self%sim%state%row%step > self%last_snapshot .and. self%sim%state%schedule%row >= 0 .and. &
         .not. self%sim%stop%given_up) call snapshot(self, error, at_stop=.true.)
      if (allocated(error)) return
      if (self%sim%state%schedule%row < 0) then
         call leave_word(self, 'stopped before the first row', error)
         return
      end if
      call leave_word(self, 'stopped after step '//to_text(self%sim%state%row%step), error)
      if (.not. allocated(error)) call self%save(error)
   end subroutine interrupt_run

   !> Close the result and free everything.
   subroutine close_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (is_first_process()) call self%result%close(error)
      call self%sim%destroy()
      if (is_first_process()) call self%lock%release()
      call agree(error)
   end subroutine close_run

   !> New warnings of the simulation, for the caller.
   subroutine collect_warnings(self)
      type(run_type), intent(inout) :: self

      if (.not. allocated(self%sim%warnings)) return
      if (len(self%sim%warnings) == 0) return
      if (len(self%warnings) > 0) self%warnings = self%warnings//new_line('a')
      self%warnings = self%warnings//self%sim%warnings
      if (len(self%all_warnings) > 0) self%all_warnings = self%all_warnings//new_line('a')
      self%all_warnings = self%all_warnings//self%sim%warnings
      self%sim%warnings = ''
   end subroutine collect_warnings

end module case_run
