!> The sums that the passes of the normal solver take over the cells of a row.
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

   !> Of a direction d before its offset is taken off.
   type :: direction_sums_type
      real(dp) :: value = 0.0_dp            !! d
      real(dp) :: cells = 0.0_dp            !! number of cells where d acts
      real(dp) :: slope = 0.0_dp            !! r d
      real(dp) :: residual = 0.0_dp         !! r where d acts
      real(dp) :: square = 0.0_dp           !! d^2
   end type direction_sums_type

   !> Of a trial pressure above a limit.
   type :: trial_sums_type
      real(dp) :: above = 0.0_dp            !! what lies above the limit, Pa
      real(dp) :: cells = 0.0_dp            !! number of cells above the limit
      real(dp) :: least = 0.0_dp            !! least trial pressure, at most 0, Pa
   end type trial_sums_type

   !> Of a step s.
   type :: step_sums_type
      real(dp) :: slope = 0.0_dp            !! (level - gap) s
      real(dp) :: square = 0.0_dp           !! s^2
   end type step_sums_type

   !> Of a state (pressure P and gap g).
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
      real(dp), allocatable :: parts(:, :)
      real(dp) :: totals(5)

      parts = reshape([rows%value, rows%cells, rows%slope, rows%residual, rows%square], [size(rows), 5])
      totals = row_totals(transpose(parts))
      sums%value = totals(1)
      sums%cells = totals(2)
      sums%slope = totals(3)
      sums%residual = totals(4)
      sums%square = totals(5)
   end function total_direction

   !> Sums of a trial pressure over the grid.
   function total_trial(rows) result(sums)
      type(trial_sums_type), intent(in) :: rows(:)
      type(trial_sums_type) :: sums
      real(dp), allocatable :: parts(:, :)
      real(dp) :: totals(2)

      parts = reshape([rows%above, rows%cells], [size(rows), 2])
      totals = row_totals(transpose(parts))
      sums%above = totals(1)
      sums%cells = totals(2)
      sums%least = least_of_rows(rows%least)
   end function total_trial

   !> Sums of a step over the grid.
   function total_step(rows) result(sums)
      type(step_sums_type), intent(in) :: rows(:)
      type(step_sums_type) :: sums
      real(dp), allocatable :: parts(:, :)
      real(dp) :: totals(2)

      parts = reshape([rows%slope, rows%square], [size(rows), 2])
      totals = row_totals(transpose(parts))
      sums%slope = totals(1)
      sums%square = totals(2)
   end function total_step

   !> Sums of a state over the grid.
   function total_state(rows) result(sums)
      type(state_sums_type), intent(in) :: rows(:)
      type(state_sums_type) :: sums
      real(dp), allocatable :: parts(:, :)
      real(dp) :: totals(5)

      parts = reshape([rows%load, rows%work, rows%touched, rows%cells, rows%distance], [size(rows), 5])
      totals = row_totals(transpose(parts))
      sums%load = totals(1)
      sums%work = totals(2)
      sums%touched = totals(3)
      sums%cells = totals(4)
      sums%distance = totals(5)
      sums%least = least_of_rows(rows%least)
   end function total_state

end module normal_sums
