!> Estimates how long a run of a case takes, for `asperity check`.
!>
!> A run spends its time in transforms and in the sweeps over fields between them. Its time is therefore
!> (rows) x (transforms per row) x (time per transform, with the sweeps that go with it). The number of rows is
!> known. The number of transforms per row is that of similar cases (docs/choosing.md, docs/benchmarks.md). The
!> time per transform is measured with a small transform on this machine and scaled by N log N to the grid of the
!> case. The number of transforms depends on the road, the load and the tolerance, so that the estimate is
!> only right within a factor of about three.
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

   integer, parameter :: probe = 128               !! cells along a side of the measured transform
   real(dp), parameter :: seconds_of_a_row = 2.0e-3_dp  !! to append a row to the file and flush it

contains

   !> Transforms of the size of the grid that a run takes.
   pure function transforms_needed(case) result(transforms)
      type(case_type), intent(in) :: case
      real(dp) :: transforms
      real(dp) :: solve, step
      integer :: jumps, k

      jumps = count_rows(case%phases)
      solve = 43.0_dp
      if (case%adhesion%potential /= 'none') solve = 110.0_dp
      if (case%solver%method == 'thesis') solve = 3.0_dp*solve
      transforms = 0.0_dp
      do k = 1, size(case%phases)
         associate (phase => case%phases(k))
            jumps = jumps - phase%steps
            step = 0.3_dp*solve                    ! a step starts from the solution of the step before
            if (road_moves([phase])) then
               step = 0.7_dp*solve
               ! Each pass solves the normal and the tangential contact.
               if (case%friction%law /= 'none') step = 4.0_dp*solve
            end if
            if (phase%static) step = solve
            transforms = transforms + phase%steps*step
         end associate
      end do
      transforms = transforms + jumps*solve
   end function transforms_needed

   !> Time of a run on this machine, s.
   function seconds_needed(case) result(seconds)
      type(case_type), intent(in) :: case
      real(dp) :: seconds
      real(dp) :: cells, sweeps, threads

      cells = real(case%grid%nx, dp)*real(case%grid%ny, dp)
      ! The factors for the sweeps over fields, in units of a transform, and for the padding of a free grid.
      sweeps = 2.0_dp
      if (case%friction%law /= 'none') sweeps = 3.5_dp
      if (case%adhesion%potential /= 'none') sweeps = 7.0_dp
      if (case%grid%boundary == boundary_free) sweeps = 2.0_dp*sweeps
      threads = real(processor_count(), dp)
      if (case%solver%threads > 0) threads = min(threads, real(case%solver%threads, dp))
      ! Fields that fit into a core's cache gain nothing from threads.
      if (cells < 16384.0_dp) threads = 1.0_dp
      seconds = transforms_needed(case)*sweeps*seconds_of_a_transform()/threads**0.9_dp* &
         cells*log(max(cells, 2.0_dp))/(real(probe, dp)**2*log(real(probe, dp)**2)) + &
         count_rows(case%phases)*seconds_of_a_row
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
