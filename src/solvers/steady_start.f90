!> Start values for steady sliding with friction: the contact without friction, whose cells all slide along the motion
!> of the road.
module steady_start
   use asperity_precision, only : dp
   use friction_law, only : friction_law_type
   use normal_state, only : normal_problem_type
   use solver_result, only : solver_result_type
   use steady_contact, only : steady_contact_type
   use steady_normal, only : steady_normal_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_without_friction, ratio_of_sliding

   real(dp), parameter :: rough = 1e-2_dp              !! tolerance of the frictionless contact

contains

   !> Solve the contact without friction on the road as it was read last. All cells slide along the motion of the road.
   subroutine contact_without_friction(solver, operator, task, direction, contact, outcome)
      type(steady_normal_type), intent(inout) :: solver
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: direction(2)             !! e
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: outcome
      type(normal_problem_type) :: start
      integer :: c

      start = task
      start%tolerance = max(task%tolerance, rough)
      start%warm = .false.
      call solver%solve(operator, start, contact%height, contact%pressure, contact%gap, contact%level, outcome)
      contact%displacement = 0.0_dp
      do c = 1, 2
         contact%slip(:, c, :) = direction(c)
      end do
      contact%offset = 0.0_dp
   end subroutine contact_without_friction

   !> The ratio of T to P, or to the strength, of a cell that slides along the motion of the road.
   subroutine ratio_of_sliding(law, direction, ratio)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: direction(2)             !! e
      real(dp), intent(inout) :: ratio(:, :, :)        !! [nx, 2, rows]
      integer :: c

      do c = 1, 2
         ratio(:, c, :) = merge(1.0_dp, law%reach_coefficient(), law%jumps_at_edge())*direction(c)
      end do
   end subroutine ratio_of_sliding

end module steady_start
