!> The values in an HDF5 file: attributes, datasets and columns that grow, of objects that are open.
!>
!> Nothing here has messages: `status` is negative after a failure, and HDF5 holds the reason.
module hdf5_values
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_loc, c_null_char, c_null_ptr, &
      c_ptr
   use hdf5_library, only : h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, &
      h5aget_type_f, h5aopen_f, h5aread_f, h5awrite_f, H5D_FILL_TIME_NEVER_F, h5dclose_f, &
      h5dcreate_f, h5dget_space_f, h5dopen_f, h5dread_f, h5dset_extent_f, h5dvlen_reclaim_f, &
      h5dwrite_f, H5P_DATASET_ACCESS_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F, &
      H5P_LINK_CREATE_F, h5pclose_f, h5pcreate_f, h5pset_chunk_cache_f, h5pset_chunk_f, &
      h5pset_create_inter_group_f, h5pset_deflate_f, h5pset_fill_time_f, h5pset_fletcher32_f, &
      h5pset_shuffle_f, &
      H5S_SCALAR_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F, h5sclose_f, h5screate_f, &
      h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
      h5sselect_hyperslab_f, H5T_CSET_UTF8_F, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
      H5T_NATIVE_INT8, H5T_NATIVE_INTEGER, H5T_STD_I32LE, H5T_STD_I8LE, H5T_STR_NULLTERM_F, H5T_STRING, h5tclose_f, &
      h5tcopy_f, h5tget_size_f, h5tis_variable_str_f, h5tset_cset_f, h5tset_strpad_f, hid_t, &
      hsize_t, size_t
   use hdf5_errors, only : text_of
   use asperity_precision, only : dp
   implicit none
   private

   public :: get_number, get_reals, get_text, new_column, new_dataset, put_attribute, put_rows, &
      shape_of_dataset

   integer, parameter, public :: kind_text = 0
   integer, parameter, public :: kind_real = 1
   integer, parameter, public :: kind_integer = 2
   integer, parameter, public :: kind_int8 = 3

   integer, parameter :: chunk_values = 131072        !! values in a chunk with a checksum, about 1 MiB
   integer, parameter :: column_chunk = 131072        !! rows of a column whose space is set aside

