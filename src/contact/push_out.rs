//! Positions for the eye: what modes or fields leave inside a solid is pushed out of it. Never fed back.
//!
//! A vertex inside goes out the shortest way, or as far as its neighbours on average where these go further. Those outside follow by less and
//! less, so that the shell stays smooth. What that brings inside goes out again.

use super::Obstacle;
use crate::Vec3;
use crate::error::{Result, try_zeroed};
use crate::mesh::Edge;

/// Rounds in which a vertex leaves solids that overlap or lie next to each other.
const ROUNDS: usize = 16;
/// Passes by which the neighbours follow, and how much of their mean a vertex takes in each.
const PASSES: usize = 12;
const SHARE: f64 = 0.9;

/// The way out of all solids from `p`, where they stand at the end of the step. Zero outside; between solids that leave no room, some way.
pub fn way_out(obstacles: &[Obstacle], p: &Vec3) -> Vec3 {
    let mut at = *p;
    for _ in 0..ROUNDS {
        let mut inside = false;
        for obstacle in obstacles {
            let touch = obstacle.touch(&obstacle.at_end(&at));
            if touch.distance < 0.0 {
                at -= touch.distance * obstacle.direction(&touch.normal);
                inside = true;
            }
        }
        if !inside {
            break;
        }
    }
    at - p
}

/// Moves the vertices at `x` (world space) out of the solids, `held` ones apart. Returns how deep any of them still is: 0 but between solids that leave no room.
pub fn push_out(obstacles: &[Obstacle], edges: &[Edge], held: &[bool], x: &mut [Vec3]) -> Result<f64> {
    let n = x.len();
    let mut way: Vec<Vec3> = try_zeroed("the way out", n)?;
    let mut any = false;
    for v in (0..n).filter(|v| !held[*v]) {
        way[v] = way_out(obstacles, &x[v]);
        any |= way[v] != Vec3::zeros();
    }
    if any {
        let own = way.clone();
        let (mut sums, mut counts): (Vec<Vec3>, Vec<u32>) =
            (try_zeroed("the way out", n)?, try_zeroed("the way out", n)?);
        for edge in edges {
            edge.vertices.iter().for_each(|v| counts[*v as usize] += 1);
        }
        for _ in 0..PASSES {
            sums.fill(Vec3::zeros());
            for edge in edges {
                let [a, b] = edge.vertices.map(|v| v as usize);
                sums[a] += way[b];
                sums[b] += way[a];
            }
            for v in (0..n).filter(|v| !held[*v]) {
                let mean = SHARE / f64::from(counts[v].max(1)) * sums[v];
                way[v] = if mean.norm() > own[v].norm() { mean } else { own[v] };
            }
        }
        for v in (0..n).filter(|v| !held[*v]) {
            x[v] += way[v];
            let again = way_out(obstacles, &x[v]);
            x[v] += again;
        }
    }
    Ok((0..n).filter(|v| !held[*v]).map(|v| depth(obstacles, &x[v])).fold(0.0, f64::max))
}

/// How deep `p` is in any of the solids; 0 outside.
pub fn depth(obstacles: &[Obstacle], p: &Vec3) -> f64 {
    obstacles.iter().map(|o| -o.touch(&o.at_end(p)).distance).fold(0.0, f64::max)
}
