!> The fast method for the tangential problem: conjugate gradients in the tangent space of the bounds.
!>
!> A traction on its bound may change only along the bound (the active set), and the bound adds to the matrix of the
!> step there. With v the direction of slip (module `friction_law`) and Z the projection that removes the component
!> along v at the slipping points:
!>
!>     g = Z r                               the residual of module `friction_problem`
!>     lam                                   the part of the matrix that the curvature of the bound adds to A; it is
!>                                           approximately r.v/|v|^2 at slipping points and 0 at sticking points
!>     z = about (A + lam)^-1 g              the change of T that would make g vanish (`friction_preconditioner`)
!>     d = z + beta Z d                      beta of Polak and Ribiere, if that is positive, otherwise 0
!>     alpha = g.d/(d.A d + sum lam |d|^2)
!>     T' = T + alpha d, returned to bounds  r from A T', or by recurrence if all points stick
!>
!> beta is also 0 in the first iteration and after the fallback, if more than a tenth of the contact was released from
!> its bound and now sticks, after a shortened step, and if the former d is not a direction of descent.
!>
!> In words: the preconditioner computes from g, the slip that should vanish, the change of traction z that would remove
!> it if each point kept its state. `form_direction` adds a part of the last direction. `take_step` moves along d by the
!> length that the quadratic model gives, and returns every point that is now outside its bound to it. This changes
!> states: a point that was returned counts as slipping, and a slipping point whose slip has turned against its traction
!> as sticking. The slip of the new traction is then computed with A, and module `friction_problem` forms g of it for the
!> next iteration. The loop ends when g is small at all points, because the guess of the states is then right.
!>
!> If many points are returned to their bounds, the total traction changes, and a mean mode with a large compliance
!> then reverses the slip. If the mean mode is soft, a uniform traction c is therefore added at the points that stick
!> before they are returned, such that their total remains that of T + alpha d; finding c needs no transform. Without
!> it the set of slipping points can alternate for ever.
!>
!> If a move has still overshot, that is, g'.(T' - T) < -alpha g.d/2 (-2 alpha g.d in the first iterations from a good
!> start), a shorter move along the same path is taken, to the point where a secant predicts that g'.(T' - T)
!> vanishes. This does not need an energy, which does not exist with the slope effect.
!>
!> An iteration costs one product of the operator and one of the preconditioner, because d.A d is only predicted if points
!> slip (module `friction_form`). Each shortened step costs one product more. beta is formed with z_old instead of the old
!> g, which is not kept: the preconditioner is symmetric, so that both agree as long as no point changes its state.
!>
!> In full contact of a periodic half-space, a uniform traction strains nothing and d.A d is round-off. Only the bounds then
!> limit the step: alpha is chosen so that few points leave them (`length_to_bounds`).
!>
!> There is no proof that this converges. If it stalls, or finds no direction of descent, some steps of spectral
!> projected gradients (module `friction_cg_gradient`) follow, and then the method continues.
module friction_cg_fast
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use fft_conv, only : columns_apply, convolution_type
   use friction_cg_gradient, only : friction_gradient_type
   use field_sums, only : row_total
   use friction_fields, only : fit_field
   use friction_directions, only : direction_row, direction_sums_type, total_of
   use friction_form, only : friction_form_type, new_friction_form
   use friction_law, only : contact_open
   use friction_method, only : friction_goal_type, friction_method_type
   use friction_moves, only : move, move_total
   use friction_preconditioner, only : friction_preconditioner_type, new_friction_preconditioner
   use friction_problem, only : friction_problem_type
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use, intrinsic :: iso_fortran_env, only : int64
   use kernels, only : kernel_type
   use regular_grid, only : grid_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: friction_fast_type, new_friction_fast

   integer, parameter :: patience = 30      !! iterations in which the residual must fall tenfold
   integer, parameter :: trials = 2         !! largest number of shorter steps that are tried
   !> A move is shortened if g'.(T' - T) is below -overshoot*alpha*g.d. The first iterations of a solve that starts
   !> near its solution may overshoot more, because shortening costs more there than it gains.
   real(dp), parameter :: overshoot = 0.5_dp, overshoot_near = 2.0_dp
   integer, parameter :: near_steps = 15    !! number of these first iterations
   !> d.A d over a_0 |d|^2 up to which a direction strains nothing.
   real(dp), parameter :: strainless = 1.0e-10_dp
   real(dp), parameter :: few = 0.05_dp     !! part of the points that may leave their bounds in a step along it
   integer, parameter :: halvings = 60      !! largest number of halvings of such a step
   integer, parameter :: gradient_steps = 100    !! largest number of iterations of the fallback at a time

   !> The method with its preconditioner and work fields.
   type, extends(friction_method_type) :: friction_fast_type
      type(friction_gradient_type), private :: fallback
      type(friction_preconditioner_type), private :: preconditioner
      type(friction_form_type), private :: form
      real(dp), allocatable, private :: d(:, :, :)             !! [width, 2, rows]
   contains
      procedure :: iterate
      procedure :: destroy
   end type friction_fast_type

   !> The state of an iteration.
   type :: iteration_type
      logical :: restart = .true.                !! d = z, without the direction before
      real(dp) :: old_gz = 0.0_dp                !! g.z in the iteration before
      real(dp) :: slope = 0.0_dp                 !! g.d
      real(dp) :: curvature = 0.0_dp             !! sum of lam |d|^2, the part of the bounds
      real(dp) :: square = 0.0_dp                !! |d|^2
      real(dp) :: form = 0.0_dp                  !! d.A d, predicted if points slip
      real(dp) :: milestone = 0.0_dp             !! residual some iterations ago
      integer :: since = 0                       !! the iteration of the milestone
      real(dp) :: excess = overshoot             !! overshoot that is allowed
   end type iteration_type

