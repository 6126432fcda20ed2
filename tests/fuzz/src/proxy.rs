//! Any asset → a proxy → what it holds → a model.

use super::host::*;
use super::input::Input;
use shellwarp::ffi::mesh::*;
use shellwarp::ffi::model::*;
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::proxy::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ptr::null_mut;

/// A sheet or two, moved, torn, welded and turned, or any triangles at all.
fn asset(input: &mut Input) -> Triangles {
    if input.one_in(4) {
        let (n, t) = (1 + input.below(12), 1 + input.below(20));
        return Triangles {
            x: (0..n).map(|_| input.numbers()).collect(),
            t: (0..t).map(|_| [input.index(n), input.index(n), input.index(n)]).collect(),
        };
    }
    let mut mesh = Triangles::sheet(1 + input.below(6) as u32, 1 + input.below(6) as u32);
    if input.one_in(2) {
        let (n, apart) = (mesh.x.len() as u32, input.number());
        let below: Vec<[f64; 3]> = mesh.x.iter().map(|[x, y, z]| [*x, *y, z - apart]).collect();
        let turned: Vec<[u32; 3]> = mesh.t.iter().map(|[a, b, c]| [a + n, c + n, b + n]).collect();
        mesh.x.extend(below);
        mesh.t.extend(turned);
    }
    for _ in 0..input.below(8) {
        let (v, t) = (input.below(mesh.x.len()), input.below(mesh.t.len()));
        match input.below(6) {
            0 => mesh.x[v][2] = input.number(),
            1 => mesh.x[v] = input.numbers(),
            2 => mesh.t[t][input.below(3)] = input.index(mesh.x.len()),
            3 => mesh.t[t].swap(0, 1),
            4 => mesh.x[v] = mesh.x[input.below(mesh.x.len())],
            _ => mesh.t.push([input.index(mesh.x.len()), v as u32, input.index(mesh.x.len())]),
        }
    }
    mesh
}

fn holds_what_it_says(proxy: *const SwProxy, n_asset: u32) {
    let mut info = SwProxyInfo::initial();
    unsafe { ok(sw_proxy_info(proxy, &mut info)) };
    let (n, t) = (info.n_vertices as usize, info.n_triangles as usize);
    all_finite(
        "lengths",
        &[info.furthest_distance, info.edge_length, info.thickness, info.worst_quality, info.mean_quality],
    );
    let (mut x, mut corners, mut weights) = (vec![0.0; 3 * n], vec![0; 3 * n], vec![0.0; 3 * n]);
    let (mut triangles, mut nearest) = (vec![0; 3 * t], vec![0; n_asset as usize]);
    unsafe {
        ok(sw_proxy_positions(proxy, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, info.n_vertices));
        ok(sw_proxy_triangles(proxy, triangles.as_mut_ptr(), info.n_triangles));
        ok(sw_proxy_sources(proxy, corners.as_mut_ptr(), weights.as_mut_ptr(), info.n_vertices));
        ok(sw_proxy_nearest(proxy, nearest.as_mut_ptr(), n_asset));
    }
    all_finite("positions and weights", &[x.clone(), weights].concat());
    assert!(corners.iter().all(|v| *v < n_asset) && nearest.iter().all(|v| (*v as usize) < n));
    let mut mesh = SwMeshDesc::initial();
    (mesh.position_format, mesh.positions, mesh.triangles) = (SW_FORMAT_F64, x.as_ptr().cast(), triangles.as_ptr());
    (mesh.n_vertices, mesh.n_triangles) = (info.n_vertices, info.n_triangles);
    let mut found: Vec<SwDiagnostic> = Vec::with_capacity(64);
    let mut count = 0;
    unsafe {
        ok(sw_mesh_check(&mesh, found.as_mut_ptr(), size_of::<SwDiagnostic>() as u32, 64, &mut count));
        found.set_len(count.min(64) as usize);
    }
    assert!(found.iter().all(|d| d.severity == SW_SEVERITY_WARNING), "a proxy that is no manifold");
}

