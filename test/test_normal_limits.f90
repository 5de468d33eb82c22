!> Tests of normal contact in hard or degenerate cases: few cells, flat roads, no load, unusual grids.
module test_normal_limits
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_fixture, only : duality_gap, poisson, rms, rough_height, rough_problem, run_problem, &
      solution_type, unit_modulus
   use normal_state, only : control_approach, control_pressure, normal_problem_type
   use kernels, only : normal_half_space
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: run_normal_limits

contains

   subroutine run_normal_limits()
      logical :: thesis
      integer :: k

      call begin_suite('normal_limits')
      do k = 1, 2
         thesis = k == 2
         if (selected('spike_carries_load_on_one_cell')) call spike_carries_load_on_one_cell(thesis)
         if (selected('flat_surface_and_flat_punch')) call flat_surface_and_flat_punch(thesis)
         if (selected('two_summits_share_the_load')) call two_summits_share_the_load(thesis)
         if (selected('zero_load_just_touches')) call zero_load_just_touches(thesis)
         if (selected('approach_that_does_not_reach')) call approach_that_does_not_reach(thesis)
         if (selected('approach_that_closes_the_gap')) call approach_that_closes_the_gap(thesis)
         if (selected('two_iterations_leave_a_usable_state')) &
            call two_iterations_leave_a_usable_state(thesis)
      end do
      if (selected('tiny_loads_end_on_the_highest_cell')) call tiny_loads_end_on_the_highest_cell()
      if (selected('load_below_round_off_is_met')) call load_below_round_off_is_met()
      if (selected('small_contact_on_a_tall_map')) call small_contact_on_a_tall_map()
      if (selected('zero_of_heights_does_not_matter')) call zero_of_heights_does_not_matter()
      if (selected('contact_at_the_edge_of_a_free_patch')) &
         call contact_at_the_edge_of_a_free_patch()
      if (selected('odd_prime_thin_and_stretched_grids')) call odd_prime_thin_and_stretched_grids()
      if (selected('used_solver_starts_afresh')) call used_solver_starts_afresh()
      if (selected('solves_of_one_step_spare_products')) then
         call solves_of_one_step_spare_products(boundary_periodic, control_pressure)
         call solves_of_one_step_spare_products(boundary_periodic, control_approach)
         call solves_of_one_step_spare_products(boundary_free, control_pressure)
      end if
   end subroutine run_normal_limits

   !> One cell carries the load, with its own influence coefficient as the compliance.
   subroutine spike_carries_load_on_one_cell(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp) :: h(21, 14), own
      integer :: k, boundary

      h = 0.0_dp
      h(8, 5) = 1.0_dp
      do k = 1, 2
         boundary = merge(boundary_periodic, boundary_free, k == 1)
         grid = new_grid(21, 14, 2.1_dp, 1.0_dp, boundary)
         problem%modulus = unit_modulus
         problem%control = control_pressure
         problem%target = 1e-4_dp
         call run_problem(grid, problem, h, s, thesis)
         call check_that(s%outcome%converged, 'a spike: '//s%outcome%reason)
         call check_that(count(s%pressure > 0.0_dp) == 1 .and. s%pressure(8, 5) > 0.0_dp, &
            'one cell in contact')
         call check_close(s%pressure(8, 5)/(problem%target*size(h)), 1.0_dp, 1e-13_dp, 'it carries all')
         own = (s%level + 1.0_dp)/s%pressure(8, 5)
         problem%control = control_approach
         problem%target = -1.0_dp + 2.0_dp*own*s%pressure(8, 5)
         problem%tolerance = 1e-8_dp
         call run_problem(grid, problem, h, s, thesis)
         call check_that(s%outcome%converged, 'a spike by approach: '//s%outcome%reason)
         call check_close(sum(s%pressure)/size(h), 2e-4_dp, 1e-8_dp, 'twice as far, twice the load')
      end do
      ! In free mode this is Love's 4 (asinh(r) + r asinh(1/r)) of the sides; here it is taken from the
      ! operator.
      call check_order(own, '>', 0.0_dp, 'the compliance of a cell')
   end subroutine spike_carries_load_on_one_cell

   !> On a flat surface the pressure is uniform if the grid is periodic. On a free grid it is that of a punch
   !> with its singular edge.
   subroutine flat_surface_and_flat_punch(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      real(dp) :: force

      allocate (h(30, 17), source=0.1_dp)
      grid = new_grid(30, 17, 1.0_dp, 1.0_dp, boundary_periodic)
      problem%modulus = unit_modulus
      problem%target = 0.02_dp
      call run_problem(grid, problem, h, s, thesis)
      call check_that(s%outcome%converged, 'flat: '//s%outcome%reason)
      call check_close(maxval(abs(s%pressure - 0.02_dp)), 0.0_dp, 1e-12_dp*0.02_dp, 'flat: uniform')
      call check_close(s%level, -0.1_dp, 1e-14_dp, 'flat: no approach')

      ! A square punch: F = 1.153 E* L delta (Borodachev). Sneddon's formula for a disc is 2 a delta E*.
      deallocate (h)
      allocate (h(48, 48), source=-2.0_dp)
      grid = new_grid(48, 48, 1.0_dp, 1.0_dp, boundary_free)
      problem%target = 0.02_dp
      call run_problem(grid, problem, h, s, thesis)
      call check_that(s%outcome%converged, 'punch: '//s%outcome%reason)
      call check_that(all(s%pressure > 0.0_dp), 'punch: all in contact', [minval(s%pressure)])
      ! The map is one cell wider than the distance of its outer centres. The error of the singular edge is ~
      ! dx/L.
      call check_close(0.02_dp/(s%level - 2.0_dp), 1.153_dp, 0.03_dp, 'punch: stiffness')
      force = sum(s%pressure)
      problem%control = control_approach
      problem%target = s%level
      call run_problem(grid, problem, h, s, thesis)
      call check_that(s%outcome%converged, 'punch by approach: '//s%outcome%reason)
      call check_close(sum(s%pressure)/force, 1.0_dp, 1e-5_dp, 'punch: the load again')
   end subroutine flat_surface_and_flat_punch

   !> Two equal summits carry half of the load each.
   subroutine two_summits_share_the_load(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp) :: h(40, 18)
      integer :: i, j

      grid = new_grid(40, 18, 4.0_dp, 2.0_dp, boundary_periodic)
      do j = 1, 18
         do i = 1, 40
            h(i, j) = cos(2.0_dp*pi*(i - 1)/20.0_dp) + cos(2.0_dp*pi*(j - 1)/18.0_dp)
         end do
      end do
      h(21:40, :) = h(1:20, :)
      problem%modulus = unit_modulus
      problem%tolerance = 1e-9_dp
      do i = 1, 3
         problem%target = 1e-6_dp*300.0_dp**(i - 1)
         call run_problem(grid, problem, h, s, thesis)
         call check_that(s%outcome%converged, 'two summits: '//s%outcome%reason)
         call check_close(sum(s%pressure(1:20, :))/sum(s%pressure), 0.5_dp, 1e-4_dp, 'half on each')
      end do
   end subroutine two_summits_share_the_load

   !> Check that the solver converged to a state without pressure.
   subroutine check_no_pressure(solution, what)
      type(solution_type), intent(in) :: solution
      character(*), intent(in) :: what

      call check_that(solution%outcome%converged, what//': '//solution%outcome%reason)
      call check_that(all(abs(solution%pressure) <= 0.0_dp), what//': no pressure', &
         [maxval(abs(solution%pressure))])
   end subroutine check_no_pressure

   !> A load of zero is first touch.
   subroutine zero_load_just_touches(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      integer :: k

      do k = 1, 2
         grid = new_grid(20, 33, 1.0_dp, 1.0_dp, merge(boundary_periodic, boundary_free, k == 1))
         call rough_problem(grid, 4.0_dp, 0.0_dp, problem, h)
         call run_problem(grid, problem, h, s, thesis)
         call check_no_pressure(s, 'no load')
         call check_close(s%level, -maxval(h), 1e-15_dp, 'no load: first touch')
         call check_close(minval(s%gap), 0.0_dp, 1e-15_dp, 'no load: touching')
      end do
   end subroutine zero_load_just_touches

   !> An approach without contact, and the first touch up to round-off.
   subroutine approach_that_does_not_reach(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      integer :: k

      do k = 1, 2
         grid = new_grid(20, 33, 1.0_dp, 1.0_dp, merge(boundary_periodic, boundary_free, k == 1))
         call rough_problem(grid, 4.0_dp, 0.0_dp, problem, h)
         problem%control = control_approach
         problem%target = -maxval(h) - 0.01_dp
         call run_problem(grid, problem, h, s, thesis)
         call check_no_pressure(s, 'no contact')
         call check_close(minval(s%gap), 0.01_dp, 1e-14_dp, 'no contact: the distance')
         problem%target = -maxval(h)*(1.0_dp - epsilon(1.0_dp))
         call run_problem(grid, problem, h, s, thesis)
         call check_no_pressure(s, 'an overlap that is round-off')
      end do
      ! Many equal summits, on which small pressures would be within the tolerance.
      grid = new_grid(8, 8, 1e-3_dp, 1e-3_dp, boundary_periodic)
      h = spread(2e-6_dp*[(cos(0.5_dp*pi*k), k=0, 7)], 2, 8)
      problem%tolerance = 1e-6_dp
      problem%rms_height = 0.0_dp
      problem%target = -maxval(h)
      call run_problem(grid, problem, h, s, thesis)
      call check_no_pressure(s, 'first touch of equal summits')
   end subroutine approach_that_does_not_reach

   !> An approach that would leave no gap cannot be solved on a periodic grid. The solver says so.
   subroutine approach_that_closes_the_gap(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)

      grid = new_grid(24, 33, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 4.0_dp, 0.0_dp, problem, h)
      problem%control = control_approach
      problem%target = -sum(h)/size(h) + 1e-3_dp*rms(h)
      call run_problem(grid, problem, h, s, thesis)
      call check_that(.not. s%outcome%converged, 'a closed gap has no pressure')
      call check_order(index(s%outcome%reason, 'full contact'), '>', 0, &
         'it says why: '//s%outcome%reason)
      call check_that(s%outcome%iterations == 0, 'it does not iterate')
      call check_that(all(s%pressure >= 0.0_dp) .and. all(abs(s%gap) < 1.0_dp), 'a usable state', &
         [minval(s%pressure), maxval(abs(s%gap))])
      ! A small gap has a solution. (The mean gap is 1 % of the rms height.)
      problem%target = -sum(h)/size(h) - 1e-2_dp*rms(h)
      problem%tolerance = 1e-8_dp
      call run_problem(grid, problem, h, s, thesis)
      call check_that(s%outcome%converged, 'nearly closed: '//s%outcome%reason)
      call check_close(sum(s%gap)/size(h), 1e-2_dp*rms(h), 1e-12_dp*rms(h), 'the mean gap')
   end subroutine approach_that_closes_the_gap

   !> Two iterations are not enough. The state is usable, better than the start, and its error is the true
   !> one.
   subroutine two_iterations_leave_a_usable_state(thesis)
      logical, intent(in) :: thesis
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: e1

      grid = new_grid(64, 48, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 6.0_dp, 0.005_dp, problem, h)
      problem%max_iterations = 2
      problem%tolerance = 1e-10_dp
      call run_problem(grid, problem, h, s, thesis)
      call duality_gap(grid, unit_modulus, h, s%pressure, e1)
      call check_that(.not. s%outcome%converged, 'not converged')
      call check_order(index(s%outcome%reason, 'iterations'), '>', 0, 'it says why')
      call check_that(s%outcome%iterations == 2, 'as many as allowed')
      call check_close(s%outcome%residual, e1, 1e-12_dp*max(e1, 1.0_dp), 'the true error')
      call check_order(e1, '>', problem%tolerance, 'which is larger than wanted')
      call check_close(sum(s%pressure)/size(h), 0.005_dp, 1e-15_dp, 'the load is kept')
      call check_that(all(s%pressure >= 0.0_dp), 'no tension', [minval(s%pressure)])
      ! The solver can continue from this state.
      problem%max_iterations = 500
      call run_problem(grid, problem, h, t, thesis, start=s%pressure)
      call check_that(t%outcome%converged, 'going on: '//t%outcome%reason)
      problem%max_iterations = 0
      call run_problem(grid, problem, h, t, thesis)
      call check_that(.not. t%outcome%converged .and. t%outcome%iterations == 0, 'no iteration')
      call check_close(sum(t%pressure)/size(h), 0.005_dp, 1e-15_dp, 'the load of the start')
   end subroutine two_iterations_leave_a_usable_state

   !> Very small loads are carried by the highest cell.
   subroutine tiny_loads_end_on_the_highest_cell()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      integer :: k, boundary

      do boundary = boundary_periodic, boundary_free
         grid = new_grid(50, 36, 1.0_dp, 1.0_dp, boundary)
         call rough_problem(grid, 6.0_dp, 0.0_dp, problem, h)
         do k = 4, 40, 6
            problem%target = 10.0_dp**(-k)
            call run_problem(grid, problem, h, s)
            call check_that(s%outcome%converged, 'a small load: '//s%outcome%reason)
            call check_close(sum(s%pressure)/(problem%target*size(h)), 1.0_dp, 1e-12_dp, &
               'a small load is met')
            call check_order(s%outcome%iterations, '<', 60, 'a small load in few iterations')
            if (k > 10) call check_close(s%level, -maxval(h), 1e-6_dp*rms(h), &
               'a small load: first touch')
         end do
      end do
   end subroutine tiny_loads_end_on_the_highest_cell

   !> Loads below the round-off of a step are met nevertheless: on strips, and after larger loads.
   subroutine load_below_round_off_is_met()
      real(dp), parameter :: loads(6) = [2e-2_dp, 3e-8_dp, 1e-14_dp, 1e-5_dp, 2e-13_dp, 1e-1_dp]
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :), start(:, :)
      integer :: i, k, n

      do n = 1, 5, 2
         grid = new_grid(128, n, 1.0_dp, n/128.0_dp, boundary_periodic)
         if (allocated(h)) deallocate (h, start)
         allocate (h(128, n), start(128, n))
         do i = 1, 128
            h(i, :) = sqrt(1.0_dp - ((i - 65)*grid%dx)**2) - 1.0_dp
         end do
         problem%modulus = unit_modulus
         do k = 1, size(loads)
            problem%target = loads(k)
            call run_problem(grid, problem, h, s)
            call check_that(s%outcome%converged, 'a load below round-off: '//s%outcome%reason)
            call check_close(sum(s%pressure)/(loads(k)*size(h)), 1.0_dp, 1e-6_dp, 'a load below round-off is met')
            if (k > 1) then
               call run_problem(grid, problem, h, s, start=start)
               call check_that(s%outcome%converged, 'a load below round-off after another: '//s%outcome%reason)
               call check_close(sum(s%pressure)/(loads(k)*size(h)), 1.0_dp, 1e-6_dp, 'it is met')
            end if
            start = s%pressure
         end do
      end do
   end subroutine load_below_round_off_is_met

   !> A small contact on a high map is as accurate as on a small map. The contact of a paraboloid has a radius
   !> of five cells.
   subroutine small_contact_on_a_tall_map()
      integer, parameter :: sides(3) = [50, 160, 400]
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      logical :: thesis
      integer :: boundary, i, j, k, l, n

      do boundary = boundary_periodic, boundary_free
         do k = 1, size(sides)
            n = sides(k)
            grid = new_grid(n, n, 1e-3_dp*n, 1.1e-3_dp*n, boundary)
            if (allocated(h)) deallocate (h)
            allocate (h(n, n))
            do j = 1, n
               do i = 1, n
                  h(i, j) = -0.5_dp*(((i - n/2)*grid%dx)**2 + ((j - n/2)*grid%dy)**2)
               end do
            end do
            problem%modulus = unit_modulus
            problem%target = 4.0_dp*5e-3_dp**3/(3.0_dp*grid%lx*grid%ly)
            do l = 1, 2
               thesis = l == 2
               problem%tolerance = 1e-10_dp
               call run_problem(grid, problem, h, s, thesis)
               problem%tolerance = 1e-5_dp
               call run_problem(grid, problem, h, t, thesis)
               call check_that(s%outcome%converged .and. t%outcome%converged, 'a small contact')
               call check_order(count(s%pressure > 0.0_dp), '>', 70, 'it is resolved')
               call check_close(maxval(abs(t%pressure - s%pressure))/maxval(s%pressure), 0.0_dp, &
                  2e-3_dp, 'a small contact: the pressure')
               call check_close((t%level - s%level)/25e-6_dp, 0.0_dp, 1e-4_dp, &
                  'a small contact: the approach')
               call check_order(t%outcome%residual, '<=', problem%tolerance, &
                  'a small contact: its residual')
               call check_order(t%outcome%iterations, '<', 20, 'a small contact: few iterations')
            end do
         end do
      end do
   end subroutine small_contact_on_a_tall_map

   !> The result does not depend on the zero of the height.
   subroutine zero_of_heights_does_not_matter()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      integer :: boundary

      do boundary = boundary_periodic, boundary_free
         grid = new_grid(40, 36, 1.0_dp, 1.0_dp, boundary)
         call rough_problem(grid, 6.0_dp, 0.003_dp, problem, h)
         problem%tolerance = 1e-9_dp
         call run_problem(grid, problem, h, s)
         h = h - 1e3_dp
         call run_problem(grid, problem, h, t)
         call check_that(s%outcome%converged .and. t%outcome%converged, 'far from zero')
         call check_close(t%level - s%level, 1e3_dp, 1e-9_dp, 'far from zero: the level')
         call check_close(sum(abs(s%pressure - t%pressure))/sum(s%pressure), 0.0_dp, 1e-3_dp, &
            'far from zero: the pressure')
      end do
   end subroutine zero_of_heights_does_not_matter

   !> A free patch that touches at its edge and corner, by load and by approach.
   subroutine contact_at_the_edge_of_a_free_patch()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp) :: h(33, 20), u(33, 20), force
      integer :: i, j

      grid = new_grid(33, 20, 1.65_dp, 1.5_dp, boundary_free)
      do j = 1, 20
         do i = 1, 33
            h(i, j) = 0.1_dp*((i - 1)*grid%dx + 0.3_dp*(j - 1)*grid%dy)
         end do
      end do
      problem%modulus = unit_modulus
      problem%target = 0.002_dp
      problem%tolerance = 1e-9_dp
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, 'contact at the corner: '//s%outcome%reason)
      call check_order(s%pressure(33, 20), '>', 0.0_dp, 'the corner carries')
      call check_order(s%pressure(1, 1), '<=', 0.0_dp, 'the other does not')
      ! The complementarity is checked with a separate operator.
      call new_convolution(operator, grid, normal_half_space(poisson), error)
      call operator%apply(s%pressure, u)
      call operator%destroy()
      u = u/unit_modulus - h - s%level
      call check_close(minval(u), 0.0_dp, 1e-8_dp*rms(h), 'no overlap')
      call check_close(maxval(abs(u - s%gap)), 0.0_dp, 1e-13_dp, 'the gap that is returned')
      force = sum(s%pressure)
      problem%control = control_approach
      problem%target = s%level
      call run_problem(grid, problem, h, t)
      call check_that(t%outcome%converged, 'corner by approach: '//t%outcome%reason)
      call check_close(sum(t%pressure)/force, 1.0_dp, 1e-5_dp, 'corner: the load again')
   end subroutine contact_at_the_edge_of_a_free_patch

   !> Odd, prime, thin and stretched grids converge like others.
   subroutine odd_prime_thin_and_stretched_grids()
      integer, parameter :: shapes(2, 13) = reshape([ &
         1, 1, 2, 1, 1, 2, 2, 2, 3, 5, 97, 61, 64, 64, 127, 1, 1, 127, 512, 8, 8, 512, 257, 3, &
         3, 257], [2, 13])
      real(dp), parameter :: ratios(4) = [1.0_dp, 0.25_dp, 4.0_dp, 1.7_dp]
      integer :: k, l, boundary

      do boundary = boundary_periodic, boundary_free
         do k = 1, size(shapes, 2)
            do l = 1, size(ratios)
               call solve_shape(boundary, shapes(1, k), shapes(2, k), ratios(l))
            end do
         end do
      end do
   end subroutine odd_prime_thin_and_stretched_grids

   !> Solve on a grid with dy = ratio dx.
   subroutine solve_shape(boundary, nx, ny, ratio)
      integer, intent(in) :: boundary, nx, ny
      real(dp), intent(in) :: ratio
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp) :: h(nx, ny), e1
      character(80) :: name
      integer :: i, j, k

      grid = new_grid(nx, ny, real(nx, dp), ny*ratio, boundary)
      do j = 1, ny
         do i = 1, nx
            h(i, j) = sin(0.7_dp*i + 0.3_dp*j) + 0.7_dp*cos(0.29_dp*i - 0.53_dp*j) &
               + 0.4_dp*sin(0.1_dp*i + 0.2_dp*j*ratio)
         end do
      end do
      problem%modulus = unit_modulus
      do k = 1, 3
         problem%target = 0.003_dp*10.0_dp**(k - 1)
         call run_problem(grid, problem, h, s)
         write (name, '(a, i0, " x ", i0, ", 1 : ", f4.2, ", load ", i0, ": ")') &
            merge('periodic ', 'free     ', boundary == boundary_periodic), nx, ny, ratio, k
         call check_that(s%outcome%converged, trim(name)//' '//s%outcome%reason)
         ! On strips of stretched cells the preconditioner has little effect, but does no harm.
         if (s%outcome%iterations > 60) then
            call run_problem(grid, problem, h, t, .true.)
            call check_order(real(s%outcome%iterations, dp), '<=', 1.1_dp*t%outcome%iterations, &
               trim(name)//' too many iterations')
         end if
         if (rms(h) <= 0.0_dp) cycle
         call duality_gap(grid, unit_modulus, h, s%pressure, e1)
         call check_order(e1, '<=', 1e-6_dp, trim(name)//' its error')
      end do
   end subroutine solve_shape

   !> A solver that is used again starts from nothing.
   subroutine used_solver_starts_afresh()
      type(grid_type) :: grid
      type(normal_solver_type) :: solver
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :), p(:, :), gap(:, :)
      real(dp) :: level
      integer :: k

      grid = new_grid(70, 48, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_height(grid, 6.0_dp, h)
      allocate (p(70, 48), gap(70, 48))
      call new_normal_solver(solver, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'a solver')
      problem%modulus = unit_modulus
      problem%rms_height = rms(h)
      do k = 1, 4
         problem%target = merge(0.05_dp, 0.002_dp, mod(k, 2) == 1)
         call solver%solve(problem, h, p, gap, level, outcome)
         call run_problem(grid, problem, h, s)
         call check_that(all(abs(p - s%pressure) <= 0.0_dp), 'a used solver: the same pressure', &
            [maxval(abs(p - s%pressure))])
         call check_that(outcome%ffts == s%outcome%ffts, 'a used solver: the same count')
         call check_order(outcome%seconds, '>', 0.0_dp, 'a used solver: its time')
      end do
      call solver%destroy()
   end subroutine used_solver_starts_afresh

   !> A road that changes a little, as from pass to pass of a step. A solve that continues from the
   !> displacement before saves the product at the start. The gap that it returns is still
   !> that of its pressure.
   subroutine solves_of_one_step_spare_products(boundary, control)
      integer, intent(in) :: boundary, control
      type(grid_type) :: grid
      type(normal_solver_type) :: solver
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome, first, whole
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), p(:, :), gap(:, :), start(:, :), u(:, :), changed(:, :), fresh(:, :)
      real(dp) :: level, levels(2), e1

      grid = new_grid(70, 48, 1.0_dp, 0.8_dp, boundary)
      call rough_height(grid, 6.0_dp, h)
      allocate (p(70, 48), gap(70, 48), source=0.0_dp)
      call new_normal_solver(solver, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'a solver')
      problem%modulus = unit_modulus
      problem%rms_height = rms(h)
      problem%tolerance = 1e-8_dp
      problem%control = control
      problem%target = merge(0.03_dp, -1.5_dp*problem%rms_height, control == control_pressure)
      call solver%solve(problem, h, p, gap, level, first)
      start = p
      u = gap + h + level
      changed = h + 0.01_dp*cshift(h, 7, 1)

      problem%warm = .true.
      problem%displaced = .true.
      gap(:, :) = u
      call solver%solve(problem, changed, p, gap, levels(1), outcome)
      fresh = gap
      problem%displaced = .false.
      call solver%solve(problem, changed, start, fresh, levels(2), whole)

      call check_that(outcome%converged .and. whole%converged, 'both converged')
      call check_that(outcome%iterations > 0 .and. outcome%iterations == whole%iterations, 'the same iterations')
      call check_that(whole%ffts - outcome%ffts == 2, 'a product spared', [real(whole%ffts - outcome%ffts, dp)])
      call check_order(maxval(abs(p - start)), '<=', 1e-9_dp*maxval(p), 'the same pressure')
      call check_order(maxval(abs(gap - fresh)), '<=', 1e-11_dp*problem%rms_height, 'the same gap')
      call check_close(levels(1), levels(2), 1e-11_dp*problem%rms_height, 'the same level')
      if (boundary == boundary_periodic .and. control == control_pressure) then
         call duality_gap(grid, problem%modulus, changed, p, e1)
         call check_order(e1, '<=', 1.01e-8_dp, 'the error by a separate operator')
      end if
      call solver%destroy()
   end subroutine solves_of_one_step_spare_products

end module test_normal_limits