contains

   !> Make the method for the kernel of a solid.
   subroutine new_friction_fast(self, grid, kernel, compliance, error)
      type(friction_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel        !! tangential response of the solid
      real(dp), intent(in) :: compliance             !! of a cell under its own unit traction, m/Pa
      type(error_type), allocatable, intent(out) :: error

      call new_friction_preconditioner(self%preconditioner, grid, kernel, error)
      if (.not. allocated(error)) call new_friction_form(self%form, grid, kernel, compliance, error)
   end subroutine new_friction_fast

   !> Iterate (see `friction_method_type`). If the conjugate gradients stall, the fallback alternates with them.
   subroutine iterate(self, problem, operator, goal, iterations)
      class(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(friction_goal_type), intent(in) :: goal
      integer, intent(inout) :: iterations
      type(friction_goal_type) :: some_steps
      integer(int64) :: before, coarse_before          ! numbers of transforms

      self%stopped = .false.
      before = self%preconditioner%inverse%ffts
      coarse_before = self%form%coarse%ffts
      call fit_field(self%d, problem%width, 2, problem%rows)
      call self%preconditioner%set_mean_stiffness(operator)
      call self%form%set_mean_compliance(operator)
      do while (iterations < goal%most_iterations)
         call iterate_gradients(self, problem, operator, goal, iterations)
         if (self%stopped) exit
         if (problem%solved(goal%tolerance) .or. .not. ieee_is_finite(problem%residual)) exit
         some_steps = goal
         some_steps%fall = 0.1_dp
         some_steps%most_iterations = min(goal%most_iterations, iterations + gradient_steps)
         call self%fallback%iterate(problem, operator, some_steps, iterations)
         self%stopped = self%fallback%stopped
         if (self%stopped) exit
         if (problem%solved(goal%tolerance)) exit
      end do
      ! The rounding of this sum must not depend on earlier solves: a run that is continued has the same counts.
      self%ffts = self%ffts + self%form%transforms(since=coarse_before) &
         + nint(self%preconditioner%transform_size(operator)*(self%preconditioner%inverse%ffts - before), int64)
   end subroutine iterate

   !> Iterate by conjugate gradients until the problem is solved, the residual stalls, there is no direction of descent,
   !> or the limit of iterations is reached.
   subroutine iterate_gradients(self, problem, operator, goal, iterations)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(friction_goal_type), intent(in) :: goal
      integer, intent(inout) :: iterations
      type(iteration_type) :: now

      now%milestone = problem%residual
      now%since = iterations
      do while (iterations < goal%most_iterations)
         self%stopped = stop_is_due()
         if (self%stopped) return
         iterations = iterations + 1
         now%excess = merge(overshoot_near, overshoot, problem%near .and. iterations <= near_steps)

         call find_direction(self, problem, operator, now)
         if (.not. (now%slope > 0.0_dp .and. now%form + now%curvature > 0.0_dp)) return
         call take_step(self, problem, operator, now)       ! with the slip of the new T and its measures
         if (problem%solved(goal%tolerance)) return

         if (iterations - now%since == patience) then
            if (problem%residual > 0.1_dp*now%milestone) return
            now%milestone = problem%residual
            now%since = iterations
         end if
      end do
   end subroutine iterate_gradients

   !> Compute the direction d = z + beta Z d, or d = z if the former does not descend, and d.A d. If no point slips, this
   !> follows from the product A d, with which the slip then changes by recurrence. Otherwise a prediction is sufficient,
   !> because the slip is computed from a product with T'.
   subroutine find_direction(self, problem, operator, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(iteration_type), intent(inout) :: now
      real(dp) :: beta, gz

      call self%preconditioner%apply(problem)
      gz = self%preconditioner%gz
      beta = 0.0_dp
      if (.not. now%restart) beta = max(0.0_dp, (gz - self%preconditioner%cross)/now%old_gz)
      now%old_gz = gz
      call form_direction(self, problem, operator, beta, now)
      if (now%slope <= 0.0_dp .and. beta > 0.0_dp) then
         self%preconditioner%shift = 0.0_dp                                ! z contains the shift already
         call form_direction(self, problem, operator, 0.0_dp, now)
      end if
      if (problem%slipping > 0) then
         call self%form%predict(now%square, now%form)
      else
         call operator%columns(columns_apply, now%form)
      end if
      call problem%spring%add_form(self%d, now%form)
      if (problem%slipping == 0 .and. now%slope > 0.0_dp .and. now%form <= strainless*problem%compliance*now%square) &
         now%form = now%slope/length_to_bounds(problem, self%d, now%square)
   end subroutine find_direction

   !> The length of a step along a direction that strains nothing, such as a uniform traction in full contact of a periodic
   !> half-space: only the bounds limit it. The first length would bring d to the mean bound. It is halved until few points
   !> leave their bounds.
   function length_to_bounds(problem, d, square) result(length)
      type(friction_problem_type), intent(in) :: problem
      real(dp), contiguous, intent(in) :: d(:, :, :)     !! [width, 2, rows], Pa
      real(dp), intent(in) :: square                     !! |d|^2, Pa^2
      real(dp) :: length
      integer :: trial

      length = problem%bounds/sqrt(square*problem%cells)
      do trial = 1, halvings
         if (points_outside(problem, length, d) <= few*problem%cells) exit
         length = 0.5_dp*length
      end do
   end function length_to_bounds

   !> Count the points for which T + length d is outside its bound.
   function points_outside(problem, length, d) result(points)
      type(friction_problem_type), intent(in) :: problem
      real(dp), intent(in) :: length
      real(dp), contiguous, intent(in) :: d(:, :, :)     !! [width, 2, rows], Pa
      integer :: points
      integer :: counts(problem%rows), i, j
      real(dp) :: t(2), s

      counts = 0
      !$omp parallel do default(none) shared(problem, length, d, counts) private(i, j, t, s) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         do i = 1, problem%width
            if (problem%work%contact(i, j) == contact_open) cycle
            t = problem%work%traction(i, :, j) + length*d(i, :, j)
            call problem%place_on_bound(i, j, 0.0_dp, t, s)
            if (s < 1.0_dp) counts(j) = counts(j) + 1
         end do
      end do
      points = row_total(counts)
   end function points_outside

   !> Compute T' = T + alpha d, returned to the bounds, and its slip. If this has overshot, take a shorter step.
   subroutine take_step(self, problem, operator, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(iteration_type), intent(inout) :: now
      real(dp) :: alpha, predicted, part
      integer :: trial

      alpha = now%slope/(now%form + now%curvature)
      call move_to(self, problem, operator, alpha, from_product=problem%slipping > 0, again=.false.)
      now%restart = .false.
      predicted = alpha*now%slope
      do trial = 1, trials
         if (problem%sums%gain >= -now%excess*predicted) exit
         part = max(0.1_dp, predicted/(predicted - problem%sums%gain))
         alpha = part*alpha
         call move_to(self, problem, operator, alpha, from_product=.true., again=.true.)
         predicted = part*predicted
         now%restart = .true.
      end do
      now%restart = now%restart .or. 10*problem%released > problem%cells
   end subroutine take_step

   !> Compute T' = T + alpha d, return points to their bounds, and compute the slip of T': by recurrence from A d if no
   !> point slips and none was returned, otherwise from a product with T'. `move` can transform the rows of T' for
   !> this product in the same pass; `move_total` cannot, because it may move several times.
   subroutine move_to(self, problem, operator, alpha, from_product, again)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: alpha
      logical, intent(in) :: from_product            !! compute the slip from a product in any case
      logical, intent(in) :: again                 !! start again from the T before the last move
      logical :: returned, transformed

      transformed = .false.
      if (any(problem%mean_compliance > 0.0_dp)) then
         call move_total(problem, operator, alpha, self%d, again, returned)
      else
         transformed = from_product
         call move(problem, operator, alpha, self%d, again, transformed, returned)
      end if
      if (.not. (from_product .or. returned)) then
         call problem%advance_slip(operator, alpha)
      else if (transformed) then
         call problem%update_slip(operator)
      else
         call problem%refresh_slip(operator)
      end if
   end subroutine move_to

   !> Compute d = z + beta Z d, the slope g.d, |d|^2, and the curvature of the bounds along d. d is taken for the
   !> prediction of d.A d, or transformed if no point slips.
   subroutine form_direction(self, problem, operator, beta, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      type(iteration_type), intent(inout) :: now
      type(direction_sums_type), allocatable :: rows(:)
      type(direction_sums_type) :: sums
      real(dp) :: whole(problem%nx)
      integer :: c, j

      allocate (rows(problem%rows))
      !$omp parallel do default(none) shared(self, problem, operator, beta, rows) private(c, j, whole) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         call direction_row(problem%compliance, beta, self%preconditioner%shift, problem%work%slip(:, :, j), &
            problem%work%tangent(:, :, j), self%preconditioner%z(:, :, j), self%d(:, :, j), rows(j))
         if (problem%slipping == 0) then
            call problem%spread_to_transform(operator, self%d(:, :, j), j)
         else
            do c = 1, 2
               call problem%work%runs%spread(j, self%d(:, c, j), whole)
               call self%form%take_row(c, j, whole)
            end do
         end if
      end do
      sums = total_of(rows)
      now%slope = sums%slope
      now%square = sums%square
      now%curvature = sums%curvature
   end subroutine form_direction

   !> Free the plans of the preconditioner.
   subroutine destroy(self)
      class(friction_fast_type), intent(inout) :: self

      call self%preconditioner%destroy()
      call self%form%destroy()
   end subroutine destroy

end module friction_cg_fast
