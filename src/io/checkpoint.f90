!> The state of a run from which it can go on, in a file of its own: a checkpoint.
!>
!> The checkpoint of FILE.h5 is FILE.checkpoint.h5. It is written under another name, brought to the
!> disk, and then takes the old one's place at once: there is always a whole one or none. It holds
!> the settings of the case as pairs of name and value, so that one of another case is refused.
module checkpoint
   use errors, only : add_fault, error_file, error_input, error_type, fail
   use file_system, only : file_exists, remove_file, rename_file, sync_file
   use hdf5_file, only : hdf5_file_type
   use precision, only : dp
   implicit none
   private

   public :: checkpoint_writer_type, checkpoint_reader_type, pair_type, checkpoint_path, &
      remove_checkpoint

   !> A setting of the case.
   type :: pair_type
      character(:), allocatable :: name     !! such as 'grid: nx'
      character(:), allocatable :: value    !! such as '256'
   end type pair_type

   !> A checkpoint under construction.
   type :: checkpoint_writer_type
      private
      type(hdf5_file_type) :: file
      character(:), allocatable :: path
      character(:), allocatable :: temporary
   contains
      procedure :: start
      procedure, private :: put_vector, put_field, put_fields, put_integer, put_real, put_text
      !> Add a piece of the state.
      generic :: put => put_vector, put_field, put_fields, put_integer, put_real, put_text
      procedure :: commit
   end type checkpoint_writer_type

   !> A checkpoint to go on from.
   type :: checkpoint_reader_type
      private
      type(hdf5_file_type) :: file
   contains
      procedure :: open => open_checkpoint
      procedure :: compare
      procedure, private :: get_vector, get_field, get_fields, get_integer, get_real, get_text
      !> Get a piece of the state; arrays have their extents already and must fit.
      generic :: get => get_vector, get_field, get_fields, get_integer, get_real, get_text
      procedure :: close => close_checkpoint
   end type checkpoint_reader_type

