!> The method of the thesis for the tangential problem: conjugate gradients of Hager and Zhang with the
!> terms K of the moving bound and the residual perpendicular to the traction (thesis, section 3.2).
!>
!>     t = d + K_1                                             (K_1, K_2: derivatives of the return)
!>     alpha = t.g/(t.A t - K_2.r)                             (eq. 3.12)
!>     T' = return(T + alpha d) ; r = DX - A T'                (eq. 3.10, 3.11)
!>     release the points that slip against their traction
!>     g = r, minus its part along D where it slips            (eq. 3.16)
!>     y = g' - g ; beta = -y.g'/t.y + theta t.g' y.y/(t.y)^2   (eq. 3.14)
!>     d = g' + beta d
!>
!> Corrections of the printed text: the denominator of eq. 3.16 is |D|^2; the K_2 term contains the
!> whole residual r, which includes the curvature of the bound; slipping points are returned to the bound from
!> both sides; K_1 and K_2 are in closed form (module `friction_law`). The method restarts with d = g if t.g <= 0.
!> An iteration takes two products of the operator, the first without its inverse transform.
module friction_cg_thesis
   use asperity_precision, only : dp
   use fft_conv, only : columns_form, convolution_type
   use field_sums, only : row_totals
   use friction_fields, only : fit_field
   use friction_law, only : contact_open, contact_slip
   use friction_method, only : friction_goal_type, friction_method_type
   use friction_moves, only : move
   use friction_problem, only : friction_problem_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: friction_thesis_type

   real(dp), parameter :: theta = 1.0_dp     !! the free parameter of eq. 3.14

   !> The method with its work fields, which are made when it is first used.
   type, extends(friction_method_type) :: friction_thesis_type
      real(dp), allocatable, private :: gradient(:, :, :)    !! [width, 2, rows] g
      real(dp), allocatable, private :: direction(:, :, :)   !! [width, 2, rows] d
      real(dp), allocatable, private :: tangent(:, :, :)     !! [width, 2, rows] t
   contains
      procedure :: iterate
   end type friction_thesis_type

