!> The traction of friction in steady sliding, cell by cell.
!>
!> Every cell slides with the relative velocity r |V| over the road, r = e + dU_T/ds. The traction T and
!> the slip r satisfy the friction law (module `friction_law`) if for some c_t > 0
!>
!>     T = bound(T + c_t r)
!>
!> where bound(w) is the traction T on the bound for which w - T has a direction of slip that the law allows. If w lies
!> within the bound, T = w, and the cell sticks. Without slope effect bound(w) = w min(1, F/|w|), where F is the largest
!> friction force. With slope effect the bound is about T* = -P grad H, and M r is parallel to D = T - T* with
!> M = 1 + grad H grad H^T, so that
!>
!>     D = (M + l)^-1 M (w - T*),   l >= 0 such that D lies on the bound.
!>
!> With the thesis's direction of slip, r is parallel to D, and D is w - T* shortened to the bound.
module steady_bound
   use friction_law, only : friction_law_type
   use asperity_precision, only : dp
   use field_sums, only : threads_for
   implicit none
   private

   public :: bound_tractions, compare_tractions, largest_force

   integer, parameter :: bisections = 60

contains

   !> Compute T = bound(start + c r) where P > 0, and zero elsewhere.
   subroutine bound_tractions(law, c, pressure, slope_x, slope_y, start, slip, traction)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: c                        !! c_t, Pa
      real(dp), intent(in) :: pressure(:, :)           !! [nx, rows], Pa
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      !> [nx, 2, rows] traction over the pressure; over the strength where the traction jumps at the edge
      real(dp), intent(in) :: start(:, :, :)
      real(dp), intent(in) :: slip(:, :, :)            !! r, [nx, 2, rows]
      real(dp), intent(inout) :: traction(:, :, :)     !! [nx, 2, rows], Pa
      real(dp) :: slope(2), scale
      integer :: i, j

      slope = 0.0_dp
      !$omp parallel do default(none) shared(law, c, pressure, slope_x, slope_y, start, slip, traction) &
      !$omp private(i, j, scale) firstprivate(slope) num_threads(threads_for(pressure))
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            if (pressure(i, j) <= 0.0_dp) then
               traction(i, :, j) = 0.0_dp
               cycle
            end if
            if (law%slope_effect) slope = [slope_x(i, j), slope_y(i, j)]
            scale = unit_of(law, pressure(i, j))
            traction(i, :, j) = bounded(law, pressure(i, j), slope, scale*start(i, :, j) + c*slip(i, :, j))
         end do
      end do
   end subroutine bound_tractions

   !> The unit of a traction: the pressure, or the strength if the traction jumps at the edge of the contact. While the
   !> pressure changes, the ratio of the traction to this unit is kept.
   pure function unit_of(law, pressure) result(unit)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: pressure
      real(dp) :: unit                                 !! Pa

      unit = pressure
      if (law%jumps_at_edge()) unit = law%bare_strength()
   end function unit_of

   !> Compute the ratio of the traction to its unit in every cell. Without pressure the ratio does not change.
   subroutine compare_tractions(law, pressure, traction, ratio)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: pressure(:, :)
      real(dp), intent(in) :: traction(:, :, :)
      real(dp), intent(inout) :: ratio(:, :, :)
      integer :: i, j

      !$omp parallel do default(none) shared(law, pressure, traction, ratio) private(i, j) &
      !$omp num_threads(threads_for(pressure))
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            if (pressure(i, j) > 0.0_dp) ratio(i, :, j) = traction(i, :, j)/unit_of(law, pressure(i, j))
         end do
      end do
   end subroutine compare_tractions

   !> bound(w) of one cell.
   pure function bounded(law, pressure, slope, w) result(traction)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: pressure, slope(2), w(2)
      real(dp) :: traction(2)
      real(dp) :: star(2), d(2), along(2), across(2), steep, s

      star = law%normal_traction(pressure, slope)
      d = w - star
      s = law%bound_ratio(pressure, slope, d)
      traction = w
      if (s >= 1.0_dp) return
      steep = 0.0_dp
      if (law%slope_effect .and. law%physical_slip) steep = dot_product(slope, slope)
      if (steep <= 0.0_dp) then
         traction = star + s*d
         return
      end if
      along = slope*(dot_product(slope, d)/steep)
      across = d - along
      traction = star + shortened(law, pressure, slope, along, across, 1.0_dp + steep)
   end function bounded

   !> Find D = across/(1 + l) + along stretch/(stretch + l) on the bound. The ratio of the bound rises with l up to
   !> 1, so that l is found by secants within a bracket.
   pure function shortened(law, pressure, slope, along, across, stretch) result(d)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: pressure, slope(2)
      real(dp), intent(in) :: along(2), across(2)      !! parts of w - T* along grad H and across, Pa
      real(dp), intent(in) :: stretch                  !! 1 + |grad H|^2
      real(dp) :: d(2)
      real(dp) :: low, high, l, s, s_low, s_high
      integer :: k

      low = 0.0_dp
      s_low = law%bound_ratio(pressure, slope, along + across)
      high = max(2.0_dp*(1.0_dp/max(s_low, 1e-12_dp) - 1.0_dp)*stretch, 1e-3_dp)
      do k = 1, bisections
         d = across/(1.0_dp + high) + along*(stretch/(stretch + high))
         s_high = law%bound_ratio(pressure, slope, d)
         if (s_high >= 1.0_dp) exit
         low = high
         s_low = s_high
         high = 4.0_dp*high
      end do
      do k = 1, bisections
         ! s increases almost linearly with l, unless the traction has no bound at the upper end, where s is then huge.
         ! Every third step bisects, so that the bracket shrinks in any case.
         l = 0.5_dp*(low + high)
         if (s_high < 1e3_dp .and. mod(k, 3) /= 0) l = low + (high - low)*(1.0_dp - s_low)/(s_high - s_low)
         d = across/(1.0_dp + l) + along*(stretch/(stretch + l))
         s = law%bound_ratio(pressure, slope, d)
         if (s < 1.0_dp) then
            low = l
            s_low = s
         else
            high = l
            s_high = s
         end if
         if (abs(s - 1.0_dp) <= 4.0_dp*epsilon(s) .or. high - low <= epsilon(l)*high) exit
      end do
      s = law%bound_ratio(pressure, slope, d)
      if (s < 1.0_dp) d = s*d
   end function shortened

   !> Largest friction force that the law allows for a mean pressure, Pa.
   pure function largest_force(law, pressure) result(force)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: pressure                 !! in the contact, Pa
      real(dp) :: force

      force = law%shear%force(pressure, [1.0_dp, 1.0_dp])
   end function largest_force

end module steady_bound
