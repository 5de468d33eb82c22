!> An HDF5 file as a tree of groups: objects are created, listed, staged, linked and removed.
!>
!> A file under construction can be read at any moment (see `hdf5_handle`). Therefore a group that
!> must appear complete is *staged*: it is written without a link to it, flushed, and only then
!> linked (`stage_group`, `publish_group`). The groups that receive such links keep them in one
!> block that is large enough from the start (`create_group` with `expected`), so that the link
!> appears with one write. In a file that is opened with an alignment of 4096, a group has about 150
!> names in its first page of memory. A larger group has a larger block, which remains half written if the
!> program is killed within the microsecond or so that the write takes.
!>
!> Paths within a file start with '/'. The optional argument `error` is explained in `hdf5_handle`.
module hdf5_tree
   use asperity_errors, only : error_file, error_type, fail
   use hdf5_c_lists, only : h5pclose, h5pcreate, h5pset_create_intermediate_group
   use hdf5_c_objects, only : h5gclose, h5gcreate2, h5gcreate_anon, h5iget_type, &
      h5lcreate_external, h5ldelete, h5lexists, h5oclose, h5olink, h5oopen
   use hdf5_kinds, only : hid_t
   use hdf5_handle, only : hdf5_handle_type, set_one_block
   use hdf5_library, only : c_text, h5i_dataset, h5i_group, h5p_default, h5p_group_create, h5p_link_create, &
      member_count, member_name, status_of
   implicit none
   private

   public :: hdf5_tree_type

   integer, parameter, public :: name_length = 256    !! longest name of an object in a listing
   integer, parameter, public :: most_expected = 4000 !! names that a group has room for

   !> An open file.
   type, extends(hdf5_handle_type) :: hdf5_tree_type
   contains
      procedure :: create_group
      procedure :: stage_group
      procedure :: publish_group
      procedure :: has
      procedure :: has_dataset
      procedure :: has_group
      procedure :: has_link
      procedure :: members
      procedure :: listing
      procedure :: remove => remove_object
      procedure :: link_external
      procedure :: resolve
      procedure :: open_object
   end type hdf5_tree_type

