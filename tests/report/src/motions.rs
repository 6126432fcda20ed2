//! The recorded motions as the page's player reads them; page/viewer.js is the other end.

use crate::mesh::P3;
use crate::motion::Outcome;
use crate::scenes::{Drive, FRAME, Scene};
use crate::table::percent;
use anyhow::Result;
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use serde_json::{Value, json};
use std::io::Write;

/// Every second frame is kept; the player interpolates.
const EVERY: usize = 2;

fn packed(bytes: &[u8]) -> Result<String> {
    let mut encoder = ZlibEncoder::new(vec![], Compression::best());
    encoder.write_all(bytes)?;
    Ok(STANDARD.encode(encoder.finish()?))
}

/// 16-bit places in a box, as differences from frame to frame: all low bytes, then all high bytes.
fn quantised(frames: &[&Vec<P3>], low: P3, high: P3) -> Vec<u8> {
    let (mut lows, mut highs) = (vec![], vec![]);
    let mut last = vec![0u16; 3 * frames.first().map_or(0, |f| f.len())];
    for frame in frames {
        for (i, x) in frame.iter().flatten().enumerate() {
            let c = i % 3;
            let share = (x - low[c]) / (high[c] - low[c]).max(f64::MIN_POSITIVE);
            let value = (share * 65535.0).round().clamp(0.0, 65535.0) as u16;
            let [l, h] = value.wrapping_sub(last[i]).to_le_bytes();
            lows.push(l);
            highs.push(h);
            last[i] = value;
        }
    }
    lows.extend(highs);
    lows
}

/// The player's entry of a scene.
pub fn entry(scene: &Scene, outcome: &Outcome) -> Result<Value> {
    let rest = &scene.mesh.positions;
    let tracks: Vec<Vec<&Vec<P3>>> = outcome
        .shown
        .iter()
        .map(|track| std::iter::once(rest).chain(track.frames.iter().skip(EVERY - 1).step_by(EVERY)).collect())
        .collect();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for x in tracks.iter().flatten().flat_map(|f| f.iter()) {
        for c in 0..3 {
            (low[c], high[c]) = (low[c].min(x[c]), high[c].max(x[c]));
        }
    }
    let frames = tracks[0].len();
    let poses = match scene.drive {
        Drive::Shaken(pose) => {
            let at = |k: usize| pose((k * EVERY) as f64 * FRAME);
            let row = |k| [at(k).origin[0][0], at(k).origin[0][1], at(k).origin[0][2], at(k).yaw[0]];
            Some((0..frames).map(row).collect::<Vec<_>>())
        }
        _ => None,
    };
    let ball = scene.ball.map(|(radius, place)| {
        let places: Vec<P3> = (0..frames).map(|k| place((k * EVERY) as f64 * FRAME)).collect();
        for place in &places {
            for c in 0..3 {
                (low[c], high[c]) = (low[c].min(place[c] - radius), high[c].max(place[c] + radius));
            }
        }
        json!({ "radius": radius, "places": places })
    });
    let mut packed_tracks = vec![];
    for (frames, track) in tracks.iter().zip(&outcome.shown) {
        let (r, g, b) = track.colour;
        let error = track.error.map_or_else(|| "the reference".to_owned(), |e| format!("error {}", percent(e)));
        packed_tracks.push(json!({
            "name": track.name, "colour": format!("#{r:02x}{g:02x}{b:02x}"), "error": error,
            "data": packed(&quantised(frames, low, high))?,
        }));
    }
    let index: Vec<u8> = scene.mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let dinosaur = scene.gravity == [0.0; 3];
    let (up, view, beside) =
        if dinosaur { ([0, 1, 0], [0.25, 0.35, 1.0], 0) } else { ([0, 0, 1], [0.9, -1.0, 0.55], 1) };
    Ok(json!({
        "key": scene.key, "title": scene.title, "vertices": rest.len(), "frames": frames, "every": EVERY,
        "low": low, "high": high, "poses": poses, "ball": ball, "up": up, "view": view, "beside": beside,
        "triangles": packed(&index)?, "tracks": packed_tracks,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_back_to_half_a_step_of_the_box() {
        let frames = [vec![[0.0, 1.0, 2.0], [1.0, -1.0, 2.5]], vec![[0.3, 0.9, 2.1], [0.9, -0.2, 2.4]]];
        let (low, high) = ([0.0, -1.0, 2.0], [1.0, 1.0, 2.5]);
        let bytes = quantised(&frames.iter().collect::<Vec<_>>(), low, high);
        let count = bytes.len() / 2;
        let mut value = [0u16; 6];
        for (k, x) in frames.iter().flatten().flatten().enumerate() {
            let v = &mut value[k % 6];
            *v = v.wrapping_add(u16::from_le_bytes([bytes[k], bytes[count + k]]));
            let back = low[k % 3] + (high[k % 3] - low[k % 3]) * f64::from(*v) / 65535.0;
            assert!((back - x).abs() <= 0.51 * (high[k % 3] - low[k % 3]) / 65535.0);
        }
    }
}
