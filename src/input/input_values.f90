!> Converts scanned namelists to values: names are checked, and each value is read by Fortran's own rules and
!> checked against the table of the input reference, which also supplies the defaults.
module input_values
   use case_settings, only : path_length
   use input_faults, only : faults_type
   use input_group, only : group_values_type, in_line, item_type, line_note, place, position, value_type
   use input_conversion, only : convert, longest_list, repeat_count
   use input_ranges, only : allowed_phrase
   use input_reference, only : group_entries, group_entry_type, is_array, kind_integer, variable_entries, variable_entry_type
   use namelist_file, only : assignment_type, namelists_type, scan_namelists, shown_tokens
   use namelist_tokens, only : token_broken, token_comma, token_string, token_type, token_word, &
      tokenise
   use text_tools, only : lower, nearest_name, to_text
   implicit none
   private

   public :: default_group, read_groups

   !> Names that other programs and books use, each with ours.
   character(16), parameter :: other_names(2, 7) = reshape([character(16) :: 'mu', 'coefficient', 'nu', 'poisson', &
      'load', 'pressure', 'speed', 'velocity_x', 'velocity', 'velocity_x', 'time', 'duration', &
      'work_of_adhesion', 'energy'], [2, 7])
   !> Names of the modulus in tension.
   character(15), parameter :: names_of_tension(5) = [character(15) :: 'e', 'e_modulus', 'elastic_modulus', &
      'young_modulus', 'youngs_modulus']

