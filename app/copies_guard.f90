!> Ends the program if mpirun or srun has started several independent copies of it.
!>
!> Without MPI, or with an MPI library that does not belong to the launcher, each copy would compute the whole
!> case, and all would write to the same result. The launchers state the number of processes in environment
!> variables. Some of these (SLURM_NTASKS) are also set in a Slurm job with several tasks outside of srun;
!> therefore only variables that a launcher sets for each process are read.
module copies_guard
   use asperity_errors, only : error_input, error_type, fail
   use asperity_parallel, only : parallel_library
   use text_tools, only : to_text
   implicit none
   private

   public :: refuse_copies

   !> Variables with the number of processes: Open MPI; MPICH, Intel MPI and srun with PMI; MVAPICH.
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
