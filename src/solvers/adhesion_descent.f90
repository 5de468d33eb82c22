!> A step of the fast method for adhesive contact towards the minimum of a local model of the energy.
!>
!> The model of the energy has B_h (module `adhesion_model`) in place of B. The attraction, which is not linearised, and
!> the condition g >= 0 are exact. The model is minimised by preconditioned conjugate gradients on the free cells (module
!> `adhesion_directions`) without any transform of full size. An edge of the contact that advances cell by cell over a
!> long distance therefore needs few such transforms. A step ends after `most_iterations`, because more would only make
!> it more accurate for B_h, which differs from B.
!>
!> Gaps that would be negative after an iteration are closed, which changes the step and thus the traction. The
!> stencil part of the product is usually sufficient for this correction, because the closed cells are scattered
!> and a product with B follows the step. The whole product is formed if the sum of the gap is prescribed, because
!> all open cells then move; if the attraction jumps, because an iteration may then close gaps by a large amount;
!> on free grids, because the closed cells may be a large part of the contact, and the missing part of their
!> product, far away, adds up in the level; and after steps that failed.
!>
!> Small spots where the attraction closes or opens a gap may still be far from equilibrium when a step ends. Unless the
!> length of an iteration was limited, they are then relaxed in small windows (module `adhesion_spots`).
!>
!> If the attraction is strong, the energy has many minima, and a long step can leap over the minimum at which a
!> slow motion would stop. Therefore no iteration changes g + z_0 of a cell by more than a fraction of it: the
!> attraction then changes little, and the cells that have come into contact resist before their neighbours
!> follow. Without this limit rough surfaces end with 5 to 10 % more contact. The number of iterations limits
!> the length of a step, too: with 24 instead of 8 a fifth fewer transforms would be needed, but on rough surfaces
!> half of the solutions would be other minima than the one that a slow loading reaches.
module adhesion_descent
   use adhesion_closing, only : keep_gap_sum
   use adhesion_directions, only : find_direction
   use adhesion_potential, only : has_smooth_potential
   use adhesion_state, only : control_approach
   use adhesion_residual, only : measure
   use adhesion_spots, only : may_have_spots, relax_spots
   use adhesion_steps, only : stepped_gap, sum_shift
   use adhesion_sweeps, only : move_cells
   use adhesion_window, only : largest_change, least_stiffness
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : row_product
   implicit none
   private

   public :: approach_minimum, keeps_sum

   integer, parameter :: most_iterations = 8          !! in the model, for a step
   real(dp), parameter :: goal = 0.1_dp               !! part of the residual at which a step ends
   real(dp), parameter :: narrow = 0.1_dp             !! a narrow gap is at most this part of z_0, and of z_0 G/(unit of G)
   real(dp), parameter :: change_at_jump = 100.0_dp   !! the same if the attraction jumps

