!> Warnings about rows that were solved but may be inaccurate.
module step_watches
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use contact_size, only : measured_patches, patch_size_type, size_warning, watch_contact_size
   use map_edge, only : check_edge
   use stick_slip_watch, only : watch_slip
   use text_tools, only : add_line, to_text
   implicit none
   private

   public :: add_warning, step_of_warning, watch_cells, watch_edge, watch_stick_slip

   character(*), parameter :: mark = 'step '         !! with which a warning about a row begins

contains

   !> Warn if a free map is too small. The fields of the state are those at the end of the step, but `state%row` is
   !> still the row before.
   subroutine watch_edge(contact, plan, warnings)
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable, intent(inout) :: warnings
      character(:), allocatable :: message

      message = ''
      call check_edge(contact%grid, merge(contact%case%adhesion%range, 0.0_dp, contact%normal%adhesive), &
         contact%rms_height, plan%road - [contact%state%row%road_x, contact%state%row%road_y], contact%state, message)
      call add_warning(warnings, contact%state%schedule%row, plan%time, message)
   end subroutine watch_edge

   !> Check the size of the patches of contact at the end of a phase. A state of steady sliding is a result of its own,
   !> about which wider patches in another state say nothing: it has its own warning.
   subroutine watch_cells(contact, plan, warnings)
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable, intent(inout) :: warnings
      type(patch_size_type) :: patches
      character(:), allocatable :: message

      associate (state => contact%state)
         if (state%schedule%phase == plan%phase) return
         patches = measured_patches(contact%grid, contact%normal%adhesive, state%pressure, state%gap)
         if (plan%steady) then
            call add_warning(warnings, state%schedule%row, plan%time, size_warning(contact%grid, patches))
            patches = patch_size_type()  ! the other phases are judged without it
         end if
         call watch_contact_size(contact%grid, patches, state%schedule%phase > size(contact%case%phases), &
            state%widest, message)
         call add_warning(warnings, state%schedule%row, plan%time, message)
      end associate
   end subroutine watch_cells

   !> Warn if the numerical scheme makes the block stick and slip alternately. `state%row` is the present row.
   subroutine watch_stick_slip(contact, plan, warnings)
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      character(:), allocatable, intent(inout) :: warnings
      character(:), allocatable :: message
      real(dp) :: speed

      if (.not. contact%frictional) return
      speed = hypot(plan%velocity(1), plan%velocity(2))
      ! A block that comes to rest after its road has stopped is not stick-slip.
      if (.not. plan%dt*speed > 0.0_dp) return
      call watch_slip(contact%state%stick_slip, contact%state%row%sliding_speed, speed, &
         contact%case%solver%passes, contact%case%material%density, message)
      call add_warning(warnings, contact%state%schedule%row, plan%time, message)
   end subroutine watch_stick_slip

   !> Add a line to the warnings, unless it is empty.
   subroutine add_warning(warnings, step, time, message)
      character(:), allocatable, intent(inout) :: warnings
      integer, intent(in) :: step                   !! number of the row
      real(dp), intent(in) :: time                  !! s
      character(*), intent(in) :: message

      if (len(message) == 0) return
      call add_line(warnings, mark//to_text(step)//', t = '//to_text(time)//' s: '//message)
   end subroutine add_warning

   !> The number of the row of a line that `add_warning` has made; -1 if the line is another one.
   pure function step_of_warning(line) result(step)
      character(*), intent(in) :: line
      integer :: step
      integer :: comma, status

      step = -1
      comma = index(line, ',')
      if (index(line, mark) /= 1 .or. comma <= len(mark)) return
      read (line(len(mark) + 1:comma - 1), *, iostat=status) step
      if (status /= 0) step = -1
   end function step_of_warning

end module step_watches
