!> The energy that is lost by friction in a step, and the mean motion of the surface in the contact.
!>
!> The loss of a cell is the integral of its frictional traction d = T - T* along its slip r. A step knows d at both
!> ends only, and a cell need not slip during the whole step. Let e be the direction of r, t and t' the components of d
!> along e at both ends, and b the value that t would have on the bound of the start. As long as the cell sticks, its
!> traction is assumed to grow linearly, so that it would reach t' + |r|/a at the end of the step, while the bound
!> changes linearly from b to t'. (a is the displacement of the contact under a unit traction, `contact_compliance`.) The
!> slip begins where they meet, after the part s of the step:
!>
!>    s = (b - t)/(b - t + |r|/a),   onset = b + s (t' - b),   loss = (onset + t')/2 |r|
!>
!> A cell that slips from the start on has b = t, so that s = 0, and the mean of both ends counts; this is of second
!> order in the length of the step. On the slope of the road this is nearly so: b is taken with the slope at the end of the
!> step, because that of the start is not kept. A cell that enters or leaves the contact has no bound at one end. On a
!> steep slope b may be infinite; b is therefore at most max(t, 2 t').
!>
!> All of this is continuous in the tractions and the slip. The slip of a cell that sticks is an error of the solver, and
!> its loss is not counted.
module friction_books
   use asperity_precision, only : dp
   use contact_rule, only : touches
   use field_sums, only : row_totals
   use friction_fields, only : friction_fields_type
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, unbounded
   use tangential_state, only : tangential_state_type
   implicit none
   private

   public :: book_friction, book_rest, mark_idle, rubbed_type

   !> Sums over the cells.
   type :: rubbed_type
      real(dp) :: loss = 0.0_dp                       !! J/m2
      real(dp) :: motion(2) = 0.0_dp                  !! motion of the surface in the contact, m
      real(dp) :: cells = 0.0_dp                      !! number of cells in contact
   end type rubbed_type

contains

   !> Form the sums of a step. The state keeps the frictional tractions and the forces of the law for the next step.
   subroutine book_friction(state, law, fields, trial, rubbed)
      type(tangential_state_type), intent(inout) :: state   !! displacement: at the start of the step
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields   !! pressure, shares, slopes and slip of the step
      real(dp), intent(in) :: trial(:, :, :)          !! [nx, 2, rows] displacement at the end, m
      type(rubbed_type), intent(out) :: rubbed
      real(dp), allocatable :: rows(:, :)
      real(dp) :: a, before(2), force, rubbing(2), share(2), slip(2), slope(2), total(4)
      integer :: i, j

      allocate (rows(4, size(trial, 3)), source=0.0_dp)
      slope = 0.0_dp
      share = 1.0_dp
      a = contact_compliance(state, law, fields, trial)
      !$omp parallel do default(none) shared(state, law, a, fields, trial, rows) &
      !$omp private(i, j, before, force, rubbing, slip) firstprivate(share, slope)
      do j = 1, size(trial, 3)
         do i = 1, size(trial, 1)
            rubbing = 0.0_dp
            force = 0.0_dp
            if (law%slope_effect) slope = [fields%slope_x(i, j), fields%slope_y(i, j)]
            if (state%contact(i, j) /= contact_open) then
               rubbing = state%traction(i, :, j) - law%normal_traction(fields%pressure(i, j), slope)
               if (associated(fields%share)) share = [1.0_dp, fields%share(i, j)]
               force = law%friction_force(fields%pressure(i, j), slope, share)
               rows(2:3, j) = rows(2:3, j) + trial(i, :, j) - state%displacement(i, :, j)
               rows(4, j) = rows(4, j) + 1.0_dp
            end if
            ! The slip of a point that sticks is an error within the tolerance of the solver, and causes no loss.
            if (state%contact(i, j) /= contact_stick) then
               before = state%rubbing(i, :, j)
               slip = fields%slip(i, :, j)
               rows(1, j) = rows(1, j) + friction_loss(law, a, slope, state%force(i, j), before, rubbing, slip)
            end if
            state%rubbing(i, :, j) = rubbing
            state%force(i, j) = force
         end do
      end do
      total = row_totals(rows)
      rubbed = rubbed_type(total(1), total(2:3), total(4))
   end subroutine book_friction

   !> The displacement of the contact under a unit traction in this step, m/Pa: the mean over the cells that stay in contact,
   !> weighted with the square of the change d' - d of their frictional traction. It does not depend on how many periods of
   !> a road are computed.
   function contact_compliance(state, law, fields, trial) result(a)
      type(tangential_state_type), intent(in) :: state      !! displacement and frictional traction at the start of the step
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields
      real(dp), intent(in) :: trial(:, :, :)          !! [nx, 2, rows] displacement at the end, m
      real(dp) :: a
      real(dp), allocatable :: rows(:, :)
      real(dp) :: change(2), slope(2), total(2)
      integer :: i, j

      allocate (rows(2, size(trial, 3)), source=0.0_dp)
      slope = 0.0_dp
      !$omp parallel do default(none) shared(state, law, fields, trial, rows) private(i, j, change) firstprivate(slope)
      do j = 1, size(trial, 3)
         do i = 1, size(trial, 1)
            if (state%contact(i, j) == contact_open .or. .not. state%force(i, j) > 0.0_dp) cycle
            if (law%slope_effect) slope = [fields%slope_x(i, j), fields%slope_y(i, j)]
            change = state%traction(i, :, j) - law%normal_traction(fields%pressure(i, j), slope) - state%rubbing(i, :, j)
            rows(1, j) = rows(1, j) + dot_product(change, trial(i, :, j) - state%displacement(i, :, j))
            rows(2, j) = rows(2, j) + dot_product(change, change)
         end do
      end do

      total = row_totals(rows)
      a = 0.0_dp
      if (total(2) > 0.0_dp) a = max(total(1)/total(2), 0.0_dp)
   end function contact_compliance

   !> Mark cells as sticking that are on their bound, but whose slip is not larger than the error of the solver may be.
   !> Which of the two states the solver assigns to such a cell is round-off: for example when the road has stopped.
   subroutine mark_idle(state, slip, least)
      type(tangential_state_type), intent(inout) :: state
      real(dp), intent(in) :: slip(:, :, :)           !! m [nx, 2, rows]
      real(dp), intent(in) :: least                   !! least slip that exceeds the error of a solve, m
      integer :: i, j

      !$omp parallel do default(none) shared(state, slip, least) private(i, j)
      do j = 1, size(slip, 3)
         do i = 1, size(slip, 1)
            if (state%contact(i, j) == contact_slip .and. norm2(slip(i, :, j)) <= least) &
               state%contact(i, j) = contact_stick
         end do
      end do
   end subroutine mark_idle

   !> Note the frictional tractions and the forces of the law in a contact without friction, because the road has not
   !> moved yet. T = 0 there, so that d = -T*, returned to the bound where the law does not allow so much.
   subroutine book_rest(state, law, adhesive, pressure, gap, slope_x, slope_y)
      type(tangential_state_type), intent(inout) :: state
      type(friction_law_type), intent(in) :: law
      logical, intent(in) :: adhesive                 !! the contact has an adhesive potential
      real(dp), intent(in) :: pressure(:, :)          !! [nx, rows] Pa
      real(dp), intent(in) :: gap(:, :)               !! m
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      real(dp) :: d(2), slope(2)
      real(dp), parameter :: whole(2) = 1.0_dp
      integer :: i, j

      !$omp parallel do default(none) shared(state, law, adhesive, pressure, gap, slope_x, slope_y) private(i, j, d, slope)
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            state%force(i, j) = 0.0_dp
            state%rubbing(i, :, j) = 0.0_dp
            if (.not. touches(adhesive, pressure(i, j), gap(i, j))) cycle
            slope = [slope_x(i, j), slope_y(i, j)]
            state%force(i, j) = law%friction_force(pressure(i, j), slope, whole)
            d = -law%normal_traction(pressure(i, j), slope)
            state%rubbing(i, :, j) = min(law%ratio_under(state%force(i, j), slope, d, whole), 1.0_dp)*d
         end do
      end do
   end subroutine book_rest

   !> The loss of a cell by friction in a step, J/m2.
   pure function friction_loss(law, compliance, slope, force, before, after, slip) result(loss)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: compliance              !! a, m/Pa
      real(dp), intent(in) :: slope(2)                !! of the road at the end of the step
      real(dp), intent(in) :: force                   !! of the law at the start of the step, Pa; 0 if it was open
      real(dp), intent(in) :: before(2)               !! T - T* at the start of the step, Pa
      real(dp), intent(in) :: after(2)                !! and at its end, Pa
      real(dp), intent(in) :: slip(2)                 !! m
      real(dp) :: loss
      real(dp) :: along(2), ahead(2), length, first, last, bound, inside, onset, sticks, slips

      loss = 0.0_dp
      if (.not. any(abs([before, after]) > 0.0_dp)) return
      length = norm2(slip)
      if (.not. length > 0.0_dp) return
      along = slip/length
      first = dot_product(before, along)
      last = max(dot_product(after, along), 0.0_dp)

      ! The bound of the start, in the direction of the traction at the end: on a slope it is not that of the slip.
      ahead = along
      if (last > 0.0_dp) ahead = after
      bound = law%ratio_under(force, slope, ahead, [1.0_dp, 1.0_dp])
      if (bound < unbounded) bound = bound*dot_product(ahead, along)
      bound = max(min(bound, 2.0_dp*last), first)

      ! The parts of the step in which the cell sticks and slips.
      inside = (bound - first)*compliance
      sticks = inside/(inside + length)
      slips = length/(inside + length)
      onset = slips*bound + sticks*last
      loss = 0.5_dp*max(onset + last, 0.0_dp)*length
   end function friction_loss

end module friction_books