contains

   !> Compute the step from the present gap towards a minimum of the model, in work%direction and now%lift. The gap has
   !> been measured. After steps that failed, or of which hardly anything could be taken, the step is shorter for a while.
   subroutine approach_minimum(work, now)
      type(adhesion_work_type), intent(inout), target :: work
      type(adhesion_iteration_type), intent(inout) :: now
      type(adhesion_iteration_type) :: inner
      real(dp) :: largest
      integer :: j, k, most, shorter

      inner = now
      inner%state => work%model_state
      inner%traction => work%model_traction
      !$omp parallel do default(none) shared(work, now, inner) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         inner%state(:, j) = now%state(:, j)
         inner%traction(:, j) = now%traction(:, j)
         work%direction(:, j) = 0.0_dp
      end do
      inner%old_rz = 0.0_dp
      inner%lift = 0.0_dp
      inner%length_limited = .false.
      inner%pending = 0.0_dp
      inner%correction_pending = .false.
      shorter = 4**min(now%caution, 10)
      most = max(1, most_iterations/shorter)
      largest = largest_change/shorter
      ! If steps were small, a jump of the attraction would stop every cell that arrives at it.
      if (.not. has_smooth_potential(now%problem%potential)) largest = change_at_jump/shorter
      if (now%failures > 0) call close_narrow_gaps(work, inner)
      do k = 1, most
         if (k > 1 .or. abs(inner%pending) > 0.0_dp) call measure(work, inner)
         if (k > 1 .and. inner%residual <= goal*now%residual) exit
         call find_direction(work, inner)
         if (.not. inner%slope > 0.0_dp) exit
         call descend(work, inner, largest)
      end do
      if (may_have_spots(work, now) .and. now%caution == 0 .and. .not. (inner%length_limited .or. keeps_sum(work, now))) then
         if (k > most) call measure(work, inner)
         if (inner%residual > goal*now%residual) call relax_spots(work, goal*now%residual, inner)
      end if
      !$omp parallel do default(none) shared(work, now, inner) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         work%direction(:, j) = inner%state(:, j) - now%state(:, j)
      end do
      now%lift = inner%level - now%level
      now%length_limited = inner%length_limited
   end subroutine approach_minimum

   !> Is the sum of the gaps prescribed?
   pure logical function keeps_sum(work, now)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: now

      keeps_sum = work%patch%periodic .and. now%problem%control == control_approach
   end function keeps_sum

   !> Close the gaps that are narrow and about to close anyway. After a step of which only a part was taken, many gaps may
   !> be so narrow that the next step closes them at once. The direction would point downhill mainly in these cells, and
   !> uphill without them. If the sum of the gaps is prescribed, a single such gap may spoil the load, because the load
   !> is that for which the gradient has no mean over the open cells; the open gaps then keep the sum.
   subroutine close_narrow_gaps(work, inner)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: inner
      real(dp) :: form
      logical :: any_closed
      integer :: j, n

      any_closed = .false.
      !$omp parallel do default(none) shared(work, inner) private(j, n) reduction(.or.: any_closed) &
      !$omp num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         n = work%patch%inner(j)
         work%change(:, j) = inner%state(:, j)
         associate (gap => inner%state(1:n, j)/inner%units%length, &
            gradient => -work%residual(1:n, j)/inner%units%traction)
            where (gap <= narrow .and. gap <= narrow*gradient) inner%state(1:n, j) = 0.0_dp
         end associate
         any_closed = any_closed .or. any(inner%state(1:n, j) < work%change(1:n, j))
      end do
      if (.not. any_process(any_closed)) return

      if (keeps_sum(work, inner)) call keep_gap_sum(work%patch, inner)
      !$omp parallel do default(none) shared(work, inner) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         work%change(:, j) = inner%state(:, j) - work%change(:, j)
         call work%model%put_row(j, work%change(:, j))
      end do
      call form_product(work, form)
      inner%pending = inner%problem%modulus
   end subroutine close_narrow_gaps

   !> Do an iteration in the model: move along the direction by the length that its curvature predicts.
   subroutine descend(work, inner, largest)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: inner
      real(dp), intent(in) :: largest                  !! change of g + z_0, relative to g + z_0
      real(dp) :: alpha, form, shift, stiffness
      logical :: clipped, whole

      call form_product(work, form)
      form = inner%problem%modulus*form
      stiffness = max(form + inner%bend, least_stiffness*form)
      alpha = largest*inner%farthest
      if (stiffness*alpha > inner%slope) then
         alpha = inner%slope/stiffness
      else
         inner%length_limited = .true.
      end if
      shift = 0.0_dp
      whole = keeps_sum(work, inner) .or. inner%caution > 0 .or. .not. work%patch%periodic &
         .or. .not. has_smooth_potential(inner%problem%potential)
      if (keeps_sum(work, inner)) shift = sum_shift(inner%state, work%direction, alpha, inner%gap_sum, work%patch%threads)
      call move(work, inner, alpha, shift, whole, clipped)
      inner%level = inner%level + alpha*inner%lift
      inner%pending = inner%problem%modulus*alpha
      inner%correction_pending = clipped .and. .not. whole
      if (.not. (clipped .or. abs(shift) > 0.0_dp)) return
      if (whole) then
         ! The shift moves all open cells, so that the traction needs a product of the actual step.
         call form_product(work, form)
         inner%pending = inner%problem%modulus
      else
         call work%model%halo%fetch(work%change)
      end if
   end subroutine descend

   !> Compute the product of B_h with the change of the displacement, whose rows have been passed to the model, and the
   !> quadratic form.
   subroutine form_product(work, form)
      type(adhesion_work_type), intent(inout) :: work
      real(dp), intent(out) :: form
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(1)
      integer :: j

      call work%model%halo%fetch(work%change)
      call work%model%transform_product()
      allocate (rows(1, work%patch%all_rows))
      !$omp parallel do default(none) shared(work, rows) private(j) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         call work%model%product_row(j, work%change, work%image(:, j))
         rows(1, j) = row_product(work%change(:, j), work%image(:, j))
      end do
      sums = work%patch%sharing%totals(rows)
      form = sums(1)
   end subroutine form_product

   !> Set g = g + alpha d, or 0 where that would be negative. Compute the whole change of the displacement, or only its
   !> correction: the difference from alpha times the change of which the product is known.
   subroutine move(work, inner, alpha, shift, whole, clipped)
      type(adhesion_work_type), intent(inout) :: work
      type(adhesion_iteration_type), intent(inout) :: inner
      real(dp), intent(in) :: alpha, shift
      logical, intent(in) :: whole                     !! compute the whole change
      logical, intent(out) :: clipped                  !! the correction is not zero
      real(dp) :: furthest, next, old
      integer :: i, j, n
      logical :: any_clipped

      any_clipped = .false.
      work%has_correction(:) = .true.
      !$omp parallel do default(none) shared(work, inner, alpha, shift, whole) private(i, j, n, next, old, furthest) &
      !$omp reduction(.or.: any_clipped) num_threads(work%patch%threads)
      do j = 1, work%patch%all_rows
         n = work%patch%inner(j)
         if (whole) then
            do i = 1, n
               old = inner%state(i, j)
               next = stepped_gap(old, work%direction(i, j), alpha, shift)
               any_clipped = any_clipped .or. next > old + alpha*work%direction(i, j) - shift
               work%change(i, j) = next - old + alpha*inner%lift
               inner%state(i, j) = next
            end do
            do i = n + 1, work%patch%mx
               work%change(i, j) = alpha*work%direction(i, j)
               inner%state(i, j) = inner%state(i, j) + work%change(i, j)
            end do
            call work%model%put_row(j, work%change(:, j))
         else
            call move_cells(alpha, work%direction(1:n, j), inner%state(1:n, j), work%change(1:n, j), furthest)
            work%has_correction(j) = furthest > 0.0_dp
            any_clipped = any_clipped .or. work%has_correction(j)
            do i = n + 1, work%patch%mx
               inner%state(i, j) = inner%state(i, j) + alpha*work%direction(i, j)
               work%change(i, j) = 0.0_dp
            end do
         end if
      end do
      clipped = any_process(any_clipped)
   end subroutine move

end module adhesion_descent
