!> Fills the row of the history for a step: means over the cells, forces, works and losses.
module row_account
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use contact_rule, only : touches
   use field_sums, only : row_totals
   use history_row, only : history_row_type
   use outside_balance, only : book_outside
   use prony, only : instantaneous_modulus
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: account, found_step_type

   !> Largest pressure that counts as round-off, over the modulus.
   real(dp), parameter :: round_off = 1e-20_dp

   !> The outcome of solving a step.
   type :: found_step_type
      type(solver_result_type) :: normal             !! all normal solves
      type(solver_result_type) :: tangential         !! all tangential solves
      integer :: passes = 0                          !! of a step with friction
      real(dp) :: mismatch = 0.0_dp                  !! coupling residual of the last pass
      real(dp) :: viscous_force(2) = 0.0_dp          !! steady rows: mean of -P grad H, from the losses, Pa
      real(dp) :: power_viscous = 0.0_dp             !! steady rows: W
      real(dp) :: power_friction = 0.0_dp            !! steady rows: W
   end type found_step_type

   !> Sums over the cells.
   type :: cell_sums_type
      real(dp) :: pressure = 0.0_dp                  !! of P, Pa
      real(dp) :: touching = 0.0_dp                  !! cells in contact
      real(dp) :: gap = 0.0_dp                       !! m
      real(dp) :: force(2) = 0.0_dp                  !! of -P grad H, N
      real(dp) :: outside(2) = 0.0_dp                !! the part of the force outside the contact, N
   end type cell_sums_type

