!> Tests of the HDF5 files: the values that are read are those that were written, and every failure has its
!> message.
module test_hdf5_file
   use check, only : begin_suite, check_close, check_error, check_no_error, check_that, selected
   use asperity_errors, only : error_file, error_input, error_type
   use file_system, only : remove_file
   use hdf5_field, only : field_reader_type
   use hdf5_file, only : hdf5_file_type
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: run_hdf5_file

   character(*), parameter :: path = 'test_hdf5_file.h5'

contains

   subroutine run_hdf5_file()
      call begin_suite('hdf5_file')
      if (selected('values_come_back')) call values_come_back()
      if (selected('fields_are_read')) call fields_are_read()
      if (selected('columns_grow')) call columns_grow()
      if (selected('staged_groups_appear_whole')) call staged_groups_appear_whole()
      if (selected('failures_are_explained')) call failures_are_explained()
      if (selected('first_fault_of_a_chain_is_reported')) call first_fault_of_a_chain_is_reported()
      call remove_file(path)
   end subroutine run_hdf5_file

   !> Attributes and datasets of every kind, on a grid that is not square.
   subroutine values_come_back()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(:), allocatable :: text, long_text
      real(dp), allocatable :: x1(:), x2(:, :), x3(:, :, :)
      real(dp) :: field(5, 3), layers(5, 3, 2), x
      integer, allocatable :: extent(:)
      integer(int8) :: states(5, 3)
      integer :: i, j, n

      do j = 1, 3
         do i = 1, 5
            field(i, j) = i + 10.0_dp*j
            states(i, j) = int(mod(i + j, 3), int8)
         end do
      end do
      layers(:, :, 1) = field
      layers(:, :, 2) = -field
      long_text = repeat('a line of a long text'//new_line('a'), 5000)

      call file%open(path, 'create', error)
      call check_no_error(error, 'create')
      call file%write_attribute('/', 'title', 'Stra'//char(195)//char(159)//'e', error)
      call file%write_attribute('/', 'empty', '', error)
      call file%write_attribute('/', 'input', long_text, error)
      call check_no_error(error, 'long text')
      call file%write_attribute('/', 'finished', 0, error)
      call file%write_attribute('/', 'finished', 1, error)
      call file%create_group('/a', error)
      call file%write_attribute('/a', 'length', 2.5_dp, error)
      call file%write('/a/vector', [1.0_dp, 2.0_dp, 4.0_dp], 'm', 'a vector', error)
      call check_no_error(error, 'vector')
      call file%write('/a/nothing', field(1:0, 1), 'm', 'an empty vector', error)
      call check_no_error(error, 'empty vector')
      call file%write('/b/c/field', field, 'Pa', 'a field', error, compression=4)
      call check_no_error(error, 'compressed field in new groups')
      call file%write('/b/part', field(2:4, :), 'Pa', 'a part of a field', error)
      call file%write('/b/layers', layers, 'Pa', 'two fields', error, compression=1)
      call file%write('/b/map', states, '1', 'a map', error, compression=1)
      call check_no_error(error, 'map')
      call file%close(error)
      call check_no_error(error, 'close')

      call file%open(path, 'read', error)
      call check_no_error(error, 'open')
      call file%read_attribute('/', 'title', text, error)
      call check_that(text == 'Stra'//char(195)//char(159)//'e', 'text attribute')
      call file%read_attribute('/', 'empty', text, error)
      call check_that(len(text) == 0, 'empty attribute')
      call file%read_attribute('/', 'input', text, error)
      call check_that(text == long_text .and. len(text) == len(long_text), 'long attribute')
      call file%read_attribute('/', 'finished', n, error)
      call check_that(n == 1, 'attribute rewritten')
      call file%read_attribute('/a', 'length', x, error)
      call check_close(x, 2.5_dp, 0.0_dp, 'real attribute')
      call file%read_attribute('/b/c/field', 'units', text, error)
      call check_that(text == 'Pa', 'units')
      call file%read_attribute('/b/c/field', 'long_name', text, error)
      call check_that(text == 'a field', 'long name')
      call file%read('/a/vector', x1, error)
      call check_that(size(x1) == 3 .and. all(same(x1, [1.0_dp, 2.0_dp, 4.0_dp])), 'vector')
      call file%read('/a/nothing', x1, error)
      call check_no_error(error, 'empty vector read')
      call check_that(size(x1) == 0, 'empty vector')
      call file%read('/b/c/field', x2, error)
      call check_that(all(shape(x2) == [5, 3]) .and. all(same(x2, field)), 'field')
      call file%read('/b/part', x2, error)
      call check_that(all(shape(x2) == [3, 3]) .and. all(same(x2, field(2:4, :))), 'part')
      call file%read('/b/layers', x3, error)
      call check_that(all(same(x3, layers)), 'layers')
      call file%read('/b/map', x2, error)
      call check_that(all(nint(x2) == states), 'map')
      call file%dataset_shape('/b/layers', extent, error)
      call check_that(all(extent == [5, 3, 2]), 'shape')
      call check_that(file%has('/b/c') .and. .not. file%has('/b/d/e'), 'existence')
      call check_that(file%has_dataset('/b/map') .and. .not. file%has_dataset('/b/c'), 'datasets')
      call check_that(file%has_attribute('/', 'title'), 'attribute there')
      call check_that(.not. file%has_attribute('/', 'tile'), 'attribute not there')
      call file%close(error)
   end subroutine values_come_back

   !> Height maps are read from the named dataset, or from one of the usual names.
   subroutine fields_are_read()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      type(field_reader_type) :: reader
      real(dp) :: height(4, 2), field(4, 2)
      integer :: i

      height = reshape([(real(i, dp), i=1, 8)], [4, 2])
      call file%open(path, 'create', error)
      call file%write('/surface', height, 'm', 'height', error)
      call file%write('/line', [1.0_dp], 'm', 'a line', error)
      call file%close(error)
      call reader%open(path, '', [4, 2], error)
      call check_no_error(error, 'usual name')
      call check_that(all(reader%extent == [4, 2]), 'shape of the surface')
      call reader%read(2, field(:, 2:), error)
      call reader%read(1, field(:, :1), error)
      call check_no_error(error, 'rows one by one')
      call check_that(all(same(field, height)), 'surface')
      call reader%close()
      call reader%open(path, 'heights', [4, 2], error)
      call check_error(error, 'there is no dataset "heights"; there are: line, surface', 'missing')
      call check_that(error%status == error_file, 'status of a missing dataset')
      call file%open(path, 'append', error)
      call file%create_group('/maps/height', error)
      call file%close(error)
      call reader%open(path, 'maps/height', [4, 2], error)
      call check_error(error, '"maps/height" is a group, not a dataset; there are: line, maps/height/, surface', &
         'a group')
      call reader%open(path, 'line', [4, 2], error)
      call check_error(error, 'has 1 dimensions, not 2', 'shape')
      call check_that(error%status == error_input, 'status of a wrong shape')

      call file%open(path, 'create', error)
      call file%write('/surface/height', 2*height, 'm', 'height', error)
      call file%close(error)
      call reader%open(path, '', [4, 2], error)
      call reader%read(1, field, error)
      call check_that(all(same(field, 2*height)), 'surface/height')
      call reader%close()
      call reader%open(path, '', [2, 4], error)
      call check_no_error(error, 'another shape')
      call check_that(all(reader%extent == [4, 2]), 'the caller finds the other shape')
      call reader%close()
   end subroutine fields_are_read

   !> Columns grow beyond their first chunk, and after the file was closed.
   subroutine columns_grow()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: x(:)
      integer :: row

      call file%open(path, 'create', error)
      call file%create_group('/history', error)
      call file%create_column('/history/x', .false., 10, 'm', 'x', error)
      call file%create_column('/history/n', .true., 10, '1', 'n', error)
      call check_no_error(error, 'columns made')
      do row = 0, 199
         call file%append('/history/x', row, [0.5_dp*row], error)
         if (allocated(error)) exit
         call file%append('/history/n', row, [real(3*row, dp)], error)
         if (allocated(error)) exit
      end do
      call check_no_error(error, 'rows written')
      call file%close(error)
      call file%open(path, 'append', error)
      call check_no_error(error, 'opened again')
      call file%append('/history/x', 200, [1.0_dp, 2.0_dp, 3.0_dp], error)
      call check_no_error(error, 'several rows')
      call file%close(error)
      call file%open(path, 'read', error)
      call file%read('/history/x', x, error)
      call check_that(size(x) == 203, 'length')
      call check_that(all(same(x(:200), [(0.5_dp*row, row=0, 199)])), 'reals')
      call check_that(all(same(x(201:), [1.0_dp, 2.0_dp, 3.0_dp])), 'rows added later')
      call file%read('/history/n', x, error)
      call check_that(size(x) == 200 .and. all(nint(x) == [(3*row, row=0, 199)]), 'whole numbers')
      call file%close(error)
   end subroutine columns_grow

   !> A group is not visible while it is written, and then it is.
   subroutine staged_groups_appear_whole()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: x(:)
      character(256), allocatable :: names(:)
      integer :: i
      character(8) :: name

      call file%open(path, 'create', error)
      call file%create_group('/snapshots', error, expected=300)
      do i = 1, 300
         write (name, '(i6.6)') i
         call file%stage_group('/snapshots/'//trim(name), error)
         if (allocated(error)) exit
         call file%write('/snapshots/'//trim(name)//'/x', [real(i, dp)], 'm', 'x', error)
         call file%write_attribute('/snapshots/'//trim(name), 'step', i, error)
         call file%members('/snapshots', names, error)
         if (size(names) /= i - 1) exit
         call file%publish_group(error)
         if (allocated(error)) exit
      end do
      call check_no_error(error, 'groups published')
      call check_that(i == 301, 'no group is seen before it is published')
      call file%stage_group('/snapshots/000007', error)
      call file%write('/snapshots/000007/x', [-7.0_dp], 'm', 'x', error)
      call file%publish_group(error)
      call check_no_error(error, 'a group replaced')
      call file%remove('/snapshots/000300', error)
      call file%close(error)
      call file%open(path, 'read', error)
      call file%members('/snapshots', names, error)
      call check_that(size(names) == 299, 'number of groups')
      call check_that(names(299) == '000299', 'order of names')
      call file%read('/snapshots/000007/x', x, error)
      call check_that(all(same(x, [-7.0_dp])), 'replaced group')
      call file%close(error)
   end subroutine staged_groups_appear_whole

   !> Every failure has its own error.
   subroutine failures_are_explained()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: x(:)
      integer :: unit, n

      call file%open('no_such_file.h5', 'read', error)
      call check_error(error, 'no_such_file.h5: there is no such file', 'missing file')
      call check_that(error%status == error_file, 'status of a missing file')
      call file%close(error)
      call check_no_error(error, 'nothing to close')
      open (newunit=unit, file=path, status='replace')
      write (unit, '(a)') 'this is plain text'
      close (unit)
      call file%open(path, 'read', error)
      call check_error(error, 'is not an HDF5 file', 'not HDF5')
      call file%open('.', 'read', error)
      call check_error(error, 'is a folder', 'folder')
      call file%open('no_such_folder/x.h5', 'create', error)
      call check_error(error, 'there is no folder "no_such_folder"', 'missing folder')
      call file%open('/proc/asperity.h5', 'create', error)
      call check_error(error, 'cannot be written', 'folder that takes no files')
      call file%open(repeat('x', 300)//'.h5', 'create', error)
      call check_error(error, 'cannot be written: File name too long', 'why a file cannot be written')
      call file%open(path, 'create', error)
      call file%write('/x', [1.0_dp], 'm', 'x', error)
      call file%close(error)
      call cut_file(100)
      call file%open(path, 'read', error)
      call check_error(error, 'cannot be read: its end is missing: it has 100 of', 'file that is cut off')
      call file%open(path, 'create', error)
      call file%write('/x', [1.0_dp], 'm', 'x', error)
      call file%read('/y', x, error)
      call check_error(error, 'there is no dataset "/y"; there are: x', 'missing dataset')
      call file%read_attribute('/x', 'size', n, error)
      call check_error(error, '/x has no attribute "size"', 'missing attribute')
      call file%write('/x', [2.0_dp], 'm', 'x', error)
      call check_error(error, '/x: the dataset cannot be written', 'dataset written twice')
      call file%write('/z', [2.0_dp], 'm', 'x', error)
      call check_error(error, '/x: the dataset cannot be written', 'nothing after a failure')
      call file%close(error)
      call check_no_error(error, 'close after a failure')
   end subroutine failures_are_explained

   !> Keep only the first bytes of the file.
   subroutine cut_file(length)
      integer, intent(in) :: length
      character(length) :: bytes
      integer :: unit

      open (newunit=unit, file=path, access='stream', status='old')
      read (unit) bytes
      close (unit, status='delete')
      open (newunit=unit, file=path, access='stream', status='new')
      write (unit) bytes
      close (unit)
   end subroutine cut_file

   !> In a chain of calls without an error argument, the first fault ends the chain. Later writes have no
   !> effect, and this fault is reported, however many follow.
   subroutine first_fault_of_a_chain_is_reported()
      character(*), parameter :: other_path = 'build/first_fault.h5'
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      integer :: n

      call file%open(other_path, 'create')
      call file%write('/x', [1.0_dp], 'm', 'x')
      call file%flush()
      call file%report(error)
      call check_no_error(error, 'a chain without a fault')

      call file%write('/x', [2.0_dp], 'm', 'x')
      call file%write_attribute('/nowhere', 'n', 3)
      call file%write('/y', [4.0_dp], 'm', 'y')
      call file%create_group('/group')
      call file%report(error)
      call check_error(error, other_path//': /x: the dataset cannot be written', 'the first of two faults')
      call file%write('/z', [4.0_dp], 'm', 'z', error)
      call check_error(error, '/x: the dataset cannot be written', 'the same fault for later writes')
      call file%flush(error)
      call check_error(error, '/x: the dataset cannot be written', 'the same fault for a flush')
      call check_that(.not. file%has('/y') .and. .not. file%has('/group'), 'nothing was written after it')
      call file%close(error)
      call check_no_error(error, 'closing does not report a fault again')

      call file%open(other_path, 'read')
      call check_that(file%has('/x') .and. .not. file%has('/y'), 'what was written before the fault')
      n = 7
      call file%read_attribute('/x', 'first', n)
      call check_that(n == 0, 'a value that was not read is 0')
      call file%read_attribute('/x', 'second', n)
      call file%close(error)
      call check_error(error, '/x has no attribute "first"', 'closing reports a fault that was not asked for')

      call file%open('no_such_file.h5', 'read')
      call file%read_attribute('/', 'n', n)
      call file%report(error)
      call check_error(error, 'no_such_file.h5: there is no such file', 'a file that was not opened')
      call file%open(other_path, 'read')
      call file%report(error)
      call check_no_error(error, 'opening forgets the fault of the file before')
      call file%close(error)
   end subroutine first_fault_of_a_chain_is_reported

   !> Two arrays have the same bits.
   elemental logical function same(a, b)
      real(dp), intent(in) :: a, b

      same = abs(a - b) <= 0.0_dp
   end function same

end module test_hdf5_file
