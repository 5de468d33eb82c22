!> The innermost loops of module `normal_cg` over neighbouring cells of one row.
!>
!> Each is one loop without branches, so that it runs in vector registers. Conditions are therefore expressed by
!> `sign` and `max`. With `merge`, gfortran 12 finds control flow in the loop and does not vectorise it, and a solve
!> of 1024 x 1024 cells takes 12 to 30 % more time. No masks are stored: a cell
!> is in the contact set S if the residual is not 0, and the direction acts where it is not 0.
!> The loops take many arguments because passing them costs less than looking them up in records.
module normal_sweeps
   use normal_sums, only : direction_sums_type, state_sums_type, step_sums_type, &
      trial_sums_type
   use asperity_precision, only : dp, sp
   implicit none
   private

   public :: above_cells, changed_trial_cells, clip_cells, count_cells_below, direction_cells, load_cells, &
      longest_cells, measure_cells, overlap_cells, residual_cells, spread_cells, trial_cells

contains

   !> Compute the residual scale (level - gap) on S = {P > 0 or gap < level}, and zero elsewhere. The residual before is
   !> kept. Other passes assume that a cell is in S if its residual is not 0, so it must not be 0 there.
   pure subroutine residual_cells(n, scale, level, pressure, gap, residual, before, column)
      integer, intent(in) :: n
      real(dp), intent(in) :: scale, level
      real(dp), intent(in) :: pressure(n), gap(n)
      real(sp), intent(inout) :: residual(n)
      real(dp), intent(inout) :: before(n)
      real(sp), intent(inout) :: column(n)          !! sums over the rows of a block
      real(dp), parameter :: least = tiny(1.0_sp)
      real(dp) :: g
      integer :: i

      !$omp simd private(g)
      do i = 1, n
         before(i) = residual(i)
         g = level - gap(i)
         residual(i) = real(positive(max(g, pressure(i)))*sign(max(abs(scale*g), least), g), sp)
         column(i) = column(i) + residual(i)
      end do
   end subroutine residual_cells

   !> Product of z = M r with the residual before, on the present S.
   pure function overlap_cells(n, length, image, response, correction, residual, before) result(overlap)
      integer, intent(in) :: n
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! z = image + length response + ...
      real(sp), intent(in) :: residual(n)
      real(dp), intent(in) :: before(n)
      real(dp) :: overlap
      integer :: i

      overlap = 0.0_dp
      !$omp simd reduction(+:overlap)
      do i = 1, n
         overlap = overlap + acts(residual(i))*(image(i) + length*response(i) + correction(i))*before(i)
      end do
   end function overlap_cells

   !> Compute direction = z + beta (direction - offset) with z = M r where it acts: on S, except in cells without
   !> pressure in which z is negative.
   pure subroutine direction_cells(n, length, image, response, correction, residual, beta, offset, &
      pressure, direction, sums)
      integer, intent(in) :: n
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! z = image + length response + ...
      real(sp), intent(in) :: residual(n)
      real(sp), intent(in) :: beta
      real(sp), intent(in) :: offset                !! mean of the old direction
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(inout) :: direction(n)
      type(direction_sums_type), intent(inout) :: sums
      ! Other passes assume that d acts where it is not 0, so it must not be 0 where it acts.
      real(sp), parameter :: least = tiny(1.0_sp)
      real(dp) :: total, cells, product, residuals
      real(sp) :: z, d, inside
      integer :: i

      total = 0.0_dp
      cells = 0.0_dp
      product = 0.0_dp
      residuals = 0.0_dp
      !$omp simd reduction(+:total, cells, product, residuals) private(z, d, inside)
      do i = 1, n
         z = image(i) + length*response(i) + correction(i)
         inside = real(positive(max(pressure(i), real(min(abs(residual(i)), z), dp))), sp)
         d = inside*(z + beta*(direction(i) - offset*acts(direction(i))) + least)
         direction(i) = d
         total = total + d
         cells = cells + inside
         product = product + residual(i)*d
         residuals = residuals + residual(i)*inside
      end do
      sums%value = sums%value + total
      sums%cells = sums%cells + cells
      sums%slope = sums%slope + product
      sums%residual = sums%residual + residuals
   end subroutine direction_cells

   !> Add direction - offset, where it acts, to the sums over the rows of a block, and its square to a sum.
   pure subroutine spread_cells(n, offset, direction, column, square)
      integer, intent(in) :: n
      real(dp), intent(in) :: offset
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: column(n)
      real(dp), intent(inout) :: square
      real(dp) :: total, d
      integer :: i

      total = 0.0_dp
      !$omp simd reduction(+:total) private(d)
      do i = 1, n
         d = direction(i) - offset*acts(direction(i))
         column(i) = column(i) + d
         total = total + d**2
      end do
      square = square + total
   end subroutine spread_cells

   !> Compute trial = P + alpha (direction - offset), and its sums above the limit 0.
   pure subroutine trial_cells(n, alpha, offset, pressure, direction, trial, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: alpha, offset
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: trial(n)
      type(trial_sums_type), intent(inout) :: sums
      real(dp) :: total, cells, lowest
      integer :: i

      total = 0.0_dp
      cells = 0.0_dp
      lowest = sums%least
      !$omp simd reduction(+:total, cells) reduction(min:lowest)
      do i = 1, n
         trial(i) = pressure(i) + alpha*(direction(i) &
            - offset*acts(direction(i)))
         total = total + max(trial(i), 0.0_dp)
         cells = cells + positive(trial(i))
         lowest = min(lowest, trial(i))
      end do
      sums%above = sums%above + total
      sums%cells = sums%cells + cells
      sums%least = lowest
   end subroutine trial_cells

   !> Add the change that the release of cells has caused to the direction, and compute
   !> trial = P + alpha (direction - offset) and its sums above 0. In the cells that were released, and in all others in
   !> which the direction does not act, the trial pressure is so low that it will be 0 after any projection. (Their
   !> least trial pressure counts as -P.)
   pure subroutine changed_trial_cells(n, alpha, offset, length, image, response, correction, residual, pressure, &
      direction, trial, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: alpha, offset
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! change = image + length response + ...
      real(sp), intent(in) :: residual(n)
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(inout) :: direction(n)
      real(dp), intent(inout) :: trial(n)
      type(trial_sums_type), intent(inout) :: sums
      real(dp), parameter :: lowest = -huge(1.0_dp)
      real(dp) :: total, cells, least, kept, value
      real(sp) :: d, inside
      integer :: i

      total = 0.0_dp
      cells = 0.0_dp
      least = sums%least
      !$omp simd reduction(+:total, cells) reduction(min:least) private(d, inside, kept, value)
      do i = 1, n
         inside = acts(residual(i))*acts(direction(i))
         d = inside*(direction(i) + (image(i) + length*response(i) + correction(i)))
         direction(i) = d
         kept = inside
         value = kept*(pressure(i) + alpha*(d - offset))
         trial(i) = value + (1.0_dp - kept)*lowest
         total = total + max(value, 0.0_dp)
         cells = cells + positive(value)
         least = min(least, value - (1.0_dp - kept)*pressure(i))
      end do
      sums%above = sums%above + total
      sums%cells = sums%cells + cells
      sums%least = least
   end subroutine changed_trial_cells

   !> Sum of the parts of the values above a limit, and the number of such values.
   pure subroutine above_cells(n, limit, values, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: limit
      real(dp), intent(in) :: values(n)
      type(trial_sums_type), intent(inout) :: sums
      real(dp) :: total, cells
      integer :: i

      total = 0.0_dp
      cells = 0.0_dp
      !$omp simd reduction(+:total, cells)
      do i = 1, n
         total = total + max(values(i) - limit, 0.0_dp)
         cells = cells + positive(values(i) - limit)
      end do
      sums%above = sums%above + total
      sums%cells = sums%cells + cells
   end subroutine above_cells

   !> Compute step = factor max(trial - shift, 0) - P. In: `step` holds the trial pressure.
   pure subroutine clip_cells(n, factor, shift, level, pressure, gap, step, column, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: factor, shift, level
      real(dp), intent(in) :: pressure(n), gap(n)
      real(dp), intent(inout) :: step(n)
      real(dp), intent(inout) :: column(n)          !! sums over the rows of a block
      type(step_sums_type), intent(inout) :: sums
      real(dp) :: product, square
      integer :: i

      product = 0.0_dp
      square = 0.0_dp
      !$omp simd reduction(+:product, square)
      do i = 1, n
         step(i) = factor*max(step(i) - shift, 0.0_dp) - pressure(i)
         column(i) = column(i) + step(i)
         product = product + (level - gap(i))*step(i)
         square = square + step(i)**2
      end do
      sums%slope = sums%slope + product
      sums%square = sums%square + square
   end subroutine clip_cells

   !> Reduce `longest` to the longest multiple of the step for which no pressure becomes negative.
   pure subroutine longest_cells(n, pressure, step, longest)
      integer, intent(in) :: n
      real(dp), intent(in) :: pressure(n), step(n)
      real(dp), intent(inout) :: longest
      real(dp) :: fastest
      integer :: i

      fastest = tiny(1.0_dp)
      !$omp simd reduction(max:fastest)
      do i = 1, n
         fastest = max(fastest, -step(i)/max(pressure(i), tiny(1.0_dp)))
      end do
      longest = min(longest, 1.0_dp/fastest)
   end subroutine longest_cells

   !> 1 if x > 0 and 0 otherwise, without a branch.
   elemental function positive(x)
      real(dp), intent(in) :: x
      real(dp) :: positive

      positive = 0.5_dp - sign(0.5_dp, 0.0_dp - x)
   end function positive

   !> 1 if the direction is not 0 and 0 otherwise, without a branch.
   elemental function acts(direction)
      real(sp), intent(in) :: direction
      real(sp) :: acts

      acts = 0.5_sp + sign(0.5_sp, abs(direction) - tiny(1.0_sp))
   end function acts

   !> Update P = P + alpha step, and form the sums of the new state without its least gap.
   pure subroutine load_cells(n, alpha, target, gap, step, pressure, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: target                !! prescribed level
      real(dp), intent(in) :: gap(n), step(n)
      real(dp), intent(inout) :: pressure(n)
      type(state_sums_type), intent(inout) :: sums
      real(dp) :: load, work, touched, cells, distance, p, inside
      integer :: i

      load = 0.0_dp
      work = 0.0_dp
      touched = 0.0_dp
      cells = 0.0_dp
      distance = 0.0_dp
      !$omp simd reduction(+:load, work, touched, cells, distance) private(p, inside)
      do i = 1, n
         ! Round-off must not make the pressure negative in a cell where the step removes all of it.
         p = max(pressure(i) + alpha*step(i), 0.0_dp)
         pressure(i) = p
         load = load + p
         work = work + p*gap(i)
         distance = distance + p*abs(gap(i) - target)
         inside = positive(p)
         touched = touched + inside*gap(i)
         cells = cells + inside
      end do
      sums%load = sums%load + load
      sums%work = sums%work + work
      sums%touched = sums%touched + touched
      sums%cells = sums%cells + cells
      sums%distance = sums%distance + distance
   end subroutine load_cells

   !> Form the sums of a state without its least gap.
   pure subroutine measure_cells(n, target, gap, pressure, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: target                !! prescribed level
      real(dp), intent(in) :: gap(n), pressure(n)
      type(state_sums_type), intent(out) :: sums
      real(dp) :: load, work, touched, cells, distance, inside
      integer :: i

      load = 0.0_dp
      work = 0.0_dp
      touched = 0.0_dp
      cells = 0.0_dp
      distance = 0.0_dp
      !$omp simd reduction(+:load, work, touched, cells, distance) private(inside)
      do i = 1, n
         load = load + pressure(i)
         work = work + pressure(i)*gap(i)
         distance = distance + pressure(i)*abs(gap(i) - target)
         inside = positive(pressure(i))
         touched = touched + inside*gap(i)
         cells = cells + inside
      end do
      sums%load = load
      sums%work = work
      sums%touched = touched
      sums%cells = cells
      sums%distance = distance
   end subroutine measure_cells

   !> Count the cells whose pressure is positive, and not above a limit.
   pure function count_cells_below(n, limit, pressure) result(cells)
      integer, intent(in) :: n
      real(dp), intent(in) :: limit
      real(dp), intent(in) :: pressure(n)
      real(dp) :: cells
      integer :: i

      cells = 0.0_dp
      !$omp simd reduction(+:cells)
      do i = 1, n
         cells = cells + positive(pressure(i))*(1.0_dp - positive(pressure(i) - limit))
      end do
   end function count_cells_below

end module normal_sweeps
