!> Fields that move along with the contact, or with the road.
module carried_field
   use asperity_precision, only : dp, int8
   use regular_grid, only : boundary_periodic, grid_type
   use row_fetch, only : fetch_rows
   implicit none
   private

   public :: carry, shift_field, shift_states

contains

   !> A field around the contact after the contact has moved along the rubber by -motion, bilinear. On a
   !> free grid the rim goes on outside. Collective.
   subroutine carry(grid, field, motion, moved)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)        !! [nx, rows of this process]
      real(dp), intent(in) :: motion(2)          !! of the rubber over the road, m
      real(dp), intent(out) :: moved(:, :)       !! [nx, rows of this process]
      real(dp), allocatable :: rows(:, :)
      real(dp) :: part(2)
      integer :: cells(2), range(2), j, j0, j1

      associate (cell => [grid%dx, grid%dy])
         cells = floor(motion/cell)
         part = motion/cell - cells
      end associate
      if (.not. grid%shared) then
         !$omp parallel do default(none) shared(grid, field, moved, cells, part) private(j, j0, j1)
         do j = 1, grid%ny
            j0 = within(grid, j + cells(2), grid%ny)
            j1 = within(grid, j + cells(2) + 1, grid%ny)
            call blend_rows(grid, cells(1), part, field(:, j0), field(:, j1), moved(:, j))
         end do
         return
      end if
      range = [grid%first_row, grid%last_row + 1] + cells(2)
      if (grid%rows() == 0) range = [1, 0]
      if (grid%boundary /= boundary_periodic .and. grid%rows() > 0) &
         range = within(grid, range, grid%ny)
      allocate (rows(grid%nx, range(2) - range(1) + 1))
      call fetch_rows(grid, field, range, rows)
      !$omp parallel do default(none) shared(grid, rows, moved, cells, part, range) private(j, j0, j1)
      do j = 1, grid%rows()
         j0 = grid%first_row + j - 1 + cells(2)
         j1 = j0 + 1
         if (grid%boundary /= boundary_periodic) then
            j0 = within(grid, j0, grid%ny)
            j1 = within(grid, j1, grid%ny)
         end if
         call blend_rows(grid, cells(1), part, rows(:, j0 - range(1) + 1), rows(:, j1 - range(1) + 1), &
            moved(:, j))
      end do
   end subroutine carry

   !> A row of a field that is carried, from the two rows between which it lies.
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

   !> The cell itself, its image, or the nearest at the rim.
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

   !> Shift a field by whole cells; what enters a free grid is zero. Collective.
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
            from = source_cell(grid, i - cells(1))
            if (from == 0) then
               field(i, j) = 0.0_dp
            else
               field(i, j) = moved(from, j)
            end if
         end do
      end do
   end subroutine shift_field

   !> The same for the states of contact.
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
            from = source_cell(grid, i - cells(1))
            states(i, j) = 0_int8
            if (from > 0) states(i, j) = moved(from, j)
         end do
      end do
   end subroutine shift_states

   !> The cell along x from which a value comes, 0 if it comes from beyond a free grid.
   elemental function source_cell(grid, i) result(k)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: i
      integer :: k

      k = i
      if (k >= 1 .and. k <= grid%nx) return
      k = 0
      if (grid%boundary == boundary_periodic) k = modulo(i - 1, grid%nx) + 1
   end function source_cell

end module carried_field
