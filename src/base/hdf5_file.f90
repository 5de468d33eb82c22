!> HDF5 files: what the groups of a file hold, and the messages where that fails.
!>
!> Below it lie `hdf5_tree` (files and groups), `hdf5_values` (attributes, datasets, columns) and
!> `hdf5_errors`, which call HDF5 through `hdf5_library`; no other modules do.
!>
!> A column that grows by a row (`create_column`, `append`) has the space for all its rows from the
!> first row on: a row changes values, which go straight to the file, and the column's length, a
!> single small block that is written by the next `flush`. What else keeps a file readable at any
!> moment is said in `hdf5_tree`.
module hdf5_file
   use, intrinsic :: iso_c_binding, only : c_char, c_loc, c_null_char, c_null_ptr, c_ptr
   use asperity_errors, only : error_file, error_input, error_memory, error_type, fail
   use file_system, only : file_exists, folder_of
   use hdf5_library, only : h5aexists_f, h5oclose_f, h5oopen_f, hid_t, hsize_t
   use hdf5_scales, only : attach_scales
   use hdf5_tree, only : hdf5_tree_type, most_expected, name_length
   use hdf5_values, only : get_number, get_reals, get_text, kind_int8, kind_integer, kind_real, &
      kind_text, new_column, new_dataset, put_attribute, put_rows, shape_of_dataset
   use hdf5_virtual, only : list_sources, source_type
   use memory_limits, only : memory_text
   use asperity_precision, only : dp, int8
   use text_tools, only : to_text
   use trial_process, only : trial_type
   implicit none
   private

   public :: hdf5_file_type, most_expected, read_field

   !> An open file.
   type, extends(hdf5_tree_type) :: hdf5_file_type
   contains
      procedure :: has_attribute
      procedure :: dataset_shape
      procedure :: create_column
      procedure :: append
      procedure :: name_axes
      procedure, private :: write_real_0, write_real_1, write_real_2, write_real_3, write_int8_2, &
         read_real_0, read_real_1, read_real_2, read_real_3, write_text, write_integer, write_real, read_text, &
         read_integer, read_real, store, load, store_attribute, load_number
      !> Write a new dataset.
      generic :: write => write_real_0, write_real_1, write_real_2, write_real_3, write_int8_2
      !> Read a whole dataset.
      generic :: read => read_real_0, read_real_1, read_real_2, read_real_3
      !> Write an attribute, or a new value into one.
      generic :: write_attribute => write_text, write_integer, write_real
      !> Read an attribute.
      generic :: read_attribute => read_text, read_integer, read_real
   end type hdf5_file_type

