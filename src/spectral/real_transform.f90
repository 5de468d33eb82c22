!> A two-dimensional real FFT in place, for work that is done once per run: surfaces, spectra, derivatives.
!>
!> It runs on one thread (FFTW's default), so that its result is the same to the last bit for any number of
!> threads. Memory: one field of doubles (nx padded by one or two).
module real_transform
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_int, c_null_ptr, c_ptr, &
      c_size_t
   use asperity_errors, only : error_input, error_memory, error_type, fail
   use asperity_fftw, only : fftw_alloc_real, fftw_destroy_plan, fftw_estimate, fftw_execute_dft_c2r, &
      fftw_execute_dft_r2c, fftw_free, fftw_plan_many_dft_c2r, fftw_plan_many_dft_r2c
   use asperity_precision, only : dp
   implicit none
   private

   public :: destroy_real_transform, new_real_transform, real_transform_type, to_space, to_spectrum

   !> The buffer, seen as a field and as its spectrum. Never copy an object of this type.
   type :: real_transform_type
      integer :: nx = 0
      integer :: ny = 0
      real(dp), pointer, contiguous :: space(:, :) => null()         !! [2 (nx/2 + 1), ny], nx used
      complex(dp), pointer, contiguous :: spectrum(:, :) => null()   !! [nx/2 + 1, ny]
      type(c_ptr), private :: buffer = c_null_ptr
      type(c_ptr), private :: forward = c_null_ptr
      type(c_ptr), private :: backward = c_null_ptr
   end type real_transform_type

contains

   !> Allocate the buffer and make the plans.
   subroutine new_real_transform(self, nx, ny, error)
      type(real_transform_type), intent(inout) :: self
      integer, intent(in) :: nx, ny                              !! size of the field
      type(error_type), allocatable, intent(inout) :: error      !! with an error, nothing is done
      integer(c_int) :: n(2), field_shape(2), spectrum_shape(2)
      character(80) :: text

      if (allocated(error)) return
      call destroy_real_transform(self)
      self%nx = nx
      self%ny = ny
      n = [ny, nx]
      spectrum_shape = [ny, nx/2 + 1]
      field_shape = [ny, 2*(nx/2 + 1)]

      self%buffer = fftw_alloc_real(2*int(nx/2 + 1, c_size_t)*int(ny, c_size_t))
      if (c_associated(self%buffer)) then
         !$omp critical (fftw_planner)
         self%forward = fftw_plan_many_dft_r2c(2_c_int, n, 1_c_int, self%buffer, field_shape, &
            1_c_int, 0_c_int, self%buffer, spectrum_shape, 1_c_int, 0_c_int, fftw_estimate)
         self%backward = fftw_plan_many_dft_c2r(2_c_int, n, 1_c_int, self%buffer, spectrum_shape, &
            1_c_int, 0_c_int, self%buffer, field_shape, 1_c_int, 0_c_int, fftw_estimate)
         !$omp end critical (fftw_planner)
      end if

      if (.not. (c_associated(self%forward) .and. c_associated(self%backward))) then
         write (text, '("a transform of ", i0, " x ", i0, " points")') nx, ny
         if (c_associated(self%buffer)) then
            call fail(error, error_input, 'FFTW has no plan for '//trim(text))
         else
            call fail(error, error_memory, 'not enough memory for '//trim(text))
         end if
         call destroy_real_transform(self)
         return
      end if

      call c_f_pointer(self%buffer, self%space, [2*(nx/2 + 1), ny])
      call c_f_pointer(self%buffer, self%spectrum, [nx/2 + 1, ny])
   end subroutine new_real_transform

   !> Field to spectrum, without a factor: sum of f exp(-i k x).
   subroutine to_spectrum(self)
      type(real_transform_type), intent(inout) :: self

      call fftw_execute_dft_r2c(self%forward, self%buffer, self%buffer)
   end subroutine to_spectrum

   !> Spectrum to field, without a factor: sum of c exp(i k x) over all modes.
   subroutine to_space(self)
      type(real_transform_type), intent(inout) :: self

      call fftw_execute_dft_c2r(self%backward, self%buffer, self%buffer)
   end subroutine to_space

   !> Free everything; harmless on an empty object.
   subroutine destroy_real_transform(self)
      type(real_transform_type), intent(inout) :: self

      !$omp critical (fftw_planner)
      if (c_associated(self%forward)) call fftw_destroy_plan(self%forward)
      if (c_associated(self%backward)) call fftw_destroy_plan(self%backward)
      !$omp end critical (fftw_planner)
      if (c_associated(self%buffer)) call fftw_free(self%buffer)
      self%forward = c_null_ptr
      self%backward = c_null_ptr
      self%buffer = c_null_ptr
      nullify (self%space, self%spectrum)
      self%nx = 0
      self%ny = 0
   end subroutine destroy_real_transform

end module real_transform
