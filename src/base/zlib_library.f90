!> C functions of zlib, the library of the compression `deflate`.
module zlib_library
   use, intrinsic :: iso_c_binding, only : c_int, c_long, c_null_ptr, c_ptr, c_sizeof
   implicit none
   private

   public :: deflate, deflate_end, deflate_params, start_deflate, stream_type

   integer(c_int), parameter, public :: z_ok = 0, z_stream_end = 1
   integer(c_int), parameter, public :: z_no_flush = 0, z_finish = 4
   integer(c_int), parameter, public :: z_default_strategy = 0, z_huffman_only = 2

   !> C's `z_stream`.
   type, bind(c) :: stream_type
      type(c_ptr) :: next_in = c_null_ptr        !! next byte to be compressed
      integer(c_int) :: avail_in = 0             !! bytes from there on
      integer(c_long) :: total_in = 0
      type(c_ptr) :: next_out = c_null_ptr       !! where the next byte of the output goes
      integer(c_int) :: avail_out = 0            !! bytes that are free from there on
      integer(c_long) :: total_out = 0           !! bytes of the output so far
      type(c_ptr) :: message = c_null_ptr
      type(c_ptr) :: state = c_null_ptr
      type(c_ptr) :: allocator = c_null_ptr      !! null: malloc and free
      type(c_ptr) :: liberator = c_null_ptr
      type(c_ptr) :: opaque = c_null_ptr
      integer(c_int) :: data_type = 0
      integer(c_long) :: adler = 0
      integer(c_long) :: reserved = 0
   end type stream_type

   interface
      function zlib_version() bind(c, name='zlibVersion') result(version)
         import :: c_ptr
         type(c_ptr) :: version
      end function zlib_version

      function deflate_init(stream, level, version, length) bind(c, name='deflateInit_') result(status)
         import :: c_int, c_ptr, stream_type
         type(stream_type), intent(inout) :: stream
         integer(c_int), value :: level
         type(c_ptr), value :: version
         integer(c_int), value :: length         !! of `stream_type`, bytes
         integer(c_int) :: status
      end function deflate_init

      function deflate_params(stream, level, strategy) bind(c, name='deflateParams') result(status)
         import :: c_int, stream_type
         type(stream_type), intent(inout) :: stream
         integer(c_int), value :: level, strategy
         integer(c_int) :: status
      end function deflate_params

      function deflate(stream, flush) bind(c, name='deflate') result(status)
         import :: c_int, stream_type
         type(stream_type), intent(inout) :: stream
         integer(c_int), value :: flush
         integer(c_int) :: status
      end function deflate

      function deflate_end(stream) bind(c, name='deflateEnd') result(status)
         import :: c_int, stream_type
         type(stream_type), intent(inout) :: stream
         integer(c_int) :: status
      end function deflate_end
   end interface

contains

   !> Begin a stream. The status is not `z_ok` if there is not enough memory.
   function start_deflate(stream, level) result(status)
      type(stream_type), intent(inout) :: stream    !! it must not move until `deflate_end`
      integer, intent(in) :: level
      integer(c_int) :: status

      status = deflate_init(stream, int(level, c_int), zlib_version(), int(c_sizeof(stream), c_int))
   end function start_deflate

end module zlib_library
