!> The fast method for adhesive contact, on periodic and on free grids.
!>
!> (Module adhesion_state has the equations, adhesion_patch what the grids differ in; thesis, 2.3.) The
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
!> Fields of doubles: H, g, P, and the work fields gradient, residual, direction, old residual; the
!> spectrum of B and with 'full' of M. In free mode the work fields, the spectra and three more fields
!> (state, traction, psi) have 4 times the cells, and the transforms counted are of the doubled grid.
module adhesion_cg_fast
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type, evaluate_gradient, is_detached, &
      natural_residual, new_adhesion_patch
   use adhesion_potential, only : potential_gauss
   use adhesion_preconditioner, only : adhesion_preconditioner_type, new_adhesion_preconditioner
   use adhesion_state, only : adhesion_method_type, adhesion_problem_type, control_approach, &
      control_pressure, diagonal_scaling, reason_closed, reason_converged, reason_detached, &
      reason_limit, reason_stalled
   use adhesion_steps, only : choose_step, clipped_step, form_step_row, known_of_step, step_sums_type, &
      stepped_gap, sum_shift
   use asperity_errors, only : error_type
   use asperity_parallel, only : global_max, global_min, global_sum
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

   ! Where the traction comes from. Only a fresh one proves a solution.
   integer, parameter :: updated = 1            !! it was updated with the steps, and has gathered round-off
   integer, parameter :: fresh = 2              !! it is a product with B

   ! Passes over z. The first is left out where the sum of the gap is free.
   integer, parameter :: sum_pass = 0           !! add up
   integer, parameter :: last_pass = 2          !! z is what it will be

   !> The solver with its operators and work fields, kept from solve to solve. Not to be copied.
   type, extends(adhesion_method_type) :: adhesion_fast_type
      type(adhesion_patch_type), private :: patch
      type(adhesion_preconditioner_type), private :: preconditioner
      real(dp), allocatable, private :: state(:, :)        !! of the contact, in free mode
      real(dp), allocatable, private :: traction(:, :)     !! the same
      real(dp), allocatable, private :: gradient(:, :)     !! G; then M's input; then z = M r
      real(dp), allocatable, private :: residual(:, :)     !! r
      real(dp), allocatable, private :: old(:, :)          !! r of the iteration before
      real(dp), allocatable, private :: direction(:, :)    !! d
      real(dp), private :: scaling = 0.0_dp                !! k of the Gauss potential, Pa/m; 0: none
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_fast_type

   !> A contact that is being solved, and where its iteration stands.
   type, extends(adhesion_contact_type) :: iteration_type
      integer :: source = fresh                  !! of the traction
      integer :: updates = 0                     !! of the traction since it was fresh
      integer :: failures = 0                    !! directions in a row that gave no step
      real(dp) :: residual = 0.0_dp              !! natural residual by the traction at hand
      real(dp) :: limit = 0.0_dp                 !! residual at which a solution is checked
      real(dp) :: least = 0.0_dp                 !! least gap, m
      real(dp) :: missing = 0.0_dp               !! prescribed force less sum of P, free mode, Pa
      real(dp) :: old_missing = 0.0_dp           !! in the iteration before
      real(dp) :: psi_r = 0.0_dp                 !! psi.r of the padding, Pa
      real(dp) :: old_rz = 0.0_dp                !! r.z of the iteration before; 0: directions start anew
      real(dp) :: kappa = 1.0_dp                 !! last form of a step over its estimate
      real(dp) :: lift = 0.0_dp                  !! d of the level
      real(dp) :: slope = 0.0_dp                 !! r.d
      real(dp) :: squares = 0.0_dp               !! of the change of the displacement along d
   end type iteration_type

   !> A step: the new gap is t of the way to stepped_gap(g, d, alpha, shift).
   type :: step_type
      real(dp) :: alpha = 0.0_dp
      real(dp) :: shift = 0.0_dp                 !! keeps a prescribed sum of the gap, m
      real(dp) :: part = 0.0_dp                  !! t; 0: there is no step that lowers the energy
   end type step_type

   !> Sums of a row of z.
   type :: z_sums_type
      real(dp) :: rz = 0.0_dp                    !! r.z
      real(dp) :: old_rz = 0.0_dp                !! z.(r of the iteration before)
      real(dp) :: total = 0.0_dp                 !! sum of z over the cells that may move
      real(dp) :: moving = 0.0_dp                !! their number
   end type z_sums_type

