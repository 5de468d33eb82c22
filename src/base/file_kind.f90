!> What a name in the file system stands for (a file, a folder, a device, a link), and whether two names
!> stand for the same file.
module file_kind
   use asperity_precision, only : int64
   implicit none
   private

   public :: is_dangling_link, is_other_than_file, file_start, same_inode

   integer, parameter :: kind_bits = int(o'170000')     !! S_IFMT of every Unix
   integer, parameter :: regular = int(o'100000')       !! S_IFREG
   integer, parameter :: link = int(o'120000')          !! S_IFLNK

contains

   !> Does this name stand for something other than a regular file, such as a folder, a device or a
   !> pipe? A link stands for its target.
   function is_other_than_file(path) result(yes)
      character(*), intent(in) :: path
      logical :: yes
      integer :: values(13), status

      call stat(path, values, status)
      yes = .false.
      if (status == 0) yes = iand(values(3), kind_bits) /= regular
   end function is_other_than_file

   !> Is this a link without a target?
   function is_dangling_link(path) result(yes)
      character(*), intent(in) :: path
      logical :: yes
      integer :: values(13), status

      call lstat(path, values, status)
      yes = .false.
      if (status /= 0) return
      if (iand(values(3), kind_bits) /= link) return
      call stat(path, values, status)
      yes = status /= 0
   end function is_dangling_link

   !> Is the file of this name the one that a unit is connected to?
   function same_inode(path, unit) result(yes)
      character(*), intent(in) :: path
      integer, intent(in) :: unit
      logical :: yes
      integer :: named(13), opened(13), status

      yes = .false.
      call stat(path, named, status)
      if (status /= 0) return
      call fstat(unit, opened, status)
      if (status == 0) yes = all(named(1:2) == opened(1:2))
   end function same_inode

   !> The first bytes of a file, at most `length`. The text is '' if the file cannot be read or is
   !> empty.
   function file_start(path, length) result(text)
      character(*), intent(in) :: path
      integer, intent(in) :: length
      character(:), allocatable :: text
      integer(int64) :: size_of_file
      integer :: unit, status

      text = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
         action='read', iostat=status)
      if (status /= 0) return
      inquire (unit=unit, size=size_of_file)
      text = repeat(' ', int(max(0_int64, min(size_of_file, int(length, int64)))))
      if (len(text) > 0) read (unit, iostat=status) text
      if (status /= 0) text = ''
      close (unit)
   end function file_start

end module file_kind
