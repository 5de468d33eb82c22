!> Slopes of a height map at the centres of its cells, by central differences or from its spectrum.
module surface_slopes
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use real_transform, only : destroy_real_transform, new_real_transform, real_transform_type, &
      to_space, to_spectrum
   use regular_grid, only : boundary_periodic, grid_type
   use wave_vectors, only : is_nyquist, wave_number
   implicit none
   private

   public :: central_slopes, neighbours, spectral_slopes

contains

   !> Slopes by central differences, which are of second order. On the rim of a free map the
   !> differences are one-sided.
   subroutine central_slopes(grid, height, slope_x, slope_y)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)        !! m, shape [nx, ny]
      real(dp), intent(out) :: slope_x(:, :)      !! dH/dx, shape [nx, ny]
      real(dp), intent(out) :: slope_y(:, :)      !! dH/dy, shape [nx, ny]
      integer :: east, i, j, north, south, west
      logical :: periodic
      real(dp) :: per_dx, per_dy

      periodic = grid%boundary == boundary_periodic
      !$omp parallel do default(none) shared(grid, height, slope_x, slope_y, periodic) &
      !$omp private(i, east, north, south, west, per_dx, per_dy)
      do j = 1, grid%ny
         call neighbours(periodic, grid%ny, j, south, north, per_dy)
         do i = 1, grid%nx
            call neighbours(periodic, grid%nx, i, west, east, per_dx)
            slope_x(i, j) = (height(east, j) - height(west, j))*per_dx/grid%dx
            slope_y(i, j) = (height(i, north) - height(i, south))*per_dy/grid%dy
         end do
      end do
   end subroutine central_slopes

   !> The two cells from which the slope at cell `i` of `n` is taken, and one over their distance in
   !> cells.
   elemental subroutine neighbours(periodic, n, i, before, behind, per_distance)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      integer, intent(in) :: i                   !! from 1
      integer, intent(out) :: before, behind
      real(dp), intent(out) :: per_distance

      before = i - 1
      behind = i + 1
      per_distance = 0.5_dp
      if (i > 1 .and. i < n) return
      if (periodic) then
         before = modulo(i - 2, n) + 1
         behind = modulo(i, n) + 1
      else
         before = max(i - 1, 1)
         behind = min(i + 1, n)
         per_distance = 1.0_dp/max(behind - before, 1)
      end if
   end subroutine neighbours

   !> Slopes of the trigonometric polynomial through a periodic map. They are exact for a surface
   !> without waves shorter than two cells, and oscillate around kinks. Nyquist modes have no slope
   !> at the cells.
   subroutine spectral_slopes(grid, height, slope_x, slope_y, error)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)        !! m, shape [nx, ny]
      real(dp), intent(out) :: slope_x(:, :)      !! dH/dx, shape [nx, ny]
      real(dp), intent(out) :: slope_y(:, :)      !! dH/dy, shape [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      type(real_transform_type) :: transform

      if (grid%boundary /= boundary_periodic) then
         call fail(error, error_input, 'spectral slopes need boundary = ''periodic''')
         return
      end if
      call new_real_transform(transform, grid%nx, grid%ny, error)
      if (allocated(error)) return
      call derivative(grid, height, .true., transform, slope_x)
      call derivative(grid, height, .false., transform, slope_y)
      call destroy_real_transform(transform)
   end subroutine spectral_slopes

   !> The derivative along one direction, by multiplying the spectrum with i k.
   subroutine derivative(grid, height, along_x, transform, slope)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)
      logical, intent(in) :: along_x
      type(real_transform_type), intent(inout) :: transform
      real(dp), intent(inout) :: slope(:, :)
      integer :: i, j
      real(dp) :: factor, k

      !$omp parallel do default(none) shared(grid, height, transform) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            transform%space(i, j) = height(i, j)
         end do
      end do
      call to_spectrum(transform)
      factor = 1.0_dp/(real(grid%nx, dp)*grid%ny)
      !$omp parallel do default(none) shared(grid, transform, along_x, factor) private(i, k)
      do j = 1, grid%ny
         do i = 1, grid%nx/2 + 1
            k = 0.0_dp
            if (along_x) then
               if (.not. is_nyquist(i, grid%nx)) k = wave_number(i, grid%nx, grid%lx)
            else
               if (.not. is_nyquist(j, grid%ny)) k = wave_number(j, grid%ny, grid%ly)
            end if
            transform%spectrum(i, j) = cmplx(-factor*k*aimag(transform%spectrum(i, j)), &
               factor*k*real(transform%spectrum(i, j), dp), dp)
         end do
      end do
      call to_space(transform)
      !$omp parallel do default(none) shared(grid, slope, transform) private(i)
      do j = 1, grid%ny
         do i = 1, grid%nx
            slope(i, j) = transform%space(i, j)
         end do
      end do
   end subroutine derivative

end module surface_slopes
