!> The regular grid of cells on which all fields live.
!>
!> `nx` by `ny` is the whole grid. Several processes share its rows: each holds the rows `first_row` to
!> `last_row` of every field, so that its fields have the shape [nx, rows()], and the first of their rows is
!> row `first_row` of the grid. A grid that is not shared is whole on every process.
!>
!> Rows are shared in strips of about eight, the rows of blocks of the coarse level (module `coarse_level`),
!> so that the cells of a block are on one process. A process may have no row at all.
module regular_grid
   use asperity_parallel, only : process_count, process_number
   use asperity_precision, only : dp, int64
   implicit none
   private

   public :: grid_type, new_grid

   integer, parameter, public :: boundary_periodic = 1   !! the surface repeats without end
   integer, parameter, public :: boundary_free = 2       !! a patch on an unbounded half-space

   real(dp), parameter, public :: block_cells = 8.0_dp   !! cells of a block along a side, if square
   real(dp), parameter, public :: large_grid = 1e7_dp     !! cells from which a normal contact starts from two coarser grids

   real(dp), parameter :: long = 4.0_dp              !! least ratio of the sides of a long grid
   real(dp), parameter :: largest_aspect = 100.0_dp   !! largest ratio of a cell's sides for which a stencil is accurate

   !> Cell (i, j), from 0, has its centre at x = i dx, y = j dy.
   type :: grid_type
      integer :: nx = 0                         !! cells along x
      integer :: ny = 0                         !! cells along y; 1 for a plane-strain line contact
      real(dp) :: lx = 0.0_dp                   !! length along x, m
      real(dp) :: ly = 0.0_dp                   !! length along y, m
      real(dp) :: dx = 0.0_dp                   !! lx/nx
      real(dp) :: dy = 0.0_dp                   !! ly/ny
      integer :: boundary = boundary_periodic
      logical :: shared = .false.               !! other processes hold the other rows
      integer :: first_row = 1                  !! first row of this process, counted from 1
      integer :: last_row = 0                   !! its last row
   contains
      procedure :: fault
      procedure :: fits
      procedure :: rows
      procedure :: cells
      procedure :: area
      procedure :: cell_area
      procedure :: cell_side
      procedure :: very_oblong
      procedure :: is_long
      procedure :: blocks
      procedure :: strip_start
      procedure :: share_rows
      procedure :: rows_of
      procedure :: most_rows
      procedure :: column_at
      procedure :: row_at
   end type grid_type

