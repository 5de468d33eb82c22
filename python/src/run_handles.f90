!> Runs and simulations in hand, known to Python by a number. Not seen by f2py, which has no derived
!> types. A run writes files; a driven simulation is advanced row by row and writes none.
module run_handles
   use case_run, only : run_type
   use asperity_precision, only : dp
   use asperity_simulation, only : simulation_type
   implicit none
   private

   public :: driven_of, driven_type, free_driven, free_run, new_driven, new_run, run_of, sim_of

   integer, parameter :: most = 64      !! runs at a time, and simulations

   !> A simulation, with what it was before anyone steered it.
   type :: driven_type
      type(simulation_type) :: sim
      character(:), allocatable :: settings      !! what a saved state must agree with
      real(dp), allocatable :: start_tau(:)      !! relaxation times of the case, s
      real(dp) :: start_temperature = 0.0_dp     !! C
   end type driven_type

   !> What a handle stands for: one of the two, or nothing.
   type :: slot_type
      type(run_type), pointer :: run => null()
      type(driven_type), pointer :: driven => null()
      integer :: handle = 0
   end type slot_type

   type(slot_type), target :: slots(2*most)
   integer :: last_handle = 0           !! handles are never used again: an old one finds nothing

contains

   !> The slot of a handle, null for a handle that is not in use; handle 0 finds a free slot.
   function slot_of(handle) result(slot)
      integer, intent(in) :: handle
      type(slot_type), pointer :: slot
      integer :: i

      slot => null()
      do i = size(slots), 1, -1
         if (slots(i)%handle == handle) slot => slots(i)
      end do
   end function slot_of

   !> Give a free slot a new handle; null if there are too many.
   function new_slot() result(slot)
      type(slot_type), pointer :: slot

      slot => slot_of(0)
      if (.not. associated(slot)) return
      last_handle = last_handle + 1
      slot%handle = last_handle
   end function new_slot

   !> Make a run; the handle is 0 if there are too many.
   subroutine new_run(handle)
      integer, intent(out) :: handle
      type(slot_type), pointer :: slot

      handle = 0
      slot => new_slot()
      if (.not. associated(slot)) return
      allocate (slot%run)
      handle = slot%handle
   end subroutine new_run

   !> The run of a handle, null for a handle that is none of a run.
   function run_of(handle) result(run)
      integer, intent(in) :: handle
      type(run_type), pointer :: run
      type(slot_type), pointer :: slot

      run => null()
      if (handle <= 0) return
      slot => slot_of(handle)
      if (associated(slot)) run => slot%run
   end function run_of

   !> Forget a run that is closed.
   subroutine free_run(handle)
      integer, intent(in) :: handle
      type(slot_type), pointer :: slot

      if (.not. associated(run_of(handle))) return
      slot => slot_of(handle)
      deallocate (slot%run)
      slot%run => null()
      slot%handle = 0
   end subroutine free_run

   !> Make a simulation; the handle is 0 if there are too many.
   subroutine new_driven(handle)
      integer, intent(out) :: handle
      type(slot_type), pointer :: slot

      handle = 0
      slot => new_slot()
      if (.not. associated(slot)) return
      allocate (slot%driven)
      handle = slot%handle
   end subroutine new_driven

   !> The simulation of a handle, null for a handle that is none of a simulation.
   function driven_of(handle) result(driven)
      integer, intent(in) :: handle
      type(driven_type), pointer :: driven
      type(slot_type), pointer :: slot

      driven => null()
      if (handle <= 0) return
      slot => slot_of(handle)
      if (associated(slot)) driven => slot%driven
   end function driven_of

   !> Forget a simulation that is destroyed.
   subroutine free_driven(handle)
      integer, intent(in) :: handle
      type(slot_type), pointer :: slot

      if (.not. associated(driven_of(handle))) return
      slot => slot_of(handle)
      deallocate (slot%driven)
      slot%driven => null()
      slot%handle = 0
   end subroutine free_driven

   !> The state behind a handle of either kind, null for a handle that is not in use.
   function sim_of(handle) result(sim)
      integer, intent(in) :: handle
      type(simulation_type), pointer :: sim
      type(driven_type), pointer :: driven
      type(run_type), pointer :: run

      sim => null()
      driven => driven_of(handle)
      run => run_of(handle)
      if (associated(driven)) sim => driven%sim
      if (associated(run)) sim => run%sim
   end function sim_of

end module run_handles
