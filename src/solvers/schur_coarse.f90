!> The coarse part of the local model that module schur_preconditioner uses.
!>
!> The model of the inverse operator B ~ |q| (wave numbers per cell) is a stencil of symbol
!>     c0 + c1 (4 - 2 cos kx - 2 cos ky),
!> which fits |q| well where q is large. What is missing below pi/16 per cell is added on the grid of
!> block means (module coarse_level). With c0 = 0.7 the sum of both fits |q| to a factor of 1.8.
!> (With c0 = 1 to a factor of 2.1, which is better where the residual is not extended.)
!>
!> The same grid holds the coarse part of W, an approximate inverse of the model on the cells N off the
!> contact:
!>     w IFFT( symbol FFT( w R p ) ),   w = (share of N in the block)^0.3,   symbol = 1/(B + shift) - om.
!> The shift grows with the part of the grid that is not in N: the coarse functions are cut off there,
!> which would make their eigenvalues too large without it.
!>
!> All numbers were chosen by trials on rough contacts; none of them is critical.
module schur_coarse
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_symbol_operator
   use asperity_precision, only : dp, pi, sp
   use regular_grid, only : grid_type
   use row_column_single, only : new_row_column, row_column_type
   use transform_shape, only : whole_shape
   implicit none
   private

   public :: new_schur_coarse, schur_coarse_type

   real(dp), parameter, public :: stencil_c1 = 1.80063_dp   !! for cells of unit size
   real(dp), parameter, public :: om = 0.2_dp  !! constant part of W
   real(dp), parameter :: band = pi/16.0_dp    !! wave number per cell below which the coarse level acts
   real(dp), parameter :: least_shift = 0.03_dp, contact_shift = 0.7_dp
   real(dp), parameter :: power = 0.3_dp       !! of the share of N in w

   !> The coarse part. Not to be copied.
   type :: schur_coarse_type
      real(dp), private :: cells = 1.0_dp                !! cells of a block
      integer, private :: threads = 1
      real(dp), allocatable, private :: weight(:, :)     !! w of each block
      type(convolution_type), private :: missing         !! what the stencil lacks
      type(row_column_type), private :: transform        !! for W
      real(dp), allocatable, private :: model(:, :)      !! symbol of B
      real(sp), allocatable, private :: symbol(:, :, :)  !! of W, with the factor of the transforms
      real(dp), private :: taken = -1.0_dp               !! part of the grid for which it was made
      integer, private :: products = 0                   !! products with W so far
   contains
      procedure :: add_missing
      procedure :: set_weights
      procedure :: weigh
      procedure :: transforms
      procedure :: destroy
   end type schur_coarse_type