contains

   !> Iterate (see `friction_method_type`).
   subroutine iterate(self, problem, operator, goal, iterations)
      class(friction_thesis_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(friction_goal_type), intent(in) :: goal
      integer, intent(inout) :: iterations
      real(dp) :: beta, ascent, bend, form, alpha
      logical :: returned

      call fit_field(self%gradient, problem%width, 2, problem%rows)
      call fit_field(self%direction, problem%width, 2, problem%rows)
      call fit_field(self%tangent, problem%width, 2, problem%rows)
      self%stopped = .false.
      beta = 0.0_dp
      do while (iterations < goal%most_iterations)
         self%stopped = stop_is_due()
         if (self%stopped) return
         iterations = iterations + 1
         call new_direction(self, problem, operator, beta, ascent, bend)
         if (ascent <= 0.0_dp) call new_direction(self, problem, operator, 0.0_dp, ascent, bend)
         call operator%columns(columns_form, form)
         call problem%spring%add_form(self%tangent, form)
         if (.not. (form > 0.0_dp .and. abs(ascent) > 0.0_dp)) return
         ! The bound may curve towards the solution or away from it: keep the step positive and finite.
         alpha = ascent/max(form - bend, 0.1_dp*form)
         call move(problem, operator, alpha, self%direction, .false., .true., returned)
         call problem%update_slip(operator)
         if (problem%solved(goal%tolerance)) return
         beta = next_beta(self, problem)
      end do
   end subroutine iterate

   !> Compute g, d = g + beta d, t = d + K_1 with its transform, t.g and K_2.r.
   subroutine new_direction(self, problem, operator, beta, ascent, bend)
      type(friction_thesis_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: beta
      real(dp), intent(out) :: ascent              !! t.g
      real(dp), intent(out) :: bend                !! K_2.r
      real(dp), allocatable :: rows(:, :)          !! t.g, K_2.r
      real(dp) :: d(2), r(2), g(2), v(2), t(2), first, second, totals(2)
      integer :: i, j

      allocate (rows(2, problem%rows), source=0.0_dp)
      !$omp parallel do default(none) shared(self, problem, operator, beta, rows) &
      !$omp private(i, j, d, r, g, v, t, first, second) num_threads(problem%threads)
      do j = 1, problem%rows
         do i = 1, problem%width
            g = 0.0_dp
            v = 0.0_dp
            t = 0.0_dp
            if (problem%work%contact(i, j) /= contact_open) then
               call perpendicular(problem, i, j, d, r, g)
               v = g
               if (abs(beta) > 0.0_dp) v = g + beta*self%direction(i, :, j)
               t = v
               if (problem%work%contact(i, j) == contact_slip) then
                  call problem%law%bound_variation(problem%pressure_at(i, j), problem%slope_at(i, j), d, v, &
                     first, second)
                  t = v + first*d
                  rows(2, j) = rows(2, j) + dot_product(second*d + 2.0_dp*first*v, r)
               end if
               rows(1, j) = rows(1, j) + dot_product(t, g)
            end if
            self%gradient(i, :, j) = g
            self%direction(i, :, j) = v
            self%tangent(i, :, j) = t
         end do
         call problem%spread_to_transform(operator, self%tangent(:, :, j), j)
      end do
      totals = row_totals(rows)
      ascent = totals(1)
      bend = totals(2)
   end subroutine new_direction

   !> Compute beta of eq. 3.14, with y = g' - g. The field `gradient` still contains the old g.
   function next_beta(self, problem) result(beta)
      type(friction_thesis_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem
      real(dp) :: beta
      real(dp), allocatable :: rows(:, :)          !! t.y, y.g', t.g', y.y
      real(dp) :: d(2), r(2), g(2), y(2), t(2), products(4)
      integer :: i, j

      allocate (rows(4, problem%rows), source=0.0_dp)
      !$omp parallel do default(none) shared(self, problem, rows) private(i, j, d, r, g, y, t) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         do i = 1, problem%width
            if (problem%work%contact(i, j) == contact_open) cycle
            call perpendicular(problem, i, j, d, r, g)
            y = g - self%gradient(i, :, j)
            t = self%tangent(i, :, j)
            rows(1, j) = rows(1, j) + dot_product(t, y)
            rows(2, j) = rows(2, j) + dot_product(y, g)
            rows(3, j) = rows(3, j) + dot_product(t, g)
            rows(4, j) = rows(4, j) + dot_product(y, y)
         end do
      end do
      products = row_totals(rows)
      beta = 0.0_dp
      if (abs(products(1)) > 0.0_dp) &
         beta = -products(2)/products(1) + theta*products(3)*products(4)/products(1)**2
   end function next_beta

   !> Compute D, the slip along the slope, and its part perpendicular to D if the point slips.
   pure subroutine perpendicular(problem, i, j, d, r, g)
      type(friction_problem_type), intent(in) :: problem
      integer, intent(in) :: i, j
      real(dp), intent(out) :: d(2)          !! Pa
      real(dp), intent(out) :: r(2), g(2)    !! m
      real(dp) :: slope(2), slip(2), dd

      slope = problem%slope_at(i, j)
      d = problem%work%traction(i, :, j) - problem%law%normal_traction(problem%pressure_at(i, j), slope)
      slip = problem%work%slip(i, :, j)
      r = problem%law%slip_along_slope(slope, slip)
      g = r
      if (problem%work%contact(i, j) /= contact_slip) return
      dd = d(1)**2 + d(2)**2
      g = 0.0_dp
      if (dd > 0.0_dp) g = r - (r(1)*d(1) + r(2)*d(2))/dd*d
   end subroutine perpendicular

end module friction_cg_thesis
