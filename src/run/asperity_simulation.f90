!> The step loop: a rubber block pressed on a road and moved over it.
!>
!> A row of the history is one solve: `advance` takes the next row from the schedule, moves the road, solves the
!> contact, ends the step of the material and books the energies. The caller writes files or fills arrays.
!>
!> Everything that a row leaves to the next is in the component `state` (module `row_state`), which can be saved
!> and restored (module `simulation_state`). `propose` finds the next state without changing the present
!> one; `accept` makes it the present state, and `reject` discards it. `advance` does the same as `propose` and
!> `accept` without keeping two states in memory.
!>
!> Module `road_motion` moves the road at the start of a row, module `coupled_passes` solves a row with
!> friction in passes, and module `row_account` fills the row of the history.
module asperity_simulation
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int64
   use asperity_schedule, only : next_row, planned_row_type
   use asperity_surface, only : new_height
   use case_settings, only : case_type, road_moves
   use contact_model, only : commit_step, contact_type, new_contact, place_road, solve_normal
   use coupled_passes, only : coupled_passes_type, new_coupled_passes
   use coupling_advice, only : advice_on_passes, advice_on_slopes
   use field_sums, only : field_mean
   use history_table, only : row_values
   use normal_state, only : reason_undetermined
   use pulled_road, only : guess_road, pull_outcome, place_pulled_road, watch_motion
   use rising_clock, only : seconds_now
   use road_motion, only : move_road
   use row_account, only : account, found_step_type
   use row_state, only : state_type
   use starting_steps, only : part_sums_type, split_start
   use steady_row, only : solve_steady_row
   use steady_step, only : new_steady_step, steady_step_type
   use step_watches, only : add_warning, watch_cells, watch_edge, watch_stick_slip
   use solver_result, only : solver_result_type
   use text_tools, only : to_text
   use arm_state, only : past_traction
   use zener, only : extrapolates, is_elastic, needs_start, restart_order, start_jump, &
      start_relaxed, start_step
   implicit none
   private

   public :: new_simulation, simulation_type

   !> Largest accepted mismatch of the passes if the case limits their number and gives no
   !> `coupling_tolerance`: the mean friction of a run is then right within 1 %. A larger mismatch is reported
   !> in a warning.
   real(dp), parameter :: large_mismatch = 1.0e-2_dp

   !> A run. A variable of this type must not be copied, but its state may be.
   type, extends(contact_type) :: simulation_type
      logical :: converged = .true.                 !! the last row's solvers met the tolerance
      logical :: finished = .false.                 !! no row is left
      character(:), allocatable :: reason           !! why not converged
      real(dp), private :: residual = 0.0_dp        !! the error that is too large, or the residual of the normal solver
      real(dp), private :: allowed = 0.0_dp         !! the largest that would have been accepted
      character(:), allocatable :: warnings         !! new ones, one per line; the caller clears them
      type(state_type), allocatable :: proposed     !! found by `propose`, not yet accepted
      integer, private :: old_warnings = 0          !! characters of `warnings` before the proposal
      type(coupled_passes_type), private :: passes
      type(steady_step_type) :: steady              !! solves rows of steady sliding
      logical :: has_steady = .false.               !! some phase is steady
      integer(int64), allocatable :: map_checksums(:)   !! of the height maps that are files, by term
   contains
      procedure :: advance
      procedure :: propose
      procedure :: accept
      procedure :: reject
      procedure :: failure
      procedure :: resume
      procedure :: destroy
   end type simulation_type

