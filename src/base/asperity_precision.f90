!> The kinds of numbers that all modules use.
module asperity_precision
   use, intrinsic :: iso_fortran_env, only : int8, int64, real32, real64
   implicit none
   private

   public :: int8, int64, power_of_two

   integer, parameter, public :: sp = real32   !! single precision, where speed allows it
   integer, parameter, public :: dp = real64   !! double precision, the default

   real(dp), parameter, public :: pi = 3.14159265358979323846_dp

contains

   !> The next power of two above a positive number, and 1 for all other numbers.
   elemental function power_of_two(x)
      real(dp), intent(in) :: x
      real(dp) :: power_of_two

      power_of_two = 1.0_dp
      if (x > 0.0_dp) power_of_two = scale(1.0_dp, exponent(x))
   end function power_of_two

end module asperity_precision
