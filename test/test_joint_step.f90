!> Tests of the solver that solves a step with friction all at once: GMRES, and the states of a cell. Runs
!> with such steps are in python/tests/test_hard_steps.py and test_constant_shear.py.
module test_joint_step
   use adhesion_potential, only : new_adhesion_potential
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use friction_law, only : new_friction_law
   use gmres, only : cell_vector_type, gmres_type
   use joint_cells, only : cell_rules_type
   implicit none
   private

   public :: run_joint_step

contains

   subroutine run_joint_step()
      call begin_suite('joint_step')
      if (selected('gmres_solves_a_system')) call gmres_solves_a_system()
      if (selected('states_join_without_a_jump')) call states_join_without_a_jump()
   end subroutine run_joint_step

   !> A matrix without symmetry with an additional unknown, against its known solution.
   subroutine gmres_solves_a_system()
      integer, parameter :: cells = 7, n = 3*cells + 1
      type(gmres_type) :: krylov
      type(cell_vector_type) :: v
      real(dp) :: a(n, n), x(n), b(n)
      integer :: i, j

      do j = 1, n
         do i = 1, n
            a(i, j) = 0.3_dp*sin(1.7_dp*i*j) + merge(4.0_dp + 0.5_dp*i, 0.0_dp, i == j)
         end do
         x(j) = cos(0.9_dp*j)
      end do
      b = matmul(a, x)
      v%cells = reshape(b(:n - 1), [3, cells])
      v%beside = b(n)
      call krylov%begin(v, [1, 4, 4, cells + 1], n, 1.0e-6_dp)
      do while (krylov%unsolved())
         call krylov%next(v)
         b = matmul(a, [reshape(v%cells, [n - 1]), v%beside])
         v%cells = reshape(b(:n - 1), [3, cells])
         v%beside = b(n)
         call krylov%take(v)
      end do
      call check_order(krylov%left, '<=', 1.0e-6_dp, 'residual')
      call krylov%solution(v)
      call check_close(maxval(abs([reshape(v%cells, [n - 1]), v%beside] - x)), 0.0_dp, 3.0e-6_dp, 'solution')
   end subroutine gmres_solves_a_system

   !> Gap, pressure and share are continuous from open to pressed cells. A partly sheared cell slips at its
   !> share of the strength.
   subroutine states_join_without_a_jump()
      real(dp), parameter :: width = 2.0e-6_dp, little = 1.0e-16_dp
      type(cell_rules_type) :: rules
      type(error_type), allocatable :: error
      real(dp) :: left(2), ends(2)

      call new_adhesion_potential(rules%potential, 'exponential', 0.1_dp, 1.0e-6_dp, error)
      rules%law = new_friction_law('constant_shear', 0.0_dp, 3.0e5_dp, 0.0_dp, .false., .true.)
      rules%soft = 1.0e-12_dp
      rules%soft_along = 1.0e-12_dp
      rules%attraction = 1.0e5_dp
      ends = rules%pressure_of(width, [-little, little])
      call check_close(ends(1), ends(2), 1.0e-2_dp, 'pressure where the gap closes')
      ends = rules%pressure_of(width, width + [-little, little])
      call check_close(ends(1), ends(2), 1.0e-2_dp, 'pressure where contact begins')
      call check_close(rules%pressure_of(width, width + 1.0e-6_dp), 1.0e6_dp - 1.0e5_dp, 1.0e-6_dp, 'pressed')
      call check_close(rules%number_of(width, .true., 9.0e5_dp, 0.0_dp), width + 1.0e-6_dp, 1.0e-18_dp, 'back')
      ends = rules%share_of(width, [0.25_dp*width, 2.0_dp*width])
      call check_close(maxval(abs(ends - [0.25_dp, 1.0_dp])), 0.0_dp, 1.0e-12_dp, 'shares')
      left = rules%traction_error(0.25_dp, 0.0_dp, [0.0_dp, 0.0_dp], [1.0e-6_dp, 0.0_dp], [0.75e5_dp, 0.0_dp])
      call check_close(norm2(left), 0.0_dp, 1.0e-6_dp, 'slips at its share of the strength')
      call check_that(rules%slips(0.25_dp, 0.0_dp, [0.0_dp, 0.0_dp], [0.75e5_dp, 0.0_dp]), 'it counts as slip')
      call check_that(.not. rules%slips(0.5_dp, 0.0_dp, [0.0_dp, 0.0_dp], [0.75e5_dp, 0.0_dp]), 'it counts as stick')
   end subroutine states_join_without_a_jump

end module test_joint_step
