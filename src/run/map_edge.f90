!> Warns if the contact comes near the edge of a free map.
!>
!> Outside the given map the road has its lowest height, and points that move off the map are lost. This has no effect
!> as long as the points at the edge lie well below the contact: by a tenth of the displacement of the rubber under the
!> load, and, with adhesion, by several ranges of the attraction. A tenth of the rms height is usually sufficient as
!> well, but not on a long map over which a summit travels, because its rms height is not related to the contact.
module map_edge
   use contact_rule, only : touches
   use asperity_precision, only : dp
   use field_sums, only : least_of_rows, row_total, row_totals
   use regular_grid, only : boundary_free, grid_type
   use row_state, only : edge_near, edge_touches, state_type
   use text_tools, only : add_line, to_text
   implicit none
   private

   public :: check_edge

   real(dp), parameter :: well_below = 0.1_dp     !! least gap of a moving edge over depth or rms height
   real(dp), parameter :: beyond_range = 5.0_dp   !! least gap of a moving edge over the range of adhesion

contains

   !> Check the cells at the edge: those that enter or leave within a step, and at least one row and column.
   subroutine check_edge(grid, range, rms_height, move, state, message)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: range                  !! of adhesion, m; 0: there is none
      real(dp), intent(in) :: rms_height             !! of the road, m
      real(dp), intent(in) :: move(2)                !! of the road in the step, m
      type(state_type), intent(inout) :: state       !! `edge` is the worst finding so far; only a worse one is reported
      character(:), allocatable, intent(inout) :: message   !! a line is added; without the time
      real(dp) :: depth, least, near, range_of_edge
      logical :: adhesive
      character(:), allocatable :: cells
      integer :: touching, wx, wy

      if (grid%boundary /= boundary_free) return
      adhesive = range > 0.0_dp
      wx = min(1 + ceiling(min(abs(move(1))/grid%dx, real(grid%nx, dp))), grid%nx)
      wy = min(1 + ceiling(min(abs(move(2))/grid%dy, real(grid%ny, dp))), grid%ny)
      call scan_edge(grid, adhesive, [wx, wy], state, touching, least)
      if (touching > 0 .and. state%edge < edge_touches) then
         state%edge = edge_touches
         cells = to_text(touching)//' cells at the edge of the free map touch'
         if (touching == 1) cells = 'one cell at the edge of the free map touches'
         call add_line(message, cells//'; contact beyond the map is left out: use a larger map')
      else if (any(abs(move) > 0.0_dp) .and. state%edge < edge_near) then
         range_of_edge = beyond_range*range
         if (least >= max(well_below*rms_height, range_of_edge)) return
         depth = depth_of_contact(state%pressure, state%displacement)
         near = max(well_below*min(depth, rms_height), range_of_edge)
         if (least >= near) return
         state%edge = edge_near
         call add_line(message, 'points enter or leave the free map only '//to_text(least)// &
            ' m below the rubber: at least '//to_text(near)//' m are needed, because the load displaces the rubber by '// &
            to_text(depth)//' m; use a larger map')
      end if
   end subroutine check_edge

   !> Count the cells that touch in a frame along the edge of the map, and find the least gap there.
   subroutine scan_edge(grid, adhesive, width, state, touching, least)
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: adhesive
      integer, intent(in) :: width(2)                !! of the frame along x and y, cells
      type(state_type), intent(in) :: state
      integer, intent(out) :: touching               !! cells of the frame that touch
      real(dp), intent(out) :: least                 !! m
      real(dp), allocatable :: rows(:, :)
      logical :: inside(grid%nx)
      integer :: i, j, row

      allocate (rows(2, grid%rows()))
      do j = 1, grid%rows()
         row = grid%first_row + j - 1
         inside = row <= width(2) .or. row > grid%ny - width(2)
         do i = 1, grid%nx
            if (i <= width(1) .or. i > grid%nx - width(1)) inside(i) = .true.
         end do
         rows(1, j) = count(inside .and. touches(adhesive, state%pressure(:, j), state%gap(:, j)))
         rows(2, j) = minval(state%gap(:, j), inside)
      end do
      touching = nint(row_total(rows, 1))
      least = least_of_rows(rows(2, :))
   end subroutine scan_edge

   !> Mean displacement under the load, m: weighted by the pressure where that is positive.
   function depth_of_contact(pressure, displacement) result(depth)
      real(dp), intent(in) :: pressure(:, :), displacement(:, :)
      real(dp) :: depth
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(2)
      integer :: j

      allocate (rows(2, size(pressure, 2)))
      do j = 1, size(pressure, 2)
         rows(:, j) = [sum(max(pressure(:, j), 0.0_dp)), &
            sum(max(pressure(:, j), 0.0_dp)*displacement(:, j))]
      end do
      sums = row_totals(rows)
      depth = max(sums(2)/max(sums(1), tiny(1.0_dp)), 0.0_dp)
   end function depth_of_contact

end module map_edge
