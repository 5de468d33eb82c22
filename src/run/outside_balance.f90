!> The energy balance seen from outside: what load and drive do, and what becomes of it.
!>
!>    work_load + work_drive = work_normal + work_tangential + energy_radiated + work_missing
!>
!> Load and drive are known at the ends of a step; their work is taken by the trapezoidal rule. Of the force
!> of friction, what accelerates the mass of the block does not reach the drive at its top. The right
!> side comes from the fields (modules viscoelastic_energy, tangential_state) and closes by itself. The
!> two sides share nothing but the solution, so that `work_missing` measures the error of the steps.
!>
!> An adhesive contact that snaps on or off within a step passes through states that are no
!> equilibrium, and the energy that it sets free leaves as waves that the model does not follow. Within
!> a step without such a jump the force lies between its values at both ends, so that the trapezoidal rule
!> errs by at most half the change of the force times the motion. Where outside work exceeds inside
!> work by more, no path of equilibria explains the excess, and all of it counts as radiated.
module outside_balance
   use history_row, only : history_row_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: book_outside

contains

   !> Bring the columns of the outside view up to date; all other works of the row are known.
   pure subroutine book_outside(before, drive_before, drive, inertia, abrupt, adhesive, row)
      type(history_row_type), intent(in) :: before   !! the row before
      real(dp), intent(in) :: drive_before(2)        !! horizontal force on the rubber in the row before, N
      real(dp), intent(in) :: drive(2)               !! the same now, N
      real(dp), intent(in) :: inertia(2)             !! the part of it that accelerated the mass, mean over the step, N
      logical, intent(in) :: abrupt                  !! a jump: its path is not known
      logical, intent(in) :: adhesive
      type(history_row_type), intent(inout) :: row
      real(dp) :: inside, excess, margin, motion(2), sunk

      inside = row%work_normal - before%work_normal + row%work_tangential - before%work_tangential
      if (abrupt) then
         ! What load and drive do in a jump is taken to be what it stores and loses.
         row%work_load = before%work_load + inside
         return
      end if
      sunk = row%displacement - before%displacement
      motion = [row%road_x - before%road_x, row%road_y - before%road_y]
      row%work_load = before%work_load + 0.5_dp*(before%force + row%force)*sunk
      row%work_drive = before%work_drive + dot_product(0.5_dp*(drive_before + drive) - inertia, motion)

      excess = row%work_load - before%work_load + row%work_drive - before%work_drive - inside
      margin = 0.5_dp*(abs((row%force - before%force)*sunk) + abs(dot_product(drive - drive_before, motion)))
      if (adhesive .and. excess > margin) then
         row%energy_radiated = before%energy_radiated + excess
      else
         row%work_missing = before%work_missing + excess
      end if
   end subroutine book_outside

end module outside_balance
