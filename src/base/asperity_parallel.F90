!> Processes, and numbers that all of them need. Only this module and `process_exchange`, which moves parts of
!> fields, call MPI.
!>
!> Built with the macro ASPERITY_MPI, the program runs as several processes, started by mpirun or srun,
!> that share the rows of the grid (module `regular_grid`). Without the macro, and in a program that does not
!> call `start_processes`, there is one process, and every exchange is a copy or nothing.
!>
!> All processes do the same work in the same order, each on its own rows. Everything below from
!> `global_sum` on is collective: it waits until every process has called it. Never call it in a branch that only
!> some processes take, nor from several threads at once.
!>
!> Results do not depend on the number of processes. Therefore MPI never adds numbers that round, because it
!> may add them in any order: `gather_rows` brings the sums of all rows to every process, which adds them
!> itself in the order of the rows (module `field_sums`).
module asperity_parallel
#ifdef ASPERITY_MPI
   use mpi_f08, only : mpi_allgather, mpi_allgatherv, mpi_allreduce, mpi_bcast, mpi_character, mpi_comm, &
      mpi_comm_free, mpi_comm_rank, mpi_comm_size, mpi_comm_split_type, mpi_comm_type_shared, mpi_comm_world, &
      mpi_double_precision, mpi_finalize, mpi_get_library_version, mpi_in_place, mpi_info_null, mpi_init_thread, &
      mpi_integer, mpi_integer8, mpi_logical, mpi_lor, mpi_max, mpi_max_library_version_string, mpi_min, mpi_sum, &
      mpi_thread_serialized
#endif
   use asperity_precision, only : dp, int64
   implicit none
   private

   public :: any_process, count_sent, end_processes, exchanged_bytes, gather_rows, global_max, global_min, global_sum, &
      is_first_process, on_any_process, parallel_library, process_count, process_number, processes_of_machine, &
      rows_before, share, start_processes

   !> Elementwise sum over the processes, of counts or of numbers of which all but one are 0: both are exact.
   interface global_sum
      module procedure :: global_sum_vector, global_sum_integer
   end interface global_sum

   !> Give all processes the value of the first one.
   interface share
      module procedure :: share_integer, share_long, share_real, share_reals, share_logical, share_text
   end interface share

   logical :: joined = .false.           !! true from `start_processes` to `end_processes`
   integer :: processes = 1              !! number of processes
   integer :: number = 0                 !! of this process, from 0
   integer :: neighbours = 1             !! processes on this machine
   real(dp) :: sent = 0.0_dp             !! bytes that this process has sent to others

contains

   ! Processes.

   !> Join the other processes of this run. Call this once, before anything else.
   subroutine start_processes()
#ifdef ASPERITY_MPI
      integer :: provided
      type(mpi_comm) :: machine

      call mpi_init_thread(mpi_thread_serialized, provided)
      call mpi_comm_size(mpi_comm_world, processes)
      call mpi_comm_rank(mpi_comm_world, number)
      call mpi_comm_split_type(mpi_comm_world, mpi_comm_type_shared, 0, mpi_info_null, machine)
      call mpi_comm_size(machine, neighbours)
      call mpi_comm_free(machine)
      joined = .true.
#endif
   end subroutine start_processes

   !> Leave the other processes. Every process must call this; later calls exchange nothing.
   subroutine end_processes()
#ifdef ASPERITY_MPI
      if (joined) call mpi_finalize()
      joined = .false.
      processes = 1
#endif
   end subroutine end_processes

   !> Number of processes of this run.
   pure integer function process_count()
      process_count = processes
   end function process_count

   !> Number of processes of this run on this machine.
   pure integer function processes_of_machine()
      processes_of_machine = neighbours
   end function processes_of_machine

   !> Number of this process, from 0.
   pure integer function process_number()
      process_number = number
   end function process_number

   !> Is this the process that reads and writes files?
   pure logical function is_first_process()
      is_first_process = number == 0
   end function is_first_process

   !> The MPI library that the program was built with, '' without MPI.
   function parallel_library() result(text)
      character(:), allocatable :: text
#ifdef ASPERITY_MPI
      character(mpi_max_library_version_string) :: version
      integer :: length, last

      call mpi_get_library_version(version, length)
      last = scan(version(:length), ','//new_line('a')//achar(0)) - 1
      if (last < 0) last = length
      text = version(:last)
#else
      text = ''
#endif
   end function parallel_library

   !> Number of bytes that all processes have sent to each other so far: parts of fields and numbers for
   !> rows. Collective.
   function exchanged_bytes() result(bytes)
      real(dp) :: bytes

      bytes = sent
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, bytes, 1, mpi_double_precision, mpi_sum, &
         mpi_comm_world)
#endif
   end function exchanged_bytes

   !> Add to the number of bytes that this process has sent to others.
   subroutine count_sent(bytes)
      real(dp), intent(in) :: bytes

      sent = sent + bytes
   end subroutine count_sent

   ! Numbers that all processes need. Collective.

   !> Elementwise sums over the processes, each of numbers of which all but one are 0.
   function global_sum_vector(local) result(total)
      real(dp), intent(in) :: local(:)
      real(dp) :: total(size(local))

      total = local
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, total, size(total), mpi_double_precision, mpi_sum, &
         mpi_comm_world)
