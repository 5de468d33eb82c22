!> The parts that all methods for normal contact share: the problem, the start, the gap, and the error measure.
module normal_state
   use fft_conv, only : columns_apply, convolution_type
   use field_sums, only : cell_count, field_mean, field_rms, largest_of_rows, least_of_rows, &
      row_product, row_total
   use asperity_precision, only : dp, pi
   use normal_sums, only : state_sums_type, total
   use normal_sweeps, only : count_cells_below, measure_cells
   use projection, only : project_simplex
   use solver_result, only : reason_converged, reason_iterations, reason_shape, reason_undetermined, reason_unmade, &
      solver_result_type
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: combine_measures, evaluate_gap, fault_of_problem, first_pressure, gap_measure_type, return_solution, &
      measure_gap, narrow_scale, normal_problem_type, prepare_problem, reason_converged, reason_iterations, &
      reason_undetermined, remove_round_off

   integer, parameter, public :: control_pressure = 1   !! the mean pressure is prescribed
   integer, parameter, public :: control_approach = 2   !! U - H where the gap is zero is prescribed

   real(dp), parameter :: round_off = 256.0_dp*epsilon(1.0_dp)   !! of a pressure, over the mean one in the contact
   !> Cell sides in the displacement of round-off on a periodic grid: well above the errors of random grids under loads far
   !> above full contact.
   real(dp), parameter :: cell_sides = 16.0_dp
   real(dp), parameter :: shallow = 10.0_dp             !! largest scale over the displacement under the load

   !> A normal contact problem without its fields.
   type :: normal_problem_type
      real(dp) :: modulus = 1.0_dp          !! shear modulus of the step (Q of module zener), Pa
      integer :: control = control_pressure
      real(dp) :: target = 0.0_dp           !! mean pressure, Pa, or the level U - H, m
      real(dp) :: tolerance = 1e-6_dp       !! of the duality gap and of the load
      real(dp) :: accepted = 0.0_dp         !! if larger: what suffices where the tolerance cannot be reached
      integer :: max_iterations = 1000
      logical :: warm = .false.             !! the given pressure is a start
      logical :: displaced = .false.        !! the given gap holds the displacement U of that start
      real(dp) :: rms_height = 0.0_dp       !! of H about its mean, m; 0: not known yet
      real(dp) :: datum = 0.0_dp            !! highest point of H; set here, m
      real(dp) :: scale = 0.0_dp            !! height to which the duality gap is compared; set here, m
      real(dp) :: least_scale = 0.0_dp      !! the least such height that round-off allows; set here, m
   end type normal_problem_type

   !> The distance of a state from the solution.
   type :: gap_measure_type
      real(dp) :: level = 0.0_dp            !! mean of U - H + datum over P > 0, or the prescribed one, m
      real(dp) :: weighted_level = 0.0_dp   !! mean of U - H + datum weighted by P, or the prescribed one, m
      real(dp) :: reached = 0.0_dp          !! mean of U - H + datum weighted by P, m; 0 without load
      real(dp) :: load = 0.0_dp             !! sum of P over the cells, Pa
      real(dp) :: contact = 0.0_dp          !! part of the cells with P > 0
      real(dp) :: load_error = 0.0_dp       !! relative
      real(dp) :: duality_gap = 0.0_dp      !! mean of U - H weighted by P above its least, m
      real(dp) :: error = 0.0_dp            !! e1: duality gap over the rms height, or the load error
      real(dp) :: strict = 0.0_dp           !! duality gap over the problem's scale, or the load error
   end type gap_measure_type

