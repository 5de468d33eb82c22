!> Checks that count, for the one test driver.
module check
   use, intrinsic :: iso_fortran_env, only : error_unit, output_unit
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: begin_suite, check_close, check_error, check_no_error, check_order, check_that, &
      run_suites, selected, suite_type

   !> A suite of the driver's table: the name on the command line and the procedure that runs its tests.
   type :: suite_type
      character(32) :: name
      procedure(run_suite), pointer, nopass :: run
   end type suite_type

   abstract interface
      !> Run the tests of a suite.
      subroutine run_suite()
      end subroutine run_suite
   end interface

   !> Pass if two numbers are in the stated order. Otherwise print both.
   interface check_order
      module procedure check_order_real
      module procedure check_order_integer
   end interface check_order

   integer :: passed = 0
   integer :: failed = 0
   character(:), allocatable :: suite

   !> The tests that the command line names, and how many tests of each name have run. All tests run if no
   !> name is given.
   character(64), allocatable :: chosen(:)
   integer, allocatable :: runs_of_chosen(:)

contains

   !> Run the suites of the table that the command line names, or all. An argument that is not the name of a
   !> suite is the name of a test (see `selected`).
   subroutine run_suites(suites)
      type(suite_type), intent(in) :: suites(:)
      character(64) :: argument
      logical :: wanted(size(suites))
      integer :: i, k

      wanted = .false.
      allocate (chosen(0))
      do i = 1, command_argument_count()
         call get_command_argument(i, argument)
         if (any(suites%name == argument)) then
            wanted = wanted .or. suites%name == argument
         else
            chosen = [character(64) :: chosen, argument]
         end if
      end do
      allocate (runs_of_chosen(size(chosen)), source=0)

      do i = 1, size(suites)
         if (wanted(i) .or. .not. any(wanted)) call suites(i)%run()
      end do

      do i = 1, size(chosen)
         if (runs_of_chosen(i) > 0) cycle
         failed = failed + 1
         write (error_unit, '(a)') 'FAILED: no suite or test is called '//trim(chosen(i))//'; the suites are:'
         write (error_unit, '(*(3x, a, /))') (trim(suites(k)%name), k=1, size(suites))
         exit
      end do
      call finish()
   end subroutine run_suites

   !> Should the test of this name run? The prefix `test_` may be left out on the command line.
   logical function selected(name)
      character(*), intent(in) :: name
      integer :: i

      selected = size(chosen) == 0
      do i = 1, size(chosen)
         if (chosen(i) /= name .and. 'test_'//chosen(i) /= name) cycle
         runs_of_chosen(i) = runs_of_chosen(i) + 1
         selected = .true.
      end do
      if (selected .and. size(chosen) > 0) write (output_unit, '(a)') 'test '//name
   end function selected

   !> Set the name of the suite that the next checks belong to.
   subroutine begin_suite(name)
      character(*), intent(in) :: name

      suite = name
      write (output_unit, '(a)') 'suite '//name
   end subroutine begin_suite

   !> Pass if the condition holds.
   subroutine check_that(condition, what, values)
      logical, intent(in) :: condition
      character(*), intent(in) :: what
      real(dp), intent(in), optional :: values(:)      !! what the condition is about, for the message
      character(400) :: numbers

      if (condition) then
         passed = passed + 1
      else
         failed = failed + 1
         numbers = ''
         if (present(values)) write (numbers, '(": ", *(es15.7, :, ","))') values(:min(size(values), 20))
         write (error_unit, '(a)') 'FAILED '//suite//': '//what//trim(numbers)
      end if
   end subroutine check_that

   !> Pass if |value - reference| <= tolerance; never passes for NaN.
   subroutine check_close(value, reference, tolerance, what)
      real(dp), intent(in) :: value
      real(dp), intent(in) :: reference
      real(dp), intent(in) :: tolerance     !! absolute tolerance
      character(*), intent(in) :: what
      character(120) :: numbers

      if (ieee_is_finite(value) .and. abs(value - reference) <= tolerance) then
         passed = passed + 1
      else
         failed = failed + 1
         write (numbers, '(": ", es22.15, " is not ", es22.15, " +- ", es9.2)') &
            value, reference, tolerance
         write (error_unit, '(a)') 'FAILED '//suite//': '//what//trim(numbers)
      end if
   end subroutine check_close

   !> Pass if `a < b`, or whichever of <, <=, > and >= is given, holds; never passes for NaN.
   subroutine check_order_real(a, relation, b, what)
      real(dp), intent(in) :: a
      character(*), intent(in) :: relation
      real(dp), intent(in) :: b
      character(*), intent(in) :: what
      character(60) :: numbers
      logical :: holds

      select case (relation)
      case ('<')
         holds = a < b
      case ('<=')
         holds = a <= b
      case ('>')
         holds = a > b
      case ('>=')
         holds = a >= b
      case default
         holds = .false.
      end select
      write (numbers, '(es22.15, 1x, a, es22.15)') a, relation, b
      call check_that(holds, what//': '//trim(adjustl(numbers)))
   end subroutine check_order_real

   !> Pass if two integers stand in the stated order.
   subroutine check_order_integer(a, relation, b, what)
      integer, intent(in) :: a
      character(*), intent(in) :: relation
      integer, intent(in) :: b
      character(*), intent(in) :: what

      call check_order_real(real(a, dp), relation, real(b, dp), what)
   end subroutine check_order_integer

   !> Pass if there is no error.
   subroutine check_no_error(error, what)
      type(error_type), allocatable, intent(in) :: error
      character(*), intent(in) :: what

      if (allocated(error)) then
         call check_that(.false., what//': '//error%message)
      else
         call check_that(.true., what)
      end if
   end subroutine check_no_error

   !> Pass if there is an error whose message contains `fragment`.
   subroutine check_error(error, fragment, what)
      type(error_type), allocatable, intent(in) :: error
      character(*), intent(in) :: fragment
      character(*), intent(in) :: what

      if (.not. allocated(error)) then
         call check_that(.false., what//': no error')
      else
         call check_that(index(error%message, fragment) > 0, &
            what//': "'//error%message//'" lacks "'//fragment//'"')
      end if
   end subroutine check_error

   !> Print the numbers of checks, and stop with status 1 if any failed.
   subroutine finish()
      write (output_unit, '(i0, " passed, ", i0, " failed")') passed, failed
      if (failed > 0) error stop 1
      if (passed == 0) error stop 'no test was run'
   end subroutine finish

end module check
