!> Writes the fields of a run into its result, a slab of rows at a time: no field is copied as a whole.
module snapshot_writer
   use asperity_errors, only : error_type
   use asperity_precision, only : dp, int8
   use asperity_simulation, only : simulation_type
   use result_file, only : result_file_type
   implicit none
   private

   public :: write_snapshot

contains

   !> Write the fields that the case asks for.
   subroutine write_snapshot(result, sim, error, at_stop)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: at_stop     !! written for a stop only: a restart drops it
      integer :: k

      associate (row => sim%state%row, names => sim%case%output%snapshot_fields)
         call result%begin_snapshot(row%step, row%time, row%phase, at_stop=at_stop)
         do k = 1, size(names)
            call write_field(result, sim, trim(names(k)))
         end do
      end associate
      call result%end_snapshot(error)
   end subroutine write_snapshot

   !> Write a field. A fault is kept by the result.
   subroutine write_field(result, sim, name)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim
      character(*), intent(in) :: name
      real(dp), allocatable :: values(:, :)
      integer(int8), allocatable :: states(:, :)
      integer :: first, rows, slab

      call result%start_field(name, slab)
      do first = 1, sim%grid%ny, slab
         rows = min(slab, sim%grid%ny - first + 1)
         if (name == 'contact') then
            allocate (states(sim%grid%nx, rows))
            call sim%contact_rows(first, states)
            call result%write_rows(first, states)
            deallocate (states)
         else
            allocate (values(sim%grid%nx, rows))
            call sim%field_rows(name, first, values)
            call result%write_rows(first, values)
            deallocate (values)
         end if
      end do
   end subroutine write_field

end module snapshot_writer
