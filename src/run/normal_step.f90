!> The normal side of a row: it solves the contact under the load of the row, with or without adhesion.
!>
!> With adhesion the result depends on the start, because there is real hysteresis. The first row starts from the
!> solution without adhesion or from full contact, as the case says, and later rows from the state before.
module normal_step
   use adhesion_cg, only : adhesion_solver_type, new_adhesion_solver
   use adhesion_potential, only : adhesion_potential_type, adhesive_energy, &
      new_adhesion_potential
   use adhesion_state, only : adhesion_problem_type
   use case_settings, only : adhesion_settings_type, solver_settings_type
   use asperity_errors, only : error_type
   use contact_solver, only : contact_solver_type
   use field_sums, only : field_maximum, field_mean, field_rms, row_total
   use kernels, only : kernel_type
   use normal_solvers, only : new_contact_solver
   use normal_state, only : control_approach, control_pressure, normal_problem_type
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: new_normal_step, normal_step_type, normal_task_type

   !> Tolerance (of the duality gap) for the contact without adhesion if it is only the start of the contact with
   !> adhesion.
   real(dp), parameter :: start_tolerance = 1e-2_dp

   !> The load of a row and the modulus of its step.
   type :: normal_task_type
      character(12) :: control = 'pressure'        !! 'pressure' | 'force' | 'displacement'
      real(dp) :: load = 0.0_dp                    !! Pa, N or m
      real(dp) :: modulus = 0.0_dp                 !! Q, Pa
      logical :: first = .false.                   !! there is no state yet
      !> Without adhesion: the given gap holds the displacement U under the given pressure, m.
      logical :: displaced = .false.
   end type normal_task_type

   !> Solvers and settings of the normal side. A variable of this type must not be copied.
   type :: normal_step_type
      type(grid_type) :: grid
      logical :: adhesive = .false.
      real(dp) :: summit = 0.0_dp                  !! highest point of the original map, m
      real(dp) :: rms_height = 0.0_dp              !! of the original map about its mean, m
      class(contact_solver_type), allocatable, private :: plain   !! solves the contact without adhesion
      type(adhesion_potential_type) :: potential
      type(adhesion_solver_type), private :: adhesion
      logical, private :: full_contact = .false.
      real(dp) :: tolerance = 1e-6_dp              !! of the next solve; that of the case always suffices
      real(dp), private :: accepted = 1e-6_dp      !! that of the case
      integer, private :: max_iterations = 1000
   contains
      procedure :: solve
      procedure :: energy
      procedure :: destroy
   end type normal_step_type

