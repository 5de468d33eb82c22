!> Warnings about values that do not fit together, for example because one is given in another unit: very oblong
!> cells, very steep roads, spheres smaller than the cells, loads beyond any stiffness of the solid, and phases with
!> very many steps.
module scale_warnings
   use asperity_precision, only : dp, pi
   use asperity_schedule, only : count_rows
   use case_settings, only : material_settings_type, phase_settings_type
   use regular_grid, only : grid_type
   use surface_settings, only : surface_settings_type
   use surface_shapes, only : find_shape, shape_type
   use surface_warnings, only : largest_slope
   use text_tools, only : rounded_text, to_text
   implicit none
   private

   public :: cap_warning, load_warning, oblong_warning, rows_warning, steepness_warning

   real(dp), parameter :: largest_aspect = 100.0_dp   !! of a cell: beyond it a length is often wrong
   real(dp), parameter :: least_radius = 4.0_dp       !! of a cap, cells: below it no contact on the cap is resolved
   real(dp), parameter :: largest_load = 10.0_dp      !! mean pressure over the modulus E* of the stiffest solid
   integer, parameter :: many_rows = 100000           !! of a run: above it a mistake is costly

contains

   !> A warning if the cells are so oblong that a length may be in another unit. Empty if all is well.
   pure function oblong_warning(grid) result(text)
      type(grid_type), intent(in) :: grid
      character(:), allocatable :: text
      real(dp) :: aspect

      text = ''
      if (min(grid%nx, grid%ny) == 1) return
      aspect = max(grid%dx/grid%dy, grid%dy/grid%dx)
      if (aspect <= largest_aspect) return
      text = '&grid: cells of '//rounded_text(grid%dx, 4)//' m by '//rounded_text(grid%dy, 4)// &
         ' m have sides whose ratio is '//rounded_text(aspect, 3)//': above 100 a length is often in another unit; '// &
         'check lx and ly, or choose nx and ny so that the cells are nearly square'
   end function oblong_warning

   !> A warning if the slope of a surface is far from small. Empty if all is well. Of a random surface
   !> whose height is given this is the slope of its longest waves, the least that it can be.
   pure function steepness_warning(term) result(text)
      type(surface_settings_type), intent(in) :: term  !! checked
      character(:), allocatable :: text
      type(shape_type) :: shape
      real(dp) :: slope

      text = ''
      shape = find_shape(term%shape)
      if (term%shape == 'self_affine') then
         slope = term%rms_slope
         if (term%rms_height > 0.0_dp) slope = 2.0_dp*pi*term%rms_height/term%wavelength_long
      else if (shape%shortest_wave > 0.0_dp) then
         slope = 2.0_dp*pi*abs(term%amplitude)/term%wavelength
      else
         return
      end if
      if (slope <= largest_slope) return
      text = '&surface: the slope of '''//trim(term%shape)//''' is about '//rounded_text(slope, 3)// &
         ', but the solid is linear and its surface flat, which holds for small slopes only: check the '// &
         'units of its heights and wavelengths'
   end function steepness_warning

   !> A warning if a sphere or a cylinder has a radius of few cells, so that the road is hardly more than a spike on a
   !> plane. Empty if all is well.
   pure function cap_warning(term, grid) result(text)
      type(surface_settings_type), intent(in) :: term  !! checked
      type(grid_type), intent(in) :: grid
      character(:), allocatable :: text
      real(dp) :: side

      text = ''
      side = grid%dx
      if (term%shape == 'sphere' .and. grid%ny > 1) side = max(grid%dx, grid%dy)
      if (.not. any(term%shape == ['sphere  ', 'cylinder'])) return
      if (term%radius >= least_radius*side) return
      text = '&surface: the radius of the '''//trim(term%shape)//''', '//rounded_text(term%radius, 4)// &
         ' m, is less than four cells of '//rounded_text(side, 4)//' m: the road is a spike on a plane; check the '// &
         'units, or use smaller cells'
   end function cap_warning

   !> A warning about the first phase whose mean pressure is far above the modulus E* of the solid under a sudden load.
   !> Its strain would be much larger than 1. Empty if all is well.
   pure function load_warning(phases, material, grid) result(text)
      type(phase_settings_type), intent(in) :: phases(:)  !! resolved
      type(material_settings_type), intent(in) :: material
      type(grid_type), intent(in) :: grid
      character(:), allocatable :: text
      real(dp) :: modulus, pressure
      integer :: k

      text = ''
      modulus = 2.0_dp*(material%shear_modulus + sum(material%prony_g))/(1.0_dp - material%poisson)
      do k = 1, size(phases)
         if (phases(k)%control == 'displacement') cycle
         pressure = abs(phases(k)%target)
         if (phases(k)%control == 'force') pressure = pressure/(grid%lx*grid%ly)
         if (.not. pressure > largest_load*modulus) cycle
         text = '&phase '//to_text(k)//': the mean pressure of '//rounded_text(pressure, 3)//' Pa is '// &
            rounded_text(pressure/modulus, 3)//' times the modulus E* of '//rounded_text(modulus, 3)// &
            ' Pa that the solid has under a sudden load, but the solid is linear, which holds for small strains '// &
            'only: check the units of the load and of the moduli'
         return
      end do
   end function load_warning

   !> A warning if a run has so many rows that the user should know before it starts. Empty if all is well.
   pure function rows_warning(phases) result(text)
      type(phase_settings_type), intent(in) :: phases(:)  !! resolved
      character(:), allocatable :: text
      integer :: longest

      text = ''
      if (count_rows(phases) <= many_rows) return
      longest = maxloc(phases%steps, dim=1)
      text = '&phase '//to_text(longest)//': the run has '//to_text(count_rows(phases))//' rows, of which '// &
         to_text(phases(longest)%steps)//' belong to this phase (time step: '//trim(phases(longest)%dt_reason)// &
         '): asperity check estimates how long that takes; check the units of velocity_x, velocity_y and duration, '// &
         'or give a longer dt'
   end function rows_warning

end module scale_warnings