contains

   !> Make a grid. Operators and solvers refuse a grid that has a `fault`.
   pure function new_grid(nx, ny, lx, ly, boundary) result(self)
      integer, intent(in) :: nx, ny         !! cells along each side
      real(dp), intent(in) :: lx, ly        !! sides, m
      integer, intent(in) :: boundary       !! boundary_periodic or boundary_free
      type(grid_type) :: self

      self%nx = nx
      self%ny = ny
      self%lx = lx
      self%ly = ly
      self%dx = lx/nx
      self%dy = ly/ny
      self%boundary = boundary
      self%last_row = ny
   end function new_grid

   !> What no solver can work with in the numbers of a grid; empty if nothing is wrong.
   pure function fault(self) result(text)
      class(grid_type), intent(in) :: self
      character(:), allocatable :: text

      text = ''
      if (min(self%nx, self%ny) < 1) then
         text = 'the numbers of cells of a grid must be positive'
      else if (.not. (min(self%lx, self%ly) > 0.0_dp .and. max(self%lx, self%ly) <= huge(1.0_dp))) then
         text = 'the sides of a grid must be positive and finite'
      else if (all(self%boundary /= [boundary_periodic, boundary_free])) then
         text = 'the boundary of a grid must be boundary_periodic or boundary_free'
      end if
   end function fault

   !> Does a field of this shape belong to the grid? The shape is [nx, rows], or [nx, 2, rows] for vectors.
   pure logical function fits(self, extents)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: extents(:)

      if (size(extents) == 2) then
         fits = all(extents == [self%nx, self%rows()])
      else
         fits = all(extents == [self%nx, 2, self%rows()])
      end if
   end function fits

   !> Share the rows with the other processes, if there are any.
   pure subroutine share_rows(self)
      class(grid_type), intent(inout) :: self
      integer :: range(2)

      self%shared = process_count() > 1
      if (.not. self%shared) return
      range = self%rows_of(process_number())
      self%first_row = range(1)
      self%last_row = range(2)
   end subroutine share_rows

   !> First and last row of a process. The last is before the first where the process has none.
   pure function rows_of(self, process) result(range)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: process               !! from 0
      integer :: range(2)
      integer :: strips(2), blocks(2)

      range = [1, self%ny]
      if (.not. self%shared) return
      blocks = self%blocks()
      ! Number of strips that come before those of this process, and before those of the next one.
      strips = int([process, process + 1]*int(blocks(2), int64)/process_count())
      range = [self%strip_start(strips(1) + 1), self%strip_start(strips(2) + 1) - 1]
   end function rows_of

   !> Rows of the process that has most of them, if the processes share the grid.
   pure integer function most_rows(self)
      class(grid_type), intent(in) :: self
      type(grid_type) :: shared
      integer :: range(2), process

      shared = self
      call shared%share_rows()
      most_rows = 0
      do process = 0, process_count() - 1
         range = shared%rows_of(process)
         most_rows = max(most_rows, range(2) - range(1) + 1)
      end do
   end function most_rows

   !> Column of a place that may lie beyond the grid: a periodic grid repeats its columns; beyond a free grid
   !> there is none, and the result is 0.
   elemental function column_at(self, place) result(column)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: place                 !! from 1
      integer :: column

      column = image(self%boundary, self%nx, place)
   end function column_at

   !> Row of a place that may lie beyond the grid, as `column_at` for columns.
   elemental function row_at(self, place) result(row)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: place                 !! from 1
      integer :: row

      row = image(self%boundary, self%ny, place)
   end function row_at

   !> Cell from 1 to n at a place, or the one that the place repeats on a periodic grid; 0 beyond a free grid.
   elemental function image(boundary, n, place) result(cell)
      integer, intent(in) :: boundary, n, place
      integer :: cell

      cell = place
      if (place >= 1 .and. place <= n) return
      cell = 0
      if (boundary == boundary_periodic) cell = modulo(place - 1, n) + 1
   end function image

   !> Number of blocks of the coarse level along x and y. A block consists of whole cells and is about as long
   !> as it is wide, in metres.
   pure function blocks(self)
      class(grid_type), intent(in) :: self
      integer :: blocks(2)
      real(dp) :: side

      side = block_cells*self%cell_side()
      blocks(1) = min(max(1, nint(self%lx/side)), self%nx)
      blocks(2) = min(max(1, nint(self%ly/side)), self%ny)
   end function blocks

   !> First row of a strip, which consists of the rows of one row of blocks. The strip after the last one
   !> starts at row ny + 1.
   pure function strip_start(self, strip) result(row)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: strip                 !! from 1
      integer :: row
      integer :: blocks(2)

      blocks = self%blocks()
      row = int((int(strip - 1, int64)*self%ny + blocks(2) - 1)/blocks(2)) + 1
   end function strip_start

   !> Side of a square cell of the same area, m; the length of a cell where the grid is a line.
   pure function cell_side(self) result(side)
      class(grid_type), intent(in) :: self
      real(dp) :: side

      side = sqrt(self%dx*self%dy)
      if (self%ny == 1) side = self%dx
      if (self%nx == 1) side = self%dy
   end function cell_side

   !> Are the cells so oblong that a stencil is too inaccurate a model of the solid?
   pure logical function very_oblong(self)
      class(grid_type), intent(in) :: self

      very_oblong = min(self%nx, self%ny) > 1 .and. max(self%dx, self%dy) > largest_aspect*min(self%dx, self%dy)
   end function very_oblong

   !> Is the grid so much longer than wide that waves along it need care?
   pure logical function is_long(self)
      class(grid_type), intent(in) :: self

      is_long = max(self%lx, self%ly) >= long*min(self%lx, self%ly)
   end function is_long

   !> Number of rows that this process holds.
   pure function rows(self)
      class(grid_type), intent(in) :: self
      integer :: rows

      rows = self%last_row - self%first_row + 1
   end function rows

   !> Number of cells of the whole grid. It is real because it may exceed the largest integer.
   pure function cells(self)
      class(grid_type), intent(in) :: self
      real(dp) :: cells

      cells = real(self%nx, dp)*self%ny
   end function cells

   !> Area of the whole grid, m2.
   pure function area(self)
      class(grid_type), intent(in) :: self
      real(dp) :: area

      area = self%lx*self%ly
   end function area

   !> Area of one cell, m2.
   pure function cell_area(self)
      class(grid_type), intent(in) :: self
      real(dp) :: cell_area

      cell_area = self%dx*self%dy
   end function cell_area

end module regular_grid
