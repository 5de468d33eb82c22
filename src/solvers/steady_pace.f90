!> Controls the rounds of steady sliding with friction (module `steady_friction`): the part of a change that is
!> taken, and whether the rounds are accelerated.
!>
!> Far from the solution the acceleration would diverge, so that the first rounds are plain. It begins when the
!> change of a round is small, and ends when the change grows again; it then restarts only closer to the solution.
!> Plain rounds that do not halve their change in `check_every` rounds are relaxed more strongly and solve the
!> normal contact more accurately.
!>
!> Rounds converge slowly where some cells nearly stick: the direction of their traction follows the slip only by a
!> small part in each round. Near the solution Newton's method for all cells (module `steady_joint`) is then faster.
!> It is tried from the present contact if the rounds that are still needed, by their progress so far, would take more
!> transforms. Far from the solution it is tried if a number of rounds has not been sufficient.
module steady_pace
   use asperity_precision, only : dp
   use friction_law, only : friction_law_type
   implicit none
   private

   public :: new_pace, pace_type

   integer, parameter, public :: components = 5  !! of a state: z, u, r

   integer, parameter :: check_every = 12        !! plain rounds between two checks of their progress

   ! Attempts to solve all cells at once:
   integer, parameter, public :: no_attempt = 0
   integer, parameter, public :: from_here = 1   !! from the present contact
   integer, parameter, public :: from_best = 2   !! from the best contact so far
   integer, parameter, public :: along_path = 3  !! from the contact without friction, along a path of solutions
   integer, parameter, public :: along_second_path = 4
   !> Rounds before the first attempt that does not start from the present contact. The next two follow after half as
   !> many rounds each.
   integer, parameter :: first_without_jump = 150
   integer, parameter :: first_if_stalled = 64   !! the same if the rounds have hardly made any progress
   integer, parameter :: first_with_jump = 100   !! the same if the traction jumps at the edge of the contact
   integer, parameter :: compared = 8            !! rounds whose least change is compared with that of as many before
   integer, parameter :: patience = 25           !! least number of rounds between attempts from the present contact
   real(dp), parameter :: almost = 5.0_dp        !! change, in tolerances, below which the rounds continue in any case
   !> Change of a round below which an attempt from the present contact usually succeeds. With the slope effect the rounds
   !> converge more slowly, so that an earlier attempt is worth more.
   real(dp), parameter :: near_on_flat = 1.0e-3_dp, near_on_slopes = 1.0e-2_dp
   real(dp), parameter :: price = 900.0_dp       !! transforms of such an attempt on a grid of ...
   real(dp), parameter :: priced_cells = 16384.0_dp   !! ... this number of cells; they grow like its square root
   real(dp), parameter :: price_far = 32000.0_dp !! transforms of an attempt far from the solution, likewise
   real(dp), parameter :: least_progress = 1.0e-9_dp  !! decades per round of rounds that make no progress

   !> The pace of the rounds.
   type :: pace_type
      real(dp) :: beta = 0.5_dp                  !! part of a change of u that is taken
      integer :: inner = 4                       !! normal steps in a round
      logical :: accelerated = .false.
      real(dp) :: smooth = 0.03_dp               !! change below which rounds are accelerated
      real(dp) :: least = huge(1.0_dp)           !! least change since the acceleration began
      real(dp) :: marked = huge(1.0_dp)          !! change at the last check of the progress of plain rounds
      integer :: since = 0                       !! plain rounds since that check
      real(dp) :: weights(components) = 0.0_dp   !! of the components in the acceleration
      integer :: attempt = no_attempt            !! to solve all cells at once, after this round
      real(dp) :: expected = 0.0_dp              !! transforms of the rounds that an attempt from here replaces
      integer, private :: first_far = first_without_jump   !! round of the first attempt that is not from here
      real(dp), private :: near = near_on_flat       !! change below which an attempt from here is allowed
      integer, private :: next_attempt = 2*compared     !! first round in which one from here is allowed
      ! Of the first `first_if_stalled` rounds:
      real(dp), private :: least_before = huge(1.0_dp)  !! least change in their first half
      real(dp), private :: least_so_far = huge(1.0_dp)  !! least change in the present half
      real(dp), private :: recent(2*compared) = huge(1.0_dp)   !! changes of the last rounds
      real(dp) :: accepted = 0.0_dp              !! change below which a solution is checked
      real(dp) :: best = huge(1.0_dp)            !! error of the best contact so far
   contains
      procedure :: choose
      procedure :: choose_attempt
      procedure :: note_plain
   end type pace_type

