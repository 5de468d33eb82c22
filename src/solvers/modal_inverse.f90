!> An approximate inverse of K + s on the cells in contact, with the modes of the whole grid.
!>
!> K is the normal compliance of steady sliding and s > 0 that of a spring on each cell. The displacements that are wanted
!> in the contact are continued by zero; the inverse symbol 1/(K + s) gives the pressures, of which those outside the
!> contact are dropped. This takes two transforms. It does what dense inverses on tiles (module `steady_inverse`) cannot:
!> in slow sliding a loaded cell displaces the rubber far behind it. Where the contact consists of small patches, whose
!> edges this inverse does not know, the tiles need fewer transforms.
!>
!> Memory: one field.
module modal_inverse
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_mean
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: modal_inverse_type

   !> The inverse for a set of cells.
   type :: modal_inverse_type
      real(dp) :: lift_mean = 0.0_dp                   !! mean over the grid of the pressures `lift`, Pa
      real(dp), private :: spring = 0.0_dp             !! s, m/Pa
      real(dp), allocatable, private :: lift(:, :)     !! pressures that displace the contact by about 1 m, Pa
   contains
      procedure :: renew
      procedure :: solve
   end type modal_inverse_type

contains

   !> Prepare for another set of cells: two transforms. The operator is left with the scale 1/s.
   subroutine renew(self, operator, inside, spring, ready)
      class(modal_inverse_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      logical, intent(in) :: inside(:, :)
      real(dp), intent(in) :: spring                   !! s, m/Pa
      logical, intent(out) :: ready                    !! there is memory for it
      integer :: status

      status = 0
      if (.not. allocated(self%lift)) allocate (self%lift(size(inside, 1), size(inside, 2)), stat=status)
      ready = .not. any_process(status /= 0)
      if (.not. ready) return
      self%spring = spring
      call operator%set_scale(1.0_dp/spring)
      self%lift(:, :) = merge(1.0_dp, 0.0_dp, inside)
      call invert(self, operator, inside, self%lift)
      self%lift_mean = field_mean(self%lift)
   end subroutine renew

   !> Find pressures that displace the cells in contact by about u + level and have the given mean over the grid.
   subroutine solve(self, operator, inside, mean, u, level)
      class(modal_inverse_type), intent(in) :: self
      type(steady_operator_type), intent(inout) :: operator
      logical, intent(in) :: inside(:, :)
      real(dp), intent(in) :: mean                     !! Pa
      real(dp), intent(inout) :: u(:, :)               !! lengths, m, then pressures, Pa; zero outside
      real(dp), intent(out) :: level                   !! m

      call invert(self, operator, inside, u)
      level = 0.0_dp
      if (.not. abs(self%lift_mean) > 0.0_dp) return
      level = (mean - field_mean(u))/self%lift_mean
      u(:, :) = u + level*self%lift
   end subroutine solve

   !> Multiply by the inverse.
   subroutine invert(self, operator, inside, u)
      type(modal_inverse_type), intent(in) :: self
      type(steady_operator_type), intent(inout) :: operator
      logical, intent(in) :: inside(:, :)
      real(dp), intent(inout) :: u(:, :)               !! lengths, m, then pressures, Pa

      call operator%resolve(u, u)
      u(:, :) = merge(u/self%spring, 0.0_dp, inside)
   end subroutine invert

end module modal_inverse
