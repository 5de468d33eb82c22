!> The coarse level of the normal solver: block means on a grid with about 1/8 of the cells in each direction.
!>
!> It has two purposes, each at the cost of transforms of 1/64 of the size:
!> * the low wave numbers of the preconditioner (module schur_preconditioner);
!> * a prediction of p.A p, with which a step length is chosen before any transform of full size.
!>
!> If processes share the rows of the grid, each sums over its own rows of blocks. A level of many blocks is
!> divided among the processes in the same way. A level of few blocks is copied: every process gets the sums of
!> all blocks (`share_blocks`) and does the same work on them, because this takes less time than the exchanges
!> of a divided level. Sums over the blocks are added in the order of the rows of blocks, so that both ways
!> have the same results.
!>
!> On a free grid there are blocks beyond the edges of the map, too (`margin`): the solid goes on there, and the
!> preconditioner extends the residual to it. Cells are counted from the map, so that those beyond it have the numbers
!> up to 0, and those from nx + 1 on. Blocks are counted from the outermost one.
!>
!> Restriction (block sums over the mean block size) and prolongation (piecewise constant) are adjoint
!> up to a factor, so that the preconditioner stays symmetric for any numbers of cells.
module coarse_level
   use asperity_parallel, only : gather_rows
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use field_sums, only : added, row_totals
   use kernels, only : kernel_type
   use asperity_precision, only : dp, pi, sp
   use regular_grid, only : block_cells, boundary_periodic, grid_type, new_grid
   use row_sharing, only : new_row_sharing, owners_on_grid, row_sharing_type
   implicit none
   private

   public :: coarse_level_type, edge_rows, inner_rows, new_coarse_level

   integer, parameter :: usual = int(block_cells)    !! cells of most blocks along a side
   integer, parameter :: blocks_per_margin = 8       !! blocks of a free grid along its longer side for one beyond its edges ...
   integer, parameter :: most_beyond = 4             !! ... of which there are no more than these
   real(dp), parameter :: many_blocks = 16384.0_dp   !! least number of blocks for which the level is divided

   !> The coarse level of a grid. A variable of this type must not be copied.
   type :: coarse_level_type
      type(grid_type) :: outer                     !! the grid with its margin, whole on every process
      integer :: margin(2) = 0                     !! cells beyond each edge, along x and y
      integer :: columns(2) = 0                    !! first and last column with the margin
      integer :: rows(2) = 0                       !! first and last row of this process with the margin
      integer :: nx = 0, ny = 0                    !! blocks
      real(dp) :: cells = 1.0_dp                   !! cells of a block, on average
      real(dp) :: h = 0.0_dp                       !! side of a square cell of the same area, m
      type(kernel_type) :: kernel                  !! normal response of the solid
      integer, allocatable :: block_x(:)           !! block of a cell along x, (columns(1):columns(2))
      integer, allocatable :: first_x(:)           !! first column of a block, [nx]
      integer, allocatable :: sizes_x(:)           !! cells of a block along x, [nx]
      integer :: strips(2) = 0                     !! first and last row of blocks of the map on this process ...
      integer :: all_strips(2) = 0                 !! ... the same with the margin ...
      integer :: held(2) = 0                       !! ... and of those whose numbers it has: its own or all
      type(row_sharing_type) :: sharing            !! of the rows of blocks where the level is divided
      integer, allocatable :: first_y(:)           !! first row of a block among those of this process, [ny + 1]
      real(dp), allocatable :: mean(:, :)          !! block means, (nx, held(1):held(2))
      logical, private :: even = .false.           !! all blocks have the usual number of columns
      logical, private :: copied = .false.         !! all processes hold the sums of all blocks
      real(dp), private :: fine_symbol = 0.0_dp    !! symbol of A for waves of the size of a block
      type(convolution_type), private :: normal
   contains
      generic :: sum_blocks => sum_blocks_single, sum_blocks_double
      procedure, private :: sum_blocks_single, sum_blocks_double
      procedure :: add_blocks
      procedure :: spread_blocks
      procedure :: share_blocks
      procedure :: block_totals
      procedure :: block_sum
      procedure :: evenness
      procedure :: predict_form
      procedure :: transforms
      procedure :: destroy
   end type coarse_level_type

