!> The method of generalised minimal residuals (GMRES) for a linear system A x = b whose matrix is only known
!> through its products.
!>
!> Of all linear combinations x of b, A b, A^2 b, ... it finds the one with the least |b - A x| (Y. Saad,
!> M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856). The caller forms the products:
!>
!>    call krylov%begin(b, most, tolerance)
!>    do while (krylov%unsolved())
!>       call krylov%next(v)               a direction of unit length
!>       ...                               w = A v
!>       call krylov%take(w)
!>    end do
!>    call krylov%solution(x)
!>
!> A vector has some numbers for each cell of a list, and two additional numbers (`beside`). The list is ordered by the
!> rows of the grid, and sums are formed by row and added up in order, so that they do not depend on the number of
!> threads or processes. The directions are stored in single precision, which limits the accuracy of x to 1e-6.
!> Memory is allocated for each direction when it is needed; if there is none left, the method ends.
module gmres
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp, sp
   use field_sums, only : row_totals
   implicit none
   private

   public :: cell_vector_type, gmres_type

   !> A vector.
   type :: cell_vector_type
      real(dp), allocatable :: cells(:, :)          !! [numbers, cells of this process]
      real(dp) :: beside(2) = 0.0_dp                !! the additional numbers
   end type cell_vector_type

   !> A direction, of unit length.
   type :: direction_type
      real(sp), allocatable :: cells(:, :)          !! [numbers, cells of this process]
      real(dp) :: beside(2) = 0.0_dp
   end type direction_type

   !> A system that is being solved.
   type :: gmres_type
      integer :: used = 0                           !! directions that have been taken
      real(dp) :: left = 0.0_dp                     !! |b - A x|/|b|
      logical :: short_of_memory = .false.          !! there was no memory for another direction
      integer, private :: most = 0
      real(dp), private :: tolerance = 0.0_dp
      real(dp), private :: length = 0.0_dp          !! |b|
      integer, allocatable, private :: first(:)     !! [rows + 1] the first cell of each row in the list
      type(direction_type), allocatable, private :: basis(:)   !! [most + 1], so far used + 1
      ! The least squares problem: its triangular matrix, the rotations that made it triangular, and its right side.
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

   !> Begin to solve for a right side.
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
      self%left = 1.0_dp
      self%short_of_memory = .false.
      if (allocated(self%basis)) deallocate (self%basis, self%triangle, self%rotation, self%right)
      allocate (self%basis(most + 1), self%triangle(most, most), self%rotation(2, most), self%right(most + 1))
      self%right = 0.0_dp
      call keep(self, 1, b, 1.0_dp)
      if (self%short_of_memory) return
      square = self%products(b, 1, 1)
      self%length = sqrt(square(1))
      self%left = merge(1.0_dp, 0.0_dp, self%length > 0.0_dp)
      if (.not. self%length > 0.0_dp) return
      call keep(self, 1, b, self%length)
      self%right(1) = self%length
   end subroutine begin

   !> Keep a vector, divided by its length, as a direction, if all processes have memory for it.
   subroutine keep(self, n, v, length)
      class(gmres_type), intent(inout) :: self
      integer, intent(in) :: n                      !! number of the direction
      type(cell_vector_type), intent(in) :: v
      real(dp), intent(in) :: length
      integer :: status

      if (.not. allocated(self%basis(n)%cells)) then
         allocate (self%basis(n)%cells(size(v%cells, 1), size(v%cells, 2)), stat=status)
         self%short_of_memory = any_process(status /= 0)
         if (self%short_of_memory) return
      end if
      self%basis(n)%cells(:, :) = real(v%cells/length, sp)
      self%basis(n)%beside = v%beside/length
   end subroutine keep

   !> Is another direction needed?
   pure function unsolved(self) result(yes)
      class(gmres_type), intent(in) :: self
      logical :: yes

      yes = self%left > self%tolerance .and. self%used < self%most .and. .not. self%short_of_memory
   end function unsolved

   !> Return the direction whose product is needed next.
   subroutine next(self, v)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(inout) :: v

      v%cells = real(self%basis(self%used + 1)%cells, dp)
      v%beside = self%basis(self%used + 1)%beside
   end subroutine next

   !> Accept the product. Its part orthogonal to all directions is the next direction (Gram-Schmidt, twice).
   subroutine take(self, w)
      class(gmres_type), intent(inout) :: self
      type(cell_vector_type), intent(inout) :: w    !! out: undefined
      real(dp), allocatable :: column(:), part(:)
      real(dp) :: length, square(1), turned
      integer :: k, n, round

      n = self%used + 1
      allocate (column(n + 1), source=0.0_dp)
      do round = 1, 2
         part = self%products(w, 1, n)
         column(:n) = column(:n) + part
         do k = 1, n
            w%cells = w%cells - part(k)*self%basis(k)%cells
            w%beside = w%beside - part(k)*self%basis(k)%beside
         end do
      end do
      call keep(self, n + 1, w, 1.0_dp)
      if (self%short_of_memory) return
      square = self%products(w, n + 1, n + 1)
      length = sqrt(max(square(1), 0.0_dp))
      column(n + 1) = length
      if (length > 0.0_dp) call keep(self, n + 1, w, length)

      ! Rotations make the matrix of all columns so far triangular.
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

   !> Compute the x with the least |b - A x|.
   subroutine solution(self, x)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(inout) :: x    !! its values are not read
      real(dp) :: y(self%used)
      integer :: k

      x%cells(:, :) = 0.0_dp
      x%beside = 0.0_dp
      do k = self%used, 1, -1
         y(k) = 0.0_dp
         if (.not. self%triangle(k, k) > 0.0_dp) cycle
         y(k) = (self%right(k) - dot_product(self%triangle(k, k + 1:self%used), y(k + 1:)))/self%triangle(k, k)
      end do
      do k = 1, self%used
         x%cells = x%cells + y(k)*self%basis(k)%cells
         x%beside = x%beside + y(k)*self%basis(k)%beside
      end do
   end subroutine solution

   !> The products of a vector with some directions.
   function products(self, w, from, to) result(sums)
      class(gmres_type), intent(in) :: self
      type(cell_vector_type), intent(in) :: w
      integer, intent(in) :: from, to               !! numbers of the first and the last direction
      real(dp) :: sums(from:to)
      real(dp), allocatable :: rows(:, :)
      integer :: i, j, k

      allocate (rows(from:to, size(self%first) - 1), source=0.0_dp)
      !$omp parallel do default(none) shared(self, w, from, to, rows) private(i, j, k)
      do j = 1, size(self%first) - 1
         do k = from, to
            do i = self%first(j), self%first(j + 1) - 1
               rows(k, j) = rows(k, j) + sum(w%cells(:, i)*self%basis(k)%cells(:, i))
            end do
         end do
      end do
      sums = row_totals(rows)
      do k = from, to
         sums(k) = sums(k) + dot_product(w%beside, self%basis(k)%beside)
      end do
   end function products

end module gmres
