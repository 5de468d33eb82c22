!> The regular grid of cells on which all fields live.
!>
!> `nx` by `ny` is the whole grid. A process holds the rows `first_row` to `last_row` of every field, so that
!> its fields have the shape [nx, rows] and the first of their rows is row `first_row` of the grid.
module regular_grid
   use asperity_parallel, only : local_rows
   use asperity_precision, only : dp
   implicit none
   private

   public :: grid_type, new_grid

   integer, parameter, public :: boundary_periodic = 1   !! the surface repeats for ever
   integer, parameter, public :: boundary_free = 2       !! a patch on an unbounded half-space

   !> Cell (i, j), from 0, has its centre at x = i dx, y = j dy.
   type :: grid_type
      integer :: nx = 0                         !! cells along x
      integer :: ny = 0                         !! cells along y; 1 for a plane-strain line contact
      real(dp) :: lx = 0.0_dp                   !! length along x, m
      real(dp) :: ly = 0.0_dp                   !! length along y, m
      real(dp) :: dx = 0.0_dp                   !! lx/nx
      real(dp) :: dy = 0.0_dp                   !! ly/ny
      integer :: boundary = boundary_periodic
      integer :: first_row = 1                  !! first row of this process, counted from 1
      integer :: last_row = 0                   !! its last row
   contains
      procedure :: rows
      procedure :: cells
      procedure :: area
      procedure :: cell_area
   end type grid_type

contains

   !> Make a grid; the caller has checked that all numbers are positive.
   pure function new_grid(nx, ny, lx, ly, boundary) result(self)
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: lx, ly
      integer, intent(in) :: boundary
      type(grid_type) :: self

      self%nx = nx
      self%ny = ny
      self%lx = lx
      self%ly = ly
      self%dx = lx/nx
      self%dy = ly/ny
      self%boundary = boundary
      call local_rows(ny, self%first_row, self%last_row)
   end function new_grid

   !> Number of rows that this process holds.
   pure function rows(self)
      class(grid_type), intent(in) :: self
      integer :: rows

      rows = self%last_row - self%first_row + 1
   end function rows

   !> Number of cells of the whole grid. Real, since it may exceed the integers.
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
