!> The fields of the tangential problem: those of the caller, and the work fields that the methods share.
!>
!> Vector fields have the shape [nx, 2, rows], so that a row of both components is one contiguous argument.
module friction_fields
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: friction_fields_type, friction_work_type

   !> The fields of the caller.
   type :: friction_fields_type
      real(dp), pointer, contiguous :: pressure(:, :) => null()    !! [nx, rows] P, Pa
      real(dp), pointer, contiguous :: slope_x(:, :) => null()     !! [nx, rows] H_x; any size without slope
      real(dp), pointer, contiguous :: slope_y(:, :) => null()     !! [nx, rows] H_y
      real(dp), pointer, contiguous :: drive(:, :, :) => null()    !! [nx, 2, rows] DX', m
      !> [nx, 2, rows] T_h, a given traction, Pa: r = DX' - A (T + T_h), without an additional product. It may
      !> be missing.
      real(dp), pointer, contiguous :: past(:, :, :) => null()
      !> [nx, rows] The share of its bound that a cell may carry, 0 to 1: 0 where it is open, 1 where it is in
      !> contact; in between it touches without pressure, in a part of its area. `pressure` is then P times
      !> the share, and the states are only used to find cells that are likely to slip. It may be missing.
      real(dp), pointer, contiguous :: share(:, :) => null()
      real(dp), pointer, contiguous :: traction(:, :, :) => null() !! [nx, 2, rows] T, Pa; in: the start
      real(dp), pointer, contiguous :: slip(:, :, :) => null()     !! [nx, 2, rows] out: r, everywhere, m
      !> If positive, `slip` times this is about r when a solve begins; 0 if nothing is known of r. Cells that
      !> are expected to slip far start on their bound, in the direction of their slip.
      real(dp) :: slip_unit = 0.0_dp
      !> [nx, rows] In: 0 open, 1 in contact, 2 in contact and likely to slip, as it did in the step
      !> before: its traction starts on the bound. Without adhesion a point with P <= 0 is taken as
      !> open. Out: 0 open, 1 stick, 2 slip.
      integer(int8), pointer, contiguous :: contact(:, :) => null()
   end type friction_fields_type

   !> Fields of a solution in addition to the caller's. Module `friction_rows` describes their contents.
   type :: friction_work_type
      real(dp), allocatable :: bound(:, :, :)      !! [nx, 2, rows] F, Pa, and N_z of the road
      real(dp), allocatable :: tangent(:, :, :)    !! [nx, 3, rows] direction of slip and weight
      real(dp), allocatable :: old(:, :, :)        !! [nx, 2, rows] T before the last move, Pa
   end type friction_work_type

end module friction_fields
