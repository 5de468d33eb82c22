!> What the methods for adhesive contact share: the problem, the line searches, sums in order.
!>
!> The energy of a state with the gap g >= 0 (equations for one cell area; modulus Q, traction history
!> P_h of a viscoelastic material, mean pressure p; elastic: Q = G and P_h = 0)
!>     E(g) = Q/2 (H+g).B(H+g) - P_h.g + sum e(g) + p sum g,      B = A^-1 for G = 1
!> has the gradient G = Q B(H+g) - P_h + e'(g) + p; a solution has G = 0 where g > 0 and G >= 0 where
!> g = 0. The contact pressure, attraction included, is P = p + Q B(H+g) - P_h = G - e'(g).
!>
!> Sums are made row by row and then in the order of the rows: they do not depend on the threads.
module adhesion_state
   use adhesion_potential, only : adhesion_potential_type, adhesive_curvature, adhesive_slope, &
      adhesive_terms, potential_maugis_dugdale, potential_none
   use contact_rule, only : is_closed
   use normal_state, only : control_approach, control_pressure
   use asperity_parallel, only : global_max, global_min, global_sum
   use asperity_precision, only : dp
   implicit none
   private

   public :: adhesion_problem_type, choose_step, clipped_step, close_gaps, collect_step, &
      control_approach, control_pressure, diagonal_scaling, form_step_row, resolved_traction, row_total, &
      step_sums_type, stepped_gap, sum_shift, traction_scale

   character(*), parameter, public :: reason_converged = 'converged'
   character(*), parameter, public :: reason_detached = 'detached'
   character(*), parameter, public :: reason_limit = 'the limit of iterations was reached'
   character(*), parameter, public :: reason_stalled = 'the energy can be lowered no further'
   character(*), parameter, public :: reason_closed = &
      'full contact: the displacement leaves no gap'

   real(dp), parameter :: sharpness = 0.02_dp     !! what is left of the slope in a line search

   !> An adhesive contact problem but for its fields.
   type :: adhesion_problem_type
      type(adhesion_potential_type) :: potential
      real(dp) :: modulus = 1.0_dp          !! shear modulus of the step (Q of module zener), Pa
      integer :: control = control_pressure
      !> Mean pressure, Pa, negative when pulled (free mode: force/(lx ly)); or the level U - H where
      !> the gap is zero, m: the prescribed displacement less the highest point of H.
      real(dp) :: target = 0.0_dp
      real(dp) :: tolerance = 1e-6_dp       !! of the natural residual max|min(g/z_0, G z_0/gamma_0)|
      integer :: max_iterations = 2000
      logical :: full_contact = .false.     !! start from full contact, not from what is handed in
      !> Highest point of H, m, set by module adhesion_cg: the methods count heights and levels from it,
      !> so that a map far from zero costs no digits.
      real(dp) :: datum = 0.0_dp
   end type adhesion_problem_type

   !> What is known of E along the segment g + t s, 0 <= t.
   type :: step_sums_type
      real(dp) :: slope = 0.0_dp            !! G.s
      real(dp) :: form = 0.0_dp             !! Q s.B s
      real(dp) :: adhesive_slope = 0.0_dp   !! s.e'(g)
      real(dp) :: curvature = 0.0_dp        !! s.e''(g) s
      real(dp) :: energy = 0.0_dp           !! sum e(g)
      real(dp) :: longest = huge(1.0_dp)    !! t at which the first gap closes
      logical :: clipped = .false.          !! gaps were closed to make s: t <= 1
   end type step_sums_type

