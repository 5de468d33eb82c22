!> The input in a form for other programs: the table of its groups and variables, and the values of a text of
!> namelists, as plain lines. Their fields are separated by the control character 31, which no input contains.
module input_listing
   use asperity_errors, only : error_type
   use input_faults, only : faults_type
   use input_group, only : group_values_type, item_type
   use input_reference, only : group_entries, group_entry_type, kind_integer, kind_logical, kind_real, &
      kind_reals, variable_entries, variable_entry_type
   use input_values, only : read_groups
   use text_tools, only : to_text
   implicit none
   private

   public :: input_table, list_values

   character, parameter, public :: field_separator = achar(31)
   character(7), parameter :: kind_names(7) = [character(7) :: 'integer', 'real', 'logical', 'text', 'word', &
      'reals', 'words']

   !> A text that grows.
   type :: lines_type
      character(:), allocatable :: text
      integer :: used = 0
   contains
      procedure :: add
   end type lines_type

contains

   !> The table of the input: lines `group`, name, required, repeatable (`yes` or `no`), meaning, and
   !> lines `variable`, group, name, kind, default, units, allowed, meaning. A default in parentheses is
   !> derived, or stands for no default.
   function input_table() result(text)
      character(:), allocatable :: text
      type(group_entry_type), allocatable :: groups(:)
      type(variable_entry_type), allocatable :: variables(:)
      type(lines_type) :: lines
      integer :: i

      allocate (groups, source=group_entries())
      allocate (variables, source=variable_entries())
      do i = 1, size(groups)
         call lines%add('group'//field_separator//trim(groups(i)%name)//field_separator// &
            yes_or_no(groups(i)%required)//field_separator//yes_or_no(groups(i)%repeatable)// &
            field_separator//trim(groups(i)%meaning)//new_line('a'))
      end do
      do i = 1, size(variables)
         associate (entry => variables(i))
            call lines%add('variable'//field_separator//trim(entry%group)//field_separator// &
               trim(entry%name)//field_separator//trim(kind_names(entry%kind))//field_separator// &
               trim(entry%default)//field_separator//trim(entry%units)//field_separator// &
               trim(entry%allowed)//field_separator//trim(entry%meaning)//new_line('a'))
         end associate
      end do
      text = lines%text(:lines%used)
   end function input_table

   !> The values that a text contains, in their order: a line `&group`, then a line for each of its variables
   !> with the name and the values. Reals have enough digits to reproduce the same bits, logicals are T or F, and
   !> strings have no quotes. Names, types and ranges are checked, but not whether the values agree with each other.
   subroutine list_values(text, path, listing, error)
      character(*), intent(in) :: text
      character(*), intent(in) :: path                         !! the file's name, for messages
      character(:), allocatable, intent(out) :: listing
      type(error_type), allocatable, intent(out) :: error      !! all faults, one per line
      type(group_values_type), allocatable :: groups(:)
      type(faults_type) :: faults
      type(lines_type) :: lines
      integer :: i, j, k

      faults%path = path
      call read_groups(text, groups, faults)
      if (allocated(faults%error)) then
         call move_alloc(faults%error, error)
         return
      end if
      do i = 1, size(groups)
         call lines%add('&'//trim(groups(i)%name)//new_line('a'))
         do j = 1, size(groups(i)%values)
            associate (value => groups(i)%values(j))
               if (.not. value%given) cycle
               call lines%add(trim(value%entry%name))
               do k = 1, size(value%items)
                  call lines%add(field_separator//item_text(value%entry%kind, value%items(k)))
               end do
               call lines%add(new_line('a'))
            end associate
         end do
      end do
      listing = ''
      if (lines%used > 0) listing = lines%text(:lines%used)
   end subroutine list_values

   !> One value as text.
   function item_text(kind, item) result(text)
      integer, intent(in) :: kind
      type(item_type), intent(in) :: item
      character(:), allocatable :: text
      character(32) :: digits

      select case (kind)
      case (kind_integer)
         text = to_text(item%integer)
      case (kind_real, kind_reals)
         write (digits, '(es32.16e3)') item%real
         text = trim(adjustl(digits))
      case (kind_logical)
         text = merge('T', 'F', item%logical)
      case default
         text = trim(item%text)
      end select
   end function item_text

   pure function yes_or_no(truth) result(word)
      logical, intent(in) :: truth
      character(:), allocatable :: word

      word = 'no'
      if (truth) word = 'yes'
   end function yes_or_no

   !> Append to a text.
   subroutine add(self, piece)
      class(lines_type), intent(inout) :: self
      character(*), intent(in) :: piece
      character(:), allocatable :: longer

      if (.not. allocated(self%text)) allocate (character(4096) :: self%text)
      if (self%used + len(piece) > len(self%text)) then
         allocate (character(2*(self%used + len(piece))) :: longer)
         longer(:self%used) = self%text(:self%used)
         call move_alloc(longer, self%text)
      end if
      self%text(self%used + 1:self%used + len(piece)) = piece
      self%used = self%used + len(piece)
   end subroutine add

end module input_listing
