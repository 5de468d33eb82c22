!> Threads, and the reductions over the processes of a run.
!>
!> A run is one process today. Everything that sums, compares or splits over the whole grid goes
!> through here, so that a slab decomposition in rows changes this module and not its users.
module parallel
   use omp_lib, only : omp_get_max_threads, omp_get_num_procs, omp_set_num_threads
   use precision, only : dp
   implicit none
   private

   public :: global_sum, global_max, global_min, local_rows, set_threads, thread_count, &
      processor_count

   !> Sum over all processes.
   interface global_sum
      module procedure :: global_sum_scalar, global_sum_vector, global_sum_integer
   end interface global_sum

contains

   !> Sum of a local sum over all processes.
   pure function global_sum_scalar(local) result(total)
      real(dp), intent(in) :: local
      real(dp) :: total

      total = local
   end function global_sum_scalar

   !> Sums of several local sums over all processes, in one exchange.
   pure function global_sum_vector(local) result(total)
      real(dp), intent(in) :: local(:)
      real(dp) :: total(size(local))

      total = local
   end function global_sum_vector

   !> Sum of a local count over all processes.
   pure function global_sum_integer(local) result(total)
      integer, intent(in) :: local
      integer :: total

      total = local
   end function global_sum_integer

   !> Largest of the local maxima.
   pure function global_max(local) result(total)
      real(dp), intent(in) :: local
      real(dp) :: total

      total = local
   end function global_max

   !> Smallest of the local minima.
   pure function global_min(local) result(total)
      real(dp), intent(in) :: local
      real(dp) :: total

      total = local
   end function global_min

   !> This process's rows of a grid of `ny` rows.
   pure subroutine local_rows(ny, first, last)
      integer, intent(in) :: ny        !! rows of the whole grid
      integer, intent(out) :: first    !! first row here, from 1
      integer, intent(out) :: last     !! last row here

      first = 1
      last = ny
   end subroutine local_rows

   !> Use `n` threads from here on; 0 takes all processors.
   subroutine set_threads(n)
      integer, intent(in) :: n

      if (n > 0) then
         call omp_set_num_threads(n)
      else
         call omp_set_num_threads(omp_get_num_procs())
      end if
   end subroutine set_threads

   !> Number of threads in use.
   function thread_count() result(n)
      integer :: n

      n = omp_get_max_threads()
   end function thread_count

   !> Number of processors of this machine.
   function processor_count() result(n)
      integer :: n

      n = omp_get_num_procs()
   end function processor_count

end module parallel
