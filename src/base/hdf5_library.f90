!> The part of HDF5's Fortran interface that is used here, over the C library (`hdf5_c`).
!>
!> Procedures and constants have the names of HDF5's own Fortran modules and take their arguments in
!> the same order, so that HDF5's manual describes them. Optional arguments that nobody here gives
!> are left out. `status` is negative after a failure.
module hdf5_library
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_funloc, c_loc, c_long, c_null_char, &
      c_null_funptr, c_null_ptr, c_ptr
   use hdf5_c, only : group_info_type, h5aclose, h5acreate2, h5aexists, h5aget_space, &
      h5aget_type, h5aopen, h5aread, h5awrite, h5dclose, h5dcreate2, h5dget_space, &
      h5dont_atexit, h5dopen2, h5dread, h5dset_extent, h5dvlen_reclaim, h5dwrite, h5eset_auto2, &
      h5fclose, h5fcreate, h5fflush, h5fget_filesize, h5fis_hdf5, h5fopen, h5gclose, h5gcreate2, &
      h5gcreate_anon, h5gget_info_by_name, h5iget_type, h5lcreate_external, h5ldelete, &
      h5lexists, h5lget_name_by_idx, h5oclose, h5olink, h5oopen, h5open, &
      h5p_cls_dataset_access_id_g, h5p_cls_dataset_create_id_g, h5p_cls_file_access_id_g, &
      h5p_cls_file_create_id_g, h5p_cls_group_create_id_g, h5p_cls_link_create_id_g, h5pclose, &
      h5pcreate, h5pset_alignment, h5pset_attr_phase_change, h5pset_chunk, h5pset_chunk_cache, &
      h5pset_create_intermediate_group, h5pset_deflate, h5pset_est_link_info, &
      h5pset_fclose_degree, h5pset_fill_time, h5pset_fletcher32, h5pset_libver_bounds, h5pset_link_phase_change, &
      h5pset_meta_block_size, h5pset_shuffle, h5pset_small_data_block_size, &
      h5pset_userblock, h5sclose, h5screate, &
      h5screate_simple, h5sget_simple_extent_dims, h5sget_simple_extent_ndims, &
      h5sselect_hyperslab, h5t_c_s1_g, h5t_ieee_f64le_g, h5t_native_double_g, h5t_native_int8_g, &
      h5t_native_int_g, h5t_std_i32le_g, h5t_std_i8le_g, h5tclose, h5tcopy, h5tget_size, &
      h5tis_variable_str, h5tset_cset, h5tset_size, h5tset_strpad, hid_t, hsize_t, size_t, &
      value_of
   implicit none
   private

   public :: h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, h5aget_type_f, h5aopen_f, &
      h5aread_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dont_atexit_f, &
      h5dopen_f, h5dread_f, h5dset_extent_f, h5dvlen_reclaim_f, h5dwrite_f, h5eset_auto_f, &
      h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_filesize_f, h5fis_hdf5_f, h5fopen_f, &
      h5gclose_f, h5gcreate_anon_f, h5gcreate_f, h5gn_members_f, h5iget_type_f, &
      h5lcreate_external_f, h5ldelete_f, h5lexists_f, h5lget_name_by_idx_f, h5oclose_f, &
      h5olink_f, h5oopen_f, h5open_f, h5pclose_f, h5pcreate_f, h5pset_alignment_f, &
      h5pset_attr_phase_change_f, h5pset_chunk_cache_f, h5pset_chunk_f, &
      h5pset_create_inter_group_f, h5pset_deflate_f, h5pset_est_link_info_f, &
      h5pset_fclose_degree_f, h5pset_fill_time_f, h5pset_fletcher32_f, h5pset_libver_bounds_f, &
      h5pset_link_phase_change_f, h5pset_meta_block_size_f, h5pset_shuffle_f, &
      h5pset_small_data_block_size_f, h5pset_userblock_f, h5sclose_f, h5screate_f, h5screate_simple_f, &
      h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, &
      h5tclose_f, h5tcopy_f, h5tget_size_f, h5tis_variable_str_f, h5tset_cset_f, h5tset_strpad_f
   public :: hid_t, hsize_t, size_t

   integer, parameter, public :: h5f_acc_rdonly_f = 0
   integer, parameter, public :: h5f_acc_rdwr_f = 1
   integer, parameter, public :: h5f_acc_trunc_f = 2
   integer, parameter, public :: h5f_close_strong_f = 3
   integer, parameter, public :: h5f_libver_v18_f = 1
   integer, parameter, public :: h5f_scope_local_f = 0
   integer, parameter, public :: h5i_dataset_f = 5
   integer, parameter, public :: h5d_fill_time_never_f = 1
   integer, parameter, public :: h5s_scalar_f = 0
   integer, parameter, public :: h5s_select_set_f = 0
   integer(hsize_t), parameter, public :: h5s_unlimited_f = -1
   integer, parameter, public :: h5t_cset_utf8_f = 1
   integer, parameter, public :: h5t_str_nullterm_f = 0
   integer(hid_t), parameter, public :: h5p_default_f = 0
   integer, parameter :: by_name = 0         !! the index of names
   integer, parameter :: increasing = 0      !! its order

   ! Known once `h5open_f` has been called.
   integer(hid_t), public, protected :: h5t_native_double, h5t_native_integer, h5t_native_int8
   integer(hid_t), public, protected :: h5t_ieee_f64le, h5t_std_i32le, h5t_std_i8le
   integer(hid_t), public, protected :: h5t_string   !! text of variable length
   integer(hid_t), public, protected :: h5p_dataset_access_f, h5p_dataset_create_f
   integer(hid_t), public, protected :: h5p_file_access_f, h5p_file_create_f
   integer(hid_t), public, protected :: h5p_group_create_f, h5p_link_create_f

