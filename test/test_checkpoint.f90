!> Tests of checkpoints: the state comes back bit by bit, and only into the case it belongs to; a
!> checkpoint that is not as it was written is refused.
module test_checkpoint
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : begin_suite, check_close, check_error, check_no_error, check_that, selected
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type, &
      remove_checkpoint
   use asperity_checksum, only : checksum_of_checksums, checksum_of_file, checksum_of_text, &
      checksums_of_rows, crc32_of_values, hexadecimal
   use asperity_errors, only : error_convergence, error_file, error_input, error_type
   use file_system, only : file_exists
   use asperity_precision, only : dp, int64, int8
   use state_table, only : state_table_type
   use result_names, only : checkpoint_path
   implicit none
   private

   public :: run_checkpoint

   character(*), parameter :: path = 'test_checkpoint.h5'
   character(*), parameter :: nl = new_line('a')
   character(*), parameter :: settings = '&grid: nx = 5'//nl//'&friction: law = coulomb'//nl

   !> A state with a piece of each kind.
   type :: pieces_type
      logical :: truth = .true.
      integer :: whole = 12
      integer :: wholes(2) = [7, -3]
      integer(int8), allocatable :: bytes(:, :)
      real(dp) :: number = 0.1_dp
      real(dp) :: vector(4) = 0.0_dp
      real(dp), allocatable :: field(:, :)
      real(dp), allocatable :: layers(:, :, :)
      real(dp), allocatable :: missing(:, :)
      character(8) :: text = 'slide'
   end type pieces_type

