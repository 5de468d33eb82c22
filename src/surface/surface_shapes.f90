!> The table of the shapes that a road can have, and the formulas of the analytic ones.
!>
!> The table has one row per shape. The input language, the checks, the listing of the settings, the
!> warnings and the reference page read it, so that a new analytic shape is one row of `all_shapes`
!> and one function in this file. Shapes without a formula are made elsewhere: random surfaces in
!> `surface_self_affine`, maps from files in `height_map`.
!>
!> The sphere, the paraboloid and the cylinder have their summit at height 0. On a periodic grid
!> each cell takes the height that belongs to the nearest image of the summit, so that a shape that
!> does not lie in the middle is the same shape, moved.
module surface_shapes
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_periodic, grid_type
   use surface_settings, only : surface_settings_type, word_length
   implicit none
   private

   public :: all_shapes, find_shape, height_formula, place_at, place_type, shape_type, shape_words

   integer, parameter :: most_variables = 8     !! of one shape

   !> A place on the road, seen from the centre of a term (m).
   type :: place_type
      real(dp) :: x, y                          !! distances from the centre; y = 0 if ny = 1
      real(dp) :: near_x, near_y                !! the same from the nearest image of the centre
   end type place_type

   abstract interface
      !> Height of an analytic shape, m.
      pure function height_formula(place, term) result(h)
         import :: dp, place_type, surface_settings_type
         type(place_type), intent(in) :: place
         type(surface_settings_type), intent(in) :: term
         real(dp) :: h
      end function height_formula
   end interface

   !> One row of the table.
   type :: shape_type
      character(word_length) :: name = ''       !! the value of `shape`; '' if there is none
      character(40) :: meaning = ''             !! for the reference page
      !> Variables of `&surface` that belong to the shape, in the order of a listing; then blanks
      character(word_length) :: variables(most_variables) = ''
      !> Variables among them that must be given; then blanks
      character(word_length) :: required(most_variables) = ''
      !> Height as a function of the place; not associated for random surfaces, files and planes
      procedure(height_formula), pointer, nopass :: formula => null()
      !> Period of a wave along x and along y, and the shortest wave that the shape contains, all in
      !> units of `wavelength`; 0 if the shape has none
      real(dp) :: period_x = 0.0_dp
      real(dp) :: period_y = 0.0_dp
      real(dp) :: shortest_wave = 0.0_dp
   end type shape_type

