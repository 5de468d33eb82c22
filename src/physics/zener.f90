!> A viscoelastic half-space or layer in time: schemes and history fields.
!>
!> U = A S, with A the elastic operator for a unit shear modulus and S the traction that would hold
!> the displacement U elastically. Each Maxwell arm k carries the traction p_k; the whole is
!>
!>    P = G_e S + sum p_k                                            (thesis, section 2.1.3)
!>    p_k' = alpha p_k + b1 (S' - S) + b2 (S - S_old)                one step; a prime: its end
!>    P'   = Q S' - hist,   Q = G_e + sum b1,   hist = sum(b1 S - alpha p_k - b2 (S - S_old))
!>
!> so S' = (P' + hist)/Q point by point, and a contact solver meets an elastic body with the
!> displacement U' = A (P' + hist)/Q.
!> This is thesis eq. 2.13/2.14 with all displacement-like terms written as tractions. x = dt/tau:
!>
!>    backward_euler   alpha = 1/(1+x)   b1 = g/(1+x)           b2 = 0
!>    exponential      alpha = exp(-x)   b1 = g phi             b2 = 0, exact for a linear U(t)
!>    exponential2     alpha = exp(-x)   b1 = g (phi + w chi)   b2 = -g w chi dt/dt_old, a parabola
!>
!> with phi, chi from `relaxation_functions` and w = 2 dt/(dt + dt_old), damped by (2 dt_old/dt)^2
!> where a step is more than twice the last: plain extrapolation would overshoot there. w = 0 in the
!> first step and after a jump of the load or of a rate: module starting_steps then takes the step in three
!> parts. A jump is a step of no duration: alpha = 1, b1 = g.
!>
!> Memory: S and one field an arm; one more (S - S_old) for exponential2; none for an elastic body.
!> Results do not depend on the number of threads or processes: sums are formed row by row.
module zener
   use asperity_errors, only : add_fault, error_input, error_type, fail
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   use relaxation_functions, only : mean_decay, slope_response
   implicit none
   private

   public :: history_type, products_type, zener_type
   public :: new_zener, start_step, start_jump, start_relaxed, finish_step, restart_order
   public :: extrapolates, is_elastic, needs_start
   public :: new_history, history_field, commit_history, commit_row, destroy_history
   public :: add_rows, new_products, new_row_sums

   integer, parameter, public :: scheme_backward_euler = 1
   integer, parameter, public :: scheme_exponential = 2
   integer, parameter, public :: scheme_exponential2 = 3

   integer, parameter, public :: step_regular = 1   !! a step of some duration
   integer, parameter, public :: step_jump = 2      !! instantaneous
   integer, parameter, public :: step_relaxed = 3   !! the load has rested for ever

   integer, parameter :: piece = 1024               !! most cells of a row that are swept at once
   integer, parameter :: fixed_sums = 4             !! sums of a pass beside those of the arms

   !> The material, its time scheme and the coefficients of the step in hand. No fields.
   type :: zener_type
      real(dp) :: g_e = 0.0_dp               !! long-term modulus, Pa
      real(dp), allocatable :: g(:)          !! moduli of the arms, Pa
      real(dp), allocatable :: tau(:)        !! relaxation times, s
      integer :: scheme = scheme_exponential2
      integer :: kind = step_jump            !! of the step in hand
      real(dp) :: dt = 0.0_dp                !! its duration, s
      real(dp) :: dt_old = 0.0_dp           !! of the step before, s; 0: b2 = 0 (for checkpoints)
      real(dp) :: q = 0.0_dp                 !! modulus of the step, Pa
      real(dp) :: weight = 0.0_dp            !! w
      real(dp) :: ratio = 0.0_dp             !! dt/dt_old; 0 without a step before
      real(dp), allocatable :: x(:)          !! dt/tau
      real(dp), allocatable :: alpha(:)      !! what is left of an arm's traction
      real(dp), allocatable :: b1(:)         !! Pa
      real(dp), allocatable :: b2(:)         !! Pa
   end type zener_type

   !> The history of a field of tractions with one or more components.
   type :: history_type
      integer :: cells = 0                   !! values of a component on this process
      integer :: row = 0                     !! values of a row of the grid
      integer :: components = 0
      real(dp), allocatable :: s(:, :)       !! S = P over a modulus [cells, components]
      real(dp), allocatable :: ds(:, :)      !! S - S_old, exponential2 only
      real(dp), allocatable :: arm(:, :, :)  !! p_k, Pa [cells, arms, components]
   end type history_type

   !> Sums over the cells that the energy books need (not yet times the cell area).
   type :: products_type
      real(dp) :: u_s = 0.0_dp               !! U'.S', m
      real(dp) :: p_du = 0.0_dp              !! P'.dU, Pa m, with dU = U' - U
      real(dp) :: du_ds = 0.0_dp             !! dU.dS, m
      real(dp) :: du_ds_old = 0.0_dp         !! dU.dS of the step before, m
      real(dp), allocatable :: arm_du(:)     !! p_k.dU with p_k from before the step, Pa m
   end type products_type

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

   !> No arms: the response has no history.
   pure function is_elastic(self) result(elastic)
      type(zener_type), intent(in) :: self
      logical :: elastic

      elastic = size(self%g) == 0
   end function is_elastic

   !> Does the scheme look back to the step before?
   pure function extrapolates(self) result(yes)
      type(zener_type), intent(in) :: self
      logical :: yes

      yes = self%scheme == scheme_exponential2 .and. .not. is_elastic(self)
   end function extrapolates

   !> Is there no step before to look back to?
   pure function needs_start(self) result(yes)
      type(zener_type), intent(in) :: self
      logical :: yes

      yes = .not. self%dt_old > 0.0_dp
   end function needs_start

   !> Coefficients of a step of duration dt. May be called again before `finish_step`.
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

   !> Coefficients of a jump: the material answers with G(0).
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

   !> Coefficients of a state that has rested for ever: the material answers with G_e.
   subroutine start_relaxed(self, error)
      type(zener_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (self%g_e <= 0.0_dp) then
         call fail(error, error_input, 'relaxed = .true.: a material without long-term modulus '// &
            'flows for ever under load: shear_modulus (or a Zener branch''s g1) must be positive')
         return
      end if
      call start_jump(self)
      self%kind = step_relaxed
      self%alpha = 0.0_dp
      self%b1 = 0.0_dp
      self%q = self%g_e
   end subroutine start_relaxed

   !> The step in hand is over: all histories are committed and the energies booked.
   pure subroutine finish_step(self)
      type(zener_type), intent(inout) :: self

      self%dt_old = 0.0_dp
      if (self%kind == step_regular) self%dt_old = self%dt
   end subroutine finish_step

   !> The load or the speed changes abruptly: the next step does not look back beyond the last.
   pure subroutine restart_order(self)
      type(zener_type), intent(inout) :: self

      self%dt_old = 0.0_dp
   end subroutine restart_order

   !> A history at rest.
   subroutine new_history(self, material, nx, rows, components, error)
      type(history_type), intent(out) :: self
      type(zener_type), intent(in) :: material
      integer, intent(in) :: nx              !! cells of a row
      integer, intent(in) :: rows            !! rows of this process
      integer, intent(in) :: components      !! 1: normal, 2: tangential
      type(error_type), allocatable, intent(out) :: error
      integer :: arms, i, status

      self%row = nx
      self%cells = nx*rows
      self%components = components
      arms = size(material%g)
      i = 0
      if (arms > 0) i = self%cells
      allocate (self%s(i, components), stat=status)
      if (status == 0) allocate (self%arm(i, arms, components), stat=status)
      if (material%scheme /= scheme_exponential2) i = 0
      if (status == 0) allocate (self%ds(i, components), stat=status)
      if (status /= 0) then
         call fail(error, error_input, 'not enough memory for the history of the arms')
         return
      end if
      self%s = 0.0_dp
      self%ds = 0.0_dp
      self%arm = 0.0_dp
   end subroutine new_history

   !> Free the fields.
   subroutine destroy_history(self)
      type(history_type), intent(inout) :: self

      self%cells = 0
      self%row = 0
      self%components = 0
      if (allocated(self%s)) deallocate (self%s, self%ds, self%arm)
   end subroutine destroy_history

   !> Sums of zero.
   pure function new_products(material) result(products)
      type(zener_type), intent(in) :: material
      type(products_type) :: products

      allocate (products%arm_du(size(material%g)), source=0.0_dp)
   end function new_products

   !> Room for the sums of the books of one row, which `commit_row` fills.
   pure function new_row_sums(material, rows) result(sums)
      type(zener_type), intent(in) :: material
      integer, intent(in) :: rows            !! rows of this process
      real(dp), allocatable :: sums(:, :)

      allocate (sums(fixed_sums + size(material%g), rows), source=0.0_dp)
   end function new_row_sums

   !> Add the sums of all rows to those of a step, so that several fields share one set of books.
   subroutine add_rows(self, sums)
      type(products_type), intent(inout) :: self
      real(dp), intent(in) :: sums(:, :)     !! of `new_row_sums`
      real(dp) :: total(size(sums, 1))

      total = row_totals(sums)
      self%u_s = self%u_s + total(1)
      self%p_du = self%p_du + total(2)
      self%du_ds = self%du_ds + total(3)
      self%du_ds_old = self%du_ds_old + total(4)
      self%arm_du = self%arm_du + total(fixed_sums + 1:)
   end subroutine add_rows

   !> What the past adds to the traction of the step in hand: S' = (P' + hist)/Q.
   subroutine history_field(self, material, hist)
      type(history_type), intent(in) :: self
      type(zener_type), intent(in) :: material        !! after start_step, _jump or _relaxed
      real(dp), intent(out) :: hist(self%cells, self%components)   !! Pa; of any rank, x first
      integer :: c, first, last

      do c = 1, self%components
         !$omp parallel do schedule(static) default(none) shared(self, material, hist, c) private(last)
         do first = 1, self%cells, piece
            last = min(first + piece - 1, self%cells)
            if (is_elastic(material)) then
               hist(first:last, c) = 0.0_dp
            else
               call history_cells(self, material, c, first, hist(first:last, c))
            end if
         end do
         !$omp end parallel do
      end do
   end subroutine history_field

   !> The history of some cells from the cell `first` on.
   pure subroutine history_cells(self, material, c, first, hist)
      type(history_type), intent(in) :: self
      type(zener_type), intent(in) :: material
      integer, intent(in) :: c               !! component
      integer, intent(in) :: first
      real(dp), intent(out) :: hist(:)       !! Pa
      real(dp) :: b1, b2
      integer :: k, last

      last = first + size(hist) - 1
      b1 = sum(material%b1)
      b2 = sum(material%b2)
      hist = b1*self%s(first:last, c)
      if (abs(b2) > 0.0_dp) hist = hist - b2*self%ds(first:last, c)
      do k = 1, size(material%alpha)
         hist = hist - material%alpha(k)*self%arm(first:last, k, c)
      end do
   end subroutine history_cells

   !> End the step in hand for one field: new S and p_k, and the sums of the books, in one pass.
   !>
   !> Sums are added to `products`, so that the fields of several calls share one set of books.
   subroutine commit_history(self, material, p, u_old, u_new, products, carried)
      type(history_type), intent(inout) :: self
      type(zener_type), intent(in) :: material        !! after start_step, _jump or _relaxed
      real(dp), intent(in) :: p(self%cells, self%components)       !! P' at the end, Pa; any rank
      real(dp), intent(in) :: u_old(self%cells, self%components)   !! at the start, m
      real(dp), intent(in) :: u_new(self%cells, self%components)   !! at the end, m
      type(products_type), intent(inout) :: products               !! of `new_products`
      real(dp), intent(in), optional :: carried(self%components)   !! uniform part of P' that moves
                                                !! a mass and does not strain the rubber, Pa
      real(dp), allocatable :: sums(:, :)
      real(dp) :: off
      integer :: c, first, j, last

      do c = 1, self%components
         off = 0.0_dp
         if (present(carried)) off = carried(c)
         sums = new_row_sums(material, self%cells/self%row)
         !$omp parallel do schedule(static) default(none) &
         !$omp shared(self, material, p, u_old, u_new, sums, c, off) private(first, last)
         do j = 1, self%cells/self%row
            first = (j - 1)*self%row + 1
            last = j*self%row
            call commit_row(self, material, c, j, p(first:last, c) - off, u_old(first:last, c), &
               u_new(first:last, c), sums(:, j))
         end do
         !$omp end parallel do
         call add_rows(products, sums)
      end do
   end subroutine commit_history

   !> End the step in hand for row j of a component. May be called for several rows at once.
   pure subroutine commit_row(self, material, c, j, p, u_old, u_new, sums)
      type(history_type), intent(inout) :: self
      type(zener_type), intent(in) :: material        !! after start_step, _jump or _relaxed
      integer, intent(in) :: c                        !! component
      integer, intent(in) :: j                        !! row
      real(dp), intent(in) :: p(self%row)             !! P' that strains the rubber, at the end, Pa
      real(dp), intent(in) :: u_old(self%row)         !! at the start, m
      real(dp), intent(in) :: u_new(self%row)         !! at the end, m
      real(dp), intent(inout) :: sums(:)              !! u_s, p_du, du_ds, du_ds_old, arm_du(:)
      integer :: first, last

      if (is_elastic(material)) then
         sums(1) = sums(1) + dot_of_cells(self%row, u_new, p)/material%g_e
         sums(2) = sums(2) + dot_of_cells(self%row, p, u_new - u_old)
         return
      end if
      do first = 1, self%row, piece
         last = min(first + piece - 1, self%row)
         call commit_cells(self, material, c, (j - 1)*self%row + first, p(first:last), &
            u_old(first:last), u_new(first:last), sums)
      end do
   end subroutine commit_row

   !> End the step for a few cells from the cell `first` on.
   pure subroutine commit_cells(self, material, c, first, p, u_old, u_new, sums)
      type(history_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      integer, intent(in) :: c
      integer, intent(in) :: first
      real(dp), intent(in) :: p(:), u_old(:), u_new(:)
      real(dp), intent(inout) :: sums(:)
      real(dp) :: du(piece), step(piece), old(piece)
      integer :: k, last, n

      n = size(p)
      last = first + n - 1
      call history_cells(self, material, c, first, step(:n))
      du(:n) = u_new - u_old
      call new_strain(n, material%q, p, du, u_new, self%s(first:last, c), step, sums)
      old(:n) = 0.0_dp
      if (size(self%ds, 1) > 0) then
         old(:n) = self%ds(first:last, c)
         self%ds(first:last, c) = step(:n)
         sums(4) = sums(4) + dot_of_cells(n, du, old)
      end if
      do k = 1, size(material%alpha)
         sums(fixed_sums + k) = sums(fixed_sums + k) &
            + dot_of_cells(n, du, self%arm(first:last, k, c))
         call advance_arm(n, material%alpha(k), material%b1(k), material%b2(k), step, old, &
            self%arm(first:last, k, c))
      end do
   end subroutine commit_cells

   !> The new S of a few cells, its change, and the products U'.S', P'.dU and dU.dS.
   pure subroutine new_strain(n, q, p, du, u_new, s, step, sums)
      integer, intent(in) :: n
      real(dp), intent(in) :: q              !! modulus of the step, Pa
      real(dp), intent(in) :: p(n), du(n), u_new(n)
      real(dp), intent(inout) :: s(n)
      real(dp), intent(inout) :: step(n)     !! in: the history, Pa; out: S' - S
      real(dp), intent(inout) :: sums(3)
      real(dp) :: u_s, p_du, du_ds, s_new
      integer :: i

      u_s = 0.0_dp
      p_du = 0.0_dp
      du_ds = 0.0_dp
      !$omp simd private(s_new) reduction(+:u_s, p_du, du_ds)
      do i = 1, n
         s_new = (p(i) + step(i))/q
         step(i) = s_new - s(i)
         s(i) = s_new
         u_s = u_s + u_new(i)*s_new
         p_du = p_du + p(i)*du(i)
         du_ds = du_ds + du(i)*step(i)
      end do
      sums = sums + [u_s, p_du, du_ds]
   end subroutine new_strain

   !> p_k' = alpha p_k + b1 (S' - S) + b2 (S - S_old).
   pure subroutine advance_arm(n, alpha, b1, b2, step, old, arm)
      integer, intent(in) :: n
      real(dp), intent(in) :: alpha, b1, b2
      real(dp), intent(in) :: step(n), old(n)
      real(dp), intent(inout) :: arm(n)
      integer :: i

      if (abs(b2) > 0.0_dp) then
         !$omp simd
         do i = 1, n
            arm(i) = alpha*arm(i) + b1*step(i) + b2*old(i)
         end do
      else
         !$omp simd
         do i = 1, n
            arm(i) = alpha*arm(i) + b1*step(i)
         end do
      end if
   end subroutine advance_arm

   !> Sum of the products of two rows.
   pure function dot_of_cells(n, one, other) result(total)
      integer, intent(in) :: n
      real(dp), intent(in) :: one(n), other(n)
      real(dp) :: total
      integer :: i

      total = 0.0_dp
      !$omp simd reduction(+:total)
      do i = 1, n
         total = total + one(i)*other(i)
      end do
   end function dot_of_cells

end module zener
