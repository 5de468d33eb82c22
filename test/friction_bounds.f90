!> Tractions against their bounds, for the tests of friction.
module friction_bounds
   use asperity_precision, only : dp, int8
   use friction_law, only : contact_open, contact_slip, friction_law_type
   implicit none
   private

   public :: largest_excess, return_to_bound, return_tractions

contains

   !> Return the traction of a point to the bound if it lies outside.
   pure subroutine return_to_bound(law, p, slope, t, returned)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: p             !! Pa
      real(dp), intent(in) :: slope(2)
      real(dp), intent(inout) :: t(2)       !! Pa
      logical, intent(out) :: returned      !! it lay outside
      real(dp) :: s

      call law%place_on_bound(p, slope, 1.0_dp, t, s)
      returned = s < 1.0_dp
   end subroutine return_to_bound

   !> Return how far the tractions are outside their bounds: the largest |T - returned T|, Pa.
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
               if (law%slope_effect) slope = [slope_x(i, j), slope_y(i, j)]
               t = [tx(i, j), ty(i, j)]
               call return_to_bound(law, p(i, j), slope, t, returned)
            end if
            excess = max(excess, hypot(tx(i, j) - t(1), ty(i, j) - t(2)))
         end do
      end do
   end function largest_excess

   !> Reduce tractions to the bound of a new pressure, and clear them outside the contact. Points whose
   !> traction was reduced become slip points.
   subroutine return_tractions(law, p, slope_x, slope_y, contact, tx, ty)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: p(:, :)                       !! [nx, ny], Pa
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)  !! [nx, ny]; any size without slope
      !> [nx, ny] In: 0 open, else in contact; out: 0 open, 1 stick, 2 slip. Without adhesion a
      !> point with p <= 0 is taken as open.
      integer(int8), intent(inout) :: contact(:, :)
      real(dp), intent(inout) :: tx(:, :), ty(:, :)         !! [nx, ny], Pa
      real(dp) :: slope(2), t(2)
      logical :: returned
      integer :: i, j

      slope = 0.0_dp
      !$omp parallel do default(none) shared(law, p, slope_x, slope_y, contact, tx, ty) &
      !$omp private(i, j, t, returned) firstprivate(slope)
      do j = 1, size(p, 2)
         do i = 1, size(p, 1)
            if (p(i, j) <= 0.0_dp .and. law%adhesive_pressure <= 0.0_dp) then
               contact(i, j) = contact_open
            end if
            if (contact(i, j) == contact_open) then
               tx(i, j) = 0.0_dp
               ty(i, j) = 0.0_dp
            else
               if (law%slope_effect) slope = [slope_x(i, j), slope_y(i, j)]
               t = [tx(i, j), ty(i, j)]
               call return_to_bound(law, p(i, j), slope, t, returned)
               if (returned) then
                  contact(i, j) = contact_slip
                  tx(i, j) = t(1)
                  ty(i, j) = t(2)
               end if
            end if
         end do
      end do
   end subroutine return_tractions

end module friction_bounds
