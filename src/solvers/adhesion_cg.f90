!> Adhesive contact: one solver for periodic and free grids, fast and by the thesis's method.
!>
!> Module adhesion_state has the problem and its equations, adhesion_cg_periodic and adhesion_cg_free
!> the fast method, adhesion_cg_thesis the thesis's.
module adhesion_cg
   use adhesion_cg_free, only : adhesion_free_type, new_adhesion_free
   use adhesion_cg_periodic, only : adhesion_periodic_type, new_adhesion_periodic
   use adhesion_cg_thesis, only : adhesion_thesis_type, new_adhesion_thesis
   use adhesion_state, only : adhesion_problem_type, control_approach
   use finite_fields, only : reject_overflow
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : global_max, thread_count
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_solver_type, new_adhesion_solver

   integer, parameter :: kind_periodic = 1
   integer, parameter :: kind_free = 2
   integer, parameter :: kind_thesis = 3

   !> The solver with its operators and work fields, kept from step to step. Not to be copied.
   type :: adhesion_solver_type
      integer, private :: kind = kind_periodic
      type(adhesion_periodic_type), private :: periodic
      type(adhesion_free_type), private :: free
      type(adhesion_thesis_type), private :: thesis
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_solver_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_solver(self, grid, poisson, error, method, preconditioner)
      type(adhesion_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      type(error_type), allocatable, intent(out) :: error
      character(*), intent(in), optional :: method          !! 'fast' (default) or 'thesis' (periodic)
      character(*), intent(in), optional :: preconditioner  !! 'coarse' (default) or 'full', of 'fast'
      character(16) :: name, form

      name = 'fast'
      if (present(method)) name = method
      form = 'coarse'
      if (present(preconditioner)) form = preconditioner
      if (name == 'thesis') then
         self%kind = kind_thesis
         call new_adhesion_thesis(self%thesis, grid, poisson, error)
      else if (name /= 'fast') then
         call fail(error, error_input, "method = '"//trim(name)//"': must be 'fast' or 'thesis'")
      else if (grid%boundary == boundary_periodic) then
         self%kind = kind_periodic
         call new_adhesion_periodic(self%periodic, grid, poisson, trim(form), error)
      else
         self%kind = kind_free
         call new_adhesion_free(self%free, grid, poisson, trim(form), error)
      end if
   end subroutine new_adhesion_solver

   !> Solve an adhesive contact problem. Not converging is an outcome, with its reason by name: the
   !> state reached is handed out.
   !>
   !> Start: in periodic mode `gap`; in free mode `pressure` with `level` (the level is the target where
   !> that is prescribed). With problem%full_contact from there instead.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, history)
      class(adhesion_solver_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), intent(inout) :: gap(:, :)             !! g >= 0, 0 in contact, m
      real(dp), intent(inout) :: pressure(:, :)        !! P, attraction included, Pa
      real(dp), intent(inout) :: level                 !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa
      type(adhesion_problem_type) :: task

      task = problem
      task%datum = global_max(maxval(height))
      if (problem%control == control_approach) task%target = problem%target + task%datum
      level = level + task%datum
      select case (self%kind)
      case (kind_periodic)
         call self%periodic%solve(task, height, gap, pressure, level, outcome, history)
      case (kind_free)
         call self%free%solve(task, height, gap, pressure, level, outcome, history)
      case (kind_thesis)
         call self%thesis%solve(task, height, gap, pressure, level, outcome, history)
      end select
      call reject_overflow(outcome, gap, pressure, thread_count())
      level = level - task%datum
      if (problem%control == control_approach) level = problem%target
   end subroutine solve

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_solver_type), intent(inout) :: self

      call self%periodic%destroy()
      call self%free%destroy()
      call self%thesis%destroy()
   end subroutine destroy

end module adhesion_cg
