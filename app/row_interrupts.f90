!> The requests that may end a row of a run before it is done: a signal, or the time limit of the run.
module row_interrupts
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_parallel, only : is_first_process
   use asperity_signals, only : stop_was_asked
   use time_limit, only : time_limit_type
   implicit none
   private

   public :: must_stop

   type(time_limit_type), public :: limit             !! of the run

contains

   !> Must the run stop? 1 or 0, for module `row_stop`. Only the clock of the first process counts.
   function must_stop() bind(c) result(yes)
      integer(c_int) :: yes

      yes = stop_was_asked()
      if (is_first_process()) then
         if (limit%has_come()) yes = 1_c_int
      end if
   end function must_stop

end module row_interrupts
