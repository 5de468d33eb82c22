!> Tests of the step loop with adhesion: loads, energies, pull-off, hysteresis, sliding.
module test_simulation_adhesion
   use adhesion_advice, only : adhesion_criteria, adhesion_notes
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use history_row, only : history_row_type
   use asperity_precision, only : dp, pi
   use asperity_simulation, only : new_simulation, simulation_type
   use simulation_runs, only : check_books, check_same_rows, last, nl, record_type, run_case
   use asperity_surface, only : new_height
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_simulation_adhesion

   real(dp), parameter :: radius = 1.0e-4_dp, energy = 0.05_dp
   real(dp), parameter :: e_star = 4.0e6_dp
   real(dp), parameter :: unit_force = pi*energy*radius             !! pi gamma_0 R, N
   character(*), parameter :: free_map = &
      '&grid nx = 48, ny = 44, lx = 40e-6, ly = 38e-6, boundary = ''free'' /'//nl
   character(*), parameter :: sphere = '&surface shape = ''paraboloid'', radius = 1e-4 /'//nl
   character(*), parameter :: wavy = '&grid nx = 48, ny = 45, lx = 40e-6, ly = 33e-6 /'//nl// &
      '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 20e-6, '// &
      'wavelength_short = 5e-6, rms_height = 0.25e-6, seed = 4 /'//nl
   character(*), parameter :: elastic = '&material shear_modulus = 1e6 /'//nl
   character(*), parameter :: soft = '&material shear_modulus = 0.5e6, prony_g = 1e6, 0.7e6, '// &
      'prony_tau = 0.02, 0.2 /'//nl
   character(*), parameter :: sharp = '&solver tolerance = 1e-8, max_iterations = 4000 /'//nl
   !> Takes the first step as a whole, because its parts differ between the kinds of control.
   character(*), parameter :: one_step = '&solver tolerance = 1e-8, max_iterations = 4000, '// &
      'time_scheme = ''exponential'' /'//nl
   character(14), parameter :: potentials(3) = [character(14) :: 'exponential', 'gauss', 'maugis_dugdale']

