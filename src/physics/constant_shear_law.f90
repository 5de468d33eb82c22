!> Constant shear stress: the bound is sigma_max wherever there is contact (thesis, section 3.1.2).
module constant_shear_law
   use asperity_precision, only : dp
   use shear_law, only : shear_law_type
   implicit none
   private

   public :: new_constant_shear_law, constant_shear_law_type

   type, extends(shear_law_type) :: constant_shear_law_type
   contains
      procedure :: forces
      procedure :: force
   end type constant_shear_law_type

contains

   !> Make the law.
   pure function new_constant_shear_law(strength) result(self)
      real(dp), intent(in) :: strength         !! sigma_max >= 0, Pa
      type(constant_shear_law_type) :: self

      self%bare_strength = strength
      self%variables(1) = 'shear_strength'
      self%legal = strength >= 0.0_dp
   end function new_constant_shear_law

   !> sigma_max in a row.
   pure subroutine forces(self, n, force)
      class(constant_shear_law_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(inout) :: force(n)      !! in: N; out: the bound, Pa
      integer :: i

      do i = 1, n
         force(i) = self%bare_strength
      end do
   end subroutine forces

   !> sigma_max, whatever the pressure.
   pure function force(self, pressure, share)
      class(constant_shear_law_type), intent(in) :: self
      real(dp), intent(in) :: pressure         !! N, Pa
      real(dp), intent(in) :: share(2)
      real(dp) :: force                        !! Pa

      force = self%bare_strength*share(2)
   end function force

end module constant_shear_law
