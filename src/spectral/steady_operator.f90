!> Operators of steady sliding: they multiply the modes of fields by the complex symbols of `steady_symbols`.
!>
!> * `displace`: U_z = K P.
!> * `resolve`: the resolvent (1 + c K)^-1 of the normal solver (module steady_normal).
!> * `press`: K^-1 of a displacement, with which the normal solver starts.
!> * `shear`: U_T and dU_T/ds from T, six transforms.
!> * `spectrum`: the transform of a field, for losses; `apply_table`: any other symbol.
!>
!> If processes share the rows, each has only the symbols of the columns that it transforms.
!>
!> Memory: one field for the spectrum of the normal side and four for that of the tangential one; the
!> symbols take one field, and six more with friction; the resolvent one.
module steady_operator
   use asperity_errors, only : error_type
   use asperity_threads, only : least_parallel_cells, thread_count
   use asperity_precision, only : dp, int64
   use regular_grid, only : grid_type
   use row_column_double, only : multiplier_type, new_row_column, row_column_type
   use steady_symbols, only : steady_symbols_type
   use transform_shape, only : shape_on_grid, transform_shape_type
   implicit none
   private

   public :: new_steady_operator, steady_operator_type


   !> One complex symbol.
   type, extends(multiplier_type) :: scalar_type
      complex(dp), allocatable :: table(:, :)          !! with the factor of the inverse transform
   contains
      procedure :: multiply => multiply_scalar
   end type scalar_type

   !> Two symmetric tensors, which make four results from two inputs.
   type, extends(multiplier_type) :: pair_type
      complex(dp), allocatable :: first(:, :, :), second(:, :, :)
   contains
      procedure :: multiply => multiply_pair
   end type pair_type

   !> The operators of one grid. Their symbols change with the velocity. A variable of this type must not be
   !> copied.
   type :: steady_operator_type
      type(grid_type) :: grid
      integer :: nx = 0, ny = 0                        !! cells of the whole grid
      integer :: rows = 0                              !! rows of this process
      integer :: first = 0                             !! first and ...
      integer :: last = 0                              !! ... last wave number along x of the tables
      integer :: threads = 1
      logical :: frictional = .false.
      real(dp) :: largest_compliance = 0.0_dp          !! largest |K|, m/Pa
      real(dp) :: least_compliance = 0.0_dp            !! smallest |K|, m/Pa
      integer(int64) :: ffts = 0                       !! real transforms done so far
      type(row_column_type), private :: scalar, vector
      type(scalar_type), private :: normal, inverse, resolvent
      type(pair_type), private :: tangential
      real(dp), private :: c = 0.0_dp                  !! of the resolvent, Pa/m
      complex(dp), allocatable, private :: symbol(:, :)    !! K
   contains
      procedure :: set_symbols
      procedure :: set_scale
      procedure :: displace
      procedure :: press
      procedure :: resolve
      procedure :: shear
      procedure :: apply_table
      procedure :: spectrum
      procedure :: destroy
   end type steady_operator_type

