!> The cells that may carry friction, and the horizontal force of the road beside their tractions.
module touching_cells
   use asperity_precision, only : dp, int8
   use contact_rule, only : touches
   use field_sums, only : row_totals
   implicit none
   private

   public :: force_beside, mark_contact

contains

   !> Mark the cells that may carry friction, those that touch. A cell that slipped is still marked so.
   subroutine mark_contact(adhesive, pressure, gap, contact)
      logical, intent(in) :: adhesive                 !! the contact has an adhesive potential
      real(dp), intent(in) :: pressure(:, :)          !! Pa
      real(dp), intent(in) :: gap(:, :)               !! m
      integer(int8), intent(inout) :: contact(:, :)   !! 0 open, 1 stick, 2 slip
      integer :: i, j

      !$omp parallel do default(none) shared(adhesive, pressure, gap, contact) private(i, j)
      do j = 1, size(contact, 2)
         do i = 1, size(contact, 1)
            if (.not. touches(adhesive, pressure(i, j), gap(i, j))) then
               contact(i, j) = 0_int8
            else if (contact(i, j) == 0_int8) then
               contact(i, j) = 1_int8
            end if
         end do
      end do
   end subroutine mark_contact

   !> The horizontal force of the road on the rubber that T does not hold, over the area of a cell: without
   !> slope that of all slopes, else that of the slopes which attraction pulls at outside the contact.
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
