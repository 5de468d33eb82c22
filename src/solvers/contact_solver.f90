!> The interface of all solvers of normal contact without adhesion.
!>
!> Module `normal_solvers` chooses a solver by the name of its method.
module contact_solver
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : convolution_type
   use kernels, only : kernel_type
   use normal_state, only : normal_problem_type
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: check_normal_kernel, contact_solver_type

   !> A solver with its operator, kept from step to step. A variable of this type must not be copied.
   type, abstract :: contact_solver_type
      type(grid_type) :: grid
      type(convolution_type) :: operator           !! A for the shear modulus 1 Pa
   contains
      procedure(solve_contact), deferred :: solve
      procedure :: destroy
   end type contact_solver_type

   abstract interface
      !> Find the pressure P >= 0 under which gap >= 0 and P gap = 0.
      !>
      !> A solve that does not converge is an outcome and not an error. The fields then hold the state that was
      !> reached.
      subroutine solve_contact(self, problem, height, pressure, gap, level, outcome, past)
         import :: contact_solver_type, dp, normal_problem_type, solver_result_type
         class(contact_solver_type), intent(inout), target :: self
         type(normal_problem_type), intent(in) :: problem
         real(dp), contiguous, intent(in) :: height(:, :)        !! H, [nx, ny], m
         real(dp), contiguous, intent(inout) :: pressure(:, :)   !! P, Pa; in: a start if problem%warm
         real(dp), contiguous, intent(inout) :: gap(:, :)        !! U - H - level, m
         real(dp), intent(out) :: level                          !! U - H where the gap is zero, m
         type(solver_result_type), intent(out) :: outcome
         real(dp), intent(in), optional :: past(:, :)         !! P_h, traction of the past, Pa
      end subroutine solve_contact
   end interface

contains

   !> Refuse a kernel that is not a normal one.
   subroutine check_normal_kernel(kernel, error)
      type(kernel_type), intent(in) :: kernel
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error) .or. kernel%components == 1) return
      call fail(error, error_input, 'a solver of normal contact needs a normal kernel')
   end subroutine check_normal_kernel

   !> Free plans and memory.
   subroutine destroy(self)
      class(contact_solver_type), intent(inout) :: self

      call self%operator%destroy()
   end subroutine destroy

end module contact_solver
