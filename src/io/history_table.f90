!> The columns of the history: their names, units and meanings, and the values of a row in their order.
module history_table
   use asperity_precision, only : dp
   use history_list, only : list_columns
   use history_row, only : history_row_type
   use state_table, only : state_table_type
   implicit none
   private

   public :: column_type, history_columns, row_values

   !> A column.
   type :: column_type
      character(24) :: name
      character(4) :: units
      character(80) :: long_name
      logical :: whole              !! holds whole numbers
   end type column_type

contains

   !> The columns in their order.
   function history_columns() result(columns)
      type(column_type), allocatable :: columns(:)
      type(history_row_type), target :: row
      type(state_table_type) :: table
      integer :: i

      call list_columns(row, table, '')
      allocate (columns(table%count))
      do i = 1, table%count
         associate (piece => table%pieces(i))
            columns(i) = column_type(piece%name, piece%units, piece%meaning, &
               associated(piece%whole))
         end associate
      end do
   end function history_columns

   !> A row as an array of reals, in the order of `history_columns`.
   function row_values(row) result(values)
      type(history_row_type), intent(in), target :: row
      real(dp), allocatable :: values(:)
      type(state_table_type) :: table
      integer :: i

      call list_columns(row, table, '')
      allocate (values(table%count))
      do i = 1, table%count
         associate (piece => table%pieces(i))
            if (associated(piece%whole)) then
               values(i) = real(piece%whole, dp)
            else
               values(i) = piece%real_0
            end if
         end associate
      end do
   end function row_values

end module history_table
