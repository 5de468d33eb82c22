!> The record that a solver returns to its caller. It describes an outcome and not an error.
module solver_result
   use asperity_precision, only : dp, int64
   implicit none
   private

   public :: solver_result_type

   ! Reasons for which a solve ends.
   character(*), parameter, public :: reason_converged = 'converged'
   character(*), parameter, public :: reason_iterations = 'the limit of iterations was reached'
   character(*), parameter, public :: reason_undetermined = 'full contact: the displacement leaves no gap'

   ! Reasons for which a solve does not begin.
   character(*), parameter, public :: reason_unmade = 'the solver was not made, or making it has failed'
   character(*), parameter, public :: reason_shape = 'a field is missing or does not have the shape of the grid'

   !> The record of one solve.
   type :: solver_result_type
      integer :: iterations = 0                 !! iterations done
      integer(int64) :: ffts = 0                !! real n x n transforms done
      real(dp) :: residual = 0.0_dp             !! relative residual, recomputed at the end
      real(dp) :: load_error = 0.0_dp           !! relative error of the prescribed load
      real(dp) :: required = 0.0_dp             !! what the two errors had to meet; 0: not recorded
      logical :: converged = .false.            !! they met it
      logical :: stopped = .false.              !! stopped (module stop_watch): the fields have no meaning
      character(128) :: reason = ''             !! why the solver returned
      real(dp) :: seconds = 0.0_dp              !! wall time of the solve
   contains
      procedure :: refuse
   end type solver_result_type

contains

   !> Record that a solve has not begun, if there is a reason for that.
   pure subroutine refuse(self, reason)
      class(solver_result_type), intent(inout) :: self
      character(*), intent(in) :: reason           !! what is wrong with the arguments; empty: nothing

      if (reason == '') return
      self%converged = .false.
      self%residual = huge(1.0_dp)
      self%reason = reason
   end subroutine refuse

end module solver_result
