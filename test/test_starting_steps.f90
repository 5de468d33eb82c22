!> Tests of the first step after a kink of the load. A flat punch has a contact that never changes, so that the approach
!> is exactly the creep of the material times an elastic constant of the mesh.
module test_starting_steps
   use case_settings, only : phase_settings_type
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_precision, only : dp
   use prony, only : retardation_spectrum
   use asperity_schedule, only : next_row, planned_row_type, schedule_type
   use simulation_runs, only : check_books, last, nl, record_type, run_case, write_map
   use starting_steps, only : split_start
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_starting_steps

   character(*), parameter :: map = 'build/test_punch.h5'

contains

   subroutine run_starting_steps()
      call begin_suite('starting_steps')
      if (selected('parts_lie_on_the_line_of_the_step')) call parts_lie_on_the_line_of_the_step()
      if (selected('steps_that_begin_with_another_rate')) call steps_that_begin_with_another_rate()
      if (selected('error_after_a_kink')) call error_after_a_kink()
   end subroutine run_starting_steps

   !> The load, road and time of the parts are on the straight line of the step, and end where the step ends.
   subroutine parts_lie_on_the_line_of_the_step()
      type(planned_row_type) :: plan
      type(planned_row_type), allocatable :: parts(:)

      plan%time = 5.0_dp
      plan%dt = 2.0_dp
      plan%load_before = 10.0_dp
      plan%load = 18.0_dp
      plan%road(1) = 4.0_dp
      plan%road(2) = -4.0_dp
      plan%new_speed = .true.
      call split_start(plan, .false., .true., [0.0_dp, 0.0_dp], parts)
      call check_that(size(parts) == 1, 'a step without a kink is not split')
      call split_start(plan, .true., .false., [0.0_dp, 0.0_dp], parts)
      call check_that(size(parts) == 1, 'a scheme that does not extrapolate does not split its steps')
      call split_start(plan, .true., .true., [0.0_dp, 4.0_dp], parts)
      call check_that(size(parts) == 3, 'a step after a kink has three parts')
      if (size(parts) /= 3) return
      call check_close(sum(parts%dt), 2.0_dp, 1e-15_dp, 'the parts fill the step')
      call check_close(parts(1)%time, 3.5_dp, 1e-15_dp, 'end of the first part')
      call check_close(parts(2)%load, 14.0_dp, 1e-14_dp, 'load in the middle')
      call check_close(parts(1)%road(1), 1.0_dp, 1e-15_dp, 'road after the first part')
      call check_close(parts(2)%road(2), 0.0_dp, 1e-15_dp, 'road in the middle')
      call check_close(parts(3)%load, 18.0_dp, 0.0_dp, 'load at the end')
      call check_that(parts(1)%new_speed .and. .not. any(parts(2:)%new_speed), 'only the first part has a new speed')
      plan%instantaneous = .true.
      call split_start(plan, .true., .true., [0.0_dp, 0.0_dp], parts)
      call check_that(size(parts) == 1, 'a jump is not split')
   end subroutine parts_lie_on_the_line_of_the_step

   !> The schedule marks the steps whose rate of the load is new; a ramp that continues over two phases has none.
   subroutine steps_that_begin_with_another_rate()
      type(phase_settings_type) :: phases(5)
      type(schedule_type) :: schedule
      type(planned_row_type) :: row
      logical :: expected(10), finished
      integer :: k

      phases%control = 'pressure'
      phases%duration = 1.0_dp
      phases%dt = 0.5_dp
      phases%steps = 2
      phases%static = .false.
      phases%relaxed = .false.
      phases%steady = .false.
      phases%velocity_x = 0.0_dp
      do k = 1, size(phases)
         phases(k)%pulled = .false.
         phases(k)%pull = 0.0_dp
      end do
      phases%velocity_y = 0.0_dp
      phases%linear = [.true., .true., .true., .false., .true.]
      phases%target = [1.0_dp, 2.0_dp, 1.5_dp, 1.5_dp, 1.5_dp]
      expected = .false.
      expected([1, 5, 7]) = .true.
      call next_row(schedule, phases, [0.0_dp, 0.0_dp, 0.0_dp], [0.0_dp, 0.0_dp], row, finished)
      call check_that(row%instantaneous, 'the first row is a jump')
      do k = 1, 10
         call next_row(schedule, phases, [0.0_dp, 0.0_dp, 0.0_dp], [0.0_dp, 0.0_dp], row, finished)
         call check_that(row%new_rate .eqv. expected(k), 'new rate in step '//to_text(k))
      end do
      call check_that(finished .or. schedule%phase > 5, 'all rows are done')
   end subroutine steps_that_begin_with_another_rate

   !> The load grows, decreases more slowly, and rests, with 1, 3 and 5 arms. The error is that of the worst row after the
   !> first kink, relative to the largest approach, in coarse and in fine steps.
   subroutine error_after_a_kink()
      integer, parameter :: arms(3) = [1, 3, 5]
      integer, parameter :: steps(3) = [8, 16, 32]
      !> Largest errors that are allowed in coarse steps. A scheme that continued with the curvature from before the kink had
      !> errors of 2.0e-3, 3.2e-3 and 3.6e-3 with 8 steps; a plain restart had 3.5e-4, 2.2e-3 and 1.7e-3.
      real(dp), parameter :: allowed(3) = [1.0e-4_dp, 4.0e-4_dp, 4.0e-4_dp]
      real(dp) :: errors(3)
      integer :: k, m

      call write_punch()
      do m = 1, size(arms)
         do k = 1, size(steps)
            errors(k) = worst(arms(m), steps(k))
         end do
         call check_close(errors(1), 0.0_dp, allowed(m), to_text(arms(m))//' arms, 8 steps a ramp')
         call check_order(errors(3), '<', errors(1)/4.0_dp, to_text(arms(m))//' arms: the error decreases with the step: '// &
            to_text(errors(1))//', '//to_text(errors(2))//', '//to_text(errors(3)))
      end do

   contains

      !> Return the worst error of a run with the given numbers of arms and of steps per ramp.
      function worst(n, steps) result(error)
         integer, intent(in) :: n, steps
         real(dp) :: error
         real(dp), parameter :: g_e = 0.1e6_dp, g = 1e6_dp
         real(dp) :: tau(n), constant, t
         character(:), allocatable :: series
         type(record_type) :: record
         integer :: i

         if (n == 1) tau = 0.3_dp
         if (n == 3) tau = [0.01_dp, 0.1_dp, 1.0_dp]
         if (n == 5) tau = [1e-3_dp, 1e-2_dp, 0.1_dp, 1.0_dp, 10.0_dp]
         series = 'prony_g = '//to_text(n)//'*1e6, prony_tau = '//exact_text(tau(1))
         do i = 2, n
            series = series//', '//exact_text(tau(i))
         end do
         call run_case(punch()//'&material shear_modulus = 0.1e6, '//series//' /'//nl// &
            phase(1.0_dp, steps)//phase(0.3_dp, steps)// &
            '&phase force = 0.3, duration = 1, steps = '//to_text(steps)//' /'//nl, 'kinks', record)
         call check_books(record, 'kinks', 1e-6_dp)
         error = 0.0_dp
         associate (rows => record%rows)
            ! The constant of the mesh: the elastic approach of a punch is linear in the load.
            constant = elastic_constant()
            do i = steps + 1, last(record)
               t = rows(i)%time
               error = max(error, abs(rows(i)%displacement - constant*creep(g_e, spread(g, 1, n), tau, t)))
            end do
            error = error/maxval(rows%displacement)
         end associate
      end function worst

      !> Return a phase with a ramp to a force in one second.
      function phase(force, steps) result(text)
         real(dp), intent(in) :: force
         integer, intent(in) :: steps
         character(:), allocatable :: text

         text = '&phase force = '//exact_text(force)//', duration = 1, ramp = ''linear'', steps = '// &
            to_text(steps)//' /'//nl
      end function phase

      !> Return the approach of an elastic punch, times its modulus over its force.
      function elastic_constant() result(constant)
         real(dp) :: constant
         type(record_type) :: record

         call run_case(punch()//'&material shear_modulus = 1e6 /'//nl//'&phase force = 1 /', 'punch', record)
         constant = 1e6_dp*record%rows(0)%displacement
      end function elastic_constant

   end subroutine error_after_a_kink

   !> Return the integral of J(t - s) dF(s), where J is the creep compliance, for a force that grows by 1/s for a second,
   !> decreases by 0.7/s for a second, and rests.
   function creep(g_e, g, tau, t) result(u)
      real(dp), intent(in) :: g_e, g(:), tau(:)
      real(dp), intent(in) :: t
      real(dp) :: u
      real(dp), allocatable :: strength(:), times(:)
      real(dp) :: fluidity

      call retardation_spectrum(g_e, g, tau, times, strength, fluidity)
      u = ramp(t) - 1.7_dp*ramp(t - 1.0_dp) + 0.7_dp*ramp(t - 2.0_dp)

   contains

      !> Return the integral of J from 0 to s.
      real(dp) function ramp(s)
         real(dp), intent(in) :: s

         ramp = 0.0_dp
         if (s > 0.0_dp) ramp = s/(g_e + sum(g)) &
            + sum(strength*(s - times*(1.0_dp - exp(-s/times))))
      end function ramp

   end function creep

   !> Write a map with a flat disc.
   subroutine write_punch()
      real(dp) :: height(24, 24)
      integer :: i, j

      do j = 1, 24
         do i = 1, 24
            height(i, j) = merge(0.0_dp, -1e-2_dp, hypot(i - 12.5_dp, j - 12.5_dp) < 7.0_dp)
         end do
      end do
      call write_map(map, height)
   end subroutine write_punch

   !> Return the groups for grid, surface and tolerance.
   function punch() result(text)
      character(:), allocatable :: text

      text = '&grid nx = 24, ny = 24, lx = 24e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''file'', file = '''//map//''' /'//nl//'&solver tolerance = 1e-10 /'//nl
   end function punch

end module test_starting_steps
