!> Tests of the start of a normal solve from a coarser grid: the same solution, in fewer transforms where it is used.
module test_coarse_start
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use coarse_fields, only : coarse_grid, coarsen, refine_linearly, refine_pressure
   use check, only : begin_suite, check_no_error, check_order, check_that, selected
   use kernels, only : normal_half_space
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_fixture, only : distance, duality_gap, poisson, rough_problem, solution_type
   use normal_state, only : control_approach, normal_problem_type
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use text_tools, only : to_text
   implicit none
   private

   public :: run_coarse_start

contains

   subroutine run_coarse_start()
      call begin_suite('coarse_start')
      if (selected('the_solution_is_the_same')) then
         call the_solution_is_the_same(new_grid(160, 128, 1.0_dp, 0.8_dp, boundary_periodic))
         call the_solution_is_the_same(new_grid(151, 101, 1.0_dp, 0.9_dp, boundary_periodic))
         call the_solution_is_the_same(new_grid(150, 130, 1.0_dp, 0.9_dp, boundary_free))
         call the_solution_is_the_same(new_grid(250, 1, 1.0_dp, 1.0_dp, boundary_periodic))
      end if
      if (selected('short_waves_survive')) call short_waves_survive()
      if (selected('pressure_grows_towards_the_edge')) call pressure_grows_towards_the_edge()
      if (selected('linear_fields_are_exact')) call linear_fields_are_exact()
      if (selected('a_given_past_counts')) call a_given_past_counts()
      if (selected('it_saves_transforms')) call it_saves_transforms()
      if (selected('it_replaces_the_start_of_another_load')) call it_replaces_the_start_of_another_load()
      if (selected('not_where_it_cannot_help')) call not_where_it_cannot_help()
   end subroutine run_coarse_start

   !> A wave that spans 32 cells loses little by means over coarse cells and interpolation between them, and the
   !> pressure remains zero on exactly those coarse cells where it was zero.
   subroutine short_waves_survive()
      type(grid_type) :: fine, coarse
      real(dp), allocatable :: wave(:, :), rough(:, :), refined(:, :)
      real(dp), parameter :: turn = 2.0_dp*acos(-1.0_dp)/32.0_dp     !! of a cell
      integer :: i, j

      fine = new_grid(128, 64, 1.0_dp, 0.5_dp, boundary_periodic)
      coarse = coarse_grid(fine)
      allocate (wave(fine%nx, fine%ny), refined(fine%nx, fine%ny), rough(coarse%nx, coarse%ny))
      do j = 1, fine%ny
         do i = 1, fine%nx
            wave(i, j) = 2.0_dp + cos(turn*i) + sin(turn*j)
         end do
      end do
      call coarsen(fine, coarse, wave, 1, rough)
      call refine_pressure(coarse, fine, rough, 1, refined)
      ! The means over four cells reduce the wave by 2.6 %. Linear interpolation would lose 8 % more.
      call check_that(maxval(abs(refined - wave)) < 0.07_dp, &
         'a wave of 32 cells is lost by '//to_text(maxval(abs(refined - wave))))

      rough(3, :) = 0.0_dp
      call refine_pressure(coarse, fine, rough, 1, refined)
      call check_that(count(refined > 0.0_dp) == (fine%nx - 4)*fine%ny, 'the cells of a coarse cell are free')
      call check_that(all(refined(9:12, :) <= 0.0_dp), 'those of the coarse cell without pressure')
   end subroutine short_waves_survive

   !> The pressure of a punch grows towards the edge of a free map, and refining it keeps this.
   subroutine pressure_grows_towards_the_edge()
      type(grid_type) :: fine, coarse
      real(dp), allocatable :: rough(:, :), refined(:, :), exact(:, :)

      fine = new_grid(96, 64, 1.5_dp, 1.0_dp, boundary_free)
      coarse = coarse_grid(fine)
      allocate (exact(fine%nx, fine%ny), refined(fine%nx, fine%ny), rough(coarse%nx, coarse%ny))
      exact = punch(fine)
      call coarsen(fine, coarse, exact, 1, rough)
      call refine_pressure(coarse, fine, rough, 1, refined)
      call check_that(maxval(abs(refined/exact - 1.0_dp)) < 0.05_dp, &
         'the pressure of a punch is wrong by the part '//to_text(maxval(abs(refined/exact - 1.0_dp))))
   end subroutine pressure_grows_towards_the_edge

   !> Mean over each cell of 1/sqrt(x (lx - x) y (ly - y)).
   pure function punch(grid) result(pressure)
      type(grid_type), intent(in) :: grid
      real(dp) :: pressure(grid%nx, grid%ny)
      integer :: i, j

      do j = 1, grid%ny
         do i = 1, grid%nx
            pressure(i, j) = mean(real(i - 1, dp)/grid%nx, real(i, dp)/grid%nx)*mean(real(j - 1, dp)/grid%ny, real(j, dp)/grid%ny)
         end do
      end do

   contains

      !> Mean of 1/sqrt(s (1 - s)), whose integral is 2 arcsin(sqrt(s)).
      pure real(dp) function mean(from, to)
         real(dp), intent(in) :: from, to

         mean = 2.0_dp*(asin(sqrt(to)) - asin(sqrt(from)))/(to - from)
      end function mean

   end function punch

   !> Solve with a start from a coarser grid, or without.
   subroutine run_from(coarse, grid, problem, height, solution, mixed, past, start, between)
      logical, intent(in) :: coarse                    !! start from a coarser grid
      type(grid_type), intent(in) :: grid
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! m
      type(solution_type), intent(out) :: solution
      logical, intent(in), optional :: mixed           !! in mixed precision
      real(dp), intent(in), optional :: past(:, :)     !! P_h, Pa
      real(dp), intent(in), optional :: start(:, :)    !! the pressure that is given if problem%warm, Pa
      logical, intent(in), optional :: between         !! with a grid between the two
      type(normal_solver_type) :: solver
      type(error_type), allocatable :: error

      allocate (solution%pressure(grid%nx, grid%ny), solution%gap(grid%nx, grid%ny), source=0.0_dp)
      if (present(start)) solution%pressure(:, :) = start
      call new_normal_solver(solver, grid, normal_half_space(poisson), error, mixed)
      call check_no_error(error, 'a solver')
      solver%coarse_start_from = merge(0.0_dp, huge(1.0_dp), coarse)
      solver%replace_start_from = solver%coarse_start_from
      if (present(between)) solver%between_from = merge(0.0_dp, huge(1.0_dp), between)
      call solver%solve(problem, height, solution%pressure, solution%gap, solution%level, solution%outcome, past)
      call solver%destroy()
   end subroutine run_from

   !> From each start, a solve finds the same pressure, under a load and for an approach, in both precisions.
   subroutine the_solution_is_the_same(grid)
      type(grid_type), intent(in) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t, u
      real(dp), allocatable :: height(:, :)
      real(dp) :: d, e1
      integer :: k
      character(:), allocatable :: what

      call rough_problem(grid, 16.0_dp, 0.01_dp, problem, height)
      problem%tolerance = 1e-8_dp
      do k = 1, 4
         if (k == 3) then
            problem%control = control_approach
            problem%target = -0.3_dp*maxval(height)
         end if
         what = to_text(grid%nx)//' x '//to_text(grid%ny)//' cells, variant '//to_text(k)
         call run_from(.false., grid, problem, height, s, modulo(k, 2) == 0)
         call run_from(.true., grid, problem, height, t, modulo(k, 2) == 0)
         call check_that(s%outcome%converged .and. t%outcome%converged, what//': '//t%outcome%reason)
         call check_that(any(abs(s%pressure - t%pressure) > 0.0_dp), what//': the start was another one')
         call distance(grid, problem%modulus, height, s%pressure, t%pressure, d)
         ! If the approach is prescribed, the error of the load adds to that of the gap.
         call check_order(d, '<=', merge(8.0_dp, 16.0_dp, k <= 2)*problem%tolerance, what//': the same pressure')
         call duality_gap(grid, problem%modulus, height, t%pressure, e1)
         if (k <= 2) call check_order(e1, '<=', 1.01_dp*problem%tolerance, what//': error recomputed')

         call run_from(.true., grid, problem, height, u, modulo(k, 2) == 0, between=.true.)
         call check_that(u%outcome%converged, what//', with a grid between: '//u%outcome%reason)
         call check_that(any(abs(u%pressure - t%pressure) > 0.0_dp), what//': the start from between was another one')
         call distance(grid, problem%modulus, height, s%pressure, u%pressure, d)
         call check_order(d, '<=', merge(8.0_dp, 16.0_dp, k <= 2)*problem%tolerance, what//': the same from between')
      end do
   end subroutine the_solution_is_the_same

   !> A field that is linear in the place is interpolated exactly between the centres of the outermost coarse cells, and
   !> falls to 0 beyond the edge of a free grid. On a periodic grid a uniform field is exact everywhere.
   subroutine linear_fields_are_exact()
      type(grid_type) :: fine, coarse
      real(dp), allocatable :: plane(:, :), rough(:, :), refined(:, :)
      integer :: i, j

      fine = new_grid(60, 48, 1.0_dp, 0.8_dp, boundary_free)
      coarse = coarse_grid(fine)
      allocate (plane(fine%nx, fine%ny), refined(fine%nx, fine%ny), rough(coarse%nx, coarse%ny))
      do j = 1, fine%ny
         do i = 1, fine%nx
            plane(i, j) = 3.0_dp + 2.0_dp*(i - 0.5_dp)*fine%dx - (j - 0.5_dp)*fine%dy
         end do
      end do
      call coarsen(fine, coarse, plane, 1, rough)
      call refine_linearly(coarse, fine, rough, 1, refined)
      call check_that(maxval(abs(refined(3:58, 3:46) - plane(3:58, 3:46))) < 1.0e-13_dp, 'a plane')
      call check_that(all(refined(1, :) < plane(1, :)) .and. all(refined(:, fine%ny) < plane(:, fine%ny)), 'edges')

      fine%boundary = boundary_periodic
      coarse%boundary = boundary_periodic
      rough(:, :) = 7.0_dp
      call refine_linearly(coarse, fine, rough, 1, refined)
      call check_that(maxval(abs(refined - 7.0_dp)) < 1.0e-14_dp, 'a uniform field')
   end subroutine linear_fields_are_exact

   !> A given traction of the past is a part of the problem on the coarser grid, too.
   subroutine a_given_past_counts()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t, without
      real(dp), allocatable :: height(:, :), past(:, :)
      real(dp) :: d

      grid = new_grid(128, 128, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 16.0_dp, 0.01_dp, problem, height)
      call run_from(.false., grid, problem, height, without)
      past = 2.0_dp*cshift(without%pressure, 9, dim=1)
      call run_from(.false., grid, problem, height, s, past=past)
      call run_from(.true., grid, problem, height, t, past=past)
      call check_that(s%outcome%converged .and. t%outcome%converged, 'past: '//t%outcome%reason)
      call distance(grid, problem%modulus, height, s%pressure, t%pressure, d)
      call check_order(d, '<=', 8.0_dp*problem%tolerance, 'past: the same pressure')
      call distance(grid, problem%modulus, height, without%pressure, t%pressure, d)
      call check_order(d, '>=', 0.1_dp, 'past: it changes the pressure')
   end subroutine a_given_past_counts

   !> On a road without waves shorter than 16 cells, the start saves a tenth of the transforms or more.
   subroutine it_saves_transforms()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: height(:, :)

      grid = new_grid(512, 512, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 16.0_dp, 0.005_dp, problem, height)
      call run_from(.false., grid, problem, height, s)
      call run_from(.true., grid, problem, height, t)
      call check_that(s%outcome%converged .and. t%outcome%converged, 'saving: '//t%outcome%reason)
      call check_order(int(10*t%outcome%ffts), '<=', int(9*s%outcome%ffts), &
         'saving: '//to_text(int(t%outcome%ffts))//' transforms instead of '//to_text(int(s%outcome%ffts)))
   end subroutine it_saves_transforms

   !> A given pressure of a tenth of the load is replaced, which saves transforms. One of nearly the same load is kept, and
   !> the solution is the same in any case.
   subroutine it_replaces_the_start_of_another_load()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: other, kept, replaced
      real(dp), allocatable :: height(:, :)
      real(dp), parameter :: loads(2) = [0.1_dp, 0.98_dp]
      real(dp) :: d, full_load
      integer :: k

      grid = new_grid(512, 512, 1.0_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 16.0_dp, 0.005_dp, problem, height)
      full_load = problem%target
      do k = 1, 2
         problem%target = loads(k)*full_load
         problem%warm = .false.
         call run_from(.false., grid, problem, height, other)
         problem%target = full_load
         problem%warm = .true.
         call run_from(.false., grid, problem, height, kept, start=other%pressure)
         call run_from(.true., grid, problem, height, replaced, start=other%pressure)
         call check_that(kept%outcome%converged .and. replaced%outcome%converged, 'another load: '//replaced%outcome%reason)
         call distance(grid, problem%modulus, height, kept%pressure, replaced%pressure, d)
         call check_order(d, '<=', 8.0_dp*problem%tolerance, 'another load: the same pressure')
         if (k == 1) then
            call check_order(int(10*replaced%outcome%ffts), '<=', int(9*kept%outcome%ffts), 'another load: ' &
               //to_text(int(replaced%outcome%ffts))//' transforms instead of '//to_text(int(kept%outcome%ffts)))
         else
            call check_that(all(abs(kept%pressure - replaced%pressure) <= 0.0_dp), 'nearly the same load: the start is kept')
         end if
      end do
   end subroutine it_replaces_the_start_of_another_load

   !> The ordinary start is used near full contact, where it is nearly the solution, and for a road whose cells are
   !> independent of each other, which a coarser grid cannot show.
   subroutine not_where_it_cannot_help()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      real(dp), allocatable :: height(:, :)
      real(dp) :: loads(2)
      integer :: i, j, k

      grid = new_grid(160, 160, 1.0_dp, 1.0_dp, boundary_periodic)
      loads = [0.15_dp, 0.01_dp]
      do k = 1, 2
         call rough_problem(grid, 16.0_dp, loads(k), problem, height)
         if (k == 2) then
            do j = 1, grid%ny
               do i = 1, grid%nx
                  height(i, j) = modulo(7919*i + 1049*j*j + 31*i*j, 10007)*1e-7_dp
               end do
            end do
         end if
         call check_same_pressure(grid, problem, height, 'case '//to_text(k))
      end do

      call rough_problem(grid, 16.0_dp, loads(2), problem, height)
      problem%control = control_approach
      problem%target = -0.995_dp*maxval(height)
      call check_same_pressure(grid, problem, height, 'a few cells in overlap')
   end subroutine not_where_it_cannot_help

   !> Check that the pressure has the same bits with and without a start from a coarser grid.
   subroutine check_same_pressure(grid, problem, height, what)
      type(grid_type), intent(in) :: grid
      type(normal_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! m
      character(*), intent(in) :: what
      type(solution_type) :: s, t

      call run_from(.false., grid, problem, height, s)
      call run_from(.true., grid, problem, height, t)
      call check_that(all(abs(s%pressure - t%pressure) <= 0.0_dp), what//': the ordinary start', &
         [maxval(abs(s%pressure - t%pressure))])
   end subroutine check_same_pressure

end module test_coarse_start
