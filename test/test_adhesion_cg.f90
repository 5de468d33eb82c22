!> Tests of adhesive contact in periodic mode.
module test_adhesion_cg
   use adhesion_cg, only : adhesion_solver_type, new_adhesion_solver
   use adhesion_model, only : adhesion_model_type, new_adhesion_model
   use adhesion_patch, only : adhesion_patch_type, new_adhesion_patch
   use adhesion_potential, only : adhesion_potential_type, adhesive_energy, adhesive_slope, &
      new_adhesion_potential
   use adhesion_state, only : adhesion_problem_type, control_approach, control_pressure, &
      reason_closed, reason_detached
   use adhesion_symbols, only : adhesion_symbols_type
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_symbol_operator
   use asperity_threads, only : set_threads
   use kernels, only : normal_half_space
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   use transform_shape, only : whole_shape
   implicit none
   private

   public :: run_adhesion_cg

   real(dp), parameter :: poisson = 0.3_dp
   real(dp), parameter :: modulus = 0.35_dp            !! E* = 2 modulus/(1 - poisson) = 1
   character(14), parameter :: potentials(3) = &
      [character(14) :: 'exponential', 'gauss', 'maugis_dugdale']

contains

   subroutine run_adhesion_cg()
      integer :: k

      call begin_suite('adhesion_cg')
      do k = 1, size(potentials)
         if (selected('pressure_is_gradient_of_energy')) &
            call pressure_is_gradient_of_energy(trim(potentials(k)))
         if (selected('solution_meets_its_conditions')) &
            call solution_meets_its_conditions(36, 25, 1.0_dp, 0.6_dp, trim(potentials(k)))
         if (selected('solution_meets_its_conditions')) &
            call solution_meets_its_conditions(31, 48, 0.5_dp, 1.0_dp, trim(potentials(k)))
         if (selected('energy_falls_with_the_iterations')) &
            call energy_falls_with_the_iterations(trim(potentials(k)), 'fast')
         if (selected('energy_falls_with_the_iterations')) &
            call energy_falls_with_the_iterations(trim(potentials(k)), 'thesis')
         if (selected('thesis_method_agrees')) call thesis_method_agrees(trim(potentials(k)))
      end do
      if (selected('model_is_near_the_operator')) then
         call model_is_near_the_operator(1.0_dp, 0.8_dp, 1.3_dp)
         call model_is_near_the_operator(2.0_dp, 0.75_dp, 1.6_dp)
      end if
      if (selected('force_is_derivative_of_energy')) call force_is_derivative_of_energy()
      if (selected('westergaard_wave_without_adhesion')) call westergaard_wave_without_adhesion()
      if (selected('johnson_adhesive_wave')) call johnson_adhesive_wave()
      if (selected('strong_attraction_on_rough_surface')) call strong_attraction_on_rough_surface()
      if (selected('attraction_closes_as_in_a_slow_motion')) call attraction_closes_as_in_a_slow_motion()
      if (selected('pull_off_takes_more_work_than_approach')) &
         call pull_off_takes_more_work_than_approach()
      if (selected('detached_closed_and_refused')) call detached_closed_and_refused()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads()
   end subroutine run_adhesion_cg

   !> Energy of adhesion gamma_0 for the range z_0, in units of E* = 1 and of the length of the cell.
   function potential_of(name, energy, range) result(potential)
      character(*), intent(in) :: name
      real(dp), intent(in) :: energy, range
      type(adhesion_potential_type) :: potential
      type(error_type), allocatable :: error

      call new_adhesion_potential(potential, name, energy, range, error)
      call check_no_error(error, name)
   end function potential_of

   !> An uneven surface of a few oblique waves.
   function waves(grid, amplitude) result(height)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: amplitude
      real(dp) :: height(grid%nx, grid%ny)
      real(dp) :: x, y
      integer :: i, j

      do j = 1, grid%ny
         do i = 1, grid%nx
            x = 2.0_dp*pi*(i - 1)/grid%nx
            y = 2.0_dp*pi*(j - 1)/grid%ny
            height(i, j) = amplitude*(cos(x + y + 0.3_dp) + 0.6_dp*cos(2*x - y) &
               + 0.3_dp*sin(3*y + x) + 0.2_dp*cos(4*x + 2*y) + 5.0_dp)
         end do
      end do
   end function waves

   !> A fixed uneven field of values between -1 and 1.
   function noise(nx, ny) result(field)
      integer, intent(in) :: nx, ny
      real(dp) :: field(nx, ny)
      integer :: i, j

      do j = 1, ny
         do i = 1, nx
            field(i, j) = 2.0_dp*modulo(sin(12.9898_dp*i + 78.233_dp*j)*43758.5453_dp, 1.0_dp) - 1.0_dp
         end do
      end do
   end function noise

   !> B u for G = 1 by a sum over the wave vectors. It uses no FFT, so that it is slow but independent of the library.
   function stiffness_sum(grid, u) result(traction)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: u(:, :)
      real(dp) :: traction(grid%nx, grid%ny)
      complex(dp) :: ex(0:grid%nx - 1), ey(0:grid%ny - 1), amplitude
      real(dp) :: q
      integer :: k, l, i, j

      ex = [(exp(cmplx(0.0_dp, 2.0_dp*pi*i/grid%nx, dp)), i=0, grid%nx - 1)]
      ey = [(exp(cmplx(0.0_dp, 2.0_dp*pi*j/grid%ny, dp)), j=0, grid%ny - 1)]
      traction = 0.0_dp
      do l = 0, grid%ny - 1
         do k = 0, grid%nx - 1
            q = 2.0_dp*pi*hypot(min(k, grid%nx - k)/grid%lx, min(l, grid%ny - l)/grid%ly)
            amplitude = 0.0_dp
            do j = 0, grid%ny - 1
               do i = 0, grid%nx - 1
                  amplitude = amplitude + u(i + 1, j + 1) &
                     *conjg(ex(modulo(k*i, grid%nx))*ey(modulo(l*j, grid%ny)))
               end do
            end do
            amplitude = amplitude*q/(1.0_dp - poisson)/(grid%nx*grid%ny)
            do j = 0, grid%ny - 1
               do i = 0, grid%nx - 1
                  traction(i + 1, j + 1) = traction(i + 1, j + 1) &
                     + real(amplitude*ex(modulo(k*i, grid%nx))*ey(modulo(l*j, grid%ny)), dp)
               end do
            end do
         end do
      end do
   end function stiffness_sum

   !> E(g) by that sum; history and load as given.
   function energy_sum(grid, problem, height, gap, past, load) result(energy)
      type(grid_type), intent(in) :: grid
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :), gap(:, :), past(:, :)
      real(dp), intent(in) :: load
      real(dp) :: energy

      energy = sum(0.5_dp*problem%modulus*(height + gap)*stiffness_sum(grid, height + gap) &
         - past*gap + adhesive_energy(problem%potential, gap) + load*gap)
   end function energy_sum

   !> The pressure of any state is the gradient of the energy without e'. The gradient is computed by central
   !> differences.
   subroutine pressure_is_gradient_of_energy(name)
      character(*), intent(in) :: name
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), start(:, :), pressure(:, :), past(:, :)
      real(dp) :: level, h, slope
      integer :: k, i, j

      grid = new_grid(9, 7, 1.0_dp, 0.6_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'solver')
      height = waves(grid, 0.01_dp)
      start = 0.02_dp*(1.2_dp + noise(9, 7))
      past = 0.05_dp*noise(9, 7)
      past = past - sum(past)/size(past)
      gap = start
      pressure = 0.0_dp*gap
      problem%potential = potential_of(name, 5e-4_dp, 0.02_dp)
      problem%modulus = modulus
      problem%target = 0.03_dp
      problem%max_iterations = 0
      call solver%solve(problem, height, gap, pressure, level, outcome, past)
      call check_that(outcome%iterations == 0 .and. .not. outcome%converged, 'no iteration')
      call check_that(all(gap == start), 'no iteration leaves the gap')
      h = 1e-6_dp
      do k = 1, 8
         i = 1 + modulo(5*k, 9)
         j = 1 + modulo(3*k, 7)
         start(i, j) = gap(i, j) + h
         slope = energy_sum(grid, problem, height, start, past, 0.03_dp)
         start(i, j) = gap(i, j) - h
         slope = (slope - energy_sum(grid, problem, height, start, past, 0.03_dp))/(2*h)
         start(i, j) = gap(i, j)
         ! Pressures are of order 0.1; h^2/6 e''' = 1e-9 of gamma/z_0, round-off 1e-16/1e-6.
         call check_close(pressure(i, j) + adhesive_slope(problem%potential, gap(i, j)), slope, &
            2e-9_dp, name//': gradient by differences')
      end do
      call solver%destroy()
   end subroutine pressure_is_gradient_of_energy

   !> The conditions of a solution hold when they are recomputed, for both controls, both starts, and with a
   !> history.
   subroutine solution_meets_its_conditions(nx, ny, lx, ly, name)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly
      character(*), intent(in) :: name
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :), past(:, :), other(:, :), &
         traction(:, :), shifted(:, :)
      type(convolution_type) :: operator
      real(dp), allocatable :: symbol(:, :)
      real(dp) :: level, scale, again, range
      integer :: i, j

      range = 0.02_dp
      grid = new_grid(nx, ny, lx, ly, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'solver')
      height = waves(grid, 0.01_dp)
      past = 0.05_dp*waves(grid, 1.0_dp)
      problem%potential = potential_of(name, 3e-4_dp, range)
      problem%modulus = modulus
      problem%target = 0.05_dp
      problem%tolerance = 1e-8_dp
      gap = maxval(height) - height
      pressure = 0.0_dp*gap
      call solver%solve(problem, height, gap, pressure, level, outcome, past)
      call check_that(outcome%converged, name//': '//trim(outcome%reason))
      scale = 3e-4_dp/range
      traction = modulus*stiffness_sum(grid, height + gap) - past
      traction = traction - sum(traction)/size(traction) + 0.05_dp
      call check_close(maxval(abs(traction - pressure)), 0.0_dp, 1e-11_dp, name//': pressure')
      call check_that(minval(gap) >= 0.0_dp .and. any(gap == 0.0_dp) .and. any(gap > 0.0_dp), &
         name//': a partial contact')
      traction = traction + adhesive_slope(problem%potential, gap)
      call check_close(maxval(abs(min(gap/range, traction/scale))), 0.0_dp, 1.01e-8_dp, &
         name//': natural residual')
      call check_close(outcome%residual, maxval(abs(min(gap/range, traction/scale))), 1e-10_dp, &
         name//': the residual that is returned')
      call check_that(minval(pressure, mask=gap == 0.0_dp) >= &
         -adhesive_slope(problem%potential, 0.0_dp) - 1e-8_dp*scale, name//': release rule')
      call check_close(sum(pressure)/size(pressure), 0.05_dp, 1e-14_dp, name//': load')
      call check_close(sum(gap + height)/size(gap) + level, 0.0_dp, 1e-14_dp, name//': level')

      ! If the level of that state is prescribed, the solver returns the state and its pressure.
      problem%control = control_approach
      problem%target = level
      other = gap
      again = 0.0_dp
      call solver%solve(problem, height, other, pressure, again, outcome, past)
      call check_that(outcome%converged, name//': level prescribed: '//trim(outcome%reason))
      call check_close(sum(pressure)/size(pressure), 0.05_dp, 1e-7_dp, name//': multiplier')
      call check_close(again, level, 1e-14_dp, name//': level kept')
      call check_close(maxval(abs(other - gap)), 0.0_dp, 1e-6_dp*range, name//': same gap')

      ! A history is equivalent to a change of the height, H' = H - A P_h/Q.
      allocate (symbol(0:nx/2, 0:ny/2), source=0.0_dp)
      do j = 0, ny/2
         do i = 0, nx/2
            if (i + j > 0) symbol(i, j) = (1.0_dp - poisson)/(2.0_dp*pi*hypot(i/lx, j/ly))
         end do
      end do
      call new_symbol_operator(operator, whole_shape(nx, ny, 1), error)
      call operator%set_symbol(symbol)
      shifted = height
      call operator%apply(past, shifted)
      shifted = height - shifted/modulus
      problem%control = control_pressure
      problem%target = 0.05_dp
      other = gap
      call solver%solve(problem, shifted, other, pressure, again, outcome)
      call check_that(outcome%converged, name//': no history: '//trim(outcome%reason))
      call check_close(maxval(abs(other - gap)), 0.0_dp, 1e-6_dp*range, name//': history as height')
      call operator%destroy()
      call solver%destroy()
   end subroutine solution_meets_its_conditions

   !> The thesis's method finds the same solution if the minimum is unique, at prescribed load and level.
   subroutine thesis_method_agrees(name)
      character(*), intent(in) :: name
      type(grid_type) :: grid
      type(adhesion_solver_type) :: fast, thesis
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :), past(:, :), other(:, :)
      real(dp) :: level, again

      grid = new_grid(35, 28, 1.0_dp, 0.9_dp, boundary_periodic)
      call new_adhesion_solver(fast, grid, normal_half_space(poisson), error)
      call new_adhesion_solver(thesis, grid, normal_half_space(poisson), error, method='thesis')
      call check_no_error(error, 'thesis')
      height = waves(grid, 0.02_dp)
      past = 0.02_dp*noise(35, 28)
      problem%potential = potential_of(name, 2e-4_dp, 0.02_dp)
      problem%modulus = modulus
      problem%target = 0.02_dp
      problem%tolerance = 1e-7_dp
      gap = maxval(height) - height
      other = gap
      pressure = 0.0_dp*gap
      call fast%solve(problem, height, gap, pressure, level, outcome, past)
      call check_that(outcome%converged, name//': fast: '//trim(outcome%reason))
      ! Cells beside the kink of Maugis-Dugdale cause many minima, close together. Therefore start near this
      ! one.
      if (name == 'maugis_dugdale') other = max(gap - 1e-3_dp*0.02_dp, 0.0_dp)
      call thesis%solve(problem, height, other, pressure, again, outcome, past)
      call check_that(outcome%converged, name//': thesis: '//trim(outcome%reason))
      call check_that(outcome%iterations > 10 .and. outcome%ffts >= 4*outcome%iterations, 'its cost', &
         [real(outcome%iterations, dp), real(outcome%ffts, dp)])
      call check_close(maxval(abs(other - gap)), 0.0_dp, 1e-4_dp*0.02_dp, name//': fast and thesis')
      call check_close(again, level, 1e-5_dp*0.02_dp, name//': fast and thesis: level')
      problem%control = control_approach
      problem%target = level + 0.01_dp
      call fast%solve(problem, height, gap, pressure, level, outcome, past)
      call check_that(outcome%converged, name//': fast, level: '//trim(outcome%reason))
      call thesis%solve(problem, height, other, pressure, again, outcome, past)
      call check_that(outcome%converged, name//': thesis, level: '//trim(outcome%reason))
      call check_close(maxval(abs(other - gap)), 0.0_dp, 1e-4_dp*0.02_dp, name//': the same, level')
      call fast%destroy()
      call thesis%destroy()
   end subroutine thesis_method_agrees

   !> The energy after k iterations decreases with k.
   subroutine energy_falls_with_the_iterations(name, method)
      character(*), intent(in) :: name, method
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :), none(:, :)
      real(dp) :: level, energy, before
      integer :: k

      grid = new_grid(20, 14, 1.0_dp, 0.9_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error, method=method)
      height = waves(grid, 0.02_dp)
      none = 0.0_dp*height
      problem%potential = potential_of(name, 2e-3_dp, 0.004_dp)
      problem%modulus = modulus
      problem%target = 0.02_dp
      before = huge(1.0_dp)
      do k = 0, 24
         problem%max_iterations = k
         gap = maxval(height) - height
         pressure = none
         call solver%solve(problem, height, gap, pressure, level, outcome)
         energy = energy_sum(grid, problem, height, gap, none, 0.02_dp)
         ! Round-off of energies of 0.5.
         call check_order(energy, '<=', before + 1e-13_dp, &
            name//' '//method//': the energy never rises')
         before = energy
         if (outcome%converged) exit
      end do
      call solver%destroy()
   end subroutine energy_falls_with_the_iterations

   !> dE/d(level) = N p along the states of prescribed level.
   subroutine force_is_derivative_of_energy()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :), none(:, :)
      real(dp) :: level, energy(-1:1), load, h
      integer :: k, step

      grid = new_grid(24, 15, 1.0_dp, 0.6_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      height = waves(grid, 0.01_dp)
      none = 0.0_dp*height
      problem%potential = potential_of('exponential', 5e-4_dp, 0.03_dp)
      problem%modulus = modulus
      problem%control = control_approach
      problem%tolerance = 1e-10_dp
      h = 1e-5_dp
      gap = maxval(height) - height
      pressure = none
      do k = 1, 3
         do step = -1, 1
            problem%target = -maxval(height) + 0.008_dp*(k - 2) + step*h
            call solver%solve(problem, height, gap, pressure, level, outcome)
            call check_that(outcome%converged, 'level: '//trim(outcome%reason))
            energy(step) = energy_sum(grid, problem, height, gap, none, 0.0_dp)
            if (step == 0) load = sum(pressure)
         end do
         ! The curvature of the energy changes where cells come into contact; the error is h times the change.
         call check_close((energy(1) - energy(-1))/(2*h), load, 1e-4_dp, 'force from the energy')
      end do
      call solver%destroy()
   end subroutine force_is_derivative_of_energy

   !> Without adhesion: Westergaard's wave, mean pressure p* sin^2(pi a/L), a line contact.
   subroutine westergaard_wave_without_adhesion()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :), other(:, :)
      real(dp) :: level, peak
      integer :: i
      integer, parameter :: n = 400

      grid = new_grid(n, 1, 1.0_dp, 1.0_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      allocate (height(n, 1))
      do i = 1, n
         height(i, 1) = 0.01_dp*cos(2.0_dp*pi*(i - 0.5_dp)/n)
      end do
      peak = pi*0.01_dp
      problem%modulus = modulus
      problem%target = peak*sin(pi*0.2_dp)**2
      problem%tolerance = 1e-9_dp
      gap = maxval(height) - height
      pressure = 0.0_dp*gap
      call solver%solve(problem, height, gap, pressure, level, outcome)
      call check_that(outcome%converged, 'no adhesion: '//trim(outcome%reason))
      call check_order(abs(count(gap == 0.0_dp)/real(n, dp) - 0.4_dp), '<=', 1.01_dp/n*2, 'width')
      ! p(0) = 2 p_mean/sin(psi_a); the error is of second order in the cell, apart from the edge.
      call check_close(maxval(pressure), 2*problem%target/sin(pi*0.2_dp), 1e-3_dp*peak, 'peak')
      problem%potential = potential_of('exponential', 0.0_dp, 1e-3_dp)
      other = maxval(height) - height
      call solver%solve(problem, height, other, pressure, level, outcome)
      call check_that(outcome%converged, 'no energy: '//trim(outcome%reason))
      call check_close(maxval(abs(other - gap)), 0.0_dp, 1e-8_dp, 'no energy is no adhesion')
      call solver%destroy()
   end subroutine westergaard_wave_without_adhesion

   !> Johnson's (1995) adhesive wave, a line contact of short range: at the half-width a
   !>     p = p* sin^2(psi) - sqrt(2 E* gamma tan(psi)/L),  psi = pi a/L.
   subroutine johnson_adhesive_wave()
      real(dp) :: coarse, fine

      call wave(200, 6e-3_dp, coarse)
      call wave(800, 3e-3_dp, fine)
      call check_close(fine, 0.0_dp, 0.02_dp, 'Johnson''s wave')
      call check_order(abs(fine), '<', 0.7_dp*abs(coarse), &
         'Johnson''s wave: converges with the mesh')

   contains

      !> Error of the load for the half-width that was found, in units of p*.
      subroutine wave(n, range, error_of_load)
         integer, intent(in) :: n
         real(dp), intent(in) :: range
         real(dp), intent(out) :: error_of_load
         type(grid_type) :: grid
         type(adhesion_solver_type) :: solver
         type(adhesion_problem_type) :: problem
         type(solver_result_type) :: outcome
         type(error_type), allocatable :: error
         real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :)
         real(dp) :: level, psi, peak
         integer :: i
         real(dp), parameter :: amplitude = 0.1_dp, gamma = 2e-3_dp

         grid = new_grid(n, 1, 1.0_dp, 1.0_dp/n, boundary_periodic)
         call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
         allocate (height(n, 1))
         do i = 1, n
            height(i, 1) = amplitude*cos(2.0_dp*pi*(i - 0.5_dp)/n)
         end do
         problem%modulus = modulus
         problem%control = control_approach
         problem%target = -0.05_dp
         problem%potential = potential_of('exponential', gamma, range)
         gap = maxval(height) - height
         pressure = 0.0_dp*gap
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged, 'Johnson''s wave: '//trim(outcome%reason))
         psi = pi*0.5_dp*count(gap == 0.0_dp)/n
         peak = pi*amplitude
         error_of_load = (sum(pressure)/n - (peak*sin(psi)**2 - sqrt(2*gamma*tan(psi))))/peak
         call solver%destroy()
      end subroutine wave

   end subroutine johnson_adhesive_wave

   !> Strong attraction of short range on a rough surface: the solver converges.
   subroutine strong_attraction_on_rough_surface()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :)
      real(dp) :: level
      integer :: l

      grid = new_grid(80, 66, 1.0_dp, 0.9_dp, boundary_periodic)
      height = waves(grid, 0.02_dp) + 0.002_dp*noise(80, 66)
      do l = 1, size(potentials)
         call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
         problem%modulus = modulus
         problem%target = 0.01_dp
         problem%potential = potential_of(trim(potentials(l)), 2e-3_dp, 1e-3_dp)
         gap = maxval(height) - height
         pressure = 0.0_dp*gap
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged .and. outcome%residual <= 1e-6_dp, &
            'strong '//trim(potentials(l))//': '//trim(outcome%reason))
         call check_that(all(abs(pressure) < 1e3_dp) .and. all(gap >= 0.0_dp), 'no NaN', &
            [maxval(abs(pressure)), minval(gap)])
         call solver%destroy()
      end do
   end subroutine strong_attraction_on_rough_surface

   !> If the gap at the start is too wide everywhere, the solution is the first one that a slow closing motion
   !> meets, although the energy has others with more contact. The test computes it by a motion so slow that
   !> it cannot miss it: it solves again and again with the attraction of the gap before, which is less than
   !> that of any solution below. The solver must also need few transforms.
   subroutine attraction_closes_as_in_a_slow_motion()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), slow(:, :), pressure(:, :), past(:, :)
      real(dp), parameter :: energy = 2.5e-4_dp, range = 4e-3_dp
      real(dp) :: level, change
      integer :: k

      grid = new_grid(64, 60, 1.0_dp, 0.9_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      height = waves(grid, 0.015_dp) + 0.001_dp*noise(64, 60)
      problem%modulus = modulus
      problem%target = 0.01_dp
      problem%tolerance = 1e-7_dp
      slow = maxval(height) - height
      pressure = 0.0_dp*slow
      call solver%solve(problem, height, slow, pressure, level, outcome)
      gap = slow
      do k = 1, 400
         past = -energy/range*exp(-slow/range)
         ! A traction from the past also moves the mean, which does not matter here.
         problem%target = 0.01_dp - sum(past)/size(past)
         change = sum(slow)
         call solver%solve(problem, height, slow, pressure, level, outcome, past)
         call check_that(outcome%converged, 'slow: '//trim(outcome%reason))
         if (abs(change - sum(slow)) < 1e-9_dp) exit
      end do
      problem%target = 0.01_dp
      problem%tolerance = 1e-6_dp
      problem%potential = potential_of('exponential', energy, range)
      call solver%solve(problem, height, gap, pressure, level, outcome)
      call check_that(outcome%converged, trim(outcome%reason))
      call check_close(maxval(abs(gap - slow)), 0.0_dp, 1e-2_dp*range, 'the first solution on the way')
      call check_that(count(gap == 0.0_dp) > 200, 'a contact', [real(count(gap == 0.0_dp), dp)])
      call check_order(real(outcome%ffts, dp), '<=', 80.0_dp, 'transforms')
      call solver%destroy()
   end subroutine attraction_closes_as_in_a_slow_motion

   !> Approach and retreat at prescribed level, each solve from the state before: there is attraction before
   !> contact, the surfaces separate at the end, and the retreat needs more work than the approach returns.
   subroutine pull_off_takes_more_work_than_approach()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :)
      real(dp) :: level, loads(0:40), levels(0:40), work
      integer :: k

      grid = new_grid(48, 40, 1.0_dp, 0.9_dp, boundary_periodic)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      height = waves(grid, 0.02_dp)
      problem%modulus = modulus
      problem%control = control_approach
      problem%potential = potential_of('exponential', 2e-3_dp, 0.008_dp)
      gap = maxval(height) - height
      pressure = 0.0_dp*gap
      do k = 0, 40
         levels(k) = -maxval(height) + 0.02_dp - 0.004_dp*abs(k - 20)
         problem%target = levels(k)
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged, 'loop: '//trim(outcome%reason))
         loads(k) = sum(pressure)/size(pressure)
      end do
      call check_that(all(abs(loads([0, 40])) < 1e-3_dp), 'apart at the ends', loads([0, 40]))
      call check_order(minval(loads), '<', -5e-3_dp, 'there is a pull-off')
      call check_order(maxval(abs(loads - loads(40:0:-1))), '>', 1e-3_dp, 'there is hysteresis')
      work = sum(0.5_dp*(loads(1:) + loads(:39))*(levels(1:) - levels(:39)))
      call check_order(work, '>', 0.0_dp, 'the loop loses energy')
      call solver%destroy()
   end subroutine pull_off_takes_more_work_than_approach

   !> The ratio of the form s.B_h s of the local model to s.B s, for single waves of all lengths and
   !> directions, is within the bounds that the theory states.
   subroutine model_is_near_the_operator(ratio, least, most)
      real(dp), intent(in) :: ratio                !! length of a cell over its width
      real(dp), intent(in) :: least, most
      integer, parameter :: nx = 144, ny = 120
      type(grid_type) :: grid
      type(adhesion_patch_type) :: patch
      type(adhesion_symbols_type) :: symbols
      type(adhesion_model_type) :: model
      type(error_type), allocatable :: error
      real(dp), allocatable :: wave(:, :), product(:, :)
      character(20) :: which
      real(dp) :: form
      integer :: i, j, k, l

      grid = new_grid(nx, ny, nx*ratio, real(ny, dp), boundary_periodic)
      call new_adhesion_patch(patch, grid, normal_half_space(poisson), symbols, error)
      call check_no_error(error, 'patch')
      call new_adhesion_model(model, nx, patch%sharing, symbols, patch%stiffness%modes(), patch%nyquist, error)
      call check_no_error(error, 'model')
      allocate (wave(nx, ny), product(nx, ny))
      do k = 0, nx/2, 3
         do l = 0, ny/2, 3
            if (k + l == 0) cycle
            do j = 1, ny
               wave(:, j) = [(cos(2.0_dp*pi*(k*i/real(nx, dp) + l*j/real(ny, dp))), i=1, nx)]
               call model%put_row(j, wave(:, j))
            end do
            call model%transform_product()
            do j = 1, ny
               call model%product_row(j, wave, product(:, j))
            end do
            form = sum(wave*product)/(sum(wave**2)*symbols%stiffness(k, l))
            write (which, '(a, i0, a, i0)') 'wave ', k, ', ', l
            call check_order(form, '<=', most, 'not much stiffer: '//which)
            call check_order(least, '<=', form, 'not much softer: '//which)
         end do
      end do
      call model%destroy()
      call patch%destroy()
   end subroutine model_is_near_the_operator

   !> Detachment, a closed gap, and an unknown method are reported.
   subroutine detached_closed_and_refused()
      type(grid_type) :: grid
      type(adhesion_solver_type) :: solver
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      real(dp), allocatable :: height(:, :), gap(:, :), pressure(:, :)
      real(dp) :: level
      integer :: k

      grid = new_grid(32, 24, 1.0_dp, 0.8_dp, boundary_periodic)
      height = waves(grid, 0.02_dp)
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
      do k = 1, size(potentials)
         problem%modulus = modulus
         problem%control = control_pressure
         problem%target = 0.02_dp
         problem%potential = potential_of(trim(potentials(k)), 2e-3_dp, 0.01_dp)
         gap = maxval(height) - height
         pressure = 0.0_dp*gap
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged, 'pressed: '//trim(outcome%reason))
         problem%target = -1e-3_dp
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged, trim(potentials(k))//' holds: '//trim(outcome%reason))
         call check_close(sum(pressure)/size(pressure), -1e-3_dp, 1e-14_dp, 'a pull is held')
         problem%target = -0.3_dp
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%reason == reason_detached .and. .not. outcome%converged, &
            trim(potentials(k))//' lets go: '//trim(outcome%reason))
      end do
      problem%control = control_approach
      problem%target = -sum(height)/size(height) + 1e-3_dp
      call solver%solve(problem, height, gap, pressure, level, outcome)
      call check_that(outcome%reason == reason_closed, 'no gap left')
      call solver%destroy()
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error, method='slow')
      call check_error(error, 'thesis', 'unknown method')
      call solver%destroy()
      grid%boundary = boundary_free
      call new_adhesion_solver(solver, grid, normal_half_space(poisson), error, method='thesis')
      call check_error(error, 'free', 'thesis on a free grid')
      call solver%destroy()
   end subroutine detached_closed_and_refused

   !> One and two threads give the same bits.
   subroutine same_bits_on_two_threads()
      type(grid_type) :: grid
      real(dp), allocatable :: height(:, :), first(:, :), second(:, :)

      grid = new_grid(160, 131, 1.0_dp, 0.7_dp, boundary_periodic)
      height = waves(grid, 0.01_dp)
      call one(1, first)
      call one(2, second)
      call set_threads(0)
      call check_that(all(first == second), 'threads do not matter')

   contains

      subroutine one(threads, gap)
         integer, intent(in) :: threads
         real(dp), allocatable, intent(out) :: gap(:, :)
         type(adhesion_solver_type) :: solver
         type(adhesion_problem_type) :: problem
         type(solver_result_type) :: outcome
         type(error_type), allocatable :: error
         real(dp), allocatable :: pressure(:, :)
         real(dp) :: level

         call set_threads(threads)
         call new_adhesion_solver(solver, grid, normal_half_space(poisson), error)
         problem%modulus = modulus
         problem%target = 0.02_dp
         problem%potential = potential_of('exponential', 1e-3_dp, 0.02_dp)
         gap = maxval(height) - height
         pressure = 0.0_dp*gap
         call solver%solve(problem, height, gap, pressure, level, outcome)
         call check_that(outcome%converged, trim(outcome%reason))
         call solver%destroy()
      end subroutine one

   end subroutine same_bits_on_two_threads

end module test_adhesion_cg
