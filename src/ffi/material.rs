//! What a shell is made of.

use super::pointer::{VectorRows, check_flags, enumerant, not_null, read_array};
use super::status::Fault;
use super::structs::{described, read_descriptor};
use crate::material::{Crease, ElasticSheet, Elasticity, Fibres, Map, On, Quantity, RestLength, Tie, TiedTo};
use crate::model::weight::EARTH;
use crate::{Material, Vec3};
use std::ffi::c_void;

/// Discrete shells: area, length and dihedral-angle terms (Grinspun et al. 2003), as in the paper. By k_area, k_length, k_bend and
/// area_density. What these mean depends on the mesh.
pub const SW_ENERGY_DISCRETE_SHELLS: u32 = 1;
/// Koiter's energy of a thin elastic sheet (1966): St. Venant-Kirchhoff membrane and plate. By young, poisson, thickness and
/// volume_density, in engineering units, of which every mesh makes the same shell.
pub const SW_ENERGY_KOITER: u32 = 2;

/// k_area.
pub const SW_MAP_K_AREA: u32 = 1;
/// k_length: by edges, as the mean of their ends' or of their triangles' values.
pub const SW_MAP_K_LENGTH: u32 = 2;
/// k_bend: by edges, as the mean of their ends' or of their triangles' values.
pub const SW_MAP_K_BEND: u32 = 3;
/// area_density.
pub const SW_MAP_AREA_DENSITY: u32 = 4;
/// young.
pub const SW_MAP_YOUNG: u32 = 5;
/// thickness, linear within a triangle where it is given at vertices.
pub const SW_MAP_THICKNESS: u32 = 6;
/// volume_density.
pub const SW_MAP_VOLUME_DENSITY: u32 = 7;
/// Growth, of either energy: length without stress over that of the mesh, or of rest_positions. An edge takes the mean of its ends' or of its triangles' values. Angles
/// between triangles stay. 1.05 along the rim of a leaf makes it ruffle; 1.001 everywhere is a sheet that was heated. See rest_lengths.
pub const SW_MAP_GROWTH: u32 = 8;

/// One value a vertex, in the mesh's order; triangles take the mean.
pub const SW_MAP_ON_VERTICES: u32 = 1;
/// One value a triangle, in the mesh's order.
pub const SW_MAP_ON_TRIANGLES: u32 = 2;

/// A constant's values over the shell, all of them positive. Equal values make the same model as the constant does, to the bit.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwMaterialMap {
    /// Set by sw_material_map_init.
    pub struct_size: u32,
    /// SW_MAP_...: which constant, of the material's energy, or growth.
    pub quantity: u32,
    /// SW_MAP_ON_...
    pub on: u32,
    /// SW_FORMAT_... of values.
    pub format: u32,
    /// Values (count). Read during the call only.
    pub values: *const c_void,
    /// Bytes from value to value; 0 = packed.
    pub stride: u64,
    /// Length of values: that of the mesh's vertices or triangles.
    pub count: u32,
    /// Must be 0.
    pub reserved: u32,
}

described!(SwMaterialMap, reserved);

