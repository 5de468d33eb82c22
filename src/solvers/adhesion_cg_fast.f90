!> The fast method for adhesive contact, on periodic and on free grids.
!>
!> (Modules: adhesion_state has the equations, adhesion_patch what the grids differ in, adhesion_directions
!> the first two parts of an iteration, adhesion_steps the searches along a direction; thesis, 2.3.) The
!> gap, not the pressure, is the unknown, so that the adhesive traction is exact in every residual.
!> Preconditioned, bound-constrained nonlinear conjugate gradients (Polak-Ribiere, never negative). An
!> iteration does
!>
!>     measure      G = P + e'(g);  r = -G where the cell is free: where g > 0, or where G < 0 opens it
!>     direction    z = M r, without closing what is closed;  d = z + beta d
!>     step         s = the step along d, gaps closed on the way;  one product B s;  the part t of it
!>     update       g = g + t s;  P = P + t Q B s
!>
!> * M ~ 1/(|q| + c), as a whole or by its low wave numbers only (module adhesion_preconditioner).
!> * The length of the step is predicted from a coarse estimate of d.B d. The clipped step s is what is
!>   transformed: s.B s is then exact, and so is the energy along s, which never rises. Two transforms an
!>   iteration, beside those of M.
!> * A prescribed mean gap (periodic mode): p is the mean multiplier over g > 0, z has no mean there, and
!>   a shift of the stepped gaps keeps their sum.
!> * A prescribed force in free mode: the level is one more unknown that moves with the mode psi. Its
!>   residual is the force that is `missing`, its part of a direction is a number, `lift`.
!> * Gauss: M is scaled from both sides by (1 + max(e'', 0)/k)^(-1/2), k = 0.02 Q B at the Nyquist wave
!>   number: near contact that potential is stiffer than the solid.
!>
!> The start is part of the problem: the energy has several minima where the attraction is strong, and
!> the one near the start is found. Under a negative prescribed pressure there may be none: once all
!> gaps are so wide that the attraction, which falls with the gap, no longer balances the pull anywhere,
!> the reason is 'detached'.
!>
!> Fields of doubles: H, g, P, and the work fields exchange, residual, direction, old residual; the
!> spectrum of B and with 'full' of M. In free mode the work fields, the spectra and three more fields
!> (state, traction, psi) have 4 times the cells, and the transforms counted are of the doubled grid.
module adhesion_cg_fast
   use adhesion_directions, only : adhesion_iteration_type, adhesion_work_type, find_direction, fresh, &
      measure, updated
   use adhesion_patch, only : is_detached, new_adhesion_patch
   use adhesion_potential, only : stiffens
   use adhesion_preconditioner, only : new_adhesion_preconditioner
   use adhesion_start, only : begin_contact
   use adhesion_symbols, only : adhesion_symbols_type
   use adhesion_state, only : adhesion_method_type, adhesion_problem_type, control_approach, &
      reason_closed, reason_converged, reason_detached, reason_limit, reason_stalled
   use adhesion_steps, only : choose_step, clipped_step, form_step_row, known_of_step, step_sums_type, &
      stepped_gap, sum_shift
   use asperity_errors, only : error_type
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use fft_conv, only : columns_apply
   use omp_lib, only : omp_get_wtime
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_fast_type, new_adhesion_fast

   integer, parameter :: most_updates = 40      !! steps between fresh products with B
   integer, parameter :: most_failures = 3      !! directions in a row that give no step
   real(dp), parameter :: descent = 0.2_dp      !! of the slope along d, what clipping must leave

   !> The solver with its operators and work fields, kept from solve to solve. Not to be copied.
   type, extends(adhesion_method_type) :: adhesion_fast_type
      type(adhesion_work_type), private :: work
      real(dp), allocatable, private :: state(:, :)        !! of the contact, in free mode
      real(dp), allocatable, private :: traction(:, :)     !! the same
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_fast_type

   !> A step: the new gap is t of the way to stepped_gap(g, d, alpha, shift).
   type :: step_type
      real(dp) :: alpha = 0.0_dp
      real(dp) :: shift = 0.0_dp                 !! keeps a prescribed sum of the gap, m
      real(dp) :: part = 0.0_dp                  !! t; 0: there is no step that lowers the energy
   end type step_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_fast(self, grid, kernel, preconditioner, error)
      type(adhesion_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! what the solid is, normal
      character(*), intent(in) :: preconditioner           !! 'coarse' or 'full'
      type(error_type), allocatable, intent(out) :: error
      type(adhesion_symbols_type) :: symbols

      associate (work => self%work)
         call new_adhesion_patch(work%patch, grid, kernel, symbols, error)
         if (allocated(error)) return
         associate (mx => work%patch%mx, rows => work%patch%all_rows)
            call new_adhesion_preconditioner(work%preconditioner, preconditioner, mx, work%patch%sharing, &
               symbols, work%patch%nyquist, error)
            if (allocated(error)) return
            allocate (work%exchange(mx, rows), work%residual(mx, rows), work%direction(mx, rows), &
               work%old(mx, rows), source=0.0_dp)
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
         call self%work%patch%hand_out(now, gap, pressure, level, outcome%load_error)
      end if
      ! A little more, so that a half is not rounded by the round-off of what was counted before.
      outcome%ffts = nint(transforms(self) - transforms_before + 1e-6_dp, int64)
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> Minimise the energy from the start that the contact is at.
   subroutine minimise(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome
      type(step_type) :: step

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
         outcome%iterations = outcome%iterations + 1

         call find_direction(self%work, now)
         call find_step(self, now, step)
         call update(self, now, step)
         if (now%updates == most_updates .or. now%failures == 2) call refresh(self, now)
      end do
      if (outcome%reason /= reason_converged) call take_last_look(self, now, outcome)
      outcome%converged = outcome%reason == reason_converged
   end subroutine minimise

   !> An end without a proof: measure what there is; it may be a solution all the same.
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

   !> The traction by a product with B.
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

   !> The clipped step along d, and how far to go along that step.
   subroutine find_step(self, now, step)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(step_type), intent(out) :: step
      type(step_sums_type) :: known
      real(dp) :: estimate
      integer :: trial

      if (.not. now%slope > 0.0_dp) return
      estimate = now%problem%modulus*now%kappa*self%work%preconditioner%estimate(now%squares)
      associate (nx => self%work%patch%nx, rows => self%work%patch%rows, threads => self%work%patch%threads)
         associate (gap => now%state(1:nx, 1:rows), direction => self%work%direction(1:nx, 1:rows))
            step%alpha = clipped_step(now%problem, gap, direction, -now%slope, estimate, threads)
            do trial = 1, 40
               if (self%work%patch%periodic .and. now%problem%control == control_approach) &
                  step%shift = sum_shift(gap, direction, step%alpha, now%gap_sum, threads)
               call form_step(self, now, step, known)
               if (known%slope <= -descent*step%alpha*now%slope) exit
               step%alpha = 0.25_dp*step%alpha
            end do
            call self%work%patch%stiffness%columns(columns_apply, known%form)
            estimate = self%work%preconditioner%estimate(known%squares)
            if (estimate > 0.0_dp) now%kappa = known%form/estimate
            known%form = now%problem%modulus*known%form
            step%part = choose_step(known, now%problem, gap, direction, step%alpha, step%shift, threads)
         end associate
      end associate
   end subroutine find_step

   !> The clipped step s, and what is known of it before B s; the change of the displacement with it,
   !> transformed along the rows.
   subroutine form_step(self, now, step, known)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      type(step_type), intent(in) :: step
      type(step_sums_type), intent(out) :: known
      type(step_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: change(:)
      integer :: j, n

      allocate (rows(self%work%patch%all_rows))
      !$omp parallel default(none) shared(self, now, step, rows) private(j, n, change) &
      !$omp num_threads(self%work%patch%threads)
      allocate (change(self%work%patch%mx))
      !$omp do
      do j = 1, self%work%patch%all_rows
         n = self%work%patch%inner(j)
         call form_step_row(now%problem, now%state(1:n, j), self%work%direction(1:n, j), &
            self%work%residual(1:n, j), step%alpha, step%shift, change(1:n), rows(j))
         change(1:n) = change(1:n) + step%alpha*now%lift
         change(n + 1:) = step%alpha*self%work%direction(n + 1:, j)
         rows(j)%slope = rows(j)%slope - sum(self%work%residual(n + 1:, j)*change(n + 1:))
         rows(j)%squares = sum(change**2)
         call self%work%patch%stiffness%forward_row(1, j, change)
         call self%work%preconditioner%put_estimate_row(j, change)
      end do
      !$omp end do
      !$omp end parallel
      known = known_of_step(rows, self%work%patch%sharing)
      known%slope = known%slope - now%missing*step%alpha*now%lift
   end subroutine form_step

   !> g = g + t s, u and level with it, and the traction by recurrence; without a step directions start
   !> anew.
   subroutine update(self, now, step)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(step_type), intent(in) :: step
      real(dp) :: next
      integer :: i, j, n

      if (.not. step%part > 0.0_dp) then
         now%failures = now%failures + 1
         now%old_rz = 0.0_dp
         return
      end if
      !$omp parallel do default(none) shared(self, now, step) private(i, j, n, next) &
      !$omp num_threads(self%work%patch%threads)
      do j = 1, self%work%patch%all_rows
         call self%work%patch%stiffness%add_backward_row(1, j, step%part*now%problem%modulus, &
            now%traction(:, j))
         n = self%work%patch%inner(j)
         do i = 1, n
            next = stepped_gap(now%state(i, j), self%work%direction(i, j), step%alpha, step%shift)
            if (step%part /= 1.0_dp) &
               next = max(now%state(i, j) + step%part*(next - now%state(i, j)), 0.0_dp)
            now%state(i, j) = next
         end do
         do i = n + 1, self%work%patch%mx
            now%state(i, j) = now%state(i, j) + step%part*step%alpha*self%work%direction(i, j)
         end do
      end do
      now%level = now%level + step%part*step%alpha*now%lift
      now%failures = 0
      now%source = updated
      now%updates = now%updates + 1
   end subroutine update

   !> Transforms done so far, those of the preconditioner by their share.
   function transforms(self) result(count)
      type(adhesion_fast_type), intent(in) :: self
      real(dp) :: count

      count = real(self%work%patch%transforms(), dp) + self%work%preconditioner%transforms()
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_fast_type), intent(inout) :: self

      call self%work%patch%destroy()
      call self%work%preconditioner%destroy()
      if (allocated(self%work%exchange)) deallocate (self%work%exchange, self%work%residual, &
         self%work%direction, self%work%old)
      if (allocated(self%state)) deallocate (self%state, self%traction)
   end subroutine destroy

end module adhesion_cg_fast
