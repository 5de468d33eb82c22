!> The settings that must agree if a run is continued from a checkpoint: all on which its numbers depend.
module case_identity
   implicit none
   private

   public :: identity_of

contains

   !> The settings of a case as lines 'group: name = value', without those that do not affect the numbers:
   !> the title, the output, and the threads. (The names of phases count, because the result shows them.) The names of files
   !> with height maps do not matter either, because they depend on the folder in which a run is started; the caller compares
   !> the checksums of the maps.
   function identity_of(settings) result(lines)
      character(*), intent(in) :: settings       !! of `resolved_input`
      character(:), allocatable :: lines
      character(:), allocatable :: buffer, line, group, place
      integer :: at, next, equals, filled, note, surfaces, phases

      allocate (character(2*len(settings) + 1000) :: buffer)
      filled = 0
      group = ''
      place = ''
      surfaces = 0
      phases = 0
      at = 1
      do while (at <= len(settings))
         next = index(settings(at:), new_line('a'))
         if (next == 0) next = len(settings) - at + 2
         line = trim(adjustl(settings(at:at + next - 2)))
         at = at + next
         if (len(line) == 0) cycle
         if (line(1:1) == '&') then
            group = line
            place = line
            if (line == '&surface') place = numbered(line, surfaces)
            if (line == '&phase') place = numbered(line, phases)
         end if
         equals = index(line, '=')
         if (equals == 0) cycle
         if (group == '&case' .or. group == '&output') cycle
         if (group == '&solver' .and. index(line, 'threads') == 1) cycle
         if (group == '&surface' .and. (index(line, 'file ') == 1 .or. index(line, 'dataset ') == 1)) cycle
         note = index(line, ' ! ')
         if (note == 0) note = len(line) + 1
         call add(place//': '//trim(line(:equals - 1))//' = '//trim(adjustl(line(equals + 1:note - 1))))
      end do
      lines = buffer(:filled)

   contains

      !> Add a line. The buffer grows by doubling, so that the time is proportional to the number of lines.
      subroutine add(text)
         character(*), intent(in) :: text
         character(:), allocatable :: longer

         if (filled + len(text) + 1 > len(buffer)) then
            allocate (character(2*(filled + len(text) + 1)) :: longer)
            longer(:filled) = buffer(:filled)
            call move_alloc(longer, buffer)
         end if
         buffer(filled + 1:filled + len(text) + 1) = text//new_line('a')
         filled = filled + len(text) + 1
      end subroutine add

   end function identity_of

   !> The name of a group that is repeated, with its number.
   function numbered(name, count) result(text)
      character(*), intent(in) :: name
      integer, intent(inout) :: count
      character(:), allocatable :: text
      character(12) :: digits

      count = count + 1
      write (digits, '(i0)') count
      text = name//' '//trim(digits)
   end function numbered

end module case_identity
