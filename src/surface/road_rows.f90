!> The rows of the road that are under the rubber of this process.
!>
!> If processes share the rows of the map, each holds its own rows and those that are now under its part of
!> the rubber. The latter are fetched from their owners when the road has moved, with some spare rows on either
!> side, so that most steps need no exchange. The map does not change, so that fetched rows remain valid.
!>
!> Rows are numbered from 0 in this module. The values of a row may be heights or
!> coefficients of a spline; this module does not use them.
module road_rows
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : new_range_halo, row_halo_type
   implicit none
   private

   public :: new_road_rows, road_rows_type

   integer, parameter :: spare = 4                    !! extra rows that are fetched on either side
   integer, parameter :: reach(2) = [-1, 2]           !! rows that are read around a place, relative to its row

   !> Rows that can be read.
   type :: road_rows_type
      type(grid_type) :: grid
      !> The rows of this process, the rim of the map, and rows of others [values of a row, rows].
      real(dp), allocatable :: values(:, :)
      !> Position in `values` of each row from -1, in front of the map, to ny + 1. A row that is not available has
      !> a valid position, too, so that reading it does no harm.
      integer, allocatable :: place(:)
      integer, private :: rim = 0                     !! rows of the rim: 2 or none
      logical, allocatable, private :: there(:)       !! is the row available? From 0 to ny - 1
   contains
      procedure :: have
   end type road_rows_type

contains

   !> Allocate the rows; the caller sets the rows of this process, and then those of the rim: rows -1 and ny.
   subroutine new_road_rows(self, grid, n, with_rim)
      type(road_rows_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: n                        !! values of a row
      logical, intent(in) :: with_rim
      integer :: room

      self%grid = grid
      if (with_rim) self%rim = 2
      ! Space for the rows of others is allocated at once, so that the array need not be copied when the road
      ! moves. The system provides the memory only when rows are stored there.
      room = 0
      if (grid%shared) room = min(grid%rows() + reach(2) - reach(1) + 2*spare, grid%ny)
      allocate (self%values(n, grid%rows() + self%rim + room))
      allocate (self%place(-1:grid%ny + 1), self%there(0:grid%ny - 1))
      call place_own_rows(self)
   end subroutine new_road_rows

   !> Fetch the rows that are needed to read the map at these places along y, unless they are already available.
   !> Collective.
   subroutine have(self, least, largest)
      class(road_rows_type), intent(inout) :: self
      integer, intent(in) :: least, largest           !! cells from 0, of this process
      integer :: range(2), row
      logical :: missing

      if (.not. self%grid%shared) return
      range = clipped(self%grid, [least, largest] + reach)
      if (self%grid%rows() == 0) range = [0, -1]
      missing = .false.
      do row = range(1), range(2)
         missing = missing .or. .not. self%there(modulo(row, self%grid%ny))
      end do
      if (.not. any_process(missing)) return
      if (self%grid%rows() > 0) range = clipped(self%grid, [least, largest] + reach + [-spare, spare])
      call fetch_range(self, range)
   end subroutine have

   !> Limit a range of rows to a free map, or to one period of a periodic one.
   pure function clipped(grid, wanted) result(range)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: wanted(2)
      integer :: range(2)

      if (grid%boundary /= boundary_periodic) then
         ! Beyond the rim the map continues with the heights of the rim.
         range(1) = min(max(wanted(1), 0), max(grid%ny - 2 + reach(1), 0))
         range(2) = max(min(wanted(2), grid%ny - 1), min(reach(2), grid%ny - 1))
      else if (wanted(2) - wanted(1) < grid%ny) then
         range = wanted
      else
         range = [0, grid%ny - 1]
      end if
   end function clipped

   !> Fetch the rows of a range that other processes hold, in place of those that were fetched before.
   subroutine fetch_range(self, range)
      type(road_rows_type), intent(inout) :: self
      integer, intent(in) :: range(2)
      type(row_halo_type) :: halo
      real(dp), allocatable :: more(:, :)
      integer :: k, lasting

      call new_range_halo(halo, self%grid, range + 1)
      lasting = halo%own + self%rim
      if (lasting + halo%foreign > size(self%values, 2)) then
         allocate (more(size(self%values, 1), lasting + halo%foreign + 2*spare))
         more(:, :lasting) = self%values(:, :lasting)
         call move_alloc(more, self%values)
      end if
      call halo%fetch(self%values(:, :halo%own), self%values(:, lasting + 1:))
      call place_own_rows(self)
      self%place(halo%row - 1) = lasting + [(k, k=1, halo%foreign)]
      self%there(halo%row - 1) = .true.
      call place_ends(self)
   end subroutine fetch_range

   !> The places of the rows of this process, and of those in front of the map and behind it.
   pure subroutine place_own_rows(self)
      type(road_rows_type), intent(inout) :: self
      integer :: row

      self%place = 1
      self%there = .false.
      do row = 0, self%grid%rows() - 1
         self%place(self%grid%first_row - 1 + row) = row + 1
         self%there(self%grid%first_row - 1 + row) = .true.
      end do
      call place_ends(self)
   end subroutine place_own_rows

   !> The places of the rows in front of the map and behind it.
   pure subroutine place_ends(self)
      type(road_rows_type), intent(inout) :: self

      associate (ny => self%grid%ny)
         if (self%grid%boundary == boundary_periodic) then
            self%place(-1) = self%place(ny - 1)
            self%place(ny) = self%place(0)
            self%place(ny + 1) = self%place(modulo(1, ny))
         else if (self%rim > 0) then
            self%place(-1) = self%grid%rows() + 1
            self%place(ny:) = self%grid%rows() + 2
         end if
      end associate
   end subroutine place_ends

end module road_rows
