!> The values of one group of the input, and functions that return and check them.
module input_group
   use case_settings, only : path_length
   use input_faults, only : faults_type
   use input_reference, only : variable_entry_type
   use asperity_precision, only : dp
   use text_tools, only : to_text
   implicit none
   private

   public :: group_values_type, in_line, item_type, line_note, place, position, value_type

   !> One value that was read from the text.
   type :: item_type
      real(dp) :: real = 0.0_dp
      integer :: integer = 0
      logical :: logical = .false.
      character(path_length) :: text = ''
   end type item_type

   !> A variable of a group.
   type :: value_type
      type(variable_entry_type) :: entry
      logical :: given = .false.                 !! the input names it
      logical :: good = .true.                   !! its value can be used
      integer :: line = 0
      character(:), allocatable :: shown         !! as written, for messages
      type(item_type), allocatable :: items(:)   !! not allocated if there is neither a value nor a default
      logical, allocatable :: filled(:)          !! which elements were assigned
   end type value_type

   !> The values of one group, given or by default.
   type :: group_values_type
      character(12) :: name = ''
      integer :: line = 0                        !! line where it starts; 0 for a group of defaults
      logical :: repeatable = .false.
      type(value_type), allocatable :: values(:)
   contains
      procedure :: given                         !! does the input name the variable?
      procedure :: usable                        !! is it given, and valid?
      procedure :: bad                           !! is it given, but invalid?
      procedure :: integer_value
      procedure :: real_value
      procedure :: logical_value
      procedure :: text_value
      procedure :: reals_value
      procedure :: texts_value
      procedure :: fault                         !! report a variable
      procedure :: group_fault                   !! report the group
      procedure :: demand                        !! report a variable that is missing
   end type group_values_type

contains

   !> Number of a variable in its group; 0 if there is none.
   pure integer function position(group, name)
      class(group_values_type), intent(in) :: group
      character(*), intent(in) :: name

      do position = size(group%values), 1, -1
         if (group%values(position)%entry%name == name) return
      end do
   end function position

   !> Does the input name the variable?
   pure logical function given(self, name)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name

      given = self%values(position(self, name))%given
   end function given

   !> Is the variable given, and valid?
   pure logical function usable(self, name)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name

      usable = self%given(name) .and. self%values(position(self, name))%good
   end function usable

   !> Is the variable given, but invalid?
   pure logical function bad(self, name)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name

      bad = .not. self%values(position(self, name))%good
   end function bad

   !> The integer of a variable; `otherwise`, or 0, if it has no value.
   pure integer function integer_value(self, name, otherwise) result(number)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      integer, intent(in), optional :: otherwise

      number = 0
      if (present(otherwise)) number = otherwise
      associate (value => self%values(position(self, name)))
         if (has_value(value)) number = value%items(1)%integer
      end associate
   end function integer_value

   !> The number of a variable; `otherwise`, or 0, if it has no value.
   pure real(dp) function real_value(self, name, otherwise) result(number)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), optional :: otherwise

      number = 0.0_dp
      if (present(otherwise)) number = otherwise
      associate (value => self%values(position(self, name)))
         if (has_value(value)) number = value%items(1)%real
      end associate
   end function real_value

   !> The logical of a variable; false if it has no value.
   pure logical function logical_value(self, name) result(truth)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name

      truth = .false.
      associate (value => self%values(position(self, name)))
         if (has_value(value)) truth = value%items(1)%logical
      end associate
   end function logical_value

   !> The string of a variable; empty if it has no value.
   pure function text_value(self, name) result(text)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      character(:), allocatable :: text

      text = ''
      associate (value => self%values(position(self, name)))
         if (has_value(value)) text = trim(value%items(1)%text)
      end associate
   end function text_value

   !> The list of a variable; of size 0 if it has no value.
   pure function reals_value(self, name) result(numbers)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      real(dp), allocatable :: numbers(:)

      associate (value => self%values(position(self, name)))
         if (has_value(value)) then
            numbers = value%items%real
         else
            allocate (numbers(0))
         end if
      end associate
   end function reals_value

   !> The strings of a variable; of size 0 if it has no value.
   pure function texts_value(self, name) result(texts)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      character(path_length), allocatable :: texts(:)

      associate (value => self%values(position(self, name)))
         if (has_value(value)) then
            texts = value%items%text
         else
            allocate (texts(0))
         end if
      end associate
   end function texts_value

   !> Is there a value, either a valid given one or a default?
   pure logical function has_value(value)
      type(value_type), intent(in) :: value

      has_value = .false.
      if (.not. value%good .or. .not. allocated(value%items)) return
      has_value = size(value%items) > 0
   end function has_value

   !> Report a fault of a variable: `&group: name = value: message`, or `&group: name: message` if it is not given.
   subroutine fault(self, name, message, faults)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: message
      type(faults_type), intent(inout) :: faults

      associate (value => self%values(position(self, name)))
         call faults%add(place(self, value), message//line_note(self, value))
      end associate
   end subroutine fault

   !> Report a fault of the group: `&group: message`.
   subroutine group_fault(self, message, faults)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: message
      type(faults_type), intent(inout) :: faults

      if (self%repeatable .and. self%line > 0) then
         call faults%add('&'//trim(self%name), message//in_line(self%line))
      else
         call faults%add('&'//trim(self%name), message)
      end if
   end subroutine group_fault

   !> The group, the variable and its value, for a message.
   function place(group, value)
      class(group_values_type), intent(in) :: group
      type(value_type), intent(in) :: value
      character(:), allocatable :: place

      place = '&'//trim(group%name)//': '//trim(value%entry%name)
      if (value%given) place = place//' = '//value%shown
   end function place

   !> The line of a variable in a repeatable group.
   function line_note(group, value) result(note)
      class(group_values_type), intent(in) :: group
      type(value_type), intent(in) :: value
      character(:), allocatable :: note

      note = ''
      if (.not. group%repeatable) return
      note = in_line(merge(value%line, group%line, value%given))
   end function line_note

   !> A line number in parentheses.
   pure function in_line(line) result(note)
      integer, intent(in) :: line
      character(:), allocatable :: note

      note = ' (line '//to_text(line)//')'
   end function in_line

   !> Report a required variable if it is not given.
   subroutine demand(self, name, faults, why)
      class(group_values_type), intent(in) :: self
      character(*), intent(in) :: name
      type(faults_type), intent(inout) :: faults
      character(*), intent(in), optional :: why       !! the reason why it is required

      if (self%given(name) .or. self%line == 0) return   ! a missing group is reported as a whole, if at all
      if (present(why)) then
         call self%fault(name, 'is missing: '//why//' needs it', faults)
      else
         call self%fault(name, 'is missing', faults)
      end if
   end subroutine demand

end module input_group
