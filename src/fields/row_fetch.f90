!> Rows of a field that other processes hold.
!>
!> Each process holds some rows of every field (module `regular_grid`). A shift, an interpolation or a
!> stencil needs rows of other processes. `fetch_rows` brings them: every process names a range of rows, and
!> their owners send them. The rows travel in several rounds, so that the parcels take little memory.
!>
!> A range counts rows from 1 and may leave the grid. On a periodic grid the rows then repeat; beyond a
!> free grid they are zero. It may be empty, or longer than what the process holds. Where a grid is not shared
!> all rows are at hand, and are copied.
!>
!> The procedures are collective: every process calls them, be its range empty or not.
module row_fetch
   use asperity_parallel, only : exchange, gather_rows, process_count, process_number
   use asperity_precision, only : dp, int8
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: fetch_rows, foreign_rows, row_in_grid

   integer, parameter :: least_parcel = 65536       !! numbers that are sent at once in any case
   integer, parameter :: most_rounds = 16           !! of an exchange, where the parcels are larger

   !> Fetch the rows of a range.
   interface fetch_rows
      module procedure :: fetch_real_rows, fetch_byte_rows
   end interface fetch_rows

contains

   !> Rows of real numbers: those of a range, or only those of them that this process does not hold.
   subroutine fetch_real_rows(grid, field, range, rows, only_foreign)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)          !! [n, rows of this process]; n is the same for all
      integer, intent(in) :: range(2)              !! first and last row, from 1; none if the last is less
      real(dp), intent(inout) :: rows(:, :)        !! out: [n, number of rows], in the order of the range
      logical, intent(in), optional :: only_foreign   !! leave out rows of this process (`foreign_rows`)
      integer, allocatable :: ranges(:, :)
      logical :: all_rows
      integer :: first, most, p, step

      all_rows = .true.
      if (present(only_foreign)) all_rows = .not. only_foreign
      if (all_rows) call copy_own_rows(grid, field, range, rows)
      if (.not. grid%shared) return
      ranges = nint(gather_rows(reshape(real(range, dp), [2, 1])))
      most = 0
      do p = 0, process_count() - 1
         most = max(most, size(foreign_places(grid, ranges(:, p + 1), p)))
      end do
      step = max(1, least_parcel/size(field, 1), (most + most_rounds - 1)/most_rounds)
      do first = 1, most, step
         call fetch_some(grid, field, ranges, [first, first + step - 1], all_rows, rows)
      end do
   end subroutine fetch_real_rows

   !> The same for small integers. They travel as the bytes of real numbers.
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

   !> Row of the grid that a row of a range is, 0 beyond a free grid.
   elemental integer function row_in_grid(grid, row)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: row

      row_in_grid = row
      if (row >= 1 .and. row <= grid%ny) return
      row_in_grid = 0
      if (grid%boundary == boundary_periodic) row_in_grid = modulo(row - 1, grid%ny) + 1
   end function row_in_grid

   !> Rows of the grid in a range that this process does not hold, in the order of the range.
   pure function foreign_rows(grid, range) result(list)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: range(2)
      integer, allocatable :: list(:)

      list = row_in_grid(grid, range(1) - 1 + foreign_places(grid, range, process_number()))
   end function foreign_rows

   !> Which rows of a range a process does not hold, counted from the first of the range.
   pure function foreign_places(grid, range, process) result(places)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: range(2)
      integer, intent(in) :: process               !! from 0
      integer, allocatable :: places(:)
      integer :: own(2), row, j, n

      own = grid%rows_of(process)
      allocate (places(max(0, range(2) - range(1) + 1)))
      n = 0
      do j = 1, size(places)
         row = row_in_grid(grid, range(1) - 1 + j)
         if (row == 0 .or. (row >= own(1) .and. row <= own(2))) cycle
         n = n + 1
         places(n) = j
      end do
      places = places(:n)
   end function foreign_places

   !> The process that holds each row.
   pure function owners_of_rows(grid) result(owners)
      type(grid_type), intent(in) :: grid
      integer, allocatable :: owners(:)            !! from 0 [ny]
      integer :: p, own(2)

      allocate (owners(grid%ny))
      do p = 0, process_count() - 1
         own = grid%rows_of(p)
         owners(own(1):own(2)) = p
      end do
   end function owners_of_rows

   !> Copy the rows of a range that this process holds; rows beyond a free grid are zero.
   subroutine copy_own_rows(grid, field, range, rows)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)
      integer, intent(in) :: range(2)
      real(dp), intent(inout) :: rows(:, :)
      integer :: j, row

      !$omp parallel do default(none) shared(grid, field, range, rows) private(j, row)
      do j = 1, range(2) - range(1) + 1
         row = row_in_grid(grid, range(1) + j - 1)
         if (row == 0) then
            rows(:, j) = 0.0_dp
         else if (row >= grid%first_row .and. row <= grid%last_row) then
            rows(:, j) = field(:, row - grid%first_row + 1)
         end if
      end do
   end subroutine copy_own_rows

   !> One round of an exchange: a part of the rows that each process fetches.
   subroutine fetch_some(grid, field, ranges, part, all_rows, rows)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)
      integer, intent(in) :: ranges(:, :)          !! first and last row [2, processes]
      integer, intent(in) :: part(2)               !! first and last of the rows that a process fetches
      logical, intent(in) :: all_rows              !! rows of this process have their place, too
      real(dp), intent(inout) :: rows(:, :)
      real(dp), allocatable :: sent(:), received(:)
      integer, allocatable :: list(:), places(:), owners(:)
      integer :: counts(0:process_count() - 1, 2), starts(0:process_count() - 1), k, n, p

      n = size(field, 1)
      call pack_rows(grid, field, ranges, part, sent, counts(:, 1))
      places = part_of(foreign_places(grid, ranges(:, process_number() + 1), process_number()), part)
      list = row_in_grid(grid, ranges(1, process_number() + 1) - 1 + places)
      owners = owners_of_rows(grid)
      do p = 0, process_count() - 1
         counts(p, 2) = n*count(owners(list) == p)
         starts(p) = sum(counts(:p - 1, 2))
      end do
      allocate (received(sum(counts(:, 2))))
      call exchange(sent, counts(:, 1), received, counts(:, 2))
      if (.not. all_rows) places = [(part(1) + k - 1, k=1, size(list))]
      do k = 1, size(list)
         p = owners(list(k))
         rows(:, places(k)) = received(starts(p) + 1:starts(p) + n)
         starts(p) = starts(p) + n
      end do
   end subroutine fetch_some

   !> The parcels of a round: rows of this process that others fetch.
   subroutine pack_rows(grid, field, ranges, part, sent, counts)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)
      integer, intent(in) :: ranges(:, :), part(2)
      real(dp), allocatable, intent(out) :: sent(:)
      integer, intent(out) :: counts(0:)           !! numbers for each process
      integer, allocatable :: list(:)
      logical, allocatable :: held(:)
      integer :: at, k, n, p, attempt

      ! First count, then copy.
      n = size(field, 1)
      do attempt = 1, 2
         at = 0
         do p = 0, process_count() - 1
            list = row_in_grid(grid, ranges(1, p + 1) - 1 &
               + part_of(foreign_places(grid, ranges(:, p + 1), p), part))
            held = list >= grid%first_row .and. list <= grid%last_row
            counts(p) = n*count(held)
            if (attempt == 1) cycle
            list = pack(list, held) - grid%first_row + 1
            do k = 1, size(list)
               sent(at + 1:at + n) = field(:, list(k))
               at = at + n
            end do
         end do
         if (attempt == 1) allocate (sent(sum(counts)))
      end do
   end subroutine pack_rows

   !> The part of a list that is fetched in a round.
   pure function part_of(list, part) result(some)
      integer, intent(in) :: list(:), part(2)
      integer, allocatable :: some(:)

      some = list(part(1):min(part(2), size(list)))
   end function part_of

end module row_fetch
