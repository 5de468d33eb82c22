!> Fields that are written in slabs of rows, so that nobody needs a copy of a whole field.
!>
!> A slab holds the rows of one chunk of the dataset (`slab_rows`); the last one of a field may have fewer.
!> HDF5 compresses a chunk when it is complete and keeps none of them.
module hdf5_slabs
   use, intrinsic :: iso_c_binding, only : c_loc, c_null_ptr, c_ptr
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int8
   use hdf5_c_values, only : h5dclose, h5dget_space, h5dopen2, h5dwrite, h5sclose, h5sselect_hyperslab
   use hdf5_file, only : hdf5_file_type
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_library, only : c_text, h5p_default, h5s_select_set, h5t_native_double, h5t_native_int8, &
      simple_space, status_of
   use hdf5_values, only : chunk_values, kind_int8, kind_real, new_dataset
   implicit none
   private

   public :: create_field, slab_rows, write_slab

   !> Write a slab of reals or of bytes.
   interface write_slab
      module procedure :: write_reals, write_bytes
   end interface write_slab

contains

   !> Rows of a slab.
   pure function slab_rows(nx) result(rows)
      integer, intent(in) :: nx             !! values of a row
      integer :: rows

      rows = max(1, chunk_values/nx)
   end function slab_rows

   !> Create a field without values; in the file its shape is (ny, nx).
   subroutine create_field(file, path, extent, bytes, units, long_name, compression, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: extent(2)      !! nx, ny
      logical, intent(in) :: bytes          !! of bytes, else of reals
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      integer, intent(in) :: compression    !! 0 none, 9 as small as possible
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      if (file%has_failed(error)) return
      call file%resolve(path, location, name)
      call new_dataset(location, name, extent, merge(kind_int8, kind_real, bytes), c_null_ptr, &
         max(0, min(compression, 9)), status)
      call file%checked(status, 'the dataset cannot be written', path, fault)
      if (.not. allocated(fault)) call file%write_attribute(path, 'units', units, fault)
      if (.not. allocated(fault)) call file%write_attribute(path, 'long_name', long_name, fault)
      call file%settle(fault, error)
   end subroutine create_field

   !> Write a slab of reals.
   subroutine write_reals(file, path, first, values, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: first          !! first row of the slab, from 1
      real(dp), intent(in), contiguous, target :: values(:, :)   !! [nx, rows]
      type(error_type), allocatable, intent(out), optional :: error

      call store(file, path, first, shape(values), h5t_native_double, c_loc(values), error)
   end subroutine write_reals

   !> Write a slab of bytes.
   subroutine write_bytes(file, path, first, values, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: first
      integer(int8), intent(in), contiguous, target :: values(:, :)
      type(error_type), allocatable, intent(out), optional :: error

      call store(file, path, first, shape(values), h5t_native_int8, c_loc(values), error)
   end subroutine write_bytes

   !> Write a slab of a field.
   subroutine store(file, path, first, extent, type, address, error)
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: first
      integer, intent(in) :: extent(2)      !! nx, rows
      integer(hid_t), intent(in) :: type    !! of the values in memory
      type(c_ptr), intent(in) :: address
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location, dataset, memory, space
      integer :: status, ignored

      if (file%has_failed(error)) return
      call file%resolve(path, location, name)
      dataset = h5dopen2(location, c_text(name), h5p_default)
      status = status_of(dataset)
      if (status >= 0) then
         space = h5dget_space(dataset)
         memory = simple_space(int(extent, hsize_t))
         status = h5sselect_hyperslab(space, h5s_select_set, [int(first - 1, hsize_t), 0_hsize_t], &
            c_null_ptr, int(extent(2:1:-1), hsize_t), c_null_ptr)
         if (status >= 0) status = h5dwrite(dataset, type, memory, space, h5p_default, address)
         ignored = h5sclose(memory)
         ignored = h5sclose(space)
         ! Compressed data leave the cache here, so that a full disk is noticed here.
         ignored = h5dclose(dataset)
         if (status >= 0) status = ignored
      end if
      call file%checked(status, 'the dataset cannot be written', path, fault)
      call file%settle(fault, error)
   end subroutine store

end module hdf5_slabs
