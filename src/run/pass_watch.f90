!> Looks for steps whose passes do not settle.
!>
!> The pressure of one pass should differ from that of the next by ever less. Where it does not, tractions,
!> pressure and the road's slopes do not quite belong together, by about as much as it still changes. So
!> it is where constant shear ends at an edge: a cell that touches carries the whole strength, moves
!> the road under itself away by it, and then does not touch.
module pass_watch
   use precision, only : dp
   use text_tools, only : to_text
   implicit none
   private

   public :: pass_watch_type, watch_passes

   !> Passes from which on the pressure should settle, and from which on little should be left.
   integer, parameter :: some = 4, many = 8
   integer, parameter :: steps_to_report = 3          !! such steps more than others, below many
   !> Changes that count, below many passes and from there on.
   real(dp), parameter :: large = 0.02_dp, small = 1.0e-4_dp

   !> What has been seen so far.
   type :: pass_watch_type
      logical :: reported = .false.
      integer :: steps = 0
   end type pass_watch_type

contains

   !> Look at a step that used up its passes, or settled before; the message is left empty but once.
   subroutine watch_passes(self, passes, changes, tolerance, jumps, message)
      type(pass_watch_type), intent(inout) :: self
      integer, intent(in) :: passes                   !! at most, a step
      !> Change of the pressure in each pass done, over the pressure
      real(dp), intent(in) :: changes(:)
      real(dp), intent(in) :: tolerance               !! of the solvers
      logical, intent(in) :: jumps                    !! the law leaves a cell that opens at its full strength
      character(:), allocatable, intent(out) :: message
      real(dp) :: last, allowed
      integer :: n

      message = ''
      n = size(changes)
      if (passes < some .or. n == 0) return
      last = changes(n)
      allowed = large
      if (n >= many) allowed = max(small, 100.0_dp*tolerance)
      if (n == passes .and. last > allowed .and. last > 0.5_dp*changes(n/2)) then
         self%steps = self%steps + 1
      else
         self%steps = max(self%steps - 1, 0)
      end if
      if (self%reported .or. self%steps < merge(1, steps_to_report, n >= many)) return
      self%reported = .true.
      message = 'the passes of a step do not settle: the pressure still changes by '//to_text(last)// &
         ' of itself in the last of '//to_text(passes)//', and tractions miss their bound by about as much'
      if (jumps) then
         message = message//'. Cells at the edge of the contact come and go with the whole shear '// &
            'strength; law = ''coulomb_orowan'' with a large coefficient has no such edge'
      else
         message = message//'. Allow more passes, take smaller steps, a finer mesh, or some density'
      end if
   end subroutine watch_passes

end module pass_watch
