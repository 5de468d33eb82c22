!> Keeps the load of the long waves of a step, on a long grid, a long line contact and a free grid.
!>
!> A step consists of the image b = B v on the contact (module `schur_preconditioner`). In the cells outside it b should be
!> zero. After a few conjugate gradients it is nearly zero there, and what is left of it is not part of the step. The load of
!> the step along a wave is then wrong by that of this rest. The energy of such an error is proportional to the wavelength.
!> For the longest wave of all, the uniform pressure, the projection on the given load corrects it. On a periodic grid that
!> is as long as wide hardly any other wave is long enough to matter. But on a long grid the waves along it are, and without
!> a correction many steps of rough contacts raised the energy, so that they took up to ten times as many iterations.
!> (`python tools/campaign_contact.py long` prints the iterations.) The solid below a free grid has longer waves than the
!> grid. There the correction saves a few iterations of large contacts.
!>
!> The rest is therefore given to the contact nearby, as a number per block: the load that is missing in each block is
!> divided by the smoothed number of cells in contact, and smoothed in its turn. The smoothing keeps the sum over the grid,
!> so that all of the rest arrives in the contact. It spreads over the shorter side of the grid, with a tail that
!> falls like the displacement beside a load and reaches the contact wherever it is.
!>
!> At a given approach on a periodic grid a uniform pressure strains nothing, and the load is whatever the contact nearby
!> takes. The mean of the rest is not given to the contact then: it made sparse contacts several times slower.
!>
!> Where cells are released several times in a step (module `normal_iteration`), each call gives what has been left since
!> the call before.
module schur_long_waves
   use active_blocks, only : active_blocks_type
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, sp
   use coarse_level, only : coarse_level_type
   use fft_conv, only : convolution_type, new_symbol_operator
   use normal_sweeps, only : count_acting_cells
   use regular_grid, only : boundary_periodic, grid_type
   use schur_blocks, only : schur_blocks_type
   use transform_shape, only : shape_of_rows
   implicit none
   private

   public :: long_waves_type, new_long_waves

   real(dp), parameter :: least_share = 1e-6_dp   !! least smoothed share of cells in contact by which a load is divided
   real(dp), parameter :: long_line = 1000.0_dp   !! cells of a line contact from which waves along it need care
   real(dp), parameter :: line_width = 512.0_dp   !! cells of a line contact that count as its shorter side

   !> The correction. A variable of this type must not be copied.
   type :: long_waves_type
      logical :: matter = .false.                      !! the grid is long or free, or a long line contact
      real(dp), allocatable :: restored(:, :)          !! part of the step on the contact, (nx, held rows of blocks)
      logical, private :: first = .true.               !! the next call is the first one of a step
      integer, private :: threads = 1
      real(dp), private :: block_size = 1.0_dp         !! cells of a block, on average
      real(dp), allocatable, private :: inside(:, :)   !! cells of each block in contact, (nx, held rows of blocks)
      real(dp), allocatable, private :: acting(:, :)   !! those in which the direction acts
      real(dp), allocatable, private :: given(:, :)    !! rest that the calls before have given
      type(convolution_type), private :: smoother
   contains
      procedure :: begin
      procedure :: restore
      procedure :: transforms
      procedure :: destroy
   end type long_waves_type

