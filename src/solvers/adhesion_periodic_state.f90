!> What the two methods for adhesive contact in periodic mode share: start, traction, end, measures.
module adhesion_periodic_state
   use adhesion_potential, only : adhesive_slope
   use adhesion_state, only : adhesion_problem_type, control_approach, control_pressure, &
      resolved_traction, row_total, stepped_gap, sum_shift, traction_scale
   use fft_conv, only : columns_apply, convolution_type
   use asperity_parallel, only : global_max
   use asperity_precision, only : dp
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: evaluate_load, evaluate_traction, field_sum, finish, is_detached, residual_units, &
      start_gap

contains

   !> Put the start on what is allowed.
   subroutine start_gap(stiffness, rows, problem, total, gap)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: total
      real(dp), intent(inout) :: gap(:, :)
      real(dp) :: shift
      integer :: j

      !$omp parallel do default(none) shared(gap) private(j) num_threads(stiffness%threads)
      do j = 1, size(gap, 2)
         gap(:, j) = max(gap(:, j), 0.0_dp)
      end do
      if (problem%control /= control_approach) return
      if (field_sum(stiffness, rows, gap) > 0.0_dp) then
         shift = sum_shift(gap, gap, 0.0_dp, total, rows, stiffness%threads)
         !$omp parallel do default(none) shared(gap, shift) private(j) &
         !$omp num_threads(stiffness%threads)
         do j = 1, size(gap, 2)
            gap(:, j) = stepped_gap(gap(:, j), 0.0_dp, 0.0_dp, shift)
         end do
      else
         gap(:, :) = total/size(gap)
      end if
   end subroutine start_gap

   !> traction = Q B(H + g) - P_h, of zero mean.
   subroutine evaluate_traction(stiffness, rows, problem, height, gap, traction, history)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :), gap(:, :)
      real(dp), intent(inout) :: traction(:, :)
      real(dp), intent(in), optional :: history(:, :)
      real(dp) :: mean, form
      logical :: remembers
      integer :: j

      remembers = present(history)
      mean = 0.0_dp
      if (remembers) mean = field_sum(stiffness, rows, history)/real(size(gap), dp)
      !$omp parallel do default(none) shared(stiffness, problem, height, gap) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(gap, 2)
         call stiffness%forward_row(1, j, (height(:, j) - problem%datum) + gap(:, j))
      end do
      call stiffness%columns(columns_apply, form)
      !$omp parallel do default(none) private(j) &
      !$omp shared(stiffness, problem, traction, history, mean, remembers) num_threads(stiffness%threads)
      do j = 1, size(gap, 2)
         call stiffness%backward_row(1, j, traction(:, j))
         traction(:, j) = problem%modulus*traction(:, j)
         if (remembers) traction(:, j) = traction(:, j) - (history(:, j) - mean)
      end do
   end subroutine evaluate_traction

   !> The gradient less the load p; and p, the mean multiplier over the open cells, where the approach
   !> is prescribed.
   subroutine evaluate_load(threads, rows, problem, gap, traction, gradient, load)
      integer, intent(in) :: threads
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: gap(:, :), traction(:, :)
      real(dp), intent(inout) :: gradient(:, :)        !! out: traction + e'(g), Pa
      real(dp), intent(inout) :: load                  !! p, Pa
      real(dp) :: s1
      integer :: i, j, n

      !$omp parallel do default(none) shared(rows, problem, gap, traction, gradient) &
      !$omp private(i, j, s1, n) num_threads(threads)
      do j = 1, size(gap, 2)
         s1 = 0.0_dp
         n = 0
         do i = 1, size(gap, 1)
            gradient(i, j) = traction(i, j) + adhesive_slope(problem%potential, gap(i, j))
            if (gap(i, j) > 0.0_dp) then
               s1 = s1 + gradient(i, j)
               n = n + 1
            end if
         end do
         rows(1, j) = s1
         rows(2, j) = real(n, dp)
      end do
      if (problem%control == control_approach) load = -row_total(rows, 1)/row_total(rows, 2)
   end subroutine evaluate_load

   !> Are all gaps so wide that the attraction no longer balances the pull anywhere?
   pure function is_detached(problem, load, least) result(detached)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: load                     !! p, Pa
      real(dp), intent(in) :: least                    !! least gap, m
      logical :: detached

      detached = problem%control == control_pressure .and. load < 0.0_dp .and. &
         least > 3.0_dp*problem%potential%range
      if (detached) detached = adhesive_slope(problem%potential, least) < -load
   end function is_detached

   !> P = p + traction, and the error of the load or of the mean gap.
   subroutine finish(stiffness, rows, problem, load, total, gap, pressure, outcome)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: load, total
      real(dp), intent(in) :: gap(:, :)
      real(dp), intent(inout) :: pressure(:, :)
      type(solver_result_type), intent(inout) :: outcome
      real(dp) :: mean
      integer :: j

      !$omp parallel do default(none) shared(pressure, load) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(pressure, 2)
         pressure(:, j) = pressure(:, j) + load
      end do
      if (problem%control == control_approach) then
         outcome%load_error = abs(field_sum(stiffness, rows, gap) - total)/total
      else
         mean = field_sum(stiffness, rows, pressure)/real(size(gap), dp)
         outcome%load_error = abs(mean - load)/max(abs(load), &
            epsilon(1.0_dp)*largest(stiffness, rows, pressure), tiny(1.0_dp))
      end if
   end subroutine finish

   !> Sum of a field.
   function field_sum(stiffness, rows, field) result(total)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      real(dp), intent(in) :: field(:, :)
      real(dp) :: total
      integer :: j

      !$omp parallel do default(none) shared(rows, field) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(field, 2)
         rows(1, j) = sum(field(:, j))
      end do
      total = row_total(rows, 1)
   end function field_sum

   !> Largest magnitude of a field.
   function largest(stiffness, rows, field) result(value)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      real(dp), intent(in) :: field(:, :)
      real(dp) :: value
      integer :: j

      !$omp parallel do default(none) shared(rows, field) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(field, 2)
         rows(1, j) = maxval(abs(field(:, j)))
      end do
      value = max(global_max(maxval(rows(1, :))), tiny(1.0_dp))
   end function largest

   !> Root mean square of a field about its mean.
   function rms(stiffness, rows, field, mean) result(value)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)            !! work, at least [2, ny]
      real(dp), intent(in) :: field(:, :)
      real(dp), intent(in) :: mean
      real(dp) :: value
      integer :: j

      !$omp parallel do default(none) shared(rows, field, mean) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(field, 2)
         rows(1, j) = sum((field(:, j) - mean)**2)
      end do
      value = max(sqrt(row_total(rows, 1)/real(size(field), dp)), tiny(1.0_dp))
   end function rms

   !> The units in which the natural residual is measured: z_0 and gamma_0/z_0; without adhesion the rms
   !> height and the largest of what pressures there are.
   subroutine residual_units(stiffness, rows, problem, height, traction, load, longest, length, scale)
      type(convolution_type), intent(inout) :: stiffness
      real(dp), intent(inout) :: rows(:, :)
      type(adhesion_problem_type), intent(in) :: problem
      real(dp), intent(in) :: height(:, :), traction(:, :)
      real(dp), intent(in) :: load                     !! p, Pa
      real(dp), intent(in) :: longest                  !! B at the least wave number, for G = 1
      real(dp), intent(out) :: length                  !! m
      real(dp), intent(out) :: scale                   !! Pa
      real(dp) :: deviation, greatest

      deviation = rms(stiffness, rows, height, &
         field_sum(stiffness, rows, height)/real(size(height), dp))
      length = problem%potential%range
      if (.not. length > 0.0_dp) length = deviation
      greatest = max(abs(load), largest(stiffness, rows, traction))
      scale = max(resolved_traction(problem, greatest, &
         0.5_dp*maxval(shape(height))*longest, deviation), &
         traction_scale(problem%potential, max(greatest, problem%modulus*longest*deviation)))
   end subroutine residual_units

end module adhesion_periodic_state
