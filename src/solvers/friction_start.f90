!> The start of a tangential solve from rest: the problem on a coarser grid, and its solution on the grid.
!>
!> A solve that starts with hardly any traction spends its first iterations on finding out which cells slip. On a grid with
!> about a quarter of the cells along each side (module `coarse_fields`) each of these iterations costs a sixteenth. The
!> coarse problem has the means of the pressure, the slopes, the displacement of the road and the tractions of the past over
!> its cells. The tractions are interpolated between the centres of the coarse cells, and a cell of the grid starts as one
!> that slips where more than a half of what surrounds it slips.
module friction_start
   use asperity_precision, only : dp, int8
   use coarse_fields, only : coarse_grid, coarsen, refine_linearly
   use fft_conv, only : convolution_type
   use friction_fields, only : friction_fields_type
   use friction_law, only : contact_open, contact_slip, contact_stick
   use regular_grid, only : grid_type
   implicit none
   private

   public :: coarse_friction_type, new_coarse_friction

   !> The fields of a coarse problem.
   type :: coarse_friction_type
      type(grid_type) :: grid
      type(grid_type), private :: fine
      integer, private :: threads = 1
      real(dp), allocatable, private :: pressure(:, :), slope_x(:, :), slope_y(:, :)   !! [nx, rows]
      real(dp), allocatable, private :: drive(:, :, :), past(:, :, :), traction(:, :, :), slip(:, :, :)
      integer(int8), allocatable, private :: contact(:, :)
   contains
      procedure :: fields
      procedure :: give_start
   end type coarse_friction_type

contains

   !> Form the coarse problem. Collective where processes share the rows.
   subroutine new_coarse_friction(self, operator, fine, has_slopes)
      type(coarse_friction_type), intent(out) :: self
      type(convolution_type), intent(in) :: operator
      type(friction_fields_type), intent(in) :: fine   !! the fields of the problem
      logical, intent(in) :: has_slopes
      integer :: c

      self%fine = operator%grid
      self%grid = coarse_grid(operator%grid, squarer=.true.)
      self%threads = operator%threads
      associate (nx => self%grid%nx, rows => self%grid%rows())
         allocate (self%pressure(nx, rows), self%drive(nx, 2, rows))
         allocate (self%traction(nx, 2, rows), self%slip(nx, 2, rows), source=0.0_dp)
         allocate (self%contact(nx, rows))
         allocate (self%slope_x(merge(nx, 0, has_slopes), rows), self%slope_y(merge(nx, 0, has_slopes), rows))
         if (associated(fine%past)) allocate (self%past(nx, 2, rows))
      end associate

      call coarsen(self%fine, self%grid, fine%pressure, self%threads, self%pressure)
      if (has_slopes) then
         call coarsen(self%fine, self%grid, fine%slope_x, self%threads, self%slope_x)
         call coarsen(self%fine, self%grid, fine%slope_y, self%threads, self%slope_y)
      end if
      do c = 1, 2
         call coarsen(self%fine, self%grid, fine%drive(:, c, :), self%threads, self%drive(:, c, :))
         if (associated(fine%past)) &
            call coarsen(self%fine, self%grid, fine%past(:, c, :), self%threads, self%past(:, c, :))
      end do
      self%contact = merge(contact_stick, contact_open, self%pressure > 0.0_dp)
   end subroutine new_coarse_friction

   !> The fields of the coarse problem as the solver takes them.
   function fields(self)
      class(coarse_friction_type), intent(inout), target :: self
      type(friction_fields_type) :: fields

      fields%pressure => self%pressure
      fields%slope_x => self%slope_x
      fields%slope_y => self%slope_y
      fields%drive => self%drive
      if (allocated(self%past)) fields%past => self%past
      fields%traction => self%traction
      fields%slip => self%slip
      fields%contact => self%contact
   end function fields

   !> Set the tractions and states of the problem from the coarse solution. Collective where processes share the rows.
   subroutine give_start(self, fine)
      class(coarse_friction_type), intent(in) :: self
      type(friction_fields_type), intent(in) :: fine   !! its targets `traction` and `contact` are changed
      real(dp), allocatable :: slips(:, :)
      integer :: c

      allocate (slips(self%fine%nx, self%fine%rows()))
      do c = 1, 2
         call refine_linearly(self%grid, self%fine, self%traction(:, c, :), self%threads, slips)
         fine%traction(:, c, :) = slips
      end do
      call refine_linearly(self%grid, self%fine, merge(1.0_dp, 0.0_dp, self%contact == contact_slip), self%threads, slips)
      where (fine%contact /= contact_open) fine%contact = merge(contact_slip, contact_stick, slips > 0.5_dp)
   end subroutine give_start

end module friction_start
