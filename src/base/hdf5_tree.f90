!> An HDF5 file as a tree of groups: what is opened, made, listed, staged, linked and removed.
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
!> * The system may cut a write off where a page of memory (4096 bytes) ends. Small blocks start at
!>   multiples of 512 bytes, and so lie in one page. A group that is made with an alignment of 4096
!>   holds about 150 names in its first page; the larger block of more names can be torn, if a kill
!>   comes within the microsecond or so in which it is written.
!> * After a write has failed nothing more is written: neither a flush, nor closing the file, nor
!>   the end of the program sends out what HDF5 still holds in memory.
!>
!> Paths within a file start with '/'.
module hdf5_tree
   use, intrinsic :: iso_c_binding, only : c_bool, c_int, c_int64_t
   use asperity_errors, only : error_file, error_type, fail
   use file_system, only : file_exists, folder_of, is_folder, lengthen_file
   use hdf5_library, only : H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_ACC_TRUNC_F, &
      H5F_CLOSE_STRONG_F, H5F_LIBVER_V18_F, H5F_SCOPE_LOCAL_F, h5fclose_f, h5fcreate_f, &
      h5fflush_f, h5fget_filesize_f, h5fis_hdf5_f, h5fopen_f, h5gclose_f, h5gcreate_anon_f, &
      h5gcreate_f, h5gn_members_f, H5I_DATASET_F, h5iget_type_f, h5lcreate_external_f, &
      h5ldelete_f, h5lexists_f, h5lget_name_by_idx_f, h5oclose_f, h5olink_f, h5oopen_f, &
      H5P_FILE_ACCESS_F, H5P_FILE_CREATE_F, H5P_GROUP_CREATE_F, H5P_LINK_CREATE_F, h5pclose_f, &
      h5pcreate_f, h5pset_alignment_f, h5pset_attr_phase_change_f, h5pset_create_inter_group_f, &
      h5pset_est_link_info_f, h5pset_fclose_degree_f, h5pset_libver_bounds_f, &
      h5pset_link_phase_change_f, h5pset_meta_block_size_f, h5pset_small_data_block_size_f, &
      h5pset_userblock_f, hid_t, hsize_t
   use hdf5_errors, only : last_reason, start_hdf5
   use asperity_precision, only : int64
   implicit none
   private

   public :: hdf5_tree_type

   integer, parameter, public :: name_length = 256    !! longest name of an object in a listing
   integer, parameter, public :: most_expected = 4000 !! names a group has room for at once

   !> An open file. Its components, but for the path, are for the modules hdf5_* only.
   type :: hdf5_tree_type
      integer(hid_t) :: id = -1                       !! -1: closed
      integer(hid_t) :: staged = -1                   !! the group under construction, -1: none
      logical :: broken = .false.                     !! a write failed: nothing is written any more
      logical :: writable = .false.
      character(:), allocatable :: staged_path
      character(:), allocatable :: path               !! name of the file
   contains
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: flush => flush_file
      procedure :: create_group
      procedure :: stage_group
      procedure :: publish_group
      procedure :: has
      procedure :: has_dataset
      procedure :: has_link
      procedure :: members
      procedure :: remove => remove_object
      procedure :: link_external
      procedure :: resolve
      procedure :: open_object
      procedure :: checked
      procedure :: not_broken
   end type hdf5_tree_type

   interface
      function c_set_file_locking(list, use_locking, ignore) bind(c, name='H5Pset_file_locking') &
         result(status)
         import :: c_bool, c_int, c_int64_t
         integer(c_int64_t), value :: list
         logical(c_bool), value :: use_locking, ignore
         integer(c_int) :: status
      end function c_set_file_locking
   end interface

