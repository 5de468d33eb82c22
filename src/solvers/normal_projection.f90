!> The passes of module `normal_cg` that form a step from a direction.
!>
!> A trial pressure P + alpha d may be negative in some cells and have another load. It is projected on the admissible
!> pressures {P >= 0, sum P = load}, and the step is the difference between the projected trial pressure and P. The
!> field `step` holds first the trial pressure and then the step. As in module `normal_passes`, only the active blocks
!> are visited, and the innermost loops are in module `normal_sweeps`.
module normal_projection
   use asperity_precision, only : dp, sp
   use fft_conv, only : convolution_type
   use field_sums, only : least_of_rows
   use normal_passes, only : normal_work_type
   use normal_sums, only : step_sums_type, total, trial_sums_type
   use normal_sweeps, only : above_cells, changed_trial_cells, clip_cells, longest_cells, trial_cells
   implicit none
   private

   public :: clip_step, clip_type, find_clip, keep_block_sums, longest_multiple, try_pressure

   !> How a trial pressure is projected on the admissible pressures: factor max(trial - shift, 0).
   type :: clip_type
      logical :: clipped = .false.                   !! some trial pressure is negative
      real(dp) :: shift = 0.0_dp                     !! Pa
      real(dp) :: factor = 1.0_dp
   end type clip_type

