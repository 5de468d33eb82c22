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
!> beta = 0 where more than a tenth of the contact left the bound, and after a shortened step.
!>
!> A thick block makes the mean mode h/G of a periodic operator its largest by far, which every
!> masked field excites. It is taken out of g and z by the two fields e = w Z of uniform traction:
!> with E = sum of w Z, H = A + lam and A ~ h/N on the mean, H e = (h/N) E + lam w Z and
!> K = e.H e = (h/N) E E + sum of lam w^2 Z,
!>
!>     c = K^-1 sum(w g)
!>     Z (g - H e c) goes through the preconditioner to z0
!>     z = z0 + e (c - K^-1 (H e).z0)
!>
!> Points that are put back in great number change the total traction, and a stiff mean mode then
!> throws the slip to the other side. The points that stuck therefore keep their total of T + alpha d:
!> a uniform c is added to it before they are put back, found without a transform. Else the set of
!> slipping points can go back and forth for ever.
!>
!> Where a move has overshot still, g'.(T' - T) < -alpha g.d/2 (from a good start -2 alpha g.d), a
!> shorter one along the same path is taken, to where a secant sees g'.(T' - T) vanish. This needs no
!> energy, which does not exist where the slope counts.
!>
!> An iteration costs two operator products, of which the first needs no inverse transform where
!> points slip, and one preconditioner. beta is formed with z_old (M is symmetric), so that no old g
!> is kept: the work fields are z, d, T before the move, and the directions v.
!>
!> There is no proof that it converges: `friction_cg` falls back on spectral projected gradients.
module friction_cg_fast
   use fft_conv, only : columns_apply, columns_form, convolution_type
   use friction_problem, only : friction_problem_type, pseudo_inverse
   use friction_rows, only : turned_row, scaled_row, unscaled_row
   use asperity_precision, only : dp
   implicit none
   private

   public :: iterate_fast

   integer, parameter :: patience = 30      !! iterations in which the residual has to fall tenfold
   integer, parameter :: trials = 2         !! of a shorter step
   !> A move is shortened where it leaves less than -overshoot*alpha*g.d: in the first iterations of a
   !> step that goes on from another seldom, for that costs more than it gains.
   real(dp), parameter :: overshoot = 0.5_dp, overshoot_near = 2.0_dp
   integer, parameter :: near_steps = 15

