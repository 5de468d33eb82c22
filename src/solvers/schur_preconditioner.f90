!> The preconditioner of the normal solver. It extends the residual outside the contact before it applies a local
!> model of the operator's inverse.
!>
!> On a fixed contact set S the matrix of the problem is A_SS. Its inverse is
!>     B_SS - B_SN B_NN^-1 B_NS,
!> the Schur complement of B = A^-1, whose symbol is about |q|, with the wave number q; N are the cells outside the
!> contact. M r is therefore found in two steps: set v = r on S, and choose v on N such that v.B v is least; then
!> M r = B v on S. With v = 0 on N, M r = B_SS r would be the less accurate, the more edges the contact has.
!>
!> B is modelled by a stencil and a coarse level, B v = K v + R^T missing R v, with block sums R (module
!> `schur_coarse`). If the model fits |q| within a factor, the Schur complements fit within the same
!> factor on any set S, so that the number of iterations hardly depends on the grid and the load.
!>
!> The minimum over N is approximated by a few steps of conjugate gradients with the preconditioner W, which is a
!> constant and a coarse part: W p = om p + coarse part. A step needs one pass over the cells (module `schur_passes`). It
!> adds the step before to the image b = B v, and forms the search direction d and its response e = K d. The other
!> sums that conjugate gradients need follow from block sums, because coarse parts are constant in a
!> block (module `schur_blocks`). The caller adds the contribution of the last step to b:
!>     M r = image + length response + pending.
!>
!> The weights of the stencil are proportional to the inverse sides of a cell, like |q| itself. If they were
!> proportional to the inverse squares, like those of a Laplacian, they would be far too large along the short side of
!> oblong cells.
!>
!> At a given approach on a periodic grid the mean of v is stiff in the model (`mean_stiffness` of module `normal_passes`).
!>
!> The same conjugate gradients continue from v after some cells were moved from S to N (module `schur_release`).
!>
!> For very oblong cells the stencil is too inaccurate, and module `wave_preconditioner` forms M r.
!>
!> Only in a narrow rim around the contact (the wide blocks of module `active_blocks`) does each cell of N have its own v.
!> Beyond the rim v is constant in a block, so that distant cells cost no passes. If v were 0 there, the model would be too
!> stiff for long waves, and large grids would need a wide rim. The stencil does not join cells of the rim with those beyond
!> it: their difference would otherwise cost much more than the smooth v that both stand for.
!>
!> N goes on beyond the edges of a free map, where the solid does (the margin of module `coarse_level`). If v were 0
!> there, contacts that reach the edge would take up to three times as many iterations.
!>
!> Fields are in single precision: errors of 1e-7 do not matter in a preconditioner. Memory: five such fields, of which two
!> lie in memory that the caller lends.
module schur_preconditioner
   use, intrinsic :: iso_c_binding, only : c_f_pointer, c_null_ptr, c_ptr
   use active_blocks, only : active_blocks_type
   use coarse_level, only : coarse_level_type
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int64, pi, sp
   use normal_sweeps, only : trial_type
   use regular_grid, only : boundary_periodic, grid_type
   use row_halo, only : new_rim_halo
   use schur_blocks, only : new_schur_blocks
   use schur_coarse, only : om, stencil_c0, stencil_c1
   use schur_long_waves, only : long_waves_type, new_long_waves
   use schur_passes, only : residual_pass, schur_fields_type, search_pass, step_type
   use schur_release, only : release_pass
   use schur_sweeps, only : response_sums_type
   use zeroed_memory, only : free_field, new_zeroed_field
   use wave_preconditioner, only : new_wave_preconditioner, wave_preconditioner_type
   implicit none
   private

   public :: new_schur_preconditioner, schur_preconditioner_type

   real(dp), parameter :: typical = 3.2_dp     !! model over wave number per cell, between its least and its largest value
   real(dp), parameter :: solved = 1e-8_dp     !! reduction of the residual on N that is enough

   !> The preconditioner with its fields. A variable of this type must not be copied.
   type, extends(schur_fields_type) :: schur_preconditioner_type
      logical :: by_waves = .false.                      !! cells are so oblong that M r comes from `waves`
      logical :: released = .false.                      !! the fields hold the change after a release
      logical :: fixed_load = .true.                     !! the load is given, not the approach
      real(dp) :: compliance = 0.0_dp                    !! typical eigenvalue of M A, m/Pa
      real(dp), private :: form = 0.0_dp                 !! r.M r
      real(dp) :: overlap = 0.0_dp                       !! (r before).M r, if by waves; `search` holds r before
      type(c_ptr), private :: zeros(2) = c_null_ptr      !! memory of the residual and that before
      real(sp), pointer, contiguous, private :: own_memory(:, :, :) => null()   !! of the image and the response, if not lent
      type(wave_preconditioner_type) :: waves
      type(long_waves_type) :: long_waves                !! of a long or free grid, of which a release keeps the load
   contains
      procedure :: set_residual
      procedure :: extend
      procedure :: release
      procedure :: give_coarse_part
      procedure :: transforms
      procedure :: destroy
   end type schur_preconditioner_type

