!> Tests of the kernels: the definition of a solid, and how to add a new one.
module test_kernels
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use fft_conv, only : convolution_type, new_convolution, new_inverse_convolution
   use kernels, only : kernel_type, normal_half_space, tangential_half_space
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_state, only : control_pressure, normal_problem_type
   use projection, only : project_simplex
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: run_kernels

   real(dp), parameter :: bedding = 40.0_dp          !! stiffness of the springs: traction over displacement, Pa/m

contains

   subroutine run_kernels()
      call begin_suite('kernels')
      if (selected('a_winkler_foundation')) call a_winkler_foundation()
      if (selected('contact_on_a_winkler_foundation')) call contact_on_a_winkler_foundation()
      if (selected('inverses_of_the_half_space')) call inverses_of_the_half_space()
      if (selected('extreme_stiffness_of_a_grid')) call extreme_stiffness_of_a_grid()
      if (selected('mean_mode_of_an_operator')) call mean_mode_of_an_operator()
   end subroutine run_kernels

   !> A solid of independent springs: every cell moves by its own traction. A solid of this kind needs no more
   !> than this subroutine.
   pure subroutine spring_wave(self, qx, qy, a)
      class(kernel_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: qx(:)
      real(dp), intent(in) :: qy
      real(dp), contiguous, intent(out) :: a(:, :)

      a = 0.0_dp*qy                                   ! all waves have the same stiffness
      a(:size(qx), :self%components) = 1.0_dp/bedding
   end subroutine spring_wave

   !> The kernel of the springs. Their mean displacement is determined like any other.
   function winkler() result(kernel)
      type(kernel_type) :: kernel

      kernel%wave => spring_wave
      kernel%mean_mode = 1.0_dp/bedding
   end function winkler

   !> On springs the displacement is the traction over the stiffness, cell by cell.
   subroutine a_winkler_foundation()
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp) :: p(12, 7), u(12, 7)

      call new_convolution(operator, new_grid(12, 7, 3.0_dp, 1.0_dp, boundary_periodic), winkler(), error)
      call check_no_error(error, 'an operator of springs')
      call random_number(p)
      call operator%apply(p, u)
      call check_close(maxval(abs(u - p/bedding)), 0.0_dp, 1e-16_dp, 'springs move cell by cell')
      call operator%destroy()
      call new_convolution(operator, new_grid(12, 7, 3.0_dp, 1.0_dp, boundary_free), winkler(), error)
      call check_error(error, 'periodic boundaries only', 'a solid without a cell function')
   end subroutine a_winkler_foundation

   !> Contact on springs: the pressure is the stiffness times the depth below one level. It is therefore the
   !> projection of stiffness times height on the pressures with the given mean.
   subroutine contact_on_a_winkler_foundation()
      integer, parameter :: nx = 24, ny = 20
      real(dp), parameter :: modulus = 3.0_dp
      type(normal_solver_type) :: solver
      type(normal_problem_type) :: problem
      type(solver_result_type) :: outcome
      type(error_type), allocatable :: error
      type(grid_type) :: grid
      real(dp) :: height(nx, ny), pressure(nx, ny), gap(nx, ny), exact(nx, ny), level
      integer :: i, j

      grid = new_grid(nx, ny, 2.0_dp, 1.0_dp, boundary_periodic)
      do j = 1, ny
         do i = 1, nx
            height(i, j) = 0.1_dp*cos(2.0_dp*pi*i/nx) + 0.05_dp*cos(2.0_dp*pi*(i - 2.0_dp*j)/ny)
         end do
      end do
      problem%control = control_pressure
      problem%modulus = modulus
      problem%target = 1.5_dp
      problem%tolerance = 1e-10_dp
      exact = modulus*bedding*height
      call project_simplex(exact, problem%target*nx*ny)
      call new_normal_solver(solver, grid, winkler(), error)
      call check_no_error(error, 'a solver for springs')
      pressure = 0.0_dp
      call solver%solve(problem, height, pressure, gap, level, outcome)
      call check_that(outcome%converged, 'springs: '//outcome%reason)
      call check_close(maxval(abs(pressure - exact)), 0.0_dp, 1e-7_dp, 'pressure on springs')
      call check_order(count(exact > 0.0_dp), '<', nx*ny, 'the contact on springs is partial')
      call solver%destroy()
   end subroutine contact_on_a_winkler_foundation

   !> A displacement with zero mean is unchanged by the inverse and the operator.
   subroutine inverses_of_the_half_space()
      type(convolution_type) :: operator, inverse
      type(grid_type) :: grid
      type(error_type), allocatable :: error
      real(dp) :: p(9, 15, 2), u(9, 15, 2), back(9, 15, 2)
      integer :: c

      grid = new_grid(9, 15, 1.3_dp, 2.0_dp, boundary_periodic)
      call random_number(p)
      call new_convolution(operator, grid, normal_half_space(0.3_dp), error)
      call new_inverse_convolution(inverse, grid, normal_half_space(0.3_dp), error)
      call operator%apply(p(:, :, 1), u(:, :, 1))
      call inverse%apply(u(:, :, 1), back(:, :, 1))
      call check_close(maxval(abs(back(:, :, 1) - p(:, :, 1) + sum(p(:, :, 1))/135.0_dp)), 0.0_dp, &
         1e-14_dp, 'normal: pressures but for their mean')
      call operator%destroy()
      call inverse%destroy()

      call new_convolution(operator, grid, tangential_half_space(0.3_dp, 0.7_dp), error)
      call new_inverse_convolution(inverse, grid, tangential_half_space(0.3_dp, 0.7_dp), error)
      call operator%apply_vector(p(:, :, 1), p(:, :, 2), u(:, :, 1), u(:, :, 2))
      call inverse%apply_vector(u(:, :, 1), u(:, :, 2), back(:, :, 1), back(:, :, 2))
      call check_close(maxval(abs(back - p)), 0.0_dp, 1e-14_dp, 'tangential: tractions with their mean')
      do c = 1, 2
         call check_close(sum(u(:, :, c)), 0.7_dp*sum(p(:, :, c)), 1e-13_dp, 'mean shear of a block')
      end do
      call operator%destroy()
      call inverse%destroy()
   end subroutine inverses_of_the_half_space

   !> q/(1 - nu) of the longest and of the shortest wave.
   subroutine extreme_stiffness_of_a_grid()
      type(kernel_type) :: kernel
      type(grid_type) :: grid

      kernel = normal_half_space(0.5_dp)
      grid = new_grid(64, 16, 4.0_dp, 2.0_dp, boundary_periodic)
      call check_close(kernel%least_stiffness(grid), pi, 1e-14_dp, 'least stiffness')
      call check_close(kernel%largest_stiffness(grid), 2.0_dp*pi/sqrt(1.0_dp/128.0_dp), 1e-12_dp, &
         'largest stiffness')
      grid = new_grid(64, 1, 1.0_dp, 2.0_dp, boundary_periodic)
      call check_close(kernel%least_stiffness(grid), 4.0_dp*pi, 1e-14_dp, 'least stiffness of a line')
      call check_close(kernel%largest_stiffness(grid), 128.0_dp*pi, 1e-12_dp, 'largest stiffness of a line')
   end subroutine extreme_stiffness_of_a_grid

   !> The operator returns the mean compliance that was set when it was created or later.
   subroutine mean_mode_of_an_operator()
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp) :: ones(6, 4), none(6, 4), ux(6, 4), uy(6, 4)

      ones = 1.0_dp
      none = 0.0_dp
      call new_convolution(operator, new_grid(6, 4, 1.0_dp, 1.0_dp, boundary_periodic), &
         tangential_half_space(0.4_dp, 0.25_dp), error)
      call check_close(operator%symbols%mean_mode(1)*24.0_dp, 0.25_dp, 1e-16_dp, 'the thickness of the block')
      call operator%symbols%set_mean_compliance(0.5_dp)
      call operator%apply_vector(ones, none, ux, uy)
      call check_close(maxval(abs(ux - 0.5_dp)), 0.0_dp, 1e-15_dp, 'another mean compliance')
      call operator%symbols%set_mean_mode(1, 0.0_dp)
      call operator%apply_vector(ones, ones, ux, uy)
      call check_close(maxval(abs(ux)), 0.0_dp, 1e-15_dp, 'no mean mode along x')
      call check_close(maxval(abs(uy - 0.5_dp)), 0.0_dp, 1e-15_dp, 'the one along y stays')
      call operator%destroy()
   end subroutine mean_mode_of_an_operator

end module test_kernels
