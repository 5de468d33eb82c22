!> Rows of a field that other processes hold.
!>
!> Each process holds some rows of every field (modules `regular_grid` and `row_sharing`). A shift, an
!> interpolation or a stencil reads rows of others, too: the halo of a process. The type `row_halo_type`
!> holds the list of rows that each process needs, and fetches them whenever their values have changed. They
!> are put behind the rows of this process in the same field, or into an array of their own. The component
!> `place` then gives the position of each row.
!>
!> The rows that a process needs either follow from the grid, so that all processes know them (`new_row_halo`,
!> and for stencils `new_rim_halo` and `fetch_beside`), or each process states them as a range
!> (`new_range_halo`, `fetch_rows`).
!>
!> A range counts rows from 1 and may leave the grid: on a periodic grid the rows then repeat, and beyond a free
!> grid they are zero. It may be empty, or longer than what the process holds. If a grid is not
!> shared, every process holds all rows and nothing is fetched.
!>
!> Fetching rows and stating a range are collective: every process must call them, even one that needs no rows.
module row_halo
   use asperity_parallel, only : gather_rows, process_count, process_number
   use process_exchange, only : exchange, least_parcel, most_rounds
   use asperity_precision, only : dp, int8, sp
   use regular_grid, only : grid_type
   use row_sharing, only : row_sharing_type, sharing_on_grid
   implicit none
   private

   public :: fetch_beside, fetch_rows, new_range_halo, new_rim_halo, new_row_halo, row_halo_type

   !> The rows of others that a process needs.
   type :: row_halo_type
      integer :: own = 0                   !! rows of this process
      integer :: foreign = 0               !! rows of others that it needs
      integer, allocatable :: row(:)       !! which rows of the whole field these are [foreign]
      !> Where each row of the whole field is: first the rows of this process, then those in `row`; 0: not here.
      integer, allocatable :: place(:)
      integer, private :: rim(2) = 0       !! places of the rows of a stencil; 0: none
      logical, private :: shared = .false.
      integer, private :: most = 0                         !! rows that one process needs at most
      integer, allocatable, private :: receive_counts(:)   !! rows from each process
      integer, allocatable, private :: send_counts(:)      !! rows for each process ...
      integer, allocatable, private :: sent(:)             !! ... and their places
   contains
      generic :: fetch => fetch_behind, fetch_apart
      procedure, private :: fetch_behind, fetch_apart
      procedure :: close_rim
   end type row_halo_type

   !> Fetch the rows of a range.
   interface fetch_rows
      module procedure :: fetch_real_rows, fetch_byte_rows
   end interface fetch_rows

