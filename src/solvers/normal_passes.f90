!> The passes of module `normal_cg` over the whole grid, row by row: the measure of a state, the direction, and the next
!> state. Those that form a step from the direction are in module `normal_projection`.
!>
!> They visit the active blocks only (module `active_blocks`), except the pass that updates the gap. The
!> work fields are zero elsewhere. The innermost loops are in module `normal_sweeps`.
module normal_passes
   use active_blocks, only : active_blocks_type, new_active_blocks, usual_rim
   use coarse_level, only : coarse_level_type, new_coarse_level
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type
   use field_sums, only : row_total
   use normal_sums, only : direction_sums_type, state_sums_type, total
   use normal_sweeps, only : direction_cells, load_cells, measure_cells, overlap_cells, spread_cells, trial_type
   use asperity_precision, only : dp, pi, sp
   use regular_grid, only : grid_type
   use schur_preconditioner, only : new_schur_preconditioner, schur_preconditioner_type
   implicit none
   private

   public :: mean_stiffness, new_direction, new_normal_work, normal_work_type, overlap_with_before, predict_form, survey, &
      update_state

   integer, parameter, public :: as_formed = 1, lowered = 2   !! directions of `normal_work_type`

   !> Stiffness of the mean at a given approach, in the units of the model, if all cells are open and square. It is about two
   !> thirds of the inverse compliance of an open cell that is surrounded by cells in contact. With a larger stiffness the
   !> conjugate gradients of the preconditioner would need more steps.
   real(dp), parameter :: of_open_cells = 4.0_dp

   !> The work fields of a solver, with the active blocks, the preconditioner and the sums.
   type :: normal_work_type
      type(grid_type) :: grid
      integer :: threads = 1
      type(coarse_level_type) :: coarse
      type(active_blocks_type) :: active             !! where residual, direction and step are not 0
      type(schur_preconditioner_type) :: preconditioner   !! holds the residual
      real(dp) :: scale = 0.0_dp                     !! of the residual and the direction; 0: not chosen yet
      real(sp), allocatable :: direction(:, :, :)    !! [nx, rows, as formed and, for very oblong cells, lowered]
      integer :: tried = as_formed                   !! the direction of the trial pressure: as formed, or lowered
      real(dp) :: offset = 0.0_dp                    !! to be subtracted from the direction where it acts
      type(trial_type) :: trial                      !! the step along the direction
      type(state_sums_type), allocatable :: state(:)   !! of each row of the present state
   end type normal_work_type

