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

   public :: changed_trial_cells, count_acting_cells, count_cells_below, direction_cells, form_trial_cells, load_cells, &
      longest_cells, lower_cells, measure_cells, overlap_cells, residual_cells, spread_cells, spread_step_cells, step_cells, &
      trial_cells, trial_type

   !> A trial pressure and its projection on the admissible pressures, which give the step
   !>     s = factor max(P + alpha (d - offset) - shift, 0) - P
   !> in the cells in which the direction d acts, and s = -P in the others. Neither is stored: each pass that needs them
   !> computes them from P and d, which takes about as long as reading them and saves a field.
   type :: trial_type
      real(dp) :: alpha = 0.0_dp            !! multiple of the direction
      real(dp) :: offset = 0.0_dp           !! to be subtracted from the direction
      real(dp) :: shift = 0.0_dp            !! Pa
      real(dp) :: factor = 1.0_dp
   contains
      procedure :: lowered
   end type trial_type

contains

   !> What the trial pressure above the shift lacks to P + alpha d, Pa.
   pure function lowered(self)
      class(trial_type), intent(in) :: self
      real(dp) :: lowered

      lowered = self%alpha*self%offset + self%shift
   end function lowered

   !> Compute the residual scale (level - gap) on S = {P > 0 or gap < level}, and zero elsewhere. Other
   !> passes assume that a cell is in S if its residual is not 0, so it must not be 0 there.
   pure subroutine residual_cells(n, scale, level, per_pressure, pressure, gap, residual, column)
      integer, intent(in) :: n
      real(dp), intent(in) :: scale, level
      real(dp), intent(in) :: per_pressure          !! makes a pressure a number about as large as a residual
      real(dp), intent(in) :: pressure(n), gap(n)
      real(sp), intent(inout) :: residual(n)
      real(sp), intent(inout) :: column(n)          !! sums over the rows of a block
      real(sp), parameter :: least = tiny(1.0_sp)
      real(sp) :: r, inside
      integer :: i

      !$omp simd private(r, inside)
      do i = 1, n
         r = real(scale*(level - gap(i)), sp)
         inside = positive_single(max(r, real(per_pressure*pressure(i), sp)))
         residual(i) = inside*sign(max(abs(r), least), r)
         column(i) = column(i) + residual(i)
      end do
   end subroutine residual_cells

   !> Count the cells in which a residual or a direction acts.
   pure subroutine count_acting_cells(n, values, column)
      integer, intent(in) :: n
      real(sp), intent(in) :: values(n)
      real(sp), intent(inout) :: column(n)          !! numbers over the rows of a block
      integer :: i

      !$omp simd
      do i = 1, n
         column(i) = column(i) + acts(values(i))
      end do
   end subroutine count_acting_cells

   !> Product of z = M r with the residual before, on the present S.
   pure function overlap_cells(n, length, image, response, correction, residual, before) result(overlap)
      integer, intent(in) :: n
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! z = image + length response + ...
      real(sp), intent(in) :: residual(n), before(n)
      real(dp) :: overlap
      integer :: i

      overlap = 0.0_dp
      !$omp simd reduction(+:overlap)
      do i = 1, n
         overlap = overlap + acts(residual(i))*(image(i) + length*response(i) + correction(i))*before(i)
      end do
   end function overlap_cells

   !> Compute direction = z + beta (direction - offset) with z = M r where it acts: on S, except in cells without
   !> pressure in which z is negative. A pressure below the range of single precision after its change of units counts as
   !> none.
   !>
   !> The sums over a run are in single precision: in double precision this loop takes almost three times as long. Their
   !> errors do not matter, because the step is projected on the given load, and its length follows from other sums.
   pure subroutine direction_cells(n, length, image, response, correction, residual, beta, offset, &
      per_pressure, pressure, direction, sums)
      integer, intent(in) :: n
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! z = image + length response + ...
      real(sp), intent(in) :: residual(n)
      real(sp), intent(in) :: beta
      real(sp), intent(in) :: offset                !! mean of the old direction
      real(dp), intent(in) :: per_pressure          !! makes a pressure a number about as large as those of a direction
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(inout) :: direction(n)
      type(direction_sums_type), intent(inout) :: sums
      ! Other passes assume that d acts where it is not 0, so it must not be 0 where it acts.
      real(sp), parameter :: least = tiny(1.0_sp)
      real(sp) :: total, cells, product, residuals, z, d, inside
      integer :: i

      total = 0.0_sp
      cells = 0.0_sp
      product = 0.0_sp
      residuals = 0.0_sp
      !$omp simd reduction(+:total, cells, product, residuals) private(z, d, inside)
      do i = 1, n
         z = image(i) + length*response(i) + correction(i)
         inside = positive_single(max(real(per_pressure*pressure(i), sp), min(abs(residual(i)), z)))
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

   !> Compute the trial pressure above the shift.
   pure subroutine form_trial_cells(n, trial, pressure, direction, values)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: values(n)
      real(dp) :: alpha, lowered
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      !$omp simd
      do i = 1, n
         values(i) = trial_of(alpha, lowered, pressure(i), direction(i))
      end do
   end subroutine form_trial_cells

   !> Form the sums of the trial pressure above the shift.
   pure subroutine trial_cells(n, trial, pressure, direction, sums)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(in) :: direction(n)
      type(trial_sums_type), intent(inout) :: sums
      real(dp) :: alpha, lowered, total, cells, lowest, value
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      total = 0.0_dp
      cells = 0.0_dp
      lowest = sums%least
      !$omp simd reduction(+:total, cells) reduction(min:lowest) private(value)
      do i = 1, n
         value = trial_of(alpha, lowered, pressure(i), direction(i))
         total = total + max(value, 0.0_dp)
         cells = cells + positive(value)
         lowest = min(lowest, value)
      end do
      sums%above = sums%above + total
      sums%cells = sums%cells + cells
      sums%least = lowest
   end subroutine trial_cells

   !> Add the change that the release of cells has caused to the direction, and form the sums of the trial pressure above
   !> 0. Afterwards the direction acts only in the cells that were not released. (In the others the least trial pressure
   !> counts as -P.)
   pure subroutine changed_trial_cells(n, trial, length, image, response, correction, residual, pressure, direction, sums)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(sp), intent(in) :: length
      real(sp), intent(in) :: image(n), response(n), correction(n)   !! change = image + length response + ...
      real(sp), intent(in) :: residual(n)
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(inout) :: direction(n)
      type(trial_sums_type), intent(inout) :: sums
      real(dp) :: alpha, lowered, total, negative, cells, lowest, kept, value
      real(sp) :: d, inside
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      total = 0.0_dp
      negative = 0.0_dp
      cells = 0.0_dp
      lowest = sums%least
      !$omp simd reduction(+:total, negative, cells) reduction(min:lowest) private(d, inside, kept, value)
      do i = 1, n
         inside = acts(residual(i))*acts(direction(i))
         d = inside*(direction(i) + (image(i) + length*response(i) + correction(i)))
         direction(i) = d
         kept = inside
         value = trial_of(alpha, lowered, pressure(i), d)
         total = total + max(value, 0.0_dp)
         negative = negative + min(value, 0.0_dp)
         cells = cells + positive(value)
         lowest = min(lowest, value - (1.0_dp - kept)*pressure(i))
      end do
      sums%above = sums%above + total
      sums%below = sums%below + negative
      sums%cells = sums%cells + cells
      sums%least = lowest
   end subroutine changed_trial_cells

   !> Compute the projected step, and its product with the residual.
   pure subroutine step_cells(n, trial, level, pressure, gap, direction, step, sums)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: level
      real(dp), intent(in) :: pressure(n), gap(n)
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: step(n)
      type(step_sums_type), intent(inout) :: sums
      real(dp) :: alpha, lowered, factor, product, s
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      factor = trial%factor
      product = 0.0_dp
      !$omp simd reduction(+:product) private(s)
      do i = 1, n
         s = factor*max(trial_of(alpha, lowered, pressure(i), direction(i)), 0.0_dp) - pressure(i)
         step(i) = s
         product = product + (level - gap(i))*s
      end do
      sums%slope = sums%slope + product
   end subroutine step_cells

   !> Add the step to the sums over the rows of a block, and its square to a sum.
   pure subroutine spread_step_cells(n, step, column, square)
      integer, intent(in) :: n
      real(dp), intent(in) :: step(n)
      real(dp), intent(inout) :: column(n)
      real(dp), intent(inout) :: square
      real(dp) :: total
      integer :: i

      total = 0.0_dp
      !$omp simd reduction(+:total)
      do i = 1, n
         column(i) = column(i) + step(i)
         total = total + step(i)**2
      end do
      square = square + total
   end subroutine spread_step_cells

   !> Compute below = direction - shift where the direction acts. It must not become 0 there.
   pure subroutine lower_cells(n, shift, direction, below)
      integer, intent(in) :: n
      real(dp), intent(in) :: shift(n)
      real(sp), intent(in) :: direction(n)
      real(sp), intent(inout) :: below(n)
      integer :: i

      !$omp simd
      do i = 1, n
         below(i) = acts(direction(i))*(direction(i) - real(shift(i), sp) + tiny(1.0_sp))
      end do
   end subroutine lower_cells

   !> Reduce `longest` to the longest multiple of the step for which no pressure becomes negative.
   pure subroutine longest_cells(n, trial, pressure, direction, longest)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: longest
      real(dp) :: alpha, lowered, factor, fastest, kept
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      factor = trial%factor
      fastest = tiny(1.0_dp)
      !$omp simd reduction(max:fastest) private(kept)
      do i = 1, n
         kept = factor*max(trial_of(alpha, lowered, pressure(i), direction(i)), 0.0_dp)
         fastest = max(fastest, (pressure(i) - kept)/max(pressure(i), tiny(1.0_dp)))
      end do
      longest = min(longest, 1.0_dp/fastest)
   end subroutine longest_cells

   !> The trial pressure of a cell above the shift; 0 if the direction does not act there.
   elemental function trial_of(alpha, lowered, pressure, direction) result(value)
      real(dp), intent(in) :: alpha, lowered
      real(dp), intent(in) :: pressure
      real(sp), intent(in) :: direction
      real(dp) :: value

      value = acts(direction)*(pressure + (alpha*direction - lowered))
   end function trial_of

   !> 1 if x > 0 and 0 otherwise, without a branch.
   elemental function positive(x)
      real(dp), intent(in) :: x
      real(dp) :: positive

      positive = 0.5_dp - sign(0.5_dp, 0.0_dp - x)
   end function positive

   !> The same in single precision.
   elemental function positive_single(x) result(positive)
      real(sp), intent(in) :: x
      real(sp) :: positive

      positive = 0.5_sp - sign(0.5_sp, 0.0_sp - x)
   end function positive_single

   !> 1 if the direction is not 0 and 0 otherwise, without a branch.
   elemental function acts(direction)
      real(sp), intent(in) :: direction
      real(sp) :: acts

      acts = 0.5_sp + sign(0.5_sp, abs(direction) - tiny(1.0_sp))
   end function acts

   !> Add a multiple of the projected step to P, and form the sums of the new state without its least gap.
   pure subroutine load_cells(n, multiple, trial, target, gap, direction, pressure, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: multiple
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: target                !! prescribed level
      real(dp), intent(in) :: gap(n)
      real(sp), intent(in) :: direction(n)
      real(dp), intent(inout) :: pressure(n)
      type(state_sums_type), intent(inout) :: sums
      real(dp) :: alpha, lowered, factor, load, work, touched, cells, distance, p, s, inside
      integer :: i

      alpha = trial%alpha
      lowered = trial%lowered()
      factor = trial%factor
      load = 0.0_dp
      work = 0.0_dp
      touched = 0.0_dp
      cells = 0.0_dp
      distance = 0.0_dp
      !$omp simd reduction(+:load, work, touched, cells, distance) private(p, s, inside)
      do i = 1, n
         ! Round-off must not make the pressure negative in a cell where the step removes all of it.
         s = factor*max(trial_of(alpha, lowered, pressure(i), direction(i)), 0.0_dp) - pressure(i)
         p = max(pressure(i) + multiple*s, 0.0_dp)
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
