!> Stops copies of the program that mpirun or srun started side by side.
!>
!> Without MPI, or with one that the launcher does not belong to, each copy would compute the whole case,
!> and all would write to the same result. The launchers tell each process how many there are in variables
!> of the environment. A job of Slurm with several tasks sets the same variables outside of srun too
!> (SLURM_NTASKS), so only those that a launcher sets for a process are read.
module copies_guard
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : parallel_library
   use text_tools, only : to_text
   implicit none
   private

   public :: refuse_copies

   !> Number of processes: Open MPI; MPICH, Intel MPI and srun with PMI; MVAPICH.
   character(*), parameter :: variables(3) = [character(20) :: &
      'OMPI_COMM_WORLD_SIZE', 'PMI_SIZE', 'MV2_COMM_WORLD_SIZE']

contains

   !> Fail if this process is one of several copies that a launcher started.
   subroutine refuse_copies(error)
      type(error_type), allocatable, intent(out) :: error
      character(:), allocatable :: reason, way
      character(20) :: value
      integer :: i, copies, status

      do i = 1, size(variables)
         call get_environment_variable(trim(variables(i)), value, status=status)
         if (status /= 0) cycle
         read (value, *, iostat=status) copies
         if (status /= 0 .or. copies <= 1) cycle
         if (parallel_library() == '') then
            reason = 'it was built without MPI'
            way = 'start it once, with --threads N for several cores, or start asperity-mpi'
         else
            reason = 'it was built with '//parallel_library()//', which does not know this launcher'
            way = 'start it with the mpirun of that library'
         end if
         call fail(error, error_input, 'asperity: '//trim(variables(i))//' = '//to_text(copies)// &
            ': this program was started several times side by side (mpirun, srun), but '//reason// &
            ', and every copy would write the same result; '//way)
         return
      end do
   end subroutine refuse_copies

end module copies_guard
