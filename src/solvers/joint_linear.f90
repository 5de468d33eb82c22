!> The linear system of a Newton step for the joint equations (module `joint_system`), solved by GMRES.
!>
!> The products with the derivative of the equations are finite differences. An approximate inverse (module
!> `joint_system`) is applied before each product, so that GMRES measures the true residual. The gaps of open cells are not
!> unknowns, but follow from the other unknowns (with adhesion only those of cells that are hardly attracted). On a path
!> of solutions the part of the tangential displacement that counts is an unknown, too (module `joint_plane`).
module joint_linear
   use adhesion_potential, only : adhesive_curvature
   use asperity_parallel, only : any_process, rows_before
   use asperity_precision, only : dp
   use field_sums, only : largest_of_rows
   use gmres, only : cell_vector_type, gmres_type
   use joint_plane, only : joint_plane_type
   use joint_system, only : joint_state_type, joint_system_type
   use regular_grid, only : grid_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: is_to_end, joint_linear_type

   integer, parameter :: most_directions = 120         !! directions of GMRES for a step
   real(dp), parameter :: accuracy = 1.0e-3_dp         !! of a solve by GMRES
   real(dp), parameter :: far = 0.1_dp                 !! residual from which `far_accuracy` is sufficient
   real(dp), parameter :: difference = 1.0e-7_dp       !! largest change of an unknown in a product, scaled
   !> If |e''| over the stiffness of a cell is larger, the gap of an open cell is an unknown.
   real(dp), parameter :: attracted = 1.0e-4_dp

   !> The linear system at a state. A variable of this type must not be copied.
   type :: joint_linear_type
      real(dp) :: far_accuracy = accuracy              !! of a solve by GMRES far from the solution
      type(joint_plane_type) :: plane                  !! across a path of solutions
      type(joint_state_type) :: trial                  !! near the state: its residuals, or their change
      real(dp), allocatable :: follow(:, :)            !! change of s of the cells that are not unknown, m [nx, rows]
      integer, allocatable, private :: first(:)        !! [rows + 1] of the list of unknown cells
      integer, allocatable, private :: cell(:)         !! its cells, i
      integer, private :: before = 0                   !! listed cells of the processes before this one
   contains
      procedure :: make_fields
      procedure :: evaluate
      procedure :: newton_step
      procedure :: tangent
      procedure :: change
      procedure :: add
      procedure :: find_follow
      procedure :: destroy
      procedure, private :: begin
      procedure, private :: solve
      procedure, private :: find_push
      procedure, private :: improve
      procedure, private :: list_cells
      procedure, private :: gather
   end type joint_linear_type

