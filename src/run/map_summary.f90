!> A summary of a height map as text.
module map_summary
   use asperity_errors, only : error_file, error_memory, error_type, fail
   use asperity_precision, only : dp
   use hdf5_file, only : hdf5_file_type
   use text_tools, only : in_one_line, in_quotes, to_text
   implicit none
   private

   public :: describe_map

   character(*), parameter :: nl = new_line('a')

contains

   !> Summarise a height map that `asperity import`, `asperity.surface.save` or another program has written.
   subroutine describe_map(file, path, dataset, text, error)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: path
      character(*), intent(in) :: dataset            !! that holds the heights
      character(:), allocatable, intent(inout) :: text
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: extent(:)
      integer :: status
      character(:), allocatable :: boundary
      real(dp) :: lx, ly
      real(dp), allocatable :: height(:, :)

      call file%dataset_shape(dataset, extent)
      call file%report(error)
      if (allocated(error)) return
      if (size(extent) /= 2) then
         call fail(error, error_file, path//': '//dataset//': is no map: it has '//to_text(size(extent))// &
            ' dimensions')
         return
      end if
      allocate (height(extent(1), extent(2)), stat=status)
      if (status /= 0) then
         call fail(error, error_memory, path//': not enough memory to read the heights')
         return
      end if
      call file%read(dataset, height)
      text = 'file        '//path//nl//'holds       a height map'//nl//attribute_line(file, 'title', 'title       ', 200) &
         //'grid        '//to_text(extent(1))//' x '//to_text(extent(2))//' cells'
      if (file%has_attribute('/grid', 'lx') .and. file%has_attribute('/grid', 'ly')) then
         call file%read_attribute('/grid', 'lx', lx)
         call file%read_attribute('/grid', 'ly', ly)
         boundary = 'free'                            ! as `asperity import` takes a map that does not say it
         if (file%has_attribute('/grid', 'boundary')) call file%read_attribute('/grid', 'boundary', boundary)
         text = text//', '//to_text(lx)//' m x '//to_text(ly)//' m, '//in_one_line(boundary, 40)
      end if
      text = text//nl//'heights     '//to_text(minval(height))//' m to '//to_text(maxval(height))// &
         ' m, rms '//to_text(rms_of(height))//' m'//nl
      text = text//attribute_line(file, 'steps_text', 'processing  ', 400)
      call file%report(error)
      text = text//'to use it   &surface shape = ''file'', file = '//in_quotes(path)//' /'//nl
   end subroutine describe_map

   !> The rms height of a map about its mean, by columns, because a copy of the map may not fit into the memory. A single
   !> process reads the file, and all would have to call the sums of module `field_sums`.
   pure function rms_of(height) result(rms)
      real(dp), intent(in) :: height(:, :)           !! m
      real(dp) :: rms                                !! m
      real(dp) :: cells, mean, squares
      integer :: j

      cells = real(size(height, 1), dp)*real(size(height, 2), dp)
      mean = 0.0_dp
      do j = 1, size(height, 2)
         mean = mean + sum(height(:, j))/cells
      end do
      squares = 0.0_dp
      do j = 1, size(height, 2)
         squares = squares + sum((height(:, j) - mean)**2)
      end do
      rms = sqrt(squares/cells)
   end function rms_of

   !> The line for an attribute of the file, whose own lines are separated by semicolons; '' if there is no such
   !> attribute, or if it is empty.
   function attribute_line(file, name, head, most) result(line)
      type(hdf5_file_type), intent(inout) :: file
      character(*), intent(in) :: name
      character(*), intent(in) :: head               !! the words before it
      integer, intent(in) :: most                    !! longest text of the attribute
      character(:), allocatable :: line
      character(:), allocatable :: words
      integer :: at

      line = ''
      if (.not. file%has_attribute('/', name)) return
      call file%read_attribute('/', name, words)
      do
         at = index(words, nl)
         if (at == 0) exit
         words = words(:at - 1)//'; '//words(at + 1:)
      end do
      if (words /= '') line = head//in_one_line(words, most)//nl
   end function attribute_line

end module map_summary
