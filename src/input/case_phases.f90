!> The phases of a case: their loads, which may be inherited from the phase before, and their time steps.
!>
!> Default time step: if the road slides, it moves by one cell per step, so that the height map is shifted by
!> whole cells (thesis, 2.2.2). If it rests, the step is an eighth of the shortest active relaxation time, with
!> at least 20 steps. An arm is active in a phase if its relaxation time is above a thousandth of the
!> duration; faster arms are practically always relaxed.
module case_phases
   use case_settings, only : material_settings_type, phase_settings_type
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use text_tools, only : add_line, to_text
   implicit none
   private

   public :: resolve_phases

   real(dp), parameter, public :: most_cells_per_step = 1.5_dp  !! motion of the road up to which nothing is warned of

   real(dp), parameter :: most_steps = 1.0e9_dp
   real(dp), parameter :: most_rows = 2.0e9_dp                  !! of all phases: below 2^31
   character(*), parameter :: one_cell = 'for one cell per step'   !! reason for a time step
   character(*), parameter :: loads(3) = [character(12) :: 'pressure', 'force', 'displacement']

contains

   !> Resolve all phases, in the order of the input.
   subroutine resolve_phases(groups, grid, material, adhesive, phases, faults, warnings)
      type(group_values_type), intent(in) :: groups(:)        !! only the phases
      type(grid_type), intent(in) :: grid                     !! nx = 0: not known
      type(material_settings_type), intent(in) :: material
      logical, intent(in) :: adhesive                         !! loads of 0 or less are allowed
      type(phase_settings_type), allocatable, intent(out) :: phases(:)
      type(faults_type), intent(inout) :: faults
      character(:), allocatable, intent(inout) :: warnings    !! one per line
      real(dp) :: rows
      integer :: i

      rows = 0.0_dp
      allocate (phases(size(groups)))
      do i = 1, size(groups)
         associate (group => groups(i), phase => phases(i))
            phase%name = 'phase '//to_text(i)
            if (group%given('name')) phase%name = group%text_value('name')
            if (len(group%text_value('name')) > len(phase%name)) &
               call group%fault('name', 'must have at most '//to_text(len(phase%name))//' characters', faults)

            phase%duration = group%real_value('duration')
            phase%static = .not. phase%duration > 0.0_dp .and. .not. group%bad('duration')
            phase%linear = group%text_value('ramp') == 'linear'
            phase%relaxed = group%logical_value('relaxed')
            phase%steady = group%logical_value('steady')
            phase%velocity_x = group%real_value('velocity_x')
            phase%velocity_y = group%real_value('velocity_y')

            call resolve_pull(group, grid, phase, faults)
            if (i == 1) then
               call resolve_load(group, phase, faults)
            else
               call resolve_load(group, phase, faults, phases(i - 1))
            end if

            call warn_of_other_loads(i, group, phase, warnings)
            call check_load(group, phase, adhesive, faults)
            call check_combination(group, phase, material, faults)
            if (phase%steady) call check_steady(group, phase, grid, material, adhesive, faults)
            call resolve_steps(group, phase, grid, material, faults)
            call warn_of_steps(i, phase, grid, material, warnings)

            rows = rows + phase%steps + 1.0_dp
            if (rows > most_rows .and. rows - phase%steps - 1.0_dp <= most_rows) &
               call group%group_fault('the phases up to this one have '//to_text(rows)// &
               ' rows: at most 2e9 are allowed', faults)
         end associate
      end do
   end subroutine resolve_phases

   !> Find the control and the target: as given, derived from the given load, or those of the phase before.
   subroutine resolve_load(group, phase, faults, before)
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(inout) :: phase
      type(faults_type), intent(inout) :: faults
      type(phase_settings_type), intent(in), optional :: before
      integer :: i
      logical :: named(3)
      character(:), allocatable :: list

      phase%control = ''
      phase%target = 0.0_dp
      phase%given = .false.
      named = [(group%given(trim(loads(i))), i = 1, 3)]
      if (group%bad('control')) return

      if (group%given('control')) then
         phase%control = group%text_value('control')
         if (group%given(trim(phase%control))) then
            phase%target = group%real_value(trim(phase%control))
            phase%given = .true.
            return
         end if
         if (present(before)) then
            if (before%control == phase%control .and. .not. any(named)) then
               phase%target = before%target
               return
            end if
         end if
         call group%fault('control', 'needs '//trim(phase%control)//' in the same phase', faults)
      else if (count(named) > 1) then
         list = ''
         do i = 1, 3
            if (.not. named(i)) cycle
            if (list /= '') list = list//' and '
            list = list//trim(loads(i))
         end do
         call group%group_fault(list//' are given together: give one of them, or set control '// &
            'to the one that is prescribed', faults)
      else if (count(named) == 1) then
         i = findloc(named, .true., dim=1)
         phase%control = loads(i)
         phase%target = group%real_value(trim(loads(i)))
         phase%given = .true.
      else if (present(before)) then
         phase%control = before%control
         phase%target = before%target
      else
         call group%group_fault('pressure, force or displacement is missing: the first phase must give '// &
            'one of them', faults)
      end if
   end subroutine resolve_load

   !> Warn of loads that have no effect, because `control` names another one.
   subroutine warn_of_other_loads(number, group, phase, warnings)
      integer, intent(in) :: number                            !! of the phase
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(in) :: phase
      character(:), allocatable, intent(inout) :: warnings
      integer :: i

      if (.not. group%given('control') .or. phase%control == '') return
      do i = 1, size(loads)
         if (loads(i) == phase%control .or. .not. group%usable(trim(loads(i)))) cycle
         call add_line(warnings, '&phase '//to_text(number)//': '//trim(loads(i))//' = '// &
            to_text(group%real_value(trim(loads(i))))//' has no effect: control = '''//trim(phase%control)// &
            ''' does not use it')
      end do
   end subroutine warn_of_other_loads

   !> Read the force that pulls the road along each direction, if one is given instead of a velocity.
   subroutine resolve_pull(group, grid, phase, faults)
      type(group_values_type), intent(in) :: group
      type(grid_type), intent(in) :: grid
      type(phase_settings_type), intent(inout) :: phase
      type(faults_type), intent(inout) :: faults
      character(*), parameter :: axes(2) = ['x', 'y']
      character(:), allocatable :: force, name, traction, velocity
      integer :: c

      phase%pulled = .false.
      phase%pull = 0.0_dp
      do c = 1, 2
         traction = 'traction_'//axes(c)
         force = 'force_'//axes(c)
         velocity = 'velocity_'//axes(c)
         if (.not. (group%given(traction) .or. group%given(force))) cycle
         name = traction
         if (group%given(force)) name = force
         phase%pulled(c) = .true.
         if (group%given(traction) .and. group%given(force)) call group%group_fault(traction//' and '// &
            force//' are given together: give one of them', faults)
         if (group%given(velocity)) call group%fault(name, 'excludes '//velocity//': where a force '// &
            'pulls the road, its motion is computed', faults)
         if (phase%relaxed) call group%fault(name, 'excludes relaxed = .true.: hold the pull for a '// &
            'phase that is longer than the relaxation times instead', faults)
         if (phase%steady) call group%fault(name, 'excludes steady = .true., which needs a velocity', faults)
         if (group%bad(name)) cycle
         phase%pull(c) = group%real_value(name)
         if (name == force .and. grid%nx > 0) phase%pull(c) = phase%pull(c)/grid%area()
      end do
   end subroutine resolve_pull

   !> Check that the load is positive, unless there is adhesion.
   subroutine check_load(group, phase, adhesive, faults)
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(in) :: phase
      logical, intent(in) :: adhesive
      type(faults_type), intent(inout) :: faults

      if (adhesive .or. .not. phase%given .or. phase%control == 'displacement') return
      if (group%bad(trim(phase%control)) .or. phase%target > 0.0_dp) return
      call group%fault(trim(phase%control), 'must be a positive number; 0 or less is allowed with '// &
         '&adhesion only. To lift the rubber off without adhesion, give displacement = 0 or less', faults)
   end subroutine check_load

   !> Check settings that exclude or need one another.
   subroutine check_combination(group, phase, material, faults)
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(in) :: phase
      type(material_settings_type), intent(in) :: material
      type(faults_type), intent(inout) :: faults
      character(*), parameter :: timed(3) = [character(10) :: 'dt', 'velocity_x', 'velocity_y']
      integer :: i

      if (phase%relaxed .and. phase%linear) call group%fault('relaxed', &
         'excludes ramp = ''linear'': under a load that changes the rubber is not relaxed', faults)
      if (phase%relaxed .and. size(material%prony_g) > 0 .and. .not. material%shear_modulus > 0.0_dp) &
         call group%fault('relaxed', 'needs a long-term shear modulus above 0: this material flows', faults)
      if (.not. phase%static) return
      do i = 1, size(timed)
         if (.not. group%usable(trim(timed(i)))) cycle
         if (i > 1 .and. (phase%steady .or. abs(group%real_value(trim(timed(i)))) <= 0.0_dp)) cycle
         call group%fault(trim(timed(i)), 'needs a duration: a phase without one is one static solve', &
            faults)
      end do
      if (group%usable('steps') .and. .not. phase%linear) then
         if (group%integer_value('steps') > 1) call group%fault('steps', &
            'needs a duration, or ramp = ''linear'' for a series of static solves up to the load', faults)
      end if
   end subroutine check_combination

   !> Check the settings that a steady phase excludes or needs.
   subroutine check_steady(group, phase, grid, material, adhesive, faults)
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(in) :: phase
      type(grid_type), intent(in) :: grid
      type(material_settings_type), intent(in) :: material
      logical, intent(in) :: adhesive
      type(faults_type), intent(inout) :: faults

      if (phase%relaxed) call group%fault('steady', &
         'excludes relaxed = .true.: the road has either slid or rested for an infinite time; with a '// &
         'velocity of zero steady means the same as relaxed', faults)
      if (phase%linear) call group%fault('steady', &
         'excludes ramp = ''linear'': the load of a steady state is constant', faults)
      if (phase%control == 'displacement') call group%fault('steady', &
         'excludes control = ''displacement'': give pressure or force', faults)
      if (grid%nx > 0 .and. grid%boundary /= boundary_periodic) call group%fault('steady', &
         'needs &grid boundary = ''periodic''', faults)
      if (adhesive) call group%fault('steady', 'needs &adhesion potential = ''none''', faults)
      if (size(material%prony_g) > 0 .and. .not. material%shear_modulus > 0.0_dp) &
         call group%fault('steady', 'needs a long-term shear modulus above 0: this material flows', faults)
   end subroutine check_steady

   !> Find the number of steps and the time step.
   subroutine resolve_steps(group, phase, grid, material, faults)
      type(group_values_type), intent(in) :: group
      type(phase_settings_type), intent(inout) :: phase
      type(grid_type), intent(in) :: grid
      type(material_settings_type), intent(in) :: material
      type(faults_type), intent(inout) :: faults
      real(dp) :: dt, cells
      real(dp), parameter :: same = 1.0e-6_dp       !! relative difference of times that count as equal

      phase%steps = 1
      phase%dt = 0.0_dp
      phase%dt_reason = 'static'
      if (group%bad('steps') .or. group%bad('dt')) return
      if (phase%static .and. group%given('steps')) phase%steps = group%integer_value('steps')
      if (phase%static .or. .not. phase%duration > 0.0_dp) return

      if (group%given('steps')) then
         phase%steps = group%integer_value('steps')
         phase%dt_reason = 'steps given'
         dt = phase%duration/phase%steps
         if (group%given('dt')) then
            if (abs(group%real_value('dt') - dt) > same*dt) call group%fault('dt', &
               'does not agree with steps = '//to_text(phase%steps)//', which makes steps of '// &
               to_text(dt)//' s in a duration of '//to_text(phase%duration)//' s: give one of them', faults)
         end if
      else if (group%given('dt')) then
         dt = group%real_value('dt')
         phase%dt_reason = 'dt given'
         if (dt > phase%duration*(1.0_dp + same)) call group%fault('dt', &
            'must be at most the duration, '//to_text(phase%duration)//' s', faults)
      else
         if (group%bad('velocity_x') .or. group%bad('velocity_y')) return
         call default_step(phase, grid, material, dt)
      end if

      if (phase%duration/dt > most_steps) then
         call group%group_fault('a time step of '//to_text(dt)//' s in a duration of '// &
            to_text(phase%duration)//' s needs more than 1e9 steps: give steps or a longer dt', faults)
         return
      end if
      if (.not. group%given('steps')) phase%steps = max(1, nint(phase%duration/dt))
      phase%dt = phase%duration/phase%steps
      if (grid%nx == 0) return
      cells = cells_per_step(phase, grid)
      if (phase%dt_reason == one_cell .and. abs(cells - 1.0_dp) < 1.0e-3_dp) return
      if (cells > 0.0_dp) phase%dt_reason = trim(phase%dt_reason)//', '//to_text(cells)// &
         trim(merge(' cell ', ' cells', to_text(cells) == '1'))//' per step'
   end subroutine resolve_steps

   !> Distance by which a step moves the road, in cells.
   pure real(dp) function cells_per_step(phase, grid) result(cells)
      type(phase_settings_type), intent(in) :: phase
      type(grid_type), intent(in) :: grid

      cells = abs(phase%velocity_x)/grid%dx*phase%dt
      if (grid%ny > 1) cells = max(cells, abs(phase%velocity_y)/grid%dy*phase%dt)
   end function cells_per_step

   !> The default time step.
   subroutine default_step(phase, grid, material, dt)
      type(phase_settings_type), intent(inout) :: phase
      type(grid_type), intent(in) :: grid
      type(material_settings_type), intent(in) :: material
      real(dp), intent(out) :: dt
      integer, parameter :: fewest = 20           !! steps of a phase at rest
      real(dp), parameter :: fraction = 8.0_dp    !! steps in a relaxation time
      real(dp) :: rate, tau

      dt = phase%duration/fewest
      if (grid%nx > 0) then
         rate = abs(phase%velocity_x)/grid%dx               ! cells per second
         if (grid%ny > 1) rate = max(rate, abs(phase%velocity_y)/grid%dy)
         if (rate > 0.0_dp) then
            dt = 1.0_dp/rate
            phase%dt_reason = one_cell
            return
         end if
      end if

      phase%dt_reason = to_text(fewest)//' steps'
      tau = shortest_active(phase, material)
      if (tau > 0.0_dp .and. tau/fraction < dt) then
         dt = tau/fraction
         phase%dt_reason = 'an eighth of the relaxation time '//to_text(tau)//' s'
      end if
   end subroutine default_step

   !> The shortest relaxation time above a thousandth of the phase, s; 0 if there is none.
   pure real(dp) function shortest_active(phase, material) result(tau)
      type(phase_settings_type), intent(in) :: phase
      type(material_settings_type), intent(in) :: material
      real(dp), parameter :: relaxed_at_once = 1.0e-3_dp

      tau = 0.0_dp
      if (any(material%prony_tau > relaxed_at_once*phase%duration)) &
         tau = minval(material%prony_tau, mask=material%prony_tau > relaxed_at_once*phase%duration)
   end function shortest_active

   !> Warn if the time step is too long.
   subroutine warn_of_steps(number, phase, grid, material, warnings)
      integer, intent(in) :: number                            !! of the phase
      type(phase_settings_type), intent(in) :: phase
      type(grid_type), intent(in) :: grid
      type(material_settings_type), intent(in) :: material
      character(:), allocatable, intent(inout) :: warnings
      real(dp) :: cells, tau

      if (phase%static .or. grid%nx == 0) return
      cells = cells_per_step(phase, grid)
      if (cells > most_cells_per_step) call warn('a step moves the road by '//to_text(cells)// &
         ' cells; to resolve the contact, move it by at most one cell per step, dt = '// &
         to_text(phase%dt/cells)//' s')
      tau = shortest_active(phase, material)
      if (tau > 0.0_dp .and. .not. cells > 0.0_dp) then
         if (phase%dt > tau) call warn('dt = '//to_text(phase%dt)// &
            ' s is longer than the shortest active relaxation time, '//to_text(tau)//' s')
      end if

   contains

      !> Add a line.
      subroutine warn(message)
         character(*), intent(in) :: message

         if (warnings /= '') warnings = warnings//new_line('a')
         warnings = warnings//'&phase '//to_text(number)//': '//message
      end subroutine warn

   end subroutine warn_of_steps

end module case_phases
