!> Writes compressed fields chunk by chunk and filters the chunks on all threads. A chunk is a slab of rows
!> (`slab_rows`).
!>
!> HDF5 itself filters with one thread, which often takes longer than solving the step. Here some chunks are
!> gathered, the threads filter them (module `chunk_filters`), and the filtered chunks are then written to
!> the file in their order. The memory needed is that of at most `most_chunks` unfiltered and twice as many
!> filtered chunks. The bytes in the file are the same for any number of threads.
!>
!> The file remembers the first fault (see `hdf5_handle`).
module hdf5_chunk_writer
   use, intrinsic :: iso_c_binding, only : c_f_pointer, c_loc, c_ptr
   use asperity_errors, only : error_memory, error_type, fail
   use asperity_threads, only : thread_count
   use asperity_precision, only : dp, int8
   use chunk_filters, only : filter_chunk
   use hdf5_c_values, only : h5dclose, h5dopen2, h5dwrite_chunk
   use hdf5_file, only : hdf5_file_type
   use hdf5_kinds, only : hid_t, hsize_t, size_t
   use hdf5_library, only : c_text, h5p_default, status_of
   use hdf5_slabs, only : slab_rows
   implicit none
   private

   public :: chunk_writer_type

   integer, parameter :: most_chunks = 16          !! largest number of gathered chunks

   !> A filtered chunk.
   type :: stored_type
      integer(int8), allocatable :: bytes(:)
      integer :: length = 0                        !! number of bytes in use
      integer :: first = 0                         !! its first row, from 1
      logical :: success = .true.                  !! false if there was not enough memory
   end type stored_type

   !> A field that is being written. A variable of this type must not be copied.
   type :: chunk_writer_type
      private
      character(:), allocatable :: path            !! of the dataset
      integer(hid_t) :: dataset = -1               !! -1: none
      integer :: level = 0                         !! of compression, 0 to 9
      integer :: value_bytes = 8
      integer :: chunk_values = 0                  !! values of a chunk
      integer :: gathered = 0                      !! chunks that wait to be filtered
      integer :: ready = 0                         !! chunks that wait to be written
      integer :: turn = 1                          !! column of `stored` for the gathered chunks
      integer(int8), allocatable :: values(:, :, :)   !! [bytes of a value, values, gathered chunks]
      type(stored_type), allocatable :: stored(:, :)  !! [chunks, 2]
   contains
      procedure :: start => start_field
      procedure, private :: add_reals, add_bytes
      !> Add the next chunk.
      generic :: add => add_reals, add_bytes
      procedure :: finish => finish_field
   end type chunk_writer_type

