!> Steady sliding with friction: the pressure, the traction, and the road under the displaced rubber, solved together.
!>
!> The unknowns are the state z of the normal solver (module `steady_normal`), the displacement u at which the road is
!> read, and the slip r = e + du/ds, where e is the direction of the motion of the road and d/ds the derivative along
!> it. One round of the iteration is
!>
!>     P = pressure of z;   T = bound(P (T/P) + c_t r)                      (module steady_bound)
!>     u' = A_T T - offset;   r' = e + d(A_T T)/ds                          six transforms
!>     u+ = u + beta (u' - u);   r+ = r + beta (r' - r)
!>     read the road at x + u+: H, grad H
!>     z+ = some plain steps of the normal solver on H                      two transforms each
!>
!> The offset is the mean of A_T T weighted by P. The road is read relative to this mean displacement, so that the
!> contact stays where it is on the grid; the caller moves the road by the offset afterwards. With the slope effect T
!> contains -P grad H, which contributes eigenvalues of about -(1..2) |grad H|^2 to du'/du. The relaxation by beta damps
!> them. Near the solution Anderson acceleration of (z, u) takes over, and r is combined with the same coefficients. Far
!> from the solution the acceleration diverges (module `steady_pace`).
!>
!> A contact has converged if the duality gap of P on the road at x + u, with u = A_T T of the final traction, and
!> |bound(T + c_t r) - T|/|T| are below the tolerance. Both are recomputed from P and T (module `steady_judge`).
!>
!> If the rounds stall, all cells are solved at once, starting from the contact of the least error or on a path from the
!> contact without friction (module `steady_joint`). If that fails, too, the result is the contact of the least error.
!>
!> Memory beside the caller's fields, in fields of doubles: 21, 60 for the acceleration of the rounds, and 8 for that of
!> the normal solver.
module steady_friction
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use anderson, only : anderson_type, new_anderson
   use field_sums, only : field_count, field_mean, field_sum, ratio_of_lengths, row_total
   use friction_law, only : friction_law_type
   use asperity_interpolation, only : displaced, interpolation_type, shifted
   use normal_state, only : normal_problem_type, prepare_problem, reason_iterations
   use asperity_precision, only : dp, int64
   use projection, only : project_simplex
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   use steady_bound, only : bound_tractions, compare_tractions, largest_force
   use steady_contact, only : contact_mean, explain, read_road, sliding_outcome_type, steady_contact_type
   use steady_joint, only : steady_joint_type
   use steady_judge, only : new_sliding, sliding_type
   use steady_measure, only : steady_measure_type
   use steady_normal, only : new_steady_normal, steady_normal_type
   use steady_operator, only : steady_operator_type
   use steady_scale, only : is_time_to_rescale
   use steady_start, only : contact_without_friction, ratio_of_sliding
   use steady_pace, only : along_path, along_second_path, components, from_here, new_pace, no_attempt, pace_type
   implicit none
   private

   public :: new_steady_friction, steady_friction_type

   integer, parameter :: pairs = 10              !! of the acceleration
   integer, parameter :: doubtful = 100          !! rounds after which the best contact is kept
   integer, parameter :: check_every = 25        !! rounds between two checks whether a contact is the best
   real(dp), parameter :: scale_of_slip = 5.0_dp !! c_t over the largest friction force of the mean pressure in contact

   !> Work fields. A variable of this type must not be copied.
   type, extends(sliding_type) :: steady_friction_type
      type(steady_normal_type) :: normal
      real(dp), allocatable, private :: state(:, :, :)     !! z, u, r [nx, 5, rows]
      real(dp), allocatable, private :: residual(:, :, :)  !! change of the state by a round
      real(dp), allocatable, private :: place(:, :, :)     !! u+, m [nx, 2, rows]
      type(anderson_type), private :: memory
      type(steady_joint_type), private :: joint
   contains
      procedure :: solve
   end type steady_friction_type

