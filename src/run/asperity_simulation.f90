!> The step loop: a rubber block pressed on a road and moved over it.
!>
!> A row of the history is one solve: `advance` takes the next from the schedule, moves the road,
!> solves the contact, ends the step of the material and books the energies. Who calls it writes
!> files or fills arrays. The state can be saved and taken up again (module simulation_state).
!>
!> A row in which friction acts is made of passes: module `coupled_passes`. The state and what solves
!> it: module `contact_state`. How the road moves at the start of a row: module `road_motion`.
module asperity_simulation
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use case_settings, only : case_type, road_moves
   use contact_rule, only : touches
   use contact_size, only : cells_across, watch_contact_size
   use contact_state, only : contact_state_type, solve_normal
   use coupled_passes, only : coupled_passes_type, new_coupled_passes
   use coupling_advice, only : advice_on_passes
   use asperity_errors, only : error_type
   use finite_fields, only : reason_overflow
   use history_row, only : history_row_type, row_values
   use asperity_interpolation, only : new_interpolation
   use map_edge, only : edge_clear, look_at_edge
   use normal_step, only : new_normal_step
   use outside_balance, only : book_outside
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, int64, int8
   use pulled_road, only : guess_road, pull_outcome, take_road, watch_way
   use road_motion, only : move_road, place_road
   use asperity_schedule, only : next_row, planned_row_type, schedule_type
   use solver_result, only : solver_result_type
   use steady_step, only : new_steady_step, steady_step_type
   use starting_steps, only : part_sums_type, split_start
   use stick_slip_watch, only : stick_slip_watch_type, watch_slip
   use asperity_surface, only : new_height
   use tangential_state, only : new_tangential_state
   use text_tools, only : to_text
   use viscoelastic_energy, only : book_step, new_books
   use zener, only : commit_history, destroy_history, extrapolates, finish_step, history_field, &
      is_elastic, needs_start, new_history, new_products, new_zener, products_type, restart_order, start_jump, &
      start_relaxed, start_step
   implicit none
   private

   public :: new_simulation, simulation_type

   !> What may remain of the coupling where the case limits the passes and gives no `coupling_tolerance`:
   !> the mean friction of a run is then right within 1 %. Above this a warning tells of what remains.
   real(dp), parameter :: large_mismatch = 1.0e-2_dp

   !> A run in hand. Not to be copied.
   type, extends(contact_state_type) :: simulation_type
      type(schedule_type) :: schedule
      type(history_row_type) :: row                 !! the last row
      logical :: converged = .true.                 !! the last row's solvers met the tolerance
      logical :: finished = .false.                 !! no row is left
      character(320) :: reason = ''                 !! why not converged
      real(dp) :: residual = 0.0_dp                 !! of the solver that did not, or of the normal one
      real(dp) :: allowed = 0.0_dp                  !! of that residual
      logical :: told_passes = .false.              !! a warning has told of passes that did not settle
      logical :: told_way = .false.                 !! a warning has told of a pull that moves the road far
      character(:), allocatable :: warnings         !! new ones, a line each; the caller clears them
      real(dp) :: drive_force(2) = 0.0_dp           !! horizontal force on the rubber, N
      type(stick_slip_watch_type) :: watch          !! what has been seen of the mean slip
      real(dp) :: widest = 0.0_dp                   !! cells across a patch of contact, at the end of a phase
      integer :: edge = edge_clear                  !! worst found at the edge of a free map
      type(coupled_passes_type), private :: passes
      type(steady_step_type) :: steady              !! rows of steady sliding, where the case has any
      logical :: has_steady = .false.               !! some phase is steady
      logical :: was_steady = .false.               !! the last row was one of steady sliding
      integer(int64), allocatable :: map_checksums(:)   !! of the height maps that are files, by term
   contains
      procedure :: advance
      procedure :: field
      procedure :: contact_states
      procedure :: destroy
   end type simulation_type

