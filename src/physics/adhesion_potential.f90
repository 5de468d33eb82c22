!> The adhesive potential e(g): energy per area between two surfaces at the gap g >= 0.
!>
!> (Thesis, eq. 2.20 and 2.21.)
!>     exponential        e = -gamma_0 exp(-g/z_0)
!>     gauss              e = -gamma_0 exp(-(g/z_0)^2)
!>     maugis_dugdale     e = -gamma_0 (1 - g/z_0) for g < z_0, else 0: a constant attraction that
!>                        ends at the edge of the range
!> The adhesive pressure is -e'(g). A point in contact lets go where its pressure falls below
!> -e'(0+): -gamma_0/z_0 for the exponential and Maugis-Dugdale potentials, 0 for Gauss.
!>
!> The attraction of maugis_dugdale jumps at g = z_0 (its value there is 0). On a grid such a jump pins
!> the contact: when one cell leaves the range, it springs back by about 1.1 gamma_0/z_0 dx/E*, and if
!> that is more than the change of the gap from cell to cell, the edge of the range cannot advance. With
!> `edge` > 0 the attraction falls linearly from z_0 - edge to z_0 + edge instead, as the mean over a
!> cell does while the edge of the range passes through that cell:
!>     e = -gamma_0/z_0 (z_0 + edge - g)^2/(4 edge)        for |g - z_0| < edge.
!> The work of separation and all other properties remain the same. `edge_of_cells` is the least width that
!> prevents the pinning.
!>
!> Any other potential is given by a table of its attraction (`new_tabulated_potential`): cubic Hermite
!> interpolation between equidistant gaps, and zero beyond the last one. The energy is the exact integral of
!> the interpolated attraction, and the curvature is its derivative, so that the three are consistent. A table is
!> necessary because the solvers call these functions in parallel loops, where a procedure of the user, or a
!> Python function, could not be called.
module adhesion_potential
   use asperity_errors, only : add_fault, error_input, error_type
   use asperity_precision, only : dp, int64
   use text_tools, only : to_text
   implicit none
   private

   public :: adhesion_potential_type, adhesive_curvature, adhesive_energy, adhesive_slope, adhesive_slopes, &
      adhesive_terms, has_smooth_potential, edge_of_cells, new_adhesion_potential, &
      new_tabulated_potential, stiffens

   integer, parameter, public :: potential_none = 0
   integer, parameter, public :: potential_exponential = 1
   integer, parameter, public :: potential_gauss = 2
   integer, parameter, public :: potential_maugis_dugdale = 3
   integer, parameter, public :: potential_table = 4

   real(dp), parameter :: edge_width = 1.0_dp  !! half width of the edge in gamma_0/z_0 dx/E*
   real(dp), parameter :: far = 40.0_dp        !! exp(-far) is negligible compared with 1
   integer, parameter :: block = 64            !! cells that are skipped together if all are far

   ! The exponential of many cells (procedure `decay`): 2^(-j/parts) for j = 0 to parts - 1.
   integer, parameter :: part_bits = 6
   integer, parameter :: parts = 2**part_bits
   integer :: j
   real(dp), parameter :: part_powers(0:parts - 1) = [(2.0_dp**(-real(j, dp)/parts), j=0, parts - 1)]

   !> A potential with its constants.
   type :: adhesion_potential_type
      integer :: kind = potential_none
      real(dp) :: energy = 0.0_dp              !! gamma_0, J/m2, >= 0
      real(dp) :: range = 0.0_dp               !! z_0, m, > 0 (0 for 'none')
      real(dp) :: edge = 0.0_dp                !! half width of the edge, m, 0 to z_0; maugis_dugdale
      real(dp) :: spacing = 0.0_dp             !! h, of the gaps of a table, m
      !> [0:4, n] Per interval of a table, with t = (g - g_k)/h from 0 to 1: the energy at its end, J/m2,
      !> and the attraction sum_j table(j, k) t^(j-1), Pa, for j = 1 to 4.
      real(dp), allocatable :: table(:, :)
   end type adhesion_potential_type

