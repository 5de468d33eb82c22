!> Tests of the step loop with friction: Mindlin's contact, energy balances, bounds, sums, stick and slip.
module test_simulation_friction
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use asperity_threads, only : set_threads
   use friction_bounds, only : largest_excess
   use asperity_precision, only : dp, int8
   use asperity_simulation, only : new_simulation, simulation_type
   use contact_fields, only : contact_rows, field_rows
   use simulation_runs, only : check_books, check_same_rows, last, nl, record_type, run_case
   use text_tools, only : exact_text, to_text
   use stick_slip_watch, only : stick_slip_watch_type, watch_slip
   implicit none
   private

   public :: run_simulation_friction

   !> A block with two arms and a mass on a periodic row of summits, driven obliquely.
   character(*), parameter :: block = &
      '&grid nx = 45, ny = 30, lx = 1.1e-3, ly = 0.8e-3 /'//nl// &
      '&surface shape = ''paraboloid'', radius = 10e-3 /'//nl
   character(*), parameter :: rubber = &
      '&material poisson = 0.4, shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-4, 1e-3, '// &
      'thickness = 1e-3, density = 2e4 /'//nl
   character(*), parameter :: drive = &
      '&phase pressure = 0.3e6, duration = 2e-4, steps = 4 /'//nl// &
      '&phase velocity_x = 0.4, velocity_y = -0.15, duration = 1e-3, steps = 20 /'//nl

