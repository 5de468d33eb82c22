!> Runs in hand, known to Python by a number. Not seen by f2py, which has no derived types.
module run_handles
   use case_run, only : run_type
   implicit none
   private

   public :: free_run, new_run, run_of

   integer, parameter :: most = 64      !! runs at a time

   type :: slot_type
      type(run_type), pointer :: run => null()
   end type slot_type

   type(slot_type) :: slots(most)

contains

   !> Make a run; the handle is 0 if there are too many.
   subroutine new_run(handle)
      integer, intent(out) :: handle
      integer :: i

      handle = 0
      do i = 1, most
         if (.not. associated(slots(i)%run)) then
            allocate (slots(i)%run)
            handle = i
            return
         end if
      end do
   end subroutine new_run

   !> The run of a handle, null for a handle that is not in use.
   function run_of(handle) result(run)
      integer, intent(in) :: handle
      type(run_type), pointer :: run

      run => null()
      if (handle >= 1 .and. handle <= most) run => slots(handle)%run
   end function run_of

   !> Forget a run that is closed.
   subroutine free_run(handle)
      integer, intent(in) :: handle

      if (.not. associated(run_of(handle))) return
      deallocate (slots(handle)%run)
      slots(handle)%run => null()
   end subroutine free_run

end module run_handles
