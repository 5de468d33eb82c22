!> Projections of fields on what a solution must satisfy.
module projection
   use parallel, only : global_sum, thread_count
   use precision, only : dp
   implicit none
   private

   public :: project_simplex

contains

   !> The nearest field to x that is nowhere negative and has the sum `total` > 0: max(x - t, 0).
   !> A field that is already so is left alone to the last bit.
   subroutine project_simplex(x, total)
      real(dp), intent(inout) :: x(:, :)       !! [nx, ny]
      real(dp), intent(in) :: total
      real(dp) :: level, next, above, negative
      integer :: i, j, count, cells, threads

      cells = size(x)
      threads = merge(1, thread_count(), cells < 16384)
      call sum_above(0.0_dp, above, count, negative)
      if (abs(above - total) <= 1e-15_dp*count*total .and. negative == 0.0_dp) return
      ! The first level is below the solution; Newton's steps rise to it.
      level = (above + negative - total)/cells
      do
         call sum_above(level, above, count, negative)
         if (count == 0) exit
         next = (above - total)/count
         if (next <= level) exit
         level = next
      end do
      !$omp parallel do default(none) shared(x, level) private(i, j) num_threads(threads)
      do j = 1, size(x, 2)
         do i = 1, size(x, 1)
            x(i, j) = max(x(i, j) - level, 0.0_dp)
         end do
      end do

   contains

      !> Sum and number of the cells above a level, and the sum of the others.
      subroutine sum_above(limit, sum, number, others)
         real(dp), intent(in) :: limit
         real(dp), intent(out) :: sum
         integer, intent(out) :: number
         real(dp), intent(out) :: others
         real(dp), allocatable :: rows(:, :)
         real(dp) :: a, b
         integer :: k, l, n

         allocate (rows(3, size(x, 2)))
         !$omp parallel do default(none) shared(x, rows, limit) private(k, l, n, a, b) &
         !$omp num_threads(threads)
         do l = 1, size(x, 2)
            a = 0.0_dp
            b = 0.0_dp
            n = 0
            do k = 1, size(x, 1)
               if (x(k, l) > limit) then
                  a = a + x(k, l)
                  n = n + 1
               else
                  b = b + x(k, l)
               end if
            end do
            rows(:, l) = [a, b, real(n, dp)]
         end do
         sum = global_sum(add(rows(1, :)))
         others = global_sum(add(rows(2, :)))
         number = nint(global_sum(add(rows(3, :))))
      end subroutine sum_above

      !> Sum in order, so that the threads do not matter.
      pure function add(values) result(total)
         real(dp), intent(in) :: values(:)
         real(dp) :: total

         total = sum(values)
      end function add

   end subroutine project_simplex

end module projection
