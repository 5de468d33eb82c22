!> Decides whether a result may be written under a name, that is, whether an existing file may be replaced.
!>
!> A run may replace the result of an earlier run that has finished. Unless `overwrite` allows it, a run does
!> not replace anything that may still be needed: an unfinished run with rows, a checkpoint, or a file that
!> Asperity did not write. The files beside a result (see `result_names`) are replaced only if Asperity
!> wrote them.
module result_target
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : dp
   use file_kind, only : file_start, is_dangling_link, is_other_than_file
   use file_system, only : file_exists, folder_of, is_folder, name_of
   use hdf5_file, only : hdf5_file_type
   use result_names, only : checkpoint_path, side_file, side_files
   use text_tools, only : to_text
   use trial_process, only : trial_type
   implicit none
   private

   public :: check_place, check_replaced, damage_of_result

   integer, parameter :: patience = 60       !! longest time for the trial of a result, s
   integer, parameter :: longest_name = 255  !! NAME_MAX of Linux and macOS, bytes

   !> The kinds of files that may be there.
   integer, parameter :: is_result = 1, is_unfinished = 2, is_alien = 3

contains

   !> Refuse a place where there can be no result, and files beside it that Asperity did not write.
   subroutine check_place(path, error)
      character(*), intent(in) :: path          !! of the result
      type(error_type), allocatable, intent(out) :: error
      integer :: letters, n

      letters = maxval([(len(name_of(side_file(path, n))), n=1, side_files)])
      if (letters > longest_name) then
         call fail(error, error_file, path//': the name is too long: those of the files beside it have up to '// &
            to_text(letters)//' bytes, and at most '//to_text(longest_name)//' are allowed')
      else if (is_folder(path)) then
         call fail(error, error_file, path//': is a folder, not a file')
      else if (.not. is_folder(folder_of(path))) then
         call fail(error, error_file, path//': cannot be written: there is no folder "'// &
            folder_of(path)//'"')
      else if (is_other_than_file(path)) then
         call fail(error, error_file, path//': is not a regular file: it is not replaced by a result')
      else if (is_dangling_link(path)) then
         call fail(error, error_file, path//': is a link that leads to no file')
      end if
      do n = 1, side_files
         call check_side_file(path, side_file(path, n), n, error)
      end do
   end subroutine check_place

   !> Refuse a file beside the result that Asperity did not write.
   subroutine check_side_file(path, name, n, error)
      character(*), intent(in) :: path, name
      integer, intent(in) :: n                  !! number of the side file
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(:), allocatable :: start
      logical :: ours

      if (allocated(error)) return
      if (is_other_than_file(name) .or. is_dangling_link(name)) then
         call fail(error, error_file, name//': belongs to the result '//path// &
            ', and what is there is not a regular file')
         return
      end if
      start = file_start(name, 80)
      ours = start == ''
      select case (n)
      case (1)
         ! A killed run may have left any part of the beginning of a result.
         if (.not. ours) ours = index(start, char(0)) == 1 .or. kind_of(name) /= is_alien
         if (.not. ours) ours = index(start, char(137)//'HDF') == 1 .and. is_beginning(name)
      case (2)
         ours = ours .or. index(start, 'asperity checkpoint') == 1
      case (3)
         ! The block with the mark is written last, and is empty until then.
         ours = ours .or. index(start, 'asperity checkpoint') == 1 .or. index(start, char(0)) == 1
      case (4, 5)
         ours = ours .or. index(start, '<Xdmf') > 0
      case default
         ours = ours .or. index(start, 'asperity process') == 1
      end select
      if (.not. ours) call fail(error, error_file, name//': belongs to the result '//path// &
         ', and what is there was not written by Asperity: it is not replaced')
   end subroutine check_side_file

   !> Refuse to replace an unfinished run, a checkpoint, or a file that is not a result.
   subroutine check_replaced(path, error)
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(:), allocatable :: checkpoint, advice

      if (allocated(error)) return
      checkpoint = checkpoint_path(path)
      if (file_start(path, 1) /= '') then
         call damage_of_result(path, error)
         if (allocated(error)) then
            error%message = error%message//'; --overwrite replaces it'
            return
         end if
         select case (kind_of(path))
         case (is_alien)
            call fail(error, error_file, path//': is not a result of Asperity: --overwrite replaces '// &
               'it, or choose another --output')
            return
         case (is_unfinished)
            advice = ': --restart continues it from its last checkpoint, --overwrite replaces it'
            if (.not. file_exists(checkpoint)) advice = ', and there is no checkpoint: --overwrite starts again'
            call fail(error, error_file, path//': holds an unfinished run'//advice//', or choose another --output')
            return
         end select
      end if
      if (file_exists(checkpoint)) call fail(error, error_file, checkpoint// &
         ': there is a checkpoint of an unfinished run: --restart continues it, --overwrite '// &
         'removes it, or choose another --output')
   end subroutine check_replaced

   !> Does this HDF5 file have only groups of a result, or can it or its root group not even be read?
   !>
   !> HDF5 writes the parts of a new file in an order of its own. After a kill all groups may be there while
   !> no attribute can be read.
   function is_beginning(path) result(yes)
      character(*), intent(in) :: path
      logical :: yes
      character(*), parameter :: first_group = 'snapshots'
      character(*), parameter :: groups(7) = [character(10) :: first_group, 'checkpoint', 'grid', 'history', &
         'losses', 'material', 'surface']
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(256), allocatable :: names(:)
      integer :: i

      call file%open(path, 'read', error)
      yes = allocated(error)
      if (yes) return
      call file%members('/', names, error)
      if (allocated(error)) then
         yes = .true.
      else
         yes = (size(names) == 0 .or. any(names == first_group)) &
            .and. all([(any(groups == names(i)), i=1, size(names))])
      end if
      call file%close(error)
   end function is_beginning

   !> The kind of a file.
   function kind_of(path) result(kind)
      character(*), intent(in) :: path
      integer :: kind
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(:), allocatable :: program
      integer, allocatable :: extent(:)
      integer :: finished

      kind = is_alien
      call file%open(path, 'read', error)
      if (allocated(error)) return
      program = ''
      finished = 1
      if (file%has_attribute('/', 'program')) &
         call file%read_attribute('/', 'program', program, error)
      if (program == 'asperity' .and. file%has_attribute('/', 'finished')) then
         kind = is_result
         call file%read_attribute('/', 'finished', finished, error)
         if (finished == 0 .and. file%has_dataset('/history/step')) then
            call file%dataset_shape('/history/step', extent, error)
            if (size(extent) == 1) kind = merge(is_unfinished, is_result, any(extent > 0))
         end if
      end if
      call file%close(error)
   end function kind_of

   !> Read a result in a separate process. It is an error if that process crashes or does not end.
   subroutine damage_of_result(path, error)
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      type(trial_type) :: trial

      if (allocated(error)) return
      call trial%start(patience)
      if (trial%is_copy) then
         call read_result(path)
         call trial%leave()
      end if
      call trial%verdict(path, error)
   end subroutine damage_of_result

   !> Read everything that a restart reads. Errors are ignored, because only a crash
   !> matters here.
   subroutine read_result(path)
      character(*), intent(in) :: path
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      character(256), allocatable :: names(:), fields(:)
      character(:), allocatable :: text
      real(dp), allocatable :: column(:)
      integer, allocatable :: extent(:)
      integer :: i, j, number

      call file%open(path, 'read', error)
      if (allocated(error)) return
      call file%read_attribute('/', 'input', text, error)
      call file%read_attribute('/', 'settings', text, error)
      call file%read_attribute('/', 'finished', number, error)
      call file%read_attribute('/', 'outcome', text, error)
      call file%read_attribute('/', 'run_warnings', text, error)
      call file%members('/history', names, error)
      do i = 1, size(names)
         call file%read('/history/'//trim(names(i)), column, error)
         call file%read_attribute('/history/'//trim(names(i)), 'units', text, error)
      end do
      call file%members('/snapshots', names, error)
      do i = 1, size(names)
         call file%read_attribute('/snapshots/'//trim(names(i)), 'step', number, error)
         call file%members('/snapshots/'//trim(names(i)), fields, error)
         do j = 1, size(fields)
            call file%dataset_shape('/snapshots/'//trim(names(i))//'/'//trim(fields(j)), extent, error)
         end do
      end do
      call file%members('/', names, error)
      call file%close(error)
   end subroutine read_result

end module result_target
