!> An HDF5 file that is open: how it is opened, flushed and closed, and what happens after a fault.
!>
!> A file under construction can be read at any moment, by another process or after a kill. This
!> rests on the following points, and on staged groups (see `hdf5_tree`):
!>
!> * The file format is that of HDF5 1.8 (superblock 2), which has no flag "open for writing", and
!>   files are not locked.
!> * The system may interrupt a write at the end of a page of memory (4096 bytes). Small blocks
!>   start at multiples of 512 bytes and therefore lie in one page.
!> * After a write has failed nothing more is written: neither a flush, nor closing the file, nor
!>   the end of the program writes what HDF5 still holds in memory.
!>
!> Faults. Nearly all procedures of an open file have an optional argument `error`.
!>
!> * With it, a procedure reports its fault to the caller.
!> * Without it, the file remembers the fault, and all later procedures do nothing: writes write
!>   nothing, and reads return 0, '' or nothing. A chain of calls therefore needs no line after each
!>   of them. At the end of the chain `report` or `close` returns the first fault.
!>
!> A write that failed is always remembered. A later procedure that has the argument returns the
!> remembered fault, until the file is opened again. If a fault must prevent a step that does not
!> concern this file, such as removing another file, call `report` before that step.
module hdf5_handle
   use, intrinsic :: iso_c_binding, only : c_bool, c_f_pointer, c_int, c_ptr
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : int64
   use file_system, only : file_exists, file_identity, folder_of, is_folder, lengthen_file
   use hdf5_c_lists, only : h5pclose, h5pcreate, h5pset_alignment, h5pset_attr_phase_change, &
      h5pset_est_link_info, h5pset_fclose_degree, h5pset_libver_bounds, h5pset_link_phase_change, &
      h5pset_meta_block_size, h5pset_small_data_block_size, h5pset_userblock
   use hdf5_c_objects, only : h5fclose, h5fcreate, h5fflush, h5fget_filesize, h5fget_vfd_handle, h5fis_hdf5, h5fopen, &
      h5gclose
   use hdf5_kinds, only : hid_t, hsize_t
   use hdf5_errors, only : last_reason, start_hdf5
   use hdf5_library, only : c_text, h5f_acc_rdonly, h5f_acc_rdwr, h5f_acc_trunc, h5f_close_strong, &
      h5f_libver_v18, h5f_scope_local, h5p_default, h5p_file_access, h5p_file_create
   implicit none
   private

   public :: hdf5_handle_type, set_one_block

   !> An open file. Its components, except for the path, are for the modules hdf5_* only.
   type :: hdf5_handle_type
      integer(hid_t) :: id = -1                       !! -1: closed
      integer(hid_t) :: staged = -1                   !! the group under construction, -1: none
      logical :: writable = .false.
      character(:), allocatable :: staged_path
      character(:), allocatable :: path               !! name of the file
      integer :: identity(2) = -1                     !! of the file that was opened, see `file_identity`
      type(error_type), allocatable :: fault          !! the first fault that is remembered
      logical :: unreported = .false.                 !! the fault has not been returned to a caller
   contains
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: flush => flush_file
      procedure :: renew => renew_file
      procedure :: report
      procedure :: has_failed
      procedure :: settle
      procedure :: checked
   end type hdf5_handle_type

   interface
      function h5pset_file_locking(list, use_locking, ignore) bind(c, name='H5Pset_file_locking') &
         result(status)
         import :: c_bool, c_int, hid_t
         integer(hid_t), value :: list
         logical(c_bool), value :: use_locking, ignore
         integer(c_int) :: status
      end function h5pset_file_locking
   end interface

