!> Wave vectors of the modes of a real FFT on a grid.
module wave_vectors
   use asperity_precision, only : dp, pi
   implicit none
   private

   public :: is_nyquist, mode_number, wave_number

contains

   !> Signed number of the mode at position `i` (from 1) of `n`: 0, 1, ..., then negative ones.
   !> The Nyquist mode of an even `n` is +n/2.
   elemental function mode_number(i, n) result(m)
      integer, intent(in) :: i, n
      integer :: m

      m = i - 1
      if (2*m > n) m = m - n
   end function mode_number

   !> Angular wave number of that mode, rad/m, on a period of `length` m.
   elemental function wave_number(i, n, length) result(k)
      integer, intent(in) :: i, n
      real(dp), intent(in) :: length
      real(dp) :: k

      k = 2.0_dp*pi*mode_number(i, n)/length
   end function wave_number

   !> Is this the Nyquist mode, which stands for +n/2 and -n/2 at once?
   elemental function is_nyquist(i, n) result(nyquist)
      integer, intent(in) :: i, n
      logical :: nyquist

      nyquist = 2*(i - 1) == n
   end function is_nyquist

end module wave_vectors
