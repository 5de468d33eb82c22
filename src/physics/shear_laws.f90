!> The friction laws by name: the only place that knows all of them.
module shear_laws
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use asperity_precision, only : dp
   use constant_shear_law, only : new_constant_shear_law
   use coulomb_law, only : new_coulomb_law
   use coulomb_orowan_law, only : new_coulomb_orowan_law
   use shear_law, only : shear_law_type
   use table_law, only : new_table_law
   implicit none
   private

   public :: choose_shear_law, law_uses

   !> The values that the variable `law` may have.
   character(*), parameter, public :: shear_law_words = &
      '''none'' | ''coulomb'' | ''constant_shear'' | ''coulomb_orowan'' | ''table'''
   !> The variables of the group &friction that some law needs.
   character(*), parameter, public :: law_variables(4) = [character(14) :: 'coefficient', 'shear_strength', &
      'table_pressure', 'table_strength']

contains

   !> Make a law from its name and constants. An unknown name gives a law that is not legal, whose bounds are not numbers.
   subroutine choose_shear_law(name, coefficient, strength, law, table)
      character(*), intent(in) :: name             !! one of the words; 'none' makes Coulomb's law, which is not used
      real(dp), intent(in) :: coefficient          !! mu >= 0
      real(dp), intent(in) :: strength             !! sigma_max >= 0, Pa
      class(shear_law_type), allocatable, intent(out) :: law
      real(dp), intent(in), optional :: table(:, :)     !! [n, 2] pressures and bounds, Pa, of 'table'

      select case (name)
      case ('constant_shear')
         allocate (law, source=new_constant_shear_law(strength))
      case ('coulomb_orowan')
         allocate (law, source=new_coulomb_orowan_law(coefficient, strength))
      case ('table')
         allocate (law, source=new_table_law(table))
      case ('coulomb', 'none')
         allocate (law, source=new_coulomb_law(coefficient))
      case default
         allocate (law, source=new_coulomb_law(ieee_value(coefficient, ieee_quiet_nan)))
      end select
   end subroutine choose_shear_law

   !> Does a law need a variable of the group &friction?
   function law_uses(name, variable) result(yes)
      character(*), intent(in) :: name             !! one of the words
      character(*), intent(in) :: variable
      logical :: yes
      class(shear_law_type), allocatable :: law

      call choose_shear_law(name, 0.0_dp, 0.0_dp, law)
      yes = name /= 'none' .and. law%uses(variable)
   end function law_uses

end module shear_laws
