!> The start of an adhesive contact: the state from which an iteration begins, and the units of its residual.
module adhesion_start
   use adhesion_closing, only : keep_gap_sum
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type
   use adhesion_state, only : control_approach, control_pressure, resolved_traction, traction_scale
   use asperity_precision, only : dp
   use field_sums, only : field_magnitude, field_mean, field_minimum, field_rms, field_sum
   implicit none
   private

   public :: begin_contact

contains

   !> Set the first state of a contact from its gap (periodic) or from its pressure and level (free), or to full
   !> contact, and choose the units of the residual.
   subroutine begin_contact(self, contact)
      class(adhesion_patch_type), intent(inout) :: self
      class(adhesion_contact_type), intent(inout) :: contact    !! in: its fields are associated
      real(dp) :: deviation, spread, round_off, greatest

      contact%mean_height = field_mean(contact%height) - contact%problem%datum
      deviation = max(field_rms(contact%height, contact%mean_height + contact%problem%datum), tiny(1.0_dp))
      spread = contact%problem%datum - field_minimum(contact%height)
      contact%units%length = contact%problem%potential%range
      if (.not. contact%units%length > 0.0_dp) contact%units%length = deviation
      round_off = 20.0_dp*epsilon(1.0_dp)*spread
      if (self%periodic) then
         call begin_periodic(self, round_off, contact)
      else
         round_off = round_off + 20.0_dp*epsilon(1.0_dp)*abs(contact%level)
         contact%units%length = max(contact%units%length, round_off/contact%problem%tolerance)
         call begin_free(self, contact)
      end if
      call self%evaluate_traction(contact)
      greatest = max(abs(contact%load), field_magnitude(contact%traction))
      contact%units%resolved = resolved_traction(contact%problem, greatest, self%nyquist, spread)
      contact%units%traction = max(contact%units%resolved, traction_scale(contact%problem%potential, &
         max(greatest, contact%problem%modulus*self%longest*deviation)))
   end subroutine begin_contact

   !> Set the prescribed load or sum of the gap, and make the gap satisfy the constraints. If the sum is prescribed, gaps
   !> within the tolerance or the round-off are set to zero. A cell in contact whose gap is only round-off would count as
   !> open, and its pressure in the mean of the gradient over the open cells. Its gap is too narrow to lower the energy by
   !> closing it.
   subroutine begin_periodic(self, round_off, contact)
      type(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp), intent(in) :: round_off                         !! of the heights, m
      real(dp) :: narrow
      integer :: j

      narrow = 0.0_dp
      if (contact%problem%control == control_approach) &
         narrow = max(contact%problem%tolerance*contact%units%length, round_off)
      contact%level = 0.0_dp
      if (associated(contact%past)) &
         contact%past_mean = field_mean(contact%past)
      if (contact%problem%control == control_pressure) contact%load = contact%problem%target
      !$omp parallel do default(none) shared(contact, narrow) private(j) num_threads(self%threads)
      do j = 1, self%rows
         contact%state(:, j) = merge(contact%state(:, j), 0.0_dp, contact%state(:, j) > narrow)
         if (contact%problem%full_contact) contact%state(:, j) = 0.0_dp
      end do
      if (contact%problem%control /= control_approach) return
      contact%gap_sum = -self%cells*(contact%problem%target + contact%mean_height)
      if (field_sum(contact%state) > 0.0_dp) then
         call keep_gap_sum(self, contact)
      else
         contact%state(:, :) = contact%gap_sum/self%cells
      end if
   end subroutine begin_periodic

   !> Set the state from the given pressure and level, or to full contact. The gap that follows from a pressure has
   !> errors. Therefore gaps within the tolerance are set to zero, so that cells in contact stay in contact.
   subroutine begin_free(self, contact)
      type(adhesion_patch_type), intent(inout) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp) :: g
      integer :: i, j

      if (contact%problem%control == control_pressure) contact%force = contact%problem%target*self%cells
      if (contact%problem%full_contact) then
         if (contact%problem%control /= control_approach) contact%level = -contact%mean_height
         do j = 1, self%all_rows
            contact%state(:, j) = (contact%level + contact%mean_height)*self%psi(:, j)
            if (j <= self%rows) contact%state(1:self%nx, j) = max(contact%gap(:, j), 0.0_dp)
         end do
         return
      end if
      do j = 1, self%all_rows
         contact%traction(:, j) = 0.0_dp
         if (j > self%rows) cycle
         contact%traction(1:self%nx, j) = contact%pressure(:, j)
         if (associated(contact%past)) contact%traction(1:self%nx, j) = contact%pressure(:, j) + contact%past(:, j)
      end do
      call self%stiffness%apply_inverse(contact%traction, contact%state)
      do j = 1, self%all_rows
         contact%state(:, j) = contact%state(:, j)/contact%problem%modulus
         do i = 1, self%inner(j)
            g = contact%state(i, j) - (contact%height(i, j) - contact%problem%datum) - contact%level
            contact%state(i, j) = merge(g, 0.0_dp, g > contact%problem%tolerance*contact%units%length)
         end do
      end do
   end subroutine begin_free

end module adhesion_start
