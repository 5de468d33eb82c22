!> A run of a case with its files: rows, snapshots, checkpoints and restarts.
!>
!> The program and the Python package use it in the same way: `open`, `step` until `finished`, `close`. A stop
!> between two steps writes a checkpoint. If a solver fails, the result keeps all rows so far.
!>
!> Several processes do the same work, each on its rows of the fields. Module `run_files` handles the files. Only
!> the first process opens them, and a fault on one process ends all of them with the same message.
module case_run
   use asperity_errors, only : error_convergence, error_type, fail
   use asperity_parallel, only : is_first_process, processes_of_machine, share
   use asperity_precision, only : dp
   use asperity_schedule, only : count_rows
   use asperity_simulation, only : new_simulation, simulation_type
   use asperity_threads, only : set_threads
   use case_files, only : refuse_overwriting
   use case_memory, only : memory_needed
   use case_settings, only : case_type
   use memory_limits, only : need_memory
   use process_agreement, only : agree
   use rising_clock, only : seconds_now
   use run_files, only : run_files_type
   use text_tools, only : add_line, to_text
   use wisdom, only : wisdom_warning
   implicit none
   private

   public :: run_type

   !> A run. A variable of this type must not be copied.
   type :: run_type
      type(simulation_type) :: sim
      integer :: rows = 0                          !! rows of the whole run
      logical :: finished = .false.
      character(:), allocatable :: warnings        !! new ones, one per line; the caller clears them
      real(dp) :: longest_step = 0.0_dp            !! wall time of a row with its output, without checkpoints, s
      real(dp) :: longest_save = 0.0_dp            !! wall time of a checkpoint, s
      type(run_files_type), private :: files
      integer, private :: next_time = 1            !! next of the times for snapshots
      integer, private :: last_snapshot = -1       !! row of the last snapshot
      real(dp), private :: saved_at = 0.0_dp       !! clock at the last checkpoint, s
   contains
      procedure :: open => open_run
      procedure :: step => step_run
      procedure :: interrupt => interrupt_run
      procedure :: save => save_run
      procedure :: close => close_run
   end type run_type

