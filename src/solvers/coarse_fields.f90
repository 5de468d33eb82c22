!> Fields on a coarser grid: means over its cells, and the interpolation of a pressure or another field back to the grid.
!>
!> The number of cells of the grid need not be a multiple of that of the coarser one: a coarse cell takes of a
!> cell on its edge the part that lies in it. Processes share the rows of both grids, each grid by its own rule.
module coarse_fields
   use asperity_precision, only : dp, int64
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   use row_halo, only : fetch_rows
   use transform_lengths, only : good_length
   implicit none
   private

   public :: coarse_grid, coarsen, mean_of_strips, new_row_means, refine_linearly, refine_pressure, row_means_type

   real(dp), parameter :: least_part = 1e-3_dp   !! of the nearest pressure that an interpolated one keeps at least
   integer, parameter :: usual_ratio = 4         !! cells of the grid to a cell of the coarse one along a side, about

   !> How the means over the coarse cells of a row are formed.
   type :: row_means_type
      integer, allocatable :: first(:), last(:)    !! cells that a coarse cell covers, also in part [coarse cells]
      real(dp), allocatable :: from(:), to(:)      !! the parts of the coarse cell that lie in these two
      real(dp) :: part = 1.0_dp                    !! the part that lies in any cell between them
      integer :: whole = 0                         !! cells of each coarse cell, if no cell is divided
   contains
      procedure :: take
   end type row_means_type

   !> Where the centre of a cell lies between the centres of the coarse cells along a side.
   type :: place_type
      integer :: beside(4) = 0                     !! two coarse cells before the centre, and two after it
      real(dp) :: weights(4) = 0.0_dp              !! of their values: linear, or of a cubic polynomial for a pressure
      logical :: first_half = .true.               !! the second coarse cell is the nearest one
   end type place_type