contains

   !> Make the correction for the blocks of a grid. Collective.
   subroutine new_long_waves(self, grid, coarse, threads, error)
      type(long_waves_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error)) return
      self%matter = grid%boundary /= boundary_periodic .or. grid%is_long()
      if (min(grid%nx, grid%ny) == 1) self%matter = grid%cells() >= long_line
      if (.not. self%matter) return
      self%block_size = coarse%cells
      self%threads = threads
      associate (nx => coarse%nx, first => coarse%held(1), last => coarse%held(2))
         allocate (self%inside(nx, first:last), self%acting(nx, first:last), source=0.0_dp)
         allocate (self%restored(nx, first:last), self%given(nx, first:last), source=0.0_dp)
      end associate
      call new_symbol_operator(self%smoother, shape_of_rows(coarse%nx, coarse%sharing, 1), error, single=.true.)
      if (.not. allocated(error)) call set_symbols(self, grid, coarse)
   end subroutine new_long_waves

   !> Compute the symbols of the smoothing: 1/(1 + q/q0), where q0 is the wave number of the shorter side.
   subroutine set_symbols(self, grid, coarse)
      type(long_waves_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      type(coarse_level_type), intent(in) :: coarse
      real(dp), allocatable :: symbol(:, :)
      real(dp) :: width
      integer :: i, j, modes(2)

      width = min(grid%lx, grid%ly)
      if (min(grid%nx, grid%ny) == 1) width = line_width*grid%cell_side()
      modes = self%smoother%modes()
      allocate (symbol(modes(1):modes(2), 0:coarse%ny/2))
      do j = 0, coarse%ny/2
         do i = modes(1), modes(2)
            symbol(i, j) = 1.0_dp/(1.0_dp + width*hypot(i/grid%lx, j/grid%ly))
         end do
      end do
      call self%smoother%set_symbol(symbol)
   end subroutine set_symbols

   !> Begin a step.
   pure subroutine begin(self)
      class(long_waves_type), intent(inout) :: self

      self%first = .true.
   end subroutine begin

   !> Find what the step lacks in the cells outside the contact, as a part of the step on the contact. Collective.
   subroutine restore(self, coarse, active, free_mean, offset, residual, direction, blocks)
      class(long_waves_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      logical, intent(in) :: free_mean                 !! a uniform pressure strains nothing, and the load is not given
      real(dp), intent(in) :: offset                   !! number by which the step lowers the direction
      real(sp), intent(in) :: residual(coarse%columns(1) - 1:, coarse%rows(1) - 1:)   !! not 0 in contact
      real(sp), intent(in) :: direction(:, :)          !! before the change, not 0 where it acts
      type(schur_blocks_type), intent(in) :: blocks
      real(dp), dimension(coarse%nx, coarse%held(1):coarse%held(2)) :: missing, nearby

      call count_cells(self, coarse, active, residual, direction)
      ! What the step lacks, summed over the cells of a block. The offset is part of the step.
      if (self%first) then
         missing(:, :) = offset*self%acting + blocks%image_off
      else
         missing(:, :) = blocks%image_off - self%given
      end if
      self%given(:, :) = blocks%image_off
      self%first = .false.
      if (free_mean) missing(:, :) = missing - self%inside*(coarse%block_sum(missing)/max(coarse%block_sum(self%inside), 1.0_dp))

      call self%smoother%apply(self%inside, nearby)
      missing(:, :) = missing/max(nearby, least_share*coarse%cells)
      call self%smoother%apply(missing, self%restored)
      where (.not. self%inside > 0.0_dp) self%restored = 0.0_dp
   end subroutine restore

   !> Count the cells of each block in contact, and those in which the direction acts.
   subroutine count_cells(self, coarse, active, residual, direction)
      type(long_waves_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      real(sp), intent(in) :: residual(coarse%columns(1) - 1:, coarse%rows(1) - 1:), direction(:, :)
      real(sp) :: inside(coarse%columns(1):coarse%columns(2)), acting(coarse%columns(1):coarse%columns(2))
      integer :: j, jb, k

      !$omp parallel do default(none) shared(self, coarse, active, residual, direction) &
      !$omp private(j, jb, k, inside, acting) schedule(dynamic) num_threads(self%threads)
      do jb = coarse%strips(1), coarse%strips(2)
         inside(:) = 0.0_sp
         acting(:) = 0.0_sp
         do j = coarse%first_y(jb), coarse%first_y(jb + 1) - 1
            do k = 1, active%runs(j)
               associate (a => active%first(k, j), b => active%last(k, j))
                  call count_acting_cells(b - a + 1, residual(a:b, j), inside(a:b))
                  call count_acting_cells(b - a + 1, direction(a:b, j), acting(a:b))
               end associate
            end do
         end do
         call coarse%sum_blocks(inside, self%inside(:, jb))
         call coarse%sum_blocks(acting, self%acting(:, jb))
      end do
      call coarse%share_blocks(self%inside)
      call coarse%share_blocks(self%acting)
   end subroutine count_cells

   !> Transforms done so far, in units of a transform of the whole grid.
   pure function transforms(self) result(count)
      class(long_waves_type), intent(in) :: self
      real(dp) :: count

      count = self%smoother%ffts/self%block_size
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(long_waves_type), intent(inout) :: self

      if (self%matter) call self%smoother%destroy()
   end subroutine destroy

end module schur_long_waves
