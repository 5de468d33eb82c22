!> The active cells of a field, on which a solver works: blocks of 16 cells of a row, joined to runs.
!>
!> A block is active if one of its cells has pressure, or a gap below a level. All other cells of the work fields
!> are zero, so that a pass over the runs has the same effect as one over the whole grid.
!>
!> Around the active blocks lies a rim, to which a preconditioner extends the residual cell by cell. It consists of wide
!> blocks: 16 cells by all rows of a coarse block, which are called a wide row. A wide block is in use if an active block
!> is at most as far away as the rim is wide, about 16 cells. Beyond the rim the preconditioner has one number per coarse
!> block, so that a wider rim saves no iterations. With half as many rows a contact of 8192 x 8192 cells, of which three
!> quarters touch, takes half as many iterations again.
!>
!> The wide blocks extend over the margin of a free grid (module `coarse_level`), too.
module active_blocks
   use asperity_parallel, only : on_any_process
   use asperity_precision, only : dp, sp
   use coarse_level, only : coarse_level_type
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: active_blocks_type, new_active_blocks

   integer, parameter :: width = 16            !! cells of a block
   integer, parameter, public :: usual_rim(2) = [1, 2]   !! wide blocks of the rim along x, and wide rows along y

   !> The blocks of a grid.
   type :: active_blocks_type
      integer, private :: nx = 0
      integer, private :: rows = 0                 !! of this process
      integer, private :: threads = 1
      logical, private :: periodic = .false.
      integer, private :: rim(2) = 0               !! wide blocks along x, and wide rows along y
      integer, private :: strips(2) = 0            !! first and last wide row of this process
      integer, private :: columns(2) = 0           !! first and last column, with the margin
      integer, private :: all_rows(2) = 0          !! first and last row of this process, with the margin
      integer, private :: before = 0               !! wide blocks of the margin before the first column of the map
      integer, allocatable, private :: first_y(:)  !! first row of each wide row, and the end
      integer, allocatable :: runs(:)              !! number of a row's active runs
      integer, allocatable :: first(:, :)          !! their first cells
      integer, allocatable :: last(:, :)           !! their last cells
      integer, allocatable :: wide_runs(:)         !! the same for the wide rows
      integer, allocatable :: wide_first(:, :)
      integer, allocatable :: wide_last(:, :)
      real(dp), allocatable, private :: least(:, :)   !! least gap of each block, m
      logical, allocatable, private :: loaded(:, :)   !! blocks that hold P > 0
      logical, allocatable, private :: live(:, :)     !! active blocks
      logical, allocatable, private :: wide(:, :)     !! wide blocks in use
   contains
      procedure :: clear
      procedure :: survey_row
      procedure :: list_runs
      procedure :: list_wide_runs
      procedure :: same_runs
   end type active_blocks_type

