!> An approximate inverse of the derivative of the joint equations (module `joint_system`), with which GMRES takes few
!> directions.
!>
!> The grid is divided into tiles of at most 4 x 4 cells (module `cell_tiles`). The inverse of a tile couples the
!> pressures and tractions of its cells completely: through the displacements that they cause at each other, the road that
!> is read at the displaced cells, and the friction law. This is what makes the equations hard to solve where slopes are
!> steep or cells nearly stick. The effect of distant cells is left to GMRES. Larger tiles hardly save directions.
!>
!> Near a solution the derivative hardly changes from one of Newton's steps to the next. An inverse is therefore only made
!> again if its cells or their derivatives have changed.
!>
!> If processes share the rows, all of them keep the list of all cells.
!>
!> Memory: the inverses in single precision, at most 183 doubles per cell in the list, and 22 doubles per cell while they
!> are made. Where there is no memory for the inverse of a tile, its residuals remain as they are.
module joint_tiles
   use asperity_parallel, only : any_process, gather_rows, global_sum
   use asperity_precision, only : dp, sp
   use cell_derivative, only : cell_derivative_type, numbers_per_derivative
   use cell_tiles, only : tile_cells_type, tile_layout_type, tile_rim
   use dense_factors, only : invert
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: cell_responses_type, even, joint_tiles_type, near_values, neither, odd

   integer, parameter :: side = 4                !! cells along a side of a tile, at most
   integer, parameter :: near_reach = side + 2*tile_rim - 1   !! largest distance of two cells of a tile
   real(sp), parameter :: least_pivot = 1.0e-2_sp
   !> An inverse is kept if the effects of the cells of the tile on themselves change by no more than this, relative to
   !> the largest of them.
   real(dp), parameter :: negligible = 0.1_dp

   ! Displacements around a loaded cell that are even in x and in y, odd in x and in y, or neither:
   integer, parameter :: even = 1, odd = -1, neither = 0

   !> The displacements around a loaded cell. The first index of a tensor is the direction of the displacement, the
   !> second one that of the traction; the last two are the distances from the loaded cell.
   type :: cell_responses_type
      real(dp) :: depth(-near_reach:near_reach, -near_reach:near_reach) = 0.0_dp         !! U_z by P, m/Pa
      real(dp) :: place(2, 2, -near_reach:near_reach, -near_reach:near_reach) = 0.0_dp   !! U_T by T, m/Pa
      real(dp) :: slip(2, 2, -near_reach:near_reach, -near_reach:near_reach) = 0.0_dp    !! slip by T, m/Pa
   end type cell_responses_type

   !> A tile.
   type, extends(tile_cells_type) :: tile_type
      real(sp), allocatable :: inverse(:, :)     !! rows of its own cells [3 own, 3 n]
      real(dp), allocatable :: own_parts(:, :, :) !! effect of each cell on itself, in that matrix [3, 3, n]
   end type tile_type

   !> All tiles of a grid.
   type :: joint_tiles_type
      type(cell_derivative_type), allocatable :: derivative(:)   !! of all cells in the list
      type(tile_layout_type), private :: layout
      type(tile_type), allocatable, private :: tile(:)
   contains
      procedure :: forget
      procedure :: renew
      procedure :: apply
   end type joint_tiles_type

