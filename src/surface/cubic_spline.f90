!> The cubic B-spline surface through a height map. It is twice continuously differentiable and
!> passes through the heights of the cells. Its height is of fourth order; its slopes are of third
!> order between the cells and of fourth order at the cells.
!>
!> H(x, y) = sum of c_ij B(x - i) B(y - j), where B is the cubic B-spline. The coefficients c are
!> computed once from the map, line by line, first along x and then along y. A line of a periodic
!> map goes through the recursive filter with the pole z = sqrt(3) - 2 (Unser, Aldroubi and Eden,
!> IEEE Trans. Signal Process. 41, 1993). A line of a bounded map is the solution of a tridiagonal
!> system; the second derivatives at its two ends are one-sided differences, so that the spline
!> reproduces cubic polynomials up to the rim.
!>
!> Cells are numbered from 0 in this module, and coefficients from -1 to n + 1. The processes share the rows of
!> coefficients like those of the map. The rows -1 and ny of a bounded map, its rim, are on all of them.
module cubic_spline
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp
   use field_columns, only : block, column_work_type, work_on_columns
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: most_places, spline_coefficients, spline_run

   integer, parameter :: most_places = 64       !! of a run of neighbouring cells that is evaluated together
   integer, parameter :: terms = 60             !! of a geometric series in z; |z|^60 < 1e-34

   !> The filter along y.
   type, extends(column_work_type) :: column_filter_type
      logical :: periodic = .true.
      integer :: n = 0                                     !! rows of the map
      real(dp), pointer, contiguous :: ends(:, :) => null()   !! coefficients -1 and n of each column
   contains
      procedure :: work => filter_columns
   end type column_filter_type

