!> Calls from Python that concern the library as a whole or the input language. See `flat_runs` for the rules.
module flat_library
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use asperity_errors, only : error_type
   use asperity_signals, only : catch_stops, give_back_stops, stop_was_asked
   use asperity_threads, only : release_threads, set_threads, thread_count
   use asperity_surface, only : check_files
   use asperity_version, only : version_number
   use case_input, only : parse_case
   use case_report, only : check_report
   use case_settings, only : case_type
   use flat_answers, only : put_text, report
   use input_listing, only : input_table, list_values
   use stop_watch, only : begin_watch, end_watch
   implicit none
   private

   public :: await_interrupts, end_interrupts, input_check, input_groups, input_listed, library_version, &
      release_idle_threads, set_thread_count

contains

   !> Version of the library.
   subroutine library_version(text)
      character(len=32), intent(out) :: text

      text = version_number
   end subroutine library_version

   !> Use `n` threads from now on, or as many as the environment says if n is 0, and return their number.
   subroutine set_thread_count(n, used)
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: used

      call set_threads(int(n))
      used = thread_count()
   end subroutine set_thread_count

   !> End the idle threads, before the process is copied.
   subroutine release_idle_threads()

      call release_threads()
   end subroutine release_idle_threads

   !> From now on these signals ask the present solve to stop, instead of their usual action.
   subroutine await_interrupts(n, signals)
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: signals(n)             !! their numbers

      call catch_stops(signals)
      call begin_watch(stop_was_asked, 0.0_c_double)
   end subroutine await_interrupts

   !> Restore the actions that `await_interrupts` replaced. A signal that arrived in between is sent again.
   subroutine end_interrupts(n, signals)
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: signals(n)

      call end_watch()
      call give_back_stops(signals)
   end subroutine end_interrupts

   !> The table of the input's groups and variables, as `input_table` writes it.
   subroutine input_groups(most, buffer, length)
      integer(c_int), intent(in) :: most                       !! characters that the buffer holds
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length                    !! of the text; above `most`: none is written

      call put_text(input_table(), buffer, length)
   end subroutine input_groups

   !> The values of a text of namelists, as `list_values` writes them.
   subroutine input_listed(text, path, most, buffer, length, status, message)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: path                     !! for messages
      integer(c_int), intent(in) :: most
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      character(:), allocatable :: listing
      type(error_type), allocatable :: error

      length = 0
      call list_values(text, path, listing, error)
      if (.not. allocated(error)) call put_text(listing, buffer, length)
      call report(error, status, message)
   end subroutine input_listed

   !> The text that `asperity check` prints about an input.
   subroutine input_check(text, path, files, most, buffer, length, status, message)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: path                     !! where paths start, and for messages
      integer(c_int), intent(in) :: files                      !! 1: read the height maps, too
      integer(c_int), intent(in) :: most
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(case_type) :: case
      type(error_type), allocatable :: error

      length = 0
      call parse_case(text, path, case, error)
      if (.not. allocated(error) .and. files == 1) call check_files(case%grid, case%surfaces, error)
      if (.not. allocated(error)) call put_text(check_report(case), buffer, length)
      call report(error, status, message)
   end subroutine input_check

end module flat_library
