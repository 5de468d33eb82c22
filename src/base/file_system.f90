!> Operations on files that Fortran lacks: rename, remove, write through to the disk, and so on.
!>
!> A procedure with the argument `error` does nothing if an error is already set. Several of them may therefore be
!> called in sequence, and the error is checked once, after the last call.
module file_system
   use, intrinsic :: iso_c_binding, only : c_char, c_funptr, c_int, c_int64_t, c_null_char
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : int64
   use system_calls, only : action_none, c_signal, in_place_of_procedure, signal_file_size
   implicit none
   private

   public :: rename_file, remove_file, sync_file, lengthen_file, file_exists, file_identity, is_folder, &
      folder_of, name_of, is_terminal, let_size_limit_be_an_error

   integer(c_int), parameter :: open_read_write = 2     !! O_RDWR of every Unix

   interface
      function c_rename(old, new) bind(c, name='rename') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: old(*), new(*)
         integer(c_int) :: status
      end function c_rename

      function c_unlink(path) bind(c, name='unlink') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: status
      end function c_unlink

      function c_open(path, flags) bind(c, name='open') result(descriptor)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
         integer(c_int) :: descriptor
      end function c_open

      function c_fsync(descriptor) bind(c, name='fsync') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_fsync

      function c_close(descriptor) bind(c, name='close') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_close

      function c_isatty(descriptor) bind(c, name='isatty') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_isatty

      function c_truncate(descriptor, length) bind(c, name='ftruncate') result(status)
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: length
         integer(c_int) :: status
      end function c_truncate
   end interface

contains

   !> Give a file another name in the same file system. A file that already has this name is
   !> replaced in one step: at any time there is either the old or the new one.
   subroutine rename_file(old, new, error)
      character(*), intent(in) :: old
      character(*), intent(in) :: new
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (c_rename(old//c_null_char, new//c_null_char) /= 0) then
         call fail(error, error_file, new//': cannot be written: renaming '//old//' failed')
      end if
   end subroutine rename_file

   !> Remove a file. It is not an error if there is none.
   subroutine remove_file(path)
      character(*), intent(in) :: path
      integer(c_int) :: status

      status = c_unlink(path//c_null_char)
   end subroutine remove_file

   !> Wait until everything that was written to a file is on the disk.
   subroutine sync_file(path, error)
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor, status, closed

      if (allocated(error)) return
      descriptor = c_open(path//c_null_char, open_read_write)
      status = -1
      if (descriptor >= 0) then
         status = c_fsync(descriptor)
         closed = c_close(descriptor)
         if (closed /= 0) status = closed
      end if
      if (status /= 0) call fail(error, error_file, path//': cannot be written through to the disk')
   end subroutine sync_file

   !> Make an open file at least this long. The bytes that are added read as zeros and take no space yet.
   subroutine lengthen_file(path, descriptor, length, error)
      character(*), intent(in) :: path          !! of the file
      integer(c_int), intent(in) :: descriptor  !! of the open file: another one may have taken its name
      integer(int64), intent(in) :: length      !! bytes
      type(error_type), allocatable, intent(inout) :: error
      integer(int64) :: now

      if (allocated(error)) return
      inquire (file=path, size=now)
      if (now >= length) return
      if (c_truncate(descriptor, int(length, c_int64_t)) /= 0) then
         call fail(error, error_file, path//': cannot be written: the file cannot grow')
      end if
   end subroutine lengthen_file

   !> The numbers of the device and of the inode of a file, which no other file has; -1 if there is none of this name.
   !> `stat` returns only the last 32 bits of them.
   function file_identity(path) result(identity)
      character(*), intent(in) :: path
      integer :: identity(2)
      integer :: properties(13)
      integer :: status

      identity = -1
      call stat(path, properties, status)
      if (status == 0) identity = properties(1:2)
   end function file_identity

   !> Make a write beyond the limit on the size of files fail with an error. By default the system would
   !> end the program.
   subroutine let_size_limit_be_an_error()
      type(c_funptr) :: before

      before = c_signal(signal_file_size, in_place_of_procedure(action_none))
   end subroutine let_size_limit_be_an_error

   !> Is there a file or folder of this name?
   logical function file_exists(path)
      character(*), intent(in) :: path

      inquire (file=path, exist=file_exists)
   end function file_exists

   !> Is this a folder?
   logical function is_folder(path)
      character(*), intent(in) :: path

      inquire (file=path//'/.', exist=is_folder)
   end function is_folder

   !> The folder of a path, or '.' if the path contains none.
   pure function folder_of(path) result(folder)
      character(*), intent(in) :: path
      character(:), allocatable :: folder
      integer :: slash

      slash = index(path, '/', back=.true.)
      if (slash == 0) then
         folder = '.'
      else if (slash == 1) then
         folder = '/'
      else
         folder = path(:slash - 1)
      end if
   end function folder_of

   !> A path without its folder.
   pure function name_of(path) result(name)
      character(*), intent(in) :: path
      character(:), allocatable :: name

      name = path(index(path, '/', back=.true.) + 1:)
   end function name_of

   !> Is this descriptor (1 standard output, 2 standard error) a terminal?
   logical function is_terminal(descriptor)
      integer, intent(in) :: descriptor

      is_terminal = c_isatty(int(descriptor, c_int)) /= 0
   end function is_terminal

end module file_system
