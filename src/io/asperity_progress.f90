!> The progress of a run. On a terminal it is one line that is overwritten, and that fits in 80 columns: a longer one
!> would begin a new line each time. Elsewhere a line with more numbers is printed from time to time.
module asperity_progress
   use, intrinsic :: iso_fortran_env, only : error_unit
   use file_system, only : is_terminal
   use history_row, only : history_row_type
   use asperity_precision, only : dp, int64
   use rising_clock, only : seconds_now
   use text_tools, only : to_text
   implicit none
   private

   public :: progress_type, progress_line, duration_text

   real(dp), parameter :: terminal_interval = 0.2_dp  !! least time between lines on a terminal, s
   real(dp), parameter :: plain_interval = 10.0_dp    !! the same elsewhere, s
   integer, parameter :: standard_error = 2           !! its descriptor

   !> The progress of one run.
   type :: progress_type
      private
      logical :: quiet = .true.
      logical :: terminal = .false.
      logical :: pending = .false.                    !! the last row has not been shown
      integer :: rows = 0                             !! of the whole history
      integer :: first_step = 0                       !! the first row of this run
      integer :: shown_length = 0                     !! characters of the line on the terminal
      real(dp) :: started = 0.0_dp                    !! when the run started, on the clock of `seconds_now`, s
      real(dp) :: shown = 0.0_dp                      !! when a line was shown last, s
      type(history_row_type) :: row                   !! the last one
   contains
      procedure :: start
      procedure :: update
      procedure :: finish
      procedure, private :: show
   end type progress_type

contains

   !> Start, without showing anything yet.
   subroutine start(self, rows, first_step, quiet)
      class(progress_type), intent(inout) :: self
      integer, intent(in) :: rows           !! rows of the history when it is complete
      integer, intent(in) :: first_step     !! 0, or the first row of a run that is continued
      logical, intent(in) :: quiet          !! show nothing

      self%quiet = quiet
      self%terminal = is_terminal(standard_error)
      self%pending = .false.
      self%rows = rows
      self%first_step = first_step
      self%shown_length = 0
      self%started = seconds_now()
      self%shown = self%started
   end subroutine start

   !> Note a step that is done, and show it if the last line is old enough.
   subroutine update(self, row)
      class(progress_type), intent(inout) :: self
      type(history_row_type), intent(in) :: row
      real(dp) :: now

      if (self%quiet) return
      self%row = row
      self%pending = .true.
      now = seconds_now()
      if (now - self%shown >= merge(terminal_interval, plain_interval, self%terminal)) &
         call self%show(now)
   end subroutine update

   !> Show the last step and end the line, because the run is over or a message follows.
   subroutine finish(self)
      class(progress_type), intent(inout) :: self
      integer :: unread

      if (self%quiet) return
      if (self%pending) call self%show(seconds_now())
      if (self%terminal .and. self%shown_length > 0) write (error_unit, '(a)', iostat=unread) ''
      self%shown_length = 0
   end subroutine finish

   !> Show the last row. A line that cannot be written, because nobody reads it any more, is lost.
   subroutine show(self, now)
      class(progress_type), intent(inout) :: self
      real(dp), intent(in) :: now           !! s
      character(:), allocatable :: line
      integer :: length, unread

      line = progress_line(self%row, self%rows, self%first_step, now - self%started, short=self%terminal)
      length = len(line)
      if (self%terminal) then
         line = char(13)//line//repeat(' ', max(0, self%shown_length - length))
         write (error_unit, '(a)', advance='no', iostat=unread) line
      else
         write (error_unit, '(a)', iostat=unread) line
      end if
      flush (error_unit, iostat=unread)
      self%shown_length = length
      self%shown = now
      self%pending = .false.
   end subroutine show

   !> The line of progress for a row.
   pure function progress_line(row, rows, first_step, elapsed, short) result(line)
      type(history_row_type), intent(in) :: row
      integer, intent(in) :: rows           !! rows of the history when it is complete
      integer, intent(in) :: first_step     !! the first row of this run
      real(dp), intent(in) :: elapsed       !! time since the start of this run, s
      logical, intent(in) :: short          !! for a terminal, without iterations and rate
      character(:), allocatable :: line
      character(:), allocatable :: time_mark
      character(120) :: text
      real(dp) :: rate
      integer :: done

      time_mark = '  time '
      if (short) time_mark = '  '
      write (text, '("step ", i0, "/", i0, a, es9.3, " s  area ", f6.4, "  friction ", f7.4)') row%step, &
         max(rows - 1, row%step), time_mark, row%time, row%contact_area, row%friction
      line = trim(text)
      if (.not. short) line = line//'  iterations '//to_text(row%iterations_normal)//'+'//to_text(row%iterations_tangential)
      done = row%step - first_step + 1
      if (elapsed <= 0.0_dp .or. done < 1) return
      rate = done/elapsed
      if (rate >= 1.0_dp) then
         write (text, '(f0.1, " steps/s")') rate
      else
         write (text, '(f0.1, " s/step")') 1.0_dp/rate
      end if
      if (.not. short) line = line//'  '//trim(text)
      if (row%step < rows - 1) line = line//'  '//duration_text((rows - 1 - row%step)/rate)//' left'
   end function progress_line

   !> A duration in its two largest units.
   pure function duration_text(seconds) result(text)
      real(dp), intent(in) :: seconds       !! 0 or more
      character(:), allocatable :: text
      character(40) :: buffer
      integer(int64) :: whole

      whole = nint(min(seconds, 1.0e15_dp), int64)
      if (whole < 60) then
         write (buffer, '(i0, " s")') whole
      else if (whole < 3600) then
         write (buffer, '(i0, " min ", i0, " s")') whole/60, mod(whole, 60_int64)
      else if (whole < 86400) then
         write (buffer, '(i0, " h ", i0, " min")') whole/3600, mod(whole, 3600_int64)/60
      else
         write (buffer, '(i0, " d ", i0, " h")') whole/86400, mod(whole, 86400_int64)/3600
      end if
      text = trim(buffer)
   end function duration_text

end module asperity_progress
