!> Self-affine random surfaces with a roll-off (thesis, eq. 1.6).
!>
!> The power spectral density is constant for k_l <= |k| <= k_r, falls as (|k|/k_r)^(-2 (1 + H)) up
!> to k_s, and is 0 elsewhere. k_l, k_r and k_s are 2 pi over the long, the roll-off and the short
!> wavelength. A profile (ny = 1) has the exponent -(1 + 2 H), which is that of a line cut through
!> such a surface. The ends of the band are included. The mean mode and the Nyquist modes are left
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
!> last bit for any number of threads and processes: the sums are added up by columns of the spectrum.
!>
!> Memory: one field in addition to the height.
module surface_self_affine
   use counter_random, only : normal_number, row_key, uniform_number
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int64, pi
   use asperity_parallel, only : global_sum
   use field_sums, only : threads_for
   use regular_grid, only : grid_type
   use row_column_double, only : block, multiplier_type, new_row_column, row_column_type
   use surface_settings, only : surface_settings_type
   use text_tools, only : to_text
   use transform_shape, only : shape_on_grid, transform_shape_type
   use wave_vectors, only : is_nyquist, mode_number, wave_number
   implicit none
   private

   public :: add_self_affine, has_modes, self_affine_psd

   !> A mode whose wave number differs from an end of the band by less than this, relatively,
   !> belongs to the band.
   real(dp), parameter :: edge = 1.0e-9_dp

   !> The amplitudes and phases of the modes.
   type, extends(multiplier_type) :: rough_modes_type
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      !> Sums of |c|^2, or of |k|^2 |c|^2, by wave number along x, from 0. One thread has a whole column, so that
      !> they do not depend on the number of threads.
      real(dp), pointer, contiguous :: sums(:) => null()
   contains
      procedure :: multiply => give_amplitudes
   end type rough_modes_type

