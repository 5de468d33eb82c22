!> Newton's method for all unknowns of a contact with friction: the pressures, gaps, tractions and the level
!> (module `joint_system`).
!>
!> Module `joint_linear` computes Newton's steps. They are shortened if they do not reduce the residual. If the method
!> fails and a traction may jump, the equations are regularised: the pressure rises slightly with s in partly sheared
!> cells, which removes the jump. This rise is then reduced to zero (`reduce_rise`).
!>
!> Memory: 25 fields of doubles, the directions of GMRES with 3 numbers in single precision per unknown cell
!> and direction, and the approximate inverse; on a path 27 fields more. If there is not enough memory, nothing is solved.
module joint_newton
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_count
   use gmres, only : cell_vector_type
   use joint_linear, only : is_to_end, joint_linear_type
   use joint_system, only : joint_state_type, joint_system_type
   use regular_grid, only : grid_type
   implicit none
   private

   public :: joint_newton_type

   integer, parameter :: most_steps = 25
   real(dp), parameter :: diverged = 100.0_dp          !! a residual this much larger than the first ends the attempt
   real(dp), parameter :: idle = 1.0e-4_dp             !! part by which a step must reduce the residual
   !> Residual that may remain, over the tolerance, and its least value.
   real(dp), parameter :: part_of_tolerance = 1.0e-3_dp, round_off = 1.0e-11_dp
   real(dp), parameter :: lengths(10) = [1.0_dp, 0.7_dp, 0.5_dp, 0.3_dp, 0.15_dp, 0.07_dp, 0.03_dp, 0.01_dp, &
      0.003_dp, 0.001_dp]                              !! of a step, tried in this order
   ! The rise of the pressure in partly sheared cells:
   integer, parameter :: most_rises = 30               !! largest number of solves with a rise
   real(dp), parameter :: first_factor = 0.1_dp        !! from one solve to the next
   real(dp), parameter :: last_factor = 0.95_dp        !! the solutions end if even this factor fails
   real(dp), parameter :: least_rise = 1.0e-5_dp, most_rise = 1.0e2_dp

   !> The method and its work space. A variable of this type must not be copied.
   type :: joint_newton_type
      logical :: ready = .false.
      !> Number of steps in which the residual must be halved; otherwise the solve ends without trying a rise. 0: the
      !> residual may fall slowly.
      integer :: steps_to_halve = 0
      integer :: steps = 0                             !! of the last solve
      type(joint_linear_type) :: linear                !! the linear system of a step
      type(joint_state_type) :: now                    !! in: the start; out: the solution
      type(joint_state_type), private :: best          !! of the states after parts of a step
      type(joint_state_type), private :: begun         !! from which the present solve began
   contains
      procedure :: prepare
      procedure :: solve
      procedure :: find_ahead
      procedure :: destroy
   end type joint_newton_type

