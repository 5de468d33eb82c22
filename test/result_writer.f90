!> A small run that only writes a result. Tests kill it, fill its disk, and read its files.
module result_writer
   use, intrinsic :: iso_fortran_env, only : error_unit
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type
   use asperity_errors, only : error_type
   use hdf5_file, only : hdf5_file_type
   use history_row, only : history_row_type
   use asperity_precision, only : dp, int8
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   use result_file, only : result_file_type, result_plan_type
   use state_table, only : state_table_type
   implicit none
   private

   public :: run_writer, write_result, row_of, pressure_of

   integer, parameter, public :: nx = 7, ny = 4

contains

   !> Return the row of a step, all of whose numbers follow from the number of the step.
   pure function row_of(step) result(row)
      integer, intent(in) :: step
      type(history_row_type) :: row

      row%step = step
      row%phase = 1 + step/10
      row%time = 0.25_dp*step
      row%friction = 1.0_dp + step
      row%seconds = 2.0_dp*step
   end function row_of

   !> Return the pressure of a step, which is larger along y than along x.
   pure function pressure_of(step) result(pressure)
      integer, intent(in) :: step
      real(dp) :: pressure(nx, ny)
      integer :: i, j

      do j = 1, ny
         do i = 1, nx
            pressure(i, j) = 1000.0_dp*step + 10.0_dp*(j - 1) + (i - 1)
         end do
      end do
   end function pressure_of

   !> Write the result that the arguments describe: writer FILE ROWS COMPRESSION [restart].
   subroutine run_writer()
      type(error_type), allocatable :: error
      character(1024) :: path, number
      integer :: rows, compression

      call get_command_argument(2, path)
      call get_command_argument(3, number)
      read (number, *) rows
      call get_command_argument(4, number)
      read (number, *) compression
      call write_result(trim(path), rows, compression, command_argument_count() > 4, error)
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      stop 3
   end subroutine run_writer

   !> Write `rows` rows, with a snapshot for every third and a checkpoint for every fourth step.
   subroutine write_result(path, rows, compression, restart, error)
      character(*), intent(in) :: path
      integer, intent(in) :: rows
      integer, intent(in) :: compression
      logical, intent(in) :: restart        !! continue from the checkpoint
      type(error_type), allocatable, intent(out) :: error
      type(result_file_type) :: output
      type(hdf5_file_type) :: file
      type(checkpoint_writer_type) :: state
      type(checkpoint_reader_type) :: old
      type(error_type), allocatable :: closing
      type(grid_type) :: grid
      type(result_plan_type) :: plan
      integer :: step, first

      grid = new_grid(nx, ny, 14.0_dp, 4.0_dp, boundary_periodic)
      first = 0
      if (restart) then
         ! The process has died before its end, or there would be nothing to continue.
         call file%open(path, 'append')
         call file%write_attribute('/', 'finished', 0)
         call file%close(error)
         if (.not. allocated(error)) call old%open(path, error)
         if (allocated(error)) return
         call read_state(first)
         if (allocated(error)) return
         call old%close()
         call output%reopen(path, old%result_id, first, compression, error)
         first = first + 1
      else
         plan%title = 'a small run'
         plan%input = '&case title = ''a small run'' /'
         plan%settings = 'nx = 7'
         plan%material%poisson = 0.5_dp
         plan%material%prony_g = [1.0_dp, 2.0_dp]
         plan%material%prony_tau = [0.1_dp, 10.0_dp]
         plan%rows = rows
         plan%snapshots = rows/3 + 1
         plan%compression = compression
         call output%create(path, grid, plan, error)
         if (.not. allocated(error)) call output%write_height_rows(1, pressure_of(0), error)
         if (.not. allocated(error)) call output%publish(error)
      end if
      do step = first, rows - 1
         if (allocated(error)) exit
         call output%append_row(row_of(step), error)
         if (.not. allocated(error) .and. mod(step, 3) == 0) call write_snapshot(step)
         if (.not. allocated(error) .and. mod(step, 4) == 3) call write_state(step)
      end do
      if (.not. allocated(error)) call output%finish(.true., error)
      if (allocated(error)) then
         call output%close(closing)
      else
         call output%close(error)
      end if

   contains

      subroutine write_snapshot(step)
         integer, intent(in) :: step
         integer(int8) :: contact(nx, ny)
         integer :: rows

         contact = int(mod(step, 3), int8)
         contact(2, 1) = 1_int8
         call output%begin_snapshot(step, 0.25_dp*step, 1)
         call output%start_field('pressure', rows)
         call output%write_rows(1, pressure_of(step))
         call output%start_field('gap', rows)
         call output%write_rows(1, -pressure_of(step))
         call output%start_field('contact', rows)
         call output%write_rows(1, contact)
         call output%end_snapshot(error)
      end subroutine write_snapshot

      subroutine read_state(step)
         integer, intent(out) :: step
         type(state_table_type) :: table
         integer, target :: kept_step
         real(dp), allocatable, target :: kept_pressure(:, :)

         allocate (kept_pressure(nx, ny))
         call table%add('step', kept_step, 'the last step')
         call table%add('pressure', kept_pressure, 'Pa', 'the last pressure')
         call old%get_state(table, error)
         step = kept_step
      end subroutine read_state

      subroutine write_state(step)
         integer, intent(in) :: step
         type(state_table_type) :: table
         integer, target :: kept_step
         real(dp), allocatable, target :: kept_pressure(:, :)

         kept_step = step
         kept_pressure = pressure_of(step)
         call table%add('step', kept_step, 'the last step')
         call table%add('pressure', kept_pressure, 'Pa', 'the last pressure')
         call state%start(path, output%id, 'grid: nx = 7')
         call state%put_state(table)
         call state%commit(error)
         if (allocated(error)) return
         call output%link_checkpoint(error)
      end subroutine write_state

   end subroutine write_result

end module result_writer
