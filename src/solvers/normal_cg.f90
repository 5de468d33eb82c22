!> Normal contact without adhesion: P >= 0, gap >= 0, P gap = 0.
!>
!> The method is projected conjugate gradients for the pressure P on a rigid rough surface H:
!>     minimise  c/2 (P + P_h).A(P + P_h) - P.H,   P >= 0,   mean(P) given or the approach given,
!> where A is the operator for a shear modulus of 1, c = 1/modulus, and P_h the traction of the past of a viscoelastic
!> material, which is zero for an elastic one. The method is that of Polonsky and Keer (1999), with these differences:
!> * the exact projection on {P >= 0, sum P = load} instead of a rescaling;
!> * the direction kept through changes of the contact set (Fletcher-Reeves, and Polak-Ribiere where that loses the
!>   conjugacy of the directions);
!> * a preconditioner whose symbol is about |q|, with the wave number q; it consists of a local stencil and block means,
!>   and the residual is extended outside the contact for it (module `schur_preconditioner`);
!> * cells in which the step would make the pressure negative are released from the contact before the step, and the
!>   step of the other cells takes this into account (module `schur_release`), on long, free and very large grids several times;
!> * a step length that the preconditioner knows, so that the projected step s is known before the transform, and an
!>   iteration always takes two transforms;
!> * passes over active blocks of 16 cells only, except the one that updates the gap.
!> The method of the thesis (2.1.2) is in module `normal_cg_thesis`.
!>
!> An iteration measures the error, chooses a direction d, releases the cells in which P + alpha d is negative, projects
!> P + alpha d on the admissible pressures, which gives a step s, and adds the multiple of s to P that minimises the
!> energy, or the whole s where it was clipped and this lowers the energy, too. Module `normal_iteration` chooses the
!> direction and the step.
!>
!> On a large grid, a solve without a given start, or with one for another load, first solves the same problem roughly on
!> about a quarter of the cells along each side, whose means of the height are a smoother road, and starts from that
!> pressure (nested iteration). From 10 million cells on a third grid lies between them, if the contact is not sparse.
!>
!> The solve has converged if the duality gap e1 = (mean gap weighted by the pressure - least gap)/h_rms and the
!> error of the load are below the tolerance. If the contact is small on a tall
!> map, a smaller scale than h_rms is used (`narrow_scale` of module `normal_state`).
!>
!> In mixed precision the products A s of the steps are in single precision, because their errors are small
!> compared with s. The pressure and the gap remain in double precision. Module `gap_watch` decides when the gap
!> is computed again from the pressure in double precision, which always precedes the end of a solve in mixed
!> precision, and when single precision is no longer useful.
!>
!> Memory, in fields of doubles: 6.6 in periodic mode. These are H, P and gap; four fields in single precision (the
!> direction, and three fields of the preconditioner: the residual, the residual of the iteration before, and the search
!> direction); the operator's spectrum, whose memory is also used for two more fields of the preconditioner and, in mixed
!> precision, for the spectrum in single precision; a quarter for the operator's symbol (an eighth in mixed precision);
!> and 0.4 for blocks and the coarse level. The two residuals take memory only near the contact. In free mode
!> spectrum and symbol take three (three and a half in mixed precision). A start from a coarser grid takes 0.7 more until it
!> is found, and 2.0 with a grid between the two.
module normal_cg
   use coarse_fields, only : coarse_grid, coarsen, refine_pressure
   use contact_solver, only : check_normal_kernel, contact_solver_type
   use asperity_errors, only : error_type
   use field_sums, only : field_count, field_mean, field_rms
   use finite_fields, only : reject_overflow
   use fft_conv, only : convolution_type, new_convolution
   use gap_watch, only : gap_watch_type, new_gap_watch
   use normal_iteration, only : choose_direction, choose_step, end_loop, iteration_type, &
      phase_conjugate, phase_ended, phase_restart, sparse
   use normal_passes, only : as_formed, new_normal_work, normal_work_type, survey, update_state
   use normal_state, only : combine_measures, control_approach, control_pressure, evaluate_gap, fault_of_problem, &
      first_pressure, gap_measure_type, narrow_scale, normal_problem_type, prepare_problem, reason_undetermined, &
      remove_round_off, return_solution
   use normal_sums, only : total
   use omp_lib, only : omp_get_wtime
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use projection, only : project_simplex
   use regular_grid, only : boundary_periodic, grid_type, large_grid
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: new_normal_solver, normal_solver_type

   ! The start from a coarser grid.
   real(dp), parameter :: least_roughness = 0.9_dp    !! rms height of the coarser road over that of the road
   real(dp), parameter :: few_overlap = 8.0_dp        !! coarse cells that a given approach brings into overlap
   real(dp), parameter :: rough_tolerance = 1e-2_dp   !! of its solution: the details belong to the finer grid
   integer, parameter :: most_rough_iterations = 30
   real(dp), parameter :: far_load = 0.05_dp          !! change of the load for which a given start is no better
   real(dp), parameter :: nearly_full = 0.9_dp        !! contact area from which that of full contact is the better start

   !> The solver with its operators and work fields, kept from step to step. A variable of this type must not be
   !> copied.
   type, extends(contact_solver_type) :: normal_solver_type
      logical :: mixed = .false.                      !! products of steps in single precision
      real(dp) :: coarse_start_from = 4e4_dp          !! cells from which a solve without a start begins on a coarser grid
      real(dp) :: replace_start_from = 5e5_dp         !! the same for a solve with a start that is far away
      real(dp) :: between_from = large_grid           !! the same for a grid between this one and the coarser one
      type(convolution_type) :: quick                 !! A in single precision, if mixed
      type(normal_work_type), private :: work
   contains
      procedure :: solve
      procedure, private :: start_on_coarse_grid, solve_roughly
      procedure :: destroy
   end type normal_solver_type

