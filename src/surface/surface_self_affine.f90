!> Self-affine random surfaces with a roll-off (thesis, eq. 1.6).
!>
!> The power spectral density is constant for k_l <= |k| <= k_r, falls as (|k|/k_r)^(-2 (1 + H)) up
!> to k_s, and is 0 elsewhere. k_l, k_r and k_s are 2 pi over the long, the roll-off and the short
!> wavelength. A profile (ny = 1) has the exponent -(1 + 2 H), which is that of a line cut through
!> such a surface. The ends of the band belong to it. The mean mode and the Nyquist modes are left
!> out.
!>
!> 'random_phase' gives every mode exactly the amplitude of the spectrum and a random phase, which
!> depends only on the mode and the seed. A finer grid therefore keeps the modes of a coarser one.
!> 'filtered_noise' multiplies the spectrum of Gaussian white noise, one number per cell, by the
!> square root of the power spectral density (after Hu and Tonder, Int. J. Mach. Tools Manufact. 32,
!> 1992). The amplitudes then scatter as well, as those of a measured surface do.
!>
!> Finally the surface is scaled to exactly the requested rms height over the cells, or to the
!> requested rms slope. The square of the rms slope is the sum of |k|^2 |c_k|^2 over the modes c_k,
!> which is the mean of |grad h|^2 of the surface that they describe. The surface is the same to the
!> last bit for any number of threads.
!>
!> Memory: one field in addition to the height.
module surface_self_affine
   use counter_random, only : normal_number, row_key, uniform_number
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int64, pi
   use real_transform, only : destroy_real_transform, new_real_transform, real_transform_type, &
      to_space, to_spectrum
   use regular_grid, only : grid_type
   use surface_settings, only : surface_settings_type
   use wave_vectors, only : is_nyquist, mode_number, wave_number
   implicit none
   private

   public :: add_self_affine, self_affine_psd

   !> A mode whose wave number differs from an end of the band by less than this, relatively,
   !> belongs to the band.
   real(dp), parameter :: edge = 1.0e-9_dp

