!> Tests of the step loop with a moving road: known solutions, invariances, free boundaries.
module test_simulation_sliding
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_errors, only : error_type
   use asperity_threads, only : set_threads
   use asperity_precision, only : dp, pi
   use real_transform, only : destroy_real_transform, new_real_transform, real_transform_type, &
      to_spectrum
   use simulation_runs, only : check_books, check_same_rows, last, nl, record_type, run_case, write_map
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_simulation_sliding

   character(*), parameter :: schemes(3) = [character(14) :: 'backward_euler', 'exponential', &
      'exponential2']
   character(*), parameter :: map_file = 'build/test_sliding_map.h5'

contains

   subroutine run_simulation_sliding()
      call begin_suite('simulation_sliding')
      if (selected('hunter_cylinder_in_time')) call hunter_cylinder_in_time()
      if (selected('friction_at_low_and_high_speed')) call friction_at_low_and_high_speed()
      if (selected('rough_road_in_full_contact')) call rough_road_in_full_contact()
      if (selected('drag_of_a_coarse_wave')) call drag_of_a_coarse_wave()
      if (selected('elastic_road_gives_back_its_work')) call elastic_road_gives_back_its_work()
      if (selected('orders_in_time_of_the_drag')) call orders_in_time_of_the_drag()
      if (selected('outside_work_is_that_of_the_traction')) &
         call outside_work_is_that_of_the_traction()
      if (selected('resting_road_is_a_block_at_rest')) call resting_road_is_a_block_at_rest()
      if (selected('shifted_mirrored_rotated_and_scaled_roads_agree')) &
         call shifted_mirrored_rotated_and_scaled_roads_agree()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads()
      if (selected('sphere_crosses_a_free_map')) call sphere_crosses_a_free_map()
      if (selected('contact_at_the_edge_is_reported')) call contact_at_the_edge_is_reported()
      if (selected('contacts_of_few_cells')) call contacts_of_few_cells()
      if (selected('small_patches_of_an_earlier_phase_are_reported')) call small_patches_of_an_earlier_phase_are_reported()
      if (selected('road_slides_at_its_speed_without_friction')) call road_slides_at_its_speed_without_friction()
   end subroutine run_simulation_sliding

   !> Without friction the surface does not move along the road: the sliding speed is that of the road in every row, and 0
   !> at rest and in jumps.
   subroutine road_slides_at_its_speed_without_friction()
      real(dp), parameter :: expected(0:7) = [1.0_dp, 0.5_dp, 0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 2.0_dp, 0.0_dp]
      type(record_type) :: record
      integer :: k

      call run_case('&grid nx = 16, ny = 16, lx = 1e-3 /'//nl// &
         '&surface shape = ''sine'', amplitude = 1e-6, wavelength = 1e-3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-4 /'//nl// &
         '&phase pressure = 1e4, steady = .true., velocity_x = 1 /'//nl// &
         '&phase velocity_x = 0.3, velocity_y = -0.4, duration = 1e-3, steps = 2 /'//nl// &
         '&phase duration = 1e-3, steps = 2 /'//nl//'&phase relaxed = .true. /'//nl// &
         '&phase velocity_y = 2, duration = 1e-4, steps = 1 /'//nl//'&phase pressure = 2e4 /', 'speed of the road', record)
      do k = 0, 7
         call check_close(record%rows(k)%sliding_speed, expected(k), 1e-12_dp, 'speed of the road in row '//to_text(k))
      end do
   end subroutine road_slides_at_its_speed_without_friction

   !> Return the friction of Hunter's cylinder, with one cell per step and 100 cells over the contact. The cell of `cells`
   !> cells is periodic: its images deform the rubber like a road of another curvature, by a factor of about (pi a/L)^2/6,
   !> where a is the half width.
   real(dp) function cylinder_friction(velocity, half_width, cells, scheme) result(friction)
      real(dp), intent(in) :: velocity        !! m/s
      real(dp), intent(in) :: half_width      !! m
      integer, intent(in) :: cells
      character(*), intent(in) :: scheme
      real(dp), parameter :: load = 50.0_dp   !! N/m
      type(record_type) :: record
      real(dp) :: length, dx
      integer :: steps

      dx = half_width/50.0_dp
      length = cells*dx
      steps = 150 + nint(0.05_dp*velocity/dx)
      call run_case('&grid nx = '//to_text(cells)//', ny = 1, lx = '//exact_text(length)//' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 10e-3 /'//nl// &
         '&material zener_g0 = 2.75e6, zener_g1 = 0.305555555555555e6, zener_eta = 3.05555555555555e3 /' &
         //nl//'&phase pressure = '//exact_text(load/length)//', relaxed = .true., velocity_x = '// &
         exact_text(velocity)//', duration = '//exact_text(steps*dx/velocity)//', steps = '// &
         to_text(steps)//' /'//nl//'&solver tolerance = 1e-7, time_scheme = '''//scheme//''' /', &
         'Hunter', record)
      friction = record%rows(last(record))%friction
      ! The first step is solved in three parts, whose iterations are added.
      call check_order(record%rows(lbound(record%rows, 1) + 1)%iterations_normal, '<', 3*60, &
         'Hunter: iterations of the first step')
      call check_order(maxval(record%rows(lbound(record%rows, 1) + 2:)%iterations_normal), '<', 60, &
         'Hunter: iterations of a step')
      call check_books(record, 'Hunter, '//scheme)
   end function cylinder_friction

   !> Hunter's cylinder in steady sliding (Hunter, 1961) at three speeds.
   subroutine hunter_cylinder_in_time()
      real(dp), parameter :: velocity(3) = [5e-3_dp, 20e-3_dp, 100e-3_dp]
      real(dp), parameter :: half_width(3) = [0.73826627e-3_dp, 0.67155531e-3_dp, 0.39313100e-3_dp]
      real(dp), parameter :: exact(3) = [0.0043374599_dp, 0.0154266908_dp, 0.0367341527_dp]
      real(dp) :: coarse, friction
      integer :: k

      do k = 1, 2
         friction = cylinder_friction(velocity(k), half_width(k), 2048, 'exponential2')
         call check_close(friction/exact(k), 1.0_dp, 3e-4_dp, 'Hunter, exponential2')
         friction = cylinder_friction(velocity(k), half_width(k), 2048, 'exponential')
         call check_close(friction/exact(k), 1.0_dp, 5e-3_dp, 'Hunter, exponential')
         friction = cylinder_friction(velocity(k), half_width(k), 2048, 'backward_euler')
         call check_close(friction/exact(k), 0.99_dp, 1e-3_dp, 'Hunter, backward Euler')
      end do
      ! In this cell the direction from the previous step violates the constraints.
      friction = cylinder_friction(velocity(1), half_width(1), 1024, 'exponential2')
      call check_close(friction/exact(1), 1.0_dp, 5e-4_dp, 'Hunter, a smaller cell')
      ! At a high speed the contact is small compared to the wake of 1 mm, so that the images have more effect, as 1/L^2.
      coarse = cylinder_friction(velocity(3), half_width(3), 2048, 'exponential2')
      friction = cylinder_friction(velocity(3), half_width(3), 4096, 'exponential2')
      call check_close(friction/exact(3), 1.0_dp, 3e-3_dp, 'Hunter, fast')
      call check_close((friction + (friction - coarse)/3.0_dp)/exact(3), 1.0_dp, 1e-3_dp, &
         'Hunter, fast, extrapolated to an infinite cell')
   end subroutine hunter_cylinder_in_time

   !> For a sphere mu R/a0 -> (1 - E_relaxed/E_glassy) V tau_creep/a0 at low speed, whatever the load; at high speed there
   !> is no friction.
   subroutine friction_at_low_and_high_speed()
      type(record_type) :: record
      real(dp), parameter :: radius = 10e-3_dp, creep_time = 0.01_dp, dx = 20e-6_dp
      real(dp) :: mu(2), velocity
      integer :: k

      do k = 1, 2
         velocity = merge(2e-4_dp, 400.0_dp, k == 1)
         call run_case('&grid nx = 128, ny = 96, lx = 2.56e-3, ly = 2.112e-3, boundary = ''free'' /'//nl// &
            '&surface shape = ''paraboloid'', radius = 10e-3, centre_x = 0.9e-3 /'//nl// &
            '&material zener_g0 = 2.75e6, zener_g1 = 0.305555555555555e6, zener_eta = 3.05555555555555e3 /' &
            //nl//'&phase force = 0.01, relaxed = '//merge('T', 'F', k == 1)//', velocity_x = '//exact_text(velocity)// &
            ', duration = '//exact_text(20*dx/velocity)//', steps = 20 /'//nl//'&solver tolerance = 1e-8 /', &
            'speed limit', record)
         mu(k) = record%rows(last(record))%friction
         call check_books(record, 'speed limit')
         call check_close(record%rows(last(record) - 1)%friction, mu(k), merge(1e-6_dp, 1.0_dp, k == 1)*mu(k), &
            'low speed: steady')
      end do
      call check_close(mu(1)/(0.9_dp*2e-4_dp*creep_time/radius), 1.0_dp, 5e-3_dp, 'friction at low speed')
      call check_close(mu(2), 0.0_dp, 1e-5_dp, 'friction at high speed')
   end subroutine friction_at_low_and_high_speed

   !> The exact friction stress of a road in full contact, wave by wave: each arm's traction satisfies
   !> p' + p/tau = g S' where S varies as exp(-i q.V t).
   subroutine full_contact(record, lx, ly, g_e, g, tau, velocity, time, stress)
      type(record_type), intent(in) :: record
      real(dp), intent(in) :: lx, ly            !! m
      real(dp), intent(in) :: g_e, g(:), tau(:)
      real(dp), intent(in) :: velocity(:, :)    !! between one time and the next, m/s [2, times]
      real(dp), intent(in) :: time(0:)          !! s; the road is at rest until the first one
      real(dp), allocatable, intent(out) :: stress(:, :)   !! on the rubber, Pa [2, 0:times]
      type(real_transform_type) :: transform
      type(error_type), allocatable :: error
      complex(dp) :: height, now, before, arm(size(g)), traction
      real(dp) :: q(2), omega, dt, weight
      integer :: i, j, k, m, nx, ny

      nx = size(record%height, 1)
      ny = size(record%height, 2)
      allocate (stress(2, 0:size(time) - 1), source=0.0_dp)
      call new_real_transform(transform, nx, ny, error)
      if (allocated(error)) return
      transform%space(:nx, :) = record%height
      call to_spectrum(transform)
      do j = 1, ny
         do i = 1, (nx + 1)/2
            if (i == 1 .and. (j == 1 .or. 2*(j - 1) == ny)) cycle
            q = 2.0_dp*pi*[(i - 1)/lx, (modulo(j - 1 + ny/2, ny) - ny/2)/ly]
            if (2*(j - 1) == ny) cycle
            weight = merge(1.0_dp, 2.0_dp, i == 1)          ! waves in pairs +q, -q
            height = transform%spectrum(i, j)/(real(nx, dp)*ny)
            if (abs(height) < 1e-16_dp*maxval(abs(record%height))) cycle
            before = height*norm2(q)/0.5_dp                 ! S = U q/(1 - nu)
            now = before
            arm = 0.0_dp
            do k = 0, size(time) - 1
               if (k > 0) then
                  omega = dot_product(q, velocity(:, k))
                  dt = time(k) - time(k - 1)
                  now = before*exp(cmplx(0.0_dp, -omega*dt, dp))
                  do m = 1, size(g)
                     arm(m) = arm(m)*exp(-dt/tau(m)) + g(m)*before*cmplx(0.0_dp, -omega, dp) &
                        *(exp(cmplx(0.0_dp, -omega*dt, dp)) - exp(-dt/tau(m))) &
                        /cmplx(1.0_dp/tau(m), -omega, dp)
                  end do
               end if
               traction = g_e*now + sum(arm)
               ! -mean(P grad H) with grad H = i q H
               stress(:, k) = stress(:, k) + weight*real(traction*conjg(cmplx(0.0_dp, 1.0_dp, dp) &
                  *now*0.5_dp/norm2(q)))*(-q)
               before = now
            end do
         end do
      end do
      call destroy_real_transform(transform)
   end subroutine full_contact

   !> A rough road in full contact moves obliquely over a grid of oblong cells, with jumps of the speed and of the load, and
   !> steps of all sizes: both components of its drag are exact.
   subroutine rough_road_in_full_contact()
      type(record_type) :: record
      real(dp), allocatable :: stress(:, :), velocity(:, :)
      real(dp), parameter :: lx = 0.96e-3_dp, ly = 0.6e-3_dp
      real(dp), parameter :: allowed(3) = [0.1_dp, 0.02_dp, 0.01_dp]
      real(dp) :: worst
      integer :: k, s

      do s = 1, 3
         call run_case('&grid nx = 64, ny = 50, lx = 0.96e-3, ly = 0.6e-3 /'//nl// &
            '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, wavelength_short = 0.25e-3, '// &
            'rms_height = 1e-6, seed = 5 /'//nl// &
            '&material shear_modulus = 0.5e6, prony_g = 1e6, 2e6, prony_tau = 2e-3, 5e-2 /'//nl// &
            ! The road moves by 2 and -1 cells per step, then -1 and 0, then 0 and 2, then it rests.
            '&phase pressure = 5e5, relaxed = .true., duration = 0.02, steps = 20, velocity_x = 30e-3, '// &
            'velocity_y = -12e-3 /'//nl// &
            '&phase duration = 0.005, steps = 10, velocity_x = -30e-3 /'//nl// &
            '&phase pressure = 6e5, ramp = ''linear'', duration = 0.02, steps = 10, velocity_y = 12e-3 /'//nl// &
            '&phase pressure = 5e5, duration = 0.005, steps = 5 /'//nl// &
            '&solver tolerance = 1e-8, interpolation = ''cubic'', time_scheme = '''//trim(schemes(s))// &
            ''' /', 'waves', record)
         allocate (velocity(2, last(record)), source=0.0_dp)
         do k = 1, last(record)
            select case (record%rows(k)%phase)
            case (1)
               velocity(:, k) = [30e-3_dp, -12e-3_dp]
            case (2)
               velocity(1, k) = -30e-3_dp
            case (3)
               velocity(2, k) = 12e-3_dp
            end select
         end do
         call full_contact(record, lx, ly, 0.5e6_dp, [1e6_dp, 2e6_dp], [2e-3_dp, 5e-2_dp], velocity, &
            record%rows%time, stress)
         worst = maxval(abs(record%drag/(lx*ly) - stress))/maxval(abs(stress))
         call check_close(worst, 0.0_dp, allowed(s), 'drag of waves, '//trim(schemes(s)))
         call check_close(minval(record%rows%contact_area), 1.0_dp, 0.0_dp, 'waves: full contact')
         call check_that(all(maxval(abs(stress), dim=2) > 200.0_dp), 'waves: the drag has both components', &
            [minval(maxval(abs(stress), dim=2))])
         call check_books(record, 'waves')
         deallocate (velocity, stress)
      end do
   end subroutine rough_road_in_full_contact

   !> The steady drag of a wave of eight cells in full contact, with the defaults and one cell per step, is within 1 % of the
   !> closed form. Central differences would make it 10 % too low.
   subroutine drag_of_a_coarse_wave()
      type(record_type) :: record
      real(dp), parameter :: amplitude = 1e-6_dp, wave = 0.1e-3_dp, speed = 0.02_dp, tau = 1e-3_dp
      real(dp), parameter :: k = 2.0_dp*pi/wave, omega_tau = k*speed*tau
      real(dp) :: stress

      call run_case('&grid nx = 16, ny = 1, lx = 0.2e-3 /'//nl// &
         '&surface shape = ''sine'', amplitude = 1e-6, wavelength = 0.1e-3 /'//nl// &
         '&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 1e-3 /'//nl// &
         '&phase pressure = 1e6, relaxed = .true., duration = 20e-3, velocity_x = 0.02 /'//nl// &
         '&solver tolerance = 1e-10 /', 'coarse wave', record)
      ! mean(-P dH/dx) with P = Re(2 G(i omega) k H) of an incompressible half-space
      stress = amplitude**2*k**2*1e6_dp*omega_tau/(1.0_dp + omega_tau**2)
      call check_close(minval(record%rows%contact_area), 1.0_dp, 0.0_dp, 'coarse wave: full contact')
      call check_close(record%drag(1, last(record))/(16*record%cell_area)/stress, 1.0_dp, 0.01_dp, &
         'coarse wave: drag')
   end subroutine drag_of_a_coarse_wave

   !> An elastic rubber returns the work that it receives: the drag over a distance within one cell is the change of the
   !> elastic energy at a fixed approach, by Simpson's rule over 16 steps.
   subroutine elastic_road_gives_back_its_work()
      type(record_type) :: record
      real(dp), parameter :: d_x = 12e-6_dp/16, d_y = -7e-6_dp/16
      real(dp) :: energy, weight, work, work_sizes
      integer :: k

      call run_case('&grid nx = 40, ny = 30, lx = 1e-3, ly = 0.6e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.15e-3, rms_slope = 0.1, seed = 4 /'//nl// &
         '&material shear_modulus = 1e6 /'//nl// &
         '&phase displacement = 3e-6, velocity_x = 12e-3, velocity_y = -7e-3, duration = 1e-3, steps = 16 /' &
         //nl//'&solver tolerance = 1e-10 /', 'elastic road', record)
      work = 0.0_dp
      work_sizes = 0.0_dp
      associate (first => last(record) - 16)
         do k = 0, 16
            weight = merge(4.0_dp, 2.0_dp, mod(k, 2) == 1)/3.0_dp
            if (k == 0 .or. k == 16) weight = 1.0_dp/3.0_dp
            work = work + weight*(record%drag(1, first + k)*d_x + record%drag(2, first + k)*d_y)
            work_sizes = work_sizes + abs(record%drag(1, first + k)*d_x + record%drag(2, first + k)*d_y)
         end do
         energy = record%rows(last(record))%energy_elastic - record%rows(first)%energy_elastic
      end associate
      call check_close((work - energy)/work_sizes, 0.0_dp, 1.0e-3_dp, 'elastic road: the work of the drag is the change of energy')
   end subroutine elastic_road_gives_back_its_work

   !> Orders in time of the oblique drag, including the start from rest.
   subroutine orders_in_time_of_the_drag()
      type(record_type) :: record
      real(dp), allocatable :: stress(:, :), velocity(:, :)
      real(dp), parameter :: lx = 0.96e-3_dp, ly = 0.6e-3_dp
      real(dp), parameter :: least(3) = [0.9_dp, 1.9_dp, 1.9_dp]
      real(dp) :: errors(3), orders(2)
      integer, parameter :: stride(3) = [4, 2, 1]
      integer :: k, s, steps

      do s = 1, 3
         do k = 1, 3
            steps = 32/stride(k)
            call run_case('&grid nx = 64, ny = 50, lx = 0.96e-3, ly = 0.6e-3 /'//nl// &
               '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, wavelength_short = 0.4e-3, '// &
               'rms_height = 1e-6, seed = 5 /'//nl// &
               '&material shear_modulus = 0.5e6, prony_g = 1e6, 2e6, prony_tau = 5e-3, 5e-2 /'//nl// &
               '&phase pressure = 5e5, relaxed = .true., duration = 0.016, steps = '//to_text(steps)// &
               ', velocity_x = -30e-3, velocity_y = 24e-3 /'//nl// &
               '&solver tolerance = 1e-9, interpolation = ''cubic'', time_scheme = '''// &
               trim(schemes(s))//''' /', 'order', record)
            allocate (velocity(2, steps))
            velocity(1, :) = -30e-3_dp
            velocity(2, :) = 24e-3_dp
            call full_contact(record, lx, ly, 0.5e6_dp, [1e6_dp, 2e6_dp], [5e-3_dp, 5e-2_dp], velocity, &
               record%rows%time, stress)
            errors(k) = maxval(abs(record%drag(:, ::steps/8)/(lx*ly) - stress(:, ::steps/8))) &
               /maxval(abs(stress))
            deallocate (velocity, stress)
         end do
         orders = log(errors(1:2)/errors(2:3))/log(2.0_dp)
         call check_order(minval(orders), '>', least(s), &
            'waves, '//trim(schemes(s))//': orders '// to_text(orders(1))//', '//to_text(orders(2)))
      end do
   end subroutine orders_in_time_of_the_drag

   !> The work of the load and the road from outside approaches the work of the traction as the steps become shorter, with
   !> the order of the scheme.
   subroutine outside_work_is_that_of_the_traction()
      type(record_type) :: record
      real(dp) :: difference(3)
      integer :: k

      do k = 1, 3
         call run_case('&grid nx = 128, ny = 90, lx = 1.28e-3, ly = 0.99e-3 /'//nl// &
            '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, '// &
            'wavelength_short = 0.3e-3, rms_height = 4e-6, seed = 3 /'//nl// &
            '&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 0.02 /'//nl// &
            '&phase pressure = 2e4, relaxed = .true., velocity_x = 10e-3, velocity_y = 11e-3, '// &
            'duration = 0.032, steps = '//to_text(4*2**k)//' /'//nl//'&solver tolerance = 1e-9 /', &
            'works', record)
         associate (end => record%rows(last(record)), start => record%rows(0))
            difference(k) = abs(end%work_load + end%work_drive - end%work_normal) &
               /(end%work_normal - start%work_normal)
         end associate
         call check_books(record, 'work from outside')
      end do
      ! The parts of the first step leave so small an error in coarse steps that the first two differences are not ordered.
      call check_that(maxval(difference(:2)) < 0.012_dp .and. difference(3) < 0.5_dp*difference(2) &
         .and. difference(3) < 0.005_dp, 'the works from outside and of the traction agree: '//to_text(difference(1))//', '// &
         to_text(difference(2))//', '//to_text(difference(3)), difference)
   end subroutine outside_work_is_that_of_the_traction

   !> While the road does not move, the rows are those of a block at rest.
   subroutine resting_road_is_a_block_at_rest()
      type(record_type) :: moving, resting
      character(*), parameter :: body = '&grid nx = 48, ny = 40, lx = 1.2e-3, ly = 0.9e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, '// &
         'wavelength_short = 0.2e-3, rms_height = 4e-6, seed = 3 /'//nl// &
         '&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 0.02 /'//nl// &
         '&solver tolerance = 1e-8 /'//nl//'&phase pressure = 2e4, duration = 0.1, steps = 10'
      integer :: k

      call run_case(body//' /', 'at rest', resting)
      call run_case(body//', velocity_x = 0, velocity_y = 0 /'//nl// &
         '&phase velocity_y = 0.1, duration = 0.01, steps = 10 /', 'at rest, then moving', moving)
      call check_that(last(moving) == last(resting) + 10, 'a change of speed adds no row')
      do k = 0, last(resting)
         call check_close(moving%rows(k)%displacement, resting%rows(k)%displacement, &
            1e-12_dp*resting%rows(k)%displacement, 'no speed: approach')
         call check_close(moving%rows(k)%contact_area, resting%rows(k)%contact_area, 0.0_dp, 'no speed: area')
         call check_close(moving%rows(k)%friction, 0.0_dp, 0.0_dp, 'no speed: friction')
      end do
      call check_order(moving%rows(last(moving))%friction, '>', 0.01_dp, &
         'there is friction once the road moves')
   end subroutine resting_road_is_a_block_at_rest

   !> Roads that are shifted, mirrored, rotated or scaled give the same numbers.
   subroutine shifted_mirrored_rotated_and_scaled_roads_agree()
      integer, parameter :: nx = 40, ny = 27
      type(record_type) :: base, other
      real(dp) :: map(nx, ny), turned(ny, nx)
      character(*), parameter :: methods(2) = [character(6) :: 'linear', 'cubic']
      integer :: i, j, k

      do j = 1, ny
         do i = 1, nx
            map(i, j) = 3e-6_dp*(cos(2*pi*(2*i/40.0_dp + j/27.0_dp)) + 0.7_dp*cos(2*pi*(i/40.0_dp &
               - 2*j/27.0_dp) + 1.0_dp) + 0.5_dp*sin(2*pi*(3*i/40.0_dp + 2*j/27.0_dp)))
         end do
      end do
      do k = 1, 2
         call slide(map, '1.0e-3', '0.81e-3', '1', '11e-3', '-4e-3', base)
         call check_books(base, 'oblique')
         call check_order(base%rows(last(base))%friction, '>', 0.01_dp, 'oblique: friction')
         call slide(cshift(cshift(map, 7, 1), -4, 2), '1.0e-3', '0.81e-3', '1', '11e-3', '-4e-3', other)
         call check_same_rows(base, other, 1e-8_dp, 'moved by whole cells')
         call slide(map(nx:1:-1, :), '1.0e-3', '0.81e-3', '1', '-11e-3', '-4e-3', other)
         call check_same_rows(base, other, 1e-8_dp, 'mirrored along x')
         call slide(map(nx:1:-1, ny:1:-1), '1.0e-3', '0.81e-3', '1', '-11e-3', '4e-3', other)
         call check_same_rows(base, other, 1e-8_dp, 'turned by 180 degrees')
         turned = transpose(map)
         call slide(turned, '0.81e-3', '1.0e-3', '1', '-4e-3', '11e-3', other)
         call check_same_rows(base, other, 1e-8_dp, 'x and y exchanged')
         call slide(2.0_dp*map, '2.0e-3', '1.62e-3', '3', '22e-3', '-8e-3', other)
         other%rows%pressure = other%rows%pressure/3.0_dp
         other%rows%displacement = other%rows%displacement/2.0_dp
         other%rows%mean_gap = other%rows%mean_gap/2.0_dp
         other%rows%work_normal = other%rows%work_normal/24.0_dp
         other%rows%energy_elastic = other%rows%energy_elastic/24.0_dp
         other%rows%dissipated_viscous = other%rows%dissipated_viscous/24.0_dp
         other%rows%work_load = other%rows%work_load/24.0_dp
         other%rows%work_drive = other%rows%work_drive/24.0_dp
         call check_same_rows(base, other, 1e-8_dp, 'twice the lengths, three times the moduli')
      end do

   contains

      !> Slide over a map in steps that are not whole cells. `factor` scales the moduli and with them the load.
      subroutine slide(h, lx, ly, factor, velocity_x, velocity_y, record)
         real(dp), intent(in) :: h(:, :)
         character(*), intent(in) :: lx, ly, factor, velocity_x, velocity_y
         type(record_type), intent(out) :: record

         call write_map(map_file, h)
         call run_case('&grid nx = '//to_text(size(h, 1))//', ny = '//to_text(size(h, 2))//', lx = '//lx// &
            ', ly = '//ly//' /'//nl//'&surface shape = ''file'', file = '''//map_file//''' /'//nl// &
            '&material shear_modulus = '//factor//'e5, prony_g = '//factor// &
            'e6, prony_tau = 4e-3 /'//nl//'&phase pressure = '//factor//'e4, duration = 0.02, steps = 12, '// &
            'velocity_x = '//velocity_x//', velocity_y = '//velocity_y//' /'//nl// &
            '&solver tolerance = 1e-11, interpolation = '''//trim(methods(k))//''' /', 'invariances', record)
      end subroutine slide

   end subroutine shifted_mirrored_rotated_and_scaled_roads_agree

   !> The number of threads changes no bit of the result.
   subroutine same_bits_on_two_threads()
      type(record_type) :: one, two
      character(*), parameter :: text = '&grid nx = 96, ny = 81, lx = 1.2e-3, ly = 0.9e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.6e-3, '// &
         'wavelength_short = 0.1e-3, rms_height = 4e-6, seed = 3 /'//nl// &
         '&material shear_modulus = 0.5e6, prony_g = 1e6, 1e6, prony_tau = 0.02, 0.1 /'//nl// &
         '&phase pressure = 2e4, velocity_x = 10e-3, velocity_y = 5e-3, duration = 0.01, steps = 8 /'

      call set_threads(1)
      call run_case(text, 'one thread', one)
      call set_threads(2)
      call run_case(text, 'two threads', two)
      call set_threads(0)
      call check_same_rows(one, two, 0.0_dp, 'one and two threads')
      call check_close(maxval(abs(one%pressure - two%pressure)), 0.0_dp, 0.0_dp, 'pressure of two threads')
   end subroutine same_bits_on_two_threads

   !> Contacts of one to three cells are solved, although the first directions of a step are useless in them.
   subroutine contacts_of_few_cells()
      type(record_type) :: record

      call run_case( &
         '&grid nx = 64, ny = 1, lx = 0.009494, boundary = ''periodic'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 0.202563 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.006646, '// &
         'wavelength_short = 0.001151, rms_slope = 0.054349, seed = 73 /'//nl// &
         '&material shear_modulus = 1327430.215246, prony_g = 933765.253037, '// &
         '5499582.087455, prony_tau = 9.472567e-05, 0.003724 /'//nl// &
         '&phase pressure = 7131.637629, relaxed = F, velocity_x = 0.233306, duration = '// &
         '0.025434, steps = 20 /'//nl// &
         '&phase pressure = 1744.824596, duration = 0.003179, steps = 5, velocity_x = '// &
         '-0.233306 /'//nl// &
         '&solver threads = 1, tolerance = 0.0001, time_scheme = ''exponential'', '// &
         'interpolation = ''cubic'' /', &
         'few cells', record)
      call check_books(record, 'few cells')
      call run_case( &
         '&grid nx = 64, ny = 1, lx = 0.000317, boundary = ''periodic'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 0.003607 /'//nl// &
         '&material shear_modulus = 31947.349923, prony_g = 133334.289205, '// &
         '17404.709599, prony_tau = 0.032593, 0.003037 /'//nl// &
         '&phase pressure = 8.018665, relaxed = F, velocity_x = 0.001770, duration = '// &
         '0.020770, steps = 20 /'//nl// &
         '&phase pressure = 5.437121, duration = 0.014033, steps = 5, velocity_x = '// &
         '-0.001770 /'//nl// &
         '&solver threads = 1, tolerance = 1e-06, time_scheme = ''exponential2'', '// &
         'interpolation = ''cubic'' /', &
         'few cells', record)
      call check_books(record, 'few cells')
      call run_case( &
         '&grid nx = 1024, ny = 1, lx = 0.001126, boundary = ''periodic'' /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.000788, '// &
         'wavelength_short = 5.653182e-06, rms_slope = 0.469553, seed = 26 /'//nl// &
         '&material shear_modulus = 101867.036015, prony_g = 13565.950936, '// &
         '1798185.566612, 40911.932489, prony_tau = 0.002554, 0.006220, 4.933643e-05 /'//nl// &
         '&phase pressure = 582.894346, relaxed = T, velocity_x = 0.000174, duration = '// &
         '0.126304, steps = 20 /'//nl// &
         '&phase pressure = 453.212203, duration = 0.031576, steps = 5, velocity_x = '// &
         '-0.000174 /'//nl// &
         '&solver threads = 1, tolerance = 1e-08, time_scheme = ''exponential'', '// &
         'interpolation = ''linear'' /', &
         'few cells', record)
      call check_books(record, 'few cells')
   end subroutine contacts_of_few_cells

   !> The warning about small patches says when they are not those of its own row.
   subroutine small_patches_of_an_earlier_phase_are_reported()
      character(*), parameter :: loads(2) = ['1e1', '1e3']
      character(*), parameter :: expected(2) = [character(52) :: 'even the best resolved patches of contact at the end', &
         's: patches of contact are only']
      type(record_type) :: record
      integer :: k

      do k = 1, 2
         call run_case('&grid nx = 64, ny = 64, lx = 1e-3 /'//nl// &
            '&surface shape = ''self_affine'', hurst = 0.8, rms_slope = 0.1, wavelength_long = 0.5e-3 /'//nl// &
            '&material shear_modulus = 1e6 /'//nl//'&phase pressure = 1e3 /'//nl//'&phase pressure = '//loads(k)//' /', &
            'patches', record)
         call check_order(index(record%warnings, trim(expected(k))), '>', 0, 'patches: '//record%warnings)
      end do
   end subroutine small_patches_of_an_earlier_phase_are_reported

   !> A sphere that crosses a free map agrees with one in a periodic cell far larger than the contact.
   subroutine sphere_crosses_a_free_map()
      type(record_type) :: free, periodic
      real(dp) :: difference(2)
      character(*), parameter :: rest = &
         '&material shear_modulus = 0.1e6, prony_g = 0.9e6, prony_tau = 2e-3 /'//nl// &
         '&solver tolerance = 1e-8 /'//nl// &
         '&phase force = 2e-3, relaxed = .true., velocity_x = 20e-3, velocity_y = 6e-3, '// &
         'duration = 0.02, steps = 20 /'
      integer :: k

      call run_case('&grid nx = 70, ny = 50, lx = 1.4e-3, ly = 1.2e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 10e-3, centre_x = 0.5e-3, centre_y = 0.54e-3 /'//nl//rest, &
         'free map', free)
      call check_that(free%warnings == '', 'free map: no warning: '//free%warnings)
      do k = 1, 2
         call run_case('&grid nx = '//to_text(100*k)//', ny = '//to_text(84*k)//', lx = '// &
            exact_text(2e-3_dp*k)//', ly = '//exact_text(2.016e-3_dp*k)//' /'//nl// &
            '&surface shape = ''paraboloid'', radius = 10e-3, centre_x = '//exact_text(1e-3_dp*k)// &
            ', centre_y = '//exact_text(1.008e-3_dp*k)//' /'//nl//rest, 'large cell', periodic)
         difference(k) = maxval(abs(free%rows%friction - periodic%rows%friction))/maxval(free%rows%friction)
      end do
      call check_close(difference(2), 0.0_dp, 3e-3_dp, 'free map and large cell: friction')
      call check_order(difference(2), '<', difference(1)/4.0_dp, 'the effect of the images decreases as 1/L^3')
   end subroutine sphere_crosses_a_free_map

   !> Contact at the edge of a free map, and points that enter or leave near the contact, are reported once each.
   subroutine contact_at_the_edge_is_reported()
      type(record_type) :: record
      character(*), parameter :: body = '&material shear_modulus = 1e6 /'//nl// &
         '&grid nx = 40, ny = 36, lx = 0.4e-3, ly = 0.4e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 1e-3, centre_x = 0.25e-3 /'//nl
      integer :: first

      call run_case(body//'&phase displacement = 10e-6 /', 'inside', record)
      call check_that(record%warnings == '', 'contact inside a free map: '//record%warnings)
      call run_case(body//'&phase displacement = 60e-6 /', 'at the edge', record)
      call check_that(index(record%warnings, 'step 0, t = 0 s: ') == 1 .and. &
         index(record%warnings, ' cells at the edge of the free map touch') > 0, &
         'contact at the edge: '//record%warnings)
      call run_case(body//'&phase displacement = 5e-6, duration = 1, steps = 20, velocity_x = 0.2e-3 /', &
         'moved off the map', record)
      first = index(record%warnings, 'points enter or leave the free map')
      call check_that(first > 0 .and. index(record%warnings(first + 1:), 'points enter or leave') == 0, &
         'points that enter near the contact cause one warning: '//record%warnings)
      first = index(record%warnings, 'cells at the edge of the free map touch')
      call check_that(first > 0 .and. index(record%warnings(first + 1:), 'cells at the edge') == 0, &
         'a sphere that leaves the map causes one warning: '//record%warnings)
      ! A long map has a large rms height, which must not matter: the depth of the contact counts.
      call run_case('&material shear_modulus = 1e6 /'//nl// &
         '&grid nx = 80, ny = 30, lx = 0.8e-3, ly = 0.3e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 1e-3, centre_x = 0.1e-3 /'//nl// &
         '&phase displacement = 2e-6, duration = 1, steps = 25, velocity_x = 0.5e-3 /', 'long way', record)
      call check_that(index(record%warnings, 'free map') == 0, 'a long travel on a free map causes no warning: '//record%warnings)
      ! The edge is some ten micrometres lower: within five ranges of the first attraction, but not of the second.
      call run_case(body//'&phase displacement = 2e-6, duration = 1, steps = 2, velocity_x = 5e-6 /'//nl// &
         '&adhesion potential = ''exponential'', energy = 0.01, range = 3e-6 /', 'within reach', record)
      call check_order(index(record%warnings, 'points enter or leave the free map'), '>', 0, &
         'an edge within the range of adhesion causes a warning: '//record%warnings)
      call run_case(body//'&phase displacement = 2e-6, duration = 1, steps = 2, velocity_x = 5e-6 /'//nl// &
         '&adhesion potential = ''exponential'', energy = 0.01, range = 0.5e-6 /', 'out of reach', record)
      call check_that(index(record%warnings, 'free map') == 0, &
         'an edge beyond the range of adhesion causes no warning: '//record%warnings)
   end subroutine contact_at_the_edge_is_reported

end module test_simulation_sliding
