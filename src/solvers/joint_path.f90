!> Follows a path of solutions from one that is known to the one that is sought (pseudo-arclength continuation).
!>
!> On the path the road is read between an origin (part 0) and the displacement that the tractions cause (part 1). For a
!> step the origin is the place of the last pass, whose result solves the equations at part 0; in steady sliding it is the
!> undeformed surface (module `steady_joint`). On steep roads the path often turns
!> back before it reaches 1, because contacts snap to other places: there are several solutions for some parts, and none
!> nearby for a larger part. The part is therefore an unknown (module `joint_plane`), and steps are measured along the path.
!> Each solution is predicted by the tangent at the last one. A step is halved if Newton's method does not succeed.
!>
!> If a cell opens or closes, the path has a kink, and it may turn there by more than a right angle. No step along the
!> tangent then succeeds, and a solution for a larger part is sought from the last one (`leap`).
module joint_path
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use joint_linear, only : is_to_end
   use joint_newton, only : joint_newton_type
   use joint_plane, only : distance
   use joint_system, only : joint_state_type, joint_system_type
   implicit none
   private

   public :: follow_path

   integer, parameter :: steps_to_halve = 3            !! of Newton's method, in which the residual must be halved
   integer, parameter :: few_steps = 3                 !! of Newton's method, after which the next step may be longer
   real(dp), parameter :: rough = 1.0e-2_dp            !! tolerance of the solutions along the path
   real(dp), parameter :: first_part = 0.25_dp         !! of the way from the origin
   real(dp), parameter :: growth = 1.5_dp              !! of a step that succeeded
   real(dp), parameter :: shortest = 1.0e-4_dp         !! step
   real(dp), parameter :: leaps(4) = [0.1_dp, 0.03_dp, 0.3_dp, 0.01_dp]   !! changes of the part, in the order of trial

contains

   !> Follow the path from the solution at part 0 in `newton%now`. If this succeeds, the solution is there.
   subroutine follow_path(newton, system, tolerance, solved)
      class(joint_newton_type), intent(inout) :: newton
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: tolerance                !! of the last solution
      logical, intent(out) :: solved
      type(joint_state_type) :: before, met, ahead     !! the last two solutions, and a state on the tangent
      real(dp) :: step                                 !! length
      integer :: status(3)

      call before%make_room(system%grid, status(1))
      call met%make_room(system%grid, status(2))
      call ahead%make_room(system%grid, status(3))
      solved = .not. any_process(any(status /= 0))
      if (solved) call newton%linear%plane%make_fields(system%grid, solved)
      if (.not. solved) return

      call find_first_two(newton, system, before, met, solved)
      if (solved) step = distance(system, before, met)
      do while (solved .and. abs(newton%now%part - 1.0_dp) > 0.0_dp)
         call newton%linear%plane%place(system, before, met, met)
         call newton%find_ahead(system, met, ahead, solved)
         if (solved) call take_step(newton, system, tolerance, before, met, ahead, step, solved)
         if (.not. (solved .or. is_to_end(system))) call leap(newton, system, tolerance, before, met, step, solved)
      end do
      newton%linear%plane%active = .false.
      newton%now%part = 1.0_dp
   end subroutine follow_path

   !> Find the solutions at part 0 and at the first part, which is halved until there is one.
   subroutine find_first_two(newton, system, before, met, solved)
      class(joint_newton_type), intent(inout) :: newton
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: before, met
      logical, intent(out) :: solved
      real(dp) :: part

      newton%steps_to_halve = 0
      newton%now%part = 0.0_dp
      call newton%solve(system, rough, solved)
      if (.not. solved) return

      call before%copy(newton%now)
      newton%steps_to_halve = steps_to_halve
      part = first_part
      do
         newton%now%part = part
         call newton%solve(system, rough, solved)
         part = 0.5_dp*part
         if (solved .or. part < shortest .or. is_to_end(system)) exit
         call newton%now%copy(before)
      end do
      call met%copy(newton%now)
   end subroutine find_first_two

   !> Take a step along the tangent, or the last step to part 1. It is shortened until there is a solution.
   subroutine take_step(newton, system, tolerance, before, met, ahead, step, solved)
      class(joint_newton_type), intent(inout) :: newton
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: tolerance                !! of the last solution
      type(joint_state_type), intent(inout) :: before, met
      type(joint_state_type), intent(in) :: ahead      !! on the tangent at the last solution
      real(dp), intent(inout) :: step                  !! length; out: of the next one
      logical, intent(out) :: solved
      real(dp) :: length, reach, speed
      logical :: at_end, shortened

      length = distance(system, met, ahead)
      speed = (ahead%part - met%part)/length
      shortened = .false.
      do
         reach = step
         at_end = met%part + speed*step >= 1.0_dp
         if (at_end) reach = (1.0_dp - met%part)/speed
         call predict(met, ahead, reach/length, newton%now)
         if (at_end) then
            newton%linear%plane%active = .false.
            newton%now%part = 1.0_dp
            call newton%solve(system, tolerance, solved)
         else
            call newton%linear%plane%place(system, met, ahead, newton%now)
            call newton%solve(system, rough, solved)
         end if
         if (solved) exit
         step = 0.5_dp*reach
         shortened = .true.
         if (step < shortest .or. is_to_end(system)) return
      end do

      call before%copy(met)
      call met%copy(newton%now)
      if (.not. shortened .and. newton%steps <= few_steps) step = growth*step
   end subroutine take_step

   !> Leap from the end of a path to a solution for a larger part, on the rest of the path behind a kink or on another path.
   subroutine leap(newton, system, tolerance, before, met, step, solved)
      class(joint_newton_type), intent(inout) :: newton
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: tolerance                !! of the last solution
      type(joint_state_type), intent(inout) :: before, met
      real(dp), intent(out) :: step                    !! length of the next step
      logical, intent(out) :: solved
      integer :: k

      newton%linear%plane%active = .false.
      do k = 1, size(leaps)
         call newton%now%copy(met)
         newton%now%part = min(met%part + leaps(k), 1.0_dp)
         call newton%solve(system, merge(rough, tolerance, newton%now%part < 1.0_dp), solved)
         if (solved .or. is_to_end(system)) exit
      end do
      call before%copy(met)
      call met%copy(newton%now)
      step = min(distance(system, before, met), leaps(1))
   end subroutine leap

   !> Predict a state on the straight line from one state through another.
   subroutine predict(from, through, ratio, next)
      type(joint_state_type), intent(in) :: from, through
      real(dp), intent(in) :: ratio                    !! distance from the first one, relative to their distance
      type(joint_state_type), intent(inout) :: next
      integer :: c, j

      next%level = from%level + ratio*(through%level - from%level)
      next%part = from%part + ratio*(through%part - from%part)
      do j = 1, size(next%s, 2)
         next%s(:, j) = from%s(:, j) + ratio*(through%s(:, j) - from%s(:, j))
         do c = 1, 2
            next%t(:, c, j) = merge(from%t(:, c, j) + ratio*(through%t(:, c, j) - from%t(:, c, j)), 0.0_dp, &
               next%s(:, j) >= 0.0_dp)
         end do
      end do
   end subroutine predict

end module joint_path
