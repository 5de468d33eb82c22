!> What the methods of `friction_cg` share: the tangential problem of one step, with its passes.
!>
!> Unknown: the traction T on the contact. The slip is r = DX - A (T + T_h), T_h a given traction.
!> Wanted is T within the bound of module `friction_law`, with r = 0 where T is inside (stick) and,
!> where T is on the bound (slip), r along the direction of slip v (D = T - T*, or D - n (n.D) by
!> the physical law). The residual of a point
!>
!>     g = r                      inside, or on the bound with r.v < 0
!>     g = r - (r.v) v/|v|^2      on the bound with r.v >= 0
!>
!> so that g = 0 everywhere is the solution: stick, direction of slip and no reversed slip.
!>
!> The total of T can be prescribed, along x, y or both. Then the place c of the road along this
!> direction is unknown too: r = DX + c - A (T + T_h). The road hangs on a spring of compliance kappa,
!>
!>     c = X - kappa (sum(T) - F)
!>
!> which makes sum(T) = F where X = c (method of multipliers: `hang_anew` moves X there). A spring much
!> softer than the contact needs few such moves. A mass in the place of a spring needs none.
!>
!> Each pass over the fields is one loop over rows, fused with the transforms of its row. Sums are
!> formed by row and added up in order: the results do not depend on the number of threads.
module friction_problem
   use fft_conv, only : columns_apply, convolution_type
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, &
      law_constant_shear, law_coulomb_orowan
   use friction_rows, only : bound_row, measured_row, measures, moved_row, moves, &
      row_constants_type
   use asperity_parallel, only : global_max, global_sum
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: friction_problem_type, pseudo_inverse

   real(dp), parameter :: on_bound = 1.0_dp + 1.0e-9_dp   !! a point with s below it is on its bound
   real(dp), parameter :: outermost = 4.0_dp              !! no point is moved out by more than this
   real(dp), parameter :: stiffest = 1.0e15_dp            !! curvature of a bound, in units of a_0

   real(dp), parameter :: few = 1.0e-6_dp      !! points that cannot make good for all others
   integer, parameter :: corrections = 12       !! of a total, at most
   !> What of a total may be missed: the slip that it makes over the largest residual.
   real(dp), parameter :: negligible = 0.1_dp

   !> The fields of one solve (the caller's, by pointers) and its measures.
   type :: friction_problem_type
      type(friction_law_type) :: law
      integer :: nx = 0, ny = 0
      integer :: threads = 1
      real(dp) :: compliance = 0.0_dp        !! a_0: displacement of a cell under its own unit traction
      !> Of the mean mode along x and y where it is soft, over the number of cells; else 0.
      real(dp) :: mean_compliance(2) = 0.0_dp
      ! A prescribed total, see the header.
      logical :: pulled(2) = .false.         !! the total along this direction is prescribed
      real(dp) :: pull(2) = 0.0_dp           !! F: the sum of T over the cells that is prescribed, Pa
      real(dp) :: spring(2) = 0.0_dp         !! kappa: compliance of the spring, m/Pa of the sum
      real(dp) :: spring_end(2) = 0.0_dp     !! X: where the spring would leave the road under F, m
      real(dp) :: total(2) = 0.0_dp          !! sum of T, Pa
      real(dp) :: offset(2) = 0.0_dp         !! c: how far the road is, m
      real(dp), private :: offset_step(2) = 0.0_dp   !! change of c that r still lacks, m
      real(dp), pointer, contiguous :: p(:, :) => null()
      real(dp), pointer, contiguous :: hx(:, :) => null(), hy(:, :) => null()
      real(dp), pointer, contiguous :: drive_x(:, :) => null(), drive_y(:, :) => null()
      real(dp), pointer, contiguous :: tx(:, :) => null(), ty(:, :) => null()
      real(dp), pointer, contiguous :: rx(:, :) => null(), ry(:, :) => null()
      real(dp), pointer, contiguous :: past_x(:, :) => null()   !! T_h, where there is a memory
      real(dp), pointer, contiguous :: past_y(:, :) => null()
      !> The measure of a point (module `friction_rows`): unit direction of slip and weight.
      real(dp), pointer, contiguous :: vx(:, :) => null(), vy(:, :) => null(), weight(:, :) => null()
      real(dp), pointer, contiguous :: force(:, :) => null()    !! F of the bound, Pa
      real(dp), pointer, contiguous :: nz(:, :) => null()       !! N_z of the road
      real(dp), allocatable :: level_row(:)  !! grad H of a row where the slope does not count
      type(row_constants_type) :: constants
      real(dp), pointer, contiguous :: old_x(:, :) => null()    !! T before the last move
      real(dp), pointer, contiguous :: old_y(:, :) => null()
      integer(int8), pointer, contiguous :: contact(:, :) => null()
      real(dp), allocatable :: row_sums(:, :)
      logical :: near = .false.              !! T starts near the solution
      logical :: settle = .true.             !! T has to settle for the problem to be solved
      integer :: cells = 0                   !! in contact
      integer :: slipping = 0                !! on the bound
      integer :: released = 0                !! left the bound since the last move
      logical :: fresh = .false.             !! r comes from DX - A T, not from a recurrence
      real(dp) :: weighted_residual(2) = 0.0_dp       !! sum of w g
      real(dp) :: weighted_tangent(2, 2) = 0.0_dp     !! E = sum of w Z
      real(dp) :: curved_tangent(2, 2) = 0.0_dp       !! sum of lam w^2 Z
      real(dp) :: gain_left = 0.0_dp         !! g'.(T' - T) of the last move, with g' after it
      real(dp) :: least_scale = 0.0_dp       !! of the displacements, m: less than this does not count
      real(dp) :: scale = 0.0_dp             !! of the displacements, m
      real(dp) :: residual = 0.0_dp          !! largest |g| over that scale
      real(dp) :: change = 0.0_dp            !! |T' - T|/|T'| of the last move (thesis, eq. 3.15)
   contains
      procedure :: start
      procedure :: slope_at
      procedure :: friction_part
      procedure :: put_back
      procedure :: update_slip
      procedure :: advance_slip
      procedure :: start_from_rest
      procedure :: move
      procedure :: move_total
      procedure :: transform_tractions
      procedure :: solved
      procedure :: totals
      procedure :: hang_anew
      procedure :: add_spring
   end type friction_problem_type