contains

   !> Make a solver for a grid; in free mode ny > 1.
   subroutine new_adhesion_fast(self, grid, poisson, preconditioner, error)
      type(adhesion_fast_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      character(*), intent(in) :: preconditioner           !! 'coarse' or 'full'
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stiffness(:, :), compliance(:, :)

      call new_adhesion_patch(self%patch, grid, poisson, stiffness, compliance, error)
      if (allocated(error)) return
      associate (mx => self%patch%mx, my => self%patch%my, nyquist => self%patch%nyquist)
         call new_adhesion_preconditioner(self%preconditioner, preconditioner, mx, my, compliance, &
            stiffness, nyquist, error)
         if (allocated(error)) return
         allocate (self%gradient(mx, my), self%residual(mx, my), self%direction(mx, my), self%old(mx, my), &
            source=0.0_dp)
         if (.not. self%patch%periodic) allocate (self%state(mx, my), self%traction(mx, my), source=0.0_dp)
      end associate
   end subroutine new_adhesion_fast

   !> Solve an adhesive contact problem, as `adhesion_method_type` says.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, history)
      class(adhesion_fast_type), intent(inout), target :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in), contiguous, target :: height(:, :)
      real(dp), intent(inout), contiguous, target :: gap(:, :)
      real(dp), intent(inout), contiguous, target :: pressure(:, :)
      real(dp), intent(inout) :: level
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), target, optional :: history(:, :)
      type(iteration_type) :: now
      real(dp) :: transforms_before

      outcome%seconds = omp_get_wtime()
      transforms_before = transforms(self)
      now%problem = problem
      now%height => height
      if (present(history)) now%history => history
      now%level = level
      if (problem%control == control_approach) now%level = problem%target
      if (self%patch%periodic) then
         now%state => gap
         now%traction => pressure
      else
         now%state => self%state
         now%traction => self%traction
      end if
      if (self%patch%is_closed_up(problem, height)) then
         outcome%reason = reason_closed
         level = problem%target
      else
         call self%patch%begin(now, gap, pressure)
         call minimise(self, now, outcome)
         call self%patch%hand_out(now, gap, pressure, level, outcome%load_error)
      end if
      outcome%ffts = nint(transforms(self) - transforms_before, int64)
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> Minimise the energy from the start that the contact is at.
   subroutine minimise(self, now, outcome)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome
      type(step_type) :: step

      self%scaling = 0.0_dp
      if (now%problem%potential%kind == potential_gauss) &
         self%scaling = 0.02_dp*now%problem%modulus*self%patch%nyquist
      self%direction = 0.0_dp
      self%residual = 0.0_dp
      now%limit = now%problem%tolerance
      outcome%reason = reason_limit
      do
         call measure(self, now)
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
         if (is_detached(self%patch, now, now%least)) outcome%reason = reason_detached
         if (now%failures > most_failures) outcome%reason = reason_stalled
         if (outcome%reason /= reason_limit .or. outcome%iterations >= now%problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         call find_direction(self, now)
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
      type(iteration_type), intent(inout) :: now
      type(solver_result_type), intent(inout) :: outcome

      if (now%source /= fresh) then
         call refresh(self, now)
         call measure(self, now)
      end if
      outcome%residual = proven_residual(self, now)
      if (outcome%reason /= reason_detached .and. outcome%residual <= now%problem%tolerance) &
         outcome%reason = reason_converged
   end subroutine take_last_look

   !> The traction by a product with B.
   subroutine refresh(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now

      call self%patch%evaluate_traction(now)
      now%source = fresh
      now%updates = 0
   end subroutine refresh

   !> The residual that proves a solution, from a fresh traction.
   function proven_residual(self, now) result(residual)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(in) :: now
      real(dp) :: residual

      residual = now%residual
      if (.not. self%patch%periodic) residual = self%patch%true_residual(now)
   end function proven_residual

   !> The gradient G, the natural residual, and r, which is handed to the preconditioner.
   subroutine measure(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now
      real(dp), allocatable :: loads(:), paddings(:)
      real(dp) :: worst, least
      integer :: j

      call evaluate_gradient(self%patch, now, self%gradient)
      allocate (loads(self%patch%my), paddings(self%patch%my))
      worst = 0.0_dp
      least = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, now, loads, paddings) private(j) &
      !$omp reduction(max: worst) reduction(min: least) num_threads(self%patch%threads)
      do j = 1, self%patch%my
         call measure_row(self, now, j, worst, least, paddings(j))
         loads(j) = sum(now%traction(1:self%patch%inner(j), j))
         call self%preconditioner%put_row(j, self%gradient(:, j))
      end do
      now%residual = global_max(worst)
      now%least = global_min(least)
      if (self%patch%periodic) return
      now%psi_r = global_sum(sum(paddings))
      if (now%problem%control /= control_pressure) return
      now%old_missing = now%missing
      now%missing = now%force - global_sum(sum(loads))
      now%residual = max(now%residual, abs(now%missing)/max(abs(now%force), now%units%traction))
   end subroutine measure

   !> A row of r and of M's input, from the row of G less p.
   subroutine measure_row(self, now, j, worst, least, padding)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(in) :: now
      integer, intent(in) :: j
      real(dp), intent(inout) :: worst                 !! natural residual
      real(dp), intent(inout) :: least                 !! least gap, m
      real(dp), intent(out) :: padding                 !! psi.r of the padding, Pa
      real(dp) :: g, gap, r
      integer :: i, n

      n = self%patch%inner(j)
      do i = 1, n
         gap = now%state(i, j)
         g = self%gradient(i, j) + now%load
         worst = max(worst, natural_residual(now%units, gap, g))
         least = min(least, gap)
         r = 0.0_dp
         if (gap > 0.0_dp .or. g < 0.0_dp) r = -g
         self%old(i, j) = self%residual(i, j)
         self%residual(i, j) = r
         if (self%scaling > 0.0_dp) r = r*diagonal_scaling(now%problem, gap, self%scaling)
         self%gradient(i, j) = r
      end do
      padding = 0.0_dp
      do i = n + 1, self%patch%mx
         r = -now%traction(i, j)
         worst = max(worst, abs(r)/now%units%traction)
         padding = padding + self%patch%psi(i, j)*r
         self%old(i, j) = self%residual(i, j)
         self%residual(i, j) = r
         self%gradient(i, j) = r
      end do
   end subroutine measure_row

   !> The direction d = z + beta d, or d = z where that one does not descend.
   subroutine find_direction(self, now)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now
      type(z_sums_type) :: sums
      real(dp) :: level_z, beta

      call self%preconditioner%transform()
      level_z = 0.0_dp
      if (.not. self%patch%periodic .and. now%problem%control == control_pressure) &
         level_z = (now%missing + now%psi_r)/(now%problem%modulus*self%patch%psi_form)
      call precondition(self, now, level_z, sums)
      sums%rz = sums%rz + now%missing*level_z
      sums%old_rz = sums%old_rz + now%old_missing*level_z
      beta = 0.0_dp
      if (now%old_rz > 0.0_dp) beta = max(0.0_dp, (sums%rz - sums%old_rz)/now%old_rz)
      now%old_rz = sums%rz
      call turn(self, beta, level_z, now)
      if (now%slope <= 0.0_dp .and. beta > 0.0_dp) call turn(self, 0.0_dp, level_z, now)
   end subroutine find_direction

   !> z = M r on the free cells and in the padding, without cells in contact that it would close; of zero
   !> mean where the sum of the gap is prescribed, and with the level's mode where that is unknown.
   subroutine precondition(self, now, level_z, sums)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(in) :: now
      real(dp), intent(in) :: level_z                  !! z of the level, m
      type(z_sums_type), intent(out) :: sums
      type(z_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: z(:)
      real(dp) :: mean
      integer :: first, j, pass

      first = last_pass
      if (self%patch%periodic .and. now%problem%control == control_approach) first = sum_pass
      allocate (rows(self%patch%my))
      !$omp parallel default(none) shared(self, now, level_z, rows, first) private(j, z) &
      !$omp num_threads(self%patch%threads)
      allocate (z(self%patch%mx))
      !$omp do
      do j = 1, self%patch%my
         call self%preconditioner%get_row(j, self%gradient(:, j), z)
         call take_z_row(self, now, level_z, j, z)
         call center_row(self, now, first, 0.0_dp, j, rows(j))
      end do
      !$omp end do
      !$omp end parallel
      sums = sum_of(rows)
      ! Cells in contact that the mean would close drop out, which changes the mean: once more.
      do pass = first + 1, last_pass
         mean = sums%total/max(sums%moving, 1.0_dp)
         !$omp parallel do default(none) shared(self, now, pass, mean, rows) private(j) &
         !$omp num_threads(self%patch%threads)
         do j = 1, self%patch%my
            call center_row(self, now, pass, mean, j, rows(j))
         end do
         sums = sum_of(rows)
      end do
   end subroutine precondition

   !> A row of z from what M has made of r; 0 on the cells that are not free.
   subroutine take_z_row(self, now, level_z, j, z)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(in) :: now
      real(dp), intent(in) :: level_z                  !! m
      integer, intent(in) :: j
      real(dp), intent(inout) :: z(:)                  !! in: M r for Q = 1
      integer :: i, n

      n = self%patch%inner(j)
      z(:) = z/now%problem%modulus
      do i = 1, n
         if (.not. (now%state(i, j) > 0.0_dp .or. self%residual(i, j) > 0.0_dp)) z(i) = 0.0_dp
         if (self%scaling > 0.0_dp) z(i) = z(i)*diagonal_scaling(now%problem, now%state(i, j), self%scaling)
      end do
      if (n < self%patch%mx) z(n + 1:) = z(n + 1:) + level_z*self%patch%psi(n + 1:, j)
      self%gradient(:, j) = z
   end subroutine take_z_row

   !> Take the mean off a row of z, and keep cells in contact from closing; the sums of the row.
   subroutine center_row(self, now, pass, mean, j, sums)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(in) :: now
      integer, intent(in) :: pass                      !! in sum_pass z is left as it is
      real(dp), intent(in) :: mean                     !! m
      integer, intent(in) :: j
      type(z_sums_type), intent(out) :: sums
      real(dp) :: z
      logical :: open, opening
      integer :: i

      do i = 1, self%patch%mx
         z = self%gradient(i, j)
         if (i <= self%patch%inner(j)) then
            open = now%state(i, j) > 0.0_dp
            opening = self%residual(i, j) > 0.0_dp
            if (pass == last_pass) opening = z > 0.0_dp
            if (open .or. opening) z = z - mean
            if (pass /= sum_pass .and. .not. open) then
               z = merge(max(z, 0.0_dp), 0.0_dp, opening)
               opening = z > 0.0_dp
            end if
            if (open .or. opening) sums%moving = sums%moving + 1.0_dp
            self%gradient(i, j) = z
            sums%total = sums%total + z
         end if
         sums%rz = sums%rz + z*self%residual(i, j)
         sums%old_rz = sums%old_rz + z*self%old(i, j)
      end do
   end subroutine center_row

   !> Sums of all rows, in order.
   function sum_of(rows) result(sums)
      type(z_sums_type), intent(in) :: rows(:)
      type(z_sums_type) :: sums

      sums%rz = global_sum(sum(rows%rz))
      sums%old_rz = global_sum(sum(rows%old_rz))
      sums%total = global_sum(sum(rows%total))
      sums%moving = global_sum(sum(rows%moving))
   end function sum_of

   !> d = z + beta d on the free cells and in the padding, 0 elsewhere; the level's alike. The change of
   !> the displacement along d is handed to the estimate.
   subroutine turn(self, beta, level_z, now)
      type(adhesion_fast_type), intent(inout) :: self
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: level_z                  !! z of the level, m
      type(iteration_type), intent(inout) :: now
      real(dp), allocatable :: change(:), slopes(:), squares(:)
      real(dp) :: d
      integer :: i, j, n

      now%lift = level_z + beta*now%lift
      allocate (slopes(self%patch%my), squares(self%patch%my))
      !$omp parallel default(none) shared(self, now, beta, slopes, squares) &
      !$omp private(i, j, n, d, change) num_threads(self%patch%threads)
      allocate (change(self%patch%mx))
      !$omp do
      do j = 1, self%patch%my
         n = self%patch%inner(j)
         slopes(j) = 0.0_dp
         do i = 1, self%patch%mx
            d = self%gradient(i, j) + beta*self%direction(i, j)
            if (i <= n) then
               if (.not. (now%state(i, j) > 0.0_dp .or. self%gradient(i, j) > 0.0_dp)) d = 0.0_dp
            end if
            slopes(j) = slopes(j) + self%residual(i, j)*d
            self%direction(i, j) = d
            change(i) = merge(d + now%lift, d, i <= n)
         end do
         squares(j) = sum(change**2)
         call self%preconditioner%put_estimate_row(j, change)
      end do
      !$omp end do
      !$omp end parallel
      now%slope = global_sum(sum(slopes)) + now%missing*now%lift
      now%squares = global_sum(sum(squares))
   end subroutine turn

   !> The clipped step along d, and how far to go along that step.
   subroutine find_step(self, now, step)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now
      type(step_type), intent(out) :: step
      type(step_sums_type) :: known
      real(dp) :: estimate
      integer :: trial

      if (.not. now%slope > 0.0_dp) return
      estimate = now%problem%modulus*now%kappa*self%preconditioner%estimate(now%squares)
      associate (nx => self%patch%nx, ny => self%patch%ny, threads => self%patch%threads)
         associate (gap => now%state(1:nx, 1:ny), direction => self%direction(1:nx, 1:ny))
            step%alpha = clipped_step(now%problem, gap, direction, -now%slope, estimate, threads)
            do trial = 1, 40
               if (self%patch%periodic .and. now%problem%control == control_approach) &
                  step%shift = sum_shift(gap, direction, step%alpha, now%gap_sum, threads)
               call form_step(self, now, step, known)
               if (known%slope <= -descent*step%alpha*now%slope) exit
               step%alpha = 0.25_dp*step%alpha
            end do
            call self%patch%stiffness%columns(columns_apply, known%form)
            estimate = self%preconditioner%estimate(known%squares)
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
      type(iteration_type), intent(in) :: now
      type(step_type), intent(in) :: step
      type(step_sums_type), intent(out) :: known
      type(step_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: change(:)
      integer :: j, n

      allocate (rows(self%patch%my))
      !$omp parallel default(none) shared(self, now, step, rows) private(j, n, change) &
      !$omp num_threads(self%patch%threads)
      allocate (change(self%patch%mx))
      !$omp do
      do j = 1, self%patch%my
         n = self%patch%inner(j)
         call form_step_row(now%problem, now%state(1:n, j), self%direction(1:n, j), self%residual(1:n, j), &
            step%alpha, step%shift, change(1:n), rows(j))
         change(1:n) = change(1:n) + step%alpha*now%lift
         change(n + 1:) = step%alpha*self%direction(n + 1:, j)
         rows(j)%slope = rows(j)%slope - sum(self%residual(n + 1:, j)*change(n + 1:))
         rows(j)%squares = sum(change**2)
         call self%patch%stiffness%forward_row(1, j, change)
         call self%preconditioner%put_estimate_row(j, change)
      end do
      !$omp end do
      !$omp end parallel
      known = known_of_step(rows)
      known%slope = known%slope - now%missing*step%alpha*now%lift
   end subroutine form_step

   !> g = g + t s, u and level with it, and the traction by recurrence; without a step directions start
   !> anew.
   subroutine update(self, now, step)
      type(adhesion_fast_type), intent(inout) :: self
      type(iteration_type), intent(inout) :: now
      type(step_type), intent(in) :: step
      real(dp) :: next
      integer :: i, j, n

      if (.not. step%part > 0.0_dp) then
         now%failures = now%failures + 1
         now%old_rz = 0.0_dp
         return
      end if
      !$omp parallel do default(none) shared(self, now, step) private(i, j, n, next) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%my
         call self%patch%stiffness%add_backward_row(1, j, step%part*now%problem%modulus, now%traction(:, j))
         n = self%patch%inner(j)
         do i = 1, n
            next = stepped_gap(now%state(i, j), self%direction(i, j), step%alpha, step%shift)
            if (step%part /= 1.0_dp) &
               next = max(now%state(i, j) + step%part*(next - now%state(i, j)), 0.0_dp)
            now%state(i, j) = next
         end do
         do i = n + 1, self%patch%mx
            now%state(i, j) = now%state(i, j) + step%part*step%alpha*self%direction(i, j)
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

      count = real(self%patch%transforms(), dp) + self%preconditioner%transforms()
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_fast_type), intent(inout) :: self

      call self%patch%destroy()
      call self%preconditioner%destroy()
      if (allocated(self%gradient)) deallocate (self%gradient, self%residual, self%direction, self%old)
      if (allocated(self%state)) deallocate (self%state, self%traction)
   end subroutine destroy

end module adhesion_cg_fast