contains

   !> Name of the checkpoint of a result.
   pure function checkpoint_path(result_path) result(path)
      character(*), intent(in) :: result_path
      character(:), allocatable :: path
      integer :: length

      length = len_trim(result_path)
      if (length > 3) then
         if (result_path(length - 2:length) == '.h5') length = length - 3
      end if
      path = result_path(:length)//'.checkpoint.h5'
   end function checkpoint_path

   !> Remove a result's checkpoint, and what a killed run left of an unfinished one.
   subroutine remove_checkpoint(result_path)
      character(*), intent(in) :: result_path

      call remove_file(checkpoint_path(result_path))
      call remove_file(checkpoint_path(result_path)//'.new')
   end subroutine remove_checkpoint

   ! --- writing ------------------------------------------------------------------------------

   !> Start a checkpoint; the one there is stays until `commit`.
   subroutine start(self, result_path, settings, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      type(pair_type), intent(in) :: settings(:)     !! what must agree for a run to go on
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      self%path = checkpoint_path(result_path)
      self%temporary = self%path//'.new'
      call self%file%open(self%temporary, 'create', error)
      if (allocated(error)) return
      call self%file%create_group('/settings', error)
      do i = 1, size(settings)
         if (allocated(error)) exit
         call self%file%write_attribute('/settings', settings(i)%name, settings(i)%value, error)
      end do
      if (allocated(error)) call give_up(self)
   end subroutine start

   !> Leave an unfinished checkpoint and remove its file.
   subroutine give_up(self)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable :: closing

      call self%file%close(closing)
      call remove_file(self%temporary)
   end subroutine give_up

   !> Add numbers.
   subroutine put_vector(self, name, values, units, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), contiguous :: values(:)
      character(*), intent(in) :: units
      type(error_type), allocatable, intent(out) :: error

      call self%file%write('/'//name, values, units, name, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_vector

   !> Add a field.
   subroutine put_field(self, name, values, units, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), contiguous :: values(:, :)
      character(*), intent(in) :: units
      type(error_type), allocatable, intent(out) :: error

      call self%file%write('/'//name, values, units, name, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_field

   !> Add several fields.
   subroutine put_fields(self, name, values, units, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in), contiguous :: values(:, :, :)
      character(*), intent(in) :: units
      type(error_type), allocatable, intent(out) :: error

      call self%file%write('/'//name, values, units, name, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_fields

   !> Add a whole number.
   subroutine put_integer(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', name, value, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_integer

   !> Add a real number.
   subroutine put_real(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', name, value, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_real

   !> Add a text.
   subroutine put_text(self, name, value, error)
      class(checkpoint_writer_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', name, value, error)
      if (allocated(error)) call give_up(self)
   end subroutine put_text

   !> Let the checkpoint take the old one's place.
   subroutine commit(self, error)
      class(checkpoint_writer_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%flush(error)
      if (.not. allocated(error)) call self%file%close(error)
      if (.not. allocated(error)) call sync_file(self%temporary, error)
      if (.not. allocated(error)) call rename_file(self%temporary, self%path, error)
      if (allocated(error)) call give_up(self)
   end subroutine commit

   ! --- reading ------------------------------------------------------------------------------

   !> Open the checkpoint of a result.
   subroutine open_checkpoint(self, result_path, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: result_path
      type(error_type), allocatable, intent(out) :: error

      if (.not. file_exists(checkpoint_path(result_path))) then
         if (is_complete(result_path)) then
            call fail(error, error_file, trim(result_path)//': the run is complete: there is '// &
               'nothing to go on with')
         else
            call fail(error, error_file, checkpoint_path(result_path)// &
               ': there is no such file: '//trim(result_path)//' has no checkpoint to go on from')
         end if
         return
      end if
      call self%file%open(checkpoint_path(result_path), 'read', error)
   end subroutine open_checkpoint

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
      type(pair_type), intent(in) :: settings(:)     !! of the case
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: missing
      character(:), allocatable :: value
      integer :: i

      do i = 1, size(settings)
         if (.not. self%file%has_attribute('/settings', settings(i)%name)) then
            call add_fault(error, error_input, self%file%path//': the checkpoint knows no "'// &
               settings(i)%name//'", the case has '//settings(i)%value)
            cycle
         end if
         call self%file%read_attribute('/settings', settings(i)%name, value, missing)
         if (allocated(missing)) then
            call add_fault(error, missing%status, missing%message)
         else if (value /= settings(i)%value) then
            call add_fault(error, error_input, self%file%path//': '//settings(i)%name// &
               ' is '//value//' in the checkpoint and '//settings(i)%value//' in the case')
         end if
      end do
   end subroutine compare

   !> Get numbers.
   subroutine get_vector(self, name, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(inout) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:)
      integer :: i

      call self%file%read('/'//name, stored, error)
      if (allocated(error)) return
      call see_fit(self, name, shape(stored), shape(values), error)
      if (allocated(error)) return
      do i = 1, size(values)
         values(i) = stored(i)
      end do
   end subroutine get_vector

   !> Get a field.
   subroutine get_field(self, name, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(inout) :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :)
      integer :: j

      call self%file%read('/'//name, stored, error)
      if (allocated(error)) return
      call see_fit(self, name, shape(stored), shape(values), error)
      if (allocated(error)) return
      do j = 1, size(values, 2)
         values(:, j) = stored(:, j)
      end do
   end subroutine get_field

   !> Get several fields.
   subroutine get_fields(self, name, values, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(inout) :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable :: stored(:, :, :)
      integer :: j, k

      call self%file%read('/'//name, stored, error)
      if (allocated(error)) return
      call see_fit(self, name, shape(stored), shape(values), error)
      if (allocated(error)) return
      do k = 1, size(values, 3)
         do j = 1, size(values, 2)
            values(:, j, k) = stored(:, j, k)
         end do
      end do
   end subroutine get_fields

   !> See that an array of the checkpoint has the extents of the run's.
   subroutine see_fit(self, name, stored, wanted, error)
      class(checkpoint_reader_type), intent(in) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: stored(:)
      integer, intent(in) :: wanted(:)
      type(error_type), allocatable, intent(out) :: error
      character(120) :: text

      if (all(stored == wanted)) return
      write (text, '(*(i0, :, " "))') stored
      text = ': the extents are '//trim(text)//', the case needs'
      write (text(len_trim(text) + 2:), '(*(i0, :, " "))') wanted
      call fail(error, error_input, self%file%path//': '//name//trim(text))
   end subroutine see_fit

   !> Get a whole number.
   subroutine get_integer(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%read_attribute('/', name, value, error)
   end subroutine get_integer

   !> Get a real number.
   subroutine get_real(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%read_attribute('/', name, value, error)
   end subroutine get_real

   !> Get a text.
   subroutine get_text(self, name, value, error)
      class(checkpoint_reader_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%read_attribute('/', name, value, error)
   end subroutine get_text

   !> Close the checkpoint.
   subroutine close_checkpoint(self)
      class(checkpoint_reader_type), intent(inout) :: self
      type(error_type), allocatable :: error

      call self%file%close(error)
   end subroutine close_checkpoint

end module checkpoint
