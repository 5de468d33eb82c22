!> Statistics and spectra of height maps.
!>
!> The power spectral density (thesis, eq. 1.5) is Phi(k) = |h_hat(k)|^2/A, where A = lx ly and
!> h_hat is the integral of h exp(-i k x), here dx dy times the discrete sum. With the mode spacings
!> dk_x = 2 pi/lx and dk_y = 2 pi/ly, the following holds exactly for every map:
!>
!>     sum of Phi dk_x dk_y/(2 pi)^2 = mean(h^2)
!>     sum of |k|^2 Phi dk_x dk_y/(2 pi)^2 = mean(|grad h|^2)
!>
!> For a profile (ny = 1) Phi(k) = |h_hat(k)|^2/lx, in m3, and sum of Phi dk_x/(2 pi) = mean(h^2).
!> Spectral quantities treat the map as periodic. If it is not, they contain the step at its edges.
!>
!> Each row is summed by one thread, and the sums of the rows are added in order, so that the
!> results do not depend on the number of threads.
module roughness
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, pi
   use real_transform, only : destroy_real_transform, new_real_transform, real_transform_type, &
      to_spectrum
   use regular_grid, only : boundary_periodic, grid_type
   use text_tools, only : to_text
   use wave_vectors, only : is_nyquist, wave_number
   implicit none
   private

   public :: height_psd, height_statistics, radial_psd, roughness_type

   !> Statistics of a height map. Moments of the height are those about its mean. Numbers that could not be computed
   !> are 0.
   type :: roughness_type
      real(dp) :: mean = 0.0_dp                    !! m
      real(dp) :: lowest = 0.0_dp                  !! m
      real(dp) :: highest = 0.0_dp                 !! m
      real(dp) :: rms_height = 0.0_dp              !! m
      real(dp) :: skewness = 0.0_dp                !! mean (h/rms)^3; 0 for a flat map
      real(dp) :: kurtosis = 0.0_dp                !! mean (h/rms)^4; 3 if Gaussian, 0 for a flat map
      real(dp) :: rms_slope = 0.0_dp               !! sqrt(mean |grad h|^2), spectral
      real(dp) :: rms_slope_differences = 0.0_dp   !! the same from forward differences
      real(dp) :: rms_curvature = 0.0_dp           !! 1/m: rms of (h_xx + h_yy)/2 (profile: h_xx)
      real(dp) :: nayak = 0.0_dp                   !! m0 m4/m2^2, see height_statistics
   end type roughness_type

