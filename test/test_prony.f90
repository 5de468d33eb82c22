!> Tests of the material functions.
module test_prony
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_precision, only : dp
   use prony, only : complex_modulus, creep_compliance, instantaneous_modulus, &
      relaxation_modulus, retardation_spectrum, wlf_shift, zener_to_prony
   implicit none
   private

   public :: run_prony

contains

   subroutine run_prony()
      call begin_suite('prony')
      if (selected('branches')) call branches()
      if (selected('one_arm')) call one_arm()
      if (selected('duality')) call duality()
      if (selected('wide_spectrum')) call wide_spectrum()
      if (selected('shift')) call shift()
   end subroutine run_prony

   !> A Zener branch has the creep and relaxation functions of the thesis, eq. 2.15 and 2.16.
   subroutine branches()
      real(dp), parameter :: g0 = 1.0e6_dp, g1 = 1.0e5_dp, eta = 1.0e5_dp
      real(dp) :: g_e, g(1), tau(1), two_g(2), two_tau(2), t
      complex(dp) :: direct, s
      integer :: i

      call zener_to_prony(0.0_dp, [g0], [g1], [eta], g_e, g, tau)
      do i = -3, 2
         t = 10.0_dp**i
         call check_close(creep_compliance(g_e, g, tau, t)*g0, &
            1.0_dp + g0/g1*(1.0_dp - exp(-t*g1/eta)), 1.0e-13_dp*g0/g1, 'creep of a branch')
         call check_close(relaxation_modulus(g_e, g, tau, t)/g0, &
            (1.0_dp + g0/g1*exp(-t/tau(1)))/(g0*(1.0_dp/g0 + 1.0_dp/g1)), 1.0e-14_dp, &
            'relaxation of a branch')
      end do
      call check_close(instantaneous_modulus(g_e, g), g0, 1.0e-9_dp, 'instantaneous modulus')

      call zener_to_prony(3.0_dp, [2.0_dp, 5.0_dp], [0.7_dp, 0.0_dp], [4.0_dp, 1.3_dp], &
         g_e, two_g, two_tau)
      s = cmplx(0.0_dp, 0.6_dp, dp)
      direct = 3.0_dp + 1.0_dp/(1.0_dp/2.0_dp + 1.0_dp/(0.7_dp + 4.0_dp*s)) &
         + 1.0_dp/(1.0_dp/5.0_dp + 1.0_dp/(1.3_dp*s))
      call check_close(abs(complex_modulus(g_e, two_g, two_tau, 0.6_dp) - direct), 0.0_dp, &
         1.0e-14_dp, 'impedances of two branches add up')
   end subroutine branches

   !> One arm with a spring, and one arm alone (a Maxwell fluid).
   subroutine one_arm()
      real(dp) :: t
      complex(dp) :: modulus

      t = 0.37_dp
      call check_close(creep_compliance(0.0_dp, [2.0_dp], [3.0_dp], t), 0.5_dp + t/6.0_dp, &
         1.0e-15_dp, 'a Maxwell fluid flows')
      call check_close(creep_compliance(4.0_dp, [real(dp) ::], [real(dp) ::], t), 0.25_dp, &
         0.0_dp, 'a spring')
      modulus = complex_modulus(1.0_dp, [2.0_dp], [1.0_dp], 1.0e200_dp)
      call check_close(real(modulus), 3.0_dp, 1.0e-15_dp, 'glassy limit')
      modulus = complex_modulus(1.0_dp, [2.0_dp], [1.0_dp], 1.0_dp)
      call check_close(aimag(modulus), 1.0_dp, 1.0e-15_dp, 'peak of the loss')
   end subroutine one_arm

   !> J* G* = 1 at any frequency, for 6 arms in any order, two with equal times, one empty, one nearly empty.
   subroutine duality()
      real(dp), parameter :: g(6) = [3.0_dp, 1.0_dp, 0.0_dp, 2.0_dp, 1.0e-9_dp, 0.5_dp]
      real(dp), parameter :: tau(6) = [1.0_dp, 1.0e-3_dp, 5.0_dp, 1.0_dp, 7.0_dp, 1.1_dp]
      real(dp), allocatable :: lambda(:), strength(:)
      real(dp) :: fluidity, g_e, omega
      complex(dp) :: compliance, s
      integer :: i, k, solid

      do solid = 0, 1
         g_e = 0.3_dp*solid
         call retardation_spectrum(g_e, g, tau, lambda, strength, fluidity)
         call check_that(size(lambda) == 3 + solid, 'number of retardation times')
         do i = -40, 40
            omega = 10.0_dp**(i/8.0_dp)
            s = cmplx(0.0_dp, omega, dp)
            compliance = 1.0_dp/sum([g_e, g]) + fluidity/s
            do k = 1, size(lambda)
               compliance = compliance + strength(k)/(1.0_dp + s*lambda(k))
            end do
            call check_close(abs(compliance*complex_modulus(g_e, g, tau, omega) - 1.0_dp), &
               0.0_dp, 1.0e-13_dp, 'J* G* = 1')
         end do
      end do
   end subroutine duality

   !> 20 arms over 15 decades, and times that differ in the last digits.
   subroutine wide_spectrum()
      real(dp) :: g(20), tau(20), omega, fluidity, old, new
      real(dp), allocatable :: lambda(:), strength(:)
      complex(dp) :: compliance
      logical :: rising
      integer :: i, k

      do k = 1, 20
         tau(k) = 10.0_dp**(-9.0_dp + 15.0_dp*(k - 1)/19.0_dp)
         g(k) = 1.0e9_dp*tau(k)**(-0.3_dp)/1.0e2_dp
      end do
      call retardation_spectrum(1.0e6_dp, g, tau, lambda, strength, fluidity)
      call check_that(all(lambda > tau) .and. all(lambda(:19) < tau(2:)), 'times interlace', &
         [tau, lambda])
      call check_close(1.0_dp/sum([1.0e6_dp, g]) + sum(strength), 1.0e-6_dp, 1.0e-19_dp, &
         'J of infinite time is 1/G_e')
      do i = -48, 36
         omega = 10.0_dp**(i/4.0_dp)
         compliance = 1.0_dp/sum([1.0e6_dp, g])
         do k = 1, size(lambda)
            compliance = compliance + strength(k)/cmplx(1.0_dp, omega*lambda(k), dp)
         end do
         call check_close(abs(compliance*complex_modulus(1.0e6_dp, g, tau, omega) - 1.0_dp), &
            0.0_dp, 1.0e-12_dp, 'J* G* = 1 over 15 decades')
      end do
      rising = .true.
      old = 0.0_dp
      do i = -60, 60
         new = creep_compliance(1.0e6_dp, g, tau, 10.0_dp**(i/4.0_dp))
         rising = rising .and. new >= old .and. new <= 1.0e-6_dp*(1.0_dp + 1.0e-12_dp)
         old = new
      end do
      call check_that(rising, 'creep rises to 1/G_e')
      call check_close(creep_compliance(1.0_dp, [1.0_dp, 1.0_dp], &
         [1.0_dp, 1.0_dp + epsilon(1.0_dp)], 1.0_dp), &
         creep_compliance(1.0_dp, [2.0_dp], [1.0_dp], 1.0_dp), 1.0e-14_dp, 'nearly equal times')
   end subroutine wide_spectrum

   subroutine shift()
      call check_close(wlf_shift(30.0_dp, 20.0_dp, 17.44_dp, 51.6_dp), &
         exp(-log(10.0_dp)*174.4_dp/61.6_dp), 1.0e-16_dp, 'WLF above the reference')
      call check_order(wlf_shift(10.0_dp, 20.0_dp, 17.44_dp, 51.6_dp), '>', 1.0_dp, &
         'cold rubber is slower')
      call check_close(wlf_shift(10.0_dp, 20.0_dp, 0.0_dp, 0.0_dp), 1.0_dp, 0.0_dp, 'no shift')
      call check_close(wlf_shift(20.0_dp, 20.0_dp, 17.0_dp, 0.0_dp), 1.0_dp, 0.0_dp, 'at reference')
   end subroutine shift

end module test_prony