contains

   !> The table.
   pure function all_shapes() result(shapes)
      type(shape_type), allocatable :: shapes(:)
      character(word_length), parameter :: radius(*) = ['radius'], &
         centre(*) = [character(word_length) :: 'centre_x', 'centre_y'], &
         wave(*) = [character(word_length) :: 'amplitude', 'wavelength'], &
         rough(*) = [character(word_length) :: 'hurst', 'wavelength_long', 'wavelength_rolloff', &
         'wavelength_short', 'rms_height', 'rms_slope', 'seed', 'generator'], &
         map(*) = [character(word_length) :: 'file', 'dataset', 'scale']

      allocate (shapes(8))
      shapes(1) = row('flat', 'a plane', centre, centre(:0))
      shapes(2) = row('sphere', 'the exact cap', [radius, centre], radius, sphere)
      shapes(3) = row('paraboloid', '-r^2/(2R)', [radius, centre], radius, paraboloid)
      shapes(4) = row('cylinder', 'the exact arc, its axis along y', [radius, centre], radius, &
         cylinder)
      shapes(5) = row('sine', 'one wave along x', [wave, centre], wave, sine)
      shapes(5)%period_x = 1.0_dp
      shapes(5)%shortest_wave = 1.0_dp
      shapes(6) = row('hexagonal_wave', 'three crossed waves', [wave, centre], wave, hexagonal_wave)
      shapes(6)%period_x = 1.0_dp
      shapes(6)%period_y = 1.0_dp/sqrt(3.0_dp)
      shapes(6)%shortest_wave = 0.5_dp
      shapes(7) = row('self_affine', 'a random rough surface', rough, rough(:1))
      shapes(8) = row('file', 'a height map', map, map(:1))
   end function all_shapes

   !> The row of a shape; its name is blank if there is no such shape.
   pure function find_shape(name) result(shape)
      character(*), intent(in) :: name
      type(shape_type) :: shape
      type(shape_type), allocatable :: shapes(:)
      integer :: n

      allocate (shapes, source=all_shapes())
      do n = 1, size(shapes)
         if (shapes(n)%name == name) shape = shapes(n)
      end do
   end function find_shape

   !> The names of all shapes, quoted, with a separator between them.
   pure function shape_words(separator) result(words)
      character(*), intent(in) :: separator
      character(:), allocatable :: words
      type(shape_type), allocatable :: shapes(:)
      integer :: n

      allocate (shapes, source=all_shapes())
      words = ''
      do n = 1, size(shapes)
         if (n > 1) words = words//separator
         words = words//''''//trim(shapes(n)%name)//''''
      end do
   end function shape_words

   !> Make a row of the table.
   pure function row(name, meaning, variables, required, formula) result(shape)
      character(*), intent(in) :: name, meaning
      character(*), intent(in) :: variables(:), required(:)
      procedure(height_formula), optional :: formula
      type(shape_type) :: shape

      shape%name = name
      shape%meaning = meaning
      shape%variables(:size(variables)) = variables
      shape%required(:size(required)) = required
      if (present(formula)) shape%formula => formula
   end function row

   !> The centre of cell (i, j), from 1, as a term sees it.
   pure function place_at(grid, term, i, j) result(place)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term
      integer, intent(in) :: i, j
      type(place_type) :: place

      place%x = (i - 1)*grid%dx - term%centre_x
      place%y = (j - 1)*grid%dy - term%centre_y
      if (grid%ny == 1) place%y = 0.0_dp
      place%near_x = place%x
      place%near_y = place%y
      if (grid%boundary == boundary_periodic) then
         place%near_x = place%x - grid%lx*anint(place%x/grid%lx)
         place%near_y = place%y - grid%ly*anint(place%y/grid%ly)
      end if
   end function place_at

   ! --- the formulas -------------------------------------------------------------------------

   pure function sphere(place, term) result(h)
      type(place_type), intent(in) :: place
      type(surface_settings_type), intent(in) :: term
      real(dp) :: h

      h = circular_cap(place%near_x**2 + place%near_y**2, term%radius)
   end function sphere

   pure function paraboloid(place, term) result(h)
      type(place_type), intent(in) :: place
      type(surface_settings_type), intent(in) :: term
      real(dp) :: h

      h = -(place%near_x**2 + place%near_y**2)/(2.0_dp*term%radius)
   end function paraboloid

   pure function cylinder(place, term) result(h)
      type(place_type), intent(in) :: place
      type(surface_settings_type), intent(in) :: term
      real(dp) :: h

      h = circular_cap(place%near_x**2, term%radius)
   end function cylinder

   pure function sine(place, term) result(h)
      type(place_type), intent(in) :: place
      type(surface_settings_type), intent(in) :: term
      real(dp) :: h

      h = term%amplitude*cos(2.0_dp*pi*place%x/term%wavelength)
   end function sine

   !> Three crossed waves (thesis, eq. 4.6). The shape repeats after a wavelength along x and wavelength/sqrt(3)
   !> along y. The product of the sines is the sum of three waves of half the wavelength, at 120 degrees.
   pure function hexagonal_wave(place, term) result(h)
      type(place_type), intent(in) :: place
      type(surface_settings_type), intent(in) :: term
      real(dp) :: h
      real(dp) :: k

      k = 2.0_dp*pi/term%wavelength
      h = term%amplitude*sin(k*(0.5_dp*place%x + sqrt(0.75_dp)*place%y)) &
         *sin(k*(-0.5_dp*place%x + sqrt(0.75_dp)*place%y))*sin(k*place%x)
   end function hexagonal_wave

   !> sqrt(R^2 - r^2) - R, written so that no digits cancel; -R beyond the radius.
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

end module surface_shapes
