!> The table of the fields that a snapshot may contain.
!>
!> A new field is one line of this table; module `contact_fields` computes its values. The words of
!> the input, the default of `snapshot_fields`, the result and Python are derived from the table.
module snapshot_fields
   implicit none
   private

   public :: field_names, field_needs_friction, field_type, field_words, find_field, known_fields

   !> A field.
   type :: field_type
      character(24) :: name = ''
      character(4) :: units = ''
      logical :: frictional = .false.   !! exists only with friction
      character(80) :: long_name = ''
   end type field_type

   type(field_type), parameter :: known_fields(*) = [ &
      field_type('pressure', 'Pa', .false., 'normal traction on the rubber, pressure positive'), &
      field_type('gap', 'm', .false., 'gap between rubber and road'), &
      field_type('displacement_z', 'm', .false., 'displacement of the rubber along z'), &
      field_type('contact', '1', .false., 'state of contact: 0 open, 1 stick, 2 slip'), &
      field_type('road_height', 'm', .false., 'height of the road in its present position under the rubber'), &
      field_type('traction_x', 'Pa', .true., 'tangential traction on the rubber along x'), &
      field_type('traction_y', 'Pa', .true., 'tangential traction on the rubber along y'), &
      field_type('displacement_x', 'm', .true., 'displacement of the rubber along x'), &
      field_type('displacement_y', 'm', .true., 'displacement of the rubber along y'), &
      field_type('slip_x', 'm', .true., 'slip of the step along x'), &
      field_type('slip_y', 'm', .true., 'slip of the step along y')]

contains

   !> The field of a name; its name is blank if there is no such field.
   elemental function find_field(name) result(field)
      character(*), intent(in) :: name
      type(field_type) :: field
      integer :: i

      do i = 1, size(known_fields)
         if (known_fields(i)%name == name) field = known_fields(i)
      end do
   end function find_field

   !> Does a field exist only with friction?
   elemental function field_needs_friction(name) result(needs)
      character(*), intent(in) :: name
      logical :: needs
      type(field_type) :: field

      field = find_field(name)
      needs = field%frictional
   end function field_needs_friction

   !> The names of the fields that a case has.
   pure function field_names(friction) result(names)
      logical, intent(in) :: friction   !! the case has a friction law
      character(24), allocatable :: names(:)

      names = pack(known_fields%name, friction .or. .not. known_fields%frictional)
   end function field_names

   !> The names of all fields as words of the input: 'pressure' | 'gap' | ...
   pure function field_words() result(words)
      character(:), allocatable :: words
      integer :: i

      words = ''
      do i = 1, size(known_fields)
         if (i > 1) words = words//' | '
         words = words//''''//trim(known_fields(i)%name)//''''
      end do
   end function field_words

end module snapshot_fields
