!> The convolution operator: displacements of the half-space from tractions, by FFT.
!>
!> u = A p with the influence coefficients of module `influence` (thesis, eq. 2.4), G = 1. Scalar
!> (normal) or 2 x 2 (tangential); periodic, or free on a zero-padded grid.
!>
!> The two-dimensional transform is done by rows and columns of our own, so that
!> * the rows are transformed as the caller forms them (`forward_row`) and the results are handed out
!>   as the inverse makes them (`backward_row`): no pass over memory but the caller's own;
!> * blocks of columns are copied to a buffer that fits the cache, and there transformed, multiplied by
!>   the symbol, summed for the quadratic form (Parseval; thesis, eq. 2.8) and transformed back;
!> * the padded half of a free problem is neither stored nor transformed along x;
!> * each transform is done by one thread, so the results do not depend on their number.
!>
!> Memory: one field (two for a vector operator), doubled along x in free mode, and a quarter of a
!> field (a whole one in free mode) for each symbol. An operator made with `single` takes half of that,
!> works in single precision (module row_column_single), and is used in the same way.
module fft_conv
   use, intrinsic :: iso_c_binding, only : c_associated, c_double_complex, c_f_pointer, c_int, &
      c_loc, c_null_ptr, c_ptr, c_size_t
   use errors, only : error_input, error_type, fail
   use fftw, only : fftw_alloc_real, fftw_backward, fftw_destroy_plan, fftw_execute_dft, &
      fftw_execute_dft_c2r, fftw_execute_dft_r2c, fftw_forward, fftw_free, fftw_plan_many_dft, &
      fftw_plan_many_dft_c2r, fftw_plan_many_dft_r2c
   use influence, only : normal_symbol, tangential_symbol, transform_length
   use omp_lib, only : omp_get_thread_num
   use parallel, only : global_sum, thread_count
   use precision, only : dp, int64
   use regular_grid, only : boundary_periodic, grid_type
   use row_column_single, only : new_row_column_single, row_column_single_type
   use wisdom, only : planning_flag, save_wisdom
   implicit none
   private

   public :: convolution_type, new_normal_operator, new_symbol_operator, new_tangential_operator, &
      new_tensor_symbol_operator

   integer, parameter, public :: columns_apply = 1     !! multiply by the symbol, transform back
   integer, parameter, public :: columns_inverse = 2   !! the same with 1/symbol (0 where it is 0)
   integer, parameter, public :: columns_form = 3      !! only the quadratic form

   integer, parameter :: block = 8                     !! columns at a time: 128 bytes a row
   integer, parameter :: small = 16384                 !! cells below which one thread is faster

   !> One thread's aligned buffers.
   type :: buffer_type
      type(c_ptr) :: row_memory = c_null_ptr
      type(c_ptr) :: column_memory = c_null_ptr
      real(dp), pointer, contiguous :: row(:) => null()
      complex(c_double_complex), pointer, contiguous :: column(:, :, :) => null()
   end type buffer_type

   !> A convolution operator with its plans and its work space. Not to be copied.
   type :: convolution_type
      integer :: nx = 0                     !! cells along x
      integer :: ny = 0                     !! cells along y
      integer :: mx = 0                     !! length of the transforms along x
      integer :: my = 0                     !! length of the transforms along y
      integer :: components = 0             !! 1 scalar, 2 vector
      integer :: threads = 1                !! for parallel loops around forward_row, backward_row
      integer(int64) :: ffts = 0            !! real transforms done so far
      logical :: single = .false.           !! the transforms are in single precision
      !> Symbols over (mx my): (0:, 0:my/2, 1) or xx, yy, xy; zero beyond mx/2. Not there if single.
      real(dp), allocatable :: symbol(:, :, :)
      type(row_column_single_type), private :: low         !! does the work if single
      type(c_ptr), private :: spectrum_memory = c_null_ptr
      complex(dp), pointer, contiguous, private :: spectrum(:, :, :) => null()   !! whole blocks
      type(buffer_type), allocatable, private :: buffers(:)
      type(c_ptr), private :: row_forward = c_null_ptr
      type(c_ptr), private :: row_backward = c_null_ptr
      type(c_ptr), private :: column_forward = c_null_ptr
      type(c_ptr), private :: column_backward = c_null_ptr
   contains
      procedure :: apply
      procedure :: apply_inverse
      procedure :: apply_vector
      procedure :: quadratic_form
      procedure :: quadratic_form_vector
      procedure :: forward_row
      procedure :: forward_zero_row
      procedure :: columns
      procedure :: backward_row
      procedure :: add_backward_row
      procedure :: set_unit
      procedure :: destroy
   end type convolution_type