contains

   !> Bring the first T within its bound, slip points of the step before onto it, and transform its
   !> rows.
   subroutine start(self, operator, moving)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      logical, intent(out) :: moving         !! T + T_h is not zero everywhere
      real(dp) :: t(2), mu, strength
      logical :: moved
      integer :: i, j

      allocate (self%row_sums(measures, self%ny), self%level_row(self%nx))
      self%level_row = 0.0_dp
      mu = self%law%coefficient
      strength = -1.0_dp
      if (self%law%law == law_constant_shear) then
         mu = 0.0_dp
         strength = self%law%shear_strength
      end if
      self%constants = row_constants_type(coefficient=mu, compliance=self%compliance, &
         physical=self%law%slope .and. self%law%physical_slip, stiffest=stiffest, &
         on_bound=on_bound, outermost=outermost)
      if (self%law%law == law_coulomb_orowan) self%constants%strength = self%law%shear_strength

      !$omp parallel do default(none) shared(self, operator, mu, strength) private(i, j, t, moved) &
      !$omp num_threads(self%threads)
      do j = 1, self%ny
         if (self%law%slope) then
            call bound_row(self%nx, mu, self%law%adhesive_pressure, strength, self%p(:, j), &
               self%hx(:, j), self%hy(:, j), self%force(:, j), self%nz(:, j))
         else
            call bound_row(self%nx, mu, self%law%adhesive_pressure, strength, self%p(:, j), &
               self%level_row, self%level_row, self%force(:, j), self%nz(:, j))
         end if
         self%row_sums(:, j) = 0.0_dp
         do i = 1, self%nx
            if (self%p(i, j) <= 0.0_dp .and. self%law%adhesive_pressure <= 0.0_dp) then
               self%contact(i, j) = contact_open
            end if
            if (self%contact(i, j) == contact_open) then
               self%tx(i, j) = 0.0_dp
               self%ty(i, j) = 0.0_dp
            else
               t = [self%tx(i, j), self%ty(i, j)]
               call self%put_back(i, j, t, self%contact(i, j), moved)
               self%tx(i, j) = t(1)
               self%ty(i, j) = t(2)
               self%row_sums(1, j) = self%row_sums(1, j) + 1.0_dp
               self%row_sums(2, j) = self%row_sums(2, j) + self%tx(i, j)**2 + self%ty(i, j)**2
            end if
         end do
         self%old_x(:, j) = self%tx(:, j)
         self%old_y(:, j) = self%ty(:, j)
         call transform_row(self, operator, j)
      end do
      associate (sums => self%totals(2))
         self%cells = nint(sums(1))
         moving = sums(2) > 0.0_dp .or. associated(self%past_x)
      end associate
      self%change = 0.0_dp
   end subroutine start

   !> grad H at a point, 0 where the slope does not count.
   pure function slope_at(self, i, j) result(slope)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: slope(2)

      if (self%law%slope) then
         slope = [self%hx(i, j), self%hy(i, j)]
      else
         slope = 0.0_dp
      end if
   end function slope_at

   !> D = T - T* at a point.
   pure function friction_part(self, i, j, slope) result(d)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: slope(2)
      real(dp) :: d(2)

      d = [self%tx(i, j), self%ty(i, j)] - self%law%normal_traction(self%p(i, j), slope)
   end function friction_part

   !> The traction and the state of a point that moved to T: slip points go back on their bound from
   !> both sides, others only from outside.
   pure subroutine put_back(self, i, j, t, state, returned)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(inout) :: t(2)              !! Pa
      integer(int8), intent(inout) :: state
      logical, intent(out) :: returned             !! it was moved
      real(dp) :: slope(2), s

      slope = 0.0_dp
      if (self%law%slope) then
         slope(1) = self%hx(i, j)
         slope(2) = self%hy(i, j)
      end if
      call self%law%place_on_bound(self%p(i, j), slope, &
         merge(outermost, 1.0_dp, state == contact_slip), t, s)
      returned = s < 1.0_dp .or. (state == contact_slip .and. s < outermost)
      state = merge(contact_slip, contact_stick, returned .or. s <= on_bound)
   end subroutine put_back

   !> r = DX - A T from the transformed rows of T; then measure.
   subroutine update_slip(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp) :: form

      self%fresh = .true.
      call follow_total(self)
      call operator%columns(columns_apply, form)
      call slip_pass(self, operator, 1.0_dp)
   end subroutine update_slip

   !> r = r - step A d, after the operator's columns have been done for d; then measure.
   subroutine advance_slip(self, operator, step)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step

      self%fresh = .false.
      call follow_total(self)
      call slip_pass(self, operator, step)
   end subroutine advance_slip

   !> The rows of `update_slip` and `advance_slip`.
   subroutine slip_pass(self, operator, factor)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: factor
      real(dp) :: largest
      integer :: j

      largest = 0.0_dp
      !$omp parallel do default(none) shared(self, operator, factor) private(j) &
      !$omp reduction(max: largest) num_threads(self%threads)
      do j = 1, self%ny
         call slip_row(self, operator, factor, j)
         call measure_row(self, j, largest)
      end do
      call finish_measure(self, largest)
   end subroutine slip_pass

   !> One row of r.
   subroutine slip_row(self, operator, factor, j)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: factor
      integer, intent(in) :: j
      real(dp) :: u(self%nx)

      call operator%backward_row(1, j, u)
      if (self%fresh) then
         self%rx(:, j) = self%drive_x(:, j) + self%offset(1) - u
      else
         self%rx(:, j) = self%rx(:, j) + self%offset_step(1) - factor*u
      end if
      call operator%backward_row(2, j, u)
      if (self%fresh) then
         self%ry(:, j) = self%drive_y(:, j) + self%offset(2) - u
      else
         self%ry(:, j) = self%ry(:, j) + self%offset_step(2) - factor*u
      end if
   end subroutine slip_row

   !> r = DX where T is zero everywhere.
   subroutine start_from_rest(self)
      class(friction_problem_type), intent(inout) :: self
      real(dp) :: largest
      integer :: j

      self%fresh = .true.
      call follow_total(self)
      largest = 0.0_dp
      !$omp parallel do default(none) shared(self) private(j) &
      !$omp reduction(max: largest) num_threads(self%threads)
      do j = 1, self%ny
         self%rx(:, j) = self%drive_x(:, j) + self%offset(1)
         self%ry(:, j) = self%drive_y(:, j) + self%offset(2)
         call measure_row(self, j, largest)
      end do
      call finish_measure(self, largest)
   end subroutine start_from_rest

   !> The total of T where it is prescribed, and where the road then is.
   subroutine follow_total(self)
      class(friction_problem_type), intent(inout) :: self
      real(dp) :: before(2)

      if (.not. any(self%pulled)) return
      before = self%offset
      self%total = sum_of(self, self%tx, self%ty)
      where (self%pulled) self%offset = self%spring_end - self%spring*(self%total - self%pull)
      self%offset_step = self%offset - before
   end subroutine follow_total

   !> Sums of a vector field, by rows in order.
   function sum_of(self, x, y) result(total)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: x(:, :), y(:, :)
      real(dp) :: total(2)
      integer :: j

      !$omp parallel do default(none) shared(self, x, y) private(j) num_threads(self%threads)
      do j = 1, self%ny
         self%row_sums(1, j) = sum(x(:, j))
         self%row_sums(2, j) = sum(y(:, j))
      end do
      total = self%totals(2)
   end function sum_of

   !> Add the part of the spring to the form d.A d of a direction.
   subroutine add_spring(self, dx, dy, form)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: dx(:, :), dy(:, :)
      real(dp), intent(inout) :: form

      if (any(self%pulled)) form = form + sum(self%spring*sum_of(self, dx, dy)**2, self%pulled)
   end subroutine add_spring

   !> Move the free end of the spring by `way`, and the road with it; then measure.
   subroutine hang_anew(self, way)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: way(2)               !! m
      real(dp) :: largest
      integer :: j

      self%spring_end = self%spring_end + way
      self%offset = self%offset + way
      largest = 0.0_dp
      !$omp parallel do default(none) shared(self, way) private(j) &
      !$omp reduction(max: largest) num_threads(self%threads)
      do j = 1, self%ny
         self%rx(:, j) = self%rx(:, j) + way(1)
         self%ry(:, j) = self%ry(:, j) + way(2)
         call measure_row(self, j, largest)
      end do
      call finish_measure(self, largest)
   end subroutine hang_anew

   !> Release the points of a row that slip against their traction, and sum its residuals.
   subroutine measure_row(self, j, largest)
      class(friction_problem_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(inout) :: largest           !! |g|^2
      real(dp) :: state(self%nx)

      state = self%contact(:, j)
      if (self%law%slope) then
         call measured_row(self%nx, self%constants, self%p(:, j), self%hx(:, j), self%hy(:, j), &
            self%nz(:, j), self%tx(:, j), self%ty(:, j), self%old_x(:, j), self%old_y(:, j), &
            self%rx(:, j), self%ry(:, j), self%drive_x(:, j), self%drive_y(:, j), state, &
            self%vx(:, j), self%vy(:, j), self%weight(:, j), self%row_sums(:, j))
      else
         call measured_row(self%nx, self%constants, self%p(:, j), self%level_row, self%level_row, &
            self%nz(:, j), self%tx(:, j), self%ty(:, j), self%old_x(:, j), self%old_y(:, j), &
            self%rx(:, j), self%ry(:, j), self%drive_x(:, j), self%drive_y(:, j), state, &
            self%vx(:, j), self%vy(:, j), self%weight(:, j), self%row_sums(:, j))
      end if
      self%contact(:, j) = int(state, int8)
      largest = max(largest, self%row_sums(measures, j))
   end subroutine measure_row

   !> The residual from the sums of `measure_row`.
   subroutine finish_measure(self, largest)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: largest              !! |g|^2
      real(dp) :: scale, sums(measures - 1)

      sums = self%totals(measures - 1)
      self%released = nint(sums(1))
      self%slipping = nint(sums(2))
      self%weighted_residual = sums(5:6)
      self%weighted_tangent = reshape([sums(7), sums(8), sums(8), sums(9)], [2, 2])
      self%curved_tangent = reshape([sums(10), sums(11), sums(11), sums(12)], [2, 2])
      self%gain_left = sums(13)
      scale = max(sqrt(max(sums(3), sums(4))/max(self%cells, 1)), self%least_scale, norm2(self%offset))
      self%residual = sqrt(global_max(largest))
      if (scale > 0.0_dp) self%residual = self%residual/scale
      self%scale = merge(scale, 1.0_dp, scale > 0.0_dp)
   end subroutine finish_measure

   !> T' = T + step d, put back; the rows of T' are transformed if asked for.
   subroutine move(self, operator, step, dx, dy, transform, returned, again)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in) :: dx(:, :), dy(:, :)    !! [nx, ny] direction d, Pa
      logical, intent(in) :: transform
      integer, intent(out) :: returned              !! points that were put back
      logical, intent(in) :: again                  !! anew from the T before the last move
      real(dp) :: sums(moves)

      call move_rows(self, operator, step, [0.0_dp, 0.0_dp], dx, dy, again, transform, sums)
      returned = nint(sums(1))
   end subroutine move

   !> The same, and the points that stuck keep the total of T + step d, where their bounds leave it: a
   !> uniform traction c makes good for what those put back miss. A stiff mean mode would throw all
   !> the contact for less. (What points that slip miss by turning is of second order.) What is missed,
   !> m(c), is monotone: Newton's steps, and where one goes too far, the place on its way where
   !> m.s = 0 (regula falsi, Illinois).
   subroutine move_total(self, operator, step, dx, dy, returned, again)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in) :: dx(:, :), dy(:, :)    !! [nx, ny] direction d, Pa
      integer, intent(out) :: returned              !! points that were put back
      logical, intent(in) :: again                  !! anew from the T before the last move
      real(dp) :: sums(moves), c(2), s(2), missed(2), allowed
      real(dp) :: near, far, at_near, at_far, t, at_t
      integer :: trial, side

      call move_rows(self, operator, step, [0.0_dp, 0.0_dp], dx, dy, again, .false., sums)
      c = 0.0_dp
      allowed = negligible*self%residual*self%scale/maxval(self%mean_compliance)
      trial = 0
      do while (trial < corrections .and. norm2(sums(4:5)) > allowed)
         missed = sums(4:5)
         s = -matmul(pseudo_inverse(sums(6), sums(7), sums(8), few), missed)
         if (.not. norm2(s) > 0.0_dp) exit
         near = 0.0_dp
         at_near = dot_product(missed, s)
         far = 1.0_dp
         call move_rows(self, operator, step, c + s, dx, dy, .true., .false., sums)
         trial = trial + 1
         at_far = dot_product(sums(4:5), s)
         t = 1.0_dp
         side = 0
         do while (at_far > 0.0_dp .and. norm2(sums(4:5)) > allowed .and. trial < corrections)
            t = near + (far - near)*at_near/(at_near - at_far)
            call move_rows(self, operator, step, c + t*s, dx, dy, .true., .false., sums)
            trial = trial + 1
            at_t = dot_product(sums(4:5), s)
            if (at_t > 0.0_dp) then
               far = t
               at_far = at_t
               if (side == 1) at_near = 0.5_dp*at_near
               side = 1
            else
               near = t
               at_near = at_t
               if (side == -1) at_far = 0.5_dp*at_far
               side = -1
               if (abs(at_t) < 0.1_dp*norm2(sums(4:5))*norm2(s)) exit
            end if
         end do
         c = c + t*s
         if (norm2(sums(4:5)) > 0.9_dp*norm2(missed)) exit
      end do
      returned = nint(sums(1))
   end subroutine move_total

   !> Inverse of the symmetric matrix (xx, xy; xy, yy), semidefinite, on the axes that it does not
   !> leave out; 0 for 0.
   pure function pseudo_inverse(xx, xy, yy, left_out) result(inverse)
      real(dp), intent(in) :: xx, xy, yy
      real(dp), intent(in) :: left_out               !! of the larger eigenvalue
      real(dp) :: inverse(2, 2)
      real(dp) :: larger, smaller, axis(2)

      inverse = 0.0_dp
      larger = 0.5_dp*(xx + yy + hypot(xx - yy, 2.0_dp*xy))
      if (.not. larger > 0.0_dp) return
      smaller = (xx*yy - xy**2)/larger
      if (xx >= yy) then
         axis = [larger - yy, xy]
      else
         axis = [xy, larger - xx]
      end if
      if (smaller > left_out*larger) then
         inverse = reshape([yy, -xy, -xy, xx], [2, 2])/(xx*yy - xy**2)
      else if (norm2(axis) > 0.0_dp) then
         axis = axis/norm2(axis)
         inverse(:, 1) = axis(1)*axis/larger
         inverse(:, 2) = axis(2)*axis/larger
      end if
   end function pseudo_inverse

   !> The rows of both.
   subroutine move_rows(self, operator, step, c, dx, dy, again, transform, sums)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in) :: c(2)
      real(dp), intent(in) :: dx(:, :), dy(:, :)
      logical, intent(in) :: again, transform
      real(dp), intent(out) :: sums(moves)
      integer :: j

      !$omp parallel do default(none) shared(self, operator, step, c, dx, dy, again, transform) &
      !$omp private(j) num_threads(self%threads)
      do j = 1, self%ny
         call move_row(self, step, c, dx(:, j), dy(:, j), again, j)
         if (transform) call transform_row(self, operator, j)
      end do
      sums = self%totals(moves)
      self%change = sqrt(sums(2)/max(sums(3), tiny(1.0_dp)))
   end subroutine move_rows

   !> A row of T' = T + step d, put back.
   subroutine move_row(self, step, c, dx, dy, again, j)
      class(friction_problem_type), intent(inout) :: self
      real(dp), intent(in) :: step, c(2)
      real(dp), intent(in) :: dx(:), dy(:)
      logical, intent(in) :: again
      integer, intent(in) :: j
      real(dp) :: state(self%nx)

      state = self%contact(:, j)
      if (self%law%slope) then
         call moved_row(self%nx, self%constants, again, step, c, self%p(:, j), self%hx(:, j), &
            self%hy(:, j), self%force(:, j), self%nz(:, j), dx, dy, self%vx(:, j), self%vy(:, j), &
            self%weight(:, j), self%tx(:, j), self%ty(:, j), self%old_x(:, j), self%old_y(:, j), state, &
            self%row_sums(1:moves, j))
      else
         call moved_row(self%nx, self%constants, again, step, c, self%p(:, j), self%level_row, &
            self%level_row, self%force(:, j), self%nz(:, j), dx, dy, self%vx(:, j), self%vy(:, j), &
            self%weight(:, j), self%tx(:, j), self%ty(:, j), self%old_x(:, j), self%old_y(:, j), state, &
            self%row_sums(1:moves, j))
      end if
      self%contact(:, j) = int(state, int8)
   end subroutine move_row

   !> Transform a row of T, or of T + T_h.
   subroutine transform_row(self, operator, j)
      class(friction_problem_type), intent(in) :: self
      type(convolution_type), intent(inout) :: operator
      integer, intent(in) :: j

      if (associated(self%past_x)) then
         call operator%forward_row(1, j, self%tx(:, j) + self%past_x(:, j))
         call operator%forward_row(2, j, self%ty(:, j) + self%past_y(:, j))
      else
         call operator%forward_row(1, j, self%tx(:, j))
         call operator%forward_row(2, j, self%ty(:, j))
      end if
   end subroutine transform_row

   !> Transform the rows of T.
   subroutine transform_tractions(self, operator)
      class(friction_problem_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      integer :: j

      !$omp parallel do default(none) shared(self, operator) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call transform_row(self, operator, j)
      end do
   end subroutine transform_tractions

   !> Do residual and, where it counts, change of T meet a tolerance?
   pure function solved(self, tolerance) result(yes)
      class(friction_problem_type), intent(in) :: self
      real(dp), intent(in) :: tolerance
      logical :: yes

      yes = self%residual <= tolerance .and. (self%change <= tolerance .or. .not. self%settle)
   end function solved

   !> The first n sums over all rows, in order.
   function totals(self, n) result(sums)
      class(friction_problem_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp) :: sums(n)
      integer :: j

      sums = 0.0_dp
      do j = 1, self%ny
         sums = sums + self%row_sums(1:n, j)
      end do
      sums = global_sum(sums)
   end function totals

end module friction_problem
