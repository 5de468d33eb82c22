!> Threads, and the reductions over the processes of a run.
!>
!> A run is one process today. Everything that sums, compares or splits over the whole grid goes
!> through here, so that a slab decomposition in rows changes this module and not its users.
module asperity_parallel
   use omp_lib, only : omp_get_max_threads, omp_get_num_procs, omp_pause_hard, &
      omp_pause_resource_all, omp_set_num_threads
   use asperity_precision, only : dp
   implicit none
   private

   public :: global_sum, global_max, global_min, local_rows, release_threads, set_threads, &
      thread_count, processor_count

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

   !> Use `n` threads from here on. 0 takes what the environment asks for: OMP_NUM_THREADS, or what
   !> Slurm grants a task, SLURM_CPUS_PER_TASK; without them all processors.
   subroutine set_threads(n)
      integer, intent(in) :: n

      if (n > 0) then
         call omp_set_num_threads(n)
      else
         call omp_set_num_threads(threads_of_environment())
      end if
   end subroutine set_threads

   !> Number of threads that the environment asks for.
   function threads_of_environment() result(n)
      integer :: n

      n = number_in_environment('OMP_NUM_THREADS')
      if (n == 0) n = number_in_environment('SLURM_CPUS_PER_TASK')
      if (n == 0) n = omp_get_num_procs()
   end function threads_of_environment

   !> The number that a variable of the environment starts with (a list of OpenMP has one for each
   !> level); 0 where it has none.
   function number_in_environment(name) result(n)
      character(*), intent(in) :: name
      integer :: n
      character(80) :: text
      integer :: length, status

      n = 0
      call get_environment_variable(name, text, status=status)
      if (status /= 0) return
      text = adjustl(text)
      length = verify(text, '0123456789') - 1
      if (length < 1 .or. length > 6) return
      read (text(:length), *, iostat=status) n
      if (status /= 0) n = 0
   end function number_in_environment

   !> End the idle threads; the next parallel region starts new ones. A copy of a process (fork) has
   !> only the thread that made it: with the others it would wait for ever.
   subroutine release_threads()
      integer :: status

      status = omp_pause_resource_all(omp_pause_hard)
   end subroutine release_threads

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

end module asperity_parallel