contains

   !> Make the blocks of a grid. None of them is active yet.
   subroutine new_active_blocks(self, grid, coarse, rim, threads)
      type(active_blocks_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(coarse_level_type), intent(in) :: coarse   !! whose rows of blocks are the wide rows
      integer, intent(in) :: rim(2)                !! wide blocks of the rim along x, and wide rows along y
      integer, intent(in) :: threads
      integer :: blocks, wide_blocks

      self%nx = grid%nx
      self%rows = grid%rows()
      self%periodic = grid%boundary == boundary_periodic
      self%strips = coarse%all_strips
      self%columns = coarse%columns
      self%all_rows = coarse%rows
      self%first_y = coarse%first_y
      self%rim = rim
      self%threads = threads
      blocks = (self%nx + width - 1)/width
      self%before = (coarse%margin(1) + width - 1)/width
      wide_blocks = self%before + (coarse%columns(2) + width - 1)/width
      allocate (self%least(blocks, self%rows), self%loaded(blocks, self%rows))
      allocate (self%live(blocks, self%rows), self%wide(wide_blocks, coarse%ny), source=.false.)
      allocate (self%first(blocks, self%rows), self%last(blocks, self%rows))
      allocate (self%runs(self%rows), source=0)
      allocate (self%wide_first(wide_blocks, coarse%ny), self%wide_last(wide_blocks, coarse%ny))
      allocate (self%wide_runs(coarse%ny), source=0)
   end subroutine new_active_blocks

   !> Deactivate all blocks, and set the work fields to zero. The residuals are zero already outside the active blocks: at first
   !> everywhere (module `zeroed_memory`), and later because `list_runs` sets them to zero in blocks that it deactivates.
   subroutine clear(self, residual, direction, search, before)
      class(active_blocks_type), intent(inout) :: self
      real(sp), intent(inout) :: residual(self%columns(1) - 1:, self%all_rows(1) - 1:)   !! all cells and one more
      real(sp), intent(inout) :: direction(:, :)   !! [nx, rows]
      real(sp), intent(inout) :: search(self%columns(1) - 1:, self%all_rows(1) - 1:)
      real(sp), intent(inout), optional :: before(self%columns(1) - 1:, self%all_rows(1) - 1:)   !! another residual
      logical :: another
      integer :: j, k

      another = present(before)
      !$omp parallel do default(none) shared(self, residual, direction, search, before, another) private(j, k) &
      !$omp num_threads(self%threads)
      do j = self%all_rows(1) - 1, self%all_rows(2) + 1
         search(:, j) = 0.0_sp
         if (j < 1 .or. j > self%rows) cycle
         direction(:, j) = 0.0_sp
         do k = 1, merge(self%runs(j), 0, any(self%live(:, j)))
            residual(self%first(k, j):self%last(k, j), j) = 0.0_sp
            if (another) before(self%first(k, j):self%last(k, j), j) = 0.0_sp
         end do
      end do
      self%live = .false.
      self%wide = .false.
   end subroutine clear

   !> Find out which blocks of a row have pressure, and the least gap of each block.
   subroutine survey_row(self, everywhere, j, pressure, gap, lowest)
      class(active_blocks_type), intent(inout) :: self
      logical, intent(in) :: everywhere            !! look for pressure outside the active blocks, too
      integer, intent(in) :: j                     !! number of the row
      real(dp), intent(in) :: pressure(self%nx), gap(self%nx)   !! Pa and m
      real(dp), intent(out) :: lowest              !! least gap of the row, m
      integer :: b, first, last

      lowest = huge(1.0_dp)
      do b = 1, size(self%least, 1)
         first = (b - 1)*width + 1
         last = min(b*width, self%nx)
         if (last - first + 1 == width) then
            self%least(b, j) = least_of_block(gap(first))
         else
            self%least(b, j) = minval(gap(first:last))
         end if
         lowest = min(lowest, self%least(b, j))
         ! There is no pressure where the solver has not worked.
         self%loaded(b, j) = .false.
         if (.not. (everywhere .or. self%live(b, j))) cycle
         if (last - first + 1 == width) then
            self%loaded(b, j) = most_of_block(pressure(first)) > 0.0_dp
         else
            self%loaded(b, j) = maxval(pressure(first:last)) > 0.0_dp
         end if
      end do
   end subroutine survey_row

   !> The least value of a whole block. The loop has a fixed length, for which the compiler needs no rest.
   pure function least_of_block(values) result(least)
      real(dp), intent(in) :: values(width)
      real(dp) :: least
      integer :: i

      least = values(1)
      !$omp simd reduction(min:least)
      do i = 1, width
         least = min(least, values(i))
      end do
   end function least_of_block

   !> The largest value of a whole block.
   pure function most_of_block(values) result(most)
      real(dp), intent(in) :: values(width)
      real(dp) :: most
      integer :: i

      most = values(1)
      !$omp simd reduction(max:most)
      do i = 1, width
         most = max(most, values(i))
      end do
   end function most_of_block

   !> List the runs of blocks that have a cell with P > 0 or a gap below the level. Set the work fields to zero in
   !> blocks that are no longer active.
   subroutine list_runs(self, level, residual, direction, before)
      class(active_blocks_type), intent(inout) :: self
      real(dp), intent(in) :: level                !! m
      real(sp), intent(inout) :: residual(self%columns(1) - 1:, self%all_rows(1) - 1:)   !! all cells and one more
      real(sp), intent(inout) :: direction(:, :)   !! [nx, rows]
      real(sp), intent(inout), optional :: before(self%columns(1) - 1:, self%all_rows(1) - 1:)   !! another residual
      integer :: b, j, first, last, n
      logical :: another, now, joined

      another = present(before)
      !$omp parallel do default(none) shared(self, level, residual, direction, before, another) &
      !$omp private(b, j, first, last, n, now, joined) num_threads(self%threads)
      do j = 1, self%rows
         n = 0
         joined = .false.
         do b = 1, size(self%least, 1)
            now = self%loaded(b, j) .or. self%least(b, j) < level
            first = (b - 1)*width + 1
            last = min(b*width, self%nx)
            if (now) then
               if (.not. joined) then
                  n = n + 1
                  self%first(n, j) = first
               end if
               self%last(n, j) = last
            else if (self%live(b, j)) then
               residual(first:last, j) = 0.0_sp
               if (another) before(first:last, j) = 0.0_sp
               direction(first:last, j) = 0.0_sp
            end if
            self%live(b, j) = now
            joined = now
         end do
         self%runs(j) = n
      end do
   end subroutine list_runs

   !> List the runs of wide blocks. Set the search direction to zero in those that are no longer in use.
   subroutine list_wide_runs(self, search)
      class(active_blocks_type), intent(inout) :: self
      real(sp), intent(inout) :: search(self%columns(1) - 1:, self%all_rows(1) - 1:)   !! all cells and one more
      logical, allocatable :: used(:, :)
      integer :: b, j, k, first, last, n
      logical :: before

      call find_used_blocks(self, used)
      !$omp parallel do default(none) shared(self, search, used) private(b, j, k, first, last, n, before) &
      !$omp num_threads(self%threads)
      do j = 1, size(used, 2)
         n = 0
         before = .false.
         do b = 1, size(used, 1)
            first = max((b - self%before - 1)*width + 1, self%columns(1))
            last = min((b - self%before)*width, self%columns(2))
            if (used(b, j)) then
               if (.not. before) then
                  n = n + 1
                  self%wide_first(n, j) = first
               end if
               self%wide_last(n, j) = last
            else if (self%wide(b, j) .and. j >= self%strips(1) .and. j <= self%strips(2)) then
               do k = self%first_y(j), self%first_y(j + 1) - 1
                  search(first:last, k) = 0.0_sp
               end do
            end if
            self%wide(b, j) = used(b, j)
            before = used(b, j)
         end do
         self%wide_runs(j) = n
      end do
   end subroutine list_wide_runs

   !> Do two wide rows have the same runs?
   pure logical function same_runs(self, one, other)
      class(active_blocks_type), intent(in) :: self
      integer, intent(in) :: one, other

      associate (n => self%wide_runs(one))
         same_runs = self%wide_runs(other) == n
         if (same_runs) same_runs = all(self%wide_first(:n, one) == self%wide_first(:n, other)) &
            .and. all(self%wide_last(:n, one) == self%wide_last(:n, other))
      end associate
   end function same_runs

   !> Find the wide blocks that hold an active block or lie in its rim, on all processes. Collective.
   subroutine find_used_blocks(self, used)
      type(active_blocks_type), intent(in) :: self
      logical, allocatable, intent(out) :: used(:, :)  !! [blocks, wide rows]
      logical, allocatable :: stretched(:, :)
      integer :: b, j, k

      allocate (used, mold=self%wide)
      allocate (stretched, mold=self%wide)
      !$omp parallel do default(none) shared(self, used) private(j, k) num_threads(self%threads)
      do j = 1, size(used, 2)
         used(:, j) = .false.
         if (j < self%strips(1) .or. j > self%strips(2)) cycle
         do k = max(self%first_y(j), 1), min(self%first_y(j + 1) - 1, self%rows)
            associate (over_map => used(self%before + 1:self%before + size(self%live, 1), j))
               over_map = over_map .or. self%live(:, k)
            end associate
         end do
      end do
      ! The rim of a block may reach rows of other processes.
      used(:, :) = on_any_process(used)
      !$omp parallel default(none) shared(self, used, stretched) private(b, j) num_threads(self%threads)
      !$omp do
      do j = 1, size(used, 2)
         stretched(:, j) = dilated(used(:, j), self%rim(1), self%periodic)
      end do
      !$omp end do
      !$omp do
      do b = 1, size(used, 1)
         used(b, :) = dilated(stretched(b, :), self%rim(2), self%periodic)
      end do
      !$omp end parallel
   end subroutine find_used_blocks

   !> The blocks of a line that are set, or are close enough to one that is.
   pure function dilated(line, distance, periodic)
      logical, intent(in) :: line(:)
      integer, intent(in) :: distance
      logical, intent(in) :: periodic              !! the line is closed
      logical :: dilated(size(line))
      integer :: b, turn, left, right

      ! The blocks since the last one that is set, in both directions; a periodic line is passed twice.
      dilated = line
      left = distance
      right = distance
      do turn = 1, merge(2, 1, periodic)
         do b = 1, size(line)
            left = merge(0, left + 1, line(b))
            if (left <= distance) dilated(b) = .true.
         end do
         do b = size(line), 1, -1
            right = merge(0, right + 1, line(b))
            if (right <= distance) dilated(b) = .true.
         end do
      end do
   end function dilated

end module active_blocks
