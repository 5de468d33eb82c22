!> What Fortran needs in addition to the C functions of HDF5 (`hdf5_c_objects`, `hdf5_c_values`,
!> `hdf5_c_lists`): the constants of C's headers, texts as C takes them, and the extents of arrays,
!> whose order in C is the reverse of Fortran's.
!>
!> Constants have the names of HDF5's manual. `status` is negative after a failure.
module hdf5_library
   use, intrinsic :: iso_c_binding, only : c_char, c_funloc, c_loc, c_long, c_null_char, c_null_ptr
   use hdf5_c_lists, only : h5p_cls_dataset_access_id_g, h5p_cls_dataset_create_id_g, &
      h5p_cls_file_access_id_g, h5p_cls_file_create_id_g, h5p_cls_group_create_id_g, &
      h5p_cls_link_create_id_g, h5p_cls_object_copy_id_g, h5pset_chunk, h5t_c_s1_g, h5t_ieee_f64le_g, &
      h5t_native_double_g, h5t_native_int8_g, h5t_native_int_g, h5t_std_i32le_g, h5t_std_i8le_g, value_of
   use hdf5_c_objects, only : group_info_type, h5gget_info_by_name, h5lget_name_by_idx, h5open
   use hdf5_c_values, only : h5screate_simple, h5sget_simple_extent_dims, &
      h5sget_simple_extent_ndims, h5tcopy, h5tset_size
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   implicit none
   private

   public :: c_text, extent_of_space, member_count, member_name, open_library, set_chunk, &
      simple_space, status_of

   integer, parameter, public :: h5f_acc_rdonly = 0
   integer, parameter, public :: h5f_acc_rdwr = 1
   integer, parameter, public :: h5f_acc_trunc = 2
   integer, parameter, public :: h5f_close_strong = 3
   integer, parameter, public :: h5f_libver_v18 = 1
   integer, parameter, public :: h5f_scope_local = 0
   integer, parameter, public :: h5i_group = 2
   integer, parameter, public :: h5i_dataset = 5
   integer, parameter, public :: h5o_copy_without_attr = 16
   integer, parameter, public :: h5d_fill_time_never = 1
   integer, parameter, public :: h5s_scalar = 0
   integer, parameter, public :: h5s_select_set = 0
   integer(hid_t), parameter, public :: h5s_all = 0
   integer(hsize_t), parameter, public :: h5s_unlimited = -1
   integer, parameter, public :: h5t_cset_utf8 = 1
   integer, parameter, public :: h5t_str_nullterm = 0
   integer(hid_t), parameter, public :: h5p_default = 0
   integer, parameter :: h5_index_name = 0
   integer, parameter :: h5_iter_inc = 0

   ! Known after `open_library`.
   integer(hid_t), public, protected :: h5t_native_double, h5t_native_int, h5t_native_int8
   integer(hid_t), public, protected :: h5t_ieee_f64le, h5t_std_i32le, h5t_std_i8le
   integer(hid_t), public, protected :: h5t_string   !! text of variable length
   integer(hid_t), public, protected :: h5p_dataset_access, h5p_dataset_create
   integer(hid_t), public, protected :: h5p_file_access, h5p_file_create
   integer(hid_t), public, protected :: h5p_group_create, h5p_link_create, h5p_object_copy

