!> Divides the energy that a steady state loses by octaves of the wavelength and by arms of the material.
!>
!> A mode with pressure P^ and traction T^ (module steady_symbols) loses per area and time
!>
!>     w(q) omega Im G*/|G*|^2,    w = A_zz |P^|^2 + conj(T^).A_T T^ for a unit shear modulus,
!>
!> and an arm's part of it is g omega tau/(1 + (omega tau)^2) over Im G*(omega). No further solve is
!> needed. Octave k holds the wavelengths 2 pi/|q| in (L/2^k, L/2^(k-1)], where L is the longest side of the cell.
module steady_losses
   use asperity_precision, only : dp, pi
   use field_sums, only : row_totals
   use regular_grid, only : grid_type
   use steady_symbols, only : medium_type, mode_compliance, mode_waves, steady_modulus
   implicit none
   private

   public :: elastic_forms, longest_wave, steady_losses_type, sum_losses

   !> Rates of loss over the cell, W.
   type :: steady_losses_type
      real(dp) :: normal = 0.0_dp                      !! by the pressure
      real(dp) :: tangential = 0.0_dp                  !! by the traction
      real(dp), allocatable :: octave(:)               !! of both, by octaves, the longest waves first
      real(dp), allocatable :: arm(:)                  !! of both, by arms
   end type steady_losses_type

contains

   !> Number of octaves from the longest wave of a cell to the shortest of its grid.
   pure function count_octaves(grid) result(octaves)
      type(grid_type), intent(in) :: grid
      integer :: octaves
      real(dp) :: shortest

      shortest = 2.0_dp/grid%nx*grid%lx
      if (grid%ny > 1) shortest = 1.0_dp/hypot(0.5_dp*grid%nx/grid%lx, 0.5_dp*grid%ny/grid%ly)
      octaves = octave_of(longest_wave(grid), shortest)
   end function count_octaves

   !> The longest wave of a cell, m.
   pure function longest_wave(grid) result(length)
      type(grid_type), intent(in) :: grid
      real(dp) :: length

      length = grid%lx
      if (grid%ny > 1) length = max(grid%lx, grid%ly)
   end function longest_wave

   !> Number of the octave of a wavelength, from 1.
   pure function octave_of(longest, wavelength) result(octave)
      real(dp), intent(in) :: longest, wavelength      !! m
      integer :: octave

      ! A wave of exactly half the longest one begins the second octave, whatever its round-off.
      octave = 1 + max(0, floor(log(longest/wavelength)/log(2.0_dp) + 1e-9_dp))
   end function octave_of

   !> Number of modes of the whole spectrum that a mode of the half spectrum represents.
   pure function mode_weight(grid, i) result(weight)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: i
      real(dp) :: weight

      weight = 2.0_dp
      if (i == 0 .or. 2*i == grid%nx) weight = 1.0_dp
   end function mode_weight

   !> w of a mode for the normal and for the tangential direction: means over the cell, m Pa.
   pure function elastic_forms(medium, i, j, p, t) result(forms)
      type(medium_type), intent(in) :: medium
      integer, intent(in) :: i, j
      complex(dp), intent(in) :: p                     !! transform of the pressure, sum over the cells
      complex(dp), intent(in) :: t(2)                  !! of the traction
      real(dp) :: forms(2)
      real(dp) :: waves(2, 4), a(3)
      integer :: count

      forms = 0.0_dp
      if (i + j == 0) return
      call mode_waves(medium%grid, i, j, waves, count)
      a = mode_compliance(medium%normal, waves(:, 1), count)
      forms(1) = a(1)*abs(p)**2
      a = mode_compliance(medium%tangential, waves(:, 1), count)
      forms(2) = a(1)*abs(t(1))**2 + a(2)*abs(t(2))**2 + 2.0_dp*a(3)*real(conjg(t(1))*t(2), dp)
      forms = forms*mode_weight(medium%grid, i)/medium%grid%cells()**2
   end function elastic_forms

   !> Compute the losses of a state from the transforms of its pressure and traction. Processes share the wave
   !> numbers along y like the rows of the grid.
   subroutine sum_losses(medium, p, t, losses)
      type(medium_type), intent(in) :: medium
      complex(dp), intent(in) :: p(0:, medium%grid%first_row - 1:)      !! (0:nx/2, 0:ny-1)
      complex(dp), intent(in) :: t(0:, medium%grid%first_row - 1:, :)   !! (0:nx/2, 0:ny-1, 2), or of no extent
      type(steady_losses_type), intent(out) :: losses
      real(dp), allocatable :: rows(:, :), total(:)
      integer :: arms, j, octaves

      arms = size(medium%g)
      octaves = count_octaves(medium%grid)
      allocate (rows(2 + octaves + arms, medium%grid%first_row - 1:medium%grid%last_row - 1))
      !$omp parallel do default(none) shared(medium, p, t, rows, octaves) private(j)
      do j = medium%grid%first_row - 1, medium%grid%last_row - 1
         if (size(t) > 0) then
            call row_losses(medium, j, octaves, p(:, j), rows(:, j), t(:, j, :))
         else
            call row_losses(medium, j, octaves, p(:, j), rows(:, j))
         end if
      end do
      total = row_totals(rows)*medium%grid%area()
      losses%normal = total(1)
      losses%tangential = total(2)
      allocate (losses%octave(octaves), source=total(3:2 + octaves))
      allocate (losses%arm(arms), source=total(3 + octaves:))
   end subroutine sum_losses

   !> Compute the losses of the modes of one row: normal, tangential, octaves, arms.
   subroutine row_losses(medium, j, octaves, p, sums, t)
      type(medium_type), intent(in) :: medium
      integer, intent(in) :: j, octaves
      complex(dp), intent(in) :: p(0:)
      real(dp), intent(out) :: sums(:)
      complex(dp), intent(in), optional :: t(0:, :)
      real(dp) :: forms(2), waves(2, 4), rate, share, arm
      complex(dp) :: traction(2)
      integer :: count, i, k, m, octave

      sums = 0.0_dp
      traction = (0.0_dp, 0.0_dp)
      do i = 0, medium%grid%nx/2
         if (i + j == 0) cycle
         if (present(t)) traction = t(i, :)
         forms = elastic_forms(medium, i, j, p(i), traction)
         call mode_waves(medium%grid, i, j, waves, count)
         octave = octave_of(longest_wave(medium%grid), 2.0_dp*pi/norm2(waves(:, 1)))
         do k = 1, count
            rate = dot_product(waves(:, k), medium%velocity)
            share = 1.0_dp/(count*abs(steady_modulus(medium, rate))**2)
            do m = 1, size(medium%g)
               arm = share*medium%g(m)*rate**2*medium%tau(m)/(1.0_dp + (rate*medium%tau(m))**2)
               sums(1:2) = sums(1:2) + arm*forms
               sums(2 + octave) = sums(2 + octave) + arm*sum(forms)
               sums(2 + octaves + m) = sums(2 + octaves + m) + arm*sum(forms)
            end do
         end do
      end do
   end subroutine row_losses

end module steady_losses
