!> Tests of rows that are proposed and then accepted or rejected, or given up.
module test_proposal
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use asperity_schedule, only : count_rows
   use asperity_simulation, only : new_simulation, simulation_type
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_no_error, check_that, selected
   use row_state, only : list_state, state_type
   use simulation_runs, only : nl
   use state_table, only : state_piece_type, state_table_type
   implicit none
   private

   public :: run_proposal

   character(*), parameter :: grid = '&grid nx = 24, ny = 18, lx = 24e-3, ly = 18e-3 /'//nl// &
      '&surface shape = ''self_affine'', hurst = 0.8, wavelength_long = 12e-3, wavelength_short = 4e-3, '// &
      'rms_slope = 0.2, seed = 3 /'//nl
   character(*), parameter :: rubber = &
      '&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-3, 1e-2, thickness = 2e-2'
   character(*), parameter :: rubs = '&friction law = ''coulomb'', coefficient = 0.4 /'//nl
   character(*), parameter :: slides = grid//rubber//', density = 1e3 /'//nl//rubs// &
      '&phase pressure = 1e5 /'//nl// &
      '&phase velocity_x = 0.3, velocity_y = 0.1, duration = 6e-3, steps = 3 /'//nl// &
      '&phase pressure = 1.5e5, velocity_x = 0.3, velocity_y = 0.1, duration = 4e-3, steps = 2 /'

   integer :: questions = 0        !! times that `asked` still answers with no

