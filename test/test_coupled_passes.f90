!> Tests of the passes of a row with friction: acceleration, control, and the states that they reach.
module test_coupled_passes
   use anderson, only : anderson_type, new_anderson
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use carried_field, only : carry
   use pass_control, only : pass_control_type
   use adhesion_potential, only : adhesion_potential_type
   use asperity_precision, only : dp, int8
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use place_forecast, only : new_place_forecast, place_forecast_type
   use simulation_runs, only : check_books, nl, record_type, run_case
   use edge_shares, only : edge_rule_type, new_edge_rule
   use touching_cells, only : mark_contact, mark_shares
   implicit none
   private

   public :: run_coupled_passes

contains

   subroutine run_coupled_passes()
      call begin_suite('coupled_passes')
      if (selected('carried_fields_move_with_the_contact')) &
         call carried_fields_move_with_the_contact()
      if (selected('forecast_finds_quadratic_changes')) call forecast_finds_quadratic_changes()
      if (selected('forecast_leaves_erratic_changes_alone')) call forecast_leaves_erratic_changes_alone()
      if (selected('forecast_saves_passes')) call forecast_saves_passes()
      if (selected('mixing_settles_where_plain_passes_fail')) &
         call mixing_settles_where_plain_passes_fail()
      if (selected('accuracy_follows_the_mismatch')) call accuracy_follows_the_mismatch()
      if (selected('slow_passes_are_solved_all_at_once')) call slow_passes_are_solved_all_at_once()
      if (selected('edge_cells_are_judged_one_by_one')) call edge_cells_are_judged_one_by_one()
      if (selected('thick_block_on_steep_wave_settles')) call thick_block_on_steep_wave_settles()
      if (selected('steep_road_settles_and_books_close')) call steep_road_settles_and_books_close()
   end subroutine run_coupled_passes

   !> A field moves exactly by whole cells, and bilinearly by parts of a cell. It continues periodically, or
   !> constantly beyond the rim of a free map.
   subroutine carried_fields_move_with_the_contact()
      integer, parameter :: nx = 9, ny = 5
      real(dp), parameter :: cell(2) = [0.5_dp, 0.3_dp]
      type(grid_type) :: periodic, free
      real(dp) :: field(nx, ny), moved(nx, ny), expected(nx, ny)
      integer :: i, j

      periodic = new_grid(nx, ny, nx*cell(1), ny*cell(2), boundary_periodic)
      free = new_grid(nx, ny, nx*cell(1), ny*cell(2), boundary_free)
      do j = 1, ny
         do i = 1, nx
            field(i, j) = sin(1.3_dp*i) + cos(2.1_dp*i*j)
         end do
      end do
      call carry(periodic, field, [2, -1]*cell, moved)
      expected = cshift(cshift(field, 2, dim=1), -1, dim=2)
      call check_close(maxval(abs(moved - expected)), 0.0_dp, 1.0e-14_dp, 'whole cells, periodic')
      call carry(periodic, field, [-0.25_dp, 0.0_dp]*cell, moved)
      expected = 0.75_dp*field + 0.25_dp*cshift(field, -1, dim=1)
      call check_close(maxval(abs(moved - expected)), 0.0_dp, 1.0e-14_dp, 'a part of a cell')
      call carry(free, field, [1.5_dp, 0.0_dp]*cell, moved)
      call check_close(moved(3, 2), 0.5_dp*(field(4, 2) + field(5, 2)), 1.0e-14_dp, 'free, inside')
      call check_close(moved(nx, 2), field(nx, 2), 1.0e-14_dp, 'free, at the rim')
   end subroutine carried_fields_move_with_the_contact

   !> Five cells: in contact, open, open with a pressure of round-off, with a gap that is 0 to the tolerance,
   !> and one that overlaps with the road.
   subroutine edge_cells_are_judged_one_by_one()
      real(dp), parameter :: soft = 1.0e-12_dp, reach = 2.0e-6_dp
      real(dp), parameter :: pressure(5, 1) = reshape([3.0e6_dp, 0.0_dp, 1.0e-8_dp, 1.0e6_dp, 0.0_dp], [5, 1])
      real(dp), parameter :: gap(5, 1) = reshape([0.0_dp, 1.0e-6_dp, 1.0e-6_dp, 1.0e-9_dp, -3.0e-6_dp], [5, 1])
      type(adhesion_potential_type) :: none
      type(edge_rule_type) :: rule
      real(dp) :: share(5, 1), expected(5)
      integer(int8) :: contact(5, 1)

      contact = 0_int8
      contact(1, 1) = 2_int8
      call mark_contact(.false., pressure, gap, contact)
      call check_that(all(contact(:, 1) == [2, 0, 1, 1, 0]), 'the pressure decides, and a cell that slipped keeps its mark')
      rule = new_edge_rule(none, soft, reach/(soft*0.1_dp), 0.1_dp)
      call check_close(rule%share_length, reach, 1.0e-9_dp, 'length of a share')
      call rule%move(pressure, gap, .true., share)
      call check_that(all(nint(share(:, 1)) == [1, 0, 0, 1, 1]), 'the gap decides, too')
      call mark_shares(share, contact)
      call check_that(all(contact(:, 1) == [2, 0, 0, 1, 1]), 'cells with a share')

      share = 0.5_dp
      call rule%move(pressure, gap, .false., share)
      expected = [1.0_dp, 0.0_dp, 0.0_dp, 0.5_dp + 0.4995_dp, 1.0_dp]
      call check_close(maxval(abs(share(:, 1) - expected)), 0.0_dp, 1.0e-9_dp, 'shares that have moved')

      ! The pressures correspond to an indentation of 4 um in all.
      share(:, 1) = [1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 1.0_dp]
      call check_close(rule%error(share, pressure, gap), 3.001_dp/4.0_dp, 1.0e-9_dp, 'gap and overlap with traction')
      share(:, 1) = [0.5_dp, 0.0_dp, 0.5_dp, 0.0_dp, 0.0_dp]
      call check_close(rule%error(share, pressure, gap), (3.0_dp + 1.0_dp + 1.0_dp + 3.0_dp)/4.0_dp, 1.0e-9_dp, &
         'pressure without the whole traction, gap and overlap')
   end subroutine edge_cells_are_judged_one_by_one

   !> A displacement that moves by one cell per step and grows with the square of the time is forecast exactly
   !> after four steps. After a step of another length there is no extrapolation.
   subroutine forecast_finds_quadratic_changes()
      integer, parameter :: nx = 12, ny = 5
      real(dp), parameter :: motion(2) = [0.5_dp, 0.0_dp]
      type(place_forecast_type) :: forecast
      type(grid_type) :: grid
      real(dp) :: pattern(nx, 2, ny), found(nx, 2, ny), carried(nx, 2, ny), place(nx, 2, ny), pressure(nx, ny)
      integer :: n

      grid = new_grid(nx, ny, 0.5_dp*nx, 0.3_dp*ny, boundary_periodic)
      call random_number(pattern)
      call random_number(pressure)
      call new_place_forecast(forecast, nx, ny)
      found = pattern
      do n = 1, 8
         carried = cshift(found, 1, dim=1)
         place = carried
         call forecast%follow(grid, merge(0.2_dp, 0.1_dp, n == 8), .true., motion)
         call forecast%add(place)
         found = cshift(pattern, n, dim=1)*(1.0_dp + 0.3_dp*n - 0.02_dp*n**2)
         if (n == 7) call check_close(maxval(abs(place - found)), 0.0_dp, 1.0e-14_dp, 'third order')
         if (n == 8) call check_close(maxval(abs(place - carried)), 0.0_dp, 0.0_dp, 'another length of step')
         call forecast%learn(found, carried, pressure)
      end do
   end subroutine forecast_finds_quadratic_changes

   !> Changes that alternate make differences of higher order larger. The forecast is then the displacement of
   !> the row before. Cells outside the contact are ignored.
   subroutine forecast_leaves_erratic_changes_alone()
      integer, parameter :: nx = 8, ny = 6
      type(place_forecast_type) :: forecast
      type(grid_type) :: grid
      real(dp) :: pattern(nx, 2, ny), found(nx, 2, ny), carried(nx, 2, ny), place(nx, 2, ny), pressure(nx, ny)
      integer :: n

      grid = new_grid(nx, ny, 0.5_dp*nx, 0.3_dp*ny, boundary_periodic)
      call random_number(pattern)
      pressure = 1.0_dp
      pressure(:, 4:) = 0.0_dp
      call new_place_forecast(forecast, nx, ny)
      found = 0.0_dp
      do n = 1, 6
         carried = found
         place = carried
         call forecast%follow(grid, 0.1_dp, .true., [0.0_dp, 0.0_dp])
         call forecast%add(place)
         call check_close(maxval(abs(place - carried)), 0.0_dp, 0.0_dp, 'the row before')
         found(:, :, :3) = carried(:, :, :3) + (-1)**n*pattern(:, :, :3)
         found(:, :, 4:) = pattern(:, :, 4:)*n
         call forecast%learn(found, carried, pressure)
      end do
   end subroutine forecast_leaves_erratic_changes_alone

   !> A block that is sheared while it sticks: after some steps one pass is enough (the test allows two).
   !> Without a forecast each of these steps takes three.
   subroutine forecast_saves_passes()
      type(record_type) :: record

      call run_case('&grid nx = 48, ny = 16, lx = 1e-3, ly = 3.3333e-4 /'//nl// &
         '&surface shape = ''sine'', amplitude = 20e-6, wavelength = 1e-3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 1e-3, thickness = 2e-3, poisson = 0.5 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl//'&phase pressure = 5e4 /'//nl// &
         '&phase velocity_x = 0.1, duration = 1e-4, steps = 10 /'//nl//'&solver tolerance = 1e-6 /', &
         'sheared block', record)
      associate (rows => record%rows)
         call check_order(maxval(rows%residual_coupling), '<=', 1.0e-6_dp, 'all rows settle')
         call check_order(maxval(rows(size(rows) - 4:)%passes), '<=', 2, 'passes of the last rows')
      end associate
   end subroutine forecast_saves_passes

   !> Maps for which plain iteration does not converge: one with gains of -2.5 and 1.5 in six directions, and
   !> one that depends nonlinearly on a field.
   subroutine mixing_settles_where_plain_passes_fail()
      integer, parameter :: nx = 8, ny = 5
      type(anderson_type) :: mixing
      real(dp), parameter :: even(2) = 1.0_dp
      real(dp) :: gain(nx, 2, ny), answer(nx, 2, ny), z(nx, 2, ny), f(nx, 2, ny), first
      integer :: i, j, pass

      do j = 1, ny
         do i = 1, nx
            gain(i, :, j) = [-2.5_dp + 0.8_dp*mod(i, 3), 0.5_dp*mod(j, 3) + 0.5_dp*mod(i, 2)]
            answer(i, :, j) = [sin(1.3_dp*i*j), cos(0.7_dp*i + j)]
         end do
      end do
      gain = merge(1.5_dp, gain, abs(gain - 1.0_dp) < 0.1_dp)
      z = 0.0_dp
      call new_anderson(mixing, nx, 2, ny, 6)
      do pass = 1, 40
         f = (gain - 1.0_dp)*(z - answer)
         if (pass == 1) first = norm2(f)
         call mixing%step(even, f, z, plain=.false., damping=0.5_dp)
      end do
      call check_order(norm2(f), '<', 1.0e-9_dp*first, 'a linear map')
      z = 0.7_dp*answer
      gain = min(gain, 0.5_dp)                  ! Gains like those of roads, for which plain iteration alternates.
      call mixing%forget()
      do pass = 1, 60
         f = (gain - 1.0_dp)*(z - answer) + 0.3_dp*sin(z - answer)*cos(cshift(z, 1) - cshift(answer, 1))
         if (pass == 1) first = norm2(f)
         call mixing%step(even, f, z, plain=.false., damping=0.5_dp)
      end do
      call check_order(norm2(f), '<', 1.0e-8_dp*first, 'a nonlinear map')
      call mixing%step(even, 0.0_dp*f, z, plain=.false.)
      f = z
      call mixing%step(even, 0.0_dp*f, z, plain=.false.)
      call check_close(maxval(abs(z - f)), 0.0_dp, 0.0_dp, 'the solution is kept')
   end subroutine mixing_settles_where_plain_passes_fail

   !> The accuracy follows the mismatch, and is increased if the mismatch does not fall.
   subroutine accuracy_follows_the_mismatch()
      type(pass_control_type) :: control
      integer :: i

      call control%start(1.0e-6_dp, 1.0e-7_dp, sharing=.false.)
      call check_close(control%accuracy, 1.0e-6_dp, 1.0e-20_dp, 'where one pass was enough')
      call control%start(1.0e-6_dp, 1.0_dp, sharing=.false.)
      call check_order(control%accuracy, '>', 1.0e-4_dp, 'where nothing is known')
      call control%judge(1.0e-2_dp)
      call check_close(control%accuracy, 1.0e-3_dp, 1.0e-18_dp, 'a tenth of the last mismatch')
      call control%judge(1.0e-3_dp)
      call check_close(control%accuracy, 1.0e-4_dp, 1.0e-18_dp, 'a tenth of the last mismatch')
      call check_that(control%best_yet .and. .not. (control%forget .or. control%go_back), 'the passes continue')
      call control%judge(1.0e-3_dp)
      call check_that(.not. control%best_yet .and. control%damping < 1.0_dp, 'shorter where it is slow', &
         [control%damping])
      call control%judge(1.0e-3_dp)
      call check_close(control%accuracy, 1.0e-5_dp, 1.0e-18_dp, 'finer where the mismatch stays')
      call control%judge(0.1_dp)
      call check_that(control%forget .and. .not. control%go_back, 'diverged')
      do i = 1, 15
         call control%judge(1.0e-3_dp)
         if (control%go_back) exit
      end do
      call check_that(control%go_back .and. i < 15, 'back to the best place', [real(i, dp)])
      call check_order(control%damping, '<', 0.5_dp, 'shorter steps from there')
   end subroutine accuracy_follows_the_mismatch

   !> A step whose passes are slow is solved all at once after six of them, unless the shares of the cells are unknown.
   subroutine slow_passes_are_solved_all_at_once()
      call check_after_six(0.1_dp, sharing=.false., due=.false., name='one pass more')
      call check_after_six(0.4_dp, sharing=.false., due=.true., name='about ten passes more')
      call check_after_six(1.5_dp, sharing=.false., due=.true., name='passes that diverge')
      call check_after_six(0.9_dp, sharing=.true., due=.false., name='unknown shares')
   end subroutine slow_passes_are_solved_all_at_once

   !> Check what follows after six passes with a mismatch that is multiplied by a factor from each to the next.
   subroutine check_after_six(factor, sharing, due, name)
      real(dp), intent(in) :: factor
      logical, intent(in) :: sharing, due
      character(*), intent(in) :: name
      type(pass_control_type) :: control
      integer :: i

      call control%start(1.0e-8_dp, 1.0_dp, sharing)
      do i = 1, 6
         call control%judge(1.0e-2_dp*factor**(i - 1))
         if (i < 6) call check_that(.not. control%joint_due, name//': first the passes')
      end do
      call check_that(control%joint_due .eqv. due, name//': all at once')
      call check_that(.not. control%thorough, name//': a short attempt')
      call control%judge(1.0e-2_dp*factor**6)
      call check_that(.not. control%joint_due, name//': only once')
   end subroutine check_after_six

   !> A steep wave under a block without mass of forty wavelengths, which has been sheared. When the strains
   !> were read one pass behind the contact, it jumped with any number of passes (mean change of the speed
   !> above 1 m/s with 2 passes as with 30).
   subroutine thick_block_on_steep_wave_settles()
      type(record_type) :: record
      real(dp) :: swing
      integer :: n

      call run_case('&grid nx = 192, ny = 1, lx = 1e-3, ly = 1e-3 /'//nl// &
         '&surface shape = ''sine'', amplitude = 3e-5, wavelength = 0.5e-3 /'//nl// &
         '&material shear_modulus = 1e6, thickness = 20e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
         '&phase pressure = 0.15e6 /'//nl// &
         '&phase velocity_x = 1, duration = 1.6e-3, steps = 40 /'//nl// &
         '&phase velocity_x = 1, duration = 0.3125e-3, steps = 60 /', 'thick block', record)
      n = size(record%rows)
      associate (speed => record%rows(n - 30:)%sliding_speed)
         swing = sum(abs(speed(2:) - speed(:size(speed) - 1)))/(size(speed) - 1)
         call check_order(swing, '<', 1.0e-3_dp, 'a thick block slides')
         call check_close(sum(speed)/size(speed), 1.0_dp, 1.0e-3_dp, 'its mean speed')
      end associate
   end subroutine thick_block_on_steep_wave_settles

   !> On a road of rms slope 0.45 with a coefficient of 0.8 plain passes alternate. The passes settle, and the
   !> energy balance closes.
   subroutine steep_road_settles_and_books_close()
      type(record_type) :: record

      call run_case('&grid nx = 32, ny = 32, lx = 1e-3, ly = 1e-3 /'//nl// &
         '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 0.5e-3, '// &
         'wavelength_short = 0.2e-3, rms_slope = 0.45, seed = 3 /'//nl// &
         '&material shear_modulus = 1e6, prony_g = 2e6, prony_tau = 1e-3, thickness = 0.5e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.8 /'//nl// &
         '&phase pressure = 0.4e6 /'//nl// &
         '&phase velocity_x = 0.1, velocity_y = 0.03, duration = 2.5e-3, steps = 8 /'//nl// &
         '&phase pressure = 0.2e6, duration = 0.6e-3, steps = 2 /'//nl// &
         '&solver tolerance = 1e-7, interpolation = ''cubic'' /', 'steep road', record)
      call check_order(maxval(record%rows%residual_coupling), '<=', 1.0e-7_dp, 'the passes settle')
      call check_order(maxval(record%rows%passes), '>', 3, 'the case needs several passes')
      call check_books(record, 'steep road', 1.0e-6_dp)
      associate (lost => record%rows%dissipated_friction)
         call check_that(all(lost(2:) >= lost(:size(lost) - 1)), 'friction loses energy, also in the jump', &
            lost)
      end associate
   end subroutine steep_road_settles_and_books_close

end module test_coupled_passes
