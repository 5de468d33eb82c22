!> The residual of the fast method for adhesive contact (module `adhesion_cg_fast`).
!>
!> `measure` computes r and the error from the present traction. In the same pass over the cells it updates the
!> traction of the model (module `adhesion_descent`).
module adhesion_residual
   use adhesion_patch, only : evaluate_gradient
   use adhesion_potential, only : adhesive_slopes
   use adhesion_state, only : control_approach, control_pressure
   use adhesion_sweeps, only : measure_cells, scale_cells
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_precision, only : dp
   use field_sums, only : largest_of_rows, least_of_rows
   implicit none
   private

   public :: measure

   !> Factor of errors in the padding. They count more because they are smooth and of one sign, and add up in energies.
   real(dp), parameter :: strictness = 10.0_dp

contains

   !> Compute the natural residual, the least gap, and r, which is passed to the preconditioner.
   subroutine measure(self, now)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), allocatable :: rows(:, :), spare(:, :)
      real(dp) :: worst, least, padding, sums(2)
      integer :: j

      if (self%patch%periodic .and. now%problem%control == control_approach) then
         if (abs(now%pending) > 0.0_dp) then
            !$omp parallel do default(none) shared(self, now) private(j) num_threads(self%patch%threads)
            do j = 1, self%patch%all_rows
               call add_product_row(self, now, j)
            end do
            now%pending = 0.0_dp
         end if
         call evaluate_gradient(self%patch, now, self%exchange)
      end if
      call move_alloc(self%old, spare)
      call move_alloc(self%residual, self%old)
      call move_alloc(spare, self%residual)
      allocate (rows(2, self%patch%all_rows))
      worst = 0.0_dp
      least = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, now, rows) private(j, padding) &
      !$omp reduction(max: worst) reduction(min: least) num_threads(self%patch%threads)
      do j = 1, self%patch%all_rows
         if (abs(now%pending) > 0.0_dp) call add_product_row(self, now, j)
         call measure_row(self, now, j, worst, least, padding)
         rows(:, j) = [padding, 0.0_dp]
         if (.not. self%patch%periodic) rows(2, j) = sum(now%traction(1:self%patch%inner(j), j))
      end do
      now%pending = 0.0_dp
      now%residual = largest_of_rows([worst])
      now%least = least_of_rows([least])
      if (self%patch%periodic) return
      sums = self%patch%sharing%totals(rows)
      now%psi_r = sums(1)
      if (now%problem%control /= control_pressure) return
      now%old_missing = now%missing
      now%missing = now%force - sums(2)
      now%residual = max(now%residual, abs(now%missing)/max(abs(now%force), now%units%traction))
   end subroutine measure

   !> Add the pending terms to a row of the traction of the model: a multiple of the product, and the product of the
   !> correction where gaps were closed, for which the stencil is sufficient (module `adhesion_descent`).
   subroutine add_product_row(self, now, j)
      type(adhesion_work_type), intent(in) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      integer, intent(in) :: j
      real(dp) :: correction(self%patch%mx)

      now%traction(:, j) = now%traction(:, j) + now%pending*self%image(:, j)
      if (.not. now%correction_pending) return
      if (.not. any(self%has_correction(self%model%around(j)))) return
      correction(:) = 0.0_dp
      call self%model%stencil_row(j, self%change, correction)
      now%traction(:, j) = now%traction(:, j) + now%problem%modulus*correction
   end subroutine add_product_row

   !> Compute a row of r and of the input of M from the rows of the gap and of the traction.
   subroutine measure_row(self, now, j, worst, least, padding)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      integer, intent(in) :: j
      real(dp), intent(inout) :: worst                 !! natural residual
      real(dp), intent(inout) :: least                 !! least gap, m
      real(dp), intent(out) :: padding                 !! psi.r of the padding, Pa
      real(dp) :: r, per_traction
      integer :: i, n

      n = self%patch%inner(j)
      per_traction = 1.0_dp/now%units%traction
      call adhesive_slopes(now%problem%potential, now%state(1:n, j), self%residual(1:n, j), self%curvature(1:n, j))
      call measure_cells(now%state(1:n, j), now%traction(1:n, j), now%load, 1.0_dp/now%units%length, per_traction, &
         self%residual(1:n, j), worst, least)
      padding = 0.0_dp
      do i = n + 1, self%patch%mx
         r = -now%traction(i, j)
         worst = max(worst, strictness*abs(r)*per_traction)
         padding = padding + self%patch%psi(i, j)*r
         self%residual(i, j) = r
      end do
      if (self%scaling > 0.0_dp) then
         self%exchange(:, j) = self%residual(:, j)
         call scale_cells(self%curvature(1:n, j), self%scaling, self%exchange(1:n, j))
         call self%model%put_row(j, self%exchange(:, j))
      else
         call self%model%put_row(j, self%residual(:, j))
      end if
   end subroutine measure_row

end module adhesion_residual
