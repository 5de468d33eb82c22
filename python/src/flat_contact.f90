!> Calls from Python for one contact on arrays, and for operators. See `flat_runs` for the rules.
module flat_contact
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use adhesion_potential, only : adhesive_slope, edge_of_cells, new_tabulated_potential
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use case_settings, only : adhesion_settings_type, solver_settings_type
   use contact_rule, only : touches
   use contact_size, only : measured_patches, size_warning
   use contact_solver, only : contact_solver_type
   use fft_conv, only : new_convolution
   use field_sums, only : field_count, field_mean, field_rms
   use flat_answers, only : check_memory, grid_of, report, return_outcome
   use kernels, only : normal_half_space, tangential_half_space
   use normal_solvers, only : new_contact_solver
   use normal_state, only : control_approach, control_pressure, normal_problem_type
   use normal_step, only : new_normal_step, normal_step_type, normal_task_type
   use operator_handles, only : find_operator, free_operator, new_operator, operator_type
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: contact_adhesive, contact_normal, contact_width, operator_apply, operator_close, &
      operator_open, operator_symbol

contains

   !> Elastic normal contact without adhesion.
   subroutine contact_normal(height, pressure, gap, nx, ny, lx, ly, is_free, modulus, approach, &
      target, warm, thesis, tolerance, max_iterations, level, iterations, ffts, residual, seconds, &
      converged, reason, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)         !! m
      real(c_double), intent(inout) :: pressure(nx, ny)    !! Pa; in: the start if `warm`
      real(c_double), intent(inout) :: gap(nx, ny)         !! m
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free                !! 1: free boundary, 0: periodic
      real(c_double), intent(in) :: modulus                !! E*, Pa
      integer(c_int), intent(in) :: approach               !! 1: the target is U - H in contact, m
      real(c_double), intent(in) :: target                 !! mean pressure, Pa, otherwise
      integer(c_int), intent(in) :: warm, thesis           !! 1 or 0
      real(c_double), intent(in) :: tolerance
      integer(c_int), intent(in) :: max_iterations
      real(c_double), intent(out) :: level                 !! U - H in contact, m
      integer(c_int), intent(out) :: iterations
      real(c_double), intent(out) :: ffts, residual, seconds
      integer(c_int), intent(out) :: converged             !! 1 or 0
      character(len=64), intent(out) :: reason
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      class(contact_solver_type), allocatable :: solver
      type(solver_result_type) :: outcome
