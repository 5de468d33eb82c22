!> Predicts d.A d of a search direction of the tangential problem, which determines the length of a step.
!>
!> The exact value would take the forward transforms of d on the whole grid. The prediction takes those of the means of d
!> over the cells of a grid with about a quarter of the cells along each side (module `coarse_fields`), and a mean
!> compliance for the rest. Oblong cells are joined less along their longer side, because waves along it are soft. With m
!> cells in a coarse one, a_0 the compliance of a cell and c that of a coarse cell, the trace of A on the fields without
!> means is N (m a_0 - c)/m, for N (m - 1)/m unknowns, so that
!>
!>     d.A d = about m mean.A mean + a_r (|d|^2 - m |mean|^2),     a_r = (m a_0 - c)/(m - 1)
!>
!> In the solves of the examples its error is mostly within a few per cent. A step that is so much too long or too short
!> costs hardly any iterations, because the slip of the new traction is computed from a product in any case.
!>
!> On grids of few cells the coarse grid is the grid itself, and the value is exact.
!>
!> Memory: half a field for the means along rows, and what an operator on the coarse grid takes.
module friction_form
   use asperity_errors, only : error_type
   use asperity_precision, only : dp
   use coarse_fields, only : coarse_grid, mean_of_strips, new_row_means, row_means_type
   use fft_conv, only : columns_form, convolution_type, new_convolution
   use field_sums, only : row_total
   use kernels, only : kernel_type
   use, intrinsic :: iso_fortran_env, only : int64
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: friction_form_type, new_friction_form

   real(dp), parameter :: few_cells = 1024.0_dp    !! up to which the exact value costs little, and is used

   !> The prediction and its work space. A variable of this type must not be copied.
   type :: friction_form_type
      type(convolution_type) :: coarse                   !! A on the coarse grid
      type(grid_type), private :: grid
      type(row_means_type), private :: along_row
      real(dp), private :: cells = 1.0_dp                !! m
      real(dp), private :: rest = 0.0_dp                 !! a_r, m/Pa
      real(dp), allocatable, private :: strips(:, :, :)  !! means along rows, Pa [coarse nx, rows, 2]
      real(dp), allocatable, private :: means(:, :)      !! Pa [coarse nx, coarse rows]
   contains
      procedure :: set_mean_compliance
      procedure :: take_row
      procedure :: predict
      procedure :: transforms
      procedure :: destroy
   end type friction_form_type

contains

   !> Prepare the prediction for the kernel of a solid. Collective where processes share the rows.
   subroutine new_friction_form(self, grid, kernel, compliance, error)
      type(friction_form_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(kernel_type), intent(in) :: kernel        !! tangential response of the solid
      real(dp), intent(in) :: compliance             !! a_0, m/Pa
      type(error_type), allocatable, intent(inout) :: error
      type(grid_type) :: coarse

      self%grid = grid
      coarse = grid
      if (grid%cells() > few_cells) coarse = coarse_grid(grid, squarer=.true.)
      call new_convolution(self%coarse, coarse, kernel, error)
      if (allocated(error)) return
      self%along_row = new_row_means(grid%nx, coarse%nx)
      self%cells = grid%cells()/coarse%cells()
      if (self%cells > 1.0_dp) self%rest = max(0.0_dp, (self%cells*compliance &
         - self%coarse%symbols%self_compliance(with_mean=grid%boundary /= boundary_periodic))/(self%cells - 1.0_dp))
      allocate (self%strips(coarse%nx, grid%rows(), 2), self%means(coarse%nx, coarse%rows()), source=0.0_dp)
   end subroutine new_friction_form

   !> Give the coarse operator the mean compliances of the operator. Collective where processes share the columns.
   subroutine set_mean_compliance(self, operator)
      class(friction_form_type), intent(inout) :: self
      type(convolution_type), intent(in) :: operator
      integer :: c

      if (self%grid%boundary /= boundary_periodic) return
      do c = 1, 2
         call self%coarse%symbols%set_mean_mode(c, self%cells*operator%symbols%mean_mode(c))
      end do
   end subroutine set_mean_compliance

   !> Take row j of a component of d.
   subroutine take_row(self, c, j, row)
      class(friction_form_type), intent(inout) :: self
      integer, intent(in) :: c, j
      real(dp), intent(in), contiguous :: row(:)     !! Pa [nx]

      call self%along_row%take(row, self%strips(:, j, c))
   end subroutine take_row

   !> Predict d.A d from the rows that were taken. Collective.
   subroutine predict(self, square, form)
      class(friction_form_type), intent(inout) :: self
      real(dp), intent(in) :: square                 !! |d|^2, Pa^2
      real(dp), intent(out) :: form                  !! Pa m
      real(dp), allocatable :: rows(:)
      integer :: c, j

      allocate (rows(size(self%means, 2)), source=0.0_dp)
      do c = 1, 2
         call mean_of_strips(self%grid, self%coarse%grid, self%strips(:, :, c), self%coarse%threads, self%means)
         !$omp parallel do default(none) shared(self, rows, c) private(j) num_threads(self%coarse%threads)
         do j = 1, size(rows)
            rows(j) = rows(j) + sum(self%means(:, j)**2)
            call self%coarse%forward_row(c, j, self%means(:, j))
         end do
      end do
      call self%coarse%columns(columns_form, form)
      form = self%cells*form + self%rest*max(0.0_dp, square - self%cells*row_total(rows))
   end subroutine predict

   !> Number of transforms since a count of the coarse ones, in transforms of the whole grid.
   pure function transforms(self, since) result(count)
      class(friction_form_type), intent(in) :: self
      integer(int64), intent(in) :: since            !! `coarse%ffts` before
      integer(int64) :: count

      count = nint(real(self%coarse%ffts - since, dp)/self%cells, int64)
   end function transforms

   !> Free the plans.
   subroutine destroy(self)
      class(friction_form_type), intent(inout) :: self

      call self%coarse%destroy()
   end subroutine destroy

end module friction_form
