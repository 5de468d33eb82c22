!> HDF5 files; the only module that calls HDF5.
!>
!> A file under construction can be read, by another process or after a kill, at any moment. What
!> that rests on:
!>
!> * The file format is that of HDF5 1.8 (superblock 2), which carries no "open for writing" flag,
!>   and files are not locked.
!> * A group that is complete but for its name is *staged*: written without a link to it, flushed,
!>   and only then linked (`stage_group`, `publish_group`). The groups that receive such links keep
!>   them in one block that is made large enough at once (`create_group` with `expected`), so that
!>   the link appears with one write.
!> * A column that grows by a row (`create_column`, `append_value`) has the space for all its rows
!>   from the first row on: a row changes values, which go straight to the file, and the column's
!>   length, a single small block that is written by the next `flush`.
!> * The system may cut a write off where a page of memory (4096 bytes) ends. Small blocks start at
!>   multiples of 512 bytes, and so lie in one page. A group that is made with an alignment of 4096
!>   holds about 150 names in its first page; the larger block of more names can be torn, if a kill
!>   comes within the microsecond or so in which it is written.
!> * After a write has failed nothing more is written: neither a flush, nor closing the file, nor
!>   the end of the program sends out what HDF5 still holds in memory.
!>
!> Paths within a file start with '/'.
module hdf5_file
   use, intrinsic :: iso_c_binding, only : c_associated, c_bool, c_char, c_f_pointer, c_funloc, &
      c_funptr, c_int, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_size_t
   use hdf5, only : H5_INTEGER_KIND, h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, &
      h5aget_type_f, h5aopen_f, h5aread_f, h5awrite_f, H5D_FILL_TIME_NEVER_F, h5dclose_f, &
      h5dcreate_f, h5dget_space_f, h5dont_atexit_f, h5dopen_f, h5dread_f, h5dset_extent_f, &
      h5dvlen_reclaim_f, h5dwrite_f, h5eset_auto_f, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, &
      H5F_ACC_TRUNC_F, H5F_CLOSE_STRONG_F, H5F_LIBVER_V18_F, H5F_SCOPE_LOCAL_F, h5fclose_f, &
      h5fcreate_f, h5fflush_f, h5fget_filesize_f, h5fis_hdf5_f, h5fopen_f, h5gclose_f, &
      h5gcreate_anon_f, h5gcreate_f, h5gget_obj_info_idx_f, h5gn_members_f, H5I_DATASET_F, &
      h5iget_type_f, h5kind_to_type, h5lcreate_external_f, h5ldelete_f, h5lexists_f, h5oclose_f, &
      h5olink_f, h5oopen_f, h5open_f, H5P_DATASET_ACCESS_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F, &
      H5P_FILE_ACCESS_F, H5P_FILE_CREATE_F, H5P_GROUP_CREATE_F, H5P_LINK_CREATE_F, h5pclose_f, &
      h5pcreate_f, h5pset_alignment_f, h5pset_attr_phase_change_f, h5pset_chunk_cache_f, &
      h5pset_chunk_f, h5pset_create_inter_group_f, h5pset_deflate_f, h5pset_est_link_info_f, &
      h5pset_fclose_degree_f, h5pset_fill_time_f, h5pset_libver_bounds_f, &
      h5pset_link_phase_change_f, h5pset_meta_block_size_f, h5pset_shuffle_f, &
      h5pset_small_data_block_size_f, H5S_SCALAR_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F, &
      h5sclose_f, h5screate_f, h5screate_simple_f, h5sget_simple_extent_dims_f, &
      h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, H5T_CSET_UTF8_F, H5T_IEEE_F64LE, &
      H5T_NATIVE_DOUBLE, H5T_NATIVE_INTEGER, H5T_STD_I32LE, H5T_STD_I8LE, H5T_STR_NULLTERM_F, &
      H5T_STRING, h5tclose_f, h5tcopy_f, h5tget_size_f, h5tis_variable_str_f, h5tset_cset_f, &
      h5tset_strpad_f, hid_t, hsize_t, size_t
   use errors, only : error_file, error_input, error_type, fail
   use file_system, only : file_exists, folder_of, is_folder, lengthen_file, &
      let_size_limit_be_an_error
   use precision, only : dp, int64, int8
   implicit none
   private

   public :: hdf5_file_type, read_field

   integer, parameter :: name_length = 256            !! longest name of an object in a listing
   integer, parameter :: chunk_values = 131072        !! values in a compressed chunk, about 1 MiB
   integer, parameter :: column_chunk = 131072        !! rows of a column whose space is set aside
   integer, parameter, public :: most_expected = 4000 !! names a group has room for at once

   integer, parameter :: kind_real = 1
   integer, parameter :: kind_integer = 2
   integer, parameter :: kind_int8 = 3

   !> An open file.
   type :: hdf5_file_type
      private
      integer(hid_t) :: id = -1                       !! -1: closed
      integer(hid_t) :: staged = -1                   !! the group under construction, -1: none
      logical :: broken = .false.                     !! a write failed: nothing is written any more
      logical :: writable = .false.
      character(:), allocatable :: staged_path
      character(:), allocatable, public :: path       !! name of the file
   contains
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: flush => flush_file
      procedure :: is_open
      procedure :: create_group
      procedure :: stage_group
      procedure :: publish_group
      procedure :: has
      procedure :: has_dataset
      procedure :: has_link
      procedure :: has_attribute
      procedure :: members
      procedure :: remove => remove_object
      procedure :: link_external
      procedure :: create_column
      procedure :: append_value
      procedure :: append_values
      procedure :: dataset_shape
      procedure, private :: write_real_0, write_real_1, write_real_2, write_real_3, &
         write_integer_1, write_integer_2, write_int8_2, read_real_1, read_real_2, read_real_3, &
         read_integer_1, read_integer_2, read_int8_2, write_text, write_integer, write_real, &
         write_reals, read_text, read_integer, read_real, resolve, checked, not_broken, &
         open_object, store, load, put_attribute, get_attribute
      !> Write a new dataset.
      generic :: write => write_real_0, write_real_1, write_real_2, write_real_3, &
         write_integer_1, write_integer_2, write_int8_2
      !> Read a whole dataset.
      generic :: read => read_real_1, read_real_2, read_real_3, read_integer_1, read_integer_2, &
         read_int8_2
      !> Write an attribute, or a new value into one.
      generic :: write_attribute => write_text, write_integer, write_real, write_reals
      !> Read an attribute.
      generic :: read_attribute => read_text, read_integer, read_real
   end type hdf5_file_type

   !> An entry of HDF5's error stack.
   type, bind(c) :: stack_entry_type
      integer(c_int64_t) :: class_id
      integer(c_int64_t) :: major
      integer(c_int64_t) :: minor
      integer(c_int) :: line
      type(c_ptr) :: function_name
      type(c_ptr) :: file_name
      type(c_ptr) :: description
   end type stack_entry_type

   interface
      function c_set_file_locking(list, use_locking, ignore) bind(c, name='H5Pset_file_locking') &
         result(status)
         import :: c_bool, c_int, c_int64_t
         integer(c_int64_t), value :: list
         logical(c_bool), value :: use_locking, ignore
         integer(c_int) :: status
      end function c_set_file_locking

      function c_walk_errors(stack, direction, visit, context) bind(c, name='H5Ewalk2') &
         result(status)
         import :: c_funptr, c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: stack
         integer(c_int), value :: direction
         type(c_funptr), value :: visit
         type(c_ptr), value :: context
         integer(c_int) :: status
      end function c_walk_errors

      pure function c_strlen(text) bind(c, name='strlen') result(length)
         import :: c_ptr, c_size_t
         type(c_ptr), value, intent(in) :: text
         integer(c_size_t) :: length
      end function c_strlen
   end interface

   logical :: started = .false.                       !! HDF5 is initialised
   character(:), allocatable :: reason                !! what HDF5 said last

