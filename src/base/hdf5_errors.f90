!> The reasons that HDF5 gives for its failures. By default it would print them.
module hdf5_errors
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_f_pointer, c_funloc, c_funptr, &
      c_int, c_int64_t, c_null_funptr, c_null_ptr, c_ptr, c_size_t
   use asperity_errors, only : error_file, error_type, fail
   use file_system, only : let_size_limit_be_an_error
   use hdf5_c_objects, only : h5dont_atexit, h5eset_auto2
   use hdf5_kinds, only : hid_t
   use hdf5_library, only : open_library
   implicit none
   private

   public :: last_reason, start_hdf5, text_of

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
   character(:), allocatable :: reason                !! description of the last failure

contains

   !> Start HDF5 such that it prints no messages and does not write when the program ends.
   subroutine start_hdf5(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      if (started) return
      call let_size_limit_be_an_error()
      status = h5dont_atexit()
      call open_library(status)
      if (status >= 0) status = h5eset_auto2(0_hid_t, c_null_funptr, c_null_ptr)
      started = status >= 0
      if (.not. started) call fail(error, error_file, 'HDF5 cannot be initialised')
   end subroutine start_hdf5

   !> The reason for HDF5's last failure. If a system call failed, it is the message of the system.
   function last_reason() result(text)
      character(:), allocatable :: text
      character(*), parameter :: mark = 'error message = '''
      integer(c_int) :: status
      integer :: first, length

      reason = ''
      status = c_walk_errors(0_c_int64_t, 0_c_int, c_funloc(keep_description), c_null_ptr)
      if (status < 0 .or. reason == '') reason = 'HDF5 gives no reason'
      text = reason
      first = index(text, mark)
      if (first > 0) then
         first = first + len(mark)
         length = index(text(first:), '''') - 1
         if (length > 0) text = text(first:first + length - 1)
      else if (index(text, 'truncated file') == 1) then
         text = 'its end is missing: it has '//number_after(text, ' eof = ')//' of ' &
            //number_after(text, 'stored_eof = ')//' bytes'
      end if
   end function last_reason

   !> The digits that follow a mark in a text.
   pure function number_after(text, mark) result(digits)
      character(*), intent(in) :: text
      character(*), intent(in) :: mark
      character(:), allocatable :: digits
      integer :: first

      first = index(text, mark) + len(mark)
      digits = text(first:first - 1 + verify(text(first:)//' ', '0123456789') - 1)
   end function number_after

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

   !> Convert a text of C to a text of Fortran.
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

end module hdf5_errors
