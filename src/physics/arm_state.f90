!> The state of the arms: the memory of a viscoelastic solid, stored as fields of tractions.
!>
!> Module `zener` has the equations. S is the traction that would hold the displacement in an elastic solid of
!> unit modulus, p_k the traction of arm k. `past_traction` computes from them the traction of the past P_h, which
!> a contact solver adds to P. `commit_arms` advances them to the end of the step, and in the same pass forms
!> the sums that the energy books need.
!>
!> Memory: S and one field per arm; one more (S - S_old) for exponential2; none for an elastic body.
!> Results do not depend on the number of threads or processes: sums are formed row by row.
module arm_state
   use asperity_errors, only : error_memory, error_type, fail
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : row_totals
   use zener, only : is_elastic, scheme_exponential2, zener_type
   implicit none
   private

   public :: add_rows, arm_state_type, commit_arm_row, commit_arms, new_arm_state, &
      new_products, new_row_sums, past_traction, products_type

   integer, parameter :: piece = 1024               !! largest number of cells of a row that a sweep handles together
   integer, parameter :: fixed_sums = 4             !! sums of a pass in addition to those of the arms

   !> The state of the arms behind a field of tractions with one or more components.
   type :: arm_state_type
      integer :: cells = 0                   !! values of a component on this process
      integer :: row = 0                     !! values of a row of the grid
      integer :: components = 0
      real(dp), allocatable :: s(:, :)       !! S = P over a modulus [cells, components]
      real(dp), allocatable :: ds(:, :)      !! S - S_old, exponential2 only
      real(dp), allocatable :: arm(:, :, :)  !! p_k, Pa [cells, arms, components]
   end type arm_state_type

   !> Sums over the cells that the energy books need (not yet times the cell area).
   type :: products_type
      real(dp) :: u_s = 0.0_dp               !! U'.S', m
      real(dp) :: p_du = 0.0_dp              !! P'.dU, Pa m, with dU = U' - U
      real(dp) :: du_ds = 0.0_dp             !! dU.dS, m
      real(dp) :: du_ds_old = 0.0_dp         !! dU.dS of the step before, m
      real(dp), allocatable :: arm_du(:)     !! p_k.dU with p_k from before the step, Pa m
   end type products_type

contains

   !> Make the state of arms at rest.
   subroutine new_arm_state(self, material, nx, rows, components, error)
      type(arm_state_type), intent(out) :: self
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
      if (any_process(status /= 0)) then
         call fail(error, error_memory, 'not enough memory for the state of the arms')
         return
      end if
      self%s = 0.0_dp
      self%ds = 0.0_dp
      self%arm = 0.0_dp
   end subroutine new_arm_state

   !> Sums that are all zero.
   pure function new_products(material) result(products)
      type(zener_type), intent(in) :: material
      type(products_type) :: products

      allocate (products%arm_du(size(material%g)), source=0.0_dp)
   end function new_products

   !> Allocate the sums of the energy books for one row, which `commit_arm_row` fills.
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

   !> The traction of the past P_h for the present step: S' = (P' + P_h)/Q.
   subroutine past_traction(self, material, past)
      type(arm_state_type), intent(in) :: self
      type(zener_type), intent(in) :: material        !! after start_step, _jump or _relaxed
      real(dp), intent(out) :: past(self%row, self%components, self%cells/self%row)   !! Pa
      integer :: c, first, j, last

      !$omp parallel do schedule(static) default(none) shared(self, material, past) private(c, first, last)
      do j = 1, self%cells/self%row
         do c = 1, self%components
            do first = 1, self%row, piece
               last = min(first + piece - 1, self%row)
               if (is_elastic(material)) then
                  past(first:last, c, j) = 0.0_dp
               else
                  call past_of_cells(self, material, c, (j - 1)*self%row + first, past(first:last, c, j))
               end if
            end do
         end do
      end do
      !$omp end parallel do
   end subroutine past_traction

   !> The traction of the past in some cells from the cell `first` on.
   pure subroutine past_of_cells(self, material, c, first, past)
      type(arm_state_type), intent(in) :: self
      type(zener_type), intent(in) :: material
      integer, intent(in) :: c               !! component
      integer, intent(in) :: first
      real(dp), intent(out) :: past(:)       !! Pa
      real(dp) :: b1, b2
      integer :: k, last

      last = first + size(past) - 1
      b1 = sum(material%b1)
      b2 = sum(material%b2)
      past = b1*self%s(first:last, c)
      if (abs(b2) > 0.0_dp) past = past - b2*self%ds(first:last, c)
      do k = 1, size(material%alpha)
         past = past - material%alpha(k)*self%arm(first:last, k, c)
      end do
   end subroutine past_of_cells

   !> End the present step for one field. One pass computes the new S and p_k and the sums for the books.
   !>
   !> The sums are added to `products`, so that the fields of several calls share one set of books.
   subroutine commit_arms(self, material, p, u_old, u_new, products, carried)
      type(arm_state_type), intent(inout) :: self
      type(zener_type), intent(in) :: material        !! after start_step, _jump or _relaxed
      !> P' at the end, Pa; [nx, rows] or [nx, components, rows]
      real(dp), intent(in) :: p(self%row, self%components, self%cells/self%row)
      real(dp), intent(in) :: u_old(self%row, self%components, self%cells/self%row)   !! at the start, m
      real(dp), intent(in) :: u_new(self%row, self%components, self%cells/self%row)   !! at the end, m
      type(products_type), intent(inout) :: products               !! of `new_products`
      real(dp), intent(in), optional :: carried(self%components)   !! uniform part of P' that moves
                                                !! a mass and does not strain the rubber, Pa
      real(dp), allocatable :: sums(:, :)
      real(dp) :: off
      integer :: c, j

      do c = 1, self%components
         off = 0.0_dp
         if (present(carried)) off = carried(c)
         sums = new_row_sums(material, self%cells/self%row)
         !$omp parallel do schedule(static) default(none) &
         !$omp shared(self, material, p, u_old, u_new, sums, c, off)
         do j = 1, self%cells/self%row
            call commit_arm_row(self, material, c, j, p(:, c, j) - off, u_old(:, c, j), u_new(:, c, j), &
               sums(:, j))
         end do
         !$omp end parallel do
         call add_rows(products, sums)
      end do
   end subroutine commit_arms

   !> End the present step for row j of a component. Several threads may call this for different rows.
   pure subroutine commit_arm_row(self, material, c, j, p, u_old, u_new, sums)
      type(arm_state_type), intent(inout) :: self
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
   end subroutine commit_arm_row

   !> End the step for a few cells from the cell `first` on.
   pure subroutine commit_cells(self, material, c, first, p, u_old, u_new, sums)
      type(arm_state_type), intent(inout) :: self
      type(zener_type), intent(in) :: material
      integer, intent(in) :: c
      integer, intent(in) :: first
      real(dp), intent(in) :: p(:), u_old(:), u_new(:)
      real(dp), intent(inout) :: sums(:)
      real(dp) :: du(piece), step(piece), old(piece)
      integer :: k, last, n

      n = size(p)
      last = first + n - 1
      call past_of_cells(self, material, c, first, step(:n))
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
      real(dp), intent(inout) :: step(n)     !! in: P_h, Pa; out: S' - S
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

end module arm_state
