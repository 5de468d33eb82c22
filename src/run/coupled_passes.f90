!> The passes of a row in which friction acts. A row is one time step, which is one line of the history.
!>
!> The pressure, the traction and the place where the rubber's surface touches the road depend on each other. Let D be
!> the displacement of the road, U_T the tangential displacement of the rubber's surface, and z (the place) the trial
!> value of U_T with which the road is read. A pass computes
!>
!>    H, grad H  from the original map at X + z - D
!>    P          the normal contact on H
!>    T, U_T     the tangential contact under P, on the slopes grad H
!>
!> and the row is solved if U_T = z, because pressure, traction, heights and slopes then belong to the same surface.
!> The plain iteration z <- U_T need not converge. T contains -P grad H, which contributes eigenvalues from -2 to -1
!> times |grad H|^2 to dU_T/dz; friction adds some of the order of mu |grad H|; and in a thick block the mean of both
!> is larger, because it also shears the block. The passes therefore use Anderson acceleration on the whole field z
!> (module `anderson`). Module `pass_control` determines the accuracy of their solves and the length of their steps.
!>
!> The traction T was found at the place z. If U_T - z moves the contact along the rubber, the strains around the
!> contact move with it. If U_T stayed at its old points, the road would seem to be stretched beside the contact.
!> `carry` therefore moves U_T along with the contact for the next place; at the fixed point it has no effect.
!>
!> If the law has a strength without pressure (constant shear), the traction of a cell would jump as the cell opens,
!> and the passes would alternate between the two states of such cells. The share of the strength that each cell may
!> carry is then unknown as well (module `edge_shares`). Each pass moves the shares after its normal solve, and the
!> acceleration treats them as a third component of the place. The first `deciding_passes` passes of a row set them to
!> 0 or 1, until the contact is about known.
!>
!> The first place is extrapolated from the rows before: the displacement moves with the road, its mean continues as
!> in the last step, and `place_forecast` adds the changes that the last rows suggest. A jump of the load is solved by
!> the same loop, without motion and time, and its tractions are not extrapolated.
!>
!> The slip that the last pass has found (at first, the slip that the first place implies) has almost the direction of
!> the slip to be found. Cells that slip far therefore start on their bounds in that direction, and a step in which
!> all cells slip takes one or two tangential iterations. Without this start it took eleven, because each cell that
!> came into contact began as one that sticks.
!>
!> The error of a pass is the difference between the road at U_T and the road on which it was solved (module
!> `coupling_mismatch`; the column `residual_coupling`).
!>
!> The loop of `solve` reads: do a pass at the place, and measure the mismatch that it leaves. If the mismatch is
!> within the tolerance, and the solves of the pass were required to meet it as well, the row is solved. (The caller
!> rejects a row whose tangential solve has not converged.) Otherwise `pass_control` judges the pass and sets the
!> accuracy of the next one and the length of the step, and `choose_place` computes the next place. When the number of
!> passes is exhausted, the row keeps the result of the last pass; if there were more than ten, the last one is done
!> at the best place so far. Passes that do not come closer continue with short plain steps (module `pass_control`).
!> If these do not come closer either, module `joint_step` solves all equations of the step at once. It also does so
!> after the first few passes, if more than as many again are to be expected. The next pass is done at its solution,
!> with its shares of the bounds, and verifies it. A normal solve that does not converge ends the loop. On a stop
!> (module `row_stop`) the loop returns at once, and the caller restores the state of the row before.
!>
!> The work of a row is bounded by `most_passes`, by the iterations that a case allows to a normal and to a tangential
!> solve (`max_iterations`), and by the evaluations that `joint_equations` allows.
!>
!> Memory, in fields of doubles: the place, its residual, the best place and the displacement carried along have two
!> components each, and so have the fields of the acceleration. With shares all of these except the displacement have a
!> third component, and there is a field of shares. `mismatch_of` borrows three fields from the contact's workspace.
module coupled_passes
   use anderson, only : anderson_type, new_anderson
   use carried_field, only : carry
   use contact_model, only : contact_mean, contact_type, solve_normal
   use contact_rule, only : touches
   use coupling_mismatch, only : mismatch_of
   use asperity_interpolation, only : displaced
   use field_copies, only : copy_field
   use friction_law, only : contact_open
   use edge_shares, only : edge_rule_type, new_edge_rule
   use joint_step, only : joint_step_type
   use pass_control, only : pass_control_type
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use asperity_schedule, only : planned_row_type
   use solver_result, only : solver_result_type
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: coupled_passes_type, new_coupled_passes

   integer, parameter :: most_passes = 400      !! if the case does not limit the number

   integer, parameter :: pairs = 6                      !! differences of passes that the acceleration remembers
   real(dp), parameter :: largest_factor = 1.0e3_dp     !! of a difference in the acceleration; a larger one is round-off

   integer, parameter :: deciding_passes = 2            !! first passes of a row whose shares are 0 or 1
   real(dp), parameter :: weight_of_share = 2.0_dp      !! of the third component in the norm of the acceleration

   !> Accuracy of the pass that verifies a joint solution, as a multiple of the tolerance.
   real(dp), parameter :: verifying = 1.0e-3_dp

   real(dp), parameter :: exact_load = 1.0e-12_dp       !! relative error of a load that counts as met exactly

   !> The work space of the passes and their outcome.
   type :: coupled_passes_type
      integer :: passes = 0                             !! done in the last row
      real(dp) :: mismatch = 0.0_dp                     !! of the last pass: the column residual_coupling
      logical, private :: gap_known = .false.           !! pressure, gap and heights are those of the last pass
      !> z, m; with shares also the share times its length (module `edge_shares`), m [nx, 2 or 3, rows].
      real(dp), allocatable, private :: place(:, :, :)
      real(dp), allocatable, private :: carried(:, :, :)    !! U_T of the row before, carried along, m [nx, 2, rows]
      real(dp), allocatable, private :: place_residual(:, :, :) !! of a pass: the place it leads to, minus its own, m
      real(dp), allocatable, private :: best_place(:, :, :) !! the place of the least mismatch, m
      logical, private :: sharing = .false.             !! the shares of the cells are unknown, too
      type(edge_rule_type), private :: edge             !! the rule by which the shares change in the present row
      type(anderson_type), private :: acceleration
      type(joint_step_type), private :: joint
   contains
      procedure :: solve
      procedure :: destroy
   end type coupled_passes_type

