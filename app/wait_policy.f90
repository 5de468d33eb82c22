!> The way in which idle threads wait. By default they spin for a long time. On a machine with other users this can make
!> a run ten times slower; OMP_WAIT_POLICY = passive lets them sleep instead. To wake a thread takes tens of
!> microseconds, which is as long as a pass over a small field. GNU's OpenMP therefore lets threads spin for about that
!> time before they sleep (GOMP_SPINCOUNT), which saves time on an idle machine and costs little on a busy one. OpenMP
!> reads these variables only when a program starts. Unless the user has set OMP_WAIT_POLICY, the program therefore sets
!> both and starts itself again. A run with one thread, or a command that is not a run, has nothing to wait for, and saves
!> the time of a second start.
module wait_policy
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use program_arguments, only : argument_text, argument_type, replace_program
   implicit none
   private

   public :: wait_passively

   character(*), parameter :: short_spin = '1000'     !! turns of the waiting loop: 20 to 60 microseconds

   interface
      integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
      end function c_setenv
   end interface

contains

   !> Start a run again with threads that soon sleep, unless OMP_WAIT_POLICY is set or one thread is asked for. If the
   !> program cannot find its own file, it continues without a restart.
   subroutine wait_passively()
      type(argument_type) :: arguments(0:command_argument_count())
      integer :: i, status

      call get_environment_variable('OMP_WAIT_POLICY', status=status)
      if (status == 0) return
      do i = 0, command_argument_count()
         arguments(i)%text = argument_text(i)
      end do
      if (.not. needs_threads(arguments)) return
      if (c_setenv('OMP_WAIT_POLICY'//c_null_char, 'passive'//c_null_char, 1_c_int) /= 0) return
      if (c_setenv('GOMP_SPINCOUNT'//c_null_char, short_spin//c_null_char, 0_c_int) /= 0) return
      call replace_program('/proc/self/exe', arguments)
   end subroutine wait_passively

   !> Are these the arguments of a run without `--threads 1`?
   pure function needs_threads(arguments) result(yes)
      type(argument_type), intent(in) :: arguments(0:)
      logical :: yes
      integer :: i

      yes = .false.
      if (size(arguments) < 2) return
      yes = arguments(1)%text == 'run'
      do i = 2, ubound(arguments, 1)
         if (arguments(i)%text == '--threads=1') yes = .false.
         if (arguments(i - 1)%text == '--threads' .and. arguments(i)%text == '1') yes = .false.
      end do
   end function needs_threads

end module wait_policy
