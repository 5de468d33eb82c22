!> LU factors and inverses of a dense matrix that needs no pivoting, such as one with a positive definite symmetric
!> part.
!>
!> The factorisation proceeds by blocks of columns: the diagonal block and the panel below it are factored, and then the
!> rest of the matrix is updated by matrix products. Threads share the columns of the rest, so that results do
!> not depend on their number.
module dense_factors
   use asperity_precision, only : dp, sp
   implicit none
   private

   public :: factor, invert, solve_factors

   integer, parameter :: block = 48

contains

   !> Replace A by its factors: L with unit diagonal below, U on and above the diagonal.
   subroutine factor(a, threads)
      real(dp), intent(inout), contiguous :: a(:, :)   !! [n, n]
      integer, intent(in) :: threads
      integer :: first, j, k, last, n, next

      n = size(a, 1)
      do first = 1, n, block
         last = min(first + block - 1, n)
         do k = first, last
            a(k + 1:n, k) = a(k + 1:n, k)/a(k, k)
            do j = k + 1, last
               a(k + 1:n, j) = a(k + 1:n, j) - a(k, j)*a(k + 1:n, k)
            end do
         end do
         !$omp parallel do default(none) shared(a, first, last, n) private(j, k, next) num_threads(threads)
         do j = last + 1, n, block
            next = min(j + block - 1, n)
            do k = first, last - 1
               a(k + 1:last, j:next) = a(k + 1:last, j:next) &
                  - spread(a(k + 1:last, k), 2, next - j + 1)*spread(a(k, j:next), 1, last - k)
            end do
            a(last + 1:n, j:next) = a(last + 1:n, j:next) - matmul(a(last + 1:n, first:last), &
               a(first:last, j:next))
         end do
      end do
   end subroutine factor

   !> Solve A x = b with the factors.
   subroutine solve_factors(a, b)
      real(dp), intent(in), contiguous :: a(:, :)
      real(dp), intent(inout) :: b(:)
      integer :: k, n

      n = size(b)
      do k = 1, n
         b(k + 1:n) = b(k + 1:n) - b(k)*a(k + 1:n, k)
      end do
      do k = n, 1, -1
         b(k) = b(k)/a(k, k)
         b(:k - 1) = b(:k - 1) - b(k)*a(:k - 1, k)
      end do
   end subroutine solve_factors

   !> Replace a small matrix by its inverse (Gauss and Jordan). A pivot below `least` is replaced by 1, so that an unknown
   !> that the equations do not determine remains small.
   pure subroutine invert(a, least)
      real(sp), intent(inout), contiguous :: a(:, :)
      real(sp), intent(in), optional :: least
      real(sp) :: column(size(a, 1))
      integer :: j, k

      do k = 1, size(a, 1)
         column = a(:, k)
         if (present(least)) then
            if (abs(column(k)) < least) column(k) = 1.0_sp
         end if
         a(:, k) = 0.0_sp
         a(k, k) = 1.0_sp
         a(k, :) = a(k, :)/column(k)
         column(k) = 0.0_sp
         do j = 1, size(a, 2)
            a(:, j) = a(:, j) - a(k, j)*column
         end do
      end do
   end subroutine invert

end module dense_factors
