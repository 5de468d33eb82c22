!> The energy that friction takes in a step, cell by cell, and how far the surface in the contact has moved.
!>
!> The loss by friction is that of the mean traction over the step, second order in its length.
module friction_books
   use asperity_precision, only : dp, int8
   use field_sums, only : row_totals
   use friction_law, only : friction_law_type
   use tangential_state, only : tangential_state_type
   implicit none
   private

   public :: book_friction, rubbed_type

   !> Sums over the cells.
   type :: rubbed_type
      real(dp) :: loss = 0.0_dp                       !! J/m2
      real(dp) :: way(2) = 0.0_dp                     !! by which the surface in the contact has moved, m
      real(dp) :: cells = 0.0_dp                      !! in the contact
   end type rubbed_type

contains

   !> The sums of a step. The state remembers the frictional tractions for the next one.
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
            if (state%contact(i, j) /= 0_int8) then
               if (law%slope) slope = [slope_x(i, j), slope_y(i, j)]
               rubbing = state%traction(i, :, j) - law%normal_traction(pressure(i, j), slope)
               rows(2:3, j) = rows(2:3, j) + trial(i, :, j) - state%displacement(i, :, j)
               rows(4, j) = rows(4, j) + 1.0_dp
            end if
            ! The slip of a point that sticks is what the solver's tolerance left: it loses nothing.
            if (state%contact(i, j) /= 1_int8) rows(1, j) = rows(1, j) &
               + rubbed_off(state%rubbed(i, j) == 1_int8, state%rubbing(i, :, j), rubbing, slip(i, :, j))
            state%rubbing(i, :, j) = rubbing
            state%rubbed(i, j) = state%contact(i, j)
         end do
      end do
      total = row_totals(rows)
      rubbed = rubbed_type(total(1), total(2:3), total(4))
   end subroutine book_friction

   !> What a cell loses by friction in a step, J/m2: the mean of the frictional tractions at both ends times
   !> the slip. A cell that enters or leaves the contact has none at one end. A cell that stuck at the start
   !> slips only once its traction has reached its bound, so that the traction of the end counts alone; so it
   !> does where the slip has turned against the traction of the start, since the cell has stuck in between.
   pure function rubbed_off(stuck, before, after, slip) result(loss)
      logical, intent(in) :: stuck                    !! at the start of the step
      real(dp), intent(in) :: before(2)               !! T - T* at the start of the step, Pa
      real(dp), intent(in) :: after(2)                !! and at its end, Pa
      real(dp), intent(in) :: slip(2)                 !! m
      real(dp) :: loss
      real(dp) :: first

      loss = max(dot_product(after, slip), 0.0_dp)
      first = dot_product(before, slip)
      if (first >= 0.0_dp .and. .not. stuck) loss = 0.5_dp*(first + loss)
   end function rubbed_off

end module friction_books
