!> The history in a result: one column per quantity, one value per row, and a checksum per row.
!>
!> A row counts when all columns have it, so that readers use the length of the shortest column. `step` is
!> written last. The space for all rows is set aside with the first row (see `hdf5_file`). HDF5's own
!> checksums cover whole blocks of a column, which would have to be rewritten for each row. Therefore each
!> row has a checksum of its own values, in the column `checksum`.
!>
!> The file remembers the first fault of these calls, and the caller checks it once at the end
!> (see `hdf5_handle`). After a fault nothing is written any more.
module result_history
   use asperity_checksum, only : crc32_of_values
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   use history_table, only : column_type, history_columns
   use text_tools, only : to_text
   implicit none
   private

   public :: append_values, count_history_rows, create_history_columns, damaged_rows, has_checksums, &
      shorten_history

   character(*), parameter :: group = '/history'
   character(*), parameter :: checksum_name = 'checksum'
   !> Not part of the checksum, because it differs between two runs that are equal
   character(*), parameter :: left_out = 'seconds'

contains

   !> Create empty columns. `step` is the last one in the file, so that it grows last.
   subroutine create_history_columns(file, expected_rows)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: expected_rows
      type(column_type), allocatable :: columns(:)
      integer :: i, j

      columns = history_columns()
      call file%create_column(group//'/'//checksum_name, .false., expected_rows, '1', &
         'CRC-32 of the values of the row')
      do i = 1, size(columns)
         j = mod(i, size(columns)) + 1
         call file%create_column(group//'/'//trim(columns(j)%name), columns(j)%whole, expected_rows, &
            trim(columns(j)%units), trim(columns(j)%long_name))
      end do
      call file%name_axes(group, ['step'], [pack(columns%name, columns%name /= 'step'), &
         [character(24) :: checksum_name]])
      ! The netCDF conventions for climate and forecast (CF) call these auxiliary coordinates.
      call file%write_attribute(group, 'coordinates', 'time phase')
   end subroutine create_history_columns

   !> Write the values of a row. They are not flushed.
   subroutine append_values(file, row, values)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: row                      !! from 0
      real(dp), intent(in) :: values(:)               !! in the order of `history_columns`
      type(column_type), allocatable :: columns(:)
      integer :: i

      columns = history_columns()
      call file%append(group//'/'//checksum_name, row, &
         [real(crc32_of_values(values(covered_columns())), dp)])
      do i = 1, size(columns)
         call file%append(group//'/'//trim(columns(i)%name), row, values(i:i))
      end do
   end subroutine append_values

   !> Number of rows that all columns have; 0 after a fault.
   function count_history_rows(file) result(rows)
      type(hdf5_file_type), intent(inout) :: file
      integer :: rows
      type(column_type), allocatable :: columns(:)
      integer, allocatable :: extent(:)
      integer :: i

      columns = history_columns()
      call file%dataset_shape(group//'/'//checksum_name, extent)
      rows = sum(extent)                              ! a column has one extent
      do i = 1, size(columns)
         call file%dataset_shape(group//'/'//trim(columns(i)%name), extent)
         rows = min(rows, sum(extent))
      end do
   end function count_history_rows

   !> Write the first rows into a new group, which the caller publishes in place of the old one. It
   !> lies at the end of the file, so that removing snapshots does not shorten the file.
   subroutine shorten_history(file, rows, expected_rows)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: rows                     !! to be kept; at most those that there are
      integer, intent(in) :: expected_rows            !! when the history is complete
      type(column_type), allocatable :: columns(:)
      real(dp), allocatable :: values(:, :), sums(:)
      integer :: i

      columns = history_columns()
      call read_rows(file, values, sums)
      if (file%has_failed()) return
      call file%stage_group(group)
      call create_history_columns(file, expected_rows)
      call file%append(group//'/'//checksum_name, 0, sums(:rows))
      do i = 1, size(columns)
         call file%append(group//'/'//trim(columns(i)%name), 0, values(:rows, i))
      end do
      call file%flush()
   end subroutine shorten_history

   !> Do the rows of a result have checksums? The results of early versions have none.
   function has_checksums(file) result(yes)
      type(hdf5_file_type), intent(in) :: file
      logical :: yes

      yes = file%has_dataset(group//'/'//checksum_name)
   end function has_checksums

   !> The rows that do not agree with their checksums, as a text; '' if all agree. The file is
   !> opened separately, so that a fault in the history does not end the reading of other parts.
   subroutine damaged_rows(path, text, error)
      character(*), intent(in) :: path                !! of the result
      character(:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      real(dp), allocatable :: values(:, :), sums(:)
      integer, allocatable :: order(:)
      integer :: count, i, first

      text = ''
      order = covered_columns()
      call file%open(path, 'read')
      call read_rows(file, values, sums)
      call file%close(error)
      count = 0
      first = -1
      do i = 1, size(sums)
         if (abs(real(crc32_of_values(values(i, order)), dp) - sums(i)) <= 0.0_dp) cycle
         count = count + 1
         if (first < 0) first = i - 1
      end do
      if (count == 1) text = 'row '//to_text(first)//' does not agree with its checksum'
      if (count > 1) text = to_text(count)//' rows do not agree with their checksums, first row '// &
         to_text(first)
   end subroutine damaged_rows

   !> Read the rows that all columns have, and their checksums; none after a fault.
   subroutine read_rows(file, values, sums)
      type(hdf5_file_type), intent(inout) :: file
      real(dp), allocatable, intent(out) :: values(:, :)   !! [rows, columns]
      real(dp), allocatable, intent(out) :: sums(:)
      type(column_type), allocatable :: columns(:)
      real(dp), allocatable :: column(:)
      integer :: i, rows

      columns = history_columns()
      rows = count_history_rows(file)
      allocate (values(rows, size(columns)), sums(0))
      do i = 1, size(columns)
         call file%read(group//'/'//trim(columns(i)%name), column)
         if (file%has_failed()) return
         values(:, i) = column(:rows)
      end do
      call file%read(group//'/'//checksum_name, column)
      if (.not. file%has_failed()) sums = column(:rows)
   end subroutine read_rows

   !> The columns whose values the checksum of a row covers. They are in the alphabetical order of
   !> their names, so that readers need not know the order in which they are written.
   function covered_columns() result(order)
      integer, allocatable :: order(:)
      type(column_type), allocatable :: columns(:)
      logical, allocatable :: done(:)
      integer :: i, next

      columns = history_columns()
      done = columns%name == left_out
      allocate (order(0))
      do while (.not. all(done))
         next = 0
         do i = 1, size(columns)
            if (done(i)) cycle
            if (next == 0) then
               next = i
            else if (columns(i)%name < columns(next)%name) then
               next = i
            end if
         end do
         done(next) = .true.
         order = [order, next]
      end do
   end function covered_columns

end module result_history
