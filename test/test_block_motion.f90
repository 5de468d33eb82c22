!> Tests of the motion of a block with mass: the integration rule alone, and a flat block on a flat road in a
!> run. The mean motion of this block is exactly that of one mass on a spring with arms, held by Coulomb
!> friction.
module test_block_motion
   use block_motion, only : block_motion_type
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use asperity_simulation, only : new_simulation, simulation_type
   use simulation_runs, only : check_books, last, nl, record_type, run_case
   use text_tools, only : exact_text, to_text
   implicit none
   private

   public :: run_block_motion

   real(dp), parameter :: height = 1e-3_dp, density = 2000.0_dp, mass = 0.5_dp*height*density
   real(dp), parameter :: g_e = 1e6_dp, g(2) = [0.3e6_dp, 0.2e6_dp]
   real(dp), parameter :: period = 2.0_dp*pi*height*3.1622776601683794e-2_dp   !! period of the mass on g_e, s
   real(dp), parameter :: tau(2) = [0.05_dp, 0.5_dp]*period
   real(dp), parameter :: speed = 0.3_dp                    !! of the road, m/s
   !> Friction in three phases of four periods: the block is dragged along, slips, springs back, and sticks
   !> again.
   real(dp), parameter :: friction(3) = [4e4_dp, 1.2e4_dp, 3e4_dp]   !! Pa
   real(dp), parameter :: length = 4.0_dp*period            !! of a phase, s

   !> Exact motion: U, v and the tractions of the arms.
   type :: motion_type
      real(dp) :: y(4) = 0.0_dp
      logical :: sticks = .true.
      real(dp) :: sign = 1.0_dp                             !! of the friction in slip
   end type motion_type

