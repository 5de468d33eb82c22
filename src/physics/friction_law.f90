!> The bound of the tangential traction at one point: a law of friction on the slope of the road.
!>
!> A law (module `shear_law`: Coulomb, constant shear stress, Coulomb-Orowan and others) acts on the true
!> local slope of the road (thesis, section 3.1.3) and with the pressure that adhesion adds (thesis,
!> appendix B).
!>
!> The rubber lies above, and the road H pushes up into it. With the unit normal N = (-H_x, -H_y, 1) N_z and
!> n = (N_x, N_y) a purely normal reaction has the tangential traction T* = P n/N_z = -P grad H.
!> For D = T - T* the force normal to the slope is P/N_z + n.D, the force along it
!> m = sqrt(|D|^2 - (n.D)^2). From T* along D the bound is met at T* + s D:
!>
!>     Coulomb          s = F/(m - mu n.D),  F = mu (P + p_a)/N_z; no bound if m <= mu n.D
!>     constant shear   s = sigma_max/m
!>     Coulomb-Orowan   the smaller of the two
!>
!> p_a is the attraction at touch, e'(0) of the potential (module `adhesion_potential`): P + p_a is the
!> pressure of the wall alone in a closed cell, which is not negative and is zero where the cell opens.
!> The thesis has p_a = gamma_0/z_0, which is e'(0) of its exponential potential.
!>
!> The thesis (appendix B) adds p_a N_z to the force normal to the slope instead of p_a/N_z, as for a vertical attraction.
!> But T* = -P grad H contains the attraction as a force normal to the slope. In a cell that opens, where the wall bears
!> nothing (P = -p_a), the force F of the thesis would be -mu p_a |grad H|^2 N_z, below zero.
!>
!> T is out of bounds where s < 1, and T* + s D is then the traction that is returned to the bound. This is the
!> admissible root of the quadratic equation of the thesis (eq. 3.10 and B.5), whose other root lies on the second
!> nappe of the friction cone.
!> Without slope n = 0 and T* = 0.
!>
!> Direction of slip. `r` is the slip of the road over the rubber. The slip along the slope is
!> parallel to the force along it if r + n (n.r)/N_z^2 = r + grad H (grad H . r) is parallel to D,
!> which is the same as r parallel to D - n (n.D): the physical law. The thesis (eq. 3.16) asks for
!> r parallel to D.
module friction_law
   use asperity_precision, only : dp, int8
   use shear_law, only : shear_law_type
   use shear_laws, only : choose_shear_law
   implicit none
   private

   public :: friction_law_type, new_friction_law

   integer(int8), parameter, public :: contact_open = 0_int8     !! no contact
   integer(int8), parameter, public :: contact_stick = 1_int8
   integer(int8), parameter, public :: contact_slip = 2_int8

   real(dp), parameter, public :: unbounded = huge(1.0_dp)       !! s of a ray that meets no bound

   !> A friction law on a slope.
   type :: friction_law_type
      class(shear_law_type), allocatable :: shear     !! the bound under a pressure
      real(dp) :: adhesive_pressure = 0.0_dp     !! p_a = e'(0), Pa; 0 without adhesion
      logical :: slope_effect = .false.          !! the slope of the road counts
      logical :: physical_slip = .true.          !! direction of slip: physical, or that of the thesis
      logical :: legal = .false.                 !! the law of the name is legal here, and p_a is not negative
   contains
      procedure :: normal_traction
      procedure :: bound_ratio
      procedure :: friction_force
      procedure :: ratio_under
      procedure :: bound_variation
      procedure :: bound_row
      procedure :: reach_coefficient
      procedure :: strength_beside
      procedure :: bare_strength
      procedure :: jumps_at_edge
      procedure :: place_on_bound
      procedure :: slip_along_slope
   end type friction_law_type

