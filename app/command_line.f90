!> Reads the command line, and provides the help texts.
module command_line
   use asperity_errors, only : add_fault, error_input, error_type
   use asperity_precision, only : dp
   use program_arguments, only : argument_text
   use text_tools, only : in_one_line, nearest_name
   use time_limit, only : read_duration
   implicit none
   private

   public :: command_type, help_text, read_command_line

   !> A command.
   type :: command_type
      character(:), allocatable :: verb        !! 'run', 'check', 'template', 'info', 'version', 'help', 'python'
      character(:), allocatable :: path        !! of the input or the result; the name of a template
      character(:), allocatable :: output      !! --output; not allocated if not given
      integer :: threads = -1                  !! --threads; -1 if not given
      logical :: restart = .false.             !! --restart
      logical :: overwrite = .false.           !! --overwrite
      real(dp) :: time_limit = -1.0_dp         !! --time-limit, s; below 0 if not given
      logical :: quiet = .false.               !! --quiet
      logical :: reference = .false.           !! --reference
      character(:), allocatable :: help_of     !! verb that --help is about; '' for the program
      character(:), allocatable :: handed_over !! with 'python': the verb
   end type command_type

   character(*), parameter :: nl = new_line('a')
   character(*), parameter :: own_verbs(4) = [character(8) :: 'run', 'check', 'template', 'info']
   character(*), parameter :: python_verbs(6) = [character(8) :: 'plot', 'report', 'watch', &
      'import', 'fit', 'friction']             !! verbs of the Python package
   character(*), parameter :: verbs(10) = [own_verbs, python_verbs]
   character(*), parameter :: verbs_in_words = 'the commands are run, check, template, info, plot, '// &
      'report, watch, import, fit and friction'
   character(*), parameter :: options(10) = [character(12) :: '--output', '--threads', '--restart', &
      '--overwrite', '--time-limit', '--quiet', '--help', '--version', '--reference', '-h']

