!> The solid of a case: the kernels (module `kernels`) of its material for the normal and the tangential
!> directions.
!>
!> This is the only place where a run chooses its solid.
module rubber_kernels
   use case_settings, only : material_settings_type
   use kernels, only : kernel_type, normal_half_space, tangential_half_space
   implicit none
   private

   public :: normal_kernel, tangential_kernel

contains

   !> The response to pressures.
   function normal_kernel(material) result(kernel)
      type(material_settings_type), intent(in) :: material
      type(kernel_type) :: kernel

      kernel = normal_half_space(material%poisson)
   end function normal_kernel

   !> The response to tangential tractions. Its mean mode is the shear of the whole block.
   function tangential_kernel(material) result(kernel)
      type(material_settings_type), intent(in) :: material
      type(kernel_type) :: kernel

      kernel = tangential_half_space(material%poisson, material%thickness)
   end function tangential_kernel

end module rubber_kernels
