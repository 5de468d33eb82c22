!> The tangential side of the step loop: tractions, displacements and slip of a rubber block that is
!> driven over a road, with the block's viscoelasticity and the inertia of its mean motion.
!>
!> Slip of a step: r = DX - U', DX = U + (D' - D), U' = A(T + T_h)/Q with the traction T_h of the
!> history. The solver works with Q r = DX' - A(T + T_h), DX' = Q DX. The mean of a block
!> with mass moves by the rule of module block_motion; the part of the mean traction that accelerates the
!> mass does not strain the rubber.
!>
!> The loss by friction is that of the mean traction over the step, second order in its length.
!>
!> Fields of doubles, two components each: T, that of the step before, U, the trial U', slip, T - T* of
!> the step before at the rubber's own points, DX', T_h; those of the solver; the history (S, S - S_old,
!> one field per arm).
module tangential_state
   use block_motion, only : block_motion_type
   use case_settings, only : case_type
   use contact_rule, only : touches
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_tangential_operator
   use friction_cg, only : friction_fast, friction_fields_type, friction_solver_type, friction_thesis, &
      new_friction_solver, set_mean_compliance
   use friction_law, only : friction_law_type, new_friction_law
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, int64, int8
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   use steady_friction, only : steady_contact_type
   use viscoelastic_energy, only : book_step, energy_books_type, new_books
   use zener, only : commit_history, destroy_history, history_field, history_type, &
      new_history, new_products, products_type, zener_type
   implicit none
   private

   public :: new_tangential_state, tangential_state_type

   !> The tangential state of a run. Not to be copied.
   type :: tangential_state_type
      type(grid_type) :: grid
      type(friction_law_type) :: law
      logical :: adhesive = .false.                   !! the contact has an adhesive potential
      logical :: moved = .false.                      !! the road has moved: friction acts
      type(block_motion_type) :: block                !! mean motion of the block
      real(dp), allocatable :: traction(:, :, :)      !! T, Pa [nx, ny, 2]
      real(dp), allocatable :: before(:, :, :)        !! T of the step before, seen from where T is, Pa
      real(dp) :: pace = 0.0_dp                       !! length of the step that led from it to T, s; 0: none
      real(dp), allocatable :: displacement(:, :, :)  !! U_T, m
      real(dp), allocatable :: trial(:, :, :)         !! U_T of the step in hand, m
      real(dp), allocatable :: slip(:, :, :)          !! of the step, m
      real(dp), allocatable :: rubbing(:, :, :)       !! T - T* at the end of the last step, Pa
      integer(int8), allocatable :: contact(:, :)     !! 0 open, 1 stick, 2 slip
      integer(int8), allocatable :: rubbed(:, :)      !! the same at the end of the last step
      type(history_type) :: history
      type(energy_books_type) :: books                !! of the strain of the rubber
      real(dp) :: rate(2) = 0.0_dp                    !! mean speed of the surface in the contact, m/s
      real(dp) :: lost_friction = 0.0_dp              !! J
      type(convolution_type), private :: operator
      type(friction_solver_type), private :: solver
      real(dp), allocatable, private :: drive(:, :, :)    !! DX'
      real(dp), allocatable, private :: past(:, :, :)     !! T_h
      logical :: pulled(2) = .false.                  !! the road hangs on a force along x, y
      real(dp) :: pull(2) = 0.0_dp                    !! that force, over the cell, Pa
      logical :: slides_off = .false.                 !! it is more than the friction holds,
      real(dp) :: held(2) = 0.0_dp                    !! which is this, Pa
      real(dp), private :: motion(2) = 0.0_dp             !! D' - D of the step in hand, m; a guess where pulled
      real(dp), private :: found(2) = 0.0_dp              !! D' - D as found by the last solve, m
      real(dp), private :: mass_place(2) = 0.0_dp         !! of a pulled mass, in the units of DX'
      real(dp), private :: mass_yields = 0.0_dp           !! a pulled mass yields to T - F by this
      real(dp), private :: dt = 0.0_dp
      real(dp), private :: q = 0.0_dp
      real(dp), private :: past_mean(2) = 0.0_dp
   contains
      procedure :: begin
      procedure :: extrapolate
      procedure :: solve
      procedure :: take_steady
      procedure :: take_motion
      procedure :: commit
      procedure :: sums
      procedure :: destroy
   end type tangential_state_type

