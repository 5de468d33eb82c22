!> Solves a step with friction for all unknowns at once, if its passes settle slowly or not at all.
!>
!> A pass computes pressure, traction and place one after the other. If the traction of a cell jumps when the
!> cell opens, the passes oscillate between two states. The equations of module `joint_equations` contain all
!> unknowns and are continuous; module `joint_newton` solves them. If it does not succeed from the result of the last
!> pass, a path of solutions is followed (module `joint_path`): from this result, with the road at the place of the pass,
!> to the solution, with the road at the displacement that the traction causes.
!>
!> Memory from the first use on: 30 fields of doubles, and the directions of GMRES; on a path 31 fields more. If there is
!> not enough memory, the step is not solved.
module joint_step
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use joint_equations, only : joint_equations_type
   use joint_newton, only : joint_newton_type
   use joint_path, only : follow_path
   use asperity_precision, only : dp
   use stop_watch, only : stop_is_due
   implicit none
   private

   public :: joint_step_type

   integer, parameter :: transforms_of_evaluation = 6
   integer, parameter :: impatient = 8                 !! steps of Newton's method that must halve the residual

   !> The equations and the method. A variable of this type must not be copied.
   type :: joint_step_type
      type(joint_equations_type), private :: equations
      type(joint_newton_type), private :: newton
   contains
      procedure :: solve
      procedure :: destroy
   end type joint_step_type

contains

   !> Solve a step, starting from the state after the last pass. If the step is solved, the state of the contact,
   !> the trial displacement and the shares of the cells are those of the solution.
   subroutine solve(self, contact, plan, place, thorough, solved, transforms)
      class(joint_step_type), intent(inout) :: self
      class(contact_type), intent(inout), target :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: place(:, :, :)           !! of the last pass, m [nx, 2 or 3, rows]
      logical, intent(in) :: thorough                  !! Newton's method may take long, and a path may be followed
      logical, intent(out) :: solved
      integer, intent(out) :: transforms               !! number of transforms
      logical :: has_memory

      solved = .false.
      transforms = 0
      if (any(contact%tangential%pulled)) return
      if (.not. self%equations%ready) call self%equations%prepare(contact)
      if (self%equations%ready .and. .not. self%newton%ready) call self%newton%prepare(contact%grid)
      if (.not. self%newton%ready) then
         call self%destroy()
         return
      end if
      call self%equations%start(contact, plan, self%newton%now, has_memory)
      if (.not. has_memory) return
      self%newton%steps_to_halve = merge(0, impatient, thorough)
      call self%newton%solve(self%equations, contact%case%solver%tolerance, solved)
      transforms = transforms_of_evaluation*self%equations%evaluations
      if (thorough .and. .not. (solved .or. stop_is_due())) then
         call follow(self, contact, plan, place, solved)
         transforms = transforms + transforms_of_evaluation*self%equations%evaluations
      end if
      if (solved) call self%equations%return_solution(contact, self%newton%now, solved)
   end subroutine solve

   !> Solve a step by a path of solutions from the result of the last pass.
   subroutine follow(self, contact, plan, place, solved)
      class(joint_step_type), intent(inout) :: self
      class(contact_type), intent(inout), target :: contact
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: place(:, :, :)
      logical, intent(out) :: solved

      call self%equations%start(contact, plan, self%newton%now, solved)
      if (solved) call self%equations%set_origin(place, solved)
      if (.not. solved) return
      call follow_path(self%newton, self%equations, contact%case%solver%tolerance, solved)
   end subroutine follow

   !> Free the operator and the fields.
   subroutine destroy(self)
      class(joint_step_type), intent(inout) :: self

      call self%equations%destroy()
      call self%newton%destroy()
   end subroutine destroy

end module joint_step
