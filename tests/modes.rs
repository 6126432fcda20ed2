//! Modes against independent numbers, and the certificate on shells of every kind.
#![allow(missing_docs)]
mod common;
use common::*;

#[test]
fn eigenvalues_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let modes = modes_of(&shell, 8);
        let c = modes.certificate;
        println!("{c:?} {:?}", modes.eigenvalues);
        for (k, expected) in json["eigenvalues"].as_array().unwrap().iter().enumerate() {
            assert_close(&format!("{name} eigenvalue {k}"), modes.eigenvalues[k], expected.as_f64().unwrap(), 1e-7, 0.0);
        }
    }
}
#[test]
fn dino() {
    let m = mesh("dinosaur.obj");
    let fixed = (0..m.positions.len() as u32).filter(|&v| m.positions[v as usize].y.abs() < 1e-6).collect();
    let shell = shellwarp::Shell::new(m, Default::default(), &shellwarp::Supports { fixed, clamped: vec![] }).unwrap();
    for k in [4, 64] {
        let t = std::time::Instant::now();
        let mut cb = |_p, _f| Ok(());
        let mut p = shellwarp::modes::Progress::new(&mut cb);
        let modes = shellwarp::modes::lowest_modes(&shell, k, &mut p).unwrap();
        println!("{:?} {:?} {:?} {:?}", t.elapsed(), p.seconds, modes.certificate, &modes.eigenvalues[..4]);
    }
}
