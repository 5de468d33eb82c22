!> The fields of module `schur_preconditioner`, and its passes over the cells of the active blocks.
!>
!> The first pass forms the residual r on the contact S and its image b = K r, where K is the stencil. The pass of each
!> step of conjugate gradients adds the step before to the image, and forms the next search direction d on N, the cells
!> outside the contact, and its response e = K d. The passes return sums over the cells, and store the sums of each block
!> in `blocks`. The innermost loops are in module `schur_sweeps`.
!>
!> The stencil is applied first to the rows whose neighbours belong to the same row of blocks, and to the two rows at its
!> edges once the next row of blocks has been passed, while both are in the cache. Each thread passes portions of several
!> rows of blocks. The edges of the first and the last one of a portion follow after all portions, because they read
!> rows that another thread or process forms. All sums are formed in the same order whatever the portions are.
module schur_passes
   use active_blocks, only : active_blocks_type
   use asperity_precision, only : dp, sp
   use coarse_level, only : coarse_level_type, edge_rows, inner_rows
   use field_sums, only : row_totals
   use normal_sweeps, only : residual_cells
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : row_halo_type
   use schur_blocks, only : schur_blocks_type
   use schur_coarse, only : om
   use schur_sweeps, only : image_cells, image_sums_type, last_response_cells, response_cells, &
      response_sums_type, search_cells, start_search_cells
   implicit none
   private

   public :: residual_pass, schur_fields_type, search_pass, step_type

   integer, parameter :: together = 16            !! rows of blocks of a portion, at most
   integer, parameter :: portions_of_thread = 8   !! at least, if there are enough rows of blocks

   !> The fields of the preconditioner and its stencil.
   type :: schur_fields_type
      type(grid_type) :: grid
      integer :: columns(2) = 0                          !! first and last column with the margin
      integer :: rows(2) = 0                             !! first and last row of this process with the margin
      type(row_halo_type) :: rim                         !! rows of other processes that the stencil reads
      integer :: threads = 1
      real(sp) :: weights(2) = 0.0_sp                    !! of the stencil, along x and y
      real(sp), allocatable :: centre(:, :)              !! in its middle, (columns, numbers of rows of a block)
      real(dp) :: per_pressure = 1.0_dp                  !! makes a pressure a number about as large as a residual
      type(schur_blocks_type) :: blocks                  !! coarse parts and sums of each block
      type(image_sums_type) :: sums                      !! of the residual and its image
      ! Over the columns and rows; the residual and the direction have one more on each side:
      real(sp), pointer, contiguous :: residual(:, :) => null()   !! v on S, 0 on N
      real(sp), pointer, contiguous :: before(:, :) => null()     !! the residual of the iteration before
      real(sp), allocatable :: search(:, :)              !! d, 0 on S
      real(sp), pointer, contiguous :: image(:, :) => null()      !! b
      real(sp), pointer, contiguous :: response(:, :) => null()   !! e of the last step
      real(sp) :: length = 0.0_sp                        !! multiple of e that is still to be added to b
   contains
      procedure :: response_row
   end type schur_fields_type

   !> Numbers for each column of a row of blocks. A thread allocates them once for all its rows of blocks.
   type :: row_numbers_type
      real(sp), allocatable :: column(:)                 !! sums over the rows of a block
      real(sp), allocatable :: count(:)                  !! numbers of cells of N likewise
      real(sp), allocatable :: added(:)                  !! coarse part that the image lacks
      real(sp), allocatable :: corrected(:)              !! coarse part of W b
      real(sp), allocatable :: below(:), above(:)        !! for `row_beside`
   end type row_numbers_type

   !> The numbers of a step that a pass needs.
   type :: step_type
      logical :: first = .false., last = .false.
      real(sp) :: beta = 0.0_sp                          !! multiple of the old direction
   end type step_type

