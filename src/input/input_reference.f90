!> The description of the input: every group and variable with its type, default, units, allowed values
!> and meaning. The reader checks an input against this table, templates take their comments from it, and
!> the documentation prints it.
module input_reference
   use shear_laws, only : shear_law_words
   use snapshot_fields, only : field_words
   use surface_shapes, only : all_shapes, shape_type, shape_words
   implicit none
   private

   public :: group_entries, group_entry_type, is_array, variable_entries, variable_entry_type

   integer, parameter, public :: kind_integer = 1
   integer, parameter, public :: kind_real = 2
   integer, parameter, public :: kind_logical = 3
   integer, parameter, public :: kind_text = 4        !! any string
   integer, parameter, public :: kind_word = 5        !! one of several strings
   integer, parameter, public :: kind_reals = 6       !! list of reals
   integer, parameter, public :: kind_words = 7       !! list of such strings

   !> A group.
   type :: group_entry_type
      character(12) :: name
      logical :: required
      logical :: repeatable
      character(200) :: meaning
   end type group_entry_type

   !> A variable.
   type :: variable_entry_type
      character(12) :: group
      character(24) :: name
      integer :: kind
      character(40) :: default      !! as in an input; in parentheses if derived or none
      character(8) :: units
      character(240) :: allowed     !! 'positive', 'not negative', 'any', an interval, or words
      character(320) :: meaning
   end type variable_entry_type

