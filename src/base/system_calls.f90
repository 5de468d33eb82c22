!> Functions of the C library that several modules call. A function that only one module calls is declared there.
module system_calls
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_intptr_t, c_size_t
   implicit none
   private

   public :: c_exit_at_once, c_signal, c_write

   integer(c_int), parameter, public :: signal_file_size = 25      !! SIGXFSZ of Linux and macOS
   ! What happens at a signal, if no procedure handles it.
   integer(c_intptr_t), parameter, public :: action_default = 0    !! SIG_DFL
   integer(c_intptr_t), parameter, public :: action_none = 1       !! SIG_IGN

   interface
      !> Set what happens at a signal: one of the two actions above, or the address of a procedure that is called.
      function c_signal(number, action) bind(c, name='signal') result(before)
         import :: c_int, c_intptr_t
         implicit none
         integer(c_int), value :: number
         integer(c_intptr_t), value :: action
         integer(c_intptr_t) :: before
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

end module system_calls
