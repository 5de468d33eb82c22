!> The checked settings of one `&surface` group: one term of the sum of heights.
module surface_settings
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   implicit none
   private

   public :: default_surface, real_variable, surface_settings_type

   integer, parameter, public :: word_length = 32       !! longest word among several choices
   integer, parameter, public :: path_length = 1024     !! longest path of a file

   !> `&surface`: one term of the sum of heights.
   type :: surface_settings_type
      character(word_length) :: shape               !! 'flat' | 'sphere' | 'paraboloid' | ...
      real(dp) :: radius                            !! m
      real(dp) :: amplitude                         !! m
      real(dp) :: wavelength                        !! m
      real(dp) :: hurst                             !! 0 < H <= 1
      real(dp) :: wavelength_long                   !! largest wavelength, m
      real(dp) :: wavelength_rolloff                !! m; equals wavelength_long without roll-off
      real(dp) :: wavelength_short                  !! smallest wavelength, m
      real(dp) :: rms_height                        !! m; 0 where rms_slope is given
      real(dp) :: rms_slope                         !! 0 where rms_height is given
      integer :: seed
      character(word_length) :: generator           !! 'random_phase' | 'filtered_noise'
      character(path_length) :: file
      character(path_length) :: dataset             !! '' tries 'surface/height', then 'surface'
      real(dp) :: scale
      real(dp) :: centre_x, centre_y                !! m
      character(path_length) :: place = '&surface'  !! for messages: 'road.nml: &surface'
      integer :: line = 0                           !! of the group in the input; 0 without an input
   end type surface_settings_type

contains

   !> A flat term, centred on the grid, with its other numbers unset (0). Callers start from it and
   !> set only what their shape needs.
   pure function default_surface(grid) result(term)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type) :: term

      term%shape = 'flat'
      term%radius = 0.0_dp
      term%amplitude = 0.0_dp
      term%wavelength = 0.0_dp
      term%hurst = 0.8_dp
      term%wavelength_long = 0.0_dp
      term%wavelength_rolloff = 0.0_dp
      term%wavelength_short = 0.0_dp
      term%rms_height = 0.0_dp
      term%rms_slope = 0.0_dp
      term%seed = 1
      term%generator = 'random_phase'
      term%file = ''
      term%dataset = ''
      term%scale = 1.0_dp
      term%centre_x = (grid%nx/2)*grid%dx
      term%centre_y = (grid%ny/2)*grid%dy
   end function default_surface

   !> The value of a real variable by its name.
   pure function real_variable(term, name) result(value)
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: name            !! NaN if it is not one of those below
      real(dp) :: value

      select case (name)
      case ('radius')
         value = term%radius
      case ('amplitude')
         value = term%amplitude
      case ('wavelength')
         value = term%wavelength
      case ('hurst')
         value = term%hurst
      case ('wavelength_long')
         value = term%wavelength_long
      case ('wavelength_rolloff')
         value = term%wavelength_rolloff
      case ('wavelength_short')
         value = term%wavelength_short
      case ('rms_height')
         value = term%rms_height
      case ('rms_slope')
         value = term%rms_slope
      case ('scale')
         value = term%scale
      case ('centre_x')
         value = term%centre_x
      case ('centre_y')
         value = term%centre_y
      case default
         value = ieee_value(value, ieee_quiet_nan)
      end select
   end function real_variable

end module surface_settings
