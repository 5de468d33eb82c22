!> Divides a grid into small tiles, and lists the cells of each tile, for approximate inverses that couple the cells of
!> a tile completely (restricted additive Schwarz).
!>
!> A tile has its own cells and a rim of one cell around them. The inverse of a tile is that of all its cells, but only
!> the results in its own cells are used: those of the rim belong to other tiles. If processes share the rows, each
!> has every n-th tile.
module cell_tiles
   use asperity_parallel, only : process_count, process_number
   implicit none
   private

   public :: tile_cells_type, tile_layout_type, tile_rim

   integer, parameter :: tile_rim = 1            !! cells around a tile

   !> The listed cells of a tile: its own cells first, then those of the rim.
   type :: tile_cells_type
      integer :: own = 0                         !! number of its own cells
      integer, allocatable :: places(:, :)       !! column and row, relative to the tile [2, n]
      integer, allocatable :: numbers(:)         !! in the list of all cells [n]
   end type tile_cells_type

   !> The tiles of a grid.
   type :: tile_layout_type
      integer :: side = 1                        !! cells along a side of a tile, at most
      integer :: cells(2) = 0                    !! of the grid
      integer :: tiles(2) = 0
      logical :: shared = .false.                !! processes share the rows
      logical :: periodic = .true.               !! tiles at an edge meet those at the opposite edge
   contains
      procedure :: is_mine
      procedure :: find_extent
      procedure :: rims
      procedure :: list_cells
   end type tile_layout_type

   !> The layout for a number of cells.
   interface tile_layout_type
      module procedure new_tile_layout
   end interface tile_layout_type

contains

   !> Make the layout of a grid.
   pure function new_tile_layout(side, cells, shared, periodic) result(self)
      integer, intent(in) :: side                !! cells along a side of a tile, at most
      integer, intent(in) :: cells(2)            !! of the grid
      logical, intent(in) :: shared              !! processes share the rows
      logical, intent(in) :: periodic
      type(tile_layout_type) :: self

      self%side = side
      self%cells = cells
      self%tiles = (cells + side - 1)/side
      self%shared = shared
      self%periodic = periodic
   end function new_tile_layout

   !> Does this process have the tile?
   pure function is_mine(self, t) result(mine)
      class(tile_layout_type), intent(in) :: self
      integer, intent(in) :: t
      logical :: mine

      mine = .true.
      if (self%shared) mine = modulo(t, process_count()) == process_number()
   end function is_mine

   !> Find the cell before a tile, and the number of its cells along both directions.
   pure subroutine find_extent(self, t, before, extent)
      class(tile_layout_type), intent(in) :: self
      integer, intent(in) :: t
      integer, intent(out) :: before(2), extent(2)
      integer :: at(2)

      at = [modulo(t - 1, self%tiles(1)), (t - 1)/self%tiles(1)]
      before = at*self%cells/self%tiles
      extent = (at + 1)*self%cells/self%tiles - before
   end subroutine find_extent

   !> The width of the rim along both directions. On a grid of few cells a tile may meet itself.
   pure function rims(self, extent) result(width)
      class(tile_layout_type), intent(in) :: self
      integer, intent(in) :: extent(2)
      integer :: width(2)

      width = min(tile_rim, (self%cells - extent)/2)
   end function rims

   !> List the cells of a tile, first its own and then those of the rim.
   subroutine list_cells(self, number, t, tile, changed)
      class(tile_layout_type), intent(in) :: self
      integer, intent(in) :: number(:, :)        !! of each cell of the grid in the list of all cells; 0: not in it
      integer, intent(in) :: t
      class(tile_cells_type), intent(inout) :: tile
      logical, intent(out) :: changed            !! the tile has other cells than before
      integer :: at(2), before(2), extent(2), i, j, n, part, width(2)
      integer :: numbers((self%side + 2*tile_rim)**2), places(2, (self%side + 2*tile_rim)**2)
      logical :: inside

      call self%find_extent(t, before, extent)
      width = self%rims(extent)
      n = 0
      do part = 1, 2
         do j = 1 - width(2), extent(2) + width(2)
            do i = 1 - width(1), extent(1) + width(1)
               inside = i >= 1 .and. i <= extent(1) .and. j >= 1 .and. j <= extent(2)
               if (inside .neqv. part == 1) cycle
               at = before + [i, j]
               if (.not. self%periodic .and. any(at < 1 .or. at > self%cells)) cycle
               at = modulo(at - 1, self%cells) + 1
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

end module cell_tiles
