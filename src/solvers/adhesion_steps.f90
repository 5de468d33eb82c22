!> Chooses the length of a step s for adhesive contact.
!>
!> A step may close gaps, so that g + s >= 0. Once its product with B is known, the energy along g + t s is known
!> exactly, and `choose_step` finds the part t of the step that is taken.
!>
!> Sums are formed row by row and added in the order of the rows, so that they do not depend on the number of
!> threads.
module adhesion_steps
   use adhesion_potential, only : adhesive_slopes, has_smooth_potential
   use adhesion_state, only : adhesion_problem_type
   use asperity_precision, only : dp
   use field_sums, only : cell_count, row_totals
   use row_sharing, only : row_sharing_type
   implicit none
   private

   public :: choose_step, form_step_row, known_of_step, step_sums_type, stepped_gap, sum_shift

   real(dp), parameter :: sharpness = 0.2_dp      !! part of the slope that a line search may leave

   !> Sums for the energy E along the segment g + t s, 0 <= t <= 1, of all rows or of one row.
   type :: step_sums_type
      real(dp) :: slope = 0.0_dp            !! G.s
      real(dp) :: form = 0.0_dp             !! Q s.B s, known for all rows only
      real(dp) :: adhesive_slope = 0.0_dp   !! s.e'(g)
      real(dp) :: energy = 0.0_dp           !! sum e(g)
      real(dp) :: curvature = 0.0_dp        !! s.e''(g) s
   end type step_sums_type

   !> The ends of an interval in which an increasing function has its root, and the values there.
   type :: bracket_type
      real(dp) :: lower = 0.0_dp, low_value = 0.0_dp                   !! value < 0
      real(dp) :: upper = 1.0_dp, high_value = 0.0_dp                  !! value >= 0
   contains
      procedure :: narrow
      procedure :: chord_root
   end type bracket_type

