!> Normal contact in steady sliding: P >= 0, gap = K P - H - level >= 0, P gap = 0, mean P given.
!>
!> K is the operator whose complex symbol module `steady_symbols` computes. It is not symmetric. There is therefore no
!> energy to minimise, and conjugate gradients do not apply. It is monotone, because a rubber loses energy. The
!> Douglas-Rachford splitting of Lions and Mercier (1979) then converges from any start and for any c > 0:
!>
!>     P = nearest field to z with P >= 0 and the prescribed mean    (module projection)
!>     y = (1 + c K)^-1 (2 P - z + c H)                              diagonal in Fourier space
!>     z <- z + (y - P)
!>
!> At the fixed point z is P in contact and -c gap elsewhere, up to a constant. Module `steady_scale` therefore chooses c
!> so that both parts of z have about the same size. Anderson acceleration makes it five to ten times faster. Near the
!> solution, Newton's method on the cells in contact may be faster still (modules `steady_active` and `steady_newton`).
!> From a distant start it fails on materials whose modulus spans three decades. There, and where the splitting is slow, as
!> on flat tops in slow sliding, proximal steps take over (module `steady_proximal`).
!>
!> The criterion of convergence is that of module `normal_cg`: the duality gap e1 of a fresh U = K P, divided by the rms
!> height or by a smaller scale if the contact is small, and the error of the load.
!>
!> Memory: four fields of doubles (z, its residual, P and the best P), eight for the acceleration, and what
!> `steady_operator` takes.
module steady_normal
   use anderson, only : anderson_type, new_anderson
   use normal_state, only : gap_measure_type, measure_gap, narrow_scale, normal_problem_type, &
      prepare_problem, reason_converged, reason_iterations
   use asperity_precision, only : dp, int64
   use field_sums, only : field_count, field_mean, field_minimum, field_sum
   use projection, only : project_simplex
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   use steady_active, only : finish_on_contact, worthwhile
   use steady_newton, only : finish_by_newton, first_near, promising
   use steady_proximal, only : pays, solve_by_steps
   use steady_measure, only : measure_evaluation, steady_measure_type
   use steady_operator, only : steady_operator_type
   use steady_scale, only : bounded_scale, fitting_scale, is_time_to_rescale, largest_misfit, misfit
   implicit none
   private

   public :: new_steady_normal, steady_normal_type

   integer, parameter :: pairs = 6               !! of the acceleration
   integer, parameter :: first_trial = 16        !! iteration at which finishing on few cells is first tried
   integer, parameter :: soon = 1000             !! transforms after which a dense system counts as one that will soon be cheap
   real(dp), parameter :: cautious = 2.0_dp      !! factor of growth of the residual after which a step is plain
   real(dp), parameter :: forgetting = 1.02_dp   !! by which the residual that later ones are compared to grows per step
   real(dp), parameter :: clearly_less = 0.7_dp  !! part of the least error so far below which a pressure is kept

   !> The progress of a solve.
   type :: progress_type
      type(steady_measure_type) :: measure       !! of the present state
      real(dp) :: least = huge(1.0_dp)           !! least error so far
      real(dp) :: reference = huge(1.0_dp)       !! residual that later ones are compared to, Pa
      integer :: checks = 0                      !! times that the error was within the tolerance
      real(dp) :: near = first_near              !! largest error from which Newton's method is tried
      integer :: trial = first_trial             !! iteration at which finishing on few cells is tried next
      logical :: stepped = .false.               !! proximal steps have been tried
      integer(int64) :: ffts_before = 0          !! of the operator, before the solve
   end type progress_type

   !> Work fields. A variable of this type must not be copied.
   type :: steady_normal_type
      type(grid_type) :: grid
      real(dp) :: c = 0.0_dp                            !! Pa/m
      real(dp), allocatable :: z(:, :)                  !! state of the iteration, Pa
      real(dp), allocatable :: pressure(:, :)           !! P of z, Pa
      real(dp), allocatable :: residual(:, :)           !! y - P, Pa
      real(dp), allocatable, private :: best(:, :)      !! P with the least error so far, Pa
      type(anderson_type), private :: memory
   contains
      procedure :: solve
      procedure :: start
      procedure :: evaluate
      procedure :: rescale
      procedure :: take_scale
   end type steady_normal_type

