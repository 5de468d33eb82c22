!> Writes the parts of a result that are known before the first row: its origin, the grid, its axes and the material.
!>
!> The file remembers the first fault of these calls, and the caller checks it once at the end
!> (see `hdf5_handle`).
module result_frame
   use asperity_precision, only : dp
   use asperity_version, only : version_number
   use hdf5_file, only : hdf5_file_type
   use hdf5_slabs, only : create_field
   use history_table, only : history_columns
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use result_history, only : create_history_columns
   use result_material, only : material_record_type, put_material
   use utc_clock, only : utc_time
   implicit none
   private

   public :: read_grid, result_plan_type, write_axes, write_frame

   character(*), parameter, public :: height_path = '/surface/height'   !! of the height of the road
   character(*), parameter, public :: axes(2) = ['x', 'y']    !! of every field, in the same group

   !> The case of a result, and the size of the result when it is complete.
   type :: result_plan_type
      character(:), allocatable :: title
      character(:), allocatable :: input             !! the namelists, verbatim
      character(:), allocatable :: settings          !! every resolved setting, one per line
      type(material_record_type) :: material
      integer :: rows = 0                            !! of the history
      integer :: snapshots = 0
      integer :: losses = 0                          !! rows of steady sliding
      integer :: compression = 0                     !! of fields, 0 none to 9 smallest
   end type result_plan_type

contains

   !> Write everything that is known before the first row. The height of the road gets no values yet: they
   !> follow in slabs of rows.
   subroutine write_frame(file, path, id, grid, plan)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path                 !! name of the file
      character(*), intent(in) :: id                   !! identity of the result
      type(grid_type), intent(in) :: grid
      type(result_plan_type), intent(in) :: plan

      ! The groups that grow are made first, in pages of their own.
      call file%open(path, 'create', alignment=4096)
      call file%create_group('/snapshots', expected=plan%snapshots)
      if (plan%losses > 0) call file%create_group('/losses', expected=plan%losses)
      if (file%has_failed()) return             ! opening the file again would discard the fault
      call file%close()
      if (file%has_failed()) return
      call file%open(path, 'append')

      call write_origin(file, id, plan)
      call write_grid(file, grid, plan%compression)
      call create_field(file, height_path, [grid%nx, grid%ny], .false., 'm', 'height of the road', &
         plan%compression)
      call write_axes(file, '/surface', grid, ['height'], plan%compression)
      call put_material(file, plan%material, plan%compression)
      call file%create_group('/history', expected=size(history_columns()) + 1)
      call create_history_columns(file, plan%rows)
   end subroutine write_frame

   !> Write the origin of the result.
   subroutine write_origin(file, id, plan)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: id                 !! identity of the result
      type(result_plan_type), intent(in) :: plan

      call file%write_attribute('/', 'title', plan%title)
      call file%write_attribute('/', 'program', 'asperity')
      call file%write_attribute('/', 'version', version_number)
      call file%write_attribute('/', 'created', utc_time())
      call file%write_attribute('/', 'id', id)
      call file%write_attribute('/', 'input', plan%input)
      call file%write_attribute('/', 'settings', plan%settings)
      call file%write_attribute('/', 'finished', 0)
      call file%write_attribute('/', 'expected_rows', plan%rows)
   end subroutine write_origin

   !> Write the grid.
   subroutine write_grid(file, grid, compression)
      type(hdf5_file_type), intent(inout) :: file
      type(grid_type), intent(in) :: grid
      integer, intent(in) :: compression             !! of vectors, see `hdf5_file`
      character(1) :: none(0)

      call write_axes(file, '/grid', grid, none, compression)
      call file%write_attribute('/grid', 'nx', grid%nx)
      call file%write_attribute('/grid', 'ny', grid%ny)
      call file%write_attribute('/grid', 'lx', grid%lx)
      call file%write_attribute('/grid', 'ly', grid%ly)
      call file%write_attribute('/grid', 'boundary', &
         trim(merge('periodic', 'free    ', grid%boundary == boundary_periodic)))
   end subroutine write_grid

   !> Read the grid.
   subroutine read_grid(file, grid)
      type(hdf5_file_type), intent(inout) :: file
      type(grid_type), intent(inout) :: grid         !! unchanged after a fault
      character(:), allocatable :: boundary
      integer :: nx, ny
      real(dp) :: lx, ly

      call file%read_attribute('/grid', 'nx', nx)
      call file%read_attribute('/grid', 'ny', ny)
      call file%read_attribute('/grid', 'lx', lx)
      call file%read_attribute('/grid', 'ly', ly)
      call file%read_attribute('/grid', 'boundary', boundary)
      if (file%has_failed()) return
      grid = new_grid(nx, ny, lx, ly, &
         merge(boundary_periodic, boundary_free, boundary == 'periodic'))
   end subroutine read_grid

   !> Write the axes of a group, and name them as the axes of its fields. Each group has axes of its
   !> own, because readers look for them beside the fields. The first field takes far more space.
   subroutine write_axes(file, group, grid, fields, compression)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: group
      type(grid_type), intent(in) :: grid
      character(*), intent(in) :: fields(:)          !! names of fields of this group
      integer, intent(in) :: compression             !! of vectors, see `hdf5_file`
      integer :: i

      call file%write(group//'/x', [(i*grid%dx, i=0, grid%nx - 1)], 'm', &
         'centres of the cells along x', compression=compression)
      call file%write(group//'/y', [(i*grid%dy, i=0, grid%ny - 1)], 'm', &
         'centres of the cells along y', compression=compression)
      call file%name_axes(group, axes, fields)
   end subroutine write_axes

end module result_frame
