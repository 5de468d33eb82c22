!> C functions of HDF5 for property lists, and the numbers of predefined types and property classes.
!> Their results and arguments are explained in `hdf5_c_objects`.
!>
!> HDF5 keeps these numbers in global variables of C, which Fortran cannot name. They are declared
!> here as procedures that nothing calls, and `value_of` reads the variable at the address of a
!> procedure.
module hdf5_c_lists
   use, intrinsic :: iso_c_binding, only : c_double, c_f_pointer, c_funptr, c_int, c_null_ptr
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   implicit none
   private

   public :: h5p_cls_dataset_access_id_g, h5p_cls_dataset_create_id_g, h5p_cls_file_access_id_g, &
      h5p_cls_file_create_id_g, h5p_cls_group_create_id_g, h5p_cls_link_create_id_g, &
      h5p_cls_object_copy_id_g, h5pclose, &
      h5pcreate, h5pget_chunk, h5pget_layout, h5pset_alignment, h5pset_attr_phase_change, h5pset_chunk, h5pset_chunk_cache, &
      h5pset_copy_object, h5pset_create_intermediate_group, h5pset_deflate, h5pset_est_link_info, &
      h5pset_fclose_degree, h5pset_fill_time, h5pset_fletcher32, &
      h5pset_libver_bounds, h5pset_link_phase_change, &
      h5pset_meta_block_size, h5pset_shuffle, h5pset_small_data_block_size, h5pset_userblock, &
      h5t_c_s1_g, h5t_ieee_f64le_g, h5t_native_double_g, h5t_native_int8_g, h5t_native_int_g, &
      h5t_std_i32le_g, h5t_std_i8le_g, value_of

   interface

      function h5pcreate(class) bind(c, name='H5Pcreate') result(found)
         import :: hid_t
         integer(hid_t), value :: class
         integer(hid_t) :: found
      end function h5pcreate

      function h5pclose(list) bind(c, name='H5Pclose') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pclose

      function h5pset_libver_bounds(list, low, high) &
         bind(c, name='H5Pset_libver_bounds') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: low, high
         integer(c_int) :: status
      end function h5pset_libver_bounds

      function h5pset_fclose_degree(list, degree) &
         bind(c, name='H5Pset_fclose_degree') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: degree
         integer(c_int) :: status
      end function h5pset_fclose_degree

      function h5pset_meta_block_size(list, length) &
         bind(c, name='H5Pset_meta_block_size') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_meta_block_size

      function h5pset_small_data_block_size(list, length) &
         bind(c, name='H5Pset_small_data_block_size') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_small_data_block_size

      function h5pset_userblock(list, length) bind(c, name='H5Pset_userblock') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: length
         integer(c_int) :: status
      end function h5pset_userblock

      function h5pset_alignment(list, threshold, alignment) &
         bind(c, name='H5Pset_alignment') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(hsize_t), value :: threshold, alignment
         integer(c_int) :: status
      end function h5pset_alignment

      function h5pset_link_phase_change(list, most, least) &
         bind(c, name='H5Pset_link_phase_change') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: most, least
         integer(c_int) :: status
      end function h5pset_link_phase_change

      function h5pset_attr_phase_change(list, most, least) &
         bind(c, name='H5Pset_attr_phase_change') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: most, least
         integer(c_int) :: status
      end function h5pset_attr_phase_change

      function h5pset_est_link_info(list, count, length) &
         bind(c, name='H5Pset_est_link_info') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: count, length
         integer(c_int) :: status
      end function h5pset_est_link_info

      function h5pset_create_intermediate_group(list, create) &
         bind(c, name='H5Pset_create_intermediate_group') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: create
         integer(c_int) :: status
      end function h5pset_create_intermediate_group

      function h5pset_copy_object(list, options) bind(c, name='H5Pset_copy_object') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: options
         integer(c_int) :: status
      end function h5pset_copy_object

      function h5pset_fill_time(list, when) bind(c, name='H5Pset_fill_time') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: when
         integer(c_int) :: status
      end function h5pset_fill_time

      function h5pset_chunk(list, rank, extent) bind(c, name='H5Pset_chunk') result(status)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(c_int), value :: rank
         integer(hsize_t), intent(in) :: extent(*)
         integer(c_int) :: status
      end function h5pset_chunk

      function h5pset_chunk_cache(list, slots, bytes, preemption) &
         bind(c, name='H5Pset_chunk_cache') result(status)
         import :: c_double, c_int, hid_t, size_t
         integer(hid_t), value :: list
         integer(size_t), value :: slots, bytes
         real(c_double), value :: preemption
         integer(c_int) :: status
      end function h5pset_chunk_cache

      function h5pset_shuffle(list) bind(c, name='H5Pset_shuffle') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pset_shuffle

      function h5pset_fletcher32(list) bind(c, name='H5Pset_fletcher32') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: status
      end function h5pset_fletcher32

      function h5pset_deflate(list, level) bind(c, name='H5Pset_deflate') result(status)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int), value :: level
         integer(c_int) :: status
      end function h5pset_deflate

      function h5pget_layout(list) bind(c, name='H5Pget_layout') result(layout)
         import :: c_int, hid_t
         integer(hid_t), value :: list
         integer(c_int) :: layout
      end function h5pget_layout

      function h5pget_chunk(list, most, extent) bind(c, name='H5Pget_chunk') result(rank)
         import :: c_int, hid_t, hsize_t
         integer(hid_t), value :: list
         integer(c_int), value :: most
         integer(hsize_t), intent(out) :: extent(*)
         integer(c_int) :: rank
      end function h5pget_chunk

      subroutine h5t_native_double_g() bind(c, name='H5T_NATIVE_DOUBLE_g')
      end subroutine h5t_native_double_g

      subroutine h5t_native_int_g() bind(c, name='H5T_NATIVE_INT_g')
      end subroutine h5t_native_int_g

      subroutine h5t_native_int8_g() bind(c, name='H5T_NATIVE_INT8_g')
      end subroutine h5t_native_int8_g

      subroutine h5t_ieee_f64le_g() bind(c, name='H5T_IEEE_F64LE_g')
      end subroutine h5t_ieee_f64le_g

      subroutine h5t_std_i32le_g() bind(c, name='H5T_STD_I32LE_g')
      end subroutine h5t_std_i32le_g

      subroutine h5t_std_i8le_g() bind(c, name='H5T_STD_I8LE_g')
      end subroutine h5t_std_i8le_g

      subroutine h5t_c_s1_g() bind(c, name='H5T_C_S1_g')
      end subroutine h5t_c_s1_g

      subroutine h5p_cls_dataset_access_id_g() bind(c, name='H5P_CLS_DATASET_ACCESS_ID_g')
      end subroutine h5p_cls_dataset_access_id_g

      subroutine h5p_cls_dataset_create_id_g() bind(c, name='H5P_CLS_DATASET_CREATE_ID_g')
      end subroutine h5p_cls_dataset_create_id_g

      subroutine h5p_cls_file_access_id_g() bind(c, name='H5P_CLS_FILE_ACCESS_ID_g')
      end subroutine h5p_cls_file_access_id_g

      subroutine h5p_cls_file_create_id_g() bind(c, name='H5P_CLS_FILE_CREATE_ID_g')
      end subroutine h5p_cls_file_create_id_g

      subroutine h5p_cls_group_create_id_g() bind(c, name='H5P_CLS_GROUP_CREATE_ID_g')
      end subroutine h5p_cls_group_create_id_g

      subroutine h5p_cls_link_create_id_g() bind(c, name='H5P_CLS_LINK_CREATE_ID_g')
      end subroutine h5p_cls_link_create_id_g

      subroutine h5p_cls_object_copy_id_g() bind(c, name='H5P_CLS_OBJECT_COPY_ID_g')
      end subroutine h5p_cls_object_copy_id_g
   end interface

contains

   !> The value of the global variable at the address of a name, once `h5open` has been called.
   function value_of(variable) result(found)
      type(c_funptr), value :: variable     !! `c_funloc` of the name
      integer(hid_t) :: found
      integer(hid_t), pointer :: content

      call c_f_pointer(transfer(variable, c_null_ptr), content)
      found = content
   end function value_of

end module hdf5_c_lists
