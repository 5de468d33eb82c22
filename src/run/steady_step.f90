!> A row of steady sliding: the state that a contact reaches when the road has slid at a constant velocity for an
!> infinite time.
!>
!> Without friction module `steady_normal` solves it, with friction module `steady_friction`. A row that follows a steady
!> row starts from the state of that row. If two steady rows precede it and only the speed or only the load changes, it
!> starts from a linear extrapolation of both states in the logarithm of the speed or of the load.
!>
!> The road is read relative to the mean displacement of the contact, so that the contact keeps its place on the grid
!> from row to row. The road of a row is therefore displaced by `place`: the displacement in the first steady row plus
!> that mean displacement.
!>
!> Energy: per area and time the road does the work V.(T - P grad H), or V.T if T contains -P grad H. The losses of the
!> modes give the rate of loss exactly. In the sum of -P grad H over the cells, the slopes of the mesh replace those of
!> U_z. A force that is computed from the loss converges faster with the mesh. Therefore
!>
!>     friction_viscous = [loss by P/|V| + mean(P grad H.dU_T/ds)]/mean P
!>
!> which tends to -mean(P dH/ds)/mean P. The power lost by friction is mean((T - T*).r) |V| per area.
module steady_step
   use case_settings, only : case_type
   use asperity_errors, only : error_type
   use field_sums, only : field_mean, field_sum, row_totals
   use friction_law, only : friction_law_type, new_friction_law
   use asperity_interpolation, only : interpolation_type, shifted
   use normal_state, only : normal_problem_type
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use asperity_schedule, only : planned_row_type
   use solver_result, only : solver_result_type
   use rubber_kernels, only : normal_kernel, tangential_kernel
   use steady_contact, only : sliding_outcome_type, steady_contact_type
   use steady_friction, only : new_steady_friction, steady_friction_type
   use steady_losses, only : steady_losses_type, sum_losses
   use steady_memory, only : set_books, set_arm_state
   use steady_normal, only : new_steady_normal, steady_normal_type
   use steady_operator, only : new_steady_operator, steady_operator_type
   use steady_symbols, only : medium_type, new_steady_symbols, steady_symbols_type
   use viscoelastic_energy, only : energy_books_type
   use arm_state, only : arm_state_type
   implicit none
   private

   public :: new_steady_step, steady_start_type, steady_state_type, steady_step_type

   !> A state from which a later row may start.
   type :: steady_start_type
      logical :: known = .false.
      real(dp) :: pressure_mean = 0.0_dp               !! the load, Pa
      real(dp) :: velocity(2) = 0.0_dp                 !! m/s
      real(dp), allocatable :: pressure(:, :)          !! Pa
      real(dp), allocatable :: gap(:, :)               !! m
      real(dp), allocatable :: traction(:, :, :)       !! Pa [nx, 2, rows]; no extent without friction
   contains
      procedure :: copy
   end type steady_start_type

   !> What a row of steady sliding leaves to the next one.
   type :: steady_state_type
      logical :: now = .false.                         !! the last row was one of steady sliding
      real(dp) :: base(2) = 0.0_dp                     !! displacement of the road without the offset, m
      type(steady_start_type) :: last, before          !! states of the last two rows
   contains
      procedure :: begin_curve
   end type steady_state_type

   !> The solvers and the present row. A variable of this type must not be copied.
   type :: steady_step_type
      type(grid_type) :: grid
      logical :: frictional = .false.
      type(friction_law_type) :: law
      type(medium_type) :: medium
      type(steady_contact_type) :: contact             !! the contact of the row
      type(steady_losses_type) :: losses               !! of that contact
      real(dp) :: place(2) = 0.0_dp                    !! displacement of the road, m
      real(dp) :: viscous_force(2) = 0.0_dp            !! mean of -P grad H, from the losses, Pa
      real(dp) :: power_friction = 0.0_dp              !! W over the cell
      real(dp) :: scheme_dt = 0.0_dp                   !! for tests: symbols of a scheme with this step, s
      real(dp), private :: tolerance = 1e-6_dp
      integer, private :: max_iterations = 1000
      real(dp), private :: rms_height = 0.0_dp
      type(steady_operator_type), private :: operator
      type(steady_normal_type), private :: normal
      type(steady_friction_type), private :: coupled
      !> Transforms of P and T. The index of a row, minus 1, is its wave number along y.
      complex(dp), allocatable, private :: p_modes(:, :), t_modes(:, :, :)
   contains
      procedure :: solve
      procedure :: remember_normal
      procedure :: remember_tangential
      procedure :: destroy
   end type steady_step_type

