!> The fields of a contact under the names that they have in a result. A few rows are copied at a time, never a
!> whole field. Row numbers are those of this process.
module contact_fields
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use asperity_precision, only : dp, int8
   use contact_model, only : contact_type
   use contact_rule, only : touches
   use friction_law, only : contact_open, contact_slip, contact_stick
   implicit none
   private

   public :: contact_rows, field_rows

contains

   !> Copy some rows of a field. The contact record has another type: see `contact_rows`.
   subroutine field_rows(self, name, first, values)
      class(contact_type), intent(in) :: self
      character(*), intent(in) :: name              !! as in /snapshots, except 'contact'
      integer, intent(in) :: first                  !! the first row
      real(dp), intent(out) :: values(:, :)         !! [nx, rows]
      integer :: last

      last = first + size(values, 2) - 1
      select case (name)
      case ('pressure')
         values = self%state%pressure(:, first:last)
      case ('gap')
         ! Cells that overlap by less than the tolerance count as touching.
         values = max(self%state%gap(:, first:last), 0.0_dp)
      case ('displacement_z')
         if (allocated(self%state%displacement)) then
            values = self%state%displacement(:, first:last)
         else if (self%state%first) then
            values = 0.0_dp
         else
            values = self%state%gap(:, first:last) + self%height(:, first:last) + self%state%level
         end if
      case ('road_height')
         values = self%height(:, first:last)
      case default
         call friction_rows(self, name, first, last, values)
      end select
   end subroutine field_rows

   !> Some rows of a field of friction, which is zero without friction. A field of an unknown name is not a number.
   subroutine friction_rows(self, name, first, last, values)
      class(contact_type), intent(in) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: first, last
      real(dp), intent(out) :: values(:, :)

      values = 0.0_dp
      if (.not. self%frictional) return
      associate (tangential => self%state%tangential)
         select case (name)
         case ('traction_x')
            values = tangential%traction(:, 1, first:last)
         case ('traction_y')
            values = tangential%traction(:, 2, first:last)
         case ('displacement_x')
            values = tangential%displacement(:, 1, first:last)
         case ('displacement_y')
            values = tangential%displacement(:, 2, first:last)
         case ('slip_x')
            values = slip_rows(self, 1, first, last)
         case ('slip_y')
            values = slip_rows(self, 2, first, last)
         case default
            values = ieee_value(1.0_dp, ieee_quiet_nan)
         end select
      end associate
   end subroutine friction_rows

   !> Some rows of the slip. It is not part of the state: it is not a number in a state that was saved or returned to,
   !> until the next row.
   function slip_rows(self, component, first, last) result(values)
      class(contact_type), intent(in) :: self
      integer, intent(in) :: component, first, last
      real(dp) :: values(self%grid%nx, last - first + 1)

      if (self%slip_known) then
         values = self%tangential%slip(:, component, first:last)
      else
         values = ieee_value(1.0_dp, ieee_quiet_nan)
      end if
   end function slip_rows

   !> Copy some rows of the contact record: 0 open, 1 stick, 2 slip. Without friction all cells in contact slip; with
   !> friction they all stick until the road moves.
   subroutine contact_rows(self, first, states)
      class(contact_type), intent(in) :: self
      integer, intent(in) :: first                  !! the first row
      integer(int8), intent(out) :: states(:, :)    !! [nx, rows]
      integer(int8) :: touching
      integer :: j, k

      touching = contact_slip
      if (self%all_cells_stick()) touching = contact_stick
      do k = 1, size(states, 2)
         j = first + k - 1
         if (self%friction_acts()) then
            states(:, k) = self%state%tangential%contact(:, j)
         else
            states(:, k) = merge(touching, contact_open, &
               touches(self%normal%adhesive, self%state%pressure(:, j), self%state%gap(:, j)))
         end if
      end do
   end subroutine contact_rows

end module contact_fields
