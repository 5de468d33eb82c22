!> Coulomb-Orowan friction: the smaller of mu N and sigma_max (thesis, section 3.1.2).
!>
!> mu N is the bound of Coulomb's law, and sigma_max is the `strength_beside` of this law.
module coulomb_orowan_law
   use asperity_precision, only : dp
   use coulomb_law, only : coulomb_law_type
   implicit none
   private

   public :: new_coulomb_orowan_law, coulomb_orowan_law_type

   type, extends(coulomb_law_type) :: coulomb_orowan_law_type
   end type coulomb_orowan_law_type

contains

   !> Make the law.
   pure function new_coulomb_orowan_law(coefficient, strength) result(self)
      real(dp), intent(in) :: coefficient      !! mu >= 0
      real(dp), intent(in) :: strength         !! sigma_max >= 0, Pa
      type(coulomb_orowan_law_type) :: self

      self%coefficient = coefficient
      self%strength_beside = strength
      self%variables = [character(16) :: 'coefficient', 'shear_strength']
      self%legal = coefficient >= 0.0_dp .and. strength >= 0.0_dp
   end function new_coulomb_orowan_law

end module coulomb_orowan_law
