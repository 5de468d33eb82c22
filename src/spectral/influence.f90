!> Influence coefficients of the half-space of unit shear modulus for any Poisson ratio: the displacement
!> of cell centres under a uniform traction on one cell (Love 1929; Kalker 1990).
!>
!> In free mode these coefficients are transformed on a doubled, wrapped grid. A table (0:mx/2, 0:my/2)
!> of a quarter of the plane is sufficient, because all coefficients are even in x and y, except that of the
!> coupling xy, which is odd in both.
module influence
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_int, c_null_ptr, c_ptr, c_size_t
   use asperity_fftw, only : fftw_alloc_real, fftw_destroy_plan, fftw_estimate, fftw_execute_r2r, &
      fftw_free, fftw_plan_r2r_1d, fftw_redft00, fftw_rodft00
   use asperity_precision, only : dp, pi
   use regular_grid, only : boundary_periodic
   use transform_lengths, only : good_length
   implicit none
   private

   public :: line_transform_type, love_normal, love_tangential, new_line_transform, transform_length

   !> Transforms of coefficients along a direction. A variable of this type must not be copied.
   type :: line_transform_type
      integer, private :: m = 0            !! length of the circle
      integer, private :: points = 0       !! coefficients that are transformed
      logical, private :: odd = .false.    !! the coefficients are odd, otherwise even
      type(c_ptr), private :: plan = c_null_ptr
   contains
      procedure :: transform_lines
      procedure :: destroy => destroy_line_transform
   end type line_transform_type

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

   !> The integrals of x^2/r^3, y^2/r^3 and x y/r^3 over a cell, from the antiderivatives at its corners.
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

   !> Length of the transforms along a direction of n cells: n itself on a periodic grid; on a free grid an
   !> even number of at least 2n with small prime factors.
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

   !> Plan the transforms of lines of coefficients 0 to m/2 that are even, or odd, on a circle of m.
   subroutine new_line_transform(self, m, odd)
      type(line_transform_type), intent(out) :: self
      integer, intent(in) :: m                     !! even
      logical, intent(in) :: odd
      type(c_ptr) :: memory

      self%m = m
      self%odd = odd
      self%points = merge(m/2 - 1, m/2 + 1, odd)
      if (self%points == 0) return
      memory = fftw_alloc_real(int(self%points, c_size_t))
      !$omp critical (fftw_planner)
      self%plan = fftw_plan_r2r_1d(int(self%points, c_int), memory, memory, &
         merge(fftw_rodft00, fftw_redft00, odd), fftw_estimate)
      !$omp end critical (fftw_planner)
      call fftw_free(memory)
   end subroutine new_line_transform

   !> Transform lines in place; several threads may call this at once. The transform of an odd line has the
   !> factor -i, which is left out: two of them, along x and y, are real and negative.
   subroutine transform_lines(self, lines)
      class(line_transform_type), intent(in) :: self
      real(dp), intent(inout) :: lines(0:, :)      !! [0:m/2, lines]
      type(c_ptr) :: memory
      real(dp), pointer :: work(:)
      integer :: first, k

      first = merge(1, 0, self%odd)
      if (self%points > 0) then
         memory = fftw_alloc_real(int(self%points, c_size_t))
         call c_f_pointer(memory, work, [self%points])
         do k = 1, size(lines, 2)
            work(:) = lines(first:first + self%points - 1, k)
            call fftw_execute_r2r(self%plan, memory, memory)
            lines(first:first + self%points - 1, k) = work
         end do
         call fftw_free(memory)
      end if
      if (.not. self%odd) return
      lines(0, :) = 0.0_dp
      lines(self%m/2, :) = 0.0_dp
   end subroutine transform_lines

   !> Free the plan.
   subroutine destroy_line_transform(self)
      class(line_transform_type), intent(inout) :: self

      if (.not. c_associated(self%plan)) return
      !$omp critical (fftw_planner)
      call fftw_destroy_plan(self%plan)
      !$omp end critical (fftw_planner)
      self%plan = c_null_ptr
   end subroutine destroy_line_transform

end module influence
