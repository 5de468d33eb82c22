!> The filters of HDF5 for the bytes of a chunk: shuffle, deflate, and the checksum of Fletcher.
!>
!> HDF5 itself filters one chunk after the other. These procedures produce the same format, which every
!> reader of HDF5 understands, but several threads can call them for different chunks.
!>
!> * Shuffle: the first bytes of all values come first, then all second bytes, and so on. A plane, in this
!>   module, consists of the bytes at one position in all values of a chunk.
!> * Deflate: a stream of zlib. The lower planes of a field of reals are nearly random: deflate would spend
!>   most of its time on them and save nothing. A plane of which deflate is expected to save less than the
!>   fraction `worthwhile` is therefore stored without compression (level 0 of zlib), which is 10 times as
!>   fast. If only shorter codes for frequent bytes save something, deflate does not search for references
!>   (Huffman's codes only), which is 3 times as fast.
!> * Fletcher: a checksum of 32 bits after the bytes, as the manual of HDF5 defines it: two sums modulo
!>   65535 over words of 16 bits with the high byte first.
!>
!> The resulting bytes depend only on the values and the level, and not on the number of threads.
module chunk_filters
   use, intrinsic :: iso_c_binding, only : c_int, c_loc
   use asperity_precision, only : dp, int64, int8
   use zlib_library, only : deflate, deflate_end, deflate_params, start_deflate, stream_type, z_default_strategy, &
      z_finish, z_huffman_only, z_no_flush, z_ok, z_stream_end
   implicit none
   private

   public :: expect_gain, filter_chunk, fletcher32

   real(dp), parameter :: worthwhile = 1.0_dp/16.0_dp  !! fraction of a plane that deflate must save
   integer, parameter :: samples = 16384               !! bytes of a plane that are examined
   integer, parameter :: window = 32768                !! bytes back to which deflate can refer
   integer, parameter :: slots = 4096                  !! size of the table of positions

contains

   !> Apply all filters to the values of a chunk.
   subroutine filter_chunk(values, level, stored, length, success)
      integer(int8), intent(in), contiguous :: values(:, :)   !! [bytes of a value, values]
      integer, intent(in) :: level                 !! level of deflate, 1 to 9; 0: neither shuffle nor deflate
      integer(int8), allocatable, intent(inout) :: stored(:)
      integer, intent(out) :: length               !! length of the stored bytes
      logical, intent(out) :: success              !! false if there was not enough memory
      integer(int8), allocatable :: planes(:, :)
      integer :: status

      length = 0
      call make_room(stored, size(values), success)
      if (.not. success) return
      if (level == 0) then
         length = size(values)
         stored(:length) = reshape(values, [length])
      else
         allocate (planes(size(values, 2), size(values, 1)), stat=status)
         success = status == 0
         if (.not. success) return
         call shuffle(values, planes)
         call deflate_planes(planes, level, stored, length, success)
         if (.not. success) return
      end if
      call append_sum(stored, length)
   end subroutine filter_chunk

   !> Make an array large enough for the filtered form of any chunk of the given length.
   subroutine make_room(stored, bytes, success)
      integer(int8), allocatable, intent(inout) :: stored(:)
      integer, intent(in) :: bytes
      logical, intent(out) :: success
      integer :: needed, status

      ! Deflate adds 5 bytes to each block that it stores, and some at the ends of planes.
      needed = bytes + bytes/100 + 1024
      success = .true.
      if (allocated(stored)) then
         if (size(stored) >= needed) return
         deallocate (stored)
      end if
      allocate (stored(needed), stat=status)
      success = status == 0
   end subroutine make_room

   !> Sort the bytes of the values into planes.
   pure subroutine shuffle(values, planes)
      integer(int8), intent(in), contiguous :: values(:, :)     !! [bytes of a value, values]
      integer(int8), intent(out), contiguous :: planes(:, :)    !! [values, bytes of a value]
      integer, parameter :: some = 512                 !! values whose bytes fit into the cache
      integer :: b, i, start

      do start = 1, size(values, 2), some
         do b = 1, size(values, 1)
            do i = start, min(start + some - 1, size(values, 2))
               planes(i, b) = values(b, i)
            end do
         end do
      end do
   end subroutine shuffle

   !> Compress planes into one stream.
   subroutine deflate_planes(planes, level, stored, length, success)
      integer(int8), intent(in), contiguous, target :: planes(:, :)    !! [values, bytes of a value]
      integer, intent(in) :: level
      integer(int8), intent(inout), contiguous, target :: stored(:)
      integer, intent(out) :: length               !! length of the stream in bytes
      logical, intent(out) :: success
      type(stream_type), target :: stream
      integer(c_int) :: status, ignored, wanted, strategy
      real(dp) :: gain
      logical :: by_codes_alone
      integer :: b, last

      length = 0
      success = start_deflate(stream, level) == z_ok
      if (.not. success) return
      stream%next_out = c_loc(stored)
      stream%avail_out = int(size(stored), c_int)
      last = size(planes, 2)
      do b = 1, last
         call expect_gain(planes(:, b), gain, by_codes_alone)
         wanted = 0
         if (gain >= worthwhile) wanted = int(level, c_int)
         strategy = merge(z_huffman_only, z_default_strategy, by_codes_alone)
         ! deflateParams first completes what was added to the stream at the previous level.
         status = deflate_params(stream, wanted, strategy)
         stream%next_in = c_loc(planes(1, b))
         stream%avail_in = int(size(planes, 1), c_int)
         if (status == z_ok) status = deflate(stream, merge(z_finish, z_no_flush, b == last))
         success = status == merge(z_stream_end, z_ok, b == last) .and. stream%avail_in == 0
         if (.not. success) exit
      end do
      length = int(stream%total_out)
      ignored = deflate_end(stream)
   end subroutine deflate_planes

   !> Estimate from a sample the fraction of a plane that deflate would save: by shorter codes for frequent
   !> bytes (entropy), by runs of one byte, or by references to earlier bytes.
   pure subroutine expect_gain(plane, gain, by_codes_alone)
      integer(int8), intent(in), contiguous :: plane(:)
      real(dp), intent(out) :: gain
      !> Runs and references would save little, because equal bytes follow each other hardly more often than in
      !> random order.
      logical, intent(out) :: by_codes_alone
      real(dp) :: alike, repeated
      integer :: counts(-128:127), i, n, rarest, runs, step
      real(dp) :: entropy

      ! The step is odd, because an even step would always hit the same bytes of a short pattern.
      step = max(1, size(plane)/samples)
      if (mod(step, 2) == 0) step = step + 1
      counts = 0
      runs = 0
      n = 0
      do i = 1, size(plane) - 1, step
         n = n + 1
         counts(plane(i)) = counts(plane(i)) + 1
         if (plane(i) == plane(i + 1)) runs = runs + 1
      end do
      gain = 1.0_dp
      by_codes_alone = .false.
      if (n == 0) return

      entropy = 0.0_dp
      do i = -128, 127
         if (counts(i) > 0) entropy = entropy + counts(i)*log(real(n, dp)/counts(i))
      end do
      gain = max(1.0_dp - entropy/(n*log(256.0_dp)), real(runs, dp)/n)

      ! Huffman's codes have at least one bit for each byte, so that a plane of mostly one byte needs runs.
      alike = sum((real(counts, dp)/n)**2)
      if (alike > 0.5_dp .or. runs - alike*n > worthwhile*n) return
      rarest = minloc(counts, 1, counts > 0) - 129
      repeated = repeated_part(plane, int(rarest, int8))
      gain = max(gain, repeated)
      by_codes_alone = repeated < worthwhile
   end subroutine expect_gain

   !> Estimate the fraction of a plane that repeats earlier bytes within the window. Only the positions of
   !> one given byte are examined: in a repeated sequence they recur at the same distances.
   pure function repeated_part(plane, mark) result(part)
      integer(int8), intent(in), contiguous :: plane(:)
      integer(int8), intent(in) :: mark
      real(dp) :: part
      integer :: before, i, marks, places(0:slots - 1), repeated, slot

      places = -window
      marks = 0
      repeated = 0
      do i = 1, size(plane) - 7
         if (plane(i) /= mark) cycle
         marks = marks + 1
         slot = iand(ieor(int(plane(i + 1)), shiftl(int(plane(i + 2)), 4)), slots - 1)
         before = places(slot)
         places(slot) = i
         if (i - before >= window) cycle
         if (all(plane(before:before + 7) == plane(i:i + 7))) repeated = repeated + 1
      end do
      part = 0.0_dp
      if (marks > 0) part = real(repeated, dp)/marks
   end function repeated_part

   !> Append the checksum to the stored bytes, the lowest byte first.
   subroutine append_sum(stored, length)
      integer(int8), intent(inout), contiguous :: stored(:)
      integer, intent(inout) :: length
      integer(int64) :: sum
      integer :: i

      sum = fletcher32(stored(:length))
      do i = 1, 4
         stored(length + i) = as_byte(iand(shiftr(sum, 8*(i - 1)), 255_int64))
      end do
      length = length + 4
   end subroutine append_sum

   !> Convert a number from 0 to 255 to the byte with the same bits.
   pure function as_byte(number) result(byte)
      integer(int64), intent(in) :: number
      integer(int8) :: byte

      byte = int(number - merge(256, 0, number > 127), int8)
   end function as_byte

   !> The checksum of HDF5's filter, a number below 2^32.
   pure function fletcher32(bytes) result(sum)
      integer(int8), intent(in), contiguous :: bytes(:)
      integer(int64) :: sum
      integer, parameter :: some = 65536              !! number of words after which the sums are reduced
      integer(int64) :: first, second, word
      integer :: i, start, words

      first = 0
      second = 0
      words = size(bytes)/2
      do start = 1, words, some
         do i = start, min(start + some - 1, words)
            word = ior(shiftl(iand(int(bytes(2*i - 1), int64), 255_int64), 8), &
               iand(int(bytes(2*i), int64), 255_int64))
            first = first + word
            second = second + first
         end do
         first = reduced(first)
         second = reduced(second)
      end do
      if (mod(size(bytes), 2) == 1) then
         first = reduced(first + shiftl(iand(int(bytes(size(bytes)), int64), 255_int64), 8))
         second = reduced(second + first)
      end if
      sum = ior(shiftl(second, 16), first)
   end function fletcher32

   !> A sum modulo 65535. Zero is represented by 65535, unless all terms are zero.
   pure function reduced(sum) result(rest)
      integer(int64), intent(in) :: sum
      integer(int64) :: rest

      rest = mod(sum, 65535_int64)
      if (rest == 0 .and. sum > 0) rest = 65535
   end function reduced

end module chunk_filters
