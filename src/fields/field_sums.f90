!> Field algebra: sums, means, extremes and counts over the cells of the whole grid.
!>
!> A field is summed in two stages. Each row is summed first, in parallel. The sums of the rows are then
!> added one after the other in the order of the rows of the whole grid, so that a result does not
!> depend, to the last bit, on how threads or processes share the rows. Every process gets the result, and
!> every process must call the procedure. A loop that needs several sums at once forms the sums of its rows
!> itself, in an array with one column per row, and passes that array to `row_total`, `row_totals`,
!> `largest_of_rows` or `least_of_rows`.
!>
!> A process holds only its own rows of a field, so that `size(field)` is not the number of cells:
!> `cell_count` and the means of this module refer to the whole grid.
module field_sums
   use asperity_parallel, only : gather_rows, global_max, global_min, global_sum, process_count
   use asperity_threads, only : least_parallel_cells, thread_count
   use asperity_precision, only : dp
   implicit none
   private

   public :: added, cell_count, field_count, field_magnitude, field_maximum, field_mean, field_minimum, &
      field_product, field_rms, field_sum, largest_of_rows, least_of_rows, ratio_of_lengths, row_form, row_product, &
      row_total, row_totals, sum_rows, threads_for, vector_sum


   !> Total of one sum or count per row: of `rows(j)`, or of `rows(k, j)` for a given k.
   interface row_total
      module procedure :: total_of_rows, total_of_row_counts, total_of_row_sums
   end interface row_total

