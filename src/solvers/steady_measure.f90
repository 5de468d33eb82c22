!> The measures of one evaluation of the fixed-point map of module `steady_normal`: the duality gap, the length of the
!> residual, and the scale c that fits the state.
module steady_measure
   use asperity_precision, only : dp
   use field_sums, only : least_of_rows, row_totals
   use steady_operator, only : steady_operator_type
   use steady_scale, only : bounded_scale
   implicit none
   private

   public :: measure_evaluation, steady_measure_type

   integer, parameter :: sums_count = 7

   !> The measures of one evaluation of the fixed-point map.
   type :: steady_measure_type
      real(dp) :: error = huge(1.0_dp)           !! duality gap over the scale of the problem
      real(dp) :: change = 0.0_dp                !! |y - P|, root of the sum of squares, Pa
      real(dp) :: size = 0.0_dp                  !! |P|, likewise, Pa
      real(dp) :: scale = 0.0_dp                 !! c that would fit this state, Pa/m; 0: not known
   end type steady_measure_type

contains

   !> Compute the residual y - P and the measures. On return `error` is the duality gap, m, which the caller divides by the
   !> scale of the problem.
   subroutine measure_evaluation(operator, c, pressure, z, residual, measure)
      type(steady_operator_type), intent(in) :: operator
      real(dp), intent(in) :: c                        !! Pa/m
      real(dp), intent(in) :: pressure(:, :)           !! P, Pa
      real(dp), intent(in) :: z(:, :)                  !! Pa
      real(dp), intent(inout) :: residual(:, :)        !! on entry y, on return y - P, Pa
      type(steady_measure_type), intent(out) :: measure
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(sums_count), least, opened, open_cells
      integer :: j

      allocate (rows(sums_count + 1, size(z, 2)))
      !$omp parallel do default(none) shared(c, pressure, z, residual, rows) private(j) num_threads(operator%threads)
      do j = 1, size(z, 2)
         call measure_row(c, pressure(:, j), z(:, j), residual(:, j), rows(:, j))
      end do
      sums = row_totals(rows(:sums_count, :))
      least = least_of_rows(rows(sums_count + 1, :))
      measure%error = sums(2)/sums(1) - least
      measure%change = sqrt(sums(3))
      measure%size = sqrt(sums(4))
      open_cells = operator%grid%cells() - sums(5)
      if (sums(5) > 0.0_dp .and. open_cells > 0.0_dp) then
         opened = (sums(7) - sums(6)/sums(5)*open_cells)/open_cells
         if (opened > 0.0_dp) measure%scale = bounded_scale(operator, 2.0_dp*sums(1)/sums(5)/opened)
      end if
   end subroutine measure_evaluation

   !> Form the sums of a row: P, P g, (y - P)^2, P^2, the number of cells in contact, g there, g elsewhere; and the
   !> least g. The gap is that of y: g = K y - H = (2 P - z - y)/c.
   pure subroutine measure_row(c, pressure, z, y, sums)
      real(dp), intent(in) :: c
      real(dp), intent(in) :: pressure(:), z(:)
      real(dp), intent(inout) :: y(:)                  !! in: y; out: y - P, Pa
      real(dp), intent(out) :: sums(:)
      real(dp) :: gap, work, change, squares, cells, inside, outside, least, load
      integer :: i

      load = 0.0_dp
      work = 0.0_dp
      change = 0.0_dp
      squares = 0.0_dp
      cells = 0.0_dp
      inside = 0.0_dp
      outside = 0.0_dp
      least = huge(1.0_dp)
      !$omp simd private(gap) reduction(+:load, work, change, squares, cells, inside, outside) &
      !$omp reduction(min:least)
      do i = 1, size(y)
         gap = (2.0_dp*pressure(i) - z(i) - y(i))/c
         y(i) = y(i) - pressure(i)
         load = load + pressure(i)
         work = work + pressure(i)*gap
         change = change + y(i)**2
         squares = squares + pressure(i)**2
         cells = cells + merge(1.0_dp, 0.0_dp, pressure(i) > 0.0_dp)
         inside = inside + merge(gap, 0.0_dp, pressure(i) > 0.0_dp)
         outside = outside + merge(0.0_dp, gap, pressure(i) > 0.0_dp)
         least = min(least, gap)
      end do
      sums = [load, work, change, squares, cells, inside, outside, least]
   end subroutine measure_row

end module steady_measure
