//! What a shell is made of: constants, maps, creases and a rest shape, with a few things wrong → model → modes → a few steps.

use super::host::*;
use super::input::Input;
use super::mesh::{MODAL, YIELDING, check_modes, run_a_little};
use shellwarp::ffi::material::*;
use shellwarp::ffi::model::*;
use shellwarp::ffi::pointer::{SW_FORMAT_F32, SW_FORMAT_F64};
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ptr::{null, null_mut};

/// Values of a map, and lists of creases, that are there whatever is said of them.
const ROOM: usize = 64;
const MAPS: usize = 3;

/// A positive number for a constant, seldom one that is none.
fn constant(input: &mut Input) -> f64 {
    match input.below(8) {
        0 => input.number(),
        1 => 10f64.powi(i32::from(input.byte().cast_signed()) / 8),
        _ => 0.01 + f64::from(input.byte()) / 64.0,
    }
}

/// The lists behind a descriptor.
#[derive(Default)]
struct Lists {
    values: Vec<Vec<f64>>,
    maps: Vec<SwMaterialMap>,
    edges: Vec<[u32; 2]>,
    factors: Vec<f64>,
    angles: Vec<f64>,
    yields: Vec<f64>,
    rest: Vec<[f64; 3]>,
    directions: Vec<[f64; 3]>,
    ties: Vec<u32>,
    tied: Vec<u8>,
    pulls: Vec<f64>,
    long: Vec<[u32; 2]>,
    lengths: Vec<f64>,
}

fn maps(input: &mut Input, mesh: &Triangles, koiter: bool) -> (Vec<Vec<f64>>, Vec<SwMaterialMap>) {
    let count = input.below(MAPS + 1);
    let mut values: Vec<Vec<f64>> = vec![];
    let mut maps = vec![];
    for _ in 0..count {
        let mut map = SwMaterialMap::initial();
        map.quantity = 1 + if koiter { 4 + input.code(3) } else { input.code(4) }.min(u32::MAX - 8);
        let on_triangles = input.one_in(2);
        map.on = if on_triangles { SW_MAP_ON_TRIANGLES } else { SW_MAP_ON_VERTICES };
        map.format = SW_FORMAT_F64;
        map.count = if on_triangles { mesh.t.len() } else { mesh.x.len() } as u32;
        // Room for twice as long a stride.
        let uniform = constant(input);
        let varies = input.one_in(2);
        let mut of = || if varies { constant(input) } else { uniform };
        values.push((0..ROOM).map(|_| of()).chain((0..ROOM).map(|_| uniform)).collect());
        match input.below(16) {
            0 => map.quantity = input.code(10),
            1 => map.on = input.code(4),
            2 => map.format = input.code(4),
            3 => map.count = input.below(ROOM) as u32,
            4 => map.stride = [4, 7, 8, 16][input.below(4)],
            5 => map.reserved = input.code(2),
            6 => map.struct_size = [0, 1, 8, 39][input.below(4)],
            7 => map.format = SW_FORMAT_F32,
            _ => {}
        }
        maps.push(map);
    }
    maps.iter_mut().zip(&values).for_each(|(map, values)| map.values = values.as_ptr().cast());
    if let Some(map) = maps.first_mut().filter(|_| input.one_in(16)) {
        map.values = null();
    }
    (values, maps)
}

/// Edges of the mesh, or of none.
fn creases(input: &mut Input, mesh: &Triangles) -> (Vec<[u32; 2]>, Vec<f64>, Vec<f64>) {
    let (mut edges, mut factors, mut angles) = (vec![], vec![], vec![]);
    for _ in 0..input.below(5) {
        let corners = mesh.t[input.below(mesh.t.len())];
        let k = input.below(3);
        edges.push(match input.below(8) {
            0 => [input.index(mesh.x.len()), input.index(mesh.x.len())],
            _ => [corners[k], corners[(k + 1) % 3]],
        });
        factors.push([0.0, 0.1, 1.0, 10.0, constant(input)][input.below(5)]);
        angles.push([f64::from(SW_CREASE_ANGLE_OF_MESH), 0.0, input.number(), 3.0 * input.number()][input.below(4)]);
    }
    (edges, factors, angles)
}

