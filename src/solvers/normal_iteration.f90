!> The choices of an iteration of module `normal_cg`: the direction, the step along it and the part of the step that
!> is taken.
!>
!> The cells in which the trial pressure P + alpha d is negative are released: the direction on the other cells changes by
!> what the model of the preconditioner says (module `schur_release`). The trial pressure is then projected on the
!> admissible pressures, which gives the clipped step s. The multiple of s that minimises the energy follows from the
!> product A s.
!>
!> The preconditioner M extends the residual by a few steps of conjugate gradients, whose number follows from the size of
!> the contact. Iterations that reduce the residual slowly add to it.
!>
!> The eigenvalues of M A lie within a factor of two, whatever the contact and the grid, so that one value of alpha fits
!> all iterations. A value learned from the steps before was worse, because the contact changes in these steps. Only after
!> a step that did not lower the energy is alpha smaller, by the factor kappa.
!>
!> There are directions of another kind: plain ones, those of very oblong cells, and the next ones of a solve in which
!> several trials with released cells in a row did not lower the energy: the model then misleads, as on strips thousands of
!> times as long as wide. No cells are released for them, and alpha comes from a prediction of d.A d on the block means,
!> which the ratio kappa of the last true product to its prediction corrects. Each such pause is twice as long as the one
!> before it.
!>
!> The phase of the loop determines how the next direction is formed:
!>
!>     restart    d = M r, the preconditioned residual: in the first iteration, and if the last direction is useless
!>                because little was taken of a clipped step, the gap has drifted, or the step was plain
!>     conjugate  d = M r + beta d: after all other steps
!>     plain      d = r: after several steps along which the energy did not decrease once they were projected. A
!>                projected step along M r may point uphill, but one along r never does
!>     ended      the loop has ended
module normal_iteration
   use asperity_precision, only : dp
   use fft_conv, only : columns_apply, convolution_type
   use normal_passes, only : as_formed, mean_stiffness, new_direction, normal_work_type, overlap_with_before, predict_form
   use normal_projection, only : find_clip, keep_block_sums, longest_multiple, project_step, try_pressure
   use normal_state, only : control_pressure, gap_measure_type, normal_problem_type, reason_iterations
   use normal_sums, only : step_sums_type, trial_sums_type
   use normal_sweeps, only : trial_type
   use regular_grid, only : boundary_periodic, grid_type
   implicit none
   private

   public :: choose_direction, choose_step, end_loop, iteration_type, phase_conjugate, phase_ended, &
      phase_restart

   integer, parameter :: phase_restart = 1
   integer, parameter :: phase_conjugate = 2
   integer, parameter :: phase_plain = 3
   integer, parameter :: phase_ended = 4

   ! A step along which the energy does not decrease, or hardly decreases, makes kappa four times larger and thus the next
   ! trial shorter.
   real(dp), parameter :: shortening = 4.0_dp
   real(dp), parameter :: often_shortened = 1e3_dp   !! kappa from which the direction is the plain residual
   real(dp), parameter :: misled = 50.0_dp           !! kappa from which no cells are released for some iterations
   real(dp), parameter :: hopeless = 1e9_dp    !! kappa from which no step is expected to reduce the energy
   real(dp), parameter :: useless = 0.1_dp     !! largest part of a clipped step that counts as little
   real(dp), parameter :: nothing = 1e-3_dp    !! largest part that counts as nothing
   ! The energy falls along a step up to twice the multiple that minimises it. From this multiple on a clipped step is
   ! taken whole: the pressure is then the projected one, in which the cells that leave the contact have exactly none.
   real(dp), parameter :: least_for_whole = 0.55_dp

   ! Steps by which the preconditioner extends the residual before and after the release of cells, for the numbers of cells
   ! of a grid from which they save time.
   real(dp), parameter :: sizes(6) = [2e4_dp, 1.7e5_dp, 1.5e6_dp, 4e6_dp, 1.2e7_dp, 3e7_dp]
   integer, parameter :: steps_before(0:6) = [1, 1, 1, 2, 3, 4, 5]
   integer, parameter :: steps_after(0:6) = [1, 2, 3, 3, 4, 5, 6]
   integer, parameter :: steps_alone(0:6) = [0, 0, 2, 2, 2, 2, 2]   !! if no cells are released
   ! Contacts of noise, long strips and oblong cells need more steps than rough roads, and otherwise converge slowly. After
   ! each iteration that leaves more than this part of r.M r, all later ones take more steps (see `note_progress`).
   real(dp), parameter :: slow = 0.35_dp
   integer, parameter :: added = 2                !! steps after each slow iteration
   integer, parameter :: most_added = 10
   ! On a long, free or very large grid the cells whose trial pressure is negative after a release are released, too.
   integer, parameter :: most_releases = 3
   real(dp), parameter :: very_large = 3e7_dp    !! cells
   real(dp), parameter :: negligible = 1e-5_dp   !! negative part of a trial pressure that is only clipped

   ! A contact that is a part of the grid needs no more steps than a dense one on a smaller grid.
   real(dp), parameter :: light = 0.1_dp, dense = 0.5_dp   !! contact fractions between which the number of steps changes
   real(dp), parameter, public :: sparse = 0.03_dp   !! largest contact fraction of a sparse contact
   integer, parameter :: largest_class = 3        !! of a sparse contact

   real(dp), parameter :: suspicious = 0.15_dp    !! beta from which directions may have lost their conjugacy

   !> The numbers that an iteration passes to the next one.
   type :: iteration_type
      integer :: phase = phase_restart      !! how the next direction is formed
      logical :: preconditioned = .false.   !! the present direction is not a plain one
      integer :: pause = 0                  !! iterations still to come without a release, because steps with one have failed
      integer :: next_pause = 6             !! the number of them after the next failure
      logical :: releases = .false.         !! the cells with a negative trial pressure are released
      logical :: free_mean = .false.        !! the load is not given, and a uniform pressure strains nothing
      integer :: class = 0                  !! place in the lists of steps
      integer :: more = 0                   !! steps beyond those of the lists
      real(dp) :: kappa = 1.0_dp            !! by which trials are shorter than the model says
      real(dp) :: rz = 0.0_dp               !! r.M r of the last direction
      real(dp) :: slope = 0.0_dp            !! r.d
      real(dp) :: alpha = 0.0_dp            !! multiple of the step that is taken; 0: rejected
      character(64) :: reason = reason_iterations   !! why the loop ended
   end type iteration_type

