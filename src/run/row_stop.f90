!> Gives up the present row if a stop is requested.
!>
!> A row may take minutes if the contact is large or if the passes do not settle. After a request to stop, the row
!> may continue for the time `patience`. If it has not ended by then, it is given up, and the state is that of
!> the row before. The normal and the tangential solver check this in each iteration (module `stop_watch`), and
!> rows with friction also between two passes.
!>
!> For this purpose `keep` copies at the start of a row the parts of the state that it changes before it commits a step:
!> P, the gap, T and T of the step before, the forecast, the contact record, and all scalars. Before the first row P and
!> the gap are zero and need no copy. The fields that change only at the end of a step are not copied, because
!> there may be many of them (the arms). A row whose step is solved in parts needs them, too, once a part is
!> committed: `keep_more` copies them if they take no more than `most_more`. Otherwise such a row can only be
!> given up during its first part.
!>
!> Several processes give up a row together.
module row_stop
   use arm_state, only : arm_state_type
   use asperity_parallel, only : any_process, global_max
   use asperity_precision, only : dp
   use field_copies, only : new_copy
   use row_state, only : state_type
   use stop_watch, only : begin_watch, end_watch, stop_question
   use tangential_state, only : tangential_state_type
   implicit none
   private

   public :: row_stop_type

   real(dp), parameter :: most_more = 64.0e6_dp    !! bytes of a process that `keep_more` copies

   !> The function that reports a request to stop, and the state to return to.
   type :: row_stop_type
      procedure(stop_question), pointer, nopass :: asked => null()   !! null: rows are never given up
      real(dp) :: patience = 2.0_dp            !! time that a row may take after the request, s
      logical :: given_up = .false.            !! the present row was given up
      type(state_type), allocatable, private :: kept
      logical, private :: complete = .false.   !! `kept` has all fields
   contains
      procedure :: keep
      procedure :: keep_more
      procedure :: part_ends
      procedure :: restore
      procedure :: release
   end type row_stop_type

