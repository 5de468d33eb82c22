!> Detects numerical stick-slip: a mean slip that jumps up and down from step to step.
!>
!> A period of true stick-slip takes many steps. If the mean slip speed rises and falls alternately from step to
!> step, by a considerable part of the speed of the road, the oscillation is numerical (thesis, section 3.6):
!> pressure and traction respond to each other with a delay of one pass.
module stick_slip_watch
   use asperity_precision, only : dp
   use text_tools, only : to_text
   implicit none
   private

   public :: stick_slip_watch_type, watch_slip

   integer, parameter :: turns_to_report = 6          !! excess of alternations over other steps
   real(dp), parameter :: large = 0.1_dp              !! least change that counts, over the speed of the road

   !> The observations so far.
   type :: stick_slip_watch_type
      logical :: reported = .false.
      real(dp) :: speed = 0.0_dp                      !! of the mean slip, m/s
      real(dp) :: change = 0.0_dp                     !! of it in the step before, m/s
      integer :: turns = 0
   end type stick_slip_watch_type

contains

   !> Observe the mean slip of a step. The message is empty, except when stick-slip is detected for the first time.
   subroutine watch_slip(self, slip_speed, road_speed, passes, density, message)
      type(stick_slip_watch_type), intent(inout) :: self
      real(dp), intent(in) :: slip_speed              !! mean over the surface, m/s
      real(dp), intent(in) :: road_speed              !! m/s, >= 0
      integer, intent(in) :: passes                   !! most passes of a step; 0: as many as needed
      real(dp), intent(in) :: density                 !! of the block, kg/m3; 0: no inertia
      character(:), allocatable, intent(out) :: message
      real(dp) :: change

      message = ''
      change = slip_speed - self%speed
      if (min(abs(change), abs(self%change)) > large*road_speed .and. change*self%change < 0.0_dp) then
         self%turns = self%turns + 1
      else
         self%turns = max(self%turns - 1, 0)
      end if
      self%speed = slip_speed
      self%change = change
      if (self%reported .or. self%turns < turns_to_report) return
      self%reported = .true.
      message = 'the mean slip rises and falls from step to step: numerical stick-slip. '
      if (passes > 0) then
         message = message//'Allow more passes (now '//to_text(passes)//'); if that does not end it, give the '// &
            'block the smallest density that does (now '//to_text(density)//' kg/m3)'
      else
         message = message//'Give the block the smallest density that ends it (now '//to_text(density)//' kg/m3)'
      end if
   end subroutine watch_slip

end module stick_slip_watch