contains

   !> Read a text into groups of values, and add all errors to the faults.
   subroutine read_groups(text, groups, faults)
      character(*), intent(in) :: text
      type(group_values_type), allocatable, intent(out) :: groups(:)   !! known groups, in file order
      type(faults_type), intent(inout) :: faults
      type(namelists_type) :: file
      type(group_entry_type), allocatable :: known(:)
      character(12), allocatable :: names(:)
      integer, allocatable :: entry_of(:)
      integer :: count, i, j

      allocate (known, source=group_entries())
      allocate (names(size(known)))
      do i = 1, size(known)
         names(i) = known(i)%name
      end do
      call scan_namelists(text, file, faults)
      allocate (entry_of(size(file%groups)))
      do i = 1, size(file%groups)
         entry_of(i) = findloc(names == file%groups(i)%name, .true., dim=1)
         if (entry_of(i) == 0) then
            call faults%add('&'//trim(file%groups(i)%name), 'there is no such group'// &
               hint('&', nearest_name(file%groups(i)%name, names))//in_line(file%groups(i)%line))
            cycle
         end if
         if (known(entry_of(i))%repeatable) cycle
         do j = 1, i - 1
            if (entry_of(j) == entry_of(i)) then
               call faults%add('&'//trim(file%groups(i)%name), 'the group is given twice, in line '// &
                  to_text(file%groups(j)%line)//' and in line '//to_text(file%groups(i)%line)// &
                  ': only &surface and &phase may be repeated')
               exit
            end if
         end do
      end do

      allocate (groups(count_nonzero(entry_of)))
      count = 0
      do i = 1, size(file%groups)
         if (entry_of(i) == 0) cycle
         count = count + 1
         call default_group(known(entry_of(i))%name, groups(count))
         groups(count)%line = file%groups(i)%line
         do j = 1, size(file%assignments)
            if (file%assignments(j)%group == i) call assign(file, file%assignments(j), groups(count), faults)
         end do
         call finish_group(groups(count), faults)
      end do
   end subroutine read_groups

   pure integer function count_nonzero(numbers) result(n)
      integer, intent(in) :: numbers(:)

      n = count(numbers /= 0)
   end function count_nonzero

   !> Make a group of defaults.
   subroutine default_group(name, group)
      character(*), intent(in) :: name
      type(group_values_type), intent(out) :: group
      type(variable_entry_type), allocatable :: entries(:)
      type(group_entry_type), allocatable :: known(:)
      type(token_type), allocatable :: tokens(:)
      integer :: count, i
      logical :: good

      allocate (known, source=group_entries())
      allocate (entries, source=variable_entries())
      group%name = name
      group%repeatable = any(known%name == name .and. known%repeatable)
      allocate (group%values(count_of(entries, name)))
      count = 0
      do i = 1, size(entries)
         if (entries(i)%group /= name) cycle
         count = count + 1
         group%values(count)%entry = entries(i)
         group%values(count)%shown = trim(entries(i)%default)
         if (entries(i)%default(1:1) == '(') cycle
         call tokenise(trim(entries(i)%default), tokens)
         allocate (group%values(count)%items(1))
         call convert(trim(entries(i)%default), tokens(1), entries(i), group%values(count)%items(1), good)
      end do
   end subroutine default_group

   !> Number of variables of a group.
   pure integer function count_of(entries, group) result(n)
      type(variable_entry_type), intent(in) :: entries(:)
      character(*), intent(in) :: group

      n = count(entries%group == group)
   end function count_of

   !> Process one assignment, which belongs to a group.
   subroutine assign(file, assignment, group, faults)
      type(namelists_type), intent(in) :: file
      type(assignment_type), intent(in) :: assignment
      type(group_values_type), intent(inout) :: group
      type(faults_type), intent(inout) :: faults
      character(24), allocatable :: names(:)
      integer :: at, i

      at = position(group, assignment%name)
      if (at == 0) then
         allocate (names(size(group%values)))
         do i = 1, size(names)
            names(i) = group%values(i)%entry%name
         end do
         call faults%add('&'//trim(group%name)//': '//trim(assignment%name), 'there is no such variable'// &
            advice_on_name(assignment%name, names)//in_line(assignment%line))
         return
      end if

      associate (value => group%values(at))
         if (value%given .and. .not. (assignment%subscripted .and. is_array(value%entry))) then
            call group%group_fault(trim(assignment%name)//' is given twice'//lines_of(value%line, assignment%line), faults)
            return
         end if
         if (.not. value%given) then
            value%shown = shown_tokens(file, assignment%first, assignment%last)
            value%line = assignment%line
            if (allocated(value%items)) deallocate (value%items)
            allocate (value%items(0), value%filled(0))
         else
            value%shown = value%shown//' ... '//shown_tokens(file, assignment%first, assignment%last)
         end if
         value%given = .true.
         call take_values(file, assignment, group, value, faults)
      end associate
   end subroutine assign

   !> Read the values of an assignment, with repeat counts.
   subroutine take_values(file, assignment, group, value, faults)
      type(namelists_type), intent(in) :: file
      type(assignment_type), intent(in) :: assignment
      type(group_values_type), intent(in) :: group
      type(value_type), intent(inout) :: value
      type(faults_type), intent(inout) :: faults
      type(token_type) :: token
      character(:), allocatable :: fault
      integer :: element, repeats, next
      logical :: comma_before

      element = assignment%subscript - 1
      comma_before = .true.
      next = assignment%first
      fault = fault_of_subscript(assignment, value%entry)

      do while (fault == '' .and. next <= assignment%last)
         token = file%tokens(next)
         next = next + 1
         if (token%kind == token_comma) then
            if (comma_before) fault = 'has an empty value before a comma'
            comma_before = .true.
            cycle
         end if
         comma_before = .false.
         if (token%kind == token_broken) then
            fault = 'has a string that is not closed on its line'
            exit
         end if
         call take_repetition(file, assignment%last, token, next, repeats)
         if (repeats < 1) then
            fault = allowed_phrase(value%entry)//'; a repetition is written n*value'
            exit
         end if
         call take_items(file%text, token, repeats, assignment%upper, value, element, fault)
      end do

      if (fault == '' .and. element == assignment%subscript - 1) &
         fault = 'has no value: '//allowed_phrase(value%entry)
      if (fault == '') return
      if (value%good) call faults%add(place(group, value), fault//line_note(group, value))
      value%good = .false.
   end subroutine take_values

   !> The fault of the subscript of a variable; empty if there is none.
   function fault_of_subscript(assignment, entry) result(fault)
      type(assignment_type), intent(in) :: assignment
      type(variable_entry_type), intent(in) :: entry
      character(:), allocatable :: fault

      fault = ''
      if (.not. assignment%subscripted) return
      if (.not. is_array(entry)) then
         fault = 'is a single value and has no subscript'
      else if (assignment%subscript == 0) then
         fault = 'has an invalid subscript: it must be (n) or (n:m), with n at least 1'
      else if (assignment%subscript > longest_list) then
         fault = 'has a subscript above '//to_text(longest_list)
      end if
   end function fault_of_subscript

   !> Split n*value: the token becomes that of the value. Any other token is a value that occurs once.
   subroutine take_repetition(file, last, token, next, repeats)
      type(namelists_type), intent(in) :: file
      integer, intent(in) :: last              !! token of the assignment
      type(token_type), intent(inout) :: token
      integer, intent(inout) :: next           !! number of the token that follows it
      integer, intent(out) :: repeats          !! 0: not understood
      integer :: star

      repeats = 1
      if (token%kind /= token_word) return
      star = index(file%text(token%first:token%last), '*')
      if (star <= 1) return
      call repeat_count(file%text(token%first:token%first + star - 2), repeats)
      token%first = token%first + star
      if (token%first > token%last .and. next <= last) then
         ! n*'string': the string is a token of its own
         if (file%tokens(next)%kind == token_string .and. file%tokens(next)%first == token%first) then
            token = file%tokens(next)
            next = next + 1
         end if
      end if
      if (token%first > token%last) repeats = 0
   end subroutine take_repetition

   !> Append a value `repeats` times to the existing elements.
   subroutine take_items(text, token, repeats, upper, value, element, fault)
      character(*), intent(in) :: text
      type(token_type), intent(in) :: token
      integer, intent(in) :: repeats
      integer, intent(in) :: upper             !! last element of the subscript; 0: none
      type(value_type), intent(inout) :: value
      integer, intent(inout) :: element        !! last existing element
      character(:), allocatable, intent(inout) :: fault
      type(item_type) :: item
      integer :: k
      logical :: good

      call convert(text, token, value%entry, item, good)
      if (.not. good) then
         fault = allowed_phrase(value%entry)
         if (token%kind == token_string .and. token%last - token%first - 1 > path_length) &
            fault = fault//' of at most '//to_text(path_length)//' characters'
         if (is_too_large(text(token%first:token%last), value%entry)) fault = fault//' of at most '//to_text(huge(1))
      else if (.not. is_array(value%entry) .and. element + repeats > 1) then
         fault = 'takes one value only: it '//allowed_phrase(value%entry)
      else if (element + repeats > longest_list) then
         fault = 'has more than '//to_text(longest_list)//' values'
      else if (upper > 0 .and. element + repeats > upper) then
         fault = 'has more values than its subscript has elements'
      end if
      if (fault /= '') return
      do k = 1, repeats
         element = element + 1
         call put(value, element, item, good)
         if (.not. good) then
            fault = 'sets its element '//to_text(element)//' twice'
            return
         end if
      end do
   end subroutine take_items

   !> Is the text an integer beyond the largest one of this program?
   pure logical function is_too_large(text, entry)
      character(*), intent(in) :: text
      type(variable_entry_type), intent(in) :: entry
      integer :: status, value

      is_too_large = .false.
      if (entry%kind /= kind_integer .or. verify(text, '0123456789') > 0) return
      read (text, *, iostat=status) value
      is_too_large = status /= 0
   end function is_too_large

   !> Set an element of a list that grows as needed.
   pure subroutine put(value, element, item, good)
      type(value_type), intent(inout) :: value
      integer, intent(in) :: element
      type(item_type), intent(in) :: item
      logical, intent(out) :: good                  !! false: it was set before
      type(item_type), allocatable :: items(:)
      logical, allocatable :: filled(:)
      integer :: n

      n = size(value%items)
      if (element > n) then
         allocate (items(max(element, min(2*n, 2*element))), filled(max(element, min(2*n, 2*element))))
         filled = .false.
         items(:n) = value%items
         filled(:n) = value%filled
         call move_alloc(items, value%items)
         call move_alloc(filled, value%filled)
      end if
      good = .not. value%filled(element)
      value%items(element) = item
      value%filled(element) = .true.
   end subroutine put

   !> Look for gaps in the lists of a group.
   subroutine finish_group(group, faults)
      type(group_values_type), intent(inout) :: group
      type(faults_type), intent(inout) :: faults
      integer :: i, last, missing

      do i = 1, size(group%values)
         associate (value => group%values(i))
            if (.not. (value%given .and. value%good)) cycle
            last = findloc(value%filled, .true., dim=1, back=.true.)
            missing = findloc(value%filled(:last), .false., dim=1)
            value%items = value%items(:last)
            if (missing > 0) then
               value%good = .false.
               call faults%add(place(group, value), 'has no element '//to_text(missing)// &
                  ': all elements from 1 on must be given'//line_note(group, value))
            end if
         end associate
      end do
   end subroutine finish_group

   !> `, in line 3 and in line 5`, or `, in line 3`.
   pure function lines_of(one, other) result(text)
      integer, intent(in) :: one, other
      character(:), allocatable :: text

      text = ', in line '//to_text(one)
      if (other /= one) text = text//' and in line '//to_text(other)
   end function lines_of

   !> What may be wrong with a name that is not known. A non-breaking space, for example, cannot be seen.
   function advice_on_name(name, names) result(text)
      character(*), intent(in) :: name, names(:)
      character(:), allocatable :: text
      integer :: i

      if (any([(ichar(name(i:i)) > 126, i=1, len(name))])) then
         text = ': it contains a character that is not ASCII, such as a non-breaking space'
         return
      end if
      if (any(names_of_tension == lower(name)) .and. any(names == 'shear_modulus')) then
         text = '; give shear_modulus = E/(2 (1 + poisson))'
         return
      end if
      do i = 1, size(other_names, 2)
         text = hint('', trim(other_names(2, i)))
         if (lower(name) == other_names(1, i) .and. any(names == other_names(2, i))) return
      end do
      text = hint('', nearest_name(name, names))
      if (text == '') text = '; there are '//trim(names(1))
      if (index(text, '; there are') /= 1) return
      do i = 2, size(names)
         text = text//', '//trim(names(i))
      end do
   end function advice_on_name

   !> The proposal of a similar name, if there is one.
   pure function hint(prefix, name) result(text)
      character(*), intent(in) :: prefix, name
      character(:), allocatable :: text

      text = ''
      if (name /= '') text = '; did you mean '//prefix//name//'?'
   end function hint

end module input_values
