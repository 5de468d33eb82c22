!> Closes the gaps of a solution that are within the tolerance, in cells that the wall carries.
!>
!> A solver ends its last step with such gaps, and module `contact_rule` counts these cells as closed. On a stiff solid a
!> gap within the tolerance of the gaps can change the traction by more than the tolerance of the tractions. The
!> gap and the pressure that are handed out would then not belong together. In this case the cells are closed before the
!> end of the solve, which continues if the new traction requires it.
module adhesion_closing
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type
   use adhesion_potential, only : adhesive_slope
   use adhesion_state, only : control_approach
   use adhesion_steps, only : stepped_gap, sum_shift
   use asperity_precision, only : dp
   use contact_rule, only : is_closed
   use field_sums, only : largest_of_rows
   implicit none
   private

   public :: close_carried_gaps, keep_gap_sum

   real(dp), parameter :: noticeable = 0.1_dp    !! change of a traction over the tolerance

contains

   !> Close the narrow gaps of a periodic contact, if that changes the traction noticeably.
   subroutine close_carried_gaps(self, contact, closed)
      class(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      logical, intent(out) :: closed                   !! the traction must be computed again
      real(dp) :: widest(self%rows), change
      integer :: j

      closed = .false.
      if (.not. self%periodic) return
      !$omp parallel do default(none) shared(self, contact, widest) private(j) num_threads(self%threads)
      do j = 1, self%rows
         widest(j) = maxval(merge(contact%state(:, j), 0.0_dp, is_narrow(contact, j)))
      end do
      change = contact%problem%modulus*self%nyquist*largest_of_rows(widest)
      closed = change > noticeable*contact%problem%tolerance*contact%units%traction
      if (.not. closed) return

      !$omp parallel do default(none) shared(self, contact) private(j) num_threads(self%threads)
      do j = 1, self%rows
         where (is_narrow(contact, j)) contact%state(:, j) = 0.0_dp
      end do
      if (contact%problem%control == control_approach) call keep_gap_sum(self, contact)
   end subroutine close_carried_gaps

   !> Is the gap of a cell within the tolerance, but not zero, in a cell that the wall carries?
   pure function is_narrow(contact, j) result(narrow)
      class(adhesion_contact_type), intent(in) :: contact
      integer, intent(in) :: j                         !! row of the patch
      logical :: narrow(size(contact%state, 1))
      real(dp) :: wall(size(contact%state, 1))

      wall(:) = contact%traction(:, j) + contact%load + adhesive_slope(contact%problem%potential, contact%state(:, j))
      narrow(:) = contact%state(:, j) > 0.0_dp .and. is_closed(contact%state(:, j)/contact%units%length, &
         wall/contact%units%traction, contact%problem%tolerance)
   end function is_narrow

   !> Shift the open gaps of a periodic contact so that they have the prescribed sum.
   subroutine keep_gap_sum(self, contact)
      class(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp) :: shift
      integer :: j

      shift = sum_shift(contact%state, contact%state, 0.0_dp, contact%gap_sum, self%threads)
      !$omp parallel do default(none) shared(self, contact, shift) private(j) num_threads(self%threads)
      do j = 1, self%rows
         contact%state(:, j) = stepped_gap(contact%state(:, j), 0.0_dp, 0.0_dp, shift)
      end do
   end subroutine keep_gap_sum

end module adhesion_closing
