!> The coarse level of the normal solver: block means on a grid of about 1/8 of the cells each way.
!>
!> It serves two ends, each at the cost of transforms of 1/64 of the size:
!> * the low wave numbers of the preconditioner M ~ |q|. A local stencil c0 + c1 (-Laplacian) fits |q|
!>   well where q is large; what is missing below pi/16 a cell is added from the block means;
!> * a prediction of p.A p, with which a step length is chosen before any transform of full size.
!>
!> Restriction (block sums over the mean block size) and prolongation (piecewise constant) are adjoint
!> up to a factor, so that the preconditioner stays symmetric for any numbers of cells.
module coarse_level
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_normal_operator, new_symbol_operator
   use asperity_precision, only : dp, pi
   use regular_grid, only : grid_type, new_grid
   implicit none
   private

   public :: coarse_level_type, new_coarse_level

   real(dp), parameter, public :: stencil_c0 = 1.0_dp       !! of the local stencil
   real(dp), parameter, public :: stencil_c1 = 1.80063_dp   !! the same, cells of unit size
   real(dp), parameter :: ratio = 8.0_dp                    !! cells of a block along a side, if square
   real(dp), parameter :: band = pi/16.0_dp                 !! wave number a cell, below which it acts

   !> Not to be copied.
   type :: coarse_level_type
      integer :: nx = 0, ny = 0                    !! blocks
      real(dp) :: cells = 1.0_dp                   !! cells of a block, on average
      real(dp) :: wx = 0.0_dp, wy = 0.0_dp         !! weights of the stencil along x and y
      integer, allocatable :: block_x(:)           !! block of a cell along x, [nx of the grid]
      integer, allocatable :: last_x(:)            !! last cell of a block along x, [nx]
      integer, allocatable :: first_y(:)           !! first row of a block, [ny + 1]
      real(dp), allocatable :: mean(:, :)          !! block means, [nx, ny]
      real(dp), allocatable :: share(:, :)         !! part of a block that takes part, [nx, ny]
      real(dp), allocatable :: correction(:, :)    !! of the preconditioner, [nx, ny]
      real(dp), private :: fine_symbol = 0.0_dp    !! of A at the size of a block
      type(convolution_type), private :: normal
      type(convolution_type), private :: missing
   contains
      procedure :: set_means
      procedure :: set_shares
      procedure :: precondition
      procedure :: predict_form
      procedure :: transforms
      procedure :: destroy
   end type coarse_level_type

