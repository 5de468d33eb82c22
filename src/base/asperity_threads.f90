!> The number of threads: how many the environment allows, and how many are in use.
module asperity_threads
   use omp_lib, only : omp_get_max_threads, omp_get_num_procs, omp_pause_hard, &
      omp_pause_resource_all, omp_set_num_threads
   use asperity_parallel, only : processes_of_machine
   implicit none
   private

   public :: processor_count, release_threads, set_threads, thread_count

   integer, parameter, public :: least_parallel_cells = 16384   !! of a field; below, one thread is faster

contains

   !> Use `n` threads from now on. With 0 the environment decides: OMP_NUM_THREADS, or else
   !> SLURM_CPUS_PER_TASK, which Slurm sets for a task. If neither is set, all processors are used, shared
   !> equally with the other processes of this run on this machine.
   subroutine set_threads(n)
      integer, intent(in) :: n      !! threads; 0: as the environment decides

      if (n > 0) then
         call omp_set_num_threads(n)
      else
         call omp_set_num_threads(threads_of_environment())
      end if
   end subroutine set_threads

   !> Number of threads that the environment requests. If a launcher binds each process to certain
   !> processors, these count and not those of the whole machine.
   function threads_of_environment() result(n)
      integer :: n

      n = number_in_environment('OMP_NUM_THREADS')
      if (n == 0) n = number_in_environment('SLURM_CPUS_PER_TASK')
      if (n == 0) n = max(1, omp_get_num_procs()/processes_of_machine())
   end function threads_of_environment

   !> The number with which a variable of the environment begins (OMP_NUM_THREADS may be a list with a
   !> number for each level); 0 if there is none.
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

   !> End the idle threads; the next parallel region starts new ones. This is necessary before a fork:
   !> the copy has only the thread that made it, and would wait for the others for ever.
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

end module asperity_threads
