!> The tangential problem of one step and the state of its solution, which all methods of `friction_cg` share.
!>
!> The unknown is the traction T on the contact. The slip is r = DX - A (T + T_h), where T_h is a given traction. T
!> must be within the bound of module `friction_law`, with r = 0 where T is inside the bound (stick) and, where
!> T is on the bound (slip), r along the direction of slip v (D = T - T*, or D - n (n.D) by the physical law).
!> The residual of a point is
!>
!>     g = r                      inside, or on the bound with r.v < 0
!>     g = r - (r.v) v/|v|^2      on the bound with r.v >= 0
!>
!> so that g = 0 everywhere is the solution: points stick, or slip in the right direction and not in reverse.
!>
!> A method changes T by `move` or `move_total` (module `friction_moves`), and then updates the slip and its
!> measures: by `update_slip` from T itself, or by `advance_slip` from the slip before and the product A d that
!> the method has computed. Every procedure that changes T or r measures again, so that `tangent`, the states of
!> the points, the residual and the sums of the last measure always belong to the present T and r.
!>
!> If the total of T is prescribed, the position c of the road is unknown, too: r = DX + c - A (T + T_h).
!> Module `road_spring` gives c as a function of the total.
!>
!> The fields of the solution contain only the cells in contact (module `contact_runs`). A row is spread over the whole
!> row of the grid before its transform, and gathered behind it. r is also needed outside the contact, and is therefore
!> kept in the caller's field, too; `finish` returns T and the states to the caller.
!>
!> Each pass over the fields is one loop over rows, fused with the transforms of its row. Sums are
!> formed by row and added up in order, so that the results do not depend on the number of threads or processes.
module friction_problem
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan
   use asperity_precision, only : dp, int8
   use contact_runs, only : find_runs
   use fft_conv, only : columns_apply, convolution_type
   use friction_fields, only : friction_fields_type, friction_work_type
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, unbounded
   use field_sums, only : row_total
   use friction_rows, only : measure_sums_type, measured_row, row_constants_type, tangent_row, total_of
   use road_spring, only : road_spring_type
   implicit none
   private

   public :: friction_problem_type

   !> A point whose s (module `friction_law`) is below this value is on its bound.
   real(dp), parameter :: on_bound = 1.0_dp + 1.0e-9_dp
   real(dp), parameter :: deepest_inside = 4.0_dp         !! a slipping point whose s is above it sticks from then on
   real(dp), parameter :: far = 10.0_dp                   !! a long slip, in units of a_0 F
   real(dp), parameter :: stiffest = 1.0e15_dp            !! curvature of a bound, in units of a_0

   !> The problem and the state of its solution.
   type :: friction_problem_type
      type(friction_fields_type) :: fields   !! of the caller
      type(friction_law_type) :: law
      integer :: nx = 0                      !! cells of a row of the grid
      integer :: width = 0                   !! cells of a row of the solution
      integer :: rows = 0                    !! of this process
      integer :: threads = 1
      real(dp) :: compliance = 0.0_dp        !! a_0: displacement of a cell under its own unit traction
      !> Compliance of the mean mode along x and y, divided by the number of cells, if this mode is soft and is
      !> therefore treated separately; otherwise 0.
      real(dp) :: mean_compliance(2) = 0.0_dp
      real(dp) :: least_scale = 0.0_dp       !! least `scale`, m: keeps round-off from counting as displacement
      logical :: near = .false.              !! T starts near the solution
      logical :: settle = .true.             !! solved only if T no longer changes, too
      type(road_spring_type) :: spring       !! holds the road where the total of T is prescribed
      ! The state of the solution.
      type(friction_work_type), pointer :: work => null()
      type(row_constants_type) :: constants
      logical :: fresh = .false.             !! r comes from DX - A T, not from a recurrence
      real(dp) :: bounds = 0.0_dp            !! sum of the bounds, Pa
      integer :: cells = 0                   !! in contact
      integer :: foreseen = 0                !! cells in contact that started along the slip that was expected
      integer :: loaded = 0                  !! cells in contact whose first T was not zero
      integer :: slipping = 0                !! on the bound
      integer :: released = 0                !! points that left the bound since the last move
      type(measure_sums_type) :: sums        !! of the last measure
      real(dp) :: scale = 0.0_dp             !! of the displacements, m
      real(dp) :: residual = 0.0_dp          !! largest |g| over that scale
      real(dp) :: change = 0.0_dp            !! |T' - T|/|T'| of the last move (thesis, eq. 3.15)
   contains
      procedure :: place_start
      procedure :: measure_start
      procedure :: slope_at
      procedure :: place_on_bound
      procedure :: pressure_at
      procedure :: finish
      procedure :: update_slip
      procedure :: refresh_slip
      procedure :: advance_slip
      procedure :: spread_to_transform
      procedure :: transform_row
      procedure :: transform_tractions
      procedure :: solved
      procedure :: move_spring_end
   end type friction_problem_type