contains

   subroutine run_proposal()
      call begin_suite('proposal')
      if (selected('propose_reject_advance')) call propose_reject_advance()
      if (selected('give_up_advance')) call give_up_advance()
   end subroutine run_proposal

   !> A rejected row changes nothing, for all kinds of physics.
   subroutine propose_reject_advance()
      ! The first row in time of each case is solved in three parts.
      call try_case(grid//rubber//' /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase pressure = 2e5, ramp = ''linear'', duration = 4e-3, steps = 2 /', 'load')
      call try_case(slides, 'friction, with a jump of the load')
      call try_case(grid//rubber//' /'//nl//'&phase pressure = 1e5, velocity_x = 0.5, steady = .true., '// &
         'duration = 2e-3, steps = 2 /', 'steady sliding and the way on in time')
      call try_case(grid//'&material shear_modulus = 1e6 /'//nl//'&adhesion potential = ''exponential'', '// &
         'energy = 0.05, range = 5e-5 /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase pressure = 2e4, velocity_x = 0.3, duration = 4e-3, steps = 2 /', 'adhesion')
   end subroutine propose_reject_advance

   !> Rows are given up in all kinds of physics; rows with friction between passes and within them.
   subroutine give_up_advance()
      call give_up_case(slides, 3, 'friction')
      call give_up_case(slides//nl//'&solver method = ''thesis'' /', 29, 'friction by the method of the thesis')
      call give_up_case(grid//rubber//', density = 1e3 /'//nl//rubs//'&phase pressure = 1e5 /'//nl// &
         '&phase traction_x = 1e4, traction_y = 5e3, ramp = ''linear'', duration = 2e-3, steps = 2 /', 11, &
         'a pulled road')
      call give_up_case(grid//rubber//' /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase pressure = 2e5, ramp = ''linear'', duration = 4e-3, steps = 2 /', 1, 'load')
      call give_up_case(grid//rubber//' /'//nl//'&phase pressure = 1e5, velocity_x = 0.5, steady = .true., '// &
         'duration = 2e-3, steps = 2 /'//nl//'&phase pressure = 1e5, velocity_x = 0.7, steady = .true. /', 2, &
         'steady sliding and the way on in time')
      call give_up_case(slides//'&phase pressure = 1e5, velocity_x = 0.5, steady = .true. /', 7, &
         'steady sliding with friction')
      call give_up_case(grid//rubber//' /'//nl//'&adhesion potential = ''exponential'', '// &
         'energy = 0.05, range = 5e-5 /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase pressure = 2e4, velocity_x = 0.3, duration = 4e-3, steps = 2 /', 5, 'adhesion')
      call give_up_case(grid//rubber//' /'//nl//'&solver method = ''thesis'' /'//nl//'&phase pressure = 1e5 /'//nl// &
         '&phase pressure = 2e5 /', 4, 'the method of the thesis')
      call give_up_case(grid//rubber//' /'//nl//'&solver method = ''thesis'' /'//nl// &
         '&adhesion potential = ''exponential'', energy = 0.05, range = 5e-5 /'//nl// &
         '&phase pressure = 1e5 /'//nl//'&phase pressure = 2e4 /', 9, 'adhesion by the method of the thesis')
   end subroutine give_up_advance

   !> A row that is given up at any iteration or pass, in any part of its step, leaves the state of the row
   !> before, and the run continues with the same numbers.
   subroutine give_up_case(text, every, what)
      character(*), intent(in) :: text, what
      integer, intent(in) :: every                  !! number of places at which the row is given up
      type(simulation_type) :: plain, hesitant
      type(state_type) :: before
      type(case_type) :: case
      type(error_type), allocatable :: error
      integer :: first, given_up, k, places

      call parse_case(text, 'given_up.nml', case, error)
      call check_no_error(error, what//': input')
      if (allocated(error)) return
      call new_simulation(plain, case, error)
      call new_simulation(hesitant, case, error)
      hesitant%stop%asked => asked
      hesitant%stop%patience = 0.0_dp
      given_up = 0
      do k = 1, count_rows(case%phases)
         call plain%advance(error)
         before = hesitant%state
         first = given_up
         do places = 0, 10000, every
            questions = places
            call hesitant%advance(error)
            if (.not. hesitant%stop%given_up) exit
            given_up = given_up + 1
            call check_that(same(hesitant%state, before), what//', given up: the state of the row before')
         end do
         call check_that(given_up > first, what//': every row can be given up')
         questions = huge(1)
         if (hesitant%stop%given_up) call hesitant%advance(error)
         call check_that(same(hesitant%state, plain%state), what//', given up: the same numbers afterwards')
      end do
      call check_that(hesitant%finished, what//', given up: finished')
      call plain%destroy()
      call hesitant%destroy()
   end subroutine give_up_case

   !> Is a stop requested? The answer is no as often as `questions` says, then yes.
   function asked() bind(c) result(yes)
      integer(c_int) :: yes

      yes = merge(0_c_int, 1_c_int, questions > 0)
      questions = questions - 1
   end function asked

   !> Three ways through a case: advance; propose, reject, advance; propose, accept.
   subroutine try_case(text, what)
      character(*), intent(in) :: text, what
      type(simulation_type) :: plain, hesitant, formal
      type(state_type) :: before
      type(case_type) :: case
      type(error_type), allocatable :: error
      integer :: k

      call parse_case(text, 'proposal.nml', case, error)
      call check_no_error(error, what//': input')
      if (allocated(error)) return
      call new_simulation(plain, case, error)
      call new_simulation(hesitant, case, error)
      call new_simulation(formal, case, error)
      do k = 1, count_rows(case%phases)
         call plain%advance(error)
         call check_no_error(error, what//': advance')
         before = hesitant%state
         call hesitant%propose(error)
         call check_no_error(error, what//': propose')
         call check_that(same(hesitant%state, before), what//': a proposal changes no state')
         call check_that(same(hesitant%proposed, plain%state), what//': the proposed state is the next state')
         call hesitant%reject()
         call check_that(.not. allocated(hesitant%proposed), what//': nothing is left of the proposal')
         call hesitant%advance(error)
         call check_that(same(hesitant%state, plain%state), what//': advance after reject')
         call formal%propose(error)
         call formal%accept()
         call check_that(same(formal%state, plain%state), what//': propose and accept')
      end do
      call check_that(plain%finished .and. hesitant%finished .and. formal%finished, what//': finished')
      call check_that(plain%converged, what//': converged: '//plain%reason)
      call check_that(hesitant%warnings == plain%warnings, what//': warnings')
      call plain%destroy()
      call hesitant%destroy()
      call formal%destroy()
   end subroutine try_case

   !> Are two states the same to the last bit, except for the wall time of the row?
   function same(one, other) result(yes)
      type(state_type), intent(in), target :: one, other
      logical :: yes
      type(state_table_type) :: first, second
      integer :: k

      call list_state(one, first)
      call list_state(other, second)
      yes = first%count == second%count
      if (.not. yes) return
      do k = 1, first%count
         if (first%pieces(k)%name == 'row/seconds') cycle
         yes = yes .and. same_piece(first%pieces(k), second%pieces(k))
      end do
   end function same

   !> Are two pieces the same?
   function same_piece(a, b) result(yes)
      type(state_piece_type), intent(in) :: a, b
      logical :: yes

      yes = a%name == b%name
      if (associated(a%truth)) yes = yes .and. (a%truth .eqv. b%truth)
      if (associated(a%whole)) yes = yes .and. a%whole == b%whole
      if (associated(a%whole_1)) yes = yes .and. all(a%whole_1 == b%whole_1)
      if (associated(a%byte_2)) yes = yes .and. all(a%byte_2 == b%byte_2)
      if (associated(a%real_0)) yes = yes .and. abs(a%real_0 - b%real_0) <= 0.0
      if (associated(a%real_1)) yes = yes .and. all(abs(a%real_1 - b%real_1) <= 0.0)
      if (associated(a%real_2)) yes = yes .and. all(abs(a%real_2 - b%real_2) <= 0.0)
      if (associated(a%real_3)) yes = yes .and. all(abs(a%real_3 - b%real_3) <= 0.0)
      if (associated(a%text)) yes = yes .and. a%text == b%text
   end function same_piece

end module test_proposal
