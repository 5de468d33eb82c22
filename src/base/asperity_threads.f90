!> Threads: how many there are, and how many are in use.
module asperity_threads
   use omp_lib, only : omp_get_max_threads, omp_get_num_procs, omp_pause_hard, &
      omp_pause_resource_all, omp_set_num_threads
   use asperity_parallel, only : processes_of_machine
   implicit none
   private

   public :: processor_count, release_threads, set_threads, thread_count

contains

   !> Use `n` threads from here on. 0 takes what the environment asks for: OMP_NUM_THREADS, or what
   !> Slurm grants a task, SLURM_CPUS_PER_TASK; without them all processors, shared with the other processes
   !> of this machine.
   subroutine set_threads(n)
      integer, intent(in) :: n

      if (n > 0) then
         call omp_set_num_threads(n)
      else
         call omp_set_num_threads(threads_of_environment())
      end if
   end subroutine set_threads

   !> Number of threads that the environment asks for. A launcher may bind each process to processors of
   !> its own; then it has fewer than the machine.
   function threads_of_environment() result(n)
      integer :: n

      n = number_in_environment('OMP_NUM_THREADS')
      if (n == 0) n = number_in_environment('SLURM_CPUS_PER_TASK')
      if (n == 0) n = max(1, omp_get_num_procs()/processes_of_machine())
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

end module asperity_threads