contains

   !> Copy the parts of the state that a row may change before it commits a step.
   subroutine keep(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), intent(inout) :: state       !! unchanged on return
      type(state_type) :: aside
      integer :: status

      self%given_up = .false.
      self%complete = .false.
      if (allocated(self%kept)) deallocate (self%kept)
      if (.not. associated(self%asked)) return
      call move_step_fields(state, aside)
      call move_steady_fields(state, aside)
      call move_contact_fields(state, aside)
      call move_friction_fields(state, aside)
      allocate (self%kept, source=state)
      call move_friction_fields(aside, state)
      call move_contact_fields(aside, state)
      call move_steady_fields(aside, state)
      call move_step_fields(aside, state)
      call copy_large_fields(state, self%kept, status)
      ! If there is not enough memory for the copies, the row is not given up.
      if (any_process(status /= 0)) then
         deallocate (self%kept)
      else
         call begin_watch(self%asked, self%patience)
      end if
   end subroutine keep

   !> Also copy the fields that the first part of a row with several parts will commit. Without the memory for them, the
   !> row can only be given up during this part.
   subroutine keep_more(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      real(dp) :: numbers
      integer :: status

      if (.not. allocated(self%kept)) return
      numbers = numbers_of(state%arms) + numbers_of(state%tangential%arms)
      if (allocated(state%displacement)) numbers = numbers + size(state%displacement)
      if (allocated(state%tangential%displacement)) numbers = numbers + 3.0_dp*size(state%tangential%displacement)
      ! The processes must agree: they have different numbers of rows.
      self%complete = 8.0_dp*global_max(numbers) <= most_more
      if (.not. self%complete) return

      status = 0
      if (allocated(state%displacement)) call new_copy(state%displacement, self%kept%displacement, status)
      if (status == 0) call copy_arms(state%arms, self%kept%arms, status)
      if (status == 0) call copy_arms(state%tangential%arms, self%kept%tangential%arms, status)
      if (status == 0 .and. allocated(state%tangential%displacement)) &
         call copy_committed_friction(state%tangential, self%kept%tangential, status)
      self%complete = .not. any_process(status /= 0)
   end subroutine keep_more

   !> Copy the fields of arms. If there is not enough memory, `status` is not 0.
   subroutine copy_arms(from, to, status)
      type(arm_state_type), intent(in) :: from
      type(arm_state_type), intent(inout) :: to
      integer, intent(out) :: status

      status = 0
      if (allocated(from%s)) call new_copy(from%s, to%s, status)
      if (status == 0 .and. allocated(from%ds)) call new_copy(from%ds, to%ds, status)
      if (status == 0 .and. allocated(from%arm)) call new_copy(from%arm, to%arm, status)
   end subroutine copy_arms

   !> Copy the fields of friction that the end of a step changes. If there is not enough memory, `status` is not 0.
   subroutine copy_committed_friction(from, to, status)
      type(tangential_state_type), intent(in) :: from
      type(tangential_state_type), intent(inout) :: to
      integer, intent(out) :: status

      call new_copy(from%displacement, to%displacement, status)
      if (status == 0) call new_copy(from%rubbing, to%rubbing, status)
      if (status == 0) call new_copy(from%force, to%force, status)
   end subroutine copy_committed_friction

   !> The numbers that arms have on this process.
   pure function numbers_of(arms) result(numbers)
      type(arm_state_type), intent(in) :: arms
      real(dp) :: numbers

      numbers = 0.0_dp
      if (allocated(arms%arm)) numbers = real(size(arms%arm), dp) + size(arms%s) + size(arms%ds)
   end function numbers_of

   !> Note that a part of the row has been committed.
   subroutine part_ends(self)
      class(row_stop_type), intent(inout) :: self

      if (.not. self%complete) call self%release()
   end subroutine part_ends

   !> Return to the state at the start of the row.
   subroutine restore(self, state)
      class(row_stop_type), intent(inout) :: self
      type(state_type), allocatable, intent(inout) :: state

      if (.not. self%complete) call move_step_fields(state, self%kept)
      call move_steady_fields(state, self%kept)
      if (self%kept%first) then
         call move_contact_fields(state, self%kept)
         self%kept%pressure = 0.0_dp
         self%kept%gap = 0.0_dp
      end if
      call move_alloc(self%kept, state)
   end subroutine restore

   !> Free the copies: the row has ended, or can no longer be given up.
   subroutine release(self)
      class(row_stop_type), intent(inout) :: self

      if (allocated(self%kept)) deallocate (self%kept)
      call end_watch()
   end subroutine release

   !> Move the fields of the contact from one state to another.
   subroutine move_contact_fields(from, to)
      type(state_type), intent(inout) :: from, to

      call move_alloc(from%pressure, to%pressure)
      call move_alloc(from%gap, to%gap)
   end subroutine move_contact_fields

   !> Move the fields of friction that a row changes before its end from one state to another.
   subroutine move_friction_fields(from, to)
      type(state_type), intent(inout) :: from, to

      call move_alloc(from%tangential%traction, to%tangential%traction)
      call move_alloc(from%tangential%before, to%tangential%before)
      call move_alloc(from%tangential%forecast%change, to%tangential%forecast%change)
      call move_alloc(from%tangential%forecast%more, to%tangential%forecast%more)
   end subroutine move_friction_fields

   !> Copy the fields of the contact and of friction. If there is not enough memory, `status` is not 0.
   subroutine copy_large_fields(from, to, status)
      type(state_type), intent(in) :: from
      type(state_type), intent(inout) :: to
      integer, intent(out) :: status

      status = 0
      if (.not. from%first) then
         call new_copy(from%pressure, to%pressure, status)
         if (status == 0) call new_copy(from%gap, to%gap, status)
      end if
      if (.not. allocated(from%tangential%traction)) return
      associate (t => from%tangential, kept => to%tangential)
         if (status == 0) call new_copy(t%traction, kept%traction, status)
         if (status == 0) call new_copy(t%before, kept%before, status)
         if (status == 0) call new_copy(t%forecast%change, kept%forecast%change, status)
         if (status == 0) call new_copy(t%forecast%more, kept%forecast%more, status)
      end associate
   end subroutine copy_large_fields

   !> Move the fields that only the end of a step changes from one state to another.
   subroutine move_step_fields(from, to)
      type(state_type), intent(inout) :: from, to

      call move_alloc(from%displacement, to%displacement)
      call move_alloc(from%arms%s, to%arms%s)
      call move_alloc(from%arms%ds, to%arms%ds)
      call move_alloc(from%arms%arm, to%arms%arm)
      call move_alloc(from%tangential%displacement, to%tangential%displacement)
      call move_alloc(from%tangential%rubbing, to%tangential%rubbing)
      call move_alloc(from%tangential%force, to%tangential%force)
      call move_alloc(from%tangential%arms%s, to%tangential%arms%s)
      call move_alloc(from%tangential%arms%ds, to%tangential%arms%ds)
      call move_alloc(from%tangential%arms%arm, to%tangential%arms%arm)
   end subroutine move_step_fields

   !> Move the states of the last steady rows. A row that is solved in parts is not a steady one, and does not
   !> change them.
   subroutine move_steady_fields(from, to)
      type(state_type), intent(inout) :: from, to

      call move_alloc(from%steady%last%pressure, to%steady%last%pressure)
      call move_alloc(from%steady%last%gap, to%steady%last%gap)
      call move_alloc(from%steady%last%traction, to%steady%last%traction)
      call move_alloc(from%steady%before%pressure, to%steady%before%pressure)
      call move_alloc(from%steady%before%gap, to%steady%before%gap)
      call move_alloc(from%steady%before%traction, to%steady%before%traction)
   end subroutine move_steady_fields

end module row_stop
