!> The compiler and the versions of the libraries with which this program was built. They are needed to
!> understand a report of a fault, or a result from a cluster. With the macro ASPERITY_MKL the transforms
!> are those of Intel's MKL, which has the interface of FFTW.
module linked_libraries
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_f_pointer, c_int, c_ptr
   use, intrinsic :: iso_fortran_env, only : compiler_options, compiler_version
   use asperity_parallel, only : parallel_library
   implicit none
   private

   public :: linked_versions

   interface
      !> Version of the HDF5 library; negative if it cannot be asked.
      function h5get_libversion(major, minor, release) bind(c, name='H5get_libversion') result(status)
         import :: c_int
         integer(c_int), intent(out) :: major, minor, release
         integer(c_int) :: status
      end function h5get_libversion

      !> FFTW's wisdom as a text that starts with the version, "(fftw-3.3.10 fftw_wisdom ...". The version
      !> itself is a constant of the C library, which Fortran can only define and not import.
      function fftw_export_wisdom_to_string() bind(c, name='fftw_export_wisdom_to_string') result(text)
         import :: c_ptr
         type(c_ptr) :: text
      end function fftw_export_wisdom_to_string

      subroutine c_free(memory) bind(c, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free
   end interface

contains

   !> Compiler, FFTW, HDF5 and MPI, one per line.
   function linked_versions() result(text)
      character(:), allocatable :: text
      character(:), allocatable :: parallel
      character(40) :: hdf5
      integer(c_int) :: major, minor, release

      hdf5 = 'unknown'
      if (h5get_libversion(major, minor, release) >= 0) then
         write (hdf5, '(i0, 2(".", i0))') major, minor, release
      end if

      parallel = parallel_library()
      if (parallel == '') parallel = 'none'

      text = 'compiler: '//compiler_version()//processors()//new_line('a')// &
         'FFTW: '//fftw_version()//new_line('a')// &
         'HDF5: '//trim(hdf5)//new_line('a')// &
         'MPI: '//parallel//new_line('a')
   end function linked_versions

   !> The processors that the program is restricted to by the vector registers that it uses.
   pure function processors() result(text)
      character(:), allocatable :: text

      text = ''
      if (index(compiler_options(), '-mavx2') > 0) text = ', for processors with AVX2'
   end function processors

#ifdef ASPERITY_MKL
   !> The version of MKL, which stands in for FFTW: "Intel(R) oneAPI Math Kernel Library Version 2026.2 ...".
   function fftw_version() result(text)
      character(:), allocatable :: text
      character(kind=c_char) :: buffer(200)
      integer :: i
      interface
         subroutine mkl_version(buffer, length) bind(c, name='MKL_Get_Version_String')
            import :: c_char, c_int
            character(kind=c_char), intent(out) :: buffer(*)
            integer(c_int), value :: length
         end subroutine mkl_version
      end interface

      call mkl_version(buffer, size(buffer, kind=c_int))
      text = 'none, but '
      do i = 1, size(buffer)
         if (buffer(i) == achar(0)) exit
         text = text//buffer(i)
      end do
      text = trim(text)
   end function fftw_version
#else
   !> The version of FFTW, from the first word of its wisdom.
   function fftw_version() result(text)
      character(:), allocatable :: text
      integer, parameter :: longest = 40
      character(kind=c_char), pointer :: wisdom(:)
      type(c_ptr) :: memory
      integer :: i

      text = ''
      memory = fftw_export_wisdom_to_string()
      if (.not. c_associated(memory)) return
      call c_f_pointer(memory, wisdom, [longest])
      do i = len('(fftw-') + 1, longest
         if (verify(wisdom(i), '0123456789.') > 0) exit
         text = text//wisdom(i)
      end do
      call c_free(memory)
   end function fftw_version
#endif

end module linked_libraries
