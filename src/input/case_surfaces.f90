!> The `&surface` groups of a case: their defaults, which depend on the grid, and the variables that belong to
!> each shape.
module case_surfaces
   use case_settings, only : path_length, surface_settings_type
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use surface_self_affine, only : has_modes
   use surface_shapes, only : find_shape, shape_type
   use text_tools, only : to_text
   implicit none
   private

   public :: resolve_path, resolve_surfaces

contains

   !> Resolve all groups `&surface`.
   subroutine resolve_surfaces(groups, path, grid, grid_known, surfaces, faults)
      type(group_values_type), intent(in) :: groups(:)
      character(*), intent(in) :: path
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known
      type(surface_settings_type), allocatable, intent(out) :: surfaces(:)
      type(faults_type), intent(inout) :: faults
      integer :: i, n

      allocate (surfaces(count(groups%name == 'surface')))
      n = 0
      do i = 1, size(groups)
         if (groups(i)%name /= 'surface') cycle
         n = n + 1
         call resolve_surface(groups(i), path, grid, grid_known, surfaces(n), faults)
      end do
   end subroutine resolve_surfaces

   !> Resolve one `&surface`.
   subroutine resolve_surface(group, path, grid, grid_known, term, faults)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: path
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known
      type(surface_settings_type), intent(out) :: term
      type(faults_type), intent(inout) :: faults
      real(dp) :: side

      term%shape = group%text_value('shape')
      side = merge(grid%lx, min(grid%lx, grid%ly), grid%ny == 1)
      term%radius = group%real_value('radius')
      term%amplitude = group%real_value('amplitude')
      term%wavelength = group%real_value('wavelength')
      term%hurst = group%real_value('hurst')
      term%wavelength_long = group%real_value('wavelength_long', side)
      term%wavelength_rolloff = group%real_value('wavelength_rolloff', term%wavelength_long)
      term%wavelength_short = group%real_value('wavelength_short', &
         8.0_dp*merge(grid%dx, max(grid%dx, grid%dy), grid%ny == 1))
      term%rms_height = group%real_value('rms_height')
      term%rms_slope = group%real_value('rms_slope')
      term%seed = group%integer_value('seed')
      term%generator = group%text_value('generator')
      term%dataset = group%text_value('dataset')
      term%scale = group%real_value('scale')
      term%centre_x = group%real_value('centre_x', (grid%nx/2)*grid%dx)
      term%centre_y = group%real_value('centre_y', (grid%ny/2)*grid%dy)
      term%file = ''
      term%place = path//': &surface'
      term%line = group%line

      call check_belonging(group, find_shape(term%shape), faults)
      if (term%shape == 'self_affine') call check_rough(group, term, grid, grid_known, faults)
      if (term%shape == 'file') call resolve_path(group, path, term%file, faults)
   end subroutine resolve_surface

   !> Report variables that a shape needs and does not have, and variables that do not belong to it.
   subroutine check_belonging(group, shape, faults)
      type(group_values_type), intent(in) :: group
      type(shape_type), intent(in) :: shape
      type(faults_type), intent(inout) :: faults
      character(:), allocatable :: name
      integer :: i

      call group%demand('shape', faults)
      if (shape%name == '') return                   ! the unknown word is reported elsewhere
      do i = 1, size(shape%required)
         if (shape%required(i) /= '') &
            call group%demand(trim(shape%required(i)), faults, trim(shape%name))
      end do
      do i = 1, size(group%values)
         name = trim(group%values(i)%entry%name)
         if (name == 'shape' .or. .not. group%given(name) .or. any(shape%variables == name)) cycle
         call group%fault(name, 'does not belong to shape = '''//trim(shape%name)//'''', faults)
      end do
   end subroutine check_belonging

   !> Check that the parameters of a rough surface agree with each other.
   subroutine check_rough(group, term, grid, grid_known, faults)
      type(group_values_type), intent(in) :: group
      type(surface_settings_type), intent(in) :: term
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known                !! the defaults are known
      type(faults_type), intent(inout) :: faults
      logical :: long_known, rolloff_known, short_known

      if (group%given('rms_height') .and. group%given('rms_slope')) then
         call group%group_fault('rms_height and rms_slope are given together: give one of them', faults)
      else if (.not. (group%given('rms_height') .or. group%given('rms_slope'))) then
         call group%group_fault('rms_height or rms_slope is missing: self_affine needs one of them', faults)
      end if
      long_known = known('wavelength_long')
      rolloff_known = known('wavelength_rolloff') .and. (long_known .or. group%given('wavelength_rolloff'))
      short_known = known('wavelength_short')
      if (rolloff_known .and. short_known) then
         if (term%wavelength_short > term%wavelength_rolloff) call group%fault('wavelength_short', &
            'must be at most '//trim(merge('wavelength_rolloff', 'wavelength_long   ', group%given('wavelength_rolloff')))// &
            ' = '//to_text(term%wavelength_rolloff)// &
            default_note('wavelength_short', term%wavelength_short), faults)
      end if
      if (rolloff_known .and. long_known) then
         if (term%wavelength_rolloff > term%wavelength_long) call group%fault('wavelength_rolloff', &
            'must be at most wavelength_long = '//to_text(term%wavelength_long), faults)
      end if
      if (grid_known .and. long_known .and. short_known) then
         if (term%wavelength_short <= term%wavelength_long .and. .not. has_modes(grid, term)) &
            call group%fault('wavelength_short', 'no wave that fits the grid is between wavelength_short and '// &
            'wavelength_long = '//to_text(term%wavelength_long)// &
            ' m long: give a longer wavelength_long, or a finer grid', faults)
      end if

   contains

      !> Is the wavelength known, given or by default?
      logical function known(name)
         character(*), intent(in) :: name

         known = group%usable(name) .or. (grid_known .and. .not. group%given(name))
      end function known

      !> A note with the value if it is the default.
      function default_note(name, value) result(note)
         character(*), intent(in) :: name
         real(dp), intent(in) :: value
         character(:), allocatable :: note

         note = ''
         if (.not. group%given(name)) note = '; by default it is '//to_text(value)//', 8 cells'
      end function default_note

   end subroutine check_rough

   !> Make a path of the input, which is relative to the folder of the input, relative to the present folder.
   subroutine resolve_path(group, path, file, faults)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: path                  !! of the input
      character(path_length), intent(out) :: file
      type(faults_type), intent(inout) :: faults
      character(:), allocatable :: name

      file = ''
      if (.not. group%usable('file')) return
      name = group%text_value('file')
      if (name == '') then
         call group%fault('file', 'must name a file', faults)
         return
      end if
      if (name(1:1) /= '/') name = path(:index(path, '/', back=.true.))//name
      if (len(name) > len(file)) then
         call group%fault('file', 'with the input''s folder it must have at most '//to_text(path_length)// &
            ' characters', faults)
         return
      end if
      file = name
   end subroutine resolve_path

end module case_surfaces
