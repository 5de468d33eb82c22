!> The library as another program uses it: everything through one module.
module test_facade
   use asperity, only : version_number, boundary_free, dp, default_surface, error_type, grid_type, &
      new_grid, new_height, new_normal_solver, normal_half_space, normal_problem_type, normal_solver_type, &
      solver_result_type, surface_settings_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   implicit none
   private

   public :: run_facade

contains

   !> A Hertzian contact in the few lines that the developer guide shows.
   subroutine run_facade()
      call begin_suite('facade')
      if (selected('hertz_through_the_facade')) call hertz_through_the_facade()
   end subroutine run_facade

   !> The public module alone is enough to solve a Hertzian contact.
   subroutine hertz_through_the_facade()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(normal_solver_type) :: solver
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), pressure(:, :), gap(:, :)
      real(dp) :: level

      grid = new_grid(96, 96, 2.6e-3_dp, 2.6e-3_dp, boundary_free)
      term = default_surface(grid)
      term%shape = 'sphere'
      term%radius = 50e-3_dp
      call new_height(grid, [term], height, error)
      call check_no_error(error, 'height')
      call new_normal_solver(solver, grid, normal_half_space(0.42_dp), error)
      call check_no_error(error, 'solver')
      allocate (pressure(96, 96), gap(96, 96), source=0.0_dp)
      problem%modulus = 100e6_dp
      problem%target = 9.1954_dp/(2.6e-3_dp)**2
      call solver%solve(problem, height, pressure, gap, level, outcome)
      call check_that(outcome%converged, outcome%reason)
      ! E* = 2 G/(1 - nu) = 344.828 MPa gives an approach of 20 um; the mesh error is of order (dx/a)^2.
      call check_close(level + maxval(height), 20e-6_dp, 2e-8_dp, 'Hertz approach')
      call check_order(len(version_number), '>', 0, 'version')
      call solver%destroy()
   end subroutine hertz_through_the_facade

end module test_facade