contains

   !> Prepare the operator, the solver and fields at rest.
   subroutine new_tangential_state(self, case, material, error)
      type(tangential_state_type), intent(out) :: self
      type(case_type), intent(in) :: case
      type(zener_type), intent(in) :: material
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: adhesive
      integer :: nx, ny

      self%grid = case%grid
      nx = self%grid%nx
      ny = self%grid%ny
      adhesive = 0.0_dp
      self%adhesive = case%adhesion%potential /= 'none'
      if (self%adhesive) adhesive = case%adhesion%energy/case%adhesion%range
      self%law = new_friction_law(trim(case%friction%law), case%friction%coefficient, &
         case%friction%shear_strength, adhesive, case%friction%slope_effect, &
         case%solver%slip_law == 'physical')
      self%block%height = case%material%thickness
      self%block%mass = 0.5_dp*case%material%density*case%material%thickness
      self%block%area = self%grid%lx*self%grid%ly
      call new_tangential_operator(self%operator, self%grid, case%material%poisson, self%block%height, &
         error)
      if (allocated(error)) return
      call new_friction_solver(self%solver, self%grid, case%material%poisson, self%operator, error, &
         merge(friction_thesis, friction_fast, case%solver%method == 'thesis'))
      if (allocated(error)) return
      self%solver%max_iterations = case%solver%max_iterations
      allocate (self%traction(nx, ny, 2), source=0.0_dp)
      allocate (self%before, self%displacement, self%trial, self%slip, self%rubbing, self%drive, self%past, &
         source=self%traction)
      allocate (self%contact(nx, ny), self%rubbed(nx, ny), source=0_int8)
      call new_history(self%history, material, nx*ny, 2, error)
      if (allocated(error)) return
      call new_books(self%books, material, self%grid%dx*self%grid%dy)
   end subroutine new_tangential_state

   !> Begin a step: what the road's motion and the past ask for. The material's step has begun.
   subroutine begin(self, material, motion, dt, pulled, pull)
      class(tangential_state_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      real(dp), intent(in) :: motion(2)               !! D' - D, m; a guess where pulled
      real(dp), intent(in) :: dt                      !! s; 0: instantaneous
      logical, intent(in) :: pulled(2)                !! the road hangs on a force along x, y
      real(dp), intent(in) :: pull(2)                 !! that force, over the cell, Pa
      real(dp) :: height, shift(2)
      integer :: c, j

      self%motion = motion
      self%dt = dt
      self%q = material%q
      self%pulled = pulled
      self%pull = pull
      self%found = motion
      self%slides_off = .false.
      self%moved = self%moved .or. any(abs(motion) > 0.0_dp) .or. any(pulled .and. abs(pull) > 0.0_dp)
      if (.not. self%moved) return
      ! A road that goes back where it began leaves displacements of round-off.
      self%solver%least_scale = self%q*norm2(merge(0.0_dp, motion, pulled))
      if (.not. dt > 0.0_dp) self%pace = 0.0_dp
      call history_field(self%history, material, self%past)
      self%past_mean = means(self, self%past)
      height = self%block%height
      shift = self%q*motion
      if (self%block%inert(dt)) then
         ! A mass makes the mean stiffer: like a lower block, moved by what is known of the mass.
         height = self%q*height/(self%q + self%block%resistance(dt))
         shift = shift - height*self%block%known(means(self, self%displacement), motion, dt)
      else if (self%block%mass > 0.0_dp) then
         ! A mass does not move in no time: the mean of the surface stays.
         height = 0.0_dp
         shift = shift - self%q*means(self, self%displacement)
      end if
      where (pulled) shift = 0.0_dp
      do c = 1, 2
         !$omp parallel do default(none) shared(self, c, shift) private(j)
         do j = 1, self%grid%ny
            self%drive(:, j, c) = self%q*self%displacement(:, j, c) + shift(c)
         end do
      end do
      call set_thickness(self, height)
      if (any(pulled) .and. self%block%mass > 0.0_dp) call place_mass(self)
   end subroutine begin

   !> A pulled mass: the rubber carries the pull F from its top to the mass, which T brakes. Means:
   !>
   !>    U' = h (F + T_h)/Q,   T - F = f' = R (U' - (D' - D))/h - k
   !>
   !> with the force f' on the mass, its resistance R and what is known of it, k, by module
   !> `block_motion`. So Q (D' - D) - Q U' = -Q h/R (k + T - F): a spring for the solver, whose operator
   !> needs no mean mode. In no time the mass does not move.
   subroutine place_mass(self)
      type(tangential_state_type), intent(inout) :: self
      integer :: c

      if (self%block%inert(self%dt)) then
         self%mass_yields = self%q*self%block%height/self%block%resistance(self%dt)
         self%mass_place = -self%mass_yields &
            *self%block%known(means(self, self%displacement), [0.0_dp, 0.0_dp], self%dt)
      else
         self%mass_yields = tiny(1.0_dp)
         self%mass_place = -self%q*means(self, self%displacement)
      end if
      do c = 1, 2
         if (self%pulled(c)) self%operator%symbol(0, 0, c) = 0.0_dp
      end do
   end subroutine place_mass

   !> Tell the solver what pulls the road. The rest of the horizontal force is not in T: without
   !> `slope_effect` that of all slopes, else that of the slopes which attraction pulls at outside the
   !> contact.
   subroutine hang_road(self, pressure, slope_x, slope_y)
      type(tangential_state_type), intent(inout) :: self
      real(dp), intent(in) :: pressure(:, :), slope_x(:, :), slope_y(:, :)

      associate (pull => self%solver%pull)
         pull%along = self%pulled
         if (.not. any(self%pulled)) return
         pull%traction = self%pull - outside_force(self, pressure, slope_x, slope_y)
         if (self%block%mass > 0.0_dp) then
            pull%offset = self%mass_place
            pull%yielding = self%mass_yields
         else
            pull%offset = self%q*self%found
            pull%yielding = 0.0_dp
         end if
      end associate
   end subroutine hang_road

   !> How far the pulled road has moved, from what the solver has found.
   subroutine find_motion(self)
      type(tangential_state_type), intent(inout) :: self

      if (.not. any(self%pulled)) return
      associate (pull => self%solver%pull)
         if (self%block%mass > 0.0_dp) pull%offset = pull%offset + &
            self%block%height*(pull%traction + self%past_mean)
         self%found = merge(pull%offset/self%q, self%motion, self%pulled)
         self%slides_off = pull%slides_off
         if (self%slides_off) self%held = merge(means(self, self%traction) + self%pull - pull%traction, 0.0_dp, &
            self%pulled)
      end associate
   end subroutine find_motion

   !> Mean horizontal force of the road on the rubber that T does not hold, Pa.
   function outside_force(self, pressure, slope_x, slope_y) result(force)
      type(tangential_state_type), intent(in) :: self
      real(dp), intent(in) :: pressure(:, :), slope_x(:, :), slope_y(:, :)
      real(dp) :: force(2)
      real(dp), allocatable :: rows(:, :)
      logical, allocatable :: counts(:)
      integer :: j

      force = 0.0_dp
      if (self%law%slope .and. .not. self%adhesive) return
      allocate (rows(2, self%grid%ny))
      !$omp parallel do default(none) shared(self, pressure, slope_x, slope_y, rows) private(j, counts)
      do j = 1, self%grid%ny
         counts = self%contact(:, j) == 0_int8 .or. .not. self%law%slope
         rows(1, j) = sum(pressure(:, j)*slope_x(:, j), counts)
         rows(2, j) = sum(pressure(:, j)*slope_y(:, j), counts)
      end do
      force = -global_sum([sum(rows(1, :)), sum(rows(2, :))])/(real(self%grid%nx, dp)*self%grid%ny)
   end function outside_force

   !> The step is solved: take over how far the pulled road has moved, which the displacements were
   !> reckoned without.
   subroutine take_motion(self, motion)
      class(tangential_state_type), intent(inout) :: self
      real(dp), intent(out) :: motion(2)              !! of the road in the step, m
      integer :: c, j

      motion = self%found
      do c = 1, 2
         if (.not. self%pulled(c)) cycle
         !$omp parallel do default(none) shared(self, c) private(j)
         do j = 1, self%grid%ny
            self%trial(:, j, c) = self%trial(:, j, c) + (self%found(c) - self%motion(c))
         end do
      end do
      self%motion = self%found
   end subroutine take_motion

   !> Start the step's traction from the change of the last step going on. To be called when the road
   !> has moved, once a step.
   subroutine extrapolate(self, steady)
      class(tangential_state_type), intent(inout) :: self
      logical, intent(in) :: steady                   !! the road moves as in the step before
      real(dp) :: factor, t(2)
      integer :: i, j

      factor = 0.0_dp
      if (steady .and. self%pace > 0.0_dp) factor = self%dt/self%pace
      !$omp parallel do default(none) shared(self, factor) private(i, j, t)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            t = self%traction(i, j, :)
            if (self%contact(i, j) == 1_int8) &
               self%traction(i, j, :) = t + factor*(t - self%before(i, j, :))
            self%before(i, j, :) = t
         end do
      end do
      self%pace = self%dt
      self%solver%near = factor > 0.0_dp
   end subroutine extrapolate

   !> The compliance of the mean mode, periodic mode only.
   subroutine set_thickness(self, thickness)
      type(tangential_state_type), intent(inout) :: self
      real(dp), intent(in) :: thickness

      if (self%grid%boundary == boundary_periodic) call set_mean_compliance(self%operator, thickness)
   end subroutine set_thickness

   !> Means of a vector field over the grid.
   function means(self, field) result(mean)
      type(tangential_state_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)
      real(dp) :: mean(2)
      real(dp), allocatable :: rows(:, :)
      integer :: j

      allocate (rows(2, self%grid%ny))
      !$omp parallel do default(none) shared(self, field, rows) private(j)
      do j = 1, self%grid%ny
         rows(1, j) = sum(field(:, j, 1))
         rows(2, j) = sum(field(:, j, 2))
      end do
      mean = global_sum([sum(rows(1, :)), sum(rows(2, :))])/(real(self%grid%nx, dp)*self%grid%ny)
   end function means

   !> Solve for the traction under a pressure: T, the trial displacement, the slip. Where the road is
   !> pulled, the trial displacement is reckoned as if the road had moved by the guess: U - (D' - D) is
   !> right, and the road is read by that. `take_motion` ends this.
   subroutine solve(self, pressure, gap, slope_x, slope_y, tolerance, settle, outcome)
      class(tangential_state_type), intent(inout), target :: self
      real(dp), intent(in), contiguous, target :: pressure(:, :)
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in), contiguous, target :: slope_x(:, :), slope_y(:, :)
      real(dp), intent(in) :: tolerance
      logical, intent(in) :: settle                   !! T has to settle too, not only the displacements
      type(solver_result_type), intent(out) :: outcome
      type(friction_fields_type) :: fields
      integer :: j, c

      self%solver%tolerance = tolerance
      self%solver%settle = settle
      call mark_contact(self, pressure, gap)
      call hang_road(self, pressure, slope_x, slope_y)
      fields%pressure => pressure
      fields%slope_x => slope_x
      fields%slope_y => slope_y
      fields%drive => self%drive
      fields%past => self%past
      fields%traction => self%traction
      fields%slip => self%slip
      fields%contact => self%contact
      call self%solver%solve(self%operator, self%law, fields, outcome)
      call find_motion(self)
      do c = 1, 2
         !$omp parallel do default(none) shared(self, c) private(j)
         do j = 1, self%grid%ny
            self%slip(:, j, c) = self%slip(:, j, c)/self%q
            self%trial(:, j, c) = self%displacement(:, j, c) + self%motion(c) - self%slip(:, j, c)
         end do
      end do
   end subroutine solve

   !> Mark the cells that may carry friction, those that touch. A cell that slipped is still marked so.
   subroutine mark_contact(self, pressure, gap)
      type(tangential_state_type), intent(inout) :: self
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      integer :: i, j

      !$omp parallel do default(none) shared(self, pressure, gap) private(i, j)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            if (.not. touches(self%adhesive, pressure(i, j), gap(i, j))) then
               self%contact(i, j) = 0_int8
            else if (self%contact(i, j) == 0_int8) then
               self%contact(i, j) = 1_int8
            end if
         end do
      end do
   end subroutine mark_contact

   !> Take a state of steady sliding. Its history and energies are set by the caller.
   subroutine take_steady(self, found, velocity)
      class(tangential_state_type), intent(inout) :: self
      type(steady_contact_type), intent(in) :: found
      real(dp), intent(in) :: velocity(2)             !! of the road, m/s
      real(dp), parameter :: within = 1.0_dp + 1e-6_dp  !! s of the bound from which a point sticks
      real(dp) :: slope(2), star(2), before
      integer :: i, j

      before = self%block%kinetic()
      self%moved = .true.
      self%pace = 0.0_dp
      self%rate = 0.0_dp
      self%block%speed = -velocity
      self%block%fresh = .true.
      self%block%work = self%block%work + self%block%kinetic() - before
      !$omp parallel do default(none) shared(self, found) private(i, j, slope, star)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            self%traction(i, j, :) = found%traction(i, :, j)
            self%displacement(i, j, :) = found%displacement(i, :, j)
            slope = [found%slope_x(i, j), found%slope_y(i, j)]
            star = self%law%normal_traction(found%pressure(i, j), slope)
            self%contact(i, j) = 0_int8
            self%rubbing(i, j, :) = 0.0_dp
            if (found%pressure(i, j) <= 0.0_dp) cycle
            self%rubbing(i, j, :) = self%traction(i, j, :) - star
            self%contact(i, j) = 2_int8
            if (self%law%bound_ratio(found%pressure(i, j), slope, self%traction(i, j, :) - star) > within) &
               self%contact(i, j) = 1_int8
         end do
      end do
      self%rubbed(:, :) = self%contact
      self%before(:, :, :) = self%traction
      self%trial(:, :, :) = self%displacement
      self%slip(:, :, :) = 0.0_dp
   end subroutine take_steady

   !> End the step: history, energies, the motion of the mass.
   subroutine commit(self, material, pressure, slope_x, slope_y)
      class(tangential_state_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      real(dp), intent(in) :: pressure(:, :)
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      type(products_type) :: products
      real(dp) :: carried(2), before(2), after(2)

      if (.not. self%moved) return
      products = new_products(material)
      carried = 0.0_dp
      if (self%block%mass > 0.0_dp) then
         before = means(self, self%displacement)
         after = means(self, self%trial)
         carried = means(self, self%traction) + self%past_mean - self%q*after/self%block%height
         call self%block%finish(after - before - self%motion, carried, self%dt)
      end if
      call commit_history(self%history, material, self%traction, self%displacement, self%trial, &
         products, carried)
      call book_step(self%books, material, products)
      call book_friction(self, pressure, slope_x, slope_y)
      self%displacement(:, :, :) = self%trial
   end subroutine commit

   !> Energy lost by friction, and the mean speed of the surface in the contact.
   subroutine book_friction(self, pressure, slope_x, slope_y)
      class(tangential_state_type), intent(inout) :: self
      real(dp), intent(in) :: pressure(:, :)
      real(dp), intent(in) :: slope_x(:, :), slope_y(:, :)
      real(dp), allocatable :: rows(:, :)
      real(dp) :: rubbing(2), slope(2), total(4)
      integer :: i, j

      allocate (rows(4, self%grid%ny), source=0.0_dp)
      slope = 0.0_dp
      !$omp parallel do default(none) shared(self, pressure, slope_x, slope_y, rows) &
      !$omp private(i, j, rubbing) firstprivate(slope)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            rubbing = 0.0_dp
            if (self%contact(i, j) /= 0_int8) then
               if (self%law%slope) slope = [slope_x(i, j), slope_y(i, j)]
               rubbing = self%traction(i, j, :) - self%law%normal_traction(pressure(i, j), slope)
               rows(2:3, j) = rows(2:3, j) + self%trial(i, j, :) - self%displacement(i, j, :)
               rows(4, j) = rows(4, j) + 1.0_dp
            end if
            ! The slip of a point that sticks is what the solver's tolerance left: it loses nothing.
            if (self%contact(i, j) /= 1_int8) rows(1, j) = rows(1, j) &
               + rubbed_off(self%rubbed(i, j) == 1_int8, self%rubbing(i, j, :), rubbing, self%slip(i, j, :))
            self%rubbing(i, j, :) = rubbing
            self%rubbed(i, j) = self%contact(i, j)
         end do
      end do
      total = global_sum([(sum(rows(i, :)), i = 1, 4)])
      self%lost_friction = self%lost_friction + total(1)*self%grid%dx*self%grid%dy
      if (self%dt > 0.0_dp .and. total(4) > 0.0_dp) self%rate = total(2:3)/(total(4)*self%dt)
   end subroutine book_friction

   !> What a cell loses by friction in a step, J/m2: the mean of the frictional tractions at both ends times
   !> the slip. A cell that enters or leaves the contact has none at one end. A cell that stuck at the start
   !> slips only once its traction has reached its bound, so that the traction of the end counts alone; so it
   !> does where the slip has turned against the traction of the start, since the cell has stuck in between.
   pure function rubbed_off(stuck, before, after, slip) result(loss)
      logical, intent(in) :: stuck                    !! at the start of the step
      real(dp), intent(in) :: before(2)               !! T - T* at the start of the step, Pa
      real(dp), intent(in) :: after(2)                !! and at its end, Pa
      real(dp), intent(in) :: slip(2)                 !! m
      real(dp) :: loss
      real(dp) :: first

      loss = max(dot_product(after, slip), 0.0_dp)
      first = dot_product(before, slip)
      if (first >= 0.0_dp .and. .not. stuck) loss = 0.5_dp*(first + loss)
   end function rubbed_off

   !> Means of the traction, part of the grid that sticks, mean slip of the step.
   subroutine sums(self, traction, stick, slip)
      class(tangential_state_type), intent(in) :: self
      real(dp), intent(out) :: traction(2)            !! Pa
      real(dp), intent(out) :: stick
      real(dp), intent(out) :: slip(2)                !! m

      traction = means(self, self%traction)
      slip = means(self, self%slip)
      stick = real(global_sum(count(self%contact == 1_int8)), dp)/(real(self%grid%nx, dp)*self%grid%ny)
   end subroutine sums

   !> Free plans and fields.
   subroutine destroy(self)
      class(tangential_state_type), intent(inout) :: self

      call self%operator%destroy()
      call self%solver%destroy()
      call destroy_history(self%history)
   end subroutine destroy

end module tangential_state
