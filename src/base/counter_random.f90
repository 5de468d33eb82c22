!> Random numbers that are a function of a counter. The number of a point or a mode depends only on
!> its indices and the seed, and not on the order of evaluation, the number of threads or the grid
!> size.
!>
!> The mixing function is that of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014). Sums and products
!> modulo 2^64 are composed of 32-bit halves, because Fortran's integers must not overflow.
module counter_random
   use asperity_precision, only : dp, int64, pi
   implicit none
   private

   public :: mix, normal_number, row_key, uniform_number

   integer(int64), parameter :: low_half = int(z'FFFFFFFF', int64)
   integer(int64), parameter :: gamma = &
      ior(shiftl(int(z'9E3779B9', int64), 32), int(z'7F4A7C15', int64))
   integer(int64), parameter :: factor_1 = &
      ior(shiftl(int(z'BF58476D', int64), 32), int(z'1CE4E5B9', int64))
   integer(int64), parameter :: factor_2 = &
      ior(shiftl(int(z'94D049BB', int64), 32), int(z'133111EB', int64))

contains

   !> Key of row `j`, which the functions below need.
   elemental function row_key(seed, j) result(key)
      integer, intent(in) :: seed
      integer, intent(in) :: j        !! any integer
      integer(int64) :: key

      key = mix(ieor(mix(int(seed, int64)), int(j, int64)))
   end function row_key

   !> A uniformly distributed number in [0, 1), for column `i` of a row.
   elemental function uniform_number(key, i) result(u)
      integer(int64), intent(in) :: key   !! from row_key
      integer, intent(in) :: i            !! any integer
      real(dp) :: u

      u = to_unit(mix(ieor(key, int(i, int64))))
   end function uniform_number

   !> A number with the standard normal distribution, for column `i` of a row (Box and Muller).
   elemental function normal_number(key, i) result(x)
      integer(int64), intent(in) :: key   !! from row_key
      integer, intent(in) :: i            !! any integer
      real(dp) :: x
      integer(int64) :: first

      first = mix(ieor(key, int(i, int64)))
      x = sqrt(-2.0_dp*log(1.0_dp - to_unit(first)))*cos(2.0_dp*pi*to_unit(mix(first)))
   end function normal_number

   !> One step of SplitMix64 from the state `x`.
   elemental function mix(x) result(z)
      integer(int64), intent(in) :: x
      integer(int64) :: z

      z = add(x, gamma)
      z = multiply(ieor(z, shiftr(z, 30)), factor_1)
      z = multiply(ieor(z, shiftr(z, 27)), factor_2)
      z = ieor(z, shiftr(z, 31))
   end function mix

   !> The upper 53 bits of `x` as a number in [0, 1).
   elemental function to_unit(x) result(u)
      integer(int64), intent(in) :: x
      real(dp) :: u

      u = real(shiftr(x, 11), dp)*2.0_dp**(-53)
   end function to_unit

   !> a + b modulo 2^64.
   elemental function add(a, b) result(c)
      integer(int64), intent(in) :: a, b
      integer(int64) :: c
      integer(int64) :: low, high

      low = iand(a, low_half) + iand(b, low_half)
      high = shiftr(a, 32) + shiftr(b, 32) + shiftr(low, 32)
      c = ior(shiftl(high, 32), iand(low, low_half))
   end function add

   !> The product a b modulo 2^64.
   elemental function multiply(a, b) result(c)
      integer(int64), intent(in) :: a, b
      integer(int64) :: c
      integer(int64) :: a_0, a_1, b_low, cross

      a_0 = iand(a, int(z'FFFF', int64))
      a_1 = iand(shiftr(a, 16), int(z'FFFF', int64))
      b_low = iand(b, low_half)
      c = add(a_0*b_low, shiftl(a_1*b_low, 16))
      cross = iand(low_product(shiftr(a, 32), b_low) &
         + low_product(iand(a, low_half), shiftr(b, 32)), low_half)
      c = add(c, shiftl(cross, 32))
   end function multiply

   !> The product a b modulo 2^32 of two numbers below 2^32.
   elemental function low_product(a, b) result(c)
      integer(int64), intent(in) :: a, b
      integer(int64) :: c

      c = iand(iand(a, int(z'FFFF', int64))*b &
         + shiftl(iand(shiftr(a, 16)*b, int(z'FFFF', int64)), 16), low_half)
   end function low_product

end module counter_random
