!> The innermost loops of the fast method for adhesive contact: passes over the cells of a row.
!>
!> They are in a module of their own because the compiler vectorises them only as procedures whose arguments are
!> known not to overlap. If it inlines them into the parallel loops that call them, it loses that knowledge. Values are
!> computed in one loop and selected in another one: in a common loop the compiler would compute them only where the
!> condition holds, which prevents it from vectorising the loop.
module adhesion_sweeps
   use asperity_precision, only : dp
   use field_sums, only : row_form, row_product
   implicit none
   private

   public :: direction_of_cells, measure_cells, move_cells, scale_cells, z_of_cells

contains

   !> Compute r of the cells of a row from the attraction: G = P + e'(g), and r = -G in the free cells.
   pure subroutine measure_cells(gap, traction, load, per_length, per_traction, residual, worst, least)
      real(dp), intent(in), contiguous :: gap(:)                 !! g, m
      real(dp), intent(in), contiguous :: traction(:)            !! P without the load, Pa
      real(dp), intent(in) :: load                               !! p, Pa
      real(dp), intent(in) :: per_length, per_traction           !! inverse units of the natural residual, 1/m, 1/Pa
      real(dp), intent(inout), contiguous :: residual(:)         !! in: e'; out: r, Pa
      real(dp), intent(inout) :: worst                           !! largest natural residual so far
      real(dp), intent(inout) :: least                           !! least gap so far, m
      real(dp) :: gradient
      integer :: i

      do i = 1, size(gap)
         residual(i) = traction(i) + residual(i) + load
      end do
      do i = 1, size(gap)
         gradient = residual(i)
         worst = max(worst, abs(min(gap(i)*per_length, gradient*per_traction)))
         least = min(least, gap(i))
         residual(i) = merge(-gradient, 0.0_dp, max(gap(i), -gradient) > 0.0_dp)
      end do
   end subroutine measure_cells

   !> Multiply values by the factor with which the preconditioner is scaled from both sides, (1 + max(e'', 0)/k)^(-1/2).
   pure subroutine scale_cells(curvature, stiffness, values)
      real(dp), intent(in), contiguous :: curvature(:)       !! e'', Pa/m
      real(dp), intent(in) :: stiffness                      !! k, Pa/m
      real(dp), intent(inout), contiguous :: values(:)
      real(dp) :: per_stiffness
      integer :: i

      per_stiffness = 1.0_dp/stiffness
      do i = 1, size(values)
         values(i) = values(i)/sqrt(1.0_dp + max(curvature(i), 0.0_dp)*per_stiffness)
      end do
   end subroutine scale_cells

   !> Compute z = M r on the free cells and 0 on the others, with r.z and z.(old r).
   pure subroutine z_of_cells(factor, opens_only, image, state, residual, old, z, rz, old_rz)
      real(dp), intent(in) :: factor                         !! 1/Q
      logical, intent(in) :: opens_only                      !! z is also 0 in cells in contact that it would close
      real(dp), intent(in), contiguous :: image(:)           !! M r for Q = 1
      real(dp), intent(in), contiguous :: state(:)           !! g, m
      real(dp), intent(in), contiguous :: residual(:), old(:)
      real(dp), intent(out), contiguous :: z(:)
      real(dp), intent(out) :: rz, old_rz
      integer :: i

      do i = 1, size(z)
         z(i) = factor*image(i)
      end do
      do i = 1, size(z)
         z(i) = merge(z(i), 0.0_dp, max(state(i), residual(i)) > 0.0_dp)
      end do
      if (opens_only) then
         do i = 1, size(z)
            z(i) = max(z(i), merge(-huge(1.0_dp), 0.0_dp, state(i) > 0.0_dp))
         end do
      end if
      rz = row_product(z, residual)
      old_rz = row_product(z, old)
   end subroutine z_of_cells

   !> Compute d = z + beta d on the cells that are open or that z opens, and 0 on the others; the change of the
   !> displacement; r.d and d.e'' d; and the greatest |d|/(g + z_0).
   pure subroutine direction_of_cells(state, z, residual, curvature, beta, length, lift, d, change, sums, quickest)
      real(dp), intent(in), contiguous :: state(:), z(:)     !! g and z, m
      real(dp), intent(in), contiguous :: residual(:)        !! r, Pa
      real(dp), intent(in), contiguous :: curvature(:)       !! e'', Pa/m
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: length, lift                   !! z_0 and d of the level, m
      real(dp), intent(inout), contiguous :: d(:)
      real(dp), intent(out), contiguous :: change(:)
      real(dp), intent(out) :: sums(2), quickest
      real(dp) :: chosen
      integer :: i

      quickest = 0.0_dp
      do i = 1, size(d)
         d(i) = z(i) + beta*d(i)
      end do
      do i = 1, size(d)
         chosen = merge(d(i), 0.0_dp, max(state(i), z(i)) > 0.0_dp)
         d(i) = chosen
         change(i) = chosen + lift
         quickest = max(quickest, abs(chosen)/(state(i) + length))
      end do
      sums(:) = [row_product(residual, d), row_form(curvature, d)]
   end subroutine direction_of_cells

   !> Set g = g + alpha d, or 0 where that would be negative, and compute the correction that this makes to alpha d.
   pure subroutine move_cells(alpha, d, state, change, most)
      real(dp), intent(in) :: alpha
      real(dp), intent(in), contiguous :: d(:)               !! m
      real(dp), intent(inout), contiguous :: state(:)        !! g, m
      real(dp), intent(out), contiguous :: change(:)         !! the correction, >= 0, m
      real(dp), intent(out) :: most                          !! the largest correction, m
      real(dp) :: trial
      integer :: i

      most = 0.0_dp
      do i = 1, size(d)
         trial = state(i) + alpha*d(i)
         state(i) = max(trial, 0.0_dp)
         change(i) = state(i) - trial
         most = max(most, change(i))
      end do
   end subroutine move_cells

end module adhesion_sweeps
