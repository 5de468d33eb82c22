!> A row of the history: what is known of a step, with its names, units and meanings.
!>
!> Lengths, works and energies are those of the whole cell lx by ly; works and energies are cumulative.
module history_row
   use precision, only : dp
   implicit none
   private

   public :: column_type, history_columns, history_row_type, row_values, row_from_values

   integer, parameter, public :: column_count = 36     !! number of columns

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
      real(dp) :: work_drive = 0.0_dp       !! horizontal force times displacement of the road, summed over the steps, J
      real(dp) :: energy_elastic = 0.0_dp   !! energy stored in the rubber, J
      real(dp) :: energy_adhesive = 0.0_dp  !! energy of adhesion, J
      real(dp) :: energy_kinetic = 0.0_dp   !! kinetic energy of the interface, J
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
            'horizontal force times displacement of the road, summed over the steps', .false.), &
         column_type('energy_elastic', 'J', 'energy stored in the rubber', .false.), &
         column_type('energy_adhesive', 'J', 'energy of adhesion', .false.), &
         column_type('energy_kinetic', 'J', 'kinetic energy of the interface', .false.), &
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

   !> A row as an array of reals.
   pure function row_values(row) result(values)
      type(history_row_type), intent(in) :: row
      real(dp) :: values(column_count)

      values(1) = real(row%step, dp)
      values(2) = real(row%phase, dp)
      values(3) = row%time
      values(4) = row%pressure
      values(5) = row%force
      values(6) = row%displacement
      values(7) = row%contact_area
      values(8) = row%mean_gap
      values(9) = row%road_x
      values(10) = row%road_y
      values(11) = row%traction_x
      values(12) = row%traction_y
      values(13) = row%stick_area
      values(14) = row%sliding_speed
      values(15) = row%friction_viscous
      values(16) = row%friction
      values(17) = row%work_normal
      values(18) = row%work_tangential
      values(19) = row%work_load
      values(20) = row%work_drive
      values(21) = row%energy_elastic
      values(22) = row%energy_adhesive
      values(23) = row%energy_kinetic
      values(24) = row%dissipated_viscous
      values(25) = row%dissipated_numerical
      values(26) = row%dissipated_friction
      values(27) = row%power_viscous
      values(28) = row%power_friction
      values(29) = real(row%iterations_normal, dp)
      values(30) = real(row%iterations_tangential, dp)
      values(31) = row%residual_normal
      values(32) = row%residual_tangential
      values(33) = real(row%passes, dp)
      values(34) = row%residual_coupling
      values(35) = row%ffts
      values(36) = row%seconds
   end function row_values

   !> The row that `row_values` made into an array.
   pure function row_from_values(values) result(row)
      real(dp), intent(in) :: values(column_count)
      type(history_row_type) :: row

      row%step = nint(values(1))
      row%phase = nint(values(2))
      row%time = values(3)
      row%pressure = values(4)
      row%force = values(5)
      row%displacement = values(6)
      row%contact_area = values(7)
      row%mean_gap = values(8)
      row%road_x = values(9)
      row%road_y = values(10)
      row%traction_x = values(11)
      row%traction_y = values(12)
      row%stick_area = values(13)
      row%sliding_speed = values(14)
      row%friction_viscous = values(15)
      row%friction = values(16)
      row%work_normal = values(17)
      row%work_tangential = values(18)
      row%work_load = values(19)
      row%work_drive = values(20)
      row%energy_elastic = values(21)
      row%energy_adhesive = values(22)
      row%energy_kinetic = values(23)
      row%dissipated_viscous = values(24)
      row%dissipated_numerical = values(25)
      row%dissipated_friction = values(26)
      row%power_viscous = values(27)
      row%power_friction = values(28)
      row%iterations_normal = nint(values(29))
      row%iterations_tangential = nint(values(30))
      row%residual_normal = values(31)
      row%residual_tangential = values(32)
      row%passes = nint(values(33))
      row%residual_coupling = values(34)
      row%ffts = values(35)
      row%seconds = values(36)
   end function row_from_values

end module history_row
