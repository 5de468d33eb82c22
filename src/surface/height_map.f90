!> Height maps from files.
!>
!> A map is read in slabs of rows. Where processes share the rows of the grid, the first one reads the slabs
!> and sends the rows to the processes that hold them, so that no process ever holds a whole map.
!>
!> Memory: about 1 MiB for a slab, and for HDF5 a row of chunks of the file.
module height_map
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_checksum, only : checksum_of_checksums, checksums_of_rows
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : is_first_process, share
   use asperity_precision, only : dp, int64
   use hdf5_field, only : field_reader_type
   use hdf5_slabs, only : slab_rows
   use process_agreement, only : agree
   use regular_grid, only : grid_type
   use row_slabs, only : deal_rows, own_part
   use surface_settings, only : surface_settings_type
   implicit none
   private

   public :: add_map, check_map, checksum_of_map

   !> A map that is being read. The reader remembers its first error: later calls then read zeros, or nothing, and
   !> the caller checks the error once, at the end.
   type :: map_reader_type
      type(field_reader_type) :: field
      real(dp) :: scale = 1.0_dp
      integer(int64) :: faulty = 0                       !! values so far that are not finite
      integer :: place(2) = 0                            !! i, j of the first of them, from 1
      integer(int64), allocatable :: rows(:)             !! checksums of the rows so far
      type(error_type), allocatable :: error             !! the first error
   contains
      procedure :: open => open_map
      procedure :: read => read_rows
      procedure :: read_all
      procedure :: finish
   end type map_reader_type

