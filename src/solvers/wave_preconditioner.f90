!> The preconditioner of the normal solver for very oblong cells.
!>
!> On a fixed contact set S the inverse of the matrix A_SS is the Schur complement of B = A^-1 (module
!> `schur_preconditioner`). For very oblong cells no stencil fits B, because the wave numbers of the grid along the short
!> side of a cell are many times larger than along the long side. B is therefore applied as a convolution, in single
!> precision and at the cost of two transforms of the whole grid.
!>
!> The residual must also be extended to the cells N outside the contact. With 0 on N, it would have a step at each edge
!> of the contact, whose short waves B multiplies by much more than the means of the rows. But these means matter:
!> they are the waves along the long side of the cells, under which the solid is most compliant. A linear map E
!> therefore keeps r on S, and sets the cells of N to the mean of r over the part of S in the same block of the coarse
!> level. Blocks are about as long as they are wide, in metres, so that a block of very oblong cells is a part of a row
!> or a whole one. Then
!>     M r = E^T B E r,
!> which is symmetric and positive definite. E^T adds the sum of the image over N, divided by the number of cells of
!> S in the block, to each of these cells.
!>
!> For the same reason the solver keeps the sums of the blocks when it makes negative trial pressures 0
!> (`keep_block_sums` of module `normal_projection`). The contact changes in almost every iteration, and the factor
!> of Fletcher and Reeves would then keep directions that have become useless. The factor of Polak and Ribiere
!> forgets them. It needs the residual before, which is kept in the field of the search direction.
!>
!> Memory: half a field for the spectrum and an eighth for the symbol.
module wave_preconditioner
   use active_blocks, only : active_blocks_type
   use coarse_level, only : coarse_level_type
   use asperity_errors, only : error_type
   use fft_conv, only : columns_apply, convolution_type, new_symbol_operator
   use field_sums, only : row_totals
   use kernels, only : kernel_type
   use asperity_precision, only : dp, pi, sp
   use regular_grid, only : grid_type
   use row_sharing, only : sharing_on_grid
   use transform_shape, only : shape_of_rows
   implicit none
   private

   public :: new_wave_preconditioner, wave_preconditioner_type

   !> Stiffness of the mean at a given approach over that of the longest wave along the short side of the grid: the one for
   !> which random contacts take the fewest iterations.
   real(dp), parameter :: given_approach = 6.0_dp

   !> The preconditioner. A variable of this type must not be copied.
   type :: wave_preconditioner_type
      type(grid_type), private :: grid
      logical :: fixed_load = .true.                     !! the load is given, not the approach
      type(convolution_type), private :: stiffness       !! B without the mean
      real(dp), private :: of_mean(2) = 0.0_dp           !! B of the mean if the load or the approach is given
      real(dp), allocatable, private :: inside(:, :)     !! cells of S in each block, (blocks along x, own rows)
      real(dp), allocatable, private :: level(:, :)      !! mean of r over these cells
   contains
      procedure :: set_residual
      procedure :: apply
      procedure :: transforms
      procedure :: destroy
   end type wave_preconditioner_type

