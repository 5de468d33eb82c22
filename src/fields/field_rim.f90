!> The rim of a field: one more row on either side of the rows of a process, for stencils.
!>
!> The rows beyond are those of the processes before and after, or on a periodic grid those of the other end.
!> On a free grid nothing lies beyond the ends, and the rim is left as it is there.
module field_rim
   use asperity_parallel, only : exchange, process_count, process_number
   use asperity_precision, only : sp
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: close_rim

contains

   !> Set the rim of a field in single precision. Collective; within a parallel region one thread calls it.
   subroutine close_rim(grid, field)
      type(grid_type), intent(in) :: grid
      real(sp), intent(inout) :: field(:, 0:)      !! [any, 0:rows + 1]
      real(sp), allocatable :: send(:), receive(:)
      integer, allocatable :: sent(:), received(:)
      integer :: neighbours(2), width, at

      if (.not. grid%shared) then
         if (grid%boundary /= boundary_periodic) return
         field(:, 0) = field(:, grid%ny)
         field(:, grid%ny + 1) = field(:, 1)
         return
      end if
      width = size(field, 1)
      neighbours = neighbours_of(grid)
      allocate (sent(process_count()), received(process_count()), source=0)
      call count_row(neighbours(1))
      call count_row(neighbours(2))
      received = sent
      allocate (send(sum(sent)), receive(sum(received)))

      ! To the process before goes the first row, to the one after the last; to one that is both, in this order.
      if (neighbours(1) >= 0) send(place(1) + 1:place(1) + width) = field(:, 1)
      if (neighbours(2) >= 0) send(place(2) + 1:place(2) + width) = field(:, grid%rows())
      call exchange(send, sent, receive, received)

      ! A process that is before and after sends its first row first, which comes after the rows of this one.
      at = place(1)
      if (neighbours(1) == neighbours(2)) at = place(2)
      if (neighbours(1) >= 0) field(:, 0) = receive(at + 1:at + width)
      at = place(2)
      if (neighbours(1) == neighbours(2)) at = place(1)
      if (neighbours(2) >= 0) field(:, grid%rows() + 1) = receive(at + 1:at + width)

   contains

      !> Count a row for a process.
      subroutine count_row(process)
         integer, intent(in) :: process

         if (process >= 0) sent(process + 1) = sent(process + 1) + width
      end subroutine count_row

      !> Where the row for the process before (1) or after (2) begins in what is sent.
      integer function place(which)
         integer, intent(in) :: which

         place = 0
         if (neighbours(which) < 0) return
         place = sum(sent(:neighbours(which)))
         if (which == 2 .and. neighbours(1) == neighbours(2)) place = place + width
      end function place

   end subroutine close_rim

   !> The processes that hold the row before the first and after the last row of this one; -1: none.
   function neighbours_of(grid) result(neighbours)
      type(grid_type), intent(in) :: grid
      integer :: neighbours(2)

      neighbours = -1
      if (grid%rows() == 0) return
      neighbours(1) = owner(grid%first_row - 1)
      neighbours(2) = owner(grid%last_row + 1)

   contains

      !> The process that holds a row.
      integer function owner(row)
         integer, intent(in) :: row
         integer :: wanted, range(2)

         wanted = row
         if (grid%boundary == boundary_periodic) wanted = modulo(row - 1, grid%ny) + 1
         do owner = process_count() - 1, 0, -1
            range = grid%rows_of(owner)
            if (wanted >= range(1) .and. wanted <= range(2)) exit
         end do
      end function owner

   end function neighbours_of

end module field_rim
