!> Adhesive contact by the method of the thesis (2.3.2, eq. 2.23 to 2.28), periodic mode.
!>
!> Conjugate gradients on the gap outside the contact, without preconditioner: the step alpha of eq. 2.26
!> and the factor beta of eq. 2.28 take the linearised adhesive traction into account; gaps that would be
!> negative are closed, and a point in contact is released where its pressure is below -e'(0+). Both
!> denominators can be negative or zero, and a step can raise the energy: then beta = 0, alpha is taken
!> without the adhesive part, and steps that raise the energy are quartered. Four transforms an
!> iteration, two more for each quartered step. It is kept for comparison; the fast method is module
!> adhesion_cg_periodic, which has the same problem, units and measure of error.
!>
!> Fields of doubles: H, g, P, and the work fields residual, direction, product B d, trial gap, trial
!> traction; the spectrum of B.
module adhesion_cg_thesis
   use adhesion_periodic_state, only : evaluate_load, evaluate_traction, field_sum, finish, &
      is_detached, residual_units, start_gap
   use adhesion_potential, only : adhesive_energy, adhesive_terms
   use adhesion_state, only : adhesion_problem_type, close_gaps, control_approach, control_pressure, &
      reason_closed, reason_converged, reason_detached, reason_limit, reason_stalled, row_total, &
      stepped_gap, sum_shift
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : convolution_type, new_symbol_operator
   use omp_lib, only : omp_get_wtime
   use asperity_parallel, only : global_max, global_min
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_thesis_type, new_adhesion_thesis

   !> The solver with its operator and work fields. Not to be copied.
   type :: adhesion_thesis_type
      type(grid_type) :: grid
      type(convolution_type) :: stiffness                  !! B for G = 1
      real(dp) :: longest = 0.0_dp                         !! B at the least wave number
      real(dp), allocatable, private :: residual(:, :)     !! -G outside the contact
      real(dp), allocatable, private :: direction(:, :)    !! d
      real(dp), allocatable, private :: product(:, :)      !! Q B d
      real(dp), allocatable, private :: trial(:, :)        !! gap after the step
      real(dp), allocatable, private :: traction(:, :)     !! Q B(H + g) - P_h after the step
      real(dp), allocatable, private :: rows(:, :)         !! partial sums of each row
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_thesis_type