contains

   !> Begin to write a field that `create_field` has created. The previous field must be finished:
   !> otherwise the positions of both in the file would depend on the number of threads.
   subroutine start_field(self, file, path, extent, bytes, level)
      class(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      integer, intent(in) :: extent(2)             !! nx, ny
      logical, intent(in) :: bytes                 !! true for a field of bytes, false for reals
      integer, intent(in) :: level                 !! of compression, 0 none to 9 smallest
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: most, status

      call self%finish(file)
      if (file%has_failed()) return
      self%path = path
      self%level = max(0, min(level, 9))
      self%value_bytes = merge(1, 8, bytes)
      self%chunk_values = extent(1)*min(slab_rows(extent(1)), extent(2))
      most = min(most_chunks, 2*thread_count(), (extent(2) - 1)/slab_rows(extent(1)) + 1)
      allocate (self%values(self%value_bytes, self%chunk_values, most), stat=status)
      if (status == 0) allocate (self%stored(most, 2), stat=status)
      if (status /= 0) then
         call fail(fault, error_memory, file%path//': '//path//': not enough memory to write the dataset')
      else
         call file%resolve(path, location, name)
         self%dataset = h5dopen2(location, c_text(name), h5p_default)
         call file%checked(status_of(self%dataset), 'the dataset cannot be written', path, fault)
      end if
      call file%settle(fault)
   end subroutine start_field

   !> Add a chunk of reals.
   subroutine add_reals(self, file, first, slab)
      class(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: first                 !! row where the chunk begins, from 1
      real(dp), intent(in), contiguous, target :: slab(:, :)   !! [nx, rows], all rows of the chunk

      call add_chunk(self, file, first, c_loc(slab), size(slab))
   end subroutine add_reals

   !> Add a chunk of bytes.
   subroutine add_bytes(self, file, first, slab)
      class(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: first
      integer(int8), intent(in), contiguous, target :: slab(:, :)

      call add_chunk(self, file, first, c_loc(slab), size(slab))
   end subroutine add_bytes

   !> Gather a chunk. If the last chunk has fewer rows, it is completed with zeros.
   subroutine add_chunk(self, file, first, address, count)
      type(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: first
      type(c_ptr), intent(in) :: address           !! address of the values
      integer, intent(in) :: count                 !! number of values
      integer(int8), pointer, contiguous :: bytes(:, :)

      if (file%has_failed()) return
      call c_f_pointer(address, bytes, [self%value_bytes, count])
      self%gathered = self%gathered + 1
      self%values(:, :count, self%gathered) = bytes
      self%values(:, count + 1:, self%gathered) = 0_int8
      self%stored(self%gathered, self%turn)%first = first
      if (self%gathered == size(self%values, 3)) call work_off(self, file)
   end subroutine add_chunk

   !> Write the chunks that are already filtered, while other threads filter the gathered ones.
   subroutine work_off(self, file)
      type(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      type(error_type), allocatable :: fault
      integer :: k, status

      !$omp parallel default(none) shared(self, status) private(k) &
      !$omp num_threads(max(1, min(thread_count(), self%gathered)))
      !$omp master
      ! Only the first thread calls HDF5, which reports a fault to the thread where it occurred.
      call write_ready(self, status)
      !$omp end master
      !$omp do schedule(dynamic, 1)
      do k = 1, self%gathered
         associate (chunk => self%stored(k, self%turn))
            call filter_chunk(self%values(:, :, k), self%level, chunk%bytes, chunk%length, chunk%success)
         end associate
      end do
      !$omp end parallel
      call file%checked(status, 'the dataset cannot be written', self%path, fault)
      if (.not. allocated(fault) .and. .not. all(self%stored(:self%gathered, self%turn)%success)) &
         call fail(fault, error_memory, file%path//': '//self%path//': not enough memory to write the dataset')
      self%ready = self%gathered
      self%gathered = 0
      self%turn = 3 - self%turn
      call file%settle(fault)
   end subroutine work_off

   !> Write the chunks that are already filtered.
   subroutine write_ready(self, status)
      type(chunk_writer_type), intent(inout) :: self
      integer, intent(out) :: status
      integer(hsize_t) :: start(2)
      integer :: k

      status = 0
      do k = 1, self%ready
         associate (chunk => self%stored(k, 3 - self%turn))
            start = [int(chunk%first - 1, hsize_t), 0_hsize_t]
            status = h5dwrite_chunk(self%dataset, h5p_default, 0, start, int(chunk%length, size_t), chunk%bytes)
         end associate
         if (status < 0) exit
      end do
      self%ready = 0
   end subroutine write_ready

   !> Write the rest of the field, if one has been started. After a fault nothing is written, but the dataset
   !> is still closed, because HDF5 keeps a file open as long as one of its datasets is open.
   subroutine finish_field(self, file)
      class(chunk_writer_type), intent(inout) :: self
      class(hdf5_file_type), intent(inout) :: file
      type(error_type), allocatable :: fault
      integer :: status

      if (self%dataset >= 0) then
         ! The first call filters the last chunks, and the second one writes them.
         if (.not. file%has_failed()) call work_off(self, file)
         if (.not. file%has_failed()) call work_off(self, file)
         status = int(h5dclose(self%dataset))
         if (.not. file%has_failed()) call file%checked(status, 'the dataset cannot be written', self%path, fault)
         call file%settle(fault)
      end if
      self%dataset = -1
      self%gathered = 0
      self%ready = 0
      self%turn = 1
      if (allocated(self%values)) deallocate (self%values)
      if (allocated(self%stored)) deallocate (self%stored)
   end subroutine finish_field

end module hdf5_chunk_writer
