!> The kinds of integers in the interface of HDF5.
module hdf5_kinds
   use, intrinsic :: iso_c_binding, only : c_int64_t, c_size_t
   implicit none
   private

   integer, parameter, public :: hid_t = c_int64_t      !! ids of objects
   integer, parameter, public :: hsize_t = c_int64_t    !! extents
   integer, parameter, public :: size_t = c_size_t      !! bytes in memory

end module hdf5_kinds
