!> A lock that one process at a time can hold. It ends with the process, even if the process is killed.
!>
!> The lock is flock(2) on a small file beside the files that it protects. The system releases it
!> when the process ends, for whatever reason. The file contains a line about the process that holds
!> the lock; other processes quote this line in their error messages. The file is removed when the lock
!> is released. A file that a dead process left behind does no harm, and shows that this process has ended. A
!> process that takes the lock without using it therefore leaves such a file as it was. On a file system without
!> locks there is no protection.
module file_lock
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_errors, only : error_file, error_type, fail
   use file_kind, only : file_start, is_other_than_file, same_inode
   use asperity_precision, only : int64
   use file_system, only : remove_file
   use text_tools, only : to_text
   use utc_clock, only : utc_time
   implicit none
   private

   public :: file_lock_type, lock_free, lock_held, state_of_lock

   integer, parameter :: lock_unknown = 0                  !! there is no lock, or it is on another machine or system
   integer, parameter :: lock_held = 1                     !! a process holds it
   integer, parameter :: lock_free = 2                     !! the process that took it has ended without releasing it

   integer(c_int), parameter :: exclusive_at_once = 6      !! LOCK_EX + LOCK_NB of every Unix
   integer(c_int), parameter :: unlock = 8                 !! LOCK_UN
   integer, parameter :: would_block(2) = [11, 35]         !! EWOULDBLOCK of Linux and of macOS
   integer, parameter :: attempts = 20                     !! number of attempts to lock a file that others may remove
   character(*), parameter :: mark = 'asperity process '   !! the first words of a lock file

   !> A lock. A variable of this type must not be copied.
   type :: file_lock_type
      private
      integer :: unit = 0                                  !! 0 if no file is open
      character(:), allocatable :: path
      character(:), allocatable :: left                    !! the line that a dead process left in the file; '' if none
   contains
      procedure :: acquire
      procedure :: release
   end type file_lock_type

   interface
      function c_flock(descriptor, operation) bind(c, name='flock') result(status)
         import :: c_int
         integer(c_int), value :: descriptor, operation
         integer(c_int) :: status
      end function c_flock

      function c_getpid() bind(c, name='getpid') result(number)
         import :: c_int
         integer(c_int) :: number
      end function c_getpid
   end interface

contains

   !> Take the lock. If another process holds it, report that process at once instead of waiting.
   subroutine acquire(self, path, protected, error)
      class(file_lock_type), intent(inout) :: self
      character(*), intent(in) :: path                !! of the lock's own file
      character(*), intent(in) :: protected           !! what the lock protects, for messages
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(200) :: reason, host
      character(:), allocatable :: holder
      integer :: status, try

      if (allocated(error)) return
      if (is_other_than_file(path)) then
         call fail(error, error_file, path//': is needed as a lock, and is not a regular file')
         return
      end if
      holder = file_start(path, 200)
      if (holder /= '' .and. index(holder, mark) /= 1) then
         call fail(error, error_file, path//': is needed as a lock, and is not a file of Asperity')
         return
      end if
      do try = 1, attempts
         open (newunit=self%unit, file=path, action='readwrite', status='unknown', iostat=status, &
            iomsg=reason)
         if (status /= 0) then
            self%unit = 0
            ! gfortran's runtime refuses to open a file twice, so this process itself has the lock.
            if (index(reason, 'already opened') > 0) then
               call fail(error, error_file, protected//': is in use by another run of this process')
            else
               call fail(error, error_file, protected//': cannot be written: '//trim(reason))
            end if
            return
         end if
         if (c_flock(int(fnum(self%unit), c_int), exclusive_at_once) /= 0) then
            if (any(ierrno() == would_block)) then
               holder = holder_in(self%unit)
               close (self%unit)
               self%unit = 0
               call fail(error, error_file, protected//': is in use by '//holder// &
                  ': wait for it, or choose another --output')
               return
            end if
         end if
         ! The process that held the lock may have removed the file after it was opened here. The
         ! lock would then be on a file without a name, so try again with a new file.
         if (same_inode(path, self%unit)) exit
         close (self%unit)
         self%unit = 0
      end do
      if (self%unit == 0) then
         call fail(error, error_file, path//': cannot be locked')
         return
      end if
      self%path = path
      self%left = first_line(self%unit)
      call hostnm(host)
      call write_line(self%unit, mark//to_text(int(c_getpid()))//' on '//trim(host)//' since '//utc_time())
   end subroutine acquire

   !> The process that holds a lock, by what it has written into the file.
   function holder_in(unit) result(holder)
      integer, intent(in) :: unit
      character(:), allocatable :: holder

      holder = first_line(unit)
      if (holder == '') then
         holder = 'another process'
      else
         holder = holder(len('asperity ') + 1:)
      end if
   end function holder_in

   !> The state of a lock. An attempt to take it could prevent a run from starting at that moment. Linux's list of all
   !> locks is read instead.
   function state_of_lock(path) result(state)
      character(*), intent(in) :: path                !! of the lock's own file
      integer :: state
      character(200) :: host, line
      character(:), allocatable :: holder
      integer :: properties(13), status, unit

      state = lock_unknown
      holder = file_start(path, 200)
      call hostnm(host)
      if (index(holder, mark) /= 1 .or. index(holder, ' on '//trim(host)//' since ') == 0) return
      call stat(path, properties, status)
      if (status /= 0) return

      open (newunit=unit, file='/proc/locks', status='old', action='read', iostat=status)
      if (status /= 0) return
      state = lock_free
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, ' FLOCK ') > 0 .and. is_file_of(line, properties(2))) state = lock_held
      end do
      close (unit)
   end function state_of_lock

   !> Does a line of /proc/locks, which contains `major:minor:inode`, name a file of this inode? `stat` returns only the
   !> last 32 bits of it. Another file that has the same bits and is locked would be taken for this one, which is rare
   !> and only makes a message wrong.
   pure function is_file_of(line, inode) result(yes)
      character(*), intent(in) :: line
      integer, intent(in) :: inode
      logical :: yes
      integer(int64), parameter :: last_bits = 2_int64**32 - 1
      integer(int64) :: found
      integer :: status

      read (line(index(line, ':', back=.true.) + 1:), *, iostat=status) found
      yes = status == 0
      if (yes) yes = iand(found, last_bits) == iand(int(inode, int64), last_bits)
   end function is_file_of

   !> The line of a process in the file of a lock; empty if there is none.
   function first_line(unit) result(text)
      integer, intent(in) :: unit
      character(:), allocatable :: text
      character(200) :: line
      integer :: status

      rewind (unit)
      read (unit, '(a)', iostat=status) line
      text = ''
      if (status == 0 .and. index(line, mark) == 1) text = trim(line)
   end function first_line

   !> Replace the content of the file by a line.
   subroutine write_line(unit, line)
      integer, intent(in) :: unit
      character(*), intent(in) :: line
      integer :: status

      rewind (unit)
      write (unit, '(a)', iostat=status) line
      flush (unit, iostat=status)
   end subroutine write_line

   !> Release the lock. Nothing happens if it is not held.
   subroutine release(self, used)
      class(file_lock_type), intent(inout) :: self
      logical, intent(in) :: used                          !! whether the protected files were changed under the lock
      integer(c_int) :: status

      if (self%unit == 0) return
      if (used .or. self%left == '') then
         call remove_file(self%path)
      else
         call write_line(self%unit, self%left)
      end if
      ! Closing is not enough, because a child of this process may have the file open as well.
      status = c_flock(int(fnum(self%unit), c_int), unlock)
      close (self%unit)
      self%unit = 0
   end subroutine release

end module file_lock
