!> Tests of the energy balance seen from outside: friction, steps that are too coarse, pull-off.
module test_outside_balance
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use history_row, only : history_row_type
   use outside_balance, only : book_outside
   use asperity_precision, only : dp, pi
   use simulation_runs, only : check_books, last, nl, record_type, run_case
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_outside_balance

contains

   subroutine run_outside_balance()
      call begin_suite('outside_balance')
      if (selected('excess_and_radiation_of_one_row')) call excess_and_radiation_of_one_row()
      if (selected('loss_of_a_mindlin_loop')) call loss_of_a_mindlin_loop()
      if (selected('balance_on_a_rough_road')) call balance_on_a_rough_road()
      if (selected('friction_loss_never_falls')) call friction_loss_never_falls()
      if (selected('pull_off_radiates_the_stored_energy')) &
         call pull_off_radiates_the_stored_energy()
   end subroutine run_outside_balance

   !> One row: energy in excess, radiated energy, and a jump.
   subroutine excess_and_radiation_of_one_row()
      type(history_row_type) :: before, row

      before%force = 2.0_dp
      before%work_load = 10.0_dp
      row = before
      row%force = 4.0_dp
      row%displacement = 1.0_dp
      row%road_x = 2.0_dp
      row%work_normal = 2.5_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .false., .false., .true., row)
      call check_close(row%work_load, 13.0_dp, 1e-14_dp, 'work of the load')
      call check_close(row%work_drive, 3.0_dp, 1e-14_dp, 'work of the drive')
      ! 3 + 3 - 2.5 = 3.5 is above (2*1 + 1*2)/2 = 2.
      call check_close(row%energy_radiated, 3.5_dp, 1e-14_dp, 'more than a path can explain')
      call check_close(row%work_missing, 0.0_dp, 0.0_dp, 'all of it is radiated')
      row%work_normal = 4.5_dp
      row%energy_radiated = 0.0_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .false., .false., .true., row)
      call check_close(row%work_missing, 1.5_dp, 1e-14_dp, 'what a path can explain is missing')
      call check_close(row%energy_radiated, 0.0_dp, 0.0_dp, 'and not radiated')
      row%work_normal = 2.5_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .false., .false., .false., row)
      call check_close(row%work_missing, 3.5_dp, 1e-14_dp, 'without adhesion nothing is radiated')
      row%work_missing = 0.0_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .true., .false., .true., row)
      call check_close(row%work_load, 12.5_dp, 1e-14_dp, 'a jump works what it stores')
      row%work_load = 10.0_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .false., .true., .false., row)
      ! The fields store and lose 3 less than the load gives, but a force of 1 to 2 works 2 to 4 on the way of 2.
      call check_close(row%work_drive, 2.0_dp, 1e-14_dp, 'the first step of a motion: least work of the drive')
      call check_close(row%work_missing, 2.5_dp, 1e-14_dp, 'the first step of a motion: the rest is missing')
      row%work_normal = 6.5_dp
      row%work_missing = 0.0_dp
      call book_outside(before, [1.0_dp, 0.0_dp], [2.0_dp, 7.0_dp], [0.0_dp, 0.0_dp], .false., .true., .false., row)
      call check_close(row%work_drive, 3.5_dp, 1e-14_dp, 'the first step of a motion: drive')
      call check_close(row%work_missing, 0.0_dp, 1e-14_dp, 'the first step of a motion: balance')
   end subroutine excess_and_radiation_of_one_row

   !> Mindlin's sphere moved back and forth, nu = 0. The energy lost in a loop is the area of the exact loop
   !> of the force (Mindlin and Deresiewicz 1953), however coarse the steps are. The rest is the error of the
   !> mesh.
   subroutine loss_of_a_mindlin_loop()
      real(dp), parameter :: g = 1e6_dp, radius = 10e-3_dp, a = 1e-3_dp, mu = 0.01_dp
      real(dp), parameter :: full = mu*a**2/radius     !! motion of the road up to full slip, m
      integer, parameter :: steps(3) = [2, 4, 8]
      type(record_type) :: record
      real(dp) :: load, exact, errors(3)
      integer :: k

      load = 8.0_dp*g*a**3/(3.0_dp*radius)
      exact = (8.0_dp*(0.5_dp - 0.4_dp*(1.0_dp - 0.5_dp**2.5_dp)) - 2.0_dp*(1.0_dp - 0.5_dp**1.5_dp)) &
         *mu*load*full
      do k = 1, size(steps)
         call run_case('&grid nx = 72, ny = 64, lx = 2.7e-3, ly = 2.4e-3, boundary = ''free'' /'//nl// &
            '&surface shape = ''sphere'', radius = 10e-3 /'//nl// &
            '&material poisson = 0, shear_modulus = 1e6 /'//nl// &
            '&friction law = ''coulomb'', coefficient = 0.01, slope_effect = .false. /'//nl// &
            '&phase force = '//exact_text(load)//' /'//nl// &
            leg(1e-3_dp, 0.7_dp, steps(k))//leg(-1e-3_dp, 1.0_dp, steps(k))// &
            leg(1e-3_dp, 1.0_dp, steps(k))//'&solver tolerance = 1e-7 /', 'Mindlin loop', record)
         call check_books(record, 'Mindlin loop', 1e-6_dp)
         associate (rows => record%rows, n => steps(k))
            errors(k) = (rows(3*n)%dissipated_friction - rows(n)%dissipated_friction)/exact - 1.0_dp
            call check_that(all(rows(1:)%dissipated_friction >= rows(:3*n - 1)%dissipated_friction), &
               'Mindlin loop: the loss never falls', &
               [minval(rows(1:)%dissipated_friction - rows(:3*n - 1)%dissipated_friction)])
         end associate
      end do
      call check_close(maxval(errors), minval(errors), 1e-5_dp, 'Mindlin loop: the same loss in coarse and fine steps')
      call check_close(errors(1), 0.0_dp, 6e-3_dp, 'Mindlin loop: the loss in 2 steps a turn')

   contains

      !> A phase that moves the road by a part of `full`.
      function leg(speed, part, n)
         real(dp), intent(in) :: speed, part
         integer, intent(in) :: n
         character(:), allocatable :: leg

         leg = '&phase velocity_x = '//exact_text(speed)//', duration = '// &
            exact_text(part*full/abs(speed))//', steps = '//to_text(n)//' /'//nl
      end function leg

   end subroutine loss_of_a_mindlin_loop

   !> A rough viscoelastic road with friction in steady sliding at one cell per step.
   subroutine balance_on_a_rough_road()
      type(record_type) :: record
      real(dp) :: lost, missing

      call run_case(rough()//'&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
         '&phase pressure = 2e5, relaxed = .true., duration = 1e-3, velocity_x = 1.0 /'//nl, &
         'rough sliding', record)
      associate (a => record%rows(last(record)/2), b => record%rows(last(record)))
         lost = b%dissipated_viscous + b%dissipated_friction - a%dissipated_viscous - a%dissipated_friction
         missing = b%work_missing - a%work_missing
         call check_close(missing/lost, 0.0_dp, 4e-3_dp, 'rough sliding: work that is missing')
         call check_close(b%work_load + b%work_drive - b%work_normal - b%work_tangential - b%work_missing, &
            0.0_dp, 1e-12_dp*b%work_drive, 'rough sliding: both views agree but for the work missing')
         call check_close(b%energy_radiated, 0.0_dp, 0.0_dp, 'rough sliding: nothing is radiated')
      end associate
   end subroutine balance_on_a_rough_road

   !> Friction losses never decrease: neither where the load falls or rises while the road slides, nor where
   !> the road turns back.
   subroutine friction_loss_never_falls()
      type(record_type) :: record
      integer :: k

      call run_case(rough()//'&friction law = ''coulomb'', coefficient = 0.6 /'//nl// &
         '&phase pressure = 2e5, relaxed = .true., duration = 3e-4, velocity_x = 1.0 /'//nl// &
         '&phase pressure = 1e5, duration = 1e-4, velocity_x = 1.0 /'//nl// &
         '&phase pressure = 2e5, duration = 1e-4, velocity_x = 1.0 /'//nl// &
         '&phase pressure = 1.9e5, duration = 2e-5, velocity_x = 0.1, steps = 2 /'//nl// &
         '&phase duration = 1e-4, velocity_x = -1.0, velocity_y = 0.5 /'//nl, 'jumps and turns', record)
      call check_books(record, 'jumps and turns', 1e-6_dp)
      do k = 1, last(record)
         call check_order(record%rows(k)%dissipated_friction, '>=', record%rows(k - 1)%dissipated_friction, &
            'jumps and turns: row '//to_text(k))
      end do
   end subroutine friction_loss_never_falls

   !> A sphere that is pulled off by its displacement radiates the energy stored at the point of instability
   !> minus the work of adhesion. The reference is JKR with E = E* (a d^2 - 2 a^3 d/(3 R) + a^5/(5 R^2)) - pi
   !> w a^2 at the largest stretch, where d d/d a = 0. The Tabor parameter is 3, so that JKR holds to some per
   !> cent.
   subroutine pull_off_radiates_the_stored_energy()
      real(dp), parameter :: radius = 20e-6_dp, w = 0.05_dp, e_star = 4e6_dp, tabor = 3.0_dp
      type(record_type) :: record
      real(dp) :: a0, range, a, d, expected
      integer :: k

      a0 = (3.0_dp*pi*w*radius**2/(4.0_dp*e_star))**(1.0_dp/3.0_dp)
      range = (radius*w**2/(e_star**2*tabor**3))**(1.0_dp/3.0_dp)
      a = (pi*w*radius**2/(8.0_dp*e_star))**(1.0_dp/3.0_dp)
      d = a**2/radius - sqrt(2.0_dp*pi*w*a/e_star)
      expected = e_star*(a*d**2 - 2.0_dp*a**3*d/(3.0_dp*radius) + a**5/(5.0_dp*radius**2)) - pi*w*a**2
      call run_case('&grid nx = 48, ny = 48, lx = '//exact_text(48*0.7_dp*e_star*range**2/w)// &
         ', boundary = ''free'' /'//nl//'&surface shape = ''sphere'', radius = 20e-6 /'//nl// &
         '&material shear_modulus = 1e6 /'//nl// &
         '&adhesion potential = ''exponential'', energy = 0.05, range = '//exact_text(range)//' /'//nl// &
         '&phase displacement = '//exact_text(0.3_dp*a0**2/radius)//' /'//nl// &
         '&phase displacement = '//exact_text(-2.6_dp*a0**2/radius)//', duration = 1, steps = 64, '// &
         'ramp = ''linear'' /'//nl//'&solver tolerance = 1e-7, max_iterations = 4000 /', 'pull-off', record)
      associate (rows => record%rows, n => last(record))
         call check_close(rows(n)%energy_radiated/expected, 1.0_dp, 0.15_dp, 'pull-off: energy radiated')
         call check_close(rows(n)%work_missing/expected, 0.0_dp, 0.02_dp, 'pull-off: nothing else is missing')
         call check_close(rows(n)%work_load + rows(n)%work_drive - rows(n)%work_normal &
            - rows(n)%work_tangential - rows(n)%energy_radiated - rows(n)%work_missing, 0.0_dp, &
            1e-12_dp*expected, 'pull-off: both views')
         k = maxloc(rows(1:)%energy_radiated - rows(:n - 1)%energy_radiated, dim=1)
         call check_close(rows(k)%contact_area, 0.0_dp, 0.0_dp, 'pull-off: radiated where contact is lost')
         call check_order(rows(k - 1)%contact_area, '>', 0.0_dp, &
            'pull-off: there was contact before')
         call check_that(all(rows(1:)%energy_radiated >= rows(:n - 1)%energy_radiated), &
            'pull-off: what is radiated does not come back', &
            [minval(rows(1:)%energy_radiated - rows(:n - 1)%energy_radiated)])
      end associate
   end subroutine pull_off_radiates_the_stored_energy

   !> A rough road under a viscoelastic block.
   function rough() result(text)
      character(:), allocatable :: text

      text = '&grid nx = 64, ny = 48, lx = 0.8e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 5e-4, wavelength_short = 1e-4, '// &
         'rms_slope = 0.25, seed = 3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-4, 1e-3, thickness = 1e-3 /'//nl// &
         '&solver tolerance = 1e-7, passes = 12 /'//nl
   end function rough

end module test_outside_balance
