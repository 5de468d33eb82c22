!> Reads a case: a file of namelists becomes checked settings, or one error with all its faults.
module case_input
   use adhesion_advice, only : adhesion_warning, pull_off_warning
   use case_friction, only : resolve_friction, unused_variable
   use case_files, only : default_result
   use case_material, only : resolve_material
   use case_phases, only : resolve_phases
   use case_settings, only : case_type, output_settings_type, path_length, word_length
   use case_surfaces, only : resolve_path, resolve_surfaces
   use asperity_errors, only : error_type
   use asperity_parallel, only : is_first_process, share
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use input_reference, only : group_entries, group_entry_type
   use input_values, only : default_group, read_groups
   use asperity_precision, only : dp
   use process_agreement, only : agree
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use shear_laws, only : law_uses, law_variables
   use snapshot_fields, only : field_names, field_needs_friction
   use scale_warnings, only : cap_warning, load_warning, oblong_warning, rows_warning, steepness_warning
   use surface_warnings, only : find_warnings, warning_length
   use asperity_text_file, only : read_text_file
   use text_tools, only : to_text
   use transform_lengths, only : length_warning
   implicit none
   private

   public :: parse_case, read_case

contains

   !> Read a case from a file. If there are several processes, the first one reads the file, and all of them
   !> interpret the text. Collective.
   subroutine read_case(path, case, error)
      character(*), intent(in) :: path                         !! of the input file
      type(case_type), intent(out) :: case                     !! with defaults filled in
      type(error_type), allocatable, intent(out) :: error      !! all faults, one per line
      character(:), allocatable :: text

      if (is_first_process()) call read_text_file(path, text, error)
      call agree(error)
      if (allocated(error)) return
      call share(text)
      call parse_case(text, path, case, error)
      call agree(error)
      ! Only the first process has read the files of height maps, so that only it knows their warnings.
      if (.not. allocated(error)) call share(case%warnings)
   end subroutine read_case

   !> Read a case from a text.
   subroutine parse_case(text, path, case, error)
      character(*), intent(in) :: text                         !! of an input file, lines and all
      character(*), intent(in) :: path                         !! the file's name, for messages and results
      type(case_type), intent(out) :: case                     !! with defaults filled in
      type(error_type), allocatable, intent(out) :: error      !! all faults, one per line
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
      call resolve_friction(group, case%friction, faults)
      call pick(groups, 'adhesion', group)
      call resolve_phases(pack_phases(groups), case%grid, case%material, &
         case%adhesion%potential /= 'none' .or. group%bad('potential'), case%phases, faults, case%warnings)
      call check_pulls(pack_phases(groups), case, faults)
      call pick(groups, 'friction', group)
      call check_steady_law(group, case, faults)
      call pick(groups, 'solver', group)
      call resolve_solver(group, case, faults)
      call pick(groups, 'output', group)
      call resolve_output(group, case, faults)

      if (.not. allocated(faults%error)) then
         call note_unused(groups, case)
         call add_warnings(case)
      end if
      if (allocated(faults%error)) call move_alloc(faults%error, error)
   end subroutine parse_case

   !> Add the warnings about the grid, the surfaces, the number of rows and the adhesion.
   subroutine add_warnings(case)
      type(case_type), intent(inout) :: case
      character(warning_length), allocatable :: found(:)
      real(dp) :: mu
      integer :: i

      mu = 0.0_dp
      if (case%friction%law == 'coulomb' .and. case%friction%slope_effect) mu = case%friction%coefficient
      call find_warnings(case%grid, case%surfaces, mu, found)
      do i = 1, size(found)
         call add_warning(case, trim(found(i)))
      end do
      if (case%grid%boundary == boundary_periodic) then
         call add_warning(case, length_warning('nx', case%grid%nx, case%grid%ny))
         call add_warning(case, length_warning('ny', case%grid%ny, case%grid%nx))
      end if
      call add_warning(case, oblong_warning(case%grid))
      call add_warning(case, rows_warning(case%phases))
      call add_warning(case, load_warning(case%phases, case%material, case%grid))
      do i = 1, size(case%surfaces)
         call add_warning(case, steepness_warning(case%surfaces(i)))
         call add_warning(case, cap_warning(case%surfaces(i), case%grid))
      end do
      call add_warning(case, adhesion_warning(case))
      call add_warning(case, pull_off_warning(case))
   end subroutine add_warnings

   !> Warn of values that are given but have no effect.
   subroutine note_unused(groups, case)
      type(group_values_type), intent(in) :: groups(:)
      type(case_type), intent(inout) :: case
      type(group_values_type) :: group
      integer :: i

      call pick(groups, 'friction', group)
      do i = 1, size(law_variables)
         call add_warning(case, unused_variable(group, trim(case%friction%law), trim(law_variables(i))))
      end do
      call pick(groups, 'material', group)
      if (group%given('temperature') .and. .not. group%given('wlf_c1')) then
         if (abs(group%real_value('temperature') - group%real_value('reference_temperature')) > 0.0_dp) &
            call add_warning(case, '&material: temperature = '// &
            to_text(group%real_value('temperature'))//' has no effect: a shift of the relaxation times needs '// &
            'wlf_c1 and wlf_c2')
      end if
   end subroutine note_unused

   !> Add a line to the warnings, unless it is empty.
   subroutine add_warning(case, line)
      type(case_type), intent(inout) :: case
      character(*), intent(in) :: line

      if (line == '') return
      if (case%warnings /= '') case%warnings = case%warnings//new_line('a')
      case%warnings = case%warnings//line
   end subroutine add_warning

   !> Report groups that are missing.
   subroutine check_presence(groups, faults)
      type(group_values_type), intent(in) :: groups(:)
      type(faults_type), intent(inout) :: faults
      type(group_entry_type), allocatable :: known(:)
      integer :: i

      allocate (known, source=group_entries())
      do i = 1, size(known)
         if (.not. known(i)%required .or. any(groups%name == known(i)%name)) cycle
         call faults%add('&'//trim(known(i)%name), 'the group is missing')
      end do
   end subroutine check_presence

   !> The first group of a name, or a group of defaults.
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

   !> Check that there is friction if a force pulls the road.
   subroutine check_pulls(groups, case, faults)
      type(group_values_type), intent(in) :: groups(:)   !! the phases
      type(case_type), intent(in) :: case
      type(faults_type), intent(inout) :: faults
      character(*), parameter :: names(4) = [character(10) :: 'traction_x', 'traction_y', 'force_x', 'force_y']
      integer :: i, k

      if (case%friction%law /= 'none') return
      do k = 1, size(groups)
         do i = 1, size(names)
            if (groups(k)%given(trim(names(i)))) call groups(k)%fault(trim(names(i)), &
               'needs &friction with a law: without friction nothing holds the road', faults)
         end do
      end do
   end subroutine check_pulls

   !> Refuse a coefficient with which the rubber could hardly slide, if a phase is steady. With a huge one the sums of
   !> the solver would overflow.
   subroutine check_steady_law(group, case, faults)
      type(group_values_type), intent(in) :: group     !! friction
      type(case_type), intent(in) :: case
      type(faults_type), intent(inout) :: faults
      real(dp), parameter :: most = 1000.0_dp

      if (group%bad('coefficient') .or. .not. law_uses(case%friction%law, 'coefficient')) return
      if (any(case%phases%steady) .and. case%friction%coefficient > most) call group%fault('coefficient', &
         'must be at most 1000 with a steady phase: the rubber could hardly slide', faults)
   end subroutine check_steady_law

   !> Resolve the group `&grid`.
   subroutine resolve_grid(group, grid, known, faults)
      type(group_values_type), intent(in) :: group
      type(grid_type), intent(out) :: grid
      logical, intent(out) :: known                    !! the grid is valid, so that other checks can use it
      type(faults_type), intent(inout) :: faults
      integer :: boundary, nx, ny
      real(dp) :: lx, ly

      call group%demand('nx', faults)
      call group%demand('ny', faults)
      call group%demand('lx', faults)
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
         call group%fault('nx', 'with ny = '//to_text(ny)//': nx times ny must be at most '//to_text(huge(1)), faults)
         known = .false.
         return
      end if
      ly = group%real_value('ly', lx*ny/nx)
      grid = new_grid(nx, ny, lx, ly, boundary)
      known = grid%dx > 0.0_dp .and. grid%dy > 0.0_dp .and. grid%dx*grid%dy > 0.0_dp .and. &
         lx*ly <= huge(1.0_dp)
      if (.not. known) call group%fault('lx', 'makes cells whose area is too large or too small for a '// &
         'number in double precision', faults)
      if (.not. known) grid = grid_type()
   end subroutine resolve_grid

   !> Resolve the group `&adhesion`.
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
         call group%demand('energy', faults, trim(case%adhesion%potential))
         call group%demand('range', faults, trim(case%adhesion%potential))
      else if (.not. group%given('potential') .and. &
         (group%given('energy') .or. group%given('range') .or. group%given('start'))) then
         call group%fault('potential', 'is missing', faults)
      end if
   end subroutine resolve_adhesion

   !> Resolve the group `&solver`.
   subroutine resolve_solver(group, case, faults)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case
      type(faults_type), intent(inout) :: faults

      case%solver%tolerance = group%real_value('tolerance')
      case%solver%max_iterations = group%integer_value('max_iterations')
      case%solver%method = group%text_value('method')
      case%solver%time_scheme = group%text_value('time_scheme')
      case%solver%passes = group%integer_value('passes')
      case%solver%coupling_tolerance = group%real_value('coupling_tolerance')
      case%solver%slip_law = group%text_value('slip_law')
      case%solver%interpolation = group%text_value('interpolation')
      case%solver%precision = group%text_value('precision')
      case%solver%threads = group%integer_value('threads')
      if (case%solver%method == 'thesis' .and. case%solver%precision == 'mixed') &
         call group%fault('precision', 'needs method = ''fast''; ''thesis'' works in double precision', &
         faults)
      if (case%solver%method == 'thesis' .and. case%adhesion%potential /= 'none' .and. &
         case%grid%boundary == boundary_free) call group%fault('method', &
         'with &adhesion needs boundary = ''periodic''; ''fast'' serves both', faults)
   end subroutine resolve_solver

   !> Resolve the group `&output`.
   subroutine resolve_output(group, case, faults)
      type(group_values_type), intent(in) :: group
      type(case_type), intent(inout) :: case
      type(faults_type), intent(inout) :: faults
      type(output_settings_type) :: output
      character(path_length), allocatable :: fields(:)
      character(24), allocatable :: names(:)
      real(dp) :: finish
      integer :: i

      call resolve_path(group, case%path, output%file, faults)
      if (.not. group%given('file')) output%file = default_result(case%path)
      case%output%file = output%file
      output%snapshot_every = group%integer_value('snapshot_every')
      output%snapshot_times = group%reals_value('snapshot_times')
      output%checkpoint_every = group%integer_value('checkpoint_every')
      output%checkpoint_minutes = group%real_value('checkpoint_minutes')
      output%compression = group%integer_value('compression')

      if (group%given('snapshot_every') .and. group%given('snapshot_times')) call group%group_fault( &
         'snapshot_every and snapshot_times are given together: give one of them', faults)
      if (size(output%snapshot_times) > 0 .and. .not. allocated(faults%error)) then
         finish = sum(case%phases%duration)
         if (any(output%snapshot_times > finish*(1.0_dp + 1.0e-9_dp))) call group%fault('snapshot_times', &
            'must be within the run, which ends at '//to_text(finish)//' s', faults)
         do i = 2, size(output%snapshot_times)
            if (output%snapshot_times(i) > output%snapshot_times(i - 1)) cycle
            call group%fault('snapshot_times', 'must increase', faults)
            exit
         end do
      end if

      if (group%given('snapshot_fields')) then
         allocate (fields, source=group%texts_value('snapshot_fields'))
         allocate (output%snapshot_fields(size(fields)))
         output%snapshot_fields = fields(:)(:word_length)
         do i = 2, size(fields)
            if (all(fields(:i - 1) /= fields(i))) cycle
            call group%fault('snapshot_fields', 'must name each field once', faults)
            exit
         end do
         if (case%friction%law == 'none' .and. any(field_needs_friction(output%snapshot_fields))) &
            call group%fault('snapshot_fields', 'traction, slip and displacement_x, displacement_y need '// &
            '&friction', faults)
      else
         names = field_names(case%friction%law /= 'none')
         allocate (output%snapshot_fields(size(names)))
         output%snapshot_fields = names
      end if
      case%output = output
   end subroutine resolve_output

end module case_input
