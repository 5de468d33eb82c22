!> The sweeps of the tangential solver over the points of one row: moves of the traction and measures of the
!> slip. Module `friction_directions` has the sweeps of the preconditioned directions.
!>
!> The compiler can turn these loops into vector instructions, because they have no branches, calls or
!> structures. The fields are separate arguments, because a field inside a structure could overlap another one,
!> and the loop would then remain scalar.
!>
!> Quantities that do not change during a solve are gathered for a row in `site`, with one column each for the
!> pressure P, the slopes H_x and H_y of the road, the friction force F (module `friction_law`, procedure
!> `bound_row`) and N_z of the unit normal of the road. Without the slope effect H_x = H_y = 0 and N_z = 1.
!>
!> States: 0 open, 1 stick, 2 slip, as `contact_open` and so on, here as numbers of the same kind as
!> the fields. The field `tangent` describes how a point may move. It is (v_x, v_y, w): the unit direction of slip
!> and the weight w = a_0/(a_0 + curvature of the bound) of a slipping point; v = 0 and w = 1 if the point
!> sticks; v = 0 and w = 0 if it is open, or if only T* is allowed. The projection Z a = a - v (v.a) thus
!> removes the part along v at slipping points and changes nothing at others.
!>
!> The sums of a row are small types with named components; `total_of` adds those of all rows in order.
module friction_rows
   use asperity_precision, only : dp
   use field_sums, only : row_totals, sum_rows
   use friction_law, only : unbounded
   implicit none
   private

   public :: measure_sums_type, measured_row, move_sums_type, move_type, returned_row, stepped_row, &
      tangent_row, total_of



   !> Sums of `returned_row`.
   type :: move_sums_type
      real(dp) :: returned = 0.0_dp          !! number of points returned to their bounds
      real(dp) :: changed = 0.0_dp           !! |T' - T|^2
      real(dp) :: size = 0.0_dp              !! |T'|^2
      real(dp) :: missed(2) = 0.0_dp         !! T' - T - step d of the points that stuck
      real(dp) :: arriving(3) = 0.0_dp       !! part of a uniform traction that they accept: xx, xy, yy
   end type move_sums_type

   !> Sums of `tangent_row` and `measured_row`; symmetric matrices as xx, xy, yy.
   type :: measure_sums_type
      real(dp) :: released = 0.0_dp          !! points that were on their bound and stick now
      real(dp) :: slipping = 0.0_dp          !! points on their bound
      real(dp) :: drive = 0.0_dp             !! |DX|^2 in the contact
      real(dp) :: displaced = 0.0_dp         !! |U|^2 in the contact
      real(dp) :: residual(2) = 0.0_dp       !! w g
      real(dp) :: tangent(3) = 0.0_dp        !! w Z
      real(dp) :: curved(3) = 0.0_dp         !! (curvature of the bound) w^2 Z
      real(dp) :: gain = 0.0_dp              !! g.(T - T_old)
      real(dp) :: largest = 0.0_dp           !! the largest |g|^2
   end type measure_sums_type

   !> Sums over all rows, in order.
   interface total_of
      module procedure :: total_of_moves, total_of_measures
   end interface total_of

   !> A move of T: T' = T + step d, with `uniform` added where a point sticks.
   type :: move_type
      real(dp) :: step = 0.0_dp
      real(dp) :: uniform(2) = 0.0_dp        !! Pa
      !> The move starts again from the T before the last move. It also starts from the states before that move,
      !> unless the slip has been measured since; then points that the last move returned to their bound slip.
      logical :: again = .false.
   end type move_type

   !> The constants of the bound and of the measures.
   type, public :: row_constants_type
      real(dp) :: coefficient = 0.0_dp       !! mu; 0 with constant shear, which is all in F
      real(dp) :: strength = -1.0_dp         !! sigma_max in addition to F (Coulomb-Orowan), Pa; < 0: none
      logical :: physical = .false.          !! slip by the physical law on a slope, else along D
      real(dp) :: compliance = 0.0_dp        !! a_0
      real(dp) :: stiffest = 0.0_dp          !! largest curvature of a bound, in units of a_0
      real(dp) :: on_bound = 1.0_dp          !! a point with a smaller s is on the bound
      real(dp) :: deepest_inside = 1.0_dp      !! a slipping point with a smaller s is moved to the bound
   end type row_constants_type

