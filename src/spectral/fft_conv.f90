!> The convolution operator: displacements of the half-space from tractions, by FFT.
!>
!> The operator computes u = A p, where A is the response of a solid with the shear modulus 1 (module `kernels`;
!> thesis, eq. 2.4). It is scalar (normal) or 2 x 2 (tangential), and either periodic or free on a zero-padded
!> grid.
!>
!> The two-dimensional transform consists of our own passes over rows and columns (`row_column.inc`). A
!> solver can thus pass each row as soon as it is formed, and use each row of the result as soon as it is
!> transformed back (`forward_row`, `columns`, `backward_row`). The padded half of a free problem costs nothing
!> along x. The quadratic form p.A p is obtained in the same pass (Parseval; thesis, eq. 2.8).
!>
!> Memory: one field (two for a vector operator), doubled along x in free mode, and a quarter of a
!> field (a whole one in free mode) for each symbol. An operator made with `single` takes half of that,
!> works in single precision, and is used in the same way. Operators that are never in use at the same time can
!> share the memory of their spectra (`spectrum_memory`). A periodic operator of a solid made with
!> `lean` has no table of its symbol: it computes the symbol in every product, which takes longer.
module fft_conv
   use, intrinsic :: iso_c_binding, only : c_ptr
   use asperity_errors, only : error_input, error_type, fail
   use computed_symbol, only : computed_symbol_type
   use kernels, only : kernel_type
   use asperity_threads, only : least_parallel_cells, thread_count
   use asperity_precision, only : dp, int64, power_of_two
   use regular_grid, only : boundary_periodic, grid_type
   use row_column_double, only : new_row_column_double => new_row_column, &
      row_column_double_type => row_column_type
   use row_column_single, only : new_row_column_single => new_row_column, &
      row_column_single_type => row_column_type
   use row_sharing, only : row_sharing_type
   use text_tools, only : to_text
   use symbol_table, only : new_symbol_table, symbol_table_type
   use transform_shape, only : shape_on_grid, transform_shape_type
   implicit none
   private

   public :: convolution_type, new_convolution, new_inverse_convolution, new_symbol_operator

   integer, parameter, public :: columns_apply = 1     !! multiply by the symbol, transform back
   integer, parameter, public :: columns_inverse = 2   !! the same with 1/symbol (0 where it is 0)
   integer, parameter, public :: columns_form = 3      !! only the quadratic form


   !> A convolution operator with its plans and its work space. A variable of this type must not be copied.
   type :: convolution_type
      integer :: nx = 0                     !! cells along x
      integer :: ny = 0                     !! cells along y
      integer :: rows = 0                   !! rows of this process
      integer :: mx = 0                     !! length of the transforms along x
      integer :: my = 0                     !! length of the transforms along y
      integer :: components = 0             !! 1 scalar, 2 vector
      integer :: threads = 1                !! for parallel loops around forward_row, backward_row
      integer(int64) :: ffts = 0            !! real transforms done so far
      logical :: single = .false.           !! the transforms are in single precision
      logical :: shared = .false.           !! processes share the rows
      type(grid_type) :: grid               !! of an operator of a solid
      type(kernel_type) :: kernel           !! what the solid is
      type(symbol_table_type) :: symbols    !! no values if lean
      type(row_column_double_type), private :: high        !! does the work if not single
      type(row_column_single_type), private :: low         !! does the work if single
   contains
      procedure :: apply
      procedure :: apply_inverse
      procedure :: apply_vector
      procedure :: quadratic_form
      procedure :: forward_row
      procedure :: forward_zero_row
      procedure :: columns
      procedure :: backward_row
      procedure :: add_backward_row
      procedure :: set_unit
      procedure :: spectrum_memory
      procedure :: spectrum_length
      procedure :: modes
      procedure :: set_symbol
      procedure :: destroy
   end type convolution_type

