!> Searches for the step of an adhesive contact in the plane of the model's step and of the step before it.
!>
!> Near an instability of the contact one mode is soft: its stiffness is a small difference between that of the
!> solid and that of the attraction. An error of a quarter in the local model of the energy (module
!> `adhesion_descent`) makes its steps many times too short along that mode, or reverses their sign. The true
!> quadratic form of a step is known, however, since every step is multiplied by B. Therefore the step s of the model is
!> made conjugate to the step d before it, with the true second derivatives H = Q B + e'':
!>     s = s + b d,     b = -(G.d + s.H d)/(d.H d)
!> which is the conjugate gradient method with the model as its preconditioner. If d.H d is not positive, the step
!> continues along d. In both cases b d is shortened until it changes no g + z_0 by more than `largest_change`, and
!> gaps that would be negative are set to 0. After the product B s, `stretch_step` lengthens the step to the minimum of
!> the energy along it.
module adhesion_plane
   use adhesion_potential, only : adhesive_slopes, has_smooth_potential
   use adhesion_state, only : control_approach
   use adhesion_steps, only : step_sums_type, stepped_gap, sum_shift
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_precision, only : dp
   use field_sums, only : least_of_rows
   implicit none
   private

   public :: keep_step, make_conjugate, stretch_step

   real(dp), parameter :: largest_change = 0.05_dp     !! of g + z_0 with b d, or by stretching, over g + z_0
   real(dp), parameter :: most = 4.0_dp                !! greatest |b|
   real(dp), parameter :: onward = 1.0_dp              !! |b| if d.H d is not positive
   real(dp), parameter :: greatest_stretch = 2.0_dp
   real(dp), parameter :: least_stiffness = 1e-3_dp    !! if d.H d/(d.Q B d) is less, it counts as negative

contains

   !> Make the step of the model, in work%direction and now%lift, conjugate to the step before. A step whose length was
   !> limited is left as it is, because it is far from a minimum of the model.
   subroutine make_conjugate(work, now)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp) :: b, shift, slope, stiffness

      if (.not. now%has_last .or. now%length_limited .or. .not. has_smooth_potential(now%problem%potential)) return
      if (.not. now%last_form > 0.0_dp) return
      call measure_along(work, now, slope, stiffness)
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
   end subroutine make_conjugate

   !> Compute the stiffness along the step d before, and the slope of the energy along d after the step s of the model.
   subroutine measure_along(work, now, slope, stiffness)
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
         call measure_along_row(work, now, j, work%patch%inner(j), rows(:, j))
      end do
      totals = work%patch%sharing%totals(rows)
      slope = totals(1) - now%force*now%last_lift
      stiffness = now%last_form + totals(2)
   end subroutine measure_along

   !> Compute the parts of row j of both sums, without the part of B in the stiffness, which is known.
   subroutine measure_along_row(work, now, j, n, row)
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
   end subroutine measure_along_row

   !> The part of b d with which no g + z_0 of an open cell changes by more than `largest_change`.
   function allowed_part(work, now, b) result(part)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: b
      real(dp) :: part
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
            if (gap > 0.0_dp .and. limit*w > largest_change*(gap + now%units%length)) &
               limit = largest_change*(gap + now%units%length)/w
         end do
         least(j) = limit
      end do
      part = min(least_of_rows(least), 1.0_dp)
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

   !> Lengthen the step, whose product with B is known, to the minimum that its second derivative predicts. The factor is
   !> limited so that no gap becomes negative and no g + z_0 changes by more than `largest_change`.
   subroutine stretch_step(work, now, known, stretch)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: now
      type(step_sums_type), intent(inout) :: known
      real(dp), intent(out) :: stretch                 !! the factor; 1: the step is not changed
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
            if (limit*abs(s) > largest_change*(gap + now%units%length)) &
               limit = largest_change*(gap + now%units%length)/abs(s)
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
      now%has_last = .not. now%length_limited
   end subroutine keep_step

end module adhesion_plane
