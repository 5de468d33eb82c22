!> Tests of normal contact without adhesion.
module test_normal_cg
   use check, only : begin_suite, check_close, check_no_error, check_that
   use errors, only : error_type
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_cg_thesis, only : solve_normal_thesis
   use normal_state, only : control_approach, control_pressure, normal_problem_type, rms_about_mean
   use parallel, only : set_threads
   use precision, only : dp, pi
   use projection, only : project_simplex
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   use surface, only : new_height
   use surface_settings, only : default_surface, surface_settings_type
   implicit none
   private

   public :: run_normal_cg

contains

   subroutine run_normal_cg()
      call begin_suite('normal_cg')
      call test_simplex()
      call test_hertz()
      call test_westergaard()
      call test_rough()
   end subroutine run_normal_cg

   subroutine test_simplex()
      real(dp) :: x(3, 2)

      x = reshape([3.0_dp, -1.0_dp, 0.5_dp, 2.0_dp, 0.0_dp, 0.1_dp], [3, 2])
      call project_simplex(x, 3.0_dp)
      call check_close(sum(x), 3.0_dp, 1e-15_dp, 'sum on the simplex')
   end subroutine test_simplex

   subroutine test_hertz()
   end subroutine test_hertz

   subroutine test_westergaard()
   end subroutine test_westergaard

   subroutine test_rough()
      type(normal_solver_type) :: solver
      type(grid_type) :: grid
      type(error_type), allocatable :: error
      type(surface_settings_type) :: term(1)
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome
      real(dp), allocatable :: h(:, :), p(:, :), gap(:, :)
      real(dp) :: level

      grid = new_grid(128, 96, 1.0_dp, 0.8_dp, boundary_periodic)
      term(1) = default_surface(grid)
      term(1)%shape = 'self_affine'
      term(1)%wavelength_long = 0.3_dp
      term(1)%wavelength_rolloff = 0.3_dp
      term(1)%wavelength_short = 0.05_dp
      term(1)%rms_slope = 0.1_dp
      call new_height(grid, term, h, error)
      call check_no_error(error, 'height')
      call new_normal_solver(solver, grid, 0.3_dp, error)
      call check_no_error(error, 'solver')
      allocate (p(128, 96), gap(128, 96))
      problem%target = 0.002_dp
      problem%rms_height = rms_about_mean(h, 1)
      call solver%solve(problem, h, p, gap, level, outcome)
      call check_that(outcome%converged, outcome%reason)
      call solve_normal_thesis(grid, solver%operator, problem, h, p, gap, level, outcome)
      call check_that(outcome%converged, outcome%reason)
      call solver%destroy()
   end subroutine test_rough

end module test_normal_cg