#endif
   end function global_sum_vector

   !> Sum of a count over the processes.
   function global_sum_integer(local) result(total)
      integer, intent(in) :: local
      integer :: total

      total = local
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, total, 1, mpi_integer, mpi_sum, mpi_comm_world)
#endif
   end function global_sum_integer

   !> Largest of the local maxima.
   function global_max(local) result(largest)
      real(dp), intent(in) :: local
      real(dp) :: largest

      largest = local
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, largest, 1, mpi_double_precision, mpi_max, &
         mpi_comm_world)
#endif
   end function global_max

   !> Smallest of the local minima.
   function global_min(local) result(least)
      real(dp), intent(in) :: local
      real(dp) :: least

      least = local
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, least, 1, mpi_double_precision, mpi_min, &
         mpi_comm_world)
#endif
   end function global_min

   !> Does a condition hold on any process?
   function any_process(condition) result(any)
      logical, intent(in) :: condition
      logical :: any

      any = condition
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, any, 1, mpi_logical, mpi_lor, mpi_comm_world)
#endif
   end function any_process

   !> The conditions that hold on any process, one by one.
   function on_any_process(conditions) result(anywhere)
      logical, intent(in) :: conditions(:, :)      !! the same shape on all processes
      logical :: anywhere(size(conditions, 1), size(conditions, 2))

      anywhere = conditions
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_allreduce(mpi_in_place, anywhere, size(anywhere), mpi_logical, mpi_lor, &
         mpi_comm_world)
#endif
   end function on_any_process

   !> Collect the numbers of each row from all processes, in the order of the rows.
   function gather_rows(local) result(whole)
      real(dp), intent(in) :: local(:, :)          !! [numbers, rows of this process]
      real(dp), allocatable :: whole(:, :)         !! [numbers, all rows]
#ifdef ASPERITY_MPI
      integer :: counts(processes), starts(processes), p

      if (processes > 1) then
         call mpi_allgather(size(local), 1, mpi_integer, counts, 1, mpi_integer, mpi_comm_world)
         starts(1) = 0
         do p = 2, processes
            starts(p) = starts(p - 1) + counts(p - 1)
         end do
         allocate (whole(size(local, 1), sum(counts)/size(local, 1)))
         sent = sent + 8.0_dp*size(local)*(processes - 1)
         call mpi_allgatherv(local, size(local), mpi_double_precision, whole, counts, starts, &
            mpi_double_precision, mpi_comm_world)
         return
      end if
#endif
      whole = local
   end function gather_rows

   !> Number of rows that the processes before this one hold.
   function rows_before(rows) result(before)
      integer, intent(in) :: rows                  !! of this process
      integer :: before
#ifdef ASPERITY_MPI
      integer :: counts(processes)

      if (processes > 1) then
         call mpi_allgather(rows, 1, mpi_integer, counts, 1, mpi_integer, mpi_comm_world)
         before = sum(counts(:number))
         return
      end if
#endif
      before = 0*rows                              ! without MPI the compiler would warn of an unused argument
   end function rows_before

   !> Give all processes an integer of the first one.
   subroutine share_integer(value)
      integer, intent(inout) :: value
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_bcast(value, 1, mpi_integer, 0, mpi_comm_world)
#endif
   end subroutine share_integer

   !> Give all processes a long integer of the first one.
   subroutine share_long(value)
      integer(int64), intent(inout) :: value
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_bcast(value, 1, mpi_integer8, 0, mpi_comm_world)
#endif
   end subroutine share_long

   !> Give all processes a number of the first one.
   subroutine share_real(value)
      real(dp), intent(inout) :: value
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_bcast(value, 1, mpi_double_precision, 0, mpi_comm_world)
#endif
   end subroutine share_real

   !> Give all processes an array of the first one, which has the same size on all of them.
   subroutine share_reals(values)
      real(dp), intent(inout), contiguous :: values(:)
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_bcast(values, size(values), mpi_double_precision, 0, mpi_comm_world)
#endif
   end subroutine share_reals

   !> Give all processes a condition of the first one.
   subroutine share_logical(value)
      logical, intent(inout) :: value
#ifdef ASPERITY_MPI
      if (processes > 1) call mpi_bcast(value, 1, mpi_logical, 0, mpi_comm_world)
#endif
   end subroutine share_logical

   !> Give all processes a text of the first one.
   subroutine share_text(text)
      character(:), allocatable, intent(inout) :: text
#ifdef ASPERITY_MPI
      integer :: length

      if (processes == 1) return
      length = -1
      if (is_first_process() .and. allocated(text)) length = len(text)
      call share_integer(length)
      if (.not. is_first_process()) then
         if (allocated(text)) deallocate (text)
         if (length >= 0) allocate (character(length) :: text)
      end if
      if (length > 0) call mpi_bcast(text, length, mpi_character, 0, mpi_comm_world)
#endif
   end subroutine share_text

end module asperity_parallel
