!> Tests of the solver that solves a step with friction all at once: GMRES, the states of a cell, and the approximate
!> inverse. Runs with such steps are in python/tests/test_hard_steps.py and test_constant_shear.py.
module test_joint_step
   use adhesion_potential, only : new_adhesion_potential
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use friction_law, only : new_friction_law
   use gmres, only : cell_vector_type, gmres_type
   use joint_cells, only : cell_rules_type
   use joint_system, only : joint_state_type, joint_system_type
   use regular_grid, only : boundary_free, new_grid
   implicit none
   private

   public :: run_joint_step

   !> A system of few cells, whose displacements are sums over all cells.
   type, extends(joint_system_type) :: toy_system_type
      real(dp), allocatable :: u(:, :, :), slip(:, :, :)
   contains
      procedure :: evaluate
      procedure :: slopes_at
      procedure :: slip_of
   end type toy_system_type

contains

   subroutine run_joint_step()
      call begin_suite('joint_step')
      if (selected('gmres_solves_a_system')) call gmres_solves_a_system()
      if (selected('states_join_without_a_jump')) call states_join_without_a_jump()
      if (selected('inverse_of_one_tile_is_exact')) call inverse_of_one_tile_is_exact()
      if (selected('inverse_is_kept_while_cells_hardly_change')) call inverse_is_kept_while_cells_hardly_change()
   end subroutine run_joint_step

   !> A matrix without symmetry with two additional unknowns, against its known solution.
   subroutine gmres_solves_a_system()
      integer, parameter :: cells = 7, n = 3*cells + 2
      type(gmres_type) :: krylov
      type(cell_vector_type) :: v
      real(dp) :: a(n, n), x(n), b(n)
      integer :: i, j

      do j = 1, n
         do i = 1, n
            a(i, j) = 0.3_dp*sin(1.7_dp*i*j) + merge(4.0_dp + 0.5_dp*i, 0.0_dp, i == j)
         end do
         x(j) = cos(0.9_dp*j)
      end do
      b = matmul(a, x)
      v%cells = reshape(b(:n - 2), [3, cells])
      v%beside = b(n - 1:)
      call krylov%begin(v, [1, 4, 4, cells + 1], n, 1.0e-6_dp)
      do while (krylov%unsolved())
         call krylov%next(v)
         b = matmul(a, [reshape(v%cells, [n - 2]), v%beside])
         v%cells = reshape(b(:n - 2), [3, cells])
         v%beside = b(n - 1:)
         call krylov%take(v)
      end do
      call check_order(krylov%left, '<=', 1.0e-6_dp, 'residual')
      call krylov%solution(v)
      call check_close(maxval(abs([reshape(v%cells, [n - 2]), v%beside] - x)), 0.0_dp, 3.0e-6_dp, 'solution')
   end subroutine gmres_solves_a_system

   !> Gap, pressure and share are continuous from open to pressed cells. A partly sheared cell slips at its
   !> share of the strength.
   subroutine states_join_without_a_jump()
      real(dp), parameter :: width = 2.0e-6_dp, little = 1.0e-16_dp
      type(cell_rules_type) :: rules
      type(error_type), allocatable :: error
      real(dp) :: left(2), ends(2)

      call new_adhesion_potential(rules%potential, 'exponential', 0.1_dp, 1.0e-6_dp, error)
      rules%law = new_friction_law('constant_shear', 0.0_dp, 3.0e5_dp, 0.0_dp, .false., .true.)
      rules%soft = 1.0e-12_dp
      rules%soft_along = 1.0e-12_dp
      rules%attraction = 1.0e5_dp
      ends = rules%pressure_of(width, [-little, little])
      call check_close(ends(1), ends(2), 1.0e-2_dp, 'pressure where the gap closes')
      ends = rules%pressure_of(width, width + [-little, little])
      call check_close(ends(1), ends(2), 1.0e-2_dp, 'pressure where contact begins')
      call check_close(rules%pressure_of(width, width + 1.0e-6_dp), 1.0e6_dp - 1.0e5_dp, 1.0e-6_dp, 'pressed')
      call check_close(rules%number_of(width, .true., 9.0e5_dp, 0.0_dp), width + 1.0e-6_dp, 1.0e-18_dp, 'back')
      ends = rules%share_of(width, [0.25_dp*width, 2.0_dp*width])
      call check_close(maxval(abs(ends - [0.25_dp, 1.0_dp])), 0.0_dp, 1.0e-12_dp, 'shares')
      left = rules%traction_error(0.25_dp, 0.0_dp, [0.0_dp, 0.0_dp], [1.0e-6_dp, 0.0_dp], [0.75e5_dp, 0.0_dp])
      call check_close(norm2(left), 0.0_dp, 1.0e-6_dp, 'slips at its share of the strength')
      call check_that(rules%slips(0.25_dp, 0.0_dp, [0.0_dp, 0.0_dp], [0.75e5_dp, 0.0_dp]), 'it counts as slip')
      call check_that(.not. rules%slips(0.5_dp, 0.0_dp, [0.0_dp, 0.0_dp], [0.75e5_dp, 0.0_dp]), 'it counts as stick')
   end subroutine states_join_without_a_jump

   !> The approximate inverse of a system whose cells all belong to one tile is exact: with a curved road, a stick and a
   !> slip region, open cells, under a given load or at a given level.
   subroutine inverse_of_one_tile_is_exact()
      integer, parameter :: n = 4
      type(toy_system_type) :: system
      type(joint_state_type) :: state, other
      type(cell_vector_type) :: v, w
      integer :: cell(n*n), first(n + 1), i, j, k, status
      logical :: done
      real(dp), parameter :: change = 1.0e-7_dp

      call new_toy_system(system, n)
      call state%make_room(system%grid, status)
      call other%make_room(system%grid, status)
      first(1) = 1
      k = 0
      do j = 1, n
         do i = 1, n
            state%s(i, j) = 0.5_dp + 0.4_dp*sin(1.3_dp*i + 2.1_dp*j)
            ! Without traction a cell sticks, with a large one it slips.
            state%t(i, :, j) = merge(0.0_dp, 1.0_dp, i < 3)*[0.3_dp, 0.1_dp*j]
            if (i == 2 .and. j == 3) state%s(i, j) = -0.2_dp
            if (state%s(i, j) < 0.0_dp) cycle
            k = k + 1
            cell(k) = i
         end do
         first(j + 1) = k + 1
      end do
      allocate (v%cells(3, k), w%cells(3, k))
      do i = 1, 2
         system%level_is_given = i == 2
         call system%evaluate(state)
         call system%linearise(state, first, cell(:k), done)
         call check_that(done, 'memory')
         do j = 1, k
            v%cells(:, j) = [cos(1.0_dp*j), sin(2.0_dp*j), cos(3.0_dp*j)]
         end do
         v%beside(1) = 0.7_dp
         w = v
         call system%improve(w, 0)

         ! The derivative along the result, from the equations themselves.
         call other%copy(state)
         other%level = state%level + change*w%beside(1)/system%root
         do j = 1, n
            do k = first(j), first(j + 1) - 1
               other%s(cell(k), j) = other%s(cell(k), j) + change*w%cells(1, k)
               other%t(cell(k), :, j) = other%t(cell(k), :, j) + change*w%cells(2:3, k)
            end do
         end do
         call system%evaluate(other)
         do j = 1, n
            do k = first(j), first(j + 1) - 1
               w%cells(:, k) = (other%residual(cell(k), :, j) - state%residual(cell(k), :, j))/change
            end do
         end do
         k = first(n + 1) - 1
         call check_close(maxval(abs(w%cells - v%cells)), 0.0_dp, 1.0e-4_dp, 'cells')
         call check_close((other%load_residual - state%load_residual)/change, v%beside(1), 1.0e-4_dp, 'load or level')
      end do
   end subroutine inverse_of_one_tile_is_exact

   !> The inverse of a tile is that of an earlier state while its cells hardly change, and that of the present state where
   !> a cell begins to slip, or after the first state of another solve was made.
   subroutine inverse_is_kept_while_cells_hardly_change()
      integer, parameter :: n = 2
      type(toy_system_type) :: system
      type(joint_state_type) :: state, other
      real(dp) :: again(3, n*n), fresh(3, n*n), hardly(3, n*n), start(3, n*n)
      integer :: status

      call new_toy_system(system, n)
      system%level_is_given = .true.
      call state%make_room(system%grid, status)
      call other%make_room(system%grid, status)
      state%s = 0.5_dp
      call improved(state, start)
      state%s(1, 1) = 0.501_dp
      state%t(1, 1, 1) = 1.0e-3_dp
      call improved(state, hardly)
      call check_close(maxval(abs(hardly - start)), 0.0_dp, 0.0_dp, 'a cell that hardly changes')
      call forget(hardly)
      call check_order(maxval(abs(hardly - start)), '>', 0.0_dp, 'the same in another solve')

      state%t(1, 1, 1) = 1.0_dp
      call improved(state, again)
      call check_order(maxval(abs(again - hardly)), '>', 0.1_dp, 'a cell that begins to slip')
      call forget(fresh)
      call check_close(maxval(abs(again - fresh)), 0.0_dp, 0.0_dp, 'the inverse of the present state')

   contains

      !> Apply the approximate inverse of a state to a residual.
      subroutine improved(at, cells)
         type(joint_state_type), intent(inout) :: at
         real(dp), intent(out) :: cells(:, :)
         type(cell_vector_type) :: v
         logical :: done

         call system%evaluate(at)
         call system%linearise(at, [1, 3, 5], [1, 2, 1, 2], done)
         call check_that(done, 'memory')
         v%cells = reshape([1.0_dp, 0.3_dp, 0.2_dp, 0.5_dp, 0.7_dp, 0.1_dp, 0.4_dp, 0.9_dp, 0.6_dp, 0.8_dp, 0.2_dp, &
            0.3_dp], [3, n*n])
         call system%improve(v, 0)
         cells = v%cells
      end subroutine improved

      !> Begin another solve, whose units are those of this one, and apply the inverse of the same state.
      subroutine forget(cells)
         real(dp), intent(out) :: cells(:, :)
         type(toy_system_type) :: new

         call new_toy_system(new, n)
         call system%begin(state%s > 0.0_dp, state%s, 0.0_dp*state%s, state%t, &
            system%rules%has_jump(0.0_dp*state%s, 0.0_dp*state%s), 0.1_dp, other)
         system%root = new%root
         system%unit_length = new%unit_length
         system%unit_traction = new%unit_traction
         system%unit_pressure = new%unit_pressure
         system%rules%width = new%rules%width
         system%width = 0.0_dp
         call improved(state, cells)
      end subroutine forget

   end subroutine inverse_is_kept_while_cells_hardly_change

   !> A system on n x n cells whose displacements fall off with the distance.
   subroutine new_toy_system(system, n)
      type(toy_system_type), intent(out) :: system
      integer, intent(in) :: n
      integer :: c, i, j
      real(dp) :: far

      system%grid = new_grid(n, n, 1.0_dp, 1.0_dp, boundary_free)
      system%rules%law = new_friction_law('coulomb', 0.4_dp, 0.0_dp, 0.0_dp, .true., .true.)
      system%rules%soft = 1.0_dp
      system%rules%soft_along = 1.0_dp
      system%root = 3.0_dp
      allocate (system%width(n, n), source=0.0_dp)
      allocate (system%u(n, 2, n), system%slip(n, 2, n), source=0.0_dp)
      do j = -n + 1, n - 1
         do i = -n + 1, n - 1
            far = hypot(real(i, dp), real(j, dp))
            system%near%depth(i, j) = 1.0_dp/(1.0_dp + far)
            do c = 1, 2
               system%near%place(c, c, i, j) = 0.8_dp/(1.0_dp + far)
               system%near%place(3 - c, c, i, j) = 0.1_dp*i*j/(1.0_dp + far)**3
            end do
         end do
      end do
      system%near%slip = -system%near%place
   end subroutine new_toy_system

   !> Compute the displacements directly, and the residuals.
   subroutine evaluate(self, state)
      class(toy_system_type), intent(inout) :: self
      type(joint_state_type), intent(inout) :: state
      real(dp) :: p(self%grid%nx, self%grid%ny), depth(self%grid%nx, self%grid%ny), place(2)
      real(dp), dimension(self%grid%nx, self%grid%ny) :: height, slope_x, slope_y
      integer :: a, b, i, j

      p = self%rules%pressure_of(self%width, state%s)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            depth(i, j) = 0.0_dp
            place = 0.0_dp
            do b = 1, self%grid%ny
               do a = 1, self%grid%nx
                  depth(i, j) = depth(i, j) + self%near%depth(i - a, j - b)*p(a, b)
                  place = place + matmul(self%near%place(:, :, i - a, j - b), state%t(a, :, b))
               end do
            end do
            self%u(i, :, j) = place
            self%slip(i, :, j) = [0.9_dp, 0.2_dp]*merge(0.0_dp, 1.0_dp, i < 3) - place
         end do
      end do
      call self%slopes_at([0.0_dp, 0.0_dp], height, slope_x, slope_y)
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            call self%cell_residual(state, i, j, depth(i, j) - height(i, j), p(i, j), [slope_x(i, j), slope_y(i, j)], &
               self%slip_of(i, j))
         end do
      end do
      if (self%level_is_given) then
         call self%sum_residuals(state, p, 0.0_dp, level=0.1_dp)
      else
         call self%sum_residuals(state, p, 0.3_dp)
      end if
   end subroutine evaluate

   !> The road: two waves.
   subroutine slopes_at(self, shift, height, slope_x, slope_y)
      class(toy_system_type), intent(inout) :: self
      real(dp), intent(in) :: shift(2)
      real(dp), intent(out) :: height(:, :), slope_x(:, :), slope_y(:, :)
      real(dp), allocatable :: x(:, :), y(:, :)
      integer :: i

      allocate (x, y, mold=height)
      do i = 1, self%grid%nx
         x(i, :) = self%grid%dx*i + shift(1) + self%u(i, 1, :)
         y(:, i) = self%grid%dy*i + shift(2) + self%u(:, 2, i)
      end do
      height = 0.2_dp*sin(1.5_dp*x)*cos(0.7_dp*y)
      slope_x = 0.3_dp*cos(1.5_dp*x)*cos(0.7_dp*y)
      slope_y = -0.14_dp*sin(1.5_dp*x)*sin(0.7_dp*y)
   end subroutine slopes_at

   !> The slip of a cell.
   pure function slip_of(self, i, j) result(slip)
      class(toy_system_type), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: slip(2)

      slip = self%slip(i, :, j)
   end function slip_of

end module test_joint_step