contains

   !> Write an attribute from memory; one of the same name gets the new value in place.
   subroutine put_attribute(object, name, kind, buffer, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer     !! one value; for text the address of a C string
      integer, intent(out) :: status        !! negative: failed
      integer(hid_t) :: space, attribute, file_type, memory_type
      integer :: ignored
      logical :: exists

      call get_types(kind, file_type, memory_type)
      call h5aexists_f(object, name, exists, status)
      if (status >= 0 .and. exists) then
         call h5aopen_f(object, name, attribute, status)
      else if (status >= 0) then
         call h5screate_f(H5S_SCALAR_F, space, status)
         call h5acreate_f(object, name, file_type, space, attribute, status)
         call h5sclose_f(space, ignored)
      end if
      if (status >= 0) call h5awrite_f(attribute, memory_type, buffer, status)
      if (status < 0) return
      call h5aclose_f(attribute, ignored)
      if (kind == kind_text) call h5tclose_f(file_type, ignored)
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
      type(c_ptr) :: target_address

      call get_types(kind, file_type, memory_type)
      call h5aopen_f(object, name, attribute, status)
      target_address = buffer
      if (status >= 0) call h5aread_f(attribute, memory_type, target_address, status)
      if (status >= 0) call h5aclose_f(attribute, ignored)
   end subroutine get_number

   !> Read the text of an attribute, of fixed or variable length.
   subroutine get_text(object, name, value, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      integer, intent(out) :: status
      integer(hid_t) :: attribute, text_type
      integer :: ignored
      logical :: variable

      value = ''
      call h5aopen_f(object, name, attribute, status)
      if (status >= 0) call h5aget_type_f(attribute, text_type, status)
      if (status >= 0) call h5tis_variable_str_f(text_type, variable, status)
      if (status < 0) return
      if (variable) then
         call get_variable_text(attribute, text_type, value, status)
      else
         call get_fixed_text(attribute, text_type, value, status)
      end if
      if (status < 0) return
      call h5tclose_f(text_type, ignored)
      call h5aclose_f(attribute, ignored)
   end subroutine get_text

   !> A text that HDF5 keeps with its own length.
   subroutine get_variable_text(attribute, text_type, value, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(in) :: text_type
      character(:), allocatable, intent(inout) :: value
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer :: ignored
      type(c_ptr), target :: address(1)
      type(c_ptr) :: buffer

      address(1) = c_null_ptr
      buffer = c_loc(address)
      call h5aread_f(attribute, text_type, buffer, status)
      if (status < 0) return
      if (c_associated(address(1))) value = text_of(address(1))
      call h5aget_space_f(attribute, space, status)
      call h5dvlen_reclaim_f(text_type, space, H5P_DEFAULT_F, buffer, status)
      call h5sclose_f(space, ignored)
   end subroutine get_variable_text

   !> A text in a field of fixed length, up to the first null.
   subroutine get_fixed_text(attribute, text_type, value, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(in) :: text_type
      character(:), allocatable, intent(inout) :: value
      integer, intent(out) :: status
      integer(size_t) :: length
      integer :: i
      type(c_ptr) :: buffer
      character(kind=c_char), allocatable, target :: letters(:)

      call h5tget_size_f(text_type, length, status)
      allocate (letters(length))
      buffer = c_loc(letters)
      if (status >= 0) call h5aread_f(attribute, text_type, buffer, status)
      if (status < 0) return
      do i = 1, int(length)
         if (letters(i) == c_null_char) exit
      end do
      value = repeat(' ', i - 1)
      do i = 1, len(value)
         value(i:i) = letters(i)
      end do
   end subroutine get_fixed_text

   !> Make a dataset and write it from memory; groups above it are made where they are missing.
   subroutine new_dataset(location, name, extent, kind, buffer, level, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(in) :: extent(:)      !! in Fortran's order; none: a single value
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      !> Of compression: 0 none, to 9. Negative: in one piece, without a checksum, and so for single values.
      integer, intent(in) :: level
      integer, intent(out) :: status
      integer(hid_t) :: space, creation, links, dataset, file_type, memory_type
      integer(hsize_t) :: dims(size(extent)), chunk(size(extent))
      integer :: ignored

      dims = extent
      call get_types(kind, file_type, memory_type)
      call h5pcreate_f(H5P_LINK_CREATE_F, links, status)
      if (status >= 0) call h5pset_create_inter_group_f(links, 1, status)
      if (status >= 0) call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      if (status >= 0) call h5pset_fill_time_f(creation, H5D_FILL_TIME_NEVER_F, status)
      if (status >= 0 .and. level >= 0 .and. size(extent) > 0 .and. all(extent > 0)) then
         chunk = 1
         chunk(1) = dims(1)
         if (size(extent) > 1) chunk(2) = max(1_hsize_t, min(dims(2), chunk_values/dims(1)))
         call h5pset_chunk_f(creation, size(extent), chunk, status)
         if (status >= 0 .and. level > 0) call h5pset_shuffle_f(creation, status)
         if (status >= 0 .and. level > 0) call h5pset_deflate_f(creation, level, status)
         ! The last filter, so that damage is found before anything else reads the bytes.
         if (status >= 0) call h5pset_fletcher32_f(creation, status)
      end if
      if (size(extent) == 0) then
         if (status >= 0) call h5screate_f(H5S_SCALAR_F, space, status)
      else
         if (status >= 0) call h5screate_simple_f(size(extent), dims, space, status)
      end if
      if (status >= 0) call h5dcreate_f(location, name, file_type, space, dataset, status, &
         dcpl_id=creation, lcpl_id=links)
      if (status >= 0 .and. all(extent > 0)) call h5dwrite_f(dataset, memory_type, buffer, status)
      ! Compressed data leave the cache here, so that a full disk is noticed here.
      if (status >= 0) call h5dclose_f(dataset, status)
      if (status < 0) return
      call h5sclose_f(space, ignored)
      call h5pclose_f(creation, ignored)
      call h5pclose_f(links, ignored)
   end subroutine new_dataset

   !> Shape of a dataset in Fortran's order; of size 0 for a single value.
   subroutine shape_of_dataset(dataset, extent, status)
      integer(hid_t), intent(in) :: dataset
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer(hsize_t) :: dims(32), most(32)
      integer :: rank, ignored

      allocate (extent(0))
      call h5dget_space_f(dataset, space, status)
      if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (status >= 0 .and. rank > 0) then
         call h5sget_simple_extent_dims_f(space, dims(:rank), most(:rank), status)
         if (status >= 0) extent = dims(:rank)
      end if
      if (status >= 0) call h5sclose_f(space, ignored)
   end subroutine shape_of_dataset

   !> Read a whole dataset of numbers of any kind as reals.
   subroutine get_reals(dataset, buffer, status)
      integer(hid_t), intent(in) :: dataset
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      type(c_ptr) :: target_address

      target_address = buffer
      call h5dread_f(dataset, H5T_NATIVE_DOUBLE, target_address, status)
   end subroutine get_reals

   !> Make an empty column that grows row by row.
   subroutine new_column(location, name, kind, expected_rows, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      integer, intent(in) :: expected_rows  !! rows whose space is set aside with the first one
      integer, intent(out) :: status
      integer(hid_t) :: space, creation, dataset, file_type, memory_type
      integer :: ignored

      call get_types(kind, file_type, memory_type)
      call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      if (status >= 0) call h5pset_fill_time_f(creation, H5D_FILL_TIME_NEVER_F, status)
      if (status >= 0) call h5pset_chunk_f(creation, 1, &
         [int(max(64, min(expected_rows, column_chunk)), hsize_t)], status)
      if (status >= 0) call h5screate_simple_f(1, [0_hsize_t], space, status, [H5S_UNLIMITED_F])
      if (status >= 0) call h5dcreate_f(location, name, file_type, space, dataset, status, &
         dcpl_id=creation)
      if (status >= 0) call h5dclose_f(dataset, status)
      if (status < 0) return
      call h5sclose_f(space, ignored)
      call h5pclose_f(creation, ignored)
   end subroutine new_column

   !> Write values into the rows of a column from a row on; it grows to hold them.
   subroutine put_rows(location, name, row, values, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in), contiguous, target :: values(:)  !! at least one
      integer, intent(out) :: status
      integer(hid_t) :: access_list, dataset, memory, file_space
      integer(hsize_t) :: count
      integer :: ignored

      count = size(values)
      ! Without a cache of its own: values go straight to the file.
      call h5pcreate_f(H5P_DATASET_ACCESS_F, access_list, status)
      if (status >= 0) call h5pset_chunk_cache_f(access_list, 0_size_t, 0_size_t, 0.75, status)
      if (status >= 0) call h5dopen_f(location, name, dataset, status, access_list)
      call h5pclose_f(access_list, ignored)
      if (status >= 0) call h5dset_extent_f(dataset, [row + count], status)
      if (status >= 0) call h5dget_space_f(dataset, file_space, status)
      if (status >= 0) call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, &
         [int(row, hsize_t)], [count], status)
      if (status >= 0) call h5screate_simple_f(1, [count], memory, status)
      if (status >= 0) call h5dwrite_f(dataset, H5T_NATIVE_DOUBLE, c_loc(values), status, &
         mem_space_id=memory, file_space_id=file_space)
      if (status >= 0) call h5dclose_f(dataset, status)
      if (status < 0) return
      call h5sclose_f(memory, ignored)
      call h5sclose_f(file_space, ignored)
   end subroutine put_rows

   !> The types of a kind of value in the file and in memory.
   subroutine get_types(kind, file_type, memory_type)
      integer, intent(in) :: kind
      integer(hid_t), intent(out) :: file_type
      integer(hid_t), intent(out) :: memory_type
      integer :: ignored

      select case (kind)
      case (kind_real)
         file_type = H5T_IEEE_F64LE
         memory_type = H5T_NATIVE_DOUBLE
      case (kind_integer)
         file_type = H5T_STD_I32LE
         memory_type = H5T_NATIVE_INTEGER
      case (kind_int8)
         file_type = H5T_STD_I8LE
         memory_type = H5T_NATIVE_INT8
      case default                          ! text
         call h5tcopy_f(H5T_STRING, file_type, ignored)
         call h5tset_strpad_f(file_type, H5T_STR_NULLTERM_F, ignored)
         call h5tset_cset_f(file_type, H5T_CSET_UTF8_F, ignored)
         memory_type = file_type
      end select
   end subroutine get_types

end module hdf5_values
