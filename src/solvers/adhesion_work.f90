!> The work fields and the state of the iteration of the fast method for adhesive contact (module
!> `adhesion_cg_fast`).
module adhesion_work
   use adhesion_model, only : adhesion_model_type
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: adhesion_iteration_type, adhesion_work_type

   ! The source of the traction. Only a fresh one proves a solution.
   integer, parameter, public :: updated = 1    !! it was updated with the steps: it has gathered round-off
   integer, parameter, public :: fresh = 2      !! it is a product with B

   !> The operators and work fields of the method.
   type :: adhesion_work_type
      type(adhesion_patch_type) :: patch
      type(adhesion_model_type) :: model
      !> What is exchanged with M: G, of which `measure` makes the input of M, and then z = M r.
      real(dp), allocatable :: exchange(:, :)
      real(dp), allocatable :: residual(:, :)        !! r
      real(dp), allocatable :: curvature(:, :)       !! e'' at the gap that was measured last, on the patch
      real(dp), allocatable :: old(:, :)             !! r of the iteration before
      real(dp), allocatable :: direction(:, :)       !! d
      ! The contact in the local model of its energy:
      real(dp), pointer, contiguous :: model_state(:, :) => null()
      real(dp), pointer, contiguous :: model_traction(:, :) => null()
      real(dp), allocatable :: change(:, :)          !! of the displacement, with the foreign rows of the model
      logical, allocatable :: bumpy(:)               !! rows of change that are not zero, with the foreign ones
      real(dp), allocatable :: image(:, :)           !! its product
      real(dp), allocatable :: last_step(:, :)       !! the step before (module adhesion_plane)
      real(dp), allocatable :: last_image(:, :)      !! its product
      real(dp) :: scaling = 0.0_dp                   !! k of the Gauss potential, Pa/m; 0: none
   end type adhesion_work_type

   !> A contact that is being solved, and the state of its iteration.
   type, extends(adhesion_contact_type) :: adhesion_iteration_type
      integer :: source = fresh                  !! of the traction
      integer :: updates = 0                     !! of the traction since it was fresh
      integer :: failures = 0                    !! successive directions without a step
      integer :: caution = 0                     !! how much shorter steps are, after failures
      real(dp) :: residual = 0.0_dp              !! natural residual of the present traction
      real(dp) :: limit = 0.0_dp                 !! residual at which a solution is checked
      real(dp) :: least = 0.0_dp                 !! least gap, m
      real(dp) :: missing = 0.0_dp               !! prescribed force less sum of P, free mode, Pa
      real(dp) :: old_missing = 0.0_dp           !! in the iteration before
      real(dp) :: psi_r = 0.0_dp                 !! psi.r of the padding, Pa
      real(dp) :: old_rz = 0.0_dp                !! r.z of the iteration before; 0: directions start again
      real(dp) :: lift = 0.0_dp                  !! d of the level
      real(dp) :: slope = 0.0_dp                 !! r.d
      real(dp) :: bend = 0.0_dp                  !! d.e'' d
      real(dp) :: farthest = 0.0_dp              !! multiple of d at which a gap plus z_0 would be gone
      real(dp) :: pending = 0.0_dp               !! multiple of work%image that the traction lacks
      logical :: bumped = .false.                !! it lacks the product of work%change, too
      logical :: held = .false.                  !! an iteration in the model was as long as is allowed
      logical :: has_last = .false.              !! is there a step before?
      real(dp) :: last_lift = 0.0_dp             !! its part of the level
      real(dp) :: last_form = 0.0_dp             !! its form with Q B
   end type adhesion_iteration_type

end module adhesion_work
