!> Tests of the XDMF file: its paths, extents and names, and that it is replaced as a whole.
module test_xdmf
   use check, only : begin_suite, check_error, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use file_system, only : file_exists, remove_file
   use asperity_precision, only : dp
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   use xdmf, only : snapshot_name, snapshot_type, write_xdmf
   implicit none
   private

   public :: run_xdmf

   character(*), parameter :: path = 'test_xdmf.xdmf'

contains

   subroutine run_xdmf()
      call begin_suite('xdmf')
      if (selected('snapshots_are_listed')) call snapshots_are_listed()
   end subroutine run_xdmf

   !> The file names each snapshot once, with its extents; a missing folder is an error.
   subroutine snapshots_are_listed()
      type(error_type), allocatable :: error
      type(snapshot_type) :: snapshots(2)
      type(grid_type) :: grid
      character(:), allocatable :: text

      call check_that(snapshot_name(12) == '000012', 'short name')
      call check_that(snapshot_name(1234567) == '1234567', 'long name')
      grid = new_grid(7, 4, 14.0_dp, 2.0_dp, boundary_periodic)
      snapshots(1)%fields = [character(24) :: 'pressure']
      snapshots(2)%step = 12
      snapshots(2)%time = 0.5_dp
      snapshots(2)%fields = [character(24) :: 'pressure', 'contact']
      call write_xdmf(path, 'folder/a&b.h5', grid, snapshots, error)
      call check_no_error(error, 'the file is written')
      call check_that(.not. file_exists(path//'.new'), 'no temporary file left')
      text = content()
      call check_that(count_of(text, '<Grid') == 3 .and. count_of(text, '</Grid>') == 3, 'grids')
      call check_that(count_of(text, 'Dimensions="1 4 7"') == 7, 'extents')
      call check_that(count_of(text, '>a&amp;b.h5:/surface/height<') == 2, 'height')
      call check_that(count_of(text, '>a&amp;b.h5:/snapshots/000000/pressure<') == 1, 'pressure')
      call check_that(count_of(text, '>a&amp;b.h5:/snapshots/000012/contact<') == 1, 'contact')
      call check_that(count_of(text, 'NumberType="Char" Precision="1"') == 1, 'bytes')
      call check_that(count_of(text, '5.0000000000000000E-01"/>') == 1, 'time')
      call check_that(count_of(text, '2.0000000000000000E+00  5.0000000000000000E-01  2.0') == 2, &
         'spacing')
      call check_order(index(text, '</Xdmf>'), '>', 0, 'the file is complete')
      call write_xdmf(path, 'a.h5', grid, snapshots(:1), error)
      call check_that(count_of(content(), '<Time') == 1, 'the file is written again')
      snapshots(2)%time = 0.0_dp
      call write_xdmf(path, 'a.h5', grid, snapshots, error)
      call check_that(count_of(content(), '" 1.2000000000000000E+01"/>') == 1, 'rows in place of times that repeat')
      call write_xdmf('no_such_folder/x.xdmf', 'a.h5', grid, snapshots, error)
      call check_error(error, 'no_such_folder/x.xdmf: cannot be written', 'missing folder')
      call remove_file(path)
      call write_xdmf(path, 'a.h5', grid, snapshots, error)
      call check_that(.not. file_exists(path), 'nothing is written after an error')
      call check_error(error, 'no_such_folder/x.xdmf: cannot be written', 'the first error stays')
   end subroutine snapshots_are_listed

   !> Return the text of the file.
   function content() result(text)
      character(:), allocatable :: text
      integer :: unit, length

      inquire (file=path, size=length)
      allocate (character(length) :: text)
      open (newunit=unit, file=path, access='stream', action='read')
      read (unit) text
      close (unit)
   end function content

   !> Return the number of times that a fragment occurs.
   integer function count_of(text, fragment)
      character(*), intent(in) :: text, fragment
      integer :: first, found

      count_of = 0
      first = 1
      do
         found = index(text(first:), fragment)
         if (found == 0) exit
         count_of = count_of + 1
         first = first + found
      end do
   end function count_of

end module test_xdmf
