!> Bench of the normal solver: one rough problem, solved once, with its figures on one line.
!>
!>     fpm run --profile release --example bench_normal -- N LOAD THREADS PRECISION [FOLDER]
!>
!> PRECISION is double or mixed. N x N cells, L = 1 m, modes 4 to N/16, Hurst exponent 0.8, rms slope
!> 0.1, E* = 1 Pa, mean pressure LOAD x E* x slope, tolerance 1e-6. Printed: iterations, transforms,
!> error, fraction in contact; seconds of processor and wall time of the solve; the same of one
!> transform, from products with the double operator before and after it; the number of transforms in
!> single precision and the processor time of one; peak memory in fields of N x N doubles. With FOLDER,
!> the height and the pressure are written there as raw doubles.
program bench_normal
   use asperity_errors, only : error_type
   use fft_conv, only : convolution_type
   use field_sums, only : field_mean, field_rms
   use kernels, only : normal_half_space
   use normal_cg, only : new_normal_solver, normal_solver_type
   use normal_state, only : normal_problem_type
   use omp_lib, only : omp_get_wtime
   use asperity_threads, only : set_threads
   use asperity_precision, only : dp, int64
   use regular_grid, only : boundary_periodic, grid_type, new_grid
   use solver_result, only : solver_result_type
   use asperity_surface, only : new_height
   use surface_settings, only : default_surface, surface_settings_type
   implicit none

   type(normal_solver_type) :: solver
   type(normal_problem_type) :: problem
   type(solver_result_type) :: outcome
   type(grid_type) :: grid
   type(surface_settings_type) :: term(1)
   type(error_type), allocatable :: error
   real(dp), allocatable :: height(:, :), pressure(:, :), gap(:, :)
   real(dp) :: load, level, start(2), finish(2), transform(2), single(2), solve(2), peak
   integer :: n, threads, j
   integer(int64) :: before
   character(8) :: precision
   character(*), parameter :: usage = 'usage: bench_normal N LOAD THREADS double|mixed [FOLDER]'

   n = nint(number(1))
   load = number(2)
   threads = nint(number(3))
   call set_threads(threads)
   grid = new_grid(n, n, 1.0_dp, 1.0_dp, boundary_periodic)
   term(1) = default_surface(grid)
   term(1)%shape = 'self_affine'
   term(1)%hurst = 0.8_dp
   term(1)%wavelength_long = 0.25_dp
   term(1)%wavelength_rolloff = 0.25_dp
   term(1)%wavelength_short = 16.0_dp/n
   term(1)%rms_slope = 0.1_dp
   term(1)%seed = 1
   call new_height(grid, term, height, error)
   if (allocated(error)) error stop 'no surface'
   ! The pages of the caller's fields are in memory, as in all solves of a simulation but the first.
   allocate (pressure(n, n), gap(n, n), source=0.0_dp)
   call get_command_argument(4, precision)
   if (all(precision /= ['double', 'mixed '])) error stop usage
   call new_normal_solver(solver, grid, normal_half_space(0.5_dp), error, precision == 'mixed')
   if (allocated(error)) error stop 'no solver'
   problem%modulus = 0.25_dp
   problem%target = 0.1_dp*load
   problem%rms_height = field_rms(height, field_mean(height))

   ! A solve without a load brings the pages of the solver's own fields into memory, too.
   problem%target = 0.0_dp
   call solver%solve(problem, height, pressure, gap, level, outcome)
   problem%target = 0.1_dp*load
   transform = products(solver%operator)
   transform = products(solver%operator)
   single = 0.0_dp
   if (solver%mixed) single = products(solver%quick)
   before = solver%quick%ffts
   start = clocks()
   call solver%solve(problem, height, pressure, gap, level, outcome)
   finish = clocks()
   solve = finish - start
   before = solver%quick%ffts - before
   transform = min(transform, products(solver%operator))
   if (solver%mixed) single = min(single, products(solver%quick))
   peak = peak_memory()/(8.0_dp*real(n, dp)**2)
   do j = 1, n
      gap(:, j) = merge(1.0_dp, 0.0_dp, pressure(:, j) > 0.0_dp)
   end do
   print '(a, i0, a, i0, a, es9.2, a, f7.4, 4(a, f9.5), a, i0, a, f9.5, a, f6.2, 2a)', &
      'iterations=', outcome%iterations, ' ffts=', outcome%ffts, ' e1=', outcome%residual, &
      ' area=', sum(gap)/size(gap), ' cpu=', solve(1), ' wall=', solve(2), &
      ' fft_cpu=', transform(1), ' fft_wall=', transform(2), &
      ' single_ffts=', before, ' single_cpu=', single(1), ' fields=', peak, &
      ' reason=', trim(outcome%reason)
   if (command_argument_count() > 4) then
      call write_field('height', height)
      call write_field('pressure', pressure)
   end if
   call solver%destroy()

contains

   !> Argument number i.
   function number(i) result(value)
      integer, intent(in) :: i
      real(dp) :: value
      character(32) :: text
      integer :: status

      call get_command_argument(i, text)
      read (text, *, iostat=status) value
      if (status /= 0) error stop usage
   end function number

   !> Processor time of all threads and wall time, s.
   function clocks() result(now)
      real(dp) :: now(2)

      call cpu_time(now(1))
      now(2) = omp_get_wtime()
   end function clocks

   !> The least time of one transform in five products.
   function products(operator) result(best)
      type(convolution_type), intent(inout) :: operator
      real(dp) :: best(2), began(2)
      integer :: k

      best = huge(1.0_dp)
      do k = 1, 5
         began = clocks()
         call operator%apply(height, gap)
         best = min(best, (clocks() - began)/2.0_dp)
      end do
   end function products

   !> Peak resident memory, bytes, where the system tells (Linux).
   function peak_memory() result(bytes)
      real(dp) :: bytes
      character(128) :: line
      integer :: unit, status

      bytes = 0.0_dp
      open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (line(1:6) == 'VmHWM:') then
            read (line(7:index(line, 'kB') - 1), *) bytes
            bytes = 1024.0_dp*bytes
         end if
      end do
      close (unit)
   end function peak_memory

   !> Write a field as raw doubles.
   subroutine write_field(name, field)
      character(*), intent(in) :: name
      real(dp), intent(in) :: field(:, :)
      character(1024) :: folder
      integer :: unit

      call get_command_argument(5, folder)
      open (newunit=unit, file=trim(folder)//'/'//name, access='stream', form='unformatted', &
         status='replace', action='write')
      write (unit) field
      close (unit)
   end subroutine write_field

end program bench_normal
