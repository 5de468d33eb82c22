!> A rubber block on its road: its settings, its solvers, the present step, and its state.
!>
!> `contact_type` combines the solvers with the one component that a row leaves to the next, `state`
!> (module `row_state`). The stages of a step (`road_motion`, `coupled_passes`, `row_account`) work on it, and
!> `asperity_simulation` calls them.
!>
!> Memory beside the state and the normal solver, in fields of doubles: H; with sliding also the original map and the
!> two slopes; with Prony arms the traction of the past; with friction those of the modules
!> `tangential_step` and `coupled_passes`.
module contact_model
   use adhesion_advice, only : adhesion_edge
   use asperity_errors, only : error_type
   use asperity_interpolation, only : interpolation_type, new_interpolation, shifted
   use process_agreement, only : agree
   use asperity_precision, only : dp
   use asperity_schedule, only : count_rows, planned_row_type
   use case_settings, only : case_type
   use contact_rule, only : touches
   use field_sums, only : field_product, row_totals
   use normal_step, only : new_normal_step, normal_step_type, normal_task_type
   use regular_grid, only : grid_type
   use row_state, only : state_type
   use row_stop, only : row_stop_type
   use rubber_kernels, only : normal_kernel
   use solver_result, only : solver_result_type
   use tangential_state, only : new_tangential_state
   use tangential_step, only : new_tangential_step, tangential_step_type
   use viscoelastic_energy, only : book_step, new_books
   use arm_state, only : add_rows, commit_arm_row, new_arm_state, new_products, new_row_sums, &
      products_type
   use workspace, only : new_workspace, workspace_type
   use zener, only : finish_step, is_elastic, new_zener, zener_type
   implicit none
   private

   public :: contact_mean, contact_type, commit_step, new_contact, place_road, solve_normal

   !> A block on its road. A variable of this type must not be copied, but its state may be.
   type :: contact_type
      type(state_type), allocatable :: state        !! state after the last row
      type(case_type) :: case
      type(grid_type) :: grid
      type(normal_step_type) :: normal              !! the solvers of the normal contact
      type(tangential_step_type) :: tangential      !! the solver of friction, and its present step
      type(zener_type) :: material                  !! with the coefficients of the present step
      type(interpolation_type) :: road              !! the original map
      type(workspace_type) :: work                  !! scratch fields of the stages of a step
      type(row_stop_type) :: stop                   !! gives up a row if a stop is requested
      real(dp), allocatable :: height(:, :)         !! H under the rubber in the present step, m
      real(dp), allocatable :: slope_x(:, :)        !! of the road under the rubber, -
      real(dp), allocatable :: slope_y(:, :)
      real(dp), allocatable :: past(:, :)           !! P_h, traction of the past, Pa
      real(dp) :: drift(2) = 0.0_dp                 !! expected motion of the surface in the step, m
      real(dp) :: summit = 0.0_dp                   !! highest point of the original map, m
      real(dp) :: rms_height = 0.0_dp               !! of the original map about its mean, m
      real(dp) :: rms_slope = 0.0_dp                !! of the original map, -
      logical :: slides = .false.                   !! the road moves in some phase, or may be moved
      logical :: frictional = .false.               !! there is a friction law, and the road moves
      logical :: slip_known = .true.                !! the slip is that of the last row
   contains
      procedure :: friction_acts
      procedure :: all_cells_stick
   end type contact_type

