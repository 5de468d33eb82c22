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
!> error of the load, both of a fresh U = A P, are below the tolerance.
!>
!> Fields of doubles: H, P, gap, and the work fields residual, direction, step; the operator's spectrum.
module normal_cg
   use coarse_level, only : coarse_level_type, new_coarse_level, stencil_c0
   use errors, only : error_type
   use fft_conv, only : columns_apply, convolution_type, new_normal_operator
   use normal_state, only : combine_measures, control_pressure, evaluate_gap, first_pressure, &
      gap_measure_type, normal_problem_type, prepare_problem, reason_converged, reason_iterations, &
      reason_undetermined, row_measure
   use omp_lib, only : omp_get_wtime
   use parallel, only : global_min, global_sum
   use precision, only : dp, int64
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: new_normal_solver, normal_solver_type

   integer, parameter :: width = 16            !! cells of an active block
   integer, parameter :: longest_age = 40      !! iterations between fresh products A P

   !> The solver with its operators and work fields, kept from step to step. Not to be copied.
   type :: normal_solver_type
      type(grid_type) :: grid
      type(convolution_type) :: operator              !! A for G = 1
      type(coarse_level_type), private :: coarse
      real(dp), allocatable, private :: residual(:, :)    !! with a rim: (0:nx+1, 0:ny+1)
      real(dp), allocatable, private :: direction(:, :)
      real(dp), allocatable :: step(:, :)                 !! work field, free between solves
      real(dp), allocatable, private :: least(:, :)       !! least gap of each block
      logical, allocatable, private :: loaded(:, :)       !! blocks that hold P > 0
      logical, allocatable, private :: live(:, :)         !! active blocks
      integer, allocatable, private :: first(:, :)        !! first cells of a row's active runs
      integer, allocatable, private :: last(:, :)         !! their last cells
      integer, allocatable, private :: runs(:)            !! number of a row's active runs
      real(dp), allocatable, private :: rows(:, :)        !! partial sums of each row
      real(dp), allocatable, private :: surveyed(:, :)    !! the same for the measure of error
   contains
      procedure :: solve
      procedure :: destroy
   end type normal_solver_type

