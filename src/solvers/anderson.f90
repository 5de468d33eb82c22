!> Anderson acceleration of a fixed-point iteration x = g(x) for fields.
!>
!> With the residual f = g(x) - x and the differences dx_i, df_i of x and of f between successive
!> iterates, the next iterate is
!>
!>     x + b f - sum gamma_i (dx_i + b df_i),   gamma minimises |f - sum gamma_i df_i|
!>
!> with the damping b (type II: D. G. Anderson, J. ACM 12 (1965) 547; H. F. Walker, P. Ni, SIAM J. Numer.
!> Anal. 49 (2011) 1715). For linear g this is equivalent to GMRES. It may overshoot if g has kinks.
!> Therefore the caller decides when to accelerate, and calls `forget` when the old differences no longer apply.
!>
!> An iterate has one or more components, each with a weight in the norm. A component of weight zero is updated
!> with the same gamma. The least squares problem is solved by its normal equations with columns of unit length,
!> the newest column first. A column that is linearly dependent on newer ones, within single precision, is left
!> out. Sums are added row by row in a fixed order, so that results do not depend on the number of threads.
!>
!> Memory: two fields in single precision per component for each pair, and two fields of doubles per component.
!> Single precision is sufficient for the pairs, because the residual itself is never computed from them.
module anderson
   use asperity_threads, only : least_parallel_cells, thread_count
   use field_sums, only : row_totals
   use asperity_precision, only : dp, sp
   implicit none
   private

   public :: anderson_type, new_anderson

   real(dp), parameter :: dependent = 1.0e-12_dp     !! squared length of the independent part of a column

   !> The last differences. This is plain data, which may be kept from solve to solve.
   type :: anderson_type
      integer :: nx = 0, components = 0
      integer :: rows = 0                            !! of this process
      integer :: pairs = 0                           !! largest number of pairs
      integer :: used = 0                            !! present number of pairs
      real(dp) :: largest = huge(1.0_dp)             !! if a gamma is as large, none is used
      integer, private :: newest = 0
      integer, private :: threads = 1
      logical, private :: begun = .false.            !! there is a last iterate
      real(dp), allocatable, private :: gram(:, :)   !! df_i.df_j
      real(sp), allocatable, private :: df(:, :, :, :)   !! [nx, components, rows, pairs]
      real(sp), allocatable, private :: dg(:, :, :, :)
      real(dp), allocatable, private :: last_f(:, :, :), last_g(:, :, :)
   contains
      procedure :: forget
      procedure :: momentum_step
      procedure :: step
      procedure :: cosine_with_last
   end type anderson_type

