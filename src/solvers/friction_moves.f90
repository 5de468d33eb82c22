!> Moves of the traction: T' = T + step d, after which points outside their bound are returned to it.
module friction_moves
   use asperity_precision, only : dp, int8
   use fft_conv, only : convolution_type
   use friction_problem, only : friction_problem_type
   use friction_rows, only : move_sums_type, move_type, returned_row, stepped_row, total_of
   implicit none
   private

   public :: move, move_total, pseudo_inverse

   real(dp), parameter :: few = 1.0e-6_dp      !! fraction of points that cannot compensate for the others
   integer, parameter :: corrections = 12       !! largest number of corrections of a total
   !> The part of a total that may be missing: the slip that it makes over the largest residual.
   real(dp), parameter :: negligible = 0.1_dp

contains

   !> Compute T' = T + step d, and return points to their bounds.
   subroutine move(problem, operator, step, direction, again, transform, returned)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in), contiguous :: direction(:, :, :)     !! [width, 2, rows] d, Pa
      logical, intent(in) :: again                   !! start again from the T before the last move
      logical, intent(in) :: transform               !! transform the rows of T' in the same pass
      logical, intent(out) :: returned               !! some points were returned to their bounds
      type(move_sums_type) :: sums

      call move_rows(problem, operator, move_type(step=step, again=again), direction, transform, sums)
      returned = sums%returned > 0.0_dp
   end subroutine move

   !> Do the same as `move`, but keep the total of T + step d as far as the bounds allow it. A uniform traction c
   !> is added at the points that stuck, to compensate for the points that are returned to their bounds. Without
   !> it, a change of the total would move the whole contact if the mean mode is soft. (The total that slipping
   !> points lose by turning is of second order.) The missing total m(c) is monotone, so that c is found by Newton's
   !> method, with steps that are shortened if they go too far.
   subroutine move_total(problem, operator, step, direction, again, returned)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: step
      real(dp), intent(in), contiguous :: direction(:, :, :)     !! [width, 2, rows] d, Pa
      logical, intent(in) :: again                   !! from the T before the last move
      logical, intent(out) :: returned               !! some points were returned to their bounds
      type(move_type) :: how
      type(move_sums_type) :: sums
      real(dp) :: s(2), missed(2), allowed
      integer :: trial

      how = move_type(step=step, again=again)
      call move_rows(problem, operator, how, direction, .false., sums)
      how%again = .true.
      allowed = negligible*problem%residual*problem%scale/maxval(problem%mean_compliance)
      trial = 0
      do while (trial < corrections .and. norm2(sums%missed) > allowed)
         missed = sums%missed
         s = -matmul(pseudo_inverse(sums%arriving, few), missed)
         if (.not. norm2(s) > 0.0_dp) exit
         call correct_total(problem, operator, how, direction, s, allowed, sums, trial)
         if (norm2(sums%missed) > 0.9_dp*norm2(missed)) exit
      end do
      returned = sums%returned > 0.0_dp
   end subroutine move_total

   !> Add s to the uniform traction c of a move, or the part of s for which m.s = 0 (regula falsi, Illinois).
   subroutine correct_total(problem, operator, how, direction, s, allowed, sums, trial)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(move_type), intent(inout) :: how          !! with c
      real(dp), intent(in), contiguous :: direction(:, :, :)
      real(dp), intent(in) :: s(2)                   !! Pa
      real(dp), intent(in) :: allowed                !! |m| that is small enough, Pa
      type(move_sums_type), intent(inout) :: sums    !! of the move with c
      integer, intent(inout) :: trial                !! moves so far
      real(dp) :: c(2), near, far, at_near, at_far, t, at_t
      integer :: side

      c = how%uniform
      near = 0.0_dp
      at_near = dot_product(sums%missed, s)
      far = 1.0_dp
      t = 1.0_dp
      call try(at_far)
      side = 0
      ! Without a change of sign there is nothing between the two ends: round-off has spoilt s.
      do while (at_near < 0.0_dp .and. at_far > 0.0_dp .and. norm2(sums%missed) > allowed .and. trial < corrections)
         t = near + (far - near)*at_near/(at_near - at_far)
         call try(at_t)
         if (at_t > 0.0_dp) then
            far = t
            at_far = at_t
            if (side == 1) at_near = 0.5_dp*at_near
            side = 1
         else
            near = t
            at_near = at_t
            if (side == -1) at_far = 0.5_dp*at_far
            side = -1
            if (abs(at_t) < 0.1_dp*norm2(sums%missed)*norm2(s)) exit
         end if
      end do

   contains

      !> Move with c + t s, and compute m.s.
      subroutine try(value)
         real(dp), intent(out) :: value

         how%uniform = c + t*s
         call move_rows(problem, operator, how, direction, .false., sums)
         trial = trial + 1
         value = dot_product(sums%missed, s)
      end subroutine try

   end subroutine correct_total

   !> Move all rows, and form the sums.
   subroutine move_rows(problem, operator, how, direction, transform, sums)
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      type(move_type), intent(in) :: how
      real(dp), intent(in), contiguous :: direction(:, :, :)
      logical, intent(in) :: transform
      type(move_sums_type), intent(out) :: sums
      type(move_sums_type), allocatable :: rows(:)
      integer :: j

      allocate (rows(problem%rows))
      !$omp parallel do default(none) shared(problem, operator, how, direction, transform, rows) &
      !$omp private(j) num_threads(problem%threads)
      do j = 1, problem%rows
         call move_row(problem, how, direction(:, :, j), j, rows(j))
         if (transform) call problem%transform_row(operator, j)
      end do
      sums = total_of(rows)
      problem%change = sqrt(sums%changed/max(sums%size, tiny(1.0_dp)))
   end subroutine move_rows

   !> Compute a row of T' = T + step d, and return points to their bounds.
   subroutine move_row(problem, how, d, j, sums)
      type(friction_problem_type), intent(inout) :: problem
      type(move_type), intent(in) :: how
      real(dp), intent(in) :: d(problem%width, 2)
      integer, intent(in) :: j
      type(move_sums_type), intent(out) :: sums
      real(dp) :: state(problem%width), slips(problem%width)

      associate (work => problem%work)
         state(:) = work%contact(:, j)
         call stepped_row(how, d, work%tangent(:, :, j), state, work%traction(:, :, j), work%old(:, :, j), slips)
         call returned_row(problem%constants, how%uniform, work%site(:, :, j), slips, work%old(:, :, j), &
            work%traction(:, :, j), state, sums)
         work%contact(:, j) = int(state, int8)
      end associate
   end subroutine move_row

   !> Pseudo-inverse of the symmetric semidefinite matrix (xx, xy; xy, yy). Eigenvalues that are too small are
   !> left out; the result for a zero matrix is zero.
   pure function pseudo_inverse(matrix, left_out) result(inverse)
      real(dp), intent(in) :: matrix(3)              !! xx, xy, yy
      real(dp), intent(in) :: left_out               !! an eigenvalue below this part of the larger one is left out
      real(dp) :: inverse(2, 2)
      real(dp) :: larger, smaller, axis(2)

      inverse = 0.0_dp
      associate (xx => matrix(1), xy => matrix(2), yy => matrix(3))
         larger = 0.5_dp*(xx + yy + hypot(xx - yy, 2.0_dp*xy))
         if (.not. larger > 0.0_dp) return
         smaller = (xx*yy - xy**2)/larger
         if (xx >= yy) then
            axis = [larger - yy, xy]
         else
            axis = [xy, larger - xx]
         end if
         if (smaller > left_out*larger) then
            inverse = reshape([yy, -xy, -xy, xx], [2, 2])/(xx*yy - xy**2)
         else if (norm2(axis) > 0.0_dp) then
            axis = axis/norm2(axis)
            inverse(:, 1) = axis(1)*axis/larger
            inverse(:, 2) = axis(2)*axis/larger
         end if
      end associate
   end function pseudo_inverse

end module friction_moves
