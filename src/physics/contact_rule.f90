!> Which cells touch: the one definition for the history, snapshots, friction, the edge of a free map
!> and Python.
!>
!> Without adhesion a cell touches where its pressure is positive: the solvers clip pressures to
!> exactly 0. With adhesion a cell touches where its gap is 0. A solution fulfils the complementarity
!>     g >= 0,   G >= 0,   g G = 0,       G = P + e'(g): the pressure of the wall alone,
!> but a solver ends its last step with gaps of round-off, or of its tolerance, in cells that the wall
!> carries. `is_closed` decides for each cell which of the two numbers is meant to be 0, in the units
!> in which the solver measures its residual; the solvers for adhesion apply it to the state that they
!> hand out. After that a comparison with 0 is exact.
module contact_rule
   use asperity_precision, only : dp
   implicit none
   private

   public :: is_closed, touches

contains

   !> Does a cell touch?
   elemental function touches(adhesive, pressure, gap)
      logical, intent(in) :: adhesive       !! the contact has a potential, even one without energy
      real(dp), intent(in) :: pressure      !! P, attraction included, Pa
      real(dp), intent(in) :: gap           !! m
      logical :: touches

      if (adhesive) then
         touches = gap <= 0.0_dp
      else
         touches = pressure > 0.0_dp
      end if
   end function touches

   !> Is the gap of a cell within the tolerance, and smaller than the pressure of the wall?
   elemental function is_closed(gap, wall, tolerance)
      real(dp), intent(in) :: gap           !! g over the unit of length, >= 0
      real(dp), intent(in) :: wall          !! G over the unit of traction
      real(dp), intent(in) :: tolerance     !! of the natural residual max|min(g, G)|
      logical :: is_closed

      is_closed = gap <= tolerance .and. gap < wall
   end function is_closed

end module contact_rule