contains

   !> Make a potential from its name.
   subroutine new_adhesion_potential(self, name, energy, range, error, edge)
      type(adhesion_potential_type), intent(out) :: self
      character(*), intent(in) :: name         !! 'none', 'exponential', 'gauss', 'maugis_dugdale'
      real(dp), intent(in) :: energy           !! gamma_0, J/m2, >= 0; ignored for 'none'
      real(dp), intent(in) :: range            !! z_0, m, > 0; ignored for 'none'
      type(error_type), allocatable, intent(out) :: error
      real(dp), intent(in), optional :: edge   !! of maugis_dugdale, m; 0 if absent; at most the range is used

      select case (name)
      case ('none')
         return
      case ('exponential')
         self%kind = potential_exponential
      case ('gauss')
         self%kind = potential_gauss
      case ('maugis_dugdale')
         self%kind = potential_maugis_dugdale
      case default
         call add_fault(error, error_input, "adhesion: potential = '"//trim(name)// &
            "': must be 'none', 'exponential', 'gauss' or 'maugis_dugdale'")
      end select
      if (.not. (energy >= 0.0_dp .and. energy <= huge(1.0_dp))) then
         call add_fault(error, error_input, 'adhesion: energy = '//to_text(energy)//': must be 0 or more (J/m2)')
      end if
      if (.not. (range > 0.0_dp .and. range <= huge(1.0_dp))) then
         call add_fault(error, error_input, 'adhesion: range = '//to_text(range)//': must be positive (m)')
      end if
      self%energy = energy
      self%range = range
      if (self%kind /= potential_maugis_dugdale .or. .not. present(edge)) return
      self%edge = min(edge, range)
   end subroutine new_adhesion_potential

   !> Make a potential from its attraction e' at the gaps 0, h, 2h, ... The last value should be 0: beyond
   !> it there is no attraction. The unit of length `range` becomes energy/(largest attraction), which is
   !> z_0 of the exponential and Maugis-Dugdale potentials, or the gap of the largest attraction if that
   !> is longer.
   subroutine new_tabulated_potential(self, spacing, attraction, slope, error)
      type(adhesion_potential_type), intent(out) :: self
      real(dp), intent(in) :: spacing          !! h, m, > 0
      real(dp), intent(in) :: attraction(:)    !! e', Pa, >= 0, two values or more
      real(dp), intent(in) :: slope(:)         !! e'' at the same gaps, Pa/m
      type(error_type), allocatable, intent(out) :: error
      real(dp) :: start, rise, first, last
      integer :: k, n

      n = size(attraction) - 1
      if (n < 1 .or. size(slope) /= n + 1 .or. .not. (spacing > 0.0_dp .and. spacing <= huge(1.0_dp))) then
         call add_fault(error, error_input, 'adhesion: a table needs a positive spacing, and two values '// &
            'or more of the attraction and of its slope')
      else if (.not. (all(attraction >= 0.0_dp .and. attraction <= huge(1.0_dp)) .and. &
         all(abs(slope) <= huge(1.0_dp)))) then
         call add_fault(error, error_input, 'adhesion: the attraction of a table must be 0 or more, and '// &
            'its slope finite')
      end if
      if (allocated(error)) return
      self%kind = potential_table
      self%spacing = spacing
      allocate (self%table(0:4, n))
      do k = n, 1, -1
         start = attraction(k)
         rise = attraction(k + 1) - start
         first = spacing*slope(k)
         last = spacing*slope(k + 1)
         self%table(0, k) = -self%energy
         self%table(1:4, k) = [start, first, 3.0_dp*rise - 2.0_dp*first - last, first + last - 2.0_dp*rise]
         self%energy = self%energy + spacing*(start + 0.5_dp*rise + (first - last)/12.0_dp)
      end do
      self%range = spacing*(maxloc(attraction, dim=1) - 1)
      if (maxval(attraction) > 0.0_dp) self%range = max(self%range, self%energy/maxval(attraction))
      if (.not. self%range > 0.0_dp) self%range = n*spacing
   end subroutine new_tabulated_potential

   !> Does the attraction grow with the gap somewhere, so that e'' adds to the stiffness there?
   pure function stiffens(self)
      type(adhesion_potential_type), intent(in) :: self
      logical :: stiffens

      stiffens = self%kind == potential_gauss
      if (self%kind == potential_table) stiffens = any(self%table(2, :) > 0.0_dp)
   end function stiffens

   !> Is e' continuous?
   pure function has_smooth_potential(self) result(smooth)
      type(adhesion_potential_type), intent(in) :: self
      logical :: smooth

      smooth = self%kind /= potential_maugis_dugdale .or. self%edge > 0.0_dp
   end function has_smooth_potential

   !> e(g), J/m2.
   elemental function adhesive_energy(self, gap) result(value)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap              !! m, >= 0
      real(dp) :: value
      real(dp) :: x, slope, curvature

      value = 0.0_dp
      if (is_far(self, gap)) return
      x = gap/self%range
      select case (self%kind)
      case (potential_exponential)
         value = -self%energy*exp(-x)
      case (potential_gauss)
         value = -self%energy*exp(-x**2)
      case (potential_maugis_dugdale)
         call constant_terms(self, gap, value, slope, curvature)
      case (potential_table)
         call table_terms(self, gap, value, slope, curvature)
      end select
   end function adhesive_energy

   !> e'(g), Pa: the attraction.
   elemental function adhesive_slope(self, gap) result(value)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap
      real(dp) :: value
      real(dp) :: x, energy, curvature

      value = 0.0_dp
      if (is_far(self, gap)) return
      x = gap/self%range
      select case (self%kind)
      case (potential_exponential)
         value = self%energy/self%range*exp(-x)
      case (potential_gauss)
         value = 2.0_dp*self%energy/self%range*x*exp(-x**2)
      case (potential_maugis_dugdale)
         call constant_terms(self, gap, energy, value, curvature)
      case (potential_table)
         call table_terms(self, gap, energy, value, curvature)
      end select
   end function adhesive_slope

   !> e''(g), Pa/m.
   elemental function adhesive_curvature(self, gap) result(value)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap
      real(dp) :: value
      real(dp) :: x, energy, slope

      value = 0.0_dp
      if (is_far(self, gap)) return
      x = gap/self%range
      select case (self%kind)
      case (potential_exponential)
         value = -self%energy/self%range**2*exp(-x)
      case (potential_gauss)
         value = 2.0_dp*self%energy/self%range**2*(1.0_dp - 2.0_dp*x**2)*exp(-x**2)
      case (potential_maugis_dugdale)
         call constant_terms(self, gap, energy, slope, value)
      case (potential_table)
         call table_terms(self, gap, energy, slope, value)
      end select
   end function adhesive_curvature

   !> e, e' and e'' at once, with one exponential.
   elemental subroutine adhesive_terms(self, gap, energy, slope, curvature)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap              !! m, >= 0
      real(dp), intent(out) :: energy          !! e, J/m2
      real(dp), intent(out) :: slope           !! e', Pa
      real(dp), intent(out) :: curvature       !! e'', Pa/m
      real(dp) :: x, y

      energy = 0.0_dp
      slope = 0.0_dp
      curvature = 0.0_dp
      if (is_far(self, gap)) return
      x = gap/self%range
      select case (self%kind)
      case (potential_exponential)
         energy = -self%energy*exp(-x)
         slope = -energy/self%range
         curvature = -slope/self%range
      case (potential_gauss)
         energy = -self%energy*exp(-x**2)
         y = -2.0_dp*energy/self%range
         slope = x*y
         curvature = (1.0_dp - 2.0_dp*x**2)*y/self%range
      case (potential_maugis_dugdale)
         call constant_terms(self, gap, energy, slope, curvature)
      case (potential_table)
         call table_terms(self, gap, energy, slope, curvature)
      end select
   end subroutine adhesive_terms

   !> e' and e'' of a row of cells, and e if it is needed.
   pure subroutine adhesive_slopes(self, gap, slope, curvature, energy)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in), contiguous :: gap(:)         !! m, >= 0
      real(dp), intent(out), contiguous :: slope(:)      !! e', Pa
      real(dp), intent(out), contiguous :: curvature(:)  !! e'', Pa/m
      real(dp), intent(out), contiguous, optional :: energy(:)   !! e, J/m2
      real(dp) :: value, bell(block)
      integer :: i, first, last

      select case (self%kind)
      case (potential_exponential)
         do first = 1, size(gap), block
            last = min(first + block - 1, size(gap))
            call decay(1.0_dp/self%range, self%energy/self%range, gap(first:last), slope(first:last))
         end do
         curvature(:) = (-1.0_dp/self%range)*slope
         if (present(energy)) energy(:) = -self%range*slope
      case (potential_gauss)
         do first = 1, size(gap), block
            last = min(first + block - 1, size(gap))
            call gauss_slopes(self, gap(first:last), slope(first:last), curvature(first:last), bell)
            if (present(energy)) energy(first:last) = -self%energy*bell(:last - first + 1)
         end do
      case default
         do i = 1, size(gap)
            call adhesive_terms(self, gap(i), value, slope(i), curvature(i))
            if (present(energy)) energy(i) = value
         end do
      end select
   end subroutine adhesive_slopes

   !> e' and e'' of the Gauss potential in at most `block` cells, and exp(-(g/z_0)^2). No branch keeps the compiler from
   !> vectorising the loops.
   pure subroutine gauss_slopes(self, gap, slope, curvature, bell)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in), contiguous :: gap(:)         !! g, m, >= 0
      real(dp), intent(out), contiguous :: slope(:)      !! e', Pa
      real(dp), intent(out), contiguous :: curvature(:)  !! e'', Pa/m
      real(dp), intent(out) :: bell(block)               !! exp(-(g/z_0)^2)
      real(dp), parameter :: farthest = sqrt(2.0_dp*far)  !! g/z_0 beyond which all three are negligible
      real(dp) :: x(size(gap)), square(size(gap)), factor
      integer :: i

      do i = 1, size(gap)
         x(i) = min(gap(i)/self%range, farthest)
         square(i) = x(i)**2
      end do
      call decay(1.0_dp, 1.0_dp, square, bell(:size(gap)))

      factor = 2.0_dp*self%energy/self%range
      do i = 1, size(gap)
         slope(i) = factor*x(i)*bell(i)
         curvature(i) = factor/self%range*(1.0_dp - 2.0_dp*square(i))*bell(i)
      end do
   end subroutine gauss_slopes

   !> scale exp(-rate gap) of at most `block` cells, accurate to round-off; beyond `far` it is negligible.
   !>
   !> The loops have no call and no branch, so that the compiler can vectorise them, which the library's exponential
   !> does not allow. With m = `parts` and the integer k next to m x/ln 2,
   !>     exp(-x) = 2^(-j/m) 2^-l exp(r),   k = m l + j,   r = k ln(2)/m - x.
   !> The first factor stands in a table, the second changes the exponent of the first, and |r| <= ln(2)/(2 m) is so
   !> small that six terms of the series of exp(r) are sufficient.
   pure subroutine decay(rate, scale, gap, values)
      real(dp), intent(in) :: rate, scale
      real(dp), intent(in), contiguous :: gap(:)
      real(dp), intent(out), contiguous :: values(:)
      ! Adding `rounder` rounds a number to an integer, which is then in the last bits of the sum.
      real(dp), parameter :: rounder = 1.5_dp*2.0_dp**52
      ! ln(2)/m in two parts, the first with zeros at the end, so that k times it is exact.
      real(dp), parameter :: log_high = 6.93147180369123816490e-01_dp/parts, &
         log_low = 1.90821492927058770002e-10_dp/parts
      integer, parameter :: mantissa = 52          !! bits of a number behind its exponent
      real(dp) :: x, k, r, least
      integer(int64) :: steps(size(gap)), power
      integer :: i

      least = huge(1.0_dp)
      do i = 1, size(gap)
         least = min(least, gap(i))
      end do
      if (rate*least >= far) then
         values(:) = 0.0_dp
         return
      end if

      do i = 1, size(gap)
         x = min(rate*gap(i), 2.0_dp*far)
         k = x*(parts/log(2.0_dp)) + rounder
         steps(i) = transfer(k, power) - transfer(rounder, power)
         k = k - rounder
         r = (k*log_high - x) + k*log_low
         values(i) = scale*(1.0_dp + r*(1.0_dp + r*(1.0_dp/2.0_dp + r*(1.0_dp/6.0_dp &
            + r*(1.0_dp/24.0_dp + r*(1.0_dp/120.0_dp))))))
      end do
      do i = 1, size(gap)
         power = transfer(part_powers(iand(steps(i), parts - 1_int64)), power) &
            - shiftl(shiftr(steps(i), part_bits), mantissa)
         values(i) = values(i)*transfer(power, r)
      end do
   end subroutine decay

   !> Is there no attraction at a gap?
   pure function is_far(self, gap)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap              !! m, >= 0
      logical :: is_far

      if (self%kind == potential_table) then
         is_far = gap >= size(self%table, 2)*self%spacing
      else
         is_far = gap >= far*self%range
      end if
   end function is_far

   !> The terms of a table at a gap within it.
   pure subroutine table_terms(self, gap, energy, slope, curvature)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap              !! m, >= 0
      real(dp), intent(out) :: energy, slope, curvature
      real(dp) :: t, c(4)
      integer :: k

      t = gap/self%spacing
      k = min(int(t) + 1, size(self%table, 2))
      t = t - (k - 1)
      c = self%table(1:4, k)
      slope = c(1) + t*(c(2) + t*(c(3) + t*c(4)))
      curvature = (c(2) + t*(2.0_dp*c(3) + t*3.0_dp*c(4)))/self%spacing
      ! table(0, k) is the energy at the end of the interval. The integral of the attraction from this gap to the
      ! end of the interval must still be subtracted.
      energy = self%table(0, k) - self%spacing*(c(1) + c(2)/2.0_dp + c(3)/3.0_dp + c(4)/4.0_dp &
         - t*(c(1) + t*(c(2)/2.0_dp + t*(c(3)/3.0_dp + t*c(4)/4.0_dp))))
   end subroutine table_terms

   !> e, e' and e'' of maugis_dugdale: a constant attraction, and the edge of its range.
   pure subroutine constant_terms(self, gap, energy, slope, curvature)
      type(adhesion_potential_type), intent(in) :: self
      real(dp), intent(in) :: gap              !! m, >= 0
      real(dp), intent(out) :: energy, slope, curvature
      real(dp) :: attraction, left

      energy = 0.0_dp
      slope = 0.0_dp
      curvature = 0.0_dp
      attraction = self%energy/self%range
      left = self%range + self%edge - gap
      if (left <= 0.0_dp) return
      if (left >= 2.0_dp*self%edge) then
         energy = -self%energy*(1.0_dp - gap/self%range)
         slope = attraction
      else
         slope = attraction*left/(2.0_dp*self%edge)
         energy = -0.5_dp*slope*left
         curvature = -attraction/(2.0_dp*self%edge)
      end if
   end subroutine constant_terms

   !> Half width of the edge of maugis_dugdale that frees a contact from the cells, m.
   pure function edge_of_cells(energy, range, modulus, cell) result(edge)
      real(dp), intent(in) :: energy, range    !! gamma_0, J/m2, and z_0, m
      real(dp), intent(in) :: modulus          !! E*, Pa; 0 for a material that flows
      real(dp), intent(in) :: cell             !! length of a cell, the longer one, m
      real(dp) :: edge

      edge = range
      if (edge_width*energy/range*cell < modulus*range) edge = edge_width*energy/range*cell/modulus
   end function edge_of_cells

end module adhesion_potential