contains

   !> The pace at the beginning of the rounds with a friction law.
   pure function new_pace(law) result(self)
      type(friction_law_type), intent(in) :: law
      type(pace_type) :: self

      if (law%jumps_at_edge()) self%first_far = first_with_jump
      if (law%slope_effect) self%near = near_on_slopes
   end function new_pace

   !> Choose whether the next step is accelerated.
   subroutine choose(self, change, begins)
      class(pace_type), intent(inout) :: self
      real(dp), intent(in) :: change             !! of the last round
      logical, intent(out) :: begins             !! the acceleration begins with this step

      begins = .false.
      if (self%accelerated .and. change > 4.0_dp*self%least) then
         self%accelerated = .false.
         self%smooth = 0.3_dp*self%least
      else if (.not. self%accelerated .and. change < self%smooth) then
         self%accelerated = .true.
         self%least = change
         begins = .true.
      end if
      if (self%accelerated) self%least = min(self%least, change)
   end subroutine choose

   !> Decide whether all cells are to be solved at once after a round.
   subroutine choose_attempt(self, rounds, change, tolerance, cells)
      class(pace_type), intent(inout) :: self
      integer, intent(in) :: rounds              !! so far
      real(dp), intent(in) :: change             !! of the last round
      real(dp), intent(in) :: tolerance          !! of the change
      real(dp), intent(in) :: cells              !! of the grid
      real(dp) :: decades_left, decades_per_round, least, least_before

      self%recent = [self%recent(2:), change]
      self%attempt = no_attempt
      call check_progress(self, rounds, change, tolerance, cells)
      if (rounds == self%first_far) self%attempt = from_best
      if (2*rounds == 3*self%first_far) self%attempt = along_path
      if (rounds == 2*self%first_far) self%attempt = along_second_path
      if (self%attempt /= no_attempt .or. rounds < self%next_attempt) return

      ! An accelerated round may have a much larger change than its neighbours. The progress is therefore measured by the
      ! least changes, and an attempt starts only from a round whose change is near the least one.
      least = minval(self%recent(compared + 1:))
      least_before = minval(self%recent(:compared))
      if (least > self%near .or. least < almost*tolerance .or. change > 2.0_dp*least) return
      decades_per_round = log10(least_before/least)/compared
      decades_left = log10(least/tolerance)
      self%expected = decades_left*transforms_of_round(self)/max(decades_per_round, least_progress)
      if (self%expected <= price*sqrt(cells/priced_cells)) return
      self%attempt = from_here
      self%next_attempt = rounds + max(patience, rounds/2)
   end subroutine choose_attempt

   !> The transforms of a round.
   pure function transforms_of_round(self) result(transforms)
      class(pace_type), intent(in) :: self
      real(dp) :: transforms

      transforms = 6.0_dp + 2.0_dp*self%inner
   end function transforms_of_round

   !> Attempt to solve all cells at once sooner if the second half of the first rounds has made hardly any progress.
   subroutine check_progress(self, rounds, change, tolerance, cells)
      class(pace_type), intent(inout) :: self
      integer, intent(in) :: rounds              !! so far
      real(dp), intent(in) :: change             !! of the last round
      real(dp), intent(in) :: tolerance          !! of the change
      real(dp), intent(in) :: cells              !! of the grid
      real(dp) :: decades_per_round, expected

      self%least_so_far = min(self%least_so_far, change)
      if (2*rounds == first_if_stalled) then
         self%least_before = self%least_so_far
         self%least_so_far = huge(1.0_dp)
      else if (rounds == first_if_stalled) then
         decades_per_round = 2.0_dp*log10(self%least_before/self%least_so_far)/first_if_stalled
         expected = log10(self%least_so_far/tolerance)*transforms_of_round(self)/max(decades_per_round, least_progress)
         if (expected > price_far*sqrt(cells/priced_cells)) self%first_far = min(self%first_far, first_if_stalled)
      end if
   end subroutine check_progress

   !> Count a plain step, and relax the next ones more strongly if plain steps make no progress.
   subroutine note_plain(self, change)
      class(pace_type), intent(inout) :: self
      real(dp), intent(in) :: change             !! of the last round

      self%since = self%since + 1
      if (self%since < check_every) return
      if (change > 0.5_dp*self%marked) then
         self%beta = max(0.15_dp, 0.6_dp*self%beta)
         self%inner = min(12, self%inner + 3)
      end if
      self%marked = change
      self%since = 0
   end subroutine note_plain

end module steady_pace
