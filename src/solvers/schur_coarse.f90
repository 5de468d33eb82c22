!> The coarse part of the local model that module `schur_preconditioner` uses.
!>
!> The model of the inverse operator B ~ |q| (wave numbers per cell) is a stencil of symbol
!>     c0 + c1 (4 - 2 cos kx - 2 cos ky),
!> which fits a multiple of |q| well if q is large. The part that is missing below pi/16 per cell is added on the grid
!> of block means (module `coarse_level`), so that the multiple falls from that of the stencil there to 3 for the
!> longest waves, about that of the short ones. With c0 = 0.7 the sum of both fits |q| within a factor of 1.8. (With
!> c0 = 1 the factor is larger, but this is better if the residual is not extended.)
!>
!> The blocks of a grid may differ in their numbers of cells (`evenness` of module `coarse_level`). The part c0 of the stencil
!> is then weighted such that its sum over each block is the same, and the missing part is a convolution of block means, not
!> sums. Both cancel for a uniform field, as they must for long waves.
!>
!> The same grid holds the coarse part of W, an approximate inverse of the model on the cells N outside the
!> contact:
!>     w IFFT( symbol FFT( w R p ) ),   w = (share of N in the block)^0.3,   symbol = 1/(B + shift) - om.
!> The shift grows with the part of the grid that is not in N: the coarse functions are cut off there,
!> which would make their eigenvalues too large without it.
!>
!> On a free grid the transforms are twice as long, with zeros beyond the map: its opposite sides are not neighbours, and a
!> contact may be moved by waves longer than the map.
!>
!> Processes may share the rows of blocks. Each then holds the numbers of its own rows, and the symbols of the
!> wave numbers that it transforms.
!>
!> All numbers were chosen by trials on rough contacts; none of them is critical.
module schur_coarse
   use asperity_errors, only : error_type
   use fft_conv, only : columns_apply, convolution_type, new_symbol_operator
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, pi, sp
   use asperity_threads, only : least_parallel_cells
   use regular_grid, only : grid_type
   use row_column_single, only : new_row_column, row_column_type
   use row_sharing, only : row_sharing_type
   use influence, only : transform_length
   use transform_shape, only : shape_of_rows, transform_shape_type
   implicit none
   private

   public :: new_schur_coarse, schur_coarse_type

   real(dp), parameter, public :: stencil_c0 = 0.7_dp
   real(dp), parameter, public :: stencil_c1 = 1.80063_dp   !! for cells of unit size
   real(dp), parameter, public :: om = 0.2_dp  !! constant part of W
   real(dp), parameter :: band = pi/16.0_dp    !! wave number per cell below which the coarse level acts
   real(dp), parameter :: of_long_waves = 3.0_dp   !! model over wave number per cell for the longest waves
   real(dp), parameter :: least_shift = 0.03_dp, contact_shift = 0.7_dp
   real(dp), parameter :: power = 0.3_dp       !! of the share of N in w

   !> The coarse part. A variable of this type must not be copied.
   type :: schur_coarse_type
      real(dp), private :: cells = 1.0_dp                !! cells of a block
      real(dp), private :: blocks = 1.0_dp               !! number of blocks
      real(dp), private :: points = 1.0_dp               !! points of the transforms
      logical, private :: shared = .false.               !! other processes hold the other rows of blocks
      integer, private :: threads = 1
      real(dp), allocatable, private :: powers(:)        !! w for each number of cells of N in a block, from 0
      real(dp), allocatable, private :: weight(:, :)     !! w of each block, [blocks along x, rows]
      type(convolution_type), private :: missing         !! the part of B that the stencil lacks
      type(row_column_type), private :: transform        !! for W
      real(dp), allocatable, private :: model(:, :)      !! symbol of B, for the modes of this process
      real(sp), allocatable, private :: symbol(:, :, :)  !! of W, with the factor of the transforms
      real(dp), private :: taken = -1.0_dp               !! part of the grid for which it was made
      integer, private :: products = 0                   !! products with W so far
   contains
      procedure :: add_missing
      procedure :: set_weights
      procedure :: weigh
      procedure :: transforms
      procedure :: destroy
   end type schur_coarse_type

