!> The pointwise work of the tangential solver on one row, in loops that the compiler can turn into
!> vector instructions: no branches, no calls, no structures.
!>
!> What does not change in a solve is kept a point: the friction force F (module `friction_law`,
!> with constant shear its sigma_max) and N_z of the unit normal of the road. Where the slope does
!> not count, h_x = h_y = 0 and N_z = 1.
!>
!> States: 0 open, 1 stick, 2 slip, as `contact_open` and so on, here as numbers of the same kind as
!> the fields. The measure of a slip point is the unit direction of slip (v_x, v_y) and the weight
!> w = a_0/(a_0 + curvature of the bound); of a stick point v = 0, w = 1; of an open point, and of
!> one where nothing but T* is allowed, v = 0, w = 0. Z a = a - v (v.a) then takes the part along v
!> from all of them.
module friction_rows
   use asperity_precision, only : dp
   implicit none
   private

   public :: bound_row, turned_row, measured_row, moved_row, scaled_row, unscaled_row

   real(dp), parameter :: unbounded = huge(1.0_dp)
   integer, parameter, public :: measures = 14    !! sums of `measured_row`
   integer, parameter, public :: moves = 8        !! sums of `moved_row`

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

   !> F and N_z of a row.
   pure subroutine bound_row(n, coefficient, adhesive, strength, p, hx, hy, force, nz)
      integer, intent(in) :: n
      real(dp), intent(in) :: coefficient            !! mu
      real(dp), intent(in) :: adhesive               !! p_a, Pa
      real(dp), intent(in) :: strength               !! >= 0: sigma_max is all of F, Pa
      real(dp), intent(in) :: p(n), hx(n), hy(n)
      real(dp), intent(out) :: force(n), nz(n)
      real(dp) :: root
      integer :: i

      !$omp simd private(root)
      do i = 1, n
         root = sqrt(1.0_dp + hx(i)**2 + hy(i)**2)
         nz(i) = 1.0_dp/root
         force(i) = coefficient*max(p(i)*root + adhesive*nz(i), 0.0_dp)
         force(i) = merge(strength, force(i), strength >= 0.0_dp)
      end do
   end subroutine bound_row

   !> T' = T + step d, sticking points with c beside: put back, slip points on their bound from both
   !> sides, others only from outside. T_old is the T before; the move is done anew from there if wanted.
   pure subroutine moved_row(n, k, again, step, c, p, hx, hy, force, nz, dx, dy, vx, vy, w, tx, ty, &
      old_x, old_y, state, sums)
      integer, intent(in) :: n
      type(row_constants_type), intent(in) :: k
      logical, intent(in) :: again                   !! from T_old and the states before the move
      real(dp), intent(in) :: step
      real(dp), intent(in) :: c(2)                   !! Pa
      real(dp), intent(in) :: p(n), hx(n), hy(n), force(n), nz(n)
      real(dp), intent(in) :: dx(n), dy(n)           !! d, Pa
      real(dp), intent(in) :: vx(n), vy(n), w(n)     !! measure before the move
      real(dp), intent(inout) :: tx(n), ty(n)
      real(dp), intent(inout) :: old_x(n), old_y(n)
      real(dp), intent(inout) :: state(n)
      !> Points put back, |T' - T|^2, |T'|^2; of the points that stuck: T' - T - step d (2), what of c
      !> arrives (xx, xy, yy).
      real(dp), intent(out) :: sums(moves)
      real(dp) :: mu, ex, ey, nd, m, s, limit, moved, changed, size, put, free, arrived, missed_x
      real(dp) :: missed_y, xx, xy, yy, axis_x, axis_y, wanted_x, wanted_y, inverse
      logical :: out, slip
      integer :: i

      mu = k%coefficient
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
         old_x(i) = merge(old_x(i), tx(i), again)
         old_y(i) = merge(old_y(i), ty(i), again)
         slip = merge(w(i) <= 0.0_dp .or. vx(i)**2 + vy(i)**2 > 0.5_dp, state(i) > 1.5_dp, again)
         free = merge(1.0_dp, 0.0_dp, state(i) > 0.5_dp .and. .not. slip)
         wanted_x = old_x(i) + step*dx(i)
         wanted_y = old_y(i) + step*dy(i)
         ex = wanted_x + free*c(1) + p(i)*hx(i)
         ey = wanted_y + free*c(2) + p(i)*hy(i)
         nd = -nz(i)*(hx(i)*ex + hy(i)*ey)
         m = sqrt(max(ex**2 + ey**2 - nd**2, 0.0_dp))
         inverse = 1.0_dp/max(m, tiny(1.0_dp))
         s = ratio(force(i), m - mu*nd)
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
         changed = changed + (tx(i) - old_x(i))**2 + (ty(i) - old_y(i))**2
         size = size + tx(i)**2 + ty(i)**2
      end do
      sums = [moved, changed, size, missed_x, missed_y, xx, xy, yy]
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
   pure subroutine measured_row(n, c, p, hx, hy, nz, tx, ty, old_x, old_y, rx, ry, drive_x, drive_y, &
      state, vx, vy, w, sums)
      integer, intent(in) :: n
      type(row_constants_type), intent(in) :: c
      real(dp), intent(in) :: p(n), hx(n), hy(n), nz(n)
      real(dp), intent(in) :: tx(n), ty(n), old_x(n), old_y(n), rx(n), ry(n)
      real(dp), intent(in) :: drive_x(n), drive_y(n)
      real(dp), intent(inout) :: state(n)
      real(dp), intent(out) :: vx(n), vy(n), w(n)
      !> Released points; slip points; |DX|^2; |U|^2; w g (2); w Z (xx, xy, yy); curvature w^2 Z;
      !> g.(T - T_old); the largest |g|^2.
      real(dp), intent(out) :: sums(measures)
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
         nd = sloped*nz(i)**2*(hx(i)*ex + hy(i)*ey)
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
         turned = nz(i)*(hy(i)*ux - hx(i)*uy)
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
         gain = gain + gx*(tx(i) - old_x(i)) + gy*(ty(i) - old_y(i))
         largest = max(largest, gx**2 + gy**2)
         vx(i) = ux
         vy(i) = uy
         w(i) = weight
      end do
      sums = [released, slipping, drive, moved, wgx, wgy, wxx, wxy, wyy, cxx, cxy, cyy, gain, largest]
   end subroutine measured_row

   !> w Z (g - H e c) of a row, and g.z_old.
   pure subroutine scaled_row(n, compliance, mean, c, rx, ry, vx, vy, w, zx, zy, ax, ay, cross)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance             !! a_0
      real(dp), intent(in) :: mean(2), c(2)          !! (h/N) E c, c
      real(dp), intent(in) :: rx(n), ry(n), vx(n), vy(n), w(n)
      real(dp), intent(in) :: zx(n), zy(n)           !! z_old
      real(dp), intent(out) :: ax(n), ay(n)
      real(dp), intent(out) :: cross
      real(dp) :: rv, gx, gy, bent
      integer :: i

      cross = 0.0_dp
      !$omp simd private(rv, gx, gy, bent) reduction(+: cross)
      do i = 1, n
         rv = rx(i)*vx(i) + ry(i)*vy(i)
         cross = cross + merge((rx(i) - rv*vx(i))*zx(i) + (ry(i) - rv*vy(i))*zy(i), 0.0_dp, &
            w(i) > 0.0_dp)
         bent = compliance*(1.0_dp - w(i))
         gx = rx(i) - mean(1) - bent*c(1)
         gy = ry(i) - mean(2) - bent*c(2)
         rv = gx*vx(i) + gy*vy(i)
         ax(i) = w(i)*(gx - rv*vx(i))
         ay(i) = w(i)*(gy - rv*vy(i))
      end do
   end subroutine scaled_row

   !> z of a row from the preconditioned field; g.z, the sums of z and of lam w z.
   pure subroutine unscaled_row(n, compliance, mean, c, rx, ry, vx, vy, w, zx, zy, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance
      real(dp), intent(in) :: mean(2), c(2)
      real(dp), intent(in) :: rx(n), ry(n), vx(n), vy(n), w(n)
      real(dp), intent(inout) :: zx(n), zy(n)        !! in: the preconditioned field
      real(dp), intent(out) :: sums(5)
      real(dp) :: rv, rx_z, ry_z, gx, gy, bent, over, rz, sx, sy, bx, by
      integer :: i

      rz = 0.0_dp
      sx = 0.0_dp
      sy = 0.0_dp
      bx = 0.0_dp
      by = 0.0_dp
      !$omp simd private(rv, rx_z, ry_z, gx, gy, bent, over) reduction(+: rz, sx, sy, bx, by)
      do i = 1, n
         over = (1.0_dp - w(i))/compliance
         bent = compliance*(1.0_dp - w(i))
         ! The part of r along v goes first: beside a long slip, g is otherwise lost in its round-off.
         rv = rx(i)*vx(i) + ry(i)*vy(i)
         rx_z = rx(i) - rv*vx(i)
         ry_z = ry(i) - rv*vy(i)
         gx = zx(i) + over*(rx_z - mean(1) - bent*c(1))
         gy = zy(i) + over*(ry_z - mean(2) - bent*c(2))
         rv = gx*vx(i) + gy*vy(i)
         gx = w(i)*(gx - rv*vx(i))
         gy = w(i)*(gy - rv*vy(i))
         zx(i) = gx
         zy(i) = gy
         rz = rz + rx_z*gx + ry_z*gy
         sx = sx + gx
         sy = sy + gy
         bx = bx + bent*gx
         by = by + bent*gy
      end do
      sums = [rz, sx, sy, bx, by]
   end subroutine unscaled_row

   !> d = z + w Z c + beta Z d of a row, z' = z + w Z c; g.d and the curvature of the bounds along d.
   pure subroutine turned_row(n, compliance, beta, c, rx, ry, vx, vy, w, zx, zy, dx, dy, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: compliance
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: c(2)
      real(dp), intent(in) :: rx(n), ry(n), vx(n), vy(n), w(n)
      real(dp), intent(inout) :: zx(n), zy(n), dx(n), dy(n)
      real(dp), intent(out) :: sums(2)
      real(dp) :: av, ax, ay, slope, curvature
      integer :: i

      slope = 0.0_dp
      curvature = 0.0_dp
      !$omp simd private(av, ax, ay) reduction(+: slope, curvature)
      do i = 1, n
         av = c(1)*vx(i) + c(2)*vy(i)
         zx(i) = zx(i) + w(i)*(c(1) - av*vx(i))
         zy(i) = zy(i) + w(i)*(c(2) - av*vy(i))
         av = dx(i)*vx(i) + dy(i)*vy(i)
         ax = zx(i) + merge(beta*(dx(i) - av*vx(i)), 0.0_dp, w(i) > 0.0_dp)
         ay = zy(i) + merge(beta*(dy(i) - av*vy(i)), 0.0_dp, w(i) > 0.0_dp)
         av = rx(i)*vx(i) + ry(i)*vy(i)
         slope = slope + (rx(i) - av*vx(i))*ax + (ry(i) - av*vy(i))*ay
         curvature = curvature + compliance*(1.0_dp/merge(w(i), 1.0_dp, w(i) > 0.0_dp) - 1.0_dp) &
            *(ax**2 + ay**2)
         dx(i) = ax
         dy(i) = ay
      end do
      sums = [slope, curvature]
   end subroutine turned_row

end module friction_rows
