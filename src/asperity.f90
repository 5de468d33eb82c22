!> The public library in one place: `use asperity`.
!>
!> A program that uses the library usually reads a case from a file or a text (`read_case`, `parse_case`), and
!> makes a simulation (`new_simulation`, `advance` row by row) or a whole run with its result file (`run_type`).
!> The parts can also be used alone:
!>
!> * grids (`new_grid`) and surfaces (`new_height`, `height_statistics`, `height_psd`);
!> * solids (`normal_half_space`, `tangential_half_space`) and operators (`new_convolution`): displacements
!>   from tractions;
!> * solvers: normal contact (`new_normal_solver`, or `new_contact_solver` by the name of a method),
!>   adhesion (`new_adhesion_solver`), friction (`new_friction_solver`); each returns a record
!>   (`solver_result_type`);
!> * the material in time (`new_zener`, `new_arm_state`, `past_traction`, `commit_arms`) and its energy
!>   books (`new_books`, `book_step`).
!>
!> All units are SI. Errors are values (`error_type`); a solve that does not converge is an outcome, not an error.
module asperity
   use adhesion_cg, only : adhesion_solver_type, new_adhesion_solver
   use adhesion_potential, only : adhesion_potential_type, new_adhesion_potential, &
      new_tabulated_potential
   use adhesion_state, only : adhesion_problem_type
   use case_input, only : parse_case, read_case
   use case_run, only : run_type
   use case_settings, only : case_type
   use contact_fields, only : contact_rows, field_rows
   use contact_solver, only : contact_solver_type
   use asperity_errors, only : error_convergence, error_file, error_input, error_memory, error_type
   use fft_conv, only : convolution_type, new_convolution
   use friction_cg, only : friction_fields_type, friction_solver_type, new_friction_solver
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, new_friction_law
   use history_row, only : history_row_type
   use asperity_interpolation, only : displaced, interpolation_type, new_interpolation, shifted
   use kernels, only : kernel_type, normal_half_space, tangential_half_space
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_solvers, only : new_contact_solver
   use normal_state, only : control_approach, control_pressure, normal_problem_type
   use asperity_threads, only : set_threads, thread_count
   use asperity_precision, only : dp, sp
   use prony, only : complex_modulus, creep_compliance, relaxation_modulus, wlf_shift, zener_to_prony
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use roughness, only : height_psd, height_statistics, radial_psd, roughness_type
   use asperity_schedule, only : count_rows
   use asperity_simulation, only : new_simulation, simulation_type
   use solver_result, only : solver_result_type
   use asperity_surface, only : new_height
   use surface_settings, only : default_surface, surface_settings_type
   use asperity_version, only : version_number
   use viscoelastic_energy, only : book_step, energy_books_type, new_books
   use arm_state, only : arm_state_type, commit_arms, new_arm_state, new_products, past_traction, &
      products_type
   use zener, only : finish_step, new_zener, start_jump, start_relaxed, start_step, zener_type
   implicit none
   public

end module asperity
