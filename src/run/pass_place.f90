!> Where the next pass of a coupled step reads the road.
!>
!> A pass takes the road from the places z of the rubber's surface, solves, and finds the surface at
!> g(z); the step is solved where both agree. Two things keep z = g(z) from settling, where a block is
!> thick, so that a little of its friction moves it far (by h/G):
!>
!> * The strains around the contact come with tractions that were found before the pass moved the
!>   contact. Read at g(z), the road is stretched beside where the contact now is, and friction
!>   answers this. `carry` moves the displacement with the contact.
!> * The friction of the whole contact changes along the mesh. The two components of the mean of r =
!>   g(z) - z are sought by Broyden's method, all else follows g(z). The first pass is not counted: it
!>   takes the pressure from the step before.
!>
!> Neither moves the solution: at z = g(z) both do nothing.
module pass_place
   use precision, only : dp
   implicit none
   private

   public :: carry, pass_secant_type

   !> Longest and shortest step over the residual that are believed. 1: g(z).
   real(dp), parameter :: longest = 2.0_dp, shortest = 0.05_dp
   real(dp), parameter :: none(2, 2) = reshape([-1.0_dp, 0.0_dp, 0.0_dp, -1.0_dp], [2, 2])

   !> What the passes of one step have shown of the mean.
   type :: pass_secant_type
      private
      integer :: seen = 0                        !! passes
      real(dp) :: jacobian(2, 2) = none          !! of r
      real(dp) :: residual(2) = 0.0_dp           !! r of the pass before, m
      real(dp) :: step(2) = 0.0_dp               !! of z since, m
   contains
      procedure :: next
   end type pass_secant_type

contains

   !> What to add to g(z) for the next place.
   pure subroutine next(self, residual, correction)
      class(pass_secant_type), intent(inout) :: self
      real(dp), intent(in) :: residual(2)        !! r, mean over the contact, m
      real(dp), intent(out) :: correction(2)     !! m
      real(dp) :: missed(2), step(2), j(2, 2)

      self%seen = self%seen + 1
      correction = 0.0_dp
      if (self%seen == 1) return
      j = self%jacobian
      if (self%seen > 2 .and. norm2(self%step) > 0.0_dp) then
         missed = (residual - self%residual - matmul(j, self%step))/dot_product(self%step, self%step)
         j(:, 1) = j(:, 1) + missed*self%step(1)
         j(:, 2) = j(:, 2) + missed*self%step(2)
      end if
      step = step_of(j, residual)
      if (.not. sensible(step, residual)) then
         ! What was seen is not of the mean alone: keep to what was known.
         j = self%jacobian
         step = step_of(j, residual)
      end if
      if (.not. sensible(step, residual)) then
         j = none
         step = residual
      end if
      self%jacobian = j
      self%residual = residual
      self%step = step
      correction = step - residual
   end subroutine next

   !> The step to where r vanishes by its Jacobian.
   pure function step_of(j, residual) result(step)
      real(dp), intent(in) :: j(2, 2)
      real(dp), intent(in) :: residual(2)
      real(dp) :: step(2)
      real(dp) :: determinant

      step = 0.0_dp
      determinant = j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1)
      if (abs(determinant) > 0.0_dp) step = -[j(2, 2)*residual(1) - j(1, 2)*residual(2), &
         j(1, 1)*residual(2) - j(2, 1)*residual(1)]/determinant
   end function step_of

   !> A step is neither much longer than the residual, nor much shorter, nor turned away from it.
   pure function sensible(step, residual) result(yes)
      real(dp), intent(in) :: step(2)
      real(dp), intent(in) :: residual(2)
      logical :: yes
      real(dp) :: length, whole

      length = norm2(step)
      whole = norm2(residual)
      yes = dot_product(step, residual) >= 0.5_dp*length*whole .and. length <= longest*whole .and. &
         length >= shortest*whole
   end function sensible

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

end module pass_place
