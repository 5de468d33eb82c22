!> Errors that concern all processes of a run.
!>
!> A fault may occur on one process only: only the first one reads and writes files, and any of them may run
!> out of memory. If this process returned while the others continued, they would wait for it for ever in the
!> next exchange. Therefore every process calls `agree` where one of them may have failed,
!> and all of them continue, or all of them return.
module process_agreement
   use asperity_errors, only : error_type, fail
   use asperity_parallel, only : global_min, global_sum, is_first_process, process_count, process_number, &
      share
   use process_exchange, only : hand_to_first
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: agree

contains

   !> Give all processes the error of the first process that has one. Collective.
   subroutine agree(error)
      type(error_type), allocatable, intent(inout) :: error
      character(:), allocatable :: message
      integer :: failing, length, status
      logical :: mine

      if (process_count() == 1) return
      failing = process_count()
      if (allocated(error)) failing = process_number()
      failing = nint(global_min(real(failing, dp)))
      if (failing == process_count()) return

      mine = failing == process_number()
      status = 0
      length = 0
      if (mine) then
         status = error%status
         length = len(error%message)
      end if
      status = global_sum(status)
      length = global_sum(length)
      message = repeat(' ', length)
      if (mine) message = error%message
      call bring_text(failing, message)
      call share(message)
      call fail(error, status, message)
   end subroutine agree

   !> Bring a text from a process to the first one. Both know its length.
   subroutine bring_text(from, text)
      integer, intent(in) :: from
      character(*), intent(inout) :: text
      integer(int8), allocatable :: letters(:, :)
      integer :: i

      allocate (letters(len(text), 1))
      do i = 1, len(text)
         letters(i, 1) = transfer(text(i:i), letters(i, 1))
      end do
      call hand_to_first(from, letters)
      if (.not. is_first_process()) return
      do i = 1, len(text)
         text(i:i) = transfer(letters(i, 1), text(i:i))
      end do
   end subroutine bring_text

end module process_agreement
