!> What is doubtful in a surface, though not wrong: cut-offs of a random surface that its grid does
!> not hold (thesis, 4.1), waves that do not close on a period, waves of few cells, height maps that
!> say of themselves that they are of another size or unit.
module surface_warnings
   use asperity_errors, only : error_type
   use hdf5_file, only : hdf5_file_type
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use surface_settings, only : surface_settings_type
   implicit none
   private

   public :: find_warnings

   integer, parameter, public :: warning_length = 400
   real(dp), parameter :: cells_a_wave = 8.0_dp        !! enough for contact areas of some percent
   real(dp), parameter :: round_off = 1.0e-9_dp

contains

   !> One warning a doubt, with numbers; size 0 if all is well.
   subroutine find_warnings(grid, terms, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)      !! checked
      character(warning_length), allocatable, intent(out) :: warnings(:)
      integer :: n

      allocate (warnings(0))
      do n = 1, size(terms)
         select case (terms(n)%shape)
         case ('self_affine')
            call check_long_waves(grid, terms(n), warnings)
            call check_short_waves(grid, 'wavelength_short', terms(n)%wavelength_short, 1.0_dp, &
               .false., warnings)
         case ('sine')
            call check_period('lx', grid%lx, 'wavelength', terms(n)%wavelength, grid, warnings)
            call check_short_waves(grid, 'wavelength', terms(n)%wavelength, 1.0_dp, .true., &
               warnings)
         case ('hexagonal_wave')
            call check_period('lx', grid%lx, 'wavelength', terms(n)%wavelength, grid, warnings)
            if (grid%ny > 1) call check_period('ly', grid%ly, 'wavelength/sqrt(3)', &
               terms(n)%wavelength/sqrt(3.0_dp), grid, warnings)
            call check_short_waves(grid, 'wavelength', terms(n)%wavelength, 2.0_dp, .false., &
               warnings)
         case ('file')
            call check_map(grid, terms(n), warnings)
         case default
            continue                     ! the other shapes leave nothing to doubt
         end select
      end do
   end subroutine find_warnings

   !> What a map's file says of its lengths, unit and edges must agree with the input. A file that
   !> cannot be read, or says nothing, leaves nothing to doubt here.
   subroutine check_map(grid, term, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(:), allocatable :: boundary, map, start, units
      character(warning_length) :: text
      real(dp) :: lx, ly

      call file%open(trim(term%file), 'read', error)
      if (allocated(error)) return
      map = trim(term%dataset)
      if (map == '') map = 'surface/height'
      start = '&surface: file = '''//last_of(term%file)//''': '
      lx = length_of(file, map, 'lx')
      ly = length_of(file, map, 'ly')
      if (grid%ny == 1) ly = 0.0_dp
      if (differs(lx, grid%lx) .or. differs(ly, grid%ly)) then
         write (text, '(4(a, es10.4), a)') start//'the map says that it is ', lx, ' m by ', &
            merge(ly, grid%ly, ly > 0.0_dp), ' m, the grid is ', grid%lx, ' m by ', grid%ly, &
            ' m: its slopes change with that'
         call append(warnings, text)
      end if
      if (file%has_attribute(map, 'units') .and. abs(term%scale - 1.0_dp) <= 0.0_dp) then
         call file%read_attribute(map, 'units', units, error)
         if (.not. allocated(error)) then
            if (all(trim(units) /= [character(5) :: 'm', '1', '', 'metre', 'meter'])) then
               text = start//'the map says that its unit is '//trim(units)// &
                  ': its heights are taken as metres; scale changes that'
               call append(warnings, text)
            end if
         end if
      end if
      if (term%dataset == '' .and. file%has_attribute('/grid', 'boundary') .and. &
         grid%boundary == boundary_periodic .and. grid%ny > 1) then
         call file%read_attribute('/grid', 'boundary', boundary, error)
         if (.not. allocated(error)) then
            if (boundary == 'free') then
               text = start//'the map says that it is not periodic: where opposite edges do not '// &
                  'fit, the periodic surface has a step'
               call append(warnings, text)
            end if
         end if
      end if
      call file%close(error)
   end subroutine check_map

   !> A length that a map or its file's grid says of itself; 0 where they say none.
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

   !> Is a length that is known another one than the grid's?
   pure logical function differs(length, side)
      real(dp), intent(in) :: length              !! m; 0: not known
      real(dp), intent(in) :: side                !! m

      differs = length > 0.0_dp .and. abs(length - side) > 1.0e-6_dp*side
   end function differs

   !> The name of a file without its folders.
   pure function last_of(path) result(name)
      character(*), intent(in) :: path
      character(:), allocatable :: name

      name = trim(path(index(path, '/', back=.true.) + 1:))
   end function last_of

   !> The longest waves must be short against the side.
   subroutine check_long_waves(grid, term, warnings)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: side

      side = grid%lx
      if (grid%ny > 1) side = min(grid%lx, grid%ly)
      if (term%wavelength_long < side*(1.0_dp - round_off)) return
      write (text, '(2(a, es9.3), a)') '&surface: wavelength_long = ', term%wavelength_long, &
         ' m is not below the side of ', side, &
         ' m: the surface may be neither Gaussian nor isotropic; a quarter of the side is good'
      call append(warnings, text)
   end subroutine check_long_waves

   !> The shortest waves must be resolved; above the Nyquist wave number there are none.
   subroutine check_short_waves(grid, name, wavelength, factor, along_x, warnings)
      type(grid_type), intent(in) :: grid
      character(*), intent(in) :: name
      real(dp), intent(in) :: wavelength
      real(dp), intent(in) :: factor              !! the shortest wave is wavelength/factor
      logical, intent(in) :: along_x              !! a wave along x only
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: cell, cells

      cell = max(grid%dx, grid%dy)
      if (along_x .or. grid%ny == 1) cell = grid%dx
      cells = wavelength/factor/cell
      if (cells >= cells_a_wave*(1.0_dp - round_off)) return
      if (cells > 2.0_dp) then
         write (text, '(a, es9.3, a, f0.1, a)') '&surface: '//name//' = ', wavelength, &
            ' m: the shortest wave has ', cells, ' cells; 8 or more are good'
      else
         write (text, '(2(a, es9.3), a)') '&surface: '//name//' = ', wavelength, &
            ' m: the shortest wave is not above the Nyquist wavelength of ', 2.0_dp*cell, &
            ' m: the grid does not hold it'
      end if
      call append(warnings, text)
   end subroutine check_short_waves

   !> On a period a wave must close.
   subroutine check_period(side_name, side, name, wavelength, grid, warnings)
      character(*), intent(in) :: side_name, name
      real(dp), intent(in) :: side, wavelength
      type(grid_type), intent(in) :: grid
      character(warning_length), allocatable, intent(inout) :: warnings(:)
      character(warning_length) :: text
      real(dp) :: waves

      if (grid%boundary /= boundary_periodic) return
      waves = side/wavelength
      if (abs(waves - anint(waves)) <= 1.0e-6_dp*max(1.0_dp, waves)) return
      write (text, '(a, es11.5, a, f0.4, a)') '&surface: '//side_name//' = ', side, ' m is ', &
         waves, ' times '//name//': the periodic surface has a step at its edge'
      call append(warnings, text)
   end subroutine check_period

   !> One more warning.
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
