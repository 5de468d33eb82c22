!> Fields of zeros whose memory the system provides when a part of them is first written.
!>
!> A solver that works on a small part of its grid needs memory for this part only. `allocate` gives memory with any
!> content, and setting it to zero would take all of it.
module zeroed_memory
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_null_ptr, c_ptr, c_size_t
   use asperity_precision, only : int64, sp
   implicit none
   private

   public :: free_field, new_zeroed_field

   interface
      !> Allocate memory that contains zeros. The result is null if there is not enough of it.
      function c_calloc(count, size) bind(c, name='calloc') result(memory)
         import :: c_ptr, c_size_t
         implicit none
         integer(c_size_t), value :: count, size
         type(c_ptr) :: memory
      end function c_calloc

      !> Free memory of `calloc`; null has no effect.
      subroutine c_free(memory) bind(c, name='free')
         import :: c_ptr
         implicit none
         type(c_ptr), value :: memory
      end subroutine c_free
   end interface

contains

   !> Make a field of zeros in single precision.
   subroutine new_zeroed_field(lower, upper, memory, field)
      integer, intent(in) :: lower(2), upper(2)          !! bounds
      type(c_ptr), intent(out) :: memory                 !! for `free_field`
      real(sp), pointer, contiguous, intent(out) :: field(:, :)
      real(sp), pointer, contiguous :: plain(:, :)
      integer :: extents(2)

      extents = max(upper - lower + 1, 0)
      memory = c_calloc(int(max(product(int(extents, int64)), 1_int64), c_size_t), int(storage_size(1.0_sp)/8, c_size_t))
      if (c_associated(memory)) then
         call c_f_pointer(memory, plain, extents)
      else
         allocate (plain(extents(1), extents(2)))        ! ends the program in the usual way
      end if
      field(lower(1):, lower(2):) => plain
   end subroutine new_zeroed_field

   !> Free the memory of a field.
   subroutine free_field(memory, field)
      type(c_ptr), intent(inout) :: memory
      real(sp), pointer, contiguous, intent(inout) :: field(:, :)

      call c_free(memory)
      memory = c_null_ptr
      nullify (field)
   end subroutine free_field

end module zeroed_memory
