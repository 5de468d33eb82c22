!> Reads fields in slabs of rows, from files of any origin.
!>
!> The dataset stays open from slab to slab. (`read_part` of module `hdf5_slabs` opens it for every part, which
!> is sufficient for datasets that this program wrote in slabs.)
module hdf5_slab_reader
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_loc, c_null_ptr
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use hdf5_c_lists, only : h5pclose, h5pcreate, h5pget_chunk, h5pget_layout, h5pset_chunk_cache
   use hdf5_c_objects, only : h5oclose
   use hdf5_c_values, only : h5dclose, h5dget_create_plist, h5dget_space, h5dopen2, h5dread, h5sclose, &
      h5sselect_hyperslab
   use hdf5_file, only : hdf5_file_type
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   use hdf5_library, only : c_text, h5p_dataset_access, h5p_default, h5s_select_set, h5t_native_double, &
      simple_space, status_of
   use hdf5_values, only : shape_of_dataset
   implicit none
   private

   public :: slab_reader_type

   !> A field that is read in slabs. Reading is fastest if each slab follows the one before.
   type :: slab_reader_type
      character(:), allocatable, private :: path
      integer(hid_t), private :: dataset = -1
   contains
      procedure :: open => open_slabs
      procedure :: read => read_slab
      procedure :: close => close_slabs
   end type slab_reader_type

contains

   !> Begin to read a field.
   subroutine open_slabs(self, file, path, error)
      class(slab_reader_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path      !! of a dataset of two dimensions
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: access_list, dataset, location
      integer :: ignored

      if (file%has_failed(error)) return
      self%path = path
      call file%open_values(path, dataset, fault)
      if (.not. allocated(fault)) then
         access_list = cache_for(dataset)
         ignored = h5oclose(dataset)
         call file%resolve(path, location, name)
         self%dataset = h5dopen2(location, c_text(name), access_list)
         call file%checked(status_of(self%dataset), 'the dataset cannot be read', path, fault)
         ignored = h5pclose(access_list)
      end if
      call file%settle(fault, error)
   end subroutine open_slabs

   !> The properties with which a dataset is opened. They let HDF5 keep a whole row of chunks in its cache,
   !> because a chunk that belongs to several slabs would otherwise be read and decompressed for each.
   function cache_for(dataset) result(access_list)
      integer(hid_t), intent(in) :: dataset
      integer(hid_t) :: access_list
      integer(c_int), parameter :: layout_chunked = 2                   ! H5D_CHUNKED
      integer(size_t), parameter :: largest_value = 16, usual_cache = 2**20, usual_slots = 521
      integer(hid_t) :: creation
      integer(hsize_t) :: chunk(2), columns
      integer(hsize_t), allocatable :: extent(:)
      integer :: status, ignored

      access_list = h5pcreate(h5p_dataset_access)
      call shape_of_dataset(dataset, extent, status)
      creation = h5dget_create_plist(dataset)
      if (status < 0 .or. creation < 0) return
      if (h5pget_layout(creation) == layout_chunked) then
         if (h5pget_chunk(creation, 2_c_int, chunk) == 2) then
            columns = (extent(1) + chunk(2) - 1)/chunk(2)
            ignored = h5pset_chunk_cache(access_list, max(usual_slots, 4*columns + 1), &
               max(usual_cache, largest_value*chunk(1)*chunk(2)*columns), 1.0_c_double)
         end if
      end if
      ignored = h5pclose(creation)
   end function cache_for

   !> Read a slab.
   subroutine read_slab(self, file, first, values, error)
      class(slab_reader_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: first          !! first row of the slab, from 1
      real(dp), intent(out), contiguous, target :: values(:, :)   !! [nx, rows]
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hid_t) :: memory, space
      integer :: status, ignored

      if (file%has_failed(error)) return
      space = h5dget_space(self%dataset)
      memory = simple_space(int(shape(values), hsize_t))
      status = h5sselect_hyperslab(space, h5s_select_set, [int(first - 1, hsize_t), 0_hsize_t], c_null_ptr, &
         int([size(values, 2), size(values, 1)], hsize_t), c_null_ptr)
      if (status >= 0) &
         status = h5dread(self%dataset, h5t_native_double, memory, space, h5p_default, c_loc(values))
      call file%checked(status, 'the dataset cannot be read', self%path, fault)
      ignored = h5sclose(memory)
      ignored = h5sclose(space)
      call file%settle(fault, error)
   end subroutine read_slab

   !> Close the dataset.
   subroutine close_slabs(self)
      class(slab_reader_type), intent(inout) :: self
      integer :: ignored

      if (self%dataset >= 0) ignored = h5dclose(self%dataset)
      self%dataset = -1
   end subroutine close_slabs

end module hdf5_slab_reader
