!> Solves a state of steady sliding with friction for all cells at once, if the rounds of `steady_friction` stall.
!>
!> The equations are those of module `joint_system` with U_z = K P, the road read at x + A_T T, and the slip
!> r |V|. They contain the third state of a cell, between open and in contact, so that constant shear is
!> solved in its closed form: without a gap and without pressure, a cell may carry a share of the strength.
!> Its traction then has no jump at the edge of the contact, where the plain law often has no solution.
!>
!> An evaluation takes eight transforms.
module steady_joint
   use asperity_interpolation, only : interpolation_type
   use asperity_precision, only : dp
   use field_sums, only : field_count, field_mean, field_sum, largest_of_rows, row_totals
   use friction_law, only : friction_law_type
   use joint_newton, only : joint_newton_type
   use joint_system, only : joint_state_type, joint_system_type
   use normal_state, only : normal_problem_type, reason_converged
   use solver_result, only : solver_result_type
   use steady_contact, only : judge_gap, read_road, steady_contact_type
   use steady_operator, only : steady_operator_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: attempt_due, steady_joint_type

   integer, parameter :: first_attempt = 150           !! rounds before the first attempt; twice as many before the second
   integer, parameter :: first_with_jump = 100         !! the same where the traction jumps at the edge
   integer, parameter :: most_evaluations = 2000       !! of an attempt

   !> The equations of a state.
   type, extends(joint_system_type) :: steady_system_type
      type(steady_operator_type), pointer :: operator => null()
      type(interpolation_type), pointer :: road => null()
      type(steady_contact_type), pointer :: contact => null()
      real(dp) :: base(2) = 0.0_dp                     !! displacement of the road, m
      real(dp) :: direction(2) = 0.0_dp                !! e
      real(dp) :: c = 0.0_dp                           !! c_t, Pa
      real(dp) :: target = 0.0_dp                      !! mean pressure, Pa
   contains
      procedure :: evaluate
   end type steady_system_type

   !> The method and its work space. A variable of this type must not be copied.
   type :: steady_joint_type
      real(dp) :: base(2) = 0.0_dp                     !! as in the equations
      real(dp) :: direction(2) = 0.0_dp
      real(dp) :: c = 0.0_dp
      type(steady_system_type), private :: system
      type(joint_newton_type), private :: newton
   contains
      procedure :: solve
   end type steady_joint_type

