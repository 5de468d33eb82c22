!> Combines the step of the model with the step before, for adhesive contact.
!>
!> Near an instability of the contact one mode is soft: its stiffness is a small difference between that of the
!> solid and that of the attraction. An error of a quarter in the local model of the energy (module
!> `adhesion_descent`) makes its steps many times too short along that mode, or reverses their sign. The true
!> form of a step is known, however, since every step is multiplied by B. Therefore the step s of the model is
!> made conjugate to the step d before it, with the true second derivatives H = Q B + e'':
!>     s = s + b d,     b = -(G.d + s.H d)/(d.H d)
!> which is the conjugate gradient method with the model as its preconditioner. Where H is not positive along
!> d, the step continues along d. In both cases w = b d is shortened until it changes no g + z_0 by more than a
!> share, and gaps that would be negative are closed. `stretch_step` then lengthens the step to the minimum
!> of the energy along it.
module adhesion_plane
   use adhesion_potential, only : adhesive_slopes, has_smooth_potential
   use adhesion_state, only : control_approach
   use adhesion_steps, only : step_sums_type, stepped_gap, sum_shift
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_precision, only : dp
   use field_sums, only : least_of_rows
   implicit none
   private

   public :: keep_step, stretch_step, widen_step

   real(dp), parameter :: share = 0.05_dp               !! by which g + z_0 may change with w
   real(dp), parameter :: most = 4.0_dp                !! greatest b
   real(dp), parameter :: onward = 1.0_dp              !! b where H is not positive
   real(dp), parameter :: greatest_stretch = 2.0_dp
   real(dp), parameter :: least_stiffness = 1e-3_dp    !! H over B, below which it counts as negative

