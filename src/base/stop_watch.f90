!> Decides whether the present computation must be given up because a stop was requested.
!>
!> A solve may take minutes. A caller that can return to the state before the solve begins a watch, and
!> solvers call `stop_is_due` once in each iteration; without a watch the answer is no. If a stop is due, the
!> solver returns at once with `stopped` in its outcome, and its fields have no meaning.
!>
!> There is one watch per process, because signals are sent to processes. Several processes of a run decide
!> together: a request that any of them received counts for all. All of them must watch or none.
module stop_watch
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use rising_clock, only : seconds_now
   implicit none
   private

   public :: begin_watch, end_watch, stop_is_due, stop_question

   abstract interface
      !> Was a stop requested? C's convention, so that Python can answer.
      function stop_question() bind(c) result(yes)
         import :: c_int
         integer(c_int) :: yes                 !! not 0: yes
      end function stop_question
   end interface

   ! gfortran gives this pointer its name in C, which must be found nowhere else.
   procedure(stop_question), pointer :: asperity_stop_question => null()   !! null if there is no watch
   real(dp) :: patience = 0.0_dp               !! how long a computation may continue after the request, s
   real(dp) :: since = -1.0_dp                 !! time when a request was first seen, s

contains

   !> Begin a watch.
   subroutine begin_watch(question, seconds)
      procedure(stop_question) :: question
      real(dp), intent(in) :: seconds          !! how long a computation may continue after the request

      asperity_stop_question => question
      patience = seconds
      since = -1.0_dp
   end subroutine begin_watch

   !> End the watch.
   subroutine end_watch()
      asperity_stop_question => null()
   end subroutine end_watch

   !> Must the present computation be given up? Collective.
   function stop_is_due() result(due)
      logical :: due

      due = .false.
      if (.not. associated(asperity_stop_question)) return
      if (.not. any_process(asperity_stop_question() /= 0_c_int)) then
         since = -1.0_dp
         return
      end if
      if (since < 0.0_dp) since = seconds_now()
      due = any_process(seconds_now() - since >= patience)
   end function stop_is_due

end module stop_watch
