!> The numbers per block of module `schur_preconditioner`, and the part of its conjugate gradients that works on
!> them.
!>
!> The coarse parts of the image b, of the search direction d and of the response e are constant in a block.
!> Their contributions to the sums over the cells of N therefore follow from a few sums per block, without a pass
!> over the cells:
!>     b = image + pending,   e = K d + addition,   d = correction - om b + beta d_old.
!>
!> Arrays hold the rows of blocks of the coarse level that this process holds. Products over all blocks are
!> summed row by row.
module schur_blocks
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use asperity_threads, only : least_parallel_cells
   use coarse_level, only : coarse_level_type
   use schur_coarse, only : new_schur_coarse, om, schur_coarse_type, stencil_c0
   implicit none
   private

   public :: new_schur_blocks, schur_blocks_type

   !> The numbers per block. A variable of this type must not be copied.
   type :: schur_blocks_type
      type(schur_coarse_type) :: model            !! the coarse part of the model
      integer, private :: threads = 1
      real(dp), private :: mean_stiffness = 0.0_dp   !! that the model adds for the mean of v over the grid
      real(dp), private :: cells = 1.0_dp            !! of the grid
      real(dp), allocatable :: pending(:, :)      !! coarse part to be added to b, (nx, held rows of blocks)
      real(dp), allocatable :: correction(:, :)   !! coarse part of W applied to -b
      real(dp), allocatable, private :: addition(:, :)   !! coarse part of B d
      real(dp), allocatable, private :: evenness(:, :)   !! average number of cells of a block over that of each block
      ! Sums over the cells of N in each block:
      real(dp), allocatable :: cells_off(:, :)      !! 1
      real(dp), allocatable :: image_off(:, :)      !! b
      real(dp), allocatable :: response_off(:, :)   !! K d
      real(dp), allocatable, private :: search_off(:, :)   !! d
      ! The cells beyond the rim, which belong to N, too, and where b and d are constant in a block:
      real(dp), allocatable :: far(:, :)            !! their number
      real(dp), allocatable, private :: far_image(:, :)    !! b
      real(dp), allocatable, private :: far_search(:, :)   !! d
   contains
      procedure :: add_far_image
      procedure :: stiffen_mean
      procedure :: image_parts
      procedure :: start
      procedure :: weigh
      procedure :: form_direction
      procedure :: response_parts
      procedure :: advance
   end type schur_blocks_type