contains

   !> Coefficients of the spline through a map. Collective.
   subroutine spline_coefficients(grid, height, c, rim)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                 !! m, [nx, rows of this process]
      real(dp), intent(inout) :: c(:, :)                   !! out: m, [-1..nx+1, rows of this process]
      real(dp), intent(out) :: rim(:, :)                   !! rows -1 and ny, m, [-1..nx+1, 2]
      type(column_filter_type) :: filter
      real(dp), allocatable, target :: ends(:, :)
      real(dp), allocatable :: lines(:, :)
      integer :: first, i, j, last, nx, rows

      nx = grid%nx
      rows = grid%rows()
      filter%periodic = grid%boundary == boundary_periodic
      !$omp parallel default(none) shared(c, height, nx, rows, filter) &
      !$omp private(first, i, j, last, lines)
      allocate (lines(block, -1:nx + 1))
      lines = 0.0_dp
      !$omp do
      do first = 1, rows, block
         last = min(first + block - 1, rows)
         do j = first, last
            do i = 0, nx - 1
               lines(j - first + 1, i) = height(i + 1, j)
            end do
         end do
         call filter_lines(filter%periodic, nx, lines)
         do j = first, last
            do i = -1, nx + 1
               c(i + 2, j) = lines(j - first + 1, i)
            end do
         end do
      end do
      deallocate (lines)
      !$omp end parallel

      ! Each process sets the ends of the columns that it filters; the others are 0 there.
      allocate (ends(size(rim, 1), 2), source=0.0_dp)
      filter%n = grid%ny
      filter%before = 1
      filter%behind = 2
      filter%ends => ends
      call work_on_columns(grid, c, filter)
      rim(:, 1) = ends(:, 1)
      rim(:, 2) = ends(:, 2)
      if (.not. grid%shared) return
      rim(:, 1) = global_sum(ends(:, 1))
      rim(:, 2) = global_sum(ends(:, 2))
   end subroutine spline_coefficients

   !> Filter a block of columns, and keep the coefficients beyond their ends.
   subroutine filter_columns(self, first, columns)
      class(column_filter_type), intent(in) :: self
      integer, intent(in) :: first                         !! number of the first column, from 1
      real(dp), intent(inout) :: columns(:, :)             !! [block, -1..n+1]
      integer :: last

      call filter_lines(self%periodic, self%n, columns)
      last = min(first + block - 1, size(self%ends, 1))
      self%ends(first:last, 1) = columns(:last - first + 1, 1)
      self%ends(first:last, 2) = columns(:last - first + 1, self%n + 2)
   end subroutine filter_columns

   !> Replace heights at 0..n-1 by coefficients at -1..n+1.
   pure subroutine filter_lines(periodic, n, lines)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      real(dp), intent(inout) :: lines(:, -1:)             !! shape [block, n + 3]

      if (periodic) then
         call filter_periodic(n, lines)
      else
         call filter_bounded(n, lines)
      end if
   end subroutine filter_lines

   !> The recursive filter for periodic lines. It runs forwards and then backwards. The value that
   !> each direction starts from is a geometric series over all periods, which is summed in closed
   !> form.
   pure subroutine filter_periodic(n, lines)
      integer, intent(in) :: n
      real(dp), intent(inout) :: lines(:, -1:)
      real(dp), parameter :: z = sqrt(3.0_dp) - 2.0_dp
      real(dp) :: start(block)
      integer :: k

      start = 0.0_dp
      do k = min(n - 1, terms), 0, -1
         start = z*start + lines(:, modulo(-k, n))
      end do
      lines(:, 0) = start/(1.0_dp - z**n)
      do k = 1, n - 1
         lines(:, k) = lines(:, k) + z*lines(:, k - 1)
      end do
      start = 0.0_dp
      do k = min(n - 1, terms), 0, -1
         start = z*start + lines(:, modulo(n - 1 + k, n))
      end do
      lines(:, n - 1) = -6.0_dp*z/(1.0_dp - z**n)*start
      do k = n - 2, 0, -1
         lines(:, k) = z*(lines(:, k + 1) - 6.0_dp*lines(:, k))
      end do
      lines(:, -1) = lines(:, n - 1)
      lines(:, n) = lines(:, 0)
      lines(:, n + 1) = lines(:, modulo(1, n))
   end subroutine filter_periodic

   !> Solve the tridiagonal system (c(k-1) + 4 c(k) + c(k+1))/6 = f(k) of bounded lines by
   !> elimination.
   pure subroutine filter_bounded(n, lines)
      integer, intent(in) :: n
      real(dp), intent(inout) :: lines(:, -1:)
      real(dp) :: bend_first(block), bend_last(block), pivot(n)
      integer :: k

      bend_first = 0.0_dp
      bend_last = 0.0_dp
      if (n == 3) then
         bend_first = lines(:, 0) - 2.0_dp*lines(:, 1) + lines(:, 2)
         bend_last = bend_first
      else if (n > 3) then
         bend_first = 2.0_dp*lines(:, 0) - 5.0_dp*lines(:, 1) + 4.0_dp*lines(:, 2) - lines(:, 3)
         bend_last = 2.0_dp*lines(:, n - 1) - 5.0_dp*lines(:, n - 2) + 4.0_dp*lines(:, n - 3) &
            - lines(:, n - 4)
      end if

      lines(:, 0) = lines(:, 0) - bend_first/6.0_dp
      if (n > 1) lines(:, n - 1) = lines(:, n - 1) - bend_last/6.0_dp
      pivot(1) = 0.0_dp
      do k = 1, n - 2
         pivot(k + 1) = 1.0_dp/(4.0_dp - pivot(k))
         lines(:, k) = (6.0_dp*lines(:, k) - lines(:, k - 1))*pivot(k + 1)
      end do
      do k = n - 2, 1, -1
         lines(:, k) = lines(:, k) - pivot(k + 1)*lines(:, k + 1)
      end do

      if (n > 1) then
         lines(:, -1) = 2.0_dp*lines(:, 0) - lines(:, 1) + bend_first
         lines(:, n) = 2.0_dp*lines(:, n - 1) - lines(:, n - 2) + bend_last
      else
         lines(:, -1) = lines(:, 0)
         lines(:, n) = lines(:, 0)
      end if
      lines(:, n + 1) = lines(:, n)
   end subroutine filter_bounded

   !> Heights at (i + u_1, j + v_1), (i + 1 + u_2, j + v_2), and so on, for at most `most_places` places, and their slopes
   !> per cell (not per metre). The coefficients stand side by side, so that the compiler can vectorise the loops.
   pure subroutine spline_run(c, i, rows, u, v, h, h_u, h_v)
      real(dp), intent(in), contiguous :: c(-1:, :)     !! coefficients, in any rows
      integer, intent(in) :: i                          !! first cell along x, from 0
      integer, intent(in) :: rows(4)                    !! of the coefficients j - 1 to j + 2
      real(dp), intent(in), contiguous :: u(:), v(:)    !! 0 to 1
      real(dp), intent(out), contiguous :: h(:)         !! m
      real(dp), intent(out), contiguous :: h_u(:), h_v(:)   !! m per cell
      real(dp), dimension(most_places, 4) :: a, a_u, b, b_v
      real(dp) :: row, row_u
      integer :: k, m, n

      call find_weights(u, a, a_u)
      call find_weights(v, b, b_v)
      h(:) = 0.0_dp
      h_u(:) = 0.0_dp
      h_v(:) = 0.0_dp
      do m = 1, 4
         n = rows(m)
         do k = 1, size(u)
            row = a(k, 1)*c(i + k - 2, n) + a(k, 2)*c(i + k - 1, n) + a(k, 3)*c(i + k, n) + a(k, 4)*c(i + k + 1, n)
            row_u = a_u(k, 1)*c(i + k - 2, n) + a_u(k, 2)*c(i + k - 1, n) + a_u(k, 3)*c(i + k, n) &
               + a_u(k, 4)*c(i + k + 1, n)
            h(k) = h(k) + b(k, m)*row
            h_u(k) = h_u(k) + b(k, m)*row_u
            h_v(k) = h_v(k) + b_v(k, m)*row
         end do
      end do
   end subroutine spline_run

   !> Values of the cubic B-splines of the four nearest cells, at the fractions u of a cell, and their derivatives.
   pure subroutine find_weights(u, w, slopes)
      real(dp), intent(in), contiguous :: u(:)
      real(dp), intent(out) :: w(most_places, 4), slopes(most_places, 4)
      real(dp), parameter :: sixth = 1.0_dp/6.0_dp
      integer :: k

      do k = 1, size(u)
         w(k, 1) = sixth*(1.0_dp - u(k))**3
         w(k, 2) = sixth*(4.0_dp + u(k)*u(k)*(3.0_dp*u(k) - 6.0_dp))
         w(k, 3) = sixth*(1.0_dp + 3.0_dp*u(k)*(1.0_dp + u(k)*(1.0_dp - u(k))))
         w(k, 4) = sixth*u(k)**3
         slopes(k, 1) = -0.5_dp*(1.0_dp - u(k))**2
         slopes(k, 2) = u(k)*(1.5_dp*u(k) - 2.0_dp)
         slopes(k, 3) = 0.5_dp + u(k)*(1.0_dp - 1.5_dp*u(k))
         slopes(k, 4) = 0.5_dp*u(k)**2
      end do
   end subroutine find_weights

end module cubic_spline
