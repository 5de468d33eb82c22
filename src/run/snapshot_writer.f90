!> Writes the fields of a run into its result, one slab of rows at a time, so that no field is copied as a whole.
!>
!> If several processes share the rows, each copies its own rows into a slab. The first process, which alone has
!> the result open, collects the slab and writes it. All procedures are collective.
module snapshot_writer
   use asperity_errors, only : error_type
   use asperity_parallel, only : is_first_process
   use asperity_precision, only : dp, int8
   use asperity_simulation, only : simulation_type
   use contact_fields, only : contact_rows, field_rows
   use hdf5_slabs, only : slab_rows
   use process_agreement, only : agree
   use result_file, only : result_file_type
   use row_slabs, only : collect_rows, own_part
   implicit none
   private

   public :: write_height, write_snapshot

contains

   !> Write the fields that the case requests.
   subroutine write_snapshot(result, sim, error, at_stop)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: at_stop     !! written for a stop only: a restart drops it
      integer :: k, slab

      associate (row => sim%state%row, names => sim%case%output%snapshot_fields)
         if (is_first_process()) call result%begin_snapshot(row%step, row%time, row%phase, at_stop=at_stop)
         do k = 1, size(names)
            if (names(k) == 'road_height' .and. .not. sim%slides) then
               if (is_first_process()) call result%copy_height()
               cycle
            end if
            if (is_first_process()) call result%start_field(trim(names(k)), slab)
            if (names(k) == 'contact') then
               call write_states(result, sim)
            else
               call write_reals(result, sim, trim(names(k)))
            end if
         end do
      end associate
      if (is_first_process()) call result%end_snapshot(error)
      call agree(error)
   end subroutine write_snapshot

   !> Write the field that was started last. The result remembers a fault.
   subroutine write_reals(result, sim, name)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim
      character(*), intent(in) :: name
      real(dp), allocatable :: slab(:, :)
      integer :: first

      do first = 1, sim%grid%ny, slab_rows(sim%grid%nx)
         call form_slab(sim, name, first, slab)
         if (is_first_process()) call result%write_rows(first, slab)
      end do
   end subroutine write_reals

   !> Write the contact record, as `write_reals` does for other fields.
   subroutine write_states(result, sim)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim
      integer(int8), allocatable :: slab(:, :)
      integer :: first, rows, part(2)

      do first = 1, sim%grid%ny, slab_rows(sim%grid%nx)
         rows = min(slab_rows(sim%grid%nx), sim%grid%ny - first + 1)
         allocate (slab(sim%grid%nx, rows))
         part = own_part(sim%grid, first, rows)
         if (part(1) <= part(2)) call contact_rows(sim, part(1) - sim%grid%first_row + 1, &
            slab(:, part(1) - first + 1:part(2) - first + 1))
         call collect_rows(sim%grid, first, slab)
         if (is_first_process()) call result%write_rows(first, slab)
         deallocate (slab)
      end do
   end subroutine write_states

   !> Write the height map of a new result. The result remembers a fault.
   subroutine write_height(result, sim)
      type(result_file_type), intent(inout) :: result
      type(simulation_type), intent(in) :: sim     !! before the first row
      real(dp), allocatable :: slab(:, :)
      integer :: first

      do first = 1, sim%grid%ny, slab_rows(sim%grid%nx)
         call form_slab(sim, 'road_height', first, slab)
         if (is_first_process()) call result%write_height_rows(first, slab)
      end do
   end subroutine write_height

   !> Form a slab of a field, which is complete on the first process.
   subroutine form_slab(sim, name, first, slab)
      type(simulation_type), intent(in) :: sim
      character(*), intent(in) :: name
      integer, intent(in) :: first                 !! row of the grid where it begins, from 1
      real(dp), allocatable, intent(out) :: slab(:, :)
      integer :: rows, part(2)

      rows = min(slab_rows(sim%grid%nx), sim%grid%ny - first + 1)
      allocate (slab(sim%grid%nx, rows))
      part = own_part(sim%grid, first, rows)
      if (part(1) <= part(2)) call field_rows(sim, name, part(1) - sim%grid%first_row + 1, &
         slab(:, part(1) - first + 1:part(2) - first + 1))
      call collect_rows(sim%grid, first, slab)
   end subroutine form_slab

end module snapshot_writer
