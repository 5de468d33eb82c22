!> The method of generalised minimal residuals for a linear system A x = b whose matrix is known by its
!> products only.
!>
!> (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856.) Of all x that are sums of b, A b,
!> A^2 b, ... the one with the least |b - A x|. The caller forms the products:
!>
!>    call krylov%begin(b, most, tolerance)
!>    do while (krylov%unsolved())
!>       call krylov%next(v)               a direction of unit length
!>       ...                               w = A v
!>       call krylov%take(w)
!>    end do
!>    call krylov%solution(x)
!>
!> A vector has three numbers per cell of a list and one number beside them. The list is ordered by the
!> rows of the grid, and sums are formed by row and added up in order: they do not depend on the threads
!> or processes. The directions are stored in single precision, which limits the accuracy of x to 1e-6.
module gmres
   use asperity_precision, only : dp, sp
   use field_sums, only : row_totals
   implicit none
   private

   public :: cell_vector_type, gmres_type

   !> A vector.
   type :: cell_vector_type
      real(dp), allocatable :: cells(:, :)          !! [3, cells of this process]
      real(dp) :: beside = 0.0_dp
   end type cell_vector_type

   !> A system that is being solved.
   type :: gmres_type
      integer :: used = 0                           !! directions that have been taken
      real(dp) :: left = 0.0_dp                     !! |b - A x|/|b|
      integer, private :: most = 0
      real(dp), private :: tolerance = 0.0_dp
      real(dp), private :: length = 0.0_dp          !! |b|
      integer, allocatable, private :: first(:)     !! [rows + 1] the first cell of each row in the list
      real(sp), allocatable, private :: basis(:, :, :)   !! [3, cells, most + 1]
      real(dp), allocatable, private :: beside(:)   !! [most + 1]
      real(dp), allocatable, private :: triangle(:, :), rotation(:, :), right(:)
   contains
      procedure :: begin
      procedure :: unsolved
      procedure :: next
      procedure :: take
      procedure :: solution
      procedure, private :: products
   end type gmres_type

contains

   !> Begin with a right side.
   subroutine begin(self, b, first, most, tolerance)
      class(gmres_type), intent(inout) :: self
      type(cell_vector_type), intent(in) :: b
      integer, intent(in) :: first(:)               !! [rows + 1] the first cell of each row in the list
      integer, intent(in) :: most                   !! directions
      real(dp), intent(in) :: tolerance             !! of |b - A x|/|b|
      real(dp) :: square(1)

      self%first = first
      self%most = most
      self%tolerance = tolerance
      self%used = 0
      if (allocated(self%basis)) deallocate (self%basis, self%beside, self%triangle, self%rotation, self%right)
      allocate (self%basis(3, size(b%cells, 2), most + 1), self%beside(most + 1), &
         self%triangle(most, most), self%rotation(2, most), self%right(most + 1))
      self%basis(:, :, 1) = real(b%cells, sp)
      self%beside(1) = b%beside
      square = self%products(b, 1)
      self%length = sqrt(square(1))
      self%left = merge(1.0_dp, 0.0_dp, self%length > 0.0_dp)
      if (.not. self%length > 0.0_dp) return
      self%basis(:, :, 1) = real(b%cells/self%length, sp)
      self%beside(1) = b%beside/self%length
      self%right = 0.0_dp
      self%right(1) = self%length
   end subroutine begin

   !> Is another direction wanted?
   pure function unsolved(self) result(yes)
      class(gmres_type), intent(in) :: self
      logical :: yes

      yes = self%left > self%tolerance .and. self%used < self%most
   end function unsolved

   !> The direction whose product is wanted.
   subroutine next(self, v)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(inout) :: v

      v%cells = real(self%basis(:, :, self%used + 1), dp)
      v%beside = self%beside(self%used + 1)
   end subroutine next

   !> Take the product: its part across all directions is the next one (Gram-Schmidt, twice).
   subroutine take(self, w)
      class(gmres_type), intent(inout) :: self
      type(cell_vector_type), intent(inout) :: w    !! out: of no use
      real(dp), allocatable :: column(:), part(:)
      real(dp) :: length, turned
      integer :: k, n, round

      n = self%used + 1
      allocate (column(n + 1), source=0.0_dp)
      do round = 1, 2
         part = self%products(w, n)
         column(:n) = column(:n) + part
         do k = 1, n
            w%cells = w%cells - part(k)*self%basis(:, :, k)
            w%beside = w%beside - part(k)*self%beside(k)
         end do
      end do
      self%basis(:, :, n + 1) = real(w%cells, sp)
      self%beside(n + 1) = w%beside
      part = self%products(w, n + 1)
      length = sqrt(max(part(n + 1), 0.0_dp))
      column(n + 1) = length
      if (length > 0.0_dp) then
         self%basis(:, :, n + 1) = real(w%cells/length, sp)
         self%beside(n + 1) = w%beside/length
      end if
      ! The matrix of all columns so far becomes a triangle by rotations.
      do k = 1, n - 1
         turned = self%rotation(1, k)*column(k) + self%rotation(2, k)*column(k + 1)
         column(k + 1) = self%rotation(1, k)*column(k + 1) - self%rotation(2, k)*column(k)
         column(k) = turned
      end do
      length = hypot(column(n), column(n + 1))
      self%rotation(:, n) = [1.0_dp, 0.0_dp]
      if (length > 0.0_dp) self%rotation(:, n) = column(n:n + 1)/length
      column(n) = length
      self%triangle(:n, n) = column(:n)
      self%right(n + 1) = -self%rotation(2, n)*self%right(n)
      self%right(n) = self%rotation(1, n)*self%right(n)
      self%used = n
      self%left = abs(self%right(n + 1))/self%length
   end subroutine take

   !> The x with the least |b - A x|.
   subroutine solution(self, x)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(inout) :: x
      real(dp) :: y(self%used)
      integer :: k

      x%cells = 0.0_dp*x%cells
      x%beside = 0.0_dp
      do k = self%used, 1, -1
         y(k) = 0.0_dp
         if (.not. self%triangle(k, k) > 0.0_dp) cycle
         y(k) = (self%right(k) - dot_product(self%triangle(k, k + 1:self%used), y(k + 1:)))/self%triangle(k, k)
      end do
      do k = 1, self%used
         x%cells = x%cells + y(k)*self%basis(:, :, k)
         x%beside = x%beside + y(k)*self%beside(k)
      end do
   end subroutine solution

   !> The products of a vector with the first directions.
   function products(self, w, n) result(sums)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(in) :: w
      integer, intent(in) :: n
      real(dp) :: sums(n)
      real(dp), allocatable :: rows(:, :)
      integer :: i, j, k

      allocate (rows(n, size(self%first) - 1), source=0.0_dp)
      !$omp parallel do default(none) shared(self, w, n, rows) private(i, j, k)
      do j = 1, size(self%first) - 1
         do k = 1, n
            do i = self%first(j), self%first(j + 1) - 1
               rows(k, j) = rows(k, j) + sum(w%cells(:, i)*self%basis(:, i, k))
            end do
         end do
      end do
      sums = row_totals(rows) + w%beside*self%beside(:n)
   end function products

end module gmres
