!> Tests of the energy balance: it closes, and each term agrees with an independent computation.
module test_viscoelastic_energy
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use prony, only : zener_to_prony
   use viscoelastic_energy, only : book_step, &
      energy_books_type, new_books
   use arm_state, only : arm_state_type, commit_arms, new_arm_state, new_products, past_traction, &
      products_type
   use zener, only : finish_step, new_zener, restart_order, start_jump, start_relaxed, start_step, &
      zener_type
   implicit none
   private

   public :: run_viscoelastic_energy

   integer, parameter :: cells = 6
   character(14), parameter :: schemes(3) = ['backward_euler', 'exponential   ', 'exponential2  ']

   !> A body of a few cells with a dense elastic operator.
   type :: body_type
      type(zener_type) :: material
      type(arm_state_type) :: arms
      type(energy_books_type) :: books
      real(dp) :: a(cells, cells) = 0.0_dp
      real(dp) :: u(cells) = 0.0_dp
      real(dp) :: p(cells) = 0.0_dp
   end type body_type

contains

   subroutine run_viscoelastic_energy()
      call begin_suite('viscoelastic_energy')
      if (selected('balance_closes')) call balance_closes()
      if (selected('balance_can_fail')) call balance_can_fail()
      if (selected('work_and_loss_along_a_path')) call work_and_loss_along_a_path()
      if (selected('terms_of_backward_euler')) call terms_of_backward_euler()
      if (selected('jumps_and_rest')) call jumps_and_rest()
      if (selected('loss_of_a_steady_cycle')) call loss_of_a_steady_cycle()
      if (selected('elastic_body_loses_nothing')) call elastic_body_loses_nothing()
      if (selected('restored_books_continue_equally')) call restored_books_continue_equally()
   end subroutine run_viscoelastic_energy

   !> Return a pseudo-random number in [-1, 1), the same on every machine.
   function random(state) result(number)
      integer, intent(inout) :: state
      real(dp) :: number

      state = 16807*mod(state, 127773) - 2836*(state/127773)
      if (state <= 0) state = state + 2147483647
      number = 2.0_dp*real(state, dp)/2147483647.0_dp - 1.0_dp
   end function random

   subroutine new_body(self, g_e, g, tau, scheme, state)
      type(body_type), intent(out) :: self
      real(dp), intent(in) :: g_e, g(:), tau(:)
      character(*), intent(in) :: scheme
      integer, intent(inout) :: state
      type(error_type), allocatable :: error
      real(dp) :: root(cells, cells)
      integer :: i, j

      call new_zener(self%material, g_e, g, tau, trim(scheme), error)
      call new_arm_state(self%arms, self%material, cells, 1, 1, error)
      call new_books(self%books, self%material, 0.25_dp)
      do j = 1, cells
         do i = 1, cells
            root(i, j) = random(state)
         end do
      end do
      self%a = matmul(root, transpose(root))
      do i = 1, cells
         self%a(i, i) = self%a(i, i) + 0.1_dp
      end do
   end subroutine new_body

   !> End the present step with the tractions p.
   subroutine load(self, p, damage)
      type(body_type), intent(inout) :: self
      real(dp), intent(in) :: p(cells)
      real(dp), intent(in), optional :: damage     ! adds an error to the displacement of one cell
      type(products_type) :: products
      real(dp) :: past(cells), u(cells)

      call past_traction(self%arms, self%material, past)
      u = matmul(self%a, p + past)/self%material%q
      if (present(damage)) u(2) = u(2) + damage
      products = new_products(self%material)
      call commit_arms(self%arms, self%material, p, self%u, u, products)
      call book_step(self%books, self%material, products)
      call finish_step(self%material)
      self%u = u
      self%p = p
   end subroutine load

   function random_load(state) result(p)
      integer, intent(inout) :: state
      real(dp) :: p(cells)
      integer :: i

      do i = 1, cells
         p(i) = 1.0_dp + random(state)
      end do
   end function random_load

   !> In each step, for random histories and operators, the work is the change of the stored energy plus the loss. Losses are
   !> not negative, and the stored energy is that computed from the arms' own fields.
   subroutine balance_closes()
      real(dp), parameter :: g(3) = [1.0_dp, 4.0_dp, 0.3_dp]
      type(body_type) :: body
      type(energy_books_type) :: before
      real(dp) :: balance, tau(3), stored, scale
      integer :: i, k, n, run, state

      state = 4711
      do i = 1, 3
         do run = 1, 12
            do k = 1, 3
               tau(k) = 10.0_dp**(5.0_dp*random(state))
            end do
            call new_body(body, merge(0.0_dp, 0.7_dp, run == 3), g, tau, schemes(i), state)
            do n = 1, 40
               before = body%books
               if (n == 1 .or. n == 17) then
                  call start_jump(body%material)
               else
                  if (n == 29) call restart_order(body%material)
                  call start_step(body%material, 10.0_dp**(3.0_dp*random(state)))
               end if
               call load(body, random_load(state))
               scale = max(body%books%stored, before%stored, abs(body%books%work - before%work))
               balance = (body%books%work - before%work) - (body%books%stored - before%stored) &
                  - (body%books%dissipated - before%dissipated)
               call check_close(balance/scale, 0.0_dp, &
                  1.0e-13_dp + 4.0_dp*epsilon(1.0_dp)*body%books%dissipated/scale, &
                  'balance with '//schemes(i))
               call check_order(body%books%dissipated, '>=', before%dissipated - 1.0e-14_dp*scale, &
                  'loss of '//schemes(i))
               call check_order(body%books%numerical, '>=', before%numerical - 1.0e-14_dp*scale, &
                  'numerical loss of '//schemes(i))
               stored = 0.5_dp*body%material%g_e &
                  *dot_product(body%arms%s(:, 1), matmul(body%a, body%arms%s(:, 1)))
               do k = 1, 3
                  stored = stored + dot_product(body%arms%arm(:, k, 1), &
                     matmul(body%a, body%arms%arm(:, k, 1)))/(2.0_dp*g(k))
               end do
               ! A fluid may have flowed far: U has the round-off of its size.
               scale = max(scale, sum(abs(body%p*body%u)))
               call check_close(body%books%stored, 0.25_dp*stored, 1.0e-12_dp*scale, &
                  'stored energy')
            end do
            call check_order(body%books%dissipated, '>', 0.0_dp, 'energy is lost')
            call check_that((body%books%numerical > 0.0_dp) .eqv. i == 1, &
               'only backward Euler has a numerical loss')
         end do
      end do
   end subroutine balance_closes

   !> The balance fails if the displacement does not belong to the tractions.
   subroutine balance_can_fail()
      type(body_type) :: body
      real(dp) :: balance
      integer :: i, n, state

      do i = 1, 3
         state = 99
         call new_body(body, 1.0_dp, [2.0_dp], [0.5_dp], schemes(i), state)
         do n = 1, 3
            call start_step(body%material, 0.2_dp)
            call load(body, random_load(state))
         end do
         call start_step(body%material, 0.2_dp)
         call load(body, random_load(state), damage=1.0e-6_dp)
         balance = body%books%work - body%books%stored - body%books%dissipated
         call check_order(abs(balance), '>', 1.0e-10_dp*body%books%work, 'the balance can fail')
      end do
   end subroutine balance_can_fail

   !> Work and loss of one cell agree with a Runge-Kutta integration along the assumed path.
   subroutine work_and_loss_along_a_path()
      real(dp), parameter :: g_e = 0.4_dp, g(2) = [1.0_dp, 3.0_dp], tau(2) = [0.3_dp, 6.0_dp]
      real(dp), parameter :: dts(0:5) = [1.0_dp, 0.2_dp, 0.3_dp, 0.5_dp, 0.15_dp, 1.4_dp]
      type(zener_type) :: material
      type(arm_state_type) :: arms
      type(energy_books_type) :: books, before
      type(products_type) :: products
      type(error_type), allocatable :: error
      real(dp) :: u(1), v(1), p(1), h(1), m(2), work, loss, rate_old, curve
      integer :: i, n

      do i = 2, 3
         call new_zener(material, g_e, g, tau, trim(schemes(i)), error)
         call new_arm_state(arms, material, 1, 1, 1, error)
         call new_books(books, material, 2.0_dp)
         u = 0.0_dp
         m = 0.0_dp
         rate_old = 0.0_dp
         do n = 1, 5
            before = books
            call start_step(material, dts(n))
            call past_traction(arms, material, h)
            v = sin(2.0_dp*n)
            p = material%q*v - h
            products = new_products(material)
            call commit_arms(arms, material, p, u, v, products)
            call book_step(books, material, products)
            curve = 0.0_dp
            if (i == 3 .and. n > 1) curve = 2.0_dp*((v(1) - u(1))/dts(n) - rate_old) &
               /(dts(n) + dts(n - 1))*min(1.0_dp, (2.0_dp*dts(n - 1)/dts(n))**2)
            call runge_kutta((v(1) - u(1))/dts(n), curve, dts(n), u(1), m, work, loss)
            rate_old = (v(1) - u(1))/dts(n)
            u = v
            call check_close(p(1), g_e*v(1) + sum(m), 1.0e-10_dp, 'traction along the path')
            call check_close(books%work - before%work, 2.0_dp*work, 1.0e-10_dp, &
               'work along the path of '//schemes(i))
            call check_close(books%dissipated - before%dissipated, 2.0_dp*loss, 1.0e-10_dp, &
               'loss along the path of '//schemes(i))
            call finish_step(material)
         end do
      end do

   contains

      !> Integrate a step: m, the work of P dU and the power m^2/(g tau) of the dampers.
      subroutine runge_kutta(rate, curve, dt, u0, m, work, loss)
         real(dp), intent(in) :: rate, curve, dt, u0
         real(dp), intent(inout) :: m(2)
         real(dp), intent(out) :: work, loss
         integer, parameter :: steps = 2400
         real(dp) :: y(4), k1(4), k2(4), k3(4), k4(4), h, t
         integer :: j

         y = [m, 0.0_dp, 0.0_dp]
         h = dt/steps
         do j = 1, steps
            t = (j - 1)*h - 0.5_dp*dt
            k1 = slope(rate + curve*(t), y)
            k2 = slope(rate + curve*(t + h/2.0_dp), y + h/2.0_dp*k1)
            k3 = slope(rate + curve*(t + h/2.0_dp), y + h/2.0_dp*k2)
            k4 = slope(rate + curve*(t + h), y + h*k3)
            y = y + h/6.0_dp*(k1 + 2.0_dp*k2 + 2.0_dp*k3 + k4)
         end do
         m = y(1:2)
         work = y(3) + g_e*(u0 + 0.5_dp*rate*dt)*rate*dt
         loss = y(4)
      end subroutine runge_kutta

      !> Return the rates of the state at the given speed of the displacement.
      pure function slope(speed, y) result(f)
         real(dp), intent(in) :: speed, y(4)
         real(dp) :: f(4)

         f(1:2) = g*speed - y(1:2)/tau
         f(3) = sum(y(1:2))*speed
         f(4) = sum(y(1:2)**2/(g*tau))
      end function slope

   end subroutine work_and_loss_along_a_path

   !> Backward Euler: stored energy, loss in the dampers and numerical loss, computed in the springs and dampers of the Zener
   !> branches (thesis, eq. 4.1 to 4.4), for one cell with A = 1.6.
   subroutine terms_of_backward_euler()
      real(dp), parameter :: g_inf = 0.2_dp, a = 1.6_dp, area = 0.5_dp
      real(dp), parameter :: g0(2) = [1.0_dp, 3.0_dp], g1(2) = [0.4_dp, 0.05_dp]
      real(dp), parameter :: eta(2) = [0.7_dp, 0.02_dp]
      real(dp) :: g_e, g(2), tau(2), dt, u(1), u_new(1), p(1), h(1), pk(2), v(2), dv(2), dpk(2)
      real(dp) :: viscous, own, stored
      type(zener_type) :: material
      type(arm_state_type) :: arms
      type(energy_books_type) :: books, before
      type(products_type) :: products
      type(error_type), allocatable :: error
      integer :: n

      call zener_to_prony(g_inf, g0, g1, eta, g_e, g, tau)
      call new_zener(material, g_e, g, tau, 'backward_euler', error)
      call new_arm_state(arms, material, 1, 1, 1, error)
      call new_books(books, material, area)
      u = 0.0_dp
      pk = 0.0_dp                                ! A P_k of the branches
      v = 0.0_dp                                 ! displacement of their dampers
      do n = 1, 25
         before = books
         dt = 10.0_dp**(-2.0_dp + 0.15_dp*mod(7*n, 31))
         p = sin(1.0_dp*n)
         call start_step(material, dt)
         call past_traction(arms, material, h)
         u_new = a*(p + h)/material%q
         products = new_products(material)
         call commit_arms(arms, material, p, u, u_new, products)
         call book_step(books, material, products)
         call finish_step(material)

         dpk = (g1*u_new(1) + eta/dt*(u_new(1) - u(1)) + eta/(g0*dt)*pk) &
            /(1.0_dp + g1/g0 + eta/(g0*dt)) - pk
         pk = pk + dpk
         dv = u_new(1) - pk/g0 - v
         v = v + dv
         stored = (0.5_dp*g_inf*u_new(1)**2 + sum(0.5_dp*pk**2/g0 + 0.5_dp*g1*v**2))/a*area
         viscous = sum(eta/dt*dv**2)/a*area
         own = (0.5_dp*g_inf*(u_new(1) - u(1))**2 + sum(0.5_dp*g1*dv**2 + 0.5_dp*dpk**2/g0))/a*area
         call check_close(books%stored, stored, 1.0e-13_dp, 'stored in the springs')
         call check_close(books%numerical - before%numerical, own, 1.0e-13_dp, 'loss of the scheme')
         call check_close(books%dissipated - before%dissipated, viscous + own, 1.0e-13_dp, &
            'loss of the dampers')
         call check_close(books%work - before%work, p(1)*(u_new(1) - u(1))*area, 1.0e-13_dp, &
            'work of the final traction')
         u = u_new
      end do
   end subroutine terms_of_backward_euler

   !> A jump stores its work, rest loses nothing, and stored energy is returned or lost.
   subroutine jumps_and_rest()
      type(body_type) :: body
      type(energy_books_type) :: before
      type(error_type), allocatable :: error
      real(dp) :: p(cells)
      integer :: i, n, state

      do i = 1, 3
         state = 31415
         call new_body(body, 0.5_dp, [1.0_dp, 2.0_dp], [0.1_dp, 3.0_dp], schemes(i), state)
         p = random_load(state)
         call start_jump(body%material)
         call load(body, p)
         call check_close(body%books%stored, 0.125_dp*dot_product(p, body%u), 1.0e-14_dp, &
            'stored by a jump')
         call check_close(body%books%work, body%books%stored, 1.0e-14_dp, 'work of a jump')
         call check_close(body%books%dissipated, 0.0_dp, 1.0e-14_dp, 'a jump loses nothing')
         call start_jump(body%material)
         call load(body, 0.0_dp*p)
         call check_close(body%books%work, 0.0_dp, 1.0e-14_dp, 'a jump back returns all energy')

         call start_relaxed(body%material, error)
         call load(body, p)
         before = body%books
         call check_close(body%books%stored, 0.125_dp*dot_product(p, body%u), 1.0e-13_dp, &
            'stored at rest')
         do n = 1, 2
            call start_step(body%material, 0.7_dp)
            call load(body, p)
         end do
         call check_close(body%books%work, before%work, 1.0e-13_dp, 'no work at rest')
         call check_close(body%books%dissipated, before%dissipated, 1.0e-13_dp, 'no loss at rest')
         do n = 1, 30                               ! unload, then wait for an infinite time
            call start_step(body%material, 2.0_dp**min(n, 20))
            call load(body, 0.0_dp*p)
         end do
         call check_close(body%books%stored, 0.0_dp, 1.0e-13_dp, 'no energy remains stored')
         call check_close(body%books%work, body%books%dissipated, 1.0e-13_dp, 'all work is lost')
      end do
   end subroutine jumps_and_rest

   !> The loss of a steady cycle is pi G'' U^2; its error has the order of the scheme.
   subroutine loss_of_a_steady_cycle()
      real(dp), parameter :: g(2) = [1.0_dp, 3.0_dp], tau(2) = [0.2_dp, 0.9_dp]
      real(dp), parameter :: w = 6.283185307179586_dp
      real(dp) :: errors(2), exact
      integer :: i, k

      exact = 0.5_dp*w*sum(g*w*tau/(1.0_dp + (w*tau)**2))     ! pi G''
      do i = 1, 3
         do k = 1, 2
            errors(k) = abs(loss_of_a_cycle(schemes(i), 40*k) - exact)
         end do
         call check_order(log(errors(1)/errors(2))/log(2.0_dp), '>', merge(0.9_dp, 1.9_dp, i == 1), &
            'order of the loss of '//schemes(i))
         call check_order(errors(2), '<', merge(0.2_dp, 0.003_dp, i == 1)*exact, &
            'loss of a cycle with '//schemes(i))
      end do

   contains

      function loss_of_a_cycle(scheme, n) result(loss)
         character(*), intent(in) :: scheme
         integer, intent(in) :: n                  ! steps per cycle
         real(dp) :: loss
         type(zener_type) :: material
         type(arm_state_type) :: arms
         type(energy_books_type) :: books
         type(products_type) :: products
         type(error_type), allocatable :: error
         real(dp) :: u(1), v(1), h(1)
         integer :: step

         call new_zener(material, 1.0_dp, g, tau, trim(scheme), error)
         call new_arm_state(arms, material, 1, 1, 1, error)
         call new_books(books, material, 1.0_dp)
         u = 0.0_dp
         loss = 0.0_dp
         do step = 1, 16*n
            if (step == 15*n + 1) loss = books%dissipated
            call start_step(material, 1.0_dp/n)
            call past_traction(arms, material, h)
            v = sin(w*step/n)
            products = new_products(material)
            call commit_arms(arms, material, material%q*v - h, u, v, products)
            call book_step(books, material, products)
            call finish_step(material)
            u = v
         end do
         loss = books%dissipated - loss
      end function loss_of_a_cycle

   end subroutine loss_of_a_steady_cycle

   !> Without arms no energy is ever lost.
   subroutine elastic_body_loses_nothing()
      type(body_type) :: body
      integer :: i, n, state

      do i = 1, 3
         state = 7
         call new_body(body, 2.0_dp, [real(dp) ::], [real(dp) ::], schemes(i), state)
         do n = 1, 5
            call start_step(body%material, 0.3_dp)
            call load(body, random_load(state))
         end do
         call check_close(body%books%stored, 0.125_dp*dot_product(body%p, body%u), 1.0e-14_dp, &
            'elastic energy')
         call check_close(body%books%work, body%books%stored, 1.0e-14_dp, 'elastic work')
         call check_close(body%books%dissipated, 0.0_dp, 0.0_dp, 'elastic loss')
      end do
   end subroutine elastic_body_loses_nothing

   !> Copied and restored books and states of the arms lead to the same numbers.
   subroutine restored_books_continue_equally()
      type(body_type) :: body, other
      real(dp) :: p(cells)
      integer :: n, state

      state = 5
      call new_body(body, 0.5_dp, [1.0_dp, 2.0_dp], [0.1_dp, 3.0_dp], 'exponential2', state)
      do n = 1, 6
         call start_step(body%material, 0.1_dp*n)
         call load(body, random_load(state))
      end do
      call new_body(other, 0.5_dp, [1.0_dp, 2.0_dp], [0.1_dp, 3.0_dp], 'exponential2', state)
      other%a = body%a
      other%u = body%u
      other%arms%s = body%arms%s
      other%arms%ds = body%arms%ds
      other%arms%arm = body%arms%arm
      other%material%dt_old = body%material%dt_old
      other%books = body%books
      do n = 1, 3
         p = random_load(state)
         call start_step(body%material, 0.3_dp)
         call load(body, p)
         call start_step(other%material, 0.3_dp)
         call load(other, p)
         call check_close(maxval(abs(body%u - other%u)), 0.0_dp, 0.0_dp, 'restarted displacement')
         call check_close(body%books%work - other%books%work, 0.0_dp, 0.0_dp, 'restarted work')
         call check_close(body%books%stored - other%books%stored, 0.0_dp, 0.0_dp, 'restarted energy')
         call check_close(maxval(abs(body%books%arm - other%books%arm)), 0.0_dp, 0.0_dp, &
            'restarted arms')
      end do
   end subroutine restored_books_continue_equally

end module test_viscoelastic_energy