!f2py threadsafe

      level = 0.0_dp
      grid = grid_of(nx, ny, lx, ly, is_free)
      call check_memory(grid, 12, 'the contact', error)
      ! E* = 2 G/(1 - nu) is all that the normal problem knows of the material: take nu = 0.
      if (.not. allocated(error)) call new_contact_solver(solver, trim(merge('thesis', 'fast  ', thesis == 1)), &
         grid, normal_half_space(0.0_dp), error)
      if (.not. allocated(error)) then
         problem%modulus = 0.5_dp*modulus
         problem%control = merge(control_approach, control_pressure, approach == 1)
         problem%target = target
         problem%tolerance = tolerance
         problem%max_iterations = max_iterations
         problem%warm = warm == 1
         problem%rms_height = field_rms(height, field_mean(height))
         call solver%solve(problem, height, pressure, gap, level, outcome)
         call solver%destroy()
      end if
      call return_outcome(outcome, iterations, ffts, residual, seconds, converged, reason)
      call report(error, status, message)
   end subroutine contact_normal

   !> Elastic normal contact with adhesion, solved as one row of a run.
   subroutine contact_adhesive(height, pressure, gap, attraction, nx, ny, lx, ly, is_free, modulus, &
      potential, energy, range_, values, table, approach, load, start, thesis, tolerance, &
      max_iterations, old_level, level, energy_adhesive, contact_area, iterations, ffts, residual, &
      seconds, converged, reason, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)           !! m
      real(c_double), intent(inout) :: pressure(nx, ny)      !! Pa; in: the start if it is given
      real(c_double), intent(inout) :: gap(nx, ny)           !! m; likewise
      real(c_double), intent(inout) :: attraction(nx, ny)    !! -e'(gap), Pa
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free                  !! 1: free boundary, 0: periodic
      real(c_double), intent(in) :: modulus                  !! E*, Pa
      character(len=*), intent(in) :: potential
      real(c_double), intent(in) :: energy, range_           !! J/m2 and m
      !> Attraction, Pa, and its slope, Pa/m, at equidistant gaps from 0 to the range. They define the potential if
      !> there is more than one value.
      integer(c_int), intent(in) :: values
      real(c_double), intent(in) :: table(values, 2)
      integer(c_int), intent(in) :: approach                 !! 1: the load is a displacement
      real(c_double), intent(in) :: load                     !! m, or mean pressure, Pa
      integer(c_int), intent(in) :: start                    !! 0: non-adhesive, 1: full contact, 2: given
      integer(c_int), intent(in) :: thesis                   !! 1 or 0
      real(c_double), intent(in) :: tolerance
      integer(c_int), intent(in) :: max_iterations
      real(c_double), intent(in) :: old_level                !! of a start that is given, m
      real(c_double), intent(out) :: level                   !! U - H in contact, m
      real(c_double), intent(out) :: energy_adhesive         !! over the cell, J
      real(c_double), intent(out) :: contact_area            !! fraction of the cells that touch
      integer(c_int), intent(out) :: iterations
      real(c_double), intent(out) :: ffts, residual, seconds
      integer(c_int), intent(out) :: converged               !! 1 or 0
      character(len=64), intent(out) :: reason
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      type(solver_settings_type) :: solver
      type(adhesion_settings_type) :: adhesion
      type(normal_step_type) :: side
      type(normal_task_type) :: task
      type(solver_result_type) :: outcome
      integer :: j
