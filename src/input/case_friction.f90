!> The `&friction` group of a case. The law itself knows which variables it needs.
module case_friction
   use asperity_precision, only : dp
   use case_settings, only : friction_settings_type
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use shear_laws, only : law_uses, law_variables
   use text_tools, only : to_text
   implicit none
   private

   public :: resolve_friction, unused_variable

contains

   !> Resolve the group `&friction`.
   subroutine resolve_friction(group, friction, faults)
      type(group_values_type), intent(in) :: group
      type(friction_settings_type), intent(inout) :: friction
      type(faults_type), intent(inout) :: faults
      logical :: given
      integer :: i

      friction%law = group%text_value('law')
      friction%coefficient = group%real_value('coefficient')
      friction%shear_strength = group%real_value('shear_strength')
      friction%slope_effect = group%logical_value('slope_effect')
      if (friction%law == '') friction%law = 'none'
      if (group%bad('law')) return
      given = group%given('slope_effect')
      do i = 1, size(law_variables)
         if (law_uses(friction%law, law_variables(i))) &
            call group%demand(trim(law_variables(i)), faults, trim(friction%law))
         given = given .or. group%given(trim(law_variables(i)))
      end do
      if (given .and. .not. group%given('law')) call group%fault('law', 'is missing', faults)
      if (friction%law == 'table') call resolve_table(group, friction, faults)
   end subroutine resolve_friction

   !> Read and check the points of a law that is given by a table.
   subroutine resolve_table(group, friction, faults)
      type(group_values_type), intent(in) :: group
      type(friction_settings_type), intent(inout) :: friction
      type(faults_type), intent(inout) :: faults
      real(dp), allocatable :: pressures(:), strengths(:)
      integer :: n

      if (friction%slope_effect .and. .not. group%bad('slope_effect')) call group%fault('slope_effect', &
         'must be .false. with law = ''table'': a bound that is not linear in the pressure is not solved on '// &
         'the slope of the road', faults)
      if (.not. (group%usable('table_pressure') .and. group%usable('table_strength'))) return
      allocate (pressures, source=group%reals_value('table_pressure'))
      allocate (strengths, source=group%reals_value('table_strength'))
      n = size(pressures)
      if (n < 2) then
         call group%fault('table_pressure', 'must have two values or more', faults)
      else if (pressures(1) > 0.0_dp) then
         call group%fault('table_pressure', 'must begin with 0', faults)
      else if (any(pressures(2:) <= pressures(:n - 1))) then
         call group%fault('table_pressure', 'must rise from value to value', faults)
      else if (size(strengths) /= n) then
         call group%fault('table_strength', 'must have as many values as table_pressure: '// &
            to_text(size(strengths))//' here, '//to_text(n)//' there', faults)
      else
         allocate (friction%table(n, 2))
         friction%table(:, 1) = pressures
         friction%table(:, 2) = strengths
      end if
   end subroutine resolve_table

   !> A warning about a variable that is given although the law does not use it; otherwise empty.
   function unused_variable(group, law, name) result(warning)
      type(group_values_type), intent(in) :: group
      character(*), intent(in) :: law
      character(*), intent(in) :: name           !! one of `law_variables`
      character(:), allocatable :: warning
      character(:), allocatable :: value

      warning = ''
      if (law == 'none' .or. .not. group%given(name)) return
      if (law_uses(law, name)) return
      value = ''
      if (size(group%reals_value(name)) == 1) value = ' = '//to_text(group%real_value(name))
      warning = '&friction: '//name//value//' has no effect: law = '''//law//''' does not use it'
   end function unused_variable

end module case_friction
