!> Rows of other processes that this one needs beside its own.
!>
!> A field with room for them has its own rows first, then those of others: [n, own + foreign]. `fetch` brings
!> them. Which rows these are is known beforehand, so that nothing else is exchanged.
module row_halo
   use asperity_parallel, only : exchange, process_count, process_number
   use asperity_precision, only : dp
   use row_sharing, only : row_sharing_type
   implicit none
   private

   public :: new_row_halo, row_halo_type

   !> The places of rows in a field with room for foreign ones.
   type :: row_halo_type
      integer :: own = 0                   !! rows of this process
      integer :: foreign = 0               !! rows of others that it needs
      integer, allocatable :: place(:)     !! of each row of the whole field; 0: it is not here
      logical, private :: shared = .false.
      integer, allocatable, private :: receive_counts(:)   !! rows from each process
      integer, allocatable, private :: send_counts(:)      !! rows for each process ...
      integer, allocatable, private :: sent(:)             !! ... and their places
   contains
      procedure :: fetch
   end type row_halo_type

contains

   !> Prepare for rows that are needed by processes: row rows(k) by process users(k). Pairs may be repeated,
   !> and processes need not be told of their own rows. All processes must give the same pairs.
   pure subroutine new_row_halo(self, sharing, rows, users)
      type(row_halo_type), intent(out) :: self
      type(row_sharing_type), intent(in) :: sharing
      integer, intent(in) :: rows(:)
      integer, intent(in) :: users(:)      !! process, from 0
      logical :: needed(size(sharing%owner))
      integer :: j, p, me

      self%shared = sharing%shared
      self%own = size(sharing%own)
      allocate (self%place(size(sharing%owner)), source=0)
      self%place(sharing%own) = [(j, j=1, self%own)]
      if (.not. self%shared) return
      me = process_number()
      allocate (self%receive_counts(process_count()), self%send_counts(process_count()), source=0)
      allocate (self%sent(0))
      do p = 0, process_count() - 1
         if (p == me) cycle
         needed = .false.
         needed(pack(rows, users == p)) = .true.
         needed = needed .and. sharing%owner == me
         self%send_counts(p + 1) = count(needed)
         self%sent = [self%sent, pack(self%place, needed)]
      end do
      do p = 0, process_count() - 1
         if (p == me) cycle
         needed = .false.
         needed(pack(rows, users == me)) = .true.
         needed = needed .and. sharing%owner == p
         self%receive_counts(p + 1) = count(needed)
         do j = 1, size(needed)
            if (.not. needed(j)) cycle
            self%foreign = self%foreign + 1
            self%place(j) = self%own + self%foreign
         end do
      end do
   end subroutine new_row_halo

   !> Bring the foreign rows of a field. Collective.
   subroutine fetch(self, field)
      class(row_halo_type), intent(in) :: self
      real(dp), intent(inout) :: field(:, :)       !! [n, own + foreign]
      real(dp), allocatable :: parcel(:), received(:)
      integer :: n

      if (.not. self%shared) return
      n = size(field, 1)
      parcel = reshape(field(:, self%sent), [n*size(self%sent)])
      allocate (received(n*self%foreign))
      call exchange(parcel, n*self%send_counts, received, n*self%receive_counts)
      field(:, self%own + 1:self%own + self%foreign) = reshape(received, [n, self%foreign])
   end subroutine fetch

end module row_halo
