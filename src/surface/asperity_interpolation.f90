!> The height map of the road after the road and the rubber have moved: H(X) = H_0(X + s(X) - D).
!>
!> D is the displacement of the road and s the tangential displacement of the rubber. The height is
!> always computed from the original map H_0, so that errors do not add up from step to step. The
!> slopes are those of the road at the displaced place, grad H_0 at X + s - D (thesis, 3.5), and not
!> the gradient of H(X).
!>
!> The surface between the centres of the cells is one of two:
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
!> differences at the cells (module `bilinear_map`). Both are continuous and never overshoot. The slope
!> of a wave is multiplied by sin(theta)/theta, which is 10 % too low if the wave has 8 cells, and
!> it is not the gradient of the interpolated heights.
!>
!> A map that is moved by whole cells keeps its heights bit for bit; a shift that differs from whole
!> cells by less than 1e-9 of a cell counts as whole. Periodic maps repeat. Outside a free map,
!> whose rim consists of its outermost cells, the height is the lowest of the map and the slope is
!> 0. Over a width of one cell beyond the rim, the height and the slope fall linearly from the
!> values at the rim to these.
!>
!> Memory: the map, and for 'cubic' one field of coefficients; where processes share the rows, up to one more
!> field.
module asperity_interpolation
   use bilinear_map, only : bilinear_slopes
   use cubic_spline, only : most_places, spline_coefficients, spline_run
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use field_copies, only : copy_field
   use field_sums, only : field_minimum
   use regular_grid, only : boundary_periodic, grid_type
   use road_rows, only : new_road_rows, road_rows_type
   use road_shift, only : shift_in_cells, shift_type
   use row_halo, only : fetch_rows
   use surface_slopes, only : central_slopes
   implicit none
   private

   public :: displaced, interpolation_type, new_interpolation, shifted

   !> A height map that can be evaluated between its cells.
   type :: interpolation_type
      type(grid_type) :: grid
      real(dp) :: lowest = 0.0_dp                     !! the lowest value of the map, m
      logical, private :: cubic = .false.
      logical, private :: periodic = .true.
      !> What is interpolated: 'linear' the map, m [nx, rows], 'cubic' its coefficients, m [-1..nx+1, rows].
      type(road_rows_type), private :: rows
      !> The original map H_0 of 'cubic', m [nx, rows of this process].
      real(dp), allocatable, private :: height(:, :)
   end type interpolation_type

