!> The fast method for adhesive contact, on periodic and on free grids.
!>
!> (Modules: adhesion_state has the equations, adhesion_patch what the grids differ in, adhesion_work the fields,
!> adhesion_residual the residual, adhesion_descent the step in the model, adhesion_directions the iterations in
!> it, adhesion_plane what the step before adds to it, adhesion_steps how far to go; thesis, 2.3.) The gap, not
!> the pressure, is the unknown, so that the adhesive traction is exact in every residual. An iteration does
!>
!>     measure            G = P + e'(g);  r = -G where the cell is free: where g > 0, or where G < 0 opens it
!>     approach_minimum   the step s to about a minimum of the energy with a local model B_h in place of B
!>     widen_step         s with the right share of the step before (module adhesion_plane)
!>     find_part          one product B s; the part t of the step
!>     update             g = g + t s;  P = P + t Q B s
!>
!> * s.B s is exact, and so is the energy along s, which never rises. Two transforms an iteration, beside
!>   those of the model on a grid of an eighth of the cells each way.
!> * B_h is between 0.8 and 1.3 times B (square cells), so that a step leaves about a quarter of the residual.
!> * A prescribed mean gap (periodic mode): p is the mean multiplier over g > 0, directions have no mean
!>   there, and a shift of the stepped gaps keeps their sum.
!> * A prescribed force in free mode: the level is an additional unknown, which moves with the mode psi. Its
!>   residual is the `missing` force, and its part of a step is the number `lift`.
!> * Gauss: the preconditioner in the model is scaled from both sides by (1 + max(e'', 0)/k)^(-1/2), k = 0.02
!>   Q B at the Nyquist wave number: near contact that potential is stiffer than the solid.
!>
!> The start is part of the problem: the energy has several minima where the attraction is strong, and
!> the one near the start is found. Under a negative prescribed pressure there may be none: once all
!> gaps are so wide that the attraction, which falls with the gap, no longer balances the pull anywhere,
!> the reason is 'detached'.
!>
!> Fields of doubles: H, g, P, and the work fields exchange, residual, direction, old residual, change,
!> image, the step before and its product, curvature, state and traction of the model; the spectrum of B.
!> In free mode the work fields (but the curvature), the spectrum and three more fields (state, traction,
!> psi) have 4 times the cells, and the transforms counted are of the doubled grid.
module adhesion_cg_fast
   use adhesion_descent, only : approach_minimum
   use adhesion_model, only : new_adhesion_model
   use adhesion_patch, only : is_detached, new_adhesion_patch
   use adhesion_plane, only : keep_step, stretch_step, widen_step
   use adhesion_potential, only : stiffens
   use adhesion_residual, only : measure
   use adhesion_start, only : begin_contact
   use adhesion_symbols, only : adhesion_symbols_type
   use adhesion_state, only : adhesion_method_type, adhesion_problem_type, control_approach, &
      reason_closed, reason_converged, reason_detached, reason_limit, reason_stalled
   use adhesion_steps, only : choose_step, form_step_row, known_of_step, step_sums_type
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type, fresh, updated
   use asperity_errors, only : error_type
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use fft_conv, only : columns_apply
   use omp_lib, only : omp_get_wtime
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: adhesion_fast_type, new_adhesion_fast

   integer, parameter :: most_updates = 40      !! steps between new products with B
   integer, parameter :: most_failures = 8      !! successive directions without a step
   real(dp), parameter :: short = 0.01_dp       !! part of a step below which the model was wrong

   !> The solver with its operators and work fields, kept from solve to solve. A variable of this type must not be
   !> copied.
   type, extends(adhesion_method_type) :: adhesion_fast_type
      type(adhesion_work_type), private :: work
      real(dp), allocatable, private :: state(:, :)        !! of the contact, in free mode
      real(dp), allocatable, private :: traction(:, :)     !! the same
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_fast_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_fast(self, grid, kernel, error)
      type(adhesion_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! what the solid is, normal
      type(error_type), allocatable, intent(out) :: error
      type(adhesion_symbols_type) :: symbols

      associate (work => self%work)
         call new_adhesion_patch(work%patch, grid, kernel, symbols, error)
         if (allocated(error)) return
         associate (mx => work%patch%mx, rows => work%patch%all_rows)
            call new_adhesion_model(work%model, mx, work%patch%sharing, symbols, work%patch%stiffness%modes(), &
               work%patch%nyquist, error)
            if (allocated(error)) return
            allocate (work%exchange(mx, rows), work%residual(mx, rows), work%direction(mx, rows), &
               work%old(mx, rows), work%model_state(mx, rows), work%model_traction(mx, rows), &
               work%change(mx, rows + work%model%halo%foreign), work%image(mx, rows), &
               work%last_step(mx, rows), work%last_image(mx, rows), &
               work%curvature(work%patch%nx, work%patch%rows), source=0.0_dp)
            allocate (work%bumpy(rows + work%model%halo%foreign), source=.true.)
            if (.not. work%patch%periodic) &
               allocate (self%state(mx, rows), self%traction(mx, rows), source=0.0_dp)
         end associate
      end associate
   end subroutine new_adhesion_fast

   !> Solve an adhesive contact problem, as `adhesion_method_type` says.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, past)
      class(adhesion_fast_type), intent(inout), target :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous, target :: height(:, :)
      real(dp), intent(inout), contiguous, target :: gap(:, :)
      real(dp), intent(inout), contiguous, target :: pressure(:, :)
      real(dp), intent(inout) :: level
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), target, optional :: past(:, :)
      type(adhesion_iteration_type) :: now
      real(dp) :: transforms_before

      outcome%seconds = omp_get_wtime()
      transforms_before = transforms(self)
      now%problem = problem
      now%height => height
      if (present(past)) now%past => past
      now%level = level
      if (problem%control == control_approach) now%level = problem%target
      if (self%work%patch%periodic) then
         now%state => gap
         now%traction => pressure
      else
         now%state => self%state
         now%traction => self%traction
      end if
      if (self%work%patch%is_closed_up(problem, height)) then
         outcome%reason = reason_closed
         level = problem%target
      else
         call begin_contact(self%work%patch, now, gap, pressure)
         call minimise(self, now, outcome)
         if (outcome%stopped) return
         call self%work%patch%hand_out(now, gap, pressure, level, outcome%load_error)
      end if
      ! A little more, so that a half is not rounded by the round-off of what was counted before.
      outcome%ffts = nint(transforms(self) - transforms_before + 1e-6_dp, int64)
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> Minimise the energy, starting from the present state of the contact.
   subroutine minimise(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome
      real(dp) :: form, part, stretch

      self%work%scaling = 0.0_dp
      if (stiffens(now%problem%potential)) &
         self%work%scaling = 0.02_dp*now%problem%modulus*self%work%patch%nyquist
      self%work%direction = 0.0_dp
      self%work%residual = 0.0_dp
      now%limit = now%problem%tolerance
      outcome%reason = reason_limit
      do
         call measure(self%work, now)
         if (now%residual <= now%limit) then
            if (now%source /= fresh) then
               call refresh(self, now)
               cycle
            end if
            outcome%residual = proven_residual(self, now)
            if (outcome%residual <= now%problem%tolerance) outcome%reason = reason_converged
            if (outcome%reason == reason_converged) exit
            now%limit = 0.3_dp*now%limit
         end if
         if (is_detached(self%work%patch, now, now%least)) outcome%reason = reason_detached
         if (now%failures > most_failures) outcome%reason = reason_stalled
         if (outcome%reason /= reason_limit .or. outcome%iterations >= now%problem%max_iterations) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return
         outcome%iterations = outcome%iterations + 1

         call approach_minimum(self%work, now)
         call find_part(self, now, part, form, stretch)
         call update(self, now, part, form, stretch)
         if (now%updates == most_updates .or. now%failures == 2) call refresh(self, now)
      end do
      if (outcome%reason /= reason_converged) call take_last_look(self, now, outcome)
      outcome%converged = outcome%reason == reason_converged
   end subroutine minimise

   !> Measure the last state if the loop has ended without a proof. It may be a solution nevertheless.
   subroutine take_last_look(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome

      if (now%source /= fresh) then
         call refresh(self, now)
         call measure(self%work, now)
      end if
      outcome%residual = proven_residual(self, now)
      if (outcome%reason /= reason_detached .and. outcome%residual <= now%problem%tolerance) &
         outcome%reason = reason_converged
   end subroutine take_last_look

   !> Compute the traction by a product with B.
   subroutine refresh(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now

      call self%work%patch%evaluate_traction(now)
      now%source = fresh
      now%updates = 0
   end subroutine refresh

   !> The residual that proves a solution, from a fresh traction.
   function proven_residual(self, now) result(residual)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp) :: residual

      residual = now%residual
      if (.not. self%work%patch%periodic) residual = self%work%patch%true_residual(now)
   end function proven_residual

   !> Find the part t of the step that is taken, after one product with B.
   subroutine find_part(self, now, part, form, stretch)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), intent(out) :: part              !! 0: no part of the step lowers the energy
      real(dp), intent(out) :: form              !! Q s.B s
      real(dp), intent(out) :: stretch           !! of the step since its product was formed
      type(step_sums_type) :: known

      call widen_step(self%work, now)
      call form_step(self, now, known)
      stretch = 1.0_dp
      form = 0.0_dp
      part = 0.0_dp
      if (.not. known%slope < 0.0_dp) return
      call self%work%patch%stiffness%columns(columns_apply, known%form)
      known%form = now%problem%modulus*known%form
      call stretch_step(self%work, now, known, stretch)
      associate (nx => self%work%patch%nx, rows => self%work%patch%rows, threads => self%work%patch%threads)
         part = choose_step(known, now%problem, now%state(1:nx, 1:rows), self%work%direction(1:nx, 1:rows), &
            threads)
      end associate
      form = known%form
   end subroutine find_part

   !> What is known of the step before B s; the change of the displacement with it, transformed along the
   !> rows.
   subroutine form_step(self, now, known)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      type(step_sums_type), intent(out) :: known
      type(step_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: change(:)
      integer :: j, n

      allocate (rows(self%work%patch%all_rows))
      !$omp parallel default(none) shared(self, now, rows) private(j, n, change) &
      !$omp num_threads(self%work%patch%threads)
      allocate (change(self%work%patch%mx))
      !$omp do
      do j = 1, self%work%patch%all_rows
         n = self%work%patch%inner(j)
         change(:) = self%work%direction(:, j)
         call form_step_row(now%problem, now%state(1:n, j), now%traction(1:n, j) + now%load, &
            change(1:n), rows(j))
         change(1:n) = change(1:n) + now%lift
         rows(j)%slope = rows(j)%slope + sum(now%traction(1:n, j))*now%lift &
            + sum(now%traction(n + 1:, j)*change(n + 1:))
         call self%work%patch%stiffness%forward_row(1, j, change)
      end do
      !$omp end do
      !$omp end parallel
      known = known_of_step(rows, self%work%patch%sharing)
      known%slope = known%slope - now%force*now%lift
   end subroutine form_step

   !> Update g = g + t s, u and the level, and the traction by recurrence.
   subroutine update(self, now, part, form, stretch)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), intent(in) :: part
      real(dp), intent(in) :: form               !! Q s.B s
      real(dp), intent(in) :: stretch            !! of the step since its product was formed
      integer :: j, n

      if (.not. part > 0.0_dp) then
         now%failures = now%failures + 1
         now%caution = now%caution + 1
         now%has_last = .false.
         return
      end if
      !$omp parallel do default(none) shared(self, now, part, stretch) private(j, n) &
      !$omp num_threads(self%work%patch%threads)
      do j = 1, self%work%patch%all_rows
         call self%work%patch%stiffness%backward_row(1, j, self%work%image(:, j))
         self%work%image(:, j) = stretch*self%work%image(:, j)
         now%traction(:, j) = now%traction(:, j) + part*now%problem%modulus*self%work%image(:, j)
         n = self%work%patch%inner(j)
         now%state(:, j) = now%state(:, j) + part*self%work%direction(:, j)
         now%state(1:n, j) = max(now%state(1:n, j), 0.0_dp)
      end do
      now%level = now%level + part*now%lift
      call keep_step(self%work, now, form)
      now%failures = 0
      now%caution = merge(now%caution + 1, max(now%caution - 1, 0), part < short)
      now%source = updated
      now%updates = now%updates + 1
   end subroutine update

   !> Transforms done so far, those of the model by their share.
   function transforms(self) result(count)
      type(adhesion_fast_type), intent(in) :: self
      real(dp) :: count

      count = real(self%work%patch%transforms(), dp) + self%work%model%transforms()
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_fast_type), intent(inout) :: self

      call self%work%patch%destroy()
      call self%work%model%destroy()
      if (allocated(self%work%exchange)) deallocate (self%work%exchange, self%work%residual, &
         self%work%direction, self%work%old, self%work%model_state, self%work%model_traction, &
         self%work%change, self%work%bumpy, self%work%image, self%work%last_step, &
         self%work%last_image, self%work%curvature)
      if (allocated(self%state)) deallocate (self%state, self%traction)
   end subroutine destroy

end module adhesion_cg_fast
