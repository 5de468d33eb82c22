!> The error of a pass of a row with friction: the difference between the road at the displacement U_T that the pass has
!> found, and the road on which it was solved.
!>
!> It is the largest of three numbers. Two are means that are weighted by the pressure: the difference of the heights
!> divided by the rms height of the map, and that of the slopes divided by the slopes in the contact. The means hardly
!> contain cells that carry little pressure, or none although they should. The third number shows these: the sum of the
!> lengths by which the road at U_T overlaps the surface or leaves it, divided by the number of cells with pressure and
!> by the rms height. A cell that the road leaves counts at most with the length by which its own pressure compresses
!> it, since it then opens. (After a step that was solved for all unknowns at once, a cell may touch without pressure and
!> carry traction. It counts with the whole difference of the heights.) With constant shear a cell with hardly any pressure
!> carries as much traction as any other, and none of these shows whether it obeys the law. In that case the sum of the
!> errors of all cells (module `edge_shares`) counts as well.
!>
!> Outside the contact U_T may differ much from the place at which the road was read, because nothing there depends on
!> it. Cells without pressure therefore get the road at U_T, and their gap over it. U_z and the solves are not changed.
!>
!> Memory: three fields, which are borrowed from the workspace of the contact.
module coupling_mismatch
   use asperity_interpolation, only : displaced
   use asperity_precision, only : dp
   use asperity_schedule, only : planned_row_type
   use contact_model, only : contact_type
   use edge_shares, only : edge_rule_type
   use field_sums, only : row_totals
   use friction_law, only : contact_open
   implicit none
   private

   public :: mismatch_of

   !> Slopes in the contact count as at least this part of the rms slope of the map.
   real(dp), parameter :: least_slope = 0.1_dp

contains

   !> Compute the mismatch that a pass leaves, and put the cells without pressure over the road at U_T.
   function mismatch_of(contact, plan, sharing, edge) result(mismatch)
      class(contact_type), intent(inout) :: contact    !! after the tangential solve of the pass
      type(planned_row_type), intent(in) :: plan
      logical, intent(in) :: sharing                   !! the shares of the cells are unknown, too
      type(edge_rule_type), intent(in) :: edge         !! the rule by which they change; used with `sharing` only
      real(dp) :: mismatch
      real(dp), pointer, contiguous :: height(:, :), slope_x(:, :), slope_y(:, :)     ! of the road at U_T
      real(dp), allocatable :: rows(:, :)
      real(dp) :: sums(6), edges, compliance
      integer :: j

      call contact%work%lend('height at U_T', height)
      call contact%work%lend('slope along x at U_T', slope_x)
      call contact%work%lend('slope along y at U_T', slope_y)
      call displaced(contact%road, plan%road(1), plan%road(2), contact%tangential%trial(:, 1, :), &
         contact%tangential%trial(:, 2, :), height, slope_x, slope_y)
      compliance = contact%tangential%cell_compliance()
      allocate (rows(size(sums), contact%grid%rows()))
      !$omp parallel do default(none) shared(contact, sharing, compliance, height, slope_x, slope_y, rows) private(j)
      do j = 1, contact%grid%rows()
         call compare_row(contact, j, sharing, compliance, height(:, j), slope_x(:, j), slope_y(:, j), rows(:, j))
      end do
      sums = row_totals(rows)
      edges = 0.0_dp
      if (sharing) then
         ! From here on `height` holds the gap over the road at U_T.
         !$omp parallel do default(none) shared(contact, height) private(j)
         do j = 1, contact%grid%rows()
            height(:, j) = contact%state%gap(:, j) + contact%height(:, j) - height(:, j)
         end do
         edges = edge%error(contact%tangential%share, contact%state%pressure, height)
      end if
      call contact%work%take_back(height)
      call contact%work%take_back(slope_x)
      call contact%work%take_back(slope_y)
      mismatch = max(edges, sums(5)/max(contact%rms_height*max(sums(6), 1.0_dp), tiny(1.0_dp)))
      if (.not. sums(1) > 0.0_dp) return
      mismatch = max(mismatch, sums(2)/max(contact%rms_height*sums(1), tiny(1.0_dp)), &
         sums(3)/max(sums(4), least_slope*contact%rms_slope*sums(1), tiny(1.0_dp)))
   end function mismatch_of

   !> Compare the road of a pass with that at U_T along a row, and put the cells without pressure over the latter.
   pure subroutine compare_row(contact, j, sharing, compliance, height, slope_x, slope_y, sums)
      class(contact_type), intent(inout) :: contact
      integer, intent(in) :: j
      logical, intent(in) :: sharing                   !! cells that touch without pressure are compared elsewhere
      real(dp), intent(in) :: compliance               !! of a cell, m/Pa
      real(dp), intent(in) :: height(:), slope_x(:), slope_y(:)     !! of the road at U_T
      !> Sums of the pressure; with the pressure as weight, of the differences in height and in slope, and of the slope;
      !> of the overlaps and of the lengths by which the road leaves cells; and the number of cells with pressure.
      real(dp), intent(out) :: sums(6)
      real(dp) :: p
      integer :: i

      sums = 0.0_dp
      do i = 1, size(height)
         p = abs(contact%state%pressure(i, j))
         sums(5) = sums(5) + max(height(i) - contact%height(i, j) - max(contact%state%gap(i, j), 0.0_dp), 0.0_dp)
         if (p > 0.0_dp) then
            sums(1) = sums(1) + p
            sums(2) = sums(2) + p*abs(height(i) - contact%height(i, j))
            sums(5) = sums(5) + min(compliance*p, max(contact%height(i, j) - height(i), 0.0_dp))
            ! Slopes are of the order of one, so that their squares need no care; hypot would take several times longer.
            sums(3) = sums(3) + p*sqrt((slope_x(i) - contact%slope_x(i, j))**2 &
               + (slope_y(i) - contact%slope_y(i, j))**2)
            sums(4) = sums(4) + p*sqrt(contact%slope_x(i, j)**2 + contact%slope_y(i, j)**2)
            sums(6) = sums(6) + 1.0_dp
         else
            if (.not. sharing .and. contact%state%tangential%contact(i, j) /= contact_open) then
               sums(5) = sums(5) + abs(contact%height(i, j) - height(i))
               sums(6) = sums(6) + 1.0_dp
            end if
            contact%state%gap(i, j) = contact%state%gap(i, j) + (contact%height(i, j) - height(i))
            contact%height(i, j) = height(i)
            contact%slope_x(i, j) = slope_x(i)
            contact%slope_y(i, j) = slope_y(i)
         end if
      end do
   end subroutine compare_row

end module coupling_mismatch
