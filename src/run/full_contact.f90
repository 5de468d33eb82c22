!> Displacements that bring a periodic contact into full contact.
!>
!> The mean displacement of the surface of a periodic half-space does not depend on the pressure. The mean gap is
!> therefore the mean gap at first touch (the summit less the mean height of the road) less the prescribed
!> displacement. A displacement that leaves no mean gap does not determine the pressure.
module full_contact
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use contact_model, only : contact_type
   use field_sums, only : field_mean
   use regular_grid, only : boundary_periodic
   use text_tools, only : to_text
   implicit none
   private

   public :: check_displacements, largest_displacement

   character(*), parameter, public :: limit_in_words = &
      ' m, the mean gap at first touch: beyond it the pressure of a periodic contact is not determined'

contains

   !> The displacement of full contact, m: the mean gap at first touch over the road under the rubber. Collective.
   function largest_displacement(contact) result(displacement)
      class(contact_type), intent(in) :: contact
      real(dp) :: displacement

      displacement = contact%summit - field_mean(contact%height)
   end function largest_displacement

   !> Refuse a case that has to jump to a displacement beyond full contact, before its first row. Collective.
   !>
   !> A ramp to such a displacement is not refused, because it has a solution up to full contact. With friction the
   !> case is not refused either: its surface moves along the road, and the mean height under it is not known before.
   subroutine check_displacements(contact, error)
      class(contact_type), intent(in) :: contact
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      real(dp) :: largest
      integer :: k

      if (allocated(error)) return
      if (contact%grid%boundary /= boundary_periodic .or. contact%frictional) return
      if (.not. any(contact%case%phases%control == 'displacement')) return
      largest = largest_displacement(contact)
      do k = 1, size(contact%case%phases)
         associate (phase => contact%case%phases(k))
            if (phase%control /= 'displacement' .or. phase%linear) cycle
            if (phase%target < largest) cycle
            call fail(error, error_input, contact%case%path//': &phase: displacement = '//to_text(phase%target)// &
               ' m of phase '//to_text(k)//': must be below '//to_text(largest)//limit_in_words)
            return
         end associate
      end do
   end subroutine check_displacements

end module full_contact
