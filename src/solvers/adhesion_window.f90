!> A window on a few cells of an adhesive contact, whose gaps are relaxed while those around it stand still.
!>
!> The energy of the window is minimised like the model of the whole contact (module `adhesion_descent`), by
!> preconditioned conjugate gradients in which no iteration changes g + z_0 of a cell by more than a fraction of it. The
!> changes s of its gaps vanish outside. They are expanded in sines that vanish at the edges of the window, for which the
!> stiffness of the solid is diagonal:
!>     B s = S L S s,   S_jk = (2/(n + 1))^(1/2) sin(pi j k/(n + 1)) in both directions,
!> where n is the number of cells along a side, and L the symbol of B. This differs from B by mirror images of s at the
!> edges, which are far away if s is near the centre. The preconditioner is the inverse, S L^-1 S / Q. Four products of
!> n x n matrices are one such product. They cost little, since n is small, and no transform of the grid is needed.
module adhesion_window
   use adhesion_potential, only : adhesive_slopes
   use adhesion_state, only : adhesion_problem_type
   use adhesion_sweeps, only : scale_cells
   use asperity_precision, only : dp, pi
   use kernels, only : kernel_type
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   implicit none
   private

   public :: adhesion_window_type, largest_change, least_stiffness, new_adhesion_window, side, window_task_type

   integer, parameter :: side = 32                    !! cells along a side of a window
   integer, parameter :: most_iterations = 100
   ! The same hold for the model of the whole contact:
   real(dp), parameter :: largest_change = 0.7_dp     !! of g + z_0 in an iteration, relative to g + z_0
   real(dp), parameter :: least_stiffness = 0.25_dp   !! least part of d.B d that counts, whatever the attraction

   !> The stiffness of a window.
   type :: adhesion_window_type
      real(dp), private :: sines(side, side) = 0.0_dp      !! S
      real(dp), private :: stiffness(side, side) = 0.0_dp  !! L, the symbol of B for a shear modulus of 1
   contains
      procedure :: relax
   end type adhesion_window_type

   !> What the windows of a contact have in common.
   type :: window_task_type
      type(adhesion_problem_type) :: problem
      real(dp) :: length = 1.0_dp         !! unit of gaps in the residual, m
      real(dp) :: traction = 1.0_dp       !! unit of tractions, Pa
      real(dp) :: scaling = 0.0_dp        !! k of the Gauss potential, Pa/m; 0: none
      real(dp) :: goal = 0.0_dp           !! natural residual with which a window is relaxed
   end type window_task_type

   !> The fields of a window that is being relaxed.
   type :: window_state_type
      real(dp), dimension(side, side) :: gap = 0.0_dp           !! g, m
      real(dp), dimension(side, side) :: traction = 0.0_dp      !! P, the load included, Pa
      real(dp), dimension(side, side) :: residual = 0.0_dp      !! r = -G on the free cells, Pa
      real(dp), dimension(side, side) :: curvature = 0.0_dp     !! e'', Pa/m
      real(dp), dimension(side, side) :: direction = 0.0_dp     !! d, m
   end type window_state_type

