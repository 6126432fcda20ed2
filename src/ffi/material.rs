//! What a shell is made of.

use super::pointer::{VectorRows, enumerant, not_null};
use super::status::Fault;
use super::structs::{described, read_descriptor};
use crate::Material;
use crate::material::{ElasticSheet, Elasticity, Map, On, Quantity};
use std::ffi::c_void;

/// Discrete shells: area, length and dihedral-angle terms (Grinspun et al. 2003), as in the paper. By k_area, k_length, k_bend and
/// area_density. What these mean depends on the mesh.
pub const SW_ENERGY_DISCRETE_SHELLS: u32 = 1;
/// Koiter's energy of a thin elastic sheet (1966): St. Venant-Kirchhoff membrane and plate. By young, poisson, thickness and
/// volume_density, in engineering units, of which every mesh makes the same shell. SW_METHOD_POLYNOMIAL_SHELL does not take it yet.
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
    /// SW_MAP_...: which constant, of the material's energy.
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
/// as sw_material_desc_init leaves them, all three have their defaults.
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
}

described!(SwMaterialDesc, reserved);

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
    ];
    let mut k = 0;
    while k < header.len() {
        assert!(header[k] == Quantity::ALL[k] as u32);
        k += 1;
    }
    assert!(SW_MAP_ON_VERTICES == On::Vertices as u32 && SW_MAP_ON_TRIANGLES == On::Triangles as u32);
};
