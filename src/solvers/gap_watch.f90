!> Decides when the gap of an iteration must be computed again from the pressure.
!>
!> Each iteration adds the displacement of its step to the gap. The errors of these sums grow, slowly with
!> products in double precision and faster with products in single precision. The gap is therefore replaced by a
!> new product of the whole pressure, always in double precision, after a number of steps and whenever the
!> problem seems to be solved. The difference between the two shows whether steps in single precision are still
!> useful.
!>
!> Several solves of one step are an exception. Each begins with the gap of the one before, and the step begins
!> with a fresh product. In double precision the sums are then right to some 1e-14 of the heights, and a product
!> that only confirms them is left out.
module gap_watch
   use asperity_precision, only : dp
   implicit none
   private

   public :: gap_watch_type, new_gap_watch

   integer, parameter :: longest_age = 40      !! steps between fresh gaps
   integer, parameter :: mixed_age = 20        !! the same in mixed precision
   integer, parameter :: careful_age = 10      !! the same for a tolerance below `careful`
   real(dp), parameter :: careful = 1e-7_dp
   real(dp), parameter :: resolved = 1e-9_dp   !! tolerance far above the errors of sums in double precision

   !> The accuracy of the gap.
   type :: gap_watch_type
      logical :: fresh = .false.               !! it is the product of the whole pressure
      logical :: single = .false.              !! the products of steps are in single precision
      logical, private :: trusts = .false.     !! the sums alone may prove that the problem is solved
      integer, private :: age = 0              !! steps since the last fresh gap
      integer, private :: oldest = longest_age
      real(dp), private :: expected = huge(1.0_dp)  !! error according to the sums before the last fresh gap
      real(dp), private :: before = huge(1.0_dp)    !! error of the last fresh gap but one
   contains
      procedure :: is_due
      procedure :: proves
      procedure :: note_step
      procedure :: expect
      procedure :: note_fresh
      procedure :: judge
   end type gap_watch_type

contains

   !> Begin to watch.
   subroutine new_gap_watch(self, mixed, tolerance, one_of_many)
      type(gap_watch_type), intent(out) :: self
      logical, intent(in) :: mixed             !! the products of steps start in single precision
      real(dp), intent(in) :: tolerance        !! of the solver
      logical, intent(in) :: one_of_many       !! several solves of a step, each of which starts where the last ended

      self%single = mixed
      self%trusts = one_of_many .and. tolerance >= resolved .and. .not. mixed
      if (mixed) self%oldest = merge(careful_age, mixed_age, tolerance < careful)
   end subroutine new_gap_watch

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
