!> Normal contact by the conjugate gradients of the thesis (2.1.2), with which its numbers of iterations can be
!> reproduced. An iteration takes three transforms.
!>
!> The quadratic form of the direction by Parseval's theorem (eq. 2.8) takes the first transform, and U = A P the others.
!> Negative pressures are set to 0, and the others are rescaled to the load. The contact is where P > 0 or the surfaces
!> overlap. The stopping criterion is that of module `normal_cg`.
module normal_cg_thesis
   use contact_solver, only : check_normal_kernel, contact_solver_type
   use asperity_errors, only : error_type
   use fft_conv, only : new_convolution
   use finite_fields, only : reject_overflow
   use normal_state, only : control_pressure, evaluate_gap, fault_of_problem, first_pressure, gap_measure_type, &
      measure_gap, narrow_scale, normal_problem_type, prepare_problem, reason_iterations, reason_undetermined, &
      remove_round_off, return_solution
   use omp_lib, only : omp_get_wtime
   use field_sums, only : cell_count, row_total
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: new_thesis_solver, thesis_solver_type

   !> The solver with its operator. A variable of this type must not be copied.
   type, extends(contact_solver_type) :: thesis_solver_type
   contains
      procedure :: solve
   end type thesis_solver_type

contains

   !> Make a solver for a grid.
   subroutine new_thesis_solver(self, grid, kernel, error)
      type(thesis_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error

      self%grid = grid
      call check_normal_kernel(kernel, error)
      call new_convolution(self%operator, grid, kernel, error)
   end subroutine new_thesis_solver

   !> Solve a contact problem.
   subroutine solve(self, problem, height, pressure, gap, level, outcome, past)
      class(thesis_solver_type), intent(inout), target :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), contiguous, intent(in) :: height(:, :)           !! H, [nx, ny], m
      real(dp), contiguous, intent(inout) :: pressure(:, :)      !! P, Pa
      real(dp), contiguous, intent(inout) :: gap(:, :)           !! U - H - level, m
      real(dp), intent(out) :: level                             !! m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: past(:, :)            !! P_h, Pa
      type(normal_problem_type) :: task
      type(gap_measure_type) :: measure
      real(dp), allocatable :: residual(:, :), previous(:, :), direction(:, :)
      real(dp) :: alpha, form, began
      integer(int64) :: before
      logical :: determined

      level = 0.0_dp
      call outcome%refuse(fault_of_problem(problem, self%grid, height, pressure, gap, past))
      if (outcome%reason /= '') return
      began = omp_get_wtime()
      before = self%operator%ffts
      allocate (residual(self%grid%nx, self%grid%rows()), source=0.0_dp)
      allocate (previous, direction, source=residual)
      alpha = 0.0_dp
      form = 0.0_dp
      call prepare_problem(problem, self%grid, self%operator%threads, height, task, determined)
      call first_pressure(task, self%grid, self%operator, height, pressure, past)
      outcome%reason = reason_iterations
      if (.not. determined) outcome%reason = reason_undetermined
      do
         call evaluate_gap(task, self%operator, height, pressure, gap, past)
         measure = measure_gap(task, pressure, gap, self%operator%threads)
         if (measure%error <= task%tolerance .and. determined) &
            call narrow_scale(task, height, pressure, self%operator%threads, measure)
         if (.not. determined .or. measure%strict <= task%tolerance) exit
         if (outcome%iterations >= task%max_iterations) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return
         outcome%iterations = outcome%iterations + 1
         call choose_direction()
         if (outcome%reason /= reason_iterations) exit
         call move(task, alpha, direction, pressure, outcome)
         if (outcome%reason /= reason_iterations) exit
      end do
      call remove_round_off(measure, self%grid%cells(), self%operator%threads, pressure, gap)
      call return_solution(problem, task, measure, determined, self%operator%threads, gap, level, outcome)
      outcome%ffts = self%operator%ffts - before
      call reject_overflow(outcome, pressure, gap, self%operator%threads)
      outcome%seconds = omp_get_wtime() - began

   contains

      !> Choose the direction of Polak and Ribiere, and the length of the step along it.
      subroutine choose_direction()
         real(dp) :: beta, slope, change

         call new_residual(task, measure%level, pressure, gap, residual, previous, slope, change)
         beta = 0.0_dp
         if (form > 0.0_dp) beta = max(change/(alpha*form), 0.0_dp)     ! eq. 2.7
         call form_direction(beta, residual, direction, slope)
         if (slope <= 0.0_dp) call form_direction(0.0_dp, residual, direction, slope)
         call self%operator%quadratic_form(direction, form)
         form = form/task%modulus
         if (slope <= 0.0_dp .or. form <= 0.0_dp) then
            outcome%reason = 'no direction of descent is left'
         else
            alpha = slope/form                                           ! eq. 2.6
         end if
      end subroutine choose_direction

   end subroutine solve

   !> Compute the residual H - U minus its mean on the contact, its square, and residual.(residual - previous).
   subroutine new_residual(problem, level, pressure, gap, residual, previous, slope, change)
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: level
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      real(dp), intent(inout) :: residual(:, :), previous(:, :)
      real(dp), intent(out) :: slope, change
      real(dp), allocatable :: rows(:, :)
      real(dp) :: mean
      integer :: i, j

      allocate (rows(2, size(gap, 2)))
      mean = level
      if (problem%control == control_pressure) then
         !$omp parallel do default(none) shared(pressure, gap, level, rows) private(j)
         do j = 1, size(gap, 2)
            rows(1, j) = sum(gap(:, j), pressure(:, j) > 0.0_dp .or. gap(:, j) < level)
            rows(2, j) = count(pressure(:, j) > 0.0_dp .or. gap(:, j) < level)
         end do
         mean = row_total(rows(1, :))/row_total(rows(2, :))
      end if
      !$omp parallel do default(none) shared(pressure, gap, level, mean, residual, previous, rows) &
      !$omp private(i, j)
      do j = 1, size(gap, 2)
         rows(:, j) = 0.0_dp
         do i = 1, size(gap, 1)
            previous(i, j) = residual(i, j)
            residual(i, j) = merge(mean - gap(i, j), 0.0_dp, &
               pressure(i, j) > 0.0_dp .or. gap(i, j) < level)
            rows(1, j) = rows(1, j) + residual(i, j)**2
            rows(2, j) = rows(2, j) + residual(i, j)*(residual(i, j) - previous(i, j))
         end do
      end do
      slope = row_total(rows(1, :))
      change = row_total(rows(2, :))
   end subroutine new_residual

   !> Compute direction = residual + beta direction on the contact, and its product with the residual.
   subroutine form_direction(beta, residual, direction, slope)
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: residual(:, :)
      real(dp), intent(inout) :: direction(:, :)
      real(dp), intent(out) :: slope
      real(dp), allocatable :: rows(:)
      integer :: i, j

      allocate (rows(size(residual, 2)))
      !$omp parallel do default(none) shared(beta, residual, direction, rows) private(i, j)
      do j = 1, size(residual, 2)
         rows(j) = 0.0_dp
         do i = 1, size(residual, 1)
            direction(i, j) = merge(residual(i, j) + beta*direction(i, j), 0.0_dp, &
               abs(residual(i, j)) > 0.0_dp)
            rows(j) = rows(j) + residual(i, j)*direction(i, j)
         end do
      end do
      slope = row_total(rows)
   end subroutine form_direction

   !> Compute P = P + alpha direction, set negative pressures to 0, and rescale the others if the load is prescribed.
   subroutine move(problem, alpha, direction, pressure, outcome)
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: direction(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      type(solver_result_type), intent(inout) :: outcome   !! gets a reason if no cell has a pressure any more
      real(dp), allocatable :: rows(:)
      real(dp) :: factor, load
      integer :: j

      allocate (rows(size(pressure, 2)))
      factor = 1.0_dp
      if (problem%control == control_pressure) then
         !$omp parallel do default(none) shared(alpha, direction, pressure, rows) private(j)
         do j = 1, size(pressure, 2)
            rows(j) = sum(max(pressure(:, j) + alpha*direction(:, j), 0.0_dp))
         end do
         load = row_total(rows)
         if (load <= 0.0_dp) then
            outcome%reason = 'a step left no cell in contact'
            return
         end if
         factor = problem%target*cell_count(pressure)/load
      end if
      !$omp parallel do default(none) shared(alpha, direction, pressure, factor) private(j)
      do j = 1, size(pressure, 2)
         pressure(:, j) = factor*max(pressure(:, j) + alpha*direction(:, j), 0.0_dp)
      end do
   end subroutine move

end module normal_cg_thesis
