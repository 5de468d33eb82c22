!> Tests of the surfaces.
module test_surface
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite, ieee_quiet_nan, ieee_value
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_checksum, only : checksum_of_checksums, checksums_of_rows
   use counter_random, only : mix, normal_number, row_key, uniform_number
   use asperity_errors, only : error_file, error_input, error_type
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : slab_rows
   use input_reference, only : kind_real, variable_entries, variable_entry_type
   use omp_lib, only : omp_get_max_threads, omp_set_num_threads
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use roughness, only : height_psd, height_statistics, roughness_type
   use asperity_surface, only : check_terms, new_height
   use scale_warnings, only : cap_warning, oblong_warning, steepness_warning
   use surface_warnings, only : find_warnings, warning_length
   use surface_settings, only : default_surface, real_variable, surface_settings_type
   use surface_shapes, only : all_shapes, shape_type
   implicit none
   private

   public :: run_surface

contains

   subroutine run_surface()
      call begin_suite('surface')
      if (selected('generator_is_splitmix64')) call generator_is_splitmix64()
      if (selected('sphere_paraboloid_and_cylinder')) call sphere_paraboloid_and_cylinder()
      if (selected('sine_and_hexagonal_wave')) call sine_and_hexagonal_wave()
      if (selected('terms_add_up')) call terms_add_up()
      if (selected('spectrum_mode_by_mode')) call spectrum_mode_by_mode()
      if (selected('rms_height_and_slope_are_exact')) call rms_height_and_slope_are_exact()
      if (selected('finer_grid_holds_the_same_surface')) call finer_grid_holds_the_same_surface()
      if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads()
      if (selected('filtered_noise_is_gaussian')) call filtered_noise_is_gaussian()
      if (selected('wrong_numbers_are_named')) call wrong_numbers_are_named()
      if (selected('every_shape_can_be_checked_and_listed')) &
         call every_shape_can_be_checked_and_listed()
      if (selected('height_maps_from_files')) call height_maps_from_files()
      if (selected('long_maps_are_read_in_slabs')) call long_maps_are_read_in_slabs()
      if (selected('warnings_name_what_is_doubtful')) call warnings_name_what_is_doubtful()
      if (selected('map_that_contradicts_the_case')) call map_that_contradicts_the_case()
      if (selected('steep_maps_are_reported')) call steep_maps_are_reported()
      if (selected('lengths_that_do_not_fit_together')) call lengths_that_do_not_fit_together()
   end subroutine run_surface

   !> The generator is SplitMix64: the first outputs from state 0 and 1234567 are known.
   subroutine generator_is_splitmix64()
      real(dp) :: mean, variance, x
      integer :: i, n

      call check_that(mix(0_int64) == ior(shiftl(int(z'E220A839', int64), 32), &
         int(z'7B1DCDAF', int64)), 'SplitMix64 from 0')
      call check_that(mix(1234567_int64) == 6457827717110365317_int64, 'SplitMix64 from 1234567')
      n = 100000
      mean = 0.0_dp
      variance = 0.0_dp
      do i = 1, n
         x = normal_number(row_key(3, -7), i)
         mean = mean + x/n
         variance = variance + x**2/n
      end do
      call check_close(mean, 0.0_dp, 5.0_dp/sqrt(real(n, dp)), 'normal numbers: mean')
      call check_close(variance, 1.0_dp, 5.0_dp*sqrt(2.0_dp/n), 'normal numbers: variance')
      mean = 0.0_dp
      do i = 1, n
         mean = mean + uniform_number(row_key(i, 5), 2)/n
      end do
      call check_close(mean, 0.5_dp, 5.0_dp/sqrt(12.0_dp*n), 'uniform numbers over seeds: mean')
   end subroutine generator_is_splitmix64

   !> Sphere, paraboloid, cylinder: values, summit on a cell, beyond the radius, images.
   subroutine sphere_paraboloid_and_cylinder()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), moved(:, :)

      grid = new_grid(9, 6, 9.0_dp, 3.0_dp, boundary_free)
      term = default_surface(grid)
      term%shape = 'sphere'
      term%radius = 2.0_dp
      call new_height(grid, [term], h, error)
      call check_no_error(error, 'sphere')
      call check_close(h(5, 4), 0.0_dp, 0.0_dp, 'summit of the sphere')
      call check_close(h(6, 2), sqrt(4.0_dp - 2.0_dp) - 2.0_dp, 1.0e-15_dp, 'sphere at (1, -1)')
      call check_close(h(1, 1), -2.0_dp, 0.0_dp, 'the height beyond the radius is that of the centre')
      term%shape = 'cylinder'
      call new_height(grid, [term], h, error)
      call check_close(h(6, 1), sqrt(3.0_dp) - 2.0_dp, 1.0e-15_dp, 'cylinder at x = 1')
      call check_close(h(3, 6), -2.0_dp, 0.0_dp, 'cylinder at its radius')
      term%shape = 'paraboloid'
      call new_height(grid, [term], h, error)
      call check_close(h(9, 1), -(16.0_dp + 2.25_dp)/4.0_dp, 1.0e-15_dp, 'paraboloid')
      ! A shallow cap keeps its significant digits.
      term%shape = 'sphere'
      term%radius = 1.0e9_dp
      call new_height(grid, [term], h, error)
      call check_close(h(6, 4), -0.5e-9_dp, 1.0e-24_dp, 'a shallow cap')
      ! Moving the centre by whole cells moves the periodic map.
      grid%boundary = boundary_periodic
      term%radius = 3.0_dp
      call new_height(grid, [term], h, error)
      term%centre_x = term%centre_x + 3*grid%dx
      term%centre_y = term%centre_y - 2*grid%dy
      call new_height(grid, [term], moved, error)
      call check_close(maxval(abs(moved - cshift(cshift(h, -3, 1), 2, 2))), 0.0_dp, 1.0e-14_dp, &
         'a periodic sphere off the centre is the shifted sphere')
      ! A line contact does not depend on y.
      grid = new_grid(8, 1, 8.0_dp, 5.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'sphere'
      term%radius = 10.0_dp
      term%centre_y = 3.0_dp
      call new_height(grid, [term], h, error)
      call check_close(h(5, 1), 0.0_dp, 0.0_dp, 'summit of a line contact')
   end subroutine sphere_paraboloid_and_cylinder

   !> The sine, and the period of the hexagonal wave: lambda by lambda/sqrt(3).
   subroutine sine_and_hexagonal_wave()
      type(grid_type) :: grid, larger
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), more(:, :)
      real(dp) :: k, x, y
      integer :: i, j

      grid = new_grid(10, 3, 5.0_dp, 1.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'sine'
      term%amplitude = 0.2_dp
      term%wavelength = 2.5_dp
      call new_height(grid, [term], h, error)
      call check_no_error(error, 'sine')
      call check_close(h(6, 2), 0.2_dp, 0.0_dp, 'summit of the sine')
      call check_close(h(7, 3), 0.2_dp*cos(2.0_dp*pi*0.2_dp), 1.0e-15_dp, 'sine')

      term%shape = 'hexagonal_wave'
      term%amplitude = 0.3_dp
      term%wavelength = 2.0_dp
      grid = new_grid(24, 14, 2.0_dp, 2.0_dp/sqrt(3.0_dp), boundary_periodic)
      larger = new_grid(48, 42, 4.0_dp, 6.0_dp/sqrt(3.0_dp), boundary_periodic)
      term%centre_x = 0.0_dp
      term%centre_y = 0.0_dp
      call new_height(grid, [term], h, error)
      call new_height(larger, [term], more, error)
      call check_close(maxval(abs(more(25:, 15:28) - h)), 0.0_dp, 1.0e-14_dp, &
         'the hexagonal wave repeats after lambda by lambda/sqrt(3)')
      call check_close(maxval(abs(more(25:, 29:) - h)), 0.0_dp, 1.0e-14_dp, &
         'the hexagonal wave repeats after lambda by 2 lambda/sqrt(3)')
      ! The product of sines is a sum of three waves with the wave number 2 k, at angles of 120 degrees.
      k = 2.0_dp*pi/term%wavelength
      i = 5
      j = 4
      x = 4*grid%dx
      y = 3*grid%dy
      call check_close(h(i, j), 0.075_dp*(sin(2.0_dp*k*x) &
         - sin(k*(x + sqrt(3.0_dp)*y)) - sin(k*(x - sqrt(3.0_dp)*y))), 1.0e-15_dp, 'hexagonal wave')
      call check_close(maxval(more), 0.3_dp*0.75_dp**1.5_dp, 1.0e-3_dp, 'highest value of the hexagonal wave')
   end subroutine sine_and_hexagonal_wave

   !> The terms of a surface add up.
   subroutine terms_add_up()
      type(grid_type) :: grid
      type(surface_settings_type) :: terms(3)
      type(error_type), allocatable :: error
      real(dp), allocatable :: both(:, :), h(:, :), one(:, :)

      grid = new_grid(12, 15, 1.0_dp, 2.0_dp, boundary_periodic)
      terms = default_surface(grid)
      terms(1)%shape = 'paraboloid'
      terms(1)%radius = 4.0_dp
      terms(3)%shape = 'self_affine'
      terms(3)%wavelength_long = 1.0_dp
      terms(3)%wavelength_rolloff = 0.5_dp
      terms(3)%wavelength_short = 0.3_dp
      terms(3)%rms_height = 0.1_dp
      call new_height(grid, terms, both, error)
      call check_no_error(error, 'three terms')
      call new_height(grid, terms(1:1), one, error)
      call new_height(grid, terms(3:3), h, error)
      call check_close(maxval(abs(both - one - h)), 0.0_dp, 1.0e-15_dp, 'heights add up')
      call new_height(grid, terms(2:2), h, error)
      call check_close(maxval(abs(h)), 0.0_dp, 0.0_dp, 'flat')
      call new_height(grid, terms(1:0), h, error)
      call check_that(size(h, 1) == 12 .and. size(h, 2) == 15, 'no term: a flat map')
   end subroutine terms_add_up

   !> The spectrum of a random_phase surface is eq. 1.6, mode by mode, for a surface and a profile.
   subroutine spectrum_mode_by_mode()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), psd(:, :)
      real(dp) :: k, plateau

      grid = new_grid(60, 45, 3.0_dp, 2.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'self_affine'
      term%hurst = 0.7_dp
      term%wavelength_long = 1.0_dp
      term%wavelength_rolloff = 0.5_dp
      term%wavelength_short = 0.15_dp
      term%rms_height = 1.0e-3_dp
      call new_height(grid, [term], h, error)
      call check_no_error(error, 'self-affine')
      allocate (psd(60, 45))
      call height_psd(grid, h, psd, error)
      plateau = psd(4, 1)                       ! mode (3, 0): wavelength 1
      call check_order(plateau, '>', 0.0_dp, 'the longest wave belongs to the band')
      call check_close(psd(1, 4)/plateau, 1.0_dp, 1.0e-12_dp, 'constant up to the roll-off')
      k = 2.0_dp*pi*hypot(10.0_dp/3.0_dp, 4.0_dp/2.0_dp)
      call check_close(psd(11, 42)/plateau, (k*0.25_dp/pi)**(-3.4_dp), 1.0e-12_dp, &
         'power law above the roll-off, mode (10, -4)')
      call check_close(psd(51, 5)/plateau, (k*0.25_dp/pi)**(-3.4_dp), 1.0e-12_dp, &
         'power law above the roll-off, mode (-10, 4)')
      call check_order(psd(3, 1), '<', 1.0e-25_dp*plateau, 'no waves below k_l')
      call check_order(psd(22, 1), '<', 1.0e-25_dp*plateau, 'no waves above k_s')
      call check_order(psd(21, 1), '>', 1.0e-3_dp*plateau, 'k_s itself belongs to the band')
      call check_order(psd(1, 1), '<', 1.0e-25_dp*plateau, 'the mean is zero')

      grid = new_grid(135, 1, 3.0_dp, 2.0_dp, boundary_periodic)
      call new_height(grid, [term], h, error)
      deallocate (psd)
      allocate (psd(135, 1))
      call height_psd(grid, h, psd, error)
      call check_close(psd(4, 1)/psd(7, 1), 1.0_dp, 1.0e-12_dp, 'plateau of a profile')
      call check_close(psd(13, 1)/psd(7, 1), 2.0_dp**(-2.4_dp), 1.0e-12_dp, 'exponent -(1 + 2 H) of a profile')
   end subroutine spectrum_mode_by_mode

   !> rms height and rms slope are exact with both generators, for odd and even numbers of cells, and for profiles.
   subroutine rms_height_and_slope_are_exact()
      integer, parameter :: sizes(2, 4) = reshape([64, 48, 45, 33, 50, 1, 31, 32], [2, 4])
      character(16), parameter :: generators(2) = [character(16) :: 'random_phase', 'filtered_noise']
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(roughness_type) :: statistics
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :)
      integer :: g, n

      do n = 1, size(sizes, 2)
         grid = new_grid(sizes(1, n), sizes(2, n), 1.5e-3_dp, 1.0e-3_dp, boundary_periodic)
         do g = 1, 2
            term = default_surface(grid)
            term%shape = 'self_affine'
            term%generator = generators(g)
            term%seed = n
            term%wavelength_long = 0.8e-3_dp
            term%wavelength_rolloff = 0.8e-3_dp
            term%wavelength_short = 1.0e-6_dp        ! far below a cell: all waves below Nyquist
            term%rms_height = 2.0e-6_dp
            call new_height(grid, [term], h, error)
            call check_no_error(error, generators(g))
            call height_statistics(grid, h, statistics, error)
            call check_close(statistics%rms_height, 2.0e-6_dp, 1.0e-18_dp, 'rms height')
            term%rms_height = 0.0_dp
            term%rms_slope = 0.3_dp
            call new_height(grid, [term], h, error)
            call height_statistics(grid, h, statistics, error)
            call check_close(statistics%rms_slope, 0.3_dp, 1.0e-13_dp, 'rms slope')
         end do
      end do
   end subroutine rms_height_and_slope_are_exact

   !> A finer grid contains the same surface; another seed gives another one.
   subroutine finer_grid_holds_the_same_surface()
      type(grid_type) :: fine, grid
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), refined(:, :)

      grid = new_grid(30, 21, 3.0_dp, 1.0_dp, boundary_periodic)
      fine = new_grid(90, 63, 3.0_dp, 1.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'self_affine'
      term%wavelength_long = 1.5_dp
      term%wavelength_rolloff = 1.0_dp
      term%wavelength_short = 0.21_dp
      term%rms_height = 1.0_dp
      call new_height(grid, [term], h, error)
      call new_height(fine, [term], refined, error)
      call check_close(maxval(abs(refined(::3, ::3) - h)), 0.0_dp, 1.0e-13_dp, &
         'a finer grid holds the same surface')
      term%seed = 2
      call new_height(grid, [term], refined, error)
      call check_order(maxval(abs(refined - h)), '>', 0.5_dp, 'another seed gives another surface')
   end subroutine finer_grid_holds_the_same_surface

   !> The surface has the same bits with any number of threads.
   subroutine same_bits_on_two_threads()
      character(16), parameter :: generators(2) = [character(16) :: 'random_phase', 'filtered_noise']
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), other(:, :)
      integer :: g, threads

      threads = omp_get_max_threads()
      grid = new_grid(77, 50, 1.0_dp, 1.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'self_affine'
      term%wavelength_long = 0.5_dp
      term%wavelength_rolloff = 0.5_dp
      term%wavelength_short = 0.05_dp
      term%rms_slope = 0.1_dp
      do g = 1, 2
         term%generator = generators(g)
         call omp_set_num_threads(1)
         call new_height(grid, [term], h, error)
         call omp_set_num_threads(2)
         call new_height(grid, [term], other, error)
         call check_close(maxval(abs(h - other)), 0.0_dp, 0.0_dp, &
            trim(generators(g))//' on one and two threads')
      end do
      call omp_set_num_threads(threads)
   end subroutine same_bits_on_two_threads

   !> Filtered noise is Gaussian: skewness 0 and kurtosis 3, within the scatter for its number of waves.
   subroutine filtered_noise_is_gaussian()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(roughness_type) :: statistics
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :)

      grid = new_grid(256, 200, 1.0_dp, 1.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'self_affine'
      term%generator = 'filtered_noise'
      term%wavelength_long = 1.0_dp/16.0_dp
      term%wavelength_rolloff = 1.0_dp/32.0_dp
      term%wavelength_short = 1.0_dp/64.0_dp
      term%rms_height = 1.0_dp
      call new_height(grid, [term], h, error)
      call height_statistics(grid, h, statistics, error)
      call check_close(statistics%skewness, 0.0_dp, 0.15_dp, 'skewness')
      call check_close(statistics%kurtosis, 3.0_dp, 0.3_dp, 'kurtosis')
   end subroutine filtered_noise_is_gaussian

   !> Each variable in the table of shapes is a variable of `&surface` in the reference, and one that
   !> is real can be read by its name. The variables that a shape needs belong to it.
   subroutine every_shape_can_be_checked_and_listed()
      type(surface_settings_type) :: term
      type(shape_type), allocatable :: shapes(:)
      type(variable_entry_type), allocatable :: entries(:)
      character(:), allocatable :: name, label
      integer :: i, n, row
      logical :: known

      allocate (shapes, source=all_shapes())
      allocate (entries, source=variable_entries())
      term = default_surface(new_grid(16, 16, 1.0_dp, 1.0_dp, boundary_periodic))
      do n = 1, size(shapes)
         do i = 1, size(shapes(n)%variables)
            name = trim(shapes(n)%variables(i))
            if (name == '') exit
            label = trim(shapes(n)%name)//': '//name
            known = .false.
            do row = 1, size(entries)
               if (entries(row)%group /= 'surface' .or. entries(row)%name /= name) cycle
               known = .true.
               if (entries(row)%kind == kind_real) &
                  call check_that(ieee_is_finite(real_variable(term, name)), label//' can be read')
            end do
            call check_that(known, label//' is in the reference of the input')
         end do
         do i = 1, size(shapes(n)%required)
            if (shapes(n)%required(i) == '') exit
            call check_that(any(shapes(n)%variables == shapes(n)%required(i)), &
               trim(shapes(n)%name)//' needs only variables that belong to it')
         end do
      end do
   end subroutine every_shape_can_be_checked_and_listed

   !> Wrong numbers are named, all of them in one message.
   subroutine wrong_numbers_are_named()
      type(grid_type) :: grid
      type(surface_settings_type) :: terms(2)
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :)

      grid = new_grid(16, 16, 1.0_dp, 1.0_dp, boundary_periodic)
      terms = default_surface(grid)
      terms(1)%shape = 'sphere'
      terms(2)%shape = 'pyramid'
      call check_terms(terms, error)
      call check_error(error, 'radius', 'no radius')
      call check_error(error, '''hexagonal_wave''', 'unknown shape')
      terms(2) = default_surface(grid)
      terms(2)%shape = 'self_affine'
      terms(2)%hurst = 1.5_dp
      terms(2)%wavelength_short = 0.2_dp
      terms(2)%wavelength_rolloff = 0.1_dp
      terms(2)%wavelength_long = 0.05_dp
      terms(2)%rms_height = 1.0_dp
      terms(2)%rms_slope = 1.0_dp
      terms(2)%generator = 'dice'
      call check_terms(terms(2:2), error)
      call check_error(error, 'hurst', 'hurst')
      call check_error(error, 'wavelength_long', 'order of the wavelengths')
      call check_error(error, 'at least wavelength_short', 'order of the short wavelengths')
      call check_error(error, 'give one of them', 'rms_height and rms_slope given together')
      call check_error(error, 'dice', 'generator')
      terms(2)%rms_slope = 0.0_dp
      terms(2)%hurst = 0.5_dp
      terms(2)%generator = 'random_phase'
      terms(2)%wavelength_short = 0.001_dp
      terms(2)%wavelength_rolloff = 0.01_dp
      terms(2)%wavelength_long = 0.01_dp
      call new_height(grid, terms(2:2), h, error)
      call check_error(error, 'no mode', 'an empty band')
   end subroutine wrong_numbers_are_named

   !> Height maps from files: values, scale, orientation, names of datasets, and all kinds of faults.
   subroutine height_maps_from_files()
      character(*), parameter :: path = 'build/test_surface.h5'
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), map(:, :)
      integer :: i, j, unit

      grid = new_grid(5, 3, 1.0_dp, 1.0_dp, boundary_periodic)
      allocate (map(5, 3))
      do j = 1, 3
         do i = 1, 5
            map(i, j) = 10*i + j
         end do
      end do
      call file%open(path, 'create', error)
      call check_no_error(error, 'a file')
      call file%write('surface', map, 'm', 'height', error)
      call file%write('other', 2.0_dp*map(:4, :), 'm', 'height', error)
      map(2, 3) = ieee_value(0.0_dp, ieee_quiet_nan)
      call file%write('holes', map, 'm', 'height', error)
      call file%close(error)
      call check_no_error(error, 'a file with three maps')
      term = default_surface(grid)
      term%shape = 'file'
      term%file = path
      term%scale = -0.5_dp
      call new_height(grid, [term, term], h, error)
      call check_no_error(error, 'a map from ''surface''')
      call check_close(h(4, 2), -42.0_dp, 0.0_dp, 'x varies fastest, the map is scaled, and two maps add up')
      call check_close(h(5, 1), -51.0_dp, 0.0_dp, 'the last cell along x')
      term%dataset = 'other'
      call new_height(grid, [term], h, error)
      call check_error(error, '(3, 4): must be (ny, nx) = (3, 5)', 'wrong shape')
      call check_that(error%status == error_input, 'a wrong shape is wrong input')
      term%dataset = 'holes'
      call new_height(grid, [term], h, error)
      call check_error(error, 'a value that is not finite (NaN or infinite) at [2, 1] (row, column; from 0)', &
         'NaN in a map')
      call check_that(error%status == error_input, 'NaN is wrong input')
      term%dataset = 'nothing'
      call new_height(grid, [term], h, error)
      call check_error(error, 'nothing', 'a missing dataset')
      call check_that(error%status == error_file, 'a missing dataset is a file that cannot be read')
      ! 'surface/height' comes before 'surface'
      call file%open(path, 'create', error)
      call file%create_group('surface', error)
      call check_no_error(error, 'a group')
      map(2, 3) = 0.0_dp
      call file%write('surface/height', map, 'm', 'height', error)
      call check_no_error(error, 'a map in it')
      call file%close(error)
      term%dataset = ''
      term%scale = 1.0_dp
      call new_height(grid, [term], h, error)
      call check_no_error(error, 'a map from ''surface/height''')
      call check_close(maxval(abs(h - map)), 0.0_dp, 0.0_dp, 'the map from ''surface/height''')
      term%file = 'build/no_such_file.h5'
      call new_height(grid, [term], h, error)
      call check_error(error, '&surface: file = ''build/no_such_file.h5'': there is no such file', &
         'a missing file')
      term%place = 'wet road.nml: &surface'
      term%line = 7
      call new_height(grid, [term], h, error)
      call check_that(error%message == 'wet road.nml: &surface: file = ''build/no_such_file.h5'':'// &
         ' there is no such file (line 7)', 'the message about a missing file gives its place in the input')
      call check_that(error%status == error_file, 'a missing file: status')
      open (newunit=unit, file=path, status='replace', action='write')
      write (unit, '(a)') 'not HDF5'
      close (unit)
      term%file = path
      call new_height(grid, [term], h, error)
      call check_error(error, path, 'not HDF5')
      call check_that(error%status == error_file, 'not HDF5: status')
      term%file = ''
      call new_height(grid, [term], h, error)
      call check_error(error, 'file is missing', 'no file named')
      open (newunit=unit, file=path, status='old')
      close (unit, status='delete')
   end subroutine height_maps_from_files

   !> A map that is read in several slabs, the last of which is smaller, has the right values and checksum.
   subroutine long_maps_are_read_in_slabs()
      character(*), parameter :: path = 'build/test_surface.h5'
      integer, parameter :: nx = 30000, ny = 11
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), map(:, :)
      integer(int64), allocatable :: checksums(:)
      integer :: i, j, unit

      grid = new_grid(nx, ny, 1.0_dp, 1.0_dp, boundary_periodic)
      call check_that(slab_rows(nx) == 4, 'three slabs')
      allocate (map(nx, ny))
      do j = 1, ny
         do i = 1, nx
            map(i, j) = sin(0.1_dp*i)*j
         end do
      end do
      call file%open(path, 'create', error)
      call file%write('surface', map, 'm', 'height', error, compression=1)
      call file%close(error)
      call check_no_error(error, 'a long map')
      term = default_surface(grid)
      term%shape = 'file'
      term%file = path
      call new_height(grid, [term, default_surface(grid)], h, error, checksums)
      call check_no_error(error, 'reading a long map')
      call check_close(maxval(abs(h - map)), 0.0_dp, 0.0_dp, 'values of a long map')
      call check_that(checksums(1) == checksum_of_checksums(size(map, 1), checksums_of_rows(map)), 'checksum of a long map')
      call check_that(checksums(2) == 0, 'a flat term has no checksum')
      open (newunit=unit, file=path, status='old')
      close (unit, status='delete')
   end subroutine long_maps_are_read_in_slabs

   !> Warnings name what is doubtful; roads without doubts cause none.
   subroutine warnings_name_what_is_doubtful()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      character(warning_length), allocatable :: warnings(:)

      grid = new_grid(128, 64, 2.0_dp, 2.0_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'self_affine'
      term%wavelength_long = 0.5_dp
      term%wavelength_rolloff = 0.5_dp
      term%wavelength_short = 0.25_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'eight cells per wave and four waves per side: no warning')
      term%wavelength_short = 0.2_dp
      term%wavelength_long = 2.0_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 2, 'two warnings')
      call check_order(index(warnings(1), 'wavelength_long = 2 m'), '>', 0, &
         'waves as long as the side')
      call check_order(index(warnings(2), '6.4 cells'), '>', 0, 'few cells per wave')
      term%wavelength_long = 0.5_dp
      term%wavelength_short = 0.05_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 1, 'one warning')
      call check_order(index(warnings(1), 'Nyquist'), '>', 0, 'below the Nyquist wavelength')

      term = default_surface(grid)
      term%shape = 'sine'
      term%wavelength = 0.5_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'four waves: no warning')
      term%wavelength = 0.6_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 1 .and. index(warnings(1), '3.3333') > 0, 'a broken wave')
      grid%boundary = boundary_free
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'a free map may contain a part of a wave')

      grid = new_grid(128, 74, 2.0_dp, 2.0_dp/sqrt(3.0_dp), boundary_periodic)
      term%shape = 'hexagonal_wave'
      term%wavelength = 1.0_dp
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'a hexagonal wave in a cell of its period: no warning')
      grid = new_grid(128, 128, 2.0_dp, 2.0_dp, boundary_periodic)
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 1 .and. index(warnings(1), 'ly') > 0, &
         'a hexagonal wave on a square')
   end subroutine warnings_name_what_is_doubtful

   !> A map whose file gives another size, unit or boundary than the case causes warnings.
   subroutine map_that_contradicts_the_case()
      character(*), parameter :: path = 'build/told_map.h5'
      type(grid_type) :: grid
      type(hdf5_file_type) :: file
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      character(warning_length), allocatable :: warnings(:)
      real(dp) :: map(5, 3)
      integer :: unit

      map = 0.0_dp
      grid = new_grid(5, 3, 0.5_dp, 0.6_dp, boundary_periodic)
      term = default_surface(grid)
      term%shape = 'file'
      term%file = path
      call file%open(path, 'create', error)
      call file%create_group('surface', error)
      call file%write('surface/height', map, 'um', 'height', error)
      call file%write_attribute('surface/height', 'lx', 0.25_dp, error)
      call file%create_group('grid', error)
      call file%write_attribute('/grid', 'ly', 0.6_dp*(1.0_dp + 1.0e-9_dp), error)
      call file%write_attribute('/grid', 'boundary', 'free', error)
      call check_no_error(error, 'a map with attributes')
      call file%close(error)
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 3, 'there are warnings of size, unit and edges')
      call check_that(index(warnings(1), '&surface: file = ''told_map.h5'': according to the file '// &
         'the map is 0.25 m by 0.6 m, but the grid is 0.5 m by') == 1, 'another length')
      call check_order(index(warnings(2), 'the unit of the map is um (attribute units'), '>', 0, 'another unit')
      call check_order(index(warnings(3), 'not periodic'), '>', 0, 'edges that do not fit')
      call map_in_another_dataset(grid, term)
      term%scale = 1.0e-6_dp
      grid = new_grid(5, 3, 0.25_dp, 0.6_dp, boundary_free)
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'the same size, a scale, a free boundary: no warning')
      open (newunit=unit, file=path, status='old')
      close (unit, status='delete')
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'a missing file is an error elsewhere')
   end subroutine map_that_contradicts_the_case

   !> The unit is also read from the second dataset that is looked for, 'surface', and from one that the case names.
   subroutine map_in_another_dataset(grid, term)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(*), parameter :: path = 'build/plain_map.h5'
      type(hdf5_file_type) :: file
      type(surface_settings_type) :: other
      type(error_type), allocatable :: error
      character(warning_length), allocatable :: warnings(:)
      integer :: unit

      call file%open(path, 'create', error)
      call file%write('surface', reshape(spread(0.0_dp, 1, 15), [5, 3]), 'nm', 'height', error)
      call file%write('level', reshape(spread(0.0_dp, 1, 15), [5, 3]), 'mm', 'height', error)
      call check_no_error(error, 'a map beside the usual place')
      call file%close(error)
      other = term
      other%file = path
      call find_warnings(grid, [other], 0.0_dp, warnings)
      call check_that(size(warnings) == 1, 'one warning about the dataset ''surface''')
      call check_order(index(warnings(1), 'the unit of the map is nm'), '>', 0, 'unit of ''surface''')
      other%dataset = 'level'
      call find_warnings(grid, [other], 0.0_dp, warnings)
      call check_that(size(warnings) == 1, 'one warning about a dataset that is named')
      call check_order(index(warnings(1), 'the unit of the map is mm'), '>', 0, 'unit of the dataset that is named')
      open (newunit=unit, file=path, status='old')
      close (unit, status='delete')
   end subroutine map_in_another_dataset

   !> The slope of a map from a file is estimated, also from a part of the rows of a long map.
   subroutine steep_maps_are_reported()
      character(*), parameter :: path = 'build/steep_map.h5'
      type(grid_type) :: grid
      type(hdf5_file_type) :: file
      type(surface_settings_type) :: term
      type(error_type), allocatable :: error
      character(warning_length), allocatable :: warnings(:)
      real(dp), allocatable :: map(:, :)
      integer :: i, j, unit

      do j = 0, 1
         ! Slopes of 3 along x and of 4 along y, on a map of few and on one of very many rows.
         grid = new_grid(4, merge(6, 3000000, j == 0), 2.0_dp, merge(3.0_dp, 1.5e6_dp, j == 0), boundary_free)
         allocate (map(grid%nx, grid%ny))
         do i = 1, grid%ny
            map(:, i) = 1.5_dp*[1, 2, 3, 4] + 2.0_dp*i
         end do
         term = default_surface(grid)
         term%shape = 'file'
         term%file = path
         call file%open(path, 'create', error)
         call file%write('surface', map, 'm', 'height', error)
         call check_no_error(error, 'a steep map')
         call file%close(error)
         deallocate (map)
         call find_warnings(grid, [term], 0.0_dp, warnings)
         call check_that(size(warnings) == 1, 'a steep map causes a warning')
         call check_order(index(warnings(1), 'the slope of the map is about 5, but'), '>', 0, trim(warnings(1)))
         term%scale = -0.59_dp
         call find_warnings(grid, [term], 0.0_dp, warnings)
         call check_that(size(warnings) == 0, 'a slope of 2.95 after scaling: no warning')
         call find_warnings(grid, [term], 0.13_dp, warnings)
         call check_that(size(warnings) == 0, 'friction does not wedge at 0.13 times 2.95')
         call find_warnings(grid, [term], 0.2_dp, warnings)
         call check_that(size(warnings) == 1, 'friction may wedge at 0.2 times 2.95')
         call check_order(index(warnings(1), 'of about 2.95 times the coefficient is 0.59'), '>', 0, trim(warnings(1)))
      end do
      grid = new_grid(6, 4, 2.0_dp, 3.0_dp, boundary_free)
      call find_warnings(grid, [term], 0.0_dp, warnings)
      call check_that(size(warnings) == 0, 'a map of another shape is an error elsewhere')
      open (newunit=unit, file=path, status='old')
      close (unit, status='delete')
   end subroutine steep_maps_are_reported

   !> Very oblong cells and very steep waves cause warnings, because a length may be in another unit.
   subroutine lengths_that_do_not_fit_together()
      type(grid_type) :: grid
      type(surface_settings_type) :: term
      character(:), allocatable :: text

      grid = new_grid(20, 30, 2e-3_dp, 2e-3_dp*1.5_dp*99.0_dp, boundary_periodic)
      call check_that(oblong_warning(grid) == '', 'cells 99 times as long as wide: no warning')
      grid = new_grid(20, 30, 2e-3_dp*150.0_dp, 3e-3_dp, boundary_free)
      text = oblong_warning(grid)
      call check_that(index(text, 'cells of 0.015 m by 1e-4 m') > 0 .and. &
         index(text, 'ratio is 150:') > 0, 'cells 150 times as long as wide: '//text)
      grid = new_grid(20, 1, 2e-3_dp, 1.0_dp, boundary_periodic)
      call check_that(oblong_warning(grid) == '', 'a line has no width')

      term = default_surface(grid)
      term%shape = 'sine'
      term%wavelength = 1e-3_dp
      term%amplitude = 4e-4_dp
      call check_that(steepness_warning(term) == '', 'a steep wave, without a warning')
      term%amplitude = -4e-1_dp
      text = steepness_warning(term)
      call check_that(index(text, 'about 2510,') > 0, 'an amplitude in another unit: '//text)
      term%shape = 'self_affine'
      term%wavelength_long = 1e-3_dp
      term%rms_height = 1.0_dp
      text = steepness_warning(term)
      call check_that(index(text, 'about 6280,') > 0, 'an rms height in another unit: '//text)
      term%rms_height = 0.0_dp
      term%rms_slope = 2.9_dp
      call check_that(steepness_warning(term) == '', 'a steep road, without a warning')
      term%shape = 'sphere'
      call check_that(steepness_warning(term) == '', 'a sphere has no waves')

      grid = new_grid(20, 30, 2e-3_dp, 6e-3_dp, boundary_periodic)
      term%radius = 8.1e-4_dp
      call check_that(cap_warning(term, grid) == '', 'a sphere of a little more than four cells')
      term%radius = 7.9e-4_dp
      text = cap_warning(term, grid)
      call check_that(index(text, 'the radius of the ''sphere'', 7.9e-4 m, is less than four cells of 2e-4 m') > 0, &
         'a sphere of less than four cells: '//text)
      term%shape = 'cylinder'
      call check_that(cap_warning(term, grid) == '', 'a cylinder lies along y')
   end subroutine lengths_that_do_not_fit_together

end module test_surface
