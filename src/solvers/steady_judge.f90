!> The errors of a contact in steady sliding with friction, recomputed from its pressure and traction, and the contact
!> with the least error so far.
!>
!> A pressure P and a traction T determine everything else: the displacement u = A_T T, the road at x + u, the gap and the
!> slip r. The error of the pressure is its duality gap, and that of the traction is |bound(T + c_t r) - T|/|T| (module
!> `steady_bound`).
module steady_judge
   use asperity_interpolation, only : interpolation_type
   use asperity_precision, only : dp
   use field_sums, only : ratio_of_lengths
   use friction_law, only : friction_law_type
   use normal_state, only : normal_problem_type, reason_converged
   use regular_grid, only : grid_type
   use steady_bound, only : bound_tractions, compare_tractions
   use steady_contact, only : judge_gap, read_road, sliding_outcome_type, steady_contact_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: new_sliding, sliding_type

   !> The problem of sliding, the last ratio of the traction to its unit, and the best contact.
   type :: sliding_type
      type(grid_type) :: grid
      type(friction_law_type) :: law
      type(steady_operator_type), pointer :: operator => null()   !! K and A_T, during a solve
      type(interpolation_type), pointer :: road => null()         !! during a solve
      type(normal_problem_type) :: task                !! load, tolerance and units of the errors
      real(dp) :: direction(2) = 0.0_dp                !! e
      real(dp) :: base(2) = 0.0_dp                     !! displacement of the road, m
      real(dp) :: c = 0.0_dp                           !! c_t, Pa
      !> T over the pressure, or over the strength (module steady_bound) [nx, 2, rows].
      real(dp), allocatable :: ratio(:, :, :)
      real(dp), allocatable, private :: best(:, :, :)  !! P and T of the least error, Pa [nx, 3, rows]
   contains
      procedure :: bound_and_judge
      procedure :: judge
      procedure :: keep
      procedure :: return_to_best
   end type sliding_type

contains

   !> Allocate the fields.
   subroutine new_sliding(self, grid, law)
      type(sliding_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      type(friction_law_type), intent(in) :: law

      self%grid = grid
      self%law = law
      allocate (self%ratio(grid%nx, 2, grid%rows()), self%best(grid%nx, 3, grid%rows()), source=0.0_dp)
   end subroutine new_sliding

   !> Return the traction of a contact to its bound, and judge the contact.
   subroutine bound_and_judge(self, contact, outcome)
      class(sliding_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact      !! in: the slip holds d(A_T T)/ds
      type(sliding_outcome_type), intent(inout) :: outcome

      call read_road(contact, self%road, self%base, self%direction)
      call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      call bound_tractions(self%law, self%c, contact%pressure, contact%slope_x, contact%slope_y, &
         self%ratio, contact%slip, contact%traction)
      call self%judge(contact, outcome)
   end subroutine bound_and_judge

   !> Compute the displacement, road, gap and slip of a contact from its P and T, and its errors.
   subroutine judge(self, contact, outcome)
      class(sliding_type), intent(inout) :: self
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome
      real(dp), allocatable :: again(:, :, :), rows(:, :)
      integer :: j

      call self%operator%shear(contact%traction, contact%displacement, contact%slip)
      call read_road(contact, self%road, self%base, self%direction)
      call judge_gap(contact, self%operator, self%task, outcome%normal)
      call compare_tractions(self%law, contact%pressure, contact%traction, self%ratio)
      allocate (again, mold=contact%traction)
      call bound_tractions(self%law, self%c, contact%pressure, contact%slope_x, contact%slope_y, &
         self%ratio, contact%slip, again)
      allocate (rows(2, self%grid%rows()))
      do j = 1, self%grid%rows()
         rows(1, j) = sum((again(:, :, j) - contact%traction(:, :, j))**2)
         rows(2, j) = sum(contact%traction(:, :, j)**2)
      end do
      outcome%tangential%residual = ratio_of_lengths(rows)
      outcome%tangential%converged = outcome%tangential%residual <= self%task%tolerance
      if (outcome%tangential%converged) outcome%tangential%reason = reason_converged
   end subroutine judge

   !> Keep a contact if it is the best so far.
   subroutine keep(self, error, contact, least)
      class(sliding_type), intent(inout) :: self
      real(dp), intent(in) :: error                    !! of the contact
      type(steady_contact_type), intent(in) :: contact
      real(dp), intent(inout) :: least                 !! error of the kept contact

      if (.not. error < least) return
      least = error
      self%best(:, 1, :) = contact%pressure
      self%best(:, 2:3, :) = contact%traction
   end subroutine keep

   !> Return to the kept contact if it is better than the present one, because rounds that do not settle may
   !> oscillate.
   subroutine return_to_best(self, least, contact, outcome)
      class(sliding_type), intent(inout) :: self
      real(dp), intent(in) :: least                    !! error of the kept contact
      type(steady_contact_type), intent(inout) :: contact
      type(sliding_outcome_type), intent(inout) :: outcome

      if (.not. least < outcome%residual()) return
      contact%pressure(:, :) = self%best(:, 1, :)
      contact%traction(:, :, :) = self%best(:, 2:3, :)
      call self%judge(contact, outcome)
   end subroutine return_to_best

end module steady_judge
