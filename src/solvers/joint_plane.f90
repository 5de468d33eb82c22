!> A plane across a path of solutions (pseudo-arclength continuation).
!>
!> On a path the road is read at a part of the way to the displaced cells, and this part is an unknown like the pressures
!> and the tractions. The plane is the equation that it needs: the next solution is sought on the plane through a predicted
!> state, perpendicular to the path (H. B. Keller, in: Applications of bifurcation theory, Academic Press 1977, 359). A path
!> may therefore turn back, with a smaller part, and forward again.
!>
!> Lengths of states are measured by the scaled unknowns of the cells in contact and the part:
!>
!>    |x|^2 = (sum of s^2 and T^2 over the cells)/root^2 + part^2,      root^2 the number of cells in contact at the start
module joint_plane
   use asperity_parallel, only : any_process
   use asperity_precision, only : dp
   use field_sums, only : row_total
   use gmres, only : cell_vector_type
   use joint_system, only : joint_state_type, joint_system_type
   use regular_grid, only : grid_type
   implicit none
   private

   public :: joint_plane_type, distance

   real(dp), parameter :: least_angle = 1.0e-3_dp   !! between the path and the plane, in the approximate inverse

   !> A plane.
   type :: joint_plane_type
      logical :: active = .false.                   !! the part is an unknown
      real(dp), allocatable, private :: normal(:, :, :)  !! unit vector across the plane, of s and T [nx, 3, rows]
      real(dp), private :: normal_part = 0.0_dp     !! of the part
      real(dp), private :: offset = 0.0_dp          !! product of the unit vector with a state on the plane
      type(cell_vector_type), private :: listed     !! the unit vector in the unknown cells
      type(cell_vector_type), private :: push       !! approximate change of the unknowns with the part
   contains
      procedure :: make_fields
      procedure :: place
      procedure :: residual
      procedure :: linearise
      procedure :: improve
      procedure :: destroy
      procedure, private :: product
   end type joint_plane_type

contains

   !> Allocate the field. `done` is .false. if there is not enough memory.
   subroutine make_fields(self, grid, done)
      class(joint_plane_type), intent(inout) :: self
      type(grid_type), intent(in) :: grid
      logical, intent(out) :: done
      integer :: status

      status = 0
      if (.not. allocated(self%normal)) &
         allocate (self%normal(grid%nx, 3, grid%rows()), source=0.0_dp, stat=status)
      done = .not. any_process(status /= 0)
   end subroutine make_fields

   !> Place the plane through a predicted state, perpendicular to the line from one state to another.
   subroutine place(self, system, from, to, predicted)
      class(joint_plane_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: from, to, predicted
      real(dp) :: length
      integer :: c, j

      length = distance(system, from, to)
      do j = 1, size(self%normal, 3)
         self%normal(:, 1, j) = (max(to%s(:, j), 0.0_dp) - max(from%s(:, j), 0.0_dp))/(system%unit_length*length)
         do c = 1, 2
            self%normal(:, 1 + c, j) = (to%t(:, c, j) - from%t(:, c, j))/(system%unit_traction*length)
         end do
      end do
      self%normal_part = (to%part - from%part)/length
      self%offset = 0.0_dp
      self%offset = self%residual(system, predicted)
      self%active = .true.
   end subroutine place

   !> The distance of a state from the plane.
   function residual(self, system, state)
      class(joint_plane_type), intent(in) :: self
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: state
      real(dp) :: residual
      real(dp), allocatable :: rows(:)
      integer :: c, j

      allocate (rows(size(self%normal, 3)))
      do j = 1, size(rows)
         rows(j) = sum(self%normal(:, 1, j)*max(state%s(:, j), 0.0_dp))/system%unit_length
         do c = 1, 2
            rows(j) = rows(j) + sum(self%normal(:, 1 + c, j)*state%t(:, c, j))/system%unit_traction
         end do
      end do
      residual = row_total(rows)/system%root**2 + self%normal_part*state%part - self%offset
   end function residual

   !> Prepare `improve` for the unknown cells: list the unit vector in them, and find the approximate change of the
   !> unknowns with the part from the change of the residuals.
   subroutine linearise(self, system, first, cell, change, before)
      class(joint_plane_type), intent(inout) :: self
      class(joint_system_type), intent(in) :: system
      integer, intent(in) :: first(:)               !! [rows + 1] the first cell of each row in the list of cells
      integer, intent(in) :: cell(:)                !! the cells of the list, i
      type(cell_vector_type), intent(in) :: change  !! of the residuals with the part
      integer, intent(in) :: before                 !! listed cells of the processes before this one
      integer :: j, k

      self%push = change
      call system%improve(self%push, before)
      self%listed%cells = change%cells
      do j = 1, size(first) - 1
         do k = first(j), first(j + 1) - 1
            self%listed%cells(:, k) = self%normal(cell(k), :, j)
         end do
      end do
   end subroutine linearise

   !> Replace residuals by approximate changes of the unknowns, of which all but the part have been improved already.
   subroutine improve(self, system, first, v)
      class(joint_plane_type), intent(in) :: self
      class(joint_system_type), intent(in) :: system
      integer, intent(in) :: first(:)
      type(cell_vector_type), intent(inout) :: v
      real(dp) :: across, part

      across = self%normal_part - self%product(system, first, self%push)
      if (abs(across) < least_angle) across = sign(least_angle, across)
      part = (v%beside(2)/system%root - self%product(system, first, v))/across
      v%cells(:, :) = v%cells - part*self%push%cells
      v%beside(1) = v%beside(1) - part*self%push%beside(1)
      v%beside(2) = part*system%root
   end subroutine improve

   !> The product of the unit vector with changes of the unknown cells.
   function product(self, system, first, v)
      class(joint_plane_type), intent(in) :: self
      class(joint_system_type), intent(in) :: system
      integer, intent(in) :: first(:)
      type(cell_vector_type), intent(in) :: v
      real(dp) :: product
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(first) - 1))
      do j = 1, size(rows)
         rows(j) = sum(self%listed%cells(:, first(j):first(j + 1) - 1)*v%cells(:, first(j):first(j + 1) - 1))
      end do
      product = row_total(rows)/system%root**2
   end function product

   !> Free the fields.
   subroutine destroy(self)
      class(joint_plane_type), intent(inout) :: self

      self%active = .false.
      if (allocated(self%normal)) deallocate (self%normal)
      if (allocated(self%listed%cells)) deallocate (self%listed%cells)
      if (allocated(self%push%cells)) deallocate (self%push%cells)
   end subroutine destroy

   !> The distance of two states.
   function distance(system, a, b)
      class(joint_system_type), intent(in) :: system
      type(joint_state_type), intent(in) :: a, b
      real(dp) :: distance
      real(dp), allocatable :: rows(:)
      integer :: j

      allocate (rows(size(a%s, 2)))
      do j = 1, size(rows)
         rows(j) = sum((max(a%s(:, j), 0.0_dp) - max(b%s(:, j), 0.0_dp))**2)/system%unit_length**2 &
            + sum((a%t(:, :, j) - b%t(:, :, j))**2)/system%unit_traction**2
      end do
      distance = sqrt(row_total(rows)/system%root**2 + (a%part - b%part)**2)
   end function distance

end module joint_plane
