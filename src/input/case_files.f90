!> The files of a case: the default name of its result, and the files that the result would overwrite.
module case_files
   use asperity_errors, only : error_input, error_type, fail
   use case_settings, only : case_type
   use path_identity, only : same_file
   use result_names, only : side_file, side_files
   implicit none
   private

   public :: default_result, refuse_overwriting

contains

   !> Refuse a result that would overwrite a file of the case.
   subroutine refuse_overwriting(case, error)
      type(case_type), intent(in) :: case
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: what, name

      what = overwritten_file(case)
      if (what == '') return
      name = trim(case%output%file)
      if (name == default_result(case%path)) name = name//', which is named after the input,'
      call fail(error, error_input, case%path//': the result '//name//' would overwrite '//what// &
         ': give it another name with &output: file or --output')
   end subroutine refuse_overwriting

   !> The file that the result, or a file beside it, would overwrite: the input, a height map, or '' for
   !> neither.
   function overwritten_file(case) result(what)
      type(case_type), intent(in) :: case
      character(:), allocatable :: what
      integer :: n

      what = ''
      if (case%output%file == '') return
      what = used_file(case, trim(case%output%file))
      do n = 1, side_files
         if (what == '') what = used_file(case, side_file(case%output%file, n))
      end do
   end function overwritten_file

   !> The purpose for which a case reads a file of this name: the input, a height map, or '' if it does not.
   function used_file(case, name) result(what)
      type(case_type), intent(in) :: case
      character(*), intent(in) :: name
      character(:), allocatable :: what
      integer :: i

      what = ''
      if (same_file(name, case%path)) what = 'the input'
      do i = 1, size(case%surfaces)
         if (case%surfaces(i)%file == '') cycle
         if (same_file(name, case%surfaces(i)%file)) what = 'the height map of a &surface'
      end do
   end function used_file

   !> The input's path with .h5 in place of its ending.
   pure function default_result(path) result(file)
      character(*), intent(in) :: path
      character(:), allocatable :: file
      integer :: point, slash

      slash = index(path, '/', back=.true.)
      point = index(path, '.', back=.true.)
      if (point > slash + 1) then
         file = path(:point - 1)//'.h5'
      else
         file = path//'.h5'
      end if
   end function default_result

end module case_files