contains

   !> Make the window for the cells of a grid.
   subroutine new_adhesion_window(self, grid, kernel)
      type(adhesion_window_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel         !! normal response of the solid
      integer, parameter :: period = 2*(side + 1)     !! of the sines, cells
      real(dp) :: symbols(0:side + 1, 0:side + 1, 1)
      integer :: j, k

      do k = 1, side
         do j = 1, side
            self%sines(j, k) = sqrt(2.0_dp/(side + 1))*sin(pi*j*k/(side + 1))
         end do
      end do
      call kernel%inverse_symbols(new_grid(period, period, period*grid%dx, period*grid%dy, boundary_periodic), &
         symbols, 0)
      self%stiffness(:, :) = symbols(1:side, 1:side, 1)
   end subroutine new_adhesion_window

   !> Relax the gaps of a window under the traction that the whole contact causes there.
   subroutine relax(self, task, traction, gap)
      class(adhesion_window_type), intent(in) :: self
      type(window_task_type), intent(in) :: task
      real(dp), intent(in) :: traction(:, :)          !! P, the load included, Pa
      real(dp), intent(inout) :: gap(:, :)            !! g, m
      type(window_state_type) :: now
      real(dp), dimension(side, side) :: z, old
      real(dp) :: beta, rz, old_rz, residual, slope
      integer :: k

      now%gap(:, :) = gap
      now%traction(:, :) = traction
      old(:, :) = 0.0_dp
      old_rz = 0.0_dp
      do k = 1, most_iterations
         call measure(task, now, residual)
         if (residual <= task%goal) exit

         call precondition(self, task, now, z)
         rz = sum(z*now%residual)
         beta = 0.0_dp
         if (old_rz > 0.0_dp) beta = max(0.0_dp, (rz - sum(z*old))/old_rz)
         now%direction(:, :) = merge(z + beta*now%direction, 0.0_dp, max(now%gap, z) > 0.0_dp)
         slope = sum(now%residual*now%direction)
         if (.not. slope > 0.0_dp) then
            now%direction(:, :) = z
            slope = rz
         end if
         if (.not. slope > 0.0_dp) exit

         old(:, :) = now%residual
         old_rz = rz
         call descend(self, task, slope, now)
      end do
      gap(:, :) = now%gap
   end subroutine relax

   !> Compute the natural residual, r and e''.
   subroutine measure(task, now, residual)
      type(window_task_type), intent(in) :: task
      type(window_state_type), intent(inout) :: now
      real(dp), intent(out) :: residual
      real(dp) :: gradient(side)
      integer :: j

      residual = 0.0_dp
      do j = 1, side
         call adhesive_slopes(task%problem%potential, now%gap(:, j), gradient, now%curvature(:, j))
         gradient(:) = now%traction(:, j) + gradient
         residual = max(residual, maxval(abs(min(now%gap(:, j)/task%length, gradient/task%traction))))
         now%residual(:, j) = merge(-gradient, 0.0_dp, max(now%gap(:, j), -gradient) > 0.0_dp)
      end do
   end subroutine measure

   !> Compute z = M r on the free cells, except in cells in contact that z would close.
   subroutine precondition(self, task, now, z)
      type(adhesion_window_type), intent(in) :: self
      type(window_task_type), intent(in) :: task
      type(window_state_type), intent(in) :: now
      real(dp), intent(out) :: z(side, side)
      real(dp) :: scaled(side, side)
      integer :: j

      scaled(:, :) = now%residual
      do j = 1, side
         if (task%scaling > 0.0_dp) call scale_cells(now%curvature(:, j), task%scaling, scaled(:, j))
      end do
      z(:, :) = in_sines(self, scaled, 1.0_dp/(task%problem%modulus*self%stiffness))
      do j = 1, side
         if (task%scaling > 0.0_dp) call scale_cells(now%curvature(:, j), task%scaling, z(:, j))
      end do
      z(:, :) = merge(z, 0.0_dp, max(now%gap, now%residual) > 0.0_dp)
      z(:, :) = max(z, merge(-huge(1.0_dp), 0.0_dp, now%gap > 0.0_dp))
   end subroutine precondition

   !> Move along the direction by the length that its curvature predicts. Gaps that would be negative are closed.
   subroutine descend(self, task, slope, now)
      type(adhesion_window_type), intent(in) :: self
      type(window_task_type), intent(in) :: task
      real(dp), intent(in) :: slope                   !! r.d
      type(window_state_type), intent(inout) :: now
      real(dp), dimension(side, side) :: image, trial
      real(dp) :: alpha, form, stiffness

      image(:, :) = task%problem%modulus*in_sines(self, now%direction, self%stiffness)
      form = sum(now%direction*image)
      stiffness = max(form + sum(now%curvature*now%direction**2), least_stiffness*form)
      alpha = largest_change/maxval(abs(now%direction)/(now%gap + task%length))
      if (stiffness*alpha > slope) alpha = slope/stiffness

      trial(:, :) = now%gap + alpha*now%direction
      now%traction(:, :) = now%traction + alpha*image
      now%gap(:, :) = max(trial, 0.0_dp)
      if (all(trial >= 0.0_dp)) return
      now%traction(:, :) = now%traction + task%problem%modulus*in_sines(self, now%gap - trial, self%stiffness)
   end subroutine descend

   !> S symbol S x, where the symbol multiplies each pair of sines.
   function in_sines(self, x, symbol) result(product)
      type(adhesion_window_type), intent(in) :: self
      real(dp), intent(in), dimension(side, side) :: x, symbol
      real(dp) :: product(side, side)

      product(:, :) = symbol*matmul(self%sines, matmul(x, self%sines))
      product(:, :) = matmul(self%sines, matmul(product, self%sines))
   end function in_sines

end module adhesion_window
