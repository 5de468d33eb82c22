!> The work fields and the state of the iteration of the fast method for adhesive contact (module
!> `adhesion_cg_fast`).
module adhesion_work
   use adhesion_model, only : adhesion_model_type
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type
   use adhesion_window, only : adhesion_window_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: adhesion_iteration_type, adhesion_work_type

   ! How the traction was computed.
   integer, parameter, public :: updated = 1    !! it was updated by the steps, and has accumulated round-off
   integer, parameter, public :: fresh = 2      !! it is a product with B

   !> The operators and work fields of the method.
   type :: adhesion_work_type
      type(adhesion_patch_type) :: patch
      type(adhesion_model_type) :: model
      type(adhesion_window_type) :: window
      !> Input and output of the preconditioner M: the scaled residual, then z = M r. Between its uses, G or e'.
      real(dp), allocatable :: exchange(:, :)
      real(dp), allocatable :: residual(:, :)        !! r
      real(dp), allocatable :: curvature(:, :)       !! e'' at the gap that was measured last, on the patch
      real(dp), allocatable :: old(:, :)             !! r of the iteration before
      real(dp), allocatable :: direction(:, :)       !! d
      ! The contact in the local model of its energy:
      real(dp), allocatable :: model_state(:, :)
      real(dp), allocatable :: model_traction(:, :)
      !> Change of the displacement, or its correction where gaps were closed. The rows of other processes that the
      !> stencil needs follow those of this process.
      real(dp), allocatable :: change(:, :)
      logical, allocatable :: has_correction(:)      !! is the correction in a row of `change` not zero?
      real(dp), allocatable :: image(:, :)           !! product of `change` with B_h, or of the step with B
      real(dp), allocatable :: last_step(:, :)       !! the step before (module adhesion_plane)
      real(dp), allocatable :: last_image(:, :)      !! its product with B
      real(dp) :: scaling = 0.0_dp                   !! k of the Gauss potential, Pa/m; 0: none
   end type adhesion_work_type

   !> A contact that is being solved, and the state of its iteration.
   type, extends(adhesion_contact_type) :: adhesion_iteration_type
      integer :: source = fresh                  !! of the traction
      integer :: updates = 0                     !! of the traction since it was fresh
      real(dp) :: moved = 0.0_dp                 !! sum of the largest displacements of the steps since then, m
      integer :: closings = 0                    !! times that narrow gaps were closed
      integer :: failures = 0                    !! successive steps that did not lower the energy
      integer :: caution = 0                     !! number of quarterings of the lengths allowed, after failures
      integer :: least_caution = 0               !! that is kept after good steps, too
      integer :: setbacks = 0                    !! steps that failed or were short, since a step without caution was good
      integer :: calm = 0                        !! successive good steps with the present caution
      real(dp) :: residual = 0.0_dp              !! natural residual of the present traction
      real(dp) :: before = huge(1.0_dp)          !! the same in the iteration before
      real(dp) :: limit = 0.0_dp                 !! residual at which a solution is checked
      real(dp) :: least = 0.0_dp                 !! least gap, m
      real(dp) :: missing = 0.0_dp               !! prescribed force minus the sum of P, free mode, Pa
      real(dp) :: old_missing = 0.0_dp           !! in the iteration before
      real(dp) :: psi_r = 0.0_dp                 !! psi.r of the padding, Pa
      real(dp) :: old_rz = 0.0_dp                !! r.z of the iteration before; 0: the next direction is z alone
      real(dp) :: lift = 0.0_dp                  !! d of the level
      real(dp) :: slope = 0.0_dp                 !! r.d
      real(dp) :: bend = 0.0_dp                  !! d.e'' d
      real(dp) :: farthest = 0.0_dp              !! least multiple of d that changes some g + z_0 by its own value
      real(dp) :: pending = 0.0_dp               !! multiple of work%image that must still be added to the traction
      logical :: correction_pending = .false.    !! so must the product of the correction in work%change
      logical :: length_limited = .false.        !! an iteration in the model had the greatest length allowed
      logical :: has_last = .false.              !! is there a step before?
      real(dp) :: last_lift = 0.0_dp             !! its part of the level
      real(dp) :: last_form = 0.0_dp             !! its form with Q B
   end type adhesion_iteration_type

end module adhesion_work