contains

   subroutine run_simulation_friction()
      call begin_suite('simulation_friction')
      if (selected('mindlin_sphere_forwards_and_backwards')) call mindlin_sphere_forwards_and_backwards()
      if (selected('books_close_with_friction')) call books_close_with_friction()
      if (selected('zero_coefficient_leaves_the_viscous_friction')) call zero_coefficient_leaves_the_viscous_friction()
      if (selected('traction_is_within_its_bound')) call traction_is_within_its_bound()
      if (selected('all_sticks_or_all_slips')) call all_sticks_or_all_slips()
      if (selected('same_result_on_two_threads')) call same_result_on_two_threads()
      if (selected('numerical_stick_slip_is_reported')) call numerical_stick_slip_is_reported()
      if (selected('advice_on_stick_slip')) call advice_on_stick_slip()
      if (selected('contact_sticks_until_the_road_moves')) &
         call contact_sticks_until_the_road_moves()
      if (selected('first_slip_is_lost_in_full')) call first_slip_is_lost_in_full()
      if (selected('round_off_decides_nothing_after_a_stop')) call round_off_decides_nothing_after_a_stop()
      if (selected('jump_leaves_a_sticking_block_as_it_is')) call jump_leaves_a_sticking_block_as_it_is()
      if (selected('friction_begins_with_the_motion')) call friction_begins_with_the_motion()
      if (selected('cylinder_of_the_thesis')) call cylinder_of_the_thesis()
   end subroutine run_simulation_friction

   !> A flat half-space slides from the start on, so that the first step loses as much as any other. On a rough road it
   !> first sticks for a part of the step: a single step of one cell comes close to many short ones.
   subroutine first_slip_is_lost_in_full()
      character(*), parameter :: laws(2) = [character(60) :: 'law = ''coulomb'', coefficient = 0.5', &
         'law = ''constant_shear'', shear_strength = 5e4']
      character(*), parameter :: steps(2) = ['1 ', '32']
      real(dp), parameter :: shear = 5e4_dp, motion = 1e-3_dp/24, area = 1e-6_dp
      type(record_type) :: record
      real(dp) :: losses(2), works(2)
      integer :: k

      do k = 1, 2
         call run_case('&grid nx = 24, ny = 24, lx = 1e-3 /'//nl//'&surface shape = ''flat'' /'//nl// &
            '&material shear_modulus = 1e6 /'//nl//'&friction '//trim(laws(k))//' /'//nl// &
            '&phase pressure = 1e5 /'//nl//'&phase velocity_x = 0.1, duration = '//exact_text(2.0_dp*motion/0.1_dp)// &
            ', steps = 2 /', 'first slip', record)
         associate (rows => record%rows)
            call check_close(rows(1)%dissipated_friction, shear*area*motion, 1e-9_dp*shear*area*motion, 'first slip: loss')
            call check_close(rows(1)%work_drive, shear*area*motion, 1e-9_dp*shear*area*motion, 'first slip: drive')
            call check_close(rows(2)%work_drive, 2.0_dp*shear*area*motion, 1e-9_dp*shear*area*motion, 'second slip: drive')
            call check_close(rows(2)%work_missing, 0.0_dp, 1e-9_dp*shear*area*motion, 'first slip: balance')
         end associate
      end do
      do k = 1, 2
         call run_case('&grid nx = 24, ny = 24, lx = 1e-3 /'//nl//'&surface shape = ''self_affine'', hurst = 0.8, '// &
            'wavelength_long = 5e-4, wavelength_short = 2e-4, rms_slope = 0.2, seed = 3 /'//nl// &
            '&material shear_modulus = 1e6 /'//nl//'&friction '//trim(laws(1))//' /'//nl//'&phase pressure = 1e5 /'//nl// &
            '&phase velocity_x = 0.1, duration = '//exact_text(motion/0.1_dp)//', steps = '//trim(steps(k))//' /', &
            'first slip on a road', record)
         losses(k) = record%rows(last(record))%dissipated_friction
         works(k) = record%rows(last(record))%work_drive
      end do
      call check_close(losses(1), losses(2), 0.2_dp*losses(2), 'first slip on a road: loss')
      call check_close(works(1), works(2), 0.2_dp*works(2), 'first slip on a road: drive')
   end subroutine first_slip_is_lost_in_full

   !> When the road stops, the cells that slipped stay on their bounds without slipping. Whether the solver marks them as
   !> sticking is round-off, on which neither the stick area nor the loss of the next steps may depend.
   subroutine round_off_decides_nothing_after_a_stop()
      real(dp), parameter :: changes(4) = [0.0_dp, 1e-15_dp, -2e-15_dp, 3e-14_dp]
      type(record_type) :: first, record
      real(dp) :: loss
      integer :: k

      do k = 1, size(changes)
         call run_case('&grid nx = 16, ny = 9, lx = 1e-3 /'//nl//'&surface shape = ''self_affine'', hurst = 0.8, '// &
            'wavelength_long = 1e-3, wavelength_short = 2.5e-4, rms_slope = 0.3, seed = 5 /'//nl// &
            '&material shear_modulus = 1e6 /'//nl// &
            '&friction law = ''coulomb'', coefficient = 0.36, slope_effect = .false. /'//nl// &
            '&phase pressure = '//exact_text(1.5e5_dp*(1.0_dp + changes(k)))//' /'//nl// &
            '&phase velocity_x = 0.1, duration = 3e-3, steps = 6 /'//nl//'&phase duration = 1e-3, steps = 2 /'//nl// &
            '&phase velocity_x = -0.05, velocity_y = 0.03, duration = 2e-3, steps = 4 /', 'stop', record)
         if (k == 1) first = record
         associate (rows => record%rows)
            loss = rows(9)%dissipated_friction - rows(8)%dissipated_friction
            call check_close(rows(8)%stick_area, rows(8)%contact_area, 0.0_dp, 'stop: all cells stick')
            call check_close(loss, first%rows(9)%dissipated_friction - first%rows(8)%dissipated_friction, 1e-6_dp*loss, &
               'stop: loss of the next step')
         end associate
      end do
   end subroutine round_off_decides_nothing_after_a_stop

   !> A jump of the load does not move a block with mass that sticks in the whole cell: nothing changes but the pressure. All
   !> displacements that the solver sees are then round-off, and must not count as a residual. The tractions of the wavy
   !> road are uniform, those of the rough one with arms are not.
   subroutine jump_leaves_a_sticking_block_as_it_is()
      character(*), parameter :: roads(2) = [character(120) :: 'shape = ''sine'', amplitude = 1e-6, wavelength = 1e-3', &
         'shape = ''self_affine'', hurst = 0.8, rms_slope = 0.05, wavelength_long = 1e-3, wavelength_short = 2.5e-4']
      character(*), parameter :: arms(2) = [character(40) :: '', ', prony_g = 1e6, prony_tau = 1e-3']
      character(*), parameter :: loads(2) = ['1.2e6', '0.8e6']
      type(record_type) :: record
      integer :: k, m

      do k = 1, size(roads)
         do m = 1, size(loads)
            call run_case('&grid nx = 8, ny = 8, lx = 1e-3 /'//nl//'&surface '//trim(roads(k))//' /'//nl// &
               '&material shear_modulus = 1e6, thickness = 1e-3, density = 1000.'//trim(arms(k))//' /'//nl// &
               '&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
               '&phase pressure = 1e6, duration = 1e-3, steps = 4, velocity_x = 1e-3 /'//nl// &
               '&phase pressure = '//loads(m)//', duration = 1e-3, steps = 4, velocity_x = 1e-3 /', &
               'jump while all sticks', record)
            associate (rows => record%rows)
               call check_close(rows(5)%contact_area, 1.0_dp, 0.0_dp, 'jump while all sticks: full contact')
               call check_order(rows(4)%traction_x, '>', 900.0_dp, 'jump while all sticks: traction')
               call check_close(rows(5)%traction_x, rows(4)%traction_x, 1e-9_dp*rows(4)%traction_x, &
                  'jump while all sticks: the traction stays')
               call check_that(rows(5)%iterations_tangential == 0, 'jump while all sticks: no iteration')
            end associate
         end do
      end do
   end subroutine jump_leaves_a_sticking_block_as_it_is

   !> `friction` is 0 until the road has moved, also if the first phase moves it from its first row on.
   subroutine friction_begins_with_the_motion()
      type(record_type) :: record

      call run_case('&grid nx = 16, ny = 16, lx = 1e-3 /'//nl//'&surface shape = ''self_affine'', hurst = 0.8, '// &
         'wavelength_long = 5e-4, wavelength_short = 2.5e-4, rms_slope = 0.3, seed = 2 /'//nl// &
         '&material shear_modulus = 1e6, thickness = 1e-3 /'//nl//'&friction law = ''coulomb'', coefficient = 0.3 /'//nl// &
         '&phase pressure = 1e5, duration = 1e-3, steps = 2, velocity_x = 0.1 /', 'first motion', record)
      call check_close(record%rows(0)%friction, 0.0_dp, 0.0_dp, 'friction before the first motion')
      call check_close(record%rows(0)%friction_viscous, 0.0_dp, 0.0_dp, 'viscous friction before the first motion')
      call check_order(record%rows(1)%friction, '>', 0.01_dp, 'friction of the first motion')
   end subroutine friction_begins_with_the_motion

   !> The cylinder of thesis 3.5.1 in steady sliding. The viscous force is exact (Hunter 1961), 4.7106
   !> N/m; with it the totals are 154.71 N/m without slope and 166.89 N/m with it. At 96 cells over the
   !> contact and a period of 21 contacts the mesh and the images change the viscous part by 0.6 %.
   subroutine cylinder_of_the_thesis()
      real(dp), parameter :: viscous = 4.7106_dp, totals(2) = [154.71_dp, 166.89_dp]
      real(dp), parameter :: load = 100.0_dp          !! N/m
      character(7), parameter :: slope(2) = ['.false.', '.true. ']
      type(record_type) :: record
      integer :: k

      do k = 1, 2
         call run_case('&grid nx = 2048, ny = 1, lx = 24e-3, ly = 1e-3 /'//nl// &
            '&surface shape = ''paraboloid'', radius = 10e-3 /'//nl// &
            '&material shear_modulus = 0.333e6, prony_g = 3e6, prony_tau = 1.11e-3 /'//nl// &
            '&friction law = ''coulomb'', coefficient = 1.5, slope_effect = '//slope(k)//' /'//nl// &
            '&phase force = 0.1, relaxed = .true. /'//nl// &
            '&phase velocity_x = 0.11, duration = 45e-3 /'//nl// &
            '&solver tolerance = 1e-6 /', 'cylinder', record)
         associate (row => record%rows(last(record)))
            call check_close(row%friction_viscous*load, viscous, 0.01_dp*viscous, 'cylinder: viscous part')
            call check_close(row%friction*load, totals(k), 0.002_dp*totals(k), &
               'cylinder: whole horizontal force, slope '//slope(k))
            call check_close(row%stick_area, 0.0_dp, 0.0_dp, 'cylinder: no cell sticks')
         end associate
      end do
   end subroutine cylinder_of_the_thesis

   !> Mindlin's sphere with nu = 0: the tangential force as a function of the road's motion, forwards, backwards and
   !> forwards again (Mindlin and Deresiewicz 1953).
   subroutine mindlin_sphere_forwards_and_backwards()
      real(dp), parameter :: g = 1e6_dp, radius = 10e-3_dp, a = 1e-3_dp, mu = 0.01_dp, v = 1e-3_dp
      real(dp), parameter :: full = mu*a**2/radius     !! road's motion to full slip, m
      type(record_type) :: record
      real(dp) :: load, expected, top, x, worst
      character(:), allocatable :: text
      integer :: k

      load = 8.0_dp*g*a**3/(3.0_dp*radius)
      text = '&grid nx = 72, ny = 64, lx = 2.7e-3, ly = 2.4e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''sphere'', radius = 10e-3 /'//nl// &
         '&material poisson = 0, shear_modulus = 1e6 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.01, slope_effect = .false. /'//nl// &
         '&phase force = '//exact_text(load)//' /'//nl// &
         '&phase velocity_x = 1e-3, duration = '//exact_text(0.7_dp*full/v)//', steps = 4 /'//nl// &
         '&phase velocity_x = -1e-3, duration = '//exact_text(1.0_dp*full/v)//', steps = 4 /'//nl// &
         '&phase velocity_x = 1e-3, duration = '//exact_text(1.0_dp*full/v)//', steps = 4 /'//nl// &
         '&solver tolerance = 1e-7 /'
      call run_case(text, 'Mindlin', record)
      top = loading(0.7_dp)
      worst = 0.0_dp
      do k = 1, last(record)
         x = record%rows(k)%road_x/full
         if (k <= 4) then
            expected = loading(x)
         else if (k <= 8) then
            expected = top - 2.0_dp*loading((0.7_dp - x)/2.0_dp)
         else
            expected = top - 2.0_dp*loading(0.5_dp) + 2.0_dp*loading((x + 0.3_dp)/2.0_dp)
         end if
         worst = max(worst, abs(record%drag(1, k)/(mu*load) - expected))
      end do
      call check_close(worst, 0.0_dp, 2e-3_dp, 'Mindlin: force on all three ways')
      call check_close(record%drag(1, last(record)), record%drag(1, 4), 1e-3_dp*mu*load, &
         'Mindlin: the loop closes')
      call check_order(record%rows(8)%dissipated_friction, '>', record%rows(4)%dissipated_friction, &
         'Mindlin: slip on the way back loses energy, too')

   contains

      !> Return the force relative to that of full slip for a motion x relative to that at full slip.
      pure real(dp) function loading(x)
         real(dp), intent(in) :: x

         loading = 1.0_dp - (1.0_dp - x)**1.5_dp
      end function loading

   end subroutine mindlin_sphere_forwards_and_backwards

   !> The energy balance closes with friction, viscoelasticity, inertia, and with and without the slope effect.
   subroutine books_close_with_friction()
      type(record_type) :: record

      call run_case(block//rubber//'&friction law = ''coulomb'', coefficient = 0.6 /'//nl//drive// &
         '&solver tolerance = 1e-9 /', 'all together', record)
      call check_books(record, 'all together', 1e-8_dp)
      call check_order(record%rows(last(record))%dissipated_friction, '>', 0.0_dp, &
         'friction loses energy')
      call check_order(maxval(record%rows%energy_kinetic), '>', 0.0_dp, 'the mass moves')
      ! With the slope effect T includes -P grad H, so that the whole force is the sum of T.
      call check_close(record%drag(1, last(record)), record%rows(last(record))%traction_x*0.88e-6_dp, &
         1e-12_dp*maxval(abs(record%drag)), 'with slope: the force is the sum of T')
      call run_case(block//rubber//'&friction law = ''coulomb'', coefficient = 0.6, '// &
         'slope_effect = .false. /'//nl//drive//'&solver tolerance = 1e-9 /', 'no slope', record)
      call check_books(record, 'no slope', 1e-8_dp)
      associate (row => record%rows(last(record)))
         call check_close(row%friction, dot_product([row%traction_x, row%traction_y], &
            [0.4_dp, -0.15_dp]/hypot(0.4_dp, 0.15_dp))/row%pressure + row%friction_viscous, 1e-12_dp, &
            'without slope: the force is the sum of T and of -P grad H')
      end associate
   end subroutine books_close_with_friction

   !> With mu = 0 and the slope effect the tangential force is that of a road without friction.
   subroutine zero_coefficient_leaves_the_viscous_friction()
      type(record_type) :: record

      call run_case(block//rubber//'&friction law = ''coulomb'', coefficient = 0 /'//nl//drive// &
         '&solver tolerance = 1e-8 /', 'mu = 0', record)
      associate (row => record%rows(last(record)))
         call check_close(row%friction, row%friction_viscous, 1e-12_dp, 'mu = 0: viscous friction only')
         call check_close(row%dissipated_friction, 0.0_dp, 1e-12_dp*row%work_normal, 'mu = 0: friction loses no energy')
      end associate
   end subroutine zero_coefficient_leaves_the_viscous_friction

   !> In each row the traction lies within the bound of that row's pressure.
   subroutine traction_is_within_its_bound()
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      real(dp), allocatable :: p(:, :), tx(:, :), ty(:, :), none(:, :)
      integer(int8), allocatable :: contact(:, :)
      real(dp) :: worst

      call parse_case(block//rubber//'&friction law = ''coulomb'', coefficient = 0.6, '// &
         'slope_effect = .false. /'//nl//drive//'&solver tolerance = 1e-6 /', 'bound.nml', case, error)
      call check_no_error(error, 'bound: input')
      if (allocated(error)) return
      call new_simulation(sim, case, error)
      call check_no_error(error, 'bound: simulation')
      if (allocated(error)) return
      allocate (none(1, 1), source=0.0_dp)
      allocate (p(sim%grid%nx, sim%grid%ny), contact(sim%grid%nx, sim%grid%ny))
      allocate (tx, ty, mold=p)
      worst = 0.0_dp
      do while (.not. sim%finished)
         call sim%advance(error)
         if (allocated(error)) exit
         call field_rows(sim, 'pressure', 1, p)
         call field_rows(sim, 'traction_x', 1, tx)
         call field_rows(sim, 'traction_y', 1, ty)
         call contact_rows(sim, 1, contact)
         worst = max(worst, largest_excess(sim%tangential%law, p, none, none, contact, tx, ty) &
            /maxval(0.6_dp*p))
      end do
      call check_no_error(error, 'bound: steps')
      call check_order(count(contact == 2_int8), '>', 0, 'bound: points slip')
      call check_close(worst, 0.0_dp, 1e-6_dp, 'traction within the bound of its pressure in each row')
      call sim%destroy()
   end subroutine traction_is_within_its_bound

   !> With a huge coefficient all cells stick. After a long way all slip, and the friction is the coefficient.
   subroutine all_sticks_or_all_slips()
      type(record_type) :: record

      call run_case(block//'&material poisson = 0.4, shear_modulus = 1e6, thickness = 1e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 1e3, slope_effect = .false. /'//nl//drive// &
         '&solver tolerance = 1e-7 /', 'full stick', record)
      associate (row => record%rows(last(record)))
         call check_close(row%stick_area, row%contact_area, 1e-12_dp, 'full stick: all cells of the contact stick')
         call check_close(row%dissipated_friction, 0.0_dp, 1e-9_dp*row%work_tangential, &
            'full stick: no energy is lost')
      end associate
      call run_case(block//'&material poisson = 0.4, shear_modulus = 3e6, thickness = 1e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.2, slope_effect = .false. /'//nl//drive// &
         '&solver tolerance = 1e-7 /', 'full slip', record)
      associate (row => record%rows(last(record)))
         call check_close(row%stick_area, 0.0_dp, 1e-12_dp, 'full slip: nothing sticks')
         call check_close(hypot(row%traction_x, row%traction_y), 0.2_dp*row%pressure, &
            1e-4_dp*row%pressure, 'full slip: the friction is the coefficient')
         call check_close(row%traction_y/row%traction_x, -0.15_dp/0.4_dp, 1e-3_dp, &
            'full slip: the traction has the direction of the road''s motion')
      end associate
   end subroutine all_sticks_or_all_slips

   !> The result does not depend on the number of threads.
   subroutine same_result_on_two_threads()
      type(record_type) :: one, two
      character(:), allocatable :: text

      text = block//rubber//'&friction law = ''coulomb'', coefficient = 0.6 /'//nl//drive// &
         '&solver tolerance = 1e-6 /'
      call set_threads(1)
      call run_case(text, 'one thread', one)
      call set_threads(2)
      call run_case(text, 'two threads', two)
      call check_same_rows(one, two, 1e-12_dp, 'threads')
   end subroutine same_result_on_two_threads

   !> The warning of numerical stick-slip recommends more passes only if their number is limited.
   subroutine advice_on_stick_slip()
      call check_advice(2, 'Allow more passes (now 2); if that does not end it, give the block the smallest density '// &
         'that does (now 5 kg/m3)')
      call check_advice(0, 'Give the block the smallest density that ends it (now 5 kg/m3)')
   end subroutine advice_on_stick_slip

   !> Compare the advice in the warning of numerical stick-slip.
   subroutine check_advice(passes, advice)
      integer, intent(in) :: passes
      character(*), intent(in) :: advice
      type(stick_slip_watch_type) :: watch
      character(:), allocatable :: message, text
      integer :: k

      text = ''
      do k = 1, 20
         call watch_slip(watch, merge(1.2_dp, 0.8_dp, mod(k, 2) == 0), 1.0_dp, passes, 5.0_dp, message)
         text = text//message
      end do
      call check_that(text == 'the mean slip rises and falls from step to step: numerical stick-slip. '//advice, text)
   end subroutine check_advice

   !> A thick elastic block on a short wave, with one pass per step, sticks and slips in turn: linear interpolation makes
   !> the friction vary from cell to cell. This is reported once, also by a run after a restart
   !> (python/tests/test_stops.py). A mass prevents it, and a smooth case causes no report.
   subroutine numerical_stick_slip_is_reported()
      character(*), parameter :: report = 'numerical stick-slip'
      type(record_type) :: record
      type(stick_slip_watch_type) :: watch
      character(:), allocatable :: message
      integer :: k, warned

      warned = 0
      do k = 1, 20
         call watch_slip(watch, merge(1.2_dp, 0.8_dp, mod(k, 2) == 0), 1.0_dp, 2, 0.0_dp, message)
         if (len(message) > 0) warned = warned + 1
      end do
      call check_that(warned == 1, 'a slip that alternates from step to step causes one warning')
      watch = stick_slip_watch_type()
      do k = 1, 100
         call watch_slip(watch, 1.0_dp + 0.9_dp*sin(0.3_dp*k), 1.0_dp, 2, 0.0_dp, message)
         if (len(message) > 0) warned = warned + 1
      end do
      call check_that(warned == 1, 'a slip that oscillates over many steps causes no warning')

      ! The motion is chaotic. In 60 steps, one of 20 blocks that differ by 1e-6 does not alternate often enough.
      call slide('0', 1, record, steps=180)
      call check_order(index(record%warnings, report), '>', 0, 'numerical stick-slip is reported')
      call check_that(index(record%warnings, report) == index(record%warnings, report, back=.true.), &
         'numerical stick-slip is reported only once')
      call slide('30', 1, record)
      call check_that(index(record%warnings, report) == 0, 'a mass prevents numerical stick-slip')
      ! The mean of a thick block is soft. A solver that did not keep the total of the sticking cells never solved some
      ! steps of this case (run_case checks that all steps converge).
      call slide('0', 6, record)
      call check_order(maxval(record%rows%iterations_tangential), '<', 150, &
         'a thick block takes few iterations')
      call run_case(block//rubber//'&friction law = ''coulomb'', coefficient = 0.6 /'//nl//drive, &
         'smooth', record)
      call check_that(index(record%warnings, report) == 0, 'a smooth case causes no report of stick-slip')

   contains

      !> Run the block with a density in kg/m3.
      subroutine slide(density, passes, record, steps)
         character(*), intent(in) :: density
         integer, intent(in) :: passes
         type(record_type), intent(out) :: record
         integer, intent(in), optional :: steps        !! number of steps, 60 by default
         integer :: n

         n = 60
         if (present(steps)) n = steps
         call run_case('&grid nx = 48, ny = 1, lx = 1e-3, ly = 1e-3 /'//nl// &
            '&surface shape = ''sine'', amplitude = 3e-5, wavelength = 0.5e-3 /'//nl// &
            '&material poisson = 0.5, shear_modulus = 1e6, thickness = 2e-2, density = '//density// &
            ' /'//nl//'&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
            '&phase pressure = 0.15e6 /'//nl//'&phase velocity_x = 1, duration = '//to_text(5e-5_dp*n)// &
            ', steps = '//to_text(n)//' /'//nl// &
            '&solver interpolation = ''linear'', passes = '//to_text(passes)//', coupling_tolerance = 100 /', &
            'stick-slip, density '//density, record)
      end subroutine slide

   end subroutine numerical_stick_slip_is_reported

   !> With friction all cells in contact stick until the road moves; without friction they slip.
   subroutine contact_sticks_until_the_road_moves()
      character(*), parameter :: laws(3) = [character(60) :: &
         '&friction law = ''coulomb'', coefficient = 0.6 /', &
         '&friction law = ''constant_shear'', shear_strength = 1e5 /', '']
      character(*), parameter :: ends(2) = [character(80) :: &
         '&phase velocity_x = 0.4, duration = 1e-5, steps = 1 /', '']
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      integer(int8), allocatable :: contact(:, :)
      integer :: state, k, m

      do k = 1, size(laws)
         do m = 1, size(ends)
            state = merge(1, 2, k < 3)
            call parse_case(block//rubber//trim(laws(k))//nl//'&phase pressure = 0.3e6 /'//nl// &
               trim(ends(m)), 'test.nml', case, error)
            call check_no_error(error, 'before motion: case')
            call new_simulation(sim, case, error)
            call check_no_error(error, 'before motion: start')
            call sim%advance(error)
            call check_no_error(error, 'before motion: row')
            if (.not. allocated(contact)) allocate (contact(sim%grid%nx, sim%grid%ny))
            call contact_rows(sim, 1, contact)
            call check_order(count(sim%state%pressure > 0.0_dp), '>', 100, 'before motion: cells in contact')
            call check_that(all(contact == merge(state, 0, sim%state%pressure > 0.0_dp)), &
               'before motion: the contact record has the expected state in each cell')
            call check_close(sim%state%row%stick_area, merge(sim%state%row%contact_area, 0.0_dp, k < 3), 0.0_dp, &
               'before motion: stick area')
            call sim%destroy()
         end do
      end do
   end subroutine contact_sticks_until_the_road_moves

end module test_simulation_friction
