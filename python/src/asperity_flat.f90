!> The library for Python, wrapped by f2py: plain arguments, a status and a message.
!>
!> Every argument is of a C kind that is written out, since f2py maps a renamed kind to a C float
!> without a word. Arrays have explicit shapes and are passed without copies: an array of Python of
!> shape (ny, nx) is one of shape [nx, ny] here. The status is 0 or that of the error.
!> One call at a time: the planner of the FFTs is not made for two.
module asperity_flat
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   implicit none
   private

   public :: library_version, release_idle_threads, set_thread_count
   public :: surface_height, surface_psd, surface_radial_psd, surface_statistics
   public :: contact_adhesive, contact_normal
   public :: input_check, input_groups, input_listed, map_checksum
   public :: operator_apply, operator_close, operator_open, operator_symbol
   public :: run_close, run_field, run_interrupt, run_open, run_row, run_step, row_columns
   public :: simulation_close, simulation_load, simulation_open, simulation_save, simulation_steer, &
      simulation_step

contains

   !> Version of the library.
   subroutine library_version(text)
      use asperity_version, only : version_number
      character(len=32), intent(out) :: text

      text = version_number
   end subroutine library_version

   !> Use `n` threads from here on, all processors for 0; tell how many that are.
   subroutine set_thread_count(n, used)
      use asperity_parallel, only : set_threads, thread_count
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: used

      call set_threads(int(n))
      used = thread_count()
   end subroutine set_thread_count

   !> End the idle threads, before the process is copied.
   subroutine release_idle_threads()
      use asperity_parallel, only : release_threads

      call release_threads()
   end subroutine release_idle_threads

   !> Checksum of a height map, as a result names it in its attribute `height_maps`.
   subroutine map_checksum(path, dataset, nx, ny, checksum_text, status, message)
      use asperity_checksum, only : hexadecimal
      use asperity_errors, only : error_type
      use asperity_precision, only : int64
      use height_map, only : checksum_of_map
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: dataset              !! blank: the usual names
      integer(c_int), intent(in) :: nx, ny                 !! of the grid that the map is for
      character(len=16), intent(out) :: checksum_text
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      integer(int64) :: checksum

      checksum_text = ''
      call checksum_of_map(trim(path), trim(dataset), [int(nx), int(ny)], checksum, error)
      if (.not. allocated(error)) checksum_text = hexadecimal(checksum)
      call report(error, status, message)
   end subroutine map_checksum

   !> Height of one term of a surface.
   subroutine surface_height(nx, ny, lx, ly, is_free, shape_name, radius, amplitude, wavelength, &
      hurst, wavelength_long, wavelength_rolloff, wavelength_short, rms_height, rms_slope, seed, &
      generator, centre_x, centre_y, height, status, message)
      use asperity_errors, only : error_type
      use asperity_precision, only : dp
      use regular_grid, only : grid_type
      use asperity_surface, only : new_height
      use surface_settings, only : default_surface, surface_settings_type
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free              !! 1: free boundary, 0: periodic
      character(len=*), intent(in) :: shape_name
      real(c_double), intent(in) :: radius, amplitude, wavelength
      real(c_double), intent(in) :: hurst
      real(c_double), intent(in) :: wavelength_long, wavelength_rolloff, wavelength_short
      real(c_double), intent(in) :: rms_height, rms_slope
      integer(c_int), intent(in) :: seed
      character(len=*), intent(in) :: generator
      real(c_double), intent(in) :: centre_x, centre_y
      real(c_double), intent(inout) :: height(nx, ny)    !! m
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      type(surface_settings_type) :: term(1)
      real(dp), allocatable :: made(:, :)
      integer :: i, j

      grid = grid_of(nx, ny, lx, ly, is_free)
      call see_memory(grid, 4, 'the surface', error)
      if (allocated(error)) then
         call report(error, status, message)
         return
      end if
      term(1) = default_surface(grid)
      term(1)%shape = shape_name
      term(1)%radius = radius
      term(1)%amplitude = amplitude
      term(1)%wavelength = wavelength
      term(1)%hurst = hurst
      term(1)%wavelength_long = wavelength_long
      term(1)%wavelength_rolloff = wavelength_rolloff
      term(1)%wavelength_short = wavelength_short
      term(1)%rms_height = rms_height
      term(1)%rms_slope = rms_slope
      term(1)%seed = seed
      term(1)%generator = generator
      term(1)%centre_x = centre_x
      term(1)%centre_y = centre_y
      call new_height(grid, term, made, error)
      if (.not. allocated(error)) then
         do j = 1, ny
            do i = 1, nx
               height(i, j) = made(i, j)
            end do
         end do
      end if
      call report(error, status, message)
   end subroutine surface_height

   !> Power spectral density of all modes, in the order of an FFT.
   subroutine surface_psd(height, nx, ny, lx, ly, psd, status, message)
      use asperity_errors, only : error_type
      use roughness, only : height_psd
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      real(c_double), intent(inout) :: psd(nx, ny)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error

      call see_memory(grid_of(nx, ny, lx, ly, 0_c_int), 4, 'the spectrum', error)
      if (.not. allocated(error)) &
         call height_psd(grid_of(nx, ny, lx, ly, 0_c_int), height, psd, error)
      call report(error, status, message)
   end subroutine surface_psd

   !> Radially averaged power spectral density; `most` rings have room, `rings` are found.
   subroutine surface_radial_psd(height, nx, ny, lx, ly, most, wave_numbers, psd, modes, rings, &
      status, message)
      use asperity_errors, only : error_input, error_type, fail
      use asperity_precision, only : dp
      use roughness, only : radial_psd
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: most
      real(c_double), intent(inout) :: wave_numbers(most), psd(most)
      integer(c_int), intent(inout) :: modes(most)
      integer(c_int), intent(out) :: rings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      real(dp), allocatable :: ring_wave_numbers(:), ring_psd(:)
      integer, allocatable :: ring_modes(:)

      rings = 0
      call see_memory(grid_of(nx, ny, lx, ly, 0_c_int), 4, 'the spectrum', error)
      if (.not. allocated(error)) call radial_psd(grid_of(nx, ny, lx, ly, 0_c_int), height, &
         ring_wave_numbers, ring_psd, ring_modes, error)
      if (.not. allocated(error)) then
         rings = size(ring_psd)
         if (rings > most) then
            call fail(error, error_input, 'no room for the rings of the spectrum')
         else
            wave_numbers(:rings) = ring_wave_numbers
            psd(:rings) = ring_psd
            modes(:rings) = ring_modes
         end if
      end if
      call report(error, status, message)
   end subroutine surface_radial_psd

   !> Statistics in the order of `roughness_type`.
   subroutine surface_statistics(height, nx, ny, lx, ly, is_free, values, status, message)
      use asperity_errors, only : error_type
      use roughness, only : height_statistics, roughness_type
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free              !! 1: free boundary, 0: periodic
      real(c_double), intent(out) :: values(10)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(roughness_type) :: found

      call see_memory(grid_of(nx, ny, lx, ly, is_free), 4, 'the statistics', error)
      if (.not. allocated(error)) &
         call height_statistics(grid_of(nx, ny, lx, ly, is_free), height, found, error)
      values = [found%mean, found%lowest, found%highest, found%rms_height, found%skewness, &
         found%kurtosis, found%rms_slope, found%rms_slope_differences, found%rms_curvature, &
         found%nayak]
      call report(error, status, message)
   end subroutine surface_statistics

   !> Elastic normal contact without adhesion.
   subroutine contact_normal(height, pressure, gap, nx, ny, lx, ly, is_free, modulus, approach, &
      target, warm, thesis, tolerance, max_iterations, level, iterations, ffts, residual, seconds, &
      converged, reason, status, message)
      use asperity_errors, only : error_type
      use contact_solver, only : contact_solver_type
      use normal_solvers, only : new_contact_solver
      use kernels, only : normal_half_space
      use field_sums, only : field_mean, field_rms
      use normal_state, only : control_approach, control_pressure, normal_problem_type
      use asperity_precision, only : dp
      use regular_grid, only : grid_type
      use solver_result, only : solver_result_type
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)         !! m
      real(c_double), intent(inout) :: pressure(nx, ny)    !! Pa; a start where warm
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
      call see_memory(grid, 12, 'the contact', error)
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
      call tell(outcome, iterations, ffts, residual, seconds, converged, reason)
      call report(error, status, message)
   end subroutine contact_normal

   !> Elastic normal contact with adhesion: one row of the step loop.
   subroutine contact_adhesive(height, pressure, gap, attraction, nx, ny, lx, ly, is_free, modulus, &
      potential, energy, range_, values, table, approach, load, start, thesis, tolerance, &
      max_iterations, old_level, level, energy_adhesive, contact_area, iterations, ffts, residual, &
      seconds, converged, reason, status, message)
      use adhesion_potential, only : adhesive_slope, edge_of_cells, new_tabulated_potential
      use case_settings, only : adhesion_settings_type, solver_settings_type
      use contact_rule, only : touches
      use asperity_errors, only : error_type
      use field_sums, only : field_count
      use kernels, only : normal_half_space
      use normal_step, only : new_normal_step, normal_step_type, normal_task_type
      use regular_grid, only : grid_type
      use asperity_precision, only : dp
      use solver_result, only : solver_result_type
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)           !! m
      real(c_double), intent(inout) :: pressure(nx, ny)      !! Pa; a start where that is given
      real(c_double), intent(inout) :: gap(nx, ny)           !! m; likewise
      real(c_double), intent(inout) :: attraction(nx, ny)    !! -e'(gap), Pa
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free                  !! 1: free boundary, 0: periodic
      real(c_double), intent(in) :: modulus                  !! E*, Pa
      character(len=*), intent(in) :: potential
      real(c_double), intent(in) :: energy, range_           !! J/m2 and m
      !> Attraction, Pa, and its slope, Pa/m, at equidistant gaps from 0 to the range: the potential where
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
      call see_memory(grid, merge(32, 20, is_free == 1), 'the contact', error)
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
      call tell(outcome, iterations, ffts, residual, seconds, converged, reason)
      call report(error, status, message)
   end subroutine contact_adhesive

   !> Read a case and prepare its run: the handle is for the calls that follow.
   subroutine run_open(path, text, output, threads, restart, overwrite, handle, rows, first, &
      result_path, warnings, status, message)
      use case_files, only : overwritten_file
      use case_input, only : parse_case, read_case
      use case_run, only : run_type
      use case_settings, only : case_type
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : free_run, new_run, run_of
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: text                 !! the input; empty: what the file holds
      character(len=*), intent(in) :: output               !! of the result; blank: what the case says
      integer(c_int), intent(in) :: threads                !! 0: what the case says
      integer(c_int), intent(in) :: restart                !! 1: go on from the checkpoint
      integer(c_int), intent(in) :: overwrite              !! 1: replace an unfinished run
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: rows                  !! rows of the whole history
      integer(c_int), intent(out) :: first                 !! rows done before
      character(len=1024), intent(out) :: result_path
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error, closing
      type(case_type) :: case
      type(run_type), pointer :: run
      integer :: number
