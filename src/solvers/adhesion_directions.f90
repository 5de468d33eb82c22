!> Residuals and directions of the fast method for adhesive contact (module adhesion_cg_fast).
!>
!> The work fields of the method, where its iteration stands, and the first two parts of an iteration:
!> `measure` finds r and the error from the traction at hand, `find_direction` the direction d = z + beta d
!> with z = M r.
module adhesion_directions
   use adhesion_patch, only : adhesion_contact_type, adhesion_patch_type, evaluate_gradient
   use adhesion_potential, only : adhesive_slopes
   use adhesion_model, only : adhesion_model_type
   use adhesion_state, only : control_approach, control_pressure, diagonal_scaling
   use asperity_precision, only : dp
   use field_sums, only : largest_of_rows, least_of_rows
   use row_sharing, only : row_sharing_type
   implicit none
   private

   public :: adhesion_iteration_type, adhesion_work_type, find_direction, measure

   ! Passes over z. The first is left out where the sum of the gap is free.
   integer, parameter :: sum_pass = 0           !! add up
   integer, parameter :: last_pass = 2          !! z is what it will be

   !> Errors in the padding count more: they are smooth and of one sign, and add up in energies.
   real(dp), parameter :: strictness = 10.0_dp

   ! Where the traction comes from. Only a fresh one proves a solution.
   integer, parameter, public :: updated = 1    !! it was updated with the steps: it has gathered round-off
   integer, parameter, public :: fresh = 2      !! it is a product with B

   !> The operators and work fields of the method.
   type :: adhesion_work_type
      type(adhesion_patch_type) :: patch
      type(adhesion_model_type) :: model
      !> What is exchanged with M: G, of which `measure` makes the input of M, and then z = M r.
      real(dp), allocatable :: exchange(:, :)
      real(dp), allocatable :: residual(:, :)        !! r
      real(dp), allocatable :: curvature(:, :)       !! e'' at the gap that was measured last, on the patch
      real(dp), allocatable :: old(:, :)             !! r of the iteration before
      real(dp), allocatable :: direction(:, :)       !! d
      ! The contact in the local model of its energy:
      real(dp), pointer, contiguous :: model_state(:, :) => null()
      real(dp), pointer, contiguous :: model_traction(:, :) => null()
      real(dp), allocatable :: change(:, :)          !! of the displacement, with the foreign rows of the model
      real(dp), allocatable :: image(:, :)           !! its product
      real(dp) :: scaling = 0.0_dp                   !! k of the Gauss potential, Pa/m; 0: none
   end type adhesion_work_type

   !> A contact that is being solved, and where its iteration stands.
   type, extends(adhesion_contact_type) :: adhesion_iteration_type
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
      real(dp) :: lift = 0.0_dp                  !! d of the level
      real(dp) :: slope = 0.0_dp                 !! r.d
   end type adhesion_iteration_type

   !> Sums of a row of z.
   type :: z_sums_type
      real(dp) :: rz = 0.0_dp                    !! r.z
      real(dp) :: old_rz = 0.0_dp                !! z.(r of the iteration before)
      real(dp) :: total = 0.0_dp                 !! sum of z over the cells that may move
      real(dp) :: moving = 0.0_dp                !! their number
   end type z_sums_type

