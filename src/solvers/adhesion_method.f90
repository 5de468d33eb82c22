!> The interface of a method for adhesive contact.
!>
!> To add a method, extend `adhesion_method_type` in a module of its own, and add its name to `new_adhesion_solver`
!> (module `adhesion_cg`).
module adhesion_method
   use adhesion_patch, only : adhesion_contact_type
   use solver_result, only : solver_result_type
   implicit none
   private

   public :: adhesion_method_type

   !> A method with its operators and work fields, kept from step to step. A variable of this type must not be copied.
   type, abstract :: adhesion_method_type
   contains
      procedure(solve_contact), deferred :: solve
      procedure(free_memory), deferred :: destroy
   end type adhesion_method_type

   abstract interface

      !> Solve an adhesive contact problem. A solve that does not converge is an outcome; the contact then has the
      !> lowest energy so far.
      subroutine solve_contact(self, contact, outcome)
         import :: adhesion_contact_type, adhesion_method_type, solver_result_type
         implicit none
         class(adhesion_method_type), intent(inout), target :: self
         !> On entry it has the problem, its fields and the start; on return gap, pressure and level of the solution.
         type(adhesion_contact_type), intent(inout) :: contact
         type(solver_result_type), intent(out) :: outcome
      end subroutine solve_contact

      !> Free plans and memory.
      subroutine free_memory(self)
         import :: adhesion_method_type
         implicit none
         class(adhesion_method_type), intent(inout) :: self
      end subroutine free_memory

   end interface

end module adhesion_method
