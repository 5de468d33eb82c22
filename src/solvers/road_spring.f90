!> The springs that hold the road while the total of the traction is prescribed along x, y or both.
!>
!> If the total F of the traction T is prescribed, the position c of the road is unknown. The road is held by a
!> spring of compliance kappa, whose free end is at X:
!>
!>     c = X - kappa (sum(T) - F)
!>
!> Thus sum(T) = F if X = c. The solver finds T for a given X, and `move_end` then moves X towards c
!> (method of multipliers). A spring much softer than the contact needs few such moves. A mass in place of the
!> spring needs none.
module road_spring
   use asperity_precision, only : dp
   use field_sums, only : vector_sum
   implicit none
   private

   public :: road_spring_type

   !> The springs along x and y.
   type :: road_spring_type
      logical :: pulled(2) = .false.         !! the total along this direction is prescribed
      real(dp) :: pull(2) = 0.0_dp           !! F: the prescribed sum of T over the cells, Pa
      real(dp) :: compliance(2) = 0.0_dp     !! kappa: m/Pa of the sum
      real(dp) :: end(2) = 0.0_dp            !! X: position of the free end, m
      real(dp) :: total(2) = 0.0_dp          !! sum of T when `follow` was last called, Pa
      real(dp) :: offset(2) = 0.0_dp         !! c: position of the road, m
      real(dp) :: offset_step(2) = 0.0_dp    !! change of c by the last `follow`, m
   contains
      procedure :: follow
      procedure :: move_end
      procedure :: add_form
   end type road_spring_type

contains

   !> Compute the total of T and the position of the road that belongs to it.
   subroutine follow(self, traction)
      class(road_spring_type), intent(inout) :: self
      real(dp), intent(in), contiguous :: traction(:, :, :)    !! T, Pa [nx, 2, rows]
      real(dp) :: before(2)

      if (.not. any(self%pulled)) return
      before = self%offset
      self%total = vector_sum(traction)
      where (self%pulled) self%offset = self%end - self%compliance*(self%total - self%pull)
      self%offset_step = self%offset - before
   end subroutine follow

   !> Move the free end of the springs. The total of T does not change, so that the road moves by the same distance.
   pure subroutine move_end(self, shift)
      class(road_spring_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)         !! m

      self%end = self%end + shift
      self%offset = self%offset + shift
   end subroutine move_end

   !> Add the part of the springs to the quadratic form d.A d of a search direction d.
   subroutine add_form(self, direction, form)
      class(road_spring_type), intent(in) :: self
      real(dp), intent(in), contiguous :: direction(:, :, :)   !! d, Pa [nx, 2, rows]
      real(dp), intent(inout) :: form        !! Pa m
      real(dp) :: total(2)

      if (.not. any(self%pulled)) return
      total = vector_sum(direction)
      form = form + sum(self%compliance*total**2, self%pulled)
   end subroutine add_form

end module road_spring