contains

   !> The values of a field around its first cell. The field is the displacement under a load in this cell. With a parity,
   !> the values on the far sides of the cell are those on the near sides, so that the grid need not be periodic.
   function near_values(grid, field, parity) result(near)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: field(:, :)        !! [nx, rows]
      integer, intent(in) :: parity              !! even, odd or neither
      real(dp) :: near(-near_reach:near_reach, -near_reach:near_reach)
      integer :: at(2), i, j
      real(dp) :: sign

      near = 0.0_dp
      do j = -near_reach, near_reach
         do i = -near_reach, near_reach
            at = [i, j]
            sign = 1.0_dp
            if (parity /= neither) at = abs(at)
            if (parity == odd .and. (i < 0 .neqv. j < 0)) sign = -1.0_dp
            if (grid%boundary /= boundary_periodic .and. any(at >= [grid%nx, grid%ny])) cycle
            at = modulo(at, [grid%nx, grid%ny]) + 1
            at(2) = at(2) - grid%first_row + 1
            if (at(2) >= 1 .and. at(2) <= size(field, 2)) near(i, j) = sign*field(at(1), at(2))
         end do
      end do
      if (grid%shared) near = reshape(global_sum(reshape(near, [size(near)])), shape(near))
   end function near_values

   !> Forget all inverses, so that the next ones do not depend on earlier solves.
   subroutine forget(self)
      class(joint_tiles_type), intent(inout) :: self

      if (allocated(self%tile)) deallocate (self%tile)
   end subroutine forget

   !> Make the inverses for a list of cells. `done` is .false. if there is no memory for the list.
   subroutine renew(self, grid, first, cell, derivative, near, scale, done)
      class(joint_tiles_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first(:)            !! [rows + 1] the first cell of each row in the list
      integer, intent(in) :: cell(:)             !! the cells of the list, i
      !> of the cells of this process; out: not allocated
      type(cell_derivative_type), allocatable, intent(inout) :: derivative(:)
      type(cell_responses_type), intent(in) :: near
      real(dp), intent(in) :: scale(2)           !! units of length and traction, m and Pa
      logical, intent(out) :: done
      integer, allocatable :: number(:, :)       !! of each cell of the grid in the list; 0: not in it
      integer :: status, t
      logical :: changed

      self%layout = tile_layout_type(side, [grid%nx, grid%ny], grid%shared, grid%boundary == boundary_periodic)
      allocate (number(grid%nx, grid%ny), source=0, stat=status)
      done = .not. any_process(status /= 0)
      if (.not. done) return
      call number_cells(self, grid, first, cell, derivative, number)

      if (allocated(self%tile)) then
         if (size(self%tile) /= product(self%layout%tiles)) deallocate (self%tile)
      end if
      if (.not. allocated(self%tile)) allocate (self%tile(product(self%layout%tiles)))
      !$omp parallel do default(none) shared(self, number, near, scale) private(t, changed) schedule(dynamic)
      do t = 1, size(self%tile)
         if (.not. self%layout%is_mine(t)) cycle
         call self%layout%list_cells(number, t, self%tile(t), changed)
         if (self%tile(t)%own > 0) call renew_tile(self%tile(t), changed, self%derivative, near, scale)
      end do
   end subroutine renew

   !> Number the cells of all processes, and collect their derivatives.
   subroutine number_cells(self, grid, first, cell, derivative, number)
      type(joint_tiles_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: first(:), cell(:)
      type(cell_derivative_type), allocatable, intent(inout) :: derivative(:)
      integer, intent(inout) :: number(:, :)
      real(dp), allocatable :: here(:, :)
      integer :: j, k, n

      if (.not. grid%shared) then
         do j = 1, size(first) - 1
            do k = first(j), first(j + 1) - 1
               number(cell(k), j) = k
            end do
         end do
         call move_alloc(derivative, self%derivative)
         return
      end if

      allocate (here(2 + numbers_per_derivative, size(derivative)))
      do j = 1, size(first) - 1
         do k = first(j), first(j + 1) - 1
            here(:, k) = [real([cell(k), grid%first_row - 1 + j], dp), derivative(k)%packed()]
         end do
      end do
      here = gather_rows(here)
      deallocate (derivative)
      if (allocated(self%derivative)) deallocate (self%derivative)
      allocate (self%derivative(size(here, 2)))
      do n = 1, size(here, 2)
         number(nint(here(1, n)), nint(here(2, n))) = n
         call self%derivative(n)%unpack(here(3:, n))
      end do
   end subroutine number_cells

   !> Make the inverse of a tile, unless the effects of its cells on themselves have hardly changed.
   subroutine renew_tile(tile, changed, derivative, near, scale)
      type(tile_type), intent(inout) :: tile
      logical, intent(in) :: changed             !! the tile has other cells than before
      type(cell_derivative_type), intent(in) :: derivative(:)
      type(cell_responses_type), intent(in) :: near
      real(dp), intent(in) :: scale(2)
      real(dp) :: own_parts(3, 3, size(tile%numbers))
      integer :: a

      do a = 1, size(tile%numbers)
         associate (cell => derivative(tile%numbers(a)))
            own_parts(:, :, a) = cell%by_own + part_of_pair(cell, cell, near, scale, [0, 0])
         end associate
      end do
      if (.not. changed .and. allocated(tile%inverse)) then
         if (maxval(abs(own_parts - tile%own_parts)) <= negligible*maxval(abs(tile%own_parts))) return
      end if
      tile%own_parts = own_parts
      if (allocated(tile%inverse)) deallocate (tile%inverse)
      call invert_tile(tile, derivative, near, scale)
   end subroutine renew_tile

   !> The derivative of the scaled residuals of a cell to the scaled unknowns of a cell, by the displacements alone.
   pure function part_of_pair(to, from, near, scale, d) result(part)
      type(cell_derivative_type), intent(in) :: to, from
      type(cell_responses_type), intent(in) :: near
      real(dp), intent(in) :: scale(2)
      integer, intent(in) :: d(2)                !! places of the first cell minus that of the second one
      real(dp) :: part(3, 3)

      part(:, 1) = [near%depth(d(1), d(2))*from%pressure/scale(1), 0.0_dp, 0.0_dp]
      part(:, 2:3) = scale(2)*(matmul(to%by_place, near%place(:, :, d(1), d(2))) &
         + matmul(to%by_slip, near%slip(:, :, d(1), d(2))))
   end function part_of_pair

   !> Make the inverse of a tile, if there is memory for it.
   subroutine invert_tile(tile, derivative, near, scale)
      type(tile_type), intent(inout) :: tile
      type(cell_derivative_type), intent(in) :: derivative(:)
      type(cell_responses_type), intent(in) :: near
      real(dp), intent(in) :: scale(2)
      real(sp) :: matrix(3*size(tile%numbers), 3*size(tile%numbers))
      real(dp) :: part(3, 3)
      integer :: a, b, status

      do b = 1, size(tile%numbers)
         do a = 1, size(tile%numbers)
            part = part_of_pair(derivative(tile%numbers(a)), derivative(tile%numbers(b)), near, scale, &
               tile%places(:, a) - tile%places(:, b))
            if (a == b) part = tile%own_parts(:, :, a)
            matrix(3*a - 2:3*a, 3*b - 2:3*b) = real(part, sp)
         end do
      end do
      call invert(matrix, least_pivot)
      allocate (tile%inverse(3*tile%own, size(matrix, 2)), stat=status)
      if (status == 0) tile%inverse(:, :) = matrix(:3*tile%own, :)
   end subroutine invert_tile

   !> Replace the scaled residuals of all cells by the changes of their scaled unknowns that would remove them.
   subroutine apply(self, v)
      class(joint_tiles_type), intent(in) :: self
      real(dp), intent(inout) :: v(:, :)         !! [3, all cells]
      real(dp), allocatable :: found(:, :)
      integer :: t

      allocate (found, mold=v)
      found = 0.0_dp
      !$omp parallel do default(none) shared(self, v, found) private(t) schedule(static)
      do t = 1, size(self%tile)
         if (self%tile(t)%own > 0) call apply_tile(self%tile(t), v, found)
      end do
      if (self%layout%shared) found = reshape(global_sum(reshape(found, [size(found)])), shape(found))
      v(:, :) = found
   end subroutine apply

   !> Apply the inverse of a tile.
   subroutine apply_tile(tile, v, found)
      type(tile_type), intent(in) :: tile
      real(dp), intent(in) :: v(:, :)
      real(dp), intent(inout) :: found(:, :)
      real(sp) :: here(3*size(tile%numbers)), sums(3*tile%own)
      integer :: b

      associate (own => tile%numbers(:tile%own))
         if (.not. allocated(tile%inverse)) then
            found(:, own) = v(:, own)
            return
         end if
         here = real(reshape(v(:, tile%numbers), [size(here)]), sp)
         sums = 0.0_sp
         do b = 1, size(here)
            sums = sums + here(b)*tile%inverse(:, b)
         end do
         found(:, own) = reshape(sums, [3, tile%own])
      end associate
   end subroutine apply_tile

end module joint_tiles
