!> Inverses of the normal compliance K on small tiles of the contact.
!>
!> The grid is divided into tiles of at most 8 x 8 cells. For each tile the displacements of its cells in contact, and
!> of those in a rim of one cell around it, are set by pressures on these cells alone. The tile keeps the pressures of its
!> own cells and drops those of the rim, which belong to other tiles (restricted additive Schwarz). What distant
!> tiles do to each other is left to the boxes of module `contact_boxes`.
!>
!> Tiles whose cells are all in contact share one inverse, and a tile that has the same cells in contact as
!> before keeps its inverse. If processes share the rows, each has every n-th tile.
!>
!> Memory: the inverses in single precision, at most 50 fields if all tiles are almost full, usually 2 to 10. A tile for
!> which there is no memory divides by the displacement of a cell under its own pressure.
module contact_tiles
   use asperity_parallel, only : global_sum, process_count, process_number
   use asperity_precision, only : dp, sp
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_tiles_type

   integer, parameter :: side = 8                !! cells along a side of a tile, at most
   integer, parameter :: rim = 1                 !! cells around it
   integer, parameter :: reach = side + 2*rim - 1   !! largest distance of two cells of a tile
   integer, parameter :: most = (side + 2*rim)**2   !! cells of a tile and its rim

   !> A tile. Its own cells come first in its lists, then those of the rim.
   type :: tile_type
      integer :: own = 0                         !! its own cells in contact
      integer :: twin = 0                        !! the tile whose inverse it uses; 0: its own one
      integer, allocatable :: places(:, :)       !! of the cells in contact, relative to the tile [2, n]
      integer, allocatable :: numbers(:)         !! of these cells in the list of all cells in contact
      real(sp), allocatable :: inverse(:, :)     !! of K over the displacement by a cell's own pressure [own, n]
   end type tile_type

   !> All tiles of a grid.
   type :: contact_tiles_type
      integer, private :: cells(2) = 0           !! of the grid
      integer, private :: tiles(2) = 0
      integer, private :: threads = 1
      logical, private :: shared = .false.       !! processes share the rows
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

      self%cells = [operator%nx, operator%ny]
      self%tiles = (self%cells + side - 1)/side
      self%threads = operator%threads
      self%shared = operator%grid%shared
      allocate (load(operator%nx, operator%rows), u(operator%nx, operator%rows), source=0.0_dp)
      if (operator%grid%first_row == 1 .and. operator%rows > 0) load(1, 1) = 1.0_dp
      call operator%displace(load, u)
      near = 0.0_dp
      do j = -reach, reach
         do i = -reach, reach
            at = modulo([i, j], self%cells) + 1
            at(2) = at(2) - operator%grid%first_row + 1
            if (at(2) >= 1 .and. at(2) <= operator%rows) near(i + reach + 1, j + reach + 1) = u(at(1), at(2))
         end do
      end do
      if (self%shared) near = reshape(global_sum(reshape(near, [size(near)])), shape(near))
      self%soft = near(reach + 1, reach + 1)
      self%near = real(near/self%soft, sp)
      if (allocated(self%tile)) deallocate (self%tile)
      allocate (self%tile(product(self%tiles)))
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
         if (is_mine(self, t)) call list_cells(self, number, t, self%tile(t), changed(t))
      end do

      full = 0
      do t = 1, size(self%tile)
         if (.not. is_mine(self, t)) cycle
         call find_extent(self, t, area, extent)
         associate (first => full(extent(1), extent(2)))
            self%tile(t)%twin = 0
            if (size(self%tile(t)%numbers) < product(extent + 2*rims(self, extent))) cycle
            self%tile(t)%twin = first
            if (first == 0) first = t
         end associate
      end do

      !$omp parallel do default(none) shared(self, changed, other) private(t) schedule(dynamic) num_threads(self%threads)
      do t = 1, size(self%tile)
         if (.not. is_mine(self, t)) cycle
         associate (tile => self%tile(t))
            if (allocated(tile%inverse) .and. (changed(t) .or. other .or. tile%twin > 0)) deallocate (tile%inverse)
            if (tile%own > 0 .and. tile%twin == 0 .and. .not. allocated(tile%inverse)) call invert_tile(self, tile)
         end associate
      end do
   end subroutine renew

   !> Does this process have the tile?
   pure function is_mine(self, t) result(mine)
      type(contact_tiles_type), intent(in) :: self
      integer, intent(in) :: t
      logical :: mine

      mine = .true.
      if (self%shared) mine = modulo(t, process_count()) == process_number()
   end function is_mine

   !> Find the cell before a tile, and the number of its cells along both directions.
   pure subroutine find_extent(self, t, before, extent)
      type(contact_tiles_type), intent(in) :: self
      integer, intent(in) :: t
      integer, intent(out) :: before(2), extent(2)
      integer :: at(2)

      at = [modulo(t - 1, self%tiles(1)), (t - 1)/self%tiles(1)]
      before = at*self%cells/self%tiles
      extent = (at + 1)*self%cells/self%tiles - before
   end subroutine find_extent

   !> The width of the rim along both directions. On a grid of few cells a tile may meet itself.
   pure function rims(self, extent) result(width)
      type(contact_tiles_type), intent(in) :: self
      integer, intent(in) :: extent(2)
      integer :: width(2)

      width = min(rim, (self%cells - extent)/2)
   end function rims

   !> List the cells of a tile that are in contact, first its own and then those of the rim.
   subroutine list_cells(self, number, t, tile, changed)
      type(contact_tiles_type), intent(in) :: self
      integer, intent(in) :: number(:, :)
      integer, intent(in) :: t
      type(tile_type), intent(inout) :: tile
      logical, intent(out) :: changed            !! other cells than before are in contact
      integer :: at(2), before(2), extent(2), i, j, n, numbers(most), part, places(2, most), width(2)
      logical :: inside

      call find_extent(self, t, before, extent)
      width = rims(self, extent)
      n = 0
      do part = 1, 2
         do j = 1 - width(2), extent(2) + width(2)
            do i = 1 - width(1), extent(1) + width(1)
               inside = i >= 1 .and. i <= extent(1) .and. j >= 1 .and. j <= extent(2)
               if (inside .neqv. part == 1) cycle
               at = modulo(before + [i, j] - 1, self%cells) + 1
               if (number(at(1), at(2)) == 0) cycle
               n = n + 1
               places(:, n) = [i, j]
               numbers(n) = number(at(1), at(2))
            end do
         end do
         if (part == 1) tile%own = n
      end do

      changed = .not. allocated(tile%places)
      if (.not. changed) changed = size(tile%places, 2) /= n
      if (.not. changed) changed = any(tile%places /= places(:, :n))
      tile%places = places(:, :n)
      tile%numbers = numbers(:n)
   end subroutine list_cells

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

   !> Replace a matrix by its inverse (Gauss and Jordan). A part of K needs no pivoting, because K has a positive
   !> real part.
   pure subroutine invert(a)
      real(sp), intent(inout), contiguous :: a(:, :)
      real(sp) :: column(size(a, 1))
      integer :: j, k

      do k = 1, size(a, 1)
         column = a(:, k)
         a(:, k) = 0.0_sp
         a(k, k) = 1.0_sp
         a(k, :) = a(k, :)/column(k)
         column(k) = 0.0_sp
         do j = 1, size(a, 2)
            a(:, j) = a(:, j) - a(k, j)*column
         end do
      end do
   end subroutine invert

   !> Find the pressures that displace the cells of each tile as wanted. All processes get all pressures.
   subroutine apply(self, wanted, pressure)
      class(contact_tiles_type), intent(in) :: self
      real(dp), intent(in) :: wanted(:)          !! of the cells in contact, m
      real(dp), intent(inout) :: pressure(:)     !! Pa
      integer :: t, twin

      pressure = 0.0_dp
      !$omp parallel do default(none) shared(self, wanted, pressure) private(t, twin) num_threads(self%threads)
      do t = 1, size(self%tile)
         if (.not. is_mine(self, t)) cycle
         if (self%tile(t)%own == 0) cycle
         twin = merge(self%tile(t)%twin, t, self%tile(t)%twin > 0)
         call apply_tile(self, self%tile(t), self%tile(twin), wanted, pressure)
      end do
      if (self%shared) pressure = global_sum(pressure)
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
