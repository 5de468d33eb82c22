!> Warnings about a surface that is allowed but doubtful: a random surface with wavelengths that its
!> grid does not hold (thesis, 4.1), waves that do not close on the period of the grid, waves with
!> too few cells, height maps that are very steep or whose files state another size, unit or boundary than the
!> input, and rough roads so steep that friction may wedge.
module surface_warnings
   use asperity_errors, only : error_type
   use asperity_parallel, only : is_first_process
   use hdf5_file, only : hdf5_file_type
   use hdf5_slab_reader, only : slab_reader_type
   use hdf5_slabs, only : slab_rows
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use surface_settings, only : surface_settings_type
   use surface_shapes, only : find_shape, shape_type
   use text_tools, only : in_one_line, rounded_text
   use trial_process, only : trial_type
   implicit none
   private

   public :: find_warnings

   integer, parameter, public :: warning_length = 400
   real(dp), parameter, public :: largest_slope = 3.0_dp   !! far beyond what a theory for small slopes describes
   !> Rms slope times coefficient above which friction may wedge. In trials on self-affine roads all runs succeeded up to
   !> 0.3, some of them at 0.4, and none from 0.5 on.
   real(dp), parameter :: wedging = 0.4_dp
   real(dp), parameter :: cells_per_wave = 8.0_dp      !! enough for contact areas of some percent
   real(dp), parameter :: round_off = 1.0e-9_dp
   integer, parameter :: most_slabs = 64               !! of a map, from which its slope is estimated: 64 MiB
   integer, parameter :: patience = 120                !! longest time for the trial of a map, s