contains

   !> Compute the residual scale (level - gap) on S = {P > 0 or gap < level}, its block means and its image by K. The
   !> residual before is kept: the two fields change places, which costs no pass.
   subroutine residual_pass(self, coarse, active, scale, level, pressure, gap)
      class(schur_fields_type), intent(inout) :: self
      type(coarse_level_type), intent(inout) :: coarse
      type(active_blocks_type), intent(in) :: active
      real(dp), intent(in) :: scale                      !! a power of two
      real(dp), intent(in) :: level                      !! m
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())
      type(image_sums_type), allocatable :: rows(:)
      type(row_numbers_type) :: numbers
      real(sp), pointer, contiguous :: oldest(:, :)
      real(dp) :: totals(2)
      integer :: c, jb, strips(2)

      oldest => self%before
      self%before => self%residual
      self%residual => oldest
      allocate (rows(self%rows(1):self%rows(2)))
      !$omp parallel default(none) shared(self, coarse, active, scale, level, pressure, gap, rows) &
      !$omp private(c, jb, strips, numbers) num_threads(self%threads)
      call allocate_numbers(self%columns, numbers)
      !$omp do schedule(dynamic)
      do c = 1, portions(self, coarse)
         strips = portion(self, coarse, c)
         do jb = strips(1), strips(2)
            if (jb >= coarse%strips(1) .and. jb <= coarse%strips(2)) &
               call residual_rows(self, coarse, active, jb, scale, level, pressure, gap)
            self%blocks%image_off(:, jb) = 0.0_dp
            self%blocks%cells_off(:, jb) = 0.0_dp
            self%blocks%far(:, jb) = cells_beyond_rim(coarse, active, jb)
            call image_rows(self, coarse, active, jb, inner_rows(coarse, jb), numbers, rows)
            if (jb - 1 > strips(1)) call image_rows(self, coarse, active, jb - 1, edge_rows(coarse, jb - 1), numbers, rows)
         end do
      end do
      !$omp end do
      !$omp single
      call self%rim%close_rim(self%residual(:, 0:self%grid%rows() + 1))
      !$omp end single
      !$omp do schedule(dynamic)
      do c = 1, portions(self, coarse)
         strips = portion(self, coarse, c)
         do jb = strips(1), strips(2), max(strips(2) - strips(1), 1)
            call image_rows(self, coarse, active, jb, edge_rows(coarse, jb), numbers, rows)
         end do
      end do
      !$omp end parallel
      call coarse%share_blocks(coarse%mean)
      call coarse%share_blocks(self%blocks%image_off)
      call coarse%share_blocks(self%blocks%cells_off)
      call coarse%share_blocks(self%blocks%far)
      totals = row_totals(transpose(reshape([rows%form, rows%square], [size(rows), 2])))
      self%sums = image_sums_type(totals(1), totals(2))
   end subroutine residual_pass

   !> Compute the residual and its block means in the rows of a block.
   subroutine residual_rows(self, coarse, active, jb, scale, level, pressure, gap)
      class(schur_fields_type), intent(inout) :: self
      type(coarse_level_type), intent(inout) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      real(dp), intent(in) :: scale, level
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())
      real(sp), allocatable :: column(:)
      integer :: j, k

      allocate (column(self%columns(1):self%columns(2)), source=0.0_sp)
      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         do k = 1, active%runs(j)
            associate (first => active%first(k, j))
               call residual_cells(active%last(k, j) - first + 1, scale, level, self%per_pressure, pressure(first, j), &
                  gap(first, j), self%residual(first:, j), column(first))
            end associate
         end do
         call close_row(self, self%residual(:, j))
      end do
      call coarse%sum_blocks(column, coarse%mean(:, jb))
      coarse%mean(:, jb) = coarse%mean(:, jb)/coarse%cells
   end subroutine residual_rows

   !> The number of cells beyond the rim in each block of a row of blocks.
   pure function cells_beyond_rim(coarse, active, jb) result(cells)
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      real(dp) :: cells(coarse%nx)
      integer :: b, k, columns

      cells(:) = coarse%sizes_x
      do k = 1, active%wide_runs(jb)
         associate (first => active%wide_first(k, jb), last => active%wide_last(k, jb))
            do b = coarse%block_x(first), coarse%block_x(last)
               columns = min(last, coarse%first_x(b) + coarse%sizes_x(b) - 1) - max(first, coarse%first_x(b)) + 1
               cells(b) = cells(b) - columns
            end do
         end associate
      end do
      cells(:) = (coarse%first_y(jb + 1) - coarse%first_y(jb))*cells
   end function cells_beyond_rim

   !> Compute the image of the residual by K in some rows of a block.
   subroutine image_rows(self, coarse, active, jb, which, numbers, rows)
      class(schur_fields_type), intent(inout), target :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      integer, intent(in) :: which(3)                    !! first and last row, and their distance
      type(row_numbers_type), intent(inout) :: numbers
      type(image_sums_type), intent(inout) :: rows(self%rows(1):)
      real(sp), pointer, contiguous :: centre(:)
      integer :: j, k

      numbers%column(:) = 0.0_sp
      numbers%count(:) = 0.0_sp
      centre(self%columns(1):) => self%centre(:, coarse%first_y(jb + 1) - coarse%first_y(jb))
      do j = which(1), which(2), which(3)
         rows(j) = image_sums_type()
         do k = 1, active%wide_runs(jb)
            associate (first => active%wide_first(k, jb))
               call image_cells(active%wide_last(k, jb) - first + 1, centre(first:), self%weights, &
                  self%residual(first:, j - 1), self%residual(first - 1:, j), self%residual(first:, j + 1), &
                  self%image(first:, j), numbers%column(first), numbers%count(first), rows(j))
            end associate
         end do
      end do
      call coarse%add_blocks(numbers%column, self%blocks%image_off(:, jb))
      call coarse%add_blocks(numbers%count, self%blocks%cells_off(:, jb))
   end subroutine image_rows

   !> Allocate the numbers for each column of a row of blocks.
   pure subroutine allocate_numbers(columns, numbers)
      integer, intent(in) :: columns(2)                  !! first and last column, with the margin
      type(row_numbers_type), intent(out) :: numbers

      associate (a => columns(1), b => columns(2))
         allocate (numbers%column(a:b), numbers%count(a:b), numbers%added(a:b), numbers%corrected(a:b))
         allocate (numbers%below(a:b), numbers%above(a:b))
      end associate
   end subroutine allocate_numbers

   !> Do the pass of a step: add the step before to the image, and form the direction and its response.
   subroutine search_pass(self, coarse, active, step, sums)
      class(schur_fields_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      type(step_type), intent(in) :: step
      type(response_sums_type), intent(out) :: sums
      type(response_sums_type), allocatable :: rows(:)
      type(row_numbers_type) :: numbers
      real(dp) :: totals(3)
      integer :: c, jb, strips(2)

      allocate (rows(self%rows(1):self%rows(2)))
      !$omp parallel default(none) shared(self, coarse, active, step, rows) private(c, jb, strips, numbers) &
      !$omp num_threads(self%threads)
      call allocate_numbers(self%columns, numbers)
      !$omp do schedule(dynamic)
      do c = 1, portions(self, coarse)
         strips = portion(self, coarse, c)
         do jb = strips(1), strips(2)
            self%blocks%response_off(:, jb) = 0.0_dp
            call search_rows(self, coarse, active, jb, step, numbers)
            call response_rows(self, coarse, active, jb, inner_rows(coarse, jb), step%last, numbers, rows)
            if (jb - 1 > strips(1)) &
               call response_rows(self, coarse, active, jb - 1, edge_rows(coarse, jb - 1), step%last, numbers, rows)
         end do
      end do
      !$omp end do
      !$omp single
      call self%rim%close_rim(self%search(:, 0:self%grid%rows() + 1))
      !$omp end single
      !$omp do schedule(dynamic)
      do c = 1, portions(self, coarse)
         strips = portion(self, coarse, c)
         do jb = strips(1), strips(2), max(strips(2) - strips(1), 1)
            call response_rows(self, coarse, active, jb, edge_rows(coarse, jb), step%last, numbers, rows)
         end do
      end do
      !$omp end parallel
      call coarse%share_blocks(self%blocks%response_off)
      totals = row_totals(transpose(reshape([rows%form, rows%cross, rows%square], [size(rows), 3])))
      sums = response_sums_type(totals(1), totals(2), totals(3))
   end subroutine search_pass

   !> Compute the image and the search direction in the rows of a block.
   subroutine search_rows(self, coarse, active, jb, step, numbers)
      class(schur_fields_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb
      type(step_type), intent(in) :: step
      type(row_numbers_type), intent(inout) :: numbers
      integer :: j, k, n

      if (active%wide_runs(jb) == 0) return
      call coarse%spread_blocks(self%blocks%pending(:, jb), self%columns(1), numbers%added)
      call coarse%spread_blocks(self%blocks%correction(:, jb), self%columns(1), numbers%corrected)
      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         do k = 1, active%wide_runs(jb)
            associate (first => active%wide_first(k, jb))
               n = active%wide_last(k, jb) - first + 1
               if (step%first) then
                  call start_search_cells(n, real(om, sp), numbers%added(first), numbers%corrected(first), &
                     self%residual(first:, j), self%image(first:, j), self%search(first, j))
               else
                  call search_cells(n, real(om, sp), self%length, step%beta, numbers%added(first), &
                     numbers%corrected(first), self%response(first:, j), self%image(first:, j), self%search(first, j))
               end if
            end associate
         end do
         call close_runs(self, active, jb, self%search(:, j))
      end do
   end subroutine search_rows

   !> Compute the response to the search direction in some rows of a block.
   subroutine response_rows(self, coarse, active, jb, which, last, numbers, rows)
      class(schur_fields_type), intent(inout), target :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb
      integer, intent(in) :: which(3)                    !! first and last row, and their distance
      logical, intent(in) :: last
      type(row_numbers_type), intent(inout), target :: numbers
      type(response_sums_type), intent(inout) :: rows(self%rows(1):)
      real(sp), pointer, contiguous :: centre(:), south(:), north(:)
      integer :: j, k, n

      if (active%wide_runs(jb) == 0) return
      numbers%column(:) = 0.0_sp
      centre(self%columns(1):) => self%centre(:, coarse%first_y(jb + 1) - coarse%first_y(jb))
      do j = which(1), which(2), which(3)
         south(self%columns(1):) => row_beside(self, coarse, active, jb, [j, j - 1], numbers%below)
         north(self%columns(1):) => row_beside(self, coarse, active, jb, [j, j + 1], numbers%above)
         do k = 1, active%wide_runs(jb)
            associate (first => active%wide_first(k, jb))
               n = active%wide_last(k, jb) - first + 1
               if (last) then
                  call last_response_cells(n, centre(first:), self%weights, south(first:), &
                     self%search(first - 1, j), north(first:), self%response(first:, j), rows(j))
               else
                  call response_cells(n, centre(first:), self%weights, south(first:), self%search(first - 1, j), north(first:), &
                     self%image(first:, j), self%response(first:, j), numbers%column(first), rows(j))
               end if
            end associate
         end do
      end do
      if (.not. last) call coarse%add_blocks(numbers%column, self%blocks%response_off(:, jb))
   end subroutine response_rows

   !> The row of the search direction beside one of a row of blocks. Where it lies beyond the rim, it has the values of the
   !> row itself: the stencil does not join the cells of the rim with those beyond it, where d is constant in a block.
   function row_beside(self, coarse, active, jb, j, edge) result(row)
      class(schur_fields_type), intent(in), target :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      integer, intent(in) :: j(2)                        !! the row and the one beside it
      real(sp), contiguous, intent(inout), target :: edge(:)   !! may be used for the result
      real(sp), pointer, contiguous :: row(:)
      integer :: beside

      row => self%search(self%columns(1):self%columns(2), j(2))
      if (j(2) >= coarse%first_y(jb) .and. j(2) < coarse%first_y(jb + 1)) return
      beside = jb + j(2) - j(1)
      if (self%grid%boundary == boundary_periodic) beside = modulo(beside - 1, coarse%ny) + 1
      if (beside < 1 .or. beside > coarse%ny) return     ! beyond the margin, where the search direction is 0
      if (active%same_runs(jb, beside)) return

      call join_rows(active, jb, beside, self%search(self%columns(1):self%columns(2), j(1)), row, self%columns(1), edge)
      row => edge
   end function row_beside

   !> Form a row that has the values of one row beside it, where that lies in the rim, and else those of the row itself. Only
   !> the places in the runs of the row are set.
   pure subroutine join_rows(active, jb, beside, own, other, first, row)
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      integer, intent(in) :: beside                      !! that of the row beside it
      integer, intent(in) :: first                       !! column
      real(sp), intent(in) :: own(first:), other(first:)
      real(sp), intent(inout) :: row(first:)
      integer :: from, k, m, runs

      runs = active%wide_runs(beside)
      m = 1
      do k = 1, active%wide_runs(jb)
         from = active%wide_first(k, jb)
         associate (last => active%wide_last(k, jb))
            row(from:last) = other(from:last)
            do while (m <= runs .and. from <= last)
               associate (a => active%wide_first(m, beside), b => active%wide_last(m, beside))
                  if (a > last) exit
                  row(from:a - 1) = own(from:a - 1)
                  from = max(from, b + 1)
                  if (b > last) exit
               end associate
               m = m + 1
            end do
            row(from:last) = own(from:last)
         end associate
      end do
   end subroutine join_rows

   !> Set the cells beside the ends of the runs of a row to those at the ends (see `row_beside`). On a periodic grid a run may
   !> go on at the other end of the row; beyond the margin of a free grid the search direction remains 0.
   pure subroutine close_runs(self, active, jb, row)
      class(schur_fields_type), intent(in) :: self
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: jb                          !! row of blocks
      real(sp), intent(inout) :: row(self%columns(1) - 1:)
      integer :: k, n

      n = active%wide_runs(jb)
      do k = 1, n
         associate (a => active%wide_first(k, jb), b => active%wide_last(k, jb))
            row(a - 1) = row(a)
            row(b + 1) = row(b)
         end associate
      end do
      if (self%grid%boundary /= boundary_periodic) then
         row(self%columns(1) - 1) = 0.0_sp
         row(self%columns(2) + 1) = 0.0_sp
         return
      end if
      if (n == 0) return
      if (active%wide_first(1, jb) > 1 .or. active%wide_last(n, jb) < self%grid%nx) return
      row(0) = row(self%grid%nx)
      row(self%grid%nx + 1) = row(1)
   end subroutine close_runs

   !> The number of portions of the rows of blocks that threads pass one after the other. There are several for each
   !> thread, because some take longer than others.
   pure integer function portions(self, coarse)
      class(schur_fields_type), intent(in) :: self
      type(coarse_level_type), intent(in) :: coarse

      associate (strips => coarse%all_strips(2) - coarse%all_strips(1) + 1)
         portions = min(max((strips + together - 1)/together, portions_of_thread*self%threads), strips)
      end associate
   end function portions

   !> The first and the last row of blocks of a portion.
   pure function portion(self, coarse, c) result(strips)
      class(schur_fields_type), intent(in) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: c
      integer :: strips(2)
      integer :: count, parts

      count = coarse%all_strips(2) - coarse%all_strips(1) + 1
      parts = portions(self, coarse)
      strips = coarse%all_strips(1) + [(c - 1)*count/parts, c*count/parts - 1]
   end function portion

   !> The row j of e, of which b lacks the multiple `length`. Where the length is 0, e is not set and may hold any
   !> numbers; its factor 0 then meets the row of b instead.
   function response_row(self, j) result(row)
      class(schur_fields_type), intent(in) :: self
      integer, intent(in) :: j
      real(sp), pointer, contiguous :: row(:)

      row => self%image(:, j)
      if (self%length > 0.0_sp) row => self%response(:, j)
   end function response_row

   !> Set the cells beside the ends of a row of a periodic grid: those of the other end. Beyond the margin of a free grid they
   !> remain 0.
   pure subroutine close_row(self, row)
      class(schur_fields_type), intent(in) :: self
      real(sp), intent(inout) :: row(:)              !! all columns, with one more on each side

      if (self%grid%boundary /= boundary_periodic) return
      associate (n => size(row))
         row(1) = row(n - 1)
         row(n) = row(2)
      end associate
   end subroutine close_row

end module schur_passes
