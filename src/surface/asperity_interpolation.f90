!> The height map of the road after the road and the rubber have moved: H(X) = H_0(X + s(X) - D).
!>
!> D is the displacement of the road and s the tangential displacement of the rubber. The height is
!> always computed from the original map H_0, so that errors do not add up from step to step. The
!> slopes are those of the road at the displaced place, grad H_0 at X + s - D (thesis, 3.5), and not
!> the gradient of H(X).
!>
!> 'cubic', the default of the program, reads the height and the slopes from the cubic B-spline
!> surface through the map (module `cubic_spline`). Because the slopes are the exact gradient of the
!> heights that are used, sum(P grad H) is the exact derivative of the elastic energy with respect
!> to D: a rubber without loss does no net work on a road that returns to its place. At the cells
!> the slope of a wave with theta = k dx is multiplied by 3 sin(theta)/(theta (2 + cos(theta))),
!> which is 0.2 % too low if the wave has 8 cells. Next to a jump of the map the spline overshoots
!> between the cells by 11 % of the jump.
!>
!> 'linear' interpolates the heights bilinearly, and the slopes bilinearly between the central
!> differences at the cells. Both are continuous and of second order and never overshoot. The slope
!> of a wave is multiplied by sin(theta)/theta, which is 10 % too low if the wave has 8 cells, and
!> it is not the gradient of the interpolated heights.
!>
!> A map that is moved by whole cells keeps its heights bit for bit; a shift that differs from whole
!> cells by less than 1e-9 of a cell counts as whole. Periodic maps repeat. Outside a free map,
!> whose rim consists of its outermost cells, the height is the lowest of the map and the slope is
!> 0. Over a width of one cell beyond the rim, the height and the slope fall linearly from the
!> values at the rim to these.
!>
!> Memory: the map, and for 'cubic' one field of coefficients. Every process holds the whole map.
module asperity_interpolation
   use cubic_spline, only : spline_coefficients, spline_height, spline_map
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use surface_slopes, only : central_slopes, neighbours
   implicit none
   private

   public :: displaced, interpolation_type, new_interpolation, shifted

   real(dp), parameter :: whole_within = 1.0e-9_dp    !! cells

   !> A height map that can be evaluated between its cells.
   type :: interpolation_type
      type(grid_type) :: grid
      real(dp), allocatable :: height(:, :)           !! the original map H_0, m, shape [nx, ny]
      real(dp) :: lowest = 0.0_dp                     !! its lowest value, m
      logical, private :: cubic = .false.
      logical, private :: periodic = .true.
      real(dp), allocatable, private :: coefficients(:, :)
   end type interpolation_type

   !> The map after a uniform displacement D of the road: H, or H and both slopes.
   interface shifted
      module procedure :: shifted_height, shifted_map
   end interface shifted

   !> The map after a displacement D of the road and displacements s of the rubber: H, or H and both
   !> slopes.
   interface displaced
      module procedure :: displaced_height, displaced_map
   end interface displaced

