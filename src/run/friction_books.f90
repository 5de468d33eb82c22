!> The energy that is lost by friction in a step, and the mean motion of the surface in the contact.
!>
!> The loss of a cell is the mean traction over the step times the slip, which is of second order in the length of
!> the step.
module friction_books
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   use friction_law, only : contact_open, contact_stick, friction_law_type
   use tangential_state, only : tangential_state_type
   implicit none
   private

   public :: book_friction, rubbed_type

   !> Sums over the cells.
   type :: rubbed_type
      real(dp) :: loss = 0.0_dp                       !! J/m2
      real(dp) :: motion(2) = 0.0_dp                 !! motion of the surface in the contact, m
      real(dp) :: cells = 0.0_dp                      !! number of cells in contact
   end type rubbed_type

contains

   !> Form the sums of a step. The state keeps the frictional tractions for the next step.
   subroutine book_friction(state, law, trial, slip, pressure, slope_x, slope_y, rubbed)
      type(tangential_state_type), intent(inout) :: state   !! displacement: at the start of the step
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: trial(:, :, :)          !! [nx, 2, rows] displacement at the end, m
      real(dp), intent(in) :: slip(:, :, :)           !! [nx, 2, rows] m
      real(dp), intent(in) :: pressure(:, :)          !! [nx, rows] Pa
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      type(rubbed_type), intent(out) :: rubbed
      real(dp), allocatable :: rows(:, :)
      real(dp) :: rubbing(2), slope(2), total(4)
      integer :: i, j

      allocate (rows(4, size(pressure, 2)), source=0.0_dp)
      slope = 0.0_dp
      !$omp parallel do default(none) shared(state, law, trial, slip, pressure, slope_x, slope_y, rows) &
      !$omp private(i, j, rubbing) firstprivate(slope)
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            rubbing = 0.0_dp
            if (state%contact(i, j) /= contact_open) then
               if (law%slope_effect) slope = [slope_x(i, j), slope_y(i, j)]
               rubbing = state%traction(i, :, j) - law%normal_traction(pressure(i, j), slope)
               rows(2:3, j) = rows(2:3, j) + trial(i, :, j) - state%displacement(i, :, j)
               rows(4, j) = rows(4, j) + 1.0_dp
            end if
            ! The slip of a point that sticks is an error within the tolerance of the solver, and causes no loss.
            if (state%contact(i, j) /= contact_stick) rows(1, j) = rows(1, j) + friction_loss( &
               state%rubbed(i, j) == contact_stick, state%rubbing(i, :, j), rubbing, slip(i, :, j))
            state%rubbing(i, :, j) = rubbing
            state%rubbed(i, j) = state%contact(i, j)
         end do
      end do
      total = row_totals(rows)
      rubbed = rubbed_type(total(1), total(2:3), total(4))
   end subroutine book_friction

   !> The loss of a cell by friction in a step, J/m2: the mean of the frictional tractions at both ends of the step times
   !> the slip. A cell that enters or leaves the contact has no traction at one end. A cell that stuck at the start slips
   !> only after its traction has reached the bound, so that only the traction at the end counts. The same holds if
   !> the slip is opposed to the traction of the start, because the cell must have stuck in between.
   pure function friction_loss(stuck, before, after, slip) result(loss)
      logical, intent(in) :: stuck                    !! at the start of the step
      real(dp), intent(in) :: before(2)               !! T - T* at the start of the step, Pa
      real(dp), intent(in) :: after(2)                !! and at its end, Pa
      real(dp), intent(in) :: slip(2)                 !! m
      real(dp) :: loss
      real(dp) :: first

      loss = max(dot_product(after, slip), 0.0_dp)
      first = dot_product(before, slip)
      if (first >= 0.0_dp .and. .not. stuck) loss = 0.5_dp*(first + loss)
   end function friction_loss

end module friction_books
