!> Reads a case: a file of namelists becomes checked settings, or one error with all its faults.
module case_input
   use case_features, only : check_features
   use case_phases, only : resolve_phases
   use case_settings, only : case_type, material_settings_type, output_settings_type, path_length, &
      surface_settings_type, word_length
   use errors, only : error_file, error_type, fail
   use input_faults, only : faults_type
   use input_reference, only : group_entries, group_entry_type, is_required
   use input_values, only : default_group, group_values_type, read_groups
   use precision, only : dp
   use prony, only : wlf_shift, zener_to_prony
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use text_tools, only : to_text
   implicit none
   private

   public :: parse_case, read_case, read_text_file

   integer, parameter :: largest_file = 4000000      !! characters of an input

contains

   !> Read a case from a file.
   subroutine read_case(path, case, error)
      character(*), intent(in) :: path
      type(case_type), intent(out) :: case
      type(error_type), allocatable, intent(out) :: error      !! all faults, one a line
      character(:), allocatable :: text

      call read_text_file(path, text, error)
      if (allocated(error)) return
      call parse_case(text, path, case, error)
   end subroutine read_case

   !> The content of a file, byte by byte.
   subroutine read_text_file(path, text, error)
      character(*), intent(in) :: path
      character(:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: larger
      character(256) :: message
      character :: letter
      integer :: count, status, unit
      logical :: exists

      inquire (file=path, exist=exists)
      if (.not. exists) then
         call fail(error, error_file, path//': there is no such file')
         return
      end if
      message = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', &
         iostat=status, iomsg=message)
      if (status /= 0) then
         call fail(error, error_file, path//': cannot be read: '//trim(message))
         return
      end if
      allocate (character(4096) :: text)
      count = 0
      do
         read (unit, iostat=status, iomsg=message) letter
         if (status /= 0) exit
         if (count == len(text)) then
            allocate (character(2*count) :: larger)
            larger(:count) = text
            call move_alloc(larger, text)
         end if
         count = count + 1
         text(count:count) = letter
         if (count > largest_file) exit
      end do
      close (unit)
      if (.not. is_iostat_end(status)) then
         if (status == 0) message = 'it is longer than '//to_text(largest_file)//' characters'
         call fail(error, error_file, path//': cannot be read: '//trim(message))
         return
      end if
      text = text(:count)
   end subroutine read_text_file

   !> Read a case from a text.
   subroutine parse_case(text, path, case, error)
      character(*), intent(in) :: text
      character(*), intent(in) :: path                         !! the file's name, for messages and results
      type(case_type), intent(out) :: case
      type(error_type), allocatable, intent(out) :: error      !! all faults, one a line
      type(group_values_type), allocatable :: groups(:)
      type(group_values_type) :: group
      type(faults_type) :: faults
      logical :: grid_known

      faults%path = path
      case%path = path
      case%input = text
      case%warnings = ''
      call read_groups(text, groups, faults)
      if (faults%hopeless) then
         call move_alloc(faults%error, error)
         return
      end if
      call check_presence(groups, faults)

      call pick(groups, 'case', group)
      case%title = group%text_value('title')
      if (len(group%text_value('title')) > len(case%title)) &
         call group%fault('title', 'must have at most '//to_text(len(case%title))//' characters', faults)

      call pick(groups, 'grid', group)
      call resolve_grid(group, case%grid, grid_known, faults)
      call resolve_surfaces(groups, path, case%grid, grid_known, case%surfaces, faults)
      call pick(groups, 'material', group)
      call resolve_material(group, case%grid, grid_known, case%material, faults)
      call pick(groups, 'adhesion', group)
      call resolve_adhesion(group, case, faults)
      call pick(groups, 'friction', group)
      call resolve_friction(group, case, faults)
      call pick(groups, 'adhesion', group)
      call resolve_phases(pack_phases(groups), case%grid, case%material, &
         case%adhesion%potential /= 'none' .or. group%bad('potential'), case%phases, faults, case%warnings)
      call pick(groups, 'solver', group)
      call resolve_solver(group, case)
      call pick(groups, 'output', group)
      call resolve_output(group, case, faults)

      if (.not. allocated(faults%error)) call check_features(case, faults)
      if (allocated(faults%error)) call move_alloc(faults%error, error)
   end subroutine parse_case

   !> Report groups that are missing.
   subroutine check_presence(groups, faults)
      type(group_values_type), intent(in) :: groups(:)
      type(faults_type), intent(inout) :: faults
      type(group_entry_type), allocatable :: known(:)
      integer :: i

      known = group_entries()
      do i = 1, size(known)
         if (.not. known(i)%required .or. any(groups%name == known(i)%name)) cycle
         call faults%add('&'//trim(known(i)%name), 'the group is missing')
      end do
   end subroutine check_presence

   !> The first group of a name, or one of defaults.
   subroutine pick(groups, name, group)
      type(group_values_type), intent(in) :: groups(:)
      character(*), intent(in) :: name
      type(group_values_type), intent(out) :: group
      integer :: i

      do i = 1, size(groups)
         if (groups(i)%name == name) then
            group = groups(i)
            return
         end if
      end do
      call default_group(name, group)
   end subroutine pick

   !> The phases among the groups.
   function pack_phases(groups) result(phases)
      type(group_values_type), intent(in) :: groups(:)
      type(group_values_type), allocatable :: phases(:)
      integer :: i, n

      allocate (phases(count(groups%name == 'phase')))
      n = 0
      do i = 1, size(groups)
         if (groups(i)%name /= 'phase') cycle
         n = n + 1
         phases(n) = groups(i)
      end do
   end function pack_phases

   !> Report a variable that must be given and is not.
   subroutine demand(group, name, faults, why)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: name
      type(faults_type), intent(inout) :: faults
      character(*), intent(in), optional :: why       !! what asks for it

      if (group%given(name) .or. group%line == 0) return
      if (present(why)) then
         call group%fault(name, 'is missing: '//why//' needs it', faults)
      else
         call group%fault(name, 'is missing', faults)
      end if
   end subroutine demand

   !> `&grid`
   subroutine resolve_grid(group, grid, known, faults)
      type(group_values_type), intent(in) :: group
      type(grid_type), intent(out) :: grid
      logical, intent(out) :: known                    !! the grid can be used in other checks
      type(faults_type), intent(inout) :: faults
      integer :: boundary, nx, ny
      real(dp) :: lx, ly

      call demand(group, 'nx', faults)
      call demand(group, 'ny', faults)
      call demand(group, 'lx', faults)
      nx = group%integer_value('nx')
      ny = group%integer_value('ny')
      lx = group%real_value('lx')
      boundary = boundary_periodic
      if (group%text_value('boundary') == 'free') boundary = boundary_free
      if (nx == 1) call group%fault('nx', 'must be at least 2', faults)
      if (ny == 1 .and. boundary == boundary_free) call group%fault('ny', 'needs boundary = '// &
         '''periodic'': a free line contact has no finite displacement', faults)
      known = nx > 1 .and. ny > 0 .and. lx > 0.0_dp .and. .not. group%bad('ly')
      if (.not. known) return
      if (real(nx, dp)*real(ny, dp) > real(huge(1), dp)) then
         call group%fault('nx', 'nx times ny = '//to_text(ny)//' must be at most '//to_text(huge(1)), faults)
         known = .false.
         return
      end if
      ly = group%real_value('ly', lx*ny/nx)
      grid = new_grid(nx, ny, lx, ly, boundary)
      known = grid%dx > 0.0_dp .and. grid%dy > 0.0_dp .and. grid%dx*grid%dy > 0.0_dp .and. &
         lx*ly <= huge(1.0_dp)
      if (.not. known) call group%fault('lx', 'makes cells whose area is no ordinary number', faults)
      if (.not. known) grid = grid_type()
   end subroutine resolve_grid

   !> `&surface`, all of them
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

   !> One `&surface`
   subroutine resolve_surface(group, path, grid, grid_known, term, faults)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: path
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known
      type(surface_settings_type), intent(out) :: term
      type(faults_type), intent(inout) :: faults
      character(:), allocatable :: belongs, name
      real(dp) :: side
      integer :: i

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

      call demand(group, 'shape', faults)
      belongs = ' shape '
      select case (term%shape)
      case ('sphere', 'paraboloid', 'cylinder')
         belongs = belongs//'radius centre_x centre_y '
         call demand(group, 'radius', faults, trim(term%shape))
      case ('sine', 'hexagonal_wave')
         belongs = belongs//'amplitude wavelength centre_x centre_y '
         call demand(group, 'amplitude', faults, trim(term%shape))
         call demand(group, 'wavelength', faults, trim(term%shape))
      case ('self_affine')
         belongs = belongs//'hurst wavelength_long wavelength_rolloff wavelength_short rms_height '// &
            'rms_slope seed generator '
         call demand(group, 'hurst', faults, 'self_affine')
         call check_rough(group, term, grid_known, faults)
      case ('file')
         belongs = belongs//'file dataset scale '
         call demand(group, 'file', faults, 'shape = ''file''')
         call resolve_path(group, path, term%file, faults)
      case ('flat')
         belongs = belongs//'centre_x centre_y '
      case default
         return
      end select
      do i = 1, size(group%values)
         name = trim(group%values(i)%entry%name)
         if (.not. group%given(name) .or. index(belongs, ' '//name//' ') > 0) cycle
         call group%fault(name, 'does not belong to shape = '''//trim(term%shape)//'''', faults)
      end do
   end subroutine resolve_surface

   !> The parameters of a rough surface among each other.
   subroutine check_rough(group, term, grid_known, faults)
      type(group_values_type), intent(in) :: group
      type(surface_settings_type), intent(in) :: term
      logical, intent(in) :: grid_known                !! defaults are known
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
         if (.not. term%wavelength_short < term%wavelength_rolloff) call group%fault('wavelength_short', &
            'must be below wavelength_rolloff = '//to_text(term%wavelength_rolloff)// &
            default_note('wavelength_short', term%wavelength_short), faults)
      end if
      if (rolloff_known .and. long_known) then
         if (term%wavelength_rolloff > term%wavelength_long) call group%fault('wavelength_rolloff', &
            'must be at most wavelength_long = '//to_text(term%wavelength_long), faults)
      end if

   contains

      !> Is the wavelength known, given or by default?
      logical function known(name)
         character(*), intent(in) :: name

         known = group%usable(name) .or. (grid_known .and. .not. group%given(name))
      end function known

      !> The value where it is the default.
      function default_note(name, value) result(note)
         character(*), intent(in) :: name
         real(dp), intent(in) :: value
         character(:), allocatable :: note

         note = ''
         if (.not. group%given(name)) note = '; by default it is '//to_text(value)//', 8 cells'
      end function default_note

   end subroutine check_rough

   !> A path in the input counts from the input's folder.
   subroutine resolve_path(group, path, file, faults)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: path                  !! of the input
      character(*), intent(out) :: file
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

   !> `&material`
   subroutine resolve_material(group, grid, grid_known, material, faults)
      type(group_values_type), intent(in) :: group
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known
      type(material_settings_type), intent(out) :: material
      type(faults_type), intent(inout) :: faults
      logical :: arms

      material%poisson = group%real_value('poisson')
      material%shear_modulus = group%real_value('shear_modulus')
      material%thickness = group%real_value('thickness')
      material%density = group%real_value('density')
      material%reference_temperature = group%real_value('reference_temperature')
      material%temperature = group%real_value('temperature', material%reference_temperature)
      material%wlf_c1 = group%real_value('wlf_c1')
      material%wlf_c2 = group%real_value('wlf_c2')

      call resolve_arms(group, material, arms, faults)
      if (.not. arms) then
         call demand(group, 'shear_modulus', faults)
         if (group%usable('shear_modulus') .and. .not. material%shear_modulus > 0.0_dp) &
            call group%fault('shear_modulus', 'must be a positive number; 0 is allowed only where '// &
            'there are Prony arms or Zener branches', faults)
      end if
      if (material%density > 0.0_dp .and. .not. group%bad('thickness') .and. &
         .not. material%thickness > 0.0_dp) call group%fault('density', &
         'needs a thickness above 0: inertia is that of the block', faults)
      if (grid_known .and. grid%boundary == boundary_free .and. material%thickness > 0.0_dp) &
         call group%fault('thickness', 'needs boundary = ''periodic'': a free patch lies on a half-space', &
         faults)
      call shift_times(group, material, faults)
   end subroutine resolve_material

   !> Prony arms, or Zener branches turned into arms.
   subroutine resolve_arms(group, material, arms, faults)
      type(group_values_type), intent(in) :: group
      type(material_settings_type), intent(inout) :: material
      logical, intent(out) :: arms                     !! arms or branches are given, perhaps wrongly
      type(faults_type), intent(inout) :: faults
      logical :: prony_given, zener_given
      real(dp), allocatable :: eta(:), g0(:), g1(:)
      real(dp) :: spring

      prony_given = group%given('prony_g') .or. group%given('prony_tau')
      zener_given = group%given('zener_g0') .or. group%given('zener_g1') .or. group%given('zener_eta')
      arms = prony_given .or. zener_given
      allocate (material%prony_g(0), material%prony_tau(0))
      if (prony_given .and. zener_given) then
         call group%group_fault('prony_... and zener_... are given together: give Prony arms or Zener '// &
            'branches', faults)
      end if
      if (prony_given) then
         call demand(group, 'prony_g', faults, 'prony_tau')
         call demand(group, 'prony_tau', faults, 'prony_g')
         call same_size('prony_tau', 'prony_g')
         if (.not. both_good('prony_g', 'prony_tau')) return
         material%prony_g = group%reals_value('prony_g')
         material%prony_tau = group%reals_value('prony_tau')
      else if (zener_given) then
         call demand(group, 'zener_g0', faults, 'a Zener branch')
         call demand(group, 'zener_g1', faults, 'a Zener branch')
         call demand(group, 'zener_eta', faults, 'a Zener branch')
         call same_size('zener_g1', 'zener_g0')
         call same_size('zener_eta', 'zener_g0')
         if (.not. (both_good('zener_g0', 'zener_g1') .and. both_good('zener_g0', 'zener_eta'))) return
         g0 = group%reals_value('zener_g0')
         g1 = group%reals_value('zener_g1')
         eta = group%reals_value('zener_eta')
         deallocate (material%prony_g, material%prony_tau)
         allocate (material%prony_g(size(g0)), material%prony_tau(size(g0)))
         spring = material%shear_modulus
         call zener_to_prony(spring, g0, g1, eta, material%shear_modulus, material%prony_g, &
            material%prony_tau)
      end if

   contains

      !> Report lists of different sizes.
      subroutine same_size(name, other)
         character(*), intent(in) :: name, other

         if (.not. (group%usable(name) .and. group%usable(other))) return
         if (size(group%reals_value(name)) == size(group%reals_value(other))) return
         call group%fault(name, 'has '//to_text(size(group%reals_value(name)))//' values, but '// &
            other//' has '//to_text(size(group%reals_value(other))), faults)
      end subroutine same_size

      !> Are two lists there, and of one size?
      logical function both_good(name, other)
         character(*), intent(in) :: name, other

         both_good = group%usable(name) .and. group%usable(other)
         if (both_good) both_good = size(group%reals_value(name)) == size(group%reals_value(other))
      end function both_good

   end subroutine resolve_arms

   !> Bring the relaxation times to the case's temperature.
   subroutine shift_times(group, material, faults)
      type(group_values_type), intent(in) :: group
      type(material_settings_type), intent(inout) :: material
      type(faults_type), intent(inout) :: faults
      real(dp) :: difference, factor

      if (group%bad('wlf_c1') .or. group%bad('wlf_c2') .or. group%bad('temperature') .or. &
         group%bad('reference_temperature')) return
      if (group%given('wlf_c1') .neqv. group%given('wlf_c2')) then
         call group%group_fault('wlf_c1 and wlf_c2 must be given together', faults)
         return
      end if
      difference = material%temperature - material%reference_temperature
      if (.not. abs(difference) > 0.0_dp) return
      if (.not. group%given('wlf_c1')) then
         if (size(material%prony_tau) > 0) call group%group_fault('temperature = '// &
            to_text(material%temperature)//' is not reference_temperature = '// &
            to_text(material%reference_temperature)//': a shift needs wlf_c1 and wlf_c2', faults)
         return
      end if
      if (.not. material%wlf_c2 + difference > 0.0_dp) then
         call group%fault('temperature', 'is below the range of the WLF shift: it must be above '// &
            'reference_temperature - wlf_c2 = '// &
            to_text(material%reference_temperature - material%wlf_c2), faults)
         return
      end if
      factor = wlf_shift(material%temperature, material%reference_temperature, material%wlf_c1, &
         material%wlf_c2)
      if (.not. (factor > 1.0e-100_dp .and. factor < 1.0e100_dp)) then
         call group%fault('temperature', 'shifts the relaxation times by a factor of '//to_text(factor)// &
            ': it is too far from reference_temperature', faults)
         return
      end if
      material%prony_tau = factor*material%prony_tau
   end subroutine shift_times

   !> `&adhesion`
   subroutine resolve_adhesion(group, case, faults)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case
      type(faults_type), intent(inout) :: faults

      case%adhesion%potential = group%text_value('potential')
      case%adhesion%energy = group%real_value('energy')
      case%adhesion%range = group%real_value('range')
      case%adhesion%start = group%text_value('start')
      if (case%adhesion%potential == '') case%adhesion%potential = 'none'
      if (group%bad('potential')) return
      if (case%adhesion%potential /= 'none') then
         call demand(group, 'energy', faults, trim(case%adhesion%potential))
         call demand(group, 'range', faults, trim(case%adhesion%potential))
      else if (.not. group%given('potential') .and. &
         (group%given('energy') .or. group%given('range') .or. group%given('start'))) then
         call group%fault('potential', 'is missing', faults)
      end if
   end subroutine resolve_adhesion

   !> `&friction`
   subroutine resolve_friction(group, case, faults)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case
      type(faults_type), intent(inout) :: faults

      case%friction%law = group%text_value('law')
      case%friction%coefficient = group%real_value('coefficient')
      case%friction%shear_strength = group%real_value('shear_strength')
      case%friction%slope_effect = group%logical_value('slope_effect')
      if (case%friction%law == '') case%friction%law = 'none'
      if (group%bad('law')) return
      select case (case%friction%law)
      case ('coulomb')
         call demand(group, 'coefficient', faults, 'coulomb')
      case ('constant_shear')
         call demand(group, 'shear_strength', faults, 'constant_shear')
      case ('coulomb_orowan')
         call demand(group, 'coefficient', faults, 'coulomb_orowan')
         call demand(group, 'shear_strength', faults, 'coulomb_orowan')
      case default
         if (.not. group%given('law') .and. (group%given('coefficient') .or. &
            group%given('shear_strength') .or. group%given('slope_effect'))) &
            call group%fault('law', 'is missing', faults)
      end select
   end subroutine resolve_friction

   !> `&solver`
   subroutine resolve_solver(group, case)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case

      case%solver%tolerance = group%real_value('tolerance')
      case%solver%max_iterations = group%integer_value('max_iterations')
      case%solver%method = group%text_value('method')
      case%solver%time_scheme = group%text_value('time_scheme')
      case%solver%passes = group%integer_value('passes')
      case%solver%slip_law = group%text_value('slip_law')
      case%solver%interpolation = group%text_value('interpolation')
      case%solver%precision = group%text_value('precision')
      case%solver%threads = group%integer_value('threads')
   end subroutine resolve_solver

   !> `&output`
   subroutine resolve_output(group, case, faults)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case
      type(faults_type), intent(inout) :: faults
      type(output_settings_type) :: output
      character(path_length), allocatable :: fields(:)
      real(dp) :: finish
      integer :: i

      call resolve_path(group, case%path, output%file, faults)
      if (.not. group%given('file')) output%file = default_result(case%path)
      output%snapshot_every = group%integer_value('snapshot_every')
      output%snapshot_times = group%reals_value('snapshot_times')
      output%checkpoint_every = group%integer_value('checkpoint_every')
      output%compression = group%integer_value('compression')

      if (group%given('snapshot_every') .and. group%given('snapshot_times')) call group%group_fault( &
         'snapshot_every and snapshot_times are given together: give one of them', faults)
      if (size(output%snapshot_times) > 0 .and. .not. allocated(faults%error)) then
         finish = sum(case%phases%duration)
         if (any(output%snapshot_times > finish*(1.0_dp + 1.0e-9_dp))) call group%fault('snapshot_times', &
            'must lie within the run, which ends at '//to_text(finish)//' s', faults)
         do i = 2, size(output%snapshot_times)
            if (output%snapshot_times(i) > output%snapshot_times(i - 1)) cycle
            call group%fault('snapshot_times', 'must increase', faults)
            exit
         end do
      end if

      if (group%given('snapshot_fields')) then
         fields = group%texts_value('snapshot_fields')
         allocate (output%snapshot_fields(size(fields)))
         output%snapshot_fields = fields
         if (case%friction%law == 'none' .and. any(is_tangential(output%snapshot_fields))) &
            call group%fault('snapshot_fields', 'traction, slip and displacement_x, displacement_y need '// &
            '&friction', faults)
      else
         output%snapshot_fields = [character(word_length) :: 'pressure', 'gap', 'displacement_z', 'contact', &
            'traction_x', 'traction_y', 'displacement_x', 'displacement_y', 'slip_x', 'slip_y']
         if (case%friction%law == 'none') output%snapshot_fields = pack(output%snapshot_fields, &
            .not. is_tangential(output%snapshot_fields))
      end if
      case%output = output
   end subroutine resolve_output

   !> Is this a field of friction?
   elemental logical function is_tangential(field)
      character(*), intent(in) :: field

      is_tangential = index(field, '_x') > 0 .or. index(field, '_y') > 0
   end function is_tangential

   !> The input's path with .h5 in place of its ending.
   pure function default_result(path) result(file)
      character(*), intent(in) :: path
      character(:), allocatable :: file
      integer :: point, slash

      slash = index(path, '/', back=.true.)
      point = index(path, '.', back=.true.)
      if (point > slash + 1) then
         file = path(:point - 1)//'.h5'
      else
         file = path//'.h5'
      end if
   end function default_result

end module case_input
