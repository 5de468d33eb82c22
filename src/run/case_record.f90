!> The parts of a case that its result contains in addition to the settings: the material and the checksums of
!> height maps.
module case_record
   use asperity_checksum, only : hexadecimal
   use asperity_simulation, only : simulation_type
   use case_settings, only : material_settings_type
   use result_file, only : result_file_type
   use text_tools, only : to_text
   implicit none
   private

   public :: checksums_of_maps, map_lines, write_material

contains

   !> Write the properties of the material at the temperature of the case.
   subroutine write_material(result, m)
      type(result_file_type), intent(inout) :: result
      type(material_settings_type), intent(in) :: m

      call result%write_material('shear_modulus', m%shear_modulus, 'Pa', 'long-term shear modulus')
      call result%write_material('poisson', m%poisson, '1', 'Poisson ratio')
      call result%write_material('prony_g', m%prony_g, 'Pa', 'moduli of the arms')
      call result%write_material('prony_tau', m%prony_tau, 's', &
         'relaxation times of the arms at the temperature of the case')
      call result%pair_arms()
      call result%write_material('thickness', m%thickness, 'm', 'thickness of the block')
      call result%write_material('density', m%density, 'kg/m3', 'density')
      call result%write_material('temperature', m%temperature, 'C', 'temperature')
   end subroutine write_material

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
