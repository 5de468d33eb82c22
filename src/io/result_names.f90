!> The names of the files that belong to a result.
module result_names
   implicit none
   private

   public :: checkpoint_path, sibling_path, side_file

   integer, parameter, public :: side_files = 6     !! files beside the result itself

contains

   !> Name of a file that belongs to a result: FILE without '.h5', with another ending.
   pure function sibling_path(path, ending) result(sibling)
      character(*), intent(in) :: path      !! name of the result
      character(*), intent(in) :: ending    !! such as '.xdmf'
      character(:), allocatable :: sibling
      integer :: length

      length = len_trim(path)
      if (length > 3) then
         if (path(length - 2:length) == '.h5') length = length - 3
      end if
      sibling = path(:length)//ending
   end function sibling_path

   !> Name of the checkpoint that belongs to a result.
   pure function checkpoint_path(path) result(name)
      character(*), intent(in) :: path      !! name of the result
      character(:), allocatable :: name

      name = sibling_path(path, '.checkpoint.h5')
   end function checkpoint_path

   !> Name of the file number `n` that a run writes beside a result, temporarily or permanently.
   pure function side_file(path, n) result(name)
      character(*), intent(in) :: path      !! name of the result
      integer, intent(in) :: n              !! 1 to side_files
      character(:), allocatable :: name

      select case (n)
      case (1)
         name = trim(path)//'.new'
      case (2)
         name = checkpoint_path(path)
      case (3)
         name = sibling_path(path, '.checkpoint.h5.new')
      case (4)
         name = sibling_path(path, '.xdmf')
      case (5)
         name = sibling_path(path, '.xdmf.new')
      case default
         name = sibling_path(path, '.lock')
      end select
   end function side_file

end module result_names
