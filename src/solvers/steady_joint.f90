!> Solves a state of steady sliding with friction for all cells at once, if the rounds of `steady_friction` stall.
!>
!> The equations are those of module `joint_system` with U_z = K P, the road read at x + A_T T, and the slip speed
!> r |V|. With constant shear they contain a third state of a cell, between open and in contact: without a gap and
!> without pressure, a cell may carry a share of the strength. The traction then has no jump at the edge of the
!> contact. With the jump there is often no solution.
!>
!> Newton's method starts from a contact that is near the solution, or follows a path of solutions (module `joint_path`),
!> on which a part of the tangential displacement counts: in the slip and where the road is read, or, on the second path,
!> only where the road is read. One of the paths may end where the other one does not. An evaluation takes eight
!> transforms.
module steady_joint
   use asperity_interpolation, only : displaced, interpolation_type
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_count, field_mean, ratio_of_lengths
   use friction_law, only : friction_law_type
   use joint_newton, only : joint_newton_type
   use joint_path, only : follow_path
   use joint_system, only : joint_state_type, joint_system_type
   use joint_tiles, only : cell_responses_type, near_values, neither
   use normal_state, only : normal_problem_type, reason_converged
   use regular_grid, only : grid_type
   use steady_contact, only : judge_gap, read_road, sliding_outcome_type, steady_contact_type
   use steady_operator, only : steady_operator_type
   use steady_pace, only : along_path, along_second_path, from_here, no_attempt
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: steady_joint_type

   real(dp), parameter :: transforms = 8.0_dp          !! of an evaluation
   ! Newton's steps that must halve the residual, in an attempt from the present contact and in any other:
   integer, parameter :: near_steps = 1, far_steps = 3
   integer, parameter :: near_evaluations = 300        !! largest number in an attempt from the present contact
   integer, parameter :: most_evaluations = 4000       !! largest number in any other attempt, ...
   real(dp), parameter :: large = 16384.0_dp           !! ... on grids of this number of cells
   real(dp), parameter :: most_on_small = 2.0_dp       !! factor by which it may be larger on smaller grids
   !> Newton's method first solves to this number of tolerances. Its units differ from those of the errors, which often
   !> meet the tolerance then.
   real(dp), parameter :: accepted = 300.0_dp
   real(dp), parameter :: rough = 1.0e-2_dp            !! accuracy of GMRES far from a solution

   !> The equations of a state.
   type, extends(joint_system_type) :: steady_system_type
      type(steady_operator_type), pointer :: operator => null()
      type(interpolation_type), pointer :: road => null()
      type(steady_contact_type), pointer :: contact => null()
      real(dp) :: base(2) = 0.0_dp                     !! displacement of the road, m
      real(dp) :: direction(2) = 0.0_dp                !! e
      real(dp) :: c = 0.0_dp                           !! c_t, Pa
      real(dp) :: target = 0.0_dp                      !! mean pressure, Pa
      real(dp) :: part = 1.0_dp                        !! of the tangential displacement that counts
      logical :: slip_follows = .true.                 !! the slip counts only this part of the displacement, too
      type(cell_responses_type) :: whole               !! displacements around a loaded cell, if all of it counts
   contains
      procedure :: evaluate
      procedure :: slopes_at
      procedure :: slip_of
   end type steady_system_type

   !> The method and its work space. A variable of this type must not be copied.
   type :: steady_joint_type
      real(dp) :: base(2) = 0.0_dp                     !! as in the equations
      real(dp) :: direction(2) = 0.0_dp
      real(dp) :: c = 0.0_dp
      integer :: attempt = no_attempt                  !! where the solution starts (module steady_pace)
      real(dp) :: affordable = 0.0_dp                  !! transforms of an attempt from the present contact
      logical, private :: ready = .false.              !! the fields are allocated
      type(steady_system_type), private :: system
      type(joint_newton_type), private :: newton
   contains
      procedure :: solve
   end type steady_joint_type

