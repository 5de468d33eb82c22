!> The tangential side of a step: the tractions, displacements and slip of a rubber block that is driven over a
!> road, with the viscoelasticity of the block and the inertia of its mean motion.
!>
!> The slip of a step is r = DX - U' with DX = U + (D' - D) and U' = A(T + T_h)/Q, where U and D are the displacements
!> of the surface and of the road, a prime marks the end of the step, Q is the modulus of the step and T_h the traction
!> of the past. The solver works with Q r = DX' - A(T + T_h), where DX' = Q DX. The mean of a block with mass moves by
!> the rule of module `block_motion`; the part of the mean traction that accelerates the mass does not deform the rubber.
!>
!> The loss by friction is that of the mean traction over the step (module `friction_books`).
!>
!> Memory beside the state, in fields of doubles with two components each: the trial U', slip, DX', T_h; and those of
!> the solver.
module tangential_step
   use adhesion_potential, only : adhesion_potential_type, adhesive_slope, new_adhesion_potential
   use case_settings, only : case_type
   use asperity_errors, only : error_type
   use friction_books, only : book_friction, book_rest, mark_idle, rubbed_type
   use field_copies, only : copy_field
   use field_sums, only : field_count, largest_of_rows, vector_sum
   use fft_conv, only : columns_apply, convolution_type, new_convolution
   use friction_cg, only : friction_fields_type, friction_solver_type, new_friction_solver
   use friction_law, only : contact_stick, friction_law_type, new_friction_law
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use road_pull, only : road_pull_type
   use rubber_kernels, only : tangential_kernel
   use solver_result, only : solver_result_type
   use touching_cells, only : force_beside, mark_contact, mark_shares
   use tangential_state, only : tangential_state_type
   use viscoelastic_energy, only : book_step
   use arm_state, only : commit_arms, new_products, past_traction, products_type
   use zener, only : step_relaxed, zener_type
   implicit none
   private

   public :: new_tangential_step, tangential_step_type

   real(dp), parameter :: resolved = 100.0_dp*epsilon(1.0_dp)   !! round-off of a product of the operator, relative

   !> The solver of the tangential side and the present step. A variable of this type must not be copied.
   type :: tangential_step_type
      type(grid_type) :: grid
      type(friction_law_type) :: law
      logical :: adhesive = .false.                   !! the contact has an adhesive potential
      real(dp) :: tolerance = 1e-6_dp                 !! of the next solve; that of the case always suffices
      real(dp), allocatable :: trial(:, :, :)         !! U_T at the end of the step, m [nx, 2, rows]
      real(dp), allocatable :: slip(:, :, :)          !! of the step, m
      logical, private :: foresees = .true.           !! `slip` serves as a forecast, except with the thesis's method
      logical, private :: slip_expected = .false.     !! `slip` is about that of the step
      logical :: pulled(2) = .false.                  !! the road is pulled by a force along x, y
      type(road_pull_type) :: road_pull               !! that force, and the motion that follows from it
      !> The share of its bound that each cell may carry [nx, rows]. If it is not allocated, cells in contact carry the
      !> whole bound.
      real(dp), allocatable :: share(:, :)
      real(dp) :: way_before = 0.0_dp                 !! of the road in the step before, m
      logical :: starts = .false.                     !! the step follows a jump, or is the first one with friction
      type(convolution_type), private :: operator
      type(friction_solver_type), private :: solver
      real(dp), allocatable, private :: drive(:, :, :)    !! DX' [nx, 2, rows]
      real(dp), allocatable, private :: past(:, :, :)     !! T_h, Pa [nx, 2, rows]
      real(dp), private :: motion(2) = 0.0_dp             !! D' - D of the present step, m; a guess where pulled
      real(dp), private :: dt = 0.0_dp                    !! of the present step, s; 0: instantaneous
      real(dp), private :: q = 0.0_dp                     !! Q of the present step, Pa
      real(dp), private :: past_mean(2) = 0.0_dp          !! mean of T_h, Pa
      real(dp), private :: compliance = 0.0_dp            !! of a cell under its own unit traction, G = 1, m/Pa
   contains
      procedure :: begin
      procedure :: extrapolate
      procedure :: expect
      procedure :: solve
      procedure :: try
      procedure :: cell_compliance
      procedure :: respond
      procedure :: correct_motion
      procedure :: commit
      procedure :: sums
      procedure :: destroy
   end type tangential_step_type

