!> Ends the program with a clear message if memory runs out during a run.
!>
!> Before a run starts, `memory_limits` checks that there is enough memory. If an allocation fails
!> nevertheless, gfortran's runtime library would end the program with status 1 and a backtrace. The
!> linker uses the procedure below in place of the library's own, so that the program prints a message of
!> one line and ends with the status of a file error, 3. The result contains all rows that were
!> written, as after a kill.
module out_of_memory
   use, intrinsic :: iso_c_binding, only : c_int, c_size_t
   use system_calls, only : c_exit_at_once, c_write
   implicit none
   private

   public :: end_for_memory

   character(*), parameter :: message = 'asperity: not enough memory: an allocation failed; the '// &
      'rows so far are kept. asperity check says how much memory a case needs'//new_line('a')

contains

   !> Compiled code calls this if an allocation without `stat` fails. It does not return, and allocates
   !> nothing. The compiler passes a place and a message, which are not used.
   subroutine end_for_memory() bind(c, name='_gfortran_os_error_at')
      integer(c_size_t) :: written

      written = c_write(2_c_int, message, len(message, c_size_t))
      call c_exit_at_once(3_c_int)
   end subroutine end_for_memory

end module out_of_memory
