!> Keeps FFTW's wisdom, the plans that it has found by measuring, in the user's cache folder between runs.
!>
!> Measured plans are faster, but two measurements may choose different plans, whose results differ in the last
!> bits. Therefore plans are measured only if their wisdom can be kept, so that a run, its restart and its
!> repetition use the same plans. Otherwise the planner's estimate is used, which never varies.
!> The files are written only if there are new plans; plans that other programs have added since are kept.
!> If several processes run a case, the first one measures and writes, and the others receive its plans.
!> A name in the folder that is no regular file, such as a link to a device, could be read for ever. It is left as it
!> is, and so is a file that is much too large; plans are then estimated, and `wisdom_warning` gives the reason.
!> The folder is $XDG_CACHE_HOME/asperity or $HOME/.cache/asperity.
module wisdom
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_f_pointer, c_int, c_null_char, c_ptr, c_size_t
   use asperity_fftw, only : fftw_estimate, fftw_export_wisdom_to_filename, fftw_export_wisdom_to_string, &
      fftw_import_wisdom_from_filename, fftw_import_wisdom_from_string, fftw_measure, fftw_wisdom_only, &
      fftwf_export_wisdom_to_filename, fftwf_export_wisdom_to_string, fftwf_import_wisdom_from_filename, &
      fftwf_import_wisdom_from_string
   use asperity_parallel, only : is_first_process, process_count, share
   use asperity_precision, only : int64
   use file_kind, only : is_other_than_file
   implicit none
   private

   public :: planning_flag, save_wisdom, share_wisdom, wisdom_warning

   integer, parameter, public :: from_memory = 1     !! only plans that are already known
   integer, parameter, public :: from_measuring = 2  !! measure if no plan is known

   integer(int64), parameter :: largest_file = 64000000_int64   !! bytes; a thousand plans take about 1e5

   logical :: started = .false.
   logical :: kept = .false.
   logical :: shared = .false.                       !! the other processes have the wisdom of this one, the first
   character(:), allocatable :: folder
   character(:), allocatable :: fault                !! of a file of wisdom; not allocated if there is none

   interface
      integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir

      integer(c_int) function c_rename(from, to) bind(c, name='rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      integer(c_int) function c_access(path, mode) bind(c, name='access')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_access

      integer(c_int) function c_getpid() bind(c, name='getpid')
         import :: c_int
      end function c_getpid

      integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen

      subroutine c_free(memory) bind(c, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free
   end interface

contains

   !> The flag for FFTW's planner. The first call also reads the kept wisdom. This must be called inside the
   !> critical section `fftw_planner`.
   integer(c_int) function planning_flag(attempt) result(flag)
      integer, intent(in) :: attempt           !! `from_memory` first; if that fails, `from_measuring`
      integer(c_int), parameter :: writable = 2

      if (.not. started .and. is_first_process()) then
         started = .true.
         call find_folder()
         kept = len(folder) > 0
         if (kept) kept = c_access(folder//c_null_char, writable) == 0
         if (kept) call read_wisdom(usable=kept)
      end if
      flag = fftw_estimate
      if (kept) flag = merge(ior(fftw_measure, fftw_wisdom_only), fftw_measure, attempt == from_memory)
   end function planning_flag

   !> Add the wisdom of the files to that of this process, unless one of them cannot be used.
   subroutine read_wisdom(usable)
      logical, intent(out) :: usable           !! the files may be read and replaced
      integer(c_int) :: status

      call check_file(folder//'/fftw')
      call check_file(folder//'/fftwf')
      usable = .not. allocated(fault)
      if (.not. usable) return
      status = fftw_import_wisdom_from_filename(folder//'/fftw'//c_null_char)
      status = fftwf_import_wisdom_from_filename(folder//'/fftwf'//c_null_char)
   end subroutine read_wisdom

   !> Keep the fault of a file of wisdom, if it has one. There may be no such file yet.
   subroutine check_file(path)
      character(*), intent(in) :: path
      integer(int64) :: bytes

      inquire (file=path, size=bytes)
      if (is_other_than_file(path)) then
         fault = path//': is no regular file'
      else if (bytes > largest_file) then
         fault = path//': is larger than 64 MB'
      end if
   end subroutine check_file

   !> A line about a file that cannot be used, or '' if there is none.
   function wisdom_warning() result(line)
      character(:), allocatable :: line

      line = ''
      if (allocated(fault)) line = fault//', and is ignored. FFTW''s plans are estimated, which may make the '// &
         'transforms slower; if it is removed, they are measured and kept'
   end function wisdom_warning

   !> Write the wisdom to the files. A failure is ignored, because only time is lost. This must be called inside
   !> the critical section `fftw_planner`, after plans from measuring.
   subroutine save_wisdom()
      integer(c_int) :: status
      character(16) :: process
      character(:), allocatable :: temporary
      logical :: usable

      shared = .false.
      if (.not. (kept .and. is_first_process())) return
      ! `kept` remains true if a file has become unusable since, because the plans of a run must be found in one way.
      call read_wisdom(usable)
      if (.not. usable) return
      write (process, '(i0)') c_getpid()
      temporary = folder//'/new'//trim(process)//c_null_char
      if (fftw_export_wisdom_to_filename(temporary) /= 0) then
         status = c_rename(temporary, folder//'/fftw'//c_null_char)
      end if
      if (fftwf_export_wisdom_to_filename(temporary) /= 0) then
         status = c_rename(temporary, folder//'/fftwf'//c_null_char)
      end if
   end subroutine save_wisdom

   !> Give all processes the wisdom of the first one, so that they use the same plans. Nothing is sent if it has found no
   !> plan since the last time, because the wisdom of many sizes takes megabytes. Collective.
   subroutine share_wisdom()
      character(:), allocatable :: text
      logical :: known                         !! to all processes
      integer(c_int) :: status

      if (process_count() == 1) return
      known = shared
      call share(known)
      if (known) return
      call share(kept)
      if (is_first_process()) text = taken_text(fftw_export_wisdom_to_string())
      call share(text)
      if (.not. is_first_process()) status = fftw_import_wisdom_from_string(text//c_null_char)
      if (is_first_process()) text = taken_text(fftwf_export_wisdom_to_string())
      call share(text)
      if (.not. is_first_process()) status = fftwf_import_wisdom_from_string(text//c_null_char)
      shared = .true.
   end subroutine share_wisdom

   !> A text of C, whose memory is then freed.
   function taken_text(memory) result(text)
      type(c_ptr), intent(in) :: memory
      character(:), allocatable :: text
      character(kind=c_char), pointer :: letters(:)
      integer :: i

      text = ''
      if (.not. c_associated(memory)) return
      call c_f_pointer(memory, letters, [c_strlen(memory)])
      text = repeat(' ', size(letters))
      do i = 1, size(letters)
         text(i:i) = letters(i)
      end do
      call c_free(memory)
   end function taken_text

   !> Find the name of the cache folder, and create the folder if it is missing.
   subroutine find_folder()
      integer(c_int) :: status
      character(:), allocatable :: parent

      parent = environment('XDG_CACHE_HOME')
      if (len(parent) == 0) then
         parent = environment('HOME')
         if (len(parent) > 0) parent = parent//'/.cache'
      end if
      if (len(parent) == 0) then
         folder = ''
         return
      end if
      folder = parent//'/asperity'
      status = c_mkdir(parent//c_null_char, int(o'755', c_int))
      status = c_mkdir(folder//c_null_char, int(o'755', c_int))
   end subroutine find_folder

   !> The value of an environment variable, or '' if it is not set.
   function environment(name) result(value)
      character(*), intent(in) :: name
      character(:), allocatable :: value
      integer :: length, status

      call get_environment_variable(name, length=length, status=status)
      if (status /= 0) length = 0
      allocate (character(length) :: value)
      if (length > 0) call get_environment_variable(name, value)
   end function environment

end module wisdom
