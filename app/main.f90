!> The program `asperity`: it reads the command line, carries out the command, and ends with an exit
!> status. No other place ends the program.
program main
   use case_files, only : default_result, refuse_overwriting
   use case_input, only : read_case
   use case_run, only : run_type
   use case_report, only : check_report
   use case_settings, only : case_type, path_length
   use case_templates, only : all_template_names, find_template, template_is_available, template_list, &
      template_text
   use copies_guard, only : refuse_copies
   use command_line, only : command_type, help_text, read_command_line
   use asperity_parallel, only : any_process, end_processes, global_max, is_first_process, process_count, share, &
      start_processes
   use asperity_errors, only : error_file, error_input, error_memory, error_type, fail
   use file_kind, only : is_other_than_file
   use hand_over, only : become_python
   use process_agreement, only : agree
   use reference_page, only : reference_markdown
   use row_interrupts, only : limit, must_stop
   use asperity_precision, only : dp
   use asperity_progress, only : progress_type
   use result_summary, only : summarise_result
   use result_target, only : check_place
   use asperity_signals, only : catch_signals, checkpoint_asked, end_with_parent, forget_checkpoint, stop_signal, &
      stop_signal_name
   use standard_streams, only : say, say_error, say_warnings
   use asperity_surface, only : check_files
   use linked_libraries, only : linked_versions
   use text_tools, only : add_line, in_one_line, nearest_name, to_text
   use asperity_version, only : version_number
   use wait_policy, only : wait_passively
   implicit none

   integer, parameter :: stopped_by_limit = 124       !! exit status, the same as that of timeout(1)

   type(command_type) :: command
   type(error_type), allocatable :: error
   integer :: status

   call wait_passively()
   call start_processes()
   call read_command_line(command, error)
   if (.not. allocated(error)) then
      select case (command%verb)
      case ('run')
         call run(error)
      case ('check')
         call check(error)
      case default
         ! Python may take the place of this program, and cannot take part in exchanges with other processes.
         call end_processes()
         if (is_first_process()) call carry_out_alone(error)
      end select
   end if
   status = 0
   if (allocated(error)) then
      if (is_first_process()) call say_error(error%message)
      status = error%status
      if (status == error_memory) status = error_file
   end if
   call end_processes()
   stop status, quiet=.true.

