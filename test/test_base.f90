!> Tests of the errors, the grid and the version.
module test_base
   use, intrinsic :: iso_c_binding, only : c_int
   use check, only : begin_suite, check_close, check_error, check_that, selected
   use asperity_errors, only : add_fault, error_file, error_input, error_type, fail
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, grid_type, new_grid
   use asperity_version, only : version_number
   use trial_process, only : trial_type
   implicit none
   private

   public :: run_base

   interface
      function c_raise(number) bind(c, name='raise') result(status)
         import :: c_int
         integer(c_int), value :: number
         integer(c_int) :: status
      end function c_raise
   end interface

contains

   subroutine run_base()
      call begin_suite('base')
      if (selected('basic_values')) call basic_values()
      if (selected('verdicts_of_trials')) call verdicts_of_trials()
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

   !> A file is damaged if the trial crashes, but not if a signal such as that of Ctrl-C ends it.
   subroutine verdicts_of_trials()
      type(error_type), allocatable :: error
      integer, parameter :: from_outside(4) = [1, 2, 9, 15]       !! SIGHUP, SIGINT, SIGKILL, SIGTERM
      integer, parameter :: crashes(4) = [4, 6, 8, 11]            !! SIGILL, SIGABRT, SIGFPE, SIGSEGV
      integer :: k

      call try(0, error)
      call check_that(.not. allocated(error), 'a trial that ends')
      do k = 1, size(from_outside)
         call try(from_outside(k), error)
         call check_that(.not. allocated(error), 'a trial that a signal from outside ends')
      end do
      do k = 1, size(crashes)
         call try(crashes(k), error)
         call check_error(error, 'map.h5: the file is damaged: HDF5 crashes', 'a trial that crashes')
      end do
   end subroutine verdicts_of_trials

   !> Make a trial that a signal ends, or none for 0.
   subroutine try(signal, error)
      integer, intent(in) :: signal
      type(error_type), allocatable, intent(out) :: error
      type(trial_type) :: trial
      integer(c_int) :: status

      call trial%start(10)
      if (trial%is_copy) then
         if (signal > 0) status = c_raise(int(signal, c_int))
         call trial%leave()
      end if
      call trial%verdict('map.h5', error)
   end subroutine try

end module test_base
