!> A row of the history: what is known of a step, with its names, units and meanings.
!>
!> Lengths, works and energies are those of the whole cell lx by ly; works and energies are cumulative.
module history_row
   use asperity_precision, only : dp
   implicit none
   private

   public :: column_type, history_columns, history_row_type, row_values, row_from_values

   integer, parameter, public :: column_count = 38     !! number of columns

   !> What a column holds.
   type :: column_type
      character(24) :: name
      character(4) :: units
      character(80) :: long_name
      logical :: whole              !! holds whole numbers
   end type column_type

   !> One row.
   type :: history_row_type
      integer :: step = 0                   !! number of the row
      integer :: phase = 0                  !! number of the phase, from 1
      real(dp) :: time = 0.0_dp             !! time, s
      real(dp) :: pressure = 0.0_dp         !! mean normal pressure, Pa
      real(dp) :: force = 0.0_dp            !! normal force, N
      real(dp) :: displacement = 0.0_dp     !! approach of the far rubber from first touch, m
      real(dp) :: contact_area = 0.0_dp     !! fraction of the grid in contact
      real(dp) :: mean_gap = 0.0_dp         !! mean gap, m
      real(dp) :: road_x = 0.0_dp           !! displacement of the road along x, m
      real(dp) :: road_y = 0.0_dp           !! displacement of the road along y, m
      real(dp) :: traction_x = 0.0_dp       !! mean tangential traction on the rubber along x, Pa
      real(dp) :: traction_y = 0.0_dp       !! mean tangential traction on the rubber along y, Pa
      real(dp) :: stick_area = 0.0_dp       !! fraction of the grid that sticks
      real(dp) :: sliding_speed = 0.0_dp    !! speed of the road over the rubber, m/s
      real(dp) :: friction_viscous = 0.0_dp !! -mean(P dH/ds)/mean(P) along the road's velocity
      real(dp) :: friction = 0.0_dp         !! apparent friction coefficient along the road's velocity
      real(dp) :: work_normal = 0.0_dp      !! work of the normal traction, with the change of the adhesive energy, J
      real(dp) :: work_tangential = 0.0_dp  !! work of the tangential traction and of the driven mass, J
      real(dp) :: work_load = 0.0_dp        !! normal force times displacement, summed over the steps, J
      real(dp) :: work_drive = 0.0_dp       !! force of the drive times displacement of the road, summed over the steps, J
      real(dp) :: work_missing = 0.0_dp     !! work of load and drive that no other column accounts for, J
      real(dp) :: energy_elastic = 0.0_dp   !! energy stored in the rubber, J
      real(dp) :: energy_adhesive = 0.0_dp  !! energy of adhesion, J
      real(dp) :: energy_kinetic = 0.0_dp   !! kinetic energy of the interface, J
      real(dp) :: energy_radiated = 0.0_dp  !! energy set free by jumps of an adhesive contact within a step, J
      real(dp) :: dissipated_viscous = 0.0_dp!! energy lost in the rubber, the scheme's own loss included, J
      real(dp) :: dissipated_numerical = 0.0_dp!! the part of the lost energy that is the scheme's own, J
      real(dp) :: dissipated_friction = 0.0_dp!! energy lost by friction in the interface, J
      real(dp) :: power_viscous = 0.0_dp    !! rate of loss in the rubber, W
      real(dp) :: power_friction = 0.0_dp   !! rate of loss by friction in the interface, W
      integer :: iterations_normal = 0      !! iterations of the normal solver
      integer :: iterations_tangential = 0  !! iterations of the tangential solver
      real(dp) :: residual_normal = 0.0_dp  !! residual of the normal solution, recomputed
      real(dp) :: residual_tangential = 0.0_dp!! residual of the tangential solution, recomputed
      integer :: passes = 0                 !! passes of the step with friction
      real(dp) :: residual_coupling = 0.0_dp!! what remains of the coupling of both solutions
      real(dp) :: ffts = 0.0_dp             !! real transforms of the size of the grid
      real(dp) :: seconds = 0.0_dp          !! wall time of the solvers, s
   end type history_row_type

