!> Solves a steady contact with all cells in contact as unknowns, once the splitting of `steady_normal` is near the
!> solution.
!>
!> With a guess C of the cells in contact, P follows from K P = H + level on C and the load. GMRES finds it with an
!> approximate inverse (module `steady_inverse`), in a few directions of two transforms each. Cells with P < 0 leave C,
!> and the rest is solved again; then cells that overlap join C. While C changes, an approximate solution is enough.
!>
!> Near the solution C settles in a few rounds, however many cells there are, where the splitting takes more and more
!> iterations. There is no proof of it, and from a distant guess C oscillates. The attempt therefore ends as soon as
!> it does not come closer, and the caller continues.
!>
!> Memory: six fields, those of the inverse, and the directions of GMRES in single precision, on the cells in contact.
module steady_newton
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_count, field_mean
   use gmres, only : cell_vector_type, gmres_type
   use normal_state, only : gap_measure_type, measure_gap, narrow_scale, normal_problem_type
   use steady_inverse, only : contact_inverse_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: finish_by_newton, promising

   integer, parameter :: most_rounds = 20
   integer, parameter :: most_directions = 60    !! of GMRES; a useful guess needs fewer
   integer, parameter :: patience = 3            !! an attempt ends after more rounds that do not come closer
   integer, parameter :: first_trial = 32        !! iteration of the splitting from which an attempt may save time
   real(dp), parameter :: price = 24.0_dp        !! of an attempt, in iterations of the splitting
   real(dp), parameter :: near = 1.0e-3_dp       !! error of the splitting from which C usually settles
   real(dp), parameter :: accuracy = 0.1_dp      !! of a solution while C changes
   real(dp), parameter :: finest = 1.0e-4_dp     !! of any solution

   !> A contact that is being solved.
   type :: guess_type
      real(dp), allocatable :: pressure(:, :)    !! Pa
      real(dp), allocatable :: gap(:, :)         !! U - H, m
      real(dp), allocatable :: work(:, :), moved(:, :)
      logical, allocatable :: inside(:, :)       !! C
      integer, allocatable :: first(:)           !! [rows + 1] the first cell of each row in the list of C
      real(dp) :: level = 0.0_dp                 !! of U - H in C, m
      type(contact_inverse_type) :: inverse
   end type guess_type

