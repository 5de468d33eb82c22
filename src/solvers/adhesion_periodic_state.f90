!> What the two methods for adhesive contact in periodic mode share: start, traction, end, measures.
module adhesion_periodic_state
   use adhesion_state, only : adhesion_problem_type, control_approach, row_total, stepped_gap, &
      sum_shift, traction_scale
   use fft_conv, only : columns_apply, convolution_type
   use parallel, only : global_max
   use precision, only : dp
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: evaluate_traction, field_sum, finish, largest, residual_units, start_gap

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
      !$omp parallel do default(none) shared(stiffness, height, gap) private(j) &
      !$omp num_threads(stiffness%threads)
      do j = 1, size(gap, 2)
         call stiffness%forward_row(1, j, height(:, j) + gap(:, j))
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
      real(dp) :: deviation

      deviation = rms(stiffness, rows, height, &
         field_sum(stiffness, rows, height)/real(size(height), dp))
      length = problem%potential%range
      if (.not. length > 0.0_dp) length = deviation
      scale = traction_scale(problem%potential, max(abs(load), &
         largest(stiffness, rows, traction), problem%modulus*longest*deviation))
   end subroutine residual_units

end module adhesion_periodic_state
