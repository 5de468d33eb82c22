!> Products with a symbol that is computed for each block of columns when it is needed, instead of read from a table.
!>
!> This works for a scalar solid on a periodic grid. The results equal those with the table of module
!> `fft_conv` to the last bit. It saves memory but takes longer, and is meant for operators that are seldom
!> used.
module computed_symbol
   use asperity_precision, only : dp
   use kernels, only : kernel_type
   use regular_grid, only : grid_type
   use row_column_double, only : symbol_source_type
   implicit none
   private

   public :: computed_symbol_type

   !> The symbols of a solid.
   type, extends(symbol_source_type) :: computed_symbol_type
      type(grid_type) :: grid                !! periodic
      type(kernel_type) :: kernel            !! of one component
   contains
      procedure :: compute
   end type computed_symbol_type

contains

   !> Compute the symbols of a block of columns, with the factor of the inverse transform. The wave numbers beyond the last
   !> one, which complete the last block, have the symbol 0.
   subroutine compute(self, first, symbols)
      class(computed_symbol_type), intent(in) :: self
      integer, intent(in) :: first                   !! wave number along x of symbols(:, 0)
      real(dp), intent(out) :: symbols(0:, 0:)       !! [0:ny/2, block], m/Pa
      real(dp) :: row(0:size(symbols, 2) - 1, 1)
      integer :: j, last

      last = min(size(symbols, 2) - 1, self%grid%nx/2 - first)
      do j = 0, self%grid%ny/2
         call self%kernel%grid_row(self%grid, first, j, row(:last, :))
         symbols(j, :last) = row(:last, 1)/(real(self%grid%nx, dp)*self%grid%ny)
         symbols(j, last + 1:) = 0.0_dp
      end do
   end subroutine compute

end module computed_symbol
