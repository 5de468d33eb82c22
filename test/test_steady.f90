!> Tests of steady sliding: closed forms, limits of the speed, invariances, balances, and continuation in time.
module test_steady
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use asperity_interpolation, only : interpolation_type, new_interpolation
   use asperity_threads, only : set_threads, thread_count
   use asperity_precision, only : dp, pi
   use friction_law, only : new_friction_law
   use prony, only : complex_modulus
   use asperity_schedule, only : planned_row_type
   use asperity_simulation, only : new_simulation, simulation_type
   use simulation_runs, only : check_books, last, nl, record_type, run_case, write_map
   use solver_result, only : solver_result_type
   use steady_pace, only : along_path, from_best, from_here, new_pace, no_attempt, pace_type
   use steady_contact, only : explain, sliding_outcome_type, steady_contact_type
   use steady_step, only : new_steady_step, steady_state_type, steady_step_type
   use asperity_surface, only : new_height
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_steady

   !> A road of random waves, 64 by 48 cells of 1 mm, and a rubber with two arms.
   character(*), parameter :: road = '&surface shape = ''self_affine'', hurst = 0.8, '// &
      'wavelength_long = 48e-3, wavelength_short = 8e-3, rms_slope = 0.15, seed = 3 /'//nl
   character(*), parameter :: rubber = '&material shear_modulus = 1e6, prony_g = 5e6, 4e6, '// &
      'prony_tau = 1e-2, 1e-4 /'//nl
   character(*), parameter :: grid = '&grid nx = 64, ny = 48, lx = 64e-3, ly = 48e-3 /'//nl

   character(*), parameter :: map_file = 'build/test_steady_map.h5'