contains

   !> Sum of the products of two rows. It is formed in four independent parts, because in a plain loop each
   !> addition would have to wait for the one before.
   pure function row_product(one, other) result(total)
      real(dp), intent(in), contiguous :: one(:), other(:)
      real(dp) :: total
      real(dp) :: parts(4)
      integer :: i, whole

      whole = size(one) - modulo(size(one), 4)
      parts = 0.0_dp
      do i = 1, whole, 4
         parts(1) = parts(1) + one(i)*other(i)
         parts(2) = parts(2) + one(i + 1)*other(i + 1)
         parts(3) = parts(3) + one(i + 2)*other(i + 2)
         parts(4) = parts(4) + one(i + 3)*other(i + 3)
      end do
      total = (parts(1) + parts(3)) + (parts(2) + parts(4))
      do i = whole + 1, size(one)
         total = total + one(i)*other(i)
      end do
   end function row_product

   !> The quadratic form x.(w x) of a row with a diagonal weight w, summed in four parts like `row_product`.
   pure function row_form(weight, x) result(total)
      real(dp), intent(in), contiguous :: weight(:), x(:)
      real(dp) :: total
      real(dp) :: parts(4)
      integer :: i, whole

      whole = size(x) - modulo(size(x), 4)
      parts(:) = 0.0_dp
      do i = 1, whole, 4
         parts(:) = parts + x(i:i + 3)*(weight(i:i + 3)*x(i:i + 3))
      end do
      total = (parts(1) + parts(3)) + (parts(2) + parts(4))
      do i = whole + 1, size(x)
         total = total + x(i)*(weight(i)*x(i))
      end do
   end function row_form

   !> Total over all rows of the grid, added in the order of the rows.
   function total_of_rows(rows) result(total)
      real(dp), intent(in) :: rows(:)          !! one sum for each row of this process
      real(dp) :: total
      integer :: j

      if (process_count() > 1) then
         total = total_of_row_sums(reshape(rows, [1, size(rows)]), 1)
         return
      end if
      total = 0.0_dp
      do j = 1, size(rows)
         total = total + rows(j)
      end do
   end function total_of_rows

   !> Total of one count per row.
   function total_of_row_counts(rows) result(total)
      integer, intent(in) :: rows(:)           !! one count for each row of this process
      integer :: total

      total = global_sum(sum(rows))
   end function total_of_row_counts

   !> The same as `total_of_rows` for the k-th of several sums per row.
   function total_of_row_sums(rows, k) result(total)
      real(dp), intent(in) :: rows(:, :)       !! [sums, rows of this process]
      integer, intent(in) :: k
      real(dp) :: total
      real(dp) :: totals(1)

      totals = row_totals(rows(k:k, :))
      total = totals(1)
   end function total_of_row_sums

   !> Totals of several sums per row, each added in the order of the rows.
   function row_totals(rows) result(totals)
      real(dp), intent(in) :: rows(:, :)       !! [sums, rows of this process]
      real(dp) :: totals(size(rows, 1))

      if (process_count() > 1) then
         totals = added(gather_rows(rows))
      else
         totals = added(rows)
      end if
   end function row_totals

   !> The length of one field over that of another, from the squares of both in each row.
   function ratio_of_lengths(rows) result(ratio)
      real(dp), intent(in) :: rows(:, :)       !! [2, rows of this process]
      real(dp) :: ratio
      real(dp) :: sums(2)

      sums = row_totals(rows)
      ratio = sqrt(sums(1)/max(sums(2), tiny(1.0_dp)))
   end function ratio_of_lengths

   !> Totals of several sums per row, and the largest of one more number per row, in one exchange.
   subroutine sum_rows(rows, totals, largest)
      real(dp), intent(in) :: rows(:, :)       !! [sums + 1, rows of this process]; the number comes last
      real(dp), intent(out) :: totals(:)       !! [sums]
      real(dp), intent(out) :: largest

      if (process_count() > 1) then
         call reduce(gather_rows(rows))
      else
         call reduce(rows)
      end if

   contains

      !> Form the totals and the largest number from the rows of the whole grid.
      subroutine reduce(all_rows)
         real(dp), intent(in) :: all_rows(:, :)

         totals = added(all_rows(:size(totals), :))
         largest = maxval(all_rows(size(totals) + 1, :))
      end subroutine reduce

   end subroutine sum_rows

   !> Add the sums one after the other.
   pure function added(rows) result(totals)
      real(dp), intent(in) :: rows(:, :)
      real(dp) :: totals(size(rows, 1))
      integer :: j

      totals = 0.0_dp
      do j = 1, size(rows, 2)
         totals = totals + rows(:, j)
      end do
   end function added

   !> Largest of one number per row.
   function largest_of_rows(rows) result(largest)
      real(dp), intent(in) :: rows(:)
      real(dp) :: largest

      largest = global_max(maxval(rows))
   end function largest_of_rows

   !> Least of one number per row.
   function least_of_rows(rows) result(least)
      real(dp), intent(in) :: rows(:)
      real(dp) :: least

      least = global_min(minval(rows))
   end function least_of_rows

   !> Number of cells of the whole grid that a field lives on. It is real because it may exceed the largest integer.
   function cell_count(field) result(cells)
      real(dp), intent(in) :: field(:, :)      !! [nx, rows of this process]
      real(dp) :: cells

      cells = real(size(field, 1), dp)*global_sum(size(field, 2))
   end function cell_count

   !> Number of threads for a loop over a field: one if the field is small.
   function threads_for(field) result(threads)
      real(dp), intent(in) :: field(:, :)      !! [nx, rows of this process]
      integer :: threads

      threads = thread_count()
      if (real(size(field, 1), dp)*size(field, 2) < least_parallel_cells) threads = 1
   end function threads_for

   !> Sum of a field.
   function field_sum(field) result(total)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: total
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(field, 2)))
      !$omp parallel do default(none) shared(field, rows) private(j) num_threads(threads_for(field))
      do j = 1, size(field, 2)
         rows(j) = sum(field(:, j))
      end do
      total = row_total(rows)
   end function field_sum

   !> Sums of the components of a vector field.
   function vector_sum(field) result(total)
      real(dp), intent(in) :: field(:, :, :)   !! [nx, components, rows of this process]
      real(dp) :: total(size(field, 2))
      real(dp), allocatable :: rows(:, :)
      integer :: c, j

      allocate (rows(size(field, 2), size(field, 3)))
      !$omp parallel do default(none) shared(field, rows) private(c, j) num_threads(threads_for(field(:, 1, :)))
      do j = 1, size(field, 3)
         do c = 1, size(field, 2)
            rows(c, j) = sum(field(:, c, j))
         end do
      end do
      total = row_totals(rows)
   end function vector_sum

   !> Mean of a field over the cells of the grid.
   function field_mean(field) result(mean)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: mean

      mean = field_sum(field)/cell_count(field)
   end function field_mean

   !> Sum of the products of two fields.
   function field_product(one, other) result(total)
      real(dp), intent(in) :: one(:, :), other(:, :)
      real(dp) :: total
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(one, 2)))
      !$omp parallel do default(none) shared(one, other, rows) private(j) num_threads(threads_for(one))
      do j = 1, size(one, 2)
         rows(j) = sum(one(:, j)*other(:, j))
      end do
      total = row_total(rows)
   end function field_product

   !> Root of the mean square of a field about a level, for example about its mean.
   function field_rms(field, about) result(rms)
      real(dp), intent(in) :: field(:, :)
      real(dp), intent(in) :: about
      real(dp) :: rms
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(field, 2)))
      !$omp parallel do default(none) shared(field, about, rows) private(j) &
      !$omp num_threads(threads_for(field))
      do j = 1, size(field, 2)
         rows(j) = sum((field(:, j) - about)**2)
      end do
      rms = sqrt(row_total(rows)/cell_count(field))
   end function field_rms

   !> Largest value of a field.
   function field_maximum(field) result(largest)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: largest
      real(dp), allocatable :: rows(:, :)

      rows = row_extremes(field)
      largest = largest_of_rows(rows(2, :))
   end function field_maximum

   !> Largest magnitude of a field. It is slightly above zero if the field is zero, so that one may divide by it.
   function field_magnitude(field) result(largest)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: largest
      real(dp), allocatable :: rows(:, :)

      rows = row_extremes(field)
      largest = max(largest_of_rows(max(-rows(1, :), rows(2, :))), tiny(1.0_dp))
   end function field_magnitude

   !> Least value of a field.
   function field_minimum(field) result(least)
      real(dp), intent(in) :: field(:, :)
      real(dp) :: least
      real(dp), allocatable :: rows(:, :)

      rows = row_extremes(field)
      least = least_of_rows(rows(1, :))
   end function field_minimum

   !> Least and largest value of each row.
   function row_extremes(field) result(rows)
      real(dp), intent(in) :: field(:, :)
      real(dp), allocatable :: rows(:, :)      !! [2, rows of this process]
      integer :: j

      allocate (rows(2, size(field, 2)))
      !$omp parallel do default(none) shared(field, rows) private(j) num_threads(threads_for(field))
      do j = 1, size(field, 2)
         rows(:, j) = [minval(field(:, j)), maxval(field(:, j))]
      end do
   end function row_extremes

   !> Number of cells of the whole grid for which a condition holds, as a real number.
   function field_count(condition) result(cells)
      logical, intent(in) :: condition(:, :)   !! [nx, rows of this process]
      real(dp) :: cells
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(condition, 2)))
      !$omp parallel do default(none) shared(condition, rows) private(j) &
      !$omp num_threads(merge(1, thread_count(), size(condition) < least_parallel_cells))
      do j = 1, size(condition, 2)
         rows(j) = count(condition(:, j))
      end do
      cells = row_total(rows)
   end function field_count

end module field_sums
