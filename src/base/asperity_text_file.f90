!> Reads a whole text file.
module asperity_text_file
   use asperity_errors, only : error_file, error_type, fail
   use text_tools, only : to_text
   implicit none
   private

   public :: read_text_file

   integer, parameter :: largest_file = 4000000      !! characters

contains

   !> The content of a file, byte by byte.
   subroutine read_text_file(path, text, error)
      character(*), intent(in) :: path
      character(:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: larger
      character(256) :: message
      character :: letter
      integer :: count, status, unit
      logical :: exists

      inquire (file=path, exist=exists)
      if (.not. exists) then
         call fail(error, error_file, path//': there is no such file')
         return
      end if
      message = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', &
         iostat=status, iomsg=message)
      if (status /= 0) then
         call fail(error, error_file, path//': cannot be read: '//trim(message))
         return
      end if
      allocate (character(4096) :: text)
      count = 0
      do
         read (unit, iostat=status, iomsg=message) letter
         if (status /= 0) exit
         if (count == len(text)) then
            allocate (character(2*count) :: larger)
            larger(:count) = text
            call move_alloc(larger, text)
         end if
         count = count + 1
         text(count:count) = letter
         if (count > largest_file) exit
      end do
      close (unit)
      if (.not. is_iostat_end(status)) then
         if (status == 0) message = 'it is longer than '//to_text(largest_file)//' characters'
         call fail(error, error_file, path//': cannot be read: '//trim(message))
         return
      end if
      text = text(:count)
   end subroutine read_text_file

end module asperity_text_file
