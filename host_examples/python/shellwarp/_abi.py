"""The C interface in ctypes. Generated from include/shellwarp.h by `make python-abi`, do not edit."""

from ctypes import CFUNCTYPE, POINTER, Structure, c_char, c_char_p, c_double, c_uint32, c_uint64, c_void_p

SW_OK = 0
SW_ERROR_INVALID_ARGUMENT = 1
SW_ERROR_INVALID_DESC = 2
SW_ERROR_INVALID_MESH = 3
SW_ERROR_NOT_PRECOMPUTED = 4
SW_ERROR_CANCELLED = 5
SW_ERROR_OUT_OF_MEMORY = 6
SW_ERROR_NUMERICAL = 7
SW_ERROR_BUFFER_SIZE = 8
SW_ERROR_INVALID_DATA = 9
SW_ERROR_BUSY = 10
SW_ERROR_UNSUPPORTED = 11
SW_ERROR_INTERNAL = 12
SW_ABI_VERSION = 1
SW_FEATURE_NONLINEAR_SHELL = 1
SW_FEATURE_WIND = 2
SW_FEATURE_SAVED_MODELS = 4
SW_FEATURE_F64_BASIS = 8
SW_FEATURE_I16_BASIS = 16
SW_FEATURE_REDUCED_SHELL = 32
SW_FEATURE_CONTACT = 64
SW_FORMAT_F32 = 1
SW_FORMAT_F64 = 2
SW_LOG_INFO = 1
SW_LOG_WARNING = 2
SW_SEVERITY_WARNING = 1
SW_SEVERITY_ERROR = 2
SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE = 1
SW_DIAGNOSTIC_REPEATED_VERTEX = 2
SW_DIAGNOSTIC_NON_FINITE_COORDINATE = 3
SW_DIAGNOSTIC_ZERO_AREA = 4
SW_DIAGNOSTIC_DUPLICATE_TRIANGLE = 5
SW_DIAGNOSTIC_NON_MANIFOLD_EDGE = 6
SW_DIAGNOSTIC_NON_MANIFOLD_VERTEX = 7
SW_DIAGNOSTIC_NOT_ORIENTABLE = 8
SW_DIAGNOSTIC_INCONSISTENT_ORIENTATION = 9
SW_DIAGNOSTIC_UNREFERENCED_VERTEX = 10
SW_DIAGNOSTIC_COINCIDENT_VERTICES = 11
SW_DIAGNOSTIC_SLIVER = 12
SW_DIAGNOSTIC_MESSAGE_SIZE = 160
SW_ENERGY_DISCRETE_SHELLS = 1
SW_ENERGY_KOITER = 2
SW_MAP_K_AREA = 1
SW_MAP_K_LENGTH = 2
SW_MAP_K_BEND = 3
SW_MAP_AREA_DENSITY = 4
SW_MAP_YOUNG = 5
SW_MAP_THICKNESS = 6
SW_MAP_VOLUME_DENSITY = 7
SW_MAP_GROWTH = 8
SW_MAP_ON_VERTICES = 1
SW_MAP_ON_TRIANGLES = 2
SW_CREASE_ANGLE_OF_MESH = 7
SW_AXIS_DIRECTION = 8
SW_PROGRESS_CONTINUE = 256
SW_PROGRESS_CANCEL = 512
SW_PHASE_ASSEMBLY = 0
SW_PHASE_ORDERING = 1
SW_PHASE_FACTORIZATION = 2
SW_PHASE_MODES = 3
SW_PHASE_CERTIFICATE = 4
SW_PHASE_ROTATION = 5
SW_PHASE_TRAINING = 6
SW_PHASE_COUNT = 7
SW_PHASE_CAPACITY = 16
SW_PRECISION_F32 = 1
SW_PRECISION_F64 = 2
SW_PRECISION_I16 = 3
SW_PRECOMPUTE_LINEAR = 1
SW_PRECOMPUTE_AUTO = 2
SW_PRECOMPUTE_AUTO_FULL = 4
SW_REDUCED_UNTRAINED = 1
SW_SHAPE_DISPLACEMENT = 1
SW_SHAPE_ROTATION = 2
SW_METHOD_WARP = 1
SW_METHOD_LMA = 2
SW_METHOD_SHELL_IMPLICIT = 3
SW_METHOD_SHELL_EXPLICIT = 4
SW_METHOD_WARP_VIRTUAL_WORK = 5
SW_METHOD_REDUCED_SHELL = 6
SW_METHOD_POLYNOMIAL_SHELL = 9
SW_METHOD_ADAPTIVE_SHELL = 10
SW_METHOD_ROTATION_STRAIN = 8
SW_METHOD_AUTO = 7
SW_NEEDS_MODES = 1
SW_NEEDS_ROTATIONS = 2
SW_NEEDS_REDUCED_FIELDS = 3
SW_NEEDS_CHOICE = 4
SW_INTEGRATOR_IMPLICIT_EULER = 1
SW_INTEGRATOR_EXACT = 2
SW_INTEGRATOR_SECOND_ORDER = 3
SW_STATE_DETERMINISTIC = 1
SW_FRAME_TELEPORT = 1
SW_FRAME_MOTION_GIVEN = 2
SW_SUPPORTS_TELEPORT = 1
SW_REST_TELEPORT = 1
SW_SPACE_WORLD = 0
SW_SPACE_FRAME = 1
SW_BOUND_OUTSIDE = 1
SW_PROXY_CUT = 1
SW_PROXY_KEEP_SIDES = 2
SW_PROXY_KEEP_PIECES = 4
SW_CONSTRAINT_POSITION = 1
SW_CONSTRAINT_ORIENTATION = 2
SW_AXIS_X = 1
SW_AXIS_Y = 2
SW_AXIS_Z = 4
SW_ALL_CONSTRAINTS = 4294967295
SW_COLLIDER_PLANE = 1
SW_COLLIDER_SPHERE = 2
SW_COLLIDER_CAPSULE = 3
SW_COLLIDER_BOX = 4
SW_COLLIDER_HULL = 5
SW_COLLIDER_MESH = 6
SW_COLLIDER_DEFORMING_MESH = 7
SW_COLLIDER_ONE_SIDED = 2
SW_COLLIDER_TELEPORT = 1
SW_FORCES_ONE_STEP = 1
SW_PART_SHAPE = 1
SW_PART_DISPLACEMENTS = 2
SW_PART_ROTATIONS = 3
SW_PART_MODES = 4
SW_PART_UNIFORM_LOAD = 5
SW_PART_SPIN = 6
SW_PART_FORCES = 7
SW_PART_WIND = 8
SW_PART_CONSTRAINTS = 9
SW_PART_NONLINEAR_SHELL = 10
SW_PART_REDUCED_SHELL = 11
SW_PART_CONTACT = 12
SW_PLAN_REASON_SIZE = 120
SW_STEPS_AUTO = 4294967295


