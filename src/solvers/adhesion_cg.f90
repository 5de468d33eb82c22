!> Adhesive contact: one solver for periodic and free grids, with the fast method or that of the thesis.
!>
!> Module `adhesion_state` defines the problem and its equations, and `adhesion_method` the interface of a method;
!> `adhesion_patch` contains the differences between the grids; `adhesion_cg_fast` is the fast method, and
!> `adhesion_cg_thesis` that of the thesis.
module adhesion_cg
   use adhesion_cg_fast, only : adhesion_fast_type, new_adhesion_fast
   use adhesion_cg_thesis, only : adhesion_thesis_type, new_adhesion_thesis
   use adhesion_method, only : adhesion_method_type
   use adhesion_patch, only : adhesion_contact_type
   use adhesion_state, only : adhesion_problem_type, control_approach
   use finite_fields, only : reject_overflow
   use contact_solver, only : check_normal_kernel
   use asperity_errors, only : error_input, error_type, fail
   use asperity_threads, only : thread_count
   use field_sums, only : field_maximum
   use kernels, only : kernel_type
   use normal_state, only : fault_of_problem, normal_problem_type
   use asperity_precision, only : dp
   use omp_lib, only : omp_get_wtime
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_solver_type, new_adhesion_solver

   !> The solver with its operators and work fields, kept from step to step. A variable of this type must not be
   !> copied.
   type :: adhesion_solver_type
      type(grid_type), private :: grid
      class(adhesion_method_type), allocatable, private :: method
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_solver_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_solver(self, grid, kernel, error, method)
      type(adhesion_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel               !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      character(*), intent(in), optional :: method          !! 'fast' (default) or 'thesis' (periodic)
      type(adhesion_fast_type), allocatable :: fast
      type(adhesion_thesis_type), allocatable :: thesis
      character(:), allocatable :: chosen

      call check_normal_kernel(kernel, error)
      if (allocated(error)) return
      self%grid = grid
      chosen = 'fast'
      if (present(method)) chosen = method
      select case (chosen)
      case ('fast')
         allocate (fast)
         call new_adhesion_fast(fast, grid, kernel, error)
         call move_alloc(fast, self%method)
      case ('thesis')
         allocate (thesis)
         call new_adhesion_thesis(thesis, grid, kernel, error)
         call move_alloc(thesis, self%method)
      case default
         call fail(error, error_input, "method = '"//chosen//"': must be 'fast' or 'thesis'")
      end select
   end subroutine new_adhesion_solver

   !> Solve an adhesive contact problem. A solve that does not converge is an outcome with a reason; the fields then
   !> hold the state that was reached, which has the lowest energy so far.
   !>
   !> In periodic mode the solve starts from `gap`, and in free mode from `pressure` and `level` (from the target
   !> instead of `level` if the level is prescribed). With problem%full_contact it starts from full contact.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, past)
      class(adhesion_solver_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous, target :: height(:, :)       !! H, [nx, rows], m
      real(dp), intent(inout), contiguous, target :: gap(:, :)       !! g >= 0, 0 in contact, m
      real(dp), intent(inout), contiguous, target :: pressure(:, :)  !! P, attraction included, Pa
      real(dp), intent(inout) :: level                 !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), target, optional :: past(:, :)  !! P_h, Pa
      type(adhesion_contact_type) :: contact
      real(dp) :: started

      ! The pressure may be negative here, unlike that of a normal contact without adhesion.
      call outcome%refuse(fault_of_problem(normal_problem_type(modulus=problem%modulus, control=problem%control), &
         self%grid, height, pressure, gap, past))
      if (outcome%reason /= '') return
      started = omp_get_wtime()
      contact%problem = problem
      contact%height => height
      contact%gap => gap
      contact%pressure => pressure
      if (present(past)) contact%past => past

      ! The methods measure heights and levels from the highest point of the road.
      associate (task => contact%problem)
         task%datum = field_maximum(height)
         contact%level = level + task%datum
         if (problem%control == control_approach) then
            task%target = problem%target + task%datum
            contact%level = task%target
         end if
      end associate
      call self%method%solve(contact, outcome)
      if (outcome%stopped) return

      call reject_overflow(outcome, gap, pressure, thread_count())
      level = contact%level - contact%problem%datum
      if (problem%control == control_approach) level = problem%target
      outcome%seconds = omp_get_wtime() - started
   end subroutine solve

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_solver_type), intent(inout) :: self

      if (allocated(self%method)) call self%method%destroy()
   end subroutine destroy

end module adhesion_cg
