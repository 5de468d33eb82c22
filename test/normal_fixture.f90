!> Parts that the tests of normal contact share: problems that are solved in one call, and recomputed errors.
module normal_fixture
   use check, only : check_no_error, check_that
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use contact_solver, only : contact_solver_type
   use normal_solvers, only : new_contact_solver
   use normal_state, only : control_pressure, normal_problem_type
   use asperity_threads, only : set_threads, thread_count
   use kernels, only : normal_half_space
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use asperity_surface, only : new_height
   use surface_settings, only : default_surface, surface_settings_type
   implicit none
   private

   public :: check_threads, distance, duality_gap, rms, rough_height, rough_problem, run_problem, &
      solution_type

   real(dp), parameter, public :: poisson = 0.3_dp
   !> Shear modulus for which E* = 2G/(1 - nu) = 1 Pa.
   real(dp), parameter, public :: unit_modulus = (1.0_dp - poisson)/2.0_dp

   !> All results of a solve.
   type :: solution_type
      real(dp), allocatable :: pressure(:, :), gap(:, :)
      real(dp) :: level = 0.0_dp
      type(solver_result_type) :: outcome
   end type solution_type

contains

   !> Solve with a solver made for this one problem; `start` makes it a warm start.
   subroutine run_problem(grid, problem, height, solution, thesis, past, start, mixed)
      type(grid_type), intent(in) :: grid
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)
      type(solution_type), intent(out) :: solution
      logical, intent(in), optional :: thesis
      real(dp), intent(in), optional :: past(:, :)
      real(dp), intent(in), optional :: start(:, :)
      logical, intent(in), optional :: mixed           !! in mixed precision
      class(contact_solver_type), allocatable :: solver
      type(normal_problem_type) :: task
      type(error_type), allocatable :: error
      character(:), allocatable :: method

      method = 'fast'
      if (present(thesis)) method = trim(merge('thesis', 'fast  ', thesis))
      task = problem
      if (task%rms_height <= 0.0_dp) task%rms_height = rms(height)
      allocate (solution%pressure(grid%nx, grid%ny), solution%gap(grid%nx, grid%ny))
      solution%pressure(:, :) = 0.0_dp
      solution%gap(:, :) = 0.0_dp
      if (present(start)) then
         solution%pressure = start
         task%warm = .true.
      end if
      call new_contact_solver(solver, method, grid, normal_half_space(poisson), error, mixed)
      call check_no_error(error, 'a solver')
      call solver%solve(task, height, solution%pressure, solution%gap, solution%level, &
         solution%outcome, past)
      call solver%destroy()
   end subroutine run_problem

   !> A rough surface under a mean pressure, E* = 1.
   subroutine rough_problem(grid, finest, pressure, problem, height)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: finest                   !! shortest wave, cells
      real(dp), intent(in) :: pressure                 !! in units of E*
      type(normal_problem_type), intent(out) :: problem
      real(dp), allocatable, intent(out) :: height(:, :)

      call rough_height(grid, finest, height)
      problem%modulus = unit_modulus
      problem%control = control_pressure
      problem%target = pressure
   end subroutine rough_problem

   !> Check that results with one thread and with two have the same bits.
   subroutine check_threads(grid, problem, height, thesis, mixed)
      type(grid_type), intent(in) :: grid
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)
      logical, intent(in) :: thesis, mixed
      type(solution_type) :: s, t
      integer :: threads

      threads = thread_count()
      call set_threads(1)
      call run_problem(grid, problem, height, s, thesis, mixed=mixed)
      call set_threads(2)
      call run_problem(grid, problem, height, t, thesis, mixed=mixed)
      call set_threads(threads)
      call check_that(s%outcome%converged, 'threads: '//s%outcome%reason)
      call check_that(all(abs(s%pressure - t%pressure) <= 0.0_dp), 'threads: the same pressure', &
         [maxval(abs(s%pressure - t%pressure))])
      call check_that(all(abs(s%gap - t%gap) <= 0.0_dp), 'threads: the same gap', &
         [maxval(abs(s%gap - t%gap))])
      call check_that(s%outcome%iterations == t%outcome%iterations, 'threads: iterations')
   end subroutine check_threads

   !> A self-affine surface from a quarter of the shorter side down to `finest` cells.
   subroutine rough_height(grid, finest, height)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: finest
      real(dp), allocatable, intent(out) :: height(:, :)
      type(surface_settings_type) :: term(1)
      type(error_type), allocatable :: error

      term(1) = default_surface(grid)
      term(1)%shape = 'self_affine'
      term(1)%hurst = 0.8_dp
      term(1)%wavelength_long = max(min(grid%lx, grid%ly)/4.0_dp, finest*max(grid%dx, grid%dy))
      if (grid%ny == 1) term(1)%wavelength_long = grid%lx/4.0_dp
      if (grid%nx == 1) term(1)%wavelength_long = grid%ly/4.0_dp
      term(1)%wavelength_rolloff = term(1)%wavelength_long
      term(1)%wavelength_short = finest*max(grid%dx, grid%dy)
      if (grid%ny == 1) term(1)%wavelength_short = finest*grid%dx
      if (grid%nx == 1) term(1)%wavelength_short = finest*grid%dy
      term(1)%rms_slope = 0.1_dp
      term(1)%seed = 7
      call new_height(grid, term, height, error)
      call check_no_error(error, 'a rough surface')
   end subroutine rough_height

   !> Return the root mean square about the mean.
   pure function rms(field)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: rms

      rms = sqrt(sum((field - sum(field)/size(field))**2)/size(field))
   end function rms

   !> Compute e1 from its definition, with a separate operator: sum P (g - min g)/(sum P h_rms).
   subroutine duality_gap(grid, modulus, height, pressure, e1)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: modulus
      real(dp), intent(in) :: height(:, :), pressure(:, :)
      real(dp), intent(out) :: e1
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp), allocatable :: g(:, :)

      allocate (g(grid%nx, grid%ny))
      call new_convolution(operator, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'an operator')
      call operator%apply(pressure, g)
      call operator%destroy()
      g = g/modulus - height
      e1 = sum(pressure*(g - minval(g)))/(sum(pressure)*rms(height))
   end subroutine duality_gap

   !> Distance of two solutions of the same load, as bounded by the duality gap. The energy is at most e1 (sum
   !> P h_rms) above its minimum, and the difference is |P - P*|^2/2 in the norm of A/G. Therefore this
   !> number, |P - P'|^2 in that norm over (sum P h_rms), is at most 2 (sqrt(e1) + sqrt(e1'))^2.
   subroutine distance(grid, modulus, height, p, q, d)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: modulus
      real(dp), intent(in) :: height(:, :), p(:, :), q(:, :)
      real(dp), intent(out) :: d
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp), allocatable :: difference(:, :)

      difference = p - q
      call new_convolution(operator, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'an operator')
      call operator%quadratic_form(difference, d)
      call operator%destroy()
      d = d/modulus/(sum(p)*rms(height))
   end subroutine distance

end module normal_fixture
