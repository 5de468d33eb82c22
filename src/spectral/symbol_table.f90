!> The table of an operator's symbols, the factors by which the operator multiplies each wave.
!>
!> A forward and an inverse transform together multiply a field by the number of points. The table holds the
!> symbols divided by this number, so that no extra pass is needed. A process has the wave numbers along x
!> of the columns that it transforms. The symbols of a column lie one after the other, because the modes of a block of
!> columns are multiplied column by column. In single precision the symbols are stored divided by a power of two,
!> the `unit`, because their own values might be out of range.
!>
!> After the table is complete, only the mean mode may change. It is the response to a uniform traction, which
!> depends on the thickness of the block.
module symbol_table
   use asperity_parallel, only : global_max, global_sum
   use asperity_precision, only : dp, power_of_two, sp
   use transform_shape, only : transform_shape_type
   implicit none
   private

   public :: new_symbol_table, symbol_table_type

   integer, parameter :: together = 16      !! rows of modes that are turned into columns together

   !> The symbols of an operator. The procedures that read or set single modes are for double precision.
   type :: symbol_table_type
      integer :: first = 0                  !! first wave number along x of this process ...
      integer :: last = -1                  !! ... and the last with a symbol; none if it is less
      !> (0:my/2, first:, 1) or xx, yy, xy; zero beyond mx/2. It is not allocated before `set`, nor in single precision.
      real(dp), allocatable :: values(:, :, :)
      real(sp), allocatable :: low_values(:, :, :)   !! the same over `unit`, in single precision
      real(dp) :: unit = 1.0_dp
      integer, private :: last_column = -1  !! last of the columns of this process
      integer, private :: mx = 0, my = 0    !! lengths of the transforms
      integer, private :: components = 0    !! 1 scalar, 2 vector
      logical, private :: single = .false.
      logical, private :: shared = .false.  !! processes share the columns
   contains
      procedure :: new_modes
      procedure :: set
      procedure :: part
      procedure :: self_compliance
      procedure :: mean_mode
      procedure :: set_mean_mode
      procedure :: set_mean_compliance
      procedure :: destroy
   end type symbol_table_type