contains

   !> Allocate the work fields. Some of them lie in the memory of the operator's spectrum: the choice of a
   !> direction uses them, and has ended before the step is transformed.
   subroutine new_normal_work(self, operator, error)
      type(normal_work_type), intent(out) :: self
      type(convolution_type), intent(in) :: operator
      type(error_type), allocatable, intent(out) :: error

      self%grid = operator%grid
      self%threads = operator%threads
      allocate (self%state(self%grid%rows()))
      call new_coarse_level(self%coarse, self%grid, operator%kernel, error)
      if (.not. allocated(error)) call new_schur_preconditioner(self%preconditioner, self%grid, self%coarse, &
         self%threads, operator%spectrum_memory(), operator%spectrum_length(), error)
      allocate (self%direction(self%grid%nx, self%grid%rows(), merge(lowered, as_formed, self%preconditioner%by_waves)))
      if (.not. allocated(error)) call new_active_blocks(self%active, self%grid, self%coarse, &
         merge(0, usual_rim, self%preconditioner%by_waves), self%threads)
   end subroutine new_normal_work

   !> Find out which blocks have pressure, the least gap of each block, and the sums of the state.
   subroutine survey(self, prescribed, pressure, gap)
      type(normal_work_type), intent(inout) :: self
      real(dp), intent(in) :: prescribed             !! level, m
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())
      integer :: j

      !$omp parallel do default(none) shared(self, prescribed, pressure, gap) private(j) &
      !$omp num_threads(self%threads)
      do j = 1, self%grid%rows()
         call measure_cells(self%grid%nx, prescribed, gap(1, j), pressure(1, j), self%state(j))
         call self%active%survey_row(.true., j, pressure(:, j), gap(:, j), self%state(j)%least)
      end do
   end subroutine survey

   !> The product of z = M r with the residual before.
   function overlap_with_before(self) result(overlap)
      type(normal_work_type), intent(in), target :: self
      real(dp) :: overlap
      real(dp), allocatable :: rows(:)
      real(sp), allocatable :: correction(:)
      real(sp), pointer, contiguous :: response(:)
      integer :: j, k, jb

      allocate (rows(self%grid%rows()), source=0.0_dp)
      !$omp parallel default(none) shared(self, rows) private(j, k, jb, correction, response) &
      !$omp num_threads(self%threads)
      allocate (correction(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         call self%preconditioner%give_coarse_part(self%coarse, jb, correction)
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            response(self%coarse%columns(1):) => self%preconditioner%response_row(j)
            do k = 1, self%active%runs(j)
               associate (a => self%active%first(k, j), b => self%active%last(k, j))
                  rows(j) = rows(j) + overlap_cells(b - a + 1, self%preconditioner%length, &
                     self%preconditioner%image(a:b, j), response(a:b), correction(a:b), &
                     self%preconditioner%residual(a:b, j), self%preconditioner%before(a:b, j))
               end associate
            end do
         end do
      end do
      !$omp end parallel
      overlap = row_total(rows)
   end function overlap_with_before

   !> Compute direction = z + beta direction where it acts: on S, except in cells without pressure in which z is
   !> negative. The constant that makes sum(direction) zero is kept in `offset` and not subtracted; the product r.d is
   !> that after its subtraction.
   subroutine new_direction(self, fixed_load, preconditioned, beta, pressure, slope)
      type(normal_work_type), intent(inout) :: self
      logical, intent(in) :: fixed_load              !! the direction may not change the load
      logical, intent(in) :: preconditioned          !! z = M r, else z = r
      real(dp), intent(in) :: beta
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), intent(out) :: slope                 !! r.d
      type(direction_sums_type), allocatable :: rows(:)
      type(direction_sums_type) :: sums
      real(sp), allocatable :: correction(:)         !! coarse part of z
      integer :: j, jb

      allocate (rows(self%grid%rows()))
      !$omp parallel default(none) shared(self, preconditioned, beta, pressure, rows) &
      !$omp private(j, jb, correction) num_threads(self%threads)
      allocate (correction(self%grid%nx))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         correction(:) = 0.0_sp
         if (preconditioned) call self%preconditioner%give_coarse_part(self%coarse, jb, correction)
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            call direction_row(self, preconditioned, beta, j, pressure(:, j), correction, rows(j))
         end do
      end do
      !$omp end parallel
      sums = total(rows)
      self%offset = 0.0_dp
      if (fixed_load) self%offset = sums%value/max(sums%cells, 1.0_dp)
      slope = (sums%slope - self%offset*sums%residual)/self%scale
   end subroutine new_direction

   !> Predict d.A d for the direction d, for a modulus of 1, from its block means.
   function predict_form(self) result(form)
      type(normal_work_type), intent(inout) :: self
      real(dp) :: form
      real(dp), allocatable :: squares(:), column(:)
      integer :: j, k, jb

      allocate (squares(self%grid%rows()), source=0.0_dp)
      !$omp parallel default(none) shared(self, squares) private(j, k, jb, column) num_threads(self%threads)
      allocate (column(self%coarse%columns(1):self%coarse%columns(2)))
      !$omp do schedule(dynamic)
      do jb = self%coarse%strips(1), self%coarse%strips(2)
         column(:) = 0.0_dp
         do j = self%coarse%first_y(jb), self%coarse%first_y(jb + 1) - 1
            do k = 1, self%active%runs(j)
               associate (first => self%active%first(k, j))
                  call spread_cells(self%active%last(k, j) - first + 1, self%offset, self%direction(first, j, as_formed), &
                     column(first), squares(j))
               end associate
            end do
         end do
         call self%coarse%sum_blocks(column, self%coarse%mean(:, jb))
         self%coarse%mean(:, jb) = self%coarse%mean(:, jb)/self%coarse%cells
      end do
      !$omp end parallel
      call self%coarse%share_blocks(self%coarse%mean)
      form = self%coarse%predict_form(row_total(squares))
   end function predict_form

   !> The stiffness that the model has for the mean of v at a given approach on a periodic grid, in the units of the model.
   !>
   !> The mean displacement is given then, so that B is infinite for the mean: v should have none. If the pressure of all
   !> cells in contact changes by the same amount, only the gaps of the open cells N change. A finite stiffness of about the
   !> inverse compliance of this change is therefore sufficient. With n cells it is
   !>     n/(1_S.A 1_S),     1_S.A 1_S = 1_N.A 1_N ~ (number of open cells) (compliance of an open cell),
   !> where the second form holds for open cells that are far from each other. A long cell is less compliant than a square one
   !> of the same area.
   pure real(dp) function mean_stiffness(grid, open_part)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: open_part                      !! of the cells

      mean_stiffness = of_open_cells/max(open_part, 1.0_dp/grid%cells())
      if (min(grid%nx, grid%ny) > 1) &
         mean_stiffness = mean_stiffness*compliance_of_cell(1.0_dp)/compliance_of_cell(grid%dx/grid%dy)
   end function mean_stiffness

   !> Compliance of a rectangular cell: the mean of 1/|q| over the wave vectors of the grid, over the side of a square cell of
   !> the same area.
   pure real(dp) function compliance_of_cell(ratio)
      real(dp), intent(in) :: ratio                          !! of the sides

      compliance_of_cell = (sqrt(ratio)*asinh(1.0_dp/ratio) + asinh(ratio)/sqrt(ratio))/pi
   end function compliance_of_cell

   !> Compute the direction in a row.
   subroutine direction_row(self, preconditioned, beta, j, pressure, correction, sums)
      type(normal_work_type), intent(inout), target :: self
      logical, intent(in) :: preconditioned
      real(dp), intent(in) :: beta
      integer, intent(in) :: j
      real(dp), intent(in) :: pressure(self%grid%nx)
      real(sp), intent(in) :: correction(self%grid%nx)
      type(direction_sums_type), intent(out) :: sums
      real(sp), pointer, contiguous :: image(:), response(:)
      real(sp) :: length
      integer :: k

      ! z = image + length response + correction.
      image => self%preconditioner%image(1:self%grid%nx, j)
      if (.not. preconditioned) image => self%preconditioner%residual(1:self%grid%nx, j)
      length = merge(self%preconditioner%length, 0.0_sp, preconditioned)
      response => image
      if (preconditioned) response(self%coarse%columns(1):) => self%preconditioner%response_row(j)
      do k = 1, self%active%runs(j)
         associate (a => self%active%first(k, j), b => self%active%last(k, j))
            call direction_cells(b - a + 1, length, image(a:b), response(a:b), correction(a:b), &
               self%preconditioner%residual(a:b, j), real(beta, sp), real(self%offset, sp), &
               self%preconditioner%per_pressure, pressure(a:b), self%direction(a:b, j, as_formed), sums)
         end associate
      end do
   end subroutine direction_row

   !> Add a multiple of the projected step s to P and of A s to the gap, and survey the new state.
   subroutine update_state(self, operator, prescribed, multiple, modulus, pressure, gap)
      type(normal_work_type), intent(inout) :: self
      type(convolution_type), intent(inout) :: operator   !! holds the columns of A s
      real(dp), intent(in) :: prescribed             !! level, m
      real(dp), intent(in) :: multiple
      real(dp), intent(in) :: modulus                !! Pa
      real(dp), intent(inout) :: pressure(self%grid%nx, self%grid%rows())
      real(dp), intent(inout) :: gap(self%grid%nx, self%grid%rows())
      type(state_sums_type) :: sums
      integer :: j, k, n

      !$omp parallel do default(none) shared(self, operator, prescribed, multiple, modulus, pressure, gap) &
      !$omp private(j, k, n, sums) schedule(dynamic, 8) num_threads(self%threads)
      do j = 1, self%grid%rows()
         call operator%add_backward_row(1, j, multiple/modulus, gap(:, j))
         sums = state_sums_type()
         do k = 1, self%active%runs(j)
            associate (first => self%active%first(k, j))
               n = self%active%last(k, j) - first + 1
               call load_cells(n, multiple, self%trial, prescribed, gap(first, j), &
                  self%direction(first, j, self%tried), pressure(first, j), sums)
            end associate
         end do
         call self%active%survey_row(.false., j, pressure(:, j), gap(:, j), sums%least)
         self%state(j) = sums
      end do
   end subroutine update_state

end module normal_passes
