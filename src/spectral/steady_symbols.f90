!> The complex compliances of a solid in steady sliding, for modes that move with the road.
!>
!> In steady sliding every field keeps its shape and moves with the road's velocity V over the rubber,
!> f(X, t) = f(X - V t). A mode exp(i q.X) therefore oscillates at omega = -q.V, and the elastic
!> compliances A of a kernel (module `kernels`) are divided by the complex modulus G*(omega):
!>
!>     U_z = K P,    K = A/G* of the normal kernel
!>     U_T = A_T T,  A_T = A/G* of the tangential kernel
!>     the slip speed of the road over the rubber is V + (V.grad) U_T = |V| (e + dU_T/ds), e = V/|V|
!>
!> so the derivative along the motion is the symbol i q.e. Modes of zero wave number are left out: the
!> mean normal displacement belongs to the approach, and the mean tangential one only says where the
!> road stands. A Nyquist mode stands for both signs of its wave number and takes the mean of both.
!>
!> With `dt` > 0 the symbols are those of the time scheme exponential2 with steps of dt. The steady state then
!> equals the end of a long run in time with these steps. With rho = exp(i q.V dt),
!>
!>     G = G_e + sum g [(phi + chi)(1 - rho) - chi (rho - rho^2)]/(1 - exp(-x) rho),   x = dt/tau
!>     d/ds = (rho - 1)/(|V| dt)
!>
!> The tables have the bounds (first:last, 0:ny-1), with negative wave numbers along y behind the positive ones,
!> and are zero beyond nx/2. A single process has all columns, from 0 on; several processes have only the
!> columns that each of them transforms.
module steady_symbols
   use asperity_parallel, only : global_max, global_min
   use asperity_precision, only : dp, pi
   use kernels, only : kernel_type
   use prony, only : complex_modulus
   use regular_grid, only : grid_type
   use relaxation_functions, only : mean_decay, slope_response
   implicit none
   private

   public :: medium_type, mode_compliance, mode_waves, new_steady_symbols, steady_modulus, steady_symbols_type

   !> The quantities on which the symbols depend.
   type :: medium_type
      type(grid_type) :: grid
      type(kernel_type) :: normal                      !! response to the pressure
      type(kernel_type) :: tangential                  !! response to the traction; only with friction
      real(dp) :: modulus = 0.0_dp                     !! long-term shear modulus, Pa, > 0
      real(dp), allocatable :: g(:), tau(:)            !! arms, Pa and s
      real(dp) :: velocity(2) = 0.0_dp                 !! V, m/s; not zero
      real(dp) :: dt = 0.0_dp                          !! step of the scheme, s; 0: the continuum
   end type medium_type

   !> The symbols of one velocity.
   type :: steady_symbols_type
      complex(dp), allocatable :: normal(:, :)         !! K, m/Pa (first:last, 0:ny-1)
      complex(dp), allocatable :: tangential(:, :, :)  !! A_T: xx, yy, xy, m/Pa (3, first:last, 0:ny-1)
      complex(dp), allocatable :: stretch(:, :, :)     !! d/ds A_T along the motion, of the same shape, 1/Pa
      real(dp) :: largest_compliance = 0.0_dp          !! largest |K|, m/Pa
      real(dp) :: least_compliance = 0.0_dp            !! smallest |K|, m/Pa
   end type steady_symbols_type

