!> The state of a rubber block on its road, and what solves it: what one row leaves to the next.
!>
!> `simulation` extends this type with the schedule, the rows and the warnings. The modules of the
!> stages of a step (`road_motion`, `coupled_passes`) work on this type alone.
!>
!> Fields of doubles besides those of the normal solver: H, P, gap and U; with sliding also the
!> original map and the two slopes; with Prony arms the history (S, S - S_old and one field per arm)
!> and its traction; with friction those of the modules `tangential_state` and `coupled_passes`.
module contact_state
   use case_settings, only : case_type
   use contact_rule, only : touches
   use asperity_interpolation, only : interpolation_type
   use normal_step, only : normal_step_type
   use asperity_parallel, only : global_sum
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use asperity_schedule, only : planned_row_type
   use solver_result, only : solver_result_type
   use tangential_state, only : tangential_state_type
   use viscoelastic_energy, only : energy_books_type
   use zener, only : history_type, zener_type
   implicit none
   private

   public :: contact_state_type, contact_mean, solve_normal

   !> The state. Not to be copied.
   type :: contact_state_type
      type(case_type) :: case
      type(grid_type) :: grid
      real(dp), allocatable :: height(:, :)         !! H under the rubber now, m
      real(dp), allocatable :: pressure(:, :)       !! P, Pa
      real(dp), allocatable :: gap(:, :)            !! m
      real(dp), allocatable :: displacement(:, :)   !! U_z, m
      real(dp), allocatable :: slope_x(:, :)        !! of the road under the rubber now, -
      real(dp), allocatable :: slope_y(:, :)
      real(dp), allocatable :: past(:, :)           !! traction of the history, Pa
      real(dp) :: level = 0.0_dp                    !! U - H where the gap is zero, m
      logical :: first = .true.                     !! no state yet
      type(zener_type) :: material
      type(history_type) :: history                 !! of the normal traction
      type(energy_books_type) :: books              !! of the normal traction
      type(normal_step_type) :: side                !! the solvers of the normal contact
      type(tangential_state_type) :: tangential
      type(interpolation_type) :: road              !! the original map
      real(dp) :: summit = 0.0_dp                   !! highest point of the original map, m
      real(dp) :: rms_height = 0.0_dp               !! of the original map about its mean, m
      real(dp) :: rms_slope = 0.0_dp                !! of the original map, -
      logical :: slides = .false.                   !! the road moves in some phase, or may be made to
      logical :: frictional = .false.               !! there is a friction law, and the road moves
      real(dp) :: direction(2) = 0.0_dp             !! of the road's last motion
      real(dp) :: velocity(2) = 0.0_dp              !! of the road in the last step, m/s
      real(dp) :: drift(2) = 0.0_dp                 !! expected motion of the surface in the step, m
      real(dp) :: drifted(2) = 0.0_dp               !! sum of the expected motions of the surface, m
      real(dp) :: first_mismatch = 1.0_dp           !! left by the first pass of the last step
      integer :: moved_cells(2) = 0                 !! by which P has been shifted so far
   contains
      procedure :: rubs
   end type contact_state_type

contains

   !> Does friction act yet?
   pure function rubs(self) result(yes)
      class(contact_state_type), intent(in) :: self
      logical :: yes

      yes = .false.
      if (self%frictional) yes = self%tangential%moved
   end function rubs

   !> Solve the normal contact under the row's load.
   subroutine solve_normal(self, plan, tolerance, outcome)
      class(contact_state_type), intent(inout) :: self
      type(planned_row_type), intent(in) :: plan
      real(dp), intent(in) :: tolerance
      type(solver_result_type), intent(out) :: outcome

      self%side%tolerance = tolerance
      ! Without arms `past` is not allocated, and so not present.
      call self%side%solve(plan, self%material%q, self%first, self%height, self%pressure, self%gap, &
         self%level, outcome, self%past)
      self%first = .false.
   end subroutine solve_normal

   !> Mean of a vector field over the contact.
   function contact_mean(self, field) result(mean)
      class(contact_state_type), intent(in) :: self
      real(dp), intent(in) :: field(:, :, :)        !! [nx, 2, ny]
      real(dp) :: mean(2)
      real(dp), allocatable :: rows(:, :)
      logical, allocatable :: touching(:)
      integer :: j

      allocate (rows(3, self%grid%ny))
      !$omp parallel do default(none) shared(self, field, rows) private(j, touching)
      do j = 1, self%grid%ny
         touching = touches(self%side%adhesive, self%pressure(:, j), self%gap(:, j))
         rows(1, j) = sum(field(:, 1, j), touching)
         rows(2, j) = sum(field(:, 2, j), touching)
         rows(3, j) = count(touching)
      end do
      mean = global_sum([sum(rows(1, :)), sum(rows(2, :))])/max(global_sum(sum(rows(3, :))), 1.0_dp)
   end function contact_mean

end module contact_state
