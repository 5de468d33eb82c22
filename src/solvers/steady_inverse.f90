!> An approximate inverse of the normal compliance K on the cells in contact, with which GMRES takes few directions.
!>
!> It is the sum of two levels: dense inverses on small tiles of the contact (module `contact_tiles`), and a
!> coarse level of boxes (module `contact_boxes`). It takes no transforms. The number of directions then hardly depends
!> on the number of cells, the speed or the rubber. An inverse by a symbol in Fourier space, such as (K + a)^-1,
!> takes several times more: it continues the displacements by zero outside the contact, and at high speed |K| falls
!> so steeply with the wave number that the jump at the edge of the contact dominates the result.
!>
!> If processes share the rows, all of them keep the list of all cells in contact.
!>
!> Memory: that of the tiles, 1.5 fields, and lists of the cells in contact.
module steady_inverse
   use asperity_parallel, only : gather_rows
   use asperity_precision, only : dp
   use contact_boxes, only : contact_boxes_type
   use contact_tiles, only : contact_tiles_type
   use field_sums, only : field_mean
   use regular_grid, only : grid_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_inverse_type

   !> The inverse for a set of cells.
   type :: contact_inverse_type
      logical, allocatable :: inside(:, :)             !! the cells in contact [nx, rows]
      real(dp) :: lift_mean = 0.0_dp                   !! mean over the grid of the pressures `lift`, Pa
      type(grid_type), private :: grid
      integer, allocatable, private :: number(:, :)    !! of each cell of the whole grid in the list; 0: open
      integer, allocatable, private :: cells(:, :)     !! the list, column and row of the grid [2, n]
      real(dp), allocatable, private :: lift(:, :)     !! pressures that displace the contact by 1 m, Pa [nx, rows]
      type(contact_tiles_type) :: tiles                !! its `soft` is the displacement by a cell's own pressure
      type(contact_boxes_type), private :: boxes
   contains
      procedure :: make_room
      procedure :: begin
      procedure :: renew
      procedure :: solve
   end type contact_inverse_type

contains

   !> Allocate the fields.
   subroutine make_room(self, grid, status)
      class(contact_inverse_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(out) :: status                   !! not 0: there is not enough memory

      self%grid = grid
      allocate (self%inside(grid%nx, grid%rows()), stat=status)
      if (status == 0) allocate (self%number(grid%nx, grid%ny), stat=status)
      if (status == 0) allocate (self%lift(grid%nx, grid%rows()), stat=status)
   end subroutine make_room

   !> Begin with the operator of another speed: four transforms.
   subroutine begin(self, operator)
      class(contact_inverse_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator

      call self%tiles%begin(operator)
      call self%boxes%begin(operator)
   end subroutine begin

   !> Prepare for another set of cells.
   subroutine renew(self, inside, spring)
      class(contact_inverse_type), intent(inout) :: self
      logical, intent(in) :: inside(:, :)
      real(dp), intent(in), optional :: spring         !! compliance of a spring on each cell, m/Pa
      real(dp) :: added

      added = 0.0_dp
      if (present(spring)) added = spring

      self%inside(:, :) = inside
      call list_cells(self)
      call self%tiles%renew(self%number, added)
      call self%boxes%renew(self%cells, added)
      self%lift(:, :) = merge(1.0_dp, 0.0_dp, inside)
      call invert(self, self%lift)
      self%lift_mean = field_mean(self%lift)
   end subroutine renew

   !> List the cells in contact of all processes in the order of the rows of the grid.
   subroutine list_cells(self)
      type(contact_inverse_type), intent(inout) :: self
      real(dp), allocatable :: here(:, :)
      integer :: i, j, n

      allocate (here(2, count(self%inside)))
      n = 0
      do j = 1, size(self%inside, 2)
         do i = 1, size(self%inside, 1)
            if (.not. self%inside(i, j)) cycle
            n = n + 1
            here(:, n) = real([i, self%grid%first_row - 1 + j], dp)
         end do
      end do
      if (self%grid%shared) then
         self%cells = nint(gather_rows(here))
      else
         self%cells = nint(here)
      end if
      self%number(:, :) = 0
      do n = 1, size(self%cells, 2)
         self%number(self%cells(1, n), self%cells(2, n)) = n
      end do
   end subroutine list_cells

   !> Find the pressures that displace the cells in contact by u + level and have the given mean over the grid.
   subroutine solve(self, mean, u, level)
      class(contact_inverse_type), intent(in) :: self
      real(dp), intent(in) :: mean                     !! Pa
      real(dp), intent(inout) :: u(:, :)               !! in: m; out: the pressures, Pa, zero outside the contact
      real(dp), intent(out) :: level                   !! m
      integer :: j

      call invert(self, u)
      level = 0.0_dp
      if (.not. abs(self%lift_mean) > 0.0_dp) return
      level = (mean - field_mean(u))/self%lift_mean
      do j = 1, size(u, 2)
         u(:, j) = u(:, j) + level*self%lift(:, j)
      end do
   end subroutine solve

   !> Multiply by the inverse.
   subroutine invert(self, u)
      type(contact_inverse_type), intent(in) :: self
      real(dp), intent(inout) :: u(:, :)               !! in: m; out: Pa
      real(dp), allocatable :: here(:, :), wanted(:), pressure(:)
      integer :: i, j, n

      allocate (wanted(size(self%cells, 2)), pressure(size(self%cells, 2)))
      if (self%grid%shared) then
         here = gather_rows(reshape(pack(u, self%inside), [1, count(self%inside)]))
         wanted = here(1, :)
      else
         do n = 1, size(wanted)
            wanted(n) = u(self%cells(1, n), self%cells(2, n))
         end do
      end if

      call self%tiles%apply(wanted, pressure)
      call self%boxes%add(wanted, pressure)

      do j = 1, size(u, 2)
         do i = 1, size(u, 1)
            n = self%number(i, self%grid%first_row - 1 + j)
            u(i, j) = 0.0_dp
            if (n > 0) u(i, j) = pressure(n)
         end do
      end do
   end subroutine invert

end module steady_inverse
