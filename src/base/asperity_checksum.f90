!> Checksums (CRC-64) of bytes, of a file and of a field.
!>
!> The polynomial is that of ECMA-182 with reflected bits, as in the xz file format (CRC-64/XZ): the
!> checksum of the nine bytes '123456789' is 995DC9BBDF1939FA. Such a checksum detects every error
!> that is confined to 64 neighbouring bits, and misses any other error with a probability of 2^-64.
!> `crc32_of_values` is the shorter CRC-32 of zlib, gzip and PNG, which other programs can compute.
!> Eight tables allow eight bytes to be processed at a time (Intel's "slicing by 8"). Only shifts and
!> exclusive ors are used, because Fortran's integers must not overflow.
module asperity_checksum
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : dp, int64, int8
   implicit none
   private

   public :: checksum_of_checksums, checksum_of_file, checksum_of_text, checksums_of_rows, &
      crc32_of_values, hexadecimal

   integer(int64), parameter :: polynomial = &
      ior(shiftl(int(z'C96C5795', int64), 32), int(z'D7870F42', int64))
   integer(int64), parameter :: short_polynomial = int(z'EDB88320', int64)
   integer(int64), parameter :: short_mask = int(z'FFFFFFFF', int64)
   integer, parameter :: block_words = 131072     !! words of 8 bytes per read, which makes 1 MiB

   integer(int64) :: table(0:255, 8)
   logical :: filled = .false.

contains

   !> Checksum of a file from a given byte to its end.
   subroutine checksum_of_file(path, first, sum, error)
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first           !! first byte that is included, from 1
      integer(int64), intent(out) :: sum
      type(error_type), allocatable, intent(out) :: error
      integer(int64), allocatable :: words(:)
      integer(int8), allocatable :: bytes(:)
      integer(int64) :: left, place
      integer :: unit, status, count

      call fill_table()
      sum = not(0_int64)
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
         action='read', iostat=status)
      if (status == 0) then
         allocate (words(block_words))
         inquire (unit=unit, size=left)
         left = max(left - first + 1, 0_int64)
         place = first
         do while (left >= 8 .and. status == 0)
            count = int(min(int(block_words, int64), left/8))
            read (unit, pos=place, iostat=status) words(:count)
            if (status == 0) call add_words(sum, words(:count))
            place = place + 8_int64*count
            left = left - 8_int64*count
         end do
         allocate (bytes(left))
         if (left > 0 .and. status == 0) read (unit, pos=place, iostat=status) bytes
         if (status == 0) call add_bytes(sum, bytes)
         close (unit)
      end if
      sum = not(sum)
      if (status /= 0) call fail(error, error_file, path//': cannot be read')
   end subroutine checksum_of_file

   !> Checksums of the rows of a field, or of a part of it.
   function checksums_of_rows(field) result(rows)
      real(dp), intent(in) :: field(:, :)           !! [nx, rows]
      integer(int64), allocatable :: rows(:)
      integer :: j

      call fill_table()
      allocate (rows(size(field, 2)))
      !$omp parallel do default(none) shared(field, rows) private(j)
      do j = 1, size(field, 2)
         rows(j) = not(0_int64)
         call add_words(rows(j), transfer(field(:, j), rows(:0), size(field, 1)))
      end do
   end function checksums_of_rows

   !> Checksum of a field from those of all its rows, which threads may compute separately.
   function checksum_of_checksums(nx, rows) result(sum)
      integer, intent(in) :: nx                     !! values of a row
      integer(int64), intent(in) :: rows(:)
      integer(int64) :: sum

      call fill_table()
      sum = not(0_int64)
      call add_words(sum, [int(nx, int64), int(size(rows), int64)])
      call add_words(sum, rows)
      sum = not(sum)
   end function checksum_of_checksums

   !> Checksum of the characters of a text.
   function checksum_of_text(text) result(sum)
      character(*), intent(in) :: text
      integer(int64) :: sum

      call fill_table()
      sum = not(0_int64)
      call add_bytes(sum, transfer(text, [0_int8], len(text)))
      sum = not(sum)
   end function checksum_of_text

   !> CRC-32 of values as a whole number below 2^32. Each value is eight bytes, the lowest first.
   pure function crc32_of_values(values) result(sum)
      real(dp), intent(in) :: values(:)
      integer(int64) :: sum
      integer(int64) :: word
      integer :: i, k

      sum = short_mask
      do i = 1, size(values)
         word = transfer(values(i), word)
         ! A row has few bytes, so that working bit by bit is fast enough and needs no table.
         do k = 0, 63
            if (btest(sum, 0) .neqv. btest(word, k)) then
               sum = ieor(shiftr(sum, 1), short_polynomial)
            else
               sum = shiftr(sum, 1)
            end if
         end do
      end do
      sum = ieor(sum, short_mask)
   end function crc32_of_values

   !> A checksum as sixteen hexadecimal digits.
   function hexadecimal(sum) result(text)
      integer(int64), intent(in) :: sum
      character(16) :: text

      write (text, '(z16.16)') sum
   end function hexadecimal

   !> Include further words of eight bytes, of which the first byte is the lowest, in a checksum.
   pure subroutine add_words(sum, words)
      integer(int64), intent(inout) :: sum
      integer(int64), intent(in) :: words(:)
      integer(int64) :: x
      integer :: i

      do i = 1, size(words)
         x = ieor(sum, words(i))
         sum = ieor(ieor(ieor(table(iand(x, 255_int64), 8), &
            table(iand(shiftr(x, 8), 255_int64), 7)), &
            ieor(table(iand(shiftr(x, 16), 255_int64), 6), &
            table(iand(shiftr(x, 24), 255_int64), 5))), &
            ieor(ieor(table(iand(shiftr(x, 32), 255_int64), 4), &
            table(iand(shiftr(x, 40), 255_int64), 3)), &
            ieor(table(iand(shiftr(x, 48), 255_int64), 2), &
            table(shiftr(x, 56), 1))))
      end do
   end subroutine add_words

   !> Include further single bytes in a checksum.
   pure subroutine add_bytes(sum, bytes)
      integer(int64), intent(inout) :: sum
      integer(int8), intent(in) :: bytes(:)
      integer :: i

      do i = 1, size(bytes)
         sum = ieor(table(iand(ieor(sum, int(bytes(i), int64)), 255_int64), 1), shiftr(sum, 8))
      end do
   end subroutine add_bytes

   !> Fill the tables at the first call. Several threads must not call this at the same time.
   subroutine fill_table()
      integer(int64) :: x
      integer :: i, k

      if (filled) return
      do i = 0, 255
         x = int(i, int64)
         do k = 1, 8
            if (btest(x, 0)) then
               x = ieor(shiftr(x, 1), polynomial)
            else
               x = shiftr(x, 1)
            end if
         end do
         table(i, 1) = x
      end do
      do k = 2, 8
         do i = 0, 255
            x = table(i, k - 1)
            table(i, k) = ieor(table(iand(x, 255_int64), 1), shiftr(x, 8))
         end do
      end do
      filled = .true.
   end subroutine fill_table

end module asperity_checksum
