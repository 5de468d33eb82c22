!> The pieces of a state in the file of a checkpoint: one dataset per piece of a `state_table` in
!> the group /state, under the name of the piece.
module checkpoint_pieces
   use asperity_errors, only : error_type
   use asperity_parallel, only : is_first_process, process_count, share
   use asperity_precision, only : dp, int8
   use checkpoint_rows, only : check_extent, get_rows, put_rows
   use hdf5_file, only : hdf5_file_type
   use process_agreement, only : agree
   use regular_grid, only : grid_type
   use state_table, only : state_piece_type
   implicit none
   private

   public :: get_piece, put_piece

contains

   !> Write one piece of a state. The file, which the first process has, remembers a fault. Collective.
   subroutine put_piece(file, piece, grid)
      type(hdf5_file_type), intent(inout) :: file
      type(state_piece_type), intent(in) :: piece
      type(grid_type), intent(in) :: grid

      if (piece%row > 0 .and. process_count() > 1) then
         call put_rows(file, '/state/'//piece%name, piece, grid)
      else if (is_first_process()) then
         call put_whole(file, piece)
      end if
   end subroutine put_piece

   !> Write a piece that this process has as a whole.
   subroutine put_whole(file, piece)
      type(hdf5_file_type), intent(inout) :: file
      type(state_piece_type), intent(in) :: piece
      character(:), allocatable :: path

      path = '/state/'//piece%name
      associate (units => piece%units, meaning => piece%meaning)
         if (associated(piece%truth)) then
            call file%write(path, merge(1.0_dp, 0.0_dp, piece%truth), units, meaning)
         else if (associated(piece%whole)) then
            call file%write(path, real(piece%whole, dp), units, meaning)
         else if (associated(piece%whole_1)) then
            call file%write(path, real(piece%whole_1, dp), units, meaning)
         else if (associated(piece%byte_2)) then
            call file%write(path, piece%byte_2, units, meaning)
         else if (associated(piece%real_0)) then
            call file%write(path, piece%real_0, units, meaning)
         else if (associated(piece%real_1)) then
            call file%write(path, piece%real_1, units, meaning)
         else if (associated(piece%real_2)) then
            call file%write(path, piece%real_2, units, meaning)
         else if (associated(piece%real_3)) then
            call file%write(path, piece%real_3, units, meaning)
         else
            call file%write(path, 0.0_dp, units, meaning)
            call file%write_attribute(path, 'text', trim(piece%text))
         end if
      end associate
   end subroutine put_whole

   !> Read one piece of a state into the memory that the table points to. Collective.
   subroutine get_piece(file, piece, grid, error)
      type(hdf5_file_type), intent(inout) :: file
      type(state_piece_type), intent(inout) :: piece
      type(grid_type), intent(in) :: grid
      type(error_type), allocatable, intent(out) :: error

      if (piece%row > 0 .and. process_count() > 1) then
         call get_rows(file, '/state/'//piece%name, piece, grid, error)
      else
         if (is_first_process()) call get_whole(file, piece, error)
         call agree(error)
         if (.not. allocated(error)) call share_piece(piece)
      end if
   end subroutine get_piece

   !> Give all processes a piece that is not shared by rows.
   subroutine share_piece(piece)
      type(state_piece_type), intent(inout) :: piece
      character(:), allocatable :: text
      integer :: k

      if (process_count() == 1) return
      if (associated(piece%truth)) then
         call share(piece%truth)
      else if (associated(piece%whole)) then
         call share(piece%whole)
      else if (associated(piece%real_0)) then
         call share(piece%real_0)
      else if (associated(piece%real_1)) then
         call share(piece%real_1)
      else if (associated(piece%whole_1)) then
         do k = 1, size(piece%whole_1)
            call share(piece%whole_1(k))
         end do
      else if (associated(piece%text)) then
         text = piece%text
         call share(text)
         piece%text = text
      end if
   end subroutine share_piece

   !> Read a piece of which this process has all rows.
   subroutine get_whole(file, piece, error)
      type(hdf5_file_type), intent(inout) :: file
      type(state_piece_type), intent(inout) :: piece
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path, text
      real(dp), allocatable :: field(:, :)
      real(dp) :: number

      path = '/state/'//piece%name
      if (associated(piece%real_3)) then
         call get_real_3(file, path, piece%real_3, error)
      else if (associated(piece%real_2)) then
         call get_real_2(file, path, piece%real_2, error)
      else if (associated(piece%byte_2)) then
         allocate (field(size(piece%byte_2, 1), size(piece%byte_2, 2)))
         call get_real_2(file, path, field, error)
         if (.not. allocated(error)) piece%byte_2 = nint(field, int8)
      else if (associated(piece%real_1)) then
         call get_real_1(file, path, piece%real_1, error)
      else if (associated(piece%whole_1)) then
         allocate (field(size(piece%whole_1), 1))
         call get_real_1(file, path, field(:, 1), error)
         if (.not. allocated(error)) piece%whole_1 = nint(field(:, 1))
      else if (associated(piece%text)) then
         call file%read_attribute(path, 'text', text, error)
         if (.not. allocated(error)) piece%text = text
      else
         call file%read(path, number, error)
         if (allocated(error)) return
         if (associated(piece%real_0)) piece%real_0 = number
         if (associated(piece%whole)) piece%whole = nint(number)
         if (associated(piece%truth)) piece%truth = number > 0.5_dp
      end if
   end subroutine get_whole

   !> Read a vector.
   subroutine get_real_1(file, path, values, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:)

      call file%read(path, stored, error)
      if (.not. allocated(error)) call check_extent(file, path, shape(stored), shape(values), error)
      if (.not. allocated(error)) values(:) = stored
   end subroutine get_real_1

   !> Read a field.
   subroutine get_real_2(file, path, values, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :)
      integer :: j

      call file%read(path, stored, error)
      if (.not. allocated(error)) call check_extent(file, path, shape(stored), shape(values), error)
      if (allocated(error)) return
      do j = 1, size(values, 2)
         values(:, j) = stored(:, j)
      end do
   end subroutine get_real_2

   !> Read several fields.
   subroutine get_real_3(file, path, values, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :, :)
      integer :: j, k

      call file%read(path, stored, error)
      if (.not. allocated(error)) call check_extent(file, path, shape(stored), shape(values), error)
      if (allocated(error)) return
      do k = 1, size(values, 3)
         do j = 1, size(values, 2)
            values(:, j, k) = stored(:, j, k)
         end do
      end do
   end subroutine get_real_3

end module checkpoint_pieces
