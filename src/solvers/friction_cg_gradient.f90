!> The fallback for the tangential problem: spectral projected gradients.
!>
!>     T' = return(T + alpha r)       r: the slip along the slope; return: radially to the bound, if outside it
!>     alpha = s.s/s.y or s.y/y.y     s = T' - T, y = r - r' (Barzilai and Borwein, 1988); the second one, which is
!>                                    shorter, if it is less than half of the first one
!>
!> An iteration takes one product of the operator, and there is no preconditioner. With the slope effect the
!> radial return is not a Euclidean projection, but its fixed points are the solutions: T + alpha r is returned to
!> T if r = 0, or if T is on the bound and r is along D.
module friction_cg_gradient
   use asperity_precision, only : dp
   use fft_conv, only : convolution_type
   use field_sums, only : row_totals
   use friction_fields, only : fit_field
   use friction_law, only : contact_open, contact_stick
   use friction_method, only : friction_goal_type, friction_method_type
   use friction_moves, only : move
   use friction_problem, only : friction_problem_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: friction_gradient_type

   !> The method with its work fields, which are made when it is first used.
   type, extends(friction_method_type) :: friction_gradient_type
      real(dp), allocatable, private :: slip(:, :, :)    !! [width, 2, rows] r along the slope
      real(dp), allocatable, private :: step(:, :, :)    !! [width, 2, rows] s
   contains
      procedure :: iterate
   end type friction_gradient_type

contains

   !> Iterate (see `friction_method_type`).
   subroutine iterate(self, problem, operator, goal, iterations)
      class(friction_gradient_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(friction_goal_type), intent(in) :: goal
      integer, intent(inout) :: iterations
      real(dp) :: alpha, first, first_alpha
      logical :: returned

      call fit_field(self%slip, problem%width, 2, problem%rows)
      call fit_field(self%step, problem%width, 2, problem%rows)
      self%stopped = .false.
      first = problem%residual
      first_alpha = 1.0_dp/(problem%compliance*sqrt(real(max(problem%cells, 1), dp)))
      alpha = first_alpha
      do while (iterations < goal%most_iterations)
         self%stopped = stop_is_due()
         if (self%stopped) return
         iterations = iterations + 1
         call form_step(self, problem, alpha)
         call move(problem, operator, 1.0_dp, self%step, .false., .true., returned)
         call problem%update_slip(operator)
         if (problem%solved(goal%tolerance)) return
         if (problem%residual <= goal%fall*first) return
         alpha = next_alpha(self, problem, first_alpha)
      end do
   end subroutine iterate

   !> Compute s = return(T + alpha r) - T, and keep r.
   subroutine form_step(self, problem, alpha)
      type(friction_gradient_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      real(dp), intent(in) :: alpha
      real(dp) :: slope(2), slip(2), r(2), s, t(2)
      integer :: i, j

      !$omp parallel do default(none) shared(self, problem, alpha) &
      !$omp private(i, j, slope, slip, r, s, t) num_threads(problem%threads)
      do j = 1, problem%rows
         do i = 1, problem%width
            if (problem%work%contact(i, j) == contact_open) cycle
            slope = problem%slope_at(i, j)
            slip = problem%work%slip(i, :, j)
            r = problem%law%slip_along_slope(slope, slip)
            t = problem%work%traction(i, :, j) + alpha*r
            call problem%place_on_bound(i, j, 1.0_dp, t, s)
            self%slip(i, :, j) = r
            self%step(i, :, j) = t - problem%work%traction(i, :, j)
            problem%work%contact(i, j) = contact_stick
         end do
      end do
   end subroutine form_step

   !> Compute the next length from the last step.
   function next_alpha(self, problem, first_alpha) result(alpha)
      type(friction_gradient_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem
      real(dp), intent(in) :: first_alpha              !! if the step gives no information
      real(dp) :: alpha
      real(dp), allocatable :: rows(:, :)              !! s.s, s.y, y.y
      real(dp) :: s(2), slip(2), y(2), products(3), shortest, longest
      integer :: i, j

      allocate (rows(3, problem%rows), source=0.0_dp)
      !$omp parallel do default(none) shared(self, problem, rows) private(i, j, s, slip, y) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         do i = 1, problem%width
            if (problem%work%contact(i, j) == contact_open) cycle
            slip = problem%work%slip(i, :, j)
            y = self%slip(i, :, j) - problem%law%slip_along_slope(problem%slope_at(i, j), slip)
            s = self%step(i, :, j)
            rows(1, j) = rows(1, j) + s(1)**2 + s(2)**2
            rows(2, j) = rows(2, j) + s(1)*y(1) + s(2)*y(2)
            rows(3, j) = rows(3, j) + y(1)**2 + y(2)**2
         end do
      end do
      products = row_totals(rows)
      shortest = 0.0_dp
      longest = 0.0_dp
      if (products(3) > 0.0_dp) shortest = products(2)/products(3)
      if (products(2) > 0.0_dp) longest = products(1)/products(2)
      alpha = longest
      if (shortest < 0.5_dp*longest) alpha = shortest
      if (.not. shortest > 0.0_dp) alpha = first_alpha
   end function next_alpha

end module friction_cg_gradient
