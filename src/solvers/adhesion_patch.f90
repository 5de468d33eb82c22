!> The patch of an adhesive contact: the differences between periodic and free grids.
!>
!> The methods work on fields of one layout, the grid of the unknowns. Its cells from (1, 1) to (nx, ny)
!> are the patch, where the unknown is the gap g. In periodic mode the patch is the whole grid. B is the
!> inverse of the periodic operator for a shear modulus of 1. Its mean mode is zero, and the mean of the traction, the
!> load p, is kept as a separate number.
!>
!> In free mode the grid of the unknowns is twice as large in each direction; the rest of it is the padding. The
!> operator of a free grid, with Love's coefficients, has no symbol that could be inverted. On the doubled grid,
!> however, the same coefficients repeated periodically have a positive symbol K, and B = 1/K there. The padding has no
!> adhesion, its surface is free, and the unknown there is the displacement u. If the energy is minimised over the u of
!> the padding, it is that of the free operator on the patch (Schur complement). With u = g + H + level on the patch,
!>
!>     P = Q B u - P_h on the patch, 0 in the padding
!>
!> If the load is prescribed, the level is an additional unknown. It moves with the mode psi, which is 1 on
!> the patch and falls in the padding like the displacement of a uniform pressure. A solution is checked with the
!> displacement of its pressure by the true free operator, which does not involve the padding.
!>
!> Processes share the rows of the road's grid. A process that has row j of the patch also has row ny + j of
!> the padding. Thus all processes have equal parts of the patch, which takes more work, and no field has to be
!> moved between the road's grid and that of the unknowns. Fields of the unknowns have the rows of the patch first.
module adhesion_patch
   use adhesion_potential, only : adhesive_slope
   use adhesion_symbols, only : adhesion_symbols_type, new_adhesion_symbols
   use adhesion_state, only : adhesion_problem_type, close_gaps, control_approach, control_pressure
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp, int64
   use fft_conv, only : columns_apply, convolution_type, new_convolution, new_symbol_operator
   use field_sums, only : field_magnitude, field_mean, field_minimum, field_sum, largest_of_rows, row_totals
   use kernels, only : kernel_type
   use regular_grid, only : boundary_periodic, grid_type
   use row_sharing, only : new_row_sharing, owners_on_grid, row_sharing_type
   use transform_shape, only : shape_of_rows
   implicit none
   private

   public :: adhesion_contact_type, adhesion_patch_type, evaluate_gradient, is_detached, natural_residual, &
      new_adhesion_patch, residual_units_type

   !> The units in which the natural residual is measured.
   type :: residual_units_type
      real(dp) :: length = 1.0_dp        !! z_0, or the rms height without adhesion, m
      real(dp) :: traction = 1.0_dp      !! gamma_0/z_0, or the largest traction without adhesion, Pa
      real(dp) :: resolved = 0.0_dp      !! the least such unit that the round-off of a fresh traction allows, Pa
   end type residual_units_type

   !> The fields and numbers of a contact that is being solved.
   type :: adhesion_contact_type
      type(adhesion_problem_type) :: problem
      real(dp), pointer, contiguous :: height(:, :) => null()    !! H on the patch, m
      !> P_h on the patch, Pa; may be missing. Not contiguous: gfortran 12 would pack the argument to which it points
      !> even if that is absent.
      real(dp), pointer :: past(:, :) => null()
      real(dp), pointer, contiguous :: gap(:, :) => null()       !! g of the start in periodic mode; of the solution, m
      real(dp), pointer, contiguous :: pressure(:, :) => null()  !! P of the start in free mode; of the solution, Pa
      real(dp), pointer, contiguous :: state(:, :) => null()     !! g on the patch, u in the padding, m
      real(dp), pointer, contiguous :: traction(:, :) => null()  !! P; in periodic mode P - p, Pa
      real(dp) :: load = 0.0_dp          !! p in periodic mode, Pa; 0 in free mode
      real(dp) :: force = 0.0_dp         !! prescribed sum of P in free mode, Pa; 0 otherwise
      real(dp) :: gap_sum = 0.0_dp       !! prescribed sum of g in periodic mode at a prescribed level, m
      real(dp) :: level = 0.0_dp         !! U - H where the gap is zero; 0 while a periodic contact is solved, m
      real(dp) :: mean_height = 0.0_dp   !! of the patch above the datum, m
      real(dp) :: past_mean = 0.0_dp     !! mean of P_h, which does not matter in periodic mode, Pa
      type(residual_units_type) :: units
   end type adhesion_contact_type

   !> A patch with its operators. A variable of this type must not be copied.
   type :: adhesion_patch_type
      logical :: periodic = .true.
      integer :: nx = 0                                    !! cells of the patch along x
      integer :: rows = 0                                  !! rows of the patch that this process holds
      integer :: mx = 0, my = 0                            !! cells of the grid of the unknowns
      integer :: all_rows = 0                              !! rows of that grid that this process holds
      type(row_sharing_type) :: sharing                    !! how processes share the rows of the unknowns
      integer :: threads = 1
      real(dp) :: cells = 1.0_dp                           !! number of cells of the patch
      type(convolution_type) :: stiffness                  !! B for G = 1
      real(dp) :: nyquist = 0.0_dp                         !! B at the Nyquist wave number
      real(dp) :: longest = 0.0_dp                         !! B at the least wave number
      real(dp), allocatable :: psi(:, :)                   !! the mode of the level, free mode only
      real(dp) :: psi_form = 0.0_dp                        !! psi.B psi
      type(convolution_type), private :: operator          !! the true free operator
   contains
      procedure :: inner
      procedure :: is_full_contact
      procedure :: evaluate_traction
      procedure :: true_residual
      procedure :: return_solution
      procedure :: transforms
      procedure :: destroy
   end type adhesion_patch_type