contains

   !> Allocate memory for a number of pairs.
   subroutine new_anderson(self, nx, components, rows, pairs)
      type(anderson_type), intent(out) :: self
      integer, intent(in) :: nx, components
      integer, intent(in) :: rows                    !! of this process
      integer, intent(in) :: pairs

      self%nx = nx
      self%components = components
      self%rows = rows
      self%pairs = pairs
      self%threads = merge(1, thread_count(), nx*rows < least_parallel_cells)
      allocate (self%gram(pairs, pairs), source=0.0_dp)
      allocate (self%df(nx, components, rows, pairs), self%dg(nx, components, rows, pairs))
      allocate (self%last_f(nx, components, rows), self%last_g(nx, components, rows))
   end subroutine new_anderson

   !> Discard all differences and start again.
   pure subroutine forget(self)
      class(anderson_type), intent(inout) :: self

      self%used = 0
      self%newest = 0
      self%begun = .false.
   end subroutine forget

   !> Compute the next iterate from x and its residual. With `plain` it is x + b f, but the new pair is still kept.
   subroutine step(self, weights, f, x, plain, damping)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: weights(self%components)              !! of the components in the norm
      real(dp), intent(in) :: f(self%nx, self%components, self%rows)  !! g(x) - x
      real(dp), intent(inout) :: x(self%nx, self%components, self%rows)   !! in: x; out: the next
      logical, intent(in) :: plain
      real(dp), intent(in), optional :: damping                     !! b, from 0 to 1 (default)
      real(dp), allocatable :: gamma(:)
      real(dp) :: left
      integer :: j

      allocate (gamma(self%pairs), source=0.0_dp)
      call learn(self, weights, f, x, gamma)
      if (plain .or. .not. all(abs(gamma) < self%largest)) gamma = 0.0_dp
      left = 0.0_dp
      if (present(damping)) left = 1.0_dp - damping
      !$omp parallel do default(none) shared(self, f, x, gamma, left) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%rows
         call combine_row(self, gamma, left, j, f(:, :, j), x(:, :, j))
      end do
   end subroutine step

   !> Compute the next iterate without acceleration but with momentum: x + b f + m (x - the last x). The part that
   !> all residuals have in common is followed with an effective factor b/(1 - m), and a part that changes its sign
   !> from one iterate to the next is damped as by b alone. All differences are discarded.
   subroutine momentum_step(self, f, x, damping, momentum)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: f(self%nx, self%components, self%rows)  !! g(x) - x
      real(dp), intent(inout) :: x(self%nx, self%components, self%rows)   !! in: x; out: the next
      real(dp), intent(in) :: damping                !! b, from 0 to 1
      real(dp), intent(in) :: momentum               !! m, from 0 to 1
      real(dp) :: m
      integer :: j

      m = merge(momentum, 0.0_dp, self%begun)
      call self%forget()
      self%begun = .true.
      !$omp parallel do default(none) shared(self, f, x, damping, m) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call momentum_row(self, damping, m, j, f(:, :, j), x(:, :, j))
      end do
   end subroutine momentum_step

   !> Compute a row of `momentum_step`, where the last x is the last g minus the last f.
   subroutine momentum_row(self, damping, m, j, f, x)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: damping, m
      integer, intent(in) :: j
      real(dp), intent(in) :: f(self%nx, self%components)
      real(dp), intent(inout) :: x(self%nx, self%components)
      real(dp) :: next(self%nx, self%components)

      next = x + damping*f
      if (m > 0.0_dp) next = next + m*(x - (self%last_g(:, :, j) - self%last_f(:, :, j)))
      self%last_f(:, :, j) = f
      self%last_g(:, :, j) = x + f
      x = next
   end subroutine momentum_row

   !> The cosine of the angle between a residual and the last one. If there is no last one, it is 0.5, which
   !> suggests neither that the iterates follow a line nor that they turn back.
   function cosine_with_last(self, f) result(cosine)
      class(anderson_type), intent(in) :: self
      real(dp), intent(in) :: f(self%nx, self%components, self%rows)  !! g(x) - x
      real(dp) :: cosine
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(3)
      integer :: j

      cosine = 0.5_dp
      if (.not. self%begun) return
      allocate (rows(3, self%rows))
      !$omp parallel do default(none) shared(self, f, rows) private(j) num_threads(self%threads)
      do j = 1, self%rows
         rows(1, j) = sum(f(:, :, j)*self%last_f(:, :, j))
         rows(2, j) = sum(f(:, :, j)**2)
         rows(3, j) = sum(self%last_f(:, :, j)**2)
      end do
      sums = row_totals(rows)
      if (min(sums(2), sums(3)) > 0.0_dp) cosine = sums(1)/(sqrt(sums(2))*sqrt(sums(3)))
   end function cosine_with_last

   !> Compute a row of the next iterate, with g = x + f: g - left f - sum gamma (dg - left df).
   subroutine combine_row(self, gamma, left, j, f, x)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: gamma(:)
      real(dp), intent(in) :: left                   !! 1 - b
      integer, intent(in) :: j
      real(dp), intent(in) :: f(self%nx, self%components)
      real(dp), intent(inout) :: x(self%nx, self%components)
      integer :: k

      self%last_f(:, :, j) = f
      x = x + f
      self%last_g(:, :, j) = x
      if (left > 0.0_dp) x = x - left*f
      do k = 1, self%used
         if (.not. abs(gamma(k)) > 0.0_dp) cycle
         x = x - gamma(k)*self%dg(:, :, j, k)
         if (left > 0.0_dp) x = x + gamma(k)*left*self%df(:, :, j, k)
      end do
   end subroutine combine_row

   !> Add the newest pair, and find gamma.
   subroutine learn(self, weights, f, x, gamma)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: weights(self%components)
      real(dp), intent(in) :: f(self%nx, self%components, self%rows)
      real(dp), intent(in) :: x(self%nx, self%components, self%rows)
      real(dp), intent(inout) :: gamma(:)
      real(dp), allocatable :: rows(:, :), sums(:)
      integer :: j, k

      if (.not. self%begun) then
         self%begun = .true.
         return
      end if
      self%newest = mod(self%newest, self%pairs) + 1
      self%used = min(self%used + 1, self%pairs)
      allocate (rows(2*self%pairs, self%rows), sums(2*self%pairs))
      !$omp parallel do default(none) shared(self, weights, f, x, rows) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%rows
         call learn_row(self, weights, j, f(:, :, j), x(:, :, j), rows(:, j))
      end do
      sums = row_totals(rows)
      do k = 1, self%used
         self%gram(k, self%newest) = sums(k)
         self%gram(self%newest, k) = sums(k)
      end do
      call solve_gram(self, sums(self%pairs + 1:), gamma)
   end subroutine learn

   !> Compute a row of the newest pair, and its products: df.df_k, then f.df_k.
   subroutine learn_row(self, weights, j, f, x, sums)
      class(anderson_type), intent(inout) :: self
      real(dp), intent(in) :: weights(self%components)
      integer, intent(in) :: j
      real(dp), intent(in) :: f(self%nx, self%components)
      real(dp), intent(in) :: x(self%nx, self%components)
      real(dp), intent(out) :: sums(2*self%pairs)
      real(dp) :: a, b, w
      integer :: c, i, k, n

      n = self%newest
      sums = 0.0_dp
      do c = 1, self%components
         self%df(:, c, j, n) = real(f(:, c) - self%last_f(:, c, j), sp)
         self%dg(:, c, j, n) = real((x(:, c) + f(:, c)) - self%last_g(:, c, j), sp)
         w = weights(c)**2
         if (w <= 0.0_dp) cycle
         do k = 1, self%used
            a = 0.0_dp
            b = 0.0_dp
            !$omp simd reduction(+:a, b)
            do i = 1, self%nx
               a = a + real(self%df(i, c, j, n), dp)*self%df(i, c, j, k)
               b = b + f(i, c)*self%df(i, c, j, k)
            end do
            sums(k) = sums(k) + w*a
            sums(self%pairs + k) = sums(self%pairs + k) + w*b
         end do
      end do
   end subroutine learn_row

   !> Minimise |f - sum gamma_i df_i| with the Cholesky factors of the Gram matrix of unit columns.
   subroutine solve_gram(self, projections, gamma)
      class(anderson_type), intent(in) :: self
      real(dp), intent(in) :: projections(:)         !! f.df_k
      real(dp), intent(inout) :: gamma(:)
      real(dp) :: factor(self%pairs, self%pairs), rhs(self%pairs), length(self%pairs), pivot
      integer :: order(self%pairs)
      integer :: a, b, i, kept

      kept = 0
      do i = 0, self%used - 1
         a = modulo(self%newest - 1 - i, self%pairs) + 1
         if (self%gram(a, a) <= 0.0_dp) cycle
         length(kept + 1) = sqrt(self%gram(a, a))
         do b = 1, kept
            factor(kept + 1, b) = (self%gram(a, order(b))/(length(kept + 1)*length(b)) &
               - dot_product(factor(kept + 1, :b - 1), factor(b, :b - 1)))/factor(b, b)
         end do
         pivot = 1.0_dp - sum(factor(kept + 1, :kept)**2)
         if (pivot <= dependent) cycle
         kept = kept + 1
         order(kept) = a
         factor(kept, kept) = sqrt(pivot)
         rhs(kept) = (projections(a)/length(kept) &
            - dot_product(factor(kept, :kept - 1), rhs(:kept - 1)))/factor(kept, kept)
      end do
      do i = kept, 1, -1
         rhs(i) = (rhs(i) - dot_product(factor(i + 1:kept, i), rhs(i + 1:kept)))/factor(i, i)
         gamma(order(i)) = rhs(i)/length(i)
      end do
   end subroutine solve_gram

end module anderson
