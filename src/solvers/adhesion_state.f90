!> The problem of adhesive contact and its equations.
!>
!> The energy of a state with the gap g >= 0, divided by the area of a cell, is
!>     E(g) = Q/2 (H+g).B(H+g) - P_h.g + sum e(g) + p sum g,      B = A^-1 for a shear modulus of 1
!> where Q is the modulus of the time step, P_h the traction of the past, and p the mean pressure. For an elastic
!> material Q is the shear modulus and P_h = 0. The gradient is G = Q B(H+g) - P_h + e'(g) + p. A solution has G = 0
!> where g > 0, and G >= 0 where g = 0. The contact pressure, attraction included, is
!> P = p + Q B(H+g) - P_h = G - e'(g).
!>
!> Module `adhesion_patch` contains the differences between periodic and free grids, and module `adhesion_steps`
!> chooses the length of a step.
module adhesion_state
   use adhesion_potential, only : adhesion_potential_type, adhesive_slope, potential_none
   use contact_rule, only : is_closed
   use normal_state, only : control_approach, control_pressure
   use asperity_precision, only : dp
   use solver_result, only : reason_converged, reason_iterations, reason_undetermined
   implicit none
   private

   public :: adhesion_problem_type, close_gaps, control_approach, control_pressure, reason_converged, reason_iterations, &
      reason_undetermined, resolved_traction, traction_scale

   character(*), parameter, public :: reason_detached = 'detached'
   character(*), parameter, public :: reason_stalled = 'the energy can be lowered no further'

   !> An adhesive contact problem without its fields.
   type :: adhesion_problem_type
      type(adhesion_potential_type) :: potential
      real(dp) :: modulus = 1.0_dp          !! shear modulus of the step (Q of module zener), Pa
      integer :: control = control_pressure
      !> Mean pressure, Pa, negative if the solid is pulled (free mode: force/(lx ly)); or, if the approach is
      !> prescribed, the level U - H where the gap is zero, m: the displacement minus the highest point of H.
      real(dp) :: target = 0.0_dp
      real(dp) :: tolerance = 1e-6_dp       !! of the natural residual max|min(g/z_0, G z_0/gamma_0)|
      real(dp) :: accepted = 0.0_dp         !! if larger: what suffices where the tolerance cannot be reached
      integer :: max_iterations = 2000
      logical :: full_contact = .false.     !! start from full contact, not from the given state
      !> Highest point of H, m, set by module adhesion_cg. The methods measure heights and levels from it, so that
      !> a map far from zero costs no digits.
      real(dp) :: datum = 0.0_dp
   end type adhesion_problem_type

contains

   !> Set the gaps of a solution to exactly 0 in the cells in contact (module `contact_rule`).
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

   !> The least unit of traction whose product with the tolerance is still above the round-off of the tractions, Pa. This
   !> round-off is that of the largest traction and of the product of the stiffness with the heights.
   pure function resolved_traction(problem, largest, stiffness, spread) result(scale)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: largest              !! traction, Pa
      real(dp), intent(in) :: stiffness            !! B at the Nyquist wave number, for G = 1
      real(dp), intent(in) :: spread               !! of the heights, m
      real(dp) :: scale

      scale = epsilon(1.0_dp)*(20.0_dp*largest + 4.0_dp*problem%modulus*stiffness*spread) &
         /problem%tolerance
   end function resolved_traction

   !> The unit in which tractions of the residual are measured: gamma_0/z_0, or `other` without adhesion.
   pure function traction_scale(potential, other) result(scale)
      type(adhesion_potential_type), intent(in) :: potential
      real(dp), intent(in) :: other         !! Pa
      real(dp) :: scale

      scale = other
      if (potential%kind == potential_none) return
      if (potential%energy > 0.0_dp) scale = potential%energy/potential%range
   end function traction_scale

end module adhesion_state
