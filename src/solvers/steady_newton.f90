!> Solves a steady contact with all cells in contact as unknowns, once the splitting of `steady_normal` is near the
!> solution.
!>
!> With a guess C of the cells in contact, P follows from a linear system (module `steady_guess`). Cells with P < 0
!> leave C, and the rest is solved again; then cells that overlap join C. While C changes, an approximate solution is
!> enough.
!>
!> Near the solution C settles in a few rounds, however many cells there are, where the splitting takes more and more
!> iterations. There is no proof of it, and from a distant guess C oscillates. The attempt therefore ends at once if the
!> error of the given pressure is large, after one round if much of the pressure is negative, and later as soon as it
!> does not come closer. The caller then continues, and the next attempt begins from a smaller error.
module steady_newton
   use asperity_precision, only : dp
   use field_sums, only : field_count
   use normal_state, only : gap_measure_type, normal_problem_type
   use steady_guess, only : guess_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: finish_by_newton, promising

   integer, parameter :: most_rounds = 20
   integer, parameter :: patience = 3            !! an attempt ends after more rounds that do not come closer
   integer, parameter :: first_trial = 32        !! iteration of the splitting from which an attempt may save time
   real(dp), parameter :: price = 24.0_dp        !! of an attempt, in iterations of the splitting
   !> Error, as the splitting estimates it, below which a first attempt usually succeeds.
   real(dp), parameter, public :: first_near = 1.0e-2_dp
   real(dp), parameter :: later_near = 0.1_dp    !! factor by which this error is smaller for the next attempt
   real(dp), parameter :: underestimate = 3.0_dp !! largest error of the pressure itself, in units of this error
   real(dp), parameter :: wrong = 3.0e-3_dp      !! largest part of the load by negative pressures after the first round
   real(dp), parameter :: accuracy = 0.1_dp      !! of a solution while C changes
   real(dp), parameter :: finest = 1.0e-4_dp     !! of any solution

contains

   !> Is a state of the splitting so near the solution that an attempt may succeed, and would the splitting, at its pace
   !> so far, take long to come to the tolerance?
   pure function promising(iteration, error, near, tolerance) result(yes)
      integer, intent(in) :: iteration
      real(dp), intent(in) :: error              !! that the splitting estimates
      real(dp), intent(in) :: near               !! largest error from which an attempt is made
      real(dp), intent(in) :: tolerance
      logical :: yes
      real(dp) :: left                           !! iterations

      yes = iteration >= first_trial .and. error <= near .and. error > tolerance
      if (.not. yes) return
      left = iteration*log(error/tolerance)/log(1.0_dp/error)
      yes = left > price
   end function promising

   !> Solve, starting from a pressure with the right load. If this succeeds, the pressure is the solution, and its
   !> gap U - H and its error are returned. Otherwise the pressure is not changed.
   subroutine finish_by_newton(operator, task, height, near, pressure, gap, found, success)
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: near            !! as in `promising`; out: for the next attempt
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found
      logical, intent(out) :: success
      type(guess_type) :: guess
      real(dp) :: error, least, negative, wanted
      integer :: round, since
      logical :: joined, solved

      success = .false.
      call guess%prepare(operator, height, pressure, solved)
      if (.not. solved) return
      call guess%judge(operator, task, height, found, negative)
      if (found%strict > underestimate*near) return
      near = later_near*near
      call guess%prepare_inverse(operator)
      least = huge(1.0_dp)
      since = 0
      wanted = accuracy
      do round = 1, most_rounds
         call solve_round(guess, operator, task, height, wanted, solved)
         if (.not. solved) return
         call guess%judge(operator, task, height, found, negative)
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
         if (since > patience .or. round == 1 .and. negative > wrong) return
         call join(guess, joined)
         wanted = accuracy
         if (.not. (joined .or. negative > 0.0_dp)) wanted = max(finest, min(accuracy, 0.3_dp*task%tolerance/error))
      end do
   end subroutine finish_by_newton

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
         call guess%correct(operator, task, wanted, solved)
         if (.not. solved) return
         if (.not. field_count(guess%pressure < 0.0_dp) > 0.0_dp) exit
      end do
      call guess%find_gap(operator, height)
   end subroutine solve_round

   !> Remove the cells with negative pressure from C.
   subroutine leave(guess, operator, height)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)

      if (.not. field_count(guess%pressure < 0.0_dp) > 0.0_dp) return
      guess%inside(:, :) = guess%inside .and. guess%pressure >= 0.0_dp
      guess%pressure(:, :) = max(guess%pressure, 0.0_dp)
      call guess%find_gap(operator, height)
   end subroutine leave

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
