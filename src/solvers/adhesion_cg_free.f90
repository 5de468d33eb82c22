!> Adhesive contact in free mode: a patch on an unbounded half-space.
!>
!> The truncated operator of Love's coefficients has no symbol to invert. But on the doubled grid the
!> wrapped coefficients have one, K, that is positive, and B = 1/K there. The energy is minimised over
!> the displacement of the padding as well, where there is no adhesion and the surface is free: by the
!> Schur complement that is the free operator on the patch. With u = g + H + level inside,
!>     E = Q/2 u.B u - P_h.u + sum e(g) over the patch [- F level],    P = Q B u - P_h,  0 in the padding
!> is minimised by the method of module adhesion_cg_periodic (M = K, or its low wave numbers). Where the
!> load is prescribed the level is one more unknown; it moves with psi: 1 on the patch, and falling in
!> the padding as the displacement of a uniform pressure does.
!>
!> Converged means that the natural residual of the patch, with the displacement of the pressure found
!> by the true free operator, is below the tolerance: the padding drops out.
!>
!> Fields of doubles, each of the doubled grid (4 times the patch): gap and displacement, traction, and
!> the work fields gradient, residual, direction, old residual, psi; the spectrum of B, a quarter for
!> each symbol; on the patch H, g, P. The transforms counted are of the doubled grid.
module adhesion_cg_free
   use adhesion_potential, only : adhesive_slope, potential_gauss
   use adhesion_preconditioner, only : adhesion_preconditioner_type, new_adhesion_preconditioner
   use adhesion_state, only : adhesion_problem_type, choose_step, clipped_step, close_gaps, &
      collect_step, control_approach, control_pressure, diagonal_scaling, form_step_row, reason_converged, &
      reason_detached, reason_limit, reason_stalled, resolved_traction, row_total, step_sums_type, stepped_gap, &
      traction_scale
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : columns_apply, convolution_type, new_normal_operator, new_symbol_operator
   use influence, only : normal_symbol
   use omp_lib, only : omp_get_wtime
   use asperity_parallel, only : global_max, global_min
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_free, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_free_type, new_adhesion_free

   integer, parameter :: refresh = 40          !! iterations between fresh products with B
   real(dp), parameter :: descent = 0.2_dp     !! of the slope along d, what clipping must leave

   !> The solver with its operators and work fields, kept from step to step. Not to be copied.
   type :: adhesion_free_type
      type(grid_type) :: grid
      integer :: nx = 0, ny = 0                            !! the patch
      integer :: mx = 0, my = 0                            !! the doubled grid
      type(convolution_type) :: operator                   !! the free operator, for the last check
      type(convolution_type) :: stiffness                  !! B for G = 1, doubled grid
      type(adhesion_preconditioner_type) :: preconditioner
      real(dp) :: nyquist = 0.0_dp                         !! B at the Nyquist wave number
      real(dp) :: longest = 0.0_dp                         !! B at the least wave number
      real(dp), allocatable, private :: state(:, :)        !! g on the patch, u in the padding
      real(dp), allocatable, private :: traction(:, :)     !! P
      real(dp), allocatable, private :: gradient(:, :)     !! M's input; then z = M r
      real(dp), allocatable, private :: residual(:, :)     !! -G where free
      real(dp), allocatable, private :: direction(:, :)    !! d
      real(dp), allocatable, private :: old(:, :)          !! residual of the iteration before
      real(dp), allocatable, private :: psi(:, :)          !! the mode of the level
      real(dp), allocatable, private :: rows(:, :)         !! partial sums of each row
      real(dp), private :: psi_form = 0.0_dp               !! psi.B psi
      real(dp), private :: scaling = 0.0_dp                !! of the Gauss potential; 0: none
      real(dp), private :: old_rz = 0.0_dp                 !! r.z of the iteration before; 0: start anew
      real(dp), private :: kappa = 1.0_dp                  !! last form of a step over its estimate
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_free_type

