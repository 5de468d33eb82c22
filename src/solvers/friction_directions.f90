!> The sweeps of `friction_cg_fast` that form the preconditioned directions, over the points of one row.
!>
!> Like those of module `friction_rows`, which explains `tangent`, they are loops without branches or
!> structures that the compiler can turn into vector instructions.
module friction_directions
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   implicit none
   private

   public :: direction_row, direction_sums_type, scaled_row, total_of, uniform_type, unscaled_row, z_sums_type

   !> The part of the mean mode that is treated separately from the preconditioner (module
   !> `friction_preconditioner`): c, and the mean displacement that it causes, (h/N) E c.
   type :: uniform_type
      real(dp) :: traction(2) = 0.0_dp       !! c, Pa
      real(dp) :: displacement(2) = 0.0_dp   !! m
   end type uniform_type

   !> Sums of `unscaled_row` and `scaled_row`.
   type :: z_sums_type
      real(dp) :: gz = 0.0_dp                !! g.z
      real(dp) :: cross = 0.0_dp             !! g.z_old, of `scaled_row`
      real(dp) :: total(2) = 0.0_dp          !! z
      real(dp) :: bent(2) = 0.0_dp           !! (curvature of the bound) w z
   end type z_sums_type

   !> Sums of `direction_row`.
   type :: direction_sums_type
      real(dp) :: slope = 0.0_dp             !! g.d
      real(dp) :: curvature = 0.0_dp         !! of the bounds along d
      real(dp) :: square = 0.0_dp            !! |d|^2
   end type direction_sums_type

   !> Sums over all rows, in order.
   interface total_of
      module procedure :: total_of_z, total_of_directions
   end interface total_of