contains

   !> The normal operator A_zz for G = 1, m/Pa.
   subroutine new_normal_operator(self, grid, poisson, error, single)
      type(convolution_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: single      !! work in single precision

      call plan(self, grid%nx, grid%ny, grid%boundary, 1, error, single)
      if (allocated(error)) return
      call normal_symbol(grid, poisson, self%mx, self%my, self%symbol(0:self%mx/2, :, 1))
      call finish_symbol(self)
   end subroutine new_normal_operator

   !> The tangential operator A_T for G = 1, m/Pa.
   subroutine new_tangential_operator(self, grid, poisson, thickness, error, single)
      type(convolution_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: poisson
      real(dp), intent(in) :: thickness        !! of the block, m: its mean mode in periodic mode
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: single      !! work in single precision

      call plan(self, grid%nx, grid%ny, grid%boundary, 2, error, single)
      if (allocated(error)) return
      call tangential_symbol(grid, poisson, thickness, self%mx, self%my, &
         self%symbol(0:self%mx/2, :, 1), self%symbol(0:self%mx/2, :, 2), &
         self%symbol(0:self%mx/2, :, 3))
      call finish_symbol(self)
   end subroutine new_tangential_operator

   !> A periodic scalar operator from its symbol, even in both wave numbers.
   subroutine new_symbol_operator(self, nx, ny, symbol, error, single)
      type(convolution_type), intent(out) :: self
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: symbol(0:, 0:)      !! (0:nx/2, 0:ny/2)
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: single      !! work in single precision

      call plan(self, nx, ny, boundary_periodic, 1, error, single)
      if (allocated(error)) return
      self%symbol(0:nx/2, :, 1) = symbol
      call finish_symbol(self)
   end subroutine new_symbol_operator

   !> A periodic symmetric 2 x 2 operator from its symbols: xx and yy even, xy odd in both wave numbers.
   subroutine new_tensor_symbol_operator(self, nx, ny, xx, yy, xy, error, single)
      type(convolution_type), intent(out) :: self
      integer, intent(in) :: nx, ny
      real(dp), intent(in) :: xx(0:, 0:)          !! (0:nx/2, 0:ny/2)
      real(dp), intent(in) :: yy(0:, 0:)
      real(dp), intent(in) :: xy(0:, 0:)
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: single      !! work in single precision

      call plan(self, nx, ny, boundary_periodic, 2, error, single)
      if (allocated(error)) return
      self%symbol(0:nx/2, :, 1) = xx
      self%symbol(0:nx/2, :, 2) = yy
      self%symbol(0:nx/2, :, 3) = xy
      call finish_symbol(self)
   end subroutine new_tensor_symbol_operator

   !> Put the factor of the inverse transform into the symbol; hand it on where the work is done.
   subroutine finish_symbol(self)
      type(convolution_type), intent(inout) :: self

      self%symbol = self%symbol/(real(self%mx, dp)*self%my)
      if (.not. self%single) return
      call self%low%set_symbol(self%symbol)
      deallocate (self%symbol)
   end subroutine finish_symbol

   !> Sizes, buffers and plans.
   subroutine plan(self, nx, ny, boundary, components, error, single)
      type(convolution_type), intent(inout) :: self
      integer, intent(in) :: nx, ny, boundary, components
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: single
      integer :: mc
      logical :: planned
      character(80) :: text

      self%nx = nx
      self%ny = ny
      self%mx = transform_length(nx, boundary)
      self%my = transform_length(ny, boundary)
      self%components = components
      self%threads = merge(1, thread_count(), nx*ny < small)
      mc = (self%mx/2 + block)/block*block
      allocate (self%symbol(0:mc - 1, 0:self%my/2, merge(1, 3, components == 1)), source=0.0_dp)
      if (present(single)) self%single = single
      if (self%single) then
         call new_row_column_single(self%low, [nx, ny], [self%mx, self%my], components, self%threads, &
            planned)
      else
         call plan_double(self, mc, planned)
      end if
      if (.not. planned) then
         write (text, '("FFTW has no plan for a grid of ", i0, " x ", i0)') self%mx, self%my
         call fail(error, error_input, trim(text))
         call self%destroy()
      end if
   end subroutine plan

   !> Buffers and plans in double precision.
   subroutine plan_double(self, mc, planned)
      type(convolution_type), intent(inout) :: self
      integer, intent(in) :: mc                    !! length of a spectral row, in whole blocks
      logical, intent(out) :: planned              !! FFTW has plans for these sizes
      integer(c_int) :: flag, lx(1), ly(1), batch
      integer :: j, k

      self%spectrum_memory = fftw_alloc_real(2_c_size_t*mc*self%ny*self%components)
      call c_f_pointer(self%spectrum_memory, self%spectrum, [mc, self%ny, self%components])
      !$omp parallel do default(none) shared(self) private(j, k) &
      !$omp num_threads(self%threads)
      do j = 1, self%ny
         do k = 1, self%components
            self%spectrum(:, j, k) = (0.0_dp, 0.0_dp)
         end do
      end do
      allocate (self%buffers(0:self%threads - 1))
      do k = 0, self%threads - 1
         associate (buffer => self%buffers(k))
            buffer%row_memory = fftw_alloc_real(int(self%mx, c_size_t))
            buffer%column_memory = fftw_alloc_real(2_c_size_t*block*self%my*self%components)
            call c_f_pointer(buffer%row_memory, buffer%row, [self%mx])
            buffer%row = 0.0_dp
            call c_f_pointer(buffer%column_memory, buffer%column, [block, self%components, self%my])
         end associate
      end do

      lx = int(self%mx, c_int)
      ly = int(self%my, c_int)
      batch = int(block*self%components, c_int)
      !$omp critical (fftw_planner)
      flag = planning_flag()
      associate (row => self%buffers(0)%row_memory, column => self%buffers(0)%column_memory, &
         spectrum => self%spectrum_memory)
         self%row_forward = fftw_plan_many_dft_r2c(1, lx, 1, row, lx, 1, 0, &
            spectrum, lx, 1, 0, flag)
         self%row_backward = fftw_plan_many_dft_c2r(1, lx, 1, spectrum, lx, 1, 0, &
            row, lx, 1, 0, flag)
         self%column_forward = fftw_plan_many_dft(1, ly, batch, column, ly, batch, 1, &
            column, ly, batch, 1, fftw_forward, flag)
         self%column_backward = fftw_plan_many_dft(1, ly, batch, column, ly, batch, 1, &
            column, ly, batch, 1, fftw_backward, flag)
      end associate
      call save_wisdom()
      !$omp end critical (fftw_planner)
      planned = c_associated(self%row_forward) .and. c_associated(self%row_backward) &
         .and. c_associated(self%column_forward) .and. c_associated(self%column_backward)
   end subroutine plan_double

   !> u = A p.
   subroutine apply(self, p, u, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: p(:, :)                 !! [nx, ny], Pa
      real(dp), intent(inout) :: u(:, :)              !! [nx, ny], m; may not be p
      real(dp), intent(out), optional :: form         !! p.A p over the cells
      real(dp) :: sum
      integer :: j

      !$omp parallel do default(none) shared(self, p) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%forward_row(1, j, p(:, j))
      end do
      call self%columns(columns_apply, sum)
      if (present(form)) form = sum
      !$omp parallel do default(none) shared(self, u) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%backward_row(1, j, u(:, j))
      end do
   end subroutine apply

   !> p = A^-1 u for a periodic operator; modes that the operator does not move are left out.
   subroutine apply_inverse(self, u, p)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: u(:, :)                 !! [nx, ny], m
      real(dp), intent(inout) :: p(:, :)              !! [nx, ny], Pa
      real(dp) :: sum
      integer :: j

      !$omp parallel do default(none) shared(self, u) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%forward_row(1, j, u(:, j))
      end do
      call self%columns(columns_inverse, sum)
      !$omp parallel do default(none) shared(self, p) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%backward_row(1, j, p(:, j))
      end do
   end subroutine apply_inverse

   !> (ux, uy) = A (px, py).
   subroutine apply_vector(self, px, py, ux, uy, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: px(:, :), py(:, :)          !! [nx, ny], Pa
      real(dp), intent(inout) :: ux(:, :), uy(:, :)       !! [nx, ny], m
      real(dp), intent(out), optional :: form             !! p.A p over the cells
      real(dp) :: sum
      integer :: j

      !$omp parallel do default(none) shared(self, px, py) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%forward_row(1, j, px(:, j))
         call self%forward_row(2, j, py(:, j))
      end do
      call self%columns(columns_apply, sum)
      if (present(form)) form = sum
      !$omp parallel do default(none) shared(self, ux, uy) private(j) num_threads(self%threads)
      do j = 1, self%ny
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
      do j = 1, self%ny
         call self%forward_row(1, j, p(:, j))
      end do
      call self%columns(columns_form, form)
   end subroutine quadratic_form

   !> p.A p over the cells for a vector operator: two transforms.
   subroutine quadratic_form_vector(self, px, py, form)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: px(:, :), py(:, :)
      real(dp), intent(out) :: form
      integer :: j

      !$omp parallel do default(none) shared(self, px, py) private(j) num_threads(self%threads)
      do j = 1, self%ny
         call self%forward_row(1, j, px(:, j))
         call self%forward_row(2, j, py(:, j))
      end do
      call self%columns(columns_form, form)
   end subroutine quadratic_form_vector

   !> Transform row j of a component; to be called for every row, by up to `threads` threads.
   subroutine forward_row(self, component, j, row)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component             !! 1, or 2 of a vector operator
      integer, intent(in) :: j                     !! 1 <= j <= ny
      real(dp), intent(in) :: row(self%nx)

      if (self%single) then
         call self%low%forward_row(component, j, row)
         return
      end if
      associate (buffer => self%buffers(omp_get_thread_num()))
         buffer%row(1:self%nx) = row
         if (self%mx > self%nx) buffer%row(self%nx + 1:) = 0.0_dp
         call fftw_execute_dft_r2c(self%row_forward, buffer%row_memory, &
            spectral_row(self, component, j))
      end associate
   end subroutine forward_row

   !> The same as `forward_row` for a row of zeros.
   subroutine forward_zero_row(self, component, j)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j

      if (self%single) then
         call self%low%forward_zero_row(component, j)
         return
      end if
      self%spectrum(:, j, component) = (0.0_dp, 0.0_dp)
   end subroutine forward_zero_row

   !> Row j of the result of a component.
   subroutine backward_row(self, component, j, row)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(out) :: row(self%nx)

      if (self%single) then
         call self%low%backward_row(component, j, row)
         return
      end if
      associate (buffer => self%buffers(omp_get_thread_num()))
         call fftw_execute_dft_c2r(self%row_backward, spectral_row(self, component, j), &
            buffer%row_memory)
         row = buffer%row(1:self%nx)
      end associate
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
         return
      end if
      associate (buffer => self%buffers(omp_get_thread_num()))
         call fftw_execute_dft_c2r(self%row_backward, spectral_row(self, component, j), &
            buffer%row_memory)
         row = row + factor*buffer%row(1:self%nx)
      end associate
   end subroutine add_backward_row

   !> Tell a single operator how large values are, about, that it gets from the next `forward_row` on, so
   !> that their squares are in its range: 1 at first. A double one needs no such help.
   subroutine set_unit(self, size)
      class(convolution_type), intent(inout) :: self
      real(dp), intent(in) :: size                 !! 1 is taken where it is not positive

      if (self%single) call self%low%set_unit(size)
   end subroutine set_unit

   !> Address of row j of the spectrum of a component.
   function spectral_row(self, component, j) result(address)
      class(convolution_type), intent(in) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      type(c_ptr) :: address

      address = c_loc(self%spectrum(1, j, component))
   end function spectral_row

   !> Between the rows' two passes: transform the columns, multiply by the symbol, transform back.
   subroutine columns(self, action, form)
      class(convolution_type), intent(inout) :: self
      integer, intent(in) :: action                !! columns_apply, columns_inverse or columns_form
      real(dp), intent(out) :: form                !! p.(symbol p) over the cells
      real(dp), allocatable :: partial(:)
      integer :: blocks, b, c, j, first

      self%ffts = self%ffts + merge(1, 2, action == columns_form)*self%components
      if (self%single) then
         call self%low%columns(action == columns_inverse, action /= columns_form, form)
         form = global_sum(form)
         return
      end if
      blocks = (self%mx/2 + block)/block
      allocate (partial(blocks))
      !$omp parallel do default(none) shared(self, action, partial, blocks) &
      !$omp private(b, c, j, first) num_threads(self%threads)
      do b = 1, blocks
         first = (b - 1)*block
         associate (column => self%buffers(omp_get_thread_num())%column, &
            memory => self%buffers(omp_get_thread_num())%column_memory)
            do c = 1, self%components
               do j = 1, self%ny
                  column(:, c, j) = self%spectrum(first + 1:first + block, j, c)
               end do
               do j = self%ny + 1, self%my
                  column(:, c, j) = (0.0_dp, 0.0_dp)
               end do
            end do
            if (self%my > 1) call fftw_execute_dft(self%column_forward, memory, memory)
            if (self%components == 2) then
               call multiply_tensor(self, first, column, partial(b))
            else if (action == columns_inverse) then
               call divide_scalar(self, first, column, partial(b))
            else
               call multiply_scalar(self, first, column, partial(b))
            end if
            if (action /= columns_form) then
               if (self%my > 1) call fftw_execute_dft(self%column_backward, memory, memory)
               do c = 1, self%components
                  do j = 1, self%ny
                     self%spectrum(first + 1:first + block, j, c) = column(:, c, j)
                  end do
               end do
            end if
         end associate
      end do
      form = 0.0_dp
      do b = 1, blocks
         form = form + partial(b)
      end do
      form = global_sum(form)
   end subroutine columns

   !> Multiply a block of columns by the scalar symbol and sum the quadratic form.
   subroutine multiply_scalar(self, first, column, form)
      class(convolution_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number of the first column
      complex(dp), intent(inout) :: column(block, self%my)
      real(dp), intent(out) :: form
      real(dp) :: sums(block)
      integer :: i, j, k

      sums = 0.0_dp
      do j = 1, self%my
         k = min(j - 1, self%my - j + 1)
         do i = 1, block
            associate (factor => self%symbol(first + i - 1, k, 1))
               sums(i) = sums(i) + factor*(real(column(i, j))**2 + aimag(column(i, j))**2)
               column(i, j) = factor*column(i, j)
            end associate
         end do
      end do
      form = sum(column_weights(self, first)*sums)
   end subroutine multiply_scalar

   !> Multiply a block of columns by the inverse of the scalar symbol, 0 where that is 0.
   subroutine divide_scalar(self, first, column, form)
      class(convolution_type), intent(in) :: self
      integer, intent(in) :: first
      complex(dp), intent(inout) :: column(block, self%my)
      real(dp), intent(out) :: form                !! with the inverse symbol
      real(dp) :: sums(block), factor, cells
      integer :: i, j, k

      sums = 0.0_dp
      cells = (real(self%mx, dp)*self%my)**2
      do j = 1, self%my
         k = min(j - 1, self%my - j + 1)
         do i = 1, block
            factor = self%symbol(first + i - 1, k, 1)
            if (abs(factor) > 0.0_dp) factor = 1.0_dp/(factor*cells)
            sums(i) = sums(i) + factor*(real(column(i, j))**2 + aimag(column(i, j))**2)
            column(i, j) = factor*column(i, j)
         end do
      end do
      form = sum(column_weights(self, first)*sums)
   end subroutine divide_scalar

   !> Multiply a block of columns by the 2 x 2 symbol and sum the quadratic form.
   subroutine multiply_tensor(self, first, column, form)
      class(convolution_type), intent(in) :: self
      integer, intent(in) :: first
      complex(dp), intent(inout) :: column(block, 2, self%my)
      real(dp), intent(out) :: form
      real(dp) :: sums(block), xy, sign
      complex(dp) :: x, y, ux, uy
      integer :: i, j, jj

      sums = 0.0_dp
      do j = 1, self%my
         jj = min(j - 1, self%my - j + 1)
         sign = merge(1.0_dp, -1.0_dp, j - 1 <= self%my/2)
         do i = 1, block
            x = column(i, 1, j)
            y = column(i, 2, j)
            xy = sign*self%symbol(first + i - 1, jj, 3)
            ux = self%symbol(first + i - 1, jj, 1)*x + xy*y
            uy = xy*x + self%symbol(first + i - 1, jj, 2)*y
            sums(i) = sums(i) + real(x)*real(ux) + aimag(x)*aimag(ux) &
               + real(y)*real(uy) + aimag(y)*aimag(uy)
            column(i, 1, j) = ux
            column(i, 2, j) = uy
         end do
      end do
      form = sum(column_weights(self, first)*sums)
   end subroutine multiply_tensor

   !> How often a column of the half spectrum counts in a sum over the whole one.
   pure function column_weights(self, first) result(weight)
      class(convolution_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number of the first column
      real(dp) :: weight(block)
      integer :: i

      weight = 2.0_dp
      do i = 1, block
         if (first + i - 1 == 0 .or. 2*(first + i - 1) == self%mx) weight(i) = 1.0_dp
      end do
   end function column_weights

   !> Free plans and memory.
   subroutine destroy(self)
      class(convolution_type), intent(inout) :: self
      integer :: k

      if (self%single) call self%low%destroy()
      !$omp critical (fftw_planner)
      if (c_associated(self%row_forward)) call fftw_destroy_plan(self%row_forward)
      if (c_associated(self%row_backward)) call fftw_destroy_plan(self%row_backward)
      if (c_associated(self%column_forward)) call fftw_destroy_plan(self%column_forward)
      if (c_associated(self%column_backward)) call fftw_destroy_plan(self%column_backward)
      !$omp end critical (fftw_planner)
      self%row_forward = c_null_ptr
      self%row_backward = c_null_ptr
      self%column_forward = c_null_ptr
      self%column_backward = c_null_ptr
      if (allocated(self%buffers)) then
         do k = lbound(self%buffers, 1), ubound(self%buffers, 1)
            call fftw_free(self%buffers(k)%row_memory)
            call fftw_free(self%buffers(k)%column_memory)
         end do
         deallocate (self%buffers)
      end if
      if (c_associated(self%spectrum_memory)) call fftw_free(self%spectrum_memory)
      self%spectrum_memory = c_null_ptr
      nullify (self%spectrum)
      if (allocated(self%symbol)) deallocate (self%symbol)
   end subroutine destroy

end module fft_conv