!f2py threadsafe

      level = old_level
      energy_adhesive = 0.0_dp
      contact_area = 0.0_dp
      grid = grid_of(nx, ny, lx, ly, is_free)
      solver%method = 'fast'
      if (thesis == 1) solver%method = 'thesis'
      solver%precision = 'double'
      solver%tolerance = tolerance
      solver%max_iterations = max_iterations
      adhesion%potential = potential
      adhesion%energy = energy
      adhesion%range = range_
      adhesion%start = 'non_adhesive'
      if (start == 1) adhesion%start = 'full_contact'
      ! E* = 2 G/(1 - nu) is all that the normal problem knows of the material: take nu = 0.
      task%modulus = 0.5_dp*modulus
      task%control = 'pressure'
      if (approach == 1) task%control = 'displacement'
      task%load = load
      task%first = start /= 2
      call check_memory(grid, merge(49, 25, is_free == 1), 'the contact', error)
      if (.not. allocated(error)) call new_normal_step(side, grid, normal_half_space(0.0_dp), solver, &
         adhesion, edge_of_cells(energy, range_, modulus, merge(grid%dx, max(grid%dx, grid%dy), ny == 1)), &
         height, error)
      if (.not. allocated(error) .and. values > 1) call new_tabulated_potential(side%potential, &
         range_/(values - 1), table(:, 1), table(:, 2), error)
      if (.not. allocated(error)) then
         call side%solve(task, height, pressure, gap, level, outcome)
         energy_adhesive = side%energy(gap)
         contact_area = field_count(touches(side%adhesive, pressure, gap))/grid%cells()
         do j = 1, ny
            attraction(:, j) = -adhesive_slope(side%potential, gap(:, j))
         end do
         call side%destroy()
      end if
      call return_outcome(outcome, iterations, ffts, residual, seconds, converged, reason)
      call report(error, status, message)
   end subroutine contact_adhesive

   !> The warning of a run if the patches of a contact are too few cells wide; otherwise a blank.
   subroutine contact_width(pressure, gap, nx, ny, lx, ly, is_free, adhesive, warning, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: pressure(nx, ny)           !! Pa
      real(c_double), intent(in) :: gap(nx, ny)                !! m
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free                    !! 1: free boundary, 0: periodic
      integer(c_int), intent(in) :: adhesive                   !! 1: the contact has a potential
      character(len=400), intent(out) :: warning
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid

      grid = grid_of(nx, ny, lx, ly, is_free)
      warning = size_warning(grid, measured_patches(grid, adhesive == 1, pressure, gap))
      call report(error, status, message)
   end subroutine contact_width

   !> Prepare an operator: the displacements that tractions cause.
   subroutine operator_open(tangential, nx, ny, lx, ly, is_free, modulus, poisson, thickness, handle, &
      mx, my, status, message)
      integer(c_int), intent(in) :: tangential                 !! 1: tangential, 0: normal
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free                    !! 1: free boundary, 0: periodic
      real(c_double), intent(in) :: modulus                    !! shear modulus, Pa
      real(c_double), intent(in) :: poisson
      real(c_double), intent(in) :: thickness                  !! of the block, m; 0: half-space
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: mx, my                    !! lengths of the transforms
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(operator_type), pointer :: operator
      integer :: number

      handle = 0
      mx = 0
      my = 0
      call check_memory(grid_of(nx, ny, lx, ly, is_free), merge(8, 4, tangential == 1), 'the operator', error)
      if (.not. allocated(error)) call new_operator(number, operator, error)
      if (.not. allocated(error)) then
         operator%modulus = modulus
         if (tangential == 1) then
            call new_convolution(operator%map, grid_of(nx, ny, lx, ly, is_free), &
               tangential_half_space(poisson, thickness), error)
         else
            call new_convolution(operator%map, grid_of(nx, ny, lx, ly, is_free), &
               normal_half_space(poisson), error)
         end if
         if (allocated(error)) then
            call free_operator(number)
         else
            handle = number
            mx = operator%map%mx
            my = operator%map%my
         end if
      end if
      call report(error, status, message)
   end subroutine operator_open

   !> Displacements of tractions; the fields along y are for a tangential operator only.
   subroutine operator_apply(handle, nx, ny, px, py, ux, uy, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: px(nx, ny), py(nx, ny)     !! Pa
      real(c_double), intent(inout) :: ux(nx, ny), uy(nx, ny)  !! m
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(operator_type), pointer :: operator

      call find_operator(int(handle), operator, error)
      if (allocated(error)) then
         call report(error, status, message)
         return
      end if
      if (nx /= operator%map%nx .or. ny /= operator%map%ny) then
         call fail(error, error_input, 'the field has another shape')
      else if (operator%map%components == 2) then
         call operator%map%apply_vector(px, py, ux, uy)
         ux(:, :) = ux/operator%modulus
         uy(:, :) = uy/operator%modulus
      else
         call operator%map%apply(px, ux)
         ux(:, :) = ux/operator%modulus
      end if
      call report(error, status, message)
   end subroutine operator_apply

   !> One part of an operator's symbol, for a field and its transform without factors: the first
   !> half of the wave numbers along both directions.
   subroutine operator_symbol(handle, part, columns, rows, values, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: part                       !! 1; of a tangential one 1: xx, 2: yy, 3: xy
      integer(c_int), intent(in) :: columns, rows              !! mx/2 + 1 and my/2 + 1
      real(c_double), intent(inout) :: values(columns, rows)   !! m/Pa
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(operator_type), pointer :: operator

      call find_operator(int(handle), operator, error)
      if (allocated(error)) then
         call report(error, status, message)
         return
      end if
      if (columns /= operator%map%mx/2 + 1 .or. rows /= operator%map%my/2 + 1) then
         call fail(error, error_input, 'the symbol has another shape')
      else
         values(:, :) = operator%map%symbols%part(int(part))/operator%modulus
      end if
      call report(error, status, message)
   end subroutine operator_symbol

   !> Free an operator. A handle that is not in use is ignored.
   subroutine operator_close(handle, status, message)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error

      call free_operator(int(handle))
      call report(error, status, message)
   end subroutine operator_close

end module flat_contact