contains

   !> The place where a path starts: the file, or the group under construction.
   subroutine resolve(self, path, location, name)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: location
      character(:), allocatable, intent(out) :: name      !! the path from there
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

   !> Create a group, and the groups above it that are missing.
   subroutine create_group(self, path, error, expected)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out), optional :: error
      !> Number of names that the group will have, each of up to 12 letters
      integer, intent(in), optional :: expected
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location, group, links, creation
      integer :: status, ignored, count

      if (self%has_failed(error)) return
      call self%resolve(path, location, name)
      count = 8
      if (present(expected)) count = max(8, min(expected, most_expected))
      links = h5pcreate(h5p_link_create)
      creation = h5pcreate(h5p_group_create)
      status = h5pset_create_intermediate_group(links, 1)
      if (status >= 0) call set_one_block(creation, count, 12, status)
      if (status >= 0) then
         group = h5gcreate2(location, c_text(name), links, creation, h5p_default)
         status = status_of(group)
      end if
      call self%checked(status, 'the group cannot be made', path, fault)
      if (.not. allocated(fault)) then
         ignored = h5gclose(group)
         ignored = h5pclose(links)
         ignored = h5pclose(creation)
      end if
      call self%settle(fault, error)
   end subroutine create_group

   !> Start a group that readers do not see before `publish_group`. The group above it must exist.
   !> Everything that is written below its path goes into it.
   subroutine stage_group(self, path, error)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault

      if (self%has_failed(error)) return
      if (self%staged >= 0) then
         call fail(fault, error_file, self%path//': '//self%staged_path//' is not finished yet')
      else
         self%staged = h5gcreate_anon(self%id, h5p_default, h5p_default)
         call self%checked(status_of(self%staged), 'the group cannot be made', path, fault)
         if (self%staged < 0) self%staged = -1
         self%staged_path = trim(path)
      end if
      call self%settle(fault, error)
   end subroutine stage_group

   !> Link the group under construction, which makes it visible. It replaces a group of the same name.
   subroutine publish_group(self, error)
      class(hdf5_tree_type), intent(inout) :: self
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer :: status

      call self%flush(fault)
      if (.not. allocated(fault)) then
         status = h5lexists(self%id, c_text(self%staged_path), h5p_default)
         if (status > 0) status = h5ldelete(self%id, c_text(self%staged_path), h5p_default)
         if (status >= 0) status = h5olink(self%staged, self%id, c_text(self%staged_path), &
            h5p_default, h5p_default)
         if (status >= 0) status = h5gclose(self%staged)
         call self%checked(status, 'the group cannot be named', self%staged_path, fault)
      end if
      if (.not. allocated(fault)) then
         self%staged = -1
         call self%flush(fault)
      end if
      call self%settle(fault, error)
   end subroutine publish_group

   !> Is there an object of this name? A link that leads nowhere does not count.
   function has(self, path) result(exists)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path
      logical :: exists
      character(:), allocatable :: name
      integer(hid_t) :: location, object
      integer :: ignored, slash, last

      call self%resolve(path, location, name)
      exists = .true.
      if (name == '/' .or. name == '.') return
      last = 1
      do while (exists .and. last < len(name))
         slash = index(name(last + 1:), '/')
         if (slash == 0) then
            last = len(name) + 1
         else
            last = last + slash
         end if
         exists = h5lexists(location, c_text(name(:last - 1)), h5p_default) > 0
         if (.not. exists) return
         object = h5oopen(location, c_text(name(:last - 1)), h5p_default)
         exists = object >= 0
         if (exists) ignored = h5oclose(object)
      end do
   end function has

   !> Is there a link of this name in the root of the file, wherever it leads?
   function has_link(self, path) result(exists)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path      !! '/name'
      logical :: exists

      exists = h5lexists(self%id, c_text(path), h5p_default) > 0
   end function has_link

   !> Is there a dataset of this name?
   logical function has_dataset(self, path)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path

      has_dataset = has_kind(self, path, h5i_dataset)
   end function has_dataset

   !> Is there a group of this name?
   logical function has_group(self, path)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path

      has_group = has_kind(self, path, h5i_group)
   end function has_group

   !> Is there an object of this name and kind? A link to nothing is none.
   function has_kind(self, path, kind) result(exists)
      class(hdf5_tree_type), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(in) :: kind           !! of HDF5
      logical :: exists
      character(:), allocatable :: name
      integer(hid_t) :: location, object
      integer :: ignored

      exists = self%has(path)
      if (.not. exists) return
      call self%resolve(path, location, name)
      object = h5oopen(location, c_text(name), h5p_default)
      exists = object >= 0
      if (.not. exists) return
      exists = h5iget_type(object) == kind
      ignored = h5oclose(object)
   end function has_kind

   !> The names in a group, in alphabetical order; none after a fault.
   subroutine members(self, path, names, error)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(name_length), allocatable, intent(out) :: names(:)
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: local
      integer(hid_t) :: location
      integer :: status, count, i

      allocate (names(0))
      if (self%has_failed(error)) return
      call self%resolve(path, location, local)
      call member_count(location, local, count, status)
      if (status >= 0) then
         deallocate (names)
         allocate (names(count))
         names = ''
         do i = 1, count
            call member_name(location, local, i - 1, names(i), status)
            if (status < 0) exit
         end do
      end if
      call self%checked(status, 'the group cannot be listed', path, fault)
      if (allocated(fault)) names = names(:0)
      call self%settle(fault, error)
   end subroutine members

   !> The datasets of a file as a text for messages, down to the second level. Groups there end with a slash.
   function listing(self) result(text)
      class(hdf5_tree_type), intent(inout) :: self
      character(:), allocatable :: text
      character(name_length), allocatable :: top(:), inner(:)
      type(error_type), allocatable :: error     ! ignored: the listing is then shorter
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
               call add(trim(top(i))//'/'//trim(inner(j))// &
                  merge('/', ' ', self%has_group('/'//trim(top(i))//'/'//trim(inner(j)))))
            end do
         end if
      end do
      if (text == '') text = 'none'

   contains

      !> Add a name, up to 20 of them.
      subroutine add(name)
         character(*), intent(in) :: name

         count = count + 1
         if (count > 20) then
            if (count == 21) text = text//', ...'
         else if (text == '') then
            text = trim(name)
         else
            text = text//', '//trim(name)
         end if
      end subroutine add

   end function listing

   !> Remove an object.
   subroutine remove_object(self, path, error)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location

      if (self%has_failed(error)) return
      call self%resolve(path, location, name)
      call self%checked(h5ldelete(location, c_text(name), h5p_default), &
         'the object cannot be removed', path, fault)
      call self%settle(fault, error)
   end subroutine remove_object

   !> Create an external link: a name for an object of another file, which may be missing.
   subroutine link_external(self, path, file, object, error)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: file      !! the other file, seen from the folder of this file
      character(*), intent(in) :: object    !! path within the other file
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault

      if (self%has_failed(error)) return
      call self%checked(h5lcreate_external(c_text(file), c_text(object), self%id, c_text(path), &
         h5p_default, h5p_default), 'the link cannot be made', path, fault)
      call self%settle(fault, error)
   end subroutine link_external

   !> Open the object of a path.
   subroutine open_object(self, path, object, fault)
      class(hdf5_tree_type), intent(inout) :: self
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: object
      type(error_type), allocatable, intent(out) :: fault
      character(:), allocatable :: name
      integer(hid_t) :: location

      call self%resolve(path, location, name)
      object = h5oopen(location, c_text(name), h5p_default)
      if (object >= 0) return
      if (.not. self%has(path)) then
         call fail(fault, error_file, self%path//': there is no '//trim(path))
         return
      end if
      ! Try again, because HDF5 forgets the reason of a failure with its next call.
      object = h5oopen(location, c_text(name), h5p_default)
      call self%checked(status_of(object), 'cannot be opened', path, fault)
   end subroutine open_object

end module hdf5_tree
