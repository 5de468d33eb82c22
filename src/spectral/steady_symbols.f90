!> The half-space in steady sliding: complex compliances of the modes that travel with the road.
!>
!> In steady sliding every field keeps its shape and moves with the road's velocity V over the rubber,
!> f(X, t) = f(X - V t). A mode exp(i q.X) therefore oscillates at omega = -q.V, and the elastic
!> coefficients of `influence` are divided by the complex modulus G*(omega):
!>
!>     U_z = K P,    K = (1-nu)/(q G*)
!>     U_T = A_T T,  A_T = [1 - nu q q/q^2]/(q G*)
!>     the slip speed of the road over the rubber is V + (V.grad) U_T = |V| (e + dU_T/ds), e = V/|V|
!>
!> so the derivative along the motion is the symbol i q.e. Modes of zero wave number are left out: the
!> mean normal displacement belongs to the approach, and the mean tangential one only says where the
!> road stands. A Nyquist mode stands for both signs of its wave number and takes the mean of both.
!>
!> A time scheme moves by steps. With `dt` the symbols are those of the scheme exponential2 in steps
!> of dt, so that a steady state equals the end of a long run in time: with rho = exp(i q.V dt),
!>
!>     G = G_e + sum g [(phi + chi)(1 - rho) - chi (rho - rho^2)]/(1 - exp(-x) rho),   x = dt/tau
!>     d/ds = (rho - 1)/(|V| dt)
!>
!> Tables run over (0:last, 0:ny-1), negative wave numbers along y behind the positive ones, and are
!> zero beyond nx/2.
module steady_symbols
   use precision, only : dp, pi
   use prony, only : complex_modulus
   use regular_grid, only : grid_type
   use relaxation_functions, only : mean_decay, slope_response
   implicit none
   private

   public :: new_steady_symbols, steady_symbols_type

   !> The symbols of one velocity. Elastic ones are those of a unit shear modulus.
   type :: steady_symbols_type
      integer :: nx = 0, ny = 0
      integer :: last = 0                              !! of the tables' first index
      real(dp) :: velocity(2) = 0.0_dp                 !! V, m/s
      complex(dp), allocatable :: normal(:, :)         !! K, m/Pa
      complex(dp), allocatable :: tangential(:, :, :)  !! A_T: xx, yy, xy, m/Pa (3, 0:last, 0:ny-1)
      complex(dp), allocatable :: stretch(:, :, :)     !! d/ds A_T alike, 1/Pa
      real(dp) :: longest = 0.0_dp                     !! largest |K|, m/Pa
      real(dp) :: shortest = 0.0_dp                    !! smallest |K|, m/Pa
   end type steady_symbols_type

   !> What the symbols of one wave vector depend on.
   type :: medium_type
      real(dp) :: poisson
      real(dp) :: modulus                              !! long-term, Pa
      real(dp), allocatable :: g(:), tau(:)
      real(dp) :: velocity(2)
      real(dp) :: dt                                   !! 0: the continuum
   end type medium_type

