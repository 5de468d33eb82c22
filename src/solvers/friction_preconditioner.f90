!> The preconditioner of the tangential problem. From the slip that should vanish, it computes the change of
!> traction that would remove this slip if every point kept its state.
!>
!> With the names of module `friction_cg_fast`,
!>
!>     g = Z r                               the residual of module `friction_problem`
!>     lam                                   curvature of the bound, about r.v/|v|^2; 0 where a point sticks
!>     w = a_0/(a_0 + lam)                   a_0: displacement of a cell under its own unit traction
!>     z = Z [w M (w g) + (1-w)/(a_0+lam) g] M: convolution whose symbol is the inverse of that of A, a 2 x 2 matrix
!>                                           for each wave vector of the periodic grid
!>
!> If all points slip far, lam is much larger than a_0 and w is small. The displacement of a cell is then
!> negligible compared with the curvature of the bounds, and the term with M even more so, because it has the
!> factor w^2. In this case z = w/a_0 g is used, which needs no transforms and as many iterations.
!>
!> In a thick block the compliance h of the mean mode of a periodic operator (for G = 1) is by far the largest one. Every
!> field that is zero outside the contact excites this mode. It is therefore eliminated from g and z (deflation) with the
!> two fields e = w Z of a uniform traction along x and along y. On the mean of the N cells A is about h/N. With
!> E = sum of w Z and H = A + lam,
!>
!>     H e = (h/N) E + lam w Z,     K = e.H e = (h/N) E E + sum of lam w^2 Z
!>
!> and z is computed in three steps:
!>
!>     c = K^-1 sum(w g)
!>     z0 = the preconditioner above, applied to Z (g - H e c)
!>     z = z0 + e (c - K^-1 (H e).z0)
!>
!> The last term is added later, by the sweep that forms the next direction: it adds w Z `shift` to z.
!>
!> A periodic half-space has no mean compliance. A uniform traction of all cells strains nothing there, and one of the cells
!> that stick strains little if few cells do not stick. Its compliance is about h (1 - phi)^2, with the fraction phi of the
!> cells that stick and h = L/pi for the longer side L. Of the exponents 0, 1, 1.5, 2 and 3 that were tried, 2 took the
!> fewest iterations in full contact with a few cells that slip.
module friction_preconditioner
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, pi
   use fft_conv, only : columns_apply, convolution_type, new_inverse_convolution
   use friction_fields, only : fit_field
   use friction_directions, only : scaled_row, total_of, uniform_type, unscaled_row, z_sums_type
   use friction_moves, only : pseudo_inverse
   use friction_problem, only : friction_problem_type
   use kernels, only : kernel_type
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: friction_preconditioner_type, new_friction_preconditioner

   real(dp), parameter :: light = 0.1_dp         !! M is left out if all points slip and their mean w is less

   !> The preconditioner, and the results of its last use.
   type :: friction_preconditioner_type
      type(convolution_type) :: inverse                  !! M
      real(dp), private :: half_wave = 0.0_dp            !! L/pi, m
      logical, private :: periodic = .true.
      logical, private :: has_mean = .true.              !! the solid has a mean compliance
      real(dp), allocatable :: z(:, :, :)                !! [width, 2, rows]
      real(dp) :: shift(2) = 0.0_dp                      !! w Z shift is still to be added to z
      real(dp) :: gz = 0.0_dp                            !! g.z, with the shift
      real(dp) :: cross = 0.0_dp                         !! g.z_old
   contains
      procedure :: set_mean_stiffness
      procedure :: transform_size
      procedure :: apply
      procedure :: destroy
   end type friction_preconditioner_type

