!> The motion of the road under the rubber at the start of a row.
!>
!> The road moves on, and the fields that belong to places of the road (pressure, tractions, states
!> of contact) are shifted with it by whole cells: they are the best start for the solvers. The
!> rubber's surface is expected to move on as in the step before.
module road_motion
   use contact_model, only : contact_type, place_road
   use asperity_precision, only : dp, int8
   use pulled_road, only : drive_direction
   use regular_grid, only : boundary_free
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
      if (self%rubs()) then
         ! The surface is expected to move on as in the step before; where the road starts, with it.
         drift = self%state%tangential%rate*plan%dt
         if (plan%new_speed .and. .not. any(abs(self%state%velocity) > 0.0_dp)) &
            drift = [plan%velocity_x, plan%velocity_y]*plan%dt
      end if
      self%state%velocity = [plan%velocity_x, plan%velocity_y]
      self%drift = drift
      self%state%drifted = self%state%drifted + drift
      seen = [plan%road_x, plan%road_y] - self%state%drifted
      cells = nint(seen/[self%grid%dx, self%grid%dy])
      if (any(cells /= self%state%moved_cells)) then
         call shift_fields(self, cells - self%state%moved_cells)
         self%state%moved_cells = cells
      end if
      ! With friction the passes read the road where the surface is.
      if (.not. self%rubs()) call place_road(self, plan%road_x, plan%road_y)
   end subroutine move_road

   !> Shift by whole cells what moves with the road.
   subroutine shift_fields(self, cells)
      class(contact_type), intent(inout) :: self
      integer, intent(in) :: cells(2)
      real(dp), pointer, contiguous :: moved(:, :)
      logical :: free
      integer :: c

      free = self%grid%boundary == boundary_free
      call self%work%lend('moved field', moved)
      call shift_field(cells, free, self%state%pressure, moved)
      if (self%side%adhesive .and. .not. free) call shift_field(cells, free, self%state%gap, moved)
      if (self%rubs()) then
         do c = 1, 2
            call shift_field(cells, free, self%state%tangential%traction(:, c, :), moved)
            call shift_field(cells, free, self%state%tangential%before(:, c, :), moved)
         end do
         call shift_states(cells, free, self%state%tangential%contact)
      end if
      call self%work%take_back(moved)
   end subroutine shift_fields

   !> Shift a field by whole cells; what enters a free map is zero.
   subroutine shift_field(cells, free, field, moved)
      integer, intent(in) :: cells(2)
      logical, intent(in) :: free
      real(dp), intent(inout) :: field(:, :)
      real(dp), intent(inout) :: moved(:, :)           !! scratch
      integer :: i, j, from_i, from_j, nx, ny

      nx = size(field, 1)
      ny = size(field, 2)
      !$omp parallel do default(none) shared(field, moved, cells, free, nx, ny) &
      !$omp private(i, j, from_i, from_j)
      do j = 1, ny
         from_j = j - cells(2)
         do i = 1, nx
            from_i = i - cells(1)
            if (.not. free) then
               moved(i, j) = field(modulo(from_i - 1, nx) + 1, modulo(from_j - 1, ny) + 1)
            else if (from_i >= 1 .and. from_i <= nx .and. from_j >= 1 .and. from_j <= ny) then
               moved(i, j) = field(from_i, from_j)
            else
               moved(i, j) = 0.0_dp
            end if
         end do
      end do
      field(:, :) = moved
   end subroutine shift_field

   !> The same for the states of contact.
   subroutine shift_states(cells, free, states)
      integer, intent(in) :: cells(2)
      logical, intent(in) :: free
      integer(int8), intent(inout) :: states(:, :)

      if (free) then
         states(:, :) = eoshift(eoshift(states, -cells(1), dim=1), -cells(2), dim=2)
      else
         states(:, :) = cshift(cshift(states, -cells(1), dim=1), -cells(2), dim=2)
      end if
   end subroutine shift_states

end module road_motion
