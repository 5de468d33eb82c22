!> Calls from Python for runs that write files, and for the row and the fields of any run.
!>
!> f2py wraps the modules `flat_*`. Their procedures have plain arguments and return a status and a message.
!>
!> Every argument has a C kind under its original name, because f2py maps a renamed kind to a C float without
!> a warning. Arrays have explicit shapes and are passed without copies: an array of shape (ny, nx) in Python
!> has the shape [nx, ny] here. The status is 0 or that of the error. Only one call may be active at a time,
!> because the planner of the FFTs does not allow two.
module flat_runs
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int8
   use asperity_signals, only : catch_stops, give_back_stops, stop_was_asked
   use asperity_simulation, only : simulation_type
   use contact_fields, only : contact_rows, field_rows
   use case_run, only : run_type
   use case_settings, only : case_type
   use flat_answers, only : case_of, put_text, report, take_warnings
   use history_table, only : column_type, history_columns, row_values
   use snapshot_fields, only : known_fields
   use run_handles, only : find_run, find_sim, free_handle, new_run, run_of
   implicit none
   private

   public :: row_columns, run_close, run_field, run_interrupt, run_open, run_row, run_step, snapshot_columns

contains

   !> Read a case, and prepare its run. The handle identifies the run in later calls.
   subroutine run_open(path, text, output, threads, restart, overwrite, handle, rows, first, &
      result_path, warnings, status, message)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: text                 !! the input; empty: that of the file
      character(len=*), intent(in) :: output               !! of the result; blank: as in the case
      integer(c_int), intent(in) :: threads                !! 0: as in the case
      integer(c_int), intent(in) :: restart                !! 1: continue from the checkpoint
      integer(c_int), intent(in) :: overwrite              !! 1: replace an unfinished run
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: rows                  !! rows of the whole history
      integer(c_int), intent(out) :: first                 !! rows done before
      character(len=1024), intent(out) :: result_path
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error, closing
      type(case_type) :: case
      type(run_type), pointer :: run
      integer :: number
!f2py threadsafe

      handle = 0
      rows = 0
      first = 0
      result_path = ''
      warnings = ''

      call case_of(path, text, case, error)
      if (.not. allocated(error)) then
         if (output /= '') case%output%file = output
         if (threads > 0) case%solver%threads = threads
         result_path = case%output%file
         warnings = case%warnings
         call new_run(number, run, error)
      end if

      if (.not. allocated(error)) then
         call run%open(case, restart == 1, overwrite == 1, error)
         if (allocated(error)) then
            call run%close(closing)
            call free_handle(number)
         else
            handle = number
            rows = run%rows
            if (restart == 1) first = run%sim%state%row%step + 1
            call take_warnings(run%warnings, warnings)
         end if
      end if
      call report(error, status, message)
   end subroutine run_open

   !> Do a row of the history. After an error the run must be closed. During the call some signals ask the run to
   !> stop, as they do in the program; a row that is given up does not change the run. A signal that arrived is
   !> sent again at the end, so that its usual handler receives it.
   subroutine run_step(handle, n, signals, finished, step, time, contact_area, friction, warnings, &
      status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: signals(n)             !! their numbers
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      integer(c_int), intent(out) :: step                  !! -1: the row was given up
      real(c_double), intent(out) :: time, contact_area, friction
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run
!f2py threadsafe

      finished = 1
      step = 0
      time = 0.0_c_double
      contact_area = 0.0_c_double
      friction = 0.0_c_double
      warnings = ''
      call find_run(int(handle), run, error)
      if (.not. allocated(error)) then
         run%sim%stop%asked => stop_was_asked
         call catch_stops(signals)
         if (.not. run%finished) call run%step(error)
         call give_back_stops(signals)
         finished = merge(1, 0, run%finished)
         step = run%sim%state%row%step
         if (run%sim%stop%given_up) step = -1
         time = run%sim%state%row%time
         contact_area = run%sim%state%row%contact_area
         friction = run%sim%state%row%friction
         call take_warnings(run%warnings, warnings)
      end if
      call report(error, status, message)
   end subroutine run_step

   !> Write a snapshot and a checkpoint of the present state of a run.
   subroutine run_interrupt(handle, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run

      call find_run(int(handle), run, error)
      if (.not. allocated(error)) call run%interrupt(error)
      call report(error, status, message)
   end subroutine run_interrupt

   !> Close a run. A handle that is not in use is ignored.
   subroutine run_close(handle, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run

      run => run_of(int(handle))
      if (associated(run)) call run%close(error)
      call free_handle(int(handle))
      call report(error, status, message)
   end subroutine run_close

   !> The columns of a row: lines 'name units whole long_name', with whole = 1 for whole numbers.
   subroutine row_columns(most, buffer, length)
      integer(c_int), intent(in) :: most                       !! characters that the buffer holds
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length                    !! of the text; above `most`: none is written
      type(column_type), allocatable :: columns(:)
      character(:), allocatable :: text
      integer :: i

      columns = history_columns()
      text = ''
      do i = 1, size(columns)
         text = text//trim(columns(i)%name)//' '//trim(columns(i)%units)//' '// &
            merge('1', '0', columns(i)%whole)//' '//trim(columns(i)%long_name)//new_line('a')
      end do
      call put_text(text, buffer, length)
   end subroutine row_columns

   !> The fields that a snapshot may contain: lines 'name units frictional long_name', with frictional = 1 for
   !> fields that exist only with friction.
   subroutine snapshot_columns(most, buffer, length)
      integer(c_int), intent(in) :: most                       !! characters that the buffer holds
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length                    !! of the text; above `most`: none is written
      character(:), allocatable :: text
      integer :: i

      text = ''
      do i = 1, size(known_fields)
         text = text//trim(known_fields(i)%name)//' '//trim(known_fields(i)%units)//' '// &
            merge('1', '0', known_fields(i)%frictional)//' '//trim(known_fields(i)%long_name)//new_line('a')
      end do
      call put_text(text, buffer, length)
   end subroutine snapshot_columns

   !> The last row of a run or a simulation, in the order of `row_columns`.
   subroutine run_row(handle, n, values, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n                          !! the number of columns
      real(c_double), intent(inout) :: values(n)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(simulation_type), pointer :: sim
      real(c_double), allocatable :: found(:)

      call find_sim(int(handle), sim, error)
      if (.not. allocated(error)) then
         found = row_values(sim%state%row)
         if (size(found) /= n) call fail(error, error_input, 'a row has another number of columns')
         if (size(found) == n) values = found
      end if
      call report(error, status, message)
   end subroutine run_row

   !> A field of a run or a simulation, as in a snapshot.
   subroutine run_field(handle, name, nx, ny, values, status, message)
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(inout) :: values(nx, ny)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(simulation_type), pointer :: sim
      integer(int8), allocatable :: states(:, :)

      call find_sim(int(handle), sim, error)
      if (allocated(error)) then
         call report(error, status, message)
         return
      end if
      if (nx /= sim%grid%nx .or. ny /= sim%grid%ny) then
         call fail(error, error_input, 'the field has another shape')
      else if (name == 'height') then
         values(:, :) = sim%height
      else if (name == 'contact') then
         allocate (states(nx, ny))
         call contact_rows(sim, 1, states)
         values(:, :) = real(states, dp)
      else
         call field_rows(sim, name, 1, values)
      end if
      call report(error, status, message)
   end subroutine run_field

end module flat_runs