contains

   !> Make the preconditioner for the kernel of a solid.
   subroutine new_friction_preconditioner(self, grid, kernel, error)
      type(friction_preconditioner_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel        !! tangential response of the solid
      type(error_type), allocatable, intent(out) :: error
      type(grid_type) :: periodic
      type(kernel_type) :: block

      self%periodic = grid%boundary == boundary_periodic
      self%half_wave = max(grid%lx, grid%ly)/pi
      periodic = grid
      periodic%boundary = boundary_periodic
      block = kernel
      block%mean_mode = self%half_wave
      call new_inverse_convolution(self%inverse, periodic, block, error)
   end subroutine new_friction_preconditioner

   !> Set the mean mode of M to the inverse of that of the operator.
   subroutine set_mean_stiffness(self, operator)
      class(friction_preconditioner_type), intent(inout) :: self
      type(convolution_type), intent(in) :: operator
      real(dp) :: mean

      if (.not. self%periodic) return
      mean = operator%symbols%mean_mode(1)*operator%grid%cells()
      self%has_mean = mean > 0.0_dp
      if (.not. self%has_mean) mean = self%half_wave
      call self%inverse%symbols%set_mean_compliance(1.0_dp/mean)
   end subroutine set_mean_stiffness

   !> Set the mean mode of M for a solid that has none, from the number of cells that stick. Where springs hold a road that
   !> is pulled, they have its mean mode.
   subroutine guess_mean_stiffness(self, problem)
      class(friction_preconditioner_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      real(dp) :: cells, yielding

      if (self%has_mean .or. .not. self%periodic .or. any(problem%spring%pulled)) return
      cells = self%inverse%grid%cells()
      yielding = max(1.0_dp, cells - (problem%cells - problem%slipping))/cells
      call self%inverse%symbols%set_mean_compliance(1.0_dp/(self%half_wave*yielding**2))
   end subroutine guess_mean_stiffness

   !> The size of a transform of the preconditioner, which has no padding, in transforms of the operator.
   pure function transform_size(self, operator) result(size)
      class(friction_preconditioner_type), intent(in) :: self
      type(convolution_type), intent(in) :: operator
      real(dp) :: size

      size = real(self%inverse%mx, dp)*self%inverse%my/(real(operator%mx, dp)*operator%my)
   end function transform_size

   !> Compute z from the residual, g.z and g.z_old.
   subroutine apply(self, problem)
      class(friction_preconditioner_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(uniform_type) :: uniform
      type(z_sums_type), allocatable :: rows(:)
      type(z_sums_type) :: sums
      real(dp) :: inverse(2, 2), coupling(2, 2)

      allocate (rows(problem%rows))
      call fit_field(self%z, problem%width, 2, problem%rows)
      call guess_mean_stiffness(self, problem)
      call mean_mode(problem, inverse, coupling)
      uniform%traction = matmul(inverse, problem%sums%residual)
      uniform%displacement = matmul(coupling, uniform%traction)
      call precondition_rows(self, problem, uniform, .not. bounds_outweigh(problem), rows)
      sums = total_of(rows)
      self%cross = sums%cross
      self%shift = uniform%traction &
         - matmul(inverse, matmul(transpose(coupling), sums%total) + sums%bent)
      self%gz = sums%gz + dot_product(problem%sums%residual, self%shift)
   end subroutine apply

   !> Do all points slip with bounds so curved that A is negligible in comparison? M is then left out.
   pure function bounds_outweigh(problem) result(yes)
      type(friction_problem_type), intent(in) :: problem
      logical :: yes
      real(dp) :: weights                          !! sum of w

      weights = problem%sums%tangent(1) + problem%sums%tangent(3)
      yes = problem%slipping == problem%cells .and. weights < light*problem%cells
   end function bounds_outweigh

   !> Compute the rows of z with M, or without transforms with 1/a_0 in place of M: z = w/a_0 Z (g - H e c).
   subroutine precondition_rows(self, problem, uniform, with_inverse, rows)
      type(friction_preconditioner_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(uniform_type), intent(in) :: uniform
      logical, intent(in) :: with_inverse          !! with M
      type(z_sums_type), intent(inout) :: rows(:)
      real(dp) :: g(problem%width, 2), whole(problem%nx)
      integer :: c, j

      !$omp parallel do default(none) shared(self, problem, uniform, with_inverse, rows) private(j, g) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         call scaled_row(problem%compliance, uniform, problem%work%slip(:, :, j), &
            problem%work%tangent(:, :, j), self%z(:, :, j), g, rows(j)%cross)
         if (with_inverse) then
            call problem%spread_to_transform(self%inverse, g, j)
         else
            self%z(:, :, j) = g/problem%compliance
         end if
      end do
      if (with_inverse) call self%inverse%columns(columns_apply)
      !$omp parallel do default(none) shared(self, problem, uniform, with_inverse, rows) private(c, j, whole) &
      !$omp num_threads(problem%threads)
      do j = 1, problem%rows
         do c = 1, 2
            if (.not. with_inverse) exit
            call self%inverse%backward_row(c, j, whole)
            call problem%work%runs%gather(j, whole, self%z(:, c, j))
         end do
         call unscaled_row(problem%compliance, uniform, problem%work%slip(:, :, j), &
            problem%work%tangent(:, :, j), self%z(:, :, j), rows(j))
      end do
   end subroutine precondition_rows

   !> Compute K^-1 and (h/N) E. They are 0 if the mean mode is not treated separately.
   subroutine mean_mode(problem, inverse, coupling)
      type(friction_problem_type), intent(in) :: problem
      real(dp), intent(out) :: inverse(2, 2)
      real(dp), intent(out) :: coupling(2, 2)
      real(dp) :: tangent(2, 2), k(2, 2)

      inverse = 0.0_dp
      coupling = 0.0_dp
      if (.not. any(problem%mean_compliance > 0.0_dp)) return
      tangent = matrix(problem%sums%tangent)
      coupling(1, :) = problem%mean_compliance(1)*tangent(1, :)
      coupling(2, :) = problem%mean_compliance(2)*tangent(2, :)
      k = matmul(tangent, coupling) + matrix(problem%sums%curved)
      inverse = pseudo_inverse([k(1, 1), 0.5_dp*(k(1, 2) + k(2, 1)), k(2, 2)], 1.0e-12_dp)
   end subroutine mean_mode

   !> The symmetric matrix of xx, xy, yy.
   pure function matrix(elements)
      real(dp), intent(in) :: elements(3)
      real(dp) :: matrix(2, 2)

      matrix = reshape([elements(1), elements(2), elements(2), elements(3)], [2, 2])
   end function matrix

   !> Free the plans.
   subroutine destroy(self)
      class(friction_preconditioner_type), intent(inout) :: self

      call self%inverse%destroy()
   end subroutine destroy

end module friction_preconditioner
