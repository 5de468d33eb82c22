!> A table of the pieces of a state: their names, units, meanings, and where they are in memory.
!>
!> The owner of a state makes a table of it, with one line per piece (`add`). Whoever stores the
!> state, such as a checkpoint, goes through the table and needs to know nothing about the pieces. A
!> name may have parts that are separated by '/', such as 'schedule/row'. The pieces stay in the
!> order in which they were added.
!>
!> The table points into the state, which therefore must be a target and stay where it is while the
!> table is in use. Pieces that are not allocated or empty in a case are left out of the table.
!>
!> If several processes share the rows of the grid, `add_field` and `add_cells` add shared fields, of which
!> each process has its rows. All other pieces are the same on every process. The table has the same pieces on
!> all processes, even on one without rows; therefore adding fields is collective.
module state_table
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp, int8
   use regular_grid, only : grid_type
   implicit none
   private

   public :: state_piece_type, state_table_type

   !> A piece of the state. Exactly one of the pointers is associated.
   type :: state_piece_type
      character(:), allocatable :: name
      character(:), allocatable :: units
      character(:), allocatable :: meaning
      logical, pointer :: truth => null()
      integer, pointer :: whole => null()
      integer, pointer :: whole_1(:) => null()
      integer(int8), pointer :: byte_2(:, :) => null()
      real(dp), pointer :: real_0 => null()
      real(dp), pointer :: real_1(:) => null()
      real(dp), pointer :: real_2(:, :) => null()
      real(dp), pointer :: real_3(:, :, :) => null()
      character(:), pointer :: text => null()
      integer :: row = 0                    !! values of a row of the grid; 0: not shared by rows
      logical :: by_cells = .false.         !! the first dimension counts cells; otherwise the last one counts rows
   contains
      procedure :: is_finite
      procedure :: extent
      procedure :: layers
   end type state_piece_type

   !> The table.
   type :: state_table_type
      integer :: count = 0
      type(state_piece_type), allocatable :: pieces(:)   !! the first `count` are in use
      type(grid_type) :: grid                            !! whose rows are shared
   contains
      procedure, private :: add_truth, add_whole, add_whole_1, add_byte_2, add_real_0, add_real_1, &
         add_real_2, add_real_3, add_text, add_field_byte, add_field_2, add_field_3, add_cells_2, add_cells_3
      !> Add a piece. Arrays of two and three dimensions are allocatable in the state.
      generic :: add => add_truth, add_whole, add_whole_1, add_byte_2, add_real_0, add_real_1, &
         add_real_2, add_real_3, add_text
      !> Add a field whose last dimension is the rows of the grid.
      generic :: add_field => add_field_byte, add_field_2, add_field_3
      !> Add fields whose first dimension is the cells of the grid, row after row.
      generic :: add_cells => add_cells_2, add_cells_3
   end type state_table_type

