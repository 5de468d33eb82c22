!> Directions of the fast method for adhesive contact (module `adhesion_cg_fast`): d = z + beta d with z = M r,
!> where r is the measured residual.
module adhesion_directions
   use adhesion_state, only : control_approach, control_pressure
   use adhesion_sweeps, only : direction_of_cells, scale_cells, z_of_cells
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_precision, only : dp
   use field_sums, only : largest_of_rows, row_product
   use row_sharing, only : row_sharing_type
   implicit none
   private

   public :: find_direction

   ! Passes that make the mean of z zero, if the sum of the gap is prescribed. They are numbered from 0 to 2.
   integer, parameter :: sum_pass = 0           !! z is only added up
   integer, parameter :: last_pass = 2          !! z is final

   !> Sums of a row of z.
   type :: z_sums_type
      real(dp) :: rz = 0.0_dp                    !! r.z
      real(dp) :: old_rz = 0.0_dp                !! z.(r of the iteration before)
      real(dp) :: total = 0.0_dp                 !! sum of z over the cells that may move
      real(dp) :: moving = 0.0_dp                !! their number
   end type z_sums_type

contains

   !> Compute the direction d = z + beta d, or d = z if the energy does not decrease along the former.
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
      call form_direction(self, beta, level_z, now)
      if (now%slope <= 0.0_dp .and. beta > 0.0_dp) call form_direction(self, 0.0_dp, level_z, now)
   end subroutine find_direction

   !> Compute z = M r on the free cells and in the padding, except in cells in contact that z would close. Its mean is
   !> zero if the sum of the gap is prescribed, and it includes the mode of the level if that is unknown.
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
         if (self%scaling > 0.0_dp) then
            call self%model%inverse_row(j, self%exchange(:, j), z)
            associate (n => self%patch%inner(j))
               call scale_cells(self%curvature(1:n, j), self%scaling, z(1:n))
            end associate
         else
            call self%model%inverse_row(j, self%residual(:, j), z)
         end if
         call form_z_row(self, now, level_z, j, z, rows(j))
         if (first == sum_pass) call center_row(self, now, first, 0.0_dp, j, rows(j))
      end do
      !$omp end do
      !$omp end parallel
      sums = sum_of(rows, self%patch%sharing)
      ! Cells in contact that z minus its mean would close do not move. This changes the mean, so the pass is repeated.
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

   !> Compute a row of z from M r, with its sums of products. It is 0 on the cells that are not free and, unless its
   !> mean is prescribed, in cells in contact that it would close.
   subroutine form_z_row(self, now, level_z, j, z, sums)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: level_z                  !! m
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: z(:)         !! M r for Q = 1
      type(z_sums_type), intent(out) :: sums
      real(dp) :: factor
      logical :: opens_only
      integer :: i, n

      n = self%patch%inner(j)
      factor = 1.0_dp/now%problem%modulus
      opens_only = .not. (self%patch%periodic .and. now%problem%control == control_approach)
      call z_of_cells(factor, opens_only, z(1:n), now%state(1:n, j), self%residual(1:n, j), self%old(1:n, j), &
         self%exchange(1:n, j), sums%rz, sums%old_rz)
      do i = n + 1, self%patch%mx
         self%exchange(i, j) = factor*z(i) + level_z*self%patch%psi(i, j)
      end do
      sums%rz = sums%rz + row_product(self%exchange(n + 1:, j), self%residual(n + 1:, j))
      sums%old_rz = sums%old_rz + row_product(self%exchange(n + 1:, j), self%old(n + 1:, j))
   end subroutine form_z_row

   !> Subtract the mean from a row of z, set z to 0 in cells in contact that it would close, and form the sums.
   subroutine center_row(self, now, pass, mean, j, sums)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      integer, intent(in) :: pass                      !! z is not changed in sum_pass
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
      sums%rz = row_product(self%exchange(:, j), self%residual(:, j))
      sums%old_rz = row_product(self%exchange(:, j), self%old(:, j))
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

   !> Compute d = z + beta d on the free cells and in the padding, and 0 elsewhere, and likewise for the level. The
   !> change of the displacement along d is passed to the model.
   subroutine form_direction(self, beta, level_z, now)
      type(adhesion_work_type), intent(inout) :: self
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: level_z                  !! z of the level, m
      type(adhesion_iteration_type), intent(inout) :: now
      real(dp), allocatable :: rows(:, :), quickest(:)
      real(dp) :: sums(2)
      integer :: j

      now%lift = level_z + beta*now%lift
      allocate (rows(2, self%patch%all_rows), quickest(self%patch%all_rows))
      !$omp parallel do default(none) shared(self, now, beta, rows, quickest) private(j) &
      !$omp num_threads(self%patch%threads)
      do j = 1, self%patch%all_rows
         call form_direction_row(self, now, beta, j, rows(:, j), quickest(j))
         call self%model%put_row(j, self%change(:, j))
      end do
      sums = self%patch%sharing%totals(rows)
      now%slope = sums(1) + now%missing*now%lift
      now%bend = sums(2)
      now%farthest = 1.0_dp/max(largest_of_rows(quickest), tiny(1.0_dp))
   end subroutine form_direction

   !> Compute row j of d and of the change of the displacement along it, with its parts of r.d and d.e'' d, and the
   !> greatest |d|/(g + z_0).
   subroutine form_direction_row(self, now, beta, j, row, quickest)
      type(adhesion_work_type), intent(inout) :: self
      type(adhesion_iteration_type), intent(in) :: now
      real(dp), intent(in) :: beta
      integer, intent(in) :: j
      real(dp), intent(out) :: row(2), quickest
      real(dp) :: d
      integer :: i, n

      n = self%patch%inner(j)
      call direction_of_cells(now%state(1:n, j), self%exchange(1:n, j), self%residual(1:n, j), &
         self%curvature(1:n, j), beta, now%units%length, now%lift, self%direction(1:n, j), self%change(1:n, j), row, &
         quickest)
      do i = n + 1, self%patch%mx
         d = self%exchange(i, j) + beta*self%direction(i, j)
         self%direction(i, j) = d
         self%change(i, j) = d
      end do
      row(1) = row(1) + row_product(self%residual(n + 1:, j), self%direction(n + 1:, j))
   end subroutine form_direction_row

end module adhesion_directions
