!> The displacement of the road under the rubber, split into whole cells and a part of a cell.
!>
!> A displacement that differs from whole cells by less than 1e-9 of a cell counts as whole.
module road_shift
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: shift_in_cells, shift_type

   real(dp), parameter :: whole_within = 1.0e-9_dp    !! cells

   !> A displacement of the road in cells.
   type :: shift_type
      integer :: whole(2) = 0                         !! whole cells along x and y; modulo a period
      real(dp) :: part(2) = 0.0_dp                    !! the rest, -1/2 to 1/2
      !> Row of the map, from 0, that lies under the first row of this process after the whole cells. It may lie
      !> outside the map.
      integer :: first = 0
   contains
      procedure :: is_whole
   end type shift_type

contains

   !> Convert a displacement in metres to cells.
   pure function shift_in_cells(grid, displacement) result(shift)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: displacement(2)         !! m
      type(shift_type) :: shift

      call split(grid%boundary == boundary_periodic, [grid%nx, grid%ny], displacement/[grid%dx, grid%dy], &
         shift%whole, shift%part)
      shift%first = grid%first_row - 1 - shift%whole(2)
   end function shift_in_cells

   !> Is the road displaced by whole cells?
   pure logical function is_whole(self)
      class(shift_type), intent(in) :: self

      is_whole = .not. any(abs(self%part) > 0.0_dp)
   end function is_whole

   !> Split a shift into whole cells and a part of a cell; whole cells modulo `n` on a period.
   elemental subroutine split(periodic, n, cells, whole, part)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      real(dp), intent(in) :: cells
      integer, intent(out) :: whole
      real(dp), intent(out) :: part              !! -1/2 to 1/2; exactly 0 if the shift counts as whole
      real(dp) :: nearest_whole

      nearest_whole = anint(cells)
      part = cells - nearest_whole
      if (abs(part) <= whole_within + 4.0_dp*spacing(cells)) part = 0.0_dp
      if (periodic) then
         whole = int(modulo(nearest_whole, real(n, dp)))
      else
         whole = int(max(-2.0_dp*n, min(2.0_dp*n, nearest_whole)))
      end if
   end subroutine split

end module road_shift
