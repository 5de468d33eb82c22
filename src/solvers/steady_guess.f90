!> A steady contact whose cells in contact are assumed: the pressure there follows from one linear system.
!>
!> With a set C of cells in contact, the pressure on C and the level are found from
!>
!>     K P + s (P - P0) = H + level on C,    mean P = load
!>
!> by GMRES with an approximate inverse. s is the compliance of springs on the rubber, one on each cell, which are relaxed
!> at the pressure P0. Without springs, s = 0, this is the contact itself (module `steady_newton`). With springs the
!> set C is much easier to find (module `steady_proximal`).
!>
!> The approximate inverse consists of dense inverses on tiles (module `steady_inverse`); a direction then takes two
!> transforms. Where it needs many directions and there are springs, the inverse by modes (module `modal_inverse`) is tried,
!> with four transforms per direction, and the one that has taken fewer transforms per decade is used.
!>
!> Memory: seven fields, those of the inverse, and the directions of GMRES in single precision, on the cells in contact.
module steady_guess
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : field_count, field_mean
   use gmres, only : cell_vector_type, gmres_type
   use modal_inverse, only : modal_inverse_type
   use normal_state, only : gap_measure_type, measure_gap, narrow_scale, normal_problem_type
   use steady_inverse, only : contact_inverse_type
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: guess_type

   integer, parameter :: tiles = 1, modes = 2    !! the approximate inverses
   integer, parameter :: retry_after = 8         !! solutions after which the other inverse is tried again
   real(dp), parameter :: too_costly = 60.0_dp   !! transforms per decade that call for the other inverse

   !> A contact that is being solved.
   type :: guess_type
      real(dp), allocatable :: pressure(:, :)    !! P, Pa
      real(dp), allocatable :: gap(:, :)         !! U - H, m, with the springs
      real(dp), allocatable :: centre(:, :)      !! P0, Pa; allocated if there are springs
      logical, allocatable :: inside(:, :)       !! C
      real(dp) :: level = 0.0_dp                 !! of U - H in C, m
      real(dp) :: spring = 0.0_dp                !! s, m/Pa
      real(dp) :: soft = 0.0_dp                  !! displacement of a cell under its own unit pressure, m/Pa
      integer :: most_directions = 60            !! of GMRES
      type(contact_inverse_type), private :: inverse
      type(modal_inverse_type), private :: modal
      integer, private :: chosen = tiles         !! the inverse in use
      real(dp), private :: cost(2) = 0.0_dp     !! transforms per decade of either inverse when it was last used; 0: never
      integer, private :: since = 0              !! solutions with the inverse in use
      real(dp), allocatable, private :: work(:, :), moved(:, :)
      integer, allocatable, private :: first(:)  !! [rows + 1] the first cell of each row in the list of C
   contains
      procedure :: prepare
      procedure :: prepare_inverse
      procedure :: find_gap
      procedure :: correct
      procedure :: judge
   end type guess_type

