!> Runs in memory for the tests of the step loop: a case is given as text, and every row is kept.
module simulation_runs
   use case_input, only : parse_case
   use case_settings, only : case_type
   use check, only : check_close, check_no_error, check_that
   use asperity_errors, only : error_type
   use hdf5_file, only : hdf5_file_type
   use history_row, only : history_row_type
   use asperity_precision, only : dp
   use asperity_schedule, only : count_rows
   use asperity_simulation, only : new_simulation, simulation_type
   use contact_fields, only : field_rows
   implicit none
   private

   public :: check_books, check_same_rows, last, record_type, reference_compliance, run_case, &
      start_case, write_map

   character, parameter, public :: nl = new_line('a')

   !> The results of a run.
   type :: record_type
      type(history_row_type), allocatable :: rows(:)   !! row number, from 0
      real(dp), allocatable :: drag(:, :)              !! horizontal force on the rubber, N [2, row from 0]
      real(dp), allocatable :: height(:, :)            !! of the original map, m
      real(dp), allocatable :: pressure(:, :)          !! of the last row, Pa
      real(dp), allocatable :: gap(:, :)               !! of the last row, m
      real(dp), allocatable :: displacement(:, :)      !! of the last row, m
      real(dp) :: cell_area = 0.0_dp                   !! m2
      character(:), allocatable :: warnings
   end type record_type

