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
!> Restriction (block sums over the mean block size) and prolongation (piecewise constant) are adjoint
!> up to a factor, so that the preconditioner stays symmetric for any numbers of cells.
module coarse_level
   use asperity_parallel, only : gather_rows
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use field_sums, only : added, row_totals
   use kernels, only : kernel_type
   use asperity_precision, only : dp, pi, sp
   use regular_grid, only : block_cells, grid_type, new_grid
   use row_sharing, only : new_row_sharing, owners_on_grid, row_sharing_type
   implicit none
   private

   public :: coarse_level_type, edge_rows, inner_rows, new_coarse_level

   integer, parameter :: usual = int(block_cells)    !! cells of most blocks along a side
   real(dp), parameter :: many_blocks = 16384.0_dp   !! least number of blocks for which the level is divided

   !> The coarse level of a grid. A variable of this type must not be copied.
   type :: coarse_level_type
      integer :: nx = 0, ny = 0                    !! blocks
      real(dp) :: cells = 1.0_dp                   !! cells of a block, on average
      real(dp) :: h = 0.0_dp                       !! side of a square cell of the same area, m
      type(kernel_type) :: kernel                  !! normal response of the solid
      integer, allocatable :: block_x(:)           !! block of a cell along x, [nx of the grid]
      integer, allocatable :: last_x(:)            !! last cell of a block along x, [nx]
      integer :: strips(2) = 0                     !! first and last row of blocks of this process ...
      integer :: held(2) = 0                       !! ... and of those whose numbers it has: its own or all
      type(row_sharing_type) :: sharing            !! of the rows of blocks where the level is divided
      integer, allocatable :: first_y(:)           !! first row of a block among those of this process, [ny + 1]
      real(dp), allocatable :: mean(:, :)          !! block means, (nx, held(1):held(2))
      logical, private :: copied = .false.         !! all processes hold the sums of all blocks
      real(dp), private :: fine_symbol = 0.0_dp    !! symbol of A for waves of the size of a block
      type(convolution_type), private :: normal
   contains
      generic :: sum_blocks => sum_blocks_single, sum_blocks_double
      procedure, private :: sum_blocks_single, sum_blocks_double
      procedure :: share_blocks
      procedure :: block_totals
      procedure :: predict_form
      procedure :: transforms
      procedure :: destroy
   end type coarse_level_type

contains

   !> Make the coarse level of a grid. Collective where processes share the rows.
   subroutine new_coarse_level(self, grid, kernel, error)
      type(coarse_level_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel      !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      type(grid_type) :: blocks
      real(dp) :: h
      integer, allocatable :: owner(:)
      logical :: divided
      integer :: counts(2), i, j

      h = grid%cell_side()
      counts = grid%blocks()
      self%nx = counts(1)
      self%ny = counts(2)
      self%cells = grid%cells()/(real(self%nx, dp)*self%ny)
      self%h = h
      self%kernel = kernel
      self%fine_symbol = kernel%compliance(2.0_dp*pi/(block_cells*h))
      ! A block of very oblong cells is much longer than the waves that its mean does not contain.
      if (grid%very_oblong()) self%fine_symbol = kernel%compliance(2.0_dp*pi/(block_cells*min(grid%dx, grid%dy)))

      allocate (self%block_x(grid%nx), self%last_x(self%nx), self%first_y(self%ny + 1))
      do i = 1, grid%nx
         self%block_x(i) = int(int(i - 1, kind=8)*self%nx/grid%nx) + 1
         self%last_x(self%block_x(i)) = i
      end do
      do j = 1, self%ny + 1
         self%first_y(j) = grid%strip_start(j) - grid%first_row + 1
      end do
      ! Blocks whose first row is among the rows of this process.
      self%strips = [count(self%first_y(:self%ny) < 1) + 1, count(self%first_y(:self%ny) <= grid%rows())]
      divided = grid%shared .and. real(self%nx, dp)*self%ny >= many_blocks
      self%copied = grid%shared .and. .not. divided
      self%held = merge(self%strips, [1, self%ny], divided)
      allocate (self%mean(self%nx, self%held(1):self%held(2)))

      owner = owners_on_grid(grid)
      owner = owner([(grid%strip_start(j), j=1, self%ny)])
      call new_row_sharing(self%sharing, owner, divided)
      blocks = new_grid(self%nx, self%ny, grid%lx, grid%ly, grid%boundary)
      call new_convolution(self%normal, blocks, kernel, error, sharing=self%sharing)
   end subroutine new_coarse_level

   !> Form the sums over the blocks along x of values in single precision.
   pure subroutine sum_blocks_single(self, column, blocks)
      class(coarse_level_type), intent(in) :: self
      real(sp), intent(in) :: column(:)        !! sums over the rows of a row of blocks, [nx of the grid]
      real(dp), intent(out) :: blocks(:)       !! [nx]
      integer :: b, first

      first = 1
      do b = 1, self%nx
         if (self%last_x(b) - first + 1 == usual) then
            blocks(b) = sum_of_block(column(first:self%last_x(b)))
         else
            blocks(b) = sum(real(column(first:self%last_x(b)), dp))
         end if
         first = self%last_x(b) + 1
      end do
   end subroutine sum_blocks_single

   !> The sum of a block of the usual size, for which the compiler needs no loop.
   pure function sum_of_block(values) result(total)
      real(sp), intent(in) :: values(usual)
      real(dp) :: total
      integer :: i

      total = 0.0_dp
      !$omp simd reduction(+:total)
      do i = 1, usual
         total = total + values(i)
      end do
   end function sum_of_block

   !> Form the sums over the blocks along x of values in double precision.
   pure subroutine sum_blocks_double(self, column, blocks)
      class(coarse_level_type), intent(in) :: self
      real(dp), intent(in) :: column(:)
      real(dp), intent(out) :: blocks(:)
      integer :: b, first

      first = 1
      do b = 1, self%nx
         blocks(b) = sum(column(first:self%last_x(b)))
         first = self%last_x(b) + 1
      end do
   end subroutine sum_blocks_double

   !> Send the numbers for each block, which a process has for its own rows of blocks, to all processes that hold
   !> these rows. Collective.
   subroutine share_blocks(self, values)
      class(coarse_level_type), intent(in) :: self
      real(dp), intent(inout) :: values(:, :)          !! [nx, held rows]

      if (self%copied) values(:, :) = gather_rows(values(:, self%strips(1):self%strips(2)))
   end subroutine share_blocks

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

   !> Estimate of d.A d over the cells, G = 1, from the block means of d. Collective.
   function predict_form(self, squares) result(form)
      class(coarse_level_type), intent(inout) :: self
      real(dp), intent(in) :: squares                  !! d.d over the cells
      real(dp) :: form
      real(dp) :: rows(1, self%held(1):self%held(2)), total(1)
      integer :: j

      call self%normal%quadratic_form(self%mean, form)
      do j = self%held(1), self%held(2)
         rows(1, j) = sum(self%mean(:, j)**2)
      end do
      total = self%block_totals(rows)
      form = self%cells*form + max(squares - self%cells*total(1), 0.0_dp)*self%fine_symbol
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
