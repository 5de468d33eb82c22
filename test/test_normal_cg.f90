!> Tests of normal contact against known solutions. E* = 1 Pa throughout.
module test_normal_cg
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use normal_fixture, only : duality_gap, poisson, rms, rough_height, rough_problem, &
      run_problem, solution_type, unit_modulus
   use normal_state, only : control_approach, control_pressure, normal_problem_type
   use kernels, only : normal_half_space
   use asperity_precision, only : dp, pi
   use projection, only : project_simplex
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   implicit none
   private

   public :: run_normal_cg

contains

   subroutine run_normal_cg()
      call begin_suite('normal_cg')
      if (selected('projection_is_the_nearest_field')) call projection_is_the_nearest_field()
      if (selected('hertz_sphere_on_a_free_grid')) call hertz_sphere_on_a_free_grid()
      if (selected('hertz_sphere_in_a_periodic_square')) call hertz_sphere_in_a_periodic_square()
      if (selected('hertz_cylinder_in_plane_strain')) call hertz_cylinder_in_plane_strain()
      if (selected('westergaard_wave')) call westergaard_wave(512, 1, 1.0_dp, 1.0_dp, 1, 0)
      if (selected('westergaard_wave')) call westergaard_wave(243, 1, 2.0_dp, 1.0_dp, 2, 0)
      if (selected('westergaard_wave')) call westergaard_wave(96, 6, 1.0_dp, 0.5_dp, 1, 0)
      if (selected('westergaard_wave')) call westergaard_wave(5, 129, 1.0_dp, 2.0_dp, 0, 1)
      if (selected('westergaard_wave')) call westergaard_wave(1, 128, 1.0_dp, 2.0_dp, 0, 1)
      if (selected('westergaard_wave')) call westergaard_wave(120, 90, 1.0_dp, 1.2_dp, 2, 1)
      if (selected('westergaard_wave')) call westergaard_wave(101, 127, 1.0_dp, 1.2_dp, 1, -1)
      if (selected('full_contact_is_exact')) call full_contact_is_exact()
      if (selected('load_to_approach_and_back')) &
         call load_to_approach_and_back(boundary_periodic, 96, 70)
      if (selected('load_to_approach_and_back')) &
         call load_to_approach_and_back(boundary_free, 45, 64)
      if (selected('error_is_that_of_the_definition')) &
         call error_is_that_of_the_definition(boundary_periodic, 90, 64)
      if (selected('error_is_that_of_the_definition')) &
         call error_is_that_of_the_definition(boundary_free, 33, 48)
      if (selected('area_at_small_loads_in_its_bracket')) call area_at_small_loads_in_its_bracket()
   end subroutine run_normal_cg

   !> The projection agrees with a search over all numbers of positive cells.
   subroutine projection_is_the_nearest_field()
      real(dp) :: x(13, 9), y(13, 9), best(13, 9), level, total, least
      integer :: k, trial, n
      real(dp), allocatable :: sorted(:)

      n = size(x)
      do trial = 1, 20
         call random_number(x)
         x = x - 0.1_dp*trial
         total = 10.0_dp**(trial - 15)
         sorted = descending(reshape(x, [n]))
         least = huge(1.0_dp)
         best = 0.0_dp
         do k = 1, n
            level = (sum(sorted(1:k)) - total)/k
            y = max(x - level, 0.0_dp)
            if (abs(sum(y) - total) <= 1e-12_dp*max(total, 1.0_dp) .and. sum((y - x)**2) < least) then
               least = sum((y - x)**2)
               best = y
            end if
         end do
         y = x
         call project_simplex(y, total)
         call check_close(maxval(abs(y - best)), 0.0_dp, 1e-14_dp*max(1.0_dp, total), 'the projection')
         call check_close(sum(y)/total, 1.0_dp, 1e-13_dp, 'its sum')
         call check_order(minval(y), '>=', 0.0_dp, 'nothing negative')
         best = y
         call project_simplex(y, sum(y))
         call check_that(all(abs(y - best) <= 0.0_dp), 'a feasible field is left alone', &
            [maxval(abs(y - best))])
      end do
      x = 0.3_dp
      call project_simplex(x, 1e-30_dp)
      call check_close(sum(x), 1e-30_dp, 1e-43_dp, 'a small load on equal cells')
      x = 0.3_dp
      x(3, 2) = 0.4_dp
      call project_simplex(x, 1e-30_dp)
      call check_close(sum(x), 1e-30_dp, 1e-43_dp, 'a small load on one summit')
      call check_that(count(x > 0.0_dp) == 1, 'one cell carries it', [real(count(x > 0.0_dp), dp)])
      call project_simplex(x, 0.0_dp)
      call check_that(all(abs(x) <= 0.0_dp), 'no load', [maxval(abs(x))])
   end subroutine projection_is_the_nearest_field

   pure function descending(x) result(y)
      real(dp), intent(in) :: x(:)
      real(dp) :: y(size(x)), least
      integer :: i, k

      y = x
      do i = 1, size(x) - 1
         k = i - 1 + maxloc(y(i:), 1)
         least = y(i)
         y(i) = y(k)
         y(k) = least
      end do
   end function descending

   !> A paraboloid on a free grid, by approach and by load. The error decreases with the mesh.
   subroutine hertz_sphere_on_a_free_grid()
      real(dp), parameter :: radius = 10.0_dp, a = 1.0_dp
      real(dp), parameter :: force = 4.0_dp*a**3/(3.0_dp*radius), delta = a**2/radius
      real(dp), parameter :: p0 = 2.0_dp*a/(pi*radius)
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      real(dp) :: error(4), before(4), ratio
      integer :: n

      before = huge(1.0_dp)
      problem%modulus = unit_modulus
      problem%tolerance = 1e-9_dp
      n = 24
      do while (n <= 96)
         ! Cells of 1 : 0.75; the contact is half as wide as the patch.
         grid = new_grid(n, n, 4.0_dp*a, 3.0_dp*a, boundary_free)
         h = paraboloid(grid, radius, 2.0_dp*a + 0.31_dp*grid%dx, 1.5_dp*a)
         ratio = grid%dx/a
         problem%control = control_approach
         problem%target = delta
         call run_problem(grid, problem, h, s)
         call check_that(s%outcome%converged, 'Hertz by approach: '//s%outcome%reason)
         error(1) = abs(sum(s%pressure)*grid%dx*grid%dy/force - 1.0_dp)
         error(2) = abs(maxval(s%pressure)/p0 - 1.0_dp)
         problem%control = control_pressure
         problem%target = force/(grid%lx*grid%ly)
         call run_problem(grid, problem, h, s)
         call check_that(s%outcome%converged, 'Hertz by load: '//s%outcome%reason)
         error(3) = abs(s%level/delta - 1.0_dp)
         error(4) = abs(count(s%pressure > 0.0_dp)*grid%dx*grid%dy/(pi*a**2) - 1.0_dp)
         ! The error comes from a strip of about half a cell along the edge of the contact. Its share of the
         ! area is dx/a, and that of the force, where P ~ sqrt, is (dx/a)^(3/2).
         call check_that(all(error(1:3) <= 0.35_dp*ratio**1.5_dp), 'Hertz: error of order dx^(3/2)', &
            error)
         call check_order(error(4), '<=', 1.2_dp*ratio, 'Hertz: area')
         call check_that(all(error([1, 3]) < 0.6_dp*before([1, 3])), 'Hertz: errors fall with the mesh', &
            [error, before])
         before = error
         n = 2*n
      end do
      call check_close(s%level, delta, 2e-3_dp*delta, 'Hertz: approach at dx = a/24')
   end subroutine hertz_sphere_on_a_free_grid

   !> A paraboloid in a large periodic square. The images and the background move the summit by -3.900265
   !> F/(pi E* L) (the potential of a square lattice in a uniform background).
   subroutine hertz_sphere_in_a_periodic_square()
      real(dp), parameter :: radius = 10.0_dp, a = 1.0_dp, length = 12.0_dp*a
      real(dp), parameter :: force = 4.0_dp*a**3/(3.0_dp*radius), delta = a**2/radius
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      real(dp) :: shift

      grid = new_grid(160, 120, length, length, boundary_periodic)
      h = paraboloid(grid, radius, 0.0_dp, 0.5_dp*length)
      problem%modulus = unit_modulus
      problem%target = force/length**2
      problem%tolerance = 1e-9_dp
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, s%outcome%reason)
      shift = 3.900265_dp*force/(pi*length)
      ! The error of the discretisation is as in free mode: (dx/a)^(3/2)/3 = 1e-2 of delta.
      call check_close(s%level, delta - shift, 1e-2_dp*delta, 'Hertz, periodic: approach')
      call check_close(maxval(s%pressure), 2.0_dp*a/(pi*radius), 2e-2_dp*2.0_dp*a/(pi*radius), &
         'Hertz, periodic: greatest pressure')
      call check_close(count(s%pressure > 0.0_dp)*grid%dx*grid%dy, pi*a**2, &
         pi*a**2*1.2_dp*grid%dy/a, 'Hertz, periodic: area')
      ! From this approach back to the load.
      problem%control = control_approach
      problem%target = s%level
      call run_problem(grid, problem, h, s)
      call check_close(sum(s%pressure)*grid%dx*grid%dy/force, 1.0_dp, 1e-6_dp, &
         'Hertz, periodic: load from approach')
   end subroutine hertz_sphere_in_a_periodic_square

   !> A cylinder in plane strain with L = 64 a. The images change the curvature by pi^2/6 (a/L)^2 = 4e-4.
   subroutine hertz_cylinder_in_plane_strain()
      real(dp), parameter :: radius = 10.0_dp, a = 1.0_dp, length = 64.0_dp*a
      real(dp), parameter :: load = pi*a**2/(4.0_dp*radius)
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      integer :: i

      grid = new_grid(2048, 1, length, 1.0_dp, boundary_periodic)
      allocate (h(grid%nx, 1))
      do i = 1, grid%nx
         h(i, 1) = -((i - 1)*grid%dx - 0.5_dp*length)**2/(2.0_dp*radius)
      end do
      problem%modulus = unit_modulus
      problem%target = load/length
      problem%tolerance = 1e-10_dp
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, s%outcome%reason)
      call check_close(maxval(s%pressure), 2.0_dp*load/(pi*a), 5e-3_dp*2.0_dp*load/(pi*a), &
         'line: greatest pressure')
      call check_close(count(s%pressure > 0.0_dp)*grid%dx, 2.0_dp*a, 2.0_dp*grid%dx, 'line: width')
      i = 1025 + nint(0.5_dp*a/grid%dx)
      call check_close(s%pressure(i, 1), 2.0_dp*load/(pi*a)*sqrt(0.75_dp), &
         5e-3_dp*2.0_dp*load/(pi*a), 'line: pressure at a/2')
   end subroutine hertz_cylinder_in_plane_strain

   !> A wave with kx and ky periods along the sides has Westergaard's pressure and mean gap.
   subroutine westergaard_wave(nx, ny, lx, ly, kx, ky)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly
      integer, intent(in) :: kx, ky
      real(dp), parameter :: d = 0.01_dp, half_width = 0.3_dp
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :), p(:, :)
      real(dp) :: phase, length, mean, edge, gap, error, cells
      character(60) :: name
      integer :: i, j

      grid = new_grid(nx, ny, lx, ly, boundary_periodic)
      length = 1.0_dp/hypot(kx/lx, ky/ly)
      ! Cells per wavelength, across the crests.
      cells = 1.0_dp/(abs(kx)/real(nx, dp) + abs(ky)/real(ny, dp))
      write (name, '("wave ", i0, " x ", i0, " (", i0, ", ", i0, "): ")') nx, ny, kx, ky
      edge = sin(pi*half_width)
      mean = pi*d/length*edge**2
      allocate (h(nx, ny), p(nx, ny))
      do j = 1, ny
         do i = 1, nx
            phase = pi*(kx*real(i - 1, dp)/nx + ky*real(j - 1, dp)/ny)
            h(i, j) = d*cos(2.0_dp*phase)
            p(i, j) = 2.0_dp*mean*abs(cos(phase))/edge**2*sqrt(max(edge**2 - sin(phase)**2, 0.0_dp))
         end do
      end do
      problem%modulus = unit_modulus
      problem%target = mean
      problem%tolerance = 1e-9_dp
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, trim(name)//s%outcome%reason)
      ! Near the edge the pressure is ~ sqrt(distance), so that the error of a cell there is ~ sqrt(1/cells).
      ! It dominates the sum of the squares, so that the rms error is ~ 1/cells.
      error = sqrt(sum((s%pressure - p)**2)/size(p))/mean
      call check_order(error, '<=', 1.5_dp/cells, trim(name)//' pressure')
      gap = 2.0_dp*d*(cos(pi*half_width)**2/2.0_dp + edge**2*log(edge))
      call check_close(sum(s%gap)/size(p), gap, 2.0_dp*d*1.0_dp/cells, trim(name)//' mean gap')
      call check_close(count(s%pressure > 0.0_dp)/real(size(p), dp), 2.0_dp*half_width, &
         2.0_dp/cells, trim(name)//' contact')
   end subroutine westergaard_wave

   !> Above the pressure that closes the gap, the pressure is p + A^-1 H to round-off, without iterations.
   subroutine full_contact_is_exact()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), p(:, :)
      logical :: thesis
      integer :: k

      grid = new_grid(63, 40, 1.0_dp, 0.9_dp, boundary_periodic)
      ! There is no wave at the Nyquist number, because a real transform cannot represent its phase.
      call rough_height(grid, 4.0_dp, h)
      allocate (p(63, 40))
      call new_convolution(operator, grid, normal_half_space(poisson), error)
      call operator%apply_inverse(h, p)
      call operator%destroy()
      p = unit_modulus*p
      problem%modulus = unit_modulus
      problem%target = 1.001_dp*maxval(-p)
      problem%tolerance = 1e-10_dp
      do k = 1, 2
         thesis = k == 2
         call run_problem(grid, problem, h, s, thesis)
         call check_that(s%outcome%converged, s%outcome%reason)
         call check_close(maxval(abs(s%pressure - p - problem%target)), 0.0_dp, &
            1e-12_dp*problem%target, 'full contact: pressure')
         call check_close(maxval(abs(s%gap)), 0.0_dp, 1e-12_dp*rms(h), 'full contact: gap')
         call check_order(s%outcome%iterations, '<=', 1, 'full contact: at once')
      end do
      ! Slightly below this pressure a small part is open.
      problem%target = 0.9_dp*maxval(-p)
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, s%outcome%reason)
      call check_order(minval(s%pressure), '<=', 0.0_dp, 'not quite full contact')
   end subroutine full_contact_is_exact

   !> From a load to the approach and back.
   subroutine load_to_approach_and_back(boundary, nx, ny)
      integer, intent(in) :: boundary, nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: load, d
      integer :: k

      grid = new_grid(nx, ny, 1.0_dp, 0.8_dp, boundary)
      call rough_height(grid, 6.0_dp, h)
      h = h + 3.0_dp
      problem%modulus = unit_modulus
      problem%tolerance = 1e-11_dp
      do k = 1, 3
         problem%control = control_pressure
         problem%target = 1e-4_dp*10.0_dp**k
         load = problem%target
         call run_problem(grid, problem, h, s)
         call check_that(s%outcome%converged, s%outcome%reason)
         problem%control = control_approach
         problem%target = s%level
         call run_problem(grid, problem, h, t)
         call check_that(t%outcome%converged, t%outcome%reason)
         ! The error of the load is the stiffness times the error of the approach, ~ e1 h_rms.
         d = sum(t%pressure)/size(h)
         call check_close(d/load, 1.0_dp, 1e-5_dp, 'load, approach, load')
         call check_close(sum(abs(s%pressure - t%pressure))/sum(s%pressure), 0.0_dp, 1e-4_dp, &
            'the same pressure')
         call run_problem(grid, problem, h, t, .true.)
         call check_that(t%outcome%converged, 'thesis, approach: '//t%outcome%reason)
         call check_close(sum(t%pressure)/size(h)/load, 1.0_dp, 1e-5_dp, 'the same by the thesis')
      end do
   end subroutine load_to_approach_and_back

   !> The reported error is that of the definition, and all tolerances are reached.
   subroutine error_is_that_of_the_definition(boundary, nx, ny)
      integer, intent(in) :: boundary, nx, ny
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      real(dp) :: e1
      integer :: k

      grid = new_grid(nx, ny, 1.0_dp, 1.1_dp, boundary)
      call rough_problem(grid, 6.0_dp, 0.01_dp, problem, h)
      do k = 4, 10
         problem%tolerance = 10.0_dp**(-k)
         call run_problem(grid, problem, h, s)
         call duality_gap(grid, unit_modulus, h, s%pressure, e1)
         call check_that(s%outcome%converged .and. e1 <= problem%tolerance, 'a tolerance is reached', &
            [e1])
         call check_close(s%outcome%residual, max(e1, s%outcome%load_error), 1e-13_dp, 'e1')
         call check_close(sum(s%pressure)/size(h)/problem%target, 1.0_dp, &
            min(problem%tolerance, 1e-12_dp), 'the load')
         call check_order(minval(s%pressure), '>=', 0.0_dp, 'no tension')
         call check_close(sum(s%pressure*s%gap), 0.0_dp, 1e-12_dp*sum(s%pressure)*rms(h), &
            'the gap is zero under the pressure')
      end do
      problem%tolerance = 1e-6_dp
      call run_problem(grid, problem, h, s, .true.)
      call duality_gap(grid, unit_modulus, h, s%pressure, e1)
      call check_that(s%outcome%converged .and. e1 <= problem%tolerance, 'thesis: the tolerance', &
         [e1])
      call check_close(s%outcome%residual, max(e1, s%outcome%load_error), 1e-13_dp, 'thesis: e1')
   end subroutine error_is_that_of_the_definition

   !> At small loads A/A0 = kappa p/(E* h'rms), with kappa between Persson's sqrt(8/pi) and sqrt(2 pi) of
   !> Bush, Gibson and Thomas. The strip of cells along the edge of the contact is subtracted: (pi - 1 + ln
   !> 2)/24 of the perimeter times dx (Yastrebov, Anciaux, Molinari 2017).
   subroutine area_at_small_loads_in_its_bracket()
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s
      real(dp), allocatable :: h(:, :)
      logical, allocatable :: touches(:, :)
      real(dp) :: area, edges, kappa
      integer :: k

      grid = new_grid(240, 256, 0.9375_dp, 1.0_dp, boundary_periodic)
      call rough_problem(grid, 16.0_dp, 0.0_dp, problem, h)
      do k = 1, 2
         problem%target = merge(0.02_dp, 0.05_dp, k == 1)*0.1_dp
         call run_problem(grid, problem, h, s)
         call check_that(s%outcome%converged, s%outcome%reason)
         touches = s%pressure > 0.0_dp
         edges = count(touches .neqv. cshift(touches, 1, 1)) + count(touches .neqv. cshift(touches, 1, 2))
         area = count(touches) - (pi - 1.0_dp + log(2.0_dp))/24.0_dp*edges
         kappa = area/size(h)/(problem%target/0.1_dp)
         call check_order(kappa, '>', sqrt(8.0_dp/pi), 'more than Persson''s area')
         call check_order(kappa, '<', sqrt(2.0_dp*pi), 'less than Bush, Gibson and Thomas''s area')
      end do
   end subroutine area_at_small_loads_in_its_bracket

   !> H = -r^2/(2R) about a centre, the nearest image along x.
   function paraboloid(grid, radius, centre_x, centre_y) result(h)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: radius
      real(dp), intent(in) :: centre_x, centre_y
      real(dp), allocatable :: h(:, :)
      real(dp) :: x, y
      integer :: i, j

      allocate (h(grid%nx, grid%ny))
      do j = 1, grid%ny
         do i = 1, grid%nx
            x = (i - 1)*grid%dx - centre_x
            if (grid%boundary == boundary_periodic) x = x - grid%lx*nint(x/grid%lx)
            y = (j - 1)*grid%dy - centre_y
            h(i, j) = -(x**2 + y**2)/(2.0_dp*radius)
         end do
      end do
   end function paraboloid

end module test_normal_cg
