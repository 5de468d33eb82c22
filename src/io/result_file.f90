!> The result of a run: one HDF5 file, written step by step, readable at any moment.
!>
!> A file is built under the name FILE.new and takes its place with everything but the history's
!> rows in it. A row counts when all columns have it: readers take the shortest column.
!> A snapshot appears whole (see `hdf5_tree`), and then in the XDMF file beside the result.
module result_file
   use asperity_errors, only : error_file, error_input, error_type, fail
   use file_system, only : name_of, remove_file, rename_file
   use hdf5_file, only : hdf5_file_type
   use history_row, only : column_count, history_row_type, row_values
   use asperity_precision, only : dp, int8
   use random_id, only : new_id
   use result_history, only : append_values, count_history_rows, create_history_columns, shorten_history
   use result_names, only : sibling_path
   use result_target, only : check_place
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use utc_clock, only : utc_time
   use asperity_version, only : version_number
   use xdmf, only : snapshot_name, snapshot_type, write_xdmf
   implicit none
   private

   public :: result_file_type

   character(*), parameter :: stop_mark = 'at_stop'   !! attribute of a snapshot that a stop wrote
   character(*), parameter :: axes(2) = ['x', 'y']    !! of every field, beside it in its group

   !> What a snapshot may hold.
   type :: field_type
      character(24) :: name
      character(4) :: units
      character(80) :: long_name
   end type field_type

   type(field_type), parameter :: known_fields(*) = [ &
      field_type('pressure', 'Pa', 'normal traction on the rubber, pressure positive'), &
      field_type('gap', 'm', 'gap between rubber and road'), &
      field_type('displacement_z', 'm', 'displacement of the rubber along z'), &
      field_type('road_height', 'm', 'height of the road as it stands under the rubber'), &
      field_type('traction_x', 'Pa', 'tangential traction on the rubber along x'), &
      field_type('traction_y', 'Pa', 'tangential traction on the rubber along y'), &
      field_type('displacement_x', 'm', 'displacement of the rubber along x'), &
      field_type('displacement_y', 'm', 'displacement of the rubber along y'), &
      field_type('slip_x', 'm', 'slip of the step along x'), &
      field_type('slip_y', 'm', 'slip of the step along y'), &
      field_type('contact', '1', 'state of contact: 0 open, 1 stick, 2 slip')]

   !> An open result.
   type :: result_file_type
      private
      type(hdf5_file_type) :: file
      type(grid_type) :: grid
      integer :: expected_rows = 0
      integer :: compression = 0
      character(:), allocatable :: xdmf_path
      type(snapshot_type), allocatable :: snapshots(:)
      type(snapshot_type) :: current                 !! the snapshot under construction
      character(:), allocatable :: current_path
      character(:), allocatable, public :: path      !! name of the file
      character(:), allocatable, public :: id        !! identity, which a checkpoint names
      integer, public :: rows = 0                    !! rows of the history
      integer, public :: expected_losses = 0         !! rows of steady sliding when it is complete
   contains
      procedure :: create => create_result
      procedure :: reopen => reopen_result
      procedure :: write_text
      procedure :: read_text
      procedure :: pair_arms
      procedure :: append_row
      procedure :: begin_snapshot
      procedure, private :: write_real_field, write_state_field, write_material_value, &
         write_material_values, start_field
      !> Write a field into the snapshot under construction.
      generic :: write_field => write_real_field, write_state_field
      !> Write a number or numbers into /material.
      generic :: write_material => write_material_value, write_material_values
      procedure :: end_snapshot
      procedure :: write_losses
      procedure :: last_snapshot
      procedure :: link_checkpoint
      procedure :: unlink_checkpoint
      procedure :: finish => finish_result
      procedure :: close => close_result
   end type result_file_type

