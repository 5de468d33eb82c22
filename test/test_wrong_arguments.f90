!> What the library answers to arguments that have no solution, through the public module alone.
module test_wrong_arguments
   use asperity, only : adhesion_problem_type, adhesion_solver_type, boundary_periodic, case_type, control_pressure, &
      convolution_type, dp, error_type, friction_fields_type, friction_law_type, friction_solver_type, grid_type, &
      height_psd, kernel_type, new_adhesion_potential, new_adhesion_solver, new_convolution, new_friction_law, &
      new_friction_solver, new_grid, new_normal_solver, new_simulation, normal_half_space, normal_problem_type, &
      normal_solver_type, parse_case, run_type, simulation_type, solver_result_type, tangential_half_space
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only : int8
   use check, only : begin_suite, check_error, check_no_error, check_order, check_that, selected
   implicit none
   private

   public :: run_wrong_arguments

   integer, parameter :: nx = 16, ny = 8
   character(*), parameter :: of_shape = 'shape of the grid'

contains

   subroutine run_wrong_arguments()
      call begin_suite('wrong_arguments')
      if (selected('normal_solver_refuses_fields_of_another_shape')) &
         call normal_solver_refuses_fields_of_another_shape()
      if (selected('normal_solver_refuses_impossible_problems')) call normal_solver_refuses_impossible_problems()
      if (selected('adhesion_solver_refuses_fields_of_another_shape')) &
         call adhesion_solver_refuses_fields_of_another_shape()
      if (selected('friction_solver_refuses_fields_and_laws')) call friction_solver_refuses_fields_and_laws()
      if (selected('operators_refuse_impossible_grids')) call operators_refuse_impossible_grids()
      if (selected('solvers_refuse_the_other_kernel')) call solvers_refuse_the_other_kernel()
      if (selected('spectrum_needs_the_shape_of_the_grid')) call spectrum_needs_the_shape_of_the_grid()
      if (selected('simulation_needs_a_case_and_rows')) call simulation_needs_a_case_and_rows()
   end subroutine run_wrong_arguments

   !> A grid with more cells along x than along y.
   function oblong() result(grid)
      type(grid_type) :: grid

      grid = new_grid(nx, ny, 1.0_dp, 0.5_dp, boundary_periodic)
   end function oblong

   !> Check that a solve has not begun, for a reason that contains some words.
   subroutine check_refused(outcome, words)
      type(solver_result_type), intent(in) :: outcome
      character(*), intent(in) :: words

      call check_that(.not. outcome%converged .and. index(outcome%reason, words) > 0, trim(outcome%reason)//': '//words)
      call check_order(outcome%residual, '>', 1.0_dp, 'residual of a refused solve')
   end subroutine check_refused

   !> Fields whose rows and columns are exchanged, smaller and larger ones.
   subroutine normal_solver_refuses_fields_of_another_shape()
      type(normal_solver_type) :: solver
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      integer, parameter :: shapes(2, 3) = reshape([ny, nx, nx/2, ny/2, 2*nx, 2*ny], [2, 3])
      real(dp), allocatable :: wrong(:, :), pressure(:, :), gap(:, :)
      real(dp), dimension(nx, ny) :: right, right_pressure, right_gap
      real(dp) :: level
      integer :: k

      call new_normal_solver(solver, oblong(), normal_half_space(0.5_dp), error)
      call check_no_error(error, 'solver')
      right = 0.0_dp
      right(1, 1) = 1e-3_dp
      do k = 1, 3
         allocate (wrong(shapes(1, k), shapes(2, k)), source=0.0_dp)
         allocate (pressure, gap, source=wrong)
         call solver%solve(normal_problem_type(target=1e-3_dp), wrong, pressure, gap, level, outcome)
         call check_refused(outcome, of_shape)
         call solver%solve(normal_problem_type(target=1e-3_dp), right, right_pressure, right_gap, level, outcome, wrong)
         call check_refused(outcome, of_shape)
         deallocate (wrong, pressure, gap)
      end do
      call solver%destroy()
   end subroutine normal_solver_refuses_fields_of_another_shape

   !> A negative pressure, an unknown control, a modulus of 0, and a solver that was not made.
   subroutine normal_solver_refuses_impossible_problems()
      type(normal_solver_type) :: solver, unmade
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), dimension(nx, ny) :: height, pressure, gap
      real(dp) :: level

      height = 0.0_dp
      height(1, 1) = 1e-3_dp
      call unmade%solve(normal_problem_type(target=1e-3_dp), height, pressure, gap, level, outcome)
      call check_refused(outcome, 'not made')
      call new_normal_solver(solver, oblong(), normal_half_space(0.5_dp), error)
      call check_no_error(error, 'solver')
      call solver%solve(normal_problem_type(target=-1e-3_dp), height, pressure, gap, level, outcome)
      call check_refused(outcome, 'must not be negative')
      call solver%solve(normal_problem_type(target=1e-3_dp, control=9), height, pressure, gap, level, outcome)
      call check_refused(outcome, 'control')
      call solver%solve(normal_problem_type(target=1e-3_dp, modulus=0.0_dp), height, pressure, gap, level, outcome)
      call check_refused(outcome, 'modulus')
      call solver%destroy()
   end subroutine normal_solver_refuses_impossible_problems

   subroutine adhesion_solver_refuses_fields_of_another_shape()
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp) :: height(ny, nx), pressure(ny, nx), gap(ny, nx), level

      height = 0.0_dp
      pressure = 0.0_dp
      gap = 0.0_dp
      level = 0.0_dp
      call new_adhesion_solver(solver, oblong(), normal_half_space(0.5_dp), error)
      call check_no_error(error, 'solver')
      call new_adhesion_potential(problem%potential, 'exponential', 1e-3_dp, 1e-3_dp, error)
      call check_no_error(error, 'potential')
      problem%control = control_pressure
      call solver%solve(problem, height, gap, pressure, level, outcome)
      call check_refused(outcome, of_shape)
      call solver%destroy()
   end subroutine adhesion_solver_refuses_fields_of_another_shape

   !> Fields that are missing, of another shape or not numbers; laws that are unknown, and constants and tables that
   !> are missing or impossible.
   subroutine friction_solver_refuses_fields_and_laws()
      type(friction_solver_type) :: solver
      type(convolution_type) :: operator
      type(friction_fields_type) :: fields
      type(friction_law_type) :: laws(8)
      real(dp) :: table(2, 2)
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), target :: pressure(nx, ny), drive(nx, 2, ny), traction(nx, 2, ny), slip(nx, 2, ny), small(2, 2)
      integer(int8), target :: contact(nx, ny)
      integer :: k

      call new_convolution(operator, oblong(), tangential_half_space(0.5_dp), error)
      call new_friction_solver(solver, oblong(), operator, error)
      call check_no_error(error, 'solver')
      pressure = 1.0_dp
      drive = 1e-3_dp
      traction = 0.0_dp
      contact = 1_int8
      laws(1) = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .false., .true.)
      call solver%solve(operator, laws(1), fields, outcome)
      call check_refused(outcome, 'missing')
      fields%pressure => small
      fields%drive => drive
      fields%traction => traction
      fields%slip => slip
      fields%contact => contact
      call solver%solve(operator, laws(1), fields, outcome)
      call check_refused(outcome, of_shape)

      fields%pressure => pressure
      drive(3, 2, 5) = ieee_value(1.0_dp, ieee_quiet_nan)
      call solver%solve(operator, laws(1), fields, outcome)
      call check_that(.not. outcome%converged .and. outcome%reason == 'not a number', 'drive that is not a number')
      call check_that(ieee_is_nan(outcome%residual), 'residual of a drive that is not a number')
      drive(3, 2, 5) = 1e-3_dp
      laws(1) = new_friction_law('constant shear', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true.)
      laws(2) = new_friction_law('coulomb', -0.5_dp, 0.0_dp, 0.0_dp, .false., .true.)
      laws(3) = new_friction_law('coulomb_orowan', 0.5_dp, -1.0_dp, 0.0_dp, .false., .true.)
      laws(4) = new_friction_law('table', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true.)
      table = reshape([0.0_dp, 1.0_dp, 0.0_dp, 0.5_dp], [2, 2])
      laws(5) = new_friction_law('table', 0.5_dp, 1.0_dp, 0.0_dp, .true., .true., table)
      laws(6) = new_friction_law('table', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true., table(2:1:-1, :))
      laws(7) = new_friction_law('table', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true., -table)
      laws(8) = new_friction_law('table', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true., table(:, :1))
      do k = 1, size(laws)
         call solver%solve(operator, laws(k), fields, outcome)
         call check_refused(outcome, 'friction law')
      end do
      call solver%destroy()
      call operator%destroy()
   end subroutine friction_solver_refuses_fields_and_laws

   !> Numbers of cells, sides and boundaries that no grid can have.
   subroutine operators_refuse_impossible_grids()
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      type(grid_type) :: grids(4)
      character(9), parameter :: words(4) = [character(9) :: 'cells', 'cells', 'sides', 'boundary']
      integer :: k

      grids(1) = new_grid(-nx, ny, 1.0_dp, 1.0_dp, boundary_periodic)
      grids(2) = new_grid(nx, 0, 1.0_dp, 1.0_dp, boundary_periodic)
      grids(3) = new_grid(nx, ny, -1.0_dp, 1.0_dp, boundary_periodic)
      grids(4) = new_grid(nx, ny, 1.0_dp, 1.0_dp, 7)
      do k = 1, 4
         call new_convolution(operator, grids(k), normal_half_space(0.5_dp), error)
         call check_error(error, trim(words(k)), 'refused')
         if (allocated(error)) deallocate (error)
      end do
   end subroutine operators_refuse_impossible_grids

   !> A normal solver with a tangential kernel, and the reverse.
   subroutine solvers_refuse_the_other_kernel()
      type(normal_solver_type) :: normal
      type(adhesion_solver_type) :: adhesive
      type(friction_solver_type) :: friction
      type(convolution_type) :: operator
      type(kernel_type) :: tangential
      type(error_type), allocatable :: error

      tangential = tangential_half_space(0.5_dp)
      call new_normal_solver(normal, oblong(), tangential, error)
      call check_error(error, 'normal kernel', 'refused')
      call new_adhesion_solver(adhesive, oblong(), tangential, error)
      call check_error(error, 'normal kernel', 'refused')
      deallocate (error)
      call new_convolution(operator, oblong(), normal_half_space(0.5_dp), error)
      call check_no_error(error, 'operator')
      call new_friction_solver(friction, oblong(), operator, error)
      call check_error(error, 'tangential kernel', 'refused')
      call operator%destroy()
   end subroutine solvers_refuse_the_other_kernel

   subroutine spectrum_needs_the_shape_of_the_grid()
      type(error_type), allocatable :: error
      real(dp) :: height(nx, ny), psd(4, 4)

      height = 0.0_dp
      height(1, 1) = 1.0_dp
      call height_psd(oblong(), height, psd, error)
      call check_error(error, 'spectrum', 'refused')
   end subroutine spectrum_needs_the_shape_of_the_grid

   !> A case that was not read, a simulation without a case, and rows after the last one.
   subroutine simulation_needs_a_case_and_rows()
      type(case_type) :: unread, case
      type(simulation_type) :: sim
      type(run_type) :: run
      type(error_type), allocatable :: error
      character, parameter :: end = new_line('a')
      character(*), parameter :: text = '&grid nx=8, ny=8, lx=1. /'//end// &
         '&surface shape=''sine'', amplitude=1e-3, wavelength=1. /'//end// &
         '&material shear_modulus=1e6 /'//end//'&phase pressure=1e3 /'//end

      call new_simulation(sim, unread, error)
      call check_error(error, 'not read', 'refused')
      call sim%advance(error)
      call check_error(error, 'not made', 'refused')
      call run%open(unread, .false., .false., error)
      call check_error(error, 'not read', 'refused')
      call run%step(error)
      call check_error(error, 'not made', 'refused')

      call parse_case(text, 'case.nml', case, error)
      call check_no_error(error, 'case')
      call new_simulation(sim, case, error)
      call check_no_error(error, 'simulation')
      do while (.not. sim%finished)
         call sim%advance(error)
         call check_no_error(error, 'row')
         if (allocated(error)) exit
      end do
      call sim%advance(error)
      call check_error(error, 'finished', 'refused')
      call sim%destroy()
      call sim%advance(error)
      call check_error(error, 'destroyed', 'refused')
   end subroutine simulation_needs_a_case_and_rows

end module test_wrong_arguments
