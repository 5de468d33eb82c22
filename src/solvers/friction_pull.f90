!> A prescribed total of the traction for the tangential solver.
!>
!> The mean of T over the grid can be prescribed along x, y or both. The position `offset` of the road is
!> then an unknown: r = DX' + offset - A (T + T_h). The road is held by springs (module `road_spring`) that
!> are much softer than the contact, and their ends are moved until the total is right.
!>
!> The mean mode of the operator adds a uniform displacement, which affects only the position of the road. It is
!> removed from the operator during the solve, so that the springs need only be softer than the contact itself, and
!> added to the offset afterwards. On a free map the symbol at zero wave number adds such a uniform displacement,
!> too.
!>
!> If there is a mass between the pull and the contact, the total of T may differ from the pull. The difference
!> moves the road: offset = (given offset) - mass_compliance (mean T - traction). This is a spring, too.
module friction_pull
   use fft_conv, only : convolution_type
   use field_sums, only : field_count, field_sum
   use friction_law, only : contact_open
   use friction_problem, only : friction_problem_type
   use asperity_precision, only : dp
   use road_spring, only : road_spring_type
   implicit none
   private

   public :: friction_pull_type

   real(dp), parameter :: softer = 100.0_dp      !! compliance of the springs over that of the contact

   !> The prescribed mean traction, and the offset of the road that the solver finds for it.
   type :: friction_pull_type
      logical :: along(2) = .false.              !! the mean of T is prescribed along x, y
      real(dp) :: traction(2) = 0.0_dp           !! that mean, Pa
      !> Before a solve this is a guess, or the offset of a mass for which T has the prescribed mean. After the solve
      !> it is the solution, or 0 along a direction without a prescribed mean. In the units of DX'.
      real(dp) :: offset(2) = 0.0_dp
      !> With a mass: the compliance of the offset to mean T - traction, m for G = 1 Pa. 0: the total of T equals the pull.
      real(dp) :: mass_compliance(2) = 0.0_dp
      logical :: slides_off = .false.            !! out: the pull is more than the friction can hold
      real(dp) :: rest(2) = 0.0_dp               !! offset of the springs at which the road has not moved
      !> How many times as soft as its spring a mass is; 0 if no mass is softer. A move of the spring by this multiple of a
      !> plain one brings the mass to its place if all points slip before and after it.
      real(dp) :: softness = 0.0_dp
      real(dp), private :: mean_mode(2) = 0.0_dp !! symbols that were removed from the operator
      !> A mass that is softer than the springs: the compliance of its offset to the missing total, and the offset
      !> at which the total equals the pull. 0: the springs are the mass, or there is no mass.
      real(dp), private :: soft_mass(2) = 0.0_dp, mass_place(2) = 0.0_dp
   contains
      procedure :: attach
      procedure :: detach
      procedure :: missing_part
      procedure :: missing_total
   end type friction_pull_type

