#ifndef ASPERITY_VERSION
#define ASPERITY_VERSION unknown
#endif
#define QUOTE_START(X) "&
#define QUOTE_END(X) &X"
!> The version of the library, from the file VERSION through the build system.
module asperity_version
   implicit none
   private

   !> Version number, such as "0.1.0".
   character(*), parameter, public :: version_number = &
      QUOTE_START(ASPERITY_VERSION)
      QUOTE_END(ASPERITY_VERSION)

end module asperity_version
