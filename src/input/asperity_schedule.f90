!> The schedule of a run: the time, load and speed of each row.
!>
!> A phase with a duration consists of steps. It begins with a jump if it is the first one, if its load differs
!> from the previous load and is not ramped, or if it starts relaxed or steady. A steady phase with a
!> velocity of zero is a relaxed one. A phase without a duration is static: one instantaneous solve, or a series
!> of them up to its load.
module asperity_schedule
   use case_settings, only : phase_settings_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: change_load, change_velocity, count_rows, next_row, planned_row_type, schedule_type

   !> The plan of a row.
   type :: planned_row_type
      integer :: phase = 0                        !! number of the phase, from 1
      logical :: instantaneous = .false.          !! a jump or a static solve
      logical :: ramped = .false.                 !! the load has changed linearly up to here
      logical :: relaxed = .false.                !! the load has acted for an infinite time
      logical :: steady = .false.                 !! the road has slid at this velocity infinitely long
      real(dp) :: next_dt = 0.0_dp                !! the step in time after a steady row, s; 0: none
      logical :: new_speed = .false.              !! the speed of the road changed just before
      logical :: new_rate = .false.               !! the rate of the load changed just before
      real(dp) :: time = 0.0_dp                   !! s
      real(dp) :: dt = 0.0_dp                     !! s; 0 where instantaneous
      character(12) :: control = 'pressure'
      real(dp) :: load = 0.0_dp                   !! Pa, N or m
      real(dp) :: load_before = 0.0_dp            !! the same at the start of the step
      real(dp) :: road(2) = 0.0_dp                !! displacement of the road, m
      real(dp) :: velocity(2) = 0.0_dp            !! of the road, m/s
      logical :: pulled(2) = .false.              !! a force pulls the road along x, y
      real(dp) :: pull(2) = 0.0_dp                !! that force, Pa
      real(dp) :: pull_before(2) = 0.0_dp         !! the same at the start of the step, Pa
   end type planned_row_type

   !> The position of a run in its phases. It consists of plain numbers, so that a checkpoint can store it.
   type :: schedule_type
      integer :: row = -1                         !! last row that is done; -1 if none
      integer :: phase = 1                        !! present phase
      integer :: step = 0                         !! number of its steps that are done
      logical :: entered = .false.                !! the row at the start of the phase is done or not needed
      real(dp) :: start_time = 0.0_dp             !! of the phase, s
      real(dp) :: start_load = 0.0_dp             !! its load at the start, in its own control
      real(dp) :: start_road(2) = 0.0_dp          !! displacement of the road at the start, m
      character(12) :: held_control = ''          !! control of the load so far; '' at the start
      real(dp) :: held_load = 0.0_dp
      real(dp) :: held_rate = 0.0_dp              !! rate of the load in the last step, per s
      real(dp) :: velocity(2) = 0.0_dp            !! of the road so far, m/s
      logical :: held_pulled(2) = .false.         !! a force has pulled the road so far
      real(dp) :: held_pull(2) = 0.0_dp           !! that force, Pa
      real(dp) :: start_pull(2) = 0.0_dp          !! force on the road at the start of the phase, Pa
      logical :: speed_changed = .false.          !! by `change_velocity`, since the last row
      logical :: load_changed = .false.           !! by `change_load`, since the last row
      logical :: load_has_changed = .false.       !! by `change_load`, before the last row
   end type schedule_type

