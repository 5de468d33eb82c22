!> The symbols of the stiffness B of an adhesive contact and of its approximate inverse.
!>
!> `form` computes only the symbols that a process needs: those of the wave numbers along x whose columns it transforms.
module adhesion_symbols
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use kernels, only : kernel_type
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: adhesion_symbols_type, new_adhesion_symbols

   !> The symbols that have been computed.
   type :: adhesion_symbols_type
      type(grid_type), private :: grid
      type(kernel_type), private :: kernel             !! normal response of the solid
      integer, private :: mx = 0, my = 0               !! cells of the grid of the unknowns
      integer, private :: modes(2) = [0, -1]           !! first and last wave number that were computed
      real(dp), allocatable :: stiffness(:, :)         !! B for a shear modulus of 1, (first:last, 0:my/2)
      real(dp), allocatable :: compliance(:, :)        !! its inverse or nearly, > 0, also at wave number zero
   contains
      procedure :: form
   end type adhesion_symbols_type

contains

   !> Prepare the symbols of a solid, without computing any.
   subroutine new_adhesion_symbols(self, grid, kernel, mx, my)
      type(adhesion_symbols_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel
      integer, intent(in) :: mx, my                    !! cells of the grid of the unknowns

      self%grid = grid
      self%kernel = kernel
      self%mx = mx
      self%my = my
   end subroutine new_adhesion_symbols

   !> Compute the symbols of some wave numbers along x, unless they are already available. Collective.
   subroutine form(self, modes, error)
      class(adhesion_symbols_type), intent(inout) :: self
      integer, intent(in) :: modes(2)                  !! first and last wave number; none if the last is less
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      real(dp), allocatable :: table(:, :, :)

      if (allocated(error)) return
      if (.not. any_process(modes(1) < self%modes(1) .or. modes(2) > self%modes(2))) return
      self%modes = modes
      if (allocated(self%stiffness)) deallocate (self%stiffness, self%compliance)
      allocate (self%stiffness(modes(1):modes(2), 0:self%my/2), &
         self%compliance(modes(1):modes(2), 0:self%my/2), table(modes(1):modes(2), 0:self%my/2, 1))
      if (self%grid%boundary == boundary_periodic) then
         call self%kernel%inverse_symbols(self%grid, table, modes(1))
         self%stiffness(:, :) = table(:, :, 1)
         ! This is finite at wave number zero, too.
         self%compliance(:, :) = 1.0_dp/(self%stiffness + self%kernel%least_stiffness(self%grid))
      else
         call self%kernel%symbols(self%grid, self%mx, self%my, table, modes(1))
         self%compliance(:, :) = table(:, :, 1)
         if (any_process(any(self%compliance <= 0.0_dp))) then
            call fail(error, error_input, 'adhesion_symbols: the symbol of this grid is not positive')
            return
         end if
         self%stiffness(:, :) = 1.0_dp/self%compliance
      end if
   end subroutine form

end module adhesion_symbols
