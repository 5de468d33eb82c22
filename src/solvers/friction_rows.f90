!> The work of the tangential solver at the points of one row, in loops that the compiler can turn into
!> vector instructions: no branches, no calls, no structures. This is why these procedures have many
!> arguments: a field inside a structure could overlap another one, and the loop would stay scalar.
!>
!> What does not change in a solve is kept for each point in `bound`: the friction force F (module
!> `friction_law`, procedure `bound_row`) and N_z of the unit normal of the road. Where the
!> slope does not count, h_x = h_y = 0 and N_z = 1.
!>
!> States: 0 open, 1 stick, 2 slip, as `contact_open` and so on, here as numbers of the same kind as
!> the fields. The field `tangent` says how a point may move: (v_x, v_y, w), the unit direction of slip
!> and the weight w = a_0/(a_0 + curvature of the bound) of a slip point; v = 0 and w = 1 where a point
!> sticks; v = 0 and w = 0 where it is open, or where nothing but T* is allowed. The projection
!> Z a = a - v (v.a) then takes the part along v from all of them.
!>
!> The sums of a row are small types with named components; `total_of` adds those of all rows in order.
module friction_rows
   use asperity_parallel, only : global_max, global_sum
   use asperity_precision, only : dp
   implicit none
   private

   public :: measure_sums_type, measured_row, move_sums_type, move_type, moved_row, &
      scaled_row, total_of, turned_row, uniform_type, unscaled_row, z_sums_type

   real(dp), parameter :: unbounded = huge(1.0_dp)

   !> Sums of `moved_row`.
   type :: move_sums_type
      real(dp) :: returned = 0.0_dp          !! points put back
      real(dp) :: changed = 0.0_dp           !! |T' - T|^2
      real(dp) :: size = 0.0_dp              !! |T'|^2
      real(dp) :: missed(2) = 0.0_dp         !! T' - T - step d of the points that stuck
      real(dp) :: arriving(3) = 0.0_dp       !! what of a uniform traction arrives there: xx, xy, yy
   end type move_sums_type

   !> Sums of `measured_row`; symmetric matrices as xx, xy, yy.
   type :: measure_sums_type
      real(dp) :: released = 0.0_dp          !! points that left their bound
      real(dp) :: slipping = 0.0_dp          !! points on their bound
      real(dp) :: drive = 0.0_dp             !! |DX|^2 in the contact
      real(dp) :: displaced = 0.0_dp         !! |U|^2 in the contact
      real(dp) :: residual(2) = 0.0_dp       !! w g
      real(dp) :: tangent(3) = 0.0_dp        !! w Z
      real(dp) :: curved(3) = 0.0_dp         !! (curvature of the bound) w^2 Z
      real(dp) :: gain = 0.0_dp              !! g.(T - T_old)
      real(dp) :: largest = 0.0_dp           !! the largest |g|^2
   end type measure_sums_type

   !> Sums of `unscaled_row`.
   type :: z_sums_type
      real(dp) :: gz = 0.0_dp                !! g.z
      real(dp) :: total(2) = 0.0_dp          !! z
      real(dp) :: bent(2) = 0.0_dp           !! (curvature of the bound) w z
   end type z_sums_type

   !> Sums over all rows, in order.
   interface total_of
      module procedure :: total_of_moves, total_of_measures, total_of_z
   end interface total_of

   !> A move of T: T' = T + step d, sticking points with `uniform` beside.
   type :: move_type
      real(dp) :: step = 0.0_dp
      real(dp) :: uniform(2) = 0.0_dp        !! Pa
      logical :: again = .false.             !! from the T and the states before the last move
   end type move_type

   !> The part of the mean mode that is treated apart from the preconditioner (module
   !> `friction_cg_fast`): c, and what it displaces on average, (h/N) E c.
   type :: uniform_type
      real(dp) :: traction(2) = 0.0_dp       !! c, Pa
      real(dp) :: displacement(2) = 0.0_dp   !! m
   end type uniform_type

   !> The constants of the bound and of the measures.
   type, public :: row_constants_type
      real(dp) :: coefficient = 0.0_dp       !! mu; 0 with constant shear, which is all in F
      real(dp) :: strength = -1.0_dp         !! sigma_max beside F (Coulomb-Orowan), Pa; < 0: none
      logical :: physical = .false.          !! slip by the physical law on a slope, else along D
      real(dp) :: compliance = 0.0_dp        !! a_0
      real(dp) :: stiffest = 0.0_dp          !! largest curvature of a bound, in units of a_0
      real(dp) :: on_bound = 1.0_dp          !! s below it is on the bound
      real(dp) :: outermost = 1.0_dp         !! s below it puts a slip point out to the bound
   end type row_constants_type

