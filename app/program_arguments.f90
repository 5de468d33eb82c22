!> The arguments of this program, and its replacement by another program in the same process.
module program_arguments
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
   implicit none
   private

   public :: argument_text, argument_type, replace_program

   !> An argument.
   type :: argument_type
      character(:), allocatable :: text
   end type argument_type

   !> An argument in the form that C needs.
   type :: c_argument_type
      character(kind=c_char), allocatable :: letters(:)
   end type c_argument_type

   interface
      function c_execv(path, arguments) bind(c, name='execv') result(status)
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(in) :: arguments(*)
         integer(c_int) :: status
      end function c_execv
   end interface

contains

   !> An argument of this program at its full length; number 0 is the name of the program.
   function argument_text(i) result(text)
      integer, intent(in) :: i
      character(:), allocatable :: text
      integer :: n

      call get_command_argument(i, length=n)
      allocate (character(n) :: text)
      if (n > 0) call get_command_argument(i, text)
   end function argument_text

   !> Let another program take the place of this one. This returns only if the program cannot be started.
   subroutine replace_program(path, arguments)
      character(*), intent(in) :: path
      type(argument_type), intent(in) :: arguments(:)      !! the first one is the name of the program
      type(c_argument_type), target :: c_arguments(size(arguments))
      type(c_ptr) :: pointers(size(arguments) + 1)
      integer(c_int) :: status
      integer :: i, k

      do i = 1, size(arguments)
         associate (text => arguments(i)%text)
            c_arguments(i)%letters = [(text(k:k), k=1, len(text)), c_null_char]
         end associate
         pointers(i) = c_loc(c_arguments(i)%letters)
      end do
      pointers(size(pointers)) = c_null_ptr
      status = c_execv(path//c_null_char, pointers)
   end subroutine replace_program

end module program_arguments
