!> Parts that the tests of adhesive contact share: a contact with its solver, its problem and its state.
module adhesion_fixture
   use adhesion_cg, only : adhesion_solver_type, new_adhesion_solver
   use adhesion_state, only : adhesion_problem_type
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use check, only : check_no_error, check_that
   use kernels, only : normal_half_space
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: contact_type, new_contact

   !> A contact, whose state each solve changes.
   type :: contact_type
      type(grid_type) :: grid
      type(adhesion_problem_type) :: problem
      real(dp), allocatable :: height(:, :)
      real(dp), allocatable :: gap(:, :)
      real(dp), allocatable :: pressure(:, :)
      real(dp) :: level = 0.0_dp
      type(solver_result_type) :: outcome              !! of the last solve
      type(adhesion_solver_type) :: solver
   contains
      procedure :: touch
      procedure :: solve
      procedure :: converge
      procedure :: destroy
   end type contact_type

contains

   !> Make a contact at first touch. The tests then set the problem, apart from the modulus.
   subroutine new_contact(self, grid, poisson, modulus, height, method)
      type(contact_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson, modulus
      real(dp), intent(in) :: height(:, :)
      character(*), intent(in), optional :: method     !! 'fast' (default) or 'thesis'
      type(error_type), allocatable :: error

      self%grid = grid
      self%height = height
      self%problem%modulus = modulus
      call self%touch()
      call new_adhesion_solver(self%solver, grid, normal_half_space(poisson), error, method)
      call check_no_error(error, 'a solver')
   end subroutine new_contact

   !> Return to first touch, without pressure.
   subroutine touch(self)
      class(contact_type), intent(inout) :: self

      self%gap = maxval(self%height) - self%height
      self%pressure = 0.0_dp*self%height
      self%level = 0.0_dp
   end subroutine touch

   !> Solve the problem from the present state.
   subroutine solve(self, past)
      class(contact_type), intent(inout) :: self
      real(dp), intent(in), optional :: past(:, :)     !! P_h, Pa

      call self%solver%solve(self%problem, self%height, self%gap, self%pressure, self%level, self%outcome, past)
   end subroutine solve

   !> Solve the problem from the present state, and check that the solver converges.
   subroutine converge(self, what, past)
      class(contact_type), intent(inout) :: self
      character(*), intent(in) :: what                 !! for the message
      real(dp), intent(in), optional :: past(:, :)     !! P_h, Pa

      call self%solve(past)
      call check_that(self%outcome%converged, what//': '//trim(self%outcome%reason))
   end subroutine converge

   !> Free the solver.
   subroutine destroy(self)
      class(contact_type), intent(inout) :: self

      call self%solver%destroy()
   end subroutine destroy

end module adhesion_fixture
