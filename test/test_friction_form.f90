!> Tests of the prediction of d.A d that determines the length of a tangential step.
module test_friction_form
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use check, only : begin_suite, check_close, check_no_error, check_that, selected
   use fft_conv, only : columns_form, convolution_type, new_convolution
   use friction_form, only : friction_form_type, new_friction_form
   use kernels, only : tangential_half_space
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   implicit none
   private

   public :: run_friction_form

   !> A grid with its operator and the prediction for it.
   type :: case_type
      type(grid_type) :: grid
      type(convolution_type) :: operator
      type(friction_form_type) :: form
   end type case_type

contains

   subroutine run_friction_form()
      call begin_suite('friction_form')
      if (selected('prediction_is_near_the_exact_form')) call prediction_is_near_the_exact_form()
      if (selected('uniform_direction_is_exact')) call uniform_direction_is_exact()
   end subroutine run_friction_form

   !> On periodic and free grids, with square and oblong cells, with numbers of cells that are and are not multiples of
   !> those of the coarse grid: for directions within random patches of contact, the prediction is good for white noise and
   !> long waves, and never far from the exact form. Waves of about the size of a coarse cell are the worst. With few cells
   !> it is exact.
   subroutine prediction_is_near_the_exact_form()
      integer, parameter :: cells(2, 6) = reshape([64, 48, 50, 37, 40, 40, 80, 24, 32, 20, 5, 3], [2, 6])
      real(dp), parameter :: ratio(6) = [1.0_dp, 0.4_dp, 1.0_dp, 2.0_dp, 1.0_dp, 1.0_dp]      ! dy/dx
      integer, parameter :: boundary(6) = [boundary_periodic, boundary_periodic, boundary_free, boundary_free, &
         boundary_periodic, boundary_periodic]
      real(dp), parameter :: waves(4) = [0.0_dp, 4.0_dp, 9.0_dp, 30.0_dp]    ! cells; 0: white noise
      type(case_type) :: case
      real(dp), allocatable :: d(:, :, :)
      real(dp) :: ratios(5, size(waves))
      integer :: k, m, n

      do k = 1, size(ratio)
         call make(case, cells(1, k), cells(2, k), ratio(k), boundary(k), merge(0.3_dp, 0.0_dp, k == 2))
         do m = 1, size(waves)
            do n = 1, size(ratios, 1)
               call draw(cells(1, k), cells(2, k), waves(m), d)
               ratios(n, m) = predicted(case, d)/exact(case, d)
            end do
         end do
         if (product(cells(:, k)) > 1024) then
            call check_that(all(abs(ratios(:, 1) - 1.0_dp) < 0.12_dp), 'white noise')
            call check_that(all(abs(ratios(:, size(waves)) - 1.0_dp) < 0.12_dp), 'long waves')
            call check_that(all(ratios > 0.5_dp .and. ratios < 1.3_dp), 'any waves')
         else
            call check_that(all(abs(ratios - 1.0_dp) < 1.0e-10_dp), 'few cells: exact')
         end if
         call case%operator%destroy()
         call case%form%destroy()
      end do
   end subroutine prediction_is_near_the_exact_form

   !> The mean mode of a block is that of its operator, also if the caller has changed it: the form of a uniform
   !> direction is exact.
   subroutine uniform_direction_is_exact()
      type(case_type) :: case
      real(dp), allocatable :: d(:, :, :)

      call make(case, 48, 30, 1.0_dp, boundary_periodic, 5.0_dp)
      allocate (d(48, 30, 2), source=1.0_dp)
      call check_close(predicted(case, d), exact(case, d), 1.0e-12_dp, 'a block at rest')
      call case%operator%symbols%set_mean_mode(1, 0.0_dp)
      call check_close(predicted(case, d), exact(case, d), 1.0e-12_dp, 'without the mean mode along x')
      call case%operator%destroy()
      call case%form%destroy()
   end subroutine uniform_direction_is_exact

   !> Make an operator and its prediction.
   subroutine make(case, nx, ny, ratio, boundary, thickness)
      type(case_type), intent(out) :: case
      integer, intent(in) :: nx, ny, boundary
      real(dp), intent(in) :: ratio, thickness
      type(error_type), allocatable :: error

      case%grid = new_grid(nx, ny, 1.0_dp, ratio*ny/nx, boundary)
      call new_convolution(case%operator, case%grid, tangential_half_space(0.4_dp, thickness), error)
      call check_no_error(error, 'operator')
      call new_friction_form(case%form, case%grid, case%operator%kernel, &
         case%operator%symbols%self_compliance(with_mean=boundary == boundary_free), error)
      call check_no_error(error, 'prediction')
   end subroutine make

   !> Draw a direction that is not zero in a disk of random place and size: noise, or a wave of random direction.
   subroutine draw(nx, ny, wave, d)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: wave               !! length, cells; 0: noise
      real(dp), allocatable, intent(out) :: d(:, :, :)
      real(dp) :: chance(5), x, y
      integer :: i, j

      allocate (d(nx, ny, 2))
      call random_number(d)
      d = d - 0.5_dp
      call random_number(chance)
      do j = 1, ny
         do i = 1, nx
            x = i - 0.5_dp - chance(1)*nx
            y = j - 0.5_dp - chance(2)*ny
            if (wave > 0.0_dp) d(i, j, :) = cos(2.0_dp*pi*(x*cos(2.0_dp*pi*chance(4)) + y*sin(2.0_dp*pi*chance(4)))/wave &
               + [0.0_dp, 2.0_dp*pi*chance(5)])
            if (hypot(x, y) > 1.0_dp + (0.2_dp + 0.5_dp*chance(3))*max(nx, ny)) d(i, j, :) = 0.0_dp
         end do
      end do
   end subroutine draw

   !> The predicted form of a direction.
   function predicted(case, d) result(form)
      type(case_type), intent(inout) :: case
      real(dp), intent(in) :: d(:, :, :)         !! [nx, ny, 2]
      real(dp) :: form
      integer :: c, j

      call case%form%set_mean_compliance(case%operator)
      do j = 1, size(d, 2)
         do c = 1, 2
            call case%form%take_row(c, j, d(:, j, c))
         end do
      end do
      call case%form%predict(sum(d**2), form)
   end function predicted

   !> The exact form of a direction.
   function exact(case, d) result(form)
      type(case_type), intent(inout) :: case
      real(dp), intent(in) :: d(:, :, :)         !! [nx, ny, 2]
      real(dp) :: form
      integer :: c, j

      do j = 1, size(d, 2)
         do c = 1, 2
            call case%operator%forward_row(c, j, d(:, j, c))
         end do
      end do
      call case%operator%columns(columns_form, form)
   end function exact

end module test_friction_form
