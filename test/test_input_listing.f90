!> Tests of the input as lines for other programs.
module test_input_listing
   use, intrinsic :: iso_fortran_env, only : int64
   use check, only : begin_suite, check_error, check_no_error, check_that, selected
   use asperity_errors, only : error_type
   use input_listing, only : field_separator, input_table, list_values
   use input_reference, only : group_entries, variable_entries
   use asperity_precision, only : dp
   implicit none
   private

   public :: run_input_listing

   character(*), parameter :: nl = new_line('a')

contains

   subroutine run_input_listing()
      call begin_suite('input_listing')
      if (selected('every_group_and_variable_is_listed')) call every_group_and_variable_is_listed()
      if (selected('values_come_in_order')) call values_come_in_order()
      if (selected('reals_come_back_to_the_bit')) call reals_come_back_to_the_bit()
      if (selected('long_lists_are_kept')) call long_lists_are_kept()
      if (selected('faults_are_those_of_the_reader')) call faults_are_those_of_the_reader()
   end subroutine run_input_listing

   !> There is one line for each group and each variable.
   subroutine every_group_and_variable_is_listed()
      character(:), allocatable :: text
      integer :: i, lines

      text = input_table()
      lines = 0
      do i = 1, len(text)
         if (text(i:i) == nl) lines = lines + 1
      end do
      call check_that(lines == size(group_entries()) + size(variable_entries()), 'one line an entry')
      call check_that(index(text, fields('variable', 'grid', 'nx', 'integer', '(required)', '', 'positive')) > 0, &
         'the entry of grid: nx')
      call check_that(index(text, 'group'//field_separator//'phase'//field_separator//'yes'// &
         field_separator//'yes'//field_separator) > 0, 'a phase is required and repeatable')
   end subroutine every_group_and_variable_is_listed

   !> Values of all kinds are listed, variables in the order of the table and groups in that of the text.
   subroutine values_come_in_order()
      character(:), allocatable :: listing
      type(error_type), allocatable :: error

      call list_values('&phase relaxed = T, name = ''it''''s'' / &grid ny = 4, nx=8 / &phase /'// &
         '&output snapshot_fields = ''GAP'', "pressure" /', 'a.nml', listing, error)
      call check_no_error(error, 'values are listed')
      if (allocated(error)) return
      call check_that(listing == '&phase'//nl//'name'//field_separator//'it''s'//nl//'relaxed'// &
         field_separator//'T'//nl//'&grid'//nl//'nx'//field_separator//'8'//nl//'ny'//field_separator//'4'// &
         nl//'&phase'//nl//'&output'//nl//'snapshot_fields'//field_separator//'gap'//field_separator// &
         'pressure'//nl, 'the listing of values: '//listing)
      call list_values('', 'a.nml', listing, error)
      call check_no_error(error, 'an empty text')
      call check_that(len(listing) == 0, 'an empty text lists nothing')
   end subroutine values_come_in_order

   !> Reals are read back with the same bits.
   subroutine reals_come_back_to_the_bit()
      real(dp), parameter :: numbers(6) = [0.1_dp, 1.0_dp/3.0_dp, -4.9406564584124654e-324_dp, huge(1.0_dp), &
         2.2250738585072014e-308_dp, -0.0_dp]
      character(:), allocatable :: listing
      type(error_type), allocatable :: error
      character(40) :: digits
      real(dp) :: again
      integer :: i, status

      do i = 1, size(numbers)
         write (digits, '(es40.17e3)') numbers(i)
         call list_values('&phase displacement = '//trim(adjustl(digits))//' /', 'a.nml', listing, error)
         call check_no_error(error, 'a number is read')
         if (allocated(error)) return
         read (listing(index(listing, field_separator) + 1:), *, iostat=status) again
         call check_that(status == 0 .and. transfer(again, 0_int64) == transfer(numbers(i), 0_int64), &
            'the same bits: '//digits)
      end do
   end subroutine reals_come_back_to_the_bit

   !> Long lists are not shortened.
   subroutine long_lists_are_kept()
      character(:), allocatable :: listing
      type(error_type), allocatable :: error
      integer :: i, n

      call list_values('&material prony_g = 5000*1.0 /', 'a.nml', listing, error)
      call check_no_error(error, 'a long list')
      if (allocated(error)) return
      n = 0
      do i = 1, len(listing)
         if (listing(i:i) == field_separator) n = n + 1
      end do
      call check_that(n == 5000, 'all values of a long list')
   end subroutine long_lists_are_kept

   !> Faults are those of the reader of the input.
   subroutine faults_are_those_of_the_reader()
      character(:), allocatable :: listing
      type(error_type), allocatable :: error

      call list_values('&grid nxx = 4, lx = -1 /', 'a.nml', listing, error)
      call check_error(error, 'a.nml: &grid: nxx: there is no such variable; did you mean nx?', 'a wrong name')
      call check_error(error, 'lx = -1: must be a positive number', 'a wrong value')
      call list_values('&case title = '''//field_separator//''' /', 'a.nml', listing, error)
      call check_error(error, 'a character that is not text', 'the separator cannot be given')
   end subroutine faults_are_those_of_the_reader

   !> Fields of a line, each followed by the separator.
   function fields(a, b, c, d, e, f, g) result(line)
      character(*), intent(in) :: a, b, c, d, e, f, g
      character(:), allocatable :: line

      line = a//field_separator//b//field_separator//c//field_separator//d//field_separator//e// &
         field_separator//f//field_separator//g//field_separator
   end function fields

end module test_input_listing