contains

   !> Gather the cells in contact, and project the first T: points that slipped in the step before are placed on their
   !> bound, and others within it.
   subroutine place_start(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), allocatable :: bounds(:)
      integer, allocatable :: cells(:), foreseen(:), loaded(:)
      integer :: j

      allocate (bounds(self%rows), cells(self%rows), foreseen(self%rows), loaded(self%rows))
      self%constants = row_constants_type(coefficient=self%law%reach_coefficient(), &
         strength=self%law%strength_beside(), physical=self%law%slope_effect .and. self%law%physical_slip, &
         compliance=self%compliance, stiffest=stiffest, on_bound=on_bound, deepest_inside=deepest_inside)
      call find_contact(self)
      !$omp parallel do default(none) shared(self, operator, bounds, cells, foreseen, loaded) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%rows
         call gather_row(self, j)
         bounds(j) = sum(self%work%site(:, 4, j))
         call start_row(self, j, cells(j), foreseen(j), loaded(j))
         call self%transform_row(operator, j)
      end do
      self%cells = row_total(cells)
      self%foreseen = row_total(foreseen)
      self%loaded = row_total(loaded)
      self%bounds = row_total(bounds)
      self%change = 0.0_dp
   end subroutine place_start

   !> Compute the slip of the first T, and measure it.
   subroutine measure_start(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator

      if (self%loaded == 0 .and. .not. associated(self%fields%past)) then
         call start_from_rest(self)
      else
         call self%update_slip(operator)
      end if
   end subroutine measure_start

   !> Find the cells in contact, and give the fields of the solution their number.
   subroutine find_contact(self)
      type(friction_problem_type), intent(inout) :: self
      integer :: j

      !$omp parallel do default(none) shared(self) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call find_contact_of_row(self%law, self%fields, j)
      end do
      call find_runs(self%work%runs, self%fields%contact, self%threads)
      call self%work%fit(self%rows, associated(self%fields%share))
      self%width = self%work%runs%width
   end subroutine find_contact

   !> Mark the cells of a row as open that carry no traction.
   subroutine find_contact_of_row(law, fields, j)
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields     !! its target `contact` is changed
      integer, intent(in) :: j

      if (associated(fields%share)) then
         fields%contact(:, j) = merge(max(fields%contact(:, j), contact_stick), contact_open, fields%share(:, j) > 0.0_dp)
      else if (law%adhesive_pressure <= 0.0_dp) then
         fields%contact(:, j) = merge(fields%contact(:, j), contact_open, fields%pressure(:, j) > 0.0_dp)
      end if
   end subroutine find_contact_of_row

   !> Gather the caller's fields of a row, and compute its bound.
   subroutine gather_row(self, j)
      type(friction_problem_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp) :: state(self%width)
      integer :: c

      associate (fields => self%fields, work => self%work, runs => self%work%runs)
         call runs%gather(j, real(fields%contact(:, j), dp), state)
         work%contact(:, j) = int(state, int8)
         call runs%gather(j, fields%pressure(:, j), work%site(:, 1, j))
         if (self%law%slope_effect) then
            call runs%gather(j, fields%slope_x(:, j), work%site(:, 2, j))
            call runs%gather(j, fields%slope_y(:, j), work%site(:, 3, j))
         else
            work%site(:, 2:3, j) = 0.0_dp
         end if
         call self%law%bound_row(self%width, work%site(:, 1, j), work%site(:, 2, j), work%site(:, 3, j), &
            work%site(:, 4:5, j))
         if (associated(fields%share)) then
            call runs%gather(j, fields%share(:, j), work%share(:, j))
            work%site(:, 4, j) = work%site(:, 4, j)*work%share(:, j)
         end if
         do c = 1, 2
            call runs%gather(j, fields%traction(:, c, j), work%traction(:, c, j))
            if (self%fields%slip_unit > 0.0_dp) call runs%gather(j, fields%slip(:, c, j), work%slip(:, c, j))
         end do
      end associate
   end subroutine gather_row

   !> Project the first T of a row.
   subroutine start_row(self, j, cells, foreseen, loaded)
      type(friction_problem_type), intent(inout) :: self
      integer, intent(in) :: j
      integer, intent(out) :: cells                !! in contact
      integer, intent(out) :: foreseen             !! cells in contact that start along the slip that is expected
      integer, intent(out) :: loaded               !! cells in contact whose first T is not zero
      real(dp) :: limit, s, t(2)
      integer :: i

      cells = 0
      foreseen = 0
      loaded = 0
      do i = 1, self%width
         t = 0.0_dp
         if (self%work%contact(i, j) /= contact_open) then
            t = self%work%traction(i, :, j)
            ! Slipping points are returned to their bound from both sides, others only from outside.
            limit = merge(deepest_inside, 1.0_dp, self%work%contact(i, j) == contact_slip)
            if (self%fields%slip_unit > 0.0_dp) call start_along_slip(self, i, j, t, limit, foreseen)
            call self%place_on_bound(i, j, limit, t, s)
            self%work%contact(i, j) = merge(contact_slip, contact_stick, s < limit .or. s <= on_bound)
            cells = cells + 1
            if (any(abs(t) > 0.0_dp)) loaded = loaded + 1
         end if
         self%work%traction(i, :, j) = t
         self%work%old(i, :, j) = t
      end do
   end subroutine start_row

   !> Return T and the states to the caller.
   subroutine finish(self)
      class(friction_problem_type), intent(in) :: self
      real(dp) :: state(self%nx)
      integer :: c, j

      !$omp parallel do default(none) shared(self) private(c, j, state) num_threads(self%threads)
      do j = 1, self%rows
         call self%work%runs%spread(j, real(self%work%contact(:, j), dp), state)
         self%fields%contact(:, j) = int(state, int8)
         do c = 1, 2
            call self%work%runs%spread(j, self%work%traction(:, c, j), self%fields%traction(:, c, j))
         end do
      end do
   end subroutine finish

   !> Let a point that is expected to slip far start along that slip. Its slip is long compared with the displacement
   !> of a cell under its own bound, so that its direction hardly depends on the tractions that are still to be
   !> found. The traction of the last step may be a worse start: a point that has just come into contact has no
   !> traction, and would stick at first.
   pure subroutine start_along_slip(self, i, j, t, limit, foreseen)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(inout) :: t(2)              !! Pa
      real(dp), intent(inout) :: limit             !! of s below which it is put on its bound
      integer, intent(inout) :: foreseen           !! points that start so
      real(dp) :: r(2), slip(2), length

      r = self%work%slip(i, :, j)
      slip = self%fields%slip_unit*self%law%slip_along_slope(self%slope_at(i, j), r)
      length = sqrt(slip(1)**2 + slip(2)**2)       ! not norm2, whose rounding depends on the size of the numbers
      if (length <= far*self%compliance*self%work%site(i, 4, j)) return
      t = self%law%normal_traction(self%pressure_at(i, j), self%slope_at(i, j)) &
         + (self%work%site(i, 4, j)/length)*slip
      limit = unbounded
      foreseen = foreseen + 1
   end subroutine start_along_slip

   !> Put the traction of a point on its bound if its s (module `friction_law`) is below a limit.
   pure subroutine place_on_bound(self, i, j, limit, t, s)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: limit                !! of s
      real(dp), intent(inout) :: t(2)              !! Pa
      real(dp), intent(out) :: s                   !! s of the traction that was given
      real(dp) :: share(2)

      share = 1.0_dp
      if (allocated(self%work%share)) share = self%work%share(i, j)
      call self%law%place_on_bound(self%pressure_at(i, j), self%slope_at(i, j), limit, t, s, share)
   end subroutine place_on_bound

   !> P at a point, Pa.
   pure function pressure_at(self, i, j) result(pressure)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: pressure

      pressure = self%work%site(i, 1, j)
   end function pressure_at

   !> grad H at a point; 0 if the slope effect is off.
   pure function slope_at(self, i, j) result(slope)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: slope(2)

      slope = self%work%site(i, 2:3, j)
   end function slope_at

   !> Transform a row of a field of the solution, after spreading it over the row of the grid.
   subroutine spread_to_transform(self, operator, row, j)
      class(friction_problem_type), intent(in) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in), contiguous :: row(:, :)        !! [width, 2]
      integer, intent(in) :: j
      real(dp) :: whole(self%nx)
      integer :: c

      do c = 1, 2
         call self%work%runs%spread(j, row(:, c), whole)
         call operator%forward_row(c, j, whole)
      end do
   end subroutine spread_to_transform

   !> Transform a row of T, or of T + T_h.
   subroutine transform_row(self, operator, j)
      class(friction_problem_type), intent(in) :: self
      type(convolution_type), intent(inout) :: operator
      integer, intent(in) :: j
      real(dp) :: whole(self%nx)
      integer :: c

      do c = 1, 2
         call self%work%runs%spread(j, self%work%traction(:, c, j), whole)
         if (associated(self%fields%past)) whole(:) = whole + self%fields%past(:, c, j)
         call operator%forward_row(c, j, whole)
      end do
   end subroutine transform_row

   !> Transform the rows of T.
   subroutine transform_tractions(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      integer :: j

      !$omp parallel do default(none) shared(self, operator) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%transform_row(operator, j)
      end do
   end subroutine transform_tractions

   !> Compute r = DX - A T from T alone, and measure it.
   subroutine refresh_slip(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator

      call self%transform_tractions(operator)
      call self%update_slip(operator)
   end subroutine refresh_slip

   !> Compute r = DX - A T from the transformed rows of T, and measure it.
   subroutine update_slip(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator

      self%fresh = .true.
      call self%spring%follow(self%work%traction)
      call operator%columns(columns_apply)
      call finish_slip(self, operator, 1.0_dp)
   end subroutine update_slip

   !> Update r = r - step A d, after the columns of the transform have been done for d, and measure it.
   subroutine advance_slip(self, operator, step)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step

      self%fresh = .false.
      call self%spring%follow(self%work%traction)
      call finish_slip(self, operator, step)
   end subroutine advance_slip

   !> Transform all rows back, update r and measure it. `update_slip` and `advance_slip` share this.
   subroutine finish_slip(self, operator, factor)
      type(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: factor
      type(measure_sums_type), allocatable :: rows(:)
      integer :: j

      allocate (rows(self%rows))
      !$omp parallel do default(none) shared(self, operator, factor, rows) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%rows
         call finish_slip_row(self, operator, factor, j)
         call measure_row(self, j, rows(j))
      end do
      call finish_measure(self, rows)
   end subroutine finish_slip

   !> Update one row of r from the inverse transform: r = DX + c - u, or r = r - factor u.
   subroutine finish_slip_row(self, operator, factor, j)
      type(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: factor
      integer, intent(in) :: j
      real(dp) :: u(self%nx)
      integer :: c

      do c = 1, 2
         call operator%backward_row(c, j, u)
         if (self%fresh) then
            self%fields%slip(:, c, j) = self%fields%drive(:, c, j) + self%spring%offset(c) - u
         else
            self%fields%slip(:, c, j) = self%fields%slip(:, c, j) + self%spring%offset_step(c) - factor*u
         end if
         call self%work%runs%gather(j, self%fields%slip(:, c, j), self%work%slip(:, c, j))
      end do
   end subroutine finish_slip_row

   !> Set r = DX + c without a product, because T is zero everywhere.
   subroutine start_from_rest(self)
      type(friction_problem_type), intent(inout) :: self
      integer :: c, j

      self%fresh = .true.
      call self%spring%follow(self%work%traction)
      do c = 1, 2
         !$omp parallel do default(none) shared(self, c) private(j) num_threads(self%threads)
         do j = 1, self%rows
            self%fields%slip(:, c, j) = self%fields%drive(:, c, j)
         end do
      end do
      call shift_slip(self, self%spring%offset)
   end subroutine start_from_rest

   !> Move the free end of the spring by `shift`, and the road with it, and measure.
   subroutine move_spring_end(self, shift)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)               !! m

      call self%spring%move_end(shift)
      call shift_slip(self, shift)
   end subroutine move_spring_end

   !> Add `shift` to r everywhere, and measure it.
   subroutine shift_slip(self, shift)
      type(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)               !! m
      type(measure_sums_type), allocatable :: rows(:)
      integer :: c, j

      allocate (rows(self%rows))
      !$omp parallel do default(none) shared(self, shift, rows) private(c, j) num_threads(self%threads)
      do j = 1, self%rows
         do c = 1, 2
            self%fields%slip(:, c, j) = self%fields%slip(:, c, j) + shift(c)
            call self%work%runs%gather(j, self%fields%slip(:, c, j), self%work%slip(:, c, j))
         end do
         call measure_row(self, j, rows(j))
      end do
      call finish_measure(self, rows)
   end subroutine shift_slip

   !> Release the points of a row that slip against their traction, and sum its residuals.
   subroutine measure_row(self, j, sums)
      type(friction_problem_type), intent(inout) :: self
      integer, intent(in) :: j
      type(measure_sums_type), intent(out) :: sums
      real(dp) :: drive(self%width, 2), state(self%width), released
      integer :: c

      associate (work => self%work)
         do c = 1, 2
            call work%runs%gather(j, self%fields%drive(:, c, j), drive(:, c))
         end do
         state(:) = work%contact(:, j)
         call tangent_row(self%constants, work%site(:, :, j), work%traction(:, :, j), work%slip(:, :, j), state, &
            work%tangent(:, :, j), released)
         call measured_row(self%compliance, work%traction(:, :, j), work%old(:, :, j), work%slip(:, :, j), drive, &
            state, work%tangent(:, :, j), sums)
         sums%released = released
         work%contact(:, j) = int(state, int8)
      end associate
   end subroutine measure_row

   !> Compute the residual from the sums of `measure_row`.
   subroutine finish_measure(self, rows)
      type(friction_problem_type), intent(inout) :: self
      type(measure_sums_type), intent(in) :: rows(:)

      self%sums = total_of(rows)
      self%released = nint(self%sums%released)
      self%slipping = nint(self%sums%slipping)
      self%scale = max(sqrt(max(self%sums%drive, self%sums%displaced)/max(self%cells, 1)), &
         self%least_scale, norm2(self%spring%offset))
      if (.not. self%scale > 0.0_dp) self%scale = 1.0_dp
      self%residual = sqrt(self%sums%largest)/self%scale
      ! A maximum passes over values that are not numbers, but a sum does not.
      if (ieee_is_nan(self%sums%drive + self%sums%displaced)) self%residual = self%sums%drive + self%sums%displaced
   end subroutine finish_measure

   !> Does the residual meet a tolerance, and with `settle` also the change of T?
   pure function solved(self, tolerance) result(yes)
      class(friction_problem_type), intent(in) :: self
      real(dp), intent(in) :: tolerance
      logical :: yes

      yes = self%residual <= tolerance .and. (self%change <= tolerance .or. .not. self%settle)
   end function solved

end module friction_problem