/// The mesh a little bent, or anything.
fn rest(input: &mut Input, mesh: &Triangles) -> Vec<[f64; 3]> {
    let mut x = mesh.x.clone();
    for _ in 0..input.below(6) {
        let v = input.below(x.len());
        match input.below(4) {
            0 => x[v] = input.numbers(),
            _ => x[v][2] = 0.1 * input.number(),
        }
    }
    x
}

/// The descriptor points into the lists.
fn material(input: &mut Input, mesh: &Triangles, lists: &mut Lists) -> SwMaterialDesc {
    let koiter = input.one_in(2);
    let mut material = SwMaterialDesc::initial();
    if koiter {
        material.energy = SW_ENERGY_KOITER;
        (material.young, material.thickness) = (constant(input), 0.1 * constant(input));
        (material.poisson, material.volume_density) = (0.3, constant(input));
    } else if input.one_in(2) {
        (material.k_area, material.k_length) = (constant(input), constant(input));
        (material.k_bend, material.area_density) = (constant(input), constant(input));
    }
    (lists.values, lists.maps) = maps(input, mesh, koiter);
    (lists.edges, lists.factors, lists.angles) = creases(input, mesh);
    (material.maps, material.n_maps) = (lists.maps.as_ptr(), lists.maps.len() as u32);
    (material.creases, material.n_creases) = (lists.edges.as_ptr().cast(), lists.edges.len() as u32);
    (material.crease_factors, material.crease_angles) = (lists.factors.as_ptr(), lists.angles.as_ptr());
    if lists.edges.len() > 2 {
        // Out of what is there, so that inputs keep their meaning.
        let limit = |k: usize| [f64::INFINITY, 0.01, 0.3, lists.angles[k]][(lists.edges[k][0] % 4) as usize];
        lists.yields = (0..lists.edges.len()).map(limit).collect();
        material.crease_yields = lists.yields.as_ptr();
    }
    if input.one_in(3) {
        lists.rest = rest(input, mesh);
        (material.rest_format, material.rest_positions) = (SW_FORMAT_F64, lists.rest.as_ptr().cast());
    }
    match input.below(24) {
        0 => material.energy = input.code(4),
        1 => material.poisson = input.number(),
        2 => material.crease_factors = null(),
        3 => material.crease_angles = null(),
        4 => material.creases = null(),
        5 => material.maps = null(),
        6 => material.rest_format = input.code(4),
        7 => material.rest_stride = [4, 8, 23, 24][input.below(4)],
        8 => material.reserved = input.code(2),
        9 => material.young = input.number(),
        10 => material.k_bend = input.number(),
        11 => material.n_maps = material.n_maps.min(input.below(4) as u32),
        12..18 => add_ties(input, mesh, lists, &mut material),
        _ => {}
    }
    material
}

/// A direction along which it is of another stiffness, with a few things wrong.
fn grain(input: &mut Input, mesh: &Triangles, lists: &mut Lists, material: &mut SwMaterialDesc) {
    let one = input.one_in(2);
    let mut direction = || if input.one_in(16) { input.numbers() } else { [1.0, 0.5, 0.1] };
    lists.directions = mesh.t.iter().map(|_| direction()).collect();
    (material.young_across, material.shear) = (constant(input), [0.0, constant(input)][input.below(2)]);
    (material.direction_format, material.directions) = (SW_FORMAT_F64, lists.directions.as_ptr().cast());
    material.n_directions = if one { 1 } else { lists.directions.len() as u32 };
    match input.below(16) {
        0 => material.shear = input.number(),
        1 => material.directions = null(),
        2 => material.direction_stride = [4, 8, 23, 24][input.below(4)],
        3 => material.n_directions = material.n_directions.min(input.below(4) as u32),
        4 => material.direction_format = input.code(4),
        5 => material.poisson = input.number(),
        _ => {}
    }
}

/// Where grain and lengths begin: what shorter inputs mean stays.
const GRAIN: usize = 512;
const LENGTHS: usize = 768;

