!> The state of a run: everything that one row leaves to the next, and nothing else.
!>
!> `state_type` is plain data: a copy of it is a saved state. `list_state` names each of its pieces, with
!> units and meaning. The checkpoint and the restart go through that list. A new variable of the state is a
!> component and one line of the list; a field is also named in module `row_stop`, which copies it with a check of the
!> memory.
!>
!> Memory, in fields of doubles: P, gap and, if there are several rows, U; with Prony arms their state (S, S - S_old
!> and one field per arm); with friction those of module `tangential_state`; with steady phases the last
!> two steady states.
module row_state
   use asperity_precision, only : dp
   use asperity_schedule, only : schedule_type
   use contact_size, only : patch_size_type
   use history_list, only : list_columns
   use history_row, only : history_row_type
   use state_table, only : state_table_type
   use steady_step, only : steady_start_type, steady_state_type
   use stick_slip_watch, only : stick_slip_watch_type
   use tangential_state, only : tangential_state_type
   use viscoelastic_energy, only : energy_books_type
   use arm_state, only : arm_state_type
   implicit none
   private

   public :: list_state, state_type

   integer, parameter, public :: edge_clear = 0     !! nothing near the edge of a free map
   integer, parameter, public :: edge_near = 1      !! points enter or leave the map close to the rubber
   integer, parameter, public :: edge_touches = 2   !! cells at the edge touch

   !> The state.
   type :: state_type
      type(schedule_type) :: schedule
      type(history_row_type) :: row                 !! the last row
      logical :: first = .true.                     !! no row has been solved
      real(dp) :: level = 0.0_dp                    !! U - H where the gap is zero, m
      real(dp) :: direction(2) = 0.0_dp             !! of the road's last motion
      real(dp) :: velocity(2) = 0.0_dp              !! of the road in the last step, m/s
      real(dp) :: drive_force(2) = 0.0_dp           !! horizontal force on the rubber, N
      real(dp) :: drifted(2) = 0.0_dp               !! sum of the expected motions of the surface, m
      integer :: moved_cells(2) = 0                 !! cells by which P has been shifted so far
      real(dp) :: first_mismatch = 1.0_dp           !! left by the first pass of the last step
      logical :: passes_reported = .false.              !! a warning of passes that did not settle was given
      logical :: motion_reported = .false.                 !! a warning of a pull that moves the road far was given
      type(stick_slip_watch_type) :: stick_slip     !! observations of the mean slip
      type(patch_size_type) :: widest               !! best resolved patches of contact at the end of a phase
      integer :: edge = edge_clear                  !! worst found at the edge of a free map
      real(dp) :: dt_old = 0.0_dp                   !! length of the last step, s; 0 after a jump
      real(dp), allocatable :: pressure(:, :)       !! P, Pa
      real(dp), allocatable :: gap(:, :)            !! m
      real(dp), allocatable :: displacement(:, :)   !! U_z, m; not in a run of a single row
      type(energy_books_type) :: books              !! of the normal traction
      type(arm_state_type) :: arms                 !! of the normal traction
      type(tangential_state_type) :: tangential     !! with friction
      type(steady_state_type) :: steady             !! with steady phases
   end type state_type

