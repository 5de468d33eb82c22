!> The wall time that a run may take, and the decision whether it is sufficient for another step.
!>
!> The limit is given (`--time-limit`), or it is the end of the job that Slurm states in the environment variable
!> SLURM_JOB_END_TIME. A run must stop before the limit, with time for its checkpoint. The reserve is twice the
!> longest step so far (including its output), plus twice the longest checkpoint, plus a twentieth of the limit or
!> half a minute, whichever is less.
module time_limit
   use, intrinsic :: iso_c_binding, only : c_long
   use asperity_precision, only : dp, int64
   use rising_clock, only : seconds_now
   implicit none
   private

   public :: read_duration, time_limit_type

   !> The limit of a run.
   type :: time_limit_type
      logical :: limited = .false.
      character(:), allocatable :: remark        !! why the limit of Slurm does not hold, if so
      real(dp), private :: finish = 0.0_dp       !! on the clock of `seconds_now`, s
      real(dp), private :: margin = 0.0_dp       !! s
      real(dp), private :: longest_step = 0.0_dp !! s
      real(dp), private :: longest_save = 0.0_dp !! s
   contains
      procedure :: start
      procedure :: note
      procedure :: is_near
      procedure :: has_come
   end type time_limit_type

   interface
      function c_time(address) bind(c, name='time') result(seconds)
         import :: c_long
         integer(c_long), value :: address       !! null: only the result is needed
         integer(c_long) :: seconds
      end function c_time
   end interface

contains

   !> Start the clock.
   subroutine start(self, seconds)
      class(time_limit_type), intent(inout) :: self
      real(dp), intent(in) :: seconds            !! from now on; below 0: use the limit of Slurm, if any
      real(dp) :: left
      character(40) :: text
      integer(int64) :: finish
      integer :: status

      left = seconds
      if (left < 0.0_dp) then
         call get_environment_variable('SLURM_JOB_END_TIME', text, status=status)
         if (status /= 0) return
         read (text, *, iostat=status) finish
         if (status /= 0) then
            self%remark = 'SLURM_JOB_END_TIME = '//trim(text)//': must be a number of seconds since 1970: without '// &
               'it the run has no time limit (--time-limit gives one)'
            return
         end if
         left = real(finish - c_time(0_c_long), dp)
      end if
      self%limited = .true.
      self%finish = seconds_now() + left
      self%margin = min(30.0_dp, 0.05_dp*max(left, 0.0_dp))
   end subroutine start

   !> Note how long steps and checkpoints have taken.
   subroutine note(self, longest_step, longest_save)
      class(time_limit_type), intent(inout) :: self
      real(dp), intent(in) :: longest_step       !! so far, with its output, s
      real(dp), intent(in) :: longest_save       !! so far, s

      self%longest_step = longest_step
      self%longest_save = longest_save
   end subroutine note

   !> Is there no time for another step and a checkpoint?
   function is_near(self) result(near)
      class(time_limit_type), intent(in) :: self
      logical :: near

      near = .false.
      if (self%limited) near = seconds_now() + self%margin + 2.0_dp*(self%longest_step + &
         self%longest_save) > self%finish
   end function is_near

   !> Is there only just enough time for a checkpoint?
   function has_come(self) result(come)
      class(time_limit_type), intent(in) :: self
      logical :: come

      come = .false.
      if (self%limited) come = seconds_now() + self%margin + 2.0_dp*self%longest_save > self%finish
   end function has_come

   !> Read a duration as Slurm writes it: M, M:S, H:M:S, D-H, D-H:M or D-H:M:S.
   subroutine read_duration(text, seconds, valid)
      character(*), intent(in) :: text
      real(dp), intent(out) :: seconds           !! s
      logical, intent(out) :: valid
      character(:), allocatable :: rest
      real(dp) :: days, parts(3)
      integer :: count, dash, colon, status
      logical :: last

      seconds = 0.0_dp
      days = 0.0_dp
      parts = 0.0_dp
      rest = trim(text)
      valid = .false.
      if (verify(rest, '0123456789:-') /= 0 .or. len(rest) == 0 .or. len(rest) > 20) return

      dash = index(rest, '-')
      if (dash > 0) then
         if (.not. is_number(rest(:dash - 1))) return
         read (rest(:dash - 1), *, iostat=status) days
         rest = rest(dash + 1:)
      end if

      count = 0
      last = .false.
      do while (.not. last)
         colon = index(rest, ':')
         last = colon == 0
         if (last) colon = len(rest) + 1
         if (count == 3 .or. .not. is_number(rest(:colon - 1))) return
         count = count + 1
         read (rest(:colon - 1), *, iostat=status) parts(count)
         if (.not. last) rest = rest(colon + 1:)
      end do

      if (dash > 0 .or. count == 3) then
         seconds = 86400.0_dp*days + 3600.0_dp*parts(1) + 60.0_dp*parts(2) + parts(3)
      else
         seconds = 60.0_dp*parts(1) + parts(2)
      end if
      valid = seconds > 0.0_dp
   end subroutine read_duration

   !> Are these digits, at least one and not too many?
   pure function is_number(text) result(yes)
      character(*), intent(in) :: text
      logical :: yes

      yes = len(text) > 0 .and. len(text) < 10 .and. verify(text, '0123456789') == 0
   end function is_number

end module time_limit
