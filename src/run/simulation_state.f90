!> Writes and reads the state of a run in a checkpoint. A run that continues from it computes the same numbers to
!> the last bit. Collective; only the first process has the checkpoint open.
module simulation_state
   use asperity_checkpoint, only : checkpoint_reader_type, checkpoint_writer_type
   use asperity_errors, only : error_type
   use asperity_simulation, only : simulation_type
   use row_state, only : list_state
   use state_table, only : state_table_type
   implicit none
   private

   public :: load_state, save_state

contains

   !> Put the state into a checkpoint.
   subroutine save_state(sim, writer, error)
      type(simulation_type), intent(in), target :: sim
      type(checkpoint_writer_type), intent(inout) :: writer
      type(error_type), allocatable, intent(out), optional :: error
      type(state_table_type) :: table

      call list_state(sim%state, table)
      table%grid = sim%grid
      call writer%put_state(table, error)
   end subroutine save_state

   !> Take the state from a checkpoint into a new simulation of the same case.
   subroutine load_state(sim, reader, error)
      type(simulation_type), intent(inout), target :: sim
      type(checkpoint_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      type(state_table_type) :: table

      call list_state(sim%state, table)
      table%grid = sim%grid
      call reader%get_state(table, error)
      if (.not. allocated(error)) call sim%resume()
   end subroutine load_state

end module simulation_state
