!> Says which process holds which rows of a field if these are not consecutive.
!>
!> The rows of the road's grid are shared in consecutive parts (module `regular_grid`). Related fields, such
!> as padded or coarser ones, are shared in such a way that one process holds the rows that are used together:
!> row j of the padding with row j of the road, and a coarse row with the rows around its centre. A process
!> keeps its rows in ascending order.
module row_sharing
   use asperity_parallel, only : gather_rows, process_count, process_number
   use asperity_precision, only : dp
   use field_sums, only : added, row_totals
   use regular_grid, only : grid_type
   implicit none
   private

   public :: new_row_sharing, owners_on_grid, row_sharing_type, sharing_on_grid

   !> The rows of all processes.
   type :: row_sharing_type
      logical :: shared = .false.          !! other processes hold other rows
      integer, allocatable :: owner(:)     !! process of each row of the whole field, from 0
      integer, allocatable :: rows_of(:)   !! number of rows of each process; of all where they are not shared
      integer, allocatable :: order(:)     !! rows of the whole field, in the order of the processes
      integer, allocatable :: own(:)       !! rows of the whole field that this process holds
   contains
      procedure :: totals
   end type row_sharing_type

contains

   !> Share rows by their owners.
   pure subroutine new_row_sharing(self, owner, shared)
      type(row_sharing_type), intent(out) :: self
      integer, intent(in) :: owner(:)      !! process of each row, from 0
      logical, intent(in) :: shared        !! .false.: every process holds all rows
      integer :: j, p, next(0:process_count())     ! where the next row of each process goes

      self%shared = shared
      self%owner = owner
      self%order = [(j, j=1, size(owner))]
      self%own = self%order
      self%rows_of = [size(owner)]
      if (.not. shared) return
      deallocate (self%rows_of)
      allocate (self%rows_of(process_count()), source=0)
      do j = 1, size(owner)
         self%rows_of(owner(j) + 1) = self%rows_of(owner(j) + 1) + 1
      end do
      next = [1, (1 + sum(self%rows_of(:p)), p=1, process_count())]
      do j = 1, size(owner)
         self%order(next(owner(j))) = j
         next(owner(j)) = next(owner(j)) + 1
      end do
      self%own = pack(self%own, owner == process_number())
   end subroutine new_row_sharing

   !> How the rows of a grid are shared.
   pure function sharing_on_grid(grid) result(sharing)
      type(grid_type), intent(in) :: grid
      type(row_sharing_type) :: sharing

      call new_row_sharing(sharing, owners_on_grid(grid), grid%shared)
   end function sharing_on_grid

   !> The process of each row of a grid, from 0.
   pure function owners_on_grid(grid) result(owner)
      type(grid_type), intent(in) :: grid
      integer :: owner(grid%ny)
      integer :: p, range(2)

      owner = 0
      if (.not. grid%shared) return
      do p = 0, process_count() - 1
         range = grid%rows_of(p)
         owner(range(1):range(2)) = p
      end do
   end function owners_on_grid

   !> Totals of several sums per row, each added in the order of the rows of the whole field. Collective.
   function totals(self, rows)
      class(row_sharing_type), intent(in) :: self
      real(dp), intent(in) :: rows(:, :)   !! [sums, rows of this process]
      real(dp) :: totals(size(rows, 1))
      real(dp), allocatable :: gathered(:, :), ordered(:, :)

      if (.not. self%shared) then
         totals = row_totals(rows)
         return
      end if
      gathered = gather_rows(rows)
      allocate (ordered, mold=gathered)
      ordered(:, self%order) = gathered
      totals = added(ordered)
   end function totals

end module row_sharing