/// A model of its mesh, held somewhere, of any sheet: what a calibration tells is finite, or it is refused.
fn calibrates(proxy: *const SwProxy, n_asset: u32, input: &mut Input) {
    let mut info = SwProxyInfo::initial();
    unsafe { ok(sw_proxy_info(proxy, &mut info)) };
    let (n, t) = (info.n_vertices as usize, info.n_triangles as usize);
    let (mut x, mut triangles, mut nearest) = (vec![0.0; 3 * n], vec![0u32; 3 * t], vec![0u32; n_asset as usize]);
    unsafe {
        ok(sw_proxy_positions(proxy, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, info.n_vertices));
        ok(sw_proxy_triangles(proxy, triangles.as_mut_ptr(), info.n_triangles));
        ok(sw_proxy_nearest(proxy, nearest.as_mut_ptr(), n_asset));
    }
    let held: Vec<u32> = (0..1 + input.below(6)).map(|_| input.below(n_asset as usize) as u32).collect();
    let fixed: Vec<u32> = held.iter().map(|v| nearest[*v as usize]).collect();
    let mut mesh = SwMeshDesc::initial();
    (mesh.position_format, mesh.positions, mesh.triangles) = (SW_FORMAT_F64, x.as_ptr().cast(), triangles.as_ptr());
    (mesh.n_vertices, mesh.n_triangles) = (info.n_vertices, info.n_triangles);
    let mut material = SwMaterialDesc::initial();
    if input.one_in(2) {
        material.energy = SW_ENERGY_KOITER;
        (material.young, material.poisson) = (input.number(), 0.3);
        (material.thickness, material.volume_density) = (input.number(), input.number());
    }
    let mut supports = SwSupportDesc::initial();
    if input.one_in(2) {
        (supports.clamped, supports.n_clamped) = (fixed.as_ptr(), fixed.len() as u32);
    } else {
        (supports.fixed, supports.n_fixed) = (fixed.as_ptr(), fixed.len() as u32);
    }
    let mut model = null_mut();
    let status = unsafe { sw_model_create(&mesh, &material, &supports, &mut model) };
    if status != SW_OK {
        assert!(model.is_null());
        return;
    }
    let mut how = SwCalibrationDesc::initial();
    (how.held, how.n_held) = (held.as_ptr(), held.len() as u32);
    let mut found = SwCalibrationInfo::initial();
    let status = unsafe { sw_model_calibrate(model, proxy, &how, &mut found) };
    let known = [SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH, SW_ERROR_NUMERICAL, SW_ERROR_UNSUPPORTED];
    if ok_or(status, &known) {
        all_finite("differences", &[found.difference_before, found.difference_after, found.mass_before]);
        let factors = [found.stretching_min, found.stretching_max, found.bending_min, found.bending_max];
        assert!(factors.iter().all(|factor| (0.2499..=4.0001).contains(factor)), "{factors:?}");
    }
    unsafe { sw_model_destroy(model) };
}

pub fn run(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let mut desc = SwProxyDesc::initial();
    (desc.n_vertices, desc.flags) = (4 + u32::from(input.byte()), input.code(8));
    if input.one_in(4) {
        desc.weld = input.number();
    }
    if input.one_in(4) {
        desc.thickness = input.number();
    }
    let asset = asset(&mut input);
    let mut proxy = null_mut();
    let status = unsafe { sw_proxy_create(&asset.desc(), &desc, &mut proxy) };
    if !ok_or(status, &[SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH, SW_ERROR_NUMERICAL]) {
        assert!(proxy.is_null());
        return;
    }
    holds_what_it_says(proxy, asset.x.len() as u32);
    calibrates(proxy, asset.x.len() as u32, &mut input);
    unsafe { sw_proxy_destroy(proxy) };
}