contains

   !> Make the numbers for a coarse level. Collective if processes share the rows.
   subroutine new_schur_blocks(self, coarse, threads, error)
      type(schur_blocks_type), intent(out) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      self%threads = merge(1, threads, real(coarse%nx, dp)*coarse%ny < least_parallel_cells)
      self%cells = coarse%outer%cells()
      associate (nx => coarse%nx, first => coarse%held(1), last => coarse%held(2))
         allocate (self%pending(nx, first:last), self%correction(nx, first:last), source=0.0_dp)
         allocate (self%addition(nx, first:last), self%cells_off(nx, first:last), source=0.0_dp)
         allocate (self%image_off(nx, first:last), self%response_off(nx, first:last), source=0.0_dp)
         allocate (self%search_off(nx, first:last), source=0.0_dp)
         allocate (self%evenness(nx, first:last))
         allocate (self%far(nx, first:last), self%far_image(nx, first:last), self%far_search(nx, first:last), source=0.0_dp)
      end associate
      do j = coarse%held(1), coarse%held(2)
         self%evenness(:, j) = coarse%evenness(j)
      end do
      call new_schur_coarse(self%model, coarse%outer, coarse%h, coarse%nx, coarse%sharing, threads, error)
   end subroutine new_schur_blocks

   !> Make the mean of v over the grid stiff; 0 leaves the model as it is. In the units of the model.
   pure subroutine stiffen_mean(self, stiffness)
      class(schur_blocks_type), intent(inout) :: self
      real(dp), intent(in) :: stiffness

      self%mean_stiffness = stiffness
   end subroutine stiffen_mean

   !> Compute the coarse part of B from the sums of a field over the blocks. Collective.
   subroutine add_coarse(self, coarse, factor, sums, addition)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(in) :: factor
      real(dp), intent(in) :: sums(:, coarse%held(1):)       !! over this factor
      real(dp), intent(inout) :: addition(:, coarse%held(1):)

      call self%model%add_missing(factor, self%evenness, sums, addition)
      if (self%mean_stiffness > 0.0_dp) addition(:, :) = addition + self%mean_stiffness*factor*coarse%block_sum(sums)/self%cells
   end subroutine add_coarse

   !> Compute the coarse part of the image of the residual, and its contribution to the sums. Collective.
   subroutine image_parts(self, coarse, form, square)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(out) :: form                      !! to r.B r
      real(dp), intent(out) :: square                    !! to b^2 on N
      real(dp) :: rows(2, coarse%held(1):coarse%held(2)), totals(2)
      integer :: j

      call add_coarse(self, coarse, coarse%cells, coarse%mean, self%pending)
      !$omp parallel do default(none) shared(self, coarse, rows) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%cells_off(:, j) = self%cells_off(:, j) + self%far(:, j)
         self%far_image(:, j) = self%pending(:, j)
         rows(1, j) = sum(coarse%mean(:, j)*self%pending(:, j))
         rows(2, j) = sum(self%pending(:, j)*(2.0_dp*self%image_off(:, j) &
            + self%pending(:, j)*self%cells_off(:, j)))
      end do
      totals = coarse%block_totals(rows)
      form = coarse%cells*totals(1)
      square = totals(2)
   end subroutine image_parts

   !> Add the far cells to the sums on N, after others have formed those of the cells within the rim. Collective.
   subroutine add_far_image(self, coarse, square)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(inout) :: square                  !! b^2 on N
      real(dp) :: rows(1, coarse%held(1):coarse%held(2)), totals(1)
      integer :: j

      !$omp parallel do default(none) shared(self, coarse, rows) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%image_off(:, j) = self%image_off(:, j) + self%far(:, j)*self%far_image(:, j)
         self%cells_off(:, j) = self%cells_off(:, j) + self%far(:, j)
         rows(1, j) = sum(self%far(:, j)*self%far_image(:, j)**2)
      end do
      totals = coarse%block_totals(rows)
      square = square + totals(1)
   end subroutine add_far_image

   !> Begin the conjugate gradients. Collective.
   subroutine start(self, coarse)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer :: j

      !$omp parallel do default(none) shared(self, coarse) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%image_off(:, j) = self%image_off(:, j) + self%pending(:, j)*self%cells_off(:, j)
         self%search_off(:, j) = 0.0_dp
         self%far_search(:, j) = 0.0_dp
      end do
      call self%model%set_weights(self%cells_off, self%mean_stiffness)
   end subroutine start

   !> Compute the coarse part of W applied to -b. Collective.
   subroutine weigh(self, coarse, product)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(out) :: product                   !! -b.(coarse part) on N
      real(dp) :: rows(1, coarse%held(1):coarse%held(2)), totals(1)
      integer :: j

      call self%model%weigh(-1.0_dp, self%image_off, self%correction)
      !$omp parallel do default(none) shared(self, coarse, rows) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         rows(1, j) = sum(self%image_off(:, j)*self%correction(:, j))
      end do
      totals = coarse%block_totals(rows)
      product = -totals(1)
   end subroutine weigh

   !> Compute the next search direction and the coarse part of its response. Collective.
   subroutine form_direction(self, coarse, beta)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(in) :: beta                       !! multiple of the old direction
      integer :: j

      !$omp parallel do default(none) shared(self, coarse, beta) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%search_off(:, j) = self%correction(:, j)*self%cells_off(:, j) - om*self%image_off(:, j) &
            + beta*self%search_off(:, j)
         self%far_search(:, j) = self%correction(:, j) - om*self%far_image(:, j) + beta*self%far_search(:, j)
      end do
      call add_coarse(self, coarse, 1.0_dp, self%search_off, self%addition)
   end subroutine form_direction

   !> Compute the contribution of the coarse part of the response to the sums. From here on b includes the step
   !> before. Collective.
   subroutine response_parts(self, coarse, form, cross, square)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(out) :: form                      !! to d.e
      real(dp), intent(out) :: cross                     !! to b.e on N
      real(dp), intent(out) :: square                    !! to e^2 on N
      real(dp) :: rows(3, coarse%held(1):coarse%held(2)), totals(3), far_sums(3)
      integer :: j

      !$omp parallel do default(none) shared(self, coarse, rows) private(j, far_sums) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%pending(:, j) = 0.0_dp
         far_sums(:) = 0.0_dp
         if (any(self%far(:, j) > 0.0_dp)) call add_far_response(self, j, far_sums)
         rows(1, j) = far_sums(1) + sum(self%search_off(:, j)*self%addition(:, j))
         rows(2, j) = far_sums(2) + sum(self%addition(:, j)*self%image_off(:, j))
         rows(3, j) = far_sums(3) + sum(self%addition(:, j)*(2.0_dp*self%response_off(:, j) &
            + self%addition(:, j)*self%cells_off(:, j)))
      end do
      totals = coarse%block_totals(rows)
      form = totals(1)
      cross = totals(2)
      square = totals(3)
   end subroutine response_parts

   !> Add the stencil's response of the far cells of a row of blocks to its sums. Only the part c0 of the stencil acts on a
   !> constant.
   pure subroutine add_far_response(self, j, sums)
      class(schur_blocks_type), intent(inout) :: self
      integer, intent(in) :: j                           !! row of blocks
      real(dp), intent(out) :: sums(3)                   !! d.e, b.e and e^2
      real(dp) :: response(size(self%far, 1)), c0(size(self%far, 1))

      c0(:) = stencil_c0*self%evenness(:, j)
      response(:) = c0*self%far(:, j)*self%far_search(:, j)
      self%response_off(:, j) = self%response_off(:, j) + response
      sums(1) = sum(response*self%far_search(:, j))
      sums(2) = sum(response*self%far_image(:, j))
      sums(3) = sum(c0*response*self%far_search(:, j))
   end subroutine add_far_response

   !> Take a step along the direction.
   subroutine advance(self, coarse, length)
      class(schur_blocks_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(in) :: length
      integer :: j

      !$omp parallel do default(none) shared(self, coarse, length) private(j) num_threads(self%threads)
      do j = coarse%held(1), coarse%held(2)
         self%image_off(:, j) = self%image_off(:, j) + length*(self%response_off(:, j) &
            + self%addition(:, j)*self%cells_off(:, j))
         self%far_image(:, j) = self%far_image(:, j) &
            + length*(stencil_c0*self%evenness(:, j)*self%far_search(:, j) + self%addition(:, j))
         self%pending(:, j) = length*self%addition(:, j)
      end do
   end subroutine advance

end module schur_blocks
