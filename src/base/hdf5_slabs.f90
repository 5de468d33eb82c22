!> Writes fields in slabs of rows, so that no copy of a whole field is needed.
!>
!> A slab holds the rows of one chunk of the dataset (`slab_rows`); the last one of a field may have fewer.
!> `hdf5_chunk_writer` writes fields that are compressed.
module hdf5_slabs
   use, intrinsic :: iso_c_binding, only : c_loc, c_null_ptr, c_ptr
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int64
   use hdf5_c_lists, only : h5pclose, h5pcreate, h5pset_copy_object
   use hdf5_c_objects, only : h5ocopy
   use hdf5_c_values, only : h5dclose, h5dget_space, h5dopen2, h5dread, h5dwrite, h5sclose, h5sselect_hyperslab
   use hdf5_file, only : hdf5_file_type
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_library, only : c_text, h5o_copy_without_attr, h5p_default, h5p_object_copy, h5s_select_set, &
      h5t_native_double, simple_space, status_of
   use hdf5_values, only : chunk_values, kind_int8, kind_real, new_dataset
   implicit none
   private

   public :: copy_field, create_field, read_part, slab_rows, write_part

contains

   !> Number of rows of a slab.
   pure function slab_rows(nx) result(rows)
      integer, intent(in) :: nx             !! values of a row
      integer :: rows

      rows = max(1, chunk_values/nx)
   end function slab_rows

   !> Create a dataset without values; in the file its shape is (ny, nx). Without `compression` it is stored
   !> in one piece without checksums.
   subroutine create_field(file, path, extent, bytes, units, long_name, compression, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: extent(:)      !! such as nx, ny
      logical, intent(in) :: bytes          !! true for bytes, false for reals
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      integer, intent(in), optional :: compression   !! 0 none, 9 as small as possible
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: level, status

      if (file%has_failed(error)) return
      level = -1
      if (present(compression)) level = max(0, min(compression, 9))
      call file%resolve(path, location, name)
      call new_dataset(location, name, extent, merge(kind_int8, kind_real, bytes), c_null_ptr, &
         level, status)
      call file%checked(status, 'the dataset cannot be written', path, fault)
      if (.not. allocated(fault)) call file%write_attribute(path, 'units', units, fault)
      if (.not. allocated(fault)) call file%write_attribute(path, 'long_name', long_name, fault)
      call file%settle(fault, error)
   end subroutine create_field

   !> Copy a dataset whose values have been written. The stored bytes are copied, which takes much less time than
   !> to filter the values again.
   subroutine copy_field(file, path, copy, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      character(*), intent(in) :: copy      !! path of the new dataset
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name, new_name
      integer(hid_t) :: location, new_location, options
      integer :: status, ignored

      if (file%has_failed(error)) return
      call file%resolve(path, location, name)
      call file%resolve(copy, new_location, new_name)
      options = h5pcreate(h5p_object_copy)
      status = h5pset_copy_object(options, h5o_copy_without_attr)
      if (status >= 0) status = h5ocopy(location, c_text(name), new_location, c_text(new_name), options, h5p_default)
      ignored = h5pclose(options)
      call file%checked(status, 'the dataset cannot be written', copy, fault)
      if (.not. allocated(fault)) call file%write_attribute(copy, 'units', units, fault)
      if (.not. allocated(fault)) call file%write_attribute(copy, 'long_name', long_name, fault)
      call file%settle(fault, error)
   end subroutine copy_field

   !> Write a part of a dataset of reals or of bytes, to which HDF5 converts the values.
   subroutine write_part(file, path, start, extent, values, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: start(:)     !! from 0, in Fortran's order of the dimensions
      integer, intent(in) :: extent(:)           !! of the part, in the same order
      real(dp), intent(in), contiguous, target :: values(:, :)   !! as many as the part has
      type(error_type), allocatable, intent(out), optional :: error

      call move(file, path, start, extent, h5t_native_double, c_loc(values), .false., error)
   end subroutine write_part

   !> Read a part of a dataset of numbers.
   subroutine read_part(file, path, start, extent, values, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: start(:)     !! from 0, in Fortran's order of the dimensions
      integer, intent(in) :: extent(:)           !! of the part, in the same order
      real(dp), intent(inout), contiguous, target :: values(:, :)   !! as many as the part has
      type(error_type), allocatable, intent(out), optional :: error

      call move(file, path, start, extent, h5t_native_double, c_loc(values), .true., error)
   end subroutine read_part

   !> Write or read a part of a dataset.
   subroutine move(file, path, start, extent, type, address, reads, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: start(:)     !! from 0, in Fortran's order of the dimensions
      integer, intent(in) :: extent(:)
      integer(hid_t), intent(in) :: type         !! of the values in memory
      type(c_ptr), intent(in) :: address
      logical, intent(in) :: reads
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location, dataset, memory, space
      integer :: status, ignored, n

      if (file%has_failed(error)) return
      n = size(extent)
      call file%resolve(path, location, name)
      dataset = h5dopen2(location, c_text(name), h5p_default)
      status = status_of(dataset)
      if (status >= 0) then
         space = h5dget_space(dataset)
         memory = simple_space(int(extent, hsize_t))
         status = h5sselect_hyperslab(space, h5s_select_set, int(start(n:1:-1), hsize_t), &
            c_null_ptr, int(extent(n:1:-1), hsize_t), c_null_ptr)
         if (status >= 0 .and. reads) status = h5dread(dataset, type, memory, space, h5p_default, address)
         if (status >= 0 .and. .not. reads) status = h5dwrite(dataset, type, memory, space, h5p_default, address)
         ignored = h5sclose(memory)
         ignored = h5sclose(space)
         ignored = h5dclose(dataset)
         if (status >= 0) status = ignored
      end if
      if (reads) then
         call file%checked(status, 'the dataset cannot be read', path, fault)
      else
         call file%checked(status, 'the dataset cannot be written', path, fault)
      end if
      call file%settle(fault, error)
   end subroutine move

end module hdf5_slabs