contains

   subroutine run_simulation_adhesion()
      call begin_suite('simulation_adhesion')
      if (selected('controls_go_through_the_same_states')) &
         call controls_go_through_the_same_states('periodic', wavy, '0.01', '0.4e-6', '0.55e-6')
      if (selected('controls_go_through_the_same_states')) &
         call controls_go_through_the_same_states('free', free_map//sphere, '0.05', '0.1e-6', '0.5e-6')
      if (selected('force_is_derivative_of_energy')) call force_is_derivative_of_energy()
      if (selected('pull_off_force_in_a_run')) call pull_off_force_in_a_run()
      if (selected('later_phases_do_not_change_a_row')) call later_phases_do_not_change_a_row()
      if (selected('detachment_is_reported')) call detachment_is_reported()
      if (selected('wave_at_no_load_has_two_states')) call wave_at_no_load_has_two_states()
      if (selected('loss_of_a_viscoelastic_pull_off')) call loss_of_a_viscoelastic_pull_off()
      if (selected('elastic_state_moves_with_the_road')) call elastic_state_moves_with_the_road()
      if (selected('drive_is_lost_in_the_solid')) call drive_is_lost_in_the_solid()
      if (selected('friction_by_the_pressure_of_the_wall')) then
         call friction_by_the_pressure_of_the_wall('exponential', 0.05_dp/0.4e-6_dp)
         call friction_by_the_pressure_of_the_wall('gauss', 0.0_dp)
         call friction_by_the_pressure_of_the_wall('maugis_dugdale', 0.05_dp/0.4e-6_dp)
      end if
      if (selected('passes_settle_with_gauss')) call passes_settle_with_gauss()
      if (selected('books_close_with_friction_and_slope')) &
         call books_close_with_friction_and_slope()
      if (selected('no_energy_is_no_adhesion')) call no_energy_is_no_adhesion()
      if (selected('repeated_load_changes_nothing')) call repeated_load_changes_nothing()
      if (selected('first_load_may_be_a_pull')) call first_load_may_be_a_pull()
      if (selected('warnings_match_the_formulas')) call warnings_match_the_formulas()
   end subroutine run_simulation_adhesion

   !> `&adhesion`
   function sticky(potential, range, more) result(text)
      character(*), intent(in) :: potential
      character(*), intent(in) :: range
      character(*), intent(in), optional :: more
      character(:), allocatable :: text

      text = '&adhesion potential = '''//trim(potential)//''', energy = 0.05, range = '//range
      if (present(more)) text = text//', '//more
      text = text//' /'//nl
   end function sticky

   !> Control by pressure, force and displacement gives the same states, elastic and viscoelastic. The energy balance
   !> closes to 1e-10 of the energies at a tolerance of 1e-8: to round-off in a periodic cell; on a free map the
   !> displacement of the pressure differs from the stored one by the tolerance.
   subroutine controls_go_through_the_same_states(what, place, gamma, low, high)
      character(*), intent(in) :: what, place, gamma, low, high
      type(record_type) :: led, pressed, pushed
      character(:), allocatable :: text, material, name
      integer :: k, m, p

      do m = 1, 2
         material = elastic
         if (m == 2) material = soft
         do p = 1, 3
            if (m == 2 .and. p == 2) cycle
            name = what//', '//trim(potentials(p))//merge(', elastic     ', ', viscoelastic', m == 1)
            text = place//material//'&adhesion potential = '''//trim(potentials(p))//''', energy = '// &
               gamma//', range = 0.4e-6 /'//nl//one_step
            call run_case(text//'&phase displacement = '//low//' /'//nl// &
               '&phase displacement = '//high//', duration = 0.1, steps = 4, ramp = ''linear'' /', &
               trim(name)//': displacement', led)
            call check_books(led, trim(name)//': displacement', 1e-10_dp)
            ! The kink of this potential pins cells, so that another control leads to a slightly different state.
            if (p == 3) cycle
            call run_case(text//loads('pressure', led%rows%pressure), trim(name)//': pressure', pressed)
            call check_books(pressed, trim(name)//': pressure', 1e-10_dp)
            call check_same_rows(led, pressed, 1e-6_dp, trim(name)//': pressure')
            if (p > 1 .or. m > 1) cycle
            call run_case(text//loads('force', led%rows%force), trim(name)//': force', pushed)
            call check_same_rows(pressed, pushed, 1e-12_dp, trim(name)//': force')
         end do
      end do
      k = last(led)
      call check_that(led%rows(k)%contact_area > led%rows(0)%contact_area .and. &
         led%rows(k)%contact_area < 1.0_dp, what//': the contact grows and stays partial')

   contains

      !> Return phases that apply the loads of the rows one after the other.
      function loads(control, values)
         character(*), intent(in) :: control
         real(dp), intent(in) :: values(0:)
         character(:), allocatable :: loads
         integer :: i

         loads = '&phase '//control//' = '//exact_text(values(0))//' /'//nl
         do i = 1, ubound(values, 1)
            loads = loads//'&phase '//control//' = '//exact_text(values(i))// &
               ', duration = 0.025, steps = 1, ramp = ''linear'' /'//nl
         end do
      end function loads

   end subroutine controls_go_through_the_same_states

   !> Without loss the force is the derivative of the energy, which includes that of adhesion. The error of the work
   !> by the trapezoidal rule decreases with the square of the step.
   subroutine force_is_derivative_of_energy()
      type(record_type) :: record
      real(dp) :: errors(2), change
      integer :: k

      do k = 1, 2
         call run_case(free_map//sphere//elastic//sticky('exponential', '0.5e-6')//sharp// &
            '&phase displacement = 0.4e-6 /'//nl//'&phase displacement = 0.0, duration = 1, '// &
            'ramp = ''linear'', steps = '//to_text(8*k)//' /', 'work', record)
         associate (rows => record%rows, n => last(record))
            change = rows(n)%energy_elastic + rows(n)%energy_adhesive - rows(0)%energy_elastic &
               - rows(0)%energy_adhesive
            errors(k) = abs((rows(n)%work_load - rows(0)%work_load)/change - 1.0_dp)
            call check_close((rows(n)%work_normal - rows(0)%work_normal)/change, 1.0_dp, 1e-9_dp, &
               'the work of the pressure is the change of the energies')
         end associate
      end do
      ! The edge of the contact moves from cell to cell, so that the second order is not smooth.
      call check_order(errors(2), '<', errors(1)/2.5_dp, 'the work of the load converges')
      call check_close(errors(2), 0.0_dp, 4e-3_dp, 'work of the load with 16 steps')
   end subroutine force_is_derivative_of_energy

   !> A Maugis-Dugdale sphere is pulled off by its displacement. The largest pull is that of theory, -1.95059 pi gamma_0 R
   !> for lambda = 0.1 and -1.60073 for lambda = 1 (lambda = sigma_0 (9 R/(2 pi gamma_0 E*^2))^(1/3)), to 2 % with cells
   !> of 0.13 E* range^2/energy and to 3 % with cells of twice that size. The attraction ends over a finite width, which
   !> keeps its edge from sticking to the grid.
   subroutine pull_off_force_in_a_run()
      real(dp) :: pulls(3)

      call pull_off('44', '60e-6', 0.1_dp, '0.0', '-0.4e-6', '-3.6e-6', pulls(1))
      call check_close(pulls(1), -1.95059_dp, 0.03_dp, 'pull-off force, lambda = 0.1')
      call pull_off('32', '36e-6', 1.0_dp, '0.1e-6', '-0.9e-6', '-1.3e-6', pulls(2))
      call pull_off('64', '36e-6', 1.0_dp, '0.1e-6', '-0.9e-6', '-1.3e-6', pulls(3))
      call check_close(pulls(3), -1.60073_dp, 0.02_dp*1.6_dp, 'pull-off force, lambda = 1')
      call check_close(pulls(2), -1.60073_dp, 0.03_dp*1.6_dp, 'pull-off force, lambda = 1, coarse')
   end subroutine pull_off_force_in_a_run

   !> The edge of the attraction of Maugis-Dugdale depends on the material and on the cells, but not on the phases: rows
   !> are the same to the last bit, whatever follows.
   subroutine later_phases_do_not_change_a_row()
      type(record_type) :: short, long
      character(:), allocatable :: text

      text = '&grid nx = 32, ny = 32, lx = 40e-6, boundary = ''free'' /'//nl// &
         sphere//soft//sticky('maugis_dugdale', '0.4e-6')//'&phase displacement = 0.1e-6 /'//nl// &
         '&phase displacement = 0.2e-6, duration = 1e-3, steps = 2, ramp = ''linear'' /'//nl
      call run_case(text, 'without a later phase', short)
      call run_case(text//'&phase displacement = 0.0, duration = 10.0, steps = 2, ramp = ''linear'' /'//nl// &
         '&phase displacement = 0.1e-6, relaxed = .true. /'//nl, 'with later phases', long)
      call check_close(maxval(abs(short%rows(0:2)%force - long%rows(0:2)%force)), 0.0_dp, 0.0_dp, &
         'later phases: the force of the rows before')
      call check_close(maxval(abs(short%rows(0:2)%energy_adhesive - long%rows(0:2)%energy_adhesive)), 0.0_dp, 0.0_dp, &
         'later phases: the adhesive energy of the rows before')
   end subroutine later_phases_do_not_change_a_row

   !> Pull a sphere off and return the largest pull, in pi gamma_0 R.
   subroutine pull_off(n, side, lambda, first, middle, final, pull)
      character(*), intent(in) :: n, side, first, middle, final
      real(dp), intent(in) :: lambda
      real(dp), intent(out) :: pull
      type(record_type) :: record
      integer :: low

      call run_case('&grid nx = '//n//', ny = '//n//', lx = '//side//', boundary = ''free'' /'//nl// &
         sphere//elastic//sticky('maugis_dugdale', &
         exact_text((9.0_dp*radius*energy**2/(2.0_dp*pi*e_star**2))**(1.0_dp/3.0_dp)/lambda))// &
         '&phase displacement = '//first//' /'//nl//'&phase displacement = '//middle// &
         ', duration = 1, steps = 14, ramp = ''linear'' /'//nl//'&phase displacement = '//final// &
         ', duration = 1, steps = 5, ramp = ''linear'' /', 'pull-off', record)
      call check_books(record, 'pull-off', 1e-7_dp)
      low = minloc(record%rows%force, 1) - 1
      pull = minval(record%rows%force)/unit_force
      call check_that(low > 0 .and. low < last(record), 'the largest pull is within the path', &
         [real(low, dp)])
      call check_that(record%rows(0)%contact_area > 0.0_dp .and. &
         record%rows(last(record))%contact_area <= 0.0_dp, 'the sphere detaches')
      call check_close(record%rows(last(record))%force, 0.0_dp, 1e-6_dp*unit_force, 'no force acts after the detachment')
   end subroutine pull_off

   !> A pull that is too large ends the contact; the run names this reason and does not change the earlier rows.
   subroutine detachment_is_reported()
      character(*), parameter :: pulls(5) = [character(8) :: '1e-5', '-1e-5', '-2e-5', '-2.9e-5', '-3e-5']
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      character(:), allocatable :: text, place
      integer :: k, m, held

      do m = 1, 2
         place = free_map
         if (m == 2) place = '&grid nx = 48, ny = 44, lx = 40e-6, ly = 38e-6 /'//nl
         text = place//sphere//elastic//sticky('exponential', '0.3e-6')
         do k = 1, size(pulls)
            text = text//'&phase force = '//trim(pulls(k))//' /'//nl
         end do
         call parse_case(text, 'test.nml', case, error)
         call check_no_error(error, 'detachment: input')
         if (allocated(error)) return
         call new_simulation(sim, case, error)
         call check_no_error(error, 'detachment: simulation')
         if (allocated(error)) return
         held = 0
         do k = 1, size(pulls)
            call sim%advance(error)
            call check_no_error(error, 'detachment: step')
            if (.not. sim%converged) exit
            held = k
         end do
         ! JKR holds 1.5 pi gamma_0 R = 2.36e-5 N, DMT 3.14e-5 N
         call check_that(held >= 3 .and. held < 5 .or. m == 2 .and. held >= 2 .and. held < 5, &
            'the contact holds pulls up to one between JKR and DMT; rows held: '//to_text(held), [real(held, dp)])
         call check_that(sim%reason == 'detached', 'the reason is detached, not '//sim%reason)
         call sim%destroy()
      end do
   end subroutine detachment_is_reported

   !> A wave without a load has two states, which depend on the start, and both are minima of the energy.
   subroutine wave_at_no_load_has_two_states()
      type(record_type) :: apart, whole, thesis
      character(:), allocatable :: text
      character(*), parameter :: phases = '&phase pressure = 0.0 /'//nl//'&phase pressure = 2e3 /'

      text = '&grid nx = 48, ny = 27, lx = 40e-6, ly = 23.0940107675850e-6 /'//nl// &
         '&surface shape = ''hexagonal_wave'', amplitude = 1.0e-6, wavelength = 40e-6 /'//nl//elastic
      call run_case(text//sticky('exponential', '0.1e-6')//phases, 'from apart', apart)
      call run_case(text//sticky('exponential', '0.1e-6', 'start = ''full_contact''')//phases, &
         'from full contact', whole)
      call check_books(apart, 'from apart')
      call check_books(whole, 'from full contact')
      call check_that(apart%rows(0)%contact_area > 0.0_dp .and. apart%rows(0)%contact_area < 0.9_dp, &
         'from apart: a partial contact '//to_text(apart%rows(0)%contact_area), &
         [apart%rows(0)%contact_area])
      call check_close(whole%rows(0)%contact_area, 1.0_dp, 0.0_dp, 'from full contact: it stays full')
      call check_close(whole%rows(0)%mean_gap, 0.0_dp, 0.0_dp, 'from full contact: no gap')
      ! The energy of full contact is 3 pi E* A^2/(32 wavelength) per area (thesis, 4.5.1).
      call check_close(whole%rows(0)%energy_elastic/(40e-6_dp*23.0940107675850e-6_dp* &
         3.0_dp*pi*e_star*1.0e-6_dp**2/(32.0_dp*40e-6_dp)), 1.0_dp, 1e-9_dp, &
         'elastic energy of full contact')
      call run_case(text//sticky('exponential', '0.1e-6', 'start = ''full_contact''')// &
         '&solver method = ''thesis'' /'//nl//phases, 'from full contact, thesis', thesis)
      call check_same_rows(whole, thesis, 1e-6_dp, 'from full contact, both methods')
   end subroutine wave_at_no_load_has_two_states

   !> A viscoelastic sphere is pressed on and pulled off at half the speed. It loses energy without adhesion, and more than
   !> twice as much with it.
   subroutine loss_of_a_viscoelastic_pull_off()
      type(record_type) :: bare, adhesive
      character(:), allocatable :: text
      real(dp) :: loss(2)
      integer :: k

      text = '&grid nx = 32, ny = 32, lx = 30e-6, boundary = ''free'' /'//nl//sphere//soft// &
         '&phase displacement = 0.0 /'//nl// &
         '&phase displacement = 0.6e-6, duration = 0.1, steps = 12, ramp = ''linear'' /'//nl// &
         '&phase displacement = -1.8e-6, duration = 0.8, steps = 48, ramp = ''linear'' /'//nl
      call run_case(text, 'loop without adhesion', bare)
      call run_case(text//sticky('exponential', '0.5e-6'), 'loop with adhesion', adhesive)
      call check_books(bare, 'loop without adhesion')
      call check_books(adhesive, 'loop with adhesion', 1e-7_dp)
      associate (b => bare%rows, a => adhesive%rows, n => last(bare))
         loss = [b(n)%dissipated_viscous, a(n)%dissipated_viscous]
         call check_that(loss(1) > 0.0_dp .and. loss(2) > 2.0_dp*loss(1), 'adhesion loses more: '// &
            to_text(loss(2)/loss(1)))
         call check_close(b(n)%force, 0.0_dp, 1e-6_dp*maxval(b%force), 'without adhesion the sphere lifts off')
         call check_order(minval(a%force), '<', -1.3_dp*unit_force, 'with adhesion the sphere is pulled')
         call check_close(a(n)%contact_area, 0.0_dp, 0.0_dp, 'in the end there is no contact')
         ! At the same displacement the force is lower on the way back.
         do k = 13, 20
            call check_order(a(k)%force, '<', at(a(0:12), a(k)%displacement), &
               'the force is lower on the way back')
         end do
         ! Seen from outside, the loss of the loop is the work of the load less the energy that is still stored.
         call check_close((a(n)%work_load - a(n)%energy_elastic - a(n)%energy_adhesive)/loss(2), 1.0_dp, &
            0.03_dp, 'work of the load around the loop')
         call check_close((b(n)%work_load - b(n)%energy_elastic)/loss(1), 1.0_dp, 0.05_dp, &
            'work of the load around the loop without adhesion')
      end associate

   contains

      !> Return the force at a displacement on a rising path, by interpolation between rows.
      real(dp) function at(rows, displacement)
         type(history_row_type), intent(in) :: rows(:)
         real(dp), intent(in) :: displacement
         integer :: i

         at = rows(size(rows))%force
         do i = 2, size(rows)
            if (rows(i)%displacement < displacement) cycle
            at = rows(i - 1)%force + (rows(i)%force - rows(i - 1)%force) &
               *(displacement - rows(i - 1)%displacement)/(rows(i)%displacement - rows(i - 1)%displacement)
            exit
         end do
      end function at

   end subroutine loss_of_a_viscoelastic_pull_off

   !> An elastic contact without friction moves with the road, obliquely and by whole cells.
   subroutine elastic_state_moves_with_the_road()
      type(record_type) :: record
      integer :: k

      call run_case(wavy//elastic//sticky('exponential', '0.4e-6')//sharp// &
         '&phase pressure = 2e4 /'//nl//'&phase duration = 6, steps = 6, velocity_x = '// &
         exact_text(2*40e-6_dp/48)//', velocity_y = '//exact_text(-33e-6_dp/45)//' /', &
         'sliding, elastic', record)
      call check_books(record, 'sliding, elastic')
      associate (rows => record%rows)
         do k = 1, last(record)
            call check_close(rows(k)%contact_area, rows(0)%contact_area, 0.0_dp, 'sliding, elastic: area')
            call check_close(rows(k)%displacement/rows(0)%displacement, 1.0_dp, 1e-7_dp, &
               'sliding, elastic: displacement')
            ! The slopes of the road differ slightly from those of the discrete energy.
            call check_close(rows(k)%friction, 0.0_dp, 1e-3_dp, 'sliding, elastic: no friction')
            call check_close(rows(k)%friction, rows(1)%friction, 1e-8_dp, 'sliding, elastic: same friction')
            call check_order(rows(k)%iterations_normal, '<=', 2, &
               'sliding, elastic: the start is the solution')
         end do
      end associate
   end subroutine elastic_state_moves_with_the_road

   !> A viscoelastic contact without friction loses the work of the drive in the solid, and more with adhesion.
   subroutine drive_is_lost_in_the_solid()
      type(record_type) :: adhesive, bare
      character(:), allocatable :: text, phases
      real(dp) :: errors(2)
      integer :: k

      text = '&grid nx = 48, ny = 45, lx = 40e-6, ly = 33e-6 /'//nl// &
         '&surface shape = ''hexagonal_wave'', amplitude = 0.9e-6, wavelength = 40e-6 /'//nl//soft// &
         '&phase pressure = 2e4, relaxed = .true. /'//nl
      do k = 1, 2
         phases = '&phase duration = 0.05, steps = '//to_text(16*k)// &
            ', velocity_x = 4e-4, velocity_y = 1.65e-4 /'//nl
         call run_case(text//sticky('exponential', '0.4e-6')//phases, 'sliding, viscoelastic', adhesive)
         call check_books(adhesive, 'sliding, viscoelastic')
         ! The work from outside is that of the drive and that of the load that sinks.
         associate (a => adhesive%rows, n => last(adhesive))
            errors(k) = abs((a(n)%work_drive + a(n)%work_load - a(0)%work_load) &
               /(a(n)%work_normal - a(0)%work_normal) - 1.0_dp)
         end associate
      end do
      call check_that(errors(2) < errors(1)/1.4_dp .and. errors(2) < 0.03_dp, &
         'sliding, viscoelastic: the work of the drive converges: '//to_text(errors(1))//', '// &
         to_text(errors(2)), errors)
      call run_case(text//phases, 'sliding, viscoelastic, bare', bare)
      call check_that(adhesive%rows(last(bare))%friction > bare%rows(last(bare))%friction .and. &
         bare%rows(last(bare))%friction > 0.0_dp, &
         'sliding, viscoelastic: friction with and without adhesion')
   end subroutine drive_is_lost_in_the_solid

   !> In full sliding without the slope effect the traction is mu (P - P_adh) (thesis, 4.5.1). The attraction P_adh in a
   !> closed cell, which depends on the potential, presses the surfaces together.
   subroutine friction_by_the_pressure_of_the_wall(potential, attraction)
      character(*), intent(in) :: potential
      real(dp), intent(in) :: attraction           !! at touch, Pa
      type(record_type) :: record
      real(dp) :: wall

      call run_case(wavy//'&material shear_modulus = 1e6, thickness = 20e-6 /'//nl// &
         sticky(potential, '0.4e-6')//'&friction law = ''coulomb'', coefficient = 0.3, '// &
         'slope_effect = .false. /'//nl//'&phase pressure = 2e4 /'//nl// &
         '&phase duration = 0.1, steps = 8, velocity_x = 8e-5, velocity_y = 4e-5 /', &
         'sliding, friction, '//potential, record)
      call check_books(record, 'sliding, friction, '//potential)
      associate (row => record%rows(last(record)))
         call check_close(row%stick_area, 0.0_dp, 0.0_dp, 'sliding, friction, '//potential//': all slips')
         wall = sum(record%pressure + attraction, mask=record%gap <= 0.0_dp)/size(record%pressure)
         call check_close(hypot(row%traction_x, row%traction_y)/(0.3_dp*wall), 1.0_dp, 1e-4_dp, &
            'sliding, friction, '//potential//': mean traction')
      end associate
   end subroutine friction_by_the_pressure_of_the_wall

   !> The bound of the friction must not jump where a cell opens, or the passes of the step would not settle. With the
   !> potential gauss a cell opens at zero pressure.
   subroutine passes_settle_with_gauss()
      type(record_type) :: record

      call run_case(wavy//elastic//sticky('gauss', '0.4e-6')// &
         '&friction law = ''coulomb_orowan'', coefficient = 0.5, shear_strength = 5e4 /'//nl// &
         '&phase pressure = 2e4, duration = 0.1, steps = 4, velocity_x = -2e-5, velocity_y = -5e-5 /', &
         'gauss, Coulomb-Orowan', record)
      call check_that(all(record%rows%passes <= 20), 'gauss, Coulomb-Orowan: the passes settle')
   end subroutine passes_settle_with_gauss

   !> The energy balance closes with friction and the slope effect, for an oblique motion.
   subroutine books_close_with_friction_and_slope()
      type(record_type) :: record

      call run_case(wavy//soft//sticky('exponential', '0.4e-6')// &
         '&friction law = ''coulomb'', coefficient = 0.3 /'//nl//'&phase pressure = 2e4 /'//nl// &
         '&phase duration = 0.05, steps = 8, velocity_x = 1e-4, velocity_y = 4e-5 /', &
         'sliding, friction with slope', record)
      call check_books(record, 'sliding, friction with slope')
      call check_order(record%rows(last(record))%dissipated_friction, '>', 0.0_dp, &
         'sliding, friction with slope: heat')
   end subroutine books_close_with_friction_and_slope

   !> Adhesion without energy is the same as no adhesion.
   subroutine no_energy_is_no_adhesion()
      type(record_type) :: none, zero
      character(:), allocatable :: text, ending
      integer :: k

      ending = '&phase pressure = 2e4 /'//nl//'&phase pressure = 6e4, duration = 0.1, steps = 4, '// &
         'ramp = ''linear'' /'//nl//'&solver tolerance = 1e-9 /'//nl
      do k = 1, 2
         text = wavy//soft//ending
         if (k == 2) text = free_map//sphere//soft//ending
         call run_case(text, 'none', none)
         call run_case(text//'&adhesion potential = ''exponential'', energy = 0.0, range = 0.4e-6 /', &
            'no energy', zero)
         call check_same_rows(none, zero, 1e-6_dp, 'no energy')
         call check_close(maxval(abs(none%pressure - zero%pressure))/maxval(none%pressure), 0.0_dp, &
            1e-4_dp, 'no energy: pressure')
         call check_close(maxval(abs(zero%rows%energy_adhesive)), 0.0_dp, 0.0_dp, 'no energy: adhesive energy')
      end do
   end subroutine no_energy_is_no_adhesion

   !> Repeating a load, however often, changes nothing.
   subroutine repeated_load_changes_nothing()
      type(record_type) :: record
      character(:), allocatable :: place, phases
      integer :: k, m

      do m = 1, 4
         place = free_map//sphere
         if (m > 2) place = wavy
         phases = '&phase pressure = 5e3, duration = 1, steps = 6 /'
         if (modulo(m, 2) == 0) phases = '&phase displacement = 0.1e-6, duration = 1, steps = 6 /'
         call run_case(place//elastic//sticky('exponential', '0.4e-6')//phases, 'rest', record)
         do k = 1, last(record)
            call check_close(record%rows(k)%contact_area, record%rows(0)%contact_area, 0.0_dp, 'rest: area')
            call check_close(record%rows(k)%displacement, record%rows(0)%displacement, 1e-12_dp, &
               'rest: displacement')
         end do
      end do
   end subroutine repeated_load_changes_nothing

   !> The first load may be a pull, under which the contact starts from a mere touch.
   subroutine first_load_may_be_a_pull()
      type(record_type) :: record, pressed
      character(:), allocatable :: text
      integer :: m

      do m = 1, 2
         text = free_map
         if (m == 2) text = '&grid nx = 48, ny = 44, lx = 40e-6, ly = 38e-6 /'//nl
         text = text//sphere//elastic//sticky('exponential', '0.6e-6')//sharp
         call run_case(text//'&phase force = -4e-6 /', 'pulled', record)
         call run_case(text//'&phase force = 2e-5 /'//nl//'&phase force = -4e-6 /', 'unloaded', pressed)
         call check_close(record%rows(0)%force, -4e-6_dp, 1e-10_dp, 'pulled: force')
         call check_order(record%rows(0)%contact_area, '>', 0.0_dp, 'pulled: there is contact')
         call check_close(record%rows(0)%displacement, pressed%rows(1)%displacement, 1e-12_dp, &
            'pulled: as after a load')
         call check_close(record%rows(0)%contact_area, pressed%rows(1)%contact_area, 0.0_dp, &
            'pulled: area as after a load')
      end do
   end subroutine first_load_may_be_a_pull

   !> The numbers in warnings and notes agree with sums over the map and with the formulas of the thesis.
   subroutine warnings_match_the_formulas()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(:), allocatable :: notes
      real(dp), allocatable :: height(:, :)
      real(dp) :: c1, c2, stored

      call parse_case(wavy//soft//sticky('exponential', '0.1e-6')// &
         '&phase pressure = 2e4, duration = 0.1 /', 'test.nml', case, error)
      call check_no_error(error, 'advice')
      if (allocated(error)) return
      ! 0.7 E* z_0^2/gamma_0, E* = 4 (0.5 + exp(-5) + 0.7 exp(-0.5)) MPa
      call check_that(index(case%warnings, 'are larger than 0.7 E* range^2/energy = '// &
         to_text(0.7_dp*4e6_dp*(0.5_dp + exp(-5.0_dp) + 0.7_dp*exp(-0.5_dp))*1e-14_dp/0.05_dp)) > 0 .and. &
         index(case%warnings, 'E* relaxed over the run') > 0, 'advice: '//case%warnings)
      call new_height(case%grid, case%surfaces, height, error)
      call check_no_error(error, 'advice: height')
      call adhesion_criteria(case%surfaces(1), energy, e_star, 2e4_dp, c1, c2)
      stored = 0.25_dp*e_star*spectral_sum(height, case%grid%lx, case%grid%ly)
      ! The formula's spectrum is continuous, while the map has few waves.
      call check_close(c2*stored/energy, 1.0_dp, 0.1_dp, 'advice: energy of full contact')
      call check_order(c1, '>', 0.0_dp, 'advice: C1')

      call parse_case(free_map//sphere//elastic//sticky('gauss', '0.5e-6')//'&phase force = 1e-5 /', &
         'test.nml', case, error)
      call check_no_error(error, 'advice')
      notes = adhesion_notes(case)
      ! (R gamma_0^2/E*^2)^(1/3)/z_0 = 0.5
      call check_that(index(notes, 'paraboloid: Tabor parameter 0.5') > 0 .and. case%warnings == '', &
         'advice: '//notes//case%warnings)
      ! a = (3 pi gamma_0 R^2/(4 E*))^(1/3) = 6.65 um: an eighth of it is less than 38 um/44.
      call parse_case(free_map//sphere//elastic//sticky('maugis_dugdale', '0.5e-6')// &
         '&phase displacement = -1e-7 /', 'test.nml', case, error)
      call check_no_error(error, 'advice: pull')
      call check_that(index(case%warnings, 'are larger than '// &
         to_text((0.75_dp*pi*energy*radius**2/e_star)**(1.0_dp/3.0_dp)/8.0_dp)//' m, an eighth') > 0, &
         'advice: pull: '//case%warnings)
      ! A third is enough for a smooth potential.
      call parse_case(free_map//sphere//elastic//sticky('gauss', '0.5e-6')//'&phase displacement = -1e-7 /', &
         'test.nml', case, error)
      call check_no_error(error, 'advice: pull on fine cells')
      call check_that(case%warnings == '', 'advice: pull on fine cells: '//case%warnings)
      call parse_case('&grid nx = 64, ny = 37, lx = 40e-6, ly = 23.0940107675850e-6 /'//nl// &
         '&surface shape = ''hexagonal_wave'', amplitude = 0.8e-6, wavelength = 40e-6 /'//nl//elastic// &
         sticky('exponential', '0.5e-6')//'&phase pressure = 5e4 /', 'test.nml', case, error)
      call check_no_error(error, 'advice')
      call adhesion_criteria(case%surfaces(1), energy, e_star, 5e4_dp, c1, c2)
      call check_close(c1, 2.0_dp*energy/(pi*0.8e-6_dp*5e4_dp), 1e-12_dp, 'advice: C1 of a hexagonal wave')
      call check_close(c2, energy/(0.8e-6_dp**2*3.0_dp*pi*1e6_dp/(8.0_dp*40e-6_dp)), 1e-12_dp, &
         'advice: C2 as in eq. 4.9')
      call check_order(index(adhesion_notes(case), 'C1 = 0.796 at 50000 Pa, C2 = 2.65'), '>', 0, &
         'advice: '//adhesion_notes(case))

   contains

      !> <q h^2> by a sum over the wave vectors.
      real(dp) function spectral_sum(h, lx, ly)
         real(dp), intent(in) :: h(:, :), lx, ly
         complex(dp) :: ex(size(h, 1)), ey(size(h, 2))
         integer :: i, k, l, nx, ny

         nx = size(h, 1)
         ny = size(h, 2)
         spectral_sum = 0.0_dp
         do l = -10, 10
            ey = [(exp(cmplx(0.0_dp, 2.0_dp*pi*l*i/ny, dp)), i=0, ny - 1)]
            do k = -10, 10
               ex = [(exp(cmplx(0.0_dp, 2.0_dp*pi*k*i/nx, dp)), i=0, nx - 1)]
               spectral_sum = spectral_sum + 2.0_dp*pi*hypot(k/lx, l/ly) &
                  *abs(sum(matmul(ex, h)*ey)/(nx*ny))**2
            end do
         end do
      end function spectral_sum

   end subroutine warnings_match_the_formulas

end module test_simulation_adhesion
