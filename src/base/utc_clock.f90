!> The date and time in UTC, which is the same everywhere.
module utc_clock
   implicit none
   private

   public :: utc_time

contains

   !> The present date and time in UTC, as ISO 8601.
   function utc_time() result(text)
      character(20) :: text
      integer :: values(8), days, minutes, year, month, day, length
      integer, parameter :: month_days(12) = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]

      call date_and_time(values=values)
      year = values(1)
      month = values(2)
      day = values(3)
      minutes = 60*values(5) + values(6) - values(4)
      days = 0
      if (minutes < 0) days = -1
      if (minutes >= 1440) days = 1
      minutes = minutes - 1440*days

      day = day + days
      if (day < 1) then
         month = month - 1
         if (month < 1) then
            month = 12
            year = year - 1
         end if
         day = last_day()
      end if

      length = last_day()
      if (day > length) then
         day = 1
         month = month + 1
         if (month > 12) then
            month = 1
            year = year + 1
         end if
      end if
      write (text, '(i4.4, "-", i2.2, "-", i2.2, "T", i2.2, ":", i2.2, ":", i2.2, "Z")') &
         year, month, day, minutes/60, mod(minutes, 60), values(7)

   contains

      !> Number of days in the month.
      integer function last_day()
         last_day = month_days(month)
         if (month /= 2) return
         if (mod(year, 4) == 0 .and. (mod(year, 100) /= 0 .or. mod(year, 400) == 0)) last_day = 29
      end function last_day

   end function utc_time

end module utc_clock