contains

   !> Allocate the work space.
   subroutine new_coupled_passes(self, grid, sharing)
      type(coupled_passes_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: sharing                     !! the traction of a cell would jump as it opens
      integer :: unknowns

      self%sharing = sharing
      unknowns = merge(3, 2, sharing)
      allocate (self%place(grid%nx, unknowns, grid%rows()), source=0.0_dp)
      allocate (self%place_residual, self%best_place, source=self%place)
      allocate (self%carried(grid%nx, 2, grid%rows()), source=0.0_dp)
      call new_anderson(self%acceleration, grid%nx, unknowns, grid%rows(), pairs)
      self%acceleration%largest = largest_factor
   end subroutine new_coupled_passes

   !> Solve a row. The caller has moved the road and begun the tangential step.
   subroutine solve(self, contact, plan, motion, normal, tangential)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: motion(2)                  !! of the road in this row, m
      type(solver_result_type), intent(out) :: normal      !! all normal solves
      type(solver_result_type), intent(out) :: tangential  !! all tangential solves
      type(pass_control_type) :: control
      real(dp) :: tolerance
      integer :: most
      logical :: overwritten                             !! an attempt to solve the step jointly has replaced its fields

      tolerance = contact%case%solver%tolerance
      most = contact%case%solver%passes
      if (most == 0) most = most_passes
      call begin(self, contact, plan, motion, control)
      do
         self%passes = self%passes + 1
         ! Early passes are solved coarsely; the result that the row keeps is solved to the tolerance.
         if (self%passes == most) control%accuracy = min(control%accuracy, tolerance)
         call do_pass(self, contact, plan, control%accuracy, normal, tangential)
         contact%stop%given_up = normal%stopped .or. tangential%stopped
         if (contact%stop%given_up) return
         if (self%passes == 1 .and. .not. plan%instantaneous) contact%state%first_mismatch = self%mismatch
         if (self%passes == most .or. .not. normal%converged) exit
         if (control%accuracy <= tolerance .and. self%mismatch <= tolerance) exit
         ! The shares of a joint solution apply only to the pass that verifies it, unless they are unknowns.
         if (.not. self%sharing .and. allocated(contact%tangential%share)) deallocate (contact%tangential%share)
         contact%stop%given_up = stop_is_due()
         if (contact%stop%given_up) return
         call control%judge(self%mismatch)
         if (control%best_yet) call copy_field(self%place, self%best_place)
         if (control%forget) call self%acceleration%forget()
         if (control%joint_due) then
            ! The next pass is done at the joint solution. If there is none, the attempt has overwritten the result of
            ! the last pass, which is therefore repeated.
            call solve_jointly(self, contact, plan, control, tangential, overwritten)
            if (overwritten) cycle
         end if
         call choose_place(self, contact, control)
         ! The last of many passes is done at the best place that was found.
         if (self%passes == most - 1 .and. most > 10) call copy_field(self%best_place, self%place)
      end do
      associate (forecast => contact%state%tangential%forecast)
         if (self%mismatch <= tolerance) then
            call forecast%learn(contact%tangential%trial, self%carried, contact%state%pressure)
         else
            call forecast%forget()
         end if
      end associate
   end subroutine solve

   !> Choose the first place of a row, and how its first pass is solved.
   subroutine begin(self, contact, plan, motion, control)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: motion(2)                  !! of the road in this row, m
      type(pass_control_type), intent(out) :: control
      logical :: continues                               !! this row continues the motion of the last one

      self%passes = 0
      self%gap_known = .false.
      call self%acceleration%forget()
      continues = .not. (plan%instantaneous .or. plan%new_speed)
      call predict(self, contact, plan%dt, motion, continues)

      ! The first pass is likely to leave the mismatch of the first pass of the row before.
      call control%start(contact%case%solver%tolerance, merge(contact%state%first_mismatch, 1.0_dp, continues), &
         self%sharing)

      ! Cells that stick start with an extrapolated traction, and cells that are expected to slip far on their bound.
      if (.not. plan%instantaneous) &
         call contact%tangential%extrapolate(contact%state%tangential, .not. plan%new_speed)
      if (continues) call contact%tangential%expect(contact%state%tangential, self%place)
   end subroutine begin

   !> Solve the step all at once, because the passes are slow or have stalled. If that succeeds, the next pass starts from its
   !> solution with accurate solves, and verifies that the step is solved. Otherwise the place stays as it is.
   subroutine solve_jointly(self, contact, plan, control, tangential, overwritten)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      type(pass_control_type), intent(inout) :: control
      type(solver_result_type), intent(inout) :: tangential   !! all tangential solves; its transforms are added
      logical, intent(out) :: overwritten                        !! the result of the last pass has been overwritten
      logical :: solved
      integer :: transforms

      call self%joint%solve(contact, plan, self%place, control%thorough, solved, transforms)
      self%gap_known = .false.
      tangential%ffts = tangential%ffts + transforms
      overwritten = transforms > 0
      if (.not. solved) return
      call copy_field(contact%tangential%trial, self%place(:, :2, :))
      if (self%sharing) self%place(:, 3, :) = self%edge%share_length*contact%tangential%share
      control%accuracy = verifying*contact%case%solver%tolerance
   end subroutine solve_jointly

   !> Do one pass at the place, and compute the mismatch that it leaves.
   subroutine do_pass(self, contact, plan, accuracy, normal, tangential)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: accuracy                   !! of both solves
      type(solver_result_type), intent(inout) :: normal, tangential
      type(solver_result_type) :: part
      integer :: j

      ! A pass changes the road but not U_z, the displacement under the pressure of the last pass. The field `gap`
      ! therefore passes U_z = gap + H + level to the normal solver, which need not compute it again.
      if (self%gap_known) then
         !$omp parallel do default(none) shared(contact) private(j)
         do j = 1, contact%grid%rows()
            contact%state%gap(:, j) = contact%state%gap(:, j) + (contact%height(:, j) + contact%state%level)
         end do
      end if
      call displaced(contact%road, plan%road(1), plan%road(2), self%place(:, 1, :), self%place(:, 2, :), &
         contact%height, contact%slope_x, contact%slope_y)
      call solve_normal(contact, plan, accuracy, part, displaced=self%gap_known)
      ! A pressure that misses the load is scaled to it at the start of the next solve, and U_z would no longer
      ! belong to it.
      self%gap_known = .not. contact%normal%adhesive .and. part%load_error <= exact_load
      normal%stopped = part%stopped
      if (normal%stopped) return
      call add_result(normal, part)
      if (self%sharing) then
         call update_shares(self, contact)
      else if (allocated(contact%tangential%share)) then
         call confirm_shares(contact)
      end if
      contact%tangential%tolerance = accuracy
      call contact%tangential%solve(contact%state%tangential, contact%state%pressure, contact%state%gap, &
         contact%slope_x, contact%slope_y, part)
      call add_result(tangential, part)
      if (tangential%stopped) return
      self%mismatch = mismatch_of(contact, plan, self%sharing, self%edge)
   end subroutine do_pass

   !> Compute the shares for the tangential solve of a pass from the result of its normal solve, and their residual.
   subroutine update_shares(self, contact)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact

      if (.not. allocated(contact%tangential%share)) &
         allocate (contact%tangential%share(size(self%place, 1), size(self%place, 3)))
      contact%tangential%share(:, :) = self%place(:, 3, :)/self%edge%share_length
      call self%edge%move(contact%state%pressure, contact%state%gap, self%passes <= deciding_passes, &
         contact%tangential%share)
      self%place_residual(:, 3, :) = self%edge%share_length*contact%tangential%share - self%place(:, 3, :)
   end subroutine update_shares

   !> Restrict the shares of a joint solution to the contact that the normal solve has found at its place: cells with
   !> pressure obey the whole law, and open cells carry no traction. The share of the joint solution remains only in
   !> cells that touch without pressure, so that the pass verifies this solution and no other one.
   subroutine confirm_shares(contact)
      class(contact_type), intent(inout) :: contact
      real(dp) :: apart                                  !! least gap of a cell that is open for certain, m
      integer :: j

      apart = contact%case%solver%tolerance*contact%rms_height
      !$omp parallel do default(none) shared(contact, apart) private(j)
      do j = 1, contact%grid%rows()
         associate (share => contact%tangential%share(:, j), gap => contact%state%gap(:, j))
            where (touches(contact%normal%adhesive, contact%state%pressure(:, j), gap))
               share = 1.0_dp
            else where (gap > apart)
               share = 0.0_dp
            end where
         end associate
      end do
   end subroutine confirm_shares

   !> Compute the first place of a row: the displacement of the row before, moved along with the contact, which
   !> follows the road over the rubber, plus the mean motion of the rubber's surface, plus the forecast of module
   !> `place_forecast`.
   subroutine predict(self, contact, dt, motion, continues)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(inout) :: contact
      real(dp), intent(in) :: dt                         !! s
      real(dp), intent(in) :: motion(2)                  !! of the road, m
      logical, intent(in) :: continues                   !! the row continues the motion of the last one
      integer :: c, j

      do c = 1, 2
         call carry(contact%grid, contact%state%tangential%displacement(:, c, :), contact%drift - motion, &
            self%carried(:, c, :))
      end do
      !$omp parallel do default(none) shared(self, contact) private(c, j)
      do j = 1, contact%grid%rows()
         do c = 1, 2
            self%carried(:, c, j) = self%carried(:, c, j) + contact%drift(c)
            self%place(:, c, j) = self%carried(:, c, j)
         end do
      end do
      associate (forecast => contact%state%tangential%forecast)
         call forecast%follow(contact%grid, dt, continues, contact%drift - motion)
         call forecast%add(self%place(:, :2, :))
      end associate
      if (.not. self%sharing) return
      self%edge = new_edge_rule(contact%normal%potential, contact%tangential%cell_compliance(), &
         contact%tangential%law%bare_strength(), contact%rms_slope)
      self%place(:, 3, :) = merge(self%edge%share_length, 0.0_dp, contact%state%tangential%contact /= contact_open)
   end subroutine predict

   !> Compute the next place from the result of the last pass.
   subroutine choose_place(self, contact, control)
      class(coupled_passes_type), intent(inout) :: self
      class(contact_type), intent(in) :: contact
      type(pass_control_type), intent(inout) :: control
      real(dp) :: motion(2)
      integer :: c, j

      if (control%go_back) then
         call copy_field(self%best_place, self%place)
         return
      end if

      ! The residual is U_T, carried along by the mean of U_T - z in the contact, minus z.
      !$omp parallel do default(none) shared(self, contact) private(j)
      do j = 1, contact%grid%rows()
         self%place_residual(:, :2, j) = contact%tangential%trial(:, :, j) - self%place(:, :2, j)
      end do
      motion = contact_mean(contact, self%place_residual(:, :2, :))
      do c = 1, 2
         call carry(contact%grid, contact%tangential%trial(:, c, :), motion, self%place_residual(:, c, :))
      end do
      !$omp parallel do default(none) shared(self, contact) private(j)
      do j = 1, contact%grid%rows()
         self%place_residual(:, :2, j) = self%place_residual(:, :2, j) - self%place(:, :2, j)
      end do

      if (control%plain) then
         call control%follow(self%acceleration%cosine_with_last(self%place_residual))
         call self%acceleration%momentum_step(self%place_residual, self%place, control%damping, control%momentum)
      else
         call self%acceleration%step([1.0_dp, 1.0_dp, weight_of_share], self%place_residual, self%place, plain=.false., &
            damping=control%damping)
      end if
      if (self%sharing) self%place(:, 3, :) = min(max(self%place(:, 3, :), 0.0_dp), self%edge%share_length)
   end subroutine choose_place

   !> Add the record of a solve to that of the row: keep the last outcome, and add up the work.
   subroutine add_result(total, part)
      type(solver_result_type), intent(inout) :: total
      type(solver_result_type), intent(in) :: part
      type(solver_result_type) :: before

      before = total
      total = part
      total%iterations = before%iterations + part%iterations
      total%ffts = before%ffts + part%ffts
   end subroutine add_result

   !> Free the operator of the joint step.
   subroutine destroy(self)
      class(coupled_passes_type), intent(inout) :: self

      call self%joint%destroy()
   end subroutine destroy

end module coupled_passes
