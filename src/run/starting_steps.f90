!> Solves the first step after a kink in three parts.
!>
!> The scheme exponential2 takes the curvature of the motion from the step before. After a jump, or after a change
!> of the rate of the load or of the speed of the road, there is no such step. The motion would have to be
!> assumed linear, which is inaccurate, because just then fast arms make its curvature large. The step is
!> therefore solved in three parts of a quarter, a quarter and a half of its length. The first is linear, and the
!> others use the curvature that results from the part before. This takes two additional solves per kink. At a
!> point of a rubber with five arms over four decades, in a ramp of eight steps, the error is a quarter of that of
!> one linear step; more and finer parts do not reduce it further.
!>
!> The parts make one row of the history. Works and energies are cumulative, and most other columns are those at
!> the end of the step; `part_sums_type` adds up the rest.
module starting_steps
   use history_row, only : history_row_type
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   implicit none
   private

   public :: part_sums_type, split_start

   real(dp), parameter :: ends(3) = [0.25_dp, 0.5_dp, 1.0_dp]   !! ends of the parts, relative to the step

   !> Quantities of a row to which all its parts contribute.
   type :: part_sums_type
      private
      integer :: iterations_normal = 0
      integer :: iterations_tangential = 0
      integer :: passes = 0
      real(dp) :: residual_coupling = 0.0_dp       !! largest
      real(dp) :: ffts = 0.0_dp
      real(dp) :: seconds = 0.0_dp                 !! s
      real(dp) :: time = 0.0_dp                    !! s
      real(dp) :: slid = 0.0_dp                    !! time times sliding speed, m
      real(dp) :: lost_viscous = 0.0_dp            !! time times power_viscous, J
      real(dp) :: lost_friction = 0.0_dp           !! time times power_friction, J
      real(dp) :: residual_normal = 0.0_dp         !! largest
      real(dp) :: residual_tangential = 0.0_dp     !! largest
      real(dp), allocatable :: slip(:, :, :)       !! m [nx, 2, rows]
   contains
      procedure :: add
      procedure :: put_into
   end type part_sums_type

contains

   !> Divide a step into parts, or return the step itself if it needs no division.
   pure subroutine split_start(plan, starts, extrapolates, road, parts)
      type(planned_row_type), intent(in) :: plan
      logical, intent(in) :: starts                !! the curvature is not known from a step before
      logical, intent(in) :: extrapolates          !! the scheme takes the curvature from the step before
      real(dp), intent(in) :: road(2)              !! displacement of the road before the step, m
      type(planned_row_type), allocatable, intent(out) :: parts(:)
      real(dp) :: rest
      integer :: k

      if (.not. starts .or. .not. extrapolates .or. plan%instantaneous .or. .not. plan%dt > 0.0_dp) then
         allocate (parts(1), source=plan)
         return
      end if
      allocate (parts(size(ends)), source=plan)
      do k = 1, size(ends)
         rest = 1.0_dp - ends(k)
         parts(k)%dt = ends(k)*plan%dt
         if (k > 1) parts(k)%dt = (ends(k) - ends(k - 1))*plan%dt
         if (k > 1) parts(k)%new_speed = .false.
         if (k > 1) parts(k)%new_rate = .false.
         if (k == size(ends)) exit                 ! the last part ends exactly at the end of the step
         parts(k)%time = plan%time - rest*plan%dt
         parts(k)%load = plan%load - rest*(plan%load - plan%load_before)
         parts(k)%pull = plan%pull - rest*(plan%pull - plan%pull_before)
         parts(k)%road = plan%road - rest*(plan%road - road)
      end do
   end subroutine split_start

   !> Add the row of a part, and its slip.
   subroutine add(self, dt, row, slip)
      class(part_sums_type), intent(inout) :: self
      real(dp), intent(in) :: dt                   !! of the part, s
      type(history_row_type), intent(in) :: row
      real(dp), allocatable, intent(in) :: slip(:, :, :)   !! m; not allocated without friction

      self%iterations_normal = self%iterations_normal + row%iterations_normal
      self%iterations_tangential = self%iterations_tangential + row%iterations_tangential
      self%passes = self%passes + row%passes
      self%residual_coupling = max(self%residual_coupling, row%residual_coupling)
      self%ffts = self%ffts + row%ffts
      self%seconds = self%seconds + row%seconds
      self%time = self%time + dt
      self%slid = self%slid + dt*row%sliding_speed
      self%lost_viscous = self%lost_viscous + dt*row%power_viscous
      self%lost_friction = self%lost_friction + dt*row%power_friction
      self%residual_normal = max(self%residual_normal, row%residual_normal)
      self%residual_tangential = max(self%residual_tangential, row%residual_tangential)
      if (allocated(slip)) call add_slip(self, slip)
   end subroutine add

   !> Add the slip of a part.
   subroutine add_slip(self, slip)
      type(part_sums_type), intent(inout) :: self
      real(dp), intent(in) :: slip(:, :, :)        !! m
      integer :: j

      if (.not. allocated(self%slip)) then
         allocate (self%slip, source=slip)
         return
      end if
      !$omp parallel do default(none) shared(self, slip) private(j)
      do j = 1, size(slip, 3)
         self%slip(:, :, j) = self%slip(:, :, j) + slip(:, :, j)
      end do
   end subroutine add_slip

   !> Put the sums into the row of the step, and the slip of all parts into that of the step.
   subroutine put_into(self, row, slip)
      class(part_sums_type), intent(in) :: self
      type(history_row_type), intent(inout) :: row
      real(dp), allocatable, intent(inout) :: slip(:, :, :)   !! m

      row%iterations_normal = self%iterations_normal
      row%iterations_tangential = self%iterations_tangential
      row%passes = self%passes
      row%residual_coupling = self%residual_coupling
      row%ffts = self%ffts
      row%seconds = self%seconds
      row%sliding_speed = self%slid/self%time
      row%power_viscous = self%lost_viscous/self%time
      row%power_friction = self%lost_friction/self%time
      row%residual_normal = self%residual_normal
      row%residual_tangential = self%residual_tangential
      if (allocated(self%slip)) slip(:, :, :) = self%slip
   end subroutine put_into

end module starting_steps
