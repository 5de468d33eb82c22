!> A viscoelastic half-space or layer in time: the material and its schemes.
!>
!> U = A S, with A the elastic operator for a unit shear modulus and S the traction that would hold
!> the displacement U elastically. Each arm k carries the traction p_k; the whole is
!>
!>    P = G_e S + sum p_k                                            (thesis, section 2.1.3)
!>    p_k' = alpha p_k + b1 (S' - S) + b2 (S - S_old)                one step; a prime marks its end
!>    P'   = Q S' - P_h,   Q = G_e + sum b1,   P_h = sum(b1 S - alpha p_k - b2 (S - S_old))
!>
!> P_h is the traction of the past. Thus S' = (P' + P_h)/Q holds at each point, and for a contact solver the
!> body is elastic, with the displacement U' = A (P' + P_h)/Q. The fields S and p_k are in module `arm_state`.
!> These are eq. 2.13 and 2.14 of the thesis with all displacement-like terms written as tractions. With
!> x = dt/tau, the schemes are
!>
!>    backward_euler   alpha = 1/(1+x)   b1 = g/(1+x)           b2 = 0
!>    exponential      alpha = exp(-x)   b1 = g phi             b2 = 0, exact for a linear U(t)
!>    exponential2     alpha = exp(-x)   b1 = g (phi + w chi)   b2 = -g w chi dt/dt_old, a parabola
!>
!> with phi and chi of module `relaxation_functions`, and w = 2 dt/(dt + dt_old). If a step is more than twice
!> as long as the one before, w is damped by (2 dt_old/dt)^2, because plain extrapolation would overshoot. In
!> the first step, and after a jump of the load or of a rate, w is 0; module `starting_steps` then divides the
!> step into three parts. A jump is a step without duration: alpha = 1, b1 = g.
module zener
   use asperity_errors, only : add_fault, error_input, error_type, fail
   use asperity_precision, only : dp
   use relaxation_functions, only : mean_decay, slope_response
   implicit none
   private

   public :: zener_type
   public :: new_zener, start_step, start_jump, start_relaxed, finish_step, restart_order
   public :: extrapolates, is_elastic, needs_start

   integer, parameter, public :: scheme_backward_euler = 1
   integer, parameter, public :: scheme_exponential = 2
   integer, parameter, public :: scheme_exponential2 = 3

   integer, parameter, public :: step_regular = 1   !! a step of some duration
   integer, parameter, public :: step_jump = 2      !! instantaneous
   integer, parameter, public :: step_relaxed = 3   !! after an infinite time under the load

   !> The material, its time scheme and the coefficients of the present step, without fields.
   type :: zener_type
      real(dp) :: g_e = 0.0_dp               !! long-term modulus, Pa
      real(dp), allocatable :: g(:)          !! moduli of the arms, Pa
      real(dp), allocatable :: tau(:)        !! relaxation times, s
      integer :: scheme = scheme_exponential2
      integer :: kind = step_jump            !! of the present step
      real(dp) :: dt = 0.0_dp                !! its duration, s
      real(dp) :: dt_old = 0.0_dp            !! duration of the step before, s; 0 if there is none: then b2 = 0
      real(dp) :: q = 0.0_dp                 !! modulus of the step, Pa
      real(dp) :: weight = 0.0_dp            !! w
      real(dp) :: ratio = 0.0_dp             !! dt/dt_old; 0 without a step before
      real(dp), allocatable :: x(:)          !! dt/tau
      real(dp), allocatable :: alpha(:)      !! part of an arm's traction that remains
      real(dp), allocatable :: b1(:)         !! Pa
      real(dp), allocatable :: b2(:)         !! Pa
   end type zener_type

