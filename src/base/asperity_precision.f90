!> Kinds of the numbers used throughout.
module asperity_precision
   use, intrinsic :: iso_fortran_env, only : int8, int64, real32, real64
   implicit none
   private

   public :: int8, int64

   integer, parameter, public :: sp = real32   !! single precision, where speed allows it
   integer, parameter, public :: dp = real64   !! double precision, the default

   real(dp), parameter, public :: pi = 3.14159265358979323846_dp

end module asperity_precision
