!> Coulomb friction: the bound is mu N (thesis, section 3.1.2).
module coulomb_law
   use asperity_precision, only : dp
   use shear_law, only : shear_law_type
   implicit none
   private

   public :: new_coulomb_law, coulomb_law_type

   type, extends(shear_law_type) :: coulomb_law_type
   contains
      procedure :: forces
      procedure :: force
   end type coulomb_law_type

contains

   !> Make the law.
   pure function new_coulomb_law(coefficient) result(self)
      real(dp), intent(in) :: coefficient      !! mu >= 0
      type(coulomb_law_type) :: self

      self%coefficient = coefficient
      self%variables(1) = 'coefficient'
      self%legal = coefficient >= 0.0_dp
   end function new_coulomb_law

   !> mu N of a row.
   pure subroutine forces(self, n, force)
      class(coulomb_law_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(inout) :: force(n)      !! in: N; out: the bound, Pa
      integer :: i

      do i = 1, n
         force(i) = self%coefficient*force(i)
      end do
   end subroutine forces

   !> mu N.
   pure function force(self, pressure, share)
      class(coulomb_law_type), intent(in) :: self
      real(dp), intent(in) :: pressure         !! N, Pa
      real(dp), intent(in) :: share(2)
      real(dp) :: force                        !! Pa

      force = self%coefficient*share(1)*pressure
   end function force

end module coulomb_law
