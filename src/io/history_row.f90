!> A row of the history: the numbers that describe a step.
!>
!> The declarations of `history_row_type` define the columns of the history. The comment behind a
!> component gives its units and its meaning: `[units] meaning`, or the meaning alone if the component
!> is an integer. `python tools/make_types.py` derives from them the list of columns in module
!> `history_list`, which the result file and the checkpoint use, and the descriptions for Python and the
!> documentation. A new column is therefore one line below; module `row_account` computes its value.
!>
!> Lengths, works and energies are those of the whole cell lx by ly; works and energies are
!> cumulative.
module history_row
   use asperity_precision, only : dp
   implicit none
   private

   public :: history_row_type

   !> One row.
   type :: history_row_type
      ! Load, contact and motion.
      integer :: step = 0                       !! number of the row
      integer :: phase = 0                      !! number of the phase, from 1
      real(dp) :: time = 0.0_dp                 !! [s] time
      real(dp) :: pressure = 0.0_dp             !! [Pa] mean normal pressure
      real(dp) :: force = 0.0_dp                !! [N] normal force
      real(dp) :: displacement = 0.0_dp         !! [m] approach of the far rubber from first touch
      real(dp) :: contact_area = 0.0_dp         !! [1] fraction of the grid in contact
      real(dp) :: mean_gap = 0.0_dp             !! [m] mean gap
      real(dp) :: road_x = 0.0_dp               !! [m] displacement of the road along x
      real(dp) :: road_y = 0.0_dp               !! [m] displacement of the road along y
      real(dp) :: traction_x = 0.0_dp           !! [Pa] mean tangential traction on the rubber along x
      real(dp) :: traction_y = 0.0_dp           !! [Pa] mean tangential traction on the rubber along y
      real(dp) :: stick_area = 0.0_dp           !! [1] fraction of the grid that sticks: its slip is zero to the tolerance
      real(dp) :: sliding_speed = 0.0_dp        !! [m/s] mean speed of the road over the rubber's surface along the road's velocity
      real(dp) :: friction_viscous = 0.0_dp     !! [1] -mean(P dH/ds)/mean(P) along the road's velocity
      real(dp) :: friction = 0.0_dp             !! [1] apparent friction coefficient along the road's velocity

      ! Works, energies and losses.
      real(dp) :: work_normal = 0.0_dp          !! [J] work of the normal traction, with the change of the adhesive energy
      real(dp) :: work_tangential = 0.0_dp      !! [J] work of the tangential traction and of the driven mass
      real(dp) :: work_load = 0.0_dp            !! [J] normal force times displacement, summed over the steps
      real(dp) :: work_drive = 0.0_dp           !! [J] horizontal force of the drive times displacement of the road, summed
      real(dp) :: work_missing = 0.0_dp         !! [J] work_load + work_drive - work_normal - work_tangential - energy_radiated
      real(dp) :: energy_elastic = 0.0_dp       !! [J] energy stored in the rubber
      real(dp) :: energy_adhesive = 0.0_dp      !! [J] energy of adhesion
      real(dp) :: energy_kinetic = 0.0_dp       !! [J] kinetic energy of the interface
      real(dp) :: energy_radiated = 0.0_dp      !! [J] energy set free by jumps of an adhesive contact within a step
      real(dp) :: dissipated_viscous = 0.0_dp   !! [J] energy lost in the rubber, including the loss of the time scheme
      real(dp) :: dissipated_numerical = 0.0_dp !! [J] the part of this energy that the time scheme lost
      real(dp) :: dissipated_friction = 0.0_dp  !! [J] energy lost by friction in the interface
      real(dp) :: power_viscous = 0.0_dp        !! [W] rate of loss in the rubber; mean over the step, or of the steady state
      real(dp) :: power_friction = 0.0_dp       !! [W] rate of loss by friction; mean over the step, or of the steady state

      ! The solution of the row.
      integer :: iterations_normal = 0          !! iterations of the normal solver
      integer :: iterations_tangential = 0      !! iterations of the tangential solver
      real(dp) :: residual_normal = 0.0_dp      !! [1] residual of the normal solution, recomputed
      real(dp) :: residual_tangential = 0.0_dp  !! [1] residual of the tangential solution, recomputed
      integer :: passes = 0                     !! passes of a step with friction
      real(dp) :: residual_coupling = 0.0_dp    !! [1] error of the last pass: change of the road under the rubber, relative
      real(dp) :: ffts = 0.0_dp                 !! [1] real transforms of the size of the operator; smaller ones count in part
      real(dp) :: seconds = 0.0_dp              !! [s] wall time of the solvers
   end type history_row_type

end module history_row