class SwModel(Structure):
    """Opaque."""


class SwState(Structure):
    """Opaque."""


class SwBinding(Structure):
    """Opaque."""


class SwProxy(Structure):
    """Opaque."""


class SwCollider(Structure):
    """Opaque."""


SwLogFn = CFUNCTYPE(None, c_void_p, c_uint32, c_char_p)
SwProgressFn = CFUNCTYPE(c_uint32, c_void_p, c_uint32, c_double)
SwWatchFn = CFUNCTYPE(c_uint32, c_void_p, c_double)


class SwDiagnostic(Structure):
    _fields_ = [
        ("kind", c_uint32),
        ("severity", c_uint32),
        ("element", c_uint32),
        ("vertices", c_uint32 * 4),
        ("reserved", c_uint32),
        ("value", c_double * 2),
        ("message", c_char * 160),
    ]


class SwMeshDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("position_format", c_uint32),
        ("positions", c_void_p),
        ("position_stride", c_uint64),
        ("triangles", c_void_p),
        ("triangle_stride", c_uint64),
        ("n_vertices", c_uint32),
        ("n_triangles", c_uint32),
    ]


class SwMaterialMap(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("quantity", c_uint32),
        ("on", c_uint32),
        ("format", c_uint32),
        ("values", c_void_p),
        ("stride", c_uint64),
        ("count", c_uint32),
        ("reserved", c_uint32),
    ]


class SwMaterialDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("energy", c_uint32),
        ("k_area", c_double),
        ("k_length", c_double),
        ("k_bend", c_double),
        ("area_density", c_double),
        ("young", c_double),
        ("poisson", c_double),
        ("thickness", c_double),
        ("volume_density", c_double),
        ("maps", POINTER(SwMaterialMap)),
        ("n_maps", c_uint32),
        ("reserved", c_uint32),
        ("creases", c_void_p),
        ("crease_factors", c_void_p),
        ("crease_angles", c_void_p),
        ("n_creases", c_uint32),
        ("rest_format", c_uint32),
        ("rest_positions", c_void_p),
        ("rest_stride", c_uint64),
        ("young_across", c_double),
        ("shear", c_double),
        ("directions", c_void_p),
        ("direction_stride", c_uint64),
        ("n_directions", c_uint32),
        ("direction_format", c_uint32),
        ("ties", c_void_p),
        ("tie_on_triangles", c_void_p),
        ("tie_stiffness", c_void_p),
        ("n_ties", c_uint32),
        ("tie_flags", c_uint32),
        ("tie_distance", c_double),
        ("metres_per_unit", c_double),
        ("crease_yields", c_void_p),
        ("length_edges", c_void_p),
        ("rest_lengths", c_void_p),
        ("n_rest_lengths", c_uint32),
        ("length_flags", c_uint32),
    ]


class SwSupportDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("fixed", c_void_p),
        ("clamped", c_void_p),
        ("n_fixed", c_uint32),
        ("n_clamped", c_uint32),
        ("axis_vertices", c_void_p),
        ("axes", c_void_p),
        ("axis_directions", c_void_p),
        ("n_axis_vertices", c_uint32),
        ("reserved", c_uint32),
        ("symmetric_axes", c_void_p),
    ]


class SwPrecomputeDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("modes", c_uint32),
        ("precision", c_uint32),
        ("flags", c_uint32),
        ("progress", SwProgressFn),
        ("progress_user", c_void_p),
        ("sag_gravity", c_double * 3),
        ("tolerance", c_double),
        ("demand_gravity", c_double * 3),
        ("demand_acceleration", c_double),
        ("demand_amplification", c_double),
        ("handle_distance", c_double),
        ("handles", c_void_p),
        ("n_handles", c_uint32),
        ("handle_axes", c_uint32),
        ("reduced_fields", c_uint32),
        ("reduced_elements", c_uint32),
        ("reduced_poses", c_uint32),
        ("reduced_flags", c_uint32),
        ("reduced_gravity", c_double),
        ("auto_error", c_double),
        ("auto_operations", c_double),
        ("handle_speed", c_double),
        ("reduced_seconds", c_double),
        ("reduced_mode_searches", c_double),
        ("contact_patches", c_void_p),
        ("n_contact_patches", c_uint32),
        ("support_fields", c_uint32),
    ]


class SwModelInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("n_vertices", c_uint32),
        ("n_triangles", c_uint32),
        ("n_edges", c_uint32),
        ("n_interior_edges", c_uint32),
        ("n_components", c_uint32),
        ("n_unreferenced", c_uint32),
        ("n_reoriented", c_uint32),
        ("n_fixed", c_uint32),
        ("n_unknowns", c_uint32),
        ("precomputed", c_uint32),
        ("modes", c_uint32),
        ("zero_modes", c_uint32),
        ("inertia_count", c_uint32),
        ("inertia_found", c_uint32),
        ("precision", c_uint32),
        ("total_mass", c_double),
        ("total_area", c_double),
        ("size", c_double),
        ("residual", c_double),
        ("orthonormality", c_double),
        ("inertia_shift", c_double),
        ("seconds", c_double * 16),
        ("bytes_model", c_uint64),
        ("bytes_state", c_uint64),
        ("bytes_precompute_peak", c_uint64),
        ("basis_rounding", c_double),
        ("truncation_bound", c_double),
        ("effective_mass", c_double * 3),
        ("reduced_fields", c_uint32),
        ("reduced_elements", c_uint32),
        ("reduced_residual", c_double),
        ("eigenvalue_disagreement", c_double),
        ("auto_method", c_uint32),
        ("support_fields", c_uint32),
        ("auto_error", c_double),
        ("metres_per_unit", c_double),
        ("earth_gravity", c_double),
        ("weight_moves", c_double),
        ("weight_turns", c_double),
        ("training_error_median", c_double),
        ("training_error_most", c_double),
        ("auto_corrects", c_uint32),
        ("reserved", c_uint32),
    ]


class SwFrontPoint(Structure):
    _fields_ = [
        ("method", c_uint32),
        ("chosen", c_uint32),
        ("sagged", c_uint32),
        ("fields", c_uint32),
        ("elements", c_uint32),
        ("failed", c_uint32),
        ("operations", c_double),
        ("error", c_double),
    ]


class SwStateDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("method", c_uint32),
        ("integrator", c_uint32),
        ("flags", c_uint32),
    ]


class SwDampingDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("n_ratios", c_uint32),
        ("mass_coefficient", c_double),
        ("stiffness_coefficient", c_double),
        ("ratios", c_void_p),
        ("factors", c_void_p),
        ("factor_stride", c_uint64),
        ("factor_format", c_uint32),
        ("n_factors", c_uint32),
    ]


class SwFrameDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("origin", c_double * 3),
        ("rotation", c_double * 9),
        ("velocity", c_double * 3),
        ("acceleration", c_double * 3),
        ("angular_velocity", c_double * 3),
        ("angular_acceleration", c_double * 3),
    ]


class SwStateReport(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("turn_in_range", c_uint32),
        ("time", c_double),
        ("kinetic_energy", c_double),
        ("elastic_energy", c_double),
        ("constraint_work", c_double),
        ("max_rotation", c_double),
        ("max_displacement", c_double),
        ("fraction_turned_too_far", c_double),
        ("unconverged_steps", c_uint64),
        ("contact_count", c_uint64),
        ("deepest_penetration", c_double),
        ("contact_impulse", c_double * 3),
        ("support_miss", c_double),
        ("rest_stretch", c_double),
        ("step_error", c_double),
    ]


class SwBindingDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("format", c_uint32),
        ("n_points", c_uint32),
        ("points", c_void_p),
        ("point_stride", c_uint64),
        ("normals", c_void_p),
        ("normal_stride", c_uint64),
        ("tangents", c_void_p),
        ("tangent_stride", c_uint64),
        ("max_distance", c_double),
    ]


class SwBindingInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("n_points", c_uint32),
        ("has_normals", c_uint32),
        ("has_tangents", c_uint32),
        ("furthest_distance", c_double),
        ("furthest_point", c_uint32),
        ("reserved", c_uint32),
        ("bytes", c_uint64),
    ]


class SwBoundPointsDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("space", c_uint32),
        ("format", c_uint32),
        ("flags", c_uint32),
        ("first", c_uint32),
        ("count", c_uint32),
        ("positions", c_void_p),
        ("position_stride", c_uint64),
        ("normals", c_void_p),
        ("normal_stride", c_uint64),
        ("tangents", c_void_p),
        ("tangent_stride", c_uint64),
        ("velocities", c_void_p),
        ("velocity_stride", c_uint64),
        ("correction_steps", c_uint32),
        ("reserved", c_uint32),
        ("deepest", c_void_p),
    ]


class SwProxyDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("n_vertices", c_uint32),
        ("reserved", c_uint32),
        ("weld", c_double),
        ("thickness", c_double),
        ("progress", SwProgressFn),
        ("progress_user", c_void_p),
        ("held", c_void_p),
        ("n_held", c_uint32),
        ("held_flags", c_uint32),
    ]


class SwProxyInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("n_vertices", c_uint32),
        ("n_triangles", c_uint32),
        ("n_pieces", c_uint32),
        ("n_asset_vertices", c_uint32),
        ("n_left_out", c_uint32),
        ("n_welded", c_uint32),
        ("n_repeated", c_uint32),
        ("n_sides_joined", c_uint32),
        ("n_cut", c_uint32),
        ("furthest_vertex", c_uint32),
        ("n_holes_closed", c_uint32),
        ("furthest_distance", c_double),
        ("edge_length", c_double),
        ("thickness", c_double),
        ("worst_quality", c_double),
        ("mean_quality", c_double),
    ]


class SwCalibrationDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("progress", SwProgressFn),
        ("progress_user", c_void_p),
        ("held", c_void_p),
        ("n_held", c_uint32),
        ("reserved", c_uint32),
    ]


class SwCalibrationInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("n_patches", c_uint32),
        ("n_compared", c_uint32),
        ("n_loads", c_uint32),
        ("difference_before", c_double),
        ("difference_after", c_double),
        ("stretching_min", c_double),
        ("stretching_max", c_double),
        ("bending_min", c_double),
        ("bending_max", c_double),
        ("mass_before", c_double),
    ]


class SwConstraintDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("id", c_uint32),
        ("kind", c_uint32),
        ("vertex", c_uint32),
        ("axes", c_uint32),
        ("flags", c_uint32),
        ("compliance", c_double),
        ("position", c_double * 3),
        ("rotation", c_double * 9),
    ]


class SwConstraintReport(Structure):
    _fields_ = [
        ("id", c_uint32),
        ("kind", c_uint32),
        ("vertex", c_uint32),
        ("met", c_uint32),
        ("iterations", c_uint32),
        ("reserved", c_uint32),
        ("residual", c_double),
        ("force", c_double * 3),
    ]


class SwColliderDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("kind", c_uint32),
        ("flags", c_uint32),
        ("reserved", c_uint32),
        ("radius", c_double),
        ("half_length", c_double),
        ("half_extents", c_double * 3),
        ("friction", c_double),
        ("thickness", c_double),
        ("mesh", POINTER(SwMeshDesc)),
        ("cells", c_uint32),
        ("reserved2", c_uint32),
        ("depth", c_double),
    ]


class SwColliderPoseDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("origin", c_double * 3),
        ("rotation", c_double * 9),
    ]


class SwContact(Structure):
    _fields_ = [
        ("vertices", c_uint32 * 3),
        ("collider", c_uint32),
        ("weights", c_double * 3),
        ("point", c_double * 3),
        ("normal", c_double * 3),
        ("gap", c_double),
        ("force", c_double * 3),
    ]


class SwCapsuleFit(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("radius", c_double),
        ("half_length", c_double),
        ("origin", c_double * 3),
        ("rotation", c_double * 9),
    ]


class SwForceDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("format", c_uint32),
        ("count", c_uint32),
        ("forces", c_void_p),
        ("stride", c_uint64),
        ("vertices", c_void_p),
    ]


class SwWindDesc(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("local_format", c_uint32),
        ("velocity", c_double * 3),
        ("density", c_double),
        ("normal_drag", c_double),
        ("tangential_drag", c_double),
        ("local_velocities", c_void_p),
        ("local_stride", c_uint64),
    ]


class SwEquilibriumReport(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("iterations", c_uint32),
        ("residual", c_double),
        ("seconds", c_double),
    ]


class SwPlanPart(Structure):
    _fields_ = [
        ("part", c_uint32),
        ("active", c_uint32),
        ("bytes", c_uint64),
        ("operations", c_double),
        ("reason", c_char * 120),
    ]


class SwCertificate(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("out_of_range", c_uint32),
        ("error", c_double),
        ("max_error", c_double),
        ("vertex", c_uint32),
        ("method", c_uint32),
        ("residual", c_double),
        ("remaining", c_double),
        ("factorizations", c_uint32),
        ("reserved", c_uint32),
        ("bytes", c_uint64),
        ("corrected_error", c_double),
        ("corrected_max_error", c_double),
        ("seconds", c_double),
    ]