contains

   ! --- files --------------------------------------------------------------------------------

   !> Open a file.
   subroutine open_file(self, path, mode, error, alignment)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: mode      !! 'read', 'create' (replaces a file) or 'append'
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: alignment  !! of what is added, bytes; default 512
      integer(hid_t) :: access_list, creation
      integer(hsize_t) :: step
      integer :: status, ignored
      logical :: right_kind

      self%id = -1
      self%staged = -1
      self%broken = .false.
      self%writable = mode /= 'read'
      self%path = trim(path)
      call start(error)
      if (allocated(error)) return
      if (is_folder(self%path)) then
         call fail(error, error_file, self%path//': is a folder, not a file')
         return
      end if
      if (mode == 'create') then
         if (.not. is_folder(folder_of(self%path))) then
            call fail(error, error_file, self%path//': cannot be written: there is no folder "'// &
               folder_of(self%path)//'"')
            return
         end if
      else
         if (.not. file_exists(self%path)) then
            call fail(error, error_file, self%path//': there is no such file')
            return
         end if
      end if

      call h5pcreate_f(H5P_FILE_ACCESS_F, access_list, status)
      if (status >= 0) call h5pset_libver_bounds_f(access_list, H5F_LIBVER_V18_F, &
         H5F_LIBVER_V18_F, status)
      if (status >= 0) call h5pset_fclose_degree_f(access_list, H5F_CLOSE_STRONG_F, status)
      ! Space is taken as it is needed: space set aside would be given back by cutting the file,
      ! which HDF5 does before it notes the new length.
      if (status >= 0) call h5pset_meta_block_size_f(access_list, 0_hsize_t, status)
      if (status >= 0) call h5pset_small_data_block_size_f(access_list, 0_hsize_t, status)
      step = 512
      if (present(alignment)) step = alignment
      if (status >= 0) call h5pset_alignment_f(access_list, 128_hsize_t, step, status)
      if (status >= 0) status = c_set_file_locking(access_list, .false._c_bool, .true._c_bool)
      if (status >= 0) then
         select case (mode)
         case ('create')
            call h5pcreate_f(H5P_FILE_CREATE_F, creation, status)
            if (status >= 0) call set_one_block(creation, 24, 24, status)
            if (status >= 0) call h5fcreate_f(self%path, H5F_ACC_TRUNC_F, self%id, status, &
               creation_prp=creation, access_prp=access_list)
            call h5pclose_f(creation, ignored)
         case ('append')
            call h5fopen_f(self%path, H5F_ACC_RDWR_F, self%id, status, access_list)
         case default
            call h5fopen_f(self%path, H5F_ACC_RDONLY_F, self%id, status, access_list)
         end select
      end if
      if (status < 0) then
         call note_reason()
         self%id = -1
         right_kind = .true.
         if (mode /= 'create' .and. index(reason, 'ermission') == 0) then
            call h5fis_hdf5_f(self%path, right_kind, ignored)
            if (ignored < 0) right_kind = .true.
         end if
         if (.not. right_kind) then
            call fail(error, error_file, self%path//': is not an HDF5 file')
         else if (mode == 'read') then
            call fail(error, error_file, self%path//': cannot be read: '//reason)
         else
            call fail(error, error_file, self%path//': cannot be written: '//reason)
         end if
      end if
      call h5pclose_f(access_list, ignored)
   end subroutine open_file

   !> Close a file. After a failed write it is left as the last flush made it.
   subroutine close_file(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      if (self%id >= 0 .and. .not. self%broken) then
         if (self%staged >= 0) call h5gclose_f(self%staged, status)
         if (self%writable) call self%flush(error)
         if (allocated(error)) return
         call h5fclose_f(self%id, status)
         call self%checked(status, 'closing the file failed', '', error)
      end if
      self%id = -1
      self%staged = -1
   end subroutine close_file

   !> Is the file open?
   pure logical function is_open(self)
      class(hdf5_file_type), intent(in) :: self

      is_open = self%id >= 0
   end function is_open

   !> Hand everything to the operating system: from here on a kill loses nothing of it.
   subroutine flush_file(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer(hsize_t) :: length
      integer :: status

      call self%not_broken('', error)
      if (allocated(error)) return
      ! HDF5 notes the new length before it has made the file so long: a reader in between would
      ! find the file too short. So the file gets its length first.
      call h5fget_filesize_f(self%id, length, status)
      call self%checked(status, 'writing failed', '', error)
      if (allocated(error)) return
      call lengthen_file(self%path, int(length, int64), error)
      if (allocated(error)) then
         self%broken = .true.
         return
      end if
      call h5fflush_f(self%id, H5F_SCOPE_LOCAL_F, status)
      call self%checked(status, 'writing failed', '', error)
   end subroutine flush_file

   !> Start HDF5: no messages of its own, no writing when the program ends.
   subroutine start(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      if (started) return
      call let_size_limit_be_an_error()
      call h5dont_atexit_f(status)
      call h5open_f(status)
      if (status >= 0) call h5eset_auto_f(0, status)
      started = status >= 0
      if (.not. started) call fail(error, error_file, 'HDF5 cannot be initialised')
   end subroutine start

   ! --- errors -------------------------------------------------------------------------------

   !> Turn a negative status into an error; a failed write stops all writing.
   subroutine checked(self, status, what, path, error)
      class(hdf5_file_type), intent(inout) :: self
      integer, intent(in) :: status
      character(*), intent(in) :: what      !! what failed
      character(*), intent(in) :: path      !! object within the file; '': the file
      type(error_type), allocatable, intent(inout) :: error

      if (status >= 0) return
      call note_reason()
      call fail(error, error_file, self%path//': '//prefix(path)//what//': '//reason)
      self%broken = self%writable
   end subroutine checked

   !> An error once a write to this file has failed.
   subroutine not_broken(self, path, error)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path      !! object that is to be written
      type(error_type), allocatable, intent(out) :: error

      if (self%broken) call fail(error, error_file, self%path//': '//prefix(path)// &
         'not written: an earlier write to this file failed')
   end subroutine not_broken

   !> An object's name at the start of a message.
   pure function prefix(path) result(text)
      character(*), intent(in) :: path
      character(:), allocatable :: text

      text = ''
      if (path /= '') text = trim(path)//': '
   end function prefix

   !> Keep what HDF5 says about its last failure, the system's own words where it has them.
   subroutine note_reason()
      character(*), parameter :: mark = 'error message = '''
      integer(c_int) :: status
      integer :: first, length

      reason = ''
      status = c_walk_errors(0_c_int64_t, 0_c_int, c_funloc(keep_description), c_null_ptr)
      if (status < 0 .or. reason == '') reason = 'HDF5 gives no reason'
      first = index(reason, mark)
      if (first > 0) then
         first = first + len(mark)
         length = index(reason(first:), '''') - 1
         if (length > 0) reason = reason(first:first + length - 1)
      end if
   end subroutine note_reason

   !> Keep the innermost description of the error stack.
   function keep_description(n, entry_ptr, context) bind(c) result(status)
      integer(c_int), value :: n
      type(c_ptr), value :: entry_ptr
      type(c_ptr), value :: context
      integer(c_int) :: status
      type(stack_entry_type), pointer :: entry

      status = 0
      if (c_associated(context) .or. n /= 0) return
      call c_f_pointer(entry_ptr, entry)
      if (c_associated(entry%description)) reason = text_of(entry%description)
   end function keep_description

   !> A C string as a Fortran one.
   function text_of(address) result(text)
      type(c_ptr), intent(in) :: address
      character(:), allocatable :: text
      character(kind=c_char), pointer :: letters(:)
      integer :: i, length

      length = int(c_strlen(address))
      call c_f_pointer(address, letters, [length])
      allocate (character(length) :: text)
      do i = 1, length
         text(i:i) = letters(i)
      end do
   end function text_of

   ! --- groups and names ---------------------------------------------------------------------

   !> Where a path starts: in the file, or in the group under construction.
   subroutine resolve(self, path, location, name)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: location
      character(:), allocatable, intent(out) :: name
      integer :: length

      location = self%id
      name = trim(path)
      if (name == '') name = '/'
      if (self%staged < 0) return
      length = len(self%staged_path)
      if (path == self%staged_path) then
         location = self%staged
         name = '.'
      else if (index(path, self%staged_path//'/') == 1) then
         location = self%staged
         name = trim(path(length + 2:))
      end if
   end subroutine resolve

   !> Make a group, and those above it where they are missing.
   subroutine create_group(self, path, error, expected)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: expected  !! names it will hold, each of up to 12 letters
      character(:), allocatable :: name
      integer(hid_t) :: location, group, links, creation
      integer :: status, ignored, count

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%resolve(path, location, name)
      count = 8
      if (present(expected)) count = max(8, min(expected, most_expected))
      call h5pcreate_f(H5P_LINK_CREATE_F, links, status)
      if (status >= 0) call h5pset_create_inter_group_f(links, 1, status)
      if (status >= 0) call h5pcreate_f(H5P_GROUP_CREATE_F, creation, status)
      if (status >= 0) call set_one_block(creation, count, 12, status)
      if (status >= 0) call h5gcreate_f(location, name, group, status, lcpl_id=links, &
         gcpl_id=creation)
      call self%checked(status, 'the group cannot be made', path, error)
      if (allocated(error)) return
      call h5gclose_f(group, ignored)
      call h5pclose_f(links, ignored)
      call h5pclose_f(creation, ignored)
   end subroutine create_group

   !> Let a group keep its names and attributes in one block, made large enough at once.
   subroutine set_one_block(creation, count, length, status)
      integer(hid_t), intent(in) :: creation  !! property list of the group
      integer, intent(in) :: count            !! number of names expected
      integer, intent(in) :: length           !! letters of a name
      integer, intent(out) :: status

      call h5pset_link_phase_change_f(creation, 65535, 0, status)
      if (status >= 0) call h5pset_est_link_info_f(creation, count, length, status)
      if (status >= 0) call h5pset_attr_phase_change_f(creation, 65535, 0, status)
   end subroutine set_one_block

   !> Start a group that readers do not see before `publish_group`; the group above it exists.
   !> Everything written below its path goes into it.
   subroutine stage_group(self, path, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      if (self%staged >= 0) then
         call fail(error, error_file, self%path//': '//self%staged_path//' is not finished yet')
         return
      end if
      call self%not_broken(path, error)
      if (allocated(error)) return
      call h5gcreate_anon_f(self%id, self%staged, status)
      if (status < 0) self%staged = -1
      call self%checked(status, 'the group cannot be made', path, error)
      self%staged_path = trim(path)
   end subroutine stage_group

   !> Let the group under construction appear, in place of one of the same name if there is one.
   subroutine publish_group(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      logical :: exists

      call self%flush(error)
      if (allocated(error)) return
      call h5lexists_f(self%id, self%staged_path, exists, status)
      if (status >= 0 .and. exists) call h5ldelete_f(self%id, self%staged_path, status)
      if (status >= 0) call h5olink_f(self%staged, self%id, self%staged_path, status)
      if (status >= 0) call h5gclose_f(self%staged, status)
      call self%checked(status, 'the group cannot be named', self%staged_path, error)
      if (allocated(error)) return
      self%staged = -1
      call self%flush(error)
   end subroutine publish_group

   !> Is there an object of this name? A link that leads nowhere does not count.
   function has(self, path) result(exists)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      logical :: exists
      character(:), allocatable :: name
      integer(hid_t) :: location, object
      integer :: status, ignored, slash, last

      call self%resolve(path, location, name)
      exists = .true.
      if (name == '/' .or. name == '.') return
      last = 1
      do while (last < len(name))
         slash = index(name(last + 1:), '/')
         if (slash == 0) then
            last = len(name) + 1
         else
            last = last + slash
         end if
         call h5lexists_f(location, name(:last - 1), exists, status)
         if (status < 0 .or. .not. exists) then
            exists = .false.
            return
         end if
         call h5oopen_f(location, name(:last - 1), object, status)
         exists = status >= 0
         if (.not. exists) return
         call h5oclose_f(object, ignored)
      end do
   end function has

   !> Is there a link of this name in the file's root, wherever it leads?
   function has_link(self, path) result(exists)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path      !! '/name'
      logical :: exists
      integer :: status

      call h5lexists_f(self%id, path, exists, status)
      exists = exists .and. status >= 0
   end function has_link

   !> Is there a dataset of this name?
   function has_dataset(self, path) result(exists)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      logical :: exists
      character(:), allocatable :: name
      integer(hid_t) :: location, object
      integer :: status, kind

      exists = self%has(path)
      if (.not. exists) return
      call self%resolve(path, location, name)
      call h5oopen_f(location, name, object, status)
      exists = status >= 0
      if (.not. exists) return
      call h5iget_type_f(object, kind, status)
      exists = status >= 0 .and. kind == H5I_DATASET_F
      call h5oclose_f(object, status)
   end function has_dataset

   !> Has the object this attribute?
   function has_attribute(self, path, name) result(exists)
      class(hdf5_file_type), intent(in) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      logical :: exists
      character(:), allocatable :: local
      integer(hid_t) :: location, object
      integer :: status

      exists = self%has(path)
      if (.not. exists) return
      call self%resolve(path, location, local)
      call h5oopen_f(location, local, object, status)
      exists = status >= 0
      if (.not. exists) return
      call h5aexists_f(object, trim(name), exists, status)
      call h5oclose_f(object, status)
   end function has_attribute

   !> The names in a group, in the order of the alphabet.
   subroutine members(self, path, names, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(name_length), allocatable, intent(out) :: names(:)
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: local
      integer(hid_t) :: location
      integer :: status, count, i, kind

      allocate (names(0))
      call self%resolve(path, location, local)
      count = 0
      call h5gn_members_f(location, local, count, status)
      if (status >= 0) then
         deallocate (names)
         allocate (names(count))
         do i = 1, count
            call h5gget_obj_info_idx_f(location, local, i - 1, names(i), kind, status)
            if (status < 0) exit
         end do
      end if
      call self%checked(status, 'the group cannot be listed', path, error)
   end subroutine members

   !> Remove an object.
   subroutine remove_object(self, path, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%resolve(path, location, name)
      call h5ldelete_f(location, name, status)
      call self%checked(status, 'the object cannot be removed', path, error)
   end subroutine remove_object

   !> Let a name stand for an object of another file; the file may be missing.
   subroutine link_external(self, path, file, object, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: file      !! the other file, seen from this file's folder
      character(*), intent(in) :: object    !! path within the other file
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      call self%not_broken(path, error)
      if (allocated(error)) return
      call h5lcreate_external_f(file, object, self%id, path, status)
      call self%checked(status, 'the link cannot be made', path, error)
   end subroutine link_external

   !> Open the object of a path.
   subroutine open_object(self, path, object, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: object
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location
      integer :: status

      call self%resolve(path, location, name)
      if (.not. self%has(path)) then
         call fail(error, error_file, self%path//': there is no '//trim(path))
         return
      end if
      call h5oopen_f(location, name, object, status)
      call self%checked(status, 'cannot be opened', path, error)
   end subroutine open_object

   ! --- attributes ---------------------------------------------------------------------------

   !> Write an attribute from memory; one of the same name gets the new value in place.
   subroutine put_attribute(self, path, name, kind, count, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind           !! 0: text
      integer, intent(in) :: count          !! number of values; 0: one value that is no array
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object, space, attribute, file_type, memory_type
      integer :: status, ignored
      logical :: exists

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%open_object(path, object, error)
      if (allocated(error)) return
      call get_types(kind, file_type, memory_type)
      call h5aexists_f(object, name, exists, status)
      if (status >= 0 .and. exists) then
         call h5aopen_f(object, name, attribute, status)
      else if (status >= 0) then
         if (count == 0) then
            call h5screate_f(H5S_SCALAR_F, space, status)
         else
            call h5screate_simple_f(1, [int(count, hsize_t)], space, status)
         end if
         call h5acreate_f(object, name, file_type, space, attribute, status)
         call h5sclose_f(space, ignored)
      end if
      if (status >= 0) call h5awrite_f(attribute, memory_type, buffer, status)
      call self%checked(status, 'the attribute "'//name//'" cannot be written', path, error)
      if (allocated(error)) return
      call h5aclose_f(attribute, ignored)
      call h5oclose_f(object, ignored)
      if (kind == 0) call h5tclose_f(file_type, ignored)
   end subroutine put_attribute

   !> Write a text attribute (UTF-8).
   subroutine write_text(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char), allocatable, target :: letters(:)
      type(c_ptr), target :: address(1)
      integer :: i

      allocate (letters(len(value) + 1))
      do i = 1, len(value)
         letters(i) = value(i:i)
      end do
      letters(len(value) + 1) = c_null_char
      address(1) = c_loc(letters)
      call self%put_attribute(path, name, 0, 0, c_loc(address), error)
   end subroutine write_text

   !> Write a whole number as an attribute.
   subroutine write_integer(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      integer, target :: buffer(1)

      buffer(1) = value
      call self%put_attribute(path, name, kind_integer, 0, c_loc(buffer), error)
   end subroutine write_integer

   !> Write a real number as an attribute.
   subroutine write_real(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)

      buffer(1) = value
      call self%put_attribute(path, name, kind_real, 0, c_loc(buffer), error)
   end subroutine write_real

   !> Write real numbers as an attribute.
   subroutine write_reals(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(in) :: value(:)      !! at least one
      type(error_type), allocatable, intent(out) :: error
      real(dp), allocatable, target :: buffer(:)

      allocate (buffer(size(value)), source=value)
      call self%put_attribute(path, name, kind_real, size(value), c_loc(buffer), error)
   end subroutine write_reals

   !> Read the single number of an attribute into memory.
   subroutine get_attribute(self, path, name, kind, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object, attribute, file_type, memory_type
      integer :: status, ignored
      type(c_ptr) :: target_address

      if (.not. self%has_attribute(path, name)) then
         call fail(error, error_file, self%path//': '//path//' has no attribute "'//name//'"')
         return
      end if
      call self%open_object(path, object, error)
      if (allocated(error)) return
      call get_types(kind, file_type, memory_type)
      call h5aopen_f(object, name, attribute, status)
      target_address = buffer
      if (status >= 0) call h5aread_f(attribute, memory_type, target_address, status)
      call self%checked(status, 'the attribute "'//name//'" cannot be read', path, error)
      if (allocated(error)) return
      call h5aclose_f(attribute, ignored)
      call h5oclose_f(object, ignored)
   end subroutine get_attribute

   !> Read a whole number.
   subroutine read_integer(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      integer, target :: buffer(1)

      buffer = 0
      call self%get_attribute(path, name, kind_integer, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_integer

   !> Read a real number.
   subroutine read_real(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      real(dp), target :: buffer(1)

      buffer = 0.0_dp
      call self%get_attribute(path, name, kind_real, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_real

   !> Read a text of fixed or variable length.
   subroutine read_text(self, path, name, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: object, attribute, text_type, space
      integer(size_t) :: length
      integer :: status, ignored, i, used
      logical :: variable
      type(c_ptr), target :: address(1)
      type(c_ptr) :: buffer
      character(kind=c_char), allocatable, target :: letters(:)

      value = ''
      if (.not. self%has_attribute(path, name)) then
         call fail(error, error_file, self%path//': '//path//' has no attribute "'//name//'"')
         return
      end if
      call self%open_object(path, object, error)
      if (allocated(error)) return
      call h5aopen_f(object, name, attribute, status)
      if (status >= 0) call h5aget_type_f(attribute, text_type, status)
      if (status >= 0) call h5tis_variable_str_f(text_type, variable, status)
      if (status >= 0 .and. variable) then
         address(1) = c_null_ptr
         buffer = c_loc(address)
         call h5aread_f(attribute, text_type, buffer, status)
         if (status >= 0) then
            if (c_associated(address(1))) value = text_of(address(1))
            call h5aget_space_f(attribute, space, status)
            call h5dvlen_reclaim_f(text_type, space, H5P_DEFAULT_F, buffer, status)
            call h5sclose_f(space, ignored)
         end if
      else if (status >= 0) then
         call h5tget_size_f(text_type, length, status)
         allocate (letters(length))
         buffer = c_loc(letters)
         if (status >= 0) call h5aread_f(attribute, text_type, buffer, status)
         if (status >= 0) then
            used = int(length)
            do i = 1, int(length)
               if (letters(i) == c_null_char) then
                  used = i - 1
                  exit
               end if
            end do
            value = repeat(' ', used)
            do i = 1, used
               value(i:i) = letters(i)
            end do
         end if
      end if
      call self%checked(status, 'the attribute "'//name//'" cannot be read', path, error)
      if (allocated(error)) return
      call h5tclose_f(text_type, ignored)
      call h5aclose_f(attribute, ignored)
      call h5oclose_f(object, ignored)
   end subroutine read_text

   !> The types of a kind of value in the file and in memory.
   subroutine get_types(kind, file_type, memory_type)
      integer, intent(in) :: kind
      integer(hid_t), intent(out) :: file_type
      integer(hid_t), intent(out) :: memory_type
      integer :: ignored

      select case (kind)
      case (kind_real)
         file_type = H5T_IEEE_F64LE
         memory_type = H5T_NATIVE_DOUBLE
      case (kind_integer)
         file_type = H5T_STD_I32LE
         memory_type = H5T_NATIVE_INTEGER
      case (kind_int8)
         file_type = H5T_STD_I8LE
         memory_type = h5kind_to_type(int8, H5_INTEGER_KIND)
      case default
         call h5tcopy_f(H5T_STRING, file_type, ignored)
         call h5tset_strpad_f(file_type, H5T_STR_NULLTERM_F, ignored)
         call h5tset_cset_f(file_type, H5T_CSET_UTF8_F, ignored)
         memory_type = file_type
      end select
   end subroutine get_types

   ! --- datasets -----------------------------------------------------------------------------

   !> Write a new dataset from memory.
   subroutine store(self, path, extent, kind, buffer, units, long_name, compression, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: extent(:)      !! in Fortran's order
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      integer, intent(in), optional :: compression
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location, space, creation, links, dataset, file_type, memory_type
      integer(hsize_t) :: dims(size(extent)), chunk(size(extent))
      integer :: status, ignored, level

      call self%not_broken(path, error)
      if (allocated(error)) return
      level = 0
      if (present(compression)) level = max(0, min(compression, 9))
      if (size(extent) < 2 .or. any(extent == 0)) level = 0
      dims = extent
      call self%resolve(path, location, name)
      call get_types(kind, file_type, memory_type)
      call h5pcreate_f(H5P_LINK_CREATE_F, links, status)
      if (status >= 0) call h5pset_create_inter_group_f(links, 1, status)
      if (status >= 0) call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      if (status >= 0) call h5pset_fill_time_f(creation, H5D_FILL_TIME_NEVER_F, status)
      if (status >= 0 .and. level > 0) then
         chunk = 1
         chunk(1) = dims(1)
         chunk(2) = max(1_hsize_t, min(dims(2), chunk_values/dims(1)))
         call h5pset_chunk_f(creation, size(extent), chunk, status)
         if (status >= 0) call h5pset_shuffle_f(creation, status)
         if (status >= 0) call h5pset_deflate_f(creation, level, status)
      end if
      if (size(extent) == 0) then
         if (status >= 0) call h5screate_f(H5S_SCALAR_F, space, status)
      else
         if (status >= 0) call h5screate_simple_f(size(extent), dims, space, status)
      end if
      if (status >= 0) call h5dcreate_f(location, name, file_type, space, dataset, status, &
         dcpl_id=creation, lcpl_id=links)
      if (status >= 0 .and. all(extent > 0)) call h5dwrite_f(dataset, memory_type, buffer, status)
      ! Compressed data leave the cache here, so that a full disk is noticed here.
      if (status >= 0) call h5dclose_f(dataset, status)
      call self%checked(status, 'the dataset cannot be written', path, error)
      if (allocated(error)) return
      call h5sclose_f(space, ignored)
      call h5pclose_f(creation, ignored)
      call h5pclose_f(links, ignored)
      call self%write_attribute(path, 'units', units, error)
      if (allocated(error)) return
      call self%write_attribute(path, 'long_name', long_name, error)
   end subroutine store

   !> Write a single real.
   subroutine write_real_0(self, path, value, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(0)
      real(dp), target :: buffer(1)

      buffer(1) = value
      call self%store(path, extent, kind_real, c_loc(buffer), units, long_name, error=error)
   end subroutine write_real_0

   !> Write a vector of reals.
   subroutine write_real_1(self, path, values, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error

      call self%store(path, shape(values), kind_real, address_1(values), units, long_name, &
         error=error)
   end subroutine write_real_1

   !> Write a field of reals; in the file its shape is (ny, nx).
   subroutine write_real_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none (default) to 9 smallest

      call self%store(path, shape(values), kind_real, c_loc(values), units, long_name, &
         compression, error)
   end subroutine write_real_2

   !> Write several fields of reals; in the file their shape is (n, ny, nx).
   subroutine write_real_3(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous, target :: values(:, :, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none (default) to 9 smallest

      call self%store(path, shape(values), kind_real, c_loc(values), units, long_name, &
         compression, error)
   end subroutine write_real_3

   !> Write a vector of whole numbers.
   subroutine write_integer_1(self, path, values, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in), contiguous, target :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error

      call self%store(path, shape(values), kind_integer, c_loc(values), units, long_name, &
         error=error)
   end subroutine write_integer_1

   !> Write a field of whole numbers.
   subroutine write_integer_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none (default) to 9 smallest

      call self%store(path, shape(values), kind_integer, c_loc(values), units, long_name, &
         compression, error)
   end subroutine write_integer_2

   !> Write a field of bytes.
   subroutine write_int8_2(self, path, values, units, long_name, error, compression)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(int8), intent(in), contiguous, target :: values(:, :)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: compression  !! 0 none (default) to 9 smallest

      call self%store(path, shape(values), kind_int8, c_loc(values), units, long_name, &
         compression, error)
   end subroutine write_int8_2

   !> Address of a vector, of an empty one too.
   function address_1(values) result(address)
      real(dp), intent(in), contiguous, target :: values(:)
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
   end function address_1

   !> Shape of a dataset in Fortran's order; of size 0 for a single value.
   subroutine dataset_shape(self, path, extent, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, allocatable, intent(out) :: extent(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space
      integer(hsize_t) :: dims(32), most(32)
      integer :: status, rank, ignored

      allocate (extent(0))
      if (.not. self%has_dataset(path)) then
         call fail(error, error_file, self%path//': there is no dataset "'//trim(path)// &
            '"; there are: '//listing(self))
         return
      end if
      call self%open_object(path, dataset, error)
      if (allocated(error)) return
      call h5dget_space_f(dataset, space, status)
      if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (status >= 0 .and. rank > 0) then
         call h5sget_simple_extent_dims_f(space, dims(:rank), most(:rank), status)
         if (status >= 0) extent = int(dims(:rank))
      end if
      call self%checked(status, 'the dataset cannot be read', path, error)
      if (allocated(error)) return
      call h5sclose_f(space, ignored)
      call h5oclose_f(dataset, ignored)
   end subroutine dataset_shape

   !> Find a dataset's shape and see that it has the wanted number of dimensions.
   subroutine wanted_shape(self, path, rank, extent, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: rank
      integer, intent(out) :: extent(rank)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: found(:)
      character(80) :: text

      extent = 0
      call self%dataset_shape(path, found, error)
      if (allocated(error)) return
      if (size(found) /= rank) then
         write (text, '("has ", i0, " dimensions, not ", i0)') size(found), rank
         call fail(error, error_input, self%path//': '//trim(path)//': '//trim(text))
         return
      end if
      extent = found
   end subroutine wanted_shape

   !> Read a whole dataset into memory.
   subroutine load(self, path, kind, buffer, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, file_type, memory_type
      integer :: status, ignored
      type(c_ptr) :: target_address

      call self%open_object(path, dataset, error)
      if (allocated(error)) return
      call get_types(kind, file_type, memory_type)
      target_address = buffer
      call h5dread_f(dataset, memory_type, target_address, status)
      call self%checked(status, 'the dataset cannot be read', path, error)
      call h5oclose_f(dataset, ignored)
   end subroutine load

   !> Read a vector of reals.
   subroutine read_real_1(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(1)

      call wanted_shape(self, path, 1, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      if (size(values) > 0) call self%load(path, kind_real, c_loc(values), error)
   end subroutine read_real_1

   !> Read a field of reals, numbers of any other kind are converted.
   subroutine read_real_2(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(2)

      call wanted_shape(self, path, 2, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)))
      if (size(values) > 0) call self%load(path, kind_real, c_loc(values), error)
   end subroutine read_real_2

   !> Read several fields of reals.
   subroutine read_real_3(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), allocatable, intent(out), target :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(3)

      call wanted_shape(self, path, 3, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2), extent(3)))
      if (size(values) > 0) call self%load(path, kind_real, c_loc(values), error)
   end subroutine read_real_3

   !> Read a vector of whole numbers.
   subroutine read_integer_1(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, allocatable, intent(out), target :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(1)

      call wanted_shape(self, path, 1, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      if (size(values) > 0) call self%load(path, kind_integer, c_loc(values), error)
   end subroutine read_integer_1

   !> Read a field of whole numbers.
   subroutine read_integer_2(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, allocatable, intent(out), target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(2)

      call wanted_shape(self, path, 2, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)))
      if (size(values) > 0) call self%load(path, kind_integer, c_loc(values), error)
   end subroutine read_integer_2

   !> Read a field of bytes.
   subroutine read_int8_2(self, path, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(int8), allocatable, intent(out), target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: extent(2)

      call wanted_shape(self, path, 2, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)))
      if (size(values) > 0) call self%load(path, kind_int8, c_loc(values), error)
   end subroutine read_int8_2

   !> Read one field of a file, such as a height map.
   subroutine read_field(path, dataset, field, error)
      character(*), intent(in) :: path      !! name of the file
      character(*), intent(in) :: dataset   !! '': 'surface/height', or else 'surface'
      real(dp), allocatable, intent(out) :: field(:, :)  !! [nx, ny] from a dataset (ny, nx)
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: closing
      character(:), allocatable :: name

      call file%open(path, 'read', error)
      if (allocated(error)) return
      name = trim(dataset)
      if (name == '') then
         name = 'surface/height'
         if (.not. file%has_dataset(name)) then
            if (file%has_dataset('surface')) name = 'surface'
         end if
      end if
      call file%read(name, field, error)
      call file%close(closing)
   end subroutine read_field

   !> The datasets of a file, for messages.
   function listing(self) result(text)
      class(hdf5_file_type), intent(inout) :: self
      character(:), allocatable :: text
      character(name_length), allocatable :: top(:), inner(:)
      type(error_type), allocatable :: error
      integer :: i, j, count

      text = ''
      count = 0
      call self%members('/', top, error)
      do i = 1, size(top)
         if (self%has_dataset('/'//trim(top(i)))) then
            call add(trim(top(i)))
         else if (self%has('/'//trim(top(i)))) then
            call self%members('/'//trim(top(i)), inner, error)
            do j = 1, size(inner)
               call add(trim(top(i))//'/'//trim(inner(j)))
            end do
         end if
      end do
      if (text == '') text = 'none'

   contains

      subroutine add(name)
         character(*), intent(in) :: name

         count = count + 1
         if (count > 20) then
            if (count == 21) text = text//', ...'
         else if (text == '') then
            text = name
         else
            text = text//', '//name
         end if
      end subroutine add

   end function listing

   ! --- columns ------------------------------------------------------------------------------

   !> Make an empty column that grows row by row.
   subroutine create_column(self, path, whole, expected_rows, units, long_name, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      logical, intent(in) :: whole          !! holds whole numbers
      integer, intent(in) :: expected_rows  !! rows whose space is set aside with the first one
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: name
      integer(hid_t) :: location, space, creation, dataset, file_type, memory_type
      integer :: status, ignored

      call self%not_broken(path, error)
      if (allocated(error)) return
      call self%resolve(path, location, name)
      call get_types(merge(kind_integer, kind_real, whole), file_type, memory_type)
      call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      if (status >= 0) call h5pset_fill_time_f(creation, H5D_FILL_TIME_NEVER_F, status)
      if (status >= 0) call h5pset_chunk_f(creation, 1, &
         [int(max(64, min(expected_rows, column_chunk)), hsize_t)], status)
      if (status >= 0) call h5screate_simple_f(1, [0_hsize_t], space, status, [H5S_UNLIMITED_F])
      if (status >= 0) call h5dcreate_f(location, name, file_type, space, dataset, status, &
         dcpl_id=creation)
      if (status >= 0) call h5dclose_f(dataset, status)
      call self%checked(status, 'the dataset cannot be made', path, error)
      if (allocated(error)) return
      call h5sclose_f(space, ignored)
      call h5pclose_f(creation, ignored)
      call self%write_attribute(path, 'units', units, error)
      if (allocated(error)) return
      call self%write_attribute(path, 'long_name', long_name, error)
   end subroutine create_column

   !> Open a column without a cache of its own: its values go straight to the file.
   subroutine open_column(self, path, dataset, status)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      character(:), allocatable :: name
      integer(hid_t) :: location, access_list
      integer :: ignored

      dataset = -1
      call self%resolve(path, location, name)
      call h5pcreate_f(H5P_DATASET_ACCESS_F, access_list, status)
      if (status >= 0) call h5pset_chunk_cache_f(access_list, 0_size_t, 0_size_t, 0.75, status)
      if (status >= 0) call h5dopen_f(location, name, dataset, status, access_list)
      call h5pclose_f(access_list, ignored)
   end subroutine open_column

   !> Write a value into a row of a column, which grows to hold it.
   subroutine append_value(self, path, row, value, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in) :: value         !! stored as a whole number if that is the column's kind
      type(error_type), allocatable, intent(out) :: error

      call self%append_values(path, row, [value], error)
   end subroutine append_value

   !> Write values into the rows of a column from a row on.
   subroutine append_values(self, path, row, values, error)
      class(hdf5_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: row            !! from 0; the column has at least this many rows
      real(dp), intent(in), contiguous, target :: values(:)  !! at least one
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, memory, file_space
      integer(hsize_t) :: count
      integer :: status, ignored

      call self%not_broken(path, error)
      if (allocated(error)) return
      count = size(values)
      call open_column(self, path, dataset, status)
      if (status >= 0) call h5dset_extent_f(dataset, [row + count], status)
      if (status >= 0) call h5dget_space_f(dataset, file_space, status)
      if (status >= 0) call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, &
         [int(row, hsize_t)], [count], status)
      if (status >= 0) call h5screate_simple_f(1, [count], memory, status)
      if (status >= 0) call h5dwrite_f(dataset, H5T_NATIVE_DOUBLE, c_loc(values), status, &
         mem_space_id=memory, file_space_id=file_space)
      if (status >= 0) call h5dclose_f(dataset, status)
      call self%checked(status, 'the row cannot be written', path, error)
      if (allocated(error)) return
      call h5sclose_f(memory, ignored)
      call h5sclose_f(file_space, ignored)
   end subroutine append_values

end module hdf5_file