contains

   !> Prepare a run: surface, operators, fields.
   subroutine new_simulation(self, case, error, movable)
      type(simulation_type), intent(out) :: self
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: movable      !! be prepared for a motion of the road that no phase asks for
      integer :: nx, ny

      self%case = case
      self%grid = case%grid
      self%warnings = ''
      nx = self%grid%nx
      ny = self%grid%ny
      self%slides = road_moves(case%phases)
      if (present(movable)) self%slides = self%slides .or. movable
      call new_height(self%grid, case%surfaces, self%height, error, self%map_checksums)
      if (allocated(error)) return
      call new_normal_step(self%side, case, self%height, error)
      if (allocated(error)) return
      self%summit = self%side%summit
      self%rms_height = self%side%rms_height
      call new_zener(self%material, case%material%shear_modulus, case%material%prony_g, &
         case%material%prony_tau, trim(case%solver%time_scheme), error)
      if (allocated(error)) return
      call new_history(self%history, self%material, nx*ny, 1, error)
      if (allocated(error)) return
      call new_books(self%books, self%material, self%grid%dx*self%grid%dy)
      allocate (self%pressure(nx, ny), self%gap(nx, ny), self%displacement(nx, ny), source=0.0_dp)
      if (.not. is_elastic(self%material)) allocate (self%past(nx, ny), source=0.0_dp)
      if (self%slides) then
         call new_interpolation(self%road, self%grid, self%height, trim(case%solver%interpolation), &
            error)
         if (allocated(error)) return
         allocate (self%slope_x(nx, ny), self%slope_y(nx, ny))
         call place_road(self, 0.0_dp, 0.0_dp)
         self%rms_slope = rms_about_zero(self%slope_x, self%slope_y)
      end if
      self%has_steady = self%slides .and. any(case%phases%steady)
      if (self%has_steady) call new_steady_step(self%steady, case, self%rms_height, error)
      if (allocated(error)) return
      self%frictional = self%slides .and. case%friction%law /= 'none'
      if (.not. self%frictional) return
      call new_tangential_state(self%tangential, case, self%material, error)
      call new_coupled_passes(self%passes, nx, ny)
   end subroutine new_simulation

   !> Root of the mean square of a vector field.
   function rms_about_zero(x, y) result(rms)
      real(dp), intent(in) :: x(:, :), y(:, :)
      real(dp) :: rms
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(x, 2)))
      do j = 1, size(x, 2)
         rows(j) = sum(x(:, j)**2 + y(:, j)**2)
      end do
      rms = sqrt(global_sum(sum(rows))/global_sum(real(size(x), dp)))
   end function rms_about_zero

   !> Do the next row. Where the solvers did not converge, the state reached is kept.
   subroutine advance(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(planned_row_type) :: plan
      type(planned_row_type), allocatable :: parts(:)
      type(part_sums_type) :: sums
      integer :: k

      call next_row(self%schedule, self%case%phases, &
         [self%row%pressure, self%row%force, self%row%displacement], &
         self%drive_force/(self%grid%lx*self%grid%ly), plan, self%finished)
      if (self%finished) return
      call split_start(plan, needs_start(self%material) .or. plan%new_speed .or. plan%new_rate, &
         extrapolates(self%material), [self%row%road_x, self%row%road_y], parts)
      do k = 1, size(parts)
         call take_step(self, parts(k), error)
         if (allocated(error)) return
         if (size(parts) == 1) exit
         call sums%add(parts(k)%dt, self%row)
         if (self%frictional) call sums%add_slip(self%tangential%slip)
         if (.not. self%converged) exit
      end do
      if (size(parts) > 1) then
         call sums%hand_out(self%row)
         if (self%frictional) call sums%hand_out_slip(self%tangential%slip)
      end if
      call watch_cells(self, plan)
      call look_for_overflow(self)
      self%finished = self%schedule%phase > size(self%case%phases)
   end subroutine advance

   !> One step of a row, its history row included.
   subroutine take_step(self, plan, error)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(inout) :: plan      !! a steady row finds the place of the road
      type(error_type), allocatable, intent(out) :: error
      type(solver_result_type) :: outcome, rubbing
      real(dp) :: level
      character(:), allocatable :: message
      integer(int64) :: start, now, rate

      call guess_road(plan, [self%row%road_x, self%row%road_y], self%velocity)
      call begin_step(self, plan, error)
      if (allocated(error)) return
      call system_clock(start, rate)
      if (.not. plan%steady) then
         if (.not. is_elastic(self%material)) call history_field(self%history, self%material, self%past)
         if (self%frictional) call self%tangential%begin(self%material, &
            [plan%road_x - self%row%road_x, plan%road_y - self%row%road_y], plan%dt, plan%pulled, plan%pull)
         call move_road(self, plan)
      end if

      rubbing%converged = .true.
      if (plan%steady) then
         call slide_for_ever(self, plan, outcome, rubbing, level)
      else if (.not. self%rubs()) then
         call solve_normal(self, plan, self%case%solver%tolerance, outcome)
      else
         call self%passes%solve(self, plan, &
            [plan%road_x - self%row%road_x, plan%road_y - self%row%road_y], outcome, rubbing)
      end if
      level = self%level
      self%converged = outcome%converged .and. rubbing%converged
      self%reason = outcome%reason
      self%allowed = self%case%solver%tolerance
      self%residual = outcome%residual
      if (outcome%converged .and. .not. rubbing%converged) then
         self%reason = 'friction: '//trim(rubbing%reason)
         self%residual = rubbing%residual
         if (rubbing%residual <= self%case%solver%tolerance) &
            self%reason = trim(self%reason)//' before the tractions settled'
         if (self%tangential%slides_off) self%reason = pull_outcome(plan, self%tangential)
      end if
      if (self%frictional) then
         call take_road(plan, self%schedule, self%tangential, [self%row%road_x, self%row%road_y], self%velocity)
         call watch_way(plan, self%grid, [self%row%road_x, self%row%road_y], self%told_way, message)
         call add_warning(self, plan, message)
      end if

      if (self%rubs() .and. .not. plan%steady) call look_at_passes(self, plan)
      if (.not. plan%steady) call commit_step(self, level)
      self%was_steady = plan%steady
      call system_clock(now)
      outcome%seconds = real(now - start, dp)/real(rate, dp)
      call watch_edge(self, plan)
      call fill_row(self, plan, outcome, rubbing, level)
   end subroutine take_step

   !> A row of steady sliding: its state, and what the arms remember of it where time goes on.
   subroutine slide_for_ever(self, plan, outcome, rubbing, level)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(inout) :: plan      !! the road moves to where the state finds it
      type(solver_result_type), intent(out) :: outcome, rubbing
      real(dp), intent(out) :: level
      real(dp) :: next_dt

      if (.not. self%was_steady) call self%steady%begin_curve([self%row%road_x, self%row%road_y])
      call self%steady%solve(plan, self%road, outcome, rubbing)
      self%schedule%start_x = self%schedule%start_x + (self%steady%place(1) - plan%road_x)
      self%schedule%start_y = self%schedule%start_y + (self%steady%place(2) - plan%road_y)
      plan%road_x = self%steady%place(1)
      plan%road_y = self%steady%place(2)
      self%velocity = [plan%velocity_x, plan%velocity_y]
      self%direction = self%velocity/norm2(self%velocity)
      self%drift = 0.0_dp
      self%moved_cells = nint((self%steady%place - self%drifted)/[self%grid%dx, self%grid%dy])
      associate (found => self%steady%contact)
         self%pressure(:, :) = found%pressure
         self%gap(:, :) = found%gap
         self%height(:, :) = found%height
         self%slope_x(:, :) = found%slope_x
         self%slope_y(:, :) = found%slope_y
         level = found%level
         self%displacement(:, :) = found%gap + found%height + level
      end associate
      self%level = level
      self%first = .false.

      next_dt = 0.0_dp
      if (size(self%history%ds) > 0) next_dt = plan%next_dt
      call self%steady%remember_normal(next_dt, self%history, self%books)
      if (self%frictional) then
         call self%tangential%take_steady(self%steady%contact, self%velocity)
         call self%steady%remember_tangential(next_dt, self%tangential%history, self%tangential%books)
      end if
      call finish_step(self%material)
      self%material%dt_old = next_dt
   end subroutine slide_for_ever

   !> The rates of loss: means over a step.
   subroutine fill_powers(self, plan, row)
      type(simulation_type), intent(in) :: self
      type(planned_row_type), intent(in) :: plan
      type(history_row_type), intent(inout) :: row

      row%power_viscous = 0.0_dp
      row%power_friction = 0.0_dp
      if (.not. plan%dt > 0.0_dp) return
      row%power_viscous = (row%dissipated_viscous - self%row%dissipated_viscous)/plan%dt
      row%power_friction = (row%dissipated_friction - self%row%dissipated_friction)/plan%dt
   end subroutine fill_powers

   !> What a row of steady sliding knows better than the sums over the cells.
   subroutine fill_steady(self, row, force)
      type(simulation_type), intent(in) :: self
      type(history_row_type), intent(inout) :: row
      real(dp), intent(inout) :: force(2)           !! in: by the slopes of the mesh; out: by the losses, N
      real(dp) :: viscous

      viscous = dot_product(self%steady%viscous_force, self%direction)/row%pressure
      force = force + self%direction*((viscous - row%friction_viscous)*row%force)
      row%friction_viscous = viscous
      row%power_viscous = self%steady%losses%normal + self%steady%losses%tangential
      row%power_friction = self%steady%power_friction
      row%sliding_speed = norm2(self%velocity)
   end subroutine fill_steady

   !> A row whose passes leave more than the case allows has not converged. Where the case allows
   !> much, a warning tells of what remains.
   subroutine look_at_passes(self, plan)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable :: message, advice

      associate (solver => self%case%solver, left => self%passes%residual)
         if (.not. self%converged .or. left <= solver%tolerance) return
         if (solver%passes > 0) self%allowed = max(self%allowed, large_mismatch)
         if (solver%coupling_tolerance > 0.0_dp) self%allowed = max(solver%tolerance, solver%coupling_tolerance)
         advice = advice_on_passes(self)
         if (.not. left <= self%allowed) then
            self%converged = .false.
            self%residual = left
            self%reason = 'the '//to_text(self%passes%passes)//' passes of the step did not settle. '//advice
         else if (left > large_mismatch .and. .not. self%told_passes) then
            self%told_passes = .true.
            message = 'the passes of the step did not settle: residual_coupling is '//to_text(left)// &
               ' after '//to_text(self%passes%passes)//'. '//advice
            call add_warning(self, plan, message)
         end if
      end associate
   end subroutine look_at_passes

   !> Is there friction that nothing has called for yet? What touches then sticks.
   pure function holds(self) result(yes)
      type(simulation_type), intent(in) :: self
      logical :: yes

      yes = self%case%friction%law /= 'none' .and. .not. self%rubs()
   end function holds

   !> End the step: histories and energies of both directions.
   subroutine commit_step(self, level)
      type(simulation_type), intent(inout) :: self
      real(dp), intent(in) :: level
      type(products_type) :: products

      products = new_products(self%material)
      call new_displacement(self, level)
      call commit_history(self%history, self%material, self%pressure, self%displacement, &
         self%side%normal%step, products)
      self%displacement(:, :) = self%side%normal%step
      call book_step(self%books, self%material, products)
      if (self%frictional) &
         call self%tangential%commit(self%material, self%pressure, self%slope_x, self%slope_y)
      call finish_step(self%material)
   end subroutine commit_step

   !> Warn where a free map is too small.
   subroutine watch_edge(self, plan)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable :: message

      message = ''
      call look_at_edge(self%grid, merge(self%case%adhesion%range, 0.0_dp, self%side%adhesive), &
         self%pressure, self%displacement, self%gap, plan%road_x - self%row%road_x, &
         plan%road_y - self%row%road_y, self%rms_height, self%edge, message)
      call add_warning(self, plan, message)
   end subroutine watch_edge

   !> Look at the size of the patches of contact where a phase ends.
   subroutine watch_cells(self, plan)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable :: message

      if (self%schedule%phase == plan%phase) return
      call watch_contact_size(self%grid, cells_across(self%grid, self%side%adhesive, self%pressure, &
         self%gap), self%schedule%phase > size(self%case%phases), self%widest, message)
      call add_warning(self, plan, message)
   end subroutine watch_cells

   !> A row with a number that is not finite did not converge.
   subroutine look_for_overflow(self)
      type(simulation_type), intent(inout) :: self

      if (all(ieee_is_finite(row_values(self%row)))) return
      self%converged = .false.
      self%reason = reason_overflow
   end subroutine look_for_overflow

   !> Warn where the scheme makes the block stick and slip in turn.
   subroutine watch_stick_slip(self, plan, slip_speed)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: slip_speed
      character(:), allocatable :: message

      ! A block that comes to rest behind its road is no stick-slip.
      if (.not. plan%dt*hypot(plan%velocity_x, plan%velocity_y) > 0.0_dp) return
      call watch_slip(self%watch, slip_speed, hypot(plan%velocity_x, plan%velocity_y), &
         self%case%solver%passes, self%case%material%density, message)
      call add_warning(self, plan, message)
   end subroutine watch_stick_slip

   !> Add a line to the warnings, unless it is empty.
   subroutine add_warning(self, plan, message)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      character(*), intent(in) :: message

      if (len(message) == 0) return
      if (len(self%warnings) > 0) self%warnings = self%warnings//new_line('a')
      self%warnings = self%warnings//'step '//to_text(self%schedule%row)//', t = '//to_text(plan%time)// &
         ' s: '//message
   end subroutine add_warning

   !> The material's coefficients for the step.
   subroutine begin_step(self, plan, error)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      type(error_type), allocatable, intent(out) :: error

      if (plan%new_speed .or. plan%new_rate) call restart_order(self%material)
      if (plan%new_speed .and. self%frictional) self%tangential%block%fresh = .true.
      if (plan%relaxed) then
         call start_relaxed(self%material, error)
      else if (plan%instantaneous) then
         call start_jump(self%material)
      else
         call start_step(self%material, plan%dt)
      end if
   end subroutine begin_step

   !> U = gap + H + level, into the solver's work field.
   subroutine new_displacement(self, level)
      type(simulation_type), intent(inout) :: self
      real(dp), intent(in) :: level
      integer :: j

      !$omp parallel do default(none) shared(self, level) private(j)
      do j = 1, self%grid%ny
         self%side%normal%step(:, j) = self%gap(:, j) + self%height(:, j) + level
      end do
   end subroutine new_displacement

   !> The row of the history.
   subroutine fill_row(self, plan, outcome, rubbing, level)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      type(solver_result_type), intent(in) :: outcome, rubbing
      real(dp), intent(in) :: level
      type(history_row_type) :: row
      real(dp), allocatable :: rows(:, :)
      logical, allocatable :: touching(:)
      real(dp) :: sums(7), cells, area, force(2), outside(2), inertia(2)
      integer :: j

      allocate (rows(7, self%grid%ny), source=0.0_dp)
      !$omp parallel do default(none) shared(self, rows) private(j, touching)
      do j = 1, self%grid%ny
         rows(1, j) = sum(self%pressure(:, j))
         touching = touches(self%side%adhesive, self%pressure(:, j), self%gap(:, j))
         rows(2, j) = count(touching)
         rows(3, j) = sum(self%gap(:, j))
         if (self%slides) then
            rows(4, j) = sum(self%pressure(:, j)*self%slope_x(:, j))
            rows(5, j) = sum(self%pressure(:, j)*self%slope_y(:, j))
            if (self%side%adhesive) then
               rows(6, j) = sum(self%pressure(:, j)*self%slope_x(:, j), .not. touching)
               rows(7, j) = sum(self%pressure(:, j)*self%slope_y(:, j), .not. touching)
            end if
         end if
      end do
      sums = global_sum([(sum(rows(j, :)), j = 1, 7)])
      cells = real(self%grid%nx, dp)*self%grid%ny
      area = self%grid%lx*self%grid%ly

      row = self%row
      row%step = self%schedule%row
      row%phase = plan%phase
      row%time = plan%time
      row%pressure = sums(1)/cells
      row%force = row%pressure*area
      row%displacement = level + self%summit
      row%contact_area = sums(2)/cells
      row%mean_gap = sums(3)/cells
      row%road_x = plan%road_x
      row%road_y = plan%road_y
      row%friction_viscous = 0.0_dp
      if (abs(sums(1)) > 0.0_dp) &
         row%friction_viscous = (0.0_dp - dot_product(sums(4:5), self%direction))/sums(1)
      force = 0.0_dp - sums(4:5)*self%grid%dx*self%grid%dy
      row%energy_adhesive = self%side%energy(self%gap)
      row%work_normal = self%books%work + row%energy_adhesive
      row%energy_elastic = self%books%stored
      row%dissipated_viscous = self%books%dissipated
      row%dissipated_numerical = self%books%numerical
      inertia = 0.0_dp
      if (self%frictional) then
         inertia = self%tangential%block%inertia
         outside = -sums(6:7)*self%grid%dx*self%grid%dy
         call add_friction(self, plan, rubbing, outside, force, row)
         call watch_stick_slip(self, plan, row%sliding_speed)
      end if
      if (holds(self)) row%stick_area = row%contact_area
      call fill_powers(self, plan, row)
      if (plan%steady) call fill_steady(self, row, force)
      row%friction = 0.0_dp
      if (abs(row%force) > 0.0_dp .and. any(abs(self%direction) > 0.0_dp)) &
         row%friction = dot_product(force, self%direction)/row%force
      row%iterations_normal = outcome%iterations
      row%residual_normal = outcome%residual
      row%passes = 0
      row%residual_coupling = 0.0_dp
      if (self%rubs() .and. .not. plan%steady) then
         row%passes = self%passes%passes
         row%residual_coupling = self%passes%residual
      end if
      row%ffts = real(outcome%ffts + rubbing%ffts, dp)
      row%seconds = outcome%seconds
      call book_outside(self%row, self%drive_force, force, inertia, plan%steady .or. (plan%instantaneous .and. &
         .not. plan%ramped), self%side%adhesive, row)
      self%drive_force = force
      self%row = row
   end subroutine fill_row

   !> The part of friction in a row, and the whole horizontal force. With slope it is the sum of T,
   !> which holds -P grad H; without, both are added.
   subroutine add_friction(self, plan, rubbing, outside, force, row)
      type(simulation_type), intent(in) :: self
      type(planned_row_type), intent(in) :: plan
      type(solver_result_type), intent(in) :: rubbing
      real(dp), intent(in) :: outside(2)            !! sum of -P grad H outside the contact, N
      real(dp), intent(inout) :: force(2)           !! in: sum of -P grad H; out: all of it, N
      type(history_row_type), intent(inout) :: row
      real(dp) :: traction(2), slip(2)

      call self%tangential%sums(traction, row%stick_area, slip)
      row%traction_x = traction(1)
      row%traction_y = traction(2)
      if (self%tangential%law%slope .and. self%tangential%moved) force = outside
      force = force + traction*self%grid%lx*self%grid%ly
      row%sliding_speed = 0.0_dp
      if (plan%dt > 0.0_dp) then
         row%sliding_speed = dot_product(slip, self%direction)/plan%dt
      else if (self%tangential%block%mass > 0.0_dp) then
         ! The mass moves on through a jump of the load.
         row%sliding_speed = -dot_product(self%tangential%block%speed, self%direction)
      end if
      row%work_tangential = self%tangential%books%work + self%tangential%block%work &
         + self%tangential%lost_friction
      row%energy_elastic = row%energy_elastic + self%tangential%books%stored
      row%energy_kinetic = self%tangential%block%kinetic()
      row%dissipated_viscous = row%dissipated_viscous + self%tangential%books%dissipated &
         + self%tangential%block%lost
      row%dissipated_numerical = row%dissipated_numerical + self%tangential%books%numerical &
         + self%tangential%block%lost
      row%dissipated_friction = self%tangential%lost_friction
      row%iterations_tangential = rubbing%iterations
      row%residual_tangential = rubbing%residual
   end subroutine add_friction

   !> A field of the state by its name in the result.
   subroutine field(self, name, values)
      class(simulation_type), intent(in) :: self
      character(*), intent(in) :: name              !! as in /snapshots; the last two parts with friction
      real(dp), allocatable, intent(out) :: values(:, :)
      integer :: c

      select case (name)
      case ('pressure')
         values = self%pressure
      case ('gap')
         ! Where the surfaces overlap by less than the tolerance they touch.
         values = max(self%gap, 0.0_dp)
      case ('displacement_z')
         values = self%displacement
      case ('road_height')
         values = self%height
      case default
         allocate (values(self%grid%nx, self%grid%ny), source=0.0_dp)
         if (.not. self%frictional) return
         c = merge(1, 2, index(name, '_x') > 0)
         if (index(name, 'traction') == 1) values = self%tangential%traction(:, :, c)
         if (index(name, 'displacement') == 1) values = self%tangential%displacement(:, :, c)
         if (index(name, 'slip') == 1) values = self%tangential%slip(:, :, c)
      end select
   end subroutine field

   !> The state of each cell: 0 open, 1 stick, 2 slip. Without friction all contact slips; with it
   !> all sticks until the road moves.
   subroutine contact_states(self, states)
      class(simulation_type), intent(in) :: self
      integer(int8), allocatable, intent(out) :: states(:, :)
      integer(int8) :: touching
      integer :: j

      if (self%rubs()) then
         states = self%tangential%contact
         return
      end if
      touching = 2_int8
      if (holds(self)) touching = 1_int8
      allocate (states(self%grid%nx, self%grid%ny))
      do j = 1, self%grid%ny
         states(:, j) = merge(touching, 0_int8, &
            touches(self%side%adhesive, self%pressure(:, j), self%gap(:, j)))
      end do
   end subroutine contact_states

   !> Free plans and fields.
   subroutine destroy(self)
      class(simulation_type), intent(inout) :: self

      call self%side%destroy()
      call destroy_history(self%history)
      if (self%frictional) call self%tangential%destroy()
      if (self%has_steady) call self%steady%destroy()
   end subroutine destroy

end module asperity_simulation
