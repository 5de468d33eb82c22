!> Projection of a field onto the fields that are nowhere negative and have a given sum.
module projection
   use asperity_parallel, only : rows_before
   use asperity_precision, only : dp
   use field_sums, only : cell_count, row_total, row_totals, threads_for
   implicit none
   private

   public :: project_simplex

   integer, parameter :: sample = 16        !! the first level is computed from one row in 16

contains

   !> The nearest field to x that is nowhere negative and has the sum `total`: max(x - t, 0).
   !> A field that already satisfies both conditions is not changed in any bit. If the total is so small that
   !> it is nearly lost in the round-off of x, the values that remain are scaled to meet it. Collective.
   subroutine project_simplex(x, total)
      real(dp), intent(inout) :: x(:, :)       !! [nx, rows of this process]
      real(dp), intent(in) :: total            !! if it is 0 or less, x becomes 0
      real(dp), allocatable :: rows(:, :)
      real(dp) :: cells, all_rows, level, next, above, negative, kept
      integer :: count, next_count, threads, first, stride

      cells = cell_count(x)
      threads = threads_for(x)
      allocate (rows(3, size(x, 2)))
      first = 1
      stride = 1
      if (total <= 0.0_dp) then
         call fill(0.0_dp)
         return
      end if
      call sum_above(0.0_dp, above, count, negative)
      if (abs(above - total) <= 1e-15_dp*count*total .and. abs(negative) <= 0.0_dp) return
      ! The level t is found by Newton's method. This first level is below the solution, and the steps rise
      ! to it. The first step from any other level leads below the solution, too, so a level that is already
      ! close, computed from a few rows, saves steps.
      level = (above + negative - total)/cells
      all_rows = cell_count(x(:1, :))
      if (all_rows >= 4.0_dp*sample) call guess()
      call sum_above(level, above, count, negative)
      if (count == 0) then
         ! All cells are equal.
         call fill(total/cells)
         return
      end if
      do
         next = (above - total)/count
         if (next <= level) exit
         call sum_above(next, above, next_count, negative)
         if (next_count == 0) exit
         level = next
         count = next_count
      end do
      call clip(level, kept)
      if (abs(kept - total) > 1e-14_dp*total) call scale(total/kept)

   contains

      !> Raise the level by Newton's method on a sample of the rows, followed by one step on all rows.
      subroutine guess()
         real(dp) :: trial, raised, part
         integer :: cells

         stride = sample
         first = 1 + modulo(-rows_before(size(x, 2)), sample)
         part = total*cell_count(x(:1, first::stride))/all_rows
         trial = level
         do
            call sum_above(trial, above, cells, negative)
            if (cells == 0) exit
            raised = (above - part)/cells
            if (raised <= trial) exit
            trial = raised
         end do
         first = 1
         stride = 1
         call sum_above(trial, above, cells, negative)
         if (cells > 0) level = max(level, (above - total)/cells)
      end subroutine guess

      !> Sum and number of the cells above a level, and the sum of the others.
      subroutine sum_above(limit, sum, number, others)
         real(dp), intent(in) :: limit
         real(dp), intent(out) :: sum
         integer, intent(out) :: number
         real(dp), intent(out) :: others
         real(dp) :: sums(3), a, b, n
         integer :: i, j

         !$omp parallel do default(none) shared(x, rows, limit, first, stride) &
         !$omp private(i, j, n, a, b) num_threads(threads)
         do j = first, size(x, 2), stride
            a = 0.0_dp
            b = 0.0_dp
            n = 0.0_dp
            !$omp simd reduction(+:a, b, n)
            do i = 1, size(x, 1)
               a = a + merge(x(i, j), 0.0_dp, x(i, j) > limit)
               b = b + merge(0.0_dp, x(i, j), x(i, j) > limit)
               n = n + merge(1.0_dp, 0.0_dp, x(i, j) > limit)
            end do
            rows(:, j) = [a, b, n]
         end do
         sums = row_totals(rows(:, first::stride))
         sum = sums(1)
         others = sums(2)
         number = nint(sums(3))
      end subroutine sum_above

      !> x = max(x - limit, 0) and its sum.
      subroutine clip(limit, sum)
         real(dp), intent(in) :: limit
         real(dp), intent(out) :: sum
         real(dp) :: a
         integer :: i, j

         !$omp parallel do default(none) shared(x, rows, limit) private(i, j, a) num_threads(threads)
         do j = 1, size(x, 2)
            a = 0.0_dp
            !$omp simd reduction(+:a)
            do i = 1, size(x, 1)
               x(i, j) = max(x(i, j) - limit, 0.0_dp)
               a = a + x(i, j)
            end do
            rows(1, j) = a
         end do
         sum = row_total(rows, 1)
      end subroutine clip

      !> x = factor x.
      subroutine scale(factor)
         real(dp), intent(in) :: factor
         integer :: j

         !$omp parallel do default(none) shared(x, factor) private(j) num_threads(threads)
         do j = 1, size(x, 2)
            x(:, j) = factor*x(:, j)
         end do
      end subroutine scale

      !> x = value.
      subroutine fill(value)
         real(dp), intent(in) :: value
         integer :: j

         !$omp parallel do default(none) shared(x, value) private(j) num_threads(threads)
         do j = 1, size(x, 2)
            x(:, j) = value
         end do
      end subroutine fill

   end subroutine project_simplex

end module projection
