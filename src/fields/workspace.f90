!> Scratch memory with an owner: fields that a procedure borrows under a name and gives back.
!>
!> The owner of a workspace passes it to the stages of its work. A stage borrows a field for as long as it needs
!> one, under the name of what the field will hold, and gives it back before it ends. The next stage uses
!> the same fields again, so that the memory is that of the stage that needs most. Therefore no stage has to use
!> a field of another one, or to own a field that it needs only for a moment.
!>
!> The values of a borrowed field are undefined until the borrower sets them. A workspace must not be copied or
!> used by several threads at once. Several threads may use a field that it has lent.
module workspace
   use asperity_precision, only : dp
   implicit none
   private

   public :: workspace_type, new_workspace

   !> A field that is lent at present, or free.
   type :: field_type
      character(:), allocatable :: name                !! what it holds; '' while it is free
      real(dp), pointer, contiguous :: values(:, :) => null()
   end type field_type

   !> The fields of one shape.
   type :: workspace_type
      private
      integer :: nx = 0, ny = 0
      type(field_type), allocatable :: fields(:)
   contains
      procedure :: lend
      procedure :: take_back
      procedure :: destroy
   end type workspace_type

contains

   !> Make a workspace. Its fields are allocated when they are first needed.
   subroutine new_workspace(self, nx, ny)
      type(workspace_type), intent(out) :: self
      integer, intent(in) :: nx, ny                    !! shape of the fields

      self%nx = nx
      self%ny = ny
      allocate (self%fields(0))
   end subroutine new_workspace

   !> Lend a field.
   subroutine lend(self, name, field)
      class(workspace_type), intent(inout) :: self
      character(*), intent(in) :: name                 !! what it will hold
      real(dp), pointer, contiguous, intent(out) :: field(:, :)   !! [nx, ny]
      type(field_type), allocatable :: more(:)
      integer :: k

      do k = 1, size(self%fields)
         if (self%fields(k)%name == '') exit
      end do
      if (k > size(self%fields)) then
         allocate (more(k))
         more(:k - 1) = self%fields
         allocate (more(k)%values(self%nx, self%ny))
         call move_alloc(more, self%fields)
      end if
      self%fields(k)%name = name
      field => self%fields(k)%values
   end subroutine lend

   !> Take a field back from its borrower.
   subroutine take_back(self, field)
      class(workspace_type), intent(inout) :: self
      real(dp), pointer, contiguous, intent(inout) :: field(:, :)
      integer :: k

      do k = 1, size(self%fields)
         if (associated(field, self%fields(k)%values)) self%fields(k)%name = ''
      end do
      nullify (field)
   end subroutine take_back

   !> Free the fields, which must not be used any more.
   subroutine destroy(self)
      class(workspace_type), intent(inout) :: self
      integer :: k

      if (.not. allocated(self%fields)) return
      do k = 1, size(self%fields)
         deallocate (self%fields(k)%values)
      end do
      deallocate (self%fields)
   end subroutine destroy

end module workspace
