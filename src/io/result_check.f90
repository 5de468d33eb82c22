!> Finds damage in a result: parts that do not agree with their checksums or cannot be read.
!>
!> Fields and vectors have HDF5's checksums (Fletcher's, of each block). The rows of the history
!> have those of the module `result_history`.
module result_check
   use asperity_errors, only : error_type
   use hdf5_file, only : hdf5_file_type
   use asperity_precision, only : dp
   use result_history, only : damaged_rows, has_checksums
   implicit none
   private

   public :: damage_type, find_damage

   real(dp), parameter :: most_bytes = 2.0_dp**30   !! of fields that are read, 8 bytes per value

   !> The damage that was found.
   type :: damage_type
      character(:), allocatable :: names            !! of damaged parts, one line per part
      integer :: parts = 0                          !! number of damaged parts
      integer :: left_out = 0                       !! number of snapshots that were not read
   end type damage_type

contains

   !> Read a whole result. Of the snapshots only the latest are read, up to `most_bytes`.
   subroutine find_damage(file, found)
      type(hdf5_file_type), intent(inout) :: file
      type(damage_type), intent(out) :: found
      type(error_type), allocatable :: error
      character(256), allocatable :: names(:)
      character(:), allocatable :: text
      real(dp) :: bytes
      integer :: i

      found%names = ''
      bytes = 0.0_dp
      if (has_checksums(file)) then
         call damaged_rows(file%path, text, error)
         if (allocated(error)) text = 'cannot be read'
         if (text /= '') call add(found, '/history: '//text)
      end if
      call read_group('/grid')
      call read_group('/surface')
      call read_group('/material')
      call list('/losses')
      do i = 1, size(names)
         call read_group('/losses/'//trim(names(i)))
      end do
      call list('/snapshots')
      do i = size(names), 1, -1
         if (bytes > most_bytes) then
            found%left_out = i
            exit
         end if
         call read_group('/snapshots/'//trim(names(i)))
      end do

   contains

      !> The names in a group; none if there is no such group.
      subroutine list(path)
         character(*), intent(in) :: path
         type(error_type), allocatable :: fault

         if (allocated(names)) deallocate (names)
         if (file%has(path)) call file%members(path, names, fault)
         if (allocated(fault)) call add(found, path)
         if (.not. allocated(names)) allocate (names(0))
      end subroutine list

      !> Read the datasets of a group.
      subroutine read_group(path)
         character(*), intent(in) :: path
         character(256), allocatable :: members(:)
         type(error_type), allocatable :: fault
         integer :: k

         if (.not. file%has(path)) return
         call file%members(path, members, fault)
         if (allocated(fault)) then
            call add(found, path)
            return
         end if
         do k = 1, size(members)
            call read_dataset(path//'/'//trim(members(k)))
         end do
      end subroutine read_group

      !> Read a dataset and discard its values.
      subroutine read_dataset(path)
         character(*), intent(in) :: path
         type(error_type), allocatable :: fault
         real(dp), allocatable :: vector(:), field(:, :)
         integer, allocatable :: extent(:)
         real(dp) :: value

         call file%dataset_shape(path, extent, fault)
         if (.not. allocated(fault)) then
            bytes = bytes + 8.0_dp*product(real(extent, dp))
            select case (size(extent))
            case (0)
               call file%read(path, value, fault)
            case (1)
               call file%read(path, vector, fault)
            case (2)
               call file%read(path, field, fault)
            end select
         end if
         if (allocated(fault)) call add(found, path)
      end subroutine read_dataset

   end subroutine find_damage

   !> Note a damaged part.
   subroutine add(found, name)
      type(damage_type), intent(inout) :: found
      character(*), intent(in) :: name

      found%parts = found%parts + 1
      if (found%names /= '') found%names = found%names//new_line('a')
      found%names = found%names//name
   end subroutine add

end module result_check
