!> Splits a text of namelists into groups and assignments, without reading the values.
!>
!> Fortran's own `read (unit, nml=...)` stops at the first fault and says little about it. This scanner
!> continues to the end, so that all faults are reported at once. The form is Fortran's: `&name ... /`,
!> or `&end`, `$name ... $end`; `!` starts a comment; blanks, tabs, line ends and commas separate.
module namelist_file
   use input_faults, only : faults_type
   use namelist_tokens, only : token_broken, token_close, token_comma, token_equals, token_open, &
      token_parenthesis, token_type, token_word, tokenise
   use text_tools, only : in_one_line, lower, to_text
   implicit none
   private

   public :: assignment_type, group_type, namelists_type, scan_namelists, shown_tokens

   integer, parameter, public :: name_length = 32      !! characters of a name; longer ones are cut off
   integer, parameter :: from_start = 1                !! value of an absent subscript

   !> `name = values` or `name(subscript) = values`.
   type :: assignment_type
      character(name_length) :: name = ''     !! lower case
      integer :: group = 0                    !! number of its group
      integer :: first = 0                    !! first token of the values
      integer :: last = -1                    !! last token; less than `first` if there is none
      integer :: line = 0
      logical :: subscripted = .false.
      integer :: subscript = from_start       !! element that takes the first value; 0: not understood
      integer :: upper = 0                    !! last element of (n:m), or 0
   end type assignment_type

   !> A group.
   type :: group_type
      character(name_length) :: name = ''     !! lower case
      integer :: line = 0
   end type group_type

   !> A scanned text.
   type :: namelists_type
      character(:), allocatable :: text
      type(token_type), allocatable :: tokens(:)
      type(group_type), allocatable :: groups(:)
      type(assignment_type), allocatable :: assignments(:)
   end type namelists_type