!f2py threadsafe

      handle = 0
      rows = 0
      first = 0
      result_path = ''
      warnings = ''
      if (len(text) > 0) then
         call parse_case(text, trim(path), case, error)
      else
         call read_case(trim(path), case, error)
      end if
      if (.not. allocated(error)) then
         if (output /= '') then
            case%output%file = output
            if (overwritten_file(case) /= '') call fail(error, error_input, 'output = '//output// &
               ': would be written over '//overwritten_file(case))
         end if
      end if
      if (.not. allocated(error)) then
         if (threads > 0) case%solver%threads = threads
         result_path = case%output%file
         warnings = case%warnings
         call new_run(number)
         if (number == 0) then
            call fail(error, error_input, 'too many runs are open: close some')
         else
            run => run_of(number)
            call run%open(case, restart == 1, overwrite == 1, error)
            if (allocated(error)) then
               call run%close(closing)
               call free_run(number)
            else
               handle = number
               rows = run%rows
               if (restart == 1) first = run%sim%state%row%step + 1
               call take_warnings(run%warnings, warnings)
               run%warnings = ''
            end if
         end if
      end if
      call report(error, status, message)
   end subroutine run_open

   !> Do a row of the history; after an error the run is to be closed. Meanwhile some signals ask the
   !> run to stop, as they do in the program: a row that is given up leaves the run as it was. A signal
   !> that came is sent again at the end, to whoever handles it outside of the call.
   subroutine run_step(handle, n, signals, finished, step, time, contact_area, friction, warnings, &
      status, message)
      use asperity_signals, only : catch_stops, give_back_stops, stop_was_asked
      use case_run, only : run_type
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : run_of
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: signals(n)             !! their numbers
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      integer(c_int), intent(out) :: step                  !! -1: the row was given up
      real(c_double), intent(out) :: time, contact_area, friction
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run
!f2py threadsafe

      finished = 1
      step = 0
      time = 0.0_c_double
      contact_area = 0.0_c_double
      friction = 0.0_c_double
      warnings = ''
      run => run_of(int(handle))
      if (associated(run)) then
         run%sim%stop%asked => stop_was_asked
         call catch_stops(signals)
         if (.not. run%finished) call run%step(error)
         call give_back_stops(signals)
         finished = merge(1, 0, run%finished)
         step = run%sim%state%row%step
         if (run%sim%stop%given_up) step = -1
         time = run%sim%state%row%time
         contact_area = run%sim%state%row%contact_area
         friction = run%sim%state%row%friction
         call take_warnings(run%warnings, warnings)
         run%warnings = ''
      else
         call fail(error, error_input, 'the run is closed')
      end if
      call report(error, status, message)
   end subroutine run_step

   !> Write a snapshot and a checkpoint of where a run stands.
   subroutine run_interrupt(handle, status, message)
      use case_run, only : run_type
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : run_of
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run

      run => run_of(int(handle))
      if (associated(run)) then
         call run%interrupt(error)
      else
         call fail(error, error_input, 'the run is closed')
      end if
      call report(error, status, message)
   end subroutine run_interrupt

   !> Close a run; a handle that is not in use is no error.
   subroutine run_close(handle, status, message)
      use case_run, only : run_type
      use asperity_errors, only : error_type
      use run_handles, only : free_run, run_of
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(run_type), pointer :: run

      run => run_of(int(handle))
      if (associated(run)) call run%close(error)
      call free_run(int(handle))
      call report(error, status, message)
   end subroutine run_close

   !> The columns of a row: lines 'name units whole long_name', with whole = 1 for whole numbers.
   subroutine row_columns(most, buffer, length)
      use history_row, only : column_type, history_columns
      integer(c_int), intent(in) :: most                       !! characters that the buffer holds
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length                    !! of the text; above `most`: none is written
      type(column_type), allocatable :: columns(:)
      character(:), allocatable :: text
      integer :: i

      columns = history_columns()
      text = ''
      do i = 1, size(columns)
         text = text//trim(columns(i)%name)//' '//trim(columns(i)%units)//' '// &
            merge('1', '0', columns(i)%whole)//' '//trim(columns(i)%long_name)//new_line('a')
      end do
      call put_text(text, buffer, length)
   end subroutine row_columns

   !> The last row of a run or a simulation, in the order of `row_columns`.
   subroutine run_row(handle, n, values, status, message)
      use asperity_errors, only : error_input, error_type, fail
      use history_row, only : row_values
      use run_handles, only : sim_of
      use asperity_simulation, only : simulation_type
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n                          !! the number of columns
      real(c_double), intent(inout) :: values(n)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(simulation_type), pointer :: sim
      real(c_double), allocatable :: found(:)

      sim => sim_of(int(handle))
      if (.not. associated(sim)) then
         call fail(error, error_input, 'the simulation is closed')
      else
         found = row_values(sim%state%row)
         if (size(found) /= n) call fail(error, error_input, 'a row has another number of columns')
         if (size(found) == n) values = found
      end if
      call report(error, status, message)
   end subroutine run_row

   !> A field of a run or a simulation, as a snapshot would hold it; 'height' is the road under the
   !> rubber.
   subroutine run_field(handle, name, nx, ny, values, status, message)
      use asperity_errors, only : error_input, error_type, fail
      use asperity_precision, only : dp, int8
      use run_handles, only : sim_of
      use asperity_simulation, only : simulation_type
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(inout) :: values(nx, ny)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(simulation_type), pointer :: sim
      integer(int8), allocatable :: states(:, :)

      sim => sim_of(int(handle))
      if (.not. associated(sim)) then
         call fail(error, error_input, 'the simulation is closed')
      else if (nx /= sim%grid%nx .or. ny /= sim%grid%ny) then
         call fail(error, error_input, 'the field has another shape')
      else if (name == 'height') then
         values(:, :) = sim%height
      else if (name == 'contact') then
         allocate (states(nx, ny))
         call sim%contact_rows(1, states)
         values(:, :) = real(states, dp)
      else
         call sim%field_rows(name, 1, values)
      end if
      call report(error, status, message)
   end subroutine run_field

   !> Prepare a simulation that writes no files.
   subroutine simulation_open(path, text, threads, handle, rows, nx, ny, lx, ly, warnings, status, &
      message)
      use case_identity, only : identity_of
      use case_input, only : parse_case, read_case
      use case_memory, only : memory_needed
      use case_report, only : resolved_input
      use case_record, only : map_lines
      use case_settings, only : case_type
      use asperity_errors, only : error_input, error_type, fail
      use memory_limits, only : need_memory
      use asperity_parallel, only : set_threads
      use run_handles, only : driven_of, driven_type, free_driven, new_driven
      use asperity_schedule, only : count_rows
      use asperity_simulation, only : new_simulation
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: text                 !! the input; empty: what the file holds
      integer(c_int), intent(in) :: threads                !! 0: what the case says
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: rows                  !! rows of the whole history
      integer(c_int), intent(out) :: nx, ny
      real(c_double), intent(out) :: lx, ly
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error
      type(case_type) :: case
      type(driven_type), pointer :: driven
      integer :: number
!f2py threadsafe

      handle = 0
      rows = 0
      nx = 0
      ny = 0
      lx = 0.0_c_double
      ly = 0.0_c_double
      warnings = ''
      if (len(text) > 0) then
         call parse_case(text, trim(path), case, error)
      else
         call read_case(trim(path), case, error)
      end if
      if (.not. allocated(error)) then
         call new_driven(number)
         if (number == 0) call fail(error, error_input, 'too many simulations are open: close some')
      end if
      if (.not. allocated(error)) then
         if (threads > 0) case%solver%threads = threads
         call set_threads(case%solver%threads)
         warnings = case%warnings
         driven => driven_of(number)
         call need_memory(memory_needed(case), 'the simulation', error)
         if (.not. allocated(error)) call new_simulation(driven%sim, case, error, &
            movable=.not. all(case%phases%static))
         if (allocated(error)) then
            call free_driven(number)
         else
            driven%settings = without_files(identity_of(resolved_input(case)))//map_lines(driven%sim)
            driven%start_tau = case%material%prony_tau
            driven%start_temperature = case%material%temperature
            handle = number
            rows = count_rows(case%phases)
            nx = case%grid%nx
            ny = case%grid%ny
            lx = case%grid%lx
            ly = case%grid%ly
            call take_warnings(driven%sim%warnings, warnings)
            driven%sim%warnings = ''
         end if
      end if
      call report(error, status, message)
   end subroutine simulation_open

   !> Settings without the names of height maps: their checksums say whether they are the same.
   function without_files(settings) result(kept)
      character(len=*), intent(in) :: settings             !! lines 'group: name = value'
      character(:), allocatable :: kept, line
      integer :: at, next

      kept = ''
      at = 1
      do while (at <= len(settings))
         next = index(settings(at:), new_line('a'))
         if (next == 0) next = len(settings) - at + 2
         line = settings(at:at + next - 2)
         at = at + next
         if (index(line, ': file = ') == 0) kept = kept//line//new_line('a')
      end do
   end function without_files

   !> Do a row. Where a solver did not converge, the state reached is kept and the status says so.
   subroutine simulation_step(handle, finished, warnings, status, message)
      use asperity_errors, only : error_convergence, error_input, error_type, fail
      use run_handles, only : driven_of, driven_type
      use text_tools, only : to_text
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      character(len=20000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
!f2py threadsafe

      finished = 1
      warnings = ''
      driven => driven_of(int(handle))
      if (.not. associated(driven)) then
         call fail(error, error_input, 'the simulation is closed')
      else
         associate (sim => driven%sim)
            if (.not. sim%finished) call sim%advance(error)
            finished = merge(1, 0, sim%finished)
            call take_warnings(sim%warnings, warnings)
            sim%warnings = ''
            if (.not. allocated(error) .and. .not. sim%converged) call fail(error, error_convergence, &
               'step '//to_text(sim%state%row%step)//' of phase '//to_text(sim%state%row%phase)//', t = '// &
               to_text(sim%state%row%time)//' s: the solver did not converge: '//trim(sim%reason)// &
               '; residual '//to_text(sim%residual)//', allowed '// &
               to_text(sim%case%solver%tolerance))
         end associate
      end if
      call report(error, status, message)
   end subroutine simulation_step

   !> Set a load, the velocity or the temperature, from the next row on.
   subroutine simulation_steer(handle, what, first, second, status, message)
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : driven_of, driven_type
      use steering, only : steer_load, steer_temperature, steer_velocity
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: what        !! 'pressure', 'force', 'displacement', 'velocity', 'temperature'
      real(c_double), intent(in) :: first, second !! the second for the velocity along y only
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven

      driven => driven_of(int(handle))
      if (.not. associated(driven)) then
         call fail(error, error_input, 'the simulation is closed')
      else
         select case (what)
         case ('velocity')
            call steer_velocity(driven%sim, [first, second], error)
         case ('temperature')
            call steer_temperature(driven%sim, first, driven%start_temperature, driven%start_tau, error)
         case default
            call steer_load(driven%sim, what, first, error)
         end select
      end if
      call report(error, status, message)
   end subroutine simulation_steer

   !> Write the state of a simulation, as a checkpoint of `path`.
   subroutine simulation_save(handle, path, status, message)
      use asperity_checkpoint, only : checkpoint_writer_type
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : driven_of, driven_type
      use simulation_state, only : save_state
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
      type(checkpoint_writer_type) :: writer

      driven => driven_of(int(handle))
      if (.not. associated(driven)) then
         call fail(error, error_input, 'the simulation is closed')
      else
         call writer%start(path, 'a simulation', driven%settings, error)
         if (.not. allocated(error)) call save_state(driven%sim, writer, error)
         if (.not. allocated(error)) call writer%commit(error)
      end if
      call report(error, status, message)
   end subroutine simulation_save

   !> Take the state of a simulation from the checkpoint of `path`, written by `simulation_save`.
   subroutine simulation_load(handle, path, finished, status, message)
      use asperity_checkpoint, only : checkpoint_reader_type
      use asperity_errors, only : error_input, error_type, fail
      use run_handles, only : driven_of, driven_type
      use simulation_state, only : load_state
      integer(c_int), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: finished              !! 1: no row is left
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven
      type(checkpoint_reader_type) :: reader

      finished = 0
      driven => driven_of(int(handle))
      if (.not. associated(driven)) then
         call fail(error, error_input, 'the simulation is closed')
      else
         call reader%open(path, error)
         if (.not. allocated(error)) then
            call reader%compare(driven%settings, error)
            if (.not. allocated(error)) call load_state(driven%sim, reader, error)
            call reader%close()
            finished = merge(1, 0, driven%sim%finished)
         end if
      end if
      call report(error, status, message)
   end subroutine simulation_load

   !> Free a simulation; a handle that is not in use is no error.
   subroutine simulation_close(handle, status, message)
      use asperity_errors, only : error_type
      use run_handles, only : driven_of, driven_type, free_driven
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(driven_type), pointer :: driven

      driven => driven_of(int(handle))
      if (associated(driven)) call driven%sim%destroy()
      call free_driven(int(handle))
      call report(error, status, message)
   end subroutine simulation_close

   !> Prepare an operator: the displacements that tractions cause.
   subroutine operator_open(tangential, nx, ny, lx, ly, is_free, modulus, poisson, thickness, handle, &
      mx, my, status, message)
      use asperity_errors, only : error_input, error_type, fail
      use fft_conv, only : new_convolution
      use kernels, only : normal_half_space, tangential_half_space
      use operator_handles, only : free_operator, new_operator, operator_of, operator_type
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
      call see_memory(grid_of(nx, ny, lx, ly, is_free), merge(8, 4, tangential == 1), 'the operator', error)
      number = 0
      if (.not. allocated(error)) call new_operator(number)
      if (allocated(error)) then
         handle = 0
      else if (number == 0) then
         call fail(error, error_input, 'too many operators are open')
      else
         operator => operator_of(number)
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
      use asperity_errors, only : error_input, error_type, fail
      use operator_handles, only : operator_of, operator_type
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: px(nx, ny), py(nx, ny)     !! Pa
      real(c_double), intent(inout) :: ux(nx, ny), uy(nx, ny)  !! m
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(operator_type), pointer :: operator

      operator => operator_of(int(handle))
      if (.not. associated(operator)) then
         call fail(error, error_input, 'the operator is closed')
      else if (nx /= operator%map%nx .or. ny /= operator%map%ny) then
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
      use asperity_errors, only : error_input, error_type, fail
      use operator_handles, only : operator_of, operator_type
      use asperity_precision, only : dp
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: part                       !! 1; of a tangential one 1: xx, 2: yy, 3: xy
      integer(c_int), intent(in) :: columns, rows              !! mx/2 + 1 and my/2 + 1
      real(c_double), intent(inout) :: values(columns, rows)   !! m/Pa
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(operator_type), pointer :: operator

      operator => operator_of(int(handle))
      if (.not. associated(operator)) then
         call fail(error, error_input, 'the operator is closed')
      else if (columns /= operator%map%mx/2 + 1 .or. rows /= operator%map%my/2 + 1) then
         call fail(error, error_input, 'the symbol has another shape')
      else
         values(:, :) = operator%map%symbol_of(int(part))/operator%modulus
      end if
      call report(error, status, message)
   end subroutine operator_symbol

   !> Free an operator; a handle that is not in use is no error.
   subroutine operator_close(handle, status, message)
      use asperity_errors, only : error_type
      use operator_handles, only : free_operator
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error

      call free_operator(int(handle))
      call report(error, status, message)
   end subroutine operator_close

   !> The table of the input's groups and variables, as `input_table` writes it.
   subroutine input_groups(most, buffer, length)
      use input_listing, only : input_table
      integer(c_int), intent(in) :: most                       !! characters that the buffer holds
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length                    !! of the text; above `most`: none is written

      call put_text(input_table(), buffer, length)
   end subroutine input_groups

   !> The values of a text of namelists, as `list_values` writes them.
   subroutine input_listed(text, path, most, buffer, length, status, message)
      use asperity_errors, only : error_type
      use input_listing, only : list_values
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: path                     !! for messages
      integer(c_int), intent(in) :: most
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      character(:), allocatable :: listing
      type(error_type), allocatable :: error

      length = 0
      call list_values(text, path, listing, error)
      if (.not. allocated(error)) call put_text(listing, buffer, length)
      call report(error, status, message)
   end subroutine input_listed

   !> What `asperity check` prints about a text.
   subroutine input_check(text, path, files, most, buffer, length, status, message)
      use case_input, only : parse_case
      use case_report, only : case_summary, resolved_input
      use case_settings, only : case_type
      use asperity_errors, only : error_type
      use asperity_surface, only : check_files
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: path                     !! where paths start, and for messages
      integer(c_int), intent(in) :: files                      !! 1: look into the height maps, too
      integer(c_int), intent(in) :: most
      integer(c_int), intent(inout) :: buffer(most)             !! codes of the characters
      integer(c_int), intent(out) :: length
      integer(c_int), intent(out) :: status
      character(len=20000), intent(out) :: message
      type(case_type) :: case
      type(error_type), allocatable :: error

      length = 0
      call parse_case(text, path, case, error)
      if (.not. allocated(error) .and. files == 1) call check_files(case%grid, case%surfaces, error)
      if (.not. allocated(error)) call put_text(resolved_input(case)//case_summary(case), buffer, length)
      call report(error, status, message)
   end subroutine input_check

   !> Copy a text into a buffer that holds it; the length tells how long it must be.
   subroutine put_text(text, buffer, length)
      character(len=*), intent(in) :: text
      integer(c_int), intent(inout) :: buffer(:)
      integer(c_int), intent(out) :: length
      integer :: i

      length = len(text)
      if (length > size(buffer)) return
      do i = 1, length
         buffer(i) = ichar(text(i:i))
      end do
   end subroutine put_text

   !> Add new warnings, a line each.
   subroutine take_warnings(new, warnings)
      character(len=*), intent(in) :: new
      character(len=*), intent(inout) :: warnings

      if (len_trim(new) == 0) return
      if (len_trim(warnings) > 0) warnings = trim(warnings)//new_line('a')//new
      if (len_trim(warnings) == 0) warnings = new
   end subroutine take_warnings

   !> The grid of plain numbers.
   function grid_of(nx, ny, lx, ly, is_free) result(grid)
      use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
      integer(c_int), intent(in) :: nx, ny, is_free
      real(c_double), intent(in) :: lx, ly
      type(grid_type) :: grid

      grid = new_grid(int(nx), int(ny), lx, ly, merge(boundary_free, boundary_periodic, is_free == 1))
   end function grid_of

   !> See that there is memory for some fields of a grid.
   subroutine see_memory(grid, fields, task, error)
      use asperity_errors, only : error_type
      use memory_limits, only : need_memory
      use asperity_precision, only : dp
      use regular_grid, only : boundary_free, grid_type
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: fields                        !! doubles per cell; a free grid is padded
      character(len=*), intent(in) :: task
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: cells

      cells = real(grid%nx, dp)*grid%ny
      if (grid%boundary == boundary_free) cells = 1.6_dp*cells
      call need_memory(8.0_dp*fields*cells, task, error)
   end subroutine see_memory

   !> What a solve was, in the arguments of a call.
   subroutine tell(outcome, iterations, ffts, residual, seconds, converged, reason)
      use asperity_precision, only : dp
      use solver_result, only : solver_result_type
      type(solver_result_type), intent(in) :: outcome
      integer(c_int), intent(out) :: iterations
      real(c_double), intent(out) :: ffts, residual, seconds
      integer(c_int), intent(out) :: converged             !! 1 or 0
      character(len=64), intent(out) :: reason

      iterations = outcome%iterations
      ffts = real(outcome%ffts, dp)
      residual = outcome%residual
      seconds = outcome%seconds
      converged = merge(1, 0, outcome%converged)
      reason = outcome%reason
   end subroutine tell

   !> Turn an error into a status and a message.
   subroutine report(error, status, message)
      use asperity_errors, only : error_type
      type(error_type), allocatable, intent(in) :: error
      integer(c_int), intent(out) :: status
      character(len=*), intent(out) :: message

      status = 0
      message = ''
      if (.not. allocated(error)) return
      status = error%status
      message = error%message
   end subroutine report

end module asperity_flat
