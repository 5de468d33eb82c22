!> The one driver of the Fortran tests: all suites, or the suites and tests that the command line names.
!> A new suite is one line of the table below.
program main
   use asperity_parallel, only : end_processes, start_processes
   use check, only : run_suites, suite_type
   use result_writer, only : run_writer
   use test_adhesion_cg, only : run_adhesion_cg
   use test_adhesion_free, only : run_adhesion_free
   use test_adhesion_potential, only : run_adhesion_potential
   use test_adhesion_spots, only : run_adhesion_spots
   use test_base, only : run_base
   use test_block_motion, only : run_block_motion
   use test_case_input, only : run_case_input
   use test_checkpoint, only : run_checkpoint
   use test_chunk_writer, only : run_chunk_writer
   use test_coarse_start, only : run_coarse_start
   use test_contact_runs, only : run_contact_runs
   use test_coupled_passes, only : run_coupled_passes
   use test_joint_step, only : run_joint_step
   use test_coupled_runs, only : run_coupled_runs
   use test_facade, only : run_facade
   use test_fft_conv, only : run_fft_conv
   use test_field_sums, only : run_field_sums
   use test_friction_cg, only : run_friction_cg
   use test_friction_form, only : run_friction_form
   use test_friction_law, only : run_friction_law
   use test_hdf5_file, only : run_hdf5_file
   use test_input_listing, only : run_input_listing
   use test_interpolation, only : run_interpolation
   use test_kernels, only : run_kernels
   use test_mixed, only : run_mixed
   use test_namelist, only : run_namelist
   use test_normal_cg, only : run_normal_cg
   use test_normal_invariance, only : run_normal_invariance
   use test_normal_limits, only : run_normal_limits
   use test_outside_balance, only : run_outside_balance
   use test_progress, only : run_progress
   use test_prony, only : run_prony
   use test_proposal, only : run_proposal
   use test_result_file, only : run_result_file
   use test_roughness, only : run_roughness
   use test_schur, only : run_schur
   use test_shared_rows, only : run_shared_rows
   use test_simulation, only : run_simulation
   use test_simulation_adhesion, only : run_simulation_adhesion
   use test_simulation_friction, only : run_simulation_friction
   use test_simulation_pull, only : run_simulation_pull
   use test_simulation_sliding, only : run_simulation_sliding
   use test_starting_steps, only : run_starting_steps
   use test_steady, only : run_steady
   use test_surface, only : run_surface
   use test_viscoelastic_energy, only : run_viscoelastic_energy
   use test_wrong_arguments, only : run_wrong_arguments
   use test_xdmf, only : run_xdmf
   use test_zener, only : run_zener
   implicit none

   character(64) :: verb

   ! `check writer FILE ROWS COMPRESSION [restart]` is not a test but a run, which Python tests kill.
   call get_command_argument(1, verb)
   if (verb == 'writer') then
      call run_writer()
      stop
   end if

   call start_processes()
   call run_suites([ &
         suite_type('base', run_base), &
         suite_type('field_sums', run_field_sums), &
         suite_type('shared_rows', run_shared_rows), &
         suite_type('fft_conv', run_fft_conv), &
         suite_type('kernels', run_kernels), &
         suite_type('hdf5_file', run_hdf5_file), &
         suite_type('chunk_writer', run_chunk_writer), &
         suite_type('prony', run_prony), &
         suite_type('surface', run_surface), &
         suite_type('roughness', run_roughness), &
         suite_type('namelist', run_namelist), &
         suite_type('case_input', run_case_input), &
         suite_type('input_listing', run_input_listing), &
         suite_type('interpolation', run_interpolation), &
         suite_type('zener', run_zener), &
         suite_type('viscoelastic_energy', run_viscoelastic_energy), &
         suite_type('result_file', run_result_file), &
         suite_type('checkpoint', run_checkpoint), &
         suite_type('simulation', run_simulation), &
         suite_type('proposal', run_proposal), &
         suite_type('simulation_sliding', run_simulation_sliding), &
         suite_type('steady', run_steady), &
         suite_type('contact_runs', run_contact_runs), &
         suite_type('coupled_passes', run_coupled_passes), &
         suite_type('joint_step', run_joint_step), &
         suite_type('coupled_runs', run_coupled_runs), &
         suite_type('simulation_pull', run_simulation_pull), &
         suite_type('simulation_friction', run_simulation_friction), &
         suite_type('simulation_adhesion', run_simulation_adhesion), &
         suite_type('starting_steps', run_starting_steps), &
         suite_type('block_motion', run_block_motion), &
         suite_type('outside_balance', run_outside_balance), &
         suite_type('friction_form', run_friction_form), &
         suite_type('friction_law', run_friction_law), &
         suite_type('friction_cg', run_friction_cg), &
         suite_type('xdmf', run_xdmf), &
         suite_type('progress', run_progress), &
         suite_type('adhesion_potential', run_adhesion_potential), &
         suite_type('adhesion_cg', run_adhesion_cg), &
         suite_type('mixed', run_mixed), &
         suite_type('normal_cg', run_normal_cg), &
         suite_type('coarse_start', run_coarse_start), &
         suite_type('normal_limits', run_normal_limits), &
         suite_type('normal_invariance', run_normal_invariance), &
         suite_type('schur', run_schur), &
         suite_type('adhesion_free', run_adhesion_free), &
         suite_type('adhesion_spots', run_adhesion_spots), &
         suite_type('facade', run_facade), &
         suite_type('wrong_arguments', run_wrong_arguments)])
   call end_processes()

end program main
