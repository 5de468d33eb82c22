!> The edge of a free map: what lies beyond it is left out of the contact.
!>
!> Outside the given map the road is at its lowest, and what moves off the map is lost. That is
!> right as long as the points at the edge lie well below the contact.
module map_edge
   use parallel, only : global_min, global_sum
   use precision, only : dp
   use regular_grid, only : boundary_free, grid_type
   use text_tools, only : to_text
   implicit none
   private

   public :: look_at_edge

   real(dp), parameter :: well_below = 0.1_dp     !! least gap of a moving edge over the rms height

   integer, parameter, public :: edge_clear = 0   !! `state` of `look_at_edge`
   integer, parameter, public :: edge_near = 1
   integer, parameter, public :: edge_touches = 2

contains

   !> Look at the cells at the edge: those that enter or leave within a step, one at least.
   subroutine look_at_edge(grid, adhesive, pressure, gap, move_x, move_y, rms_height, state, message)
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: adhesive                !! contact is where the gap is zero, not where P > 0
      real(dp), intent(in) :: pressure(:, :)         !! Pa, [nx, ny]
      real(dp), intent(in) :: gap(:, :)              !! m, [nx, ny]
      real(dp), intent(in) :: move_x, move_y         !! of the road in the step, m
      real(dp), intent(in) :: rms_height             !! of the road, m
      integer, intent(inout) :: state                !! what was found so far; only worse is told
      character(:), allocatable, intent(inout) :: message   !! a line is added; without the time
      real(dp) :: least
      integer :: i, j, touching, wx, wy

      if (grid%boundary /= boundary_free) return
      wx = min(1 + ceiling(min(abs(move_x)/grid%dx, real(grid%nx, dp))), grid%nx)
      wy = min(1 + ceiling(min(abs(move_y)/grid%dy, real(grid%ny, dp))), grid%ny)
      touching = 0
      least = huge(1.0_dp)
      do j = 1, grid%ny
         if (j <= wy .or. j > grid%ny - wy) then
            touching = touching + count(merge(gap(:, j) <= 0.0_dp, pressure(:, j) > 0.0_dp, adhesive))
            least = min(least, minval(gap(:, j)))
         else
            do i = 1, grid%nx
               if (i > wx .and. i <= grid%nx - wx) cycle
               if (merge(gap(i, j) <= 0.0_dp, pressure(i, j) > 0.0_dp, adhesive)) touching = touching + 1
               least = min(least, gap(i, j))
            end do
         end if
      end do
      touching = global_sum(touching)
      least = global_min(least)
      if (touching > 0 .and. state < edge_touches) then
         state = edge_touches
         call tell(to_text(touching)//' cells at the edge of the free map touch; what touches beyond '// &
            'the map is left out: a larger map is needed')
      else if (abs(move_x) + abs(move_y) > 0.0_dp .and. least < well_below*rms_height &
         .and. state < edge_near) then
         state = edge_near
         call tell('points enter or leave the free map only '//to_text(least)// &
            ' m below the contact, with an rms height of '//to_text(rms_height)// &
            ' m: they must lie well below it, a larger map is needed')
      end if

   contains

      !> Add a line.
      subroutine tell(line)
         character(*), intent(in) :: line

         if (len(message) > 0) message = message//new_line('a')
         message = message//line
      end subroutine tell

   end subroutine look_at_edge

end module map_edge
