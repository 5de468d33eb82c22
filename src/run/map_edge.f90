!> The edge of a free map: what lies beyond it is left out of the contact.
!>
!> Outside the given map the road is at its lowest, and what moves off the map is lost. That is
!> right as long as the points at the edge lie well below the contact: by a tenth of what the rubber is
!> displaced by under the load, and, where it adheres, by some ranges of the attraction. (A tenth of the
!> rms height is enough, too; but that of a long map on which a summit travels says nothing.)
module map_edge
   use contact_rule, only : touches
   use asperity_parallel, only : global_min, global_sum
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, grid_type
   use text_tools, only : to_text
   implicit none
   private

   public :: look_at_edge

   real(dp), parameter :: well_below = 0.1_dp     !! least gap of a moving edge over depth or rms height
   real(dp), parameter :: out_of_reach = 5.0_dp   !! least gap of a moving edge over the range of adhesion

   integer, parameter, public :: edge_clear = 0   !! `state` of `look_at_edge`
   integer, parameter, public :: edge_near = 1
   integer, parameter, public :: edge_touches = 2

contains

   !> Look at the cells at the edge: those that enter or leave within a step, one at least.
   subroutine look_at_edge(grid, range, pressure, displacement, gap, move_x, move_y, rms_height, &
      state, message)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: range                  !! of adhesion, m; 0: there is none
      real(dp), intent(in) :: pressure(:, :)         !! Pa, [nx, ny]
      real(dp), intent(in) :: displacement(:, :)     !! U_z, m, [nx, ny]
      real(dp), intent(in) :: gap(:, :)              !! m, [nx, ny]
      real(dp), intent(in) :: move_x, move_y         !! of the road in the step, m
      real(dp), intent(in) :: rms_height             !! of the road, m
      integer, intent(inout) :: state                !! what was found so far; only worse is told
      character(:), allocatable, intent(inout) :: message   !! a line is added; without the time
      real(dp) :: depth, least, near, reach
      logical :: adhesive
      integer :: i, j, touching, wx, wy

      if (grid%boundary /= boundary_free) return
      adhesive = range > 0.0_dp
      wx = min(1 + ceiling(min(abs(move_x)/grid%dx, real(grid%nx, dp))), grid%nx)
      wy = min(1 + ceiling(min(abs(move_y)/grid%dy, real(grid%ny, dp))), grid%ny)
      touching = 0
      least = huge(1.0_dp)
      do j = 1, grid%ny
         if (j <= wy .or. j > grid%ny - wy) then
            touching = touching + count(touches(adhesive, pressure(:, j), gap(:, j)))
            least = min(least, minval(gap(:, j)))
         else
            do i = 1, grid%nx
               if (i > wx .and. i <= grid%nx - wx) cycle
               if (touches(adhesive, pressure(i, j), gap(i, j))) touching = touching + 1
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
      else if (abs(move_x) + abs(move_y) > 0.0_dp .and. state < edge_near) then
         reach = out_of_reach*range
         if (least >= max(well_below*rms_height, reach)) return
         depth = depth_of_contact(pressure, displacement)
         near = max(well_below*min(depth, rms_height), reach)
         if (least >= near) return
         state = edge_near
         call tell('points enter or leave the free map only '//to_text(least)// &
            ' m below the rubber, which is displaced by '//to_text(depth)//' m under the load: less than '// &
            to_text(near)//' m is near, a larger map is needed')
      end if

   contains

      !> Add a line.
      subroutine tell(line)
         character(*), intent(in) :: line

         if (len(message) > 0) message = message//new_line('a')
         message = message//line
      end subroutine tell

   end subroutine look_at_edge

   !> Mean displacement under the load, m: weighted by the pressure where that is positive.
   function depth_of_contact(pressure, displacement) result(depth)
      real(dp), intent(in) :: pressure(:, :), displacement(:, :)
      real(dp) :: depth
      real(dp) :: load, work
      integer :: i, j

      load = 0.0_dp
      work = 0.0_dp
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            load = load + max(pressure(i, j), 0.0_dp)
            work = work + max(pressure(i, j), 0.0_dp)*displacement(i, j)
         end do
      end do
      load = global_sum(load)
      work = global_sum(work)
      depth = max(work/max(load, tiny(1.0_dp)), 0.0_dp)
   end function depth_of_contact

end module map_edge
