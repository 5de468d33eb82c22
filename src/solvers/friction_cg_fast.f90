!> The fast method for the tangential problem: conjugate gradients in the tangent space of the
!> bounds.
!>
!> Points on the bound move along it only (the active set), and their Hessian gains the curvature of
!> the bound. With v the direction of slip (module `friction_law`) and Z the projection that takes the
!> part along v from the slipping points:
!>
!>     g = Z r                               the residual of module `friction_problem`
!>     lam = curvature of the bound          about r.v/|v|^2, 0 where it sticks
!>     w = a_0/(a_0 + lam)                   a_0: displacement of a cell under its own unit traction
!>     z = Z [w M (w g) + (1-w)/(a_0+lam) g] M: inverse of the periodic 2 x 2 symbol
!>     d = z + beta Z d                      beta Polak-Ribiere+
!>     alpha = g.d/(d.A d + sum lam |d|^2)
!>     T' = put back(T + alpha d)            r from A T', or by recurrence where all points stick
!>
!> beta = 0 in the first iteration, also after the fallback; where more than a tenth of the contact was
!> released from its bound to stick; after a shortened step; and where d would not point downhill.
!>
!> The same in words. `precondition` turns the slip that should vanish, g, into the change of traction z
!> that would remove it if each point kept its state (M is about the inverse of A). `turn` adds a part
!> of the last direction. `take_step` goes along d as far as the quadratic model says, and puts every
!> point that now lies outside its bound back on it. This changes states: a point that was put back
!> slips from now on, and a slipping point whose slip has turned against its traction sticks. The slip
!> of the new traction is then computed with A, and the measure of it gives the g of the next iteration.
!> The loop ends when g is small at all points; where g vanishes, the guess of the states holds.
!>
!> A thick block makes the mean mode h of a periodic operator (for G = 1) its largest by far. Every
!> field that is zero outside the contact excites it. It is taken out of g and z by the two fields e = w
!> Z of uniform traction: with E = sum of w Z, H = A + lam and A ~ h/N on the mean, H e = (h/N) E + lam
!> w Z and K = e.H e = (h/N) E E + sum of lam w^2 Z,
!>
!>     c = K^-1 sum(w g)
!>     Z (g - H e c) goes through the preconditioner to z0
!>     z = z0 + e (c - K^-1 (H e).z0)
!>
!> Points that are put back in great number change the total traction, and a stiff mean mode then
!> throws the slip to the other side. The points that stuck therefore keep their total of T + alpha d:
!> a uniform c is added to it before they are put back, found without a transform. Without this c, the set
!> of slipping points can go back and forth for ever.
!>
!> Where a move has overshot still, g'.(T' - T) < -alpha g.d/2 (from a good start -2 alpha g.d), a
!> shorter one along the same path is taken, to where a secant sees g'.(T' - T) vanish. This needs no
!> energy, which does not exist where the slope counts.
!>
!> An iteration costs two operator products, of which the first needs no inverse transform where
!> points slip, and one preconditioner; each shortened step costs one product more. beta is formed with
!> z_old instead of the old g, which is not kept: M is symmetric, so that both agree as long as w and Z do
!> not change. The work fields are z and d.
!>
!> There is no proof that this converges. Where it stalls, or finds no step downhill, some steps of
!> spectral projected gradients (module `friction_cg_gradient`) follow, and then it goes on.
module friction_cg_fast
   use asperity_errors, only : error_type
   use kernels, only : kernel_type
   use asperity_precision, only : dp, pi
   use fft_conv, only : columns_apply, columns_form, convolution_type, new_inverse_convolution
   use friction_cg_gradient, only : friction_gradient_type
   use friction_directions, only : divided_row, scaled_row, total_of, turn_sums_type, turned_row, uniform_type, &
      unscaled_row, z_sums_type
   use friction_method, only : friction_goal_type, friction_method_type
   use friction_moves, only : move, move_total, pseudo_inverse
   use friction_problem, only : friction_problem_type
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: friction_fast_type, new_friction_fast

   integer, parameter :: patience = 30      !! iterations in which the residual has to fall tenfold
   integer, parameter :: trials = 2         !! of a shorter step
   !> A move is shortened where g'.(T' - T) is below -overshoot*alpha*g.d. The first iterations of a step
   !> that continues another one may overshoot more, because shortening costs more there than it gains.
   real(dp), parameter :: overshoot = 0.5_dp, overshoot_near = 2.0_dp
   integer, parameter :: near_steps = 15
   integer, parameter :: gradient_steps = 100    !! of the fallback at a time
   !> Where all points slip and their mean w is below it, M is left out: it costs transforms and changes little.
   real(dp), parameter :: light = 0.1_dp

   !> The method with its preconditioner and work fields.
   type, extends(friction_method_type) :: friction_fast_type
      type(friction_gradient_type), private :: fallback
      type(convolution_type), private :: preconditioner        !! M
      real(dp), private :: half_wave = 0.0_dp                  !! mean compliance where there is none, m
      logical, private :: periodic = .true.
      real(dp), allocatable, private :: z(:, :, :)             !! [nx, 2, rows]
      real(dp), allocatable, private :: d(:, :, :)             !! [nx, 2, rows]
   contains
      procedure :: iterate
      procedure :: destroy
   end type friction_fast_type

   !> Where an iteration stands.
   type :: iteration_type
      logical :: restart = .true.                !! d = z, without the direction before
      real(dp) :: gz = 0.0_dp                    !! g.z
      real(dp) :: old_gz = 0.0_dp                !! g.z in the iteration before
      real(dp) :: cross = 0.0_dp                 !! g.z_old
      real(dp) :: shift(2) = 0.0_dp              !! c: w Z c is still to be added to z
      real(dp) :: slope = 0.0_dp                 !! g.d
      real(dp) :: curvature = 0.0_dp             !! sum of lam |d|^2, the part of the bounds
      real(dp) :: form = 0.0_dp                  !! d.A d
      real(dp) :: milestone = 0.0_dp             !! residual some iterations ago
      integer :: since = 0                       !! the iteration of the milestone
      real(dp) :: excess = overshoot             !! overshoot that is allowed
   end type iteration_type

