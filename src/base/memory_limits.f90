!> The memory that a process may use, and a clear error if a task needs more.
!>
!> There are four limits: the memory of the machine with its swap space, the part of it that no other
!> process uses at present, the limit of the control group (containers and batch jobs), and the limit on
!> the address space (ulimit -v). They are read from the files of Linux. On systems without these files
!> there is no limit.
module memory_limits
   use asperity_errors, only : error_memory, error_type, fail
   use asperity_precision, only : dp, int64
   use text_tools, only : to_text
   implicit none
   private

   public :: check_allocation, memory_limit, memory_text, need_memory

   !> Address space that is needed in addition to the fields, for libraries and for the stacks and
   !> heaps of threads, bytes.
   real(dp), parameter :: address_reserve = 256.0e6_dp

contains

   !> Return an error if memory for values could not be allocated.
   subroutine check_allocation(place, extent, status, error)
      character(*), intent(in) :: place             !! where the values come from, for the message
      integer, intent(in) :: extent(:)              !! of the array of doubles
      integer, intent(in) :: status                 !! of the allocation
      type(error_type), allocatable, intent(out) :: error

      if (status /= 0) call fail(error, error_memory, place//': not enough memory: the values take '// &
         memory_text(8.0_dp*product(real(extent, dp))))
   end subroutine check_allocation

   !> Return an error if a task needs more memory than this process can get.
   subroutine need_memory(bytes, task, error, processes)
      real(dp), intent(in) :: bytes
      character(*), intent(in) :: task              !! such as 'the run'
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: processes    !! number of those on this machine that each need as much; default 1
      character(:), allocatable :: what
      real(dp) :: limit, needed

      limit = memory_limit(what)
      needed = bytes
      if (present(processes)) needed = bytes*processes
      if (needed > limit) then
         call fail(error, error_memory, 'not enough memory: '//task//' needs about '// &
            memory_text(needed)//', which is more than '//what//': '//memory_text(limit))
         return
      end if
      limit = address_space()
      if (bytes + address_reserve > limit) call fail(error, error_memory, 'not enough memory: '//task// &
         ' needs about '//memory_text(bytes)//', and the limit on the address space (ulimit -v) '// &
         'leaves '//memory_text(max(0.0_dp, limit - address_reserve)))
   end subroutine need_memory

   !> The most memory that this process can have, bytes.
   function memory_limit(what) result(limit)
      character(:), allocatable, intent(out) :: what    !! such as 'this machine has', for '... more than'
      real(dp) :: limit
      real(dp) :: free, group

      what = 'this machine has'
      limit = field_of('/proc/meminfo', 'MemTotal:') + field_of('/proc/meminfo', 'SwapTotal:')
      limit = 1024.0_dp*limit
      if (.not. limit > 0.0_dp) limit = huge(1.0_dp)
      free = field_of('/proc/meminfo', 'MemAvailable:')
      if (free > 0.0_dp) then
         limit = 1024.0_dp*(free + field_of('/proc/meminfo', 'SwapFree:'))
         what = 'this machine has free at present'
      end if
      group = group_limit()
      if (group < limit) then
         limit = group
         what = 'the control group (container or job) allows'
      end if
   end function memory_limit

   !> The lowest limit of the control group, of version 2 or 1, and of the groups above it, bytes.
   function group_limit() result(limit)
      real(dp) :: limit
      character(512) :: line
      character(:), allocatable :: path
      integer :: unit, status, colon

      limit = min(number_in('/sys/fs/cgroup/memory.max'), &
         number_in('/sys/fs/cgroup/memory/memory.limit_in_bytes'))
      open (newunit=unit, file='/proc/self/cgroup', status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         colon = index(line, ':/', back=.true.)
         if (colon == 0) cycle
         path = trim(line(colon + 1:))
         do while (len(path) > 1)
            if (index(line, '0::') == 1) then
               limit = min(limit, number_in('/sys/fs/cgroup'//path//'/memory.max'))
            else if (index(line, ':memory:') > 0) then
               limit = min(limit, number_in('/sys/fs/cgroup/memory'//path//'/memory.limit_in_bytes'))
            else
               exit
            end if
            path = path(:index(path, '/', back=.true.) - 1)
         end do
      end do
      close (unit)
   end function group_limit

   !> Address space that is left, bytes.
   function address_space() result(left)
      real(dp) :: left
      character(200) :: line
      real(dp) :: limit
      integer :: unit, status

      left = huge(1.0_dp)
      open (newunit=unit, file='/proc/self/limits', status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, 'Max address space') /= 1) cycle
         read (line(len('Max address space') + 1:), *, iostat=status) limit
         if (status == 0) left = max(0.0_dp, limit - 1024.0_dp*field_of('/proc/self/status', 'VmSize:'))
         exit
      end do
      close (unit)
   end function address_space

   !> The number that follows a name at the start of a line of a file; 0 if there is none.
   function field_of(path, name) result(value)
      character(*), intent(in) :: path, name
      real(dp) :: value
      character(200) :: line
      integer :: unit, status

      value = 0.0_dp
      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, name) /= 1) cycle
         read (line(len(name) + 1:), *, iostat=status) value
         if (status /= 0) value = 0.0_dp
         exit
      end do
      close (unit)
   end function field_of

   !> The number that a file contains; huge if there is no file or no number in it ("max").
   function number_in(path) result(value)
      character(*), intent(in) :: path
      real(dp) :: value
      integer(int64) :: number
      integer :: unit, status

      value = huge(1.0_dp)
      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, *, iostat=status) number
      if (status == 0 .and. number > 0) value = real(number, dp)
      close (unit)
   end function number_in

   !> A number of bytes as text for a message.
   function memory_text(bytes) result(text)
      real(dp), intent(in) :: bytes
      character(:), allocatable :: text

      if (bytes < 1.0e9_dp) then
         text = to_text(anint(bytes/1.0e5_dp)/10.0_dp)//' MB'
      else if (bytes < 1.0e15_dp) then
         text = to_text(anint(bytes/1.0e8_dp)/10.0_dp)//' GB'
      else
         text = 'more than a million GB'
      end if
   end function memory_text

end module memory_limits