contains

   !> Make the coarse level of a grid. Collective where processes share the rows.
   subroutine new_coarse_level(self, grid, kernel, error, beyond)
      type(coarse_level_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel      !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: beyond      !! blocks beyond each edge; default: see `blocks_beyond`
      type(grid_type) :: blocks
      integer :: counts(2), more(2)

      counts = grid%blocks()
      more = blocks_beyond(grid)
      if (present(beyond)) more = beyond
      self%margin = more*nint(real([grid%nx, grid%ny], dp)/counts)
      self%outer = new_grid(grid%nx + 2*self%margin(1), grid%ny + 2*self%margin(2), &
         grid%lx + 2*self%margin(1)*grid%dx, grid%ly + 2*self%margin(2)*grid%dy, grid%boundary)
      self%nx = counts(1) + 2*more(1)
      self%ny = counts(2) + 2*more(2)
      self%cells = self%outer%cells()/(real(self%nx, dp)*self%ny)
      self%h = grid%cell_side()
      self%kernel = kernel
      self%fine_symbol = kernel%compliance(2.0_dp*pi/(block_cells*self%h))
      ! A block of very oblong cells is much longer than the waves that its mean does not contain.
      if (grid%very_oblong()) self%fine_symbol = kernel%compliance(2.0_dp*pi/(block_cells*min(grid%dx, grid%dy)))

      call divide_columns(self, grid, counts(1), more(1))
      call divide_rows(self, grid, counts(2), more(2))
      allocate (self%mean(self%nx, self%held(1):self%held(2)), source=0.0_dp)
      blocks = new_grid(self%nx, self%ny, self%outer%lx, self%outer%ly, grid%boundary)
      call new_convolution(self%normal, blocks, kernel, error, sharing=self%sharing)
   end subroutine new_coarse_level

   !> Blocks beyond each edge of a grid, along x and y.
   pure function blocks_beyond(grid) result(more)
      type(grid_type), intent(in) :: grid
      integer :: more(2)

      more = 0
      if (grid%boundary == boundary_periodic .or. grid%very_oblong()) return
      more = min(max(nint(maxval(grid%blocks())/real(blocks_per_margin, dp)), 1), most_beyond)
      where ([grid%nx, grid%ny] == 1) more = 0
   end function blocks_beyond

   !> Divide the columns into blocks.
   pure subroutine divide_columns(self, grid, blocks, beyond)
      type(coarse_level_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: blocks                !! of the map
      integer, intent(in) :: beyond                !! blocks beyond each edge
      integer :: i

      self%columns = [1 - self%margin(1), grid%nx + self%margin(1)]
      allocate (self%block_x(self%columns(1):self%columns(2)))
      do i = self%columns(1), self%columns(2)
         if (i < 1) then
            self%block_x(i) = (i - self%columns(1))*beyond/self%margin(1) + 1
         else if (i > grid%nx) then
            self%block_x(i) = beyond + blocks + (i - grid%nx - 1)*beyond/self%margin(1) + 1
         else
            self%block_x(i) = beyond + int(int(i - 1, kind=8)*blocks/grid%nx) + 1
         end if
      end do
      allocate (self%first_x(self%nx), self%sizes_x(self%nx), source=0)
      do i = self%columns(2), self%columns(1), -1
         self%first_x(self%block_x(i)) = i
         self%sizes_x(self%block_x(i)) = self%sizes_x(self%block_x(i)) + 1
      end do
      self%even = all(self%sizes_x == usual)
   end subroutine divide_columns

   !> Divide the rows into blocks, and the rows of blocks among the processes. The margin belongs to the processes that hold
   !> the rows at the edges.
   subroutine divide_rows(self, grid, blocks, beyond)
      type(coarse_level_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: blocks                !! rows of blocks of the map
      integer, intent(in) :: beyond                !! rows of blocks beyond each edge
      integer :: owner(grid%ny), starts(blocks + 1)
      logical :: divided
      integer :: height, j

      height = 0
      if (beyond > 0) height = self%margin(2)/beyond
      owner = owners_on_grid(grid)
      starts = [(grid%strip_start(j), j=1, blocks + 1)]
      ! Rows of blocks of the map whose first row is among the rows of this process.
      self%strips = beyond + [count(starts(:blocks) < grid%first_row) + 1, count(starts(:blocks) <= grid%last_row)]
      self%all_strips = self%strips
      self%rows = [1, grid%rows()]
      if (grid%rows() > 0 .and. grid%first_row == 1) then
         self%all_strips(1) = 1
         self%rows(1) = 1 - self%margin(2)
      end if
      if (grid%rows() > 0 .and. grid%last_row == grid%ny) then
         self%all_strips(2) = self%ny
         self%rows(2) = grid%rows() + self%margin(2)
      end if
      self%first_y = [[(1 - (beyond + 1 - j)*height, j=1, beyond)], starts, [(grid%ny + 1 + j*height, j=1, beyond)]] &
         - grid%first_row + 1

      divided = grid%shared .and. real(self%nx, dp)*self%ny >= many_blocks
      self%copied = grid%shared .and. .not. divided
      self%held = merge(self%all_strips, [1, self%ny], divided)
      call new_row_sharing(self%sharing, [spread(owner(1), 1, beyond), owner(starts(:blocks)), &
         spread(owner(grid%ny), 1, beyond)], divided)
   end subroutine divide_rows

   !> Form the sums over the blocks along x of values in single precision.
   pure subroutine sum_blocks_single(self, column, blocks)
      class(coarse_level_type), intent(in) :: self
      real(sp), contiguous, intent(in) :: column(:)    !! sums over the rows of a row of blocks, [columns]
      real(dp), contiguous, intent(out) :: blocks(:)   !! [nx]

      blocks(:) = 0.0_dp
      call self%add_blocks(column, blocks)
   end subroutine sum_blocks_single

   !> Add the sums over the blocks along x to those of other rows.
   pure subroutine add_blocks(self, column, blocks)
      class(coarse_level_type), intent(in) :: self
      real(sp), contiguous, intent(in) :: column(:)    !! sums over the rows of a row of blocks, [columns]
      real(dp), contiguous, intent(inout) :: blocks(:) !! [nx]
      integer :: b, first

      if (self%even) then
         call add_even_blocks(self%nx, column, blocks)
         return
      end if
      first = 1
      do b = 1, self%nx
         associate (n => self%sizes_x(b))
            blocks(b) = blocks(b) + sum(real(column(first:first + n - 1), dp))
            first = first + n
         end associate
      end do
   end subroutine add_blocks

   !> Give each cell of a row the number of its block.
   pure subroutine spread_blocks(self, blocks, first, row)
      class(coarse_level_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: blocks(:)    !! [nx]
      integer, intent(in) :: first                     !! column of the first cell
      real(sp), contiguous, intent(out) :: row(first:)
      integer :: i

      if (self%even .and. size(row) == usual*self%nx) then
         call spread_even_blocks(self%nx, blocks, row)
      else
         row(:) = [(real(blocks(self%block_x(i)), sp), i=first, ubound(row, 1))]
      end if
   end subroutine spread_blocks

   !> Give each cell of a row of blocks of the usual size the number of its block.
   pure subroutine spread_even_blocks(n, blocks, row)
      integer, intent(in) :: n
      real(dp), intent(in) :: blocks(n)
      real(sp), intent(out) :: row(usual, n)
      integer :: b

      do b = 1, n
         row(:, b) = real(blocks(b), sp)
      end do
   end subroutine spread_even_blocks

   !> Add the sums over blocks of the usual size. The additions are written out, because the compiler then forms the sums of
   !> several blocks at once.
   pure subroutine add_even_blocks(n, column, blocks)
      integer, intent(in) :: n
      real(sp), intent(in) :: column(usual, n)
      real(dp), intent(inout) :: blocks(n)
      integer :: b

      !$omp simd
      do b = 1, n
         blocks(b) = blocks(b) &
            + (((real(column(1, b), dp) + column(5, b)) + (real(column(3, b), dp) + column(7, b))) &
            + ((real(column(2, b), dp) + column(6, b)) + (real(column(4, b), dp) + column(8, b))))
      end do
   end subroutine add_even_blocks

   !> Form the sums over the blocks along x of values in double precision.
   pure subroutine sum_blocks_double(self, column, blocks)
      class(coarse_level_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: column(:)
      real(dp), contiguous, intent(out) :: blocks(:)
      integer :: b, first

      first = 1
      do b = 1, self%nx
         blocks(b) = sum(column(first:first + self%sizes_x(b) - 1))
         first = first + self%sizes_x(b)
      end do
   end subroutine sum_blocks_double

   !> Send the numbers for each block, which a process has for its own rows of blocks, to all processes that hold
   !> these rows. Collective.
   subroutine share_blocks(self, values)
      class(coarse_level_type), intent(in) :: self
      real(dp), intent(inout) :: values(:, :)          !! [nx, held rows]

      if (self%copied) values(:, :) = gather_rows(values(:, self%all_strips(1):self%all_strips(2)))
   end subroutine share_blocks

   !> The average number of cells of a block over that of each block in a row of blocks.
   pure function evenness(self, jb)
      class(coarse_level_type), intent(in) :: self
      integer, intent(in) :: jb                        !! row of blocks
      real(dp) :: evenness(self%nx)

      evenness = self%cells/(self%sizes_x*real(self%first_y(jb + 1) - self%first_y(jb), dp))
   end function evenness

   !> Totals over the rows of blocks, added in their order. Collective.
   function block_totals(self, rows) result(totals)
      class(coarse_level_type), intent(in) :: self
      real(dp), intent(in) :: rows(:, :)               !! [sums, held rows]
      real(dp) :: totals(size(rows, 1))

      if (self%sharing%shared) then
         totals = row_totals(rows)
      else
         totals = added(rows)
      end if
   end function block_totals

   !> Sum of one number per block over all blocks. Collective.
   function block_sum(self, numbers) result(total)
      class(coarse_level_type), intent(in) :: self
      real(dp), intent(in) :: numbers(:, :)            !! [nx, held rows]
      real(dp) :: total
      real(dp) :: rows(1, size(numbers, 2)), totals(1)
      integer :: j

      do j = 1, size(numbers, 2)
         rows(1, j) = sum(numbers(:, j))
      end do
      totals = self%block_totals(rows)
      total = totals(1)
   end function block_sum

   !> Estimate of d.A d over the cells, G = 1, from the block means of d. Collective.
   function predict_form(self, squares) result(form)
      class(coarse_level_type), intent(inout) :: self
      real(dp), intent(in) :: squares                  !! d.d over the cells
      real(dp) :: form

      call self%normal%quadratic_form(self%mean, form)
      form = self%cells*form + max(squares - self%cells*self%block_sum(self%mean**2), 0.0_dp)*self%fine_symbol
   end function predict_form

   !> Transforms done so far on this level, in units of a transform of the whole grid.
   pure function transforms(self) result(count)
      class(coarse_level_type), intent(in) :: self
      real(dp) :: count

      count = real(self%normal%ffts, dp)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(coarse_level_type), intent(inout) :: self

      call self%normal%destroy()
   end subroutine destroy

   !> The rows of a block whose neighbouring rows belong to it, too: first, last, distance.
   pure function inner_rows(coarse, jb) result(which)
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb
      integer :: which(3)

      which = [coarse%first_y(jb) + 1, coarse%first_y(jb + 1) - 2, 1]
   end function inner_rows

   !> The first and the last row of a block, which may be the same: first, last, distance.
   pure function edge_rows(coarse, jb) result(which)
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb
      integer :: which(3)

      which = [coarse%first_y(jb), coarse%first_y(jb + 1) - 1, 1]
      which(3) = max(which(2) - which(1), 1)
   end function edge_rows

end module coarse_level
