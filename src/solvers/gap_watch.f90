!> Decides when the gap of an iteration must be computed again from the pressure.
!>
!> Each iteration adds the displacement of its step to the gap. The errors of these sums grow, slowly with
!> products in double precision and faster with products in single precision. The gap is therefore replaced by a
!> new product of the whole pressure, always in double precision, after a number of steps. The difference between
!> the two shows whether steps in single precision are still useful.
!>
!> Whether the problem is solved is decided from a fresh gap, too, unless the sums are accurate enough. In double
!> precision their error is some 1e-14 of the largest error of the gap since the last fresh one, and a product that
!> would only confirm them is left out. It is needed for very small tolerances, for contacts that are small on a tall
!> map, whose errors are compared with a much smaller length than the heights, and after a start that was much too far
!> away.
module gap_watch
   use asperity_precision, only : dp
   implicit none
   private

   public :: gap_watch_type, new_gap_watch

   integer, parameter :: longest_age = 40      !! steps between fresh gaps
   integer, parameter :: mixed_age = 20        !! the same in mixed precision
   integer, parameter :: careful_age = 10      !! the same for a tolerance below `careful`
   real(dp), parameter :: careful = 1e-7_dp
   !> Error over the largest one since the last fresh gap that is far above the errors of sums in double precision.
   real(dp), parameter :: resolved = 1e-10_dp

   !> The accuracy of the gap.
   type :: gap_watch_type
      logical :: fresh = .false.               !! it is the product of the whole pressure
      logical :: single = .false.              !! the products of steps are in single precision
      logical, private :: mixed = .false.      !! they were in single precision at first
      logical, private :: trusts = .false.     !! the sums alone may prove that the problem is solved
      real(dp), private :: largest = 1.0_dp    !! error over the rms height since the last fresh gap, at least 1
      integer, private :: age = 0              !! steps since the last fresh gap
      integer, private :: oldest = longest_age
      real(dp), private :: expected = huge(1.0_dp)  !! error according to the sums before the last fresh gap
      real(dp), private :: before = huge(1.0_dp)    !! error of the last fresh gap but one
   contains
      procedure :: note_error
      procedure :: is_due
      procedure :: proves
      procedure :: note_step
      procedure :: expect
      procedure :: note_fresh
      procedure :: judge
   end type gap_watch_type

contains

   !> Begin to watch.
   subroutine new_gap_watch(self, mixed, tolerance)
      type(gap_watch_type), intent(out) :: self
      logical, intent(in) :: mixed             !! the products of steps start in single precision
      real(dp), intent(in) :: tolerance        !! of the solver

      self%single = mixed
      self%mixed = mixed
      if (mixed) self%oldest = merge(careful_age, mixed_age, tolerance < careful)
   end subroutine new_gap_watch

   !> Note the error of the gap as it stands, and decide whether the sums are accurate enough for the tolerance.
   subroutine note_error(self, error, tolerance)
      class(gap_watch_type), intent(inout) :: self
      real(dp), intent(in) :: error            !! over the rms height
      real(dp), intent(in) :: tolerance        !! of this error

      self%largest = max(self%largest, error)
      self%trusts = .not. self%mixed .and. tolerance >= resolved*self%largest
   end subroutine note_error

   !> Must the gap be computed again before any decision is based on it?
   pure function is_due(self, solved) result(due)
      class(gap_watch_type), intent(in) :: self
      logical, intent(in) :: solved            !! the problem is solved according to the present gap
      logical :: due

      due = .not. self%fresh .and. (solved .and. .not. self%trusts .or. self%age >= self%oldest)
   end function is_due

   !> Can it be concluded from the gap as it stands that the problem is solved?
   pure function proves(self)
      class(gap_watch_type), intent(in) :: self
      logical :: proves

      proves = self%fresh .or. self%trusts
   end function proves

   !> Note that a step was added to the gap.
   subroutine note_step(self)
      class(gap_watch_type), intent(inout) :: self

      self%fresh = .false.
      self%age = self%age + 1
   end subroutine note_step

   !> Note that the gap will be computed again, and keep the error according to the sums.
   subroutine expect(self, error)
      class(gap_watch_type), intent(inout) :: self
      real(dp), intent(in) :: error

      self%expected = error
   end subroutine expect

   !> Note that the gap was computed again.
   subroutine note_fresh(self)
      class(gap_watch_type), intent(inout) :: self

      self%fresh = .true.
      self%age = 0
      self%largest = 1.0_dp
   end subroutine note_fresh

   !> Compare the error of a fresh gap with the expected one.
   !>
   !> If the sums have drifted, directions formed with residuals before and after are not conjugate. If the drift
   !> exceeds the progress since the last fresh gap, the steps continue in double precision.
   subroutine judge(self, error, drifted)
      class(gap_watch_type), intent(inout) :: self
      real(dp), intent(in) :: error            !! of the gap
      logical, intent(out) :: drifted          !! start the direction again

      drifted = .false.
      if (.not. (self%fresh .and. self%single)) return
      drifted = error > 2.0_dp*self%expected
      if (drifted) self%single = error <= 0.5_dp*self%before
      self%before = error
      self%expected = huge(1.0_dp)
   end subroutine judge

end module gap_watch
