!> Forecasts the displacement of the rubber's surface in the next step from the last steps.
!>
!> In steady sliding the displacement U_T around the contact moves over the rubber with the road, and changes
!> slowly while it does so. Let B_n be the displacement of the row before, carried along to the position of the
!> road in row n. Then
!>
!>     a_n = U_n - B_n                   the change in the row
!>     b_n = a_n - (a_(n-1), carried)    the increase of the change over that of the row before
!>     c_n = b_n - (b_(n-1), carried)
!>
!> are the errors of three forecasts of U_n: B_n, B_n + a_(n-1), and B_n + a_(n-1) + b_(n-1), which are
!> of first, second and third order in the length of the step. The forecast of the next row takes the
!> order whose error was least in this row, weighted by the pressure, because the road is read in the
!> contact only. If the contact jumps, or if the tolerance of the solver limits the accuracy of the differences,
!> this rule chooses a low order without further checks.
!>
!> The differences are only valid for settled steps of the same length and speed. If these change, or if a row has
!> not settled, the differences are discarded, because the error of such a row would be mistaken for a motion.
!>
!> The forecast is plain data and part of the state of a run. Memory, in fields of doubles: two components each of a
!> and b.
module place_forecast
   use asperity_precision, only : dp
   use carried_field, only : carry
   use field_copies, only : copy_field
   use field_sums, only : row_totals
   use regular_grid, only : grid_type
   implicit none
   private

   public :: new_place_forecast, place_forecast_type

   real(dp), parameter :: same_length = 1.0e-6_dp    !! relative difference of steps that count as equal

   !> The differences of the last rows.
   type :: place_forecast_type
      real(dp) :: dt = 0.0_dp                        !! length of the last step, s
      integer :: known = 0                           !! number of known differences: first a, then b
      integer :: order = 1                           !! of the forecast of the next row
      real(dp), allocatable :: change(:, :, :)       !! a of the last row, m [nx, 2, rows]
      real(dp), allocatable :: more(:, :, :)         !! b of the last row, m
   contains
      procedure :: add
      procedure :: follow
      procedure :: forget
      procedure :: learn
   end type place_forecast_type

contains

   !> Make a forecast without differences: it predicts no change.
   subroutine new_place_forecast(self, nx, rows)
      type(place_forecast_type), intent(out) :: self
      integer, intent(in) :: nx
      integer, intent(in) :: rows                    !! of this process

      allocate (self%change(nx, 2, rows), source=0.0_dp)
      allocate (self%more, source=self%change)
   end subroutine new_place_forecast

   !> Begin a row: the contact moves along the rubber by -motion.
   subroutine follow(self, grid, dt, continues, motion)
      class(place_forecast_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: dt                     !! s
      logical, intent(in) :: continues               !! the row continues the motion of the last one
      real(dp), intent(in) :: motion(2)              !! of the rubber over the road, m
      real(dp), allocatable :: moved(:, :)
      integer :: c

      if (.not. continues .or. abs(dt - self%dt) > same_length*dt) call self%forget()
      self%dt = dt
      allocate (moved(size(self%change, 1), size(self%change, 3)))
      do c = 1, 2
         if (self%known >= 1) then
            call carry(grid, self%change(:, c, :), motion, moved)
            call copy_field(moved, self%change(:, c, :))
         end if
         if (self%known >= 2) then
            call carry(grid, self%more(:, c, :), motion, moved)
            call copy_field(moved, self%more(:, c, :))
         end if
      end do
   end subroutine follow

   !> Discard the differences: the next row cannot be forecast from the rows so far.
   pure subroutine forget(self)
      class(place_forecast_type), intent(inout) :: self

      self%known = 0
      self%order = 1
   end subroutine forget

   !> Add the expected change of this row to the displacement that was carried along.
   subroutine add(self, place)
      class(place_forecast_type), intent(in) :: self
      real(dp), intent(inout) :: place(:, :, :)      !! in: B; out: the forecast, m [nx, 2, rows]
      integer :: j

      !$omp parallel do default(none) shared(self, place) private(j)
      do j = 1, size(place, 3)
         if (self%order >= 2) place(:, :, j) = place(:, :, j) + self%change(:, :, j)
         if (self%order >= 3) place(:, :, j) = place(:, :, j) + self%more(:, :, j)
      end do
   end subroutine add

   !> Update the differences, and the order of the next forecast, with a row that is solved.
   subroutine learn(self, found, carried, pressure)
      class(place_forecast_type), intent(inout) :: self
      real(dp), intent(in) :: found(:, :, :)         !! U_n, m [nx, 2, rows]
      real(dp), intent(in) :: carried(:, :, :)       !! B_n, m
      real(dp), intent(in) :: pressure(:, :)         !! Pa
      real(dp), allocatable :: rows(:, :)
      real(dp) :: errors(3)                          !! of the forecasts, weighted by the pressure
      integer :: j

      allocate (rows(3, size(pressure, 2)))
      !$omp parallel do default(none) shared(self, found, carried, pressure, rows) private(j)
      do j = 1, size(pressure, 2)
         call learn_row(found(:, :, j) - carried(:, :, j), pressure(:, j), self%change(:, :, j), &
            self%more(:, :, j), rows(:, j))
      end do
      errors = row_totals(rows)
      self%order = minloc(errors(:self%known + 1), dim=1)
      self%known = min(self%known + 1, 2)
   end subroutine learn

   !> Replace a and b in a row of the map by the new ones, and compute the errors of the forecasts.
   pure subroutine learn_row(found_change, pressure, change, more, errors)
      real(dp), intent(in) :: found_change(:, :)     !! a_n, m [nx, 2]
      real(dp), intent(in) :: pressure(:)            !! Pa [nx]
      real(dp), intent(inout) :: change(:, :)        !! in: a of the row before, carried; out: a_n, m
      real(dp), intent(inout) :: more(:, :)          !! in: b of the row before, carried; out: b_n, m
      real(dp), intent(out) :: errors(3)
      real(dp) :: b
      integer :: c, i

      errors = 0.0_dp
      do c = 1, 2
         do i = 1, size(pressure)
            b = found_change(i, c) - change(i, c)
            errors = errors + abs(pressure(i))*[found_change(i, c), b, b - more(i, c)]**2
            change(i, c) = found_change(i, c)
            more(i, c) = b
         end do
      end do
   end subroutine learn_row

end module place_forecast
