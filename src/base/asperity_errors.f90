!> Errors as values: every procedure that can fail has a last argument
!> `type(error_type), allocatable, intent(out) :: error`, left unallocated on success. Procedures that are
!> called in sequence may declare it `intent(inout)`: they do nothing if it is already set, so that the
!> caller checks it once, after the last call. Do not mix the two kinds in one sequence, because
!> `intent(out)` clears an earlier error.
module asperity_errors
   implicit none
   private

   public :: error_type, fail, add_fault

   !> Kinds of errors. All values but the last are the exit statuses of the program.
   integer, parameter, public :: error_input = 2          !! the user's input is wrong
   integer, parameter, public :: error_file = 3           !! a file cannot be read or written
   integer, parameter, public :: error_convergence = 4    !! a solver did not converge
   !> There is not enough memory. The program ends with the status of `error_file`, and Python raises
   !> MemoryError.
   integer, parameter, public :: error_memory = 5

   !> An error. Its message says what is wrong and where, which value was found and which are
   !> allowed.
   type :: error_type
      integer :: status = error_input          !! one of the parameters above
      character(:), allocatable :: message     !! one line per fault, separated by new_line('a')
   end type error_type

contains

   !> Set an error.
   pure subroutine fail(error, status, message)
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in) :: status              !! one of the parameters above
      character(*), intent(in) :: message

      allocate (error)
      error%status = status
      error%message = message
   end subroutine fail

   !> Add a fault to an error that may already contain others, so that all are reported together.
   !> The status is that of the first fault.
   pure subroutine add_fault(error, status, message)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: status
      character(*), intent(in) :: message

      if (allocated(error)) then
         error%message = error%message//new_line('a')//message
      else
         allocate (error)
         error%status = status
         error%message = message
      end if
   end subroutine add_fault

end module asperity_errors
