!> Ends the program with a clear message if memory runs out during a run.
!>
!> Before a run starts, `memory_limits` checks that there is enough memory. If an allocation fails
!> nevertheless, gfortran's runtime library would end the program with status 1 and a backtrace. The
!> linker uses the procedure below in place of the library's own, so that the program prints a message of
!> one line and ends with the status of a file error, 3. The result contains all rows that were
!> written, as after a kill.
module out_of_memory
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_long, c_size_t
   implicit none
   private

   public :: end_for_memory

   character(*), parameter :: message = 'asperity: not enough memory: an allocation failed; the '// &
      'rows so far are kept. asperity check says how much memory a case needs'//new_line('a')

   interface
      function c_write(descriptor, text, length) bind(c, name='write') result(written)
         import :: c_char, c_int, c_long, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: text(*)
         integer(c_size_t), value :: length
         integer(c_long) :: written
      end function c_write

      subroutine c_exit_at_once(status) bind(c, name='_exit')
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit_at_once
   end interface

contains

   !> Compiled code calls this if an allocation without `stat` fails. It does not return, and allocates
   !> nothing. The compiler passes a place and a message, which are not used.
   subroutine end_for_memory() bind(c, name='_gfortran_os_error_at')
      integer(c_long) :: written

      written = c_write(2_c_int, message, len(message, c_size_t))
      call c_exit_at_once(3_c_int)
   end subroutine end_for_memory

end module out_of_memory