contains

   !> Prepare the solvers.
   subroutine new_normal_step(self, grid, kernel, solver, adhesion, edge, height, error)
      type(normal_step_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel           !! normal response of the solid
      type(solver_settings_type), intent(in) :: solver
      type(adhesion_settings_type), intent(in) :: adhesion
      real(dp), intent(in) :: edge                      !! width of a rounded jump of the attraction, m
      real(dp), contiguous, intent(in) :: height(:, :)   !! the original map, m
      type(error_type), allocatable, intent(out) :: error

      self%grid = grid
      self%tolerance = solver%tolerance
      self%accepted = solver%tolerance
      self%max_iterations = solver%max_iterations
      self%adhesive = adhesion%potential /= 'none'
      self%summit = field_maximum(height)
      call new_contact_solver(self%plain, trim(solver%method), self%grid, kernel, error, &
         mixed=solver%precision == 'mixed')
      if (allocated(error)) return
      self%rms_height = field_rms(height, field_mean(height))
      if (.not. self%adhesive) return
      self%full_contact = adhesion%start == 'full_contact'
      call new_adhesion_potential(self%potential, trim(adhesion%potential), adhesion%energy, &
         adhesion%range, error, edge=edge)
      if (allocated(error)) return
      call new_adhesion_solver(self%adhesion, self%grid, kernel, error, trim(solver%method))
   end subroutine new_normal_step

   !> Solve under the load of the row, starting from the given pressure and gap.
   subroutine solve(self, task, height, pressure, gap, level, outcome, past)
      class(normal_step_type), intent(inout) :: self
      type(normal_task_type), intent(in) :: task
      real(dp), contiguous, intent(in) :: height(:, :)   !! H under the rubber, m
      real(dp), contiguous, intent(inout) :: pressure(:, :)        !! Pa
      real(dp), contiguous, intent(inout) :: gap(:, :)   !! m
      real(dp), intent(inout) :: level                 !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: past(:, :)     !! P_h, traction of the past, Pa
      type(adhesion_problem_type) :: problem
      type(solver_result_type) :: before
      integer :: j

      if (.not. self%adhesive) then
         call solve_without_adhesion(self, task, height, pressure, gap, level, outcome, past)
         return
      end if
      if (task%first .and. self%full_contact) then
         !$omp parallel do default(none) shared(self, gap) private(j)
         do j = 1, self%grid%rows()
            gap(:, j) = 0.0_dp
         end do
      else if (task%first) then
         call start(self, task, height, pressure, gap, level, before, past)
         if (before%stopped) then
            outcome = before
            return
         end if
      end if
      problem%potential = self%potential
      problem%modulus = task%modulus
      problem%tolerance = self%tolerance
      problem%accepted = self%accepted
      problem%max_iterations = self%max_iterations
      problem%full_contact = task%first .and. self%full_contact
      call load_of(self, task, problem%control, problem%target)
      call self%adhesion%solve(problem, height, gap, pressure, level, outcome, past)
      outcome%iterations = outcome%iterations + before%iterations
      outcome%ffts = outcome%ffts + before%ffts
   end subroutine solve

   !> Convert the load of a row to a form that the solvers accept: the mean pressure, or the level.
   subroutine load_of(self, task, control, target)
      type(normal_step_type), intent(in) :: self
      type(normal_task_type), intent(in) :: task
      integer, intent(out) :: control
      real(dp), intent(out) :: target

      control = control_pressure
      target = task%load
      if (task%control == 'force') target = task%load/self%grid%area()
      if (task%control == 'displacement') then
         control = control_approach
         target = task%load - self%summit
      end if
   end subroutine load_of

   !> Find a start for the first row with adhesion: roughly the solution without adhesion, or the first touch if the
   !> load does not press.
   subroutine start(self, task, height, pressure, gap, level, outcome, past)
      type(normal_step_type), intent(inout) :: self
      type(normal_task_type), intent(in) :: task
      real(dp), contiguous, intent(in) :: height(:, :)
      real(dp), contiguous, intent(inout) :: pressure(:, :), gap(:, :)
      real(dp), intent(inout) :: level
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: past(:, :)
      type(normal_task_type) :: touch
      logical :: presses
      integer :: j

      touch = task
      presses = task%control == 'displacement' .or. task%load > 0.0_dp
      if (.not. presses) then
         touch%control = 'displacement'
         touch%load = 0.0_dp
      end if
      if (presses .or. present(past)) then
         call solve_without_adhesion(self, touch, height, pressure, gap, level, outcome, past)
         if (outcome%stopped) return
      else
         level = -self%summit
      end if
      !$omp parallel do default(none) shared(self, presses, height, past, pressure, gap, level) private(j)
      do j = 1, self%grid%rows()
         if (.not. (presses .or. present(past))) then
            pressure(:, j) = 0.0_dp
            gap(:, j) = -level - height(:, j)
         end if
         gap(:, j) = max(gap(:, j), 0.0_dp)
      end do
   end subroutine start

   !> Solve the contact without adhesion, but only roughly if the contact with adhesion follows.
   subroutine solve_without_adhesion(self, task, height, pressure, gap, level, outcome, past)
      type(normal_step_type), intent(inout) :: self
      type(normal_task_type), intent(in) :: task
      real(dp), contiguous, intent(in) :: height(:, :)
      real(dp), contiguous, intent(inout) :: pressure(:, :), gap(:, :)
      real(dp), intent(out) :: level
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: past(:, :)
      type(normal_problem_type) :: problem

      problem%modulus = task%modulus
      problem%tolerance = self%tolerance
      problem%accepted = self%accepted
      if (self%adhesive) problem%tolerance = max(self%tolerance, start_tolerance)
      problem%max_iterations = self%max_iterations
      problem%rms_height = self%rms_height
      problem%warm = .not. task%first
      problem%displaced = task%displaced
      call load_of(self, task, problem%control, problem%target)
      call self%plain%solve(problem, height, pressure, gap, level, outcome, past)
   end subroutine solve_without_adhesion

   !> Energy of adhesion of a gap over the whole cell, J.
   function energy(self, gap) result(total)
      class(normal_step_type), intent(in) :: self
      real(dp), contiguous, intent(in) :: gap(:, :)   !! m
      real(dp) :: total
      real(dp), allocatable :: rows(:)
      integer :: j

      total = 0.0_dp
      if (.not. self%adhesive) return
      allocate (rows(self%grid%rows()))
      !$omp parallel do default(none) shared(self, gap, rows) private(j)
      do j = 1, self%grid%rows()
         rows(j) = sum(adhesive_energy(self%potential, gap(:, j)))
      end do
      total = row_total(rows)*self%grid%cell_area()
   end function energy

   !> Free plans and memory.
   subroutine destroy(self)
      class(normal_step_type), intent(inout) :: self

      if (allocated(self%plain)) call self%plain%destroy()
      if (self%adhesive) call self%adhesion%destroy()
   end subroutine destroy

end module normal_step
