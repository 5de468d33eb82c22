!> Are the patches of contact large enough for the cells?
!>
!> Below three cells across a contact is not resolved: the approach of a sphere is wrong by 3 % at three
!> cells, 25 % at one and 55 % at 0.6, and on a rough road the contact area is then 10 % or more above
!> that of a fine grid; at six cells across it is 3 to 8 % above it (tools/campaign_contact.py).
!>
!> The size of the patches follows from the runs of neighbouring cells that touch: a round patch of the
!> diameter d has a mean chord of pi/4 d. The direction in which the patches are fewer cells across
!> counts.
module contact_size
   use contact_rule, only : touches
   use asperity_precision, only : dp, pi
   use field_sums, only : row_totals
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : fetch_beside
   use text_tools, only : to_text
   implicit none
   private

   public :: cells_across, watch_contact_size

   real(dp), parameter :: fewest = 3.0_dp            !! cells across a patch that are enough

contains

   !> At the end of a phase: keep the widest patches so far. At the end of the run: warn if not even
   !> those are wide enough. Earlier in the run the contact may be small: it has to grow from nothing.
   subroutine watch_contact_size(grid, across, ends, widest, message)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: across                 !! `cells_across` now
      logical, intent(in) :: ends                    !! the run ends here
      real(dp), intent(inout) :: widest              !! cells across so far; 0: no contact yet
      character(:), allocatable, intent(out) :: message

      message = ''
      widest = max(widest, across)
      if (.not. ends .or. widest >= fewest .or. .not. widest > 0.0_dp) return
      if (nint(min(grid%cells(), 2.0_dp)) == 1) return
      message = 'patches of contact are only '//to_text(nint(10.0_dp*widest)/10.0_dp)// &
         ' cells across on average: below 3 the contact area, the approach and the pressures depend '// &
         'on the cells; a finer grid is needed'
   end subroutine watch_contact_size

   !> Mean number of cells across a patch of contact, in the direction where they are fewer; 0 where
   !> nothing touches, a huge number where all does. Collective.
   function cells_across(grid, adhesive, pressure, gap) result(across)
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: adhesive
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      real(dp) :: across
      logical, allocatable :: row(:), below(:)
      real(dp), allocatable :: rows(:, :), pressure_beside(:, :), gap_beside(:, :)
      real(dp) :: sums(3)
      integer :: j

      allocate (row(grid%nx), rows(3, grid%rows()), below(grid%nx))
      allocate (pressure_beside(grid%nx, 2), gap_beside(grid%nx, 2))
      call fetch_beside(grid, pressure, pressure_beside)
      call fetch_beside(grid, gap, gap_beside)
      below(:) = grid%row_at(grid%first_row - 1) > 0 &
         .and. touches(adhesive, pressure_beside(:, 1), gap_beside(:, 1))
      do j = 1, grid%rows()
         row(:) = touches(adhesive, pressure(:, j), gap(:, j))
         rows(:, j) = [count(row), count(row(2:) .and. .not. row(:grid%nx - 1)), &
            count(row .and. .not. below)]
         if (row(1) .and. .not. (row(grid%nx) .and. grid%boundary == boundary_periodic)) &
            rows(2, j) = rows(2, j) + 1.0_dp
         below(:) = row
      end do
      sums = row_totals(rows)
      ! sums: cells in contact, and patches that start along x and along y.
      across = merge(huge(1.0_dp), 0.0_dp, sums(1) > 0.0_dp)
      if (sums(2) > 0.0_dp) across = sums(1)/sums(2)
      if (sums(3) > 0.0_dp .and. grid%ny > 1) across = min(across, sums(1)/sums(3))
      if (grid%ny > 1 .and. across < huge(1.0_dp)) across = 4.0_dp/pi*across
   end function cells_across

end module contact_size
