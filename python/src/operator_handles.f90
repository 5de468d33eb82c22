!> The open operators, which Python identifies by numbers. f2py does not wrap this module, because it does not
!> support derived types.
module operator_handles
   use asperity_errors, only : error_input, error_type, fail
   use fft_conv, only : convolution_type
   use asperity_precision, only : dp
   use text_tools, only : to_text
   implicit none
   private

   public :: find_operator, free_operator, new_operator, operator_type

   integer, parameter :: most = 256     !! operators at a time

   !> An operator and the shear modulus by which its displacements are divided.
   type :: operator_type
      type(convolution_type) :: map     !! for a shear modulus of 1
      real(dp) :: modulus = 1.0_dp      !! shear modulus, Pa
   end type operator_type

   !> The operator of a handle.
   type :: slot_type
      type(operator_type), pointer :: operator => null()
      integer :: handle = 0
   end type slot_type

   type(slot_type) :: slots(most)
   integer :: last_handle = 0           !! handles are never reused

contains

   !> Make an operator.
   subroutine new_operator(handle, operator, error)
      integer, intent(out) :: handle               !! 0 after an error
      type(operator_type), pointer, intent(out) :: operator
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      handle = 0
      operator => null()
      do i = 1, most
         if (slots(i)%handle /= 0) cycle
         last_handle = last_handle + 1
         slots(i)%handle = last_handle
         handle = last_handle
         allocate (slots(i)%operator)
         operator => slots(i)%operator
         return
      end do
      call fail(error, error_input, 'more than '//to_text(most)//' operators are in use at a time')
   end subroutine new_operator

   !> The operator of a handle that must be in use.
   subroutine find_operator(handle, operator, error)
      integer, intent(in) :: handle
      type(operator_type), pointer, intent(out) :: operator
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      operator => null()
      do i = 1, most
         if (handle > 0 .and. slots(i)%handle == handle) operator => slots(i)%operator
      end do
      if (.not. associated(operator)) call fail(error, error_input, 'the operator is closed')
   end subroutine find_operator

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
