!> Adhesive contact in periodic mode: the gap g >= 0 that minimises the energy E(g).
!>
!> (Module adhesion_state has the equations; thesis, 2.3.) The gap, not the pressure, is the unknown,
!> so that the adhesive traction is exact in every residual. Preconditioned, bound-constrained nonlinear
!> conjugate gradients (Polak-Ribiere, never negative):
!> * M ~ 1/(|q| + c), as a whole or by its low wave numbers only (module adhesion_preconditioner);
!> * the step length along d is predicted from a coarse estimate of d.B d, gaps are closed on the way,
!>   and the clipped step s is transformed: s.B s is then exact, and so is the energy along s. Two
!>   transforms an iteration, and the energy never rises;
!> * mean gap prescribed: p is the mean multiplier over g > 0, and the step keeps the sum of g;
!> * Gauss: M is scaled from both sides by (1 + max(e'', 0)/k)^(-1/2), k = 0.02 Q B at the Nyquist wave
!>   number: near contact that potential is stiffer than the solid.
!>
!> The start is part of the problem: the energy has several minima where the attraction is strong, and
!> the one near the start is found. Under a negative prescribed pressure there may be none: once all
!> gaps are so wide that the attraction, falling with the gap, no longer balances the pull anywhere, the
!> reason is 'detached'.
!>
!> Fields of doubles: H, g, P, and the work fields gradient, residual, direction, old residual; the
!> spectrum of B and with 'full' of M.
module adhesion_cg_periodic
   use adhesion_potential, only : potential_gauss
   use adhesion_periodic_state, only : evaluate_load, evaluate_traction, field_sum, finish, &
      is_detached, residual_units, start_gap
   use adhesion_preconditioner, only : adhesion_preconditioner_type, new_adhesion_preconditioner
   use adhesion_state, only : adhesion_problem_type, choose_step, clipped_step, close_gaps, &
      collect_step, control_approach, control_pressure, diagonal_scaling, form_step_row, reason_closed, &
      reason_converged, reason_detached, reason_limit, reason_stalled, row_total, step_sums_type, &
      stepped_gap, sum_shift
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : columns_apply, convolution_type, new_symbol_operator
   use omp_lib, only : omp_get_wtime
   use asperity_parallel, only : global_max, global_min
   use asperity_precision, only : dp, int64, pi
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_periodic_type, new_adhesion_periodic

   integer, parameter :: refresh = 40          !! iterations between fresh products with B
   real(dp), parameter :: descent = 0.2_dp     !! of the slope along d, what clipping must leave

   !> The solver with its operators and work fields, kept from step to step. Not to be copied.
   type :: adhesion_periodic_type
      type(grid_type) :: grid
      type(convolution_type) :: stiffness                  !! B for G = 1
      type(adhesion_preconditioner_type) :: preconditioner
      real(dp) :: nyquist = 0.0_dp                         !! B at the Nyquist wave number
      real(dp) :: longest = 0.0_dp                         !! B at the least wave number
      real(dp), allocatable, private :: gradient(:, :)     !! G less p; then z = M r
      real(dp), allocatable, private :: residual(:, :)     !! -G where free
      real(dp), allocatable, private :: direction(:, :)    !! d
      real(dp), allocatable, private :: old(:, :)          !! residual of the iteration before
      real(dp), allocatable, private :: rows(:, :)         !! partial sums of each row
      logical, private :: scaled = .false.                 !! Gauss: M scaled by e''
      real(dp), private :: scaling = 0.0_dp                !! k of that scaling, Pa/m
      real(dp), private :: old_rz = 0.0_dp                 !! r.z of the iteration before; 0: start anew
      real(dp), private :: kappa = 1.0_dp                  !! last form of a step over its estimate
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_periodic_type