/// Material constants: four for each energy, uniform over the shell or by maps. A stiffness of 0 is one of 0; but where k_area, k_length and k_bend are all 0,
/// as sw_material_desc_init leaves them, all three have their defaults, and an area_density of 0 is 1. A host whose user sets all three to 0, or a density of 0,
/// refuses that itself, as the hosts of shellwarp do.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwMaterialDesc {
    /// Set by sw_material_desc_init.
    pub struct_size: u32,
    /// SW_ENERGY_...; 0 = SW_ENERGY_DISCRETE_SHELLS.
    pub energy: u32,
    /// Area stiffness k_A, energy per area, not negative. Default 1e4.
    pub k_area: f64,
    /// Length stiffness k_L, energy per length, not negative. Default 1e4. On a near-equilateral mesh of edge l the membrane stiffness
    /// (Young's modulus times thickness) is about 4 k_L / (sqrt(3) l).
    pub k_length: f64,
    /// Bending stiffness k_B, energy, not negative. Default 1. The plate rigidity is D = 6 k_B with Poisson's ratio -1/3.
    pub k_bend: f64,
    /// Mass per area, positive; 0 = 1. Of SW_ENERGY_DISCRETE_SHELLS.
    pub area_density: f64,
    /// Young's modulus E, force per area, positive: Pa where lengths are in metres and masses in kilograms. This and the next
    /// three are of SW_ENERGY_KOITER, and must be 0 with the other energy.
    pub young: f64,
    /// Poisson's ratio, above -1 and at most 0.5.
    pub poisson: f64,
    /// Thickness h, a length, positive. The membrane stiffness is E h, the plate rigidity E h^3 / (12 (1 - poisson^2)).
    /// Beyond a tenth of the radius of curvature, or of the mesh's size, the theory does not hold: sw_model_create logs a warning.
    pub thickness: f64,
    /// Mass per volume, positive: kg/m^3.
    pub volume_density: f64,
    /// Maps of constants that vary over the shell (n_maps), at most one a constant. What a map has, its field above may leave 0. Each element
    /// begins with the host's sizeof of SwMaterialMap, as sw_material_map_init sets it.
    pub maps: *const SwMaterialMap,
    /// Length of maps.
    pub n_maps: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Edges that bend by another stiffness or rest at another angle than the sheet (n_creases x 2 vertices, in any order): folds, veins, seams.
    /// Each is an edge between two triangles, and stands once.
    pub creases: *const u32,
    /// What the stiffness against bending is multiplied by (n_creases), not negative; 0 = turns freely. NULL = 1 for all.
    pub crease_factors: *const f64,
    /// Rest angles in rad (n_creases), from -pi to pi: 0 is flat, above 0 is convex on the side of the triangles' normals, as re-oriented where these disagree;
    /// SW_CREASE_ANGLE_OF_MESH = as the mesh has it. NULL = that for all.
    pub crease_angles: *const f64,
    /// Length of creases.
    pub n_creases: u32,
    /// SW_FORMAT_... of rest_positions.
    pub rest_format: u32,
    /// The shape without stress (n_vertices x 3), where it is not the mesh. NULL = the mesh.
    /// With this or rest angles the mesh is where the search for rest begins: sw_model_precompute first finds where the shell rests without load, by
    /// the full shell, and modes and states begin there. SW_METHOD_POLYNOMIAL_SHELL does not take it, nor SW_METHOD_REDUCED_SHELL where the shell moves freely.
    pub rest_positions: *const c_void,
    /// Bytes from rest position to rest position; 0 = packed.
    pub rest_stride: u64,
    /// Of a sheet that is stiffer along a direction than across it, such as paper, a weave or wood: Young's modulus across, positive; young
    /// is then that along, and poisson what stretching along takes away across, with poisson^2 < young / young_across. 0 = the same in all
    /// directions. A map of young scales it and shear along. Of SW_ENERGY_KOITER.
    pub young_across: f64,
    /// Shear modulus G between along and across, positive. 0 = Huber's estimate, sqrt(young young_across) / (2 (1 + poisson
    /// sqrt(young_across / young))). Only with young_across.
    pub shear: f64,
    /// Direction of young (n_directions x 3), of any length and either sign: projected into each triangle. Needed with young_across.
    pub directions: *const c_void,
    /// Bytes from direction to direction; 0 = packed.
    pub direction_stride: u64,
    /// Length of directions: 1 for all triangles, or n_triangles.
    pub n_directions: u32,
    /// SW_FORMAT_... of directions.
    pub direction_format: u32,
    /// Vertices held together with others (n_ties x 2): a vertex, and the vertex or triangle that it is tied to. Each stays where it is beside that in
    /// the mesh: an offset turns with the triangle, of a vertex elsewhere with the first triangle at it. Components that are tied count as one.
    pub ties: *const u32,
    /// Nonzero where the second is a triangle (n_ties). NULL = vertices all.
    pub tie_on_triangles: *const u8,
    /// Force per length of the ties (n_ties), not negative; 0 = stiff, a thousand times the shell's own at the stiffer end, so that a tie gives by a thousandth
    /// of what the shell does there. NULL = stiff all.
    pub tie_stiffness: *const f64,
    /// Length of ties.
    pub n_ties: u32,
    /// Must be 0.
    pub tie_flags: u32,
    /// Ties stiffly what touches, besides: of two components within this distance, the vertices of the one that has more of them so near, each to the
    /// nearest triangle of the other. 0 = nothing.
    pub tie_distance: f64,
    /// How long the mesh's unit is, metres: 1, 0.01 for centimetres. 0 = not told. It changes no number of the shell: sw_model_precompute logs a warning where the
    /// shell's own weight on Earth moves it by less than 1e-5 of its size, or bends it as no film bends, and SwModelInfo says by how much. A modulus in
    /// GPa shows so, too.
    pub metres_per_unit: f64,
    /// Yield angles in rad (n_creases), positive: how far the angle of a crease comes from its rest angle elastically. Where a step or an equilibrium ends
    /// further from it, the state's own rest angle has followed to this far: a fold that stays. Infinite = elastic. NULL = infinite for all. States take their rest angles along when they are
    /// cloned, saved and loaded, and go on by another method; sw_state_reset gives back those above. Only SW_METHOD_REDUCED_SHELL and the full shell yield; with others sw_state_create fails.
    /// Such a crease has a hinge of its own in SW_ENERGY_KOITER, as one of another factor than 1 has: its moment stays below the factor times the sheet's own stiffness at the edge times
    /// this angle. With a factor of 0 it does nothing.
    pub crease_yields: *const f64,
    /// Edges that without stress are of another length than in the mesh, or in rest_positions (n_rest_lengths x 2 vertices, in any order), each once. The
    /// shell need not be able to have all these lengths at once: it then rests under stress, as a leaf does whose rim grew.
    /// Areas and masses without stress follow from the lengths, angles from the mesh, rest_positions or creases. As with rest_positions, sw_model_precompute
    /// first finds where the shell rests, and the same methods take it. SW_MAP_GROWTH scales the other edges.
    pub length_edges: *const u32,
    /// Their lengths (n_rest_lengths), positive. In each triangle every length must be less than the other two together.
    pub rest_lengths: *const f64,
    /// Length of length_edges and rest_lengths.
    pub n_rest_lengths: u32,
    /// Must be 0.
    pub length_flags: u32,
}