contains

   !> Compute step = trial pressure P + alpha (direction - offset), and its sums above 0. If cells were released, the
   !> direction changes by what the preconditioner found.
   subroutine try_pressure(self, alpha, pressure, step, sums)
      type(normal_work_type), intent(inout) :: self
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), intent(inout) :: step(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums
      type(trial_sums_type), allocatable :: rows(:)
      integer :: j, k, n

      allocate (rows(self%grid%rows()))
      if (self%preconditioner%released) then
         call try_changed_pressure(self, alpha, pressure, step, rows)
         sums = total(rows)
         return
      end if
      !$omp parallel do default(none) shared(self, alpha, pressure, step, rows) &
      !$omp private(j, k, n, sums) schedule(dynamic, 8) num_threads(self%threads)
      do j = 1, self%grid%rows()
         sums = trial_sums_type()
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               n = self%active%last(k, j) - first + 1
               call trial_cells(n, alpha, self%offset, pressure(first, j), self%direction(first, j), &
                  step(first, j), sums)
            end associate
         end do
         rows(j) = sums
      end do
      sums = total(rows)
   end subroutine try_pressure

   !> Compute step = trial pressure and its sums in each row after a release of cells, for `try_pressure`.
   subroutine try_changed_pressure(self, alpha, pressure, step, rows)
      type(normal_work_type), intent(inout), target :: self
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), intent(inout) :: step(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: rows(:)
      real(sp), allocatable :: correction(:)
      real(sp), pointer, contiguous :: response(:)
      integer :: j, k, jb

      !$omp parallel default(none) shared(self, alpha, pressure, step, rows) &
      !$omp private(j, k, jb, correction, response) num_threads(self%threads)
      allocate (correction(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         correction(:) = self%preconditioner%correction(self%coarse, jb)
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            response => self%preconditioner%response_row(j)
            rows(j) = trial_sums_type()
            do k = 1, self%active%runs(j)
               associate (a => self%active%first(k, j), b => self%active%last(k, j))
                  call changed_trial_cells(b - a + 1, alpha, self%offset, self%preconditioner%length, &
                     self%preconditioner%image(a:b, j), response(a:b), correction(a:b), &
                     self%preconditioner%residual(a:b, j), pressure(a:b, j), self%direction(a:b, j), step(a:b, j), rows(j))
               end associate
            end do
         end do
      end do
      !$omp end parallel
   end subroutine try_changed_pressure

   !> Subtract from the trial pressure in `step` a number per block, so that the sum of each block remains what it is if
   !> negative pressures become 0. The sums of the blocks of very oblong cells are stiff: if they change, the energy
   !> rises by much more than the direction gains.
   subroutine keep_block_sums(self, step, sums)
      type(normal_work_type), intent(in) :: self
      real(dp), intent(inout) :: step(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums     !! of the new trial pressure above 0
      type(trial_sums_type), allocatable :: rows(:)
      integer :: jb

      allocate (rows(self%grid%rows()))
      !$omp parallel do default(none) shared(self, step, rows) private(jb) schedule(dynamic) num_threads(self%threads)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         call keep_strip_sums(self, jb, step, rows)
      end do
      sums = total(rows)
   end subroutine keep_block_sums

   !> Subtract a number per block from the trial pressure in a row of blocks, for `keep_block_sums`. The numbers are found
   !> by Newton's method from below, as in `find_clip`.
   subroutine keep_strip_sums(self, jb, step, rows)
      type(normal_work_type), intent(in) :: self
      integer, intent(in) :: jb                      !! row of blocks
      real(dp), intent(inout) :: step(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(inout) :: rows(:)
      real(dp), dimension(self%coarse%nx) :: wanted, above, cells, shift, next
      integer :: j, k

      shift(:) = 0.0_dp
      call sum_strip(self, jb, step, shift, wanted, above, cells)
      do
         next(:) = shift + (above - max(wanted, 0.0_dp))/max(cells, 1.0_dp)
         where (above - wanted <= 1e-15_dp*abs(wanted)) next = shift
         if (.not. any(next > shift)) exit           ! also at the limit of round-off, and with NaN
         shift(:) = max(next, shift)
         call sum_strip(self, jb, step, shift, next, above, cells)
      end do

      do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
         rows(j) = trial_sums_type()
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j), last => self%active%last(k, j))
               step(first:last, j) = step(first:last, j) - shift(self%coarse%block_x(first:last))
               call above_cells(last - first + 1, 0.0_dp, step(first, j), rows(j))
               rows(j)%least = min(rows(j)%least, minval(step(first:last, j)))
            end associate
         end do
      end do
   end subroutine keep_strip_sums

   !> Form the sums over the active cells of each block in a row of blocks: of the values, of their parts above a shift,
   !> and the number of cells above it.
   pure subroutine sum_strip(self, jb, values, shift, sums, above, cells)
      type(normal_work_type), intent(in) :: self
      integer, intent(in) :: jb                      !! row of blocks
      real(dp), intent(in) :: values(self%grid%nx, self%grid%rows())
      real(dp), intent(in) :: shift(:)               !! [blocks along x]
      real(dp), intent(out) :: sums(:), above(:), cells(:)
      integer :: b, i, j, k

      sums(:) = 0.0_dp
      above(:) = 0.0_dp
      cells(:) = 0.0_dp
      do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
         do k = 1, self%active%runs(j)
            do i = self%active%first(k, j), self%active%last(k, j)
               b = self%coarse%block_x(i)
               sums(b) = sums(b) + values(i, j)
               if (values(i, j) <= shift(b)) cycle
               above(b) = above(b) + (values(i, j) - shift(b))
               cells(b) = cells(b) + 1.0_dp
            end do
         end do
      end do
   end subroutine sum_strip

   !> Find the projection of the trial pressure in `step` on the admissible pressures. If the load is given, this is
   !> the shift t for which max(trial - t, 0) has the sum of the load, found by Newton's method from below. If the
   !> trial pressure is far above the load, round-off limits the accuracy of this sum, and a factor corrects it.
   !>
   !> After a release of cells the sum may also be too small, because the offset of the direction is that before the
   !> release. The first step of Newton's method then leads below t, which may be negative because no projection gives
   !> pressure to cells that were released.
   subroutine find_clip(self, fixed_load, load, step, sums, clip)
      type(normal_work_type), intent(in) :: self
      logical, intent(in) :: fixed_load
      real(dp), intent(in) :: load                   !! sum of P over the cells, Pa
      real(dp), intent(in) :: step(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(in) :: sums      !! of the trial pressure above 0
      type(clip_type), intent(out) :: clip
      type(trial_sums_type), allocatable :: rows(:)
      type(trial_sums_type) :: above
      real(dp) :: kept, next
      logical :: first                               !! the sum may be too small
      integer :: j, k, n

      clip%clipped = sums%least < 0.0_dp
      if (.not. fixed_load .or. .not. (clip%clipped .or. self%preconditioner%released)) return
      allocate (rows(self%grid%rows()))
      above = sums
      kept = load
      next = 0.0_dp
      first = self%preconditioner%released
      do
         if (above%cells < 1.0_dp) exit                   ! too far: the shift before is the best one
         clip%shift = next
         kept = above%above
         if (kept - load <= 1e-15_dp*load .and. .not. first) exit
         next = clip%shift + (kept - load)/above%cells
         if (next <= clip%shift .and. .not. first) exit  ! the limit of round-off is reached
         first = .false.
         !$omp parallel do default(none) shared(self, step, next, rows) private(j, k, n) &
         !$omp schedule(dynamic, 8) num_threads(self%threads)
         do j = 1, self%grid%rows()
            rows(j) = trial_sums_type()
            do k = 1, self%active%runs(j)
               n = self%active%last(k, j) - self%active%first(k, j) + 1
               call above_cells(n, next, step(self%active%first(k, j), j), rows(j))
            end do
         end do
         above = total(rows)
      end do
      if (abs(kept - load) > 1e-13_dp*load) clip%factor = load/kept
   end subroutine find_clip

   !> Compute step = (projected trial pressure) - P, its sums and block means. Each row is transformed as soon as it
   !> is formed.
   subroutine clip_step(self, operator, clip, level, pressure, gap, step, sums)
      type(normal_work_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      type(clip_type), intent(in) :: clip
      real(dp), intent(in) :: level                  !! m
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())
      real(dp), intent(inout) :: step(self%grid%nx, self%grid%rows())
      type(step_sums_type), intent(out) :: sums
      type(step_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: column(:)
      integer :: j, k, jb, n

      allocate (rows(self%grid%rows()))
      !$omp parallel default(none) shared(self, operator, clip, level, pressure, gap, step, rows) &
      !$omp private(j, k, jb, n, sums, column) num_threads(self%threads)
      allocate (column(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         column(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            sums = step_sums_type()
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j))
                  n = self%active%last(k, j) - first + 1
                  call clip_cells(n, clip%factor, clip%shift, level, pressure(first, j), gap(first, j), &
                     step(first, j), column(first), sums)
               end associate
            end do
            rows(j) = sums
            if (self%active%runs(j) == 0) then
               call operator%forward_zero_row(1, j)
            else
               call operator%forward_row(1, j, step(:, j))
            end if
         end do
         call self%coarse%sum_blocks(column, self%coarse%mean(:, jb))
         self%coarse%mean(:, jb) = self%coarse%mean(:, jb)/self%coarse%cells
      end do
      !$omp end parallel
      call self%coarse%share_blocks(self%coarse%mean)
      sums = total(rows)
   end subroutine clip_step

   !> The longest multiple of the step for which no pressure becomes negative.
   function longest_multiple(self, pressure, step) result(longest)
      type(normal_work_type), intent(in) :: self
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), step(self%grid%nx, self%grid%rows())
      real(dp) :: longest
      integer :: j, k

      longest = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, pressure, step) private(j, k) reduction(min: longest) &
      !$omp schedule(dynamic, 8) num_threads(self%threads)
      do j = 1, self%grid%rows()
         do k = 1, self%active%runs(j)
            call longest_cells(self%active%last(k, j) - self%active%first(k, j) + 1, &
               pressure(self%active%first(k, j), j), step(self%active%first(k, j), j), longest)
         end do
      end do
      longest = least_of_rows([longest])
   end function longest_multiple

end module normal_projection
