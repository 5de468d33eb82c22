!> Functions of the C library that several modules call. A function that only one module calls is declared there.
module system_calls
   use, intrinsic :: iso_c_binding, only : c_char, c_funptr, c_int, c_intptr_t, c_size_t
   implicit none
   private

   public :: c_exit_at_once, c_signal, c_write, in_place_of_procedure

   integer(c_int), parameter, public :: signal_file_size = 25      !! SIGXFSZ of Linux and macOS
   ! What happens at a signal that no procedure handles (see `in_place_of_procedure`).
   integer(c_intptr_t), parameter, public :: action_default = 0    !! SIG_DFL
   integer(c_intptr_t), parameter, public :: action_none = 1       !! SIG_IGN

   interface
      !> Set the procedure that is called at a signal. The result is the one before.
      function c_signal(number, handler) bind(c, name='signal') result(before)
         import :: c_funptr, c_int
         implicit none
         integer(c_int), value :: number
         type(c_funptr), value :: handler
         type(c_funptr) :: before
      end function c_signal

      !> End the process without the exit handlers of the program.
      subroutine c_exit_at_once(status) bind(c, name='_exit')
         import :: c_int
         implicit none
         integer(c_int), value :: status
      end subroutine c_exit_at_once

      !> Write bytes; the result is their number, or -1.
      function c_write(descriptor, bytes, count) bind(c, name='write') result(written)
         import :: c_char, c_int, c_size_t
         implicit none
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
         integer(c_size_t) :: written
      end function c_write
   end interface

contains

   !> One of the two actions, in the form in which C takes it in the place of a procedure.
   pure function in_place_of_procedure(action) result(handler)
      integer(c_intptr_t), intent(in) :: action
      type(c_funptr) :: handler

      handler = transfer(action, handler)
   end function in_place_of_procedure

end module system_calls
