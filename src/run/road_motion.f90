!> The motion of the road under the rubber at the start of a row.
!>
!> The fields that belong to places of the road (pressure, tractions, contact record) are shifted with it by
!> whole cells, because this makes them a good start for the solvers. The surface of the rubber is expected to
!> continue the motion of the step before.
module road_motion
   use contact_model, only : contact_type, place_road
   use asperity_precision, only : dp
   use carried_field, only : shift_field, shift_states
   use pulled_road, only : drive_direction
   use regular_grid, only : boundary_periodic
   use asperity_schedule, only : planned_row_type
   implicit none
   private

   public :: move_road

contains

   !> Move the road, and the pressure with it.
   subroutine move_road(self, plan)
      class(contact_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      integer :: cells(2)
      real(dp) :: drift(2), seen(2)

      call drive_direction(plan, self%state%direction)
      if (.not. self%slides) return
      drift = 0.0_dp
      if (self%friction_acts()) then
         self%tangential%way_before = norm2(self%state%velocity)*self%state%tangential%last_dt
         ! The surface is expected to move as in the step before or, if the road has just started, with the road.
         drift = self%state%tangential%rate*plan%dt
         if (plan%new_speed .and. .not. any(abs(self%state%velocity) > 0.0_dp)) &
            drift = plan%velocity*plan%dt
      end if
      self%state%velocity = plan%velocity
      self%drift = drift
      self%state%drifted = self%state%drifted + drift
      seen = plan%road - self%state%drifted
      cells = nint(seen/[self%grid%dx, self%grid%dy])
      if (any(cells /= self%state%moved_cells)) then
         call shift_fields(self, cells - self%state%moved_cells)
         self%state%moved_cells = cells
      end if
      ! With friction the passes read the road at the displaced surface.
      if (.not. self%friction_acts()) call place_road(self, plan%road(1), plan%road(2))
   end subroutine move_road

   !> Shift the fields that move with the road by whole cells.
   subroutine shift_fields(self, cells)
      class(contact_type), intent(inout) :: self
      integer, intent(in) :: cells(2)
      real(dp), pointer, contiguous :: moved(:, :)
      integer :: c

      call self%work%lend('moved field', moved)
      call shift_field(self%grid, cells, self%state%pressure, moved)
      if (self%normal%adhesive .and. self%grid%boundary == boundary_periodic) &
         call shift_field(self%grid, cells, self%state%gap, moved)
      if (self%friction_acts()) then
         do c = 1, 2
            call shift_field(self%grid, cells, self%state%tangential%traction(:, c, :), moved)
            call shift_field(self%grid, cells, self%state%tangential%before(:, c, :), moved)
         end do
         call shift_states(self%grid, cells, self%state%tangential%contact)
      end if
      call self%work%take_back(moved)
   end subroutine shift_fields

end module road_motion
