!> Anderson acceleration of a fixed point z = g(z) of a vector field on the grid.
!>
!> From the last places z_k and residuals f_k = g(z_k) - z_k, at most `depth` + 1 of them,
!>
!>    z_next = z + b f - sum_a c_a (dz_a + b df_a),   c minimises |f - sum_a c_a df_a|
!>
!> with the differences dz_a, df_a of consecutive places and residuals and the damping b (type II:
!> D. G. Anderson, J. ACM 12 (1965) 547; H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715).
!> Differences that are nearly a combination of newer ones are left out.
!>
!> Memory: the last z and f, and two vector fields per difference, allocated when first needed.
!> Sums are formed by row and added in order: results do not depend on the number of threads.
module anderson_mixing
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp
   implicit none
   private

   public :: mixing_type

   integer, parameter, public :: mixing_depth = 6
   !> A difference whose part orthogonal to the newer ones is below this (squared) is left out.
   real(dp), parameter :: dependent = 1.0e-10_dp

   real(dp), parameter :: largest = 1.0e3_dp        !! factor that is believed

   type :: difference_type
      real(dp), allocatable :: place(:, :, :)       !! dz, m
      real(dp), allocatable :: residual(:, :, :)    !! df, m
   end type difference_type

   !> What the evaluations of one fixed point have shown so far.
   type :: mixing_type
      integer, private :: seen = 0                  !! evaluations since the start
      integer, private :: newest = 0                !! the place in the ring of the newest difference
      real(dp), allocatable, private :: place(:, :, :)      !! z of the last evaluation, m
      real(dp), allocatable, private :: residual(:, :, :)   !! f of the last evaluation, m
      type(difference_type), private :: ring(mixing_depth)
   contains
      procedure :: start
      procedure :: next
   end type mixing_type

