!> Dense contact on a set of cells that changes by a few cells.
!>
!> The matrix K of the set C0 at the start is factored once. For C = C0 without L and with J the
!> pressures of C0 are
!>
!>     p0 = K^-1 (h + level + sum over L of r_b e_b - sum over J of p_j k_j)
!>
!> with r_b the gap that opens at a cell which has left, and k_j the displacement of C0 by a joined cell.
!> p0 = 0 on L, K p = h + level on J and the load are a small system for r, p_j and the level. Its
!> columns K^-1 e_b and K^-1 k_j are kept, so a cell costs one pair of triangular solves.
!>
!> Memory: the matrix, and a column for each cell that has changed.
module changed_set
   use dense_factors, only : factor, solve_factors
   use asperity_precision, only : dp
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: changed_set_type, new_changed_set

   !> A set of cells in contact. Not to be copied.
   type :: changed_set_type
      integer :: factors = 0                           !! factorings so far
      integer, private :: threads = 1
      real(dp), private :: load = 0.0_dp               !! sum of P over the cells, Pa
      real(dp), allocatable, private :: kernel(:, :)   !! displacement by the first cell's unit pressure
      real(dp), allocatable, private :: height(:, :)   !! m
      logical, allocatable, private :: inside(:, :)    !! the set C
      integer, allocatable, private :: number(:, :)    !! of a cell in C0; minus that of a joined one
      integer, allocatable, private :: cells(:, :)     !! C0, [2, n]
      integer, allocatable, private :: changed(:, :)   !! cells of L and J, [2, k]; some may be neither now
      real(dp), allocatable, private :: matrix(:, :)   !! factors
      real(dp), allocatable, private :: base(:, :)     !! K^-1 h, K^-1 1
      real(dp), allocatable, private :: columns(:, :)  !! of the changed cells
      integer, private :: used = 0                     !! changed cells
   contains
      procedure :: refresh
      procedure :: crowded
      procedure :: solve
      procedure :: leave
      procedure :: join
   end type changed_set_type