contains

   !> Make the row for a step that has been committed. It becomes the last row of the state.
   subroutine account(contact, plan, found)
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      type(found_step_type), intent(in) :: found
      type(history_row_type) :: row
      type(cell_sums_type) :: sums
      real(dp) :: force(2), inertia(2)
      logical :: kinked

      sums = sum_cells(contact)
      force = sums%force
      row = contact%state%row
      call fill_contact(contact, plan, sums, row)
      call fill_energies(contact, row)
      inertia = 0.0_dp
      kinked = .false.
      if (contact%frictional) then
         inertia = contact%state%tangential%block%inertia
         kinked = contact%friction_acts() .and. (plan%new_speed .or. contact%tangential%starts)
         call fill_friction(contact, plan, sums%outside, force, row)
      end if
      if (contact%all_cells_stick()) row%stick_area = row%contact_area
      call fill_powers(contact, plan, row)
      if (plan%steady) call fill_steady(contact, found, row, force)
      row%friction = 0.0_dp
      if (is_loaded(contact, row%pressure) .and. any(abs(contact%state%direction) > 0.0_dp)) &
         row%friction = dot_product(force, contact%state%direction)/row%force
      call fill_solution(contact, found, row)
      call book_outside(contact%state%row, contact%state%drive_force, force, inertia, &
         plan%steady .or. (plan%instantaneous .and. .not. plan%ramped), kinked, contact%normal%adhesive, row)
      contact%state%drive_force = force
      contact%state%row = row
   end subroutine account

   !> Form the sums over the cells that a row needs, in one pass.
   function sum_cells(contact) result(found)
      class(contact_type), intent(in) :: contact
      type(cell_sums_type) :: found
      real(dp), allocatable :: rows(:, :)
      logical, allocatable :: touching(:)
      real(dp) :: sums(7), area
      integer :: j

      allocate (rows(7, contact%grid%rows()), source=0.0_dp)
      !$omp parallel do default(none) shared(contact, rows) private(j, touching)
      do j = 1, contact%grid%rows()
         associate (pressure => contact%state%pressure(:, j))
            rows(1, j) = sum(pressure)
            touching = touches(contact%normal%adhesive, pressure, contact%state%gap(:, j))
            rows(2, j) = count(touching)
            rows(3, j) = sum(contact%state%gap(:, j))
            if (.not. contact%slides) cycle
            rows(4, j) = sum(pressure*contact%slope_x(:, j))
            rows(5, j) = sum(pressure*contact%slope_y(:, j))
            if (.not. contact%normal%adhesive) cycle
            rows(6, j) = sum(pressure*contact%slope_x(:, j), .not. touching)
            rows(7, j) = sum(pressure*contact%slope_y(:, j), .not. touching)
         end associate
      end do
      sums = row_totals(rows)
      area = contact%grid%cell_area()
      found = cell_sums_type(sums(1), sums(2), sums(3), 0.0_dp - sums(4:5)*area, -sums(6:7)*area)
   end function sum_cells

   !> Fill in the load, the contact, the position of the road, and the viscous friction.
   subroutine fill_contact(contact, plan, sums, row)
      class(contact_type), intent(in) :: contact
      type(planned_row_type), intent(in) :: plan
      type(cell_sums_type), intent(in) :: sums
      type(history_row_type), intent(inout) :: row
      real(dp) :: cells

      cells = contact%grid%cells()
      row%step = contact%state%schedule%row
      row%phase = plan%phase
      row%time = plan%time
      row%pressure = sums%pressure/cells
      row%force = row%pressure*contact%grid%area()
      row%displacement = contact%state%level + contact%summit
      row%contact_area = sums%touching/cells
      row%mean_gap = max(sums%gap, 0.0_dp)/cells    ! it may be slightly negative, by the round-off of the level
      row%road_x = plan%road(1)
      row%road_y = plan%road(2)
      row%sliding_speed = 0.0_dp                    ! without friction the surface does not move along the road
      if (plan%dt > 0.0_dp) row%sliding_speed = dot_product(contact%state%velocity, contact%state%direction)
      row%friction_viscous = 0.0_dp
      if (is_loaded(contact, row%pressure)) row%friction_viscous = &
         dot_product(sums%force, contact%state%direction)/(sums%pressure*contact%grid%cell_area())
   end subroutine fill_contact

   !> Is there a load, to which a horizontal force can be compared? Where adhesive surfaces have separated at a given
   !> displacement, the pressure that is left is round-off.
   pure logical function is_loaded(contact, pressure)
      class(contact_type), intent(in) :: contact
      real(dp), intent(in) :: pressure                 !! mean, Pa

      is_loaded = abs(pressure) > round_off*instantaneous_modulus(contact%material%g_e, contact%material%g)
   end function is_loaded

   !> Fill in the works and energies of the normal side.
   subroutine fill_energies(contact, row)
      class(contact_type), intent(in) :: contact
      type(history_row_type), intent(inout) :: row

      associate (books => contact%state%books)
         row%energy_adhesive = contact%normal%energy(contact%state%gap)
         row%work_normal = books%work + row%energy_adhesive
         row%energy_elastic = books%stored
         row%dissipated_viscous = books%dissipated
         row%dissipated_numerical = books%numerical
      end associate
   end subroutine fill_energies

   !> Fill in the columns of friction, and complete the horizontal force. With the slope effect T contains
   !> -P grad H in the contact; without it the two are added.
   subroutine fill_friction(contact, plan, outside, force, row)
      class(contact_type), intent(in) :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: outside(2)            !! sum of -P grad H outside the contact, N
      real(dp), intent(inout) :: force(2)           !! in: sum of -P grad H; out: all of it, N
      type(history_row_type), intent(inout) :: row
      real(dp) :: traction(2), slip(2)

      associate (t => contact%state%tangential)
         call contact%tangential%sums(t, traction, row%stick_area, slip)
         row%traction_x = traction(1)
         row%traction_y = traction(2)
         if (contact%tangential%law%slope_effect .and. t%moved) force = outside
         force = force + traction*contact%grid%area()
         row%sliding_speed = 0.0_dp
         if (plan%dt > 0.0_dp) then
            row%sliding_speed = dot_product(slip, contact%state%direction)/plan%dt
         else if (t%block%mass > 0.0_dp) then
            ! The mass keeps its speed in a jump of the load.
            row%sliding_speed = 0.0_dp - dot_product(t%block%speed, contact%state%direction)   ! not -0
         end if
         row%work_tangential = t%books%work + t%block%work + t%lost_friction
         row%energy_elastic = row%energy_elastic + t%books%stored
         row%energy_kinetic = t%block%kinetic()
         row%dissipated_viscous = row%dissipated_viscous + t%books%dissipated + t%block%lost
         row%dissipated_numerical = row%dissipated_numerical + t%books%numerical + t%block%lost
         row%dissipated_friction = t%lost_friction
      end associate
   end subroutine fill_friction

   !> Fill in the rates of loss, which are means over a step.
   subroutine fill_powers(contact, plan, row)
      class(contact_type), intent(in) :: contact
      type(planned_row_type), intent(in) :: plan
      type(history_row_type), intent(inout) :: row

      row%power_viscous = 0.0_dp
      row%power_friction = 0.0_dp
      if (.not. plan%dt > 0.0_dp) return
      associate (before => contact%state%row)
         row%power_viscous = (row%dissipated_viscous - before%dissipated_viscous)/plan%dt
         row%power_friction = (row%dissipated_friction - before%dissipated_friction)/plan%dt
      end associate
   end subroutine fill_powers

   !> Replace quantities that are known more accurately in steady sliding than from the sums over the cells.
   subroutine fill_steady(contact, found, row, force)
      class(contact_type), intent(in) :: contact
      type(found_step_type), intent(in) :: found
      type(history_row_type), intent(inout) :: row
      real(dp), intent(inout) :: force(2)           !! in: from the slopes of the mesh; out: from the losses, N
      real(dp) :: viscous

      viscous = dot_product(found%viscous_force, contact%state%direction)/row%pressure
      force = force + contact%state%direction*((viscous - row%friction_viscous)*row%force)
      row%friction_viscous = viscous
      row%power_viscous = found%power_viscous
      row%power_friction = found%power_friction
      row%sliding_speed = norm2(contact%state%velocity)
   end subroutine fill_steady

   !> Fill in the iterations, times and residuals of the solvers.
   subroutine fill_solution(contact, found, row)
      class(contact_type), intent(in) :: contact
      type(found_step_type), intent(in) :: found
      type(history_row_type), intent(inout) :: row

      row%iterations_normal = found%normal%iterations
      row%residual_normal = found%normal%residual
      if (contact%frictional) then
         row%iterations_tangential = found%tangential%iterations
         row%residual_tangential = found%tangential%residual
      end if
      row%passes = found%passes
      row%residual_coupling = found%mismatch
      row%ffts = real(found%normal%ffts + found%tangential%ffts, dp)
      row%seconds = found%normal%seconds
   end subroutine fill_solution

end module row_account