contains

   !> Narrow the bracket with the value at a place between its ends.
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

   !> The zero of the chord between the ends, with a minimum distance from both ends.
   pure function chord_root(self, margin) result(root)
      class(bracket_type), intent(in) :: self
      real(dp), intent(in) :: margin               !! least distance from an end, over their distance
      real(dp) :: root
      real(dp) :: width

      width = self%upper - self%lower
      root = self%lower - self%low_value*width/(self%high_value - self%low_value)
      root = min(max(root, self%lower + margin*width), self%upper - margin*width)
   end function chord_root

   !> The gap after a step along d, minus a shift that keeps the sum of the gaps. It is 0 where it would be negative.
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

   !> The shift with which the gaps after a step have the sum `total`. The sum is a convex function of the shift that
   !> decreases, so that Newton's iteration approaches the solution from below.
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
            ! The sum is too small: lift all open cells.
            if (shift == 0.0_dp) shift = next
            exit
         end if
         shift = next
      end do
   end function sum_shift

   !> Form the sums for a row of the step s that do not need B s.
   subroutine form_step_row(problem, gap, pressure, s, sums)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous :: gap(:)       !! g, m
      real(dp), intent(in), contiguous :: pressure(:)  !! P = G - e', Pa
      real(dp), intent(in), contiguous :: s(:)         !! m
      type(step_sums_type), intent(out) :: sums
      real(dp) :: slope, adhesive, curvature, energy
      real(dp), dimension(size(gap)) :: e, e1, e2
      integer :: i

      slope = 0.0_dp
      adhesive = 0.0_dp
      curvature = 0.0_dp
      energy = 0.0_dp
      call adhesive_slopes(problem%potential, gap, e1, e2, e)
      do i = 1, size(gap)
         slope = slope + (pressure(i) + e1(i))*s(i)
         adhesive = adhesive + s(i)*e1(i)
         curvature = curvature + s(i)**2*e2(i)
         energy = energy + e(i)
      end do
      sums%slope = slope
      sums%adhesive_slope = adhesive
      sums%curvature = curvature
      sums%energy = energy
   end subroutine form_step_row

   !> Add up the sums of all rows of a step.
   function known_of_step(rows, sharing) result(known)
      type(step_sums_type), intent(in) :: rows(:)
      type(row_sharing_type), intent(in) :: sharing    !! of the rows
      type(step_sums_type) :: known
      real(dp), allocatable :: parts(:, :)
      real(dp) :: sums(4)
      integer :: j

      allocate (parts(4, size(rows)))
      do j = 1, size(rows)
         parts(:, j) = [rows(j)%slope, rows(j)%adhesive_slope, rows(j)%energy, rows(j)%curvature]
      end do
      sums = sharing%totals(parts)
      known%slope = sums(1)
      known%adhesive_slope = sums(2)
      known%energy = sums(3)
      known%curvature = sums(4)
   end function known_of_step

   !> Choose the part t of the step s: all of it, or a t near a minimum of the energy along s. The energy is never
   !> higher than at t = 0; t is 0 if there is no such point.
   function choose_step(known, problem, gap, step, threads) result(t)
      type(step_sums_type), intent(in) :: known
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)            !! g, m
      real(dp), intent(in) :: step(:, :)           !! s, m
      integer, intent(in) :: threads
      real(dp) :: t
      type(bracket_type) :: bracket
      real(dp) :: slope, rise, noise
      integer :: pass
      logical :: smooth, risen

      t = 0.0_dp
      if (.not. known%slope < 0.0_dp) return
      smooth = has_smooth_potential(problem%potential)
      ! Round-off of the difference of two sums over all cells. Changes below it are judged by the slope alone, which is
      ! accurate to the end.
      noise = 4.0_dp*epsilon(1.0_dp)*sqrt(cell_count(gap))*abs(known%energy)
      bracket%low_value = known%slope
      t = 1.0_dp
      do pass = 1, merge(8, 1, smooth)
         call evaluate(t, slope, rise)
         risen = rise > noise
         ! The whole step is taken even if the energy has another minimum along the straight line, because the
         ! model from which the step comes has followed the energy to this point.
         if (.not. risen .and. (abs(slope) <= sharpness*abs(known%slope) .or. .not. smooth &
            .or. (slope < 0.0_dp .and. t >= 1.0_dp))) return
         ! If the energy has risen, the first minimum lies before t, even if the slope at t is negative.
         if (slope > 0.0_dp .or. risen) slope = max(slope, 0.5_dp*abs(known%slope))
         call bracket%narrow(t, slope)
         t = bracket%chord_root(0.05_dp)
      end do
      do pass = 1, 20
         call evaluate(t, slope, rise)
         if (rise <= noise) return
         t = 0.25_dp*t
      end do
      t = 0.0_dp

   contains

      !> Compute the slope of the energy at t, and its rise from t = 0.
      subroutine evaluate(at, gradient, change)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: gradient, change
         real(dp) :: adhesive, energy

         call adhesive_part(at, adhesive, energy)
         gradient = known%slope + at*known%form + adhesive - known%adhesive_slope
         change = at*(known%slope - known%adhesive_slope) + 0.5_dp*at**2*known%form &
            + energy - known%energy
      end subroutine evaluate

      !> Compute the sums of s e'(g + t s) and of e(g + t s).
      subroutine adhesive_part(at, slope_sum, energy_sum)
         real(dp), intent(in) :: at
         real(dp), intent(out) :: slope_sum, energy_sum
         real(dp), allocatable :: rows(:, :)
         real(dp), dimension(size(gap, 1)) :: moved, e, e1, e2
         real(dp) :: sums(2), s1, s2
         integer :: i, j

         allocate (rows(2, size(gap, 2)))
         !$omp parallel do default(none) &
         !$omp shared(problem, gap, step, rows, at) &
         !$omp private(i, j, moved, e, e1, e2, s1, s2) num_threads(threads)
         do j = 1, size(gap, 2)
            s1 = 0.0_dp
            s2 = 0.0_dp
            moved(:) = max(gap(:, j) + at*step(:, j), 0.0_dp)
            call adhesive_slopes(problem%potential, moved, e1, e2, e)
            do i = 1, size(gap, 1)
               s1 = s1 + step(i, j)*e1(i)
               s2 = s2 + e(i)
            end do
            rows(:, j) = [s1, s2]
         end do
         sums = row_totals(rows)
         slope_sum = sums(1)
         energy_sum = sums(2)
      end subroutine adhesive_part

   end function choose_step

end module adhesion_steps