contains

   !> Start HDF5, and look up the numbers of its types and property classes.
   subroutine open_library(status)
      integer, intent(out) :: status

      status = h5open()
      if (status < 0) return
      h5t_native_double = value_of(c_funloc(h5t_native_double_g))
      h5t_native_int = value_of(c_funloc(h5t_native_int_g))
      h5t_native_int8 = value_of(c_funloc(h5t_native_int8_g))
      h5t_ieee_f64le = value_of(c_funloc(h5t_ieee_f64le_g))
      h5t_std_i32le = value_of(c_funloc(h5t_std_i32le_g))
      h5t_std_i8le = value_of(c_funloc(h5t_std_i8le_g))
      h5p_dataset_access = value_of(c_funloc(h5p_cls_dataset_access_id_g))
      h5p_dataset_create = value_of(c_funloc(h5p_cls_dataset_create_id_g))
      h5p_file_access = value_of(c_funloc(h5p_cls_file_access_id_g))
      h5p_file_create = value_of(c_funloc(h5p_cls_file_create_id_g))
      h5p_group_create = value_of(c_funloc(h5p_cls_group_create_id_g))
      h5p_link_create = value_of(c_funloc(h5p_cls_link_create_id_g))
      h5p_object_copy = value_of(c_funloc(h5p_cls_object_copy_id_g))
      h5t_string = h5tcopy(value_of(c_funloc(h5t_c_s1_g)))
      status = h5tset_size(h5t_string, -1_size_t)      ! H5T_VARIABLE
   end subroutine open_library

   !> A text in the form that C expects, without trailing blanks.
   pure function c_text(text) result(letters)
      character(*), intent(in) :: text
      character(len_trim(text) + 1, kind=c_char) :: letters

      letters = trim(text)//c_null_char
   end function c_text

   !> The status of a call that returns an id, which is negative after a failure.
   elemental function status_of(id) result(status)
      integer(hid_t), intent(in) :: id
      integer :: status

      status = 0
      if (id < 0) status = -1
   end function status_of

   !> Number of links in a group.
   subroutine member_count(location, group, count, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: group
      integer, intent(out) :: count
      integer, intent(out) :: status
      type(group_info_type) :: info

      count = 0
      status = h5gget_info_by_name(location, c_text(group), info, h5p_default)
      if (status >= 0) count = int(info%links)
   end subroutine member_count

   !> Name of a link in a group; links are in alphabetical order.
   subroutine member_name(location, group, n, name, status)
      integer(hid_t), intent(in) :: location
      character(*), intent(in) :: group
      integer, intent(in) :: n                  !! number of the link, from 0
      character(*), intent(out) :: name         !! cut off if it is longer
      integer, intent(out) :: status
      character(len(name) + 1, kind=c_char) :: letters
      integer(c_long) :: length

      name = ''
      length = h5lget_name_by_idx(location, c_text(group), h5_index_name, h5_iter_inc, &
         int(n, hsize_t), letters, int(len(letters), size_t), h5p_default)
      status = status_of(int(length, hid_t))
      if (status >= 0) name = letters(:min(int(length), len(name)))
   end subroutine member_name

   !> A new dataspace for an array; its id is negative after a failure.
   function simple_space(extent, largest) result(space)
      integer(hsize_t), intent(in) :: extent(:)             !! in Fortran's order
      integer(hsize_t), intent(in), optional :: largest(:)  !! default `extent`
      integer(hid_t) :: space
      integer(hsize_t), target :: reversed(size(extent))

      if (present(largest)) then
         reversed = largest(size(largest):1:-1)
         space = h5screate_simple(size(extent), extent(size(extent):1:-1), c_loc(reversed))
      else
         space = h5screate_simple(size(extent), extent(size(extent):1:-1), c_null_ptr)
      end if
   end function simple_space

   !> The extent of a dataspace; of size 0 for a single value and after a failure.
   subroutine extent_of_space(space, extent, status)
      integer(hid_t), intent(in) :: space
      integer(hsize_t), allocatable, intent(out) :: extent(:)   !! in Fortran's order
      integer, intent(out) :: status
      integer(hsize_t) :: found(32), largest(32)    ! H5S_MAX_RANK is 32
      integer :: rank

      allocate (extent(0))
      rank = h5sget_simple_extent_ndims(space)
      status = min(rank, 0)
      if (rank <= 0) return
      status = h5sget_simple_extent_dims(space, found, largest)
      if (status >= 0) extent = found(rank:1:-1)
   end subroutine extent_of_space

   !> Let a new dataset be stored in chunks.
   function set_chunk(list, extent) result(status)
      integer(hid_t), intent(in) :: list            !! properties of the dataset
      integer(hsize_t), intent(in) :: extent(:)     !! of a chunk, in Fortran's order
      integer :: status

      status = h5pset_chunk(list, size(extent), extent(size(extent):1:-1))
   end function set_chunk

end module hdf5_library