contains

   !> Prepare the solvers, and a state at rest. The caller has set `case`, `grid`, `height` and `slides`.
   !> Collective: if one process has not enough memory, all of them return.
   subroutine new_contact(self, error)
      class(contact_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: edge
      integer :: nx, ny

      nx = self%grid%nx
      ny = self%grid%rows()
      call new_workspace(self%work, nx, ny)
      associate (case => self%case)
         edge = 0.0_dp
         if (case%adhesion%potential /= 'none') edge = adhesion_edge(case)
         call new_zener(self%material, case%material%shear_modulus, case%material%prony_g, &
            case%material%prony_tau, trim(case%solver%time_scheme), error)
         if (.not. allocated(error)) call new_normal_step(self%normal, self%grid, normal_kernel(case%material), &
            case%solver, case%adhesion, edge, self%height, error)
      end associate
      call agree(error)
      if (allocated(error)) return
      self%summit = self%normal%summit
      self%rms_height = self%normal%rms_height
      call new_books(self%state%books, self%material, self%grid%cell_area())
      allocate (self%state%pressure(nx, ny), self%state%gap(nx, ny), source=0.0_dp)
      ! The displacement is only needed by a later row: that of the last row can be computed from the gap.
      if (self%slides .or. count_rows(self%case%phases) > 1) &
         allocate (self%state%displacement(nx, ny), source=0.0_dp)
      if (.not. is_elastic(self%material)) allocate (self%past(nx, ny), source=0.0_dp)
      call new_arm_state(self%state%arms, self%material, nx, ny, 1, error)
      if (self%slides .and. .not. allocated(error)) call new_road(self, error)
      call agree(error)
      if (allocated(error)) return
      self%frictional = self%slides .and. self%case%friction%law /= 'none'
      if (.not. self%frictional) return
      call new_tangential_state(self%state%tangential, self%case, self%grid, self%material, error)
      if (.not. allocated(error)) call new_tangential_step(self%tangential, self%case, self%grid, error)
      call agree(error)
   end subroutine new_contact

   !> Prepare a road that moves.
   subroutine new_road(self, error)
      class(contact_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call new_interpolation(self%road, self%grid, self%height, trim(self%case%solver%interpolation), &
         error)
      call agree(error)
      if (allocated(error)) return
      allocate (self%slope_x(self%grid%nx, self%grid%rows()), self%slope_y(self%grid%nx, self%grid%rows()))
      call place_road(self, 0.0_dp, 0.0_dp)
      self%rms_slope = sqrt((field_product(self%slope_x, self%slope_x) &
         + field_product(self%slope_y, self%slope_y))/self%grid%cells())
   end subroutine new_road

   !> Compute the heights and slopes of the road at a displacement, under a surface that has not moved.
   subroutine place_road(self, road_x, road_y)
      class(contact_type), intent(inout) :: self
      real(dp), intent(in) :: road_x, road_y        !! m

      if (self%slides) call shifted(self%road, road_x, road_y, self%height, &
         self%slope_x, self%slope_y)
   end subroutine place_road

   !> Does friction act yet?
   pure function friction_acts(self) result(yes)
      class(contact_type), intent(in) :: self
      logical :: yes

      yes = .false.
      if (self%frictional) yes = self%state%tangential%moved
   end function friction_acts

   !> Is there a law of friction whose tractions are still zero, because the road has not moved? All touching cells then
   !> stick.
   pure function all_cells_stick(self) result(yes)
      class(contact_type), intent(in) :: self
      logical :: yes

      yes = self%case%friction%law /= 'none' .and. .not. self%friction_acts()
   end function all_cells_stick

   !> Solve the normal contact under the row's load.
   subroutine solve_normal(self, plan, tolerance, outcome, displaced)
      class(contact_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: tolerance
      type(solver_result_type), intent(out) :: outcome
      logical, intent(in), optional :: displaced    !! without adhesion: `gap` holds the displacement U, m
      type(normal_task_type) :: task

      task = normal_task_type(plan%control, plan%load, self%material%q, self%state%first)
      if (present(displaced)) task%displaced = displaced
      self%normal%tolerance = tolerance
      ! Without arms `past` is not allocated, and therefore an absent argument.
      call self%normal%solve(task, self%height, self%state%pressure, self%state%gap, self%state%level, &
         outcome, self%past)
      self%state%first = .false.
   end subroutine solve_normal

   !> End the step: update the displacements, arms and energies of both directions.
   subroutine commit_step(self)
      class(contact_type), intent(inout) :: self
      type(products_type) :: products
      real(dp), allocatable :: displacement(:), before(:), sums(:, :)
      integer :: j

      sums = new_row_sums(self%material, self%grid%rows())
      allocate (displacement(self%grid%nx), before(self%grid%nx), source=0.0_dp)
      !$omp parallel do default(none) shared(self, sums) private(j) firstprivate(displacement, before)
      do j = 1, self%grid%rows()
         displacement(:) = self%state%gap(:, j) + self%height(:, j) + self%state%level
         if (allocated(self%state%displacement)) before(:) = self%state%displacement(:, j)
         call commit_arm_row(self%state%arms, self%material, 1, j, self%state%pressure(:, j), &
            before, displacement, sums(:, j))
         if (allocated(self%state%displacement)) self%state%displacement(:, j) = displacement
      end do
      products = new_products(self%material)
      call add_rows(products, sums)
      call book_step(self%state%books, self%material, products)
      if (self%frictional) call self%tangential%commit(self%state%tangential, self%material, &
         self%state%pressure, self%state%gap, self%slope_x, self%slope_y)
      call finish_step(self%material)
      self%state%dt_old = self%material%dt_old
   end subroutine commit_step

   !> Mean of a vector field over the contact.
   function contact_mean(self, field) result(mean)
      class(contact_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)        !! [nx, 2, ny]
      real(dp) :: mean(2)
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(3)
      logical, allocatable :: touching(:)
      integer :: j

      allocate (rows(3, self%grid%rows()))
      !$omp parallel do default(none) shared(self, field, rows) private(j, touching)
      do j = 1, self%grid%rows()
         touching = touches(self%normal%adhesive, self%state%pressure(:, j), self%state%gap(:, j))
         rows(1, j) = sum(field(:, 1, j), touching)
         rows(2, j) = sum(field(:, 2, j), touching)
         rows(3, j) = count(touching)
      end do
      sums = row_totals(rows)
      mean = sums(1:2)/max(sums(3), 1.0_dp)
   end function contact_mean

end module contact_model
