!> The list of the columns of the history: name, units, meaning and variable of each.
!>
!> `python tools/make_types.py` writes this module from the declarations in module `history_row`.
module history_list
   use history_row, only : history_row_type
   use state_table, only : state_table_type
   implicit none
   private

   public :: list_columns

contains

   !> List all columns.
   subroutine list_columns(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix           !! of all names

      call list_section_1(row, table, prefix)
      call list_section_2(row, table, prefix)
      call list_section_3(row, table, prefix)
   end subroutine list_columns

   !> Load, contact and motion.
   subroutine list_section_1(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix

      call table%add(prefix//'step', row%step, 'number of the row')
      call table%add(prefix//'phase', row%phase, 'number of the phase, from 1')
      call table%add(prefix//'time', row%time, 's', 'time')
      call table%add(prefix//'pressure', row%pressure, 'Pa', 'mean normal pressure')
      call table%add(prefix//'force', row%force, 'N', 'normal force')
      call table%add(prefix//'displacement', row%displacement, 'm', &
         'approach of the far rubber from first touch')
      call table%add(prefix//'contact_area', row%contact_area, '1', &
         'fraction of the grid in contact')
      call table%add(prefix//'mean_gap', row%mean_gap, 'm', 'mean gap')
      call table%add(prefix//'road_x', row%road_x, 'm', 'displacement of the road along x')
      call table%add(prefix//'road_y', row%road_y, 'm', 'displacement of the road along y')
      call table%add(prefix//'traction_x', row%traction_x, 'Pa', &
         'mean tangential traction on the rubber along x')
      call table%add(prefix//'traction_y', row%traction_y, 'Pa', &
         'mean tangential traction on the rubber along y')
      call table%add(prefix//'stick_area', row%stick_area, '1', &
         'fraction of the grid that sticks: its slip is zero to the tolerance')
      call table%add(prefix//'sliding_speed', row%sliding_speed, 'm/s', &
         'mean speed of the road over the rubber''s surface along the road''s velocity')
      call table%add(prefix//'friction_viscous', row%friction_viscous, '1', &
         '-mean(P dH/ds)/mean(P) along the road''s velocity')
      call table%add(prefix//'friction', row%friction, '1', &
         'apparent friction coefficient along the road''s velocity')
   end subroutine list_section_1

   !> Works, energies and losses.
   subroutine list_section_2(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix

      call table%add(prefix//'work_normal', row%work_normal, 'J', &
         'work of the normal traction, with the change of the adhesive energy')
      call table%add(prefix//'work_tangential', row%work_tangential, 'J', &
         'work of the tangential traction and of the driven mass')
      call table%add(prefix//'work_load', row%work_load, 'J', &
         'normal force times displacement, summed over the steps')
      call table%add(prefix//'work_drive', row%work_drive, 'J', &
         'horizontal force of the drive times displacement of the road, summed')
      call table%add(prefix//'work_missing', row%work_missing, 'J', &
         'work_load + work_drive - work_normal - work_tangential - energy_radiated')
      call table%add(prefix//'energy_elastic', row%energy_elastic, 'J', &
         'energy stored in the rubber')
      call table%add(prefix//'energy_adhesive', row%energy_adhesive, 'J', 'energy of adhesion')
      call table%add(prefix//'energy_kinetic', row%energy_kinetic, 'J', &
         'kinetic energy of the interface')
      call table%add(prefix//'energy_radiated', row%energy_radiated, 'J', &
         'energy set free by jumps of an adhesive contact within a step')
      call table%add(prefix//'dissipated_viscous', row%dissipated_viscous, 'J', &
         'energy lost in the rubber, including the loss of the time scheme')
      call table%add(prefix//'dissipated_numerical', row%dissipated_numerical, 'J', &
         'the part of this energy that the time scheme lost')
      call table%add(prefix//'dissipated_friction', row%dissipated_friction, 'J', &
         'energy lost by friction in the interface')
      call table%add(prefix//'power_viscous', row%power_viscous, 'W', &
         'rate of loss in the rubber; mean over the step, or of the steady state')
      call table%add(prefix//'power_friction', row%power_friction, 'W', &
         'rate of loss by friction; mean over the step, or of the steady state')
   end subroutine list_section_2

   !> The solution of the row.
   subroutine list_section_3(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix

      call table%add(prefix//'iterations_normal', row%iterations_normal, &
         'iterations of the normal solver')
      call table%add(prefix//'iterations_tangential', row%iterations_tangential, &
         'iterations of the tangential solver')
      call table%add(prefix//'residual_normal', row%residual_normal, '1', &
         'residual of the normal solution, recomputed')
      call table%add(prefix//'residual_tangential', row%residual_tangential, '1', &
         'residual of the tangential solution, recomputed')
      call table%add(prefix//'passes', row%passes, 'passes of a step with friction')
      call table%add(prefix//'residual_coupling', row%residual_coupling, '1', &
         'error of the last pass: change of the road under the rubber, relative')
      call table%add(prefix//'ffts', row%ffts, '1', &
         'real transforms of the size of the operator; smaller ones count in part')
      call table%add(prefix//'seconds', row%seconds, 's', 'wall time of the solvers')
   end subroutine list_section_3

end module history_list
