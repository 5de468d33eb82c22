!> The tangential problem of one step: stick, slip and tractions on a known contact.
!>
!> Given the displacement DX of the road against the rubber, find the traction T within the bound of
!> the friction law such that the slip r = DX - A T is zero where T is inside its bound, and along D
!> = T - T* where it is on it (thesis, eq. 3.1; modules `friction_law`, `friction_problem`).
!>
!> The operator A is that of G = 1. For a scheme of time with the factor Q pass DX' = Q DX and the
!> traction T_h of the memory: r = Q DX - A (T + T_h) is then Q times the slip, and the displacement
!> is U = DX - r/Q, without another product. With inertia the mean mode of the operator differs from
!> A(0): set it by `set_mean_compliance`.
!>
!> Methods: 'fast' (module `friction_cg_fast`, falling back on `friction_cg_gradient`), 'gradient'
!> (the fallback alone) and 'thesis' (`friction_cg_thesis`). Converged means both the criterion of
!> the thesis, |T' - T|/|T'| <= tolerance (eq. 3.15), and the residual of all points: the largest
!> slip of a sticking point, part of the slip across its traction, or slip against it, over the RMS
!> of DX or of A T in the contact, or over the least scale, whichever is largest.
!>
!> Memory beside the caller's fields: eleven fields, the two of the operator's spectrum and the two
!> of the preconditioner's with its symbols (3/4 of a field).
!>
!> Iterations against the mesh: examples/friction_iterations and docs/benchmarks.md. An iteration of
!> 'fast' takes one and a half products of the operator where points slip.
!> The preconditioner of 'fast' takes one product of its own, without padding, an iteration.
!> There is no proof of convergence where the slope counts. Cones steeper than 1/mu have no bound
!> uphill; where many points jam so, a solution may not be found, or not be there.
module friction_cg
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_tensor_symbol_operator
   use friction_cg_fast, only : iterate_fast
   use friction_cg_gradient, only : iterate_gradient
   use friction_cg_thesis, only : iterate_thesis
   use friction_law, only : friction_law_type
   use friction_problem, only : friction_problem_type
   use friction_pull, only : friction_pull_type
   use influence, only : tangential_symbol
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use omp_lib, only : omp_get_wtime
   use asperity_precision, only : dp, int8, pi
   use regular_grid, only : boundary_periodic, grid_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: friction_solver_type, new_friction_solver, set_mean_compliance

   integer, parameter, public :: friction_fast = 1
   integer, parameter, public :: friction_thesis = 2
   integer, parameter, public :: friction_gradient = 3

   integer, parameter :: gradient_steps = 100    !! at a time, when the fast method stalls
   integer, parameter :: hangings = 60           !! of the spring, at most
   integer, parameter :: idle_hangings = 3       !! in full slip, after which nothing helps
   !> Mean compliance over the length of the cell from where the fast method treats it apart. Below,
   !> that costs iterations, above it saves them.
   real(dp), parameter :: thick = 0.2_dp

   !> Work space and preconditioner for one operator.
   type :: friction_solver_type
      integer :: method = friction_fast
      real(dp) :: tolerance = 1.0e-6_dp
      integer :: max_iterations = 1000
      !> T has to settle too, |T' - T|/|T'| <= tolerance. Without it the displacements are good to the
      !> tolerance, T is less so.
      logical :: settle = .true.
      !> The displacements count as this large at least, in the units of DX': of the parts that make
      !> them up, where these may cancel.
      real(dp) :: least_scale = 0.0_dp
      logical :: near = .false.                  !! T starts near the solution, as in a step like the last
      type(friction_pull_type) :: pull           !! a total of T that is prescribed, and the road's place
      type(convolution_type), private :: preconditioner
      logical, private :: periodic = .true.
      real(dp), private :: length = 0.0_dp       !! of the longer side, m
      real(dp), private :: compliance = 0.0_dp   !! a_0
      real(dp), allocatable, private :: zx(:, :), zy(:, :), dx(:, :), dy(:, :)
      real(dp), allocatable, private :: old_x(:, :), old_y(:, :), vx(:, :), vy(:, :)
      real(dp), allocatable, private :: weight(:, :), force(:, :), nz(:, :)
   contains
      procedure :: solve
      procedure :: destroy
   end type friction_solver_type

