!> The height map H(x, y) of the road: a sum of analytic shapes, random surfaces and files.
!>
!> z points up into the rubber, so that summits are the largest values; lengths in m. The sphere,
!> the paraboloid and the cylinder have their summit at height 0. In periodic mode they and their
!> distances repeat with the cell, so that a shape off the middle is the same shape moved.
!> The hexagonal wave (thesis, eq. 4.6) repeats after a wavelength along x and wavelength/sqrt(3)
!> along y.
!>
!> Memory: the height, and one field more while a file is read or a random surface made.
module asperity_surface
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_checksum, only : checksum_of_field
   use asperity_errors, only : add_fault, error_input, error_type, fail
   use hdf5_file, only : read_field
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_periodic, grid_type
   use surface_self_affine, only : add_self_affine
   use surface_settings, only : surface_settings_type
   implicit none
   private

   public :: check_files, check_terms, new_height, rim_height

   !> Shapes that are a function of the position alone.
   character(*), parameter :: analytic_shapes(*) = [character(16) :: 'flat', 'sphere', &
      'paraboloid', 'cylinder', 'sine', 'hexagonal_wave']

contains

   !> The height of the road on every cell: the sum of all terms.
   subroutine new_height(grid, terms, height, error, map_checksums)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)          !! none: flat
      real(dp), allocatable, intent(out) :: height(:, :)           !! m, shape [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      !> Checksums of the maps that are read from files, by the number of the term; 0 for other terms
      integer(int64), allocatable, intent(out), optional :: map_checksums(:)
      integer(int64) :: map_checksum
      integer :: i, j, n

      if (present(map_checksums)) allocate (map_checksums(size(terms)), source=0_int64)
      call check_terms(terms, error)
      if (allocated(error)) return
      allocate (height(grid%nx, grid%ny))
      !$omp parallel do default(none) shared(grid, height) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            height(i, j) = 0.0_dp
         end do
      end do
      do n = 1, size(terms)
         select case (terms(n)%shape)
         case ('flat')
            cycle
         case ('self_affine')
            call add_self_affine(grid, terms(n), height, error)
         case ('file')
            call add_file(grid, terms(n), height, map_checksum, error)
            if (present(map_checksums)) map_checksums(n) = map_checksum
         case default
            call add_analytic(grid, terms(n), height)
         end select
         if (allocated(error)) return
      end do
   end subroutine new_height

   !> Highest value on the outermost cells: what a free surface lets leave or enter when it slides.
   pure function rim_height(height) result(rim)
      real(dp), intent(in) :: height(:, :)      !! m, shape [nx, ny]
      real(dp) :: rim
      integer :: nx, ny

      nx = size(height, 1)
      ny = size(height, 2)
      rim = max(maxval(height(1, :)), maxval(height(nx, :)), maxval(height(:, 1)), &
         maxval(height(:, ny)))
   end function rim_height

   !> Check that every term has what its shape needs; all faults are reported at once.
   subroutine check_terms(terms, error)
      type(surface_settings_type), intent(in) :: terms(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: n

      do n = 1, size(terms)
         associate (term => terms(n))
            select case (term%shape)
            case ('flat')
               continue
            case ('sphere', 'paraboloid', 'cylinder')
               call must_be_positive('radius', term%radius, error)
               call must_be_finite('centre_x', term%centre_x, error)
               call must_be_finite('centre_y', term%centre_y, error)
            case ('sine', 'hexagonal_wave')
               call must_be_positive('wavelength', term%wavelength, error)
               call must_be_finite('amplitude', term%amplitude, error)
               call must_be_finite('centre_x', term%centre_x, error)
               call must_be_finite('centre_y', term%centre_y, error)
            case ('self_affine')
               call check_self_affine(term, error)
            case ('file')
               call must_be_finite('scale', term%scale, error)
               if (term%file == '') call add_fault(error, error_input, &
                  '&surface: file is missing: shape = ''file'' needs the name of an HDF5 file')
            case default
               call add_fault(error, error_input, '&surface: shape = '''//trim(term%shape) &
                  //''': must be one of '//known_shapes())
            end select
         end associate
      end do
   end subroutine check_terms

   !> Faults of a self-affine term.
   subroutine check_self_affine(term, error)
      type(surface_settings_type), intent(in) :: term
      type(error_type), allocatable, intent(inout) :: error

      call must_be_positive('wavelength_short', term%wavelength_short, error)
      if (.not. (term%wavelength_rolloff >= term%wavelength_short)) call add_fault(error, &
         error_input, '&surface: wavelength_rolloff = '//number(term%wavelength_rolloff) &
         //': must be at least wavelength_short = '//number(term%wavelength_short))
      if (.not. (term%wavelength_long >= term%wavelength_rolloff)) call add_fault(error, &
         error_input, '&surface: wavelength_long = '//number(term%wavelength_long) &
         //': must be at least wavelength_rolloff = '//number(term%wavelength_rolloff))
      if (.not. ieee_is_finite(term%wavelength_long)) call add_fault(error, error_input, &
         '&surface: wavelength_long must be finite')
      if (.not. (term%hurst > 0.0_dp .and. term%hurst <= 1.0_dp)) call add_fault(error, &
         error_input, '&surface: hurst = '//number(term%hurst)//': must be above 0, at most 1')
      if (abs(term%rms_slope) > 0.0_dp .and. abs(term%rms_height) > 0.0_dp) then
         call add_fault(error, error_input, '&surface: rms_height = '//number(term%rms_height) &
            //' and rms_slope = '//number(term%rms_slope)//': give one of them')
      else if (abs(term%rms_slope) > 0.0_dp) then
         call must_be_positive('rms_slope', term%rms_slope, error)
      else
         call must_be_positive('rms_height', term%rms_height, error)
      end if
      if (term%generator /= 'random_phase' .and. term%generator /= 'filtered_noise') &
         call add_fault(error, error_input, '&surface: generator = '''//trim(term%generator) &
         //''': must be ''random_phase'' or ''filtered_noise''')
   end subroutine check_self_affine

   !> Add a fault unless 0 < value < infinity.
   subroutine must_be_positive(name, value, error)
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      if (value > 0.0_dp .and. ieee_is_finite(value)) return
      call add_fault(error, error_input, '&surface: '//name//' = '//number(value) &
         //': must be a positive number')
   end subroutine must_be_positive

   !> Add a fault unless the value is finite.
   subroutine must_be_finite(name, value, error)
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      if (ieee_is_finite(value)) return
      call add_fault(error, error_input, '&surface: '//name//' = '//number(value) &
         //': must be finite')
   end subroutine must_be_finite

   !> A number as a short word.
   pure function number(value) result(word)
      real(dp), intent(in) :: value
      character(:), allocatable :: word
      character(16) :: text

      write (text, '(es12.5)') value
      word = trim(adjustl(text))
   end function number

   !> The shapes, quoted.
   pure function known_shapes() result(list)
      character(:), allocatable :: list
      integer :: n

      list = ''
      do n = 1, size(analytic_shapes)
         list = list//''''//trim(analytic_shapes(n))//''', '
      end do
      list = list//'''self_affine'', ''file'''
   end function known_shapes

   !> Add a height map from a file, times its scale.
   subroutine add_file(grid, term, height, map_checksum, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), intent(inout) :: height(:, :)
      integer(int64), intent(out) :: map_checksum             !! of the map as it is in the file
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: map(:, :)
      integer :: i, j

      map_checksum = 0_int64
      call read_map(grid, term, map, error)
      if (allocated(error)) return
      map_checksum = checksum_of_field(map)
      !$omp parallel do default(none) shared(grid, height, map, term) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            height(i, j) = height(i, j) + term%scale*map(i, j)
         end do
      end do
   end subroutine add_file

   !> Read the maps of all terms that are files, only to see that they can be used; all faults are
   !> reported at once.
   subroutine check_files(grid, terms, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: fault
      real(dp), allocatable :: map(:, :)
      integer :: n

      do n = 1, size(terms)
         if (terms(n)%shape /= 'file') cycle
         call read_map(grid, terms(n), map, fault)
         if (allocated(fault)) call add_fault(error, fault%status, fault%message)
      end do
   end subroutine check_files

   !> Read the map of a term and see that it has the grid's shape and holds numbers.
   subroutine read_map(grid, term, map, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), allocatable, intent(out) :: map(:, :)         !! as in the file, not scaled
      type(error_type), allocatable, intent(out) :: error
      character(160) :: text
      integer :: extent(2), faulty, i, j

      extent = [grid%nx, grid%ny]
      call read_field(trim(term%file), trim(term%dataset), extent, map, error)
      if (allocated(error)) then
         error%message = map_fault(term, error%message)
         return
      end if
      if (any(extent /= [grid%nx, grid%ny])) then
         write (text, '(4(a, i0), a)') 'the height map has the shape (', extent(2), ', ', &
            extent(1), '): must be (ny, nx) = (', grid%ny, ', ', grid%nx, ')'
         call fail(error, error_input, map_fault(term, trim(text)))
         return
      end if
      faulty = 0
      !$omp parallel do default(none) shared(grid, map, term) private(i) reduction(+:faulty)
      do j = 1, grid%ny
         do i = 1, grid%nx
            if (.not. ieee_is_finite(term%scale*map(i, j))) faulty = faulty + 1
         end do
      end do
      if (faulty > 0) then
         write (text, '(a, i0, a)') 'the height map has ', faulty, &
            ' values that are not finite (NaN or infinite): all must be numbers, in m'
         call fail(error, error_input, map_fault(term, trim(text)))
      end if
   end subroutine read_map

   !> What is wrong with a map, after the place in the input that names its file.
   pure function map_fault(term, message) result(fault)
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: message                     !! may start with the file's name
      character(:), allocatable :: fault
      character(16) :: line
      integer :: first

      first = 1
      if (index(message, trim(term%file)//': ') == 1) first = len_trim(term%file) + 3
      fault = trim(term%place)//': file = '''//trim(term%file)//''': '//message(first:)
      if (term%line > 0) then
         write (line, '(a, i0, a)') ' (line ', term%line, ')'
         fault = fault//trim(line)
      end if
   end function map_fault

   !> Add an analytic shape.
   subroutine add_analytic(grid, term, height)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), intent(inout) :: height(:, :)
      integer :: i, j

      !$omp parallel do default(none) shared(grid, term, height) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            height(i, j) = height(i, j) + analytic_height(grid, term, i, j)
         end do
      end do
   end subroutine add_analytic

   !> Height of an analytic shape at the centre of cell (i, j), from 1.
   pure function analytic_height(grid, term, i, j) result(h)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      integer, intent(in) :: i, j
      real(dp) :: h
      real(dp) :: k, x, y

      x = (i - 1)*grid%dx - term%centre_x
      y = (j - 1)*grid%dy - term%centre_y
      select case (term%shape)
      case ('sphere')
         h = circular_cap(nearest_image(grid, x, grid%lx)**2 + distance_y(grid, y)**2, term%radius)
      case ('cylinder')
         h = circular_cap(nearest_image(grid, x, grid%lx)**2, term%radius)
      case ('paraboloid')
         h = -(nearest_image(grid, x, grid%lx)**2 + distance_y(grid, y)**2)/(2.0_dp*term%radius)
      case ('sine')
         h = term%amplitude*cos(2.0_dp*pi*x/term%wavelength)
      case ('hexagonal_wave')                                 ! (thesis, eq. 4.6)
         if (grid%ny == 1) y = 0.0_dp
         k = 2.0_dp*pi/term%wavelength
         h = term%amplitude*sin(k*(0.5_dp*x + sqrt(0.75_dp)*y)) &
            *sin(k*(-0.5_dp*x + sqrt(0.75_dp)*y))*sin(k*x)
      case default
         h = 0.0_dp
      end select
   end function analytic_height

   !> Distance to the nearest image in periodic mode; as it is in free mode.
   elemental function nearest_image(grid, x, length) result(d)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: x
      real(dp), intent(in) :: length
      real(dp) :: d

      d = x
      if (grid%boundary == boundary_periodic) d = x - length*anint(x/length)
   end function nearest_image

   !> The distance along y, which a line contact (ny = 1) does not know.
   elemental function distance_y(grid, y) result(d)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: y
      real(dp) :: d

      d = 0.0_dp
      if (grid%ny > 1) d = nearest_image(grid, y, grid%ly)
   end function distance_y

   !> sqrt(R^2 - r^2) - R without cancellation; -R beyond the radius.
   elemental function circular_cap(r_squared, radius) result(h)
      real(dp), intent(in) :: r_squared      !! m2
      real(dp), intent(in) :: radius         !! m
      real(dp) :: h

      if (r_squared < radius**2) then
         h = -r_squared/(radius + sqrt(radius**2 - r_squared))
      else
         h = -radius
      end if
   end function circular_cap

end module asperity_surface
