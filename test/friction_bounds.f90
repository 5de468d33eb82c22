!> How far tractions lie outside their bounds, for the tests of friction.
module friction_bounds
   use asperity_precision, only : dp, int8
   use friction_law, only : friction_law_type
   implicit none
   private

   public :: largest_excess

contains

   !> By how much the tractions lie outside their bounds: the largest |T - returned T|, Pa.
   function largest_excess(law, p, slope_x, slope_y, contact, tx, ty) result(excess)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: p(:, :)                       !! [nx, ny], Pa
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)  !! [nx, ny]; any size without slope
      integer(int8), intent(in) :: contact(:, :)            !! [nx, ny] 0 open
      real(dp), intent(in) :: tx(:, :), ty(:, :)            !! [nx, ny], Pa
      real(dp) :: excess
      real(dp) :: slope(2), t(2)
      logical :: returned
      integer :: i, j

      excess = 0.0_dp
      slope = 0.0_dp
      !$omp parallel do default(none) shared(law, p, slope_x, slope_y, contact, tx, ty) &
      !$omp private(i, j, t, returned) firstprivate(slope) reduction(max: excess)
      do j = 1, size(p, 2)
         do i = 1, size(p, 1)
            t = 0.0_dp
            if (contact(i, j) /= 0_int8) then
               if (law%slope) slope = [slope_x(i, j), slope_y(i, j)]
               t = [tx(i, j), ty(i, j)]
               call law%return_to_bound(p(i, j), slope, t, returned)
            end if
            excess = max(excess, hypot(tx(i, j) - t(1), ty(i, j) - t(2)))
         end do
      end do
   end function largest_excess

end module friction_bounds
