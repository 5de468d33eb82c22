!> Influence coefficients of the half-space of unit shear modulus for any Poisson ratio: the displacement
!> of cell centres under a uniform traction on one cell (Love 1929; Kalker 1990).
!>
!> In free mode these coefficients are transformed on a doubled, wrapped grid. A table (0:mx/2, 0:my/2)
!> holds a quarter of the plane: all coefficients are even in x and y, but that of the coupling xy, which
!> is odd in both.
module influence
   use, intrinsic :: iso_c_binding, only : c_f_pointer, c_int, c_loc, c_ptr, c_size_t
   use asperity_fftw, only : fftw_alloc_real, fftw_destroy_plan, fftw_estimate, fftw_execute_r2r, &
      fftw_free, fftw_plan_r2r_2d, fftw_redft00, fftw_rodft00
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_periodic
   use transform_lengths, only : good_length
   implicit none
   private

   public :: love_normal, love_tangential, transform_even, transform_length, transform_odd

contains

   !> Displacement u_z at (x, y) under unit pressure on the cell dx by dy at the origin, G = 1.
   elemental function love_normal(x, y, dx, dy, poisson) result(a_zz)
      real(dp), intent(in) :: x, y        !! m
      real(dp), intent(in) :: dx, dy      !! m
      real(dp), intent(in) :: poisson
      real(dp) :: a_zz                    !! m for 1 Pa over 1 Pa of modulus
      real(dp) :: i_x2, i_y2, i_xy

      call corner_sums(x, y, dx, dy, i_x2, i_y2, i_xy)
      a_zz = (1.0_dp - poisson)*(i_x2 + i_y2)/(2.0_dp*pi)
   end function love_normal

   !> Displacements in the plane at (x, y) under unit tangential traction on the cell at the origin.
   elemental subroutine love_tangential(x, y, dx, dy, poisson, a_xx, a_xy, a_yy)
      real(dp), intent(in) :: x, y
      real(dp), intent(in) :: dx, dy
      real(dp), intent(in) :: poisson
      real(dp), intent(out) :: a_xx, a_xy, a_yy
      real(dp) :: i_x2, i_y2, i_xy

      call corner_sums(x, y, dx, dy, i_x2, i_y2, i_xy)
      a_xx = ((1.0_dp - poisson)*i_y2 + i_x2)/(2.0_dp*pi)
      a_yy = (i_y2 + (1.0_dp - poisson)*i_x2)/(2.0_dp*pi)
      a_xy = poisson*i_xy/(2.0_dp*pi)
   end subroutine love_tangential

   !> The integrals of y^2/r^3, x^2/r^3 and x y/r^3 over a cell, by their values at its corners.
   elemental subroutine corner_sums(x, y, dx, dy, i_x2, i_y2, i_xy)
      real(dp), intent(in) :: x, y, dx, dy
      real(dp), intent(out) :: i_x2, i_y2, i_xy
      real(dp) :: a, b, sign
      integer :: k, l

      i_x2 = 0.0_dp
      i_y2 = 0.0_dp
      i_xy = 0.0_dp
      do l = -1, 1, 2
         do k = -1, 1, 2
            a = x + 0.5_dp*k*dx
            b = y + 0.5_dp*l*dy
            sign = real(k*l, dp)
            if (a /= 0.0_dp) i_y2 = i_y2 + sign*a*asinh(b/abs(a))
            if (b /= 0.0_dp) i_x2 = i_x2 + sign*b*asinh(a/abs(b))
            i_xy = i_xy - sign*hypot(a, b)
         end do
      end do
   end subroutine corner_sums

   !> Length of the transforms along a direction of n cells: n itself where periodic; in free mode at
   !> least 2n, even, with small prime factors.
   pure function transform_length(n, boundary) result(m)
      integer, intent(in) :: n
      integer, intent(in) :: boundary
      integer :: m

      if (boundary == boundary_periodic) then
         m = n
      else
         m = good_length(2*n, 2)
      end if
   end function transform_length

   !> Transform of coefficients that are even in both directions, in place; mx and my even.
   subroutine transform_even(mx, my, table)
      integer, intent(in) :: mx, my
      real(dp), intent(inout) :: table(0:mx/2, 0:my/2)

      call transform_real(mx/2 + 1, my/2 + 1, fftw_redft00, table)
   end subroutine transform_even

   !> Transform of coefficients that are odd in both directions, in place; mx and my even.
   !> Two sine transforms, each with the factor -i, make it real and negative.
   subroutine transform_odd(mx, my, table)
      integer, intent(in) :: mx, my
      real(dp), intent(inout) :: table(0:mx/2, 0:my/2)
      real(dp), allocatable :: inner(:, :)

      inner = -table(1:mx/2 - 1, 1:my/2 - 1)
      table = 0.0_dp
      if (size(inner) == 0) return
      call transform_real(mx/2 - 1, my/2 - 1, fftw_rodft00, inner)
      table(1:mx/2 - 1, 1:my/2 - 1) = inner
   end subroutine transform_odd

   !> A real transform of one kind in both directions, in place.
   subroutine transform_real(nx, ny, kind, table)
      integer, intent(in) :: nx, ny
      integer(c_int), intent(in) :: kind
      real(dp), intent(inout) :: table(nx, ny)
      type(c_ptr) :: memory, plan
      real(dp), pointer :: work(:, :)

      memory = fftw_alloc_real(int(nx, c_size_t)*ny)
      call c_f_pointer(memory, work, [nx, ny])
      !$omp critical (fftw_planner)
      plan = fftw_plan_r2r_2d(int(ny, c_int), int(nx, c_int), memory, memory, kind, kind, &
         fftw_estimate)
      !$omp end critical (fftw_planner)
      work(:, :) = table
      call fftw_execute_r2r(plan, memory, memory)
      table(:, :) = work
      !$omp critical (fftw_planner)
      call fftw_destroy_plan(plan)
      !$omp end critical (fftw_planner)
      call fftw_free(memory)
   end subroutine transform_real

end module influence
