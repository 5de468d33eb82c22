!> The fields that a snapshot may contain.
module snapshot_fields
   implicit none
   private

   public :: field_type, find_field

   !> A field.
   type :: field_type
      character(24) :: name = ''
      character(4) :: units = ''
      character(80) :: long_name = ''
   end type field_type

   type(field_type), parameter :: known_fields(*) = [ &
      field_type('pressure', 'Pa', 'normal traction on the rubber, pressure positive'), &
      field_type('gap', 'm', 'gap between rubber and road'), &
      field_type('displacement_z', 'm', 'displacement of the rubber along z'), &
      field_type('road_height', 'm', 'height of the road in its present position under the rubber'), &
      field_type('traction_x', 'Pa', 'tangential traction on the rubber along x'), &
      field_type('traction_y', 'Pa', 'tangential traction on the rubber along y'), &
      field_type('displacement_x', 'm', 'displacement of the rubber along x'), &
      field_type('displacement_y', 'm', 'displacement of the rubber along y'), &
      field_type('slip_x', 'm', 'slip of the step along x'), &
      field_type('slip_y', 'm', 'slip of the step along y'), &
      field_type('contact', '1', 'state of contact: 0 open, 1 stick, 2 slip')]

contains

   !> The field of a name; its name is blank if there is no such field.
   pure function find_field(name) result(field)
      character(*), intent(in) :: name
      type(field_type) :: field
      integer :: i

      do i = 1, size(known_fields)
         if (known_fields(i)%name == name) field = known_fields(i)
      end do
   end function find_field

end module snapshot_fields
