!> Exchange of fields between processes: parts of arrays, and values for the files.
!>
!> This module and `asperity_parallel` are the only ones that call MPI. The rules of `asperity_parallel` for
!> collective procedures hold here, too. Without MPI an exchange copies the values or does nothing.
module process_exchange
   use asperity_parallel, only : count_sent, is_first_process, process_number
   use asperity_precision, only : dp, int8, sp
#ifdef ASPERITY_MPI
   use mpi_f08, only : mpi_alltoallv, mpi_comm_world, mpi_datatype, mpi_double_complex, mpi_double_precision, &
      mpi_integer1, mpi_real, mpi_recv, mpi_send, mpi_status_ignore
#endif
   implicit none
   private

   public :: exchange, hand_to_first, take_from_first

   ! An exchange of a field takes place in rounds, so that the parcels (the numbers that are sent at once) take little
   ! memory.
   integer, parameter, public :: least_parcel = 65536   !! numbers below which a parcel is not divided
   integer, parameter, public :: most_rounds = 16

   !> Send every process its part of an array, and receive the parts that the others have for this one. The
   !> parts lie one after the other in the order of the processes.
   interface exchange
      module procedure :: exchange_complex, exchange_complex_single, exchange_real, exchange_real_single
   end interface exchange

   !> Bring values of one process to the first one, which writes files.
   interface hand_to_first
      module procedure :: hand_reals, hand_bytes
   end interface hand_to_first

contains

   !> Exchange complex numbers.
   subroutine exchange_complex(send, send_counts, receive, receive_counts)
      complex(dp), intent(in), contiguous :: send(:)
      integer, intent(in) :: send_counts(:)        !! for each process
      complex(dp), intent(inout), contiguous :: receive(:)
      integer, intent(in) :: receive_counts(:)     !! from each process

      call exchange_values(send, send_counts, receive, receive_counts, 16)
   end subroutine exchange_complex

   !> Exchange complex numbers in single precision.
   subroutine exchange_complex_single(send, send_counts, receive, receive_counts)
      complex(sp), intent(in), contiguous :: send(:)
      integer, intent(in) :: send_counts(:)        !! for each process
      complex(sp), intent(inout), contiguous :: receive(:)
      integer, intent(in) :: receive_counts(:)     !! from each process

      call exchange_values(send, send_counts, receive, receive_counts, 8)
   end subroutine exchange_complex_single

   !> Exchange real numbers.
   subroutine exchange_real(send, send_counts, receive, receive_counts)
      real(dp), intent(in), contiguous :: send(:)
      integer, intent(in) :: send_counts(:)        !! for each process
      real(dp), intent(inout), contiguous :: receive(:)
      integer, intent(in) :: receive_counts(:)     !! from each process

      call exchange_values(send, send_counts, receive, receive_counts, 8)
   end subroutine exchange_real

   !> Exchange real numbers in single precision.
   subroutine exchange_real_single(send, send_counts, receive, receive_counts)
      real(sp), intent(in), contiguous :: send(:)
      integer, intent(in) :: send_counts(:)        !! for each process
      real(sp), intent(inout), contiguous :: receive(:)
      integer, intent(in) :: receive_counts(:)     !! from each process

      call exchange_values(send, send_counts, receive, receive_counts, 4)
   end subroutine exchange_real_single

   !> Exchange values of any type; one process alone has nothing to exchange.
   subroutine exchange_values(send, send_counts, receive, receive_counts, bytes)
      type(*), intent(in) :: send(*)
      integer, intent(in) :: send_counts(:)        !! for each process
      type(*), intent(inout) :: receive(*)
      integer, intent(in) :: receive_counts(:)     !! from each process
      integer, intent(in) :: bytes                 !! of a value: 4, 8 or 16
#ifdef ASPERITY_MPI
      type(mpi_datatype) :: kind

      kind = mpi_double_precision
      if (bytes == 4) kind = mpi_real
      if (bytes == 16) kind = mpi_double_complex
      call count_sent((sum(real(send_counts, dp)) - send_counts(process_number() + 1))*bytes)
      call mpi_alltoallv(send, send_counts, starts_of(send_counts), kind, &
         receive, receive_counts, starts_of(receive_counts), kind, mpi_comm_world)
#endif
   end subroutine exchange_values

#ifdef ASPERITY_MPI
   !> Where parts that lie one after the other begin.
   pure function starts_of(counts) result(starts)
      integer, intent(in) :: counts(:)
      integer :: starts(size(counts))
      integer :: p

      starts(1) = 0
      do p = 2, size(counts)
         starts(p) = starts(p - 1) + counts(p - 1)
      end do
   end function starts_of
#endif

   !> Bring numbers from a process to the first one: only these two take part, and any other returns at once.
   subroutine hand_reals(from, values)
      integer, intent(in) :: from                  !! the process that has them
      real(dp), intent(inout), contiguous :: values(:, :)
#ifdef ASPERITY_MPI
      if (from == 0) return
      if (process_number() == from) call mpi_send(values, size(values), mpi_double_precision, 0, 1, mpi_comm_world)
      if (is_first_process()) call mpi_recv(values, size(values), mpi_double_precision, from, 1, mpi_comm_world, &
         mpi_status_ignore)
#endif
   end subroutine hand_reals

   !> Bring small integers from a process to the first one: only these two take part.
   subroutine hand_bytes(from, values)
      integer, intent(in) :: from
      integer(int8), intent(inout), contiguous :: values(:, :)
#ifdef ASPERITY_MPI
      if (from == 0) return
      if (process_number() == from) call mpi_send(values, size(values), mpi_integer1, 0, 1, mpi_comm_world)
      if (is_first_process()) call mpi_recv(values, size(values), mpi_integer1, from, 1, mpi_comm_world, &
         mpi_status_ignore)
#endif
   end subroutine hand_bytes

   !> Bring numbers from the first process to another one: only these two take part.
   subroutine take_from_first(to, values)
      integer, intent(in) :: to                    !! the process that needs them
      real(dp), intent(inout), contiguous :: values(:, :)
#ifdef ASPERITY_MPI
      if (to == 0) return
      if (is_first_process()) call mpi_send(values, size(values), mpi_double_precision, to, 2, mpi_comm_world)
      if (process_number() == to) call mpi_recv(values, size(values), mpi_double_precision, 0, 2, mpi_comm_world, &
         mpi_status_ignore)
#endif
   end subroutine take_from_first

end module process_exchange
