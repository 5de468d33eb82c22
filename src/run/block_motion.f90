!> The mean tangential motion of a block with mass: its state, the integration in time, and its energy.
!>
!> A prime marks the end of a step. The mean traction T of the interface deforms the block and accelerates its mass m
!> per area by the force f:
!>
!>    T' + T_h = Q U'/h + f',    f' = m ((1 - alpha) a' + alpha a)
!>    v' = v + dt ((1 - gamma) a + gamma a')
!>    x' = x + dt v + dt^2 ((1/2 - beta) a + beta a'),    x' - x = U' - U - (D' - D)
!>
!> with the traction T_h of the past, the height h and the step's modulus Q of the block, and x, v, a
!> the motion of the interface over the road (the top of the block moves by -(D' - D)). With gamma = 1/2
!> - alpha and beta = (1 - alpha)^2/4 this is the rule of Wood, Bossak and Zienkiewicz (Int. J. Numer.
!> Methods Eng. 15 (1980) 1562). It is of second order and stable for any step. Oscillations that are far faster
!> than the steps decay by the factor `decay` = (1 + alpha)/(1 - alpha) per step. With the trapezoidal rule
!> (alpha = 0) they would never decay once the block sticks.
!>
!> A state after an infinite time is one of rest: no inertia acts, and the kinetic energy is lost.
!>
!> a does not follow a jump of the acceleration at once. The first step after a jump of the load or of the speed
!> therefore assumes a = a' (uniform acceleration). The error of this one step is of second order.
!>
!> Energy: with the mean force f = m (v' - v)/dt of a step,
!>
!>    f (x' - x) - m (alpha dt)^2 (a'^2 - a^2)/8 = m (v'^2 - v^2)/2 - alpha^3 m dt^2 (a' - a)^2/4
!>
!> exactly. The left side is booked as work on the mass. Its second term is the change of a function of the state,
!> so that it cancels over many steps. The last term, which is never negative, is the loss of the rule.
module block_motion
   use asperity_precision, only : dp
   implicit none
   private

   public :: block_motion_type

   real(dp), parameter :: decay = 0.5_dp                 !! decay factor, see above
   real(dp), parameter :: alpha = (decay - 1.0_dp)/(decay + 1.0_dp)
   real(dp), parameter :: beta = (1.0_dp - alpha)**2/4.0_dp, gamma = 0.5_dp - alpha

   !> The state of the mean motion, and the inertia of the last step.
   type :: block_motion_type
      real(dp) :: height = 0.0_dp              !! h, m
      real(dp) :: mass = 0.0_dp                !! m, kg/m2; 0: no inertia
      real(dp) :: area = 0.0_dp                !! of the cell lx by ly, m2
      logical :: at_rest = .false.             !! the present step leads to the state after an infinite time
      logical :: fresh = .true.                !! a does not count in the next step
      real(dp) :: speed(2) = 0.0_dp            !! v, m/s
      real(dp) :: acceleration(2) = 0.0_dp     !! a, m/s2
      real(dp) :: work = 0.0_dp                !! done on the mass, J
      real(dp) :: lost = 0.0_dp                !! by the rule, J
      real(dp) :: inertia(2) = 0.0_dp          !! mean force on the mass in the last step, N
   contains
      procedure :: has_inertia
      procedure :: inertia_acts
      procedure :: resistance
      procedure :: known_force
      procedure :: respond
      procedure :: finish
      procedure :: come_to_rest
      procedure :: kinetic
   end type block_motion_type

contains

   !> Does a mass count in the present step?
   pure logical function has_inertia(self)
      class(block_motion_type), intent(in) :: self

      has_inertia = self%mass > 0.0_dp .and. .not. self%at_rest
   end function has_inertia

   !> Does the inertia of the block affect a step of length dt? There must be a mass, and dt must be positive.
   pure function inertia_acts(self, dt) result(yes)
      class(block_motion_type), intent(in) :: self
      real(dp), intent(in) :: dt               !! s
      logical :: yes

      yes = self%has_inertia() .and. dt > 0.0_dp
   end function inertia_acts

   !> The contribution of the mass to the modulus Q of the mean: f' = resistance U'/h - known_force, Pa.
   pure function resistance(self, dt) result(modulus)
      class(block_motion_type), intent(in) :: self
      real(dp), intent(in) :: dt               !! s, > 0
      real(dp) :: modulus

      modulus = self%height*self%mass*acceleration_factor(self)/dt**2
   end function resistance

   !> Factor c of f' = m c (x' - x)/dt^2 + (known part): (1 - alpha)/beta, or 2 for uniform acceleration.
   pure function acceleration_factor(self) result(factor)
      class(block_motion_type), intent(in) :: self
      real(dp) :: factor

      factor = merge(2.0_dp, (1.0_dp - alpha)/beta, self%fresh)
   end function acceleration_factor

   !> The part of f' that is known before the step, Pa: see `resistance`.
   pure function known_force(self, displacement, motion, dt) result(traction)
      class(block_motion_type), intent(in) :: self
      real(dp), intent(in) :: displacement(2)  !! U, m
      real(dp), intent(in) :: motion(2)        !! D' - D, m
      real(dp), intent(in) :: dt               !! s, > 0
      real(dp) :: traction(2)

      traction = self%mass*acceleration_factor(self)*((displacement + motion)/dt**2 + self%speed/dt)
      if (.not. self%fresh) traction = traction &
         + self%mass*(acceleration_factor(self)*(0.5_dp - beta) - alpha)*self%acceleration
   end function known_force

   !> Describe how the mean displacement of the surface responds to the mean traction of a step: as that of a block
   !> without mass, whose height is `height` and which the road moves by `shift`/Q. A mass makes the block stiffer,
   !> like one of less height, and the known part of its motion adds to that of the road. In an instantaneous step a
   !> mass cannot move, so that the mean displacement of the surface stays.
   pure subroutine respond(self, q, displacement, motion, dt, height, shift)
      class(block_motion_type), intent(in) :: self
      real(dp), intent(in) :: q                !! Q of the step
      real(dp), intent(in) :: displacement(2)  !! mean of U, m; counts with a mass only
      real(dp), intent(in) :: motion(2)        !! D' - D, m
      real(dp), intent(in) :: dt               !! s; 0: instantaneous
      real(dp), intent(out) :: height          !! m
      real(dp), intent(out) :: shift(2)        !! m

      height = self%height
      shift = q*motion
      if (self%inertia_acts(dt)) then
         height = q*height/(q + self%resistance(dt))
         shift = shift - height*self%known_force(displacement, motion, dt)
      else if (self%has_inertia()) then
         height = 0.0_dp
         shift = shift - q*displacement
      end if
   end subroutine respond

   !> End a step: the motion, and the energies.
   pure subroutine finish(self, advance, carried, dt)
      class(block_motion_type), intent(inout) :: self
      real(dp), intent(in) :: advance(2)       !! x' - x, m
      real(dp), intent(in) :: carried(2)       !! f' from the fields: mean traction minus the part that strains the block, Pa
      real(dp), intent(in) :: dt               !! s; 0: a jump
      real(dp) :: before(2), after(2), speed(2), force(2), a(2)

      self%inertia = 0.0_dp
      if (.not. self%inertia_acts(dt)) then
         self%fresh = .true.
         return
      end if
      if (self%fresh) then
         after = 2.0_dp*(advance/dt - self%speed)/dt
         before = after
         force = carried
      else
         before = self%acceleration
         after = ((advance/dt - self%speed)/dt - (0.5_dp - beta)*before)/beta
         a = (carried/self%mass - alpha*before)/(1.0_dp - alpha)      ! a' from the tractions
         force = self%mass*((1.0_dp - gamma)*before + gamma*a)
      end if
      speed = self%speed + dt*((1.0_dp - gamma)*before + gamma*after)
      self%work = self%work + self%area*(dot_product(force, advance) &
         - self%mass*(alpha*dt)**2/8.0_dp*sum(after**2 - before**2))
      self%lost = self%lost - self%area*alpha**3/4.0_dp*self%mass*dt**2*sum((after - before)**2)
      self%inertia = self%area*self%mass*(speed - self%speed)/dt
      self%speed = speed
      self%acceleration = after
      self%fresh = .false.
   end subroutine finish

   !> End a step that leads to the state after an infinite time.
   pure subroutine come_to_rest(self, energy)
      class(block_motion_type), intent(inout) :: self
      real(dp), intent(out) :: energy          !! kinetic energy that the block had, J

      energy = self%kinetic()
      self%work = self%work - energy
      self%inertia = 0.0_dp
      self%speed = 0.0_dp
      self%acceleration = 0.0_dp
      self%fresh = .true.
   end subroutine come_to_rest

   !> Kinetic energy, J.
   pure function kinetic(self) result(energy)
      class(block_motion_type), intent(in) :: self
      real(dp) :: energy

      energy = 0.5_dp*self%mass*sum(self%speed**2)*self%area
   end function kinetic

end module block_motion
