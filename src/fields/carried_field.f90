!> Fields that move along with the contact.
module carried_field
   use asperity_precision, only : dp
   implicit none
   private

   public :: carry

contains

   !> A field around the contact after the contact has moved along the rubber by -motion, bilinear.
   subroutine carry(field, motion, cell, periodic, moved)
      real(dp), intent(in) :: field(:, :)        !! [nx, ny]
      real(dp), intent(in) :: motion(2)          !! of the rubber over the road, m
      real(dp), intent(in) :: cell(2)            !! dx, dy, m
      logical, intent(in) :: periodic            !! else the rim goes on outside
      real(dp), intent(out) :: moved(:, :)       !! [nx, ny]
      real(dp) :: u, v
      integer :: cells(2), nx, ny, i, j, i0, i1, j0, j1

      nx = size(field, 1)
      ny = size(field, 2)
      cells = floor(motion/cell)
      u = motion(1)/cell(1) - cells(1)
      v = motion(2)/cell(2) - cells(2)
      !$omp parallel do default(none) shared(field, moved, cells, u, v, nx, ny, periodic) &
      !$omp private(i, j, i0, i1, j0, j1)
      do j = 1, ny
         j0 = within(j + cells(2), ny, periodic)
         j1 = within(j + cells(2) + 1, ny, periodic)
         do i = 1, nx
            i0 = within(i + cells(1), nx, periodic)
            i1 = within(i + cells(1) + 1, nx, periodic)
            moved(i, j) = (1.0_dp - v)*((1.0_dp - u)*field(i0, j0) + u*field(i1, j0)) &
               + v*((1.0_dp - u)*field(i0, j1) + u*field(i1, j1))
         end do
      end do
   end subroutine carry

   !> The cell itself, its image, or the nearest at the rim.
   elemental function within(i, n, periodic) result(k)
      integer, intent(in) :: i, n
      logical, intent(in) :: periodic
      integer :: k

      k = i
      if (k >= 1 .and. k <= n) return
      if (periodic) then
         k = modulo(i - 1, n) + 1
      else
         k = min(max(i, 1), n)
      end if
   end function within

end module carried_field