contains

   !> Forget all evaluations: a new fixed point is sought.
   subroutine start(self)
      class(mixing_type), intent(inout) :: self

      self%seen = 0
   end subroutine start

   !> The next place to evaluate.
   subroutine next(self, residual, damping, place)
      class(mixing_type), intent(inout) :: self
      real(dp), intent(in) :: residual(:, :, :)     !! f at the place, m [nx, ny, 2]
      real(dp), intent(in) :: damping               !! b, from 0 to 1
      real(dp), intent(inout) :: place(:, :, :)     !! in: z; out: the next z, m [nx, ny, 2]
      real(dp) :: factors(mixing_depth)
      integer :: pairs

      if (.not. allocated(self%place)) allocate (self%place, self%residual, mold=place)
      if (self%seen > 0) call add_difference(self, residual, place)
      pairs = min(self%seen, mixing_depth)
      factors = 0.0_dp
      if (pairs > 0) factors(:pairs) = best_combination(self, residual, pairs)
      if (.not. all(abs(factors) < largest)) factors = 0.0_dp
      self%seen = self%seen + 1
      self%place(:, :, :) = place
      self%residual(:, :, :) = residual
      call combine(self, residual, damping, factors(:pairs), place)
   end subroutine next

   !> Put the change since the last evaluation into the ring, over the oldest.
   subroutine add_difference(self, residual, place)
      class(mixing_type), intent(inout) :: self
      real(dp), intent(in) :: residual(:, :, :), place(:, :, :)
      integer :: j, k

      self%newest = modulo(self%newest, mixing_depth) + 1
      k = self%newest
      if (.not. allocated(self%ring(k)%place)) &
         allocate (self%ring(k)%place, self%ring(k)%residual, mold=place)
      !$omp parallel do default(none) shared(self, k, residual, place) private(j)
      do j = 1, size(place, 2)
         self%ring(k)%place(:, j, :) = place(:, j, :) - self%place(:, j, :)
         self%ring(k)%residual(:, j, :) = residual(:, j, :) - self%residual(:, j, :)
      end do
   end subroutine add_difference

   !> Where the difference number a, counted from the newest, stands in the ring.
   pure function ring_index(self, a) result(k)
      class(mixing_type), intent(in) :: self
      integer, intent(in) :: a
      integer :: k

      k = modulo(self%newest - a, mixing_depth) + 1
   end function ring_index

   !> The factors c, of the newest difference first.
   function best_combination(self, residual, pairs) result(factors)
      class(mixing_type), intent(in) :: self
      real(dp), intent(in) :: residual(:, :, :)
      integer, intent(in) :: pairs
      real(dp) :: factors(pairs)
      real(dp), allocatable :: rows(:, :), sums(:)
      real(dp) :: gram(pairs, pairs), right(pairs)
      integer :: a, b, j, n

      n = pairs*(pairs + 3)/2
      allocate (rows(n, size(residual, 2)))
      !$omp parallel do default(none) shared(self, residual, rows, pairs) private(j)
      do j = 1, size(residual, 2)
         call row_products(self, residual, pairs, j, rows(:, j))
      end do
      sums = global_sum([(sum(rows(j, :)), j = 1, n)])
      n = 0
      do a = 1, pairs
         do b = 1, a
            n = n + 1
            gram(a, b) = sums(n)
            gram(b, a) = sums(n)
         end do
         n = n + 1
         right(a) = sums(n)
      end do
      factors = least_squares(gram, right)
   end function best_combination

   !> The products of a row: df_a.df_b for b up to a, then df_a.f, for each a.
   pure subroutine row_products(self, residual, pairs, j, products)
      class(mixing_type), intent(in) :: self
      real(dp), intent(in) :: residual(:, :, :)
      integer, intent(in) :: pairs, j
      real(dp), intent(out) :: products(:)
      integer :: a, b, n

      n = 0
      do a = 1, pairs
         associate (da => self%ring(ring_index(self, a))%residual)
            do b = 1, a
               n = n + 1
               products(n) = sum(da(:, j, :)*self%ring(ring_index(self, b))%residual(:, j, :))
            end do
            n = n + 1
            products(n) = sum(da(:, j, :)*residual(:, j, :))
         end associate
      end do
   end subroutine row_products

   !> The solution of a symmetric semidefinite system by Cholesky's method on the matrix scaled to a
   !> unit diagonal. A column that depends on those before it gets the factor 0.
   pure function least_squares(gram, right) result(factors)
      real(dp), intent(in) :: gram(:, :), right(:)
      real(dp) :: factors(size(right))
      real(dp) :: lower(size(right), size(right)), scale(size(right)), pivot
      logical :: used(size(right))
      integer :: a, b, n

      n = size(right)
      factors = 0.0_dp
      used = .false.
      lower = 0.0_dp
      do a = 1, n
         if (.not. gram(a, a) > 0.0_dp) cycle
         scale(a) = 1.0_dp/sqrt(gram(a, a))
         do b = 1, a - 1
            if (used(b)) lower(a, b) = (gram(a, b)*scale(a)*scale(b) &
               - dot_product(lower(a, :b - 1), lower(b, :b - 1)))/lower(b, b)
         end do
         pivot = 1.0_dp - dot_product(lower(a, :a - 1), lower(a, :a - 1))
         used(a) = pivot > dependent
         if (used(a)) lower(a, a) = sqrt(pivot)
         if (.not. used(a)) lower(a, :) = 0.0_dp
      end do
      do a = 1, n
         if (used(a)) factors(a) = (right(a)*scale(a) &
            - dot_product(lower(a, :a - 1), factors(:a - 1)))/lower(a, a)
      end do
      do a = n, 1, -1
         if (used(a)) factors(a) = (factors(a) &
            - dot_product(lower(a + 1:, a), factors(a + 1:)))/lower(a, a)
      end do
      do a = 1, n
         if (used(a)) factors(a) = factors(a)*scale(a)
      end do
   end function least_squares

   !> z + b f - sum of c (dz + b df).
   subroutine combine(self, residual, damping, factors, place)
      class(mixing_type), intent(in) :: self
      real(dp), intent(in) :: residual(:, :, :)
      real(dp), intent(in) :: damping
      real(dp), intent(in) :: factors(:)
      real(dp), intent(inout) :: place(:, :, :)
      integer :: a, j

      !$omp parallel do default(none) shared(self, residual, damping, factors, place) private(a, j)
      do j = 1, size(place, 2)
         place(:, j, :) = place(:, j, :) + damping*residual(:, j, :)
         do a = 1, size(factors)
            associate (old => self%ring(ring_index(self, a)))
               place(:, j, :) = place(:, j, :) &
                  - factors(a)*(old%place(:, j, :) + damping*old%residual(:, j, :))
            end associate
         end do
      end do
   end subroutine combine

end module anderson_mixing