contains

   ! --- the library ---------------------------------------------------------------------------------

   !> Start HDF5 and learn the numbers of its types and property classes.
   subroutine h5open_f(status)
      integer, intent(out) :: status

      status = h5open()
      if (status < 0) return
      h5t_native_double = value_of(c_funloc(h5t_native_double_g))
      h5t_native_integer = value_of(c_funloc(h5t_native_int_g))
      h5t_native_int8 = value_of(c_funloc(h5t_native_int8_g))
      h5t_ieee_f64le = value_of(c_funloc(h5t_ieee_f64le_g))
      h5t_std_i32le = value_of(c_funloc(h5t_std_i32le_g))
      h5t_std_i8le = value_of(c_funloc(h5t_std_i8le_g))
      h5p_dataset_access_f = value_of(c_funloc(h5p_cls_dataset_access_id_g))
      h5p_dataset_create_f = value_of(c_funloc(h5p_cls_dataset_create_id_g))
      h5p_file_access_f = value_of(c_funloc(h5p_cls_file_access_id_g))
      h5p_file_create_f = value_of(c_funloc(h5p_cls_file_create_id_g))
      h5p_group_create_f = value_of(c_funloc(h5p_cls_group_create_id_g))
      h5p_link_create_f = value_of(c_funloc(h5p_cls_link_create_id_g))
      h5t_string = h5tcopy(value_of(c_funloc(h5t_c_s1_g)))
      status = h5tset_size(h5t_string, -1_size_t)      ! of variable length
   end subroutine h5open_f

   subroutine h5dont_atexit_f(status)
      integer, intent(out) :: status

      status = h5dont_atexit()
   end subroutine h5dont_atexit_f

   !> Keep HDF5 from printing its messages.
   subroutine h5eset_auto_f(print_messages, status)
      integer, intent(in) :: print_messages  !! 0, the only one that is needed: print none
      integer, intent(out) :: status

      status = -1
      if (print_messages == 0) status = h5eset_auto2(0_hid_t, c_null_funptr, c_null_ptr)
   end subroutine h5eset_auto_f

   ! --- files ---------------------------------------------------------------------------------------

   subroutine h5fcreate_f(name, flags, file, status, creation_prp, access_prp)
      character(*), intent(in) :: name
      integer, intent(in) :: flags
      integer(hid_t), intent(out) :: file
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: creation_prp, access_prp

      file = h5fcreate(c_text(name), flags, given(creation_prp), given(access_prp))
      status = status_of(file)
   end subroutine h5fcreate_f

   subroutine h5fopen_f(name, flags, file, status, access_prp)
      character(*), intent(in) :: name
      integer, intent(in) :: flags
      integer(hid_t), intent(out) :: file
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: access_prp

      file = h5fopen(c_text(name), flags, given(access_prp))
      status = status_of(file)
   end subroutine h5fopen_f

   subroutine h5fclose_f(file, status)
      integer(hid_t), intent(in) :: file
      integer, intent(out) :: status

      status = h5fclose(file)
   end subroutine h5fclose_f

   subroutine h5fflush_f(object, scope, status)
      integer(hid_t), intent(in) :: object
      integer, intent(in) :: scope
      integer, intent(out) :: status

      status = h5fflush(object, scope)
   end subroutine h5fflush_f

   subroutine h5fget_filesize_f(file, length, status)
      integer(hid_t), intent(in) :: file
      integer(hsize_t), intent(out) :: length
      integer, intent(out) :: status

      status = h5fget_filesize(file, length)
   end subroutine h5fget_filesize_f

   subroutine h5fis_hdf5_f(name, is_hdf5, status)
      character(*), intent(in) :: name
      logical, intent(out) :: is_hdf5
      integer, intent(out) :: status

      status = h5fis_hdf5(c_text(name))
      is_hdf5 = status > 0
   end subroutine h5fis_hdf5_f

   ! --- groups, links and objects -------------------------------------------------------------------

   subroutine h5gcreate_f(location, name, group, status, lcpl_id, gcpl_id)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: group
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: lcpl_id, gcpl_id

      group = h5gcreate2(location, c_text(name), given(lcpl_id), given(gcpl_id), h5p_default_f)
      status = status_of(group)
   end subroutine h5gcreate_f

   subroutine h5gcreate_anon_f(location, group, status)
      integer(hid_t), intent(in) :: location
      integer(hid_t), intent(out) :: group
      integer, intent(out) :: status

      group = h5gcreate_anon(location, h5p_default_f, h5p_default_f)
      status = status_of(group)
   end subroutine h5gcreate_anon_f

   subroutine h5gclose_f(group, status)
      integer(hid_t), intent(in) :: group
      integer, intent(out) :: status

      status = h5gclose(group)
   end subroutine h5gclose_f

   !> Number of links in a group.
   subroutine h5gn_members_f(location, name, count, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(out) :: count
      integer, intent(out) :: status
      type(group_info_type) :: about

      count = 0
      status = h5gget_info_by_name(location, c_text(name), about, h5p_default_f)
      if (status >= 0) count = int(about%links)
   end subroutine h5gn_members_f

   !> The nth name in a group, in the order of the alphabet.
   subroutine h5lget_name_by_idx_f(location, group, n, name, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: group
      integer, intent(in) :: n                  !! from 0
      character(*), intent(out) :: name         !! cut off where it is longer
      integer, intent(out) :: status
      character(kind=c_char) :: letters(len(name) + 1)
      integer(c_long) :: length
      integer :: i

      name = ''
      length = h5lget_name_by_idx(location, c_text(group), by_name, increasing, int(n, hsize_t), &
         letters, int(size(letters), size_t), h5p_default_f)
      status = status_of(int(length, hid_t))
      do i = 1, min(int(length), len(name))
         name(i:i) = letters(i)
      end do
   end subroutine h5lget_name_by_idx_f

   subroutine h5lexists_f(location, name, exists, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      logical, intent(out) :: exists
      integer, intent(out) :: status

      status = h5lexists(location, c_text(name), h5p_default_f)
      exists = status > 0
   end subroutine h5lexists_f

   subroutine h5ldelete_f(location, name, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(out) :: status

      status = h5ldelete(location, c_text(name), h5p_default_f)
   end subroutine h5ldelete_f

   subroutine h5lcreate_external_f(file, object, location, name, status)
      character(*), intent(in) :: file, object
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer, intent(out) :: status

      status = h5lcreate_external(c_text(file), c_text(object), location, c_text(name), &
         h5p_default_f, h5p_default_f)
   end subroutine h5lcreate_external_f

   subroutine h5oopen_f(location, name, object, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: object
      integer, intent(out) :: status

      object = h5oopen(location, c_text(name), h5p_default_f)
      status = status_of(object)
   end subroutine h5oopen_f

   subroutine h5olink_f(object, location, name, status)
      integer(hid_t), intent(in) :: object, location
      character(*), intent(in) :: name
      integer, intent(out) :: status

      status = h5olink(object, location, c_text(name), h5p_default_f, h5p_default_f)
   end subroutine h5olink_f

   subroutine h5oclose_f(object, status)
      integer(hid_t), intent(in) :: object
      integer, intent(out) :: status

      status = h5oclose(object)
   end subroutine h5oclose_f

   subroutine h5iget_type_f(object, kind, status)
      integer(hid_t), intent(in) :: object
      integer, intent(out) :: kind
      integer, intent(out) :: status

      kind = h5iget_type(object)
      status = min(kind, 0)
   end subroutine h5iget_type_f

   ! --- attributes ----------------------------------------------------------------------------------

   subroutine h5aexists_f(object, name, exists, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      logical, intent(out) :: exists
      integer, intent(out) :: status

      status = h5aexists(object, c_text(name))
      exists = status > 0
   end subroutine h5aexists_f

   subroutine h5acreate_f(object, name, type, space, attribute, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type, space
      integer(hid_t), intent(out) :: attribute
      integer, intent(out) :: status

      attribute = h5acreate2(object, c_text(name), type, space, h5p_default_f, h5p_default_f)
      status = status_of(attribute)
   end subroutine h5acreate_f

   subroutine h5aopen_f(object, name, attribute, status)
      integer(hid_t), intent(in) :: object
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: attribute
      integer, intent(out) :: status

      attribute = h5aopen(object, c_text(name), h5p_default_f)
      status = status_of(attribute)
   end subroutine h5aopen_f

   subroutine h5aget_space_f(attribute, space, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status

      space = h5aget_space(attribute)
      status = status_of(space)
   end subroutine h5aget_space_f

   subroutine h5aget_type_f(attribute, type, status)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t), intent(out) :: type
      integer, intent(out) :: status

      type = h5aget_type(attribute)
      status = status_of(type)
   end subroutine h5aget_type_f

   subroutine h5aread_f(attribute, type, buffer, status)
      integer(hid_t), intent(in) :: attribute, type
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status

      status = h5aread(attribute, type, buffer)
   end subroutine h5aread_f

   subroutine h5awrite_f(attribute, type, buffer, status)
      integer(hid_t), intent(in) :: attribute, type
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status

      status = h5awrite(attribute, type, buffer)
   end subroutine h5awrite_f

   subroutine h5aclose_f(attribute, status)
      integer(hid_t), intent(in) :: attribute
      integer, intent(out) :: status

      status = h5aclose(attribute)
   end subroutine h5aclose_f

   ! --- datasets ------------------------------------------------------------------------------------

   subroutine h5dcreate_f(location, name, type, space, dataset, status, dcpl_id, lcpl_id)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type, space
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: dcpl_id, lcpl_id

      dataset = h5dcreate2(location, c_text(name), type, space, given(lcpl_id), given(dcpl_id), &
         h5p_default_f)
      status = status_of(dataset)
   end subroutine h5dcreate_f

   subroutine h5dopen_f(location, name, dataset, status, dapl_id)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: dapl_id

      dataset = h5dopen2(location, c_text(name), given(dapl_id))
      status = status_of(dataset)
   end subroutine h5dopen_f

   subroutine h5dget_space_f(dataset, space, status)
      integer(hid_t), intent(in) :: dataset
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status

      space = h5dget_space(dataset)
      status = status_of(space)
   end subroutine h5dget_space_f

   subroutine h5dset_extent_f(dataset, extent, status)
      integer(hid_t), intent(in) :: dataset
      integer(hsize_t), intent(in) :: extent(:)  !! in Fortran's order
      integer, intent(out) :: status

      status = h5dset_extent(dataset, extent(size(extent):1:-1))
   end subroutine h5dset_extent_f

   subroutine h5dread_f(dataset, type, buffer, status, mem_space_id, file_space_id)
      integer(hid_t), intent(in) :: dataset, type
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: mem_space_id, file_space_id

      status = h5dread(dataset, type, given(mem_space_id), given(file_space_id), h5p_default_f, buffer)
   end subroutine h5dread_f

   subroutine h5dwrite_f(dataset, type, buffer, status, mem_space_id, file_space_id)
      integer(hid_t), intent(in) :: dataset, type
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status
      integer(hid_t), intent(in), optional :: mem_space_id, file_space_id

      status = h5dwrite(dataset, type, given(mem_space_id), given(file_space_id), h5p_default_f, buffer)
   end subroutine h5dwrite_f

   subroutine h5dvlen_reclaim_f(type, space, transfer_list, buffer, status)
      integer(hid_t), intent(in) :: type, space, transfer_list
      type(c_ptr), intent(in) :: buffer
      integer, intent(out) :: status

      status = h5dvlen_reclaim(type, space, transfer_list, buffer)
   end subroutine h5dvlen_reclaim_f

   subroutine h5dclose_f(dataset, status)
      integer(hid_t), intent(in) :: dataset
      integer, intent(out) :: status

      status = h5dclose(dataset)
   end subroutine h5dclose_f

   ! --- dataspaces ----------------------------------------------------------------------------------

   subroutine h5screate_f(kind, space, status)
      integer, intent(in) :: kind
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status

      space = h5screate(kind)
      status = status_of(space)
   end subroutine h5screate_f

   subroutine h5screate_simple_f(rank, extent, space, status, largest)
      integer, intent(in) :: rank
      integer(hsize_t), intent(in) :: extent(:)  !! in Fortran's order
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status
      integer(hsize_t), intent(in), optional :: largest(:)
      integer(hsize_t), target :: turned(size(extent))

      if (present(largest)) then
         turned = largest(rank:1:-1)
         space = h5screate_simple(rank, extent(rank:1:-1), c_loc(turned))
      else
         space = h5screate_simple(rank, extent(rank:1:-1), c_null_ptr)
      end if
      status = status_of(space)
   end subroutine h5screate_simple_f

   subroutine h5sget_simple_extent_ndims_f(space, rank, status)
      integer(hid_t), intent(in) :: space
      integer, intent(out) :: rank
      integer, intent(out) :: status

      rank = h5sget_simple_extent_ndims(space)
      status = min(rank, 0)
   end subroutine h5sget_simple_extent_ndims_f

   subroutine h5sget_simple_extent_dims_f(space, extent, largest, status)
      integer(hid_t), intent(in) :: space
      integer(hsize_t), intent(out) :: extent(:), largest(:)  !! in Fortran's order
      integer, intent(out) :: status

      status = h5sget_simple_extent_dims(space, extent, largest)
      extent = extent(size(extent):1:-1)
      largest = largest(size(largest):1:-1)
   end subroutine h5sget_simple_extent_dims_f

   subroutine h5sselect_hyperslab_f(space, operator, start, count, status)
      integer(hid_t), intent(in) :: space
      integer, intent(in) :: operator
      integer(hsize_t), intent(in) :: start(:), count(:)  !! in Fortran's order
      integer, intent(out) :: status

      status = h5sselect_hyperslab(space, operator, start(size(start):1:-1), c_null_ptr, &
         count(size(count):1:-1), c_null_ptr)
   end subroutine h5sselect_hyperslab_f

   subroutine h5sclose_f(space, status)
      integer(hid_t), intent(in) :: space
      integer, intent(out) :: status

      status = h5sclose(space)
   end subroutine h5sclose_f

   ! --- types ---------------------------------------------------------------------------------------

   subroutine h5tcopy_f(type, copy, status)
      integer(hid_t), intent(in) :: type
      integer(hid_t), intent(out) :: copy
      integer, intent(out) :: status

      copy = h5tcopy(type)
      status = status_of(copy)
   end subroutine h5tcopy_f

   subroutine h5tget_size_f(type, length, status)
      integer(hid_t), intent(in) :: type
      integer(size_t), intent(out) :: length
      integer, intent(out) :: status

      length = h5tget_size(type)
      status = merge(0, -1, length > 0)
   end subroutine h5tget_size_f

   subroutine h5tset_cset_f(type, value, status)
      integer(hid_t), intent(in) :: type
      integer, intent(in) :: value
      integer, intent(out) :: status

      status = h5tset_cset(type, value)
   end subroutine h5tset_cset_f

   subroutine h5tset_strpad_f(type, value, status)
      integer(hid_t), intent(in) :: type
      integer, intent(in) :: value
      integer, intent(out) :: status

      status = h5tset_strpad(type, value)
   end subroutine h5tset_strpad_f

   subroutine h5tis_variable_str_f(type, is_variable, status)
      integer(hid_t), intent(in) :: type
      logical, intent(out) :: is_variable
      integer, intent(out) :: status

      status = h5tis_variable_str(type)
      is_variable = status > 0
   end subroutine h5tis_variable_str_f

   subroutine h5tclose_f(type, status)
      integer(hid_t), intent(in) :: type
      integer, intent(out) :: status

      status = h5tclose(type)
   end subroutine h5tclose_f

   ! --- property lists ------------------------------------------------------------------------------

   subroutine h5pcreate_f(class, list, status)
      integer(hid_t), intent(in) :: class
      integer(hid_t), intent(out) :: list
      integer, intent(out) :: status

      list = h5pcreate(class)
      status = status_of(list)
   end subroutine h5pcreate_f

   subroutine h5pclose_f(list, status)
      integer(hid_t), intent(in) :: list
      integer, intent(out) :: status

      status = h5pclose(list)
   end subroutine h5pclose_f

   subroutine h5pset_libver_bounds_f(list, low, high, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: low
      integer, intent(in) :: high
      integer, intent(out) :: status

      status = h5pset_libver_bounds(list, low, high)
   end subroutine h5pset_libver_bounds_f

   subroutine h5pset_fclose_degree_f(list, degree, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: degree
      integer, intent(out) :: status

      status = h5pset_fclose_degree(list, degree)
   end subroutine h5pset_fclose_degree_f

   subroutine h5pset_meta_block_size_f(list, length, status)
      integer(hid_t), intent(in) :: list
      integer(hsize_t), intent(in) :: length
      integer, intent(out) :: status

      status = h5pset_meta_block_size(list, length)
   end subroutine h5pset_meta_block_size_f

   subroutine h5pset_small_data_block_size_f(list, length, status)
      integer(hid_t), intent(in) :: list
      integer(hsize_t), intent(in) :: length
      integer, intent(out) :: status

      status = h5pset_small_data_block_size(list, length)
   end subroutine h5pset_small_data_block_size_f

   subroutine h5pset_userblock_f(list, length, status)
      integer(hid_t), intent(in) :: list
      integer(hsize_t), intent(in) :: length
      integer, intent(out) :: status

      status = h5pset_userblock(list, length)
   end subroutine h5pset_userblock_f

   subroutine h5pset_alignment_f(list, threshold, alignment, status)
      integer(hid_t), intent(in) :: list
      integer(hsize_t), intent(in) :: threshold
      integer(hsize_t), intent(in) :: alignment
      integer, intent(out) :: status

      status = h5pset_alignment(list, threshold, alignment)
   end subroutine h5pset_alignment_f

   subroutine h5pset_link_phase_change_f(list, most, least, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: most
      integer, intent(in) :: least
      integer, intent(out) :: status

      status = h5pset_link_phase_change(list, most, least)
   end subroutine h5pset_link_phase_change_f

   subroutine h5pset_attr_phase_change_f(list, most, least, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: most
      integer, intent(in) :: least
      integer, intent(out) :: status

      status = h5pset_attr_phase_change(list, most, least)
   end subroutine h5pset_attr_phase_change_f

   subroutine h5pset_est_link_info_f(list, count, length, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: count
      integer, intent(in) :: length
      integer, intent(out) :: status

      status = h5pset_est_link_info(list, count, length)
   end subroutine h5pset_est_link_info_f

   subroutine h5pset_create_inter_group_f(list, create, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: create
      integer, intent(out) :: status

      status = h5pset_create_intermediate_group(list, create)
   end subroutine h5pset_create_inter_group_f

   subroutine h5pset_fill_time_f(list, when, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: when
      integer, intent(out) :: status

      status = h5pset_fill_time(list, when)
   end subroutine h5pset_fill_time_f

   subroutine h5pset_chunk_f(list, rank, extent, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: rank
      integer(hsize_t), intent(in) :: extent(:)  !! in Fortran's order
      integer, intent(out) :: status

      status = h5pset_chunk(list, rank, extent(rank:1:-1))
   end subroutine h5pset_chunk_f

   subroutine h5pset_chunk_cache_f(list, slots, bytes, preemption, status)
      integer(hid_t), intent(in) :: list
      integer(size_t), intent(in) :: slots, bytes
      real, intent(in) :: preemption
      integer, intent(out) :: status

      status = h5pset_chunk_cache(list, slots, bytes, real(preemption, c_double))
   end subroutine h5pset_chunk_cache_f

   subroutine h5pset_shuffle_f(list, status)
      integer(hid_t), intent(in) :: list
      integer, intent(out) :: status

      status = h5pset_shuffle(list)
   end subroutine h5pset_shuffle_f

   subroutine h5pset_fletcher32_f(list, status)
      integer(hid_t), intent(in) :: list
      integer, intent(out) :: status

      status = h5pset_fletcher32(list)
   end subroutine h5pset_fletcher32_f

   subroutine h5pset_deflate_f(list, level, status)
      integer(hid_t), intent(in) :: list
      integer, intent(in) :: level
      integer, intent(out) :: status

      status = h5pset_deflate(list, level)
   end subroutine h5pset_deflate_f

   ! --- what the calls above share --------------------------------------------------------------

   !> A name as C takes it; trailing blanks do not belong to it.
   pure function c_text(text) result(letters)
      character(*), intent(in) :: text
      character(kind=c_char) :: letters(len_trim(text) + 1)
      integer :: i

      do i = 1, len_trim(text)
         letters(i) = text(i:i)
      end do
      letters(len_trim(text) + 1) = c_null_char
   end function c_text

   !> A property list or a dataspace that may be left out.
   pure function given(list) result(id)
      integer(hid_t), intent(in), optional :: list
      integer(hid_t) :: id

      id = h5p_default_f
      if (present(list)) id = list
   end function given

   !> The status of a call that returns a number, negative where it failed.
   pure function status_of(id) result(status)
      integer(hid_t), intent(in) :: id
      integer :: status

      status = 0
      if (id < 0) status = -1
   end function status_of

end module hdf5_library
