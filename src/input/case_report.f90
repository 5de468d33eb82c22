!> A case as text: every resolved setting as a new input, with the time steps and the memory as comments.
module case_report
   use adhesion_advice, only : adhesion_notes
   use asperity_parallel, only : process_count, processes_of_machine
   use case_files, only : default_result
   use footprint_advice, only : footprint_note
   use case_settings, only : case_type, phase_settings_type
   use case_time, only : duration_text, seconds_needed
   use case_memory, only : joint_memory, memory_needed, most_snapshots, result_size
   use memory_limits, only : memory_limit, memory_text
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free
   use shear_laws, only : law_uses
   use surface_settings, only : real_variable, surface_settings_type
   use surface_shapes, only : find_shape, shape_type
   use text_tools, only : exact_text, in_quotes, to_text
   implicit none
   private

   public :: case_summary, check_report, control_units, resolved_input

   character(*), parameter :: nl = new_line('a')

contains

   !> Every setting, given or default, as a namelist input for the same case. Paths are relative to the present
   !> folder of the program; relaxation times are those at the temperature of the case.
   function resolved_input(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      integer :: i

      text = '&case'//nl//string('title', case%title)//'/'//nl
      text = text//'&grid'//nl//whole('nx', case%grid%nx)//whole('ny', case%grid%ny)// &
         number('lx', case%grid%lx, 'm')//number('ly', case%grid%ly, 'm')// &
         string('boundary', boundary_name(case))//'/'//nl
      do i = 1, size(case%surfaces)
         text = text//surface_text(case, i)
      end do
      associate (m => case%material)
         text = text//'&material'//nl//number('poisson', m%poisson, '')// &
            number('shear_modulus', m%shear_modulus, 'Pa')
         if (size(m%prony_g) > 0) text = text//list('prony_g', m%prony_g, 'Pa')// &
            list('prony_tau', m%prony_tau, 's, at '//to_text(m%temperature)//' C')
         text = text//number('thickness', m%thickness, 'm')//number('density', m%density, 'kg/m3')// &
            number('temperature', m%temperature, 'C')// &
            number('reference_temperature', m%temperature, 'C')//'/'//nl
      end associate
      text = text//laws_text(case)
      do i = 1, size(case%phases)
         text = text//phase_text(case%phases(i))
      end do
      text = text//solver_text(case)
   end function resolved_input

   !> What `asperity check` prints: the resolved input and a summary, as an input for other runs. A name of the result that
   !> follows from that of the input is only a comment: a copy of the input with another name must not replace the result of
   !> this one.
   function check_report(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      character(:), allocatable :: named
      integer :: at

      text = resolved_input(case)
      if (case%output%file == default_result(case%path)) then
         named = '&output'//nl//string('file', case%output%file)
         at = index(text, named, back=.true.)
         text = text(:at - 1)//'&output'//nl//'  ! file = '//in_quotes(trim(case%output%file))// &
            ', after the name of the input'//nl//text(at + len(named):)
      end if
      text = text//case_summary(case)
   end function check_report

   !> The steps, the memory, the size of the result, the effect of adhesion and the warnings as comment lines.
   function case_summary(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text

      text = '! cells of '//to_text(case%grid%dx)//' m by '//to_text(case%grid%dy)//' m'//nl
      text = text//'! '//counted(size(case%phases), 'phase')//', '
      if (any(case%phases%steady)) text = text//counted(count(case%phases%steady), 'steady state')//', '
      text = text//counted(count(case%phases%static .and. .not. case%phases%steady), 'static solve')//', '// &
         counted(sum(case%phases%steps, mask=.not. case%phases%static), 'time step')//' in '// &
         to_text(sum(case%phases%duration))//' s'//nl
      text = text//memory_note(case)//joint_note(case)
      text = text//'! result: about '//memory_text(result_size(case))//' with '// &
         counted(most_snapshots(case), 'snapshot')//', before compression'//nl
      text = text//'! time: '//duration_text(seconds_needed(case))//' on this machine, to within a factor of about three'
      if (case%friction%law /= 'none' .and. case%friction%slope_effect) text = text//'; rows on steep roads may take '// &
         'ten times as long'
      text = text//nl
      text = text//marked('! ', adhesion_notes(case))// &
         marked('! note: ', footprint_note(case))//marked('! warning: ', case%warnings)
   end function case_summary

   !> The memory that the run takes on this machine, and a warning if the machine has less, as comment lines.
   function memory_note(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      character(:), allocatable :: whose
      real(dp) :: each, here, limit

      each = memory_needed(case, case%grid%most_rows())
      here = processes_of_machine()*each
      limit = memory_limit(whose)
      text = '! memory: about '//memory_text(here)
      if (process_count() > 1) text = text//' on this machine, '//memory_text(each)//' for each of '// &
         to_text(process_count())//' processes'
      text = text//nl
      if (here > limit) text = text//'! warning: the run needs more memory than '//whose//': '//memory_text(limit)//nl
   end function memory_note

   !> What is solved for all cells at once if it must be, the memory that this takes, and what is lost without that
   !> memory, as a comment line. Empty if the case has nothing of this kind.
   function joint_note(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text

      text = ''
      if (.not. joint_memory(case) > 0.0_dp) return
      if (case%friction%law == 'none') then
         text = '! A steady row that converges slowly'
      else
         text = '! A row whose pressure and friction settle slowly'
      end if
      text = text//' is solved in all cells at once, which takes up to '//memory_text(joint_memory(case))//' more. '// &
         'Without this memory the run continues, but such a row may not converge, which ends the run with status 4'//nl
   end function joint_note

   !> Put a mark before each line.
   pure function marked(mark, lines) result(text)
      character(*), intent(in) :: mark, lines
      character(:), allocatable :: text
      integer :: at, next

      text = ''
      at = 1
      do while (at <= len(lines))
         next = index(lines(at:)//nl, nl)
         text = text//mark//lines(at:at + next - 2)//nl
         at = at + next
      end do
   end function marked

   !> One `&surface`, with the variables that its shape uses.
   function surface_text(case, i) result(text)
      type(case_type), intent(in) :: case
      integer, intent(in) :: i
      character(:), allocatable :: text
      type(shape_type) :: shape
      integer :: n

      shape = find_shape(case%surfaces(i)%shape)
      text = '&surface'//nl//string('shape', case%surfaces(i)%shape)
      do n = 1, size(shape%variables)
         text = text//surface_variable(case%surfaces(i), trim(shape%variables(n)))
      end do
      text = text//'/'//nl
   end function surface_text

   !> One variable of a `&surface`; empty for a blank name.
   function surface_variable(term, name) result(text)
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: name
      character(:), allocatable :: text

      select case (name)
      case ('')
         text = ''
      case ('seed')
         text = whole(name, term%seed)
      case ('generator')
         text = string(name, term%generator)
      case ('file')
         text = string(name, term%file)
      case ('dataset')
         text = string(name, term%dataset)
      case ('hurst', 'scale')
         text = number(name, real_variable(term, name), '')
      case ('rms_height', 'rms_slope')            ! one of the two is given
         text = ''
         if (real_variable(term, name) > 0.0_dp) &
            text = number(name, real_variable(term, name), merge('m', ' ', name == 'rms_height'))
      case default
         text = number(name, real_variable(term, name), 'm')
      end select
   end function surface_variable

   !> The groups `&adhesion` and `&friction`.
   function laws_text(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text

      text = '&adhesion'//nl//string('potential', case%adhesion%potential)
      if (case%adhesion%potential /= 'none') text = text//number('energy', case%adhesion%energy, 'J/m2')// &
         number('range', case%adhesion%range, 'm')//string('start', case%adhesion%start)
      text = text//'/'//nl//'&friction'//nl//string('law', case%friction%law)
      if (law_uses(case%friction%law, 'coefficient')) &
         text = text//number('coefficient', case%friction%coefficient, '')
      if (law_uses(case%friction%law, 'shear_strength')) &
         text = text//number('shear_strength', case%friction%shear_strength, 'Pa')
      if (allocated(case%friction%table)) text = text// &
         list('table_pressure', case%friction%table(:, 1), 'Pa')// &
         list('table_strength', case%friction%table(:, 2), 'Pa')
      if (case%friction%law /= 'none') text = text//truth('slope_effect', case%friction%slope_effect)
      text = text//'/'//nl
   end function laws_text

   !> One `&phase`.
   function phase_text(phase) result(text)
      type(phase_settings_type), intent(in) :: phase
      character(:), allocatable :: text

      text = '&phase'//nl//string('name', phase%name)//number('duration', phase%duration, 's')
      if (.not. phase%static) text = text//line('steps', to_text(phase%steps), 'dt = '// &
         to_text(phase%dt)//' s: '//trim(phase%dt_reason))
      if (phase%static .and. phase%steps > 1) text = text//whole('steps', phase%steps)
      text = text//string('control', phase%control)
      if (phase%given) then
         text = text//number(trim(phase%control), phase%target, control_units(phase%control))
      else
         text = text//'  ! '//trim(phase%control)//' as in the phase before: '//to_text(phase%target)//' '// &
            control_units(phase%control)//nl
      end if
      text = text//string('ramp', merge('linear', 'step  ', phase%linear))//truth('relaxed', phase%relaxed)// &
         truth('steady', phase%steady)//drive_text('x', phase%velocity_x, phase%pulled(1), phase%pull(1))// &
         drive_text('y', phase%velocity_y, phase%pulled(2), phase%pull(2))//'/'//nl
   end function phase_text

   !> The velocity of the road along an axis, or the traction that pulls it.
   function drive_text(axis, velocity, pulled, pull) result(text)
      character, intent(in) :: axis
      real(dp), intent(in) :: velocity, pull
      logical, intent(in) :: pulled
      character(:), allocatable :: text

      if (pulled) then
         text = number('traction_'//axis, pull, 'Pa')
      else
         text = number('velocity_'//axis, velocity, 'm/s')
      end if
   end function drive_text

   !> The groups `&solver` and `&output`.
   function solver_text(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      character(:), allocatable :: fields
      integer :: i

      associate (s => case%solver, o => case%output)
         text = '&solver'//nl//number('tolerance', s%tolerance, '')// &
            whole('max_iterations', s%max_iterations)//string('method', s%method)// &
            string('time_scheme', s%time_scheme)//whole('passes', s%passes)// &
            number('coupling_tolerance', s%coupling_tolerance, '')//string('slip_law', s%slip_law)// &
            string('interpolation', s%interpolation)//string('precision', s%precision)// &
            whole('threads', s%threads)//'/'//nl
         text = text//'&output'//nl//string('file', o%file)
         if (size(o%snapshot_times) > 0) then
            text = text//list('snapshot_times', o%snapshot_times, 's')
         else
            text = text//whole('snapshot_every', o%snapshot_every)
         end if
         fields = ''
         do i = 1, size(o%snapshot_fields)
            if (i > 1) fields = fields//', '
            fields = fields//''''//trim(o%snapshot_fields(i))//''''
         end do
         text = text//line('snapshot_fields', fields, '')//whole('checkpoint_every', o%checkpoint_every)// &
            number('checkpoint_minutes', o%checkpoint_minutes, 'min')// &
            whole('compression', o%compression)//'/'//nl
      end associate
   end function solver_text

   pure function boundary_name(case) result(name)
      type(case_type), intent(in) :: case
      character(:), allocatable :: name

      name = 'periodic'
      if (case%grid%boundary == boundary_free) name = 'free'
   end function boundary_name

   !> The unit of the load of a phase.
   pure function control_units(control) result(units)
      character(*), intent(in) :: control
      character(:), allocatable :: units

      select case (control)
      case ('pressure')
         units = 'Pa'
      case ('force')
         units = 'N'
      case default
         units = 'm'
      end select
   end function control_units

   !> `1 phase`, `2 phases`
   pure function counted(n, what) result(text)
      integer, intent(in) :: n
      character(*), intent(in) :: what
      character(:), allocatable :: text

      text = to_text(n)//' '//what
      if (n /= 1) text = text//'s'
   end function counted

   !> `  name = value  ! comment`
   pure function line(name, value, comment) result(text)
      character(*), intent(in) :: name, value, comment
      character(:), allocatable :: text

      text = '  '//name//' = '//value
      if (comment /= '') text = text//'  ! '//comment
      text = text//nl
   end function line

   pure function whole(name, value) result(text)
      character(*), intent(in) :: name
      integer, intent(in) :: value
      character(:), allocatable :: text

      text = line(name, to_text(value), '')
   end function whole

   pure function number(name, value, units) result(text)
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      character(:), allocatable :: text

      text = line(name, exact_text(value), units)
   end function number

   pure function list(name, values, units) result(text)
      character(*), intent(in) :: name
      real(dp), intent(in) :: values(:)
      character(*), intent(in) :: units
      character(:), allocatable :: text
      character(:), allocatable :: all_values
      integer :: i

      all_values = ''
      do i = 1, size(values)
         if (i > 1) all_values = all_values//', '
         all_values = all_values//exact_text(values(i))
      end do
      text = line(name, all_values, units)
   end function list

   pure function truth(name, value) result(text)
      character(*), intent(in) :: name
      logical, intent(in) :: value
      character(:), allocatable :: text

      text = line(name, trim(merge('.true. ', '.false.', value)), '')
   end function truth

   !> A string in quotes; a quote inside is doubled.
   pure function string(name, value) result(text)
      character(*), intent(in) :: name, value
      character(:), allocatable :: text

      text = line(name, in_quotes(trim(value)), '')
   end function string

end module case_report
