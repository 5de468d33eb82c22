!> Solves the contact on a set of cells directly with a dense matrix, also after a few cells have changed.
!>
!> The matrix K of the set C0 at the start is factored once. If the cells L have left and the cells J have joined, the
!> pressures of C0 are
!>
!>     p0 = K^-1 (h + level + sum over L of r_b e_b - sum over J of p_j k_j)
!>
!> where h are the heights of the road, r_b is the gap that opens at a cell b that has left, e_b its unit vector, and k_j
!> the displacement of C0 under a unit pressure p_j on a joined cell. The conditions p0 = 0 on L, K p = h + level on J
!> and the load are a small system for r, p_j and the level. Its columns K^-1 e_b and K^-1 k_j are kept, so that a
!> changed cell costs one pair of triangular solves.
!>
!> If processes share the rows, each has its rows of the fields, and all of them solve the same systems. Cells are
!> identified by their position in the whole grid and listed in the order of its rows. The displacements that the
!> systems need are summed over the processes, of which only one has each of them.
!>
!> Memory: the matrix, and a column for each cell that has changed.
module changed_set
   use asperity_parallel, only : gather_rows, global_sum
   use asperity_precision, only : dp
   use dense_factors, only : factor, solve_factors
   use regular_grid, only : grid_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: changed_set_type, new_changed_set

   !> A set of cells in contact. A variable of this type must not be copied.
   type :: changed_set_type
      integer :: factors = 0                           !! number of factorisations so far
      integer, private :: threads = 1
      type(grid_type), private :: grid
      real(dp), private :: load = 0.0_dp               !! sum of P over the cells, Pa
      ! Fields of the rows of this process:
      real(dp), allocatable, private :: kernel(:, :)   !! displacement by the first cell's unit pressure
      real(dp), allocatable, private :: height(:, :)   !! m
      logical, allocatable, private :: inside(:, :)    !! the set C
      integer, allocatable, private :: number(:, :)    !! number of a cell in C0; negative for joined cells
      ! Lists and systems, the same on all processes:
      integer, allocatable, private :: cells(:, :)     !! C0, column and row of the grid [2, n]
      integer, allocatable, private :: changed(:, :)   !! cells of L and J, [2, k]; some may have changed back
      integer, allocatable, private :: origin(:)       !! their number in C0; 0 if they were not in it
      logical, allocatable, private :: held(:)         !! are they in C now?
      real(dp), allocatable, private :: right(:)       !! their height, m
      real(dp), allocatable, private :: matrix(:, :)   !! factors
      real(dp), allocatable, private :: base(:, :)     !! K^-1 h, K^-1 1
      real(dp), allocatable, private :: columns(:, :)  !! of the changed cells
      integer, private :: used = 0                     !! changed cells
   contains
      procedure :: refresh
      procedure :: is_full
      procedure :: solve
      procedure :: leave
      procedure :: join
   end type changed_set_type