contains

   subroutine run_steady()
      call begin_suite('steady')
      if (selected('full_contact_with_a_wave')) call full_contact_with_a_wave()
      if (selected('hunter_cylinder_in_steady_sliding')) call hunter_cylinder_in_steady_sliding()
      if (selected('steady_state_at_rest_and_at_high_speed')) &
         call steady_state_at_rest_and_at_high_speed()
      if (selected('rotated_and_mirrored_roads_agree')) call rotated_and_mirrored_roads_agree()
      if (selected('losses_balance_the_power_of_the_drive')) call losses_balance_the_power_of_the_drive()
      if (selected('all_cells_slip_at_any_tolerance')) call all_cells_slip_at_any_tolerance()
      if (selected('plane_strain_with_the_flat_law')) call plane_strain_with_the_flat_law()
      if (selected('run_continues_from_the_steady_state')) call run_continues_from_the_steady_state()
      if (selected('rows_of_a_curve_equal_single_rows')) call rows_of_a_curve_equal_single_rows()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads()
      if (selected('long_run_ends_in_the_steady_state')) call long_run_ends_in_the_steady_state()
      if (selected('error_against_a_run_falls_with_steps')) &
         call error_against_a_run_falls_with_steps()
      if (selected('all_starts_end_in_one_state')) call all_starts_end_in_one_state()
      if (selected('best_state_is_kept')) call best_state_is_kept()
      if (selected('constant_shear_at_the_edge')) call constant_shear_at_the_edge()
      if (selected('slow_contact_is_finished_by_newton')) call slow_contact_is_finished_by_newton()
      if (selected('stalled_rounds_are_solved_at_once')) call stalled_rounds_are_solved_at_once()
      if (selected('steep_roads_are_solved')) call steep_roads_are_solved()
      if (selected('attempts_begin_where_rounds_are_slow')) call attempts_begin_where_rounds_are_slow()
      if (selected('reasons_are_complete')) call reasons_are_complete()
   end subroutine run_steady

   !> Slow rounds lead to an attempt for all cells, on slopes sooner than on flat roads, on grids of any size. It may take
   !> the transforms that the rounds would take. Fast rounds lead to none.
   subroutine attempts_begin_where_rounds_are_slow()
      real(dp), parameter :: tolerance = 1e-6_dp, cells = 16384.0_dp
      type(pace_type) :: pace

      call do_rounds(.true., 8e-3_dp, 0.99_dp, cells)
      call check_that(pace%attempt == from_here, 'slow rounds on slopes')
      ! A round takes 14 transforms, and a factor of 0.99 takes 1/log10(1/0.99) rounds a decade.
      call check_close(pace%expected, 14.0_dp*(log10(8e-3_dp*0.99_dp**15/tolerance))/log10(1.0_dp/0.99_dp), 1e-6_dp, &
         'transforms that they need')
      call do_rounds(.false., 8e-3_dp, 0.99_dp, cells)
      call check_that(pace%attempt == no_attempt, 'slow rounds on a flat road, far from the solution')
      call do_rounds(.false., 8e-4_dp, 0.99_dp, cells)
      call check_that(pace%attempt == from_here, 'slow rounds on a flat road, near the solution')
      call do_rounds(.true., 8e-3_dp, 0.7_dp, cells)
      call check_that(pace%attempt == no_attempt, 'fast rounds')
      call do_rounds(.true., 8e-3_dp, 1.0_dp, 1e8_dp)
      call check_that(pace%attempt == from_here, 'rounds without progress on a large grid')
      call do_rounds(.true., 0.5_dp, 1.0_dp, cells, 64)
      call check_that(pace%attempt == from_best, 'rounds that stall far from the solution')
      call do_rounds(.true., 0.5_dp, 0.95_dp, cells, 64)
      call check_that(pace%attempt == no_attempt, 'slow rounds far from the solution')
      call do_rounds(.true., 0.5_dp, 1.0_dp, cells, 96)
      call check_that(pace%attempt == along_path, 'rounds that stall: a path')

   contains

      !> Report some rounds (16 unless told otherwise) whose change falls by a factor each.
      subroutine do_rounds(slope_effect, first, factor, size_of_grid, number)
         logical, intent(in) :: slope_effect
         real(dp), intent(in) :: first, factor, size_of_grid
         integer, intent(in), optional :: number
         integer :: k, rounds

         pace = new_pace(new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, slope_effect, .true.))
         rounds = 16
         if (present(number)) rounds = number
         do k = 1, rounds
            call pace%choose_attempt(k, first*factor**(k - 1), tolerance, size_of_grid)
         end do
      end subroutine do_rounds

   end subroutine attempts_begin_where_rounds_are_slow

   !> The reasons why there may be no solution fit into the record of an outcome.
   subroutine reasons_are_complete()
      type(steady_contact_type) :: contact
      type(sliding_outcome_type) :: outcome

      call explain(contact, new_friction_law('constant_shear', 0.0_dp, 1e5_dp, 0.0_dp, .true., .true.), outcome)
      call check_that(index(outcome%tangential%reason, '''coulomb_orowan''') > 0, 'the advice is complete: '// &
         trim(outcome%tangential%reason))

      contact%pressure = reshape([1e5_dp], [1, 1])
      contact%slope_x = reshape([2.0_dp], [1, 1])
      contact%slope_y = reshape([0.0_dp], [1, 1])
      call explain(contact, new_friction_law('coulomb', 1.0_dp, 0.0_dp, 0.0_dp, .true., .true.), outcome)
      call check_that(index(outcome%tangential%reason, '1/coefficient') > 0, 'the reason is complete: '// &
         trim(outcome%tangential%reason))
   end subroutine reasons_are_complete

   !> Full contact with a wave: P = p + K^-1 H, so that friction is k^2 h^2 G''(k V)/(2 (1-nu) p).
   subroutine full_contact_with_a_wave()
      type(record_type) :: record
      real(dp), parameter :: length = 10e-3_dp, height = 20e-6_dp, load = 2e5_dp, speed = 0.3_dp
      real(dp) :: exact, k

      k = 2.0_dp*pi/length
      exact = 0.5_dp*(k*height)**2*aimag(complex_modulus(1e6_dp, [5e6_dp, 4e6_dp], [1e-2_dp, 1e-4_dp], &
         k*speed))/(0.55_dp*load)
      call run_case('&grid nx = 32, ny = 6, lx = 10e-3 /'//nl//'&surface shape = ''sine'', amplitude = '// &
         exact_text(height)//', wavelength = 10e-3 /'//nl//'&material poisson = 0.45, shear_modulus = '// &
         '1e6, prony_g = 5e6, 4e6, prony_tau = 1e-2, 1e-4 /'//nl//'&phase steady = T, pressure = '// &
         exact_text(load)//', velocity_x = '//exact_text(speed)//' /', 'full contact', record)
      call check_close(record%rows(0)%contact_area, 1.0_dp, 0.0_dp, 'full contact')
      call check_close(record%rows(0)%friction/exact, 1.0_dp, 1e-12_dp, 'full contact: friction')
      call check_close(record%rows(0)%power_viscous/(exact*record%rows(0)%force*speed), 1.0_dp, 1e-12_dp, &
         'full contact: power')
   end subroutine full_contact_with_a_wave

   !> Hunter's cylinder (Hunter, 1961) at three speeds, as in test_simulation_sliding. The periodic cell has an error of
   !> order 1/L^2.
   subroutine hunter_cylinder_in_steady_sliding()
      real(dp), parameter :: velocity(3) = [5e-3_dp, 20e-3_dp, 100e-3_dp]
      real(dp), parameter :: half_width(3) = [0.73826627e-3_dp, 0.67155531e-3_dp, 0.39313100e-3_dp]
      real(dp), parameter :: exact(3) = [0.0043374599_dp, 0.0154266908_dp, 0.0367341527_dp]
      real(dp) :: friction(2), length
      type(record_type) :: record
      integer :: cells, k, m

      do k = 1, 3
         do m = 1, 2
            cells = 2048*m
            length = cells*half_width(k)/50.0_dp
            call run_case('&grid nx = '//to_text(cells)//', ny = 1, lx = '//exact_text(length)//' /'//nl// &
               '&surface shape = ''paraboloid'', radius = 10e-3 /'//nl// &
               '&material zener_g0 = 2.75e6, zener_g1 = 0.305555555555555e6, zener_eta = 3.05555555555555e3 /' &
               //nl//'&phase steady = T, pressure = '//exact_text(50.0_dp/length)//', velocity_x = '// &
               exact_text(velocity(k))//' /'//nl//'&solver tolerance = 1e-8 /', 'Hunter', record)
            friction(m) = record%rows(0)%friction
         end do
         friction(1) = friction(2) + (friction(2) - friction(1))/3.0_dp
         call check_close(friction(1)/exact(k), 1.0_dp, 5e-4_dp, 'Hunter, steady')
      end do
   end subroutine hunter_cylinder_in_steady_sliding

   !> At rest the steady state is the relaxed state; at a very low speed it is that of G_e, and at a very high one that of
   !> G(0).
   subroutine steady_state_at_rest_and_at_high_speed()
      type(record_type) :: slow, fast, relaxed, rest, glassy
      character(*), parameter :: case = grid//road//rubber//'&solver tolerance = 1e-9 /'//nl
      character(*), parameter :: line = '&grid nx = 256, ny = 1, lx = 64e-3 /'//nl//road//rubber// &
         '&solver tolerance = 1e-9 /'//nl

      call run_case(case//'&phase relaxed = T, pressure = 2e5 /', 'relaxed', relaxed)
      call run_case(case//'&phase steady = T, pressure = 2e5 /', 'steady at rest', rest)
      call run_case(case//'&phase steady = T, pressure = 2e5, velocity_x = -1e-8 /', 'slow', slow)
      call run_case(line//'&phase pressure = 2e5 /', 'glassy', glassy)
      call run_case(line//'&phase steady = T, pressure = 2e5, velocity_x = 1e8 /', 'fast', fast)
      call check_close(maxval(abs(rest%pressure - relaxed%pressure)), 0.0_dp, 0.0_dp, 'at rest')
      call check_close(maxval(abs(slow%pressure - relaxed%pressure))/maxval(relaxed%pressure), 0.0_dp, &
         1e-5_dp, 'slow: pressure of the relaxed state')
      call check_close(maxval(abs(slow%gap - relaxed%gap))/maxval(relaxed%gap), 0.0_dp, 1e-5_dp, 'slow: gap')
      call check_close(slow%rows(0)%displacement/relaxed%rows(0)%displacement, 1.0_dp, 1e-7_dp, &
         'slow: approach')
      call check_close(slow%rows(0)%energy_elastic/relaxed%rows(0)%energy_elastic, 1.0_dp, 1e-6_dp, &
         'slow: stored energy')
      call check_order(abs(slow%rows(0)%friction), '<', 1e-6_dp, 'slow: no friction')
      ! In a plane, waves across the motion stay relaxed at any speed; on a line there are none.
      call check_close(maxval(abs(fast%pressure - glassy%pressure))/maxval(glassy%pressure), 0.0_dp, &
         1e-5_dp, 'fast: pressure of a jump')
      call check_order(abs(fast%rows(0)%friction), '<', 1e-6_dp, 'fast: no friction')
      call check_books(slow, 'slow')
   end subroutine steady_state_at_rest_and_at_high_speed

   !> A road that is rotated by 90 degrees or mirrored gives the rotated or mirrored fields; friction, oblique direction.
   subroutine rotated_and_mirrored_roads_agree()
      type(record_type) :: straight, turned, mirrored
      real(dp) :: height(40, 32)

      height = wavy(40, 32)
      straight = slid('straight', height, 0.8_dp, 0.3_dp)
      turned = slid('turned', transpose(height), 0.3_dp, 0.8_dp)
      mirrored = slid('mirrored', height(40:1:-1, :), -0.8_dp, 0.3_dp)
      call check_close(maxval(abs(transpose(turned%pressure) - straight%pressure)) &
         /maxval(straight%pressure), 0.0_dp, 1e-6_dp, 'turned: pressure')
      call check_close(turned%rows(0)%friction/straight%rows(0)%friction, 1.0_dp, 1e-7_dp, 'turned: friction')
      call check_close(turned%rows(0)%traction_y/straight%rows(0)%traction_x, 1.0_dp, 1e-7_dp, &
         'turned: traction')
      call check_close(mirrored%rows(0)%friction/straight%rows(0)%friction, 1.0_dp, 1e-7_dp, &
         'mirrored: friction')
      call check_close(maxval(abs(mirrored%pressure(40:1:-1, :) - straight%pressure)) &
         /maxval(straight%pressure), 0.0_dp, 1e-6_dp, 'mirrored: pressure')
   end subroutine rotated_and_mirrored_roads_agree

   !> A smooth road without symmetry, m.
   function wavy(nx, ny) result(height)
      integer, intent(in) :: nx, ny
      real(dp) :: height(nx, ny)
      real(dp) :: x, y
      integer :: i, j

      do j = 1, ny
         do i = 1, nx
            x = 2.0_dp*pi*(i - 0.5_dp)/nx
            y = 2.0_dp*pi*(j - 0.5_dp)/ny
            height(i, j) = 1e-3_dp*(cos(x + 0.3_dp) + 0.6_dp*cos(2.0_dp*y - 0.7_dp) &
               + 0.4_dp*cos(2.0_dp*x + 3.0_dp*y) + 0.3_dp*cos(3.0_dp*x - y + 1.0_dp))
         end do
      end do
   end function wavy

   !> Return a steady row with friction on the slope, over a given road with cells of 1 mm.
   function slid(what, height, velocity_x, velocity_y, settings) result(record)
      character(*), intent(in) :: what
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: velocity_x, velocity_y
      character(*), intent(in), optional :: settings   !! of the law
      type(record_type) :: record
      character(:), allocatable :: more

      more = '&friction law = ''coulomb'', coefficient = 0.4 /'
      if (present(settings)) more = settings
      call write_map(map_file, height)
      call run_case('&grid nx = '//to_text(size(height, 1))//', ny = '//to_text(size(height, 2))// &
         ', lx = '//exact_text(1e-3_dp*size(height, 1))//' /'//nl// &
         '&surface shape = ''file'', file = '''//map_file//''' /'//nl//rubber//more//nl// &
         '&solver tolerance = 1e-8, interpolation = ''cubic'' /'//nl//'&phase steady = T, pressure = 5e4, '// &
         'velocity_x = '//exact_text(velocity_x)//', velocity_y = '//exact_text(velocity_y)//' /', &
         what, record)
   end function slid

   !> The power of the drive is lost in the rubber and by friction. Without the slope effect a part of it is missing.
   subroutine losses_balance_the_power_of_the_drive()
      type(record_type) :: slope, flat
      real(dp) :: drive

      slope = slid('slope', wavy(40, 32), 0.8_dp, 0.3_dp)
      associate (row => slope%rows(0))
         drive = row%friction*row%force*hypot(0.8_dp, 0.3_dp)
         call check_close((row%power_viscous + row%power_friction)/drive, 1.0_dp, 1e-9_dp, 'balance: slope')
         call check_that(row%power_viscous > 0.0_dp .and. row%power_friction > 0.0_dp, 'balance: losses', &
            [row%power_viscous, row%power_friction])
         call check_close(row%stick_area, 0.0_dp, 0.0_dp, 'no cell sticks')
         call check_close(row%sliding_speed, hypot(0.8_dp, 0.3_dp), 1e-12_dp, 'sliding speed')
         call check_close(row%residual_tangential, 0.0_dp, 1e-8_dp, 'tangential residual')
      end associate
      flat = slid('flat', wavy(40, 32), 0.8_dp, 0.3_dp, &
         '&friction law = ''coulomb'', coefficient = 0.4, slope_effect = F /')
      associate (row => flat%rows(0))
         drive = row%friction*row%force*hypot(0.8_dp, 0.3_dp)
         call check_close((row%power_viscous + row%power_friction)/drive, 1.0_dp, 0.1_dp, 'balance: flat')
      end associate
      call check_books(slope, 'steady, slope')
   end subroutine losses_balance_the_power_of_the_drive

   !> No cell sticks in steady sliding. With a coarse tolerance the tractions lie within their bounds by as much.
   subroutine all_cells_slip_at_any_tolerance()
      type(record_type) :: record
      character(*), parameter :: tolerances(3) = ['1e-3', '1e-5', '1e-7']
      integer :: k

      do k = 1, size(tolerances)
         call run_case(grid//road//rubber//'&friction law = ''coulomb'', coefficient = 0.3 /'//nl// &
            '&solver tolerance = '//tolerances(k)//' /'//nl// &
            '&phase steady = T, pressure = 2e5, velocity_x = 1. /', tolerances(k), record)
         call check_close(record%rows(0)%stick_area, 0.0_dp, 0.0_dp, 'no cell sticks: '//tolerances(k))
         call check_that(record%rows(0)%contact_area > 0.05_dp, 'cells touch: '//tolerances(k))
      end do
   end subroutine all_cells_slip_at_any_tolerance

   !> In plane strain with nu = 1/2 and without the slope effect T = mu P and A_xx = A_zz, so that U_x = mu U_z. The road is
   !> read at x + U_x, and has moved by the mean of U_x weighted with the pressure.
   subroutine plane_strain_with_the_flat_law()
      type(record_type) :: record

      call run_case('&grid nx = 256, ny = 1, lx = 64e-3 /'//nl//'&surface shape = ''sine'', amplitude = '// &
         '1e-3, wavelength = 32e-3 /'//nl//'&surface shape = ''sine'', amplitude = 0.3e-3, wavelength = '// &
         '6.4e-3 /'//nl//rubber//'&friction law = ''coulomb'', coefficient = 0.5, slope_effect = F /'//nl// &
         '&solver tolerance = 1e-9, interpolation = ''cubic'' /'//nl// &
         '&phase steady = T, pressure = 8e4, velocity_x = 0.2 /', 'plane strain', record)
      associate (row => record%rows(0))
         call check_close(row%traction_x/row%pressure, 0.5_dp, 1e-9_dp, 'plane strain: T = mu P')
         call check_close(row%road_x/(0.5_dp*sum(record%pressure*record%displacement) &
            /sum(record%pressure)), 1.0_dp, 1e-6_dp, 'plane strain: U_x = mu U_z')
      end associate
   end subroutine plane_strain_with_the_flat_law

   !> A steady phase with a duration continues from its state: only the error of the steps changes it, while a run from
   !> rest differs much more.
   subroutine run_continues_from_the_steady_state()
      type(record_type) :: steady, rest
      character(*), parameter :: steps = 'velocity_x = 0.5, duration = 12e-3, steps = 6 /'
      character(*), parameter :: laws(2) = [character(80) :: '', &
         '&friction law = ''coulomb'', coefficient = 0.4 / &solver passes = 8 /']
      integer :: k

      do k = 1, 2
         call run_case(grid//road//rubber//trim(laws(k))//nl//'&phase pressure = 1e5, steady = T, '//steps, &
            'onward', steady)
         call run_case(grid//road//rubber//trim(laws(k))//nl//'&phase pressure = 1e5, relaxed = T, '//steps, &
            'from rest', rest)
         call check_that(last(steady) == 6, 'onward: rows')
         call check_close(steady%rows(6)%contact_area/steady%rows(0)%contact_area, 1.0_dp, 0.05_dp, &
            'onward: contact')
         call check_order(abs(rest%rows(2)%contact_area/steady%rows(0)%contact_area - 1.0_dp), '>', 0.1_dp, &
            'from rest: contact')
         call check_close(steady%rows(6)%power_viscous/steady%rows(0)%power_viscous, 1.0_dp, 0.03_dp, &
            'onward: losses')
         call check_close(steady%rows(6)%energy_elastic/steady%rows(0)%energy_elastic, 1.0_dp, 0.03_dp, &
            'onward: stored energy')
         call check_books(steady, 'onward')
      end do
   end subroutine run_continues_from_the_steady_state

   !> A long run in time, with one cell per step, ends in the steady state of its own scheme: with the symbols of
   !> exponential2 the solver finds the same fields. With those of the continuum the difference is the error of the steps.
   subroutine long_run_ends_in_the_steady_state()
      character(*), parameter :: laws(3) = [character(80) :: '', &
         '&friction law = ''coulomb'', coefficient = 0.4, slope_effect = F /', &
         '&friction law = ''coulomb'', coefficient = 0.4 /']
      type(case_type) :: case
      type(simulation_type) :: sim
      type(steady_step_type) :: steady
      type(error_type), allocatable :: error
      integer :: c, law

      call write_map(map_file, 0.3_dp*wavy(16, 12))
      do law = 1, 3
         call parse_case('&grid nx = 16, ny = 12, lx = 16e-3 /'//nl//'&surface shape = ''file'', file = '''// &
            map_file//''' /'//nl//'&material shear_modulus = 1e6, prony_g = 3e6, prony_tau = 0.8e-3 /'//nl// &
            trim(laws(law))//nl//'&solver tolerance = 1e-10, passes = 30, interpolation = ''cubic'' /'//nl// &
            '&phase steady = T, pressure = 3e4, velocity_x = 0.5, duration = 64e-3, steps = 32 /', &
            'test.nml', case, error)
         call check_no_error(error, 'long run: input')
         call new_simulation(sim, case, error)
         call check_no_error(error, 'long run: simulation')
         do while (.not. sim%finished)
            call sim%advance(error)
         end do
         call find_steady(case, sim, 0.0_dp, steady)
         call compare('continuum', 0.2_dp)
         call steady%destroy()
         call find_steady(case, sim, 2e-3_dp, steady)
         call compare('scheme', 2e-7_dp)
         call steady%destroy()
         call sim%destroy()
      end do

   contains

      !> Compare the fields of the run and of the solver.
      subroutine compare(what, tolerance)
         character(*), intent(in) :: what
         real(dp), intent(in) :: tolerance

         associate (found => steady%contact)
            call check_close(norm2(sim%state%pressure - found%pressure)/norm2(found%pressure), 0.0_dp, tolerance, &
               'long run: pressure, '//what//' '//trim(laws(law)))
            do c = 1, merge(2, 0, law > 1)
               call check_close(norm2(sim%state%tangential%traction(:, c, :) - found%traction(:, c, :)) &
                  /norm2(found%traction), 0.0_dp, tolerance, 'long run: traction, '//what//' '// &
                  trim(laws(law)))
            end do
         end associate
      end subroutine compare

   end subroutine long_run_ends_in_the_steady_state

   !> The state at the end of a run in time, with one cell per step, differs from that of the continuum by the error of the
   !> steps and of the mesh, which decreases nearly with the square of the cell.
   subroutine error_against_a_run_falls_with_steps()
      type(case_type) :: case
      type(simulation_type) :: sim
      type(steady_step_type) :: steady
      type(error_type), allocatable :: error
      real(dp) :: difference(2), order
      integer :: k, n

      do k = 1, 2
         n = 16*2**k
         call write_map(map_file, 0.3_dp*wavy(n, 3*n/4))
         call parse_case('&grid nx = '//to_text(n)//', ny = '//to_text(3*n/4)//', lx = 16e-3 /'//nl// &
            '&surface shape = ''file'', file = '''//map_file//''' /'//nl// &
            '&material shear_modulus = 1e6, prony_g = 3e6, prony_tau = 3e-3 /'//nl// &
            '&solver tolerance = 1e-9 /'//nl//'&phase steady = T, pressure = 1e5, velocity_x = 0.5, '// &
            'duration = 64e-3, steps = '//to_text(2*n)//' /', 'test.nml', case, error)
         call check_no_error(error, 'order: input')
         call new_simulation(sim, case, error)
         call check_no_error(error, 'order: simulation')
         do while (.not. sim%finished)
            call sim%advance(error)
         end do
         call find_steady(case, sim, 0.0_dp, steady)
         difference(k) = norm2(sim%state%pressure - steady%contact%pressure)/norm2(steady%contact%pressure)
         call steady%destroy()
         call sim%destroy()
      end do
      order = log(difference(1)/difference(2))/log(2.0_dp)
      call check_close(order, 1.9_dp, 0.4_dp, 'order of the difference to a run in time')
   end subroutine error_against_a_run_falls_with_steps

   !> A start from rest, from another speed and from another load end in the same state.
   subroutine all_starts_end_in_one_state()
      type(record_type) :: cold, speed, load
      character(*), parameter :: case = '&grid nx = 32, ny = 24, lx = 64e-3, ly = 48e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 48e-3, wavelength_short = 16e-3,'// &
         ' rms_slope = 0.15, seed = 3 /'//nl//rubber//'&friction law = ''coulomb'', coefficient = 0.4 /'// &
         nl//'&solver tolerance = 1e-8 /'//nl
      character(*), parameter :: final = 'velocity_x = 0.4, velocity_y = 0.1 /'

      call run_case(case//'&phase steady = T, pressure = 1e5, '//final, 'cold start', cold)
      call run_case(case//'&phase steady = T, pressure = 1e5, velocity_x = 4e-3 /'//nl// &
         '&phase steady = T, '//final, 'from another speed', speed)
      call run_case(case//'&phase steady = T, pressure = 1e4, '//final//nl// &
         '&phase steady = T, pressure = 1e5, '//final, 'from another load', load)
      call check_close(maxval(abs(speed%pressure - cold%pressure))/maxval(cold%pressure), 0.0_dp, 1e-5_dp, &
         'one state from another speed')
      call check_close(maxval(abs(load%pressure - cold%pressure))/maxval(cold%pressure), 0.0_dp, 1e-5_dp, &
         'one state from another load')
      call check_close(speed%rows(1)%friction/cold%rows(0)%friction, 1.0_dp, 1e-6_dp, 'from another speed')
      call check_close(load%rows(1)%friction/cold%rows(0)%friction, 1.0_dp, 1e-6_dp, 'from another load')
   end subroutine all_starts_end_in_one_state

   !> On a road that wedges the rubber, more rounds never return a worse state, and the reason names the slopes. With this
   !> coefficient every face steeper than 1/4 holds any force, and the contact cannot avoid all of them. (With a coefficient
   !> of 1.5 there is a solution.)
   subroutine best_state_is_kept()
      type(solver_result_type) :: normal, tangential
      real(dp) :: missed(2)
      integer :: k

      do k = 1, 2
         call slide_uphill('law = ''coulomb'', coefficient = 4', 1, merge(100, 300, k == 1), normal, tangential)
         missed(k) = max(normal%residual, tangential%residual)
         call check_that(.not. (normal%converged .and. tangential%converged), 'wedged road: no solution is reported')
         call check_order(index(normal%reason, 'wedges'), '>', 0, &
            'wedged road: reason: '//trim(normal%reason))
      end do
      call check_order(missed(2), '<=', missed(1), &
         'wedged road: the error does not grow with the rounds: '// to_text(missed(2))//' after '//to_text(missed(1)))
   end subroutine best_state_is_kept

   !> Constant shear jumps at the edge of the contact, so that the rounds alternate. The closed form of the law, in which a
   !> cell may be partly sheared, is solved nevertheless, in few rounds.
   subroutine constant_shear_at_the_edge()
      type(solver_result_type) :: normal, tangential

      call slide_uphill('law = ''constant_shear'', shear_strength = 3e5, slope_effect = F', 1, 150, normal, tangential)
      call check_that(normal%converged .and. tangential%converged, 'edge: constant shear: '//trim(normal%reason))
      call slide_uphill('law = ''coulomb_orowan'', coefficient = 1, shear_strength = 3e5, slope_effect = F', &
         1, 150, normal, tangential)
      call check_that(normal%converged .and. tangential%converged, 'edge: a stress that grows with the pressure')
   end subroutine constant_shear_at_the_edge

   !> Under a rubber whose modulus spans three decades the splitting is slow, and Newton's method finishes the contact
   !> in half of the transforms. A solution to a finer tolerance, for which it starts from another state, is the same.
   subroutine slow_contact_is_finished_by_newton()
      character(*), parameter :: case = '&grid nx = 64, ny = 72, lx = 64e-3, ly = 72e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 32e-3, wavelength_short = 4e-3, '// &
         'rms_slope = 0.3, seed = 1 /'//nl//'&material shear_modulus = 1e6, prony_g = 999e6, prony_tau = 1 /'//nl// &
         '&phase steady = T, pressure = 1e6, velocity_x = 1e-5 /'//nl
      type(record_type) :: coarse, fine

      call run_case(case, 'finished', coarse)
      call run_case(case//'&solver tolerance = 1e-9 /', 'finished finely', fine)
      call check_order(int(coarse%rows(0)%ffts), '<', 280, 'finished by Newton: '//to_text(coarse%rows(0)%ffts))
      call check_order(int(fine%rows(0)%ffts), '<', 360, 'finished finely: '//to_text(fine%rows(0)%ffts))
      call check_close(maxval(abs(coarse%pressure - fine%pressure))/maxval(fine%pressure), 0.0_dp, 1e-3_dp, &
         'finished by Newton: pressure')
      call check_close(coarse%rows(0)%friction/fine%rows(0)%friction, 1.0_dp, 1e-5_dp, 'finished by Newton: friction')
   end subroutine slow_contact_is_finished_by_newton

   !> On a steep road some cells nearly stick, and the rounds converge slowly. All cells are then solved at once: from near
   !> the solution before many rounds are made, or from farther away along a path of solutions.
   subroutine stalled_rounds_are_solved_at_once()
      type(solver_result_type) :: normal, tangential

      call slide_uphill('law = ''coulomb'', coefficient = 0.8', 1, 120, normal, tangential)
      call check_that(normal%converged .and. tangential%converged, 'nearly sticking: '//trim(normal%reason))
      call slide_uphill('law = ''coulomb'', coefficient = 1.5', 2, 310, normal, tangential)
      call check_that(normal%converged .and. tangential%converged, 'along a path: '//trim(normal%reason))
      call check_order(tangential%iterations, '>=', 96, 'along a path: rounds')
   end subroutine stalled_rounds_are_solved_at_once

   !> On these steep roads rounds make hardly any progress, and neither further rounds nor a path whose part only grows lead
   !> to a solution. One is solved from the best contact, the other one along a path that turns back.
   subroutine steep_roads_are_solved()
      character(*), parameter :: road = '&grid nx = 12, ny = 12, lx = 12e-3 /'//nl//'&surface shape = '// &
         '''self_affine'', hurst = 0.8, wavelength_long = 6e-3, wavelength_short = 4e-3, rms_slope = 0.3, seed = '
      integer, parameter :: seeds(2) = [2, 11], rounds(2) = [64, 96], most(2) = [4000, 16000]
      type(record_type) :: record
      integer :: k

      do k = 1, size(seeds)
         call run_case(road//to_text(seeds(k))//' /'//nl//'&material shear_modulus = 1e6 /'//nl// &
            '&friction law = ''coulomb'', coefficient = 1 /'//nl// &
            '&phase steady = T, pressure = 7e5, velocity_x = 1 /'//nl, 'steep road', record)
         call check_that(record%rows(0)%iterations_tangential == rounds(k), 'steep road: rounds')
         call check_order(int(record%rows(0)%ffts), '<', most(k), 'steep road: '//to_text(record%rows(0)%ffts))
      end do
   end subroutine steep_roads_are_solved

   !> Run a number of rounds with a friction law on a steep road.
   subroutine slide_uphill(law, seed, rounds, normal, tangential)
      character(*), intent(in) :: law                  !! as in the group of the input
      integer, intent(in) :: seed                      !! of the road
      integer, intent(in) :: rounds                    !! largest number
      type(solver_result_type), intent(out) :: normal, tangential
      type(case_type) :: case
      type(steady_step_type) :: steady
      type(steady_state_type) :: state
      type(error_type), allocatable :: error
      type(interpolation_type) :: road
      type(planned_row_type) :: plan
      real(dp), allocatable :: height(:, :)

      call parse_case('&grid nx = 32, ny = 32, lx = 32e-3 /'//nl//'&surface shape = ''self_affine'', '// &
         'hurst = 0.8, wavelength_long = 16e-3, wavelength_short = 4e-3, rms_slope = 0.3, seed = '//to_text(seed)//' /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 9e6, prony_tau = 1e-2 /'//nl// &
         '&friction '//law//' /'//nl//'&solver max_iterations = '// &
         to_text(rounds)//' /'//nl//'&phase steady = T, pressure = 2e5, velocity_x = 0.1 /', 'test.nml', &
         case, error)
      call check_no_error(error, 'uphill: input')
      call new_height(case%grid, case%surfaces, height, error)
      call new_interpolation(road, case%grid, height, 'cubic', error)
      call new_steady_step(steady, state, case, 1e-3_dp, error)
      call check_no_error(error, 'uphill: steady')
      plan%load = case%phases(1)%target
      plan%velocity(1) = case%phases(1)%velocity_x
      call state%begin_curve([0.0_dp, 0.0_dp])
      call steady%solve(plan, road, state, normal, tangential)
      call steady%destroy()
   end subroutine slide_uphill

   !> Find the steady state of a case, with the road where a run in time has left it.
   subroutine find_steady(case, sim, dt, steady)
      type(case_type), intent(in) :: case
      type(simulation_type), intent(in) :: sim
      real(dp), intent(in) :: dt                       !! time step of the scheme, s; 0 for the continuum
      type(steady_step_type), intent(out) :: steady
      type(steady_state_type) :: state
      type(error_type), allocatable :: error
      type(interpolation_type) :: road
      type(planned_row_type) :: plan
      type(solver_result_type) :: normal, tangential
      real(dp), allocatable :: height(:, :)
      real(dp) :: base(2), place(2)
      integer :: k

      call new_height(case%grid, case%surfaces, height, error)
      call new_interpolation(road, case%grid, height, 'cubic', error)
      call new_steady_step(steady, state, case, sim%rms_height, error)
      call check_no_error(error, 'long run: steady')
      steady%scheme_dt = dt
      plan%load = case%phases(1)%target
      plan%velocity(1) = case%phases(1)%velocity_x
      place = [sim%state%row%road_x - 2.0_dp*case%grid%lx, sim%state%row%road_y]
      base = 0.0_dp
      ! The mean displacement of the contact hardly depends on the place, so that a few rounds move the road there.
      do k = 1, merge(4, 1, case%friction%law /= 'none')
         call state%begin_curve(base)
         call steady%solve(plan, road, state, normal, tangential)
         call check_that(normal%converged .and. tangential%converged, 'long run: steady converged')
         base = base + place - steady%place
      end do
   end subroutine find_steady

   !> The number of threads changes no bit of the result.
   subroutine same_bits_on_two_threads()
      type(record_type) :: one, two
      character(*), parameter :: case = '&grid nx = 132, ny = 128, lx = 132e-3 /'//nl//road//rubber// &
         '&friction law = ''coulomb'', coefficient = 0.3 /'//nl// &
         '&phase steady = T, pressure = 5e4, velocity_x = 0.1, velocity_y = 0.02 /'//nl// &
         '&solver tolerance = 1e-4 /'
      integer :: before

      before = thread_count()
      call set_threads(1)
      call run_case(case, 'one thread', one)
      call set_threads(2)
      call run_case(case, 'two threads', two)
      call set_threads(before)
      call check_that(all(abs(one%pressure - two%pressure) <= 0.0_dp) .and. &
         all(abs(one%drag - two%drag) <= 0.0_dp) .and. &
         abs(one%rows(0)%power_viscous - two%rows(0)%power_viscous) <= 0.0_dp, 'threads')
   end subroutine same_bits_on_two_threads

   !> The rows of a friction curve start from the rows before them, and end in the state of a single row.
   subroutine rows_of_a_curve_equal_single_rows()
      type(record_type) :: curve, alone
      character(*), parameter :: case = grid//road//rubber// &
         '&friction law = ''coulomb'', coefficient = 0.4, slope_effect = F / &solver tolerance = 1e-8 /'//nl

      call run_case(case//'&phase steady = T, pressure = 1e5, velocity_x = 0.05 /'//nl// &
         '&phase steady = T, velocity_x = 0.1 / &phase steady = T, velocity_x = 0.2 /'//nl// &
         '&phase steady = T, velocity_x = 0.4 /', 'curve', curve)
      call run_case(case//'&phase steady = T, pressure = 1e5, velocity_x = 0.4 /', 'alone', alone)
      call check_close(maxval(abs(curve%pressure - alone%pressure))/maxval(alone%pressure), 0.0_dp, 1e-5_dp, &
         'curve: pressure')
      call check_close(curve%rows(3)%friction/alone%rows(0)%friction, 1.0_dp, 1e-6_dp, 'curve: friction')
      call check_order(curve%rows(3)%ffts, '<', alone%rows(0)%ffts, &
         'curve: fewer transforms, '// to_text(curve%rows(3)%ffts)//' for '//to_text(alone%rows(0)%ffts))
   end subroutine rows_of_a_curve_equal_single_rows

end module test_steady
