!> Do two paths lead to the same file?
module path_identity
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_null_char, c_ptr
   implicit none
   private

   public :: real_path, same_file

   integer, parameter :: longest_path = 4096      !! PATH_MAX of Linux; macOS has less

   interface
      !> realpath(3) writes the path without links and dots to the buffer. The result is null if
      !> there is no such file.
      function c_realpath(path, resolved) bind(c, name='realpath') result(address)
         import :: c_char, c_ptr
         implicit none
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: resolved(*)
         type(c_ptr) :: address
      end function c_realpath
   end interface

contains

   !> True if both paths lead to the same existing file, or if they are the same text.
   logical function same_file(first, second)
      character(*), intent(in) :: first, second
      character(:), allocatable :: a, b

      call resolve(trim(first), a)
      call resolve(trim(second), b)
      same_file = a == b
   end function same_file

   !> The path without links and dots, or unchanged if there is no such file.
   function real_path(path) result(resolved)
      character(*), intent(in) :: path
      character(:), allocatable :: resolved

      call resolve(trim(path), resolved)
   end function real_path

   !> The path without links and dots, or unchanged if there is no such file.
   subroutine resolve(path, resolved)
      character(*), intent(in) :: path
      character(:), allocatable, intent(out) :: resolved
      character(longest_path + 1, kind=c_char) :: buffer

      resolved = path
      buffer = c_null_char
      if (c_associated(c_realpath(path//c_null_char, buffer))) &
         resolved = buffer(:index(buffer, c_null_char) - 1)
   end subroutine resolve

end module path_identity
