!> Giving up a row that is in hand when a stop is asked for.
!>
!> A row may take minutes, such as one whose passes do not settle. A run that is asked to stop lets the row
!> end if that takes no longer than `patience`; otherwise the row is given up, and the state is that of the
!> row before.
!>
!> For this `keep` copies, at the start of a row, what the row changes before it commits a step: P, the
!> gap, T and T of the step before, the forecast, the states of contact, and all scalars. The fields
!> that only the end of a step changes are not copied, because the arms may have many. A row whose step
!> is solved in parts needs them, too, once a part is committed: `keep_more` copies them if they take
!> no more than `most_more`. Otherwise such a row can be given up in its first part only.
!>
!> Several processes give up a row together: a stop that any of them was asked for counts for all, and the
!> row is given up as soon as the patience of one has ended.
module row_stop
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_parallel, only : any_process, global_max
   use asperity_precision, only : dp, int64
   use row_state, only : state_type
   implicit none
   private

   public :: row_stop_type, stop_question

   real(dp), parameter :: most_more = 64.0e6_dp    !! bytes of a process that `keep_more` copies

   abstract interface
      !> Has a stop been asked for? C's convention, so that Python can answer.
      function stop_question() bind(c) result(yes)
         import :: c_int
         integer(c_int) :: yes                 !! not 0: yes
      end function stop_question
   end interface

   !> Whom to ask, and the state to go back to.
   type :: row_stop_type
      procedure(stop_question), pointer, nopass :: asked => null()   !! null: rows always end
      real(dp) :: patience = 2.0_dp            !! with a row in hand after a stop was asked for, s
      logical :: given_up = .false.            !! the row in hand was given up
      type(state_type), allocatable, private :: kept
      logical, private :: complete = .false.   !! `kept` has all fields
      integer(int64), private :: since = -1    !! clock at which the answer was first yes
   contains
      procedure :: keep
      procedure :: keep_more
      procedure :: part_ends
      procedure :: is_due
      procedure :: put_back
   end type row_stop_type

contains

   !> A row begins: keep what it may change before it commits a step.
   subroutine keep(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), intent(inout) :: state       !! unchanged on return
      type(state_type) :: aside

      self%given_up = .false.
      self%complete = .false.
      if (allocated(self%kept)) deallocate (self%kept)
      if (.not. associated(self%asked)) return
      call hand_over(state, aside)
      allocate (self%kept, source=state)
      call hand_over(aside, state)
   end subroutine keep

   !> The row has several parts: keep what the first of them will commit.
   subroutine keep_more(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      real(dp) :: numbers

      if (.not. allocated(self%kept)) return
      associate (t => state%tangential)
         numbers = real(size(state%arms%arm), dp) + real(size(t%arms%arm), dp) + size(state%arms%s) + &
            size(state%arms%ds) + size(t%arms%s) + size(t%arms%ds) + 3*size(t%displacement)
      end associate
      ! The processes must agree: they have different numbers of rows.
      self%complete = 8.0_dp*global_max(numbers) <= most_more
      if (.not. self%complete) return
      if (allocated(state%displacement)) self%kept%displacement = state%displacement
      self%kept%arms = state%arms
      self%kept%tangential%displacement = state%tangential%displacement
      self%kept%tangential%rubbing = state%tangential%rubbing
      self%kept%tangential%rubbed = state%tangential%rubbed
      self%kept%tangential%arms = state%tangential%arms
   end subroutine keep_more

   !> A part of the row has been committed.
   subroutine part_ends(self)
      class(row_stop_type), intent(inout) :: self

      if (allocated(self%kept) .and. .not. self%complete) deallocate (self%kept)
   end subroutine part_ends

   !> Is the row in hand to be given up? Collective.
   function is_due(self) result(due)
      class(row_stop_type), intent(inout) :: self
      logical :: due
      integer(int64) :: now, rate

      due = .false.
      if (.not. allocated(self%kept)) return
      if (.not. any_process(self%asked() /= 0_c_int)) return
      call system_clock(now, rate)
      if (self%since < 0) self%since = now
      due = any_process(real(now - self%since, dp) >= self%patience*real(rate, dp))
   end function is_due

   !> Go back to the state at the start of the row.
   subroutine put_back(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), allocatable, intent(inout) :: state

      if (.not. self%complete) call hand_over(state, self%kept)
      call move_alloc(self%kept, state)
   end subroutine put_back

   !> Move the fields that only the end of a step changes from one state to another.
   subroutine hand_over(from, to)
      type(state_type), intent(inout) :: from, to

      call move_alloc(from%displacement, to%displacement)
      call move_alloc(from%arms%s, to%arms%s)
      call move_alloc(from%arms%ds, to%arms%ds)
      call move_alloc(from%arms%arm, to%arms%arm)
      call move_alloc(from%tangential%displacement, to%tangential%displacement)
      call move_alloc(from%tangential%rubbing, to%tangential%rubbing)
      call move_alloc(from%tangential%rubbed, to%tangential%rubbed)
      call move_alloc(from%tangential%arms%s, to%tangential%arms%s)
      call move_alloc(from%tangential%arms%ds, to%tangential%arms%ds)
      call move_alloc(from%tangential%arms%arm, to%tangential%arms%arm)
   end subroutine hand_over

end module row_stop
