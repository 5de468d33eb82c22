!> A row of the history: what is known of a step, with its names, units and meanings.
!>
!> A column is a component of `history_row_type` and a line in the lists below; its value is set in module
!> `row_account`. The result file, the checkpoint, Python and the documentation's test walk the table that the
!> lists make.
!>
!> Lengths, works and energies are those of the whole cell lx by ly; works and energies are
!> cumulative.
module history_row
   use asperity_precision, only : dp
   use state_table, only : state_table_type
   implicit none
   private

   public :: column_type, history_columns, history_row_type, list_columns, row_values

   !> What a column holds.
   type :: column_type
      character(24) :: name
      character(4) :: units
      character(80) :: long_name
      logical :: whole              !! holds whole numbers
   end type column_type

   !> One row. `list_columns` says what the components mean, and their units.
   type :: history_row_type
      integer :: step = 0
      integer :: phase = 0
      real(dp) :: time = 0.0_dp
      real(dp) :: pressure = 0.0_dp
      real(dp) :: force = 0.0_dp
      real(dp) :: displacement = 0.0_dp
      real(dp) :: contact_area = 0.0_dp
      real(dp) :: mean_gap = 0.0_dp
      real(dp) :: road_x = 0.0_dp
      real(dp) :: road_y = 0.0_dp
      real(dp) :: traction_x = 0.0_dp
      real(dp) :: traction_y = 0.0_dp
      real(dp) :: stick_area = 0.0_dp
      real(dp) :: sliding_speed = 0.0_dp
      real(dp) :: friction_viscous = 0.0_dp
      real(dp) :: friction = 0.0_dp
      real(dp) :: work_normal = 0.0_dp
      real(dp) :: work_tangential = 0.0_dp
      real(dp) :: work_load = 0.0_dp
      real(dp) :: work_drive = 0.0_dp
      real(dp) :: work_missing = 0.0_dp
      real(dp) :: energy_elastic = 0.0_dp
      real(dp) :: energy_adhesive = 0.0_dp
      real(dp) :: energy_kinetic = 0.0_dp
      real(dp) :: energy_radiated = 0.0_dp
      real(dp) :: dissipated_viscous = 0.0_dp
      real(dp) :: dissipated_numerical = 0.0_dp
      real(dp) :: dissipated_friction = 0.0_dp
      real(dp) :: power_viscous = 0.0_dp
      real(dp) :: power_friction = 0.0_dp
      integer :: iterations_normal = 0
      integer :: iterations_tangential = 0
      real(dp) :: residual_normal = 0.0_dp
      real(dp) :: residual_tangential = 0.0_dp
      integer :: passes = 0
      real(dp) :: residual_coupling = 0.0_dp
      real(dp) :: ffts = 0.0_dp
      real(dp) :: seconds = 0.0_dp
   end type history_row_type

contains

   !> The table of a row: name, units and meaning of each column, and where its value is.
   subroutine list_columns(row, table, prefix)
      type(history_row_type), intent(in), target :: row
      type(state_table_type), intent(inout) :: table
      character(*), intent(in) :: prefix           !! of all names

      call list_contact(row, table, prefix)
      call list_energies(row, table, prefix)
      call list_solution(row, table, prefix)
   end subroutine list_columns

   !> The columns of load, contact and motion.
   subroutine list_contact(row, table, prefix)
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
      call table%add(prefix//'stick_area', row%stick_area, '1', 'fraction of the grid that sticks')
      call table%add(prefix//'sliding_speed', row%sliding_speed, 'm/s', &
         'mean speed of the road over the rubber''s surface along the road''s velocity')
      call table%add(prefix//'friction_viscous', row%friction_viscous, '1', &
         '-mean(P dH/ds)/mean(P) along the road''s velocity')
      call table%add(prefix//'friction', row%friction, '1', &
         'apparent friction coefficient along the road''s velocity')
   end subroutine list_contact

   !> The columns of works, energies and losses.
   subroutine list_energies(row, table, prefix)
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
         'work_load + work_drive less all works and energies: the error of the steps')
      call table%add(prefix//'energy_elastic', row%energy_elastic, 'J', &
         'energy stored in the rubber')
      call table%add(prefix//'energy_adhesive', row%energy_adhesive, 'J', 'energy of adhesion')
      call table%add(prefix//'energy_kinetic', row%energy_kinetic, 'J', &
         'kinetic energy of the interface')
      call table%add(prefix//'energy_radiated', row%energy_radiated, 'J', &
         'energy set free by jumps of an adhesive contact within a step')
      call table%add(prefix//'dissipated_viscous', row%dissipated_viscous, 'J', &
         'energy lost in the rubber, the scheme''s own loss included')
      call table%add(prefix//'dissipated_numerical', row%dissipated_numerical, 'J', &
         'the part of the lost energy that is the scheme''s own')
      call table%add(prefix//'dissipated_friction', row%dissipated_friction, 'J', &
         'energy lost by friction in the interface')
      call table%add(prefix//'power_viscous', row%power_viscous, 'W', &
         'rate of loss in the rubber; mean over the step, or of the steady state')
      call table%add(prefix//'power_friction', row%power_friction, 'W', &
         'rate of loss by friction; mean over the step, or of the steady state')
   end subroutine list_energies

   !> The columns of how the solvers found the row.
   subroutine list_solution(row, table, prefix)
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
         'mismatch of the road under the surface found and the road solved on')
      call table%add(prefix//'ffts', row%ffts, '1', 'real transforms of the size of the grid')
      call table%add(prefix//'seconds', row%seconds, 's', 'wall time of the solvers')
   end subroutine list_solution

   !> The columns in their order.
   function history_columns() result(columns)
      type(column_type), allocatable :: columns(:)
      type(history_row_type), target :: row
      type(state_table_type) :: table
      integer :: i

      call list_columns(row, table, '')
      allocate (columns(table%count))
      do i = 1, table%count
         associate (piece => table%pieces(i))
            columns(i) = column_type(piece%name, piece%units, piece%meaning, &
               associated(piece%whole))
         end associate
      end do
   end function history_columns

   !> A row as an array of reals, in the order of `history_columns`.
   function row_values(row) result(values)
      type(history_row_type), intent(in), target :: row
      real(dp), allocatable :: values(:)
      type(state_table_type) :: table
      integer :: i

      call list_columns(row, table, '')
      allocate (values(table%count))
      do i = 1, table%count
         associate (piece => table%pieces(i))
            if (associated(piece%whole)) then
               values(i) = real(piece%whole, dp)
            else
               values(i) = piece%real_0
            end if
         end associate
      end do
   end function row_values

end module history_row
