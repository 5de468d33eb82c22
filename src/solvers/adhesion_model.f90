!> A local model of the stiffness B of an adhesive contact, and an approximate inverse of it.
!>
!> The model consists of a stencil, which fits B at short waves (module `adhesion_stencil`), and a correction for
!> long waves on a coarse grid with about an eighth of the cells in each direction:
!>     B_h s = stencil s + R^T missing R s.
!> R is a weighted mean onto the coarse grid and R^T (up to a factor) linear interpolation back; `missing`
!> acts on wave numbers below `band`, and is divided by the part of a wave that R and R^T transmit. A product costs a
!> pass over the cells and two transforms of a 64th of the full size. For a half-space with square cells B_h is between
!> 0.8 and 1.3 times B, so that a minimum of the model's energy is near a minimum of the true energy.
!>
!> The inverse preconditions the model: M r = theta r + R^T (1/B - theta) R r, where the coarse part has the symbols of
!> the long waves. B_h and M are symmetric for any numbers of cells, and M is positive definite.
!>
!> The caller passes the rows of a field by `put_row`, calls `transform_product` or `transform_inverse`, and gets
!> the rows of the result by `product_row` or `inverse_row`, so that no additional pass over memory is needed.
!>
!> Processes share the rows of the coarse grid, too: each holds those whose centres lie on its rows of the
!> grid. From its neighbours a process needs the restricted rows and coarse rows next to its own, and the rows of the
!> grid that the stencil reads (`halo`).
!>
!> Memory: one sixteenth of a field of doubles, and the operators of the coarse grid.
module adhesion_model
   use adhesion_stencil, only : add_stencil, band, fit_stencil, radius, stencil_symbol
   use adhesion_symbols, only : adhesion_symbols_type
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_symbol_operator
   use asperity_precision, only : dp, pi
   use row_halo, only : new_row_halo, row_halo_type
   use row_sharing, only : new_row_sharing, row_sharing_type
   use transform_shape, only : shape_of_rows
   implicit none
   private

   public :: adhesion_model_type, new_adhesion_model

   integer, parameter :: ratio = 8                !! about the number of cells in each direction to one coarse cell
   real(dp), parameter :: least_passed = 0.1_dp   !! least transmitted part of a wave by which a symbol is divided
   real(dp), parameter :: short_waves = 1.6_dp    !! theta times B at the Nyquist wave number

   !> The model of a grid. A variable of this type must not be copied.
   type :: adhesion_model_type
      type(row_halo_type) :: halo                 !! rows that the stencil needs
      integer, private :: nx = 0, ny = 0          !! the grid
      integer, private :: mx = 0, my = 0          !! the coarse grid
      type(row_sharing_type), private :: sharing  !! how processes share the rows of the coarse grid
      integer, allocatable, private :: own(:)     !! rows of the grid that this process holds
      type(row_halo_type), private :: fine_halo   !! restricted rows that coarse rows need
      type(row_halo_type), private :: coarse_halo !! coarse rows that rows of the grid need
      real(dp), private :: weights(0:radius, 0:radius) = 0.0_dp  !! of the stencil
      real(dp), private :: theta = 0.0_dp         !! symbol of M at high wave numbers
      real(dp), private :: cells = 1.0_dp         !! cells to one coarse cell
      integer, allocatable, private :: left(:), below(:)   !! lower coarse neighbour of a cell, of the whole grid
      integer, allocatable, private :: starts(:)           !! cells of a row where `left` changes, and nx + 1
      real(dp), allocatable, private :: wx(:), wy(:)       !! weight of the upper coarse neighbour
      real(dp), allocatable, private :: rows(:, :)         !! restricted along x, [mx, rows and foreign ones]
      real(dp), allocatable, private :: field(:, :)        !! on the coarse grid, [mx, rows and foreign ones]
      type(convolution_type), private :: inverse  !! the coarse part of M
      type(convolution_type), private :: missing  !! correction of the stencil at long waves
   contains
      procedure :: put_row
      procedure :: transform_product
      procedure :: transform_inverse
      procedure :: product_row
      procedure :: stencil_row
      procedure :: around
      procedure :: inverse_row
      procedure :: transforms
      procedure :: destroy
   end type adhesion_model_type