contains

   !> Make a solver for a grid.
   subroutine new_normal_solver(self, grid, kernel, error, mixed)
      type(normal_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: mixed           !! in mixed precision

      self%grid = grid
      if (present(mixed)) self%mixed = mixed
      call check_normal_kernel(kernel, error)
      call new_convolution(self%operator, grid, kernel, error, lean=self%mixed)
      if (self%mixed) call new_convolution(self%quick, grid, kernel, error, single=.true., &
         memory=self%operator%spectrum_memory())
      if (.not. allocated(error)) call new_normal_work(self%work, self%operator, error)
   end subroutine new_normal_solver

   !> Solve a contact problem by the fast method. It is recursive because the start may be a solution on a coarser grid.
   recursive subroutine solve(self, problem, height, pressure, gap, level, outcome, past)
      class(normal_solver_type), intent(inout), target :: self
      type(normal_problem_type), intent(in) :: problem
      real(dp), contiguous, intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), contiguous, intent(inout) :: pressure(:, :)        !! P, Pa; a start where problem%warm
      real(dp), contiguous, intent(inout) :: gap(:, :)             !! U - H - level, m
      real(dp), intent(out) :: level                   !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: past(:, :)  !! P_h, Pa
      type(normal_problem_type) :: task                !! the problem, completed for its fields
      type(gap_measure_type) :: measure
      type(gap_watch_type) :: watch
      type(iteration_type) :: now
      type(convolution_type), pointer :: product       !! the operator for the products of steps
      real(dp) :: cells, began, before, effort
      logical :: determined

      level = 0.0_dp
      call outcome%refuse(fault_of_problem(problem, self%grid, height, pressure, gap, past))
      if (outcome%reason /= '') return
      call start_solve()
      do
         call measure_state()
         if (now%phase == phase_ended) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return
         outcome%iterations = outcome%iterations + 1
         call choose_direction(self%work, task, measure, pressure, gap, now)
         call choose_step(self%work, product, task, measure, pressure, gap, now)
         if (now%alpha > 0.0_dp) then
            call update_state(self%work, product, task%target, now%alpha, task%modulus, pressure, gap)
            call watch%note_step()
         end if
      end do
      call finish_solve()

   contains

      !> Compute the first pressure and its gap.
      subroutine start_solve()
         began = omp_get_wtime()
         before = transforms(self)
         cells = self%grid%cells()
         call prepare_problem(problem, self%grid, self%operator%threads, height, task, determined)
         effort = 0.0_dp
         if (determined) call self%start_on_coarse_grid(task, height, pressure, effort, past)
         associate (fields => self%work%preconditioner)
            call self%work%active%clear(fields%residual, self%work%direction(:, :, as_formed), fields%search, fields%before)
         end associate
         self%work%scale = 0.0_dp
         self%work%offset = 0.0_dp
         call new_gap_watch(watch, self%mixed, task%tolerance)
         product => self%operator
         if (watch%single) product => self%quick
         call first_pressure(task, self%grid, product, height, pressure, past)
         if (task%warm .and. task%displaced) then
            call use_given_displacement()
         else
            call compute_gap()
         end if
         if (.not. determined) call end_loop(now, reason_undetermined)
      end subroutine start_solve

      !> Compute the error of the present state, with a new gap if the sums are not accurate enough, and find the
      !> active blocks. The loop ends if the problem is solved.
      subroutine measure_state()
         logical :: drifted

         if (now%phase == phase_ended) return
         measure = combine_measures(task, cells, total(self%work%state))
         call compare_with_scale()
         call watch%note_error(measure%error, task%tolerance*task%scale/task%rms_height)
         if (watch%is_due(measure%strict <= task%tolerance)) then
            call watch%expect(measure%error)
            call compute_gap()
            call compare_with_scale()
         end if
         if (measure%strict <= task%tolerance) then
            now%phase = phase_ended
            return
         end if
         call watch%judge(measure%error, drifted)
         if (drifted .and. now%phase == phase_conjugate) now%phase = phase_restart
         if (.not. watch%single) product => self%operator
         if (outcome%iterations >= problem%max_iterations) now%phase = phase_ended
         associate (work => self%work)
            if (work%scale <= 0.0_dp) work%scale = unit_of(measure%duality_gap, task%rms_height)
            work%preconditioner%per_pressure = work%preconditioner%compliance*work%scale/task%modulus
            call work%active%list_runs(measure%level, work%preconditioner%residual, work%direction(:, :, as_formed), &
               work%preconditioner%before)
            call work%active%list_wide_runs(work%preconditioner%search)
         end associate
      end subroutine measure_state

      !> If the state seems to be solved, compare its error with the scale that belongs to it.
      subroutine compare_with_scale()
         if (measure%strict <= task%tolerance) &
            call narrow_scale(task, height, pressure, self%operator%threads, measure)
      end subroutine compare_with_scale

      !> Compute the gap by a product of the whole pressure, and measure it.
      subroutine compute_gap()
         call evaluate_gap(task, self%operator, height, pressure, gap, past)
         call measure_gap_now()
         call watch%note_fresh()
      end subroutine compute_gap

      !> Compute the gap from the displacement that the caller has given, and measure it.
      subroutine use_given_displacement()
         integer :: j

         !$omp parallel do default(none) shared(gap, height, task) private(j) num_threads(self%operator%threads)
         do j = 1, self%grid%rows()
            gap(:, j) = gap(:, j) + (task%datum - height(:, j))
         end do
         call measure_gap_now()
      end subroutine use_given_displacement

      !> Measure the present gap.
      subroutine measure_gap_now()
         call survey(self%work, task%target, pressure, gap)
         measure = combine_measures(task, cells, total(self%work%state))
      end subroutine measure_gap_now

      !> Measure the result with a new gap.
      subroutine finish_solve()
         if (.not. watch%proves()) call compute_gap()
         if (determined .and. measure%load_error > task%tolerance) then
            ! A step whose round-off exceeds the load leaves a wrong load: project the whole pressure.
            call project_simplex(pressure, task%target*cells)
            call compute_gap()
         end if
         outcome%reason = now%reason
         call remove_round_off(measure, self%grid%cells(), self%operator%threads, pressure, gap)
         call return_solution(problem, task, measure, determined, self%operator%threads, gap, level, outcome)
         call reject_overflow(outcome, pressure, gap, self%operator%threads)
         ! A transform of the coarse level counts as a fraction. The small addition keeps the round-off of earlier counts
         ! from deciding how a half is rounded.
         outcome%ffts = nint(transforms(self) - before + effort + 1e-6_dp, int64)
         outcome%seconds = omp_get_wtime() - began
      end subroutine finish_solve

   end subroutine solve

   !> Replace a start that is missing, or on a large grid one that is far away, by the pressure of a rough solution on a
   !> coarser grid, if that is worth the effort. On a large grid whose contact is not sparse, a grid between the two
   !> follows. Without it regions of many coarse cells swing between contact and none in several iterations of the large
   !> grid.
   recursive subroutine start_on_coarse_grid(self, task, height, pressure, effort, past)
      class(normal_solver_type), intent(in) :: self
      type(normal_problem_type), intent(inout) :: task
      real(dp), intent(in) :: height(:, :)                 !! H, m
      real(dp), intent(inout) :: pressure(:, :)            !! Pa
      real(dp), intent(out) :: effort                      !! in transforms of the size of the grid
      real(dp), intent(in), optional :: past(:, :)         !! P_h, Pa
      type(grid_type) :: coarse, between
      real(dp), allocatable :: rough(:, :), better(:, :)
      logical :: useful

      effort = 0.0_dp
      if (self%grid%cells() < self%coarse_start_from) return
      if (task%control == control_pressure .and. task%target <= 0.0_dp) return
      if (task%warm .and. self%grid%cells() < self%replace_start_from) return
      if (task%warm .and. .not. is_far(task, pressure)) return
      task%warm = .false.
      task%displaced = .false.
      coarse = coarse_grid(self%grid)
      allocate (rough(coarse%nx, coarse%rows()))
      call self%solve_roughly(coarse, task, height, rough, effort, useful, past)
      if (.not. useful) return
      task%warm = .true.

      if (self%grid%cells() >= self%between_from .and. field_count(rough > 0.0_dp) > sparse*coarse%cells()) then
         between = coarse_grid(self%grid, ratio=2)
         allocate (better(between%nx, between%rows()))
         call refine_pressure(coarse, between, rough, self%operator%threads, better)
         call self%solve_roughly(between, task, height, better, effort, useful, past)
         if (useful) then
            coarse = between
            call move_alloc(better, rough)
         end if
      end if
      call refine_pressure(coarse, self%grid, rough, self%operator%threads, pressure)
   end subroutine start_on_coarse_grid

   !> Would a start without the given one be better? If the load has changed much, it would. At a given approach the change
   !> of the load is not known.
   logical function is_far(task, pressure)
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: pressure(:, :)               !! Pa

      is_far = .false.
      if (task%control == control_pressure) &
         is_far = abs(field_mean(pressure) - task%target) > far_load*task%target
   end function is_far

   !> Solve a problem roughly on a coarser grid, whose road and past are means of those of the grid. The start is
   !> `pressure` where task%warm. There is no useful solution if the coarser road is much smoother.
   recursive subroutine solve_roughly(self, coarse, task, height, pressure, effort, useful, past)
      class(normal_solver_type), intent(in) :: self
      type(grid_type), intent(in) :: coarse
      type(normal_problem_type), intent(in) :: task        !! the problem of this solver's grid
      real(dp), intent(in) :: height(:, :)                 !! H, m
      real(dp), intent(inout) :: pressure(:, :)            !! Pa, on the coarser grid
      real(dp), intent(inout) :: effort                    !! is increased, in transforms of the size of this solver's grid
      logical, intent(out) :: useful                       !! the pressure is a good start
      real(dp), intent(in), optional :: past(:, :)         !! P_h, Pa
      type(normal_solver_type) :: solver
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: road(:, :), memory(:, :), gap(:, :)
      real(dp) :: level

      useful = .false.
      allocate (road, mold=pressure)
      call coarsen(self%grid, coarse, height, self%operator%threads, road)
      if (field_rms(road, field_mean(road)) < least_roughness*task%rms_height) return
      if (task%control == control_approach .and. field_count(road + (task%target - task%datum) > 0.0_dp) < few_overlap) return
      if (present(past)) then
         allocate (memory, mold=road)
         call coarsen(self%grid, coarse, past, self%operator%threads, memory)
      end if

      call new_normal_solver(solver, coarse, self%work%coarse%kernel, error, self%mixed)
      if (allocated(error)) return
      solver%coarse_start_from = huge(1.0_dp)
      problem = task
      if (task%control == control_approach) problem%target = task%target - task%datum
      problem%rms_height = 0.0_dp
      problem%tolerance = max(rough_tolerance, task%tolerance)
      problem%max_iterations = min(most_rough_iterations, task%max_iterations)
      allocate (gap, mold=road)
      call solver%solve(problem, road, pressure, gap, level, outcome, memory)
      call solver%destroy()
      effort = effort + outcome%ffts*coarse%cells()/self%grid%cells()
      useful = outcome%converged
      if (coarse%boundary == boundary_periodic) useful = useful .and. field_count(pressure > 0.0_dp) < nearly_full*coarse%cells()
   end subroutine solve_roughly

   !> Transforms done so far. Those of the coarse level count by their number of cells.
   pure function transforms(self) result(count)
      type(normal_solver_type), intent(in) :: self
      real(dp) :: count

      count = real(self%operator%ffts + self%quick%ffts, dp) + self%work%coarse%transforms() &
         + self%work%preconditioner%transforms()
   end function transforms

   !> The inverse of the power of two above a length, or above another length if the first one is 0.
   pure function unit_of(length, other) result(unit)
      real(dp), intent(in) :: length, other
      real(dp) :: unit

      unit = 1.0_dp
      if (length > 0.0_dp .and. length <= huge(length)) then
         unit = scale(1.0_dp, -exponent(length))
      else if (other > 0.0_dp .and. other <= huge(other)) then
         unit = scale(1.0_dp, -exponent(other))
      end if
   end function unit_of

   !> Free plans and memory.
   subroutine destroy(self)
      class(normal_solver_type), intent(inout) :: self

      call self%operator%destroy()
      if (self%mixed) call self%quick%destroy()
      call self%work%coarse%destroy()
      call self%work%preconditioner%destroy()
   end subroutine destroy

end module normal_cg
