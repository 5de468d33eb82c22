!> The equations of a contact with friction for all cells at once, which module `joint_newton` solves.
!>
!> The unknowns are a number s per cell (module `joint_cells`: gap, pressure and share of the bound), its traction
!> T, and the level. There are two such systems: a step in time (module `joint_equations`) and a state of
!> steady sliding (module `steady_joint`). Each computes the residuals of its equations:
!>
!>     U_z - H - level = gap            of every cell
!>     T = bound of T and the slip      0 where the cell is open
!>     mean of P = load                 or the level is given
!>
!> Each equation is scaled: lengths by the depth to which the mean pressure of the contact presses a cell, and
!> tractions by that pressure or by the strength, whichever is larger. If the contact has been lost, the pressure that
!> presses a cell in by the height of the road over its width takes the place of the mean pressure.
!>
!> An approximate inverse of the derivative of the equations couples the cells of small tiles completely (module
!> `joint_tiles`). The level follows from the load: the tiles also give the change of all unknowns with the level.
module joint_system
   use asperity_precision, only : dp
   use asperity_parallel, only : any_process, gather_rows
   use cell_derivative, only : cell_derivative_type, joint_cell_type, new_cell_derivative
   use field_sums, only : field_count, field_sum, largest_of_rows, row_totals, threads_for
   use gmres, only : cell_vector_type
   use joint_cells, only : cell_rules_type
   use joint_tiles, only : cell_responses_type, joint_tiles_type
   use regular_grid, only : grid_type
   implicit none
   private

   public :: joint_state_type, joint_system_type

   real(dp), parameter :: part_of_cell = 1.0e-4_dp     !! distance of two places where slopes are compared
   real(dp), parameter :: least_slope = 0.05_dp        !! of the road, in the width of the second range of s
   real(dp), parameter :: least_pressure = 1.0e-9_dp   !! below which a contact is taken as lost, in natural units

   !> A state of all cells, and its residuals.
   type :: joint_state_type
      real(dp), allocatable :: s(:, :)                 !! m [nx, rows]
      real(dp), allocatable :: t(:, :, :)              !! Pa [nx, 2, rows]
      real(dp) :: level = 0.0_dp                       !! m
      real(dp) :: part = 1.0_dp                        !! of the way to the place of the road (on a path)
      real(dp), allocatable :: residual(:, :, :)       !! of the equations of a cell, scaled [nx, 3, rows]
      real(dp) :: load_residual = 0.0_dp               !! of the load, scaled, times `root`
      real(dp) :: path_residual = 0.0_dp               !! of the plane across a path, scaled, times `root`
      real(dp) :: merit = 0.0_dp                       !! root of the sum of the squares of all residuals
      real(dp) :: worst = 0.0_dp                       !! largest absolute residual
   contains
      procedure :: make_room
      procedure :: copy
   end type joint_state_type

   !> The equations.
   type, abstract :: joint_system_type
      type(grid_type) :: grid
      integer :: evaluations = 0                       !! so far
      integer :: most_evaluations = huge(1)            !! after which the attempt ends
      type(cell_rules_type) :: rules
      real(dp), allocatable :: width(:, :)             !! of the second range of s, m [nx, rows]
      real(dp) :: unit_length = 1.0_dp                 !! of s, m
      real(dp) :: unit_traction = 1.0_dp               !! Pa
      real(dp) :: unit_pressure = 1.0_dp               !! of the mean, Pa
      real(dp) :: root = 1.0_dp                        !! of the number of cells in contact at the start
      logical :: level_is_given = .false.              !! instead of the load
      type(cell_responses_type) :: near                !! displacements around a loaded cell
      type(joint_tiles_type), private :: tiles
      real(dp), allocatable, private :: lift(:, :)     !! change of all unknowns with the level, scaled [3, all cells]
      real(dp), private :: lift_pressure = 0.0_dp      !! mean pressure of this change, Pa
   contains
      procedure(evaluate_state), deferred :: evaluate
      procedure(read_slopes), deferred :: slopes_at
      procedure(read_slip), deferred :: slip_of
      procedure :: linearise
      procedure :: improve
      procedure :: begin
      procedure :: cell_residual
      procedure :: sum_residuals
      procedure, private :: mean_pressure
   end type joint_system_type

   abstract interface
      !> Compute the residuals of a state.
      subroutine evaluate_state(self, state)
         import :: joint_state_type, joint_system_type
         class(joint_system_type), intent(inout) :: self
         type(joint_state_type), intent(inout) :: state
      end subroutine evaluate_state

      !> Read the slopes of the road near the displaced cells of the state that was evaluated last.
      subroutine read_slopes(self, shift, height, slope_x, slope_y)
         import :: dp, joint_system_type
         class(joint_system_type), intent(inout) :: self
         real(dp), intent(in) :: shift(2)              !! of the places where the road is read, m
         real(dp), intent(out) :: height(:, :), slope_x(:, :), slope_y(:, :)
      end subroutine read_slopes

      !> The slip of a cell in this state as the friction law reads it, m.
      pure function read_slip(self, i, j) result(slip)
         import :: dp, joint_system_type
         class(joint_system_type), intent(in) :: self
         integer, intent(in) :: i, j
         real(dp) :: slip(2)
      end function read_slip
   end interface

