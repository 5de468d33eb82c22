!> Adhesive contact by the method of the thesis (2.3.2, eq. 2.23 to 2.28), periodic mode.
!>
!> The method does conjugate gradients on the gap outside the contact, without preconditioner. The step alpha of eq. 2.26
!> and the factor beta of eq. 2.28 take the linearised adhesive traction into account; gaps that would be
!> negative are closed, and a point in contact is released if its pressure is below -e'(0+). Both
!> denominators can be negative or zero, and a step can raise the energy. In these cases beta is 0, alpha is
!> computed without the adhesive part, and steps that raise the energy are quartered. An iteration takes four
!> transforms, and two more for each quartered step. The method is kept for comparison; the fast method is module
!> `adhesion_cg_fast`, which has the same problem, units and measure of error.
!>
!> Memory, in fields of doubles: H, g, P, the spectrum of B, and the work fields residual, direction, product B d, trial
!> gap and trial traction.
module adhesion_cg_thesis
   use adhesion_method, only : adhesion_method_type
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type, evaluate_gradient, is_detached, &
      natural_residual, new_adhesion_patch
   use adhesion_potential, only : adhesive_energy, adhesive_terms
   use adhesion_start, only : begin_contact
   use adhesion_symbols, only : adhesion_symbols_type
   use adhesion_state, only : control_approach, reason_undetermined, reason_converged, reason_detached, reason_iterations, &
      reason_stalled
   use adhesion_steps, only : stepped_gap, sum_shift
   use asperity_errors, only : error_input, error_type, fail
   use field_sums, only : largest_of_rows, least_of_rows, row_total, row_totals
   use kernels, only : kernel_type
   use asperity_precision, only : dp, int64
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: adhesion_thesis_type, new_adhesion_thesis

   integer, parameter :: most_quarterings = 30   !! of a step that raises the energy
   integer, parameter :: most_failures = 2       !! successive directions without a step

   !> The solver with its operator and work fields. A variable of this type must not be copied.
   type, extends(adhesion_method_type) :: adhesion_thesis_type
      type(adhesion_patch_type), private :: patch
      real(dp), allocatable, private :: residual(:, :)         !! -G outside the contact
      real(dp), allocatable, private :: direction(:, :)        !! d
      real(dp), allocatable, private :: product(:, :)          !! Q B d
      real(dp), allocatable, private :: trial_gap(:, :)        !! after the step
      real(dp), allocatable, private :: trial_traction(:, :)   !! Q B(H + g) - P_h after the step
   contains
      procedure :: solve
      procedure :: destroy
   end type adhesion_thesis_type