contains

   !> A grid over the same lengths with about a quarter of the cells along each side, or another part, as many as are
   !> cheap to transform. If `squarer` is true, oblong cells are joined less along their longer side.
   function coarse_grid(fine, squarer, ratio) result(coarse)
      type(grid_type), intent(in) :: fine
      logical, intent(in), optional :: squarer
      integer, intent(in), optional :: ratio       !! cells of the grid to a coarse one along a side, about; default: 4
      type(grid_type) :: coarse
      integer :: joined(2)                         !! the same along x and y

      joined = usual_ratio
      if (present(ratio)) joined = ratio
      if (present(squarer)) then
         if (squarer) joined = max(1, nint(joined*min(fine%dx, fine%dy)/[fine%dx, fine%dy]))
      end if
      coarse = new_grid(fewer(fine%nx, joined(1)), fewer(fine%ny, joined(2)), fine%lx, fine%ly, fine%boundary)
      if (fine%shared) call coarse%share_rows()

   contains

      !> The number of coarse cells along a side.
      pure integer function fewer(cells, joined)
         integer, intent(in) :: cells
         integer, intent(in) :: joined

         fewer = min(good_length(max(1, nint(real(cells, dp)/joined)), 1), cells)
      end function fewer

   end function coarse_grid

   !> Means of a field over the coarse cells. Collective.
   subroutine coarsen(fine, coarse, field, threads, means)
      type(grid_type), intent(in) :: fine, coarse
      real(dp), intent(in) :: field(fine%nx, fine%rows())
      integer, intent(in) :: threads
      real(dp), intent(out) :: means(coarse%nx, coarse%rows())
      type(row_means_type) :: row
      real(dp), allocatable :: strips(:, :)
      integer :: j

      row = new_row_means(fine%nx, coarse%nx)
      if (.not. fine%shared) then
         call take_own_rows()
         return
      end if
      allocate (strips(coarse%nx, fine%rows()))
      !$omp parallel do default(none) shared(field, strips, row) private(j) num_threads(threads)
      do j = 1, size(strips, 2)
         call row%take(field(:, j), strips(:, j))
      end do
      call mean_of_strips(fine, coarse, strips, threads, means)

   contains

      !> Form each coarse row from the rows that it covers, all of which belong to this process.
      subroutine take_own_rows()
         real(dp), allocatable :: strip(:)
         integer :: k

         !$omp parallel default(none) shared(fine, coarse, field, means, row) private(j, k, strip) num_threads(threads)
         allocate (strip(coarse%nx))
         !$omp do
         do j = 1, coarse%ny
            means(:, j) = 0.0_dp
            do k = first_cell(fine%ny, coarse%ny, j), last_cell(fine%ny, coarse%ny, j)
               call row%take(field(:, k), strip)
               means(:, j) = means(:, j) + part_of(fine%ny, coarse%ny, k, j)*strip
            end do
         end do
         !$omp end parallel
      end subroutine take_own_rows

   end subroutine coarsen

   !> Means over the rows of the coarse cells, from the means along each row of the grid. Collective.
   subroutine mean_of_strips(fine, coarse, strips, threads, means)
      type(grid_type), intent(in) :: fine, coarse
      real(dp), intent(in) :: strips(:, :)         !! [coarse%nx, fine%rows()]
      integer, intent(in) :: threads
      real(dp), intent(out) :: means(:, :)         !! [coarse%nx, coarse%rows()]
      real(dp), allocatable :: fetched(:, :)
      integer :: covered(2)

      if (.not. fine%shared) then
         call mean_over_rows(strips, 1)
         return
      end if
      covered = [1, 0]
      if (coarse%rows() > 0) covered = [first_cell(fine%ny, coarse%ny, coarse%first_row), &
         last_cell(fine%ny, coarse%ny, coarse%last_row)]
      allocate (fetched(coarse%nx, covered(2) - covered(1) + 1))
      call fetch_rows(fine, strips, covered, fetched)
      call mean_over_rows(fetched, covered(1))

   contains

      !> The coarse rows of this process, from rows of which the first is a given row of the grid.
      subroutine mean_over_rows(rows, first)
         real(dp), intent(in) :: rows(:, :)
         integer, intent(in) :: first
         integer :: j, k, row

         !$omp parallel do default(none) shared(fine, coarse, rows, first, means) private(j, k, row) &
         !$omp num_threads(threads)
         do j = 1, coarse%rows()
            row = coarse%first_row - 1 + j
            means(:, j) = 0.0_dp
            do k = first_cell(fine%ny, coarse%ny, row), last_cell(fine%ny, coarse%ny, row)
               means(:, j) = means(:, j) + part_of(fine%ny, coarse%ny, k, row)*rows(:, k - first + 1)
            end do
         end do
      end subroutine mean_over_rows

   end subroutine mean_of_strips

   !> Prepare the means along rows of n cells over a smaller number of coarse cells.
   pure function new_row_means(n, coarse) result(self)
      integer, intent(in) :: n, coarse
      type(row_means_type) :: self
      integer :: i

      self%first = first_cell(n, coarse, [(i, i=1, coarse)])
      self%last = last_cell(n, coarse, [(i, i=1, coarse)])
      self%from = part_of(n, coarse, self%first, [(i, i=1, coarse)])
      self%to = part_of(n, coarse, self%last, [(i, i=1, coarse)])
      where (self%last == self%first) self%to = 0.0_dp
      self%part = real(coarse, dp)/n
      if (mod(n, coarse) == 0) self%whole = n/coarse
   end function new_row_means

   !> Take the means of the values of a row over its coarse cells.
   pure subroutine take(self, values, means)
      class(row_means_type), intent(in) :: self
      real(dp), intent(in), contiguous :: values(:)
      real(dp), intent(out), contiguous :: means(:)
      real(dp) :: between
      integer :: i, k

      if (self%whole > 0) then
         call take_whole_cells(self%whole, size(means), values, means)
         return
      end if
      do i = 1, size(means)
         between = 0.0_dp
         do k = self%first(i) + 1, self%last(i) - 1
            between = between + values(k)
         end do
         means(i) = self%from(i)*values(self%first(i)) + self%part*between + self%to(i)*values(self%last(i))
      end do
   end subroutine take

   !> Take the means over coarse cells of n whole cells each. The usual numbers are written out, because the compiler then
   !> forms several means at once.
   pure subroutine take_whole_cells(n, count, values, means)
      integer, intent(in) :: n, count
      real(dp), intent(in) :: values(n, count)
      real(dp), intent(out) :: means(count)
      integer :: i

      select case (n)
      case (2)
         !$omp simd
         do i = 1, count
            means(i) = 0.5_dp*(values(1, i) + values(2, i))
         end do
      case (4)
         !$omp simd
         do i = 1, count
            means(i) = 0.25_dp*((values(1, i) + values(2, i)) + (values(3, i) + values(4, i)))
         end do
      case default
         means(:) = sum(values, dim=1)/n
      end select
   end subroutine take_whole_cells

   !> The first of n cells that a coarse cell covers, also in part.
   elemental integer function first_cell(n, coarse, cell)
      integer, intent(in) :: n, coarse             !! cells of the two grids along the side
      integer, intent(in) :: cell                  !! of the coarse grid, from 1

      first_cell = int(int(cell - 1, int64)*n/coarse) + 1
   end function first_cell

   !> The last of n cells that a coarse cell covers, also in part.
   elemental integer function last_cell(n, coarse, cell)
      integer, intent(in) :: n, coarse             !! cells of the two grids along the side
      integer, intent(in) :: cell                  !! of the coarse grid, from 1

      last_cell = int((int(cell, int64)*n + coarse - 1)/coarse)
   end function last_cell

   !> The part of a coarse cell that lies in cell k of n.
   elemental real(dp) function part_of(n, coarse, k, cell)
      integer, intent(in) :: n, coarse             !! cells of the two grids along the side
      integer, intent(in) :: k                     !! of the grid, from 1
      integer, intent(in) :: cell                  !! of the coarse grid, from 1

      associate (fine_end => int(k, int64)*coarse, coarse_end => int(cell, int64)*n)
         part_of = real(min(fine_end, coarse_end) - max(fine_end - coarse, coarse_end - n), dp)/n
      end associate
   end function part_of

   !> Interpolate a pressure of the coarse grid between the centres of its cells by cubic polynomials: linear ones
   !> would lose much of the shortest waves, which span four coarse cells if the waves of the road span sixteen of the
   !> grid. The pressure is positive on exactly those coarse cells that touch: interpolated pressure would widen the
   !> contact by half a coarse cell.
   !>
   !> Where a contact reaches the edge of a free map, its pressure is like that under the edge of a punch, and grows as
   !> d^(-1/2) with the distance d from the edge. Its ratio to this is interpolated there, and goes on beyond the edge. Collective.
   subroutine refine_pressure(coarse, fine, values, threads, pressure)
      type(grid_type), intent(in) :: coarse, fine
      real(dp), intent(in) :: values(:, :)         !! [coarse%nx, coarse%rows()], Pa
      integer, intent(in) :: threads
      real(dp), intent(out) :: pressure(:, :)      !! [fine%nx, fine%rows()], Pa

      call refine(coarse, fine, values, threads, .true., pressure)
   end subroutine refine_pressure

   !> Interpolate a field of the coarse grid linearly between the centres of its cells. Beyond a free grid it is 0.
   !> Collective.
   subroutine refine_linearly(coarse, fine, values, threads, field)
      type(grid_type), intent(in) :: coarse, fine
      real(dp), intent(in) :: values(:, :)         !! [coarse%nx, coarse%rows()]
      integer, intent(in) :: threads
      real(dp), intent(out) :: field(:, :)         !! [fine%nx, fine%rows()]

      call refine(coarse, fine, values, threads, .false., field)
   end subroutine refine_linearly

   !> Interpolate a pressure or any other field between the centres of the coarse cells. Collective.
   subroutine refine(coarse, fine, values, threads, is_pressure, field)
      type(grid_type), intent(in) :: coarse, fine
      real(dp), intent(in) :: values(:, :)         !! [coarse%nx, coarse%rows()]
      integer, intent(in) :: threads
      logical, intent(in) :: is_pressure
      real(dp), intent(out) :: field(:, :)         !! [fine%nx, fine%rows()]
      real(dp), allocatable :: rows(:, :), between(:)
      type(place_type), allocatable :: along_x(:)
      type(place_type) :: place
      logical :: has_edges
      integer :: range(2), i, j

      has_edges = is_pressure .and. coarse%boundary /= boundary_periodic
      range = [1, 0]
      if (fine%rows() > 0) range = [below_centre(fine%ny, coarse%ny, fine%first_row) - 1, &
         below_centre(fine%ny, coarse%ny, fine%last_row) + 2]
      if (has_edges) range = [max(range(1), 1), min(range(2), coarse%ny)]
      allocate (rows(coarse%nx, range(1):range(2)))
      call fetch_rows(coarse, values, range, rows)
      along_x = [(place_of_cell(coarse%nx, fine%nx, i, is_pressure, has_edges), i=1, fine%nx)]
      do i = 1, fine%nx
         along_x(i)%beside = coarse%column_at(along_x(i)%beside)
      end do

      !$omp parallel default(none) shared(coarse, fine, rows, is_pressure, has_edges, field, along_x) &
      !$omp private(i, j, place, between) num_threads(threads)
      allocate (between(0:coarse%nx), source=0.0_dp)
      !$omp do
      do j = 1, fine%rows()
         place = place_of_cell(coarse%ny, fine%ny, fine%first_row - 1 + j, is_pressure, has_edges)
         do i = 1, coarse%nx
            between(i) = interpolate(place, is_pressure, rows(i, place%beside(1)), rows(i, place%beside(2)), &
               rows(i, place%beside(3)), rows(i, place%beside(4)))
         end do
         do i = 1, fine%nx
            associate (at => along_x(i)%beside)
               field(i, j) = interpolate(along_x(i), is_pressure, between(at(1)), between(at(2)), between(at(3)), &
                  between(at(4)))
            end associate
         end do
      end do
      !$omp end parallel
   end subroutine refine

   !> The place of the centre of cell k of n between those of the coarse cells along a side.
   pure function place_of_cell(coarse, n, k, is_pressure, has_edges) result(place)
      integer, intent(in) :: coarse, n, k
      logical, intent(in) :: is_pressure
      logical, intent(in) :: has_edges             !! its pressure is like that of a punch there
      type(place_type) :: place
      real(dp) :: t, curved
      integer :: i

      place%beside = below_centre(n, coarse, k) + [(i, i=-1, 2)]
      t = part_above(n, coarse, k)
      place%first_half = t < 0.5_dp
      place%weights = [0.0_dp, 1.0_dp - t, t, 0.0_dp]
      if (.not. is_pressure) return
      curved = t*(1.0_dp - t)/6.0_dp
      place%weights = place%weights - curved*((2.0_dp - t)*[1.0_dp, -2.0_dp, 1.0_dp, 0.0_dp] &
         + (1.0_dp + t)*[0.0_dp, 1.0_dp, -2.0_dp, 1.0_dp])
      if (.not. has_edges) return
      place%beside = min(max(place%beside, 1), coarse)
      place%weights = place%weights*edge_pressure(n, k)/edge_pressure(coarse, place%beside)
   end function place_of_cell

   !> Mean pressure of cell k of n under a punch between edges at both ends, but for a factor: that of d^(-1/2) for one edge
   !> times that for the other.
   elemental real(dp) function edge_pressure(n, k)
      integer, intent(in) :: n, k

      edge_pressure = n*root_step(k)*root_step(n + 1 - k)

   contains

      pure real(dp) function root_step(distance)
         integer, intent(in) :: distance           !! of the cell from the edge, from 1

         root_step = sqrt(real(distance, dp)) - sqrt(real(distance - 1, dp))
      end function root_step

   end function edge_pressure

   !> Interpolate between four equidistant values. A pressure is 0 where the nearest one is 0, and positive elsewhere.
   pure function interpolate(place, is_pressure, before, below, above, beyond) result(value)
      type(place_type), intent(in) :: place
      logical, intent(in) :: is_pressure
      real(dp), intent(in) :: before, below, above, beyond
      real(dp) :: value
      real(dp) :: nearest

      value = (place%weights(1)*before + place%weights(4)*beyond) + (place%weights(2)*below + place%weights(3)*above)
      if (.not. is_pressure) return
      nearest = merge(below, above, place%first_half)
      value = merge(max(value, least_part*nearest), 0.0_dp, nearest > 0.0_dp)
   end function interpolate

   !> The last coarse cell whose centre does not lie beyond that of cell k of n; 0 before the first centre.
   elemental integer function below_centre(n, coarse, k)
      integer, intent(in) :: n, coarse             !! cells of the two grids along the side
      integer, intent(in) :: k                     !! of the grid, from 1

      ! The centre is at (2 k - 1) coarse/(2 n) coarse cells from the edge, and coarse cell m at m - 1/2.
      below_centre = int(((2_int64*k - 1)*coarse + n)/(2_int64*n))
   end function below_centre

   !> How far the centre of cell k of n lies from the coarse centre below it towards the next one, 0 to 1.
   elemental real(dp) function part_above(n, coarse, k)
      integer, intent(in) :: n, coarse             !! cells of the two grids along the side
      integer, intent(in) :: k                     !! of the grid, from 1

      associate (place => (2_int64*k - 1)*coarse + n)
         part_above = real(modulo(place, 2_int64*n), dp)/(2.0_dp*n)
      end associate
   end function part_above

end module coarse_fields