contains

   !> Add a self-affine surface to a height map.
   subroutine add_self_affine(grid, term, height, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), intent(inout) :: height(:, :)                 !! m, shape [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      type(real_transform_type) :: transform
      real(dp) :: total
      integer :: i, j

      call new_real_transform(transform, grid%nx, grid%ny, error)
      if (allocated(error)) return
      if (term%generator == 'filtered_noise') then
         call white_noise(grid, term%seed, transform%space)
         call to_spectrum(transform)
         call filter(grid, term, transform%spectrum)
      else
         call random_phases(grid, term, transform%spectrum)
      end if
      total = weighted_sum(grid, transform%spectrum, term%rms_slope > 0.0_dp)
      if (total > 0.0_dp) then
         call scale(transform%spectrum, max(term%rms_height, term%rms_slope)/sqrt(total))
         call to_space(transform)
         !$omp parallel do default(none) shared(grid, height, transform) private(i)
         do j = 1, grid%ny
            do i = 1, grid%nx
               height(i, j) = height(i, j) + transform%space(i, j)
            end do
         end do
      else
         call fail(error, error_input, no_modes(term))
      end if
      call destroy_real_transform(transform)
   end subroutine add_self_affine

   !> The power spectral density relative to its value between k_l and k_r.
   elemental function self_affine_psd(term, k, profile) result(psd)
      type(surface_settings_type), intent(in) :: term
      real(dp), intent(in) :: k              !! |k|, rad/m
      logical, intent(in) :: profile         !! whether it is that of a profile and not of a surface
      real(dp) :: psd
      real(dp) :: exponent, k_rolloff

      k_rolloff = 2.0_dp*pi/term%wavelength_rolloff
      exponent = -2.0_dp*(1.0_dp + term%hurst)
      if (profile) exponent = -(1.0_dp + 2.0_dp*term%hurst)
      if (k < 2.0_dp*pi/term%wavelength_long*(1.0_dp - edge)) then
         psd = 0.0_dp
      else if (k > 2.0_dp*pi/term%wavelength_short*(1.0_dp + edge)) then
         psd = 0.0_dp
      else if (k <= k_rolloff) then
         psd = 1.0_dp
      else
         psd = (k/k_rolloff)**exponent
      end if
   end function self_affine_psd

   !> Amplitude of the mode at (i, j) of the half spectrum, not yet scaled.
   elemental function amplitude(grid, term, i, j) result(a)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      integer, intent(in) :: i, j
      real(dp) :: a

      a = 0.0_dp
      if (i == 1 .and. j == 1) return
      if (is_nyquist(i, grid%nx) .or. is_nyquist(j, grid%ny)) return
      a = sqrt(self_affine_psd(term, hypot(wave_number(i, grid%nx, grid%lx), &
         wave_number(j, grid%ny, grid%ly)), grid%ny == 1))
   end function amplitude

   !> Fill the spectrum with the amplitudes of the modes and with random phases.
   subroutine random_phases(grid, term, spectrum)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      complex(dp), intent(out) :: spectrum(:, :)
      integer :: i, j, row, sign_y
      integer(int64) :: key, mirror_key
      real(dp) :: a, phase

      !$omp parallel do default(none) shared(grid, term, spectrum) &
      !$omp private(i, row, sign_y, key, mirror_key, a, phase)
      do j = 1, grid%ny
         row = mode_number(j, grid%ny)
         sign_y = merge(-1, 1, row < 0)
         key = row_key(term%seed, row)
         mirror_key = row_key(term%seed, abs(row))
         do i = 1, size(spectrum, 1)
            a = amplitude(grid, term, i, j)
            if (.not. a > 0.0_dp) then
               spectrum(i, j) = (0.0_dp, 0.0_dp)
            else if (i == 1) then       ! k_x = 0: (0, -k_y) is the conjugate of (0, k_y)
               phase = 2.0_dp*pi*uniform_number(mirror_key, 0)
               spectrum(i, j) = cmplx(a*cos(phase), sign_y*a*sin(phase), dp)
            else
               phase = 2.0_dp*pi*uniform_number(key, i - 1)
               spectrum(i, j) = cmplx(a*cos(phase), a*sin(phase), dp)
            end if
         end do
      end do
   end subroutine random_phases

   !> Standard normal numbers on all cells.
   subroutine white_noise(grid, seed, field)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: seed
      real(dp), intent(inout) :: field(:, :)
      integer :: i, j
      integer(int64) :: key

      !$omp parallel do default(none) shared(grid, seed, field) private(i, key)
      do j = 1, grid%ny
         key = row_key(seed, j)
         do i = 1, grid%nx
            field(i, j) = normal_number(key, i)
         end do
      end do
   end subroutine white_noise

   !> Multiply the spectrum by the amplitudes.
   subroutine filter(grid, term, spectrum)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      complex(dp), intent(inout) :: spectrum(:, :)
      integer :: i, j

      !$omp parallel do default(none) shared(grid, term, spectrum) private(i)
      do j = 1, grid%ny
         do i = 1, size(spectrum, 1)
            spectrum(i, j) = amplitude(grid, term, i, j)*spectrum(i, j)
         end do
      end do
   end subroutine filter

   !> Sum of |c|^2, or of |k|^2 |c|^2, over all modes. Rows are summed first and then added in
   !> order, so that the result does not depend on the number of threads.
   function weighted_sum(grid, spectrum, slope) result(total)
      type(grid_type), intent(in) :: grid
      complex(dp), intent(in) :: spectrum(:, :)
      logical, intent(in) :: slope
      real(dp) :: total
      real(dp), allocatable :: row_sum(:)
      real(dp) :: k_y, power
      integer :: i, j

      allocate (row_sum(grid%ny))
      !$omp parallel do default(none) shared(grid, spectrum, slope, row_sum) private(i, k_y, power)
      do j = 1, grid%ny
         k_y = wave_number(j, grid%ny, grid%ly)
         row_sum(j) = 0.0_dp
         do i = 1, size(spectrum, 1)
            power = real(spectrum(i, j), dp)**2 + aimag(spectrum(i, j))**2
            if (slope) power = power*(wave_number(i, grid%nx, grid%lx)**2 + k_y**2)
            if (i > 1) power = 2.0_dp*power
            row_sum(j) = row_sum(j) + power
         end do
      end do
      total = sum(row_sum)
   end function weighted_sum

   !> Multiply the spectrum by a factor.
   subroutine scale(spectrum, factor)
      complex(dp), intent(inout) :: spectrum(:, :)
      real(dp), intent(in) :: factor
      integer :: j

      !$omp parallel do default(none) shared(spectrum, factor)
      do j = 1, size(spectrum, 2)
         spectrum(:, j) = factor*spectrum(:, j)
      end do
   end subroutine scale

   !> The message for a band in which no mode of the grid lies.
   pure function no_modes(term) result(message)
      type(surface_settings_type), intent(in) :: term
      character(:), allocatable :: message
      character(200) :: text

      write (text, '(2(a, es10.3), a)') '&surface: wavelength_short = ', term%wavelength_short, &
         ' m, wavelength_long = ', term%wavelength_long, ' m: no mode of the grid lies in the band'
      message = trim(text)//': give a longer wavelength_long, or a finer grid'
   end function no_modes

end module surface_self_affine
