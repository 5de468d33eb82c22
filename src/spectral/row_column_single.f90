!> The transforms of module `fft_conv` in single precision: half the memory, about half the time.
!>
!> The same rows, blocks of columns and symbols; fields come in and go out in double precision and are
!> converted row by row, and the quadratic form is summed in double. Results are good to about 1e-7 of
!> the largest value. Values and symbols are taken in units about as large as they are, so that their
!> squares stay in the range of single precision whatever the units of the caller.
module row_column_single
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_float_complex, c_int, c_loc, &
      c_null_ptr, c_ptr, c_size_t
   use fftw, only : fftw_backward, fftw_forward, fftwf_alloc_real, fftwf_destroy_plan, &
      fftwf_execute_dft, fftwf_execute_dft_c2r, fftwf_execute_dft_r2c, fftwf_free, &
      fftwf_plan_many_dft, fftwf_plan_many_dft_c2r, fftwf_plan_many_dft_r2c
   use omp_lib, only : omp_get_thread_num
   use precision, only : dp, sp
   use wisdom, only : planning_flag, save_wisdom
   implicit none
   private

   public :: new_row_column_single, row_column_single_type

   integer, parameter :: block = 8                     !! columns at a time: 64 bytes a row

   !> One thread's aligned buffers.
   type :: buffer_type
      type(c_ptr) :: row_memory = c_null_ptr
      type(c_ptr) :: column_memory = c_null_ptr
      real(sp), pointer, contiguous :: row(:) => null()
      complex(c_float_complex), pointer, contiguous :: column(:, :, :) => null()
   end type buffer_type

   !> Plans, symbols and work space. Not to be copied.
   type :: row_column_single_type
      integer, private :: nx = 0, ny = 0           !! cells
      integer, private :: mx = 0, my = 0           !! lengths of the transforms
      integer, private :: components = 0
      integer, private :: threads = 1
      real(dp), private :: unit = 1.0_dp           !! of the values, a power of two
      real(dp), private :: scale = 1.0_dp          !! of the symbols, a power of two
      real(dp), private :: product_unit = 1.0_dp   !! of the result
      real(sp), allocatable, private :: symbol(:, :, :)
      type(c_ptr), private :: spectrum_memory = c_null_ptr
      complex(sp), pointer, contiguous, private :: spectrum(:, :, :) => null()   !! whole blocks
      type(buffer_type), allocatable, private :: buffers(:)
      type(c_ptr), private :: row_forward = c_null_ptr
      type(c_ptr), private :: row_backward = c_null_ptr
      type(c_ptr), private :: column_forward = c_null_ptr
      type(c_ptr), private :: column_backward = c_null_ptr
   contains
      procedure :: set_symbol
      procedure :: set_unit
      procedure :: forward_row
      procedure :: forward_zero_row
      procedure :: columns
      procedure :: backward_row
      procedure :: add_backward_row
      procedure :: destroy
   end type row_column_single_type

