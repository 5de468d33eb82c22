!> Solves a steady contact by proximal steps, where the splitting of `steady_normal` is slow.
!>
!> Each step puts springs on the rubber, one on each cell, which are relaxed at the pressure P0 of the step before,
!>
!>     P >= 0,  K P + s (P - P0) - H - level >= 0,  and in each cell at least one of the two is zero,  mean P = load
!>
!> Since K is monotone, the steps converge to the solution without springs for any compliance s > 0 (R. T. Rockafellar,
!> SIAM J. Control Optim. 14 (1976) 877), and the faster the smaller s is.
!>
!> The cells in contact of a step are found by Newton's method: with a guess C of them P follows from a linear system
!> (module `steady_guess`); then cells with P < 0 leave C, and cells that overlap join it. Without springs C oscillates if
!> the guess is distant, and the pressures become larger and larger: in slow sliding a loaded cell displaces the rubber
!> far behind it, so that each change of C is felt by all cells behind. The springs limit the pressures. s is
!> reduced as fast as C settles; a step in which C does not settle is repeated with a larger s.
!>
!> Memory: that of the guess, and one field.
module steady_proximal
   use asperity_parallel, only : any_process, global_max
   use asperity_precision, only : dp, int64
   use field_sums, only : field_count, field_mean
   use normal_state, only : gap_measure_type, normal_problem_type
   use steady_guess, only : guess_type
   use steady_operator, only : steady_operator_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: pays, solve_by_steps

   ! Outcomes of a step. settled: C no longer changes. unsettled: fewer and fewer cells change. diverged: the number of
   ! changes does not fall.
   integer, parameter :: settled = 1, unsettled = 2, diverged = 3

   integer, parameter :: first_trial = 128       !! iteration of the splitting from which the steps may pay
   integer, parameter :: first_after_dense = 250 !! the same where dense systems are tried before
   integer, parameter :: overdue = 400           !! iteration after which the steps are tried in any case
   real(dp), parameter :: price = 300.0_dp       !! of the steps, in iterations of the splitting
   integer, parameter :: allowance = 20          !! transforms, over the iterations that the splitting is allowed ...
   integer, parameter :: idle = 2                !! ... and those in which the error must be halved
   integer, parameter :: most_rounds = 6         !! of Newton's method in a step
   integer, parameter :: slow = 3                !! round after which cells change sides one by one, if few are wrong
   integer, parameter :: most_directions = 100   !! of GMRES in a round
   integer, parameter :: patience = 2            !! rounds in which the changes of C need not become fewer
   real(dp), parameter :: few = 0.01_dp           !! changes, as a part of C, with which a step has settled
   real(dp), parameter :: ignored = 0.1_dp       !! overlap, over the error of the displacement, with which a cell stays open
   real(dp), parameter :: accuracy = 0.1_dp      !! of the linear systems
   real(dp), parameter :: finest = 1.0e-4_dp     !! the same, in the last steps
   ! Compliances of the springs, over the displacement of a cell under its own pressure:
   real(dp), parameter :: softest = 30.0_dp
   real(dp), parameter :: stiffest = 1.0e-3_dp   !! of the first step

   !> A step, and what it leaves to the next one.
   type :: step_type
      real(dp) :: factor = 0.1_dp                !! by which s is reduced after the step
      real(dp) :: wanted = accuracy              !! of the linear systems
      real(dp) :: level = 0.0_dp                 !! before the step, m
      integer :: rounds = 0
      integer :: outcome = settled
      logical :: careful = .false.               !! s is not reduced until C settles soon
      logical :: solved = .true.                 !! all linear systems have reached the accuracy
      logical :: gap_known = .true.              !! the gap is that of the pressure
   end type step_type

