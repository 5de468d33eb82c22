!> Checkpoints are files with the state of a run, from which the run can be continued.
!>
!> The checkpoint of FILE.h5 is FILE.checkpoint.h5. It is written under another name, written through to the
!> disk, and then replaces the old one in one step, so that there is always a complete checkpoint or none. It
!> contains the id of the result that it belongs to; the settings of the case as lines 'name =
!> value', so that a checkpoint of another case is refused; and the state (`checkpoint_pieces`). Its
!> user block shows whether the file is complete (`checkpoint_block`).
module asperity_checkpoint
   use asperity_errors, only : add_fault, error_convergence, error_file, error_input, error_type, fail
   use asperity_parallel, only : any_process, is_first_process, share
   use asperity_precision, only : dp
   use checkpoint_block, only : block_length, check_block, write_block
   use checkpoint_pieces, only : get_piece, put_piece
   use file_system, only : file_exists, remove_file, rename_file, sync_file
   use hdf5_file, only : hdf5_file_type
   use process_agreement, only : agree
   use result_names, only : checkpoint_path
   use state_table, only : state_table_type
   use text_tools, only : next_line, to_text
   implicit none
   private

   public :: checkpoint_writer_type, checkpoint_reader_type, remove_checkpoint

   !> A checkpoint under construction.
   type :: checkpoint_writer_type
      private
      type(hdf5_file_type) :: file
      character(:), allocatable :: path
      character(:), allocatable :: temporary
   contains
      procedure :: start
      procedure :: put_number
      procedure :: put_text
      procedure :: put_state
      procedure :: commit
   end type checkpoint_writer_type

   !> A checkpoint from which a run is continued.
   type :: checkpoint_reader_type
      private
      type(hdf5_file_type) :: file
      character(:), allocatable, public :: result_id   !! id of the result that it belongs to
   contains
      procedure :: open => open_checkpoint
      procedure :: compare
      procedure :: get_number
      procedure :: get_text
      procedure :: get_state
      procedure :: close => close_checkpoint
   end type checkpoint_reader_type

