!> Work on whole columns of a field whose rows the processes share.
!>
!> Blocks of columns are copied to a buffer, processed there, and copied back. If processes share the rows,
!> each of them processes some of the blocks, which are exchanged before and afterwards. The exchange is done
!> in rounds, so that the parcels (the numbers that are sent at once) take little memory. One thread processes
!> a block, and all blocks have the same width, so that the result does not depend on the number of threads
!> or processes.
module field_columns
   use asperity_parallel, only : process_count, process_number
   use process_exchange, only : exchange, least_parcel, most_rounds
   use asperity_precision, only : dp, int64
   use regular_grid, only : grid_type
   implicit none
   private

   public :: column_work_type, work_on_columns

   integer, parameter, public :: block = 16     !! columns that are processed together

   !> The work on the columns, which an extension of this type defines.
   type, abstract :: column_work_type
      integer :: before = 0                     !! extra elements before a column, for the work
      integer :: behind = 0                     !! extra elements behind it
   contains
      procedure(work_on_block), deferred :: work
   end type column_work_type

   abstract interface
      !> Process a block of columns. Several threads call this at the same time, for different blocks.
      subroutine work_on_block(self, first, columns)
         import :: column_work_type, dp
         class(column_work_type), intent(in) :: self
         integer, intent(in) :: first                   !! number of the first column, from 1
         !> [block, before + ny + behind]: a column is columns(k, before + 1:before + ny). Columns
         !> beyond the last one of the field have arbitrary values.
         real(dp), intent(inout) :: columns(:, :)
      end subroutine work_on_block
   end interface

