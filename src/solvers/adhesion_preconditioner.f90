!> Preconditioners M ~ 1/(|q| + c) of the adhesive problem, and a coarse estimate of d.B d.
!>
!> 'full': the symbol on the grid itself, two transforms. 'coarse': theta r + R^T M_c R r, where R is
!> a weighted mean onto a grid of about a quarter of the cells each way, R^T (up to a factor) linear
!> interpolation back, and M_c has the low symbols of M, over what R and R^T let pass of a wave: 2/16
!> of a transform. Both are symmetric and positive for any numbers of cells.
!>
!> Rows go in by `put_row`, `transform` does the work between, rows come back by `get_row`: the passes
!> over memory are the caller's. The estimate of d.B d serves to predict a step length.
!>
!> Measured on four rough surfaces of 256 x 256 cells, strong attraction of short range, load 0.05 of
!> E* h'rms, transforms to a natural residual of 1e-6: 'full' 192 to 311, 'coarse' 128 to 166 (without
!> the division by what passes 139 to 199; with theta 2 instead of 1.4 over B at the Nyquist wave
!> number 170 to 285; on a grid of half the cells each way 144 to 177).
!>
!> Processes share the rows of the coarse grid, too: each has those whose centres lie on its rows of the
!> grid. What one of them needs of its neighbours are restricted rows and coarse rows at the rims.
!>
!> Memory: a spectrum and a symbol for 'full'; 1/4 of a field for 'coarse' and for the estimate.
module adhesion_preconditioner
   use adhesion_symbols, only : adhesion_symbols_type
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : columns_apply, convolution_type, new_symbol_operator
   use asperity_precision, only : dp, pi
   use row_halo, only : new_row_halo, row_halo_type
   use row_sharing, only : new_row_sharing, row_sharing_type
   use transform_shape, only : shape_of_rows
   implicit none
   private

   public :: adhesion_preconditioner_type, new_adhesion_preconditioner

   real(dp), parameter :: ratio = 4.0_dp          !! cells of the grid to one of the coarse grid
   real(dp), parameter :: least_passed = 0.1_dp   !! M_c makes up for no more than this

   !> Not to be copied.
   type :: adhesion_preconditioner_type
      logical :: full = .false.                   !! which of the two forms
      integer :: nx = 0, ny = 0                   !! the grid
      integer :: mx = 0, my = 0                   !! the coarse grid
      type(row_sharing_type) :: sharing           !! who holds the rows of the coarse grid
      integer, allocatable :: own(:)              !! rows of the grid that this process holds
      type(row_halo_type) :: fine_halo            !! restricted rows that coarse rows need
      type(row_halo_type) :: coarse_halo          !! coarse rows that rows of the grid need
      real(dp) :: theta = 0.0_dp                  !! M at high wave numbers
      real(dp) :: fine_symbol = 0.0_dp            !! B of what the coarse grid does not see
      real(dp) :: cells = 1.0_dp                  !! cells to one coarse cell
      integer, allocatable :: left(:), below(:)   !! lower coarse neighbour of a cell, of the whole grid
      real(dp), allocatable :: wx(:), wy(:)       !! weight of the upper one
      real(dp), allocatable :: rows(:, :)         !! restricted along x, [mx, rows and foreign ones]
      real(dp), allocatable :: field(:, :)        !! on the coarse grid, [mx, rows and foreign ones]
      type(convolution_type) :: fine              !! M, 'full'
      type(convolution_type) :: coarse            !! M_c, 'coarse'
      type(convolution_type) :: stiffness         !! low symbols of B
   contains
      procedure :: put_row
      procedure :: transform
      procedure :: get_row
      procedure :: put_estimate_row
      procedure :: estimate
      procedure :: transforms
      procedure :: destroy
   end type adhesion_preconditioner_type