contains

   !> Add the map of a term, times its scale. Collective where processes share the rows: an error reaches
   !> all of them.
   subroutine add_map(grid, term, height, map_checksum, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term    !! checked
      real(dp), intent(inout) :: height(:, :)            !! m, shape [nx, rows]
      integer(int64), intent(out) :: map_checksum        !! of the map in the file, before scaling
      type(error_type), allocatable, intent(out) :: error
      type(map_reader_type) :: map
      real(dp), allocatable :: slab(:, :)
      logical :: reads
      integer :: first, rows, part(2)

      map_checksum = 0_int64
      reads = is_first_process() .or. .not. grid%shared
      if (reads) call map%open(trim(term%file), trim(term%dataset), [grid%nx, grid%ny], term%scale)
      allocate (slab(grid%nx, min(slab_rows(grid%nx), grid%ny)))
      do first = 1, grid%ny, size(slab, 2)
         rows = min(size(slab, 2), grid%ny - first + 1)
         if (reads) call map%read(first, slab(:, :rows))
         if (grid%shared) call deal_rows(grid, first, slab(:, :rows))
         part = own_part(grid, first, rows)
         if (part(1) > part(2)) cycle
         call add_rows(term%scale, slab(:, part(1) - first + 1:part(2) - first + 1), &
            height(:, part(1) - grid%first_row + 1:part(2) - grid%first_row + 1))
      end do
      if (reads) call map%finish(term, map_checksum, error)
      if (.not. grid%shared) return
      call agree(error)
      call share(map_checksum)
   end subroutine add_map

   !> Add rows of the map, times the scale, to the height.
   subroutine add_rows(scale, rows, height)
      real(dp), intent(in) :: scale
      real(dp), intent(in) :: rows(:, :)
      real(dp), intent(inout) :: height(:, :)            !! m, as many rows
      integer :: j

      !$omp parallel do default(none) shared(scale, rows, height)
      do j = 1, size(height, 2)
         height(:, j) = height(:, j) + scale*rows(:, j)
      end do
   end subroutine add_rows

   !> Check that the map of a term can be used, by reading it.
   subroutine check_map(grid, term, error)
      type(grid_type), intent(in) :: grid
      type(surface_settings_type), intent(in) :: term    !! checked
      type(error_type), allocatable, intent(out) :: error
      type(map_reader_type) :: map
      integer(int64) :: ignored

      call map%open(trim(term%file), trim(term%dataset), [grid%nx, grid%ny], term%scale)
      call map%read_all()
      call map%finish(term, ignored, error)
   end subroutine check_map

   !> Checksum of a map, even if some of its values are not finite.
   subroutine checksum_of_map(path, dataset, extent, checksum, error)
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset                !! '': 'surface/height' or 'surface'
      integer, intent(in) :: extent(2)                   !! nx, ny that the map must have
      integer(int64), intent(out) :: checksum
      type(error_type), allocatable, intent(out) :: error
      type(map_reader_type) :: map

      call map%open(path, dataset, extent, 1.0_dp)
      call map%read_all()
      call map%field%close()
      checksum = checksum_of_checksums(extent(1), map%rows)
      if (allocated(map%error)) call move_alloc(map%error, error)
   end subroutine checksum_of_map

   !> Open a map, and check its shape.
   subroutine open_map(self, path, dataset, extent, scale)
      class(map_reader_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset                !! '': 'surface/height' or 'surface'
      integer, intent(in) :: extent(2)                   !! nx, ny that the map must have
      real(dp), intent(in) :: scale                      !! factor of the heights
      character(160) :: text

      self%scale = scale
      allocate (self%rows(extent(2)), source=0_int64)
      call self%field%open(path, dataset, extent, self%error)
      if (allocated(self%error)) return
      if (all(self%field%extent == extent)) return
      write (text, '(4(a, i0), a)') 'the height map has the shape (', self%field%extent(2), ', ', &
         self%field%extent(1), '): must be (ny, nx) = (', extent(2), ', ', extent(1), ')'
      call fail(self%error, error_input, path//': '//trim(text))
   end subroutine open_map

   !> Read some rows; they are 0 after an error.
   subroutine read_rows(self, first, values)
      class(map_reader_type), intent(inout) :: self
      integer, intent(in) :: first                       !! the first of them, from 1
      real(dp), intent(out), contiguous :: values(:, :)  !! [nx, rows], as in the file, not scaled
      integer(int64) :: faulty
      integer :: j

      if (.not. allocated(self%error)) call self%field%read(first, values, self%error)
      if (allocated(self%error)) values = 0.0_dp
      faulty = 0
      !$omp parallel do default(none) shared(self, values) reduction(+:faulty)
      do j = 1, size(values, 2)
         faulty = faulty + count(.not. ieee_is_finite(self%scale*values(:, j)))
      end do
      if (self%faulty == 0 .and. faulty > 0) self%place = first_faulty(self%scale, first, values)
      self%faulty = self%faulty + faulty
      self%rows(first:first + size(values, 2) - 1) = checksums_of_rows(values)
   end subroutine read_rows

   !> Place i, j of the first value that is not finite.
   pure function first_faulty(scale, first, values) result(place)
      real(dp), intent(in) :: scale
      integer, intent(in) :: first                       !! row of the first values, from 1
      real(dp), intent(in) :: values(:, :)               !! [nx, rows], not scaled
      integer :: place(2)
      integer :: i, j

      place = 0
      do j = 1, size(values, 2)
         do i = 1, size(values, 1)
            if (ieee_is_finite(scale*values(i, j))) cycle
            place = [i, first + j - 1]
            return
         end do
      end do
   end function first_faulty

   !> Read all rows, to compute their checksums and to count the values that are not finite.
   subroutine read_all(self)
      class(map_reader_type), intent(inout) :: self
      real(dp), allocatable :: slab(:, :)
      integer :: first, rows

      if (allocated(self%error)) return
      associate (extent => self%field%extent)
         allocate (slab(extent(1), min(slab_rows(extent(1)), extent(2))))
         do first = 1, extent(2), size(slab, 2)
            rows = min(size(slab, 2), extent(2) - first + 1)
            call self%read(first, slab(:, :rows))
         end do
      end associate
   end subroutine read_all

   !> Close the file, and report the first error, or how many values are not finite.
   subroutine finish(self, term, checksum, error)
      class(map_reader_type), intent(inout) :: self
      type(surface_settings_type), intent(in) :: term
      integer(int64), intent(out) :: checksum            !! of the map
      type(error_type), allocatable, intent(out) :: error
      character(160) :: text, place

      checksum = checksum_of_checksums(self%field%extent(1), self%rows)
      call self%field%close()
      if (allocated(self%error)) then
         call move_alloc(self%error, error)
         error%message = map_fault(term, error%message)
      else if (self%faulty > 0) then
         text = 'the height map has a value that is not finite'
         if (self%faulty > 1) write (text, '(a, i0, a)') 'the height map has ', self%faulty, &
            ' values that are not finite'
         write (place, '(a, 2(i0, a))') ' at [', self%place(2) - 1, ', ', self%place(1) - 1, &
            '] (row, column; from 0)'
         if (self%faulty > 1) place = ', the first'//place
         call fail(error, error_input, map_fault(term, trim(text)//' (NaN or infinite)'//trim(place)// &
            ': all must be numbers, in m'))
      end if
   end subroutine finish

   !> The message about a map: first the place in the input that names its file, then what is wrong.
   pure function map_fault(term, message) result(fault)
      type(surface_settings_type), intent(in) :: term
      character(*), intent(in) :: message                !! may start with the file's name
      character(:), allocatable :: fault
      character(16) :: line
      integer :: first

      first = 1
      if (index(message, trim(term%file)//': ') == 1) first = len_trim(term%file) + 3
      fault = trim(term%place)//': file = '''//trim(term%file)//''': '//message(first:)
      if (index(message, 'is not an HDF5 file') > 0) fault = fault//'; `asperity import` makes one of a map in another format'
      if (index(message, 'there is no dataset') > 0) fault = fault//'; `dataset` names the one with the heights'
      if (term%line > 0) then
         write (line, '(a, i0, a)') ' (line ', term%line, ')'
         fault = fault//trim(line)
      end if
   end function map_fault

end module height_map
