!> Tests of a road that a force pulls: known solutions, and agreement with roads that are driven at a velocity.
module test_simulation_pull
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use asperity_simulation, only : new_simulation, simulation_type
   use simulation_runs, only : check_books, last, nl, record_type, run_case
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_simulation_pull

contains

   subroutine run_simulation_pull()
      call begin_suite('simulation_pull')
      if (selected('mindlin_cycle_under_a_force')) call mindlin_cycle_under_a_force()
      if (selected('sticking_block_creeps')) call sticking_block_creeps()
      if (selected('pulled_road_moves_like_a_driven_one')) then
         call pulled_road_moves_like_a_driven_one('.true.', 'fast')
         call pulled_road_moves_like_a_driven_one('.false.', 'fast')
         call pulled_road_moves_like_a_driven_one('.true.', 'thesis')
         call pulled_road_moves_like_a_driven_one('.false.', 'thesis')
      end if
      if (selected('long_travel_is_reported_once')) call long_travel_is_reported_once()
      if (selected('pull_beyond_friction_is_reported')) call pull_beyond_friction_is_reported()
      if (selected('a_smaller_pull_lets_a_sliding_road_spring_back')) call a_smaller_pull_lets_a_sliding_road_spring_back()
      if (selected('pulled_mass_accelerates')) call pulled_mass_accelerates()
      if (selected('slow_steps_do_not_need_the_mass')) call slow_steps_do_not_need_the_mass()
      if (selected('a_mass_accelerates_in_long_steps')) call a_mass_accelerates_in_long_steps()
      if (selected('pull_excludes_other_variables')) call pull_excludes_other_variables()
   end subroutine run_simulation_pull

   !> Mindlin and Deresiewicz's sphere with nu = 0 under a force that goes forwards and backwards: the motion of the road
   !> is known, and its loop closes.
   subroutine mindlin_cycle_under_a_force()
      type(record_type) :: record
      real(dp), parameter :: mu = 0.4_dp, modulus = 200e6_dp, radius = 50e-3_dp, load = 10.6667_dp
      real(dp), parameter :: part = 0.9_dp
      real(dp) :: a, way, full, q
      integer :: k

      call run_case('&grid nx = 64, ny = 64, lx = 2.5e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 50e-3 /'//nl// &
         '&material shear_modulus = 200e6, poisson = 0.0 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.4, slope_effect = .false. /'//nl// &
         '&phase force = 10.6667 /'//nl// &
         '&phase force_x = 3.840012, ramp = ''linear'', steps = 6 /'//nl// &
         '&phase force_x = -3.840012, ramp = ''linear'', steps = 12 /'//nl// &
         '&phase force_x = 3.840012, ramp = ''linear'', steps = 12 /'//nl// &
         '&solver tolerance = 1e-8 /', 'Mindlin', record)
      a = (0.75_dp*load*radius/(2.0_dp*modulus))**(1.0_dp/3.0_dp)
      full = 3.0_dp*mu*load*2.0_dp/(16.0_dp*modulus*a)
      do k = 1, 18
         if (k <= 6) then
            q = part*k/6
            way = full*(1.0_dp - (1.0_dp - q)**(2.0_dp/3.0_dp))
         else
            q = part*(1.0_dp - (k - 6)/6.0_dp)
            way = full*(2.0_dp*(1.0_dp - 0.5_dp*(part - q))**(2.0_dp/3.0_dp) &
               - (1.0_dp - part)**(2.0_dp/3.0_dp) - 1.0_dp)
         end if
         call check_close(record%drag(1, k), q*mu*load, 1e-6_dp*mu*load, 'Mindlin: the force of the input')
         call check_close(record%rows(k)%road_x, way, 2e-3_dp*full, 'Mindlin: the travel of the road')
      end do
      call check_close(record%rows(30)%road_x, record%rows(6)%road_x, 1e-6_dp*full, 'Mindlin: the loop closes')
      call check_close(maxval(abs(record%rows%road_y)), 0.0_dp, 1e-12_dp*full, 'Mindlin: no travel along y')
      call check_books(record, 'Mindlin')
   end subroutine mindlin_cycle_under_a_force

   !> A block that sticks everywhere creeps by the creep function of its shear, and recovers when the pull ends.
   subroutine sticking_block_creeps()
      type(record_type) :: record
      real(dp), parameter :: relaxed = 1e6_dp, glassy = 4e6_dp, thickness = 2e-3_dp, pull = 3e4_dp
      real(dp), parameter :: creep_time = 1e-2_dp*glassy/relaxed, hold = 0.08_dp
      real(dp) :: expected, step
      integer :: k

      step = thickness*pull
      call run_case('&grid nx = 8, ny = 6, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 3e6, prony_tau = 1e-2, thickness = 2e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 1 /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase traction_x = 3e4, duration = 0.08, steps = 160 /'//nl// &
         '&phase traction_x = 0, duration = 0.08, steps = 160 /'//nl//'&solver tolerance = 1e-10 /', &
         'creep', record)
      do k = 1, last(record)
         expected = step*compliance(record%rows(k)%time)
         if (record%rows(k)%phase == 3) expected = expected - step*compliance(record%rows(k)%time - hold)
         call check_close(record%rows(k)%road_x, expected, 2e-4_dp*step/relaxed, 'creep of a block')
         call check_close(record%rows(k)%stick_area, 1.0_dp, 0.0_dp, 'creep: all cells stick')
      end do
      call check_books(record, 'creep')

   contains

      !> Return J(t) in 1/Pa.
      pure real(dp) function compliance(time)
         real(dp), intent(in) :: time

         compliance = 1.0_dp/relaxed - (1.0_dp/relaxed - 1.0_dp/glassy)*exp(-time/creep_time)
      end function compliance

   end subroutine sticking_block_creeps

   !> A rough road in partial slip is pulled obliquely by jumps and ramps. A second run, driven at the velocities of the
   !> first one, has the same forces.
   subroutine pulled_road_moves_like_a_driven_one(slope_effect, method)
      character(*), intent(in) :: slope_effect
      character(*), intent(in) :: method            !! of the solvers
      type(record_type) :: driven, pulled
      character(*), parameter :: body = '&grid nx = 36, ny = 30, lx = 1e-3, ly = 0.9e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, rms_slope = 0.1, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.2e-3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-3, 1e-2, thickness = 1e-3 /'
      character(*), parameter :: phases(4) = [character(90) :: &
         'traction_x = 2e4, traction_y = -1e4, ramp = ''linear'', ', &
         'traction_x = 3.5e4, velocity_y = -1e-3, ramp = ''linear'', ', &
         'traction_x = 1e4, traction_y = -2e4, ramp = ''linear'', ', &
         'traction_x = 1e4, traction_y = -1e4, ramp = ''linear'', ']
      real(dp), parameter :: pull(2, 4) = reshape([2e4_dp, -1e4_dp, 3.5e4_dp, 0.0_dp, 1e4_dp, -2e4_dp, &
         1e4_dp, -1e4_dp], [2, 4]), dt = 2e-3_dp, area = 0.9e-6_dp
      character(:), allocatable :: start, text, solver
      integer :: k

      solver = '&solver tolerance = 1e-8, time_scheme = ''exponential'', max_iterations = 5000, method = '''// &
         method//''' /'
      start = body//nl//'&friction law = ''coulomb'', coefficient = 0.6, slope_effect = '//slope_effect// &
         ' /'//nl//'&phase pressure = 1e5, duration = 1e-3, steps = 1 /'//nl
      text = start
      do k = 1, 4
         text = text//'&phase '//trim(phases(k))//' duration = 2e-3, steps = 1 /'//nl
      end do
      call run_case(text//solver, 'pulled, '//method, pulled)
      call check_that(last(pulled) == 5, 'pulled: ramps have no row of their own')
      text = start
      do k = 2, 5
         text = text//'&phase velocity_x = '//exact_text((pulled%rows(k)%road_x - pulled%rows(k - 1)%road_x)/dt) &
            //', velocity_y = '//exact_text((pulled%rows(k)%road_y - pulled%rows(k - 1)%road_y)/dt)// &
            ', duration = 2e-3, steps = 1 /'//nl
      end do
      call run_case(text//solver, 'driven, '//method, driven)
      do k = 2, 5
         call check_close(pulled%drag(1, k)/area, pull(1, k - 1), 1e-2_dp, 'pulled: the force along x')
         if (k /= 3) call check_close(pulled%drag(2, k)/area, pull(2, k - 1), 1e-2_dp, 'pulled: the force along y')
         call check_close(driven%drag(1, k), pulled%drag(1, k), 1e-5_dp*3.5e4_dp*area, 'as driven: force along x')
         call check_close(driven%drag(2, k), pulled%drag(2, k), 1e-5_dp*3.5e4_dp*area, 'as driven: force along y')
         call check_close(driven%rows(k)%contact_area, pulled%rows(k)%contact_area, 2e-3_dp, 'as driven: area')
      end do
      call check_close(pulled%rows(3)%road_y - pulled%rows(2)%road_y, -1e-3_dp*dt, 1e-18_dp, &
         'pulled along x only: the road keeps its motion along y')
      call check_order(pulled%rows(4)%stick_area, '<', pulled%rows(4)%contact_area, &
         'pulled: some cells slip')
   end subroutine pulled_road_moves_like_a_driven_one

   !> A pull that moves the road by more than a cell in a step is reported once, with a step that is short enough.
   subroutine long_travel_is_reported_once()
      type(record_type) :: far, near
      character(*), parameter :: start = '&grid nx = 16, ny = 12, lx = 1e-3 /'//nl// &
         '&surface shape = ''flat'' /'//nl//'&material shear_modulus = 1e6, thickness = 4e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 1 /'//nl//'&phase pressure = 1e5 /'//nl
      integer :: first

      ! Under this pull the block is sheared by 0.32 mm, five cells, in two steps and in ten.
      call run_case(start//'&phase traction_x = 8e4, ramp = ''linear'', duration = 1, steps = 2 /', 'far', far)
      first = index(far%warnings, 'the pull moves the road by 2.56 cells in a step')
      call check_that(first > 0 .and. index(far%warnings, 'dt = 0.195312') > first, &
         'the warning gives the distance and a shorter step: '//far%warnings)
      call check_that(index(far%warnings, 'the pull moves', back=.true.) == first, 'a pull over several cells causes one warning')
      call run_case(start//'&phase traction_x = 8e4, ramp = ''linear'', duration = 1, steps = 10 /', 'near', near)
      call check_that(index(near%warnings, 'the pull moves') == 0, 'half a cell per step causes no warning')
      call run_case(start//'&phase traction_x = 8e4, duration = 1, steps = 10 /', 'jump', far)
      call check_order(index(far%warnings, 'let the pull grow along a ramp'), '>', 0, &
         'for a jump of the pull the warning recommends a ramp')
   end subroutine long_travel_is_reported_once

   !> A pull above what the friction holds gives a row that has not converged, and a reason that names the limit.
   subroutine pull_beyond_friction_is_reported()
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      integer :: k

      call parse_case('&grid nx = 16, ny = 12, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'//nl// &
         '&material shear_modulus = 1e6, thickness = 1e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.35 /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase traction_x = 2.4e4, traction_y = 3.2e4, ramp = ''linear'', duration = 1, steps = 4 /', &
         'test.nml', case, error)
      call check_no_error(error, 'beyond: input')
      call new_simulation(sim, case, error)
      do k = 0, 3
         call sim%advance(error)
         call check_that(sim%converged, 'beyond: the rows up to the limit converge')
      end do
      call sim%advance(error)
      call check_that(.not. sim%converged, 'beyond: not converged')
      call check_that(index(sim%reason, 'pulled by 40000 Pa') > 0 .and. &
         index(sim%reason, 'holds at most 35000 Pa') > 0, 'beyond: the reason: '//sim%reason)
      call check_close(sim%state%row%traction_y/sim%state%row%traction_x, 4.0_dp/3.0_dp, 1e-6_dp, 'beyond: the direction')
      call sim%destroy()
   end subroutine pull_beyond_friction_is_reported

   !> A line contact slides, and is then held by the part q of the sliding force. In plane strain with nu = 1/2 the normal and
   !> the tangential displacements of equal forces are equal. The traction is therefore mu (2 P' - P), where P' is the
   !> pressure under the part (1 + q)/2 of the load (Ciavarella 1998, Jaeger 1998), and the road springs back by 2 mu times
   !> the difference of the two approaches. On coarse grids the approaches depend on where the summit lies between the cells.
   subroutine a_smaller_pull_lets_a_sliding_road_spring_back()
      integer, parameter :: cells(5) = [16, 17, 24, 48, 96]
      real(dp), parameter :: parts(4) = [0.9_dp, 0.5_dp, 0.0_dp, -0.7_dp], mu = 0.3_dp, load = 2e4_dp
      type(record_type) :: pulled, pressed
      character(:), allocatable :: contact
      real(dp) :: back
      integer :: i, k

      do k = 1, size(cells)
         contact = '&grid nx = '//to_text(cells(k))//', ny = 1, lx = 1e-3 /'//nl// &
            '&surface shape = ''sine'', amplitude = 1e-5, wavelength = 1e-3 /'//nl// &
            '&material shear_modulus = 1e6, poisson = 0.5 /'//nl//'&solver tolerance = 1e-8 /'//nl
         do i = 1, size(parts)
            call run_case(contact//'&friction law = ''coulomb'', coefficient = 0.3, slope_effect = .false. /'//nl// &
               '&phase pressure = 2e4 /'//nl//'&phase duration = 1, steps = 4, velocity_x = 2e-4 /'//nl// &
               '&phase duration = 1, steps = 1, ramp = ''linear'', traction_x = '//exact_text(parts(i)*mu*load)//' /', &
               'springs back', pulled)
            call run_case(contact//'&phase pressure = 2e4 /'//nl// &
               '&phase pressure = '//exact_text(0.5_dp*(1.0_dp + parts(i))*load)//' /', 'approach', pressed)
            back = 2.0_dp*mu*(pressed%rows(0)%displacement - pressed%rows(1)%displacement)
            call check_close(abs(pulled%rows(5)%friction), abs(parts(i))*mu, 1e-5_dp, 'springs back: force')
            call check_close(pulled%rows(4)%road_x - pulled%rows(5)%road_x, back, &
               merge(0.1_dp, 0.3_dp, cells(k) >= 48)*back, 'springs back: way')
         end do
      end do
   end subroutine a_smaller_pull_lets_a_sliding_road_spring_back

   !> A pull of more than the friction accelerates the mass in steps of any length.
   subroutine a_mass_accelerates_in_long_steps()
      real(dp), parameter :: durations(3) = [0.1_dp, 1.0_dp, 1e4_dp], acceleration = 2e4_dp, strained = 6e-5_dp
      type(record_type) :: record
      integer :: i, k

      do i = 1, size(durations)
         call run_case('&grid nx = 8, ny = 8, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'//nl// &
            '&material shear_modulus = 1e6, thickness = 1e-3, density = 1000 /'//nl// &
            '&friction law = ''coulomb'', coefficient = 0.5 /'//nl//'&phase pressure = 1e5 /'//nl// &
            '&phase traction_x = 6e4, duration = '//exact_text(durations(i))//', steps = 4 /', 'long steps', record)
         do k = 2, 5
            associate (row => record%rows(k))
               call check_close(row%road_x, 0.5_dp*acceleration*row%time**2 + strained, 1e-6_dp*row%road_x, 'long steps: way')
            end associate
         end do
      end do
   end subroutine a_mass_accelerates_in_long_steps

   !> In steps much longer than the period of a block its mass does not matter: the road is where a force without a mass pulls
   !> it.
   subroutine slow_steps_do_not_need_the_mass()
      real(dp), parameter :: durations(3) = [5.0_dp, 50.0_dp, 5000.0_dp]
      character(*), parameter :: slope(2) = [character(7) :: '.true.', '.false.']
      type(record_type) :: heavy, light
      character(:), allocatable :: solid, rest
      integer :: i, k

      do i = 1, size(slope)
         do k = 1, size(durations)
            solid = '&grid nx = 16, ny = 1, lx = 1e-3 /'//nl// &
               '&surface shape = ''sine'', amplitude = 1e-5, wavelength = 1e-3 /'//nl// &
               '&material shear_modulus = 1e6, poisson = 0.5, thickness = 1e-3'
            rest = ' /'//nl//'&friction law = ''coulomb'', coefficient = 0.3, slope_effect = '//trim(slope(i))//' /'//nl// &
               '&phase pressure = 2e4 /'//nl//'&phase pressure = 1e4, duration = '//exact_text(durations(k))// &
               ', steps = 2, traction_x = 500, ramp = ''linear'' /'
            call run_case(solid//', density = 1e3'//rest, 'heavy', heavy)
            call run_case(solid//rest, 'light', light)
            call check_close(heavy%rows(2)%road_x, light%rows(2)%road_x, 1e-4_dp*light%rows(2)%road_x, 'slow steps: way')
            call check_close(heavy%rows(2)%friction, light%rows(2)%friction, 1e-4_dp*light%rows(2)%friction, &
               'slow steps: friction')
         end do
      end do
   end subroutine slow_steps_do_not_need_the_mass

   !> A block with mass that is pulled suddenly: m a = F - mu p, and its rubber is sheared at once.
   subroutine pulled_mass_accelerates()
      type(record_type) :: record
      real(dp), parameter :: acceleration = 2e4_dp, strained = 6e-5_dp
      integer :: k

      call run_case('&grid nx = 8, ny = 8, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'//nl// &
         '&material shear_modulus = 1e6, thickness = 1e-3, density = 1000 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase traction_x = 6e4, duration = 1e-3, steps = 400 /'//nl// &
         '&phase traction_x = 5e4, duration = 1e-4, steps = 40 /', 'mass', record)
      call check_close(record%rows(1)%road_x, strained, 1e-9_dp*strained, 'mass: the rubber is sheared at once')
      do k = 2, 401
         associate (row => record%rows(k))
            call check_close(row%road_x - strained, 0.5_dp*acceleration*row%time**2, &
               0.01_dp*acceleration*1e-3_dp*row%time, 'mass: way')
            call check_close(row%sliding_speed, acceleration*row%time, 0.01_dp*acceleration*1e-3_dp, 'mass: speed')
         end associate
      end do
      call check_close(record%rows(last(record))%sliding_speed, record%rows(401)%sliding_speed, 0.1_dp, &
         'mass: a pull as large as the friction keeps the speed')
   end subroutine pulled_mass_accelerates

   !> A pull excludes some variables and requires others.
   subroutine pull_excludes_other_variables()
      character(*), parameter :: start = '&grid nx = 8, ny = 8, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'// &
         nl//'&material shear_modulus = 1e6 /'//nl
      character(*), parameter :: rubs = '&friction law = ''coulomb'', coefficient = 0.5 /'//nl

      call fails(start//'&phase pressure = 1e5 /'//nl//'&phase traction_x = 1, duration = 1 /', 'needs &friction')
      call fails(start//rubs//'&phase pressure = 1e5, force_y = 1, velocity_y = 0, duration = 1 /', &
         'excludes velocity_y')
      call fails(start//rubs//'&phase pressure = 1e5, force_x = 1, traction_x = 2, duration = 1 /', &
         'traction_x and force_x')
      call fails(start//rubs//'&phase pressure = 1e5, traction_y = 2, relaxed = T, duration = 1 /', &
         'excludes relaxed')
      call fails(start//rubs//'&phase pressure = 1e5, traction_y = 2, steady = T, duration = 1 /', &
         'excludes steady')

   contains

      !> Check that the input is refused with a message that contains `message`.
      subroutine fails(text, message)
         character(*), intent(in) :: text, message
         type(case_type) :: case
         type(error_type), allocatable :: error

         call parse_case(text, 'test.nml', case, error)
         call check_error(error, message, message)
      end subroutine fails

   end subroutine pull_excludes_other_variables

end module test_simulation_pull
