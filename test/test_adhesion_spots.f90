!> Tests of the windows in which the spots of an adhesive contact are relaxed.
module test_adhesion_spots
   use adhesion_fixture, only : contact_type, new_contact
   use adhesion_potential, only : adhesion_potential_type, adhesive_energy, adhesive_slope, new_adhesion_potential
   use adhesion_window, only : adhesion_window_type, new_adhesion_window, side, window_task_type
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use asperity_threads, only : set_threads
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use fft_conv, only : convolution_type, new_inverse_convolution
   use kernels, only : normal_half_space
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   implicit none
   private

   public :: run_adhesion_spots

   real(dp), parameter :: poisson = 0.3_dp
   real(dp), parameter :: modulus = 0.35_dp            !! E* = 2 modulus/(1 - poisson) = 1

contains

   subroutine run_adhesion_spots()
      call begin_suite('adhesion_spots')
      if (selected('window_has_the_stiffness_of_the_grid')) call window_has_the_stiffness_of_the_grid()
      if (selected('window_reaches_equilibrium')) then
         call window_reaches_equilibrium('exponential')
         call window_reaches_equilibrium('gauss')
      end if
      if (selected('spots_stop_where_a_slow_motion_does')) call spots_stop_where_a_slow_motion_does()
   end subroutine run_adhesion_spots

   !> If the gaps are so wide that none closes, and there is no attraction, a window moves by a step whose product with the
   !> operator of a larger grid is minus the traction, up to the effect of the mirror images.
   subroutine window_has_the_stiffness_of_the_grid()
      type(grid_type) :: grid
      type(adhesion_window_type) :: window
      type(window_task_type) :: task
      type(convolution_type) :: operator
      type(error_type), allocatable :: error
      integer, parameter :: n = 128
      real(dp) :: gap(side, side), traction(side, side), step(n, n), product(n, n), x, y
      integer :: i, j

      grid = new_grid(n, n, 0.9_dp, 1.2_dp, boundary_periodic)
      call new_adhesion_window(window, grid, normal_half_space(poisson))
      do j = 1, side
         do i = 1, side
            x = (i - 0.5_dp*side)/3.0_dp
            y = (j - 0.4_dp*side)/3.0_dp
            traction(i, j) = 0.01_dp*(1.0_dp - x**2 - y**2)*exp(-x**2 - y**2)
         end do
      end do
      task%problem%modulus = modulus
      task%goal = 1e-9_dp
      gap(:, :) = 1.0_dp
      call window%relax(task, traction, gap)

      step = 0.0_dp
      step(21:20 + side, 41:40 + side) = gap - 1.0_dp
      call new_inverse_convolution(operator, grid, normal_half_space(poisson), error)
      call check_no_error(error, 'the operator')
      call operator%apply(step, product)
      call check_close(maxval(abs(modulus*product(21:20 + side, 41:40 + side) + traction)), 0.0_dp, 0.03_dp*0.01_dp, &
         'the step balances the traction')
      call check_order(maxval(abs(step)), '>', 1e-4_dp, 'there is a step')
      call operator%destroy()
   end subroutine window_has_the_stiffness_of_the_grid

   !> A window with uneven gaps reaches equilibrium: the natural residual, computed here by a sum over all pairs of sines, is
   !> within the goal. Its energy has fallen.
   subroutine window_reaches_equilibrium(name)
      character(*), intent(in) :: name
      type(grid_type) :: grid
      type(adhesion_window_type) :: window
      type(window_task_type) :: task
      type(error_type), allocatable :: error
      real(dp), parameter :: energy = 2e-4_dp, range = 0.01_dp, length = 0.5_dp
      real(dp), dimension(side, side) :: gap, start, traction, change
      real(dp) :: before, after

      grid = new_grid(2*side, side, 2*length, 1.5_dp*length, boundary_periodic)
      call new_adhesion_window(window, grid, normal_half_space(poisson))
      call new_adhesion_potential(task%problem%potential, name, energy, range, error)
      call check_no_error(error, name)
      task%problem%modulus = modulus
      task%length = range
      task%traction = energy/range
      if (name == 'gauss') task%scaling = 0.02_dp*modulus*10.0_dp
      task%goal = 1e-3_dp
      call random_number(gap)
      gap(:, :) = max(0.06_dp*gap - 0.02_dp, 0.0_dp)
      start(:, :) = gap
      call random_number(traction)
      traction(:, :) = 0.04_dp*traction - adhesive_slope(task%problem%potential, gap) - 0.02_dp
      call window%relax(task, traction, gap)

      change = modulus*stiffness_product(gap - start, length/side, 1.5_dp*length/side)
      before = sum(adhesive_energy(task%problem%potential, start))
      after = sum(adhesive_energy(task%problem%potential, gap)) + sum((traction + 0.5_dp*change)*(gap - start))
      traction = traction + change + adhesive_slope(task%problem%potential, gap)
      call check_that(minval(gap) >= 0.0_dp .and. any(gap == 0.0_dp) .and. any(gap > 0.0_dp), name//': a partial contact')
      call check_order(maxval(abs(min(gap/range, traction*range/energy))), '<=', 1.001e-3_dp, name//': natural residual')
      call check_order(after, '<', before, name//': energy')
   end subroutine window_reaches_equilibrium

   !> The product of the stiffness with a field that vanishes outside a window and is odd at its edges, term by term.
   function stiffness_product(field, dx, dy) result(product)
      real(dp), intent(in) :: field(side, side)
      real(dp), intent(in) :: dx, dy
      real(dp) :: product(side, side), wave(side, side), along(side), across(side), q
      integer :: i, k, l

      product(:, :) = 0.0_dp
      do l = 1, side
         across = [(sin(pi*i*l/(side + 1.0_dp)), i=1, side)]
         do k = 1, side
            along = [(sin(pi*i*k/(side + 1.0_dp)), i=1, side)]
            wave = spread(along, 2, side)*spread(across, 1, side)
            q = pi/(side + 1)*hypot(k/dx, l/dy)
            product = product + q/(1.0_dp - poisson)*sum(wave*field)/sum(wave**2)*wave
         end do
      end do
   end function stiffness_product

   !> A contact with spots ends in the first state that a slow closing motion meets, with the same bits for any number of
   !> threads. The motion solves again and again with the attraction of the gap before, which is less than that of any
   !> solution below.
   subroutine spots_stop_where_a_slow_motion_does()
      type(contact_type) :: c(2), slow
      real(dp), allocatable :: past(:, :)
      real(dp), parameter :: energy = 6e-3_dp, range = 5.75e-3_dp, load = 0.03_dp
      real(dp) :: sum_before
      integer :: k

      call new_rough(slow)
      slow%problem%target = load
      slow%problem%tolerance = 3e-6_dp
      call slow%converge('without adhesion')
      do k = 1, 2
         call new_rough(c(k))
         c(k)%gap = slow%gap
         c(k)%problem%target = load
         call new_potential(c(k)%problem%potential, energy, range)
         call set_threads(k)
         call c(k)%converge('from the state without adhesion')
         call c(k)%destroy()
      end do
      call set_threads(0)
      call check_that(all(c(1)%gap == c(2)%gap), 'threads do not matter')

      do k = 1, 3000
         past = -energy/range*exp(-slow%gap/range)
         ! A traction from the past also moves the mean, which does not matter here.
         slow%problem%target = load - sum(past)/size(past)
         sum_before = sum(slow%gap)
         call slow%converge('slow', past)
         if (abs(sum_before - sum(slow%gap)) < 3e-9_dp*sum_before) exit
      end do
      call check_close(maxval(abs(c(1)%gap - slow%gap)), 0.0_dp, 1e-2_dp*range, 'the first solution on the way')
      call check_that(count(c(1)%gap == 0.0_dp) > size(past)/2, 'the attraction closes most gaps')
      ! Without windows it takes 51.
      call check_order(real(c(1)%outcome%ffts, dp), '<=', 48.0_dp, 'transforms')
      call slow%destroy()
   end subroutine spots_stop_where_a_slow_motion_does

   subroutine new_potential(potential, energy, range)
      type(adhesion_potential_type), intent(out) :: potential
      real(dp), intent(in) :: energy, range
      type(error_type), allocatable :: error

      call new_adhesion_potential(potential, 'exponential', energy, range, error)
      call check_no_error(error, 'a potential')
   end subroutine new_potential

   !> A rough contact on a grid large enough for windows, with an rms slope of 1.
   subroutine new_rough(contact)
      type(contact_type), intent(out) :: contact
      integer, parameter :: nx = 240, ny = 216, shortest = 18
      real(dp), parameter :: lx = 1.0_dp, ly = 0.9_dp
      real(dp) :: height(nx, ny), amplitude, phase, q, slopes
      integer :: i, j, k, l

      height(:, :) = 0.0_dp
      slopes = 0.0_dp
      do l = -shortest, shortest
         do k = 0, shortest
            if ((k == 0 .and. l <= 0) .or. k**2 + l**2 < 4**2 .or. k**2 + l**2 > shortest**2) cycle
            q = 2.0_dp*pi*hypot(k/lx, l/ly)
            amplitude = q**(-1.8_dp)
            slopes = slopes + 0.5_dp*(amplitude*q)**2
            phase = 2.0_dp*pi*modulo(43758.5453_dp*sin(12.9898_dp*k + 78.233_dp*l), 1.0_dp)
            do j = 1, ny
               do i = 1, nx
                  height(i, j) = height(i, j) + amplitude*cos(2.0_dp*pi*(real(k*(i - 1), dp)/nx + real(l*(j - 1), dp)/ny) &
                     + phase)
               end do
            end do
         end do
      end do
      call new_contact(contact, new_grid(nx, ny, lx, ly, boundary_periodic), poisson, modulus, height/sqrt(slopes))
   end subroutine new_rough

end module test_adhesion_spots
