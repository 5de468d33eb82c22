!> Linear viscoelastic solids as Prony series: a spring parallel to arms.
!>
!> G(t) = G_e + sum g exp(-t/tau), with the long-term modulus G_e, the moduli g and the relaxation
!> times tau of the arms. A Zener branch, a spring G_0 in series with a spring G_1 parallel to a
!> damper eta (thesis, section 2.1.3), is exactly equivalent to a spring and an arm. Its creep time
!> eta/G_1 is longer than the relaxation time tau of this arm. WLF: Williams, Landel and Ferry (1955).
module prony
   use asperity_precision, only : dp
   implicit none
   private

   public :: complex_modulus, creep_compliance, instantaneous_modulus, relaxation_modulus, &
      retardation_spectrum, wlf_shift, zener_to_prony

contains

   !> The arms and the long-term modulus that equal a spring parallel to Zener branches.
   !>
   !> g = G_0^2/(G_0 + G_1), tau = eta/(G_0 + G_1), G_e = G_inf + sum G_0 G_1/(G_0 + G_1).
   pure subroutine zener_to_prony(g_inf, g0, g1, eta, g_e, g, tau)
      real(dp), intent(in) :: g_inf         !! spring parallel to all branches, Pa, >= 0
      real(dp), intent(in) :: g0(:)         !! springs in series, Pa, > 0
      real(dp), intent(in) :: g1(size(g0))  !! springs parallel to the dampers, Pa, >= 0
      real(dp), intent(in) :: eta(size(g0)) !! dampers, Pa s, > 0
      real(dp), intent(out) :: g_e          !! long-term modulus, Pa
      real(dp), intent(out) :: g(size(g0))  !! moduli of the arms, Pa
      real(dp), intent(out) :: tau(size(g0))!! relaxation times, s

      g = g0*(g0/(g0 + g1))
      tau = eta/(g0 + g1)
      g_e = g_inf + sum(g0*(g1/(g0 + g1)))
   end subroutine zener_to_prony

   !> Factor a_T of every relaxation time at a temperature: log10 a_T = -c1 (T - T_ref)/(c2 + T - T_ref).
   elemental function wlf_shift(temperature, reference, c1, c2) result(factor)
      real(dp), intent(in) :: temperature   !! C or K; c2 + temperature - reference must be > 0
      real(dp), intent(in) :: reference     !! in the same scale, where the times were measured
      real(dp), intent(in) :: c1            !! 1; 0: no shift
      real(dp), intent(in) :: c2            !! K
      real(dp) :: factor                    !! tau(temperature)/tau(reference)
      real(dp) :: difference

      difference = temperature - reference
      factor = 1.0_dp
      if (abs(c1*difference) > 0.0_dp) factor = 10.0_dp**(-c1*difference/(c2 + difference))
   end function wlf_shift

   !> G(0) = G_e + sum g, Pa.
   pure function instantaneous_modulus(g_e, g) result(modulus)
      real(dp), intent(in) :: g_e           !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)          !! moduli of the arms, Pa
      real(dp) :: modulus

      modulus = g_e + sum(g)
   end function instantaneous_modulus

   !> G(t), Pa.
   pure function relaxation_modulus(g_e, g, tau, time) result(modulus)
      real(dp), intent(in) :: g_e           !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)          !! moduli of the arms, Pa
      real(dp), intent(in) :: tau(size(g))  !! relaxation times, s
      real(dp), intent(in) :: time          !! s, >= 0
      real(dp) :: modulus

      modulus = g_e + sum(g*exp(-time/tau))
   end function relaxation_modulus

   !> G*(omega) = G_e + sum g i omega tau/(1 + i omega tau): storage and loss modulus, Pa.
   pure function complex_modulus(g_e, g, tau, omega) result(modulus)
      real(dp), intent(in) :: g_e           !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)          !! moduli of the arms, Pa
      real(dp), intent(in) :: tau(size(g))  !! relaxation times, s
      real(dp), intent(in) :: omega         !! angular frequency, rad/s
      complex(dp) :: modulus
      real(dp) :: x
      integer :: k

      modulus = cmplx(g_e, 0.0_dp, dp)
      do k = 1, size(g)
         x = omega*tau(k)
         if (abs(x) > 1.0_dp) then           ! written so that no square can overflow
            modulus = modulus + g(k)*cmplx(1.0_dp, 1.0_dp/x, dp)/(1.0_dp + (1.0_dp/x)**2)
         else
            modulus = modulus + g(k)*cmplx(x**2, x, dp)/(1.0_dp + x**2)
         end if
      end do
   end function complex_modulus

   !> Creep compliance J(t), 1/Pa: the strain of a unit stress held since t = 0.
   !>
   !> Exact for any number of arms; with G_e = 0 the material flows and J grows without limit.
   pure function creep_compliance(g_e, g, tau, time) result(compliance)
      real(dp), intent(in) :: g_e           !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)          !! moduli of the arms, Pa
      real(dp), intent(in) :: tau(size(g))  !! relaxation times, s
      real(dp), intent(in) :: time          !! s, >= 0
      real(dp) :: compliance
      real(dp), allocatable :: lambda(:), strength(:)
      real(dp) :: fluidity, x
      integer :: k

      call retardation_spectrum(g_e, g, tau, lambda, strength, fluidity)
      compliance = 1.0_dp/instantaneous_modulus(g_e, g) + time*fluidity
      do k = 1, size(lambda)
         x = time/lambda(k)
         if (x < 1.0_dp) then               ! 1 - exp(-x), written so that no digits cancel
            compliance = compliance + strength(k)*2.0_dp*exp(-x/2.0_dp)*sinh(x/2.0_dp)
         else
            compliance = compliance + strength(k)*(1.0_dp - exp(-x))
         end if
      end do
   end function creep_compliance

   !> J(t) = 1/G(0) + t fluidity + sum strength (1 - exp(-t/lambda)).
   !>
   !> The retardation times are the roots of G_e + sum g tau/(tau - lambda), one above each
   !> relaxation time and below the next (the largest only if G_e > 0). Each is sought as a distance
   !> from the nearer of its two neighbours, by halving on a logarithmic scale, so that roots very
   !> close to a relaxation time keep their full relative precision.
   pure subroutine retardation_spectrum(g_e, g, tau, lambda, strength, fluidity)
      real(dp), intent(in) :: g_e                          !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)                         !! moduli of the arms, Pa
      real(dp), intent(in) :: tau(size(g))                 !! relaxation times, s
      real(dp), allocatable, intent(out) :: lambda(:)      !! retardation times, s, rising
      real(dp), allocatable, intent(out) :: strength(:)    !! their compliances, 1/Pa
      real(dp), intent(out) :: fluidity                    !! 1/viscosity, 1/(Pa s); 0 for a solid
      real(dp), allocatable :: a(:), t(:)
      real(dp) :: low, high, middle, distance(size(g))
      integer :: halving, k, n, roots, origin
      logical :: above

      call distinct_arms(g, tau, a, t)
      n = size(t)
      a = a*t                                              ! g tau

      fluidity = 0.0_dp
      roots = n
      if (g_e <= 0.0_dp .and. n > 0) then
         roots = n - 1
         fluidity = 1.0_dp/sum(a)
      end if

      allocate (lambda(roots), strength(roots))
      do k = 1, roots
         origin = k
         above = .true.                                    ! lambda lies above its origin
         if (k == n) then
            low = a(n)/g_e
            high = sum(a)/g_e
         else
            high = (t(k + 1) - t(k))/2.0_dp
            above = g_e + sum(a/((t - t(k)) - high)) > 0.0_dp
            if (above) then
               low = a(k)/(g_e + sum(2.0_dp*a(k + 1:)/(t(k + 1:) - t(k))))
            else
               origin = k + 1
               low = a(k + 1)/sum(2.0_dp*a(:k)/(t(k + 1) - t(:k)))
            end if
            low = min(low, high)
         end if

         do halving = 1, 200
            middle = sqrt(low)*sqrt(high)
            if (middle <= low .or. middle >= high) exit
            distance(:n) = (t - t(origin)) + merge(-middle, middle, above)
            if ((g_e + sum(a/distance(:n)) > 0.0_dp) .eqv. above) then
               high = middle
            else
               low = middle
            end if
         end do

         middle = merge(-low, low, above)
         lambda(k) = t(origin) - middle
         strength(k) = 1.0_dp/(lambda(k)*sum(a/((t - t(origin)) + middle)**2))
      end do
   end subroutine retardation_spectrum

   !> The arms in the order of rising time. Arms of equal time are merged, and those without modulus are left out.
   pure subroutine distinct_arms(g, tau, g_sorted, tau_sorted)
      real(dp), intent(in) :: g(:)
      real(dp), intent(in) :: tau(size(g))
      real(dp), allocatable, intent(out) :: g_sorted(:)
      real(dp), allocatable, intent(out) :: tau_sorted(:)
      real(dp) :: a(size(g)), t(size(g))
      integer :: i, k, n

      n = 0
      do i = 1, size(g)
         if (g(i) <= 0.0_dp) cycle
         k = n                                             ! the last one not above tau(i)
         do while (k > 0)
            if (t(k) <= tau(i)) exit
            k = k - 1
         end do
         if (k > 0) then
            if (t(k) >= tau(i)) then
               a(k) = a(k) + g(i)
               cycle
            end if
         end if
         a(k + 2:n + 1) = a(k + 1:n)
         t(k + 2:n + 1) = t(k + 1:n)
         a(k + 1) = g(i)
         t(k + 1) = tau(i)
         n = n + 1
      end do
      g_sorted = a(:n)
      tau_sorted = t(:n)
   end subroutine distinct_arms

end module prony
