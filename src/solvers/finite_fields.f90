!> Rejects solutions that are not finite.
!>
!> Maxima and comparisons ignore values that are not a number (NaN), so that a measure of error may look
!> small although fields have overflowed. The solvers therefore check the fields that they return.
module finite_fields
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use field_sums, only : row_total
   use asperity_precision, only : dp
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: reject_overflow

   character(*), parameter :: reason_overflow = 'numbers overflowed: a field is not finite'

contains

   !> If a field is not finite everywhere, record that the solve did not converge.
   subroutine reject_overflow(outcome, one, other, threads)
      type(solver_result_type), intent(inout) :: outcome
      real(dp), intent(in) :: one(:, :), other(:, :)
      integer, intent(in) :: threads
      integer :: j, lost

      lost = 0
      !$omp parallel do default(none) shared(one, other) private(j) reduction(+:lost) &
      !$omp num_threads(threads)
      do j = 1, size(one, 2)
         if (.not. (all(ieee_is_finite(one(:, j))) .and. all(ieee_is_finite(other(:, j))))) &
            lost = lost + 1
      end do
      if (row_total([lost]) == 0) return
      outcome%converged = .false.
      outcome%reason = reason_overflow
   end subroutine reject_overflow

end module finite_fields
