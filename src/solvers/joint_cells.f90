!> The states of a cell in the joint equations of a step with friction, in one number per cell.
!>
!> A cell is open, or it touches without pressure in a part of its area, or it is in contact. The number
!> s, a length, determines the state:
!>
!>     s < 0              open: the gap is -s, no pressure but that of adhesion, no traction
!>     0 <= s <= width    touches: no gap, no pressure of the wall, the share s/width of the bound
!>     s > width          in contact: no gap, a pressure of the wall in proportion to s - width
!>
!> so that pressure, gap and share are continuous functions of s. The second range exists only if the
!> traction would otherwise jump when the cell opens: with constant shear stress; with adhesion on a slope, where
!> T* is then not zero; and on slopes above 1/coefficient. In all other cells the width is 0.
module joint_cells
   use adhesion_potential, only : adhesion_potential_type, adhesive_slope
   use asperity_precision, only : dp
   use friction_law, only : friction_law_type
   implicit none
   private

   public :: cell_rules_type

   !> The parameters of the states of a cell.
   type :: cell_rules_type
      type(adhesion_potential_type) :: potential
      type(friction_law_type) :: law
      real(dp) :: soft = 0.0_dp                     !! displacement of a cell under its own unit pressure, m/Pa
      real(dp) :: soft_along = 0.0_dp               !! the same for the tangential traction, m/Pa
      real(dp) :: width = 0.0_dp                    !! of the second range, m
      real(dp) :: attraction = 0.0_dp               !! of a cell without a gap, Pa
      !> Rate at which the pressure rises within the second range, relative to the rate above it. The law demands 0;
      !> with a larger value there is no jump.
      real(dp) :: rise = 0.0_dp
   contains
      procedure :: has_jump
      procedure :: number_of
      procedure :: gap_of
      procedure :: pressure_of
      procedure :: share_of
      procedure :: traction_error
      procedure :: slips
   end type cell_rules_type

contains

   !> Does the traction of a cell jump as it opens?
   elemental function has_jump(self, slope_x, slope_y) result(yes)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: slope_x, slope_y
      logical :: yes

      yes = self%law%jumps_at_edge()
      if (.not. self%law%slope_effect) return
      yes = yes .or. self%attraction > 0.0_dp .or. self%law%reach_coefficient()*hypot(slope_x, slope_y) > 1.0_dp
   end function has_jump

   !> s of a cell that is in contact or open.
   elemental function number_of(self, width, touching, pressure, gap) result(s)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: width
      logical, intent(in) :: touching
      real(dp), intent(in) :: pressure, gap
      real(dp) :: s

      s = -max(gap, tiny(1.0_dp))
      if (touching) s = width + max(pressure + self%attraction, 0.0_dp)*self%soft
   end function number_of

   !> The gap, m.
   elemental function gap_of(self, s) result(gap)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: s
      real(dp) :: gap

      gap = max(-s, 0.0_dp)
   end function gap_of

   !> The pressure, attraction included, Pa.
   elemental function pressure_of(self, width, s) result(pressure)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: width, s
      real(dp) :: pressure

      pressure = (self%rise*min(s, width) + max(s - width, 0.0_dp))/self%soft - self%attraction
      if (s < 0.0_dp) pressure = -adhesive_slope(self%potential, -s)
   end function pressure_of

   !> The share of the bound.
   elemental function share_of(self, width, s) result(share)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: width, s
      real(dp) :: share

      share = merge(1.0_dp, 0.0_dp, s >= 0.0_dp)
      if (s >= 0.0_dp .and. s < width) share = s/width
   end function share_of

   !> The difference between the traction of a cell and the admissible one that follows from this traction and
   !> the slip. It is zero if the cell obeys the law.
   pure function traction_error(self, share, pressure, slope, slip, t) result(error)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: share
      real(dp), intent(in) :: pressure              !! Pa
      real(dp), intent(in) :: slope(2)
      real(dp), intent(in) :: slip(2)               !! m
      real(dp), intent(in) :: t(2)                  !! Pa
      real(dp) :: error(2)
      real(dp) :: wanted(2), s

      error = t
      if (.not. share > 0.0_dp) return
      wanted = t + self%law%slip_along_slope(slope, slip)/self%soft_along
      if (self%law%jumps_at_edge()) then
         call self%law%place_on_bound(share*pressure, slope, 1.0_dp, wanted, s, [1.0_dp, share])
         error = t - wanted
      else
         call self%law%place_on_bound(pressure, slope, 1.0_dp, wanted, s)
         error = t - share*wanted
      end if
   end function traction_error

   !> Is the traction of a cell on its bound?
   pure function slips(self, share, pressure, slope, t) result(yes)
      class(cell_rules_type), intent(in) :: self
      real(dp), intent(in) :: share
      real(dp), intent(in) :: pressure              !! Pa
      real(dp), intent(in) :: slope(2)
      real(dp), intent(in) :: t(2)                  !! Pa
      logical :: yes
      real(dp), parameter :: nearly = 1.0_dp + 1.0e-6_dp

      associate (p => share*pressure)
         yes = self%law%bound_ratio(p, slope, t - self%law%normal_traction(p, slope), [1.0_dp, share]) < nearly
      end associate
   end function slips

end module joint_cells