contains

   !> Prepare a run: surface, operators, fields.
   subroutine new_simulation(self, case, error, movable)
      type(simulation_type), intent(out) :: self
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: movable      !! the road may be moved although no phase does so

      call case%check_read(error)
      if (allocated(error)) return
      self%case = case
      self%grid = case%grid
      call self%grid%share_rows()
      self%warnings = ''
      self%reason = ''
      allocate (self%state)
      self%slides = road_moves(case%phases)
      if (present(movable)) self%slides = self%slides .or. movable
      call new_height(self%grid, case%surfaces, self%height, error, self%map_checksums)
      if (.not. allocated(error)) call new_contact(self, error)
      if (allocated(error)) return
      if (self%frictional) call new_coupled_passes(self%passes, self%grid, sharing=self%tangential%law%jumps_at_edge())
      self%has_steady = self%slides .and. any(case%phases%steady)
      if (self%has_steady) &
         call new_steady_step(self%steady, self%state%steady, case, self%rms_height, error)
   end subroutine new_simulation

   !> Find the state after the next row, without changing the present one. If the solvers do not converge, the
   !> state that they have reached is proposed. After an error nothing is proposed.
   subroutine propose(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(state_type), allocatable :: present_state

      if (allocated(self%proposed)) deallocate (self%proposed)
      if (allocated(self%state)) allocate (present_state, source=self%state)
      if (allocated(self%warnings)) self%old_warnings = len(self%warnings)
      call self%advance(error)
      if (.not. allocated(error)) call move_alloc(self%state, self%proposed)
      if (allocated(present_state)) call move_alloc(present_state, self%state)
   end subroutine propose

   !> Make the proposed state the present one.
   subroutine accept(self)
      class(simulation_type), intent(inout) :: self

      if (allocated(self%proposed)) call move_alloc(self%proposed, self%state)
   end subroutine accept

   !> Discard the proposed state and its warnings.
   subroutine reject(self)
      class(simulation_type), intent(inout) :: self

      if (.not. allocated(self%proposed)) return
      deallocate (self%proposed)
      self%warnings = self%warnings(:self%old_warnings)
      self%converged = .true.
      self%reason = ''
      call self%resume()
   end subroutine reject

   !> Prepare to continue from `state`, which the caller has replaced.
   subroutine resume(self)
      class(simulation_type), intent(inout) :: self

      call place_road(self, self%state%row%road_x, self%state%row%road_y)
      if (self%friction_acts()) call find_heights(self)
      self%slip_known = .not. self%frictional
      self%finished = self%state%schedule%phase > size(self%case%phases)
   end subroutine resume

   !> Find the heights of the road under a surface that friction has moved, from the displacement and the gap.
   subroutine find_heights(self)
      class(simulation_type), intent(inout) :: self
      integer :: j

      if (self%state%steady%now .or. .not. allocated(self%state%displacement)) return
      !$omp parallel do default(none) shared(self) private(j)
      do j = 1, self%grid%rows()
         self%height(:, j) = self%state%displacement(:, j) - self%state%gap(:, j) - self%state%level
      end do
   end subroutine find_heights

   !> Do the next row. If the solvers do not converge, the state that they have reached is kept. After a row that
   !> was given up (`stop%given_up`) the state is that of the row before.
   subroutine advance(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (.not. allocated(self%state)) then
         call fail(error, error_input, 'the simulation was not made, or it was destroyed')
         return
      else if (self%finished) then
         call fail(error, error_input, 'the simulation is finished: there is no further row')
         return
      end if
      if (allocated(self%proposed)) deallocate (self%proposed)
      call self%stop%keep(self%state)
      call do_row(self, error)
      call self%stop%release()
   end subroutine advance

   !> Do a row, in one part or in several.
   subroutine do_row(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(planned_row_type) :: plan
      type(planned_row_type), allocatable :: parts(:)
      type(part_sums_type) :: sums
      integer :: k

      call check_control(self, error)
      if (allocated(error)) return
      call plan_row(self, plan, parts)
      if (self%finished) return
      if (size(parts) > 1) call self%stop%keep_more(self%state)
      do k = 1, size(parts)
         call take_step(self, parts(k), error)
         if (allocated(error)) return
         if (self%stop%given_up) then
            call self%stop%restore(self%state)
            call self%resume()
            return
         end if
         call self%stop%part_ends()
         call sums%add(parts(k)%dt, self%state%row, self%tangential%slip)
         if (.not. self%converged) exit
      end do
      if (size(parts) > 1) call sums%put_into(self%state%row, self%tangential%slip)
      self%slip_known = .true.
      call watch_cells(self, plan, self%warnings)
      call check_finite(self)
      self%finished = self%state%schedule%phase > size(self%case%phases)
   end subroutine do_row

   !> Refuse a row of steady sliding under a prescribed displacement. The input cannot ask for it, but a load that a caller
   !> has set between two rows can.
   subroutine check_control(self, error)
      type(simulation_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error

      associate (now => self%state%schedule, phases => self%case%phases)
         if (now%phase > size(phases) .or. now%entered) return
         if (phases(now%phase)%steady .and. phases(now%phase)%control == 'displacement') &
            call fail(error, error_input, 'displacement: the next row is the steady state of phase '//to_text(now%phase)// &
            ', for which the displacement cannot be prescribed: set pressure or force')
      end associate
   end subroutine check_control

   !> Plan the next row of the schedule, and the parts in which its step is taken.
   subroutine plan_row(self, plan, parts)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(out) :: plan
      type(planned_row_type), allocatable, intent(out) :: parts(:)

      self%material%dt_old = self%state%dt_old
      associate (state => self%state, row => self%state%row)
         call next_row(state%schedule, self%case%phases, [row%pressure, row%force, row%displacement], &
            present_pull(self), plan, self%finished)
         if (self%finished) return
         call split_start(plan, needs_start(self%material) .or. plan%new_speed .or. plan%new_rate, &
            extrapolates(self%material), [row%road_x, row%road_y], parts)
      end associate
   end subroutine plan_row

   !> The horizontal force from which a pull that grows starts, Pa. On true slopes it is the sum of T, which is 0 before the
   !> road has moved; the sum of -P grad H over a contact at rest would only be an error of the mesh.
   pure function present_pull(self) result(pull)
      type(simulation_type), intent(in) :: self
      real(dp) :: pull(2)

      pull = 0.0_dp
      if (self%case%friction%slope_effect .and. self%all_cells_stick()) return
      pull = self%state%drive_force/self%grid%area()
   end function present_pull

   !> Take one step of a row, and fill the row of the history.
   subroutine take_step(self, plan, error)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(inout) :: plan      !! out: the position of the road, if a force pulls it
      type(error_type), allocatable, intent(out) :: error
      type(found_step_type) :: found
      real(dp) :: start

      call begin_step(self, plan, error)
      if (allocated(error)) return
      start = seconds_now()
      call solve_step(self, plan, found)
      if (self%stop%given_up) return
      call judge(self, plan, found)
      if (.not. plan%steady) call commit_step(self)
      found%normal%seconds = seconds_now() - start
      call watch_edge(self, plan, self%warnings)
      call account(self, plan, found)
      call watch_stick_slip(self, plan, self%warnings)
   end subroutine take_step

   !> Set the coefficients of the material for the step, and move the road to where it is expected.
   subroutine begin_step(self, plan, error)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(inout) :: plan
      type(error_type), allocatable, intent(out) :: error

      call guess_road(plan, [self%state%row%road_x, self%state%row%road_y], self%state%velocity)
      if (plan%new_speed .or. plan%new_rate) call restart_order(self%material)
      if (plan%new_speed .and. self%frictional) self%state%tangential%block%fresh = .true.
      if (plan%relaxed) then
         call start_relaxed(self%material, error)
      else if (plan%instantaneous) then
         call start_jump(self%material)
      else
         call start_step(self%material, plan%dt)
      end if
   end subroutine begin_step

   !> Solve a step: find the pressure, the tractions and the position of the road at its end.
   subroutine solve_step(self, plan, found)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(inout) :: plan
      type(found_step_type), intent(out) :: found
      real(dp) :: road(2), motion(2)
      character(:), allocatable :: message

      found%tangential%converged = .true.
      if (plan%steady) then
         call solve_steady_row(self, self%steady, plan, found)
         self%stop%given_up = found%normal%stopped
         return
      end if
      associate (state => self%state)
         state%steady%now = .false.
         road = [state%row%road_x, state%row%road_y]
         motion = plan%road - road
         if (.not. is_elastic(self%material)) call past_traction(state%arms, self%material, self%past)
         if (self%frictional) call self%tangential%begin(state%tangential, self%material, motion, &
            plan%dt, plan%pulled, plan%pull)
         call move_road(self, plan)
         if (self%friction_acts()) then
            call self%passes%solve(self, plan, motion, found%normal, found%tangential)
            if (self%stop%given_up) return
            found%passes = self%passes%passes
            found%mismatch = self%passes%mismatch
         else
            call solve_normal(self, plan, self%case%solver%tolerance, found%normal)
            self%stop%given_up = found%normal%stopped
            if (self%stop%given_up) return
         end if
         if (self%frictional) then
            call place_pulled_road(plan, state%schedule, self%tangential, self%friction_acts(), road, state%velocity)
            call watch_motion(plan, self%grid, road, state%motion_reported, message)
            call add_warning(self%warnings, state%schedule%row, plan%time, message)
         end if
      end associate
   end subroutine solve_step

   !> Decide whether a step has converged, and note the reason if it has not.
   subroutine judge(self, plan, found)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      type(found_step_type), intent(in) :: found
      character(:), allocatable :: advice

      self%converged = found%normal%converged .and. found%tangential%converged
      if (found%normal%converged .and. .not. found%tangential%converged) then
         call note_outcome(self, found%tangential)
         self%reason = 'friction: '//trim(found%tangential%reason)
         advice = advice_on_slopes(self)
         if (len(advice) > 0) self%reason = self%reason//'. '//advice
         if (self%tangential%road_pull%slides_off) then
            self%reason = pull_outcome(plan, self%tangential)
            self%residual = found%tangential%load_error
         end if
      else
         call note_outcome(self, found%normal)
         if (found%normal%reason == reason_undetermined) call note_full_contact(self, plan)
      end if
      if (found%passes > 0) call check_passes(self, plan, found)
   end subroutine judge

   !> Note the outcome of a solver, and which of its two errors is too large.
   subroutine note_outcome(self, outcome)
      type(simulation_type), intent(inout) :: self
      type(solver_result_type), intent(in) :: outcome

      self%reason = trim(outcome%reason)
      self%allowed = merge(outcome%required, self%case%solver%tolerance, outcome%required > 0.0_dp)
      self%residual = outcome%residual
      if (outcome%residual <= self%allowed .and. outcome%load_error > self%allowed) self%residual = outcome%load_error
   end subroutine note_outcome

   !> Add to the reason which displacements have a solution: those that leave a mean gap, because the mean displacement
   !> of a periodic half-space does not depend on the pressure. No accuracy would help, so that the residual is not named.
   subroutine note_full_contact(self, plan)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan

      self%residual = 0.0_dp
      self%reason = self%reason//'. It is '//to_text(plan%load)//' m and must be below '// &
         to_text(self%summit - field_mean(self%height))//' m, the mean gap at first touch: beyond it the pressure '// &
         'of a periodic contact is not determined'
   end subroutine note_full_contact

   !> One sentence about a row that has not converged. It compares an error with the allowed one only if this error is
   !> the reason.
   function failure(self) result(text)
      class(simulation_type), intent(in) :: self
      character(:), allocatable :: text

      associate (row => self%state%row)
         text = 'step '//to_text(row%step)//' of phase '//to_text(row%phase)//', t = '//to_text(row%time)// &
            ' s: the solver did not converge: '//self%reason
      end associate
      if (.not. self%residual <= self%allowed) text = text//'; residual '//to_text(self%residual)//', allowed '// &
         to_text(self%allowed)
   end function failure

   !> Check the mismatch that the passes have left. The row has not converged if it is larger than the case
   !> allows. If the case allows a large mismatch, a warning reports it.
   subroutine check_passes(self, plan, found)
      type(simulation_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      type(found_step_type), intent(in) :: found
      character(:), allocatable :: message, advice

      associate (solver => self%case%solver, mismatch => found%mismatch)
         if (.not. self%converged .or. mismatch <= solver%tolerance) return
         self%allowed = solver%tolerance
         if (solver%passes > 0) self%allowed = max(self%allowed, large_mismatch)
         if (solver%coupling_tolerance > 0.0_dp) self%allowed = max(solver%tolerance, solver%coupling_tolerance)
         advice = advice_on_passes(self)
         if (.not. mismatch <= self%allowed) then
            self%converged = .false.
            self%residual = mismatch
            self%reason = 'the '//to_text(found%passes)//' passes of the step did not settle. '//advice
         else if (mismatch > large_mismatch .and. .not. self%state%passes_reported) then
            self%state%passes_reported = .true.
            message = 'the passes of the step did not settle: residual_coupling is '//to_text(mismatch)// &
               ' after '//to_text(found%passes)//'. '//advice
            call add_warning(self%warnings, self%state%schedule%row, plan%time, message)
         end if
      end associate
   end subroutine check_passes

   !> Note that the row has not converged if it contains a number that is not finite.
   subroutine check_finite(self)
      type(simulation_type), intent(inout) :: self

      if (all(ieee_is_finite(row_values(self%state%row)))) return
      self%converged = .false.
      self%reason = 'a value is not a finite number'
   end subroutine check_finite

   !> Free plans and fields.
   subroutine destroy(self)
      class(simulation_type), intent(inout) :: self

      call self%normal%destroy()
      call self%work%destroy()
      if (allocated(self%state)) deallocate (self%state)
      if (allocated(self%proposed)) deallocate (self%proposed)
      if (self%frictional) call self%tangential%destroy()
      if (self%frictional) call self%passes%destroy()
      if (self%has_steady) call self%steady%destroy()
   end subroutine destroy

end module asperity_simulation