contains

   !> Read a case given as text, and prepare its simulation. An error is a failed check.
   subroutine start_case(text, what, case, sim, error)
      character(*), intent(in) :: text
      character(*), intent(in) :: what
      type(case_type), intent(out) :: case
      type(simulation_type), intent(out) :: sim
      type(error_type), allocatable, intent(out) :: error

      call parse_case(text, 'test.nml', case, error)
      call check_no_error(error, what//': input')
      if (allocated(error)) return
      call new_simulation(sim, case, error)
      call check_no_error(error, what//': simulation')
   end subroutine start_case

   !> Run a case given as text to its end. A row that does not converge is a failed check.
   subroutine run_case(text, what, record)
      character(*), intent(in) :: text
      character(*), intent(in) :: what
      type(record_type), intent(out) :: record
      type(case_type) :: case
      type(simulation_type) :: sim
      type(error_type), allocatable :: error
      integer :: k, expected
      logical :: converged

      allocate (record%rows(0:0), record%drag(2, 0:0))
      record%drag = 0.0_dp
      record%warnings = ''
      call start_case(text, what, case, sim, error)
      if (allocated(error)) return
      record%height = sim%height
      record%cell_area = sim%grid%dx*sim%grid%dy
      expected = count_rows(case%phases)
      deallocate (record%rows, record%drag)
      allocate (record%rows(0:expected - 1), record%drag(2, 0:expected - 1))
      converged = .true.
      do k = 0, expected - 1
         call sim%advance(error)
         if (allocated(error)) exit
         converged = converged .and. sim%converged
         record%rows(k) = sim%state%row
         record%drag(:, k) = sim%state%drive_force
      end do
      call check_no_error(error, what//': steps')
      call check_that(converged, what//': converged')
      call check_that(sim%finished .and. sim%state%row%step == expected - 1, &
         what//': as many rows as were counted')
      record%pressure = sim%state%pressure
      record%gap = sim%state%gap
      allocate (record%displacement, mold=record%pressure)
      call field_rows(sim, 'displacement_z', 1, record%displacement)
      record%warnings = sim%warnings
      call sim%destroy()
   end subroutine run_case

   !> Return the number of the last row.
   pure integer function last(record)
      type(record_type), intent(in) :: record

      last = ubound(record%rows, 1)
   end function last

   !> The energy balance closes in each row, and the losses never decrease.
   subroutine check_books(record, what, tolerance)
      type(record_type), intent(in) :: record
      character(*), intent(in) :: what
      real(dp), intent(in), optional :: tolerance      !! relative to the largest energies; round-off by default
      real(dp) :: worst, scale, allowed
      logical :: lost
      integer :: k

      allowed = 1e-12_dp
      if (present(tolerance)) allowed = tolerance
      worst = 0.0_dp
      lost = .true.
      scale = maxval(abs(record%rows%energy_elastic)) + maxval(abs(record%rows%dissipated_viscous))
      do k = 0, last(record)
         associate (row => record%rows(k))
            worst = max(worst, abs(row%work_normal + row%work_tangential - row%energy_elastic &
               - row%energy_adhesive - row%energy_kinetic - row%dissipated_viscous &
               - row%dissipated_friction))
            lost = lost .and. row%dissipated_numerical >= 0.0_dp &
               .and. row%dissipated_numerical <= row%dissipated_viscous + 1e-15_dp*scale
            if (k > 0) lost = lost .and. &
               row%dissipated_viscous >= record%rows(k - 1)%dissipated_viscous - 1e-15_dp*scale
         end associate
      end do
      call check_close(worst/scale, 0.0_dp, allowed, what//': energy balance')
      call check_that(lost, what//': losses never decrease')
   end subroutine check_books

   !> Check that two runs agree: each column within a tolerance relative to its largest value.
   subroutine check_same_rows(a, b, tolerance, what)
      type(record_type), intent(in) :: a, b
      real(dp), intent(in) :: tolerance
      character(*), intent(in) :: what

      call check_that(last(a) == last(b), what//': number of rows')
      if (last(a) /= last(b)) return
      call same('pressure', a%rows%pressure, b%rows%pressure)
      call same('displacement', a%rows%displacement, b%rows%displacement)
      call same('contact_area', a%rows%contact_area, b%rows%contact_area)
      call same('mean_gap', a%rows%mean_gap, b%rows%mean_gap)
      call same('friction', a%rows%friction, b%rows%friction)
      call same('work_normal', a%rows%work_normal, b%rows%work_normal)
      call same('energy_elastic', a%rows%energy_elastic, b%rows%energy_elastic)
      call same('dissipated_viscous', a%rows%dissipated_viscous, b%rows%dissipated_viscous)
      call same('work_load', a%rows%work_load, b%rows%work_load)
      call same('work_drive', a%rows%work_drive, b%rows%work_drive)

   contains

      !> Compare one column.
      subroutine same(name, one, other)
         character(*), intent(in) :: name
         real(dp), intent(in) :: one(:), other(:)

         call check_close(maxval(abs(one - other)), 0.0_dp, tolerance*maxval(abs(one)), what//': '//name)
      end subroutine same

   end subroutine check_same_rows

   !> Return the creep compliance J(t) of a Prony series, from the zeros and residues of its transform: s G(s) = G_e +
   !> sum g s/(s + 1/tau) has one zero between any two neighbouring relaxation rates, and one below the lowest rate.
   !> This function is written independently of module `prony`, so that tests can use it as a reference.
   pure function reference_compliance(g_e, g, tau, t) result(compliance)
      real(dp), intent(in) :: g_e            !! > 0, Pa
      real(dp), intent(in) :: g(:), tau(:)   !! Pa and s; tau ascending
      real(dp), intent(in) :: t              !! s
      real(dp) :: compliance
      real(dp) :: low, high, middle
      integer :: j, k

      compliance = 1.0_dp/g_e
      do j = 1, size(g)
         high = 1.0_dp/tau(j)
         low = 0.0_dp
         if (j < size(g)) low = 1.0_dp/tau(j + 1)
         do k = 1, 200
            middle = 0.5_dp*(low + high)
            if (g_e + sum(g*middle/(middle - 1.0_dp/tau)) > 0.0_dp) then
               low = middle
            else
               high = middle
            end if
         end do
         middle = 0.5_dp*(low + high)
         compliance = compliance - exp(-middle*t) &
            /(middle*sum(g/tau/(1.0_dp/tau - middle)**2))
      end do
   end function reference_compliance

   !> Write a height map to a file that `&surface shape = 'file'` reads.
   subroutine write_map(path, map)
      character(*), intent(in) :: path
      real(dp), intent(in) :: map(:, :)
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error

      call file%open(path, 'create', error)
      call check_no_error(error, path)
      if (allocated(error)) return
      call file%write('surface', map, 'm', 'height', error)
      call check_no_error(error, path)
      call file%close(error)
      call check_no_error(error, path)
   end subroutine write_map

end module simulation_runs
