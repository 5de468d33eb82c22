!> Tests of checkpoints: the state comes back bit by bit, and only into the case it belongs to.
module test_checkpoint
   use check, only : begin_suite, check_close, check_error, check_no_error, check_that
   use checkpoint, only : checkpoint_path, checkpoint_reader_type, checkpoint_writer_type, &
      pair_type, remove_checkpoint
   use errors, only : error_file, error_input, error_type
   use file_system, only : file_exists
   use precision, only : dp
   implicit none
   private

   public :: run_checkpoint

   character(*), parameter :: path = 'test_checkpoint.h5'

contains

   subroutine run_checkpoint()
      call begin_suite('checkpoint')
      call remove_checkpoint(path)
      call state_comes_back()
      call other_cases_are_refused()
      call old_one_stays_until_commit()
      call remove_checkpoint(path)
      call check_that(.not. file_exists(checkpoint_path(path)), 'removed')
   end subroutine run_checkpoint

   !> The settings of a case.
   function settings_of(nx, law) result(settings)
      character(*), intent(in) :: nx, law
      type(pair_type) :: settings(2)

      settings(1)%name = 'grid: nx'
      settings(1)%value = nx
      settings(2)%name = 'friction: law'
      settings(2)%value = law
   end function settings_of

   !> Arrays of one to three dimensions, whole numbers and texts.
   subroutine state_comes_back()
      type(checkpoint_writer_type) :: writer
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      real(dp) :: field(5, 3), layers(5, 3, 2), vector(4), x(4), f(5, 3), g(5, 3, 2), time
      character(:), allocatable :: text
      integer :: step

      call random_number(field)
      call random_number(layers)
      call random_number(vector)
      call check_that(checkpoint_path('a/b.h5') == 'a/b.checkpoint.h5', 'name')
      call check_that(checkpoint_path('a/b.out') == 'a/b.out.checkpoint.h5', 'another name')
      call reader%open(path, error)
      call check_error(error, 'has no checkpoint to go on from', 'none')
      call check_that(error%status == error_file, 'status of none')

      call writer%start(path, settings_of('5', 'coulomb'), error)
      call check_no_error(error, 'start')
      call writer%put('pressure', field, 'Pa', error)
      call writer%put('arms', layers, 'm', error)
      call writer%put('road', vector, 'm', error)
      call writer%put('step', 12, error)
      call writer%put('time', 0.1_dp, error)
      call writer%put('phase', 'slide', error)
      call check_no_error(error, 'put')
      call writer%commit(error)
      call check_no_error(error, 'commit')
      call check_that(.not. file_exists(checkpoint_path(path)//'.new'), 'no temporary file left')

      call reader%open(path, error)
      call check_no_error(error, 'open')
      call reader%get('pressure', f, error)
      call check_no_error(error, 'get a field')
      call check_that(all(abs(f - field) <= 0.0_dp), 'field')
      call reader%get('arms', g, error)
      call check_that(all(abs(g - layers) <= 0.0_dp), 'layers')
      call reader%get('road', x, error)
      call check_that(all(abs(x - vector) <= 0.0_dp), 'vector')
      call reader%get('step', step, error)
      call check_that(step == 12, 'step')
      call reader%get('time', time, error)
      call check_close(time, 0.1_dp, 0.0_dp, 'time')
      call reader%get('phase', text, error)
      call check_that(text == 'slide', 'text')
      call reader%get('pressure', f(:4, :), error)
      call check_error(error, 'pressure: the extents are 5 3, the case needs 4 3', 'extents')
      call reader%get('gap', f, error)
      call check_error(error, 'there is no dataset "/gap"', 'missing piece')
      call reader%close()
   end subroutine state_comes_back

   !> Every setting that differs is named.
   subroutine other_cases_are_refused()
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      type(pair_type) :: more(3)

      call reader%open(path, error)
      call reader%compare(settings_of('5', 'coulomb'), error)
      call check_no_error(error, 'same case')
      call reader%compare(settings_of('6', 'none'), error)
      call check_error(error, 'grid: nx is 5 in the checkpoint and 6 in the case', 'first')
      call check_error(error, 'friction: law is coulomb in the checkpoint and none in the case', &
         'second')
      call check_that(error%status == error_input, 'status')
      more(:2) = settings_of('5', 'coulomb')
      more(3)%name = 'grid: ny'
      more(3)%value = '3'
      call reader%compare(more, error)
      call check_error(error, 'knows no "grid: ny"', 'unknown setting')
      call reader%close()
   end subroutine other_cases_are_refused

   !> A checkpoint that is not finished takes nothing away.
   subroutine old_one_stays_until_commit()
      type(checkpoint_writer_type) :: writer
      type(checkpoint_reader_type) :: reader
      type(error_type), allocatable :: error
      integer :: step

      call writer%start(path, settings_of('5', 'coulomb'), error)
      call writer%put('step', 13, error)
      call reader%open(path, error)
      call reader%get('step', step, error)
      call check_that(step == 12, 'old one')
      call reader%close()
      call writer%commit(error)
      call reader%open(path, error)
      call reader%get('step', step, error)
      call check_that(step == 13, 'new one')
      call reader%close()
      call writer%start('no_such_folder/x.h5', settings_of('5', 'coulomb'), error)
      call check_error(error, 'there is no folder', 'missing folder')
   end subroutine old_one_stays_until_commit

end module test_checkpoint
