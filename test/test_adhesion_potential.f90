!> Tests of the adhesive potentials.
module test_adhesion_potential
   use adhesion_potential, only : adhesion_potential_type, adhesive_curvature, adhesive_energy, &
      adhesive_slope, adhesive_slopes, adhesive_terms, has_smooth_potential, new_adhesion_potential, &
      new_tabulated_potential, stiffens
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
      if (selected('derivatives_match_differences')) then
         call derivatives_match_differences('exponential', -energy/range)
         call derivatives_match_differences('gauss', 0.0_dp)
         call derivatives_match_differences('maugis_dugdale', -energy/range)
         call derivatives_match_differences('maugis_dugdale', -energy/range, edge=0.4_dp*range)
         call derivatives_match_differences('maugis_dugdale', -energy/range, edge=range)
      end if
      if (selected('rows_have_the_values_of_cells')) call rows_have_the_values_of_cells()
      if (selected('bounds_of_the_range')) call bounds_of_the_range()
      if (selected('table')) call table()
      if (selected('table_of_a_line')) call table_of_a_line()
   end subroutine run_adhesion_potential

   !> A row of any length has the attraction, the curvature and the energy of its cells, to round-off: at every part of
   !> the table of the exponential, in blocks with near and with distant cells, and in blocks of distant cells alone.
   !> (The round-off of x = gap/range gives exp(-x) a relative error in proportion to x, and exp(-x**2) one in
   !> proportion to x**2. Values below exp(-40) of the largest are negligible, and are not exact in a row.)
   subroutine rows_have_the_values_of_cells()
      type(adhesion_potential_type) :: potential
      type(error_type), allocatable :: error
      character(14), parameter :: names(3) = [character(14) :: 'exponential', 'gauss', 'maugis_dugdale']
      integer, parameter :: lengths(5) = [1, 2, 63, 64, 2001]
      real(dp), allocatable :: gap(:), slope(:), curvature(:), energies(:), exact(:, :)
      real(dp) :: worst
      integer :: i, k, n, which

      do which = 1, size(names)
         call new_adhesion_potential(potential, trim(names(which)), energy, range, error)
         call check_no_error(error, trim(names(which)))
         worst = 0.0_dp
         do k = 1, size(lengths)
            n = lengths(k)
            ! From 0 to 60 ranges in steps that meet no multiple of the table's; every third cell is distant.
            gap = [(merge(100.0_dp, 60.0_dp*(i - 1)/n, modulo(i, 3) == 0 .and. i < n/2)*range, i=1, n)]
            allocate (slope(n), curvature(n), energies(n), exact(n, 3))
            call adhesive_slopes(potential, gap, slope, curvature, energies)
            call adhesive_terms(potential, gap, exact(:, 1), exact(:, 2), exact(:, 3))
            worst = max(worst, largest(energies, exact(:, 1), energy), largest(slope, exact(:, 2), energy/range), &
               largest(curvature, exact(:, 3), energy/range**2))
            deallocate (slope, curvature, energies, exact)
         end do
         call check_close(worst, 0.0_dp, 8e-16_dp, trim(names(which))//': rows and cells')
      end do

   contains

      !> The largest relative error of the values that are not negligible, and of all values over the unit.
      function largest(found, expected, unit) result(error)
         real(dp), intent(in) :: found(:), expected(:)
         real(dp), intent(in) :: unit
         real(dp) :: error

         error = max(maxval(abs(found - expected))/unit, &
            maxval(abs(found/expected - 1.0_dp)/(1.0_dp + (gap/range)**merge(2, 1, names(which) == 'gauss')), &
            mask=abs(expected) > exp(-40.0_dp)*unit))
      end function largest

   end subroutine rows_have_the_values_of_cells

   !> The attraction of Maugis-Dugdale ends at the range. Wrong names and numbers are reported together.
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

   !> A table of the values of another potential reproduces it to the order of cubic interpolation. Its
   !> energy, slope and curvature are exactly consistent.
   subroutine table()
      type(adhesion_potential_type) :: exact, made
      type(error_type), allocatable :: error
      integer, parameter :: intervals(2) = [100, 200]
      character(11), parameter :: names(2) = ['exponential', 'gauss      ']
      real(dp), parameter :: reach = 10.0_dp*range
      real(dp) :: miss(2), gap, h, e, slope, curvature
      integer :: k, n, pass, which

      do which = 1, 2
         call new_adhesion_potential(exact, trim(names(which)), energy, range, error)
         do pass = 1, 2
            n = intervals(pass)
            call new_tabulated_potential(made, reach/n, [(adhesive_slope(exact, k*reach/n), k=0, n)], &
               [(adhesive_curvature(exact, k*reach/n), k=0, n)], error)
            call check_no_error(error, 'table')
            miss(pass) = 0.0_dp
            do k = 1, 999
               gap = k*reach/1000.0_dp
               miss(pass) = max(miss(pass), abs(adhesive_slope(made, gap) - adhesive_slope(exact, gap)))
            end do
         end do
         call check_that(miss(2) < 1e-6_dp*energy/range .and. miss(2) < miss(1)/12.0_dp, &
            trim(names(which))//': fourth order', miss)
         ! The table neglects exp(-10) of the exponential beyond its end.
         call check_close(made%energy, energy, 1e-4_dp*energy, trim(names(which))//': work of separation')
         h = 1e-3_dp*reach/n
         do k = 1, 20
            gap = (k*0.37_dp + 0.01_dp)*range
            call adhesive_terms(made, gap, e, slope, curvature)
            call check_close(slope, (adhesive_energy(made, gap + h) - adhesive_energy(made, gap - h)) &
               /(2*h), 1e-7_dp*energy/range, trim(names(which))//': slope of the energy')
            call check_close(curvature, (adhesive_slope(made, gap + h) - adhesive_slope(made, gap - h)) &
               /(2*h), 1e-6_dp*energy/range**2, trim(names(which))//': slope of the attraction')
         end do
         call check_close(adhesive_energy(made, reach), 0.0_dp, 0.0_dp, 'nothing beyond the end')
         call check_that(stiffens(made) .eqv. stiffens(exact), trim(names(which))//': stiffens')
         call check_that(has_smooth_potential(made), 'a table is smooth')
      end do
      call check_close(made%range, sqrt(0.5_dp*exp(1.0_dp))*range, 2e-3_dp*range, 'unit of length of gauss')
   end subroutine table

   !> One interval with an attraction that falls linearly, computed by hand. Wrong tables are refused.
   subroutine table_of_a_line()
      type(adhesion_potential_type) :: made
      type(error_type), allocatable :: error

      call new_tabulated_potential(made, 2.0_dp, [6.0_dp, 0.0_dp], [-3.0_dp, -3.0_dp], error)
      call check_no_error(error, 'a line')
      call check_close(adhesive_energy(made, 0.0_dp), -6.0_dp, 1e-14_dp, 'energy of touch')
      call check_close(adhesive_energy(made, 1.0_dp), -1.5_dp, 1e-14_dp, 'energy half way')
      call check_close(adhesive_slope(made, 1.0_dp), 3.0_dp, 1e-14_dp, 'attraction half way')
      call check_close(adhesive_curvature(made, 0.5_dp), -3.0_dp, 1e-14_dp, 'curvature')
      call check_close(made%range, 1.0_dp, 1e-14_dp, 'unit of length')
      call new_tabulated_potential(made, 2.0_dp, [6.0_dp, -1.0_dp], [-3.0_dp, -3.0_dp], error)
      call check_error(error, '0 or more', 'a repulsion')
      call new_tabulated_potential(made, 0.0_dp, [6.0_dp, 0.0_dp], [-3.0_dp, -3.0_dp], error)
      call check_error(error, 'spacing', 'no spacing')
   end subroutine table_of_a_line

   !> e' and e'' against central differences, the values at contact, and the area under e'.
   subroutine derivatives_match_differences(name, release, edge)
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
      ! The work of separation is gamma_0, by the midpoint rule.
      work = 0.0_dp
      n = 4000
      do k = 1, n
         work = work + adhesive_slope(potential, (k - 0.5_dp)*40*range/n)*40*range/n
      end do
      call check_close(work, energy, 1e-4_dp*energy, name//': work of separation')
   end subroutine derivatives_match_differences

end module test_adhesion_potential