contains

   !> Make a solver for a free grid.
   subroutine new_adhesion_free(self, grid, poisson, preconditioner, error)
      type(adhesion_free_type), intent(out) :: self
      type(grid_type), intent(in) :: grid                  !! free, ny > 1
      real(dp), intent(in) :: poisson
      character(*), intent(in) :: preconditioner           !! 'coarse' or 'full'
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: compliance(:, :), stiffness(:, :)

      if (grid%boundary /= boundary_free .or. grid%ny < 2) then
         call fail(error, error_input, 'adhesion_cg_free: boundary: must be free, with ny > 1')
         return
      end if
      self%grid = grid
      self%nx = grid%nx
      self%ny = grid%ny
      self%mx = 2*grid%nx
      self%my = 2*grid%ny
      self%nyquist = pi/sqrt(grid%dx*grid%dy)/(1.0_dp - poisson)
      self%longest = 2.0_dp*pi/max(grid%lx, grid%ly)/(1.0_dp - poisson)
      allocate (compliance(0:grid%nx, 0:grid%ny), stiffness(0:grid%nx, 0:grid%ny))
      call normal_symbol(grid, poisson, self%mx, self%my, compliance)
      if (minval(compliance) <= 0.0_dp) then
         call fail(error, error_input, 'adhesion_cg_free: the symbol of this grid is not positive')
         return
      end if
      stiffness = 1.0_dp/compliance
      call new_symbol_operator(self%stiffness, self%mx, self%my, stiffness, error)
      if (allocated(error)) return
      call new_adhesion_preconditioner(self%preconditioner, preconditioner, self%mx, self%my, &
         compliance, stiffness, 1.4_dp/self%nyquist, 0.5_dp*self%nyquist, error)
      if (allocated(error)) return
      call new_normal_operator(self%operator, grid, poisson, error)
      if (allocated(error)) return
      allocate (self%state(self%mx, self%my), self%traction(self%mx, self%my), &
         self%gradient(self%mx, self%my), self%residual(self%mx, self%my), &
         self%direction(self%mx, self%my), self%old(self%mx, self%my), &
         self%psi(self%mx, self%my), source=0.0_dp)
      allocate (self%rows(8, self%my))
      call make_psi(self)
   end subroutine new_adhesion_free

   !> psi: the displacement of a uniform pressure on the patch over its least value there, at most 1.
   subroutine make_psi(self)
      type(adhesion_free_type), intent(inout) :: self
      real(dp) :: least
      integer :: j

      self%state(1:self%nx, 1:self%ny) = 1.0_dp
      call self%stiffness%apply_inverse(self%state, self%psi)
      least = global_min(minval(self%psi(1:self%nx, 1:self%ny)))
      do j = 1, self%my
         self%psi(:, j) = min(self%psi(:, j)/least, 1.0_dp)
      end do
      call self%stiffness%quadratic_form(self%psi, self%psi_form)
      self%state = 0.0_dp
   end subroutine make_psi

   !> Solve an adhesive contact problem.
   !>
   !> Not converging is an outcome: the state reached, lowest in energy so far, is handed out.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, history)
      class(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), intent(inout) :: gap(:, :)             !! g, m: the solution; see `full_contact`
      real(dp), intent(inout) :: pressure(:, :)        !! P, attraction included, Pa: a start
      real(dp), intent(inout) :: level                 !! U - H where the gap is zero, m: a start
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa
      real(dp) :: force, missing, missing_old, scale, length, least, attraction, residual, limit
      real(dp) :: alpha, t, dd, psi_r, transforms_before
      integer(int64) :: before
      integer :: age, failures
      logical :: fresh, loaded

      outcome%seconds = omp_get_wtime()
      before = self%stiffness%ffts + self%operator%ffts
      transforms_before = self%preconditioner%transforms()
      outcome%reason = reason_limit
      loaded = problem%control == control_pressure
      force = 0.0_dp
      if (loaded) force = problem%target*real(self%nx, dp)*self%ny
      if (.not. loaded) level = problem%target
      self%scaling = 0.0_dp
      if (problem%potential%kind == potential_gauss) &
         self%scaling = 0.02_dp*problem%modulus*self%nyquist
      self%direction = 0.0_dp
      self%residual = 0.0_dp
      length = problem%potential%range
      if (length <= 0.0_dp) length = max(maxval(height) - minval(height), tiny(1.0_dp))
      length = max(length, 20.0_dp*epsilon(1.0_dp)*(abs(level) + problem%datum - minval(height)) &
         /problem%tolerance)
      call start_state(self, problem, height, gap, pressure, level, problem%tolerance*length, history)
      call evaluate_traction(self, problem, height, level, history)
      fresh = .true.
      age = 0
      failures = 0
      self%kappa = 1.0_dp
      self%old_rz = 0.0_dp
      dd = 0.0_dp
      missing = 0.0_dp
      scale = traction_scale(problem%potential, max(maxval(abs(self%traction)), &
         problem%modulus*self%longest*(maxval(height) - minval(height)), tiny(1.0_dp)))
      scale = max(scale, resolved_traction(problem, maxval(abs(self%traction)), self%nyquist, &
         problem%datum - minval(height)))
      limit = problem%tolerance
      do
         missing_old = missing
         call evaluate_gradient(self, problem, length, scale, force, residual, missing, psi_r, &
            least, attraction)
         if (residual <= limit) then
            if (fresh) then
               outcome%residual = true_residual(self, problem, height, level, length, scale, &
                  force, history)
               if (outcome%residual <= problem%tolerance) then
                  outcome%converged = .true.
                  outcome%reason = reason_converged
                  exit
               end if
               limit = 0.3_dp*limit
            else
               call evaluate_traction(self, problem, height, level, history)
               fresh = .true.
               age = 0
               cycle
            end if
         end if
         if (loaded .and. force < 0.0_dp .and. least > 3.0_dp*problem%potential%range .and. &
            attraction < -0.5_dp*force) then
            outcome%reason = reason_detached
            exit
         end if
         if (outcome%iterations >= problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         call search(self, problem, missing, missing_old, psi_r, alpha, dd, t)
         if (t > 0.0_dp) then
            call take_step(self, problem, alpha, t)
            level = level + t*alpha*dd
            failures = 0
            fresh = .false.
            age = age + 1
         else
            failures = failures + 1
            self%old_rz = 0.0_dp
            if (failures > 3) then
               outcome%reason = reason_stalled
               exit
            end if
         end if
         if (age == refresh .or. failures == 2) then
            call evaluate_traction(self, problem, height, level, history)
            fresh = .true.
            age = 0
         end if
      end do
      if (.not. outcome%converged) then
         if (.not. fresh) call evaluate_traction(self, problem, height, level, history)
         outcome%residual = true_residual(self, problem, height, level, length, scale, force, &
            history)
         if (outcome%reason /= reason_detached .and. outcome%residual <= problem%tolerance) then
            outcome%converged = .true.
            outcome%reason = reason_converged
         end if
      end if
      call hand_out(self, gap, pressure)
      call close_gaps(problem, length, scale, self%stiffness%threads, gap, pressure)
      if (loaded) outcome%load_error = abs(row_total(self%rows, 1) - force)/max(abs(force), scale)
      outcome%ffts = self%stiffness%ffts + self%operator%ffts - before &
         + nint(self%preconditioner%transforms() - transforms_before, int64)
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> The direction d from the residual, the clipped step along it, and how far to go along that step.
   subroutine search(self, problem, missing, missing_old, psi_r, alpha, dd, t)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: missing                  !! force not yet carried, now
      real(dp), intent(in) :: missing_old              !! and in the iteration before, Pa
      real(dp), intent(in) :: psi_r                    !! psi.r of the padding
      real(dp), intent(out) :: alpha                   !! the step: stepped_gap(g, d, alpha, 0) - g
      real(dp), intent(inout) :: dd                    !! d of the level; 0 where it is prescribed
      real(dp), intent(out) :: t                       !! part of the step that is taken; 0: none
      type(step_sums_type) :: known
      real(dp) :: rz, rz_old, rd, squares, beta, estimate, zd
      integer :: pass

      alpha = 0.0_dp
      t = 0.0_dp
      call self%preconditioner%transform()
      zd = 0.0_dp
      if (problem%control == control_pressure) zd = (missing + psi_r)/(problem%modulus*self%psi_form)
      call precondition(self, problem, zd, rz, rz_old)
      rz = rz + missing*zd
      rz_old = rz_old + missing_old*zd
      beta = 0.0_dp
      if (self%old_rz > 0.0_dp) beta = max(0.0_dp, (rz - rz_old)/self%old_rz)
      self%old_rz = rz
      call new_direction(self, beta, zd, dd, rd, squares)
      rd = rd + missing*dd
      if (rd <= 0.0_dp .and. beta > 0.0_dp) then
         dd = 0.0_dp
         call new_direction(self, 0.0_dp, zd, dd, rd, squares)
         rd = rd + missing*dd
      end if
      if (.not. rd > 0.0_dp) return

      estimate = problem%modulus*self%kappa*self%preconditioner%estimate(squares)
      associate (gap => self%state(1:self%nx, 1:self%ny), &
         direction => self%direction(1:self%nx, 1:self%ny))
         alpha = clipped_step(problem, gap, direction, -rd, estimate, self%rows, &
            self%stiffness%threads)
         do pass = 1, 40
            call form_step(self, problem, alpha, dd, known, squares)
            known%slope = known%slope - missing*alpha*dd
            if (known%slope <= -descent*alpha*rd) exit
            alpha = 0.25_dp*alpha
         end do
         call self%stiffness%columns(columns_apply, known%form)
         estimate = self%preconditioner%estimate(squares)
         if (estimate > 0.0_dp) self%kappa = known%form/estimate
         known%form = problem%modulus*known%form
         t = choose_step(known, problem, gap, direction, alpha, 0.0_dp, self%rows, &
            self%stiffness%threads)
      end associate
   end subroutine search

   !> The start: from the pressure and the level handed in, or from full contact. The gap of a pressure
   !> is not sharp: a contact that is handed in stays one.
   subroutine start_state(self, problem, height, gap, pressure, level, closed, history)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :), gap(:, :), pressure(:, :)
      real(dp), intent(inout) :: level
      real(dp), intent(in) :: closed                   !! gaps up to this count as none, m
      real(dp), intent(in), optional :: history(:, :)
      real(dp) :: mean
      integer :: i, j

      if (problem%full_contact) then
         mean = sum(height)/size(height) - problem%datum
         if (problem%control /= control_approach) level = -mean
         do j = 1, self%my
            self%state(:, j) = (level + mean)*self%psi(:, j)
         end do
         do j = 1, self%ny
            self%state(1:self%nx, j) = max(gap(:, j), 0.0_dp)
         end do
         return
      end if
      self%traction = 0.0_dp
      do j = 1, self%ny
         self%traction(1:self%nx, j) = pressure(:, j)
         if (present(history)) &
            self%traction(1:self%nx, j) = self%traction(1:self%nx, j) + history(:, j)
      end do
      call self%stiffness%apply_inverse(self%traction, self%state)
      do j = 1, self%my
         self%state(:, j) = self%state(:, j)/problem%modulus
         if (j > self%ny) cycle
         do i = 1, self%nx
            self%state(i, j) = self%state(i, j) - (height(i, j) - problem%datum) - level
            if (self%state(i, j) <= closed) self%state(i, j) = 0.0_dp
         end do
      end do
   end subroutine start_state

   !> Traction P = Q B u - P_h on the doubled grid.
   subroutine evaluate_traction(self, problem, height, level, history)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: level
      real(dp), intent(in), optional :: history(:, :)
      real(dp), allocatable :: row(:)
      real(dp) :: form
      logical :: remembers
      integer :: j

      remembers = present(history)
      !$omp parallel default(none) shared(self, problem, height, level) private(j, row) &
      !$omp num_threads(self%stiffness%threads)
      allocate (row(self%mx))
      !$omp do
      do j = 1, self%my
         row(:) = self%state(:, j)
         if (j <= self%ny) row(1:self%nx) = row(1:self%nx) + (height(:, j) - problem%datum) + level
         call self%stiffness%forward_row(1, j, row)
      end do
      !$omp end do
      !$omp end parallel
      call self%stiffness%columns(columns_apply, form)
      !$omp parallel do default(none) shared(self, problem, history, remembers) private(j) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, self%my
         call self%stiffness%backward_row(1, j, self%traction(:, j))
         self%traction(:, j) = problem%modulus*self%traction(:, j)
         if (remembers .and. j <= self%ny) &
            self%traction(1:self%nx, j) = self%traction(1:self%nx, j) - history(:, j)
      end do
   end subroutine evaluate_traction

   !> The natural residual, and r = -G on the free cells and in the padding, handed to M.
   subroutine evaluate_gradient(self, problem, length, scale, force, natural, missing, psi_r, &
      least, attraction)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: length, scale            !! units of the residual, m and Pa
      real(dp), intent(in) :: force                    !! prescribed sum of P, Pa
      real(dp), intent(out) :: natural
      real(dp), intent(out) :: missing                 !! force - sum of P; 0 at prescribed level
      real(dp), intent(out) :: psi_r                   !! psi.r of the padding
      real(dp), intent(out) :: least                   !! least gap, m
      real(dp), intent(out) :: attraction              !! sum of e'(g), Pa
      real(dp) :: g, r, e1, worst, lowest, load, pad, pull
      integer :: i, j, inner

      !$omp parallel do default(none) shared(self, problem, length, scale) &
      !$omp private(i, j, inner, g, r, e1, worst, lowest, load, pad, pull) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, self%my
         inner = merge(self%nx, 0, j <= self%ny)
         worst = 0.0_dp
         lowest = huge(1.0_dp)
         load = 0.0_dp
         pad = 0.0_dp
         pull = 0.0_dp
         do i = 1, inner
            e1 = adhesive_slope(problem%potential, self%state(i, j))
            g = self%traction(i, j) + e1
            load = load + self%traction(i, j)
            pull = pull + e1
            worst = max(worst, abs(min(self%state(i, j)/length, g/scale)))
            lowest = min(lowest, self%state(i, j))
            r = 0.0_dp
            if (self%state(i, j) > 0.0_dp .or. g < 0.0_dp) r = -g
            self%old(i, j) = self%residual(i, j)
            self%residual(i, j) = r
            if (self%scaling > 0.0_dp) &
               r = r*diagonal_scaling(problem, self%state(i, j), self%scaling)
            self%gradient(i, j) = r
         end do
         do i = inner + 1, self%mx
            r = -self%traction(i, j)
            worst = max(worst, abs(r)/scale)
            pad = pad + self%psi(i, j)*r
            self%old(i, j) = self%residual(i, j)
            self%residual(i, j) = r
            self%gradient(i, j) = r
         end do
         self%rows(1:5, j) = [worst, lowest, load, pad, pull]
         call self%preconditioner%put_row(j, self%gradient(:, j))
      end do
      natural = global_max(maxval(self%rows(1, :)))
      least = global_min(minval(self%rows(2, :)))
      missing = 0.0_dp
      if (problem%control == control_pressure) then
         missing = force - row_total(self%rows, 3)
         natural = max(natural, abs(missing)/max(abs(force), scale))
      end if
      psi_r = row_total(self%rows, 4)
      attraction = row_total(self%rows, 5)
   end subroutine evaluate_gradient

   !> z = M r on the free cells and in the padding, there with the mode of the level.
   subroutine precondition(self, problem, zd, rz, rz_old)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: zd                       !! z of the level
      real(dp), intent(out) :: rz                      !! r.z
      real(dp), intent(out) :: rz_old                  !! z.(residual of the iteration before)
      real(dp), allocatable :: z(:)
      real(dp) :: s1, s2
      integer :: i, j, inner

      !$omp parallel default(none) shared(self, problem, zd) private(i, j, inner, z, s1, s2) &
      !$omp num_threads(self%stiffness%threads)
      allocate (z(self%mx))
      !$omp do
      do j = 1, self%my
         inner = merge(self%nx, 0, j <= self%ny)
         call self%preconditioner%get_row(j, self%gradient(:, j), z)
         s1 = 0.0_dp
         s2 = 0.0_dp
         do i = 1, self%mx
            z(i) = z(i)/problem%modulus
            if (i > inner) then
               z(i) = z(i) + zd*self%psi(i, j)
            else
               if (self%scaling > 0.0_dp) &
                  z(i) = z(i)*diagonal_scaling(problem, self%state(i, j), self%scaling)
               if (.not. self%state(i, j) > 0.0_dp) then
                  z(i) = merge(max(z(i), 0.0_dp), 0.0_dp, self%residual(i, j) > 0.0_dp)
               end if
            end if
            s1 = s1 + z(i)*self%residual(i, j)
            s2 = s2 + z(i)*self%old(i, j)
            self%gradient(i, j) = z(i)
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = s2
      end do
      !$omp end do
      !$omp end parallel
      rz = row_total(self%rows, 1)
      rz_old = row_total(self%rows, 2)
   end subroutine precondition

   !> d = z + beta d on the free cells and in the padding, 0 elsewhere; the level's alike.
   subroutine new_direction(self, beta, zd, dd, rd, squares)
      type(adhesion_free_type), intent(inout) :: self
      real(dp), intent(in) :: beta, zd
      real(dp), intent(inout) :: dd                    !! d of the level
      real(dp), intent(out) :: rd                      !! r.d without the level's part
      real(dp), intent(out) :: squares                 !! of the change of u along d
      real(dp), allocatable :: change(:)
      real(dp) :: s1, d
      integer :: i, j, inner

      dd = zd + beta*dd
      !$omp parallel default(none) shared(self, beta, dd) private(i, j, inner, s1, d, change) &
      !$omp num_threads(self%stiffness%threads)
      allocate (change(self%mx))
      !$omp do
      do j = 1, self%my
         inner = merge(self%nx, 0, j <= self%ny)
         s1 = 0.0_dp
         do i = 1, self%mx
            d = self%gradient(i, j) + beta*self%direction(i, j)
            if (i <= inner) then
               if (.not. (self%state(i, j) > 0.0_dp .or. self%gradient(i, j) > 0.0_dp)) d = 0.0_dp
            end if
            s1 = s1 + self%residual(i, j)*d
            self%direction(i, j) = d
            change(i) = merge(d + dd, d, i <= inner)
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = sum(change**2)
         call self%preconditioner%put_estimate_row(j, change)
      end do
      !$omp end do
      !$omp end parallel
      rd = row_total(self%rows, 1)
      squares = row_total(self%rows, 2)
   end subroutine new_direction

   !> The clipped step s; the change of u with it, transformed along the rows.
   subroutine form_step(self, problem, alpha, dd, known, squares)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha, dd
      type(step_sums_type), intent(out) :: known       !! slope without the level's part
      real(dp), intent(out) :: squares                 !! of the change of u
      real(dp), allocatable :: change(:)
      integer :: i, j, inner

      !$omp parallel default(none) shared(self, problem, alpha, dd) private(i, j, inner, change) &
      !$omp num_threads(self%stiffness%threads)
      allocate (change(self%mx))
      !$omp do
      do j = 1, self%my
         inner = merge(self%nx, 0, j <= self%ny)
         call form_step_row(problem, self%state(1:inner, j), self%direction(1:inner, j), &
            self%residual(1:inner, j), alpha, 0.0_dp, change(1:inner), self%rows(1:6, j))
         change(1:inner) = change(1:inner) + alpha*dd
         do i = inner + 1, self%mx
            change(i) = alpha*self%direction(i, j)
            self%rows(1, j) = self%rows(1, j) - self%residual(i, j)*change(i)
         end do
         self%rows(7, j) = sum(change**2)
         call self%stiffness%forward_row(1, j, change)
         call self%preconditioner%put_estimate_row(j, change)
      end do
      !$omp end do
      !$omp end parallel
      call collect_step(self%rows, known)
      squares = row_total(self%rows, 7)
   end subroutine form_step

   !> g = g + t s, u in the padding, and the traction with them.
   subroutine take_step(self, problem, alpha, t)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha, t
      real(dp), allocatable :: product(:)
      real(dp) :: next
      integer :: i, j, inner

      !$omp parallel default(none) shared(self, problem, alpha, t) &
      !$omp private(i, j, inner, product, next) num_threads(self%stiffness%threads)
      allocate (product(self%mx))
      !$omp do
      do j = 1, self%my
         inner = merge(self%nx, 0, j <= self%ny)
         call self%stiffness%backward_row(1, j, product)
         do i = 1, self%mx
            self%traction(i, j) = self%traction(i, j) + t*problem%modulus*product(i)
            if (i <= inner) then
               next = stepped_gap(self%state(i, j), self%direction(i, j), alpha, 0.0_dp)
               if (t /= 1.0_dp) &
                  next = max(self%state(i, j) + t*(next - self%state(i, j)), 0.0_dp)
               self%state(i, j) = next
            else
               self%state(i, j) = self%state(i, j) + t*alpha*self%direction(i, j)
            end if
         end do
      end do
      !$omp end do
      !$omp end parallel
   end subroutine take_step

   !> The natural residual with the displacement of the patch's pressure by the true free operator.
   function true_residual(self, problem, height, level, length, scale, force, history) &
      result(natural)
      type(adhesion_free_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: level, length, scale, force
      real(dp), intent(in), optional :: history(:, :)
      real(dp) :: natural
      real(dp), allocatable :: row(:)
      real(dp) :: g, form, worst
      logical :: remembers
      integer :: i, j

      remembers = present(history)
      !$omp parallel default(none) shared(self, history, remembers) private(j, row) &
      !$omp num_threads(self%operator%threads)
      allocate (row(self%nx))
      !$omp do
      do j = 1, self%ny
         row(:) = self%traction(1:self%nx, j)
         if (remembers) row(:) = row + history(:, j)
         call self%operator%forward_row(1, j, row)
      end do
      !$omp end do
      !$omp end parallel
      call self%operator%columns(columns_apply, form)
      !$omp parallel default(none) shared(self, problem, height, level, length, scale) &
      !$omp private(i, j, g, worst, row) num_threads(self%operator%threads)
      allocate (row(self%nx))
      !$omp do
      do j = 1, self%ny
         call self%operator%backward_row(1, j, row)
         worst = 0.0_dp
         do i = 1, self%nx
            g = row(i)/problem%modulus - (height(i, j) - problem%datum) - level
            worst = max(worst, abs(min(g/length, (self%traction(i, j) &
               + adhesive_slope(problem%potential, max(g, 0.0_dp)))/scale)))
         end do
         self%rows(1, j) = worst
         self%rows(2, j) = sum(self%traction(1:self%nx, j))
      end do
      !$omp end do
      !$omp end parallel
      natural = global_max(maxval(self%rows(1, 1:self%ny)))
      if (problem%control == control_pressure) &
         natural = max(natural, abs(row_total(self%rows(:, 1:self%ny), 2) - force) &
         /max(abs(force), scale))
   end function true_residual

   !> Gap and pressure of the patch; the sums of P of its rows, 0 in the padding.
   subroutine hand_out(self, gap, pressure)
      type(adhesion_free_type), intent(inout) :: self
      real(dp), intent(inout) :: gap(:, :), pressure(:, :)
      integer :: j

      self%rows(1, :) = 0.0_dp
      do j = 1, self%ny
         gap(:, j) = self%state(1:self%nx, j)
         pressure(:, j) = self%traction(1:self%nx, j)
         self%rows(1, j) = sum(pressure(:, j))
      end do
   end subroutine hand_out

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_free_type), intent(inout) :: self

      call self%stiffness%destroy()
      call self%operator%destroy()
      call self%preconditioner%destroy()
      if (allocated(self%state)) deallocate (self%state, self%traction, self%gradient, &
         self%residual, self%direction, self%old, self%psi, self%rows)
   end subroutine destroy

end module adhesion_cg_free