contains

   !> Number of rows of a run.
   pure function count_rows(phases) result(rows)
      type(phase_settings_type), intent(in) :: phases(:)
      integer :: rows
      integer :: k
      type(schedule_type) :: held

      rows = 0
      do k = 1, size(phases)
         rows = rows + phases(k)%steps
         if (begins_with_row(phases(k), held)) rows = rows + 1
         call hold(held, phases(k))
      end do
   end function count_rows

   !> Remember the load and the pull with which a phase ends.
   pure subroutine hold(self, phase)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase

      self%held_control = phase%control(:12)
      self%held_load = phase%target
      self%held_pulled = phase%pulled
      self%held_pull = phase%pull
   end subroutine hold

   !> Does a phase begin with an additional row, because its load or its pull jumps?
   pure function begins_with_row(phase, held) result(begins)
      type(phase_settings_type), intent(in) :: phase
      type(schedule_type), intent(in) :: held      !! with the load and the pull held so far
      logical :: begins

      begins = .false.
      if (phase%static) return
      begins = held%held_control == '' .or. phase%relaxed .or. phase%steady
      if (phase%linear) return
      begins = begins .or. held%held_control /= phase%control(:12) .or. &
         abs(held%held_load - phase%target) > 0.0_dp
      begins = begins .or. any(phase%pulled .and. (.not. held%held_pulled .or. &
         abs(held%held_pull - phase%pull) > 0.0_dp))
   end function begins_with_row

   !> Plan the next row, and advance the schedule. `finished` is true if no row is left.
   subroutine next_row(self, phases, present_load, present_pull, row, finished)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phases(:)
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement now
      real(dp), intent(in) :: present_pull(2)      !! horizontal force of the road on the rubber now, Pa
      type(planned_row_type), intent(out) :: row
      logical, intent(out) :: finished
      real(dp) :: part

      finished = self%phase > size(phases)
      if (finished) return

      associate (phase => phases(self%phase))
         if (self%step == 0 .and. .not. self%entered) &
            call enter_phase(self, phase, present_load, present_pull, row)
         row%new_speed = row%new_speed .or. self%speed_changed
         self%speed_changed = .false.
         row%phase = self%phase
         row%control = phase%control(:12)
         row%velocity = [phase%velocity_x, phase%velocity_y]
         row%pulled = phase%pulled
         row%pull = phase%pull

         if (.not. self%entered .and. begins_with_row(phase, self)) then
            call plan_jump(self, phase, row)
         else
            call plan_step(self, phase, present_load, row)
         end if

         row%relaxed = phase%relaxed .and. row%instantaneous
         if (phase%steady .and. row%instantaneous) call plan_steady(phase, row)
         row%ramped = phase%linear .and. self%step > 0 .and. self%row >= 0
         self%entered = .true.

         part = real(self%step, dp)/phase%steps
         row%time = self%start_time + part*phase%duration
         row%road = self%start_road + part*phase%duration*row%velocity
         self%row = self%row + 1
         if (self%step == phase%steps) call leave_phase(self, phase, row)
      end associate
   end subroutine next_row

   !> Begin a phase: find the values from which its load and its pull start, and whether its speed is new.
   subroutine enter_phase(self, phase, present_load, present_pull, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement now
      real(dp), intent(in) :: present_pull(2)      !! horizontal force of the road on the rubber now, Pa
      type(planned_row_type), intent(inout) :: row

      row%new_speed = any(abs([phase%velocity_x, phase%velocity_y] - self%velocity) > 0.0_dp) .or. &
         any(phase%pulled .neqv. self%held_pulled)
      self%start_pull = merge(self%held_pull, present_pull, self%held_pulled)
      self%start_load = load_at_start(self, phase, present_load)
      self%velocity = [phase%velocity_x, phase%velocity_y]
   end subroutine enter_phase

   !> Plan the row at the start of a phase: a jump, or the state after an infinite time.
   subroutine plan_jump(self, phase, row)
      type(schedule_type), intent(in) :: self
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(inout) :: row

      row%instantaneous = .true.
      row%load = self%start_load
      if (.not. phase%linear) row%load = phase%target
      if (phase%linear) row%pull = merge(self%start_pull, 0.0_dp, phase%pulled)
   end subroutine plan_jump

   !> Plan the next step of a phase.
   subroutine plan_step(self, phase, present_load, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement now
      type(planned_row_type), intent(inout) :: row
      real(dp) :: part, part_before

      part_before = real(self%step, dp)/phase%steps
      self%step = self%step + 1
      part = real(self%step, dp)/phase%steps
      row%instantaneous = phase%static
      row%dt = phase%dt
      row%load = phase%target
      row%load_before = phase%target
      row%pull_before = row%pull
      if (phase%linear) then
         row%load = self%start_load + part*(phase%target - self%start_load)
         row%load_before = self%start_load + part_before*(phase%target - self%start_load)
         row%pull = merge(self%start_pull + part*(phase%pull - self%start_pull), 0.0_dp, phase%pulled)
         row%pull_before = merge(self%start_pull + part_before*(phase%pull - self%start_pull), 0.0_dp, &
            phase%pulled)
      end if
      if (self%step == phase%steps) then
         row%load = phase%target
         row%pull = phase%pull
      end if
      if (phase%static) return
      if (self%step == 1) call note_rate(self, phase, row)
      call note_change(self, present_load, row)
      if (self%step == 1 .and. phase%linear .and. any(phase%pulled)) row%new_rate = .true.
   end subroutine plan_step

   !> Plan a row of steady sliding. With a velocity of zero it is a relaxed state.
   subroutine plan_steady(phase, row)
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(inout) :: row

      row%steady = abs(phase%velocity_x) > 0.0_dp .or. abs(phase%velocity_y) > 0.0_dp
      row%relaxed = .not. row%steady
      row%next_dt = phase%dt
   end subroutine plan_steady

   !> Leave a phase after its last step is planned: the next row belongs to the following phase.
   subroutine leave_phase(self, phase, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(in) :: row

      self%start_time = row%time
      self%start_road = row%road
      call hold(self, phase)
      self%phase = self%phase + 1
      self%step = 0
      self%entered = .false.
   end subroutine leave_phase

   !> Plan a load that was changed within a phase: it is ramped over one step, with a kink at the start and one at
   !> the end of this step.
   subroutine note_change(self, present_load, row)
      type(schedule_type), intent(inout) :: self
      real(dp), intent(in) :: present_load(3)
      type(planned_row_type), intent(inout) :: row

      if (.not. (self%load_changed .or. self%load_has_changed)) return
      if (self%load_changed) row%load_before = load_in(row%control, present_load)
      call compare_rate(self, (row%load - row%load_before)/row%dt, row)
      self%load_has_changed = self%load_changed
      self%load_changed = .false.
   end subroutine note_change

   !> Prescribe another load from the last row on, in the present and all later phases.
   subroutine change_load(self, phases, control, load)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(inout) :: phases(:)
      character(*), intent(in) :: control          !! 'pressure' | 'force' | 'displacement'
      real(dp), intent(in) :: load                 !! Pa, N or m
      integer :: k

      if (self%phase > size(phases)) return
      if (self%entered .and. .not. holds(phases(self%phase), control, load)) then
         self%load_changed = .true.
         ! The rate of the old quantity cannot be compared with that of the new one.
         if (phases(self%phase)%control /= control) self%held_rate = huge(1.0_dp)
      end if
      do k = self%phase, size(phases)
         phases(k)%control = control
         phases(k)%target = load
         phases(k)%given = .true.
         phases(k)%linear = .false.
      end do
   end subroutine change_load

   !> Does a phase hold this load already? The load that was reached differs from it by round-off, which must not count
   !> as a change.
   pure logical function holds(phase, control, load)
      type(phase_settings_type), intent(in) :: phase
      character(*), intent(in) :: control
      real(dp), intent(in) :: load                 !! Pa, N or m

      holds = phase%control == control .and. .not. phase%linear .and. .not. abs(phase%target - load) > 0.0_dp
   end function holds

   !> Let the road move with another velocity from the last row on, in the present and all later phases.
   subroutine change_velocity(self, phases, velocity, road)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(inout) :: phases(:)
      real(dp), intent(in) :: velocity(2)          !! m/s
      real(dp), intent(in) :: road(2)              !! displacement of the road at the last row, m
      real(dp) :: elapsed
      integer :: k

      if (self%phase > size(phases)) return
      if (self%entered) then
         self%speed_changed = self%speed_changed .or. any(abs(velocity - self%velocity) > 0.0_dp)
         ! The position of the road is computed from the start of the phase. That start is moved, so that the road
         ! seems to have had the new velocity throughout the phase.
         elapsed = real(self%step, dp)/phases(self%phase)%steps*phases(self%phase)%duration
         self%start_road = road - elapsed*velocity
         self%velocity = velocity
      end if
      do k = self%phase, size(phases)
         phases(k)%velocity_x = velocity(1)
         phases(k)%velocity_y = velocity(2)
         phases(k)%pulled = .false.
         phases(k)%pull = 0.0_dp
      end do
   end subroutine change_velocity

   !> Note the rate of a phase's load, and whether it differs from that of the step before.
   subroutine note_rate(self, phase, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(inout) :: row
      real(dp) :: rate

      rate = 0.0_dp
      if (phase%linear) rate = (phase%target - self%start_load)/phase%duration
      call compare_rate(self, rate, row)
      if (self%held_control /= phase%control(:12)) row%new_rate = .true.
   end subroutine note_rate

   !> Decide whether the rate of the load has a kink, and keep the new rate.
   pure subroutine compare_rate(self, rate, row)
      type(schedule_type), intent(inout) :: self
      real(dp), intent(in) :: rate                 !! in the present step, per s
      type(planned_row_type), intent(inout) :: row
      real(dp), parameter :: kink = 0.25_dp        !! relative change of a rate that counts as a kink

      row%new_rate = abs(rate - self%held_rate) > kink*max(abs(rate), abs(self%held_rate))
      self%held_rate = rate
   end subroutine compare_rate

   !> The load from which a phase's ramp starts, in the phase's control.
   pure function load_at_start(self, phase, present_load) result(load)
      type(schedule_type), intent(in) :: self
      type(phase_settings_type), intent(in) :: phase
      real(dp), intent(in) :: present_load(3)
      real(dp) :: load

      if (self%held_control == phase%control(:12)) then
         load = self%held_load
      else if (self%held_control == '') then
         load = 0.0_dp
      else
         load = load_in(phase%control(:12), present_load)
      end if
   end function load_at_start

   !> The present value of the quantity that the control names.
   pure function load_in(control, present_load) result(load)
      character(12), intent(in) :: control
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement
      real(dp) :: load

      select case (control)
      case ('pressure')
         load = present_load(1)
      case ('force')
         load = present_load(2)
      case default
         load = present_load(3)
      end select
   end function load_in

end module asperity_schedule
