!> Commands that the Python package carries out, such as `asperity plot`. The program becomes
!> `python3 -m asperity plot ...` if it finds a Python that has the package.
module hand_over
   use, intrinsic :: iso_c_binding, only : c_char, c_null_char, c_size_t
   use asperity_errors, only : error_file, error_type, fail
   use program_arguments, only : argument_text, argument_type, replace_program
   implicit none
   private

   public :: become_python

   character(*), parameter :: nl = new_line('a')

   !> A shell tries one Python after another: the one that the user names, those that may belong to
   !> this program (beside it, beside an editable build, around a wheel), and those on PATH. Because
   !> of `exec` neither the shell nor this program remains, so that signals reach Python and the exit
   !> status is that of Python.
   character(*), parameter :: script = &
      'folder=$1; shift'//nl// &
      'for python in "$ASPERITY_PYTHON" "$folder/python3" "$folder/../bin/python3" \'//nl// &
      '    "$folder/../../../../bin/python3" python3 python; do'//nl// &
      '  command -v "$python" >/dev/null 2>&1 || continue'//nl// &
      '  "$python" -c "import importlib.util as u, sys; s = u.find_spec(''asperity'')'//nl// &
      'sys.exit(s is None or s.origin is None)" </dev/null >/dev/null 2>&1 || continue'//nl// &
      '  ASPERITY_COMMAND=asperity; export ASPERITY_COMMAND'//nl// &
      '  exec "$python" -m asperity "$@"'//nl// &
      'done'//nl// &
      'echo "asperity: $1 needs the Python package asperity, and no Python that was found here has it:'// &
      ' in the source tree, python3 -m pip install . installs it (docs/install.md);'// &
      ' ASPERITY_PYTHON=/path/to/python3 names a Python that has it" >&2'//nl// &
      'exit 3'//nl

   interface
      function c_readlink(path, buffer, length) bind(c, name='readlink') result(count)
         import :: c_char, c_size_t
         implicit none
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: buffer(*)
         integer(c_size_t), value :: length
         integer(c_size_t) :: count
      end function c_readlink
   end interface

contains

   !> Become Python with the arguments of this program, or with a verb and an option instead. This
   !> returns only if no shell can be started.
   subroutine become_python(error, verb, option)
      type(error_type), allocatable, intent(out) :: error
      character(*), intent(in), optional :: verb      !! with `option`, the only two arguments
      character(*), intent(in), optional :: option
      type(argument_type), allocatable :: arguments(:)
      integer :: i, n

      n = command_argument_count()
      if (present(verb)) n = 2
      allocate (arguments(5 + n))
      arguments(1)%text = 'sh'
      arguments(2)%text = '-c'
      arguments(3)%text = script
      arguments(4)%text = 'asperity'
      arguments(5)%text = own_folder()
      if (present(verb) .and. present(option)) then
         arguments(6)%text = verb
         arguments(7)%text = option
      else
         do i = 1, n
            arguments(5 + i)%text = argument_text(i)
         end do
      end if
      call replace_program('/bin/sh', arguments)
      call fail(error, error_file, 'asperity: /bin/sh cannot be started')
   end subroutine become_python

   !> The folder of this program's file; if the system does not report it, a folder that does not
   !> exist.
   function own_folder() result(folder)
      character(:), allocatable :: folder
      character(kind=c_char) :: buffer(4096)
      integer :: i, length

      folder = '/nowhere'
      length = int(c_readlink('/proc/self/exe'//c_null_char, buffer, size(buffer, kind=c_size_t)))
      do i = length, 2, -1
         if (buffer(i) == '/') then
            folder = transfer(buffer(:i - 1), repeat(' ', i - 1))
            return
         end if
      end do
   end function own_folder

end module hand_over
