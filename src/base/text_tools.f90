!> Converts words and numbers to text for messages.
module text_tools
   use asperity_precision, only : dp, int64
   implicit none
   private

   public :: add_line, exact_text, in_one_line, in_quotes, lower, nearest_name, next_line, rounded_text, to_text

   !> Convert a number to a short text.
   interface to_text
      module procedure :: text_of_integer, text_of_long, text_of_real
   end interface to_text

contains

   !> Add a line to a text, which may be empty.
   pure subroutine add_line(text, line)
      character(:), allocatable, intent(inout) :: text
      character(*), intent(in) :: line

      if (len(text) > 0) text = text//new_line('a')
      text = text//line
   end subroutine add_line

   !> Take the line of a text that starts at `at`, and move `at` to the start of the line after it. The text has no
   !> more lines when `at` is beyond its end.
   pure subroutine next_line(text, at, line)
      character(*), intent(in) :: text
      integer, intent(inout) :: at          !! 1 for the first line
      character(:), allocatable, intent(out) :: line
      integer :: length

      length = index(text(at:), new_line('a')) - 1
      if (length < 0) length = len(text) - at + 1
      line = text(at:at + length - 1)
      at = at + length + 1
   end subroutine next_line

   !> A text as a string of an input, in quotes; a quote inside is doubled.
   pure function in_quotes(text) result(string)
      character(*), intent(in) :: text
      character(:), allocatable :: string
      integer :: i

      string = ''''
      do i = 1, len(text)
         string = string//text(i:i)
         if (text(i:i) == '''') string = string//''''
      end do
      string = string//''''
   end function in_quotes

   !> The word with its ASCII letters in lower case.
   pure function lower(word) result(lowered)
      character(*), intent(in) :: word
      character(len(word)) :: lowered
      integer :: i

      do i = 1, len(word)
         select case (word(i:i))
         case ('A':'Z')
            lowered(i:i) = achar(iachar(word(i:i)) + 32)
         case default
            lowered(i:i) = word(i:i)
         end select
      end do
   end function lower

   !> The candidate that is most like a word, for messages such as 'did you mean ...'; '' if no candidate is like it.
   pure function nearest_name(word, candidates) result(name)
      character(*), intent(in) :: word             !! as typed
      character(*), intent(in) :: candidates(:)    !! lower case, padded with blanks
      character(:), allocatable :: name
      integer :: best, distance, i

      name = ''
      best = max(1, len_trim(word)/2)
      do i = 1, size(candidates)
         if (abs(len_trim(candidates(i)) - len_trim(word)) > best) cycle
         distance = edit_distance(lower(trim(word)), trim(candidates(i)))
         if (distance < best .or. (distance == best .and. name == '')) then
            best = distance
            name = trim(candidates(i))
         end if
      end do
      if (name /= '') return

      ! The word may be an abbreviation, as 'tol' for 'tolerance'.
      if (len_trim(word) < 2) return
      do i = 1, size(candidates)
         if (index(trim(candidates(i)), lower(trim(word))) == 1) then
            name = trim(candidates(i))
            return
         end if
      end do
   end function nearest_name

   !> Number of single-letter insertions, deletions, replacements and swaps of neighbours between
   !> two words.
   pure function edit_distance(a, b) result(distance)
      character(*), intent(in) :: a, b
      integer :: distance
      integer :: row(0:len(b)), previous(0:len(b)), before(-1:len(b))
      integer :: cost, i, j

      before = 0
      previous = [(j, j = 0, len(b))]
      row = previous
      do i = 1, len(a)
         row(0) = i
         do j = 1, len(b)
            cost = merge(0, 1, a(i:i) == b(j:j))
            row(j) = min(previous(j) + 1, row(j - 1) + 1, previous(j - 1) + cost)
            if (i > 1 .and. j > 1) then
               if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) then
                  row(j) = min(row(j), before(j - 2) + 1)
               end if
            end if
         end do
         before(0:) = previous
         previous = row
      end do
      distance = row(len(b))
   end function edit_distance

   !> A text that can be printed in one line of a message: control characters and runs of blanks become one blank,
   !> and a text that is longer than `longest` is cut.
   pure function in_one_line(text, longest) result(shown)
      character(*), intent(in) :: text
      integer, intent(in) :: longest      !! characters, at least 4
      character(:), allocatable :: shown
      character(longest + 1) :: buffer
      integer :: i, n
      logical :: blank

      n = 0
      blank = .true.
      do i = 1, len(text)
         if (iachar(text(i:i)) <= 32 .or. iachar(text(i:i)) == 127) then
            if (blank) cycle
            n = n + 1
            buffer(n:n) = ' '
            blank = .true.
         else
            n = n + 1
            buffer(n:n) = text(i:i)
            blank = .false.
         end if
         if (n > longest) exit
      end do
      if (n > longest) then
         shown = buffer(:longest - 3)//'...'
      else
         shown = trim(buffer(:n))
      end if
   end function in_one_line

   !> An integer as text.
   pure function text_of_integer(number) result(text)
      integer, intent(in) :: number
      character(:), allocatable :: text
      character(24) :: buffer

      write (buffer, '(i0)') number
      text = trim(buffer)
   end function text_of_integer

   !> A long integer as text.
   pure function text_of_long(number) result(text)
      integer(int64), intent(in) :: number
      character(:), allocatable :: text
      character(24) :: buffer

      write (buffer, '(i0)') number
      text = trim(buffer)
   end function text_of_long

   !> A real number with up to six significant digits, such as 0.25, 120000 or 2.5e-7.
   pure function text_of_real(number) result(text)
      real(dp), intent(in) :: number
      character(:), allocatable :: text

      text = rounded_text(number, 6)
   end function text_of_real

   !> A real number with the fewest digits that give the same number when they are read.
   pure function exact_text(number) result(text)
      real(dp), intent(in) :: number
      character(:), allocatable :: text
      integer :: digits, status
      real(dp) :: again

      do digits = 1, 17
         text = rounded_text(number, digits)
         read (text, *, iostat=status) again
         if (status /= 0) cycle
         if (abs(again - number) <= 0.0_dp) return
      end do
   end function exact_text

   !> A real number rounded to a number of significant digits, without zeros at its end.
   pure function rounded_text(number, digits) result(text)
      real(dp), intent(in) :: number
      integer, intent(in) :: digits             !! 1 to 17
      character(:), allocatable :: text
      character(40) :: buffer
      character(40) :: figures
      integer :: exponent, n, point

      if (abs(number) <= 0.0_dp) then
         text = '0'
         return
      end if
      write (buffer, '(es40.'//text_of_integer(digits - 1)//'e3)') abs(number)
      buffer = adjustl(buffer)
      point = index(buffer, 'E')
      if (point == 0) then                          ! NaN, Infinity
         text = trim(buffer)
         return
      end if
      read (buffer(point + 1:), *) exponent
      figures = buffer(1:1)//buffer(3:point - 1)
      n = max(1, verify(trim(figures), '0', back=.true.))

      if (exponent >= 0 .and. exponent <= 6) then
         if (n < exponent + 1) figures(n + 1:exponent + 1) = repeat('0', exponent + 1 - n)
         text = figures(:exponent + 1)
         if (n > exponent + 1) text = text//'.'//figures(exponent + 2:n)
      else if (exponent < 0 .and. exponent >= -3) then
         text = '0.'//repeat('0', -exponent - 1)//figures(:n)
      else
         text = figures(1:1)
         if (n > 1) text = text//'.'//figures(2:n)
         text = text//'e'//text_of_integer(exponent)
      end if
      if (number < 0.0_dp) text = '-'//text
   end function rounded_text

end module text_tools
