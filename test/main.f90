!> The one driver of the Fortran tests: all suites, or those named on the command line.
program main
   use check, only : finish
   use test_base, only : run_base
   use test_case_input, only : run_case_input
   use test_fft_conv, only : run_fft_conv
   use test_hdf5_file, only : run_hdf5_file
   use test_interpolation, only : run_interpolation
   use test_prony, only : run_prony
   use test_roughness, only : run_roughness
   use test_surface, only : run_surface
   use test_viscoelastic_energy, only : run_viscoelastic_energy
   use test_zener, only : run_zener
   use test_normal_cg, only : run_normal_cg
   implicit none

   if (wanted('base')) call run_base()
   if (wanted('fft_conv')) call run_fft_conv()
   if (wanted('hdf5_file')) call run_hdf5_file()
   if (wanted('prony')) call run_prony()
   if (wanted('surface')) call run_surface()
   if (wanted('roughness')) call run_roughness()
   if (wanted('case_input')) call run_case_input()
   if (wanted('interpolation')) call run_interpolation()
   if (wanted('zener')) call run_zener()
   if (wanted('viscoelastic_energy')) call run_viscoelastic_energy()
   if (wanted('normal_cg')) call run_normal_cg()
   call finish()

contains

   !> Is this suite asked for?
   logical function wanted(suite)
      character(*), intent(in) :: suite
      character(64) :: argument
      integer :: i

      wanted = command_argument_count() == 0
      do i = 1, command_argument_count()
         call get_command_argument(i, argument)
         if (argument == suite) wanted = .true.
      end do
   end function wanted

end program main
