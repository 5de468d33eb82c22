!> Normal contact without adhesion: P >= 0, gap >= 0, P gap = 0.
!>
!> Bound-constrained, projected conjugate gradients for the pressure P under a rigid rough surface H,
!>     minimise  c/2 (P + P_h).A(P + P_h) - P.H,   P >= 0,   mean(P) given or the approach given,
!> where A is the operator for unit shear modulus, c = 1/modulus, and P_h a given traction (the memory
!> of a viscoelastic material; nothing else changes with it). After Polonsky and Keer (1999), with
!> * the exact projection on {P >= 0, sum P = load} instead of a rescaling;
!> * the direction kept through changes of the contact set (Fletcher-Reeves);
!> * a preconditioner ~ |q| of a local stencil and block means (module coarse_level);
!> * the step length predicted on the block means, so that the clipped step s is known before the
!>   transform: two transforms an iteration, always;
!> * passes over active blocks of 16 cells only, but the one that updates the gap.
!> The thesis's own algorithm (2.1.2) is in module normal_cg_thesis.
!>
!> Converged means that the duality gap e1 = (mean gap under the pressure - least gap)/h_rms and the
!> error of the load, both of a fresh U = A P, are below the tolerance. Where the contact is small on a
!> tall map, iterations go on to a smaller scale than h_rms (`narrow_scale` of module normal_state).
!>
!> In mixed precision the products A s of the steps are in single precision: their errors are small
!> beside s. The pressure and the gap stay in double precision, and a product of the whole pressure in
!> double precision, now and then and before anything is reported, leaves the errors of s behind. Where
!> that does not help, the products of the steps go back to double precision.
!>
!> The passes themselves are in module normal_sweeps. S and the set where d acts are read off r and d,
!> which are zero elsewhere; what must be taken off d to keep the load is carried as a number.
!>
!> Fields of doubles: H, P, gap, and the work fields residual, direction, step; the operator's spectrum
!> and a quarter for its symbol, a tenth for blocks and the coarse level: 7.4, measured 7.7 at n = 4096
!> with all else the process holds. In free mode spectrum and symbol take three.
module normal_cg
   use active_blocks, only : active_blocks_type, new_active_blocks
   use coarse_level, only : coarse_level_type, new_coarse_level, stencil_c0
   use asperity_errors, only : error_type
   use finite_fields, only : reject_overflow
   use fft_conv, only : columns_apply, convolution_type, new_normal_operator
   use normal_state, only : combine_measures, control_pressure, evaluate_gap, first_pressure, &
      gap_measure_type, narrow_scale, normal_problem_type, prepare_problem, reason_converged, &
      reason_iterations, reason_undetermined, row_measure
   use normal_sweeps, only : above_cells, clip_cells, coupling_cells, direction_cells, load_cells, &
      longest_cells, residual_cells, trial_cells
   use omp_lib, only : omp_get_wtime
   use asperity_parallel, only : global_min, global_sum
   use asperity_precision, only : dp, int64
   use projection, only : project_simplex
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: new_normal_solver, normal_solver_type

   integer, parameter :: longest_age = 40      !! iterations between fresh products A P
   real(dp), parameter :: often_bent = 1e3_dp  !! kappa after some steps that did not descend
   integer, parameter :: mixed_age = 20        !! the same in mixed precision
   integer, parameter :: careful_age = 10      !! the same for a tolerance below `careful`
   real(dp), parameter :: careful = 1e-7_dp
   real(dp), parameter :: useless = 0.1_dp     !! part of a clipped step that is taken, at the most

   !> The solver with its operators and work fields, kept from step to step. Not to be copied.
   type :: normal_solver_type
      type(grid_type) :: grid
      type(convolution_type) :: operator              !! A for G = 1
      logical :: mixed = .false.                      !! products of steps in single precision
      type(convolution_type) :: quick                 !! A in single precision, if mixed
      logical, private :: swift = .false.             !! the next product of a step is by `quick`
      type(coarse_level_type), private :: coarse
      real(dp), allocatable, private :: residual(:, :)    !! with a rim: (0:nx+1, 0:ny+1)
      real(dp), allocatable, private :: direction(:, :)
      real(dp), allocatable :: step(:, :)                 !! work field, free between solves
      type(active_blocks_type), private :: active         !! where residual, direction, step are not 0
      real(dp), allocatable, private :: rows(:, :)        !! partial sums of each row
      real(dp), allocatable, private :: surveyed(:, :)    !! the same for the measure of error
      ! What an iteration leaves to the next:
      real(dp), private :: old = 0.0_dp                   !! r.z; 0: the direction is not kept
      real(dp), private :: offset = 0.0_dp                !! to be taken off the direction
      real(dp), private :: kappa = 1.0_dp                 !! the form of the step over its prediction
      logical, private :: restart = .true.                !! the direction is not kept
   contains
      procedure :: solve
      procedure :: destroy
   end type normal_solver_type

