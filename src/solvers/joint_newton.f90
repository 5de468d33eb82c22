!> Newton's method for all unknowns of a contact with friction: the pressures, gaps, tractions and the level
!> (module `joint_system`).
!>
!> Newton's steps are computed by GMRES, whose products with the derivative of the equations are finite differences. An
!> approximate inverse (module `joint_system`) is applied before each product, so that GMRES measures the true residual.
!> The steps are shortened if they do not reduce the residual. The gaps of open cells are not unknowns, but follow from the
!> other unknowns (with adhesion only those of cells that are hardly attracted). If the method fails and a traction may
!> jump, the equations are regularised: the pressure rises slightly with s in partly sheared cells, which removes the
!> jump. This rise is then reduced to zero (`reduce_rise`).
!>
!> Memory: 25 fields of doubles, the directions of GMRES with 3 numbers in single precision per unknown cell
!> and direction, and the approximate inverse. If there is not enough memory, nothing is solved.
module joint_newton
   use adhesion_potential, only : adhesive_curvature
   use asperity_parallel, only : any_process, rows_before
   use asperity_precision, only : dp
   use field_sums, only : field_count, largest_of_rows
   use gmres, only : cell_vector_type, gmres_type
   use joint_system, only : joint_state_type, joint_system_type
   use regular_grid, only : grid_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: joint_newton_type

   integer, parameter :: most_steps = 25
   integer, parameter :: most_directions = 120         !! directions of GMRES for a step
   real(dp), parameter :: accuracy = 1.0e-3_dp         !! of a solve by GMRES
   real(dp), parameter :: far = 0.1_dp                 !! residual from which `far_accuracy` is sufficient
   real(dp), parameter :: difference = 1.0e-7_dp       !! largest change of an unknown in a product, scaled
   !> If |e''| over the stiffness of a cell is larger, the gap of an open cell is an unknown.
   real(dp), parameter :: attracted = 1.0e-4_dp
   real(dp), parameter :: diverged = 100.0_dp          !! a residual this much larger than the first ends the attempt
   real(dp), parameter :: idle = 1.0e-4_dp             !! part by which a step must reduce the residual
   !> Residual that may remain, over the tolerance, and its least value.
   real(dp), parameter :: part_of_tolerance = 1.0e-3_dp, round_off = 1.0e-11_dp
   real(dp), parameter :: lengths(10) = [1.0_dp, 0.7_dp, 0.5_dp, 0.3_dp, 0.15_dp, 0.07_dp, 0.03_dp, 0.01_dp, &
      0.003_dp, 0.001_dp]                              !! of a step, tried in this order
   ! The rise of the pressure in partly sheared cells:
   integer, parameter :: most_rises = 30               !! largest number of solves with a rise
   real(dp), parameter :: first_factor = 0.1_dp        !! from one solve to the next
   real(dp), parameter :: last_factor = 0.95_dp        !! the solutions end if even this factor fails
   real(dp), parameter :: least_rise = 1.0e-5_dp, most_rise = 1.0e2_dp

   !> The method and its work space. A variable of this type must not be copied.
   type :: joint_newton_type
      logical :: ready = .false.
      real(dp) :: far_accuracy = accuracy              !! of a solve by GMRES far from the solution
      !> Number of steps in which the residual must be halved; otherwise the solve ends without trying a rise. 0: the
      !> residual may fall slowly.
      integer :: steps_to_halve = 0
      type(joint_state_type) :: now                    !! in: the start; out: the solution
      integer, allocatable, private :: first(:)        !! [rows + 1] of the list of unknown cells
      integer, allocatable, private :: cell(:)         !! its cells, i
      type(joint_state_type), private :: trial, best   !! after a part of a step, and the best of these
      type(joint_state_type), private :: begun         !! from which the present solve began
      real(dp), allocatable, private :: follow(:, :)   !! change of s of the cells that are not unknown, m [nx, rows]
   contains
      procedure :: prepare
      procedure :: solve
      procedure :: destroy
   end type joint_newton_type

