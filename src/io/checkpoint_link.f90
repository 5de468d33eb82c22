!> The link /checkpoint of a result, by which readers of the result find the checkpoint of its run.
!>
!> The checkpoint is a file of its own, because it is replaced as a whole each time it is written. The
!> result holds an external link to it. The link exists only while the run can be continued.
module checkpoint_link
   use asperity_errors, only : error_type
   use file_system, only : name_of
   use hdf5_file, only : hdf5_file_type
   use result_names, only : checkpoint_path
   implicit none
   private

   public :: add_link, remove_link

   character(*), parameter :: link = '/checkpoint'

contains

   !> Add the link, if the result does not have it.
   subroutine add_link(file, path, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path      !! name of the result, which need not be that of the open file
      type(error_type), allocatable, intent(out), optional :: error

      if (file%has_link(link)) return
      call file%link_external(link, name_of(checkpoint_path(path)), '/')
      call file%flush(error)
   end subroutine add_link

   !> Remove the link, if the result has it.
   subroutine remove_link(file, error)
      type(hdf5_file_type), intent(inout) :: file
      type(error_type), allocatable, intent(out), optional :: error

      if (.not. file%has_link(link)) return
      call file%remove(link)
      call file%flush(error)
   end subroutine remove_link

end module checkpoint_link
