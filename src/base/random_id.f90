!> An identifier for a file: random digits that, for all practical purposes, no other file has.
module random_id
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_checksum, only : checksum_of_text, hexadecimal
   use asperity_precision, only : int64
   use utc_clock, only : utc_time
   implicit none
   private

   public :: new_id

   interface
      function c_getpid() bind(c, name='getpid') result(number)
         import :: c_int
         integer(c_int) :: number
      end function c_getpid
   end interface

contains

   !> Make 32 hexadecimal digits from the system's source of random numbers, the clock and the number of
   !> the process. The last two distinguish files on a system without such a source.
   function new_id() result(id)
      character(32) :: id
      character(120) :: text
      integer(int64) :: random(2), ticks
      integer :: unit, status

      random = 0_int64
      open (newunit=unit, file='/dev/urandom', access='stream', form='unformatted', status='old', &
         action='read', iostat=status)
      if (status == 0) then
         read (unit, iostat=status) random
         close (unit)
      end if
      call system_clock(ticks)
      write (text, '(4(z16.16, ":"), a)') random, ticks, int(c_getpid(), int64), utc_time()
      id = hexadecimal(checksum_of_text(text(:60)//'1'//text(61:)))// &
         hexadecimal(checksum_of_text('2'//text))
   end function new_id

end module random_id