contains

   !> Copy a map and prepare what its interpolation needs. Collective, like all that follows.
   subroutine new_interpolation(self, grid, height, method, error)
      type(interpolation_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                !! m, shape [nx, rows of this process]
      character(*), intent(in) :: method                  !! 'cubic' | 'linear'
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: rim(:, :)

      if (method /= 'linear' .and. method /= 'cubic') then
         call fail(error, error_input, '&solver: interpolation = '''//trim(method) &
            //''': must be ''cubic'' or ''linear''')
         return
      end if
      if (size(height, 1) /= grid%nx .or. size(height, 2) /= grid%rows()) then
         call fail(error, error_input, 'interpolation: the map does not have the shape of its grid')
         return
      end if
      self%grid = grid
      self%periodic = grid%boundary == boundary_periodic
      self%cubic = method == 'cubic'
      self%lowest = field_minimum(height)
      if (self%cubic) then
         allocate (self%height(grid%nx, grid%rows()), rim(grid%nx + 3, 2))
         call copy_field(height, self%height)
         call new_road_rows(self%rows, grid, grid%nx + 3, with_rim=.not. self%periodic)
         call spline_coefficients(grid, self%height, self%rows%values(:, :grid%rows()), rim)
         if (.not. self%periodic) self%rows%values(:, grid%rows() + 1:grid%rows() + 2) = rim
      else
         call new_road_rows(self%rows, grid, grid%nx, with_rim=.false.)
         call copy_field(height, self%rows%values(:, :grid%rows()))
      end if
   end subroutine new_interpolation

   !> The heights of the map, moved by whole cells. Outside a free map the height is its lowest one.
   subroutine moved_height(self, whole, height)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: whole(2)
      real(dp), intent(out) :: height(:, :)        !! m, shape [nx, rows of this process]
      real(dp), allocatable :: row(:)
      integer :: from, i, j, wanted(2)

      wanted = [self%grid%first_row, self%grid%last_row] - whole(2)
      if (self%cubic) then
         call fetch_rows(self%grid, self%height, wanted, height)
      else
         call fetch_rows(self%grid, self%rows%values(:, :self%grid%rows()), wanted, height)
      end if
      !$omp parallel default(none) shared(self, height, whole) private(i, j, from, row)
      allocate (row(self%grid%nx))
      !$omp do
      do j = 1, self%grid%rows()
         row(:) = height(:, j)
         if (self%grid%row_at(self%grid%first_row - 1 + j - whole(2)) == 0) row(:) = self%lowest
         do i = 1, self%grid%nx
            from = self%grid%column_at(i - whole(1))
            height(i, j) = self%lowest
            if (from > 0) height(i, j) = row(from)
         end do
      end do
      deallocate (row)
      !$omp end parallel
   end subroutine moved_height

   !> H(X) = H_0(X - D) and its slopes.
   subroutine shifted(self, shift_x, shift_y, height, slope_x, slope_y)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y     !! D, m
      real(dp), intent(out), contiguous :: height(:, :)    !! H, m, shape [nx, rows of this process]
      real(dp), intent(out), contiguous :: slope_x(:, :)   !! dH_0/dx at X - D, shape [nx, rows of this process]
      real(dp), intent(out), contiguous :: slope_y(:, :)   !! dH_0/dy at X - D, shape [nx, rows of this process]
      type(shift_type) :: shift
      real(dp), allocatable :: p(:), q(:)
      integer :: j

      shift = shift_in_cells(self%grid, [shift_x, shift_y])
      if (self%periodic .and. .not. self%cubic .and. shift%is_whole()) then
         ! For whole cells, the differences of the moved map are the moved differences of the map.
         call moved_height(self, shift%whole, height)
         call central_slopes(self%grid, height, slope_x, slope_y)
         return
      end if
      call have_shifted_rows(self, shift)
      allocate (p(self%grid%nx), q(self%grid%nx))
      p(:) = -shift%part(1)
      q(:) = -shift%part(2)
      !$omp parallel do default(none) shared(self, height, slope_x, slope_y, shift, p, q)
      do j = 1, self%grid%rows()
         call map_row(self, -shift%whole(1), shift%first + j - 1, p, q, height(:, j), slope_x(:, j), slope_y(:, j))
      end do
      ! For whole cells take the heights themselves, because the spline gives them with round-off.
      if (shift%is_whole()) call moved_height(self, shift%whole, height)
   end subroutine shifted

   !> H(X) = H_0(X + s(X) - D) and the slopes of H_0 there.
   subroutine displaced(self, shift_x, shift_y, displacement_x, displacement_y, height, &
      slope_x, slope_y)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y          !! D, m
      real(dp), intent(in) :: displacement_x(:, :)      !! s along x, m, shape [nx, rows of this process]
      real(dp), intent(in) :: displacement_y(:, :)      !! s along y, m, shape [nx, rows of this process]
      real(dp), intent(out), contiguous :: height(:, :)    !! H, m, shape [nx, rows of this process]
      real(dp), intent(out), contiguous :: slope_x(:, :)   !! dH_0/dx at X + s - D, shape [nx, rows of this process]
      real(dp), intent(out), contiguous :: slope_y(:, :)   !! dH_0/dy at X + s - D, shape [nx, rows of this process]
      type(shift_type) :: shift
      integer :: j
      real(dp) :: per_dx, per_dy

      shift = shift_in_cells(self%grid, [shift_x, shift_y])
      per_dx = 1.0_dp/self%grid%dx
      per_dy = 1.0_dp/self%grid%dy
      call have_displaced_rows(self, shift, displacement_y)
      !$omp parallel do default(none) shared(self, height, slope_x, slope_y, displacement_x, displacement_y, shift, &
      !$omp per_dx, per_dy)
      do j = 1, self%grid%rows()
         call map_row(self, -shift%whole(1), shift%first + j - 1, displacement_x(:, j)*per_dx - shift%part(1), &
            displacement_y(:, j)*per_dy - shift%part(2), height(:, j), slope_x(:, j), slope_y(:, j))
      end do
   end subroutine displaced

   !> Make the rows available that are needed for a uniform shift. Collective.
   subroutine have_shifted_rows(self, shift)
      type(interpolation_type), intent(inout) :: self
      type(shift_type), intent(in) :: shift
      integer :: first

      first = shift%first + floor(-shift%part(2))
      call self%rows%have(first, first + self%grid%rows() - 1)
   end subroutine have_shifted_rows

   !> Make the rows available that are needed at displaced places. Collective.
   subroutine have_displaced_rows(self, shift, displacement_y)
      type(interpolation_type), intent(inout) :: self
      type(shift_type), intent(in) :: shift
      real(dp), intent(in) :: displacement_y(:, :)      !! m, shape [nx, rows of this process]
      integer :: highest, j, lowest
      real(dp) :: per_dy

      if (.not. self%grid%shared) return
      lowest = huge(1)
      highest = -huge(1)
      per_dy = 1.0_dp/self%grid%dy
      !$omp parallel do default(none) shared(self, displacement_y, per_dy, shift) &
      !$omp reduction(min:lowest) reduction(max:highest)
      do j = 1, self%grid%rows()
         lowest = min(lowest, shift%first + j - 1 &
            + whole_below(minval(displacement_y(:, j))*per_dy - shift%part(2)))
         highest = max(highest, shift%first + j - 1 &
            + whole_below(maxval(displacement_y(:, j))*per_dy - shift%part(2)))
      end do
      if (self%grid%rows() == 0) call self%rows%have(0, 0)
      if (self%grid%rows() > 0) call self%rows%have(lowest, highest)
   end subroutine have_displaced_rows

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
      below = whole_below(q)
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

   !> The largest whole number not above q. Very large values are limited to the range of integers.
   elemental function whole_below(q) result(below)
      real(dp), intent(in) :: q                 !! cells
      integer :: below

      below = floor(max(-1.0e9_dp, min(1.0e9_dp, q)))
   end function whole_below

   !> Heights and slopes at the places (i + p_1, j + q_1), (i + 1 + p_2, j + q_2), and so on, in cells from 0.
   !>
   !> Most neighbours lie in neighbouring cells, because the rubber is displaced smoothly. Such runs are read together.
   pure subroutine map_row(self, i, j, p, q, h, h_x, h_y)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: p(:), q(:)
      real(dp), intent(out), contiguous :: h(:), h_x(:), h_y(:)
      integer :: cell_x(size(p)), cell_y(size(p)), first, k, last
      real(dp) :: u(size(p)), v(size(p)), weight_x(size(p)), weight_y(size(p))

      call locate(self%periodic, self%grid%nx, [(i + k - 1, k=1, size(p))], p, cell_x, u, weight_x)
      call locate(self%periodic, self%grid%ny, j, q, cell_y, v, weight_y)
      first = 1
      do while (first <= size(p))
         last = end_of_run(self%cubic, cell_x, cell_y, first)
         if (self%cubic) then
            call spline_run(self%rows%values, cell_x(first), self%rows%place(cell_y(first) - 1:cell_y(first) + 2), &
               u(first:last), v(first:last), h(first:last), h_x(first:last), h_y(first:last))
         else
            call bilinear_slopes(self%rows, cell_x(first), cell_y(first), u(first), v(first), h(first), h_x(first), &
               h_y(first))
         end if
         first = last + 1
      end do
      h_x(:) = h_x/self%grid%dx
      h_y(:) = h_y/self%grid%dy
      if (self%grid%ny == 1) h_y(:) = 0.0_dp
      if (self%periodic) return
      weight_x(:) = weight_x*weight_y
      h(:) = blend(h, self%lowest, weight_x)
      h_x(:) = weight_x*h_x
      h_y(:) = weight_x*h_y
   end subroutine map_row

   !> The last place of the run of neighbouring cells that begins at `first`. The bilinear map is read place by place.
   pure integer function end_of_run(cubic, cell_x, cell_y, first) result(last)
      logical, intent(in) :: cubic
      integer, intent(in) :: cell_x(:), cell_y(:)
      integer, intent(in) :: first

      last = first
      if (.not. cubic) return
      do while (last < min(size(cell_x), first + most_places - 1))
         if (cell_x(last + 1) /= cell_x(last) + 1 .or. cell_y(last + 1) /= cell_y(last)) return
         last = last + 1
      end do
   end function end_of_run

   !> Mean of h with this weight and the lowest height with the rest.
   elemental function blend(h, lowest, weight) result(mixed)
      real(dp), intent(in) :: h, lowest, weight
      real(dp) :: mixed

      mixed = h
      if (weight < 1.0_dp) mixed = lowest + weight*(h - lowest)
   end function blend

end module asperity_interpolation