contains

   !> Sizes, buffers and plans.
   subroutine new_row_column_single(self, cells, lengths, components, threads, planned)
      type(row_column_single_type), intent(out) :: self
      integer, intent(in) :: cells(2)              !! nx, ny
      integer, intent(in) :: lengths(2)            !! of the transforms along x and y
      integer, intent(in) :: components            !! 1 scalar, 2 vector
      integer, intent(in) :: threads
      logical, intent(out) :: planned              !! FFTW has plans for these sizes
      integer(c_int) :: flag, lx(1), ly(1), batch
      integer :: mc, j, k

      self%nx = cells(1)
      self%ny = cells(2)
      self%mx = lengths(1)
      self%my = lengths(2)
      self%components = components
      self%threads = threads
      mc = (self%mx/2 + block)/block*block
      self%spectrum_memory = fftwf_alloc_real(2_c_size_t*mc*self%ny*components)
      call c_f_pointer(self%spectrum_memory, self%spectrum, [mc, self%ny, components])
      !$omp parallel do default(none) shared(self, components) private(j, k) num_threads(threads)
      do j = 1, self%ny
         do k = 1, components
            self%spectrum(:, j, k) = (0.0_sp, 0.0_sp)
         end do
      end do
      allocate (self%buffers(0:threads - 1))
      do k = 0, threads - 1
         associate (buffer => self%buffers(k))
            buffer%row_memory = fftwf_alloc_real(int(self%mx, c_size_t))
            buffer%column_memory = fftwf_alloc_real(2_c_size_t*block*self%my*components)
            call c_f_pointer(buffer%row_memory, buffer%row, [self%mx])
            buffer%row = 0.0_sp
            call c_f_pointer(buffer%column_memory, buffer%column, [block, components, self%my])
         end associate
      end do

      lx = int(self%mx, c_int)
      ly = int(self%my, c_int)
      batch = int(block*components, c_int)
      !$omp critical (fftw_planner)
      flag = planning_flag()
      associate (row => self%buffers(0)%row_memory, column => self%buffers(0)%column_memory, &
         spectrum => self%spectrum_memory)
         self%row_forward = fftwf_plan_many_dft_r2c(1, lx, 1, row, lx, 1, 0, &
            spectrum, lx, 1, 0, flag)
         self%row_backward = fftwf_plan_many_dft_c2r(1, lx, 1, spectrum, lx, 1, 0, &
            row, lx, 1, 0, flag)
         self%column_forward = fftwf_plan_many_dft(1, ly, batch, column, ly, batch, 1, &
            column, ly, batch, 1, fftw_forward, flag)
         self%column_backward = fftwf_plan_many_dft(1, ly, batch, column, ly, batch, 1, &
            column, ly, batch, 1, fftw_backward, flag)
      end associate
      call save_wisdom()
      !$omp end critical (fftw_planner)
      planned = c_associated(self%row_forward) .and. c_associated(self%row_backward) &
         .and. c_associated(self%column_forward) .and. c_associated(self%column_backward)
   end subroutine new_row_column_single

   !> Take over the symbols of the operator, the factor of the inverse transform in them.
   subroutine set_symbol(self, symbol)
      class(row_column_single_type), intent(inout) :: self
      real(dp), intent(in) :: symbol(0:, 0:, :)    !! (0:, 0:my/2, 1 or 3)
      integer :: last

      allocate (self%symbol(0:size(self%spectrum, 1) - 1, 0:self%my/2, size(symbol, 3)), source=0.0_sp)
      last = self%mx/2
      self%scale = power_of_two(maxval(abs(symbol)))
      self%symbol(0:last, :, :) = real(symbol(0:last, :, :)/self%scale, sp)
   end subroutine set_symbol

   !> Set the unit in which values are taken from the next `forward_row` on.
   pure subroutine set_unit(self, size)
      class(row_column_single_type), intent(inout) :: self
      real(dp), intent(in) :: size                 !! of a usual value; 1 where it is not positive

      self%unit = power_of_two(size)
   end subroutine set_unit

   !> The power of two above a positive number, 1 for others.
   elemental function power_of_two(x)
      real(dp), intent(in) :: x
      real(dp) :: power_of_two

      power_of_two = 1.0_dp
      if (x > 0.0_dp) power_of_two = scale(1.0_dp, exponent(x))
   end function power_of_two

   !> Transform row j of a component.
   subroutine forward_row(self, component, j, row)
      class(row_column_single_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(in) :: row(self%nx)

      associate (buffer => self%buffers(omp_get_thread_num()))
         buffer%row(1:self%nx) = real((1.0_dp/self%unit)*row, sp)
         if (self%mx > self%nx) buffer%row(self%nx + 1:) = 0.0_sp
         call fftwf_execute_dft_r2c(self%row_forward, buffer%row_memory, &
            c_loc(self%spectrum(1, j, component)))
      end associate
   end subroutine forward_row

   !> The same for a row of zeros.
   subroutine forward_zero_row(self, component, j)
      class(row_column_single_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j

      self%spectrum(:, j, component) = (0.0_sp, 0.0_sp)
   end subroutine forward_zero_row

   !> Row j of the result of a component.
   subroutine backward_row(self, component, j, row)
      class(row_column_single_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(out) :: row(self%nx)

      associate (buffer => self%buffers(omp_get_thread_num()))
         call fftwf_execute_dft_c2r(self%row_backward, c_loc(self%spectrum(1, j, component)), &
            buffer%row_memory)
         row = self%product_unit*real(buffer%row(1:self%nx), dp)
      end associate
   end subroutine backward_row

   !> Add `factor` times row j of the result of a component.
   subroutine add_backward_row(self, component, j, factor, row)
      class(row_column_single_type), intent(inout) :: self
      integer, intent(in) :: component
      integer, intent(in) :: j
      real(dp), intent(in) :: factor
      real(dp), intent(inout) :: row(self%nx)

      associate (buffer => self%buffers(omp_get_thread_num()))
         call fftwf_execute_dft_c2r(self%row_backward, c_loc(self%spectrum(1, j, component)), &
            buffer%row_memory)
         row = row + (factor*self%product_unit)*real(buffer%row(1:self%nx), dp)
      end associate
   end subroutine add_backward_row

   !> Between the rows' two passes: transform the columns, multiply by the symbol, transform back.
   subroutine columns(self, inverse, back, form)
      class(row_column_single_type), intent(inout) :: self
      logical, intent(in) :: inverse               !! by 1/symbol (0 where it is 0), scalar only
      logical, intent(in) :: back                  !! transform back
      real(dp), intent(out) :: form                !! p.(symbol p) over the cells
      real(dp), allocatable :: partial(:)
      integer :: blocks, b, c, j, first

      self%product_unit = self%unit*merge(1.0_dp/self%scale, self%scale, inverse)
      blocks = (self%mx/2 + block)/block
      allocate (partial(blocks))
      !$omp parallel do default(none) shared(self, inverse, back, partial, blocks) &
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
                  column(:, c, j) = (0.0_sp, 0.0_sp)
               end do
            end do
            if (self%my > 1) call fftwf_execute_dft(self%column_forward, memory, memory)
            if (self%components == 2) then
               call multiply_tensor(self, first, column, partial(b))
            else if (inverse) then
               call divide_scalar(self, first, column, partial(b))
            else
               call multiply_scalar(self, first, column, partial(b))
            end if
            if (back) then
               if (self%my > 1) call fftwf_execute_dft(self%column_backward, memory, memory)
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
      form = form*self%unit*self%product_unit
   end subroutine columns

   !> Multiply a block of columns by the scalar symbol and sum the quadratic form.
   subroutine multiply_scalar(self, first, column, form)
      class(row_column_single_type), intent(in) :: self
      integer, intent(in) :: first                 !! wave number of the first column
      complex(sp), intent(inout) :: column(block, self%my)
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
      class(row_column_single_type), intent(in) :: self
      integer, intent(in) :: first
      complex(sp), intent(inout) :: column(block, self%my)
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
            sums(i) = sums(i) + factor*(real(column(i, j), dp)**2 + real(aimag(column(i, j)), dp)**2)
            column(i, j) = real(factor, sp)*column(i, j)
         end do
      end do
      form = sum(column_weights(self, first)*sums)
   end subroutine divide_scalar

   !> Multiply a block of columns by the 2 x 2 symbol and sum the quadratic form.
   subroutine multiply_tensor(self, first, column, form)
      class(row_column_single_type), intent(in) :: self
      integer, intent(in) :: first
      complex(sp), intent(inout) :: column(block, 2, self%my)
      real(dp), intent(out) :: form
      real(dp) :: sums(block)
      real(sp) :: xy, sign
      complex(sp) :: x, y, ux, uy
      integer :: i, j, jj

      sums = 0.0_dp
      do j = 1, self%my
         jj = min(j - 1, self%my - j + 1)
         sign = merge(1.0_sp, -1.0_sp, j - 1 <= self%my/2)
         do i = 1, block
            x = column(i, 1, j)
            y = column(i, 2, j)
            xy = sign*self%symbol(first + i - 1, jj, 3)
            ux = self%symbol(first + i - 1, jj, 1)*x + xy*y
            uy = xy*x + self%symbol(first + i - 1, jj, 2)*y
            sums(i) = sums(i) + real(x, dp)*real(ux) + real(aimag(x), dp)*aimag(ux) &
               + real(y, dp)*real(uy) + real(aimag(y), dp)*aimag(uy)
            column(i, 1, j) = ux
            column(i, 2, j) = uy
         end do
      end do
      form = sum(column_weights(self, first)*sums)
   end subroutine multiply_tensor

   !> How often a column of the half spectrum counts in a sum over the whole one.
   pure function column_weights(self, first) result(weight)
      class(row_column_single_type), intent(in) :: self
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
      class(row_column_single_type), intent(inout) :: self
      integer :: k

      !$omp critical (fftw_planner)
      if (c_associated(self%row_forward)) call fftwf_destroy_plan(self%row_forward)
      if (c_associated(self%row_backward)) call fftwf_destroy_plan(self%row_backward)
      if (c_associated(self%column_forward)) call fftwf_destroy_plan(self%column_forward)
      if (c_associated(self%column_backward)) call fftwf_destroy_plan(self%column_backward)
      !$omp end critical (fftw_planner)
      self%row_forward = c_null_ptr
      self%row_backward = c_null_ptr
      self%column_forward = c_null_ptr
      self%column_backward = c_null_ptr
      if (allocated(self%buffers)) then
         do k = lbound(self%buffers, 1), ubound(self%buffers, 1)
            call fftwf_free(self%buffers(k)%row_memory)
            call fftwf_free(self%buffers(k)%column_memory)
         end do
         deallocate (self%buffers)
      end if
      if (c_associated(self%spectrum_memory)) call fftwf_free(self%spectrum_memory)
      self%spectrum_memory = c_null_ptr
      nullify (self%spectrum)
      if (allocated(self%symbol)) deallocate (self%symbol)
   end subroutine destroy

end module row_column_single
