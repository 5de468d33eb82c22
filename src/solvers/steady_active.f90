!> Solves a steady contact of few cells directly, with the cells in contact as the only unknowns.
!>
!> With a guess C of the cells in contact, P follows from K P = H + level on C and the load. This is a dense
!> system, whose entries come from the displacement caused by one loaded cell. Cells with P < 0 leave C, and cells
!> that overlap the road join it, until C does not change any more. For few cells the system is cheap, whereas the
!> splitting of `steady_normal` is slow in such cases, for example with small patches far apart, or with the summit of a
!> tall map. Near the solution a few rounds are sufficient. There is no proof that C settles, and from a distant guess
!> it oscillates. The attempt therefore ends if it does not come closer in `patience` rounds, and the caller continues.
!>
!> The matrix is factored for the first guess. Cells that leave or join later change the solution by a
!> small system of their own (module `changed_set`), which makes the rounds after the first cheap.
module steady_active
   use changed_set, only : changed_set_type, new_changed_set
   use field_sums, only : cell_count, field_count
   use normal_state, only : gap_measure_type, measure_gap, narrow_scale, normal_problem_type
   use asperity_precision, only : dp
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: finish_on_contact, worthwhile

   integer, parameter :: most_rounds = 30        !! rounds in which cells join
   integer, parameter :: most_departures = 12    !! times that cells leave within a round
   integer, parameter :: most_factors = 4        !! factorisations of the matrix in an attempt
   integer, parameter :: patience = 6            !! an attempt ends after more rounds that do not come closer

contains

   !> Is a dense system cheap compared with the transforms so far, and small compared with the solver's fields?
   pure function worthwhile(cells_in_contact, cells, transforms) result(cheap)
      real(dp), intent(in) :: cells_in_contact, cells
      integer, intent(in) :: transforms                !! real transforms since the solve began
      logical :: cheap
      !> m^3 of a factorisation over n log2(n) of a transform that takes the same time. The value was measured.
      real(dp), parameter :: factoring = 3.0_dp
      real(dp), parameter :: part = 0.25_dp            !! largest time of a factorisation over the time so far
      real(dp), parameter :: fields = 16.0_dp          !! largest memory of the matrix, in fields
      real(dp) :: m, n

      m = cells_in_contact
      n = max(cells, 2.0_dp)
      cheap = m**2 <= fields*n .and. m**3 <= part*transforms*factoring*n*log(n)/log(2.0_dp)
   end function worthwhile

   !> Solve, starting from the contact of a pressure with the right load. If this succeeds, the pressure is the
   !> solution, and its gap U - H and its error are returned. Otherwise the pressure is not changed.
   subroutine finish_on_contact(operator, task, height, pressure, gap, found, success)
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: height(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(inout) :: gap(:, :)
      type(gap_measure_type), intent(out) :: found
      logical, intent(out) :: success
      type(changed_set_type) :: set
      type(normal_problem_type) :: narrowed
      real(dp), allocatable :: trial(:, :)
      real(dp) :: level
      logical :: solved
      integer :: fewest, joining, most, round, since

      success = .false.
      call new_changed_set(set, operator, height, task%target*cell_count(height), pressure > 0.0_dp, gap)
      allocate (trial, mold=pressure)
      most = 2*nint(field_count(pressure > 0.0_dp)) + 50
      fewest = huge(fewest)
      since = 0
      do round = 1, most_rounds
         call settle_departures(set, trial, level, solved)
         if (.not. solved) return
         call operator%displace(trial, gap)
         gap = gap - height
         found = measure_gap(task, trial, gap, operator%threads)
         narrowed = task
         call narrow_scale(narrowed, height, trial, operator%threads, found)
         if (found%strict <= task%tolerance) then
            success = .true.
            pressure(:, :) = trial
            return
         end if
         call set%join(trial <= 0.0_dp .and. gap < level, joining)
         since = since + 1
         if (joining < fewest) since = 0
         fewest = min(fewest, joining)
         if (joining == 0 .or. since > patience .or. nint(field_count(trial > 0.0_dp)) + joining > most) return
      end do
   end subroutine finish_on_contact

   !> Compute the pressure of the set, and remove cells with negative pressure from it.
   subroutine settle_departures(set, pressure, level, solved)
      type(changed_set_type), intent(inout) :: set
      real(dp), intent(inout) :: pressure(:, :)
      real(dp), intent(out) :: level
      logical, intent(out) :: solved
      integer :: departure, leaving

      do departure = 1, most_departures
         if (set%is_full()) then
            if (set%factors >= most_factors) exit
            call set%refresh()
         end if
         call set%solve(pressure, level, solved)
         if (.not. solved) return
         call set%leave(pressure < 0.0_dp, leaving)
         if (leaving == 0) return
      end do
      solved = .false.
   end subroutine settle_departures

end module steady_active
