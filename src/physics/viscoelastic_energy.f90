!> The discrete energy books of a viscoelastic body: work = change of stored energy + loss, exactly.
!>
!> With the scalar product a.b = sum over the cells times the cell area, and the notation of `zener`,
!> the stored energy is W = 1/2 G_e U.S + sum E_k/(2 g_k), where E_k = p_k.A p_k (thesis, eq. 4.1 to
!> 4.3), and E_k follows its own scalar recurrence. Products of tractions and displacements are
!> sufficient; A is never inverted. The formulas of work and loss depend on the scheme:
!>
!> * exponential, exponential2 and jumps: the exact integrals of P dU and of the power of the dampers
!>   along the path that the scheme assumes within the step, U(t) linear or parabolic; the loss is
!>   never negative.
!> * backward Euler: work P'.dU with the traction of the end of the step; the loss is that of the
!>   dampers at their mean speed, plus the loss of the scheme itself, which is also booked separately as
!>   numerical.
!> * an elastic body, or a body that has relaxed completely: work = change of the stored energy.
!>
!> The work is computed from the product P'.dU of the fields, the stored energy from U.S, and the loss from
!> the products with the arms. That the three agree is therefore a check of the fields and not an identity.
module viscoelastic_energy
   use asperity_precision, only : dp
   use relaxation_functions, only : mean_decay, mean_rise, parabola_work, slope_response, &
      steady_loss
   use arm_state, only : products_type
   use zener, only : is_elastic, scheme_backward_euler, step_regular, step_relaxed, zener_type
   implicit none
   private

   public :: energy_books_type, new_books, book_state, book_step

   !> Cumulative books, in J, of one set of products.
   type :: energy_books_type
      real(dp) :: cell_area = 0.0_dp        !! m2
      real(dp) :: stored = 0.0_dp           !! elastic energy W now, J
      real(dp) :: work = 0.0_dp             !! done by the traction on the rubber, J
      real(dp) :: dissipated = 0.0_dp       !! lost in the rubber, including the loss of the scheme, J
      real(dp) :: numerical = 0.0_dp        !! the part of it that the scheme itself lost, J
      real(dp) :: du_ds = 0.0_dp            !! dU.dS of the last step, m3
      real(dp), allocatable :: arm(:)       !! E_k, Pa2 m3
      real(dp), allocatable :: arm_du(:)    !! p_k.dU of the last step with p_k from its end, J
   end type energy_books_type

