!> Transforms by rows and columns in double precision, for module `fft_conv`.
module row_column_double
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_int, c_loc, c_null_ptr, c_ptr, &
      c_size_t
   use asperity_fftw, only : fft_alloc => fftw_alloc_real, fft_backward => fftw_backward, &
      fft_destroy_plan => fftw_destroy_plan, fft_execute_dft => fftw_execute_dft, &
      fft_execute_dft_c2r => fftw_execute_dft_c2r, fft_execute_dft_r2c => fftw_execute_dft_r2c, &
      fft_forward => fftw_forward, fft_free => fftw_free, &
      fft_plan_many_dft => fftw_plan_many_dft, &
      fft_plan_many_dft_c2r => fftw_plan_many_dft_c2r, &
      fft_plan_many_dft_r2c => fftw_plan_many_dft_r2c
   use asperity_parallel, only : any_process, global_sum, is_first_process
   use asperity_errors, only : error_input, error_memory, error_type, fail
   use column_parcels_double, only : block, column_parcels_type, new_column_parcels
   use omp_lib, only : omp_get_thread_num
   use asperity_precision, only : dp, int64, wp => dp
   use transform_shape, only : transform_shape_type
   use wisdom, only : from_measuring, from_memory, planning_flag, save_wisdom, share_wisdom
   implicit none
   private

   public :: block, new_row_column, row_column_type

   include 'row_column.inc'      ! state cd3cf29d, written by tools/check_sources.py --update

end module row_column_double
