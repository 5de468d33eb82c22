!> Procedures that the calls from Python share: they make grids from plain numbers, and turn errors into statuses
!> and messages.
!>
!> f2py does not wrap this module, because it does not support derived types.
module flat_answers
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use case_input, only : parse_case, read_case
   use case_settings, only : case_type
   use memory_limits, only : need_memory
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: case_of, check_memory, grid_of, put_text, report, return_outcome, take_warnings

contains

   !> Make a grid from plain numbers.
   function grid_of(nx, ny, lx, ly, is_free) result(grid)
      integer(c_int), intent(in) :: nx, ny, is_free
      real(c_double), intent(in) :: lx, ly
      type(grid_type) :: grid

      grid = new_grid(int(nx), int(ny), lx, ly, merge(boundary_free, boundary_periodic, is_free == 1))
   end function grid_of

   !> Read the case from an input text, or from a file if the text is empty.
   subroutine case_of(path, text, case, error)
      character(len=*), intent(in) :: path, text
      type(case_type), intent(out) :: case
      type(error_type), allocatable, intent(out) :: error

      if (len(text) > 0) then
         call parse_case(text, trim(path), case, error)
      else
         call read_case(trim(path), case, error)
      end if
   end subroutine case_of

   !> Check that there is memory for some fields of a grid.
   subroutine check_memory(grid, fields, task, error)
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: fields                        !! doubles per cell; a free grid is padded
      character(len=*), intent(in) :: task
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: cells

      cells = real(grid%nx, dp)*grid%ny
      if (grid%boundary == boundary_free) cells = 1.6_dp*cells
      call need_memory(8.0_dp*fields*cells, task, error)
   end subroutine check_memory

   !> Copy the outcome of a solve to the arguments of a call.
   subroutine return_outcome(outcome, iterations, ffts, residual, seconds, converged, reason)
      type(solver_result_type), intent(in) :: outcome
      integer(c_int), intent(out) :: iterations
      real(c_double), intent(out) :: ffts, residual, seconds
      integer(c_int), intent(out) :: converged             !! 1 or 0
      character(len=64), intent(out) :: reason

      iterations = outcome%iterations
      ffts = real(outcome%ffts, dp)
      residual = outcome%residual
      seconds = outcome%seconds
      converged = merge(1, 0, outcome%converged)
      reason = outcome%reason
   end subroutine return_outcome

   !> Turn an error into a status and a message.
   subroutine report(error, status, message)
      type(error_type), allocatable, intent(in) :: error
      integer(c_int), intent(out) :: status
      character(len=*), intent(out) :: message

      status = 0
      message = ''
      if (.not. allocated(error)) return
      status = error%status
      message = error%message
   end subroutine report

   !> Copy a text to a buffer if it is long enough. The caller learns the necessary length from `length`.
   subroutine put_text(text, buffer, length)
      character(len=*), intent(in) :: text
      integer(c_int), intent(inout) :: buffer(:)
      integer(c_int), intent(out) :: length
      integer :: i

      length = len(text)
      if (length > size(buffer)) return
      do i = 1, length
         buffer(i) = ichar(text(i:i))
      end do
   end subroutine put_text

   !> Move new warnings to the existing ones, one per line.
   subroutine take_warnings(new, warnings)
      character(:), allocatable, intent(inout) :: new
      character(len=*), intent(inout) :: warnings

      if (len_trim(new) == 0) return
      if (len_trim(warnings) > 0) then
         warnings = trim(warnings)//new_line('a')//new
      else
         warnings = new
      end if
      new = ''
   end subroutine take_warnings

end module flat_answers
