!> The energy balance seen from outside: the work of the load and of the drive, and where it goes.
!>
!>    work_load + work_drive = work_normal + work_tangential + energy_radiated + work_missing
!>
!> The load and the force of the drive are known at both ends of a step, and their work is computed by the
!> trapezoidal rule. The part of the friction force that accelerates the mass of the block does not reach the
!> drive at the top of the block. The works on the right side are computed from the fields (modules
!> `viscoelastic_energy` and `tangential_state`), whose own balance closes exactly. The two sides have only the
!> solution in common, so that `work_missing` measures the error of the steps.
!>
!> An adhesive contact that snaps on or off within a step passes through states that are not in equilibrium, and
!> the energy that it sets free is radiated as waves, which the model does not contain. Within a step without
!> such a jump the force lies between its values at both ends, so that the error of the trapezoidal rule is at
!> most half the change of the force times the motion. If the work from outside exceeds the work inside by
!> more than this, no path of equilibria explains the excess, and all of it counts as radiated.
!>
!> If friction acts, the trapezoidal rule does not apply to the drive in the first step of a motion. On a half-space the
!> whole contact may slip after a small part of this step, with the force at its final value from then on; the mean of
!> both ends would be half of that. The work of the drive is then set equal to what the fields store and lose, but it
!> lies between the works that the forces at both ends would do. What is left is missing: a contact that was pressed
!> without friction sets energy free where it is steeper than the law of friction allows.
module outside_balance
   use history_row, only : history_row_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: book_outside

contains

   !> Update work_load, work_drive, energy_radiated and work_missing. All other works of the row are known.
   pure subroutine book_outside(before, drive_before, drive, inertia, abrupt, kinked, adhesive, row)
      type(history_row_type), intent(in) :: before   !! the row before
      real(dp), intent(in) :: drive_before(2)        !! horizontal force on the rubber in the row before, N
      real(dp), intent(in) :: drive(2)               !! the same now, N
      real(dp), intent(in) :: inertia(2)             !! the part of it that accelerated the mass, mean over the step, N
      logical, intent(in) :: abrupt                  !! the step is a jump, whose path is not known
      logical, intent(in) :: kinked                  !! the road with friction begins to move, also after a jump
      logical, intent(in) :: adhesive
      type(history_row_type), intent(inout) :: row
      real(dp) :: inside, excess, margin, motion(2), sunk, driven(2), work

      inside = row%work_normal - before%work_normal + row%work_tangential - before%work_tangential
      if (abrupt) then
         ! The work of the load in a jump is assumed to equal the energy that the jump stores and loses.
         row%work_load = before%work_load + inside
         return
      end if
      sunk = row%displacement - before%displacement
      motion = [row%road_x - before%road_x, row%road_y - before%road_y]
      row%work_load = before%work_load + 0.5_dp*(before%force + row%force)*sunk
      driven = [dot_product(drive_before - inertia, motion), dot_product(drive - inertia, motion)]
      work = 0.5_dp*sum(driven)
      if (kinked) work = min(max(inside - (row%work_load - before%work_load), minval(driven)), maxval(driven))
      row%work_drive = before%work_drive + work

      excess = row%work_load - before%work_load + work - inside
      margin = 0.5_dp*(abs((row%force - before%force)*sunk) + abs(driven(2) - driven(1)))
      if (adhesive .and. excess > margin) then
         row%energy_radiated = before%energy_radiated + excess
      else
         row%work_missing = before%work_missing + excess
      end if
   end subroutine book_outside

end module outside_balance
