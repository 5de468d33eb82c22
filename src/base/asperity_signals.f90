!> Signals set flags, which a run checks between its steps.
!>
!> SIGINT, SIGTERM, SIGHUP (the terminal was closed) and SIGXCPU (the limit of the batch system is
!> near) ask a run to stop after the present step, or within it if it takes long. SIGUSR1 requests a
!> checkpoint. SIGXFSZ (a file would exceed the size limit) and SIGPIPE (nobody reads the messages any
!> more, as after `2>&1 | head`) are ignored, so that the write that caused them fails with an error.
!>
!> A program that starts many runs may be killed. Its runs would go on alone, and the next call of the program
!> would find their results in use. It therefore gives its process number to a run (`ASPERITY_PARENT`), which
!> stops, as after SIGTERM, when its parent is another process.
module asperity_signals
   use, intrinsic :: iso_c_binding, only : c_funloc, c_funptr, c_int, c_int64_t, c_loc, &
      c_null_ptr, c_ptr
   use system_calls, only : action_none, c_signal, in_place_of_procedure, signal_file_size
   implicit none
   private

   public :: catch_signals, catch_stops, checkpoint_asked, end_with_parent, forget_checkpoint, give_back_stops, &
      on_linux, stop_signal, stop_signal_name, stop_was_asked

   integer(c_int), parameter :: signal_hang_up = 1        !! SIGHUP
   integer(c_int), parameter :: signal_interrupt = 2      !! SIGINT
   integer(c_int), parameter :: signal_user_linux = 10    !! SIGUSR1 of Linux
   integer(c_int), parameter :: signal_user_other = 30    !! SIGUSR1 of macOS and the BSDs, where 10 is SIGBUS
   integer(c_int), parameter :: signal_pipe = 13          !! SIGPIPE
   integer(c_int), parameter :: signal_terminate = 15     !! SIGTERM
   integer(c_int), parameter :: signal_time = 24          !! SIGXCPU

   integer, parameter :: most_stops = 8                   !! signals that `catch_stops` takes
   !> Longer than C's `struct sigaction`, which has 152 bytes on Linux, in units of 8 bytes.
   integer, parameter :: action_length = 64

   integer(c_int64_t), target :: actions(action_length, most_stops) = 0   !! the host's own actions, during a call
   integer(c_int), volatile :: caught = 0
   integer(c_int) :: parent = 0                           !! process with which the run ends; 0: none
   logical, volatile :: asked = .false.

   interface
      function c_raise(number) bind(c, name='raise') result(status)
         import :: c_int
         integer(c_int), value :: number
         integer(c_int) :: status
      end function c_raise

      function c_sigaction(number, action, before) bind(c, name='sigaction') result(status)
         import :: c_int, c_ptr
         integer(c_int), value :: number
         type(c_ptr), value :: action            !! null: the action is not changed
         type(c_ptr), value :: before            !! null: the former action is not needed
         integer(c_int) :: status
      end function c_sigaction

      function c_getppid() bind(c, name='getppid') result(number)
         import :: c_int
         integer(c_int) :: number
      end function c_getppid
   end interface

contains

   !> Catch the signals from now on. A SIGHUP that is ignored when the program starts stays ignored,
   !> because nohup relies on it.
   subroutine catch_signals()
      type(c_funptr) :: before

      before = c_signal(signal_interrupt, c_funloc(note_stop))
      before = c_signal(signal_terminate, c_funloc(note_stop))
      before = c_signal(signal_time, c_funloc(note_stop))
      before = c_signal(signal_hang_up, c_funloc(note_stop))
      if (transfer(before, action_none) == action_none) before = c_signal(signal_hang_up, before)
      before = c_signal(merge(signal_user_linux, signal_user_other, on_linux()), c_funloc(note_checkpoint))
      before = c_signal(signal_file_size, in_place_of_procedure(action_none))
      before = c_signal(signal_pipe, in_place_of_procedure(action_none))
   end subroutine catch_signals

   !> Stop the run when the process that started it has ended, if that process has given its number. If another process
   !> is in between, such as a shell script, the run cannot know.
   subroutine end_with_parent()
      character(16) :: text
      integer :: status

      call get_environment_variable('ASPERITY_PARENT', text, status=status)
      if (status == 0) read (text, *, iostat=status) parent
      if (status /= 0) parent = 0
      if (parent /= c_getppid()) parent = 0
   end subroutine end_with_parent

   !> If the parent has ended, behave as after SIGTERM.
   subroutine look_for_parent()
      if (parent <= 0 .or. caught /= 0) return
      if (c_getppid() /= parent) caught = signal_terminate
   end subroutine look_for_parent

   !> Is this Linux? The numbers of some signals depend on the system.
   logical function on_linux()
      inquire (file='/proc/self/status', exist=on_linux)
   end function on_linux

   !> Let signals ask for a stop during one call of a host program, such as Python. The host's own
   !> actions for these signals are saved, and `give_back_stops` restores them.
   subroutine catch_stops(numbers)
      integer(c_int), intent(in) :: numbers(:)
      type(c_funptr) :: before
      integer(c_int) :: status
      integer :: k

      caught = 0
      do k = 1, min(size(numbers), most_stops)
         status = c_sigaction(numbers(k), c_null_ptr, c_loc(actions(1, k)))
         if (status == 0) before = c_signal(numbers(k), c_funloc(note_stop))
      end do
   end subroutine catch_stops

   !> Restore the actions that `catch_stops` replaced. A signal that arrived in between is sent again, so
   !> that the host receives it.
   subroutine give_back_stops(numbers)
      integer(c_int), intent(in) :: numbers(:)   !! the same as those of `catch_stops`
      integer(c_int) :: status
      integer :: k

      do k = 1, min(size(numbers), most_stops)
         status = c_sigaction(numbers(k), c_loc(actions(1, k)), c_null_ptr)
      end do
      if (caught /= 0) status = c_raise(caught)
      caught = 0
   end subroutine give_back_stops

   !> The signal that asked the run to stop, or 0.
   function stop_signal() result(number)
      integer :: number

      call look_for_parent()
      number = caught
   end function stop_signal

   !> Has a signal asked the run to stop? 1 or 0, for module `stop_watch`.
   function stop_was_asked() bind(c) result(yes)
      integer(c_int) :: yes

      call look_for_parent()
      yes = merge(1_c_int, 0_c_int, caught /= 0)
   end function stop_was_asked

   !> The name of a signal that stops a run.
   pure function stop_signal_name(number) result(name)
      integer, intent(in) :: number
      character(:), allocatable :: name

      select case (number)
      case (signal_hang_up)
         name = 'SIGHUP'
      case (signal_interrupt)
         name = 'SIGINT'
      case (signal_time)
         name = 'SIGXCPU'
      case default
         name = 'SIGTERM'
      end select
   end function stop_signal_name

   !> Was a checkpoint requested?
   function checkpoint_asked() result(yes)
      logical :: yes

      yes = asked
   end function checkpoint_asked

   !> Clear the request for a checkpoint once the checkpoint is written.
   subroutine forget_checkpoint()
      asked = .false.
   end subroutine forget_checkpoint

   !> Handler of the signals that ask a run to stop.
   subroutine note_stop(number) bind(c)
      integer(c_int), value :: number

      caught = number
   end subroutine note_stop

   !> Handler of SIGUSR1.
   subroutine note_checkpoint(number) bind(c)
      integer(c_int), value :: number

      asked = number > 0
   end subroutine note_checkpoint

end module asperity_signals