contains

   !> The operator of a solid of unit shear modulus, m/Pa.
   subroutine new_convolution(self, grid, kernel, error, single, memory, lean, sharing)
      type(convolution_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel      !! what the solid is
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      logical, intent(in), optional :: single      !! work in single precision
      type(c_ptr), intent(in), optional :: memory  !! of another operator, never in use at the same time
      logical, intent(in), optional :: lean        !! no table of the symbol, where that is possible
      type(row_sharing_type), intent(in), optional :: sharing   !! of the rows; absent: that of the grid
      real(dp), allocatable :: table(:, :, :)
      logical :: tabulated

      call check_grid(grid, error)
      if (.not. allocated(error) .and. grid%boundary /= boundary_periodic .and. .not. associated(kernel%cell)) &
         call fail(error, error_input, 'this solid is for periodic boundaries only')
      call check_poisson(kernel, error)
      if (allocated(error)) return
      call plan(self, shape_on_grid(grid, kernel%components, sharing), error, single, memory)
      if (allocated(error)) return
      self%grid = grid
      self%kernel = kernel
      tabulated = .true.
      if (present(lean)) tabulated = .not. lean
      if (grid%boundary /= boundary_periodic .or. kernel%components > 1 .or. self%single) tabulated = .true.
      if (.not. tabulated) return
      call self%symbols%new_modes(table)
      call kernel%symbols(grid, self%mx, self%my, table, self%symbols%first)
      call self%symbols%set(table)
   end subroutine new_convolution

   !> Refuse a grid on which there is no operator.
   subroutine check_grid(grid, error)
      type(grid_type), intent(in) :: grid
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(:), allocatable :: fault

      if (allocated(error)) return
      fault = grid%fault()
      if (fault /= '') call fail(error, error_input, fault)
   end subroutine check_grid

   !> Refuse a Poisson ratio that no elastic solid has.
   subroutine check_poisson(kernel, error)
      type(kernel_type), intent(in) :: kernel
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error) .or. (kernel%poisson > -1.0_dp .and. kernel%poisson <= 0.5_dp)) return
      call fail(error, error_input, 'poisson = '//to_text(kernel%poisson)//': must be > -1 and <= 0.5')
   end subroutine check_poisson

   !> The inverse of the operator of a solid on a periodic grid: tractions from displacements, Pa/m.
   subroutine new_inverse_convolution(self, grid, kernel, error)
      type(convolution_type), intent(out) :: self
      type(grid_type), intent(in) :: grid          !! periodic
      type(kernel_type), intent(in) :: kernel      !! what the solid is
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      real(dp), allocatable :: table(:, :, :)

      call check_grid(grid, error)
      call check_poisson(kernel, error)
      if (allocated(error)) return
      call plan(self, shape_on_grid(grid, kernel%components), error)
      if (allocated(error)) return
      self%grid = grid
      self%kernel = kernel
      call self%symbols%new_modes(table)
      call kernel%inverse_symbols(grid, table, self%symbols%first)
      call self%symbols%set(table)
   end subroutine new_inverse_convolution

   !> A periodic scalar operator whose symbol, even in both wave numbers, the caller sets for its `modes`.
   subroutine new_symbol_operator(self, shape, error, single)
      type(convolution_type), intent(out) :: self
      type(transform_shape_type), intent(in) :: shape
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      logical, intent(in), optional :: single      !! work in single precision

      call plan(self, shape, error, single)
   end subroutine new_symbol_operator

   !> First and last wave number along x for which this process has a symbol; none if the last is less.
   pure function modes(self)
      class(convolution_type), intent(in) :: self
      integer :: modes(2)

      modes = [self%symbols%first, self%symbols%last]
   end function modes

   !> Set the symbol of an operator that was made without one. Collective.
   subroutine set_symbol(self, symbol)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: symbol(:, :)         !! [modes of this process, 0:my/2]

      call self%symbols%set(reshape(symbol, [shape(symbol), 1]))
   end subroutine set_symbol

   !> Set the sizes, and make the buffers and plans.
   subroutine plan(self, shape, error, single, memory)
      type(convolution_type), intent(inout) :: self
      type(transform_shape_type), intent(in) :: shape
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      logical, intent(in), optional :: single
      type(c_ptr), intent(in), optional :: memory

      if (allocated(error)) return
      self%nx = shape%nx
      self%ny = shape%ny
      self%rows = shape%rows()
      self%shared = shape%shared
      self%mx = shape%mx
      self%my = shape%my
      self%components = shape%components
      self%threads = merge(1, thread_count(), real(shape%nx, dp)*shape%ny < least_parallel_cells)
      if (present(single)) self%single = single
      if (self%single) then
         call new_row_column_single(self%low, shape, self%threads, error, memory)
         if (.not. allocated(error)) call new_symbol_table(self%symbols, shape, self%low%own_columns(), self%single)
      else
         call new_row_column_double(self%high, shape, self%threads, error, memory)
         if (.not. allocated(error)) call new_symbol_table(self%symbols, shape, self%high%own_columns(), self%single)
      end if
   end subroutine plan

   !> The memory of the spectrum, aligned for FFTW, of at least a field of doubles (half of that if
   !> single). Another operator may use it while this one is not computing a product.
   pure function spectrum_memory(self) result(memory)
      class(convolution_type), intent(in) :: self
      type(c_ptr) :: memory

      memory = self%high%spectrum_memory
      if (self%single) memory = self%low%spectrum_memory
   end function spectrum_memory

   !> Numbers in double precision for which that memory has space.
   pure function spectrum_length(self) result(length)
      class(convolution_type), intent(in) :: self
      integer(int64) :: length

      length = self%high%spectrum_length()
      if (self%single) length = self%low%spectrum_length()/2
   end function spectrum_length

   !> u = A p.
   subroutine apply(self, p, u, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: p(:, :)                 !! [nx, rows], Pa
      real(dp), intent(inout) :: u(:, :)              !! [nx, rows], m; may not be p
      real(dp), intent(out), optional :: form         !! p.A p over the cells
      integer :: j

      !$omp parallel do default(none) shared(self, p) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%forward_row(1, j, p(:, j))
      end do
      call self%columns(columns_apply, form)
      !$omp parallel do default(none) shared(self, u) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%backward_row(1, j, u(:, j))
      end do
   end subroutine apply

   !> p = A^-1 u for a periodic operator. Modes whose symbol is zero are left out.
   subroutine apply_inverse(self, u, p)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: u(:, :)                 !! [nx, rows], m
      real(dp), intent(inout) :: p(:, :)              !! [nx, rows], Pa
      integer :: j

      !$omp parallel do default(none) shared(self, u) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%forward_row(1, j, u(:, j))
      end do
      call self%columns(columns_inverse)
      !$omp parallel do default(none) shared(self, p) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%backward_row(1, j, p(:, j))
      end do
   end subroutine apply_inverse

   !> (ux, uy) = A (px, py).
   subroutine apply_vector(self, px, py, ux, uy, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: px(:, :), py(:, :)          !! [nx, rows], Pa
      real(dp), intent(inout) :: ux(:, :), uy(:, :)       !! [nx, rows], m
      real(dp), intent(out), optional :: form             !! p.A p over the cells
      integer :: j

      !$omp parallel do default(none) shared(self, px, py) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%forward_row(1, j, px(:, j))
         call self%forward_row(2, j, py(:, j))
      end do
      call self%columns(columns_apply, form)
      !$omp parallel do default(none) shared(self, ux, uy) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%backward_row(1, j, ux(:, j))
         call self%backward_row(2, j, uy(:, j))
      end do
   end subroutine apply_vector

   !> p.A p over the cells, by Parseval's theorem: one transform.
   subroutine quadratic_form(self, p, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: p(:, :)
      real(dp), intent(out) :: form
      integer :: j

      !$omp parallel do default(none) shared(self, p) private(j) num_threads(self%threads)
      do j = 1, self%rows
         call self%forward_row(1, j, p(:, j))
      end do
      call self%columns(columns_form, form)
   end subroutine quadratic_form

   !> Transform row j of a component. This must be called for every row; up to `threads` threads may do so.
   subroutine forward_row(self, component, j, row)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component             !! 1, or 2 of a vector operator
      integer, intent(in) :: j                     !! 1 <= j <= rows
      real(dp), intent(in) :: row(self%nx)

      if (self%single) then
         call self%low%forward_row(component, j, row)
      else
         call self%high%forward_row(component, j, row)
      end if
   end subroutine forward_row

   !> Do the same as `forward_row` for a row of zeros.
   subroutine forward_zero_row(self, component, j)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j

      if (self%single) then
         call self%low%forward_zero_row(component, j)
      else
         call self%high%forward_zero_row(component, j)
      end if
   end subroutine forward_zero_row

   !> Row j of the result of a component.
   subroutine backward_row(self, component, j, row)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(out) :: row(self%nx)

      if (self%single) then
         call self%low%backward_row(component, j, row)
      else
         call self%high%backward_row(component, j, row)
      end if
   end subroutine backward_row

   !> Add `factor` times row j of the result of a component.
   subroutine add_backward_row(self, component, j, factor, row)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(in) :: factor
      real(dp), intent(inout) :: row(self%nx)

      if (self%single) then
         call self%low%add_backward_row(component, j, factor, row)
      else
         call self%high%add_backward_row(component, j, factor, row)
      end if
   end subroutine add_backward_row

   !> Set the unit in which an operator in single precision takes values from the next `forward_row` on, so that
   !> their squares stay within its range: about the magnitude of the values, 1 at first. In double precision
   !> this has no effect.
   subroutine set_unit(self, size)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: size                 !! 1 is used if it is not positive

      if (self%single) call self%low%set_unit(power_of_two(size))
   end subroutine set_unit

   !> The middle part of a product, between `forward_row` and `backward_row`: transform the columns, multiply by the
   !> symbol, and transform the columns back.
   subroutine columns(self, action, form)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: action                !! columns_apply, columns_inverse or columns_form
      real(dp), intent(out), optional :: form      !! p.(symbol p) over the cells
      logical :: inverse, back

      inverse = action == columns_inverse
      back = action /= columns_form
      self%ffts = self%ffts + merge(2, 1, back)*self%components
      if (self%single) then
         call self%low%columns(self%symbols%low_values, self%symbols%unit, inverse, back, form)
      else if (.not. allocated(self%symbols%values)) then
         call self%high%columns_computed(computed_symbol_type(self%grid, self%kernel), inverse, form)
      else
         call self%high%columns(self%symbols%values, self%symbols%unit, inverse, back, form)
      end if
   end subroutine columns

   !> Free plans and memory.
   subroutine destroy(self)
      class(convolution_type), intent(inout) :: self

      call self%low%destroy()
      call self%high%destroy()
      call self%symbols%destroy()
   end subroutine destroy

end module fft_conv
