!> The memory of the arms in a state of steady sliding, from which a run continues in time.
!>
!> S = P/G* is the traction that would hold the displacement in an elastic solid of unit modulus (module `zener`). In
!> each mode arm k then has the traction p_k = g_k i omega tau_k/(1 + i omega tau_k) S, and likewise for T. A time step
!> dt earlier the fields were the same, but shifted by -V dt: S_old = rho S with rho = exp(i q.V dt). The first step in
!> time thus has a step before it.
module steady_memory
   use asperity_parallel, only : any_process, global_sum
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   use steady_losses, only : elastic_forms
   use steady_operator, only : steady_operator_type
   use steady_symbols, only : medium_type, mode_waves, steady_modulus
   use viscoelastic_energy, only : energy_books_type, book_state
   use arm_state, only : arm_state_type
   implicit none
   private

   public :: set_books, set_arm_state

   integer, parameter :: whole = 0           !! response of S; k > 0: of arm k
   integer, parameter :: increment = -1      !! response of S - S_old

contains

   !> Set the state of the arms for one component of a field of tractions.
   subroutine set_arm_state(operator, medium, dt, field, component, arms)
      type(steady_operator_type), intent(inout) :: operator
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: dt                       !! of the step to come, s; 0: none
      real(dp), intent(in) :: field(:, :)              !! P or a component of T, Pa
      integer, intent(in) :: component
      type(arm_state_type), intent(inout) :: arms
      real(dp), allocatable :: result(:, :)
      complex(dp), allocatable :: modulus(:, :)        !! G* of the modes, Pa: common to all responses
      integer :: i, j, k, shape_1d(1)

      if (size(medium%g) == 0) return
      allocate (result(size(field, 1), size(field, 2)))
      allocate (modulus(operator%first:operator%last, 0:operator%ny - 1), source=(0.0_dp, 0.0_dp))
      !$omp parallel do default(none) shared(modulus, medium, operator) private(i, j)
      do j = 0, operator%ny - 1
         do i = operator%first, min(operator%last, operator%nx/2)
            modulus(i, j) = mode_modulus(medium, i, j)
         end do
      end do

      shape_1d = size(field)
      call respond(whole)
      arms%s(:, component) = reshape(result, shape_1d)
      ! A process without rows must take part.
      if (any_process(size(arms%ds) > 0)) then
         call respond(increment)
         arms%ds(:, component) = reshape(result, shape_1d)
      end if
      do k = 1, size(medium%g)
         call respond(k)
         arms%arm(:, k, component) = reshape(result, shape_1d)
      end do

   contains

      !> Multiply the modes of a field by a response and transform back.
      subroutine respond(which)
         integer, intent(in) :: which
         complex(dp), allocatable :: table(:, :)

         allocate (table(operator%first:operator%last, 0:operator%ny - 1), source=(0.0_dp, 0.0_dp))
         !$omp parallel do default(none) shared(table, modulus, medium, dt, which, operator) private(i, j)
         do j = 0, operator%ny - 1
            do i = operator%first, min(operator%last, operator%nx/2)
               table(i, j) = response(medium, dt, which, i, j, modulus(i, j))
            end do
         end do
         call operator%apply_table(table, field, result)
      end subroutine respond

   end subroutine set_arm_state

   !> G* of a mode, at the first of the wave vectors that it represents.
   pure function mode_modulus(medium, i, j) result(modulus)
      type(medium_type), intent(in) :: medium
      integer, intent(in) :: i, j
      complex(dp) :: modulus                           !! Pa
      real(dp) :: waves(2, 4)
      integer :: count

      call mode_waves(medium%grid, i, j, waves, count)
      modulus = steady_modulus(medium, dot_product(waves(:, 1), medium%velocity))
   end function mode_modulus

   !> The response of a mode over its traction: the mean over the wave vectors that it represents.
   pure function response(medium, dt, which, i, j, first_modulus) result(ratio)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: dt
      integer, intent(in) :: which                     !! whole, increment or the number of an arm
      integer, intent(in) :: i, j
      complex(dp), intent(in) :: first_modulus         !! `mode_modulus`, which is costly with many arms, Pa
      complex(dp) :: ratio
      complex(dp) :: modulus, part
      real(dp) :: waves(2, 4), rate
      integer :: count, k

      call mode_waves(medium%grid, i, j, waves, count)
      ratio = (0.0_dp, 0.0_dp)
      do k = 1, count
         rate = dot_product(waves(:, k), medium%velocity)
         modulus = first_modulus
         if (k > 1) modulus = steady_modulus(medium, rate)
         part = 1.0_dp/(count*modulus)
         if (which == increment) part = part*(1.0_dp - exp(cmplx(0.0_dp, rate*dt, dp)))
         if (which > whole) part = part*medium%g(which)*arm_ratio(-rate*medium%tau(which))
         ratio = ratio + part
      end do
   end function response

   !> i x/(1 + i x) without overflow.
   pure function arm_ratio(x) result(ratio)
      real(dp), intent(in) :: x                        !! omega tau
      complex(dp) :: ratio

      if (abs(x) > 1.0_dp) then
         ratio = 1.0_dp/cmplx(1.0_dp, -1.0_dp/x, dp)
      else
         ratio = cmplx(0.0_dp, x, dp)/cmplx(1.0_dp, x, dp)
      end if
   end function arm_ratio

   !> Set the stored energy, and the sums that the books keep from the last step. Either `p` or `t` has an extent.
   subroutine set_books(medium, dt, p, t, books)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: dt
      complex(dp), intent(in) :: p(0:, medium%grid%first_row - 1:)      !! transform of the pressure, or of no extent
      complex(dp), intent(in) :: t(0:, medium%grid%first_row - 1:, :)   !! of the traction, or of no extent
      type(energy_books_type), intent(inout) :: books
      real(dp), allocatable :: rows(:, :), total(:)
      real(dp) :: area, mean(1)
      integer :: arms, j

      arms = size(medium%g)
      allocate (rows(2 + 2*arms, medium%grid%first_row - 1:medium%grid%last_row - 1))
      !$omp parallel do default(none) shared(medium, dt, p, t, rows) private(j)
      do j = medium%grid%first_row - 1, medium%grid%last_row - 1
         if (size(p) > 0) then
            call row_products(medium, dt, j, rows(:, j), p=p(:, j))
         else
            call row_products(medium, dt, j, rows(:, j), t=t(:, j, :))
         end if
      end do
      total = row_totals(rows)
      ! The mean mode is in the first row.
      mean = 0.0_dp
      if (size(t) > 0 .and. medium%grid%first_row == 1) mean = sum(abs(t(0, 0, :))**2)
      mean = global_sum(mean)
      if (mean(1) > 0.0_dp) total(1) = total(1) + medium%tangential%mean_mode*mean(1) &
         /medium%grid%cells()**2/medium%modulus**2
      area = medium%grid%area()
      call book_state(books, medium%modulus, medium%g, area*total(1), area*total(2), &
         area*total(3:2 + arms), area*total(3 + arms:))
   end subroutine set_books

   !> Form the sums over the modes of a row, per area: U.S, dU.dS, and for each arm m_k.p_k and p_k.dU.
   subroutine row_products(medium, dt, j, sums, p, t)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: dt
      integer, intent(in) :: j
      real(dp), intent(out) :: sums(:)
      complex(dp), intent(in), optional :: p(0:)
      complex(dp), intent(in), optional :: t(0:, :)
      complex(dp) :: pressure, traction(2), change, arm, modulus
      real(dp) :: form
      integer :: arms, i, k

      arms = size(medium%g)
      sums = 0.0_dp
      pressure = (0.0_dp, 0.0_dp)
      traction = (0.0_dp, 0.0_dp)
      do i = 0, medium%grid%nx/2
         if (present(p)) pressure = p(i)
         if (present(t)) traction = t(i, :)
         form = sum(elastic_forms(medium, i, j, pressure, traction))
         modulus = mode_modulus(medium, i, j)
         change = response(medium, dt, increment, i, j, modulus)
         sums(1) = sums(1) + form*abs(response(medium, dt, whole, i, j, modulus))**2
         sums(2) = sums(2) + form*abs(change)**2
         do k = 1, arms
            arm = response(medium, dt, k, i, j, modulus)
            sums(2 + k) = sums(2 + k) + form*abs(arm)**2
            sums(2 + arms + k) = sums(2 + arms + k) + form*real(conjg(arm)*change, dp)
         end do
      end do
   end subroutine row_products

end module steady_memory