described!(SwMaterialDesc, rest_stride);

/// Of a crease: the angle that the mesh has there.
pub const SW_CREASE_ANGLE_OF_MESH: u32 = 7;

/// Metres in the mesh's unit, if told.
pub(super) fn unit_of(desc: &SwMaterialDesc) -> Result<Option<f64>, Fault> {
    let metres = desc.metres_per_unit;
    match metres {
        0.0 => Ok(None),
        _ if metres > 0.0 && metres.is_finite() && (EARTH / metres).is_normal() => Ok(Some(metres)),
        _ => Err(Fault::argument(format!("material->metres_per_unit is {metres:?}: it must be positive, or 0"))),
    }
}

pub(super) fn material_of(desc: &SwMaterialDesc) -> Result<Elasticity, Fault> {
    let known = [(0, false), (SW_ENERGY_DISCRETE_SHELLS, false), (SW_ENERGY_KOITER, true)];
    let koiter = enumerant("material->energy", desc.energy, &known)?;
    let SwMaterialDesc { young, poisson, thickness, volume_density, .. } = *desc;
    if koiter {
        return Ok(ElasticSheet { young, poisson, thickness, volume_density }.into());
    }
    let others = [("young", young), ("poisson", poisson), ("thickness", thickness), ("volume_density", volume_density)];
    if let Some((name, value)) = others.into_iter().find(|(_, value)| *value != 0.0) {
        let message = format!("material->{name} is {value:?}, which only SW_ENERGY_KOITER takes: set material->energy");
        return Err(Fault::argument(message));
    }
    let default = Material::default();
    let SwMaterialDesc { k_area, k_length, k_bend, area_density, .. } = *desc;
    // Nothing would resist anything: nobody asks for that.
    let untouched = [k_area, k_length, k_bend].iter().all(|k| *k == 0.0);
    let stiff = if untouched { default } else { Material { k_area, k_length, k_bend, ..default } };
    Ok(Material { area_density: if area_density == 0.0 { default.area_density } else { area_density }, ..stiff }.into())
}

