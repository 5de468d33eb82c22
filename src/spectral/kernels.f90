!> Kernels, that is, the response of a solid's surface to tractions, for a shear modulus of 1.
!>
!> On a periodic grid a wave exp(i q.x) of traction causes A(q) times the same wave of displacement. A is a
!> number for the normal direction, and a symmetric 2 x 2 matrix (xx, yy, xy) for the tangential ones. On a free
!> grid the kernel gives the displacement at any distance from one cell under a uniform traction on
!> that cell. A kernel also knows the mean mode of a periodic grid, the inverse (the
!> stiffness), and the least and largest stiffness on a grid. In steady sliding, module `steady_symbols`
!> divides A(q) by the complex modulus at the frequency of the wave.
!>
!> A new solid is one new subroutine, `wave`, and its exact test; a function, `cell`, if the solid
!> is to be used with a free boundary. Half-space (Johnson, Contact Mechanics, 1985; nu: Poisson ratio):
!>
!>     normal        A = (1 - nu)/q
!>     tangential    A = [1 - nu q q/q^2]/q;  the mean mode of a sheared block is its thickness
!>     one cell      Love 1929; Kalker 1990 (module `influence`)
module kernels
   use asperity_precision, only : dp, pi
   use influence, only : line_transform_type, love_normal, love_tangential, new_line_transform
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: cell_response, kernel_type, normal_half_space, tangential_half_space, wave_response

   !> A solid of unit shear modulus.
   type :: kernel_type
      integer :: components = 1             !! 1: normal, 2: both tangential directions
      real(dp) :: poisson = 0.5_dp          !! -1 < nu <= 0.5
      real(dp) :: mean_mode = 0.0_dp        !! A at zero wave number on a periodic grid, m/Pa
      procedure(wave_response), pointer :: wave => null()   !! A at wave vectors that are not zero
      procedure(cell_response), pointer :: cell => null()   !! null if only for periodic grids
   contains
      procedure :: tensor
      procedure :: grid_row
      procedure :: compliance
      procedure :: least_stiffness
      procedure :: largest_stiffness
      procedure :: symbols
      procedure :: inverse_symbols
   end type kernel_type

   abstract interface
      !> A at the wave vectors (qx, qy) of a row, none of them zero. All at once, because products compute it for
      !> many waves.
      pure subroutine wave_response(self, qx, qy, a)
         import :: dp, kernel_type
         implicit none
         class(kernel_type), intent(in) :: self
         real(dp), contiguous, intent(in) :: qx(:)      !! rad/m
         real(dp), intent(in) :: qy                     !! rad/m
         real(dp), contiguous, intent(out) :: a(:, :)   !! [size(qx), 1], or [size(qx), xx, yy and xy], m/Pa
      end subroutine wave_response

      !> The displacement at (x, y) from the centre of a cell dx by dy under a uniform unit traction.
      pure function cell_response(self, x, y, dx, dy) result(a)
         import :: dp, kernel_type
         implicit none
         class(kernel_type), intent(in) :: self
         real(dp), intent(in) :: x, y       !! m
         real(dp), intent(in) :: dx, dy     !! m
         real(dp) :: a(3)                   !! m/Pa
      end function cell_response
   end interface

