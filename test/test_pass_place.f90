!> Tests of where the passes of a coupled step read the road, and of the watch over them.
module test_pass_place
   use check, only : begin_suite, check_close, check_that
   use pass_place, only : carry, pass_secant_type
   use pass_watch, only : pass_watch_type, watch_passes
   use precision, only : dp
   use simulation_runs, only : nl, record_type, run_case
   implicit none
   private

   public :: run_pass_place

contains

   subroutine run_pass_place()
      call begin_suite('pass_place')
      call test_carry()
      call test_secant()
      call test_watch()
      call test_thick_block()
   end subroutine run_pass_place

   !> Whole cells exactly, parts bilinearly, round a periodic map and on to the rim of a free one.
   subroutine test_carry()
      integer, parameter :: nx = 9, ny = 5
      real(dp), parameter :: cell(2) = [0.5_dp, 0.3_dp]
      real(dp) :: field(nx, ny), moved(nx, ny), expected(nx, ny)
      integer :: i, j

      do j = 1, ny
         do i = 1, nx
            field(i, j) = sin(1.3_dp*i) + cos(2.1_dp*i*j)
         end do
      end do
      call carry(field, [2, -1]*cell, cell, .true., moved)
      expected = cshift(cshift(field, 2, dim=1), -1, dim=2)
      call check_close(maxval(abs(moved - expected)), 0.0_dp, 1.0e-14_dp, 'whole cells, periodic')
      call carry(field, [-0.25_dp, 0.0_dp]*cell, cell, .true., moved)
      expected = 0.75_dp*field + 0.25_dp*cshift(field, -1, dim=1)
      call check_close(maxval(abs(moved - expected)), 0.0_dp, 1.0e-14_dp, 'a part of a cell')
      call carry(field, [1.5_dp, 0.0_dp]*cell, cell, .false., moved)
      call check_close(moved(3, 2), 0.5_dp*(field(4, 2) + field(5, 2)), 1.0e-14_dp, 'free, inside')
      call check_close(moved(nx, 2), field(nx, 2), 1.0e-14_dp, 'free, at the rim')
   end subroutine test_carry

   !> Two linear maps that g(z) alone does not settle on, coupled across the axes.
   subroutine test_secant()
      type(pass_secant_type) :: secant
      real(dp), parameter :: answer(2) = [0.7_dp, -0.3_dp]
      real(dp), parameter :: g(2, 2) = reshape([-2.0_dp, 0.3_dp, -0.4_dp, -0.6_dp], [2, 2])
      real(dp) :: z(2), r(2), c(2), first
      integer :: pass

      z = 0.0_dp
      first = norm2(answer)
      do pass = 1, 12
         r = answer + matmul(g, z - answer) - z
         call secant%next(r, c)
         if (pass <= 2) call check_close(norm2(c), 0.0_dp, 0.0_dp, 'nothing is known yet')
         z = z + r + c
      end do
      call check_that(norm2(z - answer) < 1.0e-6_dp*first, 'the secant finds the place')
      call secant%next([0.0_dp, 0.0_dp], c)
      call check_close(norm2(c), 0.0_dp, 0.0_dp, 'a place that is found stays')
   end subroutine test_secant

   !> What is reported, when, and once.
   subroutine test_watch()
      type(pass_watch_type) :: watch
      character(:), allocatable :: message
      real(dp) :: falling(10), stays(10)
      integer :: i

      falling = [(0.3_dp**i, i = 1, 10)]
      stays = [(max(0.3_dp**i, 4.0e-3_dp), i = 1, 10)]
      call watch_passes(watch, 10, falling, 1.0e-6_dp, .false., message)
      call check_that(message == '', 'passes that settle')
      call watch_passes(watch, 2, [0.1_dp, 0.09_dp], 1.0e-6_dp, .false., message)
      call check_that(message == '', 'two passes need not settle')
      call watch_passes(watch, 20, stays, 1.0e-6_dp, .false., message)
      call check_that(message == '', 'passes were left')
      call watch_passes(watch, 10, stays, 1.0e-6_dp, .true., message)
      call check_that(index(message, '0.004') > 0 .and. index(message, 'coulomb_orowan') > 0, &
         'the measure and what helps')
      call watch_passes(watch, 10, stays, 1.0e-6_dp, .true., message)
      call check_that(message == '', 'said once')
      watch = pass_watch_type()
      do i = 1, 3
         call watch_passes(watch, 4, [0.2_dp, 0.1_dp, 0.1_dp, 0.1_dp], 1.0e-6_dp, .false., message)
         call check_that((message /= '') .eqv. i == 3, 'few passes: not for a step or two')
      end do
   end subroutine test_watch

   !> A steep wave under a massless block of forty wavelengths, once sheared: with the strains read
   !> one pass behind the contact no number of passes ended its jumps (mean change of the speed above
   !> 1 m/s with 2 passes as with 30).
   subroutine test_thick_block()
      type(record_type) :: record
      real(dp) :: swing
      integer :: n

      call run_case('&grid nx = 192, ny = 1, lx = 1e-3, ly = 1e-3 /'//nl// &
         '&surface shape = ''sine'', amplitude = 3e-5, wavelength = 0.5e-3 /'//nl// &
         '&material shear_modulus = 1e6, thickness = 20e-3 /'//nl// &
         '&friction law = ''coulomb'', coefficient = 0.5 /'//nl// &
         '&phase pressure = 0.15e6 /'//nl// &
         '&phase velocity_x = 1, duration = 1.6e-3, steps = 40 /'//nl// &
         '&phase velocity_x = 1, duration = 0.3125e-3, steps = 60 /'//nl// &
         '&solver passes = 4 /', 'thick block', record)
      n = size(record%rows)
      associate (speed => record%rows(n - 30:)%sliding_speed)
         swing = sum(abs(speed(2:) - speed(:size(speed) - 1)))/(size(speed) - 1)
         call check_that(swing < 1.0e-3_dp, 'a thick block slides')
         call check_close(sum(speed)/size(speed), 1.0_dp, 1.0e-3_dp, 'its mean speed')
      end associate
   end subroutine test_thick_block

end module test_pass_place
