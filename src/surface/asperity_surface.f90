!> The height map H(x, y) of the road: a sum of analytic shapes, random surfaces and files.
!>
!> z points up into the rubber, so that summits are the largest values; lengths are in m. The table
!> in `surface_shapes` names the shapes and holds the formulas of the analytic ones.
!>
!> Where processes share the rows of the grid, each makes its own rows, and none has a whole map.
!>
!> Memory: the height, and one field more while a random surface is made.
module asperity_surface
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : add_fault, error_input, error_type
   use height_map, only : add_map, check_map
   use asperity_precision, only : dp, int64
   use regular_grid, only : grid_type
   use surface_self_affine, only : add_self_affine
   use surface_settings, only : real_variable, surface_settings_type
   use surface_shapes, only : find_shape, height_formula, place_at, shape_type, shape_words
   use text_tools, only : to_text
   implicit none
   private

   public :: check_files, check_terms, new_height

contains

   !> The height of the road on every cell of this process: the sum of all terms. Collective where processes
   !> share the rows.
   subroutine new_height(grid, terms, height, error, map_checksums)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)          !! none: flat
      real(dp), allocatable, intent(out) :: height(:, :)           !! m, shape [nx, rows]
      type(error_type), allocatable, intent(out) :: error
      !> Checksums of the maps that are read from files, by the number of the term; 0 for other
      !> terms
      integer(int64), allocatable, intent(out), optional :: map_checksums(:)
      integer(int64) :: map_checksum
      integer :: i, j, n

      if (present(map_checksums)) allocate (map_checksums(size(terms)), source=0_int64)
      call check_terms(terms, error)
      if (allocated(error)) return
      allocate (height(grid%nx, grid%rows()))
      !$omp parallel do default(none) shared(grid, height) private(i)
      do j = 1, grid%rows()
         do i = 1, grid%nx
            height(i, j) = 0.0_dp
         end do
      end do
      do n = 1, size(terms)
         select case (terms(n)%shape)
         case ('self_affine')
            call add_self_affine(grid, terms(n), height, error)
         case ('file')
            call add_map(grid, terms(n), height, map_checksum, error)
            if (present(map_checksums)) map_checksums(n) = map_checksum
         case default
            call add_analytic(grid, terms(n), height)
         end select
         if (allocated(error)) return
      end do
   end subroutine new_height

   !> Check that every term has what its shape needs; all faults are reported at once.
   subroutine check_terms(terms, error)
      type(surface_settings_type), intent(in) :: terms(:)
      type(error_type), allocatable, intent(out) :: error
      type(shape_type) :: shape
      integer :: i, n

      do n = 1, size(terms)
         shape = find_shape(terms(n)%shape)
         if (shape%name == '') call add_fault(error, error_input, '&surface: shape = ''' &
            //trim(terms(n)%shape)//''': must be one of '//shape_words(', '))
         do i = 1, size(shape%variables)
            call check_variable(terms(n), trim(shape%variables(i)), error)
         end do
         if (shape%name == 'self_affine') call check_self_affine(terms(n), error)
      end do
   end subroutine check_terms

   !> Faults of one variable of a term, as far as they do not depend on other variables.
   subroutine check_variable(term, name, error)
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error

      select case (name)
      case ('radius', 'wavelength')
         call must_be_positive(name, real_variable(term, name), error)
      case ('amplitude', 'centre_x', 'centre_y', 'scale')
         call must_be_finite(name, real_variable(term, name), error)
      case ('file')
         if (term%file == '') call add_fault(error, error_input, &
            '&surface: file is missing: shape = ''file'' needs the name of an HDF5 file')
      case default
         continue                                  ! `check_self_affine` checks the variables of a random surface
      end select
   end subroutine check_variable

   !> Faults of a self-affine term, whose variables depend on each other.
   subroutine check_self_affine(term, error)
      type(surface_settings_type), intent(in) :: term
      type(error_type), allocatable, intent(inout) :: error

      call must_be_positive('wavelength_short', term%wavelength_short, error)
      if (.not. (term%wavelength_rolloff >= term%wavelength_short)) call add_fault(error, &
         error_input, '&surface: wavelength_rolloff = '//to_text(term%wavelength_rolloff) &
         //': must be at least wavelength_short = '//to_text(term%wavelength_short))
      if (.not. (term%wavelength_long >= term%wavelength_rolloff)) call add_fault(error, &
         error_input, '&surface: wavelength_long = '//to_text(term%wavelength_long) &
         //': must be at least wavelength_rolloff = '//to_text(term%wavelength_rolloff))
      if (.not. ieee_is_finite(term%wavelength_long)) call add_fault(error, error_input, &
         '&surface: wavelength_long must be finite')
      if (.not. (term%hurst > 0.0_dp .and. term%hurst <= 1.0_dp)) call add_fault(error, &
         error_input, '&surface: hurst = '//to_text(term%hurst)//': must be above 0, at most 1')
      if (abs(term%rms_slope) > 0.0_dp .and. abs(term%rms_height) > 0.0_dp) then
         call add_fault(error, error_input, '&surface: rms_height = '//to_text(term%rms_height) &
            //' and rms_slope = '//to_text(term%rms_slope)//': give one of them')
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
      call add_fault(error, error_input, '&surface: '//name//' = '//to_text(value) &
         //': must be a positive number')
   end subroutine must_be_positive

   !> Add a fault unless the value is finite.
   subroutine must_be_finite(name, value, error)
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      if (ieee_is_finite(value)) return
      call add_fault(error, error_input, '&surface: '//name//' = '//to_text(value) &
         //': must be finite')
   end subroutine must_be_finite

   !> Check that the maps of all terms that are files can be used, by reading them; all faults are
   !> reported at once.
   subroutine check_files(grid, terms, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: terms(:)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: fault
      integer :: n

      do n = 1, size(terms)
         if (terms(n)%shape /= 'file') cycle
         call check_map(grid, terms(n), fault)
         if (allocated(fault)) call add_fault(error, fault%status, fault%message)
      end do
   end subroutine check_files

   !> Add an analytic shape; a plane has no formula and adds nothing.
   subroutine add_analytic(grid, term, height)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term         !! checked
      real(dp), intent(inout) :: height(:, :)
      procedure(height_formula), pointer :: formula
      type(shape_type) :: shape
      integer :: i, j

      shape = find_shape(term%shape)
      if (.not. associated(shape%formula)) return
      formula => shape%formula
      !$omp parallel do default(none) shared(grid, term, height, formula) private(i)
      do j = 1, grid%rows()
         do i = 1, grid%nx
            height(i, j) = height(i, j) + formula(place_at(grid, term, i, grid%first_row + j - 1), term)
         end do
      end do
   end subroutine add_analytic

end module asperity_surface
