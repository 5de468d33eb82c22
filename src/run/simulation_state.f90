!> The state of a run in a checkpoint: all that `advance` needs to go on to the same numbers.
module simulation_state
   use checkpoint, only : checkpoint_reader_type, checkpoint_writer_type
   use errors, only : error_type
   use history_row, only : column_count, row_from_values, row_values
   use pass_watch, only : pass_watch_from_values, pass_watch_values
   use precision, only : dp, int8
   use simulation, only : simulation_type
   use stick_slip_watch, only : watch_from_values, watch_values
   use viscoelastic_energy, only : books_from_values, books_values
   use zener, only : is_elastic
   implicit none
   private

   public :: load_state, save_state

   integer, parameter :: schedule_values = 11

contains

   !> Put the state into a checkpoint.
   subroutine save_state(sim, writer, error)
      type(simulation_type), intent(in) :: sim
      type(checkpoint_writer_type), intent(inout) :: writer
      type(error_type), allocatable, intent(out) :: error

      associate (s => sim%schedule)
         call writer%put('schedule', [real(s%row, dp), real(s%phase, dp), real(s%step, dp), &
            merge(1.0_dp, 0.0_dp, s%entered), s%start_time, s%start_load, s%start_x, s%start_y, &
            s%held_load, s%velocity_x, s%velocity_y], '1', error)
         if (allocated(error)) return
         call writer%put('held_control', s%held_control, error)
         if (allocated(error)) return
      end associate
      call writer%put('row', row_values(sim%row), '1', error)
      if (allocated(error)) return
      call writer%put('motion', [sim%direction, sim%drive_force, sim%velocity, sim%drifted, &
         real(sim%moved_cells, dp), sim%level], '1', error)
      if (allocated(error)) return
      call writer%put('watches', [watch_values(sim%watch), real(sim%edge, dp), &
         pass_watch_values(sim%pass_watch)], '1', error)
      if (allocated(error)) return
      call writer%put('pressure', sim%pressure, 'Pa', error)
      if (allocated(error)) return
      call writer%put('gap', sim%gap, 'm', error)
      if (allocated(error)) return
      call writer%put('displacement_z', sim%displacement, 'm', error)
      if (allocated(error)) return
      call writer%put('books', books_values(sim%books), 'J', error)
      if (allocated(error)) return
      if (sim%frictional) call save_tangential(sim, writer, error)
      if (allocated(error)) return
      if (is_elastic(sim%material)) return
      call writer%put('dt_old', sim%material%dt_old, error)
      if (allocated(error)) return
      call writer%put('history_s', sim%history%s, 'Pa', error)
      if (allocated(error)) return
      if (size(sim%history%ds) > 0) call writer%put('history_ds', sim%history%ds, 'Pa', error)
      if (allocated(error)) return
      call writer%put('history_arm', sim%history%arm, 'Pa', error)
   end subroutine save_state

   !> Take the state from a checkpoint into a new simulation of the same case.
   subroutine load_state(sim, reader, error)
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: numbers(schedule_values), row(column_count), motion(11), watches(7)
      real(dp), allocatable :: books(:)
      character(:), allocatable :: control

      call reader%get('schedule', numbers, error)
      if (allocated(error)) return
      call reader%get('held_control', control, error)
      if (allocated(error)) return
      associate (s => sim%schedule)
         s%row = nint(numbers(1))
         s%phase = nint(numbers(2))
         s%step = nint(numbers(3))
         s%entered = numbers(4) > 0.5_dp
         s%start_time = numbers(5)
         s%start_load = numbers(6)
         s%start_x = numbers(7)
         s%start_y = numbers(8)
         s%held_load = numbers(9)
         s%velocity_x = numbers(10)
         s%velocity_y = numbers(11)
         s%held_control = control
      end associate
      call reader%get('row', row, error)
      if (allocated(error)) return
      sim%row = row_from_values(row)
      call reader%get('motion', motion, error)
      if (allocated(error)) return
      sim%direction = motion(1:2)
      sim%drive_force = motion(3:4)
      sim%velocity = motion(5:6)
      sim%drifted = motion(7:8)
      sim%moved_cells = nint(motion(9:10))
      sim%level = motion(11)
      call reader%get('watches', watches, error)
      if (allocated(error)) return
      sim%watch = watch_from_values(watches(1:4))
      sim%edge = nint(watches(5))
      sim%pass_watch = pass_watch_from_values(watches(6:7))
      sim%first = .false.
      call reader%get('pressure', sim%pressure, error)
      if (allocated(error)) return
      call reader%get('gap', sim%gap, error)
      if (allocated(error)) return
      call reader%get('displacement_z', sim%displacement, error)
      if (allocated(error)) return
      allocate (books, source=books_values(sim%books))
      call reader%get('books', books, error)
      if (allocated(error)) return
      sim%books = books_from_values(books)
      if (sim%frictional) call load_tangential(sim, reader, error)
      if (allocated(error)) return
      if (.not. is_elastic(sim%material)) then
         call reader%get('dt_old', sim%material%dt_old, error)
         if (allocated(error)) return
         call reader%get('history_s', sim%history%s, error)
         if (allocated(error)) return
         if (size(sim%history%ds) > 0) call reader%get('history_ds', sim%history%ds, error)
         if (allocated(error)) return
         call reader%get('history_arm', sim%history%arm, error)
         if (allocated(error)) return
      end if
      call sim%place_road(sim%row%road_x, sim%row%road_y)
      sim%finished = sim%schedule%phase > size(sim%case%phases)
   end subroutine load_state

   !> The tangential part of the state.
   subroutine save_tangential(sim, writer, error)
      type(simulation_type), intent(in) :: sim
      type(checkpoint_writer_type), intent(inout) :: writer
      type(error_type), allocatable, intent(out) :: error

      associate (t => sim%tangential)
         call writer%put('tangential', [merge(1.0_dp, 0.0_dp, t%moved), t%speed, t%rate, t%work_mass, &
            t%lost_mass, t%lost_friction, t%pace], '1', error)
         if (allocated(error)) return
         call writer%put('traction', t%traction, 'Pa', error)
         if (allocated(error)) return
         call writer%put('contact', real(t%contact, dp), '1', error)
         if (allocated(error)) return
         call writer%put('traction_before', t%before, 'Pa', error)
         if (allocated(error)) return
         call writer%put('displacement', t%displacement, 'm', error)
         if (allocated(error)) return
         call writer%put('tangential_books', books_values(t%books), 'J', error)
         if (allocated(error) .or. is_elastic(sim%material)) return
         call writer%put('tangential_s', t%history%s, 'Pa', error)
         if (allocated(error)) return
         if (size(t%history%ds) > 0) call writer%put('tangential_ds', t%history%ds, 'Pa', error)
         if (allocated(error)) return
         call writer%put('tangential_arm', t%history%arm, 'Pa', error)
      end associate
   end subroutine save_tangential

   !> The same from a checkpoint.
   subroutine load_tangential(sim, reader, error)
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: numbers(9)
      real(dp), allocatable :: books(:), states(:, :)

      associate (t => sim%tangential)
         call reader%get('tangential', numbers, error)
         if (allocated(error)) return
         t%moved = numbers(1) > 0.5_dp
         t%speed = numbers(2:3)
         t%rate = numbers(4:5)
         t%work_mass = numbers(6)
         t%lost_mass = numbers(7)
         t%lost_friction = numbers(8)
         t%pace = numbers(9)
         call reader%get('traction', t%traction, error)
         if (allocated(error)) return
         states = real(t%contact, dp)
         call reader%get('contact', states, error)
         if (allocated(error)) return
         t%contact = nint(states, int8)
         call reader%get('traction_before', t%before, error)
         if (allocated(error)) return
         call reader%get('displacement', t%displacement, error)
         if (allocated(error)) return
         allocate (books, source=books_values(t%books))
         call reader%get('tangential_books', books, error)
         if (allocated(error)) return
         t%books = books_from_values(books)
         if (is_elastic(sim%material)) return
         call reader%get('tangential_s', t%history%s, error)
         if (allocated(error)) return
         if (size(t%history%ds) > 0) call reader%get('tangential_ds', t%history%ds, error)
         if (allocated(error)) return
         call reader%get('tangential_arm', t%history%arm, error)
      end associate
   end subroutine load_tangential

end module simulation_state