contains

   !> Make the patch of a grid, and its symbols, from which a caller can make a preconditioner.
   subroutine new_adhesion_patch(self, grid, kernel, symbols, error)
      type(adhesion_patch_type), intent(out) :: self
      type(grid_type), intent(in) :: grid                      !! free grids: ny > 1
      type(kernel_type), intent(in) :: kernel                  !! normal response of the solid
      type(adhesion_symbols_type), intent(out) :: symbols
      type(error_type), allocatable, intent(out) :: error

      self%periodic = grid%boundary == boundary_periodic
      if (grid%ny < 2 .and. .not. self%periodic) then
         call fail(error, error_input, 'adhesion_patch: a free grid must have ny > 1')
         return
      end if
      self%nx = grid%nx
      self%rows = grid%rows()
      self%cells = grid%cells()
      self%nyquist = kernel%largest_stiffness(grid)
      self%longest = kernel%least_stiffness(grid)
      self%mx = merge(1, 2, self%periodic)*grid%nx
      self%my = merge(1, 2, self%periodic)*grid%ny
      call share_unknowns(self, grid)
      if (.not. self%periodic) call new_convolution(self%operator, grid, kernel, error)
      call new_symbol_operator(self%stiffness, shape_of_rows(self%mx, self%sharing, 1), error)
      call new_adhesion_symbols(symbols, grid, kernel, self%mx, self%my)
      call symbols%form(self%stiffness%modes(), error)
      if (allocated(error)) return
      call self%stiffness%set_symbol(symbols%stiffness)
      self%threads = self%stiffness%threads
      if (.not. self%periodic) call make_psi(self)
   end subroutine new_adhesion_patch

   !> Decide which process holds which rows of the unknowns: the rows of the patch as on its grid, and those of the
   !> padding likewise.
   pure subroutine share_unknowns(self, grid)
      type(adhesion_patch_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      integer, allocatable :: owner(:)

      owner = owners_on_grid(grid)
      if (.not. self%periodic) owner = [owner, owner]
      call new_row_sharing(self%sharing, owner, grid%shared)
      self%all_rows = size(self%sharing%own)
   end subroutine share_unknowns

   !> Compute psi: the displacement of a uniform pressure on the patch, divided by its least value there, at most 1.
   subroutine make_psi(self)
      type(adhesion_patch_type), intent(inout) :: self
      real(dp), allocatable :: pressure(:, :)
      real(dp) :: least
      integer :: j

      allocate (pressure(self%mx, self%all_rows), self%psi(self%mx, self%all_rows), source=0.0_dp)
      pressure(1:self%nx, 1:self%rows) = 1.0_dp
      call self%stiffness%apply_inverse(pressure, self%psi)
      least = field_minimum(self%psi(1:self%nx, 1:self%rows))
      do j = 1, self%all_rows
         self%psi(:, j) = min(self%psi(:, j)/least, 1.0_dp)
      end do
      call self%stiffness%quadratic_form(self%psi, self%psi_form)
   end subroutine make_psi

   !> Number of cells of row j that belong to the patch; these are the first ones.
   pure function inner(self, j) result(n)
      class(adhesion_patch_type), intent(in) :: self
      integer, intent(in) :: j
      integer :: n

      n = merge(self%nx, 0, j <= self%rows)
   end function inner

   !> Does a prescribed level leave no gap at all? In free mode the solid can always bulge outside the patch.
   function is_full_contact(self, problem, height) result(closed)
      class(adhesion_patch_type), intent(in) :: self
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :)
      logical :: closed

      closed = .false.
      if (self%periodic .and. problem%control == control_approach) closed = .not. problem%target &
         + (field_mean(height) - problem%datum) < 0.0_dp
   end function is_full_contact

   !> Compute the traction from the state by a product with B.
   subroutine evaluate_traction(self, contact)
      class(adhesion_patch_type), intent(inout) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp), allocatable :: row(:)
      integer :: j

      associate (nx => self%nx)
         !$omp parallel default(none) shared(self, contact) private(j, row) num_threads(self%threads)
         allocate (row(self%mx))
         !$omp do
         do j = 1, self%all_rows
            row(:) = contact%state(:, j)
            if (j <= self%rows) row(1:nx) = row(1:nx) + (contact%height(:, j) - contact%problem%datum) &
               + contact%level
            call self%stiffness%forward_row(1, j, row)
         end do
         !$omp end do
         !$omp end parallel
         call self%stiffness%columns(columns_apply)
         !$omp parallel do default(none) shared(self, contact) private(j) num_threads(self%threads)
         do j = 1, self%all_rows
            call self%stiffness%backward_row(1, j, contact%traction(:, j))
            contact%traction(:, j) = contact%problem%modulus*contact%traction(:, j)
            if (j <= self%rows .and. associated(contact%past)) contact%traction(1:nx, j) = &
               contact%traction(1:nx, j) - (contact%past(:, j) - contact%past_mean)
         end do
      end associate
   end subroutine evaluate_traction

   !> Compute the gradient of the energy on the patch without the load p. In periodic mode at a prescribed level, also
   !> compute p, with which the gradient has no mean over the open cells.
   subroutine evaluate_gradient(self, contact, gradient)
      type(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp), intent(inout) :: gradient(:, :)        !! out: P - p + e'(g) on the patch, Pa
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(2)
      integer :: j

      allocate (rows(2, self%rows))
      associate (nx => self%nx)
         !$omp parallel do default(none) shared(self, contact, gradient, rows) private(j) &
         !$omp num_threads(self%threads)
         do j = 1, self%rows
            gradient(1:nx, j) = contact%traction(1:nx, j) &
               + adhesive_slope(contact%problem%potential, contact%state(1:nx, j))
            rows(1, j) = sum(gradient(1:nx, j), contact%state(1:nx, j) > 0.0_dp)
            rows(2, j) = count(contact%state(1:nx, j) > 0.0_dp)
         end do
      end associate
      if (.not. (self%periodic .and. contact%problem%control == control_approach)) return
      sums = row_totals(rows)
      contact%load = -sums(1)/sums(2)
   end subroutine evaluate_gradient

   !> Is the solid pulled, and are all gaps so wide that no cell attracts as much as the mean pull?
   pure function is_detached(self, contact, least) result(detached)
      type(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(in) :: contact
      real(dp), intent(in) :: least                    !! least gap, m
      logical :: detached
      real(dp) :: pull

      pull = -contact%load
      if (.not. self%periodic) pull = -contact%force/self%cells
      detached = contact%problem%control == control_pressure .and. pull > 0.0_dp .and. &
         least > 3.0_dp*contact%problem%potential%range
      if (detached) detached = adhesive_slope(contact%problem%potential, least) < pull
   end function is_detached

   !> Error of a cell: |min(g/z_0, G z_0/gamma_0)|.
   elemental function natural_residual(units, gap, gradient) result(error)
      type(residual_units_type), intent(in) :: units
      real(dp), intent(in) :: gap           !! g, m
      real(dp), intent(in) :: gradient      !! G, Pa
      real(dp) :: error

      error = abs(min(gap/units%length, gradient/units%traction))
   end function natural_residual

   !> The natural residual of a free patch, whose gap is computed from its pressure with the true operator.
   function true_residual(self, contact) result(natural)
      class(adhesion_patch_type), intent(inout) :: self
      class(adhesion_contact_type), intent(in) :: contact
      real(dp) :: natural
      real(dp), allocatable :: row(:), worst(:)
      real(dp) :: load
      integer :: j

      !$omp parallel default(none) shared(self, contact) private(j, row) num_threads(self%operator%threads)
      allocate (row(self%nx))
      !$omp do
      do j = 1, self%rows
         row(:) = contact%traction(1:self%nx, j)
         if (associated(contact%past)) row(:) = row + contact%past(:, j)
         call self%operator%forward_row(1, j, row)
      end do
      !$omp end do
      !$omp end parallel
      call self%operator%columns(columns_apply)
      allocate (worst(self%rows))
      !$omp parallel default(none) shared(self, contact, worst) private(j, row) &
      !$omp num_threads(self%operator%threads)
      allocate (row(self%nx))
      !$omp do
      do j = 1, self%rows
         call self%operator%backward_row(1, j, row)
         row(:) = row/contact%problem%modulus - (contact%height(:, j) - contact%problem%datum) - contact%level
         worst(j) = maxval(natural_residual(contact%units, row, contact%traction(1:self%nx, j) &
            + adhesive_slope(contact%problem%potential, max(row, 0.0_dp))))
      end do
      !$omp end do
      !$omp end parallel
      natural = largest_of_rows(worst)
      if (contact%problem%control /= control_pressure) return
      load = field_sum(contact%traction(1:self%nx, 1:self%rows))
      natural = max(natural, abs(load - contact%force)/max(abs(contact%force), contact%units%traction))
   end function true_residual

   !> Compute the gap, pressure and level of the solution from its state, and the error of the prescribed load or level.
   !> The gap is exactly zero in the cells in contact. In periodic mode gap and pressure are the fields of the state and
   !> of the traction themselves.
   subroutine return_solution(self, contact, load_error)
      class(adhesion_patch_type), intent(in) :: self
      class(adhesion_contact_type), intent(inout) :: contact
      real(dp), intent(out) :: load_error
      real(dp) :: sum_of_gap, sum_of_pressure, scale
      integer :: j

      !$omp parallel do default(none) shared(self, contact) private(j) num_threads(self%threads)
      do j = 1, self%rows
         contact%gap(:, j) = contact%state(1:self%nx, j)
         contact%pressure(:, j) = contact%traction(1:self%nx, j) + contact%load
      end do
      load_error = 0.0_dp
      sum_of_pressure = field_sum(contact%pressure)
      if (self%periodic) then
         sum_of_gap = field_sum(contact%gap)
         contact%level = -contact%mean_height - sum_of_gap/self%cells
         scale = max(abs(contact%load), epsilon(1.0_dp)*field_magnitude(contact%pressure), tiny(1.0_dp))
         load_error = abs(sum_of_pressure/self%cells - contact%load)/scale
         if (contact%problem%control == control_approach) &
            load_error = abs(sum_of_gap - contact%gap_sum)/contact%gap_sum
      else if (contact%problem%control == control_pressure) then
         load_error = abs(sum_of_pressure - contact%force)/max(abs(contact%force), contact%units%traction)
      end if
      call close_gaps(contact%problem, contact%units%length, contact%units%traction, self%threads, &
         contact%gap, contact%pressure)
   end subroutine return_solution

   !> Transforms done so far.
   pure function transforms(self) result(count)
      class(adhesion_patch_type), intent(in) :: self
      integer(int64) :: count

      count = self%stiffness%ffts + self%operator%ffts
   end function transforms

   !> Free plans.
   subroutine destroy(self)
      class(adhesion_patch_type), intent(inout) :: self

      call self%stiffness%destroy()
      call self%operator%destroy()
   end subroutine destroy

end module adhesion_patch
