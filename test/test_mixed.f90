!> Tests of normal contact in mixed precision, against double precision.
module test_mixed
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use normal_fixture, only : check_threads, distance, duality_gap, rough_problem, run_problem, &
      solution_type, unit_modulus
   use normal_state, only : control_approach, normal_problem_type
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use simulation_runs, only : check_same_rows, last, nl, record_type, run_case
   use text_tools, only : to_text
   implicit none
   private

   public :: run_mixed

contains

   subroutine run_mixed()
      call begin_suite('mixed')
      if (selected('all_tolerances_are_reached')) &
         call all_tolerances_are_reached(boundary_periodic, 140, 90)
      if (selected('all_tolerances_are_reached')) &
         call all_tolerances_are_reached(boundary_free, 63, 80)
      if (selected('units_change_no_step')) call units_change_no_step()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads(boundary_periodic)
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads(boundary_free)
      if (selected('tolerance_near_round_off')) call tolerance_near_round_off()
      if (selected('case_with_sliding_in_both_precisions')) &
         call case_with_sliding_in_both_precisions()
   end subroutine run_mixed

   !> Mixed precision reaches every tolerance that double precision reaches, in about as many iterations, and
   !> the reported error is the true one.
   subroutine all_tolerances_are_reached(boundary, nx, ny)
      integer, intent(in) :: boundary, nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: e1, d
      integer :: k, power
      character(:), allocatable :: what

      grid = new_grid(nx, ny, 1.0_dp, 0.8_dp, boundary)
      call rough_problem(grid, 6.0_dp, 0.01_dp, problem, h)
      do k = 1, 2
         do power = 4, 10, 2
            problem%tolerance = 10.0_dp**(-power)
            if (k == 2) then
               problem%control = control_approach
               problem%target = -0.3_dp*maxval(h)
            end if
            what = 'mixed precision, 1e-'//to_text(power)//', control '//to_text(k)
            call run_problem(grid, problem, h, s)
            call run_problem(grid, problem, h, t, mixed=.true.)
            call check_that(s%outcome%converged .and. t%outcome%converged, what//': '//t%outcome%reason)
            call check_order(5*t%outcome%iterations, '<=', 6*s%outcome%iterations + 10, &
               what//': '// to_text(t%outcome%iterations)//' iterations for '//to_text(s%outcome%iterations))
            call duality_gap(grid, problem%modulus, h, t%pressure, e1)
            ! The round-off of the operator itself, compared with e1 of 1e-10.
            if (k == 1) call check_order(e1, '<=', 1.01_dp*problem%tolerance, &
               what//': error recomputed')
            call distance(grid, problem%modulus, h, s%pressure, t%pressure, d)
            ! If the approach is prescribed, the error of the load adds to that of the gap.
            call check_order(d, '<=', merge(8.0_dp, 16.0_dp, k == 1)*problem%tolerance, &
               what//': the same state')
            call check_order(minval(t%pressure), '>=', 0.0_dp, what//': nothing pulls')
            if (k == 1) call check_close(sum(t%pressure)/(0.01_dp*nx*ny), 1.0_dp, 1e-12_dp, what//': load')
         end do
      end do
      call check_that(any(abs(s%pressure - t%pressure) > 0.0_dp), 'single precision is at work', &
         [maxval(abs(s%pressure - t%pressure))])
   end subroutine all_tolerances_are_reached

   !> Values in units beyond the range of single precision need the same steps.
   subroutine units_change_no_step()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :), small(:, :)
      real(dp) :: unit
      integer :: k

      grid = new_grid(72, 90, 1.0_dp, 1.2_dp, boundary_periodic)
      call rough_problem(grid, 6.0_dp, 0.01_dp, problem, h)
      problem%tolerance = 1e-8_dp
      call run_problem(grid, problem, h, s, mixed=.true.)
      do k = -120, 120, 240
         ! Lengths in another unit, and the modulus in a unit far from it.
         unit = 2.0_dp**k
         grid = new_grid(72, 90, unit, 1.2_dp*unit, boundary_periodic)
         allocate (small, source=unit*h)
         problem%modulus = unit_modulus*unit
         problem%target = 0.01_dp*unit
         call run_problem(grid, problem, small, t, mixed=.true.)
         call check_that(t%outcome%converged, 'other units: '//t%outcome%reason)
         call check_that(t%outcome%iterations == s%outcome%iterations, 'other units: iterations')
         call check_close(maxval(abs(t%pressure/unit - s%pressure)), 0.0_dp, 1e-6_dp*maxval(s%pressure), &
            'other units: the same pressure')
         deallocate (small)
      end do
   end subroutine units_change_no_step

   !> One and two threads give the same bits.
   subroutine same_bits_on_two_threads(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      real(dp), allocatable :: h(:, :)

      grid = new_grid(180, 131, 1.0_dp, 0.9_dp, boundary)
      call rough_problem(grid, 6.0_dp, 0.02_dp, problem, h)
      problem%tolerance = 1e-7_dp
      call check_threads(grid, problem, h, thesis=.false., mixed=.true.)
   end subroutine same_bits_on_two_threads

   !> A tolerance near the round-off of double precision.
   subroutine tolerance_near_round_off()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: e1

      grid = new_grid(60, 48, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 6.0_dp, 0.02_dp, problem, h)
      problem%tolerance = 1e-13_dp
      problem%max_iterations = 200
      call run_problem(grid, problem, h, s)
      call run_problem(grid, problem, h, t, mixed=.true.)
      call check_that(t%outcome%converged .eqv. s%outcome%converged, 'as far as double precision gets')
      call duality_gap(grid, problem%modulus, h, t%pressure, e1)
      call check_close(t%outcome%residual, e1, 1e-13_dp, 'the error reported is true')
      call check_order(e1, '<=', 10.0_dp*s%outcome%residual + 1e-13_dp, &
         'as good as double precision')
   end subroutine tolerance_near_round_off

   !> A case with sliding and an arm, in both precisions.
   subroutine case_with_sliding_in_both_precisions()
      character(*), parameter :: text = '&grid nx = 48, ny = 45, lx = 1.2e-3, ly = 1.0e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, '// &
         'wavelength_short = 0.12e-3, rms_height = 5e-6, seed = 3 /'//nl// &
         '&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 1e-3 /'//nl// &
         '&phase pressure = 2e4, steps = 4, duration = 1e-3 /'//nl// &
         '&phase velocity_x = 0.1, steps = 4, duration = 1e-3 /'//nl
      type(record_type) :: a, b

      call run_case(text//'&solver tolerance = 1e-10 /', 'double precision', a)
      call run_case(text//'&solver tolerance = 1e-10, precision = ''mixed'' /', 'mixed precision', b)
      call check_that(last(a) == 8 .and. last(b) == 8, 'all rows')
      call check_same_rows(a, b, 1e-4_dp, 'double and mixed precision')
      call check_that(any(abs(a%rows%mean_gap - b%rows%mean_gap) > 0.0_dp), 'both precisions are at work')
   end subroutine case_with_sliding_in_both_precisions

end module test_mixed
