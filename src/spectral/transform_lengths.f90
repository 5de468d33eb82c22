!> Lengths that are cheap to transform.
!>
!> FFTW needs the fewest operations for lengths whose only prime factors are 2, 3 and 5. It has special code
!> for the factors 7, 11 and 13, too, but that moves more data. Larger primes need general algorithms
!> (Rader, Bluestein) that take several times as long. A user who is free to choose the number of cells
!> should therefore know the good lengths next to the chosen one.
module transform_lengths
   use asperity_precision, only : dp
   implicit none
   private

   public :: good_length, length_warning

   !> Time per cell of the transforms along one direction, relative to lengths with the factors 2, 3 and 5 only, for a
   !> largest prime factor of up to 5, 7, up to 13, and more. These are means over grids of 512 to 2048 cells along a side
   !> with FFTW 3.3.10 (products of the operator, one thread). Primes themselves take up to twice as long as the mean.
   real(dp), parameter :: cost_of_factor(4) = [1.0_dp, 1.4_dp, 1.5_dp, 3.5_dp]

   !> Shorter lengths are not worth a warning: such runs are short.
   integer, parameter :: shortest_warned = 128

   !> Largest factor of the time of both directions that is not worth a warning.
   real(dp), parameter :: tolerated_cost = 1.5_dp

contains

   !> The next length from `n` on, upwards or downwards, that has no prime factor above 5.
   pure function good_length(n, step) result(length)
      integer, intent(in) :: n      !! where the search starts, at least 1
      integer, intent(in) :: step   !! 1 and -1 search all lengths upwards and downwards, 2 and -2 every other
      integer :: length

      length = n
      do while (largest_factor(length) > 5)
         length = length + step
      end do
   end function good_length

   !> A warning if the transforms of a periodic grid take much longer than those of a slightly larger or
   !> smaller one. Empty if all is well.
   pure function length_warning(name, n, other) result(text)
      character(*), intent(in) :: name   !! 'nx' or 'ny'
      integer, intent(in) :: n           !! cells along this direction
      integer, intent(in) :: other       !! cells along the other direction
      character(:), allocatable :: text
      character(240) :: line
      real(dp) :: ratio

      text = ''
      if (n < shortest_warned) return
      ratio = (cost(n) + cost(other))/(1.0_dp + cost(other))
      if (ratio <= tolerated_cost) return
      write (line, '(2(a, i0), a, f0.1, 2(a, i0), a)') &
         name//' = ', n, ' has the prime factor ', largest_factor(n), ': the Fourier transforms take about ', &
         ratio, ' times as long as with '//name//' = ', good_length(n, -1), ' or ', good_length(n, 1), &
         ', which have no prime factor above 5'
      text = '&grid: '//trim(line)
   end function length_warning

   !> Time of a transform of this length per cell, relative to good lengths.
   pure real(dp) function cost(n)
      integer, intent(in) :: n

      select case (largest_factor(n))
      case (:5)
         cost = cost_of_factor(1)
      case (7)
         cost = cost_of_factor(2)
      case (11, 13)
         cost = cost_of_factor(3)
      case default
         cost = cost_of_factor(4)
      end select
      if (n == 1) cost = 0.0_dp
   end function cost

   !> Largest prime factor of n; 1 for n = 1.
   pure integer function largest_factor(n)
      integer, intent(in) :: n
      integer :: rest, factor

      largest_factor = 1
      rest = n
      factor = 2
      do while (rest > 1)
         if (mod(rest, factor) == 0) then
            largest_factor = factor
            rest = rest/factor
         else if (factor > rest/factor) then
            factor = rest
         else
            factor = factor + 1
         end if
      end do
   end function largest_factor

end module transform_lengths