contains

   !> Allocate the fields of a state.
   subroutine make_room(self, grid, status)
      class(joint_state_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(out) :: status                   !! not 0: there is not enough memory

      allocate (self%s(grid%nx, grid%rows()), source=0.0_dp, stat=status)
      if (status == 0) allocate (self%t(grid%nx, 2, grid%rows()), source=0.0_dp, stat=status)
      if (status == 0) allocate (self%residual(grid%nx, 3, grid%rows()), source=0.0_dp, stat=status)
   end subroutine make_room

   !> Copy another state to the existing fields.
   subroutine copy(self, other)
      class(joint_state_type), intent(inout) :: self
      type(joint_state_type), intent(in) :: other

      self%s(:, :) = other%s
      self%t(:, :, :) = other%t
      self%residual(:, :, :) = other%residual
      self%level = other%level
      self%part = other%part
      self%load_residual = other%load_residual
      self%path_residual = other%path_residual
      self%merit = other%merit
      self%worst = other%worst
   end subroutine copy

   !> Prepare `improve` for a state, which has been evaluated last. `done` is .false. if there is not enough memory.
   subroutine linearise(self, state, first, cell, done)
      class(joint_system_type), intent(inout) :: self
      type(joint_state_type), intent(in) :: state
      integer, intent(in) :: first(:)                  !! [rows + 1] the first cell of each row in the list of cells
      integer, intent(in) :: cell(:)                   !! the cells of the list, i
      logical, intent(out) :: done
      type(joint_cell_type), allocatable :: cells(:)
      type(cell_derivative_type), allocatable :: derivative(:)
      integer :: k, n, status(2)

      n = first(size(first)) - 1
      allocate (cells(n), stat=status(1))
      allocate (derivative(n), stat=status(2))
      done = .not. any_process(any(status /= 0))
      if (done) call describe_cells(self, state, first, cell, cells, done)
      if (.not. done) return

      !$omp parallel do default(none) shared(self, cells, derivative, n)
      do k = 1, n
         derivative(k) = new_cell_derivative(self%rules, cells(k), self%unit_length, self%unit_traction)
      end do
      deallocate (cells)
      call self%tiles%renew(self%grid, first, cell, derivative, self%near, [self%unit_length, self%unit_traction], done)
      if (.not. done) return

      if (allocated(self%lift)) deallocate (self%lift)
      allocate (self%lift(3, size(self%tiles%derivative)), source=0.0_dp, stat=status(1))
      done = .not. any_process(status(1) /= 0)
      if (.not. done) return
      self%lift(1, :) = 1.0_dp
      call self%tiles%apply(self%lift)
      self%lift_pressure = self%mean_pressure(self%lift)
   end subroutine linearise

   !> Collect the state of each listed cell, and the road under it.
   subroutine describe_cells(self, state, first, cell, cells, done)
      class(joint_system_type), intent(inout) :: self
      type(joint_state_type), intent(in) :: state
      integer, intent(in) :: first(:), cell(:)
      type(joint_cell_type), intent(inout) :: cells(:)
      logical, intent(out) :: done
      real(dp), allocatable :: road(:, :, :)           !! height and slopes
      real(dp) :: shift(2), step
      integer :: along, i, j, k, status

      allocate (road(size(state%s, 1), size(state%s, 2), 3), stat=status)
      done = .not. any_process(status /= 0)
      if (.not. done) return
      do along = 0, 2
         shift = 0.0_dp
         step = 1.0_dp
         if (along > 0) then
            step = part_of_cell*merge(self%grid%dx, self%grid%dy, along == 1)
            shift(along) = step
         end if
         call self%slopes_at(shift, road(:, :, 1), road(:, :, 2), road(:, :, 3))
         do j = 1, size(state%s, 2)
            do k = first(j), first(j + 1) - 1
               i = cell(k)
               if (along > 0) then
                  cells(k)%curvature(:, along) = (road(i, j, 2:3) - cells(k)%slope)/step
               else
                  cells(k)%s = state%s(i, j)
                  cells(k)%t = state%t(i, :, j)
                  cells(k)%width = self%width(i, j)
                  cells(k)%slip = self%slip_of(i, j)
                  cells(k)%slope = road(i, j, 2:3)
               end if
            end do
         end do
      end do
   end subroutine describe_cells

   !> The mean over the grid of the pressure that changes of the unknowns cause, Pa.
   pure function mean_pressure(self, v) result(mean)
      class(joint_system_type), intent(in) :: self
      real(dp), intent(in) :: v(:, :)                  !! scaled [3, all cells]
      real(dp) :: mean
      integer :: n

      mean = 0.0_dp
      do n = 1, size(v, 2)
         mean = mean + v(1, n)*self%tiles%derivative(n)%pressure
      end do
      mean = mean/self%grid%cells()
   end function mean_pressure

   !> Replace scaled residuals by the changes of the scaled unknowns that would nearly remove them.
   subroutine improve(self, v, before)
      class(joint_system_type), intent(in) :: self
      type(cell_vector_type), intent(inout) :: v       !! of the cells of this process
      integer, intent(in) :: before                    !! listed cells of the processes before this one
      real(dp), allocatable :: all_cells(:, :)
      real(dp) :: level                                !! change of the level, scaled
      integer :: n

      if (self%grid%shared) then
         all_cells = gather_rows(v%cells)
      else
         all_cells = v%cells
      end if
      call self%tiles%apply(all_cells)

      level = v%beside(1)/self%root
      if (.not. self%level_is_given) then
         level = 0.0_dp
         if (abs(self%lift_pressure) > 0.0_dp) level = (v%beside(1)*self%unit_pressure/self%root &
            - self%mean_pressure(all_cells))/self%lift_pressure
      end if
      v%beside(1) = level*self%root
      do n = 1, size(v%cells, 2)
         v%cells(:, n) = all_cells(:, before + n) + level*self%lift(:, before + n)
      end do
   end subroutine improve

   !> Begin with a contact: choose the units and the width of the second range, and make the first state. The caller has
   !> set the grid and the rules, and sets the level of the state.
   subroutine begin(self, touching, pressure, gap, traction, jumps, rms_slope, state)
      class(joint_system_type), intent(inout) :: self
      logical, intent(in) :: touching(:, :)
      real(dp), intent(in) :: pressure(:, :), gap(:, :)       !! Pa, m
      real(dp), intent(in) :: traction(:, :, :)               !! Pa
      logical, intent(in) :: jumps(:, :)                      !! the traction jumps where the contact ends
      real(dp), intent(in) :: rms_slope                       !! of the road
      type(joint_state_type), intent(inout) :: state
      integer :: c

      call self%tiles%forget()
      call choose_units(self, touching, pressure, rms_slope)
      self%width(:, :) = merge(self%rules%width, 0.0_dp, jumps)
      state%s(:, :) = self%rules%number_of(self%width, touching, pressure, gap)
      do c = 1, 2
         state%t(:, c, :) = merge(traction(:, c, :), 0.0_dp, touching)
      end do
   end subroutine begin

   !> Choose the units and the width of the second range.
   subroutine choose_units(self, touching, pressure, rms_slope)
      class(joint_system_type), intent(inout) :: self
      logical, intent(in) :: touching(:, :)
      real(dp), intent(in) :: pressure(:, :)           !! Pa
      real(dp), intent(in) :: rms_slope                !! of the road
      real(dp) :: slope, natural

      associate (rules => self%rules)
         slope = max(rms_slope, least_slope)
         natural = slope*self%grid%cell_side()/rules%soft
         self%root = sqrt(max(real(field_count(touching), dp), 1.0_dp))
         self%unit_traction = field_sum(abs(pressure))/self%root**2
         if (.not. self%unit_traction > least_pressure*natural) self%unit_traction = natural
         self%unit_pressure = self%unit_traction*self%root**2/self%grid%cells()
         self%unit_length = rules%soft*self%unit_traction
         self%unit_traction = max(self%unit_traction, rules%law%bare_strength())
         rules%width = rules%soft_along*slope*self%unit_traction
         if (rules%law%jumps_at_edge()) rules%width = rules%soft_along*slope*rules%law%bare_strength()
      end associate
   end subroutine choose_units

   !> Compute the residuals of a cell.
   pure subroutine cell_residual(self, state, i, j, distance, pressure, slope, slip)
      class(joint_system_type), intent(in) :: self
      type(joint_state_type), intent(inout) :: state
      integer, intent(in) :: i, j
      real(dp), intent(in) :: distance                 !! U_z - H, m
      real(dp), intent(in) :: pressure                 !! Pa
      real(dp), intent(in) :: slope(2)                 !! of the road
      real(dp), intent(in) :: slip(2)                  !! m
      real(dp) :: share, traction(2)

      traction = state%t(i, :, j)
      state%residual(i, 1, j) = (distance - state%level - self%rules%gap_of(state%s(i, j)))/self%unit_length
      share = self%rules%share_of(self%width(i, j), state%s(i, j))
      state%residual(i, 2:3, j) = self%rules%traction_error(share, pressure, merge(slope, 0.0_dp, self%rules%law%slope_effect), &
         slip, traction)/self%unit_traction
   end subroutine cell_residual

   !> Sum the residuals of all cells, and compute that of the load: of the mean pressure, or of the level if it is given.
   subroutine sum_residuals(self, state, pressure, target, level)
      class(joint_system_type), intent(in) :: self
      type(joint_state_type), intent(inout) :: state
      real(dp), intent(in) :: pressure(:, :)           !! Pa
      real(dp), intent(in) :: target                   !! mean pressure, Pa
      real(dp), intent(in), optional :: level          !! m; it replaces the mean pressure
      real(dp), allocatable :: rows(:, :), largest(:)
      real(dp) :: sums(2)
      integer :: j

      allocate (rows(2, self%grid%rows()), largest(self%grid%rows()))
      !$omp parallel do default(none) shared(self, state, pressure, rows, largest) private(j) &
      !$omp num_threads(threads_for(pressure))
      do j = 1, self%grid%rows()
         rows(:, j) = [sum(state%residual(:, :, j)**2), sum(pressure(:, j))]
         largest(j) = maxval(abs(state%residual(:, :, j)))
      end do
      sums = row_totals(rows)
      state%load_residual = (sums(2)/self%grid%cells() - target)/self%unit_pressure
      if (present(level)) state%load_residual = (state%level - level)/self%unit_length
      state%worst = max(largest_of_rows(largest), abs(state%load_residual))
      state%load_residual = state%load_residual*self%root
      state%merit = sqrt(sums(1) + state%load_residual**2)
   end subroutine sum_residuals

end module joint_system
