!> The shares of the strength that cells at the edge of the contact carry, for laws whose strength does not vanish
!> with the pressure (constant shear). With such a law the traction of a cell would jump as the cell opens.
!>
!> Such a cell has three states (see docs/theory.md): open, without traction; in contact, with a pressure
!> and the whole strength; and between them touching, with neither gap nor pressure, and a share of the
!> strength. A pass solves for the pressure and for the traction one after the other, so that neither of the two
!> solves can find the share. It is therefore an unknown of the passes, and each pass changes it:
!>
!>     share <- share + (soft P_w - gap)/share_length        limited to the range from 0 to 1
!>
!> P_w is the pressure without the attraction, and soft P_w the length by which it presses a cell in. `share_length` is
!> the length by which the whole strength moves the cell down the slope of the road. The share remains constant only if
!> the cell is in one of the three states. If the share decides whether the cell touches, the rule is nearly
!> Newton's method for that cell alone. All cells at the edge change at once.
module edge_shares
   use adhesion_potential, only : adhesion_potential_type, adhesive_slope
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   implicit none
   private

   public :: edge_rule_type, new_edge_rule

   real(dp), parameter :: least_slope = 0.05_dp        !! of a road in `share_length`

   !> The parameters of the rule in a step.
   type :: edge_rule_type
      type(adhesion_potential_type) :: potential
      real(dp) :: soft = 0.0_dp                        !! displacement of a cell under its own unit traction, m/Pa
      real(dp) :: share_length = 0.0_dp                !! by which the whole strength moves a cell down the slopes, m
   contains
      procedure :: move
      procedure :: error
   end type edge_rule_type

contains

   !> Make the rule for a step.
   pure function new_edge_rule(potential, soft, strength, rms_slope) result(rule)
      type(adhesion_potential_type), intent(in) :: potential
      real(dp), intent(in) :: soft                     !! displacement of a cell under its own unit traction, m/Pa
      real(dp), intent(in) :: strength                 !! of the law without pressure, Pa
      real(dp), intent(in) :: rms_slope                !! of the road
      type(edge_rule_type) :: rule

      rule%potential = potential
      rule%soft = soft
      rule%share_length = max(soft*strength*max(rms_slope, least_slope), tiny(1.0_dp))
   end function new_edge_rule

   !> P_w, the pressure in a cell without the attraction, Pa.
   elemental function wall_pressure(self, pressure, gap) result(wall)
      class(edge_rule_type), intent(in) :: self
      real(dp), intent(in) :: pressure                 !! attraction included, Pa
      real(dp), intent(in) :: gap                      !! m
      real(dp) :: wall

      wall = pressure + adhesive_slope(self%potential, max(gap, 0.0_dp))
   end function wall_pressure

   !> Change the shares by the rule, with the pressure and the gap of a pass. With `decide` each share becomes 0 or 1:
   !> the larger of the gap and of the length by which the pressure presses the cell in decides, because the normal
   !> solver leaves small pressures, of round-off or of its tolerance, in cells with a gap.
   subroutine move(self, pressure, gap, decide, share)
      class(edge_rule_type), intent(in) :: self
      real(dp), intent(in) :: pressure(:, :)           !! attraction included, Pa
      real(dp), intent(in) :: gap(:, :)                !! m
      logical, intent(in) :: decide
      real(dp), intent(inout) :: share(:, :)
      real(dp) :: pressed(size(share, 1))              !! lengths by which the pressures press the cells in, m
      integer :: j

      !$omp parallel do default(none) shared(self, pressure, gap, decide, share) private(j, pressed)
      do j = 1, size(share, 2)
         pressed = self%soft*wall_pressure(self, pressure(:, j), gap(:, j))
         if (decide) then
            share(:, j) = merge(1.0_dp, 0.0_dp, pressed > gap(:, j))
         else
            share(:, j) = min(max(share(:, j) + (pressed - gap(:, j))/self%share_length, 0.0_dp), 1.0_dp)
         end if
      end do
   end subroutine move

   !> The sum of the errors of all cells, over the sum of the lengths by which their pressures press them in. A cell
   !> without a share must have neither P_w nor an overlap with the road, a cell with a share must have no gap, and a
   !> cell with a share below 1 must have no P_w. The result is 0 if there is no such length, that is, without any
   !> pressure and on a grid of one cell. Collective if processes share the rows.
   function error(self, share, pressure, gap)
      class(edge_rule_type), intent(in) :: self
      real(dp), intent(in) :: share(:, :)
      real(dp), intent(in) :: pressure(:, :)           !! attraction included, Pa
      real(dp), intent(in) :: gap(:, :)                !! m
      real(dp) :: error
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(2)
      integer :: j

      allocate (rows(2, size(gap, 2)))
      !$omp parallel do default(none) shared(self, share, pressure, gap, rows) private(j)
      do j = 1, size(gap, 2)
         rows(1, j) = sum(abs(pressure(:, j)))
         rows(2, j) = sum(cell_error(self, share(:, j), pressure(:, j), gap(:, j)))
      end do
      sums = row_totals(rows)
      error = 0.0_dp
      if (self%soft*sums(1) > 0.0_dp) error = sums(2)/(self%soft*sums(1))
   end function error

   !> The error of one cell, m.
   elemental function cell_error(self, share, pressure, gap) result(error)
      class(edge_rule_type), intent(in) :: self
      real(dp), intent(in) :: share, pressure, gap
      real(dp) :: error

      error = 0.0_dp
      if (share < 1.0_dp) error = max(self%soft*abs(wall_pressure(self, pressure, gap)), -gap)
      if (share > 0.0_dp) error = max(error, abs(gap))
   end function cell_error

end module edge_shares
