!> The interface of all methods for the tangential problem.
!>
!> A method iterates on a `friction_problem_type` until the problem is solved. It may also give up; the solver
!> then finds that `solved` is false. A method calls `stop_is_due` (module `stop_watch`) once in each iteration, and
!> returns with `stopped` if a stop is due. To add a method, extend the type, and add its name to
!> `new_friction_solver` of module `friction_cg`.
module friction_method
   use asperity_precision, only : dp, int64
   use fft_conv, only : convolution_type
   use friction_problem, only : friction_problem_type
   implicit none
   private

   public :: friction_goal_type, friction_method_type

   !> The conditions under which an iteration ends.
   type :: friction_goal_type
      real(dp) :: tolerance = 1.0e-6_dp      !! of the residual and of the change of T
      integer :: most_iterations = 1000      !! counted over all calls of a solve
      real(dp) :: fall = 0.0_dp              !! also stop when the residual has fallen by this factor
   end type friction_goal_type

   !> A method with its work fields. A variable of this type must not be copied.
   type, abstract :: friction_method_type
      integer(int64) :: ffts = 0             !! transforms so far, without those of the operator
      logical :: stopped = .false.           !! the last call of `iterate` was stopped
   contains
      procedure(iterate_method), deferred :: iterate
      procedure :: destroy
   end type friction_method_type

   abstract interface

      !> Iterate until the problem is solved, a limit of the goal is reached, or the method gives up. On entry and on
      !> return the slip and its measures are those that belong to T.
      subroutine iterate_method(self, problem, operator, goal, iterations)
         import :: convolution_type, friction_goal_type, friction_method_type, friction_problem_type
         implicit none
         class(friction_method_type), intent(inout) :: self
         type(friction_problem_type), intent(inout) :: problem
         type(convolution_type), intent(inout) :: operator
         type(friction_goal_type), intent(in) :: goal
         integer, intent(inout) :: iterations         !! of the solve so far
      end subroutine iterate_method

   end interface

contains

   !> Free the plans of a method. Here there are none.
   subroutine destroy(self)
      class(friction_method_type), intent(inout) :: self
   end subroutine destroy

end module friction_method