contains

   !> Would the splitting, at its pace so far, take long to come to the tolerance? After very many iterations its
   !> pace at the beginning is ignored.
   pure function pays(iteration, error, tolerance, dense) result(yes)
      integer, intent(in) :: iteration
      real(dp), intent(in) :: error              !! the least so far
      real(dp), intent(in) :: tolerance
      logical, intent(in) :: dense               !! a dense system for the cells in contact is or will soon be cheap
      logical :: yes

      yes = iteration >= merge(first_after_dense, first_trial, dense)
      if (yes .and. iteration < overdue .and. error < 1.0_dp) &
         yes = iteration*log(error/tolerance) > price*log(1.0_dp/error)
   end function pays

   !> Solve, starting from a pressure with the right load. On return the pressure is the best that was found, with its
   !> gap U - H and its error. The steps end without the solution after a number of transforms, which follows
   !> from the iterations that the task allows.
   subroutine solve_by_steps(operator, task, height, pressure, gap, found)
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found
      type(guess_type) :: guess
      type(step_type) :: step
      type(gap_measure_type) :: here
      real(dp) :: marked, negative
      integer(int64) :: last, next
      integer :: status
      logical :: ready

      last = operator%ffts + allowance*int(task%max_iterations, int64)
      next = operator%ffts + idle*int(task%max_iterations, int64)
      ! Without memory for the steps, the error is not known.
      found%error = huge(1.0_dp)
      found%strict = huge(1.0_dp)
      call guess%prepare(operator, height, pressure, ready)
      if (.not. ready) return
      call guess%prepare_inverse(operator)
      allocate (guess%centre, mold=pressure, stat=status)
      if (any_process(status /= 0)) return
      guess%most_directions = most_directions
      guess%centre(:, :) = pressure
      gap(:, :) = guess%gap
      call guess%judge(operator, task, height, found, negative)
      call first_spring(guess, found, operator%grid%cells())

      here = found
      marked = found%strict
      do while (operator%ffts < min(next, last))
         if (stop_is_due()) return
         step%level = guess%level
         call take_step(guess, operator, task, height, ignored*here%duality_gap, step)
         if (step%outcome == diverged) then
            guess%pressure(:, :) = guess%centre
            guess%inside(:, :) = guess%pressure > 0.0_dp
            guess%level = step%level
            step%gap_known = .false.
         else
            call move_centre(guess, operator, task, height)
            step%gap_known = .true.
            call guess%judge(operator, task, height, here, negative)
            if (here%strict < found%strict) then
               found = here
               pressure(:, :) = guess%pressure
               gap(:, :) = guess%gap
               if (found%strict <= task%tolerance) return
            end if
         end if
         if (found%strict < 0.5_dp*marked) then
            marked = found%strict
            next = operator%ffts + idle*int(task%max_iterations, int64)
         end if
         call choose_spring(guess, step, task%tolerance/here%strict)
      end do
   end subroutine solve_by_steps

   !> Choose the first springs. A typical pressure shortens them by the error of the displacement, so that they change the
   !> contact about as much as it is wrong.
   subroutine first_spring(guess, found, cells)
      type(guess_type), intent(inout) :: guess
      type(gap_measure_type), intent(in) :: found
      real(dp), intent(in) :: cells              !! of the grid
      real(dp) :: contact_pressure

      contact_pressure = field_mean(guess%pressure)*cells/field_count(guess%inside)
      guess%spring = min(max(found%duality_gap/contact_pressure, stiffest*guess%soft), softest*guess%soft)
   end subroutine first_spring

   !> Find the cells in contact and the pressure with the present springs.
   subroutine take_step(guess, operator, task, height, slack, step)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(in) :: slack              !! overlap with which a cell stays open, m
      type(step_type), intent(inout) :: step
      logical, allocatable :: wrong(:, :)
      real(dp) :: changes, fewest
      integer :: since
      logical :: solved

      step%solved = .true.
      fewest = huge(1.0_dp)
      since = 0
      do while (step%rounds < most_rounds)
         step%rounds = step%rounds + 1
         guess%pressure(:, :) = merge(max(guess%pressure, 0.0_dp), 0.0_dp, guess%inside)
         if (.not. step%gap_known) call guess%find_gap(operator, height)
         step%gap_known = .false.
         call guess%correct(operator, task, step%wanted, solved)
         call guess%find_gap(operator, height)
         step%solved = step%solved .and. solved

         wrong = merge(guess%pressure < 0.0_dp, guess%gap < guess%level - slack, guess%inside)
         changes = field_count(wrong)
         step%outcome = merge(settled, unsettled, changes <= few*field_count(guess%inside))
         if (.not. changes > 0.0_dp) return
         since = since + 1
         if (changes < 0.9_dp*fewest) since = 0
         fewest = min(fewest, changes)
         if (since >= patience .and. step%outcome == unsettled) step%outcome = diverged
         if (step%outcome == diverged) return
         if (step%outcome == settled .and. step%rounds >= slow) call keep_worst(guess, slack, wrong)
         guess%inside(:, :) = guess%inside .neqv. wrong
         if (.not. field_count(guess%inside) > 0.0_dp) step%outcome = diverged
         if (step%outcome == diverged) return
      end do
   end subroutine take_step

   !> Keep only the cell that is most wrong among those that are to change sides. A few cells that change together can
   !> alternate for ever, which cells that change one by one hardly do.
   subroutine keep_worst(guess, slack, wrong)
      type(guess_type), intent(in) :: guess
      real(dp), intent(in) :: slack              !! overlap with which a cell stays open, m
      logical, intent(inout) :: wrong(:, :)
      real(dp), allocatable :: by(:, :)          !! how wrong a cell is, m

      by = merge(-guess%soft*guess%pressure, guess%level - slack - guess%gap, guess%inside)
      wrong = wrong .and. by >= global_max(maxval(by, mask=wrong))
   end subroutine keep_worst

   !> Make the pressure of the step the one at which the springs are relaxed. The gap is then that without springs.
   subroutine move_centre(guess, operator, task, height)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)

      guess%pressure(:, :) = max(guess%pressure, 0.0_dp)
      guess%pressure(:, :) = guess%pressure*(task%target/field_mean(guess%pressure))
      guess%centre(:, :) = guess%pressure
      call guess%find_gap(operator, height)
   end subroutine move_centre

   !> Choose the springs of the next step, and the accuracy of its linear systems.
   subroutine choose_spring(guess, step, left)
      type(guess_type), intent(inout) :: guess
      type(step_type), intent(inout) :: step     !! the last one
      real(dp), intent(in) :: left               !! tolerance over error

      step%wanted = accuracy
      if (step%outcome == settled .and. step%rounds <= 3) then
         step%factor = max(0.03_dp, step%factor**1.5_dp)
      else if (step%outcome /= settled .or. step%rounds > 4) then
         step%factor = min(0.6_dp, sqrt(step%factor))
      end if

      if (step%outcome == settled) then
         if (step%rounds == 1) step%wanted = max(finest, min(accuracy, 0.3_dp*left))
         if (step%rounds <= 4) step%careful = .false.
         if (.not. step%careful) guess%spring = guess%spring*step%factor
      else if (step%outcome == diverged .or. .not. step%solved) then
         guess%spring = min(guess%spring/step%factor, softest*guess%soft)
         step%careful = .true.
      end if
      step%rounds = 0
   end subroutine choose_spring

end module steady_proximal