contains

   !> Make the coarse level of a grid.
   subroutine new_coarse_level(self, grid, poisson, error)
      type(coarse_level_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      type(error_type), allocatable, intent(out) :: error
      type(grid_type) :: blocks
      real(dp), allocatable :: symbol(:, :)
      real(dp) :: h, qx, qy, q, q_least
      integer :: i, j

      h = sqrt(grid%dx*grid%dy)
      if (grid%ny == 1) h = grid%dx
      if (grid%nx == 1) h = grid%dy
      ! Blocks about as long as wide, in metres, of whole cells.
      self%nx = min(max(1, nint(grid%lx/(ratio*h))), grid%nx)
      self%ny = min(max(1, nint(grid%ly/(ratio*h))), grid%ny)
      self%cells = real(grid%nx, dp)*grid%ny/(real(self%nx, dp)*self%ny)
      self%wx = merge(0.0_dp, stencil_c1*(h/grid%dx)**2, grid%nx == 1)
      self%wy = merge(0.0_dp, stencil_c1*(h/grid%dy)**2, grid%ny == 1)
      self%fine_symbol = (1.0_dp - poisson)*ratio*h/(2.0_dp*pi)

      allocate (self%block_x(grid%nx), self%last_x(self%nx), self%first_y(self%ny + 1))
      do i = 1, grid%nx
         self%block_x(i) = int(int(i - 1, kind=8)*self%nx/grid%nx) + 1
         self%last_x(self%block_x(i)) = i
      end do
      do j = 1, self%ny + 1
         self%first_y(j) = int((int(j - 1, kind=8)*grid%ny + self%ny - 1)/self%ny) + 1
      end do
      allocate (self%mean(self%nx, self%ny), self%share(self%nx, self%ny))
      allocate (self%correction(self%nx, self%ny))

      blocks = new_grid(self%nx, self%ny, grid%lx, grid%ly, grid%boundary)
      call new_normal_operator(self%normal, blocks, poisson, error)
      if (allocated(error)) return

      allocate (symbol(0:self%nx/2, 0:self%ny/2))
      q_least = pi*h/max(merge(0.0_dp, grid%lx, grid%nx == 1), merge(0.0_dp, grid%ly, grid%ny == 1), h)
      do j = 0, self%ny/2
         do i = 0, self%nx/2
            qx = 2.0_dp*pi*i/grid%lx
            qy = 2.0_dp*pi*j/grid%ly
            q = max(hypot(qx, qy)*h, q_least)
            symbol(i, j) = 0.0_dp
            if (q < band) symbol(i, j) = q*stencil(band, 0.0_dp)/band - stencil(qx*h, qy*h)
         end do
      end do
      call new_symbol_operator(self%missing, self%nx, self%ny, symbol, error)

   contains

      !> Symbol of the stencil at a wave vector a (square) cell, where it is small.
      pure function stencil(kx, ky) result(value)
         real(dp), intent(in) :: kx, ky
         real(dp) :: value

         value = stencil_c0 + stencil_c1*(4.0_dp - 2.0_dp*cos(kx) - 2.0_dp*cos(ky))
      end function stencil

   end subroutine new_coarse_level

   !> Set the block means of a row of blocks.
   pure subroutine set_means(self, block_y, column)
      class(coarse_level_type), intent(inout) :: self
      integer, intent(in) :: block_y           !! the row of blocks
      real(dp), intent(in) :: column(:)        !! sums over its rows of cells, [nx of the grid]

      call sum_blocks(self, column, self%mean(:, block_y))
   end subroutine set_means

   !> Set the shares of a row of blocks.
   pure subroutine set_shares(self, block_y, column)
      class(coarse_level_type), intent(inout) :: self
      integer, intent(in) :: block_y
      real(dp), intent(in) :: column(:)        !! numbers of cells that take part

      call sum_blocks(self, column, self%share(:, block_y))
   end subroutine set_shares

   !> Sums over the blocks, divided by the mean number of cells.
   pure subroutine sum_blocks(self, column, blocks)
      type(coarse_level_type), intent(in) :: self
      real(dp), intent(in) :: column(:)
      real(dp), intent(inout) :: blocks(:)
      integer :: b, i, first
      real(dp) :: total

      first = 1
      do b = 1, self%nx
         total = 0.0_dp
         do i = first, self%last_x(b)
            total = total + column(i)
         end do
         blocks(b) = total/self%cells
         first = self%last_x(b) + 1
      end do
   end subroutine sum_blocks

   !> From the block means of a residual: `correction`, to be added to the stencil's result.
   subroutine precondition(self)
      class(coarse_level_type), intent(inout) :: self

      call self%missing%apply(self%mean, self%correction)
   end subroutine precondition

   !> Estimate of d.A d over the cells, G = 1, from the block means of d.
   function predict_form(self, squares) result(form)
      class(coarse_level_type), intent(inout) :: self
      real(dp), intent(in) :: squares                  !! d.d over the cells
      real(dp) :: form

      call self%normal%quadratic_form(self%mean, form)
      form = self%cells*form &
         + max(squares - self%cells*sum(self%mean**2), 0.0_dp)*self%fine_symbol
   end function predict_form

   !> Transforms done on this level, counted as those of the full grid.
   pure function transforms(self) result(count)
      class(coarse_level_type), intent(in) :: self
      real(dp) :: count

      count = real(self%normal%ffts + self%missing%ffts, dp)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(coarse_level_type), intent(inout) :: self

      call self%normal%destroy()
      call self%missing%destroy()
   end subroutine destroy

end module coarse_level