contains

   !> Make the coarse part for a grid of blocks.
   subroutine new_schur_coarse(self, grid, c0, h, blocks, threads, error)
      type(schur_coarse_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: c0                       !! of the stencil
      real(dp), intent(in) :: h                        !! side of a square cell of the same area, m
      integer, intent(in) :: blocks(2)                 !! along x and y
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: symbol(:, :)

      self%cells = grid%cells()/(real(blocks(1), dp)*blocks(2))
      self%threads = merge(1, threads, blocks(1)*blocks(2) < 16384)
      allocate (self%weight(blocks(1), blocks(2)), source=0.0_dp)
      allocate (symbol(0:blocks(1)/2, 0:blocks(2)/2), self%model(0:blocks(1)/2, 0:blocks(2)/2))
      call model_symbols(grid, c0, h, symbol, self%model)
      call new_symbol_operator(self%missing, blocks(1), blocks(2), symbol, error, single=.true.)
      if (allocated(error)) return
      call new_row_column(self%transform, whole_shape(blocks(1), blocks(2), 1), self%threads, error)
      if (allocated(error)) return
      allocate (self%symbol(0:self%transform%longest, 0:blocks(2)/2, 1), source=0.0_sp)
   end subroutine new_schur_coarse

   !> What the coarse level adds to the stencil, and the sum of both, at its wave vectors.
   pure subroutine model_symbols(grid, c0, h, missing, model)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: c0
      real(dp), intent(in) :: h                        !! side of a cell, m
      real(dp), intent(out) :: missing(0:, 0:), model(0:, 0:)
      real(dp) :: qx, qy, q, q_least
      integer :: i, j

      q_least = pi*h/max(merge(0.0_dp, grid%lx, grid%nx == 1), merge(0.0_dp, grid%ly, grid%ny == 1), h)
      do j = 0, ubound(missing, 2)
         do i = 0, ubound(missing, 1)
            qx = 2.0_dp*pi*i*h/grid%lx
            qy = 2.0_dp*pi*j*h/grid%ly
            q = max(hypot(qx, qy), q_least)
            model(i, j) = stencil(qx, qy)
            if (q < band) model(i, j) = q*stencil(band, 0.0_dp)/band
            missing(i, j) = model(i, j) - stencil(qx, qy)
         end do
      end do

   contains

      !> Symbol of the stencil at a wave vector per (square) cell.
      pure function stencil(kx, ky) result(value)
         real(dp), intent(in) :: kx, ky
         real(dp) :: value

         value = c0 + stencil_c1*(4.0_dp - 2.0_dp*cos(kx) - 2.0_dp*cos(ky))
      end function stencil

   end subroutine model_symbols

   !> What the coarse level adds to the stencil, from the sums of a field over the blocks.
   subroutine add_missing(self, sums, addition)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: sums(:, :)
      real(dp), intent(inout) :: addition(:, :)        !! the same for all cells of a block

      call self%missing%apply(sums/self%cells, addition)
   end subroutine add_missing

   !> Prepare W for a set N.
   subroutine set_weights(self, cells_off)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: cells_off(:, :)          !! numbers of cells of N in the blocks
      real(dp) :: taken, shift
      integer :: i, j

      self%weight(:, :) = (cells_off/self%cells)**power
      ! The shift is rounded, so that the symbol is seldom made again.
      taken = nint(32.0_dp*(1.0_dp - sum(cells_off)/(self%cells*size(cells_off))))/32.0_dp
      if (abs(taken - self%taken) <= 0.0_dp) return
      self%taken = taken
      shift = least_shift + contact_shift*taken
      do j = 0, ubound(self%model, 2)
         do i = 0, ubound(self%model, 1)
            self%symbol(i, j, 1) = real(max(1.0_dp/(self%model(i, j) + shift) - om, 0.0_dp) &
               /size(cells_off), sp)
         end do
      end do
   end subroutine set_weights

   !> The coarse part of W p, from the sums of p over the cells of N in the blocks.
   subroutine weigh(self, sums, correction)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: sums(:, :)
      real(dp), intent(inout) :: correction(:, :)      !! the same for all cells of N in a block
      real(dp) :: form
      integer :: j

      !$omp parallel do default(none) shared(self, sums) private(j) num_threads(self%threads)
      do j = 1, size(sums, 2)
         call self%transform%forward_row(1, j, self%weight(:, j)*sums(:, j)/self%cells)
      end do
      call self%transform%columns(self%symbol, 1.0_dp, .false., .true., form)
      !$omp parallel do default(none) shared(self, sums, correction) private(j) num_threads(self%threads)
      do j = 1, size(sums, 2)
         call self%transform%backward_row(1, j, correction(:, j))
         correction(:, j) = self%weight(:, j)*correction(:, j)
      end do
      self%products = self%products + 1
   end subroutine weigh

   !> Transforms done so far, counted as those of the whole grid.
   pure function transforms(self) result(count)
      class(schur_coarse_type), intent(in) :: self
      real(dp) :: count

      count = (real(self%missing%ffts, dp) + 2.0_dp*self%products)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(schur_coarse_type), intent(inout) :: self

      call self%missing%destroy()
      call self%transform%destroy()
   end subroutine destroy

end module schur_coarse