contains

   !> Allocate the states. If there is not enough memory, `ready` remains .false.
   subroutine prepare(self, grid)
      class(joint_newton_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer :: status(3)

      call self%now%make_room(grid, status(1))
      call self%best%make_room(grid, status(2))
      call self%begun%make_room(grid, status(3))
      call self%linear%make_fields(grid, self%ready)
      self%ready = self%ready .and. .not. any_process(any(status /= 0))
      if (.not. self%ready) call self%destroy()
   end subroutine prepare

   !> Solve a system from the state `now`.
   subroutine solve(self, system, tolerance, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: tolerance                !! of the solution; the equations are solved far better
      logical, intent(out) :: solved
      real(dp) :: goal

      goal = max(part_of_tolerance*tolerance, round_off)
      call self%begun%copy(self%now)
      call iterate(self, system, goal, solved)
      if (.not. solved .and. self%steps_to_halve == 0 .and. field_count(system%width > 0.0_dp) > 0) &
         call reduce_rise(self, system, goal, solved)
   end subroutine solve

   !> Do Newton's steps from the present state.
   subroutine iterate(self, system, goal, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: goal                     !! largest residual that may remain
      logical, intent(out) :: solved
      type(cell_vector_type) :: step
      real(dp) :: first, marked                        !! residuals at the start, and some steps ago
      integer :: k
      logical :: found

      call self%linear%evaluate(system, self%now)
      first = self%now%merit
      marked = first
      self%steps = 0
      do k = 1, most_steps
         if (.not. self%now%worst > goal .or. self%now%merit > diverged*first) exit
         if (is_to_end(system)) exit
         if (is_too_slow(self, k, marked)) exit
         call self%linear%newton_step(system, self%now, step, found)
         if (.not. found) exit
         call take_step(self, system, step, k)
         self%steps = k
      end do
      ! Residuals that are no numbers are not among the largest ones.
      solved = self%now%worst <= goal .and. self%now%merit < huge(1.0_dp)
   end subroutine iterate

   !> Has the residual not been halved in the number of steps that are allowed for it?
   function is_too_slow(self, k, marked) result(yes)
      class(joint_newton_type), intent(in) :: self
      integer, intent(in) :: k                         !! the step that follows
      real(dp), intent(inout) :: marked                !! residual when it was last checked
      logical :: yes

      yes = .false.
      if (self%steps_to_halve == 0) return
      if (modulo(k - 1, self%steps_to_halve) /= 0) return
      yes = k > 1 .and. self%now%merit > 0.5_dp*marked
      marked = self%now%merit
   end function is_too_slow

   !> Solve with a pressure that rises within the second range of s, and reduce this rise to zero step by step. Each
   !> solve starts from the solution before. If the first solve fails, the rise is made larger.
   subroutine reduce_rise(self, system, goal, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: goal
      logical, intent(out) :: solved
      real(dp) :: factor, last
      integer :: k
      logical :: met                                   !! the equations with the present rise are solved

      solved = .false.
      last = 0.0_dp
      factor = first_factor
      call set_rise(system, self%begun, 1.0_dp)
      do k = 1, most_rises
         if (is_to_end(system)) exit
         call self%now%copy(self%begun)
         call iterate(self, system, goal, met)
         solved = met .and. .not. system%rules%rise > 0.0_dp
         if (solved) exit
         if (met) then
            call self%begun%copy(self%now)
            last = system%rules%rise
            factor = max(factor**1.5_dp, first_factor)
            call set_rise(system, self%begun, merge(last*factor, 0.0_dp, last > least_rise))
         else if (.not. last > 0.0_dp) then
            call set_rise(system, self%begun, 10.0_dp*system%rules%rise)
         else
            factor = sqrt(factor)
            call set_rise(system, self%begun, last*factor)
         end if
         if (system%rules%rise > most_rise .or. factor > last_factor) exit
      end do
      system%rules%rise = 0.0_dp
   end subroutine reduce_rise

   !> Change the rise, and adjust s in cells with pressure so that their pressure does not change.
   subroutine set_rise(system, state, rise)
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: state
      real(dp), intent(in) :: rise
      real(dp) :: pressed, width
      integer :: i, j

      do j = 1, size(state%s, 2)
         do i = 1, size(state%s, 1)
            width = system%width(i, j)
            if (state%s(i, j) < width .or. .not. width > 0.0_dp) cycle
            pressed = state%s(i, j) - width + system%rules%rise*width
            if (pressed >= rise*width) then
               state%s(i, j) = pressed - rise*width + width
            else
               state%s(i, j) = pressed/rise
            end if
         end do
      end do
      system%rules%rise = rise
   end subroutine set_rise

   !> Find a state on the tangent of a path through a solution, ahead of it in the direction of the plane.
   subroutine find_ahead(self, system, met, ahead, found)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: met
      type(joint_state_type), intent(inout) :: ahead
      logical, intent(out) :: found
      type(cell_vector_type) :: tangent

      associate (linear => self%linear)
         call self%now%copy(met)
         call linear%evaluate(system, self%now)
         call linear%tangent(system, self%now, tangent, found)
         if (.not. found) return
         call linear%change(system, self%now, tangent)
         call linear%find_follow(system, self%now, removed=0.0_dp)
         call linear%add(system, self%now, tangent, 1.0_dp)
         call ahead%copy(linear%trial)
         ahead%s(:, :) = ahead%s + linear%follow
      end associate
   end subroutine find_ahead

   !> Take the step, or a part of it that reduces the residual.
   subroutine take_step(self, system, step, round)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(in) :: step
      integer, intent(in) :: round
      integer :: chosen, k

      call self%linear%change(system, self%now, step)
      call self%linear%find_follow(system, self%now, removed=1.0_dp)
      self%best%merit = huge(1.0_dp)
      do k = 1, size(lengths)
         call try_length(self, system, step, lengths(k))
         if (self%linear%trial%merit < self%best%merit) call self%best%copy(self%linear%trial)
         if (self%linear%trial%merit < (1.0_dp - 0.2_dp*lengths(k))*self%now%merit) then
            call self%now%copy(self%linear%trial)
            return
         end if
      end do
      if (round > 2 .and. self%best%merit >= (1.0_dp - idle)*self%now%merit) then
         ! No length reduces the residual. Take a short step nevertheless, to leave this point.
         chosen = 1 + modulo(7*round, 4)
         call try_length(self, system, step, lengths(chosen))
         call self%best%copy(self%linear%trial)
      end if
      call self%now%copy(self%best)
   end subroutine take_step

   !> Compute the state after a part of a step, as `trial`.
   subroutine try_length(self, system, step, length)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(in) :: step
      real(dp), intent(in) :: length
      integer :: c, j

      call self%linear%add(system, self%now, step, length)
      do j = 1, size(self%linear%follow, 2)
         self%linear%trial%s(:, j) = self%linear%trial%s(:, j) + length*self%linear%follow(:, j)
         do c = 1, 2
            where (self%linear%trial%s(:, j) < 0.0_dp) self%linear%trial%t(:, c, j) = 0.0_dp
         end do
      end do
      call self%linear%evaluate(system, self%linear%trial)
   end subroutine try_length

   !> Free the fields.
   subroutine destroy(self)
      class(joint_newton_type), intent(inout) :: self
      type(joint_state_type) :: none

      self%now = none
      call self%linear%destroy()
      self%best = none
      self%begun = none
      self%ready = .false.
   end subroutine destroy

end module joint_newton
