!> The attributes of the objects in an HDF5 file: texts, whole numbers and reals.
!>
!> The optional argument `error` is explained in `hdf5_handle`.
module hdf5_attributes
   use, intrinsic :: iso_c_binding, only : c_char, c_loc, c_null_char, c_ptr
   use asperity_errors, only : error_file, error_type, fail
   use asperity_precision, only : dp
   use hdf5_c_objects, only : h5oclose, h5oopen
   use hdf5_c_values, only : h5aexists
   use hdf5_kinds, only : hid_t
   use hdf5_library, only : c_text, h5p_default
   use hdf5_tree, only : hdf5_tree_type
   use hdf5_values, only : get_number, get_text, kind_integer, kind_real, kind_text, put_attribute
   implicit none
   private

   public :: hdf5_attributes_type

   !> An open file.
   type, extends(hdf5_tree_type) :: hdf5_attributes_type
   contains
      procedure :: has_attribute
      procedure, private :: write_text, write_integer, write_real, read_text, read_integer, read_real
      !> Write an attribute. An existing attribute gets the new value.
      generic :: write_attribute => write_text, write_integer, write_real
      !> Read an attribute.
      generic :: read_attribute => read_text, read_integer, read_real
   end type hdf5_attributes_type

contains

   !> Does the object have this attribute?
   function has_attribute(self, path, name) result(exists)
      class(hdf5_attributes_type), intent(in) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      logical :: exists
      character(:), allocatable :: local
      integer(hid_t) :: location, object
      integer :: ignored

      exists = self%has(path)
      if (.not. exists) return
      call self%resolve(path, location, local)
      object = h5oopen(location, c_text(local), h5p_default)
      exists = object >= 0
      if (.not. exists) return
      exists = h5aexists(object, c_text(name)) > 0
      ignored = h5oclose(object)
   end function has_attribute

   ! --- writing ------------------------------------------------------------------------------

   !> Write an attribute from memory. An existing attribute gets the new value.
   subroutine store(self, path, name, kind, buffer, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer     !! one value; for text the address of a C string
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hid_t) :: object
      integer :: status, ignored

      if (self%has_failed(error)) return
      call self%open_object(path, object, fault)
      if (.not. allocated(fault)) then
         call put_attribute(object, name, kind, buffer, status)
         call self%checked(status, 'the attribute "'//name//'" cannot be written', path, fault)
         if (status >= 0) ignored = h5oclose(object)
      end if
      call self%settle(fault, error)
   end subroutine store

   !> Write a text (UTF-8).
   subroutine write_text(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error
      character(kind=c_char), allocatable, target :: letters(:)
      type(c_ptr), target :: address(1)
      integer :: i

      allocate (letters(len(value) + 1))
      do i = 1, len(value)
         letters(i) = value(i:i)
      end do
      letters(len(value) + 1) = c_null_char
      address(1) = c_loc(letters)
      call store(self, path, name, kind_text, c_loc(address), error)
   end subroutine write_text

   !> Write a whole number.
   subroutine write_integer(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error
      integer, target :: buffer(1)

      buffer(1) = value
      call store(self, path, name, kind_integer, c_loc(buffer), error)
   end subroutine write_integer

   !> Write a real number.
   subroutine write_real(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(in) :: value
      type(error_type), allocatable, intent(out), optional :: error
      real(dp), target :: buffer(1)

      buffer(1) = value
      call store(self, path, name, kind_real, c_loc(buffer), error)
   end subroutine write_real

   ! --- reading ------------------------------------------------------------------------------

   !> Open the object of an attribute; -1 and a fault if there is no such attribute.
   subroutine open_owner(self, path, name, object, fault)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: object
      type(error_type), allocatable, intent(out) :: fault

      object = -1
      if (self%has_attribute(path, name)) then
         call self%open_object(path, object, fault)
      else
         call fail(fault, error_file, self%path//': '//path//' has no attribute "'//name//'"')
      end if
   end subroutine open_owner

   !> Read the single number of an attribute into memory.
   subroutine load(self, path, name, kind, buffer, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(in) :: kind
      type(c_ptr), intent(in) :: buffer
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hid_t) :: object
      integer :: status, ignored

      if (self%has_failed(error)) return
      call open_owner(self, path, name, object, fault)
      if (.not. allocated(fault)) then
         call get_number(object, name, kind, buffer, status)
         call self%checked(status, 'the attribute "'//name//'" cannot be read', path, fault)
         if (status >= 0) ignored = h5oclose(object)
      end if
      call self%settle(fault, error)
   end subroutine load

   !> Read a whole number; 0 after a fault.
   subroutine read_integer(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error
      integer, target :: buffer(1)

      buffer = 0
      call load(self, path, name, kind_integer, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_integer

   !> Read a real number; 0 after a fault.
   subroutine read_real(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      real(dp), intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error
      real(dp), target :: buffer(1)

      buffer = 0.0_dp
      call load(self, path, name, kind_real, c_loc(buffer), error)
      value = buffer(1)
   end subroutine read_real

   !> Read a text; '' after a fault.
   subroutine read_text(self, path, name, value, error)
      class(hdf5_attributes_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out), optional :: error
      type(error_type), allocatable :: fault
      integer(hid_t) :: object
      integer :: status, ignored

      value = ''
      if (self%has_failed(error)) return
      call open_owner(self, path, name, object, fault)
      if (.not. allocated(fault)) then
         call get_text(object, name, value, status)
         call self%checked(status, 'the attribute "'//name//'" cannot be read', path, fault)
         if (status >= 0) ignored = h5oclose(object)
      end if
      call self%settle(fault, error)
   end subroutine read_text

end module hdf5_attributes
