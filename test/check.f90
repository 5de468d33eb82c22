!> Counting checks for the one test driver.
module check
   use, intrinsic :: iso_fortran_env, only : error_unit, output_unit
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: begin_suite, check_that, check_close, check_no_error, check_error, finish

   integer :: passed = 0
   integer :: failed = 0
   character(:), allocatable :: suite

contains

   !> Name the suite that the next checks belong to.
   subroutine begin_suite(name)
      character(*), intent(in) :: name

      suite = name
      write (output_unit, '(a)') 'suite '//name
   end subroutine begin_suite

   !> Pass if the condition holds.
   subroutine check_that(condition, what)
      logical, intent(in) :: condition
      character(*), intent(in) :: what

      if (condition) then
         passed = passed + 1
      else
         failed = failed + 1
         write (error_unit, '(a)') 'FAILED '//suite//': '//what
      end if
   end subroutine check_that

   !> Pass if |value - reference| <= tolerance; never passes for NaN.
   subroutine check_close(value, reference, tolerance, what)
      real(dp), intent(in) :: value
      real(dp), intent(in) :: reference
      real(dp), intent(in) :: tolerance     !! absolute
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

   !> Pass if there is an error whose message holds `fragment`.
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

   !> Print the sum and stop with 1 if anything failed.
   subroutine finish()
      write (output_unit, '(i0, " passed, ", i0, " failed")') passed, failed
      if (failed > 0) error stop 1
      if (passed == 0) error stop 'no test was run'
   end subroutine finish

end module check
