!> Tests of the time schemes and of the state of the arms.
module test_zener
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_errors, only : error_type
   use asperity_threads, only : set_threads, thread_count
   use asperity_precision, only : dp
   use prony, only : creep_compliance, relaxation_modulus, retardation_spectrum, zener_to_prony
   use relaxation_functions, only : mean_decay, mean_rise, parabola_work, slope_response, &
      steady_loss
   use arm_state, only : arm_state_type, commit_arms, new_arm_state, &
      new_products, past_traction, products_type
   use zener, only : finish_step, is_elastic, new_zener, restart_order, start_jump, start_relaxed, &
      start_step, zener_type
   implicit none
   private

   public :: run_zener

   character(14), parameter :: schemes(3) = ['backward_euler', 'exponential   ', 'exponential2  ']

   !> One cell with A = 1, for which P or U is given.
   type :: point_type
      type(zener_type) :: material
      type(arm_state_type) :: arms
      real(dp) :: u(1) = 0.0_dp
      real(dp) :: p(1) = 0.0_dp
   end type point_type

contains

   subroutine run_zener()
      call begin_suite('zener')
      if (selected('functions_of_the_schemes')) call functions_of_the_schemes()
      if (selected('backward_euler_is_that_of_the_thesis')) call backward_euler_is_that_of_the_thesis()
      if (selected('steps_and_ramps_are_exact')) call steps_and_ramps_are_exact()
      if (selected('parabola_is_exact')) call parabola_is_exact()
      if (selected('orders_in_time')) call orders_in_time()
      if (selected('wide_spectrum_does_not_ring')) call wide_spectrum_does_not_ring()
      if (selected('split_arm_is_the_same_arm')) call split_arm_is_the_same_arm()
      if (selected('limits_of_steps_and_rest')) call limits_of_steps_and_rest()
      if (selected('cells_are_independent')) call cells_are_independent()
      if (selected('elastic_body_has_no_memory')) call elastic_body_has_no_memory()
      if (selected('wrong_arguments_are_refused')) call wrong_arguments_are_refused()
   end subroutine run_zener

   !> A point at rest.
   subroutine new_point(self, g_e, g, tau, scheme)
      type(point_type), intent(out) :: self
      real(dp), intent(in) :: g_e, g(:), tau(:)
      character(*), intent(in) :: scheme
      type(error_type), allocatable :: error

      call new_zener(self%material, g_e, g, tau, trim(scheme), error)
      call check_no_error(error, 'a material')
      call new_arm_state(self%arms, self%material, 1, 1, 1, error)
      call check_no_error(error, 'a history')
   end subroutine new_point

   !> End the present step with a given P or a given U.
   subroutine reach(self, p, u)
      type(point_type), intent(inout) :: self
      real(dp), intent(in), optional :: p, u
      type(products_type) :: products
      real(dp) :: past(1), u_old(1)

      u_old = self%u
      call past_traction(self%arms, self%material, past)
      if (present(p)) then
         self%p = p
         self%u = (self%p + past)/self%material%q
      else
         self%u = u
         self%p = self%material%q*self%u - past
      end if
      products = new_products(self%material)
      call commit_arms(self%arms, self%material, self%p, u_old, self%u, products)
      call finish_step(self%material)
   end subroutine reach

   !> The functions of x agree with quadrature of their definitions, and have the right limits at 0 and infinity.
   subroutine functions_of_the_schemes()
      real(dp) :: x, tolerance
      integer :: i

      do i = 0, 60
         x = 10.0_dp**(-4.0_dp + 0.1_dp*i)
         tolerance = 1.0e-12_dp
         call check_close(mean_decay(x)/integral(1, x), 1.0_dp, tolerance, 'phi')
         call check_close(mean_rise(x)/integral(2, x), 1.0_dp, tolerance, 'psi')
         call check_close(slope_response(x), integral(3, x), tolerance*min(x, 1.0_dp/x), 'chi')
         call check_close(parabola_work(x), integral(4, x), tolerance*min(x, 1.0_dp/x), 'omega')
         call check_close(steady_loss(x)/integral(5, x), 1.0_dp, tolerance, 'steady loss')
      end do
      x = 1.0e-12_dp
      call check_close(slope_response(x)/x, 1.0_dp/12.0_dp, 1.0e-12_dp, 'chi at 0')
      call check_close(parabola_work(x)/x, 1.0_dp/120.0_dp, 1.0e-12_dp, 'omega at 0')
      call check_close(steady_loss(x)/x, 1.0_dp/3.0_dp, 1.0e-12_dp, 'steady loss at 0')
      call check_close(mean_decay(0.0_dp), 1.0_dp, 0.0_dp, 'phi(0)')
      call check_close(mean_rise(0.0_dp), 0.5_dp, 0.0_dp, 'psi(0)')
      x = 1.0e12_dp
      call check_close(mean_decay(x)*x, 1.0_dp, 1.0e-11_dp, 'phi at infinity')
      call check_close(mean_rise(x)*x, 1.0_dp, 1.0e-11_dp, 'psi at infinity')
      call check_close(slope_response(x)*x, 0.5_dp, 1.0e-11_dp, 'chi at infinity')
      call check_close(parabola_work(x)*x, 1.0_dp/12.0_dp, 1.0e-11_dp, 'omega at infinity')
      call check_close(steady_loss(x)*x, 1.0_dp, 1.0e-11_dp, 'steady loss at infinity')
      do i = 1, 5                                     ! where the series are used up to
         x = 0.5_dp*i
         tolerance = 4.0e-15_dp
         call check_close(mean_decay(x*(1.0_dp + 1.0e-15_dp)), mean_decay(x), tolerance, 'phi')
         call check_close(mean_rise(x*(1.0_dp + 1.0e-15_dp)), mean_rise(x), tolerance, 'psi')
         call check_close(slope_response(x*(1.0_dp + 1.0e-15_dp)), slope_response(x), &
            1.0e-16_dp, 'chi is continuous')
         call check_close(parabola_work(x*(1.0_dp + 1.0e-15_dp)), parabola_work(x), &
            1.0e-16_dp, 'omega is continuous')
         call check_close(steady_loss(x*(1.0_dp + 1.0e-15_dp)), steady_loss(x), &
            1.0e-15_dp, 'steady loss is continuous')
      end do
   end subroutine functions_of_the_schemes

   !> Integrate with a five-point Gauss rule on 400 intervals.
   pure function integral(which, x) result(total)
      integer, intent(in) :: which
      real(dp), intent(in) :: x
      real(dp) :: total, s, node(5), weight(5)
      integer :: i, j

      node(4) = sqrt(5.0_dp - 2.0_dp*sqrt(10.0_dp/7.0_dp))/3.0_dp
      node(5) = sqrt(5.0_dp + 2.0_dp*sqrt(10.0_dp/7.0_dp))/3.0_dp
      node(1:3) = [-node(5), -node(4), 0.0_dp]
      weight(3) = 128.0_dp/225.0_dp
      weight(4) = (322.0_dp + 13.0_dp*sqrt(70.0_dp))/900.0_dp
      weight(5) = (322.0_dp - 13.0_dp*sqrt(70.0_dp))/900.0_dp
      weight(1:2) = [weight(5), weight(4)]
      total = 0.0_dp
      do i = 0, 399
         do j = 1, 5
            s = (i + 0.5_dp*(1.0_dp + node(j)))/400.0_dp
            total = total + weight(j)/800.0_dp*integrand(which, x, s)
         end do
      end do
   end function integral

   pure function integrand(which, x, s) result(f)
      integer, intent(in) :: which
      real(dp), intent(in) :: x, s
      real(dp) :: f

      select case (which)
      case (1)
         f = exp(-x*s)
      case (2)
         f = (1.0_dp - s)*exp(-x*s)
      case (3)
         f = (exp(-x*(1.0_dp - s)) - exp(-0.5_dp*x))*(s - 0.5_dp)
      case (4)
         f = exp(-x*s)*((1.0_dp - s)**3/12.0_dp - s**2*(1.0_dp - s)/4.0_dp)
      case default
         f = 4.0_dp*exp(-x*s)*sinh(0.5_dp*x*s)**2/x   ! x ((1 - exp(-x s))/x)^2
      end select
   end function integrand

   !> Backward Euler equals eq. 2.12 and 2.13 of the thesis, which are written here with displacement-like states.
   subroutine backward_euler_is_that_of_the_thesis()
      real(dp), parameter :: g_inf = 0.2_dp
      real(dp), parameter :: g0(2) = [1.0_dp, 3.0_dp], g1(2) = [0.4_dp, 0.05_dp]
      real(dp), parameter :: eta(2) = [0.7_dp, 0.02_dp]
      real(dp), parameter :: a(3, 3) = reshape([2.0_dp, 0.7_dp, 0.3_dp, 0.7_dp, 1.5_dp, 0.6_dp, &
         0.3_dp, 0.6_dp, 1.1_dp], [3, 3])
      real(dp) :: g_e, g(2), tau(2), dt, past(3), p(3), u(3), u_new(3), ap(3, 2), lead, thesis_past(3)
      real(dp) :: thesis_u(3), thesis_new(3), bottom
      type(zener_type) :: material
      type(arm_state_type) :: arms
      type(products_type) :: products
      type(error_type), allocatable :: error
      integer :: k, n

      call zener_to_prony(g_inf, g0, g1, eta, g_e, g, tau)
      call new_zener(material, g_e, g, tau, 'backward_euler', error)
      call new_arm_state(arms, material, 3, 1, 1, error)
      products = new_products(material)
      u = 0.0_dp
      thesis_u = 0.0_dp
      ap = 0.0_dp
      do n = 1, 40
         dt = 10.0_dp**(-2.0_dp + 0.1_dp*mod(7*n, 31))
         p = [sin(1.0_dp*n), cos(2.0_dp*n), sin(3.0_dp*n)]
         call start_step(material, dt)
         call past_traction(arms, material, past)
         u_new = matmul(a, p + past)/material%q
         call commit_arms(arms, material, p, u, u_new, products)
         call finish_step(material)
         u = u_new

         lead = g_inf
         thesis_past = 0.0_dp
         do k = 1, 2
            bottom = 1.0_dp + g1(k)/g0(k) + eta(k)/(g0(k)*dt)
            lead = lead + (g1(k) + eta(k)/dt)/bottom
            thesis_past = thesis_past + (eta(k)/dt*thesis_u - eta(k)/(g0(k)*dt)*ap(:, k))/bottom
         end do
         thesis_new = (matmul(a, p) + thesis_past)/lead
         do k = 1, 2
            bottom = 1.0_dp + g1(k)/g0(k) + eta(k)/(g0(k)*dt)
            ap(:, k) = (g1(k)*thesis_new + eta(k)/dt*(thesis_new - thesis_u) &
               + eta(k)/(g0(k)*dt)*ap(:, k))/bottom
         end do
         thesis_u = thesis_new
         call check_close(maxval(abs(u - thesis_u)), 0.0_dp, 1.0e-13_dp*maxval(abs(u)), &
            'backward Euler of the thesis')
      end do
   end subroutine backward_euler_is_that_of_the_thesis

   !> A step of U and a ramp of U are exact with the exponential schemes, for steps of any length.
   subroutine steps_and_ramps_are_exact()
      real(dp), parameter :: g_e = 0.3_dp, g(3) = [1.0_dp, 2.0_dp, 0.4_dp]
      real(dp), parameter :: tau(3) = [0.01_dp, 1.0_dp, 50.0_dp]
      type(point_type) :: point
      real(dp) :: t, dt
      integer :: i, n

      do i = 2, 3
         call new_point(point, g_e, g, tau, schemes(i))
         call start_jump(point%material)
         call reach(point, u=0.7_dp)
         t = 0.0_dp
         do n = 1, 30
            dt = 0.003_dp*1.5_dp**mod(5*n, 17)
            t = t + dt
            call start_step(point%material, dt)
            call reach(point, u=0.7_dp)
            call check_close(point%p(1), 0.7_dp*relaxation_modulus(g_e, g, tau, t), 1.0e-14_dp, &
               'relaxation with '//schemes(i))
         end do
      end do
      do i = 2, 3
         call new_point(point, g_e, g, tau, schemes(i))
         t = 0.0_dp
         do n = 1, 30
            dt = 0.003_dp*1.5_dp**mod(5*n, 17)
            t = t + dt
            call start_step(point%material, dt)
            call reach(point, u=2.0_dp*t)
            call check_close(point%p(1), 2.0_dp*(g_e*t + sum(g*tau*(1.0_dp - exp(-t/tau)))), &
               1.0e-13_dp*(1.0_dp + t), 'ramp with '//schemes(i))
         end do
      end do
   end subroutine steps_and_ramps_are_exact

   !> U = t^2 is exact with exponential2 and steps of varying length, except for the error of the first step.
   subroutine parabola_is_exact()
      real(dp), parameter :: tau(1) = [0.6_dp]
      type(point_type) :: point
      real(dp) :: t, dt, first, error
      integer :: n

      call new_point(point, 0.0_dp, [1.0_dp], tau, 'exponential2')
      t = 0.0_dp
      first = 0.0_dp
      do n = 1, 25
         dt = 0.1_dp + 0.05_dp*mod(2*n, 3)
         t = t + dt
         call start_step(point%material, dt)
         call reach(point, u=t**2)
         error = point%p(1) - 2.0_dp*tau(1)*(t - tau(1)*(1.0_dp - exp(-t/tau(1))))
         if (n == 1) first = error*exp(t/tau(1))
         if (n > 1) call check_close(error, first*exp(-t/tau(1)), 1.0e-13_dp, 'U = t^2')
      end do
      call check_order(abs(first), '>', 1.0e-4_dp, 'the first step does not know the curvature')
   end subroutine parabola_is_exact

   !> Orders in time against closed forms: U or P varies as a sine, and creep after a step of P.
   subroutine orders_in_time()
      real(dp), parameter :: least(3) = [0.9_dp, 1.9_dp, 1.9_dp]
      real(dp), parameter :: most(3) = [1.1_dp, 2.1_dp, 3.5_dp]
      character(8), parameter :: names(3) = ['sine U  ', 'sine P  ', 'creep   ']
      real(dp) :: errors(2), order
      integer :: i, what

      do what = 1, 3
         do i = 1, 3
            errors(1) = time_error(what, schemes(i), 160)
            errors(2) = time_error(what, schemes(i), 320)
            order = log(errors(1)/errors(2))/log(2.0_dp)
            call check_order(order, '>', least(i), 'order of '//trim(schemes(i))//', '//names(what))
            call check_order(order, '<', most(i), 'order of '//trim(schemes(i))//', '//names(what))
         end do
      end do
      call check_order(time_error(2, schemes(3), 160), '<', 0.5_dp*time_error(2, schemes(2), 160), &
         'exponential2 has less than half the error of exponential')
   end subroutine orders_in_time

   !> Return the error after 4 s in n unequal steps (alternating 3:2).
   function time_error(what, scheme, n) result(error)
      integer, intent(in) :: what           ! 1: U = sin, 2: P = sin, 3: P = 1
      character(*), intent(in) :: scheme
      integer, intent(in) :: n
      real(dp) :: error
      real(dp), parameter :: g_e = 0.5_dp, g(3) = [1.0_dp, 2.0_dp, 0.7_dp]
      real(dp), parameter :: tau(3) = [0.2_dp, 1.0_dp, 5.0_dp], w = 1.7_dp
      real(dp), allocatable :: lambda(:), strength(:)
      type(point_type) :: point
      real(dp) :: exact, fluidity, t
      integer :: i

      call new_point(point, g_e, g, tau, scheme)
      if (what == 3) then
         call start_jump(point%material)
         call reach(point, p=1.0_dp)
      end if
      t = 0.0_dp
      do i = 1, n
         call start_step(point%material, 4.0_dp/n*merge(1.2_dp, 0.8_dp, mod(i, 2) == 0))
         t = t + point%material%dt
         select case (what)
         case (1)
            call reach(point, u=sin(w*t))
         case (2)
            call reach(point, p=sin(w*t))
         case default
            call reach(point, p=1.0_dp)
         end select
      end do
      select case (what)
      case (1)
         exact = g_e*sin(w*t) + sum(g*w*tau/(1.0_dp + (w*tau)**2) &
            *(w*tau*sin(w*t) + cos(w*t) - exp(-t/tau)))
         error = abs(point%p(1) - exact)
      case (2)
         call retardation_spectrum(g_e, g, tau, lambda, strength, fluidity)
         exact = sin(w*t)/(g_e + sum(g)) + sum(strength/(1.0_dp + (w*lambda)**2) &
            *(sin(w*t) - w*lambda*(cos(w*t) - exp(-t/lambda))))
         error = abs(point%u(1) - exact)
      case default
         error = abs(point%u(1) - creep_compliance(g_e, g, tau, t))
      end select
   end function time_error

   !> 20 arms over 15 decades, with steps longer or shorter than most relaxation times, cause no ringing.
   subroutine wide_spectrum_does_not_ring()
      real(dp), parameter :: g_e = 1.0e6_dp
      real(dp) :: g(20), tau(20), old, rise, drop, dt, drift
      type(point_type) :: point
      integer :: i, k, n, steps

      do k = 1, 20
         tau(k) = 10.0_dp**(-9.0_dp + 15.0_dp*(k - 1)/19.0_dp)
         g(k) = 1.0e7_dp*tau(k)**(-0.3_dp)
      end do
      do i = 1, 3
         do steps = 1, 5
            call new_point(point, g_e, g, tau, schemes(i))
            call start_jump(point%material)
            call reach(point, p=1.0_dp)
            drop = 0.0_dp
            drift = 0.0_dp
            do n = 1, 60
               select case (steps)
               case (1)
                  dt = 1.0e-4_dp
               case (2)
                  dt = 1.0_dp
               case (3)
                  dt = 1.0e7_dp
               case (4)
                  dt = 1.0e-9_dp*10.0_dp**min(n, 17)      ! growing tenfold
               case default
                  dt = merge(1.0_dp, 0.01_dp, mod(n, 2) == 0)
               end select
               old = point%u(1)
               call start_step(point%material, dt)
               call reach(point, p=1.0_dp)
               drop = max(drop, old - point%u(1))
               drift = max(drift, point%u(1) - 1.0_dp/g_e)
            end do
            ! A two-step scheme may overshoot the final value by a little if dt exceeds every time of the material (measured:
            ! 8e-3 and 5e-5); the others must not.
            if (i == 3 .and. (steps == 3 .or. steps == 4)) then
               call check_order(max(drop, drift)*g_e, '<', merge(1.0e-2_dp, 1.0e-4_dp, steps == 3), &
                  'creep hardly overshoots')
            else
               call check_order(max(drop, drift)*g_e, '<', 1.0e-12_dp, 'creep rises: '//schemes(i))
            end if
            if (steps == 3) call check_close(point%u(1)*g_e, 1.0_dp, 1.0e-5_dp, 'creep ends')
         end do
         call new_point(point, g_e, g, tau, schemes(i))
         call start_jump(point%material)
         call reach(point, u=1.0_dp)
         rise = 0.0_dp
         do n = 1, 40
            old = point%p(1)
            call start_step(point%material, 1.0e-9_dp*3.0_dp**n)
            call reach(point, u=1.0_dp)
            rise = max(rise, point%p(1) - old)
         end do
         call check_order(rise, '<=', 1.0e-6_dp, 'relaxation falls: '//schemes(i))
         call check_close(point%p(1)/g_e, 1.0_dp, 1.0e-6_dp, 'relaxation ends: '//schemes(i))
      end do
   end subroutine wide_spectrum_does_not_ring

   !> An arm that is split into two halves with the same time is the same arm.
   subroutine split_arm_is_the_same_arm()
      type(point_type) :: whole, halves
      integer :: i, n

      do i = 1, 3
         call new_point(whole, 1.0_dp, [2.0_dp], [0.5_dp], schemes(i))
         call new_point(halves, 1.0_dp, [0.7_dp, 1.3_dp], [0.5_dp, 0.5_dp], schemes(i))
         do n = 1, 20
            call start_step(whole%material, 0.1_dp*n)
            call reach(whole, p=sin(1.0_dp*n))
            call start_step(halves%material, 0.1_dp*n)
            call reach(halves, p=sin(1.0_dp*n))
            call check_close(halves%u(1), whole%u(1), 1.0e-13_dp, 'split arm')
         end do
      end do
   end subroutine split_arm_is_the_same_arm

   !> Limits: jumps, rest, tiny steps, and the restart of the order.
   subroutine limits_of_steps_and_rest()
      type(point_type) :: point, other
      type(error_type), allocatable :: error
      real(dp), parameter :: g(2) = [2.0_dp, 3.0_dp], tau(2) = [0.1_dp, 10.0_dp]
      integer :: i, n

      do i = 1, 3
         call new_point(point, 1.0_dp, g, tau, schemes(i))
         call start_jump(point%material)
         call reach(point, p=1.2_dp)
         call check_close(point%u(1), 0.2_dp, 1.0e-15_dp, 'a jump gives G(0)')
         other = point
         call start_jump(other%material)
         call reach(other, p=0.6_dp)
         call start_jump(other%material)
         call reach(other, p=1.2_dp)
         call check_close(other%u(1), point%u(1), 1.0e-15_dp, 'a jump and back')
         call start_step(other%material, 1.0e-12_dp)
         call reach(other, p=1.2_dp)
         call check_close(other%u(1), point%u(1), 1.0e-11_dp, 'a tiny step')

         call start_relaxed(point%material, error)
         call check_no_error(error, 'a solid relaxes')
         call reach(point, p=1.2_dp)
         call check_close(point%u(1), 1.2_dp, 1.0e-15_dp, 'rest gives G_e')
         do n = 1, 3
            call start_step(point%material, 0.3_dp*n)
            call reach(point, p=1.2_dp)
            call check_close(point%u(1), 1.2_dp, 1.0e-14_dp, 'a body at rest stays at rest')
         end do
      end do

      call new_point(point, 1.0_dp, g, tau, 'exponential2')
      call new_point(other, 1.0_dp, g, tau, 'exponential')
      do n = 1, 4                             ! without a previous step both schemes are the same
         call restart_order(point%material)
         call start_step(point%material, 0.3_dp)
         call reach(point, p=1.0_dp*n)
         call start_step(other%material, 0.3_dp)
         call reach(other, p=1.0_dp*n)
         call check_close(point%u(1), other%u(1), 1.0e-14_dp, 'restarted order')
      end do
      call start_step(point%material, 5.0_dp)     ! a step that is not ended
      call start_step(point%material, 0.3_dp)
      call check_close(point%material%ratio, 1.0_dp, 0.0_dp, 'a step that was started but not ended leaves no trace')

      call new_point(point, 0.0_dp, g, tau, 'exponential2')
      call start_relaxed(point%material, error)
      call check_error(error, 'relaxed', 'a fluid has no relaxed state')
   end subroutine limits_of_steps_and_rest

   !> Many cells: threads, components, the part that a mass carries, and that cells do not depend on each other.
   subroutine cells_are_independent()
      integer, parameter :: nx = 67, ny = 43      ! more than a block of cells, and not a multiple of it
      type(zener_type) :: material
      type(arm_state_type) :: one, two, both, single
      type(products_type) :: a, b, c, d
      type(error_type), allocatable :: error
      real(dp), allocatable :: p(:, :, :), u(:, :, :), v(:, :, :), h1(:, :, :), h2(:, :, :)
      real(dp) :: h(1), q(1), w(1), w_old(1)
      integer :: i, j, n, s, threads

      threads = thread_count()
      allocate (p(nx, 2, ny), u(nx, 2, ny), v(nx, 2, ny), h1(nx, 2, ny), h2(nx, 2, ny))
      do s = 1, 3
         call new_zener(material, 0.4_dp, [1.0_dp, 0.3_dp], [0.1_dp, 2.0_dp], &
            trim(schemes(s)), error)
         call new_arm_state(one, material, nx, ny, 1, error)
         call new_arm_state(two, material, nx, ny, 1, error)
         call new_arm_state(both, material, nx, ny, 2, error)
         call new_arm_state(single, material, 1, 1, 1, error)
         u = 0.0_dp
         w = 0.0_dp
         do n = 1, 4
            do j = 1, ny
               do i = 1, nx
                  p(i, 1, j) = sin(0.1_dp*i*j + n)
                  p(i, 2, j) = cos(0.2_dp*i - 0.3_dp*j*n)
               end do
            end do
            call start_step(material, 0.3_dp)
            call set_threads(1)
            call past_traction(both, material, h1)
            call set_threads(2)
            call past_traction(one, material, h2(:, 1, :))
            call past_traction(two, material, h2(:, 2, :))
            call check_close(maxval(abs(h1 - h2)), 0.0_dp, 1.0e-15_dp, 'components')
            v = (p + h1)/material%q
            a = new_products(material)
            b = new_products(material)
            c = new_products(material)
            call commit_arms(one, material, p(:, 1, :), u(:, 1, :), v(:, 1, :), a)
            call commit_arms(two, material, p(:, 2, :) - 0.5_dp, u(:, 2, :), v(:, 2, :), a, &
               carried=[-0.5_dp])
            call set_threads(1)
            call commit_arms(both, material, p, u, v, b)
            call check_close(a%u_s/b%u_s, 1.0_dp, 1.0e-15_dp, 'U.S')
            call check_close(a%p_du/b%p_du, 1.0_dp, 1.0e-14_dp, 'P.dU')
            call check_close(a%du_ds/b%du_ds, 1.0_dp, 1.0e-14_dp, 'dU.dS')
            call check_close(b%u_s, sum(v*v), 1.0e-12_dp*b%u_s, 'A = 1: U.S = U.U')
            call check_close(b%p_du, sum(p*(v - u)), 1.0e-11_dp*abs(b%p_du), 'sum of P.dU')
            call check_close(b%du_ds, sum((v - u)**2), 1.0e-12_dp*b%du_ds, 'sum of dU.dU')
            call check_close(maxval(abs(a%arm_du - b%arm_du)), 0.0_dp, 1.0e-10_dp, 'p_k.dU')

            call past_traction(single, material, h)        ! the cell (11, 37) alone
            q = p(11, 1, 37)
            w_old = w
            w = (q + h)/material%q
            d = new_products(material)
            call commit_arms(single, material, q, w_old, w, d)
            call check_close(w(1), v(11, 1, 37), 1.0e-15_dp, 'a cell does not depend on others')
            call finish_step(material)
            u = v
         end do
         call check_that((size(one%ds) > 0) .eqv. s == 3, 'only exponential2 keeps the last step')
         call commit_threads(one, material, p(:, 1, :), u(:, 1, :))
      end do
      call set_threads(threads)
   end subroutine cells_are_independent

   !> The same commit with one and with two threads gives the same bits.
   subroutine commit_threads(arms, material, p, u)
      type(arm_state_type), intent(in) :: arms
      type(zener_type), intent(inout) :: material
      real(dp), intent(in) :: p(:, :), u(:, :)
      type(arm_state_type) :: copies(2)
      type(products_type) :: products(2)
      real(dp) :: past(size(p, 1), size(p, 2), 2)
      integer :: i

      call start_step(material, 0.2_dp)
      do i = 1, 2
         copies(i) = arms
         products(i) = new_products(material)
         call set_threads(i)
         call past_traction(copies(i), material, past(:, :, i))
         call commit_arms(copies(i), material, p, u, p, products(i))
      end do
      call check_close(maxval(abs(past(:, :, 1) - past(:, :, 2))), 0.0_dp, 0.0_dp, 'hist, threads')
      call check_close(products(1)%p_du, products(2)%p_du, 0.0_dp, 'P.dU, threads')
      call check_close(products(1)%u_s, products(2)%u_s, 0.0_dp, 'U.S, threads')
      call check_close(sum(abs(products(1)%arm_du - products(2)%arm_du)), 0.0_dp, 0.0_dp, &
         'p_k.dU, threads')
      call check_close(maxval(abs(copies(1)%arm - copies(2)%arm)), 0.0_dp, 0.0_dp, 'p_k, threads')
   end subroutine commit_threads

   !> Without arms there are no past tractions and no memory, and U = P/G.
   subroutine elastic_body_has_no_memory()
      type(point_type) :: point
      type(products_type) :: products
      real(dp) :: past(1)
      integer :: i

      do i = 1, 3
         call new_point(point, 4.0_dp, [real(dp) ::], [real(dp) ::], schemes(i))
         call check_that(is_elastic(point%material), 'elastic')
         call start_step(point%material, 0.1_dp)
         call check_close(point%material%q, 4.0_dp, 0.0_dp, 'Q = G')
         past = 1.0_dp
         call past_traction(point%arms, point%material, past)
         call check_close(past(1), 0.0_dp, 0.0_dp, 'no history')
         products = new_products(point%material)
         call commit_arms(point%arms, point%material, [2.5_dp], [0.1_dp], [0.5_dp], &
            products, carried=[0.5_dp])
         call check_close(products%u_s, 0.25_dp, 1.0e-16_dp, 'U.S of an elastic body')
         call check_close(products%p_du, 0.8_dp, 1.0e-15_dp, 'P.dU of an elastic body')
         call check_that(size(point%arms%s) + size(point%arms%arm) &
            + size(point%arms%ds) == 0, 'no memory')
      end do
   end subroutine elastic_body_has_no_memory

   !> new_zener refuses wrong arguments.
   subroutine wrong_arguments_are_refused()
      type(zener_type) :: material
      type(error_type), allocatable :: error

      call new_zener(material, 1.0_dp, [1.0_dp], [1.0_dp], 'euler', error)
      call check_error(error, 'exponential2', 'unknown scheme')
      call new_zener(material, 1.0_dp, [1.0_dp], [0.0_dp], 'exponential', error)
      call check_error(error, 'positive', 'a time of zero')
      call new_zener(material, 1.0_dp, [1.0_dp, 2.0_dp], [1.0_dp], 'exponential', error)
      call check_error(error, 'as many', 'unequal lengths')
      call new_zener(material, 0.0_dp, [real(dp) ::], [real(dp) ::], 'exponential', error)
      call check_error(error, 'elastic', 'no stiffness at all')
      call new_zener(material, -1.0_dp, [2.0_dp], [1.0_dp], 'exponential', error)
      call check_error(error, 'negative', 'negative modulus')
   end subroutine wrong_arguments_are_refused

end module test_zener
