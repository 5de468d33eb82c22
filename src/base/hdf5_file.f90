!> HDF5 files: the interface that the rest of the program uses, with messages about failures.
!>
!> `hdf5_file_type` extends, one after the other, the types of `hdf5_handle` (opening, closing, faults),
!> `hdf5_tree` (groups), `hdf5_attributes` and `hdf5_reader` (values of datasets). This module adds the
!> writing of datasets and columns. They all use `hdf5_values` and `hdf5_errors`. Only modules hdf5_*
!> call HDF5.
!>
!> A column grows row by row (`create_column`, `append`). The space for all its rows is set aside with the
!> first row. A new row changes the values, which are written to the file at once, and the length of
!> the column, a single small block that the next `flush` writes. Columns stay open between rows, because
!> opening them takes longer than writing a value.
module hdf5_file
   use, intrinsic :: iso_c_binding, only : c_loc, c_null_ptr, c_ptr
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int8
   use hdf5_c_values, only : h5dclose
   use hdf5_kinds, only : hid_t
   use hdf5_reader, only : hdf5_reader_type
   use hdf5_scales, only : attach_scales
   use hdf5_tree, only : most_expected
   use hdf5_values, only : kind_int8, kind_integer, kind_real, new_column, new_dataset, open_column, &
      put_rows
   implicit none
   private

   public :: hdf5_file_type, most_expected

   !> A column that is open for writing.
   type :: open_column_type
      character(:), allocatable :: path
      integer(hid_t) :: dataset = -1
   end type open_column_type

   !> An open file.
   type, extends(hdf5_reader_type) :: hdf5_file_type
      type(open_column_type), allocatable, private :: columns(:)
      integer(hid_t), private :: columns_of = -1      !! the open file to which they belong: `id` changes with each opening
      integer, private :: latest = 0                  !! number of the column that was written last
   contains
      procedure :: stage_group
      procedure :: create_column
      procedure :: append
      procedure :: name_axes
      procedure, private :: write_real_0, write_real_1, write_real_2, write_real_3, write_int8_2
      !> Write a new dataset.
      generic :: write => write_real_0, write_real_1, write_real_2, write_real_3, write_int8_2
   end type hdf5_file_type

   !> Values in memory.
   type :: values_type
      integer, allocatable :: extent(:)     !! in Fortran's order; of size 0 for a single value
      integer :: kind
      type(c_ptr) :: address
   end type values_type

