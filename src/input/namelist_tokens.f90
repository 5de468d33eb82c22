!> Splits a text of namelists into tokens: words, strings, separators, starts and ends of groups.
module namelist_tokens
   use text_tools, only : lower
   implicit none
   private

   public :: token_type, tokenise

   integer, parameter, public :: token_word = 1        !! a run of other characters
   integer, parameter, public :: token_string = 2      !! a string with its quotes
   integer, parameter, public :: token_comma = 3
   integer, parameter, public :: token_equals = 4
   integer, parameter, public :: token_parenthesis = 5 !! (...)
   integer, parameter, public :: token_open = 6        !! &name
   integer, parameter, public :: token_close = 7       !! / or &end
   integer, parameter, public :: token_broken = 8      !! a string that is not closed on its line

   !> A piece of the text.
   type :: token_type
      integer :: kind = 0
      integer :: first = 0         !! first character
      integer :: last = 0          !! last character
      integer :: line = 0          !! from 1
   end type token_type

contains

   !> Split a text into tokens.
   pure subroutine tokenise(text, tokens)
      character(*), intent(in) :: text
      type(token_type), allocatable, intent(out) :: tokens(:)
      type(token_type), allocatable :: larger(:)
      type(token_type) :: token
      integer :: at, count, line, next

      allocate (tokens(256))
      count = 0
      line = 1
      at = 1
      if (len(text) >= 3) then                        ! the mark that some editors put before UTF-8
         if (text(:3) == char(239)//char(187)//char(191)) at = 4
      end if

      do while (at <= len(text))
         select case (text(at:at))
         case (new_line('a'))
            line = line + 1
            at = at + 1
         case (' ', achar(9), achar(12), achar(13))
            at = at + 1
         case ('!')
            next = index(text(at:), new_line('a'))
            if (next == 0) exit
            at = at + next - 1
         case default
            call next_token(text, at, token)
            token%line = line
            if (count == size(tokens)) then
               allocate (larger(2*count))
               larger(:count) = tokens
               call move_alloc(larger, tokens)
            end if
            count = count + 1
            tokens(count) = token
            at = token%last + 1
         end select
      end do
      tokens = tokens(:count)
   end subroutine tokenise

   !> The token that starts at a character that is neither blank nor a comment.
   pure subroutine next_token(text, at, token)
      character(*), intent(in) :: text
      integer, intent(in) :: at
      type(token_type), intent(out) :: token
      character(*), parameter :: ends = ' ,=/!''"()'//achar(9)//achar(10)//achar(12)//achar(13)
      integer :: n

      token%first = at
      token%last = at
      select case (text(at:at))
      case (',')
         token%kind = token_comma
      case ('=')
         token%kind = token_equals
      case ('/')
         token%kind = token_close
      case ('''', '"')
         call string_end(text, at, token%last, token%kind)
      case ('(')
         token%kind = token_parenthesis
         n = scan(text(at:), ')'//new_line('a'))
         if (n == 0) n = len(text) - at + 2
         token%last = at + n - 1
         if (token%last > len(text)) then
            token%last = len(text)
         else if (text(token%last:token%last) /= ')') then
            token%last = token%last - 1
         end if
      case ('&', '$')
         n = scan(text(at:)//' ', ends)
         token%last = max(at, at + n - 2)
         if (token%last == at) then
            token%kind = token_word
         else if (lower(text(at + 1:token%last)) == 'end') then
            token%kind = token_close
         else
            token%kind = token_open
         end if
      case default
         token%kind = token_word
         n = word_length_at(text, at)
         token%last = at + n - 1
      end select

   contains

      !> Characters of the word that starts here, at least 1.
      pure integer function word_length_at(text, at) result(n)
         character(*), intent(in) :: text
         integer, intent(in) :: at

         n = 1
         do while (at + n <= len(text))
            if (index(ends, text(at + n:at + n)) > 0) exit
            n = n + 1
         end do
      end function word_length_at

   end subroutine next_token

   !> Find the end of the string that starts here: its closing quote, or the end of the line if it is not closed.
   pure subroutine string_end(text, at, last, kind)
      character(*), intent(in) :: text
      integer, intent(in) :: at
      integer, intent(out) :: last
      integer, intent(out) :: kind           !! token_string or token_broken
      integer :: i

      i = at + 1
      do while (i <= len(text))
         if (text(i:i) == new_line('a')) exit
         if (text(i:i) == text(at:at)) then
            if (i < len(text)) then
               if (text(i + 1:i + 1) == text(at:at)) then    ! a doubled quote stands for one
                  i = i + 2
                  cycle
               end if
            end if
            last = i
            kind = token_string
            return
         end if
         i = i + 1
      end do
      last = i - 1
      if (last > at .and. text(last:last) == achar(13)) last = last - 1
      kind = token_broken
   end subroutine string_end

end module namelist_tokens
