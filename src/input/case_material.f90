!> The `&material` group of a case. Zener branches are converted to Prony arms, and relaxation times to the
!> temperature of the case.
module case_material
   use case_settings, only : material_settings_type
   use input_faults, only : faults_type
   use input_group, only : group_values_type
   use asperity_precision, only : dp
   use prony, only : wlf_shift, zener_to_prony
   use regular_grid, only : boundary_free, grid_type
   use text_tools, only : to_text
   implicit none
   private

   public :: resolve_material

contains

   !> Resolve the group `&material`.
   subroutine resolve_material(group, grid, grid_known, material, faults)
      type(group_values_type), intent(in) :: group
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: grid_known
      type(material_settings_type), intent(out) :: material
      type(faults_type), intent(inout) :: faults
      logical :: arms

      material%poisson = group%real_value('poisson')
      material%shear_modulus = group%real_value('shear_modulus')
      material%thickness = group%real_value('thickness')
      material%density = group%real_value('density')
      material%reference_temperature = group%real_value('reference_temperature')
      material%temperature = group%real_value('temperature', material%reference_temperature)
      material%wlf_c1 = group%real_value('wlf_c1')
      material%wlf_c2 = group%real_value('wlf_c2')

      call resolve_arms(group, material, arms, faults)
      if (.not. arms) then
         call group%demand('shear_modulus', faults)
         if (group%usable('shear_modulus') .and. .not. material%shear_modulus > 0.0_dp) &
            call group%fault('shear_modulus', 'must be a positive number; 0 is allowed only where '// &
            'there are Prony arms or Zener branches', faults)
      end if
      if (material%density > 0.0_dp .and. .not. group%bad('thickness') .and. &
         .not. material%thickness > 0.0_dp) call group%fault('density', &
         'needs a thickness above 0: inertia is that of the block', faults)
      if (grid_known .and. grid%boundary == boundary_free .and. material%thickness > 0.0_dp) &
         call group%fault('thickness', 'needs boundary = ''periodic'': a free patch lies on a half-space', &
         faults)
      call shift_times(group, material, faults)
   end subroutine resolve_material

   !> Read the Prony arms, or convert Zener branches to arms.
   subroutine resolve_arms(group, material, arms, faults)
      type(group_values_type), intent(in) :: group
      type(material_settings_type), intent(inout) :: material
      logical, intent(out) :: arms                     !! arms or branches are given, possibly with faults
      type(faults_type), intent(inout) :: faults
      logical :: prony_given, zener_given
      real(dp), allocatable :: eta(:), g0(:), g1(:)
      real(dp) :: spring

      prony_given = group%given('prony_g') .or. group%given('prony_tau')
      zener_given = group%given('zener_g0') .or. group%given('zener_g1') .or. group%given('zener_eta')
      arms = prony_given .or. zener_given
      allocate (material%prony_g(0), material%prony_tau(0))
      if (prony_given .and. zener_given) then
         call group%group_fault('prony_... and zener_... are given together: give Prony arms or Zener '// &
            'branches', faults)
      end if
      if (prony_given) then
         call group%demand('prony_g', faults, 'prony_tau')
         call group%demand('prony_tau', faults, 'prony_g')
         call same_size('prony_tau', 'prony_g')
         if (.not. both_good('prony_g', 'prony_tau')) return
         material%prony_g = group%reals_value('prony_g')
         material%prony_tau = group%reals_value('prony_tau')
      else if (zener_given) then
         call group%demand('zener_g0', faults, 'a Zener branch')
         call group%demand('zener_g1', faults, 'a Zener branch')
         call group%demand('zener_eta', faults, 'a Zener branch')
         call same_size('zener_g1', 'zener_g0')
         call same_size('zener_eta', 'zener_g0')
         if (.not. (both_good('zener_g0', 'zener_g1') .and. both_good('zener_g0', 'zener_eta'))) return
         allocate (g0, source=group%reals_value('zener_g0'))
         allocate (g1, source=group%reals_value('zener_g1'))
         allocate (eta, source=group%reals_value('zener_eta'))
         deallocate (material%prony_g, material%prony_tau)
         allocate (material%prony_g(size(g0)), material%prony_tau(size(g0)))
         spring = material%shear_modulus
         call zener_to_prony(spring, g0, g1, eta, material%shear_modulus, material%prony_g, &
            material%prony_tau)
      end if

   contains

      !> Report lists of different sizes.
      subroutine same_size(name, other)
         character(*), intent(in) :: name, other

         if (.not. (group%usable(name) .and. group%usable(other))) return
         if (size(group%reals_value(name)) == size(group%reals_value(other))) return
         call group%fault(name, 'must have as many values as '//other//': '// &
            to_text(size(group%reals_value(name)))//' here, '// &
            to_text(size(group%reals_value(other)))//' there', faults)
      end subroutine same_size

      !> Are two lists given, and of the same size?
      logical function both_good(name, other)
         character(*), intent(in) :: name, other

         both_good = group%usable(name) .and. group%usable(other)
         if (both_good) both_good = size(group%reals_value(name)) == size(group%reals_value(other))
      end function both_good

   end subroutine resolve_arms

   !> Shift the relaxation times to the temperature of the case.
   subroutine shift_times(group, material, faults)
      type(group_values_type), intent(in) :: group
      type(material_settings_type), intent(inout) :: material
      type(faults_type), intent(inout) :: faults
      real(dp) :: difference, factor

      if (group%bad('wlf_c1') .or. group%bad('wlf_c2') .or. group%bad('temperature') .or. &
         group%bad('reference_temperature')) return
      if (group%given('wlf_c1') .neqv. group%given('wlf_c2')) then
         call group%group_fault('wlf_c1 and wlf_c2 must be given together', faults)
         return
      end if

      difference = material%temperature - material%reference_temperature
      if (.not. abs(difference) > 0.0_dp) return
      if (.not. group%given('wlf_c1')) then
         if (size(material%prony_tau) > 0) call group%group_fault('temperature = '// &
            to_text(material%temperature)//' is not reference_temperature = '// &
            to_text(material%reference_temperature)//': a shift needs wlf_c1 and wlf_c2', faults)
         return
      end if

      if (.not. material%wlf_c2 + difference > 0.0_dp) then
         call group%fault('temperature', 'is below the range of the WLF shift: it must be above '// &
            'reference_temperature - wlf_c2 = '// &
            to_text(material%reference_temperature - material%wlf_c2), faults)
         return
      end if

      factor = wlf_shift(material%temperature, material%reference_temperature, material%wlf_c1, &
         material%wlf_c2)
      if (.not. (factor > 1.0e-100_dp .and. factor < 1.0e100_dp)) then
         call group%fault('temperature', 'shifts the relaxation times by a factor of '//to_text(factor)// &
            ': it is too far from reference_temperature', faults)
         return
      end if
      material%prony_tau = factor*material%prony_tau
   end subroutine shift_times

end module case_material
