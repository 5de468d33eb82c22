!> Tests of fields that threads compress: HDF5 can read them, and the bytes do not depend on the threads.
module test_chunk_writer
   use asperity_errors, only : error_type
   use asperity_threads, only : set_threads, thread_count
   use asperity_precision, only : dp, int64, int8, pi
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use chunk_filters, only : expect_gain, filter_chunk, fletcher32
   use file_system, only : remove_file
   use hdf5_chunk_writer, only : chunk_writer_type
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : create_field, slab_rows
   implicit none
   private

   public :: run_chunk_writer

   character(*), parameter :: path = 'test_chunk_writer.h5'

contains

   subroutine run_chunk_writer()
      call begin_suite('chunk_writer')
      if (selected('sums_of_fletcher')) call sums_of_fletcher()
      if (selected('fields_come_back')) call fields_come_back()
      if (selected('bytes_for_any_number_of_threads')) call bytes_for_any_number_of_threads()
      if (selected('planes_worth_compressing')) call planes_worth_compressing()
      if (selected('random_planes_are_stored')) call random_planes_are_stored()
      if (selected('first_fault_ends_a_field')) call first_fault_ends_a_field()
      call remove_file(path)
   end subroutine run_chunk_writer

   !> Checksums that H5_checksum_fletcher32 of HDF5 1.10.8 gives for the same bytes.
   subroutine sums_of_fletcher()
      integer(int8), allocatable :: bytes(:)
      integer :: i

      allocate (bytes(0:200000))
      do i = 0, 200000
         bytes(i) = int(mod(i*37 + i/251, 256) - 128, int8)
      end do
      call check_sum(bytes(:199999), int(z'AAA3A242', int64), 'an even number of bytes')
      call check_sum(bytes, int(z'28E77E43', int64), 'an odd number of bytes')
      call check_sum(bytes(:0), int(z'80008000', int64), 'one byte')
      bytes = 0_int8
      call check_sum(bytes, 0_int64, 'zeros')
      bytes = -1_int8
      call check_sum(bytes(:1023), int(z'FFFFFFFF', int64), 'words of 65535, which is 0 modulo 65535')

   contains

      subroutine check_sum(values, wanted, what)
         integer(int8), intent(in), contiguous :: values(:)
         integer(int64), intent(in) :: wanted
         character(*), intent(in) :: what

         call check_that(fletcher32(values) == wanted, 'checksum of '//what)
      end subroutine check_sum
   end subroutine sums_of_fletcher

   !> A rough field, a part of which is zero. The numbers depend on the place only.
   pure function value_at(i, j) result(value)
      integer, intent(in) :: i, j
      real(dp) :: value

      value = sin(0.37_dp*i + 1.0e-3_dp*j)*cos(0.011_dp*i*j)
      if (mod(j/40, 3) == 1) value = 0.0_dp
   end function value_at

   !> Write a field of reals and one of bytes, whose last chunk is not full.
   subroutine write_fields(nx, ny, level, error)
      integer, intent(in) :: nx, ny, level
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      type(chunk_writer_type) :: writer
      real(dp), allocatable :: slab(:, :)
      integer :: first, i, j, rows

      call file%open(path, 'create')
      call create_field(file, '/reals', [nx, ny], .false., 'm', 'reals', level)
      call writer%start(file, '/reals', [nx, ny], .false., level)
      do first = 1, ny, slab_rows(nx)
         rows = min(slab_rows(nx), ny - first + 1)
         slab = reshape([((value_at(i, j), i=1, nx), j=first, first + rows - 1)], [nx, rows])
         call writer%add(file, first, slab)
      end do
      call writer%finish(file)
      call create_field(file, '/bytes', [nx, ny], .true., '1', 'bytes', level)
      call writer%start(file, '/bytes', [nx, ny], .true., level)
      do first = 1, ny, slab_rows(nx)
         rows = min(slab_rows(nx), ny - first + 1)
         call writer%add(file, first, reshape([((state_at(i, j), i=1, nx), j=first, first + rows - 1)], [nx, rows]))
      end do
      call writer%finish(file)
      call file%close(error)
   end subroutine write_fields

   !> A contact state.
   pure function state_at(i, j) result(state)
      integer, intent(in) :: i, j
      integer(int8) :: state

      state = int(mod(i/7 + j, 3) - 1, int8)
   end function state_at

   !> HDF5 can read the fields with every filter: chunks of many rows and of a single row, a last chunk that
   !> is not full, and fields smaller than a chunk.
   subroutine fields_come_back()
      integer, parameter :: nx(4) = [700, 131073, 5, 1], ny(4) = [1200, 3, 3, 1], levels(3) = [0, 1, 9]
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      real(dp), allocatable :: values(:, :)
      integer :: i, j, k, l
      character(40) :: what

      do k = 1, size(nx)
         do l = 1, size(levels)
            write (what, '(i0, " x ", i0, ", level ", i0)') nx(k), ny(k), levels(l)
            call write_fields(nx(k), ny(k), levels(l), error)
            call check_no_error(error, trim(what))
            call file%open(path, 'read')
            call file%read('/reals', values)
            call check_that(all(shape(values) == [nx(k), ny(k)]), 'shape, '//what)
            call check_close(maxval(abs(values - reshape([((value_at(i, j), i=1, nx(k)), j=1, ny(k))], &
               [nx(k), ny(k)]))), 0.0_dp, 0.0_dp, 'reals, '//what)
            call file%read('/bytes', values)
            call check_close(maxval(abs(values - reshape([((state_at(i, j), i=1, nx(k)), j=1, ny(k))], &
               [nx(k), ny(k)]))), 0.0_dp, 0.0_dp, 'bytes, '//what)
            call file%close(error)
            call check_no_error(error, 'read, '//what)
         end do
      end do
   end subroutine fields_come_back

   !> The file is the same for one thread and for more threads than chunks. HDF5 writes four times and a
   !> checksum, of four bytes each, into the header of a dataset.
   subroutine bytes_for_any_number_of_threads()
      integer, parameter :: threads(3) = [1, 2, 7]
      type(error_type), allocatable :: error
      integer(int8), allocatable :: found(:), wanted(:)
      integer :: before, k

      before = thread_count()
      do k = 1, size(threads)
         call set_threads(threads(k))
         call write_fields(2500, 700, 1, error)
         call check_no_error(error, 'write')
         call bytes_of_file(found)
         if (k == 1) wanted = found
         call check_that(size(found) == size(wanted), 'length of the file')
         if (size(found) == size(wanted)) call check_order(count(found /= wanted), '<=', 2*5*4, 'bytes of the file')
      end do
      call set_threads(before)
   end subroutine bytes_for_any_number_of_threads

   !> Bytes of the file.
   subroutine bytes_of_file(bytes)
      integer(int8), allocatable, intent(out) :: bytes(:)
      integer :: length, unit

      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read')
      inquire (unit=unit, size=length)
      allocate (bytes(length))
      read (unit) bytes
      close (unit)
   end subroutine bytes_of_file

   !> A random plane promises no gain. Frequent bytes, runs and repeated bytes do; for frequent bytes in random order
   !> shorter codes are enough.
   subroutine planes_worth_compressing()
      integer, parameter :: n = 2**17
      integer(int8), allocatable :: plane(:)
      real(dp), allocatable :: x(:)
      real(dp) :: gain
      logical :: by_codes_alone
      integer :: i

      allocate (x(n))
      call random_seed(put=[(i, i=1, 40)])
      call random_number(x)
      plane = int(floor(256.0_dp*x) - 128, int8)
      call expect_gain(plane, gain, by_codes_alone)
      call check_order(gain, '<', 0.01_dp, 'random bytes')
      do i = 4100, n
         plane(i) = plane(i - 4099)
      end do
      call expect_gain(plane, gain, by_codes_alone)
      call check_order(0.9_dp, '<', gain, 'random bytes that are repeated')
      call check_that(.not. by_codes_alone, 'repeats are searched for')
      plane = int(floor(256.0_dp*x) - 128, int8)
      plane(:n/4) = 0_int8
      call expect_gain(plane, gain, by_codes_alone)
      call check_order(0.2_dp, '<', gain, 'a quarter is zero')
      call check_that(.not. by_codes_alone, 'runs are searched for')
      plane = int(floor(16.0_dp*x), int8)
      call expect_gain(plane, gain, by_codes_alone)
      call check_close(gain, 0.5_dp, 0.01_dp, 'four bits of eight are used')
      call check_that(by_codes_alone, 'shorter codes are enough')
      call expect_gain(plane(:1), gain, by_codes_alone)
      call check_close(gain, 1.0_dp, 0.0_dp, 'a plane of one byte')
   end subroutine planes_worth_compressing

   !> Of random reals between 1 and 2, six bytes are stored unchanged, and two are compressed to less than
   !> one. The many zeros of this field need almost no space.
   subroutine random_planes_are_stored()
      integer, parameter :: n = 131072
      real(dp), allocatable :: x(:)
      integer(int8), allocatable :: stored(:)
      integer :: i, length
      logical :: success

      allocate (x(n))
      call random_seed(put=[(i, i=1, 40)])
      call random_number(x)
      x = 1.0_dp + x
      call filter_chunk(reshape(transfer(x, [0_int8], 8*n), [8, n]), 1, stored, length, success)
      call check_that(success, 'filter')
      call check_order(6*n, '<', length, 'six of eight bytes')
      call check_order(length, '<', 7*n, 'less than seven of eight bytes')
      call filter_chunk(reshape(spread(0_int8, 1, 8*n), [8, n]), 1, stored, length, success)
      call check_order(10*length, '<', n, 'zeros')
   end subroutine random_planes_are_stored

   !> A failed write (here because the rows are not those of a chunk) is reported at the end. The file is
   !> closed and can be read.
   subroutine first_fault_ends_a_field()
      type(hdf5_file_type) :: file
      type(chunk_writer_type) :: writer
      type(error_type), allocatable :: error
      real(dp), allocatable :: before(:, :), after(:, :)
      integer :: k

      call write_fields(131072, 2, 1, error)
      call check_no_error(error, 'write')
      call file%open(path, 'read')
      call file%read('/reals', before)
      call file%close()
      call file%open(path, 'append')
      call writer%start(file, '/reals', [131072, 2], .false., 1)
      do k = 3, 4
         call writer%add(file, k, reshape(spread(1.0_dp, 1, 131072), [131072, 1]))
      end do
      call writer%finish(file)
      call file%report(error)
      call check_that(allocated(error), 'a fault')
      if (allocated(error)) call check_that(index(error%message, path//': /reals: the dataset cannot be written') == 1, &
         error%message)
      call file%close()
      call file%open(path, 'read')
      call file%read('/reals', after)
      call file%close(error)
      call check_no_error(error, 'the file can be read')
      call check_close(maxval(abs(after - before)), 0.0_dp, 0.0_dp, 'what was written before')
   end subroutine first_fault_ends_a_field

end module test_chunk_writer