contains

   !> Make the method for a half-space.
   subroutine new_friction_fast(self, grid, kernel, error)
      type(friction_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel        !! what the solid is, tangential
      type(error_type), allocatable, intent(out) :: error
      type(grid_type) :: periodic
      type(kernel_type) :: block

      self%periodic = grid%boundary == boundary_periodic
      self%half_wave = max(grid%lx, grid%ly)/pi
      periodic = grid
      periodic%boundary = boundary_periodic
      block = kernel
      block%mean_mode = self%half_wave
      call new_inverse_convolution(self%preconditioner, periodic, block, error)
      if (allocated(error)) return
      allocate (self%z(grid%nx, 2, grid%rows()), self%d(grid%nx, 2, grid%rows()), source=0.0_dp)
   end subroutine new_friction_fast

   !> Iterate, as `friction_method_type` says; where the conjugate gradients stall, with the fallback in
   !> turns.
   subroutine iterate(self, problem, operator, goal, iterations)
      class(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(friction_goal_type), intent(in) :: goal
      integer, intent(inout) :: iterations
      type(friction_goal_type) :: some_steps

      call set_mean_stiffness(self, operator)
      do while (iterations < goal%most_iterations)
         call iterate_gradients(self, problem, operator, goal, iterations)
         if (problem%solved(goal%tolerance) .or. .not. ieee_is_finite(problem%residual)) exit
         some_steps = goal
         some_steps%fall = 0.1_dp
         some_steps%most_iterations = min(goal%most_iterations, iterations + gradient_steps)
         call self%fallback%iterate(problem, operator, some_steps, iterations)
         if (problem%solved(goal%tolerance)) exit
      end do
      self%ffts = self%preconditioner%ffts
   end subroutine iterate

   !> Let the preconditioner's mean mode be the inverse of the operator's.
   subroutine set_mean_stiffness(self, operator)
      type(friction_fast_type), intent(inout) :: self
      type(convolution_type), intent(in) :: operator
      real(dp) :: mean

      if (.not. self%periodic) return
      mean = operator%mean_mode(1)*operator%grid%cells()
      if (mean <= 0.0_dp) mean = self%half_wave
      call self%preconditioner%set_mean_compliance(1.0_dp/mean)
   end subroutine set_mean_stiffness

   !> The conjugate gradients, until solved, stalled, or at the limit.
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

   !> The direction d = z + beta Z d, or d = z where that one does not descend, and its product: the
   !> whole product where no point slips, which lets the slip follow by recurrence, else d.A d only.
   subroutine find_direction(self, problem, operator, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(iteration_type), intent(inout) :: now
      real(dp) :: beta

      call precondition(self, problem, now)
      beta = 0.0_dp
      if (.not. now%restart) beta = max(0.0_dp, (now%gz - now%cross)/now%old_gz)
      now%old_gz = now%gz
      call turn(self, problem, operator, beta, now)
      if (now%slope <= 0.0_dp .and. beta > 0.0_dp) then
         now%shift = 0.0_dp                                ! z holds it already
         call turn(self, problem, operator, 0.0_dp, now)
      end if
      call operator%columns(merge(columns_form, columns_apply, problem%slipping > 0), now%form)
      call problem%add_spring(self%d, now%form)
   end subroutine find_direction

   !> T' = T + alpha d, put back, and the slip that it leaves. Where that has overshot, a shorter step.
   subroutine take_step(self, problem, operator, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(iteration_type), intent(inout) :: now
      real(dp) :: alpha, gain, part
      integer :: trial

      alpha = now%slope/(now%form + now%curvature)
      call move_to(self, problem, operator, alpha, by_product=problem%slipping > 0, again=.false.)
      now%restart = .false.
      gain = alpha*now%slope
      do trial = 1, trials
         if (problem%sums%gain >= -now%excess*gain) exit
         part = max(0.1_dp, gain/(gain - problem%sums%gain))
         alpha = part*alpha
         call move_to(self, problem, operator, alpha, by_product=.true., again=.true.)
         gain = part*gain
         now%restart = .true.
      end do
      now%restart = now%restart .or. 10*problem%released > problem%cells
   end subroutine take_step

   !> T' = T + alpha d, put back; the slip of T' from a product with T', or by recurrence from A d where
   !> nothing was put back.
   subroutine move_to(self, problem, operator, alpha, by_product, again)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: alpha
      logical, intent(in) :: by_product            !! even if nothing is put back
      logical, intent(in) :: again                 !! instead of the last step
      logical :: returned, transformed

      transformed = .false.
      if (any(problem%mean_compliance > 0.0_dp)) then
         call move_total(problem, operator, alpha, self%d, again, returned)
      else
         transformed = by_product
         call move(problem, operator, alpha, self%d, again, transformed, returned)
      end if
      if (.not. (by_product .or. returned)) then
         call problem%advance_slip(operator, alpha)
      else if (transformed) then
         call problem%update_slip(operator)
      else
         call problem%refresh_slip(operator)
      end if
   end subroutine move_to

   !> z from the residual; g.z and, unless at a start, g.z_old.
   subroutine precondition(self, problem, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(iteration_type), intent(inout) :: now
      type(uniform_type) :: uniform
      type(z_sums_type), allocatable :: rows(:)
      type(z_sums_type) :: sums
      real(dp) :: inverse(2, 2), coupling(2, 2)

      allocate (rows(problem%rows))
      call mean_mode(problem, inverse, coupling)
      uniform%traction = matmul(inverse, problem%sums%residual)
      uniform%displacement = matmul(coupling, uniform%traction)
      if (bounds_outweigh(problem)) then
         call divide_rows(self, problem, uniform, rows)
      else
         call precondition_rows(self, problem, uniform, rows)
      end if
      sums = total_of(rows)
      now%cross = 0.0_dp
      if (.not. now%restart) now%cross = sums%cross
      now%shift = uniform%traction &
         - matmul(inverse, matmul(transpose(coupling), sums%total) + sums%bent)
      now%gz = sums%gz + dot_product(problem%sums%residual, now%shift)
   end subroutine precondition

   !> Do all points slip, with bounds so curved that A hardly counts beside them? Then M is of no use.
   pure function bounds_outweigh(problem) result(yes)
      type(friction_problem_type), intent(in) :: problem
      logical :: yes
      real(dp) :: weights                          !! sum of w

      weights = problem%sums%tangent(1) + problem%sums%tangent(3)
      yes = problem%slipping == problem%cells .and. weights < light*problem%cells
   end function bounds_outweigh

   !> The rows of z without M.
   subroutine divide_rows(self, problem, uniform, rows)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(uniform_type), intent(in) :: uniform
      type(z_sums_type), intent(out) :: rows(:)
      integer :: j

      !$omp parallel do default(none) shared(self, problem, uniform, rows) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         call divided_row(problem%compliance, uniform, problem%slip(:, :, j), &
            problem%work%tangent(:, :, j), self%z(:, :, j), rows(j))
      end do
   end subroutine divide_rows

   !> The rows of z with M.
   subroutine precondition_rows(self, problem, uniform, rows)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(uniform_type), intent(in) :: uniform
      type(z_sums_type), intent(inout) :: rows(:)
      integer :: j

      !$omp parallel do default(none) shared(self, problem, uniform, rows) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         call scale_row(self, problem, uniform, j, rows(j)%cross)
      end do
      call self%preconditioner%columns(columns_apply)
      !$omp parallel do default(none) shared(self, problem, uniform, rows) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         call unscale_row(self, problem, uniform, j, rows(j))
      end do
   end subroutine precondition_rows

   !> K^-1 and (h/N) E; 0 where the mean mode is left alone.
   subroutine mean_mode(problem, inverse, coupling)
      type(friction_problem_type), intent(in) :: problem
      real(dp), intent(out) :: inverse(2, 2)
      real(dp), intent(out) :: coupling(2, 2)
      real(dp) :: tangent(2, 2), k(2, 2)

      inverse = 0.0_dp
      coupling = 0.0_dp
      if (.not. any(problem%mean_compliance > 0.0_dp)) return
      tangent = matrix(problem%sums%tangent)
      coupling(1, :) = problem%mean_compliance(1)*tangent(1, :)
      coupling(2, :) = problem%mean_compliance(2)*tangent(2, :)
      k = matmul(tangent, coupling) + matrix(problem%sums%curved)
      inverse = pseudo_inverse([k(1, 1), 0.5_dp*(k(1, 2) + k(2, 1)), k(2, 2)], 1.0e-12_dp)
   end subroutine mean_mode

   !> The symmetric matrix of xx, xy, yy.
   pure function matrix(elements)
      real(dp), intent(in) :: elements(3)
      real(dp) :: matrix(2, 2)

      matrix = reshape([elements(1), elements(2), elements(2), elements(3)], [2, 2])
   end function matrix

   !> Transform a row of w Z (g - H e c).
   subroutine scale_row(self, problem, uniform, j, cross)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(uniform_type), intent(in) :: uniform
      integer, intent(in) :: j
      real(dp), intent(out) :: cross               !! g.z_old
      real(dp) :: g(problem%nx, 2)

      call scaled_row(problem%compliance, uniform, problem%slip(:, :, j), &
         problem%work%tangent(:, :, j), self%z(:, :, j), g, cross)
      call self%preconditioner%forward_row(1, j, g(:, 1))
      call self%preconditioner%forward_row(2, j, g(:, 2))
   end subroutine scale_row

   !> A row of z.
   subroutine unscale_row(self, problem, uniform, j, sums)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(uniform_type), intent(in) :: uniform
      integer, intent(in) :: j
      type(z_sums_type), intent(inout) :: sums     !! comes with g.z_old

      call self%preconditioner%backward_row(1, j, self%z(:, 1, j))
      call self%preconditioner%backward_row(2, j, self%z(:, 2, j))
      call unscaled_row(problem%compliance, uniform, problem%slip(:, :, j), &
         problem%work%tangent(:, :, j), self%z(:, :, j), sums)
   end subroutine unscale_row

   !> d = z + beta Z d with its transform, its slope g.d and the part of its curvature by the bounds.
   subroutine turn(self, problem, operator, beta, now)
      type(friction_fast_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      type(iteration_type), intent(inout) :: now
      type(turn_sums_type), allocatable :: rows(:)
      type(turn_sums_type) :: sums
      integer :: j

      allocate (rows(problem%rows))
      !$omp parallel do default(none) shared(self, problem, operator, beta, now, rows) &
      !$omp private(j) num_threads(problem%threads)
      do j = 1, problem%rows
         call turned_row(problem%compliance, beta, now%shift, problem%slip(:, :, j), &
            problem%work%tangent(:, :, j), self%z(:, :, j), self%d(:, :, j), rows(j))
         call operator%forward_row(1, j, self%d(:, 1, j))
         call operator%forward_row(2, j, self%d(:, 2, j))
      end do
      sums = total_of(rows)
      now%slope = sums%slope
      now%curvature = sums%curvature
   end subroutine turn

   !> Free the preconditioner and the work fields.
   subroutine destroy(self)
      class(friction_fast_type), intent(inout) :: self

      call self%preconditioner%destroy()
      call self%fallback%destroy()
      if (allocated(self%z)) deallocate (self%z, self%d)
   end subroutine destroy

end module friction_cg_fast