contains

   ! --- attributes ---------------------------------------------------------------------------

   !> Has the object this attribute?
   function has_attribute(self, path, name) result(exists)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      logical :: exists
      character(:), allocatable :: local
      integer(hid_t) :: location, object
      integer :: status

      exists = self%has(path)
      if (.not. exists) return
      call self%resolve(path, location, local)
      call h5oopen_f(location, local, object, status)
      exists = status >= 0
      if (.not. exists) return
      call h5aexists_f(object, trim(name), exists, status)
      call h5oclose_f(object, status)
   end function has_attribute

   !> Write an attribute from memory, or a new value into one.
   subroutine store_attribute(self, path, name, kind, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer     !! one value; for text the address of a C string
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object
      integer :: status, ignored

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%open_object(path, object, error)
      if (allocated(error)) return
      call put_attribute(object, name, kind, buffer, status)
      call self%checked(status, 'the attribute "'//name//'" cannot be written', path, error)
      if (.not. allocated(error)) call h5oclose_f(object, ignored)
   end subroutine store_attribute

   !> Write a text attribute (UTF-8).
   subroutine write_text(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char), allocatable, target :: letters(:)
      type(c_ptr), target :: address(1)
      integer :: i

      allocate (letters(len(value) + 1))
      do i = 1, len(value)
         letters(i) = value(i:i)
      end do
      letters(len(value) + 1) = c_null_char
      address(1) = c_loc(letters)
      call self%store_attribute(path, name, kind_text, c_loc(address), error)
   end subroutine write_text

   !> Write a whole number as an attribute.
   subroutine write_integer(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      integer, target :: buffer(1)

      buffer(1) = value
      call self%store_attribute(path, name, kind_integer, c_loc(buffer), error)
   end subroutine write_integer

   !> Write a real number as an attribute.
   subroutine write_real(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)

      buffer(1) = value
      call self%store_attribute(path, name, kind_real, c_loc(buffer), error)
   end subroutine write_real

   !> Open the object of an attribute.
   subroutine open_owner(self, path, name, object, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: object
      type(error_type), allocatable, intent(out) :: error

      object = -1
      if (self%has_attribute(path, name)) then
         call self%open_object(path, object, error)
      else
         call fail(error, error_file, self%path//': '//path//' has no attribute "'//name//'"')
      end if
   end subroutine open_owner

   !> Read the single number of an attribute into memory.
   subroutine load_number(self, path, name, kind, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object
      integer :: status, ignored

      call open_owner(self, path, name, object, error)
      if (allocated(error)) return
      call get_number(object, name, kind, buffer, status)
      call self%checked(status, 'the attribute "'//name//'" cannot be read', path, error)
      if (.not. allocated(error)) call h5oclose_f(object, ignored)
   end subroutine load_number

   !> Read a whole number.
   subroutine read_integer(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      integer, target :: buffer(1)

      buffer = 0
      call self%load_number(path, name, kind_integer, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_integer

   !> Read a real number.
   subroutine read_real(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)

      buffer = 0.0_dp
      call self%load_number(path, name, kind_real, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_real

   !> Read a text.
   subroutine read_text(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object
      integer :: status, ignored

      value = ''
      call open_owner(self, path, name, object, error)
      if (allocated(error)) return
      call get_text(object, name, value, status)
      call self%checked(status, 'the attribute "'//name//'" cannot be read', path, error)
      if (.not. allocated(error)) call h5oclose_f(object, ignored)
   end subroutine read_text

   ! --- datasets -----------------------------------------------------------------------------

   !> Write a new dataset from memory.
   subroutine store(self, path, extent, kind, buffer, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: extent(:)      !! in Fortran's order
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status, level

      call self%not_broken(path, error)
      if (allocated(error)) return
      level = -1
      if (present(compression)) level = max(0, min(compression, 9))
      call self%resolve(path, location, name)
      call new_dataset(location, name, extent, kind, buffer, level, status)
      call self%checked(status, 'the dataset cannot be written', path, error)
      if (.not. allocated(error)) call describe(self, path, units, long_name, error)
   end subroutine store

   !> Say what a dataset holds.
   subroutine describe(self, path, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error

      call self%write_attribute(path, 'units', units, error)
      if (.not. allocated(error)) call self%write_attribute(path, 'long_name', long_name, error)
   end subroutine describe

   !> Say of datasets of a group which vectors of the same group hold the coordinates along their axes.
   subroutine name_axes(self, group, scales, datasets, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: group
      character(*), intent(in) :: scales(:)   !! names of the vectors in Fortran's order of the axes
      character(*), intent(in) :: datasets(:) !! each has all these axes; none: the vectors are scales all the same
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      call self%not_broken(group, error)
      if (allocated(error)) return
      call self%resolve(group, location, name)
      call attach_scales(location, name, scales(size(scales):1:-1), datasets, status)
      call self%checked(status, 'the axes cannot be named', group, error)
   end subroutine name_axes

   !> Write a single real.
   subroutine write_real_0(self, path, value, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)

      buffer(1) = value
      call self%store(path, shape(value), kind_real, c_loc(buffer), units, long_name, error)
   end subroutine write_real_0

   !> Write a vector of reals.
   subroutine write_real_1(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none to 9 smallest, both with a checksum; default: neither

      call self%store(path, shape(values), kind_real, address_1(values), units, long_name, error, &
         compression)
   end subroutine write_real_1

   !> Write a field of reals; in the file its shape is (ny, nx).
   subroutine write_real_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none to 9 smallest, both with a checksum; default: neither

      call self%store(path, shape(values), kind_real, c_loc(values), units, long_name, &
         error, compression)
   end subroutine write_real_2

   !> Write several fields of reals; in the file their shape is (n, ny, nx).
   subroutine write_real_3(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none to 9 smallest, both with a checksum; default: neither

      call self%store(path, shape(values), kind_real, c_loc(values), units, long_name, &
         error, compression)
   end subroutine write_real_3

   !> Write a field of bytes.
   subroutine write_int8_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(int8), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none to 9 smallest, both with a checksum; default: neither

      call self%store(path, shape(values), kind_int8, c_loc(values), units, long_name, &
         error, compression)
   end subroutine write_int8_2

   !> Address of a vector, of an empty one too.
   function address_1(values) result(address)
      real(dp), intent(in), contiguous, target :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_1

   !> Shape of a dataset in Fortran's order; of size 0 for a single value.
   subroutine dataset_shape(self, path, extent, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, allocatable, intent(out) :: extent(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset
      integer(hsize_t), allocatable :: long_extent(:)
      integer :: status, ignored

      allocate (extent(0))
      if (.not. self%has_dataset(path)) then
         call fail(error, error_file, self%path//': there is no dataset "'//trim(path)// &
            '"; there are: '//listing(self))
         return
      end if
      call self%open_object(path, dataset, error)
      if (allocated(error)) return
      call shape_of_dataset(dataset, long_extent, status)
      call self%checked(status, 'the dataset cannot be read', path, error)
      if (allocated(error)) return
      call h5oclose_f(dataset, ignored)
      if (all(long_extent <= huge(1))) then
         extent = int(long_extent)
      else
         call fail(error, error_input, self%path//': '//trim(path)//': has '// &
            to_text(maxval(long_extent))//' values along one side: at most '//to_text(huge(1))// &
            ' are allowed')
      end if
   end subroutine dataset_shape

   !> Find a dataset's shape and see that it has the wanted number of dimensions.
   subroutine wanted_shape(self, path, rank, extent, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: rank
      integer, intent(out) :: extent(rank)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: found(:)
      character(80) :: text

      extent = 0
      call self%dataset_shape(path, found, error)
      if (allocated(error)) return
      if (size(found) /= rank) then
         write (text, '("has ", i0, " dimensions, not ", i0)') size(found), rank
         call fail(error, error_input, self%path//': '//trim(path)//': '//trim(text))
         return
      end if
      extent = found
   end subroutine wanted_shape

   !> Read a whole dataset into memory.
   subroutine load(self, path, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset
      integer :: status, ignored

      call self%open_object(path, dataset, error)
      if (allocated(error)) return
      call check_sources(self, path, dataset, error)
      if (.not. allocated(error)) then
         call get_reals(dataset, buffer, status)
         call self%checked(status, 'the dataset cannot be read', path, error)
      end if
      call h5oclose_f(dataset, ignored)
   end subroutine load

   !> See that nothing is missing of what a virtual dataset is put together from.
   subroutine check_sources(self, path, dataset, error)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(in) :: dataset
      type(error_type), allocatable, intent(out) :: error
      type(source_type), allocatable :: sources(:)
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: closing
      character(:), allocatable :: fault, name
      logical :: complete
      integer :: i

      call list_sources(dataset, sources, complete)
      fault = ''
      if (.not. complete) fault = 'parts of it have no source'
      do i = 1, size(sources)
         if (fault /= '') exit
         name = sources(i)%file
         if (name == '.') cycle
         if (index(name//sources(i)%dataset, '%') > 0) then
            fault = 'its sources are named by a pattern, "'//name//'"'
            exit
         end if
         if (name(1:1) /= '/' .and. file_exists(folder_of(self%path)//'/'//name)) &
            name = folder_of(self%path)//'/'//name
         call file%open(name, 'read', error)
         if (allocated(error)) then
            fault = 'its source "'//sources(i)%file//'" cannot be opened'
         else if (.not. file%has_dataset(sources(i)%dataset)) then
            fault = 'its source "'//sources(i)%file//'" has no dataset "'//sources(i)%dataset//'"'
         end if
         call file%close(closing)
      end do
      if (allocated(error)) deallocate (error)
      if (fault /= '') call fail(error, error_file, self%path//': '//trim(path)// &
         ': is a virtual dataset, and '//fault//': copy the values into a dataset of their own')
   end subroutine check_sources

   !> An error where memory for a dataset could not be had.
   subroutine see_memory(self, path, extent, status, error)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: extent(:)
      integer, intent(in) :: status         !! of the allocation
      type(error_type), allocatable, intent(out) :: error

      if (status /= 0) call fail(error, error_memory, self%path//': '//trim(path)// &
         ': not enough memory: the values take '//memory_text(8.0_dp*product(real(extent, dp))))
   end subroutine see_memory

   !> Read a single real.
   subroutine read_real_0(self, path, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)
      integer :: none(0)

      buffer = 0.0_dp
      call wanted_shape(self, path, 0, none, error)
      if (.not. allocated(error)) call self%load(path, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_real_0

   !> Read a vector of reals; numbers of any other kind are converted.
   subroutine read_real_1(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(1), status

      call wanted_shape(self, path, 1, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)), stat=status)
      call see_memory(self, path, extent, status, error)
      if (allocated(error)) return
      if (size(values) > 0) call self%load(path, c_loc(values), error)
   end subroutine read_real_1

   !> Read a field of reals.
   subroutine read_real_2(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(2), status

      call wanted_shape(self, path, 2, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)), stat=status)
      call see_memory(self, path, extent, status, error)
      if (allocated(error)) return
      if (size(values) > 0) call self%load(path, c_loc(values), error)
   end subroutine read_real_2

   !> Read several fields of reals.
   subroutine read_real_3(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(3), status

      call wanted_shape(self, path, 3, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2), extent(3)), stat=status)
      call see_memory(self, path, extent, status, error)
      if (allocated(error)) return
      if (size(values) > 0) call self%load(path, c_loc(values), error)
   end subroutine read_real_3

   !> Read one field of a file that anyone may have written, such as a height map: first in a
   !> process of its own, which may crash.
   subroutine read_field(path, dataset, extent, field, error)
      character(*), intent(in) :: path      !! name of the file
      character(*), intent(in) :: dataset   !! '': 'surface/height', or else 'surface'
      !> In: the wanted shape. Out: that of the dataset; the field is not read where it is another.
      integer, intent(inout) :: extent(2)
      real(dp), allocatable, intent(out) :: field(:, :)  !! [nx, ny] from a dataset (ny, nx)
      type(error_type), allocatable, intent(out) :: error
      real(dp), parameter :: slowest = 2.0e6_dp          !! bytes/s from the slowest disk
      type(trial_type) :: trial

      call trial%start(60 + int(min(8.0_dp*product(real(extent, dp))/slowest, 1.0e6_dp)))
      if (trial%is_copy) then
         call load_field(path, dataset, extent, field, error)
         call trial%leave()
      end if
      call trial%verdict(path, error)
      if (.not. allocated(error)) call load_field(path, dataset, extent, field, error)
   end subroutine read_field

   !> The same without a trial.
   subroutine load_field(path, dataset, extent, field, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset
      integer, intent(inout) :: extent(2)
      real(dp), allocatable, intent(out) :: field(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: closing
      character(:), allocatable :: name
      integer :: found(2)

      call file%open(path, 'read', error)
      if (allocated(error)) return
      name = trim(dataset)
      if (name == '') then
         name = 'surface/height'
         if (.not. file%has_dataset(name)) then
            if (file%has_dataset('surface')) name = 'surface'
         end if
      end if
      call wanted_shape(file, name, 2, found, error)
      if (.not. allocated(error) .and. all(found == extent)) call file%read(name, field, error)
      extent = found
      call file%close(closing)
   end subroutine load_field

   !> The datasets of a file, for messages.
   function listing(self) result(text)
      class(hdf5_file_type), intent(inout) :: self
      character(:), allocatable :: text
      character(name_length), allocatable :: top(:), inner(:)
      type(error_type), allocatable :: error
      integer :: i, j, count

      text = ''
      count = 0
      call self%members('/', top, error)
      do i = 1, size(top)
         if (self%has_dataset('/'//trim(top(i)))) then
            call add(trim(top(i)))
         else if (self%has('/'//trim(top(i)))) then
            call self%members('/'//trim(top(i)), inner, error)
            do j = 1, size(inner)
               call add(trim(top(i))//'/'//trim(inner(j)))
            end do
         end if
      end do
      if (text == '') text = 'none'

   contains

      subroutine add(name)
         character(*), intent(in) :: name

         count = count + 1
         if (count > 20) then
            if (count == 21) text = text//', ...'
         else if (text == '') then
            text = name
         else
            text = text//', '//name
         end if
      end subroutine add

   end function listing

   ! --- columns ------------------------------------------------------------------------------

   !> Make an empty column that grows row by row.
   subroutine create_column(self, path, whole, expected_rows, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      logical, intent(in) :: whole          !! holds whole numbers
      integer, intent(in) :: expected_rows  !! rows whose space is set aside with the first one
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%resolve(path, location, name)
      call new_column(location, name, merge(kind_integer, kind_real, whole), expected_rows, status)
      call self%checked(status, 'the dataset cannot be made', path, error)
      if (.not. allocated(error)) call describe(self, path, units, long_name, error)
   end subroutine create_column

   !> Write values into the rows of a column from a row on; it grows to hold them.
   subroutine append(self, path, row, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in), contiguous :: values(:)  !! at least one; stored in the column's kind
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%resolve(path, location, name)
      call put_rows(location, name, row, values, status)
      call self%checked(status, 'the row cannot be written', path, error)
   end subroutine append

end module hdf5_file