contains

   !> Make a solver for a grid.
   subroutine new_normal_solver(self, grid, poisson, error, mixed)
      type(normal_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson                  !! -1 < nu <= 0.5
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: mixed           !! in mixed precision

      self%grid = grid
      call new_normal_operator(self%operator, grid, poisson, error)
      if (allocated(error)) return
      if (present(mixed)) self%mixed = mixed
      if (self%mixed) call new_normal_operator(self%quick, grid, poisson, error, single=.true.)
      if (allocated(error)) return
      call new_coarse_level(self%coarse, grid, poisson, error)
      if (allocated(error)) return
      allocate (self%residual(0:grid%nx + 1, 0:grid%ny + 1), source=0.0_dp)
      allocate (self%direction(grid%nx, grid%ny), self%step(grid%nx, grid%ny), source=0.0_dp)
      call new_active_blocks(self%active, grid%nx, grid%ny, self%operator%threads)
      allocate (self%rows(5, grid%ny), self%surveyed(6, grid%ny))
   end subroutine new_normal_solver

   !> Solve a contact problem by the fast method.
   !>
   !> Not converging is an outcome: the state reached, the best so far, is handed out.
   subroutine solve(self, problem, height, pressure, gap, level, outcome, history)
      class(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), contiguous, intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), contiguous, intent(inout) :: pressure(:, :)        !! P, Pa; a start where problem%warm
      real(dp), contiguous, intent(inout) :: gap(:, :)             !! U - H - level, m
      real(dp), intent(out) :: level                   !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa
      type(normal_problem_type) :: task
      type(gap_measure_type) :: measure
      real(dp) :: scale, rd, squares, alpha, trial, cells, began, coarse_before, error_before, expected
      logical :: fresh, clipped, determined
      integer :: age, oldest
      integer(int64) :: before

      began = omp_get_wtime()
      before = self%operator%ffts + self%quick%ffts
      coarse_before = self%coarse%transforms()
      cells = global_sum(real(size(gap), dp))
      scale = 1.0_dp/problem%modulus
      self%kappa = 1.0_dp
      self%old = 0.0_dp
      self%offset = 0.0_dp
      self%restart = .true.
      error_before = huge(1.0_dp)
      expected = huge(1.0_dp)
      self%swift = self%mixed
      oldest = longest_age
      if (self%mixed) oldest = merge(careful_age, mixed_age, problem%tolerance < careful)
      call self%active%clear(self%residual, self%direction, self%step)
      call prepare_problem(problem, self%grid, self%operator%threads, height, task, determined)
      if (self%mixed) then
         call first_pressure(task, self%grid, self%quick, height, pressure, history)
      else
         call first_pressure(task, self%grid, self%operator, height, pressure, history)
      end if
      call refresh()
      outcome%reason = reason_iterations
      if (.not. determined) outcome%reason = reason_undetermined
      do
         measure = combine_measures(task, cells, self%surveyed)
         if (.not. determined) exit
         if (.not. fresh .and. (measure%strict <= task%tolerance .or. age >= oldest)) then
            expected = measure%error
            call refresh()
            cycle
         end if
         if (fresh .and. measure%error <= task%tolerance) &
            call narrow_scale(task, height, pressure, self%operator%threads, measure)
         if (measure%strict <= task%tolerance) exit
         if (fresh .and. self%swift) then
            ! Of residuals that have drifted, old and new ones do not make a direction; and where the drift
            ! outweighs what was gained since the last look, single precision is at its end.
            if (measure%error > 2.0_dp*expected) then
               self%restart = .true.
               self%swift = measure%error <= 0.5_dp*error_before
            end if
            error_before = measure%error
            expected = huge(1.0_dp)
         end if
         if (outcome%iterations == problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         call self%active%list_runs(measure%level, self%residual, self%direction, self%step)
         call choose_direction(self, task, measure%level, pressure, gap, rd, squares)
         if (rd <= 0.0_dp) then
            outcome%reason = 'no direction of descent is left'
            exit
         end if
         trial = scale*self%coarse%predict_form(squares)
         alpha = rd/max(self%kappa*trial, tiny(1.0_dp))
         call clipped_step(self, task, alpha, pressure, gap, measure%level, clipped, rd, squares)
         if (rd <= 0.0_dp) then
            ! The projection bent the step too far: once more from the steepest descent.
            if (self%kappa > 1e9_dp) then
               outcome%reason = 'no step lowers the energy'
               exit
            end if
            self%kappa = 4.0_dp*self%kappa
            self%restart = .true.
            cycle
         end if
         call choose_length(self, scale, pressure, clipped, rd, squares, alpha)
         if (alpha <= 0.0_dp) then
            outcome%reason = 'no direction of descent is left'
            exit
         end if
         age = age + 1
         call update(self, task, scale*alpha, alpha, pressure, gap)
         fresh = .false.
      end do

      if (.not. fresh) then
         call refresh()
         measure = combine_measures(task, cells, self%surveyed)
      end if
      if (determined .and. measure%load_error > task%tolerance) then
         ! A load that drowned in the round-off of a step is met by the pressure as a whole.
         call project_simplex(pressure, task%target*cells)
         call refresh()
         measure = combine_measures(task, cells, self%surveyed)
      end if
      outcome%converged = determined .and. measure%error <= task%tolerance
      if (outcome%converged) outcome%reason = reason_converged
      call shift_gap(self, measure%weighted_level, gap)
      level = measure%weighted_level - task%datum
      if (problem%control /= control_pressure) level = problem%target
      call reject_overflow(outcome, pressure, gap, self%operator%threads)
      outcome%residual = measure%error
      outcome%load_error = measure%load_error
      outcome%ffts = self%operator%ffts + self%quick%ffts - before &
         + nint(self%coarse%transforms() - coarse_before, int64)
      outcome%seconds = omp_get_wtime() - began

   contains

      !> The gap by a fresh product, and its survey.
      subroutine refresh()
         call evaluate_gap(task, self%operator, height, pressure, gap, history)
         call survey(self, task, pressure, gap)
         if (self%swift) call self%quick%set_unit(surveyed_load(self)/cells)
         fresh = .true.
         age = 0
      end subroutine refresh

   end subroutine solve

   !> Which blocks hold pressure, the least gap of each, and the measures of the rows.
   subroutine survey(self, problem, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny), gap(self%grid%nx, self%grid%ny)
      integer :: j

      !$omp parallel do default(none) shared(self, problem, pressure, gap) private(j) &
      !$omp num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         self%surveyed(1:5, j) = row_measure(pressure(:, j), gap(:, j), problem%target)
         call self%active%survey_row(.true., j, pressure(:, j), gap(:, j), self%surveyed(6, j))
      end do
   end subroutine survey

   !> The residual level - gap on S = {P > 0 or gap < level}, its rim and block means; the coarse
   !> correction; and the product r.z with z = M r = stencil and correction.
   subroutine form_residual(self, level, pressure, gap, rz)
      type(normal_solver_type), intent(inout) :: self
      real(dp), intent(in) :: level
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny), gap(self%grid%nx, self%grid%ny)
      real(dp), intent(out) :: rz
      real(dp), allocatable :: column(:)
      real(dp) :: square, coupling, wx, wy
      integer :: j, k, jb, n, nx, ny
      logical :: periodic

      wx = self%coarse%wx
      wy = self%coarse%wy
      nx = self%grid%nx
      ny = self%grid%ny
      periodic = self%grid%boundary == boundary_periodic
      !$omp parallel default(none) shared(self, pressure, gap, level, wx, wy, nx, periodic) &
      !$omp private(j, k, jb, n, column, square, coupling) num_threads(self%operator%threads)
      allocate (column(nx))
      !$omp do schedule(dynamic)
      do jb = 1, self%coarse%ny
         column(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            square = 0.0_dp
            coupling = 0.0_dp
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j))
                  n = self%active%last(k, j) - first + 1
                  call residual_cells(n, level, pressure(first, j), gap(first, j), &
                     self%residual(first, j), column(first), square)
               end associate
            end do
            if (periodic) then
               self%residual(0, j) = self%residual(nx, j)
               self%residual(nx + 1, j) = self%residual(1, j)
            end if
            if (j > self%coarse%first_y(jb)) call couple_row(self, wx, wy, j, coupling)
            self%rows(1:2, j) = [square, coupling]
         end do
         call self%coarse%set_means(jb, column)
      end do
      !$omp end parallel
      if (periodic) then
         self%residual(1:nx, 0) = self%residual(1:nx, ny)
         self%residual(1:nx, ny + 1) = self%residual(1:nx, 1)
      end if
      ! The first rows of blocks look at rows of another thread.
      do jb = 1, self%coarse%ny
         call couple_row(self, wx, wy, self%coarse%first_y(jb), self%rows(2, self%coarse%first_y(jb)))
      end do
      call self%coarse%precondition()
      rz = (stencil_c0 + 2.0_dp*(wx + wy))*row_sum(self, 1) - 2.0_dp*row_sum(self, 2) &
         + self%coarse%cells*sum(self%coarse%mean*self%coarse%correction)
   end subroutine form_residual

   !> Add the products of a row's residuals with those west and south of them.
   subroutine couple_row(self, wx, wy, j, coupling)
      type(normal_solver_type), intent(in) :: self
      real(dp), intent(in) :: wx, wy
      integer, intent(in) :: j
      real(dp), intent(inout) :: coupling
      integer :: k

      do k = 1, self%active%runs(j)
         associate (first => self%active%first(k, j))
            call coupling_cells(self%active%last(k, j) - first + 1, wx, wy, self%residual(first - 1, j), &
               self%residual(first, j - 1), coupling)
         end associate
      end do
   end subroutine couple_row

   !> The direction of an iteration: from the preconditioned residual and the direction before, or what of
   !> that leads downhill.
   subroutine choose_direction(self, problem, level, pressure, gap, rd, squares)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: level
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny), gap(self%grid%nx, self%grid%ny)
      real(dp), intent(out) :: rd                      !! r.d; 0 or less: there is none
      real(dp), intent(out) :: squares                 !! d.d
      real(dp) :: rz, beta

      call form_residual(self, level, pressure, gap, rz)
      beta = 0.0_dp
      if (.not. self%restart .and. self%old > 0.0_dp) beta = rz/self%old
      call new_direction(self, problem, .true., beta, pressure, rd, squares)
      if (rd <= 0.0_dp) call new_direction(self, problem, .true., 0.0_dp, pressure, rd, squares)
      self%old = rz
      if (rd <= 0.0_dp .or. self%kappa > often_bent) then
         ! M r may point uphill once the load is kept, or once clipped; r itself never does.
         call new_direction(self, problem, .false., 0.0_dp, pressure, rd, squares)
         self%old = 0.0_dp
      end if
      self%restart = .false.
   end subroutine choose_direction

   !> How much of the clipped step is taken, by the product of the operator with it.
   subroutine choose_length(self, scale, pressure, clipped, slope, squares, alpha)
      type(normal_solver_type), intent(inout) :: self
      real(dp), intent(in) :: scale                    !! 1/modulus, 1/Pa
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny)
      logical, intent(in) :: clipped
      real(dp), intent(in) :: slope                    !! of the energy along the step, its sign turned
      real(dp), intent(in) :: squares                  !! of the step
      real(dp), intent(out) :: alpha                   !! 0: the energy has no minimum along it
      real(dp) :: form, trial

      if (self%swift) then
         call self%quick%columns(columns_apply, form)
      else
         call self%operator%columns(columns_apply, form)
      end if
      form = scale*form
      alpha = 0.0_dp
      if (form <= 0.0_dp) return
      trial = scale*self%coarse%predict_form(squares)
      self%kappa = min(max(form/max(trial, tiny(1.0_dp)), 0.1_dp), 10.0_dp)
      alpha = slope/form
      ! A direction that points out of what is allowed only grows: leave it.
      self%restart = clipped .and. alpha < useless
      if (clipped .and. alpha > 0.55_dp) then
         alpha = 1.0_dp
      else if (alpha > 1.0_dp) then
         alpha = min(alpha, longest_multiple(self, pressure))
      end if
   end subroutine choose_length

   !> direction = z + beta direction where it acts: on S, but for empty cells that z would empty
   !> further. What must be taken off it to keep the load stays apart, as `offset`. Of the direction
   !> with it: the product with the residual, the square, the block means.
   subroutine new_direction(self, problem, preconditioned, beta, pressure, rd, squares)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      logical, intent(in) :: preconditioned          !! z = M r, else z = r
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny)
      real(dp), intent(out) :: rd, squares
      real(dp), allocatable :: correction(:), column(:), shares(:)
      real(dp) :: wx, wy, centre, sums(5), total
      integer :: j, k, jb, n

      wx = merge(self%coarse%wx, 0.0_dp, preconditioned)
      wy = merge(self%coarse%wy, 0.0_dp, preconditioned)
      centre = merge(stencil_c0, 1.0_dp, preconditioned) + 2.0_dp*(wx + wy)
      !$omp parallel default(none) shared(self, preconditioned, wx, wy, centre, beta, pressure) &
      !$omp private(j, k, jb, n, sums, correction, column, shares) &
      !$omp num_threads(self%operator%threads)
      allocate (correction(self%grid%nx), column(self%grid%nx), shares(self%grid%nx))
      !$omp do
      do jb = 1, self%coarse%ny
         correction(:) = 0.0_dp
         if (preconditioned) correction(:) = self%coarse%correction(self%coarse%block_x, jb)
         column(:) = 0.0_dp
         shares(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            sums = 0.0_dp
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j))
                  n = self%active%last(k, j) - first + 1
                  call direction_cells(n, wx, wy, centre, self%residual(first, j - 1), &
                     self%residual(first - 1, j), self%residual(first, j + 1), correction(first), &
                     beta, self%offset, pressure(first, j), self%direction(first, j), &
                     column(first), shares(first), sums)
               end associate
            end do
            self%rows(1:5, j) = sums
         end do
         call self%coarse%set_means(jb, column)
         call self%coarse%set_shares(jb, shares)
      end do
      !$omp end parallel
      self%offset = 0.0_dp
      rd = row_sum(self, 3)
      squares = row_sum(self, 5)
      if (problem%control /= control_pressure) return
      total = row_sum(self, 1)
      self%offset = total/max(row_sum(self, 2), 1.0_dp)
      rd = rd - self%offset*row_sum(self, 4)
      squares = squares - self%offset*total
      self%coarse%mean(:, :) = self%coarse%mean - self%offset*self%coarse%share
   end subroutine new_direction

   !> step = (P + alpha direction, put back on what is allowed) - P; whether anything was clipped, the
   !> slope of the energy along it, its square and block means. Its rows are transformed at once.
   subroutine clipped_step(self, problem, alpha, pressure, gap, level, clipped, slope, squares)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny), gap(self%grid%nx, self%grid%ny)
      real(dp), intent(in) :: level
      logical, intent(out) :: clipped
      real(dp), intent(out) :: slope, squares
      real(dp), allocatable :: column(:)
      real(dp) :: factor, shift, sums(2), least
      integer :: j, k, jb, n

      !$omp parallel do default(none) shared(self, pressure, alpha) &
      !$omp private(j, k, n, sums, least) schedule(dynamic, 8) num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         sums = 0.0_dp
         least = 0.0_dp
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               n = self%active%last(k, j) - first + 1
               call trial_cells(n, alpha, self%offset, pressure(first, j), self%direction(first, j), &
                  self%step(first, j), sums, least)
            end associate
         end do
         self%rows(1:3, j) = [sums, least]
      end do
      clipped = global_min(minval(self%rows(3, :))) < 0.0_dp
      factor = 1.0_dp
      shift = 0.0_dp
      if (problem%control == control_pressure .and. clipped) &
         call find_shift(self, problem, shift, factor)

      !$omp parallel default(none) shared(self, pressure, gap, level, factor, shift) &
      !$omp private(j, k, jb, n, sums, column) num_threads(self%operator%threads)
      allocate (column(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = 1, self%coarse%ny
         column(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            sums = 0.0_dp
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j))
                  n = self%active%last(k, j) - first + 1
                  call clip_cells(n, factor, shift, level, pressure(first, j), gap(first, j), &
                     self%step(first, j), column(first), sums)
               end associate
            end do
            self%rows(1:2, j) = sums
            if (self%swift .and. self%active%runs(j) == 0) then
               call self%quick%forward_zero_row(1, j)
            else if (self%swift) then
               call self%quick%forward_row(1, j, self%step(:, j))
            else if (self%active%runs(j) == 0) then
               call self%operator%forward_zero_row(1, j)
            else
               call self%operator%forward_row(1, j, self%step(:, j))
            end if
         end do
         call self%coarse%set_means(jb, column)
      end do
      !$omp end parallel
      slope = row_sum(self, 1)
      squares = row_sum(self, 2)
   end subroutine clipped_step

   !> The shift t for which max(trial - t, 0) has the load's sum, by Newton's method from below; the
   !> rows hold the sums for t = 0. A trial pressure far above the load leaves of that sum only what
   !> round-off allows: a factor makes up for the rest.
   subroutine find_shift(self, problem, shift, factor)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(inout) :: shift
      real(dp), intent(out) :: factor
      real(dp) :: kept, load, cells, next, sums(2)
      integer :: j, k, n

      load = problem%target*self%grid%nx*self%grid%ny
      factor = 1.0_dp
      kept = load
      next = shift
      do
         cells = row_sum(self, 2)
         if (cells < 1.0_dp) exit                   ! too far: what was kept before it is the best
         shift = next
         kept = row_sum(self, 1)
         if (kept - load <= 1e-15_dp*load) exit
         next = shift + (kept - load)/cells
         if (next <= shift) exit                    ! all that round-off allows
         !$omp parallel do default(none) shared(self, next) private(j, k, n, sums) &
         !$omp schedule(dynamic, 8) num_threads(self%operator%threads)
         do j = 1, self%grid%ny
            sums = 0.0_dp
            do k = 1, self%active%runs(j)
               n = self%active%last(k, j) - self%active%first(k, j) + 1
               call above_cells(n, next, self%step(self%active%first(k, j), j), sums)
            end do
            self%rows(1:2, j) = sums
         end do
      end do
      if (abs(kept - load) > 1e-13_dp*load) factor = load/kept
   end subroutine find_shift

   !> The longest multiple of the step that leaves no pressure negative.
   function longest_multiple(self, pressure) result(longest)
      type(normal_solver_type), intent(in) :: self
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%ny)
      real(dp) :: longest
      integer :: j, k

      longest = huge(1.0_dp)
      do j = 1, self%grid%ny
         do k = 1, self%active%runs(j)
            call longest_cells(self%active%last(k, j) - self%active%first(k, j) + 1, &
               pressure(self%active%first(k, j), j), self%step(self%active%first(k, j), j), longest)
         end do
      end do
      longest = global_min(longest)
   end function longest_multiple

   !> P = P + alpha step, gap = gap + factor A step, and the survey of the new state.
   subroutine update(self, problem, factor, alpha, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: factor, alpha
      real(dp), intent(inout) :: pressure(self%grid%nx, self%grid%ny)
      real(dp), intent(inout) :: gap(self%grid%nx, self%grid%ny)
      real(dp) :: sums(5)
      integer :: j, k, n

      !$omp parallel do default(none) shared(self, problem, factor, alpha, pressure, gap) &
      !$omp private(j, k, n, sums) schedule(dynamic, 8) num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         if (self%swift) then
            call self%quick%add_backward_row(1, j, factor, gap(:, j))
         else
            call self%operator%add_backward_row(1, j, factor, gap(:, j))
         end if
         sums = 0.0_dp
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               n = self%active%last(k, j) - first + 1
               call load_cells(n, alpha, problem%target, gap(first, j), self%step(first, j), &
                  pressure(first, j), sums)
            end associate
         end do
         self%surveyed(1:5, j) = sums
         call self%active%survey_row(.false., j, pressure(:, j), gap(:, j), self%surveyed(6, j))
      end do
   end subroutine update

   !> The sum of the pressure over the cells.
   function surveyed_load(self) result(load)
      type(normal_solver_type), intent(in) :: self
      real(dp) :: load
      integer :: j

      load = 0.0_dp
      do j = 1, self%grid%ny
         load = load + self%surveyed(1, j)
      end do
      load = global_sum(load)
   end function surveyed_load

   !> Subtract the level.
   subroutine shift_gap(self, level, gap)
      type(normal_solver_type), intent(in) :: self
      real(dp), intent(in) :: level
      real(dp), contiguous, intent(inout) :: gap(:, :)
      integer :: j

      !$omp parallel do default(none) shared(self, gap, level) private(j) &
      !$omp num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         gap(:, j) = gap(:, j) - level
      end do
   end subroutine shift_gap

   !> Sum of the rows' partial sums, in order, so that the threads do not matter.
   function row_sum(self, which) result(total)
      type(normal_solver_type), intent(in) :: self
      integer, intent(in) :: which
      real(dp) :: total
      integer :: j

      total = 0.0_dp
      do j = 1, self%grid%ny
         total = total + self%rows(which, j)
      end do
      total = global_sum(total)
   end function row_sum

   !> Free plans and memory.
   subroutine destroy(self)
      class(normal_solver_type), intent(inout) :: self

      call self%operator%destroy()
      if (self%mixed) call self%quick%destroy()
      call self%coarse%destroy()
   end subroutine destroy

end module normal_cg
