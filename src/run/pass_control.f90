!> Determines how accurate the solves of the next pass of a coupled step must be, and how much the step to the
!> next place is damped.
!>
!> The solves of a pass need not be more accurate than a tenth (`fraction`) of the mismatch of the last pass. A pass
!> that comes close to the tolerance is solved to the tolerance. On difficult roads three problems may occur:
!>
!> * The solves return without an iteration, because their start is already within the required accuracy. The
!>   mismatch then says little, above all if a thick block turns a small error of the friction into a large
!>   displacement. Therefore, if `patience` successive passes have not reduced the mismatch to `success` times
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
!>   direction and vanishes if it turns. When the mismatch has fallen to a tenth (`recovered`) of the least
!>   one before the plain steps, or has not been halved in `stalled_plain` passes, the acceleration begins again from the present
!>   place. The best place before is discarded, because it may belong to the state that ceased to exist.
!>
!> A step may also be solved all at once (`joint_due`), at most twice per row. The first attempt is made after a few
!> passes (`few`), if more than as many again are to be expected at their present rate. On steep roads it takes far
!> less time than the passes would. With unknown shares it would often take more, and is not made. The second one is
!> made, from a better place, if the passes stall even with plain steps, and may then never settle. It is `thorough`:
!> it may cost as much as many passes, and may find a solution that is far away. The first one ends soon if it does not
!> succeed, and its solution is usually near.
module pass_control
   use asperity_precision, only : dp
   implicit none
   private

   public :: pass_control_type

   real(dp), parameter :: coarsest = 1.0e-3_dp      !! accuracy of a solve
   real(dp), parameter :: finest = 1.0e-4_dp        !! best accuracy of a solve, as a multiple of the tolerance
   real(dp), parameter :: round_off = 1.0e-11_dp    !! accuracy that double precision can reach
   real(dp), parameter :: nearly = 3.0_dp           !! an accuracy within this factor of the tolerance nearly meets it
   real(dp), parameter :: usual_fraction = 0.1_dp   !! accuracy of a pass over the last mismatch
   real(dp), parameter :: least_fraction = 1.0e-6_dp   !! the same, after many reductions
   real(dp), parameter :: success = 0.3_dp          !! a mismatch below this part of the least one is a success
   real(dp), parameter :: slow = 0.5_dp             !! a mismatch above this part of the last is slow progress
   real(dp), parameter :: slow_damping = 0.5_dp     !! damping after slow progress
   real(dp), parameter :: sharing_damping = 0.8_dp  !! the same if the shares are unknown
   real(dp), parameter :: diverged = 10.0_dp        !! a mismatch above this multiple of the least one has diverged
   integer, parameter :: patience = 2               !! passes without success before the fraction is reduced
   integer, parameter :: stalled = 15               !! accelerated passes that must halve the mismatch
   integer, parameter :: few = 6                    !! passes before the first attempt to solve the step all at once
   integer, parameter :: rated = 3                  !! last passes of these whose rate counts

   ! Plain steps. If the residual keeps its direction, their length and momentum grow; if it turns, both shrink.
   integer, parameter :: stalled_plain = 60         !! plain passes that must halve the mismatch
   real(dp), parameter :: recovered = 0.1_dp        !! plain steps end at this part of their first mismatch
   real(dp), parameter :: first_length = 0.3_dp, shortest = 0.05_dp, longest = 0.5_dp
   real(dp), parameter :: growth = 1.2_dp           !! factor of the length if the residual keeps its direction
   real(dp), parameter :: shrinkage = 0.5_dp        !! factor of the length if the residual turns
   real(dp), parameter :: momentum_growth = 0.7_dp  !! factor of 1 - momentum if the residual keeps its direction
   real(dp), parameter :: most_momentum = 0.95_dp
   real(dp), parameter :: straight = 0.8_dp         !! cosine between two residuals above which it keeps its direction
   real(dp), parameter :: bent = 0.2_dp             !! cosine between two residuals below which it turns

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
      logical :: thorough = .false.                 !! the attempt may take long
      real(dp), private :: tolerance = 0.0_dp
      logical, private :: sharing = .false.         !! the shares of the cells at the edge are unknown, too
      real(dp), private :: fraction = usual_fraction
      logical, private :: may_be_joint = .true.     !! there has been no thorough attempt
      real(dp), private :: slowed = slow_damping    !! damping after slow progress
      real(dp), private :: length = 1.0_dp          !! of plain steps
      real(dp), private :: plain_start = 0.0_dp     !! least mismatch when the plain steps began
      real(dp), private :: least = huge(1.0_dp)     !! least mismatch so far
      real(dp), private :: last = huge(1.0_dp)      !! mismatch of the last pass
      real(dp), private :: milestone = huge(1.0_dp) !! mismatch that must be halved
      integer, private :: since = 0                 !! passes since the milestone, or since the plain steps began
      integer, private :: seen = 0                  !! passes judged since the start, or since the plain steps ended
      integer, private :: idle = 0                  !! successive passes without success
      integer, private :: count = 0                 !! passes of the row that were judged
      real(dp), private :: marked = huge(1.0_dp)    !! least mismatch before the passes whose rate counts
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

      self%sharing = sharing
      if (sharing) self%slowed = sharing_damping
      self%tolerance = tolerance
      self%accuracy = min(max(coarsest, tolerance), max(tolerance, usual_fraction*expected))
      call round_to_tolerance(self)
   end subroutine start

   !> Judge a pass, and decide how the next one is done.
   pure subroutine judge(self, mismatch)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: mismatch

      self%seen = self%seen + 1
      self%count = self%count + 1
      self%damping = 1.0_dp
      if (self%seen > 2 .and. mismatch > slow*self%last) self%damping = self%slowed
      self%last = mismatch

      self%idle = self%idle + 1
      if (self%seen == 1 .or. mismatch <= success*self%least) self%idle = 0
      if (self%idle == patience) then
         self%fraction = max(0.1_dp*self%fraction, least_fraction)
         self%idle = 0
      end if
      self%accuracy = max(finest*self%tolerance, round_off, self%fraction*mismatch)
      if (self%fraction >= usual_fraction) self%accuracy = max(self%accuracy, self%tolerance)
      self%accuracy = min(self%accuracy, max(coarsest, self%tolerance))
      call round_to_tolerance(self)

      self%forget = mismatch > diverged*self%least .and. .not. self%plain
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
         if (self%joint_due) then
            self%may_be_joint = .false.
            self%thorough = .true.
         end if
         if (self%since >= stalled_plain .or. mismatch < recovered*self%plain_start) &
            call end_plain_steps(self, mismatch)
      else if (self%since >= stalled) then
         call begin_plain_steps(self)
      end if
      if (self%count == few - rated) self%marked = self%least
      if (self%count == few .and. .not. self%sharing) then
         self%joint_due = is_slow(self)
         self%thorough = .false.
      end if
   end subroutine judge

   !> Are more passes to be expected than have been done, at the rate of the last ones?
   pure logical function is_slow(self)
      class(pass_control_type), intent(in) :: self
      real(dp) :: left                              !! the mismatch, but not 0
      real(dp) :: rate                              !! of its logarithm, per pass

      left = max(self%least, tiny(1.0_dp))
      rate = log(self%marked/left)/rated
      is_slow = log(left/self%tolerance) > few*rate
   end function is_slow

   !> Require the tolerance itself if the next pass would be solved nearly to it. This may save a pass, because the next
   !> one may then be the last.
   pure subroutine round_to_tolerance(self)
      class(pass_control_type), intent(inout) :: self

      if (self%accuracy <= nearly*self%tolerance) self%accuracy = min(self%accuracy, self%tolerance)
   end subroutine round_to_tolerance

   !> Return to the best place, and continue in plain steps.
   pure subroutine begin_plain_steps(self)
      class(pass_control_type), intent(inout) :: self

      self%plain = .true.
      self%go_back = .true.
      self%forget = .true.
      self%since = 0
      self%length = first_length
      self%damping = self%length
      self%momentum = 0.0_dp
      self%plain_start = self%least
   end subroutine begin_plain_steps

   !> End the plain steps. The acceleration begins again from the present place, which counts as the best one.
   pure subroutine end_plain_steps(self, mismatch)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: mismatch

      self%plain = .false.
      self%forget = .true.
      self%best_yet = .true.
      self%least = mismatch
      self%milestone = mismatch
      self%since = 0
      self%seen = 0
   end subroutine end_plain_steps

   !> Prepare a plain step: its length and the momentum grow while the residual keeps its direction, and become
   !> smaller if it turns.
   pure subroutine follow(self, cosine)
      class(pass_control_type), intent(inout) :: self
      real(dp), intent(in) :: cosine                !! of the angle between the last two residuals

      if (cosine > straight) then
         self%momentum = min(1.0_dp - momentum_growth*(1.0_dp - self%momentum), most_momentum)
         self%length = min(growth*self%length, longest)
      else if (cosine < bent) then
         self%momentum = 0.0_dp
         self%length = max(shrinkage*self%length, shortest)
      end if
      self%damping = self%length
   end subroutine follow

end module pass_control
