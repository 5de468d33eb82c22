!> Advice on the adhesion of a case before it runs: is the grid fine enough, and does adhesion matter?
!>
!> * Resolution. The zone where the surfaces separate is about E* z_0^2/gamma_0 wide. If the cells are larger
!>   than 0.7 times this width, the contact edge sticks to the grid, and the state depends on the path. With
!>   maugis_dugdale the cells may be as large as the zone, because the edge of its range is widened to suit the
!>   cells (module `adhesion_potential`).
!> * Size of the contact. A sphere is pulled off from a contact of about the radius a = (3 pi gamma_0
!>   R^2/(4 E*))^(1/3). With two cells in a the pull-off force is up to 13 % too large, even if the cells resolve
!>   the zone above. With three cells in a and a smooth potential it is right within 4 %, with eight cells and
!>   maugis_dugdale within 3 % (`python tools/campaign_contact.py pull`).
!> * Tabor's parameter of a sphere, (R gamma_0^2/(E*^2 z_0^3))^(1/3) (thesis, eq. 1.2).
!> * The criteria of the thesis (eq. 4.7-4.9) for each wave or random term. If one of them is small
!>   compared with 1, adhesion may be neglected:
!>       C1 = 3 pi gamma_0 R_c N/p     adhesive over applied force of N summits per area, of radius R_c
!>       C2 = gamma_0/W                adhesive over elastic energy per area, in full contact
!>   Hexagonal wave: R_c = wavelength^2/(3 sqrt(3) pi^2 amplitude) (the thesis has 6 in place of
!>   3 sqrt(3), which makes C1 smaller by 13 %), N = 2 sqrt(3)/wavelength^2,
!>   W = 3 pi E* amplitude^2/(32 wavelength). Sine: W = pi E* amplitude^2/(4 wavelength); it has no
!>   summits. Self-affine: W = E*/4 <q h^2> and, with the moments m2, m4 of a profile, R_c =
!>   3 sqrt(pi/m4)/8, N = m4/(6 sqrt(3) pi m2) (P. R. Nayak, J. Lubr. Technol. 93 (1971) 398; J. A.
!>   Greenwood, Proc. R. Soc. A 393 (1984) 133), from the continuous spectrum.
!>
!> For a viscoelastic material the softest modulus of the run is used, because it gives the narrowest zone: the
!> modulus after relaxation over the time of the run, the instantaneous one if there are only static solves, or
!> the long-term one if there is a relaxed phase. Only the edge of maugis_dugdale, on which the results depend,
!> always follows from the long-term modulus (`adhesion_edge`).
module adhesion_advice
   use adhesion_potential, only : edge_of_cells
   use case_settings, only : case_type, surface_settings_type
   use asperity_precision, only : dp, pi
   use prony, only : instantaneous_modulus, relaxation_modulus
   use text_tools, only : to_text
   implicit none
   private

   public :: adhesion_criteria, adhesion_edge, adhesion_notes, adhesion_warning, pull_off_warning

   character(*), parameter :: nl = new_line('a')
   real(dp), parameter :: smooth_limit = 0.7_dp    !! largest cell over the width of the zone
   real(dp), parameter :: square_limit = 1.0_dp    !! the same for maugis_dugdale
   real(dp), parameter :: smooth_cells = 3.0_dp    !! cells in the radius of a contact at pull-off
   real(dp), parameter :: square_cells = 8.0_dp    !! the same for maugis_dugdale

