!> Tests of the roughness measures.
module test_roughness
   use check, only : begin_suite, check_close, check_error, check_no_error, check_that, selected
   use counter_random, only : normal_number, row_key
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use roughness, only : height_psd, height_statistics, radial_psd, roughness_type
   implicit none
   private

   public :: run_roughness

contains

   subroutine run_roughness()
      call begin_suite('roughness')
      if (selected('measures_of_one_oblique_wave')) call measures_of_one_oblique_wave()
      if (selected('measures_of_a_profile')) call measures_of_a_profile()
      if (selected('parseval_counts_all_power_once')) call parseval_counts_all_power_once()
      if (selected('nayak_parameter_of_isotropic_waves')) call nayak_parameter_of_isotropic_waves()
      if (selected('free_map_has_no_differences_across_edges')) &
         call free_map_has_no_differences_across_edges()
   end subroutine run_roughness

   !> For one oblique wave every measure is known in closed form.
   subroutine measures_of_one_oblique_wave()
      type(grid_type) :: grid
      type(roughness_type) :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), psd(:, :)
      real(dp) :: k_x, k_y, slope
      integer :: i, j

      grid = new_grid(40, 27, 2.0_dp, 3.0_dp, boundary_periodic)
      allocate (h(40, 27), psd(40, 27))
      k_x = 2.0_dp*pi*3/2.0_dp
      k_y = -2.0_dp*pi*2/3.0_dp
      do j = 1, 27
         do i = 1, 40
            h(i, j) = 5.0_dp + 0.1_dp*cos(k_x*(i - 1)*grid%dx + k_y*(j - 1)*grid%dy + 0.3_dp)
         end do
      end do
      call height_statistics(grid, h, s, error)
      call check_no_error(error, 'statistics')
      call check_close(s%mean, 5.0_dp, 1.0e-14_dp, 'mean')
      call check_close(s%rms_height, 0.1_dp/sqrt(2.0_dp), 1.0e-14_dp, 'rms height')
      call check_close(s%rms_slope, 0.1_dp*hypot(k_x, k_y)/sqrt(2.0_dp), 1.0e-13_dp, 'rms slope')
      slope = 0.1_dp/sqrt(2.0_dp)*hypot(2*sin(k_x*grid%dx/2)/grid%dx, 2*sin(k_y*grid%dy/2)/grid%dy)
      call check_close(s%rms_slope_differences, slope, 1.0e-13_dp, 'rms slope by differences')
      call check_close(s%rms_curvature, 0.05_dp*(k_x**2 + k_y**2)/sqrt(2.0_dp), 1.0e-12_dp, &
         'rms curvature')
      call check_close(s%nayak, 1.5_dp, 1.0e-12_dp, 'Nayak parameter of one wave')
      call check_close(s%skewness, 0.0_dp, 1.0e-12_dp, 'skewness')
      call check_close(s%kurtosis, 1.5_dp, 1.0e-12_dp, 'kurtosis')
      call check_close(s%highest, maxval(h), 0.0_dp, 'highest')
      call check_close(s%lowest, minval(h), 0.0_dp, 'lowest')
      ! |h_hat|^2/A = (0.05 A)^2/A at (3, -2) and (-3, 2)
      call height_psd(grid, h, psd, error)
      call check_close(psd(4, 26), 0.0025_dp*6.0_dp, 1.0e-15_dp, 'psd at (3, -2)')
      call check_close(psd(38, 3), 0.0025_dp*6.0_dp, 1.0e-15_dp, 'psd at (-3, 2)')
      call check_close(psd(1, 1), 25.0_dp*6.0_dp, 1.0e-11_dp, 'psd of the mean')
      call check_close(sum(psd), 156.0_dp + 0.005_dp*6.0_dp - 6.0_dp, 1.0e-10_dp, 'no other mode')
   end subroutine measures_of_one_oblique_wave

   !> A profile.
   subroutine measures_of_a_profile()
      type(grid_type) :: grid
      type(roughness_type) :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), k(:), mean_psd(:), psd(:, :)
      integer, allocatable :: modes(:)
      real(dp) :: wave
      integer :: i

      grid = new_grid(33, 1, 2.0_dp, 7.0_dp, boundary_periodic)
      allocate (h(33, 1), psd(33, 1))
      wave = 2.0_dp*pi*4/2.0_dp
      h(:, 1) = [(0.2_dp*sin(wave*(i - 1)*grid%dx), i = 1, 33)]
      call height_statistics(grid, h, s, error)
      call check_close(s%rms_slope, 0.2_dp*wave/sqrt(2.0_dp), 1.0e-13_dp, 'rms slope')
      call check_close(s%rms_curvature, 0.2_dp*wave**2/sqrt(2.0_dp), 1.0e-12_dp, 'rms curvature')
      call check_close(s%nayak, 1.0_dp, 1.0e-12_dp, 'Nayak parameter of a sine profile')
      call height_psd(grid, h, psd, error)
      call check_close(sum(psd)/grid%lx, 0.02_dp, 1.0e-15_dp, 'sum of Phi dk/(2 pi) = mean h^2')
      call radial_psd(grid, h, k, mean_psd, modes, error)
      call check_that(size(k) == 16 .and. all(modes == 2), 'two modes a wave number')
      call check_close(k(4), wave, 1.0e-13_dp, 'wave number')
      call check_close(mean_psd(4), psd(5, 1), 1.0e-15_dp, 'psd of a profile by rings')
   end subroutine measures_of_a_profile

   !> Parseval's sum for white noise, with and without Nyquist modes: each power is counted once.
   subroutine parseval_counts_all_power_once()
      integer, parameter :: sizes(2, 4) = reshape([16, 12, 15, 12, 16, 9, 21, 15], [2, 4])
      type(grid_type) :: grid
      type(roughness_type) :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), k(:), mean_psd(:), psd(:, :)
      integer, allocatable :: modes(:)
      real(dp) :: k_squared, slope
      integer :: i, j, n, nx, ny

      do n = 1, size(sizes, 2)
         nx = sizes(1, n)
         ny = sizes(2, n)
         grid = new_grid(nx, ny, 1.5_dp, 0.7_dp, boundary_periodic)
         allocate (h(nx, ny), psd(nx, ny))
         do j = 1, ny
            do i = 1, nx
               h(i, j) = 0.4_dp + normal_number(row_key(n, j), i)
            end do
         end do
         call height_statistics(grid, h, s, error)
         call height_psd(grid, h, psd, error)
         call check_close(sum(psd)/(grid%lx*grid%ly), sum(h**2)/(nx*ny), 1.0e-13_dp, &
            'sum of Phi dk/(2 pi)^2 = mean h^2')
         slope = 0.0_dp
         do j = 1, ny
            do i = 1, nx
               k_squared = (2.0_dp*pi*min(i - 1, nx - i + 1)/grid%lx)**2 &
                  + (2.0_dp*pi*min(j - 1, ny - j + 1)/grid%ly)**2
               slope = slope + psd(i, j)*k_squared/(grid%lx*grid%ly)
            end do
         end do
         call check_close(sqrt(slope), s%rms_slope, 1.0e-11_dp, 'k^2-weighted sum = mean slope^2')
         call radial_psd(grid, h, k, mean_psd, modes, error)
         call check_that(sum(modes) == nx*ny - 1, 'every mode is in one ring')
         call check_that(all(k(2:) > k(:size(k) - 1)), 'rings are in order')
         call check_close(sum(mean_psd*modes)/(grid%lx*grid%ly), s%rms_height**2, 1.0e-13_dp, &
            'rings sum to the variance')
         deallocate (h, psd)
      end do
   end subroutine parseval_counts_all_power_once

   !> Three waves at 120 degrees are isotropic to fourth order. Nayak's parameter is 3/2 for a single |k|, and
   !> known in closed form for the moments of two such rings.
   subroutine nayak_parameter_of_isotropic_waves()
      type(grid_type) :: grid
      type(roughness_type) :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :)
      real(dp) :: a, b, k
      integer :: i, j, n

      k = 2.0_dp*pi
      grid = new_grid(36, 36, 2.0_dp, 2.0_dp/sqrt(3.0_dp), boundary_periodic)
      allocate (h(36, 36))
      do j = 1, 36
         do i = 1, 36
            h(i, j) = 0.0_dp
            do n = 0, 2
               a = cos(2.0_dp*pi*n/3.0_dp)*(i - 1)*grid%dx
               b = sin(2.0_dp*pi*n/3.0_dp)*(j - 1)*grid%dy
               h(i, j) = h(i, j) + cos(k*(a + b) + n) + 0.5_dp*cos(2.0_dp*k*(a + b) + 2*n)
            end do
         end do
      end do
      call height_statistics(grid, h, s, error)
      call check_close(s%nayak, 1.5_dp*1.25_dp*5.0_dp/4.0_dp, 1.0e-11_dp, 'two shells')
      h = 2.0_dp
      call height_statistics(grid, h, s, error)
      call check_close(s%nayak + s%kurtosis + s%rms_slope, 0.0_dp, 0.0_dp, 'a flat map')
   end subroutine nayak_parameter_of_isotropic_waves

   !> Differences on a free map do not extend across its edges. A wrong shape is refused.
   subroutine free_map_has_no_differences_across_edges()
      type(grid_type) :: grid
      type(roughness_type) :: s
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :)
      integer :: i, j

      grid = new_grid(10, 7, 5.0_dp, 1.4_dp, boundary_free)
      allocate (h(10, 7))
      do j = 1, 7
         do i = 1, 10
            h(i, j) = 0.3_dp*(i - 1)*grid%dx - 0.4_dp*(j - 1)*grid%dy
         end do
      end do
      call height_statistics(grid, h, s, error)
      call check_close(s%rms_slope_differences, 0.5_dp, 1.0e-14_dp, 'a free plane has its slope')
      call height_statistics(grid, h(:, :6), s, error)
      call check_error(error, 'shape', 'wrong shape')
   end subroutine free_map_has_no_differences_across_edges

end module test_roughness
