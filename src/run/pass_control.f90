!> Determines how accurate the solves of the next pass of a coupled step must be, and how much the step to the
!> next place is damped.
!>
!> The solves of a pass need not be more accurate than a tenth (`fraction`) of the mismatch of the last pass. A pass
!> that comes close to the tolerance is solved to the tolerance. On difficult roads three problems may occur:
!>
!> * The solves return without an iteration, because their start is already within the required accuracy. The
!>   mismatch then says little, above all if a thick block turns a small error of the friction into a large
!>   displacement. Therefore, if `patience` successive passes have not reduced the mismatch to `falls` times
!>   the least one before, the fraction is reduced tenfold, and the required accuracy may become better than the
!>   tolerance.
!> * An extrapolation diverges. If the mismatch is ten times the least one so far, the acceleration discards its
!>   differences.
!> * The passes do not come closer: the mismatch has not been halved in `stalled` passes. There are two possible
!>   reasons. Cells that stick, slip and open alternately may make the differences useless for the acceleration;
!>   the passes then settle with short plain steps. Or the state that the rows have followed ceases to exist (a
!>   fold: the contact will snap to another state). The residual then keeps its direction and hardly changes from
!>   pass to pass, while each step leads a little further to the other state. The passes return to the best place
!>   and continue without acceleration (`plain`), with a momentum that grows as long as the residual keeps its
!>   direction and vanishes if it turns. When the mismatch has fallen to a tenth of its value
!>   at the first plain step, or after `stalled_plain` passes
!>   without halving it, the acceleration begins again from the present place. The best place before is discarded,
!>   because it belongs to the state that ceased to exist.
!>
!> If the passes stall even with plain steps, they may never settle. The step should then be solved all at once
!> (`joint_due`), but at most once per row, because an attempt may cost as much as many passes.
module pass_control
   use asperity_precision, only : dp
   implicit none
   private

   public :: pass_control_type

   real(dp), parameter :: coarsest = 1.0e-3_dp      !! accuracy of a solve
   real(dp), parameter :: finest = 1.0e-4_dp        !! best accuracy of a solve, as a multiple of the tolerance
   real(dp), parameter :: round_off = 1.0e-11_dp    !! accuracy that double precision can reach
   real(dp), parameter :: nearly = 3.0_dp           !! an accuracy within this factor of the tolerance nearly meets it
   real(dp), parameter :: usual_fraction = 0.1_dp, least_fraction = 1.0e-6_dp
   real(dp), parameter :: falls = 0.3_dp            !! a mismatch below this part of the least one is a success
   real(dp), parameter :: slow = 0.5_dp             !! a mismatch above this part of the last is slow progress
   real(dp), parameter :: slow_damping = 0.5_dp, sharing_damping = 0.8_dp
   real(dp), parameter :: astray = 10.0_dp
   real(dp), parameter :: first_plain = 0.3_dp, shortest = 0.05_dp, longest = 0.5_dp  !! plain steps
   real(dp), parameter :: grows = 1.2_dp, shrinks = 0.5_dp, gathers = 0.7_dp          !! factors by which they change
   real(dp), parameter :: most_momentum = 0.95_dp
   real(dp), parameter :: straight = 0.8_dp, bent = 0.2_dp  !! cosine of the angle between two residuals
   real(dp), parameter :: gained = 0.1_dp           !! plain steps end at this part of their first mismatch
   integer, parameter :: patience = 2
   integer, parameter :: stalled = 15, stalled_plain = 60

   !> The observations of the passes of a step, and the decisions for the next one.
   type :: pass_control_type
      real(dp) :: accuracy = coarsest               !! of the solves of the next pass
      real(dp) :: damping = 1.0_dp                  !! of the step to the next place
      real(dp) :: momentum = 0.0_dp                 !! of the plain steps
      logical :: forget = .false.                   !! the acceleration starts again
      logical :: go_back = .false.                  !! return to the best place so far
      logical :: plain = .false.                    !! the steps are not accelerated
      logical :: best_yet = .false.                 !! the last pass was the best
      logical :: joint_due = .false.                !! the step should be solved all at once
      real(dp), private :: tolerance = 0.0_dp
      real(dp), private :: fraction = usual_fraction
      logical, private :: may_be_joint = .true.     !! the row may still be solved all at once
      real(dp), private :: slowed = slow_damping    !! damping where the mismatch falls slowly
      real(dp), private :: length = 1.0_dp          !! of plain steps
      real(dp), private :: plain_start = 0.0_dp     !! mismatch where the plain steps began
      real(dp), private :: least = huge(1.0_dp)     !! mismatch so far
      real(dp), private :: last = huge(1.0_dp)      !! mismatch
      real(dp), private :: milestone = huge(1.0_dp) !! mismatch that must be halved
      integer, private :: since = 0                 !! passes since the milestone
      integer, private :: seen = 0
      integer, private :: idle = 0                  !! passes whose mismatch did not fall
   contains
      procedure :: start
      procedure :: judge
      procedure :: follow
   end type pass_control_type

