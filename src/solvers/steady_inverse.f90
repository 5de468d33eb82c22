!> An approximate inverse of the normal compliance K on the cells in contact, with which GMRES takes fewer directions.
!>
!> The displacements that are wanted in the contact are continued by zero, multiplied by (K + a)^-1 in Fourier space,
!> and the result is set to zero outside the contact. With a = 0 the short waves, which the continuation by zero
!> excites at the edge of the contact, would be amplified too much where |K| falls faster than 1/q, as it does in
!> a rubber with large losses; a is the smallest |K|.
!>
!> Memory: two fields, and one of logicals.
module steady_inverse
   use asperity_precision, only : dp
   use field_sums, only : field_mean
   use regular_grid, only : grid_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_inverse_type

   !> The inverse for a set of cells.
   type :: contact_inverse_type
      logical, allocatable :: inside(:, :)             !! the cells in contact [nx, rows]
      real(dp), allocatable, private :: lift(:, :)     !! pressures that displace them by 1 m, Pa [nx, rows]
      real(dp), private :: lift_mean = 0.0_dp          !! their mean over the grid, Pa
   contains
      procedure :: make_room
      procedure :: renew
      procedure :: solve
   end type contact_inverse_type

contains

   !> Allocate the fields.
   subroutine make_room(self, grid, status)
      class(contact_inverse_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(out) :: status                   !! not 0: there is not enough memory

      allocate (self%inside(grid%nx, grid%rows()), stat=status)
      if (status == 0) allocate (self%lift(grid%nx, grid%rows()), stat=status)
   end subroutine make_room

   !> Prepare for another set of cells. The scale of the operator's resolvent is changed.
   subroutine renew(self, operator, inside)
      class(contact_inverse_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      logical, intent(in) :: inside(:, :)

      call operator%set_scale(1.0_dp/operator%shortest)
      self%inside(:, :) = inside
      self%lift(:, :) = merge(1.0_dp, 0.0_dp, inside)
      call invert(self, operator, self%lift)
      self%lift_mean = field_mean(self%lift)
   end subroutine renew

   !> Find the pressures that displace the cells in contact by u + level and have the given mean over the grid.
   subroutine solve(self, operator, mean, u, level)
      class(contact_inverse_type), intent(in) :: self
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: mean                     !! Pa
      real(dp), intent(inout) :: u(:, :)               !! in: m, zero outside the contact; out: the pressures, Pa
      real(dp), intent(out) :: level                   !! m
      integer :: j

      call invert(self, operator, u)
      level = 0.0_dp
      if (.not. self%lift_mean > 0.0_dp) return
      level = (mean - field_mean(u))/self%lift_mean
      do j = 1, size(u, 2)
         u(:, j) = u(:, j) + level*self%lift(:, j)
      end do
   end subroutine solve

   !> Multiply by (K + a)^-1, and set the result to zero outside the contact. K has no mean mode: the mean is treated
   !> as the longest wave.
   subroutine invert(self, operator, u)
      type(contact_inverse_type), intent(in) :: self
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(inout) :: u(:, :)               !! in: m; out: Pa
      real(dp) :: mean, scale
      integer :: j

      scale = 1.0_dp/operator%shortest                 ! of the resolvent (1 + scale K)^-1
      mean = (1.0_dp/operator%longest - scale)*field_mean(u)
      call operator%resolve(u, u)
      do j = 1, size(u, 2)
         u(:, j) = merge(scale*u(:, j) + mean, 0.0_dp, self%inside(:, j))
      end do
   end subroutine invert

end module steady_inverse
