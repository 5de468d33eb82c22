!> The library for Python, wrapped by f2py: plain arguments, a status and a message.
!>
!> Every argument is of a C kind that is written out, since f2py maps a renamed kind to a C float
!> without a word. Arrays have explicit shapes and are passed without copies.
module asperity_flat
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   implicit none
   private

   public :: library_version

contains

   !> Version of the library.
   subroutine library_version(text)
      use version, only : asperity_version
      character(len=32), intent(out) :: text

      text = asperity_version
   end subroutine library_version

end module asperity_flat