contains

   !> Make space for another piece, and set its name, units and meaning.
   subroutine start_piece(self, name, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name, units, meaning
      type(state_piece_type), allocatable :: longer(:)

      if (.not. allocated(self%pieces)) allocate (self%pieces(32))
      if (self%count == size(self%pieces)) then
         allocate (longer(2*self%count))
         longer(:self%count) = self%pieces
         call move_alloc(longer, self%pieces)
      end if
      self%count = self%count + 1
      self%pieces(self%count)%name = name
      self%pieces(self%count)%units = units
      self%pieces(self%count)%meaning = meaning
   end subroutine start_piece

   subroutine add_truth(self, name, value, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      logical, intent(in), target :: value
      character(*), intent(in) :: meaning

      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%truth => value
   end subroutine add_truth

   subroutine add_whole(self, name, value, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in), target :: value
      character(*), intent(in) :: meaning

      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%whole => value
   end subroutine add_whole

   subroutine add_whole_1(self, name, values, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in), target :: values(:)
      character(*), intent(in) :: meaning

      if (size(values) == 0) return
      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%whole_1 => values
   end subroutine add_whole_1

   subroutine add_byte_2(self, name, values, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer(int8), allocatable, intent(in), target :: values(:, :)
      character(*), intent(in) :: meaning

      if (.not. allocated(values)) return
      if (size(values) == 0) return
      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%byte_2 => values
   end subroutine add_byte_2

   subroutine add_real_0(self, name, value, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), target :: value
      character(*), intent(in) :: units, meaning

      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_0 => value
   end subroutine add_real_0

   subroutine add_real_1(self, name, values, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), target :: values(:)
      character(*), intent(in) :: units, meaning

      if (size(values) == 0) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_1 => values
   end subroutine add_real_1

   subroutine add_real_2(self, name, values, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :)
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (size(values) == 0) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_2 => values
   end subroutine add_real_2

   subroutine add_real_3(self, name, values, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :, :)
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (size(values) == 0) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_3 => values
   end subroutine add_real_3

   subroutine add_text(self, name, value, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(in), target :: value
      character(*), intent(in) :: meaning

      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%text => value
   end subroutine add_text

   subroutine add_field_byte(self, name, values, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer(int8), allocatable, intent(in), target :: values(:, :)
      character(*), intent(in) :: meaning

      if (.not. allocated(values)) return
      if (.not. any_process(size(values) > 0)) return
      call start_piece(self, name, '1', meaning)
      self%pieces(self%count)%byte_2 => values
      self%pieces(self%count)%row = size(values, 1)
   end subroutine add_field_byte

   subroutine add_field_2(self, name, values, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :)
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (.not. any_process(size(values) > 0)) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_2 => values
      self%pieces(self%count)%row = size(values, 1)
   end subroutine add_field_2

   subroutine add_field_3(self, name, values, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :, :)
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (.not. any_process(size(values) > 0)) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_3 => values
      self%pieces(self%count)%row = size(values, 1)*size(values, 2)
   end subroutine add_field_3

   subroutine add_cells_2(self, name, values, row, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :)
      integer, intent(in) :: row            !! cells of a row
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (.not. any_process(size(values) > 0)) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_2 => values
      self%pieces(self%count)%row = row
      self%pieces(self%count)%by_cells = .true.
   end subroutine add_cells_2

   subroutine add_cells_3(self, name, values, row, units, meaning)
      class(state_table_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), allocatable, intent(in), target :: values(:, :, :)
      integer, intent(in) :: row            !! cells of a row
      character(*), intent(in) :: units, meaning

      if (.not. allocated(values)) return
      if (.not. any_process(size(values) > 0)) return
      call start_piece(self, name, units, meaning)
      self%pieces(self%count)%real_3 => values
      self%pieces(self%count)%row = row
      self%pieces(self%count)%by_cells = .true.
   end subroutine add_cells_3

   !> Shape of a field of two or three dimensions on this process.
   pure function extent(self)
      class(state_piece_type), intent(in) :: self
      integer, allocatable :: extent(:)

      if (associated(self%byte_2)) then
         extent = shape(self%byte_2)
      else if (associated(self%real_2)) then
         extent = shape(self%real_2)
      else
         extent = shape(self%real_3)
      end if
   end function extent

   !> Number of fields that lie one after the other in a piece.
   pure function layers(self)
      class(state_piece_type), intent(in) :: self
      integer :: layers
      integer, allocatable :: extent(:)

      layers = 1
      if (.not. self%by_cells) return
      extent = self%extent()
      layers = product(extent(2:))
   end function layers

   !> Are all real numbers of a piece finite?
   function is_finite(self) result(yes)
      class(state_piece_type), intent(in) :: self
      logical :: yes
      integer :: j, k

      yes = .true.
      if (associated(self%real_0)) yes = ieee_is_finite(self%real_0)
      if (associated(self%real_1)) yes = all(ieee_is_finite(self%real_1))
      if (associated(self%real_2)) then
         do j = 1, size(self%real_2, 2)
            yes = yes .and. all(ieee_is_finite(self%real_2(:, j)))
         end do
      end if
      if (associated(self%real_3)) then
         do k = 1, size(self%real_3, 3)
            do j = 1, size(self%real_3, 2)
               yes = yes .and. all(ieee_is_finite(self%real_3(:, j, k)))
            end do
         end do
      end if
   end function is_finite

end module state_table