contains

   !> Make the coarse part for a grid of blocks. Collective where processes share the rows.
   subroutine new_schur_coarse(self, grid, h, blocks_x, sharing, threads, error)
      type(schur_coarse_type), intent(out) :: self
      type(grid_type), intent(in) :: grid              !! with its margin
      real(dp), intent(in) :: h                        !! side of a square cell of the same area, m
      integer, intent(in) :: blocks_x                  !! blocks along x
      type(row_sharing_type), intent(in) :: sharing    !! of the rows of blocks
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(out) :: error
      type(transform_shape_type) :: shape
      real(dp), allocatable :: symbol(:, :)
      real(dp) :: sides(2)
      integer :: own(2), modes(2), most, k

      shape = shape_of_rows(blocks_x, sharing, 1)
      shape%mx = transform_length(shape%nx, grid%boundary)
      shape%my = transform_length(shape%ny, grid%boundary)
      self%shared = shape%shared
      self%blocks = real(shape%nx, dp)*shape%ny
      self%points = real(shape%mx, dp)*shape%my
      self%cells = grid%cells()/self%blocks
      most = (grid%nx/shape%nx + 1)*(grid%ny/shape%ny + 1)
      allocate (self%powers(0:most), source=[((k/self%cells)**power, k=0, most)])
      self%threads = merge(1, threads, self%blocks < least_parallel_cells)
      allocate (self%weight(shape%nx, shape%rows()), source=0.0_dp)
      call new_symbol_operator(self%missing, shape, error, single=.true.)
      if (.not. allocated(error)) call new_row_column(self%transform, shape, self%threads, error)
      if (allocated(error)) return
      modes = self%missing%modes()
      allocate (symbol(modes(1):modes(2), 0:shape%my/2), self%model(modes(1):modes(2), 0:shape%my/2))
      sides = [grid%lx*shape%mx/shape%nx, grid%ly*shape%my/shape%ny]
      call model_symbols(grid, sides, h, modes(1), symbol, self%model)
      call self%missing%set_symbol(symbol)
      own = self%transform%own_columns()
      allocate (self%symbol(0:shape%my/2, own(1):own(2), 1), source=0.0_sp)
   end subroutine new_schur_coarse

   !> Compute the part of B that the coarse level adds to the stencil, and the sum of both, at its wave vectors.
   pure subroutine model_symbols(grid, sides, h, first, missing, model)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: sides(2)                 !! of the transforms, m
      real(dp), intent(in) :: h                        !! side of a cell, m
      integer, intent(in) :: first                     !! wave number along x of the first column
      real(dp), intent(out) :: missing(first:, 0:), model(first:, 0:)
      real(dp) :: qx, qy, q, q_least, at_band
      integer :: i, j

      at_band = stencil(band, 0.0_dp)/band
      q_least = pi*h/max(merge(0.0_dp, grid%lx, grid%nx == 1), merge(0.0_dp, grid%ly, grid%ny == 1), h)
      do j = 0, ubound(missing, 2)
         do i = first, ubound(missing, 1)
            qx = 2.0_dp*pi*i*h/sides(1)
            qy = 2.0_dp*pi*j*h/sides(2)
            q = max(hypot(qx, qy), q_least)
            model(i, j) = stencil(qx, qy)
            if (q < band) model(i, j) = q*(of_long_waves + (at_band - of_long_waves)*(q/band)**2)
            missing(i, j) = model(i, j) - stencil(qx, qy)
         end do
      end do

   contains

      !> Symbol of the stencil at a wave vector per (square) cell.
      pure function stencil(kx, ky) result(value)
         real(dp), intent(in) :: kx, ky
         real(dp) :: value

         value = stencil_c0 + stencil_c1*(4.0_dp - 2.0_dp*cos(kx) - 2.0_dp*cos(ky))
      end function stencil

   end subroutine model_symbols

   !> Compute the addition of the coarse level to the stencil's product from the sums of a field over the blocks.
   !> Collective.
   subroutine add_missing(self, factor, evenness, sums, addition)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: factor
      real(dp), intent(in) :: evenness(:, :)           !! average number of cells of a block over that of each block
      real(dp), intent(in) :: sums(:, :)               !! over this factor
      real(dp), intent(inout) :: addition(:, :)        !! the same for all cells of a block
      integer :: j

      !$omp parallel do default(none) shared(self, factor, evenness, sums) private(j) num_threads(self%threads)
      do j = 1, size(sums, 2)
         call self%missing%forward_row(1, j, factor*sums(:, j)/self%cells*evenness(:, j))
      end do
      call self%missing%columns(columns_apply)
      !$omp parallel do default(none) shared(self, evenness, addition) private(j) num_threads(self%threads)
      do j = 1, size(addition, 2)
         call self%missing%backward_row(1, j, addition(:, j))
         addition(:, j) = addition(:, j)*evenness(:, j)
      end do
   end subroutine add_missing

   !> Prepare W for a set N. Collective.
   subroutine set_weights(self, cells_off, mean_stiffness)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: cells_off(:, :)          !! numbers of cells of N in the blocks, whole
      real(dp), intent(in) :: mean_stiffness           !! that B has for the mean in addition
      real(dp) :: taken, shift, all_off(1)
      integer :: i, j

      !$omp parallel do default(none) shared(self, cells_off) private(j) num_threads(self%threads)
      do j = 1, size(cells_off, 2)
         self%weight(:, j) = self%powers(int(cells_off(:, j)))
      end do
      ! The shift is rounded, so that the symbol seldom has to be computed again. Numbers of cells are added
      ! without error.
      all_off = sum(cells_off)
      if (self%shared) all_off = global_sum(all_off)
      taken = nint(32.0_dp*(1.0_dp - all_off(1)/(self%cells*self%blocks)))/32.0_dp
      shift = least_shift + contact_shift*taken
      if (abs(taken - self%taken) > 0.0_dp) then
         self%taken = taken
         do i = lbound(self%model, 1), ubound(self%model, 1)
            do j = 0, ubound(self%model, 2)
               self%symbol(j, i, 1) = weight_of(self, self%model(i, j) + shift)
            end do
         end do
      end if
      ! The mean belongs to the process that has the first wave numbers along x.
      if (lbound(self%model, 1) == 0 .and. size(self%model, 1) > 0) &
         self%symbol(0, 0, 1) = weight_of(self, self%model(0, 0) + mean_stiffness + shift)
   end subroutine set_weights

   !> The symbol of the coarse part of W for a stiffness of B, with the factor of the transforms.
   pure function weight_of(self, stiffness) result(weight)
      class(schur_coarse_type), intent(in) :: self
      real(dp), intent(in) :: stiffness
      real(sp) :: weight

      weight = real(max(1.0_dp/stiffness - om, 0.0_dp)/self%points, sp)
   end function weight_of

   !> Compute the coarse part of W p from the sums of p over the cells of N in the blocks. Collective.
   subroutine weigh(self, factor, sums, correction)
      class(schur_coarse_type), intent(inout) :: self
      real(dp), intent(in) :: factor
      real(dp), intent(in) :: sums(:, :)               !! over this factor
      real(dp), intent(inout) :: correction(:, :)      !! the same for all cells of N in a block
      integer :: j

      !$omp parallel do default(none) shared(self, factor, sums) private(j) num_threads(self%threads)
      do j = 1, size(sums, 2)
         call self%transform%forward_row(1, j, self%weight(:, j)*(factor*sums(:, j))/self%cells)
      end do
      call self%transform%columns(self%symbol, 1.0_dp, .false., .true.)
      !$omp parallel do default(none) shared(self, sums, correction) private(j) num_threads(self%threads)
      do j = 1, size(sums, 2)
         call self%transform%backward_row(1, j, correction(:, j))
         correction(:, j) = self%weight(:, j)*correction(:, j)
      end do
      self%products = self%products + 1
   end subroutine weigh

   !> Transforms done so far, in units of a transform of the whole grid.
   pure function transforms(self) result(count)
      class(schur_coarse_type), intent(in) :: self
      real(dp) :: count

      count = (real(self%missing%ffts, dp) + 2.0_dp*self%products)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(schur_coarse_type), intent(inout) :: self

      call self%missing%destroy()
      call self%transform%destroy()
   end subroutine destroy

end module schur_coarse
