!> A road that is pulled by a force instead of driven at a velocity: its expected and its computed position.
!>
!> The tangential solver finds the motion of the road in a row (modules `friction_pull` and `road_pull`). Before
!> that, the row uses the motion of the last step as a guess, or rest where a pull begins. The guess affects results
!> only within the tolerance, because heights are read at U_T - D, and this difference does not depend on it.
module pulled_road
   use asperity_precision, only : dp
   use case_phases, only : most_cells_per_step
   use regular_grid, only : grid_type
   use asperity_schedule, only : planned_row_type, schedule_type
   use tangential_step, only : tangential_step_type
   use text_tools, only : to_text
   implicit none
   private

   public :: drive_direction, guess_road, pull_outcome, place_pulled_road, watch_motion

contains

   !> Set the direction in which a row drives the road: that of its velocity, or that of the pull if the road is only
   !> pulled. Without either the direction does not change.
   pure subroutine drive_direction(plan, direction)
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(inout) :: direction(2)
      real(dp) :: drive(2)
      logical :: rests

      ! A jump does not move a road that is driven. Before the first motion there is no direction.
      rests = .not. (plan%dt > 0.0_dp .or. any(abs(direction) > 0.0_dp))
      drive = merge(0.0_dp, plan%velocity, plan%pulled .or. rests)
      if (.not. any(abs(drive) > 0.0_dp)) drive = merge(plan%pull, 0.0_dp, plan%pulled)
      if (any(abs(drive) > 0.0_dp)) direction = drive/norm2(drive)
   end subroutine drive_direction

   !> Assume that the road moves as in the last step along the directions in which it is pulled. Where a pull begins, the road
   !> is assumed to rest: its speed before is no guide to how far the pull moves it, and a pass that reads the road at a wrong
   !> place may find a contact that cannot hold the pull.
   subroutine guess_road(plan, road, velocity)
      type(planned_row_type), intent(inout) :: plan
      real(dp), intent(in) :: road(2)               !! displacement of the road at the last row, m
      real(dp), intent(in) :: velocity(2)           !! of the road in the last step, m/s

      where (plan%pulled)
         plan%velocity = merge(velocity, 0.0_dp, plan%dt > 0.0_dp .and. .not. plan%new_speed)
         plan%road = road + plan%dt*plan%velocity
      end where
   end subroutine guess_road

   !> Set the position of the road to the one that was computed.
   subroutine place_pulled_road(plan, schedule, tangential, moved, road, velocity)
      type(planned_row_type), intent(inout) :: plan
      type(schedule_type), intent(inout) :: schedule
      type(tangential_step_type), intent(inout) :: tangential
      logical, intent(in) :: moved                  !! the road has moved: friction acts
      real(dp), intent(in) :: road(2)               !! displacement of the road at the last row, m
      real(dp), intent(inout) :: velocity(2)        !! of the road in the step, m/s
      real(dp) :: motion(2)

      if (.not. any(plan%pulled)) return
      motion = 0.0_dp
      if (moved) call tangential%correct_motion(motion)
      if (plan%dt > 0.0_dp) velocity = merge(motion/plan%dt, velocity, plan%pulled)
      where (plan%pulled)
         plan%road = road + motion
         schedule%start_road = plan%road
         plan%velocity = velocity
      end where
   end subroutine place_pulled_road

   !> Warn, once in a run, if a pull moves the road so far in a step that the contact is not resolved in time. For a road
   !> that is driven, module `case_phases` checks this before the run.
   subroutine watch_motion(plan, grid, road, reported, message)
      type(planned_row_type), intent(in) :: plan
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: road(2)               !! displacement of the road at the last row, m
      logical, intent(inout) :: reported            !! the warning has been given
      character(:), allocatable, intent(out) :: message
      real(dp) :: cells

      message = ''
      if (reported .or. .not. any(plan%pulled)) return
      cells = abs(plan%road(1) - road(1))/grid%dx
      if (grid%ny > 1) cells = max(cells, abs(plan%road(2) - road(2))/grid%dy)
      if (cells <= most_cells_per_step) return
      reported = .true.
      message = 'the pull moves the road by '//to_text(cells)//' cells in a step; the contact is well '// &
         'followed up to one cell per step: '
      if (plan%dt > 0.0_dp) then
         message = message//'dt = '//to_text(plan%dt/cells)//' s'
      else
         message = message//'let the pull grow along a ramp instead of at once'
      end if
   end subroutine watch_motion

   !> Explain why a row has no solution if the friction can hold neither the pull nor the pressures on the slopes.
   function pull_outcome(plan, tangential) result(reason)
      type(planned_row_type), intent(in) :: plan
      type(tangential_step_type), intent(in) :: tangential
      character(:), allocatable :: reason

      associate (pull => norm2(merge(plan%pull, 0.0_dp, plan%pulled)), held => norm2(tangential%road_pull%held))
         reason = 'the road is pulled by '//to_text(pull)//' Pa over the cell, and '
         if (held < pull) then
            reason = reason//'the friction holds at most '//to_text(held)//' Pa'
         else
            reason = reason//'the contact pushes it back with '//to_text(held)//' Pa or more, more than friction holds'
         end if
         reason = reason//', so that there is no equilibrium near its position. A block with density would accelerate'
      end associate
   end function pull_outcome

end module pulled_road
