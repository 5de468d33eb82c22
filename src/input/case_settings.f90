!> The checked settings of a case, with one type for each namelist group. All units are SI.
!>
!> `case_input` fills them from a file, and `asperity_simulation` reads them. Choices are kept as the words of
!> the input file, checked and in lower case. The defaults are in `input_reference` or are derived by the modules
!> `case_*`.
module case_settings
   use asperity_errors, only : error_input, error_type, fail
   use asperity_precision, only : dp
   use regular_grid, only : grid_type
   use surface_settings, only : path_length, surface_settings_type, word_length
   implicit none
   private

   public :: adhesion_settings_type, case_type, friction_settings_type, material_settings_type, &
      output_settings_type, path_length, phase_settings_type, solver_settings_type, &
      road_moves, surface_settings_type, word_length

   !> `&material`, with Zener branches already turned into Prony arms.
   type :: material_settings_type
      real(dp) :: poisson
      real(dp) :: shear_modulus                     !! long-term modulus G_e, Pa
      real(dp), allocatable :: prony_g(:)           !! Pa; size 0 for an elastic material
      real(dp), allocatable :: prony_tau(:)         !! relaxation times at the case's temperature, s
      real(dp) :: thickness                         !! m; 0: half-space
      real(dp) :: density                           !! kg/m3; 0: no inertia
      real(dp) :: temperature                       !! C
      real(dp) :: reference_temperature             !! C
      real(dp) :: wlf_c1, wlf_c2                    !! both 0: no shift
   end type material_settings_type

   !> `&adhesion`
   type :: adhesion_settings_type
      character(word_length) :: potential           !! 'none' | 'exponential' | 'gauss' | 'maugis_dugdale'
      real(dp) :: energy                            !! J/m2
      real(dp) :: range                             !! m
      character(word_length) :: start               !! 'non_adhesive' | 'full_contact'
   end type adhesion_settings_type

   !> `&friction`
   type :: friction_settings_type
      character(word_length) :: law                 !! 'none' | 'coulomb' | 'constant_shear' | 'coulomb_orowan' | 'table'
      real(dp) :: coefficient
      real(dp) :: shear_strength                    !! Pa
      logical :: slope_effect
      real(dp), allocatable :: table(:, :)          !! [n, 2] pressures and bounds, Pa, of law = 'table'
   end type friction_settings_type

   !> `&phase`, with all inherited and derived values.
   type :: phase_settings_type
      character(64) :: name
      logical :: static                             !! no duration: one instantaneous solve, or a series of them
      real(dp) :: duration                          !! s; 0 where static
      integer :: steps                              !! at least 1; where static, number of solves up to the load
      real(dp) :: dt                                !! s; 0 where static
      character(64) :: dt_reason                    !! how dt was chosen, in words
      character(word_length) :: control             !! 'pressure' | 'force' | 'displacement'
      real(dp) :: target                            !! Pa, N or m, reached at the end
      logical :: given                              !! the load is given in this phase
      logical :: linear                             !! ramp = 'linear'
      logical :: relaxed
      logical :: steady                             !! the first row is a state of steady sliding
      real(dp) :: velocity_x, velocity_y            !! of the road, m/s
      logical :: pulled(2)                          !! a force pulls the road along x, y
      real(dp) :: pull(2)                           !! that force at the end, over the cell, Pa; 0 without one
   end type phase_settings_type

   !> `&solver`
   type :: solver_settings_type
      real(dp) :: tolerance
      integer :: max_iterations
      character(word_length) :: method              !! 'fast' | 'thesis'
      character(word_length) :: time_scheme         !! 'exponential2' | 'exponential' | 'backward_euler'
      integer :: passes                             !! most passes of a step with friction; 0: until they settle
      real(dp) :: coupling_tolerance                !! limit of `residual_coupling`; 0: depends on `passes`
      character(word_length) :: slip_law            !! 'physical' | 'thesis'
      character(word_length) :: interpolation       !! 'cubic' | 'linear'
      character(word_length) :: precision           !! 'double' | 'mixed'
      integer :: threads                            !! 0: as many as the environment says (module `asperity_threads`)
   end type solver_settings_type

   !> `&output`
   type :: output_settings_type
      character(path_length) :: file                !! the case's name with .h5 by default
      integer :: snapshot_every                     !! steps; 0: only the last
      real(dp), allocatable :: snapshot_times(:)    !! s
      character(word_length), allocatable :: snapshot_fields(:)
      integer :: checkpoint_every                   !! steps; 0: only by time, and when a run is stopped
      real(dp) :: checkpoint_minutes                !! minutes between checkpoints; 0: none by time
      integer :: compression                        !! deflate level, 0 to 9
   end type output_settings_type

   !> A whole case.
   type :: case_type
      character(:), allocatable :: path             !! of the input file
      character(:), allocatable :: input            !! its text, verbatim
      character(256) :: title
      type(grid_type) :: grid
      type(surface_settings_type), allocatable :: surfaces(:)
      type(material_settings_type) :: material
      type(adhesion_settings_type) :: adhesion
      type(friction_settings_type) :: friction
      type(phase_settings_type), allocatable :: phases(:)
      type(solver_settings_type) :: solver
      type(output_settings_type) :: output
      character(:), allocatable :: warnings         !! one line each; empty if there are none
   contains
      procedure :: check_read
   end type case_type

contains

   !> Refuse a case that was not read, or whose reading has failed.
   subroutine check_read(self, error)
      class(case_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error   !! with an error, nothing is done

      if (allocated(error) .or. allocated(self%phases)) return
      call fail(error, error_input, 'the case was not read, or reading it has failed')
   end subroutine check_read

   !> Does some phase move or pull the road?
   pure function road_moves(phases) result(yes)
      type(phase_settings_type), intent(in) :: phases(:)
      logical :: yes
      integer :: k

      yes = .false.
      do k = 1, size(phases)
         yes = yes .or. abs(phases(k)%velocity_x) > 0.0_dp .or. abs(phases(k)%velocity_y) > 0.0_dp .or. &
            any(phases(k)%pulled)
      end do
   end function road_moves

end module case_settings