contains

   !> One warning, with its numbers, for each thing that is doubtful; none if all is well.
   subroutine find_warnings(grid, terms, mu, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)      !! checked
      real(dp), intent(in) :: mu                               !! coefficient of friction on slopes; 0 without
      character(warning_length), allocatable, intent(out) :: warnings(:)
      integer :: n

      allocate (warnings(0))
      do n = 1, size(terms)
         select case (terms(n)%shape)
         case ('self_affine')
            call check_long_waves(grid, terms(n), warnings)
            call check_short_waves(grid, 'wavelength_short', terms(n)%wavelength_short, 1.0_dp, &
               .false., warnings)
            call check_wedging('&surface: ''self_affine'': ', terms(n)%rms_slope, mu, warnings)
         case ('file')
            call check_map(grid, terms(n), mu, warnings)
         case default
            call check_wave(grid, terms(n), warnings)
         end select
      end do
   end subroutine find_warnings

   !> An analytic wave must close on the period of the grid and have enough cells. Shapes without
   !> waves have nothing to check.
   subroutine check_wave(grid, term, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      type(shape_type) :: shape

      shape = find_shape(term%shape)
      if (.not. shape%shortest_wave > 0.0_dp) return
      call check_period('lx', grid%lx, shape%period_x*term%wavelength, grid, warnings)
      if (grid%ny > 1) &
         call check_period('ly', grid%ly, shape%period_y*term%wavelength, grid, warnings)
      call check_short_waves(grid, 'wavelength', term%wavelength, shape%shortest_wave, &
         .not. shape%period_y > 0.0_dp, warnings)
   end subroutine check_wave

   !> The slope of a map must be moderate, and the lengths, the unit and the boundary that its file states must agree
   !> with the input. No warning is given about a file that states none of them, or that cannot be read: reading the
   !> map itself reports that as an error. Only the first process opens files.
   subroutine check_map(grid, term, mu, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      real(dp), intent(in) :: mu                  !! coefficient of friction on slopes; 0 without
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(:), allocatable :: boundary, map, start
      character(warning_length) :: text
      real(dp) :: lx, ly

      if (.not. is_first_process()) return
      call file%open(trim(term%file), 'read', error)
      if (allocated(error)) return
      map = map_name(file, term)
      start = '&surface: file = '''//last_of(term%file)//''': '
      lx = length_of(file, map, 'lx')
      ly = length_of(file, map, 'ly')
      if (grid%ny == 1) ly = 0.0_dp
      if (differs(lx, grid%lx) .or. differs(ly, grid%ly)) then
         text = start//'according to the file the map is '//rounded_text(merge(lx, grid%lx, lx > 0.0_dp), 5)//' m by '// &
            rounded_text(merge(ly, grid%ly, ly > 0.0_dp), 5)//' m, but the grid is '//rounded_text(grid%lx, 5)// &
            ' m by '//rounded_text(grid%ly, 5)//' m: this changes its slopes'
         call append(warnings, text)
      end if
      call check_unit(file, map, start, term%scale, warnings)
      if (term%dataset == '' .and. file%has_attribute('/grid', 'boundary') .and. &
         grid%boundary == boundary_periodic .and. grid%ny > 1) then
         call file%read_attribute('/grid', 'boundary', boundary, error)
         if (.not. allocated(error)) then
            if (boundary == 'free') then
               text = start//'according to the file the map is not periodic: the periodic '// &
                  'surface has a step where opposite edges do not fit'
               call append(warnings, text)
            end if
         end if
      end if
      call file%close(error)
      call check_slope(grid, term, map, start, mu, warnings)
   end subroutine check_map

   !> The dataset with the map of a term.
   function map_name(file, term) result(map)
      type(hdf5_file_type), intent(inout) :: file
      type(surface_settings_type), intent(in) :: term
      character(:), allocatable :: map

      map = trim(term%dataset)
      if (map /= '') return
      map = 'surface/height'
      if (.not. file%has_dataset(map)) map = 'surface'
   end function map_name

   !> The unit that the file states must be the metre, unless `scale` converts the heights.
   subroutine check_unit(file, map, start, scale, warnings)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: map             !! the dataset
      character(*), intent(in) :: start           !! of the warning
      real(dp), intent(in) :: scale
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      type(error_type), allocatable :: error
      character(:), allocatable :: units
      character(warning_length) :: text

      if (abs(scale - 1.0_dp) > 0.0_dp .or. .not. file%has_attribute(map, 'units')) return
      call file%read_attribute(map, 'units', units, error)
      if (allocated(error)) return
      if (any(trim(units) == [character(5) :: 'm', '1', '', 'metre', 'meter'])) return
      text = start//'according to the file the unit of the map is '//in_one_line(trim(units), 40)// &
         ' (attribute units of its dataset), but its heights are read as metres, m: set scale to convert them'
      call append(warnings, text)
   end subroutine check_unit

   !> The heights of a map in another unit make it far too steep. Friction may wedge on a less steep one.
   subroutine check_slope(grid, term, map, start, mu, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: map             !! the dataset
      character(*), intent(in) :: start           !! of the warning
      real(dp), intent(in) :: mu                  !! coefficient of friction on slopes; 0 without
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      type(error_type), allocatable :: error
      type(trial_type) :: trial
      character(warning_length) :: text
      real(dp) :: slope

      ! HDF5 may crash or hang on a damaged file, so that a separate process reads it first.
      call trial%start(patience)
      if (trial%is_copy) then
         call estimate_slope(grid, term, map, slope)
         call trial%leave()
      end if
      call trial%verdict(trim(term%file), error)
      if (allocated(error)) return
      call estimate_slope(grid, term, map, slope)
      if (.not. slope > largest_slope) then
         call check_wedging(start, slope, mu, warnings)
         return
      end if
      text = start//'the slope of the map is about '//rounded_text(slope, 3)// &
         ', but the solid is linear and its surface flat, which holds for small slopes only: check the unit of the '// &
         'heights, which are read as metres times scale, and lx and ly'
      call append(warnings, text)
   end subroutine check_slope

   !> On slopes above 1/mu friction can hold any force uphill. If parts of the contact are so steep, rows of a slide may
   !> have no solution. The slope of a random road whose height is given is not known here, and is not checked.
   subroutine check_wedging(start, slope, mu, warnings)
      character(*), intent(in) :: start           !! of the warning
      real(dp), intent(in) :: slope               !! rms
      real(dp), intent(in) :: mu                  !! coefficient of friction on slopes; 0 without
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text

      if (.not. mu*slope > wedging) return
      text = start//'the rms slope of about '//rounded_text(slope, 3)//' times the coefficient is '// &
         rounded_text(mu*slope, 2)//': above about 0.4 parts of the contact are steeper than 1/coefficient, where '// &
         'friction can hold any force uphill; rows of a slide may take very many passes, or end unsolved (status 4)'
      call append(warnings, text)
   end subroutine check_wedging

   !> The rms slope of a map on the grid, from slabs of rows that are spread over it. It is 0 if the map cannot be read
   !> or has another shape than the grid.
   subroutine estimate_slope(grid, term, map, slope)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: map             !! the dataset
      real(dp), intent(out) :: slope
      type(hdf5_file_type) :: file
      type(slab_reader_type) :: slabs
      type(error_type), allocatable :: error, ignored
      real(dp), allocatable :: slab(:, :)
      integer, allocatable :: extent(:)
      real(dp) :: squares(2), pairs(2)
      integer :: k, parts, rows

      slope = 0.0_dp
      squares = 0.0_dp
      pairs = tiny(1.0_dp)
      call file%open(trim(term%file), 'read', error)
      if (allocated(error)) return
      call file%dataset_shape(map, extent, error)
      if (fits(extent, grid)) then
         rows = min(grid%ny, max(2, slab_rows(grid%nx)))
         parts = min(most_slabs, (grid%ny - 1)/rows + 1)
         allocate (slab(grid%nx, rows))
         call slabs%open(file, map, error)
         do k = 1, parts
            if (allocated(error)) exit
            call slabs%read(file, 1 + int(real(grid%ny - rows, dp)*(k - 1)/max(parts - 1, 1)), slab, error)
            if (allocated(error)) exit
            call add_squares(grid, slab, squares, pairs)
         end do
         call slabs%close()
      end if
      call file%close(ignored)
      if (.not. allocated(error)) slope = abs(term%scale)*sqrt(sum(squares/pairs))
   end subroutine estimate_slope

   !> Does a dataset have the shape of the grid?
   pure logical function fits(extent, grid)
      integer, allocatable, intent(in) :: extent(:)    !! nx, ny; unallocated after an error
      type(grid_type), intent(in) :: grid

      fits = allocated(extent)
      if (fits) fits = size(extent) == 2
      if (fits) fits = all(extent == [grid%nx, grid%ny])
   end function fits

   !> Add the squares of the slopes between neighbouring points, along x and along y, and their numbers.
   pure subroutine add_squares(grid, slab, squares, pairs)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: slab(:, :)
      real(dp), intent(inout) :: squares(2), pairs(2)
      integer :: j

      do j = 1, size(slab, 2)
         squares(1) = squares(1) + sum(((slab(2:, j) - slab(:grid%nx - 1, j))/grid%dx)**2)
         if (j > 1) squares(2) = squares(2) + sum(((slab(:, j) - slab(:, j - 1))/grid%dy)**2)
      end do
      pairs = pairs + [real(grid%nx - 1, dp)*size(slab, 2), real(grid%nx, dp)*(size(slab, 2) - 1)]
   end subroutine add_squares

   !> A length that the attributes of a map, or of the grid in its file, state; 0 if there is none.
   function length_of(file, map, name) result(length)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: map             !! the dataset
      character(*), intent(in) :: name            !! 'lx' or 'ly'
      real(dp) :: length                          !! m
      type(error_type), allocatable :: error

      length = 0.0_dp
      if (file%has_attribute(map, name)) then
         call file%read_attribute(map, name, length, error)
      else if (map == 'surface/height' .and. file%has_attribute('/grid', name)) then
         call file%read_attribute('/grid', name, length, error)
      end if
      if (allocated(error)) length = 0.0_dp
   end function length_of

   !> Is a length that the file states different from that of the grid?
   pure logical function differs(length, side)
      real(dp), intent(in) :: length              !! m; 0 if the file states none
      real(dp), intent(in) :: side                !! m

      differs = length > 0.0_dp .and. abs(length - side) > 1.0e-6_dp*side
   end function differs

   !> The name of a file without its folders.
   pure function last_of(path) result(name)
      character(*), intent(in) :: path
      character(:), allocatable :: name

      name = trim(path(index(path, '/', back=.true.) + 1:))
   end function last_of

   !> The longest waves of a random surface must be shorter than the side.
   subroutine check_long_waves(grid, term, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: side

      side = grid%lx
      if (grid%ny > 1) side = min(grid%lx, grid%ly)
      if (term%wavelength_long < side*(1.0_dp - round_off)) return
      text = '&surface: wavelength_long = '//rounded_text(term%wavelength_long, 4)// &
         ' m is not below the side of '//rounded_text(side, 4)// &
         ' m: the surface may be neither Gaussian nor isotropic; a quarter of the side is good'
      call append(warnings, text)
   end subroutine check_long_waves

   !> The grid must resolve the shortest waves; it does not hold waves of less than two cells.
   subroutine check_short_waves(grid, name, wavelength, shortest, along_x, warnings)
      type(grid_type), intent(in) :: grid
      character(*), intent(in) :: name
      real(dp), intent(in) :: wavelength
      real(dp), intent(in) :: shortest            !! the shortest wave, in units of `wavelength`
      logical, intent(in) :: along_x              !! the wave varies along x only
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: cell, cells

      cell = max(grid%dx, grid%dy)
      if (along_x .or. grid%ny == 1) cell = grid%dx
      cells = shortest*wavelength/cell
      if (cells >= cells_per_wave*(1.0_dp - round_off)) return
      if (cells > 2.0_dp) then
         text = '&surface: '//name//' = '//rounded_text(wavelength, 4)//' m: the shortest wave has '// &
            rounded_text(cells, 2)//' cells; 8 or more are good'
      else
         text = '&surface: '//name//' = '//rounded_text(wavelength, 4)// &
            ' m: the shortest wave is not above the Nyquist wavelength of '//rounded_text(2.0_dp*cell, 4)// &
            ' m: the grid cannot represent it'
      end if
      call append(warnings, text)
   end subroutine check_short_waves

   !> The side of a periodic grid must be a whole number of periods of the wave.
   subroutine check_period(side_name, side, period, grid, warnings)
      character(*), intent(in) :: side_name
      real(dp), intent(in) :: side                !! m
      real(dp), intent(in) :: period              !! of the wave along this side, m; 0: none
      type(grid_type), intent(in) :: grid
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: waves

      if (grid%boundary /= boundary_periodic .or. .not. period > 0.0_dp) return
      waves = side/period
      if (abs(waves - anint(waves)) <= 1.0e-6_dp*max(1.0_dp, waves)) return
      text = '&surface: '//side_name//' = '//rounded_text(side, 6)// &
         ' m and the period of the wave along it, '//rounded_text(period, 6)//' m, make '//rounded_text(waves, 6)// &
         ' waves: the periodic surface has a step at its edge'
      call append(warnings, text)
   end subroutine check_period

   !> Append a warning to the list.
   subroutine append(warnings, text)
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length), intent(in) :: text
      character(warning_length), allocatable :: longer(:)

      allocate (longer(size(warnings) + 1))
      longer(:size(warnings)) = warnings
      longer(size(longer)) = text
      call move_alloc(longer, warnings)
   end subroutine append

end module surface_warnings