contains

   !> End the loop.
   pure subroutine end_loop(now, reason)
      type(iteration_type), intent(inout) :: now
      character(*), intent(in) :: reason

      now%phase = phase_ended
      now%reason = reason
   end subroutine end_loop

   !> The place of a contact in the lists of steps. If the contact is less than half of the grid, the grid counts as one
   !> with fewer cells.
   pure integer function size_class(grid, contact)
      type(grid_type), intent(in) :: grid
      real(dp), intent(in) :: contact                  !! fraction of the cells

      size_class = count(sqrt(min(max(contact, light)/dense, 1.0_dp))*grid%cells() >= sizes)
      if (contact <= sparse) size_class = min(size_class, largest_class)
   end function size_class

   !> Choose the direction of an iteration according to the phase, and set the phase of the next one.
   subroutine choose_direction(work, task, measure, pressure, gap, now)
      type(normal_work_type), intent(inout) :: work
      type(normal_problem_type), intent(in) :: task
      type(gap_measure_type), intent(in) :: measure
      real(dp), contiguous, intent(in) :: pressure(:, :), gap(:, :)
      type(iteration_type), intent(inout) :: now
      real(dp) :: rz, beta, stiffness
      integer :: steps
      logical :: fixed_load

      fixed_load = task%control == control_pressure
      now%free_mean = .not. fixed_load .and. work%grid%boundary == boundary_periodic
      stiffness = 0.0_dp
      if (now%free_mean) stiffness = mean_stiffness(work%grid, 1.0_dp - measure%contact)
      call work%preconditioner%blocks%stiffen_mean(stiffness)
      call work%preconditioner%set_residual(work%coarse, work%active, work%scale, measure%level, pressure, gap)
      work%preconditioner%fixed_load = fixed_load
      now%releases = now%pause == 0 .and. .not. work%preconditioner%by_waves
      now%pause = max(now%pause - 1, 0)
      now%class = size_class(work%grid, measure%contact)
      steps = now%more + merge(steps_before(now%class), steps_alone(now%class), now%releases)
      call work%preconditioner%extend(work%coarse, work%active, steps, rz)
      call note_progress(now, measure%contact, rz)
      beta = 0.0_dp
      if (now%phase == phase_conjugate .and. now%rz > 0.0_dp) beta = conjugacy_factor(work, rz, now%rz)
      now%rz = rz
      now%slope = 0.0_dp
      now%preconditioned = now%phase /= phase_plain
      if (now%preconditioned) then
         call new_direction(work, fixed_load, .true., beta, pressure, now%slope)
         if (now%slope <= 0.0_dp .and. beta > 0.0_dp) &
            call new_direction(work, fixed_load, .true., 0.0_dp, pressure, now%slope)
      end if
      if (now%slope <= 0.0_dp) then
         now%preconditioned = .false.
         call new_direction(work, fixed_load, .false., 0.0_dp, pressure, now%slope)
      end if
      now%phase = merge(phase_conjugate, phase_restart, now%preconditioned)
      if (now%slope <= 0.0_dp) call end_loop(now, 'no direction of descent is left')
   end subroutine choose_direction

   !> Add steps of the preconditioner to all later iterations if the last one has left much of r.M r. In a sparse contact on
   !> a large grid they would cost more time than the iterations that they save.
   pure subroutine note_progress(now, contact, rz)
      type(iteration_type), intent(inout) :: now
      real(dp), intent(in) :: contact                  !! fraction of the cells
      real(dp), intent(in) :: rz                       !! r.M r of the new residual

      if (contact <= sparse .and. now%class == largest_class) return
      if (now%rz > 0.0_dp .and. rz > slow*now%rz) now%more = min(now%more + added, most_added)
   end subroutine note_progress

   !> Compute beta, the multiple of the old direction that the new one keeps.
   !>
   !> Fletcher and Reeves's beta = r.z/(r.z before) is best while the contact changes. But once such changes have spoilt
   !> the conjugacy of the directions, it never recovers: each direction then consists mostly of the old ones, and r.z
   !> falls by a half instead of a tenth in each iteration. What r.z contains of the residual before is therefore left
   !> out (Polak and Ribiere's beta) where beta is so large.
   function conjugacy_factor(work, rz, rz_before) result(beta)
      type(normal_work_type), intent(in) :: work
      real(dp), intent(in) :: rz, rz_before
      real(dp) :: beta
      real(dp) :: overlap

      overlap = 0.0_dp
      if (work%preconditioner%by_waves) then
         overlap = work%preconditioner%overlap
      else if (rz > suspicious*rz_before) then
         overlap = max(overlap_with_before(work), 0.0_dp)
      end if
      beta = max(rz - overlap, 0.0_dp)/rz_before
   end function conjugacy_factor

   !> Choose the step of an iteration: a trial along the direction, projected on the admissible pressures, and the
   !> part of it that is taken. A step that does not descend is rejected (alpha = 0), and the next trial is shorter.
   subroutine choose_step(work, product, task, measure, pressure, gap, now)
      type(normal_work_type), intent(inout) :: work
      type(convolution_type), intent(inout) :: product
      type(normal_problem_type), intent(in) :: task
      type(gap_measure_type), intent(in) :: measure    !! of the present state
      real(dp), contiguous, intent(in) :: pressure(:, :), gap(:, :)
      type(iteration_type), intent(inout) :: now
      type(trial_sums_type) :: trial
      type(step_sums_type) :: sums
      real(dp) :: alpha
      logical :: fixed_load, clipped

      now%alpha = 0.0_dp
      if (now%phase == phase_ended) return
      fixed_load = task%control == control_pressure
      alpha = trial_length(work, task%modulus, now)
      if (is_releasing(now)) then
         call release_and_try(work, task, alpha, now%more + steps_after(now%class), pressure, trial)
      else
         call try_pressure(work, alpha, pressure, trial)
      end if
      if (trial%cells < 1.0_dp .and. fixed_load) then
         call shorten(now)
         return
      end if
      if (work%preconditioner%by_waves .and. now%preconditioned) call keep_block_sums(work, pressure, trial)
      call find_clip(work, fixed_load, task%target*work%grid%cells(), task%tolerance, pressure, trial, clipped)
      if (work%preconditioner%released) work%offset = work%offset + work%trial%shift/alpha
      ! The step may be many orders larger than the present load, which may be round-off at the first touch.
      call product%set_unit(max(measure%load, trial%above)/work%grid%cells())
      call project_step(work, product, .not. is_releasing(now), measure%level, pressure, gap, sums)
      if (sums%slope > 0.0_dp) then
         call choose_length(work, product, task%modulus, pressure, clipped, sums, now)
      else
         call shorten(now)
      end if
   end subroutine choose_step

   !> Release the cells with a negative trial pressure, and form the trial pressure.
   !>
   !> The change of the direction makes other cells negative. On most grids it is enough that the projection clips them. But
   !> the load that this takes from the contact around them returns to the whole of it, and on a long grid the energy of such
   !> an error of the longest waves is so large that little of the step can be taken, and hardly a cell leaves the contact.
   !> There, on very large grids, whose waves are long as well, and on free grids, such cells are released in their turn.
   subroutine release_and_try(work, task, alpha, steps, pressure, trial)
      type(normal_work_type), intent(inout) :: work
      type(normal_problem_type), intent(in) :: task
      real(dp), intent(in) :: alpha
      integer, intent(in) :: steps                     !! of the preconditioner, after each release
      real(dp), contiguous, intent(in) :: pressure(:, :)
      type(trial_sums_type), intent(out) :: trial
      real(dp) :: surplus
      logical :: repeats
      integer :: k

      repeats = work%preconditioner%long_waves%matter .or. work%grid%cells() >= very_large
      do k = 1, most_releases
         call work%preconditioner%release(work%coarse, work%active, steps, trial_type(alpha, work%offset), pressure, &
            work%direction(:, :, as_formed))
         call try_pressure(work, alpha, pressure, trial)
         if (k == most_releases .or. .not. repeats) exit
         if (trial%cells < 1.0_dp .or. -trial%below <= negligible*trial%above) exit

         ! The next release starts from a trial pressure that has the given load with its negative parts.
         if (task%control == control_pressure) then
            surplus = trial%above + trial%below - task%target*work%grid%cells()
            work%offset = work%offset + surplus/(alpha*trial%cells)
         end if
      end do
   end subroutine release_and_try

   !> Does this iteration release cells? Not if its direction is a plain one.
   pure logical function is_releasing(now)
      type(iteration_type), intent(in) :: now

      is_releasing = now%preconditioned .and. now%releases
   end function is_releasing

   !> The multiple alpha of the direction for the trial pressure.
   function trial_length(work, modulus, now) result(alpha)
      type(normal_work_type), intent(inout) :: work
      real(dp), intent(in) :: modulus                  !! Pa
      type(iteration_type), intent(in) :: now
      real(dp) :: alpha

      if (is_releasing(now)) then
         alpha = modulus/(max(now%kappa, 1.0_dp)*work%preconditioner%compliance*work%scale)
      else
         alpha = now%slope*modulus/max(now%kappa*predict_form(work), tiny(1.0_dp))
      end if
   end function trial_length

   !> Make the next trial shorter. After many such calls the direction becomes the plain residual, and then the loop
   !> ends.
   subroutine shorten(now)
      type(iteration_type), intent(inout) :: now

      if (now%kappa > hopeless) then
         call end_loop(now, 'no step lowers the energy')
      else
         now%kappa = shortening*now%kappa
         now%phase = merge(phase_plain, phase_restart, now%kappa > often_shortened)
         if (now%kappa > misled .and. now%releases) then
            now%pause = now%next_pause
            now%next_pause = 2*now%next_pause
            now%kappa = 1.0_dp
         end if
      end if
   end subroutine shorten

   !> Compute the part of the projected step that is taken, from the product of the operator with it.
   subroutine choose_length(work, product, modulus, pressure, clipped, sums, now)
      type(normal_work_type), intent(inout) :: work
      type(convolution_type), intent(inout) :: product
      real(dp), intent(in) :: modulus                  !! Pa
      real(dp), contiguous, intent(in) :: pressure(:, :)
      logical, intent(in) :: clipped
      type(step_sums_type), intent(in) :: sums         !! of the step
      type(iteration_type), intent(inout) :: now
      real(dp) :: form, predicted, before

      call product%columns(columns_apply, form)
      form = form/modulus
      if (form <= 0.0_dp .and. now%free_mean) then
         ! The step takes the same pressure from all cells, which costs no energy: only P >= 0 limits it.
         now%alpha = 1.0_dp
         if (.not. clipped) now%alpha = longest_multiple(work, pressure)
         now%phase = phase_restart
         if (now%alpha < huge(1.0_dp)) return
      end if
      if (form <= 0.0_dp) then
         now%alpha = 0.0_dp
         call end_loop(now, 'no direction of descent is left')
         return
      end if
      before = now%kappa
      if (is_releasing(now)) then
         now%kappa = max(before/shortening, 1.0_dp)
      else
         predicted = work%coarse%predict_form(sums%square)/modulus
         now%kappa = min(max(form/max(predicted, tiny(1.0_dp)), 0.1_dp), 10.0_dp)
      end if
      now%alpha = sums%slope/form
      if (.not. now%alpha > 0.0_dp) then
         call end_loop(now, 'no direction of descent is left')
         return
      end if
      ! A direction that points out of the admissible pressures would only grow. Do not keep it.
      if (clipped .and. now%alpha < useless) now%phase = phase_restart
      if (clipped .and. now%alpha < nothing) then
         now%kappa = max(before, now%kappa)
         call shorten(now)
      end if
      if (clipped .and. now%alpha > least_for_whole) then
         now%alpha = 1.0_dp
      else if (now%alpha > 1.0_dp) then
         now%alpha = min(now%alpha, longest_multiple(work, pressure))
      end if
   end subroutine choose_length

end module normal_iteration
