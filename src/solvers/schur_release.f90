!> Releases the cells from the contact in which a step would make the pressure negative, so that module
!> `schur_preconditioner` can take the effect on the other cells into account.
!>
!> The trial pressure is P + alpha (d - offset). If it were only set to 0 in the cells R where it is negative, the pressure
!> beside them, which balances the negative values, would be too large: at the edges of the contact the step would
!> raise the energy. The cells R therefore get the step -P, and the model determines the change of the direction d in
!> the other cells: v remains r on the rest of S, and on N and R it is chosen such that
!>     B (change of v) = -B v on N,   alpha (d + B (change of v) - offset) = -P on R.
!> Conjugate gradients continue from the present v. Their residual on R is minus the trial pressure over alpha, and that
!> on N is -B v. Afterwards the image holds the change of the direction on the rest of the contact.
module schur_release
   use active_blocks, only : active_blocks_type
   use asperity_precision, only : dp, sp
   use coarse_level, only : coarse_level_type
   use field_sums, only : row_total
   use normal_sweeps, only : trial_type
   use schur_passes, only : schur_fields_type
   implicit none
   private

   public :: release_pass

contains

   !> Move the cells with a negative trial pressure from S to N: their residual becomes 0, and the image is what the model
   !> has to remove. The image of the other cells of S becomes 0. Cells of S whose pressure is 0, and which the
   !> direction would pull, are released as well.
   subroutine release_pass(self, coarse, active, trial, pressure, direction)
      class(schur_fields_type), intent(inout), target :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(sp), intent(in) :: direction(self%grid%nx, self%grid%rows())
      real(sp), allocatable :: column(:), count(:), correction(:)
      real(sp), pointer, contiguous :: response(:)
      real(dp), allocatable :: squares(:)
      integer :: j, k, jb, part, parts(2, 3)

      allocate (squares(self%rows(1):self%rows(2)), source=0.0_dp)
      !$omp parallel default(none) shared(self, coarse, active, trial, pressure, direction, squares) &
      !$omp private(j, k, jb, part, parts, column, count, correction, response) num_threads(self%threads)
      allocate (column(self%columns(1):self%columns(2)), count(self%columns(1):self%columns(2)))
      allocate (correction(self%columns(1):self%columns(2)))
      !$omp do schedule(dynamic)
      do jb = coarse%all_strips(1), coarse%all_strips(2)
         call coarse%spread_blocks(self%blocks%pending(:, jb), self%columns(1), correction)
         column(:) = 0.0_sp
         count(:) = 0.0_sp
         do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
            response(self%columns(1):) => self%response_row(j)
            do k = 1, active%wide_runs(jb)
               parts = parts_of_run(self, [active%wide_first(k, jb), active%wide_last(k, jb)], &
                  jb >= coarse%strips(1) .and. jb <= coarse%strips(2))
               associate (a => parts(1, 1), b => parts(2, 1))
                  call release_cells(b - a + 1, trial, self%length, response(a:b), correction(a:b), pressure(a:b, j), &
                     direction(a:b, j), self%residual(a:b, j), self%image(a:b, j), column(a:b), count(a:b), squares(j))
               end associate
               do part = 2, 3
                  associate (a => parts(1, part), b => parts(2, part))
                     call image_of_open_cells(b - a + 1, self%length, response(a:b), correction(a:b), self%image(a:b, j), &
                        column(a:b), count(a:b), squares(j))
                  end associate
               end do
            end do
         end do
         self%blocks%image_off(:, jb) = 0.0_dp
         self%blocks%cells_off(:, jb) = 0.0_dp
         call coarse%add_blocks(column, self%blocks%image_off(:, jb))
         call coarse%add_blocks(count, self%blocks%cells_off(:, jb))
      end do
      !$omp end parallel
      call coarse%share_blocks(self%blocks%image_off)
      call coarse%share_blocks(self%blocks%cells_off)
      self%sums%square = row_total(squares)
      call self%blocks%add_far_image(coarse, self%sums%square)
      self%blocks%pending(:, :) = 0.0_dp
      self%length = 0.0_sp
   end subroutine release_pass

   !> The parts of a run of cells in a row: its columns in the map, and those of the margin before and behind them. A part is
   !> empty if its last column comes before its first one.
   pure function parts_of_run(self, run, in_map) result(parts)
      class(schur_fields_type), intent(in) :: self
      integer, intent(in) :: run(2)                      !! first and last column
      logical, intent(in) :: in_map                      !! the row belongs to the map, not to the margin
      integer :: parts(2, 3)

      associate (nx => self%grid%nx)
         parts = reshape([max(run(1), 1), min(run(2), nx), run(1), min(run(2), 0), max(run(1), nx + 1), run(2)], [2, 3])
      end associate
      if (.not. in_map) parts = reshape([1, 0, run, 1, 0], [2, 3])
   end function parts_of_run

   !> Form the image of cells beyond the map, which are in N and stay there, with its sums.
   pure subroutine image_of_open_cells(n, length, response, correction, image, column, count, squares)
      integer, intent(in) :: n
      real(sp), intent(in) :: length
      real(sp), intent(in) :: response(n), correction(n)   !! M r = image + length response + correction
      real(sp), intent(inout) :: image(n)
      real(sp), intent(inout) :: column(n)          !! sums of the image over the rows of a block
      real(sp), intent(inout) :: count(n)           !! numbers of cells likewise
      real(dp), intent(inout) :: squares            !! sum of the squares of the image

      image(:) = image + length*response + correction
      column(:) = column + image
      count(:) = count + 1.0_sp
      squares = squares + sum(image**2)
   end subroutine image_of_open_cells

   !> Release the cells of a part of a row, with the sums on N. One loop without branches, like those of module
   !> `schur_sweeps`.
   pure subroutine release_cells(n, trial, length, response, correction, pressure, direction, residual, image, column, &
      count, squares)
      integer, intent(in) :: n
      type(trial_type), intent(in) :: trial
      real(sp), intent(in) :: length
      real(sp), intent(in) :: response(n), correction(n)   !! M r = image + length response + correction
      real(dp), intent(in) :: pressure(n)
      real(sp), intent(in) :: direction(n)
      real(sp), intent(inout) :: residual(n)
      real(sp), intent(inout) :: image(n)
      real(sp), intent(inout) :: column(n)          !! sums of the image on N over the rows of a block
      real(sp), intent(inout) :: count(n)           !! numbers of cells in N likewise
      real(dp), intent(inout) :: squares            !! sum of the squares of the image on N
      real(dp) :: per_alpha
      real(sp) :: offset, b, value, off, acts, released, square
      integer :: i

      per_alpha = 1.0_dp/trial%alpha
      offset = real(trial%offset, sp)
      square = 0.0_sp
      !$omp simd reduction(+:square) private(b, value, off, acts, released)
      do i = 1, n
         b = image(i) + length*response(i) + correction(i)
         off = 1.0_sp - not_zero(residual(i))
         acts = not_zero(direction(i))
         value = acts*(real(per_alpha*pressure(i), sp) + (direction(i) - offset)) + (1.0_sp - acts)*b
         released = (1.0_sp - off)*(0.5_sp - sign(0.5_sp, value))
         b = off*b + released*value
         residual(i) = (1.0_sp - released)*residual(i)
         image(i) = b
         column(i) = column(i) + b
         count(i) = count(i) + (off + released)
         square = square + b*b
      end do
      squares = squares + square
   end subroutine release_cells

   !> 1 if a value is not 0 and 0 otherwise, without a branch.
   elemental function not_zero(value)
      real(sp), intent(in) :: value
      real(sp) :: not_zero

      not_zero = 0.5_sp + sign(0.5_sp, abs(value) - tiny(1.0_sp))
   end function not_zero

end module schur_release