contains

   !> Attach the road to its springs.
   subroutine attach(self, problem, operator, soft)
      class(friction_pull_type), intent(inout) :: self
      type(friction_problem_type), intent(inout) :: problem
      type(convolution_type), intent(inout) :: operator
      real(dp), intent(in) :: soft               !! mean modes from this compliance on are treated separately, m
      real(dp) :: cells, touching
      integer :: c

      self%slides_off = .false.
      self%rest = 0.0_dp
      self%softness = 0.0_dp
      self%soft_mass = 0.0_dp
      if (.not. any(self%along)) return
      cells = operator%grid%cells()
      touching = max(1.0_dp, field_count(problem%fields%contact /= contact_open))
      problem%spring%pulled = self%along
      do c = 1, 2
         if (.not. self%along(c)) cycle
         self%mean_mode(c) = operator%symbols%mean_mode(c)
         call operator%symbols%set_mean_mode(c, 0.0_dp)
         problem%spring%pull(c) = self%traction(c)*cells
         ! A patch of n cells is about as stiff as sqrt(n) cells side by side.
         problem%spring%compliance(c) = softer*problem%compliance/sqrt(touching)
         self%rest(c) = -self%mean_mode(c)*(problem%spring%pull(c) + past_total(problem, c))
         problem%spring%end(c) = self%rest(c) + self%offset(c)
         if (self%mass_compliance(c) > 0.0_dp) &
            call replace_spring_by_mass(self, problem%spring, c, self%mass_compliance(c)/cells)
         problem%mean_compliance(c) = merge(problem%spring%compliance(c), 0.0_dp, &
            problem%spring%compliance(c)*cells > soft)
      end do
      ! The distance that the pull moves the road is the least scale, because there is no other one if all points stick
      ! without strain.
      problem%least_scale = max(problem%least_scale, norm2(self%mean_mode*problem%spring%pull), &
         problem%compliance/sqrt(touching)*norm2(problem%spring%pull))
   end subroutine attach

   !> Replace a spring by a mass. In steps much longer than the period of the block the mass is softer than the
   !> spring; the spring then stays, and its end is moved until the offset of the road is that of the mass.
   pure subroutine replace_spring_by_mass(self, spring, c, compliance)
      type(friction_pull_type), intent(inout) :: self
      type(road_spring_type), intent(inout) :: spring
      integer, intent(in) :: c                   !! direction
      real(dp), intent(in) :: compliance         !! of the mass, m/Pa of the sum

      if (compliance > spring%compliance(c)) then
         self%softness = max(self%softness, compliance/spring%compliance(c))
         self%soft_mass(c) = compliance
         self%mass_place(c) = spring%end(c)
      else
         spring%compliance(c) = compliance
      end if
   end subroutine replace_spring_by_mass

   !> Restore the mean mode of the operator, and add the displacement of this mode to the offset of the road.
   subroutine detach(self, problem, operator)
      class(friction_pull_type), intent(inout) :: self
      type(friction_problem_type), intent(in) :: problem
      type(convolution_type), intent(inout) :: operator
      integer :: c

      self%offset = 0.0_dp
      do c = 1, 2
         if (.not. self%along(c)) cycle
         call operator%symbols%set_mean_mode(c, self%mean_mode(c))
         self%offset(c) = problem%spring%offset(c) &
            + self%mean_mode(c)*(problem%spring%total(c) + past_total(problem, c))
      end do
   end subroutine detach

   !> Sum of T_h along a direction, Pa.
   function past_total(problem, c) result(total)
      type(friction_problem_type), intent(in) :: problem
      integer, intent(in) :: c
      real(dp) :: total

      total = 0.0_dp
      if (associated(problem%fields%past)) total = field_sum(problem%fields%past(:, c, :))
   end function past_total

   !> The pull minus the total of T and the force that accelerates the mass, Pa; 0 along a direction that is not pulled, and
   !> where the springs are the mass.
   pure function missing_total(self, problem) result(difference)
      class(friction_pull_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem
      real(dp) :: difference(2)

      difference = merge(problem%spring%pull - problem%spring%total, 0.0_dp, &
         self%along .and. (self%soft_mass > 0.0_dp .or. .not. self%mass_compliance > 0.0_dp))
      where (self%soft_mass > 0.0_dp) difference = difference + (self%mass_place - problem%spring%offset)/self%soft_mass
   end function missing_total

   !> Size of `missing_total` relative to the largest of four forces: the pull, the total, the force that would displace the
   !> contact as far as it is displaced, and the one that would bring a soft mass to its place. The third is at most the
   !> friction of all cells, because a road that slides may be displaced by any distance.
   pure function missing_part(self, problem) result(part)
      class(friction_pull_type), intent(in) :: self
      type(friction_problem_type), intent(in) :: problem
      real(dp) :: part
      real(dp) :: compliance, inertial(2), size

      part = norm2(self%missing_total(problem))
      if (.not. part > 0.0_dp) return
      compliance = maxval(problem%spring%compliance)/softer + maxval(self%mean_mode)
      inertial = 0.0_dp
      where (self%soft_mass > 0.0_dp) inertial = self%mass_place/self%soft_mass
      size = max(norm2(problem%spring%pull), norm2(problem%spring%total), &
         min(problem%scale/compliance, problem%bounds), norm2(inertial))
      part = part/size
   end function missing_part

end module friction_pull