contains

   !> Compute the statistics of a map.
   !>
   !> Nayak's parameter is m0 m4/m2^2. For a map, m0, m2 and m4 are the moments of a profile that is
   !> cut through an isotropic surface: m0 = <h^2>, m2 = <|grad h|^2>/2, m4 = 3/8 <(h_xx + h_yy)^2>.
   !> For ny = 1 they are the moments of the profile itself. The parameter is 0 for a flat map.
   subroutine height_statistics(grid, height, statistics, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                    !! m, shape [nx, ny]
      type(roughness_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: moments(0:2)

      call check_shape(grid, height, error)
      if (allocated(error)) return
      call height_moments(grid, height, statistics)
      statistics%rms_slope_differences = difference_slope(grid, height)
      call spectral_moments(grid, height, statistics%mean, moments, error)
      statistics%rms_slope = sqrt(moments(1))
      statistics%rms_curvature = sqrt(moments(2))
      if (grid%ny > 1) statistics%rms_curvature = 0.5_dp*sqrt(moments(2))
      statistics%nayak = 0.0_dp
      if (moments(1) > 0.0_dp) statistics%nayak = moments(0)*moments(2)/moments(1)**2
      if (grid%ny > 1) statistics%nayak = 1.5_dp*statistics%nayak
   end subroutine height_statistics

   !> The two-dimensional power spectral density of all modes, in the order of an FFT: the modes 0,
   !> 1, ... come first, then the negative ones. Mode (0, 0) is the mean of the map.
   subroutine height_psd(grid, height, psd, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                    !! m, shape [nx, ny]
      real(dp), intent(out) :: psd(:, :)                      !! m4 (m3 for ny = 1), shape [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      type(real_transform_type) :: transform
      integer :: i, j, mirror_i, mirror_j
      real(dp) :: factor

      if (.not. grid%fits(shape(psd))) then
         call fail(error, error_input, 'the spectrum does not have the shape of its grid')
         return
      end if
      call transformed(grid, height, 0.0_dp, transform, error)
      if (allocated(error)) return
      factor = psd_factor(grid)
      !$omp parallel do default(none) shared(grid, psd, transform, factor) &
      !$omp private(i, mirror_i, mirror_j)
      do j = 1, grid%ny
         mirror_j = modulo(1 - j, grid%ny) + 1
         do i = 1, grid%nx/2 + 1
            psd(i, j) = factor*power(transform%spectrum(i, j))
         end do
         do i = grid%nx/2 + 2, grid%nx
            mirror_i = grid%nx + 2 - i
            psd(i, j) = factor*power(transform%spectrum(mirror_i, mirror_j))
         end do
      end do
      call destroy_real_transform(transform)
   end subroutine height_psd

   !> The radially averaged power spectral density, without the mean.
   !>
   !> Ring b contains the modes with (b - 1/2) d <= |k| < (b + 1/2) d, where d is the larger of the
   !> two mode spacings. The rings reach out to the corners of the plane of wave numbers, and empty
   !> rings are left out. Hence sum of psd modes dk_x dk_y/(2 pi)^2 = the variance of the height.
   subroutine radial_psd(grid, height, wave_numbers, psd, modes, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                    !! m, shape [nx, ny]
      real(dp), allocatable, intent(out) :: wave_numbers(:)   !! mean |k|, rad/m, in rising order
      real(dp), allocatable, intent(out) :: psd(:)            !! mean Phi, m4 (m3 for ny = 1)
      integer, allocatable, intent(out) :: modes(:)           !! number of modes
      type(error_type), allocatable, intent(out) :: error
      type(real_transform_type) :: transform
      integer :: b, i, j, rings, weight
      real(dp) :: k, width
      real(dp), allocatable :: k_sum(:), power_sum(:)
      integer, allocatable :: counted(:)

      width = 2.0_dp*pi/grid%lx
      if (grid%ny > 1) width = max(width, 2.0_dp*pi/grid%ly)
      k = pi/grid%dx
      if (grid%ny > 1) k = hypot(k, pi/grid%dy)
      if (.not. ieee_is_finite(k) .or. .not. width > 0.0_dp) then
         call fail(error, error_input, 'roughness: the wave numbers of a map of '//to_text(grid%lx)// &
            ' m by '//to_text(grid%ly)//' m cannot be represented')
         return
      end if
      call transformed(grid, height, 0.0_dp, transform, error)
      if (allocated(error)) return

      rings = nint(k/width) + 1
      allocate (k_sum(0:rings), power_sum(0:rings), source=0.0_dp)
      allocate (counted(0:rings), source=0)
      do j = 1, grid%ny
         do i = 1, grid%nx/2 + 1
            if (i == 1 .and. j == 1) cycle
            weight = mode_weight(i, grid%nx)
            k = hypot(wave_number(i, grid%nx, grid%lx), wave_number(j, grid%ny, grid%ly))
            b = int(k/width + 0.5_dp)
            counted(b) = counted(b) + weight
            k_sum(b) = k_sum(b) + weight*k
            power_sum(b) = power_sum(b) + weight*power(transform%spectrum(i, j))
         end do
      end do

      call destroy_real_transform(transform)
      modes = pack(counted, counted > 0)
      wave_numbers = pack(k_sum, counted > 0)/modes
      psd = psd_factor(grid)*pack(power_sum, counted > 0)/modes
   end subroutine radial_psd

   !> Return an error if the map does not have the shape of its grid.
   subroutine check_shape(grid, height, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (size(height, 1) /= grid%nx .or. size(height, 2) /= grid%ny) &
         call fail(error, error_input, 'roughness: the map does not have the shape of its grid')
   end subroutine check_shape

   !> Transform a map after subtracting `mean`.
   subroutine transformed(grid, height, mean, transform, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: mean
      type(real_transform_type), intent(inout) :: transform
      type(error_type), allocatable, intent(out) :: error
      integer :: i, j

      call check_shape(grid, height, error)
      call new_real_transform(transform, grid%nx, grid%ny, error)
      if (allocated(error)) return
      !$omp parallel do default(none) shared(grid, height, mean, transform) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            transform%space(i, j) = height(i, j) - mean
         end do
      end do
      call to_spectrum(transform)
   end subroutine transformed

   !> Sums of |c|^2, |k|^2 |c|^2 and |k|^4 |c|^2 over all modes.
   subroutine spectral_moments(grid, height, mean, moments, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: mean
      real(dp), intent(out) :: moments(0:2)
      type(error_type), allocatable, intent(out) :: error
      type(real_transform_type) :: transform
      real(dp), allocatable :: row_sums(:, :)
      real(dp) :: k_squared, k_y, weighted
      integer :: i, j

      moments = 0.0_dp
      call transformed(grid, height, mean, transform, error)
      if (allocated(error)) return
      allocate (row_sums(0:2, grid%ny))
      !$omp parallel do default(none) shared(grid, transform, row_sums) &
      !$omp private(i, k_squared, k_y, weighted)
      do j = 1, grid%ny
         k_y = wave_number(j, grid%ny, grid%ly)
         row_sums(:, j) = 0.0_dp
         do i = 1, grid%nx/2 + 1
            k_squared = wave_number(i, grid%nx, grid%lx)**2 + k_y**2
            weighted = mode_weight(i, grid%nx)*power(transform%spectrum(i, j))
            row_sums(0, j) = row_sums(0, j) + weighted
            row_sums(1, j) = row_sums(1, j) + weighted*k_squared
            row_sums(2, j) = row_sums(2, j) + weighted*k_squared**2
         end do
      end do
      moments = sum(row_sums, dim=2)/(real(grid%nx, dp)*grid%ny)**2
      call destroy_real_transform(transform)
   end subroutine spectral_moments

   !> Mean, extremes, rms, skewness and kurtosis.
   subroutine height_moments(grid, height, statistics)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      type(roughness_type), intent(inout) :: statistics
      real(dp), allocatable :: row_sums(:, :)
      real(dp) :: cells, deviation, highest, lowest, mean, sums(2:4)
      integer :: i, j

      cells = real(grid%nx, dp)*grid%ny
      allocate (row_sums(4, grid%ny))
      lowest = huge(1.0_dp)
      highest = -huge(1.0_dp)

      !$omp parallel do default(none) shared(grid, height, row_sums) private(i) &
      !$omp reduction(min:lowest) reduction(max:highest)
      do j = 1, grid%ny
         row_sums(1, j) = 0.0_dp
         do i = 1, grid%nx
            row_sums(1, j) = row_sums(1, j) + height(i, j)
            lowest = min(lowest, height(i, j))
            highest = max(highest, height(i, j))
         end do
      end do

      mean = sum(row_sums(1, :))/cells
      !$omp parallel do default(none) shared(grid, height, row_sums, mean) private(i, deviation)
      do j = 1, grid%ny
         row_sums(2:4, j) = 0.0_dp
         do i = 1, grid%nx
            deviation = height(i, j) - mean
            row_sums(2, j) = row_sums(2, j) + deviation**2
            row_sums(3, j) = row_sums(3, j) + deviation**3
            row_sums(4, j) = row_sums(4, j) + deviation**4
         end do
      end do

      sums = sum(row_sums(2:4, :), dim=2)/cells
      statistics%mean = mean
      statistics%lowest = lowest
      statistics%highest = highest
      statistics%rms_height = sqrt(sums(2))
      statistics%skewness = 0.0_dp
      statistics%kurtosis = 0.0_dp
      if (highest > lowest .and. sums(2)**2 > 0.0_dp) then
         statistics%skewness = sums(3)/sums(2)/sqrt(sums(2))
         statistics%kurtosis = sums(4)/sums(2)**2
      end if
   end subroutine height_moments

   !> rms slope from forward differences. On a periodic map the last cell and the first are
   !> neighbours.
   function difference_slope(grid, height) result(slope)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      real(dp) :: slope
      real(dp), allocatable :: row_sums(:, :)
      logical :: wrapped
      integer :: i, j, next_j, x_pairs, y_pairs

      wrapped = grid%boundary == boundary_periodic
      allocate (row_sums(2, grid%ny), source=0.0_dp)
      !$omp parallel do default(none) shared(grid, height, row_sums, wrapped) private(i, next_j)
      do j = 1, grid%ny
         do i = 1, grid%nx - 1
            row_sums(1, j) = row_sums(1, j) + (height(i + 1, j) - height(i, j))**2
         end do
         if (wrapped) row_sums(1, j) = row_sums(1, j) + (height(1, j) - height(grid%nx, j))**2
         next_j = j + 1
         if (j == grid%ny) next_j = 1
         if (j == grid%ny .and. .not. wrapped) cycle
         do i = 1, grid%nx
            row_sums(2, j) = row_sums(2, j) + (height(i, next_j) - height(i, j))**2
         end do
      end do
      x_pairs = merge(grid%nx, max(grid%nx - 1, 1), wrapped)
      y_pairs = merge(grid%ny, max(grid%ny - 1, 1), wrapped)
      slope = sqrt(sum(row_sums(1, :))/grid%dx**2/(real(x_pairs, dp)*grid%ny) &
         + sum(row_sums(2, :))/grid%dy**2/(real(y_pairs, dp)*grid%nx))
   end function difference_slope

   !> The factor that turns |discrete sum|^2 into Phi.
   pure function psd_factor(grid) result(factor)
      type(grid_type), intent(in) :: grid
      real(dp) :: factor

      factor = grid%dx**2/grid%lx
      if (grid%ny > 1) factor = factor*grid%dy**2/grid%ly
   end function psd_factor

   !> Number of modes that an entry in column `i` of the half spectrum stands for: itself and, if
   !> that is another mode, the conjugate one.
   elemental function mode_weight(i, nx) result(weight)
      integer, intent(in) :: i, nx
      integer :: weight

      weight = 2
      if (i == 1 .or. is_nyquist(i, nx)) weight = 1
   end function mode_weight

   !> |c|^2
   elemental function power(c) result(p)
      complex(dp), intent(in) :: c
      real(dp) :: p

      p = real(c, dp)**2 + aimag(c)**2
   end function power

end module roughness
