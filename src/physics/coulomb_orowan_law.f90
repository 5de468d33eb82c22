!> Coulomb-Orowan friction: the smaller of mu N and sigma_max (thesis, section 3.1.2).
module coulomb_orowan_law
   use asperity_precision, only : dp
   use shear_law, only : shear_law_type
   implicit none
   private

   public :: new_coulomb_orowan_law, coulomb_orowan_law_type

   type, extends(shear_law_type) :: coulomb_orowan_law_type
   contains
      procedure :: forces
      procedure :: force
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
   end function new_coulomb_orowan_law

   !> mu N of a row. The limit sigma_max is the `strength_beside` of the law.
   pure subroutine forces(self, n, force)
      class(coulomb_orowan_law_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(inout) :: force(n)      !! in: N; out: the bound, Pa
      integer :: i

      do i = 1, n
         force(i) = self%coefficient*force(i)
      end do
   end subroutine forces

   !> mu N. The limit sigma_max is the `strength_beside` of the law.
   pure function force(self, pressure, share)
      class(coulomb_orowan_law_type), intent(in) :: self
      real(dp), intent(in) :: pressure         !! N, Pa
      real(dp), intent(in) :: share(2)
      real(dp) :: force                        !! Pa

      force = self%coefficient*share(1)*pressure
   end function force

end module coulomb_orowan_law
