!> Advice for the user if the passes of a row did not settle, or if a tangential solve of it failed.
module coupling_advice
   use contact_model, only : contact_type
   use field_sums, only : row_totals
   use asperity_precision, only : dp
   use text_tools, only : rounded_text
   implicit none
   private

   public :: advice_on_passes, advice_on_slopes

   !> On slopes steeper than 1/mu friction has no bound uphill. If these slopes carry at least this fraction of the
   !> normal force, the advice names them as the reason.
   real(dp), parameter :: much = 1.0e-3_dp

contains

   !> One or two sentences about the likely reason and the remedy.
   function advice_on_passes(self) result(advice)
      class(contact_type), intent(in) :: self
      character(:), allocatable :: advice

      advice = advice_on_slopes(self)
      if (self%tangential%law%jumps_at_edge()) then
         advice = 'With this law the traction jumps where the contact ends, although without adhesion a '// &
            'solution exists; law = ''coulomb_orowan'', whose bound grows with the pressure from zero, usually '// &
            'settles with a coefficient of up to about 1'
      else if (len(advice) > 0) then
         return
      else if (self%case%solver%passes > 0) then
         advice = 'Allow more passes (with passes = 0 they continue until they settle), or a larger '// &
            'coupling_tolerance'
      else
         advice = 'A mass (density) may help, shorter steps seldom do; with'
         if (self%state%tangential%block%mass > 0.0_dp) advice = 'Shorter steps seldom help; with'
         advice = advice//' a larger coupling_tolerance the run continues, and residual_coupling shows the remaining mismatch'
      end if
   end function advice_on_passes

   !> A sentence about slopes on which the road may wedge; empty if there are few or none.
   function advice_on_slopes(self) result(advice)
      class(contact_type), intent(in) :: self
      character(:), allocatable :: advice
      real(dp) :: jammed

      advice = ''
      jammed = jammed_part(self)
      if (jammed <= much) return
      advice = rounded_text(100.0_dp*jammed, 2)//' % of the normal force is on slopes above 1/coefficient, where '
      if (self%tangential%law%strength_beside() < 0.0_dp) then
         advice = advice//'friction can resist any uphill force, so that there may be no solution'
      else
         advice = advice//'only the strength limits an uphill force: a solution exists, but it was not found'
      end if
      advice = advice//': use a smoother road or a lower coefficient'
   end function advice_on_slopes

   !> Part of the normal force that acts on slopes steeper than 1/mu.
   function jammed_part(self) result(part)
      class(contact_type), intent(in) :: self
      real(dp) :: part
      real(dp), allocatable :: rows(:, :)
      real(dp) :: mu, sums(2)
      integer :: j

      part = 0.0_dp
      mu = self%tangential%law%reach_coefficient()
      if (.not. self%tangential%law%slope_effect) return
      allocate (rows(2, self%grid%rows()))
      do j = 1, self%grid%rows()
         rows(1, j) = sum(abs(self%state%pressure(:, j)))
         rows(2, j) = sum(abs(self%state%pressure(:, j)), &
            mu*hypot(self%slope_x(:, j), self%slope_y(:, j)) > 1.0_dp)
      end do
      sums = row_totals(rows)
      part = sums(2)/max(sums(1), tiny(1.0_dp))
   end function jammed_part

end module coupling_advice