contains

   !> Make the solver for an operator of `new_tangential_operator`.
   subroutine new_friction_solver(self, grid, poisson, operator, error)
      type(friction_solver_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      type(convolution_type), intent(in) :: operator
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: xx(:, :), yy(:, :), xy(:, :)
      type(grid_type) :: periodic
      real(dp) :: determinant, swap
      integer :: i, j

      self%periodic = grid%boundary == boundary_periodic
      self%length = max(grid%lx, grid%ly)
      periodic = grid
      periodic%boundary = boundary_periodic
      allocate (xx(0:grid%nx/2, 0:grid%ny/2))
      allocate (yy, xy, mold=xx)
      call tangential_symbol(periodic, poisson, self%length/pi, grid%nx, grid%ny, xx, yy, xy)
      do j = 0, grid%ny/2
         do i = 0, grid%nx/2
            determinant = xx(i, j)*yy(i, j) - xy(i, j)**2
            swap = xx(i, j)
            xx(i, j) = yy(i, j)/determinant
            yy(i, j) = swap/determinant
            xy(i, j) = -xy(i, j)/determinant
         end do
      end do
      call new_tensor_symbol_operator(self%preconditioner, grid%nx, grid%ny, xx, yy, xy, error)
      if (allocated(error)) return
      self%compliance = self_compliance(operator, self%periodic)
      if (self%compliance <= 0.0_dp) self%compliance = self%length     ! one cell has no modes
      allocate (self%zx(grid%nx, grid%ny))
      allocate (self%zy, self%dx, self%dy, self%old_x, self%old_y, self%vx, self%vy, self%weight, &
         self%force, self%nz, mold=self%zx)
      self%zx = 0.0_dp
      self%zy = 0.0_dp
      self%dx = 0.0_dp
      self%dy = 0.0_dp
      self%old_x = 0.0_dp
      self%old_y = 0.0_dp
      self%vx = 0.0_dp
      self%vy = 0.0_dp
      self%weight = 0.0_dp
      self%force = 0.0_dp
      self%nz = 1.0_dp
   end subroutine new_friction_solver

   !> a_0, the mean of the symbols over the whole spectrum; without the mean mode where periodic.
   pure function self_compliance(operator, periodic) result(compliance)
      type(convolution_type), intent(in) :: operator
      logical, intent(in) :: periodic
      real(dp) :: compliance
      real(dp) :: weight
      integer :: i, j

      compliance = 0.0_dp
      do j = 0, operator%my/2
         do i = 0, operator%mx/2
            if (periodic .and. i == 0 .and. j == 0) cycle
            weight = merge(1.0_dp, 2.0_dp, i == 0 .or. 2*i == operator%mx) &
               *merge(1.0_dp, 2.0_dp, j == 0 .or. 2*j == operator%my)
            compliance = compliance &
               + 0.5_dp*weight*(operator%symbol(i, j, 1) + operator%symbol(i, j, 2))
         end do
      end do
   end function self_compliance

   !> Set the mean mode of a periodic tangential operator: u = compliance t for a uniform traction.
   subroutine set_mean_compliance(operator, compliance)
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: compliance           !! m for G = 1 Pa; h for a block at rest

      operator%symbol(0, 0, 1:2) = compliance/(real(operator%mx, dp)*operator%my)
   end subroutine set_mean_compliance

   !> Solve for T, starting from the T given.
   subroutine solve(self, operator, law, p, slope_x, slope_y, drive_x, drive_y, contact, tx, ty, &
      slip_x, slip_y, result, past_x, past_y)
      class(friction_solver_type), intent(inout), target :: self
      type(convolution_type), intent(inout) :: operator
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in), contiguous, target :: p(:, :)            !! [nx, ny] pressure, Pa
      real(dp), intent(in), contiguous, target :: slope_x(:, :)      !! [nx, ny] H_x; any size without slope
      real(dp), intent(in), contiguous, target :: slope_y(:, :)      !! [nx, ny] H_y
      real(dp), intent(in), contiguous, target :: drive_x(:, :)      !! [nx, ny] DX', m
      real(dp), intent(in), contiguous, target :: drive_y(:, :)      !! [nx, ny]
      !> [nx, ny] In: 0 open, 1 in contact, 2 in contact and likely to slip, as it did in the step
      !> before: its traction starts on the bound. Without adhesion a point with p <= 0 is taken as
      !> open. Out: 0 open, 1 stick, 2 slip.
      integer(int8), intent(inout), contiguous, target :: contact(:, :)
      real(dp), intent(inout), contiguous, target :: tx(:, :)        !! [nx, ny] T_x, Pa; in: the start
      real(dp), intent(inout), contiguous, target :: ty(:, :)        !! [nx, ny] T_y, Pa
      real(dp), intent(inout), contiguous, target :: slip_x(:, :)    !! [nx, ny] out: r, everywhere, m
      real(dp), intent(inout), contiguous, target :: slip_y(:, :)    !! [nx, ny]
      type(solver_result_type), intent(out) :: result
      !> [nx, ny] T_h, a given traction, Pa: r = DX' - A (T + T_h) at no cost of a product. Both or
      !> none.
      real(dp), intent(in), contiguous, target, optional :: past_x(:, :), past_y(:, :)
      type(friction_problem_type) :: problem
      real(dp) :: start_time, cells
      logical :: moving, converged

      start_time = omp_get_wtime()
      result%ffts = -operator%ffts - self%preconditioner%ffts
      problem%law = law
      problem%nx = operator%nx
      problem%ny = operator%ny
      problem%threads = operator%threads
      problem%compliance = self%compliance
      problem%settle = self%settle
      problem%near = self%near
      problem%least_scale = self%least_scale
      problem%p => p
      problem%hx => slope_x
      problem%hy => slope_y
      problem%drive_x => drive_x
      problem%drive_y => drive_y
      problem%tx => tx
      problem%ty => ty
      problem%rx => slip_x
      problem%ry => slip_y
      problem%contact => contact
      if (present(past_x)) problem%past_x => past_x
      if (present(past_y)) problem%past_y => past_y
      problem%vx => self%vx
      problem%vy => self%vy
      problem%weight => self%weight
      problem%force => self%force
      problem%nz => self%nz
      problem%old_x => self%old_x
      problem%old_y => self%old_y
      cells = real(operator%nx, dp)*operator%ny
      if (self%periodic .and. operator%symbol(0, 0, 1)*cells > thick*self%length) then
         problem%mean_compliance = operator%symbol(0, 0, 1)
      end if
      call self%pull%hang(problem, operator, thick*self%length)
      call set_mean_stiffness(self, operator)

      call problem%start(operator, moving)
      if (moving) then
         call problem%update_slip(operator)
      else
         call problem%start_from_rest()
      end if
      do
         if (problem%residual > self%tolerance) call iterate(self, problem, operator, result%iterations)
         converged = problem%solved(self%tolerance)
         if (converged .and. any(self%pull%along)) then
            call meet_pull(self, problem, operator, result%iterations, converged)
         end if
         if (problem%fresh .or. .not. converged) exit
         call problem%transform_tractions(operator)       ! the residual of a recurrence proves nothing
         call problem%update_slip(operator)
         if (problem%residual <= self%tolerance) exit
      end do

      result%load_error = self%pull%missed(problem)
      call self%pull%take_off(problem, operator)
      result%residual = problem%residual
      result%converged = converged
      result%ffts = result%ffts + operator%ffts + self%preconditioner%ffts
      if (problem%cells == 0) then
         result%reason = 'no contact'
      else if (converged) then
         result%reason = 'converged'
      else if (self%pull%slides_off) then
         result%reason = 'the pull is more than the friction'
      else if (.not. ieee_is_finite(problem%residual)) then
         result%reason = 'not a number'
      else if (result%iterations >= self%max_iterations) then
         result%reason = 'iteration limit'
      else
         result%reason = 'no direction of descent'
      end if
      result%seconds = omp_get_wtime() - start_time
   end subroutine solve

   !> Move the ends of the springs until the total of T is the pull. Near full slip the total follows ever
   !> less: each way is lengthened by what the last one has brought.
   subroutine meet_pull(self, problem, operator, iterations, converged)
      type(friction_solver_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      integer, intent(inout) :: iterations
      logical, intent(out) :: converged
      real(dp) :: before(2), allowed, factor, first(2), gained, way(2)
      integer :: k, idle

      self%pull%slides_off = problem%cells == 0 .and. self%pull%missed(problem) > 0.0_dp
      converged = .not. self%pull%slides_off
      if (problem%cells == 0) return
      first = problem%spring_end
      factor = 1.0_dp
      idle = 0
      do k = 1, hangings
         converged = problem%solved(self%tolerance)
         if (.not. converged) return
         if (self%pull%missed(problem) <= self%tolerance) return
         converged = .false.
         before = self%pull%lacking(problem)
         way = factor*problem%spring*before
         call problem%hang_anew(way)
         ! The contact has to follow a way that is within its tolerance, too.
         allowed = self%tolerance
         self%tolerance = max(1.0e-3_dp*allowed, min(allowed, 0.1_dp*norm2(way)/problem%scale))
         if (problem%residual > self%tolerance) call iterate(self, problem, operator, iterations)
         self%tolerance = allowed
         if (.not. problem%fresh) then
            call problem%transform_tractions(operator)
            call problem%update_slip(operator)
         end if
         gained = dot_product(before, before - self%pull%lacking(problem)) &
            /max(dot_product(before, before), tiny(1.0_dp))
         idle = merge(idle + 1, 0, problem%slipping == problem%cells .and. gained < 0.01_dp)
         self%pull%slides_off = idle >= idle_hangings
         if (self%pull%slides_off) then
            call problem%hang_anew(first - problem%offset)
            return
         end if
         factor = max(1.0_dp, min(10.0_dp*factor, factor/max(gained, 0.01_dp)))
      end do
   end subroutine meet_pull

   !> Run the method that was asked for, and its fallback.
   subroutine iterate(self, problem, operator, iterations)
      type(friction_solver_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      integer, intent(inout) :: iterations
      real(dp), allocatable :: spare_x(:, :), spare_y(:, :)
      integer :: limit

      limit = self%max_iterations
      select case (self%method)
      case (friction_thesis)
         allocate (spare_x, spare_y, source=self%zx)
         call iterate_thesis(problem, operator, self%tolerance, limit, self%zx, self%zy, &
            self%dx, self%dy, spare_x, spare_y, iterations)
      case (friction_gradient)
         call iterate_gradient(problem, operator, self%tolerance, 0.0_dp, limit, self%zx, self%zy, &
            self%dx, self%dy, iterations)
      case default
         do while (iterations < limit)
            call iterate_fast(problem, operator, self%preconditioner, self%tolerance, limit, &
               self%zx, self%zy, self%dx, self%dy, iterations)
            if (problem%solved(self%tolerance)) return
            if (.not. ieee_is_finite(problem%residual)) return
            call iterate_gradient(problem, operator, self%tolerance, 0.1_dp, &
               min(limit, iterations + gradient_steps), self%zx, self%zy, self%dx, self%dy, iterations)
            if (problem%solved(self%tolerance)) return
         end do
      end select
   end subroutine iterate

   !> Let the preconditioner's mean mode be the inverse of the operator's.
   subroutine set_mean_stiffness(self, operator)
      class(friction_solver_type), intent(inout) :: self
      type(convolution_type), intent(in) :: operator
      real(dp) :: cells, mean

      if (.not. self%periodic) return
      cells = real(operator%nx, dp)*operator%ny
      mean = operator%symbol(0, 0, 1)*cells
      if (mean <= 0.0_dp) mean = self%length/pi
      self%preconditioner%symbol(0, 0, 1:2) = 1.0_dp/(mean*cells)
   end subroutine set_mean_stiffness

   !> Free the preconditioner and the work space.
   subroutine destroy(self)
      class(friction_solver_type), intent(inout) :: self

      call self%preconditioner%destroy()
      if (allocated(self%zx)) then
         deallocate (self%zx, self%zy, self%dx, self%dy, self%old_x, self%old_y, self%vx, self%vy, &
            self%weight, self%force, self%nz)
      end if
   end subroutine destroy

end module friction_cg