contains

   !> Take a set and factor its matrix.
   subroutine new_changed_set(self, operator, height, load, inside, work)
      type(changed_set_type), intent(out) :: self
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)             !! H, m
      real(dp), intent(in) :: load                     !! sum of P, Pa
      logical, intent(in) :: inside(:, :)
      real(dp), intent(inout) :: work(:, :)            !! a field

      allocate (self%kernel, mold=height)
      allocate (self%height, source=height)
      allocate (self%inside, source=inside)
      allocate (self%number(size(height, 1), size(height, 2)))
      self%load = load
      self%threads = operator%threads
      work = 0.0_dp
      work(1, 1) = 1.0_dp
      call operator%displace(work, self%kernel)
      call self%refresh()
   end subroutine new_changed_set

   !> Factor the matrix of the set as it is.
   subroutine refresh(self)
      class(changed_set_type), intent(inout) :: self
      integer :: a, b, i, j, n, room

      n = count(self%inside)
      if (allocated(self%cells)) deallocate (self%cells, self%matrix, self%base, self%changed, self%columns)
      room = max(48, n/4)
      allocate (self%cells(2, n), self%matrix(n, n), self%base(n, 2), self%changed(2, room), &
         self%columns(n, room))
      self%used = 0
      self%factors = self%factors + 1
      self%number = 0
      n = 0
      do j = 1, size(self%inside, 2)
         do i = 1, size(self%inside, 1)
            if (.not. self%inside(i, j)) cycle
            n = n + 1
            self%cells(:, n) = [i, j]
            self%number(i, j) = n
         end do
      end do
      !$omp parallel do default(none) shared(self, n) private(a, b) num_threads(self%threads)
      do b = 1, n
         do a = 1, n
            self%matrix(a, b) = entry_of(self, self%cells(:, a), self%cells(:, b))
         end do
      end do
      call factor(self%matrix, self%threads)
      do a = 1, n
         self%base(a, 1) = self%height(self%cells(1, a), self%cells(2, a))
      end do
      self%base(:, 2) = 1.0_dp
      call solve_factors(self%matrix, self%base(:, 1))
      call solve_factors(self%matrix, self%base(:, 2))
   end subroutine refresh

   !> Displacement at one cell by the pressure of another.
   pure function entry_of(self, at, by) result(displacement)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: at(2), by(2)
      real(dp) :: displacement
      integer :: d(2)

      d = modulo(at - by, shape(self%kernel))
      displacement = self%kernel(d(1) + 1, d(2) + 1)
   end function entry_of

   !> Have more cells changed than there are columns for?
   pure function crowded(self) result(full)
      class(changed_set_type), intent(in) :: self
      logical :: full

      full = self%used >= size(self%changed, 2)
   end function crowded

   !> Take cells out of the set.
   subroutine leave(self, leaving, cells)
      class(changed_set_type), intent(inout) :: self
      logical, intent(in) :: leaving(:, :)
      integer, intent(out) :: cells                    !! how many there were
      integer :: i, j

      cells = 0
      do j = 1, size(leaving, 2)
         do i = 1, size(leaving, 1)
            if (.not. (leaving(i, j) .and. self%inside(i, j))) cycle
            cells = cells + 1
            self%inside(i, j) = .false.
            if (self%number(i, j) > 0) call add_column(self, i, j)
         end do
      end do
   end subroutine leave

   !> Take cells into the set.
   subroutine join(self, joining, cells)
      class(changed_set_type), intent(inout) :: self
      logical, intent(in) :: joining(:, :)
      integer, intent(out) :: cells                    !! how many there were
      integer :: i, j

      cells = 0
      do j = 1, size(joining, 2)
         do i = 1, size(joining, 1)
            if (.not. joining(i, j) .or. self%inside(i, j)) cycle
            cells = cells + 1
            self%inside(i, j) = .true.
            if (self%number(i, j) <= 0) call add_column(self, i, j)
         end do
      end do
   end subroutine join

   !> The column of a cell that changes for the first time; without room the next `refresh` sees it.
   subroutine add_column(self, i, j)
      type(changed_set_type), intent(inout) :: self
      integer, intent(in) :: i, j
      integer :: a, n

      do a = 1, self%used
         if (all(self%changed(:, a) == [i, j])) return
      end do
      if (self%crowded()) return
      self%used = self%used + 1
      n = self%used
      self%changed(:, n) = [i, j]
      if (self%number(i, j) > 0) then
         self%columns(:, n) = 0.0_dp
         self%columns(self%number(i, j), n) = 1.0_dp
      else
         self%number(i, j) = -n
         do a = 1, size(self%cells, 2)
            self%columns(a, n) = -entry_of(self, self%cells(:, a), [i, j])
         end do
      end if
      call solve_factors(self%matrix, self%columns(:, n))
   end subroutine add_column

   !> The pressure that gives the cells of the set the gap zero, and the load; it may be negative.
   subroutine solve(self, pressure, level, solved)
      class(changed_set_type), intent(in) :: self
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(out) :: level
      logical, intent(out) :: solved
      real(dp), allocatable :: system(:, :), x(:), p(:)
      integer, allocatable :: active(:)
      integer :: a, k, n

      n = size(self%cells, 2)
      active = pack([(k, k=1, self%used)], [(is_active(self, k), k=1, self%used)])
      k = size(active)
      solved = .false.
      level = 0.0_dp
      if (n == 0) return
      allocate (system(k + 1, k + 1), x(k + 1), p(n))
      do a = 1, k
         call row_of(self, active, a, system(a, :), x(a))
      end do
      do a = 1, k
         system(k + 1, a) = sum(self%columns(:, active(a))) + merge(0.0_dp, 1.0_dp, in_base(self, active(a)))
      end do
      system(k + 1, k + 1) = sum(self%base(:, 2))
      x(k + 1) = self%load - sum(self%base(:, 1))
      call eliminate(system, x, solved)
      if (.not. solved) return

      level = x(k + 1)
      p = self%base(:, 1) + level*self%base(:, 2)
      do a = 1, k
         p = p + x(a)*self%columns(:, active(a))
      end do
      solved = all(abs(p) < huge(1.0_dp))
      pressure = 0.0_dp
      do a = 1, n
         associate (i => self%cells(1, a), j => self%cells(2, a))
            if (self%inside(i, j)) pressure(i, j) = p(a)
         end associate
      end do
      do a = 1, k
         associate (cell => self%changed(:, active(a)))
            if (self%inside(cell(1), cell(2))) pressure(cell(1), cell(2)) = x(a)
         end associate
      end do
   end subroutine solve

   !> Does a changed cell differ from the set at the start?
   pure function is_active(self, k) result(active)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: k
      logical :: active

      active = self%inside(self%changed(1, k), self%changed(2, k)) .neqv. in_base(self, k)
   end function is_active

   !> Is a changed cell one of the set at the start?
   pure function in_base(self, k) result(is)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: k
      logical :: is

      is = self%number(self%changed(1, k), self%changed(2, k)) > 0
   end function in_base

   !> The condition of a changed cell: no pressure where it has left, no gap where it has joined.
   pure subroutine row_of(self, active, a, row, right)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: active(:)
      integer, intent(in) :: a
      real(dp), intent(out) :: row(:)                  !! for r or p of the changed cells, and the level
      real(dp), intent(out) :: right
      real(dp) :: reach(size(self%cells, 2))
      integer :: b, n

      associate (cell => self%changed(:, active(a)))
         if (in_base(self, active(a))) then
            n = self%number(cell(1), cell(2))
            row = [self%columns(n, active), self%base(n, 2)]
            right = -self%base(n, 1)
            return
         end if
         do b = 1, size(self%cells, 2)
            reach(b) = entry_of(self, cell, self%cells(:, b))
         end do
         do b = 1, size(active)
            row(b) = dot_product(reach, self%columns(:, active(b)))
            if (.not. in_base(self, active(b))) &
               row(b) = row(b) + entry_of(self, cell, self%changed(:, active(b)))
         end do
         row(size(row)) = dot_product(reach, self%base(:, 2)) - 1.0_dp
         right = self%height(cell(1), cell(2)) - dot_product(reach, self%base(:, 1))
      end associate
   end subroutine row_of

   !> Solve a small system by elimination with pivots.
   pure subroutine eliminate(a, x, solved)
      real(dp), intent(inout) :: a(:, :)
      real(dp), intent(inout) :: x(:)                  !! in: the right side
      logical, intent(out) :: solved
      real(dp) :: scale(size(x)), row(size(x)), value
      integer :: k, n, pivot

      n = size(x)
      scale = maxval(abs(a), dim=2)
      solved = all(scale > 0.0_dp)
      if (.not. solved) return
      do k = 1, n
         pivot = k - 1 + maxloc(abs(a(k:, k))/scale(k:), dim=1)
         solved = abs(a(pivot, k)) > tiny(1.0_dp)
         if (.not. solved) return
         row = a(pivot, :)
         a(pivot, :) = a(k, :)
         a(k, :) = row
         value = x(pivot)
         x(pivot) = x(k)
         x(k) = value
         scale(pivot) = scale(k)
         do pivot = k + 1, n
            value = a(pivot, k)/a(k, k)
            a(pivot, k + 1:) = a(pivot, k + 1:) - value*a(k, k + 1:)
            x(pivot) = x(pivot) - value*x(k)
         end do
      end do
      do k = n, 1, -1
         x(k) = (x(k) - dot_product(a(k, k + 1:), x(k + 1:)))/a(k, k)
      end do
   end subroutine eliminate

end module changed_set
