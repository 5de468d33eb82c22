!> The page of the documentation that lists the input: the table of `input_reference` as Markdown.
module reference_page
   use input_reference, only : group_entries, group_entry_type, variable_entries, variable_entry_type
   implicit none
   private

   public :: reference_markdown

contains

   !> The whole table in Markdown.
   function reference_markdown() result(text)
      character(:), allocatable :: text
      type(group_entry_type), allocatable :: groups(:)
      type(variable_entry_type), allocatable :: variables(:)
      character(*), parameter :: nl = new_line('a')
      character(8), parameter :: kinds(7) = [character(8) :: 'integer', 'real', 'logical', 'string', &
         'string', 'reals', 'strings']
      integer :: i, j

      allocate (groups, source=group_entries())
      allocate (variables, source=variable_entries())
      text = '# Input reference'//nl//nl// &
         'An input file consists of Fortran namelists in any order; all numbers are in SI units.'//nl// &
         'A default in parentheses is computed from other settings, or there is none. In an interval a parenthesis excludes'//nl// &
         'the end and a bracket includes it. `asperity template --reference` prints this page.'//nl//nl
      do i = 1, size(groups)
         text = text//'## `&'//trim(groups(i)%name)//'`'//nl//nl//trim(groups(i)%meaning)
         if (groups(i)%required) text = text//' Required.'
         if (groups(i)%repeatable) text = text//' May be repeated.'
         text = text//nl//nl//'| variable | type | default | units | allowed | meaning |'//nl// &
            '| --- | --- | --- | --- | --- | --- |'//nl
         do j = 1, size(variables)
            associate (entry => variables(j))
               if (entry%group /= groups(i)%name) cycle
               text = text//'| `'//trim(entry%name)//'` | '//trim(kinds(entry%kind))//' | '// &
                  trim(entry%default)//' | '//trim(entry%units)//' | '//bars(trim(entry%allowed))// &
                  ' | '//trim(entry%meaning)//' |'//nl
            end associate
         end do
         if (i < size(groups)) text = text//nl
      end do
   end function reference_markdown

   !> Replace bars by commas, because a bar would end the cell of a table.
   pure function bars(text) result(cell)
      character(*), intent(in) :: text
      character(:), allocatable :: cell
      integer :: i

      cell = ''
      i = 1
      do while (i <= len(text))
         if (text(i:min(i + 2, len(text))) == ' | ') then
            cell = cell//', '
            i = i + 3
         else
            cell = cell//text(i:i)
            i = i + 1
         end if
      end do
   end function bars

end module reference_page