contains

   !> Check and set a material and its scheme.
   subroutine new_zener(self, g_e, g, tau, scheme, error)
      type(zener_type), intent(out) :: self
      real(dp), intent(in) :: g_e            !! long-term modulus, Pa, >= 0; > 0 without arms
      real(dp), intent(in) :: g(:)           !! moduli of the arms, Pa, > 0; size 0: elastic
      real(dp), intent(in) :: tau(:)         !! relaxation times, s, > 0
      character(*), intent(in) :: scheme     !! 'backward_euler' | 'exponential' | 'exponential2'
      type(error_type), allocatable, intent(out) :: error

      select case (scheme)
      case ('backward_euler')
         self%scheme = scheme_backward_euler
      case ('exponential')
         self%scheme = scheme_exponential
      case ('exponential2')
         self%scheme = scheme_exponential2
      case default
         call add_fault(error, error_input, 'time_scheme = '''//trim(scheme)// &
            ''': must be ''backward_euler'', ''exponential'' or ''exponential2''')
      end select

      if (size(g) /= size(tau)) then
         call add_fault(error, error_input, 'as many moduli as relaxation times are needed')
      else if (.not. all(g > 0.0_dp .and. g <= huge(g)) .or. &
         .not. all(tau > 0.0_dp .and. tau <= huge(tau))) then
         call add_fault(error, error_input, 'moduli and relaxation times must be positive')
      end if
      if (.not. (g_e >= 0.0_dp .and. g_e <= huge(g_e))) then
         call add_fault(error, error_input, 'the long-term modulus must not be negative')
      else if (size(g) == 0 .and. g_e <= 0.0_dp) then
         call add_fault(error, error_input, &
            'the shear modulus of an elastic material must be positive')
      end if

      if (allocated(error)) return
      self%g_e = g_e
      allocate (self%g, source=g)
      allocate (self%tau, source=tau)
      allocate (self%x(size(g)), self%alpha(size(g)), self%b1(size(g)), self%b2(size(g)))
      call start_jump(self)
   end subroutine new_zener

   !> Is the material elastic, that is, without arms?
   pure function is_elastic(self) result(elastic)
      type(zener_type), intent(in) :: self
      logical :: elastic

      elastic = size(self%g) == 0
   end function is_elastic

   !> Does the scheme use the displacement of the step before?
   pure function extrapolates(self) result(yes)
      type(zener_type), intent(in) :: self
      logical :: yes

      yes = self%scheme == scheme_exponential2 .and. .not. is_elastic(self)
   end function extrapolates

   !> Is there no earlier step from which to extrapolate?
   pure function needs_start(self) result(yes)
      type(zener_type), intent(in) :: self
      logical :: yes

      yes = .not. self%dt_old > 0.0_dp
   end function needs_start

   !> Set the coefficients of a step of duration dt. This may be called again before `finish_step`.
   pure subroutine start_step(self, dt)
      type(zener_type), intent(inout) :: self
      real(dp), intent(in) :: dt             !! s, > 0
      real(dp) :: chi
      integer :: k

      self%kind = step_regular
      self%dt = dt
      self%weight = 0.0_dp
      self%ratio = 0.0_dp
      if (self%scheme == scheme_exponential2 .and. self%dt_old > 0.0_dp) then
         self%ratio = dt/self%dt_old
         self%weight = 2.0_dp*self%ratio/(1.0_dp + self%ratio)*min(1.0_dp, (2.0_dp/self%ratio)**2)
      end if
      do k = 1, size(self%g)
         self%x(k) = dt/self%tau(k)
         if (self%scheme == scheme_backward_euler) then
            self%alpha(k) = 1.0_dp/(1.0_dp + self%x(k))
            self%b1(k) = self%g(k)*self%alpha(k)
            self%b2(k) = 0.0_dp
         else
            chi = slope_response(self%x(k))*self%weight
            self%alpha(k) = exp(-self%x(k))
            self%b1(k) = self%g(k)*(mean_decay(self%x(k)) + chi)
            self%b2(k) = -self%g(k)*chi*self%ratio
         end if
      end do
      self%q = self%g_e + sum(self%b1)
   end subroutine start_step

   !> Set the coefficients of a jump, to which the material responds with G(0).
   pure subroutine start_jump(self)
      type(zener_type), intent(inout) :: self

      self%kind = step_jump
      self%dt = 0.0_dp
      self%weight = 0.0_dp
      self%ratio = 0.0_dp
      self%x = 0.0_dp
      self%alpha = 1.0_dp
      self%b1 = self%g
      self%b2 = 0.0_dp
      self%q = self%g_e + sum(self%b1)
   end subroutine start_jump

   !> Set the coefficients of the state after an infinite time, when the material responds with G_e.
   subroutine start_relaxed(self, error)
      type(zener_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (self%g_e <= 0.0_dp) then
         call fail(error, error_input, 'relaxed = .true.: a material without long-term modulus '// &
            'flows without limit under load: shear_modulus (or a Zener branch''s g1) must be positive')
         return
      end if
      call start_jump(self)
      self%kind = step_relaxed
      self%alpha = 0.0_dp
      self%b1 = 0.0_dp
      self%q = self%g_e
   end subroutine start_relaxed

   !> Finish the present step, after the arms have been committed and the energies booked.
   pure subroutine finish_step(self)
      type(zener_type), intent(inout) :: self

      self%dt_old = 0.0_dp
      if (self%kind == step_regular) self%dt_old = self%dt
   end subroutine finish_step

   !> Let the next step not extrapolate from the step before, because the load or the speed changes abruptly.
   pure subroutine restart_order(self)
      type(zener_type), intent(inout) :: self

      self%dt_old = 0.0_dp
   end subroutine restart_order

end module zener
