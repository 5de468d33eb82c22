!> The coarse level of an approximate inverse of the normal compliance K on the cells in contact.
!>
!> The grid is divided into at most 144 boxes. In each box that has cells in contact, a uniform pressure of these cells
!> sets their mean displacement. The compliance between two boxes is that between boxes full of cells, which
!> depends on their distance alone. Where only a part of a box is in contact, its own compliance is larger in
!> proportion.
module contact_boxes
   use asperity_parallel, only : gather_rows
   use asperity_precision, only : dp
   use dense_factors, only : factor, solve_factors
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: contact_boxes_type

   integer, parameter :: most_boxes = 144
   integer, parameter :: least_side = 8          !! cells along a side of a box, unless the grid has fewer

   !> The boxes of a grid.
   type :: contact_boxes_type
      integer, private :: cells(2) = 0           !! of the grid
      integer, private :: boxes(2) = 0
      real(dp), allocatable, private :: kernel(:, :)   !! mean displacement of a box by a unit sum of P in the first
      integer, allocatable, private :: box(:)    !! of each cell in contact, among the boxes in contact
      real(dp), allocatable, private :: count(:)       !! cells of each of these boxes
      real(dp), allocatable, private :: matrix(:, :)   !! factors of their compliance
   contains
      procedure :: begin
      procedure :: renew
      procedure :: add
   end type contact_boxes_type

contains

   !> Begin with the operator of another speed.
   subroutine begin(self, operator)
      class(contact_boxes_type), intent(inout) :: self
      type(steady_operator_type), intent(inout) :: operator
      real(dp), allocatable :: load(:, :), u(:, :)
      integer :: at(2), i, j, width

      self%cells = [operator%nx, operator%ny]
      width = max(least_side, ceiling(sqrt(product(real(self%cells, dp))/most_boxes)))
      self%boxes = max(self%cells/width, 1)
      ! On an oblong grid with one row of boxes, these are longer than wide.
      self%boxes = min(self%boxes, max(most_boxes/self%boxes([2, 1]), 1))
      allocate (load(operator%nx, operator%rows), u(operator%nx, operator%rows))
      do j = 1, operator%rows
         do i = 1, operator%nx
            at = box_at(self, [i, operator%grid%first_row + j - 1])
            load(i, j) = merge(1.0_dp, 0.0_dp, all(at == 1))
         end do
      end do
      call operator%displace(load, u)
      call find_kernel(self, u)
   end subroutine begin

   !> Compute the mean displacements of the boxes from that of all cells under a unit pressure in the first box. Their
   !> sums are formed in the order of the rows of the grid, so that they do not depend on the number of processes.
   subroutine find_kernel(self, u)
      type(contact_boxes_type), intent(inout) :: self
      real(dp), intent(in) :: u(:, :)
      real(dp), allocatable :: rows(:, :)
      real(dp) :: cells(self%boxes(1), self%boxes(2))  !! in each box
      integer :: at(2), i, j

      allocate (rows(self%boxes(1), size(u, 2)), source=0.0_dp)
      do j = 1, size(u, 2)
         do i = 1, size(u, 1)
            at = box_at(self, [i, 1])
            rows(at(1), j) = rows(at(1), j) + u(i, j)
         end do
      end do
      rows = gather_rows(rows)
      if (allocated(self%kernel)) deallocate (self%kernel)
      allocate (self%kernel(self%boxes(1), self%boxes(2)), source=0.0_dp)
      cells = 0.0_dp
      do j = 1, self%cells(2)
         do i = 1, self%cells(1)
            at = box_at(self, [i, j])
            cells(at(1), at(2)) = cells(at(1), at(2)) + 1.0_dp
         end do
         at = box_at(self, [1, j])
         self%kernel(:, at(2)) = self%kernel(:, at(2)) + rows(:, j)
      end do
      self%kernel = self%kernel/(cells*cells(1, 1))
   end subroutine find_kernel

   !> The box of a cell.
   pure function box_at(self, cell) result(box)
      type(contact_boxes_type), intent(in) :: self
      integer, intent(in) :: cell(2)
      integer :: box(2)

      box = (cell - 1)*self%boxes/self%cells + 1
   end function box_at

   !> Prepare for another set of cells in contact.
   subroutine renew(self, cells, spring)
      class(contact_boxes_type), intent(inout) :: self
      integer, intent(in) :: cells(:, :)         !! in contact, column and row of the grid [2, n]
      real(dp), intent(in) :: spring             !! compliance of a spring on each cell, m/Pa
      integer :: number(self%boxes(1), self%boxes(2)), places(2, product(self%boxes))
      integer :: a, at(2), b, k, n

      number = 0
      n = 0
      if (allocated(self%box)) deallocate (self%box, self%count, self%matrix)
      allocate (self%box(size(cells, 2)), self%count(product(self%boxes)))
      do k = 1, size(cells, 2)
         at = box_at(self, cells(:, k))
         if (number(at(1), at(2)) == 0) then
            n = n + 1
            number(at(1), at(2)) = n
            places(:, n) = at
            self%count(n) = 0.0_dp
         end if
         self%box(k) = number(at(1), at(2))
         self%count(self%box(k)) = self%count(self%box(k)) + 1.0_dp
      end do

      self%count = self%count(:n)
      allocate (self%matrix(n, n))
      do b = 1, n
         do a = 1, n
            at = modulo(places(:, a) - places(:, b), self%boxes) + 1
            self%matrix(a, b) = self%kernel(at(1), at(2))
         end do
         self%matrix(b, b) = self%matrix(b, b)*product(real(self%cells, dp)/self%boxes)/self%count(b) &
            + spring/self%count(b)
      end do
      call factor(self%matrix, 1)
   end subroutine renew

   !> Add the pressures that displace the boxes as wanted.
   subroutine add(self, wanted, pressure)
      class(contact_boxes_type), intent(in) :: self
      real(dp), intent(in) :: wanted(:)          !! of the cells in contact, m
      real(dp), intent(inout) :: pressure(:)     !! Pa
      real(dp) :: mean(size(self%count))
      integer :: k

      mean = 0.0_dp
      do k = 1, size(wanted)
         mean(self%box(k)) = mean(self%box(k)) + wanted(k)
      end do
      mean = mean/self%count
      call solve_factors(self%matrix, mean)
      mean = mean/self%count
      do k = 1, size(pressure)
         pressure(k) = pressure(k) + mean(self%box(k))
      end do
   end subroutine add

end module contact_boxes
