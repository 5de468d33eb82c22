!> The tangential problem of one step: stick, slip and tractions on a known contact.
!>
!> Given the displacement DX of the road against the rubber, find the traction T within the bound of the friction law
!> such that the slip r = DX - A T is zero where T is inside its bound, and has the direction of slip v of the law
!> where it is on it (thesis, eq. 3.1). A is the tangential compliance of the solid. The bound is a circle or an
!> ellipse about T* = -P grad H, and v is about the direction of D = T - T* (modules `friction_law`,
!> `friction_problem`).
!>
!> Which points stick is not known beforehand. A method (module `friction_method`) therefore starts from a guess:
!> points whose T is on its bound slip in the direction of their traction, the others stick. In each iteration it
!> moves T so that r comes closer to 0 at sticking points and to the direction of v at slipping points. Then it
!> corrects the guess: a T outside its bound is returned to the bound, and its point counts as slipping in the next
!> iteration; a slipping point whose slip is opposed to its traction counts as sticking. The problem is solved when
!> the residual g is small at all points, because the guess is then right; module `friction_problem` defines g.
!>
!> The operator A is that of a shear modulus G = 1. For a time step with the modulus Q, the caller passes DX' = Q DX
!> and the traction T_h of the past: r = Q DX - A (T + T_h) is then Q times the slip, and the displacement is U = DX -
!> r/Q, without another product. With inertia the mean mode of the operator differs from that of the solid: the caller
!> sets it by `set_mean_compliance` of the operator's symbols.
!>
!> Methods: 'fast' (module `friction_cg_fast`, which falls back on `friction_cg_gradient`), 'gradient' (the fallback
!> alone) and 'thesis' (`friction_cg_thesis`). A solve has converged if the residual is within the tolerance and, with
!> `settle`, also the change |T' - T|/|T'| of the last move (thesis, eq. 3.15). A caller may ask for a smaller tolerance
!> than it needs; the solve has then converged as well if it ends within `accepted`. The residual is the largest of three
!> lengths over all points: the slip of a sticking point, the component of a slip perpendicular to v, and a slip
!> against v. It is relative to the largest of several scales: the rms of DX in the contact, that of A T, the offset
!> of a spring that pulls the road, and `least_scale`.
!>
!> A solve by 'fast' that starts with hardly any traction begins on a coarser grid if there are many cells in contact
!> (module `friction_start`). Otherwise its first iterations, half of them or more, would only find out which cells slip.
!> Where the road is pulled, with adhesion, where cells touch in parts, and where more than a tenth of the cells start with a
!> traction, it begins on the grid itself: a traction that is given, that of a far slip which is expected, or the least one
!> that a slope steeper than mu allows. Such starts are better than a solution on a coarser grid.
!>
!> Memory in addition to the caller's fields, in fields of doubles: two for the spectrum of the operator (four on a free
!> grid), two for that of the preconditioner, 3/4 for the symbols of the latter, and about one for the prediction of the
!> length of a step (module `friction_form`); and 18 fields that contain only the cells in contact, with rows as long as
!> the longest one (module `contact_runs`). The fallback takes four more of these from its first use on. A start on a
!> coarser grid takes a sixteenth of all this, and of the caller's fields, and frees it again.
!>
!> examples/friction_iterations and docs/benchmarks.md show how the number of iterations depends on the mesh. An
!> iteration of 'fast' takes one product of the operator, and one product of its preconditioner on the grid without
!> padding. With the slope effect there is no proof of convergence. On slopes steeper than 1/mu the traction has no bound
!> uphill. If many points are on such slopes, a solution may not be found, or may not exist.
module friction_cg
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use fft_conv, only : convolution_type, new_convolution
   use friction_cg_fast, only : friction_fast_type, new_friction_fast
   use friction_cg_gradient, only : friction_gradient_type
   use friction_cg_thesis, only : friction_thesis_type
   use friction_fields, only : friction_fields_type, friction_work_type
   use friction_law, only : friction_law_type
   use friction_method, only : friction_goal_type, friction_method_type
   use friction_problem, only : friction_problem_type
   use friction_pull, only : friction_pull_type
   use friction_start, only : coarse_friction_type, new_coarse_friction
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use, intrinsic :: iso_fortran_env, only : int64
   use omp_lib, only : omp_get_wtime
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : reason_converged, reason_iterations, reason_shape, reason_unmade, solver_result_type
   implicit none
   private

   public :: friction_fields_type, friction_solver_type, new_friction_solver

   integer, parameter :: most_moves = 60         !! largest number of moves of the springs
   integer, parameter :: idle_moves = 3          !! moves in full slip with little gain after which the pull is too large
   real(dp), parameter :: least_gain = 0.01_dp   !! part of the missing pull that a move must supply
   real(dp), parameter :: most_longer = 10.0_dp  !! factor by which the next move may be longer
   !> If the mean compliance divided by the length of the map exceeds this, the fast method treats the mean mode
   !> separately. Below this value, that would cost iterations; above it, it saves them.
   real(dp), parameter :: thick = 0.2_dp
   !> A solve that starts along an expected slip continues to `aim` times its tolerance (but not below `resolved`,
   !> a residual near the round-off). Otherwise it would often end just below the tolerance, with an error of the
   !> friction above it.
   real(dp), parameter :: aim = 0.3_dp, resolved = 1.0e-10_dp
   real(dp), parameter :: few = 0.1_dp           !! part of the cells in contact that may start with a traction
   integer, parameter :: many_cells = 2000       !! in contact, for which a start from a coarser grid pays
   real(dp), parameter :: least_ratio = 2.0_dp   !! cells of the grid to one of the coarser grid
   real(dp), parameter :: rough_tolerance = 1.0e-2_dp   !! of the solution on the coarser grid
   integer, parameter :: most_rough_iterations = 30

   !> The solver for one operator, kept from solve to solve. A variable of this type must not be copied.
   type :: friction_solver_type
      real(dp) :: tolerance = 1.0e-6_dp          !! at which the iterations end
      real(dp) :: accepted = 0.0_dp              !! if larger: what suffices where the tolerance cannot be reached
      integer :: max_iterations = 1000
      !> T must have settled, too: |T' - T|/|T'| <= tolerance. Otherwise only the displacements are accurate to the
      !> tolerance, and T is less accurate.
      logical :: settle = .true.
      !> Least scale of the residual, in the units of DX': the size of the terms of DX', which may cancel.
      real(dp) :: least_scale = 0.0_dp
      !> The slip that may be an error of a solve, and the one that the last solve has left as an error at most, in the
      !> units of DX'. Both are set by `solve`.
      real(dp) :: allowed_slip = 0.0_dp, reached_slip = 0.0_dp
      logical :: near = .false.                  !! T starts near the solution, as in a step like the last
      !> Cells in contact from which a solve without a first T starts on a coarser grid.
      integer :: coarse_start_from = huge(1)
      type(friction_pull_type) :: pull           !! prescribed total of T, and the position of the road
      class(friction_method_type), allocatable, private :: method
      type(friction_work_type), private :: work
      logical, private :: periodic = .true.
      real(dp), private :: length = 0.0_dp       !! of the longer side, m
      real(dp), private :: compliance = 0.0_dp   !! a_0
   contains
      procedure :: solve
      procedure :: destroy
   end type friction_solver_type

