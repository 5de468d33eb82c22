!> Interfaces to the part of FFTW 3 that is used here, in double and single precision.
!>
!> They are written from the FFTW manual. Plans are executed only by the new-array routines, and all buffers
!> come from `fftw_alloc_*`, because a plan needs arrays of the alignment for which it was made.
module asperity_fftw
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_ptr, c_size_t
   implicit none
   public

   integer(c_int), parameter :: fftw_measure = 0
   integer(c_int), parameter :: fftw_estimate = 64
   integer(c_int), parameter :: fftw_wisdom_only = 2097152   !! return only a plan that is already known
   integer(c_int), parameter :: fftw_forward = -1
   integer(c_int), parameter :: fftw_backward = 1
   integer(c_int), parameter :: fftw_redft00 = 3
   integer(c_int), parameter :: fftw_rodft00 = 7

   interface

      type(c_ptr) function fftw_alloc_real(n) bind(c, name='fftw_alloc_real')
         import :: c_ptr, c_size_t
         integer(c_size_t), value :: n
      end function fftw_alloc_real

      type(c_ptr) function fftwf_alloc_real(n) bind(c, name='fftwf_alloc_real')
         import :: c_ptr, c_size_t
         integer(c_size_t), value :: n
      end function fftwf_alloc_real

      subroutine fftw_free(p) bind(c, name='fftw_free')
         import :: c_ptr
         type(c_ptr), value :: p
      end subroutine fftw_free

      subroutine fftwf_free(p) bind(c, name='fftwf_free')
         import :: c_ptr
         type(c_ptr), value :: p
      end subroutine fftwf_free

      type(c_ptr) function fftw_plan_many_dft_r2c(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, flags) bind(c, name='fftw_plan_many_dft_r2c')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftw_plan_many_dft_r2c

      type(c_ptr) function fftw_plan_many_dft_c2r(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, flags) bind(c, name='fftw_plan_many_dft_c2r')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftw_plan_many_dft_c2r

      type(c_ptr) function fftw_plan_many_dft(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, direction, flags) bind(c, name='fftw_plan_many_dft')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, direction, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftw_plan_many_dft

      type(c_ptr) function fftwf_plan_many_dft_r2c(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, flags) bind(c, name='fftwf_plan_many_dft_r2c')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftwf_plan_many_dft_r2c

      type(c_ptr) function fftwf_plan_many_dft_c2r(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, flags) bind(c, name='fftwf_plan_many_dft_c2r')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftwf_plan_many_dft_c2r

      type(c_ptr) function fftwf_plan_many_dft(rank, n, howmany, in, inembed, istride, idist, &
         out, onembed, ostride, odist, direction, flags) bind(c, name='fftwf_plan_many_dft')
         import :: c_int, c_ptr
         integer(c_int), value :: rank, howmany, istride, idist, ostride, odist, direction, flags
         integer(c_int), intent(in) :: n(*), inembed(*), onembed(*)
         type(c_ptr), value :: in, out
      end function fftwf_plan_many_dft

      subroutine fftw_execute_dft_r2c(plan, in, out) bind(c, name='fftw_execute_dft_r2c')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftw_execute_dft_r2c

      subroutine fftw_execute_dft_c2r(plan, in, out) bind(c, name='fftw_execute_dft_c2r')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftw_execute_dft_c2r

      subroutine fftw_execute_dft(plan, in, out) bind(c, name='fftw_execute_dft')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftw_execute_dft

      subroutine fftwf_execute_dft_r2c(plan, in, out) bind(c, name='fftwf_execute_dft_r2c')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftwf_execute_dft_r2c

      subroutine fftwf_execute_dft_c2r(plan, in, out) bind(c, name='fftwf_execute_dft_c2r')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftwf_execute_dft_c2r

      subroutine fftwf_execute_dft(plan, in, out) bind(c, name='fftwf_execute_dft')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftwf_execute_dft

      type(c_ptr) function fftw_plan_r2r_1d(n, in, out, kind, flags) bind(c, name='fftw_plan_r2r_1d')
         import :: c_int, c_ptr
         integer(c_int), value :: n, kind, flags
         type(c_ptr), value :: in, out
      end function fftw_plan_r2r_1d

      subroutine fftw_execute_r2r(plan, in, out) bind(c, name='fftw_execute_r2r')
         import :: c_ptr
         type(c_ptr), value :: plan, in, out
      end subroutine fftw_execute_r2r

      subroutine fftw_destroy_plan(plan) bind(c, name='fftw_destroy_plan')
         import :: c_ptr
         type(c_ptr), value :: plan
      end subroutine fftw_destroy_plan

      subroutine fftwf_destroy_plan(plan) bind(c, name='fftwf_destroy_plan')
         import :: c_ptr
         type(c_ptr), value :: plan
      end subroutine fftwf_destroy_plan

      integer(c_int) function fftw_import_wisdom_from_filename(file) &
         bind(c, name='fftw_import_wisdom_from_filename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: file(*)
      end function fftw_import_wisdom_from_filename

      integer(c_int) function fftw_export_wisdom_to_filename(file) &
         bind(c, name='fftw_export_wisdom_to_filename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: file(*)
      end function fftw_export_wisdom_to_filename

      type(c_ptr) function fftw_export_wisdom_to_string() bind(c, name='fftw_export_wisdom_to_string')
         import :: c_ptr
      end function fftw_export_wisdom_to_string

      integer(c_int) function fftw_import_wisdom_from_string(text) &
         bind(c, name='fftw_import_wisdom_from_string')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: text(*)
      end function fftw_import_wisdom_from_string

      type(c_ptr) function fftwf_export_wisdom_to_string() bind(c, name='fftwf_export_wisdom_to_string')
         import :: c_ptr
      end function fftwf_export_wisdom_to_string

      integer(c_int) function fftwf_import_wisdom_from_string(text) &
         bind(c, name='fftwf_import_wisdom_from_string')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: text(*)
      end function fftwf_import_wisdom_from_string

      integer(c_int) function fftwf_import_wisdom_from_filename(file) &
         bind(c, name='fftwf_import_wisdom_from_filename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: file(*)
      end function fftwf_import_wisdom_from_filename

      integer(c_int) function fftwf_export_wisdom_to_filename(file) &
         bind(c, name='fftwf_export_wisdom_to_filename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: file(*)
      end function fftwf_export_wisdom_to_filename

   end interface

end module asperity_fftw
