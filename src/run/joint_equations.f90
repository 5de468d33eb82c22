!> The equations of a step with friction for all cells at once (module `joint_system`).
!>
!> With the road H read at the displacement that T causes, the equations are
!>
!>     U_z - H - level = gap            of every cell, U_z = A_z (P + P_h)/Q
!>     T = bound(T + r/a)               of every cell that is not open: r is the slip, a the tangential compliance of a
!>                                      cell, and bound(w) = w within the bound, otherwise w returned to it; T = 0 in
!>                                      open cells
!>     mean of P = load                 or the level is given
!>
!> On a path of solutions (module `joint_path`) the road is read between an origin and the displacement that T causes; the
!> part of the state is the position between the two. The slip always follows the whole displacement. At part 0 the road
!> is read at the origin, as in a pass at this place, and the result of that pass is the solution.
!>
!> An evaluation takes six transforms.
module joint_equations
   use adhesion_potential, only : adhesive_slope
   use asperity_errors, only : error_type
   use asperity_interpolation, only : displaced
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use fft_conv, only : columns_apply, convolution_type, new_convolution
   use friction_law, only : contact_open, contact_slip, contact_stick
   use joint_system, only : joint_state_type, joint_system_type
   use joint_tiles, only : cell_responses_type, even, near_values, odd
   use regular_grid, only : boundary_periodic
   use rubber_kernels, only : normal_kernel
   implicit none
   private

   public :: joint_equations_type

   !> Evaluations of the equations in an attempt, of six transforms each. They bound the work of a step that
   !> cannot be solved. Attempts that succeed rarely take a tenth of them.
   integer, parameter :: most_evaluations = 10000

   !> The equations and their work space. A variable of this type must not be copied.
   type, extends(joint_system_type) :: joint_equations_type
      logical :: ready = .false.
      class(contact_type), pointer, private :: contact => null()   !! of the step that is being solved
      type(planned_row_type), private :: plan
      real(dp), private :: compliance = 0.0_dp         !! of a cell under its own unit pressure, G = 1, m/Pa
      type(convolution_type), private :: operator      !! A_z, G = 1
      real(dp), private :: part = 1.0_dp               !! of the last state that was evaluated
      type(cell_responses_type), private :: whole      !! displacements around a loaded cell, at part 1
      real(dp), allocatable, private :: origin(:, :, :)       !! of a path, m [nx, 2, rows]
      real(dp), allocatable, private :: place(:, :, :) !! where the road is read on a path, m [nx, 2, rows]
      real(dp), allocatable, private :: pressure(:, :), height(:, :), slope_x(:, :), slope_y(:, :)
   contains
      procedure :: prepare
      procedure :: start
      procedure :: set_origin
      procedure :: evaluate
      procedure :: slopes_at
      procedure :: slip_of
      procedure :: return_solution
      procedure :: destroy
   end type joint_equations_type