contains

   !> The number of the attempt that is due after this many rounds without convergence; 0 if none is due.
   pure function attempt_due(law, rounds) result(attempt)
      type(friction_law_type), intent(in) :: law
      integer, intent(in) :: rounds
      integer :: attempt
      integer :: first

      first = merge(first_with_jump, first_attempt, law%jumps_at_edge())
      attempt = 0
      if (rounds == first) attempt = 1
      if (rounds == 2*first) attempt = 2
   end function attempt_due

   !> Solve, starting from a contact. If this fails, the contact is undefined.
   subroutine solve(self, law, operator, task, road, contact, normal, rubbing)
      class(steady_joint_type), intent(inout) :: self
      type(friction_law_type), intent(in) :: law
      type(steady_operator_type), intent(inout), target :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout), target :: road
      type(steady_contact_type), intent(inout), target :: contact
      type(solver_result_type), intent(inout) :: normal, rubbing
      logical :: solved

      normal%converged = .false.
      rubbing%converged = .false.
      if (.not. self%newton%ready) call self%newton%prepare(operator%grid)
      if (.not. self%newton%ready) return
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
         system%most_evaluations = most_evaluations
         system%rules%law = law
         call start(system, self%newton%now)
         call self%newton%solve(system, task%tolerance, solved)
         normal%stopped = stop_is_due()
         if (solved) call hand_out(system, self%newton%now, task, normal, rubbing)
      end associate
   end subroutine solve

   !> Set the units, and make the first state from that of the contact.
   subroutine start(system, begun)
      type(steady_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: begun
      logical, allocatable :: touching(:, :)
      real(dp) :: slope                                !! rms of the road
      integer :: c

      associate (contact => system%contact, rules => system%rules)
         touching = contact%pressure > 0.0_dp
         call find_softness(system%operator, rules%soft, rules%soft_along)
         slope = sqrt(field_mean(contact%slope_x**2 + contact%slope_y**2))
         call system%take_units(touching, contact%pressure, slope)
         if (.not. allocated(system%width)) allocate (system%width, mold=contact%pressure)
         system%width(:, :) = merge(rules%width, 0.0_dp, rules%has_jump(contact%slope_x, contact%slope_y))
         begun%s(:, :) = rules%number_of(system%width, touching, contact%pressure, contact%gap)
         do c = 1, 2
            begun%t(:, c, :) = merge(contact%traction(:, c, :), 0.0_dp, touching)
         end do
         begun%level = contact%level
      end associate
   end subroutine start

   !> Displacements of a cell under its own unit pressure and traction, m/Pa.
   subroutine find_softness(operator, soft, soft_along)
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(out) :: soft, soft_along
      real(dp), allocatable :: load(:, :), u(:, :), traction(:, :, :), shear(:, :, :), stretch(:, :, :)

      allocate (load(operator%nx, operator%rows), u(operator%nx, operator%rows), source=0.0_dp)
      allocate (traction(operator%nx, 2, operator%rows), shear(operator%nx, 2, operator%rows), &
         stretch(operator%nx, 2, operator%rows), source=0.0_dp)
      if (operator%grid%first_row == 1 .and. operator%rows > 0) load(1, 1) = 1.0_dp
      call operator%displace(load, u)
      soft = field_sum(load*u)
      traction(:, 1, :) = load
      call operator%shear(traction, shear, stretch)
      soft_along = field_sum(load*shear(:, 1, :))
   end subroutine find_softness

   !> Compute the residuals of a state.
   subroutine evaluate(self, state)
      class(steady_system_type), intent(inout) :: self
      type(joint_state_type), intent(inout) :: state

      self%evaluations = self%evaluations + 1
      associate (contact => self%contact)
         contact%pressure(:, :) = self%rules%pressure_of(self%width, state%s)
         contact%traction(:, :, :) = state%t
         call self%operator%displace(contact%pressure, contact%gap)
         call self%operator%shear(contact%traction, contact%displacement, contact%slip)
         call read_road(contact, self%road, self%base, self%direction)
      end associate
      call compare(self, self%contact, state)
   end subroutine evaluate

   !> Compute the residuals of each cell, where U_z is in the place of the gap, and that of the load.
   subroutine compare(self, contact, state)
      type(steady_system_type), intent(in) :: self
      type(steady_contact_type), intent(in) :: contact
      type(joint_state_type), intent(inout) :: state
      real(dp), allocatable :: rows(:, :), largest(:)
      real(dp) :: sums(2), share, slope(2), stretch
      integer :: i, j

      allocate (rows(2, self%grid%rows()), largest(self%grid%rows()))
      stretch = self%c*self%rules%soft_along           ! converts r to a length: T + c_t r is returned to the bound
      slope = 0.0_dp
      !$omp parallel do default(none) shared(self, contact, state, rows, largest, stretch) &
      !$omp private(i, j, share) firstprivate(slope)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            if (self%rules%law%slope) slope = [contact%slope_x(i, j), contact%slope_y(i, j)]
            share = self%rules%share_of(self%width(i, j), state%s(i, j))
            state%left(i, 1, j) = (contact%gap(i, j) - contact%height(i, j) - state%level &
               - self%rules%gap_of(state%s(i, j)))/self%unit_length
            state%left(i, 2:3, j) = self%rules%lacking(share, contact%pressure(i, j), slope, &
               stretch*contact%slip(i, :, j), state%t(i, :, j))/self%unit_traction
         end do
         rows(:, j) = [sum(state%left(:, :, j)**2), sum(contact%pressure(:, j))]
         largest(j) = maxval(abs(state%left(:, :, j)))
      end do
      sums = row_totals(rows)
      state%left_load = (sums(2)/self%grid%cells() - self%target)/self%unit_pressure
      state%worst = max(largest_of_rows(largest), abs(state%left_load))
      state%left_load = state%left_load*self%root
      state%merit = sqrt(sums(1) + state%left_load**2)
   end subroutine compare

   !> Copy the solution to the contact, and compute its errors.
   subroutine hand_out(system, found, task, normal, rubbing)
      type(steady_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: found
      type(normal_problem_type), intent(in) :: task
      type(solver_result_type), intent(inout) :: normal, rubbing
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(2)
      integer :: j

      call system%evaluate(found)
      associate (contact => system%contact, rules => system%rules)
         call judge_gap(contact, system%operator, task, normal)
         allocate (rows(2, system%grid%rows()))
         do j = 1, system%grid%rows()
            rows(1, j) = sum((found%left(:, 2:3, j)*system%unit_traction)**2)
            rows(2, j) = sum(contact%traction(:, :, j)**2)
         end do
         sums = row_totals(rows)
         rubbing%residual = sqrt(sums(1)/max(sums(2), tiny(1.0_dp)))
         rubbing%converged = rubbing%residual <= task%tolerance
         ! On slopes above 1/mu the third state replaces the jump from stick to open, which is not part of any law.
         if (.not. rules%law%jumps_at_edge()) rubbing%converged = rubbing%converged .and. &
            .not. field_count(found%s >= 0.0_dp .and. found%s < system%width) > 0.0_dp
         if (rubbing%converged) rubbing%reason = reason_converged
      end associate
   end subroutine hand_out

end module steady_joint