contains

   !> Books of a body at rest.
   pure subroutine new_books(self, material, cell_area)
      type(energy_books_type), intent(out) :: self
      type(zener_type), intent(in) :: material
      real(dp), intent(in) :: cell_area     !! dx dy, m2

      self%cell_area = cell_area
      allocate (self%arm(size(material%g)), self%arm_du(size(material%g)), source=0.0_dp)
   end subroutine new_books

   !> Book a step. This must be called after all fields are committed and before `finish_step`.
   pure subroutine book_step(self, material, products)
      type(energy_books_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      type(products_type), intent(in) :: products   !! of all fields that share the books
      real(dp) :: work, loss, numerical, stored

      if (is_elastic(material) .or. material%kind == step_relaxed) then
         self%arm = 0.0_dp
         stored = 0.5_dp*material%g_e*products%u_s*self%cell_area
         work = stored - self%stored
         loss = 0.0_dp
         numerical = 0.0_dp
      else
         if (material%scheme == scheme_backward_euler .and. material%kind == step_regular) then
            call implicit_step(self, material, products, work, loss, numerical)
         else
            call path_step(self, material, products, work, loss)
            numerical = 0.0_dp
         end if
         call advance_arms(self, material, products)
         stored = 0.5_dp*material%g_e*products%u_s*self%cell_area &
            + sum(self%arm/(2.0_dp*material%g))
      end if
      self%stored = stored
      self%work = self%work + work
      self%dissipated = self%dissipated + loss
      self%numerical = self%numerical + numerical
   end subroutine book_step

   !> Book a state that is not reached by a step. The work is the increase of the stored energy.
   pure subroutine book_state(self, g_e, g, u_s, du_ds, arm, arm_du)
      type(energy_books_type), intent(inout) :: self
      real(dp), intent(in) :: g_e           !! long-term modulus, Pa
      real(dp), intent(in) :: g(:)          !! moduli of the arms, Pa
      real(dp), intent(in) :: u_s           !! U.S, m3
      real(dp), intent(in) :: du_ds         !! dU.dS of the step that led to the state, m3
      real(dp), intent(in) :: arm(:)        !! E_k, Pa2 m3
      real(dp), intent(in) :: arm_du(:)     !! p_k.dU of that step, J
      real(dp) :: stored

      stored = 0.5_dp*g_e*u_s + sum(arm/(2.0_dp*g))
      self%work = self%work + (stored - self%stored)
      self%stored = stored
      self%du_ds = du_ds
      self%arm = arm
      self%arm_du = arm_du
   end subroutine book_state

   !> Work and loss of a backward Euler step.
   pure subroutine implicit_step(self, material, products, work, loss, numerical)
      type(energy_books_type), intent(in) :: self
      type(zener_type), intent(in) :: material
      type(products_type), intent(in) :: products
      real(dp), intent(out) :: work         !! J
      real(dp), intent(out) :: loss         !! all of it, J
      real(dp), intent(out) :: numerical    !! the part that the scheme itself lost, J
      real(dp) :: a, g, x                   ! of arm k: alpha, modulus, dt/tau
      real(dp) :: d                         ! dU.dS, m3
      real(dp) :: e                         ! E_k at the start, Pa2 m3
      real(dp) :: r                         ! p_k.dU with p_k at the start, J
      integer :: k

      d = products%du_ds*self%cell_area
      work = products%p_du*self%cell_area
      loss = 0.0_dp
      numerical = 0.5_dp*material%g_e*d
      do k = 1, size(material%g)
         a = material%alpha(k)
         x = material%x(k)
         g = material%g(k)
         e = self%arm(k)
         r = products%arm_du(k)*self%cell_area
         ! The damper dissipates x E_k'/g in the step, and the scheme loses dp.A dp/(2 g) with dp = p_k' - p_k.
         loss = loss + x*a**2*(g*d + 2.0_dp*r + e/g)
         numerical = numerical + (a**2*g*d - 2.0_dp*a*(a*x)*r + (a*x)**2*e/g)/2.0_dp
      end do
      loss = loss + numerical
   end subroutine implicit_step

   !> Work and loss along the path on which U moves at the rate dU + K (s - 1/2) over the time s from 0 to 1, with
   !> K = w (dU - dU_old dt/dt_old).
   pure subroutine path_step(self, material, products, work, loss)
      type(energy_books_type), intent(in) :: self
      type(zener_type), intent(in) :: material
      type(products_type), intent(in) :: products
      real(dp), intent(out) :: work         !! J
      real(dp), intent(out) :: loss         !! J
      real(dp) :: chi, g, omega, phi, x     ! of arm k: its functions, modulus and dt/tau
      real(dp) :: c, d                      ! dU.dS_old and dU.dS, m3
      real(dp) :: k_du, k_k                 ! the products of A^-1 K with dU and with K, m3
      real(dp) :: r, r_k                    ! the products of p_k at the start with dU and with K, J
      real(dp) :: w
      integer :: k

      w = material%weight
      d = products%du_ds*self%cell_area
      c = products%du_ds_old*self%cell_area
      k_du = w*(d - material%ratio*c)
      k_k = w**2*(d - 2.0_dp*material%ratio*c + material%ratio**2*self%du_ds)
      work = products%p_du*self%cell_area - 0.5_dp*material%g_e*d
      loss = 0.0_dp
      do k = 1, size(material%g)
         g = material%g(k)
         x = material%x(k)
         phi = mean_decay(x)
         chi = slope_response(x)
         omega = parabola_work(x)
         r = products%arm_du(k)*self%cell_area
         r_k = w*(r - material%ratio*self%arm_du(k))
         ! P'.dU was formed with the traction at the end of the step: replace that by the traction along the path.
         work = work + (phi - material%alpha(k))*r - chi*r_k &
            + (g*mean_rise(x) - material%b1(k))*d - material%b2(k)*c + g*omega*k_k
         loss = loss + x*mean_decay(2.0_dp*x)/g*self%arm(k) + x*phi**2*r &
            - chi*(1.0_dp + material%alpha(k))*r_k &
            + g*(steady_loss(x)*d - phi*chi*k_du + (omega - 0.5_dp*chi**2)*k_k)
      end do
   end subroutine path_step

   !> E_k and p_k.dU at the end of the step.
   pure subroutine advance_arms(self, material, products)
      type(energy_books_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      type(products_type), intent(in) :: products
      real(dp) :: a, b1, b2                 ! of arm k
      real(dp) :: c, d                      ! dU.dS_old and dU.dS, m3
      real(dp) :: r                         ! p_k.dU with p_k at the start, J
      integer :: k

      d = products%du_ds*self%cell_area
      c = products%du_ds_old*self%cell_area
      do k = 1, size(material%g)
         a = material%alpha(k)
         b1 = material%b1(k)
         b2 = material%b2(k)
         r = products%arm_du(k)*self%cell_area
         self%arm(k) = a**2*self%arm(k) + 2.0_dp*a*(b1*r + b2*self%arm_du(k)) &
            + b1**2*d + 2.0_dp*b1*b2*c + b2**2*self%du_ds
         self%arm_du(k) = a*r + b1*d + b2*c
      end do
      self%du_ds = d
   end subroutine advance_arms

end module viscoelastic_energy