contains

   !> Begin a step, before its first pass.
   subroutine start(self, tolerance, expected, sharing)
      class(pass_control_type), intent(out) :: self
      real(dp), intent(in) :: tolerance             !! of the case
      real(dp), intent(in) :: expected              !! mismatch of the first pass, as in the row before
      !> The shares of the cells at the edge are unknown, too. With them the mismatch falls slowly where cells
      !> change their states one after the other, and damping would only delay that.
      logical, intent(in) :: sharing

      if (sharing) self%slowed = sharing_damping
      self%tolerance = tolerance
      self%accuracy = min(max(coarsest, tolerance), max(tolerance, usual_fraction*expected))
      call spare_a_pass(self)
   end subroutine start

   !> Judge a pass, and decide how the next one is done.
   pure subroutine judge(self, mismatch)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: mismatch

      self%seen = self%seen + 1
      self%damping = 1.0_dp
      if (self%seen > 2 .and. mismatch > slow*self%last) self%damping = self%slowed
      self%last = mismatch

      self%idle = self%idle + 1
      if (self%seen == 1 .or. mismatch <= falls*self%least) self%idle = 0
      if (self%idle == patience) then
         self%fraction = max(0.1_dp*self%fraction, least_fraction)
         self%idle = 0
      end if
      self%accuracy = max(finest*self%tolerance, round_off, self%fraction*mismatch)
      if (self%fraction >= usual_fraction) self%accuracy = max(self%accuracy, self%tolerance)
      self%accuracy = min(self%accuracy, max(coarsest, self%tolerance))
      call spare_a_pass(self)

      self%forget = mismatch > astray*self%least .and. .not. self%plain
      self%go_back = .false.
      self%joint_due = .false.
      self%best_yet = mismatch < self%least
      self%least = min(self%least, mismatch)
      self%since = self%since + 1
      if (mismatch < 0.5_dp*self%milestone) then
         self%milestone = mismatch
         self%since = 0
      end if
      if (self%plain) then
         self%joint_due = self%since >= stalled_plain .and. self%may_be_joint
         if (self%joint_due) self%may_be_joint = .false.
         if (self%since >= stalled_plain .or. mismatch < gained*self%plain_start) call accelerate(self, mismatch)
      else if (self%since >= stalled) then
         call go_plain(self)
      end if
   end subroutine judge

   !> If the next pass would be solved nearly to the tolerance, require the tolerance itself, because it may then be
   !> the last pass.
   pure subroutine spare_a_pass(self)
      class(pass_control_type), intent(inout) :: self

      if (self%accuracy <= nearly*self%tolerance) self%accuracy = min(self%accuracy, self%tolerance)
   end subroutine spare_a_pass

   !> Return to the best place, and continue in plain steps.
   pure subroutine go_plain(self)
      class(pass_control_type), intent(inout) :: self

      self%plain = .true.
      self%go_back = .true.
      self%forget = .true.
      self%since = 0
      self%length = first_plain
      self%damping = self%length
      self%momentum = 0.0_dp
      self%plain_start = self%least
   end subroutine go_plain

   !> End the plain steps: the acceleration begins again from here.
   pure subroutine accelerate(self, mismatch)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: mismatch

      self%plain = .false.
      self%forget = .true.
      self%best_yet = .true.
      self%least = mismatch
      self%milestone = mismatch
      self%since = 0
      self%seen = 0
   end subroutine accelerate

   !> Prepare a plain step: its length and the momentum grow while the residual keeps its direction, and become
   !> smaller if it turns.
   pure subroutine follow(self, cosine)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: cosine                !! of the angle between the last two residuals

      if (cosine > straight) then
         self%momentum = min(1.0_dp - gathers*(1.0_dp - self%momentum), most_momentum)
         self%length = min(grows*self%length, longest)
      else if (cosine < bent) then
         self%momentum = 0.0_dp
         self%length = max(shrinks*self%length, shortest)
      end if
      self%damping = self%length
   end subroutine follow

end module pass_control