contains

   ! --- writing ------------------------------------------------------------------------------

   !> Write a new dataset from memory. If `compression` is given, the dataset is stored in chunks with
   !> checksums: 0 means no compression, 9 the smallest file. By default the dataset is stored in one
   !> piece without checksums.
   subroutine store(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(values_type), intent(in) :: values
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: compression
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status, level

      if (self%has_failed(error)) return
      level = -1
      if (present(compression)) level = max(0, min(compression, 9))
      call self%resolve(path, location, name)
      call new_dataset(location, name, values%extent, values%kind, values%address, level, status)
      call self%checked(status, 'the dataset cannot be written', path, fault)
      if (.not. allocated(fault)) call describe(self, path, units, long_name, fault)
      call self%settle(fault, error)
   end subroutine store

   !> Store the units and the description of a dataset as its attributes.
   subroutine describe(self, path, units, long_name, fault)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: fault

      call self%write_attribute(path, 'units', units, fault)
      if (.not. allocated(fault)) call self%write_attribute(path, 'long_name', long_name, fault)
   end subroutine describe

   !> Name the vectors of a group that hold the coordinates along the axes of other datasets in it.
   subroutine name_axes(self, group, scales, datasets, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: group
      character(*), intent(in) :: scales(:)   !! names of the vectors in Fortran's order of the axes
      !> Names of the datasets, each of which has all these axes. Without datasets the vectors are only
      !> marked as scales.
      character(*), intent(in) :: datasets(:)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      if (self%has_failed(error)) return
      call self%resolve(group, location, name)
      call attach_scales(location, name, scales(size(scales):1:-1), datasets, status)
      call self%checked(status, 'the axes cannot be named', group, fault)
      call self%settle(fault, error)
   end subroutine name_axes

   !> Write a single real.
   subroutine write_real_0(self, path, value, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      real(dp), target :: buffer(1)

      buffer(1) = value
      call store(self, path, values_type(shape(value), kind_real, c_loc(buffer)), units, &
         long_name, error)
   end subroutine write_real_0

   !> Write a vector of reals.
   subroutine write_real_1(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: compression   !! see `store`
      type(c_ptr) :: address

      address = c_null_ptr                  ! an empty vector has no address
      if (size(values) > 0) address = c_loc(values)
      call store(self, path, values_type(shape(values), kind_real, address), units, long_name, &
         error, compression)
   end subroutine write_real_1

   !> Write a field of reals; in the file its shape is (ny, nx).
   subroutine write_real_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: compression   !! see `store`

      call store(self, path, values_type(shape(values), kind_real, c_loc(values)), units, &
         long_name, error, compression)
   end subroutine write_real_2

   !> Write several fields of reals; in the file their shape is (n, ny, nx).
   subroutine write_real_3(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: compression   !! see `store`

      call store(self, path, values_type(shape(values), kind_real, c_loc(values)), units, &
         long_name, error, compression)
   end subroutine write_real_3

   !> Write a field of bytes.
   subroutine write_int8_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(int8), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: compression   !! see `store`

      call store(self, path, values_type(shape(values), kind_int8, c_loc(values)), units, &
         long_name, error, compression)
   end subroutine write_int8_2

   ! --- columns ------------------------------------------------------------------------------

   !> Create an empty column that grows row by row.
   subroutine create_column(self, path, whole, expected_rows, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      logical, intent(in) :: whole          !! it holds whole numbers
      integer, intent(in) :: expected_rows  !! rows whose space is set aside with the first one
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      if (self%has_failed(error)) return
      call self%resolve(path, location, name)
      call new_column(location, name, merge(kind_integer, kind_real, whole), expected_rows, status)
      call self%checked(status, 'the dataset cannot be made', path, fault)
      if (.not. allocated(fault)) call describe(self, path, units, long_name, fault)
      call self%settle(fault, error)
   end subroutine create_column

   !> Write values into a column from a given row on. The column grows to hold them.
   subroutine append(self, path, row, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in), contiguous :: values(:)  !! at least one
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: status

      if (self%has_failed(error)) return
      call find_column(self, path, status)
      if (status >= 0) call put_rows(self%columns(self%latest)%dataset, row, values, status)
      call self%checked(status, 'the row cannot be written', path, fault)
      call self%settle(fault, error)
   end subroutine append

   !> Make a column the latest one, and open it if it is not open yet. Rows are written column by column, so that
   !> the search begins behind the latest one.
   subroutine find_column(self, path, status)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(out) :: status
      type(open_column_type) :: found
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: i, k

      status = 0
      if (self%columns_of /= self%id) then            ! closing a file closes its columns
         self%columns = [open_column_type ::]
         self%columns_of = self%id
         self%latest = 0
      end if

      do k = 1, size(self%columns)
         i = mod(self%latest + k - 1, size(self%columns)) + 1
         if (self%columns(i)%path /= path) cycle
         self%latest = i
         return
      end do

      call self%resolve(path, location, name)
      found%path = path
      call open_column(location, name, found%dataset, status)
      if (status < 0) return
      self%columns = [self%columns, found]
      self%latest = size(self%columns)
   end subroutine find_column

   !> Start a group that readers do not see before `publish_group` (module `hdf5_tree`). If it replaces the group of the
   !> open columns, they are closed.
   subroutine stage_group(self, path, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out), optional :: error
      integer :: i, ignored

      if (self%has_failed(error)) return
      if (self%columns_of == self%id) then
         do i = 1, size(self%columns)
            if (index(self%columns(i)%path, trim(path)//'/') /= 1) cycle
            ignored = h5dclose(self%columns(i)%dataset)
            self%columns_of = -1
         end do
      end if
      call self%hdf5_reader_type%stage_group(path, error)
   end subroutine stage_group

end module hdf5_file