contains

   !> Prepare the operator and the solver.
   subroutine new_tangential_step(self, case, grid, error)
      type(tangential_step_type), intent(out) :: self
      type(case_type), intent(in) :: case
      type(grid_type), intent(in) :: grid             !! that of the case; its rows may be shared
      type(error_type), allocatable, intent(out) :: error
      type(adhesion_potential_type) :: potential

      self%grid = grid
      self%adhesive = case%adhesion%potential /= 'none'
      call new_adhesion_potential(potential, trim(case%adhesion%potential), case%adhesion%energy, &
         case%adhesion%range, error)
      self%law = new_friction_law(trim(case%friction%law), case%friction%coefficient, &
         case%friction%shear_strength, adhesive_slope(potential, 0.0_dp), case%friction%slope_effect, &
         case%solver%slip_law == 'physical', case%friction%table)
      call new_convolution(self%operator, self%grid, tangential_kernel(case%material), error)
      if (allocated(error)) return
      self%compliance = self%operator%symbols%self_compliance(with_mean=self%grid%boundary /= boundary_periodic)
      call new_friction_solver(self%solver, self%grid, self%operator, error, trim(case%solver%method))
      self%solver%max_iterations = case%solver%max_iterations
      self%solver%accepted = case%solver%tolerance
      ! The traction need not settle as well, because the passes judge a step by its displacements.
      self%solver%settle = .false.
      self%foresees = case%solver%method /= 'thesis'
      allocate (self%trial(self%grid%nx, 2, self%grid%rows()), source=0.0_dp)
      allocate (self%slip, self%drive, self%past, source=self%trial)
   end subroutine new_tangential_step

   !> Begin a step: compute DX' from the road's motion, and T_h from the state of the arms. The caller has
   !> begun the step of the material.
   subroutine begin(self, state, material, motion, dt, pulled, pull)
      class(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(inout) :: state
      type(zener_type), intent(in) :: material
      real(dp), intent(in) :: motion(2)               !! D' - D, m; a guess where pulled
      real(dp), intent(in) :: dt                      !! s; 0: instantaneous
      logical, intent(in) :: pulled(2)                !! a force pulls the road along x, y
      real(dp), intent(in) :: pull(2)                 !! that force, over the cell, Pa
      real(dp) :: height, mean(2), shift(2)
      integer :: c, j

      self%motion = motion
      self%dt = dt
      self%q = material%q
      self%pulled = pulled
      self%solver%pull%along = pulled
      self%solver%near = .false.
      call self%road_pull%begin(pull, motion, self%q)
      if (allocated(self%share)) deallocate (self%share)
      self%slip_expected = .false.
      state%moved = state%moved .or. any(abs(motion) > 0.0_dp) .or. any(pulled .and. abs(pull) > 0.0_dp)
      if (.not. state%moved) return
      ! If the road returns to where it began, only round-off is left of the displacements, and if the load of a block with
      ! mass jumps while all cells stick, nothing moves at all. The least scale keeps round-off from being the scale of the
      ! residual.
      self%solver%least_scale = self%q*norm2(merge(0.0_dp, motion, pulled))
      if (.not. self%solver%least_scale > 0.0_dp) &
         self%solver%least_scale = round_off(self, state)/self%solver%accepted
      if (.not. dt > 0.0_dp) state%last_dt = 0.0_dp
      self%starts = .not. state%last_dt > 0.0_dp
      call past_traction(state%arms, material, self%past)
      self%past_mean = means(self, self%past)
      mean = 0.0_dp
      state%block%at_rest = material%kind == step_relaxed
      if (state%block%has_inertia()) mean = means(self, state%displacement)
      call state%block%respond(self%q, mean, motion, dt, height, shift)
      where (pulled) shift = 0.0_dp
      !$omp parallel do default(none) shared(self, state, shift) private(c, j)
      do j = 1, self%grid%rows()
         do c = 1, 2
            self%drive(:, c, j) = self%q*state%displacement(:, c, j) + shift(c)
         end do
      end do
      ! On a free grid there is no mean mode to set.
      if (self%grid%boundary == boundary_periodic) call self%operator%symbols%set_mean_compliance(height)
      if (any(pulled) .and. state%block%mass > 0.0_dp) then
         call self%road_pull%place_mass(state%block, mean, dt)
         do c = 1, 2
            if (pulled(c)) call self%operator%symbols%set_mean_mode(c, 0.0_dp)
         end do
      end if
   end subroutine begin

   !> The round-off of DX' and of A T, in the units of DX'.
   function round_off(self, state) result(size)
      type(tangential_step_type), intent(in) :: self
      type(tangential_state_type), intent(in) :: state
      real(dp) :: size
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(self%grid%rows()))
      !$omp parallel do default(none) shared(self, state, rows) private(j)
      do j = 1, self%grid%rows()
         rows(j) = max(self%q*maxval(abs(state%displacement(:, :, j))), self%compliance*maxval(abs(state%traction(:, :, j))))
      end do
      size = resolved*largest_of_rows(rows)
   end function round_off

   !> Set the pull of the road in the solver. The part of the pull that T does not balance acts on slopes of the road:
   !> on all slopes if `slope_effect` is off, otherwise only on those outside the contact, through the attraction.
   subroutine set_pull(self, state, pressure, slope_x, slope_y)
      type(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(in) :: state
      real(dp), intent(in) :: pressure(:, :), slope_x(:, :), slope_y(:, :)
      real(dp) :: beside(2)

      if (.not. any(self%pulled)) return
      beside = 0.0_dp
      if (self%adhesive .or. .not. self%law%slope_effect) &
         beside = force_beside(state%contact, self%law%slope_effect, pressure, slope_x, slope_y)/self%grid%cells()
      call self%road_pull%set_pull(self%solver%pull, state%block, beside)
   end subroutine set_pull

   !> Compute the motion of the pulled road from the solution.
   subroutine find_motion(self, state)
      type(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(in) :: state

      if (.not. any(self%pulled)) return
      call self%road_pull%find_motion(self%solver%pull, state%block, self%past_mean)
      if (self%road_pull%slides_off) call self%road_pull%find_held(self%solver%pull, means(self, state%traction))
   end subroutine find_motion

   !> Correct the displacements of a solved step for the motion of the pulled road, because they were computed with a
   !> guess of this motion.
   subroutine correct_motion(self, motion)
      class(tangential_step_type), intent(inout) :: self
      real(dp), intent(out) :: motion(2)              !! of the road in the step, m
      integer :: c, j

      motion = self%road_pull%motion
      do c = 1, 2
         if (.not. self%pulled(c)) cycle
         !$omp parallel do default(none) shared(self, c, motion) private(j)
         do j = 1, self%grid%rows()
            self%trial(:, c, j) = self%trial(:, c, j) + (motion(c) - self%motion(c))
         end do
      end do
      self%motion = motion
   end subroutine correct_motion

   !> Extrapolate the traction: the step starts as if the change of the last step continued. This must be called
   !> exactly once per step, after the road has moved.
   subroutine extrapolate(self, state, steady)
      class(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(inout) :: state
      logical, intent(in) :: steady                   !! the road moves as in the step before

      self%solver%near = steady .and. state%last_dt > 0.0_dp .and. self%dt > 0.0_dp
      call state%extrapolate(self%dt, self%solver%near)
   end subroutine extrapolate

   !> Set the expected slip from the expected place of the surface at the end of the step. In the first pass cells that
   !> slip far start in the direction of this slip, and in later passes in that of the slip that the last pass has found.
   subroutine expect(self, state, place)
      class(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(in) :: state
      real(dp), intent(in) :: place(:, :, :)          !! U_T, m [nx, 2, rows]
      integer :: c, j

      self%slip_expected = self%foresees
      !$omp parallel do default(none) shared(self, state, place) private(c, j)
      do j = 1, self%grid%rows()
         do c = 1, 2
            self%slip(:, c, j) = state%displacement(:, c, j) + self%motion(c) - place(:, c, j)
         end do
      end do
   end subroutine expect

   !> Means of a vector field over the grid.
   function means(self, field) result(mean)
      type(tangential_step_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)          !! [nx, 2, rows]
      real(dp) :: mean(2)

      mean = vector_sum(field)/self%grid%cells()
   end function means

   !> Solve for T under a pressure, and compute the trial displacement and the slip. Where the road is pulled,
   !> the trial displacement belongs to the guessed motion of the road. The difference U - (D' - D) is right,
   !> and only this difference is used to read the road. `correct_motion` corrects the displacement in the end.
   subroutine solve(self, state, pressure, gap, slope_x, slope_y, outcome)
      class(tangential_step_type), intent(inout), target :: self
      type(tangential_state_type), intent(inout), target :: state
      real(dp), intent(in), contiguous, target :: pressure(:, :)
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in), contiguous, target :: slope_x(:, :), slope_y(:, :)
      type(solver_result_type), intent(out) :: outcome
      type(friction_fields_type) :: fields
      real(dp), allocatable, target :: weighed(:, :)

      self%solver%tolerance = self%tolerance
      fields%pressure => pressure
      if (allocated(self%share)) then
         weighed = pressure*self%share
         fields%pressure => weighed
         fields%share => self%share
         call mark_shares(self%share, state%contact)
      else
         call mark_contact(self%adhesive, pressure, gap, state%contact)
      end if
      call set_pull(self, state, pressure, slope_x, slope_y)
      fields%slope_x => slope_x
      fields%slope_y => slope_y
      fields%drive => self%drive
      fields%past => self%past
      fields%traction => state%traction
      fields%slip => self%slip
      if (self%slip_expected .and. .not. allocated(self%share)) fields%slip_unit = self%q
      fields%contact => state%contact
      call self%solver%solve(self%operator, self%law, fields, outcome)
      call find_motion(self, state)
      call find_trial(self, state)
   end subroutine solve

   !> Divide Q times the slip by Q, and compute the trial displacement from the slip.
   subroutine find_trial(self, state)
      type(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(in) :: state
      integer :: c, j

      !$omp parallel do default(none) shared(self, state) private(c, j)
      do j = 1, self%grid%rows()
         do c = 1, 2
            self%slip(:, c, j) = self%slip(:, c, j)/self%q
            self%trial(:, c, j) = state%displacement(:, c, j) + self%motion(c) - self%slip(:, c, j)
         end do
      end do
   end subroutine find_trial

   !> Compute the slip and the trial displacement under given tractions, for a road that is not pulled.
   subroutine try(self, state, traction)
      class(tangential_step_type), intent(inout) :: self
      type(tangential_state_type), intent(in) :: state
      real(dp), intent(in) :: traction(:, :, :)       !! [nx, 2, rows] Pa
      integer :: c, j

      !$omp parallel do default(none) shared(self, traction) private(c, j) num_threads(self%operator%threads)
      do j = 1, self%grid%rows()
         do c = 1, 2
            call self%operator%forward_row(c, j, traction(:, c, j) + self%past(:, c, j))
         end do
      end do
      call self%operator%columns(columns_apply)
      !$omp parallel do default(none) shared(self) private(c, j) num_threads(self%operator%threads)
      do j = 1, self%grid%rows()
         do c = 1, 2
            call self%operator%backward_row(c, j, self%slip(:, c, j))
            self%slip(:, c, j) = self%drive(:, c, j) - self%slip(:, c, j)
         end do
      end do
      call find_trial(self, state)
   end subroutine try

   !> Displacement of a cell under its own unit traction, m/Pa; 0 if there is only one cell.
   pure function cell_compliance(self) result(compliance)
      class(tangential_step_type), intent(in) :: self
      real(dp) :: compliance

      compliance = self%compliance/self%q
   end function cell_compliance

   !> Compute the change of the trial displacement with the traction: four transforms.
   subroutine respond(self, traction, change)
      class(tangential_step_type), intent(inout) :: self
      real(dp), intent(in) :: traction(:, :, :)       !! Pa [nx, rows, 2]
      real(dp), intent(inout) :: change(:, :, :)      !! m [nx, rows, 2]

      call self%operator%apply_vector(traction(:, :, 1), traction(:, :, 2), change(:, :, 1), change(:, :, 2))
      change = change/self%q
   end subroutine respond

   !> End the step: update the arms, the energies and the motion of the mass. Cells that stick are marked.
   subroutine commit(self, state, material, pressure, gap, slope_x, slope_y)
      class(tangential_step_type), intent(inout), target :: self
      type(tangential_state_type), intent(inout) :: state
      type(zener_type), intent(in) :: material
      real(dp), intent(in), contiguous, target :: pressure(:, :)
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in), contiguous, target :: slope_x(:, :), slope_y(:, :)
      type(products_type) :: products
      type(rubbed_type) :: rubbed
      type(friction_fields_type) :: fields
      real(dp), allocatable, target :: weighed(:, :)
      real(dp) :: carried(2), before(2), after(2), kinetic

      if (.not. state%moved) then
         call book_rest(state, self%law, self%adhesive, pressure, gap, slope_x, slope_y)
         return
      end if
      call mark_idle(state, self%slip, idle_slip(self))
      products = new_products(material)
      carried = 0.0_dp
      if (state%block%at_rest) then
         ! The rubber has dissipated the kinetic energy.
         call state%block%come_to_rest(kinetic)
         state%books%work = state%books%work + kinetic
         state%books%dissipated = state%books%dissipated + kinetic
      else if (state%block%has_inertia()) then
         before = means(self, state%displacement)
         after = means(self, self%trial)
         carried = means(self, state%traction) + self%past_mean - self%q*after/state%block%height
         call state%block%finish(after - before - self%motion, carried, self%dt)
      end if
      call commit_arms(state%arms, material, state%traction, state%displacement, self%trial, &
         products, carried)
      call book_step(state%books, material, products)
      fields%pressure => pressure
      if (allocated(self%share)) then
         weighed = pressure*self%share
         fields%pressure => weighed
         fields%share => self%share
      end if
      fields%slope_x => slope_x
      fields%slope_y => slope_y
      fields%slip => self%slip
      call book_friction(state, self%law, fields, self%trial, rubbed)
      state%lost_friction = state%lost_friction + rubbed%loss*self%grid%cell_area()
      if (self%dt > 0.0_dp .and. rubbed%cells > 0.0_dp) state%rate = rubbed%motion/(rubbed%cells*self%dt)
      call copy_field(self%trial, state%displacement)
   end subroutine commit

   !> The longest slip of the step that may be an error, m. While the road rests, it is the error that every solve may
   !> leave, because errors of earlier steps then appear as slip. This error is in proportion to the displacements, and in
   !> the first step of a rest to the way of the road in the step before. In a thick block the displacements contain the
   !> shear of the whole block, and the error may be longer than the way of the road in a step. While the road moves, the
   !> error that the last solve has really left therefore counts.
   pure function idle_slip(self) result(slip)
      class(tangential_step_type), intent(in) :: self
      real(dp) :: slip

      slip = self%solver%allowed_slip/self%q
      associate (way => norm2(self%motion), reached => self%solver%reached_slip/self%q)
         if (.not. way > 0.0_dp) slip = max(slip, self%solver%accepted*self%way_before)
         if (way > reached) slip = min(slip, max(reached, self%solver%tolerance*way))
      end associate
   end function idle_slip

   !> Compute the mean traction, the fraction of the grid that sticks, and the mean slip of the step.
   subroutine sums(self, state, traction, stick, slip)
      class(tangential_step_type), intent(in) :: self
      type(tangential_state_type), intent(in) :: state
      real(dp), intent(out) :: traction(2)            !! Pa
      real(dp), intent(out) :: stick
      real(dp), intent(out) :: slip(2)                !! m

      traction = means(self, state%traction)
      slip = means(self, self%slip)
      stick = field_count(state%contact == contact_stick)/self%grid%cells()
   end subroutine sums

   !> Free plans and fields.
   subroutine destroy(self)
      class(tangential_step_type), intent(inout) :: self

      call self%operator%destroy()
      call self%solver%destroy()
   end subroutine destroy

end module tangential_step
