!> The values that a variable of the input may have (a range, or words), and the phrase that states them in a
!> message.
module input_ranges
   use asperity_precision, only : dp
   use input_reference, only : is_array, kind_integer, kind_logical, kind_text, kind_word, kind_words, &
      variable_entry_type
   use text_tools, only : to_text
   implicit none
   private

   public :: allowed_phrase, value_range, word_is_allowed

contains

   !> The range of a number.
   pure subroutine value_range(entry, low, high, low_open, high_open)
      type(variable_entry_type), intent(in) :: entry
      real(dp), intent(out) :: low, high
      logical, intent(out) :: low_open, high_open     !! the end itself is not allowed
      integer :: comma, last

      low = -huge(1.0_dp)
      high = huge(1.0_dp)
      low_open = .false.
      high_open = .false.
      select case (entry%allowed)
      case ('any')
      case ('positive')
         low = 0.0_dp
         low_open = .true.
      case ('not negative')
         low = 0.0_dp
      case default
         comma = index(entry%allowed, ',')
         last = len_trim(entry%allowed)
         read (entry%allowed(2:comma - 1), *) low
         if (index(entry%allowed, 'inf') == 0) read (entry%allowed(comma + 1:last - 1), *) high
         low_open = entry%allowed(1:1) == '('
         ! The largest number is below infinity: there the open end excludes nothing.
         high_open = entry%allowed(last:last) == ')' .and. high < huge(1.0_dp)
      end select
   end subroutine value_range

   !> The phrase that states the allowed values in a message, such as 'must be a positive integer'.
   pure function allowed_phrase(entry) result(phrase)
      type(variable_entry_type), intent(in) :: entry
      character(:), allocatable :: phrase
      character(:), allocatable :: noun
      real(dp) :: high, low
      logical :: high_open, low_open

      select case (entry%kind)
      case (kind_logical)
         phrase = 'must be .true. or .false.'
         return
      case (kind_text)
         phrase = 'must be a string in quotes'
         return
      case (kind_word)
         phrase = 'must be one of '//trim(entry%allowed)
         return
      case (kind_words)
         phrase = 'every value must be one of '//trim(entry%allowed)
         return
      case (kind_integer)
         noun = 'integer'
      case default
         noun = 'number'
      end select

      select case (entry%allowed)
      case ('any')
         phrase = 'a finite '//noun
         if (noun == 'integer') phrase = 'an integer'
      case ('positive')
         phrase = 'a positive '//noun
      case ('not negative')
         phrase = '0 or a positive '//noun
      case default
         call value_range(entry, low, high, low_open, high_open)
         phrase = 'a '//noun
         if (noun == 'integer') phrase = 'an '//noun
         if (low_open) then
            phrase = phrase//' above'
         else
            phrase = phrase//' of at least'
         end if
         phrase = phrase//' '//to_text(low)
         if (high < huge(1.0_dp)) then
            if (high_open) then
               phrase = phrase//' and below '//to_text(high)
            else
               phrase = phrase//' and at most '//to_text(high)
            end if
         end if
      end select
      if (is_array(entry)) then
         phrase = 'every value must be '//phrase
      else
         phrase = 'must be '//phrase
      end if
   end function allowed_phrase

   !> Is this word among the allowed ones?
   pure logical function word_is_allowed(entry, word)
      type(variable_entry_type), intent(in) :: entry
      character(*), intent(in) :: word

      word_is_allowed = index(entry%allowed, ''''//trim(word)//'''') > 0 .and. scan(trim(word), '|''') == 0
   end function word_is_allowed

end module input_ranges
