!> Collects the faults of an input file, each as `file: &group: what is wrong`.
module input_faults
   use asperity_errors, only : add_fault, error_input, error_type
   implicit none
   private

   public :: faults_type

   integer, parameter :: most_faults = 100     !! largest number of faults that are reported

   !> The faults so far.
   type :: faults_type
      character(:), allocatable :: path              !! path of the file, as given by the user
      type(error_type), allocatable :: error         !! unallocated if there is no fault
      integer :: count = 0
      logical :: hopeless = .false.                  !! the file is not a text: nothing else is checked
   contains
      procedure :: add
   end type faults_type

contains

   !> Add a fault.
   pure subroutine add(self, place, message)
      class(faults_type), intent(inout) :: self
      character(*), intent(in) :: place       !! '&group: name = value', '&group' or 'line 3'
      character(*), intent(in) :: message     !! what is allowed, or what is wrong

      self%count = self%count + 1
      if (self%count > most_faults) return
      if (self%count == most_faults) then
         call add_fault(self%error, error_input, self%path//': there are more faults, which are not shown')
      else
         call add_fault(self%error, error_input, self%path//': '//place//': '//message)
      end if
   end subroutine add

end module input_faults
