!> The cells of each row that are in contact, and copies between whole rows and rows of these cells alone.
!>
!> The tangential solver passes over its fields many times, and only the cells in contact matter. Its fields therefore
!> contain these cells alone: those of a row stand one behind the other, and zeros fill the row up to the `width`. Only
!> the transforms take whole rows. The width is the same in all rows of all processes, so that the rounding of a sum
!> along a row does not depend on the process that has the row.
!>
!> In a row, the cells in contact form runs of neighbouring cells. Runs are copied by loops without indices, which the
!> compiler can vectorise.
module contact_runs
   use asperity_parallel, only : global_max
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: contact_runs_type, find_runs

   integer, parameter :: multiple = 16      !! the width is a multiple of this, so that it seldom changes from solve to solve

   !> The runs of all rows.
   type :: contact_runs_type
      integer :: width = 0                       !! cells of a row of contact, with those that fill it up
      integer, allocatable :: number(:)          !! [rows] of runs
      integer, allocatable :: ends(:, :, :)      !! [2, most runs, rows] the first and the last cell of each run
   contains
      procedure :: gather
      procedure :: spread
   end type contact_runs_type

contains

   !> Find the runs of the cells whose state is not 0. Collective.
   subroutine find_runs(self, state, threads)
      type(contact_runs_type), intent(inout) :: self
      integer(int8), intent(in), contiguous :: state(:, :)       !! [nx, rows]
      integer, intent(in) :: threads
      integer, allocatable :: cells(:), runs(:)
      integer :: j, most

      allocate (cells(size(state, 2)), runs(size(state, 2)))
      !$omp parallel do default(none) shared(state, cells, runs) private(j) num_threads(threads)
      do j = 1, size(state, 2)
         cells(j) = count(state(:, j) /= 0)
         runs(j) = count_runs(state(:, j))
      end do
      self%width = nint(global_max(real(max(maxval(cells), 1), dp)))
      self%width = min(size(state, 1), multiple*((self%width + multiple - 1)/multiple))
      self%number = runs

      most = max(maxval(runs), 1)
      if (allocated(self%ends)) then
         if (size(self%ends, 2) < most .or. size(self%ends, 3) /= size(runs)) deallocate (self%ends)
      end if
      if (.not. allocated(self%ends)) allocate (self%ends(2, most, size(runs)))
      !$omp parallel do default(none) shared(self, state) private(j) num_threads(threads)
      do j = 1, size(state, 2)
         call list_runs(state(:, j), self%ends(:, :, j))
      end do
   end subroutine find_runs

   !> Number of the runs of a row.
   pure integer function count_runs(state)
      integer(int8), intent(in), contiguous :: state(:)

      count_runs = merge(1, 0, state(1) /= 0) + count(state(2:) /= 0 .and. state(:size(state) - 1) == 0)
   end function count_runs

   !> List the first and the last cell of each run of a row.
   pure subroutine list_runs(state, ends)
      integer(int8), intent(in), contiguous :: state(:)
      integer, intent(inout), contiguous :: ends(:, :)           !! [2, most runs]
      integer :: i, n
      logical :: inside

      n = 0
      inside = .false.
      do i = 1, size(state)
         if (state(i) /= 0 .and. .not. inside) then
            n = n + 1
            ends(1, n) = i
         end if
         inside = state(i) /= 0
         if (inside) ends(2, n) = i
      end do
   end subroutine list_runs

   !> Copy the cells in contact of a whole row to a row of contact, and fill this up with zeros.
   pure subroutine gather(self, j, whole, row)
      class(contact_runs_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: whole(:)     !! [nx]
      real(dp), intent(out), contiguous :: row(:)      !! [width]
      integer :: first, i, k, n

      k = 0
      do n = 1, self%number(j)
         first = self%ends(1, n, j) - 1
         do i = 1, self%ends(2, n, j) - first
            row(k + i) = whole(first + i)
         end do
         k = k + self%ends(2, n, j) - first
      end do
      row(k + 1:) = 0.0_dp
   end subroutine gather

   !> Copy a row of contact to the cells in contact of a whole row, whose other cells become 0.
   pure subroutine spread(self, j, row, whole)
      class(contact_runs_type), intent(in) :: self
      integer, intent(in) :: j
      real(dp), intent(in), contiguous :: row(:)       !! [width]
      real(dp), intent(out), contiguous :: whole(:)    !! [nx]
      integer :: done, first, i, k, n

      k = 0
      done = 0
      do n = 1, self%number(j)
         first = self%ends(1, n, j) - 1
         whole(done + 1:first) = 0.0_dp
         done = self%ends(2, n, j)
         do i = 1, done - first
            whole(first + i) = row(k + i)
         end do
         k = k + done - first
      end do
      whole(done + 1:) = 0.0_dp
   end subroutine spread

end module contact_runs