contains

   !> Prepare a run and its result, or continue an interrupted run.
   subroutine open_run(self, case, restart, overwrite, error)
      class(run_type), intent(inout) :: self
      type(case_type), intent(in) :: case
      logical, intent(in) :: restart               !! continue from the checkpoint of the result
      logical, intent(in) :: overwrite             !! replace an unfinished run and its checkpoint
      type(error_type), allocatable, intent(out) :: error

      call case%check_read(error)
      if (allocated(error)) return
      call set_threads(case%solver%threads)
      self%warnings = ''
      self%rows = count_rows(case%phases)
      self%finished = .false.
      self%next_time = 1
      self%last_snapshot = -1
      self%longest_step = 0.0_dp
      self%longest_save = 0.0_dp
      self%saved_at = seconds_now()
      if (is_first_process()) call refuse_overwriting(case, error)
      call agree(error)
      if (allocated(error)) return
      call self%files%lock_place(trim(case%output%file), restart, overwrite, error)
      call check_memory(case, error)
      if (.not. allocated(error)) call new_simulation(self%sim, case, error)
      call agree(error)
      if (allocated(error)) return
      if (restart) then
         call resume(self, error)
      else
         call self%files%begin(self%sim, self%rows, error)
      end if
      call collect_warnings(self)
      ! This warning is about the user's machine. It is not written to the result.
      if (len(wisdom_warning()) > 0) call add_line(self%warnings, wisdom_warning())
   end subroutine open_run

   !> Check that every machine has the memory that its processes need. Collective.
   subroutine check_memory(case, error)
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error)) return
      call need_memory(memory_needed(case, case%grid%most_rows()), 'the run', error, processes_of_machine())
      call agree(error)
   end subroutine check_memory

   !> Continue from the checkpoint.
   subroutine resume(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%files%resume(self%sim, self%last_snapshot, error)
      if (allocated(error)) return
      self%finished = self%sim%finished
      associate (times => self%sim%case%output%snapshot_times)
         do while (self%next_time <= size(times))
            if (times(self%next_time) > reached_time(self)) exit
            self%next_time = self%next_time + 1
         end do
      end associate
   end subroutine resume

   !> Do a row, and write what is due. A row with the status error_convergence is kept, too. A row that is
   !> given up because a stop was requested does not change the run.
   subroutine step_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: before

      before = seconds_now()
      call self%sim%advance(error)
      call agree(error)
      if (allocated(error) .or. self%sim%stop%given_up) return
      self%finished = self%sim%finished
      call collect_warnings(self)
      call self%files%write_row(self%sim, error)
      if (snapshot_due(self)) call snapshot(self, error)
      self%longest_step = max(self%longest_step, seconds_now() - before)
      if (.not. self%sim%converged) then
         call end_unconverged(self, error)
      else if (self%finished) then
         call self%files%finish(error)
      else if (checkpoint_due(self)) then
         call self%save(error)
      end if
   end subroutine step_run

   !> Record in the result that the solver did not converge, and return an error.
   subroutine end_unconverged(self, error)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! an error that is already set is not replaced
      character(:), allocatable :: outcome

      outcome = self%sim%failure()
      call self%files%write_outcome(outcome, error)
      if (.not. allocated(error)) call fail(error, error_convergence, self%files%path//': '//outcome// &
         '; the history ends with this step, and all steps before it have converged')
   end subroutine end_unconverged

   !> The latest time that counts as reached by the last row: within round-off, s.
   pure function reached_time(self) result(time)
      type(run_type), intent(in) :: self
      real(dp) :: time

      time = self%sim%state%row%time*(1.0_dp + 1e-12_dp)
   end function reached_time

   !> Is a snapshot of the last row due?
   function snapshot_due(self) result(due)
      type(run_type), intent(inout) :: self
      logical :: due
      real(dp) :: now

      associate (output => self%sim%case%output)
         due = self%finished .or. .not. self%sim%converged
         if (output%snapshot_every > 0) &
            due = due .or. mod(self%sim%state%row%step, output%snapshot_every) == 0
         now = reached_time(self)
         do while (self%next_time <= size(output%snapshot_times))
            if (output%snapshot_times(self%next_time) > now) exit
            due = .true.
            self%next_time = self%next_time + 1
         end do
      end associate
   end function snapshot_due

   !> Write the requested fields.
   subroutine snapshot(self, error, at_stop)
      type(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is written
      logical, intent(in), optional :: at_stop     !! written for a stop only: a restart drops it

      call self%files%snapshot(self%sim, error, at_stop)
      if (.not. allocated(error)) self%last_snapshot = self%sim%state%row%step
   end subroutine snapshot

   !> Is a checkpoint due after the last row? All processes go by the clock of the first one. Collective.
   function checkpoint_due(self) result(due)
      type(run_type), intent(in) :: self
      logical :: due

      associate (output => self%sim%case%output)
         due = .false.
         if (output%checkpoint_every > 0) &
            due = mod(self%sim%state%row%step, output%checkpoint_every) == 0 .and. self%sim%state%row%step > 0
         if (output%checkpoint_minutes > 0.0_dp) then
            due = due .or. seconds_now() - self%saved_at > 60.0_dp*output%checkpoint_minutes
            call share(due)
         end if
      end associate
   end function checkpoint_due

   !> Write a checkpoint of the state after the last row. Before the first row there is nothing to write.
   subroutine save_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is written
      real(dp) :: before

      if (self%sim%state%schedule%row < 0) return
      before = seconds_now()
      call self%files%save(self%sim, error)
      self%saved_at = seconds_now()
      self%longest_save = max(self%longest_save, self%saved_at - before)
   end subroutine save_run

   !> Stop between two steps: write a snapshot of the present state, and a checkpoint. A restart removes a
   !> snapshot that was not due, so that the result equals that of a run that never stopped. After a row that was
   !> given up, or a restart without a new row, there is no snapshot, because the slip is not part of the state.
   subroutine interrupt_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (self%sim%state%row%step > self%last_snapshot .and. self%sim%state%schedule%row >= 0 .and. &
         self%sim%slip_known .and. .not. self%sim%stop%given_up) call snapshot(self, error, at_stop=.true.)
      if (self%sim%state%schedule%row < 0) then
         call self%files%write_outcome('stopped before the first row', error)
      else
         call self%files%write_outcome('stopped after step '//to_text(self%sim%state%row%step), error)
      end if
      call self%save(error)
   end subroutine interrupt_run

   !> Close the result and free everything.
   subroutine close_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%files%close(error)
      call self%sim%destroy()
   end subroutine close_run

   !> Move new warnings from the simulation to the caller and to the result.
   subroutine collect_warnings(self)
      type(run_type), intent(inout) :: self

      if (.not. allocated(self%sim%warnings)) return
      if (len(self%sim%warnings) == 0) return
      call add_line(self%warnings, self%sim%warnings)
      call self%files%note_warnings(self%sim%warnings)
      self%sim%warnings = ''
   end subroutine collect_warnings

end module case_run