contains

   !> T' = T + step d, put back: slip points on their bound from both sides, others only from outside.
   pure subroutine moved_row(n, k, move, p, hx, hy, bound, d, tangent, tx, ty, old, state, sums)
      integer, intent(in) :: n
      type(row_constants_type), intent(in) :: k
      type(move_type), intent(in) :: move
      real(dp), intent(in) :: p(n), hx(n), hy(n)
      real(dp), intent(in) :: bound(n, 2)            !! F, N_z
      real(dp), intent(in) :: d(n, 2)                !! Pa
      real(dp), intent(in) :: tangent(n, 3)          !! before the move
      real(dp), intent(inout) :: tx(n), ty(n)
      real(dp), intent(inout) :: old(n, 2)           !! T before the move
      real(dp), intent(inout) :: state(n)
      type(move_sums_type), intent(out) :: sums
      real(dp) :: cx, cy, step
      logical :: again
      real(dp) :: mu, ex, ey, nd, m, s, limit, moved, changed, size, put, free, arrived, missed_x
      real(dp) :: missed_y, xx, xy, yy, axis_x, axis_y, wanted_x, wanted_y, inverse
      logical :: out, slip
      integer :: i

      mu = k%coefficient
      step = move%step
      cx = move%uniform(1)
      cy = move%uniform(2)
      again = move%again
      moved = 0.0_dp
      changed = 0.0_dp
      size = 0.0_dp
      missed_x = 0.0_dp
      missed_y = 0.0_dp
      xx = 0.0_dp
      xy = 0.0_dp
      yy = 0.0_dp
      !$omp simd private(ex, ey, nd, m, s, limit, put, out, slip, free, arrived, axis_x, axis_y) &
      !$omp private(wanted_x, wanted_y, inverse) &
      !$omp reduction(+: moved, changed, size, missed_x, missed_y, xx, xy, yy)
      do i = 1, n
         old(i, 1) = merge(old(i, 1), tx(i), again)
         old(i, 2) = merge(old(i, 2), ty(i), again)
         slip = tangent(i, 3) <= 0.0_dp .or. tangent(i, 1)**2 + tangent(i, 2)**2 > 0.5_dp
         slip = merge(slip, state(i) > 1.5_dp, again)
         free = merge(1.0_dp, 0.0_dp, state(i) > 0.5_dp .and. .not. slip)
         wanted_x = old(i, 1) + step*d(i, 1)
         wanted_y = old(i, 2) + step*d(i, 2)
         ex = wanted_x + free*cx + p(i)*hx(i)
         ey = wanted_y + free*cy + p(i)*hy(i)
         nd = -bound(i, 2)*(hx(i)*ex + hy(i)*ey)
         m = sqrt(max(ex**2 + ey**2 - nd**2, 0.0_dp))
         inverse = 1.0_dp/max(m, tiny(1.0_dp))
         s = ratio(bound(i, 1), m - mu*nd)
         s = merge(min(s, k%strength*inverse), s, k%strength >= 0.0_dp .and. m > 0.0_dp)
         limit = merge(k%outermost, 1.0_dp, slip)
         out = s < limit .and. state(i) > 0.5_dp
         put = merge(s, 1.0_dp, out)
         ! A point that came to the bound still moves along it.
         inverse = merge(inverse, 0.0_dp, out)
         axis_x = inverse*ex
         axis_y = inverse*ey
         arrived = free*min(put, 1.0_dp)
         xx = xx + arrived*max(1.0_dp - axis_x**2, 0.0_dp)
         xy = xy - arrived*axis_x*axis_y
         yy = yy + arrived*max(1.0_dp - axis_y**2, 0.0_dp)
         ex = put*ex - p(i)*hx(i)
         ey = put*ey - p(i)*hy(i)
         tx(i) = merge(ex, 0.0_dp, state(i) > 0.5_dp)
         ty(i) = merge(ey, 0.0_dp, state(i) > 0.5_dp)
         missed_x = missed_x + free*(ex - wanted_x)
         missed_y = missed_y + free*(ey - wanted_y)
         state(i) = merge(merge(2.0_dp, 1.0_dp, out .or. s <= k%on_bound), 0.0_dp, state(i) > 0.5_dp)
         moved = moved + merge(1.0_dp, 0.0_dp, out)
         changed = changed + (tx(i) - old(i, 1))**2 + (ty(i) - old(i, 2))**2
         size = size + tx(i)**2 + ty(i)**2
      end do
      sums = move_sums_type(moved, changed, size, [missed_x, missed_y], [xx, xy, yy])
   end subroutine moved_row

   !> force/reach; 1 where both vanish, unbounded where only the reach does or it is negative.
   elemental function ratio(force, reach) result(s)
      real(dp), intent(in) :: force     !! >= 0, Pa
      real(dp), intent(in) :: reach     !! Pa
      real(dp) :: s

      s = merge(force/merge(reach, 1.0_dp, reach > 0.0_dp), &
         merge(1.0_dp, unbounded, reach >= 0.0_dp .and. force <= 0.0_dp), reach > 0.0_dp)
   end function ratio

   !> Measure the points of a row and release those that slip against their traction. With the
   !> direction of slip v = S^-1 D the bound is |S^-1/2 D| = const to first order (its change with n.D
   !> left out): a multiplier lam = r.v/|v|^2 and the curvature lam e.(S^-1 e)/|e|^2 along its tangent
   !> e.
   pure subroutine measured_row(n, c, p, hx, hy, bound, tx, ty, old, rx, ry, drive_x, drive_y, &
      state, tangent, sums)
      integer, intent(in) :: n
      type(row_constants_type), intent(in) :: c
      real(dp), intent(in) :: p(n), hx(n), hy(n), bound(n, 2)
      real(dp), intent(in) :: tx(n), ty(n), old(n, 2), rx(n), ry(n)
      real(dp), intent(in) :: drive_x(n), drive_y(n)
      real(dp), intent(inout) :: state(n)
      real(dp), intent(out) :: tangent(n, 3)
      type(measure_sums_type), intent(out) :: sums
      real(dp) :: ex, ey, nd, ux, uy, uu, ru, inverse, lam, turned, gx, gy, weight, sloped, bent
      real(dp) :: released, slipping, drive, moved, wgx, wgy, wxx, wxy, wyy, cxx, cxy, cyy, gain
      real(dp) :: largest
      logical :: slip, free, on, back
      integer :: i

      sloped = merge(1.0_dp, 0.0_dp, c%physical)
      released = 0.0_dp
      slipping = 0.0_dp
      drive = 0.0_dp
      moved = 0.0_dp
      wgx = 0.0_dp
      wgy = 0.0_dp
      wxx = 0.0_dp
      wxy = 0.0_dp
      wyy = 0.0_dp
      cxx = 0.0_dp
      cxy = 0.0_dp
      cyy = 0.0_dp
      gain = 0.0_dp
      largest = 0.0_dp
      !$omp simd private(ex, ey, nd, ux, uy, uu, ru, inverse, lam, turned, gx, gy, weight, bent) &
      !$omp private(slip, free, on, back) reduction(max: largest) &
      !$omp reduction(+: released, slipping, drive, moved, wgx, wgy, wxx, wxy, wyy) &
      !$omp reduction(+: cxx, cxy, cyy, gain)
      do i = 1, n
         ex = tx(i) + p(i)*hx(i)
         ey = ty(i) + p(i)*hy(i)
         nd = sloped*bound(i, 2)**2*(hx(i)*ex + hy(i)*ey)
         ux = ex - hx(i)*nd
         uy = ey - hy(i)*nd
         uu = ux**2 + uy**2
         ru = rx(i)*ux + ry(i)*uy
         on = state(i) > 0.5_dp
         slip = state(i) > 1.5_dp
         free = uu > 0.0_dp
         back = slip .and. free .and. ru < 0.0_dp
         released = released + merge(1.0_dp, 0.0_dp, back)
         slip = slip .and. .not. back
         slipping = slipping + merge(1.0_dp, 0.0_dp, slip)
         state(i) = merge(merge(2.0_dp, 1.0_dp, slip), 0.0_dp, on)
         ! From here on v is of unit length where it slips freely, else 0.
         inverse = merge(1.0_dp/merge(uu, 1.0_dp, free), 0.0_dp, slip .and. free)
         lam = min(ru*inverse, c%stiffest*c%compliance)
         turned = bound(i, 2)*(hy(i)*ux - hx(i)*uy)
         lam = lam*(1.0_dp - sloped*inverse*turned**2)
         weight = merge(c%compliance/(c%compliance + lam), 0.0_dp, on .and. (free .or. .not. slip))
         inverse = sqrt(inverse)
         ux = inverse*ux
         uy = inverse*uy
         ru = rx(i)*ux + ry(i)*uy
         gx = merge(rx(i) - ru*ux, 0.0_dp, weight > 0.0_dp)
         gy = merge(ry(i) - ru*uy, 0.0_dp, weight > 0.0_dp)
         drive = drive + merge(drive_x(i)**2 + drive_y(i)**2, 0.0_dp, on)
         moved = moved + merge((drive_x(i) - rx(i))**2 + (drive_y(i) - ry(i))**2, 0.0_dp, on)
         bent = c%compliance*(1.0_dp - weight)*weight
         wgx = wgx + weight*gx
         wgy = wgy + weight*gy
         wxx = wxx + weight*(1.0_dp - ux**2)
         wxy = wxy - weight*(ux*uy)
         wyy = wyy + weight*(1.0_dp - uy**2)
         cxx = cxx + bent*(1.0_dp - ux**2)
         cxy = cxy - bent*(ux*uy)
         cyy = cyy + bent*(1.0_dp - uy**2)
         gain = gain + gx*(tx(i) - old(i, 1)) + gy*(ty(i) - old(i, 2))
         largest = max(largest, gx**2 + gy**2)
         tangent(i, 1) = ux
         tangent(i, 2) = uy
         tangent(i, 3) = weight
      end do
      sums = measure_sums_type(released, slipping, drive, moved, [wgx, wgy], [wxx, wxy, wyy], &
         [cxx, cxy, cyy], gain, largest)
   end subroutine measured_row

   !> w Z (g - H e c) of a row, and g.z_old.
   pure subroutine scaled_row(n, compliance, uniform, rx, ry, tangent, z, a, cross)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance             !! a_0
      type(uniform_type), intent(in) :: uniform
      real(dp), intent(in) :: rx(n), ry(n), tangent(n, 3)
      real(dp), intent(in) :: z(n, 2)                !! z_old
      real(dp), intent(out) :: a(n, 2)
      real(dp), intent(out) :: cross
      real(dp) :: rv, gx, gy, bent, cx, cy, mean_x, mean_y
      integer :: i

      cx = uniform%traction(1)
      cy = uniform%traction(2)
      mean_x = uniform%displacement(1)
      mean_y = uniform%displacement(2)
      cross = 0.0_dp
      !$omp simd private(rv, gx, gy, bent) reduction(+: cross)
      do i = 1, n
         rv = rx(i)*tangent(i, 1) + ry(i)*tangent(i, 2)
         cross = cross + merge((rx(i) - rv*tangent(i, 1))*z(i, 1) + (ry(i) - rv*tangent(i, 2))*z(i, 2), &
            0.0_dp, tangent(i, 3) > 0.0_dp)
         bent = compliance*(1.0_dp - tangent(i, 3))
         gx = rx(i) - mean_x - bent*cx
         gy = ry(i) - mean_y - bent*cy
         rv = gx*tangent(i, 1) + gy*tangent(i, 2)
         a(i, 1) = tangent(i, 3)*(gx - rv*tangent(i, 1))
         a(i, 2) = tangent(i, 3)*(gy - rv*tangent(i, 2))
      end do
   end subroutine scaled_row

   !> z of a row from the preconditioned field; g.z, the sums of z and of lam w z.
   pure subroutine unscaled_row(n, compliance, uniform, rx, ry, tangent, z, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance
      type(uniform_type), intent(in) :: uniform
      real(dp), intent(in) :: rx(n), ry(n), tangent(n, 3)
      real(dp), intent(inout) :: z(n, 2)             !! in: the preconditioned field
      type(z_sums_type), intent(out) :: sums
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
      do i = 1, n
         over = (1.0_dp - tangent(i, 3))/compliance
         bent = compliance*(1.0_dp - tangent(i, 3))
         ! The part of r along v goes first: beside a long slip, g is otherwise lost in its round-off.
         rv = rx(i)*tangent(i, 1) + ry(i)*tangent(i, 2)
         rx_z = rx(i) - rv*tangent(i, 1)
         ry_z = ry(i) - rv*tangent(i, 2)
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
      sums = z_sums_type(rz, [sx, sy], [bx, by])
   end subroutine unscaled_row

   !> d = z + w Z c + beta Z d of a row, z' = z + w Z c; g.d and the curvature of the bounds along d.
   pure subroutine turned_row(n, compliance, beta, c, rx, ry, tangent, z, d, slope, curvature)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: c(2)                   !! Pa
      real(dp), intent(in) :: rx(n), ry(n), tangent(n, 3)
      real(dp), intent(inout) :: z(n, 2), d(n, 2)
      real(dp), intent(out) :: slope, curvature
      real(dp) :: av, ax, ay, cx, cy, weight
      integer :: i

      cx = c(1)
      cy = c(2)
      slope = 0.0_dp
      curvature = 0.0_dp
      !$omp simd private(av, ax, ay, weight) reduction(+: slope, curvature)
      do i = 1, n
         av = cx*tangent(i, 1) + cy*tangent(i, 2)
         z(i, 1) = z(i, 1) + tangent(i, 3)*(cx - av*tangent(i, 1))
         z(i, 2) = z(i, 2) + tangent(i, 3)*(cy - av*tangent(i, 2))
         av = d(i, 1)*tangent(i, 1) + d(i, 2)*tangent(i, 2)
         ax = z(i, 1) + merge(beta*(d(i, 1) - av*tangent(i, 1)), 0.0_dp, tangent(i, 3) > 0.0_dp)
         ay = z(i, 2) + merge(beta*(d(i, 2) - av*tangent(i, 2)), 0.0_dp, tangent(i, 3) > 0.0_dp)
         av = rx(i)*tangent(i, 1) + ry(i)*tangent(i, 2)
         slope = slope + (rx(i) - av*tangent(i, 1))*ax + (ry(i) - av*tangent(i, 2))*ay
         weight = merge(tangent(i, 3), 1.0_dp, tangent(i, 3) > 0.0_dp)
         curvature = curvature + compliance*(1.0_dp/weight - 1.0_dp)*(ax**2 + ay**2)
         d(i, 1) = ax
         d(i, 2) = ay
      end do
   end subroutine turned_row

   !> Sums of a move.
   function total_of_moves(rows) result(total)
      type(move_sums_type), intent(in) :: rows(:)
      type(move_sums_type) :: total
      real(dp) :: sums(8)
      integer :: j

      sums = 0.0_dp
      do j = 1, size(rows)
         associate (row => rows(j))
            sums = sums + [row%returned, row%changed, row%size, row%missed, row%arriving]
         end associate
      end do
      sums = global_sum(sums)
      total = move_sums_type(sums(1), sums(2), sums(3), sums(4:5), sums(6:8))
   end function total_of_moves

   !> Sums of a measure.
   function total_of_measures(rows) result(total)
      type(measure_sums_type), intent(in) :: rows(:)
      type(measure_sums_type) :: total
      real(dp) :: sums(13)
      integer :: j

      sums = 0.0_dp
      do j = 1, size(rows)
         associate (row => rows(j))
            sums = sums + [row%released, row%slipping, row%drive, row%displaced, row%residual, &
               row%tangent, row%curved, row%gain]
         end associate
      end do
      sums = global_sum(sums)
      total = measure_sums_type(sums(1), sums(2), sums(3), sums(4), sums(5:6), sums(7:9), sums(10:12), &
         sums(13), global_max(maxval(rows%largest)))
   end function total_of_measures

   !> Sums of a preconditioned field.
   function total_of_z(rows) result(total)
      type(z_sums_type), intent(in) :: rows(:)
      type(z_sums_type) :: total
      real(dp) :: sums(5)
      integer :: j

      sums = 0.0_dp
      do j = 1, size(rows)
         sums = sums + [rows(j)%gz, rows(j)%total, rows(j)%bent]
      end do
      sums = global_sum(sums)
      total = z_sums_type(sums(1), sums(2:3), sums(4:5))
   end function total_of_z

end module friction_rows