contains

   !> Remove the checkpoint of a result, and an unfinished one that a killed run has left.
   subroutine remove_checkpoint(result_path)
      character(*), intent(in) :: result_path

      call remove_file(checkpoint_path(result_path))
      call remove_file(checkpoint_path(result_path)//'.new')
   end subroutine remove_checkpoint

   ! --- writing ------------------------------------------------------------------------------

   !> Start a checkpoint. The present one stays until `commit`.
   !>
   !> The file remembers the first fault of the calls up to `commit`, which returns it, so that it is
   !> sufficient to check the error of `commit`. A call with `error` returns its fault itself.
   subroutine start(self, result_path, result_id, settings, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      character(*), intent(in) :: result_id     !! the attribute `id` of the result
      character(*), intent(in) :: settings      !! settings that must agree for a run to continue, see `compare`
      type(error_type), allocatable, intent(out), optional :: error

      self%path = checkpoint_path(result_path)
      self%temporary = self%path//'.new'
      call self%file%open(self%temporary, 'create', user_block=block_length)
      call self%file%create_group('/state')
      call self%file%write_attribute('/', 'result_id', result_id)
      call self%file%write_attribute('/', 'settings', settings)
      if (present(error)) call report(self, error)
   end subroutine start

   !> Add a number that is not part of the state.
   subroutine put_number(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error

      call self%file%write_attribute('/', name, value)
      if (present(error)) call report(self, error)
   end subroutine put_number

   !> Add a text that is not part of the state.
   subroutine put_text(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error

      call self%file%write_attribute('/', name, value)
      if (present(error)) call report(self, error)
   end subroutine put_text

   !> Add the state. Of these procedures only this one is collective: the first process has the file, and each
   !> of the others contributes its rows of the fields.
   subroutine put_state(self, table, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(state_table_type), intent(in) :: table
      type(error_type), allocatable, intent(out), optional :: error
      integer :: i

      if (is_first_process()) call self%file%write_attribute('/state', 'pieces', table%count)
      do i = 1, table%count
         call put_piece(self%file, table%pieces(i), table%grid)
      end do
      if (present(error) .and. is_first_process()) call report(self, error)
   end subroutine put_state

   !> Let the checkpoint replace the old one.
   subroutine commit(self, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%report(error)
      if (.not. allocated(error)) call self%file%close(error)
      call write_block(self%temporary, error)
      call sync_file(self%temporary, error)
      call rename_file(self%temporary, self%path, error)
      if (allocated(error)) call give_up(self)
   end subroutine commit

   !> Get the first fault so far. After a fault the unfinished checkpoint is removed.
   subroutine report(self, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%report(error)
      if (allocated(error)) call give_up(self)
   end subroutine report

   !> Abandon an unfinished checkpoint, and remove its file.
   subroutine give_up(self)
      class(checkpoint_writer_type), intent(inout) :: self

      call self%file%close()
      call remove_file(self%temporary)
   end subroutine give_up

   ! --- reading ------------------------------------------------------------------------------

   !> Open the checkpoint of a result. It is an error if there is none or if it is not whole, and if the run is
   !> complete: a process that dies after its last row may leave a checkpoint that nobody needs.
   subroutine open_checkpoint(self, result_path, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path

      path = checkpoint_path(result_path)
      if (is_complete(result_path)) then
         call fail(error, error_file, trim(result_path)//': the run is complete: there is nothing to continue')
         return
      else if (.not. file_exists(path)) then
         call fail(error, error_file, path//': there is no such file: '//trim(result_path)// &
            ' has no checkpoint from which to continue')
         return
      end if
      call check_block(path, error)
      if (allocated(error)) return
      call self%file%open(path, 'read')
      call self%file%read_attribute('/', 'result_id', self%result_id)
      call self%file%report(error)          ! the first fault of the two calls above
   end subroutine open_checkpoint

   !> Is there a result whose run has finished?
   function is_complete(result_path) result(complete)
      character(*), intent(in) :: result_path
      logical :: complete
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      integer :: finished

      complete = .false.
      if (.not. file_exists(trim(result_path))) return
      call file%open(trim(result_path), 'read')
      call file%read_attribute('/', 'finished', finished)
      call file%close(error)
      if (.not. allocated(error)) complete = finished == 1
   end function is_complete

   !> Check that the checkpoint belongs to a case. Every setting that differs is a fault.
   subroutine compare(self, settings, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: settings           !! of the case: lines 'name = value'
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(:), allocatable :: stored, name, value, line
      integer :: at, equals

      if (allocated(error)) return
      call self%file%read_attribute('/', 'settings', stored, error)
      if (allocated(error)) return
      if (stored == settings) return
      at = 1
      do while (at <= len(settings))
         call next_line(settings, at, line)
         equals = index(line, ' = ')
         if (equals == 0) cycle
         name = line(:equals - 1)
         call find_setting(stored, name, value)
         if (.not. allocated(value)) then
            call add_fault(error, error_input, self%file%path//': the checkpoint has no "'// &
               name//'", but the case has '//line(equals + 3:))
         else if (value /= line(equals + 3:)) then
            call add_fault(error, error_input, self%file%path//': '//name//' is '//value// &
               ' in the checkpoint and '//line(equals + 3:)//' in the case')
         end if
      end do
      if (.not. allocated(error)) call fail(error, error_input, self%file%path// &
         ': the checkpoint is that of another case: it has settings that the case does not have')
   end subroutine compare

   !> Find a setting among lines 'name = value'. Without such a line `value` remains unallocated.
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

   !> Get a number that is not part of the state. Without `error` the reader remembers a fault, and the next call
   !> that has one returns it.
   subroutine get_number(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error

      call self%file%read_attribute('/', name, value, error)
   end subroutine get_number

   !> Get a text that is not part of the state. It remains unallocated if the checkpoint does not have it.
   subroutine get_text(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error

      if (self%file%has_attribute('/', name)) call self%file%read_attribute('/', name, value, error)
   end subroutine get_text

   !> Get the state into the memory that the table points to. Arrays must have the same extents.
   !> Collective: the first process has the file.
   subroutine get_state(self, table, error)
      class(checkpoint_reader_type), intent(inout) :: self
      type(state_table_type), intent(inout) :: table
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path
      integer :: i

      do i = 1, table%count
         call get_piece(self%file, table%pieces(i), table%grid, error)
         if (allocated(error)) return
         if (any_process(.not. table%pieces(i)%is_finite())) then
            path = ''
            if (is_first_process()) path = self%file%path
            call share(path)
            call fail(error, error_convergence, path//': /state/'//table%pieces(i)%name// &
               ' holds a value that is not a finite number: the run cannot continue')
            return
         end if
      end do
      if (is_first_process()) call check_count(self, table, error)
      call agree(error)
   end subroutine get_state

   !> Check that the state has as many pieces as the case needs.
   subroutine check_count(self, table, error)
      class(checkpoint_reader_type), intent(inout) :: self
      type(state_table_type), intent(in) :: table
      type(error_type), allocatable, intent(out) :: error
      integer :: count

      call self%file%read_attribute('/state', 'pieces', count, error)      ! 0 after a fault
      if (allocated(error) .or. count == table%count) return
      call fail(error, error_input, self%file%path//': the state has '// &
         to_text(count)//' pieces, the case needs '//to_text(table%count)// &
         ': it was written by another version of Asperity')
   end subroutine check_count

   !> Close the checkpoint.
   subroutine close_checkpoint(self)
      class(checkpoint_reader_type), intent(inout) :: self

      call self%file%close()
   end subroutine close_checkpoint

end module asperity_checkpoint