contains

   !> Set the sizes of a table, without values.
   subroutine new_symbol_table(self, shape, columns, single)
      type(symbol_table_type), intent(out) :: self
      type(transform_shape_type), intent(in) :: shape
      integer, intent(in) :: columns(2)            !! first and last column of this process, from 0
      logical, intent(in) :: single                !! the transforms are in single precision

      self%first = columns(1)
      self%last_column = columns(2)
      self%last = min(columns(2), shape%mx/2)
      self%mx = shape%mx
      self%my = shape%my
      self%components = shape%components
      self%shared = shape%shared
      self%single = single
   end subroutine new_symbol_table

   !> Make a table of the modes of this process, in which the caller puts the symbols for `set`.
   pure subroutine new_modes(self, modes)
      class(symbol_table_type), intent(in) :: self
      real(dp), allocatable, intent(out) :: modes(:, :, :)   !! (first:last, 0:my/2, 1) or xx, yy, xy

      allocate (modes(self%first:self%last, 0:self%my/2, merge(1, 3, self%components == 1)))
   end subroutine new_modes

   !> Set the symbols, with the factor of the transforms, and in single precision where the transforms are. Collective.
   subroutine set(self, modes)
      class(symbol_table_type), intent(inout) :: self
      real(dp), intent(in) :: modes(self%first:, 0:, :)
      integer :: c, j

      allocate (self%values(0:self%my/2, self%first:self%last_column, size(modes, 3)), source=0.0_dp)
      do c = 1, size(modes, 3)
         do j = 0, self%my/2, together
            associate (k => min(j + together - 1, self%my/2))
               self%values(j:k, self%first:self%last, c) = transpose(modes(:, j:k, c)/(real(self%mx, dp)*self%my))
            end associate
         end do
      end do
      if (.not. self%single) return
      self%unit = maxval(abs(self%values))
      if (self%shared) self%unit = global_max(self%unit)
      self%unit = power_of_two(self%unit)
      allocate (self%low_values(0:self%my/2, self%first:self%last_column, size(self%values, 3)))
      self%low_values = real(self%values/self%unit, sp)
      deallocate (self%values)
   end subroutine set

   !> One part of the symbols without the factor of the transforms, in the first quarter of the plane of
   !> wave numbers. This is not available if processes share the columns.
   pure function part(self, number) result(table)
      class(symbol_table_type), intent(in) :: self
      integer, intent(in) :: number                !! 1; of a vector operator 1: xx, 2: yy, 3: xy
      real(dp) :: table(0:self%mx/2, 0:self%my/2)  !! m/Pa

      table = transpose(self%values(:, 0:self%mx/2, number))*(real(self%mx, dp)*self%my)
   end function part

   !> Displacement of a cell under a unit traction on that cell alone, the mean of both components: the
   !> mean of the symbols over the whole spectrum. Collective where processes share the columns.
   function self_compliance(self, with_mean) result(compliance)
      class(symbol_table_type), intent(in) :: self
      logical, intent(in) :: with_mean             !! include the mean mode: needed on a free grid, not on a periodic one
      real(dp) :: compliance
      real(dp) :: symbols(0:self%mx/2), weight
      integer :: i, j

      compliance = 0.0_dp
      do j = 0, self%my/2
         symbols = 0.0_dp
         do i = self%first, self%last
            symbols(i) = self%values(j, i, 1) + self%values(j, i, self%components)
         end do
         ! All columns of a row at once: the sum is in the same order for any number of processes.
         if (self%shared) symbols = global_sum(symbols)
         do i = 0, self%mx/2
            if (i == 0 .and. j == 0 .and. .not. with_mean) cycle
            weight = merge(1.0_dp, 2.0_dp, i == 0 .or. 2*i == self%mx) &
               *merge(1.0_dp, 2.0_dp, j == 0 .or. 2*j == self%my)
            compliance = compliance + 0.5_dp*weight*symbols(i)
         end do
      end do
   end function self_compliance

   !> The mean mode: the uniform displacement that goes with tractions whose sum over the cells is 1 Pa.
   !> Collective where processes share the columns.
   function mean_mode(self, component) result(mode)
      class(symbol_table_type), intent(in) :: self
      integer, intent(in) :: component             !! 1, or 2 of a vector operator
      real(dp) :: mode                             !! m/Pa
      real(dp) :: modes(1)

      modes = 0.0_dp
      if (has_mean_mode(self)) modes = self%values(0, 0, component)
      if (self%shared) modes = global_sum(modes)
      mode = modes(1)
   end function mean_mode

   !> Does this process hold the symbol of the mean mode?
   pure logical function has_mean_mode(self)
      class(symbol_table_type), intent(in) :: self

      has_mean_mode = self%first == 0 .and. self%last_column >= 0
   end function has_mean_mode

   !> Set the mean mode of one component.
   subroutine set_mean_mode(self, component, mode)
      class(symbol_table_type), intent(inout) :: self
      integer, intent(in) :: component
      real(dp), intent(in) :: mode                 !! as `mean_mode` gives it, m/Pa

      if (has_mean_mode(self)) self%values(0, 0, component) = mode
   end subroutine set_mean_mode

   !> Set the mean mode of all components of a periodic operator by the compliance for a uniform traction:
   !> u = compliance t. For a block at rest that is its thickness.
   subroutine set_mean_compliance(self, compliance)
      class(symbol_table_type), intent(inout) :: self
      real(dp), intent(in) :: compliance           !! m/Pa
      integer :: c

      do c = 1, self%components
         call self%set_mean_mode(c, compliance/(real(self%mx, dp)*self%my))
      end do
   end subroutine set_mean_compliance

   !> Free the values.
   subroutine destroy(self)
      class(symbol_table_type), intent(inout) :: self

      if (allocated(self%values)) deallocate (self%values)
      if (allocated(self%low_values)) deallocate (self%low_values)
   end subroutine destroy

end module symbol_table
