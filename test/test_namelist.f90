!> Tests of the scanner of namelists, the reference table, and the words and numbers in messages.
module test_namelist
   use check, only : begin_suite, check_close, check_error, check_order, check_that, selected
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use input_ranges, only : allowed_phrase
   use input_reference, only : variable_entries, variable_entry_type
   use input_values, only : default_group
   use namelist_file, only : namelists_type, scan_namelists, shown_tokens
   use asperity_precision, only : dp
   use reference_page, only : reference_markdown
   use text_tools, only : exact_text, in_one_line, lower, nearest_name, next_line, to_text
   implicit none
   private

   public :: run_namelist

   character(*), parameter :: nl = new_line('a')

contains

   subroutine run_namelist()
      call begin_suite('namelist')
      if (selected('any_layout_is_read')) call any_layout_is_read()
      if (selected('broken_form_is_found_and_the_rest_read')) &
         call broken_form_is_found_and_the_rest_read()
      if (selected('table_of_the_input_is_consistent')) call table_of_the_input_is_consistent()
      if (selected('words_and_their_nearest_names')) call words_and_their_nearest_names()
      if (selected('lines_are_taken_one_by_one')) call lines_are_taken_one_by_one()
      if (selected('texts_of_numbers')) call texts_of_numbers()
   end subroutine run_namelist

   !> Groups and assignments are found in any layout.
   subroutine any_layout_is_read()
      type(namelists_type) :: file
      type(faults_type) :: faults

      faults%path = 'f'
      call scan_namelists('&A x=1,2 3'//nl//' y(2:3) = ''/ & ! ='' /$b'//achar(9)//'Z_1="it""s" $end !&c'// &
         nl//'&d/&e x = 1!c'//achar(13)//nl//'&END', file, faults)
      call check_that(.not. allocated(faults%error), 'no fault')
      call check_that(size(file%groups) == 4 .and. size(file%assignments) == 4, 'groups and assignments')
      if (size(file%groups) /= 4 .or. size(file%assignments) /= 4) return
      call check_that(all(file%groups%name == ['a', 'b', 'd', 'e']), 'names in lower case')
      call check_that(all(file%groups%line == [1, 2, 3, 3]), 'lines of groups')
      call check_that(all(file%assignments%group == [1, 1, 2, 4]), 'groups of assignments')
      call check_that(file%assignments(3)%name == 'z_1', 'a name')
      call check_that(shown(1) == '1,2 3', 'values: '//shown(1))
      call check_that(shown(2) == '''/ & ! =''', 'a string hides everything: '//shown(2))
      call check_that(file%assignments(2)%subscript == 2 .and. file%assignments(2)%upper == 3, 'a subscript')
      call check_that(shown(3) == '"it""s"', 'a doubled quote: '//shown(3))
      call check_that(shown(4) == '1', 'a comment behind a value: '//shown(4))

      call scan_namelists(char(239)//char(187)//char(191)//'&a /', file, faults)
      call check_that(size(file%groups) == 1 .and. .not. allocated(faults%error), 'a mark of UTF-8')
      call scan_namelists('  ! nothing', file, faults)
      call check_that(size(file%groups) == 0 .and. .not. allocated(faults%error), 'only a comment')

   contains

      function shown(i)
         integer, intent(in) :: i
         character(:), allocatable :: shown

         shown = shown_tokens(file, file%assignments(i)%first, file%assignments(i)%last)
      end function shown

   end subroutine any_layout_is_read

   !> Faults of the form are found, and the rest is still read.
   subroutine broken_form_is_found_and_the_rest_read()
      call broken('&a x = 1'//nl//'&b /', 1, 'f: &a: the group that starts in line 1 is not closed')
      call broken('&a x = 1', 1, 'is missing before the end of the file')
      call broken('hello'//nl//'&a /'//nl//'world', 2, 'f: line 3: text outside of a group: world')
      call broken('&a x 1 /', 1, 'x 1 in line 1 is not an assignment')
      call broken('&a = 1, y = 2 /', 1, '= 1 in line 1 is not an assignment')
      call broken('&a x = (1,2', 1, 'is not closed')
      call broken('& a x = 1 /', 1, 'text outside of a group')
      call broken('&a x = 1/1000 /', 1, 'f: line 1: text outside of a group: 1000 /: a group is &name ... /; the slash '// &
         'before this text ends its group')
      call broken('&a /'//achar(27), 1, 'code 27')
      call broken(repeat('x', 100000), 1, '...: a group is &name')
      call broken(repeat('&a x'//nl, 500), 100, 'there are more faults')
   end subroutine broken_form_is_found_and_the_rest_read

   !> A text has this number of faults, one of which contains this fragment.
   subroutine broken(text, count, fragment)
      character(*), intent(in) :: text
      integer, intent(in) :: count
      character(*), intent(in) :: fragment
      type(namelists_type) :: file
      type(faults_type) :: faults

      faults%path = 'f'
      call scan_namelists(text, file, faults)
      call check_that(min(faults%count, 100) == count, fragment//': '//to_text(faults%count)//' faults')
      call check_error(faults%error, fragment, fragment)
   end subroutine broken

   !> Every entry of the table is complete, and defaults are allowed values.
   subroutine table_of_the_input_is_consistent()
      type(variable_entry_type), allocatable :: entries(:)
      type(group_values_type) :: group
      character(:), allocatable :: markdown
      integer :: i, j

      allocate (entries, source=variable_entries())
      markdown = reference_markdown()
      do i = 1, size(entries)
         associate (name => trim(entries(i)%group)//' '//trim(entries(i)%name))
            call check_that(any(group_entries_names() == entries(i)%group), name//': its group')
            call check_order(index(markdown, '| `'//trim(entries(i)%name)//'` | '), '>', 0, &
               name//': documented')
            call check_that(len_trim(entries(i)%meaning) > 0 .and. len_trim(entries(i)%meaning) < &
               len(entries(i)%meaning), name//': its meaning')
            call check_that(len_trim(entries(i)%default) > 0 .and. len_trim(entries(i)%default) < &
               len(entries(i)%default), name//': its default')
            call check_order(len_trim(entries(i)%allowed), '<', len(entries(i)%allowed), &
               name//': allowed values')
            call check_order(index(allowed_phrase(entries(i)), 'must be'), '>', 0, &
               name//': its phrase')
            call check_that(count(entries%group == entries(i)%group .and. entries%name == entries(i)%name) &
               == 1, name//': occurs once')
            call default_group(entries(i)%group, group)
            do j = 1, size(group%values)
               if (group%values(j)%entry%name /= entries(i)%name) cycle
               call check_that(allocated(group%values(j)%items) .neqv. entries(i)%default(1:1) == '(', &
                  name//': its default is a value')
            end do
         end associate
      end do

      call default_group('solver', group)
      call check_close(group%real_value('tolerance'), 1.0e-6_dp, 1.0e-21_dp, 'a default')
      call check_that(group%text_value('method') == 'fast', 'a default word')
      call check_phrase('poisson', 'must be a number above -1 and at most 0.5')
      call check_phrase('compression', 'must be an integer of at least 0 and at most 9')
      call check_phrase('nx', 'must be a positive integer')
      call check_phrase('prony_tau', 'every value must be a positive number')
      call check_phrase('thickness', 'must be 0 or a positive number')
      call check_phrase('temperature', 'must be a number of at least -273.15')

   contains

      subroutine check_phrase(name, phrase)
         character(*), intent(in) :: name, phrase
         integer :: k

         do k = 1, size(entries)
            if (entries(k)%name == name) call check_that(allowed_phrase(entries(k)) == phrase, &
               name//': '//allowed_phrase(entries(k)))
         end do
      end subroutine check_phrase

      function group_entries_names() result(names)
         character(12), allocatable :: names(:)

         allocate (names(9))
         names = [character(12) :: 'case', 'grid', 'surface', 'material', 'adhesion', 'friction', 'phase', &
            'solver', 'output']
      end function group_entries_names

   end subroutine table_of_the_input_is_consistent

   !> Words.
   subroutine words_and_their_nearest_names()
      character(16), parameter :: names(4) = [character(16) :: 'prony_g', 'prony_tau', 'poisson', 'thickness']

      call check_that(lower('ABC_xyz9') == 'abc_xyz9', 'lower')
      call check_that(nearest_name('poison', names) == 'poisson', 'a letter is missing')
      call check_that(nearest_name('Posison', names) == 'poisson', 'two letters swapped')
      call check_that(nearest_name('prony_h', names) == 'prony_g', 'a letter is wrong')
      call check_that(nearest_name('thick', names) == 'thickness', 'the start of a name')
      call check_that(nearest_name('zzzzzz', names) == '', 'nothing is near')
      call check_that(nearest_name('', names) == '', 'no word')
      call check_that(in_one_line('a'//nl//achar(9)//'  b'//achar(0), 10) == 'a b', 'in_one_line')
      call check_that(in_one_line('abcdefghijk', 10) == 'abcdefg...', 'a long text is cut')
      call check_that(in_one_line('abcdefghij', 10) == 'abcdefghij', 'a text of full length is not')
   end subroutine words_and_their_nearest_names

   !> Lines are taken in order, empty ones too. The last one may end with the text.
   subroutine lines_are_taken_one_by_one()
      character(*), parameter :: text = 'one'//nl//nl//'three'
      character(:), allocatable :: line
      integer :: at

      at = 1
      call next_line(text, at, line)
      call check_that(line == 'one' .and. at == 5, 'the first line: '//line)
      call next_line(text, at, line)
      call check_that(len(line) == 0 .and. at == 6, 'an empty line: '//line)
      call next_line(text, at, line)
      call check_that(line == 'three' .and. at > len(text), 'a line without an end: '//line)
      at = 1
      call next_line('one'//nl, at, line)
      call check_that(line == 'one' .and. at > len('one'//nl), 'no line follows the last end: '//line)
   end subroutine lines_are_taken_one_by_one

   !> Numbers.
   subroutine texts_of_numbers()
      real(dp), parameter :: numbers(9) = [0.1_dp, -1.0_dp/3.0_dp, 1.0e-300_dp, 6.02214076e23_dp, &
         123456.789_dp, huge(1.0_dp), tiny(1.0_dp), 1.0e7_dp, 999999.95_dp]
      real(dp) :: again
      character(:), allocatable :: text
      integer :: i

      call check_that(to_text(0.25_dp) == '0.25', to_text(0.25_dp))
      call check_that(to_text(1.2e5_dp) == '120000', to_text(1.2e5_dp))
      call check_that(to_text(-2.5e-7_dp) == '-2.5e-7', to_text(-2.5e-7_dp))
      call check_that(to_text(0.0_dp) == '0', 'zero')
      call check_that(to_text(1.0_dp/3.0_dp) == '0.333333', to_text(1.0_dp/3.0_dp))
      call check_that(to_text(0.001_dp) == '0.001', to_text(0.001_dp))
      call check_that(to_text(9999999.7_dp) == '1e7', to_text(9999999.7_dp))
      call check_that(exact_text(0.1_dp) == '0.1', 'the shortest')
      do i = 1, size(numbers)
         text = exact_text(numbers(i))
         read (text, *) again
         call check_close(again, numbers(i), 0.0_dp, 'exact: '//text)
      end do
   end subroutine texts_of_numbers

end module test_namelist