contains

   !> The symbols for a velocity that is not zero.
   subroutine new_steady_symbols(self, grid, last, poisson, modulus, g, tau, velocity, frictional, dt)
      type(steady_symbols_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: last                      !! last wave number along x of the tables
      real(dp), intent(in) :: poisson
      real(dp), intent(in) :: modulus                  !! long-term shear modulus, Pa, > 0
      real(dp), intent(in) :: g(:), tau(:)             !! arms, Pa and s
      real(dp), intent(in) :: velocity(2)              !! m/s
      logical, intent(in) :: frictional                !! the tangential symbols are needed
      real(dp), intent(in), optional :: dt             !! of the scheme, s; the continuum by default
      type(medium_type) :: medium
      integer :: i, j

      medium%poisson = poisson
      medium%modulus = modulus
      allocate (medium%g, source=g)
      allocate (medium%tau, source=tau)
      medium%velocity = velocity
      medium%dt = 0.0_dp
      if (present(dt)) medium%dt = dt
      self%nx = grid%nx
      self%ny = grid%ny
      self%last = last
      self%velocity = velocity
      allocate (self%normal(0:last, 0:grid%ny - 1), source=(0.0_dp, 0.0_dp))
      if (frictional) then
         allocate (self%tangential(3, 0:last, 0:grid%ny - 1), source=(0.0_dp, 0.0_dp))
         allocate (self%stretch(3, 0:last, 0:grid%ny - 1), source=(0.0_dp, 0.0_dp))
      end if
      !$omp parallel do default(none) shared(self, grid, medium, frictional) private(i, j)
      do j = 0, grid%ny - 1
         do i = 0, grid%nx/2
            if (i + j == 0) cycle
            call mode_symbols(self, grid, medium, frictional, i, j)
         end do
      end do
      self%longest = maxval(abs(self%normal(0:grid%nx/2, :)))
      self%shortest = minval(abs(self%normal(0:grid%nx/2, :)), mask=abs(self%normal(0:grid%nx/2, :)) > 0.0_dp)
   end subroutine new_steady_symbols

   !> The symbols of one mode: the mean over the signs that it stands for.
   subroutine mode_symbols(self, grid, medium, frictional, i, j)
      type(steady_symbols_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      type(medium_type), intent(in) :: medium
      logical, intent(in) :: frictional
      integer, intent(in) :: i, j
      complex(dp) :: compliance, derivative
      real(dp) :: q(2), length, weight, elastic(3)
      integer :: mode, sign_x, sign_y, signs(2), along_x, along_y

      mode = j
      if (2*j > grid%ny) mode = j - grid%ny
      signs = [merge(2, 1, 2*i == grid%nx), merge(2, 1, 2*j == grid%ny)]
      weight = 1.0_dp/product(signs)
      do sign_y = 1, signs(2)
         do sign_x = 1, signs(1)
            along_x = merge(i, -i, sign_x == 1)
            along_y = merge(mode, -mode, sign_y == 1)
            q = 2.0_dp*pi*[along_x/grid%lx, along_y/grid%ly]
            length = norm2(q)
            call responses(medium, dot_product(q, medium%velocity), compliance, derivative)
            self%normal(i, j) = self%normal(i, j) + weight*(1.0_dp - medium%poisson)/length*compliance
            if (.not. frictional) cycle
            elastic = [1.0_dp - medium%poisson*(q(1)/length)**2, &
               1.0_dp - medium%poisson*(q(2)/length)**2, -medium%poisson*q(1)*q(2)/length**2]/length
            if (any(signs == 2)) elastic(3) = 0.0_dp
            self%tangential(:, i, j) = self%tangential(:, i, j) + weight*elastic*compliance
            self%stretch(:, i, j) = self%stretch(:, i, j) + weight*elastic*compliance*derivative
         end do
      end do
   end subroutine mode_symbols

   !> 1/G*, and the symbol of the derivative along the motion, at q.V.
   pure subroutine responses(medium, rate, compliance, derivative)
      type(medium_type), intent(in) :: medium
      real(dp), intent(in) :: rate                     !! q.V, rad/s
      complex(dp), intent(out) :: compliance           !! 1/Pa
      complex(dp), intent(out) :: derivative           !! 1/m
      complex(dp) :: modulus, rho
      real(dp) :: phi, chi, x
      integer :: k

      if (medium%dt <= 0.0_dp) then
         modulus = complex_modulus(medium%modulus, medium%g, medium%tau, -rate)
         derivative = cmplx(0.0_dp, rate/norm2(medium%velocity), dp)
      else
         rho = exp(cmplx(0.0_dp, rate*medium%dt, dp))
         modulus = medium%modulus
         do k = 1, size(medium%g)
            x = medium%dt/medium%tau(k)
            phi = mean_decay(x)
            chi = slope_response(x)
            modulus = modulus + medium%g(k)*((phi + chi)*(1.0_dp - rho) - chi*(rho - rho**2)) &
               /(1.0_dp - exp(-x)*rho)
         end do
         derivative = (rho - 1.0_dp)/(norm2(medium%velocity)*medium%dt)
      end if
      compliance = 1.0_dp/modulus
   end subroutine responses

end module steady_symbols