contains

   !> Make a solver for a periodic grid.
   subroutine new_adhesion_periodic(self, grid, poisson, preconditioner, error)
      type(adhesion_periodic_type), intent(out) :: self
      type(grid_type), intent(in) :: grid                  !! periodic
      real(dp), intent(in) :: poisson
      character(*), intent(in) :: preconditioner           !! 'coarse' or 'full'
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stiffness(:, :), inverse(:, :)
      real(dp) :: b, q, q_least, q_most
      integer :: i, j

      if (grid%boundary /= boundary_periodic) then
         call fail(error, error_input, 'adhesion_cg_periodic: boundary: must be periodic')
         return
      end if
      self%grid = grid
      b = 1.0_dp/(1.0_dp - poisson)
      q_most = pi/grid%dx
      if (grid%ny > 1) q_most = pi/sqrt(grid%dx*grid%dy)
      q_least = 2.0_dp*pi/grid%lx
      if (grid%ny > 1) q_least = min(q_least, 2.0_dp*pi/grid%ly)
      self%nyquist = b*q_most
      self%longest = b*q_least
      allocate (stiffness(0:grid%nx/2, 0:grid%ny/2), inverse(0:grid%nx/2, 0:grid%ny/2))
      do j = 0, grid%ny/2
         do i = 0, grid%nx/2
            q = 2.0_dp*pi*hypot(i/grid%lx, j/grid%ly)
            stiffness(i, j) = b*q
            inverse(i, j) = 1.0_dp/(b*(q + q_least))
         end do
      end do
      call new_symbol_operator(self%stiffness, grid%nx, grid%ny, stiffness, error)
      if (allocated(error)) return
      call new_adhesion_preconditioner(self%preconditioner, preconditioner, grid%nx, grid%ny, &
         inverse, stiffness, 1.4_dp/self%nyquist, 0.5_dp*self%nyquist, error)
      if (allocated(error)) return
      allocate (self%gradient(grid%nx, grid%ny), self%residual(grid%nx, grid%ny), &
         self%direction(grid%nx, grid%ny), self%old(grid%nx, grid%ny), source=0.0_dp)
      allocate (self%rows(7, grid%ny))
   end subroutine new_adhesion_periodic

   !> Solve an adhesive contact problem.
   !>
   !> Not converging is an outcome: the state reached, lowest in energy so far, is handed out.
   subroutine solve(self, problem, height, gap, pressure, level, outcome, history)
      class(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)             !! H, [nx, ny], m
      real(dp), intent(inout) :: gap(:, :)             !! g, m: the start, then the solution
      real(dp), intent(inout) :: pressure(:, :)        !! P, attraction included, Pa
      real(dp), intent(out) :: level                   !! U - H where the gap is zero, m
      type(solver_result_type), intent(out) :: outcome
      real(dp), intent(in), optional :: history(:, :)  !! P_h, Pa; its mean does not matter
      real(dp) :: load, total, mean_height, scale, length, least, alpha, shift, t, cells
      real(dp) :: transforms_before
      integer(int64) :: before
      integer :: age, failures
      logical :: fresh

      outcome%seconds = omp_get_wtime()
      before = self%stiffness%ffts
      transforms_before = self%preconditioner%transforms()
      cells = real(self%grid%nx, dp)*self%grid%ny
      mean_height = field_sum(self%stiffness, self%rows, height)/cells - problem%datum
      load = 0.0_dp
      if (problem%control == control_pressure) load = problem%target
      total = -cells*(problem%target + mean_height)
      outcome%reason = reason_limit
      if (problem%control == control_approach .and. .not. total > 0.0_dp) then
         outcome%reason = reason_closed
         level = problem%target
         outcome%seconds = omp_get_wtime() - outcome%seconds
         return
      end if
      self%scaled = problem%potential%kind == potential_gauss
      self%scaling = 0.02_dp*problem%modulus*self%nyquist
      self%direction = 0.0_dp
      self%residual = 0.0_dp
      if (problem%full_contact) gap(:, :) = 0.0_dp
      call start_gap(self%stiffness, self%rows, problem, total, gap)
      call evaluate_traction(self%stiffness, self%rows, problem, height, gap, pressure, &
         history)
      fresh = .true.
      age = 0
      failures = 0
      self%kappa = 1.0_dp
      self%old_rz = 0.0_dp
      call residual_units(self%stiffness, self%rows, problem, height, pressure, load, self%longest, &
         length, scale)
      do
         call evaluate_gradient(self, problem, gap, pressure, length, scale, load, &
            outcome%residual, least)
         if (outcome%residual <= problem%tolerance) then
            if (fresh) then
               outcome%converged = .true.
               outcome%reason = reason_converged
               exit
            end if
            call evaluate_traction(self%stiffness, self%rows, problem, height, gap, pressure, &
               history)
            fresh = .true.
            age = 0
            cycle
         end if
         if (is_detached(problem, load, least)) then
            outcome%reason = reason_detached
            exit
         end if
         if (outcome%iterations >= problem%max_iterations) exit
         outcome%iterations = outcome%iterations + 1

         call search(self, problem, gap, total, alpha, shift, t)
         if (t > 0.0_dp) then
            call take_step(self, problem, alpha, shift, t, gap, pressure)
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
            call evaluate_traction(self%stiffness, self%rows, problem, height, gap, pressure, &
               history)
            fresh = .true.
            age = 0
         end if
      end do
      if (.not. fresh) then
         call evaluate_traction(self%stiffness, self%rows, problem, height, gap, pressure, &
            history)
         call evaluate_gradient(self, problem, gap, pressure, length, scale, load, &
            outcome%residual, least)
      end if
      if (outcome%reason /= reason_detached .and. outcome%residual <= problem%tolerance) then
         outcome%converged = .true.
         outcome%reason = reason_converged
      end if
      call finish(self%stiffness, self%rows, problem, load, total, gap, pressure, outcome)
      level = -mean_height - field_sum(self%stiffness, self%rows, gap)/cells
      call close_gaps(problem, length, scale, self%stiffness%threads, gap, pressure)
      outcome%ffts = self%stiffness%ffts - before &
         + nint(self%preconditioner%transforms() - transforms_before, int64)
      outcome%seconds = omp_get_wtime() - outcome%seconds
   end subroutine solve

   !> The direction d from the residual, the clipped step along it, and how far to go along that step.
   subroutine search(self, problem, gap, total, alpha, shift, t)
      type(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: total                    !! prescribed sum of the gap, m
      real(dp), intent(out) :: alpha, shift            !! the step: stepped_gap(g, d, alpha, shift) - g
      real(dp), intent(out) :: t                       !! part of it that is taken; 0: none
      type(step_sums_type) :: known
      real(dp) :: rz, rz_old, rd, squares, estimate, estimate_after, beta
      integer :: pass

      alpha = 0.0_dp
      shift = 0.0_dp
      t = 0.0_dp
      call self%preconditioner%transform()
      call precondition(self, problem, gap, rz, rz_old)
      beta = 0.0_dp
      if (self%old_rz > 0.0_dp) beta = max(0.0_dp, (rz - rz_old)/self%old_rz)
      self%old_rz = rz
      call new_direction(self, gap, beta, rd, squares)
      if (rd <= 0.0_dp .and. beta > 0.0_dp) call new_direction(self, gap, 0.0_dp, rd, squares)
      if (.not. rd > 0.0_dp) return

      estimate = problem%modulus*self%kappa*self%preconditioner%estimate(squares)
      alpha = clipped_step(problem, gap, self%direction, -rd, estimate, self%rows, &
         self%stiffness%threads)
      do pass = 1, 40
         if (problem%control == control_approach) shift = sum_shift(gap, self%direction, alpha, &
            total, self%rows, self%stiffness%threads)
         call form_step(self, problem, gap, alpha, shift, known, squares)
         if (known%slope <= -descent*alpha*rd) exit
         alpha = 0.25_dp*alpha
      end do
      call self%stiffness%columns(columns_apply, known%form)
      estimate_after = self%preconditioner%estimate(squares)
      if (estimate_after > 0.0_dp) self%kappa = known%form/estimate_after
      known%form = problem%modulus*known%form
      t = choose_step(known, problem, gap, self%direction, alpha, shift, self%rows, &
         self%stiffness%threads)
   end subroutine search

   !> The gradient less the load, the load (multiplier) where the approach is prescribed, the natural
   !> residual, and the residual r = -G on the free cells, handed to the preconditioner.
   subroutine evaluate_gradient(self, problem, gap, traction, length, scale, load, natural, least)
      type(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :), traction(:, :)
      real(dp), intent(in) :: length, scale            !! units of the natural residual, m and Pa
      real(dp), intent(inout) :: load                  !! p, Pa
      real(dp), intent(out) :: natural                 !! max|min(g/length, G/scale)|
      real(dp), intent(out) :: least                   !! least gap, m
      real(dp) :: g, r, worst, lowest
      integer :: i, j

      call evaluate_load(self%stiffness%threads, self%rows, problem, gap, traction, self%gradient, &
         load)

      !$omp parallel do default(none) shared(self, problem, gap, length, scale, load) &
      !$omp private(i, j, g, r, worst, lowest) num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         worst = 0.0_dp
         lowest = huge(1.0_dp)
         do i = 1, size(gap, 1)
            g = self%gradient(i, j) + load
            worst = max(worst, abs(min(gap(i, j)/length, g/scale)))
            lowest = min(lowest, gap(i, j))
            r = 0.0_dp
            if (gap(i, j) > 0.0_dp .or. g < 0.0_dp) r = -g
            self%old(i, j) = self%residual(i, j)
            self%residual(i, j) = r
            if (self%scaled) r = r*diagonal_scaling(problem, gap(i, j), self%scaling)
            self%gradient(i, j) = r
         end do
         self%rows(1, j) = worst
         self%rows(2, j) = lowest
         call self%preconditioner%put_row(j, self%gradient(:, j))
      end do
      natural = global_max(maxval(self%rows(1, :)))
      least = global_min(minval(self%rows(2, :)))
   end subroutine evaluate_gradient

   !> z = M r on the free cells, without those in contact that it would close; z in `gradient`.
   subroutine precondition(self, problem, gap, rz, rz_old)
      type(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(out) :: rz                      !! r.z
      real(dp), intent(out) :: rz_old                  !! z.(residual of the iteration before)
      real(dp), allocatable :: z(:)
      real(dp) :: mean, s1, s2
      integer :: i, j, n, pass

      !$omp parallel default(none) shared(self, problem, gap) private(i, j, z, s1, n) &
      !$omp num_threads(self%stiffness%threads)
      allocate (z(size(gap, 1)))
      !$omp do
      do j = 1, size(gap, 2)
         call self%preconditioner%get_row(j, self%gradient(:, j), z)
         s1 = 0.0_dp
         n = 0
         do i = 1, size(gap, 1)
            if (gap(i, j) > 0.0_dp .or. self%residual(i, j) > 0.0_dp) then
               if (self%scaled) z(i) = z(i)*diagonal_scaling(problem, gap(i, j), self%scaling)
               s1 = s1 + z(i)
               n = n + 1
            else
               z(i) = 0.0_dp
            end if
            self%gradient(i, j) = z(i)
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = real(n, dp)
      end do
      !$omp end do
      !$omp end parallel

      do pass = 1, 2
         mean = 0.0_dp
         if (problem%control == control_approach) &
            mean = row_total(self%rows, 1)/max(row_total(self%rows, 2), 1.0_dp)
         !$omp parallel do default(none) shared(self, gap, mean, pass) private(i, j, s1, s2, n) &
         !$omp num_threads(self%stiffness%threads)
         do j = 1, size(gap, 2)
            s1 = 0.0_dp
            s2 = 0.0_dp
            n = 0
            do i = 1, size(gap, 1)
               if (gap(i, j) > 0.0_dp) then
                  self%gradient(i, j) = self%gradient(i, j) - mean
               else if (pass == 1 .and. self%residual(i, j) > 0.0_dp) then
                  self%gradient(i, j) = max(self%gradient(i, j) - mean, 0.0_dp)
               else if (self%gradient(i, j) > 0.0_dp) then
                  self%gradient(i, j) = max(self%gradient(i, j) - mean, 0.0_dp)
               end if
               if (gap(i, j) > 0.0_dp .or. self%gradient(i, j) > 0.0_dp) n = n + 1
               if (pass == 1) then
                  s1 = s1 + self%gradient(i, j)
               else
                  s1 = s1 + self%gradient(i, j)*self%residual(i, j)
                  s2 = s2 + self%gradient(i, j)*self%old(i, j)
               end if
            end do
            self%rows(1, j) = s1
            self%rows(2, j) = merge(real(n, dp), s2, pass == 1)
         end do
      end do
      rz = row_total(self%rows, 1)
      rz_old = row_total(self%rows, 2)
   end subroutine precondition

   !> d = z + beta d on the free cells, 0 elsewhere.
   subroutine new_direction(self, gap, beta, rd, squares)
      type(adhesion_periodic_type), intent(inout) :: self
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: beta
      real(dp), intent(out) :: rd                      !! r.d
      real(dp), intent(out) :: squares                 !! d.d
      real(dp) :: s1, s2, d
      integer :: i, j

      !$omp parallel do default(none) shared(self, gap, beta) private(i, j, s1, s2, d) &
      !$omp num_threads(self%stiffness%threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         s2 = 0.0_dp
         do i = 1, size(gap, 1)
            d = 0.0_dp
            if (gap(i, j) > 0.0_dp .or. self%gradient(i, j) > 0.0_dp) &
               d = self%gradient(i, j) + beta*self%direction(i, j)
            s1 = s1 + self%residual(i, j)*d
            s2 = s2 + d*d
            self%direction(i, j) = d
         end do
         self%rows(1, j) = s1
         self%rows(2, j) = s2
         call self%preconditioner%put_estimate_row(j, self%direction(:, j))
      end do
      rd = row_total(self%rows, 1)
      squares = row_total(self%rows, 2)
   end subroutine new_direction

   !> s = the step along d, clipped; its transform along the rows, and what is known without B s.
   subroutine form_step(self, problem, gap, alpha, shift, known, squares)
      type(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(in) :: alpha, shift
      type(step_sums_type), intent(out) :: known
      real(dp), intent(out) :: squares                 !! s.s
      real(dp), allocatable :: s(:)
      integer :: j

      !$omp parallel default(none) shared(self, problem, gap, alpha, shift) private(j, s) &
      !$omp num_threads(self%stiffness%threads)
      allocate (s(size(gap, 1)))
      !$omp do
      do j = 1, size(gap, 2)
         call form_step_row(problem, gap(:, j), self%direction(:, j), self%residual(:, j), alpha, &
            shift, s, self%rows(1:6, j))
         self%rows(7, j) = sum(s**2)
         call self%stiffness%forward_row(1, j, s)
         call self%preconditioner%put_estimate_row(j, s)
      end do
      !$omp end do
      !$omp end parallel
      call collect_step(self%rows, known)
      squares = row_total(self%rows, 7)
   end subroutine form_step

   !> g = g + t s, and the traction with it.
   subroutine take_step(self, problem, alpha, shift, t, gap, traction)
      type(adhesion_periodic_type), intent(inout) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: alpha, shift, t
      real(dp), intent(inout) :: gap(:, :), traction(:, :)
      real(dp), allocatable :: product(:)
      real(dp) :: next
      integer :: i, j

      !$omp parallel default(none) shared(self, problem, alpha, shift, t, gap, traction) &
      !$omp private(i, j, product, next) num_threads(self%stiffness%threads)
      allocate (product(size(gap, 1)))
      !$omp do
      do j = 1, size(gap, 2)
         call self%stiffness%backward_row(1, j, product)
         do i = 1, size(gap, 1)
            traction(i, j) = traction(i, j) + t*problem%modulus*product(i)
            next = stepped_gap(gap(i, j), self%direction(i, j), alpha, shift)
            if (t /= 1.0_dp) next = max(gap(i, j) + t*(next - gap(i, j)), 0.0_dp)
            gap(i, j) = next
         end do
      end do
      !$omp end do
      !$omp end parallel
   end subroutine take_step

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_periodic_type), intent(inout) :: self

      call self%stiffness%destroy()
      call self%preconditioner%destroy()
      if (allocated(self%gradient)) &
         deallocate (self%gradient, self%residual, self%direction, self%old, self%rows)
   end subroutine destroy

end module adhesion_cg_periodic