contains

   !> Allocate the work fields.
   subroutine new_steady_friction(self, grid, law)
      type(steady_friction_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(friction_law_type), intent(in) :: law
      integer :: rows

      call new_sliding(self%sliding_type, grid, law)
      call new_steady_normal(self%normal, grid)
      rows = grid%rows()
      allocate (self%state(grid%nx, components, rows), self%residual(grid%nx, components, rows), &
         self%place(grid%nx, 2, rows), source=0.0_dp)
      call new_anderson(self%memory, grid%nx, components, rows, pairs)
   end subroutine new_steady_friction

   !> Solve for the steady state on a road. Not converging is an outcome.
   subroutine solve(self, operator, problem, road, contact, outcome)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout), target :: operator   !! with its symbols set
      type(normal_problem_type), intent(in) :: problem     !! if warm, pressure, gap and traction are a start
      type(interpolation_type), intent(inout), target :: road
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(out) :: outcome
      type(steady_measure_type) :: measure
      type(pace_type) :: pace
      real(dp) :: change, largest
      integer(int64) :: before
      logical :: determined, overflows

      before = operator%ffts
      self%operator => operator
      self%road => road
      call prepare_problem(problem, self%grid, operator%threads, contact%height, self%task, determined)
      call begin(self, contact, outcome%normal)
      if (outcome%normal%stopped) return
      pace = new_pace(self%law)
      pace%accepted = self%task%tolerance
      outcome%normal%reason = reason_iterations
      outcome%tangential%reason = reason_iterations
      do
         call round(self, pace, contact, measure, change)
         largest = max(change, measure%change/measure%size)
         outcome%tangential%iterations = outcome%tangential%iterations + 1
         outcome%normal%iterations = outcome%normal%iterations + pace%inner
         outcome%normal%stopped = stop_is_due()
         if (outcome%normal%stopped) return

         if (largest <= pace%accepted .and. measure%error <= self%task%tolerance) then
            call examine(self, contact, outcome)
            if (outcome%converged()) exit
            pace%accepted = 0.5_dp*pace%accepted
         end if
         overflows = .not. (ieee_is_finite(change) .and. ieee_is_finite(measure%change))
         if (overflows .or. outcome%tangential%iterations >= self%task%max_iterations) then
            call give_up(self, pace, overflows, contact, outcome)
            exit
         end if

         if (outcome%tangential%iterations >= doubtful .and. mod(outcome%tangential%iterations, check_every) == 0) &
            call keep_best(self, pace, contact)
         call pace%choose_attempt(outcome%tangential%iterations, largest, self%task%tolerance, self%grid%cells())
         if (pace%attempt /= no_attempt) then
            call solve_at_once(self, pace, contact, outcome)
            if (outcome%normal%stopped .or. outcome%converged()) exit
         end if
         call advance(self, pace, outcome%tangential%iterations, largest, measure)
      end do
      outcome%normal%ffts = operator%ffts - before
   end subroutine solve

   !> Make the first state from the given contact, or from the solution without friction.
   subroutine begin(self, contact, normal)
      class(steady_friction_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: normal
      integer :: c

      call self%memory%forget()
      call ratio_of_sliding(self%law, self%direction, self%ratio)
      if (self%task%warm) then
         call self%normal%start(self%operator, self%task, contact%height, contact%pressure, contact%gap)
         call self%operator%shear(contact%traction, contact%displacement, contact%slip)
         call read_road(contact, self%road, self%base, self%direction)
         call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      else
         call contact_without_friction(self%normal, self%operator, self%task, self%direction, contact, normal)
         if (normal%stopped) return
      end if
      self%state(:, 1, :) = self%normal%z
      do c = 1, 2
         self%state(:, 1 + c, :) = contact%displacement(:, c, :) - contact%offset(c)
         self%state(:, 3 + c, :) = contact%slip(:, c, :)
      end do
      self%c = scale_of_slip*largest_force(self%law, field_sum(contact%pressure) &
         /max(field_count(contact%pressure > 0.0_dp), 1.0_dp))
   end subroutine begin

   !> Do one round: compute the residual of the state. The contact receives P, T, A_T T and the road at u+.
   subroutine round(self, pace, contact, measure, change)
      class(steady_friction_type), intent(inout) :: self
      type(pace_type), intent(in) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(steady_measure_type), intent(out) :: measure    !! of the last normal step
      real(dp), intent(out) :: change                      !! |u' - u|/|u'|
      real(dp) :: mean
      integer :: c, j, k

      contact%pressure(:, :) = self%state(:, 1, :)
      call project_simplex(contact%pressure, self%task%target*self%grid%cells())
      call bound_tractions(self%law, self%c, contact%pressure, contact%slope_x, contact%slope_y, &
         self%ratio, self%state(:, 4:5, :), contact%traction)
      call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      call self%operator%shear(contact%traction, contact%displacement, contact%slip)
      contact%offset = contact_mean(contact)
      do c = 1, 2
         !$omp parallel do default(none) shared(self, contact, pace, c) private(j)
         do j = 1, self%grid%rows()
            self%residual(:, 1 + c, j) = pace%beta*(contact%displacement(:, c, j) - contact%offset(c) &
               - self%state(:, 1 + c, j))
            self%residual(:, 3 + c, j) = pace%beta*(self%direction(c) + contact%slip(:, c, j) &
               - self%state(:, 3 + c, j))
            self%place(:, c, j) = self%state(:, 1 + c, j) + self%residual(:, 1 + c, j)
         end do
      end do
      change = relative_change(self, pace%beta)
      call read_place(self, contact)
      mean = field_mean(contact%height)
      self%normal%z(:, :) = self%state(:, 1, :)
      do k = 1, pace%inner
         call self%normal%evaluate(self%operator, self%task, contact%height, mean, self%normal%z, measure)
         self%normal%z = self%normal%z + self%normal%residual
      end do
      self%residual(:, 1, :) = self%normal%z - self%state(:, 1, :)
   end subroutine round

   !> Read the road at u+.
   subroutine read_place(self, contact)
      class(steady_friction_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact

      call displaced(self%road, self%base(1), self%base(2), self%place(:, 1, :), self%place(:, 2, :), &
         contact%height, contact%slope_x, contact%slope_y)
   end subroutine read_place

   !> Complete the present contact and compute its errors. If it has not converged, the road and the ratio of the
   !> traction are restored, so that the check does not affect the rounds.
   subroutine examine(self, contact, outcome)
      class(steady_friction_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome
      real(dp), allocatable :: ratio(:, :, :)

      allocate (ratio, source=self%ratio)
      call complete(self, contact, outcome)
      if (outcome%converged()) return
      self%ratio(:, :, :) = ratio
      call read_place(self, contact)
   end subroutine examine

   !> Compute the error of the present contact, and keep the contact if it is the best so far.
   subroutine keep_best(self, pace, contact)
      class(steady_friction_type), intent(inout) :: self
      type(pace_type), intent(inout) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type) :: outcome

      call examine(self, contact, outcome)
      call self%keep(outcome%residual(), contact, pace%best)
   end subroutine keep_best

   !> End the rounds, after the largest number or because the state has overflowed, with the best contact and the reason why
   !> there may be no solution. If the state overflowed before any contact was kept, the best one is that without friction.
   subroutine give_up(self, pace, overflows, contact, outcome)
      class(steady_friction_type), intent(inout) :: self
      type(pace_type), intent(in) :: pace
      logical, intent(in) :: overflows                 !! the present contact is not finite
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome
      type(solver_result_type) :: start

      outcome%normal%reason = reason_iterations
      outcome%tangential%reason = reason_iterations
      if (overflows) then
         outcome%tangential%residual = huge(1.0_dp)
      else
         call complete(self, contact, outcome)
      end if
      if (overflows .and. pace%best >= huge(1.0_dp)) then
         call without_friction(self, contact, start)
         outcome%normal%stopped = start%stopped
         if (start%stopped) return
         call self%judge(contact, outcome)
      else
         call self%return_to_best(pace%best, contact, outcome)
      end if
      call explain(contact, self%law, outcome)
   end subroutine give_up

   !> The contact without friction, with the traction of full sliding under its pressure.
   subroutine without_friction(self, contact, start)
      class(steady_friction_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: start

      call shifted(self%road, self%base(1), self%base(2), contact%height, contact%slope_x, contact%slope_y)
      call contact_without_friction(self%normal, self%operator, self%task, self%direction, contact, start)
      if (start%stopped) return
      call ratio_of_sliding(self%law, self%direction, self%ratio)
      call bound_tractions(self%law, self%c, contact%pressure, contact%slope_x, contact%slope_y, self%ratio, &
         contact%slip, contact%traction)
   end subroutine without_friction

   !> Solve all cells at once, starting from the present contact, from the best one, or from that without friction,
   !> because on steep roads the best one may be far from the solution. If this fails, the rounds continue unchanged.
   subroutine solve_at_once(self, pace, contact, outcome)
      class(steady_friction_type), intent(inout) :: self
      type(pace_type), intent(in) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome
      type(solver_result_type) :: start
      real(dp), allocatable :: ratio(:, :, :)
      real(dp) :: scale

      allocate (ratio, source=self%ratio)
      scale = self%normal%c
      call complete(self, contact, outcome)
      if (pace%attempt /= from_here) call self%return_to_best(pace%best, contact, outcome)
      if (pace%attempt == along_path .or. pace%attempt == along_second_path) then
         call without_friction(self, contact, start)
         outcome%normal%stopped = start%stopped
         if (outcome%normal%stopped) return
      end if
      self%joint%direction = self%direction
      self%joint%base = self%base
      self%joint%c = self%c
      self%joint%attempt = pace%attempt
      self%joint%affordable = pace%expected
      call self%joint%solve(self%law, self%operator, self%task, self%road, contact, outcome)
      if (outcome%normal%stopped .or. outcome%converged()) return

      ! The next round needs the scale of the normal solver, the ratio of the traction and the road as before.
      self%normal%c = scale
      call self%operator%set_scale(scale)
      self%ratio(:, :, :) = ratio
      call read_place(self, contact)
   end subroutine solve_at_once

   !> |u' - u|/|u'|, from the relaxed change.
   function relative_change(self, beta) result(change)
      class(steady_friction_type), intent(in) :: self
      real(dp), intent(in) :: beta
      real(dp) :: change
      real(dp), allocatable :: rows(:, :)
      integer :: j

      allocate (rows(2, self%grid%rows()))
      do j = 1, self%grid%rows()
         rows(1, j) = sum(self%residual(:, 2:3, j)**2)
         rows(2, j) = sum((self%state(:, 2:3, j) + self%residual(:, 2:3, j)/beta)**2)
      end do
      change = ratio_of_lengths(rows)/beta
   end function relative_change

   !> Compute the next state by a relaxed or an accelerated step, and decide how the rounds continue.
   subroutine advance(self, pace, rounds, change, measure)
      class(steady_friction_type), intent(inout) :: self
      type(pace_type), intent(inout) :: pace
      integer, intent(in) :: rounds
      real(dp), intent(in) :: change
      type(steady_measure_type), intent(in) :: measure
      logical :: begins, changed

      call pace%choose(change, begins)
      if (begins) then
         pace%weights = 0.0_dp
         pace%weights(1) = 1.0_dp
         pace%weights(2:3) = measure%size/max(length_of(self), tiny(1.0_dp))
         call self%memory%forget()
      end if
      if (pace%accelerated) then
         call self%memory%step(pace%weights, self%residual, self%state, plain=.false.)
      else
         self%state = self%state + self%residual
         call pace%note_plain(change)
      end if
      if (.not. is_time_to_rescale(rounds)) return
      self%normal%z(:, :) = self%state(:, 1, :)
      call self%normal%rescale(self%operator, self%task, measure%scale, changed)
      if (.not. changed) return
      self%state(:, 1, :) = self%normal%z
      call self%memory%forget()
   end subroutine advance

   !> |u| of the state.
   function length_of(self) result(length)
      class(steady_friction_type), intent(in) :: self
      real(dp) :: length
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(self%grid%rows()))
      do j = 1, self%grid%rows()
         rows(j) = sum(self%state(:, 2:3, j)**2)
      end do
      length = sqrt(row_total(rows))
   end function length_of

   !> Complete the present contact: take the pressure of the normal solver, return T to its bound, and compute all fields
   !> that follow from both, and the errors.
   subroutine complete(self, contact, outcome)
      class(steady_friction_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome

      contact%pressure(:, :) = self%normal%pressure
      call self%bound_and_judge(contact, outcome)
   end subroutine complete

end module steady_friction
