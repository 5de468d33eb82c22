!> Tests of the influence coefficients and of the convolution operator.
module test_fft_conv
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution, new_symbol_operator
   use influence, only : love_normal, love_tangential, transform_length
   use kernels, only : normal_half_space, tangential_half_space
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use transform_lengths, only : good_length, length_warning
   use transform_shape, only : whole_shape
   implicit none
   private

   public :: run_fft_conv

contains

   subroutine run_fft_conv()
      call begin_suite('fft_conv')
      if (selected('poisson_ratios_are_checked')) call poisson_ratios_are_checked()
      if (selected('good_lengths')) call good_lengths()
      if (selected('coefficients_match_quadrature')) call coefficients_match_quadrature()
      if (selected('oblique_waves_are_eigenfunctions')) then
         call oblique_waves_are_eigenfunctions(8, 6, 3.0_dp, 2.0_dp, .false.)
         call oblique_waves_are_eigenfunctions(8, 6, 3.0_dp, 2.0_dp, .true.)
         call oblique_waves_are_eigenfunctions(9, 5, 1.0_dp, 2.0_dp, .false.)
         call oblique_waves_are_eigenfunctions(9, 5, 1.0_dp, 2.0_dp, .true.)
         call oblique_waves_are_eigenfunctions(16, 1, 1.0_dp, 2.0_dp, .false.)
         call oblique_waves_are_eigenfunctions(16, 1, 1.0_dp, 2.0_dp, .true.)
         call oblique_waves_are_eigenfunctions(160, 131, 1.0_dp, 0.7_dp, .false.)
         call oblique_waves_are_eigenfunctions(160, 131, 1.0_dp, 0.7_dp, .true.)
      end if
      if (selected('free_operator_is_the_double_sum')) then
         call free_operator_is_the_double_sum(7, 5, .false.)
         call free_operator_is_the_double_sum(7, 5, .true.)
         call free_operator_is_the_double_sum(6, 8, .false.)
         call free_operator_is_the_double_sum(6, 8, .true.)
         call free_operator_is_the_double_sum(1, 3, .false.)
         call free_operator_is_the_double_sum(1, 3, .true.)
      end if
      if (selected('inverse_undoes_the_operator')) call inverse_undoes_the_operator(.false.)
      if (selected('inverse_undoes_the_operator')) call inverse_undoes_the_operator(.true.)
      if (selected('units_beyond_single_precision')) call units_beyond_single_precision()
      if (selected('lean_operators_are_the_same')) call lean_operators_are_the_same()
      if (selected('large_periodic_cell_is_like_free')) call large_periodic_cell_is_like_free()
      if (selected('transform_lengths_of_grids')) call transform_lengths_of_grids()
   end subroutine run_fft_conv

   !> A solid cannot have a Poisson ratio above 0.5.
   subroutine poisson_ratios_are_checked()
      type(convolution_type) :: operator
      type(error_type), allocatable :: error

      call new_convolution(operator, new_grid(4, 4, 1.0_dp, 1.0_dp, boundary_periodic), normal_half_space(0.7_dp), error)
      call check_error(error, 'poisson = 0.7: must be > -1 and <= 0.5', 'a ratio of 0.7')
   end subroutine poisson_ratios_are_checked

   !> A periodic grid is not padded. A free grid is padded to a length with small factors.
   subroutine transform_lengths_of_grids()
      call check_that(transform_length(7, boundary_periodic) == 7, 'no padding where periodic')
      call check_that(transform_length(509, boundary_free) == 1024, 'padding to small factors')
   end subroutine transform_lengths_of_grids

   !> Good lengths divide a power of 60, and every such length is found. A warning names the two good lengths
   !> next to a bad one.
   subroutine good_lengths()
      integer :: n, up, down, k

      do n = 1, 400
         up = good_length(n, 1)
         down = good_length(n, -1)
         call check_that(divides_a_power_of_60(up) .and. divides_a_power_of_60(down), 'good lengths are smooth')
         call check_that(.not. any([(divides_a_power_of_60(k), k=down + 1, n - 1)]) .and. &
            .not. any([(divides_a_power_of_60(k), k=n + 1, up - 1)]), 'good lengths are the next ones')
      end do
      call check_that(index(length_warning('ny', 296, 512), 'ny = 296 has the prime factor 37') > 0 .and. &
         index(length_warning('ny', 296, 512), 'ny = 288 or 300') > 0, 'a warning: '//length_warning('ny', 296, 512))
      call check_that(length_warning('ny', 300, 296) == '' .and. length_warning('nx', 37, 37) == '', &
         'no warning for good lengths and small grids')
   end subroutine good_lengths

   pure logical function divides_a_power_of_60(n)
      integer, intent(in) :: n

      divides_a_power_of_60 = mod(mod(60_int64**5, int(n, int64))*mod(60_int64**5, int(n, int64)), int(n, int64)) == 0
   end function divides_a_power_of_60

   !> Love's coefficients against midpoint quadrature of the point solutions.
   subroutine coefficients_match_quadrature()
      integer, parameter :: m = 400
      real(dp), parameter :: dx = 0.7_dp, dy = 1.3_dp, nu = 0.3_dp
      real(dp) :: x, y, a, b, r, zz, xx, xy, yy, l_xx, l_xy, l_yy
      integer :: i, j

      x = 2.0_dp
      y = -1.5_dp
      zz = 0.0_dp
      xx = 0.0_dp
      xy = 0.0_dp
      yy = 0.0_dp
      do j = 1, m
         do i = 1, m
            a = x - dx*((i - 0.5_dp)/m - 0.5_dp)
            b = y - dy*((j - 0.5_dp)/m - 0.5_dp)
            r = hypot(a, b)
            zz = zz + (1.0_dp - nu)/r
            xx = xx + (1.0_dp - nu)/r + nu*a**2/r**3
            yy = yy + (1.0_dp - nu)/r + nu*b**2/r**3
            xy = xy + nu*a*b/r**3
         end do
      end do
      r = dx*dy/(2.0_dp*pi*real(m, dp)**2)
      call love_tangential(x, y, dx, dy, nu, l_xx, l_xy, l_yy)
      ! The midpoint rule with 400 x 400 points is accurate to about (dx/m)^2/24 = 1e-7 of the value.
      call check_close(love_normal(x, y, dx, dy, nu), zz*r, 1e-7_dp*zz*r, 'a_zz by quadrature')
      call check_close(l_xx, xx*r, 1e-7_dp*xx*r, 'a_xx by quadrature')
      call check_close(l_yy, yy*r, 1e-7_dp*yy*r, 'a_yy by quadrature')
      call check_close(l_xy, xy*r, 1e-6_dp*abs(xy*r), 'a_xy by quadrature')
      ! At the centre of a square cell: 4 asinh(1) dx (1-nu)/(2 pi).
      call check_close(love_normal(0.0_dp, 0.0_dp, 2.0_dp, 2.0_dp, 0.5_dp), &
         4.0_dp*asinh(1.0_dp)*2.0_dp*0.5_dp/(2.0_dp*pi), 1e-15_dp, 'a_zz of a cell on itself')
   end subroutine coefficients_match_quadrature

   !> Oblique waves are eigenfunctions of the periodic operators.
   subroutine oblique_waves_are_eigenfunctions(nx, ny, lx, ly, single)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly
      real(dp), parameter :: nu = 0.3_dp, h = 0.25_dp
      logical, intent(in) :: single            !! 1 or 2; in single precision the tolerance is 1e-6 of the values
      type(grid_type) :: grid
      type(convolution_type) :: normal, tangential
      type(error_type), allocatable :: error
      real(dp), allocatable :: p(:, :), py(:, :), u(:, :), uy(:, :), w(:, :)
      real(dp) :: qx, qy, q, form
      real(dp) :: loose
      integer :: i, j, kx, ky

      loose = merge(1e-6_dp, 0.0_dp, single)
      grid = new_grid(nx, ny, lx, ly, boundary_periodic)
      call new_convolution(normal, grid, normal_half_space(nu), error, single)
      call check_no_error(error, 'normal operator')
      call new_convolution(tangential, grid, tangential_half_space(nu, h), error, single)
      call check_no_error(error, 'tangential operator')
      allocate (p(nx, ny), py(nx, ny), u(nx, ny), uy(nx, ny), w(nx, ny))
      do ky = -min(2, (ny - 1)/2), min(2, (ny - 1)/2)
         do kx = 0, 2
            qx = 2.0_dp*pi*kx/lx
            qy = 2.0_dp*pi*ky/ly
            q = hypot(qx, qy)
            do j = 1, ny
               do i = 1, nx
                  w(i, j) = cos(qx*lx*(i - 1)/nx + qy*ly*(j - 1)/ny + 0.4_dp)
               end do
            end do
            call normal%apply(w, u, form)
            if (q > 0.0_dp) then
               call check_close(maxval(abs(u - w*(1.0_dp - nu)/q)), 0.0_dp, 1e-14_dp + loose*(1.0_dp - nu)/q, 'normal wave')
            else
               call check_close(maxval(abs(u)), 0.0_dp, 1e-15_dp + loose, 'no mean displacement')
            end if
            call check_close(form, sum(w*u), (1e-13_dp + loose)*nx*ny, 'Parseval')
            call normal%quadratic_form(w, form)
            call check_close(form, sum(w*u), (1e-13_dp + loose)*nx*ny, 'quadratic form')
            p = 2.0_dp*w
            py = -3.0_dp*w
            call tangential%apply_vector(p, py, u, uy, form)
            ! The error of a plain sum of n equal terms is up to n epsilon.
            call check_close(form, sum(p*u + py*uy), (3e-16_dp*nx*ny + loose)*sum(abs(p*u + py*uy)) + 1e-12_dp, &
               'Parseval of a vector')
            if (q > 0.0_dp) then
               u = u - (p - nu*qx*(qx*p + qy*py)/q**2)/q
               uy = uy - (py - nu*qy*(qx*p + qy*py)/q**2)/q
            else
               u = u - h*p
               uy = uy - h*py
            end if
            call check_close(maxval(abs(u)), 0.0_dp, 2e-14_dp + loose, 'tangential wave, x')
            call check_close(maxval(abs(uy)), 0.0_dp, 2e-14_dp + loose, 'tangential wave, y')
         end do
      end do
      call normal%destroy()
      call tangential%destroy()
   end subroutine oblique_waves_are_eigenfunctions

   !> The free operators agree with the double sum.
   subroutine free_operator_is_the_double_sum(nx, ny, single)
      integer, intent(in) :: nx, ny
      real(dp), parameter :: nu = 0.4_dp
      logical, intent(in) :: single            !! in single precision: to 1e-6 of the values
      type(grid_type) :: grid
      type(convolution_type) :: normal, tangential
      type(error_type), allocatable :: error
      real(dp), allocatable :: p(:, :), py(:, :), u(:, :), ux(:, :), uy(:, :)
      real(dp) :: zz, xx, xy, yy, a_xx, a_xy, a_yy, form
      real(dp) :: loose
      integer :: i, j, k, l

      loose = merge(1e-6_dp, 0.0_dp, single)
      grid = new_grid(nx, ny, 1.0_dp, 1.7_dp, boundary_free)
      call new_convolution(normal, grid, normal_half_space(nu), error, single)
      call new_convolution(tangential, grid, tangential_half_space(nu), error, single)
      allocate (p(nx, ny), py(nx, ny), u(nx, ny), ux(nx, ny), uy(nx, ny))
      do j = 1, ny
         do i = 1, nx
            p(i, j) = sin(1.3_dp*i*j + i)
            py(i, j) = cos(2.1_dp*j - 0.3_dp*i)
         end do
      end do
      call normal%apply(p, u, form)
      call check_close(form, sum(p*u), 1e-13_dp + loose*sum(abs(p*u)), 'free Parseval')
      call tangential%apply_vector(p, py, ux, uy, form)
      call check_close(form, sum(p*ux + py*uy), 1e-13_dp + loose*sum(abs(p*ux + py*uy)), 'free Parseval of a vector')
      do j = 1, ny
         do i = 1, nx
            zz = 0.0_dp
            xx = 0.0_dp
            yy = 0.0_dp
            do l = 1, ny
               do k = 1, nx
                  zz = zz + p(k, l)*love_normal((i - k)*grid%dx, (j - l)*grid%dy, grid%dx, grid%dy, nu)
                  call love_tangential((i - k)*grid%dx, (j - l)*grid%dy, grid%dx, grid%dy, nu, &
                     a_xx, a_xy, a_yy)
                  xx = xx + a_xx*p(k, l) + a_xy*py(k, l)
                  yy = yy + a_xy*p(k, l) + a_yy*py(k, l)
               end do
            end do
            xy = abs(ux(i, j) - xx) + abs(uy(i, j) - yy)
            call check_close(u(i, j), zz, 1e-14_dp + loose, 'free normal')
            call check_close(xy, 0.0_dp, 2e-14_dp + loose, 'free tangential')
         end do
      end do
      call normal%destroy()
      call tangential%destroy()
   end subroutine free_operator_is_the_double_sum

   !> The inverse of the periodic operator returns a field without its mean. A symbol of one is the identity.
   subroutine inverse_undoes_the_operator(single)
      logical, intent(in) :: single            !! in single precision: to 1e-6 of the values
      type(grid_type) :: grid
      type(convolution_type) :: normal, identity
      type(error_type), allocatable :: error
      real(dp) :: p(12, 7), u(12, 7), back(12, 7), ones(0:6, 0:3)
      real(dp) :: loose
      integer :: i, j

      loose = merge(1e-6_dp, 0.0_dp, single)
      grid = new_grid(12, 7, 2.0_dp, 1.0_dp, boundary_periodic)
      call new_convolution(normal, grid, normal_half_space(0.5_dp), error, single)
      do j = 1, 7
         do i = 1, 12
            p(i, j) = sin(0.7_dp*i*j)
         end do
      end do
      call normal%apply(p, u)
      call normal%apply_inverse(u, back)
      call check_close(maxval(abs(back - p + sum(p)/84.0_dp)), 0.0_dp, 1e-13_dp + loose, 'inverse')
      ones = 1.0_dp
      call new_symbol_operator(identity, whole_shape(12, 7, 1), error, single)
      call identity%set_symbol(ones)
      call identity%apply(p, back)
      call check_close(maxval(abs(back - p)), 0.0_dp, 1e-15_dp + loose, 'identity')
      call check_that(identity%ffts == 2, 'an application is two transforms')
      call check_that(identity%single .eqv. single, 'the precision asked for')
      if (single) call check_order(maxval(abs(back - p)), '>', 1e-12_dp, &
         'single precision is at work')
      call normal%destroy()
      call identity%destroy()
   end subroutine inverse_undoes_the_operator

   !> Values whose squares exceed the range of single precision are scaled by a unit.
   subroutine units_beyond_single_precision()
      type(grid_type) :: grid
      type(convolution_type) :: exact, single
      type(error_type), allocatable :: error
      real(dp) :: p(11, 6), u(11, 6), v(11, 6), form, same, size
      integer :: i, j, k

      grid = new_grid(11, 6, 2e-9_dp, 1e-9_dp, boundary_free)
      call new_convolution(exact, grid, normal_half_space(0.3_dp), error)
      call new_convolution(single, grid, normal_half_space(0.3_dp), error, single=.true.)
      do k = -60, 60, 30
         size = 10.0_dp**k
         do j = 1, 6
            do i = 1, 11
               p(i, j) = size*cos(1.1_dp*i*j - i)
            end do
         end do
         call single%set_unit(size)
         call exact%apply(p, u, form)
         call single%apply(p, v, same)
         call check_close(maxval(abs(u - v))/maxval(abs(u)), 0.0_dp, 1e-6_dp, 'any size of values')
         call check_close(same/form, 1.0_dp, 1e-6_dp, 'their quadratic form')
         call single%quadratic_form(p, same)
         call check_close(same/form, 1.0_dp, 1e-6_dp, 'the form alone')
      end do
      call check_that(single%ffts == 5*3, 'transforms are counted')
      call exact%destroy()
      call single%destroy()
   end subroutine units_beyond_single_precision

   !> An operator without a table, and one that shares the memory of another, give the same bits.
   subroutine lean_operators_are_the_same()
      type(grid_type) :: grid
      type(convolution_type) :: plain, lean, shared
      type(error_type), allocatable :: error
      real(dp) :: p(22, 9), u(22, 9), v(22, 9), form, same
      integer :: i, j, k

      grid = new_grid(22, 9, 2e-3_dp, 1e-3_dp, boundary_periodic)
      call new_convolution(plain, grid, normal_half_space(0.3_dp), error)
      call new_convolution(lean, grid, normal_half_space(0.3_dp), error, lean=.true.)
      call new_convolution(shared, grid, normal_half_space(0.3_dp), error, memory=lean%spectrum_memory())
      call check_no_error(error, 'operators')
      do j = 1, 9
         do i = 1, 22
            p(i, j) = cos(1.1_dp*i*j - i)
         end do
      end do
      do k = 1, 2
         call plain%apply(p, u, form)
         call lean%apply(p, v, same)
         call check_that(all(abs(u - v) <= 0.0_dp) .and. abs(form - same) <= 0.0_dp, 'without a table')
         call shared%apply(p, v, same)
         call check_that(all(abs(u - v) <= 0.0_dp) .and. abs(form - same) <= 0.0_dp, 'in shared memory')
         call plain%apply_inverse(p, u)
         call lean%apply_inverse(p, v)
         call check_close(maxval(abs(u - v)), 0.0_dp, 0.0_dp, 'the inverse')
      end do
      call plain%destroy()
      call shared%destroy()
      call lean%destroy()
   end subroutine lean_operators_are_the_same

   !> In a large periodic cell, differences of displacements are those of the free operator.
   subroutine large_periodic_cell_is_like_free()
      integer, parameter :: n = 512, m = 9
      type(grid_type) :: large, small
      type(convolution_type) :: periodic, free
      type(error_type), allocatable :: error
      real(dp), allocatable :: p(:, :), u(:, :)
      real(dp) :: q(m, m), w(m, m)
      integer :: i, j

      large = new_grid(n, n, real(n, dp), real(n, dp), boundary_periodic)
      small = new_grid(m, m, real(m, dp), real(m, dp), boundary_free)
      call new_convolution(periodic, large, normal_half_space(0.2_dp), error)
      call new_convolution(free, small, normal_half_space(0.2_dp), error)
      allocate (p(n, n), u(n, n), source=0.0_dp)
      ! The field is smooth, so that the discretisation matters little, and small compared with the period.
      do j = 1, m
         do i = 1, m
            q(i, j) = cos(2.0_dp*pi*(i - 5)/8.0_dp)*bump(i)*bump(j)
         end do
      end do
      p(1:m, 1:m) = q
      call periodic%apply(p, u)
      call free%apply(q, w)
      w = w - w(1, 1) - (u(1:m, 1:m) - u(1, 1))
      ! The cell average of the free kernel and the symbol that ends at the Nyquist number differ by 1 % of
      ! the displacement.
      call check_close(maxval(abs(w)), 0.0_dp, 0.02_dp, 'periodic against free')
      call periodic%destroy()
      call free%destroy()

   contains

      pure function bump(k) result(value)
         integer, intent(in) :: k
         real(dp) :: value

         value = cos(pi*(k - 5)/10.0_dp)**2
      end function bump

   end subroutine large_periodic_cell_is_like_free

end module test_fft_conv