contains

   !> Iterate until converged, stalled, or at the limit. On entry r belongs to T.
   subroutine iterate_fast(problem, operator, preconditioner, tolerance, limit, zx, zy, dx, dy, &
      iterations)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(convolution_type), intent(inout) :: preconditioner
      real(dp), intent(in) :: tolerance            !! of the residual and of the change of T
      integer, intent(in) :: limit                 !! of `iterations`
      real(dp), intent(inout) :: zx(:, :), zy(:, :), dx(:, :), dy(:, :)    !! work [nx, ny]
      integer, intent(inout) :: iterations
      real(dp) :: rho, rho_old, cross, beta, slope, curvature, form, alpha, milestone, gain, fraction
      real(dp) :: excess
      real(dp) :: shift(2)
      logical :: restart, slipping
      integer :: returned, first, trial

      restart = .true.
      rho_old = 0.0_dp
      milestone = problem%residual
      first = iterations
      excess = merge(overshoot_near, overshoot, problem%near)
      do while (iterations < limit)
         iterations = iterations + 1
         if (iterations > near_steps) excess = overshoot
         call precondition(problem, preconditioner, restart, zx, zy, shift, cross, rho)
         beta = 0.0_dp
         if (.not. restart) beta = max(0.0_dp, (rho - cross)/rho_old)
         call new_direction(problem, operator, beta, shift, zx, zy, dx, dy, slope, curvature)
         if (slope <= 0.0_dp .and. beta > 0.0_dp) then
            call new_direction(problem, operator, 0.0_dp, [0.0_dp, 0.0_dp], zx, zy, dx, dy, slope, &
               curvature)
         end if
         slipping = problem%slipping > 0
         call operator%columns(merge(columns_form, columns_apply, slipping), form)
         call problem%add_spring(dx, dy, form)
         if (.not. (slope > 0.0_dp .and. form + curvature > 0.0_dp)) return
         alpha = slope/(form + curvature)
         call take_step(problem, operator, alpha, dx, dy, slipping, .false., returned)
         restart = .false.
         gain = alpha*slope
         do trial = 1, trials
            if (problem%gain_left >= -excess*gain) exit
            fraction = max(0.1_dp, gain/(gain - problem%gain_left))
            alpha = fraction*alpha
            call take_step(problem, operator, alpha, dx, dy, .true., .true., returned)
            gain = fraction*gain
            restart = .true.
         end do
         if (problem%solved(tolerance)) return
         restart = restart .or. 10*problem%released > problem%cells
         rho_old = rho
         if (iterations - first == patience) then
            if (problem%residual > 0.1_dp*milestone) return
            milestone = problem%residual
            first = iterations
         end if
      end do
   end subroutine iterate_fast

   !> T' = T + step d, put back, and what it leaves.
   subroutine take_step(problem, operator, step, dx, dy, fresh, again, returned)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in) :: dx(:, :), dy(:, :)
      logical, intent(in) :: fresh                 !! not by recurrence, even if nothing is put back
      logical, intent(in) :: again                 !! instead of the last step
      integer, intent(out) :: returned

      if (any(problem%mean_compliance > 0.0_dp)) then
         call problem%move_total(operator, step, dx, dy, returned, again)
         if (fresh .or. returned > 0) call problem%transform_tractions(operator)
      else
         call problem%move(operator, step, dx, dy, fresh, returned, again)
         if (returned > 0 .and. .not. fresh) call problem%transform_tractions(operator)
      end if
      if (fresh .or. returned > 0) then
         call problem%update_slip(operator)
      else
         call problem%advance_slip(operator, step)
      end if
   end subroutine take_step

   !> z from the residual; g.z and, unless at a start, g.z_old.
   subroutine precondition(problem, preconditioner, restart, zx, zy, shift, cross, rho)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      logical, intent(in) :: restart
      real(dp), intent(inout) :: zx(:, :), zy(:, :)
      real(dp), intent(out) :: shift(2)            !! c: w Z c is still to be added to z
      real(dp), intent(out) :: cross               !! g.z_old; 0 at a start
      real(dp), intent(out) :: rho                 !! g.z
      real(dp) :: sums(5), c(2), mean(2), inverse(2, 2), coupling(2, 2), form
      integer :: j

      call mean_mode(problem, inverse, coupling)
      c = matmul(inverse, problem%weighted_residual)
      mean = matmul(coupling, c)
      !$omp parallel do default(none) shared(problem, preconditioner, mean, c, zx, zy) &
      !$omp private(j) num_threads(problem%threads)
      do j = 1, problem%ny
         call scale_row(problem, preconditioner, mean, c, j, zx(:, j), zy(:, j))
      end do
      sums(1:1) = problem%totals(1)
      cross = merge(0.0_dp, sums(1), restart)
      call preconditioner%columns(columns_apply, form)
      !$omp parallel do default(none) shared(problem, preconditioner, mean, c, zx, zy) &
      !$omp private(j) num_threads(problem%threads)
      do j = 1, problem%ny
         call unscale_row(problem, preconditioner, mean, c, j, zx(:, j), zy(:, j))
      end do
      sums = problem%totals(5)
      shift = c - matmul(inverse, matmul(transpose(coupling), sums(2:3)) + sums(4:5))
      rho = sums(1) + dot_product(problem%weighted_residual, shift)
   end subroutine precondition

   !> K^-1 and (h/N) E; 0 where the mean mode is left alone.
   subroutine mean_mode(problem, inverse, coupling)
      type(friction_problem_type), intent(in) :: problem
      real(dp), intent(out) :: inverse(2, 2)
      real(dp), intent(out) :: coupling(2, 2)
      real(dp) :: k(2, 2)

      inverse = 0.0_dp
      coupling = 0.0_dp
      if (.not. any(problem%mean_compliance > 0.0_dp)) return
      coupling(1, :) = problem%mean_compliance(1)*problem%weighted_tangent(1, :)
      coupling(2, :) = problem%mean_compliance(2)*problem%weighted_tangent(2, :)
      k = matmul(problem%weighted_tangent, coupling) + problem%curved_tangent
      inverse = pseudo_inverse(k(1, 1), 0.5_dp*(k(1, 2) + k(2, 1)), k(2, 2), 1.0e-12_dp)
   end subroutine mean_mode

   !> Transform a row of w Z (g - H e c).
   subroutine scale_row(problem, preconditioner, mean, c, j, zx, zy)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      real(dp), intent(in) :: mean(2), c(2)
      integer, intent(in) :: j
      real(dp), intent(in) :: zx(:), zy(:)         !! z_old
      real(dp) :: gx(problem%nx), gy(problem%nx)

      call scaled_row(problem%nx, problem%compliance, mean, c, problem%rx(:, j), problem%ry(:, j), &
         problem%vx(:, j), problem%vy(:, j), problem%weight(:, j), zx, zy, gx, gy, &
         problem%row_sums(1, j))
      call preconditioner%forward_row(1, j, gx)
      call preconditioner%forward_row(2, j, gy)
   end subroutine scale_row

   !> A row of z.
   subroutine unscale_row(problem, preconditioner, mean, c, j, zx, zy)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      real(dp), intent(in) :: mean(2), c(2)
      integer, intent(in) :: j
      real(dp), intent(inout) :: zx(:), zy(:)

      call preconditioner%backward_row(1, j, zx)
      call preconditioner%backward_row(2, j, zy)
      call unscaled_row(problem%nx, problem%compliance, mean, c, problem%rx(:, j), problem%ry(:, j), &
         problem%vx(:, j), problem%vy(:, j), problem%weight(:, j), zx, zy, problem%row_sums(1:5, j))
   end subroutine unscale_row

   !> d = z + beta Z d with its transform, its slope g.d and the part of its curvature by the
   !> bounds.
   subroutine new_direction(problem, operator, beta, shift, zx, zy, dx, dy, slope, curvature)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: shift(2)             !! c
      real(dp), intent(inout) :: zx(:, :), zy(:, :)
      real(dp), intent(inout) :: dx(:, :), dy(:, :)
      real(dp), intent(out) :: slope
      real(dp), intent(out) :: curvature
      real(dp) :: sums(2)
      integer :: j

      !$omp parallel do default(none) shared(problem, operator, beta, shift, zx, zy, dx, dy) &
      !$omp private(j) num_threads(problem%threads)
      do j = 1, problem%ny
         call turned_row(problem%nx, problem%compliance, beta, shift, problem%rx(:, j), &
            problem%ry(:, j), problem%vx(:, j), problem%vy(:, j), problem%weight(:, j), zx(:, j), &
            zy(:, j), dx(:, j), dy(:, j), problem%row_sums(1:2, j))
         call operator%forward_row(1, j, dx(:, j))
         call operator%forward_row(2, j, dy(:, j))
      end do
      sums = problem%totals(2)
      slope = sums(1)
      curvature = sums(2)
   end subroutine new_direction

end module friction_cg_fast
