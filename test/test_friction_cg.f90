!> Tests of the tangential solver.
module test_friction_cg
   use check, only : begin_suite, check_close, check_no_error, check_order, check_that, selected
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type, new_convolution
   use friction_cg, only : friction_fields_type, friction_solver_type, new_friction_solver
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, &
      new_friction_law
   use asperity_threads, only : set_threads, thread_count
   use friction_bounds, only : largest_excess, return_tractions
   use kernels, only : tangential_half_space
   use asperity_precision, only : dp, int64, int8, pi
   use regular_grid, only : boundary_free, boundary_periodic, grid_type, new_grid
   use, intrinsic :: iso_c_binding, only : c_int
   use solver_result, only : solver_result_type
   use stop_watch, only : begin_watch, end_watch
   implicit none
   private

   public :: run_friction_cg

   !> A tangential problem with its fields.
   type :: case_type
      type(grid_type) :: grid
      type(convolution_type) :: operator
      type(friction_solver_type) :: solver
      type(friction_law_type) :: law
      type(solver_result_type) :: result
      real(dp), allocatable :: p(:, :), hx(:, :), hy(:, :), drive_x(:, :), drive_y(:, :)
      real(dp), allocatable :: tx(:, :), ty(:, :), rx(:, :), ry(:, :)
      integer(int8), allocatable :: contact(:, :)
   end type case_type

   integer :: questions = 0        !! times that `asked` still answers with no