contains

   !> The half-space in the normal direction. On a periodic grid the mean mode is 0, because the mean normal
   !> displacement is part of the approach of the bodies.
   function normal_half_space(poisson) result(self)
      real(dp), intent(in) :: poisson               !! Poisson ratio, -1 < nu <= 0.5
      type(kernel_type) :: self

      self%poisson = poisson
      self%wave => half_space_normal_wave
      self%cell => half_space_normal_cell
   end function normal_half_space

   !> The half-space in both tangential directions, or a block of some thickness, which has a mean shear.
   function tangential_half_space(poisson, thickness) result(self)
      real(dp), intent(in) :: poisson               !! Poisson ratio, -1 < nu <= 0.5
      real(dp), intent(in), optional :: thickness   !! of the block, m; 0 or absent: half-space
      type(kernel_type) :: self

      self%components = 2
      self%poisson = poisson
      if (present(thickness)) self%mean_mode = thickness
      self%wave => half_space_tangential_wave
      self%cell => half_space_tangential_cell
   end function tangential_half_space

   !> (1 - nu)/q.
   pure subroutine half_space_normal_wave(self, qx, qy, a)
      class(kernel_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: qx(:)
      real(dp), intent(in) :: qy
      real(dp), contiguous, intent(out) :: a(:, :)

      a(:, 1) = (1.0_dp - self%poisson)/sqrt(qx**2 + qy**2)
   end subroutine half_space_normal_wave

   !> [1 - nu q q/q^2]/q.
   pure subroutine half_space_tangential_wave(self, qx, qy, a)
      class(kernel_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: qx(:)
      real(dp), intent(in) :: qy
      real(dp), contiguous, intent(out) :: a(:, :)
      real(dp) :: q
      integer :: i

      do i = 1, size(qx)
         q = sqrt(qx(i)**2 + qy**2)
         a(i, 1) = (1.0_dp - self%poisson*(qx(i)/q)**2)/q
         a(i, 2) = (1.0_dp - self%poisson*(qy/q)**2)/q
         a(i, 3) = -self%poisson*(qx(i)/q)*(qy/q)/q
      end do
   end subroutine half_space_tangential_wave

   !> Love's coefficient of a normal pressure.
   pure function half_space_normal_cell(self, x, y, dx, dy) result(a)
      class(kernel_type), intent(in) :: self
      real(dp), intent(in) :: x, y, dx, dy
      real(dp) :: a(3)

      a = [love_normal(x, y, dx, dy, self%poisson), 0.0_dp, 0.0_dp]
   end function half_space_normal_cell

   !> The coefficients of tangential tractions.
   pure function half_space_tangential_cell(self, x, y, dx, dy) result(a)
      class(kernel_type), intent(in) :: self
      real(dp), intent(in) :: x, y, dx, dy
      real(dp) :: a(3)

      call love_tangential(x, y, dx, dy, self%poisson, a(1), a(3), a(2))
   end function half_space_tangential_cell

   !> A at one wave vector that is not zero.
   pure function tensor(self, qx, qy) result(a)
      class(kernel_type), intent(in) :: self
      real(dp), intent(in) :: qx, qy        !! rad/m
      real(dp) :: a(3)                      !! [a, -, -] of a normal kernel, [xx, yy, xy] of a tangential one, m/Pa
      real(dp) :: elements(1, merge(1, 3, self%components == 1))

      call self%wave([qx], qy, elements)
      a = 0.0_dp
      a(:size(elements)) = elements(1, :)
   end function tensor

   !> The first element of A for a wave along x. For a normal kernel this is its compliance.
   pure function compliance(self, q) result(a)
      class(kernel_type), intent(in) :: self
      real(dp), intent(in) :: q             !! rad/m, > 0
      real(dp) :: a                         !! m/Pa
      real(dp) :: elements(3)

      elements = self%tensor(q, 0.0_dp)
      a = elements(1)
   end function compliance

   !> A for some wave numbers along x, from `first` on, and one along y of a periodic grid, the zero one included.
   pure subroutine grid_row(self, grid, first, j, a)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first, j                  !! not negative
      real(dp), contiguous, intent(out) :: a(first:, :)   !! [wave numbers along x, 1 or 3], m/Pa
      real(dp) :: qx(first:first + size(a, 1) - 1)
      integer :: i
      logical :: has_mean

      if (size(a, 1) == 0) return
      do i = first, ubound(a, 1)
         qx(i) = 2.0_dp*pi*(i/grid%lx)
      end do
      ! The zero wave number takes part as that of the longest wave, and its A is replaced afterwards. The other ones
      ! alone would not be contiguous, and would be copied.
      has_mean = first == 0 .and. j == 0
      if (has_mean) qx(0) = 2.0_dp*pi/grid%lx
      call self%wave(qx, 2.0_dp*pi*(j/grid%ly), a)
      if (.not. has_mean) return
      a(0, :) = self%mean_mode
      if (self%components > 1) a(0, 3) = 0.0_dp
   end subroutine grid_row

   !> Stiffness of a normal kernel for the longest wave of a grid.
   pure function least_stiffness(self, grid) result(stiffness)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      real(dp) :: stiffness                 !! Pa/m

      stiffness = 1.0_dp/self%compliance(2.0_dp*pi/max(grid%lx, merge(0.0_dp, grid%ly, grid%ny == 1)))
   end function least_stiffness

   !> Stiffness of a normal kernel for the shortest wave of a grid: two cells long, or the geometric mean
   !> of that for both directions.
   pure function largest_stiffness(self, grid) result(stiffness)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      real(dp) :: stiffness                 !! Pa/m

      stiffness = 1.0_dp/self%compliance(pi/merge(grid%dx, sqrt(grid%dx*grid%dy), grid%ny == 1))
   end function largest_stiffness

   !> A for the wave numbers of the transforms of a grid: the first quarter of the plane, since xx and yy
   !> are even in both wave numbers and xy is odd in both. The table may hold a part of the wave numbers
   !> along x.
   subroutine symbols(self, grid, mx, my, table, first)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: mx, my                    !! lengths of the transforms
      real(dp), intent(out) :: table(0:, 0:, :)        !! [0:mx/2 or less, 0:my/2, 1 or 3], m/Pa
      integer, intent(in), optional :: first           !! wave number along x of table(0, :, :), 0 if absent
      real(dp) :: row(0:size(table, 1) - 1, size(table, 3))
      integer :: start, j

      if (size(table, 1) == 0) return
      start = 0
      if (present(first)) start = first
      if (grid%boundary /= boundary_periodic) then
         call cell_symbols(self, grid, mx, my, start, table)
         return
      end if
      !$omp parallel do default(none) shared(self, grid, mx, my, start, table) private(j, row)
      do j = 0, my/2
         call self%grid_row(grid, start, j, row)
         if (self%components > 1) then
            ! An odd symbol has no value on the Nyquist lines.
            if (2*j == my) row(:, 3) = 0.0_dp
            if (2*(start + ubound(row, 1)) == mx) row(ubound(row, 1), 3) = 0.0_dp
         end if
         table(:, j, :) = row
      end do
   end subroutine symbols

   !> The symbols on a free grid, computed from the responses to a traction on one cell. Each row is transformed
   !> as soon as it is formed, and only the wave numbers of the table are kept.
   subroutine cell_symbols(self, grid, mx, my, start, table)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: mx, my
      integer, intent(in) :: start
      real(dp), intent(out) :: table(0:, 0:, :)
      type(line_transform_type) :: along_x(3), along_y(3)
      real(dp), allocatable :: line(:, :)
      real(dp) :: a(3)
      integer :: parts, c, i, j

      parts = size(table, 3)
      do c = 1, parts
         call new_line_transform(along_x(c), mx, odd=c == 3)
         call new_line_transform(along_y(c), my, odd=c == 3)
      end do

      !$omp parallel default(none) shared(self, grid, mx, my, start, table, parts, along_x, along_y) &
      !$omp private(line, a, c, i, j)
      allocate (line(0:mx/2, parts))
      !$omp do
      do j = 0, my/2
         do i = 0, mx/2
            a = self%cell(i*grid%dx, j*grid%dy, grid%dx, grid%dy)
            line(i, :) = a(:parts)
         end do
         do c = 1, parts
            call along_x(c)%transform_lines(line(:, c:c))
         end do
         table(:, j, :) = line(start:start + size(table, 1) - 1, :)
      end do
      !$omp end do
      deallocate (line)
      allocate (line(0:my/2, 1))
      do c = 1, parts
         !$omp do
         do i = 0, size(table, 1) - 1
            line(:, 1) = table(i, :, c)
            call along_y(c)%transform_lines(line)
            table(i, :, c) = merge(-line(:, 1), line(:, 1), c == 3)
         end do
         !$omp end do
      end do
      !$omp end parallel

      do c = 1, parts
         call along_x(c)%destroy()
         call along_y(c)%destroy()
      end do
   end subroutine cell_symbols

   !> The inverse of A on a periodic grid; 0 where A is 0.
   subroutine inverse_symbols(self, grid, table, first)
      class(kernel_type), intent(in) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(out) :: table(0:, 0:, :)        !! [0:nx/2 or less, 0:ny/2, 1 or 3], Pa/m
      integer, intent(in), optional :: first           !! wave number along x of table(0, :, :), 0 if absent
      real(dp) :: determinant, a(3)
      integer :: i, j

      call self%symbols(grid, grid%nx, grid%ny, table, first)
      do j = 0, grid%ny/2
         do i = 0, size(table, 1) - 1
            if (self%components == 1) then
               if (table(i, j, 1) > 0.0_dp) table(i, j, 1) = 1.0_dp/table(i, j, 1)
            else
               a = table(i, j, :)
               determinant = a(1)*a(2) - a(3)**2
               table(i, j, :) = 0.0_dp
               if (determinant > 0.0_dp) table(i, j, :) = [a(2), a(1), -a(3)]/determinant
            end if
         end do
      end do
   end subroutine inverse_symbols

end module kernels
