!> The groups /losses/NNNNNN of a result, which divide the losses of steady sliding by wavelength and by arm.
!>
!> The file remembers the first fault of these calls, and the caller checks it once at the end
!> (see `hdf5_handle`).
module result_losses
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   use hdf5_tree, only : name_length
   use xdmf, only : snapshot_name
   implicit none
   private

   public :: drop_losses, put_losses

contains

   !> Write the losses of a row into a group. It becomes visible with `publish_group`.
   subroutine put_losses(file, step, wavelength, octave, prony_tau, arm, compression)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: step                          !! row of the history
      real(dp), intent(in), contiguous :: wavelength(:)    !! longest of each octave, m
      real(dp), intent(in), contiguous :: octave(:)        !! rate of loss of each octave, W
      real(dp), intent(in), contiguous :: prony_tau(:)     !! relaxation time of each arm, s
      real(dp), intent(in), contiguous :: arm(:)           !! rate of loss of each arm, W
      integer, intent(in) :: compression                   !! of fields, 0 none to 9 smallest
      character(:), allocatable :: path

      path = '/losses/'//snapshot_name(step)
      call file%stage_group(path)
      call file%write_attribute(path, 'step', step)
      call file%write(path//'/wavelength', wavelength, 'm', &
         'longest wavelength of each octave', compression=compression)
      call file%write(path//'/octave', octave, 'W', 'rate of loss in the rubber by octaves', &
         compression=compression)
      call file%name_axes(path, ['wavelength'], ['octave'])
      if (size(arm) > 0) then
         call file%write(path//'/prony_tau', prony_tau, 's', 'relaxation times of the arms', &
            compression=compression)
         call file%write(path//'/arm', arm, 'W', &
            'rate of loss in the rubber by arms of the material', compression=compression)
         call file%name_axes(path, ['prony_tau'], ['arm'])
      end if
   end subroutine put_losses

   !> Remove the losses of later rows.
   subroutine drop_losses(file, last_step)
      type(hdf5_file_type), intent(inout) :: file
      integer, intent(in) :: last_step
      character(name_length), allocatable :: names(:)
      integer :: i, step

      if (.not. file%has_link('/losses')) return
      call file%members('/losses', names)
      do i = 1, size(names)
         call file%read_attribute('/losses/'//trim(names(i)), 'step', step)
         if (step > last_step) call file%remove('/losses/'//trim(names(i)))
      end do
   end subroutine drop_losses

end module result_losses
