!> A contact in steady sliding with friction: its fields, the road under it, the outcome of a solve, and the reasons
!> why there may be no solution.
module steady_contact
   use asperity_interpolation, only : displaced, interpolation_type
   use asperity_precision, only : dp
   use field_sums, only : field_count, row_totals
   use friction_law, only : friction_law_type
   use normal_state, only : gap_measure_type, measure_gap, normal_problem_type, reason_converged
   use solver_result, only : solver_result_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_mean, explain, judge_gap, read_road, sliding_outcome_type, steady_contact_type

   real(dp), parameter :: far_off = 1.0e-2_dp          !! error of a contact that more iterations seldom improve

   !> A steady contact with friction.
   type :: steady_contact_type
      real(dp), allocatable :: pressure(:, :)          !! P, Pa
      real(dp), allocatable :: gap(:, :)               !! m
      real(dp), allocatable :: height(:, :)            !! H of the road at x + u, m
      real(dp), allocatable :: slope_x(:, :), slope_y(:, :)   !! grad H there
      real(dp), allocatable :: traction(:, :, :)       !! T, Pa [nx, 2, rows]
      real(dp), allocatable :: displacement(:, :, :)   !! A_T T without its mean mode, m [nx, 2, rows]
      real(dp), allocatable :: slip(:, :, :)           !! r, the slip speed over the road's speed
      real(dp) :: level = 0.0_dp                       !! U - H where the gap is zero, m
      real(dp) :: offset(2) = 0.0_dp                   !! mean displacement of the contact, m
   end type steady_contact_type

   !> The outcome of a solve with friction.
   type :: sliding_outcome_type
      type(solver_result_type) :: normal               !! iterations, error of the pressure
      type(solver_result_type) :: tangential           !! rounds, error of the traction
   contains
      procedure :: converged
      procedure :: residual
   end type sliding_outcome_type

contains

   !> Have both the pressure and the traction converged?
   pure function converged(self) result(yes)
      class(sliding_outcome_type), intent(in) :: self
      logical :: yes

      yes = self%normal%converged .and. self%tangential%converged
   end function converged

   !> The larger one of the errors of the pressure and of the traction.
   pure function residual(self) result(error)
      class(sliding_outcome_type), intent(in) :: self
      real(dp) :: error

      error = max(self%normal%residual, self%tangential%residual)
   end function residual

   !> Compute the road at x + u, where u is A_T T minus its mean over the contact, and the slip r.
   subroutine read_road(contact, road, base, direction)
      type(steady_contact_type), intent(inout) :: contact   !! in: the slip holds d(A_T T)/ds; out: r
      type(interpolation_type), intent(inout) :: road
      real(dp), intent(in) :: base(2)                  !! displacement of the road, m
      real(dp), intent(in) :: direction(2)             !! e
      integer :: c

      contact%offset = contact_mean(contact)
      do c = 1, 2
         contact%slip(:, c, :) = direction(c) + contact%slip(:, c, :)
      end do
      call displaced(road, base(1) + contact%offset(1), base(2) + contact%offset(2), &
         contact%displacement(:, 1, :), contact%displacement(:, 2, :), contact%height, contact%slope_x, &
         contact%slope_y)
   end subroutine read_road

   !> Compute the gap of a pressure over the road that was read last, and the error of the pressure.
   subroutine judge_gap(contact, operator, task, normal)
      type(steady_contact_type), intent(inout) :: contact
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      type(solver_result_type), intent(inout) :: normal
      type(gap_measure_type) :: found

      call operator%displace(contact%pressure, contact%gap)
      contact%gap = contact%gap - contact%height
      found = measure_gap(task, contact%pressure, contact%gap, operator%threads)
      contact%level = found%level
      contact%gap = contact%gap - contact%level
      normal%residual = found%error
      normal%load_error = found%load_error
      normal%converged = found%error <= task%tolerance
      if (normal%converged) normal%reason = reason_converged
   end subroutine judge_gap

   !> The mean of the displacement, weighted by the pressure.
   function contact_mean(contact) result(mean)
      type(steady_contact_type), intent(in) :: contact
      real(dp) :: mean(2)
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(3)
      integer :: c, j

      allocate (rows(3, size(contact%pressure, 2)))
      do j = 1, size(contact%pressure, 2)
         do c = 1, 2
            rows(c, j) = dot_product(contact%pressure(:, j), contact%displacement(:, c, j))
         end do
         rows(3, j) = sum(contact%pressure(:, j))
      end do
      sums = row_totals(rows)
      mean = sums(1:2)/max(sums(3), tiny(1.0_dp))
   end function contact_mean

   !> Give the reason why there may be no solution. On a slope of angle alpha the law allows T = P tan(atan(mu) + alpha) uphill,
   !> which has no bound if mu tan(alpha) reaches 1: the road wedges. If the law has a strength, it bounds the traction,
   !> and a solution exists. With constant shear the solver may not find it, because the traction jumps at the edge of
   !> the contact. The limit of iterations is the reason only if the error is small: where it is large, four times as
   !> many iterations helped in no case that was tried.
   subroutine explain(contact, law, outcome)
      type(steady_contact_type), intent(in) :: contact
      type(friction_law_type), intent(in) :: law
      type(sliding_outcome_type), intent(inout) :: outcome

      if (outcome%converged()) return
      if (outcome%residual() > far_off) outcome%normal%reason = &
         'no solution was found; a larger max_iterations seldom helps, a lower load or coefficient or a smoother road may'
      if (law%jumps_at_edge()) then
         outcome%normal%reason = &
            'no solution was found, although one exists: with law = ''coulomb_orowan'' and coefficient = 0.5 '// &
            'a solution is often found'
      else if (law%slope_effect .and. law%strength_beside() < 0.0_dp) then
         if (field_count(contact%pressure > 0.0_dp .and. law%reach_coefficient()*hypot(contact%slope_x, &
            contact%slope_y) >= 1.0_dp) > 0.0_dp) &
            outcome%normal%reason = 'the road wedges: slopes in contact exceed 1/coefficient'
      end if
      outcome%tangential%reason = outcome%normal%reason
   end subroutine explain

end module steady_contact
