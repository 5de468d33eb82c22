!> Tests of `case_input`: resolved values of good inputs, and every fault of bad ones.
module test_case_input
   use case_input, only : parse_case, read_case
   use case_memory, only : joint_memory, memory_needed, most_snapshots
   use case_report, only : case_summary, resolved_input
   use case_settings, only : case_type
   use case_templates, only : all_template_names, template_is_available, template_list, template_text
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_errors, only : error_file, error_input, error_type
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free
   implicit none
   private

   public :: run_case_input

   character(*), parameter :: nl = new_line('a')
   character(*), parameter :: grid = '&grid nx = 64, ny = 32, lx = 2e-3 /'//nl
   character(*), parameter :: sphere = '&surface shape = ''sphere'', radius = 0.01 /'//nl
   character(*), parameter :: steel = '&material shear_modulus = 1e6 /'//nl
   character(*), parameter :: press = '&phase pressure = 1e5 /'//nl
   character(*), parameter :: body = grid//sphere//steel//press

contains

   subroutine run_case_input()
      call begin_suite('case_input')
      if (selected('defaults_of_a_short_input')) call defaults_of_a_short_input()
      if (selected('values_in_all_forms_of_fortran')) call values_in_all_forms_of_fortran()
      if (selected('phases_inherit_from_earlier_ones')) call phases_inherit_from_earlier_ones()
      if (selected('time_steps_given_and_derived')) call time_steps_given_and_derived()
      if (selected('materials_of_arms_and_branches')) call materials_of_arms_and_branches()
      if (selected('each_fault_has_its_message')) call each_fault_has_its_message()
      if (selected('very_many_rows_are_warned_of')) call very_many_rows_are_warned_of()
      if (selected('loads_beyond_the_modulus_are_warned_of')) call loads_beyond_the_modulus_are_warned_of()
      if (selected('all_faults_are_reported_at_once')) call all_faults_are_reported_at_once()
      if (selected('files_that_exist_or_not')) call files_that_exist_or_not()
      if (selected('options_that_exclude_each_other')) call options_that_exclude_each_other()
      if (selected('resolved_settings_give_the_same_case')) &
         call resolved_settings_give_the_same_case()
      if (selected('every_template_is_a_good_input')) call every_template_is_a_good_input()
   end subroutine run_case_input

   !> Default values.
   subroutine defaults_of_a_short_input()
      type(case_type) :: case
      type(error_type), allocatable :: error

      call parse_case(body, 'folder/road.nml', case, error)
      call check_no_error(error, 'a case with defaults')
      if (allocated(error)) return
      call check_close(case%grid%ly, 1.0e-3_dp, 1.0e-18_dp, 'ly makes square cells')
      call check_close(case%surfaces(1)%centre_x, 1.0e-3_dp, 1.0e-18_dp, 'centre_x')
      call check_close(case%surfaces(1)%centre_y, 0.5e-3_dp, 1.0e-18_dp, 'centre_y')
      call check_close(case%material%poisson, 0.5_dp, 0.0_dp, 'poisson')
      call check_that(size(case%material%prony_g) == 0, 'no arms')
      call check_that(case%adhesion%potential == 'none', 'no adhesion')
      call check_that(case%friction%law == 'none' .and. case%friction%slope_effect, 'no friction')
      call check_that(case%phases(1)%static .and. case%phases(1)%steps == 1, 'one static solve')
      call check_that(case%phases(1)%control == 'pressure' .and. case%phases(1)%given, 'control follows')
      call check_close(case%phases(1)%target, 1.0e5_dp, 0.0_dp, 'its target')
      call check_that(.not. case%phases(1)%linear .and. .not. case%phases(1)%relaxed, 'a step')
      call check_that(case%phases(1)%name == 'phase 1', 'its name')
      call check_close(case%solver%tolerance, 1.0e-6_dp, 1.0e-20_dp, 'tolerance')
      call check_that(case%solver%method == 'fast', 'method')
      call check_that(case%solver%time_scheme == 'exponential2', 'time_scheme')
      call check_that(case%solver%passes == 0 .and. case%solver%threads == 0, 'passes, threads')
      call check_close(case%solver%coupling_tolerance, 0.0_dp, 0.0_dp, 'coupling tolerance')
      call check_that(case%solver%slip_law == 'physical' .and. case%solver%interpolation == 'cubic', &
         'slip_law, interpolation')
      call check_that(case%output%file == 'folder/road.h5', 'the result is in the folder of the input')
      call check_that(size(case%output%snapshot_fields) == 5, 'snapshot_fields')
      call check_that(case%input == body, 'the text is kept')

      ! An odd number of cells, and an input whose name has no ending.
      call parse_case('&grid nx=5 ny=3 lx=5.0 ly=6.0/'//sphere//steel//press, 'road', case, error)
      call check_no_error(error, 'odd numbers')
      if (allocated(error)) return
      call check_close(case%surfaces(1)%centre_x, 2.0_dp, 1.0e-15_dp, 'centre_x on a cell')
      call check_close(case%surfaces(1)%centre_y, 2.0_dp, 1.0e-15_dp, 'centre_y on a cell')
      call check_that(case%output%file == 'road.h5', 'result of an input without an ending')
   end subroutine defaults_of_a_short_input

   !> Values in all the forms that Fortran allows.
   subroutine values_in_all_forms_of_fortran()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(*), parameter :: cr = achar(13)//nl, tab = achar(9)

      call parse_case('! a comment / with a slash'//cr//'$CASE Title = ''it''''s "1/2" ! here'' $END'//cr// &
         '&GRID NX=64'//tab//'NY = 1*32, lx=2D-3 BOUNDARY="FREE"'//cr//'&end &solver tolerance=1.e-8'// &
         ' threads = +2 method = ''Thesis''/'//sphere//'&surface shape=''file'' file=''maps/a.h5'' scale=-2/'// &
         steel//press//'&output file = ''/tmp/x.h5'', snapshot_fields = ''gap'' ''pressure'','//cr// &
         ' compression = 0 snapshot_every = 3 / ! end', 'in/road.nml', case, error)
      call check_no_error(error, 'all forms')
      if (allocated(error)) return
      call check_that(case%title == 'it''s "1/2" ! here', 'title: '//trim(case%title))
      call check_that(case%grid%nx == 64 .and. case%grid%ny == 32, 'nx, ny')
      call check_close(case%grid%lx, 2.0e-3_dp, 0.0_dp, 'lx with D')
      call check_that(case%grid%boundary == boundary_free, 'boundary in capitals')
      call check_close(case%solver%tolerance, 1.0e-8_dp, 1.0e-22_dp, 'tolerance')
      call check_that(case%solver%threads == 2 .and. case%solver%method == 'thesis', 'solver')
      call check_that(size(case%surfaces) == 2, 'two surfaces')
      call check_that(case%surfaces(2)%file == 'in/maps/a.h5', 'a path is relative to the input')
      call check_close(case%surfaces(2)%scale, -2.0_dp, 0.0_dp, 'scale')
      call check_that(case%output%file == '/tmp/x.h5', 'an absolute path is kept')
      call check_that(all(case%output%snapshot_fields == ['gap     ', 'pressure']), 'snapshot_fields')
      call check_that(case%output%compression == 0 .and. case%output%snapshot_every == 3, 'output')

      call parse_case(grid//steel//press//'&surface shape=''self_affine'' hurst=0.8 rms_slope=0.1 '// &
         'wavelength_long=5e-4 seed = -7/', 'a', case, error)
      call check_no_error(error, 'rough')
      if (allocated(error)) return
      call check_close(case%surfaces(1)%wavelength_rolloff, 5.0e-4_dp, 0.0_dp, 'rolloff is long by default')
      call check_close(case%surfaces(1)%wavelength_short, 8*2.0e-3_dp/64, 1.0e-18_dp, 'short is 8 cells')
      call check_that(case%surfaces(1)%seed == -7, 'seed')
      call check_close(case%surfaces(1)%rms_slope, 0.1_dp, 0.0_dp, 'rms_slope')
      call check_close(case%surfaces(1)%rms_height, 0.0_dp, 0.0_dp, 'no rms_height')
   end subroutine values_in_all_forms_of_fortran

   !> Phases that inherit values, and values that are derived.
   subroutine phases_inherit_from_earlier_ones()
      type(case_type) :: case
      type(error_type), allocatable :: error

      call parse_case(body//'&phase control = ''force'', force = 2.0, pressure = 3.0, name = ''second'' /'// &
         '&phase relaxed = T / &phase displacement = -1e-6 /', 'a', case, error)
      call check_no_error(error, 'four phases')
      if (allocated(error)) return
      call check_that(size(case%phases) == 4, 'four phases')
      call check_that(case%phases(2)%control == 'force' .and. case%phases(2)%name == 'second', 'by control')
      call check_close(case%phases(2)%target, 2.0_dp, 0.0_dp, 'the force')
      call check_that(case%phases(3)%control == 'force' .and. case%phases(3)%relaxed .and. &
         .not. case%phases(3)%given, 'inherits')
      call check_close(case%phases(3)%target, 2.0_dp, 0.0_dp, 'inherits the force')
      call check_close(case%phases(4)%target, -1.0e-6_dp, 0.0_dp, 'a negative displacement')
   end subroutine phases_inherit_from_earlier_ones

   !> Time steps that are given or derived. Cells are 2e-3/64 m long.
   subroutine time_steps_given_and_derived()
      type(case_type) :: case
      type(error_type), allocatable :: error
      real(dp), parameter :: dx = 2.0e-3_dp/64
      character(*), parameter :: arms = '&material shear_modulus=1e6, prony_g=3*1e6, prony_tau=1e-6, 0.4, 9.0 /'

      ! 2 cells in 0.3 s would take 4.3 steps of 0.07 s, hence 4 steps of 0.075 s
      call parse_case(body//'&phase duration = 0.3, dt = 0.07 /&phase duration = 0.3, steps = 7 /'// &
         '&phase duration = 0.3, dt = 0.1, steps = 3, ramp = ''linear'', force = 1.0 /'// &
         '&phase duration = 8.0 /', 'a', case, error)
      call check_steps(2, 4, 0.075_dp, 'dt given')
      call check_steps(3, 7, 0.3_dp/7, 'steps given')
      call check_steps(4, 3, 0.1_dp, 'both given')
      call check_steps(5, 20, 0.4_dp, 'elastic at rest')
      call check_that(case%phases(4)%linear .and. .not. case%phases(4)%static, 'a ramp')

      ! An arm of 1e-6 s relaxes at once in a second, so that 0.4 s counts. 8 s take at least 20 steps.
      call parse_case(grid//sphere//arms//press//'&phase duration = 1.0 /&phase duration = 8.0 /'// &
         '&phase duration = 0.5e-6 /', 'a', case, error)
      call check_steps(2, 20, 0.05_dp, 'an eighth of the shortest active time')
      call check_steps(3, 160, 0.05_dp, 'the same in a longer phase')
      call check_steps(4, 20, 0.025e-6_dp, 'a phase shorter than every time')

      ! one cell per step along x, along y with other cells, and obliquely
      call parse_case('&grid nx=64, ny=32, lx=2e-3, ly=3e-3 /'//sphere//arms//press// &
         '&phase duration = 1.0, velocity_x = -1e-3 /&phase duration = 1.0, velocity_y = 3e-3 /'// &
         '&phase duration = 1.0, velocity_x = 1e-3, velocity_y = 3e-3 /'// &
         '&phase duration = 1.0, velocity_x = 1e-3, steps = 4 /', 'a', case, error)
      call check_steps(2, 32, dx/1.0e-3_dp, 'one cell along x')
      call check_steps(3, 32, 3.0e-3_dp/32/3.0e-3_dp, 'one cell along y')
      call check_steps(4, 32, dx/1.0e-3_dp, 'one cell obliquely')
      call check_that(case%phases(2)%dt_reason == 'for one cell per step', &
         'why: '//case%phases(2)%dt_reason)
      call check_order(index(case%warnings, '&phase 5: a step moves the road by 8 cells'), '>', 0, &
         'there is a warning about a coarse step: '//case%warnings)

   contains

      subroutine check_steps(i, steps, dt, what)
         integer, intent(in) :: i, steps
         real(dp), intent(in) :: dt
         character(*), intent(in) :: what

         if (size(case%phases) < i) then
            call check_that(.false., what//': the phase does not exist')
            return
         end if
         call check_that(case%phases(i)%steps == steps, what//': steps')
         call check_close(case%phases(i)%dt, dt, 1.0e-14_dp*dt, what//': dt')
      end subroutine check_steps

   end subroutine time_steps_given_and_derived

   !> Adhesion allows a pull. Mixed precision is for the fast method only.
   subroutine options_that_exclude_each_other()
      type(case_type) :: case
      type(error_type), allocatable :: error

      call parse_case(body//'&adhesion potential = ''exponential'', energy = 0.05, range = 1e-6 /'// &
         '&phase pressure = -1.0 /&phase force = 0 /', 'a', case, error)
      call check_no_error(error, 'adhesion allows pulling')
      call check_close(case%phases(2)%target, -1.0_dp, 0.0_dp, 'a pulling pressure')
      call parse_case(body//'&solver precision = ''mixed'' /', 'a', case, error)
      call check_no_error(error, 'mixed precision')
      call check_that(case%solver%precision == 'mixed', 'mixed precision is accepted')
      call parse_case(body//'&solver precision = ''mixed'', method = ''thesis'' /', 'a', case, error)
      call check_error(error, 'precision', 'mixed precision of the thesis''s method')
      call check_error(error, 'thesis', 'mixed precision of the thesis''s method')
      call parse_case('&grid nx = 16, ny = 16, lx = 1e-3, boundary = ''free'' /'//sphere//steel//press// &
         '&adhesion potential = ''gauss'', energy = 0.05, range = 1e-8 /&solver method = ''thesis'' /', 'a', case, error)
      call check_error(error, 'with &adhesion needs boundary = ''periodic''', 'the thesis''s method with adhesion')
      if (allocated(error)) call check_that(error%status == error_input, 'its status')
   end subroutine options_that_exclude_each_other

   !> The resolved settings are an input of the same case.
   subroutine resolved_settings_give_the_same_case()
      type(case_type) :: again, case, in_time
      type(error_type), allocatable :: error
      character(:), allocatable :: text

      call parse_case('&case title = ''it''''s'' /'//grid//sphere//steel//press// &
         '&phase displacement = 3.3333333333333333e-6, name=''deep'' /&phase /'// &
         '&surface shape=''self_affine'' hurst=0.7 rms_height=1.1e-7 wavelength_short=1.7e-4/'// &
         '&surface shape=''file'' file=''x.h5'' /&surface shape=''sine'' amplitude=-1e-6 wavelength=1e-3 /'// &
         '&output snapshot_fields=''gap'' snapshot_every=2 file=''y.h5'' /', 'folder/a.nml', case, error)
      call check_no_error(error, 'a case to report')
      if (allocated(error)) return
      text = resolved_input(case)
      call parse_case(text, 'b.nml', again, error)
      call check_no_error(error, 'resolved settings as an input')
      if (allocated(error)) return
      call check_that(resolved_input(again) == text, 'resolved settings stay the same')
      call check_that(again%title == 'it''s' .and. again%output%file == 'folder/y.h5' .and. &
         again%surfaces(3)%file == 'folder/x.h5', 'texts')
      call check_close(again%phases(3)%target, case%phases(2)%target, 0.0_dp, 'numbers to the last bit')
      call check_close(again%surfaces(2)%wavelength_long, 1.0e-3_dp, 0.0_dp, 'a derived default')
      call check_that(again%phases(3)%control == 'displacement' .and. .not. again%phases(3)%given, &
         'an inherited load stays inherited')
      call check_order(index(text, 'tolerance = 1e-6'), '>', 0, 'defaults are shown')

      call check_close(fields_of(case), 7.65_dp, 1.0e-9_dp, 'memory: elastic, several rows')
      in_time = case
      in_time%grid%nx = 4000
      in_time%grid%ny = 2500
      call check_order(memory_needed(in_time), '>', 11.65_dp*8e7_dp, 'memory: a start on half of the cells along each side')
      in_time%grid%nx = 3990
      call check_order(memory_needed(in_time), '<', 10.5_dp*8e7_dp, 'memory: a start on a quarter of them')
      case%phases(3)%velocity_y = -1.0_dp
      call check_close(fields_of(case), 12.65_dp, 1.0e-9_dp, 'memory: sliding')
      call check_close(joint_memory(case), 0.0_dp, 0.0_dp, 'memory: nothing more without steady rows and friction')
      case%phases(3)%steady = .true.
      call check_close(joint_memory(case), 111.0_dp*8*64*32, 1.0e-9_dp, 'memory: a steady row solved all at once')
      case%friction%law = 'coulomb'
      call check_close(joint_memory(case), 446.0_dp*8*64*32, 1.0e-9_dp, 'memory: the same with friction')
      case%phases(3)%steady = .false.
      in_time = case
      in_time%phases(3)%static = .false.
      in_time%phases(3)%steps = 1
      call check_close(joint_memory(in_time), 446.0_dp*8*64*32, 1.0e-9_dp, 'memory: a time step solved all at once')
      case%friction%law = 'none'
      case%phases(3)%velocity_y = 0.0_dp
      case%material%prony_g = [1.0_dp, 2.0_dp]
      call check_close(fields_of(case), 12.65_dp, 1.0e-9_dp, 'memory: arms')
      case%solver%precision = 'mixed'
      call check_order(fields_of(case), '<', 12.65_dp, 'memory: mixed precision takes less')
      case%solver%precision = 'double'
      deallocate (case%material%prony_g)
      allocate (case%material%prony_g(0))
      case%grid%boundary = boundary_free
      call check_close(fields_of(case), 9.4_dp, 1.0e-9_dp, 'memory: free')
      call check_order(index(case_summary(case), '3 phases, 3 static solves, 0 time steps in 0 s'), '>', 0, &
         'summary: '//case_summary(case))
      call check_order(index(case_summary(case), 'memory: about 26.2 MB'), '>', 0, &
         'summary: '//case_summary(case))
      ! Rows 0 and 2 of three have snapshots.
      call check_that(most_snapshots(case) == 2, 'snapshots')
      case%output%snapshot_every = 0
      call check_that(most_snapshots(case) == 1, 'a snapshot of the last row only')
      call check_order(index(case_summary(case), 'result: about 0.3 MB with 1 snapshot,'), '>', 0, &
         'summary: '//case_summary(case))
   end subroutine resolved_settings_give_the_same_case

   !> Every template is a valid input, or needs a feature that is not available; those of elastic contact must
   !> exist.
   subroutine every_template_is_a_good_input()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(16), allocatable :: names(:)
      integer :: i

      allocate (names, source=all_template_names())
      call check_order(size(names), '>=', 7, 'seven templates')
      do i = 1, size(names)
         call parse_case(template_text(trim(names(i))), trim(names(i)), case, error)
         if (allocated(error)) then
            call check_that(lines(error%message) == occurrences(error%message, 'is not available yet'), &
               'template '//trim(names(i))//' lacks only features: '//error%message)
            call check_that(.not. template_is_available(trim(names(i))), trim(names(i))//' is not offered')
         else
            call check_that(case%title /= '' .and. case%warnings == '', 'template '//trim(names(i))// &
               ' is in order '//case%warnings)
            call check_order(index(nl//template_list(), nl//trim(names(i))//' '), '>', 0, &
               trim(names(i))// ' is listed, its name first')
         end if
      end do
      do i = 1, 3
         call check_that(template_is_available(trim(names(i))), trim(names(i))//' is available')
      end do
      call check_that(template_text('nothing') == '', 'no such template')
   end subroutine every_template_is_a_good_input

   !> The number of occurrences of a piece in a text.
   pure integer function occurrences(text, piece)
      character(*), intent(in) :: text, piece
      integer :: i

      occurrences = 0
      do i = 1, len(text) - len(piece) + 1
         if (text(i:i + len(piece) - 1) == piece) occurrences = occurrences + 1
      end do
   end function occurrences

   !> Arms are read, and their times are shifted to the temperature.
   subroutine materials_of_arms_and_branches()
      type(case_type) :: case
      type(error_type), allocatable :: error

      call parse_case(grid//sphere//press//'&material shear_modulus = 1e6, prony_g = 2*1e6, 3e6, '// &
         'prony_tau(3) = 1.0, prony_tau(1:2) = 1e-3, 1e-2, wlf_c1 = 2.0, wlf_c2 = 50.0, temperature = 70.0/', &
         'a', case, error)
      call check_that(size(case%material%prony_g) == 3, 'three arms')
      if (size(case%material%prony_g) == 3) then
         call check_close(case%material%prony_g(2), 1.0e6_dp, 0.0_dp, 'a repeated modulus')
         call check_close(case%material%prony_tau(3), 0.1_dp, 1.0e-15_dp, 'times shifted by 1/10')
      end if

      call parse_case(grid//sphere//press//'&material zener_g0 = 2.75e6, zener_g1 = 0.25e6, '// &
         'zener_eta = 3e3 /', 'a', case, error)
      call check_that(size(case%material%prony_g) == 1, 'a branch is an arm')
      if (size(case%material%prony_g) == 1) then
         call check_close(case%material%prony_g(1), 2.75e6_dp**2/3.0e6_dp, 1.0e-8_dp, 'its modulus')
         call check_close(case%material%prony_tau(1), 1.0e-3_dp, 1.0e-17_dp, 'its relaxation time')
         call check_close(case%material%shear_modulus, 2.75e6_dp*0.25e6_dp/3.0e6_dp, 1.0e-8_dp, 'long term')
      end if
   end subroutine materials_of_arms_and_branches

   !> Each of these inputs has one fault, with a known message.
   subroutine each_fault_has_its_message()
      character(*), parameter :: no_grid = sphere//steel//press
      character(*), parameter :: no_surface = grid//steel//press
      character(*), parameter :: no_material = grid//sphere//press
      character(*), parameter :: no_phase = grid//sphere//steel

      ! values
      call refuse(no_grid//'&grid nx = -4, ny = 4, lx = 1.0 /', &
         'road.nml: &grid: nx = -4: must be a positive integer')
      call refuse(no_grid//'&grid nx = 1.5, ny = 4, lx = 1.0 /', 'nx = 1.5: must be a positive integer')
      call refuse(no_grid//'&grid nx = ''a'', ny = 4, lx = 1.0 /', 'nx = ''a'': must be a positive integer')
      call refuse(no_grid//'&grid nx = 99999999999, ny = 4, lx = 1.0 /', &
         'nx = 99999999999: must be a positive integer of at most 2147483647')
      call refuse(no_grid//'&grid nx = 4 5, ny = 4, lx = 1.0 /', 'nx = 4 5: takes one value only')
      call refuse(no_grid//'&grid nx = , ny = 4, lx = 1.0 /', '&grid: nx')
      call refuse(no_grid//'&grid nx = 2*4, ny = 4, lx = 1.0 /', 'nx = 2*4: takes one value only')
      call refuse(no_grid//'&grid nx(1) = 4, ny = 4, lx = 1.0 /', 'is a single value and has no subscript')
      call refuse(no_grid//'&grid nx = 1, ny = 4, lx = 1.0 /', 'nx = 1: must be at least 2')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = NaN /', 'lx = NaN: must be a positive number')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = Infinity /', 'lx = Infinity: must be a positive number')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = 1e999 /', 'lx = 1e999: must be a positive number')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = 1.0.0 /', 'lx = 1.0.0: must be a positive number')
      call refuse(no_grid//'&grid nx = 60000, ny = 60000, lx = 1.0 /', 'must be at most 2147483647')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = 1.0, boundary = ''peridic'' /', &
         'boundary = ''peridic'': must be one of ''periodic'' | ''free''')
      call refuse(no_grid//'&grid nx = 4, ny = 4, lx = 1.0, boundary = free /', 'boundary = free: must be one of')
      call refuse(no_grid//'&grid nx = 4, ny = 1, lx = 1.0, boundary = ''free'' /', &
         'a free line contact has no finite displacement')
      call refuse(no_grid//'&grid ny = 4, lx = 1.0 /', '&grid: nx: is missing')
      call refuse(no_material//'&material shear_modulus = 0 /', 'shear_modulus = 0: must be a positive number')
      call refuse(no_material//'&material /', '&material: shear_modulus: is missing')
      call refuse(no_material//'&material shear_modulus = 1e6, poisson = 0.6 /', &
         'poisson = 0.6: must be a number above -1 and at most 0.5')
      call refuse(no_material//'&material shear_modulus = 1e6, poisson = -1 /', 'poisson = -1: must be a number')
      call refuse(no_material//'&material shear_modulus = 1e6, density = 1.0 /', &
         'density = 1.0: needs a thickness')
      call refuse(no_phase//'&phase pressure = 1e5, relaxed = 1 /', &
         'relaxed = 1: must be .true. or .false. (line 4)')
      call refuse(body//'&solver tolerance = 1.0 /', 'tolerance = 1.0: must be a number above 0 and below 1')
      call refuse(body//'&output compression = 10 /', 'must be an integer of at least 0 and at most 9')
      call refuse(body//'&output file = '''' /', 'must name a file')
      call refuse(body//'&case title = '''//repeat('x', 300)//''' /', 'must have at most 256 characters')
      call refuse(body//'&output file = '''//repeat('x', 3000)//''' /', 'of at most 1024 characters')
      call refuse(body//'&output snapshot_fields = ''slip_x'' /', 'need &friction')
      call refuse(body//'&output snapshot_fields = ''gap'', ''pressure'', ''gap'' /', 'must name each field once')
      call refuse(body//'&output snapshot_times = /', 'has no value: every value must be')
      call refuse(body//'&output snapshot_times = 1.0 /', 'must be within the run, which ends at 0 s')
      call refuse(body//'&output snapshot_times = 1.0, snapshot_every = 2 /', 'are given together')

      ! names
      call refuse(no_grid//'&grd nx = 4, ny = 4, lx = 1.0 /', '&grd: there is no such group; did you mean &grid?')
      call refuse(no_material//'&material shear_modulos = 1e6 /', &
         'shear_modulos: there is no such variable; did you mean shear_modulus?')
      call refuse(body//'&solver tol = 1e-6 /', 'did you mean tolerance?')
      call refuse(body//grid, '&grid: the group is given twice, in line 1 and in line 5')
      call refuse(no_phase//'&phase pressure = 1.0, pressure = 2.0 /', 'pressure is given twice')

      ! form
      call refuse('', '&grid: the group is missing')
      call refuse('', '&surface: the group is missing')
      call refuse(body//'&solver tolerance = 1e-6', 'is not closed: a ''/'' is missing before the end')
      call refuse('&solver tolerance = 1e-6'//nl//body, 'missing before the next group in line 2')
      call refuse('nx = 4'//nl//body, 'line 1: text outside of a group: nx = 4')
      call refuse('&case title'//char(194)//char(160)//'= ''a'' /'//nl//body, 'there is no such variable: it contains a '// &
         'character that is not ASCII')
      call refuse(body//'&case title = ''open /'//nl, 'has a string that is not closed on its line')
      call refuse(body//'&solver 1e-6 /', '1e-6 in line 5 is not an assignment')
      call refuse(body//achar(0), 'line 5: a character that is not text (code 0)')

      ! lists
      call refuse(no_material//'&material shear_modulus=1, prony_g(2)=1.0, prony_tau=1.0,2.0/', &
         'prony_g = 1.0: has no element 1')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0, prony_g(1)=2.0, prony_tau=1.0/', &
         'sets its element 1 twice')
      call refuse(no_material//'&material shear_modulus=1, prony_g(0)=1.0, prony_tau=1.0/', &
         'has an invalid subscript')
      call refuse(no_material//'&material shear_modulus=1, prony_g(999999999)=1.0, prony_tau=1.0/', &
         'has a subscript above')
      call refuse(no_material//'&material shear_modulus=1, prony_g=999999999*1.0, prony_tau=1.0/', &
         'has more than')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0,,2.0, prony_tau=1.0/', &
         'has an empty value')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0,2.0, prony_tau=1.0/', &
         'prony_tau = 1.0: must have as many values as prony_g: 1 here, 2 there')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0 /', 'prony_tau: is missing')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0, prony_tau=0.0/', &
         'prony_tau = 0.0: every value must be a positive number')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0, prony_tau=1.0, zener_g0=1.0, '// &
         'zener_g1=1.0, zener_eta=1.0/', 'prony_... and zener_... are given together')
      call refuse(no_material//'&material shear_modulus=1, prony_g=1.0, prony_tau=1.0, temperature=30/', &
         'needs wlf_c1 and wlf_c2')
      call refuse(no_material//'&material shear_modulus=1, wlf_c1=17.0/', 'must be given together')
      call refuse(no_material//'&material shear_modulus=1, wlf_c1=17.0, wlf_c2=50, temperature=-40/', &
         'is below the range of the WLF shift')

      ! surfaces
      call refuse(no_surface//'&surface shape = ''sphere'' /', 'radius: is missing: sphere needs it (line 4)')
      call refuse(no_surface//'&surface shape = ''ball'' /', 'shape = ''ball'': must be one of ''flat''')
      call refuse(no_surface//'&surface shape = ''sine'', amplitude=1e-6, wavelength=1e-3, radius=1.0 /', &
         'radius = 1.0: does not belong to shape = ''sine''')
      call refuse(no_surface//'&surface shape = ''self_affine'', hurst = 1.2, rms_slope = 0.1 /', &
         'hurst = 1.2: must be a number above 0 and at most 1')
      call refuse(no_surface//'&surface shape = ''self_affine'', hurst = 0.8 /', &
         'rms_height or rms_slope is missing')
      call refuse(no_surface//'&surface shape = ''self_affine'', hurst=0.8, rms_slope=0.1, rms_height=1e-6 /', &
         'rms_height and rms_slope are given together')
      call refuse(no_surface//'&surface shape = ''self_affine'', hurst=0.8, rms_slope=0.1, '// &
         'wavelength_short=1e-3, wavelength_rolloff=1e-4 /', 'must be at most wavelength_rolloff')
      call refuse(no_surface//'&surface shape = ''self_affine'', hurst=0.8, rms_slope=0.1, '// &
         'wavelength_short=0.9e-3, wavelength_long=0.95e-3 /', 'no wave that fits the grid is between')
      call refuse(no_surface//'&surface shape = ''file'' /', 'file: is missing')
      call refuse(no_surface, '&surface: the group is missing')

      ! phases
      call refuse(no_phase//'&phase /', 'the first phase must give one of them')
      call refuse(no_phase//'&phase pressure = 1.0, force = 1.0 /', 'pressure and force are given together')
      call refuse(no_phase//'&phase pressure = -1.0 /', 'with &adhesion only')
      call refuse(no_phase//'&phase force = 0.0 /', 'force = 0.0: must be a positive number')
      call refuse(no_phase//'&phase control = ''force'', pressure = 1.0 /', 'needs force in the same phase')
      call refuse(no_phase//'&phase pressure=1.0, duration=1.0, ramp=''linear'', relaxed=.true. /', &
         'relaxed = .true.: excludes ramp')
      call refuse(no_phase//'&phase pressure=1.0, steps=4 /', 'steps = 4: needs a duration, or ramp')
      call refuse(no_phase//'&phase pressure=1.0, velocity_x=4 /', 'velocity_x = 4: needs a duration')
      call refuse(no_phase//'&phase pressure=1.0, duration=-1 /', 'duration = -1: must be 0 or a positive number')
      call refuse(no_phase//'&phase pressure=1.0, duration=1, dt=2 /', 'dt = 2: must be at most the duration')
      call refuse(no_phase//'&phase pressure=1.0, duration=1, dt=1e-12 /', 'needs more than 1e9 steps')
      call refuse(no_phase//'&phase pressure=1.0, duration=1, dt=0.3, steps=4 /', 'dt = 0.3: does not agree')

      ! laws
      call refuse(body//'&friction law = ''coulomb'' /', 'coefficient: is missing: coulomb needs it')
      call refuse(body//'&friction coefficient = 0.3 /', '&friction: law: is missing')
      call refuse(body//'&adhesion potential = ''gauss'', energy = 0.05 /', 'range: is missing')
   end subroutine each_fault_has_its_message

   !> A run of more than 100,000 rows is announced, with the phase that has most of them. The first phase adds a row
   !> for the jump of its load.
   subroutine very_many_rows_are_warned_of()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(*), parameter :: rest = '&phase pressure=1.0, duration=1, steps=40000 /'
      character(*), parameter :: slide = '&phase duration=1, velocity_x=1e-9, steps='

      call parse_case(grid//sphere//steel//rest//slide//'59999 /', 'road.nml', case, error)
      call check_no_error(error, '100,000 rows')
      call check_that(case%warnings == '', '100,000 rows: no warning '//case%warnings)

      call parse_case(grid//sphere//steel//rest//slide//'60000 /', 'road.nml', case, error)
      call check_no_error(error, '100,001 rows')
      call check_order(index(case%warnings, '&phase 2: the run has 100001 rows, of which 60000 belong to this phase '// &
         '(time step: steps given'), '>', 0, 'a warning: '//case%warnings)
   end subroutine very_many_rows_are_warned_of

   !> A load above ten times the modulus under a sudden load, 2 (1e6 + 4e6)/(1 - 0.5) = 20 MPa, is warned of; a force
   !> counts as its mean pressure.
   subroutine loads_beyond_the_modulus_are_warned_of()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(*), parameter :: rubber = '&material shear_modulus = 1e6, prony_g = 4e6, prony_tau = 1, poisson = 0.5 /'
      character(*), parameter :: most = '&phase pressure = 1.99e8 /'

      call parse_case(grid//sphere//rubber//most, 'road.nml', case, error)
      call check_no_error(error, 'a large load')
      call check_that(index(case%warnings, 'modulus') == 0, 'no warning about it '//case%warnings)

      call parse_case(grid//sphere//rubber//most//'&phase pressure = 4e9 /', 'road.nml', case, error)
      call check_no_error(error, 'a load in another unit')
      call check_order(index(case%warnings, '&phase 2: the mean pressure of 4e9 Pa is 200 times the modulus E* of 2e7 Pa'), &
         '>', 0, 'a warning: '//case%warnings)

      call parse_case(grid//sphere//rubber//'&phase force = 8e3 /', 'road.nml', case, error)
      call check_no_error(error, 'a force in another unit')
      call check_order(index(case%warnings, '&phase 1: the mean pressure of 4e9 Pa'), '>', 0, &
         'a warning: '//case%warnings)
   end subroutine loads_beyond_the_modulus_are_warned_of

   !> An input must give exactly one fault, which holds the fragment.
   subroutine refuse(text, fragment)
      character(*), intent(in) :: text
      character(*), intent(in) :: fragment
      type(case_type) :: case
      type(error_type), allocatable :: error

      call parse_case(text, 'road.nml', case, error)
      call check_error(error, fragment, fragment)
      if (.not. allocated(error)) return
      call check_that(error%status == error_input, fragment//': status')
      call check_that(index(error%message, 'road.nml: ') == 1, fragment//': names the file')
      if (text /= '') call check_that(lines(error%message) <= 1 .or. index(fragment, 'there is no such') > 0 &
         .or. index(fragment, 'did you mean') > 0, fragment//': alone, not'//nl//error%message)
   end subroutine refuse

   !> Number of lines.
   pure integer function lines(text)
      character(*), intent(in) :: text
      integer :: i

      lines = 1
      do i = 1, len(text)
         if (text(i:i) == nl) lines = lines + 1
      end do
   end function lines

   !> Faults of one input, all reported.
   subroutine all_faults_are_reported_at_once()
      type(case_type) :: case
      type(error_type), allocatable :: error
      character(*), parameter :: expected(7) = [character(60) :: &
         'r: &grid: nx = 0: must be a positive integer', 'r: &grid: ly = ''x'': must be a positive number', &
         'r: &material: poisson = 2: must be', 'r: &solvr: there is no such group; did you mean &solver?', &
         'r: &surface: radius: is missing', 'r: &phase: pressure = -5: must be a positive number', &
         'r: &phase: rmp: there is no such variable; did you mean ramp']
      integer :: i

      call parse_case('&grid nx = 0 ny = 4 lx = 1.0 ly = ''x'' /'//nl//'&material poisson = 2, '// &
         'shear_modulus = 1e6 /'//nl//'&solvr /'//nl//'&surface shape = ''cylinder'' /'//nl// &
         '&phase pressure = -5, rmp = ''step'' /', 'r', case, error)
      do i = 1, size(expected)
         call check_error(error, trim(expected(i)), 'fault '//achar(48 + i))
      end do
      if (allocated(error)) call check_that(lines(error%message) == size(expected), &
         'no fault is invented: '//error%message)
   end subroutine all_faults_are_reported_at_once

   !> Files that are there or not.
   subroutine files_that_exist_or_not()
      type(case_type) :: case
      type(error_type), allocatable :: error
      integer :: unit
      character(*), parameter :: path = 'build/test_case_input.nml'

      call read_case('build/no/such/file.nml', case, error)
      call check_error(error, 'build/no/such/file.nml: there is no such file', 'a missing file')
      if (allocated(error)) call check_that(error%status == error_file, 'a missing file: status')
      call read_case('build', case, error)
      call check_error(error, 'build: cannot be read', 'a folder')
      if (allocated(error)) call check_that(error%status == error_file, 'a folder: status')

      open (newunit=unit, file=path, access='stream', form='unformatted', status='replace')
      write (unit) body
      close (unit)
      call read_case(path, case, error)
      call check_no_error(error, 'a file')
      if (.not. allocated(error)) call check_that(case%input == body, 'its text')
      open (newunit=unit, file=path)
      close (unit, status='delete')
   end subroutine files_that_exist_or_not

   !> Fields of doubles that a run of 64 x 32 cells is said to take, without the program itself.
   function fields_of(case) result(fields)
      type(case_type), intent(in) :: case
      real(dp) :: fields

      fields = (memory_needed(case) - 26.0e6_dp)/(8.0_dp*64*32) - 5.0_dp
   end function fields_of

end module test_case_input