contains

   !> Make a law from its name and constants. Solvers refuse a law that is not `legal`.
   function new_friction_law(name, coefficient, shear_strength, adhesive_pressure, slope, &
      physical_slip, table) result(self)
      character(*), intent(in) :: name             !! see module `shear_laws`
      real(dp), intent(in) :: coefficient          !! mu >= 0
      real(dp), intent(in) :: shear_strength       !! sigma_max >= 0, Pa
      real(dp), intent(in) :: adhesive_pressure    !! p_a >= 0, Pa; 0 without adhesion
      logical, intent(in) :: slope                 !! count the slope of the road
      logical, intent(in) :: physical_slip         !! .false.: the direction of slip of the thesis
      real(dp), intent(in), optional :: table(:, :)     !! [n, 2] pressures and bounds, Pa, of 'table'
      type(friction_law_type) :: self

      call choose_shear_law(name, coefficient, shear_strength, self%shear, table)
      self%adhesive_pressure = adhesive_pressure
      self%slope_effect = slope
      self%physical_slip = physical_slip
      self%legal = self%shear%legal .and. adhesive_pressure >= 0.0_dp .and. (self%shear%on_slopes .or. .not. slope)
   end function new_friction_law

   !> T*, the tangential traction of a purely normal reaction.
   pure function normal_traction(self, p, slope) result(t)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: p             !! pressure, Pa
      real(dp), intent(in) :: slope(2)      !! H_x, H_y; not used by a law without slope
      real(dp) :: t(2)                      !! Pa

      if (self%slope_effect) then
         t = -p*slope
      else
         t = 0.0_dp
      end if
   end function normal_traction

   !> The s for which T* + s D lies on the bound. If only T* is allowed and D = 0, s is 1.
   pure function bound_ratio(self, p, slope, d, share) result(s)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: p             !! pressure, Pa
      real(dp), intent(in) :: slope(2)      !! H_x, H_y; not used by a law without slope
      real(dp), intent(in) :: d(2)          !! D = T - T*, Pa
      real(dp), intent(in), optional :: share(2)     !! of the bound, see module `shear_law`; 1 if absent
      real(dp) :: s                         !! >= 0; `unbounded` where the ray meets no bound
      real(dp) :: part(2)

      part = 1.0_dp
      if (present(share)) part = share
      s = self%ratio_under(self%friction_force(p, slope, part), slope, d, part)
   end function bound_ratio

   !> F, the force of the law under a pressure.
   pure function friction_force(self, p, slope, share) result(force)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: p             !! pressure, Pa
      real(dp), intent(in) :: slope(2)      !! H_x, H_y; not used by a law without slope
      real(dp), intent(in) :: share(2)      !! of the bound, see module `shear_law`
      real(dp) :: force                     !! Pa
      real(dp) :: root

      root = 1.0_dp
      if (self%slope_effect) root = sqrt(1.0_dp + slope(1)**2 + slope(2)**2)       ! 1/N_z
      force = self%shear%force(max((p + self%adhesive_pressure)*root, 0.0_dp), share)
   end function friction_force

   !> The s for which T* + s D lies on the bound under a given force F.
   pure function ratio_under(self, force, slope, d, share) result(s)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: force         !! F, Pa
      real(dp), intent(in) :: slope(2)      !! H_x, H_y; not used by a law without slope
      real(dp), intent(in) :: d(2)          !! D = T - T*, Pa
      real(dp), intent(in) :: share(2)      !! of the bound, see module `shear_law`
      real(dp) :: s                         !! >= 0; `unbounded` where the ray meets no bound
      real(dp) :: nd, m

      nd = 0.0_dp
      if (self%slope_effect) nd = -(slope(1)*d(1) + slope(2)*d(2))/sqrt(1.0_dp + slope(1)**2 + slope(2)**2)
      m = sqrt(max(d(1)**2 + d(2)**2 - nd**2, 0.0_dp))
      s = ratio(force, m - self%shear%coefficient*share(1)*nd)
      if (self%shear%strength_beside >= 0.0_dp) s = min(s, ratio(self%shear%strength_beside*share(2), m))
   end function ratio_under

   !> The bound of a row of cells for loops that must not branch: s = F/(m - mu n.D), or the smaller of
   !> that and strength/m, with F of each cell, mu from `reach_coefficient` and the strength from
   !> `strength_beside`.
   pure subroutine bound_row(self, n, p, hx, hy, bound)
      class(friction_law_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(in) :: p(n)             !! pressure, Pa
      real(dp), intent(in) :: hx(n), hy(n)     !! H_x, H_y; 0 without slope
      real(dp), intent(out) :: bound(n, 2)     !! F, Pa, and N_z
      real(dp) :: root
      integer :: i

      do i = 1, n
         root = sqrt(1.0_dp + hx(i)**2 + hy(i)**2)
         bound(i, 2) = 1.0_dp/root
         bound(i, 1) = max((p(i) + self%adhesive_pressure)*root, 0.0_dp)
      end do
      call self%shear%forces(n, bound(:, 1))
   end subroutine bound_row

   !> mu in the reach m - mu n.D of the force F of `bound_row`.
   pure function reach_coefficient(self) result(mu)
      class(friction_law_type), intent(in) :: self
      real(dp) :: mu

      mu = self%shear%coefficient
   end function reach_coefficient

   !> The strength that limits the traction in addition to the force F of `bound_row`, Pa; negative if none does.
   pure function strength_beside(self) result(strength)
      class(friction_law_type), intent(in) :: self
      real(dp) :: strength

      strength = self%shear%strength_beside
   end function strength_beside

   !> The bound without pressure, Pa.
   pure function bare_strength(self) result(strength)
      class(friction_law_type), intent(in) :: self
      real(dp) :: strength

      strength = self%shear%bare_strength
   end function bare_strength

   !> Does the traction jump where the contact ends, because it needs contact but no pressure?
   pure function jumps_at_edge(self) result(yes)
      class(friction_law_type), intent(in) :: self
      logical :: yes

      yes = self%shear%bare_strength > 0.0_dp
   end function jumps_at_edge

   !> force/reach: 1 if both are zero, and `unbounded` if the reach is negative or only the reach is zero.
   pure function ratio(force, reach) result(s)
      real(dp), intent(in) :: force     !! >= 0, Pa
      real(dp), intent(in) :: reach     !! Pa
      real(dp) :: s

      if (reach > 0.0_dp) then
         if (force < reach*unbounded) then
            s = force/reach
         else
            s = unbounded
         end if
      else if (reach < 0.0_dp .or. force > 0.0_dp) then
         s = unbounded
      else
         s = 1.0_dp
      end if
   end function ratio

   !> First and second derivative of s(D + a v) for a at a = 0, for a D on the bound (s = 1).
   !> In addition to a v, the traction on the bound then moves by a K_1 + a^2/2 K_2, with K_1 = s' D and
   !> K_2 = s'' D + 2 s' v. These are the terms of eq. 3.12 of the thesis, in closed form for every law.
   pure subroutine bound_variation(self, p, slope, d, v, first, second)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: p
      real(dp), intent(in) :: slope(2)
      real(dp), intent(in) :: d(2)          !! D, Pa
      real(dp), intent(in) :: v(2)          !! direction in which T moves, Pa
      real(dp), intent(out) :: first        !! ds/da
      real(dp), intent(out) :: second       !! d2s/da2
      real(dp) :: n(2), nz, m, dm, ddm, mu, force, reach, change

      n = 0.0_dp
      nz = 1.0_dp
      if (self%slope_effect) then
         nz = 1.0_dp/sqrt(1.0_dp + slope(1)**2 + slope(2)**2)
         n = -nz*slope
      end if
      first = 0.0_dp
      second = 0.0_dp
      m = sqrt(max(dot_product(d, d) - dot_product(n, d)**2, 0.0_dp))
      if (m <= 0.0_dp) return
      dm = (dot_product(d, v) - dot_product(n, d)*dot_product(n, v))/m
      ddm = (dot_product(v, v) - dot_product(n, v)**2 - dm**2)/m
      mu = self%shear%coefficient
      if (self%shear%strength_beside >= 0.0_dp) then
         force = self%shear%force(max((p + self%adhesive_pressure)/nz, 0.0_dp), [1.0_dp, 1.0_dp])
         if (ratio(self%shear%strength_beside, m) < ratio(force, m - mu*dot_product(n, d))) mu = 0.0_dp
      end if
      reach = m - mu*dot_product(n, d)
      change = dm - mu*dot_product(n, v)
      if (reach <= 0.0_dp) return
      first = -change/reach
      second = 2.0_dp*(change/reach)**2 - ddm/reach
   end subroutine bound_variation

   !> Scale D so that the traction lies on the bound, if its ratio s is below a limit. With the limit 1 only a
   !> traction outside the bound is moved.
   pure subroutine place_on_bound(self, p, slope, limit, t, s, share)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: p
      real(dp), intent(in) :: slope(2)
      real(dp), intent(in) :: limit
      real(dp), intent(inout) :: t(2)       !! Pa
      real(dp), intent(out) :: s            !! the ratio before the traction is moved
      real(dp), intent(in), optional :: share(2)     !! of the bound, see module `shear_law`; 1 if absent
      real(dp) :: d(2)

      if (self%slope_effect) then
         d(1) = t(1) + p*slope(1)
         d(2) = t(2) + p*slope(2)
         s = bound_ratio(self, p, slope, d, share)
         if (s < limit) then
            t(1) = s*d(1) - p*slope(1)
            t(2) = s*d(2) - p*slope(2)
         end if
      else
         s = bound_ratio(self, p, slope, t, share)
         if (s < limit) then
            t(1) = s*t(1)
            t(2) = s*t(2)
         end if
      end if
   end subroutine place_on_bound

   !> The slip that must be parallel to D: r + grad H (grad H . r), or r itself in the thesis.
   pure function slip_along_slope(self, slope, r) result(slip)
      class(friction_law_type), intent(in) :: self
      real(dp), intent(in) :: slope(2)
      real(dp), intent(in) :: r(2)          !! slip in the plane, m
      real(dp) :: slip(2)

      slip = r
      if (self%slope_effect .and. self%physical_slip) then
         slip = r + slope*(slope(1)*r(1) + slope(2)*r(2))
      end if
   end function slip_along_slope

end module friction_law
