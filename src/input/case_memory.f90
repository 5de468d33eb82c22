!> Estimates the memory of a run from the number of fields that the header of each module states, and the size of its
!> result.
!>
!> The memory of some parts depends on the course of the run: the acceleration of passes, which keeps more
!> steps if there are many passes, and that of steady sliding. For these parts measured values are used.
!> `tools/bench/memory.py` compares the estimate with the peak of runs, which differs by less than a tenth.
!> A dense system for few cells in contact (module `steady_active`) is not counted; it takes at most 20 fields
!> while it is solved. A step or a steady row may have to be solved all at once (modules `joint_step`,
!> `steady_joint`, and `steady_proximal` without friction). How much memory this takes depends on its course, and
!> without this memory the run continues in another way. `joint_memory` therefore returns separately the most that
!> it may take.
module case_memory
   use asperity_precision, only : dp
   use asperity_schedule, only : count_rows
   use case_settings, only : case_type, road_moves
   use hdf5_slabs, only : slab_rows
   use regular_grid, only : boundary_free, large_grid
   implicit none
   private

   public :: joint_memory, memory_needed, most_snapshots, result_size

   !> Fields of a step that is solved all at once: the equations and four states; and the directions of GMRES, if
   !> all cells touch.
   real(dp), parameter :: joint_fields = 30.0_dp, joint_directions = 180.0_dp
   real(dp), parameter :: joint_inverse = 205.0_dp    !! the inverses of its tiles (module `joint_tiles`), if all cells touch
   !> The same of a steady row without friction.
   real(dp), parameter :: newton_fields = 11.0_dp, newton_directions = 50.0_dp
   real(dp), parameter :: tile_fields = 50.0_dp       !! the inverses on tiles of the contact of a steady row
   !> Further fields on a path of solutions: three states, the plane across it with two vectors of three numbers per cell
   !> in contact (module `joint_plane`), and the two places between which the road is read.
   real(dp), parameter :: path_fields = 31.0_dp
   real(dp), parameter :: start_fields = 0.7_dp       !! of a start from a coarser grid (module normal_cg) ...
   real(dp), parameter :: start_between = 2.0_dp      !! ... and from another one between the two, on a large grid
   real(dp), parameter :: most_kept = 64.0e6_dp       !! bytes of the copies of a row that is taken in parts

   ! Of a result, bytes, as measured: the file without rows and snapshots, a row of the history, and the groups, names and
   ! units of a field in a snapshot.
   real(dp), parameter :: file_itself = 0.22e6_dp, row_of_history = 320.0_dp, field_itself = 5.4e3_dp

   real(dp), parameter :: program_itself = 26.0e6_dp  !! with its libraries, bytes
   real(dp), parameter :: chunk = 131072.0_dp         !! most values of a chunk of the result
   real(dp), parameter :: chunks = 4.0_dp             !! number of gathered chunks, with two threads

