!> Tests of whole runs with many passes, and of an oscillating block: threads, restarts, order in time, and
!> the error of the energy balance without the slope effect.
module test_coupled_runs
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type, remove_checkpoint
   use asperity_errors, only : error_type
   use asperity_threads, only : set_threads
   use asperity_precision, only : dp
   use asperity_simulation, only : new_simulation, simulation_type
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use history_table, only : column_type, history_columns, row_values
   use simulation_runs, only : check_books, last, nl, record_type, run_case, start_case
   use simulation_state, only : load_state, save_state
   use text_tools, only : to_text
   implicit none
   private

   public :: run_coupled_runs

   character(*), parameter :: path = 'test_coupled_runs.h5'

contains

   subroutine run_coupled_runs()
      call begin_suite('coupled_runs')
      if (selected('same_bits_on_threads_and_after_restart')) &
         call same_bits_on_threads_and_after_restart(steep(), 'steep road')
      if (selected('same_bits_on_threads_and_after_restart')) &
         call same_bits_on_threads_and_after_restart(swinging(), 'swinging block')
      if (selected('orders_in_time_with_friction')) call orders_in_time_with_friction()
      if (selected('missing_work_of_the_flat_law')) call missing_work_of_the_flat_law()
      if (selected('constant_shear_settles_and_books_close')) call constant_shear_settles_and_books_close()
   end subroutine run_coupled_runs

   !> A steep road under a viscoelastic block, with a drop of the load. Its rows need many passes.
   function steep() result(text)
      character(:), allocatable :: text

      text = '&grid nx = 32, ny = 32, lx = 1e-3, ly = 1e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.2e-3, rms_slope = 0.45, seed = 3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-3, thickness = 0.5e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.8 /'//nl// &
         '&phase pressure = 0.4e6 /'//nl// &
         '&phase velocity_x = 0.1, velocity_y = 0.03, duration = 1.5e-3, steps = 5 /'//nl// &
         '&phase pressure = 0.2e6, duration = 0.6e-3, steps = 2 /'//nl// &
         '&solver tolerance = 1e-7 /'
   end function steep

   !> A block with a mass on a rough road that sticks, slips and oscillates, with twelve steps per period.
   function swinging() result(text)
      character(:), allocatable :: text

      text = '&grid nx = 30, ny = 24, lx = 1e-3, ly = 0.8e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.2e-3, rms_slope = 0.2, seed = 2 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 0.5e6, prony_tau = 2e-4, thickness = 1e-3, '// &
         'density = 2000 /'//nl//'&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
         '&phase pressure = 1e5 /'//nl// &
         '&phase velocity_x = 0.3, velocity_y = 0.05, duration = 4e-4, steps = 24 /'//nl// &
         '&phase pressure = 0.5e5, velocity_x = 0.3, duration = 1e-4, steps = 6 /'//nl// &
         '&solver tolerance = 1e-7 /'
   end function swinging

   !> One and two threads give the same bits, and so does a run that is continued from a checkpoint.
   subroutine same_bits_on_threads_and_after_restart(text, what)
      character(*), intent(in) :: text
      character(*), intent(in) :: what
      real(dp), allocatable :: one(:, :), two(:, :), parts(:, :)

      call set_threads(1)
      call run_rows(text, what, huge(0), one)
      call run_rows(text, what, size(one, 2)/2, parts)
      call check_same_bits(one, parts, what//': restart')
      call set_threads(2)
      call run_rows(text, what, huge(0), two)
      call check_same_bits(one, two, what//': threads')
   end subroutine same_bits_on_threads_and_after_restart

   !> All rows of a run, [column, row]. The run is stopped and continued after a number of rows.
   subroutine run_rows(text, what, stop_after, values)
      character(*), intent(in) :: text
      character(*), intent(in) :: what
      integer, intent(in) :: stop_after
      real(dp), allocatable, intent(out) :: values(:, :)
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      integer :: rows

      allocate (values(size(history_columns()), 0))
      call start_case(text, what, case, sim, error)
      if (allocated(error)) return
      rows = 0
      do while (.not. sim%finished)
         if (rows == stop_after) call through_checkpoint(case, what, sim)
         call sim%advance(error)
         call check_no_error(error, what//': row')
         if (allocated(error)) exit
         call check_that(sim%converged, what//': converged: '//sim%reason)
         if (.not. sim%converged) exit
         values = reshape([values, row_values(sim%state%row)], [size(values, 1), rows + 1])
         rows = rows + 1
      end do
      call sim%destroy()
   end subroutine run_rows

   !> Replace a simulation by a new one that reads its state from a checkpoint.
   subroutine through_checkpoint(case, what, sim)
      type(case_type), intent(in) :: case
      character(*), intent(in) :: what
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_writer_type) :: writer
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error

      call writer%start(path, 'id', 'settings', error)
      if (.not. allocated(error)) call save_state(sim, writer, error)
      if (.not. allocated(error)) call writer%commit(error)
      call check_no_error(error, what//': checkpoint written')
      call sim%destroy()
      call new_simulation(sim, case, error)
      if (.not. allocated(error)) call reader%open(path, error)
      if (.not. allocated(error)) call load_state(sim, reader, error)
      call check_no_error(error, what//': checkpoint read')
      call reader%close()
      call remove_checkpoint(path)
   end subroutine through_checkpoint

   !> Two runs have the same rows, except for the wall time.
   subroutine check_same_bits(one, other, what)
      real(dp), intent(in) :: one(:, :), other(:, :)
      character(*), intent(in) :: what
      type(column_type), allocatable :: columns(:)
      integer :: i

      call check_that(size(one, 2) > 4 .and. size(one, 2) == size(other, 2), what//': number of rows', &
         [real(size(one, 2), dp), real(size(other, 2), dp)])
      if (size(one, 2) /= size(other, 2)) return
      columns = history_columns()
      do i = 1, size(columns)
         if (columns(i)%name == 'seconds') cycle
         call check_close(maxval(abs(one(i, :) - other(i, :))), 0.0_dp, 0.0_dp, &
            what//': '//trim(columns(i)%name))
      end do
   end subroutine check_same_bits

   !> The order in time with friction (docs/theory.md). On a profile the surface slips along one line, and
   !> friction, approach and losses are of second order. On a map each point slips in its own direction, for
   !> which the mean slip of a step is late by half a step. The traction across the motion is therefore of
   !> first order, and all other quantities by a small part.
   subroutine orders_in_time_with_friction()
      integer, parameter :: steps(3) = [16, 64, 256]
      type(record_type) :: record
      real(dp) :: found(3, 3), order(3), coarse(3)
      integer :: k, m

      do m = 1, 2
         do k = 1, size(steps)
            call run_case(order_case(m == 1, steps(k)), 'order', record)
            associate (row => record%rows(last(record)))
               found(:, k) = [row%friction, row%displacement, row%traction_y/row%pressure]
               if (m == 1) found(3, k) = row%dissipated_viscous
            end associate
         end do
         coarse = abs(found(:, 1) - found(:, 3))
         order = log(coarse/abs(found(:, 2) - found(:, 3)))/log(4.0_dp)
         if (m == 1) then
            call check_that(all(order > 1.7_dp), 'order 2 on a profile: '//to_text(minval(order)))
            call check_close(coarse(1)/found(1, 3), 0.0_dp, 3e-4_dp, 'a profile at a cell per step: friction')
         else
            call check_that(order(3) > 0.7_dp .and. order(3) < 1.5_dp, 'order 1 across: '//to_text(order(3)))
            call check_close(coarse(1)/found(1, 3), 0.0_dp, 4e-4_dp, 'a map at half a cell per step: friction')
         end if
      end do
   end subroutine orders_in_time_with_friction

   !> A viscoelastic block that starts to slide along x and slides over a third of the road.
   function order_case(profile, steps) result(text)
      logical, intent(in) :: profile
      integer, intent(in) :: steps
      character(:), allocatable :: text

      if (profile) then
         text = '&grid nx = 64, ny = 1, lx = 1e-3, ly = 1e-3 /'//nl//'&phase pressure = 0.6e6 /'//nl
      else
         text = '&grid nx = 24, ny = 20, lx = 1e-3, ly = 0.9e-3 /'//nl//'&phase pressure = 1.5e6 /'//nl
      end if
      text = text//'&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.25e-3, rms_slope = 0.2, seed = 5 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 5e-4, thickness = 0.3e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
         '&phase velocity_x = 0.2, duration = 1.6e-3, steps = '//to_text(steps)//' /'//nl// &
         '&solver tolerance = 1e-9 /'
   end function order_case

   !> Without `slope_effect` the road also pushes the rubber with -P grad H. No column contains the work of
   !> this force on the motion of the rubber's surface. The missing work is then of second order in the slope
   !> for any length of the steps. With `slope_effect` it falls with the steps.
   subroutine missing_work_of_the_flat_law()
      type(record_type) :: record
      real(dp) :: missing(2), steeper

      call miss('.true.', 0.25_dp, 64, missing(1))
      call miss('.true.', 0.25_dp, 256, missing(2))
      call check_that(abs(missing(2)) < 0.2_dp*abs(missing(1)) .and. abs(missing(1)) < 1e-3_dp, &
         'with slope_effect: '//to_text(missing(1))//', '//to_text(missing(2)), missing)
      call miss('.false.', 0.25_dp, 64, missing(1))
      call miss('.false.', 0.25_dp, 256, missing(2))
      call check_close(missing(2)/missing(1), 1.0_dp, 0.02_dp, 'without: the same in short steps')
      call check_close(missing(2), 0.025_dp, 0.005_dp, 'without: 2.5 % of the losses')
      call miss('.false.', 0.125_dp, 64, steeper)
      call check_close(missing(1)/steeper, 4.0_dp, 1.0_dp, 'without: of second order in the slope')

   contains

      !> The work missing over the losses, in the second half of a slide.
      subroutine miss(effect, slope, steps, part)
         character(*), intent(in) :: effect
         real(dp), intent(in) :: slope
         integer, intent(in) :: steps
         real(dp), intent(out) :: part

         call run_case(flat_case(effect, slope, steps), 'flat law', record)
         associate (a => record%rows(last(record)/2), b => record%rows(last(record)))
            part = (b%work_missing - a%work_missing)/(b%dissipated_friction + b%dissipated_viscous &
               - a%dissipated_friction - a%dissipated_viscous)
         end associate
      end subroutine miss

   end subroutine missing_work_of_the_flat_law

   !> A rough road under a viscoelastic block.
   function flat_case(effect, slope, steps) result(text)
      character(*), intent(in) :: effect
      real(dp), intent(in) :: slope             !! rms slope; the load is proportional to it
      integer, intent(in) :: steps
      character(:), allocatable :: text

      text = '&grid nx = 32, ny = 24, lx = 0.8e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 4e-4, wavelength_short = 2e-4, '// &
         'rms_slope = '//to_text(slope)//', seed = 3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-3, thickness = 1e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5, slope_effect = '//effect//' /'//nl// &
         '&phase pressure = '//to_text(1.6e6_dp*slope)//', relaxed = .true., duration = 0.8e-3, velocity_x = 1.0, steps = '// &
         to_text(steps)//' /'//nl//'&solver tolerance = 1e-7 /'
   end function flat_case

   !> A steep road with a constant shear stress, where cells at the edge are partly sheared. Without the
   !> shares of the cells, the passes of its steps would end with an error of 1e-4 or more.
   subroutine constant_shear_settles_and_books_close()
      type(record_type) :: record

      call run_case('&grid nx = 48, ny = 41, lx = 1e-3, ly = 0.9e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.15e-3, rms_slope = 0.5, seed = 3 /'//nl// &
         '&material shear_modulus = 0.5e6, prony_g = 1e6, prony_tau = 1e-2, thickness = 1e-3 /'//nl// &
         '&friction law = ''constant_shear'', shear_strength = 3e5 /'//nl// &
         '&phase pressure = 5e4, duration = 0.01, steps = 2 /'//nl// &
         '&phase velocity_x = 10e-3, duration = 0.003, steps = 6 /'//nl// &
         '&solver tolerance = 1e-6 /', 'constant shear', record)
      call check_order(maxval(record%rows%residual_coupling), '<=', 1.0e-6_dp, 'the steps settle')
      call check_order(maxval(record%rows%passes), '<=', 80, 'within few passes')
      call check_books(record, 'constant shear', 1.0e-6_dp)
   end subroutine constant_shear_settles_and_books_close

end module test_coupled_runs
