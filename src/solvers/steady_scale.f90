!> The scale c of the splitting for steady contact (module `steady_normal`).
!>
!> At the solution, the state of the splitting is z = P in contact and z = -c gap elsewhere, up to a constant. The
!> iteration converges for any c > 0, and fast if both parts of z have about the same size. c is also limited to the
!> range of the compliances of the solid.
module steady_scale
   use asperity_precision, only : dp
   use field_sums, only : cell_count, field_count, field_sum
   use steady_operator, only : steady_operator_type
   implicit none
   private

   public :: bounded_scale, fitting_scale, is_time_to_rescale, misfit

   integer, parameter :: rescaling_iterations(4) = [8, 16, 32, 64]
   real(dp), parameter, public :: largest_misfit = 1.5_dp   !! up to which a change of c would not pay

contains

   !> The scale that fits a state: a typical pressure is twice as large as c times a typical gap. The result is 0 if no
   !> cell touches or none is open.
   function fitting_scale(pressure, gap) result(scale)
      real(dp), intent(in) :: pressure(:, :)           !! Pa
      real(dp), intent(in) :: gap(:, :)                !! zero in contact, m
      real(dp) :: scale                                !! Pa/m
      real(dp) :: open_gap, touching

      touching = field_count(pressure > 0.0_dp)
      open_gap = field_sum(merge(max(gap, 0.0_dp), 0.0_dp, pressure <= 0.0_dp)) &
         /max(cell_count(pressure) - touching, 1.0_dp)
      scale = 0.0_dp
      if (open_gap > 0.0_dp .and. touching > 0.0_dp) &
         scale = 2.0_dp*(field_sum(max(pressure, 0.0_dp))/touching)/open_gap
   end function fitting_scale

   !> May c change in this iteration? Each change spoils the acceleration, so that it is only considered a few times.
   pure logical function is_time_to_rescale(iteration)
      integer, intent(in) :: iteration

      is_time_to_rescale = any(iteration == rescaling_iterations)
   end function is_time_to_rescale

   !> Limit c to the range of the compliances.
   pure function bounded_scale(operator, c) result(limited)
      type(steady_operator_type), intent(in) :: operator
      real(dp), intent(in) :: c                        !! Pa/m
      real(dp) :: limited

      limited = min(max(c, 0.02_dp/operator%largest_compliance), 50.0_dp/operator%least_compliance)
   end function bounded_scale

   !> The factor by which two scales differ; 1 if one of them is not known.
   pure function misfit(a, b) result(factor)
      real(dp), intent(in) :: a, b                     !! Pa/m
      real(dp) :: factor

      factor = 1.0_dp
      if (a > 0.0_dp .and. b > 0.0_dp) factor = max(a/b, b/a)
   end function misfit

end module steady_scale