contains

   !> The gradient G, the natural residual, and r, which is handed to the preconditioner.
   subroutine measure(self, now)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), allocatable :: rows(:, :)
      real(dp) :: worst, least, padding, sums(2)
      integer :: j

      if (self%patch%periodic .and. now%problem%control == control_approach) &
         call evaluate_gradient(self%patch, now, self%exchange)
      allocate (rows(2, self%patch%all_rows))
      worst = 0.0_dp
      least = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, now, rows) private(j, padding) &
      !$omp reduction(max: worst) reduction(min: least) num_threads(self%patch%threads)
      do j = 1, self%patch%all_rows
         call measure_row(self, now, j, worst, least, padding)
         rows(:, j) = [padding, sum(now%traction(1:self%patch%inner(j), j))]
         call self%model%put_row(j, self%exchange(:, j))
      end do
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

   !> A row of r and of M's input, from the row of G less p.
   subroutine measure_row(self, now, j, worst, least, padding)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      integer, intent(in) :: j
      real(dp), intent(inout) :: worst                 !! natural residual
      real(dp), intent(inout) :: least                 !! least gap, m
      real(dp), intent(out) :: padding                 !! psi.r of the padding, Pa
      real(dp) :: g, gap, r
      integer :: i, n

      n = self%patch%inner(j)
      call adhesive_slopes(now%problem%potential, now%state(1:n, j), self%exchange(1:n, j), &
         self%curvature(1:n, j))
      do i = 1, n
         gap = now%state(i, j)
         g = now%traction(i, j) + self%exchange(i, j) + now%load
         worst = max(worst, abs(min(gap/now%units%length, g/now%units%traction)))
         least = min(least, gap)
         r = 0.0_dp
         if (gap > 0.0_dp .or. g < 0.0_dp) r = -g
         self%old(i, j) = self%residual(i, j)
         self%residual(i, j) = r
         self%exchange(i, j) = r
      end do
      if (self%scaling > 0.0_dp) self%exchange(1:n, j) = self%exchange(1:n, j)*diagonal_scaling(now%problem, &
         now%state(1:n, j), self%scaling)
      padding = 0.0_dp
      do i = n + 1, self%patch%mx
         r = -now%traction(i, j)
         worst = max(worst, strictness*abs(r)/now%units%traction)
         padding = padding + self%patch%psi(i, j)*r
         self%old(i, j) = self%residual(i, j)
         self%residual(i, j) = r
         self%exchange(i, j) = r
      end do
   end subroutine measure_row

   !> The direction d = z + beta d, or d = z where that one does not descend.
   subroutine find_direction(self, now)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(inout) :: now
      type(z_sums_type) :: sums
      real(dp) :: level_z, beta

      call self%model%transform_inverse()
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
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: level_z                  !! z of the level, m
      type(z_sums_type), intent(out) :: sums
      type(z_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: z(:)
      real(dp) :: mean
      integer :: first, j, pass

      first = last_pass
      if (self%patch%periodic .and. now%problem%control == control_approach) first = sum_pass
      allocate (rows(self%patch%all_rows))
      !$omp parallel default(none) shared(self, now, level_z, rows, first) private(j, z) &
      !$omp num_threads(self%patch%threads)
      allocate (z(self%patch%mx))
      !$omp do
      do j = 1, self%patch%all_rows
         call self%model%inverse_row(j, self%exchange(:, j), z)
         call take_z_row(self, now, level_z, j, z)
         call center_row(self, now, first, 0.0_dp, j, rows(j))
      end do
      !$omp end do
      !$omp end parallel
      sums = sum_of(rows, self%patch%sharing)
      ! Cells in contact that the mean would close drop out, which changes the mean: once more.
      do pass = first + 1, last_pass
         mean = sums%total/max(sums%moving, 1.0_dp)
         !$omp parallel do default(none) shared(self, now, pass, mean, rows) private(j) &
         !$omp num_threads(self%patch%threads)
         do j = 1, self%patch%all_rows
            call center_row(self, now, pass, mean, j, rows(j))
         end do
         sums = sum_of(rows, self%patch%sharing)
      end do
   end subroutine precondition

   !> A row of z from what M has made of r; 0 on the cells that are not free.
   subroutine take_z_row(self, now, level_z, j, z)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: level_z                  !! m
      integer, intent(in) :: j
      real(dp), intent(inout) :: z(:)                  !! in: M r for Q = 1
      integer :: i, n

      n = self%patch%inner(j)
      z(:) = z*(1.0_dp/now%problem%modulus)
      do i = 1, n
         z(i) = merge(z(i), 0.0_dp, now%state(i, j) > 0.0_dp .or. self%residual(i, j) > 0.0_dp)
      end do
      if (self%scaling > 0.0_dp) &
         z(1:n) = z(1:n)*diagonal_scaling(now%problem, now%state(1:n, j), self%scaling)
      if (n < self%patch%mx) z(n + 1:) = z(n + 1:) + level_z*self%patch%psi(n + 1:, j)
      self%exchange(:, j) = z
   end subroutine take_z_row

   !> Take the mean off a row of z, and keep cells in contact from closing; the sums of the row.
   subroutine center_row(self, now, pass, mean, j, sums)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      integer, intent(in) :: pass                      !! in sum_pass z is left as it is
      real(dp), intent(in) :: mean                     !! m
      integer, intent(in) :: j
      type(z_sums_type), intent(out) :: sums
      real(dp) :: z
      logical :: open, opening
      integer :: i, n

      n = self%patch%inner(j)
      do i = 1, n
         z = self%exchange(i, j)
         open = now%state(i, j) > 0.0_dp
         opening = self%residual(i, j) > 0.0_dp
         if (pass == last_pass) opening = z > 0.0_dp
         if (open .or. opening) z = z - mean
         if (pass /= sum_pass .and. .not. open) then
            z = merge(max(z, 0.0_dp), 0.0_dp, opening)
            opening = z > 0.0_dp
         end if
         if (open .or. opening) sums%moving = sums%moving + 1.0_dp
         self%exchange(i, j) = z
         sums%total = sums%total + z
      end do
      do i = 1, self%patch%mx
         sums%rz = sums%rz + self%exchange(i, j)*self%residual(i, j)
         sums%old_rz = sums%old_rz + self%exchange(i, j)*self%old(i, j)
      end do
   end subroutine center_row

   !> Sums of all rows, in order.
   function sum_of(rows, sharing) result(sums)
      type(z_sums_type), intent(in) :: rows(:)
      type(row_sharing_type), intent(in) :: sharing    !! of the rows
      type(z_sums_type) :: sums
      real(dp), allocatable :: parts(:, :)
      real(dp) :: totals(4)
      integer :: j

      allocate (parts(4, size(rows)))
      do j = 1, size(rows)
         parts(:, j) = [rows(j)%rz, rows(j)%old_rz, rows(j)%total, rows(j)%moving]
      end do
      totals = sharing%totals(parts)
      sums = z_sums_type(totals(1), totals(2), totals(3), totals(4))
   end function sum_of

   !> d = z + beta d on the free cells and in the padding, 0 elsewhere; the level's alike.
   subroutine turn(self, beta, level_z, now)
      type(adhesion_work_type), intent(inout) :: self
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: level_z                  !! z of the level, m
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), allocatable :: rows(:, :)
      real(dp) :: d, slope, sums(1)
      integer :: i, j, n

      now%lift = level_z + beta*now%lift
      allocate (rows(1, self%patch%all_rows))
      !$omp parallel do default(none) shared(self, now, beta, rows) private(i, j, n, d, slope) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%all_rows
         n = self%patch%inner(j)
         slope = 0.0_dp
         do i = 1, self%patch%mx
            d = self%exchange(i, j) + beta*self%direction(i, j)
            if (i <= n) then
               if (.not. (now%state(i, j) > 0.0_dp .or. self%exchange(i, j) > 0.0_dp)) d = 0.0_dp
            end if
            slope = slope + self%residual(i, j)*d
            self%direction(i, j) = d
         end do
         rows(1, j) = slope
      end do
      sums = self%patch%sharing%totals(rows)
      now%slope = sums(1) + now%missing*now%lift
   end subroutine turn

end module adhesion_directions