contains

   subroutine run_friction_cg()
      call begin_suite('friction_cg')
      if (selected('mindlin_sphere_without_poisson_effect')) &
         call mindlin_sphere_without_poisson_effect()
      if (selected('mindlin_sphere_with_poisson_effect')) call mindlin_sphere_with_poisson_effect()
      if (selected('mindlin_unloading_and_reloading')) call mindlin_unloading_and_reloading()
      if (selected('pulled_sphere_meets_its_force')) call pulled_sphere_meets_its_force()
      if (selected('pulled_rough_road_finds_its_place')) call pulled_rough_road_finds_its_place()
      if (selected('pull_beyond_friction_is_reported')) call pull_beyond_friction_is_reported()
      if (selected('number_of_products_is_bounded')) call number_of_products_is_bounded()
      if (selected('full_stick_and_full_slip')) call full_stick_and_full_slip()
      if (selected('turned_and_mirrored_contacts_agree')) call turned_and_mirrored_contacts_agree()
      if (selected('rough_contacts_meet_the_law')) call rough_contacts_meet_the_law()
      if (selected('methods_agree')) call methods_agree()
      if (selected('a_stop_ends_the_solve')) call a_stop_ends_the_solve()
      if (selected('frictionless_traction_on_slopes')) call frictionless_traction_on_slopes()
      if (selected('constant_shear_up_to_the_edge')) call constant_shear_up_to_the_edge()
      if (selected('adhesion_widens_the_bound')) call adhesion_widens_the_bound()
      if (selected('line_contacts_along_x_and_y_agree')) call line_contacts_along_x_and_y_agree()
      if (selected('uniform_contact_moves_by_mean_mode')) call uniform_contact_moves_by_mean_mode()
      if (selected('full_contact_without_mean_compliance')) call full_contact_without_mean_compliance()
      if (selected('motions_of_any_size_are_solved')) call motions_of_any_size_are_solved()
      if (selected('own_solution_is_kept')) call own_solution_is_kept()
      if (selected('expected_slip_is_a_good_start')) call expected_slip_is_a_good_start()
      if (selected('a_start_on_a_coarser_grid_changes_nothing')) call a_start_on_a_coarser_grid_changes_nothing()
      if (selected('a_start_on_a_coarser_grid_saves_products')) call a_start_on_a_coarser_grid_saves_products()
      if (selected('past_traction_is_like_a_drive')) call past_traction_is_like_a_drive()
      if (selected('block_dragged_into_full_slip_and_back')) &
         call block_dragged_into_full_slip_and_back()
      if (selected('two_threads_agree_to_round_off')) call two_threads_agree_to_round_off()
      if (selected('solver_serves_contacts_of_any_size')) call solver_serves_contacts_of_any_size()
   end subroutine run_friction_cg

   !> Prepare fields, operator and solver.
   subroutine new_case(self, nx, ny, lx, ly, boundary, poisson, thickness)
      type(case_type), intent(out) :: self
      integer, intent(in) :: nx, ny, boundary
      real(dp), intent(in) :: lx, ly, poisson, thickness
      type(error_type), allocatable :: error

      self%grid = new_grid(nx, ny, lx, ly, boundary)
      call new_convolution(self%operator, self%grid, tangential_half_space(poisson, thickness), error)
      call check_no_error(error, 'operator')
      call new_friction_solver(self%solver, self%grid, self%operator, error)
      call check_no_error(error, 'solver')
      allocate (self%p(nx, ny), self%contact(nx, ny))
      allocate (self%hx, self%hy, self%drive_x, self%drive_y, self%tx, self%ty, self%rx, self%ry, &
         mold=self%p)
      self%p = 0.0_dp
      self%hx = 0.0_dp
      self%hy = 0.0_dp
      self%drive_x = 0.0_dp
      self%drive_y = 0.0_dp
      self%tx = 0.0_dp
      self%ty = 0.0_dp
      self%contact = contact_stick
      self%solver%tolerance = 1e-9_dp
   end subroutine new_case

   !> Solve.
   subroutine solve_case(self, past, slip_unit)
      type(case_type), intent(inout), target :: self
      real(dp), intent(in), optional :: slip_unit       !! rx and ry times this are the expected slip
      real(dp), intent(in), contiguous, target, optional :: past(:, :, :)   !! T_h, [nx, 2, ny]
      type(friction_fields_type) :: fields
      real(dp), allocatable, target :: drive(:, :, :), traction(:, :, :), slip(:, :, :)

      allocate (drive(self%grid%nx, 2, self%grid%ny))
      allocate (traction, slip, mold=drive)
      drive(:, 1, :) = self%drive_x
      drive(:, 2, :) = self%drive_y
      traction(:, 1, :) = self%tx
      traction(:, 2, :) = self%ty
      fields%pressure => self%p
      fields%slope_x => self%hx
      fields%slope_y => self%hy
      fields%drive => drive
      if (present(past)) fields%past => past
      fields%traction => traction
      fields%slip => slip
      if (present(slip_unit)) then
         fields%slip_unit = slip_unit
         slip(:, 1, :) = self%rx
         slip(:, 2, :) = self%ry
      end if
      fields%contact => self%contact
      call self%solver%solve(self%operator, self%law, fields, self%result)
      self%tx = traction(:, 1, :)
      self%ty = traction(:, 2, :)
      self%rx = slip(:, 1, :)
      self%ry = slip(:, 2, :)
   end subroutine solve_case

   !> Solve, and check the result without the solver: bound, stick, direction, no reversed slip, and the slip
   !> from another product.
   subroutine run_case(self, what, accuracy)
      type(case_type), intent(inout) :: self
      character(*), intent(in) :: what
      real(dp), intent(in) :: accuracy       !! error of the law of slip, relative to the displacements

      where (self%contact /= contact_open) self%contact = contact_stick
      call solve_case(self)
      call check_that(self%result%converged, what//': converged, '//trim(self%result%reason))
      call prove(self, what, accuracy)
   end subroutine run_case

   !> The checks of `run_case`.
   subroutine prove(self, what, accuracy)
      type(case_type), intent(inout) :: self
      character(*), intent(in) :: what
      real(dp), intent(in) :: accuracy
      real(dp), allocatable :: ux(:, :), uy(:, :)
      real(dp) :: scale, r(2), d(2), slope(2), force(3), slip(3), normal(3), s, bad, wrong
      integer :: i, j

      allocate (ux, uy, mold=self%tx)
      call self%operator%apply_vector(self%tx, self%ty, ux, uy)
      scale = max(maxval(hypot(self%drive_x, self%drive_y)), maxval(hypot(ux, uy)), tiny(1.0_dp))
      bad = maxval(hypot(self%drive_x - ux - self%rx, self%drive_y - uy - self%ry))
      call check_order(bad, '<=', 1e-12_dp*scale, what//': slip = DX - A T')
      bad = largest_excess(self%law, self%p, self%hx, self%hy, self%contact, self%tx, self%ty)
      call check_order(bad, '<=', 1e-13_dp*max(maxval(hypot(self%tx, self%ty)), tiny(1.0_dp)), &
         what//': within the bound')
      bad = 0.0_dp
      wrong = 0.0_dp
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            if (self%contact(i, j) == contact_open) cycle
            r = [self%drive_x(i, j) - ux(i, j), self%drive_y(i, j) - uy(i, j)]
            slope = 0.0_dp
            if (self%law%slope_effect) slope = [self%hx(i, j), self%hy(i, j)]
            d = [self%tx(i, j), self%ty(i, j)] - self%law%normal_traction(self%p(i, j), slope)
            s = self%law%bound_ratio(self%p(i, j), slope, d)
            if (s > 1.0_dp + 1e-8_dp) then
               bad = max(bad, norm2(r))
            else if (norm2(d) > 0.0_dp) then
               if (.not. self%law%physical_slip) slope = 0.0_dp
               normal = [-slope(1), -slope(2), 1.0_dp]/sqrt(1.0_dp + sum(slope**2))
               force = [d(1), d(2), 0.0_dp]
               force = force - dot_product(force, normal)*normal
               force = force/norm2(force)
               slip = [r(1), r(2), dot_product(slope, r)]
               bad = max(bad, norm2(slip - dot_product(slip, force)*force))
               wrong = min(wrong, dot_product(slip, force))
            end if
         end do
      end do
      call check_order(bad, '<=', accuracy*scale, what//': stick or slip along the traction')
      call check_order(-wrong, '<=', accuracy*scale, what//': no slip against the traction')
   end subroutine prove

   !> Release the transforms.
   subroutine end_case(self)
      type(case_type), intent(inout) :: self

      call self%operator%destroy()
      call self%solver%destroy()
   end subroutine end_case

   !> Hertz's pressure of radius 1 and maximum 1 at the centres of the cells, G = 1.
   subroutine set_hertz(self)
      type(case_type), intent(inout) :: self
      real(dp) :: x, y
      integer :: i, j

      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            x = (i - 0.5_dp - 0.5_dp*self%grid%nx)*self%grid%dx
            y = (j - 0.5_dp - 0.5_dp*self%grid%ny)*self%grid%dy
            self%p(i, j) = sqrt(max(1.0_dp - x**2 - y**2, 0.0_dp))
         end do
      end do
   end subroutine set_hertz

   !> Displacement at full slip, 3 mu F (2-nu)/(16 a G).
   pure function full_slip(self, mu, poisson) result(shift)
      type(case_type), intent(in) :: self
      real(dp), intent(in) :: mu, poisson
      real(dp) :: shift

      shift = 3.0_dp*mu*(2.0_dp*pi/3.0_dp)*(2.0_dp - poisson)/16.0_dp
      if (size(self%p) == 0) shift = 0.0_dp
   end function full_slip

   !> Cattaneo (1938) and Mindlin (1949), exact for nu = 0: force, traction, and stick radius, in an oblique
   !> direction.
   subroutine mindlin_sphere_without_poisson_effect()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.4_dp, angle = 0.7_dp
      real(dp) :: delta, ratio, force, load, stick, x, y, expected, error, q, area
      integer :: k, i, j

      call new_case(self, 128, 128, 2.5_dp, 2.5_dp, boundary_free, 0.0_dp, 0.0_dp)
      call set_hertz(self)
      self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
      load = sum(self%p)
      do k = 1, 9, 2
         ! A shift of k/10 of that of full slip.
         delta = 0.1_dp*k*full_slip(self, mu, 0.0_dp)
         ratio = 1.0_dp - (1.0_dp - 0.1_dp*k)**1.5_dp
         self%drive_x = delta*cos(angle)
         self%drive_y = delta*sin(angle)
         call run_case(self, 'Mindlin', 1e-8_dp)
         force = hypot(sum(self%tx), sum(self%ty))/(mu*load)
         call check_close(force, ratio, 3e-5_dp, 'Mindlin, force')
         call check_close(sum(self%ty)/sum(self%tx), tan(angle), 1e-8_dp, 'Mindlin, direction')
      end do
      ! At the last shift, 0.9, the stick radius is c = (1 - Q/mu F)^(1/3) = sqrt(0.1).
      stick = sqrt(0.1_dp)
      error = 0.0_dp
      q = 0.0_dp
      do j = 1, self%grid%ny
         do i = 1, self%grid%nx
            x = (i - 0.5_dp - 0.5_dp*self%grid%nx)*self%grid%dx
            y = (j - 0.5_dp - 0.5_dp*self%grid%ny)*self%grid%dy
            expected = self%p(i, j) - stick*sqrt(max(1.0_dp - (x**2 + y**2)/stick**2, 0.0_dp))
            force = self%tx(i, j)*cos(angle) + self%ty(i, j)*sin(angle)
            error = error + (force - mu*expected)**2
            q = q + (mu*expected)**2
         end do
      end do
      ! The error comes from cells at the edge of the stick area, whose size is 0.06 c.
      call check_order(sqrt(error/q), '<', 5e-3_dp, 'Mindlin, traction')
      area = count(self%contact == contact_stick)*self%grid%dx*self%grid%dy
      call check_close(sqrt(area/pi), stick, 0.5_dp*self%grid%dx, 'Mindlin, radius of stick')
      call end_case(self)
   end subroutine mindlin_sphere_without_poisson_effect

   !> Mindlin's sphere under a prescribed force, oblique, each time from rest. The force is met to the
   !> tolerance. Motion and stick radius are exact for nu = 0.
   subroutine pulled_sphere_meets_its_force()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.4_dp, angle = 0.7_dp
      real(dp), parameter :: part(6) = [0.1_dp, 0.3_dp, 0.5_dp, 0.7_dp, 0.9_dp, 0.99_dp]
      real(dp) :: load, delta, area
      integer :: k

      call new_case(self, 128, 128, 2.5_dp, 2.5_dp, boundary_free, 0.0_dp, 0.0_dp)
      call set_hertz(self)
      self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
      load = sum(self%p)
      self%solver%pull%along = .true.
      do k = 1, size(part)
         self%tx = 0.0_dp
         self%ty = 0.0_dp
         self%drive_x = 0.0_dp
         self%drive_y = 0.0_dp
         self%solver%pull%traction = part(k)*mu*load/(128*128)*[cos(angle), sin(angle)]
         self%solver%pull%offset = 0.0_dp
         call run_pulled(self, 'pulled sphere', 1e-8_dp)
         call check_close(hypot(sum(self%tx), sum(self%ty))/(mu*load*part(k)), 1.0_dp, 1e-8_dp, &
            'pulled sphere, force')
         call check_close(sum(self%ty)/sum(self%tx), tan(angle), 1e-8_dp, 'pulled sphere, direction')
         delta = (1.0_dp - (1.0_dp - part(k))**(2.0_dp/3.0_dp))*full_slip(self, mu, 0.0_dp)
         call check_close(norm2(self%solver%pull%offset)/delta, 1.0_dp, 1e-3_dp, 'pulled sphere, place')
         area = count(self%contact == contact_stick)*self%grid%dx*self%grid%dy
         call check_close(sqrt(area/pi), (1.0_dp - part(k))**(1.0_dp/3.0_dp), 0.5_dp*self%grid%dx, &
            'pulled sphere, radius of stick')
      end do
      call end_case(self)
   end subroutine pulled_sphere_meets_its_force

   !> Solve with a prescribed force, and check the result as that of a road at the place found.
   subroutine run_pulled(self, what, accuracy)
      type(case_type), intent(inout) :: self
      character(*), intent(in) :: what
      real(dp), intent(in) :: accuracy

      where (self%contact /= contact_open) self%contact = contact_stick
      call solve_case(self)
      call check_that(self%result%converged, what//': converged, '//trim(self%result%reason))
      self%drive_x = self%drive_x + self%solver%pull%offset(1)
      self%drive_y = self%drive_y + self%solver%pull%offset(2)
      call prove(self, what, accuracy)
      self%drive_x = self%drive_x - self%solver%pull%offset(1)
      self%drive_y = self%drive_y - self%solver%pull%offset(2)
   end subroutine run_pulled

   !> Rough roads, flat and with slope, thin and thick blocks and half-spaces, periodic and free. A road at
   !> the place found exerts the prescribed force. One direction may be pulled alone.
   subroutine pulled_rough_road_finds_its_place()
      type(case_type) :: self
      real(dp), parameter :: thickness(4) = [0.0_dp, 0.05_dp, 2.0_dp, 50.0_dp]
      real(dp), allocatable :: tx(:, :), ty(:, :)
      real(dp) :: limit, scale
      integer :: k, n, boundary, iterations
      logical :: slope, both(2)

      do n = 1, 16
         slope = mod(n, 2) == 0
         boundary = merge(boundary_free, boundary_periodic, n > 12)
         call new_case(self, 48, 40, 1.0_dp, 0.9_dp, boundary, 0.3_dp, &
            merge(0.0_dp, thickness(1 + mod(n - 1, 8)/2), n > 12))
         call set_rough(self, 40 + n, 0.3_dp, 0.4_dp)
         self%law = new_friction_law('coulomb', 0.6_dp, 0.0_dp, 0.0_dp, slope, .true.)
         both = [.true., n <= 8]
         self%solver%pull%along = both
         limit = 0.6_dp*sum(self%p)/(48*40)
         self%solver%tolerance = 1e-8_dp
         iterations = 0
         do k = 1, 5
            ! forward, nearly to full slip, and back
            self%solver%pull%traction = limit*min(0.2_dp*k, 1.1_dp - 0.2_dp*k)*[0.8_dp, 0.3_dp]
            self%drive_y = merge(0.0_dp, 1e-3_dp*k, both(2))
            call run_pulled(self, 'pulled rough', 1e-6_dp)
            iterations = iterations + self%result%iterations
            call check_close(sum(self%tx)/(48*40)/self%solver%pull%traction(1), 1.0_dp, 1e-6_dp, &
               'pulled rough, force')
         end do
         ! The same problem with the place prescribed.
         allocate (tx, ty, source=self%tx)
         tx = self%tx
         ty = self%ty
         scale = sqrt(sum(tx**2 + ty**2))
         self%solver%pull%along = .false.
         self%drive_x = self%drive_x + self%solver%pull%offset(1)
         self%drive_y = self%drive_y + self%solver%pull%offset(2)
         call run_case(self, 'placed rough', 1e-6_dp)
         call check_close(sqrt(sum((tx - self%tx)**2 + (ty - self%ty)**2))/scale, 0.0_dp, 1e-5_dp, &
            'pulled rough, as placed')
         deallocate (tx, ty)
         call end_case(self)
      end do
   end subroutine pulled_rough_road_finds_its_place

   !> A pull above the friction is reported. The whole contact is then at its limit.
   subroutine pull_beyond_friction_is_reported()
      type(case_type) :: self
      integer :: boundary

      do boundary = boundary_periodic, boundary_free
         call new_case(self, 48, 40, 2.5_dp, 2.5_dp, boundary, 0.0_dp, 0.0_dp)
         call set_hertz(self)
         where (self%p <= 0.0_dp) self%contact = contact_open
         self%law = new_friction_law('coulomb', 0.4_dp, 0.0_dp, 0.0_dp, .false., .true.)
         self%solver%pull%along = .true.
         self%solver%pull%traction = 1.02_dp*0.4_dp*sum(self%p)/(48*40)*[0.6_dp, 0.8_dp]
         call solve_case(self)
         call check_that(.not. self%result%converged .and. self%solver%pull%slides_off, 'pulled off')
         call check_that(self%result%reason == 'the pull is more than the friction', 'pulled off, reason')
         call check_close(hypot(sum(self%tx), sum(self%ty))/sum(self%p), 0.4_dp, 1e-8_dp, 'pulled off, limit')
         call end_case(self)
      end do
   end subroutine pull_beyond_friction_is_reported

   !> nu = 0.42 and 0.5: Mindlin's solution neglects the slip across the load. The error is of second order in
   !> nu/(2-nu), the ratio of the two kernels: 1.05e-3 of full slip for 0.42 and 1.66e-3 for 0.5, for n = 128
   !> and 256 alike.
   subroutine mindlin_sphere_with_poisson_effect()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.4_dp, poisson(2) = [0.42_dp, 0.5_dp]
      real(dp) :: ratio
      integer :: k, l

      do l = 1, 2
         call new_case(self, 64, 64, 2.5_dp, 2.5_dp, boundary_free, poisson(l), 0.0_dp)
         call set_hertz(self)
         self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
         do k = 1, 9, 2
            self%drive_y = 0.1_dp*k*full_slip(self, mu, poisson(l))
            ratio = 1.0_dp - (1.0_dp - 0.1_dp*k)**1.5_dp
            call run_case(self, 'Mindlin, nu > 0', 1e-8_dp)
            call check_close(sum(self%ty)/(mu*sum(self%p)), ratio, &
               1.2e-3_dp*((poisson(l)/(2.0_dp - poisson(l)))/(0.42_dp/1.58_dp))**2, 'Mindlin, nu > 0')
         end do
         call end_case(self)
      end do
   end subroutine mindlin_sphere_with_poisson_effect

   !> Loading, unloading and reloading (Mindlin and Deresiewicz, 1953), nu = 0. With the curve of loading Q =
   !> f(u), unloading from u1 follows Q1 - 2 f((u1 - u)/2). Reloading from u2 follows Q2 + 2 f((u - u2)/2),
   !> and closes the loop at u1.
   subroutine mindlin_unloading_and_reloading()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.4_dp
      real(dp), parameter :: path(6) = [0.4_dp, 0.8_dp, 0.3_dp, -0.4_dp, 0.2_dp, 0.8_dp]
      real(dp) :: expected(6), force, before
      integer :: k

      expected(1) = loading(0.4_dp)
      expected(2) = loading(0.8_dp)
      expected(3) = expected(2) - 2.0_dp*loading(0.25_dp)
      expected(4) = expected(2) - 2.0_dp*loading(0.6_dp)
      expected(5) = expected(4) + 2.0_dp*loading(0.3_dp)
      expected(6) = expected(2)
      call new_case(self, 96, 80, 2.5_dp, 2.4_dp, boundary_free, 0.0_dp, 0.0_dp)
      call set_hertz(self)
      self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
      before = 0.0_dp
      self%drive_x = 0.0_dp
      do k = 1, 6
         ! DX = U of the step before plus the step of the road; U = DX - slip.
         self%drive_x = self%drive_x + (path(k) - before)*full_slip(self, mu, 0.0_dp)
         before = path(k)
         call run_case(self, 'loading and unloading', 1e-8_dp)
         self%drive_x = self%drive_x - self%rx
         self%drive_y = self%drive_y - self%ry
         force = sum(self%tx)/(mu*sum(self%p))
         call check_close(force, expected(k), 2e-4_dp, 'Mindlin-Deresiewicz')
      end do
      call end_case(self)
   end subroutine mindlin_unloading_and_reloading

   !> Q/(mu F) at first loading by u, relative to full slip.
   pure function loading(u) result(q)
      real(dp), intent(in) :: u
      real(dp) :: q

      q = 1.0_dp - (1.0_dp - u)**1.5_dp
   end function loading

   !> The number of products of the operator (4 transforms each) for a sphere at half of full slip.
   subroutine number_of_products_is_bounded()
      type(case_type) :: self
      integer, parameter :: sizes(3) = [64, 128, 256]
      real(dp), parameter :: tolerances(2) = [1e-5_dp, 1e-8_dp], mu = 0.4_dp
      integer, parameter :: most(2) = [30, 45]
      integer :: k, l

      do k = 1, 3
         call new_case(self, sizes(k), sizes(k), 2.5_dp, 2.5_dp, boundary_free, 0.42_dp, 0.0_dp)
         call set_hertz(self)
         self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
         self%drive_x = (1.0_dp - 0.5_dp**(2.0_dp/3.0_dp))*full_slip(self, mu, 0.42_dp)
         do l = 1, 2
            self%tx = 0.0_dp
            self%ty = 0.0_dp
            self%solver%tolerance = tolerances(l)
            self%operator%ffts = 0
            call solve_case(self)
            call check_that(self%result%converged, 'half slip: converged')
            call check_order(int(self%operator%ffts), '<=', 4*most(l), 'half slip: products')
         end do
         call end_case(self)
      end do
   end subroutine number_of_products_is_bounded

   !> Full stick and full slip.
   subroutine full_stick_and_full_slip()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.4_dp
      real(dp) :: big, bad

      call new_case(self, 48, 40, 2.5_dp, 2.5_dp, boundary_free, 0.3_dp, 0.0_dp)
      call set_hertz(self)
      self%law = new_friction_law('coulomb', 1e6_dp, 0.0_dp, 0.0_dp, .false., .true.)
      self%drive_x = 1.0_dp
      call run_case(self, 'full stick', 1e-8_dp)
      call check_that(count(self%contact == contact_slip) == 0, 'full stick: nothing slips')
      bad = maxval(hypot(self%rx, self%ry), self%contact == contact_stick)
      call check_order(bad, '<', 1e-8_dp, 'full stick: no slip')
      self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
      big = 3.0_dp*full_slip(self, mu, 0.3_dp)
      self%drive_x = 0.6_dp*big
      self%drive_y = -0.8_dp*big
      call run_case(self, 'full slip', 1e-8_dp)
      call check_that(count(self%contact == contact_stick) == 0, 'full slip: nothing sticks')
      call check_close(maxval(abs(hypot(self%tx, self%ty) - mu*self%p)), 0.0_dp, 1e-14_dp, &
         'full slip: T = mu P')
      self%p = 0.0_dp
      call run_case(self, 'no contact', 1e-8_dp)
      call check_that(self%result%reason == 'no contact', 'no contact is named')
      call end_case(self)
   end subroutine full_stick_and_full_slip

   !> A rough problem with waves of the wave numbers 2 to 6. The pressure is positive where the road is higher
   !> than `threshold`.
   subroutine set_rough(self, seed, slope, threshold)
      type(case_type), intent(inout) :: self
      integer, intent(in) :: seed
      real(dp), intent(in) :: slope          !! rms of the gradient
      real(dp), intent(in) :: threshold      !! in units of the rms height
      real(dp) :: qx, qy, q, phase, amplitude, argument, rms
      integer :: a, b, i, j

      associate (nx => self%grid%nx, ny => self%grid%ny)
         do b = -6, 6
            do a = 0, 6
               if (a**2 + b**2 < 4 .or. a**2 + b**2 > 36) cycle
               if (2*a >= nx .or. 2*abs(b) >= ny) cycle
               qx = 2.0_dp*pi*a/self%grid%lx
               qy = 2.0_dp*pi*b/self%grid%ly
               q = hypot(qx, qy)
               phase = modulo(1e4_dp*sin(12.9898_dp*seed + 78.233_dp*a + 37.719_dp*b), 1.0_dp)
               amplitude = q**(-1.8_dp)
               do j = 1, ny
                  do i = 1, nx
                     argument = qx*(i - 1)*self%grid%dx + qy*(j - 1)*self%grid%dy + 2.0_dp*pi*phase
                     self%p(i, j) = self%p(i, j) + amplitude*cos(argument)
                     self%hx(i, j) = self%hx(i, j) - qx*amplitude*sin(argument)
                     self%hy(i, j) = self%hy(i, j) - qy*amplitude*sin(argument)
                  end do
               end do
            end do
         end do
         rms = sqrt(sum(self%p**2)/(nx*ny))
         self%p = sqrt(max(self%p/rms - threshold, 0.0_dp))
         rms = sqrt(sum(self%hx**2 + self%hy**2)/(nx*ny))
         self%hx = self%hx*slope/rms
         self%hy = self%hy*slope/rms
      end associate
   end subroutine set_rough

   !> Rough roads, periodic and free, flat and sloping, both laws of slip, weak and strong friction.
   subroutine rough_contacts_meet_the_law()
      type(case_type) :: self
      real(dp), parameter :: mu(4) = [0.05_dp, 0.2_dp, 0.7_dp, 1.5_dp]
      real(dp), parameter :: slopes(3) = [0.0_dp, 0.1_dp, 0.2_dp], drives(2) = [0.03_dp, 0.4_dp]
      real(dp), parameter :: thickness(2) = [0.2_dp, 1.5_dp]
      integer :: boundary, k, l, m, seed
      real(dp) :: drive

      seed = 0
      do boundary = boundary_periodic, boundary_free
         do l = 1, 3
            do k = 1, 4
               do m = 1, 2
                  seed = seed + 1
                  call new_case(self, 45, 32, 1.0_dp, 0.8_dp, boundary, 0.48_dp, &
                     thickness(1 + mod(seed/2, 2)))
                  call set_rough(self, seed, slopes(l), 0.8_dp*mod(seed, 3) - 0.4_dp)
                  self%law = new_friction_law('coulomb', mu(k), 0.0_dp, 0.0_dp, l > 1, mod(seed, 5) > 0)
                  drive = mu(k)*sum(self%p)/size(self%p)*drives(m)
                  self%drive_x = drive*cos(1.0_dp*seed)
                  self%drive_y = drive*sin(1.0_dp*seed)
                  call run_case(self, 'rough', 1e-8_dp)
                  call end_case(self)
               end do
            end do
         end do
      end do
   end subroutine rough_contacts_meet_the_law

   !> Both methods give the same result.
   subroutine methods_agree()
      type(case_type) :: self
      real(dp), allocatable :: tx(:, :), ty(:, :)
      character(*), parameter :: methods(3) = [character(8) :: 'fast', 'thesis', 'gradient']
      type(error_type), allocatable :: error
      real(dp) :: drive, bad
      integer :: k, l, boundary

      do boundary = boundary_periodic, boundary_free
         do l = 0, 1
            call new_case(self, 40, 28, 1.0_dp, 0.8_dp, boundary, 0.4_dp, 0.3_dp)
            call set_rough(self, 17, 0.1_dp, 0.3_dp)
            self%law = new_friction_law('coulomb_orowan', 0.4_dp, 0.3_dp, 0.0_dp, l == 1, .true.)
            drive = 0.1_dp*sum(self%p)/size(self%p)
            self%drive_x = drive
            self%drive_y = 0.5_dp*drive
            do k = 1, 3
               call self%solver%destroy()
               call new_friction_solver(self%solver, self%grid, self%operator, error, trim(methods(k)))
               call check_no_error(error, 'method')
               self%solver%max_iterations = 5000
               self%solver%tolerance = 1e-8_dp
               self%tx = 0.0_dp
               self%ty = 0.0_dp
               call run_case(self, 'method', 1e-8_dp)
               if (k == 1) then
                  tx = self%tx
                  ty = self%ty
                  call check_that(count(self%contact == contact_slip) > 50 &
                     .and. count(self%contact == contact_stick) > 50, 'stick and slip')
               else
                  bad = maxval(hypot(self%tx - tx, self%ty - ty))/maxval(hypot(tx, ty))
                  call check_order(bad, '<', 1e-5_dp, 'the methods agree')
               end if
            end do
            deallocate (tx, ty)
            call end_case(self)
         end do
      end do
   end subroutine methods_agree

   !> If a stop is requested, each method returns within one iteration, with and without a pull. Solver and
   !> operator are then unchanged: the next solve gives the same bits.
   subroutine a_stop_ends_the_solve()
      type(case_type) :: self
      real(dp), allocatable :: tx(:, :)
      character(*), parameter :: methods(3) = [character(8) :: 'fast', 'thesis', 'gradient']
      type(error_type), allocatable :: error
      integer :: k, most, pulled, part

      call new_case(self, 40, 28, 1.0_dp, 0.8_dp, boundary_periodic, 0.4_dp, 0.3_dp)
      call set_rough(self, 17, 0.1_dp, 0.3_dp)
      self%law = new_friction_law('coulomb_orowan', 0.4_dp, 0.3_dp, 0.0_dp, .false., .true.)
      self%drive_x = 0.1_dp*sum(self%p)/size(self%p)
      do k = 1, 3
         call self%solver%destroy()
         call new_friction_solver(self%solver, self%grid, self%operator, error, trim(methods(k)))
         call check_no_error(error, 'method')
         self%solver%max_iterations = 5000
         do pulled = 0, 1
            call solve_from_zero(self, pulled == 1)
            call check_that(self%result%converged .and. .not. self%result%stopped, 'without a stop: solved')
            most = self%result%iterations
            tx = self%tx
            do part = 0, 4
               questions = (most - 1)*part/4
               call begin_watch(asked, 0.0_dp)
               call solve_from_zero(self, pulled == 1)
               call end_watch()
               call check_that(self%result%stopped .and. .not. self%result%converged, 'with a stop: given up')
               call check_that(self%result%iterations == (most - 1)*part/4, 'given up at the iteration of the stop')
               call solve_from_zero(self, pulled == 1)
               call check_that(self%result%iterations == most .and. .not. any(abs(self%tx - tx) > 0.0_dp), &
                  'after a stop: the same bits')
            end do
         end do
      end do
      call end_case(self)
   end subroutine a_stop_ends_the_solve

   !> Solve from zero traction, with the road driven or pulled.
   subroutine solve_from_zero(self, pulled)
      type(case_type), intent(inout) :: self
      logical, intent(in) :: pulled

      self%tx = 0.0_dp
      self%ty = 0.0_dp
      self%solver%pull%along = pulled
      self%solver%pull%traction = [0.2_dp, 0.1_dp]*sum(self%p)/size(self%p)
      self%solver%pull%offset = 0.0_dp
      where (self%contact /= contact_open) self%contact = contact_stick
      call solve_case(self)
   end subroutine solve_from_zero

   !> Is a stop requested? The answer is no as often as `questions` says, then yes.
   function asked() bind(c, name='asked_of_friction_cg') result(yes)
      integer(c_int) :: yes

      yes = merge(0_c_int, 1_c_int, questions > 0)
      questions = questions - 1
   end function asked

   !> Rotation by 90 degrees and reflection, on a grid with nx /= ny and dx /= dy.
   subroutine turned_and_mirrored_contacts_agree()
      type(case_type) :: self, turned
      integer, parameter :: nx = 36, ny = 27
      real(dp), parameter :: drive = 0.02_dp
      real(dp) :: bad
      integer :: boundary, i, j

      do boundary = boundary_periodic, boundary_free
         call new_case(self, nx, ny, 1.1_dp, 0.7_dp, boundary, 0.45_dp, 0.4_dp)
         call set_rough(self, 5, 0.15_dp, 0.2_dp)
         self%law = new_friction_law('coulomb', 0.3_dp, 0.0_dp, 0.0_dp, .true., .true.)
         self%drive_x = drive
         self%drive_y = 0.4_dp*drive
         call run_case(self, 'isotropy', 1e-8_dp)

         ! x' = y, y' = -x, with cell (i, j) at (j, -i).
         call new_case(turned, ny, nx, 0.7_dp, 1.1_dp, boundary, 0.45_dp, 0.4_dp)
         turned%law = self%law
         do i = 1, nx
            do j = 1, ny
               turned%p(j, nx + 1 - i) = self%p(i, j)
               turned%hx(j, nx + 1 - i) = self%hy(i, j)
               turned%hy(j, nx + 1 - i) = -self%hx(i, j)
               turned%drive_x(j, nx + 1 - i) = self%drive_y(i, j)
               turned%drive_y(j, nx + 1 - i) = -self%drive_x(i, j)
            end do
         end do
         call run_case(turned, 'turned', 1e-8_dp)
         bad = 0.0_dp
         do i = 1, nx
            do j = 1, ny
               bad = max(bad, abs(turned%tx(j, nx + 1 - i) - self%ty(i, j)), &
                  abs(turned%ty(j, nx + 1 - i) + self%tx(i, j)))
            end do
         end do
         call check_order(bad, '<', 1e-6_dp*maxval(hypot(self%tx, self%ty)), 'turned by 90 degrees')
         call end_case(turned)

         call new_case(turned, nx, ny, 1.1_dp, 0.7_dp, boundary, 0.45_dp, 0.4_dp)
         turned%law = self%law
         turned%p = self%p(:, ny:1:-1)
         turned%hx = self%hx(:, ny:1:-1)
         turned%hy = -self%hy(:, ny:1:-1)
         turned%drive_x = self%drive_x(:, ny:1:-1)
         turned%drive_y = -self%drive_y(:, ny:1:-1)
         call run_case(turned, 'mirrored', 1e-8_dp)
         bad = max(maxval(abs(turned%tx - self%tx(:, ny:1:-1))), &
            maxval(abs(turned%ty + self%ty(:, ny:1:-1))))
         call check_order(bad, '<', 1e-6_dp*maxval(hypot(self%tx, self%ty)), 'mirrored')
         call end_case(turned)
         call end_case(self)
      end do
   end subroutine turned_and_mirrored_contacts_agree

   !> With mu = 0 and slope, the traction is that of a frictionless contact for any motion.
   subroutine frictionless_traction_on_slopes()
      type(case_type) :: self

      call new_case(self, 40, 25, 1.0_dp, 1.0_dp, boundary_periodic, 0.5_dp, 0.2_dp)
      call set_rough(self, 3, 0.4_dp, 0.5_dp)
      self%law = new_friction_law('coulomb', 0.0_dp, 0.0_dp, 0.0_dp, .true., .true.)
      self%drive_x = 0.3_dp
      self%drive_y = -0.1_dp
      call run_case(self, 'no friction', 1e-8_dp)
      call check_close(sum(self%tx), -sum(self%p*self%hx), 1e-12_dp*sum(self%p), 'sum T_x = -sum P H_x')
      call check_close(sum(self%ty), -sum(self%p*self%hy), 1e-12_dp*sum(self%p), 'sum T_y = -sum P H_y')
      call end_case(self)
   end subroutine frictionless_traction_on_slopes

   !> Constant shear: sigma_max up to the edge of the contact, where P goes to 0, and no traction outside.
   subroutine constant_shear_up_to_the_edge()
      type(case_type) :: self
      real(dp), parameter :: strength = 0.3_dp

      call new_case(self, 50, 64, 2.5_dp, 2.5_dp, boundary_free, 0.5_dp, 0.0_dp)
      call set_hertz(self)
      self%law = new_friction_law('constant_shear', 0.0_dp, strength, 0.0_dp, .false., .true.)
      self%drive_x = 2.0_dp
      self%tx = 7.0_dp                 ! a start outside every bound, also in open cells
      call run_case(self, 'constant shear', 1e-8_dp)
      call check_close(sum(self%tx), strength*count(self%p > 0.0_dp), &
         1e-3_dp*strength*count(self%p > 0.0_dp), 'constant shear times the area of contact')
      call check_that(all(hypot(self%tx, self%ty) <= 0.0_dp .or. self%p > 0.0_dp), 'none outside')
      self%drive_x = 0.1_dp
      call run_case(self, 'constant shear, partial slip', 1e-8_dp)
      call check_that(any(self%contact == contact_stick) .and. any(self%contact == contact_slip), &
         'constant shear: stick and slip')
      call end_case(self)
   end subroutine constant_shear_up_to_the_edge

   !> Adhesion: the bound is mu (P + p_a), also where the pressure is negative. No load is needed.
   subroutine adhesion_widens_the_bound()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.5_dp, pa = 0.3_dp

      call new_case(self, 48, 48, 2.5_dp, 2.5_dp, boundary_free, 0.5_dp, 0.0_dp)
      call set_hertz(self)
      where (self%p <= 0.0_dp) self%contact = contact_open
      self%p = self%p - 0.25_dp
      self%law = new_friction_law('coulomb', mu, 0.0_dp, pa, .false., .true.)
      self%drive_x = 3.0_dp
      call run_case(self, 'adhesion, full slip', 1e-8_dp)
      call check_close(sum(hypot(self%tx, self%ty)), &
         mu*sum(self%p + pa, self%contact /= contact_open), 1e-11_dp, 'adhesion: mu (P + p_a)')
      self%drive_x = 0.05_dp
      call run_case(self, 'adhesion, partial slip', 1e-8_dp)
      call check_that(any(self%contact == contact_stick) .and. any(self%contact == contact_slip), &
         'adhesion: stick and slip')
      call end_case(self)
   end subroutine adhesion_widens_the_bound

   !> One row along x or along y is the same problem, the line contact.
   subroutine line_contacts_along_x_and_y_agree()
      type(case_type) :: self, other
      integer, parameter :: n = 60
      integer :: i

      call new_case(self, n, 1, 1.0_dp, 1.0_dp, boundary_periodic, 0.3_dp, 0.2_dp)
      call new_case(other, 1, n, 1.0_dp, 1.0_dp, boundary_periodic, 0.3_dp, 0.2_dp)
      do i = 1, n
         self%p(i, 1) = sqrt(max(0.1_dp - (1.0_dp*(i - 0.5_dp)/n - 0.5_dp)**2, 0.0_dp))
         self%hx(i, 1) = 0.2_dp*sin(2.0_dp*pi*i/n)
      end do
      self%drive_x = 0.02_dp
      self%drive_y = 0.01_dp
      self%law = new_friction_law('coulomb', 0.4_dp, 0.0_dp, 0.0_dp, .true., .true.)
      other%law = self%law
      other%p = transpose(self%p)
      other%hy = transpose(self%hx)
      other%drive_x = 0.01_dp
      other%drive_y = 0.02_dp
      call run_case(self, 'line along x', 1e-8_dp)
      call run_case(other, 'line along y', 1e-8_dp)
      call check_order(maxval(abs(self%tx - transpose(other%ty))), '<', 1e-7_dp, 'lines: along')
      call check_order(maxval(abs(self%ty - transpose(other%tx))), '<', 1e-7_dp, 'lines: across')
      call check_that(any(self%contact == contact_stick) .and. any(self%contact == contact_slip), &
         'lines: stick and slip')
      call end_case(self)
      call end_case(other)
   end subroutine line_contacts_along_x_and_y_agree

   !> A uniform contact in full stick moves by the mean mode only: T = DX/compliance.
   subroutine uniform_contact_moves_by_mean_mode()
      type(case_type) :: self
      real(dp) :: measured

      call new_case(self, 30, 20, 1.0_dp, 1.0_dp, boundary_periodic, 0.5_dp, 0.7_dp)
      self%p = 1.0_dp
      self%law = new_friction_law('coulomb', 10.0_dp, 0.0_dp, 0.0_dp, .false., .true.)
      self%drive_x = 0.1_dp
      call run_case(self, 'block', 1e-8_dp)
      call check_close(self%tx(3, 7), 0.1_dp/0.7_dp, 1e-8_dp, 'block: T = G DX/h')
      call self%operator%symbols%set_mean_compliance(0.02_dp)
      call run_case(self, 'block with inertia', 1e-8_dp)
      measured = sum(self%tx)/size(self%tx)
      call check_close(measured, 0.1_dp/0.02_dp, 1e-7_dp, 'mean compliance set by the caller')
      call end_case(self)
      call new_case(self, 1, 1, 1.0_dp, 1.0_dp, boundary_periodic, 0.5_dp, 0.7_dp)
      self%p = 1.0_dp
      self%law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .false., .true.)
      self%drive_x = 0.1_dp
      call run_case(self, 'one cell', 1e-8_dp)
      call check_close(self%tx(1, 1), 0.1_dp/0.7_dp, 1e-8_dp, 'one cell: sticks')
      self%drive_x = 1.0_dp
      call run_case(self, 'one cell', 1e-8_dp)
      call check_close(self%tx(1, 1), 0.5_dp, 1e-12_dp, 'one cell: slips')
      call end_case(self)
   end subroutine uniform_contact_moves_by_mean_mode

   !> Full contact of a periodic half-space: a uniform traction strains nothing, so that it grows in the smallest motion until
   !> some cells slip.
   subroutine full_contact_without_mean_compliance()
      integer, parameter :: cells(2, 4) = reshape([40, 40, 45, 32, 64, 64, 48, 1], [2, 4])
      type(case_type) :: self
      integer :: i, j, k, motion

      do k = 1, size(cells, 2)
         do motion = -7, -3
            call new_case(self, cells(1, k), cells(2, k), 1.0_dp, 0.8_dp, boundary_periodic, 0.4_dp, 0.0_dp)
            do j = 1, self%grid%ny
               do i = 1, self%grid%nx
                  self%p(i, j) = 0.05_dp + 0.025_dp*cos(4*pi*i/self%grid%nx)*cos(4*pi*j/self%grid%ny)
               end do
            end do
            self%law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .false., .true.)
            self%drive_x = 10.0_dp**motion
            self%drive_y = 0.3_dp*self%drive_x
            self%solver%tolerance = 1e-6_dp
            call run_case(self, 'full contact', 1e-5_dp)
            call check_that(count(self%contact == contact_slip) > 0, 'cells slip')
            call check_that(self%result%iterations <= 100, 'number of iterations', [real(self%result%iterations, dp)])
            call end_case(self)
         end do
      end do
   end subroutine full_contact_without_mean_compliance

   !> The smallest motions on a sloped road are solved like larger ones: tractions that are small compared with the
   !> tangential component of the pressure must not be lost in its round-off. The motions go down to a velocity that is
   !> meant to be zero and is only round-off.
   subroutine motions_of_any_size_are_solved()
      real(dp), parameter :: motions(5) = [1e-4_dp, 1e-7_dp, 1e-10_dp, 1e-13_dp, 1e-18_dp]
      type(case_type) :: self
      integer :: boundary, k

      do boundary = boundary_periodic, boundary_free
         do k = 1, size(motions)
            call new_case(self, 40, 32, 1.0_dp, 0.8_dp, boundary, 0.5_dp, 0.0_dp)
            call set_rough(self, 5, 0.3_dp, 0.2_dp)
            self%law = new_friction_law('coulomb', 1.5_dp, 0.0_dp, 0.0_dp, .true., .true.)
            self%drive_x = motions(k)
            self%drive_y = -0.4_dp*motions(k)
            call run_case(self, 'small motion', 1e-7_dp)
            call check_that(self%result%iterations <= 60, 'number of iterations', [motions(k), real(self%result%iterations, dp)])
            call end_case(self)
         end do
      end do
   end subroutine motions_of_any_size_are_solved

   !> The solver returns at once if it starts from the solution. Tractions from a higher pressure are reduced
   !> to the bound.
   subroutine own_solution_is_kept()
      type(case_type) :: self

      call new_case(self, 40, 32, 1.0_dp, 0.8_dp, boundary_periodic, 0.5_dp, 0.5_dp)
      call set_rough(self, 8, 0.1_dp, 0.2_dp)
      self%law = new_friction_law('coulomb', 0.3_dp, 0.0_dp, 0.0_dp, .true., .true.)
      self%drive_x = 0.05_dp
      call run_case(self, 'first', 1e-8_dp)
      self%solver%tolerance = 1e-8_dp
      call run_case(self, 'again', 1e-7_dp)
      call check_that(self%result%iterations == 0, 'nothing to do')
      self%p = max(0.5_dp*self%p - 0.1_dp, 0.0_dp)
      call return_tractions(self%law, self%p, self%hx, self%hy, self%contact, self%tx, self%ty)
      call check_that(largest_excess(self%law, self%p, self%hx, self%hy, self%contact, self%tx, &
         self%ty) < 1e-14_dp, 'returned to the bound of a new pressure')
      call check_that(all((self%contact /= contact_open) .eqv. self%p > 0.0_dp), 'contact of it')
      call end_case(self)
   end subroutine own_solution_is_kept

   !> If all points slip far, the direction of the slip alone determines the start: after the slip of the
   !> solution itself no iteration is left, whatever the tractions of the points were.
   subroutine expected_slip_is_a_good_start()
      type(case_type) :: self
      real(dp), allocatable :: tx(:, :), ty(:, :)
      integer :: boundary, k, before

      do boundary = boundary_periodic, boundary_free
         do k = 1, 2
            call new_case(self, 40, 32, 1.0_dp, 0.8_dp, boundary, 0.5_dp, 0.5_dp)
            call set_rough(self, 8 + boundary, 0.1_dp, 0.2_dp)
            self%law = new_friction_law('coulomb', 0.3_dp, 0.0_dp, 0.0_dp, .true., k == 1)
            self%drive_x = 2.0_dp
            self%drive_y = 1.0_dp
            call run_case(self, 'full slip', 1e-8_dp)
            call check_that(.not. any(self%contact == contact_stick), 'all points slip')
            before = self%result%iterations
            tx = self%tx
            ty = self%ty

            ! Half of the points lose their traction, as if they had just come into contact.
            self%tx(::2, :) = 0.0_dp
            self%ty(::2, :) = 0.0_dp
            where (self%contact /= contact_open) self%contact = contact_stick
            self%rx = 0.2_dp*self%rx
            self%ry = 0.2_dp*self%ry
            call solve_case(self, slip_unit=5.0_dp)
            call check_that(self%result%converged, 'converged')
            call check_that(self%result%iterations == 0 .and. before > 2, 'nothing is left to do', &
               [real(self%result%iterations, dp), real(before, dp)])
            call prove(self, 'from the slip', 1e-8_dp)
            call check_order(maxval(hypot(self%tx - tx, self%ty - ty)), '<=', 1e-6_dp*maxval(hypot(tx, ty)), &
               'the same tractions')

            ! An expected slip in the opposite direction is only a bad start.
            self%rx = -self%rx
            self%ry = -self%ry
            call solve_case(self, slip_unit=1.0_dp)
            call check_that(self%result%converged, 'converged from the wrong slip')
            call prove(self, 'from the wrong slip', 1e-8_dp)
            call end_case(self)
         end do
      end do
   end subroutine expected_slip_is_a_good_start

   !> Rough contacts on square and oblong cells, flat and sloping, periodic and free, in two dimensions and in one: the
   !> tractions are the same whether a solve from rest starts on a coarser grid or not. In the third one a few slopes are
   !> too steep for zero tractions. The last one begins on the grid in any case, because its coarser grid would be the grid
   !> itself.
   subroutine a_start_on_a_coarser_grid_changes_nothing()
      integer, parameter :: cells(2, 8) = reshape([60, 48, 61, 37, 60, 48, 50, 41, 90, 24, 24, 90, 300, 1, 300, 1], [2, 8])
      real(dp), parameter :: sides(2, 8) = reshape([1.0_dp, 0.8_dp, 1.0_dp, 0.6_dp, 1.0_dp, 0.8_dp, 1.0_dp, 0.8_dp, &
         1.0_dp, 2.0_dp, 1.0_dp, 1.0_dp, 1.0_dp, 0.01_dp, 1.0_dp, 2.0e-4_dp], [2, 8])
      integer, parameter :: boundary(8) = [boundary_periodic, boundary_free, boundary_periodic, boundary_free, &
         boundary_periodic, boundary_periodic, boundary_periodic, boundary_periodic]
      real(dp), parameter :: slopes(8) = [0.0_dp, 0.0_dp, 0.2_dp, 0.1_dp, 0.1_dp, 0.0_dp, 0.1_dp, 0.0_dp]
      type(case_type) :: self
      real(dp), allocatable :: tx(:, :), ty(:, :), past(:, :, :)
      real(dp) :: bad
      integer :: k, from

      do k = 1, size(boundary)
         call new_case(self, cells(1, k), cells(2, k), sides(1, k), sides(2, k), boundary(k), 0.4_dp, &
            merge(0.3_dp, 0.0_dp, k > 2))
         call set_rough(self, k, slopes(k), 0.2_dp)
         self%law = new_friction_law('coulomb_orowan', 0.4_dp, 0.5_dp, 0.0_dp, slopes(k) > 0.0_dp, .true.)
         self%drive_x = merge(0.02_dp, 0.06_dp, k == 1)*sum(self%p)/size(self%p)
         self%drive_y = 0.5_dp*self%drive_x
         allocate (past(cells(1, k), 2, cells(2, k)), source=0.0_dp)
         if (mod(k, 2) == 0) past(:, 1, :) = -0.05_dp*self%p
         do from = 1, 2
            self%solver%coarse_start_from = merge(1, huge(1), from == 1)
            self%tx = 0.0_dp
            self%ty = 0.0_dp
            where (self%contact /= contact_open) self%contact = contact_stick
            call solve_case(self, past)
            call check_that(self%result%converged, 'converged, '//trim(self%result%reason))
            if (from == 1) tx = self%tx
            if (from == 1) ty = self%ty
         end do
         call check_that(count(self%contact == contact_slip) > 20 .and. count(self%contact == contact_stick) > 20, &
            'stick and slip')
         bad = maxval(hypot(self%tx - tx, self%ty - ty))/maxval(hypot(tx, ty))
         call check_order(bad, '<', 1e-6_dp, 'the same tractions')
         call check_that((bad > 0.0_dp) .eqv. (k /= 8), 'another start where there is one')
         deallocate (tx, ty, past)
         call end_case(self)
      end do
   end subroutine a_start_on_a_coarser_grid_changes_nothing

   !> A sphere from rest to half of full slip takes a quarter fewer transforms with a start on a coarser grid. Where the
   !> start is given, with adhesion, without friction, where the road is pulled, and where all cells are expected to slip,
   !> the solve begins on the grid.
   subroutine a_start_on_a_coarser_grid_saves_products()
      type(case_type) :: self
      character(*), parameter :: names(7) = [character(15) :: 'from rest', 'a few will slip', 'a given start', 'adhesion', &
         'no friction', 'a pulled road', 'all will slip']
      real(dp), parameter :: mu(7) = [0.4_dp, 0.4_dp, 0.4_dp, 0.4_dp, 0.0_dp, 0.4_dp, 0.4_dp]
      real(dp), parameter :: attraction(7) = [0.0_dp, 0.0_dp, 0.0_dp, 0.1_dp, 0.0_dp, 0.0_dp, 0.0_dp]
      real(dp) :: least                        !! pressure of a cell that is not expected to slip, Pa
      integer(int64) :: counts(2)
      integer :: from, k

      call new_case(self, 128, 128, 2.5_dp, 2.5_dp, boundary_free, 0.42_dp, 0.0_dp)
      call set_hertz(self)
      self%drive_x = (1.0_dp - 0.5_dp**(2.0_dp/3.0_dp))*full_slip(self, 0.4_dp, 0.42_dp)
      self%solver%tolerance = 1e-5_dp
      do k = 1, size(names)
         self%law = new_friction_law('coulomb', mu(k), 0.0_dp, attraction(k), .false., .true.)
         self%solver%pull%along = k == 6
         if (k == 6) self%solver%pull%traction = 0.5_dp*mu(k)*sum(self%p)/size(self%p)*[1.0_dp, 0.0_dp]
         do from = 1, 2
            self%solver%coarse_start_from = merge(huge(1), 1000, from == 1)
            self%tx = merge(0.01_dp*self%p, 0.0_dp, k == 3)
            self%ty = 0.0_dp
            self%contact = merge(contact_stick, contact_open, self%p > 0.0_dp)
            self%solver%pull%offset = 0.0_dp
            least = merge(0.1_dp, 2.0_dp, k == 2)*maxval(self%p)
            self%rx = merge(self%drive_x, 0.0_dp, self%p < least)
            self%ry = 0.0_dp
            call solve_case(self, slip_unit=merge(1.0_dp, 0.0_dp, k == 2 .or. k == 7))
            call check_that(self%result%converged, trim(names(k))//': converged')
            counts(from) = self%result%ffts
         end do
         if (k <= 2) then
            call check_order(real(counts(2), dp), '<', 0.75_dp*counts(1), trim(names(k))//': transforms')
         else
            call check_that(counts(2) == counts(1), trim(names(k))//': the same number of transforms')
         end if
      end do
      call end_case(self)
   end subroutine a_start_on_a_coarser_grid_saves_products

   !> A traction of the past T_h is equivalent to -A T_h in the motion.
   subroutine past_traction_is_like_a_drive()
      type(case_type) :: self
      real(dp), allocatable :: past_x(:, :), past_y(:, :), ux(:, :), uy(:, :), tx(:, :), ty(:, :)
      real(dp) :: largest

      call new_case(self, 36, 30, 1.0_dp, 0.8_dp, boundary_periodic, 0.5_dp, 0.5_dp)
      call set_rough(self, 4, 0.1_dp, 0.1_dp)
      self%law = new_friction_law('coulomb', 0.4_dp, 0.0_dp, 0.0_dp, .true., .true.)
      self%drive_x = 0.04_dp
      past_x = 0.1_dp*self%p**2
      past_y = -0.05_dp*self%p
      allocate (ux, uy, mold=self%tx)
      call solve_case(self, reshape([past_x, past_y], [36, 2, 30], order=[1, 3, 2]))
      call check_that(self%result%converged, 'past: converged')
      tx = self%tx
      ty = self%ty
      ! U = A (T + T_h) = DX - r, without a product by the caller.
      call self%operator%apply_vector(tx + past_x, ty + past_y, ux, uy)
      largest = maxval(hypot(self%drive_x - self%rx - ux, self%drive_y - self%ry - uy))
      call check_order(largest, '<', 1e-13_dp, 'past: slip = DX - A (T + T_h)')
      call self%operator%apply_vector(past_x, past_y, ux, uy)
      self%drive_x = self%drive_x - ux
      self%drive_y = self%drive_y - uy
      self%tx = 0.0_dp
      self%ty = 0.0_dp
      call run_case(self, 'past in the drive', 1e-8_dp)
      largest = maxval(hypot(self%tx - tx, self%ty - ty))/maxval(hypot(tx, ty))
      call check_order(largest, '<', 1e-6_dp, 'past: the two ways agree')
      call end_case(self)
   end subroutine past_traction_is_like_a_drive

   !> A block is dragged over a moving pressure in small steps, from rest into full slip and back. Each step
   !> is checked, and the traction of full slip without slope is mu times the load.
   subroutine block_dragged_into_full_slip_and_back()
      type(case_type) :: self
      real(dp), parameter :: mu = 0.5_dp, step = 0.02_dp
      integer :: k
      integer :: iterations

      call new_case(self, 40, 25, 1.0_dp, 0.7_dp, boundary_periodic, 0.5_dp, 1.2_dp)
      call set_rough(self, 6, 0.1_dp, -0.3_dp)
      self%law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .false., .true.)
      self%solver%tolerance = 1e-8_dp
      iterations = 0
      do k = 1, 60
         self%p = cshift(self%p, -1, 1)
         self%drive_x = self%drive_x + merge(step, -step, k <= 50)
         where (self%contact /= contact_slip) self%contact = contact_stick
         call solve_case(self)
         call check_that(self%result%converged, 'slide: converged')
         call prove(self, 'slide', 1e-7_dp)
         iterations = iterations + self%result%iterations
         self%drive_x = self%drive_x - self%rx
         self%drive_y = self%drive_y - self%ry
         if (k == 50) then
            call check_that(count(self%contact == contact_stick) == 0, 'slide: all slips')
            call check_close(sum(self%tx)/sum(self%p), mu, 1e-3_dp*mu, 'slide: mu')
         end if
      end do
      call check_that(any(self%contact == contact_stick), 'slide: sticks after the turn')
      call check_order(sum(self%tx), '<', mu*sum(self%p), 'slide: unloads after the turn')
      call check_order(iterations, '<', 60*40, 'slide: iterations')
      call end_case(self)
   end subroutine block_dragged_into_full_slip_and_back

   !> One and two threads give the same results up to round-off, because FFTW may choose other plans.
   subroutine two_threads_agree_to_round_off()
      type(case_type) :: self
      real(dp), allocatable :: tx(:, :)
      integer :: k, threads

      threads = thread_count()
      do k = 1, 2
         call set_threads(k)
         call new_case(self, 160, 120, 1.0_dp, 0.8_dp, boundary_periodic, 0.5_dp, 0.3_dp)
         call set_rough(self, 12, 0.1_dp, 0.4_dp)
         self%law = new_friction_law('coulomb', 0.3_dp, 0.0_dp, 0.0_dp, .true., .true.)
         self%drive_x = 0.03_dp
         self%solver%tolerance = 1e-6_dp
         call run_case(self, 'threads', 1e-5_dp)
         if (k == 1) then
            tx = self%tx
         else
            call check_order(maxval(abs(self%tx - tx)), '<=', 1e-9_dp*maxval(abs(tx)), &
               'the same for one thread and two')
         end if
         call end_case(self)
      end do
      call set_threads(threads)
   end subroutine two_threads_agree_to_round_off

   !> A solver that has solved larger and smaller contacts gives the same solution as a new one: its fields have another
   !> length for each of them, from no contact to full contact, with and without a traction of the past.
   subroutine solver_serves_contacts_of_any_size()
      real(dp), parameter :: thresholds(6) = [0.9_dp, -0.4_dp, -9.0_dp, 2.0_dp, 99.0_dp, 0.3_dp]
      type(case_type) :: kept, new
      real(dp), allocatable :: past(:, :, :)
      character(:), allocatable :: what
      integer :: k

      call new_case(kept, 60, 32, 1.0_dp, 0.8_dp, boundary_periodic, 0.4_dp, 0.5_dp)
      allocate (past(60, 2, 32))
      do k = 1, size(thresholds)
         what = 'contact '//achar(iachar('0') + k)
         call new_case(new, 60, 32, 1.0_dp, 0.8_dp, boundary_periodic, 0.4_dp, 0.5_dp)
         call set_rough(new, 10 + k, 0.1_dp, thresholds(k))
         new%drive_x = 0.03_dp
         new%drive_y = 0.01_dp
         new%law = new_friction_law('coulomb', 0.3_dp, 0.0_dp, 0.0_dp, .true., .true.)
         kept%p = new%p
         kept%hx = new%hx
         kept%hy = new%hy
         kept%drive_x = new%drive_x
         kept%drive_y = new%drive_y
         kept%law = new%law
         kept%tx = 0.0_dp
         kept%ty = 0.0_dp
         kept%contact = contact_stick
         past(:, 1, :) = 0.1_dp*k*new%p
         past(:, 2, :) = 0.0_dp
         if (mod(k, 2) == 0) then
            call solve_case(kept, past)
            call solve_case(new, past)
         else
            call solve_case(kept)
            call solve_case(new)
         end if
         call check_that(new%result%converged, what//': converged')
         call check_close(maxval(hypot(kept%tx - new%tx, kept%ty - new%ty)), 0.0_dp, &
            1e-12_dp*maxval(hypot(new%tx, new%ty)), what//': the same traction')
         call check_close(maxval(hypot(kept%rx - new%rx, kept%ry - new%ry)), 0.0_dp, &
            1e-12_dp*maxval(hypot(new%rx, new%ry)), what//': the same slip')
         call check_that(all(kept%contact == new%contact), what//': the same states')
         call end_case(new)
      end do
      call end_case(kept)
   end subroutine solver_serves_contacts_of_any_size

end module test_friction_cg
