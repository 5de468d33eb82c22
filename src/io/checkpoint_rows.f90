!> Writes and reads the fields of a checkpoint if several processes share their rows.
!>
!> Each process has its rows in memory, and the file holds all of them in the order of the grid, so that the
!> file is the same for any number of processes. Only the first process opens the file, and fields pass
!> through it in slabs of rows. All procedures are collective.
module checkpoint_rows
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : is_first_process
   use asperity_precision, only : dp, int64, int8
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : create_field, read_part, slab_rows, write_part
   use process_agreement, only : agree
   use regular_grid, only : grid_type
   use row_slabs, only : collect_rows, deal_rows, own_part
   use state_table, only : state_piece_type
   implicit none
   private

   public :: check_extent, get_rows, put_rows

contains

   !> Write a field. The file remembers a fault.
   subroutine put_rows(file, path, piece, grid)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      type(state_piece_type), intent(in) :: piece
      type(grid_type), intent(in) :: grid
      real(dp), allocatable :: slab(:, :)
      integer :: first, j, layer, part(2)

      if (is_first_process()) call create_field(file, path, whole_extent(piece, grid), &
         associated(piece%byte_2), piece%units, piece%meaning)
      do layer = 1, piece%layers()
         do first = 1, grid%ny, slab_rows(piece%row)
            allocate (slab(piece%row, min(slab_rows(piece%row), grid%ny - first + 1)))
            part = own_part(grid, first, size(slab, 2))
            do j = part(1), part(2)
               slab(:, j - first + 1) = row_of(piece, layer, j - grid%first_row + 1)
            end do
            call collect_rows(grid, first, slab)
            if (is_first_process()) call write_part(file, path, start_of(piece, layer, first), &
               extent_of(piece, size(slab, 2)), slab)
            deallocate (slab)
         end do
      end do
   end subroutine put_rows

   !> Read a field into the memory that the table points to.
   subroutine get_rows(file, path, piece, grid, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      type(state_piece_type), intent(inout) :: piece
      type(grid_type), intent(in) :: grid
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: stored(:)
      real(dp), allocatable :: slab(:, :)
      integer :: first, j, layer, part(2)

      if (is_first_process()) then
         call file%dataset_shape(path, stored, error)
         if (.not. allocated(error)) call check_extent(file, path, stored, whole_extent(piece, grid), error)
      end if
      call agree(error)
      if (allocated(error)) return
      do layer = 1, piece%layers()
         do first = 1, grid%ny, slab_rows(piece%row)
            allocate (slab(piece%row, min(slab_rows(piece%row), grid%ny - first + 1)), source=0.0_dp)
            if (is_first_process()) call read_part(file, path, start_of(piece, layer, first), &
               extent_of(piece, size(slab, 2)), slab)
            call deal_rows(grid, first, slab)
            part = own_part(grid, first, size(slab, 2))
            do j = part(1), part(2)
               call set_row(piece, layer, j - grid%first_row + 1, slab(:, j - first + 1))
            end do
            deallocate (slab)
         end do
      end do
      if (is_first_process()) call file%report(error)
      call agree(error)
   end subroutine get_rows

   !> Shape of a field with the rows of all processes.
   pure function whole_extent(piece, grid) result(extent)
      type(state_piece_type), intent(in) :: piece
      type(grid_type), intent(in) :: grid
      integer, allocatable :: extent(:)

      extent = piece%extent()
      if (piece%by_cells) then
         extent(1) = piece%row*grid%ny
      else
         extent(size(extent)) = grid%ny
      end if
   end function whole_extent

   !> Where rows of a layer start in the file, from 0, in Fortran's order of the dimensions.
   pure function start_of(piece, layer, first) result(start)
      type(state_piece_type), intent(in) :: piece
      integer, intent(in) :: layer
      integer, intent(in) :: first                 !! row of the grid, from 1
      integer(int64), allocatable :: start(:)
      integer, allocatable :: extent(:)

      extent = piece%extent()
      allocate (start(size(extent)), source=0_int64)
      if (.not. piece%by_cells) then
         start(size(start)) = first - 1
         return
      end if
      start(1) = int(first - 1, int64)*piece%row
      start(2) = mod(layer - 1, extent(2))
      if (size(start) == 3) start(3) = (layer - 1)/extent(2)
   end function start_of

   !> Shape of some rows of a layer in the file.
   pure function extent_of(piece, rows) result(extent)
      type(state_piece_type), intent(in) :: piece
      integer, intent(in) :: rows
      integer, allocatable :: extent(:)

      extent = piece%extent()
      if (piece%by_cells) then
         extent = 1
         extent(1) = piece%row*rows
      else
         extent(size(extent)) = rows
      end if
   end function extent_of

   !> A row of a layer.
   pure function row_of(piece, layer, j) result(values)
      type(state_piece_type), intent(in) :: piece
      integer, intent(in) :: layer
      integer, intent(in) :: j                     !! row on this process
      real(dp) :: values(piece%row)
      integer :: at, k(2)

      at = (j - 1)*piece%row
      k = layer_indices(piece, layer)
      if (associated(piece%byte_2)) then
         values = real(piece%byte_2(:, j), dp)
      else if (piece%by_cells .and. associated(piece%real_2)) then
         values = piece%real_2(at + 1:at + piece%row, k(1))
      else if (piece%by_cells) then
         values = piece%real_3(at + 1:at + piece%row, k(1), k(2))
      else if (associated(piece%real_2)) then
         values = piece%real_2(:, j)
      else
         values = reshape(piece%real_3(:, :, j), [piece%row])
      end if
   end function row_of

   !> Set a row of a layer.
   subroutine set_row(piece, layer, j, values)
      type(state_piece_type), intent(inout) :: piece
      integer, intent(in) :: layer
      integer, intent(in) :: j                     !! row on this process
      real(dp), intent(in) :: values(:)
      integer :: at, k(2)

      at = (j - 1)*piece%row
      k = layer_indices(piece, layer)
      if (associated(piece%byte_2)) then
         piece%byte_2(:, j) = nint(values, int8)
      else if (piece%by_cells .and. associated(piece%real_2)) then
         piece%real_2(at + 1:at + piece%row, k(1)) = values
      else if (piece%by_cells) then
         piece%real_3(at + 1:at + piece%row, k(1), k(2)) = values
      else if (associated(piece%real_2)) then
         piece%real_2(:, j) = values
      else
         piece%real_3(:, :, j) = reshape(values, [size(piece%real_3, 1), size(piece%real_3, 2)])
      end if
   end subroutine set_row

   !> Indices of a layer along the second and the third dimension.
   pure function layer_indices(piece, layer) result(k)
      type(state_piece_type), intent(in) :: piece
      integer, intent(in) :: layer
      integer :: k(2)
      integer, allocatable :: extent(:)

      extent = piece%extent()
      k = [mod(layer - 1, max(extent(2), 1)) + 1, (layer - 1)/max(extent(2), 1) + 1]
   end function layer_indices

   !> Check that an array in the checkpoint has the same extents as the one in the run.
   subroutine check_extent(file, path, stored, wanted, error)
      type(hdf5_file_type), intent(in) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: stored(:)
      integer, intent(in) :: wanted(:)
      type(error_type), allocatable, intent(out) :: error
      character(120) :: text
      logical :: same

      same = size(stored) == size(wanted)
      if (same) same = all(stored == wanted)
      if (same) return
      write (text, '(*(i0, :, " "))') stored
      text = ': the extents are '//trim(text)//', the case needs'
      write (text(len_trim(text) + 2:), '(*(i0, :, " "))') wanted
      call fail(error, error_input, file%path//': '//path//trim(text))
   end subroutine check_extent

end module checkpoint_rows
