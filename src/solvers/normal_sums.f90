!> The sums over the cells of a row that the passes of the normal solver form.
!>
!> A pass fills one record per row, whichever thread works on the row. `total` adds the records in
!> the order of the rows, so that a result does not depend on the number of threads.
module normal_sums
   use field_sums, only : least_of_rows, row_totals
   use asperity_precision, only : dp
   implicit none
   private

   public :: direction_sums_type, state_sums_type, step_sums_type, total, &
      trial_sums_type

   !> Sums of a direction d before its offset is subtracted.
   type :: direction_sums_type
      real(dp) :: value = 0.0_dp            !! d
      real(dp) :: cells = 0.0_dp            !! number of cells where d acts
      real(dp) :: slope = 0.0_dp            !! r d
      real(dp) :: residual = 0.0_dp         !! r where d acts
   end type direction_sums_type

   !> Sums of a trial pressure above a limit.
   type :: trial_sums_type
      real(dp) :: above = 0.0_dp            !! sum of the parts above the limit, Pa
      real(dp) :: below = 0.0_dp            !! sum of the parts below it, after a release of cells, Pa
      real(dp) :: cells = 0.0_dp            !! number of cells above the limit
      real(dp) :: least = 0.0_dp            !! least trial pressure, at most 0, Pa
   end type trial_sums_type

   !> Sums of a step s.
   type :: step_sums_type
      real(dp) :: slope = 0.0_dp            !! (level - gap) s
      real(dp) :: square = 0.0_dp           !! s^2
   end type step_sums_type

   !> Sums of a state (pressure P and gap g).
   type :: state_sums_type
      real(dp) :: load = 0.0_dp             !! P, Pa
      real(dp) :: work = 0.0_dp             !! P g, Pa m
      real(dp) :: touched = 0.0_dp          !! g where P > 0, m
      real(dp) :: cells = 0.0_dp            !! number of cells with P > 0
      real(dp) :: distance = 0.0_dp         !! P |g - prescribed level|, Pa m
      real(dp) :: least = huge(1.0_dp)      !! least g, m
   end type state_sums_type

   !> The sums of all rows, added in their order.
   interface total
      module procedure :: total_direction, total_trial, total_step, total_state
   end interface total

contains

   !> Sums of a direction over the grid.
   function total_direction(rows) result(sums)
      type(direction_sums_type), intent(in) :: rows(:)
      type(direction_sums_type) :: sums
      real(dp) :: t(4)

      t = totals_of([rows%value, rows%cells, rows%slope, rows%residual], 4)
      sums = direction_sums_type(value=t(1), cells=t(2), slope=t(3), residual=t(4))
   end function total_direction

   !> Sums of a trial pressure over the grid.
   function total_trial(rows) result(sums)
      type(trial_sums_type), intent(in) :: rows(:)
      type(trial_sums_type) :: sums
      real(dp) :: t(3)

      t = totals_of([rows%above, rows%below, rows%cells], 3)
      sums = trial_sums_type(above=t(1), below=t(2), cells=t(3), least=least_of_rows([rows%least]))
   end function total_trial

   !> Sums of a step over the grid.
   function total_step(rows) result(sums)
      type(step_sums_type), intent(in) :: rows(:)
      type(step_sums_type) :: sums
      real(dp) :: t(2)

      t = totals_of([rows%slope, rows%square], 2)
      sums = step_sums_type(slope=t(1), square=t(2))
   end function total_step

   !> Sums of a state over the grid.
   function total_state(rows) result(sums)
      type(state_sums_type), intent(in) :: rows(:)
      type(state_sums_type) :: sums
      real(dp) :: t(5)

      t = totals_of([rows%load, rows%work, rows%touched, rows%cells, rows%distance], 5)
      sums = state_sums_type(load=t(1), work=t(2), touched=t(3), cells=t(4), distance=t(5), &
         least=least_of_rows([rows%least]))
   end function total_state

   !> Totals of several sums per row, which lie one after the other.
   function totals_of(rows, n) result(totals)
      real(dp), intent(in) :: rows(:)
      integer, intent(in) :: n              !! sums
      real(dp) :: totals(n)

      totals = row_totals(transpose(reshape(rows, [size(rows)/n, n])))
   end function totals_of

end module normal_sums
