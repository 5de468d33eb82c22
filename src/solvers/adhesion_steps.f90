!> How far an iteration for adhesive contact goes along its direction d.
!>
!> A step closes gaps on its way: s = stepped_gap(g, d, alpha, shift) - g. First `clipped_step` predicts
!> alpha from an estimate of d.B d. Then s is formed and multiplied by B, which makes the energy along
!> g + t s exact, and `choose_step` finds the part t that is taken.
!>
!> Sums are made row by row and then in the order of the rows: they do not depend on the threads.
module adhesion_steps
   use adhesion_potential, only : adhesive_terms, has_smooth_potential
   use adhesion_state, only : adhesion_problem_type
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : least_of_rows, row_totals
   use row_sharing, only : row_sharing_type
   implicit none
   private

   public :: choose_step, clipped_step, form_step_row, known_of_step, step_sums_type, stepped_gap, &
      sum_shift

   real(dp), parameter :: sharpness = 0.02_dp     !! what is left of the slope in a line search

   !> What is known of E along the segment g + t s, 0 <= t; or the part of a row of it.
   type :: step_sums_type
      real(dp) :: slope = 0.0_dp            !! G.s
      real(dp) :: form = 0.0_dp             !! Q s.B s, known for all rows only
      real(dp) :: adhesive_slope = 0.0_dp   !! s.e'(g)
      real(dp) :: curvature = 0.0_dp        !! s.e''(g) s
      real(dp) :: energy = 0.0_dp           !! sum e(g)
      real(dp) :: squares = 0.0_dp          !! of the change of the displacement
      real(dp) :: longest = huge(1.0_dp)    !! t at which the first gap closes
      logical :: clipped = .false.          !! gaps were closed to make s: t <= 1
   end type step_sums_type

   !> Two ends between which a function that rises has its root.
   type :: bracket_type
      real(dp) :: lower = 0.0_dp, low_value = 0.0_dp                   !! value < 0
      real(dp) :: upper = huge(1.0_dp), high_value = huge(1.0_dp)      !! value >= 0; huge: not known yet
   contains
      procedure :: narrow
      procedure :: is_open
      procedure :: chord_root
   end type bracket_type

