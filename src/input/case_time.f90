!> Estimates how long a run of a case takes, for `asperity check`.
!>
!> A run spends its time in transforms and in the sweeps over fields between them. Its time is therefore
!> (transforms) x (time per transform, with the sweeps that go with it), and the times to begin and to write rows.
!> The number of transforms of a row and the share of the sweeps are means over random cases of each kind
!> (`tools/time_campaign.py` compares the estimate with the times of such cases). The time per transform is measured
!> with a small transform on this machine and scaled by N log N to the grid of the case. The number of transforms
!> depends on the road, the load and the tolerance, so that the estimate is only right within a factor of about three.
module case_time
   use case_settings, only : case_type, road_moves
   use asperity_errors, only : error_type
   use asperity_threads, only : processor_count
   use asperity_precision, only : dp
   use real_transform, only : destroy_real_transform, new_real_transform, real_transform_type, to_space, &
      to_spectrum
   use regular_grid, only : boundary_free
   use asperity_schedule, only : count_rows
   use text_tools, only : to_text
   implicit none
   private

   public :: duration_text, seconds_needed

   integer, parameter :: probe = 128                        !! cells along a side of the measured transform
   real(dp), parameter :: seconds_of_a_row = 2.0e-3_dp      !! to move the road, append a row to the file and flush it
   real(dp), parameter :: seconds_to_begin = 0.08_dp
   real(dp), parameter :: seconds_of_a_cell = 0.3e-6_dp     !! to make the road and to write a snapshot

   !> Transforms of a solve from scratch in periodic and in free mode; of a solve with adhesion; and of its next step.
   real(dp), parameter :: solve_of(2) = [20.0_dp, 40.0_dp], adhesive_solve = 40.0_dp, adhesive_step = 25.0_dp
   real(dp), parameter :: step_of_creep = 12.0_dp, step_of_sliding = 16.0_dp, step_of_friction = 110.0_dp
   !> Transforms of a state of steady sliding of 128 cells along a side, without and with friction.
   real(dp), parameter :: steady_of(2) = [80.0_dp, 550.0_dp]
   real(dp), parameter :: thesis = 3.0_dp                   !! times as many with the method of the thesis

   !> The time of the sweeps over that of the transforms, without and with friction, and with adhesion. Where adhesive
   !> solves use coarser grids, their transforms count in proportion to their size, and the sweeps of these grids here.
   real(dp), parameter :: sweeps_of(2) = [3.5_dp, 5.5_dp], sweeps_of_adhesion = 10.0_dp

contains

   !> Transforms of the size of the grid that a run takes.
   pure function transforms_needed(case) result(transforms)
      type(case_type), intent(in) :: case
      real(dp) :: transforms
      real(dp) :: solve, steady, step
      logical :: adheres
      integer :: jumps, k

      adheres = case%adhesion%potential /= 'none'
      solve = solve_of(merge(2, 1, case%grid%boundary == boundary_free))
      if (adheres) solve = adhesive_solve
      steady = steady_of(merge(2, 1, case%friction%law /= 'none'))*(max(case%grid%nx, case%grid%ny)/128.0_dp)**0.35_dp

      transforms = 0.0_dp
      jumps = count_rows(case%phases)
      do k = 1, size(case%phases)
         associate (phase => case%phases(k))
            step = step_of_creep
            if (road_moves([phase])) step = merge(step_of_friction, step_of_sliding, case%friction%law /= 'none')
            if (adheres) step = max(step, adhesive_step)
            if (phase%static) step = merge(adhesive_step, solve, adheres)
            transforms = transforms + phase%steps*step
            jumps = jumps - phase%steps
            ! The first row of a steady phase is its only one, or comes before its steps, as a jump.
            if (phase%steady) transforms = transforms + steady - merge(step, solve, phase%static)
         end associate
      end do
      transforms = transforms + jumps*solve
      if (case%solver%method == 'thesis') transforms = thesis*transforms
   end function transforms_needed

   !> Time of a run on this machine, s.
   function seconds_needed(case) result(seconds)
      type(case_type), intent(in) :: case
      real(dp) :: seconds
      real(dp) :: cells, padded, sweeps, threads

      cells = real(case%grid%nx, dp)*real(case%grid%ny, dp)
      sweeps = sweeps_of(merge(2, 1, case%friction%law /= 'none'))
      if (case%adhesion%potential /= 'none') sweeps = sweeps_of_adhesion
      ! Only the transforms have the padding of a free grid. With adhesion the coarser grids have it, too.
      padded = cells
      if (case%grid%boundary == boundary_free) then
         padded = 4.0_dp*cells
         if (case%adhesion%potential == 'none') sweeps = sweeps/4.0_dp
      end if

      threads = real(processor_count(), dp)
      if (case%solver%threads > 0) threads = min(threads, real(case%solver%threads, dp))
      ! The threads wait for each other after each sweep. On small grids they gain nothing.
      threads = max(1.0_dp, min(threads, (padded/1.0e4_dp)**0.3_dp)**0.9_dp)

      seconds = transforms_needed(case)*(1.0_dp + sweeps)*seconds_of_a_transform()/threads* &
         padded*log(max(padded, 2.0_dp))/(real(probe, dp)**2*log(real(probe, dp)**2)) + &
         seconds_to_begin + seconds_of_a_cell*cells/threads + count_rows(case%phases)*seconds_of_a_row
   end function seconds_needed

   !> Processor time of one transform of `probe` x `probe` cells, s.
   function seconds_of_a_transform() result(seconds)
      real(dp) :: seconds
      type(real_transform_type) :: transform
      type(error_type), allocatable :: error
      real(dp) :: start, now
      integer :: attempt, i
      integer, parameter :: pairs = 8

      seconds = 1.0e-4_dp
      call new_real_transform(transform, probe, probe, error)
      if (allocated(error)) return
      transform%space = 0.0_dp
      do attempt = 1, 4
         call cpu_time(start)
         do i = 1, pairs
            call to_spectrum(transform)
            call to_space(transform)
         end do
         call cpu_time(now)
         if (attempt == 1 .or. now - start < 2*pairs*seconds) seconds = (now - start)/(2*pairs)
      end do
      call destroy_real_transform(transform)
   end function seconds_of_a_transform

   !> A time in words, to one digit: 'less than a second', 'about 4 minutes'.
   pure function duration_text(seconds) result(text)
      real(dp), intent(in) :: seconds
      character(:), allocatable :: text

      if (seconds < 1.0_dp) then
         text = 'less than a second'
      else if (seconds < 90.0_dp) then
         text = 'about '//counted(seconds, 'second')
      else if (seconds < 5400.0_dp) then
         text = 'about '//counted(seconds/60.0_dp, 'minute')
      else if (seconds < 129600.0_dp) then
         text = 'about '//counted(seconds/3600.0_dp, 'hour')
      else
         text = 'about '//counted(seconds/86400.0_dp, 'day')
      end if
   end function duration_text

   !> A number, rounded to one digit, with its unit.
   pure function counted(number, unit) result(text)
      real(dp), intent(in) :: number
      character(*), intent(in) :: unit
      character(:), allocatable :: text
      integer :: rounded, scale

      scale = 10**int(log10(max(number, 1.0_dp)))
      rounded = nint(min(number, 1.0e9_dp)/scale)*scale
      text = to_text(rounded)//' '//unit
      if (rounded /= 1) text = text//'s'
   end function counted

end module case_time
