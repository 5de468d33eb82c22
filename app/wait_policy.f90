!> The way in which idle threads wait. By default they spin for a while. On a machine with other
!> users this can make a run ten times slower; OMP_WAIT_POLICY = passive lets them sleep instead.
!> OpenMP reads this variable only when a program starts. Unless the user has set it, the program
!> therefore sets it and starts itself again.
module wait_policy
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use program_arguments, only : argument_text, argument_type, replace_program
   implicit none
   private

   public :: wait_passively

   interface
      integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
      end function c_setenv
   end interface

contains

   !> Start the program again with sleeping threads, unless the environment variable is set. If the program
   !> cannot find its own file, it continues without a restart.
   subroutine wait_passively()
      type(argument_type) :: arguments(0:command_argument_count())
      integer :: i, status

      call get_environment_variable('OMP_WAIT_POLICY', status=status)
      if (status == 0) return
      do i = 0, command_argument_count()
         arguments(i)%text = argument_text(i)
      end do
      if (c_setenv('OMP_WAIT_POLICY'//c_null_char, 'passive'//c_null_char, 1_c_int) /= 0) return
      call replace_program('/proc/self/exe', arguments)
   end subroutine wait_passively

end module wait_policy
