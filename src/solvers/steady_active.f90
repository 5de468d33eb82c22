!> Steady contact of few cells, solved on the cells in contact alone.
!>
!> With a guess C of the cells in contact, K P = H + level on C and the load give P there: a dense
!> system, whose matrix takes its entries from the displacement of one loaded cell. Cells with P < 0
!> leave C, those that overlap join it, until C stays. Few cells make the system cheap where the
!> splitting of `steady_normal` is slow: small patches far apart, or a summit on a tall map. Near the
!> solution a few rounds are enough. There is no proof that C settles: the caller goes on otherwise
!> where it does not.
module steady_active
   use dense_factors, only : factor, solve_factors
   use normal_state, only : gap_measure_type, measure_gap, narrow_scale, normal_problem_type
   use asperity_precision, only : dp
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: affordable, finish_on_contact

   integer, parameter :: most_rounds = 12        !! of joining
   integer, parameter :: most_departures = 8     !! of leaving, within a round

contains

   !> Is a dense system of so many cells cheap beside some tens of transforms?
   pure function affordable(cells_in_contact, cells) result(cheap)
      integer, intent(in) :: cells_in_contact, cells
      logical :: cheap
      real(dp), parameter :: transforms = 300.0_dp   !! measured (operations per cell and level)

      cheap = real(cells_in_contact, dp)**3 <= transforms*cells*log(real(max(cells, 2), dp))/log(2.0_dp)
   end function affordable

   !> Solve from the contact of a pressure. In: P of the right load; out where it succeeds: the solution,
   !> its gap U - H and its error. The pressure is otherwise left alone.
   subroutine finish_on_contact(operator, task, height, pressure, gap, found, success)
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found
      logical, intent(out) :: success
      type(normal_problem_type) :: narrowed
      real(dp), allocatable :: kernel(:, :), trial(:, :)
      real(dp) :: level
      logical :: solved
      integer :: round

      success = .false.
      allocate (kernel(size(height, 1), size(height, 2)), source=0.0_dp)
      allocate (trial, source=pressure)
      gap = 0.0_dp
      gap(1, 1) = 1.0_dp
      call operator%displace(gap, kernel)
      do round = 1, most_rounds
         call press_cells(kernel, task%target*size(height), height, operator%threads, trial, level, solved)
         if (.not. solved) return
         call operator%displace(trial, gap)
         gap = gap - height
         found = measure_gap(task, trial, gap, operator%threads)
         narrowed = task
         call narrow_scale(narrowed, height, trial, operator%threads, found)
         if (found%strict <= task%tolerance) then
            success = .true.
            pressure(:, :) = trial
            return
         end if
         ! Cells that overlap join with a pressure that only marks them.
         where (trial <= 0.0_dp .and. gap < level) trial = tiny(1.0_dp)
         if (.not. affordable(count(trial > 0.0_dp), size(trial))) return
      end do
   end subroutine finish_on_contact

   !> The pressure on the cells where it is positive, without those that would pull.
   subroutine press_cells(kernel, load, height, threads, pressure, level, solved)
      real(dp), intent(in) :: kernel(:, :)             !! displacement of the first cell's unit pressure
      real(dp), intent(in) :: load                     !! sum of P over the cells, Pa
      real(dp), intent(in) :: height(:, :)
      integer, intent(in) :: threads
      real(dp), intent(inout) :: pressure(:, :)        !! in: positive where cells take part
      real(dp), intent(out) :: level
      logical, intent(out) :: solved
      integer, allocatable :: cells(:, :)
      real(dp), allocatable :: matrix(:, :), p(:), ones(:)
      integer :: departure, k, n

      solved = .false.
      level = 0.0_dp
      do departure = 1, most_departures
         call list_cells(pressure, cells)
         n = size(cells, 2)
         if (n == 0) return
         allocate (matrix(n, n), p(n), ones(n))
         call fill_matrix(kernel, cells, threads, matrix)
         call factor(matrix, threads)
         do k = 1, n
            p(k) = height(cells(1, k), cells(2, k))
         end do
         ones = 1.0_dp
         call solve_factors(matrix, p)
         call solve_factors(matrix, ones)
         level = (load - sum(p))/sum(ones)
         p = p + level*ones
         if (.not. all(abs(p) < huge(1.0_dp))) return
         do k = 1, n
            pressure(cells(1, k), cells(2, k)) = max(p(k), 0.0_dp)
         end do
         solved = all(p >= 0.0_dp)
         deallocate (matrix, p, ones)
         if (solved) return
      end do
   end subroutine press_cells

   !> The cells with a positive pressure.
   subroutine list_cells(pressure, cells)
      real(dp), intent(in) :: pressure(:, :)
      integer, allocatable, intent(out) :: cells(:, :)     !! [2, n]
      integer :: i, j, n

      allocate (cells(2, count(pressure > 0.0_dp)))
      n = 0
      do j = 1, size(pressure, 2)
         do i = 1, size(pressure, 1)
            if (pressure(i, j) <= 0.0_dp) cycle
            n = n + 1
            cells(:, n) = [i, j]
         end do
      end do
   end subroutine list_cells

   !> The displacement of each cell by each.
   subroutine fill_matrix(kernel, cells, threads, matrix)
      real(dp), intent(in) :: kernel(:, :)
      integer, intent(in) :: cells(:, :)
      integer, intent(in) :: threads
      real(dp), intent(inout) :: matrix(:, :)
      integer :: a, b, d(2)

      !$omp parallel do default(none) shared(kernel, cells, matrix) private(a, b, d) num_threads(threads)
      do b = 1, size(cells, 2)
         do a = 1, size(cells, 2)
            d = cells(:, a) - cells(:, b)
            where (d < 0) d = d + shape(kernel)
            matrix(a, b) = kernel(d(1) + 1, d(2) + 1)
         end do
      end do
   end subroutine fill_matrix

end module steady_active