/// The maps of a descriptor; that they fit is the shell's to check.
pub(super) unsafe fn maps_of(desc: &SwMaterialDesc) -> Result<Vec<Map>, Fault> {
    if desc.reserved != 0 {
        return Err(Fault::argument(format!("material->reserved is {}: it must be 0", desc.reserved)));
    }
    if desc.n_maps == 0 {
        return Ok(vec![]);
    }
    not_null("material->maps", desc.maps)?;
    if desc.n_maps as usize > Quantity::ALL.len() {
        let message =
            format!("material->n_maps is {}, but {} constants can have one", desc.n_maps, Quantity::ALL.len());
        return Err(Fault::argument(message));
    }
    let mut maps = vec![];
    let mut next = desc.maps;
    for k in 0..desc.n_maps {
        let name = format!("material->maps[{k}]");
        // SAFETY: the host passes n_maps elements, each of the size that it begins with, and in each as many values as it says.
        unsafe {
            let map = read_descriptor(&name, next)?;
            maps.push(map_of(&name, &map)?);
            next = next.byte_add(next.cast::<u32>().read_unaligned() as usize);
        }
    }
    Ok(maps)
}

/// The creases of a descriptor; that they are edges is the shell's to check.
pub(super) unsafe fn creases_of(desc: &SwMaterialDesc) -> Result<Vec<Crease>, Fault> {
    let n = u64::from(desc.n_creases);
    // SAFETY: the host's lists hold n_creases elements each, or are NULL where that is allowed.
    let (ends, factors, angles, yields) = unsafe {
        let optional = |name: &str, list: *const f64| match list.is_null() {
            true => Ok(vec![]),
            false => read_array(name, list, n),
        };
        let ends: Vec<[u32; 2]> = read_array("material->creases", desc.creases.cast(), n)?;
        let factors = optional("material->crease_factors", desc.crease_factors)?;
        let angles = optional("material->crease_angles", desc.crease_angles)?;
        (ends, factors, angles, optional("material->crease_yields", desc.crease_yields)?)
    };
    let crease = |(i, vertices): (usize, [u32; 2])| {
        let angle = angles.get(i).copied().filter(|angle| *angle != f64::from(SW_CREASE_ANGLE_OF_MESH));
        let yield_angle = yields.get(i).copied().unwrap_or(f64::INFINITY);
        Crease { vertices, factor: factors.get(i).copied().unwrap_or(1.0), angle, yield_angle }
    };
    Ok(ends.into_iter().enumerate().map(crease).collect())
}

/// The rest lengths of a descriptor; that they are of edges is the shell's to check.
pub(super) unsafe fn rest_lengths_of(desc: &SwMaterialDesc) -> Result<Vec<RestLength>, Fault> {
    let n = u64::from(desc.n_rest_lengths);
    check_flags("material->length_flags", desc.length_flags, 0)?;
    // SAFETY: the host's lists hold n_rest_lengths elements each.
    let (ends, lengths) = unsafe {
        let ends: Vec<[u32; 2]> = read_array("material->length_edges", desc.length_edges.cast(), n)?;
        (ends, read_array("material->rest_lengths", desc.rest_lengths, n)?)
    };
    Ok(ends.into_iter().zip(lengths).map(|(vertices, length)| RestLength { vertices, length }).collect())
}

/// The ties of a descriptor; that they are of the mesh is the shell's to check.
pub(super) unsafe fn ties_of(desc: &SwMaterialDesc) -> Result<Vec<Tie>, Fault> {
    let n = u64::from(desc.n_ties);
    check_flags("material->tie_flags", desc.tie_flags, 0)?;
    // SAFETY: the host's lists hold n_ties elements each, or are NULL where that is allowed.
    let (ends, on_triangles, stiffness) = unsafe {
        let some = |null: bool| if null { 0 } else { n };
        let ends: Vec<[u32; 2]> = read_array("material->ties", desc.ties.cast(), n)?;
        let on: Vec<u8> =
            read_array("material->tie_on_triangles", desc.tie_on_triangles, some(desc.tie_on_triangles.is_null()))?;
        let k: Vec<f64> =
            read_array("material->tie_stiffness", desc.tie_stiffness, some(desc.tie_stiffness.is_null()))?;
        (ends, on, k)
    };
    let tie = |(i, [vertex, to]): (usize, [u32; 2])| {
        let on_triangle = on_triangles.get(i).is_some_and(|on| *on != 0);
        let to = if on_triangle { TiedTo::Triangle(to) } else { TiedTo::Vertex(to) };
        Tie { vertex, to, stiffness: stiffness.get(i).copied().unwrap_or(0.0) }
    };
    Ok(ends.into_iter().enumerate().map(tie).collect())
}

