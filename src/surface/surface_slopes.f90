!> Slopes of a height map at the centres of its cells, by central differences.
module surface_slopes
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : fetch_beside
   implicit none
   private

   public :: central_slopes, neighbours

contains

   !> Slopes by central differences, which are of second order. On the rim of a free map the
   !> differences are one-sided. Collective.
   subroutine central_slopes(grid, height, slope_x, slope_y)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)        !! m, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_x(:, :)      !! dH/dx, of the same shape
      real(dp), intent(out) :: slope_y(:, :)      !! dH/dy, of the same shape
      real(dp), allocatable :: beyond(:, :)       !! the rows before the first and behind the last
      integer :: east, i, j, row, south, north, west
      logical :: periodic
      real(dp) :: per_dx, per_dy

      allocate (beyond(grid%nx, 2))
      call fetch_beside(grid, height, beyond)
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

   !> The two cells from whose heights the slope at cell `i` of `n` is computed, and the reciprocal of their
   !> distance in cells.
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

end module surface_slopes