contains

   !> Sum of the k-th row sums, in order.
   function row_total(rows, k) result(total)
      real(dp), intent(in) :: rows(:, :)    !! [sums, rows]
      integer, intent(in) :: k
      real(dp) :: total
      integer :: j

      total = 0.0_dp
      do j = 1, size(rows, 2)
         total = total + rows(k, j)
      end do
      total = global_sum(total)
   end function row_total

   !> Scaling of the preconditioner at a cell, from both sides: (1 + max(e'', 0)/k)^(-1/2).
   pure function diagonal_scaling(problem, gap, stiffness) result(scaling)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap                  !! m
      real(dp), intent(in) :: stiffness            !! k, Pa/m
      real(dp) :: scaling

      scaling = 1.0_dp/sqrt(1.0_dp &
         + max(adhesive_curvature(problem%potential, gap), 0.0_dp)/stiffness)
   end function diagonal_scaling

   !> Set to exactly 0 the gaps of a solution in the cells that the wall carries.
   subroutine close_gaps(problem, length, scale, threads, gap, pressure)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: length, scale        !! units of the natural residual, m and Pa
      integer, intent(in) :: threads
      real(dp), intent(inout) :: gap(:, :)         !! g, m
      real(dp), intent(in) :: pressure(:, :)       !! P, attraction included, Pa
      integer :: j

      !$omp parallel do default(none) shared(problem, length, scale, gap, pressure) private(j) &
      !$omp num_threads(threads)
      do j = 1, size(gap, 2)
         where (is_closed(gap(:, j)/length, (pressure(:, j) &
            + adhesive_slope(problem%potential, gap(:, j)))/scale, problem%tolerance)) gap(:, j) = 0.0_dp
      end do
   end subroutine close_gaps

   !> The least unit of traction whose product with the tolerance is still above round-off, Pa: that of
   !> the largest traction, and that of the heights times the stiffness.
   pure function resolved_traction(problem, largest, stiffness, spread) result(scale)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: largest              !! traction, Pa
      real(dp), intent(in) :: stiffness            !! B at the Nyquist wave number, for G = 1
      real(dp), intent(in) :: spread               !! of the heights, m
      real(dp) :: scale

      scale = epsilon(1.0_dp)*(20.0_dp*largest + 4.0_dp*problem%modulus*stiffness*spread) &
         /problem%tolerance
   end function resolved_traction

   !> Is e' continuous?
   pure function has_smooth_potential(potential) result(smooth)
      type(adhesion_potential_type), intent(in) :: potential
      logical :: smooth

      smooth = potential%kind /= potential_maugis_dugdale .or. potential%edge > 0.0_dp
   end function has_smooth_potential

   !> The traction in which the residual is measured: gamma_0/z_0, or `other` without adhesion.
   pure function traction_scale(potential, other) result(scale)
      type(adhesion_potential_type), intent(in) :: potential
      real(dp), intent(in) :: other         !! Pa
      real(dp) :: scale

      scale = other
      if (potential%kind == potential_none) return
      if (potential%energy > 0.0_dp) scale = potential%energy/potential%range
   end function traction_scale

   !> Length of the step along d, gaps closed on the way: the first root of
   !>     -r.d + a form + sum d (e'(max(g + a d, 0)) - e'(g)).
   !> It need not be sharp: `choose_step` follows.
   function clipped_step(problem, gap, direction, slope, form, rows, threads) result(alpha)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: direction(:, :)
      real(dp), intent(in) :: slope                !! -r.d, < 0
      real(dp), intent(in) :: form                 !! estimate of Q d.B d, > 0
      real(dp), intent(inout) :: rows(:, :)        !! work, at least [2, rows]
      integer, intent(in) :: threads
      real(dp) :: alpha
      real(dp) :: base, value, lower, upper, stiffness, low_value, high_value
      integer :: pass

      alpha = -slope/form
      if (.not. has_smooth_potential(problem%potential)) return
      call sums(0.0_dp, base, stiffness)
      if (form + stiffness > 0.1_dp*form) alpha = -slope/(form + stiffness)
      lower = 0.0_dp
      low_value = slope
      upper = huge(1.0_dp)
      high_value = huge(1.0_dp)
      do pass = 1, 6
         call sums(alpha, value, stiffness)
         value = slope + alpha*form + value - base
         if (abs(value) <= 0.1_dp*abs(slope)) return
         if (value < 0.0_dp) then
            lower = alpha
            low_value = value
         else
            upper = alpha
            high_value = value
         end if
         if (upper < huge(1.0_dp)) then
            alpha = chord_root(lower, low_value, upper, high_value, 0.1_dp)
         else if (form + stiffness > 0.25_dp*form) then
            alpha = alpha - value/(form + stiffness)
         else
            alpha = 2.0_dp*alpha
         end if
      end do

   contains

      !> Sum of d e' and of d e'' d at g + a d.
      subroutine sums(a, first, second)
         real(dp), intent(in) :: a
         real(dp), intent(out) :: first, second
         real(dp) :: x, e, e1, e2, s1, s2
         integer :: i, j

         !$omp parallel do default(none) shared(problem, gap, direction, rows, a) &
         !$omp private(i, j, x, e, e1, e2, s1, s2) num_threads(threads)
         do j = 1, size(gap, 2)
            s1 = 0.0_dp
            s2 = 0.0_dp
            do i = 1, size(gap, 1)
               if (direction(i, j) == 0.0_dp) cycle
               x = gap(i, j) + a*direction(i, j)
               call adhesive_terms(problem%potential, max(x, 0.0_dp), e, e1, e2)
               s1 = s1 + direction(i, j)*e1
               if (x > 0.0_dp) s2 = s2 + direction(i, j)**2*e2
            end do
            rows(1, j) = s1
            rows(2, j) = s2
         end do
         first = row_total(rows(:, 1:size(gap, 2)), 1)
         second = row_total(rows(:, 1:size(gap, 2)), 2)
      end subroutine sums

   end function clipped_step

   !> How far to go along the segment s: t near the first minimum of the energy, never where the
   !> energy is higher than at t = 0; 0 if there is no such t. With a clipped s, t = 1 closes gaps for
   !> good, and is taken where the minimum is not much nearer.
   function choose_step(known, problem, gap, direction, alpha, shift, rows, threads) result(t)
      type(step_sums_type), intent(in) :: known
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)            !! g, m
      real(dp), intent(in) :: direction(:, :)      !! d; s = stepped_gap(g, d, alpha, shift) - g
      real(dp), intent(in) :: alpha, shift
      real(dp), intent(inout) :: rows(:, :)        !! work, at least [2, rows]
      integer, intent(in) :: threads
      real(dp) :: t
      real(dp) :: longest, value, rise, lower, upper, low_value, high_value, noise, stiffness
      integer :: pass
      logical :: smooth

      t = 0.0_dp
      smooth = has_smooth_potential(problem%potential)
      if (.not. known%slope < 0.0_dp) return
      noise = 4.0_dp*epsilon(1.0_dp)*abs(known%energy)
      longest = merge(1.0_dp, known%longest, known%clipped)
      lower = 0.0_dp
      low_value = known%slope
      upper = huge(1.0_dp)
      high_value = huge(1.0_dp)
      stiffness = known%form
      if (known%form + known%curvature > 0.1_dp*known%form) &
         stiffness = known%form + known%curvature
      t = min(-known%slope/stiffness, longest)
      if (known%clipped .and. t > 0.55_dp) t = 1.0_dp
      do pass = 1, merge(8, 1, smooth)
         call try(t, value, rise)
         if (rise <= noise) then
            if (abs(value) <= sharpness*abs(known%slope)) return
            if (known%clipped .and. t >= 1.0_dp .and. value <= 0.8_dp*abs(known%slope)) return
            if (value < 0.0_dp .and. t >= longest) return
            if (.not. smooth) return
         end if
         if (value > 0.0_dp .or. rise > noise) then
            upper = t
            high_value = max(value, 0.5_dp*abs(known%slope))
         else
            lower = t
            low_value = value
         end if
         if (upper < huge(1.0_dp)) then
            t = chord_root(lower, low_value, upper, high_value, 0.05_dp)
         else
            t = min(longest, 4.0_dp*t, merge(t*known%slope/(known%slope - value), 4.0_dp*t, &
               value > 0.9_dp*known%slope))
         end if
      end do
      do pass = 1, 20
         call try(t, value, rise)
         if (rise <= noise) return
         t = 0.25_dp*t
      end do
      t = 0.0_dp

   contains

      !> Slope of the energy at t, and its rise from t = 0.
      subroutine try(at, gradient, change)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: gradient, change
         real(dp) :: adhesive, energy

         call segment(at, adhesive, energy)
         gradient = known%slope + at*known%form + adhesive - known%adhesive_slope
         change = at*(known%slope - known%adhesive_slope) + 0.5_dp*at**2*known%form &
            + energy - known%energy
      end subroutine try

      !> Sum of s e'(g + t s) and of e(g + t s).
      subroutine segment(at, slopes, energies)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: slopes, energies
         real(dp) :: s, e, e1, e2, s1, s2
         integer :: i, j

         !$omp parallel do default(none) shared(problem, gap, direction, alpha, shift, rows, at) &
         !$omp private(i, j, s, e, e1, e2, s1, s2) num_threads(threads)
         do j = 1, size(gap, 2)
            s1 = 0.0_dp
            s2 = 0.0_dp
            do i = 1, size(gap, 1)
               s = stepped_gap(gap(i, j), direction(i, j), alpha, shift) - gap(i, j)
               call adhesive_terms(problem%potential, max(gap(i, j) + at*s, 0.0_dp), e, e1, e2)
               s1 = s1 + s*e1
               s2 = s2 + e
            end do
            rows(1, j) = s1
            rows(2, j) = s2
         end do
         slopes = row_total(rows(:, 1:size(gap, 2)), 1)
         energies = row_total(rows(:, 1:size(gap, 2)), 2)
      end subroutine segment

   end function choose_step

   !> Where the chord between two ends of different sign is zero, kept off both ends.
   pure function chord_root(lower, low_value, upper, high_value, margin) result(root)
      real(dp), intent(in) :: lower, low_value     !! one end and the value there
      real(dp), intent(in) :: upper, high_value    !! the other
      real(dp), intent(in) :: margin               !! least distance from an end, over their distance
      real(dp) :: root

      root = lower - low_value*(upper - lower)/(high_value - low_value)
      root = min(max(root, lower + margin*(upper - lower)), upper - margin*(upper - lower))
   end function chord_root

   !> The clipped step s of a row of cells, and its part of what is known without B s.
   subroutine form_step_row(problem, gap, direction, residual, alpha, shift, s, sums)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous :: gap(:)       !! g, m
      real(dp), intent(in), contiguous :: direction(:) !! d
      real(dp), intent(in), contiguous :: residual(:)  !! r, Pa
      real(dp), intent(in) :: alpha, shift
      real(dp), intent(out) :: s(:)                    !! m
      real(dp), intent(out) :: sums(6)                 !! for `collect_step`
      real(dp) :: slope, adhesive, curvature, energy, longest, e, e1, e2
      integer :: i, clipped

      slope = 0.0_dp
      adhesive = 0.0_dp
      curvature = 0.0_dp
      energy = 0.0_dp
      longest = huge(1.0_dp)
      clipped = 0
      do i = 1, size(gap)
         s(i) = stepped_gap(gap(i), direction(i), alpha, shift) - gap(i)
         call adhesive_terms(problem%potential, gap(i), e, e1, e2)
         slope = slope - residual(i)*s(i)
         adhesive = adhesive + s(i)*e1
         curvature = curvature + s(i)**2*e2
         energy = energy + e
         if (s(i) < 0.0_dp) then
            longest = min(longest, gap(i)/(-s(i)))
            if (s(i) == -gap(i)) clipped = 1
         end if
      end do
      sums = [slope, adhesive, curvature, energy, longest, real(clipped, dp)]
   end subroutine form_step_row

   !> What is known of a step, from the sums of its rows.
   subroutine collect_step(rows, known)
      real(dp), intent(in) :: rows(:, :)               !! (1:6, j): the sums of row j
      type(step_sums_type), intent(out) :: known

      known%slope = row_total(rows, 1)
      known%adhesive_slope = row_total(rows, 2)
      known%curvature = row_total(rows, 3)
      known%energy = row_total(rows, 4)
      known%longest = global_min(minval(rows(5, :)))
      known%clipped = global_max(maxval(rows(6, :))) > 0.0_dp
   end subroutine collect_step

   !> The gap after a step along d, closed where it would be negative, less a shift that keeps its sum.
   elemental function stepped_gap(gap, direction, alpha, shift) result(value)
      real(dp), intent(in) :: gap, direction, alpha, shift
      real(dp) :: value

      value = gap + alpha*direction
      if (value > 0.0_dp) then
         value = max(value - shift, 0.0_dp)
      else
         value = 0.0_dp
      end if
   end function stepped_gap

   !> The shift with which the stepped gaps have the sum `total`: Newton's steps rise to it.
   function sum_shift(gap, direction, alpha, total, rows, threads) result(shift)
      real(dp), intent(in) :: gap(:, :), direction(:, :)
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: total                !! m, > 0
      real(dp), intent(inout) :: rows(:, :)        !! work, at least [2, rows]
      integer, intent(in) :: threads
      real(dp) :: shift
      real(dp) :: above, next, x, s1
      integer :: i, j, count, n

      shift = 0.0_dp
      do
         !$omp parallel do default(none) shared(gap, direction, alpha, shift, rows) &
         !$omp private(i, j, x, s1, n) num_threads(threads)
         do j = 1, size(gap, 2)
            s1 = 0.0_dp
            n = 0
            do i = 1, size(gap, 1)
               x = gap(i, j) + alpha*direction(i, j)
               if (x > max(shift, 0.0_dp)) then
                  s1 = s1 + x
                  n = n + 1
               end if
            end do
            rows(1, j) = s1
            rows(2, j) = real(n, dp)
         end do
         above = row_total(rows(:, 1:size(gap, 2)), 1)
         count = nint(row_total(rows(:, 1:size(gap, 2)), 2))
         if (count == 0) exit
         next = (above - total)/count
         if (next <= shift) then
            ! Too small a sum: all that is open is lifted.
            if (shift == 0.0_dp) shift = next
            exit
         end if
         shift = next
      end do
   end function sum_shift

end module adhesion_state
