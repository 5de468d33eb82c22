!> What the input can ask for and the program does not do yet.
module case_features
   use case_settings, only : case_type
   use input_faults, only : faults_type
   use precision, only : dp
   implicit none
   private

   public :: check_features

contains

   !> Report every setting that is not available yet. A feature is switched on by deleting its line.
   subroutine check_features(case, faults)
      type(case_type), intent(in) :: case
      type(faults_type), intent(inout) :: faults

      associate (m => case%material, a => case%adhesion, f => case%friction, p => case%phases)
         call missing(size(m%prony_g) > 0, '&material', 'a viscoelastic material (Prony arms, Zener branches)')
         call missing(a%potential /= 'none', '&adhesion: potential = '//trim(a%potential), 'adhesion')
         call missing(f%law /= 'none', '&friction: law = '//trim(f%law), 'friction')
         call missing(any(.not. p%static), '&phase: duration', 'a phase with a duration')
         call missing(any(abs(p%velocity_x) + abs(p%velocity_y) > 0.0_dp), '&phase: velocity', 'sliding')
         call missing(case%solver%precision == 'mixed', '&solver: precision = ''mixed''', 'mixed precision')
      end associate

   contains

      !> Report a feature if it is asked for.
      subroutine missing(asked, place, what)
         logical, intent(in) :: asked
         character(*), intent(in) :: place, what

         if (asked) call faults%add(place, what//' is not available yet')
      end subroutine missing

   end subroutine check_features

end module case_features
