!> A note on roads that slide exactly along an axis of the periodic map.
!>
!> After sliding by one side of the map, an asperity meets the footprint that it has left in the rubber itself.
!> On a long road it would meet the footprints of others. If the rubber has not recovered by then, the
!> friction therefore depends on the size of the map. In an oblique direction the footprints of successive laps
!> lie beside each other.
module footprint_advice
   use asperity_precision, only : dp
   use case_settings, only : case_type
   use regular_grid, only : boundary_periodic
   use text_tools, only : to_text
   implicit none
   private

   public :: footprint_note

   real(dp), parameter :: recovered = 3.0_dp     !! recovery times after which the footprint is small

contains

   !> The note for the first phase that it concerns, without a line end; empty if there is no such phase.
   pure function footprint_note(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      real(dp) :: speed(2), lap, recovery
      integer :: i

      text = ''
      if (case%grid%boundary /= boundary_periodic .or. case%grid%ny < 2) return
      if (size(case%material%prony_tau) == 0 .or. case%material%shear_modulus <= 0.0_dp) return
      ! Under a constant load an arm recovers more slowly than it relaxes, at most by this factor.
      recovery = maxval(case%material%prony_tau)*(1.0_dp + sum(case%material%prony_g) &
         /case%material%shear_modulus)
      do i = 1, size(case%phases)
         speed = abs([case%phases(i)%velocity_x, case%phases(i)%velocity_y])
         if (minval(speed) > 0.0_dp .or. .not. maxval(speed) > 0.0_dp) cycle
         lap = merge(case%grid%lx, case%grid%ly, speed(1) > 0.0_dp)
         if (.not. case%phases(i)%steady .and. maxval(speed)*case%phases(i)%duration <= lap) cycle
         if (lap/maxval(speed) >= recovered*recovery) cycle
         text = 'phase '//to_text(i)//' slides along an axis: after '//to_text(lap/maxval(speed))// &
            ' s the rubber meets its own footprint, which takes up to '//to_text(recovery)// &
            ' s to recover; an oblique velocity avoids it'
         return
      end do
   end function footprint_note

end module footprint_advice
