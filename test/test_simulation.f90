!> Tests of the step loop.
module test_simulation
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : begin_suite, check_close, check_no_error, check_that
   use errors, only : error_type
   use history_row, only : history_row_type
   use precision, only : dp, pi
   use schedule, only : count_rows
   use simulation, only : new_simulation, simulation_type
   implicit none
   private

   public :: run_simulation

   character, parameter :: nl = new_line('a')

contains

   subroutine run_simulation()
      call begin_suite('simulation')
      call test_lee_radok()
      call test_hunter()
   end subroutine run_simulation

   !> Run a case given as text to its end; all rows.
   subroutine run_case(text, rows)
      character(*), intent(in) :: text
      type(history_row_type), allocatable, intent(out) :: rows(:)
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      integer :: k, expected

      call parse_case(text, 'test.nml', case, error)
      call check_no_error(error, 'input')
      if (allocated(error)) return
      call new_simulation(sim, case, error)
      call check_no_error(error, 'simulation')
      if (allocated(error)) return
      expected = count_rows(case%phases)
      allocate (rows(0:expected - 1))
      do k = 0, expected - 1
         call sim%advance(error)
         call check_no_error(error, 'step')
         call check_that(sim%converged, 'converged')
         rows(k) = sim%row
      end do
      call check_that(sim%finished, 'as many rows as expected')
      call check_that(rows(expected - 1)%step == expected - 1, 'rows are numbered from 0')
      call sim%destroy()
   end subroutine run_case

   !> The energy books close in each row.
   subroutine check_books(rows, what)
      type(history_row_type), intent(in) :: rows(0:)
      character(*), intent(in) :: what
      real(dp) :: worst, scale
      integer :: k

      worst = 0.0_dp
      scale = maxval(rows%energy_elastic)
      do k = 0, size(rows) - 1
         worst = max(worst, abs(rows(k)%work_normal + rows(k)%work_tangential - rows(k)%energy_elastic &
            - rows(k)%dissipated_viscous - rows(k)%dissipated_friction))
      end do
      call check_close(worst/scale, 0.0_dp, 1e-12_dp, what//': energy books')
   end subroutine check_books

   !> Lee-Radok: a sphere under a constant load (thesis, 2.2.1).
   subroutine test_lee_radok()
      type(history_row_type), allocatable :: rows(:)
      integer :: k

      call run_case('&grid nx = 64, ny = 64, lx = 0.1e-3, boundary = ''free'' /'//nl// &
         '&surface shape = ''paraboloid'', radius = 1e-3 /'//nl// &
         '&material zener_g0 = 1e6, zener_g1 = 0.1e6, zener_eta = 0.1e6 /'//nl// &
         '&phase force = 0.02e-3, duration = 1, steps = 32 /'//nl// &
         '&solver tolerance = 1e-8 /', rows)
      if (.not. allocated(rows)) return
      do k = 0, size(rows) - 1, 8
         print *, rows(k)%time, sqrt(rows(k)%contact_area*1e-8_dp/pi), rows(k)%displacement, rows(k)%ffts
      end do
      call check_books(rows, 'Lee-Radok')
   end subroutine test_lee_radok

   !> Hunter: a cylinder slides steadily.
   subroutine test_hunter()
      type(history_row_type), allocatable :: rows(:)

      call run_case('&grid nx = 512, ny = 1, lx = 2.0e-3 /'//nl// &
         '&surface shape = ''paraboloid'', radius = 10e-3 /'//nl// &
         '&material zener_g0 = 2.75e6, zener_g1 = 0.3055555555e6, zener_eta = 0.003055555555e6 /'//nl// &
         '&phase force = 1, control = ''pressure'', pressure = 25e3, relaxed = .true., duration = 0.4, velocity_x = 5e-3 /'//nl// &
         '&solver tolerance = 1e-8 /', rows)
      if (.not. allocated(rows)) return
      print *, size(rows), rows(size(rows) - 1)%friction, rows(size(rows) - 1)%contact_area*2e-3, sum(rows%ffts)/size(rows)
      call check_books(rows, 'Hunter')
   end subroutine test_hunter

end module test_simulation
