!> The problem of adhesive contact, its equations, and the interface of its methods.
!>
!> The energy of a state with the gap g >= 0 (equations for one cell area; modulus Q, traction of the
!> past P_h of a viscoelastic material, mean pressure p; elastic: Q = G and P_h = 0)
!>     E(g) = Q/2 (H+g).B(H+g) - P_h.g + sum e(g) + p sum g,      B = A^-1 for G = 1
!> has the gradient G = Q B(H+g) - P_h + e'(g) + p; a solution has G = 0 where g > 0 and G >= 0 where
!> g = 0. The contact pressure, attraction included, is P = p + Q B(H+g) - P_h = G - e'(g).
!>
!> Module `adhesion_patch` contains the differences between periodic and free grids, and module `adhesion_steps`
!> chooses the length of a step.
module adhesion_state
   use adhesion_potential, only : adhesion_potential_type, adhesive_curvature, adhesive_slope, &
      potential_none
   use contact_rule, only : is_closed
   use normal_state, only : control_approach, control_pressure
   use asperity_precision, only : dp
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_method_type, adhesion_problem_type, close_gaps, control_approach, &
      control_pressure, diagonal_scaling, resolved_traction, traction_scale

   character(*), parameter, public :: reason_converged = 'converged'
   character(*), parameter, public :: reason_detached = 'detached'
   character(*), parameter, public :: reason_limit = 'the limit of iterations was reached'
   character(*), parameter, public :: reason_stalled = 'the energy can be lowered no further'
   character(*), parameter, public :: reason_closed = &
      'full contact: the displacement leaves no gap'

   !> An adhesive contact problem without its fields.
   type :: adhesion_problem_type
      type(adhesion_potential_type) :: potential
      real(dp) :: modulus = 1.0_dp          !! shear modulus of the step (Q of module zener), Pa
      integer :: control = control_pressure
      !> Mean pressure, Pa, negative when pulled (free mode: force/(lx ly)); or the level U - H where
      !> the gap is zero, m: the prescribed displacement less the highest point of H.
      real(dp) :: target = 0.0_dp
      real(dp) :: tolerance = 1e-6_dp       !! of the natural residual max|min(g/z_0, G z_0/gamma_0)|
      integer :: max_iterations = 2000
      logical :: full_contact = .false.     !! start from full contact, not from the given state
      !> Highest point of H, m, set by module adhesion_cg: the methods count heights and levels from it,
      !> so that a map far from zero costs no digits.
      real(dp) :: datum = 0.0_dp
   end type adhesion_problem_type

   !> A method for adhesive contact with its operators and work fields, kept from step to step. A variable of this
   !> type must not be copied. To add a method, extend this type, and add its name to `new_adhesion_solver`.
   type, abstract :: adhesion_method_type
   contains
      procedure(solve_contact), deferred :: solve
      procedure(free_memory), deferred :: destroy
   end type adhesion_method_type

   abstract interface

      !> Solve an adhesive contact problem. A solve that does not converge is an outcome; the fields then hold the
      !> state with the lowest energy so far.
      subroutine solve_contact(self, problem, height, gap, pressure, level, outcome, past)
         import :: adhesion_method_type, adhesion_problem_type, dp, solver_result_type
         implicit none
         class(adhesion_method_type), intent(inout), target :: self
         type(adhesion_problem_type), intent(in) :: problem
         real(dp), intent(in), contiguous, target :: height(:, :)      !! H, [nx, rows], m
         real(dp), intent(inout), contiguous, target :: gap(:, :)      !! g, m: a start in periodic mode
         real(dp), intent(inout), contiguous, target :: pressure(:, :) !! P, Pa: a start in free mode
         real(dp), intent(inout) :: level                              !! m: a start in free mode
         type(solver_result_type), intent(out) :: outcome
         !> P_h, Pa. Not contiguous: gfortran 12 would pack it even where it is absent.
         real(dp), intent(in), target, optional :: past(:, :)
      end subroutine solve_contact

      !> Free plans and memory.
      subroutine free_memory(self)
         import :: adhesion_method_type
         implicit none
         class(adhesion_method_type), intent(inout) :: self
      end subroutine free_memory

   end interface

contains

   !> Scaling of the preconditioner at a cell, from both sides: (1 + max(e'', 0)/k)^(-1/2).
   elemental function diagonal_scaling(problem, gap, stiffness) result(scaling)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap                  !! m
      real(dp), intent(in) :: stiffness            !! k, Pa/m
      real(dp) :: scaling

      scaling = 1.0_dp/sqrt(1.0_dp &
         + max(adhesive_curvature(problem%potential, gap), 0.0_dp)/stiffness)
   end function diagonal_scaling

   !> Set to exactly 0 the gaps of a solution in the cells that the wall carries.
   subroutine close_gaps(problem, length, scale, threads, gap, pressure)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: length, scale        !! units of the natural residual, m and Pa
      integer, intent(in) :: threads
      real(dp), intent(inout) :: gap(:, :)         !! g, m
      real(dp), intent(in) :: pressure(:, :)       !! P, attraction included, Pa
      integer :: j

      !$omp parallel do default(none) shared(problem, length, scale, gap, pressure) private(j) &
      !$omp num_threads(threads)
      do j = 1, size(gap, 2)
         where (is_closed(gap(:, j)/length, (pressure(:, j) &
            + adhesive_slope(problem%potential, gap(:, j)))/scale, problem%tolerance)) gap(:, j) = 0.0_dp
      end do
   end subroutine close_gaps

   !> The least unit of traction whose product with the tolerance is still above round-off, Pa: that of
   !> the largest traction, and that of the heights times the stiffness.
   pure function resolved_traction(problem, largest, stiffness, spread) result(scale)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: largest              !! traction, Pa
      real(dp), intent(in) :: stiffness            !! B at the Nyquist wave number, for G = 1
      real(dp), intent(in) :: spread               !! of the heights, m
      real(dp) :: scale

      scale = epsilon(1.0_dp)*(20.0_dp*largest + 4.0_dp*problem%modulus*stiffness*spread) &
         /problem%tolerance
   end function resolved_traction

   !> The traction in which the residual is measured: gamma_0/z_0, or `other` without adhesion.
   pure function traction_scale(potential, other) result(scale)
      type(adhesion_potential_type), intent(in) :: potential
      real(dp), intent(in) :: other         !! Pa
      real(dp) :: scale

      scale = other
      if (potential%kind == potential_none) return
      if (potential%energy > 0.0_dp) scale = potential%energy/potential%range
   end function traction_scale

end module adhesion_state
