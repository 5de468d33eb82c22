!> A row of steady sliding within a run: its state, and the state of the arms if the run continues in time.
module steady_row
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use friction_law, only : contact_open, contact_slip, contact_stick
   use row_account, only : found_step_type
   use steady_bound, only : largest_force
   use steady_contact, only : steady_contact_type
   use steady_step, only : steady_step_type
   use tangential_state, only : tangential_state_type
   use tangential_step, only : tangential_step_type
   use zener, only : finish_step
   implicit none
   private

   public :: solve_steady_row

contains

   !> Solve the row, and make its contact the state. After a solve that was stopped the caller restores the state.
   subroutine solve_steady_row(contact, steady, plan, found)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(inout) :: steady
      type(planned_row_type), intent(inout) :: plan      !! out: the road is where the contact of the state stands on it
      type(found_step_type), intent(inout) :: found

      associate (state => contact%state)
         if (.not. state%steady%now) call state%steady%begin_curve([state%row%road_x, state%row%road_y])
         call steady%solve(plan, contact%road, state%steady, found%normal, found%tangential)
         if (found%normal%stopped) return
         state%steady%now = .true.
      end associate
      found%viscous_force = steady%viscous_force
      found%power_viscous = steady%losses%normal + steady%losses%tangential
      found%power_friction = steady%power_friction
      call set_road(contact, steady, plan)
      call copy_contact(contact, steady)
      if (contact%frictional) &
         call copy_tractions(contact%tangential, contact%state%tangential, steady%contact, contact%state%velocity)
      call set_arms(contact, steady, plan)
   end subroutine solve_steady_row

   !> Move the road to the place that belongs to the state.
   subroutine set_road(contact, steady, plan)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(in) :: steady
      type(planned_row_type), intent(inout) :: plan

      associate (state => contact%state)
         state%schedule%start_road = state%schedule%start_road + (steady%place - plan%road)
         plan%road = steady%place
         state%velocity = plan%velocity
         state%direction = state%velocity/norm2(state%velocity)
         contact%drift = 0.0_dp
         state%moved_cells = nint((steady%place - state%drifted)/[contact%grid%dx, contact%grid%dy])
      end associate
   end subroutine set_road

   !> Copy the normal side of the contact to the state.
   subroutine copy_contact(contact, steady)
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
   end subroutine copy_contact

   !> Copy the tangential side of the contact to the state, without the state of the arms.
   subroutine copy_tractions(tangential, state, found, velocity)
      type(tangential_step_type), intent(inout) :: tangential
      type(tangential_state_type), intent(inout) :: state
      type(steady_contact_type), intent(in) :: found
      real(dp), intent(in) :: velocity(2)             !! of the road, m/s
      real(dp), parameter :: within = 1.0_dp + 1e-6_dp  !! s of the bound from which a point sticks
      real(dp) :: slope(2), star(2), pushed(2), before
      integer :: i, j

      before = state%block%kinetic()
      state%moved = .true.
      state%last_dt = 0.0_dp
      state%rate = 0.0_dp
      state%block%speed = -velocity
      state%block%fresh = .true.
      state%block%work = state%block%work + state%block%kinetic() - before
      !$omp parallel do default(none) shared(tangential, state, found) private(i, j, slope, star, pushed)
      do j = 1, tangential%grid%rows()
         do i = 1, tangential%grid%nx
            state%traction(i, :, j) = found%traction(i, :, j)
            state%displacement(i, :, j) = found%displacement(i, :, j)
            slope = [found%slope_x(i, j), found%slope_y(i, j)]
            star = tangential%law%normal_traction(found%pressure(i, j), slope)
            state%contact(i, j) = contact_open
            state%rubbing(i, :, j) = 0.0_dp
            state%force(i, j) = 0.0_dp
            if (found%pressure(i, j) <= 0.0_dp .and. .not. any(abs(found%traction(i, :, j)) > 0.0_dp)) cycle
            state%rubbing(i, :, j) = state%traction(i, :, j) - star
            state%force(i, j) = tangential%law%friction_force(found%pressure(i, j), slope, [1.0_dp, 1.0_dp])
            state%contact(i, j) = contact_slip
            if (.not. found%pressure(i, j) > 0.0_dp) cycle       ! partly sheared: it slips
            ! A traction that is only known to the tolerance may lie within the bound though the cell slips. The slip
            ! decides: added to the traction, it takes a slipping cell far out of the bound.
            pushed = state%rubbing(i, :, j) + largest_force(tangential%law, found%pressure(i, j))*found%slip(i, :, j)
            if (tangential%law%bound_ratio(found%pressure(i, j), slope, pushed) > within) &
               state%contact(i, j) = contact_stick
         end do
      end do
      state%before(:, :, :) = state%traction
      tangential%trial(:, :, :) = state%displacement
      tangential%slip(:, :, :) = 0.0_dp
   end subroutine copy_tractions

   !> Set the state of the arms, and the energies.
   subroutine set_arms(contact, steady, plan)
      class(contact_type), intent(inout) :: contact
      type(steady_step_type), intent(inout) :: steady
      type(planned_row_type), intent(in) :: plan
      real(dp) :: next_dt

      next_dt = 0.0_dp
      if (any_process(size(contact%state%arms%ds) > 0)) next_dt = plan%next_dt
      call steady%remember_normal(next_dt, contact%state%arms, contact%state%books)
      if (contact%frictional) then
         associate (tangential => contact%state%tangential)
            call steady%remember_tangential(next_dt, tangential%arms, tangential%books)
         end associate
      end if
      call finish_step(contact%material)
      contact%material%dt_old = next_dt
      contact%state%dt_old = next_dt
   end subroutine set_arms

end module steady_row
