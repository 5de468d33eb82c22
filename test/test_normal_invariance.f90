!> Tests of normal contact: changes of a problem that leave the solution unchanged, or change it in a known
!> way.
module test_normal_invariance
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use normal_fixture, only : check_threads, distance, poisson, rms, rough_problem, run_problem, &
      solution_type, unit_modulus
   use normal_state, only : control_approach, normal_problem_type
   use kernels, only : normal_half_space
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   implicit none
   private

   public :: run_normal_invariance

   !> Twice (2 sqrt(tolerance))^2, see `distance`.
   real(dp), parameter :: tolerance = 1e-9_dp
   real(dp), parameter :: bound = 8.0_dp*tolerance

contains

   subroutine run_normal_invariance()
      integer :: boundary

      call begin_suite('normal_invariance')
      do boundary = boundary_periodic, boundary_free
         if (selected('shifted_mirrored_and_transposed_agree')) &
            call shifted_mirrored_and_transposed_agree(boundary)
         if (selected('scaled_units_give_the_same_bits')) &
            call scaled_units_give_the_same_bits(boundary)
         if (selected('same_bits_on_two_threads')) call same_bits_on_two_threads(boundary)
         if (selected('fast_and_thesis_agree')) call fast_and_thesis_agree(boundary)
         if (selected('warm_starts_reach_the_same')) call warm_starts_reach_the_same(boundary)
         if (selected('past_traction_is_like_a_height')) &
            call past_traction_is_like_a_height(boundary)
      end do
   end subroutine run_normal_invariance

   !> A problem with a medium load.
   subroutine set_problem(boundary, nx, ny, grid, problem, h)
      integer, intent(in) :: boundary, nx, ny
      type(grid_type), intent(out) :: grid
      type(normal_problem_type), intent(out) :: problem
      real(dp), allocatable, intent(out) :: h(:, :)

      grid = new_grid(nx, ny, 1.0_dp, 0.8_dp, boundary)
      call rough_problem(grid, 6.0_dp, 0.005_dp, problem, h)
      problem%tolerance = tolerance
      problem%rms_height = rms(h)
   end subroutine set_problem

   !> Shifts by whole cells, reflection and transposition.
   subroutine shifted_mirrored_and_transposed_agree(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid, turned
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: d

      call set_problem(boundary, 75, 64, grid, problem, h)
      call run_problem(grid, problem, h, s)
      call check_that(s%outcome%converged, s%outcome%reason)
      if (boundary == boundary_periodic) then
         call run_problem(grid, problem, cshift(cshift(h, 13, 1), -7, 2), t)
         call distance(grid, unit_modulus, h, s%pressure, cshift(cshift(t%pressure, -13, 1), 7, 2), d)
         call check_close(d, 0.0_dp, bound, 'shifted: the pressure')
         call check_close(t%level, s%level, 1e-6_dp*rms(h), 'shifted: the level')
      end if
      call run_problem(grid, problem, h(grid%nx:1:-1, :), t)
      call distance(grid, unit_modulus, h, s%pressure, t%pressure(grid%nx:1:-1, :), d)
      call check_close(d, 0.0_dp, bound, 'mirrored: the pressure')
      call check_close(t%level, s%level, 1e-6_dp*rms(h), 'mirrored: the level')
      turned = new_grid(grid%ny, grid%nx, grid%ly, grid%lx, boundary)
      call run_problem(turned, problem, transpose(h), t)
      call distance(grid, unit_modulus, h, s%pressure, transpose(t%pressure), d)
      call check_close(d, 0.0_dp, bound, 'transposed: the pressure')
      call check_close(t%level, s%level, 1e-6_dp*rms(h), 'transposed: the level')
   end subroutine shifted_mirrored_and_transposed_agree

   !> Lengths times 4 and moduli times 8 give the same bits up to these factors.
   subroutine scaled_units_give_the_same_bits(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid, large
      type(normal_problem_type) :: problem, scaled
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      integer :: k

      call set_problem(boundary, 72, 50, grid, problem, h)
      large = new_grid(grid%nx, grid%ny, 4.0_dp*grid%lx, 4.0_dp*grid%ly, boundary)
      do k = 1, 2
         if (k == 2) then
            problem%control = control_approach
            problem%target = s%level
         end if
         call run_problem(grid, problem, h, s)
         call check_that(s%outcome%converged, s%outcome%reason)
         scaled = problem
         scaled%modulus = 8.0_dp*problem%modulus
         scaled%rms_height = 4.0_dp*problem%rms_height
         scaled%target = merge(8.0_dp, 4.0_dp, k == 1)*problem%target
         call run_problem(large, scaled, 4.0_dp*h, t)
         call check_that(t%outcome%iterations == s%outcome%iterations, 'scaled: iterations')
         call check_close(maxval(abs(t%pressure/8.0_dp - s%pressure)), 0.0_dp, &
            1e-12_dp*maxval(s%pressure), 'scaled: the pressure')
         call check_close(maxval(abs(t%gap/4.0_dp - s%gap)), 0.0_dp, 1e-12_dp*rms(h), 'scaled: the gap')
      end do
   end subroutine scaled_units_give_the_same_bits

   !> One and two threads give the same bits.
   subroutine same_bits_on_two_threads(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      real(dp), allocatable :: h(:, :)
      integer :: k

      call set_problem(boundary, 150, 131, grid, problem, h)
      do k = 1, 2
         problem%tolerance = merge(1e-9_dp, 1e-4_dp, k == 1)
         call check_threads(grid, problem, h, thesis=k == 2, mixed=.false.)
      end do
   end subroutine same_bits_on_two_threads

   !> 'fast' agrees with 'thesis', from few to many contacts.
   subroutine fast_and_thesis_agree(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :)
      real(dp) :: d
      integer :: k

      call set_problem(boundary, 81, 64, grid, problem, h)
      do k = 1, 3
         problem%target = 0.05_dp*0.1_dp**(k - 1)
         call run_problem(grid, problem, h, s)
         call run_problem(grid, problem, h, t, .true.)
         call check_that(s%outcome%converged .and. t%outcome%converged, 'both methods')
         call distance(grid, unit_modulus, h, s%pressure, t%pressure, d)
         call check_close(d, 0.0_dp, bound, 'both methods: the pressure')
         call check_close(t%level, s%level, 1e-6_dp*rms(h), 'both methods: the level')
         call check_order(s%outcome%iterations, '<', t%outcome%iterations, &
            'fast needs fewer iterations')
      end do
   end subroutine fast_and_thesis_agree

   !> Starts from the solution, from another load, and from another place.
   subroutine warm_starts_reach_the_same(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      real(dp), allocatable :: h(:, :), u(:, :)
      real(dp) :: d
      integer :: k

      call set_problem(boundary, 81, 64, grid, problem, h)
      call run_problem(grid, problem, h, s)
      call run_problem(grid, problem, h, t, start=s%pressure)
      call check_that(t%outcome%iterations == 0 .and. t%outcome%converged, 'from the solution: at once')
      call check_that(all(abs(s%pressure - t%pressure) <= 0.0_dp), 'from the solution: untouched', &
         [maxval(abs(s%pressure - t%pressure))])
      do k = 1, 3
         if (k == 1) call run_problem(grid, problem, h, t, start=1.001_dp*s%pressure)
         if (k == 2) call run_problem(grid, problem, h, t, start=cshift(s%pressure, 1, 1) - 1e-3_dp)
         if (k == 3) call run_problem(grid, problem, h, t, start=0.0_dp*s%pressure)
         call check_that(t%outcome%converged, 'warm: '//t%outcome%reason)
         call distance(grid, unit_modulus, h, s%pressure, t%pressure, d)
         call check_close(d, 0.0_dp, bound, 'warm: the pressure')
         if (k == 1) call check_order(t%outcome%iterations, '<=', 1, 'scaled to the load')
      end do
      problem%target = 1.001_dp*problem%target
      u = s%pressure
      call run_problem(grid, problem, h, s)
      call run_problem(grid, problem, h, t, start=u)
      call distance(grid, unit_modulus, h, s%pressure, t%pressure, d)
      call check_close(d, 0.0_dp, bound, 'a little more load: the pressure')
      call check_order(t%outcome%iterations, '<', s%outcome%iterations, &
         'a little more load: fewer iterations')
   end subroutine warm_starts_reach_the_same

   !> A traction of the past P_h is equivalent to a change A P_h/Q of the height.
   subroutine past_traction_is_like_a_height(boundary)
      integer, intent(in) :: boundary
      type(grid_type) :: grid
      type(normal_problem_type) :: problem
      type(solution_type) :: s, t
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      real(dp), allocatable :: h(:, :), past(:, :), u(:, :)
      real(dp) :: d
      integer :: i, j, k
      logical :: thesis

      call set_problem(boundary, 60, 75, grid, problem, h)
      allocate (past(60, 75), u(60, 75))
      do j = 1, 75
         do i = 1, 60
            past(i, j) = 0.01_dp*sin(0.31_dp*i + 0.17_dp*j) - 0.003_dp
         end do
      end do
      call new_convolution(operator, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'an operator')
      call operator%apply(past, u)
      call operator%destroy()
      do k = 1, 3
         thesis = k == 2
         if (k == 3) then
            problem%control = control_approach
            problem%target = s%level
         end if
         call run_problem(grid, problem, h, s, thesis, past=past)
         call run_problem(grid, problem, h - u/unit_modulus, t)
         call check_that(s%outcome%converged, 'past: '//s%outcome%reason)
         call distance(grid, unit_modulus, h, s%pressure, t%pressure, d)
         ! The bound is for a fixed load. If the approach is prescribed the load is free, within the same
         ! energy.
         call check_close(d, 0.0_dp, bound, 'past: the pressure')
         call check_close(s%level, t%level, 1e-6_dp*rms(h), 'past: the level')
      end do
   end subroutine past_traction_is_like_a_height

end module test_normal_invariance
