!> Products with a symbol that is computed for each mode when it is needed, instead of read from a table.
!>
!> This works for a scalar solid on a periodic grid. The results equal those with the table of module
!> `fft_conv` to the last bit. It saves memory but takes longer, and is meant for operators that are seldom
!> used.
module computed_symbol
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, pi
   use kernels, only : kernel_type
   use omp_lib, only : omp_get_thread_num
   use regular_grid, only : grid_type
   use row_column_double, only : block, multiplier_type, row_column_type
   implicit none
   private

   public :: columns_computed

   !> The multiplier that a transform applies to the modes.
   type, extends(multiplier_type) :: computed_symbol_type
      type(grid_type) :: grid
      type(kernel_type) :: kernel
      logical :: inverse = .false.         !! multiply by 1/symbol (0 where it is 0)
      !> Sums of the quadratic form, by wave number along x: [block, blocks]
      real(dp), pointer, contiguous :: sums(:, :) => null()
      !> Factors of the block that a thread multiplies: [block, 0:ny/2, 0:threads - 1]
      real(dp), pointer, contiguous :: factors(:, :, :) => null()
   contains
      procedure :: multiply
   end type computed_symbol_type

contains

   !> The middle part of a product, between the transforms of the rows forward and back: transform the columns, multiply
   !> by the symbol, and transform the columns back.
   subroutine columns_computed(transform, grid, kernel, inverse, form)
      type(row_column_type), intent(inout) :: transform
      type(grid_type), intent(in) :: grid            !! periodic
      type(kernel_type), intent(in) :: kernel        !! of one component
      logical, intent(in) :: inverse                 !! multiply by 1/symbol
      real(dp), intent(out), optional :: form        !! p.(symbol p) over the cells
      type(computed_symbol_type) :: symbol
      real(dp), allocatable, target :: sums(:, :), factors(:, :, :)
      real(dp) :: weight(block)
      integer :: b, i, mode

      allocate (sums(block, (transform%longest + 1)/block), source=0.0_dp)
      symbol%grid = grid
      symbol%kernel = kernel
      symbol%inverse = inverse
      symbol%sums => sums
      allocate (factors(block, 0:grid%ny/2, 0:transform%threads - 1))
      symbol%factors => factors
      call transform%columns_through(symbol)
      if (.not. present(form)) return
      if (grid%shared) sums = reshape(global_sum(reshape(sums, [size(sums)])), shape(sums))
      form = 0.0_dp
      do b = 1, size(sums, 2)
         do i = 1, block
            mode = (b - 1)*block + i - 1
            weight(i) = merge(1.0_dp, 2.0_dp, mode == 0 .or. 2*mode == grid%nx)
         end do
         form = form + sum(weight*sums(:, b))
      end do
   end subroutine columns_computed

   !> Multiply a row of a block of columns by the symbol, with the factor of the inverse transform. The symbol is even in
   !> the wave number along y, so that it is computed for the first half of the rows and kept for the second.
   subroutine multiply(self, first, j, modes)
      class(computed_symbol_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number along x of modes(1, :)
      integer, intent(in) :: j                     !! position along y
      complex(dp), intent(inout) :: modes(:, :)    !! [block, 1]
      integer :: i, k

      k = min(j, self%grid%ny - j)
      associate (factor => self%factors(:, k, omp_get_thread_num()), sums => self%sums(:, first/block + 1))
         if (j == k) call compute_factors(self, first, j, factor)
         do i = 1, min(block, self%grid%nx/2 - first + 1)
            sums(i) = sums(i) + factor(i)*(real(modes(i, 1))**2 + aimag(modes(i, 1))**2)
            modes(i, 1) = factor(i)*modes(i, 1)
         end do
      end associate
   end subroutine multiply

   !> Compute the factors of a row of a block of columns.
   pure subroutine compute_factors(self, first, j, factors)
      class(computed_symbol_type), intent(in) :: self
      integer, intent(in) :: first, j
      real(dp), intent(out) :: factors(block)
      real(dp) :: cells, qy, a(3)
      integer :: i

      cells = real(self%grid%nx, dp)*self%grid%ny
      qy = 2.0_dp*pi*(j/self%grid%ly)
      do i = 1, min(block, self%grid%nx/2 - first + 1)
         a = self%kernel%tensor(2.0_dp*pi*((first + i - 1)/self%grid%lx), qy)
         factors(i) = a(1)/cells
         if (self%inverse .and. abs(factors(i)) > 0.0_dp) factors(i) = 1.0_dp/(factors(i)*cells**2)
      end do
   end subroutine compute_factors

end module computed_symbol