contains

   !> Solve, starting from a contact. If this fails, the contact is undefined.
   subroutine solve(self, law, operator, task, road, contact, outcome)
      class(steady_joint_type), intent(inout) :: self
      type(friction_law_type), intent(in) :: law
      type(steady_operator_type), intent(inout), target :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout), target :: road
      type(steady_contact_type), intent(inout), target :: contact
      type(sliding_outcome_type), intent(inout) :: outcome
      logical :: begun, solved

      outcome%normal%converged = .false.
      outcome%tangential%converged = .false.
      if (.not. self%ready) call prepare(self, operator%grid)
      if (.not. self%ready) return
      associate (system => self%system)
         system%operator => operator
         system%road => road
         system%contact => contact
         system%grid = operator%grid
         system%base = self%base
         system%direction = self%direction
         system%c = self%c
         system%target = task%target
         system%evaluations = 0
         system%most_evaluations = budget(self, operator%grid%cells())
         system%rules%law = law
         call start(system, self%newton%now, begun)
         if (.not. begun) return
         ! A jump may need many steps, because cells change their state one after the other.
         self%newton%steps_to_halve = merge(near_steps, far_steps, self%attempt == from_here)
         if (law%jumps_at_edge()) self%newton%steps_to_halve = 0
         system%slip_follows = self%attempt /= along_second_path
         if (self%attempt == along_path .or. self%attempt == along_second_path) then
            call follow_path(self%newton, system, accepted*task%tolerance, solved)
         else
            call self%newton%solve(system, accepted*task%tolerance, solved)
         end if
         if (solved) call return_solution(system, self%newton%now, task, outcome)
         if (solved .and. .not. outcome%converged()) then
            call self%newton%solve(system, task%tolerance, solved)
            if (solved) call return_solution(system, self%newton%now, task, outcome)
         end if
         outcome%normal%stopped = stop_is_due()
      end associate
   end subroutine solve

   !> Allocate the fields. If there is not enough memory, `ready` remains .false.
   subroutine prepare(self, grid)
      class(steady_joint_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer :: status

      if (.not. self%newton%ready) call self%newton%prepare(grid)
      if (.not. self%newton%ready) return
      self%newton%linear%far_accuracy = rough
      allocate (self%system%width(grid%nx, grid%rows()), stat=status)
      self%ready = .not. any_process(status /= 0)
      if (.not. self%ready .and. allocated(self%system%width)) deallocate (self%system%width)
   end subroutine prepare

   !> The largest number of evaluations of an attempt. One from the present contact may take as many transforms as the
   !> rounds that it replaces. Others may take more on small grids, where they cost little time, and where contacts of few
   !> cells are the hardest to solve.
   pure function budget(self, cells) result(evaluations)
      class(steady_joint_type), intent(in) :: self
      real(dp), intent(in) :: cells                    !! of the grid
      integer :: evaluations

      if (self%attempt == from_here) then
         evaluations = nint(min(self%affordable/transforms, real(near_evaluations, dp)))
      else
         evaluations = nint(most_evaluations*min(max(sqrt(large/cells), 1.0_dp), most_on_small))
      end if
   end function budget

   !> Set the part of the tangential displacement that counts.
   pure subroutine count_part(system, part)
      class(steady_system_type), intent(inout) :: system
      real(dp), intent(in) :: part

      system%part = part
      system%near%place = part*system%whole%place
      if (system%slip_follows) system%near%slip = part*system%whole%slip
   end subroutine count_part

   !> Set the units of the equations, and make the first state from the contact. `done` is .false. if there is not enough
   !> memory.
   subroutine start(system, first, done)
      type(steady_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: first
      logical, intent(out) :: done

      associate (contact => system%contact, rules => system%rules)
         call find_responses(system, done)
         if (.not. done) return
         call system%begin(contact%pressure > 0.0_dp, contact%pressure, contact%gap, contact%traction, &
            rules%has_jump(contact%slope_x, contact%slope_y), &
            sqrt(field_mean(contact%slope_x**2 + contact%slope_y**2)), first)
         first%level = contact%level
      end associate
   end subroutine start

   !> Find the displacements around a cell under its unit pressure and its unit tractions: 14 transforms. `done` is
   !> .false. if there is not enough memory.
   subroutine find_responses(system, done)
      type(steady_system_type), intent(inout) :: system
      logical, intent(out) :: done
      real(dp), allocatable :: load(:, :), u(:, :), traction(:, :, :), shear(:, :, :), stretch(:, :, :)
      integer :: c, k, status(5)

      associate (operator => system%operator, near => system%whole)
         allocate (load(operator%nx, operator%rows), source=0.0_dp, stat=status(1))
         allocate (u(operator%nx, operator%rows), source=0.0_dp, stat=status(2))
         allocate (traction(operator%nx, 2, operator%rows), stat=status(3))
         allocate (shear(operator%nx, 2, operator%rows), stat=status(4))
         allocate (stretch(operator%nx, 2, operator%rows), stat=status(5))
         done = .not. any_process(any(status /= 0))
         if (.not. done) return

         if (operator%grid%first_row == 1 .and. operator%rows > 0) load(1, 1) = 1.0_dp
         call operator%displace(load, u)
         near%depth = near_values(operator%grid, u, neither)
         do c = 1, 2
            traction = 0.0_dp
            traction(:, c, :) = load
            call operator%shear(traction, shear, stretch)
            do k = 1, 2
               near%place(k, c, :, :) = near_values(operator%grid, shear(:, k, :), neither)
               near%slip(k, c, :, :) = near_values(operator%grid, stretch(:, k, :), neither)
            end do
         end do
         system%rules%soft = near%depth(0, 0)
         system%rules%soft_along = near%place(1, 1, 0, 0)
         near%slip = system%c*system%rules%soft_along*near%slip
         system%near = near
         system%part = 1.0_dp
      end associate
   end subroutine find_responses

   !> Compute the residuals of a state.
   subroutine evaluate(self, state)
      class(steady_system_type), intent(inout) :: self
      type(joint_state_type), intent(inout) :: state

      self%evaluations = self%evaluations + 1
      if (abs(state%part - self%part) > 0.0_dp) call count_part(self, state%part)
      associate (contact => self%contact)
         contact%pressure(:, :) = self%rules%pressure_of(self%width, state%s)
         contact%traction(:, :, :) = state%t
         call self%operator%displace(contact%pressure, contact%gap)
         call self%operator%shear(contact%traction, contact%displacement, contact%slip)
         if (abs(state%part - 1.0_dp) > 0.0_dp) then
            contact%displacement = state%part*contact%displacement
            if (self%slip_follows) contact%slip = state%part*contact%slip
         end if
         call read_road(contact, self%road, self%base, self%direction)
      end associate
      call compare(self, self%contact, state)
   end subroutine evaluate

   !> Compute the residuals of each cell, and that of the load.
   subroutine compare(self, contact, state)
      type(steady_system_type), intent(in) :: self
      type(steady_contact_type), intent(in) :: contact      !! its gap holds U_z
      type(joint_state_type), intent(inout) :: state
      integer :: i, j

      !$omp parallel do default(none) shared(self, contact, state) private(i, j)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            call self%cell_residual(state, i, j, contact%gap(i, j) - contact%height(i, j), contact%pressure(i, j), &
               [contact%slope_x(i, j), contact%slope_y(i, j)], self%slip_of(i, j))
         end do
      end do
      call self%sum_residuals(state, contact%pressure, self%target)
   end subroutine compare

   !> Read the slopes of the road near the displaced cells.
   subroutine slopes_at(self, shift, height, slope_x, slope_y)
      class(steady_system_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)
      real(dp), intent(out) :: height(:, :), slope_x(:, :), slope_y(:, :)
      real(dp) :: place(2)

      place = self%base + self%contact%offset - shift
      call displaced(self%road, place(1), place(2), self%contact%displacement(:, 1, :), &
         self%contact%displacement(:, 2, :), height, slope_x, slope_y)
   end subroutine slopes_at

   !> The slip of a cell as a length: T + c_t r is returned to the bound.
   pure function slip_of(self, i, j) result(slip)
      class(steady_system_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: slip(2)

      slip = self%c*self%rules%soft_along*self%contact%slip(i, :, j)
   end function slip_of

   !> Copy the solution to the contact, and compute its errors.
   subroutine return_solution(system, found, task, outcome)
      type(steady_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: found
      type(normal_problem_type), intent(in) :: task
      type(sliding_outcome_type), intent(inout) :: outcome
      real(dp), allocatable :: rows(:, :)
      integer :: j

      call system%evaluate(found)
      associate (contact => system%contact, rules => system%rules, tangential => outcome%tangential)
         call judge_gap(contact, system%operator, task, outcome%normal)
         allocate (rows(2, system%grid%rows()))
         do j = 1, system%grid%rows()
            rows(1, j) = sum((found%residual(:, 2:3, j)*system%unit_traction)**2)
            rows(2, j) = sum(contact%traction(:, :, j)**2)
         end do
         tangential%residual = ratio_of_lengths(rows)
         tangential%converged = tangential%residual <= task%tolerance
         ! On slopes above 1/mu the third state replaces the jump from stick to open, which is not part of any law.
         if (.not. rules%law%jumps_at_edge()) tangential%converged = tangential%converged .and. &
            .not. field_count(found%s >= 0.0_dp .and. found%s < system%width) > 0.0_dp
         if (tangential%converged) tangential%reason = reason_converged
      end associate
   end subroutine return_solution

end module steady_joint