contains

   !> Do the first half of a move: T + step d. `returned_row` then returns points to their bounds.
   pure subroutine stepped_row(move, d, tangent, state, t, old, slips)
      type(move_type), intent(in) :: move
      real(dp), intent(in), contiguous :: d(:, :)          !! [nx, 2] Pa
      real(dp), intent(in), contiguous :: tangent(:, :)    !! [nx, 3] before the move
      real(dp), intent(in), contiguous :: state(:)         !! [nx]
      real(dp), intent(inout), contiguous :: t(:, :)       !! [nx, 2] in: T; out: T + step d, Pa
      real(dp), intent(inout), contiguous :: old(:, :)     !! [nx, 2] T before the move, Pa
      real(dp), intent(out), contiguous :: slips(:)        !! [nx] 1 where the point slipped before the move
      logical :: slip, again
      real(dp) :: step
      integer :: i

      step = move%step
      again = move%again
      !$omp simd private(slip)
      do i = 1, size(state)
         old(i, 1) = merge(old(i, 1), t(i, 1), again)
         old(i, 2) = merge(old(i, 2), t(i, 2), again)
         slip = tangent(i, 3) <= 0.0_dp .or. tangent(i, 1)**2 + tangent(i, 2)**2 > 0.5_dp
         slip = merge(slip, state(i) > 1.5_dp, again)
         slips(i) = merge(1.0_dp, 0.0_dp, slip)
         t(i, 1) = old(i, 1) + step*d(i, 1)
         t(i, 2) = old(i, 2) + step*d(i, 2)
      end do
   end subroutine stepped_row

   !> Do the second half of a move: return points that slipped to their bound from both sides, and others only from
   !> outside. The uniform part of the move is added first at points that stuck.
   pure subroutine returned_row(k, uniform, site, slips, old, t, state, sums)
      type(row_constants_type), intent(in) :: k
      real(dp), intent(in) :: uniform(2)                   !! Pa
      real(dp), intent(in), contiguous :: site(:, :)       !! [nx, 5]
      real(dp), intent(in), contiguous :: slips(:)         !! [nx] of `stepped_row`
      real(dp), intent(in), contiguous :: old(:, :)        !! [nx, 2] T before the move, Pa
      real(dp), intent(inout), contiguous :: t(:, :)       !! [nx, 2] in: T + step d; out: T', Pa
      real(dp), intent(inout), contiguous :: state(:)      !! [nx]
      type(move_sums_type), intent(out) :: sums
      real(dp) :: cx, cy, ex, ey, nd, m, s, limit, put, free, arrived, axis_x, axis_y, inverse
      real(dp) :: returned, changed, size_of_t, missed_x, missed_y, xx, xy, yy
      logical :: out
      integer :: i

      cx = uniform(1)
      cy = uniform(2)
      returned = 0.0_dp
      changed = 0.0_dp
      size_of_t = 0.0_dp
      missed_x = 0.0_dp
      missed_y = 0.0_dp
      xx = 0.0_dp
      xy = 0.0_dp
      yy = 0.0_dp
      !$omp simd private(ex, ey, nd, m, s, limit, put, out, free, arrived, axis_x, axis_y, inverse) &
      !$omp reduction(+: returned, changed, size_of_t, missed_x, missed_y, xx, xy, yy)
      do i = 1, size(state)
         free = merge(1.0_dp - slips(i), 0.0_dp, state(i) > 0.5_dp)
         ex = t(i, 1) + free*cx + site(i, 1)*site(i, 2)
         ey = t(i, 2) + free*cy + site(i, 1)*site(i, 3)
         nd = -site(i, 5)*(site(i, 2)*ex + site(i, 3)*ey)
         m = sqrt(max(ex**2 + ey**2 - nd**2, 0.0_dp))
         inverse = 1.0_dp/max(m, tiny(1.0_dp))
         s = ratio(site(i, 4), m - k%coefficient*nd)
         s = merge(min(s, k%strength*inverse), s, k%strength >= 0.0_dp .and. m > 0.0_dp)
         limit = merge(k%deepest_inside, 1.0_dp, slips(i) > 0.5_dp)
         out = s < limit .and. state(i) > 0.5_dp
         put = merge(s, 1.0_dp, out)
         ! A point that has reached its bound may still move along it.
         inverse = merge(inverse, 0.0_dp, out)
         axis_x = inverse*ex
         axis_y = inverse*ey
         arrived = free*min(put, 1.0_dp)
         xx = xx + arrived*max(1.0_dp - axis_x**2, 0.0_dp)
         xy = xy - arrived*axis_x*axis_y
         yy = yy + arrived*max(1.0_dp - axis_y**2, 0.0_dp)
         ! A T inside its bound stays as it is. The sum T* + D has the round-off of T*, and T may be much smaller than T*.
         ex = merge(put*ex - site(i, 1)*site(i, 2), t(i, 1) + free*cx, out)
         ey = merge(put*ey - site(i, 1)*site(i, 3), t(i, 2) + free*cy, out)
         missed_x = missed_x + free*(ex - t(i, 1))
         missed_y = missed_y + free*(ey - t(i, 2))
         t(i, 1) = merge(ex, 0.0_dp, state(i) > 0.5_dp)
         t(i, 2) = merge(ey, 0.0_dp, state(i) > 0.5_dp)
         state(i) = merge(merge(2.0_dp, 1.0_dp, out .or. s <= k%on_bound), 0.0_dp, state(i) > 0.5_dp)
         returned = returned + merge(1.0_dp, 0.0_dp, out)
         changed = changed + (t(i, 1) - old(i, 1))**2 + (t(i, 2) - old(i, 2))**2
         size_of_t = size_of_t + t(i, 1)**2 + t(i, 2)**2
      end do
      sums = move_sums_type(returned, changed, size_of_t, [missed_x, missed_y], [xx, xy, yy])
   end subroutine returned_row

   !> The ratio s of the bound: force/reach, 1 if both vanish, and unbounded if the reach is negative or alone vanishes.
   elemental function ratio(force, reach) result(s)
      real(dp), intent(in) :: force     !! F, >= 0, Pa
      real(dp), intent(in) :: reach     !! m - mu n.D, Pa
      real(dp) :: s

      s = merge(force/merge(reach, 1.0_dp, reach > 0.0_dp), &
         merge(1.0_dp, unbounded, reach >= 0.0_dp .and. force <= 0.0_dp), reach > 0.0_dp)
   end function ratio

   !> Do the first half of a measure: find out how each point may move, and release points that slip against their
   !> traction. With the direction of slip v = S^-1 D, the bound is |S^-1/2 D| = const to first order (without its
   !> change with n.D). It has the multiplier lam = r.v/|v|^2, and the curvature lam e.(S^-1 e)/|e|^2 along its
   !> tangent e.
   pure subroutine tangent_row(k, site, t, r, state, tangent, released)
      type(row_constants_type), intent(in) :: k
      real(dp), intent(in), contiguous :: site(:, :)       !! [nx, 5]
      real(dp), intent(in), contiguous :: t(:, :)          !! [nx, 2] Pa
      real(dp), intent(in), contiguous :: r(:, :)          !! [nx, 2] m
      real(dp), intent(inout), contiguous :: state(:)      !! [nx]
      real(dp), intent(out), contiguous :: tangent(:, :)   !! [nx, 3]
      real(dp), intent(out) :: released                    !! points that left their bound
      real(dp) :: ex, ey, nd, ux, uy, uu, ru, inverse, lam, turned, sloped
      logical :: slip, free, on, back
      integer :: i

      sloped = merge(1.0_dp, 0.0_dp, k%physical)
      released = 0.0_dp
      !$omp simd private(ex, ey, nd, ux, uy, uu, ru, inverse, lam, turned, slip, free, on, back) &
      !$omp reduction(+: released)
      do i = 1, size(state)
         ex = t(i, 1) + site(i, 1)*site(i, 2)
         ey = t(i, 2) + site(i, 1)*site(i, 3)
         nd = sloped*site(i, 5)**2*(site(i, 2)*ex + site(i, 3)*ey)
         ux = ex - site(i, 2)*nd
         uy = ey - site(i, 3)*nd
         uu = ux**2 + uy**2
         ru = r(i, 1)*ux + r(i, 2)*uy
         on = state(i) > 0.5_dp
         slip = state(i) > 1.5_dp
         free = uu > 0.0_dp
         back = slip .and. free .and. ru < 0.0_dp
         released = released + merge(1.0_dp, 0.0_dp, back)
         slip = slip .and. .not. back
         state(i) = merge(merge(2.0_dp, 1.0_dp, slip), 0.0_dp, on)
         ! From here on v has unit length if the point slips freely, and is 0 otherwise.
         inverse = merge(1.0_dp/merge(uu, 1.0_dp, free), 0.0_dp, slip .and. free)
         lam = min(ru*inverse, k%stiffest*k%compliance)
         turned = site(i, 5)*(site(i, 3)*ux - site(i, 2)*uy)
         lam = lam*(1.0_dp - sloped*inverse*turned**2)
         inverse = sqrt(inverse)
         tangent(i, 1) = inverse*ux
         tangent(i, 2) = inverse*uy
         tangent(i, 3) = merge(k%compliance/(k%compliance + lam), 0.0_dp, on .and. (free .or. .not. slip))
      end do
   end subroutine tangent_row

   !> Do the second half of a measure: form the sums of a row, using `tangent`.
   pure subroutine measured_row(compliance, t, old, r, drive, state, tangent, sums)
      real(dp), intent(in) :: compliance                   !! a_0
      real(dp), intent(in), contiguous :: t(:, :)          !! [nx, 2] Pa
      real(dp), intent(in), contiguous :: old(:, :)        !! [nx, 2] T before the last move, Pa
      real(dp), intent(in), contiguous :: r(:, :)          !! [nx, 2] m
      real(dp), intent(in), contiguous :: drive(:, :)      !! [nx, 2] m
      real(dp), intent(in), contiguous :: state(:)         !! [nx]
      real(dp), intent(in), contiguous :: tangent(:, :)    !! [nx, 3]
      type(measure_sums_type), intent(out) :: sums
      real(dp) :: ux, uy, ru, gx, gy, weight, bent
      real(dp) :: slipping, driving, displaced, wgx, wgy, wxx, wxy, wyy, cxx, cxy, cyy, gain, largest
      integer :: i

      slipping = 0.0_dp
      driving = 0.0_dp
      displaced = 0.0_dp
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

      !$omp simd private(ux, uy, ru, gx, gy, weight, bent) reduction(max: largest) &
      !$omp reduction(+: slipping, driving, displaced, wgx, wgy, wxx, wxy, wyy, cxx, cxy, cyy, gain)
      do i = 1, size(state)
         ux = tangent(i, 1)
         uy = tangent(i, 2)
         weight = tangent(i, 3)
         ru = r(i, 1)*ux + r(i, 2)*uy
         gx = merge(r(i, 1) - ru*ux, 0.0_dp, weight > 0.0_dp)
         gy = merge(r(i, 2) - ru*uy, 0.0_dp, weight > 0.0_dp)
         slipping = slipping + merge(1.0_dp, 0.0_dp, state(i) > 1.5_dp)
         driving = driving + merge(drive(i, 1)**2 + drive(i, 2)**2, 0.0_dp, state(i) > 0.5_dp)
         displaced = displaced + merge((drive(i, 1) - r(i, 1))**2 + (drive(i, 2) - r(i, 2))**2, 0.0_dp, &
            state(i) > 0.5_dp)
         bent = compliance*(1.0_dp - weight)*weight
         wgx = wgx + weight*gx
         wgy = wgy + weight*gy
         wxx = wxx + weight*(1.0_dp - ux**2)
         wxy = wxy - weight*(ux*uy)
         wyy = wyy + weight*(1.0_dp - uy**2)
         cxx = cxx + bent*(1.0_dp - ux**2)
         cxy = cxy - bent*(ux*uy)
         cyy = cyy + bent*(1.0_dp - uy**2)
         gain = gain + gx*(t(i, 1) - old(i, 1)) + gy*(t(i, 2) - old(i, 2))
         largest = max(largest, gx**2 + gy**2)
      end do

      sums = measure_sums_type(0.0_dp, slipping, driving, displaced, [wgx, wgy], [wxx, wxy, wyy], &
         [cxx, cxy, cyy], gain, largest)
   end subroutine measured_row

   !> Sums of a move.
   function total_of_moves(rows) result(total)
      type(move_sums_type), intent(in) :: rows(:)
      type(move_sums_type) :: total
      real(dp), allocatable :: packed(:, :)
      real(dp) :: sums(8)
      integer :: j

      allocate (packed(8, size(rows)))
      do j = 1, size(rows)
         associate (row => rows(j))
            packed(:, j) = [row%returned, row%changed, row%size, row%missed, row%arriving]
         end associate
      end do
      sums = row_totals(packed)
      total = move_sums_type(sums(1), sums(2), sums(3), sums(4:5), sums(6:8))
   end function total_of_moves

   !> Sums of a measure.
   function total_of_measures(rows) result(total)
      type(measure_sums_type), intent(in) :: rows(:)
      type(measure_sums_type) :: total
      real(dp), allocatable :: packed(:, :)
      real(dp) :: sums(13), largest
      integer :: j

      allocate (packed(14, size(rows)))
      do j = 1, size(rows)
         associate (row => rows(j))
            packed(:, j) = [row%released, row%slipping, row%drive, row%displaced, row%residual, &
               row%tangent, row%curved, row%gain, row%largest]
         end associate
      end do
      call sum_rows(packed, sums, largest)
      total = measure_sums_type(sums(1), sums(2), sums(3), sums(4), sums(5:6), sums(7:9), sums(10:12), &
         sums(13), largest)
   end function total_of_measures

end module friction_rows
