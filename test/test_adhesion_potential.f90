!> Tests of the adhesive potentials.
module test_adhesion_potential
   use adhesion_potential, only : adhesion_potential_type, adhesive_curvature, adhesive_energy, &
      adhesive_slope, adhesive_terms, new_adhesion_potential
   use check, only : begin_suite, check_close, check_error, check_no_error, check_that, selected
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: run_adhesion_potential

   real(dp), parameter :: energy = 0.05_dp, range = 2e-9_dp

contains

   subroutine run_adhesion_potential()
      call begin_suite('adhesion_potential')
      if (selected('test_derivatives')) call test_derivatives('exponential', -energy/range)
      if (selected('test_derivatives')) call test_derivatives('gauss', 0.0_dp)
      if (selected('test_derivatives')) call test_derivatives('maugis_dugdale', -energy/range)
      if (selected('test_derivatives')) call test_derivatives('maugis_dugdale', -energy/range, edge=0.4_dp*range)
      if (selected('test_derivatives')) call test_derivatives('maugis_dugdale', -energy/range, edge=range)
      if (selected('bounds_of_the_range')) call bounds_of_the_range()
   end subroutine run_adhesion_potential

   !> The attraction of Maugis-Dugdale ends at the range; wrong names and numbers are refused together.
   subroutine bounds_of_the_range()
      type(adhesion_potential_type) :: potential
      type(error_type), allocatable :: error

      call new_adhesion_potential(potential, 'maugis_dugdale', energy, range, error)
      call check_close(adhesive_slope(potential, 0.999_dp*range), energy/range, 0.0_dp, 'inside')
      call check_close(adhesive_slope(potential, 1.001_dp*range), 0.0_dp, 0.0_dp, 'outside')
      call new_adhesion_potential(potential, 'none', -1.0_dp, 0.0_dp, error)
      call check_no_error(error, 'none needs no numbers')
      call check_close(adhesive_energy(potential, 0.0_dp), 0.0_dp, 0.0_dp, 'none has no energy')
      call check_close(-adhesive_slope(potential, 0.0_dp), 0.0_dp, 0.0_dp, 'none lets go at zero')
      call new_adhesion_potential(potential, 'lennard', energy, range, error)
      call check_error(error, 'maugis_dugdale', 'unknown potential')
      call new_adhesion_potential(potential, 'gauss', -1.0_dp, 0.0_dp, error)
      call check_error(error, 'energy', 'negative energy')
      call check_error(error, 'range', 'range of zero, in the same message')
   end subroutine bounds_of_the_range

   !> e' and e'' against central differences, the values at contact, and the area under e'.
   subroutine test_derivatives(name, release, edge)
      character(*), intent(in) :: name
      real(dp), intent(in) :: release          !! -e'(0+), Pa
      real(dp), intent(in), optional :: edge   !! m
      type(adhesion_potential_type) :: potential
      type(error_type), allocatable :: error
      real(dp) :: gap, h, e, slope, curvature, work
      integer :: k, n

      call new_adhesion_potential(potential, name, energy, range, error, edge)
      call check_no_error(error, name)
      h = 1e-4_dp*range
      do k = 0, 12
         gap = (0.05_dp + 0.3_dp*k)*range
         ! Central differences: error h^2/6 e'''/e' of about 1e-8, and round-off of 1e-12.
         call check_close(adhesive_slope(potential, gap), &
            (adhesive_energy(potential, gap + h) - adhesive_energy(potential, gap - h))/(2*h), &
            1e-7_dp*energy/range, name//': slope')
         call check_close(adhesive_curvature(potential, gap), &
            (adhesive_slope(potential, gap + h) - adhesive_slope(potential, gap - h))/(2*h), &
            1e-7_dp*energy/range**2, name//': curvature')
         call adhesive_terms(potential, gap, e, slope, curvature)
         call check_that(abs(e - adhesive_energy(potential, gap)) <= 1e-14_dp*energy .and. &
            abs(slope - adhesive_slope(potential, gap)) <= 1e-14_dp*energy/range .and. &
            abs(curvature - adhesive_curvature(potential, gap)) <= 1e-14_dp*energy/range**2, &
            name//': all at once')
      end do
      call check_close(adhesive_energy(potential, 0.0_dp), -energy, 1e-15_dp, name//': contact')
      call check_close(-adhesive_slope(potential, 0.0_dp), release, 1e-6_dp, name//': release')
      call check_close(adhesive_slope(potential, 0.0_dp), -release, 1e-6_dp, name//': slope there')
      call check_close(adhesive_energy(potential, 50*range), 0.0_dp, 0.0_dp, name//': far away')
      ! The work of separation is gamma_0: midpoint rule.
      work = 0.0_dp
      n = 4000
      do k = 1, n
         work = work + adhesive_slope(potential, (k - 0.5_dp)*40*range/n)*40*range/n
      end do
      call check_close(work, energy, 1e-4_dp*energy, name//': work of separation')
   end subroutine test_derivatives

end module test_adhesion_potential