contains

   !> List the state: everything that one row leaves to the next. Collective.
   subroutine list_state(state, table)
      type(state_type), intent(in), target :: state
      type(state_table_type), intent(out) :: table

      call list_schedule(state%schedule, table)
      call list_columns(state%row, table, 'row/')
      call table%add('first', state%first, 'no row has been solved')
      call table%add('level', state%level, 'm', 'displacement less height where the gap is zero')
      call table%add('direction', state%direction, '1', 'direction of the road''s last motion')
      call table%add('drive_force', state%drive_force, 'N', 'horizontal force on the rubber')
      call table%add('velocity', state%velocity, 'm/s', 'velocity of the road in the last step')
      call table%add('drifted', state%drifted, 'm', 'sum of the expected motions of the surface')
      call table%add('moved_cells', state%moved_cells, 'cells by which the pressure has been shifted')
      call table%add('widest/across', state%widest%across, '1', 'most cells across a patch of contact where a phase ended')
      call table%add('widest/needed', state%widest%needed, '1', 'cells across that such patches need')
      call table%add('edge', state%edge, 'worst finding at the edge of a free map')
      call table%add('stick_slip/reported', state%stick_slip%reported, 'a warning of stick-slip was given')
      call table%add('stick_slip/speed', state%stick_slip%speed, 'm/s', 'mean slip speed')
      call table%add('stick_slip/change', state%stick_slip%change, 'm/s', 'its change in the last step')
      call table%add('stick_slip/turns', state%stick_slip%turns, 'alternations of that change')
      call table%add('passes/reported', state%passes_reported, &
         'a warning of passes that did not settle was given')
      call table%add('pull/reported', state%motion_reported, 'a warning of a pull that moves the road far was given')
      call table%add('passes/first_mismatch', state%first_mismatch, '1', &
         'mismatch that the first pass of the last step left')

      call table%add_field('pressure', state%pressure, 'Pa', 'normal traction on the rubber')
      call table%add_field('gap', state%gap, 'm', 'gap between rubber and road')
      call table%add_field('displacement', state%displacement, 'm', 'displacement of the rubber along z')
      call table%add('dt_old', state%dt_old, 's', 'length of the last step, 0 after a jump')
      call list_books('books', state%books, table)
      call list_arms('arms', state%arms, table)
      if (allocated(state%tangential%traction)) call list_tangential(state%tangential, table)
      if (.not. allocated(state%steady%last%pressure)) return
      call table%add('steady/now', state%steady%now, 'the last row was one of steady sliding')
      call table%add('steady/base', state%steady%base, 'm', &
         'place of the road in steady rows, less the mean displacement of the contact')
      call list_start('steady/last', state%steady%last, table)
      call list_start('steady/before', state%steady%before, table)
   end subroutine list_state

   !> List the position of the run in its phases.
   subroutine list_schedule(s, table)
      type(schedule_type), intent(in), target :: s
      type(state_table_type), intent(inout) :: table

      call table%add('schedule/row', s%row, 'number of the last row')
      call table%add('schedule/phase', s%phase, 'present phase')
      call table%add('schedule/step', s%step, 'steps of the phase that are done')
      call table%add('schedule/entered', s%entered, 'the first row of the phase is done')
      call table%add('schedule/start_time', s%start_time, 's', 'start of the phase')
      call table%add('schedule/start_load', s%start_load, '1', &
         'load at the start of the phase, in the units of its control')
      call table%add('schedule/start_x', s%start_road(1), 'm', 'road at the start of the phase')
      call table%add('schedule/start_y', s%start_road(2), 'm', 'road at the start of the phase')
      call table%add('schedule/held_control', s%held_control, 'control of the load so far')
      call table%add('schedule/held_load', s%held_load, '1', &
         'load held so far, in the units of its control')
      call table%add('schedule/held_rate', s%held_rate, '1/s', &
         'rate of the load in the last step, in the units of its control')
      call table%add('schedule/velocity_x', s%velocity(1), 'm/s', 'velocity of the road so far')
      call table%add('schedule/velocity_y', s%velocity(2), 'm/s', 'velocity of the road so far')
      call table%add('schedule/pulled_x', s%held_pulled(1), 'a force has pulled the road along x so far')
      call table%add('schedule/pulled_y', s%held_pulled(2), 'a force has pulled the road along y so far')
      call table%add('schedule/held_pull', s%held_pull, 'Pa', 'force on the road so far, over the cell')
      call table%add('schedule/start_pull', s%start_pull, 'Pa', &
         'force on the road at the start of the phase, over the cell')
      call table%add('schedule/load_changed', s%load_changed, &
         'the load was changed since the last row')
      call table%add('schedule/load_has_changed', s%load_has_changed, &
         'the load was changed before the last row')
      call table%add('schedule/speed_changed', s%speed_changed, &
         'the velocity was changed since the last row')
   end subroutine list_schedule

   !> List the energy books. The area of a cell is not part of the state, but of the case.
   subroutine list_books(prefix, books, table)
      character(*), intent(in) :: prefix
      type(energy_books_type), intent(in), target :: books
      type(state_table_type), intent(inout) :: table

      call table%add(prefix//'/stored', books%stored, 'J', 'elastic energy')
      call table%add(prefix//'/work', books%work, 'J', 'work done by the traction')
      call table%add(prefix//'/dissipated', books%dissipated, 'J', 'energy lost in the rubber')
      call table%add(prefix//'/numerical', books%numerical, 'J', 'the part that the scheme lost')
      call table%add(prefix//'/du_ds', books%du_ds, 'm3', 'dU.dS of the last step')
      call table%add(prefix//'/arm', books%arm, 'Pa2 m3', 'products m_k.p_k of the arms')
      call table%add(prefix//'/arm_du', books%arm_du, 'J', 'p_k.dU of the last step')
   end subroutine list_books

   !> List the state of the arms.
   subroutine list_arms(prefix, arms, table)
      character(*), intent(in) :: prefix
      type(arm_state_type), intent(in), target :: arms
      type(state_table_type), intent(inout) :: table

      call table%add_cells(prefix//'/s', arms%s, arms%row, '1', 'S = P over a modulus')
      call table%add_cells(prefix//'/ds', arms%ds, arms%row, '1', 'S less that of the step before')
      call table%add_cells(prefix//'/arm', arms%arm, arms%row, 'Pa', 'tractions of the arms')
   end subroutine list_arms

   !> List a state of steady sliding from which the next row may start.
   subroutine list_start(prefix, start, table)
      character(*), intent(in) :: prefix
      type(steady_start_type), intent(in), target :: start
      type(state_table_type), intent(inout) :: table

      call table%add(prefix//'/known', start%known, 'there is such a state')
      call table%add(prefix//'/pressure_mean', start%pressure_mean, 'Pa', 'load')
      call table%add(prefix//'/velocity', start%velocity, 'm/s', 'velocity of the road')
      call table%add_field(prefix//'/pressure', start%pressure, 'Pa', 'normal traction on the rubber')
      call table%add_field(prefix//'/gap', start%gap, 'm', 'gap between rubber and road')
      call table%add_field(prefix//'/traction', start%traction, 'Pa', 'tangential traction')
   end subroutine list_start

   !> List the tangential part of the state.
   subroutine list_tangential(t, table)
      type(tangential_state_type), intent(in), target :: t
      type(state_table_type), intent(inout) :: table

      call table%add('tangential/moved', t%moved, 'the road has moved: friction acts')
      call table%add('tangential/block/fresh', t%block%fresh, 'the acceleration of the block is not known')
      call table%add('tangential/block/speed', t%block%speed, 'm/s', 'speed of the mass over the road')
      call table%add('tangential/block/acceleration', t%block%acceleration, 'm/s2', 'acceleration of the mass')
      call table%add('tangential/rate', t%rate, 'm/s', 'mean speed of the surface in the contact')
      call table%add('tangential/last_dt', t%last_dt, 's', 'length of the last step, 0 after a jump')
      call table%add('tangential/block/work', t%block%work, 'J', 'work done on the mass')
      call table%add('tangential/block/lost', t%block%lost, 'J', 'energy that the rule of its motion lost')
      call table%add('tangential/lost_friction', t%lost_friction, 'J', 'energy lost by friction')
      call table%add_field('tangential/traction', t%traction, 'Pa', 'tangential traction')
      call table%add_field('tangential/before', t%before, 'Pa', 'tangential traction of the step before')
      call table%add_field('tangential/displacement', t%displacement, 'm', 'tangential displacement')
      call table%add_field('tangential/rubbing', t%rubbing, 'Pa', 'frictional traction T - T* of the last step')
      call table%add_field('tangential/contact', t%contact, '0 open, 1 stick, 2 slip')
      call table%add_field('tangential/force', t%force, 'Pa', 'force of the friction law in the last step')
      call table%add('tangential/forecast/dt', t%forecast%dt, 's', 'length of the last step of the forecast')
      call table%add('tangential/forecast/known', t%forecast%known, 'differences that the forecast knows')
      call table%add('tangential/forecast/order', t%forecast%order, 'order of the forecast')
      call table%add_field('tangential/forecast/change', t%forecast%change, 'm', &
         'change of the displacement around the contact in the last step')
      call table%add_field('tangential/forecast/more', t%forecast%more, 'm', &
         'by how much this was more than in the step before')
      call list_books('tangential/books', t%books, table)
      call list_arms('tangential/arms', t%arms, table)
   end subroutine list_tangential

end module row_state
