!> The sizes of a transform, and how processes share its rows.
module transform_shape
   use asperity_parallel, only : process_number
   use influence, only : transform_length
   use regular_grid, only : grid_type
   use row_sharing, only : row_sharing_type, sharing_on_grid
   implicit none
   private

   public :: shape_of_rows, shape_on_grid, transform_shape_type, whole_shape

   !> Sizes of a transform.
   type :: transform_shape_type
      integer :: nx = 0, ny = 0            !! cells of the whole field
      integer :: mx = 0, my = 0            !! lengths of the transforms, more than the cells where padded
      integer :: components = 1            !! number of results: 1 scalar, 2 vector
      integer :: inputs = 1                !! number of inputs; 0: a multiplier makes the modes
      logical :: shared = .false.          !! processes share the rows
      integer, allocatable :: rows_of(:)   !! rows of each process; of all where they are not shared
      integer, allocatable :: order(:)     !! rows of the whole field, in the order of the processes
   contains
      procedure :: rows
   end type transform_shape_type

contains

   !> The shape for fields on a grid, of which each process may hold a part.
   pure function shape_on_grid(grid, components, sharing) result(self)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: components
      type(row_sharing_type), intent(in), optional :: sharing   !! of the rows; absent: that of the grid
      type(transform_shape_type) :: self

      if (present(sharing)) then
         self = shape_of_rows(grid%nx, sharing, components)
      else
         self = shape_of_rows(grid%nx, sharing_on_grid(grid), components)
      end if
      self%mx = transform_length(grid%nx, grid%boundary)
      self%my = transform_length(grid%ny, grid%boundary)
   end function shape_on_grid

   !> The shape for periodic fields whose rows are shared in any way.
   pure function shape_of_rows(nx, sharing, components) result(self)
      integer, intent(in) :: nx
      type(row_sharing_type), intent(in) :: sharing
      integer, intent(in) :: components
      type(transform_shape_type) :: self

      self = whole_shape(nx, size(sharing%owner), components)
      self%shared = sharing%shared
      self%rows_of = sharing%rows_of
      self%order = sharing%order
   end function shape_of_rows

   !> The shape for periodic fields that each process holds whole.
   pure function whole_shape(nx, ny, components) result(self)
      integer, intent(in) :: nx, ny, components
      type(transform_shape_type) :: self
      integer :: j

      self%nx = nx
      self%ny = ny
      self%mx = nx
      self%my = ny
      self%components = components
      self%inputs = components
      self%rows_of = [ny]
      self%order = [(j, j=1, ny)]
   end function whole_shape

   !> Number of rows that this process holds.
   pure function rows(self)
      class(transform_shape_type), intent(in) :: self
      integer :: rows

      rows = self%rows_of(1)
      if (self%shared) rows = self%rows_of(process_number() + 1)
   end function rows

end module transform_shape
