!> The pieces of a state in the file of a checkpoint: one dataset per piece of a `state_table` in
!> the group /state, under the name of the piece.
module checkpoint_pieces
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int8
   use hdf5_file, only : hdf5_file_type
   use state_table, only : state_piece_type
   implicit none
   private

   public :: get_piece, put_piece

contains

   !> Write one piece of a state. The file remembers a fault.
   subroutine put_piece(file, piece)
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
   end subroutine put_piece

   !> Read one piece of a state into the memory that the table points to.
   subroutine get_piece(file, piece, error)
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
   end subroutine get_piece

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

   !> Check that an array in the checkpoint has the same extents as the one in the run.
   subroutine check_extent(file, path, stored, wanted, error)
      type(hdf5_file_type), intent(in) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: stored(:)
      integer, intent(in) :: wanted(:)
      type(error_type), allocatable, intent(out) :: error
      character(120) :: text

      if (all(stored == wanted)) return
      write (text, '(*(i0, :, " "))') stored
      text = ': the extents are '//trim(text)//', the case needs'
      write (text(len_trim(text) + 2:), '(*(i0, :, " "))') wanted
      call fail(error, error_input, file%path//': '//path//trim(text))
   end subroutine check_extent

end module checkpoint_pieces