contains

   !> Make a solver for a periodic grid.
   subroutine new_adhesion_thesis(self, grid, kernel, error)
      type(adhesion_thesis_type), intent(out) :: self
      type(grid_type), intent(in) :: grid                  !! periodic
      type(kernel_type), intent(in) :: kernel              !! normal response of the solid
      type(error_type), allocatable, intent(out) :: error
      type(adhesion_symbols_type) :: symbols

      if (grid%boundary /= boundary_periodic) then
         call fail(error, error_input, &
            "method = 'thesis': adhesion on a free grid: must be 'fast' there")
         return
      end if
      allocate (self%residual(grid%nx, grid%rows()), source=0.0_dp)
      allocate (self%direction, self%product, self%trial_gap, self%trial_traction, source=self%residual)
      call new_adhesion_patch(self%patch, grid, kernel, symbols, error)
   end subroutine new_adhesion_thesis

   !> Solve an adhesive contact problem.
   subroutine solve(self, contact, outcome)
      class(adhesion_thesis_type), intent(inout), target :: self
      type(adhesion_contact_type), intent(inout) :: contact
      type(solver_result_type), intent(out) :: outcome
      type(adhesion_contact_type) :: trial
      integer(int64) :: before

      if (self%patch%is_full_contact(contact%problem, contact%height)) then
         outcome%reason = reason_undetermined
         return
      end if
      before = self%patch%transforms()
      contact%state => contact%gap
      contact%traction => contact%pressure
      call begin_contact(self%patch, contact)
      trial = contact
      trial%state => self%trial_gap
      trial%traction => self%trial_traction
      call iterate(self, contact, trial, outcome)
      if (outcome%stopped) return

      call self%patch%return_solution(contact, outcome%load_error)
      outcome%ffts = self%patch%transforms() - before
   end subroutine solve

   !> Do the loop of the method: measure, choose the direction, find the step, and update.
   subroutine iterate(self, now, trial, outcome)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_contact_type), intent(inout) :: now
      type(adhesion_contact_type), intent(inout) :: trial      !! the contact after the step
      type(solver_result_type), intent(inout) :: outcome
      real(dp) :: alpha, beta, curvature, form, least, rd
      integer :: failures
      logical :: taken

      self%direction = 0.0_dp
      self%product = 0.0_dp
      curvature = 0.0_dp                                       ! d.(Q B + e'') d; 0: the next direction is r alone
      failures = 0
      outcome%reason = reason_iterations
      do
         call measure(self, now, outcome%residual, least)
         if (is_detached(self%patch, now, least)) outcome%reason = reason_detached
         if (failures > most_failures) outcome%reason = reason_stalled
         if (outcome%residual <= now%problem%tolerance) outcome%reason = reason_converged
         if (outcome%reason /= reason_iterations .or. outcome%iterations >= now%problem%max_iterations) exit
         outcome%stopped = stop_is_due()
         if (outcome%stopped) return
         outcome%iterations = outcome%iterations + 1

         beta = 0.0_dp
         if (curvature > 0.0_dp) beta = max(0.0_dp, -coupling(self, now)/curvature)
         call new_direction(self, now, beta, rd)
         if (rd <= 0.0_dp) call new_direction(self, now, 0.0_dp, rd)

         call multiply(self, now, form)
         curvature = form + adhesive_part(self, now)
         alpha = rd/form
         if (curvature > 0.0_dp) alpha = min(rd/curvature, 10.0_dp*rd/form)
         taken = .false.
         if (rd > 0.0_dp .and. form > 0.0_dp) call find_step(self, now, alpha, trial, taken)

         if (taken) call accept(self, now, trial)
         if (.not. taken) curvature = 0.0_dp
         failures = merge(0, failures + 1, taken)
      end do
      outcome%required = max(now%problem%tolerance, now%problem%accepted)
      if (outcome%reason /= reason_detached .and. outcome%residual <= outcome%required) &
         outcome%reason = reason_converged
      outcome%converged = outcome%reason == reason_converged
   end subroutine iterate

   !> Find the contact after the step, which is quartered until the energy does not rise.
   subroutine find_step(self, now, first, trial, taken)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp), intent(in) :: first                    !! length of the step that is tried first
      type(adhesion_contact_type), intent(inout) :: trial
      logical, intent(out) :: taken                    !! there is a step that does not raise the energy
      real(dp) :: alpha
      integer :: pass

      alpha = first
      do pass = 1, most_quarterings
         call try_step(self, now, alpha, trial)
         call self%patch%evaluate_traction(trial)
         taken = falls(self, now, trial)
         if (taken) exit
         alpha = 0.25_dp*alpha
      end do
   end subroutine find_step

   !> Compute r = -G outside the contact and at the points that it releases (eq. 2.25), the natural residual and the
   !> least gap.
   subroutine measure(self, now, natural, least)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_contact_type), intent(inout) :: now
      real(dp), intent(out) :: natural, least
      real(dp) :: g, worst, lowest
      integer :: i, j

      call evaluate_gradient(self%patch, now, self%residual)
      worst = 0.0_dp
      lowest = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, now) private(i, j, g) &
      !$omp reduction(max: worst) reduction(min: lowest) num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         do i = 1, self%patch%nx
            g = self%residual(i, j) + now%load
            worst = max(worst, natural_residual(now%units, now%state(i, j), g))
            lowest = min(lowest, now%state(i, j))
            self%residual(i, j) = merge(-g, 0.0_dp, now%state(i, j) > 0.0_dp .or. g < 0.0_dp)
         end do
      end do
      natural = largest_of_rows([worst])
      least = least_of_rows([lowest])
   end subroutine measure

   !> r.(Q B + e'') d, the numerator of eq. 2.28.
   function coupling(self, now) result(total)
      type(adhesion_thesis_type), intent(in) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp) :: total
      real(dp) :: rows(self%patch%rows)
      integer :: j

      !$omp parallel do default(none) shared(self, now, rows) private(j) num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         rows(j) = sum(self%residual(:, j)*(self%product(:, j) + curvatures(now, j)*self%direction(:, j)))
      end do
      total = row_total(rows)
   end function coupling

   !> d.e'' d (eq. 2.27).
   function adhesive_part(self, now) result(total)
      type(adhesion_thesis_type), intent(in) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp) :: total
      real(dp) :: rows(self%patch%rows)
      integer :: j

      !$omp parallel do default(none) shared(self, now, rows) private(j) num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         rows(j) = sum(curvatures(now, j)*self%direction(:, j)**2)
      end do
      total = row_total(rows)
   end function adhesive_part

   !> e'' in a row of cells, Pa/m.
   pure function curvatures(now, j) result(row)
      type(adhesion_contact_type), intent(in) :: now
      integer, intent(in) :: j                         !! the row
      real(dp) :: row(size(now%state, 1)), e, e1
      integer :: i

      do i = 1, size(row)
         call adhesive_terms(now%problem%potential, now%state(i, j), e, e1, row(i))
      end do
   end function curvatures

   !> Compute d = r + beta d outside the contact, whose sum is zero if the level is prescribed, and r.d.
   subroutine new_direction(self, now, beta, rd)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp), intent(in) :: beta
      real(dp), intent(out) :: rd
      real(dp), allocatable :: rows(:, :), products(:)
      real(dp) :: mean, sums(2)
      logical :: free
      integer :: i, j

      allocate (rows(2, self%patch%rows), products(self%patch%rows), source=0.0_dp)
      !$omp parallel do default(none) shared(self, now, beta, rows) private(i, j, free) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         do i = 1, self%patch%nx
            free = now%state(i, j) > 0.0_dp .or. self%residual(i, j) > 0.0_dp
            self%direction(i, j) = merge(self%residual(i, j) + beta*self%direction(i, j), 0.0_dp, free)
            rows(1, j) = rows(1, j) + self%direction(i, j)
            if (free) rows(2, j) = rows(2, j) + 1.0_dp
         end do
      end do
      mean = 0.0_dp
      if (now%problem%control == control_approach) then
         sums = row_totals(rows)
         mean = sums(1)/max(sums(2), 1.0_dp)
      end if
      !$omp parallel do default(none) shared(self, now, mean, products) private(i, j) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         do i = 1, self%patch%nx
            if (now%state(i, j) > 0.0_dp) then
               self%direction(i, j) = self%direction(i, j) - mean
            else if (self%residual(i, j) > 0.0_dp) then
               self%direction(i, j) = max(self%direction(i, j) - mean, 0.0_dp)
            end if
            products(j) = products(j) + self%residual(i, j)*self%direction(i, j)
         end do
      end do
      rd = row_total(products)
   end subroutine new_direction

   !> Compute Q B d and d.Q B d.
   subroutine multiply(self, now, form)
      type(adhesion_thesis_type), intent(inout) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp), intent(out) :: form
      integer :: j

      call self%patch%stiffness%apply(self%direction, self%product, form)
      form = now%problem%modulus*form
      !$omp parallel do default(none) shared(self, now) private(j) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         self%product(:, j) = now%problem%modulus*self%product(:, j)
      end do
   end subroutine multiply

   !> Compute the gap after a step, which is set to 0 where it would be negative.
   subroutine try_step(self, now, alpha, trial)
      type(adhesion_thesis_type), intent(in) :: self
      type(adhesion_contact_type), intent(in) :: now
      real(dp), intent(in) :: alpha
      type(adhesion_contact_type), intent(inout) :: trial
      real(dp) :: shift
      integer :: j

      shift = 0.0_dp
      if (now%problem%control == control_approach) &
         shift = sum_shift(now%state, self%direction, alpha, now%gap_sum, self%patch%threads)
      !$omp parallel do default(none) shared(self, now, trial, alpha, shift) private(j) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         trial%state(:, j) = stepped_gap(now%state(:, j), self%direction(:, j), alpha, shift)
      end do
   end subroutine try_step

   !> Does the trial step not raise the energy beyond round-off?
   function falls(self, now, trial) result(yes)
      type(adhesion_thesis_type), intent(in) :: self
      type(adhesion_contact_type), intent(in) :: now, trial
      logical :: yes
      real(dp), allocatable :: rows(:, :)
      real(dp) :: s, before, sums(2)
      integer :: i, j

      allocate (rows(2, self%patch%rows), source=0.0_dp)
      !$omp parallel do default(none) shared(self, now, trial, rows) private(i, j, s, before) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         do i = 1, self%patch%nx
            s = trial%state(i, j) - now%state(i, j)
            before = adhesive_energy(now%problem%potential, now%state(i, j))
            rows(1, j) = rows(1, j) + s*(0.5_dp*(now%traction(i, j) + trial%traction(i, j)) + now%load) &
               + adhesive_energy(now%problem%potential, trial%state(i, j)) - before
            rows(2, j) = rows(2, j) + abs(before)
         end do
      end do
      sums = row_totals(rows)
      yes = sums(1) <= 4.0_dp*epsilon(1.0_dp)*sums(2)
   end function falls

   !> Make the trial contact the contact.
   subroutine accept(self, now, trial)
      type(adhesion_thesis_type), intent(in) :: self
      type(adhesion_contact_type), intent(inout) :: now
      type(adhesion_contact_type), intent(in) :: trial
      integer :: j

      !$omp parallel do default(none) shared(self, now, trial) private(j) num_threads(self%patch%threads)
      do j = 1, self%patch%rows
         now%state(:, j) = trial%state(:, j)
         now%traction(:, j) = trial%traction(:, j)
      end do
   end subroutine accept

   !> Free plans.
   subroutine destroy(self)
      class(adhesion_thesis_type), intent(inout) :: self

      call self%patch%destroy()
   end subroutine destroy

end module adhesion_cg_thesis
