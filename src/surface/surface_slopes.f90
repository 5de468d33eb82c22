!> Slopes of a height map at the centres of its cells, by central differences or from its spectrum.
module surface_slopes
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use row_column_double, only : block, multiplier_type, new_row_column, row_column_type
   use row_fetch, only : fetch_rows
   use transform_shape, only : shape_on_grid, transform_shape_type
   use wave_vectors, only : is_nyquist, wave_number
   implicit none
   private

   public :: central_slopes, neighbours, spectral_slopes

   !> What makes the modes of both slopes from those of the height.
   type, extends(multiplier_type) :: gradient_type
      type(grid_type) :: grid
   contains
      procedure :: multiply
   end type gradient_type

contains

   !> Slopes by central differences, which are of second order. On the rim of a free map the
   !> differences are one-sided. Collective.
   subroutine central_slopes(grid, height, slope_x, slope_y)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)        !! m, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_x(:, :)      !! dH/dx, of the same shape
      real(dp), intent(out) :: slope_y(:, :)      !! dH/dy, of the same shape
      real(dp), allocatable :: beyond(:, :)       !! the rows before the first and behind the last
      integer :: east, i, j, one, row, south, north, west
      logical :: periodic
      real(dp) :: per_dx, per_dy

      allocate (beyond(grid%nx, 2), source=0.0_dp)
      one = min(grid%rows(), 1)                   ! a process without rows needs none
      call fetch_rows(grid, height, grid%first_row - 1 + [0, one - 1], beyond(:, :one))
      call fetch_rows(grid, height, grid%last_row + 1 + [0, one - 1], beyond(:, 2:1 + one))
      periodic = grid%boundary == boundary_periodic
      !$omp parallel do default(none) shared(grid, height, slope_x, slope_y, beyond, periodic) &
      !$omp private(i, east, row, south, north, west, per_dx, per_dy)
      do j = 1, grid%rows()
         row = grid%first_row - 1 + j
         call neighbours(periodic, grid%ny, row, south, north, per_dy)
         do i = 1, grid%nx
            call neighbours(periodic, grid%nx, i, west, east, per_dx)
            slope_x(i, j) = (height(east, j) - height(west, j))*per_dx/grid%dx
         end do
         ! On a free map a row at the rim is its own neighbour.
         south = merge(j, j - 1, south == row)
         north = merge(j, j + 1, north == row)
         do i = 1, grid%nx
            slope_y(i, j) = (height_in(i, north) - height_in(i, south))*per_dy/grid%dy
         end do
      end do

   contains

      !> Height of a cell in a row of this process, or in the one before or behind.
      pure real(dp) function height_in(i, j)
         integer, intent(in) :: i, j

         if (j == 0) then
            height_in = beyond(i, 1)
         else if (j > size(height, 2)) then
            height_in = beyond(i, 2)
         else
            height_in = height(i, j)
         end if
      end function height_in

   end subroutine central_slopes

   !> The two cells from which the slope at cell `i` of `n` is taken, and one over their distance in
   !> cells.
   elemental subroutine neighbours(periodic, n, i, before, behind, per_distance)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      integer, intent(in) :: i                   !! from 1
      integer, intent(out) :: before, behind
      real(dp), intent(out) :: per_distance

      before = i - 1
      behind = i + 1
      per_distance = 0.5_dp
      if (i > 1 .and. i < n) return
      if (periodic) then
         before = modulo(i - 2, n) + 1
         behind = modulo(i, n) + 1
      else
         before = max(i - 1, 1)
         behind = min(i + 1, n)
         per_distance = 1.0_dp/max(behind - before, 1)
      end if
   end subroutine neighbours

   !> Slopes of the trigonometric polynomial through a periodic map. They are exact for a surface
   !> without waves shorter than two cells, and oscillate around kinks. Nyquist modes have no slope
   !> at the cells. Collective.
   subroutine spectral_slopes(grid, height, slope_x, slope_y, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)        !! m, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_x(:, :)      !! dH/dx, of the same shape
      real(dp), intent(out) :: slope_y(:, :)      !! dH/dy, of the same shape
      type(error_type), allocatable, intent(out) :: error
      type(transform_shape_type) :: shape
      type(row_column_type) :: transform
      type(gradient_type) :: gradient
      integer :: j

      if (grid%boundary /= boundary_periodic) then
         call fail(error, error_input, 'spectral slopes need boundary = ''periodic''')
         return
      end if
      shape = shape_on_grid(grid, 2)
      shape%inputs = 1
      call new_row_column(transform, shape, 1, error)
      if (allocated(error)) return
      gradient%grid = grid
      do j = 1, grid%rows()
         call transform%forward_row(1, j, height(:, j))
      end do
      call transform%columns_through(gradient)
      do j = 1, grid%rows()
         call transform%backward_row(1, j, slope_x(:, j))
         call transform%backward_row(2, j, slope_y(:, j))
      end do
      call transform%destroy()
   end subroutine spectral_slopes

   !> Multiply a row of a block of columns with i k, and the factor of the inverse transform.
   subroutine multiply(self, first, j, modes)
      class(gradient_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number along x of modes(1, :)
      integer, intent(in) :: j                     !! position along y, from 0
      complex(dp), intent(inout) :: modes(:, :)    !! [block, 2]
      real(dp) :: factor, k(2)
      integer :: i

      factor = 1.0_dp/self%grid%cells()
      k(2) = 0.0_dp
      if (.not. is_nyquist(j + 1, self%grid%ny)) k(2) = wave_number(j + 1, self%grid%ny, self%grid%ly)
      do i = 1, block
         k(1) = 0.0_dp
         if (2*(first + i - 1) < self%grid%nx) k(1) = wave_number(first + i, self%grid%nx, self%grid%lx)
         modes(i, :) = cmplx(-factor*k*aimag(modes(i, 1)), factor*k*real(modes(i, 1)), dp)
      end do
   end subroutine multiply

end module surface_slopes
