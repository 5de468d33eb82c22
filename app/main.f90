!> The program `asperity`.
program main
   use version, only : asperity_version
   implicit none

   print '(a)', 'asperity '//asperity_version
end program main