contains

   !> Take in the value at a place between the ends.
   pure subroutine narrow(self, place, value)
      class(bracket_type), intent(inout) :: self
      real(dp), intent(in) :: place, value

      if (value < 0.0_dp) then
         self%lower = place
         self%low_value = value
      else
         self%upper = place
         self%high_value = value
      end if
   end subroutine narrow

   !> Is there no upper end yet?
   pure function is_open(self) result(open)
      class(bracket_type), intent(in) :: self
      logical :: open

      open = .not. self%upper < huge(1.0_dp)
   end function is_open

   !> Where the chord between the ends is zero, kept off both ends.
   pure function chord_root(self, margin) result(root)
      class(bracket_type), intent(in) :: self
      real(dp), intent(in) :: margin               !! least distance from an end, over their distance
      real(dp) :: root
      real(dp) :: width

      width = self%upper - self%lower
      root = self%lower - self%low_value*width/(self%high_value - self%low_value)
      root = min(max(root, self%lower + margin*width), self%upper - margin*width)
   end function chord_root

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
   function sum_shift(gap, direction, alpha, total, threads) result(shift)
      real(dp), intent(in) :: gap(:, :), direction(:, :)
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: total                !! m, > 0
      integer, intent(in) :: threads
      real(dp) :: shift
      real(dp), allocatable :: rows(:, :)
      real(dp) :: next, open, height, sums(2), x
      integer :: i, j

      allocate (rows(2, size(gap, 2)))
      shift = 0.0_dp
      do
         !$omp parallel do default(none) shared(gap, direction, alpha, shift, rows) &
         !$omp private(i, j, open, height, x) num_threads(threads)
         do j = 1, size(gap, 2)
            height = 0.0_dp
            open = 0.0_dp
            do i = 1, size(gap, 1)
               x = gap(i, j) + alpha*direction(i, j)
               if (x > max(shift, 0.0_dp)) then
                  height = height + x
                  open = open + 1.0_dp
               end if
            end do
            rows(:, j) = [height, open]
         end do
         sums = row_totals(rows)
         if (.not. sums(2) > 0.0_dp) exit
         next = (sums(1) - total)/sums(2)
         if (next <= shift) then
            ! The sum is too small: all that is open is lifted.
            if (shift == 0.0_dp) shift = next
            exit
         end if
         shift = next
      end do
   end function sum_shift

   !> Length of the step along d, gaps closed on the way: the first root of
   !>     -r.d + a form + sum d (e'(max(g + a d, 0)) - e'(g)).
   !> It need not be sharp: `choose_step` follows.
   function clipped_step(problem, gap, direction, slope, form, threads) result(alpha)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: direction(:, :)
      real(dp), intent(in) :: slope                !! -r.d, < 0
      real(dp), intent(in) :: form                 !! estimate of Q d.B d, > 0
      integer, intent(in) :: threads
      real(dp) :: alpha
      type(bracket_type) :: bracket
      real(dp) :: base, value, stiffness
      integer :: pass

      alpha = -slope/form
      if (.not. has_smooth_potential(problem%potential)) return
      call adhesive_part(0.0_dp, base, stiffness)
      if (form + stiffness > 0.1_dp*form) alpha = -slope/(form + stiffness)
      bracket%low_value = slope
      do pass = 1, 6
         call adhesive_part(alpha, value, stiffness)
         value = slope + alpha*form + value - base
         if (abs(value) <= 0.1_dp*abs(slope)) return
         call bracket%narrow(alpha, value)
         if (.not. bracket%is_open()) then
            alpha = bracket%chord_root(0.1_dp)
         else if (form + stiffness > 0.25_dp*form) then
            alpha = alpha - value/(form + stiffness)
         else
            alpha = 2.0_dp*alpha
         end if
      end do

   contains

      !> Sum of d e' and of d e'' d at g + a d.
      subroutine adhesive_part(a, first, second)
         real(dp), intent(in) :: a
         real(dp), intent(out) :: first, second
         real(dp), allocatable :: rows(:, :)
         real(dp) :: sums(2), x, e, e1, e2, s1, s2
         integer :: i, j

         allocate (rows(2, size(gap, 2)))
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
            rows(:, j) = [s1, s2]
         end do
         sums = row_totals(rows)
         first = sums(1)
         second = sums(2)
      end subroutine adhesive_part

   end function clipped_step

   !> The clipped step s of a row of cells, and its part of what is known without B s.
   subroutine form_step_row(problem, gap, direction, residual, alpha, shift, s, sums)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous :: gap(:)       !! g, m
      real(dp), intent(in), contiguous :: direction(:) !! d
      real(dp), intent(in), contiguous :: residual(:)  !! r, Pa
      real(dp), intent(in) :: alpha, shift
      real(dp), intent(out) :: s(:)                    !! m
      type(step_sums_type), intent(out) :: sums
      real(dp) :: slope, adhesive, curvature, energy, longest, e, e1, e2
      integer :: i

      slope = 0.0_dp
      adhesive = 0.0_dp
      curvature = 0.0_dp
      energy = 0.0_dp
      longest = huge(1.0_dp)
      do i = 1, size(gap)
         s(i) = stepped_gap(gap(i), direction(i), alpha, shift) - gap(i)
         call adhesive_terms(problem%potential, gap(i), e, e1, e2)
         slope = slope - residual(i)*s(i)
         adhesive = adhesive + s(i)*e1
         curvature = curvature + s(i)**2*e2
         energy = energy + e
         if (s(i) < 0.0_dp) then
            longest = min(longest, gap(i)/(-s(i)))
            if (s(i) == -gap(i)) sums%clipped = .true.
         end if
      end do
      sums%slope = slope
      sums%adhesive_slope = adhesive
      sums%curvature = curvature
      sums%energy = energy
      sums%longest = longest
   end subroutine form_step_row

   !> What is known of a step from its rows.
   function known_of_step(rows, sharing) result(known)
      type(step_sums_type), intent(in) :: rows(:)
      type(row_sharing_type), intent(in) :: sharing    !! of the rows
      type(step_sums_type) :: known
      real(dp), allocatable :: parts(:, :)
      real(dp) :: sums(5)
      integer :: j

      allocate (parts(5, size(rows)))
      do j = 1, size(rows)
         parts(:, j) = [rows(j)%slope, rows(j)%adhesive_slope, rows(j)%curvature, rows(j)%energy, &
            rows(j)%squares]
      end do
      sums = sharing%totals(parts)
      known%slope = sums(1)
      known%adhesive_slope = sums(2)
      known%curvature = sums(3)
      known%energy = sums(4)
      known%squares = sums(5)
      known%longest = least_of_rows(rows%longest)
      known%clipped = any_process(any(rows%clipped))
   end function known_of_step

   !> How far to go along the segment s: t near the first minimum of the energy, never where the
   !> energy is higher than at t = 0; 0 if there is no such t. With a clipped s, t = 1 closes gaps for
   !> good, and is taken where the minimum is not much nearer.
   function choose_step(known, problem, gap, direction, alpha, shift, threads) result(t)
      type(step_sums_type), intent(in) :: known
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)            !! g, m
      real(dp), intent(in) :: direction(:, :)      !! d; s = stepped_gap(g, d, alpha, shift) - g
      real(dp), intent(in) :: alpha, shift
      integer, intent(in) :: threads
      real(dp) :: t
      type(bracket_type) :: bracket
      real(dp) :: farthest, slope, rise, noise
      integer :: pass
      logical :: smooth, risen

      t = 0.0_dp
      if (.not. known%slope < 0.0_dp) return
      smooth = has_smooth_potential(problem%potential)
      noise = 4.0_dp*epsilon(1.0_dp)*abs(known%energy)
      farthest = merge(1.0_dp, known%longest, known%clipped)
      bracket%low_value = known%slope
      t = first_trial(known, farthest)
      do pass = 1, merge(8, 1, smooth)
         call look(t, slope, rise)
         risen = rise > noise
         if (.not. risen .and. (is_near_minimum(known, t, slope, farthest) .or. .not. smooth)) return
         ! Where the energy has risen the first minimum lies before t, whatever the slope is there.
         if (slope > 0.0_dp .or. risen) slope = max(slope, 0.5_dp*abs(known%slope))
         call bracket%narrow(t, slope)
         if (bracket%is_open()) then
            t = min(farthest, 4.0_dp*t, merge(t*known%slope/(known%slope - slope), 4.0_dp*t, &
               slope > 0.9_dp*known%slope))
         else
            t = bracket%chord_root(0.05_dp)
         end if
      end do
      do pass = 1, 20
         call look(t, slope, rise)
         if (rise <= noise) return
         t = 0.25_dp*t
      end do
      t = 0.0_dp

   contains

      !> Slope of the energy at t, and its rise from t = 0.
      subroutine look(at, gradient, change)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: gradient, change
         real(dp) :: adhesive, energy

         call adhesive_part(at, adhesive, energy)
         gradient = known%slope + at*known%form + adhesive - known%adhesive_slope
         change = at*(known%slope - known%adhesive_slope) + 0.5_dp*at**2*known%form &
            + energy - known%energy
      end subroutine look

      !> Sum of s e'(g + t s) and of e(g + t s).
      subroutine adhesive_part(at, slope_sum, energy_sum)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: slope_sum, energy_sum
         real(dp), allocatable :: rows(:, :)
         real(dp) :: sums(2), s, e, e1, e2, s1, s2
         integer :: i, j

         allocate (rows(2, size(gap, 2)))
         !$omp parallel do default(none) &
         !$omp shared(problem, gap, direction, alpha, shift, rows, at) &
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
            rows(:, j) = [s1, s2]
         end do
         sums = row_totals(rows)
         slope_sum = sums(1)
         energy_sum = sums(2)
      end subroutine adhesive_part

   end function choose_step

   !> The minimum that the curvature at t = 0 predicts; the whole of a clipped step if that is not far.
   pure function first_trial(known, farthest) result(t)
      type(step_sums_type), intent(in) :: known
      real(dp), intent(in) :: farthest
      real(dp) :: t
      real(dp) :: stiffness

      stiffness = known%form + known%curvature
      if (.not. stiffness > 0.1_dp*known%form) stiffness = known%form
      t = min(-known%slope/stiffness, farthest)
      if (known%clipped .and. t > 0.55_dp) t = 1.0_dp
   end function first_trial

   !> Is a place where the energy has not risen near enough to the minimum?
   pure function is_near_minimum(known, t, slope, farthest) result(near)
      type(step_sums_type), intent(in) :: known
      real(dp), intent(in) :: t
      real(dp), intent(in) :: slope                !! of the energy at t
      real(dp), intent(in) :: farthest             !! t up to which gaps stay open
      logical :: near

      near = abs(slope) <= sharpness*abs(known%slope) .or. (slope < 0.0_dp .and. t >= farthest)
      if (known%clipped .and. t >= 1.0_dp) near = near .or. slope <= 0.8_dp*abs(known%slope)
   end function is_near_minimum

end module adhesion_steps
