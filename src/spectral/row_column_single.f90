!> Transforms by rows and columns in single precision, for module `fft_conv`. They take half the memory and
!> about half the time.
!>
!> The error of the results is about 1e-7 of the largest value. Values and symbols are expressed in units of
!> about their own magnitude, so that their squares stay in the range of single precision whatever units
!> the caller uses.
module row_column_single
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_int, c_loc, c_null_ptr, c_ptr, &
      c_size_t
   use asperity_fftw, only : fft_alloc => fftwf_alloc_real, fft_backward => fftw_backward, &
      fft_destroy_plan => fftwf_destroy_plan, fft_execute_dft => fftwf_execute_dft, &
      fft_execute_dft_c2r => fftwf_execute_dft_c2r, fft_execute_dft_r2c => fftwf_execute_dft_r2c, &
      fft_forward => fftw_forward, fft_free => fftwf_free, &
      fft_plan_many_dft => fftwf_plan_many_dft, &
      fft_plan_many_dft_c2r => fftwf_plan_many_dft_c2r, &
      fft_plan_many_dft_r2c => fftwf_plan_many_dft_r2c
   use asperity_parallel, only : any_process, global_sum, is_first_process
   use asperity_errors, only : error_input, error_memory, error_type, fail
   use column_parcels_single, only : block, column_parcels_type, new_column_parcels
   use omp_lib, only : omp_get_thread_num
   use asperity_precision, only : dp, int64, wp => sp
   use transform_shape, only : transform_shape_type
   use wisdom, only : from_measuring, from_memory, planning_flag, save_wisdom, share_wisdom
   implicit none
   private

   public :: block, new_row_column, row_column_type

   include 'row_column.inc'      ! state cd3cf29d, written by tools/check_sources.py --update

end module row_column_single