contains

   !> Scan a text, and add errors of its form to the faults.
   subroutine scan_namelists(text, file, faults)
      character(*), intent(in) :: text
      type(namelists_type), intent(out) :: file
      type(faults_type), intent(inout) :: faults
      integer :: bad, i

      file%text = text
      allocate (file%groups(0), file%assignments(0))
      bad = 0
      do i = 1, len(text)
         select case (iachar(text(i:i)))
         case (0:8, 11, 14:31, 127)
            bad = i
            exit
         case default
            cycle
         end select
      end do
      if (bad > 0) then
         allocate (file%tokens(0))
         faults%hopeless = .true.
         call faults%add('line '//to_text(line_of(text, bad)), 'a character that is not text (code '// &
            to_text(iachar(text(bad:bad)))//'): this must be a text file of Fortran namelists')
         return
      end if

      call tokenise(text, file%tokens)
      call parse(file, faults)
   end subroutine scan_namelists

   !> Number of the line that holds a character.
   pure integer function line_of(text, position) result(line)
      character(*), intent(in) :: text
      integer, intent(in) :: position
      integer :: i

      line = 1
      do i = 1, position - 1
         if (text(i:i) == new_line('a')) line = line + 1
      end do
   end function line_of

   !> Collect tokens into groups and assignments.
   subroutine parse(file, faults)
      type(namelists_type), intent(inout) :: file
      type(faults_type), intent(inout) :: faults
      type(group_type), allocatable :: groups(:)
      type(assignment_type), allocatable :: assignments(:)
      integer :: at, first, group_count, count
      logical :: inside

      allocate (groups(number_of(file%tokens, token_open)))
      allocate (assignments(number_of(file%tokens, token_equals)))
      group_count = 0
      count = 0
      inside = .false.
      at = 1
      do while (at <= size(file%tokens))
         associate (token => file%tokens(at))
            if (token%kind == token_open) then
               if (inside) call unclosed(token%line)
               group_count = group_count + 1
               groups(group_count)%name = lower(file%text(token%first + 1:token%last))
               groups(group_count)%line = token%line
               inside = .true.
               at = at + 1
            else if (.not. inside) then
               first = at
               do while (at < size(file%tokens))
                  if (file%tokens(at + 1)%kind == token_open) exit
                  at = at + 1
               end do
               call faults%add('line '//to_text(token%line), 'text outside of a group: '// &
                  shown_tokens(file, first, at)//': a group is &name ... /'//about_slash())
               at = at + 1
            else if (token%kind == token_close) then
               inside = .false.
               at = at + 1
            else
               call parse_assignment(file, groups(group_count), group_count, at, assignments, count, &
                  faults)
            end if
         end associate
      end do
      if (inside) call unclosed(0)
      file%groups = groups(:group_count)
      file%assignments = assignments(:count)

   contains

      !> If a slash just before the text has ended a group, it may have been meant as a division.
      function about_slash() result(text)
         character(:), allocatable :: text

         text = ''
         if (first == 1) return
         if (file%tokens(first - 1)%kind == token_close .and. file%tokens(first - 1)%line == file%tokens(first)%line) &
            text = '; the slash before this text ends its group, since values cannot be expressions'
      end function about_slash

      !> Report that the present group has no end.
      subroutine unclosed(line)
         integer, intent(in) :: line       !! of the next group; 0 at the end of the file
         character(:), allocatable :: next

         if (file%tokens(at - 1)%kind == token_broken) return       ! the unclosed string is the fault
         next = 'the end of the file'
         if (line > 0) next = 'the next group in line '//to_text(line)
         call faults%add('&'//trim(groups(group_count)%name), 'the group that starts in line '// &
            to_text(groups(group_count)%line)//' is not closed: a ''/'' is missing before '//next)
      end subroutine unclosed

   end subroutine parse

   !> Number of tokens of a kind.
   pure integer function number_of(tokens, kind) result(n)
      type(token_type), intent(in) :: tokens(:)
      integer, intent(in) :: kind
      integer :: i

      n = 0
      do i = 1, size(tokens)
         if (tokens(i)%kind == kind) n = n + 1
      end do
   end function number_of

   !> Parse one assignment, or skip a text that is not an assignment.
   subroutine parse_assignment(file, group, number, at, assignments, count, faults)
      type(namelists_type), intent(in) :: file
      type(group_type), intent(in) :: group
      integer, intent(in) :: number                          !! of the group
      integer, intent(inout) :: at                           !! token
      type(assignment_type), intent(inout) :: assignments(:)
      integer, intent(inout) :: count                        !! of assignments so far
      type(faults_type), intent(inout) :: faults
      type(assignment_type) :: new
      integer :: first

      first = at
      if (.not. starts_assignment(file%tokens, at)) then
         do while (at < size(file%tokens))
            if (starts_assignment(file%tokens, at + 1)) exit
            if (any(file%tokens(at + 1)%kind == [token_open, token_close])) exit
            at = at + 1
         end do
         call faults%add('&'//trim(group%name), shown_tokens(file, first, at)//' in line '// &
            to_text(file%tokens(first)%line)//' is not an assignment: it must be ''variable = value''')
         at = at + 1
         return
      end if

      new%name = lower(file%text(file%tokens(at)%first:file%tokens(at)%last))
      new%group = number
      new%line = file%tokens(at)%line
      at = at + 1
      if (file%tokens(at)%kind == token_parenthesis) then
         call read_subscript(file%text(file%tokens(at)%first:file%tokens(at)%last), new)
         at = at + 1
      end if
      at = at + 1                                             ! '='
      new%first = at
      do while (at <= size(file%tokens))
         if (any(file%tokens(at)%kind == [token_open, token_close, token_equals])) exit
         if (starts_assignment(file%tokens, at)) exit
         at = at + 1
      end do
      new%last = at - 1
      count = count + 1
      assignments(count) = new
   end subroutine parse_assignment

   !> Does `name =` or `name(...) =` start at this token?
   pure logical function starts_assignment(tokens, at) result(starts)
      type(token_type), intent(in) :: tokens(:)
      integer, intent(in) :: at
      integer :: next

      starts = .false.
      if (tokens(at)%kind /= token_word) return
      next = at + 1
      if (next > size(tokens)) return
      if (tokens(next)%kind == token_parenthesis) next = next + 1
      if (next > size(tokens)) return
      starts = tokens(next)%kind == token_equals
   end function starts_assignment

   !> Interpret (n), (n:), (n:m), (:m) or (:).
   pure subroutine read_subscript(text, assignment)
      character(*), intent(in) :: text                        !! with its parentheses
      type(assignment_type), intent(inout) :: assignment
      integer :: colon, n

      assignment%subscripted = .true.
      n = len(text)
      if (n < 3 .or. text(n:n) /= ')') then
         assignment%subscript = 0
         return
      end if
      colon = index(text, ':')
      if (colon == 0) then
         assignment%subscript = whole(text(2:n - 1), 0)
         assignment%upper = assignment%subscript
      else
         assignment%subscript = whole(text(2:colon - 1), from_start)
         assignment%upper = whole(text(colon + 1:n - 1), huge(1))
         if (assignment%upper < assignment%subscript) assignment%subscript = 0
      end if
   end subroutine read_subscript

   !> A positive integer; 0 if the text is not one, and `default` if it is empty.
   pure integer function whole(text, default)
      character(*), intent(in) :: text
      integer, intent(in) :: default
      integer :: status

      whole = default
      if (len_trim(text) == 0) return
      whole = 0
      if (verify(trim(adjustl(text)), '0123456789') > 0 .or. len_trim(text) > 30) return
      read (text, *, iostat=status) whole
      if (status /= 0) whole = 0
   end function whole

   !> The text of some tokens, for a message.
   function shown_tokens(file, first, last) result(shown)
      type(namelists_type), intent(in) :: file
      integer, intent(in) :: first, last        !! tokens
      character(:), allocatable :: shown
      integer, parameter :: longest = 60
      integer :: end

      end = last
      do while (end > first)
         if (file%tokens(end)%kind /= token_comma) exit
         end = end - 1
      end do
      shown = ''
      if (end < first) return
      shown = in_one_line(file%text(file%tokens(first)%first:file%tokens(end)%last), longest)
   end function shown_tokens

end module namelist_file
