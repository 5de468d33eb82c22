!> Relaxes the spots of an adhesive contact where the residual is largest.
!>
!> Where the attraction closes or opens a gap, a small spot is far from equilibrium and changes a lot, while the rest of
!> the contact hardly moves. A step of the model ends long before such spots have arrived (module `adhesion_descent`).
!> They are therefore relaxed one by one, each in a window (module `adhesion_window`) around the cell with the largest
!> residual (nonlinear elimination). What they do to the rest of the contact belongs to the next step.
!>
!> The windows do not depend on the number of processes. All processes get the fields of all windows, and each of them
!> relaxes some.
module adhesion_spots
   use adhesion_potential, only : has_smooth_potential
   use adhesion_window, only : side, window_task_type
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_parallel, only : gather_rows, global_sum, process_count, process_number
   use asperity_precision, only : dp
   implicit none
   private

   public :: may_have_spots, relax_spots

   real(dp), parameter :: most_cells = 0.02_dp    !! part of the cells that may be in windows
   integer, parameter :: most_windows = 200

contains

   !> Are windows allowed? The road must be large enough, and the attraction may not jump.
   pure logical function may_have_spots(work, now)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: now

      may_have_spots = windows_allowed(work) > 0 .and. min(work%patch%nx, rows_of_patch(work)) >= side &
         .and. has_smooth_potential(now%problem%potential)
   end function may_have_spots

   !> The largest number of windows.
   pure integer function windows_allowed(work)
      type(adhesion_work_type), intent(in) :: work

      windows_allowed = int(min(most_cells*work%patch%cells/side**2, real(most_windows, dp)))
   end function windows_allowed

   !> Relax the spots whose natural residual exceeds a limit. `inner` has been measured. Only its gaps change, so that its
   !> traction is no longer theirs. Collective.
   subroutine relax_spots(work, limit, inner)
      type(adhesion_work_type), intent(in) :: work
      real(dp), intent(in) :: limit
      type(adhesion_iteration_type), intent(inout) :: inner
      type(window_task_type) :: task
      integer, allocatable :: corners(:, :)
      real(dp), allocatable :: gap(:, :, :), traction(:, :, :)
      real(dp) :: rest
      integer :: k

      call find_spots(work, limit, inner, corners, rest)
      allocate (gap(side, side, size(corners, 2)), traction(side, side, size(corners, 2)), source=0.0_dp)
      call copy_windows(work, inner, corners, gap, traction)

      task = window_task_type(inner%problem, inner%units%length, inner%units%traction, work%scaling, max(limit, rest))
      !$omp parallel do default(none) shared(work, task, gap, traction) private(k) schedule(dynamic) &
      !$omp num_threads(work%patch%threads)
      do k = 1, size(gap, 3)
         if (is_mine(work, k)) then
            call work%window%relax(task, traction(:, :, k), gap(:, :, k))
         else
            gap(:, :, k) = 0.0_dp
         end if
      end do
      if (work%patch%sharing%shared) gap = reshape(global_sum([gap]), shape(gap))
      call put_windows(work, corners, gap, inner)
   end subroutine relax_spots

   !> Number of rows of the whole patch.
   pure integer function rows_of_patch(work)
      type(adhesion_work_type), intent(in) :: work

      rows_of_patch = nint(work%patch%cells/work%patch%nx)
   end function rows_of_patch

   !> Does this process relax a window?
   logical function is_mine(work, window)
      type(adhesion_work_type), intent(in) :: work
      integer, intent(in) :: window

      is_mine = .true.
      if (work%patch%sharing%shared) is_mine = modulo(window, process_count()) == process_number()
   end function is_mine

   !> Number of rows of the patch that other processes hold before those of this one; any number if it holds none.
   pure integer function rows_before(work)
      type(adhesion_work_type), intent(in) :: work

      rows_before = 0
      if (work%patch%rows > 0) rows_before = work%patch%sharing%own(1) - 1
   end function rows_before

   !> Find windows around the cells with the largest residuals. They do not overlap. Collective.
   subroutine find_spots(work, limit, inner, corners, rest)
      type(adhesion_work_type), intent(in) :: work
      real(dp), intent(in) :: limit
      type(adhesion_iteration_type), intent(in) :: inner
      integer, allocatable, intent(out) :: corners(:, :)   !! first cell and row of each window
      real(dp), intent(out) :: rest                        !! largest natural residual outside the windows
      real(dp), allocatable :: own(:, :), whole(:, :)      !! largest residual and its cell in each row
      integer :: corner(2), before, j

      before = rows_before(work)
      allocate (corners(2, 0), own(2, work%patch%rows))
      !$omp parallel do default(none) shared(work, inner, corners, own, before) private(j) &
      !$omp num_threads(work%patch%threads)
      do j = 1, work%patch%rows
         own(:, j) = worst_of_row(work, inner, corners, before, j)
      end do
      do
         whole = own
         if (work%patch%sharing%shared) whole = gather_rows(own)
         j = maxloc(whole(1, :), dim=1)
         rest = whole(1, j)
         if (rest <= limit .or. size(corners, 2) == windows_allowed(work)) exit

         ! A window that would reach beyond the road moves inwards.
         corner = [nint(whole(2, j)), j] - side/2
         corner = min(max(corner, 1), [work%patch%nx, rows_of_patch(work)] - side + 1)
         if (any(maxval(abs(corners - spread(corner, 2, size(corners, 2))), dim=1) < side)) exit
         corners = reshape([corners, corner], [2, size(corners, 2) + 1])
         do j = max(corner(2) - before, 1), min(corner(2) - before + side - 1, work%patch%rows)
            own(:, j) = worst_of_row(work, inner, corners, before, j)
         end do
      end do
   end subroutine find_spots

   !> The largest natural residual of row j outside the windows, and its cell.
   function worst_of_row(work, inner, corners, before, j) result(worst)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: inner
      integer, intent(in) :: corners(:, :)
      integer, intent(in) :: before                        !! rows of the processes before this one
      integer, intent(in) :: j                             !! row of this process
      real(dp) :: worst(2)
      real(dp) :: residual(work%patch%nx)
      integer :: i, k

      ! r is -G on the free cells. On the others, where the gap is 0 and G is not negative, the natural residual is 0.
      associate (gap => inner%state(1:work%patch%nx, j), r => work%residual(1:work%patch%nx, j))
         residual(:) = abs(min(gap/inner%units%length, -r/inner%units%traction))
      end associate
      do k = 1, size(corners, 2)
         associate (first => corners(:, k), last => corners(:, k) + side - 1)
            if (before + j >= first(2) .and. before + j <= last(2)) residual(first(1):last(1)) = 0.0_dp
         end associate
      end do
      i = maxloc(residual, dim=1)
      worst = [residual(i), real(i, dp)]
   end function worst_of_row

   !> Give all processes the gaps of all windows, and the tractions, the load included. Collective.
   subroutine copy_windows(work, inner, corners, gap, traction)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: inner
      integer, intent(in) :: corners(:, :)
      real(dp), intent(inout) :: gap(:, :, :), traction(:, :, :)   !! in: 0
      integer :: before, j, k

      before = rows_before(work)
      do k = 1, size(corners, 2)
         associate (a => corners(1, k), b => corners(1, k) + side - 1, above => corners(2, k) - 1 - before)
            do j = max(above + 1, 1), min(above + side, work%patch%rows)
               gap(:, j - above, k) = inner%state(a:b, j)
               traction(:, j - above, k) = inner%traction(a:b, j) + inner%load
            end do
         end associate
      end do
      if (.not. work%patch%sharing%shared) return
      gap = reshape(global_sum([gap]), shape(gap))
      traction = reshape(global_sum([traction]), shape(traction))
   end subroutine copy_windows

   !> Set the gaps of this process to those of the windows.
   subroutine put_windows(work, corners, gap, inner)
      type(adhesion_work_type), intent(in) :: work
      integer, intent(in) :: corners(:, :)
      real(dp), intent(in) :: gap(:, :, :)
      type(adhesion_iteration_type), intent(inout) :: inner
      integer :: before, j, k

      before = rows_before(work)
      do k = 1, size(corners, 2)
         associate (a => corners(1, k), b => corners(1, k) + side - 1, above => corners(2, k) - 1 - before)
            do j = max(above + 1, 1), min(above + side, work%patch%rows)
               inner%state(a:b, j) = gap(:, j - above, k)
            end do
         end associate
      end do
   end subroutine put_windows

end module adhesion_spots
