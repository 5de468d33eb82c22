!> The one driver of the Fortran tests: all suites, or those named on the command line.
program main
   use check, only : finish
   use test_base, only : run_base
   use test_fft_conv, only : run_fft_conv
   use test_prony, only : run_prony
   implicit none

   if (wanted('base')) call run_base()
   if (wanted('fft_conv')) call run_fft_conv()
   if (wanted('prony')) call run_prony()
   call finish()

contains

   !> Is this suite asked for?
   logical function wanted(suite)
      character(*), intent(in) :: suite
      character(64) :: argument
      integer :: i

      wanted = command_argument_count() == 0
      do i = 1, command_argument_count()
         call get_command_argument(i, argument)
         if (argument == suite) wanted = .true.
      end do
   end function wanted

end program main
