!> The open runs and simulations, which Python identifies by numbers. A run writes files; a driven simulation is
!> advanced row by row and writes none. f2py does not wrap this module, because it does not support derived types.
module run_handles
   use case_run, only : run_type
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use asperity_simulation, only : simulation_type
   use text_tools, only : to_text
   implicit none
   private

   public :: driven_of, driven_type, find_driven, find_run, find_sim, free_handle, new_driven, new_run, run_of

   integer, parameter :: most = 64      !! runs at a time, and simulations
   character(*), parameter :: closed_simulation = 'the simulation is closed'

   !> A simulation, with its settings before it was steered.
   type :: driven_type
      type(simulation_type) :: sim
      character(:), allocatable :: settings      !! settings that must agree with a saved state
      real(dp), allocatable :: start_tau(:)      !! relaxation times of the case, s
      real(dp) :: start_temperature = 0.0_dp     !! C
   end type driven_type

   !> The run or the simulation of a handle, or neither.
   type :: slot_type
      type(run_type), pointer :: run => null()
      type(driven_type), pointer :: driven => null()
      integer :: handle = 0
   end type slot_type

   type(slot_type), target :: slots(2*most)
   integer :: last_handle = 0           !! handles are never reused, so that an old one finds nothing

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

   !> Give a free slot a new handle; 0 and null if there are too many.
   subroutine new_slot(what, handle, slot, error)
      character(*), intent(in) :: what             !! what it is for, for messages
      integer, intent(out) :: handle
      type(slot_type), pointer, intent(out) :: slot
      type(error_type), allocatable, intent(out) :: error

      handle = 0
      slot => slot_of(0)
      if (.not. associated(slot)) then
         call fail(error, error_input, 'more than '//to_text(size(slots))//' runs and simulations are open at a time: '// &
            'close some '//what)
         return
      end if
      last_handle = last_handle + 1
      slot%handle = last_handle
      handle = last_handle
   end subroutine new_slot

   !> Make a run.
   subroutine new_run(handle, run, error)
      integer, intent(out) :: handle               !! 0 after an error
      type(run_type), pointer, intent(out) :: run
      type(error_type), allocatable, intent(out) :: error
      type(slot_type), pointer :: slot

      run => null()
      call new_slot('runs', handle, slot, error)
      if (allocated(error)) return
      allocate (slot%run)
      run => slot%run
   end subroutine new_run

   !> Make a simulation.
   subroutine new_driven(handle, driven, error)
      integer, intent(out) :: handle               !! 0 after an error
      type(driven_type), pointer, intent(out) :: driven
      type(error_type), allocatable, intent(out) :: error
      type(slot_type), pointer :: slot

      driven => null()
      call new_slot('simulations', handle, slot, error)
      if (allocated(error)) return
      allocate (slot%driven)
      driven => slot%driven
   end subroutine new_driven

   !> The run of a handle; null if the handle is not that of a run.
   function run_of(handle) result(run)
      integer, intent(in) :: handle
      type(run_type), pointer :: run
      type(slot_type), pointer :: slot

      run => null()
      if (handle <= 0) return
      slot => slot_of(handle)
      if (associated(slot)) run => slot%run
   end function run_of

   !> The simulation of a handle; null if the handle is not that of a simulation.
   function driven_of(handle) result(driven)
      integer, intent(in) :: handle
      type(driven_type), pointer :: driven
      type(slot_type), pointer :: slot

      driven => null()
      if (handle <= 0) return
      slot => slot_of(handle)
      if (associated(slot)) driven => slot%driven
   end function driven_of

   !> The run of a handle that must be in use.
   subroutine find_run(handle, run, error)
      integer, intent(in) :: handle
      type(run_type), pointer, intent(out) :: run
      type(error_type), allocatable, intent(out) :: error

      run => run_of(handle)
      if (.not. associated(run)) call fail(error, error_input, 'the run is closed')
   end subroutine find_run

   !> The simulation of a handle that must be in use.
   subroutine find_driven(handle, driven, error)
      integer, intent(in) :: handle
      type(driven_type), pointer, intent(out) :: driven
      type(error_type), allocatable, intent(out) :: error

      driven => driven_of(handle)
      if (.not. associated(driven)) call fail(error, error_input, closed_simulation)
   end subroutine find_driven

   !> The state behind a handle of either kind, which must be in use.
   subroutine find_sim(handle, sim, error)
      integer, intent(in) :: handle
      type(simulation_type), pointer, intent(out) :: sim
      type(error_type), allocatable, intent(out) :: error
      type(driven_type), pointer :: driven
      type(run_type), pointer :: run

      sim => null()
      driven => driven_of(handle)
      run => run_of(handle)
      if (associated(driven)) sim => driven%sim
      if (associated(run)) sim => run%sim
      if (.not. associated(sim)) call fail(error, error_input, closed_simulation)
   end subroutine find_sim

   !> Forget a run that is closed, or a simulation that is destroyed. A handle that is not in use is ignored.
   subroutine free_handle(handle)
      integer, intent(in) :: handle
      type(slot_type), pointer :: slot

      if (handle <= 0) return
      slot => slot_of(handle)
      if (.not. associated(slot)) return
      if (associated(slot%run)) deallocate (slot%run)
      if (associated(slot%driven)) deallocate (slot%driven)
      slot%handle = 0
   end subroutine free_handle

end module run_handles
