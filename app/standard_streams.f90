!> Standard output and standard error. They are written with the system's own call, which reports
!> failures.
module standard_streams
   use asperity_errors, only : error_file, error_type, fail
   use, intrinsic :: iso_c_binding, only : c_int, c_size_t
   use system_calls, only : c_write
   implicit none
   private

   public :: say, say_error, say_warnings

contains

   !> Write a text to standard output.
   subroutine say(text, error)
      character(*), intent(in) :: text                         !! with its line ends
      type(error_type), allocatable, intent(out) :: error
      logical :: written

      call write_all(1_c_int, text, written)
      if (.not. written) call fail(error, error_file, 'asperity: standard output cannot be written')
   end subroutine say

   !> Write lines to standard error. A failure is ignored, because there is nowhere to report it.
   subroutine say_error(text)
      character(*), intent(in) :: text                         !! without its last line end
      logical :: written

      call write_all(2_c_int, text//new_line('a'), written)
   end subroutine say_error

   !> Write warnings to standard error, each of which begins with the word, so that nobody takes it for an error.
   subroutine say_warnings(lines)
      character(*), intent(in) :: lines                        !! one per line, without the last line end
      integer :: first, last

      first = 1
      do while (first <= len(lines))
         last = first + index(lines(first:)//new_line('a'), new_line('a')) - 2
         call say_error('warning: '//lines(first:last))
         first = last + 2
      end do
   end subroutine say_warnings

   !> Write a text completely, in as many calls as that takes.
   subroutine write_all(descriptor, text, written)
      integer(c_int), intent(in) :: descriptor
      character(*), intent(in) :: text
      logical, intent(out) :: written
      integer(c_size_t) :: count, done

      written = .false.
      done = 0
      do while (done < len(text))
         count = c_write(descriptor, text(done + 1:), len(text) - done)
         if (count < 1) return
         done = done + count
      end do
      written = .true.
   end subroutine write_all

end module standard_streams
