!> The innermost loops of module `schur_preconditioner` over neighbouring cells of one row, in single
!> precision.
!>
!> Each is one loop without branches, so that it runs in vector registers. A cell is in the contact set S
!> if its residual is not 0; the others form the set N. From the first step on, the search direction is 0 on
!> S and not 0 on N: the later steps tell the sets by it and need not read the residual. The loops take many
!> arguments because passing them costs less than looking them up in records.
module schur_sweeps
   use asperity_precision, only : dp, sp
   implicit none
   private

   public :: image_cells, image_sums_type, last_response_cells, response_cells, response_sums_type, search_cells, &
      start_search_cells

   !> Sums of v and its image b = K v.
   type :: image_sums_type
      real(dp) :: form = 0.0_dp             !! v b
      real(dp) :: square = 0.0_dp           !! b^2 on N
   end type image_sums_type

   !> Sums of a search direction d (on N), its response e = K d and the image b.
   type :: response_sums_type
      real(dp) :: form = 0.0_dp             !! d e
      real(dp) :: cross = 0.0_dp            !! b e on N
      real(dp) :: square = 0.0_dp           !! e^2 on N
   end type response_sums_type

contains

   !> Compute image = K residual, with its sums on N.
   pure subroutine image_cells(n, centre, weights, south, residual, north, image, column, count, sums)
      integer, intent(in) :: n
      real(sp), intent(in) :: centre(n)             !! weight of the stencil in its middle
      real(sp), intent(in) :: weights(2)            !! those along x and y
      real(sp), intent(in) :: south(n), residual(0:n + 1), north(n)
      real(sp), intent(inout) :: image(n)
      real(sp), intent(inout) :: column(n)          !! sums of the image on N over the rows of a block
      real(sp), intent(inout) :: count(n)           !! numbers of cells in N likewise
      type(image_sums_type), intent(inout) :: sums
      real(sp) :: wx, wy, form, square, b, f, inside
      integer :: i

      wx = weights(1)
      wy = weights(2)
      form = 0.0_sp
      square = 0.0_sp
      !$omp simd reduction(+:form, square) private(b, f, inside)
      do i = 1, n
         b = centre(i)*residual(i) - wx*(residual(i - 1) + residual(i + 1)) - wy*(south(i) + north(i))
         inside = off(residual(i))
         f = inside*b
         image(i) = b
         column(i) = column(i) + f
         count(i) = count(i) + inside
         form = form + residual(i)*b
         square = square + f*f
      end do
      sums%form = sums%form + form
      sums%square = sums%square + square
   end subroutine image_cells

   !> Compute image = image + coarse part, and search = correction - diagonal image on N, 0 on S.
   pure subroutine start_search_cells(n, diagonal, coarse, correction, residual, image, search)
      integer, intent(in) :: n
      real(sp), intent(in) :: diagonal
      real(sp), intent(in) :: coarse(n), correction(n)
      real(sp), intent(in) :: residual(n)
      real(sp), intent(inout) :: image(n)
      real(sp), intent(inout) :: search(n)
      real(sp) :: b
      integer :: i

      !$omp simd private(b)
      do i = 1, n
         b = image(i) + coarse(i)
         image(i) = b
         search(i) = off(residual(i))*away_from_zero(correction(i) - diagonal*b)
      end do
   end subroutine start_search_cells

   !> Add a later step to the image and form its search direction: image = image + length response + coarse part;
   !> search = correction - diagonal image + beta search on N.
   pure subroutine search_cells(n, diagonal, length, beta, coarse, correction, response, image, search)
      integer, intent(in) :: n
      real(sp), intent(in) :: diagonal, length, beta
      real(sp), intent(in) :: coarse(n), correction(n)
      real(sp), intent(in) :: response(n)
      real(sp), intent(inout) :: image(n)
      real(sp), intent(inout) :: search(n)
      real(sp) :: b
      integer :: i

      !$omp simd private(b)
      do i = 1, n
         b = image(i) + length*response(i) + coarse(i)
         image(i) = b
         search(i) = acts(search(i))*away_from_zero(correction(i) - diagonal*b + beta*search(i))
      end do
   end subroutine search_cells

   !> Compute response = K search, with the sums on N.
   pure subroutine response_cells(n, centre, weights, south, search, north, image, response, column, sums)
      integer, intent(in) :: n
      real(sp), intent(in) :: centre(n), weights(2)
      real(sp), intent(in) :: south(n), search(0:n + 1), north(n)
      real(sp), intent(in) :: image(n)
      real(sp), intent(inout) :: response(n)
      real(sp), intent(inout) :: column(n)          !! sums of the response on N over the rows of a block
      type(response_sums_type), intent(inout) :: sums
      real(sp) :: wx, wy, form, cross, square, e, f
      integer :: i

      wx = weights(1)
      wy = weights(2)
      form = 0.0_sp
      cross = 0.0_sp
      square = 0.0_sp
      !$omp simd reduction(+:form, cross, square) private(e, f)
      do i = 1, n
         e = centre(i)*search(i) - wx*(search(i - 1) + search(i + 1)) - wy*(south(i) + north(i))
         f = acts(search(i))*e
         response(i) = e
         column(i) = column(i) + f
         form = form + search(i)*e
         cross = cross + f*image(i)
         square = square + f*f
      end do
      sums%form = sums%form + form
      sums%cross = sums%cross + cross
      sums%square = sums%square + square
   end subroutine response_cells

   !> Compute response = K search for the last step, of which only the sum d e is needed.
   pure subroutine last_response_cells(n, centre, weights, south, search, north, response, sums)
      integer, intent(in) :: n
      real(sp), intent(in) :: centre(n), weights(2)
      real(sp), intent(in) :: south(n), search(0:n + 1), north(n)
      real(sp), intent(inout) :: response(n)
      type(response_sums_type), intent(inout) :: sums
      real(sp) :: wx, wy, form, e
      integer :: i

      wx = weights(1)
      wy = weights(2)
      form = 0.0_sp
      !$omp simd reduction(+:form) private(e)
      do i = 1, n
         e = centre(i)*search(i) - wx*(search(i - 1) + search(i + 1)) - wy*(south(i) + north(i))
         response(i) = e
         form = form + search(i)*e
      end do
      sums%form = sums%form + form
   end subroutine last_response_cells

   !> 1 on N, where the residual is 0, and 0 on S.
   elemental function off(residual)
      real(sp), intent(in) :: residual
      real(sp) :: off

      off = 1.0_sp - acts(residual)
   end function off

   !> 1 where a value is not 0, and 0 elsewhere, without a branch.
   elemental function acts(value)
      real(sp), intent(in) :: value
      real(sp) :: acts

      acts = 0.5_sp + sign(0.5_sp, abs(value) - tiny(1.0_sp))
   end function acts

   !> A value that is not 0, and else the given one: the search direction must not be 0 on N.
   elemental function away_from_zero(value)
      real(sp), intent(in) :: value
      real(sp) :: away_from_zero

      away_from_zero = sign(max(abs(value), tiny(1.0_sp)), value)
   end function away_from_zero

end module schur_sweeps
