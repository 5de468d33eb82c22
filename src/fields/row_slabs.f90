!> Transfer of rows of a shared grid between their owners and the first process, which alone opens files.
!>
!> Fields are written and read in slabs of rows, and a slab may hold rows of several processes. In addition to
!> the parts of their owners, only one slab is therefore in memory.
module row_slabs
   use asperity_parallel, only : process_count, process_number
   use process_exchange, only : hand_to_first, take_from_first
   use asperity_precision, only : dp, int8
   use regular_grid, only : grid_type
   implicit none
   private

   public :: collect_rows, deal_rows, own_part

   !> Complete a slab on the first process: every process has put its own rows into it. Collective.
   interface collect_rows
      module procedure :: collect_reals, collect_bytes
   end interface collect_rows

contains

   !> First and last row of the grid that a process has among the rows of a slab. The last is before the
   !> first where it has none.
   pure function own_part(grid, first, rows, process) result(part)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first                 !! row of the grid where the slab begins, from 1
      integer, intent(in) :: rows                  !! of the slab
      integer, intent(in), optional :: process     !! from 0; default: this one
      integer :: part(2)
      integer :: p

      p = process_number()
      if (present(process)) p = process
      part = grid%rows_of(p)
      part = [max(part(1), first), min(part(2), first + rows - 1)]
   end function own_part

   !> Complete a slab of real numbers.
   subroutine collect_reals(grid, first, slab)
      type(grid_type), intent(in) :: grid          !! shared
      integer, intent(in) :: first                 !! row of the grid where the slab begins, from 1
      real(dp), intent(inout), contiguous :: slab(:, :)   !! [values of a row, rows]
      integer :: p, part(2)

      do p = 1, process_count() - 1
         part = own_part(grid, first, size(slab, 2), p) - first + 1
         if (part(1) <= part(2)) call hand_to_first(p, slab(:, part(1):part(2)))
      end do
   end subroutine collect_reals

   !> Complete a slab of bytes.
   subroutine collect_bytes(grid, first, slab)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first
      integer(int8), intent(inout), contiguous :: slab(:, :)
      integer :: p, part(2)

      do p = 1, process_count() - 1
         part = own_part(grid, first, size(slab, 2), p) - first + 1
         if (part(1) <= part(2)) call hand_to_first(p, slab(:, part(1):part(2)))
      end do
   end subroutine collect_bytes

   !> Send every process its own rows of a slab that the first process has. The other rows of a process's slab
   !> are not changed. Collective.
   subroutine deal_rows(grid, first, slab)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first
      real(dp), intent(inout), contiguous :: slab(:, :)
      integer :: p, part(2)

      do p = 1, process_count() - 1
         part = own_part(grid, first, size(slab, 2), p) - first + 1
         if (part(1) <= part(2)) call take_from_first(p, slab(:, part(1):part(2)))
      end do
   end subroutine deal_rows

end module row_slabs