# Result and parameters of every function.
FUNCTIONS = {
    "sw_last_error_message": (c_char_p, []),
    "sw_status_string": (c_char_p, [c_uint32]),
    "sw_abi_version": (c_uint32, []),
    "sw_features": (c_uint32, []),
    "sw_version_string": (c_char_p, []),
    "sw_struct_init": (None, [c_void_p, c_uint32]),
    "sw_set_log_callback": (c_uint32, [SwLogFn, c_void_p]),
    "sw_mesh_check": (c_uint32, [POINTER(SwMeshDesc), POINTER(SwDiagnostic), c_uint32, c_uint32, c_void_p]),
    "sw_model_create": (c_uint32, [POINTER(SwMeshDesc), POINTER(SwMaterialDesc), POINTER(SwSupportDesc), POINTER(POINTER(SwModel))]),
    "sw_model_destroy": (None, [POINTER(SwModel)]),
    "sw_model_save": (c_uint32, [POINTER(SwModel), c_void_p, c_uint64, c_void_p]),
    "sw_model_load": (c_uint32, [c_void_p, c_uint64, POINTER(POINTER(SwModel))]),
    "sw_preset_count": (c_uint32, []),
    "sw_preset_name": (c_char_p, [c_uint32]),
    "sw_preset_label": (c_char_p, [c_uint32]),
    "sw_preset_source": (c_char_p, [c_uint32]),
    "sw_preset_material": (c_uint32, [c_uint32, c_double, POINTER(SwMaterialDesc)]),
    "sw_model_precompute": (c_uint32, [POINTER(SwModel), POINTER(SwPrecomputeDesc)]),
    "sw_model_info": (c_uint32, [POINTER(SwModel), POINTER(SwModelInfo)]),
    "sw_model_front": (c_uint32, [POINTER(SwModel), POINTER(SwFrontPoint), c_uint32, c_uint32, c_void_p]),
    "sw_model_frequencies": (c_uint32, [POINTER(SwModel), c_void_p, c_uint32, c_void_p]),
    "sw_model_mode_shape": (c_uint32, [POINTER(SwModel), c_uint32, c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_method_count": (c_uint32, []),
    "sw_method_at": (c_uint32, [c_uint32]),
    "sw_method_name": (c_char_p, [c_uint32]),
    "sw_method_label": (c_char_p, [c_uint32]),
    "sw_method_needs": (c_uint32, [c_uint32]),
    "sw_model_offers": (c_uint32, [POINTER(SwModel), c_uint32]),
    "sw_state_create": (c_uint32, [POINTER(SwModel), POINTER(SwStateDesc), POINTER(POINTER(SwState))]),
    "sw_state_destroy": (None, [POINTER(SwState)]),
    "sw_state_reset": (c_uint32, [POINTER(SwState)]),
    "sw_state_clone": (c_uint32, [POINTER(SwState), POINTER(POINTER(SwState))]),
    "sw_state_set_rest_tolerance": (c_uint32, [POINTER(SwState), c_double]),
    "sw_state_set_gravity": (c_uint32, [POINTER(SwState), c_void_p]),
    "sw_state_set_damping": (c_uint32, [POINTER(SwState), POINTER(SwDampingDesc)]),
    "sw_state_set_stiffness": (c_uint32, [POINTER(SwState), c_double]),
    "sw_state_set_frequency": (c_uint32, [POINTER(SwState), c_double, c_void_p]),
    "sw_state_set_sag": (c_uint32, [POINTER(SwState), c_double, c_double, c_void_p]),
    "sw_state_set_frame": (c_uint32, [POINTER(SwState), POINTER(SwFrameDesc)]),
    "sw_state_set_amplitudes": (c_uint32, [POINTER(SwState), c_void_p, c_void_p, c_uint32]),
    "sw_state_set_pose": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint64, c_void_p, c_uint64, c_uint32, c_void_p]),
    "sw_state_amplitudes": (c_uint32, [POINTER(SwState), c_void_p, c_void_p, c_uint32, c_void_p]),
    "sw_state_step": (c_uint32, [POINTER(SwState), c_double]),
    "sw_state_save": (c_uint32, [POINTER(SwState), c_void_p, c_uint64, c_void_p]),
    "sw_state_load": (c_uint32, [POINTER(SwState), c_void_p, c_uint64]),
    "sw_state_move_supports": (c_uint32, [POINTER(SwState), c_uint32, c_void_p, c_uint64, c_uint32, c_uint32]),
    "sw_state_move_rest": (c_uint32, [POINTER(SwState), c_uint32, c_void_p, c_uint64, c_uint32, c_uint32]),
    "sw_state_positions": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_state_positions_of": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint32, c_void_p, c_uint64]),
    "sw_state_normals": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_state_rotations": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_state_report": (c_uint32, [POINTER(SwState), POINTER(SwStateReport)]),
    "sw_binding_create": (c_uint32, [POINTER(SwModel), POINTER(SwBindingDesc), POINTER(POINTER(SwBinding))]),
    "sw_binding_destroy": (None, [POINTER(SwBinding)]),
    "sw_binding_info": (c_uint32, [POINTER(SwBinding), POINTER(SwBindingInfo)]),
    "sw_binding_save": (c_uint32, [POINTER(SwBinding), c_void_p, c_uint64, c_void_p]),
    "sw_binding_load": (c_uint32, [POINTER(SwModel), c_void_p, c_uint64, POINTER(POINTER(SwBinding))]),
    "sw_state_bound_points": (c_uint32, [POINTER(SwState), POINTER(SwBinding), POINTER(SwBoundPointsDesc)]),
    "sw_proxy_create": (c_uint32, [POINTER(SwMeshDesc), POINTER(SwProxyDesc), POINTER(POINTER(SwProxy))]),
    "sw_proxy_destroy": (None, [POINTER(SwProxy)]),
    "sw_proxy_info": (c_uint32, [POINTER(SwProxy), POINTER(SwProxyInfo)]),
    "sw_proxy_positions": (c_uint32, [POINTER(SwProxy), c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_proxy_triangles": (c_uint32, [POINTER(SwProxy), c_void_p, c_uint32]),
    "sw_proxy_sources": (c_uint32, [POINTER(SwProxy), c_void_p, c_void_p, c_uint32]),
    "sw_proxy_nearest": (c_uint32, [POINTER(SwProxy), c_void_p, c_uint32]),
    "sw_model_calibrate": (c_uint32, [POINTER(SwModel), POINTER(SwProxy), POINTER(SwCalibrationDesc), POINTER(SwCalibrationInfo)]),
    "sw_states_step": (c_uint32, [POINTER(POINTER(SwState)), c_uint32, c_double, c_void_p]),
    "sw_set_threads": (c_uint32, [c_uint32]),
    "sw_state_set_constraint": (c_uint32, [POINTER(SwState), POINTER(SwConstraintDesc)]),
    "sw_state_clear_constraint": (c_uint32, [POINTER(SwState), c_uint32]),
    "sw_state_constraint_report": (c_uint32, [POINTER(SwState), POINTER(SwConstraintReport), c_uint32, c_uint32, c_void_p]),
    "sw_collider_create": (c_uint32, [POINTER(SwColliderDesc), POINTER(POINTER(SwCollider))]),
    "sw_collider_save": (c_uint32, [POINTER(SwCollider), c_void_p, c_uint64, c_void_p]),
    "sw_collider_load": (c_uint32, [c_void_p, c_uint64, POINTER(POINTER(SwCollider))]),
    "sw_collider_destroy": (None, [POINTER(SwCollider)]),
    "sw_state_set_colliders": (c_uint32, [POINTER(SwState), POINTER(POINTER(SwCollider)), c_uint32]),
    "sw_state_move_collider": (c_uint32, [POINTER(SwState), c_uint32, POINTER(SwColliderPoseDesc)]),
    "sw_state_deform_collider": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_fit_capsule": (c_uint32, [c_uint32, c_void_p, c_uint64, c_uint32, POINTER(SwCapsuleFit)]),
    "sw_model_patches_near": (c_uint32, [POINTER(SwModel), POINTER(POINTER(SwCollider)), c_void_p, c_uint32, c_double, c_void_p, c_uint32, c_void_p]),
    "sw_state_positions_outside": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_void_p, c_uint64, c_uint32, c_void_p]),
    "sw_state_contacts": (c_uint32, [POINTER(SwState), POINTER(SwContact), c_uint32, c_uint32, c_void_p]),
    "sw_state_set_forces": (c_uint32, [POINTER(SwState), POINTER(SwForceDesc)]),
    "sw_state_set_wind": (c_uint32, [POINTER(SwState), POINTER(SwWindDesc)]),
    "sw_state_equilibrium": (c_uint32, [POINTER(SwState), POINTER(SwEquilibriumReport)]),
    "sw_state_equilibrium_watched": (c_uint32, [POINTER(SwState), POINTER(SwEquilibriumReport), SwWatchFn, c_void_p]),
    "sw_state_plan": (c_uint32, [POINTER(SwState), c_double, POINTER(SwPlanPart), c_uint32, c_uint32, c_void_p]),
    "sw_state_plan_text": (c_uint32, [POINTER(SwState), c_double, c_char_p, c_uint64, c_void_p]),
    "sw_state_certify": (c_uint32, [POINTER(SwState), POINTER(SwCertificate)]),
    "sw_state_certify_watched": (c_uint32, [POINTER(SwState), POINTER(SwCertificate), SwWatchFn, c_void_p]),
    "sw_state_correct": (c_uint32, [POINTER(SwState), c_uint32]),
    "sw_state_correct_watched": (c_uint32, [POINTER(SwState), c_uint32, SwWatchFn, c_void_p]),
    "sw_state_positions_corrected": (c_uint32, [POINTER(SwState), c_uint32, c_uint32, c_uint32, c_void_p, c_uint64, c_uint32]),
    "sw_state_fall_back": (c_uint32, [POINTER(SwState), POINTER(SwCertificate)]),
    "sw_state_fall_back_watched": (c_uint32, [POINTER(SwState), POINTER(SwCertificate), SwWatchFn, c_void_p]),
    "sw_state_set_method": (c_uint32, [POINTER(SwState), c_uint32]),
}