contains

   !> Process all columns of a field. Collective.
   subroutine work_on_columns(grid, field, worker)
      type(grid_type), intent(in) :: grid
      real(dp), intent(inout) :: field(:, :)            !! [n, rows of this process]; n is the same for all
      class(column_work_type), intent(in) :: worker
      real(dp), allocatable :: rows_parcel(:), columns_parcel(:)
      integer, allocatable :: counts(:, :), rows(:)
      integer :: blocks, round, rounds

      blocks = (size(field, 1) + block - 1)/block
      if (.not. grid%shared) then
         call work_on_blocks(grid, worker, [1, blocks], field)
         return
      end if
      rows = rows_of_all(grid)
      rounds = round_count(blocks, rows)
      do round = 1, rounds
         counts = parcel_counts(rows, round, rounds, blocks)
         allocate (rows_parcel(sum(counts(:, 1))), columns_parcel(sum(counts(:, 2))))
         call pack_blocks(grid, round, rounds, .true., field, rows_parcel)
         call exchange(rows_parcel, counts(:, 1), columns_parcel, counts(:, 2))
         call work_on_parcels(grid, worker, blocks_of(process_number(), round, rounds, blocks), columns_parcel)
         call exchange(columns_parcel, counts(:, 2), rows_parcel, counts(:, 1))
         call pack_blocks(grid, round, rounds, .false., field, rows_parcel)
         deallocate (rows_parcel, columns_parcel)
      end do
   end subroutine work_on_columns

   !> Process blocks of a field of which this process holds all rows.
   subroutine work_on_blocks(grid, worker, range, field)
      type(grid_type), intent(in) :: grid
      class(column_work_type), intent(in) :: worker
      integer, intent(in) :: range(2)                   !! first and last block
      real(dp), intent(inout) :: field(:, :)
      real(dp), allocatable :: columns(:, :)
      integer :: b, first, j, last

      !$omp parallel default(none) shared(grid, worker, range, field) private(b, first, j, last, columns)
      allocate (columns(block, worker%before + grid%ny + worker%behind), source=0.0_dp)
      !$omp do
      do b = range(1), range(2)
         first = (b - 1)*block + 1
         last = min(first + block - 1, size(field, 1))
         do j = 1, grid%ny
            columns(:last - first + 1, worker%before + j) = field(first:last, j)
         end do
         call worker%work(first, columns)
         do j = 1, grid%ny
            field(first:last, j) = columns(:last - first + 1, worker%before + j)
         end do
      end do
      deallocate (columns)
      !$omp end parallel
   end subroutine work_on_blocks

   !> Process blocks whose columns have been received from all processes.
   subroutine work_on_parcels(grid, worker, range, parcels)
      type(grid_type), intent(in) :: grid
      class(column_work_type), intent(in) :: worker
      integer, intent(in) :: range(2)                   !! first and last block
      !> The parcels lie in the order of the processes, and so do the rows: [block, blocks, ny].
      real(dp), intent(inout) :: parcels(block, range(2) - range(1) + 1, grid%ny)
      real(dp), allocatable :: columns(:, :)
      integer :: b, j

      !$omp parallel default(none) shared(grid, worker, range, parcels) private(b, j, columns)
      allocate (columns(block, worker%before + grid%ny + worker%behind), source=0.0_dp)
      !$omp do
      do b = range(1), range(2)
         do j = 1, grid%ny
            columns(:, worker%before + j) = parcels(:, b - range(1) + 1, j)
         end do
         call worker%work((b - 1)*block + 1, columns)
         do j = 1, grid%ny
            parcels(:, b - range(1) + 1, j) = columns(:, worker%before + j)
         end do
      end do
      deallocate (columns)
      !$omp end parallel
   end subroutine work_on_parcels

   !> Number of rows of each process.
   pure function rows_of_all(grid) result(rows)
      type(grid_type), intent(in) :: grid
      integer, allocatable :: rows(:)
      integer :: p, own(2)

      allocate (rows(process_count()))
      do p = 1, process_count()
         own = grid%rows_of(p - 1)
         rows(p) = own(2) - own(1) + 1
      end do
   end function rows_of_all

   !> Number of rounds of the exchange, the same for all processes.
   pure function round_count(blocks, rows) result(rounds)
      integer, intent(in) :: blocks
      integer, intent(in) :: rows(:)                    !! of each process
      integer :: rounds

      rounds = ceiling(real(block, dp)*blocks*maxval(rows)/least_parcel)
      rounds = max(1, min(most_rounds, rounds))
   end function round_count

   !> First and last block of columns that a process handles in a round.
   pure function blocks_of(process, round, rounds, blocks) result(range)
      integer, intent(in) :: process                    !! from 0
      integer, intent(in) :: round, rounds, blocks
      integer :: range(2)
      integer :: n, parts

      parts = process_count()*rounds
      n = process*rounds + round
      range = [int(int(n - 1, int64)*blocks/parts) + 1, int(int(n, int64)*blocks/parts)]
   end function blocks_of

   !> How many numbers this process sends to each process (1), and receives from each (2), before the work.
   pure function parcel_counts(rows, round, rounds, blocks) result(counts)
      integer, intent(in) :: rows(:)                    !! of each process
      integer, intent(in) :: round, rounds, blocks
      integer, allocatable :: counts(:, :)
      integer :: own(2), range(2), p

      allocate (counts(size(rows), 2))
      own = blocks_of(process_number(), round, rounds, blocks)
      do p = 1, size(rows)
         range = blocks_of(p - 1, round, rounds, blocks)
         counts(p, 1) = block*(range(2) - range(1) + 1)*rows(process_number() + 1)
         counts(p, 2) = block*(own(2) - own(1) + 1)*rows(p)
      end do
   end function parcel_counts

   !> Copy the blocks of a round from the rows to their parcel, or back: for each process row by row.
   subroutine pack_blocks(grid, round, rounds, forward, field, parcel)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: round, rounds
      logical, intent(in) :: forward                    !! to the parcel
      real(dp), intent(inout) :: field(:, :)
      real(dp), intent(inout) :: parcel(:)
      integer :: at, first, j, last, p, range(2), width

      at = 0
      do p = 0, process_count() - 1
         range = blocks_of(p, round, rounds, (size(field, 1) + block - 1)/block)
         first = (range(1) - 1)*block + 1
         width = (range(2) - range(1) + 1)*block
         last = min(first + width - 1, size(field, 1))
         do j = 1, grid%rows()
            if (forward) then
               parcel(at + 1:at + last - first + 1) = field(first:last, j)
               parcel(at + last - first + 2:at + width) = 0.0_dp
            else
               field(first:last, j) = parcel(at + 1:at + last - first + 1)
            end if
            at = at + width
         end do
      end do
   end subroutine pack_blocks

end module field_columns
