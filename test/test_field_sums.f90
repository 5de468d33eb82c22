!> Tests of the field algebra and of the projection.
module test_field_sums
   use asperity_threads, only : set_threads
   use asperity_precision, only : dp
   use check, only : begin_suite, check_close, check_that, selected
   use field_sums, only : cell_count, field_count, field_magnitude, field_maximum, field_mean, field_minimum, &
      field_product, field_rms, field_sum, largest_of_rows, least_of_rows, row_form, row_product, row_total, row_totals, sum_rows, &
      vector_sum
   use projection, only : project_simplex
   use regular_grid, only : boundary_free, grid_type, new_grid
   use workspace, only : new_workspace, workspace_type
   implicit none
   private

   public :: run_field_sums

contains

   subroutine run_field_sums()
      call begin_suite('field_sums')
      if (selected('the_grid_counts')) call the_grid_counts()
      if (selected('totals_of_rows')) call totals_of_rows()
      if (selected('known_fields')) call known_fields()
      if (selected('threads_do_not_matter')) call threads_do_not_matter()
      if (selected('counts_and_magnitudes')) call counts_and_magnitudes()
      if (selected('products_of_rows')) call products_of_rows()
      if (selected('returned_fields_are_lent_again')) call returned_fields_are_lent_again()
   end subroutine run_field_sums

   !> Products and quadratic forms of rows of all lengths, with whole numbers, whose sums are exact.
   subroutine products_of_rows()
      real(dp), allocatable :: x(:), w(:)
      integer :: i, n

      do n = 0, 9
         x = [(real(i, dp), i=1, n)]
         w = [(real(10 - i, dp), i=1, n)]
         call check_close(row_product(w, x), sum(w*x), 0.0_dp, 'product of rows')
         call check_close(row_form(w, x), sum(w*x**2), 0.0_dp, 'quadratic form of a row')
      end do
   end subroutine products_of_rows

   !> Counts of the rows add up. The magnitude of a field is that of its smallest value if this is larger.
   subroutine counts_and_magnitudes()
      real(dp) :: field(3, 2)

      call check_close(real(row_total([3, 0, 4]), dp), 7.0_dp, 0.0_dp, 'counts of rows')
      field = reshape([1.0_dp, -5.0_dp, 2.0_dp, 0.0_dp, 4.0_dp, -1.0_dp], [3, 2])
      call check_close(field_magnitude(field), 5.0_dp, 0.0_dp, 'largest magnitude')
      field = 0.0_dp
      call check_close(field_magnitude(field), tiny(1.0_dp), 0.0_dp, 'magnitude of zero')
   end subroutine counts_and_magnitudes

   !> Two fields that are borrowed at the same time have different memory. A field that was returned is used
   !> again.
   subroutine returned_fields_are_lent_again()
      type(workspace_type) :: work
      real(dp), pointer, contiguous :: one(:, :), other(:, :), third(:, :), memory(:, :)

      call new_workspace(work, 5, 3)
      call work%lend('one', one)
      call work%lend('other', other)
      call check_that(all(shape(one) == [5, 3]), 'shape', real(shape(one), dp))
      one = 1.0_dp
      other = 2.0_dp
      call check_close(maxval(abs(one - 1.0_dp)), 0.0_dp, 0.0_dp, 'fields of their own')
      memory => one
      call work%take_back(one)
      call check_that(.not. associated(one), 'the borrower no longer has it')
      call work%lend('third', third)
      call check_that(associated(third, memory), 'no more memory than is needed at once')
      third = 3.0_dp
      call check_close(maxval(abs(other - 2.0_dp)), 0.0_dp, 0.0_dp, 'a field in use is not given away')
      call work%take_back(third)
      memory => other
      call work%take_back(other)
      call work%lend('one again', one)
      call work%lend('other again', other)
      call check_that(associated(other, memory), 'every field that was returned is lent again')
      call work%destroy()
   end subroutine returned_fields_are_lent_again

   !> An oblong grid whose numbers of cells exceed the integers.
   subroutine the_grid_counts()
      type(grid_type) :: grid

      grid = new_grid(6, 4, 3.0_dp, 1.0_dp, boundary_free)
      call check_that(grid%first_row == 1 .and. grid%rows() == 4, 'one process holds all rows')
      call check_close(grid%cells(), 24.0_dp, 0.0_dp, 'cells of the grid')
      call check_close(grid%area(), 3.0_dp, 0.0_dp, 'area of the grid')
      call check_close(grid%cell_area(), 0.125_dp, 0.0_dp, 'area of a cell')
      grid = new_grid(100000, 50000, 1.0_dp, 1.0_dp, boundary_free)
      call check_close(grid%cells(), 5e9_dp, 0.0_dp, 'more cells than integers')
   end subroutine the_grid_counts

   !> Sums of rows are added in their order: of 1, 2^60 and -2^60 nothing is left in this order.
   subroutine totals_of_rows()
      real(dp), parameter :: large = 2.0_dp**60
      real(dp) :: rows(2, 3), totals(2), largest

      rows(1, :) = [1.0_dp, large, -large]
      rows(2, :) = [large, -large, 1.0_dp]
      totals = row_totals(rows)
      call check_close(totals(1), 0.0_dp, 0.0_dp, 'the small number is lost in the order of the rows')
      call check_close(totals(2), 1.0_dp, 0.0_dp, 'the small number is kept in the order of the rows')
      call check_close(row_total(rows, 1), 0.0_dp, 0.0_dp, 'the first of two sums per row')
      call check_close(row_total(rows(2, :)), 1.0_dp, 0.0_dp, 'one sum per row')
      call check_close(largest_of_rows(rows(1, :)), large, 0.0_dp, 'largest of the rows')
      call check_close(least_of_rows(rows(1, :)), -large, 0.0_dp, 'least of the rows')
      call sum_rows(rows, totals(:1), largest)
      call check_close(totals(1), 0.0_dp, 0.0_dp, 'a sum beside a largest number')
      call check_close(largest, large, 0.0_dp, 'the largest number beside a sum')
   end subroutine totals_of_rows

   !> The field i + 10 j on an oblong grid, whose sums are integers.
   subroutine known_fields()
      integer, parameter :: nx = 5, ny = 3
      real(dp) :: field(nx, ny), ones(nx, ny), sums(2)
      integer :: i, j

      field = reshape([((real(i + 10*j, dp), i = 1, nx), j = 1, ny)], [nx, ny])
      ones = 1.0_dp
      call check_close(cell_count(field), 15.0_dp, 0.0_dp, 'number of cells')
      call check_close(field_sum(field), 345.0_dp, 0.0_dp, 'sum')
      call check_close(field_mean(field), 23.0_dp, 0.0_dp, 'mean')
      sums = vector_sum(reshape([field, 2.0_dp*field], [nx, 2, ny], order=[1, 3, 2]))
      call check_close(sums(1), 345.0_dp, 0.0_dp, 'sum of the first component')
      call check_close(sums(2), 690.0_dp, 0.0_dp, 'sum of the second component')
      call check_close(field_product(field, ones), 345.0_dp, 0.0_dp, 'product with ones')
      call check_close(field_product(field, field), 8965.0_dp, 0.0_dp, 'sum of squares')
      call check_close(field_rms(field, 23.0_dp), sqrt(1030.0_dp/15.0_dp), 1e-14_dp, 'rms about the mean')
      call check_close(field_maximum(field), 35.0_dp, 0.0_dp, 'maximum')
      call check_close(field_minimum(field), 11.0_dp, 0.0_dp, 'minimum')
      call check_close(field_count(field > 30.0_dp), 5.0_dp, 0.0_dp, 'count')
      ! Clipping at 30.5 leaves 0.5, 1.5, ... in the last row only.
      call project_simplex(field, 12.5_dp)
      call check_close(field(1, ny), 0.5_dp, 1e-14_dp, 'the projection clips at the level of the sum')
      call check_close(field_sum(field), 12.5_dp, 1e-13_dp, 'the projection keeps the sum')
      call check_close(field_count(field > 0.0_dp), 5.0_dp, 0.0_dp, 'the projection leaves one row')
   end subroutine known_fields

   !> All results are the same to the last bit with one and with three threads.
   subroutine threads_do_not_matter()
      integer, parameter :: nx = 257, ny = 131
      real(dp), allocatable :: field(:, :), other(:, :)
      real(dp) :: results(4, 2)
      integer :: k

      allocate (field(nx, ny), other(nx, ny))
      do k = 1, 2
         call set_threads(merge(1, 3, k == 1))
         call random_field(field, 1)
         call random_field(other, 2)
         results(1, k) = field_sum(field)
         results(2, k) = field_product(field, other)
         results(3, k) = field_rms(field, 0.5_dp)
         call project_simplex(field, 100.0_dp)
         results(4, k) = field_product(field, other)
      end do
      call set_threads(0)
      call check_that(all(abs(results(:, 1) - results(:, 2)) <= 0.0_dp), 'same bits with three threads', &
         [maxval(abs(results(:, 1) - results(:, 2)))])
   end subroutine threads_do_not_matter

   !> Numbers between 0 and 1 without a pattern.
   subroutine random_field(field, seed)
      real(dp), intent(out) :: field(:, :)
      integer, intent(in) :: seed
      integer :: i, j

      do j = 1, size(field, 2)
         do i = 1, size(field, 1)
            field(i, j) = modulo(sin(12.9898_dp*i + 78.233_dp*j + seed)*43758.5453_dp, 1.0_dp)
         end do
      end do
   end subroutine random_field

end module test_field_sums
