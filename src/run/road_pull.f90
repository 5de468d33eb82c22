!> A road that is pulled by a force, in one step: it prepares the tangential solver, and computes the motion of
!> the road from the solution.
!>
!> The pull F is a force per area of the periodic cell, Pa. Without a mass the mean of the frictional traction T
!> equals F minus the part of the force that acts on the slopes of the road in addition to T. The solver (module
!> `friction_pull`) finds the offset Q (D' - D) for which this holds.
!>
!> With a mass the rubber carries F from its top to the mass, and T brakes the mass. The means obey
!>
!>    U' = h (F + T_h)/Q,   T - F = f' = R (U' - (D' - D))/h - k
!>
!> with the height h of the block, the traction T_h of the past, the force f' on the mass, its resistance R and
!> the part k of this force that is known before the step (module `block_motion`). This gives
!> Q (D' - D) - Q U' = -Q h/R (k + T - F). For the solver this is a spring, and its operator needs no mean
!> mode. In an instantaneous step the mass does not move.
module road_pull
   use asperity_precision, only : dp
   use block_motion, only : block_motion_type
   use friction_pull, only : friction_pull_type
   implicit none
   private

   public :: road_pull_type

   !> The pull of the present step, and the motion of the road that the last solve has found.
   type :: road_pull_type
      real(dp) :: motion(2) = 0.0_dp                  !! D' - D by the last solve; before it, the guess, m
      logical :: slides_off = .false.                 !! the pull is more than the friction can hold
      real(dp) :: held(2) = 0.0_dp                    !! the most that the friction can hold, Pa; see `slides_off`
      real(dp), private :: force(2) = 0.0_dp          !! F, Pa
      real(dp), private :: q = 0.0_dp                 !! Q of the step
      real(dp), private :: mass_offset(2) = 0.0_dp    !! offset at which T of a pulled mass equals F
      real(dp), private :: mass_compliance = 0.0_dp   !! compliance of this offset to T - F
   contains
      procedure :: begin
      procedure :: place_mass
      procedure :: set_pull
      procedure :: find_motion
      procedure :: find_held
   end type road_pull_type

contains

   !> Begin a step.
   pure subroutine begin(self, force, motion, q)
      class(road_pull_type), intent(inout) :: self
      real(dp), intent(in) :: force(2)                !! F, Pa
      real(dp), intent(in) :: motion(2)               !! D' - D, m; a guess where the road is pulled
      real(dp), intent(in) :: q                       !! Q of the step

      self%force = force
      self%motion = motion
      self%q = q
      self%slides_off = .false.
   end subroutine begin

   !> Compute the spring by which the solver represents a pulled mass.
   pure subroutine place_mass(self, block, displacement, dt)
      class(road_pull_type), intent(inout) :: self
      type(block_motion_type), intent(in) :: block
      real(dp), intent(in) :: displacement(2)         !! mean of U at the start of the step, m
      real(dp), intent(in) :: dt                      !! s; 0: instantaneous

      if (block%inertia_acts(dt)) then
         self%mass_compliance = self%q*block%height/block%resistance(dt)
         self%mass_offset = -self%mass_compliance*block%known_force(displacement, [0.0_dp, 0.0_dp], dt)
      else
         self%mass_compliance = tiny(1.0_dp)
         self%mass_offset = -self%q*displacement
      end if
   end subroutine place_mass

   !> Set the mean of T that the solver must reach, and the offset from which it starts.
   pure subroutine set_pull(self, pull, block, beside)
      class(road_pull_type), intent(in) :: self
      type(friction_pull_type), intent(inout) :: pull !! of the solver; `along` is set
      type(block_motion_type), intent(in) :: block
      real(dp), intent(in) :: beside(2)               !! mean force on the slopes of the road that is not in T, Pa

      pull%traction = self%force - beside
      if (block%mass > 0.0_dp) then
         pull%offset = self%mass_offset
         pull%mass_compliance = self%mass_compliance
      else
         pull%offset = self%q*self%motion
         pull%mass_compliance = 0.0_dp
      end if
   end subroutine set_pull

   !> Compute the motion of the road from the offset that the solver has found.
   pure subroutine find_motion(self, pull, block, past)
      class(road_pull_type), intent(inout) :: self
      type(friction_pull_type), intent(inout) :: pull !! of the solver, after a solve
      type(block_motion_type), intent(in) :: block
      real(dp), intent(in) :: past(2)                 !! mean of T_h, Pa

      if (block%mass > 0.0_dp) pull%offset = pull%offset + block%height*(pull%traction + past)
      where (pull%along) self%motion = pull%offset/self%q
      self%slides_off = pull%slides_off
   end subroutine find_motion

   !> Compute the largest pull that the friction can hold, if the solver has found that the pull exceeds it.
   pure subroutine find_held(self, pull, traction)
      class(road_pull_type), intent(inout) :: self
      type(friction_pull_type), intent(in) :: pull    !! of the solver, after a solve
      real(dp), intent(in) :: traction(2)             !! mean of T, Pa

      self%held = merge(traction + self%force - pull%traction, 0.0_dp, pull%along)
   end subroutine find_held

end module road_pull