contains

   !> Allocate the work fields.
   subroutine new_steady_normal(self, grid)
      type(steady_normal_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer :: rows

      self%grid = grid
      rows = grid%rows()
      allocate (self%z(grid%nx, rows), self%pressure(grid%nx, rows), self%residual(grid%nx, rows), &
         self%best(grid%nx, rows), source=0.0_dp)
      call new_anderson(self%memory, grid%nx, 1, rows, pairs)
   end subroutine new_steady_normal

   !> Solve the contact with a road. If the iteration does not converge, the outcome says so, and the result is the
   !> pressure with the least error.
   subroutine solve(self, operator, problem, height, pressure, gap, level, outcome)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator    !! with its symbols set
      type(normal_problem_type), intent(in) :: problem         !! warm: pressure and gap are a start
      real(dp), intent(in), contiguous :: height(:, :)         !! H, m
      real(dp), intent(inout), contiguous :: pressure(:, :)    !! P, Pa
      real(dp), intent(inout), contiguous :: gap(:, :)         !! U - H - level, m
      real(dp), intent(out) :: level                           !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      type(normal_problem_type) :: task
      type(gap_measure_type) :: found
      type(progress_type) :: progress
      real(dp) :: mean
      logical :: determined

      progress%ffts_before = operator%ffts
      call prepare_problem(problem, self%grid, operator%threads, height, task, determined)
      task%datum = 0.0_dp          ! gaps are U - H here; heights are not measured from another level
      mean = field_mean(height)
      call self%start(operator, task, height, pressure, gap)
      outcome%reason = reason_iterations
      do
         call self%evaluate(operator, task, height, mean, self%z, progress%measure)
         outcome%iterations = outcome%iterations + 1
         call judge(self, operator, task, height, progress, gap, found, outcome)
         if (outcome%converged .or. outcome%iterations >= task%max_iterations) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return

         call advance(self, operator, task, outcome%iterations, progress)
      end do
      if (.not. outcome%converged) then
         self%pressure(:, :) = self%best
         call check(self, operator, task, height, gap, found)
         outcome%converged = found%strict <= task%tolerance
         if (outcome%converged) outcome%reason = reason_converged
      end if
      pressure(:, :) = self%pressure
      level = found%level
      gap(:, :) = gap - level
      outcome%residual = found%error
      outcome%load_error = found%load_error
      outcome%ffts = operator%ffts - progress%ffts_before
   end subroutine solve

   !> Decide whether the present pressure is the solution. The error of an evaluation is a cheap estimate; if it is
   !> small, the pressure is checked. From time to time a direct solution on the cells in contact is tried. The
   !> best pressure so far is kept.
   subroutine judge(self, operator, task, height, progress, gap, found, outcome)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(inout) :: task
      real(dp), intent(in) :: height(:, :)
      type(progress_type), intent(inout) :: progress           !! with the measure of the pressure
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(inout) :: found
      type(solver_result_type), intent(inout) :: outcome       !! converged, and the reason
      real(dp) :: scale

      if (progress%measure%error <= task%tolerance) then
         if (mod(progress%checks, 4) == 0) then
            scale = task%scale
            call check(self, operator, task, height, gap, found)
            ! Errors are relative to the scale, which the check may have changed.
            progress%least = progress%least*(scale/task%scale)
            outcome%converged = found%strict <= task%tolerance
         end if
         progress%checks = progress%checks + 1
      end if
      if (progress%measure%error < clearly_less*progress%least) then
         progress%least = progress%measure%error
         self%best(:, :) = self%pressure
      end if
      if (.not. outcome%converged .and. outcome%iterations >= progress%trial) &
         call try_newton(self, operator, task, height, progress, gap, found, outcome)
      if (outcome%converged) outcome%reason = reason_converged
   end subroutine judge

   !> Try a method that solves for all cells in contact, if it may be faster than the splitting. Its pressure is taken
   !> if it is the solution, and kept if it is better than the best so far.
   subroutine try_newton(self, operator, task, height, progress, gap, found, outcome)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      type(progress_type), intent(inout) :: progress
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(inout) :: found
      type(solver_result_type), intent(inout) :: outcome       !! its iterations; out: converged
      real(dp) :: touching
      logical :: dense

      touching = field_count(self%pressure > 0.0_dp)
      dense = worthwhile(0.5_dp*touching, self%grid%cells(), soon)
      associate (error => progress%measure%error, n => outcome%iterations)
         if (worthwhile(touching, self%grid%cells(), int(operator%ffts - progress%ffts_before))) then
            progress%trial = n + n/2
            call finish_on_contact(operator, task, height, self%pressure, gap, found, outcome%converged)
         else if (promising(n, error, progress%near, task%tolerance)) then
            progress%trial = n + n/4
            call finish_by_newton(operator, task, height, progress%near, self%pressure, gap, found, outcome%converged)
         end if
         if (outcome%converged .or. progress%stepped) return
         if (.not. pays(n, progress%least, task%tolerance, dense)) return
      end associate

      progress%stepped = .true.
      call solve_by_steps(operator, task, height, self%best, gap, found)
      call operator%set_scale(self%c)
      progress%least = min(progress%least, found%error)
      outcome%converged = found%strict <= task%tolerance
      if (outcome%converged) self%pressure(:, :) = self%best
   end subroutine try_newton

   !> Compute the next z by an accelerated step, by a plain one if the residual has grown, or with another c.
   subroutine advance(self, operator, task, iteration, progress)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      integer, intent(in) :: iteration
      type(progress_type), intent(inout) :: progress

      if (is_time_to_rescale(iteration) .and. misfit(progress%measure%scale, self%c) > largest_misfit) then
         self%z = self%z + self%residual
         call self%take_scale(operator, task, progress%measure%scale)
         progress%reference = huge(1.0_dp)
      else
         call self%memory%step([1.0_dp], self%residual, self%z, &
            plain=progress%measure%change > cautious*progress%reference)
         progress%reference = min(progress%measure%change, forgetting*progress%reference)
      end if
   end subroutine advance

   !> Make the first state from the given pressure and gap, or from the road alone.
   subroutine start(self, operator, task, height, pressure, gap)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :), gap(:, :)
      real(dp) :: level, scale

      call self%memory%forget()
      if (.not. task%warm .or. is_full_contact(self, operator, task, height, pressure)) then
         ! The pressure of full contact, made admissible, is a good start for any load.
         call operator%press(height, pressure)
         pressure = pressure + task%target
         call project_simplex(pressure, task%target*self%grid%cells())
         call operator%displace(pressure, gap)
         gap = gap - height
      end if
      level = field_sum(merge(gap, 0.0_dp, pressure > 0.0_dp)) &
         /max(field_count(pressure > 0.0_dp), 1.0_dp)
      self%c = 1.0_dp/operator%largest_compliance
      scale = fitting_scale(pressure, gap - level)
      if (scale > 0.0_dp) self%c = bounded_scale(operator, scale)
      call operator%set_scale(self%c)
      where (pressure > 0.0_dp)
         self%z = pressure
      else where
         self%z = -self%c*max(gap - level, 0.0_dp)
      end where
      ! At the solution z has the mean of P. The start gets this mean by a shift of z and not of P, because open cells
      ! then keep their gaps and stay open.
      self%z = self%z + (task%target - field_mean(self%z))
      pressure(:, :) = self%z
      call project_simplex(pressure, task%target*self%grid%cells())
   end subroutine start

   !> Is the solution full contact? A given start, such as the state that is extrapolated from those of other loads and
   !> speeds, may be far from it. The test is made only if most cells of the start touch, because it takes two
   !> transforms.
   function is_full_contact(self, operator, task, height, pressure) result(yes)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: pressure(:, :)
      logical :: yes

      yes = field_count(pressure > 0.0_dp) > 0.5_dp*self%grid%cells()
      if (.not. yes) return
      call operator%press(height, self%z)
      yes = field_minimum(self%z) + task%target >= 0.0_dp
   end function is_full_contact

   !> Evaluate the map at z: compute P and the residual y - P, and measure how far they are from a solution.
   subroutine evaluate(self, operator, task, height, mean, z, measure)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: mean                     !! of the height, m
      real(dp), intent(in) :: z(:, :)
      type(steady_measure_type), intent(out) :: measure
      integer :: j

      self%pressure(:, :) = z
      call project_simplex(self%pressure, task%target*self%grid%cells())
      !$omp parallel do default(none) shared(self, height, mean, z) private(j) &
      !$omp num_threads(operator%threads)
      do j = 1, self%grid%rows()
         self%residual(:, j) = 2.0_dp*self%pressure(:, j) - z(:, j) + self%c*(height(:, j) - mean)
      end do
      call operator%resolve(self%residual, self%residual)
      call measure_evaluation(operator, self%c, self%pressure, z, self%residual, measure)
      measure%error = measure%error/task%scale
   end subroutine evaluate

   !> Change c if it differs much from one that fits. z is adjusted so that it represents the same pressure and gap,
   !> and the acceleration discards its differences.
   subroutine rescale(self, operator, task, scale, changed)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: scale
      logical, intent(out) :: changed

      changed = misfit(scale, self%c) > largest_misfit
      if (changed) call self%take_scale(operator, task, scale)
   end subroutine rescale

   !> Change c, and adjust the state z: its negative part is -c gap.
   subroutine take_scale(self, operator, task, scale)
      class(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: scale

      self%pressure(:, :) = self%z
      call project_simplex(self%pressure, task%target*self%grid%cells())
      self%z = self%pressure + (scale/self%c)*(self%z - self%pressure)
      self%c = scale
      call operator%set_scale(self%c)
      call self%memory%forget()
   end subroutine take_scale

   !> Compute the error of the present pressure from a new product U = K P. The gap is U - H.
   subroutine check(self, operator, task, height, gap, found)
      type(steady_normal_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(inout) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found

      call operator%displace(self%pressure, gap)
      gap = gap - height
      found = measure_gap(task, self%pressure, gap, operator%threads)
      if (found%error <= task%tolerance) &
         call narrow_scale(task, height, self%pressure, operator%threads, found)
   end subroutine check

end module steady_normal
