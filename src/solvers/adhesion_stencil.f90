!> A stencil of 5 x 5 cells that fits the stiffness B of an adhesive contact at short waves.
!>
!> Its symbol is sum_ab weight(a, b) cos(a kx) cos(b ky) with a, b = 0 to 2 and wave numbers per cell. The
!> weights minimise the sum of (symbol/B - 1)^2/k over the wave vectors with a length k above `band`. The stencil
!> therefore fits any solid and any shape of cells. For a half-space with square cells the symbol is between 0.8 and 1.3
!> times B (between 0.75 and 1.6 if cells are twice as long as wide).
module adhesion_stencil
   use adhesion_symbols, only : adhesion_symbols_type
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, pi
   use dense_factors, only : factor, solve_factors
   implicit none
   private

   public :: add_stencil, band, fit_stencil, radius, stencil_symbol

   integer, parameter :: radius = 2                     !! cells of the stencil on each side of its centre
   integer, parameter :: terms = (radius + 1)**2
   integer, parameter :: samples = 128                  !! wave numbers for the fit in each direction
   real(dp), parameter :: band = pi/16.0_dp             !! least wave number per cell that is fitted
   !> Part of the first diagonal entry that is added to all, because a grid may have fewer waves than weights.
   real(dp), parameter :: ridge = 1e-10_dp

contains

   !> Fit the weights of the stencil for a grid of mx by my cells to the symbols that this process has. Collective.
   subroutine fit_stencil(symbols, modes, mx, my, weights)
      type(adhesion_symbols_type), intent(in) :: symbols
      integer, intent(in) :: modes(2)                   !! wave numbers along x of this process: first, last
      integer, intent(in) :: mx, my
      real(dp), intent(out) :: weights(0:radius, 0:radius)
      real(dp), allocatable :: sums(:)
      real(dp) :: matrix(terms, terms), right(terms), column(terms*(terms + 1)), term(terms), kx, ky
      integer :: i, j, k, size_of_sums

      ! One process forms the sums of each wave number along x, and all processes add them in the same order.
      size_of_sums = size(column)*(mx/2 + 1)
      allocate (sums(size_of_sums), source=0.0_dp)
      do i = modes(1), modes(2)
         if (modulo(i, max(1, mx/samples)) /= 0) cycle
         column(:) = 0.0_dp
         do j = 0, my/2, max(1, my/samples)
            kx = 2.0_dp*pi*i/mx
            ky = 2.0_dp*pi*j/my
            if (hypot(kx, ky) < band) cycle
            term(:) = reshape(waves(kx, ky, mx, my), [terms])/symbols%stiffness(i, j)
            do k = 1, terms
               column(terms*(k - 1) + 1:terms*k) = column(terms*(k - 1) + 1:terms*k) &
                  + term*term(k)/hypot(kx, ky)
            end do
            column(terms**2 + 1:) = column(terms**2 + 1:) + term/hypot(kx, ky)
         end do
         sums(size(column)*i + 1:size(column)*(i + 1)) = column
      end do
      sums(:) = global_sum(sums)
      column(:) = sum(reshape(sums, [size(column), mx/2 + 1]), dim=2)
      matrix(:, :) = reshape(column(:terms**2), [terms, terms])
      right(:) = column(terms**2 + 1:)
      do k = 1, terms
         matrix(k, k) = matrix(k, k) + ridge*matrix(1, 1) + tiny(1.0_dp)
      end do
      call factor(matrix, 1)
      call solve_factors(matrix, right)
      weights(:, :) = reshape(right, [radius + 1, radius + 1])
   end subroutine fit_stencil

   !> cos(a kx) cos(b ky); 0 along a side of a single cell, for a > 0 or b > 0.
   pure function waves(kx, ky, mx, my) result(values)
      real(dp), intent(in) :: kx, ky
      integer, intent(in) :: mx, my
      real(dp) :: values(0:radius, 0:radius)
      integer :: a, b

      do b = 0, radius
         do a = 0, radius
            values(a, b) = cos(a*kx)*cos(b*ky)
            if ((mx == 1 .and. a > 0) .or. (my == 1 .and. b > 0)) values(a, b) = 0.0_dp
         end do
      end do
   end function waves

   !> The symbol of a stencil at wave numbers per cell.
   pure function stencil_symbol(weights, kx, ky) result(value)
      real(dp), intent(in) :: weights(0:radius, 0:radius)
      real(dp), intent(in) :: kx, ky
      real(dp) :: value
      integer :: a, b

      value = 0.0_dp
      do b = 0, radius
         do a = 0, radius
            value = value + weights(a, b)*cos(a*kx)*cos(b*ky)
         end do
      end do
   end function stencil_symbol

   !> Add to a row the stencil's product, from the rows around it on a periodic grid.
   pure subroutine add_stencil(weights, below2, below1, row, above1, above2, product)
      real(dp), intent(in) :: weights(0:radius, 0:radius)
      real(dp), intent(in), contiguous :: below2(:), below1(:), row(:), above1(:), above2(:)
      real(dp), intent(inout), contiguous :: product(:)
      real(dp) :: next(1 - radius:size(row) + radius, radius), w(0:radius, 0:radius), one, two
      integer :: i, n

      n = size(row)
      ! cos(a kx) is the mean of two cells at the distances a and -a, each of which gets half of the weight.
      w(:, :) = weights
      w(1:, :) = 0.5_dp*w(1:, :)
      w(:, 1:) = 0.5_dp*w(:, 1:)

      ! Sums over each column of five cells, with the weights for its own cell and for cells one and two away.
      do i = 1, n
         one = below1(i) + above1(i)
         two = below2(i) + above2(i)
         product(i) = product(i) + (w(0, 0)*row(i) + w(0, 1)*one + w(0, 2)*two)
         next(i, 1) = w(1, 0)*row(i) + w(1, 1)*one + w(1, 2)*two
         next(i, 2) = w(2, 0)*row(i) + w(2, 1)*one + w(2, 2)*two
      end do
      do i = 1, radius
         next(1 - i, :) = next(modulo(-i, n) + 1, :)
         next(n + i, :) = next(modulo(i - 1, n) + 1, :)
      end do
      do i = 1, n
         product(i) = product(i) + ((next(i - 1, 1) + next(i + 1, 1)) + (next(i - 2, 2) + next(i + 2, 2)))
      end do
   end subroutine add_stencil

end module adhesion_stencil