contains

   !> Open a file.
   subroutine open_file(self, path, mode, error, alignment, user_block)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: mode      !! 'read', 'create' (replaces a file) or 'append'
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: alignment  !! of what is added, bytes; default 512
      integer, intent(in), optional :: user_block !! bytes at the start of a new file that HDF5 leaves alone
      integer(hid_t) :: access_list, creation
      integer :: status, ignored

      self%id = -1
      self%staged = -1
      self%broken = .false.
      self%writable = mode /= 'read'
      self%path = trim(path)
      call start_hdf5(error)
      if (allocated(error)) return
      call check_place(self%path, mode, error)
      if (allocated(error)) return

      creation = -1
      call new_access_list(access_list, status, alignment)
      if (status >= 0) then
         select case (mode)
         case ('create')
            call h5pcreate_f(H5P_FILE_CREATE_F, creation, status)
            if (status >= 0) call set_one_block(creation, 24, 24, status)
            if (status >= 0 .and. present(user_block)) &
               call h5pset_userblock_f(creation, int(user_block, hsize_t), status)
            if (status >= 0) call h5fcreate_f(self%path, H5F_ACC_TRUNC_F, self%id, status, &
               creation_prp=creation, access_prp=access_list)
         case ('append')
            call h5fopen_f(self%path, H5F_ACC_RDWR_F, self%id, status, access_list)
         case default
            call h5fopen_f(self%path, H5F_ACC_RDONLY_F, self%id, status, access_list)
         end select
      end if
      if (status < 0) then
         self%id = -1
         call explain_opening(self%path, mode, error)
      end if
      ! Not before: HDF5 forgets the reason of a failure with its next call.
      if (creation >= 0) call h5pclose_f(creation, ignored)
      call h5pclose_f(access_list, ignored)
   end subroutine open_file

   !> See that there is a file to be opened, or a folder for a new one.
   subroutine check_place(path, mode, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: mode
      type(error_type), allocatable, intent(out) :: error

      if (is_folder(path)) then
         call fail(error, error_file, path//': is a folder, not a file')
      else if (mode /= 'create') then
         if (.not. file_exists(path)) then
            call fail(error, error_file, path//': there is no such file')
         end if
      else if (.not. is_folder(folder_of(path))) then
         call fail(error, error_file, path//': cannot be written: there is no folder "'// &
            folder_of(path)//'"')
      end if
   end subroutine check_place

   !> How files are opened: the format, no locks, where blocks lie.
   subroutine new_access_list(access_list, status, alignment)
      integer(hid_t), intent(out) :: access_list
      integer, intent(out) :: status
      integer, intent(in), optional :: alignment
      integer(hsize_t) :: step

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
   end subroutine new_access_list

   !> Why a file could not be opened.
   subroutine explain_opening(path, mode, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: mode
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: reason
      logical :: right_kind
      integer :: status

      reason = last_reason()
      right_kind = .true.
      if (mode /= 'create' .and. index(reason, 'ermission') == 0) then
         call h5fis_hdf5_f(path, right_kind, status)
         if (status < 0) right_kind = .true.
      end if
      if (.not. right_kind) then
         call fail(error, error_file, path//': is not an HDF5 file')
      else if (mode == 'read') then
         call fail(error, error_file, path//': cannot be read: '//reason)
      else
         call fail(error, error_file, path//': cannot be written: '//reason)
      end if
   end subroutine explain_opening

   !> Close a file. After a failed write it is left as the last flush made it.
   subroutine close_file(self, error)
      class(hdf5_tree_type), intent(inout) :: self
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

   !> Hand everything to the operating system: from here on a kill loses nothing of it.
   subroutine flush_file(self, error)
      class(hdf5_tree_type), intent(inout) :: self
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

   !> Turn a negative status into an error; a failed write stops all writing.
   subroutine checked(self, status, what, path, error)
      class(hdf5_tree_type), intent(inout) :: self
      integer, intent(in) :: status
      character(*), intent(in) :: what      !! what failed
      character(*), intent(in) :: path      !! object within the file; '': the file
      type(error_type), allocatable, intent(inout) :: error

      if (status >= 0) return
      call fail(error, error_file, self%path//': '//prefix(path)//what//': '//last_reason())
      self%broken = self%writable
   end subroutine checked

   !> An error once a write to this file has failed.
   subroutine not_broken(self, path, error)
      class(hdf5_tree_type), intent(in) :: self
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

   !> Where a path starts: in the file, or in the group under construction.
   subroutine resolve(self, path, location, name)
      class(hdf5_tree_type), intent(in) :: self
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
      class(hdf5_tree_type), intent(inout) :: self
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
      class(hdf5_tree_type), intent(inout) :: self
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
      class(hdf5_tree_type), intent(inout) :: self
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
      class(hdf5_tree_type), intent(in) :: self
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
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path      !! '/name'
      logical :: exists
      integer :: status

      call h5lexists_f(self%id, path, exists, status)
      exists = exists .and. status >= 0
   end function has_link

   !> Is there a dataset of this name?
   function has_dataset(self, path) result(exists)
      class(hdf5_tree_type), intent(in) :: self
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

   !> The names in a group, in the order of the alphabet.
   subroutine members(self, path, names, error)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(name_length), allocatable, intent(out) :: names(:)
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: local
      integer(hid_t) :: location
      integer :: status, count, i

      allocate (names(0))
      call self%resolve(path, location, local)
      count = 0
      call h5gn_members_f(location, local, count, status)
      if (status >= 0) then
         deallocate (names)
         allocate (names(count))
         names = ''
         do i = 1, count
            call h5lget_name_by_idx_f(location, local, i - 1, names(i), status)
            if (status < 0) exit
         end do
      end if
      call self%checked(status, 'the group cannot be listed', path, error)
   end subroutine members

   !> Remove an object.
   subroutine remove_object(self, path, error)
      class(hdf5_tree_type), intent(inout) :: self
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
      class(hdf5_tree_type), intent(inout) :: self
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
      class(hdf5_tree_type), intent(inout) :: self
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

end module hdf5_tree
