!> Changes the load, the velocity of the road or the temperature of a simulation between two rows.
!>
!> A new value holds from the next row on, for the present phase and all later ones, and replaces their own
!> settings; their durations and steps do not change. Within a phase the new load is reached at the end of the
!> next step. If a load is set before a phase begins, the phase begins with a jump, as with `ramp = 'step'`.
module steering
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use prony, only : wlf_shift
   use asperity_schedule, only : change_load, change_velocity
   use asperity_simulation, only : simulation_type
   use text_tools, only : to_text
   implicit none
   private

   public :: steer_load, steer_temperature, steer_velocity

contains

   !> Prescribe a load.
   subroutine steer_load(sim, control, load, error)
      type(simulation_type), intent(inout) :: sim
      character(*), intent(in) :: control             !! 'pressure' | 'force' | 'displacement'
      real(dp), intent(in) :: load                    !! Pa, N or m
      type(error_type), allocatable, intent(out) :: error

      if (.not. ieee_is_finite(load)) then
         call fail(error, error_input, control//' = '//to_text(load)//': must be a finite number')
      else if (control /= 'displacement' .and. sim%case%adhesion%potential == 'none' .and. &
         .not. load > 0.0_dp) then
         call fail(error, error_input, control//' = '//to_text(load)// &
            ': must be positive without adhesion')
      else
         call change_load(sim%state%schedule, sim%case%phases, control, load)
      end if
   end subroutine steer_load

   !> Prescribe the velocity of the road.
   subroutine steer_velocity(sim, velocity, error)
      type(simulation_type), intent(inout) :: sim
      real(dp), intent(in) :: velocity(2)             !! along x and y, m/s
      type(error_type), allocatable, intent(out) :: error

      if (.not. all(ieee_is_finite(velocity))) then
         call fail(error, error_input, 'velocity = ('//to_text(velocity(1))//', '// &
            to_text(velocity(2))//'): must be two finite numbers')
      else if (.not. sim%slides) then
         call fail(error, error_input, 'velocity: the road cannot move, because no phase of the case '// &
            'has a duration or moves it')
      else
         call change_velocity(sim%state%schedule, sim%case%phases, velocity, &
            [sim%state%row%road_x, sim%state%row%road_y])
      end if
   end subroutine steer_velocity

   !> Change the temperature of the rubber, which shifts its relaxation times by the WLF law.
   subroutine steer_temperature(sim, temperature, start_temperature, start_tau, error)
      type(simulation_type), intent(inout) :: sim
      real(dp), intent(in) :: temperature             !! C
      real(dp), intent(in) :: start_temperature       !! of the case, C
      real(dp), intent(in) :: start_tau(:)            !! relaxation times at that temperature, s
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: factor

      associate (material => sim%case%material)
         if (size(material%prony_tau) == 0) then
            call fail(error, error_input, 'temperature: the material is elastic: it has no '// &
               'relaxation times to shift')
         else if (.not. material%wlf_c2 > 0.0_dp) then
            call fail(error, error_input, 'temperature: the case needs wlf_c1 and wlf_c2')
         else if (.not. (ieee_is_finite(temperature) .and. &
            temperature > material%reference_temperature - material%wlf_c2)) then
            call fail(error, error_input, 'temperature = '//to_text(temperature)// &
               ': must be above reference_temperature - wlf_c2 = '// &
               to_text(material%reference_temperature - material%wlf_c2))
         end if
         if (allocated(error)) return
         factor = shift(temperature)/shift(start_temperature)
         if (.not. (factor > 1.0e-100_dp .and. factor < 1.0e100_dp)) then
            call fail(error, error_input, 'temperature = '//to_text(temperature)// &
               ': must shift the relaxation times by a factor between 1e-100 and 1e100; the factor grows without '// &
               'limit towards reference_temperature - wlf_c2 = '// &
               to_text(material%reference_temperature - material%wlf_c2))
            return
         end if
         material%temperature = temperature
         material%prony_tau = factor*start_tau
         sim%material%tau = factor*start_tau
         if (sim%has_steady) sim%steady%medium%tau = factor*start_tau
      end associate

   contains

      !> The WLF factor of the case's material.
      function shift(at) result(factor_there)
         real(dp), intent(in) :: at
         real(dp) :: factor_there

         associate (m => sim%case%material)
            factor_there = wlf_shift(at, m%reference_temperature, m%wlf_c1, m%wlf_c2)
         end associate
      end function shift

   end subroutine steer_temperature

end module steering
