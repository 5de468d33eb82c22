!> The state of a run from which it can go on, in a file of its own: a checkpoint.
!>
!> The checkpoint of FILE.h5 is FILE.checkpoint.h5. It is written under another name, brought to the
!> disk, and then takes the old one's place at once: there is always a whole one or none. It holds
!> the id of the result that it belongs to; the settings of the case as lines 'name = value', so that
!> a checkpoint of another case is refused; and the state, one dataset per piece of a `state_table`
!> in the group /state, under the piece's own name.
!>
!> The file is HDF5 with a user block: its first 512 bytes, which HDF5 leaves to the user, hold one
!> line of text with the length of the file and the checksum of all bytes behind the block. Both are
!> compared before HDF5 sees the file, because HDF5 may crash or hang on a damaged file, or read
!> wrong numbers from it.
module asperity_checkpoint
   use asperity_checksum, only : checksum_of_file, hexadecimal
   use asperity_errors, only : add_fault, error_convergence, error_file, error_input, error_type, fail
   use file_system, only : file_exists, remove_file, rename_file, sync_file
   use hdf5_file, only : hdf5_file_type
   use asperity_precision, only : dp, int64, int8
   use result_names, only : sibling_path
   use state_table, only : state_piece_type, state_table_type
   use text_tools, only : to_text
   implicit none
   private

   public :: checkpoint_writer_type, checkpoint_reader_type, checkpoint_path, remove_checkpoint

   integer, parameter :: block_length = 512           !! bytes of the user block
   character(*), parameter :: block_mark = 'asperity checkpoint 2, '

   !> A checkpoint under construction.
   type :: checkpoint_writer_type
      private
      type(hdf5_file_type) :: file
      character(:), allocatable :: path
      character(:), allocatable :: temporary
   contains
      procedure :: start
      procedure :: put_number
      procedure :: put_state
      procedure :: commit
   end type checkpoint_writer_type

   !> A checkpoint to go on from.
   type :: checkpoint_reader_type
      private
      type(hdf5_file_type) :: file
      character(:), allocatable, public :: result_id   !! id of the result that it belongs to
   contains
      procedure :: open => open_checkpoint
      procedure :: compare
      procedure :: get_number
      procedure :: get_state
      procedure :: close => close_checkpoint
   end type checkpoint_reader_type