contains

   !> Open a file.
   subroutine open_file(self, path, mode, error, alignment, user_block)
      class(hdf5_handle_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: mode      !! 'read', 'create' (replaces a file) or 'append'
      type(error_type), allocatable, intent(out), optional :: error
      integer, intent(in), optional :: alignment  !! alignment of new objects, bytes; default 512
      !> Bytes at the start of a new file that HDF5 does not use
      integer, intent(in), optional :: user_block
      type(error_type), allocatable :: fault

      self%id = -1
      self%staged = -1
      self%writable = mode /= 'read'
      self%path = trim(path)
      self%unreported = .false.
      if (allocated(self%fault)) deallocate (self%fault)

      call start_hdf5(fault)
      if (.not. allocated(fault)) call check_place(self%path, mode, fault)
      if (.not. allocated(fault)) call open_with_hdf5(self, mode, fault, alignment, user_block)
      call self%settle(fault, error)
   end subroutine open_file

   !> Check that there is a file to be opened, or a folder for a new one.
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

   !> Open a file whose place is known to be right.
   subroutine open_with_hdf5(self, mode, error, alignment, user_block)
      class(hdf5_handle_type), intent(inout) :: self
      character(*), intent(in) :: mode
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: alignment
      integer, intent(in), optional :: user_block
      integer(hid_t) :: access_list, creation
      integer :: status, ignored

      creation = -1
      call new_access_list(access_list, status, alignment)
      if (status >= 0) then
         select case (mode)
         case ('create')
            creation = h5pcreate(h5p_file_create)
            call set_one_block(creation, 24, 24, status)
            if (status >= 0 .and. present(user_block)) &
               status = h5pset_userblock(creation, int(user_block, hsize_t))
            if (status >= 0) &
               self%id = h5fcreate(c_text(self%path), h5f_acc_trunc, creation, access_list)
         case ('append')
            self%id = h5fopen(c_text(self%path), h5f_acc_rdwr, access_list)
         case default
            self%id = h5fopen(c_text(self%path), h5f_acc_rdonly, access_list)
         end select
      end if
      if (self%id < 0) then
         self%id = -1
         call explain_opening(self%path, mode, error)
      end if
      self%identity = file_identity(self%path)
      ! The lists are closed last, because HDF5 forgets the reason of a failure with its next call.
      if (creation >= 0) ignored = h5pclose(creation)
      ignored = h5pclose(access_list)
   end subroutine open_with_hdf5

   !> The properties with which files are opened: their format, no locks, and where blocks start.
   subroutine new_access_list(access_list, status, alignment)
      integer(hid_t), intent(out) :: access_list
      integer, intent(out) :: status
      integer, intent(in), optional :: alignment
      integer(hsize_t) :: step

      step = 512
      if (present(alignment)) step = alignment
      access_list = h5pcreate(h5p_file_access)
      status = h5pset_libver_bounds(access_list, h5f_libver_v18, h5f_libver_v18)
      if (status >= 0) status = h5pset_fclose_degree(access_list, h5f_close_strong)
      ! Space is taken as it is needed. Space that is set aside would be given back by shortening
      ! the file, which HDF5 does before it notes the new length.
      if (status >= 0) status = h5pset_meta_block_size(access_list, 0_hsize_t)
      if (status >= 0) status = h5pset_small_data_block_size(access_list, 0_hsize_t)
      if (status >= 0) status = h5pset_alignment(access_list, 128_hsize_t, step)
      if (status >= 0) status = h5pset_file_locking(access_list, .false._c_bool, .true._c_bool)
   end subroutine new_access_list

   !> Let a group keep its names and attributes in one block that is large enough from the start.
   subroutine set_one_block(creation, count, length, status)
      integer(hid_t), intent(in) :: creation  !! property list of the group
      integer, intent(in) :: count            !! number of names expected
      integer, intent(in) :: length           !! letters of a name
      integer, intent(out) :: status

      status = h5pset_link_phase_change(creation, 65535, 0)
      if (status >= 0) status = h5pset_est_link_info(creation, count, length)
      if (status >= 0) status = h5pset_attr_phase_change(creation, 65535, 0)
   end subroutine set_one_block

   !> The reason why a file could not be opened.
   subroutine explain_opening(path, mode, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: mode
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: reason
      logical :: other_kind

      reason = last_reason()
      other_kind = .false.
      if (mode /= 'create' .and. index(reason, 'ermission') == 0) &
         other_kind = h5fis_hdf5(c_text(path)) == 0
      if (other_kind) then
         call fail(error, error_file, path//': is not an HDF5 file')
      else if (mode == 'read') then
         call fail(error, error_file, path//': cannot be read: '//reason)
      else
         call fail(error, error_file, path//': cannot be written: '//reason)
      end if
   end subroutine explain_opening

   !> Close a file. After a failed write it stays as the last flush left it. The error is a fault
   !> that has not been returned to a caller before, or the failure to close.
   subroutine close_file(self, error)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: status

      if (allocated(self%fault)) then
         if (self%unreported) call self%report(error)
         if (.not. self%writable .and. self%id >= 0) status = h5fclose(self%id)
      else if (self%id >= 0) then
         if (self%staged >= 0) status = h5gclose(self%staged)
         if (self%writable) call self%flush(fault)
         if (.not. allocated(fault)) then
            status = h5fclose(self%id)
            call self%checked(status, 'closing the file failed', '', fault)
         end if
         call self%settle(fault, error)
      end if
      self%id = -1
      self%staged = -1
   end subroutine close_file

   !> Pass all data to the operating system, so that nothing is lost if the program is killed later. It is a fault if
   !> another file has taken the name of this one meanwhile: readers would not find what is written.
   subroutine flush_file(self, error)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hsize_t) :: length
      integer :: status

      if (self%has_failed(error)) return
      ! HDF5 notes the new length before it has made the file so long, and a reader in between would
      ! find the file too short. Therefore the file gets its length first.
      status = h5fget_filesize(self%id, length)
      call self%checked(status, 'writing failed', '', fault)
      call check_name(self, fault)
      call lengthen_file(self%path, descriptor_of(self), int(length, int64), fault)
      if (.not. allocated(fault)) then
         status = h5fflush(self%id, h5f_scope_local)
         call self%checked(status, 'writing failed', '', fault)
      end if
      if (allocated(fault)) call remember(self, fault)
      call self%settle(fault, error)
   end subroutine flush_file

   !> Close a file and open it again. HDF5 remembers the gaps between the blocks of an open file, and searches all of them
   !> for each new block. After thousands of objects this search takes most of the time of a run.
   subroutine renew_file(self, error)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      type(error_type), allocatable :: fault
      integer :: identity(2)

      if (allocated(error)) return
      identity = self%identity
      call self%close(error)
      if (allocated(error)) return
      call open_with_hdf5(self, 'append', fault)
      if (any(self%identity /= identity)) then
         self%identity = identity
         call check_name(self, fault)
      end if
      if (allocated(fault)) call remember(self, fault)
      call self%settle(fault, error)
   end subroutine renew_file

   !> Check that the name still leads to the file that was opened.
   subroutine check_name(self, error)
      class(hdf5_handle_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error)) return
      if (all(file_identity(self%path) == self%identity)) return
      call fail(error, error_file, self%path//': cannot be written: the file has been removed, moved or replaced '// &
         'since it was opened')
   end subroutine check_name

   !> The descriptor of the open file; -1 if HDF5 does not tell it.
   function descriptor_of(self) result(descriptor)
      class(hdf5_handle_type), intent(in) :: self
      integer(c_int) :: descriptor
      integer(c_int), pointer :: number
      type(c_ptr) :: address

      descriptor = -1
      if (h5fget_vfd_handle(self%id, h5p_default, address) < 0) return
      call c_f_pointer(address, number)
      descriptor = number
   end function descriptor_of

   ! --- faults -------------------------------------------------------------------------------

   !> Get the first fault that the file remembers, if there is one.
   subroutine report(self, error)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      logical :: failed

      failed = self%has_failed(error)
   end subroutine report

   !> Does the file remember a fault? If so, it is returned as the error.
   function has_failed(self, error) result(failed)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      logical :: failed

      failed = allocated(self%fault)
      if (.not. failed .or. .not. present(error)) return
      error = self%fault
      self%unreported = .false.
   end function has_failed

   !> End a procedure: give its fault to the caller, or remember it if the caller does not want it.
   subroutine settle(self, fault, error)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: fault
      type(error_type), allocatable, intent(out), optional :: error

      if (.not. allocated(fault)) return
      if (present(error)) then
         call move_alloc(fault, error)
         self%unreported = .false.
      else
         call remember(self, fault)
         self%unreported = .true.
      end if
   end subroutine settle

   !> Keep a fault if it is the first one.
   subroutine remember(self, fault)
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), intent(in) :: fault

      if (allocated(self%fault)) return
      self%fault = fault
      self%unreported = .true.
   end subroutine remember

   !> Turn a negative status into a fault. A file that is open for writing remembers it.
   subroutine checked(self, status, what, path, fault)
      class(hdf5_handle_type), intent(inout) :: self
      integer, intent(in) :: status
      character(*), intent(in) :: what      !! what failed
      character(*), intent(in) :: path      !! object within the file; '' for the file itself
      type(error_type), allocatable, intent(inout) :: fault
      character(:), allocatable :: object

      if (status >= 0) return
      object = ''
      if (path /= '') object = trim(path)//': '
      call fail(fault, error_file, self%path//': '//object//what//': '//last_reason())
      if (self%writable) call remember(self, fault)
   end subroutine checked

end module hdf5_handle