contains

   !> Make the plans for a grid.
   subroutine new_steady_operator(self, grid, frictional, error)
      type(steady_operator_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: frictional
      type(error_type), allocatable, intent(out) :: error
      type(transform_shape_type) :: vector
      integer :: columns(2)

      self%grid = grid
      self%nx = grid%nx
      self%ny = grid%ny
      self%rows = grid%rows()
      self%frictional = frictional
      self%threads = merge(1, thread_count(), grid%cells() < least_parallel_cells)
      call new_row_column(self%scalar, shape_on_grid(grid, 1), self%threads, error)
      if (allocated(error)) return
      columns = self%scalar%own_columns()
      self%first = columns(1)
      self%last = columns(2)
      if (.not. frictional) return
      vector = shape_on_grid(grid, 4)
      vector%inputs = 2
      call new_row_column(self%vector, vector, self%threads, error)
   end subroutine new_steady_operator

   !> Set the symbols for a velocity.
   subroutine set_symbols(self, symbols)
      class(steady_operator_type), intent(inout) :: self
      type(steady_symbols_type), intent(in) :: symbols
      real(dp) :: factor

      factor = 1.0_dp/(real(self%nx, dp)*self%ny)
      if (.not. allocated(self%symbol)) then
         allocate (self%symbol(self%first:self%last, 0:self%ny - 1))
         allocate (self%normal%table(self%first:self%last, 0:self%ny - 1))
         allocate (self%inverse%table(self%first:self%last, 0:self%ny - 1))
         allocate (self%resolvent%table(self%first:self%last, 0:self%ny - 1))
         if (self%frictional) then
            allocate (self%tangential%first(3, self%first:self%last, 0:self%ny - 1))
            allocate (self%tangential%second(3, self%first:self%last, 0:self%ny - 1))
         end if
      end if
      self%largest_compliance = symbols%largest_compliance
      self%least_compliance = symbols%least_compliance
      self%symbol(:, :) = symbols%normal
      self%normal%table(:, :) = factor*symbols%normal
      self%inverse%table(:, :) = 0.0_dp
      where (abs(symbols%normal) > 0.0_dp)
         self%inverse%table(:, :) = factor/symbols%normal
      end where
      self%c = 0.0_dp
      if (.not. self%frictional) return
      self%tangential%first(:, :, :) = factor*symbols%tangential
      self%tangential%second(:, :, :) = factor*symbols%stretch
   end subroutine set_symbols

   !> Set c of the resolvent.
   subroutine set_scale(self, c)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: c                        !! Pa/m, > 0
      real(dp) :: factor
      integer :: i, j

      if (abs(c - self%c) <= 0.0_dp) return
      self%c = c
      factor = 1.0_dp/(real(self%nx, dp)*self%ny)
      !$omp parallel do default(none) shared(self, c, factor) private(i, j) num_threads(self%threads)
      do j = 0, self%ny - 1
         do i = self%first, self%last
            self%resolvent%table(i, j) = factor/(1.0_dp + c*self%symbol(i, j))
         end do
      end do
   end subroutine set_scale

   !> U_z = K P.
   subroutine displace(self, pressure, displacement)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: pressure(:, :)           !! [nx, rows], Pa
      real(dp), intent(inout) :: displacement(:, :)    !! m; may not be the pressure

      call pass_through(self, self%normal, pressure, displacement)
   end subroutine displace

   !> P = K^-1 U without its mean.
   subroutine press(self, displacement, pressure)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: displacement(:, :)
      real(dp), intent(inout) :: pressure(:, :)

      call pass_through(self, self%inverse, displacement, pressure)
   end subroutine press

   !> y = (1 + c K)^-1 x.
   subroutine resolve(self, x, y)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: x(:, :)
      real(dp), intent(inout) :: y(:, :)               !! may be x

      call pass_through(self, self%resolvent, x, y)
   end subroutine resolve

   !> Apply any symbol, given without the factor of the transform, to x.
   subroutine apply_table(self, table, x, y)
      class(steady_operator_type), intent(inout) :: self
      complex(dp), intent(in) :: table(self%first:, 0:)   !! (first:last, 0:ny-1)
      real(dp), intent(in) :: x(:, :)
      real(dp), intent(inout) :: y(:, :)               !! may be x
      type(scalar_type) :: multiplier

      allocate (multiplier%table(self%first:self%last, 0:self%ny - 1))
      multiplier%table(:, :) = table/(real(self%nx, dp)*self%ny)
      call pass_through(self, multiplier, x, y)
   end subroutine apply_table

   !> The modes of a field, sum f exp(-i q.x) over the cells. Processes share the wave numbers along y like
   !> the rows of the grid, so that sums over modes are formed like sums over cells.
   subroutine spectrum(self, field, modes)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: field(:, :)              !! [nx, rows]
      complex(dp), intent(inout) :: modes(0:, :)       !! (0:nx/2, rows): the wave numbers along x and y
      integer :: j

      !$omp parallel do default(none) shared(self, field) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%scalar%forward_row(1, j, field(:, j))
      end do
      call self%scalar%columns_forward()
      !$omp parallel do default(none) shared(self, modes) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%scalar%row_modes(1, j, modes(:, j))
      end do
      self%ffts = self%ffts + 1
   end subroutine spectrum

   !> Transform a field, multiply its modes, and transform back.
   subroutine pass_through(self, multiplier, x, y)
      class(steady_operator_type), intent(inout) :: self
      class(multiplier_type), intent(in) :: multiplier
      real(dp), intent(in) :: x(:, :)
      real(dp), intent(inout) :: y(:, :)
      integer :: j

      !$omp parallel do default(none) shared(self, x) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%scalar%forward_row(1, j, x(:, j))
      end do
      call self%scalar%columns_through(multiplier)
      !$omp parallel do default(none) shared(self, y) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%scalar%backward_row(1, j, y(:, j))
      end do
      self%ffts = self%ffts + 2
   end subroutine pass_through

   !> U_T = A_T T and its derivative along the motion.
   subroutine shear(self, traction, displacement, stretch)
      class(steady_operator_type), intent(inout) :: self
      real(dp), intent(in) :: traction(:, :, :)            !! [nx, 2, rows], Pa
      real(dp), intent(inout) :: displacement(:, :, :)     !! [nx, 2, rows], m
      real(dp), intent(inout) :: stretch(:, :, :)          !! dU_T/ds, [nx, 2, rows]
      integer :: j

      !$omp parallel do default(none) shared(self, traction) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%vector%forward_row(1, j, traction(:, 1, j))
         call self%vector%forward_row(2, j, traction(:, 2, j))
      end do
      call self%vector%columns_through(self%tangential)
      !$omp parallel do default(none) shared(self, displacement, stretch) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%rows
         call self%vector%backward_row(1, j, displacement(:, 1, j))
         call self%vector%backward_row(2, j, displacement(:, 2, j))
         call self%vector%backward_row(3, j, stretch(:, 1, j))
         call self%vector%backward_row(4, j, stretch(:, 2, j))
      end do
      self%ffts = self%ffts + 6
   end subroutine shear

   !> Multiply by one symbol.
   subroutine multiply_scalar(self, first, j, modes)
      class(scalar_type), intent(in) :: self
      integer, intent(in) :: first
      integer, intent(in) :: j
      complex(dp), intent(inout) :: modes(:, :)

      modes(:, 1) = self%table(first:first + size(modes, 1) - 1, j)*modes(:, 1)
   end subroutine multiply_scalar

   !> Multiply two inputs by two symmetric tensors.
   subroutine multiply_pair(self, first, j, modes)
      class(pair_type), intent(in) :: self
      integer, intent(in) :: first
      integer, intent(in) :: j
      complex(dp), intent(inout) :: modes(:, :)
      complex(dp) :: x, y
      integer :: i

      do i = 1, size(modes, 1)
         x = modes(i, 1)
         y = modes(i, 2)
         associate (a => self%first(:, first + i - 1, j), b => self%second(:, first + i - 1, j))
            modes(i, 1) = a(1)*x + a(3)*y
            modes(i, 2) = a(3)*x + a(2)*y
            modes(i, 3) = b(1)*x + b(3)*y
            modes(i, 4) = b(3)*x + b(2)*y
         end associate
      end do
   end subroutine multiply_pair

   !> Free plans and memory.
   subroutine destroy(self)
      class(steady_operator_type), intent(inout) :: self

      call self%scalar%destroy()
      call self%vector%destroy()
   end subroutine destroy

end module steady_operator
