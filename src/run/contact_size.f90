!> Checks whether the cells are small enough to resolve the patches of contact.
!>
!> If a contact has few cells, the error of its approach depends on the position of its summit among the cells
!> (`tools/campaign_contact.py hertz 600`). For a single round patch the error is up to 28 % if it is two to three
!> cells across, up to 1.3 % at four to five and a half, and less than 1 % beyond; for a line it is up to 2.1 % at
!> four cells and up to 1.0 % at five. On a road the positions of the patches differ, and their errors average out. The
!> error of a patch is about proportional to the inverse square of the cells across it, and that of the mean of n
!> patches to the inverse root of n, so that n patches need fewer cells by the fourth root of n. At least three cells
!> are needed: the contact area of a road is then still 10 % or more above that of a fine
!> grid (`tools/campaign_contact.py sizes`).
!>
!> The width of the patches is computed from the runs of neighbouring cells that touch: a round patch of the
!> diameter d has a mean chord of pi/4 d. The direction with the fewer cells counts. If no patch begins along one of
!> the directions, the patches extend over the whole map: they are lines.
module contact_size
   use contact_rule, only : touches
   use asperity_precision, only : dp, pi
   use field_sums, only : row_totals
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : fetch_beside
   use text_tools, only : to_text
   implicit none
   private

   public :: measured_patches, size_warning, watch_contact_size

   !> Mean size of the patches of a contact.
   type, public :: patch_size_type
      real(dp) :: across = 0.0_dp                    !! cells across a patch; 0: nothing touches
      real(dp) :: needed = 1.0_dp                    !! cells across that such patches need
   end type patch_size_type

   real(dp), parameter :: needed_by_many = 3.0_dp    !! cells across a patch
   real(dp), parameter :: needed_by_line = 5.0_dp    !! a single line
   real(dp), parameter :: needed_by_one = 5.5_dp     !! a single round patch

contains

   !> Keep the best resolved patches at the end of each phase, and warn at the end of the run if not even these are wide
   !> enough. A warning before would be too early, because a contact may be small while it grows.
   subroutine watch_contact_size(grid, patches, ends, widest, message)
      type(grid_type), intent(in) :: grid
      type(patch_size_type), intent(in) :: patches   !! of the contact now
      logical, intent(in) :: ends                    !! the run ends here
      type(patch_size_type), intent(inout) :: widest !! the best resolved ones so far
      character(:), allocatable, intent(out) :: message
      character(:), allocatable :: beginning          ! not allocated: that for the present contact

      message = ''
      if (patches%across/patches%needed >= widest%across/widest%needed) then
         widest = patches
      else
         beginning = 'even the best resolved patches of contact at the end of a phase are only '
      end if
      if (ends) message = size_warning(grid, widest, beginning)
   end subroutine watch_contact_size

   !> A warning if the patches are not wide enough; '' otherwise, and if nothing touches.
   function size_warning(grid, patches, beginning) result(message)
      type(grid_type), intent(in) :: grid
      type(patch_size_type), intent(in) :: patches
      character(*), intent(in), optional :: beginning   !! of the message, instead of that for the present contact
      character(:), allocatable :: message
      character(:), allocatable :: consequence, start

      message = ''
      start = 'patches of contact are only '
      if (present(beginning)) start = beginning
      if (patches%across >= patches%needed .or. .not. patches%across > 0.0_dp) return
      if (grid%cells() < 1.5_dp) return              ! a single cell

      consequence = 'the approach can be more than 1 % wrong, and area and pressures depend on the cells'
      if (.not. patches%needed > needed_by_many) &
         consequence = 'the contact area is more than 10 % too large, and approach and pressures depend on the cells'
      ! The cells are counted in whole tenths, so that they are fewer than needed in the message, too; the factor is
      ! rounded up.
      message = start//tenths(patches%across - 0.05_dp)//' cells across on average: below '// &
         tenths(patches%needed)//' '//consequence//'; use at least '// &
         tenths(patches%needed/patches%across + 0.05_dp)// &
         ' times as many cells per length on the same road; a smaller map around the contact saves memory'
   end function size_warning

   !> Convert a number to a text with one decimal place.
   pure function tenths(number) result(text)
      real(dp), intent(in) :: number
      character(:), allocatable :: text

      text = to_text(nint(10.0_dp*number)/10.0_dp)
   end function tenths

   !> Mean number of cells across a patch of contact, in the direction where it is smaller, and the number that such
   !> patches need. It is a huge number if all cells touch. Collective.
   function measured_patches(grid, adhesive, pressure, gap) result(patches)
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: adhesive
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      type(patch_size_type) :: patches
      logical, allocatable :: row(:), below(:)
      real(dp), allocatable :: rows(:, :), pressure_beside(:, :), gap_beside(:, :)
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
      patches = size_from_runs(row_totals(rows), grid%ny == 1)
   end function measured_patches

   !> Size of patches from the cells in contact and the runs of such cells along x and along y.
   pure function size_from_runs(sums, profile) result(patches)
      real(dp), intent(in) :: sums(3)                !! cells, runs along x, runs along y
      logical, intent(in) :: profile                 !! the grid has a single row
      type(patch_size_type) :: patches
      real(dp) :: runs, number

      if (.not. sums(1) > 0.0_dp) return

      runs = merge(sums(2), maxval(sums(2:)), profile)
      if (.not. runs > 0.0_dp) then
         patches%across = huge(1.0_dp)
      else if (profile .or. .not. minval(sums(2:)) > 0.0_dp) then
         patches%across = sums(1)/runs
         patches%needed = max(needed_by_many, needed_by_line/merge(runs, 1.0_dp, profile)**0.25_dp)
      else
         patches%across = 4.0_dp/pi*sums(1)/runs
         ! Round patches of d cells across have d runs each way and pi/4 d^2 cells.
         number = pi/4.0_dp*sums(2)*sums(3)/sums(1)
         patches%needed = max(needed_by_many, needed_by_one/max(anint(number), 1.0_dp)**0.25_dp)
      end if
   end function size_from_runs

end module contact_size