contains

   !> Memory of a run, or of one of the processes that share the rows of its fields, bytes.
   pure function memory_needed(case, rows) result(bytes)
      type(case_type), intent(in) :: case
      integer, intent(in), optional :: rows        !! of the process; default all
      real(dp) :: bytes
      real(dp) :: buffers, cells, copies, fields
      logical :: rubs, slides
      integer :: arms

      arms = size(case%material%prony_g)
      slides = road_moves(case%phases)
      rubs = slides .and. case%friction%law /= 'none'
      fields = normal_fields(case)
      ! Without arms there is no S, no change of S, and no traction of the past.
      if (arms > 0) fields = fields + 3.0_dp + arms
      ! The displacement is kept for the next row.
      if (slides .or. count_rows(case%phases) > 1) fields = fields + 1.0_dp
      ! The original map and its spline, the slopes, and a field that is being shifted.
      if (slides) fields = fields + merge(5.0_dp, 4.0_dp, case%solver%interpolation == 'cubic')
      if (case%adhesion%potential /= 'none') fields = fields + adhesion_fields(case)
      if (rubs) fields = fields + friction_fields(case)
      if (any(case%phases%steady)) fields = fields + merge(114.0_dp, 28.0_dp, rubs)
      cells = real(case%grid%nx, dp)*real(case%grid%ny, dp)
      if (present(rows)) cells = real(case%grid%nx, dp)*real(rows, dp)

      ! Copies of the pressure and the gap before a row that may be given up (module row_stop). The copies of
      ! friction are counted with its other fields.
      copies = kept_arms(case, cells)
      if (count_rows(case%phases) > 1 .and. .not. rubs) then
         copies = copies + 16.0_dp*cells
         ! If the load jumps, a later solve has a start from coarser grids, too.
         if (case%grid%cells() >= large_grid) copies = copies + 8.0_dp*start_between*cells
      end if
      ! Gathered chunks, twice as many filtered chunks, and one chunk that each thread is filtering (module
      ! hdf5_chunk_writer).
      buffers = 8.0_dp*(3.0_dp*min(cells, chunks*chunk) + 2.0_dp*min(cells, chunk))

      ! The first solve needs its start, later ones the copies, and the result the buffers, but not at the same time.
      ! The measured fields of friction presuppose copies and buffers.
      bytes = 8.0_dp*fields*cells + program_itself &
         + merge(copies + buffers, max(copies, buffers, 8.0_dp*start_fields*cells), rubs)
   end function memory_needed

   !> The most memory that a run takes beyond `memory_needed` if a step with friction or a steady row is solved all at
   !> once, bytes. It is 0 for other runs.
   pure function joint_memory(case) result(bytes)
      type(case_type), intent(in) :: case
      real(dp) :: bytes
      real(dp) :: fields
      logical :: in_time, rubs, steady

      in_time = any(.not. case%phases%static .and. case%phases%steps > 0)
      steady = any(case%phases%steady)
      rubs = road_moves(case%phases) .and. case%friction%law /= 'none'
      fields = 0.0_dp
      if (rubs .and. (in_time .or. steady)) fields = joint_fields + joint_directions + joint_inverse + path_fields
      if (steady .and. .not. rubs) fields = newton_fields + tile_fields + newton_directions
      bytes = 8.0_dp*fields*real(case%grid%nx, dp)*real(case%grid%ny, dp)
   end function joint_memory

   !> Most snapshots of a run that is not stopped.
   pure function most_snapshots(case) result(n)
      type(case_type), intent(in) :: case
      integer :: n
      integer :: last                              !! row, from 0

      last = count_rows(case%phases) - 1
      associate (every => case%output%snapshot_every)
         if (every > 0) then
            n = last/every + 1
            if (mod(last, every) > 0) n = n + 1    ! the last row has a snapshot anyway
         else
            n = min(size(case%output%snapshot_times), last) + 1
         end if
      end associate
   end function most_snapshots

   !> Bytes of the result of a run before compression. A state of contact is a byte, any other value of a field has eight.
   !> The last chunk of a field is stored as a whole.
   pure function result_size(case) result(bytes)
      type(case_type), intent(in) :: case
      real(dp) :: bytes
      real(dp) :: values
      integer :: fields, of_chunk, rows, states

      states = count(case%output%snapshot_fields == 'contact')
      fields = size(case%output%snapshot_fields) - states
      of_chunk = slab_rows(case%grid%nx)
      rows = case%grid%ny
      if (rows > of_chunk) rows = of_chunk*((rows - 1)/of_chunk + 1)
      values = real(case%grid%nx, dp)*real(rows, dp)
      bytes = file_itself + row_of_history*count_rows(case%phases) + 8.0_dp*values &
         + most_snapshots(case)*((8.0_dp*fields + states)*values + field_itself*(fields + states))
   end function result_size

   !> Copies of the arms, and with friction of the displacements, before a row that is taken in parts, bytes. They are
   !> kept if they take no more than 64 MB (module row_stop).
   pure function kept_arms(case, cells) result(bytes)
      type(case_type), intent(in) :: case
      real(dp), intent(in) :: cells
      real(dp) :: bytes
      real(dp) :: fields
      logical :: in_time
      integer :: arms

      arms = size(case%material%prony_g)
      in_time = any(.not. case%phases%static .and. case%phases%steps > 0)
      bytes = 0.0_dp
      if (arms == 0 .or. .not. in_time .or. case%solver%time_scheme /= 'exponential2') return
      fields = 2.0_dp + arms
      if (road_moves(case%phases) .and. case%friction%law /= 'none') fields = 12.0_dp + 3.0_dp*arms
      if (8.0_dp*fields*cells <= most_kept) bytes = 8.0_dp*fields*cells
   end function kept_arms

   !> Fields of the normal solver and of its state (modules normal_cg and, for very oblong cells, wave_preconditioner).
   pure function normal_fields(case) result(fields)
      type(case_type), intent(in) :: case
      real(dp) :: fields
      real(dp), parameter :: spectrum(2) = [1.0_dp, 2.0_dp]          ! periodic, free
      real(dp), parameter :: symbol(2) = [0.25_dp, 1.0_dp]
      real(dp), parameter :: symbols_mixed(2) = [0.125_dp, 1.5_dp]
      integer :: kind

      kind = merge(2, 1, case%grid%boundary == boundary_free)
      fields = 5.4_dp + spectrum(kind)
      if (case%solver%method == 'thesis') fields = fields - 1.5_dp
      if (case%solver%method /= 'thesis' .and. case%grid%very_oblong()) fields = fields + 0.625_dp
      fields = fields + merge(symbols_mixed(kind), symbol(kind), case%solver%precision == 'mixed')
   end function normal_fields

   !> Fields of the adhesive solver (module adhesion_cg_fast), including those that only its start needs.
   pure function adhesion_fields(case) result(fields)
      type(case_type), intent(in) :: case
      real(dp) :: fields

      fields = 12.7_dp
      if (case%grid%boundary == boundary_free) fields = 62.0_dp
      ! A solve that may separate the surfaces keeps its start.
      if (any(case%phases%control /= 'displacement' .and. case%phases%target < 0.0_dp)) fields = fields + 1.0_dp
      if (case%solver%method == 'thesis') fields = 5.4_dp
   end function adhesion_fields

   !> Fields of friction (modules tangential_step, friction_cg, coupled_passes, row_stop).
   pure function friction_fields(case) result(fields)
      type(case_type), intent(in) :: case
      real(dp) :: fields
      logical :: in_time
      integer :: arms

      arms = size(case%material%prony_g)
      in_time = any(.not. case%phases%static .and. case%phases%steps > 0)
      fields = 52.3_dp
      ! Fields that the passes of steps in time keep.
      if (in_time) fields = fields + 11.0_dp
      if (arms > 0) fields = fields + 4.0_dp + 2.0_dp*arms
      ! The shares of the cells as a third unknown of the passes: in the place, in the differences that the
      ! acceleration remembers, and for the tangential solver.
      if (in_time .and. jumps_at_edge(case)) fields = fields + 13.0_dp
   end function friction_fields

   !> Does the traction of a cell jump when the cell opens?
   pure function jumps_at_edge(case) result(jumps)
      type(case_type), intent(in) :: case
      logical :: jumps

      jumps = case%friction%law == 'constant_shear'
      if (case%friction%law /= 'table') return
      if (allocated(case%friction%table)) jumps = case%friction%table(1, 2) > 0.0_dp
   end function jumps_at_edge

end module case_memory
