!> The cells that may carry friction, and the part of the horizontal force that their tractions do not contain.
module touching_cells
   use adhesion_potential, only : adhesion_potential_type, adhesive_slope
   use asperity_precision, only : dp, int8
   use contact_rule, only : touches
   use field_sums, only : row_totals
   implicit none
   private

   public :: edge_error, force_beside, mark_contact

contains

   !> Mark the cells that touch, because only they may carry friction. A cell that slipped keeps its mark.
   !>
   !> Without adhesion the solver of the normal contact leaves small pressures, of the order of round-off or of its
   !> tolerance, in cells with a gap. This is harmless if the traction is proportional to the pressure. If a cell
   !> carries the same traction under any pressure, it counts as touching only if its gap is smaller than the
   !> length by which its pressure presses it in. In the exact solution the smaller of the two is zero.
   subroutine mark_contact(adhesive, soft, pressure, gap, contact)
      logical, intent(in) :: adhesive                 !! the contact has an adhesive potential
      real(dp), intent(in) :: soft                    !! displacement of a cell under its own unit traction, m/Pa;
                                                      !! 0: the pressure alone decides
      real(dp), intent(in) :: pressure(:, :)          !! Pa
      real(dp), intent(in) :: gap(:, :)               !! m
      integer(int8), intent(inout) :: contact(:, :)   !! 0 open, 1 stick, 2 slip
      logical :: open
      integer :: i, j

      !$omp parallel do default(none) shared(adhesive, soft, pressure, gap, contact) private(i, j, open)
      do j = 1, size(contact, 2)
         do i = 1, size(contact, 1)
            open = .not. touches(adhesive, pressure(i, j), gap(i, j))
            if (soft > 0.0_dp .and. .not. adhesive) open = open .or. gap(i, j) >= soft*pressure(i, j)
            if (open) then
               contact(i, j) = 0_int8
            else if (contact(i, j) == 0_int8) then
               contact(i, j) = 1_int8
            end if
         end do
      end do
   end subroutine mark_contact

   !> The violation of the contact conditions, summed over the cells and divided by the sum of the lengths by which
   !> their pressures press them in. The error of a cell that carries friction is its gap; that of any other cell
   !> is its overlap with the road, or the length that belongs to its wall pressure. The result is 0 if there are
   !> no such lengths: without any pressure, and on a grid of one cell. Collective if processes share the rows.
   function edge_error(potential, soft, contact, pressure, gap) result(error)
      type(adhesion_potential_type), intent(in) :: potential
      real(dp), intent(in) :: soft                    !! displacement of a cell under its own unit traction, m/Pa
      integer(int8), intent(in) :: contact(:, :)      !! 0 open, 1 stick, 2 slip
      real(dp), intent(in) :: pressure(:, :)          !! attraction included, Pa
      real(dp), intent(in) :: gap(:, :)               !! m
      real(dp) :: error
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(2), wall(size(gap, 1))
      integer :: j

      allocate (rows(2, size(gap, 2)))
      !$omp parallel do default(none) shared(potential, soft, contact, pressure, gap, rows) private(j, wall)
      do j = 1, size(gap, 2)
         wall(:) = pressure(:, j) + adhesive_slope(potential, max(gap(:, j), 0.0_dp))
         rows(1, j) = sum(abs(pressure(:, j)))
         rows(2, j) = sum(merge(max(soft*abs(wall), -gap(:, j)), abs(gap(:, j)), contact(:, j) == 0_int8))
      end do
      sums = row_totals(rows)
      error = 0.0_dp
      if (soft*sums(1) > 0.0_dp) error = sums(2)/(soft*sums(1))
   end function edge_error

   !> The horizontal force of the road on the rubber that T does not contain, over the area of a cell: without the
   !> slope effect the force on all slopes, otherwise only that of the attraction on slopes outside the contact.
   function force_beside(contact, slope, pressure, slope_x, slope_y) result(force)
      integer(int8), intent(in) :: contact(:, :)      !! 0 open, 1 stick, 2 slip
      logical, intent(in) :: slope                    !! T contains the force of the slopes in contact
      real(dp), intent(in) :: pressure(:, :)          !! Pa
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      real(dp) :: force(2)                            !! Pa
      real(dp), allocatable :: rows(:, :)
      logical, allocatable :: counts(:)
      integer :: j

      allocate (rows(2, size(contact, 2)))
      !$omp parallel do default(none) shared(contact, slope, pressure, slope_x, slope_y, rows) private(j, counts)
      do j = 1, size(contact, 2)
         counts = contact(:, j) == 0_int8 .or. .not. slope
         rows(1, j) = sum(pressure(:, j)*slope_x(:, j), counts)
         rows(2, j) = sum(pressure(:, j)*slope_y(:, j), counts)
      end do
      force = -row_totals(rows)
   end function force_beside

end module touching_cells