contains

   !> Carry out a command that does not read a case. Only one process does this.
   subroutine carry_out_alone(error)
      type(error_type), allocatable, intent(out) :: error

      select case (command%verb)
      case ('help')
         call say(help_text(command%help_of), error)
      case ('version')
         call say('asperity '//version_number//new_line('a')//linked_versions(), error)
      case ('template')
         call template(error)
      case ('info')
         call info(error)
      case default                                   ! python
         if (command%help_of == '') then
            call become_python(error)
         else
            call become_python(error, command%handed_over, '--help')
         end if
      end select
   end subroutine carry_out_alone

   !> Carry out `asperity template [NAME]`.
   subroutine template(error)
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: message, near

      if (command%reference) then
         call say(reference_markdown(), error)
      else if (.not. allocated(command%path)) then
         call say(template_list(), error)
      else if (find_template(command%path) == 0) then
         message = 'asperity: there is no template '''//in_one_line(command%path, 60)//''''
         near = nearest_name(command%path, all_template_names())
         if (near /= '') then
            message = message//'; did you mean '//near//'?'
         else
            message = message//': `asperity template` lists all templates'
         end if
         call fail(error, error_input, message)
      else if (.not. template_is_available(command%path)) then
         call fail(error, error_input, 'asperity: the template '//command%path//' is not available yet')
      else
         call say(template_text(command%path), error)
      end if
   end subroutine template

   !> Carry out `asperity check CASE.nml`.
   subroutine check(error)
      type(error_type), allocatable, intent(out) :: error
      type(case_type) :: case

      call read_case(command%path, case, error)
      if (.not. allocated(error) .and. is_first_process()) then
         call refuse_overwriting(case, error)
         if (.not. allocated(error)) call check_files(case%grid, case%surfaces, error)
         call warn_of_place(case)
         if (.not. allocated(error)) call say(check_report(case), error)
      end if
      call agree(error)
   end subroutine check

   !> Add a warning if a run could not write its result. The folder may still be made before the run.
   subroutine warn_of_place(case)
      type(case_type), intent(inout) :: case
      type(error_type), allocatable :: fault

      call check_place(trim(case%output%file), fault)
      if (allocated(fault)) call add_line(case%warnings, '&output: '//fault%message)
   end subroutine warn_of_place

   !> Carry out `asperity info FILE.h5`. A result that is damaged may still have a part that can be described.
   subroutine info(error)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: saying
      character(:), allocatable :: text

      call summarise_result(command%path, text, error)
      if (text /= '') call say(text, saying)
      if (.not. allocated(error) .and. allocated(saying)) call move_alloc(saying, error)
   end subroutine info

   !> Carry out `asperity run CASE.nml`.
   subroutine run(error)
      type(error_type), allocatable, intent(out) :: error
      type(case_type) :: case

      if (process_count() == 1) call refuse_copies(error)
      if (.not. allocated(error)) call read_case(command%path, case, error)
      if (.not. allocated(error)) call choose_output(case, error)
      call agree(error)
      if (allocated(error)) return
      if (command%threads > 0) case%solver%threads = command%threads
      call catch_signals()
      call end_with_parent()
      if (case%warnings /= '' .and. is_first_process()) call say_warnings(case%warnings)
      call run_steps(case, error)
   end subroutine run

   !> Replace the file of the result that the case names by that of --output. Without the option the result is
   !> named after the input, which must then be a regular file.
   subroutine choose_output(case, error)
      type(case_type), intent(inout) :: case
      type(error_type), allocatable, intent(out) :: error

      if (.not. allocated(command%output)) then
         if (is_other_than_file(command%path) .and. case%output%file == default_result(command%path)) &
            call fail(error, error_input, command%path//': is not a regular file, so that the result needs a '// &
            'name: give --output FILE.h5')
         return
      end if
      if (len(command%output) > path_length) then
         call fail(error, error_input, 'asperity: --output: the path has '//to_text(len(command%output))// &
            ' characters: at most '//to_text(path_length)//' are allowed')
         return
      end if
      case%output%file = command%output
   end subroutine choose_output

   !> Do the steps of a run. A signal or the time limit stops it after the present step, with a
   !> checkpoint; both also give up a step that takes long. A signal to any process counts for all of
   !> them, and the clock of the first process decides about the time limit.
   subroutine run_steps(case, error)
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(out) :: error
      type(run_type) :: run
      type(progress_type) :: progress
      type(error_type), allocatable :: closing
      logical :: near
      integer :: signal

      call limit%start(command%time_limit)
      if (allocated(limit%remark) .and. is_first_process()) call say_error(limit%remark)
      call run%open(case, command%restart, command%overwrite, error)
      if (.not. allocated(error)) then
         run%sim%stop%asked => must_stop
         call progress%start(run%rows, max(run%sim%state%schedule%row + 1, 0), &
            command%quiet .or. .not. is_first_process())

         do while (.not. run%finished)
            call print_warnings(run, progress)
            signal = nint(global_max(real(stop_signal(), dp)))
            near = limit%is_near()
            call share(near)
            if (signal /= 0) then
               call stop_run(run, 128 + signal, 'stopped by '//stop_signal_name(signal), error)
               exit
            else if (near) then
               call stop_run(run, stopped_by_limit, 'the time limit is near: stopped', error)
               exit
            end if

            ! A checkpoint that was requested before the first row is written after it.
            if (run%sim%state%schedule%row >= 0) then
               if (any_process(checkpoint_asked())) then
                  call forget_checkpoint()
                  call run%save(error)
                  if (allocated(error)) exit
               end if
            end if

            call run%step(error)
            call limit%note(run%longest_step, run%longest_save)
            if (run%sim%stop%given_up) cycle
            if (run%sim%state%schedule%row >= 0) call progress%update(run%sim%state%row)
            if (allocated(error)) exit
         end do

         call print_warnings(run, progress)
         call progress%finish()
      end if
      call run%close(closing)
      if (.not. allocated(error) .and. allocated(closing)) call move_alloc(closing, error)
   end subroutine run_steps

   !> Stop a run such that it can be continued. The error contains the exit status of the program.
   subroutine stop_run(run, status, reason, error)
      type(run_type), intent(inout) :: run
      integer, intent(in) :: status
      character(*), intent(in) :: reason
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: within

      call run%interrupt(error)
      if (allocated(error)) return
      if (run%sim%state%schedule%row < 0) then
         call fail(error, status, 'asperity: '//reason//' before the first row: nothing was computed, '// &
            'and there is no checkpoint')
      else
         within = ''
         if (run%sim%stop%given_up) within = ', within the next one, which is lost'
         call fail(error, status, 'asperity: '//reason//' after step '//to_text(run%sim%state%row%step)// &
            within//'; --restart continues from there')
      end if
   end subroutine stop_run

   !> Print new warnings of a run on lines of their own, after ending the line of the progress.
   subroutine print_warnings(run, progress)
      type(run_type), intent(inout) :: run
      type(progress_type), intent(inout) :: progress

      if (len(run%warnings) == 0) return
      call progress%finish()
      if (is_first_process()) call say_warnings(run%warnings)
      run%warnings = ''
   end subroutine print_warnings

end program main