contains

   !> Make the preconditioner of a grid. The image and the response lie in `memory`, if it is large enough. Others may use
   !> it from the last use of a direction until `set_residual`.
   subroutine new_schur_preconditioner(self, grid, coarse, threads, memory, length, error)
      type(schur_preconditioner_type), intent(out) :: self
      type(grid_type), intent(in) :: grid
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: threads
      type(c_ptr), intent(in) :: memory
      integer(int64), intent(in) :: length               !! numbers in double precision that fit in it
      type(error_type), allocatable, intent(out) :: error
      real(sp), pointer, contiguous :: pair(:, :, :)
      real(dp) :: wx, wy
      integer :: extents(2)

      self%grid = grid
      self%columns = coarse%columns
      self%rows = coarse%rows
      call new_rim_halo(self%rim, grid)
      self%threads = threads
      self%by_waves = grid%very_oblong()
      self%compliance = typical*pi*coarse%kernel%compliance(pi/coarse%h)
      wx = merge(0.0_dp, stencil_c1*coarse%h/grid%dx, grid%nx == 1)
      wy = merge(0.0_dp, stencil_c1*coarse%h/grid%dy, grid%ny == 1)
      self%weights = real([wx, wy], sp)
      call set_centre(self, coarse, 2.0_dp*(wx + wy))
      ! The residuals take memory only where wide blocks come into use (module `active_blocks`).
      associate (left => self%columns(1) - 1, right => self%columns(2) + 1, low => self%rows(1) - 1, high => self%rows(2) + 1)
         allocate (self%search(left:right, low:high))
         call new_zeroed_field([left, low], [right, high], self%zeros(1), self%residual)
         if (.not. self%by_waves) call new_zeroed_field([left, low], [right, high], self%zeros(2), self%before)
      end associate
      extents = [self%columns(2) - self%columns(1), self%rows(2) - self%rows(1)] + 1
      if (product(int(extents, int64)) <= length) then
         call c_f_pointer(memory, pair, [extents, 2])
      else
         allocate (self%own_memory(extents(1), extents(2), 2))
         pair => self%own_memory
      end if
      self%image(self%columns(1):, self%rows(1):) => pair(:, :, 1)
      self%response(self%columns(1):, self%rows(1):) => pair(:, :, 2)
      call new_schur_blocks(self%blocks, coarse, threads, error)
      if (.not. self%by_waves) call new_long_waves(self%long_waves, grid, coarse, threads, error)
      if (self%by_waves) call new_wave_preconditioner(self%waves, grid, coarse, error)
   end subroutine new_schur_preconditioner

   !> Set the weights in the middle of the stencil. The coarse level takes the part c0 of the stencil away from long waves.
   !> If a block has fewer or more cells than others, the weight c0 of the sum over its cells must be the same. With the same
   !> weight in all cells the longest waves of large grids, whose model is much smaller than c0, would be too stiff.
   subroutine set_centre(self, coarse, sides)
      type(schur_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      real(dp), intent(in) :: sides                      !! sum of the weights of the cells beside it
      real(dp) :: c0(coarse%nx)
      integer :: jb

      associate (heights => coarse%first_y(2:) - coarse%first_y(:coarse%ny))
         allocate (self%centre(self%columns(1):self%columns(2), minval(heights):maxval(heights)), source=0.0_sp)
         do jb = 1, coarse%ny
            c0(:) = stencil_c0*coarse%evenness(jb)
            self%centre(:, heights(jb)) = real(c0(coarse%block_x) + sides, sp)
         end do
      end associate
   end subroutine set_centre

   !> Compute the residual scale (level - gap) on S = {P > 0 or gap < level}, its block means and its image by K. The
   !> residual before is kept, except if M r comes from `waves`.
   subroutine set_residual(self, coarse, active, scale, level, pressure, gap)
      class(schur_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(inout) :: coarse
      type(active_blocks_type), intent(in) :: active
      real(dp), intent(in) :: scale                      !! a power of two
      real(dp), intent(in) :: level                      !! m
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows()), gap(self%grid%nx, self%grid%rows())

      if (self%by_waves) then
         call self%waves%set_residual(coarse, active, scale, level, pressure, gap, self%residual)
      else
         call residual_pass(self, coarse, active, scale, level, pressure, gap)
      end if
   end subroutine set_residual

   !> Extend the residual to N by some steps of conjugate gradients. Collective.
   subroutine extend(self, coarse, active, steps, form)
      class(schur_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: steps
      real(dp), intent(out) :: form                      !! r.M r = v.B v
      real(dp) :: square                                 !! of the residual on N, which is -b

      self%length = 0.0_sp
      self%released = .false.
      call self%long_waves%begin()
      if (self%by_waves) then
         self%waves%fixed_load = self%fixed_load
         call self%waves%apply(coarse, self%residual, self%search, self%image, self%blocks%pending, form, &
            self%overlap)
         return
      end if
      call self%blocks%image_parts(coarse, form, square)
      form = self%sums%form + form
      call minimise(self, coarse, active, steps, self%sums%square + square, form)
      self%form = form
   end subroutine extend

   !> Release the cells whose trial pressure is negative (module `schur_release`), and extend the residual to them by some
   !> steps. Afterwards `image`, `response` and the coarse part hold the change of the direction. On a long or free grid it
   !> keeps the load of the long waves (module `schur_long_waves`). It may be called again with the changed direction.
   !> Collective.
   subroutine release(self, coarse, active, steps, trial, pressure, direction)
      class(schur_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: steps
      type(trial_type), intent(in) :: trial
      real(dp), intent(in) :: pressure(self%grid%nx, self%grid%rows())
      real(sp), intent(in) :: direction(self%grid%nx, self%grid%rows())
      real(dp) :: form

      call release_pass(self, coarse, active, trial, pressure, direction)
      self%released = .true.
      form = self%form
      call minimise(self, coarse, active, steps, self%sums%square, form)
      if (self%long_waves%matter) call self%long_waves%restore(coarse, active, .not. self%fixed_load .and. &
         self%grid%boundary == boundary_periodic, trial%offset, self%residual, direction, self%blocks)
   end subroutine release

   !> Reduce v.B v by some steps of conjugate gradients on N. Collective.
   subroutine minimise(self, coarse, active, steps, square_before, form)
      class(schur_preconditioner_type), intent(inout) :: self
      type(coarse_level_type), intent(in) :: coarse
      type(active_blocks_type), intent(in) :: active
      integer, intent(in) :: steps
      real(dp), intent(in) :: square_before              !! b^2 on N
      real(dp), intent(inout) :: form                    !! v.B v
      type(step_type) :: step
      type(response_sums_type) :: sums, parts
      real(dp) :: square, product, before, first, length
      integer :: k

      square = square_before
      if (steps == 0 .or. square <= 0.0_dp) return
      call self%blocks%start(coarse)
      before = 0.0_dp
      first = 0.0_dp
      do k = 1, steps
         call self%blocks%weigh(coarse, product)
         product = om*square + product
         if (k == 1) first = product
         if (product <= solved*first .or. product <= tiny(1.0_dp)) exit
         step%first = k == 1
         ! The long waves of a step need the sums of the last response, too.
         step%last = k == steps .and. .not. (self%released .and. self%long_waves%matter)
         if (k > 1) step%beta = real(product/before, sp)
         before = product
         call self%blocks%form_direction(coarse, real(step%beta, dp))
         call search_pass(self, coarse, active, step, sums)
         self%length = 0.0_sp
         call self%blocks%response_parts(coarse, parts%form, parts%cross, parts%square)
         length = sums%form + parts%form
         if (length <= 0.0_dp) exit
         length = product/length
         form = form - length*product
         square = square + 2.0_dp*length*(sums%cross + parts%cross) + length**2*(sums%square + parts%square)
         call self%blocks%advance(coarse, length)
         self%length = real(length, sp)
         ! Single precision cannot resolve smaller gains: further directions would be round-off.
         if (length*product <= epsilon(1.0_sp)*form) exit
      end do
   end subroutine minimise

   !> Give the coarse part of M r, or of the change after a release, along a row of blocks.
   pure subroutine give_coarse_part(self, coarse, jb, row)
      class(schur_preconditioner_type), intent(in) :: self
      type(coarse_level_type), intent(in) :: coarse
      integer, intent(in) :: jb                          !! row of blocks
      real(sp), intent(out) :: row(self%grid%nx)         !! of each cell

      call coarse%spread_blocks(self%blocks%pending(:, jb), 1, row)
      if (self%released .and. self%long_waves%matter) &
         row(:) = row + real(self%long_waves%restored(coarse%block_x(1:self%grid%nx), jb), sp)
   end subroutine give_coarse_part

   !> Transforms done so far, in units of a transform of the whole grid.
   pure function transforms(self) result(count)
      class(schur_preconditioner_type), intent(in) :: self
      real(dp) :: count

      count = self%blocks%model%transforms() + self%waves%transforms() + self%long_waves%transforms()
   end function transforms

   !> Free plans and memory.
   subroutine destroy(self)
      class(schur_preconditioner_type), intent(inout) :: self

      if (associated(self%own_memory)) deallocate (self%own_memory)
      call free_field(self%zeros(1), self%residual)
      call free_field(self%zeros(2), self%before)
      call self%blocks%model%destroy()
      call self%waves%destroy()
      call self%long_waves%destroy()
   end subroutine destroy

end module schur_preconditioner
