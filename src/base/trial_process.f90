!> A trial in a separate process: anything that may crash or hang is tried there first.
!>
!> HDF5 may crash, or never return, when it reads a damaged file. Therefore a copy of this process
!> (fork) reads the file before this process does:
!>
!>     call trial%start(seconds)
!>     if (trial%is_copy) then
!>        ... read ...
!>        call trial%leave()
!>     end if
!>     call trial%verdict(path, error)
!>
!> Ordinary errors in the copy are ignored, because this process will find and report them. The copy
!> must neither print nor use OpenMP nor MPI, and it ends without the exit handlers of the program. If no
!> copy can be made, there is no trial.
module trial_process
   use, intrinsic :: iso_c_binding, only : c_funptr, c_int
   use asperity_errors, only : error_file, error_type, fail
   use asperity_signals, only : on_linux
   use system_calls, only : action_default, c_exit_at_once, c_signal, in_place_of_procedure
   use text_tools, only : to_text
   implicit none
   private

   public :: trial_type

   integer(c_int), parameter :: alarm_signal = 14              !! SIGALRM
   !> Signals for which the runtime library or the host program may have handlers that print:
   !> SIGILL, SIGABRT, SIGBUS (Linux), SIGFPE, SIGBUS (macOS), SIGSEGV, SIGALRM, SIGTERM, SIGINT.
   integer(c_int), parameter :: signals(9) = [4, 6, 7, 8, 10, 11, 14, 15, 2]

   !> Signals of a crash: SIGILL, SIGTRAP, SIGABRT, SIGFPE, SIGSEGV. SIGBUS has another number on each system.
   integer, parameter :: crashes(5) = [4, 5, 6, 8, 11]
   integer, parameter :: bus_linux = 7, bus_other = 10         !! SIGBUS of Linux, and of macOS

   !> A trial.
   type :: trial_type
      integer(c_int), private :: process = -1                  !! number of the copy, in this process
      logical :: is_copy = .false.                             !! this is the copy
   contains
      procedure :: start
      procedure :: leave
      procedure :: verdict
   end type trial_type

   interface
      function c_fork() bind(c, name='fork') result(process)
         import :: c_int
         integer(c_int) :: process
      end function c_fork

      function c_waitpid(process, status, options) bind(c, name='waitpid') result(found)
         import :: c_int
         integer(c_int), value :: process
         integer(c_int), intent(out) :: status
         integer(c_int), value :: options
         integer(c_int) :: found
      end function c_waitpid

      function c_alarm(seconds) bind(c, name='alarm') result(left)
         import :: c_int
         integer(c_int), value :: seconds
         integer(c_int) :: left
      end function c_alarm
   end interface

contains

   !> Make the copy. The system ends it after this time, so that this process does not wait for
   !> ever.
   subroutine start(self, seconds)
      class(trial_type), intent(inout) :: self
      integer, intent(in) :: seconds
      type(c_funptr) :: before
      integer(c_int) :: left
      integer :: i

      self%process = c_fork()
      self%is_copy = self%process == 0
      if (.not. self%is_copy) return
      do i = 1, size(signals)
         before = c_signal(signals(i), in_place_of_procedure(action_default))
      end do
      left = c_alarm(int(seconds, c_int))
   end subroutine start

   !> End the copy.
   subroutine leave(self)
      class(trial_type), intent(in) :: self

      if (self%is_copy) call c_exit_at_once(0_c_int)
   end subroutine leave

   !> Wait for the copy. An error is set if it crashed or did not end in time. A copy that another signal has ended, such
   !> as the SIGINT of Ctrl-C, which goes to all processes of a terminal, says nothing about the file.
   subroutine verdict(self, path, error)
      class(trial_type), intent(inout) :: self
      character(*), intent(in) :: path                         !! of the file that was tried
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status, found
      integer :: number, try

      if (self%process <= 0) return
      status = 0
      do try = 1, 1000                                         ! a signal may interrupt the wait
         found = c_waitpid(self%process, status, 0_c_int)
         if (found == self%process) exit
      end do
      self%process = -1
      number = iand(int(status), 127)
      if (found < 0 .or. number == 0) return
      if (number == alarm_signal) then
         call fail(error, error_file, path//': the file is damaged: reading it does not end')
      else if (any(number == crashes) .or. number == merge(bus_linux, bus_other, on_linux())) then
         call fail(error, error_file, path//': the file is damaged: HDF5 crashes when it reads it '// &
            '(signal '//to_text(number)//')')
      end if
   end subroutine verdict

end module trial_process
