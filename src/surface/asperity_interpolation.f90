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
!> Where processes share the rows of the map, each holds its own, and those under which its rubber is at
!> present: the displacement says which. They are fetched from their owners when the road has moved on, with
!> some more on either side, so that most steps find what they need. The map does not change, so that what
!> has been fetched remains right.
!>
!> Memory: the map, and for 'cubic' one field of coefficients; where processes share the rows, up to one more
!> field.
module asperity_interpolation
   use cubic_spline, only : spline_coefficients, spline_height, spline_map
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_minimum
   use regular_grid, only : boundary_periodic, grid_type
   use row_fetch, only : fetch_rows, foreign_rows, row_in_grid
   use surface_slopes, only : central_slopes, neighbours
   implicit none
   private

   public :: displaced, interpolation_type, new_interpolation, shifted

   real(dp), parameter :: whole_within = 1.0e-9_dp    !! cells
   integer, parameter :: spare = 4                    !! rows that are fetched beyond those needed
   integer, parameter :: reach(2) = [-1, 2]           !! rows read about the place of a cell

   !> A height map that can be evaluated between its cells.
   type :: interpolation_type
      type(grid_type) :: grid
      real(dp) :: lowest = 0.0_dp                     !! the lowest value of the map, m
      logical, private :: cubic = .false.
      logical, private :: periodic = .true.
      !> The original map H_0, m [nx, rows]: first the rows of this process. 'linear' reads it, and keeps the
      !> rows that it has fetched behind them.
      real(dp), allocatable, private :: height(:, :)
      !> The coefficients of 'cubic', m [-1:nx + 1, rows]: the rows of this process, the rim, and others.
      real(dp), allocatable, private :: coefficients(:, :)
      integer, private :: lasting = 0                 !! rows of what is read that are always there
      !> Where each row is in what is read, from row -1, in front of the map, to ny + 1. Rows that are
      !> not there have a place that may be read all the same.
      integer, allocatable, private :: place(:)
      logical, allocatable, private :: there(:)       !! of each row from 0 to ny - 1
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

   !> Copy a map and prepare what its interpolation needs. Collective, like all that follows.
   subroutine new_interpolation(self, grid, height, method, error)
      type(interpolation_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: height(:, :)                !! m, shape [nx, rows of this process]
      character(*), intent(in) :: method                  !! 'cubic' | 'linear'
      type(error_type), allocatable, intent(out) :: error
      integer :: j

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
      allocate (self%height(grid%nx, grid%rows() + merge(0, foreign_room(grid), self%cubic)))
      !$omp parallel do default(none) shared(grid, height, self)
      do j = 1, grid%rows()
         self%height(:, j) = height(:, j)
      end do
      self%lowest = field_minimum(height)
      self%lasting = grid%rows()
      if (self%cubic) call new_coefficients(self)
      call place_lasting_rows(self)
   end subroutine new_interpolation

   !> The coefficients of the spline.
   subroutine new_coefficients(self)
      type(interpolation_type), intent(inout) :: self
      real(dp), allocatable :: rim(:, :)

      associate (grid => self%grid)
         ! A bounded map has a rim. A periodic one has none.
         if (.not. self%periodic) self%lasting = grid%rows() + 2
         allocate (self%coefficients(-1:grid%nx + 1, self%lasting + foreign_room(grid)), rim(grid%nx + 3, 2))
         call spline_coefficients(grid, self%height, self%coefficients(:, :grid%rows()), rim)
         if (.not. self%periodic) self%coefficients(:, grid%rows() + 1:self%lasting) = rim
      end associate
   end subroutine new_coefficients

   !> Room for rows of other processes, so that the road needs no larger copy when it moves on. It takes
   !> no memory before rows are put there.
   pure integer function foreign_room(grid)
      type(grid_type), intent(in) :: grid

      foreign_room = 0
      if (grid%shared) foreign_room = min(grid%rows() + reach(2) - reach(1) + 2*spare, grid%ny)
   end function foreign_room

   !> The places of the rows that are always there.
   subroutine place_lasting_rows(self)
      type(interpolation_type), intent(inout) :: self
      integer :: row

      associate (grid => self%grid)
         if (.not. allocated(self%place)) allocate (self%place(-1:grid%ny + 1), self%there(0:grid%ny - 1))
         self%place = 1
         self%there = .false.
         do row = 0, grid%rows() - 1
            self%place(grid%first_row - 1 + row) = row + 1
            self%there(grid%first_row - 1 + row) = .true.
         end do
         call place_ends(self)
      end associate
   end subroutine place_lasting_rows

   !> The places of the rows in front of the map and behind it.
   pure subroutine place_ends(self)
      type(interpolation_type), intent(inout) :: self

      associate (ny => self%grid%ny)
         if (self%periodic) then
            self%place(-1) = self%place(ny - 1)
            self%place(ny) = self%place(0)
            self%place(ny + 1) = self%place(modulo(1, ny))
         else if (self%cubic) then
            self%place(-1) = self%lasting - 1
            self%place(ny:) = self%lasting
         end if
      end associate
   end subroutine place_ends

   !> Have the rows that are read at these places along y. Collective.
   subroutine have_rows(self, places)
      type(interpolation_type), intent(inout) :: self
      integer, intent(in) :: places(2)             !! least and largest, cells from 0, of this process
      integer :: range(2), row
      logical :: missing

      if (.not. self%grid%shared) return
      range = clipped(self, places + reach)
      if (self%grid%rows() == 0) range = [0, -1]
      missing = .false.
      do row = range(1), range(2)
         missing = missing .or. .not. self%there(modulo(row, self%grid%ny))
      end do
      if (.not. any_process(missing)) return
      if (self%grid%rows() > 0) range = clipped(self, places + reach + [-spare, spare])
      call place_lasting_rows(self)
      if (self%cubic) then
         call add_rows(self, range, self%coefficients)
      else
         call add_rows(self, range, self%height)
      end if
   end subroutine have_rows

   !> A range of rows from 0, within a free map, and not longer than a period.
   pure function clipped(self, wanted) result(range)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: wanted(2)
      integer :: range(2)

      associate (ny => self%grid%ny)
         if (.not. self%periodic) then
            ! Beyond the rim the map goes on as at the rim.
            range(1) = min(max(wanted(1), 0), max(ny - 2 + reach(1), 0))
            range(2) = max(min(wanted(2), ny - 1), min(reach(2), ny - 1))
         else if (wanted(2) - wanted(1) < ny) then
            range = wanted
         else
            range = [0, ny - 1]
         end if
      end associate
   end function clipped

   !> Fetch the rows of a range that other processes hold, and place them behind those that are always there.
   subroutine add_rows(self, range, values)
      type(interpolation_type), intent(inout) :: self
      integer, intent(in) :: range(2)              !! from 0
      real(dp), allocatable, intent(inout) :: values(:, :)
      real(dp), allocatable :: more(:, :)
      integer, allocatable :: list(:)
      integer :: k, needed

      list = foreign_rows(self%grid, range + 1)
      needed = self%lasting + size(list)
      if (needed > size(values, 2)) then
         allocate (more(lbound(values, 1):ubound(values, 1), needed + 2*spare))
         more(:, :self%lasting) = values(:, :self%lasting)
         call move_alloc(more, values)
      end if
      call fetch_rows(self%grid, values(:, :self%grid%rows()), range + 1, &
         values(:, self%lasting + 1:needed), only_foreign=.true.)
      do k = 1, size(list)
         self%place(list(k) - 1) = self%lasting + k
         self%there(list(k) - 1) = .true.
      end do
      call place_ends(self)
   end subroutine add_rows

   !> H(X) = H_0(X - D).
   subroutine shifted_height(self, shift_x, shift_y, height)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y     !! D, m
      real(dp), intent(out) :: height(:, :)        !! H, m, shape [nx, rows of this process]
      integer :: first, i, j, whole_x, whole_y
      real(dp) :: part_x, part_y

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      if (.not. (abs(part_x) > 0.0_dp .or. abs(part_y) > 0.0_dp)) then
         call moved_height(self, whole_x, whole_y, height)
         return
      end if
      first = self%grid%first_row - 1 - whole_y
      call have_rows(self, first + [0, self%grid%rows() - 1] + floor(-part_y))
      !$omp parallel do default(none) shared(self, height, whole_x, first, part_x, part_y) private(i)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            height(i, j) = height_at(self, i - 1 - whole_x, first + j - 1, -part_x, -part_y)
         end do
      end do
   end subroutine shifted_height

   !> The heights themselves, moved by whole cells; the lowest height of the map outside a free map.
   subroutine moved_height(self, whole_x, whole_y, height)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: whole_x, whole_y
      real(dp), intent(out) :: height(:, :)        !! m, shape [nx, rows of this process]
      real(dp), allocatable :: row(:)
      integer :: from, i, j

      call fetch_rows(self%grid, self%height(:, :self%grid%rows()), &
         [self%grid%first_row, self%grid%last_row] - whole_y, height)
      !$omp parallel default(none) shared(self, height, whole_x, whole_y) private(i, j, from, row)
      allocate (row(self%grid%nx))
      !$omp do
      do j = 1, self%grid%rows()
         row(:) = height(:, j)
         if (row_in_grid(self%grid, self%grid%first_row - 1 + j - whole_y) == 0) row(:) = self%lowest
         do i = 1, self%grid%nx
            from = i - whole_x
            if (self%periodic) from = modulo(from - 1, self%grid%nx) + 1
            height(i, j) = self%lowest
            if (from >= 1 .and. from <= self%grid%nx) height(i, j) = row(from)
         end do
      end do
      deallocate (row)
      !$omp end parallel
   end subroutine moved_height

   !> H(X) = H_0(X - D) and its slopes.
   subroutine shifted_map(self, shift_x, shift_y, height, slope_x, slope_y)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y     !! D, m
      real(dp), intent(out) :: height(:, :)        !! H, m, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_x(:, :)       !! dH_0/dx at X - D, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_y(:, :)       !! dH_0/dy at X - D, shape [nx, rows of this process]
      integer :: first, i, j, whole_x, whole_y
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
      first = self%grid%first_row - 1 - whole_y
      call have_rows(self, first + [0, self%grid%rows() - 1] + floor(-part_y))
      !$omp parallel do default(none) private(i) &
      !$omp shared(self, height, slope_x, slope_y, whole_x, first, part_x, part_y)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            call map_at(self, i - 1 - whole_x, first + j - 1, -part_x, -part_y, &
               height(i, j), slope_x(i, j), slope_y(i, j))
         end do
      end do
      ! For whole cells take the heights themselves, because the spline gives them with round-off.
      if (.not. (abs(part_x) > 0.0_dp .or. abs(part_y) > 0.0_dp)) &
         call shifted_height(self, shift_x, shift_y, height)
   end subroutine shifted_map

   !> H(X) = H_0(X + s(X) - D).
   subroutine displaced_height(self, shift_x, shift_y, displacement_x, displacement_y, height)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y          !! D, m
      real(dp), intent(in) :: displacement_x(:, :)      !! s along x, m, shape [nx, rows of this process]
      real(dp), intent(in) :: displacement_y(:, :)      !! s along y, m, shape [nx, rows of this process]
      real(dp), intent(out) :: height(:, :)             !! H, m, shape [nx, rows of this process]
      integer :: first, i, j, whole_x, whole_y
      real(dp) :: part_x, part_y, per_dx, per_dy

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      per_dx = 1.0_dp/self%grid%dx
      per_dy = 1.0_dp/self%grid%dy
      first = self%grid%first_row - 1 - whole_y
      call have_displaced_rows(self, displacement_y, per_dy, first, part_y)
      !$omp parallel do default(none) private(i) shared(self, height, displacement_x, &
      !$omp displacement_y, whole_x, first, part_x, part_y, per_dx, per_dy)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            height(i, j) = height_at(self, i - 1 - whole_x, first + j - 1, &
               displacement_x(i, j)*per_dx - part_x, displacement_y(i, j)*per_dy - part_y)
         end do
      end do
   end subroutine displaced_height

   !> H(X) = H_0(X + s(X) - D) and the slopes of H_0 there.
   subroutine displaced_map(self, shift_x, shift_y, displacement_x, displacement_y, height, &
      slope_x, slope_y)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: shift_x, shift_y          !! D, m
      real(dp), intent(in) :: displacement_x(:, :)      !! s along x, m, shape [nx, rows of this process]
      real(dp), intent(in) :: displacement_y(:, :)      !! s along y, m, shape [nx, rows of this process]
      real(dp), intent(out) :: height(:, :)             !! H, m, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_x(:, :)            !! dH_0/dx at X + s - D, shape [nx, rows of this process]
      real(dp), intent(out) :: slope_y(:, :)            !! dH_0/dy at X + s - D, shape [nx, rows of this process]
      integer :: first, i, j, whole_x, whole_y
      real(dp) :: part_x, part_y, per_dx, per_dy

      call split(self%periodic, self%grid%nx, shift_x/self%grid%dx, whole_x, part_x)
      call split(self%periodic, self%grid%ny, shift_y/self%grid%dy, whole_y, part_y)
      per_dx = 1.0_dp/self%grid%dx
      per_dy = 1.0_dp/self%grid%dy
      first = self%grid%first_row - 1 - whole_y
      call have_displaced_rows(self, displacement_y, per_dy, first, part_y)
      !$omp parallel do default(none) private(i) shared(self, height, slope_x, slope_y, &
      !$omp displacement_x, displacement_y, whole_x, first, part_x, part_y, per_dx, per_dy)
      do j = 1, self%grid%rows()
         do i = 1, self%grid%nx
            call map_at(self, i - 1 - whole_x, first + j - 1, &
               displacement_x(i, j)*per_dx - part_x, displacement_y(i, j)*per_dy - part_y, &
               height(i, j), slope_x(i, j), slope_y(i, j))
         end do
      end do
   end subroutine displaced_map

   !> Have the rows that are read at displaced places. Collective.
   subroutine have_displaced_rows(self, displacement_y, per_dy, first, part_y)
      type(interpolation_type), intent(inout) :: self
      real(dp), intent(in) :: displacement_y(:, :)      !! m, shape [nx, rows of this process]
      real(dp), intent(in) :: per_dy                    !! 1/dy, 1/m
      integer, intent(in) :: first                      !! place of the first row, cells from 0
      real(dp), intent(in) :: part_y                    !! part of a cell by which the road has moved
      integer :: highest, j, lowest

      if (.not. self%grid%shared) return
      lowest = huge(1)
      highest = -huge(1)
      !$omp parallel do default(none) shared(self, displacement_y, per_dy, first, part_y) &
      !$omp reduction(min:lowest) reduction(max:highest)
      do j = 1, self%grid%rows()
         lowest = min(lowest, first + j - 1 + whole_below(minval(displacement_y(:, j))*per_dy - part_y))
         highest = max(highest, first + j - 1 + whole_below(maxval(displacement_y(:, j))*per_dy - part_y))
      end do
      if (self%grid%rows() == 0) call have_rows(self, [0, 0])
      if (self%grid%rows() > 0) call have_rows(self, [lowest, highest])
   end subroutine have_displaced_rows

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

   !> The whole number below; of a place far away, one that is far away, too.
   elemental function whole_below(q) result(below)
      real(dp), intent(in) :: q                 !! cells
      integer :: below

      below = floor(max(-1.0e9_dp, min(1.0e9_dp, q)))
   end function whole_below

   !> Height at the place (i + p, j + q), in cells from 0.
   pure function height_at(self, i, j, p, q) result(h)
      type(interpolation_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp), intent(in) :: p, q
      real(dp) :: h
      integer :: cell_x, cell_y, i1, j0, j1
      real(dp) :: u, v, weight_x, weight_y

      call locate(self%periodic, self%grid%nx, i, p, cell_x, u, weight_x)
      call locate(self%periodic, self%grid%ny, j, q, cell_y, v, weight_y)
      if (self%cubic) then
         h = spline_height(self%coefficients, cell_x, self%place(cell_y - 1:cell_y + 2), u, v)
      else
         i1 = next(cell_x, self%grid%nx)
         j0 = self%place(cell_y)
         j1 = self%place(next(cell_y, self%grid%ny) - 1)
         h = (1.0_dp - v)*((1.0_dp - u)*self%height(cell_x + 1, j0) &
            + u*self%height(i1, j0)) &
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
         call spline_map(self%coefficients, cell_x, self%place(cell_y - 1:cell_y + 2), u, v, h, h_x, h_y)
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
      integer :: east, i1, j0, j1, north, south, unused, west
      real(dp) :: per_x0, per_x1, per_y0, per_y1, w00, w01, w10, w11

      i1 = next(i - 1, self%grid%nx)
      j1 = next(j - 1, self%grid%ny)
      call neighbours(self%periodic, self%grid%nx, i, west, unused, per_x0)
      call neighbours(self%periodic, self%grid%nx, i1, unused, east, per_x1)
      call neighbours(self%periodic, self%grid%ny, j, south, unused, per_y0)
      call neighbours(self%periodic, self%grid%ny, j1, unused, north, per_y1)
      ! From here on, numbers of rows are their places.
      south = self%place(south - 1)
      north = self%place(north - 1)
      j0 = self%place(j - 1)
      j1 = self%place(j1 - 1)
      w00 = (1.0_dp - u)*(1.0_dp - v)
      w10 = u*(1.0_dp - v)
      w01 = (1.0_dp - u)*v
      w11 = u*v
      associate (h_0 => self%height)
         h = w00*h_0(i, j0) + w10*h_0(i1, j0) + w01*h_0(i, j1) + w11*h_0(i1, j1)
         h_u = per_x0*(w00*(h_0(i1, j0) - h_0(west, j0)) + w01*(h_0(i1, j1) - h_0(west, j1))) &
            + per_x1*(w10*(h_0(east, j0) - h_0(i, j0)) + w11*(h_0(east, j1) - h_0(i, j1)))
         h_v = per_y0*(w00*(h_0(i, j1) - h_0(i, south)) + w10*(h_0(i1, j1) - h_0(i1, south))) &
            + per_y1*(w01*(h_0(i, north) - h_0(i, j0)) + w11*(h_0(i1, north) - h_0(i1, j0)))
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
