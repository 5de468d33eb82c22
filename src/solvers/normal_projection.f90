!> The passes of module `normal_cg` that form a step from a direction.
!>
!> A trial pressure P + alpha d may be negative in some cells and have another load. It is projected on the admissible
!> pressures {P >= 0, sum P = load}, and the step is the difference between the projected trial pressure and P. Neither
!> is stored: the passes compute them from P, d and the numbers of the record `trial` (module `normal_sweeps`). As in
!> module `normal_passes`, only the active blocks are visited.
module normal_projection
   use asperity_precision, only : dp, sp
   use fft_conv, only : convolution_type
   use field_sums, only : least_of_rows
   use normal_passes, only : as_formed, lowered, normal_work_type
   use normal_sums, only : step_sums_type, total, trial_sums_type
   use normal_sweeps, only : changed_trial_cells, form_trial_cells, longest_cells, lower_cells, spread_step_cells, &
      step_cells, trial_cells, trial_type
   implicit none
   private

   public :: find_clip, keep_block_sums, longest_multiple, project_step, try_pressure

   !> Error of the load, over the root of the tolerance, from which a step of Newton's method finds it: the step leaves about
   !> a tenth of the square of the error.
   real(dp), parameter :: nearly_found = 0.1_dp

contains

   !> Form the sums of the trial pressure above 0. If cells were released, the direction changes by what the
   !> preconditioner found.
   subroutine try_pressure(self, alpha, pressure, sums)
      type(normal_work_type), intent(inout) :: self
      real(dp), intent(in) :: alpha
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums

      self%trial = trial_type(alpha, self%offset)
      self%tried = as_formed
      if (self%preconditioner%released) then
         call try_changed_pressure(self, pressure, sums)
      else
         call sum_trial(self, self%trial, pressure, sums)
      end if
   end subroutine try_pressure

   !> Form the sums of a trial pressure above its shift.
   subroutine sum_trial(self, trial, pressure, sums)
      type(normal_work_type), intent(in) :: self
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums
      type(trial_sums_type), allocatable :: rows(:)
      integer :: j, k

      allocate (rows(self%grid%rows()))
      !$omp parallel do default(none) shared(self, trial, pressure, rows) private(j, k) &
      !$omp schedule(dynamic, 8) num_threads(self%threads)
      do j = 1, self%grid%rows()
         rows(j) = trial_sums_type()
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               call trial_cells(self%active%last(k, j) - first + 1, trial, pressure(first, j), &
                  self%direction(first, j, self%tried), rows(j))
            end associate
         end do
      end do
      sums = total(rows)
   end subroutine sum_trial

   !> Change the direction after a release of cells, and form the sums of the trial pressure above 0, for `try_pressure`.
   subroutine try_changed_pressure(self, pressure, sums)
      type(normal_work_type), intent(inout), target :: self
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums
      type(trial_sums_type), allocatable :: rows(:)
      real(sp), allocatable :: correction(:)
      real(sp), pointer, contiguous :: response(:)
      integer :: j, k, jb

      allocate (rows(self%grid%rows()))
      !$omp parallel default(none) shared(self, pressure, rows) private(j, k, jb, correction, response) &
      !$omp num_threads(self%threads)
      allocate (correction(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         call self%preconditioner%give_coarse_part(self%coarse, jb, correction)
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            response(self%coarse%columns(1):) => self%preconditioner%response_row(j)
            rows(j) = trial_sums_type()
            do k = 1, self%active%runs(j)
               associate (a => self%active%first(k, j), b => self%active%last(k, j))
                  call changed_trial_cells(b - a + 1, self%trial, self%preconditioner%length, &
                     self%preconditioner%image(a:b, j), response(a:b), correction(a:b), &
                     self%preconditioner%residual(a:b, j), pressure(a:b, j), &
                     self%direction(a:b, j, as_formed), rows(j))
               end associate
            end do
         end do
      end do
      !$omp end parallel
      sums = total(rows)
   end subroutine try_changed_pressure

   !> Lower the tried direction by a number per block, so that the sum of the trial pressure in each block remains what it
   !> is if negative pressures become 0. The sums of the blocks of very oblong cells are stiff: if they change, the energy
   !> rises by much more than the direction gains. The next direction is formed from the present one as it was.
   subroutine keep_block_sums(self, pressure, sums)
      type(normal_work_type), intent(inout) :: self
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(out) :: sums     !! of the new trial pressure above 0
      integer :: jb

      !$omp parallel do default(none) shared(self, pressure) private(jb) schedule(dynamic) num_threads(self%threads)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         call keep_strip_sums(self, jb, pressure)
      end do
      self%tried = lowered
      call sum_trial(self, self%trial, pressure, sums)
   end subroutine keep_block_sums

   !> Lower the direction by a number per block in a row of blocks, for `keep_block_sums`. The numbers are found
   !> by Newton's method from below, as in `find_clip`.
   subroutine keep_strip_sums(self, jb, pressure)
      type(normal_work_type), intent(inout) :: self
      integer, intent(in) :: jb                      !! row of blocks
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), dimension(self%coarse%nx) :: wanted, above, cells, shift, next
      integer :: j, k

      shift(:) = 0.0_dp
      call sum_strip(self, jb, pressure, shift, wanted, above, cells)
      do
         next(:) = shift + (above - max(wanted, 0.0_dp))/max(cells, 1.0_dp)
         where (above - wanted <= 1e-15_dp*abs(wanted)) next = shift
         if (.not. any(next > shift)) exit           ! also at the limit of round-off, and with NaN
         shift(:) = max(next, shift)
         call sum_strip(self, jb, pressure, shift, next, above, cells)
      end do

      shift(:) = shift/self%trial%alpha
      do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j), last => self%active%last(k, j))
               call lower_cells(last - first + 1, shift(self%coarse%block_x(first:last)), &
                  self%direction(first, j, as_formed), self%direction(first, j, lowered))
            end associate
         end do
      end do
   end subroutine keep_strip_sums

   !> Form the sums over the active cells of each block in a row of blocks: of the trial pressures, of their parts above a
   !> shift, and the number of cells above it.
   pure subroutine sum_strip(self, jb, pressure, shift, sums, above, cells)
      type(normal_work_type), intent(in) :: self
      integer, intent(in) :: jb                      !! row of blocks
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), intent(in) :: shift(:)               !! [blocks along x]
      real(dp), intent(out) :: sums(:), above(:), cells(:)
      real(dp) :: values(self%grid%nx)
      integer :: b, i, j, k

      sums(:) = 0.0_dp
      above(:) = 0.0_dp
      cells(:) = 0.0_dp
      do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j), last => self%active%last(k, j))
               call form_trial_cells(last - first + 1, self%trial, pressure(first, j), &
                  self%direction(first, j, as_formed), values(first))
               do i = first, last
                  b = self%coarse%block_x(i)
                  sums(b) = sums(b) + values(i)
                  if (values(i) <= shift(b)) cycle
                  above(b) = above(b) + (values(i) - shift(b))
                  cells(b) = cells(b) + 1.0_dp
               end do
            end associate
         end do
      end do
   end subroutine sum_strip

   !> Find the projection of the trial pressure on the admissible pressures. If the load is given, this is the shift t for
   !> which max(trial - t, 0) has the sum of the load, found by Newton's method from below. The sum is linear in t between
   !> two values at which a cell loses its pressure. From a small error on, the next step therefore leaves hardly any, and
   !> no pass confirms it. If the trial pressure is far above the load, round-off limits the accuracy of this sum, and a
   !> factor corrects it.
   !>
   !> After a release of cells the sum may also be too small, because the offset of the direction is that before the
   !> release. The first step of Newton's method then leads below t, which may be negative because no projection gives
   !> pressure to cells that were released.
   subroutine find_clip(self, fixed_load, load, tolerance, pressure, sums, clipped)
      type(normal_work_type), intent(inout) :: self
      logical, intent(in) :: fixed_load
      real(dp), intent(in) :: load                   !! sum of P over the cells, Pa
      real(dp), intent(in) :: tolerance              !! largest relative error of the load of a solution
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      type(trial_sums_type), intent(in) :: sums      !! of the trial pressure above 0
      logical, intent(out) :: clipped                !! some trial pressure is negative
      type(trial_sums_type) :: above
      type(trial_type) :: next
      real(dp) :: kept
      logical :: first                               !! the sum may be too small

      clipped = sums%least < 0.0_dp
      if (.not. fixed_load .or. .not. (clipped .or. self%preconditioner%released)) return
      above = sums
      kept = load
      next = self%trial
      first = self%preconditioner%released
      do
         if (above%cells < 1.0_dp) exit                   ! too far: the shift before is the best one
         self%trial = next
         kept = above%above
         if (kept - load <= 1e-15_dp*load .and. .not. first) exit
         next%shift = self%trial%shift + (kept - load)/above%cells
         if (next%shift <= self%trial%shift .and. .not. first) exit  ! the limit of round-off is reached
         if (abs(kept - load) <= nearly_found*sqrt(tolerance)*load .and. sums%above <= 2.0_dp*load) then
            self%trial = next
            return
         end if
         first = .false.
         call sum_trial(self, next, pressure, above)
      end do
      if (abs(kept - load) > 1e-13_dp*load) self%trial%factor = load/kept
   end subroutine find_clip

   !> Compute the projected step and its sums. Each row is transformed as soon as it is formed.
   subroutine project_step(self, operator, predicts, level, pressure, gap, sums)
      type(normal_work_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      logical, intent(in) :: predicts                !! its block means and the sum of its square are needed
      real(dp), intent(in) :: level                  !! m
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())
      type(step_sums_type), intent(out) :: sums
      type(step_sums_type), allocatable :: rows(:)
      real(dp), allocatable :: column(:), step(:)
      integer :: j, k, jb, next

      allocate (rows(self%grid%rows()))
      !$omp parallel default(none) shared(self, operator, predicts, level, pressure, gap, rows) &
      !$omp private(j, k, jb, next, column, step) num_threads(self%threads)
      allocate (column(self%coarse%columns(1):self%coarse%columns(2)), step(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         column(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            rows(j) = step_sums_type()
            if (self%active%runs(j) == 0) then
               call operator%forward_zero_row(1, j)
               cycle
            end if
            next = 1
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j), last => self%active%last(k, j))
                  step(next:first - 1) = 0.0_dp
                  call step_cells(last - first + 1, self%trial, level, pressure(first, j), &
                     gap(first, j), self%direction(first, j, self%tried), step(first), rows(j))
                  if (predicts) call spread_step_cells(last - first + 1, step(first), column(first), rows(j)%square)
                  next = last + 1
               end associate
            end do
            step(next:) = 0.0_dp
            call operator%forward_row(1, j, step)
         end do
         if (.not. predicts) cycle
         call self%coarse%sum_blocks(column, self%coarse%mean(:, jb))
         self%coarse%mean(:, jb) = self%coarse%mean(:, jb)/self%coarse%cells
      end do
      !$omp end parallel
      if (predicts) call self%coarse%share_blocks(self%coarse%mean)
      sums = total(rows)
   end subroutine project_step

   !> The longest multiple of the projected step for which no pressure becomes negative.
   function longest_multiple(self, pressure) result(longest)
      type(normal_work_type), intent(in) :: self
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp) :: longest
      integer :: j, k

      longest = huge(1.0_dp)
      !$omp parallel do default(none) shared(self, pressure) private(j, k) reduction(min: longest) &
      !$omp schedule(dynamic, 8) num_threads(self%threads)
      do j = 1, self%grid%rows()
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               call longest_cells(self%active%last(k, j) - first + 1, self%trial, pressure(first, j), &
                  self%direction(first, j, self%tried), longest)
            end associate
         end do
      end do
      longest = least_of_rows([longest])
   end function longest_multiple

end module normal_projection