contains

   !> Store a set of cells, and factor its matrix.
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
      allocate (self%number(size(height, 1), size(height, 2)), source=0)
      self%grid = operator%grid
      self%load = load
      self%threads = operator%threads
      work = 0.0_dp
      if (has_row(self, 1)) work(1, 1) = 1.0_dp
      call operator%displace(work, self%kernel)
      call self%refresh()
   end subroutine new_changed_set

   !> Factor the matrix of the present set.
   subroutine refresh(self)
      class(changed_set_type), intent(inout) :: self
      real(dp), allocatable :: listed(:, :)
      integer :: a, b, n, room

      call list_cells(self, self%inside, listed)
      n = size(listed, 2)
      if (allocated(self%cells)) deallocate (self%cells, self%matrix, self%base, self%changed, self%columns, &
         self%origin, self%held, self%right)
      room = max(48, n/4)
      allocate (self%cells(2, n), self%matrix(n, n), self%base(n, 2), self%changed(2, room), &
         self%columns(n, room), self%origin(room), self%held(room), self%right(room))

      self%used = 0
      self%factors = self%factors + 1
      self%number = 0
      self%cells(:, :) = nint(listed(1:2, :))
      do a = 1, n
         call set_number(self, self%cells(:, a), a)
      end do

      !$omp parallel do default(none) shared(self, n) private(a, b) num_threads(self%threads)
      do b = 1, n
         do a = 1, n
            self%matrix(a, b) = local_entry(self, self%cells(:, a), self%cells(:, b))
         end do
      end do
      if (self%grid%shared) then
         do b = 1, n
            self%matrix(:, b) = global_sum(self%matrix(:, b))
         end do
      end if

      call factor(self%matrix, self%threads)
      self%base(:, 1) = listed(4, :)
      self%base(:, 2) = 1.0_dp
      call solve_factors(self%matrix, self%base(:, 1))
      call solve_factors(self%matrix, self%base(:, 2))
   end subroutine refresh

   !> List the cells of all processes for which a condition holds, in the order of the rows of the grid.
   subroutine list_cells(self, condition, listed)
      type(changed_set_type), intent(in) :: self
      logical, intent(in) :: condition(:, :)           !! [nx, rows]
      real(dp), allocatable, intent(out) :: listed(:, :)   !! column, row of the grid, number, height [4, n]
      real(dp), allocatable :: here(:, :)
      integer :: i, j, n

      allocate (here(4, count(condition)))
      n = 0
      do j = 1, size(condition, 2)
         do i = 1, size(condition, 1)
            if (.not. condition(i, j)) cycle
            n = n + 1
            here(:, n) = [real(i, dp), real(self%grid%first_row - 1 + j, dp), real(self%number(i, j), dp), &
               self%height(i, j)]
         end do
      end do
      if (self%grid%shared) then
         listed = gather_rows(here)
      else
         call move_alloc(here, listed)
      end if
   end subroutine list_cells

   !> Does this process have a row of the grid?
   pure function has_row(self, row) result(yes)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: row
      logical :: yes

      yes = row >= self%grid%first_row .and. row <= self%grid%last_row
   end function has_row

   !> Set the number of a cell on the process that has it.
   pure subroutine set_number(self, cell, number)
      type(changed_set_type), intent(inout) :: self
      integer, intent(in) :: cell(2)
      integer, intent(in) :: number

      if (has_row(self, cell(2))) self%number(cell(1), cell(2) - self%grid%first_row + 1) = number
   end subroutine set_number

   !> Displacement of one cell under the pressure of another. Only one process knows it; it is zero on all others.
   pure function local_entry(self, at, by) result(displacement)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: at(2), by(2)
      real(dp) :: displacement
      integer :: d(2)

      d = modulo(at - by, [self%grid%nx, self%grid%ny]) + 1
      displacement = 0.0_dp
      if (has_row(self, d(2))) displacement = self%kernel(d(1), d(2) - self%grid%first_row + 1)
   end function local_entry

   !> Have more cells changed than there are columns for?
   pure function is_full(self) result(full)
      class(changed_set_type), intent(in) :: self
      logical :: full

      full = self%used >= size(self%changed, 2)
   end function is_full

   !> Remove cells from the set.
   subroutine leave(self, leaving, cells)
      class(changed_set_type), intent(inout) :: self
      logical, intent(in) :: leaving(:, :)
      integer, intent(out) :: cells                    !! how many there were

      call change_cells(self, leaving .and. self%inside, .false., cells)
   end subroutine leave

   !> Add cells to the set.
   subroutine join(self, joining, cells)
      class(changed_set_type), intent(inout) :: self
      logical, intent(in) :: joining(:, :)
      integer, intent(out) :: cells                    !! how many there were

      call change_cells(self, joining .and. .not. self%inside, .true., cells)
   end subroutine join

   !> Add cells to the set, or remove them. A cell that differs from C0 for the first time gets a column.
   subroutine change_cells(self, condition, joins, cells)
      type(changed_set_type), intent(inout) :: self
      logical, intent(in) :: condition(:, :)
      logical, intent(in) :: joins
      integer, intent(out) :: cells
      real(dp), allocatable :: listed(:, :)
      integer :: cell(2), k, m, origin

      call list_cells(self, condition, listed)
      cells = size(listed, 2)
      do m = 1, cells
         cell = nint(listed(1:2, m))
         origin = max(nint(listed(3, m)), 0)
         if (has_row(self, cell(2))) self%inside(cell(1), cell(2) - self%grid%first_row + 1) = joins
         do k = self%used, 1, -1
            if (all(self%changed(:, k) == cell)) exit
         end do
         if (k == 0 .and. (origin > 0 .neqv. joins) .and. .not. self%is_full()) then
            call add_column(self, cell, origin, listed(4, m))
            k = self%used
         end if
         if (k > 0) self%held(k) = joins
      end do
   end subroutine change_cells

   !> Add the column of a cell that changes for the first time. If there is no space, the cell has no column until
   !> the next `refresh` includes it.
   subroutine add_column(self, cell, origin, height)
      type(changed_set_type), intent(inout) :: self
      integer, intent(in) :: cell(2)
      integer, intent(in) :: origin                    !! its number in C0, or 0
      real(dp), intent(in) :: height                   !! m
      integer :: a, n

      self%used = self%used + 1
      n = self%used
      self%changed(:, n) = cell
      self%origin(n) = origin
      self%right(n) = height
      if (origin > 0) then
         self%columns(:, n) = 0.0_dp
         self%columns(origin, n) = 1.0_dp
      else
         call set_number(self, cell, -n)
         do a = 1, size(self%cells, 2)
            self%columns(a, n) = -local_entry(self, self%cells(:, a), cell)
         end do
         if (self%grid%shared) self%columns(:, n) = global_sum(self%columns(:, n))
      end if
      call solve_factors(self%matrix, self%columns(:, n))
   end subroutine add_column

   !> Compute the pressure that gives the cells of the set the gap zero, and the load. It may be negative.
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
         system(k + 1, a) = sum(self%columns(:, active(a))) + merge(0.0_dp, 1.0_dp, self%origin(active(a)) > 0)
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
         call set_pressure(self, self%cells(:, a), p(a), pressure)
      end do
      do a = 1, k
         call set_pressure(self, self%changed(:, active(a)), x(a), pressure)
      end do
   end subroutine solve

   !> Set the pressure of a cell that is in the set, on the process that has it.
   pure subroutine set_pressure(self, cell, value, pressure)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: cell(2)
      real(dp), intent(in) :: value
      real(dp), intent(inout) :: pressure(:, :)

      if (.not. has_row(self, cell(2))) return
      associate (i => cell(1), j => cell(2) - self%grid%first_row + 1)
         if (self%inside(i, j)) pressure(i, j) = value
      end associate
   end subroutine set_pressure

   !> Does a changed cell differ from the set at the start?
   pure function is_active(self, k) result(active)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: k
      logical :: active

      active = self%held(k) .neqv. self%origin(k) > 0
   end function is_active

   !> Form the equation of a changed cell: no pressure if it has left, and no gap if it has joined.
   subroutine row_of(self, active, a, row, right)
      type(changed_set_type), intent(in) :: self
      integer, intent(in) :: active(:)
      integer, intent(in) :: a
      real(dp), intent(out) :: row(:)                  !! for r or p of the changed cells, and the level
      real(dp), intent(out) :: right
      real(dp), allocatable :: displacement(:)                !! displacement by the cells of C0, then by the active ones
      integer :: b, n, origin

      n = size(self%cells, 2)
      associate (cell => self%changed(:, active(a)))
         origin = self%origin(active(a))
         if (origin > 0) then
            row = [self%columns(origin, active), self%base(origin, 2)]
            right = -self%base(origin, 1)
            return
         end if
         allocate (displacement(n + size(active)))
         do b = 1, n
            displacement(b) = local_entry(self, cell, self%cells(:, b))
         end do
         do b = 1, size(active)
            displacement(n + b) = local_entry(self, cell, self%changed(:, active(b)))
         end do
         if (self%grid%shared) displacement = global_sum(displacement)
         do b = 1, size(active)
            row(b) = dot_product(displacement(:n), self%columns(:, active(b)))
            if (self%origin(active(b)) == 0) row(b) = row(b) + displacement(n + b)
         end do
         row(size(row)) = dot_product(displacement(:n), self%base(:, 2)) - 1.0_dp
         right = self%right(active(a)) - dot_product(displacement(:n), self%base(:, 1))
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
