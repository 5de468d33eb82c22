!> Tests of the step loop without sliding: creep, ramps, jumps, energies, schemes.
module test_simulation
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_precision, only : dp, pi
   use simulation_runs, only : check_books, check_same_rows, last, nl, record_type, reference_compliance, &
      run_case
   use text_tools, only : to_text
   implicit none
   private

   public :: run_simulation

   real(dp), parameter :: radius = 1.0e-3_dp, force = 0.02e-3_dp
   character(*), parameter :: thesis_sphere = '&surface shape = ''paraboloid'', radius = 1e-3 /'//nl
   character(*), parameter :: thesis_rubber = &
      '&material zener_g0 = 1e6, zener_g1 = 0.1e6, zener_eta = 0.1e6 /'//nl
   character(*), parameter :: small_map = &
      '&grid nx = 40, ny = 36, lx = 0.1e-3, ly = 0.1e-3, boundary = ''free'' /'//nl
   character(*), parameter :: schemes(3) = [character(14) :: 'backward_euler', 'exponential', &
      'exponential2']
   character(*), parameter :: rough = '&grid nx = 48, ny = 45, lx = 1.2e-3, ly = 1.0e-3 /'//nl// &
      '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, '// &
      'wavelength_short = 0.12e-3, rms_height = 5e-6, seed = 3 /'//nl
   character(*), parameter :: two_arms = '&material shear_modulus = 0.5e6, prony_g = 1e6, 0.7e6, '// &
      'prony_tau = 1e-3, 0.1 /'//nl
   character(*), parameter :: slow_arms = '&material shear_modulus = 0.5e6, prony_g = 1e6, 0.7e6, '// &
      'prony_tau = 0.02, 0.1 /'//nl