contains

   !> Add a self-affine surface to a height map. Collective where processes share the rows.
   subroutine add_self_affine(grid, term, height, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), intent(inout) :: height(:, :)                 !! m, shape [nx, rows]
      type(error_type), allocatable, intent(out) :: error
      type(row_column_type) :: transform
      type(transform_shape_type) :: shape
      real(dp) :: total, factor
      integer :: threads, j

      shape = shape_on_grid(grid, 1)
      shape%mx = grid%nx                     ! without padding: the surface is periodic on any grid
      shape%my = grid%ny
      if (term%generator == 'random_phase') shape%inputs = 0
      threads = threads_for(height)
      call new_row_column(transform, shape, threads, error)
      if (allocated(error)) return
      if (term%generator == 'filtered_noise') call add_noise(grid, term%seed, threads, transform)
      call shape_modes(grid, term, transform, total)
      if (total > 0.0_dp) then
         factor = max(term%rms_height, term%rms_slope)/sqrt(total)
         !$omp parallel do default(none) shared(grid, height, transform, factor) num_threads(threads)
         do j = 1, grid%rows()
            call transform%add_backward_row(1, j, factor, height(:, j))
         end do
      else
         call fail(error, error_input, no_modes(term))
      end if
      call transform%destroy()
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
      real(dp) :: k_x, k_y

      a = 0.0_dp
      if (i == 1 .and. j == 1) return
      if (is_nyquist(i, grid%nx) .or. is_nyquist(j, grid%ny)) return
      k_x = wave_number(i, grid%nx, grid%lx)
      k_y = wave_number(j, grid%ny, grid%ly)
      ! On fine grids most modes are far too short: they need no root.
      if (max(abs(k_x), abs(k_y)) > 4.0_dp*pi/term%wavelength_short) return
      a = sqrt(self_affine_psd(term, hypot(k_x, k_y), grid%ny == 1))
   end function amplitude

   !> Does any mode of the grid lie in the band? Of the modes with the same wave number along x, those that are just longer
   !> or shorter than the long end of the band decide.
   pure logical function has_modes(grid, term)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      real(dp) :: k_x, along_y
      integer :: i, j, first

      has_modes = .true.
      do i = 1, grid%nx/2 + 1
         k_x = wave_number(i, grid%nx, grid%lx)
         along_y = sqrt(max((2.0_dp*pi/term%wavelength_long)**2 - k_x**2, 0.0_dp))*grid%ly/(2.0_dp*pi)
         if (along_y > grid%ny) cycle
         first = int(along_y)
         do j = max(first, 1), min(first + 3, grid%ny/2 + 1)
            if (amplitude(grid, term, i, j) > 0.0_dp) return
         end do
      end do
      has_modes = .false.
   end function has_modes

   !> White noise: standard normal numbers on all cells, transformed row by row.
   subroutine add_noise(grid, seed, threads, transform)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: seed
      integer, intent(in) :: threads
      type(row_column_type), intent(inout) :: transform
      real(dp), allocatable :: row(:)
      integer(int64) :: key
      integer :: i, j

      allocate (row(grid%nx))
      !$omp parallel do default(none) shared(grid, seed, transform) private(i, key) firstprivate(row) &
      !$omp num_threads(threads)
      do j = 1, grid%rows()
         key = row_key(seed, grid%first_row + j - 1)
         do i = 1, grid%nx
            row(i) = normal_number(key, i)
         end do
         call transform%forward_row(1, j, row)
      end do
   end subroutine add_noise

   !> Give the modes their amplitudes, and transform them along y.
   subroutine shape_modes(grid, term, transform, total)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      type(row_column_type), intent(inout) :: transform
      real(dp), intent(out) :: total               !! sum of |c|^2, or of |k|^2 |c|^2, over all modes
      type(rough_modes_type) :: rough_modes
      real(dp), allocatable, target :: sums(:)
      integer :: i

      allocate (sums(0:transform%longest), source=0.0_dp)
      rough_modes%grid = grid
      rough_modes%term = term
      rough_modes%sums(0:) => sums
      call transform%columns_through(rough_modes)
      if (grid%shared) sums = global_sum(sums)
      total = 0.0_dp
      do i = 0, grid%nx/2
         total = total + merge(1.0_dp, 2.0_dp, i == 0)*sums(i)
      end do
   end subroutine shape_modes

   !> Give a row of a block of columns its amplitudes, and random phases unless it holds noise.
   subroutine give_amplitudes(self, first, j, modes)
      class(rough_modes_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number along x of modes(1, :)
      integer, intent(in) :: j                     !! position along y
      complex(dp), intent(inout) :: modes(:, :)    !! [block, 1]
      real(dp) :: a(block), power, k_y
      integer :: i, last

      last = min(block, self%grid%nx/2 - first + 1)
      a = 0.0_dp
      a(:last) = amplitude(self%grid, self%term, [(first + i, i=1, last)], j + 1)
      if (.not. any(a > 0.0_dp)) then
         modes = (0.0_dp, 0.0_dp)
         return
      end if
      if (self%term%generator == 'random_phase') then
         modes(:, 1) = random_phases(self%grid, self%term%seed, first, j)
      end if
      modes(:, 1) = a*modes(:, 1)

      k_y = wave_number(j + 1, self%grid%ny, self%grid%ly)
      do i = 1, last
         power = real(modes(i, 1))**2 + aimag(modes(i, 1))**2
         if (self%term%rms_slope > 0.0_dp) &
            power = power*(wave_number(first + i, self%grid%nx, self%grid%lx)**2 + k_y**2)
         self%sums(first + i - 1) = self%sums(first + i - 1) + power
      end do
   end subroutine give_amplitudes

   !> Random phases of a row of a block of columns: exp(i phase).
   pure function random_phases(grid, seed, first, j) result(phases)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: seed
      integer, intent(in) :: first                 !! wave number along x of the first one
      integer, intent(in) :: j                     !! position along y, from 0
      complex(dp) :: phases(block)
      integer(int64) :: key
      real(dp) :: phase
      integer :: i, row, k_x

      row = mode_number(j + 1, grid%ny)
      key = row_key(seed, row)
      do i = 1, block
         k_x = first + i - 1
         phase = 2.0_dp*pi*uniform_number(key, k_x)
         if (k_x == 0) then            ! (0, -k_y) is the conjugate of (0, k_y)
            phase = 2.0_dp*pi*uniform_number(row_key(seed, abs(row)), 0)
            if (row < 0) phase = -phase
         end if
         phases(i) = cmplx(cos(phase), sin(phase), dp)
      end do
   end function random_phases

   !> The message for a band in which no mode of the grid lies.
   pure function no_modes(term) result(message)
      type(surface_settings_type), intent(in) :: term
      character(:), allocatable :: message

      message = '&surface: wavelength_short = '//to_text(term%wavelength_short)//' m, wavelength_long = '// &
         to_text(term%wavelength_long)//' m: no mode of the grid lies in the band: '// &
         'give a longer wavelength_long, or a finer grid'
   end function no_modes

end module surface_self_affine