/// Edges with lengths of their own, and a map of growth, with a few things wrong.
fn lengths(input: &mut Input, mesh: &Triangles, lists: &mut Lists, material: &mut SwMaterialDesc) {
    for _ in 0..input.below(6) {
        let corners = mesh.t[input.below(mesh.t.len())];
        let k = input.below(3);
        let ends = [corners[k], corners[(k + 1) % 3]];
        lists.long.push(if input.one_in(16) { [input.index(mesh.x.len()), ends[0]] } else { ends });
        let [a, b] = ends.map(|v| mesh.x[v as usize]);
        let now = (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt();
        lists.lengths.push(if input.one_in(16) { input.number() } else { now * (1.0 + 0.1 * input.number()) });
    }
    (material.length_edges, material.rest_lengths) = (lists.long.as_ptr().cast(), lists.lengths.as_ptr());
    material.n_rest_lengths = lists.long.len() as u32;
    if lists.maps.len() < MAPS && input.one_in(2) {
        let mut map = SwMaterialMap::initial();
        (map.quantity, map.on, map.format) = (SW_MAP_GROWTH, SW_MAP_ON_VERTICES, SW_FORMAT_F64);
        lists.values.push(mesh.x.iter().map(|_| 1.0 + 0.1 * input.number()).collect());
        (map.values, map.count) = (lists.values.last().map_or(null(), |v| v.as_ptr().cast()), mesh.x.len() as u32);
        lists.maps.push(map);
        (material.maps, material.n_maps) = (lists.maps.as_ptr(), lists.maps.len() as u32);
    }
    match input.below(16) {
        0 => material.length_edges = null(),
        1 => material.rest_lengths = null(),
        2 => material.length_flags = input.code(2),
        _ => {}
    }
}

fn add_ties(input: &mut Input, mesh: &Triangles, lists: &mut Lists, material: &mut SwMaterialDesc) {
    let count = 1 + input.below(3);
    lists.ties = (0..2 * count).map(|_| input.index(mesh.x.len())).collect();
    lists.tied = (0..count).map(|_| input.below(2) as u8).collect();
    lists.pulls = (0..count).map(|_| if input.one_in(2) { 0.0 } else { constant(input) }).collect();
    (material.ties, material.n_ties) = (lists.ties.as_ptr(), count as u32);
    (material.tie_on_triangles, material.tie_stiffness) = (lists.tied.as_ptr(), lists.pulls.as_ptr());
    material.tie_distance = if input.one_in(2) { 0.0 } else { input.number() };
}

pub fn run(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let mut mesh = Triangles::sheet(1 + input.below(3) as u32, 1 + input.below(2) as u32);
    if input.one_in(3) {
        mesh.x.iter_mut().for_each(|x| x[2] = 0.05 * input.number());
    }
    let mut lists = Lists::default();
    let mut material = material(&mut input, &mesh, &mut lists);
    if bytes.len() > GRAIN {
        grain(&mut Input::new(&bytes[GRAIN..]), &mesh, &mut lists, &mut material);
    }
    if bytes.len() > LENGTHS {
        lengths(&mut Input::new(&bytes[LENGTHS..]), &mesh, &mut lists, &mut material);
    }
    let held: Vec<u32> = (0..input.below(4)).map(|_| input.index(mesh.x.len())).collect();
    let mut supports = SwSupportDesc::initial();
    (supports.fixed, supports.n_fixed) = (held.as_ptr(), held.len() as u32);
    if input.one_in(2) {
        (supports.clamped, supports.n_clamped) = (supports.fixed, supports.n_fixed);
        (supports.fixed, supports.n_fixed) = (null(), 0);
    }

    let mut model = null_mut();
    let status = unsafe { sw_model_create(&mesh.desc(), &material, &supports, &mut model) };
    let failures = [SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_MESH, SW_ERROR_NUMERICAL];
    if !ok_or(status, &failures) {
        assert!(model.is_null());
        return;
    }
    let model = Model(model);
    let info = model.info();
    all_finite("masses", &[info.total_mass, info.total_area, info.size]);
    assert!(info.total_mass > 0.0 && info.total_area > 0.0);
    let mut options = SwPrecomputeDesc::initial();
    options.modes = 1 + input.below(8) as u32;
    options.reduced_fields = if input.one_in(4) { 4 } else { 0 };
    let failures = [SW_ERROR_NUMERICAL, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED];
    if !ok_or(unsafe { sw_model_precompute(model.0, &options) }, &failures) {
        return;
    }
    check_modes(&model, &model.info());
    let saved = model.save();
    let loaded = Model::load(&saved).unwrap_or_else(|| panic!("a saved model must load: {}", message()));
    assert!(loaded.save() == saved);
    let yields = lists.yields.iter().any(|limit| limit.is_finite());
    run_a_little(&loaded, if yields { &YIELDING } else { &MODAL }, &mut input);
}
