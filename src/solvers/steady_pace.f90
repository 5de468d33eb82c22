!> Controls the rounds of steady sliding with friction (module `steady_friction`): the part of a change that is
!> taken, and whether the rounds are accelerated.
!>
!> Far from the solution the acceleration would diverge, so that the first rounds are plain. It begins when the
!> change of a round is small, and ends when the change grows again; it then restarts only closer to the solution.
!> Plain rounds that do not halve their change in `slow` rounds are relaxed more strongly and solve the
!> normal contact more accurately.
module steady_pace
   use asperity_precision, only : dp
   implicit none
   private

   public :: pace_type

   integer, parameter, public :: components = 5  !! of a state: z, u, r

   integer, parameter :: slow = 25               !! plain rounds between two checks of their progress

   !> The pace of the rounds.
   type :: pace_type
      real(dp) :: beta = 0.5_dp                  !! part of a change of u that is taken
      integer :: inner = 4                       !! normal steps in a round
      logical :: accelerated = .false.
      real(dp) :: near = 0.03_dp                 !! change below which rounds are accelerated
      real(dp) :: least = huge(1.0_dp)           !! change so far, while accelerated
      real(dp) :: marked = huge(1.0_dp)          !! change some rounds ago
      integer :: since = 0                       !! rounds since then
      real(dp) :: weights(components) = 0.0_dp   !! of the components in the acceleration
      integer :: attempt = 0                     !! to solve all cells at once: its number after this round
      real(dp) :: accepted = 0.0_dp              !! change below which a solution is checked
      real(dp) :: best = huge(1.0_dp)            !! largest error of the kept contact
   contains
      procedure :: choose
      procedure :: note_plain
   end type pace_type

contains

   !> Choose whether the next step is accelerated.
   subroutine choose(self, change, begins)
      class(pace_type), intent(inout) :: self
      real(dp), intent(in) :: change             !! of the last round
      logical, intent(out) :: begins             !! the acceleration begins with this step

      begins = .false.
      if (self%accelerated .and. change > 4.0_dp*self%least) then
         self%accelerated = .false.
         self%near = 0.3_dp*self%least
      else if (.not. self%accelerated .and. change < self%near) then
         self%accelerated = .true.
         self%least = change
         begins = .true.
      end if
      if (self%accelerated) self%least = min(self%least, change)
   end subroutine choose

   !> Note a plain step, and slow down if such steps make no progress.
   subroutine note_plain(self, change)
      class(pace_type), intent(inout) :: self
      real(dp), intent(in) :: change             !! of the last round

      self%since = self%since + 1
      if (self%since < slow) return
      if (change > 0.5_dp*self%marked) then
         self%beta = max(0.15_dp, 0.6_dp*self%beta)
         self%inner = min(12, self%inner + 3)
      end if
      self%marked = change
      self%since = 0
   end subroutine note_plain

end module steady_pace