contains

   !> Allocate the states. If there is not enough memory, `ready` remains .false.
   subroutine prepare(self, grid)
      class(joint_newton_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer :: status(7), n

      call self%now%make_room(grid, status(1))
      call self%trial%make_room(grid, status(2))
      call self%best%make_room(grid, status(3))
      call self%begun%make_room(grid, status(4))
      n = grid%rows()
      allocate (self%follow(grid%nx, n), source=0.0_dp, stat=status(5))
      allocate (self%first(n + 1), source=1, stat=status(6))
      allocate (self%cell(grid%nx*n), source=0, stat=status(7))
      self%ready = .not. any_process(any(status /= 0))
      if (.not. self%ready) call self%destroy()
   end subroutine prepare

   !> Solve a system from the state `now`.
   subroutine solve(self, system, tolerance, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: tolerance                !! of the solution; the equations are solved far better
      logical, intent(out) :: solved
      real(dp) :: goal

      goal = max(part_of_tolerance*tolerance, round_off)
      call self%begun%copy(self%now)
      call iterate(self, system, goal, solved)
      if (.not. solved .and. self%steps_to_halve == 0 .and. field_count(system%width > 0.0_dp) > 0) &
         call reduce_rise(self, system, goal, solved)
   end subroutine solve

   !> Must the attempt end, because of a stop or because it takes too long?
   function is_to_end(system) result(yes)
      class(joint_system_type), intent(in) :: system
      logical :: yes

      yes = stop_is_due() .or. system%evaluations >= system%most_evaluations
   end function is_to_end

   !> Do Newton's steps from the present state.
   subroutine iterate(self, system, goal, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: goal                     !! largest residual that may remain
      logical, intent(out) :: solved
      type(cell_vector_type) :: step
      real(dp) :: first, marked                        !! residuals at the start, and some steps ago
      integer :: k
      logical :: found

      call system%evaluate(self%now)
      first = self%now%merit
      marked = first
      do k = 1, most_steps
         if (.not. self%now%worst > goal .or. self%now%merit > diverged*first) exit
         if (is_to_end(system)) exit
         if (is_too_slow(self, k, marked)) exit
         call find_step(self, system, step, found)
         if (.not. found) exit
         call take_step(self, system, step, k)
      end do
      solved = self%now%worst <= goal
   end subroutine iterate

   !> Has the residual not been halved in the number of steps that are allowed for it?
   function is_too_slow(self, k, marked) result(yes)
      class(joint_newton_type), intent(in) :: self
      integer, intent(in) :: k                         !! the step that follows
      real(dp), intent(inout) :: marked                !! residual when it was last checked
      logical :: yes

      yes = .false.
      if (self%steps_to_halve == 0) return
      if (modulo(k - 1, self%steps_to_halve) /= 0) return
      yes = k > 1 .and. self%now%merit > 0.5_dp*marked
      marked = self%now%merit
   end function is_too_slow

   !> Solve with a pressure that rises within the second range of s, and reduce this rise to zero step by step. Each
   !> solve starts from the solution before. If the first solve fails, the rise is made larger.
   subroutine reduce_rise(self, system, goal, solved)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      real(dp), intent(in) :: goal
      logical, intent(out) :: solved
      real(dp) :: factor, last
      integer :: k
      logical :: met                                   !! the equations with the present rise are solved

      solved = .false.
      last = 0.0_dp
      factor = first_factor
      call set_rise(system, self%begun, 1.0_dp)
      do k = 1, most_rises
         if (is_to_end(system)) exit
         call self%now%copy(self%begun)
         call iterate(self, system, goal, met)
         solved = met .and. .not. system%rules%rise > 0.0_dp
         if (solved) exit
         if (met) then
            call self%begun%copy(self%now)
            last = system%rules%rise
            factor = max(factor**1.5_dp, first_factor)
            call set_rise(system, self%begun, merge(last*factor, 0.0_dp, last > least_rise))
         else if (.not. last > 0.0_dp) then
            call set_rise(system, self%begun, 10.0_dp*system%rules%rise)
         else
            factor = sqrt(factor)
            call set_rise(system, self%begun, last*factor)
         end if
         if (system%rules%rise > most_rise .or. factor > last_factor) exit
      end do
      system%rules%rise = 0.0_dp
   end subroutine reduce_rise

   !> Change the rise, and adjust s in cells with pressure so that their pressure does not change.
   subroutine set_rise(system, state, rise)
      class(joint_system_type), intent(inout) :: system
      type(joint_state_type), intent(inout) :: state
      real(dp), intent(in) :: rise
      real(dp) :: pressed, width
      integer :: i, j

      do j = 1, size(state%s, 2)
         do i = 1, size(state%s, 1)
            width = system%width(i, j)
            if (state%s(i, j) < width .or. .not. width > 0.0_dp) cycle
            pressed = state%s(i, j) - width + system%rules%rise*width
            if (pressed >= rise*width) then
               state%s(i, j) = pressed - rise*width + width
            else
               state%s(i, j) = pressed/rise
            end if
         end do
      end do
      system%rules%rise = rise
   end subroutine set_rise

   !> Compute Newton's step, scaled. None is found if there is not enough memory.
   subroutine find_step(self, system, step, found)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(inout) :: step
      logical, intent(out) :: found
      type(gmres_type) :: krylov
      type(cell_vector_type) :: v
      integer :: before, cells, status(2)

      call list_cells(self, system)
      cells = self%first(size(self%first)) - 1
      before = 0
      if (system%grid%shared) before = rows_before(cells)
      if (allocated(step%cells)) deallocate (step%cells)
      allocate (step%cells(3, cells), stat=status(1))
      allocate (v%cells(3, cells), stat=status(2))
      found = .not. any_process(any(status /= 0))
      if (.not. found) return
      call self%trial%copy(self%now)
      call system%evaluate(self%trial)
      call system%linearise(self%now, self%first, self%cell, found)
      if (.not. found) return

      call gather(self, self%now%residual, v)
      v%cells = -v%cells
      v%beside = -self%now%load_residual
      call krylov%begin(v, self%first, most_directions, merge(self%far_accuracy, accuracy, self%now%worst > far))
      do while (krylov%unsolved())
         if (is_to_end(system)) exit
         call krylov%next(v)
         call system%improve(v, before)
         call change(self, system, v)
         call gather(self, self%trial%residual, v)
         v%beside = self%trial%load_residual
         call krylov%take(v)
      end do
      call krylov%solution(step)
      call system%improve(step, before)
   end subroutine find_step

   !> List the unknown cells.
   subroutine list_cells(self, system)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      logical :: unknown(size(self%now%s, 1))
      integer :: i, j

      self%first(1) = 1
      do j = 1, size(self%now%s, 2)
         unknown = self%now%s(:, j) >= 0.0_dp .or. abs(adhesive_curvature(system%rules%potential, &
            max(-self%now%s(:, j), 0.0_dp)))*system%rules%soft > attracted
         self%first(j + 1) = self%first(j) + count(unknown)
         self%cell(self%first(j):self%first(j + 1) - 1) = pack([(i, i=1, size(unknown))], unknown)
      end do
   end subroutine list_cells

   !> Compute the derivative of the equations along a vector of the unknowns, in `trial%residual` of all cells.
   subroutine change(self, system, v)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(in) :: v
      real(dp) :: length
      integer :: j

      length = difference/max(largest_of_rows([maxval(abs(v%cells))]), abs(v%beside)/system%root, tiny(1.0_dp))
      call add(self, system, v, length)
      call system%evaluate(self%trial)
      !$omp parallel do default(none) shared(self, length) private(j)
      do j = 1, size(self%now%s, 2)
         self%trial%residual(:, :, j) = (self%trial%residual(:, :, j) - self%now%residual(:, :, j))/length
      end do
      self%trial%load_residual = (self%trial%load_residual - self%now%load_residual)/length
   end subroutine change

   !> Add a multiple of a vector to the present state, and store the result in `trial`.
   subroutine add(self, system, v, length)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      type(cell_vector_type), intent(in) :: v
      real(dp), intent(in) :: length
      integer :: i, j, k

      self%trial%level = self%now%level + length*v%beside*system%unit_length/system%root
      !$omp parallel do default(none) shared(self, system, v, length) private(i, j, k)
      do j = 1, size(self%now%s, 2)
         self%trial%s(:, j) = self%now%s(:, j)
         self%trial%t(:, :, j) = self%now%t(:, :, j)
         do k = self%first(j), self%first(j + 1) - 1
            i = self%cell(k)
            self%trial%s(i, j) = self%trial%s(i, j) + length*v%cells(1, k)*system%unit_length
            self%trial%t(i, :, j) = self%trial%t(i, :, j) + length*v%cells(2:3, k)*system%unit_traction
         end do
      end do
   end subroutine add

   !> Gather the values of a field in the unknown cells.
   subroutine gather(self, field, v)
      class(joint_newton_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)           !! [nx, 3, rows]
      type(cell_vector_type), intent(inout) :: v
      integer :: j, k

      do j = 1, size(field, 3)
         do k = self%first(j), self%first(j + 1) - 1
            v%cells(:, k) = field(self%cell(k), :, j)
         end do
      end do
   end subroutine gather

   !> Take the step, or a part of it that reduces the residual.
   subroutine take_step(self, system, step, round)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(in) :: step
      integer, intent(in) :: round
      integer :: chosen, j, k

      call change(self, system, step)
      do j = 1, size(self%follow, 2)
         self%follow(:, j) = -(self%now%residual(:, 1, j) + self%trial%residual(:, 1, j))*system%unit_length
         self%follow(self%cell(self%first(j):self%first(j + 1) - 1), j) = 0.0_dp
      end do
      self%best%merit = huge(1.0_dp)
      do k = 1, size(lengths)
         call try_length(self, system, step, lengths(k))
         if (self%trial%merit < self%best%merit) call self%best%copy(self%trial)
         if (self%trial%merit < (1.0_dp - 0.2_dp*lengths(k))*self%now%merit) then
            call self%now%copy(self%trial)
            return
         end if
      end do
      if (round > 2 .and. self%best%merit >= (1.0_dp - idle)*self%now%merit) then
         ! No length reduces the residual. Take a short step nevertheless, to leave this point.
         chosen = 1 + modulo(7*round, 4)
         call try_length(self, system, step, lengths(chosen))
         call self%best%copy(self%trial)
      end if
      call self%now%copy(self%best)
   end subroutine take_step

   !> Compute the state after a part of a step, as `trial`.
   subroutine try_length(self, system, step, length)
      class(joint_newton_type), intent(inout) :: self
      class(joint_system_type), intent(inout) :: system
      type(cell_vector_type), intent(in) :: step
      real(dp), intent(in) :: length
      integer :: c, j

      call add(self, system, step, length)
      do j = 1, size(self%follow, 2)
         self%trial%s(:, j) = self%trial%s(:, j) + length*self%follow(:, j)
         do c = 1, 2
            where (self%trial%s(:, j) < 0.0_dp) self%trial%t(:, c, j) = 0.0_dp
         end do
      end do
      call system%evaluate(self%trial)
   end subroutine try_length

   !> Free the fields.
   subroutine destroy(self)
      class(joint_newton_type), intent(inout) :: self
      type(joint_state_type) :: none

      self%now = none
      self%trial = none
      self%best = none
      self%begun = none
      if (allocated(self%follow)) deallocate (self%follow)
      if (allocated(self%first)) deallocate (self%first)
      if (allocated(self%cell)) deallocate (self%cell)
      self%ready = .false.
   end subroutine destroy

end module joint_newton