contains

   !> Combine the step of the model, in work%direction and now%lift, with the step before.
   subroutine widen_step(work, now)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp) :: b, shift, slope, stiffness

      if (.not. now%has_last .or. now%held .or. .not. has_smooth_potential(now%problem%potential)) return
      if (.not. now%last_form > 0.0_dp) return
      call look_along(work, now, slope, stiffness)
      b = sign(onward, -slope)
      if (stiffness > least_stiffness*now%last_form) b = min(max(-slope/stiffness, -most), most)
      b = b*allowed_part(work, now, b)
      if (.not. abs(b) > 0.0_dp) return
      call combine(work, now, b)
      now%lift = now%lift + b*now%last_lift
      shift = 0.0_dp
      associate (patch => work%patch)
         if (patch%periodic .and. now%problem%control == control_approach) shift = sum_shift( &
            now%state, work%direction, 1.0_dp, now%gap_sum, patch%threads)
      end associate
      call close_step(work, now, shift)
   end subroutine widen_step

   !> Compute the slope of the energy along the step before, after the step of the model, and the stiffness along it.
   subroutine look_along(work, now, slope, stiffness)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(out) :: slope               !! G.d + s.H d
      real(dp), intent(out) :: stiffness           !! d.H d
      real(dp), allocatable :: rows(:, :)
      real(dp) :: totals(2)
      integer :: j

      allocate (rows(2, work%patch%all_rows))
      !$omp parallel do default(none) shared(work, now, rows) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         call look_along_row(work, now, j, work%patch%inner(j), rows(:, j))
      end do
      totals = work%patch%sharing%totals(rows)
      slope = totals(1) - now%force*now%last_lift
      stiffness = now%last_form + totals(2)
   end subroutine look_along

   !> The sums of row j.
   subroutine look_along_row(work, now, j, n, row)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(in) :: now
      integer, intent(in) :: j
      integer, intent(in) :: n                     !! cells of the patch
      real(dp), intent(out) :: row(2)
      real(dp) :: s, d, slope, curvature, modulus
      integer :: i

      modulus = now%problem%modulus
      slope = 0.0_dp
      curvature = 0.0_dp
      call adhesive_slopes(now%problem%potential, now%state(1:n, j), work%exchange(1:n, j), &
         work%curvature(1:n, j))
      do i = 1, n
         s = work%direction(i, j)
         d = work%last_step(i, j)
         slope = slope + now%traction(i, j)*(d + now%last_lift) + (now%load + work%exchange(i, j))*d &
            + modulus*(s + now%lift)*work%last_image(i, j) + work%curvature(i, j)*s*d
         curvature = curvature + work%curvature(i, j)*d**2
      end do
      do i = n + 1, work%patch%mx
         slope = slope + now%traction(i, j)*work%last_step(i, j) &
            + modulus*work%direction(i, j)*work%last_image(i, j)
      end do
      row(:) = [slope, curvature]
   end subroutine look_along_row

   !> The part of w = b d with which no g + z_0 of an open cell changes by more than a share.
   function allowed_part(work, now, b) result(tau)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: b
      real(dp) :: tau
      real(dp), allocatable :: least(:)
      real(dp) :: gap, w, limit
      integer :: i, j

      allocate (least(work%patch%rows))
      !$omp parallel do default(none) shared(work, now, b, least) private(i, j, gap, w, limit) &
      !$omp num_threads(work%patch%threads)
      do j = 1, work%patch%rows
         limit = 1.0_dp
         do i = 1, work%patch%nx
            w = abs(b*work%last_step(i, j))
            gap = now%state(i, j) + work%direction(i, j)
            if (gap > 0.0_dp .and. limit*w > share*(gap + now%units%length)) &
               limit = share*(gap + now%units%length)/w
         end do
         least(j) = limit
      end do
      tau = min(least_of_rows(least), 1.0_dp)
   end function allowed_part

   !> Set s = s + b d, except in cells that s closes.
   subroutine combine(work, now, b)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: b
      integer :: i, j, n

      !$omp parallel do default(none) shared(work, now, b) private(i, j, n) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         n = work%patch%inner(j)
         do i = 1, n
            if (now%state(i, j) + work%direction(i, j) > 0.0_dp) &
               work%direction(i, j) = work%direction(i, j) + b*work%last_step(i, j)
         end do
         do i = n + 1, work%patch%mx
            work%direction(i, j) = work%direction(i, j) + b*work%last_step(i, j)
         end do
      end do
   end subroutine combine

   !> Limit the step so that it closes the gaps that would be negative.
   subroutine close_step(work, now, shift)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: shift                !! of the gaps, keeps a prescribed sum
      integer :: i, j

      !$omp parallel do default(none) shared(work, now, shift) private(i, j) num_threads(work%patch%threads)
      do j = 1, work%patch%rows
         do i = 1, work%patch%nx
            work%direction(i, j) = stepped_gap(now%state(i, j), work%direction(i, j), 1.0_dp, shift) &
               - now%state(i, j)
         end do
      end do
   end subroutine close_step

   !> Lengthen the step, whose product is known, to the minimum that its second derivative predicts.
   subroutine stretch_step(work, now, known, stretch)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: now
      type(step_sums_type), intent(inout) :: known
      real(dp), intent(out) :: stretch
      real(dp), allocatable :: least(:)
      real(dp) :: gap, limit, s, stiffness
      integer :: i, j

      stretch = greatest_stretch
      stiffness = known%form + known%curvature
      if (stiffness > least_stiffness*known%form) stretch = min(stretch, -known%slope/stiffness)
      if (.not. stretch > 1.05_dp .or. .not. has_smooth_potential(now%problem%potential)) stretch = 1.0_dp
      if (.not. stretch > 1.0_dp) return
      allocate (least(work%patch%rows))
      !$omp parallel do default(none) shared(work, now, stretch, least) private(i, j, gap, s, limit) &
      !$omp num_threads(work%patch%threads)
      do j = 1, work%patch%rows
         limit = stretch - 1.0_dp
         do i = 1, work%patch%nx
            s = work%direction(i, j)
            gap = max(now%state(i, j) + s, 0.0_dp)
            if (gap + limit*s < 0.0_dp) limit = -gap/s
            if (limit*abs(s) > share*(gap + now%units%length)) limit = share*(gap + now%units%length)/abs(s)
         end do
         least(j) = limit
      end do
      stretch = 1.0_dp + min(least_of_rows(least), stretch - 1.0_dp)
      if (.not. stretch > 1.05_dp) stretch = 1.0_dp
      if (.not. stretch > 1.0_dp) return
      !$omp parallel do default(none) shared(work, stretch) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         work%direction(:, j) = stretch*work%direction(:, j)
      end do
      now%lift = stretch*now%lift
      known%form = stretch**2*known%form
      known%slope = stretch*known%slope
      known%adhesive_slope = stretch*known%adhesive_slope
   end subroutine stretch_step

   !> Keep a step that was taken as the step before the next one.
   subroutine keep_step(work, now, form)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), intent(in) :: form                     !! Q d.B d
      real(dp), allocatable :: spare(:, :)

      call move_alloc(work%last_step, spare)
      call move_alloc(work%direction, work%last_step)
      call move_alloc(spare, work%direction)
      call move_alloc(work%last_image, spare)
      call move_alloc(work%image, work%last_image)
      call move_alloc(spare, work%image)
      now%last_form = form
      now%last_lift = now%lift
      now%has_last = .not. now%held
   end subroutine keep_step

end module adhesion_plane
