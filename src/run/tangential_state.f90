!> The tangential state of a run: what one row leaves to the next on the tangential side.
!>
!> This is plain data, with which module `tangential_step` solves a step.
!>
!> Memory, in fields of doubles with two components each: T, T of the step before, U, T - T* of the step before at the
!> rubber's own points; those of the forecast of U_T; the state of the arms (S, S - S_old, one field per arm). One field
!> has a single component: the force of the law in the step before, at the rubber's own points.
module tangential_state
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int8
   use block_motion, only : block_motion_type
   use case_settings, only : case_type
   use friction_law, only : contact_open, contact_stick
   use regular_grid, only : grid_type
   use place_forecast, only : new_place_forecast, place_forecast_type
   use viscoelastic_energy, only : energy_books_type, new_books
   use arm_state, only : arm_state_type, new_arm_state
   use zener, only : zener_type
   implicit none
   private

   public :: new_tangential_state, tangential_state_type

   !> The tangential state.
   type :: tangential_state_type
      logical :: moved = .false.                      !! the road has moved: friction acts
      type(block_motion_type) :: block                !! mean motion of the block
      real(dp), allocatable :: traction(:, :, :)      !! T, Pa [nx, 2, rows]
      real(dp), allocatable :: before(:, :, :)        !! T of the step before, carried along with the contact, Pa
      real(dp) :: last_dt = 0.0_dp                    !! length of the step from `before` to T, s; 0 if none
      real(dp), allocatable :: displacement(:, :, :)  !! U_T, m
      real(dp), allocatable :: rubbing(:, :, :)       !! T - T* at the end of the last step, Pa
      integer(int8), allocatable :: contact(:, :)     !! 0 open, 1 stick, 2 slip
      real(dp), allocatable :: force(:, :)            !! of the law at the end of the last step, Pa; 0 if open
      type(place_forecast_type) :: forecast           !! of U_T in the next step
      type(arm_state_type) :: arms
      type(energy_books_type) :: books                !! of the strain of the rubber
      real(dp) :: rate(2) = 0.0_dp                    !! mean speed of the surface in the contact, m/s
      real(dp) :: lost_friction = 0.0_dp              !! J
   contains
      procedure :: extrapolate
   end type tangential_state_type

contains

   !> Make the state of a block at rest.
   subroutine new_tangential_state(self, case, grid, material, error)
      type(tangential_state_type), intent(out) :: self
      type(case_type), intent(in) :: case
      type(grid_type), intent(in) :: grid             !! that of the case; its rows may be shared
      type(zener_type), intent(in) :: material
      type(error_type), allocatable, intent(out) :: error

      self%block%height = case%material%thickness
      self%block%mass = 0.5_dp*case%material%density*case%material%thickness
      self%block%area = grid%area()
      allocate (self%traction(grid%nx, 2, grid%rows()), source=0.0_dp)
      allocate (self%before, self%displacement, self%rubbing, source=self%traction)
      allocate (self%contact(grid%nx, grid%rows()), source=contact_open)
      allocate (self%force(grid%nx, grid%rows()), source=0.0_dp)
      call new_place_forecast(self%forecast, grid%nx, grid%rows())
      call new_arm_state(self%arms, material, grid%nx, grid%rows(), 2, error)
      call new_books(self%books, material, grid%cell_area())
   end subroutine new_tangential_state

   !> Move the traction of cells that stick by the change of the last step, in proportion to the lengths of the steps,
   !> and keep the traction as it was.
   subroutine extrapolate(self, dt, changes)
      class(tangential_state_type), intent(inout) :: self
      real(dp), intent(in) :: dt                      !! length of the step that begins, s
      logical, intent(in) :: changes                  !! otherwise the traction stays
      real(dp) :: factor, t(2)
      integer :: i, j

      factor = 0.0_dp
      if (changes) factor = dt/self%last_dt
      !$omp parallel do default(none) shared(self, factor) private(i, j, t)
      do j = 1, size(self%contact, 2)
         do i = 1, size(self%contact, 1)
            t = self%traction(i, :, j)
            if (self%contact(i, j) == contact_stick) self%traction(i, :, j) = t + factor*(t - self%before(i, :, j))
            self%before(i, :, j) = t
         end do
      end do
      self%last_dt = dt
   end subroutine extrapolate

end module tangential_state
