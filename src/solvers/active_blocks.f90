!> Which cells of a field a solver acts on: blocks of 16 cells of a row, joined to runs.
!>
!> A block is active where a cell of it has pressure or a gap below a level. Work fields are zero
!> elsewhere, so that passes over the runs are passes over the whole.
module active_blocks
   use asperity_precision, only : dp
   implicit none
   private

   public :: active_blocks_type, new_active_blocks

   integer, parameter :: width = 16            !! cells of a block

   !> The blocks of a grid.
   type :: active_blocks_type
      integer, private :: nx = 0, ny = 0
      integer, private :: threads = 1
      integer, allocatable :: runs(:)              !! number of a row's active runs
      integer, allocatable :: first(:, :)          !! their first cells
      integer, allocatable :: last(:, :)           !! their last cells
      real(dp), allocatable, private :: least(:, :)   !! least gap of each block, m
      logical, allocatable, private :: loaded(:, :)   !! blocks that hold P > 0
      logical, allocatable, private :: live(:, :)     !! active blocks
   contains
      procedure :: clear
      procedure :: survey_row
      procedure :: list_runs
   end type active_blocks_type

contains

   !> No block is active.
   subroutine new_active_blocks(self, nx, ny, threads)
      type(active_blocks_type), intent(out) :: self
      integer, intent(in) :: nx, ny                !! cells of the grid
      integer, intent(in) :: threads
      integer :: blocks

      self%nx = nx
      self%ny = ny
      self%threads = threads
      blocks = (nx + width - 1)/width
      allocate (self%least(blocks, ny), self%loaded(blocks, ny))
      allocate (self%live(blocks, ny), source=.false.)
      allocate (self%first(blocks, ny), self%last(blocks, ny), self%runs(ny))
   end subroutine new_active_blocks

   !> Make no block active and zero the work fields: the step, which others use between solves, wholly.
   subroutine clear(self, residual, direction, step)
      class(active_blocks_type), intent(inout) :: self
      real(dp), intent(inout) :: residual(0:, 0:)  !! (0:nx+1, 0:ny+1), the rim is left
      real(dp), intent(inout) :: direction(:, :)   !! [nx, ny]
      real(dp), intent(inout) :: step(:, :)        !! [nx, ny]
      integer :: b, j, first, last

      !$omp parallel do default(none) shared(self, residual, direction, step) &
      !$omp private(b, j, first, last) num_threads(self%threads)
      do j = 1, self%ny
         step(:, j) = 0.0_dp
         do b = 1, size(self%live, 1)
            if (.not. self%live(b, j)) cycle
            first = (b - 1)*width + 1
            last = min(b*width, self%nx)
            residual(first:last, j) = 0.0_dp
            direction(first:last, j) = 0.0_dp
            self%live(b, j) = .false.
         end do
      end do
   end subroutine clear

   !> See which blocks of a row hold pressure, and the least gap of each.
   subroutine survey_row(self, everywhere, j, pressure, gap, lowest)
      class(active_blocks_type), intent(inout) :: self
      logical, intent(in) :: everywhere            !! look for pressure off the active blocks, too
      integer, intent(in) :: j                     !! number of the row
      real(dp), intent(in) :: pressure(self%nx), gap(self%nx)   !! Pa and m
      real(dp), intent(out) :: lowest              !! least gap of the row, m
      integer :: b, first, last, i
      real(dp) :: least, most

      lowest = huge(1.0_dp)
      do b = 1, size(self%least, 1)
         first = (b - 1)*width + 1
         last = min(b*width, self%nx)
         least = gap(first)
         !$omp simd reduction(min:least)
         do i = first + 1, last
            least = min(least, gap(i))
         end do
         self%least(b, j) = least
         lowest = min(lowest, least)
         ! Where the solver did not act, there is no pressure.
         most = 0.0_dp
         if (everywhere .or. self%live(b, j)) then
            !$omp simd reduction(max:most)
            do i = first, last
               most = max(most, pressure(i))
            end do
         end if
         self%loaded(b, j) = most > 0.0_dp
      end do
   end subroutine survey_row

   !> List the runs of blocks that hold a cell with P > 0 or a gap below the level; zero the work fields
   !> in those that left.
   subroutine list_runs(self, level, residual, direction, step)
      class(active_blocks_type), intent(inout) :: self
      real(dp), intent(in) :: level                !! m
      real(dp), intent(inout) :: residual(0:, 0:)  !! (0:nx+1, 0:ny+1)
      real(dp), intent(inout) :: direction(:, :)   !! [nx, ny]
      real(dp), intent(inout) :: step(:, :)        !! [nx, ny]
      integer :: b, j, first, last, n
      logical :: now, before

      !$omp parallel do default(none) shared(self, level, residual, direction, step) &
      !$omp private(b, j, first, last, n, now, before) num_threads(self%threads)
      do j = 1, self%ny
         n = 0
         before = .false.
         do b = 1, size(self%least, 1)
            now = self%loaded(b, j) .or. self%least(b, j) < level
            first = (b - 1)*width + 1
            last = min(b*width, self%nx)
            if (now) then
               if (.not. before) then
                  n = n + 1
                  self%first(n, j) = first
               end if
               self%last(n, j) = last
            else if (self%live(b, j)) then
               residual(first:last, j) = 0.0_dp
               direction(first:last, j) = 0.0_dp
               step(first:last, j) = 0.0_dp
            end if
            self%live(b, j) = now
            before = now
         end do
         self%runs(j) = n
      end do
   end subroutine list_runs

end module active_blocks
