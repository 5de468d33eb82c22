!> Operators in hand, known to Python by a number. Not seen by f2py, which has no derived types.
module operator_handles
   use fft_conv, only : convolution_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: free_operator, new_operator, operator_of, operator_type

   integer, parameter :: most = 256     !! operators at a time

   !> An operator and the modulus that it is over.
   type :: operator_type
      type(convolution_type) :: map     !! for a shear modulus of 1
      real(dp) :: modulus = 1.0_dp      !! shear modulus, Pa
   end type operator_type

   !> What a handle stands for.
   type :: slot_type
      type(operator_type), pointer :: operator => null()
      integer :: handle = 0
   end type slot_type

   type(slot_type) :: slots(most)
   integer :: last_handle = 0           !! handles are never used again

contains

   !> Make an operator; the handle is 0 if there are too many.
   subroutine new_operator(handle)
      integer, intent(out) :: handle
      integer :: i

      handle = 0
      do i = 1, most
         if (slots(i)%handle /= 0) cycle
         last_handle = last_handle + 1
         slots(i)%handle = last_handle
         handle = last_handle
         allocate (slots(i)%operator)
         return
      end do
   end subroutine new_operator

   !> The operator of a handle, null for a handle that is not in use.
   function operator_of(handle) result(operator)
      integer, intent(in) :: handle
      type(operator_type), pointer :: operator
      integer :: i

      operator => null()
      if (handle <= 0) return
      do i = 1, most
         if (slots(i)%handle == handle) operator => slots(i)%operator
      end do
   end function operator_of

   !> Free an operator and its plans.
   subroutine free_operator(handle)
      integer, intent(in) :: handle
      integer :: i

      if (handle <= 0) return
      do i = 1, most
         if (slots(i)%handle /= handle) cycle
         call slots(i)%operator%map%destroy()
         deallocate (slots(i)%operator)
         slots(i)%operator => null()
         slots(i)%handle = 0
      end do
   end subroutine free_operator

end module operator_handles
