!> Blocks of columns that processes exchange, in single precision, for module `row_column_single`.
module column_parcels_single
   use asperity_parallel, only : global_max, process_number
   use process_exchange, only : exchange
   use asperity_precision, only : dp, wp => sp
   use transform_shape, only : transform_shape_type
   implicit none
   private

   public :: column_parcels_type, new_column_parcels

   include 'column_parcels.inc'      ! state 7f7c0bd3, written by tools/check_sources.py --update

end module column_parcels_single