contains

   !> Is a state of the splitting so near the solution that an attempt may succeed, and would the splitting, at its pace
   !> so far, take long to come to the tolerance?
   pure function promising(iteration, error, tolerance) result(yes)
      integer, intent(in) :: iteration
      real(dp), intent(in) :: error, tolerance
      logical :: yes
      real(dp) :: left                           !! iterations

      yes = iteration >= first_trial .and. error <= near .and. error > tolerance
      if (.not. yes) return
      left = iteration*log(error/tolerance)/log(1.0_dp/error)
      yes = left > price
   end function promising

   !> Solve, starting from a pressure with the right load. If this succeeds, the pressure is the solution, and its
   !> gap U - H and its error are returned. Otherwise the pressure is not changed.
   subroutine finish_by_newton(operator, task, height, pressure, gap, found, success)
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found
      logical, intent(out) :: success
      type(guess_type) :: guess
      real(dp) :: error, least, negative, wanted
      integer :: round, since
      logical :: joined, solved

      success = .false.
      call prepare(guess, operator, height, pressure, solved)
      if (.not. solved) return
      least = huge(1.0_dp)
      since = 0
      wanted = accuracy
      do round = 1, most_rounds
         call solve_round(guess, operator, task, height, wanted, solved)
         if (.not. solved) return
         call judge(guess, operator, task, height, found, negative)
         if (.not. negative > 0.0_dp .and. found%strict <= task%tolerance) then
            success = .true.
            pressure(:, :) = guess%pressure
            gap(:, :) = guess%gap
            return
         end if
         error = found%strict + negative
         since = since + 1
         if (error < 0.7_dp*least) since = 0
         least = min(least, error)
         if (since > patience) return
         call join(guess, joined)
         wanted = accuracy
         if (.not. (joined .or. negative > 0.0_dp)) wanted = max(finest, min(accuracy, 0.3_dp*task%tolerance/error))
      end do
   end subroutine finish_by_newton

   !> Make the first guess. It is not ready if there is not enough memory.
   subroutine prepare(guess, operator, height, pressure, ready)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: pressure(:, :)
      logical, intent(out) :: ready
      integer :: status(7), rows

      rows = operator%rows
      allocate (guess%pressure(operator%nx, rows), stat=status(1))
      allocate (guess%gap(operator%nx, rows), stat=status(2))
      allocate (guess%work(operator%nx, rows), stat=status(3))
      allocate (guess%moved(operator%nx, rows), stat=status(4))
      allocate (guess%inside(operator%nx, rows), stat=status(5))
      allocate (guess%first(rows + 1), stat=status(6))
      call guess%inverse%make_room(operator%grid, status(7))
      ready = .not. any_process(any(status /= 0))
      if (.not. ready) return
      guess%pressure(:, :) = pressure
      guess%inside(:, :) = pressure > 0.0_dp
      call guess%inverse%begin(operator)
      call find_gap(guess, operator, height)
      guess%level = field_mean(merge(guess%gap, 0.0_dp, guess%inside))*operator%grid%cells() &
         /max(field_count(guess%inside), 1.0_dp)
   end subroutine prepare

   !> Solve for the pressure of C. If it is negative somewhere, remove these cells and solve again. The gap is that of
   !> the last solution, whose negative pressures show which cells leave C next.
   subroutine solve_round(guess, operator, task, height, wanted, solved)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: wanted             !! accuracy
      logical, intent(out) :: solved
      integer :: time

      do time = 1, 2
         call leave(guess, operator, height)
         solved = field_count(guess%inside) > 0.0_dp
         if (.not. solved) return
         call correct(guess, operator, task, wanted, solved)
         if (.not. solved) return
         if (.not. field_count(guess%pressure < 0.0_dp) > 0.0_dp) exit
      end do
      call find_gap(guess, operator, height)
   end subroutine solve_round

   !> Remove the cells with negative pressure from C.
   subroutine leave(guess, operator, height)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)

      if (.not. field_count(guess%pressure < 0.0_dp) > 0.0_dp) return
      guess%inside(:, :) = guess%inside .and. guess%pressure >= 0.0_dp
      guess%pressure(:, :) = max(guess%pressure, 0.0_dp)
      call find_gap(guess, operator, height)
   end subroutine leave

   !> Compute U - H of the pressure.
   subroutine find_gap(guess, operator, height)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)

      call operator%displace(guess%pressure, guess%gap)
      guess%gap(:, :) = guess%gap - height
   end subroutine find_gap

   !> Correct pressure and level so that the cells of C have no gap and the load is right.
   subroutine correct(guess, operator, task, wanted, solved)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: wanted
      logical, intent(out) :: solved
      type(gmres_type) :: krylov
      type(cell_vector_type) :: v
      real(dp) :: level, mean
      real(dp) :: unit                           !! converts a level to a number of the vector, Pa/m
      integer :: j

      call guess%inverse%renew(guess%inside)
      guess%first(1) = 1
      do j = 1, operator%rows
         guess%first(j + 1) = guess%first(j) + count(guess%inside(:, j))
      end do
      unit = guess%inverse%lift_mean*operator%grid%cells()/field_count(guess%inside)
      allocate (v%cells(1, guess%first(operator%rows + 1) - 1))

      guess%work(:, :) = merge(guess%level - guess%gap, 0.0_dp, guess%inside)
      call guess%inverse%solve(task%target - field_mean(guess%pressure), guess%work, level)
      call gather(guess, guess%work, v)
      v%beside = unit*level
      call krylov%begin(v, guess%first, most_directions, wanted)
      do while (krylov%unsolved())
         call krylov%next(v)
         call scatter(guess, v, guess%work)
         mean = field_mean(guess%work)
         call operator%displace(guess%work, guess%moved)
         guess%work(:, :) = merge(guess%moved - v%beside/unit, 0.0_dp, guess%inside)
         call guess%inverse%solve(mean, guess%work, level)
         call gather(guess, guess%work, v)
         v%beside = unit*level
         call krylov%take(v)
      end do

      solved = krylov%left <= wanted
      if (.not. solved) return
      call krylov%solution(v)
      call scatter(guess, v, guess%work)
      guess%pressure(:, :) = guess%pressure + guess%work
      guess%level = guess%level + v%beside/unit
   end subroutine correct

   !> Gather the values of a field in C.
   subroutine gather(guess, field, v)
      type(guess_type), intent(in) :: guess
      real(dp), intent(in) :: field(:, :)
      type(cell_vector_type), intent(inout) :: v
      integer :: j

      do j = 1, size(field, 2)
         v%cells(1, guess%first(j):guess%first(j + 1) - 1) = pack(field(:, j), guess%inside(:, j))
      end do
   end subroutine gather

   !> Make a field of values in C, which is zero elsewhere.
   subroutine scatter(guess, v, field)
      type(guess_type), intent(in) :: guess
      type(cell_vector_type), intent(in) :: v
      real(dp), intent(inout) :: field(:, :)
      integer :: j

      do j = 1, size(field, 2)
         field(:, j) = unpack(v%cells(1, guess%first(j):guess%first(j + 1) - 1), guess%inside(:, j), 0.0_dp)
      end do
   end subroutine scatter

   !> Measure the error of the solution on C. Negative pressures count with their share of the load.
   subroutine judge(guess, operator, task, height, found, negative)
      type(guess_type), intent(in) :: guess
      type(steady_operator_type), intent(in) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      type(gap_measure_type), intent(out) :: found
      real(dp), intent(out) :: negative          !! share of the negative pressures in the load
      type(normal_problem_type) :: narrowed

      found = measure_gap(task, guess%pressure, guess%gap, operator%threads)
      narrowed = task
      call narrow_scale(narrowed, height, guess%pressure, operator%threads, found)
      negative = field_mean(max(-guess%pressure, 0.0_dp))/task%target
   end subroutine judge

   !> Let the cells that overlap join C.
   subroutine join(guess, joined)
      type(guess_type), intent(inout) :: guess
      logical, intent(out) :: joined             !! were there any?
      logical, allocatable :: joining(:, :)

      allocate (joining, source=.not. guess%inside .and. guess%gap < guess%level)
      joined = field_count(joining) > 0.0_dp
      guess%inside(:, :) = guess%inside .or. joining
   end subroutine join

end module steady_newton
