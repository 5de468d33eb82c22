!> Tests of adhesive contact in periodic mode.
module test_adhesion_cg
   use adhesion_cg, only : adhesion_solver_type, new_adhesion_solver
   use adhesion_fixture, only : contact_type, new_contact
   use adhesion_model, only : adhesion_model_type, new_adhesion_model
   use adhesion_patch, only : adhesion_patch_type, new_adhesion_patch
   use adhesion_potential, only : adhesion_potential_type, adhesive_energy, adhesive_slope, &
      new_adhesion_potential
   use adhesion_state, only : adhesion_problem_type, control_approach, control_pressure, &
      reason_undetermined, reason_detached
   use adhesion_steps, only : choose_step, form_step_row, known_of_step, step_sums_type
   use adhesion_symbols, only : adhesion_symbols_type
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_symbol_operator
   use asperity_threads, only : set_threads
   use kernels, only : normal_half_space
   use asperity_precision, only : dp, pi
   use row_sharing, only : row_sharing_type
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
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
      if (selected('round_off_of_the_energy_is_no_rise')) call round_off_of_the_energy_is_no_rise()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads()
   end subroutine run_adhesion_cg

   !> Near the solution the gain of a step is far below the round-off of the energy, a sum over all cells. The whole step
   !> must be taken nevertheless if the slope vanishes at its end.
   subroutine round_off_of_the_energy_is_no_rise()
      integer, parameter :: n = 300
      type(adhesion_problem_type) :: problem
      type(step_sums_type) :: known, rows(n)
      type(row_sharing_type) :: sharing
      real(dp) :: gap(n, n), step(n, n), no_pressure(n), least
      integer :: i, j, k

      problem%potential = potential_of('exponential', 1.0_dp, 1.0_dp)
      no_pressure = 0.0_dp
      least = 1.0_dp
      do k = 1, 50
         do j = 1, n
            do i = 1, n
               gap(i, j) = 1.0_dp + sin(real(k*i + 3*j*j, dp))
               step(i, j) = 1e-10_dp*sin(real(7*i*j + k, dp))
            end do
            call form_step_row(problem, gap(:, j), no_pressure, step(:, j), rows(j))
         end do
         known = known_of_step(rows, sharing)
         known%form = 2.0_dp*abs(known%curvature)
         known%slope = -(known%form + known%curvature)
         least = min(least, choose_step(known, problem, gap, step, 1))
      end do
      call check_order(least, '>=', 1.0_dp, 'a step that gains less than round-off is taken')
   end subroutine round_off_of_the_energy_is_no_rise

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

   !> A contact with such a surface at first touch.
   subroutine new_waves(contact, nx, ny, lx, ly, amplitude, method)
      type(contact_type), intent(out) :: contact
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly, amplitude
      character(*), intent(in), optional :: method
      type(grid_type) :: grid

      grid = new_grid(nx, ny, lx, ly, boundary_periodic)
      call new_contact(contact, grid, poisson, modulus, waves(grid, amplitude), method)
   end subroutine new_waves

   !> A line contact with one wave at first touch.
   subroutine new_line(contact, n, ly, amplitude)
      type(contact_type), intent(out) :: contact
      integer, intent(in) :: n                     !! cells
      real(dp), intent(in) :: ly, amplitude
      real(dp) :: height(n, 1)
      integer :: i

      do i = 1, n
         height(i, 1) = amplitude*cos(2.0_dp*pi*(i - 0.5_dp)/n)
      end do
      call new_contact(contact, new_grid(n, 1, 1.0_dp, ly, boundary_periodic), poisson, modulus, height)
   end subroutine new_line

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

   !> E(g) by that sum, with a traction of the past and a load.
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
      type(contact_type) :: c
      real(dp), allocatable :: start(:, :), past(:, :)
      real(dp) :: h, slope
      integer :: k, i, j

      call new_waves(c, 9, 7, 1.0_dp, 0.6_dp, 0.01_dp)
      start = 0.02_dp*(1.2_dp + noise(9, 7))
      past = 0.05_dp*noise(9, 7)
      past = past - sum(past)/size(past)
      c%gap = start
      c%problem%potential = potential_of(name, 5e-4_dp, 0.02_dp)
      c%problem%target = 0.03_dp
      c%problem%max_iterations = 0
      call c%solve(past)
      call check_that(c%outcome%iterations == 0 .and. .not. c%outcome%converged, 'no iteration')
      call check_that(all(c%gap == start), 'no iteration leaves the gap')
      h = 1e-6_dp
      do k = 1, 8
         i = 1 + modulo(5*k, 9)
         j = 1 + modulo(3*k, 7)
         start(i, j) = c%gap(i, j) + h
         slope = energy_sum(c%grid, c%problem, c%height, start, past, 0.03_dp)
         start(i, j) = c%gap(i, j) - h
         slope = (slope - energy_sum(c%grid, c%problem, c%height, start, past, 0.03_dp))/(2*h)
         start(i, j) = c%gap(i, j)
         ! Pressures are of order 0.1; h^2/6 e''' = 1e-9 of gamma/z_0, round-off 1e-16/1e-6.
         call check_close(c%pressure(i, j) + adhesive_slope(c%problem%potential, c%gap(i, j)), slope, &
            2e-9_dp, name//': gradient by differences')
      end do
      call c%destroy()
   end subroutine pressure_is_gradient_of_energy

   !> The conditions of a solution hold when they are recomputed, for both controls, both starts, and with a
   !> traction of the past.
   subroutine solution_meets_its_conditions(nx, ny, lx, ly, name)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly
      character(*), intent(in) :: name
      type(contact_type) :: c
      real(dp), allocatable :: past(:, :), other(:, :), traction(:, :), shifted(:, :)
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp), allocatable :: symbol(:, :)
      real(dp) :: scale, again, range
      integer :: i, j

      range = 0.02_dp
      call new_waves(c, nx, ny, lx, ly, 0.01_dp)
      past = 0.05_dp*waves(c%grid, 1.0_dp)
      c%problem%potential = potential_of(name, 3e-4_dp, range)
      c%problem%target = 0.05_dp
      c%problem%tolerance = 1e-8_dp
      call c%converge(name, past)
      scale = 3e-4_dp/range
      traction = modulus*stiffness_sum(c%grid, c%height + c%gap) - past
      traction = traction - sum(traction)/size(traction) + 0.05_dp
      call check_close(maxval(abs(traction - c%pressure)), 0.0_dp, 1e-11_dp, name//': pressure')
      call check_that(minval(c%gap) >= 0.0_dp .and. any(c%gap == 0.0_dp) .and. any(c%gap > 0.0_dp), &
         name//': a partial contact')
      traction = traction + adhesive_slope(c%problem%potential, c%gap)
      call check_close(maxval(abs(min(c%gap/range, traction/scale))), 0.0_dp, 1.01e-8_dp, &
         name//': natural residual')
      call check_close(c%outcome%residual, maxval(abs(min(c%gap/range, traction/scale))), 1e-10_dp, &
         name//': the residual that is returned')
      call check_that(minval(c%pressure, mask=c%gap == 0.0_dp) >= &
         -adhesive_slope(c%problem%potential, 0.0_dp) - 1e-8_dp*scale, name//': release rule')
      call check_close(sum(c%pressure)/size(c%pressure), 0.05_dp, 1e-14_dp, name//': load')
      call check_close(sum(c%gap + c%height)/size(c%gap) + c%level, 0.0_dp, 1e-14_dp, name//': level')

      ! If the level of that state is prescribed, the solver returns the state and its pressure.
      c%problem%control = control_approach
      c%problem%target = c%level
      other = c%gap
      again = 0.0_dp
      call c%solver%solve(c%problem, c%height, other, c%pressure, again, c%outcome, past)
      call check_that(c%outcome%converged, name//': level prescribed: '//trim(c%outcome%reason))
      call check_close(sum(c%pressure)/size(c%pressure), 0.05_dp, 1e-7_dp, name//': multiplier')
      call check_close(again, c%level, 1e-14_dp, name//': level kept')
      call check_close(maxval(abs(other - c%gap)), 0.0_dp, 1e-6_dp*range, name//': same gap')

      ! A traction of the past is equivalent to a change of the height, H' = H - A P_h/Q.
      allocate (symbol(0:nx/2, 0:ny/2), source=0.0_dp)
      do j = 0, ny/2
         do i = 0, nx/2
            if (i + j > 0) symbol(i, j) = (1.0_dp - poisson)/(2.0_dp*pi*hypot(i/lx, j/ly))
         end do
      end do
      call new_symbol_operator(operator, whole_shape(nx, ny, 1), error)
      call operator%set_symbol(symbol)
      shifted = c%height
      call operator%apply(past, shifted)
      shifted = c%height - shifted/modulus
      c%problem%control = control_pressure
      c%problem%target = 0.05_dp
      other = c%gap
      call c%solver%solve(c%problem, shifted, other, c%pressure, again, c%outcome)
      call check_that(c%outcome%converged, name//': no past: '//trim(c%outcome%reason))
      call check_close(maxval(abs(other - c%gap)), 0.0_dp, 1e-6_dp*range, name//': past as height')
      call operator%destroy()
      call c%destroy()
   end subroutine solution_meets_its_conditions

   !> The thesis's method finds the same solution if the minimum is unique, at prescribed load and level.
   subroutine thesis_method_agrees(name)
      character(*), intent(in) :: name
      type(contact_type) :: fast, thesis
      real(dp), allocatable :: past(:, :)

      call new_waves(fast, 35, 28, 1.0_dp, 0.9_dp, 0.02_dp)
      call new_waves(thesis, 35, 28, 1.0_dp, 0.9_dp, 0.02_dp, 'thesis')
      past = 0.02_dp*noise(35, 28)
      fast%problem%potential = potential_of(name, 2e-4_dp, 0.02_dp)
      fast%problem%target = 0.02_dp
      fast%problem%tolerance = 1e-7_dp
      thesis%problem = fast%problem
      call fast%converge(name//': fast', past)
      ! Cells beside the kink of Maugis-Dugdale cause many minima, close together. Therefore start near this
      ! one.
      if (name == 'maugis_dugdale') thesis%gap = max(fast%gap - 1e-3_dp*0.02_dp, 0.0_dp)
      call thesis%converge(name//': thesis', past)
      associate (outcome => thesis%outcome)
         call check_that(outcome%iterations > 10 .and. outcome%ffts >= 4*outcome%iterations, 'its cost', &
            [real(outcome%iterations, dp), real(outcome%ffts, dp)])
      end associate
      call check_close(maxval(abs(thesis%gap - fast%gap)), 0.0_dp, 1e-4_dp*0.02_dp, name//': fast and thesis')
      call check_close(thesis%level, fast%level, 1e-5_dp*0.02_dp, name//': fast and thesis: level')

      fast%problem%control = control_approach
      fast%problem%target = fast%level + 0.01_dp
      thesis%problem = fast%problem
      call fast%converge(name//': fast, level', past)
      call thesis%converge(name//': thesis, level', past)
      call check_close(maxval(abs(thesis%gap - fast%gap)), 0.0_dp, 1e-4_dp*0.02_dp, name//': the same, level')
      call fast%destroy()
      call thesis%destroy()
   end subroutine thesis_method_agrees

   !> The energy after k iterations decreases with k.
   subroutine energy_falls_with_the_iterations(name, method)
      character(*), intent(in) :: name, method
      type(contact_type) :: c
      real(dp), allocatable :: none(:, :)
      real(dp) :: energy, before
      integer :: k

      call new_waves(c, 20, 14, 1.0_dp, 0.9_dp, 0.02_dp, method)
      none = 0.0_dp*c%height
      c%problem%potential = potential_of(name, 2e-3_dp, 0.004_dp)
      c%problem%target = 0.02_dp
      before = huge(1.0_dp)
      do k = 0, 24
         c%problem%max_iterations = k
         call c%touch()
         call c%solve()
         energy = energy_sum(c%grid, c%problem, c%height, c%gap, none, 0.02_dp)
         ! Round-off of energies of 0.5.
         call check_order(energy, '<=', before + 1e-13_dp, &
            name//' '//method//': the energy never rises')
         before = energy
         if (c%outcome%converged) exit
      end do
      call c%destroy()
   end subroutine energy_falls_with_the_iterations

   !> dE/d(level) = N p along the states of prescribed level.
   subroutine force_is_derivative_of_energy()
      type(contact_type) :: c
      real(dp), allocatable :: none(:, :)
      real(dp) :: energy(-1:1), load, h
      integer :: k, step

      call new_waves(c, 24, 15, 1.0_dp, 0.6_dp, 0.01_dp)
      none = 0.0_dp*c%height
      c%problem%potential = potential_of('exponential', 5e-4_dp, 0.03_dp)
      c%problem%control = control_approach
      c%problem%tolerance = 1e-10_dp
      h = 1e-5_dp
      do k = 1, 3
         do step = -1, 1
            c%problem%target = -maxval(c%height) + 0.008_dp*(k - 2) + step*h
            call c%converge('level')
            energy(step) = energy_sum(c%grid, c%problem, c%height, c%gap, none, 0.0_dp)
            if (step == 0) load = sum(c%pressure)
         end do
         ! The curvature of the energy changes where cells come into contact; the error is h times the change.
         call check_close((energy(1) - energy(-1))/(2*h), load, 1e-4_dp, 'force from the energy')
      end do
      call c%destroy()
   end subroutine force_is_derivative_of_energy

   !> Without adhesion: Westergaard's wave, mean pressure p* sin^2(pi a/L), a line contact.
   subroutine westergaard_wave_without_adhesion()
      type(contact_type) :: c
      real(dp), allocatable :: other(:, :)
      real(dp) :: peak
      integer :: i
      integer, parameter :: n = 400

      call new_line(c, n, 1.0_dp, 0.01_dp)
      peak = pi*0.01_dp
      c%problem%target = peak*sin(pi*0.2_dp)**2
      c%problem%tolerance = 1e-9_dp
      call c%converge('no adhesion')
      call check_order(abs(count(c%gap == 0.0_dp)/real(n, dp) - 0.4_dp), '<=', 1.01_dp/n*2, 'width')
      ! p(0) = 2 p_mean/sin(psi_a); the error is of second order in the cell, apart from the edge.
      call check_close(maxval(c%pressure), 2*c%problem%target/sin(pi*0.2_dp), 1e-3_dp*peak, 'peak')
      c%problem%potential = potential_of('exponential', 0.0_dp, 1e-3_dp)
      other = maxval(c%height) - c%height
      call c%solver%solve(c%problem, c%height, other, c%pressure, c%level, c%outcome)
      call check_that(c%outcome%converged, 'no energy: '//trim(c%outcome%reason))
      call check_close(maxval(abs(other - c%gap)), 0.0_dp, 1e-8_dp, 'no energy is no adhesion')
      call c%destroy()
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
         type(contact_type) :: c
         real(dp) :: psi, peak
         integer :: i
         real(dp), parameter :: amplitude = 0.1_dp, gamma = 2e-3_dp

         call new_line(c, n, 1.0_dp/n, amplitude)
         c%problem%control = control_approach
         c%problem%target = -0.05_dp
         c%problem%potential = potential_of('exponential', gamma, range)
         call c%converge('Johnson''s wave')
         psi = pi*0.5_dp*count(c%gap == 0.0_dp)/n
         peak = pi*amplitude
         error_of_load = (sum(c%pressure)/n - (peak*sin(psi)**2 - sqrt(2*gamma*tan(psi))))/peak
         call c%destroy()
      end subroutine wave

   end subroutine johnson_adhesive_wave

   !> Strong attraction of short range on a rough surface: the solver converges.
   subroutine strong_attraction_on_rough_surface()
      type(contact_type) :: c
      integer :: l

      do l = 1, size(potentials)
         call new_waves(c, 80, 66, 1.0_dp, 0.9_dp, 0.02_dp)
         c%height = c%height + 0.002_dp*noise(80, 66)
         call c%touch()
         c%problem%target = 0.01_dp
         c%problem%potential = potential_of(trim(potentials(l)), 2e-3_dp, 1e-3_dp)
         call c%converge('strong '//trim(potentials(l)))
         call check_order(c%outcome%residual, '<=', 1e-6_dp, 'strong: the residual')
         call check_that(all(abs(c%pressure) < 1e3_dp) .and. all(c%gap >= 0.0_dp), 'no NaN', &
            [maxval(abs(c%pressure)), minval(c%gap)])
         call c%destroy()
      end do
   end subroutine strong_attraction_on_rough_surface

   !> If the gap at the start is too wide everywhere, the solution is the first one that a slow closing motion
   !> meets, although the energy has others with more contact. The test computes it by a motion so slow that
   !> it cannot miss it: it solves again and again with the attraction of the gap before, which is less than
   !> that of any solution below. The solver must also need few transforms.
   subroutine attraction_closes_as_in_a_slow_motion()
      type(contact_type) :: c, slow
      real(dp), allocatable :: past(:, :)
      real(dp), parameter :: energy = 2.5e-4_dp, range = 4e-3_dp
      real(dp) :: change
      integer :: k

      call new_waves(slow, 64, 60, 1.0_dp, 0.9_dp, 0.015_dp)
      slow%height = slow%height + 0.001_dp*noise(64, 60)
      call slow%touch()
      slow%problem%target = 0.01_dp
      slow%problem%tolerance = 1e-7_dp
      call slow%solve()
      call new_contact(c, slow%grid, poisson, modulus, slow%height)
      c%gap = slow%gap
      do k = 1, 400
         past = -energy/range*exp(-slow%gap/range)
         ! A traction from the past also moves the mean, which does not matter here.
         slow%problem%target = 0.01_dp - sum(past)/size(past)
         change = sum(slow%gap)
         call slow%converge('slow', past)
         if (abs(change - sum(slow%gap)) < 1e-9_dp) exit
      end do
      c%problem%target = 0.01_dp
      c%problem%potential = potential_of('exponential', energy, range)
      call c%converge('from the state without adhesion')
      call check_close(maxval(abs(c%gap - slow%gap)), 0.0_dp, 1e-2_dp*range, 'the first solution on the way')
      call check_that(count(c%gap == 0.0_dp) > 200, 'a contact', [real(count(c%gap == 0.0_dp), dp)])
      call check_order(real(c%outcome%ffts, dp), '<=', 80.0_dp, 'transforms')
      call slow%destroy()
      call c%destroy()
   end subroutine attraction_closes_as_in_a_slow_motion

   !> Approach and retreat at prescribed level, each solve from the state before: there is attraction before
   !> contact, the surfaces separate at the end, and the retreat needs more work than the approach returns.
   subroutine pull_off_takes_more_work_than_approach()
      type(contact_type) :: c
      real(dp) :: loads(0:40), levels(0:40), work
      integer :: k

      call new_waves(c, 48, 40, 1.0_dp, 0.9_dp, 0.02_dp)
      c%problem%control = control_approach
      c%problem%potential = potential_of('exponential', 2e-3_dp, 0.008_dp)
      do k = 0, 40
         levels(k) = -maxval(c%height) + 0.02_dp - 0.004_dp*abs(k - 20)
         c%problem%target = levels(k)
         call c%converge('loop')
         loads(k) = sum(c%pressure)/size(c%pressure)
      end do
      call check_that(all(abs(loads([0, 40])) < 1e-3_dp), 'apart at the ends', loads([0, 40]))
      call check_order(minval(loads), '<', -5e-3_dp, 'there is a pull-off')
      call check_order(maxval(abs(loads - loads(40:0:-1))), '>', 1e-3_dp, 'there is hysteresis')
      work = sum(0.5_dp*(loads(1:) + loads(:39))*(levels(1:) - levels(:39)))
      call check_order(work, '>', 0.0_dp, 'the loop loses energy')
      call c%destroy()
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
      type(contact_type) :: c
      type(adhesion_solver_type) :: solver
      type(grid_type) :: grid
      type(error_type), allocatable :: error
      integer :: k

      call new_waves(c, 32, 24, 1.0_dp, 0.8_dp, 0.02_dp)
      do k = 1, size(potentials)
         c%problem%control = control_pressure
         c%problem%target = 0.02_dp
         c%problem%potential = potential_of(trim(potentials(k)), 2e-3_dp, 0.01_dp)
         call c%touch()
         call c%converge('pressed')
         c%problem%target = -1e-3_dp
         call c%converge(trim(potentials(k))//' holds')
         call check_close(sum(c%pressure)/size(c%pressure), -1e-3_dp, 1e-14_dp, 'a pull is held')
         c%problem%target = -0.3_dp
         call c%solve()
         call check_that(c%outcome%reason == reason_detached .and. .not. c%outcome%converged, &
            trim(potentials(k))//' lets go: '//trim(c%outcome%reason))
      end do
      c%problem%control = control_approach
      c%problem%target = -sum(c%height)/size(c%height) + 1e-3_dp
      call c%solve()
      call check_that(c%outcome%reason == reason_undetermined, 'no gap left')
      grid = c%grid
      call c%destroy()
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
      type(contact_type) :: c(2)
      integer :: threads

      do threads = 1, 2
         call set_threads(threads)
         call new_waves(c(threads), 160, 131, 1.0_dp, 0.7_dp, 0.01_dp)
         c(threads)%problem%target = 0.02_dp
         c(threads)%problem%potential = potential_of('exponential', 1e-3_dp, 0.02_dp)
         call c(threads)%converge('threads')
         call c(threads)%destroy()
      end do
      call set_threads(0)
      call check_that(all(c(1)%gap == c(2)%gap), 'threads do not matter')
   end subroutine same_bits_on_two_threads

end module test_adhesion_cg