contains

   !> What is wrong with the arguments of a solve; empty if nothing is.
   pure function fault_of_problem(problem, grid, height, pressure, gap, past) result(text)
      type(normal_problem_type), intent(in) :: problem
      type(grid_type), intent(in) :: grid              !! of the solver
      real(dp), intent(in) :: height(:, :), pressure(:, :), gap(:, :)
      real(dp), intent(in), optional :: past(:, :)
      character(:), allocatable :: text
      logical :: fits

      fits = grid%fits(shape(height)) .and. grid%fits(shape(pressure)) .and. grid%fits(shape(gap))
      if (present(past)) fits = fits .and. grid%fits(shape(past))
      text = ''
      if (grid%nx < 1) then
         text = reason_unmade
      else if (.not. fits) then
         text = reason_shape
      else if (all(problem%control /= [control_pressure, control_approach])) then
         text = 'control must be control_pressure or control_approach'
      else if (.not. problem%modulus > 0.0_dp) then
         text = 'the modulus must be positive'
      else if (problem%control == control_pressure .and. .not. problem%target >= 0.0_dp) then
         text = 'the prescribed pressure must not be negative'
      end if
   end function fault_of_problem

   !> Complete a problem for its fields. Find a height to which errors are compared and that round-off resolves (for a
   !> flat surface, the displacement under the load). Find out whether the pressure is determined: it is not if the
   !> prescribed approach leaves no mean gap in periodic mode.
   !>
   !> The solvers measure heights, gaps and levels from the highest point of the map. Under a small load all touching
   !> cells lie near that point, so that these differences are exact, and the gap is not the small difference of two
   !> large numbers.
   subroutine prepare_problem(problem, grid, threads, height, task, determined)
      type(normal_problem_type), intent(in) :: problem
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: threads
      real(dp), intent(in) :: height(:, :)             !! H, m
      type(normal_problem_type), intent(out) :: task
      logical, intent(out) :: determined
      real(dp), allocatable :: rows(:, :)
      real(dp) :: highest, lowest, mean, moved, resolved
      integer :: j

      allocate (rows(3, size(height, 2)))
      !$omp parallel do default(none) shared(height, rows) private(j) num_threads(threads)
      do j = 1, size(height, 2)
         rows(:, j) = row_extent(height(:, j))
      end do
      highest = largest_of_rows(rows(1, :))
      lowest = least_of_rows(rows(2, :))
      mean = row_total(rows(3, :))/grid%cells()

      task = problem
      task%datum = highest
      if (problem%control == control_approach) then
         task%target = problem%target + highest
         ! An approach that is only the round-off of this sum is the first touch, without a pressure.
         if (abs(task%target) <= 2.0_dp*epsilon(1.0_dp)*(abs(problem%target) + abs(highest))) task%target = 0.0_dp
      end if
      if (task%rms_height <= 0.0_dp) task%rms_height = field_rms(height, field_mean(height))
      determined = .true.
      if (problem%control == control_pressure) then
         moved = problem%target*moved_length(grid)/problem%modulus
      else
         moved = abs(task%target)
         if (grid%boundary == boundary_periodic) determined = problem%target < -mean .or. task%target <= 0.0_dp
      end if
      resolved = 10.0_dp*epsilon(1.0_dp)*(moved + highest - lowest)
      if (highest - lowest <= resolved) then
         task%rms_height = moved
      else
         task%rms_height = max(task%rms_height, resolved/problem%tolerance)
      end if
      task%rms_height = max(task%rms_height, tiny(1.0_dp))
      task%scale = task%rms_height
      task%least_scale = min(task%rms_height, resolved/problem%tolerance)
      ! On a flat periodic map the displacement under the load is only round-off.
      if (highest - lowest <= resolved .and. grid%boundary == boundary_periodic) task%least_scale = task%rms_height
   end subroutine prepare_problem

   !> The displacement whose round-off limits the accuracy of the gap, over pressure and compliance, m. On a free grid
   !> this is the displacement under a uniform pressure. On a periodic one a uniform pressure moves nothing, and the
   !> round-off of the pressure of each cell acts like an independent load on the cell.
   pure function moved_length(grid) result(length)
      type(grid_type), intent(in) :: grid
      real(dp) :: length
      real(dp) :: shorter, longer

      shorter = min(grid%lx, grid%ly)
      longer = max(grid%lx, grid%ly)
      if (grid%boundary == boundary_periodic) then
         length = min(cell_sides*max(grid%dx, grid%dy), longer)
      else
         length = shorter*(1.0_dp + log(longer/shorter))
      end if
   end function moved_length

   !> Set the height to which the duality gap is compared, for a state near the solution.
   !>
   !> If the contact is small on a tall map, such as on the summit of a sphere, the rms height is not a useful scale,
   !> and ten times the mean displacement under the load is used instead. For a rough contact the scale is the rms
   !> height. The displacement is that of the present pressure, also at a given approach: with the level that is prescribed
   !> but not yet reached it could be far too small, or even negative. Without any pressure, at a given approach, the
   !> displacement that is missing is the overlap.
   subroutine narrow_scale(task, height, pressure, threads, measure)
      type(normal_problem_type), intent(inout) :: task
      real(dp), intent(in) :: height(:, :), pressure(:, :)
      integer, intent(in) :: threads
      type(gap_measure_type), intent(inout) :: measure
      real(dp), allocatable :: rows(:)
      real(dp) :: displacement
      integer :: j

      if (measure%load > 0.0_dp) then
         allocate (rows(size(height, 2)))
         !$omp parallel do default(none) shared(height, pressure, rows, task) private(j) num_threads(threads)
         do j = 1, size(height, 2)
            rows(j) = row_product(height(:, j) - task%datum, pressure(:, j))
         end do
         displacement = row_total(rows)/measure%load + measure%reached
      else if (task%control == control_approach) then
         displacement = measure%duality_gap
      else
         return
      end if
      task%scale = task%rms_height
      if (displacement > 0.0_dp) &
         task%scale = min(task%rms_height, max(shallow*displacement, task%least_scale))
      measure%strict = max(measure%duality_gap/task%scale, measure%load_error)
   end subroutine narrow_scale

   !> The highest, the lowest and the sum of a row.
   function row_extent(row) result(extent)
      real(dp), intent(in) :: row(:)
      real(dp) :: extent(3)
      real(dp) :: highest, lowest, total
      integer :: i

      highest = row(1)
      lowest = row(1)
      total = 0.0_dp
      !$omp simd reduction(max:highest) reduction(min:lowest) reduction(+:total)
      do i = 1, size(row)
         highest = max(highest, row(i))
         lowest = min(lowest, row(i))
         total = total + row(i)
      end do
      extent = [highest, lowest, total]
   end function row_extent

   !> The measure of a state from its sums over the grid.
   pure function combine_measures(problem, cells, sums) result(measure)
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: cells                !! number of cells of the whole grid
      type(state_sums_type), intent(in) :: sums
      type(gap_measure_type) :: measure

      measure%load = sums%load
      measure%contact = sums%cells/cells
      if (sums%load > 0.0_dp) measure%reached = sums%work/sums%load
      if (problem%control == control_approach) then
         measure%level = problem%target
         measure%weighted_level = problem%target
         measure%duality_gap = max(measure%level - sums%least, 0.0_dp)
         if (sums%load > 0.0_dp) &
            measure%duality_gap = max(measure%duality_gap, sums%distance/sums%load, measure%reached - sums%least)
      else if (sums%load > 0.0_dp) then
         measure%level = sums%touched/sums%cells
         measure%weighted_level = measure%reached
         measure%load_error = abs(sums%load/(cells*problem%target) - 1.0_dp)
         measure%duality_gap = measure%weighted_level - sums%least
      else
         ! There is no load, and none is prescribed: the surfaces just touch.
         measure%level = sums%least
         measure%weighted_level = sums%least
         measure%load_error = merge(1.0_dp, 0.0_dp, problem%target > 0.0_dp)
      end if
      measure%error = max(measure%duality_gap/problem%rms_height, measure%load_error)
      measure%strict = max(measure%duality_gap/problem%scale, measure%load_error)
   end function combine_measures

   !> The measure of a state.
   function measure_gap(problem, pressure, gap, threads) result(measure)
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      integer, intent(in) :: threads
      type(gap_measure_type) :: measure
      type(state_sums_type), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(gap, 2)))
      !$omp parallel do default(none) shared(problem, pressure, gap, rows) private(j) &
      !$omp num_threads(threads)
      do j = 1, size(gap, 2)
         call measure_cells(size(gap, 1), problem%target, gap(:, j), pressure(:, j), rows(j))
         rows(j)%least = minval(gap(:, j))
      end do
      measure = combine_measures(problem, cell_count(gap), total(rows))
   end function measure_gap

   !> Compute gap = A(P + P_h)/modulus - H, with H measured from the datum.
   subroutine evaluate_gap(problem, operator, height, pressure, gap, past)
      type(normal_problem_type), intent(in) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :), pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      real(dp), intent(in), optional :: past(:, :)
      logical :: remembers
      integer :: j

      remembers = present(past)
      !$omp parallel do default(none) shared(operator, pressure, past, remembers) private(j) &
      !$omp num_threads(operator%threads)
      do j = 1, operator%rows
         if (remembers) then
            call operator%forward_row(1, j, pressure(:, j) + past(:, j))
         else
            call operator%forward_row(1, j, pressure(:, j))
         end if
      end do
      call operator%columns(columns_apply)
      !$omp parallel do default(none) shared(operator, height, gap, problem) private(j) &
      !$omp num_threads(operator%threads)
      do j = 1, operator%rows
         gap(:, j) = problem%datum - height(:, j)
         call operator%add_backward_row(1, j, 1.0_dp/problem%modulus, gap(:, j))
      end do
   end subroutine evaluate_gap

   !> Compute the first pressure: the given one, or that of full contact (Westergaard) in periodic mode and a cap of the
   !> height in free mode, projected on the admissible pressures. A given pressure that is zero everywhere is no start,
   !> and problem%warm then becomes .false., because a displacement handed in with it is not that of the first pressure.
   subroutine first_pressure(problem, grid, operator, height, pressure, past)
      type(normal_problem_type), intent(inout) :: problem
      type(grid_type), intent(in) :: grid
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(in), optional :: past(:, :)
      real(dp) :: factor, base
      logical :: usable
      integer :: j

      ! Without a load, or at an approach at which the surfaces touch at most, there is no pressure. A small one would be
      ! within the tolerance, too.
      if (problem%target <= 0.0_dp .and. (problem%control == control_pressure .or. .not. present(past))) then
         call project_simplex(pressure, 0.0_dp)
         if (problem%control == control_approach) problem%warm = .false.
         return
      end if
      if (problem%warm) then
         call rescale(problem, grid, operator%threads, pressure, usable)
         problem%warm = usable
         if (usable) return
      end if
      base = 0.0_dp
      if (grid%boundary == boundary_periodic) then
         call operator%apply_inverse(height, pressure)
         factor = problem%modulus
         if (problem%control == control_pressure) base = problem%target
      else
         factor = 2.0_dp*pi*problem%modulus/max(grid%lx, grid%ly)
         pressure(:, :) = height - problem%datum
         if (problem%control == control_approach) base = factor*problem%target
      end if
      !$omp parallel do default(none) shared(pressure, factor, base, operator) private(j) &
      !$omp num_threads(operator%threads)
      do j = 1, operator%rows
         pressure(:, j) = base + factor*pressure(:, j)
      end do
      if (present(past)) pressure(:, :) = pressure - past
      if (problem%control == control_pressure) then
         call project_simplex(pressure, problem%target*grid%cells())
      else
         !$omp parallel do default(none) shared(pressure, operator) private(j) &
         !$omp num_threads(operator%threads)
         do j = 1, operator%rows
            pressure(:, j) = max(pressure(:, j), 0.0_dp)
         end do
      end if
   end subroutine first_pressure

   !> Clip the first pressure, and scale it to the load if that is prescribed. Unlike a projection, scaling does not
   !> change the cells in contact.
   subroutine rescale(problem, grid, threads, pressure, usable)
      type(normal_problem_type), intent(in) :: problem
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: threads
      real(dp), intent(inout) :: pressure(:, :)
      logical, intent(out) :: usable                   !! there was any pressure
      real(dp), allocatable :: rows(:)
      real(dp) :: load, target
      integer :: j

      allocate (rows(size(pressure, 2)))
      !$omp parallel do default(none) shared(pressure, rows) private(j) num_threads(threads)
      do j = 1, size(pressure, 2)
         pressure(:, j) = max(pressure(:, j), 0.0_dp)
         rows(j) = sum(pressure(:, j))
      end do
      load = row_total(rows)
      usable = load > 0.0_dp
      if (.not. usable .or. problem%control /= control_pressure) return
      target = problem%target*grid%cells()
      if (abs(load - target) <= 1e-14_dp*target) return
      !$omp parallel do default(none) shared(pressure, load, target) private(j) num_threads(threads)
      do j = 1, size(pressure, 2)
         pressure(:, j) = (target/load)*pressure(:, j)
      end do
   end subroutine rescale

   !> Set pressures that are only round-off to zero. Where a step takes all pressure from a cell, its difference may leave
   !> some 1e-15 of it behind, and the cell would count as touching although its gap is open.
   subroutine remove_round_off(measure, cells, threads, pressure, gap)
      type(gap_measure_type), intent(in) :: measure
      real(dp), intent(in) :: cells                         !! of the grid
      integer, intent(in) :: threads
      real(dp), contiguous, intent(inout) :: pressure(:, :)   !! Pa
      real(dp), contiguous, intent(in) :: gap(:, :)         !! U - H, m
      real(dp) :: least
      integer :: i, j

      least = round_off*measure%load/max(measure%contact*cells, 1.0_dp)
      !$omp parallel do default(none) shared(pressure, gap, measure, least) private(i, j) num_threads(threads)
      do j = 1, size(pressure, 2)
         if (count_cells_below(size(pressure, 1), least, pressure(:, j)) < 1.0_dp) cycle
         do i = 1, size(pressure, 1)
            if (pressure(i, j) <= least .and. gap(i, j) > measure%weighted_level) pressure(i, j) = 0.0_dp
         end do
      end do
   end subroutine remove_round_off

   !> Return a solution: the outcome according to its measure, and the gap measured from the level.
   subroutine return_solution(problem, task, measure, determined, threads, gap, level, outcome)
      type(normal_problem_type), intent(in) :: problem      !! as the caller gave it
      type(normal_problem_type), intent(in) :: task         !! the problem, completed for its fields
      type(gap_measure_type), intent(in) :: measure
      logical, intent(in) :: determined                     !! the problem has a solution
      integer, intent(in) :: threads
      real(dp), contiguous, intent(inout) :: gap(:, :)      !! in: U - H, out: U - H - level, m
      real(dp), intent(out) :: level                        !! U - H where the gap is zero, m
      type(solver_result_type), intent(inout) :: outcome    !! with the reason for which the loop ended
      integer :: j

      outcome%required = max(task%tolerance, task%accepted)
      outcome%converged = determined .and. measure%strict <= outcome%required
      if (outcome%converged) outcome%reason = reason_converged
      outcome%residual = measure%strict
      outcome%load_error = measure%load_error
      !$omp parallel do default(none) shared(gap, measure) private(j) num_threads(threads)
      do j = 1, size(gap, 2)
         gap(:, j) = gap(:, j) - measure%weighted_level
      end do
      level = measure%weighted_level - task%datum
      if (problem%control /= control_pressure) level = problem%target
   end subroutine return_solution

end module normal_state