contains

   !> Copy a map and prepare what its interpolation needs.
   subroutine new_interpolation(self, grid, height, method, error)
      type(interpolation_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                !! m, shape [nx, ny]
      character(*), intent(in) :: method                  !! 'cubic' | 'linear'
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: lowest
      integer :: i, j

      if (method /= 'linear' .and. method /= 'cubic') then
         call fail(error, error_input, '&solver: interpolation = '''//trim(method) &
            //''': must be ''cubic'' or ''linear''')
         return
      end if
      if (size(height, 1) /= grid%nx .or. size(height, 2) /= grid%ny) then
         call fail(error, error_input, 'interpolation: the map does not have the shape of its grid')
         return
      end if
      self%grid = grid
      self%periodic = grid%boundary == boundary_periodic
      self%cubic = method == 'cubic'
      allocate (self%height(grid%nx, grid%ny))
      lowest = huge(1.0_dp)
      !$omp parallel do default(none) shared(grid, height, self) private(i) reduction(min:lowest)
      do j = 1, grid%ny
         do i = 1, grid%nx
            self%height(i, j) = height(i, j)
            lowest = min(lowest, height(i, j))
         end do
      end do
      self%lowest = lowest
      if (self%cubic) call spline_coefficients(height, self%periodic, self%coefficients)
   end subroutine new_interpolation

   !> H(X) = H_0(X - D).
   subroutine shifted_height(self, shift_x, shift_y, height)
      type(interpolation_type), intent(in) :: self
      real(dp), intent(in) :: shift_x, shift_y     !! D, m
      real(dp), intent(out) :: height(:, :)        !! H, m, shape [nx, ny]
      integer :: i, j, moved_i, moved_j, whole_x, whole_y
      real(dp) :: part_x, part_y

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      if (abs(part_x) > 0.0_dp .or. abs(part_y) > 0.0_dp) then
         !$omp parallel do default(none) shared(self, height, whole_x, whole_y, part_x, part_y) &
         !$omp private(i)
         do j = 1, self%grid%ny
            do i = 1, self%grid%nx
               height(i, j) = height_at(self, i - 1 - whole_x, j - 1 - whole_y, -part_x, -part_y)
            end do
         end do
      else
         !$omp parallel do default(none) shared(self, height, whole_x, whole_y) &
         !$omp private(i, moved_i, moved_j)
         do j = 1, self%grid%ny
            moved_j = j - whole_y
            if (self%periodic) moved_j = modulo(moved_j - 1, self%grid%ny) + 1
            do i = 1, self%grid%nx
               moved_i = i - whole_x
               if (self%periodic) moved_i = modulo(moved_i - 1, self%grid%nx) + 1
               height(i, j) = cell_height(self, moved_i, moved_j)
            end do
         end do
      end if
   end subroutine shifted_height

   !> H(X) = H_0(X - D) and its slopes.
   subroutine shifted_map(self, shift_x, shift_y, height, slope_x, slope_y)
      type(interpolation_type), intent(in) :: self
      real(dp), intent(in) :: shift_x, shift_y     !! D, m
      real(dp), intent(out) :: height(:, :)        !! H, m, shape [nx, ny]
      real(dp), intent(out) :: slope_x(:, :)       !! dH_0/dx at X - D, shape [nx, ny]
      real(dp), intent(out) :: slope_y(:, :)       !! dH_0/dy at X - D, shape [nx, ny]
      integer :: i, j, whole_x, whole_y
      real(dp) :: part_x, part_y

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      if (self%periodic .and. .not. self%cubic &
         .and. .not. (abs(part_x) > 0.0_dp .or. abs(part_y) > 0.0_dp)) then
         ! For whole cells, the differences of the moved map are the moved differences of the map.
         call shifted_height(self, shift_x, shift_y, height)
         call central_slopes(self%grid, height, slope_x, slope_y)
         return
      end if
      !$omp parallel do default(none) private(i) &
      !$omp shared(self, height, slope_x, slope_y, whole_x, whole_y, part_x, part_y)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            call map_at(self, i - 1 - whole_x, j - 1 - whole_y, -part_x, -part_y, &
               height(i, j), slope_x(i, j), slope_y(i, j))
         end do
      end do
      ! For whole cells take the heights themselves, because the spline gives them with round-off.
      if (.not. (abs(part_x) > 0.0_dp .or. abs(part_y) > 0.0_dp)) &
         call shifted_height(self, shift_x, shift_y, height)
   end subroutine shifted_map

   !> H(X) = H_0(X + s(X) - D).
   subroutine displaced_height(self, shift_x, shift_y, displacement_x, displacement_y, height)
      type(interpolation_type), intent(in) :: self
      real(dp), intent(in) :: shift_x, shift_y          !! D, m
      real(dp), intent(in) :: displacement_x(:, :)      !! s along x, m, shape [nx, ny]
      real(dp), intent(in) :: displacement_y(:, :)      !! s along y, m, shape [nx, ny]
      real(dp), intent(out) :: height(:, :)             !! H, m, shape [nx, ny]
      integer :: i, j, whole_x, whole_y
      real(dp) :: part_x, part_y, per_dx, per_dy

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      per_dx = 1.0_dp/self%grid%dx
      per_dy = 1.0_dp/self%grid%dy
      !$omp parallel do default(none) private(i) shared(self, height, displacement_x, &
      !$omp displacement_y, whole_x, whole_y, part_x, part_y, per_dx, per_dy)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            height(i, j) = height_at(self, i - 1 - whole_x, j - 1 - whole_y, &
               displacement_x(i, j)*per_dx - part_x, displacement_y(i, j)*per_dy - part_y)
         end do
      end do
   end subroutine displaced_height

   !> H(X) = H_0(X + s(X) - D) and the slopes of H_0 there.
   subroutine displaced_map(self, shift_x, shift_y, displacement_x, displacement_y, height, &
      slope_x, slope_y)
      type(interpolation_type), intent(in) :: self
      real(dp), intent(in) :: shift_x, shift_y          !! D, m
      real(dp), intent(in) :: displacement_x(:, :)      !! s along x, m, shape [nx, ny]
      real(dp), intent(in) :: displacement_y(:, :)      !! s along y, m, shape [nx, ny]
      real(dp), intent(out) :: height(:, :)             !! H, m, shape [nx, ny]
      real(dp), intent(out) :: slope_x(:, :)            !! dH_0/dx at X + s - D, shape [nx, ny]
      real(dp), intent(out) :: slope_y(:, :)            !! dH_0/dy at X + s - D, shape [nx, ny]
      integer :: i, j, whole_x, whole_y
      real(dp) :: part_x, part_y, per_dx, per_dy

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      per_dx = 1.0_dp/self%grid%dx
      per_dy = 1.0_dp/self%grid%dy
      !$omp parallel do default(none) private(i) shared(self, height, slope_x, slope_y, &
      !$omp displacement_x, displacement_y, whole_x, whole_y, part_x, part_y, per_dx, per_dy)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            call map_at(self, i - 1 - whole_x, j - 1 - whole_y, &
               displacement_x(i, j)*per_dx - part_x, displacement_y(i, j)*per_dy - part_y, &
               height(i, j), slope_x(i, j), slope_y(i, j))
         end do
      end do
   end subroutine displaced_map

   !> Split a shift into whole cells and a part of a cell; whole cells modulo `n` on a period.
   elemental subroutine split(periodic, n, cells, whole, part)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      real(dp), intent(in) :: cells
      integer, intent(out) :: whole
      real(dp), intent(out) :: part              !! -1/2 to 1/2; 0 if within round-off of it
      real(dp) :: nearest_whole

      nearest_whole = anint(cells)
      part = cells - nearest_whole
      if (abs(part) <= whole_within + 4.0_dp*spacing(cells)) part = 0.0_dp
      if (periodic) then
         whole = int(modulo(nearest_whole, real(n, dp)))
      else
         whole = int(max(-2.0_dp*n, min(2.0_dp*n, nearest_whole)))
      end if
   end subroutine split

   !> Find the place `start + q` along a direction of `n` cells: its cell, its fraction of a cell,
   !> and the weight of the map, which is below 1 outside a free map; the lowest height has the
   !> rest.
   elemental subroutine locate(periodic, n, start, q, cell, u, weight)
      logical, intent(in) :: periodic
      integer, intent(in) :: n
      integer, intent(in) :: start              !! cell from 0; may lie outside the map
      real(dp), intent(in) :: q                 !! cells
      integer, intent(out) :: cell              !! 0 to n - 1, or to n - 2 on a bounded map
      real(dp), intent(out) :: u                !! 0 to 1
      real(dp), intent(out) :: weight           !! 0 to 1
      integer :: below

      weight = 1.0_dp
      if (n == 1) then                          ! the map is constant along this direction
         cell = 0
         u = 0.0_dp
         return
      end if
      below = floor(max(-1.0e9_dp, min(1.0e9_dp, q)))
      cell = start + below
      u = q - below
      if (periodic) then
         if (cell < 0 .or. cell >= n) cell = modulo(cell, n)
      else if (cell < 0) then
         weight = max(0.0_dp, 1.0_dp + cell + u)
         cell = 0
         u = 0.0_dp
      else if (cell >= n - 1) then
         weight = max(0.0_dp, n - cell - u)
         cell = n - 2
         u = 1.0_dp
      end if
   end subroutine locate

   !> Height of cell (i, j), from 1; the lowest height of the map outside a free map.
   pure function cell_height(self, i, j) result(h)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: h

      h = self%lowest
      if (i < 1 .or. i > self%grid%nx .or. j < 1 .or. j > self%grid%ny) return
      h = self%height(i, j)
   end function cell_height

   !> Height at the place (i + p, j + q), in cells from 0.
   pure function height_at(self, i, j, p, q) result(h)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: p, q
      real(dp) :: h
      integer :: cell_x, cell_y, i1, j1
      real(dp) :: u, v, weight_x, weight_y

      call locate(self%periodic, self%grid%nx, i, p, cell_x, u, weight_x)
      call locate(self%periodic, self%grid%ny, j, q, cell_y, v, weight_y)
      if (self%cubic) then
         h = spline_height(self%coefficients, cell_x, cell_y, u, v)
      else
         i1 = next(cell_x, self%grid%nx)
         j1 = next(cell_y, self%grid%ny)
         h = (1.0_dp - v)*((1.0_dp - u)*self%height(cell_x + 1, cell_y + 1) &
            + u*self%height(i1, cell_y + 1)) &
            + v*((1.0_dp - u)*self%height(cell_x + 1, j1) + u*self%height(i1, j1))
      end if
      if (.not. self%periodic) h = blend(h, self%lowest, weight_x*weight_y)
   end function height_at

   !> Height and slopes at the place (i + p, j + q), in cells from 0.
   pure subroutine map_at(self, i, j, p, q, h, h_x, h_y)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: p, q
      real(dp), intent(out) :: h, h_x, h_y
      integer :: cell_x, cell_y
      real(dp) :: u, v, weight_x, weight_y

      call locate(self%periodic, self%grid%nx, i, p, cell_x, u, weight_x)
      call locate(self%periodic, self%grid%ny, j, q, cell_y, v, weight_y)
      if (self%cubic) then
         call spline_map(self%coefficients, cell_x, cell_y, u, v, h, h_x, h_y)
      else
         call linear_map(self, cell_x + 1, cell_y + 1, u, v, h, h_x, h_y)
      end if
      h_x = h_x/self%grid%dx
      h_y = h_y/self%grid%dy
      if (self%grid%ny == 1) h_y = 0.0_dp
      if (.not. self%periodic) then
         h = blend(h, self%lowest, weight_x*weight_y)
         h_x = weight_x*weight_y*h_x
         h_y = weight_x*weight_y*h_y
      end if
   end subroutine map_at

   !> Bilinear height, and its slopes per cell, in the square between the centres of the cells (i,
   !> j) and (i + 1, j + 1), from 1.
   pure subroutine linear_map(self, i, j, u, v, h, h_u, h_v)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: u, v
      real(dp), intent(out) :: h, h_u, h_v
      integer :: east, i1, j1, north, south, unused, west
      real(dp) :: per_x0, per_x1, per_y0, per_y1, w00, w01, w10, w11

      i1 = next(i - 1, self%grid%nx)
      j1 = next(j - 1, self%grid%ny)
      call neighbours(self%periodic, self%grid%nx, i, west, unused, per_x0)
      call neighbours(self%periodic, self%grid%nx, i1, unused, east, per_x1)
      call neighbours(self%periodic, self%grid%ny, j, south, unused, per_y0)
      call neighbours(self%periodic, self%grid%ny, j1, unused, north, per_y1)
      w00 = (1.0_dp - u)*(1.0_dp - v)
      w10 = u*(1.0_dp - v)
      w01 = (1.0_dp - u)*v
      w11 = u*v
      associate (h_0 => self%height)
         h = w00*h_0(i, j) + w10*h_0(i1, j) + w01*h_0(i, j1) + w11*h_0(i1, j1)
         h_u = per_x0*(w00*(h_0(i1, j) - h_0(west, j)) + w01*(h_0(i1, j1) - h_0(west, j1))) &
            + per_x1*(w10*(h_0(east, j) - h_0(i, j)) + w11*(h_0(east, j1) - h_0(i, j1)))
         h_v = per_y0*(w00*(h_0(i, j1) - h_0(i, south)) + w10*(h_0(i1, j1) - h_0(i1, south))) &
            + per_y1*(w01*(h_0(i, north) - h_0(i, j)) + w11*(h_0(i1, north) - h_0(i1, j)))
      end associate
   end subroutine linear_map

   !> The number from 1 of the cell that follows the cell with the number `cell` from 0; the first
   !> cell follows the last.
   elemental function next(cell, n) result(i)
      integer, intent(in) :: cell, n
      integer :: i

      i = cell + 2
      if (i > n) i = 1
   end function next

   !> Mean of h with this weight and the lowest height with the rest.
   elemental function blend(h, lowest, weight) result(mixed)
      real(dp), intent(in) :: h, lowest, weight
      real(dp) :: mixed

      mixed = h
      if (weight < 1.0_dp) mixed = lowest + weight*(h - lowest)
   end function blend

end module asperity_interpolation
