!> Whether the computation in hand is to be given up, because a stop was asked for.
!>
!> A solve may take minutes. A caller that can go back to where it was begins a watch, and solvers ask
!> `stop_is_due` once in each iteration; without a watch the answer is no. A solver that is told to stop
!> comes back at once with `stopped` in its outcome, and its fields have no meaning.
!>
!> There is one watch for the process, because signals come to processes. Several processes decide
!> together: a stop that any of them was asked for counts for all. All of them must watch alike.
module stop_watch
   use, intrinsic :: iso_c_binding, only : c_int
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use rising_clock, only : seconds_now
   implicit none
   private

   public :: begin_watch, end_watch, stop_is_due, stop_question

   abstract interface
      !> Has a stop been asked for? C's convention, so that Python can answer.
      function stop_question() bind(c) result(yes)
         import :: c_int
         integer(c_int) :: yes                 !! not 0: yes
      end function stop_question
   end interface

   ! gfortran gives this pointer its name in C, which must be found nowhere else.
   procedure(stop_question), pointer :: asperity_stop_question => null()   !! null: there is no watch
   real(dp) :: patience = 0.0_dp               !! with a computation in hand after a stop was asked for, s
   real(dp) :: since = -1.0_dp                 !! clock, s, at which the answer was first yes

contains

   !> Watch from here on.
   subroutine begin_watch(question, seconds)
      procedure(stop_question) :: question
      real(dp), intent(in) :: seconds          !! that the computation may still take once a stop was asked for

      asperity_stop_question => question
      patience = seconds
   end subroutine begin_watch

   !> Watch no longer.
   subroutine end_watch()
      asperity_stop_question => null()
   end subroutine end_watch

   !> Is the computation in hand to be given up? Collective.
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