contains

   ! --- which rows are needed ----------------------------------------------------------------

   !> Prepare to fetch given rows: process users(k) needs row rows(k). Pairs may be repeated, and may name rows
   !> that the process holds itself. All processes must give the same pairs.
   pure subroutine new_row_halo(self, sharing, rows, users)
      type(row_halo_type), intent(out) :: self
      type(row_sharing_type), intent(in) :: sharing
      integer, intent(in) :: rows(:)
      integer, intent(in) :: users(:)      !! process, from 0
      integer, allocatable :: held(:), takers(:)
      logical :: needed(size(sharing%owner)), wanted(size(sharing%own))
      integer :: needs(0:process_count() - 1), k, me, p

      self%shared = sharing%shared
      self%own = size(sharing%own)
      allocate (self%place(size(sharing%owner)), source=0)
      self%place(sharing%own) = [(k, k=1, self%own)]
      allocate (self%sent(0), self%row(0))
      if (.not. self%shared) return
      allocate (self%receive_counts(process_count()), self%send_counts(process_count()), source=0)
      me = process_number()

      ! What this process sends: the rows for the first process, those for the second, and so on.
      held = pack(self%place(rows), sharing%owner(rows) == me .and. users /= me)
      takers = pack(users, sharing%owner(rows) == me .and. users /= me)
      do p = 0, process_count() - 1
         wanted = .false.
         wanted(pack(held, takers == p)) = .true.
         self%send_counts(p + 1) = count(wanted)
         self%sent = [self%sent, pack([(k, k=1, self%own)], wanted)]
      end do

      ! What it receives, in the same order.
      needed = .false.
      needed(pack(rows, users == me)) = .true.
      needed = needed .and. sharing%owner /= me
      self%row = pack(sharing%order, needed(sharing%order))
      self%foreign = size(self%row)
      self%place(self%row) = self%own + [(k, k=1, self%foreign)]
      needs = 0
      do k = 1, size(rows)
         if (sharing%owner(rows(k)) /= users(k)) needs(users(k)) = needs(users(k)) + 1
      end do
      self%most = maxval(needs)
      do k = 1, self%foreign
         p = sharing%owner(self%row(k)) + 1
         self%receive_counts(p) = self%receive_counts(p) + 1
      end do
   end subroutine new_row_halo

   !> Prepare to fetch rows of a grid, where each process states the range that it needs. Collective.
   subroutine new_range_halo(self, grid, range)
      type(row_halo_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: range(2)      !! first and last row, from 1; none if the last is less
      integer, allocatable :: ranges(:, :), rows(:), users(:)
      integer :: j, p

      allocate (rows(0), users(0))
      if (grid%shared) then
         ranges = nint(gather_rows(reshape(real(range, dp), [2, 1])))
         rows = [((j, j=ranges(1, p), ranges(2, p)), p=1, process_count())]
         users = [((p - 1, j=ranges(1, p), ranges(2, p)), p=1, process_count())]
      end if
      call new_grid_halo(self, grid, rows, users)
   end subroutine new_range_halo

   !> Prepare for a stencil: the rows before the first and behind the last one of each process.
   pure subroutine new_rim_halo(self, grid)
      type(row_halo_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer, allocatable :: rows(:), users(:)
      integer :: beside(2), k, own(2), p

      allocate (rows(0), users(0))
      do p = 0, process_count() - 1
         own = grid%rows_of(p)
         if (own(2) < own(1)) cycle                ! a process without rows needs none
         rows = [rows, own + [-1, 1]]
         users = [users, p, p]
      end do
      call new_grid_halo(self, grid, rows, users)
      if (self%own == 0) return
      beside = grid%row_at([grid%first_row - 1, grid%last_row + 1])
      do k = 1, 2
         if (beside(k) > 0) self%rim(k) = self%place(beside(k))
      end do
   end subroutine new_rim_halo

   !> Prepare for rows of a grid, some of which may lie beyond it.
   pure subroutine new_grid_halo(self, grid, rows, users)
      type(row_halo_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: rows(:)
      integer, intent(in) :: users(:)

      associate (there => grid%row_at(rows))
         call new_row_halo(self, sharing_on_grid(grid), pack(there, there > 0), pack(users, there > 0))
      end associate
   end subroutine new_grid_halo

   ! --- fetching the rows (collective) -------------------------------------------------------

   !> Fetch the rows of others into the same field, behind the rows of this process.
   subroutine fetch_behind(self, field)
      class(row_halo_type), intent(in) :: self
      real(dp), intent(inout) :: field(:, :)       !! [n, own + foreign]; n is the same for all

      call self%fetch_apart(field(:, :self%own), field(:, self%own + 1:))
   end subroutine fetch_behind

   !> Fetch the rows of others into an array of their own. They are sent in several rounds, each with a part of
   !> every row, so that the parcels take little memory.
   subroutine fetch_apart(self, field, rows, columns)
      class(row_halo_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :)          !! [n, own]
      real(dp), intent(inout) :: rows(:, :)        !! out: [n, foreign]
      integer, intent(in), optional :: columns(:)  !! where row k goes: rows(:, columns(k)); default: rows(:, k)
      real(dp), allocatable :: parcel(:), received(:)
      integer :: first, k, n, to, width

      if (self%most == 0) return
      width = max(1, least_parcel/self%most, (size(field, 1) + most_rounds - 1)/most_rounds)
      do first = 1, size(field, 1), width
         n = min(width, size(field, 1) - first + 1)
         allocate (parcel(n*size(self%sent)), received(n*self%foreign))
         do k = 1, size(self%sent)
            parcel((k - 1)*n + 1:k*n) = field(first:first + n - 1, self%sent(k))
         end do
         call exchange(parcel, n*self%send_counts, received, n*self%receive_counts)
         do k = 1, self%foreign
            to = k
            if (present(columns)) to = columns(k)
            rows(first:first + n - 1, to) = received((k - 1)*n + 1:k*n)
         end do
         deallocate (parcel, received)
      end do
   end subroutine fetch_apart

   !> Set the rim of a field in single precision, one more row on either side of those of this process, after
   !> `new_rim_halo`. Beyond a free grid it is not changed. Within a parallel region only one thread may call this.
   subroutine close_rim(self, field)
      class(row_halo_type), intent(in) :: self
      real(sp), intent(inout) :: field(:, 0:)      !! [n, 0:own + 1]
      real(sp), allocatable :: parcel(:), received(:)
      integer :: k, n

      n = size(field, 1)
      if (self%shared) then
         parcel = reshape(field(:, self%sent), [n*size(self%sent)])
         allocate (received(n*self%foreign))
         call exchange(parcel, n*self%send_counts, received, n*self%receive_counts)
      end if
      do k = 1, 2
         associate (at => self%rim(k), row => merge(0, self%own + 1, k == 1))
            if (at >= 1 .and. at <= self%own) field(:, row) = field(:, at)
            if (at > self%own) field(:, row) = received((at - self%own - 1)*n + 1:(at - self%own)*n)
         end associate
      end do
   end subroutine close_rim

   !> Fetch the rows of a range of real numbers, each process its own range.
   subroutine fetch_real_rows(grid, field, range, rows)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)          !! [n, rows of this process]; n is the same for all
      integer, intent(in) :: range(2)              !! first and last row, from 1; none if the last is less
      real(dp), intent(inout) :: rows(:, :)        !! out: [n, number of rows], in the order of the range
      type(row_halo_type) :: halo
      integer :: column(grid%ny), j, row

      call new_range_halo(halo, grid, range)
      do j = range(2), range(1), -1
         row = grid%row_at(j)
         if (row > 0) column(row) = j - range(1) + 1
      end do
      call halo%fetch(field, rows, column(halo%row))
      !$omp parallel do default(none) shared(grid, field, range, rows, halo, column) private(j, row)
      do j = 1, range(2) - range(1) + 1
         row = grid%row_at(range(1) - 1 + j)
         if (row == 0) then
            rows(:, j) = 0.0_dp
         else if (halo%place(row) <= halo%own) then
            rows(:, j) = field(:, halo%place(row))
         else if (column(row) /= j) then
            rows(:, j) = rows(:, column(row))      ! the range is longer than the period
         end if
      end do
   end subroutine fetch_real_rows

   !> Fetch the rows of a range of small integers, which are sent as the bytes of real numbers.
   subroutine fetch_byte_rows(grid, field, range, rows)
      type(grid_type), intent(in) :: grid
      integer(int8), intent(in) :: field(:, :)     !! [n, rows of this process]
      integer, intent(in) :: range(2)              !! as above
      integer(int8), intent(out) :: rows(:, :)     !! [n, number of rows]
      real(dp), allocatable :: parcels(:, :), fetched(:, :)
      integer(int8), allocatable :: bytes(:)
      integer :: j, n

      n = (size(field, 1) + 7)/8
      allocate (bytes(8*n), source=0_int8)
      allocate (parcels(n, size(field, 2)), fetched(n, size(rows, 2)))
      do j = 1, size(field, 2)
         bytes(:size(field, 1)) = field(:, j)
         parcels(:, j) = transfer(bytes, parcels)
      end do
      call fetch_real_rows(grid, parcels, range, fetched)
      do j = 1, size(rows, 2)
         bytes(:) = transfer(fetched(:, j), bytes)
         rows(:, j) = bytes(:size(rows, 1))
      end do
   end subroutine fetch_byte_rows

   !> Fetch the row before the first and the row behind the last one of this process, for stencils. They are zero
   !> beyond a free grid, and on a process without rows.
   subroutine fetch_beside(grid, field, beside)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)          !! [n, rows of this process]
      real(dp), intent(out) :: beside(:, :)        !! [n, 2]
      type(row_halo_type) :: halo
      real(dp), allocatable :: foreign(:, :)
      integer :: k

      call new_rim_halo(halo, grid)
      allocate (foreign(size(field, 1), halo%foreign))
      call halo%fetch(field, foreign)
      do k = 1, 2
         associate (at => halo%rim(k))
            beside(:, k) = 0.0_dp
            if (at >= 1 .and. at <= halo%own) beside(:, k) = field(:, at)
            if (at > halo%own) beside(:, k) = foreign(:, at - halo%own)
         end associate
      end do
   end subroutine fetch_beside

end module row_halo