contains

   !> All groups, in the order of a usual input.
   pure function group_entries() result(entries)
      type(group_entry_type), allocatable :: entries(:)

      entries = [ &
         group_entry_type('case', .false., .false., 'Title of the case.'), &
         group_entry_type('grid', .true., .false., 'The regular grid of cells that all fields share.'), &
         group_entry_type('surface', .true., .true., &
            'The heights of the rigid road. The heights of several groups are added.'), &
         group_entry_type('material', .true., .false., &
            'The viscoelastic solid: a spring in parallel with Prony arms or Zener branches.'), &
         group_entry_type('adhesion', .false., .false., 'Attraction across the gap.'), &
         group_entry_type('friction', .false., .false., 'Friction in the interface.'), &
         group_entry_type('phase', .true., .true., &
            'A period of time with a load and a velocity of the road. A phase without a duration is one '// &
            'static solve.'), &
         group_entry_type('solver', .false., .false., 'Numerical methods and tolerance.'), &
         group_entry_type('output', .false., .false., 'What is written, and how often.')]
   end function group_entries

   !> All variables, group by group.
   pure function variable_entries() result(entries)
      type(variable_entry_type), allocatable :: entries(:)

      entries = [case_and_grid(), surface(), material(), interface_laws(), phase(), solver_and_output()]
   end function variable_entries

   !> One row of the table, with blanks filled in.
   pure function row(group, name, kind, default, units, allowed, meaning) result(entry)
      character(*), intent(in) :: group, name
      integer, intent(in) :: kind
      character(*), intent(in) :: default, units, allowed, meaning
      type(variable_entry_type) :: entry

      entry%group = group
      entry%name = name
      entry%kind = kind
      entry%default = default
      entry%units = units
      entry%allowed = allowed
      entry%meaning = meaning
   end function row

   pure function case_and_grid() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('case', 'title', kind_text, '''''', '', 'any', 'Title of the case, which is also written to the result.'), &
         row('grid', 'nx', kind_integer, '(required)', '', 'positive', 'Number of cells along x, at least 2.'), &
         row('grid', 'ny', kind_integer, '(required)', '', 'positive', &
            'Number of cells along y; 1 makes a line contact in plane strain.'), &
         row('grid', 'lx', kind_real, '(required)', 'm', 'positive', 'Length along x.'), &
         row('grid', 'ly', kind_real, '(lx ny/nx)', 'm', 'positive', &
            'Length along y; by default the cells are square.'), &
         row('grid', 'boundary', kind_word, '''periodic''', '', '''periodic'' | ''free''', &
            '''periodic'': the grid is repeated without end; ''free'': one patch on an unbounded half-space.')]
   end function case_and_grid

   pure function surface() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('surface', 'shape', kind_word, '(required)', '', shape_words(' | '), &
            'Shape of the road: '//shape_meanings()//'.'), &
         row('surface', 'radius', kind_real, '(required)', 'm', 'positive', &
            'Radius of the sphere, paraboloid or cylinder.'), &
         row('surface', 'amplitude', kind_real, '(required)', 'm', 'any', 'Amplitude of the wave.'), &
         row('surface', 'wavelength', kind_real, '(required)', 'm', 'positive', 'Wavelength of the wave.'), &
         row('surface', 'hurst', kind_real, '(required)', '', '(0, 1]', 'Hurst exponent of the rough surface.'), &
         row('surface', 'wavelength_long', kind_real, '(shorter side)', 'm', 'positive', &
            'Longest wavelength of the rough surface; the default is lx if ny = 1.'), &
         row('surface', 'wavelength_rolloff', kind_real, '(wavelength_long)', 'm', 'positive', &
            'The spectrum is constant between this wavelength and wavelength_long.'), &
         row('surface', 'wavelength_short', kind_real, '(8 cells)', 'm', 'positive', &
            'Shortest wavelength of the rough surface.'), &
         row('surface', 'rms_height', kind_real, '(none)', 'm', 'positive', &
            'Root mean square height; give this or rms_slope.'), &
         row('surface', 'rms_slope', kind_real, '(none)', '', 'positive', &
            'Root mean square of the gradient; give this or rms_height.'), &
         row('surface', 'seed', kind_integer, '1', '', 'any', &
            'Seed of the random surface; the same seed always gives the same surface.'), &
         row('surface', 'generator', kind_word, '''random_phase''', '', &
            '''random_phase'' | ''filtered_noise''', 'How the rough surface is generated: with the '// &
            'amplitudes of the spectrum and random phases, or as filtered Gaussian noise.'), &
         row('surface', 'file', kind_text, '(required)', '', 'any', &
            'HDF5 file with a height map in metres, of shape (ny, nx). Its path is relative to the folder '// &
            'of the input.'), &
         row('surface', 'dataset', kind_text, '''''', '', 'any', &
            'Dataset in that file; by default ''surface/height'' or else ''surface''.'), &
         row('surface', 'scale', kind_real, '1.0', '', 'any', 'Factor by which the heights of the file are multiplied.'), &
         row('surface', 'centre_x', kind_real, '((nx/2) lx/nx)', 'm', 'any', &
            'Position of the summit along x, or for ''hexagonal_wave'' of a point of height zero; '// &
            'the default is the centre of a cell.'), &
         row('surface', 'centre_y', kind_real, '((ny/2) ly/ny)', 'm', 'any', 'The same along y.')]
   end function surface

   !> What each word of `shape` means.
   pure function shape_meanings() result(text)
      character(:), allocatable :: text
      type(shape_type), allocatable :: shapes(:)
      integer :: n

      allocate (shapes, source=all_shapes())
      text = ''
      do n = 1, size(shapes)
         if (n > 1) text = text//'; '
         text = text//''''//trim(shapes(n)%name)//''' is '//trim(shapes(n)%meaning)
      end do
   end function shape_meanings

   pure function material() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('material', 'poisson', kind_real, '0.5', '', '(-1, 0.5]', 'Poisson ratio, constant in time.'), &
         row('material', 'shear_modulus', kind_real, '(required; 0 with arms)', 'Pa', 'not negative', &
            'Long-term shear modulus: the spring in parallel with the arms. 0 is allowed only with arms or '// &
            'branches.'), &
         row('material', 'prony_g', kind_reals, '(none)', 'Pa', 'positive', 'Moduli of the Prony arms.'), &
         row('material', 'prony_tau', kind_reals, '(none)', 's', 'positive', &
            'Relaxation times of the Prony arms at the reference temperature.'), &
         row('material', 'zener_g0', kind_reals, '(none)', 'Pa', 'positive', &
            'Moduli of the springs of the Zener branches that are in series with (zener_g1 parallel to '// &
            'zener_eta).'), &
         row('material', 'zener_g1', kind_reals, '(none)', 'Pa', 'not negative', &
            'Moduli of the springs that are parallel to the dampers.'), &
         row('material', 'zener_eta', kind_reals, '(none)', 'Pa s', 'positive', &
            'Viscosities of the dampers; the relaxation time of a branch is '// &
            'zener_eta/(zener_g0 + zener_g1).'), &
         row('material', 'thickness', kind_real, '0.0', 'm', 'not negative', &
            'Height of the block, which determines its mean shear; 0 means a half-space.'), &
         row('material', 'density', kind_real, '0.0', 'kg/m3', 'not negative', &
            'Density, for the inertia of the mean shear of a block with thickness; 0 means no inertia.'), &
         row('material', 'temperature', kind_real, '(reference_temperature)', 'C', '[-273.15, inf)', &
            'Temperature of the case.'), &
         row('material', 'reference_temperature', kind_real, '20.0', 'C', '[-273.15, inf)', &
            'Temperature at which the relaxation times are given.'), &
         row('material', 'wlf_c1', kind_real, '0.0', '', 'not negative', &
            'First constant of the WLF shift, log10 a_T = -c1 (T - T_ref)/(c2 + T - T_ref).'), &
         row('material', 'wlf_c2', kind_real, '0.0', 'K', 'not negative', 'Second constant of the WLF shift.')]
   end function material

   pure function interface_laws() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('adhesion', 'potential', kind_word, '''none''', '', &
            '''none'' | ''exponential'' | ''gauss'' | ''maugis_dugdale''', &
            'Energy as a function of the gap g: -w exp(-g/r), -w exp(-g^2/r^2), or -w (1 - g/r) up to g = r '// &
            '(its end is rounded over the width of a cell).'), &
         row('adhesion', 'energy', kind_real, '(required)', 'J/m2', 'not negative', &
         'Work of adhesion w per area.'), &
         row('adhesion', 'range', kind_real, '(required)', 'm', 'positive', 'Range r of the attraction.'), &
         row('adhesion', 'start', kind_word, '''non_adhesive''', '', '''non_adhesive'' | ''full_contact''', &
            'State from which the first solve starts. Adhesion has hysteresis, so it affects the result.'), &
         row('friction', 'law', kind_word, '''none''', '', &
            shear_law_words, &
            'Bound of the tangential traction: coefficient times pressure, shear_strength, the lower of '// &
            'the two, or a table.'), &
         row('friction', 'coefficient', kind_real, '(required)', '', 'not negative', &
            'Coulomb friction coefficient of the interface; at most 1000 with a steady phase.'), &
         row('friction', 'shear_strength', kind_real, '(required)', 'Pa', 'positive', &
            'Shear strength of the interface, a force per area of the mean plane of the road, also on slopes.'), &
         row('friction', 'table_pressure', kind_reals, '(required)', 'Pa', 'not negative', &
            'Pressures of the points of a table, which begin at 0 and rise; straight lines join the points.'), &
         row('friction', 'table_strength', kind_reals, '(required)', 'Pa', 'not negative', &
            'Bounds of the traction at these pressures. Beyond the last point the last line continues if it rises; '// &
            'otherwise the bound stays constant.'), &
         row('friction', 'slope_effect', kind_logical, '.true.', '', 'any', &
            'Apply the friction law on the true local slope of the road.')]
   end function interface_laws

   pure function phase() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('phase', 'name', kind_text, '(phase N)', '', 'any', 'Name of the phase, which is also written to the result.'), &
         row('phase', 'duration', kind_real, '0.0', 's', 'not negative', &
            'Duration of the phase; without it, or with 0, the phase is one static solve.'), &
         row('phase', 'steps', kind_integer, '(derived)', '', 'positive', &
            'Number of time steps; give this or dt. By default it follows from dt.'), &
         row('phase', 'dt', kind_real, '(derived)', 's', 'positive', &
            'Time step, adjusted to a whole number of steps. By default the road moves by one cell per '// &
            'step; if it rests, the step is an eighth of the shortest active relaxation time, with at '// &
            'least 20 steps.'), &
         row('phase', 'control', kind_word, '(from the load given)', '', &
            '''pressure'' | ''force'' | ''displacement''', 'Which load is prescribed.'), &
         row('phase', 'pressure', kind_real, '(as before)', 'Pa', 'any', &
            'Mean pressure at the end of the phase; 0 or less is allowed with adhesion only.'), &
         row('phase', 'force', kind_real, '(as before)', 'N', 'any', &
            'Normal force at the end of the phase, equal to pressure lx ly; 0 or less is allowed with '// &
            'adhesion only.'), &
         row('phase', 'displacement', kind_real, '(as before)', 'm', 'any', &
            'Approach of the far rubber at the end of the phase, counted from the first touch of the '// &
            'undeformed surfaces.'), &
         row('phase', 'ramp', kind_word, '''step''', '', '''step'' | ''linear''', &
            'The load jumps to its value at the start, or changes linearly during the phase.'), &
         row('phase', 'relaxed', kind_logical, '.false.', '', 'any', &
            'Start from the state after this load has acted for an infinite time.'), &
         row('phase', 'steady', kind_logical, '.false.', '', 'any', &
            'Start from the state after the road has slid at this velocity under this load for an infinite '// &
            'time.'), &
         row('phase', 'velocity_x', kind_real, '0.0', 'm/s', 'any', &
            'Velocity of the road relative to the top of the block, along x.'), &
         row('phase', 'velocity_y', kind_real, '0.0', 'm/s', 'any', &
            'Velocity of the road relative to the top of the block, along y.'), &
         row('phase', 'traction_x', kind_real, '(none)', 'Pa', 'any', &
            'Force per area that pulls the road along x at the end of the phase; give it instead of '// &
            'velocity_x. The motion of the road is then computed. ramp applies to it as to the load. '// &
            'Needs &friction.'), &
         row('phase', 'traction_y', kind_real, '(none)', 'Pa', 'any', 'As traction_x, along y.'), &
         row('phase', 'force_x', kind_real, '(none)', 'N', 'any', &
            'The force itself, equal to traction_x lx ly: give one of them.'), &
         row('phase', 'force_y', kind_real, '(none)', 'N', 'any', 'As force_x, along y.')]
   end function phase

   pure function solver_and_output() result(rows)
      type(variable_entry_type), allocatable :: rows(:)

      rows = [ &
         row('solver', 'tolerance', kind_real, '1e-6', '', '(0, 1)', 'Largest allowed residual of every solve.'), &
         row('solver', 'max_iterations', kind_integer, '1000', '', 'positive', 'Largest number of iterations of a solve.'), &
         row('solver', 'method', kind_word, '''fast''', '', '''fast'' | ''thesis''', &
            'The default algorithms, or those of the thesis, which with &adhesion need boundary = ''periodic''.'), &
         row('solver', 'time_scheme', kind_word, '''exponential2''', '', &
            '''exponential2'' | ''exponential'' | ''backward_euler''', 'Time integration of the Prony arms.'), &
         row('solver', 'passes', kind_integer, '0', '', 'not negative', &
            'Largest number of passes in a step with friction; 0 means as many as they need to settle.'), &
         row('solver', 'coupling_tolerance', kind_real, '0', '', 'not negative', &
            'Largest residual_coupling with which a step with friction counts as solved; 0 means tolerance, '// &
            'or 1e-2 if passes is not 0. A step that leaves more ends the run with status 4.'), &
         row('solver', 'slip_law', kind_word, '''physical''', '', '''physical'' | ''thesis''', &
            'Direction of slip on slopes: along the friction force in space, or in the plane as in the '// &
            'thesis.'), &
         row('solver', 'interpolation', kind_word, '''cubic''', '', '''cubic'' | ''linear''', &
            'How the heights and slopes of a sliding road are interpolated: by a cubic spline and its '// &
            'derivatives, or bilinearly with central differences. ''linear'' suits maps with jumps, where a '// &
            'spline overshoots between cells.'), &
         row('solver', 'precision', kind_word, '''double''', '', '''double'' | ''mixed''', &
            '''mixed'': contact without adhesion is iterated with transforms in single precision and '// &
            'checked in double precision, to the same tolerance; adhesion and friction use double '// &
            'precision. Needs method = ''fast''.'), &
         row('solver', 'threads', kind_integer, '0', '', '[0, 1024]', &
            'Number of threads; 0 means OMP_NUM_THREADS or SLURM_CPUS_PER_TASK if one is set, and otherwise all '// &
            'processors.'), &
         row('output', 'file', kind_text, '(the input''s name with .h5)', '', 'any', &
            'HDF5 file of the result. Its path is relative to the folder of the input.'), &
         row('output', 'snapshot_every', kind_integer, '0', 'steps', 'not negative', &
            'Number of steps from one snapshot to the next; 0 writes the last snapshot only. Give this or '// &
            'snapshot_times.'), &
         row('output', 'snapshot_times', kind_reals, '(none)', 's', 'not negative', &
            'Times of the snapshots, in increasing order.'), &
         row('output', 'snapshot_fields', kind_words, '(all that the case has)', '', field_words(), &
            'Fields that a snapshot contains.'), &
         row('output', 'checkpoint_every', kind_integer, '0', 'steps', 'not negative', &
            'Number of steps between checkpoints; 0 means only after checkpoint_minutes and when a signal '// &
            'stops the run.'), &
         row('output', 'checkpoint_minutes', kind_real, '10', 'min', 'not negative', &
            'Time between checkpoints; 0 means that none are written by time.'), &
         row('output', 'compression', kind_integer, '1', '', '[0, 9]', &
            'Compression level (deflate) of the fields; 0 means no compression. Higher levels than 1 save '// &
            'hardly any space and take longer.')]
   end function solver_and_output

   !> Does the variable take a list of values?
   pure logical function is_array(entry)
      type(variable_entry_type), intent(in) :: entry

      is_array = entry%kind == kind_reals .or. entry%kind == kind_words
   end function is_array

end module input_reference