contains

   !> Make the model of a grid from its symbols. Collective.
   subroutine new_adhesion_model(self, nx, fine, symbols, modes, nyquist, error)
      type(adhesion_model_type), intent(out) :: self
      integer, intent(in) :: nx                     !! cells of the grid along x
      type(row_sharing_type), intent(in) :: fine    !! which process holds which rows
      type(adhesion_symbols_type), intent(inout) :: symbols   !! of B and of its approximate inverse
      integer, intent(in) :: modes(2)               !! first and last wave number along x whose symbols are known
      real(dp), intent(in) :: nyquist               !! B at the Nyquist wave number, > 0
      type(error_type), allocatable, intent(out) :: error
      integer :: i, ny

      ny = size(fine%owner)
      self%nx = nx
      self%ny = ny
      self%own = fine%own
      call fit_stencil(symbols, modes, nx, ny, self%weights)
      self%theta = short_waves/nyquist
      self%mx = max(1, nint(real(nx, dp)/ratio))
      self%my = max(1, nint(real(ny, dp)/ratio))
      self%cells = real(nx, dp)*ny/(real(self%mx, dp)*self%my)
      allocate (self%left(nx), self%wx(nx), self%below(ny), self%wy(ny))
      call neighbours(nx, self%mx, self%left, self%wx)
      call neighbours(ny, self%my, self%below, self%wy)
      self%starts = [1, pack([(i, i=2, nx)], self%left(2:) /= self%left(:nx - 1)), nx + 1]
      call share_rows(self, fine)
      allocate (self%rows(self%mx, self%fine_halo%own + self%fine_halo%foreign), &
         self%field(self%mx, self%coarse_halo%own + self%coarse_halo%foreign))
      call new_symbol_operator(self%inverse, shape_of_rows(self%mx, self%sharing, 1), error)
      call new_symbol_operator(self%missing, shape_of_rows(self%mx, self%sharing, 1), error)
      call set_low_symbols(self, symbols, error)
   end subroutine new_adhesion_model

   !> Set the symbols of the operators on the coarse grid from those of the long waves.
   subroutine set_low_symbols(self, symbols, error)
      type(adhesion_model_type), intent(inout) :: self
      type(adhesion_symbols_type), intent(inout) :: symbols
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      real(dp), allocatable :: missing(:, :), inverse(:, :)
      real(dp) :: along_x(0:self%mx/2), along_y(0:self%my/2), kx, ky, passing
      integer :: modes(2), i, j

      modes = self%missing%modes()
      call symbols%form(modes, error)
      if (allocated(error)) return
      allocate (missing(modes(1):modes(2), 0:self%my/2), inverse(modes(1):modes(2), 0:self%my/2))
      ! All wave numbers are computed, not only those of this process: the last bit of a vectorised sine may depend on
      ! where the loop begins.
      along_x = passed([(i, i=0, self%mx/2)], self%mx)
      along_y = passed([(j, j=0, self%my/2)], self%my)
      do j = 0, self%my/2
         do i = modes(1), modes(2)
            kx = 2.0_dp*pi*i/self%nx
            ky = 2.0_dp*pi*j/self%ny
            passing = max(along_x(i)*along_y(j), least_passed)
            missing(i, j) = 0.0_dp
            if (hypot(kx, ky) < band) missing(i, j) = (symbols%stiffness(i, j) &
               - stencil_symbol(self%weights, kx, ky))/passing
            inverse(i, j) = max(symbols%compliance(i, j) - self%theta, 0.0_dp)/passing
         end do
      end do
      call self%missing%set_symbol(missing)
      call self%inverse%set_symbol(inverse)
   end subroutine set_low_symbols

   !> Determine which process holds which coarse rows, and which rows each process needs from others.
   pure subroutine share_rows(self, fine)
      type(adhesion_model_type), intent(inout) :: self
      type(row_sharing_type), intent(in) :: fine
      integer :: owner(self%my), above(self%ny), rows(self%ny)
      integer :: around(self%ny, 2*radius)
      integer :: j, k

      do k = 1, self%my
         owner(k) = fine%owner(min(int((k - 0.5_dp)*self%ny/self%my) + 1, self%ny))
      end do
      call new_row_sharing(self%sharing, owner, fine%shared)
      above = upper(self%below, self%my)
      rows = [(j, j=1, self%ny)]
      call new_row_halo(self%fine_halo, fine, [rows, rows], [owner(self%below), owner(above)])
      call new_row_halo(self%coarse_halo, self%sharing, [self%below, above], [fine%owner, fine%owner])
      do k = 1, radius
         around(:, 2*k - 1) = modulo(rows - 1 - k, self%ny) + 1
         around(:, 2*k) = modulo(rows - 1 + k, self%ny) + 1
      end do
      call new_row_halo(self%halo, fine, reshape(around, [size(around)]), &
         reshape(spread(fine%owner, 2, 2*radius), [size(around)]))
   end subroutine share_rows

   !> The coarse cell that follows another one, on a periodic grid.
   elemental function upper(lower, m) result(cell)
      integer, intent(in) :: lower
      integer, intent(in) :: m                      !! coarse cells
      integer :: cell

      cell = merge(1, lower + 1, lower == m)
   end function upper

   !> The part of a wave that linear interpolation and its adjoint transmit: sinc^4.
   elemental function passed(k, m) result(share)
      integer, intent(in) :: k                      !! wave number
      integer, intent(in) :: m                      !! coarse cells
      real(dp) :: share

      share = 1.0_dp
      if (k > 0) share = (sin(pi*k/m)/(pi*k/m))**4
   end function passed

   !> Find the coarse cells between which the centres of the cells lie. The grid is periodic.
   pure subroutine neighbours(n, m, lower, weight)
      integer, intent(in) :: n, m
      integer, intent(out) :: lower(n)
      real(dp), intent(out) :: weight(n)
      real(dp) :: x
      integer :: i

      do i = 1, n
         x = (i - 0.5_dp)*m/n - 0.5_dp
         lower(i) = modulo(floor(x), m) + 1
         weight(i) = x - floor(x)
      end do
   end subroutine neighbours

   !> Compute the weighted sums of row j of a field over the coarse cells along x. Rows are counted on this process.
   subroutine put_row(self, j, row)
      class(adhesion_model_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: row(:)
      real(dp) :: sums(2)
      integer :: i, k, next, part

      self%rows(:, j) = 0.0_dp
      do part = 1, size(self%starts) - 1
         ! The cells between two coarse ones.
         i = self%starts(part)
         next = self%starts(part + 1)
         if (next - i == ratio) then
            sums = sums_of_eight(row(i:next - 1), self%wx(i:next - 1))
         else
            sums = [sum(row(i:next - 1)), sum(self%wx(i:next - 1)*row(i:next - 1))]
         end if
         k = self%left(i)
         self%rows(k, j) = self%rows(k, j) + (sums(1) - sums(2))
         k = upper(k, self%mx)
         self%rows(k, j) = self%rows(k, j) + sums(2)
      end do
   end subroutine put_row

   !> The sums of x and of w x over eight cells, in an order in which a processor can add several numbers at once.
   pure function sums_of_eight(x, w) result(sums)
      real(dp), intent(in) :: x(ratio), w(ratio)
      real(dp) :: sums(2)
      real(dp) :: fours(4, 2), pairs(2, 2)

      fours(:, 1) = x(1:4) + x(5:8)
      fours(:, 2) = w(1:4)*x(1:4) + w(5:8)*x(5:8)
      pairs(:, :) = fours(1:2, :) + fours(3:4, :)
      sums(:) = pairs(1, :) + pairs(2, :)
   end function sums_of_eight

   !> Finish the restriction: weighted means on the coarse grid. Each is summed in the order of the rows.
   subroutine restrict_columns(self)
      class(adhesion_model_type), intent(inout) :: self
      integer :: j, from

      call self%fine_halo%fetch(self%rows)
      self%field = 0.0_dp
      do j = 1, self%ny
         from = self%fine_halo%place(j)
         if (from == 0) cycle
         call add(self%coarse_halo%place(self%below(j)), 1.0_dp - self%wy(j))
         call add(self%coarse_halo%place(upper(self%below(j), self%my)), self%wy(j))
      end do

   contains

      !> Add a row to a coarse row, if that is one of this process.
      subroutine add(k, weight)
         integer, intent(in) :: k
         real(dp), intent(in) :: weight

         if (k < 1 .or. k > self%coarse_halo%own) return
         self%field(:, k) = self%field(:, k) + weight/self%cells*self%rows(:, from)
      end subroutine add

   end subroutine restrict_columns

   !> Do the transforms between `put_row` and `product_row`. Collective.
   subroutine transform_product(self)
      class(adhesion_model_type), intent(inout) :: self

      call convolve(self, self%missing)
   end subroutine transform_product

   !> Do the transforms between `put_row` and `inverse_row`. Collective.
   subroutine transform_inverse(self)
      class(adhesion_model_type), intent(inout) :: self

      call convolve(self, self%inverse)
   end subroutine transform_inverse

   !> Compute a product on the coarse grid.
   subroutine convolve(self, operator)
      type(adhesion_model_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator
      real(dp), allocatable :: product(:, :)

      call restrict_columns(self)
      allocate (product, mold=self%field)
      associate (own => self%coarse_halo%own)
         call operator%apply(self%field(:, :own), product(:, :own))
      end associate
      call move_alloc(product, self%field)
      call self%coarse_halo%fetch(self%field)
   end subroutine convolve

   !> Compute row j of B_h s.
   subroutine product_row(self, j, s, product)
      class(adhesion_model_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: s(:, :)   !! with the foreign rows of `halo`
      real(dp), intent(out), contiguous :: product(:)

      call interpolate(self, j, product)
      call self%stencil_row(j, s, product)
   end subroutine product_row

   !> Add the stencil's part of row j of B_h s. For short waves this is the whole product.
   subroutine stencil_row(self, j, s, product)
      class(adhesion_model_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: s(:, :)   !! with the foreign rows of `halo`
      real(dp), intent(inout), contiguous :: product(:)

      integer :: at(2*radius + 1)

      at = self%around(j)
      call add_stencil(self%weights, s(:, at(1)), s(:, at(2)), s(:, at(3)), s(:, at(4)), s(:, at(5)), product)
   end subroutine stencil_row

   !> The positions of the rows that the stencil reads for row j.
   pure function around(self, j) result(places)
      class(adhesion_model_type), intent(in) :: self
      integer, intent(in) :: j
      integer :: places(2*radius + 1)
      integer :: k

      places = self%halo%place(modulo(self%own(j) - 1 + [(k, k=-radius, radius)], self%ny) + 1)
   end function around

   !> Compute row j of M r.
   subroutine inverse_row(self, j, r, z)
      class(adhesion_model_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(in) :: r(:)                !! row j of r
      real(dp), intent(out), contiguous :: z(:)

      call interpolate(self, j, z)
      z(:) = z + self%theta*r
   end subroutine inverse_row

   !> Compute row j of a coarse field by linear interpolation.
   pure subroutine interpolate(self, j, values)
      type(adhesion_model_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(out), contiguous :: values(:)
      real(dp) :: between(self%mx + 1), low, rise
      integer :: i, below, above, next, part

      associate (row => self%own(j))
         below = self%coarse_halo%place(self%below(row))
         above = self%coarse_halo%place(upper(self%below(row), self%my))
         between(:self%mx) = self%field(:, below) + self%wy(row)*(self%field(:, above) - self%field(:, below))
      end associate
      between(self%mx + 1) = between(1)
      do part = 1, size(self%starts) - 1
         i = self%starts(part)
         next = self%starts(part + 1)
         low = between(self%left(i))
         rise = between(self%left(i) + 1) - low
         if (next - i == ratio) then
            values(i:i + ratio - 1) = low + rise*self%wx(i:i + ratio - 1)
         else
            values(i:next - 1) = low + rise*self%wx(i:next - 1)
         end if
      end do
   end subroutine interpolate

   !> Transforms done so far, in units of a transform of the whole grid.
   pure function transforms(self) result(count)
      class(adhesion_model_type), intent(in) :: self
      real(dp) :: count

      count = real(self%inverse%ffts + self%missing%ffts, dp)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_model_type), intent(inout) :: self

      call self%inverse%destroy()
      call self%missing%destroy()
   end subroutine destroy

end module adhesion_model
