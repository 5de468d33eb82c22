!> Inverses of the normal compliance K on small tiles of the contact.
!>
!> The grid is divided into tiles of at most 8 x 8 cells (module `cell_tiles`). For each tile the displacements of its cells
!> in contact, and of those in its rim, are set by pressures on these cells alone. What distant tiles do to each other is
!> left to the boxes of module `contact_boxes`.
!>
!> Tiles whose cells are all in contact share one inverse, and a tile that has the same cells in contact as
!> before keeps its inverse.
!>
!> Memory: the inverses in single precision, at most 50 fields if all tiles are almost full, usually 2 to 10. A tile for
!> which there is no memory divides by the displacement of a cell under its own pressure.
module contact_tiles
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp, sp
   use cell_tiles, only : tile_cells_type, tile_layout_type, tile_rim
   use dense_factors, only : invert
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_tiles_type

   integer, parameter :: side = 8                !! cells along a side of a tile, at most
   integer, parameter :: reach = side + 2*tile_rim - 1   !! largest distance of two cells of a tile

   !> A tile.
   type, extends(tile_cells_type) :: tile_type
      integer :: twin = 0                        !! the tile whose inverse it uses; 0: its own one
      real(sp), allocatable :: inverse(:, :)     !! of K over the displacement by a cell's own pressure [own, n]
   end type tile_type

   !> All tiles of a grid.
   type :: contact_tiles_type
      type(tile_layout_type), private :: layout
      integer, private :: threads = 1
      real(dp) :: soft = 0.0_dp                  !! displacement of a cell under its own unit pressure, m/Pa
      real(dp), private :: spring = 0.0_dp       !! compliance of a spring on each cell, m/Pa
      real(sp), private :: near(-reach:reach, -reach:reach) = 0.0_sp   !! K over `soft`
      type(tile_type), allocatable, private :: tile(:)
   contains
      procedure :: begin
      procedure :: renew
      procedure :: apply
   end type contact_tiles_type