contains

   !> Allocate the fields. `done` is .false. if there is not enough memory.
   subroutine make_fields(self, grid, done)
      class(joint_linear_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      logical, intent(out) :: done
      integer :: n, status(4)

      n = grid%rows()
      call self%trial%make_room(grid, status(1))
      allocate (self%follow(grid%nx, n), source=0.0_dp, stat=status(2))
      allocate (self%first(n + 1), source=1, stat=status(3))
      allocate (self%cell(grid%nx*n), source=0, stat=status(4))
      done = .not. any_process(any(status /= 0))
   end subroutine make_fields

   !> Must an attempt end, because of a stop or because it takes too long?
   function is_to_end(system) result(yes)
      class(joint_system_type), intent(in) :: system
      logical :: yes

      yes = stop_is_due() .or. system%evaluations >= system%most_evaluations
   end function is_to_end

   !> Compute the residuals of a state, with that of the plane across a path.
   subroutine evaluate(self, system, state)
      class(joint_linear_type), intent(in) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: state

      call system%evaluate(state)
      state%path_residual = 0.0_dp
      if (.not. self%plane%active) return
      state%path_residual = self%plane%residual(system, state)
      state%worst = max(state%worst, abs(state%path_residual))
      state%path_residual = state%path_residual*system%root
      state%merit = hypot(state%merit, state%path_residual)
   end subroutine evaluate

   !> Compute Newton's step from a state, scaled. None is found if there is not enough memory.
   subroutine newton_step(self, system, now, step, found)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now        !! its residuals have been computed
      type(cell_vector_type), intent(inout) :: step
      logical, intent(out) :: found
      type(cell_vector_type) :: v

      call self%begin(system, now, v, found)
      if (.not. found) return
      call self%gather(now%residual, v)
      v%cells = -v%cells
      v%beside = -[now%load_residual, now%path_residual]
      call self%solve(system, now, v, step)
   end subroutine newton_step

   !> Compute a tangent of a path at a solution, scaled: the one whose product with the normal of the plane is 1.
   subroutine tangent(self, system, now, step, found)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now        !! its residuals have been computed
      type(cell_vector_type), intent(inout) :: step
      logical, intent(out) :: found
      type(cell_vector_type) :: v

      call self%begin(system, now, v, found)
      if (.not. found) return
      v%cells = 0.0_dp
      v%beside = [0.0_dp, system%root]
      call self%solve(system, now, v, step)
   end subroutine tangent

   !> Make the list of unknown cells and the approximate inverse at a state.
   subroutine begin(self, system, now, v, done)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now
      type(cell_vector_type), intent(inout) :: v       !! out: with room for the unknown cells
      logical, intent(out) :: done
      integer :: cells, status

      call self%list_cells(system, now)
      cells = self%first(size(self%first)) - 1
      self%before = 0
      if (system%grid%shared) self%before = rows_before(cells)
      allocate (v%cells(3, cells), source=0.0_dp, stat=status)
      done = .not. any_process(status /= 0)
      if (.not. done) return

      call self%trial%copy(now)
      call self%evaluate(system, self%trial)
      call system%linearise(now, self%first, self%cell, done)
      if (done .and. self%plane%active) call self%find_push(system, now)
   end subroutine begin

   !> Solve for a right side.
   subroutine solve(self, system, now, v, step)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now
      type(cell_vector_type), intent(inout) :: v       !! in: the right side; out: undefined
      type(cell_vector_type), intent(inout) :: step    !! out: the solution
      type(gmres_type) :: krylov

      step = v
      call krylov%begin(v, self%first, most_directions, merge(self%far_accuracy, accuracy, now%worst > far))
      do while (krylov%unsolved())
         if (is_to_end(system)) exit
         call krylov%next(v)
         call self%improve(system, v)
         call self%change(system, now, v)
         call self%gather(self%trial%residual, v)
         v%beside = [self%trial%load_residual, self%trial%path_residual]
         call krylov%take(v)
      end do
      call krylov%solution(step)
      call self%improve(system, step)
   end subroutine solve

   !> Find the approximate change of the unknowns with the part, from a small difference.
   subroutine find_push(self, system, now)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now
      type(cell_vector_type) :: v

      allocate (v%cells(3, self%first(size(self%first)) - 1), source=0.0_dp)
      v%beside = [0.0_dp, system%root]
      call self%change(system, now, v)
      call self%gather(self%trial%residual, v)
      v%beside = [self%trial%load_residual, 0.0_dp]
      call self%plane%linearise(system, self%first, self%cell, v, self%before)
   end subroutine find_push

   !> Replace residuals by approximate changes of the unknowns.
   subroutine improve(self, system, v)
      class(joint_linear_type), intent(in) :: self
      class(joint_system_type), intent(in) :: system
      type(cell_vector_type), intent(inout) :: v

      call system%improve(v, self%before)
      if (self%plane%active) call self%plane%improve(system, self%first, v)
   end subroutine improve

   !> List the unknown cells.
   subroutine list_cells(self, system, now)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: now
      logical :: unknown(size(now%s, 1))
      integer :: i, j

      self%first(1) = 1
      do j = 1, size(now%s, 2)
         unknown = now%s(:, j) >= 0.0_dp .or. abs(adhesive_curvature(system%rules%potential, &
            max(-now%s(:, j), 0.0_dp)))*system%rules%soft > attracted
         self%first(j + 1) = self%first(j) + count(unknown)
         self%cell(self%first(j):self%first(j + 1) - 1) = pack([(i, i=1, size(unknown))], unknown)
      end do
   end subroutine list_cells

   !> Compute the derivative of the equations along a vector of the unknowns, in `trial%residual` of all cells.
   subroutine change(self, system, now, v)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(in) :: now
      type(cell_vector_type), intent(in) :: v
      real(dp) :: length
      integer :: j

      length = difference/max(largest_of_rows([maxval(abs(v%cells))]), maxval(abs(v%beside))/system%root, tiny(1.0_dp))
      call self%add(system, now, v, length)
      call self%evaluate(system, self%trial)
      !$omp parallel do default(none) shared(self, now, length) private(j)
      do j = 1, size(now%s, 2)
         self%trial%residual(:, :, j) = (self%trial%residual(:, :, j) - now%residual(:, :, j))/length
      end do
      self%trial%load_residual = (self%trial%load_residual - now%load_residual)/length
      self%trial%path_residual = (self%trial%path_residual - now%path_residual)/length
   end subroutine change

   !> Add a multiple of a vector to a state, and store the result in `trial`.
   subroutine add(self, system, now, v, length)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: now
      type(cell_vector_type), intent(in) :: v
      real(dp), intent(in) :: length
      integer :: i, j, k

      self%trial%level = now%level + length*v%beside(1)*system%unit_length/system%root
      self%trial%part = now%part + length*v%beside(2)/system%root
      !$omp parallel do default(none) shared(self, system, now, v, length) private(i, j, k)
      do j = 1, size(now%s, 2)
         self%trial%s(:, j) = now%s(:, j)
         self%trial%t(:, :, j) = now%t(:, :, j)
         do k = self%first(j), self%first(j + 1) - 1
            i = self%cell(k)
            self%trial%s(i, j) = self%trial%s(i, j) + length*v%cells(1, k)*system%unit_length
            self%trial%t(i, :, j) = self%trial%t(i, :, j) + length*v%cells(2:3, k)*system%unit_traction
         end do
      end do
   end subroutine add

   !> Find how s changes in the cells that are not unknown, from the change of the residuals in `trial`.
   subroutine find_follow(self, system, now, removed)
      class(joint_linear_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: now
      real(dp), intent(in) :: removed                  !! part of the residual of the state that is removed, too
      integer :: j

      do j = 1, size(self%follow, 2)
         self%follow(:, j) = -(removed*now%residual(:, 1, j) + self%trial%residual(:, 1, j))*system%unit_length
         self%follow(self%cell(self%first(j):self%first(j + 1) - 1), j) = 0.0_dp
      end do
   end subroutine find_follow

   !> Gather the values of a field in the unknown cells.
   subroutine gather(self, field, v)
      class(joint_linear_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)           !! [nx, 3, rows]
      type(cell_vector_type), intent(inout) :: v
      integer :: j, k

      do j = 1, size(field, 3)
         do k = self%first(j), self%first(j + 1) - 1
            v%cells(:, k) = field(self%cell(k), :, j)
         end do
      end do
   end subroutine gather

   !> Free the fields.
   subroutine destroy(self)
      class(joint_linear_type), intent(inout) :: self
      type(joint_state_type) :: none

      self%trial = none
      call self%plane%destroy()
      if (allocated(self%follow)) deallocate (self%follow)
      if (allocated(self%first)) deallocate (self%first)
      if (allocated(self%cell)) deallocate (self%cell)
   end subroutine destroy

end module joint_linear