contains

   subroutine run_simulation()
      call begin_suite('simulation')
      if (selected('lee_radok_sphere')) call lee_radok_sphere()
      if (selected('lee_radok_with_several_arms')) call lee_radok_with_several_arms()
      if (selected('order_in_the_mesh')) call order_in_the_mesh()
      if (selected('orders_in_time_of_the_schemes')) call orders_in_time_of_the_schemes()
      if (selected('sphere_under_a_growing_force')) call sphere_under_a_growing_force()
      if (selected('many_decades_do_not_ring')) call many_decades_do_not_ring()
      if (selected('area_never_falls_after_a_drop')) call area_never_falls_after_a_drop()
      if (selected('work_agrees_with_that_of_the_load')) call work_agrees_with_that_of_the_load()
      if (selected('split_and_reordered_arms_agree')) call split_and_reordered_arms_agree()
      if (selected('relaxed_block_does_not_creep')) call relaxed_block_does_not_creep()
      if (selected('loads_are_as_prescribed')) call loads_are_as_prescribed()
   end subroutine run_simulation

   !> Lee-Radok: a sphere under a constant load, a^3 = (3/16) R F J(t), approach a^2/R (thesis, 2.2.1).
   subroutine lee_radok_sphere()
      type(record_type) :: record
      real(dp), parameter :: thesis(3) = [0.015536e-3_dp, 0.030167e-3_dp, 0.034552e-3_dp]
      real(dp) :: a
      integer :: k

      call run_case('&grid nx = 60, ny = 64, lx = 0.1e-3, ly = 0.1e-3, boundary = ''free'' /'//nl// &
         thesis_sphere//thesis_rubber//'&phase force = 0.02e-3, duration = 1, steps = 24 /'//nl// &
         '&phase duration = 19, steps = 20 /'//nl//'&solver tolerance = 1e-8 /', 'Lee-Radok', record)
      do k = 0, last(record)
         a = (3.0_dp/16.0_dp*radius*force*reference_compliance(1.0e6_dp/11.0_dp, [1.0e6_dp/1.1_dp], &
            [1.0_dp/11.0_dp], record%rows(k)%time))**(1.0_dp/3.0_dp)
         ! The area is a count of cells, with an error of half a cell along the edge of the contact.
         if (k <= 24) then
            call check_close(record%rows(k)%displacement*radius/a**2, 1.0_dp, 1e-3_dp, 'Lee-Radok: approach')
            call check_close(sqrt(record%rows(k)%contact_area*1e-8_dp/pi)/a, 1.0_dp, 1.6e-2_dp, &
               'Lee-Radok: contact radius')
         end if
         if (k == 0) call check_close(a, thesis(1), 1e-9_dp, 'a(0) of the thesis')
         if (k == 24) call check_close(a, thesis(2), 1e-9_dp, 'a(1 s) of the thesis')
         if (k == 44) call check_close(a, thesis(3), 1e-9_dp, 'a(inf) of the thesis')
      end do
      call check_close(record%rows(last(record))%displacement*radius/a**2, 1.0_dp, 2e-4_dp, &
         'Lee-Radok: final approach')
      call check_books(record, 'Lee-Radok')
   end subroutine lee_radok_sphere

   !> Lee-Radok for arms from 1 ms to 1 s, with steps that are longer in each phase.
   subroutine lee_radok_with_several_arms()
      type(record_type) :: record
      real(dp), parameter :: g(4) = [0.4e6_dp, 0.3e6_dp, 0.2e6_dp, 0.1e6_dp]
      real(dp), parameter :: tau(4) = [1e-3_dp, 1e-2_dp, 1e-1_dp, 1.0_dp]
      real(dp), parameter :: g_e = 0.1e6_dp
      real(dp) :: reference, worst
      integer :: k

      call check_close(reference_compliance(g_e, g, tau, 0.0_dp)*(g_e + sum(g)), 1.0_dp, 1e-12_dp, 'J(0)')
      call run_case(small_map//thesis_sphere// &
         '&material shear_modulus = 0.1e6, prony_g = 0.4e6, 0.3e6, 0.2e6, 0.1e6, '// &
         'prony_tau = 1e-3, 1e-2, 1e-1, 1 /'//nl// &
         '&phase force = 0.02e-3, duration = 4e-3, steps = 16 /'//nl// &
         '&phase duration = 0.036, steps = 16 /'//nl//'&phase duration = 0.36, steps = 16 /'//nl// &
         '&phase duration = 3.6, steps = 16 /'//nl//'&solver tolerance = 1e-8 /', 'four arms', record)
      worst = 0.0_dp
      do k = 0, last(record)
         reference = (3.0_dp/16.0_dp*radius*force*reference_compliance(g_e, g, tau, &
            record%rows(k)%time))**(2.0_dp/3.0_dp)/radius
         worst = max(worst, abs(record%rows(k)%displacement/reference - 1.0_dp))
      end do
      call check_close(worst, 0.0_dp, 1e-2_dp, 'four arms: approach')
      call check_close(record%rows(last(record))%time, 4.0_dp, 1e-14_dp, 'four arms: time')
      call check_books(record, 'four arms')
   end subroutine lee_radok_with_several_arms

   !> The error of a sphere's approach decreases with the number of cells over the contact.
   subroutine order_in_the_mesh()
      type(record_type) :: record
      integer, parameter :: cells(3) = [24, 48, 96]
      real(dp) :: errors(3)
      integer :: k

      do k = 1, 3
         call run_case('&grid nx = '//to_text(cells(k))//', ny = '//to_text(cells(k) - 2)// &
            ', lx = 0.1e-3, ly = 0.1e-3, boundary = ''free'' /'//nl//thesis_sphere//thesis_rubber// &
            '&phase force = 0.02e-3, duration = 0.2, steps = 16 /'//nl//'&solver tolerance = 1e-8 /', &
            'mesh', record)
         errors(k) = abs(record%rows(last(record))%displacement*radius/(3.0_dp/16.0_dp*radius*force &
            *reference_compliance(1.0e6_dp/11.0_dp, [1.0e6_dp/1.1_dp], [1.0_dp/11.0_dp], 0.2_dp)) &
            **(2.0_dp/3.0_dp) - 1.0_dp)
      end do
      call check_that(errors(2) < errors(1)/1.8_dp .and. errors(3) < errors(2)/1.8_dp &
         .and. errors(3) < errors(1)/6.0_dp, 'the approach converges with the mesh', errors)
      call check_close(errors(3), 0.0_dp, 2e-4_dp, 'approach with 75 cells over the contact')
   end subroutine order_in_the_mesh

   !> Orders in time on one mesh. The reference is a run with fine steps, so that the error of the mesh cancels.
   subroutine orders_in_time_of_the_schemes()
      type(record_type) :: record
      real(dp) :: reference, errors(3)
      real(dp), parameter :: least(3) = [0.95_dp, 1.9_dp, 1.9_dp]
      real(dp), parameter :: most(3) = [1.05_dp, 2.1_dp, 3.2_dp]
      real(dp) :: orders(2)
      integer, parameter :: steps(3) = [8, 16, 32]
      integer :: k, s

      reference = displacement('exponential2', 512)
      do s = 1, 3
         do k = 1, 3
            errors(k) = abs(displacement(trim(schemes(s)), steps(k))/reference - 1.0_dp)
         end do
         orders = log(errors(1:2)/errors(2:3))/log(2.0_dp)
         call check_that(minval(orders) > least(s) .and. maxval(orders) < most(s), &
            trim(schemes(s))//': orders '//to_text(orders(1))//', '//to_text(orders(2)), orders)
      end do
      call check_close(errors(1), 0.0_dp, 1e-4_dp, 'exponential2, a step of half a relaxation time')

   contains

      !> Return the approach of the last row.
      real(dp) function displacement(scheme, n)
         character(*), intent(in) :: scheme
         integer, intent(in) :: n

         call run_case(small_map//thesis_sphere//thesis_rubber// &
            '&phase force = 0.02e-3, duration = 0.4, steps = '//to_text(n)//' /'//nl// &
            '&solver tolerance = 1e-9, time_scheme = '''//scheme//''' /', scheme, record)
         displacement = record%rows(last(record))%displacement
      end function displacement

   end subroutine orders_in_time_of_the_schemes

   !> A sphere under a force that grows linearly: a^3 = (3/16) R (F/T) times the integral of J.
   subroutine sphere_under_a_growing_force()
      type(record_type) :: record
      real(dp), parameter :: j_glassy = 1e-6_dp, j_relaxed = 11e-6_dp, creep_time = 1.0_dp
      real(dp) :: t, integral, reference, worst
      integer :: k

      call run_case(small_map//thesis_sphere//thesis_rubber// &
         '&phase force = 0.02e-3, ramp = ''linear'', duration = 2, steps = 64 /'//nl// &
         '&solver tolerance = 1e-8 /', 'ramp', record)
      worst = 0.0_dp
      do k = 0, last(record)
         t = record%rows(k)%time
         call check_close(record%rows(k)%force, force*t/2.0_dp, 1e-8_dp*force, 'ramp: force')
         integral = j_relaxed*t - (j_relaxed - j_glassy)*creep_time*(1.0_dp - exp(-t/creep_time))
         reference = (3.0_dp/16.0_dp*radius*force/2.0_dp*integral)**(2.0_dp/3.0_dp)/radius
         if (t > 0.4_dp) worst = max(worst, abs(record%rows(k)%displacement/reference - 1.0_dp))
      end do
      call check_close(record%rows(0)%displacement, 0.0_dp, 1e-12_dp, 'ramp: first touch')
      call check_close(worst, 0.0_dp, 1e-2_dp, 'ramp: approach')
      call check_books(record, 'ramp')
   end subroutine sphere_under_a_growing_force

   !> Twenty arms over 15 decades, with steps far longer than most relaxation times, cause no ringing.
   subroutine many_decades_do_not_ring()
      type(record_type) :: record
      integer, parameter :: arms = 20
      real(dp) :: g(arms), tau(arms), reference, worst, growth, before
      character(:), allocatable :: g_text, tau_text
      logical :: steady
      integer :: k, s

      g_text = ''
      tau_text = ''
      do k = 1, arms
         tau(k) = 10.0_dp**(-12.0_dp + 15.0_dp*(k - 1)/(arms - 1.0_dp))
         g(k) = 0.2e6_dp
         g_text = g_text//', '//to_text(g(k))
         tau_text = tau_text//', '//to_text(tau(k))
      end do
      do s = 1, 3
         call run_case(small_map//thesis_sphere//'&material shear_modulus = 0.2e6, prony_g = '// &
            g_text(3:)//', prony_tau = '//tau_text(3:)//' /'//nl// &
            '&phase force = 0.02e-3, duration = 1000, steps = 20 /'//nl//'&solver tolerance = 1e-9, '// &
            'time_scheme = '''//trim(schemes(s))//''' /', '20 arms, '//trim(schemes(s)), record)
         steady = .true.
         worst = 0.0_dp
         before = huge(1.0_dp)
         do k = 1, last(record)
            growth = record%rows(k)%displacement - record%rows(k - 1)%displacement
            steady = steady .and. growth > 0.0_dp .and. growth < before
            before = growth
            reference = (3.0_dp/16.0_dp*radius*force*reference_compliance(0.2e6_dp, g, tau, &
               record%rows(k)%time))**(2.0_dp/3.0_dp)/radius
            ! The first steps contain most of the spectrum.
            if (k == 1) call check_close(record%rows(k)%displacement/reference, 1.0_dp, 0.08_dp, &
               '20 arms, '//trim(schemes(s))//': first step')
            if (k > 4) worst = max(worst, abs(record%rows(k)%displacement/reference - 1.0_dp))
         end do
         call check_that(steady, '20 arms, '//trim(schemes(s))//': creep slows down without ringing')
         call check_close(worst, 0.0_dp, 0.015_dp, '20 arms, '//trim(schemes(s))//': approach')
         call check_books(record, '20 arms, '//trim(schemes(s)))
      end do
   end subroutine many_decades_do_not_ring

   !> After a drop of the load the contact area never decreases (arXiv 2511.19402).
   subroutine area_never_falls_after_a_drop()
      type(record_type) :: record
      integer :: k, s, fallen
      real(dp) :: least

      do s = 1, 3
         call run_case(rough//two_arms//'&phase pressure = 60e3, duration = 0.3, steps = 10 /'//nl// &
            '&phase pressure = 20e3, duration = 0.3, steps = 60 /'//nl// &
            '&solver tolerance = 1e-8, time_scheme = '''//trim(schemes(s))//''' /', 'drop of load', record)
         fallen = 0
         do k = 12, last(record)
            if (record%rows(k)%contact_area < record%rows(k - 1)%contact_area) fallen = fallen + 1
         end do
         least = record%rows(11)%contact_area
         call check_order(least, '<', 0.9_dp*record%rows(10)%contact_area, &
            'a drop of load opens contact')
         call check_order(record%rows(last(record))%contact_area, '>', 1.04_dp*least, &
            'the contact area grows after the drop')
         call check_that(fallen == 0, 'the contact area never decreases after the drop, '//trim(schemes(s)))
         call check_books(record, 'drop of load, '//trim(schemes(s)))
      end do
   end subroutine area_never_falls_after_a_drop

   !> The work of the traction and that of the load agree as the steps become shorter. Only backward Euler has a
   !> numerical loss.
   subroutine work_agrees_with_that_of_the_load()
      type(record_type) :: record
      real(dp) :: difference(2), numerical(2)
      integer :: n, s

      do s = 1, 3
         do n = 1, 2
            call run_case(rough//slow_arms//'&phase pressure = 40e3, duration = 0.1, steps = ' &
               //to_text(20*n)//' /'//nl//'&phase pressure = 10e3, ramp = ''linear'', duration = 0.1, '// &
               'steps = '//to_text(20*n)//' /'//nl//'&solver tolerance = 1e-9, time_scheme = '''// &
               trim(schemes(s))//''' /', 'works', record)
            associate (end => record%rows(last(record)))
               difference(n) = abs(end%work_load - end%work_normal)/end%work_normal
               numerical(n) = end%dissipated_numerical/end%dissipated_viscous
            end associate
            call check_books(record, 'work of the load')
         end do
         call check_that(difference(2) < 0.6_dp*difference(1) .and. difference(2) < 0.01_dp, &
            'the works of the load and of the traction agree, '//trim(schemes(s))//': '//to_text(difference(1))// &
            ', '//to_text(difference(2)), difference)
         if (s == 1) then
            call check_that(numerical(1) > 0.0_dp .and. numerical(2) < 0.7_dp*numerical(1), &
               'the numerical loss shrinks with the step', numerical)
         else
            call check_close(numerical(1), 0.0_dp, 0.0_dp, 'no numerical loss')
         end if
      end do
   end subroutine work_agrees_with_that_of_the_load

   !> An arm and the same arm split in two, Zener branches and their arms, and any order of the arms, agree.
   subroutine split_and_reordered_arms_agree()
      type(record_type) :: one, two
      character(*), parameter :: phases = '&phase pressure = 40e3, duration = 0.1, steps = 10 /'//nl// &
         '&phase pressure = 10e3, duration = 0.1, steps = 5 /'//nl//'&solver tolerance = 1e-8 /'
      integer :: s

      do s = 1, 3
         call run_case(rough//'&material shear_modulus = 0.5e6, prony_g = 1.0e6, prony_tau = 0.02 /'//nl// &
            phases(:len(phases) - 1)//' time_scheme = '''//trim(schemes(s))//''' /', 'one arm', one)
         call run_case(rough//'&material shear_modulus = 0.5e6, prony_g = 0.3e6, 0.7e6, '// &
            'prony_tau = 0.02, 0.02 /'//nl// &
            phases(:len(phases) - 1)//' time_scheme = '''//trim(schemes(s))//''' /', 'split arm', two)
         call check_same_rows(one, two, 1e-9_dp, 'an arm split in two, '//trim(schemes(s)))
      end do
      call run_case(rough//two_arms//phases, 'two arms', one)
      call run_case(rough//'&material shear_modulus = 0.5e6, prony_g = 0.7e6, 1.0e6, '// &
         'prony_tau = 0.1, 1e-3 /'//nl//phases, 'two arms', two)
      call check_same_rows(one, two, 1e-9_dp, 'arms in another order')
   end subroutine split_and_reordered_arms_agree

   !> A block that has long been at rest holds its load without creep, like an elastic block of the long-term modulus.
   subroutine relaxed_block_does_not_creep()
      type(record_type) :: rested, elastic
      integer :: k

      call run_case(rough//two_arms//'&phase pressure = 40e3, relaxed = .true., duration = 0.2, '// &
         'steps = 7 /'//nl//'&solver tolerance = 1e-9 /', 'relaxed', rested)
      call run_case(rough//'&material shear_modulus = 0.5e6 /'//nl//'&phase pressure = 40e3 /'//nl// &
         '&solver tolerance = 1e-9 /', 'elastic', elastic)
      do k = 0, last(rested)
         associate (row => rested%rows(k), held => elastic%rows(0))
            call check_close(row%displacement, held%displacement, 1e-7_dp*held%displacement, 'relaxed: approach')
            call check_close(row%contact_area, held%contact_area, 1e-12_dp, 'relaxed: area')
            call check_close(row%energy_elastic, held%energy_elastic, 1e-7_dp*held%energy_elastic, &
               'relaxed: energy')
            call check_close(row%dissipated_viscous, 0.0_dp, 1e-12_dp*held%energy_elastic, 'relaxed: no loss')
         end associate
      end do
      call check_books(rested, 'relaxed')
   end subroutine relaxed_block_does_not_creep

   !> Loads follow the input: ramps in each control, changes of the control, and phases that inherit a load.
   subroutine loads_are_as_prescribed()
      type(record_type) :: record
      real(dp), parameter :: area = 1.2e-6_dp
      real(dp) :: start
      integer :: k

      call run_case(rough//two_arms// &
         '&phase pressure = 20e3, ramp = ''linear'', duration = 0.1, steps = 4 /'//nl// &    ! rows 0-4
         '&phase duration = 0.1, steps = 3 /'//nl// &                                        ! 5-7
         '&phase force = 0.06, ramp = ''linear'', duration = 0.1, steps = 5 /'//nl// &       ! 8-12
         '&phase displacement = 12.0e-6, ramp = ''linear'', duration = 0.2, steps = 4 /'//nl// &! 13-16
         '&phase duration = 0.1, steps = 2 /'//nl// &                                        ! 17-18
         '&phase pressure = 10e3 /'//nl// &                                                  ! 19
         '&phase duration = 0.1, steps = 2 /'//nl// &                                        ! 20-21
         '&phase displacement = 12.2e-6, duration = 0.1, steps = 2 /'//nl// &                   ! 22-24
         '&solver tolerance = 1e-9 /', 'loads', record)
      call check_that(last(record) == 24, 'loads: the run has 24 rows after the first')
      if (last(record) /= 24) return
      associate (rows => record%rows)
         do k = 0, 4
            call check_close(rows(k)%pressure, 5e3_dp*k, 1e-4_dp, 'ramp of pressure from 0')
         end do
         do k = 5, 7
            call check_close(rows(k)%pressure, 20e3_dp, 1e-4_dp, 'a phase that inherits its load')
         end do
         do k = 8, 12
            call check_close(rows(k)%force, 20e3_dp*area + (0.06_dp - 20e3_dp*area)*(k - 7)/5.0_dp, &
               1e-9_dp, 'ramp of force after a pressure')
            call check_close(rows(k)%pressure*area, rows(k)%force, 1e-12_dp, 'force and pressure')
         end do
         start = rows(12)%displacement
         do k = 13, 16
            call check_close(rows(k)%displacement, start + (12.0e-6_dp - start)*(k - 12)/4.0_dp, 1e-15_dp, &
               'ramp of displacement after a force')
         end do
         do k = 17, 18
            call check_close(rows(k)%displacement, 12.0e-6_dp, 1e-15_dp, 'a displacement held')
            call check_order(rows(k)%pressure, '<', rows(k - 1)%pressure, 'the pressure relaxes')
         end do
         call check_close(rows(19)%time, rows(18)%time, 0.0_dp, 'a static phase takes no time')
         call check_close(rows(19)%pressure, 10e3_dp, 1e-4_dp, 'a static phase')
         call check_close(rows(21)%pressure, 10e3_dp, 1e-4_dp, 'its load is held')
         call check_close(rows(22)%time, rows(21)%time, 0.0_dp, 'a jump takes no time')
         call check_close(rows(22)%displacement, 12.2e-6_dp, 1e-15_dp, 'a jump to a displacement')
         call check_close(rows(24)%time, 0.8_dp, 1e-14_dp, 'the last time')
         call check_that(all(rows(:)%phase == [1, 1, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, &
            6, 7, 7, 8, 8, 8]), 'phases of the rows')
      end associate
      call check_books(record, 'loads')
   end subroutine loads_are_as_prescribed

end module test_simulation
