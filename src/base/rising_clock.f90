!> A clock that never runs backwards, unlike the time of day.
module rising_clock
   use asperity_precision, only : dp, int64
   implicit none
   private

   public :: seconds_now

contains

   !> The time since some moment in the past, s.
   function seconds_now() result(seconds)
      real(dp) :: seconds
      integer(int64) :: count, rate

      call system_clock(count, rate)
      seconds = real(count, dp)/real(rate, dp)
   end function seconds_now

end module rising_clock
