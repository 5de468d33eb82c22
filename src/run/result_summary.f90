!> A summary of a result as text.
!>
!> If the run is not finished, the text attribute `outcome` of the file states why it ended, if the run could still
!> write it. The warnings of the input and of the run follow.
module result_summary
   use case_input, only : parse_case
   use case_report, only : control_units
   use case_settings, only : case_type
   use asperity_errors, only : error_file, error_type, fail
   use file_lock, only : lock_free, lock_held, state_of_lock
   use hdf5_file, only : hdf5_file_type
   use asperity_precision, only : dp
   use map_summary, only : describe_map
   use path_identity, only : real_path
   use result_check, only : damage_type, find_damage
   use result_names, only : sibling_path
   use text_tools, only : in_one_line, next_line, to_text
   use trial_process, only : trial_type
   implicit none
   private

   public :: summarise_result

   character(*), parameter :: nl = new_line('a')
   integer, parameter :: patience = 60          !! longest time for the trial of a file, s

contains

   !> Read a result and summarise it. The run may still be in progress. If parts of the result are damaged, there is
   !> both a summary and an error. HDF5 may crash on a damaged file, so that a separate process does all of this first.
   subroutine summarise_result(path, text, error)
      character(*), intent(in) :: path
      character(:), allocatable, intent(out) :: text   !! '' if the result cannot be read
      type(error_type), allocatable, intent(out) :: error
      type(trial_type) :: trial

      text = ''
      call trial%start(patience)
      if (trial%is_copy) then
         call read_summary(path, text, error)
         call trial%leave()
      end if
      call trial%verdict(path, error)
      if (.not. allocated(error)) call read_summary(path, text, error)
   end subroutine summarise_result

   !> Summarise a result in this process.
   subroutine read_summary(path, text, error)
      character(*), intent(in) :: path
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: ignored

      call file%open(path, 'read', error)
      if (allocated(error)) return
      if (file%has_attribute('/', 'finished')) then
         call describe(file, path, text, error)
         if (.not. allocated(error)) call add_damage(file, path, text, error)
      else if (file%has_dataset('/surface/height')) then
         call describe_map(file, path, '/surface/height', text, error)
      else if (file%has_dataset('/surface')) then
         call describe_map(file, path, '/surface', text, error)
      else if (file%has_attribute('/', 'result_id')) then
         call fail(error, error_file, path//': is a checkpoint: `asperity run` with --restart continues its result')
      else
         call fail(error, error_file, path//': is neither a result nor a height map: it has no attribute ''finished'''// &
            ' and no dataset surface/height or surface')
      end if
      call file%close(ignored)
   end subroutine read_summary

   !> Add the names of the damaged parts of a result.
   subroutine add_damage(file, path, text, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable, intent(out) :: error
      type(damage_type) :: found
      character(:), allocatable :: part
      integer :: at

      call find_damage(file, found)
      if (found%left_out > 0) text = text//'not read    the fields of the first '// &
         to_text(found%left_out)//' snapshots, because the others already take a gigabyte'//nl
      if (found%parts == 0) return
      at = 1
      do while (at <= len(found%names))
         call next_line(found%names, at, part)
         text = text//'damaged     '//part//nl
      end do
      at = 1
      call next_line(found%names, at, part)
      if (index(part, ': ') == 0) part = part//' cannot be read'
      if (found%parts > 1) part = part//', and '//to_text(found%parts - 1)//' more'
      call fail(error, error_file, path//': the file is damaged: '//part)
   end subroutine add_damage

   !> Summarise an open result.
   subroutine describe(file, path, text, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: boundary, input, maker, outcome, title, written
      integer :: finished, nx, ny
      real(dp) :: lx, ly

      call file%read_attribute('/', 'title', title)
      call file%read_attribute('/', 'version', maker)
      call file%read_attribute('/', 'created', written)
      call file%read_attribute('/', 'input', input)
      call file%read_attribute('/', 'finished', finished)
      call file%read_attribute('/grid', 'nx', nx)
      call file%read_attribute('/grid', 'ny', ny)
      call file%read_attribute('/grid', 'lx', lx)
      call file%read_attribute('/grid', 'ly', ly)
      call file%read_attribute('/grid', 'boundary', boundary)
      call file%report(error)
      if (allocated(error)) return

      text = 'file        '//path//nl
      text = text//'case        '//in_one_line(title, 200)//nl
      text = text//'written     '//written//' by asperity '//maker//nl
      text = text//'grid        '//to_text(nx)//' x '//to_text(ny)//' cells, '//to_text(lx)//' m x '// &
         to_text(ly)//' m, '//boundary//nl
      text = text//phases_text(input)
      call history_text(file, merge(lx*ly, 0.0_dp, boundary == 'free'), text, error)
      if (allocated(error)) return
      if (finished == 1) then
         text = text//'finished    yes'//nl
      else
         text = text//'finished    no'//nl
      end if
      if (finished == 0 .and. file%has_attribute('/', 'outcome')) then
         call file%read_attribute('/', 'outcome', outcome)
         if (outcome == 'running') outcome = unrecorded_outcome(file, path)
         text = text//'outcome     '//in_one_line(outcome, 400)//nl
      end if
      call add_warnings(file, 'warnings', text)
      call add_warnings(file, 'run_warnings', text)
      call file%report(error)
   end subroutine describe

   !> What is known of a run that has not recorded its end. A run that a full disk has ended cannot write to its result,
   !> just as one that was killed.
   function unrecorded_outcome(file, path) result(text)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      character(:), allocatable :: text

      select case (state_of_lock(sibling_path(real_path(path), '.lock')))
      case (lock_held)
         text = 'the run continues'
      case (lock_free)
         text = 'not recorded. The process has ended: it was killed, or it could not write its result (for '// &
            'example, because the disk was full)'
      case default
         text = 'not recorded. The run continues, or its process has ended: it was killed, or it could not write '// &
            'its result (for example, because the disk was full)'//row_note(file)
      end select
   end function unrecorded_outcome

   !> The time that the last row took, so that the reader can judge whether the run is still alive; '' if it is not
   !> known.
   function row_note(file) result(note)
      type(hdf5_file_type), intent(inout) :: file
      character(:), allocatable :: note
      type(error_type), allocatable :: error
      real(dp), allocatable :: seconds(:)

      note = ''
      call file%read('/history/seconds', seconds, error)
      if (allocated(error)) return
      if (size(seconds) == 0) return
      note = '; the last row took '//to_text(real(nint(1e3_dp*seconds(size(seconds))), dp)*1e-3_dp)// &
         ' s; check whether rows are being added'
   end function row_note

   !> Add the lines of an attribute with warnings, if there is one.
   subroutine add_warnings(file, name, text)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: name
      character(:), allocatable, intent(inout) :: text
      character(:), allocatable :: line, lines
      integer :: at

      if (.not. file%has_attribute('/', name)) return
      call file%read_attribute('/', name, lines)
      at = 1
      do while (at <= len(lines))
         call next_line(lines, at, line)
         if (len(line) > 0) text = text//'warning     '//in_one_line(line, 400)//nl
      end do
   end subroutine add_warnings

   !> The phases of the input that the result contains.
   function phases_text(input) result(text)
      character(*), intent(in) :: input
      character(:), allocatable :: text
      type(case_type) :: case
      type(error_type), allocatable :: error
      real(dp) :: speed
      integer :: i

      text = ''
      call parse_case(input, 'input.nml', case, error)
      if (allocated(error)) return                   ! for example, the input of another version
      text = 'phases      '//to_text(size(case%phases))//nl
      do i = 1, size(case%phases)
         associate (phase => case%phases(i))
            text = text//'  '//to_text(i)//'         '//trim(phase%name)//': '//trim(phase%control)//' '// &
               to_text(phase%target)//' '//control_units(phase%control)
            speed = norm2([phase%velocity_x, phase%velocity_y])
            if (phase%relaxed) text = text//', relaxed'
            if (phase%steady) text = text//', steady sliding'
            if (speed > 0.0_dp) text = text//' at '//to_text(speed)//' m/s'
            if (.not. phase%static) text = text//', '//to_text(phase%duration)//' s in '// &
               to_text(phase%steps)//' steps'
            text = text//nl
         end associate
      end do
   end function phases_text

   !> Add the last row of the history, and the largest residuals of all rows.
   subroutine history_text(file, area, text, error)
      type(hdf5_file_type), intent(inout) :: file
      real(dp), intent(in) :: area                   !! of the grid in free mode, m2; 0 in periodic mode
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable, intent(out) :: error
      character(*), parameter :: names(11) = [character(20) :: 'step', 'phase', 'time', 'pressure', &
         'displacement', 'contact_area', 'stick_area', 'friction', 'residual_normal', &
         'residual_tangential', 'residual_coupling']
      character(*), parameter :: units(11) = [character(3) :: '', '', ' s', ' Pa', ' m', '', '', '', '', '', &
         '']
      real(dp), allocatable :: column(:)
      real(dp) :: last(size(names)), largest(size(names))
      integer :: expected, i, rows, turn

      rows = huge(1)
      last = 0.0_dp
      largest = 0.0_dp
      do turn = 1, 2                                 ! the file may be growing: use only rows that all columns have
         do i = 1, size(names)
            call file%read('/history/'//trim(names(i)), column, error)
            if (allocated(error)) then
               if (.not. may_be_absent(names(i))) return
               deallocate (error)                    ! not every file has them
               cycle
            end if
            rows = min(rows, size(column))
            if (turn == 1 .or. rows == 0) cycle
            last(i) = column(rows)
            largest(i) = maxval(abs(column(:rows)))
         end do
      end do

      if (rows == 0) then
         text = text//'rows        0'//nl
         return
      end if

      text = text//'rows        '//to_text(rows)
      if (file%has_attribute('/', 'expected_rows')) then
         call file%read_attribute('/', 'expected_rows', expected)
         if (expected /= rows) text = text//' of '//to_text(expected)
      end if

      text = text//nl//'last row'//nl
      do i = 1, size(names)
         if (may_be_absent(names(i)) .and. largest(i) <= 0.0_dp) cycle      ! there is no friction
         text = text//'  '//named_value(names(i), last(i), units(i), area)//nl
      end do

      do i = 1, size(names)
         if (index(names(i), 'residual') == 0) cycle
         if (may_be_absent(names(i)) .and. largest(i) <= 0.0_dp) cycle
         text = text//'largest '//trim(names(i))//' of all rows: '//to_text(largest(i))//nl
      end do
      call add_missing_work(file, text)
   end subroutine history_text

   !> Name and value of a column. In free mode the size of the grid is arbitrary, and so is the mean pressure: the force is
   !> given instead.
   function named_value(name, value, units, area) result(text)
      character(20), intent(in) :: name
      real(dp), intent(in) :: value
      character(*), intent(in) :: units
      real(dp), intent(in) :: area                   !! of the grid in free mode, m2; 0 in periodic mode
      character(:), allocatable :: text
      character(20) :: other

      text = name//to_text(value)//trim(units)
      if (name /= 'pressure' .or. .not. area > 0.0_dp) return
      other = 'force'
      text = other//to_text(value*area)//' N'
   end function named_value

   !> Add the line with the error of the steps in the energy balance.
   subroutine add_missing_work(file, text)
      type(hdf5_file_type), intent(inout) :: file
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable :: error
      real(dp), allocatable :: missing(:), load(:), drive(:)
      real(dp) :: scale
      integer :: rows

      call file%read('/history/work_missing', missing, error)
      if (.not. allocated(error)) call file%read('/history/work_load', load, error)
      if (.not. allocated(error)) call file%read('/history/work_drive', drive, error)
      if (allocated(error)) return                   ! a result of an older version has no such column
      rows = min(size(missing), size(load), size(drive))
      if (rows == 0) return
      scale = maxval(abs(load(:rows) + drive(:rows)))
      if (scale > 0.0_dp) text = text//'largest work_missing of all rows: '// &
         to_text(maxval(abs(missing(:rows)))/scale)//' of the work of load and drive (error of the steps)'//nl
   end subroutine add_missing_work

   !> May a result be without this column? The summary leaves the column out if it is zero.
   pure function may_be_absent(name) result(may)
      character(*), intent(in) :: name
      logical :: may

      may = any(name == [character(20) :: 'stick_area', 'friction', 'residual_tangential', &
         'residual_coupling'])
   end function may_be_absent

end module result_summary