/// The rest shape of a descriptor, for a mesh of so many vertices.
pub(super) unsafe fn rest_shape_of(desc: &SwMaterialDesc, n_vertices: usize) -> Result<Option<Vec<Vec3>>, Fault> {
    if desc.rest_positions.is_null() {
        return Ok(None);
    }
    let (format, stride) = (desc.rest_format, desc.rest_stride);
    let rows =
        VectorRows::checked("material->rest_positions", desc.rest_positions, format, 3, stride, n_vertices as u64)?;
    // SAFETY: the host's array has a row for each vertex of the mesh.
    Ok(Some((0..n_vertices).map(|i| unsafe { rows.read(i) }).collect()))
}

/// What a descriptor says of a direction along which the sheet is of another stiffness.
pub(super) unsafe fn fibres_of(desc: &SwMaterialDesc) -> Result<Option<Fibres>, Fault> {
    let SwMaterialDesc { energy, young, young_across, shear, directions, n_directions, .. } = *desc;
    if young_across == 0.0 && shear == 0.0 && n_directions == 0 {
        return Ok(None);
    }
    let refused = |message: String| Err(Fault::argument(message));
    if energy != SW_ENERGY_KOITER {
        let message = "material->young_across, shear and directions need SW_ENERGY_KOITER: set material->energy";
        return refused(message.into());
    }
    for (name, value) in [("young_across", young_across), ("shear", shear)] {
        let given = value != 0.0 || name == "young_across";
        if given && !(value.is_finite() && value > 0.0) {
            return refused(format!("material->{name} is {value:?}: beside directions it must be positive"));
        }
    }
    if !(young.is_finite() && young > 0.0) {
        return refused(format!("material->young is {young:?}: it must be given beside young_across, with a map, too"));
    }
    if n_directions == 0 {
        return refused(
            "material->young_across is given, but material->n_directions is 0: give one, or one a triangle".into(),
        );
    }
    let rows = VectorRows::checked(
        "material->directions",
        directions,
        desc.direction_format,
        3,
        desc.direction_stride,
        n_directions.into(),
    )?;
    // SAFETY: the host's array has n_directions rows.
    let directions = (0..n_directions as usize).map(|i| unsafe { rows.read(i) }).collect();
    Ok(Some(Fibres { across: young_across / young, shear: shear / young, directions }))
}

unsafe fn map_of(name: &str, map: &SwMaterialMap) -> Result<Map, Fault> {
    if map.reserved != 0 {
        return Err(Fault::argument(format!("{name}.reserved is {}: it must be 0", map.reserved)));
    }
    let quantity = enumerant(format_args!("{name}.quantity"), map.quantity, &Quantity::ALL.map(|q| (q as u32, q)))?;
    let on = [On::Vertices, On::Triangles].map(|on| (on as u32, on));
    let on = enumerant(format_args!("{name}.on"), map.on, &on)?;
    let values = format!("{name}.values");
    let rows = VectorRows::checked(&values, map.values, map.format, 1, map.stride, map.count.into())?;
    // SAFETY: the host passes `count` values behind the pointer.
    let values = (0..map.count as usize).map(|i| unsafe { rows.read_one(i) }).collect();
    Ok(Map { quantity, on, values })
}

/// The constants of the header are those of the core.
const _: () = {
    let header = [
        SW_MAP_K_AREA,
        SW_MAP_K_LENGTH,
        SW_MAP_K_BEND,
        SW_MAP_AREA_DENSITY,
        SW_MAP_YOUNG,
        SW_MAP_THICKNESS,
        SW_MAP_VOLUME_DENSITY,
        SW_MAP_GROWTH,
    ];
    let mut k = 0;
    while k < header.len() {
        assert!(header[k] == Quantity::ALL[k] as u32);
        k += 1;
    }
    assert!(SW_MAP_ON_VERTICES == On::Vertices as u32 && SW_MAP_ON_TRIANGLES == On::Triangles as u32);
};
