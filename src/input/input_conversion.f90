!> Reads one value of the input by Fortran's own rules, and checks it against the table of the input.
module input_conversion
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_precision, only : dp
   use case_settings, only : path_length
   use input_group, only : item_type
   use input_ranges, only : value_range, word_is_allowed
   use input_reference, only : kind_integer, kind_logical, kind_real, kind_reals, kind_text, kind_word, &
      kind_words, variable_entry_type
   use namelist_tokens, only : token_string, token_type, token_word
   use text_tools, only : lower
   implicit none
   private

   public :: convert, repeat_count

   integer, parameter, public :: longest_list = 10000      !! largest number of values of a variable

contains

   !> Read a repeat count. The result is 0 if the word is not one.
   subroutine repeat_count(word, repeats)
      character(*), intent(in) :: word
      integer, intent(out) :: repeats
      integer :: status

      repeats = 0
      if (verify(word, '0123456789') > 0 .or. len(word) > 30) return
      read (word, *, iostat=status) repeats
      if (status /= 0) repeats = 0
      if (repeats > longest_list) repeats = longest_list + 1
   end subroutine repeat_count

   !> Read one value by Fortran's rules, and check it against the table.
   subroutine convert(text, token, entry, item, good)
      character(*), intent(in) :: text
      type(token_type), intent(in) :: token
      type(variable_entry_type), intent(in) :: entry
      type(item_type), intent(out) :: item
      logical, intent(out) :: good
      integer, parameter :: longest_word = 400      !! longest text of a number
      integer :: status
      logical :: wants_string
      character(:), allocatable :: word

      good = .false.
      wants_string = any(entry%kind == [kind_text, kind_word, kind_words])
      if (wants_string .neqv. token%kind == token_string) return
      if (wants_string) then
         call unquote(text(token%first:token%last), item%text, good)
         if (good .and. entry%kind /= kind_text) then
            item%text = lower(item%text)
            good = word_is_allowed(entry, item%text) .and. len_trim(item%text) > 0
         end if
         return
      end if

      if (token%kind /= token_word .or. token%last - token%first >= longest_word) return
      word = lower(text(token%first:token%last))
      select case (entry%kind)
      case (kind_integer)
         if (verify(word, '+-0123456789') > 0) return
         read (word, *, iostat=status) item%integer
         item%real = real(item%integer, dp)
      case (kind_real, kind_reals)
         if (verify(word, '+-.0123456789ed') > 0) return
         read (word, *, iostat=status) item%real
      case (kind_logical)
         if (verify(word, '.abcdefghijklmnopqrstuvwxyz') > 0) return
         read (word, *, iostat=status) item%logical
      case default
         return
      end select
      if (status /= 0) return
      good = entry%kind == kind_logical
      if (.not. good) good = in_range(entry, item%real)
   end subroutine convert

   !> Is the number finite and within the range of the table?
   logical function in_range(entry, number)
      type(variable_entry_type), intent(in) :: entry
      real(dp), intent(in) :: number
      real(dp) :: high, low
      logical :: high_open, low_open

      in_range = .false.
      if (.not. ieee_is_finite(number)) return
      call value_range(entry, low, high, low_open, high_open)
      if (number < low .or. number > high) return
      if (low_open .and. number <= low) return
      if (high_open .and. number >= high) return
      in_range = .true.
   end function in_range

   !> The content of a string in quotes; a doubled quote stands for one.
   subroutine unquote(quoted, content, good)
      character(*), intent(in) :: quoted
      character(path_length), intent(out) :: content
      logical, intent(out) :: good               !! false: too long
      integer :: i, n

      content = ''
      n = 0
      i = 2
      do while (i < len(quoted))
         n = n + 1
         if (n <= len(content)) content(n:n) = quoted(i:i)
         if (quoted(i:i) == quoted(1:1)) i = i + 1
         i = i + 1
      end do
      good = n <= len(content)
   end subroutine unquote

end module input_conversion