contains

   !> Make one from the symbols of M and B.
   subroutine new_adhesion_preconditioner(self, kind, nx, fine, symbols, nyquist, error)
      type(adhesion_preconditioner_type), intent(out) :: self
      character(*), intent(in) :: kind              !! 'full' or 'coarse'
      integer, intent(in) :: nx                     !! cells of the grid along x
      type(row_sharing_type), intent(in) :: fine    !! who holds its rows
      type(adhesion_symbols_type), intent(inout) :: symbols   !! of B and M
      real(dp), intent(in) :: nyquist               !! B at the Nyquist wave number, > 0
      type(error_type), allocatable, intent(out) :: error
      integer :: ny

      ny = size(fine%owner)
      self%nx = nx
      self%ny = ny
      self%own = fine%own
      self%theta = 1.4_dp/nyquist
      self%fine_symbol = 0.5_dp*nyquist
      self%mx = max(1, nint(nx/ratio))
      self%my = max(1, nint(ny/ratio))
      self%cells = real(nx, dp)*ny/(real(self%mx, dp)*self%my)
      allocate (self%left(nx), self%wx(nx), self%below(ny), self%wy(ny))
      call neighbours(nx, self%mx, self%left, self%wx)
      call neighbours(ny, self%my, self%below, self%wy)
      call share_coarse_rows(self, fine)
      allocate (self%rows(self%mx, self%fine_halo%own + self%fine_halo%foreign), &
         self%field(self%mx, self%coarse_halo%own + self%coarse_halo%foreign))
      select case (kind)
      case ('full')
         self%full = .true.
         call new_symbol_operator(self%fine, shape_of_rows(nx, fine, 1), error)
         if (allocated(error)) return
         call symbols%form(self%fine%modes(), error)
         if (allocated(error)) return
         call self%fine%set_symbol(symbols%compliance)
      case ('coarse')
         call new_symbol_operator(self%coarse, shape_of_rows(self%mx, self%sharing, 1), error)
      case default
         call fail(error, error_input, "preconditioner = '"//kind//"': must be 'full' or 'coarse'")
      end select
      if (allocated(error)) return
      call new_symbol_operator(self%stiffness, shape_of_rows(self%mx, self%sharing, 1), error)
      if (allocated(error)) return
      call set_low_symbols(self, symbols, error)
   end subroutine new_adhesion_preconditioner

   !> Give the operators of the coarse grid the low symbols.
   subroutine set_low_symbols(self, symbols, error)
      type(adhesion_preconditioner_type), intent(inout) :: self
      type(adhesion_symbols_type), intent(inout) :: symbols
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: low(:, :)
      real(dp) :: along_x(0:self%mx/2), along_y(0:self%my/2)
      integer :: modes(2), i, j

      modes = self%stiffness%modes()
      call symbols%form(modes, error)
      if (allocated(error)) return
      allocate (low(modes(1):modes(2), 0:self%my/2))
      low(:, :) = symbols%stiffness(modes(1):modes(2), 0:self%my/2)
      call self%stiffness%set_symbol(low)
      if (self%full) return
      ! Of all wave numbers, since a vectorised sine may depend in its last bit on where a loop begins.
      along_x = passed([(i, i=0, self%mx/2)], self%mx)
      along_y = passed([(j, j=0, self%my/2)], self%my)
      do j = 0, self%my/2
         do i = modes(1), modes(2)
            low(i, j) = symbols%compliance(i, j)/max(along_x(i)*along_y(j), least_passed)
         end do
      end do
      call self%coarse%set_symbol(low)
   end subroutine set_low_symbols

   !> Who holds which coarse rows, and what each process needs of others.
   pure subroutine share_coarse_rows(self, fine)
      type(adhesion_preconditioner_type), intent(inout) :: self
      type(row_sharing_type), intent(in) :: fine
      integer :: owner(self%my), above(self%ny), rows(self%ny)
      integer :: j, k

      do k = 1, self%my
         owner(k) = fine%owner(min(int((k - 0.5_dp)*self%ny/self%my) + 1, self%ny))
      end do
      call new_row_sharing(self%sharing, owner, fine%shared)
      above = upper(self%below, self%my)
      rows = [(j, j=1, self%ny)]
      call new_row_halo(self%fine_halo, fine, [rows, rows], [owner(self%below), owner(above)])
      call new_row_halo(self%coarse_halo, self%sharing, [self%below, above], [fine%owner, fine%owner])
   end subroutine share_coarse_rows

   !> The coarse cell after one, on a periodic grid.
   elemental function upper(lower, m) result(cell)
      integer, intent(in) :: lower
      integer, intent(in) :: m                      !! coarse cells
      integer :: cell

      cell = merge(1, lower + 1, lower == m)
   end function upper

   !> What linear interpolation and its adjoint leave of a wave: sinc^4.
   elemental function passed(k, m) result(share)
      integer, intent(in) :: k                      !! wave number
      integer, intent(in) :: m                      !! coarse cells
      real(dp) :: share

      share = 1.0_dp
      if (k > 0) share = (sin(pi*k/m)/(pi*k/m))**4
   end function passed

   !> Between which coarse cells the centres of the cells lie; the grid is periodic.
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

   !> Hand in row j of r, of those of this process.
   subroutine put_row(self, j, row)
      class(adhesion_preconditioner_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(in) :: row(:)

      if (self%full) then
         call self%fine%forward_row(1, j, row)
      else
         call restrict_row(self, j, row)
      end if
   end subroutine put_row

   !> Hand in row j of d for the estimate.
   subroutine put_estimate_row(self, j, row)
      class(adhesion_preconditioner_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(in) :: row(:)

      call restrict_row(self, j, row)
   end subroutine put_estimate_row

   !> Weighted sums of a row onto the coarse cells.
   subroutine restrict_row(self, j, row)
      class(adhesion_preconditioner_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(in) :: row(:)
      integer :: i, k, l

      self%rows(:, j) = 0.0_dp
      do i = 1, self%nx
         k = self%left(i)
         l = merge(1, k + 1, k == self%mx)
         self%rows(k, j) = self%rows(k, j) + (1.0_dp - self%wx(i))*row(i)
         self%rows(l, j) = self%rows(l, j) + self%wx(i)*row(i)
      end do
   end subroutine restrict_row

   !> Finish the restriction: weighted means on the coarse grid. Each is summed in the order of the rows.
   subroutine restrict_columns(self)
      class(adhesion_preconditioner_type), intent(inout) :: self
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

   !> Between putting and getting rows.
   subroutine transform(self)
      class(adhesion_preconditioner_type), intent(inout) :: self
      real(dp), allocatable :: product(:, :)
      real(dp) :: form

      if (self%full) then
         call self%fine%columns(columns_apply, form)
      else
         call restrict_columns(self)
         allocate (product, mold=self%field)
         associate (own => self%coarse_halo%own)
            call self%coarse%apply(self%field(:, :own), product(:, :own))
         end associate
         call move_alloc(product, self%field)
         call self%coarse_halo%fetch(self%field)
      end if
   end subroutine transform

   !> Row j of z = M r.
   subroutine get_row(self, j, r, z)
      class(adhesion_preconditioner_type), intent(inout) :: self
      integer, intent(in) :: j
      real(dp), intent(in) :: r(:)                !! row j of r
      real(dp), intent(out) :: z(:)
      real(dp) :: share, a, b
      integer :: i, k, l, below, above

      if (self%full) then
         call self%fine%backward_row(1, j, z)
         return
      end if
      associate (row => self%own(j))
         below = self%coarse_halo%place(self%below(row))
         above = self%coarse_halo%place(upper(self%below(row), self%my))
         share = self%wy(row)
      end associate
      do i = 1, self%nx
         k = self%left(i)
         l = merge(1, k + 1, k == self%mx)
         a = self%field(k, below) + share*(self%field(k, above) - self%field(k, below))
         b = self%field(l, below) + share*(self%field(l, above) - self%field(l, below))
         z(i) = self%theta*r(i) + a + self%wx(i)*(b - a)
      end do
   end subroutine get_row

   !> Estimate of d.B d over the cells after `put_estimate_row` of every row.
   function estimate(self, squares) result(form)
      class(adhesion_preconditioner_type), intent(inout) :: self
      real(dp), intent(in) :: squares             !! d.d over the cells
      real(dp) :: form
      real(dp), allocatable :: rows(:, :)
      real(dp) :: coarse_squares(1)
      integer :: j

      call restrict_columns(self)
      allocate (rows(1, self%coarse_halo%own))
      do j = 1, self%coarse_halo%own
         rows(1, j) = sum(self%field(:, j)**2)
      end do
      coarse_squares = self%sharing%totals(rows)
      call self%stiffness%quadratic_form(self%field(:, :self%coarse_halo%own), form)
      form = self%cells*form &
         + max(squares - self%cells*coarse_squares(1), 0.0_dp)*self%fine_symbol
   end function estimate

   !> Transforms done so far, counted in those of the grid.
   pure function transforms(self) result(count)
      class(adhesion_preconditioner_type), intent(in) :: self
      real(dp) :: count

      count = real(self%fine%ffts, dp) &
         + real(self%coarse%ffts + self%stiffness%ffts, dp)/self%cells
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(adhesion_preconditioner_type), intent(inout) :: self

      call self%fine%destroy()
      call self%coarse%destroy()
      call self%stiffness%destroy()
   end subroutine destroy

end module adhesion_preconditioner
