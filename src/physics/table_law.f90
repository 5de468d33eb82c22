!> A friction law given by points: the bound at some pressures, with straight lines between them.
!>
!> The table begins at the pressure 0. Beyond its last point the last line is continued if it rises, and the
!> bound is constant if that line falls. The bound is not linear in the pressure; therefore this law cannot be
!> used with the slope effect (module `shear_law`).
!>
!> Python functions are also converted to such tables, because the solvers need the bound in parallel loops,
!> where Python could not be called.
module table_law
   use asperity_precision, only : dp
   use shear_law, only : shear_law_type
   implicit none
   private

   public :: new_table_law, table_law_type

   type, extends(shear_law_type) :: table_law_type
      !> [3, n] Pressure of a point, Pa; the bound there, Pa; and by how much it grows with the pressure up to
      !> the next point.
      real(dp), allocatable :: points(:, :)
   contains
      procedure :: forces
      procedure :: force
   end type table_law_type

contains

   !> Make the law. Without a table, or with an impossible one, it has no friction and is not legal, but still names the
   !> variables that it needs.
   function new_table_law(table) result(self)
      !> [n, 2] Pressures, Pa, that begin at 0 and rise, and the bounds there, Pa, >= 0; two points or more.
      real(dp), intent(in), optional :: table(:, :)
      type(table_law_type) :: self
      integer :: k, n

      self%variables = [character(16) :: 'table_pressure', 'table_strength']
      self%on_slopes = .false.
      allocate (self%points(3, 1), source=0.0_dp)
      if (.not. present(table)) return
      self%legal = describes_bound(table)
      if (.not. self%legal) return
      n = size(table, 1)
      deallocate (self%points)
      allocate (self%points(3, n))
      self%points(1, :) = table(:, 1)
      self%points(2, :) = table(:, 2)
      do k = 1, n - 1
         self%points(3, k) = (table(k + 1, 2) - table(k, 2))/(table(k + 1, 1) - table(k, 1))
      end do
      self%points(3, n) = max(self%points(3, n - 1), 0.0_dp)
      self%coefficient = max(self%points(3, 1), 0.0_dp)
      self%bare_strength = table(1, 2)
   end function new_table_law

   !> Do the numbers describe a bound?
   pure function describes_bound(table) result(yes)
      real(dp), intent(in) :: table(:, :)
      logical :: yes
      integer :: n

      n = size(table, 1)
      yes = n >= 2 .and. size(table, 2) == 2
      if (.not. yes) return
      yes = .not. abs(table(1, 1)) > 0.0_dp .and. all(table(2:, 1) > table(:n - 1, 1)) .and. all(table(:, 2) >= 0.0_dp) &
         .and. all(table <= huge(1.0_dp))
   end function describes_bound

   !> The bounds of a row.
   pure subroutine forces(self, n, force)
      class(table_law_type), intent(in) :: self
      integer, intent(in) :: n
      real(dp), intent(inout) :: force(n)      !! in: N; out: the bound, Pa
      integer :: i

      do i = 1, n
         force(i) = between(self%points, force(i))
      end do
   end subroutine forces

   !> The bound of a cell.
   pure function force(self, pressure, share)
      class(table_law_type), intent(in) :: self
      real(dp), intent(in) :: pressure         !! N, Pa
      real(dp), intent(in) :: share(2)
      real(dp) :: force                        !! Pa

      force = share(1)*(between(self%points, pressure) - self%bare_strength) + share(2)*self%bare_strength
   end function force

   !> The bound at a pressure, on the line behind the last point at or below this pressure, which bisection finds.
   pure function between(points, pressure) result(bound)
      real(dp), intent(in) :: points(:, :)
      real(dp), intent(in) :: pressure
      real(dp) :: bound
      integer :: low, high, middle

      low = 1
      high = size(points, 2) + 1
      do while (high - low > 1)
         middle = (low + high)/2
         if (points(1, middle) <= pressure) then
            low = middle
         else
            high = middle
         end if
      end do
      bound = max(points(2, low) + points(3, low)*(pressure - points(1, low)), 0.0_dp)
   end function between

end module table_law
