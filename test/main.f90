!> The one driver of the Fortran tests: all suites, or those named on the command line.
program main
   use check, only : finish
   use result_writer, only : run_writer
   use test_adhesion_cg, only : run_adhesion_cg
   use test_adhesion_free, only : run_adhesion_free
   use test_adhesion_potential, only : run_adhesion_potential
   use test_base, only : run_base
   use test_case_input, only : run_case_input
   use test_checkpoint, only : run_checkpoint
   use test_coupled_passes, only : run_coupled_passes
   use test_coupled_runs, only : run_coupled_runs
   use test_fft_conv, only : run_fft_conv
   use test_friction_cg, only : run_friction_cg
   use test_friction_law, only : run_friction_law
   use test_hdf5_file, only : run_hdf5_file
   use test_input_listing, only : run_input_listing
   use test_interpolation, only : run_interpolation
   use test_mixed, only : run_mixed
   use test_namelist, only : run_namelist
   use test_progress, only : run_progress
   use test_block_motion, only : run_block_motion
   use test_starting_steps, only : run_starting_steps
   use test_outside_balance, only : run_outside_balance
   use test_prony, only : run_prony
   use test_result_file, only : run_result_file
   use test_roughness, only : run_roughness
   use test_schur, only : run_schur
   use test_surface, only : run_surface
   use test_viscoelastic_energy, only : run_viscoelastic_energy
   use test_xdmf, only : run_xdmf
   use test_field_sums, only : run_field_sums
   use test_kernels, only : run_kernels
   use test_proposal, only : run_proposal
   use test_zener, only : run_zener
   use test_normal_cg, only : run_normal_cg
   use test_simulation, only : run_simulation
   use test_simulation_adhesion, only : run_simulation_adhesion
   use test_simulation_pull, only : run_simulation_pull
   use test_simulation_sliding, only : run_simulation_sliding
   use test_steady, only : run_steady
   use test_simulation_friction, only : run_simulation_friction
   use test_normal_invariance, only : run_normal_invariance
   use test_normal_limits, only : run_normal_limits
   use test_facade, only : run_facade
   implicit none

   ! check writer FILE ROWS COMPRESSION [restart]: a run for tests that kill it, and no test.
   if (called('writer')) then
      call run_writer()
      stop
   end if
   if (wanted('base')) call run_base()
   if (wanted('field_sums')) call run_field_sums()
   if (wanted('fft_conv')) call run_fft_conv()
   if (wanted('kernels')) call run_kernels()
   if (wanted('hdf5_file')) call run_hdf5_file()
   if (wanted('prony')) call run_prony()
   if (wanted('surface')) call run_surface()
   if (wanted('roughness')) call run_roughness()
   if (wanted('namelist')) call run_namelist()
   if (wanted('case_input')) call run_case_input()
   if (wanted('input_listing')) call run_input_listing()
   if (wanted('interpolation')) call run_interpolation()
   if (wanted('zener')) call run_zener()
   if (wanted('viscoelastic_energy')) call run_viscoelastic_energy()
   if (wanted('result_file')) call run_result_file()
   if (wanted('checkpoint')) call run_checkpoint()
   if (wanted('simulation')) call run_simulation()
   if (wanted('proposal')) call run_proposal()
   if (wanted('simulation_sliding')) call run_simulation_sliding()
   if (wanted('steady')) call run_steady()
   if (wanted('coupled_passes')) call run_coupled_passes()
   if (wanted('coupled_runs')) call run_coupled_runs()
   if (wanted('simulation_pull')) call run_simulation_pull()
   if (wanted('simulation_friction')) call run_simulation_friction()
   if (wanted('simulation_adhesion')) call run_simulation_adhesion()
   if (wanted('starting_steps')) call run_starting_steps()
   if (wanted('block_motion')) call run_block_motion()
   if (wanted('outside_balance')) call run_outside_balance()
   if (wanted('friction_law')) call run_friction_law()
   if (wanted('friction_cg')) call run_friction_cg()
   if (wanted('xdmf')) call run_xdmf()
   if (wanted('progress')) call run_progress()
   if (wanted('adhesion_potential')) call run_adhesion_potential()
   if (wanted('adhesion_cg')) call run_adhesion_cg()
   if (wanted('mixed')) call run_mixed()
   if (wanted('normal_cg')) then
      call run_normal_cg()
      call run_normal_limits()
      call run_normal_invariance()
      call run_schur()
   end if
   if (wanted('adhesion_free')) call run_adhesion_free()
   if (wanted('facade')) call run_facade()
   call finish()

contains

   !> Is this the first argument?
   logical function called(verb)
      character(*), intent(in) :: verb
      character(64) :: argument

      call get_command_argument(1, argument)
      called = argument == verb
   end function called

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
