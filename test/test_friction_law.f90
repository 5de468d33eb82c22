!> Tests of the friction laws.
module test_friction_law
   use check, only : begin_suite, check_close, check_order, check_that, selected
   use friction_law, only : contact_open, contact_slip, contact_stick, friction_law_type, &
      new_friction_law, unbounded
   use friction_bounds, only : largest_excess, return_to_bound, return_tractions
   use asperity_precision, only : dp, int8
   implicit none
   private

   public :: run_friction_law

   character(14), parameter :: names(3) = ['coulomb       ', 'constant_shear', 'coulomb_orowan']

contains

   subroutine run_friction_law()
      call begin_suite('friction_law')
      if (selected('bounds_without_slope')) call bounds_without_slope()
      if (selected('returned_traction_lies_on_the_cone')) call returned_traction_lies_on_the_cone()
      if (selected('table_of_bounds')) call table_of_bounds()
      if (selected('friction_uphill_and_downhill')) call friction_uphill_and_downhill()
      if (selected('slip_is_along_the_force_on_the_slope')) &
         call slip_is_along_the_force_on_the_slope()
      if (selected('no_friction_where_a_cell_opens')) call no_friction_where_a_cell_opens()
      if (selected('derivatives_of_the_bound')) call derivatives_of_the_bound()
      if (selected('zero_traction_and_zero_strength')) call zero_traction_and_zero_strength()
      if (selected('fields_return_to_a_new_pressure')) call fields_return_to_a_new_pressure()
   end subroutine run_friction_law

   !> Without slope the bound is mu P, sigma_max, or the smaller of both; adhesion adds p_a to P.
   subroutine bounds_without_slope()
      type(friction_law_type) :: law
      real(dp), parameter :: none(2) = [5.0_dp, -3.0_dp]     ! a slope that must have no effect
      real(dp) :: t(2)
      logical :: returned

      law = new_friction_law('coulomb', 0.5_dp, 1.0_dp, 0.0_dp, .false., .true.)
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, 2.0_dp, none, t, returned)
      call check_that(returned, 'a traction above mu P is returned')
      call check_close(t(1), 0.6_dp, 1e-15_dp, 'Coulomb, x')
      call check_close(t(2), 0.8_dp, 1e-15_dp, 'Coulomb, y')
      t = [0.3_dp, -0.4_dp]
      call return_to_bound(law, 2.0_dp, none, t, returned)
      call check_that(.not. returned, 'a traction below mu P is left')
      law = new_friction_law('constant_shear', 0.5_dp, 1.5_dp, 0.0_dp, .false., .true.)
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, 2.0_dp, none, t, returned)
      call check_close(hypot(t(1), t(2)), 1.5_dp, 1e-15_dp, 'constant shear')
      law = new_friction_law('coulomb_orowan', 0.5_dp, 1.5_dp, 0.0_dp, .false., .true.)
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, 2.0_dp, none, t, returned)
      call check_close(hypot(t(1), t(2)), 1.0_dp, 1e-15_dp, 'Coulomb-Orowan at low pressure')
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, 8.0_dp, none, t, returned)
      call check_close(hypot(t(1), t(2)), 1.5_dp, 1e-15_dp, 'Coulomb-Orowan at high pressure')
      law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 3.0_dp, .false., .true.)
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, -1.0_dp, none, t, returned)
      call check_close(hypot(t(1), t(2)), 1.0_dp, 1e-15_dp, 'adhesion adds gamma_0/z_0')
      t = [3.0_dp, 4.0_dp]
      call return_to_bound(law, -3.5_dp, none, t, returned)
      call check_close(hypot(t(1), t(2)), 0.0_dp, 0.0_dp, 'no traction below -gamma_0/z_0')
   end subroutine bounds_without_slope

   !> On a slope, too, the bound is 0 where the wall bears nothing (P = -p_a), and grows from there like without slope.
   subroutine no_friction_where_a_cell_opens()
      type(friction_law_type) :: law
      real(dp), parameter :: slope(2) = [0.4_dp, -0.3_dp]
      real(dp), parameter :: across(2) = [0.6_dp, 0.8_dp]   !! along a line of equal height
      real(dp) :: t(2), s

      law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 3.0_dp, .true., .true.)
      s = law%bound_ratio(-3.0_dp, slope, across)
      call check_close(s, 0.0_dp, 0.0_dp, 'no friction at P = -p_a')
      s = law%bound_ratio(-2.0_dp, slope, across)
      call check_close(s, 0.5_dp*sqrt(1.25_dp), 1e-15_dp, 'mu (P + p_a)/N_z')
      t = law%normal_traction(-2.0_dp, slope) + s*across
      call check_close(norm2(t - 2.0_dp*slope), s, 1e-15_dp, 'T* holds the attraction')
   end subroutine no_friction_where_a_cell_opens

   !> With slope, the returned traction fulfils the law for the force (T_x, T_y, P), resolved along the true
   !> normal. It is on the right nappe, and on the ray from T*.
   subroutine returned_traction_lies_on_the_cone()
      type(friction_law_type) :: law
      real(dp) :: u(8), slope(2), p, pa, mu, strength, star(2), d(2), t(2), s
      real(dp) :: normal(3), force(3), push, along
      integer :: k, l, m, hits

      hits = 0
      do l = 1, 3
         do m = 0, 1
            do k = 1, 200
               call sequence(k + 1000*l, u)
               slope = 1.2_dp*u(1:2) - 0.6_dp
               p = 0.1_dp + u(3)
               pa = m*u(4)
               mu = 0.05_dp + 1.4_dp*u(5)
               strength = 0.2_dp + u(6)
               law = new_friction_law(trim(names(l)), mu, strength, pa, .true., .true.)
               star = law%normal_traction(p, slope)
               d = 4.0_dp*u(7:8) - 2.0_dp
               s = law%bound_ratio(p, slope, d)
               call check_close(row_ratio(law, p, slope, d)/s, 1.0_dp, 1e-12_dp, 'the bound of a row')
               if (s >= unbounded) cycle
               hits = hits + 1
               t = star + s*d
               normal = [-slope(1), -slope(2), 1.0_dp]/sqrt(1.0_dp + sum(slope**2))
               force = [t(1), t(2), p]
               push = dot_product(force, normal)
               along = norm2(force - push*normal)
               push = push + pa/normal(3)
               select case (l)
               case (1)
                  call check_close(along/(mu*push), 1.0_dp, 1e-11_dp, 'Coulomb on the slope')
               case (2)
                  call check_close(along/strength, 1.0_dp, 1e-11_dp, 'constant shear on the slope')
               case default
                  call check_close(along/min(mu*push, strength), 1.0_dp, 1e-11_dp, &
                     'Coulomb-Orowan on the slope')
               end select
            end do
         end do
      end do
      call check_order(hits, '>', 1000, 'most rays meet the bound')
   end subroutine returned_traction_lies_on_the_cone

   !> A table is exact on its lines and beyond both kinds of ends, the same for a cell and a row.
   subroutine table_of_bounds()
      type(friction_law_type) :: law
      real(dp), parameter :: pressures(5) = [0.0_dp, 0.5_dp, 1.0_dp, 2.5_dp, 9.0_dp]
      real(dp), parameter :: rising(5) = [0.2_dp, 1.1_dp, 2.0_dp, 2.75_dp, 6.0_dp]
      real(dp), parameter :: falling(5) = [0.0_dp, 1.0_dp, 2.0_dp, 1.25_dp, 1.0_dp]
      real(dp), parameter :: none(2) = 0.0_dp
      real(dp) :: up(3, 2), down(3, 2)
      integer :: k

      up = reshape([0.0_dp, 1.0_dp, 4.0_dp, 0.2_dp, 2.0_dp, 3.5_dp], [3, 2])
      down = reshape([0.0_dp, 1.0_dp, 3.0_dp, 0.0_dp, 2.0_dp, 1.0_dp], [3, 2])
      do k = 1, 5
         law = new_friction_law('table', 0.0_dp, 0.0_dp, 0.0_dp, .false., .true., up)
         call check_close(law%bound_ratio(pressures(k), none, [0.6_dp, 0.8_dp]), rising(k), 1e-14_dp, 'rising table')
         call check_close(row_ratio(law, pressures(k), none, [0.6_dp, 0.8_dp]), rising(k), 1e-14_dp, 'row')
         call check_close(law%bound_ratio(pressures(k), none, [0.0_dp, 1.0_dp], [0.5_dp, 0.5_dp]), &
            0.5_dp*rising(k), 1e-14_dp, 'half a cell')
         call check_close(law%bound_ratio(pressures(k), none, [0.0_dp, 1.0_dp], [1.0_dp, 0.5_dp]), &
            rising(k) - 0.5_dp*up(1, 2), 1e-14_dp, 'half of the bound without pressure')
         law = new_friction_law('table', 0.0_dp, 0.0_dp, 0.0_dp, .false., .true., down)
         call check_close(law%bound_ratio(pressures(k), none, [1.0_dp, 0.0_dp]), falling(k), 1e-14_dp, 'falling table')
      end do
      call check_order(merge(1, 0, law%jumps_at_edge()), '<', 1, 'no jump without a bare strength')
   end subroutine table_of_bounds

   !> `bound_ratio` from the values that loops over rows have: F and N_z of a cell, mu, and a strength.
   function row_ratio(law, p, slope, d) result(s)
      type(friction_law_type), intent(in) :: law
      real(dp), intent(in) :: p, slope(2), d(2)
      real(dp) :: s
      real(dp) :: bound(1, 2), nd, m, reach

      call law%bound_row(1, [p], [slope(1)], [slope(2)], bound)
      nd = -bound(1, 2)*dot_product(slope, d)
      m = sqrt(dot_product(d, d) - nd**2)
      reach = m - law%reach_coefficient()*nd
      s = unbounded
      if (reach > 0.0_dp) s = bound(1, 1)/reach
      if (law%strength_beside() >= 0.0_dp) s = min(s, law%strength_beside()/m)
   end function row_ratio

   !> A slope in the direction of the traction: P (mu + tan)/(1 - mu tan) (thesis, eq. 3.2), uphill and
   !> downhill. There is no bound if mu tan > 1.
   subroutine friction_uphill_and_downhill()
      type(friction_law_type) :: law
      real(dp), parameter :: mu = 0.7_dp, h = 0.3_dp, p = 2.0_dp
      real(dp) :: t(2)
      logical :: returned

      law = new_friction_law('coulomb', mu, 0.0_dp, 0.0_dp, .true., .true.)
      t = [100.0_dp, 0.0_dp]
      call return_to_bound(law, p, [-h, 0.0_dp], t, returned)
      call check_close(t(1), p*(mu + h)/(1.0_dp - mu*h), 1e-13_dp, 'leading flank')
      t = [0.0_dp, 100.0_dp]
      call return_to_bound(law, p, [0.0_dp, h], t, returned)
      call check_close(t(1), 0.0_dp, 1e-13_dp, 'trailing flank, across')
      call check_close(t(2), p*(mu - h)/(1.0_dp + mu*h), 1e-13_dp, 'trailing flank')
      t = [100.0_dp, 0.0_dp]
      call return_to_bound(law, p, [-1.5_dp, 0.0_dp], t, returned)
      call check_that(.not. returned, 'a cone steeper than 1/mu has no bound uphill')
      law = new_friction_law('coulomb', 0.0_dp, 0.0_dp, 0.0_dp, .true., .true.)
      t = [100.0_dp, -30.0_dp]
      call return_to_bound(law, p, [-0.3_dp, 0.2_dp], t, returned)
      call check_close(t(1), 0.6_dp, 1e-15_dp, 'no friction: T* = -P H_x')
      call check_close(t(2), -0.4_dp, 1e-15_dp, 'no friction: T* = -P H_y')
   end subroutine friction_uphill_and_downhill

   !> The slip of the physical law, along the slope, is parallel to the force along the slope.
   subroutine slip_is_along_the_force_on_the_slope()
      type(friction_law_type) :: law
      real(dp), parameter :: slope(2) = [0.4_dp, -0.25_dp], d(2) = [0.3_dp, 0.9_dp]
      real(dp) :: r(2), normal(3), force(3), slip(3), s(2)

      law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .true., .true.)
      normal = [-slope(1), -slope(2), 1.0_dp]/sqrt(1.0_dp + sum(slope**2))
      force = [d(1), d(2), 0.0_dp]           ! T - T*; the rest is along the normal
      force = force - dot_product(force, normal)*normal
      r = 2.5_dp*force(:2)
      slip = [r(1), r(2), dot_product(slope, r)]
      call check_close(norm2(slip - 2.5_dp*force), 0.0_dp, 1e-15_dp, 'slip on the slope along the force')
      s = law%slip_along_slope(slope, r)
      call check_close(norm2(s - 2.5_dp*d), 0.0_dp, 1e-15_dp, 'the two forms of the law agree')
      law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .true., .false.)
      call check_close(norm2(law%slip_along_slope(slope, d) - d), 0.0_dp, 0.0_dp, 'thesis: r itself')
   end subroutine slip_is_along_the_force_on_the_slope

   !> First and second derivative of s against finite differences.
   subroutine derivatives_of_the_bound()
      type(friction_law_type) :: law
      real(dp), parameter :: a = 1e-4_dp
      real(dp) :: u(8), slope(2), d(2), v(2), p, s, up, down, first, second
      integer :: k, l

      do l = 1, 3
         do k = 1, 20
            call sequence(k + 77*l, u)
            law = new_friction_law(trim(names(l)), 0.1_dp + 0.5_dp*u(1), 0.3_dp, 0.2_dp*u(2), .true., &
               .true.)
            slope = 0.8_dp*u(3:4) - 0.4_dp
            p = 0.3_dp + u(5)
            d = u(6:7) - 0.45_dp
            v = [u(8), u(1) - 0.5_dp]
            s = law%bound_ratio(p, slope, d)
            d = s*d
            v = v*norm2(d)
            call law%bound_variation(p, slope, d, v, first, second)
            up = law%bound_ratio(p, slope, d + a*v)
            down = law%bound_ratio(p, slope, d - a*v)
            call check_close(first, 0.5_dp*(up - down)/a, 1e-6_dp, 'first derivative of s')
            call check_close(second, (up - 2.0_dp + down)/a**2, 1e-5_dp, 'second derivative of s')
         end do
      end do
   end subroutine derivatives_of_the_bound

   !> Zero traction and zero strength.
   subroutine zero_traction_and_zero_strength()
      type(friction_law_type) :: law
      real(dp), parameter :: none(2) = 0.0_dp

      law = new_friction_law('coulomb', 0.5_dp, 0.0_dp, 0.0_dp, .false., .true.)
      call check_order(law%bound_ratio(1.0_dp, none, none), '>=', unbounded, 'T* is inside')
      call check_close(law%bound_ratio(0.0_dp, none, [1.0_dp, 0.0_dp]), 0.0_dp, 0.0_dp, 'P = 0')
      call check_close(law%bound_ratio(0.0_dp, none, none), 1.0_dp, 0.0_dp, 'T* alone is on the bound')
      call check_order(law%bound_ratio(1.0_dp, none, [1e-320_dp, 0.0_dp]), '>', 1.0_dp, &
         'a denormal')
   end subroutine zero_traction_and_zero_strength

   !> Reduction of fields to the bound of a new pressure.
   subroutine fields_return_to_a_new_pressure()
      type(friction_law_type) :: law
      real(dp) :: p(3, 2), tx(3, 2), ty(3, 2), none(0, 0)
      integer(int8) :: contact(3, 2)

      p = reshape([1.0_dp, 0.0_dp, 2.0_dp, 1e-3_dp, -1.0_dp, 1.0_dp], [3, 2])
      tx = 0.5_dp
      ty = 0.0_dp
      contact = contact_stick
      contact(3, 2) = contact_open
      law = new_friction_law('constant_shear', 0.0_dp, 0.2_dp, 0.0_dp, .false., .true.)
      call check_close(largest_excess(law, p, none, none, contact, tx, ty), 0.5_dp, 1e-15_dp, &
         'excess before')
      call return_tractions(law, p, none, none, contact, tx, ty)
      call check_close(tx(1, 1), 0.2_dp, 1e-15_dp, 'constant shear in contact')
      call check_close(tx(1, 2), 0.2_dp, 1e-15_dp, 'constant shear at nearly zero pressure')
      call check_close(tx(2, 1), 0.0_dp, 0.0_dp, 'constant shear acts only in contact')
      call check_close(tx(2, 2), 0.0_dp, 0.0_dp, 'nor at a negative pressure')
      call check_close(tx(3, 2), 0.0_dp, 0.0_dp, 'nor at an open point')
      call check_that(contact(1, 1) == contact_slip .and. contact(2, 1) == contact_open, 'contact map')
      call check_close(largest_excess(law, p, none, none, contact, tx, ty), 0.0_dp, 1e-15_dp, &
         'excess after')
   end subroutine fields_return_to_a_new_pressure

   !> Numbers in [0, 1) that are the same on every machine.
   subroutine sequence(k, u)
      integer, intent(in) :: k
      real(dp), intent(out) :: u(:)
      integer :: i

      do i = 1, size(u)
         u(i) = modulo(1e4_dp*sin(12.9898_dp*k + 78.233_dp*i), 1.0_dp)
      end do
   end subroutine sequence

end module test_friction_law
