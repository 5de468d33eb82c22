!> The fast method for the tangential problem: conjugate gradients in the tangent space of the bounds.
!>
!> Points on the bound move along it only (the active set), and their Hessian gains the curvature of the
!> bound. With Z the projection that takes the part along D from the slipping points:
!>
!>     g = Z r                               the residual of module `friction_problem`
!>     lam = r.D/|D|^2                       curvature of the bound, 0 where it sticks
!>     w = a_0/(a_0 + lam)                   a_0: displacement of a cell under its own unit traction
!>     z = Z [w M (w g) + (1-w)/(a_0+lam) g] M: inverse of the periodic 2 x 2 symbol
!>     d = z + beta Z d                      beta Polak-Ribiere+, 0 where a point left the bound
!>     alpha = g.d/(d.A d + sum lam |d|^2)
!>     T' = put back(T + alpha d)            r from A T' where points were put back, else by recurrence
!>
!> An iteration costs two operator products, of which the first needs no inverse transform where points
!> slip, and one preconditioner. beta is formed with z_old (M is symmetric), so that no old g is kept:
!> four work fields z and d beside T, r and DX.
!>
!> There is no proof that it converges: `friction_cg` falls back on spectral projected gradients.
module friction_cg_fast
   use fft_conv, only : columns_apply, columns_form, convolution_type
   use friction_law, only : contact_open, contact_slip
   use friction_problem, only : friction_problem_type
   use precision, only : dp
   implicit none
   private

   public :: iterate_fast

   integer, parameter :: patience = 30      !! iterations in which the residual has to fall tenfold

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
      real(dp) :: rho, rho_old, cross, beta, slope, curvature, form, alpha, milestone
      logical :: restart, slipping
      integer :: returned, first

      restart = .true.
      rho_old = 0.0_dp
      milestone = problem%residual
      first = iterations
      do while (iterations < limit)
         iterations = iterations + 1
         call precondition(problem, preconditioner, restart, zx, zy, cross, rho)
         beta = 0.0_dp
         if (.not. restart) beta = max(0.0_dp, (rho - cross)/rho_old)
         call new_direction(problem, operator, beta, zx, zy, dx, dy, slope, curvature)
         if (slope <= 0.0_dp .and. beta > 0.0_dp) then
            call new_direction(problem, operator, 0.0_dp, zx, zy, dx, dy, slope, curvature)
         end if
         slipping = problem%slipping > 0
         call operator%columns(merge(columns_form, columns_apply, slipping), form)
         if (.not. (slope > 0.0_dp .and. form + curvature > 0.0_dp)) return
         alpha = slope/(form + curvature)
         call problem%move(operator, alpha, dx, dy, slipping, returned)
         if (slipping) then
            call problem%update_slip(operator)
         else if (returned > 0) then
            call problem%forward_tractions(operator)
            call problem%update_slip(operator)
         else
            call problem%advance_slip(operator, alpha)
         end if
         if (problem%residual <= tolerance .and. problem%change <= tolerance) return
         restart = problem%released > 0
         rho_old = rho
         if (iterations - first == patience) then
            if (problem%residual > 0.1_dp*milestone) return
            milestone = problem%residual
            first = iterations
         end if
      end do
   end subroutine iterate_fast

   !> z from the residual; g.z and, unless at a start, g.z_old.
   subroutine precondition(problem, preconditioner, restart, zx, zy, cross, rho)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      logical, intent(in) :: restart
      real(dp), intent(inout) :: zx(:, :), zy(:, :)
      real(dp), intent(out) :: cross               !! g.z_old; 0 at a start
      real(dp), intent(out) :: rho                 !! g.z
      real(dp) :: sums(1)
      integer :: j

      !$omp parallel do default(none) shared(problem, preconditioner, restart, zx, zy) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%ny
         call scale_row(problem, preconditioner, restart, j, zx(:, j), zy(:, j))
      end do
      sums = problem%totals(1)
      cross = sums(1)
      call preconditioner%columns(columns_apply, sums(1))
      !$omp parallel do default(none) shared(problem, preconditioner, zx, zy) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%ny
         call unscale_row(problem, preconditioner, j, zx(:, j), zy(:, j))
      end do
      sums = problem%totals(1)
      rho = sums(1)
   end subroutine precondition

   !> Transform a row of w g.
   subroutine scale_row(problem, preconditioner, restart, j, zx, zy)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      logical, intent(in) :: restart
      integer, intent(in) :: j
      real(dp), intent(in) :: zx(:), zy(:)         !! z_old
      real(dp) :: normal(2), g(2), curvature, w, gx(problem%nx), gy(problem%nx)
      logical :: reversed
      integer :: i

      problem%row_sums(1, j) = 0.0_dp
      do i = 1, problem%nx
         if (problem%contact(i, j) == contact_open) then
            gx(i) = 0.0_dp
            gy(i) = 0.0_dp
         else
            call problem%point_residual(i, j, normal, g, curvature, reversed)
            if (.not. restart) then
               problem%row_sums(1, j) = problem%row_sums(1, j) + g(1)*zx(i) + g(2)*zy(i)
            end if
            w = problem%compliance/(problem%compliance + curvature)
            gx(i) = w*g(1)
            gy(i) = w*g(2)
         end if
      end do
      call preconditioner%forward_row(1, j, gx)
      call preconditioner%forward_row(2, j, gy)
   end subroutine scale_row

   !> A row of z.
   subroutine unscale_row(problem, preconditioner, j, zx, zy)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: preconditioner
      integer, intent(in) :: j
      real(dp), intent(inout) :: zx(:), zy(:)
      real(dp) :: normal(2), g(2), z(2), curvature, w
      logical :: reversed
      integer :: i

      call preconditioner%backward_row(1, j, zx)
      call preconditioner%backward_row(2, j, zy)
      problem%row_sums(1, j) = 0.0_dp
      do i = 1, problem%nx
         z = 0.0_dp
         if (problem%contact(i, j) /= contact_open) then
            call problem%point_residual(i, j, normal, g, curvature, reversed)
            w = problem%compliance/(problem%compliance + curvature)
            z = w*([zx(i), zy(i)] + (1.0_dp - w)/problem%compliance*g)
            if (problem%contact(i, j) == contact_slip) z = along_bound(normal, z)
            problem%row_sums(1, j) = problem%row_sums(1, j) + g(1)*z(1) + g(2)*z(2)
         end if
         zx(i) = z(1)
         zy(i) = z(2)
      end do
   end subroutine unscale_row

   !> d = z + beta Z d with its transform, its slope g.d and the part of its curvature by the bounds.
   subroutine new_direction(problem, operator, beta, zx, zy, dx, dy, slope, curvature)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: zx(:, :), zy(:, :)
      real(dp), intent(inout) :: dx(:, :), dy(:, :)
      real(dp), intent(out) :: slope
      real(dp), intent(out) :: curvature
      real(dp) :: sums(2)
      integer :: j

      !$omp parallel do default(none) shared(problem, operator, beta, zx, zy, dx, dy) private(j) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%ny
         call direction_row(problem, beta, j, zx(:, j), zy(:, j), dx(:, j), dy(:, j))
         call operator%forward_row(1, j, dx(:, j))
         call operator%forward_row(2, j, dy(:, j))
      end do
      sums = problem%totals(2)
      slope = sums(1)
      curvature = sums(2)
   end subroutine new_direction

   !> A row of d.
   subroutine direction_row(problem, beta, j, zx, zy, dx, dy)
      type(friction_problem_type), intent(inout) :: problem
      real(dp), intent(in) :: beta
      integer, intent(in) :: j
      real(dp), intent(in) :: zx(:), zy(:)
      real(dp), intent(inout) :: dx(:), dy(:)
      real(dp) :: normal(2), g(2), v(2), curvature
      logical :: reversed
      integer :: i

      problem%row_sums(1:2, j) = 0.0_dp
      do i = 1, problem%nx
         v = 0.0_dp
         if (problem%contact(i, j) /= contact_open) then
            call problem%point_residual(i, j, normal, g, curvature, reversed)
            if (beta > 0.0_dp) then
               v = beta*[dx(i), dy(i)]
               if (problem%contact(i, j) == contact_slip) v = along_bound(normal, v)
            end if
            v = v + [zx(i), zy(i)]
            problem%row_sums(1, j) = problem%row_sums(1, j) + g(1)*v(1) + g(2)*v(2)
            problem%row_sums(2, j) = problem%row_sums(2, j) + curvature*(v(1)**2 + v(2)**2)
         end if
         dx(i) = v(1)
         dy(i) = v(2)
      end do
   end subroutine direction_row

   !> Z: v less its part across the bound.
   pure function along_bound(normal, v) result(projected)
      real(dp), intent(in) :: normal(2)      !! direction of slip
      real(dp), intent(in) :: v(2)
      real(dp) :: projected(2)
      real(dp) :: nn

      nn = normal(1)**2 + normal(2)**2
      projected = 0.0_dp
      if (nn > 0.0_dp) projected = v - (normal(1)*v(1) + normal(2)*v(2))/nn*normal
   end function along_bound

end module friction_cg_fast
