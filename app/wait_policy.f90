!> The way in which idle threads wait. By default they spin for a while. On a machine with other
!> users this can make a run ten times slower; OMP_WAIT_POLICY = passive lets them sleep instead.
!> OpenMP reads this variable only when a program starts. Unless the user has set it, the program
!> therefore sets it and starts itself again.
module wait_policy
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
   implicit none
   private

   public :: wait_passively

   !> An argument in the form that C needs.
   type :: argument_type
      character(kind=c_char), allocatable :: text(:)
   end type argument_type

   interface
      integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
      end function c_setenv

      integer(c_int) function c_execv(path, arguments) bind(c, name='execv')
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(in) :: arguments(*)
      end function c_execv
   end interface

contains

   !> Start the program again with sleeping threads, unless the environment variable is set. If the program
   !> cannot find its own file, it continues without a restart.
   subroutine wait_passively()
      type(argument_type), allocatable, target :: arguments(:)
      type(c_ptr), allocatable :: pointers(:)
      integer :: i, k, length, status
      character(:), allocatable :: text

      call get_environment_variable('OMP_WAIT_POLICY', status=status)
      if (status == 0) return
      allocate (arguments(0:command_argument_count()), pointers(0:command_argument_count() + 1))
      do i = 0, command_argument_count()
         call get_command_argument(i, length=length)
         allocate (character(length) :: text)
         if (length > 0) call get_command_argument(i, text)
         allocate (arguments(i)%text(length + 1))
         do k = 1, length
            arguments(i)%text(k) = text(k:k)
         end do
         arguments(i)%text(length + 1) = c_null_char
         pointers(i) = c_loc(arguments(i)%text)
         deallocate (text)
      end do
      pointers(command_argument_count() + 1) = c_null_ptr
      if (c_setenv('OMP_WAIT_POLICY'//c_null_char, 'passive'//c_null_char, 1_c_int) /= 0) return
      status = c_execv('/proc/self/exe'//c_null_char, pointers)
   end subroutine wait_passively

end module wait_policy
