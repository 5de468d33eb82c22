!> The parts of a case that its result contains in addition to the settings: the material and the checksums of
!> height maps.
module case_record
   use asperity_checksum, only : hexadecimal
   use asperity_simulation, only : simulation_type
   use case_settings, only : material_settings_type
   use result_material, only : material_record_type
   use text_tools, only : to_text
   implicit none
   private

   public :: checksums_of_maps, map_lines, material_record

contains

   !> The properties of the material at the temperature of the case.
   pure function material_record(m) result(record)
      type(material_settings_type), intent(in) :: m
      type(material_record_type) :: record

      record = material_record_type(m%shear_modulus, m%poisson, m%prony_g, m%prony_tau, m%thickness, &
         m%density, m%temperature)
   end function material_record

   !> The checksums of height maps from files, as lines of the identity of the case.
   function map_lines(sim) result(lines)
      type(simulation_type), intent(in) :: sim
      character(:), allocatable :: lines
      integer :: i

      lines = ''
      do i = 1, size(sim%case%surfaces)
         if (sim%case%surfaces(i)%shape == 'file') lines = lines//'&surface '//to_text(i)// &
            ': checksum of the height map = '//hexadecimal(sim%map_checksums(i))//new_line('a')
      end do
   end function map_lines

   !> The same checksums with blanks between them.
   function checksums_of_maps(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(:), allocatable :: text
      integer :: i

      text = ''
      do i = 1, size(sim%case%surfaces)
         if (sim%case%surfaces(i)%shape == 'file') &
            text = trim(text//' '//hexadecimal(sim%map_checksums(i)))
      end do
      text = adjustl(text)
   end function checksums_of_maps

end module case_record
