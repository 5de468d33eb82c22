!> Fields that move along with the contact, or with the road.
module carried_field
   use asperity_precision, only : dp, int8
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : fetch_rows, new_range_halo, row_halo_type
   implicit none
   private

   public :: carry, shift_field, shift_states

contains

   !> Move a field along with the contact: moved(X) = field(X + motion). When the rubber moves over the road by
   !> `motion`, the contact moves along the rubber by -motion. The field is interpolated bilinearly between cells;
   !> beyond a free grid it continues with its values at the rim. Collective.
   subroutine carry(grid, field, motion, moved)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in), target :: field(:, :)   !! [nx, rows of this process]
      real(dp), intent(in) :: motion(2)          !! of the rubber over the road, along x and y, m
      real(dp), intent(out) :: moved(:, :)       !! [nx, rows of this process]
      type(row_halo_type) :: halo
      real(dp), allocatable, target :: foreign(:, :)
      real(dp) :: part(2)
      integer :: cells(2), range(2), j, row

      associate (cell => [grid%dx, grid%dy])
         cells = floor(motion/cell)
         part = motion/cell - cells
      end associate
      range = [grid%first_row, grid%last_row + 1] + cells(2)
      if (grid%boundary /= boundary_periodic) range = within(grid, range, grid%ny)
      if (grid%rows() == 0) range = [1, 0]
      call new_range_halo(halo, grid, range)
      allocate (foreign(grid%nx, halo%foreign))
      call halo%fetch(field, foreign)
      !$omp parallel do default(none) shared(grid, field, foreign, halo, moved, cells, part) private(j, row)
      do j = 1, grid%rows()
         row = grid%first_row - 1 + j + cells(2)
         call blend_rows(grid, cells(1), part, row_at(row), row_at(row + 1), moved(:, j))
      end do

   contains

      !> The row at a place that may lie beyond the grid.
      function row_at(place) result(values)
         integer, intent(in) :: place
         real(dp), pointer :: values(:)

         associate (k => halo%place(within(grid, place, grid%ny)))
            if (k <= halo%own) values => field(:, k)
            if (k > halo%own) values => foreign(:, k - halo%own)
         end associate
      end function row_at

   end subroutine carry

   !> One row of the result of `carry`, interpolated between the two rows beside it.
   pure subroutine blend_rows(grid, cells, part, below, above, moved)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: cells               !! whole cells along x
      real(dp), intent(in) :: part(2)            !! parts of a cell along x and y, 0 to 1
      real(dp), intent(in) :: below(:), above(:)
      real(dp), intent(out) :: moved(:)
      integer :: i, i0, i1

      associate (u => part(1), v => part(2))
         do i = 1, grid%nx
            i0 = within(grid, i + cells, grid%nx)
            i1 = within(grid, i + cells + 1, grid%nx)
            moved(i) = (1.0_dp - v)*((1.0_dp - u)*below(i0) + u*below(i1)) &
               + v*((1.0_dp - u)*above(i0) + u*above(i1))
         end do
      end associate
   end subroutine blend_rows

   !> The cell of the grid, 1 to n, for a cell number that may lie beyond the grid. There it is the cell that
   !> repeats (periodic) or the nearest cell at the rim (free).
   elemental function within(grid, i, n) result(k)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: i
      integer, intent(in) :: n                   !! cells along this direction
      integer :: k

      k = i
      if (k >= 1 .and. k <= n) return
      if (grid%boundary == boundary_periodic) then
         k = modulo(i - 1, n) + 1
      else
         k = min(max(i, 1), n)
      end if
   end function within

   !> Shift a field by whole cells. Zeros enter at the rim of a free grid. Collective.
   subroutine shift_field(grid, cells, field, moved)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: cells(2)            !! along x and y
      real(dp), intent(inout) :: field(:, :)     !! [nx, rows of this process]
      real(dp), intent(inout) :: moved(:, :)     !! scratch of the same shape
      integer :: i, j, from

      call fetch_rows(grid, field, [grid%first_row, grid%last_row] - cells(2), moved)
      !$omp parallel do default(none) shared(grid, field, moved, cells) private(i, j, from)
      do j = 1, grid%rows()
         do i = 1, grid%nx
            from = grid%column_at(i - cells(1))
            if (from == 0) then
               field(i, j) = 0.0_dp
            else
               field(i, j) = moved(from, j)
            end if
         end do
      end do
   end subroutine shift_field

   !> Shift the contact record by whole cells, as `shift_field` does for real fields. Collective.
   subroutine shift_states(grid, cells, states)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: cells(2)
      integer(int8), intent(inout) :: states(:, :)   !! [nx, rows of this process]
      integer(int8), allocatable :: moved(:, :)
      integer :: i, j, from

      allocate (moved(size(states, 1), size(states, 2)))
      call fetch_rows(grid, states, [grid%first_row, grid%last_row] - cells(2), moved)
      do j = 1, grid%rows()
         do i = 1, grid%nx
            from = grid%column_at(i - cells(1))
            states(i, j) = 0_int8
            if (from > 0) states(i, j) = moved(from, j)
         end do
      end do
   end subroutine shift_states

end module carried_field
