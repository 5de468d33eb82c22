!> The interface of all friction laws: the largest shear stress that the contact bears under a pressure.
!>
!> The law bounds the force along the surface, per area, at one point:
!>
!>     |force along the surface| <= force(N),  and <= strength_beside where there is one
!>
!> with N the pressure on the surface, Pa, not negative. Module `friction_law` puts this bound on the slope of
!> the road, where the friction force itself changes N.
!>
!> A law is one file with an extension of the type below, and one line in module `shear_laws`. Solvers never check
!> which law they have. They only use its procedures and its constants.
!>
!> A cell may bear only a part of its bound: share(1) is the fraction of the part that grows with the pressure,
!> and share(2) the fraction of the strengths. Both are 1 in a whole cell.
module shear_law
   use asperity_precision, only : dp
   implicit none
   private

   public :: shear_law_type

   !> A friction law.
   type, abstract :: shear_law_type
      !> By how much the bound grows with the pressure where that is small. On a slope the bound must grow by
      !> this much at every pressure.
      real(dp) :: coefficient = 0.0_dp
      !> The bound without pressure, Pa. Where it is positive, the traction jumps at the edge of the contact.
      real(dp) :: bare_strength = 0.0_dp
      !> A limit of the force in addition to `force`, at every pressure, Pa; negative if there is none.
      real(dp) :: strength_beside = -1.0_dp
      !> Variables of the group &friction that the law needs.
      character(16) :: variables(2) = ''
      !> The law may act on the slope of the road: the bound is linear in the pressure, or `strength_beside`.
      logical :: on_slopes = .true.
      !> The name is known, and no constant is missing or outside its range. Solvers refuse other laws.
      logical :: legal = .false.
   contains
      procedure(forces_of_row), deferred :: forces
      procedure(force_of_cell), deferred :: force
      procedure :: uses
   end type shear_law_type

   abstract interface
      !> The bounds of a row of whole cells, for loops that must not branch.
      pure subroutine forces_of_row(self, n, force)
         import :: dp, shear_law_type
         class(shear_law_type), intent(in) :: self
         integer, intent(in) :: n
         real(dp), intent(inout) :: force(n)      !! in: N; out: the bound, Pa
      end subroutine forces_of_row

      !> The bound of one cell.
      pure function force_of_cell(self, pressure, share) result(force)
         import :: dp, shear_law_type
         class(shear_law_type), intent(in) :: self
         real(dp), intent(in) :: pressure         !! N >= 0, Pa
         real(dp), intent(in) :: share(2)         !! see the header of this module, 0 to 1
         real(dp) :: force                        !! >= 0, Pa
      end function force_of_cell
   end interface

contains

   !> Does the law need a variable of the group &friction?
   pure function uses(self, variable) result(yes)
      class(shear_law_type), intent(in) :: self
      character(*), intent(in) :: variable
      logical :: yes

      yes = any(self%variables == variable)
   end function uses

end module shear_law
