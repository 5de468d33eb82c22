!> Calls from Python for simulations that are advanced row by row and write no files. See `flat_runs` for the
!> rules.
module flat_simulations
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type
   use asperity_errors, only : error_convergence, error_type, fail
   use asperity_signals, only : stop_was_asked
   use asperity_threads, only : set_threads
   use asperity_schedule, only : count_rows
   use asperity_simulation, only : new_simulation
   use case_identity, only : identity_of
   use case_memory, only : memory_needed
   use case_record, only : map_lines
   use case_report, only : resolved_input
   use case_settings, only : case_type
   use flat_answers, only : case_of, report, take_warnings
   use memory_limits, only : need_memory
   use run_handles, only : driven_of, driven_type, find_driven, free_handle, new_driven
   use simulation_state, only : load_state, save_state
   use steering, only : steer_load, steer_temperature, steer_velocity
   use text_tools, only : next_line
   implicit none
   private

   public :: simulation_close, simulation_load, simulation_open, simulation_progress, simulation_save, &
      simulation_steer, simulation_step

contains

   !> Prepare a simulation that writes no files.
   subroutine simulation_open(path, text, threads, handle, rows, nx, ny, lx, ly, warnings, status, &
      message)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: text                 !! the input; empty: that of the file
      integer(c_int), intent(in) :: threads                !! 0: as in the case
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: rows                  !! rows of the whole history
      integer(c_int), intent(out) :: nx, ny
      real(c_double), intent(out) :: lx, ly
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error
      type(case_type) :: case
      type(driven_type), pointer :: driven
      integer :: number
!f2py threadsafe

      handle = 0
      rows = 0
      nx = 0
      ny = 0
      lx = 0.0_c_double
      ly = 0.0_c_double
      warnings = ''

      call case_of(path, text, case, error)
      if (.not. allocated(error)) call new_driven(number, driven, error)
      if (.not. allocated(error)) then
         if (threads > 0) case%solver%threads = threads
         call set_threads(case%solver%threads)
         warnings = case%warnings
         call need_memory(memory_needed(case), 'the simulation', error)
         if (.not. allocated(error)) call new_simulation(driven%sim, case, error, &
            movable=.not. all(case%phases%static))
         if (allocated(error)) then
            call free_handle(number)
         else
            driven%settings = without_files(identity_of(resolved_input(case)))//map_lines(driven%sim)
            driven%start_tau = case%material%prony_tau
            driven%start_temperature = case%material%temperature
            handle = number
            rows = count_rows(case%phases)
            nx = case%grid%nx
            ny = case%grid%ny
            lx = case%grid%lx
            ly = case%grid%ly
            call take_warnings(driven%sim%warnings, warnings)
         end if
      end if
      call report(error, status, message)
   end subroutine simulation_open

   !> Remove the names of height maps from the settings, because their checksums show whether they are the same.
   function without_files(settings) result(kept)
      character(len=*), intent(in) :: settings             !! lines 'group: name = value'
      character(:), allocatable :: kept, line
      integer :: at

      kept = ''
      at = 1
      do while (at <= len(settings))
         call next_line(settings, at, line)
         if (index(line, ': file = ') == 0) kept = kept//line//new_line('a')
      end do
   end function without_files

   !> Do a row. If a solver does not converge, the state that it has reached is kept, and the status shows it.
   subroutine simulation_step(handle, finished, warnings, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
!f2py threadsafe

      finished = 1
      warnings = ''
      call find_driven(int(handle), driven, error)
      if (.not. allocated(error)) then
         associate (sim => driven%sim)
            sim%stop%asked => stop_was_asked     ! between `await_interrupts` and `end_interrupts`
            sim%stop%patience = 0.0_c_double
            if (.not. sim%finished) call sim%advance(error)
            finished = merge(1, 0, sim%finished)
            call take_warnings(sim%warnings, warnings)
            if (.not. allocated(error) .and. .not. sim%converged) &
               call fail(error, error_convergence, sim%failure())
         end associate
      end if
      call report(error, status, message)
   end subroutine simulation_step

   !> How far a simulation has come. Ctrl-C may arrive when a row has just ended, so that its caller does not know.
   subroutine simulation_progress(handle, started, finished, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: started               !! 1: there is a row
      integer(c_int), intent(out) :: finished              !! 1: no row is left, or the last one did not converge
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven

      started = 0
      finished = 0
      call find_driven(int(handle), driven, error)
      if (.not. allocated(error)) then
         started = merge(1, 0, driven%sim%state%schedule%row >= 0)
         finished = merge(1, 0, driven%sim%finished .or. .not. driven%sim%converged)
      end if
      call report(error, status, message)
   end subroutine simulation_progress

   !> Set a load, the velocity or the temperature from the next row on.
   subroutine simulation_steer(handle, what, first, second, status, message)
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: what        !! 'pressure', 'force', 'displacement', 'velocity', 'temperature'
      real(c_double), intent(in) :: first, second !! the second for the velocity along y only
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven

      call find_driven(int(handle), driven, error)
      if (.not. allocated(error)) then
         select case (what)
         case ('velocity')
            call steer_velocity(driven%sim, [first, second], error)
         case ('temperature')
            call steer_temperature(driven%sim, first, driven%start_temperature, driven%start_tau, error)
         case default
            call steer_load(driven%sim, what, first, error)
         end select
      end if
      call report(error, status, message)
   end subroutine simulation_steer

   !> Write the state of a simulation, as a checkpoint of `path`.
   subroutine simulation_save(handle, path, status, message)
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
      type(checkpoint_writer_type) :: writer

      call find_driven(int(handle), driven, error)
      if (.not. allocated(error)) then
         call writer%start(path, 'a simulation', driven%settings)
         call save_state(driven%sim, writer)
         call writer%commit(error)             ! the first fault of the three calls
      end if
      call report(error, status, message)
   end subroutine simulation_save

   !> Read the state of a simulation from the checkpoint of `path`, which `simulation_save` has written.
   subroutine simulation_load(handle, path, finished, status, message)
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
      type(checkpoint_reader_type) :: reader

      finished = 0
      call find_driven(int(handle), driven, error)
      if (.not. allocated(error)) then
         call reader%open(path, error)
         if (.not. allocated(error)) then
            call reader%compare(driven%settings, error)
            if (.not. allocated(error)) call load_state(driven%sim, reader, error)
            call reader%close()
            finished = merge(1, 0, driven%sim%finished)
         end if
      end if
      call report(error, status, message)
   end subroutine simulation_load

   !> Free a simulation. A handle that is not in use is ignored.
   subroutine simulation_close(handle, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven

      driven => driven_of(int(handle))
      if (associated(driven)) call driven%sim%destroy()
      call free_handle(int(handle))
      call report(error, status, message)
   end subroutine simulation_close

end module flat_simulations