contains

   !> Make the operator and the work space. If there is not enough memory, or only one cell, `ready` remains
   !> .false.
   subroutine prepare(self, contact)
      class(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(in) :: contact
      type(error_type), allocatable :: error
      integer :: nx, ny, status(5)

      call new_convolution(self%operator, contact%grid, normal_kernel(contact%case%material), error)
      if (allocated(error)) return
      nx = contact%grid%nx
      ny = contact%grid%rows()
      allocate (self%width(nx, ny), source=0.0_dp, stat=status(1))
      allocate (self%pressure(nx, ny), source=0.0_dp, stat=status(2))
      allocate (self%height(nx, ny), source=0.0_dp, stat=status(3))
      allocate (self%slope_x(nx, ny), source=0.0_dp, stat=status(4))
      allocate (self%slope_y(nx, ny), source=0.0_dp, stat=status(5))
      self%compliance = self%operator%symbols%self_compliance( &
         with_mean=contact%grid%boundary /= boundary_periodic)
      self%ready = self%compliance > 0.0_dp .and. .not. any_process(any(status /= 0))
      if (.not. self%ready) call destroy(self)
   end subroutine prepare

   !> Set the rules and the units, and make the first state from that of the contact.
   subroutine start(self, contact, plan, begun, done)
      class(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(inout), target :: contact      !! until the step is solved
      type(planned_row_type), intent(in) :: plan
      type(joint_state_type), intent(inout) :: begun
      logical, intent(out) :: done                     !! .false.: there is not enough memory

      self%contact => contact
      self%plan = plan
      self%grid = contact%grid
      call find_responses(self, contact, done)
      if (.not. done) return
      self%evaluations = 2                             ! the responses take almost as many transforms
      self%level_is_given = plan%control == 'displacement'
      self%most_evaluations = most_evaluations
      associate (rules => self%rules, state => contact%state)
         rules%potential = contact%normal%potential
         rules%law = contact%tangential%law
         rules%attraction = 0.0_dp
         if (contact%normal%adhesive) rules%attraction = adhesive_slope(rules%potential, 0.0_dp)
         rules%soft = self%compliance/contact%material%q
         rules%soft_along = contact%tangential%cell_compliance()
         call self%begin(state%tangential%contact /= contact_open, state%pressure, state%gap, &
            state%tangential%traction, rules%has_jump(contact%slope_x, contact%slope_y), contact%rms_slope, begun)
         begun%level = state%level
      end associate
   end subroutine start

   !> Find the displacements around a cell under its unit pressure and its unit tractions: ten transforms. `done` is
   !> .false. if there is not enough memory.
   subroutine find_responses(self, contact, done)
      type(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      logical, intent(out) :: done
      real(dp), allocatable :: load(:, :), u(:, :), traction(:, :, :), shear(:, :, :)
      integer :: c, k, nx, ny, status(4)

      nx = self%grid%nx
      ny = self%grid%rows()
      allocate (load(nx, ny), source=0.0_dp, stat=status(1))
      allocate (u(nx, ny), source=0.0_dp, stat=status(2))
      allocate (traction(nx, ny, 2), source=0.0_dp, stat=status(3))
      allocate (shear(nx, ny, 2), source=0.0_dp, stat=status(4))
      done = .not. any_process(any(status /= 0))
      if (.not. done) return
      if (self%grid%first_row == 1 .and. ny > 0) load(1, 1) = 1.0_dp
      call self%operator%apply(load, u)
      self%near%depth = near_values(self%grid, u, even)/contact%material%q
      do c = 1, 2
         traction = 0.0_dp
         traction(:, :, c) = load
         call contact%tangential%respond(traction, shear)
         do k = 1, 2
            self%near%place(k, c, :, :) = near_values(self%grid, shear(:, :, k), merge(even, odd, k == c))
         end do
      end do
      ! The slip is that of the road over the rubber.
      self%near%slip = -self%near%place
      self%whole = self%near
      self%part = 1.0_dp
   end subroutine find_responses

   !> Set the origin of a path. `done` is .false. if there is not enough memory.
   subroutine set_origin(self, origin, done)
      class(joint_equations_type), intent(inout) :: self
      real(dp), intent(in) :: origin(:, :, :)          !! m [nx, 2 or 3, rows]; of these the first two
      logical, intent(out) :: done
      integer :: status(2)

      status = 0
      if (.not. allocated(self%place)) &
         allocate (self%place(self%grid%nx, 2, self%grid%rows()), source=0.0_dp, stat=status(1))
      if (.not. allocated(self%origin)) &
         allocate (self%origin(self%grid%nx, 2, self%grid%rows()), source=0.0_dp, stat=status(2))
      done = .not. any_process(any(status /= 0))
      if (.not. done) return
      self%origin(:, :, :) = origin(:, :2, :)
   end subroutine set_origin

   !> Read the slopes of the road near the displaced cells.
   subroutine slopes_at(self, shift, height, slope_x, slope_y)
      class(joint_equations_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)
      real(dp), intent(out) :: height(:, :), slope_x(:, :), slope_y(:, :)
      real(dp) :: place(2)

      place = self%plan%road - shift
      call read_road(self, place, height, slope_x, slope_y)
   end subroutine slopes_at

   !> Read the road, displaced by `base`, where the rubber's surface of the last state touches it.
   subroutine read_road(self, base, height, slope_x, slope_y)
      class(joint_equations_type), intent(inout) :: self
      real(dp), intent(in) :: base(2)                  !! m
      real(dp), intent(out) :: height(:, :), slope_x(:, :), slope_y(:, :)

      associate (trial => self%contact%tangential%trial)
         if (abs(self%part - 1.0_dp) > 0.0_dp) then
            self%place(:, :, :) = self%origin + self%part*(trial - self%origin)
            call displaced(self%contact%road, base(1), base(2), self%place(:, 1, :), self%place(:, 2, :), &
               height, slope_x, slope_y)
         else
            call displaced(self%contact%road, base(1), base(2), trial(:, 1, :), trial(:, 2, :), height, slope_x, slope_y)
         end if
      end associate
   end subroutine read_road

   !> Set the part of the way from the origin at which the road is read.
   subroutine set_part(self, part)
      class(joint_equations_type), intent(inout) :: self
      real(dp), intent(in) :: part

      self%part = part
      self%near%place = part*self%whole%place
   end subroutine set_part

   !> The slip of a cell.
   pure function slip_of(self, i, j) result(slip)
      class(joint_equations_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: slip(2)

      slip = self%contact%tangential%slip(i, :, j)
   end function slip_of

   !> Compute the residuals of a state.
   subroutine evaluate(self, state)
      class(joint_equations_type), intent(inout) :: self
      type(joint_state_type), intent(inout) :: state
      integer :: j

      self%evaluations = self%evaluations + 1
      associate (contact => self%contact, plan => self%plan)
         call form_pressure(self, contact, state%s)
         call contact%tangential%try(contact%state%tangential, state%t)
         call set_part(self, state%part)
         call read_road(self, plan%road, self%height, self%slope_x, self%slope_y)
         !$omp parallel do default(none) shared(self, state) private(j) num_threads(self%operator%threads)
         do j = 1, self%grid%rows()
            call evaluate_row(self, self%contact, state, j)
         end do
         select case (plan%control)
         case ('displacement')
            call self%sum_residuals(state, self%pressure, 0.0_dp, level=plan%load - contact%summit)
         case ('force')
            call self%sum_residuals(state, self%pressure, plan%load/contact%grid%area())
         case default
            call self%sum_residuals(state, self%pressure, plan%load)
         end select
      end associate
   end subroutine evaluate

   !> Compute P of a state, and the transforms of its displacement.
   subroutine form_pressure(self, contact, s)
      class(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(in) :: contact
      real(dp), intent(in) :: s(:, :)                  !! m
      integer :: j

      !$omp parallel do default(none) shared(self, contact, s) private(j) num_threads(self%operator%threads)
      do j = 1, contact%grid%rows()
         self%pressure(:, j) = self%rules%pressure_of(self%width(:, j), s(:, j))
         if (allocated(contact%past)) then
            call self%operator%forward_row(1, j, self%pressure(:, j) + contact%past(:, j))
         else
            call self%operator%forward_row(1, j, self%pressure(:, j))
         end if
      end do
      call self%operator%columns(columns_apply)
   end subroutine form_pressure

   !> Compute a row of the residuals.
   subroutine evaluate_row(self, contact, state, j)
      class(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(in) :: contact
      type(joint_state_type), intent(inout) :: state
      integer, intent(in) :: j
      real(dp) :: u(size(state%s, 1))
      integer :: i

      call self%operator%backward_row(1, j, u)
      do i = 1, size(u)
         call self%cell_residual(state, i, j, u(i)/contact%material%q - self%height(i, j), self%pressure(i, j), &
            [self%slope_x(i, j), self%slope_y(i, j)], contact%tangential%slip(i, :, j))
      end do
   end subroutine evaluate_row

   !> Copy the solution to the contact, if there is memory for the shares of the cells.
   subroutine return_solution(self, contact, found, done)
      class(joint_equations_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      type(joint_state_type), intent(inout) :: found
      logical, intent(out) :: done
      real(dp) :: slope(2)
      integer :: i, j, status

      status = 0
      if (.not. allocated(contact%tangential%share)) &
         allocate (contact%tangential%share(contact%grid%nx, contact%grid%rows()), stat=status)
      done = .not. any_process(status /= 0)
      if (.not. done) then
         if (allocated(contact%tangential%share)) deallocate (contact%tangential%share)
         return
      end if
      call evaluate(self, found)
      slope = 0.0_dp
      associate (state => contact%state, tangential => contact%state%tangential)
         state%pressure(:, :) = self%pressure
         state%gap(:, :) = self%rules%gap_of(found%s)
         state%level = found%level
         tangential%traction(:, :, :) = found%t
         contact%tangential%share(:, :) = self%rules%share_of(self%width, found%s)
         ! Other laws have no shares: the last pass proves that a cell that touches without pressure obeys the whole law.
         if (.not. self%rules%law%jumps_at_edge()) &
            contact%tangential%share(:, :) = merge(1.0_dp, 0.0_dp, contact%tangential%share > 0.0_dp)
         do j = 1, contact%grid%rows()
            do i = 1, contact%grid%nx
               if (self%rules%law%slope_effect) slope = [self%slope_x(i, j), self%slope_y(i, j)]
               tangential%contact(i, j) = contact_open
               if (contact%tangential%share(i, j) > 0.0_dp) tangential%contact(i, j) = merge(contact_slip, contact_stick, &
                  self%rules%slips(contact%tangential%share(i, j), self%pressure(i, j), slope, found%t(i, :, j)))
            end do
         end do
      end associate
   end subroutine return_solution

   !> Free the operator.
   subroutine destroy(self)
      class(joint_equations_type), intent(inout) :: self

      call self%operator%destroy()
      if (allocated(self%width)) deallocate (self%width)
      if (allocated(self%pressure)) deallocate (self%pressure)
      if (allocated(self%height)) deallocate (self%height)
      if (allocated(self%slope_x)) deallocate (self%slope_x)
      if (allocated(self%slope_y)) deallocate (self%slope_y)
      if (allocated(self%origin)) deallocate (self%origin)
      if (allocated(self%place)) deallocate (self%place)
      self%ready = .false.
   end subroutine destroy

end module joint_equations
