!> A row of steady sliding within a run: its state, and what the arms remember of it where time goes on.
module steady_row
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use row_account, only : found_step_type
   use steady_step, only : steady_step_type
   use zener, only : finish_step
   implicit none
   private

   public :: slide_for_ever

contains

   !> Find the row's state, and put it in the place of the last one.
   subroutine slide_for_ever(contact, steady, plan, found)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(inout) :: steady
      type(planned_row_type), intent(inout) :: plan      !! the road moves to where the state finds it
      type(found_step_type), intent(inout) :: found

      associate (state => contact%state)
         steady%base = state%steady%base
         steady%last = state%steady%last
         steady%before = state%steady%before
         if (.not. state%steady%now) call steady%begin_curve([state%row%road_x, state%row%road_y])
         call steady%solve(plan, contact%road, found%normal, found%rubbing)
         state%steady%now = .true.
         state%steady%base = steady%base
         state%steady%last = steady%last
         state%steady%before = steady%before
      end associate
      found%viscous_force = steady%viscous_force
      found%power_viscous = steady%losses%normal + steady%losses%tangential
      found%power_friction = steady%power_friction
      call take_place(contact, steady, plan)
      call take_fields(contact, steady)
      call take_memory(contact, steady, plan)
   end subroutine slide_for_ever

   !> The road is where the state finds it.
   subroutine take_place(contact, steady, plan)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(in) :: steady
      type(planned_row_type), intent(inout) :: plan

      associate (state => contact%state)
         state%schedule%start_x = state%schedule%start_x + (steady%place(1) - plan%road_x)
         state%schedule%start_y = state%schedule%start_y + (steady%place(2) - plan%road_y)
         plan%road_x = steady%place(1)
         plan%road_y = steady%place(2)
         state%velocity = [plan%velocity_x, plan%velocity_y]
         state%direction = state%velocity/norm2(state%velocity)
         contact%drift = 0.0_dp
         state%moved_cells = nint((steady%place - state%drifted)/[contact%grid%dx, contact%grid%dy])
      end associate
   end subroutine take_place

   !> The contact of the state.
   subroutine take_fields(contact, steady)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(in) :: steady

      associate (state => contact%state, found => steady%contact)
         state%pressure(:, :) = found%pressure
         state%gap(:, :) = found%gap
         contact%height(:, :) = found%height
         contact%slope_x(:, :) = found%slope_x
         contact%slope_y(:, :) = found%slope_y
         state%level = found%level
         state%displacement(:, :) = found%gap + found%height + found%level
         state%first = .false.
      end associate
   end subroutine take_fields

   !> What the arms remember of the state, and its energies.
   subroutine take_memory(contact, steady, plan)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(inout) :: steady
      type(planned_row_type), intent(in) :: plan
      real(dp) :: next_dt

      next_dt = 0.0_dp
      if (size(contact%state%history%ds) > 0) next_dt = plan%next_dt
      call steady%remember_normal(next_dt, contact%state%history, contact%state%books)
      if (contact%frictional) then
         associate (tangential => contact%state%tangential)
            call contact%tangential%take_steady(tangential, steady%contact, contact%state%velocity)
            call steady%remember_tangential(next_dt, tangential%history, tangential%books)
         end associate
      end if
      call finish_step(contact%material)
      contact%material%dt_old = next_dt
      contact%state%dt_old = next_dt
   end subroutine take_memory

end module steady_row