contains

   !> Make a solver for a periodic grid.
   subroutine new_adhesion_thesis(self, grid, poisson, error)
      type(adhesion_thesis_type), intent(out) :: self
      type(grid_type), intent(in) :: grid                  !! periodic
      real(dp), intent(in) :: poisson
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: symbol(:, :)
      integer :: i, j

      if (grid%boundary /= boundary_periodic) then
         call fail(error, error_input, &
            "method = 'thesis': adhesion on a free grid: must be 'fast' there")
         return
      end if
      self%grid = grid
      self%longest = 2.0_dp*pi/max(grid%lx, merge(0.0_dp, grid%ly, grid%ny == 1))/(1.0_dp - poisson)
      allocate (symbol(0:grid%nx/2, 0:grid%ny/2))
      do j = 0, grid%ny/2
         do i = 0, grid%nx/2
            symbol(i, j) = 2.0_dp*pi*hypot(i/grid%lx, j/grid%ly)/(1.0_dp - poisson)
         end do
      end do
      call new_symbol_operator(self%stiffness, grid%nx, grid%ny, symbol, error)
      if (allocated(error)) return
      allocate (self%residual(grid%nx, grid%ny), self%direction(grid%nx, grid%ny), &
         self%product(grid%nx, grid%ny), self%trial(grid%nx, grid%ny), &
         self%traction(grid%nx, grid%ny), source=0.0_dp)
      allocate (self%rows(4, grid%ny))
   end subroutine new_adhesion_thesis

   !> Solve an adhesive contact problem.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, history)
      class(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), intent(inout) :: gap(:, :)             !! g, m: the start, then the solution
      real(dp), intent(inout) :: pressure(:, :)        !! P, attraction included, Pa
      real(dp), intent(out) :: level                   !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa; its mean does not matter
      real(dp) :: load, total, mean_height, length, scale, least, alpha, beta, rd, curvature, form
      real(dp) :: bound, cells
      integer(int64) :: before
      integer :: failures, pass
      logical :: taken

      outcome%seconds = omp_get_wtime()
      before = self%stiffness%ffts
      cells = real(size(gap), dp)
      mean_height = field_sum(self%stiffness, self%rows, height)/cells - problem%datum
      load = 0.0_dp
      if (problem%control == control_pressure) load = problem%target
      total = -cells*(problem%target + mean_height)
      outcome%reason = reason_limit
      if (problem%control == control_approach .and. .not. total > 0.0_dp) then
         outcome%reason = reason_closed
         level = problem%target
         outcome%seconds = omp_get_wtime() - outcome%seconds
         return
      end if
      if (problem%full_contact) gap(:, :) = 0.0_dp
      call start_gap(self%stiffness, self%rows, problem, total, gap)
      call evaluate_traction(self%stiffness, self%rows, problem, height, gap, pressure, history)
      call residual_units(self%stiffness, self%rows, problem, height, pressure, load, self%longest, &
         length, scale)
      self%direction = 0.0_dp
      self%product = 0.0_dp
      curvature = 0.0_dp
      failures = 0
      do
         call evaluate_residual(self, problem, gap, pressure, length, scale, load, &
            outcome%residual, least)
         if (outcome%residual <= problem%tolerance) then
            outcome%converged = .true.
            outcome%reason = reason_converged
            exit
         end if
         if (is_detached(problem, load, least)) then
            outcome%reason = reason_detached
            exit
         end if
         if (outcome%iterations >= problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         beta = 0.0_dp
         if (curvature > 0.0_dp) beta = max(0.0_dp, -coupling(self, problem, gap)/curvature)
         call new_direction(self, problem, gap, beta, rd)
         if (rd <= 0.0_dp) call new_direction(self, problem, gap, 0.0_dp, rd)
         call multiply(self, problem, form)
         curvature = form + adhesive_part(self, problem, gap)
         alpha = rd/form
         if (curvature > 0.0_dp) alpha = min(rd/curvature, 10.0_dp*rd/form)
         taken = .false.
         do pass = 1, 30
            if (.not. (rd > 0.0_dp .and. form > 0.0_dp)) exit
            call try_step(self, problem, gap, alpha, total)
            call evaluate_traction(self%stiffness, self%rows, problem, height, self%trial, &
               self%traction, history)
            call energy_change(self, problem, gap, pressure, load, bound, taken)
            if (taken) exit
            alpha = 0.25_dp*alpha
         end do
         if (taken) then
            call accept(self, gap, pressure)
            failures = 0
         else
            failures = failures + 1
            curvature = 0.0_dp
            if (failures > 2) then
               outcome%reason = reason_stalled
               exit
            end if
         end if
      end do
      call finish(self%stiffness, self%rows, problem, load, total, gap, pressure, outcome)
      level = -mean_height - field_sum(self%stiffness, self%rows, gap)/cells
      call close_gaps(problem, length, scale, self%stiffness%threads, gap, pressure)
      outcome%ffts = self%stiffness%ffts - before
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> r = -G outside the contact and on the points that it releases (eq. 2.25); the natural residual.
   subroutine evaluate_residual(self, problem, gap, traction, length, scale, load, natural, least)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :), traction(:, :)
      real(dp), intent(in) :: length, scale
      real(dp), intent(inout) :: load                  !! p, Pa; found where the level is prescribed
      real(dp), intent(out) :: natural, least
      real(dp) :: g, worst, lowest
      integer :: i, j

      call evaluate_load(self%stiffness%threads, self%rows, problem, gap, traction, self%residual, &
         load)
      !$omp parallel do default(none) shared(self, gap, length, scale, load) &
      !$omp private(i, j, g, worst, lowest) num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         worst = 0.0_dp
         lowest = huge(1.0_dp)
         do i = 1, size(gap, 1)
            g = self%residual(i, j) + load
            worst = max(worst, abs(min(gap(i, j)/length, g/scale)))
            lowest = min(lowest, gap(i, j))
            self%residual(i, j) = merge(-g, 0.0_dp, gap(i, j) > 0.0_dp .or. g < 0.0_dp)
         end do
         self%rows(1, j) = worst
         self%rows(2, j) = lowest
      end do
      natural = global_max(maxval(self%rows(1, :)))
      least = global_min(minval(self%rows(2, :)))
   end subroutine evaluate_residual

   !> r.(Q B + e'') d, the numerator of eq. 2.28.
   function coupling(self, problem, gap) result(total)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp) :: total
      real(dp) :: s1, e, e1, e2
      integer :: i, j

      !$omp parallel do default(none) shared(self, problem, gap) private(i, j, s1, e, e1, e2) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         do i = 1, size(gap, 1)
            call adhesive_terms(problem%potential, gap(i, j), e, e1, e2)
            s1 = s1 + self%residual(i, j)*(self%product(i, j) + e2*self%direction(i, j))
         end do
         self%rows(1, j) = s1
      end do
      total = row_total(self%rows, 1)
   end function coupling

   !> d.e'' d (eq. 2.27).
   function adhesive_part(self, problem, gap) result(total)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp) :: total
      real(dp) :: s1, e, e1, e2
      integer :: i, j

      !$omp parallel do default(none) shared(self, problem, gap) private(i, j, s1, e, e1, e2) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         do i = 1, size(gap, 1)
            call adhesive_terms(problem%potential, gap(i, j), e, e1, e2)
            s1 = s1 + e2*self%direction(i, j)**2
         end do
         self%rows(1, j) = s1
      end do
      total = row_total(self%rows, 1)
   end function adhesive_part

   !> d = r + beta d outside the contact, of zero sum where the level is prescribed; r.d.
   subroutine new_direction(self, problem, gap, beta, rd)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: beta
      real(dp), intent(out) :: rd
      real(dp) :: s1, s2, mean
      logical :: free
      integer :: i, j, n

      !$omp parallel do default(none) shared(self, gap, beta) private(i, j, s1, n, free) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         n = 0
         do i = 1, size(gap, 1)
            free = gap(i, j) > 0.0_dp .or. self%residual(i, j) > 0.0_dp
            self%direction(i, j) = merge(self%residual(i, j) + beta*self%direction(i, j), 0.0_dp, free)
            s1 = s1 + self%direction(i, j)
            if (free) n = n + 1
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = real(n, dp)
      end do
      mean = 0.0_dp
      if (problem%control == control_approach) &
         mean = row_total(self%rows, 1)/max(row_total(self%rows, 2), 1.0_dp)
      !$omp parallel do default(none) shared(self, gap, mean) private(i, j, s2) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s2 = 0.0_dp
         do i = 1, size(gap, 1)
            if (gap(i, j) > 0.0_dp) then
               self%direction(i, j) = self%direction(i, j) - mean
            else if (self%residual(i, j) > 0.0_dp) then
               self%direction(i, j) = max(self%direction(i, j) - mean, 0.0_dp)
            end if
            s2 = s2 + self%residual(i, j)*self%direction(i, j)
         end do
         self%rows(1, j) = s2
      end do
      rd = row_total(self%rows, 1)
   end subroutine new_direction

   !> Q B d and d.Q B d.
   subroutine multiply(self, problem, form)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(out) :: form
      integer :: j

      call self%stiffness%apply(self%direction, self%product, form)
      form = problem%modulus*form
      !$omp parallel do default(none) shared(self, problem) private(j) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(self%product, 2)
         self%product(:, j) = problem%modulus*self%product(:, j)
      end do
   end subroutine multiply

   !> The gap after a step, closed where it would be negative.
   subroutine try_step(self, problem, gap, alpha, total)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: total                    !! prescribed sum of the gap, m
      real(dp) :: shift
      integer :: j

      shift = 0.0_dp
      if (problem%control == control_approach) shift = sum_shift(gap, self%direction, alpha, total, &
         self%rows, self%stiffness%threads)
      !$omp parallel do default(none) shared(self, gap, alpha, shift) private(j) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         self%trial(:, j) = stepped_gap(gap(:, j), self%direction(:, j), alpha, shift)
      end do
   end subroutine try_step

   !> Change of the energy with the trial step, and whether it is no rise beyond round-off.
   subroutine energy_change(self, problem, gap, traction, load, change, falls)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :), traction(:, :)
      real(dp), intent(in) :: load
      real(dp), intent(out) :: change
      logical, intent(out) :: falls
      real(dp) :: s1, s2, s, before
      integer :: i, j

      !$omp parallel do default(none) shared(self, problem, gap, traction, load) &
      !$omp private(i, j, s1, s2, s, before) num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         s2 = 0.0_dp
         do i = 1, size(gap, 1)
            s = self%trial(i, j) - gap(i, j)
            before = adhesive_energy(problem%potential, gap(i, j))
            s1 = s1 + s*(0.5_dp*(traction(i, j) + self%traction(i, j)) + load) &
               + adhesive_energy(problem%potential, self%trial(i, j)) - before
            s2 = s2 + abs(before)
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = s2
      end do
      change = row_total(self%rows, 1)
      falls = change <= 4.0_dp*epsilon(1.0_dp)*row_total(self%rows, 2)
   end subroutine energy_change

   !> Make the trial state the state.
   subroutine accept(self, gap, traction)
      type(adhesion_thesis_type), intent(inout) :: self
      real(dp), intent(inout) :: gap(:, :), traction(:, :)
      integer :: j

      !$omp parallel do default(none) shared(self, gap, traction) private(j) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         gap(:, j) = self%trial(:, j)
         traction(:, j) = self%traction(:, j)
      end do
   end subroutine accept

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_thesis_type), intent(inout) :: self

      call self%stiffness%destroy()
      if (allocated(self%residual)) deallocate (self%residual, self%direction, self%product, &
         self%trial, self%traction, self%rows)
   end subroutine destroy

end module adhesion_cg_thesis
