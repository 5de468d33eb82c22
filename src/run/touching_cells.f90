!> The cells that may carry friction, and the part of the horizontal force that their tractions do not contain.
module touching_cells
   use asperity_precision, only : dp, int8
   use contact_rule, only : touches
   use field_sums, only : row_totals
   use friction_law, only : contact_open, contact_stick
   implicit none
   private

   public :: force_beside, mark_contact, mark_shares

contains

   !> Mark the cells that touch, because only they may carry friction. A cell that slipped keeps its mark.
   !>
   !> Without adhesion the solver of the normal contact leaves small pressures, of round-off or of its
   !> tolerance, in cells with a gap. That does no harm to a traction in proportion to the pressure.
   subroutine mark_contact(adhesive, pressure, gap, contact)
      logical, intent(in) :: adhesive                 !! the contact has an adhesive potential
      real(dp), intent(in) :: pressure(:, :)          !! Pa
      real(dp), intent(in) :: gap(:, :)               !! m
      integer(int8), intent(inout) :: contact(:, :)   !! 0 open, 1 stick, 2 slip
      integer :: j

      !$omp parallel do default(none) shared(adhesive, pressure, gap, contact) private(j)
      do j = 1, size(contact, 2)
         contact(:, j) = marked(contact(:, j), touches(adhesive, pressure(:, j), gap(:, j)))
      end do
   end subroutine mark_contact

   !> Mark the cells that may carry friction: those whose share of the bound is above zero.
   subroutine mark_shares(share, contact)
      real(dp), intent(in) :: share(:, :)
      integer(int8), intent(inout) :: contact(:, :)   !! 0 open, 1 stick, 2 slip
      integer :: j

      !$omp parallel do default(none) shared(share, contact) private(j)
      do j = 1, size(contact, 2)
         contact(:, j) = marked(contact(:, j), share(:, j) > 0.0_dp)
      end do
   end subroutine mark_shares

   !> The mark of a cell that may carry friction or not.
   elemental function marked(before, may) result(mark)
      integer(int8), intent(in) :: before
      logical, intent(in) :: may
      integer(int8) :: mark

      mark = contact_open
      if (may) mark = max(before, contact_stick)
   end function marked

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
         counts = contact(:, j) == contact_open .or. .not. slope
         rows(1, j) = sum(pressure(:, j)*slope_x(:, j), counts)
         rows(2, j) = sum(pressure(:, j)*slope_y(:, j), counts)
      end do
      force = -row_totals(rows)
   end function force_beside

end module touching_cells
