!> Copies of fields, made by several threads: a copy is limited by the memory, and one thread does not use all of
!> its speed.
module field_copies
   use asperity_precision, only : dp
   use field_sums, only : threads_for
   implicit none
   private

   public :: copy_field, new_copy

   !> Copy a field to another of the same shape.
   interface copy_field
      module procedure :: copy_scalars, copy_vectors
   end interface copy_field

   !> Allocate a copy of a field. If there is not enough memory, `status` is not 0.
   interface new_copy
      module procedure :: new_copy_of_scalars, new_copy_of_vectors
   end interface new_copy

contains

   !> Copy a field of numbers.
   subroutine copy_scalars(from, to)
      real(dp), intent(in) :: from(:, :)               !! [nx, rows of this process]
      real(dp), intent(inout) :: to(:, :)
      integer :: j

      !$omp parallel do default(none) shared(from, to) private(j) num_threads(threads_for(from))
      do j = 1, size(from, 2)
         to(:, j) = from(:, j)
      end do
   end subroutine copy_scalars

   !> Copy a field of vectors.
   subroutine copy_vectors(from, to)
      real(dp), intent(in) :: from(:, :, :)            !! [nx, components, rows of this process]
      real(dp), intent(inout) :: to(:, :, :)
      integer :: j

      !$omp parallel do default(none) shared(from, to) private(j) num_threads(threads_for(from(:, 1, :)))
      do j = 1, size(from, 3)
         to(:, :, j) = from(:, :, j)
      end do
   end subroutine copy_vectors

   !> Allocate a copy of a field of numbers.
   subroutine new_copy_of_scalars(from, to, status)
      real(dp), intent(in) :: from(:, :)
      real(dp), allocatable, intent(out) :: to(:, :)
      integer, intent(out) :: status

      allocate (to, mold=from, stat=status)
      if (status == 0) call copy_field(from, to)
   end subroutine new_copy_of_scalars

   !> Allocate a copy of a field of vectors.
   subroutine new_copy_of_vectors(from, to, status)
      real(dp), intent(in) :: from(:, :, :)
      real(dp), allocatable, intent(out) :: to(:, :, :)
      integer, intent(out) :: status

      allocate (to, mold=from, stat=status)
      if (status == 0) call copy_field(from, to)
   end subroutine new_copy_of_vectors

end module field_copies