contains

   subroutine run_block_motion()
      call begin_suite('block_motion')
      if (selected('rule_of_motion_is_second_order')) call rule_of_motion_is_second_order()
      if (selected('held_block_comes_to_rest')) call held_block_comes_to_rest()
      if (selected('motion_of_a_block_is_second_order')) call motion_of_a_block_is_second_order()
      if (selected('books_of_a_flat_block_close')) call books_of_a_flat_block_close()
      if (selected('block_rests_after_an_infinite_time')) call block_rests_after_an_infinite_time()
   end subroutine run_block_motion

   !> The rule under a given force m a(t), a = cos(w t): it is of second order for steps of two lengths, and
   !> the work equals kinetic energy plus loss exactly.
   subroutine rule_of_motion_is_second_order()
      type(block_motion_type) :: block
      real(dp) :: errors(3), t, dt, advance, known(2), force
      integer :: i, k, n

      do k = 1, 3
         block = block_motion_type(height=1.0_dp, mass=2.0_dp, area=3.0_dp)
         n = 20*2**k
         t = 0.0_dp
         do i = 1, n
            dt = merge(2.0_dp, 1.0_dp, i > n/2)*4.0_dp/(1.5_dp*n)
            t = t + dt
            force = 2.0_dp*cos(t)
            known = block%known_force([0.0_dp, 0.0_dp], [0.0_dp, 0.0_dp], dt)
            ! f' = resistance x'/h - known
            advance = (force + known(1))/block%resistance(dt)
            call block%finish([advance, 0.0_dp], [force, 0.0_dp], dt)
            call check_close(block%work, block%kinetic() + block%lost, 1e-12_dp, 'rule: energy')
         end do
         errors(k) = abs(block%speed(1) - sin(t))
      end do
      call check_that(errors(2) < errors(1)/3.5_dp .and. errors(3) < errors(2)/3.5_dp, 'rule: second order '// &
         to_text(errors(1))//', '//to_text(errors(2))//', '//to_text(errors(3)), errors)
   end subroutine rule_of_motion_is_second_order

   !> A block that is held comes to rest: each step halves the remaining speed and force.
   subroutine held_block_comes_to_rest()
      type(block_motion_type) :: block
      real(dp) :: known(2), force
      integer :: i

      block = block_motion_type(height=1.0_dp, mass=2.0_dp, area=3.0_dp, fresh=.false.)
      block%speed(1) = 1.0_dp
      do i = 1, 30
         known = block%known_force([0.0_dp, 0.0_dp], [0.0_dp, 0.0_dp], 0.1_dp)
         force = -known(1)
         call block%finish([0.0_dp, 0.0_dp], [force, 0.0_dp], 0.1_dp)
         call check_order(abs(block%speed(1)), '<=', 4.0_dp*i*0.5_dp**i, 'stuck: step '//to_text(i))
      end do
      call check_close(force, 0.0_dp, 1e-5_dp, 'stuck: no force is left')
      call check_order(block%lost, '>=', 0.0_dp, 'stuck: the loss is positive')
   end subroutine held_block_comes_to_rest

   !> Stick, slip, a fall and a rise of the load: displacement and speed are of second order, rms over all
   !> rows.
   subroutine motion_of_a_block_is_second_order()
      integer, parameter :: steps(3) = [40, 80, 160]        !! per period
      real(dp) :: error_u(3), error_v(3), lost, viscous
      integer :: k

      do k = 1, 3
         call compare(steps(k), error_u(k), error_v(k), lost, viscous)
         if (steps(k) == 40) call check_close(lost/viscous, 0.0_dp, 0.02_dp, &
            'numerical over viscous loss at 40 steps per period')
      end do
      call check_that(error_u(2) < error_u(1)/2.5_dp .and. error_u(3) < error_u(1)/10.0_dp, &
         'displacement: '//to_text(error_u(1))//', '//to_text(error_u(2))//', '//to_text(error_u(3)), &
         error_u)
      call check_that(error_v(2) < error_v(1)/2.5_dp .and. error_v(3) < error_v(1)/10.0_dp, &
         'speed: '//to_text(error_v(1))//', '//to_text(error_v(2))//', '//to_text(error_v(3)), &
         error_v)
      call check_close(error_v(1), 0.0_dp, 0.02_dp, 'speed at 40 steps per period')
      call check_close(error_v(3), 0.0_dp, 2e-3_dp, 'speed at 160 steps per period')
   end subroutine motion_of_a_block_is_second_order

   !> Run the flat block and the exact one; return rms errors relative to the largest values.
   subroutine compare(steps, error_u, error_v, lost, viscous)
      integer, intent(in) :: steps
      real(dp), intent(out) :: error_u, error_v, lost, viscous
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      type(motion_type) :: exact
      real(dp) :: sums(4), before
      integer :: n

      sums = 0.0_dp
      n = 0
      call parse_case(flat(steps), 'flat.nml', case, error)
      call check_no_error(error, 'flat block')
      call new_simulation(sim, case, error)
      call check_no_error(error, 'flat block')
      if (allocated(error)) return
      do while (.not. sim%finished)
         before = sim%state%row%time
         call sim%advance(error)
         if (allocated(error) .or. .not. sim%converged) exit
         if (sim%state%row%time - before < 0.1_dp*period/steps) cycle          ! a jump
         call move(exact, before, sim%state%row%time - before)
         sums = sums + [(sim%state%tangential%displacement(1, 1, 1) - exact%y(1))**2, &
            (sim%state%tangential%block%speed(1) - exact%y(2))**2, exact%y(1)**2, exact%y(2)**2]
         n = n + 1
      end do
      call check_no_error(error, 'flat block')
      call check_that(sim%converged .and. n == 12*steps, 'flat block: all rows')
      error_u = sqrt(sums(1)/sums(3))
      error_v = sqrt(sums(2)/sums(4))
      lost = sim%state%row%dissipated_numerical
      viscous = sim%state%row%dissipated_viscous
      call sim%destroy()
   end subroutine compare

   !> The exact motion over a time within one phase, by Runge-Kutta in short steps. Changes between stick and
   !> slip are found by bisection.
   subroutine move(self, start, time)
      type(motion_type), intent(inout) :: self
      real(dp), intent(in) :: start, time
      integer, parameter :: pieces = 64
      type(motion_type) :: trial
      real(dp) :: bound, done, dt, low, high
      integer :: i

      bound = friction(min(3, 1 + int((start + 0.5_dp*time)/length)))
      done = 0.0_dp
      do while (done < time*(1.0_dp - 1e-12_dp))
         if (self%sticks .and. abs(stress(self)) > bound) then
            self%sticks = .false.
            self%sign = sign(1.0_dp, stress(self))
         end if
         dt = min(time/pieces, time - done)
         trial = step(self, bound, dt)
         if (turns(self, trial, bound)) then
            low = 0.0_dp
            high = dt
            do i = 1, 60
               dt = 0.5_dp*(low + high)
               trial = step(self, bound, dt)
               if (turns(self, trial, bound)) then
                  high = dt
               else
                  low = dt
               end if
            end do
            trial = step(self, bound, high)
            if (self%sticks) then
               trial%sticks = .false.
               trial%sign = sign(1.0_dp, stress(trial))
            else
               trial%y(2) = 0.0_dp
               trial%sticks = abs(stress(trial)) <= bound
               if (.not. trial%sticks) trial%sign = sign(1.0_dp, stress(trial))
            end if
            dt = high
         end if
         self = trial
         done = done + dt
      end do
   end subroutine move

   !> Does stick end, or does slip stop?
   pure function turns(before, after, bound) result(yes)
      type(motion_type), intent(in) :: before, after
      real(dp), intent(in) :: bound
      logical :: yes

      if (before%sticks) then
         yes = abs(stress(after)) > bound
      else
         ! The slip of the road over the rubber has the sign of the friction; v has the opposite sign.
         yes = after%y(2)*before%sign > 0.0_dp
      end if
   end function turns

   !> Traction that deforms the block, Pa.
   pure function stress(self) result(traction)
      type(motion_type), intent(in) :: self
      real(dp) :: traction

      traction = g_e*self%y(1)/height + sum(self%y(3:))
   end function stress

   !> One step of Runge and Kutta.
   pure function step(self, bound, dt) result(next)
      type(motion_type), intent(in) :: self
      real(dp), intent(in) :: bound, dt
      type(motion_type) :: next
      real(dp) :: k1(4), k2(4), k3(4), k4(4)

      k1 = rate(self%y)
      k2 = rate(self%y + 0.5_dp*dt*k1)
      k3 = rate(self%y + 0.5_dp*dt*k2)
      k4 = rate(self%y + dt*k3)
      next = self
      next%y = self%y + dt/6.0_dp*(k1 + 2.0_dp*k2 + 2.0_dp*k3 + k4)

   contains

      !> Rates of U, v and the arms.
      pure function rate(y) result(rates)
         real(dp), intent(in) :: y(4)
         real(dp) :: rates(4), u_rate

         u_rate = y(2) + speed                              ! v is the speed relative to the road
         rates(1) = u_rate
         rates(2) = 0.0_dp
         if (.not. self%sticks) rates(2) = (self%sign*bound - g_e*y(1)/height - sum(y(3:)))/mass
         rates(3:) = g*u_rate/height - y(3:)/tau
      end function rate

   end function step

   !> Both energy balances of the flat block: that of the fields closes to round-off, the work of the drive to
   !> the error of the steps.
   subroutine books_of_a_flat_block_close()
      type(record_type) :: record
      real(dp) :: missing(2)
      integer :: k

      do k = 1, 2
         call run_case(flat(40*k), 'flat block', record)
         call check_books(record, 'flat block', 1e-9_dp)
         missing(k) = maxval(abs(record%rows%work_missing))/maxval(record%rows%work_drive)
      end do
      call check_order(maxval(record%rows%energy_kinetic), '>', 0.05_dp*maxval(record%rows%energy_elastic), &
         'the block oscillates')
      call check_close(missing(2), 0.0_dp, 0.01_dp, 'flat block: missing work')
   end subroutine books_of_a_flat_block_close

   !> A block that slides has come to rest after an infinite time: its arms carry nothing, and nothing changes in the time
   !> after that.
   subroutine block_rests_after_an_infinite_time()
      character(*), parameter :: resting(2) = [character(16) :: 'relaxed = .true.', 'steady = .true.']
      type(record_type) :: record
      integer :: k, n

      do k = 1, 2
         call run_case('&grid nx = 4, ny = 2, lx = 2e-3 /'//nl//'&surface shape = ''flat'' /'//nl//solid()//nl// &
            '&friction law = ''coulomb'', coefficient = 0.3 /'//nl//'&solver tolerance = 1e-10 /'//nl// &
            '&phase pressure = 1e5, duration = 4e-4, steps = 20, velocity_x = 0.3 /'//nl// &
            '&phase duration = 1e-3, steps = 5, '//trim(resting(k))//' /', resting(k), record)
         n = last(record)
         associate (before => record%rows(n - 6), rest => record%rows(n - 5:))
            call check_order(abs(before%sliding_speed), '>', 0.01_dp, 'the block moved')
            call check_order(rest(1)%friction, '>', 0.01_dp, 'rest: friction')
            call check_close(maxval(abs(rest%friction - rest(1)%friction)), 0.0_dp, 1e-8_dp, 'rest: nothing changes')
            call check_close(maxval(abs(rest%sliding_speed)), 0.0_dp, 1e-8_dp, 'rest: speed')
            call check_close(maxval(rest%energy_kinetic), 0.0_dp, 1e-12_dp*before%energy_elastic, 'rest: energy')
         end associate
         call check_books(record, 'rest', 1e-9_dp)
      end do
   end subroutine block_rests_after_an_infinite_time

   !> The case. The pressure is such that the friction is that of the phase for a coefficient of 0.5.
   function flat(steps) result(text)
      integer, intent(in) :: steps                          !! per period
      character(:), allocatable :: text
      integer :: i

      text = '&grid nx = 4, ny = 2, lx = 2e-3 /'//nl//'&surface shape = ''flat'' /'//nl//solid()//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl//'&solver tolerance = 1e-10, passes = 4 /'//nl
      do i = 1, 3
         text = text//'&phase pressure = '//exact_text(2.0_dp*friction(i))//', velocity_x = 0.3, duration = '// &
            exact_text(length)//', steps = '//to_text(4*steps)//' /'//nl
      end do
   end function flat

   !> The material.
   function solid() result(text)
      character(:), allocatable :: text

      text = '&material shear_modulus = 1e6, prony_g = 0.3e6, 0.2e6, prony_tau = '//exact_text(tau(1))//', '// &
         exact_text(tau(2))//', thickness = 1e-3, density = 2000 /'
   end function solid

end module test_block_motion