contains

   !> Start a result; one of the same name is replaced, and its checkpoint removed.
   subroutine create_result(self, path, title, input, settings, grid, height, expected_rows, &
      expected_snapshots, compression, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: path               !! name of the file
      character(*), intent(in) :: title
      character(*), intent(in) :: input              !! the namelists, verbatim
      character(*), intent(in) :: settings           !! every resolved setting, one a line
      type(grid_type), intent(in) :: grid
      real(dp), intent(in), contiguous :: height(:, :) !! height map before any sliding, m [nx, ny]
      integer, intent(in) :: expected_rows           !! rows of the history when it is complete
      integer, intent(in) :: expected_snapshots      !! snapshots when it is complete
      integer, intent(in) :: compression             !! of fields, 0 none to 9 smallest
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: temporary
      type(error_type), allocatable :: closing

      self%grid = grid
      self%expected_rows = expected_rows
      self%compression = compression
      self%rows = 0
      self%path = trim(path)
      self%id = new_id()
      self%xdmf_path = sibling_path(path, '.xdmf')
      if (allocated(self%snapshots)) deallocate (self%snapshots)
      allocate (self%snapshots(0))

      call check_place(self%path, error)
      if (allocated(error)) return
      temporary = self%path//'.new'
      ! The group that grows is made first, in pages of its own.
      call self%file%open(temporary, 'create', error, alignment=4096)
      if (.not. allocated(error)) call self%file%create_group('/snapshots', error, &
         expected_snapshots)
      if (.not. allocated(error) .and. self%expected_losses > 0) &
         call self%file%create_group('/losses', error, self%expected_losses)
      if (.not. allocated(error)) call self%file%close(error)
      if (.not. allocated(error)) call self%file%open(temporary, 'append', error)
      if (.not. allocated(error)) call write_frame(self, title, input, settings, height, error)
      if (allocated(error)) then
         ! The user knows the file by its own name.
         if (index(error%message, temporary//':') == 1) &
            error%message = self%path//error%message(len(temporary) + 1:)
         call self%file%close(closing)
         call remove_file(temporary)
         return
      end if
      call remove_file(sibling_path(path, '.checkpoint.h5'))
      call remove_file(self%xdmf_path)
      call rename_file(temporary, self%path, error)
      if (allocated(error)) return
      self%file%path = self%path
   end subroutine create_result

   !> Everything that is known before the first row, but for the material's numbers.
   subroutine write_frame(self, title, input, settings, height, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: title, input, settings
      real(dp), intent(in), contiguous :: height(:, :)
      type(error_type), allocatable, intent(out) :: error

      call write_origin(self, title, input, settings, error)
      if (allocated(error)) return
      call write_grid(self, error)
      if (allocated(error)) return
      call self%file%write('/surface/height', height, 'm', 'height of the road', error, &
         self%compression)
      if (allocated(error)) return
      call write_axes(self, '/surface', ['height'], error)
      if (allocated(error)) return
      call self%file%create_group('/material', error)
      if (allocated(error)) return
      call self%file%create_group('/history', error, column_count + 1)
      if (allocated(error)) return
      call create_history_columns(self%file, self%expected_rows, error)
      if (allocated(error)) return
      ! Made and removed: the root group keeps the room for this name.
      call self%link_checkpoint(error)
      if (allocated(error)) return
      call self%unlink_checkpoint(error)
   end subroutine write_frame

   !> Where the result comes from.
   subroutine write_origin(self, title, input, settings, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: title, input, settings
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', 'title', title, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'program', 'asperity', error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'version', version_number, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'created', utc_time(), error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'id', self%id, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'input', input, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'settings', settings, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'finished', 0, error)
      if (allocated(error)) return
      call self%file%write_attribute('/', 'expected_rows', self%expected_rows, error)
   end subroutine write_origin

   !> Write the grid.
   subroutine write_grid(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(1) :: none(0)

      associate (grid => self%grid)
         call write_axes(self, '/grid', none, error)
         if (allocated(error)) return
         call self%file%write_attribute('/grid', 'nx', grid%nx, error)
         if (allocated(error)) return
         call self%file%write_attribute('/grid', 'ny', grid%ny, error)
         if (allocated(error)) return
         call self%file%write_attribute('/grid', 'lx', grid%lx, error)
         if (allocated(error)) return
         call self%file%write_attribute('/grid', 'ly', grid%ly, error)
         if (allocated(error)) return
         call self%file%write_attribute('/grid', 'boundary', &
            trim(merge('periodic', 'free    ', grid%boundary == boundary_periodic)), error)
      end associate
   end subroutine write_grid

   !> Write the axes of a group and say of its fields that they have them. Each group has axes of its
   !> own, since readers look for them beside the fields; the first field takes far more room.
   subroutine write_axes(self, group, fields, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: group
      character(*), intent(in) :: fields(:)          !! names of fields of this group
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      associate (grid => self%grid)
         call self%file%write(group//'/x', [(i*grid%dx, i=0, grid%nx - 1)], 'm', &
            'centres of the cells along x', error, self%compression)
         if (allocated(error)) return
         call self%file%write(group//'/y', [(i*grid%dy, i=0, grid%ny - 1)], 'm', &
            'centres of the cells along y', error, self%compression)
      end associate
      if (allocated(error)) return
      call self%file%name_axes(group, axes, fields, error)
   end subroutine write_axes

   !> Read the grid of a result.
   subroutine read_grid(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: nx, ny
      real(dp) :: lx, ly
      character(:), allocatable :: boundary

      call self%file%read_attribute('/grid', 'nx', nx, error)
      if (allocated(error)) return
      call self%file%read_attribute('/grid', 'ny', ny, error)
      if (allocated(error)) return
      call self%file%read_attribute('/grid', 'lx', lx, error)
      if (allocated(error)) return
      call self%file%read_attribute('/grid', 'ly', ly, error)
      if (allocated(error)) return
      call self%file%read_attribute('/grid', 'boundary', boundary, error)
      if (allocated(error)) return
      self%grid = new_grid(nx, ny, lx, ly, &
         merge(boundary_periodic, boundary_free, boundary == 'periodic'))
   end subroutine read_grid

   !> Write a text as an attribute of the file, such as the name of a case.
   subroutine write_text(self, name, value, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: value
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', name, value, error)
   end subroutine write_text

   !> A text attribute of the result; empty where there is none.
   subroutine read_text(self, name, value, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error

      value = ''
      if (self%file%has_attribute('/', name)) call self%file%read_attribute('/', name, value, error)
   end subroutine read_text

   !> Write a number of the material; before the first row.
   subroutine write_material_value(self, name, value, units, long_name, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name      !! such as 'poisson'
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error

      call self%file%write('/material/'//name, value, units, long_name, error)
   end subroutine write_material_value

   !> Write numbers of the material, such as the moduli of its arms; before the first row.
   subroutine write_material_values(self, name, values, units, long_name, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name      !! such as 'prony_g'
      real(dp), intent(in), contiguous :: values(:)
      character(*), intent(in) :: units
      character(*), intent(in) :: long_name
      type(error_type), allocatable, intent(out) :: error

      call self%file%write('/material/'//name, values, units, long_name, error, self%compression)
   end subroutine write_material_values

   !> Say that the moduli of the arms go with their relaxation times; both are written.
   subroutine pair_arms(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%name_axes('/material', ['prony_tau'], ['prony_g'], error)
   end subroutine pair_arms

   !> Add a row to the history; afterwards a kill cannot take it away.
   subroutine append_row(self, row, error)
      class(result_file_type), intent(inout) :: self
      type(history_row_type), intent(in) :: row
      type(error_type), allocatable, intent(out) :: error

      if (self%rows == 0) then
         ! The first row sets the columns' space aside, which takes several blocks of the file:
         ! it is written into a new group that takes the empty one's place.
         call self%file%flush(error)
         if (allocated(error)) return
         call self%file%stage_group('/history', error)
         if (allocated(error)) return
         call create_history_columns(self%file, self%expected_rows, error)
         if (allocated(error)) return
      end if
      call append_values(self%file, self%rows, row_values(row), error)
      if (allocated(error)) return
      if (self%rows == 0) then
         call self%file%publish_group(error)
      else
         call self%file%flush(error)
      end if
      if (allocated(error)) return
      self%rows = self%rows + 1
   end subroutine append_row

   !> Start a snapshot.
   subroutine begin_snapshot(self, step, time, phase, error, at_stop)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: step           !! row of the history
      real(dp), intent(in) :: time          !! s
      integer, intent(in) :: phase          !! number of the phase, from 1
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: at_stop   !! for a stop only: a restart drops it; default no

      self%current_path = '/snapshots/'//snapshot_name(step)
      self%current%step = step
      self%current%time = time
      if (allocated(self%current%fields)) deallocate (self%current%fields)
      allocate (self%current%fields(0))
      call self%file%stage_group(self%current_path, error)
      if (allocated(error)) return
      call self%file%write_attribute(self%current_path, 'step', step, error)
      if (allocated(error)) return
      call self%file%write_attribute(self%current_path, 'time', time, error)
      if (allocated(error)) return
      call self%file%write_attribute(self%current_path, 'phase', phase, error)
      if (allocated(error) .or. .not. present(at_stop)) return
      if (at_stop) call self%file%write_attribute(self%current_path, stop_mark, 1, error)
   end subroutine begin_snapshot

   !> Look a field's name up, and note it.
   subroutine start_field(self, name, known, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name
      type(field_type), intent(out) :: known
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(known_fields)
         if (known_fields(i)%name == name) then
            known = known_fields(i)
            self%current%fields = [character(24) :: self%current%fields, name]
            return
         end if
      end do
      call fail(error, error_input, 'snapshots have no field "'//trim(name)//'"')
   end subroutine start_field

   !> Write a field of reals.
   subroutine write_real_field(self, name, field, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name      !! as in the interface, such as 'pressure'
      real(dp), intent(in), contiguous :: field(:, :) !! [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      type(field_type) :: known

      call self%start_field(name, known, error)
      if (allocated(error)) return
      call self%file%write(self%current_path//'/'//trim(name), field, trim(known%units), &
         trim(known%long_name), error, self%compression)
   end subroutine write_real_field

   !> Write a field of states.
   subroutine write_state_field(self, name, field, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: name      !! 'contact'
      integer(int8), intent(in), contiguous :: field(:, :) !! [nx, ny]
      type(error_type), allocatable, intent(out) :: error
      type(field_type) :: known

      call self%start_field(name, known, error)
      if (allocated(error)) return
      call self%file%write(self%current_path//'/'//trim(name), field, trim(known%units), &
         trim(known%long_name), error, self%compression)
   end subroutine write_state_field

   !> Let the snapshot appear, in the result and in the XDMF file.
   subroutine end_snapshot(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call write_axes(self, self%current_path, self%current%fields, error)
      if (allocated(error)) return
      call self%file%publish_group(error)
      if (allocated(error)) return
      self%snapshots = [self%snapshots, self%current]
      call write_xdmf(self%xdmf_path, self%path, self%grid, self%snapshots, error)
   end subroutine end_snapshot

   !> Write where a state of steady sliding loses its energy, as a group /losses/NNNNNN.
   subroutine write_losses(self, step, wavelength, octave, prony_tau, arm, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: step                          !! row of the history
      real(dp), intent(in), contiguous :: wavelength(:)    !! longest of each octave, m
      real(dp), intent(in), contiguous :: octave(:)        !! rate of loss of each octave, W
      real(dp), intent(in), contiguous :: prony_tau(:)     !! relaxation time of each arm, s
      real(dp), intent(in), contiguous :: arm(:)           !! of each arm, W
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: path

      path = '/losses/'//snapshot_name(step)
      call self%file%stage_group(path, error)
      if (allocated(error)) return
      call self%file%write_attribute(path, 'step', step, error)
      if (allocated(error)) return
      call self%file%write(path//'/wavelength', wavelength, 'm', 'longest wavelength of each octave', error, &
         self%compression)
      if (allocated(error)) return
      call self%file%write(path//'/octave', octave, 'W', 'rate of loss in the rubber by octaves', error, &
         self%compression)
      if (allocated(error)) return
      call self%file%name_axes(path, ['wavelength'], ['octave'], error)
      if (allocated(error)) return
      if (size(arm) > 0) call write_losses_of_arms(self, path, prony_tau, arm, error)
      if (allocated(error)) return
      call self%file%publish_group(error)
   end subroutine write_losses

   !> Write the losses of the arms of the material, along their relaxation times.
   subroutine write_losses_of_arms(self, path, prony_tau, arm, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      real(dp), intent(in), contiguous :: prony_tau(:), arm(:)
      type(error_type), allocatable, intent(out) :: error

      call self%file%write(path//'/prony_tau', prony_tau, 's', 'relaxation times of the arms', error, self%compression)
      if (allocated(error)) return
      call self%file%write(path//'/arm', arm, 'W', 'rate of loss in the rubber by arms of the material', &
         error, self%compression)
      if (allocated(error)) return
      call self%file%name_axes(path, ['prony_tau'], ['arm'], error)
   end subroutine write_losses_of_arms

   !> Row of the last snapshot; -1: there is none.
   pure function last_snapshot(self) result(step)
      class(result_file_type), intent(in) :: self
      integer :: step

      step = -1
      if (size(self%snapshots) > 0) step = maxval(self%snapshots%step)
   end function last_snapshot

   !> Let /checkpoint of the result stand for the checkpoint, a file of its own.
   subroutine link_checkpoint(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (self%file%has_link('/checkpoint')) return
      call self%file%link_external('/checkpoint', name_of(sibling_path(self%path, &
         '.checkpoint.h5')), '/', error)
      if (allocated(error)) return
      call self%file%flush(error)
   end subroutine link_checkpoint

   !> Take /checkpoint away.
   subroutine unlink_checkpoint(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (.not. self%file%has_link('/checkpoint')) return
      call self%file%remove('/checkpoint', error)
      if (allocated(error)) return
      call self%file%flush(error)
   end subroutine unlink_checkpoint

   !> Say whether the run came to its end.
   subroutine finish_result(self, finished, error)
      class(result_file_type), intent(inout) :: self
      logical, intent(in) :: finished
      type(error_type), allocatable, intent(out) :: error

      call self%file%write_attribute('/', 'finished', merge(1, 0, finished), error)
      if (allocated(error)) return
      call self%file%flush(error)
   end subroutine finish_result

   !> Close the file.
   subroutine close_result(self, error)
      class(result_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call self%file%close(error)
   end subroutine close_result

   !> Open a result to go on with it after a given row: later rows and snapshots are dropped.
   subroutine reopen_result(self, path, id, last_step, compression, error)
      class(result_file_type), intent(inout) :: self
      character(*), intent(in) :: path
      character(*), intent(in) :: id        !! of the result that the checkpoint belongs to
      integer, intent(in) :: last_step      !! the last row to keep, from 0
      integer, intent(in) :: compression    !! of fields, 0 none to 9 smallest
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: closing

      self%path = trim(path)
      self%compression = compression
      self%xdmf_path = sibling_path(path, '.xdmf')
      call self%file%open(self%path, 'append', error)
      if (allocated(error)) return
      call self%read_text('id', self%id, error)
      if (.not. allocated(error) .and. self%id /= id) call fail(error, error_input, self%path// &
         ': is not the result that '//sibling_path(path, '.checkpoint.h5')//' belongs to')
      if (.not. allocated(error)) call go_back(self, last_step, error)
      if (allocated(error)) call self%file%close(closing)
   end subroutine reopen_result

   !> Drop what lies behind a row.
   subroutine go_back(self, last_step, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: last_step
      type(error_type), allocatable, intent(out) :: error
      character(120) :: text

      call count_history_rows(self%file, self%rows, error)
      if (allocated(error)) return
      if (last_step < 0 .or. last_step >= self%rows) then
         write (text, '(": the history has ", i0, " rows, the run would go on after row ", i0)') &
            self%rows, last_step
         call fail(error, error_file, self%path//trim(text))
         return
      end if
      call read_grid(self, error)
      if (allocated(error)) return
      call self%file%read_attribute('/', 'expected_rows', self%expected_rows, error)
      if (allocated(error)) return
      if (self%rows > last_step + 1) call shorten_history(self%file, last_step + 1, self%expected_rows, &
         error)
      if (allocated(error)) return
      call keep_snapshots(self, last_step, error)
      if (allocated(error)) return
      call keep_losses(self, last_step, error)
      if (allocated(error)) return
      call self%file%flush(error)
      if (allocated(error)) return
      if (self%rows > last_step + 1) call self%file%publish_group(error)
      if (allocated(error)) return
      self%rows = last_step + 1
      call self%finish(.false., error)
      if (allocated(error)) return
      call write_xdmf(self%xdmf_path, self%path, self%grid, self%snapshots, error)
   end subroutine go_back

   !> Remove the losses of rows behind a row.
   subroutine keep_losses(self, last_step, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: last_step
      type(error_type), allocatable, intent(out) :: error
      character(256), allocatable :: names(:)
      integer :: i, step

      if (.not. self%file%has_link('/losses')) return
      call self%file%members('/losses', names, error)
      if (allocated(error)) return
      do i = 1, size(names)
         call self%file%read_attribute('/losses/'//trim(names(i)), 'step', step, error)
         if (allocated(error)) return
         if (step > last_step) call self%file%remove('/losses/'//trim(names(i)), error)
         if (allocated(error)) return
      end do
   end subroutine keep_losses

   !> Note the snapshots up to a row and remove the later ones, and that of a stop.
   subroutine keep_snapshots(self, last_step, error)
      class(result_file_type), intent(inout) :: self
      integer, intent(in) :: last_step
      type(error_type), allocatable, intent(out) :: error
      character(256), allocatable :: names(:), fields(:)
      type(snapshot_type) :: snapshot
      integer :: i, j
      character(:), allocatable :: path

      if (allocated(self%snapshots)) deallocate (self%snapshots)
      allocate (self%snapshots(0))
      call self%file%members('/snapshots', names, error)
      if (allocated(error)) return
      do i = 1, size(names)
         path = '/snapshots/'//trim(names(i))
         call self%file%read_attribute(path, 'step', snapshot%step, error)
         if (allocated(error)) return
         if (snapshot%step > last_step .or. self%file%has_attribute(path, stop_mark)) then
            call self%file%remove(path, error)
            if (allocated(error)) return
            cycle
         end if
         call self%file%read_attribute(path, 'time', snapshot%time, error)
         if (allocated(error)) return
         call self%file%members(path, fields, error)
         if (allocated(error)) return
         fields = pack(fields, fields /= axes(1) .and. fields /= axes(2))
         if (allocated(snapshot%fields)) deallocate (snapshot%fields)
         allocate (snapshot%fields(size(fields)))
         do j = 1, size(fields)
            snapshot%fields(j) = fields(j) (:24)
         end do
         self%snapshots = [self%snapshots, snapshot]
      end do
   end subroutine keep_snapshots

end module result_file