contains

   subroutine run_checkpoint()
      call begin_suite('checkpoint')
      call remove_checkpoint(path)
      if (selected('checksums')) call checksums()
      if (selected('state_comes_back')) call state_comes_back()
      if (selected('other_cases_are_refused')) call other_cases_are_refused()
      if (selected('old_one_stays_until_commit')) call old_one_stays_until_commit()
      if (selected('damage_is_found')) call damage_is_found()
      if (selected('values_that_are_no_numbers_are_refused')) &
         call values_that_are_no_numbers_are_refused()
      call remove_checkpoint(path)
      call check_that(.not. file_exists(checkpoint_path(path)), 'removed')
   end subroutine run_checkpoint

   !> The published check value, any split into words and bytes, and a field.
   subroutine checksums()
      type(error_type), allocatable :: error
      character(27) :: text
      real(dp) :: field(3, 2)
      integer(int64) :: sum, whole, turned
      integer :: unit

      ! As zlib finds it in Python: zlib.crc32(struct.pack('<3d', 1.0, -2.5e-3, 1e300)).
      call check_that(crc32_of_values([1.0_dp, -2.5e-3_dp, 1.0e300_dp]) == 3242893255_int64, 'CRC-32')
      call check_that(hexadecimal(checksum_of_text('123456789')) == '995DC9BBDF1939FA', &
         'check value of CRC-64/XZ')
      text = 'abcdefghijklmnopqrstuvwxyz'//nl
      whole = checksum_of_text(text)
      open (newunit=unit, file='test_checksum.txt', access='stream', form='unformatted', &
         status='replace')
      write (unit) 'xy', text
      close (unit)
      call checksum_of_file('test_checksum.txt', 3_int64, sum, error)
      call check_no_error(error, 'a file')
      call check_that(sum == whole, 'three words and three bytes are the same as 27 bytes')
      open (newunit=unit, file='test_checksum.txt')
      close (unit, status='delete')
      call checksum_of_file('test_checksum.txt', 1_int64, sum, error)
      call check_error(error, 'cannot be read', 'no file')
      field = reshape([1, 2, 3, 4, 5, 6], [3, 2])
      sum = checksum_of_checksums(3, checksums_of_rows(field))
      turned = checksum_of_checksums(2, checksums_of_rows(reshape(field, [2, 3])))
      call check_that(turned /= sum, 'the shape of a field')
      field(2, 2) = nearest(field(2, 2), 1.0_dp)
      call check_that(checksum_of_checksums(3, checksums_of_rows(field)) /= sum, 'the last bit of a field')
   end subroutine checksums

   !> The table of a state.
   subroutine list(state, table)
      type(pieces_type), intent(in), target :: state
      type(state_table_type), intent(out) :: table

      call table%add('part/truth', state%truth, 'a truth')
      call table%add('part/whole', state%whole, 'a whole number')
      call table%add('wholes', state%wholes, 'whole numbers')
      call table%add('bytes', state%bytes, 'small whole numbers')
      call table%add('number', state%number, 's', 'a number')
      call table%add('vector', state%vector, 'm', 'numbers')
      call table%add('field', state%field, 'Pa', 'a field')
      call table%add('layers', state%layers, 'Pa', 'fields')
      call table%add('missing', state%missing, 'Pa', 'a field that this case does not have')
      call table%add('text', state%text, 'a word')
   end subroutine list

   !> Write a checkpoint of a state.
   subroutine write_state(state, error)
      type(pieces_type), intent(in), target :: state
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_writer_type) :: writer
      type(state_table_type) :: table

      call list(state, table)
      call writer%start(path, 'id', settings, error)
      if (.not. allocated(error)) call writer%put_number('summit', 0.3_dp, error)
      if (.not. allocated(error)) call writer%put_text('two_lines', 'one'//nl//'two', error)
      if (.not. allocated(error)) call writer%put_text('no_line', '', error)
      if (.not. allocated(error)) call writer%put_state(table, error)
      if (.not. allocated(error)) call writer%commit(error)
   end subroutine write_state

   !> Every kind of piece comes back with all its bits.
   subroutine state_comes_back()
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      type(pieces_type), target :: state, found
      type(state_table_type) :: table
      real(dp) :: summit

      allocate (state%field(5, 3), state%layers(5, 3, 2), state%bytes(5, 3))
      call random_number(state%field)
      call random_number(state%layers)
      call random_number(state%vector)
      state%bytes = 2_int8
      state%bytes(4, 1) = 1_int8
      call check_that(checkpoint_path('a/b.h5') == 'a/b.checkpoint.h5', 'name')
      call check_that(checkpoint_path('a/b.out') == 'a/b.out.checkpoint.h5', 'another name')
      call reader%open(path, error)
      call check_error(error, 'has no checkpoint from which to continue', 'none')
      call check_that(error%status == error_file, 'status of none')
      call write_state(state, error)
      call check_no_error(error, 'written')
      call check_that(.not. file_exists(checkpoint_path(path)//'.new'), 'no temporary file left')

      found = pieces_type(truth=.false., whole=0, wholes=0, number=0.0_dp, text='')
      allocate (found%field(5, 3), found%layers(5, 3, 2), found%bytes(5, 3))
      call list(found, table)
      call reader%open(path, error)
      call check_no_error(error, 'open')
      call check_that(reader%result_id == 'id', 'id of the result')
      call reader%get_number('summit', summit, error)
      call check_close(summit, 0.3_dp, 0.0_dp, 'a number beside the state')
      call check_texts(reader)
      call reader%get_state(table, error)
      call check_no_error(error, 'get the state')
      call check_that(found%truth .and. found%whole == 12 .and. all(found%wholes == [7, -3]), 'integers')
      call check_that(all(found%bytes == state%bytes) .and. found%text == 'slide', 'bytes and text')
      call check_that(all(abs(found%field - state%field) <= 0.0_dp), 'field', &
         [maxval(abs(found%field - state%field))])
      call check_that(all(abs(found%layers - state%layers) <= 0.0_dp), 'layers', &
         [maxval(abs(found%layers - state%layers))])
      call check_that(all(abs(found%vector - state%vector) <= 0.0_dp), 'vector', &
         [maxval(abs(found%vector - state%vector))])
      call check_close(found%number, 0.1_dp, 0.0_dp, 'number')

      deallocate (found%field)
      allocate (found%field(4, 3), found%missing(5, 3))
      call list(found, table)
      call reader%get_state(table, error)
      call check_error(error, '/state/field: the extents are 5 3, the case needs 4 3', 'extents')
      found%field = state%field
      call list(found, table)
      call reader%get_state(table, error)
      call check_error(error, 'there is no dataset "/state/missing"', 'missing piece')
      deallocate (found%missing, found%layers)
      call list(found, table)
      call reader%get_state(table, error)
      call check_error(error, 'the state has 9 pieces, the case needs 8', 'a piece too many')
      call reader%close()
   end subroutine state_comes_back

   !> Texts beside the state; older checkpoints do not have all of them.
   subroutine check_texts(reader)
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable :: error
      character(:), allocatable :: text

      call reader%get_text('two_lines', text, error)
      call check_no_error(error, 'get a text')
      call check_that(text == 'one'//nl//'two', 'a text beside the state')
      call reader%get_text('no_line', text, error)
      call check_no_error(error, 'get an empty text')
      call check_that(len(text) == 0, 'an empty text beside the state')
      call reader%get_text('unknown', text, error)
      call check_no_error(error, 'a text that the checkpoint does not have is no error')
      call check_that(.not. allocated(text), 'a text that the checkpoint does not have')
   end subroutine check_texts

   !> Every setting that differs is named in the message.
   subroutine other_cases_are_refused()
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error

      call reader%open(path, error)
      call reader%compare(settings, error)
      call check_no_error(error, 'same case')
      call reader%compare('&grid: nx = 6'//nl//'&friction: law = none'//nl, error)
      call check_error(error, '&grid: nx is 5 in the checkpoint and 6 in the case', 'first')
      call check_error(error, '&friction: law is coulomb in the checkpoint and none in the case', &
         'second')
      call check_that(error%status == error_input, 'status')
      call reader%compare(settings//'&grid: ny = 3'//nl, error)
      call check_error(error, '&grid: nx is 5 in the checkpoint and 6 in the case', 'the first error stays')
      deallocate (error)
      call reader%compare(settings//'&grid: ny = 3'//nl, error)
      call check_error(error, 'has no "&grid: ny"', 'unknown setting')
      deallocate (error)
      call reader%compare('&grid: nx = 5'//nl, error)
      call check_error(error, 'it has settings that the case does not have', 'missing setting')
      call reader%close()
   end subroutine other_cases_are_refused

   !> A checkpoint that is not finished does not replace the one before.
   subroutine old_one_stays_until_commit()
      type(checkpoint_writer_type) :: writer
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      real(dp) :: summit

      call writer%start(path, 'id', settings, error)
      call writer%put_number('summit', 0.4_dp, error)
      call reader%open(path, error)
      call reader%get_number('summit', summit, error)
      call check_close(summit, 0.3_dp, 0.0_dp, 'old one')
      call reader%close()
      call writer%commit(error)
      call reader%open(path, error)
      call reader%get_number('summit', summit, error)
      call check_close(summit, 0.4_dp, 0.0_dp, 'new one')
      call reader%close()
      call writer%start('no_such_folder/x.h5', 'id', settings, error)
      call check_error(error, 'there is no folder', 'missing folder')
   end subroutine old_one_stays_until_commit

   !> A flipped bit anywhere, and a shorter or longer file, are found before HDF5 reads the file.
   subroutine damage_is_found()
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      integer(int8), allocatable :: bytes(:)
      integer(int64) :: length
      integer :: place, step, unit, refused, tried

      inquire (file=checkpoint_path(path), size=length)
      allocate (bytes(length))
      open (newunit=unit, file=checkpoint_path(path), access='stream', form='unformatted')
      read (unit) bytes
      step = max(1, int(length)/200)
      refused = 0
      tried = 0
      do place = 1, int(length), step
         write (unit, pos=place) ieor(bytes(place), shiftl(1_int8, mod(place, 8)))
         flush (unit)
         call reader%open(path, error)
         tried = tried + 1
         if (allocated(error)) then
            if (error%status == error_file) refused = refused + 1
         end if
         write (unit, pos=place) bytes(place)
      end do
      call check_that(refused == tried .and. tried > 100, 'each flipped bit is found', &
         [real(refused, dp), real(tried, dp)])
      write (unit, pos=length + 1) 0_int8
      flush (unit)
      call reader%open(path, error)
      call check_error(error, 'is damaged', 'a byte too many')
      close (unit)
   end subroutine damage_is_found

   !> A whole checkpoint with a value that is not a number is refused with the status of a solver.
   subroutine values_that_are_no_numbers_are_refused()
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      type(pieces_type), target :: state
      type(state_table_type) :: table

      allocate (state%layers(5, 3, 2), source=0.0_dp)
      state%layers(2, 1, 2) = ieee_value(1.0_dp, ieee_quiet_nan)
      call write_state(state, error)
      call check_no_error(error, 'written')
      call reader%open(path, error)
      call check_no_error(error, 'opened')
      call list(state, table)
      call reader%get_state(table, error)
      call check_error(error, '/state/layers holds a value that is not a finite number', 'not a number')
      call check_that(error%status == error_convergence, 'status of a solver')
      call reader%close()
   end subroutine values_that_are_no_numbers_are_refused

end module test_checkpoint
