!> Calls from Python for roads: heights, spectra, statistics, maps. See `flat_runs` for the rules.
module flat_roads
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use asperity_checksum, only : hexadecimal
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int64
   use asperity_surface, only : new_height
   use flat_answers, only : check_memory, grid_of, report
   use height_map, only : checksum_of_map
   use regular_grid, only : grid_type
   use roughness, only : height_psd, height_statistics, radial_psd, roughness_type
   use surface_settings, only : default_surface, surface_settings_type
   use surface_warnings, only : find_warnings, warning_length
   implicit none
   private

   public :: map_checksum, surface_doubts, surface_height, surface_psd, surface_radial_psd, surface_statistics

contains

   !> Height of one term of a surface.
   subroutine surface_height(nx, ny, lx, ly, is_free, shape_name, radius, amplitude, wavelength, &
      hurst, wavelength_long, wavelength_rolloff, wavelength_short, rms_height, rms_slope, seed, &
      generator, centre_x, centre_y, height, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free              !! 1: free boundary, 0: periodic
      character(len=*), intent(in) :: shape_name
      real(c_double), intent(in) :: radius, amplitude, wavelength
      real(c_double), intent(in) :: hurst
      real(c_double), intent(in) :: wavelength_long, wavelength_rolloff, wavelength_short
      real(c_double), intent(in) :: rms_height, rms_slope
      integer(c_int), intent(in) :: seed
      character(len=*), intent(in) :: generator
      real(c_double), intent(in) :: centre_x, centre_y
      real(c_double), intent(inout) :: height(nx, ny)    !! m
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      type(surface_settings_type) :: term(1)
      real(dp), allocatable :: made(:, :)
      integer :: i, j

      grid = grid_of(nx, ny, lx, ly, is_free)
      call check_memory(grid, 4, 'the surface', error)
      if (allocated(error)) then
         call report(error, status, message)
         return
      end if
      term(1) = default_surface(grid)
      term(1)%shape = shape_name
      term(1)%radius = radius
      term(1)%amplitude = amplitude
      term(1)%wavelength = wavelength
      term(1)%hurst = hurst
      term(1)%wavelength_long = wavelength_long
      term(1)%wavelength_rolloff = wavelength_rolloff
      term(1)%wavelength_short = wavelength_short
      term(1)%rms_height = rms_height
      term(1)%rms_slope = rms_slope
      term(1)%seed = seed
      term(1)%generator = generator
      term(1)%centre_x = centre_x
      term(1)%centre_y = centre_y
      call new_height(grid, term, made, error)
      if (.not. allocated(error)) then
         do j = 1, ny
            do i = 1, nx
               height(i, j) = made(i, j)
            end do
         end do
      end if
      call report(error, status, message)
   end subroutine surface_height

   !> The warnings of a run about the wavelengths of a self-affine surface, one per line.
   subroutine surface_doubts(nx, ny, lx, ly, wavelength_long, wavelength_short, warnings, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: lx, ly
      real(c_double), intent(in) :: wavelength_long, wavelength_short
      character(len=1000), intent(out) :: warnings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      type(surface_settings_type) :: term(1)
      character(warning_length), allocatable :: found(:)
      integer :: i

      grid = grid_of(nx, ny, lx, ly, 0_c_int)
      term(1) = default_surface(grid)
      term(1)%shape = 'self_affine'
      term(1)%wavelength_long = wavelength_long
      term(1)%wavelength_short = wavelength_short
      call find_warnings(grid, term, 0.0_dp, found)
      warnings = ''
      do i = 1, size(found)
         warnings = trim(warnings)//new_line('a')//found(i)
      end do
      call report(error, status, message)
   end subroutine surface_doubts

   !> Power spectral density of all modes, in the order of an FFT.
   subroutine surface_psd(height, nx, ny, lx, ly, psd, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      real(c_double), intent(inout) :: psd(nx, ny)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error

      call check_memory(grid_of(nx, ny, lx, ly, 0_c_int), 4, 'the spectrum', error)
      if (.not. allocated(error)) &
         call height_psd(grid_of(nx, ny, lx, ly, 0_c_int), height, psd, error)
      call report(error, status, message)
   end subroutine surface_psd

   !> Radially averaged power spectral density. There is space for `most` rings, and `rings` are returned.
   subroutine surface_radial_psd(height, nx, ny, lx, ly, most, wave_numbers, psd, modes, rings, &
      status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: most
      real(c_double), intent(inout) :: wave_numbers(most), psd(most)
      integer(c_int), intent(inout) :: modes(most)
      integer(c_int), intent(out) :: rings
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      real(dp), allocatable :: ring_wave_numbers(:), ring_psd(:)
      integer, allocatable :: ring_modes(:)

      rings = 0
      call check_memory(grid_of(nx, ny, lx, ly, 0_c_int), 4, 'the spectrum', error)
      if (.not. allocated(error)) call radial_psd(grid_of(nx, ny, lx, ly, 0_c_int), height, &
         ring_wave_numbers, ring_psd, ring_modes, error)
      if (.not. allocated(error)) then
         rings = size(ring_psd)
         if (rings > most) then
            call fail(error, error_input, 'no room for the rings of the spectrum')
         else
            wave_numbers(:rings) = ring_wave_numbers
            psd(:rings) = ring_psd
            modes(:rings) = ring_modes
         end if
      end if
      call report(error, status, message)
   end subroutine surface_radial_psd

   !> Statistics in the order of `roughness_type`.
   subroutine surface_statistics(height, nx, ny, lx, ly, is_free, values, status, message)
      integer(c_int), intent(in) :: nx, ny
      real(c_double), intent(in) :: height(nx, ny)
      real(c_double), intent(in) :: lx, ly
      integer(c_int), intent(in) :: is_free              !! 1: free boundary, 0: periodic
      real(c_double), intent(out) :: values(10)
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      type(roughness_type) :: found

      call check_memory(grid_of(nx, ny, lx, ly, is_free), 4, 'the statistics', error)
      if (.not. allocated(error)) &
         call height_statistics(grid_of(nx, ny, lx, ly, is_free), height, found, error)
      values = [found%mean, found%lowest, found%highest, found%rms_height, found%skewness, &
         found%kurtosis, found%rms_slope, found%rms_slope_differences, found%rms_curvature, &
         found%nayak]
      call report(error, status, message)
   end subroutine surface_statistics

   !> Checksum of a height map, as a result names it in its attribute `height_maps`.
   subroutine map_checksum(path, dataset, nx, ny, checksum_text, status, message)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: dataset              !! blank: 'surface/height' or 'surface'
      integer(c_int), intent(in) :: nx, ny                 !! of the grid that the map is for
      character(len=16), intent(out) :: checksum_text
      integer(c_int), intent(out) :: status
      character(len=2000), intent(out) :: message
      type(error_type), allocatable :: error
      integer(int64) :: checksum

      checksum_text = ''
      call checksum_of_map(trim(path), trim(dataset), [int(nx), int(ny)], checksum, error)
      if (.not. allocated(error)) checksum_text = hexadecimal(checksum)
      call report(error, status, message)
   end subroutine map_checksum

end module flat_roads
