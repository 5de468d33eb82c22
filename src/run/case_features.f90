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

         call missing(case%solver%precision == 'mixed', '&solver: precision = ''mixed''', 'mixed precision')

   contains

      !> Report a feature if it is asked for.
      subroutine missing(asked, place, what)
         logical, intent(in) :: asked
         character(*), intent(in) :: place, what

         if (asked) call faults%add(place, what//' is not available yet')
      end subroutine missing

   end subroutine check_features

end module case_features
