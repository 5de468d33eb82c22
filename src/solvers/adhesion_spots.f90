!> Relaxes the spots of an adhesive contact where the residual is largest.
!>
!> Where the attraction closes or opens a gap, a small spot is far from equilibrium and changes a lot, while the rest of
!> the contact hardly moves. A step of the model ends long before such spots have arrived (module `adhesion_descent`).
!> They are therefore relaxed one by one, each in a window (module `adhesion_window`) around the cell with the largest
!> residual (nonlinear elimination). What they do to the rest of the contact belongs to the next step.
!>
!> Each process looks for spots on its own rows.
module adhesion_spots
   use adhesion_potential, only : has_smooth_potential
   use adhesion_window, only : side, window_task_type
   use adhesion_work, only : adhesion_iteration_type, adhesion_work_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: relax_spots

   real(dp), parameter :: most_cells = 0.02_dp    !! part of the cells of a process in windows

contains

   !> Relax the spots whose natural residual exceeds a limit. `inner` has been measured. Only its gaps change, so that its
   !> traction is no longer theirs.
   subroutine relax_spots(work, limit, inner)
      type(adhesion_work_type), intent(in) :: work
      real(dp), intent(in) :: limit
      type(adhesion_iteration_type), intent(inout) :: inner
      type(window_task_type) :: task
      integer, allocatable :: corners(:, :)
      real(dp) :: rest
      integer :: k

      if (.not. has_smooth_potential(inner%problem%potential)) return
      if (min(work%patch%nx, work%patch%rows) < side) return
      call find_spots(work, limit, inner, corners, rest)

      task = window_task_type(inner%problem, inner%units%length, inner%units%traction, work%scaling, max(limit, rest))
      !$omp parallel do default(none) shared(work, inner, task, corners) private(k) schedule(dynamic) &
      !$omp num_threads(work%patch%threads)
      do k = 1, size(corners, 2)
         associate (a => corners(1, k), b => corners(1, k) + side - 1, c => corners(2, k), d => corners(2, k) + side - 1)
            call work%window%relax(task, inner%traction(a:b, c:d) + inner%load, inner%state(a:b, c:d))
         end associate
      end do
   end subroutine relax_spots

   !> Find windows around the cells with the largest residuals. They do not overlap.
   subroutine find_spots(work, limit, inner, corners, rest)
      type(adhesion_work_type), intent(in) :: work
      real(dp), intent(in) :: limit
      type(adhesion_iteration_type), intent(in) :: inner
      integer, allocatable, intent(out) :: corners(:, :)   !! first cell and row of each window
      real(dp), intent(out) :: rest                        !! largest natural residual outside the windows
      real(dp) :: worst(work%patch%rows)
      integer :: column(work%patch%rows), corner(2), j, most

      most = int(most_cells*work%patch%nx*work%patch%rows/side**2)
      allocate (corners(2, 0))
      !$omp parallel do default(none) shared(work, inner, corners, worst, column) private(j) &
      !$omp num_threads(work%patch%threads)
      do j = 1, work%patch%rows
         call find_worst(work, inner, corners, j, worst(j), column(j))
      end do
      do
         j = maxloc(worst, dim=1)
         rest = worst(j)
         if (rest <= limit .or. size(corners, 2) >= most) exit
         corner = around([column(j), j], [work%patch%nx, work%patch%rows])
         if (any(maxval(abs(corners - spread(corner, 2, size(corners, 2))), dim=1) < side)) exit
         corners = reshape([corners, corner], [2, size(corners, 2) + 1])
         do j = corner(2), corner(2) + side - 1
            call find_worst(work, inner, corners, j, worst(j), column(j))
         end do
      end do
   end subroutine find_spots

   !> The first cell and row of the window around a cell, within the rows of this process.
   pure function around(cell, cells) result(corner)
      integer, intent(in) :: cell(2)
      integer, intent(in) :: cells(2)                 !! along x, and rows
      integer :: corner(2)

      corner = min(max(cell - side/2, 1), cells - side + 1)
   end function around

   !> Find the cell of row j with the largest natural residual outside the windows.
   subroutine find_worst(work, inner, corners, j, worst, column)
      type(adhesion_work_type), intent(in) :: work
      type(adhesion_iteration_type), intent(in) :: inner
      integer, intent(in) :: corners(:, :)
      integer, intent(in) :: j
      real(dp), intent(out) :: worst
      integer, intent(out) :: column
      real(dp) :: residual(work%patch%nx)
      integer :: k

      ! r is -G on the free cells. On the others, where the gap is 0 and G is not negative, the natural residual is 0.
      associate (gap => inner%state(1:work%patch%nx, j), r => work%residual(1:work%patch%nx, j))
         residual(:) = abs(min(gap/inner%units%length, -r/inner%units%traction))
      end associate
      do k = 1, size(corners, 2)
         if (j < corners(2, k) .or. j >= corners(2, k) + side) cycle
         residual(corners(1, k):corners(1, k) + side - 1) = 0.0_dp
      end do
      column = maxloc(residual, dim=1)
      worst = residual(column)
   end subroutine find_worst

end module adhesion_spots
