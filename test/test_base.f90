!> Tests of the errors, the grid and the version.
module test_base
   use check, only : begin_suite, check_close, check_error, check_that, selected
   use asperity_errors, only : add_fault, error_file, error_input, error_type, fail
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, grid_type, new_grid
   use asperity_version, only : version_number
   implicit none
   private

   public :: run_base

contains

   subroutine run_base()
      call begin_suite('base')
      if (selected('basic_values')) call basic_values()
   end subroutine run_base

   !> Faults are collected in their order, a grid has the right cells, and the version is a number.
   subroutine basic_values()
      type(error_type), allocatable :: error
      type(grid_type) :: grid

      call fail(error, error_file, 'first')
      call add_fault(error, error_input, 'second')
      call check_error(error, 'first'//new_line('a')//'second', 'faults are collected')
      call check_that(error%status == error_file, 'the status is that of the first fault')
      grid = new_grid(6, 4, 3.0_dp, 1.0_dp, boundary_free)
      call check_close(grid%dx, 0.5_dp, 0.0_dp, 'dx')
      call check_close(grid%dy, 0.25_dp, 0.0_dp, 'dy')
      call check_that(grid%first_row == 1 .and. grid%last_row == 4, 'one process has all rows')
      call check_that(verify(version_number, '0123456789.abcrdev') == 0, 'the version is a number')
   end subroutine basic_values

end module test_base