contains

   !> Make a solver for a grid.
   subroutine new_normal_solver(self, grid, poisson, error)
      type(normal_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      type(error_type), allocatable, intent(out) :: error
      integer :: nb

      self%grid = grid
      call new_normal_operator(self%operator, grid, poisson, error)
      if (allocated(error)) return
      call new_coarse_level(self%coarse, grid, poisson, error)
      if (allocated(error)) return
      nb = (grid%nx + width - 1)/width
      allocate (self%residual(0:grid%nx + 1, 0:grid%ny + 1), source=0.0_dp)
      allocate (self%direction(grid%nx, grid%ny), self%step(grid%nx, grid%ny), source=0.0_dp)
      allocate (self%least(nb, grid%ny), self%loaded(nb, grid%ny))
      allocate (self%live(nb, grid%ny), source=.false.)
      allocate (self%first(nb, grid%ny), self%last(nb, grid%ny), self%runs(grid%ny))
      allocate (self%rows(5, grid%ny), self%surveyed(6, grid%ny))
   end subroutine new_normal_solver

   !> Solve a contact problem by the fast method.
   !>
   !> Not converging is an outcome: the state reached, the best so far, is handed out.
   subroutine solve(self, problem, height, pressure, gap, level, outcome, history)
      class(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), intent(inout) :: pressure(:, :)        !! P, Pa; a start where problem%warm
      real(dp), intent(inout) :: gap(:, :)             !! U - H - level, m
      real(dp), intent(out) :: level                   !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa
      type(normal_problem_type) :: task
      type(gap_measure_type) :: measure
      real(dp) :: scale, old, rz, rd, kappa, squares, alpha, form, trial
      real(dp) :: best, limit, cells, mean, offset, beta, began, coarse_before
      logical :: fresh, restart, clipped, determined
      integer :: age
      integer(int64) :: before

      began = omp_get_wtime()
      before = self%operator%ffts
      coarse_before = self%coarse%transforms()
      cells = global_sum(real(size(gap), dp))
      scale = 1.0_dp/problem%modulus
      kappa = 1.0_dp
      old = 0.0_dp
      restart = .true.
      self%step = 0.0_dp
      self%direction = 0.0_dp
      self%residual = 0.0_dp
      call prepare_problem(problem, self%grid, self%operator%threads, height, task, determined)
      call first_pressure(task, self%grid, self%operator, height, pressure, history)
      call refresh()
      outcome%reason = reason_iterations
      if (.not. determined) outcome%reason = reason_undetermined
      do
         measure = combine_measures(task, cells, self%surveyed)
         if (.not. determined) exit
         if (measure%error <= task%tolerance) then
            if (fresh) then
               outcome%converged = .true.
               outcome%reason = reason_converged
               exit
            end if
            call refresh()
            cycle
         end if
         if (outcome%iterations == problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         call activate(self, measure%level)
         call form_residual(self, task, measure%level, pressure, gap)
         call precondition(self, task, pressure, mean, rz)
         beta = 0.0_dp
         if (.not. restart .and. old > 0.0_dp) beta = rz/old
         call new_direction(self, task, mean, beta, offset, rd, squares)
         if (rd <= 0.0_dp) call new_direction(self, task, mean, 0.0_dp, offset, rd, squares)
         old = rz
         restart = .false.
         if (rd <= 0.0_dp) then
            outcome%reason = 'no direction of descent is left'
            exit
         end if
         trial = scale*self%coarse%predict_form(squares)
         alpha = rd/max(kappa*trial, tiny(1.0_dp))
         call clipped_step(self, task, alpha, offset, pressure, gap, measure%level, clipped, rd, &
            squares, limit)
         if (rd <= 0.0_dp) then
            ! The projection bent the step too far: once more from the steepest descent.
            if (kappa > 1e6_dp) then
               outcome%reason = 'no step lowers the energy'
               exit
            end if
            kappa = 4.0_dp*kappa
            restart = .true.
            cycle
         end if
         call transform_step(self, form)
         form = scale*form
         trial = scale*self%coarse%predict_form(squares)
         kappa = min(max(form/max(trial, tiny(1.0_dp)), 0.1_dp), 10.0_dp)
         best = rd/form
         if (clipped .and. best > 0.55_dp) then
            alpha = 1.0_dp
         else
            alpha = min(best, limit)
         end if
         age = age + 1
         call update(self, task, scale*alpha, alpha, pressure, gap)
         fresh = .false.
         if (age == longest_age) call refresh()
      end do

      if (.not. fresh) then
         call refresh()
         measure = combine_measures(task, cells, self%surveyed)
         outcome%converged = measure%error <= task%tolerance
         if (outcome%converged) outcome%reason = reason_converged
      end if
      level = measure%weighted_level
      call shift_gap(self, level, gap)
      outcome%residual = measure%error
      outcome%load_error = measure%load_error
      outcome%ffts = self%operator%ffts - before &
         + nint(self%coarse%transforms() - coarse_before, int64)
      outcome%seconds = omp_get_wtime() - began

   contains

      !> The gap by a fresh product, and its survey.
      subroutine refresh()
         call evaluate_gap(task, self%operator, height, pressure, gap, history)
         call survey(self, task, pressure, gap)
         fresh = .true.
         age = 0
      end subroutine refresh

   end subroutine solve

   !> Which blocks hold pressure, the least gap of each, and the measures of the rows.
   subroutine survey(self, problem, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      integer :: j

      !$omp parallel do default(none) shared(self, problem, pressure, gap) private(j) &
      !$omp num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         call survey_row(self, problem, .true., j, pressure(:, j), gap(:, j))
      end do
   end subroutine survey

   !> The survey of a row.
   subroutine survey_row(self, problem, all_blocks, j, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      logical, intent(in) :: all_blocks        !! look for pressure off the active blocks, too
      integer, intent(in) :: j
      real(dp), intent(in) :: pressure(:), gap(:)
      integer :: b, first, last
      real(dp) :: sums(6), least
      integer :: i

      sums = [0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, huge(1.0_dp)]
      do b = 1, size(self%least, 1)
         first = (b - 1)*width + 1
         last = min(b*width, self%grid%nx)
         least = gap(first)
         !$omp simd reduction(min:least)
         do i = first + 1, last
            least = min(least, gap(i))
         end do
         self%least(b, j) = least
         sums(6) = min(sums(6), least)
         ! Where the solver did not act, there is no pressure.
         if (all_blocks .or. self%live(b, j)) then
            self%loaded(b, j) = maxval(pressure(first:last)) > 0.0_dp
            if (self%loaded(b, j)) sums(1:5) = sums(1:5) &
               + row_measure(pressure(first:last), gap(first:last), problem%target)
         else
            self%loaded(b, j) = .false.
         end if
      end do
      self%surveyed(:, j) = sums
   end subroutine survey_row

   !> List the runs of blocks that hold a cell with P > 0 or a gap below the level; clear those that
   !> left.
   subroutine activate(self, level)
      type(normal_solver_type), intent(inout) :: self
      real(dp), intent(in) :: level
      integer :: b, j, first, last, n
      logical :: now, before

      !$omp parallel do default(none) shared(self, level) private(b, j, first, last, n, now, before) &
      !$omp num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         n = 0
         before = .false.
         do b = 1, size(self%least, 1)
            now = self%loaded(b, j) .or. self%least(b, j) < level
            first = (b - 1)*width + 1
            last = min(b*width, self%grid%nx)
            if (now) then
               if (.not. before) then
                  n = n + 1
                  self%first(n, j) = first
               end if
               self%last(n, j) = last
            else if (self%live(b, j)) then
               self%residual(first:last, j) = 0.0_dp
               self%direction(first:last, j) = 0.0_dp
               self%step(first:last, j) = 0.0_dp
            end if
            self%live(b, j) = now
            before = now
         end do
         self%runs(j) = n
      end do
   end subroutine activate

   !> The residual -(gap - mean) on S = {P > 0 or gap < level}, its rim, and its block means.
   subroutine form_residual(self, problem, level, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: level
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      real(dp) :: mean, total, cells
      integer :: i, j, k, jb

      mean = level
      if (problem%control == control_pressure) then
         !$omp parallel do default(none) shared(self, pressure, gap, level) &
         !$omp private(i, j, k, total, cells) num_threads(self%operator%threads)
         do j = 1, self%grid%ny
            total = 0.0_dp
            cells = 0.0_dp
            do k = 1, self%runs(j)
               !$omp simd reduction(+:total, cells)
               do i = self%first(k, j), self%last(k, j)
                  total = total + merge(gap(i, j), 0.0_dp, &
                     pressure(i, j) > 0.0_dp .or. gap(i, j) < level)
                  cells = cells + merge(1.0_dp, 0.0_dp, &
                     pressure(i, j) > 0.0_dp .or. gap(i, j) < level)
               end do
            end do
            self%rows(1, j) = total
            self%rows(2, j) = cells
         end do
         mean = row_sum(self, 1)/max(row_sum(self, 2), 1.0_dp)
      end if
      !$omp parallel do default(none) shared(self, pressure, gap, level, mean) &
      !$omp private(i, j, k, jb) num_threads(self%operator%threads)
      do jb = 1, self%coarse%ny
         self%coarse%mean(:, jb) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            do k = 1, self%runs(j)
               !$omp simd
               do i = self%first(k, j), self%last(k, j)
                  self%residual(i, j) = merge(mean - gap(i, j), 0.0_dp, &
                     pressure(i, j) > 0.0_dp .or. gap(i, j) < level)
               end do
               call self%coarse%add_means(jb, self%first(k, j), &
                  self%residual(self%first(k, j):self%last(k, j), j))
            end do
         end do
      end do
      call fill_rim(self)
   end subroutine form_residual

   !> The rim of the residual: the other side's values where periodic, zero where free.
   subroutine fill_rim(self)
      type(normal_solver_type), intent(inout) :: self
      integer :: nx, ny

      if (self%grid%boundary /= boundary_periodic) return
      nx = self%grid%nx
      ny = self%grid%ny
      self%residual(0, 1:ny) = self%residual(nx, 1:ny)
      self%residual(nx + 1, 1:ny) = self%residual(1, 1:ny)
      self%residual(1:nx, 0) = self%residual(1:nx, ny)
      self%residual(1:nx, ny + 1) = self%residual(1:nx, 1)
   end subroutine fill_rim

   !> step = M residual on S, without its mean, without empty cells that it would empty further
   !> (they hold `huge`); the mean still to be taken off, and the product with the residual.
   subroutine precondition(self, problem, pressure, mean, rz)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: pressure(:, :)
      real(dp), intent(out) :: mean, rz
      real(dp), allocatable :: correction(:)
      real(dp) :: total, cells, product, residuals, wx, wy, centre
      integer :: i, j, k, jb

      wx = self%coarse%wx
      wy = self%coarse%wy
      centre = stencil_c0 + 2.0_dp*(wx + wy)
      call self%coarse%precondition()
      !$omp parallel default(none) shared(self, wx, wy, centre) &
      !$omp private(i, j, k, jb, total, cells, correction) num_threads(self%operator%threads)
      allocate (correction(self%grid%nx))
      !$omp do
      do jb = 1, self%coarse%ny
         correction(:) = self%coarse%correction(self%coarse%block_x, jb)
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            total = 0.0_dp
            cells = 0.0_dp
            do k = 1, self%runs(j)
               !$omp simd reduction(+:total, cells)
               do i = self%first(k, j), self%last(k, j)
                  self%step(i, j) = merge(centre*self%residual(i, j) &
                     - wx*(self%residual(i - 1, j) + self%residual(i + 1, j)) &
                     - wy*(self%residual(i, j - 1) + self%residual(i, j + 1)) &
                     + correction(i), 0.0_dp, abs(self%residual(i, j)) > 0.0_dp)
                  total = total + self%step(i, j)
                  cells = cells + merge(1.0_dp, 0.0_dp, abs(self%residual(i, j)) > 0.0_dp)
               end do
            end do
            self%rows(1, j) = total
            self%rows(2, j) = cells
         end do
      end do
      !$omp end parallel
      mean = 0.0_dp
      if (problem%control == control_pressure) &
         mean = row_sum(self, 1)/max(row_sum(self, 2), 1.0_dp)

      !$omp parallel do default(none) shared(self, pressure, mean) &
      !$omp private(i, j, k, total, cells, product, residuals) num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         total = 0.0_dp
         cells = 0.0_dp
         product = 0.0_dp
         residuals = 0.0_dp
         do k = 1, self%runs(j)
            !$omp simd reduction(+:total, cells, product, residuals)
            do i = self%first(k, j), self%last(k, j)
               if (abs(self%residual(i, j)) > 0.0_dp .and. &
                  (pressure(i, j) > 0.0_dp .or. self%step(i, j) > mean)) then
                  total = total + self%step(i, j)
                  cells = cells + 1.0_dp
                  product = product + self%residual(i, j)*self%step(i, j)
                  residuals = residuals + self%residual(i, j)
               else
                  self%step(i, j) = huge(1.0_dp)
               end if
            end do
         end do
         self%rows(1:4, j) = [total, cells, product, residuals]
      end do
      mean = 0.0_dp
      if (problem%control == control_pressure) &
         mean = row_sum(self, 1)/max(row_sum(self, 2), 1.0_dp)
      rz = row_sum(self, 3) - mean*row_sum(self, 4)
   end subroutine precondition

   !> direction = step - mean + beta direction on S, zero elsewhere; `offset` is the mean that the next
   !> pass takes off it. Without that mean: its product with the residual, its square, its block means.
   subroutine new_direction(self, problem, mean, beta, offset, rd, squares)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: mean, beta
      real(dp), intent(out) :: offset, rd, squares
      real(dp), allocatable :: inside(:)
      real(dp) :: total, cells, product, residuals, square
      integer :: i, j, k, jb

      !$omp parallel default(none) shared(self, mean, beta) &
      !$omp private(i, j, k, jb, total, cells, product, residuals, square, inside) &
      !$omp num_threads(self%operator%threads)
      allocate (inside(self%grid%nx))
      !$omp do
      do jb = 1, self%coarse%ny
         self%coarse%mean(:, jb) = 0.0_dp
         self%coarse%share(:, jb) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            total = 0.0_dp
            cells = 0.0_dp
            product = 0.0_dp
            residuals = 0.0_dp
            square = 0.0_dp
            do k = 1, self%runs(j)
               !$omp simd reduction(+:total, cells, product, residuals, square)
               do i = self%first(k, j), self%last(k, j)
                  inside(i) = merge(1.0_dp, 0.0_dp, self%step(i, j) < huge(1.0_dp))
                  self%direction(i, j) = merge(self%step(i, j) - mean + beta*self%direction(i, j), &
                     0.0_dp, self%step(i, j) < huge(1.0_dp))
                  total = total + self%direction(i, j)
                  cells = cells + inside(i)
                  product = product + self%residual(i, j)*self%direction(i, j)
                  residuals = residuals + self%residual(i, j)*inside(i)
                  square = square + self%direction(i, j)**2
               end do
               call self%coarse%add_means(jb, self%first(k, j), &
                  self%direction(self%first(k, j):self%last(k, j), j))
               call self%coarse%add_shares(jb, self%first(k, j), &
                  inside(self%first(k, j):self%last(k, j)))
            end do
            self%rows(1:5, j) = [total, cells, product, residuals, square]
         end do
      end do
      !$omp end parallel
      offset = 0.0_dp
      rd = row_sum(self, 3)
      squares = row_sum(self, 5)
      if (problem%control /= control_pressure) return
      total = row_sum(self, 1)
      cells = max(row_sum(self, 2), 1.0_dp)
      offset = total/cells
      rd = rd - offset*row_sum(self, 4)
      squares = squares - offset*total
      self%coarse%mean(:, :) = self%coarse%mean - offset*self%coarse%share
   end subroutine new_direction

   !> step = (P + alpha direction, put back on what is allowed) - P; whether anything was clipped, the
   !> slope of the energy along it, its square and block means, and the longest multiple allowed.
   subroutine clipped_step(self, problem, alpha, offset, pressure, gap, level, clipped, slope, &
      squares, limit)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: offset                 !! to be taken off the direction
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      real(dp), intent(in) :: level
      logical, intent(out) :: clipped
      real(dp), intent(out) :: slope, squares, limit
      real(dp) :: shift, next, total, cells, trial, longest, product, lowest
      integer :: i, j, k, jb

      !$omp parallel do default(none) shared(self, pressure, alpha, offset) &
      !$omp private(i, j, k, total, cells, trial, lowest) num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         total = 0.0_dp
         cells = 0.0_dp
         lowest = 0.0_dp
         do k = 1, self%runs(j)
            !$omp simd reduction(+:total, cells) reduction(min:lowest)
            do i = self%first(k, j), self%last(k, j)
               self%direction(i, j) = merge(self%direction(i, j) - offset, 0.0_dp, &
                  self%step(i, j) < huge(1.0_dp))
               trial = pressure(i, j) + alpha*self%direction(i, j)
               self%step(i, j) = trial
               total = total + max(trial, 0.0_dp)
               cells = cells + merge(1.0_dp, 0.0_dp, trial > 0.0_dp)
               lowest = min(lowest, trial)
            end do
         end do
         self%rows(1:3, j) = [total, cells, lowest]
      end do
      clipped = global_min(minval(self%rows(3, :))) < 0.0_dp
      shift = 0.0_dp
      if (problem%control == control_pressure .and. clipped) then
         do
            cells = row_sum(self, 2)
            if (cells < 1.0_dp) exit
            next = (row_sum(self, 1) - problem%target*self%grid%nx*self%grid%ny)/cells
            if (next <= shift) exit
            shift = next
            !$omp parallel do default(none) shared(self, shift) private(i, j, k, total, cells) &
            !$omp num_threads(self%operator%threads)
            do j = 1, self%grid%ny
               total = 0.0_dp
               cells = 0.0_dp
               do k = 1, self%runs(j)
                  !$omp simd reduction(+:total, cells)
                  do i = self%first(k, j), self%last(k, j)
                     total = total + merge(self%step(i, j), 0.0_dp, self%step(i, j) > shift)
                     cells = cells + merge(1.0_dp, 0.0_dp, self%step(i, j) > shift)
                  end do
               end do
               self%rows(1:2, j) = [total, cells]
            end do
         end do
      end if

      !$omp parallel do default(none) shared(self, pressure, gap, level, shift) &
      !$omp private(i, j, k, jb, total, product, longest) num_threads(self%operator%threads)
      do jb = 1, self%coarse%ny
         self%coarse%mean(:, jb) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            product = 0.0_dp
            total = 0.0_dp
            longest = huge(1.0_dp)
            do k = 1, self%runs(j)
               !$omp simd reduction(+:product, total) reduction(min:longest)
               do i = self%first(k, j), self%last(k, j)
                  self%step(i, j) = max(self%step(i, j) - shift, 0.0_dp) - pressure(i, j)
                  product = product - (gap(i, j) - level)*self%step(i, j)
                  total = total + self%step(i, j)**2
                  longest = min(longest, merge(-pressure(i, j)/min(self%step(i, j), -tiny(1.0_dp)), &
                     huge(1.0_dp), self%step(i, j) < 0.0_dp))
               end do
               call self%coarse%add_means(jb, self%first(k, j), &
                  self%step(self%first(k, j):self%last(k, j), j))
            end do
            self%rows(1:3, j) = [product, total, longest]
         end do
      end do
      slope = row_sum(self, 1)
      squares = row_sum(self, 2)
      limit = global_min(minval(self%rows(3, :)))
   end subroutine clipped_step

   !> Transform the step and multiply by the operator; step.A step.
   subroutine transform_step(self, form)
      type(normal_solver_type), intent(inout) :: self
      real(dp), intent(out) :: form
      integer :: j

      !$omp parallel do default(none) shared(self) private(j) num_threads(self%operator%threads) &
      !$omp schedule(dynamic, 8)
      do j = 1, self%grid%ny
         if (self%runs(j) == 0) then
            call self%operator%forward_zero_row(1, j)
         else
            call self%operator%forward_row(1, j, self%step(:, j))
         end if
      end do
      call self%operator%columns(columns_apply, form)
   end subroutine transform_step

   !> P = P + alpha step, gap = gap + factor A step, and the survey of the new state.
   subroutine update(self, problem, factor, alpha, pressure, gap)
      type(normal_solver_type), intent(inout) :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: factor, alpha
      real(dp), intent(inout) :: pressure(:, :), gap(:, :)
      integer :: i, j, k

      !$omp parallel do default(none) shared(self, problem, factor, alpha, pressure, gap) &
      !$omp private(i, j, k) num_threads(self%operator%threads)
      do j = 1, self%grid%ny
         call self%operator%add_backward_row(1, j, factor, gap(:, j))
         do k = 1, self%runs(j)
            !$omp simd
            do i = self%first(k, j), self%last(k, j)
               ! Round-off may not leave a trace where the step empties a cell.
               pressure(i, j) = max(pressure(i, j) + alpha*self%step(i, j), 0.0_dp)
            end do
         end do
         call survey_row(self, problem, .false., j, pressure(:, j), gap(:, j))
      end do
   end subroutine update

   !> Subtract the level.
   subroutine shift_gap(self, level, gap)
      type(normal_solver_type), intent(in) :: self
      real(dp), intent(in) :: level
      real(dp), intent(inout) :: gap(:, :)
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
      call self%coarse%destroy()
   end subroutine destroy

end module normal_cg
