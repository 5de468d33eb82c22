!> The values in an HDF5 file: attributes, datasets and columns that grow, in objects that are open.
!>
!> This module has no messages: `status` is negative after a failure, and HDF5 knows the reason.
module hdf5_values
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_loc, c_null_char, &
      c_null_ptr, c_ptr
   use hdf5_c_lists, only : h5pclose, h5pcreate, h5pset_chunk_cache, &
      h5pset_create_intermediate_group, h5pset_deflate, h5pset_fill_time, h5pset_fletcher32, h5pset_shuffle
   use hdf5_c_values, only : h5aclose, h5acreate2, h5aexists, h5aget_space, h5aget_type, h5aopen, &
      h5aread, h5awrite, h5dclose, h5dcreate2, h5dget_space, h5dopen2, h5dread, h5dset_extent, &
      h5dvlen_reclaim, h5dwrite, h5sclose, h5screate, h5sselect_hyperslab, h5tclose, h5tcopy, &
      h5tget_size, h5tis_variable_str, h5tset_cset, h5tset_strpad
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   use hdf5_library, only : c_text, extent_of_space, h5d_fill_time_never, h5p_dataset_access, &
      h5p_dataset_create, h5p_default, h5p_link_create, h5s_all, h5s_scalar, h5s_select_set, &
      h5s_unlimited, h5t_cset_utf8, h5t_ieee_f64le, h5t_native_double, h5t_native_int, &
      h5t_native_int8, h5t_std_i32le, h5t_std_i8le, h5t_str_nullterm, h5t_string, set_chunk, &
      simple_space, status_of
   use hdf5_errors, only : text_of
   use asperity_precision, only : dp
   implicit none
   private

   public :: get_number, get_reals, get_text, new_column, new_dataset, open_column, put_attribute, &
      put_rows, shape_of_dataset

   integer, parameter, public :: kind_text = 0
   integer, parameter, public :: kind_real = 1
   integer, parameter, public :: kind_integer = 2
   integer, parameter, public :: kind_int8 = 3

   integer, parameter, public :: chunk_values = 131072   !! values of a chunk with a checksum (1 MiB of reals), at most
   integer, parameter :: column_chunk = 131072        !! rows of a column whose space is set aside

