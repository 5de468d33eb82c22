!> The user block of a checkpoint: one line of text that shows whether the file is complete.
!>
!> A checkpoint is an HDF5 file whose first 512 bytes are a user block, which HDF5 does not use.
!> They contain one line of text with the length of the file and the checksum of all bytes behind
!> the block. Both are compared before HDF5 reads the file, because HDF5 may crash or hang on a
!> damaged file, or return wrong numbers.
module checkpoint_block
   use asperity_checksum, only : checksum_of_file, hexadecimal
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : int64
   use text_tools, only : to_text
   implicit none
   private

   public :: check_block, write_block

   integer, parameter, public :: block_length = 512           !! bytes of the user block
   character(*), parameter :: block_mark = 'asperity checkpoint 2, '

contains

   !> Write the block of a file that is complete except for the block.
   subroutine write_block(path, error)
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(block_length) :: block
      integer :: unit, status

      if (allocated(error)) return
      call make_block(path, block, error)
      if (allocated(error)) return
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
         action='readwrite', iostat=status)
      if (status == 0) write (unit, pos=1, iostat=status) block
      if (status == 0) close (unit, iostat=status)
      if (status /= 0) call fail(error, error_file, path//': cannot be written')
   end subroutine write_block

   !> Check that a checkpoint is as it was written.
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
         call fail(error, error_file, path//': is damaged, or not a checkpoint of this version of '// &
            'Asperity')
      end if
   end subroutine check_block

   !> The block that belongs to the bytes of a file behind it.
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

end module checkpoint_block
