!> Steady sliding with friction: pressure, traction and the road under the displaced rubber at once.
!>
!> The unknowns are the state z of the normal solver (module `steady_normal`), the displacement u with which
!> the road is read, and the slip r = e + du/ds. One round of the iteration is
!>
!>     P = pressure of z;   T = bound(P (T/P) + c_t r)                      (module steady_bound)
!>     u' = A_T T - offset;   r' = e + d(A_T T)/ds                          six transforms
!>     u+ = u + beta (u' - u);   read the road at x + u+: H, grad H
!>     z+ = some plain steps of the normal solver under H                   two transforms each
!>
!> The offset is the mean of A_T T weighted by P: the road is read relative to the mean displacement of
!> the contact, so that the contact stays where it is on the grid. What is left out, `offset`, is how
!> much further the road stands. With slope, T holds -P grad H, which makes the passes over u return with
!> a factor of -(1..2) |grad H|^2: hence the relaxation by beta. Near the solution Anderson acceleration
!> of (z, u) finishes; r is carried along. From the start it diverges.
!>
!> Converged means: the duality gap of P under the road at x + u, u = A_T T of the traction handed out,
!> and |bound(T + c_t r) - T|/|T|, all recomputed, are below the tolerance (module `steady_judge`).
!>
!> Where the rounds stall, all cells are solved at once from the contact of the least error (module
!> `steady_joint`). If that fails, too, this contact is handed out.
!>
!> Memory beside the caller's: 19 fields, 50 for the acceleration in single precision, and 10 of doubles.
module steady_friction
   use anderson, only : anderson_type, new_anderson
   use field_sums, only : field_count, field_mean, field_sum, row_total
   use friction_law, only : friction_law_type
   use asperity_interpolation, only : displaced, interpolation_type, shifted
   use normal_state, only : normal_problem_type, prepare_problem, reason_iterations
   use asperity_precision, only : dp, int64
   use projection, only : project_simplex
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   use steady_bound, only : bound_tractions, compare_tractions, largest_force
   use steady_contact, only : contact_mean, explain, steady_contact_type
   use steady_joint, only : steady_joint_type
   use steady_judge, only : new_sliding, ratio_of_lengths, sliding_type
   use steady_normal, only : new_steady_normal, steady_measure_type, steady_normal_type
   use steady_operator, only : steady_operator_type
   use steady_start, only : contact_without_friction, full_sliding, ratio_of_sliding
   use steady_pace, only : along_path, along_second_path, components, from_here, no_attempt, pace_type
   implicit none
   private

   public :: new_steady_friction, steady_friction_type

   integer, parameter :: pairs = 10              !! of the acceleration
   integer, parameter :: doubtful = 100          !! rounds after which the best contact is kept
   integer, parameter :: looks = 25              !! rounds between two checks of it

   !> Work fields. A variable of this type must not be copied.
   type, extends(sliding_type) :: steady_friction_type
      type(steady_normal_type) :: normal
      real(dp), allocatable, private :: state(:, :, :)     !! z, u, r [nx, 5, rows]
      real(dp), allocatable, private :: residual(:, :, :)
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

   !> Solve for the steady state over a road. Not converging is an outcome.
   subroutine solve(self, operator, problem, road, contact, normal, rubbing)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator    !! with its symbols set
      type(normal_problem_type), intent(in) :: problem         !! warm: pressure, gap, traction are a start
      type(interpolation_type), intent(inout) :: road
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: normal          !! iterations, error of the pressure
      type(solver_result_type), intent(out) :: rubbing         !! rounds, error of the traction
      type(normal_problem_type) :: task
      type(steady_measure_type) :: measure
      type(pace_type) :: pace
      real(dp) :: change
      integer(int64) :: before
      logical :: determined

      before = operator%ffts
      call prepare_problem(problem, self%grid, operator%threads, contact%height, task, determined)
      call begin(self, operator, task, road, contact, normal)
      if (normal%stopped) return
      pace%accepted = task%tolerance
      normal%reason = reason_iterations
      rubbing%reason = reason_iterations
      do
         call round(self, operator, task, road, pace, contact, measure, change)
         rubbing%iterations = rubbing%iterations + 1
         normal%iterations = normal%iterations + pace%inner
         normal%stopped = stop_is_due()
         if (normal%stopped) return
         if (max(change, measure%change/measure%size) <= pace%accepted .and. &
            measure%error <= task%tolerance) then
            call examine(self, operator, task, road, contact, normal, rubbing)
            if (normal%converged .and. rubbing%converged) exit
            pace%accepted = 0.5_dp*pace%accepted
         end if
         if (rubbing%iterations >= task%max_iterations) then
            normal%reason = reason_iterations
            rubbing%reason = reason_iterations
            call finish(self, operator, task, road, contact, normal, rubbing)
            call self%return_to_best(operator, task, road, pace%best, contact, normal, rubbing)
            call explain(contact, self%law, normal, rubbing)
            exit
         end if
         if (rubbing%iterations >= doubtful .and. mod(rubbing%iterations, looks) == 0) &
            call keep_best(self, operator, task, road, pace, contact)
         call pace%choose_attempt(rubbing%iterations, max(change, measure%change/measure%size), task%tolerance, &
            self%grid%cells(), self%law%jumps_at_edge())
         if (pace%attempt /= no_attempt) then
            call solve_at_once(self, operator, task, road, pace, contact, normal, rubbing)
            if (normal%stopped .or. (normal%converged .and. rubbing%converged)) exit
         end if
         call advance(self, operator, task, pace, rubbing%iterations, &
            max(change, measure%change/measure%size), measure)
      end do
      normal%ffts = operator%ffts - before
   end subroutine solve

   !> Make the first state from the given one, or from the frictionless solution.
   subroutine begin(self, operator, task, road, contact, normal)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: normal
      integer :: c

      call self%memory%forget()
      call ratio_of_sliding(self%law, self%direction, self%ratio)
      if (task%warm) then
         call self%normal%start(operator, task, contact%height, contact%pressure, contact%gap)
         call operator%shear(contact%traction, contact%displacement, contact%slip)
         contact%offset = contact_mean(contact)
         call displaced(road, self%base(1) + contact%offset(1), self%base(2) + contact%offset(2), &
            contact%displacement(:, 1, :), contact%displacement(:, 2, :), contact%height, &
            contact%slope_x, contact%slope_y)
         call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      else
         call contact_without_friction(self%normal, operator, task, contact, normal)
         if (normal%stopped) return
      end if
      self%state(:, 1, :) = self%normal%z
      do c = 1, 2
         self%state(:, 1 + c, :) = contact%displacement(:, c, :) - contact%offset(c)
         self%state(:, 3 + c, :) = self%direction(c) + contact%slip(:, c, :)
      end do
      self%c = 5.0_dp*largest_force(self%law, field_sum(contact%pressure) &
         /max(field_count(contact%pressure > 0.0_dp), 1.0_dp))
   end subroutine begin

   !> Do one round: compute the residual of the state. The contact receives P, T, A_T T and the road at u+.
   subroutine round(self, operator, task, road, pace, contact, measure, change)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(pace_type), intent(in) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(steady_measure_type), intent(out) :: measure    !! of the last normal step
      real(dp), intent(out) :: change                      !! |u' - u|/|u'|
      real(dp) :: mean
      integer :: c, j, k

      contact%pressure(:, :) = self%state(:, 1, :)
      call project_simplex(contact%pressure, task%target*self%grid%cells())
      call bound_tractions(self%law, self%c, contact%pressure, contact%slope_x, contact%slope_y, &
         self%ratio, self%state(:, 4:5, :), contact%traction)
      call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      call operator%shear(contact%traction, contact%displacement, contact%slip)
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
      call read_place(self, road, contact)
      mean = field_mean(contact%height)
      self%normal%z(:, :) = self%state(:, 1, :)
      do k = 1, pace%inner
         call self%normal%evaluate(operator, task, contact%height, mean, self%normal%z, measure)
         self%normal%z = self%normal%z + self%normal%residual
      end do
      self%residual(:, 1, :) = self%normal%z - self%state(:, 1, :)
   end subroutine round

   !> Read the road at u+.
   subroutine read_place(self, road, contact)
      class(steady_friction_type), intent(in) :: self
      type(interpolation_type), intent(inout) :: road
      type(steady_contact_type), intent(inout) :: contact

      call displaced(road, self%base(1), self%base(2), self%place(:, 1, :), self%place(:, 2, :), &
         contact%height, contact%slope_x, contact%slope_y)
   end subroutine read_place

   !> Complete the present contact and compute its errors. If it has not converged, the road and T/P are what they were
   !> before, so that the check does not affect the rounds.
   subroutine examine(self, operator, task, road, contact, normal, rubbing)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(inout) :: normal, rubbing
      real(dp), allocatable :: ratio(:, :, :)

      allocate (ratio, source=self%ratio)
      call finish(self, operator, task, road, contact, normal, rubbing)
      if (normal%converged .and. rubbing%converged) return
      self%ratio(:, :, :) = ratio
      call read_place(self, road, contact)
   end subroutine examine

   !> Compute the error of the present contact, and keep the contact if it is the best so far.
   subroutine keep_best(self, operator, task, road, pace, contact)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(pace_type), intent(inout) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type) :: normal, rubbing

      call examine(self, operator, task, road, contact, normal, rubbing)
      call self%keep(max(normal%residual, rubbing%residual), contact, pace%best)
   end subroutine keep_best

   !> Solve all cells at once, from the present contact, from the best one, or from that without friction: on steep
   !> roads the best one may be far off. If this fails, the rounds continue unchanged.
   subroutine solve_at_once(self, operator, task, road, pace, contact, normal, rubbing)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(pace_type), intent(in) :: pace
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(inout) :: normal, rubbing
      type(solver_result_type) :: start
      real(dp), allocatable :: ratio(:, :, :)
      real(dp) :: scale

      allocate (ratio, source=self%ratio)
      scale = self%normal%c
      call finish(self, operator, task, road, contact, normal, rubbing)
      if (pace%attempt /= from_here) call self%return_to_best(operator, task, road, pace%best, contact, normal, rubbing)
      if (pace%attempt == along_path .or. pace%attempt == along_second_path) then
         call shifted(road, self%base(1), self%base(2), contact%height, contact%slope_x, contact%slope_y)
         call contact_without_friction(self%normal, operator, task, contact, start)
         normal%stopped = start%stopped
         if (normal%stopped) return
         call full_sliding(self%law, self%c, self%direction, self%ratio, contact)
      end if
      self%joint%direction = self%direction
      self%joint%base = self%base
      self%joint%c = self%c
      self%joint%attempt = pace%attempt
      call self%joint%solve(self%law, operator, task, road, contact, normal, rubbing)
      if (normal%stopped .or. (normal%converged .and. rubbing%converged)) return

      ! The next round needs the scale and the road as they were.
      self%normal%c = scale
      call operator%set_scale(scale)
      self%ratio(:, :, :) = ratio
      call read_place(self, road, contact)
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
   subroutine advance(self, operator, task, pace, rounds, change, measure)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
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
      if (.not. any(rounds == [8, 16, 32, 64])) return
      self%normal%z(:, :) = self%state(:, 1, :)
      call self%normal%rescale(operator, task, measure%scale, changed)
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

   !> Complete the result: P, T within its bound, and all fields that follow from them.
   subroutine finish(self, operator, task, road, contact, normal, rubbing)
      class(steady_friction_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(interpolation_type), intent(inout) :: road
      type(steady_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(inout) :: normal, rubbing

      contact%pressure(:, :) = self%normal%pressure
      call self%bound_and_judge(operator, task, road, contact, normal, rubbing)
   end subroutine finish

end module steady_friction
