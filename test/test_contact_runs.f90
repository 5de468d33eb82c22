!> Tests of the rows that contain only the cells in contact.
module test_contact_runs
   use asperity_precision, only : dp, int8
   use check, only : begin_suite, check_that, selected
   use contact_runs, only : contact_runs_type, find_runs
   implicit none
   private

   public :: run_contact_runs

contains

   subroutine run_contact_runs()
      call begin_suite('contact_runs')
      if (selected('rows_are_gathered_and_spread')) call rows_are_gathered_and_spread()
   end subroutine run_contact_runs

   !> For random patterns of contact, from none to all cells, and for rows of one cell: a gathered row contains the cells
   !> in contact in their order, with zeros behind them, and the row that is spread again has zeros in the other cells.
   !> One set of runs serves all patterns, as in the solver.
   subroutine rows_are_gathered_and_spread()
      integer, parameter :: lengths(5) = [1, 2, 15, 16, 67]
      integer, parameter :: rows = 7
      type(contact_runs_type) :: runs
      integer(int8), allocatable :: state(:, :)
      real(dp), allocatable :: field(:, :), packed(:), whole(:)
      integer :: j, k, m, part
      logical :: in_order, filled, spread

      do k = 1, size(lengths)
         in_order = .true.
         filled = .true.
         spread = .true.
         do part = 0, 10
            call draw(lengths(k), rows, 0.1_dp*part, state, field)
            call find_runs(runs, state, 1)
            do j = 1, rows
               packed = [(-1.0_dp, m=1, runs%width)]
               whole = [(-1.0_dp, m=1, lengths(k))]
               call runs%gather(j, field(:, j), packed)
               m = count(state(:, j) /= 0)
               in_order = in_order .and. m <= runs%width
               in_order = in_order .and. all(abs(packed(:m) - pack(field(:, j), state(:, j) /= 0)) <= 0.0_dp)
               filled = filled .and. all(abs(packed(m + 1:)) <= 0.0_dp)
               call runs%spread(j, packed, whole)
               spread = spread .and. all(abs(whole - merge(field(:, j), 0.0_dp, state(:, j) /= 0)) <= 0.0_dp)
            end do
         end do
         call check_that(in_order, 'the cells in contact, in their order')
         call check_that(filled, 'zeros behind them')
         call check_that(spread, 'the same cells again, and zeros elsewhere')
      end do
   end subroutine rows_are_gathered_and_spread

   !> Draw states of which a part is in contact, and values.
   subroutine draw(nx, rows, part, state, field)
      integer, intent(in) :: nx, rows
      real(dp), intent(in) :: part
      integer(int8), allocatable, intent(out) :: state(:, :)
      real(dp), allocatable, intent(out) :: field(:, :)
      real(dp), allocatable :: chance(:, :)

      allocate (state(nx, rows), field(nx, rows), chance(nx, rows))
      call random_number(chance)
      call random_number(field)
      state = merge(merge(1_int8, 2_int8, chance < 0.5_dp*part), 0_int8, chance < part)
   end subroutine draw

end module test_contact_runs