contains

   !> Write an attribute from memory. If there is one of the same name, its value is replaced in
   !> place.
   subroutine put_attribute(object, name, kind, buffer, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer     !! one value; for text the address of a C string
      integer, intent(out) :: status        !! negative: failed
      integer(hid_t) :: space, attribute, file_type, memory_type
      integer :: exists, ignored

      call get_types(kind, file_type, memory_type)
      attribute = -1
      exists = h5aexists(object, c_text(name))
      status = min(exists, 0)
      if (exists > 0) then
         attribute = h5aopen(object, c_text(name), h5p_default)
         status = status_of(attribute)
      else if (exists == 0) then
         space = h5screate(h5s_scalar)
         attribute = h5acreate2(object, c_text(name), file_type, space, h5p_default, h5p_default)
         status = status_of(attribute)
         if (status >= 0) ignored = h5sclose(space)
      end if
      if (status >= 0) status = h5awrite(attribute, memory_type, buffer)
      if (status < 0) return
      ignored = h5aclose(attribute)
      if (kind == kind_text) ignored = h5tclose(file_type)
   end subroutine put_attribute

   !> Read the number of an attribute into memory.
   subroutine get_number(object, name, kind, buffer, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      integer(hid_t) :: attribute, file_type, memory_type
      integer :: ignored

      call get_types(kind, file_type, memory_type)
      attribute = h5aopen(object, c_text(name), h5p_default)
      status = status_of(attribute)
      if (status >= 0) status = h5aread(attribute, memory_type, buffer)
      if (status >= 0) ignored = h5aclose(attribute)
   end subroutine get_number

   !> Read the text of an attribute, of fixed or variable length.
   subroutine get_text(object, name, value, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      integer, intent(out) :: status
      integer(hid_t) :: attribute, text_type
      integer :: ignored, variable

      value = ''
      attribute = h5aopen(object, c_text(name), h5p_default)
      status = status_of(attribute)
      if (status < 0) return
      text_type = h5aget_type(attribute)
      status = status_of(text_type)
      if (status < 0) return
      variable = h5tis_variable_str(text_type)
      if (variable > 0) then
         call get_variable_text(attribute, text_type, value, status)
      else if (variable == 0) then
         call get_fixed_text(attribute, text_type, value, status)
      else
         status = variable
      end if
      if (status < 0) return
      ignored = h5tclose(text_type)
      ignored = h5aclose(attribute)
   end subroutine get_text

   !> A text of variable length, for which HDF5 allocates the memory.
   subroutine get_variable_text(attribute, text_type, value, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(in) :: text_type
      character(:), allocatable, intent(inout) :: value
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer :: ignored
      type(c_ptr), target :: address(1)

      address(1) = c_null_ptr
      status = h5aread(attribute, text_type, c_loc(address))
      if (status < 0) return
      if (c_associated(address(1))) value = text_of(address(1))
      space = h5aget_space(attribute)
      status = h5dvlen_reclaim(text_type, space, h5p_default, c_loc(address))
      ignored = h5sclose(space)
   end subroutine get_variable_text

   !> A text of fixed length; it ends at the first null.
   subroutine get_fixed_text(attribute, text_type, value, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(in) :: text_type
      character(:), allocatable, intent(inout) :: value
      integer, intent(out) :: status
      integer(size_t) :: length
      integer :: i
      character(kind=c_char), allocatable, target :: letters(:)

      length = h5tget_size(text_type)       ! 0 after a failure
      allocate (letters(length))
      status = -1
      if (length > 0) status = h5aread(attribute, text_type, c_loc(letters))
      if (status < 0) return
      do i = 1, int(length)
         if (letters(i) == c_null_char) exit
      end do
      value = repeat(' ', i - 1)
      do i = 1, len(value)
         value(i:i) = letters(i)
      end do
   end subroutine get_fixed_text

   !> Create a dataset, and write it from memory if there is a buffer. Groups above it that are missing
   !> are created as well.
   subroutine new_dataset(location, name, extent, kind, buffer, level, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(in) :: extent(:)      !! in Fortran's order; of size 0 for a single value
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      !> Level of compression, from 0 (none) to 9. If it is negative, the dataset is stored in one piece and
      !> without a checksum, as single values always are.
      integer, intent(in) :: level
      integer, intent(out) :: status
      integer(hid_t) :: space, creation, links, dataset, file_type, memory_type
      integer :: ignored

      call get_types(kind, file_type, memory_type)
      links = h5pcreate(h5p_link_create)
      creation = h5pcreate(h5p_dataset_create)
      if (size(extent) == 0) then
         space = h5screate(h5s_scalar)
      else
         space = simple_space(int(extent, hsize_t))
      end if
      status = h5pset_create_intermediate_group(links, 1)
      if (status >= 0) status = h5pset_fill_time(creation, h5d_fill_time_never)
      if (status >= 0 .and. level >= 0 .and. size(extent) > 0 .and. all(extent > 0)) &
         call set_chunks(creation, extent, level, status)
      if (status >= 0) then
         dataset = h5dcreate2(location, c_text(name), file_type, space, links, creation, &
            h5p_default)
         status = status_of(dataset)
      end if
      if (status >= 0 .and. c_associated(buffer)) &
         status = h5dwrite(dataset, memory_type, h5s_all, h5s_all, h5p_default, buffer)
      ! Compressed data leave the cache here, so that a full disk is noticed here.
      if (status >= 0) status = h5dclose(dataset)
      if (status < 0) return
      ignored = h5sclose(space)
      ignored = h5pclose(creation)
      ignored = h5pclose(links)
   end subroutine new_dataset

   !> Let values be stored in chunks of whole rows, each with a checksum and perhaps compressed.
   subroutine set_chunks(creation, extent, level, status)
      integer(hid_t), intent(in) :: creation
      integer, intent(in) :: extent(:)
      integer, intent(in) :: level
      integer, intent(out) :: status
      integer(hsize_t) :: chunk(size(extent))

      chunk = 1
      chunk(1) = extent(1)
      if (size(extent) > 1) chunk(2) = max(1, min(extent(2), chunk_values/extent(1)))
      status = set_chunk(creation, chunk)
      if (status >= 0 .and. level > 0) status = h5pset_shuffle(creation)
      if (status >= 0 .and. level > 0) status = h5pset_deflate(creation, level)
      ! The checksum is the last filter, so that damage is found before anything else reads the
      ! bytes.
      if (status >= 0) status = h5pset_fletcher32(creation)
   end subroutine set_chunks

   !> Shape of a dataset in Fortran's order; of size 0 for a single value.
   subroutine shape_of_dataset(dataset, extent, status)
      integer(hid_t), intent(in) :: dataset
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer :: ignored

      space = h5dget_space(dataset)
      call extent_of_space(space, extent, status)
      if (status >= 0) ignored = h5sclose(space)
   end subroutine shape_of_dataset

   !> Read a whole dataset of numbers of any kind as reals.
   subroutine get_reals(dataset, buffer, status)
      integer(hid_t), intent(in) :: dataset
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status

      status = h5dread(dataset, h5t_native_double, h5s_all, h5s_all, h5p_default, buffer)
   end subroutine get_reals

   !> Create an empty column that grows row by row.
   subroutine new_column(location, name, kind, expected_rows, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      integer, intent(in) :: expected_rows  !! rows whose space is set aside with the first one
      integer, intent(out) :: status
      integer(hid_t) :: space, creation, dataset, file_type, memory_type
      integer :: ignored

      call get_types(kind, file_type, memory_type)
      creation = h5pcreate(h5p_dataset_create)
      space = simple_space([0_hsize_t], [h5s_unlimited])
      status = h5pset_fill_time(creation, h5d_fill_time_never)
      if (status >= 0) status = set_chunk(creation, &
         [int(max(64, min(expected_rows, column_chunk)), hsize_t)])
      if (status >= 0) then
         dataset = h5dcreate2(location, c_text(name), file_type, space, h5p_default, creation, &
            h5p_default)
         status = status_of(dataset)
      end if
      if (status >= 0) status = h5dclose(dataset)
      if (status < 0) return
      ignored = h5sclose(space)
      ignored = h5pclose(creation)
   end subroutine new_column

   !> Open a column for writing. It has no cache of its own, so that the values go straight to the file.
   subroutine open_column(location, name, dataset, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      integer(hid_t) :: access_list
      integer :: ignored

      access_list = h5pcreate(h5p_dataset_access)
      status = h5pset_chunk_cache(access_list, 0_size_t, 0_size_t, 0.75_c_double)
      dataset = -1
      if (status >= 0) then
         dataset = h5dopen2(location, c_text(name), access_list)
         status = status_of(dataset)
      end if
      if (status >= 0) ignored = h5pclose(access_list)
   end subroutine open_column

   !> Write values into an open column from a given row on. The column grows to hold them.
   subroutine put_rows(dataset, row, values, status)
      integer(hid_t), intent(in) :: dataset
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in), contiguous, target :: values(:)  !! at least one
      integer, intent(out) :: status
      integer(hid_t) :: memory, file_space
      integer(hsize_t) :: count(1), first(1)
      integer :: ignored

      count = size(values)
      first = row
      status = h5dset_extent(dataset, first + count)
      if (status >= 0) then
         file_space = h5dget_space(dataset)
         memory = simple_space(count)
         status = h5sselect_hyperslab(file_space, h5s_select_set, first, c_null_ptr, count, &
            c_null_ptr)
      end if
      if (status >= 0) status = h5dwrite(dataset, h5t_native_double, memory, file_space, &
         h5p_default, c_loc(values))
      if (status < 0) return
      ignored = h5sclose(memory)
      ignored = h5sclose(file_space)
   end subroutine put_rows

   !> The types of a kind of value in the file and in memory.
   subroutine get_types(kind, file_type, memory_type)
      integer, intent(in) :: kind
      integer(hid_t), intent(out) :: file_type
      integer(hid_t), intent(out) :: memory_type
      integer :: ignored

      select case (kind)
      case (kind_real)
         file_type = h5t_ieee_f64le
         memory_type = h5t_native_double
      case (kind_integer)
         file_type = h5t_std_i32le
         memory_type = h5t_native_int
      case (kind_int8)
         file_type = h5t_std_i8le
         memory_type = h5t_native_int8
      case default                          ! text
         file_type = h5tcopy(h5t_string)
         ignored = h5tset_strpad(file_type, h5t_str_nullterm)
         ignored = h5tset_cset(file_type, h5t_cset_utf8)
         memory_type = file_type
      end select
   end subroutine get_types

end module hdf5_values