contains

   !> A warning where the grid is too coarse for the adhesion; empty if it is fine enough.
   function adhesion_warning(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      real(dp) :: cell, limit

      text = ''
      if (.not. sticks(case)) return
      cell = longer_side(case)
      limit = largest_cell(case, softest_modulus(case))
      if (cell <= limit) return
      text = '&adhesion: cells of '//to_text(cell)//' m are larger than '//zone_in_words(case)//' = '// &
         to_text(limit)//' m'//with_modulus(case)//': the edge of the contact sticks to the grid'
   end function adhesion_warning

   !> A warning where a sphere is pulled off from a contact of too few cells; empty if there are enough.
   !> Under a load that presses, the contact is larger, and the run checks its size instead (module `contact_size`).
   function pull_off_warning(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      character(:), allocatable :: part
      real(dp) :: cell, modulus, radius, cells
      integer :: i

      text = ''
      if (.not. (sticks(case) .and. pulls(case))) return
      cell = longer_side(case)
      modulus = contact_modulus(case, softest_modulus(case))
      cells = smooth_cells
      part = 'a third'
      if (case%adhesion%potential == 'maugis_dugdale') then
         cells = square_cells
         part = 'an eighth'
      end if
      do i = 1, size(case%surfaces)
         associate (term => case%surfaces(i))
            if (term%shape /= 'sphere' .and. term%shape /= 'paraboloid') cycle
            radius = (0.75_dp*pi*case%adhesion%energy*term%radius**2/modulus)**(1.0_dp/3.0_dp)
            if (cells*cell <= radius) cycle
            text = '&adhesion: cells of '//to_text(cell)//' m are larger than '//to_text(radius/cells)// &
               ' m, '//part//' of the radius of the contact from which the '//trim(term%shape)//' is pulled off, '// &
               '(3 pi energy radius^2/(4 E*))^(1/3)'//with_modulus(case)//': the pull-off force will be too large'
            return
         end associate
      end do
   end function pull_off_warning

   !> Does the load of a phase pull, or does it lift the rubber from first touch?
   pure function pulls(case)
      type(case_type), intent(in) :: case
      logical :: pulls

      pulls = any(case%phases%target < 0.0_dp)
   end function pulls

   !> Numbers that show the effect of adhesion, one per line, without a line end after the last; empty without
   !> adhesion.
   function adhesion_notes(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      real(dp) :: modulus, c1, c2, pressure
      integer :: i

      text = ''
      if (.not. sticks(case)) return

      modulus = softest_modulus(case)
      pressure = largest_pressure(case)
      text = 'adhesion: '//zone_in_words(case)//' = '//to_text(largest_cell(case, modulus))// &
         ' m: cells should not be larger'//with_modulus(case)
      if (case%adhesion%potential == 'maugis_dugdale') text = text//nl// &
         'adhesion: the attraction ends linearly over range +- '//to_text(rounded(adhesion_edge(case)))// &
         ' m'//width_in_words(case)//', so that the cells do not pin the contact'

      do i = 1, size(case%surfaces)
         associate (term => case%surfaces(i), adhesion => case%adhesion)
            select case (term%shape)
            case ('sphere', 'paraboloid')
               text = text//nl//'adhesion: '//trim(term%shape)//': Tabor parameter '// &
                  to_text(rounded((term%radius*(adhesion%energy/contact_modulus(case, modulus))**2) &
                  **(1.0_dp/3.0_dp)/adhesion%range))
            case ('sine', 'hexagonal_wave', 'self_affine')
               call adhesion_criteria(term, adhesion%energy, contact_modulus(case, modulus), pressure, &
                  c1, c2)
               text = text//nl//'adhesion: '//trim(term%shape)//':'
               if (c1 > 0.0_dp) text = text//' C1 = '//to_text(rounded(c1))//' at '// &
                  to_text(pressure)//' Pa,'
               if (c2 > 0.0_dp) text = text//' C2 = '//to_text(rounded(c2))// &
                  ': adhesion may be neglected if one of them is much less than 1'
            case default
               continue                        ! there are no criteria for a plane, a cylinder or a file
            end select
         end associate
      end do
   end function adhesion_notes

   !> The criteria C1 and C2 of one term; 0 if a criterion is not defined.
   pure subroutine adhesion_criteria(term, energy, modulus, pressure, c1, c2)
      type(surface_settings_type), intent(in) :: term
      real(dp), intent(in) :: energy               !! gamma_0, J/m2
      real(dp), intent(in) :: modulus              !! E*, Pa
      real(dp), intent(in) :: pressure             !! mean, Pa; C1 needs it above 0
      real(dp), intent(out) :: c1, c2
      real(dp) :: summits, stored, m2, m4, scale

      summits = 0.0_dp                             ! R_c N, 1/m
      stored = 0.0_dp                              ! W, J/m2
      select case (term%shape)
      case ('sine')
         stored = pi*modulus*term%amplitude**2/(4.0_dp*term%wavelength)
      case ('hexagonal_wave')
         stored = 3.0_dp*pi*modulus*term%amplitude**2/(32.0_dp*term%wavelength)
         if (abs(term%amplitude) > 0.0_dp) summits = 2.0_dp/(3.0_dp*pi**2*abs(term%amplitude))
      case ('self_affine')
         if (term%rms_slope > 0.0_dp) then
            scale = term%rms_slope**2/moment(term, 2)
         else
            scale = term%rms_height**2/moment(term, 0)
         end if
         stored = 0.25_dp*modulus*scale*moment(term, 1)
         m2 = 0.5_dp*scale*moment(term, 2)
         m4 = 0.375_dp*scale*moment(term, 4)
         summits = sqrt(m4/(3.0_dp*pi))/(16.0_dp*m2)
      case default
         continue
      end select
      c1 = 0.0_dp
      if (pressure > 0.0_dp) c1 = 3.0_dp*pi*energy*summits/pressure
      c2 = 0.0_dp
      if (stored > 0.0_dp) c2 = energy/stored
   end subroutine adhesion_criteria

   !> <q^n h^2> of a self-affine spectrum, up to a factor that is the same for all n.
   pure function moment(term, n) result(total)
      type(surface_settings_type), intent(in) :: term
      integer, intent(in) :: n
      real(dp) :: total
      real(dp) :: low, bend, high

      low = term%wavelength_short/term%wavelength_long       ! wave numbers relative to the highest
      bend = term%wavelength_short/term%wavelength_rolloff
      high = 1.0_dp
      total = power_integral(low, bend, n + 1.0_dp) + bend**(2.0_dp + 2.0_dp*term%hurst) &
         *power_integral(bend, high, n - 1.0_dp - 2.0_dp*term%hurst)
      total = total*(2.0_dp*pi/term%wavelength_short)**n
   end function moment

   !> Integral of q^e from a to b.
   pure function power_integral(a, b, e) result(integral)
      real(dp), intent(in) :: a, b, e
      real(dp) :: integral

      if (abs(e + 1.0_dp) < 1.0e-6_dp) then
         integral = log(b/a)
      else
         integral = (b**(e + 1.0_dp) - a**(e + 1.0_dp))/(e + 1.0_dp)
      end if
   end function power_integral

   !> Half width of the edge of the range of maugis_dugdale that the cells need, m. The attraction is a property of the
   !> surfaces. It must be the same in all rows, because otherwise the adhesive energy of a contact at rest would change,
   !> and it must not depend on phases that come later. The width therefore follows from the long-term modulus, with
   !> which it is sufficient for every response of the material. A stiffer response would need less.
   pure function adhesion_edge(case) result(edge)
      type(case_type), intent(in) :: case
      real(dp) :: edge

      edge = edge_of_cells(case%adhesion%energy, case%adhesion%range, &
         contact_modulus(case, case%material%shear_modulus), longer_side(case))
   end function adhesion_edge

   !> The modulus from which the edge of a viscoelastic material follows, in words; empty if it is elastic.
   function width_in_words(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text

      text = ''
      if (size(case%material%prony_g) > 0) text = ' (in all phases; from the long-term E* = '// &
         to_text(contact_modulus(case, case%material%shear_modulus))//' Pa)'
   end function width_in_words

   !> The longer side of a cell, m.
   pure function longer_side(case) result(cell)
      type(case_type), intent(in) :: case
      real(dp) :: cell

      cell = case%grid%dx
      if (case%grid%ny > 1) cell = max(cell, case%grid%dy)
   end function longer_side

   !> The largest permissible cell, relative to E* z_0^2/gamma_0.
   pure function largest_relative_cell(case) result(limit)
      type(case_type), intent(in) :: case
      real(dp) :: limit

      limit = smooth_limit
      if (case%adhesion%potential == 'maugis_dugdale') limit = square_limit
   end function largest_relative_cell

   !> The formula for the largest permissible cell.
   pure function zone_in_words(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text

      text = '0.7 E* range^2/energy'
      if (case%adhesion%potential == 'maugis_dugdale') text = 'E* range^2/energy'
   end function zone_in_words

   !> The largest cell that resolves the adhesion, m.
   pure function largest_cell(case, modulus) result(cell)
      type(case_type), intent(in) :: case
      real(dp), intent(in) :: modulus              !! shear modulus, Pa
      real(dp) :: cell

      cell = largest_relative_cell(case)*contact_modulus(case, modulus)*case%adhesion%range**2/case%adhesion%energy
   end function largest_cell

   !> The lowest shear modulus with which the material responds in a case, Pa.
   pure function softest_modulus(case) result(modulus)
      type(case_type), intent(in) :: case
      real(dp) :: modulus

      modulus = case%material%shear_modulus
      if (any(case%phases%relaxed)) return
      modulus = relaxation_modulus(modulus, case%material%prony_g, case%material%prony_tau, &
         sum(case%phases%duration))
   end function softest_modulus

   !> E* = 2 G/(1 - nu), Pa.
   pure function contact_modulus(case, modulus)
      type(case_type), intent(in) :: case
      real(dp), intent(in) :: modulus              !! shear modulus, Pa
      real(dp) :: contact_modulus

      contact_modulus = 2.0_dp*modulus/(1.0_dp - case%material%poisson)
   end function contact_modulus

   !> The largest mean pressure that the phases prescribe, Pa; 0 if none does.
   pure function largest_pressure(case) result(pressure)
      type(case_type), intent(in) :: case
      real(dp) :: pressure
      integer :: i

      pressure = 0.0_dp
      do i = 1, size(case%phases)
         if (case%phases(i)%control == 'pressure') pressure = max(pressure, case%phases(i)%target)
         if (case%phases(i)%control == 'force') pressure = max(pressure, &
            case%phases(i)%target/case%grid%area())
      end do
   end function largest_pressure

   !> Is there adhesion with an energy?
   pure function sticks(case)
      type(case_type), intent(in) :: case
      logical :: sticks

      sticks = case%adhesion%potential /= 'none' .and. case%adhesion%energy > 0.0_dp
   end function sticks

   !> The modulus with which a number was computed, in words; empty for an elastic material.
   function with_modulus(case) result(text)
      type(case_type), intent(in) :: case
      character(:), allocatable :: text
      real(dp) :: soft, hard

      text = ''
      if (size(case%material%prony_g) == 0) return
      soft = softest_modulus(case)
      hard = instantaneous_modulus(case%material%shear_modulus, case%material%prony_g)
      if (any(case%phases%relaxed)) then
         text = ' (long-term E* = '
      else if (sum(case%phases%duration) > 0.0_dp) then
         text = ' (E* relaxed over the run = '
      else
         text = ' (instantaneous E* = '
      end if
      text = text//to_text(contact_modulus(case, soft))//' Pa'
      if (hard > soft) text = text//', instantaneous '//to_text(contact_modulus(case, hard))//' Pa'
      text = text//')'
   end function with_modulus

   !> Round a number to three digits for display.
   pure function rounded(value)
      real(dp), intent(in) :: value
      real(dp) :: rounded
      real(dp) :: unit

      rounded = value
      if (.not. (value > 0.0_dp .and. value < huge(value))) return
      unit = 10.0_dp**(floor(log10(value)) - 2)
      rounded = anint(value/unit)*unit
   end function rounded

end module adhesion_advice
