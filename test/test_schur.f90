!> Tests of the preconditioner of the normal solver: against a dense matrix, and by the iterations that it
!> saves.
module test_schur
   use, intrinsic :: iso_c_binding, only : c_loc
   use active_blocks, only : active_blocks_type, new_active_blocks
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use coarse_level, only : coarse_level_type, new_coarse_level
   use asperity_errors, only : error_type
   use normal_fixture, only : rough_problem, run_problem, solution_type
   use normal_state, only : control_approach, normal_problem_type
   use kernels, only : normal_half_space
   use asperity_precision, only : dp, int64, pi, sp
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use normal_sweeps, only : trial_type
   use schur_preconditioner, only : new_schur_preconditioner, schur_preconditioner_type
   implicit none
   private

   public :: run_schur

   !> A preconditioner and its arguments.
   type :: setting_type
      type(grid_type) :: grid
      type(coarse_level_type) :: coarse
      type(active_blocks_type) :: active
      type(schur_preconditioner_type) :: preconditioner
      real(dp), allocatable :: memory(:, :)     !! of the image and the response
   end type setting_type

contains

   subroutine run_schur()
      call begin_suite('schur')
      if (selected('preconditioner_is_the_schur_complement')) then
         call preconditioner_is_the_schur_complement(boundary_periodic, 24, 16, 1.0_dp)
         call preconditioner_is_the_schur_complement(boundary_periodic, 23, 17, 1.5_dp)
         call preconditioner_is_the_schur_complement(boundary_periodic, 23, 17, 1.5_dp, mean_stiffness=4.0_dp)
         call preconditioner_is_the_schur_complement(boundary_free, 19, 21, 1.0_dp)
      end if
      if (selected('residual_is_extended_beyond_a_free_map')) call residual_is_extended_beyond_a_free_map()
      if (selected('residual_is_extended_beyond_the_rim')) then
         call residual_is_extended_beyond_the_rim(boundary_periodic)
         call residual_is_extended_beyond_the_rim(boundary_free)
      end if
      if (selected('contacts_at_the_edge_take_few_iterations')) then
         call contacts_at_the_edge_take_few_iterations(0.05_dp, 4e-3_dp)
         call contacts_at_the_edge_take_few_iterations(0.5_dp, 1e-1_dp)
         call contacts_at_the_edge_take_few_iterations(0.8_dp, 1.0_dp)
      end if
      if (selected('search_reaches_cells_far_from_a_small_contact')) call search_reaches_cells_far_from_a_small_contact()
      if (selected('a_given_approach_makes_only_the_mean_stiff')) call a_given_approach_makes_only_the_mean_stiff()
      if (selected('released_cells_change_the_direction')) then
         call released_cells_change_the_direction(boundary_periodic, 24, 16, 1.0_dp)
         call released_cells_change_the_direction(boundary_free, 19, 21, 1.5_dp)
      end if
      if (selected('long_grids_take_few_iterations_at_a_given_approach')) &
         call long_grids_take_few_iterations_at_a_given_approach()
      if (selected('long_grids_take_few_iterations_at_a_given_load')) then
         call long_grids_take_few_iterations_at_a_given_load(2048, 32)
         call long_grids_take_few_iterations_at_a_given_load(64, 2000)
         call long_grids_take_few_iterations_at_a_given_load(2999, 53)
         call narrow_grids_take_few_iterations(7, 3001)
         call narrow_grids_take_few_iterations(6007, 1)
      end if
      if (selected('an_approach_follows_full_contact')) then
         call an_approach_follows_full_contact(16, 1)
         call an_approach_follows_full_contact(12, 15)
      end if
      if (selected('long_grids_keep_the_load_of_long_waves')) then
         call long_grids_keep_the_load_of_long_waves(fixed_load=.true.)
         call long_grids_keep_the_load_of_long_waves(fixed_load=.false.)
      end if
      if (selected('repeated_releases_leave_no_negative_pressure')) then
         call repeated_releases_leave_no_negative_pressure(120, 16)
         call repeated_releases_leave_no_negative_pressure(1200, 1)
      end if
      if (selected('uneven_blocks_do_not_stiffen_long_waves')) then
         call uneven_blocks_do_not_stiffen_long_waves(23, 17, 1.0_dp)
         call uneven_blocks_do_not_stiffen_long_waves(13, 39, 4.0_dp)
         call uneven_blocks_do_not_stiffen_long_waves(8, 76, 0.7_dp)
      end if
      if (selected('iterations_stay_few_at_every_load')) call iterations_stay_few_at_every_load()
      if (selected('oblong_cells_take_few_iterations')) then
         call oblong_cells_take_few_iterations(96, 90, 8.0_dp, 24)
         call oblong_cells_take_few_iterations(90, 96, 1.0_dp/8.0_dp, 24)
         call oblong_cells_take_few_iterations(90, 96, 14.0_dp, 32)
         call oblong_cells_take_few_iterations(96, 90, 40.0_dp, 32)
         call oblong_cells_take_few_iterations(90, 96, 1.0_dp/90.0_dp, 28)
         call oblong_cells_take_few_iterations(96, 90, 300.0_dp, 36)
         call oblong_cells_take_few_iterations(90, 96, 1e4_dp, 36)
         call oblong_cells_take_few_iterations(96, 90, 1e-4_dp, 36)
         call oblong_cells_take_few_iterations(64, 12, 1e6_dp, 36)
      end if
      if (selected('approach_near_full_contact_takes_few_iterations')) then
         call approach_near_full_contact_takes_few_iterations(48, 54, 3e-2_dp, 20)
         call approach_near_full_contact_takes_few_iterations(48, 54, 1e-4_dp, 28)
         call approach_near_full_contact_takes_few_iterations(80, 31, 1e-6_dp, 35)
      end if
      if (selected('waves_extend_the_residual_by_means')) then
         call waves_extend_the_residual_by_means(boundary_periodic, 20, 12, 200.0_dp)
         call waves_extend_the_residual_by_means(boundary_free, 9, 23, 1e-3_dp)
      end if
   end subroutine run_schur

   !> Make a preconditioner, and if asked for its model B as a dense matrix.
   subroutine new_setting(s, grid, b, mean_stiffness, beyond, rim)
      type(setting_type), intent(out), target :: s
      type(grid_type), intent(in) :: grid
      real(dp), allocatable, intent(out), optional :: b(:, :)
      real(dp), intent(in), optional :: mean_stiffness   !! at a given approach
      integer, intent(in), optional :: beyond            !! blocks beyond the edges; default: none
      integer, intent(in), optional :: rim               !! wide blocks of the rim; default: the whole grid
      type(error_type), allocatable :: error
      real(dp) :: unit(grid%nx*grid%ny), form
      integer :: blocks_of_rim, i, more

      blocks_of_rim = max(grid%nx, grid%ny)
      if (present(rim)) blocks_of_rim = rim
      more = 0
      if (present(beyond)) more = beyond
      s%grid = grid
      call new_coarse_level(s%coarse, s%grid, normal_half_space(0.3_dp), error, beyond=more)
      call check_no_error(error, 'a coarse level')
      call new_active_blocks(s%active, s%grid, s%coarse, [blocks_of_rim, blocks_of_rim], 1)
      allocate (s%memory(grid%nx, grid%ny))
      call new_schur_preconditioner(s%preconditioner, s%grid, s%coarse, 1, c_loc(s%memory), size(s%memory, kind=int64), error)
      call check_no_error(error, 'a preconditioner')
      if (present(mean_stiffness)) call s%preconditioner%blocks%stiffen_mean(mean_stiffness)
      if (.not. present(b)) return
      allocate (b(size(unit), size(unit)))
      do i = 1, size(unit)
         unit(:) = 0.0_dp
         unit(i) = 1.0_dp
         call apply(s, unit, abs(unit) > 0.0_dp, 0, b(:, i), form)
      end do
   end subroutine new_setting

   !> M r is the Schur complement of the model, which is a dense matrix on a small grid.
   subroutine preconditioner_is_the_schur_complement(boundary, nx, ny, aspect, mean_stiffness)
      integer, intent(in) :: boundary, nx, ny
      real(dp), intent(in) :: aspect                 !! dy/dx
      real(dp), intent(in), optional :: mean_stiffness   !! at a given approach
      type(setting_type), target :: s
      real(dp), allocatable :: b(:, :), r(:), z(:), exact(:), found(:)
      logical, allocatable :: inside(:)
      integer, allocatable :: on(:), off(:)
      real(dp) :: form, before
      integer :: i, n, steps

      call new_setting(s, new_grid(nx, ny, 1.0_dp, aspect*ny/nx, boundary), b, mean_stiffness)
      n = nx*ny
      allocate (z(n))
      call check_order(maxval(abs(b - transpose(b))), '<=', 1e-6_dp*maxval(abs(b)), &
         'the model is symmetric')
      inside = [(modulo(7*i*i + 3*i, 11) < 5, i=1, n)]
      r = [(sin(1.7_dp*i) + 0.3_dp, i=1, n)]
      where (.not. inside) r = 0.0_dp
      on = pack([(i, i=1, n)], inside)
      off = pack([(i, i=1, n)], .not. inside)
      exact = matmul(b(on, off), solved(b(off, off), matmul(b(off, on), r(on))))
      exact = matmul(b(on, on), r(on)) - exact
      before = huge(1.0_dp)
      do steps = 0, 3
         call apply(s, r, inside, steps, z, form)
         call check_order(form, '<', before, 'every step lowers the energy')
         call check_close(form, dot_product(r(on), z(on)), 1e-5_dp*form, 'the energy is r.M r')
         before = form
      end do
      call apply(s, r, inside, 40, z, form)
      found = z(on)
      call check_order(norm2(found - exact), '<=', 1e-3_dp*norm2(exact), &
         'many steps give the Schur complement')
      call check_close(form, dot_product(r(on), exact), 1e-4_dp*form, 'and its energy')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine preconditioner_is_the_schur_complement

   !> The solid goes on beyond a free map: M r, also after a release of cells, is the Schur complement of the model on the map
   !> with its margin.
   subroutine residual_is_extended_beyond_a_free_map()
      integer, parameter :: nx = 24, ny = 16, rim = 8
      type(setting_type), target :: s, outer
      type(trial_type) :: trial
      real(dp), allocatable :: b(:, :), of_map(:, :), r(:), z(:), wide_z(:), v(:), wanted(:), exact(:), found(:)
      logical, allocatable :: inside(:), wide(:), released(:), wide_released(:)
      integer, allocatable :: on(:), off(:)
      real(dp) :: form
      integer :: i, n, wide_n

      n = nx*ny
      wide_n = (nx + 2*rim)*(ny + 2*rim)
      call new_setting(outer, new_grid(nx + 2*rim, ny + 2*rim, (nx + 2*rim)/1.0_dp, (ny + 2*rim)/1.0_dp, boundary_free), b)
      call new_setting(s, new_grid(nx, ny, nx/1.0_dp, ny/1.0_dp, boundary_free), of_map, beyond=1)
      inside = [(modulo(7*i*i + 3*i, 11) < 7, i=1, n)]
      r = merge([(sin(1.7_dp*i) + 0.3_dp, i=1, n)], 0.0_dp, inside)
      wide = widened(merge(1.0_dp, 0.0_dp, inside)) > 0.0_dp
      on = pack([(i, i=1, wide_n)], wide)
      off = pack([(i, i=1, wide_n)], .not. wide)
      allocate (z(n))
      call apply(s, r, inside, 60, z, form)
      associate (right => widened(r))
         exact = matmul(b(on, on), right(on)) - matmul(b(on, off), solved(b(off, off), matmul(b(off, on), right(on))))
      end associate
      found = pack(z, inside)
      call check_order(norm2(found - exact), '<=', 1e-3_dp*norm2(exact), 'the Schur complement with cells beyond the map')
      call check_close(form, dot_product(pack(r, inside), exact), 1e-4_dp*form, 'and its energy')

      z = merge(z, 0.0_dp, inside)
      trial = trial_type(alpha=2.0_dp/maxval(abs(z)), offset=0.05_dp*maxval(abs(z)))
      s%preconditioner%fixed_load = .false.
      call release(s, 60, trial, inside, z, released, found)
      wide_z = widened(z)
      wide_released = widened(merge(1.0_dp, 0.0_dp, released)) > 0.0_dp
      on = pack([(i, i=1, wide_n)], wide .and. .not. wide_released)
      off = pack([(i, i=1, wide_n)], .not. wide .or. wide_released)
      wanted = merge(trial%offset - 1.0_dp/trial%alpha, 0.0_dp, wide_released)
      associate (right => widened(r))
         v = solved(b(off, off), wanted(off) - matmul(b(off, on), right(on)))
         exact = matmul(b(on, on), right(on)) + matmul(b(on, off), v)
      end associate
      found = pack(found, inside .and. .not. released)
      call check_order(count(released), '>=', n/20, 'cells are released')
      call check_order(norm2(found - exact), '<=', 2e-3_dp*norm2(exact), 'the direction on the rest of the contact')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
      call outer%preconditioner%destroy()
      call outer%coarse%destroy()

   contains

      !> A field of the map with zeros beyond it.
      pure function widened(field) result(whole)
         real(dp), intent(in) :: field(:)
         real(dp) :: whole(wide_n)
         real(dp) :: cells(1 - rim:nx + rim, 1 - rim:ny + rim)

         cells(:, :) = 0.0_dp
         cells(1:nx, 1:ny) = reshape(field, [nx, ny])
         whole = reshape(cells, [wide_n])
      end function widened

   end subroutine residual_is_extended_beyond_a_free_map

   !> Beyond the rim the residual is extended as well, by one number per block: the energy falls in every step, and
   !> remains r.M r.
   subroutine residual_is_extended_beyond_the_rim(boundary)
      integer, intent(in) :: boundary
      integer, parameter :: nx = 120, ny = 96
      type(setting_type), target :: s
      real(dp) :: r(nx*ny), z(nx*ny), form, before
      logical :: inside(nx*ny)
      integer :: i, steps

      call new_setting(s, new_grid(nx, ny, nx/1.0_dp, ny/1.0_dp, boundary), rim=1)
      inside = [(modulo(i - 1, nx) < 20 .and. i <= 12*nx .and. modulo(7*i*i + 3*i, 11) < 7, i=1, nx*ny)]
      r = merge([(1.3_dp + sin(1.7_dp*i), i=1, nx*ny)], 0.0_dp, inside)
      before = huge(1.0_dp)
      do steps = 0, 6
         call apply(s, r, inside, steps, z, form)
         call check_order(form, '<', before, 'every step lowers the energy')
         call check_close(form, dot_product(pack(r, inside), pack(z, inside)), 1e-5_dp*form, 'the energy is r.M r')
         before = form
      end do
      call check_order(sum(s%preconditioner%blocks%far), '>=', 0.4_dp*nx*ny, 'most cells lie beyond the rim')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine residual_is_extended_beyond_the_rim

   !> A rough contact that reaches the edge of a free map takes about as many iterations as a periodic one.
   subroutine contacts_at_the_edge_take_few_iterations(least, load)
      real(dp), intent(in) :: least                  !! fraction of the cells that touch, at least
      real(dp), intent(in) :: load                   !! mean pressure over the modulus
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)

      grid = new_grid(160, 131, 1.0_dp, 131.0_dp/160.0_dp, boundary_free)
      call rough_problem(grid, 8.0_dp, load, problem, h)
      call run_problem(grid, problem, h, solution)
      call check_that(solution%outcome%converged, solution%outcome%reason)
      call check_order(count(solution%pressure > 0.0_dp)/grid%cells(), '>=', least, 'the contact is large')
      call check_order(solution%outcome%iterations, '<=', 12, 'and takes few iterations')
   end subroutine contacts_at_the_edge_take_few_iterations

   !> The residual of a small contact on a line has no part on the coarse level. Far from it the search direction is exactly
   !> 0 in the first steps, but these cells belong to N and have to be reached by the next ones.
   subroutine search_reaches_cells_far_from_a_small_contact()
      integer, parameter :: n = 17, on(2) = [5, 6]
      type(setting_type), target :: s
      real(dp), allocatable :: b(:, :)
      real(dp) :: r(n), z(n), exact(2), form
      logical :: inside(n)
      integer, allocatable :: off(:)
      integer :: i

      call new_setting(s, new_grid(n, 1, 1.0_dp, 1.0_dp/n, boundary_periodic), b)
      inside = [(any(on == i), i=1, n)]
      r = 0.0_dp
      r(on) = [1.0_dp, -1.0_dp]
      off = pack([(i, i=1, n)], .not. inside)
      exact = matmul(b(on, on), r(on)) - matmul(b(on, off), solved(b(off, off), matmul(b(off, on), r(on))))
      call apply(s, r, inside, 20, z, form)
      call check_order(norm2(z(on) - exact), '<=', 1e-3_dp*norm2(exact), 'the Schur complement of two cells')
      call check_close(form, dot_product(r(on), exact), 1e-4_dp*form, 'and its energy')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine search_reaches_cells_far_from_a_small_contact

   !> At a given approach the model gives the mean the stiffness 2/(part of open cells), and all else stays as it is.
   subroutine a_given_approach_makes_only_the_mean_stiff()
      type(setting_type), target :: s
      type(grid_type) :: grid
      real(dp), allocatable :: b(:, :), stiff(:, :)

      grid = new_grid(24, 16, 1.0_dp, 0.7_dp, boundary_periodic)
      call new_setting(s, grid, b)
      call s%preconditioner%destroy()
      call s%coarse%destroy()
      call new_setting(s, grid, stiff, mean_stiffness=10.0_dp)
      call check_close(maxval(abs(stiff - b - 10.0_dp/size(b, 1))), 0.0_dp, 1e-6_dp*maxval(abs(b)), 'a stiff mean')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine a_given_approach_makes_only_the_mean_stiff

   !> If the cells with a negative trial pressure are released, the direction on the rest of the contact is B v, where v is r
   !> there, and B v is 0 on N and takes the pressure from the released cells.
   subroutine released_cells_change_the_direction(boundary, nx, ny, aspect)
      integer, intent(in) :: boundary, nx, ny
      real(dp), intent(in) :: aspect                 !! dy/dx
      type(setting_type), target :: s
      type(trial_type) :: trial
      real(dp), allocatable :: b(:, :), r(:), z(:), wanted(:), v(:), exact(:), found(:)
      logical, allocatable :: inside(:), released(:)
      integer, allocatable :: on(:), off(:)
      real(dp) :: form
      integer :: i, n

      call new_setting(s, new_grid(nx, ny, 1.0_dp, aspect*ny/nx, boundary), b)
      n = nx*ny
      allocate (z(n))

      inside = [(modulo(7*i*i + 3*i, 11) < 7, i=1, n)]
      r = merge([(sin(1.7_dp*i) + 0.3_dp, i=1, n)], 0.0_dp, inside)
      call apply(s, r, inside, 40, z, form)
      z = merge(z, 0.0_dp, inside)
      trial = trial_type(alpha=2.0_dp/maxval(abs(z)), offset=0.05_dp*maxval(abs(z)))
      s%preconditioner%fixed_load = .false.
      call release(s, 40, trial, inside, z, released, found)
      call check_that(all(released .eqv. (inside .and. 1.0_dp + trial%alpha*(z - trial%offset) < 0.0_dp)), &
         'cells with a negative trial pressure are released')
      call check_order(count(released), '>=', n/20, 'some are')

      on = pack([(i, i=1, n)], inside .and. .not. released)
      off = pack([(i, i=1, n)], .not. inside .or. released)
      wanted = merge(trial%offset - 1.0_dp/trial%alpha, 0.0_dp, released)
      v = solved(b(off, off), wanted(off) - matmul(b(off, on), r(on)))
      exact = matmul(b(on, on), r(on)) + matmul(b(on, off), v)
      call check_order(norm2(found(on) - exact), '<=', 2e-3_dp*norm2(exact), 'the direction on the rest of the contact')
      call check_order(norm2(z(on) - exact), '>=', 0.05_dp*norm2(exact), 'which differs from that before')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine released_cells_change_the_direction

   !> On a long grid a step has the load of a wave that it has with many conjugate gradients, even if few of them leave much
   !> of the image outside the contact. Its mean is kept only if the load is given.
   subroutine long_grids_keep_the_load_of_long_waves(fixed_load)
      logical, intent(in) :: fixed_load
      type(setting_type), target :: s
      type(trial_type) :: trial
      real(dp), allocatable :: r(:), z(:), found(:), restored(:), load(:)
      logical, allocatable :: inside(:), released(:)
      real(dp) :: form
      complex(dp) :: wave(0:2)                       !! of few steps without and with what is restored, and of many
      real(dp) :: mean(0:2)
      integer :: i, k, n
      integer, parameter :: nx = 120, ny = 16

      call new_setting(s, new_grid(nx, ny, 1.0_dp, real(ny, dp)/nx, boundary_periodic))
      n = nx*ny
      allocate (z(n))
      inside = [(modulo(7*i*i + 3*i, 11) < 7, i=1, n)]
      ! The second half of the grid is pulled, so that more of its cells are released.
      r = merge([(sin(1.7_dp*i) + merge(0.2_dp, -0.2_dp, modulo(i, nx) < nx/2), i=1, n)], 0.0_dp, inside)
      s%preconditioner%fixed_load = fixed_load
      do k = 0, 2
         call apply(s, r, inside, 40, z, form)
         z = merge(z, 0.0_dp, inside)
         trial = trial_type(alpha=2.0_dp/maxval(abs(z)), offset=0.0_dp)
         call release(s, merge(40, 1, k == 2), trial, inside, z, released, found, restored)
         load = row_loads(s%grid, step_of(trial, inside, released, found + merge(restored, 0.0_dp, k == 1)))
         mean(k) = sum(load)
         wave(k) = sum(load*exp([(cmplx(0.0_dp, 2*pi*i/nx, dp), i=1, nx)]))
      end do
      call check_order(count(released), '>=', n/20, 'cells are released')
      call check_order(abs(wave(1) - wave(2)), '<=', abs(wave(0) - wave(2))/3.0_dp, 'the load of the longest wave is kept')
      if (fixed_load) then
         call check_order(abs(mean(1) - mean(2)), '<=', abs(mean(0) - mean(2))/3.0_dp, 'and the mean under a given load')
      else
         call check_close(mean(1), mean(0), 0.02_dp*abs(mean(0)), 'but not at a given approach')
      end if
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine long_grids_keep_the_load_of_long_waves

   !> The step along a direction from a pressure of 1, which the released cells lose.
   pure function step_of(trial, inside, released, direction) result(step)
      type(trial_type), intent(in) :: trial
      logical, intent(in) :: inside(:), released(:)
      real(dp), intent(in) :: direction(:)
      real(dp) :: step(size(direction))

      step = merge(trial%alpha*(direction - trial%offset), 0.0_dp, inside)
      where (released) step = -1.0_dp
   end function step_of

   !> The sums of a field over the cells with the same x.
   pure function row_loads(grid, field) result(loads)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:)
      real(dp) :: loads(grid%nx)

      loads = sum(reshape(field, [grid%nx, grid%ny]), 2)
   end function row_loads

   !> Cells whose trial pressure is negative after a release may be released in their turn: little negative pressure is left,
   !> and the load of the step remains what it is.
   subroutine repeated_releases_leave_no_negative_pressure(nx, ny)
      integer, intent(in) :: nx, ny
      type(setting_type), target :: s
      type(trial_type) :: trial
      real(dp), allocatable :: r(:), z(:), found(:), restored(:), pressure(:)
      logical, allocatable :: inside(:), released(:), before(:)
      real(dp) :: form, negative(3), load(3)
      integer :: i, k, n

      call new_setting(s, new_grid(nx, ny, 1.0_dp, real(ny, dp)/nx, boundary_periodic))
      n = nx*ny
      allocate (z(n))
      inside = [(modulo(7*i*i + 3*i, 11) < 7, i=1, n)]
      r = merge([(sin(1.7_dp*i) + merge(0.2_dp, -0.2_dp, modulo(i, nx) < nx/2), i=1, n)], 0.0_dp, inside)
      call apply(s, r, inside, 2, z, form)
      z = merge(z, 0.0_dp, inside)
      trial = trial_type(alpha=2.0_dp/maxval(abs(z)), offset=sum(z)/count(inside))
      before = .not. inside
      do k = 1, 3
         call release(s, 4, trial, inside, z, released, found, restored)
         call check_that(all(released .or. .not. before .or. .not. inside), 'cells stay released')
         before = released
         z = merge(found + restored, 0.0_dp, inside .and. .not. released)
         pressure = merge(1.0_dp + trial%alpha*(z - trial%offset), 0.0_dp, inside .and. .not. released)
         negative(k) = -sum(min(pressure, 0.0_dp))
         load(k) = sum(pressure)
      end do
      call check_order(negative(1), '>', 0.0_dp, 'a release leaves negative pressures')
      call check_order(negative(3), '<=', 0.05_dp*negative(1), 'two more releases leave hardly any')
      call check_close(load(3), load(1), 0.02_dp*load(1), 'the load remains what it is')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine repeated_releases_leave_no_negative_pressure

   !> The image of a uniform residual has the same small sum in all blocks, also if they differ in their numbers of cells.
   subroutine uneven_blocks_do_not_stiffen_long_waves(nx, ny, aspect)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: aspect                 !! dy/dx
      type(setting_type), target :: s
      real(dp), allocatable :: b(:, :), sums(:, :)
      integer :: j

      call new_setting(s, new_grid(nx, ny, 1.0_dp, aspect*ny/nx, boundary_periodic), b)
      call check_order(maxval(abs(s%coarse%evenness(1) - 1.0_dp)), '>', 0.0_dp, 'the blocks are uneven')
      allocate (sums(s%coarse%nx, s%coarse%ny), source=0.0_dp)
      associate (image => reshape(sum(b, 2), [nx, ny]))
         do j = 1, s%coarse%ny
            call s%coarse%sum_blocks(sum(image(:, s%coarse%first_y(j):s%coarse%first_y(j + 1) - 1), 2), sums(:, j))
         end do
      end associate
      call check_order(maxval(sums) - minval(sums), '<=', 1e-4_dp*maxval(b), 'each block has the same part of the image')
      call check_order(maxval(abs(sums))/s%coarse%cells, '<=', 0.1_dp*maxval(b), 'which is small')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine uneven_blocks_do_not_stiffen_long_waves

   !> Release cells from a contact in which all pressures are 1, without or with the load of long waves that the step keeps.
   subroutine release(s, steps, trial, inside, z, released, direction, restored)
      type(setting_type), intent(inout) :: s
      integer, intent(in) :: steps
      type(trial_type), intent(in) :: trial
      logical, intent(in) :: inside(:)
      real(dp), intent(in) :: z(:)                   !! direction before
      logical, allocatable, intent(out) :: released(:)
      real(dp), allocatable, intent(out) :: direction(:)   !! after the release, on the rest of the contact
      real(dp), allocatable, intent(out), optional :: restored(:)   !! what keeps the load of long waves
      real(dp), dimension(s%grid%nx, s%grid%ny) :: pressure, change, kept
      real(sp) :: before(s%grid%nx, s%grid%ny), part(s%grid%nx)
      integer :: j, jb

      pressure = reshape(merge(1.0_dp, 0.0_dp, inside), shape(pressure))
      before = real(reshape(z, shape(before)), sp)
      call s%preconditioner%release(s%coarse, s%active, steps, trial, pressure, before)
      do jb = s%coarse%strips(1), s%coarse%strips(2)
         do j = s%coarse%first_y(jb), s%coarse%first_y(jb + 1) - 1
            call s%preconditioner%give_coarse_part(s%coarse, jb, part)
            associate (model => s%preconditioner%blocks%pending(s%coarse%block_x(1:s%grid%nx), jb))
               change(:, j) = s%preconditioner%image(1:s%grid%nx, j) + model
               kept(:, j) = part - model
            end associate
            if (s%preconditioner%length > 0.0_sp) &
               change(:, j) = change(:, j) + s%preconditioner%length*s%preconditioner%response(1:s%grid%nx, j)
         end do
      end do
      direction = z + reshape(change, [size(z)])
      if (present(restored)) restored = reshape(kept, [size(z)])
      released = inside .and. .not. reshape(abs(s%preconditioner%residual(1:s%grid%nx, 1:s%grid%ny)) > 0.0_sp, [size(z)])
   end subroutine release

   !> At an approach that leaves a small part of the gap at first touch, few cells are open, and they decide about the
   !> mean pressure.
   subroutine approach_near_full_contact_takes_few_iterations(nx, ny, open, most)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: open                   !! part of the mean gap at first touch that is left
      integer, intent(in) :: most
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)
      real(dp) :: mean

      grid = new_grid(nx, ny, 1.0_dp, real(ny, dp)/nx, boundary_periodic)
      call rough_problem(grid, 6.0_dp, 0.0_dp, problem, h)
      mean = sum(h)/size(h)
      problem%control = control_approach
      problem%target = -mean - open*(maxval(h) - mean)
      call run_problem(grid, problem, h, solution)
      call check_that(solution%outcome%converged, solution%outcome%reason)
      call check_close(sum(solution%gap)/(size(h)*open*(maxval(h) - mean)), 1.0_dp, 1e-6_dp, 'the gap that is left')
      call check_order(solution%outcome%iterations, '<=', most, 'few iterations near full contact')
   end subroutine approach_near_full_contact_takes_few_iterations

   !> For very oblong cells M = E^T B E: E^T B E of the whole grid is B, and the same matrix with the rows and columns of
   !> N added to those of S in the same block is M for any S.
   subroutine waves_extend_the_residual_by_means(boundary, nx, ny, aspect)
      integer, intent(in) :: boundary, nx, ny
      real(dp), intent(in) :: aspect                 !! dy/dx
      type(setting_type), target :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: b(:, :), e(:, :), unit(:), r(:), z(:), exact(:)
      integer, allocatable :: block(:)
      logical, allocatable :: inside(:)
      real(dp) :: form
      integer :: i, j, n

      s%grid = new_grid(nx, ny, 1.0_dp, aspect*ny/nx, boundary)
      call new_coarse_level(s%coarse, s%grid, normal_half_space(0.3_dp), error)
      call check_no_error(error, 'a coarse level')
      call new_active_blocks(s%active, s%grid, s%coarse, [0, 0], 1)
      allocate (s%memory(nx, ny))
      call new_schur_preconditioner(s%preconditioner, s%grid, s%coarse, 1, c_loc(s%memory), size(s%memory, kind=int64), error)
      call check_no_error(error, 'a preconditioner')
      n = nx*ny
      allocate (b(n, n), e(n, n), unit(n), r(n), z(n))
      do i = 1, n
         ! The residual is not 0 in any cell, so that all cells are in S.
         unit(:) = 1e-6_dp
         unit(i) = 1.0_dp
         call apply(s, unit, [(.true., j=1, n)], 0, b(:, i), form)
      end do
      call check_order(maxval(abs(b - transpose(b))), '<=', 1e-4_dp*maxval(abs(b)), 'B is symmetric')

      inside = [(modulo(7*i*i + 3*i, 11) < 5, i=1, n)]
      block = [((s%coarse%block_x(i) + s%coarse%nx*(count(s%coarse%first_y <= j) - 1), i=1, nx), j=1, ny)]
      do i = 1, n
         e(:, i) = 0.0_dp
         if (.not. inside(i)) cycle
         where (.not. inside .and. block == block(i)) e(:, i) = 1.0_dp/count(inside .and. block == block(i))
         e(i, i) = 1.0_dp
      end do
      r = [(sin(1.7_dp*i) + 0.3_dp, i=1, n)]
      where (.not. inside) r = 0.0_dp
      exact = matmul(transpose(e), matmul(b, matmul(e, r)))
      call apply(s, r, inside, 0, z, form)
      where (.not. inside) z = 0.0_dp
      call check_order(norm2(z - exact), '<=', 1e-4_dp*norm2(exact), 'M r is E^T B E r')
      call check_close(form, dot_product(r, z), 1e-5_dp*form, 'and its form')
      call s%preconditioner%destroy()
      call s%coarse%destroy()
   end subroutine waves_extend_the_residual_by_means

   !> z = M r for a residual on a contact set; elsewhere z is B v.
   subroutine apply(s, r, inside, steps, z, form)
      type(setting_type), intent(inout) :: s
      real(dp), intent(in) :: r(:)
      logical, intent(in) :: inside(:)
      integer, intent(in) :: steps
      real(dp), intent(out) :: z(:)
      real(dp), intent(out) :: form
      real(dp), allocatable :: pressure(:, :), gap(:, :), out(:, :)
      real(sp), allocatable :: direction(:, :)
      real(dp) :: least
      integer :: i, j, jb

      allocate (pressure(s%grid%nx, s%grid%ny), gap(s%grid%nx, s%grid%ny))
      allocate (direction(s%grid%nx, s%grid%ny), out(s%grid%nx, s%grid%ny))
      pressure(:, :) = reshape(merge(1.0_dp, 0.0_dp, inside), shape(gap))
      gap(:, :) = reshape(merge(-r, 1.0_dp, inside), shape(gap))
      call s%active%clear(s%preconditioner%residual, direction, s%preconditioner%search, s%preconditioner%before)
      do j = 1, s%grid%ny
         call s%active%survey_row(.true., j, pressure(:, j), gap(:, j), least)
      end do
      call s%active%list_runs(0.0_dp, s%preconditioner%residual, direction, s%preconditioner%before)
      call s%active%list_wide_runs(s%preconditioner%search)
      call s%preconditioner%set_residual(s%coarse, s%active, 1.0_dp, 0.0_dp, pressure, gap)
      call s%preconditioner%extend(s%coarse, s%active, steps, form)
      do jb = s%coarse%strips(1), s%coarse%strips(2)
         do j = s%coarse%first_y(jb), s%coarse%first_y(jb + 1) - 1
            do i = 1, s%grid%nx
               out(i, j) = s%preconditioner%image(i, j) + s%preconditioner%blocks%pending(s%coarse%block_x(i), jb)
               if (s%preconditioner%length > 0.0_sp) &
                  out(i, j) = out(i, j) + s%preconditioner%length*s%preconditioner%response(i, j)
            end do
         end do
      end do
      z = reshape(out, [size(z)])
   end subroutine apply

   !> The solution x of a x = b, by Cholesky's method.
   pure function solved(a, b) result(x)
      real(dp), intent(in) :: a(:, :), b(:)
      real(dp) :: x(size(b))
      real(dp), allocatable :: l(:, :)
      integer :: i, j, n

      n = size(b)
      allocate (l(n, n), source=0.0_dp)
      do j = 1, n
         l(j, j) = sqrt(a(j, j) - sum(l(j, :j - 1)**2))
         do i = j + 1, n
            l(i, j) = (a(i, j) - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
      end do
      do i = 1, n
         x(i) = (b(i) - dot_product(l(i, :i - 1), x(:i - 1)))/l(i, i)
      end do
      do i = n, 1, -1
         x(i) = (x(i) - dot_product(l(i + 1:, i), x(i + 1:)))/l(i, i)
      end do
   end function solved

   !> With an extended residual there are few iterations at every load.
   subroutine iterations_stay_few_at_every_load()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :), pressure(:, :)
      real(dp), parameter :: loads(3) = [0.0005_dp, 0.005_dp, 0.05_dp]
      integer :: k

      grid = new_grid(384, 350, 1.0_dp, 350.0_dp/384.0_dp, boundary_periodic)
      do k = 1, size(loads)
         call rough_problem(grid, 8.0_dp, loads(k), problem, h)
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 10, 'few iterations at every load')

         pressure = solution%pressure
         problem%control = control_approach
         problem%target = solution%level
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 12, 'few iterations at a given approach')
         call check_order(sum(abs(solution%pressure - pressure)), '<=', 1e-4_dp*sum(pressure), 'the same contact')
      end do
   end subroutine iterations_stay_few_at_every_load

   !> A cone on a grid 24 and 96 times as long as wide touches along most of the width, so that the open cells are one large
   !> area and the mean is soft.
   subroutine long_grids_take_few_iterations_at_a_given_approach()
      integer, parameter :: lengths(2) = [480, 1920]
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)
      integer :: i, j, k

      do k = 1, size(lengths)
         grid = new_grid(lengths(k), 20, 1.0_dp, 20.0_dp/lengths(k), boundary_periodic)
         h = reshape([((-hypot((i - 0.5_dp)/lengths(k) - 0.5_dp, (j - 10.5_dp)/lengths(k)), i=1, lengths(k)), j=1, 20)], &
            [lengths(k), 20])
         problem = normal_problem_type()
         problem%control = control_approach
         problem%target = 0.22_dp
         problem%tolerance = 1e-6_dp
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 14, 'few iterations on a long grid')
      end do
   end subroutine long_grids_take_few_iterations_at_a_given_approach

   !> The waves along a long rough grid are long, and a step must not change their load in cells that it releases.
   subroutine long_grids_take_few_iterations_at_a_given_load(nx, ny)
      integer, intent(in) :: nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)
      real(dp), parameter :: loads(3) = [0.0005_dp, 0.005_dp, 0.05_dp]
      integer :: k

      grid = new_grid(nx, ny, real(nx, dp), real(ny, dp), boundary_periodic)
      do k = 1, size(loads)
         call rough_problem(grid, 4.0_dp, loads(k), problem, h)
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 16, 'few iterations on a long grid under a load')
      end do
   end subroutine long_grids_take_few_iterations_at_a_given_load

   !> So do grids of a few cells across, and lines, of a rough road with rms slope 0.1, at a given load and a given approach.
   subroutine narrow_grids_take_few_iterations(nx, ny)
      integer, intent(in) :: nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)
      real(dp), parameter :: loads(2) = [0.0005_dp, 0.005_dp]
      integer :: i, j, k, m, n

      grid = new_grid(nx, ny, real(nx, dp), real(ny, dp), boundary_periodic)
      n = max(nx, ny)
      m = min(nx, ny)
      allocate (h(n, m), source=0.0_dp)
      do k = 20, n/12
         do j = 1, m
            h(:, j) = h(:, j) + real(k, dp)**(-1.8_dp)*cos(2.0_dp*pi*([(i, i=1, n)]*k/real(n, dp) &
               + modulo(k, 3)*j/real(m, dp)) + 1.7_dp*k*k)
         end do
      end do
      h = h*0.1_dp/sqrt(sum((h - cshift(h, 1))**2)/size(h))
      if (ny > nx) h = transpose(h)

      do k = 1, size(loads)
         problem = normal_problem_type(target=loads(k))
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 14, 'few iterations on a narrow grid under a load')
         problem%control = control_approach
         problem%target = solution%level
         call run_problem(grid, problem, h, solution)
         call check_that(solution%outcome%converged, solution%outcome%reason)
         call check_order(solution%outcome%iterations, '<=', 20, 'few iterations on a narrow grid at a given approach')
         call check_close(sum(solution%pressure)/size(h), loads(k), 1e-4_dp*loads(k), 'the same load')
      end do
   end subroutine narrow_grids_take_few_iterations

   !> The mean of a pressure far above that of full contact strains nothing on a periodic grid. The step that takes it away
   !> ends where the first cell opens.
   subroutine an_approach_follows_full_contact(nx, ny)
      integer, intent(in) :: nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: solution, full
      real(dp), allocatable :: h(:, :)
      integer :: i

      grid = new_grid(nx, ny, 1.0_dp, real(ny, dp)/nx, boundary_periodic)
      allocate (h(nx, ny))
      h(:, :) = spread([(cos(2.0_dp*pi*i/nx), i=1, nx)], 2, ny)
      problem = normal_problem_type()
      problem%tolerance = 1e-8_dp
      problem%target = 1e4_dp
      call run_problem(grid, problem, h, full)
      problem%control = control_approach
      problem%target = -0.5_dp
      call run_problem(grid, problem, h, solution, start=full%pressure)
      call check_that(solution%outcome%converged, 'after full contact: '//solution%outcome%reason)
      call run_problem(grid, problem, h, full)
      call check_order(maxval(abs(solution%pressure - full%pressure)), '<=', 1e-6_dp*maxval(full%pressure), &
         'after full contact as without a start')
   end subroutine an_approach_follows_full_contact

   !> On oblong cells the stencil is adapted, and the residual is extended where that is an advantage.
   subroutine oblong_cells_take_few_iterations(nx, ny, aspect, most)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: aspect                 !! dy/dx
      integer, intent(in) :: most
      type(grid_type) :: grid, square
      type(normal_problem_type) :: problem
      type(solution_type) :: solution
      real(dp), allocatable :: h(:, :)

      square = new_grid(nx, ny, 1.0_dp, real(ny, dp)/nx, boundary_periodic)
      grid = new_grid(nx, ny, 1.0_dp, aspect*ny/nx, boundary_periodic)
      call rough_problem(square, 8.0_dp, 0.05_dp, problem, h)
      call run_problem(grid, problem, h, solution)
      call check_that(solution%outcome%converged, solution%outcome%reason)
      call check_order(solution%outcome%iterations, '<=', most, 'few iterations on oblong cells')
      if (grid%very_oblong()) return
      problem%control = control_approach
      problem%target = solution%level
      call run_problem(grid, problem, h, solution)
      call check_that(solution%outcome%converged, solution%outcome%reason)
      call check_order(solution%outcome%iterations, '<=', most, 'few iterations on oblong cells at a given approach')
   end subroutine oblong_cells_take_few_iterations

end module test_schur
