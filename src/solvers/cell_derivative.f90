!> The derivatives of the equations of a cell (module `joint_system`), by finite differences of the friction law.
!>
!> The residuals of a cell depend on its own unknowns s and T, on the displacements U_z and U_T that all cells cause, and
!> on the slip. The road is read at the displaced cell, so that its height and its slopes change with U_T.
module cell_derivative
   use asperity_precision, only : dp
   use joint_cells, only : cell_rules_type
   implicit none
   private

   public :: cell_derivative_type, joint_cell_type, new_cell_derivative, numbers_per_derivative

   real(dp), parameter :: change = 1.0e-6_dp     !! of an unknown in a difference, scaled

   !> A cell, and the road under it.
   type :: joint_cell_type
      real(dp) :: s = 0.0_dp                     !! m
      real(dp) :: t(2) = 0.0_dp                  !! Pa
      real(dp) :: width = 0.0_dp                 !! of the second range of s, m
      real(dp) :: slip(2) = 0.0_dp               !! as the law reads it, m
      real(dp) :: slope(2) = 0.0_dp              !! of the road
      real(dp) :: curvature(2, 2) = 0.0_dp       !! change of the slopes (rows) along x and y (columns), 1/m
   end type joint_cell_type

   integer, parameter :: numbers_per_derivative = 22

   !> The derivatives of the three scaled residuals of a cell.
   type :: cell_derivative_type
      real(dp) :: by_own(3, 3) = 0.0_dp          !! to its scaled s and T, without the displacements that they cause
      real(dp) :: by_place(3, 2) = 0.0_dp        !! to U_T at which the road is read, 1/m
      real(dp) :: by_slip(3, 2) = 0.0_dp         !! to the slip, 1/m
      real(dp) :: pressure = 0.0_dp              !! of its pressure to its scaled s, Pa
   contains
      procedure :: packed
      procedure :: unpack
   end type cell_derivative_type

contains

   !> Compute the derivatives of a cell.
   function new_cell_derivative(rules, cell, unit_length, unit_traction) result(self)
      type(cell_rules_type), intent(in) :: rules
      type(joint_cell_type), intent(in) :: cell
      real(dp), intent(in) :: unit_length, unit_traction    !! of the residuals and unknowns, m and Pa
      type(cell_derivative_type) :: self
      type(joint_cell_type) :: other
      real(dp) :: error(2), by_slope(2, 2)
      integer :: c

      error = traction_error(rules, cell)
      other = cell
      other%s = cell%s + change*unit_length
      self%by_own(1, 1) = (rules%gap_of(cell%s) - rules%gap_of(other%s))/(change*unit_length)
      self%by_own(2:3, 1) = (traction_error(rules, other) - error)/(change*unit_traction)
      self%pressure = (rules%pressure_of(cell%width, other%s) - rules%pressure_of(cell%width, cell%s))/change
      do c = 1, 2
         other = cell
         other%t(c) = cell%t(c) + change*unit_traction
         self%by_own(2:3, 1 + c) = (traction_error(rules, other) - error)/(change*unit_traction)
         other = cell
         other%slip(c) = cell%slip(c) + change*unit_traction*rules%soft_along
         self%by_slip(2:3, c) = (traction_error(rules, other) - error)/(change*unit_traction**2*rules%soft_along)
         other = cell
         other%slope(c) = cell%slope(c) + change
         by_slope(:, c) = (traction_error(rules, other) - error)/(change*unit_traction)
      end do
      self%by_place(1, :) = -cell%slope/unit_length
      if (rules%law%slope_effect) self%by_place(2:3, :) = matmul(by_slope, cell%curvature)
   end function new_cell_derivative

   !> The residual of the traction, Pa.
   pure function traction_error(rules, cell) result(error)
      type(cell_rules_type), intent(in) :: rules
      type(joint_cell_type), intent(in) :: cell
      real(dp) :: error(2)
      real(dp) :: slope(2)

      slope = 0.0_dp
      if (rules%law%slope_effect) slope = cell%slope
      error = rules%traction_error(rules%share_of(cell%width, cell%s), rules%pressure_of(cell%width, cell%s), slope, &
         cell%slip, cell%t)
   end function traction_error

   !> All numbers as a vector, for an exchange between processes.
   pure function packed(self) result(numbers)
      class(cell_derivative_type), intent(in) :: self
      real(dp) :: numbers(numbers_per_derivative)

      numbers = [reshape(self%by_own, [9]), reshape(self%by_place, [6]), reshape(self%by_slip, [6]), self%pressure]
   end function packed

   !> Set all numbers from such a vector.
   pure subroutine unpack(self, numbers)
      class(cell_derivative_type), intent(inout) :: self
      real(dp), intent(in) :: numbers(numbers_per_derivative)

      self%by_own = reshape(numbers(1:9), [3, 3])
      self%by_place = reshape(numbers(10:15), [3, 2])
      self%by_slip = reshape(numbers(16:21), [3, 2])
      self%pressure = numbers(22)
   end subroutine unpack

end module cell_derivative