contains

   !> Read the command line, and report all its faults.
   subroutine read_command_line(command, error)
      type(command_type), intent(out) :: command
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: argument, name
      logical :: help, options_end, done
      integer :: i

      command%help_of = ''
      command%verb = ''
      call look_for_python(command)
      if (command%verb == 'python') return
      help = .false.
      options_end = .false.
      done = .false.
      i = 0
      do while (i < command_argument_count() .and. .not. done)
         i = i + 1
         argument = argument_text(i)
         if (argument == '--' .and. .not. options_end) then
            options_end = .true.
         else if (len(argument) > 1 .and. index(argument, '-') == 1 .and. .not. options_end) then
            call take_option()
         else
            call take_word()
         end if
      end do
      if (done) return

      if (help) then
         call show_help()
      else if (command%verb == '') then
         if (.not. allocated(error)) call refuse('no command is given: '//verbs_in_words// &
            '; asperity --help describes them')
      else
         call check_fit(command, error)
      end if

   contains

      !> Read an option, whose value may follow a '='.
      subroutine take_option()
         name = argument
         if (index(argument, '--') == 1 .and. index(argument, '=') > 0) &
            name = argument(:index(argument, '=') - 1)
         if (name /= argument .and. any(options == name) .and. all(name /= [character(12) :: &
            '--output', '--threads', '--time-limit'])) then
            call refuse(name//' takes no value')
            return
         end if
         select case (name)
         case ('--help', '-h')
            help = .true.
         case ('--version')
            command%verb = 'version'
         case ('--restart')
            command%restart = .true.
         case ('--overwrite')
            command%overwrite = .true.
         case ('--time-limit')
            if (command%time_limit > 0.0_dp) call refuse('--time-limit is given twice')
            call take_time_limit()
         case ('--quiet')
            command%quiet = .true.
         case ('--reference')
            command%reference = .true.
         case ('--output', '-o')
            if (allocated(command%output)) call refuse('--output is given twice')
            call take_value(command%output)
         case ('--threads')
            if (command%threads > 0) call refuse('--threads is given twice')
            call take_threads()
         case default
            call refuse(in_one_line(name, 60)//': there is no such option'//hint(nearest_name(name, options)))
         end select
      end subroutine take_option

      !> Read a word: the command, or the file that it works on. Set `done` if the rest cannot be interpreted.
      subroutine take_word()
         if (command%verb == '') then
            command%verb = argument
            if (argument == 'help') then
               help = .true.
            else if (.not. any(verbs == argument)) then
               call refuse(''''//in_one_line(argument, 60)//''': there is no such command'// &
                  hint(nearest_name(argument, verbs))//'; '//verbs_in_words)
               done = .true.
            else if (any(python_verbs == argument)) then
               call refuse(''''//argument//''' must be the first word; its options follow it')
               done = .true.
            end if
         else if (.not. allocated(command%path) .and. command%verb /= 'version') then
            command%path = argument
            if (argument == '') call refuse(command%verb//': the name that follows it is empty')
         else
            call refuse(''''//in_one_line(argument, 60)//''' is one argument too many')
         end if
      end subroutine take_word

      !> Note that help is requested: about the program, or about the command that is named.
      subroutine show_help()
         if (any(verbs == command%verb)) command%help_of = command%verb
         if (command%verb == 'help' .and. allocated(command%path)) then
            if (any(verbs == command%path)) command%help_of = command%path
         end if
         command%verb = 'help'
         if (any(python_verbs == command%help_of)) then
            command%verb = 'python'
            command%handed_over = command%help_of
         end if
      end subroutine show_help

      !> Add a fault.
      subroutine refuse(message)
         character(*), intent(in) :: message

         call add_fault(error, error_input, 'asperity: '//message)
      end subroutine refuse

      !> Read the value of the present option: the text after its '=', or the next argument.
      subroutine take_value(value)
         character(:), allocatable, intent(inout) :: value

         if (name /= argument) then
            value = argument(len(name) + 2:)
         else if (i < command_argument_count()) then
            i = i + 1
            value = argument_text(i)
         else
            call refuse(name//' needs a value')
            return
         end if
         if (value == '') call refuse(name//' needs a value')
      end subroutine take_value

      !> --threads N
      subroutine take_threads()
         character(:), allocatable :: value
         integer :: status

         call take_value(value)
         if (.not. allocated(value)) return
         if (value == '') return
         status = 1
         if (verify(value, '0123456789') == 0 .and. len(value) < 10) &
            read (value, *, iostat=status) command%threads
         if (status /= 0 .or. command%threads < 1 .or. command%threads > 1024) call refuse('--threads '// &
            in_one_line(value, 60)//': must be an integer from 1 to 1024')
      end subroutine take_threads

      !> --time-limit H:M:S
      subroutine take_time_limit()
         character(:), allocatable :: value
         logical :: valid

         call take_value(value)
         if (.not. allocated(value)) return
         call read_duration(value, command%time_limit, valid)
         if (.not. valid) call refuse('--time-limit '//in_one_line(value, 60)//': must be a duration such '// &
            'as 90 (minutes), 1:30:00 (hours, minutes, seconds) or 2-12:00:00 (with days)')
      end subroutine take_time_limit

   end subroutine read_command_line

   !> Is the first word a command of the Python package? If so, Python will read the other arguments.
   subroutine look_for_python(command)
      type(command_type), intent(inout) :: command
      character(:), allocatable :: word

      if (command_argument_count() == 0) return
      word = argument_text(1)
      if (.not. any(python_verbs == word)) return
      command%verb = 'python'
      command%handed_over = word
   end subroutine look_for_python

   !> Check that the options and arguments belong to the verb.
   subroutine check_fit(command, error)
      type(command_type), intent(in) :: command
      type(error_type), allocatable, intent(inout) :: error

      if (command%verb == 'version') return
      if (command%verb /= 'run') then
         if (allocated(command%output)) call alien('--output')
         if (command%threads > 0) call alien('--threads')
         if (command%restart) call alien('--restart')
         if (command%overwrite) call alien('--overwrite')
         if (command%time_limit > 0.0_dp) call alien('--time-limit')
         if (command%quiet) call alien('--quiet')
      end if
      if (command%restart .and. command%overwrite) call add_fault(error, error_input, 'asperity: '// &
         '--restart and --overwrite are given together: give one of them')
      if (command%reference .and. command%verb /= 'template') call alien('--reference')
      if (command%reference .and. command%verb == 'template' .and. allocated(command%path)) call add_fault(error, &
         error_input, 'asperity: template '//command%path//' --reference: give a name or --reference')
      select case (command%verb)
      case ('run', 'check')
         if (.not. allocated(command%path)) call add_fault(error, error_input, 'asperity: '// &
            command%verb//' needs an input: asperity '//command%verb//' CASE.nml')
      case ('info')
         if (.not. allocated(command%path)) call add_fault(error, error_input, &
            'asperity: info needs a result or a height map: asperity info FILE.h5')
      case default                                   ! template: a name is optional
         continue
      end select

   contains

      !> Report an option of another verb.
      subroutine alien(option)
         character(*), intent(in) :: option

         call add_fault(error, error_input, 'asperity: '//option//' is not an option of '//command%verb)
      end subroutine alien

   end subroutine check_fit

   !> The proposal of a similar name, if there is one.
   pure function hint(name) result(text)
      character(*), intent(in) :: name
      character(:), allocatable :: text

      text = ''
      if (name /= '') text = '; did you mean '//name//'?'
   end function hint

   !> The help of a verb, or of the program.
   function help_text(verb) result(text)
      character(*), intent(in) :: verb             !! '' for the program
      character(:), allocatable :: text

      select case (verb)
      case ('run')
         text = 'asperity run CASE.nml [--output FILE.h5] [--threads N] [--restart] [--overwrite]'//nl// &
            '                     [--time-limit H:M:S] [--quiet]'//nl//nl// &
            'Run a case. The result is an HDF5 file, by default next to the input. To draw it:'//nl// &
            'asperity plot RESULT.h5'//nl//nl// &
            '  --output FILE.h5  write the result to this file; -o for short'//nl// &
            '  --threads N       use N threads; the default is OMP_NUM_THREADS, SLURM_CPUS_PER_TASK,'//nl// &
            '                    or all processors'//nl// &
            '  --restart         continue from the last checkpoint of the result'//nl// &
            '  --overwrite       replace the file of the result, and its checkpoint'//nl// &
            '  --time-limit T    stop with a checkpoint before T has passed, which is written as for'//nl// &
            '                    Slurm: M, M:S, H:M:S, D-H, D-H:M or D-H:M:S; the default is the end of'//nl// &
            '                    the Slurm job, if there is one'//nl// &
            '  --quiet           show no progress'//nl//nl// &
            'SIGINT, SIGTERM, SIGHUP and SIGXCPU stop a run with a checkpoint after the current step;'//nl// &
            'after SIGUSR1 it writes a checkpoint and continues.'//nl//nl//statuses()
      case ('check')
         text = 'asperity check CASE.nml'//nl//nl// &
            'Check an input without running it. Print every setting as it is understood, including'//nl// &
            'the defaults, the time steps and the memory needed. The output can be used as an input.'//nl
      case ('template')
         text = 'asperity template [NAME]'//nl//'asperity template --reference'//nl//nl// &
            'Print an input to start from, for example: asperity template hertz > hertz.nml'//nl// &
            'Without a name, list the templates.'//nl//nl// &
            '  --reference  print all groups and variables as Markdown'//nl
      case ('info')
         text = 'asperity info FILE.h5'//nl//nl// &
            'Describe a result: case, grid, phases, last row, and whether the run is finished;'//nl// &
            'or a height map: size, heights, and the steps of its processing.'//nl
      case default
         text = 'Asperity: contact of a viscoelastic solid with a rough surface'//nl//nl// &
            'asperity run CASE.nml [--output FILE.h5] [--threads N] [--restart] [--overwrite]'//nl// &
            '                      [--time-limit H:M:S] [--quiet]'//nl// &
            'asperity check CASE.nml      check an input: settings, time steps, memory'//nl// &
            'asperity template [NAME]     print an input to start from; without a name, list them'//nl// &
            'asperity info FILE.h5        describe a result or a height map'//nl//nl// &
            'These commands need the Python package:'//nl// &
            'asperity plot RESULT.h5      draw a result, or make a film of it'//nl// &
            'asperity report RESULT.h5    write an HTML page about a result'//nl// &
            'asperity watch RESULT.h5     follow a run in the terminal'//nl// &
            'asperity import TOPOGRAPHY   prepare a measured road for a run'//nl// &
            'asperity fit DMA.csv         fit a material to measured moduli'//nl// &
            'asperity friction ROAD ...   compute friction against speed, pressure and temperature'//nl//nl// &
            'asperity --version | --help  every command has --help, too'//nl//nl// &
            'To begin: asperity template hertz > hertz.nml; asperity run hertz.nml'//nl//nl//statuses()
      end select
   end function help_text

   !> The exit statuses.
   pure function statuses() result(text)
      character(:), allocatable :: text

      text = 'Exit status: 0 complete; 2 error in the input or the command line; 3 a file cannot be read'//nl// &
         'or written, or not enough memory; 4 a solver did not converge; 124 stopped by the time limit;'//nl// &
         '128 + N stopped by signal N (130 SIGINT, 143 SIGTERM).'//nl
   end function statuses

end module command_line
