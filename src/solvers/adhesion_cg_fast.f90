!> The fast method for adhesive contact, on periodic and on free grids.
!>
!> The problem is that of section 2.3 of the thesis; its equations are in module `adhesion_state`. The gap g, not the
!> pressure P, is the unknown, so that the adhesive traction e'(g) is exact in every residual. B is the stiffness of the
!> solid for a shear modulus of 1, and Q the modulus of the time step. An iteration consists of
!>
!>     measure            G = P + e'(g);  r = -G in the free cells: those with g > 0, and those that G < 0 opens
!>     approach_minimum   the step s towards a minimum of the energy with a local model B_h in place of B
!>     make_conjugate     s = s + b d, conjugate to the step d before it
!>     find_part          the part t of the step that is taken, after one product B s
!>     update             g = g + t s;  P = P + t Q B s
!>
!> (modules `adhesion_residual`, `adhesion_descent`, `adhesion_plane` and `adhesion_steps`).
!>
!> * `approach_minimum` also relaxes the spots that are farthest from equilibrium (module `adhesion_spots`).
!> * The product B s is exact, and so is the energy along s. The energy never rises. An iteration takes two transforms,
!>   and those of the model, on a grid with an eighth of the cells in each direction.
!> * For square cells, B_h is between 0.8 and 1.3 times B. A step therefore leaves about a quarter of the residual.
!> * If the mean gap is prescribed (periodic mode), the load p is the number for which G has no mean over the open
!>   cells, directions have no mean there, and the gaps after a step are shifted so that their sum does not change.
!> * If the force is prescribed in free mode, the level is an additional unknown, which moves with the mode psi (module
!>   `adhesion_patch`). Its residual is the `missing` force, and its part of a step is the number `lift`.
!> * Near contact the Gauss potential is stiffer than the solid. The preconditioner in the model is therefore scaled
!>   from both sides by (1 + max(e'', 0)/k)^(-1/2), where k is 0.02 Q B at the Nyquist wave number (see `choose_scaling`).
!>
!> If the attraction is strong, the energy has several minima, and the solver finds the one near the start. The start is
!> therefore part of the problem. Under a negative prescribed pressure there may be no minimum: if all gaps are so wide
!> that the attraction, which decreases with the gap, balances the pull nowhere, the minimum is sought again with short
!> steps; if the gaps become so wide again, the reason is 'detached'.
!>
!> Memory, in fields of doubles: H, g, P, the spectrum of B, and the work fields exchange, residual, direction, old
!> residual, change, image, the step before and its product, curvature, state and traction of the model. In free mode
!> the spectrum and the work fields, except the curvature, have 4 times the cells. There are three more such fields: the
!> state, the traction and psi. The true operator takes three fields of the patch. Transforms are then counted in those
!> of the doubled grid. Under a pull by a prescribed force, one more field keeps the start.
module adhesion_cg_fast
   use adhesion_closing, only : close_carried_gaps
   use adhesion_descent, only : approach_minimum, keeps_sum
   use adhesion_method, only : adhesion_method_type
   use adhesion_model, only : new_adhesion_model
   use adhesion_patch, only : adhesion_contact_type, is_detached, new_adhesion_patch
   use adhesion_plane, only : keep_step, make_conjugate, stretch_step
   use adhesion_potential, only : has_smooth_potential, stiffens
   use adhesion_residual, only : measure
   use adhesion_start, only : begin_contact
   use adhesion_symbols, only : adhesion_symbols_type
   use adhesion_state, only : control_pressure, reason_undetermined, reason_converged, reason_detached, reason_iterations, &
      reason_stalled, resolved_traction
   use adhesion_steps, only : choose_step, form_step_row, known_of_step, step_sums_type
   use adhesion_window, only : new_adhesion_window
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type, fresh, updated
   use asperity_errors, only : error_type
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use fft_conv, only : columns_apply
   use field_sums, only : largest_of_rows
   use regular_grid, only : grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: adhesion_fast_type, new_adhesion_fast

   integer, parameter :: most_updates = 40      !! steps after which an inaccurate traction is computed again
   integer, parameter :: most_closings = 5     !! times that narrow gaps are closed before the end of a solve
   integer, parameter :: most_failures = 8      !! successive directions without a step
   integer, parameter :: most_calm = 8          !! largest number of good steps before longer ones are tried again
   integer, parameter :: careful(2) = [1, 3]     !! least caution of the second descent, if the first has left the contact
   real(dp), parameter :: short = 0.01_dp       !! if a smaller part of a step is taken, the model was wrong
   real(dp), parameter :: negligible = 0.01_dp  !! round-off of a traction, over the tolerance of the residual
   real(dp), parameter :: still = 0.01_dp       !! relative change of a residual that hardly changes
   real(dp), parameter :: stricter = 0.3_dp     !! factor of the residual at which a solution is checked again
   real(dp), parameter :: scaling_part = 0.02_dp   !! k over Q B at the Nyquist wave number

   !> The solver with its operators and work fields, kept from solve to solve. A variable of this type must not be
   !> copied.
   type, extends(adhesion_method_type) :: adhesion_fast_type
      type(adhesion_work_type), private :: work
      real(dp), allocatable, private :: state(:, :)        !! of the contact, in free mode
      real(dp), allocatable, private :: traction(:, :)     !! likewise
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_fast_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_fast(self, grid, kernel, error)
      type(adhesion_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel          !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      type(adhesion_symbols_type) :: symbols

      associate (work => self%work)
         call new_adhesion_patch(work%patch, grid, kernel, symbols, error)
         if (allocated(error)) return
         call new_adhesion_window(work%window, grid, kernel)
         associate (mx => work%patch%mx, rows => work%patch%all_rows)
            call new_adhesion_model(work%model, mx, work%patch%sharing, symbols, work%patch%stiffness%modes(), &
               work%patch%nyquist, error)
            if (allocated(error)) return
            allocate (work%exchange(mx, rows), work%residual(mx, rows), work%direction(mx, rows), &
               work%old(mx, rows), work%model_state(mx, rows), work%model_traction(mx, rows), &
               work%change(mx, rows + work%model%halo%foreign), work%image(mx, rows), &
               work%last_step(mx, rows), work%last_image(mx, rows), &
               work%curvature(work%patch%nx, work%patch%rows), source=0.0_dp)
            allocate (work%has_correction(rows + work%model%halo%foreign), source=.true.)
            if (.not. work%patch%periodic) &
               allocate (self%state(mx, rows), self%traction(mx, rows), source=0.0_dp)
         end associate
      end associate
   end subroutine new_adhesion_fast

   !> Solve an adhesive contact problem.
   subroutine solve(self, contact, outcome)
      class(adhesion_fast_type), intent(inout), target :: self
      type(adhesion_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: outcome
      type(adhesion_iteration_type) :: now
      real(dp), allocatable :: start(:, :)
      real(dp) :: level_before, transforms_before

      if (self%work%patch%is_full_contact(contact%problem, contact%height)) then
         outcome%reason = reason_undetermined
         return
      end if
      transforms_before = transforms(self)
      call keep_start(self, contact, start)
      level_before = contact%level
      call begin_iteration(self, contact, now)
      call minimise(self, now, outcome)
      if (outcome%reason == reason_detached) then
         ! A long step may have passed the minimum and the barrier beyond it.
         call restore_start(self, contact, start)
         contact%level = level_before
         call begin_iteration(self, contact, now)
         now%least_caution = merge(careful(1), careful(2), has_smooth_potential(contact%problem%potential))
         now%caution = now%least_caution
         call minimise(self, now, outcome)
         if (.not. (outcome%converged .or. outcome%stopped)) outcome%reason = reason_detached
      end if
      if (outcome%stopped) return

      call self%work%patch%return_solution(now, outcome%load_error)
      contact%level = now%level
      ! A transform of the model counts as a fraction. The small addition keeps the round-off of earlier counts from
      ! deciding how a half is rounded.
      outcome%ffts = nint(transforms(self) - transforms_before + 1e-6_dp, int64)
   end subroutine solve

   !> Keep the field from which a solve starts, because its place will hold the solution. Only a pull by a prescribed force
   !> may separate the surfaces and need it again.
   subroutine keep_start(self, contact, start)
      type(adhesion_fast_type), intent(in) :: self
      type(adhesion_contact_type), intent(in) :: contact
      real(dp), allocatable, intent(out) :: start(:, :)

      if (contact%problem%control /= control_pressure .or. contact%problem%target >= 0.0_dp) then
         allocate (start(0, 0))
      else if (self%work%patch%periodic) then
         allocate (start, source=contact%gap)
      else
         allocate (start, source=contact%pressure)
      end if
   end subroutine keep_start

   !> Put the field back from which a solve starts.
   subroutine restore_start(self, contact, start)
      type(adhesion_fast_type), intent(in) :: self
      type(adhesion_contact_type), intent(inout) :: contact
      real(dp), intent(in) :: start(:, :)

      if (self%work%patch%periodic) then
         contact%gap(:, :) = start
      else
         contact%pressure(:, :) = start
      end if
   end subroutine restore_start

   !> Begin the iteration at the start of the contact.
   subroutine begin_iteration(self, contact, now)
      type(adhesion_fast_type), intent(inout), target :: self
      type(adhesion_contact_type), intent(in) :: contact
      type(adhesion_iteration_type), intent(out) :: now

      now%adhesion_contact_type = contact
      if (self%work%patch%periodic) then
         now%state => contact%gap
         now%traction => contact%pressure
      else
         now%state => self%state
         now%traction => self%traction
      end if
      call begin_contact(self%work%patch, now)
   end subroutine begin_iteration

   !> Minimise the energy, starting from the present state of the contact.
   subroutine minimise(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome
      real(dp) :: form, part, stretch
      logical :: changed

      self%work%direction = 0.0_dp
      self%work%residual = 0.0_dp
      now%limit = now%problem%tolerance
      outcome%reason = reason_iterations
      do
         call choose_scaling(self, now)
         call measure(self%work, now)
         if (now%residual <= now%limit) then
            call complete_state(self, now, changed)
            if (changed) cycle
            outcome%residual = verified_residual(self, now)
            if (outcome%residual <= now%problem%tolerance) outcome%reason = reason_converged
            if (outcome%reason == reason_converged) exit
            ! The true operator of a free grid finds a larger error: continue to a smaller residual.
            now%limit = stricter*now%limit
         end if
         if (is_detached(self%work%patch, now, now%least)) outcome%reason = reason_detached
         if (now%failures > most_failures) outcome%reason = reason_stalled
         if (outcome%reason /= reason_iterations .or. outcome%iterations >= now%problem%max_iterations) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return
         outcome%iterations = outcome%iterations + 1

         call approach_minimum(self%work, now)
         call find_part(self, now, part, form, stretch)
         call update(self, now, part, form, stretch)
         if (now%failures == 2 .or. (now%updates >= most_updates .and. .not. is_accurate(self, now))) &
            call refresh(self, now)
      end do
      outcome%required = max(now%problem%tolerance, now%problem%accepted)
      if (outcome%reason /= reason_converged) call check_last_state(self, now, outcome)
      outcome%converged = outcome%reason == reason_converged
   end subroutine minimise

   !> Choose whether the preconditioner is scaled, and keep the last residual. If the sum of the gaps is prescribed, the
   !> mean is subtracted from z. Where the scaling makes z small, this may keep cells closed that have to open. The
   !> preconditioner is therefore not scaled after an iteration in which the residual hardly changed.
   subroutine choose_scaling(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      logical :: stands_still

      stands_still = abs(now%residual - now%before) < still*now%before
      self%work%scaling = 0.0_dp
      if (stiffens(now%problem%potential) .and. .not. (keeps_sum(self%work, now) .and. stands_still)) &
         self%work%scaling = scaling_part*now%problem%modulus*self%work%patch%nyquist
      now%before = now%residual
   end subroutine choose_scaling

   !> Measure the last state of a loop that has not converged. It may be a solution nevertheless.
   subroutine check_last_state(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome

      if (now%source /= fresh) then
         call refresh(self, now)
         call measure(self%work, now)
      end if
      outcome%residual = verified_residual(self, now)
      if (outcome%reason /= reason_detached .and. outcome%residual <= outcome%required) &
         outcome%reason = reason_converged
   end subroutine check_last_state

   !> Compute the traction by a new product with B, which removes the round-off of the updates.
   subroutine refresh(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now

      call self%work%patch%evaluate_traction(now)
      now%source = fresh
      now%updates = 0
      now%moved = 0.0_dp
   end subroutine refresh

   !> Make the gap and the traction of a solution belong together as closely as the tolerance requires.
   subroutine complete_state(self, now, changed)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      logical, intent(out) :: changed            !! the state must be measured again

      changed = .not. is_accurate(self, now)
      if (.not. changed .and. now%closings < most_closings) then
         call close_carried_gaps(self%work%patch, now, changed)
         if (changed) now%closings = now%closings + 1
         ! A smaller residual shows more reliably whether a cell with a narrow gap is closed.
         if (changed) now%limit = stricter*now%limit
      end if
      if (changed) call refresh(self, now)
   end subroutine complete_state

   !> Can it be concluded from the present traction that a state is a solution? A fresh product always counts. The
   !> updates of the steps add round-off in proportion to their displacements. As long as this is far below the
   !> tolerance, a fresh product would only confirm the traction, and is left out.
   pure logical function is_accurate(self, now)
      type(adhesion_fast_type), intent(in) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp) :: added

      is_accurate = now%source == fresh
      if (is_accurate) return
      added = resolved_traction(now%problem, 0.0_dp, self%work%patch%nyquist, now%moved)
      is_accurate = now%units%resolved + added <= negligible*now%units%traction
   end function is_accurate

   !> The residual that decides whether a state is a solution: in free mode, that of the true operator.
   function verified_residual(self, now) result(residual)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp) :: residual

      residual = now%residual
      if (.not. self%work%patch%periodic) residual = self%work%patch%true_residual(now)
   end function verified_residual

   !> Find the part t of the step that is taken, after one product with B.
   subroutine find_part(self, now, part, form, stretch)
      type(adhesion_fast_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), intent(out) :: part              !! 0: no part of the step lowers the energy
      real(dp), intent(out) :: form              !! Q s.B s
      real(dp), intent(out) :: stretch           !! factor of the step since its product was formed
      type(step_sums_type) :: known

      call make_conjugate(self%work, now)
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

   !> Form the sums of the step that do not need B s. In the same pass, transform the change of the displacement along
   !> the rows, with which the product B s begins.
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
      real(dp), intent(in) :: stretch            !! factor of the step since its product was formed
      real(dp) :: longest(self%work%patch%all_rows)
      integer :: j, n

      if (.not. part > 0.0_dp) then
         now%failures = now%failures + 1
         call lose_confidence(now)
         now%has_last = .false.
         return
      end if
      !$omp parallel do default(none) shared(self, now, part, stretch, longest) private(j, n) &
      !$omp num_threads(self%work%patch%threads)
      do j = 1, self%work%patch%all_rows
         call self%work%patch%stiffness%backward_row(1, j, self%work%image(:, j))
         self%work%image(:, j) = stretch*self%work%image(:, j)
         now%traction(:, j) = now%traction(:, j) + part*now%problem%modulus*self%work%image(:, j)
         n = self%work%patch%inner(j)
         now%state(:, j) = now%state(:, j) + part*self%work%direction(:, j)
         longest(j) = maxval(abs(self%work%direction(:, j)))
         now%state(1:n, j) = max(now%state(1:n, j), 0.0_dp)
      end do
      now%level = now%level + part*now%lift
      now%moved = now%moved + part*(largest_of_rows(longest) + abs(now%lift))
      call keep_step(self%work, now, form)
      now%failures = 0
      if (part < short) then
         call lose_confidence(now)
      else
         call gain_confidence(now)
      end if
      now%source = updated
      now%updates = now%updates + 1
   end subroutine update

   !> Take shorter steps after one that failed or of which hardly anything could be taken.
   subroutine lose_confidence(now)
      type(adhesion_iteration_type), intent(inout) :: now

      now%caution = now%caution + 1
      now%setbacks = now%setbacks + 1
      now%calm = 0
   end subroutine lose_confidence

   !> Try longer steps after good ones. Near the loss of stability the local model may be stable where the energy is
   !> not, or the reverse, so that its long steps fail again and again. The more of them have failed, the more good steps
   !> are therefore required before a longer one is tried.
   subroutine gain_confidence(now)
      type(adhesion_iteration_type), intent(inout) :: now

      if (now%caution == now%least_caution) then
         now%setbacks = 0
         return
      end if
      now%calm = now%calm + 1
      if (now%calm < min(now%setbacks, most_calm)) return
      now%caution = now%caution - 1
      now%calm = 0
   end subroutine gain_confidence

   !> Transforms done so far. Those of the model count by their number of cells.
   function transforms(self) result(count)
      type(adhesion_fast_type), intent(in) :: self
      real(dp) :: count

      count = real(self%work%patch%transforms(), dp) + self%work%model%transforms()
   end function transforms

   !> Free plans.
   subroutine destroy(self)
      class(adhesion_fast_type), intent(inout) :: self

      call self%work%patch%destroy()
      call self%work%model%destroy()
   end subroutine destroy

end module adhesion_cg_fast
