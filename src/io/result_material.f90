!> The group /material of a result: the properties of the material at the temperature of the case.
!>
!> The file remembers the first fault of these calls, and the caller checks it once at the end
!> (see `hdf5_handle`).
module result_material
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   implicit none
   private

   public :: material_record_type, put_material

   !> The properties that a result contains.
   type :: material_record_type
      real(dp) :: shear_modulus = 0.0_dp             !! after an infinite time, Pa
      real(dp) :: poisson = 0.0_dp
      real(dp), allocatable :: prony_g(:)            !! modulus of each arm, Pa
      real(dp), allocatable :: prony_tau(:)          !! relaxation time of each arm, s
      real(dp) :: thickness = 0.0_dp                 !! m
      real(dp) :: density = 0.0_dp                   !! kg/m3
      real(dp) :: temperature = 0.0_dp               !! C
   end type material_record_type

contains

   !> Write the group, with the relaxation times as the axis of the moduli.
   subroutine put_material(file, material, compression)
      type(hdf5_file_type), intent(inout) :: file
      type(material_record_type), intent(in) :: material
      integer, intent(in) :: compression             !! of vectors, see `hdf5_file`

      call file%create_group('/material')
      call file%write('/material/shear_modulus', material%shear_modulus, 'Pa', 'long-term shear modulus')
      call file%write('/material/poisson', material%poisson, '1', 'Poisson ratio')
      call file%write('/material/prony_g', material%prony_g, 'Pa', 'moduli of the arms', &
         compression=compression)
      call file%write('/material/prony_tau', material%prony_tau, 's', &
         'relaxation times of the arms at the temperature of the case', compression=compression)
      call file%name_axes('/material', ['prony_tau'], ['prony_g'])
      call file%write('/material/thickness', material%thickness, 'm', 'thickness of the block')
      call file%write('/material/density', material%density, 'kg/m3', 'density')
      call file%write('/material/temperature', material%temperature, 'C', 'temperature')
   end subroutine put_material

end module result_material
