!> Templates are inputs to start from, each complete and small enough to run in seconds. Their comments are taken
!> from the reference of the input. A template that the input check refuses is not offered.
module case_templates
   use case_input, only : parse_case
   use case_settings, only : case_type
   use asperity_errors, only : error_type
   use input_reference, only : kind_word, variable_entries, variable_entry_type
   implicit none
   private

   public :: all_template_names, find_template, template_is_available, template_list, template_text

   character(*), parameter :: nl = new_line('a')
   integer, parameter :: text_length = 1200

   !> A template.
   type :: template_type
      character(16) :: name
      character(80) :: meaning
      character(text_length) :: text       !! one assignment per line
   end type template_type

contains

   !> All templates, available or not.
   pure function templates() result(list)
      type(template_type), allocatable :: list(:)
      character(*), parameter :: solid = '&material|poisson = 0.5|shear_modulus = 1e6|/|'

      list = [ &
         template_type('hertz', 'a rigid sphere on an elastic half-space: Hertz'' contact of radius 1 mm', &
         '&case|title = ''Hertz contact of a sphere''|/|'// &
         '&grid|nx = 128|ny = 128|lx = 4e-3|boundary = ''free''|/|'// &
         '&surface|shape = ''paraboloid''|radius = 10e-3|/|'//solid// &
         '&phase|force = 0.53333|/|&output|snapshot_every = 1|/|'), &
         template_type('westergaard', 'a wave that is pressed into an elastic half-space, as a line contact', &
         '&case|title = ''Westergaard contact of a wave''|/|'// &
         '&grid|nx = 256|ny = 1|lx = 1e-3|boundary = ''periodic''|/|'// &
         '&surface|shape = ''sine''|amplitude = 10e-6|wavelength = 1e-3|/|'//solid// &
         '&phase|pressure = 25e3|/|&phase|pressure = 50e3|/|&phase|pressure = 100e3|/|'// &
         '&output|snapshot_every = 1|/|'), &
         template_type('rough', 'a self-affine road and an elastic half-space, under five increasing loads', &
         '&case|title = ''Elastic contact with a rough road''|/|'// &
         '&grid|nx = 512|ny = 512|lx = 10e-3|boundary = ''periodic''|/|'// &
         '&surface|shape = ''self_affine''|hurst = 0.8|wavelength_long = 2.5e-3|'// &
         'wavelength_short = 160e-6|rms_slope = 0.1|seed = 1|/|'//solid// &
         '&phase|pressure = 5e3|/|&phase|pressure = 10e3|/|&phase|pressure = 20e3|/|'// &
         '&phase|pressure = 40e3|/|&phase|pressure = 80e3|/|'// &
         '&output|snapshot_every = 1|snapshot_fields = ''pressure'', ''gap''|/|'), &
         template_type('viscoelastic', 'a sphere on a Zener solid under a sudden load: the problem of Lee and Radok', &
         '&case|title = ''Creep of a sphere into a viscoelastic solid''|/|'// &
         '&grid|nx = 64|ny = 64|lx = 0.1e-3|boundary = ''free''|/|'// &
         '&surface|shape = ''paraboloid''|radius = 1e-3|/|'// &
         '&material|shear_modulus = 0.0|zener_g0 = 1e6|zener_g1 = 0.1e6|zener_eta = 0.1e6|/|'// &
         '&phase|name = ''creep''|duration = 5.0|steps = 200|force = 0.02e-3|/|'// &
         '&output|snapshot_every = 50|/|'), &
         template_type('sliding', 'a cylinder that slides without friction under a viscoelastic solid', &
         '&case|title = ''Viscoelastic friction of a cylinder''|/|'// &
         '&grid|nx = 512|ny = 1|lx = 8e-3|/|'// &
         '&surface|shape = ''cylinder''|radius = 10e-3|/|'// &
         '&material|shear_modulus = 0.0|zener_g0 = 2.75e6|zener_g1 = 0.30556e6|zener_eta = 3055.6|/|'// &
         '&phase|name = ''load''|pressure = 6250.0|relaxed = .true.|/|'// &
         '&phase|name = ''slide''|duration = 0.1|velocity_x = 0.02|/|'// &
         '&output|snapshot_every = 32|/|'), &
         template_type('adhesion', 'an adhesive sphere that is pressed on and pulled off at prescribed displacements', &
         '&case|title = ''Adhesive sphere''|/|'// &
         '&grid|nx = 128|ny = 128|lx = 0.2e-3|boundary = ''free''|/|'// &
         '&surface|shape = ''paraboloid''|radius = 1e-3|/|'//solid// &
         '&adhesion|potential = ''exponential''|energy = 0.05|range = 0.27e-6|/|'// &
         '&phase|displacement = 1e-6|/|&phase|displacement = 0.0|/|&phase|displacement = -0.5e-6|/|'// &
         '&output|snapshot_every = 1|/|'), &
         template_type('friction', 'a rubber block that is driven over a wavy road with Coulomb friction', &
         '&case|title = ''Rubber block on a wavy road''|/|'// &
         '&grid|nx = 64|ny = 37|lx = 500e-6|ly = 288.675e-6|/|'// &
         '&surface|shape = ''hexagonal_wave''|amplitude = 5e-6|wavelength = 500e-6|/|'// &
         '&material|shear_modulus = 1e6|prony_g = 2e6, 1e6|prony_tau = 1e-5, 1e-3|'// &
         'thickness = 4e-3|density = 20.0|/|'// &
         '&friction|law = ''coulomb''|coefficient = 0.3|/|'// &
         '&phase|name = ''load''|duration = 1e-3|steps = 100|pressure = 0.4e6|/|'// &
         '&phase|name = ''slide''|duration = 1.5e-3|velocity_x = 1.0|/|'// &
         '&output|snapshot_every = 32|/|')]
   end function templates

   !> Names of all templates, available or not.
   pure function all_template_names() result(names)
      character(16), allocatable :: names(:)
      type(template_type), allocatable :: list(:)

      allocate (list, source=templates())
      allocate (names(size(list)))
      names = list%name
   end function all_template_names

   !> The names and meanings of the available templates, one per line.
   function template_list() result(text)
      character(:), allocatable :: text
      type(template_type), allocatable :: list(:)
      integer :: i

      allocate (list, source=templates())
      text = ''
      do i = 1, size(list)
         if (template_is_available(trim(list(i)%name))) text = text//list(i)%name//trim(list(i)%meaning)//nl
      end do
   end function template_list

   !> Does the program accept the template?
   logical function template_is_available(name) result(available)
      character(*), intent(in) :: name
      type(case_type) :: case
      type(error_type), allocatable :: error

      available = .false.
      if (find_template(name) == 0) return
      call parse_case(template_text(name), name, case, error)
      available = .not. allocated(error)
   end function template_is_available

   !> Number of a template; 0 if there is no template of this name.
   integer function find_template(name) result(number)
      character(*), intent(in) :: name
      character(16), allocatable :: names(:)

      allocate (names, source=all_template_names())
      number = findloc(names == name, .true., dim=1)
   end function find_template

   !> A template as an input with comments; empty if there is no template of this name.
   function template_text(name) result(text)
      character(*), intent(in) :: name
      character(:), allocatable :: text
      type(template_type), allocatable :: list(:)
      type(variable_entry_type), allocatable :: entries(:)
      character(:), allocatable :: line
      character(12) :: group
      integer :: at, next

      text = ''
      at = find_template(name)
      if (at == 0) return
      allocate (list, source=templates())
      allocate (entries, source=variable_entries())
      text = '! '//trim(list(at)%meaning)//nl//'! All units are SI. Run it with: asperity run '//name//'.nml'//nl
      associate (source => list(at)%text)
         at = 1
         do
            next = index(source(at:), '|')
            if (next == 0) exit
            line = source(at:at + next - 2)
            at = at + next
            if (line(1:1) == '&') then
               group = line(2:)
               text = text//nl//line//nl
            else if (line == '/') then
               text = text//line//nl
            else
               text = text//commented(line, group, entries)//nl
            end if
         end do
      end associate
   end function template_text

   !> An assignment followed by the units and the meaning of its variable as a comment.
   pure function commented(assignment, group, entries) result(line)
      character(*), intent(in) :: assignment
      character(*), intent(in) :: group
      type(variable_entry_type), intent(in) :: entries(:)
      character(:), allocatable :: line
      character(:), allocatable :: name
      integer, parameter :: column = 36           !! where the comment starts
      integer, parameter :: longest_choice = 80   !! longer lists of words are left out
      integer :: i

      name = assignment(:index(assignment, '=') - 2)
      line = '   '//assignment
      do i = 1, size(entries)
         if (entries(i)%group /= group .or. entries(i)%name /= name) cycle
         line = line//repeat(' ', max(1, column - len(line)))//'! '
         if (entries(i)%units /= '') line = line//trim(entries(i)%units)//': '
         if (entries(i)%kind == kind_word .and. len_trim(entries(i)%allowed) < longest_choice) then
            line = line//trim(entries(i)%allowed)
         else
            line = line//first_clause(trim(entries(i)%meaning))
         end if
         exit
      end do
   end function commented

   !> A text up to its first colon, semicolon or full stop.
   pure function first_clause(text) result(clause)
      character(*), intent(in) :: text
      character(:), allocatable :: clause
      integer :: i

      do i = 1, len(text) - 1
         if (scan(text(i:i), ':;.') > 0 .and. text(i + 1:i + 1) == ' ') exit
      end do
      clause = text(:i - 1)
      if (i == len(text) .and. scan(text(i:i), '.') == 0) clause = text
   end function first_clause

end module case_templates
