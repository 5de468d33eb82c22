!> Integrals over one time step of an arm, as functions of x = dt/tau.
!>
!> With s the time in units of the step, the arm relaxes as exp(-x s), and the displacement moves at
!> the rate dU + K (s - 1/2), a parabola. Each function is a power series for small x and a closed
!> form above, both to a few units of round-off for any x >= 0.
module relaxation_functions
   use asperity_precision, only : dp
   implicit none
   private

   public :: mean_decay, mean_rise, parabola_work, slope_response, steady_loss

   integer, parameter :: terms = 36         !! of the series; the last is below 1e-20 at x = 2.5

contains

   !> phi = int_0^1 exp(-x s) ds = (1 - exp(-x))/x.
   elemental function mean_decay(x) result(phi)
      real(dp), intent(in) :: x             !! >= 0
      real(dp) :: phi                       !! 1 at x = 0, 1/x for large x

      if (x > 1.0_dp) then
         phi = (1.0_dp - exp(-x))/x
      else
         phi = series(x, 1, 1.0_dp)
      end if
   end function mean_decay

   !> psi = (1 - phi)/x: the mean over the step of the traction that a constant rate builds up.
   elemental function mean_rise(x) result(psi)
      real(dp), intent(in) :: x             !! >= 0
      real(dp) :: psi                       !! 1/2 at x = 0, 1/x for large x

      if (x > 1.0_dp) then
         psi = (1.0_dp - mean_decay(x))/x
      else
         psi = series(x, 2, 0.5_dp)
      end if
   end function mean_rise

   !> The power series sum_n (-x)^n/(n+k)!.
   elemental function series(x, k, first) result(total)
      real(dp), intent(in) :: x             !! 0 to 1
      integer, intent(in) :: k
      real(dp), intent(in) :: first         !! the first term, 1/k!
      real(dp) :: total
      real(dp) :: term
      integer :: n

      total = 0.0_dp
      term = first
      do n = 0, terms
         total = total + term
         term = -term*x/real(n + k + 1, dp)
      end do
   end function series

   !> chi = int_0^1 exp(-x (1-s)) (s - 1/2) ds = (1 + exp(-x))/(2x) - (1 - exp(-x))/x^2.
   elemental function slope_response(x) result(chi)
      real(dp), intent(in) :: x             !! >= 0
      real(dp) :: chi                       !! x/12 for small x, 1/(2x) for large x
      real(dp) :: term
      integer :: n

      if (x > 2.0_dp) then
         chi = (0.5_dp*(1.0_dp + exp(-x)) - mean_decay(x))/x
      else
         chi = 0.0_dp
         term = x/6.0_dp                    ! -(-x)^n/(n+2)!
         do n = 1, terms
            chi = chi + term*0.5_dp*real(n, dp)
            term = -term*x/real(n + 3, dp)
         end do
      end if
   end function slope_response

   !> omega = int_0^1 int_0^s exp(-x (s-r)) (s - 1/2)(r - 1/2) dr ds.
   elemental function parabola_work(x) result(omega)
      real(dp), intent(in) :: x             !! >= 0
      real(dp) :: omega                     !! x/120 for small x, 1/(12 x) for large x
      real(dp) :: e, term
      integer :: n

      if (x > 2.5_dp) then
         e = exp(-x)
         omega = ((1.0_dp - e) - 3.0_dp*(1.0_dp - e*(1.0_dp + x))/x &
            + 2.0_dp*(6.0_dp/x**3 - e*(1.0_dp + 3.0_dp/x + 6.0_dp/x**2 + 6.0_dp/x**3)))/(12.0_dp*x)
      else
         omega = 0.0_dp
         term = x/120.0_dp                  ! -(-x)^n/(n+4)!
         do n = 1, terms
            omega = omega + term*(0.25_dp*real((n + 1)*(n + 2), dp) - 0.5_dp)
            term = -term*x/real(n + 5, dp)
         end do
      end if
   end function parabola_work

   !> psi - phi^2/2: the loss at a constant rate, divided by g dU.dU; x/3 for small x, 1/x for large x.
   elemental function steady_loss(x) result(loss)
      real(dp), intent(in) :: x             !! >= 0
      real(dp) :: loss
      real(dp) :: term, power
      integer :: n

      if (x > 1.0_dp) then
         loss = mean_rise(x) - 0.5_dp*mean_decay(x)**2
      else
         loss = 0.0_dp
         term = x/6.0_dp                    ! (-1)^n x^(n-1)/(n+1)!
         power = 4.0_dp                     ! 2^n
         do n = 2, terms
            loss = loss + term*(power - 2.0_dp)
            term = -term*x/real(n + 2, dp)
            power = 2.0_dp*power
         end do
      end if
   end function steady_loss

end module relaxation_functions