contains

   !> Make the first guess, without springs. It is not ready if there is not enough memory.
   subroutine prepare(guess, operator, height, pressure, ready)
      class(guess_type), intent(inout) :: guess
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
      call guess%find_gap(operator, height)
      guess%level = field_mean(merge(guess%gap, 0.0_dp, guess%inside))*operator%grid%cells() &
         /max(field_count(guess%inside), 1.0_dp)
   end subroutine prepare

   !> Prepare the approximate inverse by tiles for all sets of cells in contact.
   subroutine prepare_inverse(guess, operator)
      class(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator

      call guess%inverse%begin(operator)
      guess%soft = guess%inverse%tiles%soft
   end subroutine prepare_inverse

   !> Compute U - H of the pressure, with the springs.
   subroutine find_gap(guess, operator, height)
      class(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: height(:, :)

      call operator%displace(guess%pressure, guess%gap)
      guess%gap(:, :) = guess%gap - height
      if (guess%spring > 0.0_dp) guess%gap(:, :) = guess%gap + guess%spring*(guess%pressure - guess%centre)
   end subroutine find_gap

   !> Correct pressure and level so that the cells of C have no gap and the load is right. If the directions do not
   !> suffice for the accuracy that is wanted, the correction is the best that they allow.
   subroutine correct(guess, operator, task, wanted, solved)
      class(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: wanted
      logical, intent(out) :: solved
      type(gmres_type) :: krylov
      type(cell_vector_type) :: v
      real(dp) :: level, mean
      real(dp) :: unit                           !! converts a level to a number of the vector, Pa/m
      integer :: before, j

      before = int(operator%ffts)
      call renew_inverse(guess, operator, unit)
      guess%first(1) = 1
      do j = 1, operator%rows
         guess%first(j + 1) = guess%first(j) + count(guess%inside(:, j))
      end do
      allocate (v%cells(1, guess%first(operator%rows + 1) - 1))

      guess%work(:, :) = merge(guess%level - guess%gap, 0.0_dp, guess%inside)
      call invert(guess, operator, task%target - field_mean(guess%pressure), level)
      call gather(guess, guess%work, v)
      v%beside(1) = unit*level
      call krylov%begin(v, guess%first, guess%most_directions, wanted)
      do while (krylov%unsolved())
         call krylov%next(v)
         call scatter(guess, v, guess%work)
         mean = field_mean(guess%work)
         call operator%displace(guess%work, guess%moved)
         if (guess%spring > 0.0_dp) guess%moved(:, :) = guess%moved + guess%spring*guess%work
         guess%work(:, :) = merge(guess%moved - v%beside(1)/unit, 0.0_dp, guess%inside)
         call invert(guess, operator, mean, level)
         call gather(guess, guess%work, v)
         v%beside(1) = unit*level
         call krylov%take(v)
      end do

      solved = krylov%left <= wanted
      call krylov%solution(v)
      call scatter(guess, v, guess%work)
      guess%pressure(:, :) = guess%pressure + guess%work
      guess%level = guess%level + v%beside(1)/unit
      call choose_inverse(guess, real(operator%ffts - before, dp), krylov%left)
   end subroutine correct

   !> Prepare the chosen inverse for the present C.
   subroutine renew_inverse(guess, operator, unit)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(out) :: unit              !! mean pressure in C that lifts C by 1 m, Pa/m
      logical :: ready

      if (.not. guess%spring > 0.0_dp) guess%chosen = tiles
      if (guess%chosen == modes) then
         call guess%modal%renew(operator, guess%inside, guess%spring, ready)
         unit = guess%modal%lift_mean
         if (.not. ready) guess%chosen = tiles
      end if
      if (guess%chosen == tiles) then
         call guess%inverse%renew(guess%inside, guess%spring)
         unit = guess%inverse%lift_mean
      end if
      unit = unit*operator%grid%cells()/field_count(guess%inside)
   end subroutine renew_inverse

   !> Apply the chosen inverse to the displacements in the field `work`.
   subroutine invert(guess, operator, mean, level)
      type(guess_type), intent(inout) :: guess
      type(steady_operator_type), intent(inout) :: operator
      real(dp), intent(in) :: mean               !! of the pressures, Pa
      real(dp), intent(out) :: level             !! m

      if (guess%chosen == modes) then
         call guess%modal%solve(operator, guess%inside, mean, guess%work, level)
      else
         call guess%inverse%solve(mean, guess%work, level)
      end if
   end subroutine invert

   !> Choose the inverse for the next solution by the transforms that each has taken.
   subroutine choose_inverse(guess, transforms, left)
      type(guess_type), intent(inout) :: guess
      real(dp), intent(in) :: transforms         !! of a solution with the present inverse
      real(dp), intent(in) :: left               !! its relative error
      integer :: other

      if (.not. (left > 0.0_dp .and. left < 1.0_dp)) return
      guess%cost(guess%chosen) = transforms/log10(1.0_dp/left)
      guess%since = guess%since + 1
      other = modes + tiles - guess%chosen
      if (guess%cost(guess%chosen) < too_costly) return
      if (guess%since < retry_after .and. guess%cost(other) > 0.0_dp &
         .and. guess%cost(other) > guess%cost(guess%chosen)) return
      guess%chosen = other
      guess%since = 0
   end subroutine choose_inverse

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
      class(guess_type), intent(in) :: guess
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

end module steady_guess
