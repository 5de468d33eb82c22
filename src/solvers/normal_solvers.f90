!> The choice of a solver for normal contact without adhesion, by the name of its method.
module normal_solvers
   use contact_solver, only : contact_solver_type
   use asperity_errors, only : error_input, error_type, fail
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_cg_thesis, only : new_thesis_solver, thesis_solver_type
   use kernels, only : kernel_type
   use regular_grid, only : grid_type
   implicit none
   private

   public :: new_contact_solver

contains

   !> Make a solver.
   subroutine new_contact_solver(self, method, grid, kernel, error, mixed)
      class(contact_solver_type), allocatable, intent(out) :: self
      character(*), intent(in) :: method               !! 'fast' or 'thesis'
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: mixed           !! steps in single precision; 'fast' only
      type(normal_solver_type), allocatable :: fast
      type(thesis_solver_type), allocatable :: thesis

      select case (method)
      case ('fast')
         allocate (fast)
         call new_normal_solver(fast, grid, kernel, error, mixed)
         call move_alloc(fast, self)
      case ('thesis')
         allocate (thesis)
         call new_thesis_solver(thesis, grid, kernel, error)
         call move_alloc(thesis, self)
      case default
         call fail(error, error_input, 'method = '''//method//''': must be ''fast'' or ''thesis''')
      end select
   end subroutine new_contact_solver

end module normal_solvers