contains

   !> Begin with the operator of another speed.
   subroutine begin(self, operator)
      class(contact_tiles_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      real(dp), allocatable :: load(:, :), u(:, :)
      real(dp) :: near(2*reach + 1, 2*reach + 1)
      integer :: at(2), i, j

      self%layout = tile_layout_type(side, [operator%nx, operator%ny], operator%grid%shared, periodic=.true.)
      self%threads = operator%threads
      allocate (load(operator%nx, operator%rows), u(operator%nx, operator%rows), source=0.0_dp)
      if (operator%grid%first_row == 1 .and. operator%rows > 0) load(1, 1) = 1.0_dp
      call operator%displace(load, u)
      near = 0.0_dp
      do j = -reach, reach
         do i = -reach, reach
            at = modulo([i, j], self%layout%cells) + 1
            at(2) = at(2) - operator%grid%first_row + 1
            if (at(2) >= 1 .and. at(2) <= operator%rows) near(i + reach + 1, j + reach + 1) = u(at(1), at(2))
         end do
      end do
      if (self%layout%shared) near = reshape(global_sum(reshape(near, [size(near)])), shape(near))
      self%soft = near(reach + 1, reach + 1)
      self%near = real(near/self%soft, sp)
      if (allocated(self%tile)) deallocate (self%tile)
      allocate (self%tile(product(self%layout%tiles)))
   end subroutine begin

   !> Prepare for another set of cells in contact.
   subroutine renew(self, number, spring)
      class(contact_tiles_type), intent(inout) :: self
      integer, intent(in) :: number(:, :)        !! of each cell of the grid in the list of cells in contact; 0: open
      real(dp), intent(in) :: spring             !! compliance of a spring on each cell, m/Pa
      integer :: full(side, side)                !! the first tile of this size whose cells are all in contact
      logical :: changed(size(self%tile))
      integer :: area(2), extent(2), t
      logical :: other

      other = abs(spring - self%spring) > 0.0_dp
      self%spring = spring
      !$omp parallel do default(none) shared(self, number, changed) private(t) num_threads(self%threads)
      do t = 1, size(self%tile)
         changed(t) = .false.
         if (self%layout%is_mine(t)) call self%layout%list_cells(number, t, self%tile(t), changed(t))
      end do

      full = 0
      do t = 1, size(self%tile)
         if (.not. self%layout%is_mine(t)) cycle
         call self%layout%find_extent(t, area, extent)
         associate (first => full(extent(1), extent(2)))
            self%tile(t)%twin = 0
            if (size(self%tile(t)%numbers) < product(extent + 2*self%layout%rims(extent))) cycle
            self%tile(t)%twin = first
            if (first == 0) first = t
         end associate
      end do

      !$omp parallel do default(none) shared(self, changed, other) private(t) schedule(dynamic) num_threads(self%threads)
      do t = 1, size(self%tile)
         if (.not. self%layout%is_mine(t)) cycle
         associate (tile => self%tile(t))
            if (allocated(tile%inverse) .and. (changed(t) .or. other .or. tile%twin > 0)) deallocate (tile%inverse)
            if (tile%own > 0 .and. tile%twin == 0 .and. .not. allocated(tile%inverse)) call invert_tile(self, tile)
         end associate
      end do
   end subroutine renew

   !> Compute the inverse of a tile, if there is memory for it.
   subroutine invert_tile(self, tile)
      type(contact_tiles_type), intent(in) :: self
      type(tile_type), intent(inout) :: tile
      real(sp) :: matrix(size(tile%numbers), size(tile%numbers))
      integer :: a, b, d(2), status

      do b = 1, size(matrix, 2)
         do a = 1, size(matrix, 1)
            d = tile%places(:, a) - tile%places(:, b)
            matrix(a, b) = self%near(d(1), d(2))
         end do
         matrix(b, b) = matrix(b, b) + real(self%spring/self%soft, sp)
      end do
      call invert(matrix)
      allocate (tile%inverse(tile%own, size(matrix, 2)), stat=status)
      if (status == 0) tile%inverse(:, :) = matrix(:tile%own, :)
   end subroutine invert_tile

   !> Find the pressures that displace the cells of each tile as wanted. All processes get all pressures.
   subroutine apply(self, wanted, pressure)
      class(contact_tiles_type), intent(in) :: self
      real(dp), intent(in) :: wanted(:)          !! of the cells in contact, m
      real(dp), intent(inout) :: pressure(:)     !! Pa
      integer :: t, twin

      pressure = 0.0_dp
      !$omp parallel do default(none) shared(self, wanted, pressure) private(t, twin) num_threads(self%threads)
      do t = 1, size(self%tile)
         if (.not. self%layout%is_mine(t)) cycle
         if (self%tile(t)%own == 0) cycle
         twin = merge(self%tile(t)%twin, t, self%tile(t)%twin > 0)
         call apply_tile(self, self%tile(t), self%tile(twin), wanted, pressure)
      end do
      if (self%layout%shared) pressure = global_sum(pressure)
   end subroutine apply

   !> Apply the inverse of a tile.
   subroutine apply_tile(self, tile, twin, wanted, pressure)
      type(contact_tiles_type), intent(in) :: self
      type(tile_type), intent(in) :: tile
      type(tile_type), intent(in) :: twin        !! has the inverse
      real(dp), intent(in) :: wanted(:)
      real(dp), intent(inout) :: pressure(:)
      real(sp) :: here(size(tile%numbers)), sums(tile%own)
      integer :: b

      if (.not. allocated(twin%inverse)) then
         pressure(tile%numbers(:tile%own)) = wanted(tile%numbers(:tile%own))/(self%soft + self%spring)
         return
      end if
      here = real(wanted(tile%numbers)*(1.0_dp/self%soft), sp)
      sums = 0.0_sp
      do b = 1, size(here)
         sums = sums + here(b)*twin%inverse(:, b)
      end do
      pressure(tile%numbers(:tile%own)) = sums
   end subroutine apply_tile

end module contact_tiles
