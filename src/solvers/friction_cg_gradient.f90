!> The fallback for the tangential problem: spectral projected gradients.
!>
!>     T' = return(T + alpha r)       r: the slip along the slope
!>     alpha = s.s/s.y or s.y/y.y     s = T' - T, y = r - r' (Barzilai and Borwein, 1988), the shorter
!>                                    one where the two differ much
!>
!> One product of the operator an iteration, no preconditioner. The radial return is no Euclidean
!> projection where the slope counts, but its fixed points are the solution: T + alpha r returns to
!> T where r = 0, and where T is on the bound and r is along D.
module friction_cg_gradient
   use fft_conv, only : convolution_type
   use friction_law, only : contact_open, contact_stick
   use friction_problem, only : friction_problem_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: iterate_gradient

contains

   !> Iterate until converged, at the limit, or until the residual has fallen by the factor `fall`.
   subroutine iterate_gradient(problem, operator, tolerance, fall, limit, rx, ry, sx, sy, iterations)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: tolerance            !! of the residual and of the change of T
      real(dp), intent(in) :: fall                 !! 0: go on until converged
      integer, intent(in) :: limit                 !! of `iterations`
      real(dp), intent(inout) :: rx(:, :), ry(:, :), sx(:, :), sy(:, :)    !! work [nx, ny]
      integer, intent(inout) :: iterations
      real(dp) :: alpha, first, sums(3), shortest, longest
      integer :: returned

      first = problem%residual
      alpha = 1.0_dp/(problem%compliance*sqrt(real(max(problem%cells, 1), dp)))
      do while (iterations < limit)
         iterations = iterations + 1
         call form_step(problem, alpha, rx, ry, sx, sy)
         call problem%move(operator, 1.0_dp, sx, sy, .true., returned, .false.)
         call problem%update_slip(operator)
         if (problem%solved(tolerance)) return
         if (problem%residual <= fall*first) return
         call step_products(problem, rx, ry, sx, sy)
         sums = problem%totals(3)
         shortest = 0.0_dp
         longest = 0.0_dp
         if (sums(3) > 0.0_dp) shortest = sums(2)/sums(3)
         if (sums(2) > 0.0_dp) longest = sums(1)/sums(2)
         if (.not. shortest > 0.0_dp) then
            alpha = 1.0_dp/(problem%compliance*sqrt(real(max(problem%cells, 1), dp)))
         else if (shortest < 0.5_dp*longest) then
            alpha = shortest
         else
            alpha = longest
         end if
      end do
   end subroutine iterate_gradient

   !> s = return(T + alpha r) - T; r is kept.
   subroutine form_step(problem, alpha, rx, ry, sx, sy)
      type(friction_problem_type), intent(inout) :: problem
      real(dp), intent(in) :: alpha
      real(dp), intent(inout) :: rx(:, :), ry(:, :), sx(:, :), sy(:, :)
      real(dp) :: slope(2), r(2), t(2)
      logical :: returned
      integer :: i, j

      !$omp parallel do default(none) shared(problem, alpha, rx, ry, sx, sy) &
      !$omp private(i, j, slope, r, t, returned) num_threads(problem%threads)
      do j = 1, problem%ny
         do i = 1, problem%nx
            if (problem%contact(i, j) == contact_open) cycle
            slope = problem%slope_at(i, j)
            r = problem%law%slip_along_slope(slope, [problem%rx(i, j), problem%ry(i, j)])
            t = [problem%tx(i, j), problem%ty(i, j)] + alpha*r
            call problem%law%return_to_bound(problem%p(i, j), slope, t, returned)
            rx(i, j) = r(1)
            ry(i, j) = r(2)
            sx(i, j) = t(1) - problem%tx(i, j)
            sy(i, j) = t(2) - problem%ty(i, j)
            problem%contact(i, j) = contact_stick
         end do
      end do
   end subroutine form_step

   !> s.s, s.y and y.y of the step just done.
   subroutine step_products(problem, rx, ry, sx, sy)
      type(friction_problem_type), intent(inout) :: problem
      real(dp), intent(in) :: rx(:, :), ry(:, :), sx(:, :), sy(:, :)
      real(dp) :: slope(2), y(2)
      integer :: i, j

      !$omp parallel do default(none) shared(problem, rx, ry, sx, sy) private(i, j, slope, y) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%ny
         associate (sums => problem%row_sums(:, j))
            sums(:) = 0.0_dp
            do i = 1, problem%nx
               if (problem%contact(i, j) == contact_open) cycle
               slope = problem%slope_at(i, j)
               y = problem%law%slip_along_slope(slope, [problem%rx(i, j), problem%ry(i, j)])
               y = [rx(i, j), ry(i, j)] - y
               sums(1) = sums(1) + sx(i, j)**2 + sy(i, j)**2
               sums(2) = sums(2) + sx(i, j)*y(1) + sy(i, j)*y(2)
               sums(3) = sums(3) + y(1)**2 + y(2)**2
            end do
         end associate
      end do
   end subroutine step_products

end module friction_cg_gradient