contains

   !> The columns in the order of `row_values`.
   pure function history_columns() result(columns)
      type(column_type) :: columns(column_count)

      columns = [ &
         column_type('step', '1', 'number of the row', .true.), &
         column_type('phase', '1', 'number of the phase, from 1', .true.), &
         column_type('time', 's', 'time', .false.), &
         column_type('pressure', 'Pa', 'mean normal pressure', .false.), &
         column_type('force', 'N', 'normal force', .false.), &
         column_type('displacement', 'm', 'approach of the far rubber from first touch', .false.), &
         column_type('contact_area', '1', 'fraction of the grid in contact', .false.), &
         column_type('mean_gap', 'm', 'mean gap', .false.), &
         column_type('road_x', 'm', 'displacement of the road along x', .false.), &
         column_type('road_y', 'm', 'displacement of the road along y', .false.), &
         column_type('traction_x', 'Pa', &
            'mean tangential traction on the rubber along x', .false.), &
         column_type('traction_y', 'Pa', &
            'mean tangential traction on the rubber along y', .false.), &
         column_type('stick_area', '1', 'fraction of the grid that sticks', .false.), &
         column_type('sliding_speed', 'm/s', &
            'mean speed of the road over the rubber''s surface along the road''s velocity', .false.), &
         column_type('friction_viscous', '1', &
            '-mean(P dH/ds)/mean(P) along the road''s velocity', .false.), &
         column_type('friction', '1', &
            'apparent friction coefficient along the road''s velocity', .false.), &
         column_type('work_normal', 'J', &
            'work of the normal traction, with the change of the adhesive energy', .false.), &
         column_type('work_tangential', 'J', &
            'work of the tangential traction and of the driven mass', .false.), &
         column_type('work_load', 'J', &
            'normal force times displacement, summed over the steps', .false.), &
         column_type('work_drive', 'J', &
            'horizontal force of the drive times displacement of the road, summed', .false.), &
         column_type('work_missing', 'J', &
            'work_load + work_drive less all works and energies: the error of the steps', .false.), &
         column_type('energy_elastic', 'J', 'energy stored in the rubber', .false.), &
         column_type('energy_adhesive', 'J', 'energy of adhesion', .false.), &
         column_type('energy_kinetic', 'J', 'kinetic energy of the interface', .false.), &
         column_type('energy_radiated', 'J', &
            'energy set free by jumps of an adhesive contact within a step', .false.), &
         column_type('dissipated_viscous', 'J', &
            'energy lost in the rubber, the scheme''s own loss included', .false.), &
         column_type('dissipated_numerical', 'J', &
            'the part of the lost energy that is the scheme''s own', .false.), &
         column_type('dissipated_friction', 'J', &
            'energy lost by friction in the interface', .false.), &
         column_type('power_viscous', 'W', &
            'rate of loss in the rubber; mean over the step, or of the steady state', .false.), &
         column_type('power_friction', 'W', &
            'rate of loss by friction; mean over the step, or of the steady state', .false.), &
         column_type('iterations_normal', '1', 'iterations of the normal solver', .true.), &
         column_type('iterations_tangential', '1', 'iterations of the tangential solver', .true.), &
         column_type('residual_normal', '1', &
            'residual of the normal solution, recomputed', .false.), &
         column_type('residual_tangential', '1', &
            'residual of the tangential solution, recomputed', .false.), &
         column_type('passes', '1', 'passes of a step with friction', .true.), &
         column_type('residual_coupling', '1', &
            'mismatch of the road under the surface found and the road solved on', .false.), &
         column_type('ffts', '1', 'real transforms of the size of the grid', .false.), &
         column_type('seconds', 's', 'wall time of the solvers', .false.)]
   end function history_columns

   !> A row as an array of reals, in the order of `history_columns`.
   pure function row_values(row) result(values)
      type(history_row_type), intent(in) :: row
      real(dp) :: values(column_count)

      values = [real(row%step, dp), real(row%phase, dp), row%time, row%pressure, row%force, &
         row%displacement, row%contact_area, row%mean_gap, row%road_x, row%road_y, &
         row%traction_x, row%traction_y, row%stick_area, row%sliding_speed, &
         row%friction_viscous, row%friction, row%work_normal, row%work_tangential, &
         row%work_load, row%work_drive, row%work_missing, row%energy_elastic, &
         row%energy_adhesive, row%energy_kinetic, row%energy_radiated, row%dissipated_viscous, &
         row%dissipated_numerical, row%dissipated_friction, row%power_viscous, &
         row%power_friction, real(row%iterations_normal, dp), &
         real(row%iterations_tangential, dp), row%residual_normal, row%residual_tangential, &
         real(row%passes, dp), row%residual_coupling, row%ffts, row%seconds]
   end function row_values

   !> The row that `row_values` made into an array.
   function row_from_values(values) result(row)
      real(dp), intent(in) :: values(column_count)
      type(history_row_type) :: row
      integer :: at                         !! number of the value read last

      at = 0
      row%step = nint(following())
      row%phase = nint(following())
      row%time = following()
      row%pressure = following()
      row%force = following()
      row%displacement = following()
      row%contact_area = following()
      row%mean_gap = following()
      row%road_x = following()
      row%road_y = following()
      row%traction_x = following()
      row%traction_y = following()
      row%stick_area = following()
      row%sliding_speed = following()
      row%friction_viscous = following()
      row%friction = following()
      row%work_normal = following()
      row%work_tangential = following()
      row%work_load = following()
      row%work_drive = following()
      row%work_missing = following()
      row%energy_elastic = following()
      row%energy_adhesive = following()
      row%energy_kinetic = following()
      row%energy_radiated = following()
      row%dissipated_viscous = following()
      row%dissipated_numerical = following()
      row%dissipated_friction = following()
      row%power_viscous = following()
      row%power_friction = following()
      row%iterations_normal = nint(following())
      row%iterations_tangential = nint(following())
      row%residual_normal = following()
      row%residual_tangential = following()
      row%passes = nint(following())
      row%residual_coupling = following()
      row%ffts = following()
      row%seconds = following()

   contains

      !> The next value.
      function following() result(value)
         real(dp) :: value

         at = at + 1
         value = values(at)
      end function following

   end function row_from_values

end module history_row
