!> The thesis's method for the tangential problem: conjugate gradients of Hager and Zhang with the
!> terms K of the moving bound and the residual perpendicular to the traction (thesis, section 3.2).
!>
!>     t = d + K_1                                             (K_1, K_2: derivatives of the return)
!>     alpha = t.g/(t.A t - K_2.r)                             (eq. 3.12)
!>     T' = put back(T + alpha d) ; r = DX - A T'              (eq. 3.10, 3.11)
!>     release the points that slip against their traction
!>     g = r, less its part along D where it slips             (eq. 3.16)
!>     y = g' - g ; beta = -y.g'/t.y + theta t.g' y.y/(t.y)^2   (eq. 3.14)
!>     d = g' + beta d
!>
!> Repaired against the printed text: the denominator of eq. 3.16 is |D|^2; the K_2 term takes the
!> whole residual r, which holds the curvature of the bound; slip points go back on the bound from
!> both sides; K_1 and K_2 are in closed form (module `friction_law`). Restarts with d = g where t.g
!> <= 0. Two products of the operator an iteration, the first without its inverse transform.
module friction_cg_thesis
   use fft_conv, only : columns_form, convolution_type
   use friction_law, only : contact_open, contact_slip
   use friction_problem, only : friction_problem_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: iterate_thesis

   real(dp), parameter :: theta = 1.0_dp     !! the free parameter of eq. 3.14

contains

   !> Iterate until converged, broken down, or at the limit. On entry r belongs to T.
   subroutine iterate_thesis(problem, operator, tolerance, limit, gx, gy, dx, dy, tx, ty, &
      iterations)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: tolerance            !! of the residual and of the change of T
      integer, intent(in) :: limit                 !! of `iterations`
      real(dp), intent(inout) :: gx(:, :), gy(:, :), dx(:, :), dy(:, :)    !! work [nx, ny]
      real(dp), intent(inout) :: tx(:, :), ty(:, :)                        !! work [nx, ny]
      integer, intent(inout) :: iterations
      real(dp) :: beta, ascent, bend, form, alpha, sums(4)
      integer :: returned

      beta = 0.0_dp
      do while (iterations < limit)
         iterations = iterations + 1
         call new_direction(problem, operator, beta, gx, gy, dx, dy, tx, ty, ascent, bend)
         if (ascent <= 0.0_dp) then
            call new_direction(problem, operator, 0.0_dp, gx, gy, dx, dy, tx, ty, ascent, bend)
         end if
         call operator%columns(columns_form, form)
         call problem%add_spring(tx, ty, form)
         if (.not. (form > 0.0_dp .and. abs(ascent) > 0.0_dp)) return
         ! The bound bends towards the solution or away: keep the step positive and finite.
         alpha = ascent/max(form - bend, 0.1_dp*form)
         call problem%move(operator, alpha, dx, dy, .true., returned, .false.)
         call problem%update_slip(operator)
         if (problem%solved(tolerance)) return
         call direction_products(problem, gx, gy, tx, ty)
         sums = problem%totals(4)
         beta = 0.0_dp
         if (abs(sums(1)) > 0.0_dp) beta = -sums(2)/sums(1) + theta*sums(3)*sums(4)/sums(1)**2
      end do
   end subroutine iterate_thesis

   !> g, d = g + beta d and t = d + K_1 with its transform; t.g and K_2.r.
   subroutine new_direction(problem, operator, beta, gx, gy, dx, dy, tx, ty, ascent, bend)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      real(dp), intent(inout) :: gx(:, :), gy(:, :)
      real(dp), intent(inout) :: dx(:, :), dy(:, :)
      real(dp), intent(inout) :: tx(:, :), ty(:, :)
      real(dp), intent(out) :: ascent              !! t.g
      real(dp), intent(out) :: bend                !! K_2.r
      real(dp) :: d(2), r(2), g(2), v(2), t(2), first, second, sums(2)
      integer :: i, j

      !$omp parallel do default(none) shared(problem, operator, beta, gx, gy, dx, dy, tx, ty) &
      !$omp private(i, j, d, r, g, v, t, first, second) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%ny
         problem%row_sums(1:2, j) = 0.0_dp
         do i = 1, problem%nx
            g = 0.0_dp
            v = 0.0_dp
            t = 0.0_dp
            if (problem%contact(i, j) /= contact_open) then
               call perpendicular(problem, i, j, d, r, g)
               v = g
               if (abs(beta) > 0.0_dp) v = g + beta*[dx(i, j), dy(i, j)]
               t = v
               if (problem%contact(i, j) == contact_slip) then
                  call problem%law%bound_variation(problem%p(i, j), problem%slope_at(i, j), d, v, &
                     first, second)
                  t = v + first*d
                  problem%row_sums(2, j) = problem%row_sums(2, j) &
                     + dot_product(second*d + 2.0_dp*first*v, r)
               end if
               problem%row_sums(1, j) = problem%row_sums(1, j) + dot_product(t, g)
            end if
            gx(i, j) = g(1)
            gy(i, j) = g(2)
            dx(i, j) = v(1)
            dy(i, j) = v(2)
            tx(i, j) = t(1)
            ty(i, j) = t(2)
         end do
         call operator%forward_row(1, j, tx(:, j))
         call operator%forward_row(2, j, ty(:, j))
      end do
      sums = problem%totals(2)
      ascent = sums(1)
      bend = sums(2)
   end subroutine new_direction

   !> t.y, y.g', t.g' and y.y with y = g' - g.
   subroutine direction_products(problem, gx, gy, tx, ty)
      type(friction_problem_type), intent(inout) :: problem
      real(dp), intent(in) :: gx(:, :), gy(:, :)   !! the old g
      real(dp), intent(in) :: tx(:, :), ty(:, :)
      real(dp) :: d(2), r(2), g(2), y(2), t(2)
      integer :: i, j

      !$omp parallel do default(none) shared(problem, gx, gy, tx, ty) &
      !$omp private(i, j, d, r, g, y, t) num_threads(problem%threads)
      do j = 1, problem%ny
         associate (sums => problem%row_sums(:, j))
            sums(:) = 0.0_dp
            do i = 1, problem%nx
               if (problem%contact(i, j) == contact_open) cycle
               call perpendicular(problem, i, j, d, r, g)
               y = g - [gx(i, j), gy(i, j)]
               t = [tx(i, j), ty(i, j)]
               sums(1) = sums(1) + dot_product(t, y)
               sums(2) = sums(2) + dot_product(y, g)
               sums(3) = sums(3) + dot_product(t, g)
               sums(4) = sums(4) + dot_product(y, y)
            end do
         end associate
      end do
   end subroutine direction_products

   !> D, the slip along the slope, and its part perpendicular to D where the point slips.
   pure subroutine perpendicular(problem, i, j, d, r, g)
      type(friction_problem_type), intent(in) :: problem
      integer, intent(in) :: i, j
      real(dp), intent(out) :: d(2)          !! Pa
      real(dp), intent(out) :: r(2), g(2)    !! m
      real(dp) :: slope(2), dd

      slope = problem%slope_at(i, j)
      d = problem%friction_part(i, j, slope)
      r = problem%law%slip_along_slope(slope, [problem%rx(i, j), problem%ry(i, j)])
      g = r
      if (problem%contact(i, j) /= contact_slip) return
      dd = d(1)**2 + d(2)**2
      g = 0.0_dp
      if (dd > 0.0_dp) g = r - (r(1)*d(1) + r(2)*d(2))/dd*d
   end subroutine perpendicular

end module friction_cg_thesis
