!> What a method for the tangential problem is.
!>
!> A method iterates on a `friction_problem_type` until it is solved. It may give up: the solver sees
!> from `solved` whether it has. It asks once in each iteration whether the solve is to be given up
!> (module `stop_watch`); if so it returns with `stopped`. To add a method: extend the type, and make it
!> in `choose_method` of module `friction_cg`.
module friction_method
   use asperity_precision, only : dp, int64
   use fft_conv, only : convolution_type
   use friction_problem, only : friction_problem_type
   implicit none
   private

   public :: friction_goal_type, friction_method_type

   !> When to stop.
   type :: friction_goal_type
      real(dp) :: tolerance = 1.0e-6_dp      !! of the residual and of the change of T
      integer :: most_iterations = 1000      !! counted over all calls of a solve
      real(dp) :: fall = 0.0_dp              !! stop where the residual has fallen by this factor, too
   end type friction_goal_type

   !> A method with its work fields. Not to be copied.
   type, abstract :: friction_method_type
      integer(int64) :: ffts = 0             !! transforms done so far beside those of the operator
      logical :: stopped = .false.           !! the last call of `iterate` was given up
   contains
      procedure(iterate_method), deferred :: iterate
      procedure(free_memory), deferred :: destroy
   end type friction_method_type

   abstract interface

      !> Iterate until the problem is solved, the goal's limits are reached, or the method gives up. On
      !> entry and on return the slip and its measures belong to T.
      subroutine iterate_method(self, problem, operator, goal, iterations)
         import :: convolution_type, friction_goal_type, friction_method_type, friction_problem_type
         implicit none
         class(friction_method_type), intent(inout) :: self
         type(friction_problem_type), intent(inout) :: problem
         type(convolution_type), intent(inout) :: operator
         type(friction_goal_type), intent(in) :: goal
         integer, intent(inout) :: iterations         !! of the solve so far
      end subroutine iterate_method

      !> Free plans and memory.
      subroutine free_memory(self)
         import :: friction_method_type
         implicit none
         class(friction_method_type), intent(inout) :: self
      end subroutine free_memory

   end interface

end module friction_method
