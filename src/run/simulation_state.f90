!> The state of a run in a checkpoint: all that `advance` needs to go on to the same numbers.
!>
!> `list_state` is the only place that names the pieces of the state. A new state variable is one
!> line there; the checkpoint and the restart follow.
module simulation_state
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type
   use asperity_errors, only : error_type
   use history_row, only : column_count, column_type, history_columns, row_from_values, row_values
   use asperity_precision, only : dp
   use road_motion, only : place_road
   use asperity_simulation, only : simulation_type
   use state_table, only : state_table_type
   use steady_step, only : steady_start_type
   use tangential_state, only : tangential_state_type
   use viscoelastic_energy, only : energy_books_type
   use zener, only : history_type
   implicit none
   private

   public :: load_state, save_state

contains

   !> Put the state into a checkpoint.
   subroutine save_state(sim, writer, error)
      type(simulation_type), intent(in), target :: sim
      type(checkpoint_writer_type), intent(inout) :: writer
      type(error_type), allocatable, intent(out), optional :: error
      type(state_table_type) :: table
      real(dp), target :: row(column_count)

      row = row_values(sim%row)
      call list_state(sim, row, table)
      call writer%put_state(table, error)
   end subroutine save_state

   !> Take the state from a checkpoint into a new simulation of the same case.
   subroutine load_state(sim, reader, error)
      type(simulation_type), intent(inout), target :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      type(state_table_type) :: table
      real(dp), target :: row(column_count)

      row = 0.0_dp
      call list_state(sim, row, table)
      call reader%get_state(table, error)
      if (allocated(error)) return
      sim%row = row_from_values(row)
      call place_road(sim, sim%row%road_x, sim%row%road_y)
      sim%finished = sim%schedule%phase > size(sim%case%phases)
   end subroutine load_state

   !> The table of the state: everything that one row leaves to the next.
   subroutine list_state(sim, row, table)
      type(simulation_type), intent(in), target :: sim
      real(dp), intent(in), target :: row(column_count)   !! the last row, as `row_values` has it
      type(state_table_type), intent(out) :: table

      call list_schedule(sim, table)
      call list_row(row, table)
      call table%add('first', sim%first, 'there is no state yet')
      call table%add('level', sim%level, 'm', 'displacement less height where the gap is zero')
      call table%add('direction', sim%direction, '1', 'direction of the road''s last motion')
      call table%add('drive_force', sim%drive_force, 'N', 'horizontal force on the rubber')
      call table%add('velocity', sim%velocity, 'm/s', 'velocity of the road in the last step')
      call table%add('drifted', sim%drifted, 'm', 'sum of the expected motions of the surface')
      call table%add('moved_cells', sim%moved_cells, 'cells by which the pressure has been shifted')
      call table%add('widest', sim%widest, '1', 'most cells across a patch of contact where a phase ended')
      call table%add('edge', sim%edge, 'worst that was found at the edge of a free map')
      call table%add('stick_slip/reported', sim%watch%reported, 'stick-slip has been warned of')
      call table%add('stick_slip/speed', sim%watch%speed, 'm/s', 'mean slip speed')
      call table%add('stick_slip/change', sim%watch%change, 'm/s', 'its change in the last step')
      call table%add('stick_slip/turns', sim%watch%turns, 'alternations of that change')
      call table%add('passes/reported', sim%told_passes, &
         'passes that did not settle have been warned of')
      call table%add('pull/reported', sim%told_way, 'a pull that moves the road far has been warned of')
      call table%add('passes/first_mismatch', sim%first_mismatch, '1', &
         'mismatch that the first pass of the last step left')

      call table%add('pressure', sim%pressure, 'Pa', 'normal traction on the rubber')
      call table%add('gap', sim%gap, 'm', 'gap between rubber and road')
      call table%add('displacement', sim%displacement, 'm', 'displacement of the rubber along z')
      call table%add('dt_old', sim%material%dt_old, 's', 'length of the last step, 0 after a jump')
      call list_books('books', sim%books, table)
      call list_history('history', sim%history, table)
      if (sim%frictional) call list_tangential(sim%tangential, table)
      if (.not. sim%has_steady) return
      call table%add('steady/now', sim%was_steady, 'the last row was one of steady sliding')
      call table%add('steady/base', sim%steady%base, 'm', &
         'place of the road in steady rows, less the mean displacement of the contact')
      call list_start('steady/last', sim%steady%last, table)
      call list_start('steady/before', sim%steady%before, table)
   end subroutine list_state

   !> Where the run stands in its phases.
   subroutine list_schedule(sim, table)
      type(simulation_type), intent(in), target :: sim
      type(state_table_type), intent(inout) :: table

      associate (s => sim%schedule)
         call table%add('schedule/row', s%row, 'number of the last row')
         call table%add('schedule/phase', s%phase, 'phase in hand')
         call table%add('schedule/step', s%step, 'steps of the phase that are done')
         call table%add('schedule/entered', s%entered, 'the first row of the phase is done')
         call table%add('schedule/start_time', s%start_time, 's', 'start of the phase')
         call table%add('schedule/start_load', s%start_load, '1', &
            'load at the start of the phase, in the units of its control')
         call table%add('schedule/start_x', s%start_x, 'm', 'road at the start of the phase')
         call table%add('schedule/start_y', s%start_y, 'm', 'road at the start of the phase')
         call table%add('schedule/held_control', s%held_control, 'what is held so far')
         call table%add('schedule/held_load', s%held_load, '1', &
            'load held so far, in the units of its control')
         call table%add('schedule/held_rate', s%held_rate, '1/s', &
            'rate of the load in the last step, in the units of its control')
         call table%add('schedule/velocity_x', s%velocity_x, 'm/s', 'velocity of the road so far')
         call table%add('schedule/velocity_y', s%velocity_y, 'm/s', 'velocity of the road so far')
         call table%add('schedule/pulled_x', s%held_pulled(1), 'the road hung on a force along x so far')
         call table%add('schedule/pulled_y', s%held_pulled(2), 'the road hung on a force along y so far')
         call table%add('schedule/held_pull', s%held_pull, 'Pa', 'force on the road so far, over the cell')
         call table%add('schedule/start_pull', s%start_pull, 'Pa', &
            'force on the road at the start of the phase, over the cell')
         call table%add('schedule/load_changed', s%load_changed, &
            'the load was changed since the last row')
         call table%add('schedule/load_has_changed', s%load_has_changed, &
            'the load was changed before the last row')
         call table%add('schedule/speed_changed', s%speed_changed, &
            'the velocity was changed since the last row')
      end associate
   end subroutine list_schedule

   !> The last row, by the names of its columns.
   subroutine list_row(row, table)
      real(dp), intent(in), target :: row(column_count)
      type(state_table_type), intent(inout) :: table
      type(column_type) :: columns(column_count)
      integer :: i

      columns = history_columns()
      do i = 1, column_count
         call table%add('row/'//trim(columns(i)%name), row(i), trim(columns(i)%units), &
            trim(columns(i)%long_name))
      end do
   end subroutine list_row

   !> Books of energy. The area of a cell belongs to the case.
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

   !> The history of the arms.
   subroutine list_history(prefix, history, table)
      character(*), intent(in) :: prefix
      type(history_type), intent(in), target :: history
      type(state_table_type), intent(inout) :: table

      call table%add(prefix//'/s', history%s, '1', 'S = P over a modulus')
      call table%add(prefix//'/ds', history%ds, '1', 'S less that of the step before')
      call table%add(prefix//'/arm', history%arm, 'Pa', 'tractions of the arms')
   end subroutine list_history

   !> A state of steady sliding from which the next row may start.
   subroutine list_start(prefix, start, table)
      character(*), intent(in) :: prefix
      type(steady_start_type), intent(in), target :: start
      type(state_table_type), intent(inout) :: table

      call table%add(prefix//'/known', start%known, 'there is such a state')
      call table%add(prefix//'/pressure_mean', start%pressure_mean, 'Pa', 'load')
      call table%add(prefix//'/velocity', start%velocity, 'm/s', 'velocity of the road')
      call table%add(prefix//'/pressure', start%pressure, 'Pa', 'normal traction on the rubber')
      call table%add(prefix//'/gap', start%gap, 'm', 'gap between rubber and road')
      if (size(start%traction) > 0) &
         call table%add(prefix//'/traction', start%traction, 'Pa', 'tangential traction')
   end subroutine list_start

   !> The tangential part of the state.
   subroutine list_tangential(t, table)
      type(tangential_state_type), intent(in), target :: t
      type(state_table_type), intent(inout) :: table

      call table%add('tangential/moved', t%moved, 'the road has moved: friction acts')
      call table%add('tangential/block/fresh', t%block%fresh, 'the acceleration of the block is not known')
      call table%add('tangential/block/speed', t%block%speed, 'm/s', 'speed of the mass over the road')
      call table%add('tangential/block/acceleration', t%block%acceleration, 'm/s2', 'acceleration of the mass')
      call table%add('tangential/rate', t%rate, 'm/s', 'mean speed of the surface in the contact')
      call table%add('tangential/pace', t%pace, 's', 'length of the last step, 0 after a jump')
      call table%add('tangential/block/work', t%block%work, 'J', 'work done on the mass')
      call table%add('tangential/block/lost', t%block%lost, 'J', 'energy that the rule of its motion lost')
      call table%add('tangential/lost_friction', t%lost_friction, 'J', 'energy lost by friction')
      call table%add('tangential/traction', t%traction, 'Pa', 'tangential traction')
      call table%add('tangential/before', t%before, 'Pa', 'tangential traction of the step before')
      call table%add('tangential/displacement', t%displacement, 'm', 'tangential displacement')
      call table%add('tangential/rubbing', t%rubbing, 'Pa', 'frictional traction T - T* of the last step')
      call table%add('tangential/contact', t%contact, '0 open, 1 stick, 2 slip')
      call table%add('tangential/rubbed', t%rubbed, 'contact of the last step at the rubber''s own points')
      call list_books('tangential/books', t%books, table)
      call list_history('tangential/history', t%history, table)
   end subroutine list_tangential

end module simulation_state