contains

   !> Compute w Z (g - H e c) in a row, and g.z_old.
   pure subroutine scaled_row(compliance, uniform, r, tangent, z, a, cross)
      real(dp), intent(in) :: compliance             !! a_0
      type(uniform_type), intent(in) :: uniform
      real(dp), intent(in), contiguous :: r(:, :)          !! [nx, 2] m
      real(dp), intent(in), contiguous :: tangent(:, :)    !! [nx, 3]
      real(dp), intent(in), contiguous :: z(:, :)          !! [nx, 2] z_old
      real(dp), intent(out), contiguous :: a(:, :)         !! [nx, 2] w Z (g - H e c)
      real(dp), intent(out) :: cross
      real(dp) :: rv, gx, gy, bent, cx, cy, mean_x, mean_y
      integer :: i

      cx = uniform%traction(1)
      cy = uniform%traction(2)
      mean_x = uniform%displacement(1)
      mean_y = uniform%displacement(2)
      cross = 0.0_dp
      !$omp simd private(rv, gx, gy, bent) reduction(+: cross)
      do i = 1, size(r, 1)
         rv = r(i, 1)*tangent(i, 1) + r(i, 2)*tangent(i, 2)
         cross = cross + merge((r(i, 1) - rv*tangent(i, 1))*z(i, 1) + (r(i, 2) - rv*tangent(i, 2))*z(i, 2), &
            0.0_dp, tangent(i, 3) > 0.0_dp)
         bent = compliance*(1.0_dp - tangent(i, 3))
         gx = r(i, 1) - mean_x - bent*cx
         gy = r(i, 2) - mean_y - bent*cy
         rv = gx*tangent(i, 1) + gy*tangent(i, 2)
         a(i, 1) = tangent(i, 3)*(gx - rv*tangent(i, 1))
         a(i, 2) = tangent(i, 3)*(gy - rv*tangent(i, 2))
      end do
   end subroutine scaled_row

   !> Compute z in a row from the preconditioned field, g.z, and the sums of z and of lam w z.
   pure subroutine unscaled_row(compliance, uniform, r, tangent, z, sums)
      real(dp), intent(in) :: compliance
      type(uniform_type), intent(in) :: uniform
      real(dp), intent(in), contiguous :: r(:, :)          !! [nx, 2] m
      real(dp), intent(in), contiguous :: tangent(:, :)    !! [nx, 3]
      real(dp), intent(inout), contiguous :: z(:, :)       !! [nx, 2] in: the preconditioned field
      type(z_sums_type), intent(inout) :: sums             !! in: with g.z_old
      real(dp) :: rv, rx_z, ry_z, gx, gy, bent, over, rz, sx, sy, bx, by, cx, cy, mean_x, mean_y
      integer :: i

      cx = uniform%traction(1)
      cy = uniform%traction(2)
      mean_x = uniform%displacement(1)
      mean_y = uniform%displacement(2)
      rz = 0.0_dp
      sx = 0.0_dp
      sy = 0.0_dp
      bx = 0.0_dp
      by = 0.0_dp
      !$omp simd private(rv, rx_z, ry_z, gx, gy, bent, over) reduction(+: rz, sx, sy, bx, by)
      do i = 1, size(r, 1)
         over = (1.0_dp - tangent(i, 3))/compliance
         bent = compliance*(1.0_dp - tangent(i, 3))
         ! Subtract the part of r along v first. If the slip is long, g would otherwise be lost in its round-off.
         rv = r(i, 1)*tangent(i, 1) + r(i, 2)*tangent(i, 2)
         rx_z = r(i, 1) - rv*tangent(i, 1)
         ry_z = r(i, 2) - rv*tangent(i, 2)
         gx = z(i, 1) + over*(rx_z - mean_x - bent*cx)
         gy = z(i, 2) + over*(ry_z - mean_y - bent*cy)
         rv = gx*tangent(i, 1) + gy*tangent(i, 2)
         gx = tangent(i, 3)*(gx - rv*tangent(i, 1))
         gy = tangent(i, 3)*(gy - rv*tangent(i, 2))
         z(i, 1) = gx
         z(i, 2) = gy
         rz = rz + rx_z*gx + ry_z*gy
         sx = sx + gx
         sy = sy + gy
         bx = bx + bent*gx
         by = by + bent*gy
      end do
      sums%gz = rz
      sums%total = [sx, sy]
      sums%bent = [bx, by]
   end subroutine unscaled_row

   !> Compute d = z + w Z c + beta Z d and z' = z + w Z c in a row, g.d, |d|^2, and the curvature of the bounds along d.
   pure subroutine direction_row(compliance, beta, c, r, tangent, z, d, sums)
      real(dp), intent(in) :: compliance
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: c(2)                   !! Pa
      real(dp), intent(in), contiguous :: r(:, :)          !! [nx, 2] m
      real(dp), intent(in), contiguous :: tangent(:, :)    !! [nx, 3]
      real(dp), intent(inout), contiguous :: z(:, :)       !! [nx, 2]
      real(dp), intent(inout), contiguous :: d(:, :)       !! [nx, 2] Pa
      type(direction_sums_type), intent(out) :: sums
      real(dp) :: slope, curvature, square
      real(dp) :: av, ax, ay, cx, cy, weight
      integer :: i

      cx = c(1)
      cy = c(2)
      slope = 0.0_dp
      curvature = 0.0_dp
      square = 0.0_dp
      !$omp simd private(av, ax, ay, weight) reduction(+: slope, curvature, square)
      do i = 1, size(r, 1)
         av = cx*tangent(i, 1) + cy*tangent(i, 2)
         z(i, 1) = z(i, 1) + tangent(i, 3)*(cx - av*tangent(i, 1))
         z(i, 2) = z(i, 2) + tangent(i, 3)*(cy - av*tangent(i, 2))
         av = d(i, 1)*tangent(i, 1) + d(i, 2)*tangent(i, 2)
         ax = z(i, 1) + merge(beta*(d(i, 1) - av*tangent(i, 1)), 0.0_dp, tangent(i, 3) > 0.0_dp)
         ay = z(i, 2) + merge(beta*(d(i, 2) - av*tangent(i, 2)), 0.0_dp, tangent(i, 3) > 0.0_dp)
         av = r(i, 1)*tangent(i, 1) + r(i, 2)*tangent(i, 2)
         slope = slope + (r(i, 1) - av*tangent(i, 1))*ax + (r(i, 2) - av*tangent(i, 2))*ay
         weight = merge(tangent(i, 3), 1.0_dp, tangent(i, 3) > 0.0_dp)
         curvature = curvature + compliance*(1.0_dp/weight - 1.0_dp)*(ax**2 + ay**2)
         square = square + (ax**2 + ay**2)
         d(i, 1) = ax
         d(i, 2) = ay
      end do
      sums = direction_sums_type(slope, curvature, square)
   end subroutine direction_row

   !> Sums of a preconditioned field.
   function total_of_z(rows) result(total)
      type(z_sums_type), intent(in) :: rows(:)
      type(z_sums_type) :: total
      real(dp), allocatable :: packed(:, :)
      real(dp) :: sums(6)
      integer :: j

      allocate (packed(6, size(rows)))
      do j = 1, size(rows)
         packed(:, j) = [rows(j)%gz, rows(j)%cross, rows(j)%total, rows(j)%bent]
      end do
      sums = row_totals(packed)
      total = z_sums_type(sums(1), sums(2), sums(3:4), sums(5:6))
   end function total_of_z

   !> Sums of a direction.
   function total_of_directions(rows) result(total)
      type(direction_sums_type), intent(in) :: rows(:)
      type(direction_sums_type) :: total
      real(dp), allocatable :: packed(:, :)
      real(dp) :: sums(3)
      integer :: j

      allocate (packed(3, size(rows)))
      do j = 1, size(rows)
         packed(:, j) = [rows(j)%slope, rows(j)%curvature, rows(j)%square]
      end do
      sums = row_totals(packed)
      total = direction_sums_type(sums(1), sums(2), sums(3))
   end function total_of_directions

end module friction_directions