contains

   !> Make the preconditioner of a grid. Collective.
   subroutine new_wave_preconditioner(self, grid, coarse, error)
      type(wave_preconditioner_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(coarse_level_type), intent(in) :: coarse
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      real(dp), allocatable :: symbol(:, :)
      integer :: modes(2)

      self%grid = grid
      allocate (self%inside(coarse%nx, coarse%strips(1):coarse%strips(2)), source=0.0_dp)
      allocate (self%level(coarse%nx, coarse%strips(1):coarse%strips(2)), source=0.0_dp)
      call new_symbol_operator(self%stiffness, shape_of_rows(grid%nx, sharing_on_grid(grid), 1), error, &
         single=.true.)
      if (allocated(error)) return
      modes = self%stiffness%modes()
      allocate (symbol(modes(1):modes(2), 0:grid%ny/2))
      call stiffness_symbols(grid, coarse%h, coarse%kernel, modes(1), symbol)
      call self%stiffness%set_symbol(symbol)
      ! Under a given load the mean of the direction is removed, so that the factor of the mean hardly matters. At a
      ! given approach it determines the load, and the stiffness of a wave along the long side would take many
      ! iterations.
      self%of_mean = coarse%kernel%compliance(2.0_dp*pi/coarse%h)*[1.0_dp, given_approach] &
         /[coarse%kernel%compliance(pi/max(grid%lx, grid%ly)), coarse%kernel%compliance(pi/min(grid%lx, grid%ly))]
   end subroutine new_wave_preconditioner

   !> Compute the stiffness of the solid for the waves of a periodic grid, relative to that for a wave of the length h,
   !> and 0 for the mean.
   pure subroutine stiffness_symbols(grid, h, kernel, first, symbol)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: h                        !! side of a square cell of the same area, m
      type(kernel_type), intent(in) :: kernel          !! normal response of the solid
      integer, intent(in) :: first                     !! wave number along x of the first column
      real(dp), intent(out) :: symbol(first:, 0:)
      real(dp) :: reference, row(first:ubound(symbol, 1), 1)
      integer :: j, start

      if (size(symbol, 1) == 0) return
      reference = kernel%compliance(2.0_dp*pi/h)
      do j = 0, ubound(symbol, 2)
         call kernel%grid_row(grid, first, j, row)
         start = merge(1, first, first == 0 .and. j == 0)
         symbol(:start - 1, j) = 0.0_dp
         symbol(start:, j) = reference/row(start:, 1)
      end do
   end subroutine stiffness_symbols

   !> Compute the residual r = scale (level - gap) on S, and zero elsewhere.
   !>
   !> S contains the cells with pressure. A cell without pressure joins S if its gap is below the level and also below
   !> that of its block, the mean gap weighted by the pressure. If the pressures of a block are too small or too large
   !> on the whole, all its cells have a gap below or above the level. Without the second condition whole rows would then
   !> join S at once, and would leave it as soon as their mean is right.
   subroutine set_residual(self, coarse, active, scale, level, pressure, gap, residual)
      class(wave_preconditioner_type), intent(in) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      real(dp), intent(in) :: scale                    !! a power of two
      real(dp), intent(in) :: level                    !! m
      real(dp), intent(in) :: pressure(:, :), gap(:, :)   !! [nx, rows]
      real(sp), intent(inout) :: residual(0:, 0:)      !! (0:nx+1, 0:rows+1)
      real(dp) :: limit(self%grid%nx)
      integer :: i, j, k, jb

      !$omp parallel do default(none) shared(self, coarse, active, scale, level, pressure, gap, residual) &
      !$omp private(i, j, k, jb, limit) schedule(dynamic) num_threads(self%stiffness%threads)
      do jb = coarse%strips(1), coarse%strips(2)
         limit(:) = block_depth(self, coarse, jb, level, pressure, gap)
         do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
            do k = 1, active%runs(j)
               do i = active%first(k, j), active%last(k, j)
                  residual(i, j) = 0.0_sp
                  if (pressure(i, j) > 0.0_dp .or. level - gap(i, j) > limit(i)) &
                     residual(i, j) = real(scale*(level - gap(i, j)), sp)
               end do
            end do
         end do
      end do
   end subroutine set_residual

   !> The depth of the mean gap of each block of a row of blocks below the level, weighted by the pressure; 0 if it is
   !> above. There is one value per cell along x.
   function block_depth(self, coarse, jb, level, pressure, gap) result(depth)
      class(wave_preconditioner_type), intent(in) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb                        !! row of blocks
      real(dp), intent(in) :: level                    !! m
      real(dp), intent(in) :: pressure(:, :), gap(:, :)
      real(dp), allocatable :: depth(:)
      real(dp), allocatable :: load(:), moment(:)
      real(dp) :: loads(coarse%nx), depths(coarse%nx)
      integer :: j

      allocate (load(self%grid%nx), moment(self%grid%nx), source=0.0_dp)
      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         load(:) = load + pressure(:, j)
         moment(:) = moment + pressure(:, j)*(level - gap(:, j))
      end do
      call coarse%sum_blocks(load, loads)
      call coarse%sum_blocks(moment, depths)
      where (loads > 0.0_dp)
         depths = max(depths/max(loads, tiny(1.0_dp)), 0.0_dp)
      else where
         depths = 0.0_dp
      end where
      depth = depths(coarse%block_x)
   end function block_depth

   !> Compute M r = image + pending on S. Collective.
   subroutine apply(self, coarse, residual, before, image, pending, form, overlap)
      class(wave_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(sp), intent(in) :: residual(0:, 0:)         !! (0:nx+1, 0:rows+1), r on S, 0 on N
      real(sp), intent(inout) :: before(0:, 0:)        !! r of the last call, which is replaced by this one
      real(sp), intent(inout) :: image(:, :)           !! [nx, rows], B E r
      real(dp), intent(inout) :: pending(:, coarse%held(1):)   !! the part from N, (blocks along x, held rows)
      real(dp), intent(out) :: form                    !! r.M r
      real(dp), intent(out) :: overlap                 !! (r of the last call).M r
      real(dp), allocatable :: rows(:, :)
      real(dp) :: totals(2), of_mean
      integer :: jb

      allocate (rows(2, self%grid%rows()), source=0.0_dp)
      !$omp parallel do default(none) shared(self, coarse, residual, rows) private(jb) schedule(dynamic) &
      !$omp num_threads(self%stiffness%threads)
      do jb = coarse%strips(1), coarse%strips(2)
         call extend_strip(self, coarse, jb, residual, rows)
      end do
      totals = row_totals(rows)
      of_mean = merge(self%of_mean(1), self%of_mean(2), self%fixed_load)*totals(1)/self%grid%cells()
      call self%stiffness%columns(columns_apply)

      !$omp parallel do default(none) shared(self, coarse, residual, of_mean, before, image, pending, rows) private(jb) &
      !$omp schedule(dynamic) num_threads(self%stiffness%threads)
      do jb = coarse%strips(1), coarse%strips(2)
         image(:, coarse%first_y(jb):coarse%first_y(jb + 1) - 1) = real(of_mean, sp)
         call image_strip(self, coarse, jb, residual, before, image, pending(:, jb), rows)
      end do
      totals = row_totals(rows)
      form = totals(1)
      overlap = totals(2)
   end subroutine apply

   !> Extend the residual in a row of blocks, sum its rows and transform them.
   subroutine extend_strip(self, coarse, jb, residual, rows)
      type(wave_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb                        !! row of blocks
      real(sp), intent(in) :: residual(0:, 0:)
      real(dp), intent(inout) :: rows(:, :)            !! [2, rows], of which the first is set
      real(sp), allocatable :: count(:), column(:)
      real(dp), allocatable :: row(:)
      integer :: j

      allocate (count(self%grid%nx), column(self%grid%nx), source=0.0_sp)
      allocate (row(self%grid%nx))
      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         column(:) = column + residual(1:self%grid%nx, j)
         count(:) = count + merge(1.0_sp, 0.0_sp, abs(residual(1:self%grid%nx, j)) > 0.0_sp)
      end do
      call coarse%sum_blocks(count, self%inside(:, jb))
      call coarse%sum_blocks(column, self%level(:, jb))
      self%level(:, jb) = self%level(:, jb)/max(self%inside(:, jb), 1.0_dp)

      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         row(:) = self%level(coarse%block_x, jb)
         where (abs(residual(1:self%grid%nx, j)) > 0.0_sp) row = real(residual(1:self%grid%nx, j), dp)
         rows(1, j) = sum(row)
         call self%stiffness%forward_row(1, j, row)
      end do
   end subroutine extend_strip

   !> Compute the image in a row of blocks, its part from N, and the products of both with the residuals in each row.
   subroutine image_strip(self, coarse, jb, residual, before, image, pending, rows)
      type(wave_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb                        !! row of blocks
      real(sp), intent(in) :: residual(0:, 0:)
      real(sp), intent(inout) :: before(0:, 0:)
      real(sp), intent(inout) :: image(:, :)           !! in: the image of the mean
      real(dp), intent(inout) :: pending(:)            !! [blocks along x]
      real(dp), intent(inout) :: rows(:, :)            !! [2, rows]
      real(sp), allocatable :: column(:)
      real(dp), allocatable :: row(:)
      integer :: j

      allocate (column(self%grid%nx), source=0.0_sp)
      allocate (row(self%grid%nx))
      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         call self%stiffness%backward_row(1, j, row)
         image(:, j) = image(:, j) + real(row, sp)
         where (.not. abs(residual(1:self%grid%nx, j)) > 0.0_sp) column = column + image(:, j)
      end do
      call coarse%sum_blocks(column, pending)
      pending(:) = pending/max(self%inside(:, jb), 1.0_dp)

      do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
         row(:) = image(:, j) + pending(coarse%block_x)
         where (.not. abs(residual(1:self%grid%nx, j)) > 0.0_sp) row = 0.0_dp
         rows(1, j) = sum(residual(1:self%grid%nx, j)*row)
         rows(2, j) = sum(before(1:self%grid%nx, j)*row)
         before(:, j) = residual(:, j)
      end do
   end subroutine image_strip

   !> Transforms of the whole grid done so far.
   pure function transforms(self) result(count)
      class(wave_preconditioner_type), intent(in) :: self
      real(dp) :: count

      count = real(self%stiffness%ffts, dp)
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(wave_preconditioner_type), intent(inout) :: self

      call self%stiffness%destroy()
   end subroutine destroy

end module wave_preconditioner