contains

   !> Prepare the solvers that a case needs, and a state without earlier rows.
   subroutine new_steady_step(self, state, case, rms_height, error)
      type(steady_step_type), intent(out) :: self
      type(steady_state_type), intent(out) :: state
      type(case_type), intent(in) :: case
      real(dp), intent(in) :: rms_height               !! of the road about its mean, m
      type(error_type), allocatable, intent(out) :: error
      integer :: nx, rows

      self%grid = case%grid
      call self%grid%share_rows()
      nx = self%grid%nx
      rows = self%grid%rows()
      self%frictional = case%friction%law /= 'none'
      self%tolerance = case%solver%tolerance
      self%max_iterations = case%solver%max_iterations
      self%rms_height = rms_height
      self%medium%grid = self%grid
      self%medium%normal = normal_kernel(case%material)
      self%medium%tangential = tangential_kernel(case%material)
      self%medium%modulus = case%material%shear_modulus
      allocate (self%medium%g, source=case%material%prony_g)
      allocate (self%medium%tau, source=case%material%prony_tau)
      call new_steady_operator(self%operator, self%grid, self%frictional, error)
      if (allocated(error)) return
      associate (c => self%contact)
         allocate (c%pressure(nx, rows), c%gap(nx, rows), c%height(nx, rows), c%slope_x(nx, rows), &
            c%slope_y(nx, rows), source=0.0_dp)
         if (self%frictional) then
            allocate (c%traction(nx, 2, rows), c%displacement(nx, 2, rows), c%slip(nx, 2, rows), source=0.0_dp)
         else
            allocate (c%traction(nx, 2, 0), c%displacement(nx, 2, 0), c%slip(nx, 2, 0))
         end if
         allocate (state%last%pressure, state%last%gap, source=c%pressure)
         allocate (state%last%traction, source=c%traction)
         call state%before%copy(state%last)
      end associate
      if (self%frictional) then
         self%law = new_friction_law(trim(case%friction%law), case%friction%coefficient, &
            case%friction%shear_strength, 0.0_dp, case%friction%slope_effect, &
            case%solver%slip_law == 'physical', case%friction%table)
         call new_steady_friction(self%coupled, self%grid, self%law)
      else
         call new_steady_normal(self%normal, self%grid)
      end if
   end subroutine new_steady_step

   !> Copy another start. An assignment would allocate the fields each time, and gfortran does not check whether that
   !> fails.
   subroutine copy(self, other)
      class(steady_start_type), intent(inout) :: self
      type(steady_start_type), intent(in) :: other

      self%known = other%known
      self%pressure_mean = other%pressure_mean
      self%velocity = other%velocity
      if (.not. allocated(self%pressure)) then
         allocate (self%pressure, self%gap, mold=other%pressure)
         allocate (self%traction, mold=other%traction)
      end if
      self%pressure(:, :) = other%pressure
      self%gap(:, :) = other%gap
      self%traction(:, :, :) = other%traction
   end subroutine copy

   !> Discard the states of earlier rows, and set the displacement of the road for the next steady row.
   subroutine begin_curve(self, place)
      class(steady_state_type), intent(inout) :: self
      real(dp), intent(in) :: place(2)                 !! of the road, m

      self%base = place
      self%last%known = .false.
      self%before%known = .false.
   end subroutine begin_curve

   !> Solve a row: find the contact, the displacement of the road, and the losses.
   subroutine solve(self, plan, road, state, normal, tangential)
      class(steady_step_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      type(interpolation_type), intent(inout) :: road
      type(steady_state_type), intent(inout) :: state   !! unchanged if the solve is stopped
      type(solver_result_type), intent(out) :: normal, tangential
      type(steady_symbols_type) :: symbols
      type(normal_problem_type) :: problem
      type(sliding_outcome_type) :: both

      self%medium%velocity = plan%velocity
      self%medium%dt = self%scheme_dt
      call new_steady_symbols(symbols, self%medium, self%operator%first, self%operator%last, self%frictional)
      call self%operator%set_symbols(symbols)
      problem%modulus = self%medium%modulus
      problem%target = plan%load
      if (plan%control == 'force') problem%target = plan%load/self%grid%area()
      problem%tolerance = self%tolerance
      problem%max_iterations = self%max_iterations
      problem%rms_height = self%rms_height
      call start_from(self, state, problem)

      tangential%converged = .true.
      call shifted(road, state%base(1), state%base(2), self%contact%height, self%contact%slope_x, &
         self%contact%slope_y)
      if (self%frictional) then
         self%coupled%direction = self%medium%velocity/norm2(self%medium%velocity)
         self%coupled%base = state%base
         call self%coupled%solve(self%operator, problem, road, self%contact, both)
         normal = both%normal
         tangential = both%tangential
         if (.not. normal%stopped) call add_mean_shear(self)
      else
         call self%normal%solve(self%operator, problem, self%contact%height, self%contact%pressure, &
            self%contact%gap, self%contact%level, normal)
      end if
      if (normal%stopped) return
      self%place = state%base + self%contact%offset
      call find_losses(self)
      call keep_state(self, problem%target, state)
   end subroutine solve

   !> Add the mean mode of the displacement: the shear of a block of finite thickness.
   subroutine add_mean_shear(self)
      type(steady_step_type), intent(inout) :: self
      real(dp) :: mean
      integer :: c

      do c = 1, 2
         mean = field_mean(self%contact%traction(:, c, :))*self%medium%tangential%mean_mode/self%medium%modulus
         self%contact%displacement(:, c, :) = self%contact%displacement(:, c, :) + mean
         self%contact%offset(c) = self%contact%offset(c) + mean
      end do
   end subroutine add_mean_shear

   !> Set the start of a row: none, the last state, or an extrapolation of the last two.
   subroutine start_from(self, state, problem)
      type(steady_step_type), intent(inout) :: self
      type(steady_state_type), intent(in) :: state
      type(normal_problem_type), intent(inout) :: problem
      real(dp) :: part, scale, gaps
      integer :: j

      problem%warm = state%last%known
      if (.not. problem%warm) return
      part = extrapolation(state, self%medium%velocity, problem%target)
      associate (c => self%contact, a => state%last, b => state%before)
         gaps = max(field_sum(a%gap), field_sum(b%gap))
         scale = 1.0_dp                                ! without any gap it does not count
         if (gaps > 0.0_dp) scale = field_sum(a%pressure)/gaps
         do j = 1, self%grid%rows()
            ! Pressure and gap are extrapolated as one quantity: the pressure if positive, the scaled gap if negative.
            c%pressure(:, j) = a%pressure(:, j) - scale*a%gap(:, j)
            if (part > 0.0_dp .or. part < 0.0_dp) c%pressure(:, j) = c%pressure(:, j) &
               + part*(c%pressure(:, j) - b%pressure(:, j) + scale*b%gap(:, j))
            c%gap(:, j) = max(-c%pressure(:, j), 0.0_dp)/scale
            c%pressure(:, j) = max(c%pressure(:, j), 0.0_dp)
            if (.not. self%frictional) cycle
            c%traction(:, :, j) = a%traction(:, :, j)
            if (part > 0.0_dp .or. part < 0.0_dp) &
               c%traction(:, :, j) = c%traction(:, :, j) + part*(a%traction(:, :, j) - b%traction(:, :, j))
         end do
         problem%warm = field_sum(c%pressure) > 0.0_dp
      end associate
   end subroutine start_from

   !> The distance of an extrapolation along the line through the last two states, over that of both; 0: none.
   pure function extrapolation(state, velocity, target) result(part)
      type(steady_state_type), intent(in) :: state
      real(dp), intent(in) :: velocity(2)              !! of the road in the row, m/s
      real(dp), intent(in) :: target                   !! mean pressure of the row, Pa
      real(dp) :: part
      real(dp) :: speed(3), turn, load(3)
      real(dp), parameter :: same = 1e-9_dp, farthest = 2.0_dp

      part = 0.0_dp
      if (.not. state%before%known) return
      speed = log([norm2(state%before%velocity), norm2(state%last%velocity), norm2(velocity)])
      load = log([state%before%pressure_mean, state%last%pressure_mean, target])
      turn = norm2(velocity/exp(speed(3)) - state%last%velocity/exp(speed(2))) &
         + norm2(state%last%velocity/exp(speed(2)) - state%before%velocity/exp(speed(1)))
      if (turn > same) return
      if (maxval(load) - minval(load) <= same .and. abs(speed(2) - speed(1)) > same) then
         part = (speed(3) - speed(2))/(speed(2) - speed(1))
      else if (maxval(speed) - minval(speed) <= same .and. abs(load(2) - load(1)) > same) then
         part = (load(3) - load(2))/(load(2) - load(1))
      end if
      if (abs(part) > farthest) part = 0.0_dp
   end function extrapolation

   !> Keep the contact of the row for the next ones.
   subroutine keep_state(self, target, state)
      type(steady_step_type), intent(in) :: self
      real(dp), intent(in) :: target                   !! mean pressure of the row, Pa
      type(steady_state_type), intent(inout) :: state

      associate (last => state%last)
         if (last%known) call state%before%copy(last)
         last%known = .true.
         last%pressure_mean = target
         last%velocity = self%medium%velocity
         last%pressure(:, :) = self%contact%pressure
         ! In contact the gap is round-off. Where all cells touch, it would outweigh the pressure in the next start.
         last%gap(:, :) = merge(0.0_dp, max(self%contact%gap, 0.0_dp), self%contact%pressure > 0.0_dp)
         last%traction(:, :, :) = self%contact%traction
      end associate
   end subroutine keep_state

   !> Compute the losses of the state, and the forces that follow from them.
   subroutine find_losses(self)
      type(steady_step_type), intent(inout) :: self
      real(dp), allocatable :: rows(:, :)
      real(dp) :: direction(2), speed, area, sums(4)
      integer :: j

      if (.not. allocated(self%p_modes)) then
         allocate (self%p_modes(0:self%grid%nx/2, self%grid%rows()))
         allocate (self%t_modes(0:self%grid%nx/2, self%grid%rows(), merge(2, 0, self%frictional)))
      end if
      call self%operator%spectrum(self%contact%pressure, self%p_modes)
      do j = 1, size(self%t_modes, 3)
         call self%operator%spectrum(self%contact%traction(:, j, :), self%t_modes(:, :, j))
      end do
      call sum_losses(self%medium, self%p_modes, self%t_modes, self%losses)

      allocate (rows(4, self%grid%rows()))
      !$omp parallel do default(none) shared(self, rows) private(j)
      do j = 1, self%grid%rows()
         call row_forces(self, j, rows(:, j))
      end do
      sums = row_totals(rows)/self%grid%cells()
      speed = norm2(self%medium%velocity)
      direction = self%medium%velocity/speed
      area = self%grid%area()
      self%power_friction = sums(4)*speed*area
      ! The force perpendicular to the motion does not follow from a loss, and is that of the slopes of the mesh.
      self%viscous_force = -sums(1:2)
      self%viscous_force = self%viscous_force + direction*(self%losses%normal/(speed*area) + sums(3) &
         - dot_product(self%viscous_force, direction))
   end subroutine find_losses

   !> Form the sums over a row: P grad H, P grad H.(r - e), (T - T*).r.
   subroutine row_forces(self, j, sums)
      type(steady_step_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(out) :: sums(4)
      real(dp) :: slope(2), r(2), star(2), direction(2)
      integer :: i

      sums = 0.0_dp
      direction = self%medium%velocity/norm2(self%medium%velocity)
      associate (c => self%contact)
         do i = 1, self%grid%nx
            ! A partly sheared cell has traction and no pressure.
            if (c%pressure(i, j) <= 0.0_dp .and. .not. self%frictional) cycle
            slope = [c%slope_x(i, j), c%slope_y(i, j)]
            sums(1:2) = sums(1:2) + c%pressure(i, j)*slope
            if (.not. self%frictional) cycle
            r = c%slip(i, :, j)
            star = self%law%normal_traction(c%pressure(i, j), slope)
            sums(3) = sums(3) + c%pressure(i, j)*dot_product(slope, r - direction)
            sums(4) = sums(4) + dot_product(c%traction(i, :, j) - star, r)
         end do
      end associate
   end subroutine row_forces

   !> Set the state of the arms of the normal side, and its stored energy.
   subroutine remember_normal(self, dt, arms, books)
      class(steady_step_type), intent(inout) :: self
      real(dp), intent(in) :: dt                       !! of the step to come, s; 0: none
      type(arm_state_type), intent(inout) :: arms
      type(energy_books_type), intent(inout) :: books
      complex(dp) :: none(0:-1, 0:-1, 2)

      call set_arm_state(self%operator, self%medium, dt, self%contact%pressure, 1, arms)
      call set_books(self%medium, dt, self%p_modes, none, books)
   end subroutine remember_normal

   !> Set the state of the arms of the tangential side, and its stored energy.
   subroutine remember_tangential(self, dt, arms, books)
      class(steady_step_type), intent(inout) :: self
      real(dp), intent(in) :: dt                       !! of the step to come, s; 0: none
      type(arm_state_type), intent(inout) :: arms
      type(energy_books_type), intent(inout) :: books
      complex(dp) :: none(0:-1, 0:-1)
      integer :: c

      do c = 1, 2
         call set_arm_state(self%operator, self%medium, dt, self%contact%traction(:, c, :), c, arms)
      end do
      call set_books(self%medium, dt, none, self%t_modes, books)
   end subroutine remember_tangential

   !> Free plans and memory.
   subroutine destroy(self)
      class(steady_step_type), intent(inout) :: self

      call self%operator%destroy()
   end subroutine destroy

end module steady_step
