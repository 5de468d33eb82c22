!> Tests of exchanges between the rows that processes share: rows fetched from their owners, shifts, carried
!> fields.
!>
!> The tests hold for any number of processes: built with MPI and started by mpirun, they share the rows.
module test_shared_rows
   use asperity_errors, only : error_type
   use asperity_interpolation, only : displaced, interpolation_type, new_interpolation, shifted
   use asperity_precision, only : dp, int8
   use carried_field, only : carry, shift_field, shift_states
   use coarse_fields, only : coarse_grid, coarsen, refine_pressure
   use check, only : begin_suite, check_close, check_no_error, check_that, selected
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use row_halo, only : fetch_rows, new_range_halo, row_halo_type
   implicit none
   private

   public :: run_shared_rows

   integer, parameter :: sizes(2, 4) = reshape([13, 37, 6, 1, 5, 3, 9, 200], [2, 4])   !! nx, ny

contains

   subroutine run_shared_rows()
      call begin_suite('shared_rows')
      if (selected('rows_come_from_their_owners')) call rows_come_from_their_owners()
      if (selected('bytes_come_from_their_owners')) call bytes_come_from_their_owners()
      if (selected('fields_shift_by_whole_cells')) call fields_shift_by_whole_cells()
      if (selected('fields_are_carried')) call fields_are_carried()
      if (selected('coarse_fields_are_means')) call coarse_fields_are_means()
      if (selected('pressures_are_refined')) then
         call pressures_are_refined(boundary_periodic)
         call pressures_are_refined(boundary_free)
      end if
      if (selected('roads_are_read_across_rows')) call roads_are_read_across_rows()
   end subroutine run_shared_rows

   !> A number that differs from cell to cell.
   elemental function value(i, j)
      integer, intent(in) :: i, j
      real(dp) :: value

      value = modulo(7919*i + 1049*j*j, 10007)/1024.0_dp - 4.0_dp
   end function value

   !> The value in a cell of an unbounded field: that of its image, or 0 beyond a free grid.
   elemental function image(grid, i, j)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: i, j
      real(dp) :: image

      image = 0.0_dp
      if (grid%boundary == boundary_periodic) then
         image = value(modulo(i - 1, grid%nx) + 1, modulo(j - 1, grid%ny) + 1)
      else if (i >= 1 .and. i <= grid%nx .and. j >= 1 .and. j <= grid%ny) then
         image = value(i, j)
      end if
   end function image

   !> A grid whose rows are shared, and the rows of the field on this process.
   subroutine new_field(k, boundary, grid, field)
      integer, intent(in) :: k, boundary
      type(grid_type), intent(out) :: grid
      real(dp), allocatable, intent(out) :: field(:, :)
      integer :: i, j

      grid = new_grid(sizes(1, k), sizes(2, k), 0.5_dp*sizes(1, k), 0.3_dp*sizes(2, k), boundary)
      call grid%share_rows()
      allocate (field(grid%nx, grid%rows()))
      do j = 1, grid%rows()
         field(:, j) = value([(i, i=1, grid%nx)], grid%first_row + j - 1)
      end do
   end subroutine new_field

   !> Largest difference of rows from those of a range of the unbounded field.
   function difference(grid, rows, first, first_column) result(largest)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: rows(:, :)
      integer, intent(in) :: first, first_column
      real(dp) :: largest
      integer :: i, j

      largest = 0.0_dp
      do j = 1, size(rows, 2)
         do i = 1, size(rows, 1)
            largest = max(largest, abs(rows(i, j) - image(grid, first_column - 1 + i, first - 1 + j)))
         end do
      end do
   end function difference

   !> A halo, a slab elsewhere, more than all rows, and none: each process gets the rows that it requests.
   subroutine rows_come_from_their_owners()
      integer, parameter :: boundaries(2) = [boundary_periodic, boundary_free]
      type(grid_type) :: grid
      type(row_halo_type) :: halo
      real(dp), allocatable :: beside(:, :), field(:, :), rows(:, :)
      integer :: b, i, k, n, range(2)

      do b = 1, 2
         do k = 1, size(sizes, 2)
            call new_field(k, boundaries(b), grid, field)
            do n = 1, 6
               select case (n)
               case (1)
                  range = [grid%first_row - 1, grid%last_row + 1]
               case (2)
                  range = [grid%first_row, grid%last_row] - 1000*grid%ny - 7
               case (3)
                  range = [1 - grid%ny, 2*grid%ny]
               case (4)
                  range = [5, 4]
               case (5)
                  range = [grid%last_row, grid%last_row + modulo(grid%first_row, 5)]
               case default
                  range = [1, merge(grid%ny, 0, modulo(grid%first_row, 2) == 1)]
               end select
               allocate (rows(grid%nx, max(0, range(2) - range(1) + 1)), source=-1.0_dp)
               call fetch_rows(grid, field, range, rows)
               call check_close(difference(grid, rows, range(1), 1), 0.0_dp, 0.0_dp, 'rows of the range')
               call new_range_halo(halo, grid, range)
               beside = reshape([field, [(-1.0_dp, i=1, grid%nx*halo%foreign)]], [grid%nx, halo%own + halo%foreign])
               call halo%fetch(beside)
               call check_close(sum(abs(beside(1, halo%own + 1:) - value(1, halo%row))), 0.0_dp, 0.0_dp, &
                  'rows of other processes')
               call check_that(all(halo%place(halo%row) == halo%own + [(i, i=1, halo%foreign)]), 'their places')
               deallocate (rows)
            end do
         end do
      end do
   end subroutine rows_come_from_their_owners

   !> A coarse cell holds the mean over its area, of any part of the cells that lie in it.
   subroutine coarse_fields_are_means()
      type(grid_type) :: grid, coarse
      real(dp), allocatable :: field(:, :), means(:, :)
      real(dp) :: worst
      integer :: i, j, k

      do k = 1, size(sizes, 2)
         call new_field(k, boundary_periodic, grid, field)
         coarse = coarse_grid(grid)
         allocate (means(coarse%nx, coarse%rows()))
         call coarsen(grid, coarse, field, 1, means)
         worst = 0.0_dp
         do j = 1, coarse%rows()
            do i = 1, coarse%nx
               worst = max(worst, abs(means(i, j) - mean_value(grid, coarse, i, coarse%first_row - 1 + j)))
            end do
         end do
         call check_close(worst, 0.0_dp, 1e-13_dp, 'mean over a coarse cell')
         deallocate (means)
      end do
   end subroutine coarse_fields_are_means

   !> Mean of the field over a coarse cell, by the lengths of its overlaps with all cells.
   function mean_value(grid, coarse, i, j) result(mean)
      type(grid_type), intent(in) :: grid, coarse
      integer, intent(in) :: i, j
      real(dp) :: mean
      integer :: k, m

      mean = 0.0_dp
      do m = 1, grid%ny
         do k = 1, grid%nx
            mean = mean + value(k, m)*overlap(grid%dx, k, coarse%dx, i)*overlap(grid%dy, m, coarse%dy, j)
         end do
      end do
      mean = mean/coarse%cell_area()

   contains

      !> The length that two cells have in common.
      pure real(dp) function overlap(width, cell, other_width, other)
         real(dp), intent(in) :: width, other_width
         integer, intent(in) :: cell, other

         overlap = max(0.0_dp, min(cell*width, other*other_width) - max((cell - 1)*width, (other - 1)*other_width))
      end function overlap

   end function mean_value

   !> A pressure of the coarse grid is interpolated between the centres of cells; it stays zero where the nearest
   !> coarse cell has none, and is exact for a plane, on a free grid for a plane times the pressure of a punch.
   subroutine pressures_are_refined(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid, coarse
      real(dp), allocatable :: values(:, :), pressure(:, :), wanted(:, :)
      integer :: i, j, place

      grid = new_grid(40, 70, 1.0_dp, 1.0_dp, boundary)
      call grid%share_rows()
      coarse = coarse_grid(grid)
      allocate (wanted(grid%nx, grid%rows()), pressure(grid%nx, grid%rows()))
      allocate (values(coarse%nx, coarse%rows()))
      do j = 1, coarse%rows()
         do i = 1, coarse%nx
            values(i, j) = exact(coarse, i, coarse%first_row - 1 + j)
         end do
      end do
      values(4, :) = 0.0_dp
      call refine_pressure(coarse, grid, values, 1, pressure)
      do j = 1, grid%rows()
         do i = 1, grid%nx
            wanted(i, j) = exact(grid, i, grid%first_row - 1 + j)
         end do
      end do
      ! Cubic polynomials reach two coarse cells: so far from the rim and from the coarse column without pressure.
      do j = 1, grid%rows()
         place = grid%first_row - 1 + j
         if (place < 7 .or. place > grid%ny - 6) cycle
         call check_close(maxval(abs(pressure(23:34, j)/wanted(23:34, j) - 1.0_dp)), 0.0_dp, 1e-13_dp, 'a plane')
         call check_close(maxval(abs(pressure(13:16, j))), 0.0_dp, 0.0_dp, 'no pressure')
         call check_that(all(pressure(12:17:5, j) > 0.0_dp), 'pressure beside it')
      end do

   contains

      !> The pressure of a cell.
      pure real(dp) function exact(of, i, j)
         type(grid_type), intent(in) :: of
         integer, intent(in) :: i, j                 !! from 1

         exact = 3.0_dp + 2.0_dp*(i - 0.5_dp)*of%dx + (j - 0.5_dp)*of%dy
         if (boundary == boundary_free) exact = exact*of_punch(of%nx, i)*of_punch(of%ny, j)
      end function exact

      !> The mean over cell k of n of d^(-1/2), with the distance d from the first edge, times that for the second edge.
      pure real(dp) function of_punch(n, k)
         integer, intent(in) :: n, k

         of_punch = n*(sqrt(k + 0.0_dp) - sqrt(k - 1.0_dp))*(sqrt(n + 1.0_dp - k) - sqrt(n - k + 0.0_dp))
      end function of_punch

   end subroutine pressures_are_refined

   !> Small integers are exchanged as well.
   subroutine bytes_come_from_their_owners()
      type(grid_type) :: grid
      real(dp), allocatable :: field(:, :)
      integer(int8), allocatable :: states(:, :), rows(:, :)
      integer :: i, j, worst

      call new_field(1, boundary_periodic, grid, field)
      allocate (states(grid%nx, grid%rows()), rows(grid%nx, grid%rows()))
      do j = 1, grid%rows()
         states(:, j) = int([(modulo(i*(grid%first_row + j - 1), 255) - 127, i=1, grid%nx)], int8)
      end do
      call fetch_rows(grid, states, [grid%first_row, grid%last_row] + 5, rows)
      worst = 0
      do j = 1, grid%rows()
         do i = 1, grid%nx
            worst = max(worst, abs(int(rows(i, j)) &
               - (modulo(i*(modulo(grid%first_row + j + 3, grid%ny) + 1), 255) - 127)))
         end do
      end do
      call check_close(real(worst, dp), 0.0_dp, 0.0_dp, 'bytes of the range')
   end subroutine bytes_come_from_their_owners

   !> A field moves around a periodic grid, and out of a free one, where zeros take its place.
   subroutine fields_shift_by_whole_cells()
      integer, parameter :: boundaries(2) = [boundary_periodic, boundary_free]
      integer, parameter :: shifts(2, 4) = reshape([0, 0, 3, -4, -20, 11, 1, 1000003], [2, 4])
      type(grid_type) :: grid
      real(dp), allocatable :: field(:, :), moved(:, :)
      integer(int8), allocatable :: states(:, :)
      integer :: b, k, n

      do b = 1, 2
         do k = 1, size(sizes, 2)
            do n = 1, size(shifts, 2)
               call new_field(k, boundaries(b), grid, field)
               allocate (moved, source=field)
               states = int(field/3.0_dp, int8)
               call shift_states(grid, shifts(:, n), states)
               call shift_field(grid, shifts(:, n), field, moved)
               call check_close(difference(grid, field, grid%first_row - shifts(2, n), 1 - shifts(1, n)), &
                  0.0_dp, 0.0_dp, 'the field is that of a shifted place')
               call check_close(real(sum(abs(int(states) - int(field/3.0_dp))), dp), 0.0_dp, 0.0_dp, &
                  'the states shift with the field')
               deallocate (moved)
            end do
         end do
      end do
   end subroutine fields_shift_by_whole_cells

   !> A field is carried by whole cells without a change of any bit. Beyond a free grid the values at its rim
   !> continue.
   subroutine fields_are_carried()
      type(grid_type) :: grid
      real(dp), allocatable :: field(:, :), moved(:, :)
      integer :: j, k

      do k = 1, size(sizes, 2)
         call new_field(k, boundary_periodic, grid, field)
         allocate (moved, source=field)
         call carry(grid, field, [-3*grid%dx, 50002*grid%dy], moved)
         ! The motion in cells has round-off, and so has the result.
         call check_close(difference(grid, moved, grid%first_row + 50002, -2), 0.0_dp, 1.0e-6_dp*grid%ny, &
            'carried round')
         call carry(grid, field, [0.0_dp, 0.25_dp*grid%dy], moved)
         deallocate (moved)
         call new_field(k, boundary_free, grid, field)
         allocate (moved, source=field)
         call carry(grid, field, [0.0_dp, 4.0_dp*grid%dy], moved)
         do j = 1, grid%rows()
            call check_close(moved(2, j), value(2, min(grid%first_row + j + 3, grid%ny)), 1.0e-9_dp, &
               'the rim is continued')
         end do
         deallocate (moved)
      end do
   end subroutine fields_are_carried

   !> The road read on shared rows is that of a grid that every process holds completely, to the last bit:
   !> near and far, at rest and displaced, in every step.
   subroutine roads_are_read_across_rows()
      character(6), parameter :: methods(2) = ['linear', 'cubic ']
      integer, parameter :: boundaries(2) = [boundary_periodic, boundary_free]
      type(error_type), allocatable :: error
      type(grid_type) :: grid, whole
      type(interpolation_type) :: road, whole_road
      real(dp), allocatable :: field(:, :), all(:, :), h(:, :, :), g(:, :, :), s(:, :, :)
      integer :: b, i, j, k, m, n

      do b = 1, 2
         do k = 1, size(sizes, 2)
            call new_field(k, boundaries(b), grid, field)
            whole = new_grid(grid%nx, grid%ny, grid%lx, grid%ly, grid%boundary)
            allocate (all(grid%nx, grid%ny), s(grid%nx, grid%ny, 2), h(grid%nx, grid%rows(), 3), g(grid%nx, grid%ny, 3))
            do j = 1, grid%ny
               all(:, j) = value([(i, i=1, grid%nx)], j)
               s(:, j, 1) = 0.3_dp*value(j, [(i, i=1, grid%nx)])
               s(:, j, 2) = 0.1_dp*value([(i + j, i=1, grid%nx)], j)
            end do
            do m = 1, 2
               call new_interpolation(road, grid, field, trim(methods(m)), error)
               call check_no_error(error, 'shared')
               call new_interpolation(whole_road, whole, all, trim(methods(m)), error)
               call check_no_error(error, 'whole')
               do n = 0, 12
                  call shifted(road, 0.2_dp*n, -0.35_dp*n**2, h(:, :, 1), h(:, :, 2), h(:, :, 3))
                  call shifted(whole_road, 0.2_dp*n, -0.35_dp*n**2, g(:, :, 1), g(:, :, 2), g(:, :, 3))
                  call check_same('shifted')
                  call displaced(road, 0.2_dp*n, 0.7_dp*n, s(:, grid%first_row:grid%last_row, 1), &
                     n*s(:, grid%first_row:grid%last_row, 2), h(:, :, 1), h(:, :, 2), h(:, :, 3))
                  call displaced(whole_road, 0.2_dp*n, 0.7_dp*n, s(:, :, 1), n*s(:, :, 2), &
                     g(:, :, 1), g(:, :, 2), g(:, :, 3))
                  call check_same('displaced')
               end do
            end do
            deallocate (all, s, h, g)
         end do
      end do

   contains

      !> Compare the rows of this process.
      subroutine check_same(what)
         character(*), intent(in) :: what

         call check_close(sum(abs(h - g(:, grid%first_row:grid%last_row, :))), 0.0_dp, 0.0_dp, what)
      end subroutine check_same

   end subroutine roads_are_read_across_rows

end module test_shared_rows
