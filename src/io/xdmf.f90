!> The XDMF file beside a result, which lets ParaView and VisIt read the result.
!>
!> XDMF (version 2) describes, in XML, the arrays of an HDF5 file. Every snapshot is a regular grid
!> whose nodes are the centres of the cells, so that the values belong to points. XDMF gives numbers
!> in the order of the arrays in the file: z, y, x.
module xdmf
   use asperity_errors, only : error_file, error_type, fail
   use file_system, only : name_of, remove_file, rename_file
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   implicit none
   private

   public :: snapshot_type, snapshot_name, write_xdmf

   !> The data of a snapshot that the XDMF file contains.
   type :: snapshot_type
      integer :: step = 0                            !! its row in the history
      real(dp) :: time = 0.0_dp                      !! time, s
      character(24), allocatable :: fields(:)        !! names of its fields
   end type snapshot_type

contains

   !> Name of the group of a snapshot: its step with at least six digits.
   pure function snapshot_name(step) result(name)
      integer, intent(in) :: step           !! 0 or more
      character(:), allocatable :: name
      character(12) :: text

      write (text, '(i0.6)') step
      name = trim(text)
   end function snapshot_name

   !> Write the file under another name, and let it replace the old one in one step.
   subroutine write_xdmf(path, result_path, grid, snapshots, error)
      character(*), intent(in) :: path                   !! name of the XDMF file
      character(*), intent(in) :: result_path            !! the result, in the same folder
      type(grid_type), intent(in) :: grid
      type(snapshot_type), intent(in) :: snapshots(:)    !! in the order of time
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done
      character(:), allocatable :: temporary, result_name
      character(200) :: reason
      integer :: unit, status, closed, i
      logical :: by_time

      if (allocated(error)) return
      ! Readers show only one of the snapshots of a time. If several have the same, the rows take the place of the times.
      by_time = all(snapshots(2:)%time > snapshots(:size(snapshots) - 1)%time)
      temporary = path//'.new'
      result_name = escaped(name_of(result_path))
      open (newunit=unit, file=temporary, status='replace', action='write', iostat=status, &
         iomsg=reason)
      if (status /= 0) then
         call fail(error, error_file, path//': cannot be written: '//trim(reason))
         return
      end if

      write (unit, '(a)', iostat=status, iomsg=reason) '<?xml version="1.0" ?>'//new_line('a')// &
         '<Xdmf Version="2.0">'//new_line('a')//'<Domain>'//new_line('a')// &
         '<Grid Name="snapshots" GridType="Collection" CollectionType="Temporal">'
      do i = 1, size(snapshots)
         if (status /= 0) exit
         call write_snapshot(unit, result_name, grid, snapshots(i), &
            merge(snapshots(i)%time, real(snapshots(i)%step, dp), by_time), status, reason)
      end do
      if (status == 0) write (unit, '(a)', iostat=status, iomsg=reason) &
         '</Grid>'//new_line('a')//'</Domain>'//new_line('a')//'</Xdmf>'

      close (unit, iostat=closed)
      if (status == 0 .and. closed /= 0) then
         status = closed
         reason = 'closing failed'
      end if
      if (status /= 0) then
         call remove_file(temporary)
         call fail(error, error_file, path//': cannot be written: '//trim(reason))
         return
      end if
      call rename_file(temporary, path, error)
   end subroutine write_xdmf

   !> Write one snapshot: the grid, the height map and the fields.
   subroutine write_snapshot(unit, result_name, grid, snapshot, time, status, reason)
      integer, intent(in) :: unit
      character(*), intent(in) :: result_name
      type(grid_type), intent(in) :: grid
      type(snapshot_type), intent(in) :: snapshot
      real(dp), intent(in) :: time           !! or the row, if times repeat
      integer, intent(out) :: status
      character(*), intent(inout) :: reason
      character(:), allocatable :: folder
      integer :: i

      write (unit, '("<Grid Name=""", a, """ GridType=""Uniform"">", /, "<Time Value=""", '// &
         'es23.16, """/>", /, "<Topology TopologyType=""3DCoRectMesh"" Dimensions=""1 ", i0, '// &
         '" ", i0, """/>", /, "<Geometry GeometryType=""ORIGIN_DXDYDZ"">", /, '// &
         '"<DataItem Dimensions=""3"" NumberType=""Float"" Precision=""8"" Format=""XML"">'// &
         '0 0 0</DataItem>", /, '// &
         '"<DataItem Dimensions=""3"" NumberType=""Float"" Precision=""8"" Format=""XML"">'// &
         '", 3es24.16, "</DataItem>", /, "</Geometry>")', iostat=status, iomsg=reason) &
         snapshot_name(snapshot%step), time, grid%ny, grid%nx, grid%dx, grid%dy, grid%dx
      if (status /= 0) return
      call write_field(unit, 'height', result_name//':/surface/height', grid, .false., status, &
         reason)
      folder = result_name//':/snapshots/'//snapshot_name(snapshot%step)//'/'
      do i = 1, size(snapshot%fields)
         if (status /= 0) return
         call write_field(unit, trim(snapshot%fields(i)), folder//trim(snapshot%fields(i)), &
            grid, snapshot%fields(i) == 'contact', status, reason)
      end do
      if (status == 0) write (unit, '("</Grid>")', iostat=status, iomsg=reason)
   end subroutine write_snapshot

   !> Write where the values of a field are.
   subroutine write_field(unit, name, place, grid, byte, status, reason)
      integer, intent(in) :: unit
      character(*), intent(in) :: name
      character(*), intent(in) :: place     !! file:/path/of/dataset
      type(grid_type), intent(in) :: grid
      logical, intent(in) :: byte           !! true for whole numbers of one byte, false for reals of eight
      integer, intent(out) :: status
      character(*), intent(inout) :: reason
      character(:), allocatable :: kind

      kind = 'NumberType="Float" Precision="8"'
      if (byte) kind = 'NumberType="Char" Precision="1"'
      write (unit, '("<Attribute Name=""", a, """ AttributeType=""Scalar"" Center=""Node"">", '// &
         '/, "<DataItem Dimensions=""1 ", i0, " ", i0, """ ", a, " Format=""HDF"">", a, '// &
         '"</DataItem>", /, "</Attribute>")', iostat=status, iomsg=reason) &
         name, grid%ny, grid%nx, kind, place
   end subroutine write_field

   !> A text with the characters escaped that have a meaning in XML.
   pure function escaped(text) result(xml)
      character(*), intent(in) :: text
      character(:), allocatable :: xml
      integer :: i

      xml = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('&')
            xml = xml//'&amp;'
         case ('<')
            xml = xml//'&lt;'
         case ('>')
            xml = xml//'&gt;'
         case default
            xml = xml//text(i:i)
         end select
      end do
   end function escaped

end module xdmf
