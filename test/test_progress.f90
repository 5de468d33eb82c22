!> Tests of the lines about the progress of a run.
module test_progress
   use check, only : begin_suite, check_order, check_that, selected
   use history_row, only : history_row_type
   use asperity_precision, only : dp
   use asperity_progress, only : duration_text, progress_line
   implicit none
   private

   public :: run_progress

contains

   subroutine run_progress()
      call begin_suite('progress')
      if (selected('texts_of_progress')) call texts_of_progress()
   end subroutine run_progress

   !> Durations and progress lines are written for people to read.
   subroutine texts_of_progress()
      type(history_row_type) :: row

      call check_that(duration_text(0.0_dp) == '0 s', 'nothing')
      call check_that(duration_text(59.4_dp) == '59 s', 'seconds')
      call check_that(duration_text(59.6_dp) == '1 min 0 s', 'rounded up to a minute')
      call check_that(duration_text(3725.0_dp) == '1 h 2 min', 'hours')
      call check_that(duration_text(90000.0_dp) == '1 d 1 h', 'days')
      call check_that(duration_text(huge(1.0_dp)) /= '', 'for ever')

      row%step = 9
      row%time = 0.0125_dp
      row%contact_area = 0.25_dp
      row%friction = 0.5_dp
      row%iterations_normal = 12
      row%iterations_tangential = 7
      call check_that(progress_line(row, 101, 0, 2.0_dp, .false.) == 'step 9/100  time 1.250E-02 s  '// &
         'area 0.2500  friction  0.5000  iterations 12+7  5.0 steps/s  18 s left', 'a line')
      call check_that(progress_line(row, 101, 0, 2.0_dp, .true.) == 'step 9/100  1.250E-02 s  '// &
         'area 0.2500  friction  0.5000  18 s left', 'a line of a terminal')
      call check_order(index(progress_line(row, 101, 5, 50.0_dp, .false.), '10.0 s/step  15 min 10 s left'), '>', 0, &
         'a slow run that is continued')
      row%step = 100
      call check_that(index(progress_line(row, 101, 0, 2.0_dp, .true.), 'left') == 0, 'the last step')
      call check_that(index(progress_line(row, 101, 0, 0.0_dp, .false.), 'step 100/100') == 1, 'no time yet')
   end subroutine texts_of_progress

end module test_progress
