!> The rows of a run: which solve comes next, at what time, under what load and speed.
!>
!> A phase with a duration begins with a jump where it is the first, where its load differs from the
!> one held so far and is not ramped, or where it starts relaxed or steady; then come its steps.
!> A steady phase at rest is a relaxed one. A phase
!> without a duration is static: one instantaneous solve, or a series of them up to its load.
module asperity_schedule
   use case_settings, only : phase_settings_type
   use asperity_precision, only : dp
   implicit none
   private

   public :: change_load, change_velocity, count_rows, next_row, planned_row_type, schedule_type

   !> What a row asks for.
   type :: planned_row_type
      integer :: phase = 0                        !! number of the phase, from 1
      logical :: instantaneous = .false.          !! a jump or a static solve
      logical :: ramped = .false.                 !! the load has come here along a straight line
      logical :: relaxed = .false.                !! the load has rested for ever
      logical :: steady = .false.                 !! the road has slid for ever at this velocity
      real(dp) :: next_dt = 0.0_dp                !! the step in time after a steady row, s; 0: none
      logical :: new_speed = .false.              !! the speed of the road changed just before
      logical :: new_rate = .false.               !! the rate of the load changed just before
      real(dp) :: time = 0.0_dp                   !! s
      real(dp) :: dt = 0.0_dp                     !! s; 0 where instantaneous
      character(12) :: control = 'pressure'
      real(dp) :: load = 0.0_dp                   !! Pa, N or m
      real(dp) :: load_before = 0.0_dp            !! the same at the start of the step
      real(dp) :: road_x = 0.0_dp                 !! displacement of the road, m
      real(dp) :: road_y = 0.0_dp
      real(dp) :: velocity_x = 0.0_dp             !! of the road, m/s
      real(dp) :: velocity_y = 0.0_dp
      logical :: pulled(2) = .false.              !! the road hangs on a force along x, y
      real(dp) :: pull(2) = 0.0_dp                !! that force, Pa
      real(dp) :: pull_before(2) = 0.0_dp         !! the same at the start of the step, Pa
   end type planned_row_type

   !> Where a run stands. Plain numbers, so that a checkpoint can hold them.
   type :: schedule_type
      integer :: row = -1                         !! last row done; -1: none
      integer :: phase = 1                        !! phase in hand
      integer :: step = 0                         !! steps of it that are done
      logical :: entered = .false.                !! its first row is done or not needed
      real(dp) :: start_time = 0.0_dp             !! of the phase, s
      real(dp) :: start_load = 0.0_dp             !! its load at the start, in its own control
      real(dp) :: start_x = 0.0_dp                !! displacement of the road at the start, m
      real(dp) :: start_y = 0.0_dp
      character(12) :: held_control = ''          !! load held so far; '' before the first phase
      real(dp) :: held_load = 0.0_dp
      real(dp) :: held_rate = 0.0_dp              !! rate of the load in the last step, over s
      real(dp) :: velocity_x = 0.0_dp             !! of the road so far, m/s
      real(dp) :: velocity_y = 0.0_dp
      logical :: held_pulled(2) = .false.         !! the road hung on a force so far
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

   !> Hold what a phase ends with.
   pure subroutine hold(self, phase)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase

      self%held_control = phase%control(:12)
      self%held_load = phase%target
      self%held_pulled = phase%pulled
      self%held_pull = phase%pull
   end subroutine hold

   !> Does a phase begin with a row of its own, for a load or a pull that jumps?
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

   !> The next row, and the schedule behind it; `finished` where there is none.
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
         row%velocity_x = phase%velocity_x
         row%velocity_y = phase%velocity_y
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
         row%road_x = self%start_x + part*phase%duration*phase%velocity_x
         row%road_y = self%start_y + part*phase%duration*phase%velocity_y
         self%row = self%row + 1
         if (self%step == phase%steps) call leave_phase(self, phase, row)
      end associate
   end subroutine next_row

   !> A phase begins: what its load and its pull start from, and whether its speed is new.
   subroutine enter_phase(self, phase, present_load, present_pull, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement now
      real(dp), intent(in) :: present_pull(2)      !! horizontal force of the road on the rubber now, Pa
      type(planned_row_type), intent(inout) :: row

      row%new_speed = abs(phase%velocity_x - self%velocity_x) > 0.0_dp .or. &
         abs(phase%velocity_y - self%velocity_y) > 0.0_dp .or. &
         any(phase%pulled .neqv. self%held_pulled)
      self%start_pull = merge(self%held_pull, present_pull, self%held_pulled)
      self%start_load = load_at_start(self, phase, present_load)
      self%velocity_x = phase%velocity_x
      self%velocity_y = phase%velocity_y
   end subroutine enter_phase

   !> The row with which a phase begins at once: a jump, or a state in which it has rested for ever.
   subroutine plan_jump(self, phase, row)
      type(schedule_type), intent(in) :: self
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(inout) :: row

      row%instantaneous = .true.
      row%load = self%start_load
      if (.not. phase%linear) row%load = phase%target
      if (phase%linear) row%pull = merge(self%start_pull, 0.0_dp, phase%pulled)
   end subroutine plan_jump

   !> The next step of a phase.
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

   !> A row of steady sliding; with a velocity of zero it is one of rest.
   subroutine plan_steady(phase, row)
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(inout) :: row

      row%steady = abs(phase%velocity_x) > 0.0_dp .or. abs(phase%velocity_y) > 0.0_dp
      row%relaxed = .not. row%steady
      row%next_dt = phase%dt
   end subroutine plan_steady

   !> The last step of a phase is planned: the next row belongs to the phase that follows.
   subroutine leave_phase(self, phase, row)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(in) :: phase
      type(planned_row_type), intent(in) :: row

      self%start_time = row%time
      self%start_x = row%road_x
      self%start_y = row%road_y
      call hold(self, phase)
      self%phase = self%phase + 1
      self%step = 0
      self%entered = .false.
   end subroutine leave_phase

   !> A load that was changed within a phase is a ramp over one step: a kink at its start and its end.
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

   !> Prescribe another load from the last row on: in the phase in hand and all later.
   subroutine change_load(self, phases, control, load)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(inout) :: phases(:)
      character(*), intent(in) :: control          !! 'pressure' | 'force' | 'displacement'
      real(dp), intent(in) :: load                 !! Pa, N or m
      integer :: k

      if (self%phase > size(phases)) return
      if (self%entered) then
         self%load_changed = .true.
         ! The rate of another quantity says nothing of that of the new one.
         if (phases(self%phase)%control /= control) self%held_rate = huge(1.0_dp)
      end if
      do k = self%phase, size(phases)
         phases(k)%control = control
         phases(k)%target = load
         phases(k)%given = .true.
         phases(k)%linear = .false.
      end do
   end subroutine change_load

   !> Let the road move with another velocity from the last row on: in the phase in hand and all later.
   subroutine change_velocity(self, phases, velocity, road)
      type(schedule_type), intent(inout) :: self
      type(phase_settings_type), intent(inout) :: phases(:)
      real(dp), intent(in) :: velocity(2)          !! m/s
      real(dp), intent(in) :: road(2)              !! displacement of the road at the last row, m
      real(dp) :: elapsed
      integer :: k

      if (self%phase > size(phases)) return
      if (self%entered) then
         self%speed_changed = self%speed_changed .or. abs(velocity(1) - self%velocity_x) > 0.0_dp .or. &
            abs(velocity(2) - self%velocity_y) > 0.0_dp
         ! The road's place is computed from the start of the phase, as if it had always moved so.
         elapsed = real(self%step, dp)/phases(self%phase)%steps*phases(self%phase)%duration
         self%start_x = road(1) - elapsed*velocity(1)
         self%start_y = road(2) - elapsed*velocity(2)
         self%velocity_x = velocity(1)
         self%velocity_y = velocity(2)
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

   !> Say whether the rate of the load has a kink, and keep the new rate.
   pure subroutine compare_rate(self, rate, row)
      type(schedule_type), intent(inout) :: self
      real(dp), intent(in) :: rate                 !! of the step in hand, over s
      type(planned_row_type), intent(inout) :: row
      real(dp), parameter :: kink = 0.25_dp        !! relative change of a rate that is more than the bend of a curve

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

   !> The load as a quantity has it.
   pure function load_in(control, present_load) result(load)
      character(12), intent(in) :: control
      real(dp), intent(in) :: present_load(3)      !! pressure, force and displacement
      real(dp) :: load

      load = present_load(findloc([character(12) :: 'pressure', 'force', 'displacement'], control, dim=1))
   end function load_in

end module asperity_schedule
