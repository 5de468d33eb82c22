!> The surface of bilinear patches through a height map, and slopes that are continuous on it.
!>
!> The heights are interpolated bilinearly between the centres of the cells, and the slopes bilinearly between
!> the central differences there. Both are of second order.
module bilinear_map
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic
   use road_rows, only : road_rows_type
   use surface_slopes, only : neighbours
   implicit none
   private

   public :: bilinear_slopes

contains

   !> Height at (i + u, j + v), and its slopes per cell (not per metre).
   pure subroutine bilinear_slopes(map, i, j, u, v, h, h_u, h_v)
      type(road_rows_type), intent(in) :: map   !! heights, m [nx, rows]
      integer, intent(in) :: i, j               !! cell, from 0
      real(dp), intent(in) :: u, v              !! 0 to 1
      real(dp), intent(out) :: h                !! m
      real(dp), intent(out) :: h_u, h_v         !! m per cell
      integer :: east, i0, i1, j0, j1, north, south, unused, west
      real(dp) :: per_x0, per_x1, per_y0, per_y1, w00, w01, w10, w11

      i0 = i + 1
      i1 = next(i, map%grid%nx)
      j0 = j + 1
      j1 = next(j, map%grid%ny)
      associate (periodic => map%grid%boundary == boundary_periodic)
         call neighbours(periodic, map%grid%nx, i0, west, unused, per_x0)
         call neighbours(periodic, map%grid%nx, i1, unused, east, per_x1)
         call neighbours(periodic, map%grid%ny, j0, south, unused, per_y0)
         call neighbours(periodic, map%grid%ny, j1, unused, north, per_y1)
      end associate
      ! From here on, south, north, j0 and j1 are positions in `map%values` and no longer numbers of rows.
      south = map%place(south - 1)
      north = map%place(north - 1)
      j0 = map%place(j0 - 1)
      j1 = map%place(j1 - 1)
      w00 = (1.0_dp - u)*(1.0_dp - v)
      w10 = u*(1.0_dp - v)
      w01 = (1.0_dp - u)*v
      w11 = u*v
      associate (h_0 => map%values)
         h = w00*h_0(i0, j0) + w10*h_0(i1, j0) + w01*h_0(i0, j1) + w11*h_0(i1, j1)
         h_u = per_x0*(w00*(h_0(i1, j0) - h_0(west, j0)) + w01*(h_0(i1, j1) - h_0(west, j1))) &
            + per_x1*(w10*(h_0(east, j0) - h_0(i0, j0)) + w11*(h_0(east, j1) - h_0(i0, j1)))
         h_v = per_y0*(w00*(h_0(i0, j1) - h_0(i0, south)) + w10*(h_0(i1, j1) - h_0(i1, south))) &
            + per_y1*(w01*(h_0(i0, north) - h_0(i0, j0)) + w11*(h_0(i1, north) - h_0(i1, j0)))
      end associate
   end subroutine bilinear_slopes

   !> The number from 1 of the cell that follows the cell with the number `cell` from 0; the first
   !> cell follows the last.
   elemental function next(cell, n) result(i)
      integer, intent(in) :: cell, n
      integer :: i

      i = cell + 2
      if (i > n) i = 1
   end function next

end module bilinear_map
