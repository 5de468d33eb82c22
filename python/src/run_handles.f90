!> Runs in hand, known to Python by a number. Not seen by f2py, which has no derived types.
module run_handles
   use case_run, only : run_type
   implicit none
   private

   public :: free_run, new_run, run_of

   integer, parameter :: most = 64      !! runs at a time

   type :: slot_type
      type(run_type), pointer :: run => null()
      integer :: handle = 0
   end type slot_type

   type(slot_type) :: slots(most)
   integer :: last_handle = 0           !! handles are never used again: an old one finds no run

contains

   !> Make a run; the handle is 0 if there are too many.
   subroutine new_run(handle)
      integer, intent(out) :: handle
      integer :: i

      handle = 0
      do i = 1, most
         if (.not. associated(slots(i)%run)) then
            allocate (slots(i)%run)
            last_handle = last_handle + 1
            slots(i)%handle = last_handle
            handle = last_handle
            return
         end if
      end do
   end subroutine new_run

   !> The run of a handle, null for a handle that is not in use.
   function run_of(handle) result(run)
      integer, intent(in) :: handle
      type(run_type), pointer :: run

      integer :: i

      run => null()
      do i = 1, most
         if (slots(i)%handle == handle .and. associated(slots(i)%run)) run => slots(i)%run
      end do
   end function run_of

   !> Forget a run that is closed.
   subroutine free_run(handle)
      integer, intent(in) :: handle

      integer :: i

      do i = 1, most
         if (slots(i)%handle /= handle .or. .not. associated(slots(i)%run)) cycle
         deallocate (slots(i)%run)
         slots(i)%run => null()
      end do
   end subroutine free_run

end module run_handles