contains

   !> The symbols of a medium. Collective where processes share the columns.
   subroutine new_steady_symbols(self, medium, first, last, frictional)
      type(steady_symbols_type), intent(out) :: self
      type(medium_type), intent(in) :: medium
      integer, intent(in) :: first, last               !! wave numbers along x of the tables
      logical, intent(in) :: frictional                !! the tangential symbols are needed
      real(dp), allocatable :: extremes(:, :)          !! of |K| over the columns
      integer :: i, j, nx, ny

      nx = medium%grid%nx
      ny = medium%grid%ny
      allocate (self%normal(first:last, 0:ny - 1), source=(0.0_dp, 0.0_dp))
      if (frictional) then
         allocate (self%tangential(3, first:last, 0:ny - 1), source=(0.0_dp, 0.0_dp))
         allocate (self%stretch(3, first:last, 0:ny - 1), source=(0.0_dp, 0.0_dp))
      end if
      allocate (extremes(2, 0:ny - 1))
      !$omp parallel do default(none) shared(self, medium, frictional, first, last, nx, ny, extremes) &
      !$omp private(i, j)
      do j = 0, ny - 1
         do i = first, min(last, nx/2)
            if (i + j > 0) call mode_symbols(self, medium, frictional, i, j)
         end do
         associate (compliance => abs(self%normal(first:min(last, nx/2), j)))
            extremes(:, j) = [maxval(compliance), minval(compliance, mask=compliance > 0.0_dp)]
         end associate
      end do
      self%largest_compliance = global_max(maxval(extremes(1, :)))
      self%least_compliance = global_min(minval(extremes(2, :)))
   end subroutine new_steady_symbols

   !> The symbols of one mode: the mean over the wave vectors that it stands for.
   subroutine mode_symbols(self, medium, frictional, i, j)
      type(steady_symbols_type), intent(inout) :: self
      type(medium_type), intent(in) :: medium
      logical, intent(in) :: frictional
      integer, intent(in) :: i, j
      complex(dp) :: compliance, derivative
      real(dp) :: waves(2, 4), elastic(3)
      integer :: k, count

      call mode_waves(medium%grid, i, j, waves, count)
      do k = 1, count
         compliance = 1.0_dp/(count*steady_modulus(medium, dot_product(waves(:, k), medium%velocity)))
         elastic = mode_compliance(medium%normal, waves(:, k), count)
         self%normal(i, j) = self%normal(i, j) + elastic(1)*compliance
         if (.not. frictional) cycle
         derivative = along_motion(medium, dot_product(waves(:, k), medium%velocity))
         elastic = mode_compliance(medium%tangential, waves(:, k), count)
         self%tangential(:, i, j) = self%tangential(:, i, j) + elastic*compliance
         self%stretch(:, i, j) = self%stretch(:, i, j) + elastic*compliance*derivative
      end do
   end subroutine mode_symbols

   !> The wave vectors that a mode stands for: one, or both signs of a Nyquist component.
   pure subroutine mode_waves(grid, i, j, waves, count)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: i                         !! along x, 0 to nx/2
      integer, intent(in) :: j                         !! along y, 0 to ny-1
      real(dp), intent(out) :: waves(2, 4)             !! q, rad/m
      integer, intent(out) :: count                    !! 1, 2 or 4
      integer :: along_y

      along_y = merge(j - grid%ny, j, 2*j > grid%ny)
      waves = 0.0_dp
      waves(:, 1) = 2.0_dp*pi*[i/grid%lx, along_y/grid%ly]
      count = 1
      if (2*i == grid%nx) then
         waves(:, 2) = [-waves(1, 1), waves(2, 1)]
         count = 2
      end if
      if (2*j == grid%ny) then
         waves(1, count + 1:2*count) = waves(1, 1:count)
         waves(2, count + 1:2*count) = -waves(2, 1:count)
         count = 2*count
      end if
   end subroutine mode_waves

   !> The elastic compliance of a mode for unit modulus. A mode that stands for both signs of a wave number
   !> has no xy, which is odd in both.
   pure function mode_compliance(kernel, wave, count) result(a)
      type(kernel_type), intent(in) :: kernel
      real(dp), intent(in) :: wave(2)                  !! q, rad/m
      integer, intent(in) :: count                     !! wave vectors that the mode stands for
      real(dp) :: a(3)                                 !! as `tensor` says, m/Pa

      a = kernel%tensor(wave(1), wave(2))
      if (count > 1) a(3) = 0.0_dp
   end function mode_compliance

   !> G* of a mode with the rate q.V.
   pure function steady_modulus(medium, rate) result(modulus)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: rate                     !! q.V, rad/s
      complex(dp) :: modulus                           !! Pa
      complex(dp) :: rho
      real(dp) :: phi, chi, x
      integer :: k

      if (medium%dt <= 0.0_dp) then
         modulus = complex_modulus(medium%modulus, medium%g, medium%tau, -rate)
         return
      end if
      rho = exp(cmplx(0.0_dp, rate*medium%dt, dp))
      modulus = medium%modulus
      do k = 1, size(medium%g)
         x = medium%dt/medium%tau(k)
         phi = mean_decay(x)
         chi = slope_response(x)
         modulus = modulus + medium%g(k)*((phi + chi)*(1.0_dp - rho) - chi*(rho - rho**2)) &
            /(1.0_dp - exp(-x)*rho)
      end do
   end function steady_modulus

   !> The symbol of the derivative along the motion.
   pure function along_motion(medium, rate) result(derivative)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: rate                     !! q.V, rad/s
      complex(dp) :: derivative                        !! 1/m

      derivative = cmplx(0.0_dp, rate, dp)
      if (medium%dt > 0.0_dp) derivative = (exp(cmplx(0.0_dp, rate*medium%dt, dp)) - 1.0_dp)/medium%dt
      derivative = derivative/norm2(medium%velocity)
   end function along_motion

end module steady_symbols
