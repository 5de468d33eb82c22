!> Tests of the result: the layout, rows and snapshots, continuation after a given row, a full disk.
module test_result_file
   use check, only : begin_suite, check_close, check_error, check_no_error, check_order, &
      check_that, selected
   use asperity_checkpoint, only : checkpoint_reader_type
   use asperity_errors, only : error_file, error_type
   use file_system, only : file_exists, remove_file
   use hdf5_file, only : hdf5_file_type
   use history_table, only : column_type, history_columns
   use asperity_precision, only : dp
   use regular_grid, only : boundary_free, grid_type, new_grid
   use result_file, only : result_file_type, result_plan_type
   use result_names, only : checkpoint_path, sibling_path
   use result_writer, only : nx, ny, pressure_of, write_result
   implicit none
   private

   public :: run_result_file

   character(*), parameter :: path = 'test_result_file.h5'
   character(*), parameter :: other_path = 'test_result_file_2.h5'

contains

   subroutine run_result_file()
      call begin_suite('result_file')
      if (selected('layout_is_kept')) call layout_is_kept()
      if (selected('run_goes_on')) call run_goes_on()
      if (selected('wrong_use_is_refused')) call wrong_use_is_refused()
      call remove_file(path)
      call remove_file(other_path)
      call remove_file(checkpoint_path(path))
      call remove_file(sibling_path(path, '.xdmf'))
   end subroutine run_result_file

   !> The content of a complete result.
   subroutine layout_is_kept()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      type(column_type), allocatable :: columns(:)
      character(:), allocatable :: text
      character(256), allocatable :: names(:)
      character(24), parameter :: root_texts(*) = [character(24) :: &
         'title', 'program', 'version', 'created', 'input', 'settings']
      real(dp), allocatable :: x(:), field(:, :)
      real(dp) :: time
      integer :: i, finished

      call write_result(path, 13, 3, .false., error)
      call check_no_error(error, 'written')
      call check_that(.not. file_exists(path//'.new'), 'no temporary file left')
      call file%open(path, 'read', error)
      call check_no_error(error, 'open')
      do i = 1, size(root_texts)
         call file%read_attribute('/', trim(root_texts(i)), text, error)
         call check_no_error(error, trim(root_texts(i)))
         call check_order(len(text), '>', 0, trim(root_texts(i)))
      end do
      call file%read_attribute('/', 'input', text, error)
      call check_that(text == '&case title = ''a small run'' /', 'input verbatim')
      call file%read_attribute('/', 'created', text, error)
      call check_that(len(text) == 20 .and. text(11:11) == 'T' .and. text(20:20) == 'Z', 'created')
      call file%read_attribute('/', 'finished', finished, error)
      call check_that(finished == 1, 'finished')
      call file%read('/grid/x', x, error)
      call check_that(size(x) == nx .and. all(abs(x - [(2.0_dp*i, i=0, nx - 1)]) <= 0.0_dp), 'x')
      call file%read('/grid/y', x, error)
      call check_that(size(x) == ny, 'y')
      call file%read_attribute('/grid', 'boundary', text, error)
      call check_that(text == 'periodic', 'boundary')
      call file%read('/surface/height', field, error)
      call check_close(maxval(abs(field - pressure_of(0))), 0.0_dp, 0.0_dp, 'height')
      call file%read('/material/prony_g', x, error)
      call check_that(size(x) == 2, 'material')
      call check_that(file%has_dataset('/material/poisson'), 'poisson')

      columns = history_columns()
      do i = 1, size(columns)
         call file%read('/history/'//trim(columns(i)%name), x, error)
         call check_no_error(error, 'column '//trim(columns(i)%name))
         call check_that(size(x) == 13, 'length of '//trim(columns(i)%name))
         call file%read_attribute('/history/'//trim(columns(i)%name), 'units', text, error)
         call check_that(text == trim(columns(i)%units), 'units of '//trim(columns(i)%name))
      end do
      call file%read('/history/step', x, error)
      call check_that(all(nint(x) == [(i, i=0, 12)]), 'steps')
      call file%read('/history/friction', x, error)
      call check_close(maxval(abs(x - [(1.0_dp + i, i=0, 12)])), 0.0_dp, 0.0_dp, 'friction')

      call file%members('/snapshots', names, error)
      call check_that(size(names) == 5 .and. names(5) == '000012', 'snapshots')
      call file%read_attribute('/snapshots/000012', 'time', time, error)
      call check_close(time, 3.0_dp, 0.0_dp, 'time of a snapshot')
      call file%read('/snapshots/000012/pressure', field, error)
      call check_close(maxval(abs(field - pressure_of(12))), 0.0_dp, 0.0_dp, 'field of a snapshot')
      call file%read('/snapshots/000012/contact', field, error)
      call check_that(nint(field(2, 1)) == 1 .and. nint(field(1, 2)) == 0, 'contact map')
      call check_that(file%has('/checkpoint'), 'checkpoint seen through the result')
      call file%read('/checkpoint/state/pressure', field, error)
      call check_close(maxval(abs(field - pressure_of(11))), 0.0_dp, 0.0_dp, 'field of the checkpoint')
      call file%close(error)
   end subroutine layout_is_kept

   !> A run that continues from its checkpoint removes later rows, and ends with the same result.
   subroutine run_goes_on()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      type(result_file_type) :: output
      type(checkpoint_reader_type) :: checkpoint
      character(256), allocatable :: names(:)
      real(dp), allocatable :: x(:), field(:, :)
      integer :: i, finished

      call write_result(path, 14, 0, .false., error)
      call check_no_error(error, 'written')
      call output%reopen(path, id_of(path), 7, 0, error)
      call check_no_error(error, 'opened again')
      call check_that(output%rows == 8, 'rows kept')
      call output%close(error)
      call check_no_error(error, 'closed')
      call file%open(path, 'read', error)
      call file%read('/history/time', x, error)
      call check_that(size(x) == 8 .and. all(abs(x - [(0.25_dp*i, i=0, 7)]) <= 0.0_dp), 'history')
      call file%members('/snapshots', names, error)
      call check_that(size(names) == 3 .and. names(3) == '000006', 'snapshots kept')
      call file%read('/snapshots/000006/pressure', field, error)
      call check_close(maxval(abs(field - pressure_of(6))), 0.0_dp, 0.0_dp, 'field kept')
      call file%read_attribute('/', 'finished', finished, error)
      call check_that(finished == 0, 'no longer finished')
      call file%close(error)

      call write_result(path, 14, 0, .false., error)
      call checkpoint%open(path, error)
      call check_error(error, 'the run is complete: there is nothing to continue', 'complete')
      call write_result(path, 14, 0, .true., error)
      call check_no_error(error, 'gone on')
      call file%open(path, 'read', error)
      call file%read('/history/time', x, error)
      call check_that(size(x) == 14 .and. all(abs(x - [(0.25_dp*i, i=0, 13)]) <= 0.0_dp), 'rows')
      call file%members('/snapshots', names, error)
      call check_that(size(names) == 5, 'snapshots')
      call file%close(error)

      call output%reopen(path, 'another', 13, 0, error)
      call check_error(error, 'is not the result that test_result_file.checkpoint.h5 belongs to', 'other id')
      call output%reopen(path, id_of(path), 14, 0, error)
      call check_error(error, 'the history has 14 rows, the run would continue after row 14', 'far')
      call check_that(error%status == error_file, 'status')
   end subroutine run_goes_on

   !> The id of a result.
   function id_of(name) result(id)
      character(*), intent(in) :: name
      character(:), allocatable :: id
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error

      call file%open(name, 'read', error)
      call file%read_attribute('/', 'id', id, error)
      call check_that(len(id) == 32, 'an id of 32 digits')
      call file%close(error)
   end function id_of

   !> A result that cannot be created leaves no file. A field that does not exist is refused, and so is a
   !> second snapshot before the first one is finished.
   subroutine wrong_use_is_refused()
      type(result_file_type) :: output
      type(result_plan_type) :: plan
      type(grid_type) :: grid
      type(error_type), allocatable :: error
      integer :: rows

      plan%title = 't'
      plan%input = 'i'
      plan%settings = 's'
      allocate (plan%material%prony_g(0), plan%material%prony_tau(0))
      plan%rows = 1
      plan%snapshots = 1
      grid = new_grid(nx, ny, 1.0_dp, 1.0_dp, boundary_free)
      call output%create('no_such_folder/x.h5', grid, plan, error)
      call check_error(error, 'there is no folder "no_such_folder"', 'no folder')
      call output%create('.', grid, plan, error)
      call check_error(error, 'is a folder', 'folder')
      call output%create(path, grid, plan, error)
      call output%write_height_rows(1, pressure_of(0))
      call output%publish(error)
      call check_no_error(error, 'a free grid')
      call check_that(.not. file_exists(checkpoint_path(path)), 'old checkpoint removed')
      call output%begin_snapshot(0, 0.0_dp, 1)
      call output%start_field('pessure', rows)
      call output%start_field('gasp', rows)
      call output%end_snapshot(error)
      call check_error(error, 'snapshots have no field "pessure"', 'the first of two unknown fields')
      call check_that(output%last_snapshot() == -1, 'no snapshot with a fault')
      call output%close(error)
      call check_no_error(error, 'closed')

      call output%create(other_path, grid, plan, error)
      call output%write_height_rows(1, pressure_of(0))
      call output%publish(error)
      call output%begin_snapshot(0, 0.0_dp, 1, error)
      call output%begin_snapshot(1, 0.0_dp, 1, error)
      call check_error(error, '/snapshots/000000 is not finished yet', 'two at once')
      call output%close(error)
   end subroutine wrong_use_is_refused

end module test_result_file