contains

   !> Name of the checkpoint of a result.
   pure function checkpoint_path(result_path) result(path)
      character(*), intent(in) :: result_path
      character(:), allocatable :: path

      path = sibling_path(result_path, '.checkpoint.h5')
   end function checkpoint_path

   !> Remove a result's checkpoint, and what a killed run left of an unfinished one.
   subroutine remove_checkpoint(result_path)
      character(*), intent(in) :: result_path

      call remove_file(checkpoint_path(result_path))
      call remove_file(checkpoint_path(result_path)//'.new')
   end subroutine remove_checkpoint

   ! --- writing ------------------------------------------------------------------------------

   !> Start a checkpoint; the one there is stays until `commit`.
   subroutine start(self, result_path, result_id, settings, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      character(*), intent(in) :: result_id     !! the attribute `id` of the result
      character(*), intent(in) :: settings      !! what must agree for a run to go on, see `compare`
      type(error_type), allocatable, intent(out) :: error

      self%path = checkpoint_path(result_path)
      self%temporary = self%path//'.new'
      call self%file%open(self%temporary, 'create', error, user_block=block_length)
      if (allocated(error)) return
      call self%file%create_group('/state', error)
      if (.not. allocated(error)) call self%file%write_attribute('/', 'result_id', result_id, error)
      if (.not. allocated(error)) call self%file%write_attribute('/', 'settings', settings, error)
      if (allocated(error)) call give_up(self)
   end subroutine start

   !> Leave an unfinished checkpoint and remove its file.
   subroutine give_up(self)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable :: closing

      call self%file%close(closing)
      call remove_file(self%temporary)
   end subroutine give_up

   !> Add a number that is not part of the state.
   subroutine put_number(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', name, value, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_number

   !> Add the state.
   subroutine put_state(self, table, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(state_table_type), intent(in) :: table
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      call self%file%write_attribute('/state', 'pieces', table%count, error)
      do i = 1, table%count
         if (allocated(error)) exit
         call put_piece(self%file, table%pieces(i), error)
      end do
      if (allocated(error)) call give_up(self)
   end subroutine put_state

   !> Add one piece of the state.
   subroutine put_piece(file, piece, error)
      type(hdf5_file_type), intent(inout) :: file
      type(state_piece_type), intent(in) :: piece
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path

      path = '/state/'//piece%name
      associate (units => piece%units, meaning => piece%meaning)
         if (associated(piece%truth)) then
            call file%write(path, merge(1.0_dp, 0.0_dp, piece%truth), units, meaning, error)
         else if (associated(piece%whole)) then
            call file%write(path, real(piece%whole, dp), units, meaning, error)
         else if (associated(piece%whole_1)) then
            call file%write(path, real(piece%whole_1, dp), units, meaning, error)
         else if (associated(piece%byte_2)) then
            call file%write(path, piece%byte_2, units, meaning, error)
         else if (associated(piece%real_0)) then
            call file%write(path, piece%real_0, units, meaning, error)
         else if (associated(piece%real_1)) then
            call file%write(path, piece%real_1, units, meaning, error)
         else if (associated(piece%real_2)) then
            call file%write(path, piece%real_2, units, meaning, error)
         else if (associated(piece%real_3)) then
            call file%write(path, piece%real_3, units, meaning, error)
         else
            call file%write(path, 0.0_dp, units, meaning, error)
            if (.not. allocated(error)) call file%write_attribute(path, 'text', trim(piece%text), error)
         end if
      end associate
   end subroutine put_piece

   !> Let the checkpoint take the old one's place.
   subroutine commit(self, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(block_length) :: block
      integer :: unit, status

      call self%file%flush(error)
      if (.not. allocated(error)) call self%file%close(error)
      if (.not. allocated(error)) call make_block(self%temporary, block, error)
      if (.not. allocated(error)) then
         open (newunit=unit, file=self%temporary, access='stream', form='unformatted', &
            status='old', action='readwrite', iostat=status)
         if (status == 0) write (unit, pos=1, iostat=status) block
         if (status == 0) close (unit, iostat=status)
         if (status /= 0) call fail(error, error_file, self%path//': cannot be written')
      end if
      if (.not. allocated(error)) call sync_file(self%temporary, error)
      if (.not. allocated(error)) call rename_file(self%temporary, self%path, error)
      if (allocated(error)) call give_up(self)
   end subroutine commit

   !> The user block that belongs to what a file holds.
   subroutine make_block(path, block, error)
      character(*), intent(in) :: path
      character(block_length), intent(out) :: block
      type(error_type), allocatable, intent(out) :: error
      integer(int64) :: length, sum

      block = ''
      call checksum_of_file(path, block_length + 1_int64, sum, error)
      if (allocated(error)) return
      inquire (file=path, size=length)
      block = block_mark//'length '//to_text(length)//', CRC-64/XZ of the bytes behind this block '// &
         hexadecimal(sum)
      block(block_length:) = new_line('a')
   end subroutine make_block

   ! --- reading ------------------------------------------------------------------------------

   !> Open the checkpoint of a result, if it is whole.
   subroutine open_checkpoint(self, result_path, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path

      path = checkpoint_path(result_path)
      if (.not. file_exists(path)) then
         if (is_complete(result_path)) then
            call fail(error, error_file, trim(result_path)//': the run is complete: there is '// &
               'nothing to go on with')
         else
            call fail(error, error_file, path//': there is no such file: '//trim(result_path)// &
               ' has no checkpoint to go on from')
         end if
         return
      end if
      call check_block(path, error)
      if (allocated(error)) return
      call self%file%open(path, 'read', error)
      if (allocated(error)) return
      call self%file%read_attribute('/', 'result_id', self%result_id, error)
   end subroutine open_checkpoint

   !> See that a checkpoint is as it was written.
   subroutine check_block(path, error)
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      character(block_length) :: found, wanted
      integer :: unit, status

      found = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
         action='read', iostat=status)
      if (status == 0) then
         read (unit, iostat=status) found
         close (unit)
      end if
      if (status == 0) then
         call make_block(path, wanted, error)
         if (allocated(error)) return
         if (found == wanted) return
      end if
      if (index(found, block_mark) == 1) then
         call fail(error, error_file, path//': the checkpoint is damaged: its checksum or its '// &
            'length is not the one that was written with it')
      else
         call fail(error, error_file, path//': is damaged, or no checkpoint of this version of '// &
            'Asperity')
      end if
   end subroutine check_block

   !> Is there a result of a run that came to its end?
   function is_complete(result_path) result(complete)
      character(*), intent(in) :: result_path
      logical :: complete
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      integer :: finished

      complete = .false.
      if (.not. file_exists(trim(result_path))) return
      call file%open(trim(result_path), 'read', error)
      if (allocated(error)) return
      call file%read_attribute('/', 'finished', finished, error)
      if (.not. allocated(error)) complete = finished == 1
      call file%close(error)
   end function is_complete

   !> See that the checkpoint belongs to a case: every setting that differs is a fault.
   subroutine compare(self, settings, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: settings           !! of the case: lines 'name = value'
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: stored, name, value, line
      integer :: at, next, equals

      call self%file%read_attribute('/', 'settings', stored, error)
      if (allocated(error)) return
      if (stored == settings) return
      at = 1
      do while (at <= len(settings))
         next = index(settings(at:), new_line('a'))
         if (next == 0) next = len(settings) - at + 2
         line = settings(at:at + next - 2)
         at = at + next
         equals = index(line, ' = ')
         if (equals == 0) cycle
         name = line(:equals - 1)
         call find_setting(stored, name, value)
         if (.not. allocated(value)) then
            call add_fault(error, error_input, self%file%path//': the checkpoint knows no "'// &
               name//'", the case has '//line(equals + 3:))
         else if (value /= line(equals + 3:)) then
            call add_fault(error, error_input, self%file%path//': '//name//' is '//value// &
               ' in the checkpoint and '//line(equals + 3:)//' in the case')
         end if
      end do
      if (.not. allocated(error)) call fail(error, error_input, self%file%path// &
         ': the checkpoint is that of another case: it has settings that the case does not have')
   end subroutine compare

   !> Find a setting among lines 'name = value'; `value` is not allocated where there is none.
   pure subroutine find_setting(settings, name, value)
      character(*), intent(in) :: settings
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      character(:), allocatable :: head
      integer :: first, length

      head = name//' = '
      if (index(settings, head) == 1) then
         first = len(head) + 1
      else
         first = index(settings, new_line('a')//head)
         if (first == 0) return
         first = first + len(head) + 1
      end if
      length = index(settings(first:), new_line('a')) - 1
      if (length < 0) length = len(settings) - first + 1
      value = settings(first:first + length - 1)
   end subroutine find_setting

   !> Get a number that is not part of the state.
   subroutine get_number(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%read_attribute('/', name, value, error)
   end subroutine get_number

   !> Get the state into the memory that the table points to; arrays must have the same extents.
   subroutine get_state(self, table, error)
      class(checkpoint_reader_type), intent(inout) :: self
      type(state_table_type), intent(inout) :: table
      type(error_type), allocatable, intent(out) :: error
      integer :: count, i

      do i = 1, table%count
         call get_piece(self, table%pieces(i), error)
         if (allocated(error)) return
         if (.not. table%pieces(i)%is_finite()) then
            call fail(error, error_convergence, self%file%path//': /state/'//table%pieces(i)%name// &
               ' holds a value that is not a finite number: the run cannot go on')
            return
         end if
      end do
      call self%file%read_attribute('/state', 'pieces', count, error)
      if (allocated(error)) return
      if (count /= table%count) call fail(error, error_input, self%file%path//': the state has '// &
         to_text(count)//' pieces, the case needs '//to_text(table%count)// &
         ': it was written by another version of Asperity')
   end subroutine get_state

   !> Get one piece of the state.
   subroutine get_piece(self, piece, error)
      class(checkpoint_reader_type), intent(inout) :: self
      type(state_piece_type), intent(inout) :: piece
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path, text
      real(dp), allocatable :: field(:, :)
      real(dp) :: number

      path = '/state/'//piece%name
      if (associated(piece%real_3)) then
         call get_real_3(self, path, piece%real_3, error)
      else if (associated(piece%real_2)) then
         call get_real_2(self, path, piece%real_2, error)
      else if (associated(piece%byte_2)) then
         allocate (field(size(piece%byte_2, 1), size(piece%byte_2, 2)))
         call get_real_2(self, path, field, error)
         if (.not. allocated(error)) piece%byte_2 = nint(field, int8)
      else if (associated(piece%real_1)) then
         call get_real_1(self, path, piece%real_1, error)
      else if (associated(piece%whole_1)) then
         allocate (field(size(piece%whole_1), 1))
         call get_real_1(self, path, field(:, 1), error)
         if (.not. allocated(error)) piece%whole_1 = nint(field(:, 1))
      else if (associated(piece%text)) then
         call self%file%read_attribute(path, 'text', text, error)
         if (.not. allocated(error)) piece%text = text
      else
         call self%file%read(path, number, error)
         if (allocated(error)) return
         if (associated(piece%real_0)) piece%real_0 = number
         if (associated(piece%whole)) piece%whole = nint(number)
         if (associated(piece%truth)) piece%truth = number > 0.5_dp
      end if
   end subroutine get_piece

   !> Get a vector.
   subroutine get_real_1(self, path, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:)

      call self%file%read(path, stored, error)
      if (.not. allocated(error)) call see_fit(self, path, shape(stored), shape(values), error)
      if (.not. allocated(error)) values(:) = stored
   end subroutine get_real_1

   !> Get a field.
   subroutine get_real_2(self, path, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :)
      integer :: j

      call self%file%read(path, stored, error)
      if (.not. allocated(error)) call see_fit(self, path, shape(stored), shape(values), error)
      if (allocated(error)) return
      do j = 1, size(values, 2)
         values(:, j) = stored(:, j)
      end do
   end subroutine get_real_2

   !> Get several fields.
   subroutine get_real_3(self, path, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(inout) :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :, :)
      integer :: j, k

      call self%file%read(path, stored, error)
      if (.not. allocated(error)) call see_fit(self, path, shape(stored), shape(values), error)
      if (allocated(error)) return
      do k = 1, size(values, 3)
         do j = 1, size(values, 2)
            values(:, j, k) = stored(:, j, k)
         end do
      end do
   end subroutine get_real_3

   !> See that an array of the checkpoint has the extents of the run's.
   subroutine see_fit(self, path, stored, wanted, error)
      class(checkpoint_reader_type), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: stored(:)
      integer, intent(in) :: wanted(:)
      type(error_type), allocatable, intent(out) :: error
      character(120) :: text

      if (all(stored == wanted)) return
      write (text, '(*(i0, :, " "))') stored
      text = ': the extents are '//trim(text)//', the case needs'
      write (text(len_trim(text) + 2:), '(*(i0, :, " "))') wanted
      call fail(error, error_input, self%file%path//': '//path//trim(text))
   end subroutine see_fit

   !> Close the checkpoint.
   subroutine close_checkpoint(self)
      class(checkpoint_reader_type), intent(inout) :: self
      type(error_type), allocatable :: error

      call self%file%close(error)
   end subroutine close_checkpoint

end module asperity_checkpoint
