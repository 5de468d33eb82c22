!> The fields of the tangential problem: those of the caller, and those of its solution, which the methods share.
!>
!> The vector fields of the caller have the shape [nx, 2, rows], and those of the solution [width, 2, rows], so that a
!> row of both components is one contiguous argument.
module friction_fields
   use contact_runs, only : contact_runs_type
   use asperity_precision, only : dp, int8
   use regular_grid, only : grid_type
   implicit none
   private

   public :: fit_field, friction_fields_type, friction_work_type

   !> The fields of the caller.
   type :: friction_fields_type
      real(dp), pointer, contiguous :: pressure(:, :) => null()    !! [nx, rows] P, Pa
      real(dp), pointer, contiguous :: slope_x(:, :) => null()     !! [nx, rows] H_x; any size without slope
      real(dp), pointer, contiguous :: slope_y(:, :) => null()     !! [nx, rows] H_y
      real(dp), pointer, contiguous :: drive(:, :, :) => null()    !! [nx, 2, rows] DX' = Q DX, Pa m
      !> [nx, 2, rows] T_h, a given traction, Pa: r = DX' - A (T + T_h), without an additional product. It may
      !> be missing.
      real(dp), pointer, contiguous :: past(:, :, :) => null()
      !> [nx, rows] The share of its bound that a cell may carry, 0 to 1: 0 where it is open, 1 where it is in
      !> contact; in between it touches without pressure, in a part of its area. `pressure` is then P times
      !> the share, and the states are only used to find cells that are likely to slip. It may be missing.
      real(dp), pointer, contiguous :: share(:, :) => null()
      real(dp), pointer, contiguous :: traction(:, :, :) => null() !! [nx, 2, rows] T, Pa; in: the start
      real(dp), pointer, contiguous :: slip(:, :, :) => null()     !! [nx, 2, rows] out: r, everywhere, Pa m
      !> If positive, `slip` times this is about r when a solve begins; 0 if nothing is known of r. Cells that
      !> are expected to slip far start on their bound, in the direction of their slip.
      real(dp) :: slip_unit = 0.0_dp
      !> [nx, rows] In: 0 open, 1 in contact, 2 in contact and likely to slip, as it did in the step
      !> before: its traction starts on the bound. Without adhesion a point with P <= 0 is taken as
      !> open. Out: 0 open, 1 stick, 2 slip.
      integer(int8), pointer, contiguous :: contact(:, :) => null()
   contains
      procedure :: fit_grid
   end type friction_fields_type

   !> The fields of a solution. They contain the cells in contact alone (module `contact_runs`), and zeros behind them;
   !> `width` is the number of cells in a row. Module `friction_rows` describes their contents.
   type :: friction_work_type
      type(contact_runs_type) :: runs
      real(dp), allocatable :: site(:, :, :)       !! [width, 5, rows] P, slopes and bound
      real(dp), allocatable :: share(:, :)         !! [width, rows] the caller's, if there are shares
      real(dp), allocatable :: traction(:, :, :)   !! [width, 2, rows] T, Pa
      real(dp), allocatable :: old(:, :, :)        !! [width, 2, rows] T before the last move, Pa
      real(dp), allocatable :: slip(:, :, :)       !! [width, 2, rows] r, Pa m
      real(dp), allocatable :: tangent(:, :, :)    !! [width, 3, rows] direction of slip and weight
      integer(int8), allocatable :: contact(:, :)  !! [width, rows] state
   contains
      procedure :: fit
   end type friction_work_type

contains

   !> Are all fields there that a solve needs, with the shape of the grid?
   pure logical function fit_grid(self, grid, slope)
      class(friction_fields_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: slope                 !! the slopes are needed

      fit_grid = associated(self%pressure) .and. associated(self%drive) .and. associated(self%traction) &
         .and. associated(self%slip) .and. associated(self%contact)
      if (slope) fit_grid = fit_grid .and. associated(self%slope_x) .and. associated(self%slope_y)
      if (.not. fit_grid) return

      fit_grid = grid%fits(shape(self%pressure)) .and. grid%fits(shape(self%contact)) &
         .and. grid%fits(shape(self%drive)) .and. grid%fits(shape(self%traction)) .and. grid%fits(shape(self%slip))
      if (slope) fit_grid = fit_grid .and. grid%fits(shape(self%slope_x)) .and. grid%fits(shape(self%slope_y))
      if (associated(self%past)) fit_grid = fit_grid .and. grid%fits(shape(self%past))
      if (associated(self%share)) fit_grid = fit_grid .and. grid%fits(shape(self%share))
   end function fit_grid

   !> Give the fields the width of the runs.
   subroutine fit(self, rows, has_shares)
      class(friction_work_type), intent(inout) :: self
      integer, intent(in) :: rows
      logical, intent(in) :: has_shares

      associate (width => self%runs%width)
         call fit_field(self%site, width, 5, rows)
         call fit_field(self%traction, width, 2, rows)
         call fit_field(self%old, width, 2, rows)
         call fit_field(self%slip, width, 2, rows)
         call fit_field(self%tangent, width, 3, rows)
         if (allocated(self%contact)) then
            if (size(self%contact, 1) /= width) deallocate (self%contact)
         end if
         if (.not. allocated(self%contact)) allocate (self%contact(width, rows))
         if (allocated(self%share)) then
            if (size(self%share, 1) /= width .or. .not. has_shares) deallocate (self%share)
         end if
         if (has_shares .and. .not. allocated(self%share)) allocate (self%share(width, rows))
      end associate
   end subroutine fit

   !> Give a field a width. If this changes, its values become 0.
   subroutine fit_field(field, width, columns, rows)
      real(dp), allocatable, intent(inout) :: field(:, :, :)
      integer, intent(in) :: width, columns, rows

      if (allocated(field)) then
         if (size(field, 1) /= width) deallocate (field)
      end if
      if (.not. allocated(field)) allocate (field(width, columns, rows), source=0.0_dp)
   end subroutine fit_field

end module friction_fields