contains

   !> Make the solver for an operator of a tangential kernel.
   subroutine new_friction_solver(self, grid, operator, error, method)
      type(friction_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(convolution_type), intent(in) :: operator
      type(error_type), allocatable, intent(out) :: error
      character(*), intent(in), optional :: method   !! 'fast' (default), 'thesis' or 'gradient'
      type(friction_fast_type), allocatable :: fast
      character(:), allocatable :: chosen

      if (operator%components /= 2) then
         call fail(error, error_input, 'the operator of a friction solver must be that of a tangential kernel')
         return
      end if
      self%periodic = grid%boundary == boundary_periodic
      self%length = max(grid%lx, grid%ly)
      self%compliance = operator%symbols%self_compliance(with_mean=.not. self%periodic)
      if (self%compliance <= 0.0_dp) self%compliance = self%length     ! one cell has no modes
      chosen = 'fast'
      if (present(method)) chosen = method
      select case (chosen)
      case ('thesis')
         allocate (friction_thesis_type :: self%method)
      case ('gradient')
         allocate (friction_gradient_type :: self%method)
      case ('fast')
         allocate (fast)
         call new_friction_fast(fast, grid, operator%kernel, self%compliance, error)
         self%coarse_start_from = many_cells
         call move_alloc(fast, self%method)
      case default
         call fail(error, error_input, "method = '"//chosen//"': must be 'fast', 'thesis' or 'gradient'")
      end select
   end subroutine new_friction_solver

   !> Solve for T, starting from the T given.
   recursive subroutine solve(self, operator, law, fields, result)
      class(friction_solver_type), intent(inout), target :: self
      type(convolution_type), intent(inout) :: operator
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields     !! its targets are changed: T, r and the states
      type(solver_result_type), intent(out) :: result
      type(friction_problem_type) :: problem
      type(friction_goal_type) :: goal
      integer(int64) :: coarse_ffts

      call result%refuse(fault_of_friction(self, operator, law, fields))
      if (result%reason /= '') return
      result%seconds = omp_get_wtime()
      result%required = max(self%tolerance, self%accepted)
      result%ffts = -operator%ffts - self%method%ffts
      goal = friction_goal_type(tolerance=self%tolerance, most_iterations=self%max_iterations)
      call set_problem(self, operator, law, fields, problem)
      call problem%place_start(operator)
      coarse_ffts = 0
      if (pays_to_start_coarser(self, problem)) call start_on_coarse_grid(self, operator, problem, coarse_ffts)
      call problem%measure_start(operator)
      if (10*problem%foreseen > problem%cells) &
         goal%tolerance = max(aim*self%tolerance, min(self%tolerance, resolved))
      self%method%stopped = .false.

      ! This loop ends in the first round, except if the slip of the solution was computed by recurrence. Such a slip
      ! has accumulated round-off and proves nothing: it is computed again, and the iterations continue if necessary.
      do
         if (problem%residual > goal%tolerance) &
            call self%method%iterate(problem, operator, goal, result%iterations)
         if (self%method%stopped) exit
         result%converged = problem%solved(result%required)
         if (result%converged .and. any(self%pull%along)) &
            call match_pull(self, problem, operator, result%required, result%iterations, result%converged)
         if (problem%fresh) exit

         call problem%refresh_slip(operator)
         if (problem%residual <= self%tolerance .or. .not. result%converged) exit
      end do

      call problem%finish()
      result%stopped = self%method%stopped
      self%allowed_slip = result%required*problem%scale
      self%reached_slip = max(problem%residual, resolved)*problem%scale
      result%residual = problem%residual
      result%load_error = self%pull%missing_part(problem)
      result%reason = reason(self, problem, result)
      call self%pull%detach(problem, operator)
      result%ffts = result%ffts + operator%ffts + self%method%ffts + coarse_ffts
      result%seconds = omp_get_wtime() - result%seconds
   end subroutine solve

   !> Does it save time to find the first T on a coarser grid? Without friction it is zero in any case.
   pure logical function pays_to_start_coarser(self, problem) result(yes)
      class(friction_solver_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem

      yes = problem%loaded <= few*problem%cells .and. problem%bounds > 0.0_dp .and. problem%cells >= self%coarse_start_from &
         .and. .not. any(self%pull%along) .and. .not. associated(problem%fields%share) &
         .and. problem%law%adhesive_pressure <= 0.0_dp
   end function pays_to_start_coarser

   !> Let a solve from rest start from a rough solution on a coarser grid.
   recursive subroutine start_on_coarse_grid(self, operator, problem, ffts)
      class(friction_solver_type), intent(in) :: self
      type(convolution_type), intent(inout) :: operator
      type(friction_problem_type), intent(inout) :: problem
      integer(int64), intent(out) :: ffts            !! in transforms of the grid
      type(coarse_friction_type), target :: coarse
      type(friction_solver_type) :: solver
      type(convolution_type) :: coarse_operator
      type(solver_result_type) :: result
      type(error_type), allocatable :: error
      real(dp) :: cells                              !! to a coarse one
      integer :: c

      ffts = 0
      call new_coarse_friction(coarse, operator, problem%fields, problem%law%slope_effect)
      cells = operator%grid%cells()/coarse%grid%cells()
      if (cells < least_ratio) return
      call new_convolution(coarse_operator, coarse%grid, operator%kernel, error)
      if (.not. allocated(error)) call new_friction_solver(solver, coarse%grid, coarse_operator, error)
      if (allocated(error)) return
      if (self%periodic) then
         do c = 1, 2
            call coarse_operator%symbols%set_mean_mode(c, cells*operator%symbols%mean_mode(c))
         end do
      end if

      solver%tolerance = max(rough_tolerance, self%tolerance)
      solver%max_iterations = min(most_rough_iterations, self%max_iterations)
      solver%settle = .false.
      solver%least_scale = self%least_scale
      call solver%solve(coarse_operator, problem%law, coarse%fields(), result)
      ffts = nint(result%ffts/cells, int64)
      if (result%converged) then
         call coarse%give_start(problem%fields)
         problem%fields%slip_unit = 0.0_dp           ! what was expected of the slip is worth less than this start
         call problem%place_start(operator)
      end if

      call solver%destroy()
      call coarse_operator%destroy()
   end subroutine start_on_coarse_grid

   !> Make the problem from the caller's fields and settings. A road that is pulled is attached to its springs.
   subroutine set_problem(self, operator, law, fields, problem)
      class(friction_solver_type), intent(inout), target :: self
      type(convolution_type), intent(inout) :: operator
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields
      type(friction_problem_type), intent(out) :: problem

      problem%fields = fields
      problem%work => self%work
      problem%law = law
      problem%nx = operator%nx
      problem%rows = operator%rows
      problem%threads = operator%threads
      problem%compliance = self%compliance
      problem%settle = self%settle
      problem%near = self%near
      problem%least_scale = self%least_scale
      if (self%periodic .and. operator%symbols%mean_mode(1)*operator%grid%cells() > thick*self%length) &
         problem%mean_compliance = operator%symbols%mean_mode(1)
      call self%pull%attach(problem, operator, thick*self%length)
   end subroutine set_problem

   !> What is wrong with the arguments of a solve; empty if nothing is.
   function fault_of_friction(self, operator, law, fields) result(text)
      class(friction_solver_type), intent(in) :: self
      type(convolution_type), intent(in) :: operator
      type(friction_law_type), intent(in) :: law
      type(friction_fields_type), intent(in) :: fields
      character(:), allocatable :: text

      text = ''
      if (.not. allocated(self%method)) then
         text = reason_unmade
      else if (.not. law%legal) then
         text = 'the friction law is unknown, or one of its constants is missing or outside its range'
      else if (.not. fields%fit_grid(operator%grid, law%slope_effect)) then
         text = reason_shape
      end if
   end function fault_of_friction

   !> The reason why the solve ended.
   function reason(self, problem, result) result(text)
      class(friction_solver_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem
      type(solver_result_type), intent(in) :: result
      character(:), allocatable :: text

      if (problem%cells == 0) then
         text = 'no contact'
      else if (result%converged) then
         text = reason_converged
      else if (self%pull%slides_off) then
         text = 'the pull is more than the friction'
      else if (.not. ieee_is_finite(problem%residual)) then
         text = 'not a number'
      else if (problem%residual <= result%required .and. result%load_error > result%required) then
         text = 'the total of the traction does not reach the pull'
      else if (result%iterations >= self%max_iterations) then
         text = reason_iterations
      else
         text = 'no direction of descent'
      end if
   end function reason

   !> Move the ends of the springs until the total of T equals the pull. A plain move is the missing total times the
   !> compliance of the springs. Without slopes it cannot go beyond the solution. `gained` is the part of the missing total
   !> that a move has supplied.
   !>
   !> Near full slip each move gains less than the one before. Therefore the next move is longer (`factor`) if a move
   !> gained little. If a longer move has gone too far, the ends are between the last two places, and this interval is
   !> halved (`reach`) until plain moves are longer. A mass that is softer than the springs may have to move far; if all
   !> points slip, its place follows at once from the force that is missing. If nothing is gained in full slip while the
   !> road moves further and further from its place, the pull exceeds the friction, and the road returns to where the
   !> springs began.
   subroutine match_pull(self, problem, operator, required, iterations, converged)
      type(friction_solver_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: required               !! residual and missing part that suffice
      integer, intent(inout) :: iterations
      logical, intent(out) :: converged
      real(dp) :: before(2), after(2), factor, first(2), gained, plain(2), reach
      integer :: k, idle
      logical :: leaves                              !! the move leads away from the place of the road

      if (problem%cells == 0) then
         ! Without contact only a mass can take the pull.
         call problem%move_spring_end(self%pull%softness*problem%spring%compliance*self%pull%missing_total(problem))
         self%pull%slides_off = self%pull%missing_part(problem) > self%tolerance
         converged = .not. self%pull%slides_off
         return
      end if
      first = problem%spring%end
      factor = 1.0_dp
      reach = 0.0_dp
      idle = 0
      do k = 1, most_moves
         converged = problem%solved(required)
         if (.not. converged) return
         if (self%pull%missing_part(problem) <= self%tolerance) return
         before = self%pull%missing_total(problem)
         plain = problem%spring%compliance*before
         if (reach > 0.0_dp) then
            factor = max(1.0_dp, reach/norm2(plain))
         else if (problem%slipping == problem%cells) then
            factor = max(factor, self%pull%softness)
         end if
         leaves = dot_product(plain, problem%spring%offset - self%pull%rest) > 0.0_dp &
            .and. .not. self%pull%softness > 0.0_dp
         call move_springs(self, problem, operator, factor*plain, iterations)
         if (self%method%stopped) exit
         after = self%pull%missing_total(problem)
         gained = dot_product(before, before - after)/max(dot_product(before, before), tiny(1.0_dp))
         idle = merge(idle + 1, 0, problem%slipping == problem%cells .and. gained < least_gain .and. leaves)
         if (idle >= idle_moves) exit
         if (factor > 1.0_dp .and. (reach > 0.0_dp .or. gained > 1.0_dp)) then
            reach = 0.5_dp*factor*norm2(plain)
         else
            reach = 0.0_dp
            factor = max(1.0_dp, min(most_longer*factor, factor/max(gained, least_gain)))
         end if
      end do

      ! The tolerance was not reached. What was reached may suffice.
      converged = problem%solved(required) .and. self%pull%missing_part(problem) <= required
      self%pull%slides_off = idle >= idle_moves .and. self%pull%missing_part(problem) > required
      if (self%pull%slides_off) call problem%move_spring_end(first - problem%spring%offset)
   end subroutine match_pull

   !> Move the ends of the springs by a distance, and solve the contact again.
   subroutine move_springs(self, problem, operator, shift, iterations)
      type(friction_solver_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: shift(2)               !! m
      integer, intent(inout) :: iterations
      type(friction_goal_type) :: goal

      call problem%move_spring_end(shift)
      ! A move smaller than the tolerance must still change T, so the tolerance shrinks with the move.
      goal%tolerance = max(1.0e-3_dp*self%tolerance, &
         min(self%tolerance, 0.1_dp*norm2(shift)/problem%scale))
      goal%most_iterations = self%max_iterations
      if (problem%residual > goal%tolerance) call self%method%iterate(problem, operator, goal, iterations)
      if (.not. problem%fresh) call problem%refresh_slip(operator)
   end subroutine move_springs

   !> Free the plans of the method.
   subroutine destroy(self)
      class(friction_solver_type), intent(inout) :: self

      if (allocated(self%method)) call self%method%destroy()
   end subroutine destroy

end module friction_cg
