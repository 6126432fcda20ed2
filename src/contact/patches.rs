//! Vertices near solids, spread evenly: where a shell is likely to be touched, for [`crate::modes::add_patches`].

use super::Obstacle;
use crate::{Shell, Vec3};

/// Of the vertices that move and rest no farther from a solid than `distance`, at most so many: first the nearest to a solid, then each time the
/// one that is farthest from those before. The same each time; fewer where there are no others.
pub fn patches_near(shell: &Shell, obstacles: &[Obstacle], distance: f64, most: usize) -> Vec<u32> {
    let x = &shell.mesh.positions;
    let gap = |x: &Vec3| obstacles.iter().map(|o| o.touch(&o.at_end(x)).distance).fold(f64::INFINITY, f64::min);
    let gaps = shell.free.iter().map(|v| (*v, gap(&x[*v as usize])));
    let near: Vec<(u32, f64)> = gaps.filter(|(_, gap)| *gap <= distance).collect();
    let mut apart = vec![f64::INFINITY; near.len()];
    let mut chosen = vec![];
    let mut next = (0..near.len()).min_by(|a, b| near[*a].1.total_cmp(&near[*b].1));
    while let Some(at) = next.filter(|at| chosen.len() < most && apart[*at] > 0.0) {
        let v = near[at].0;
        chosen.push(v);
        for (apart, (other, _)) in apart.iter_mut().zip(&near) {
            *apart = apart.min((x[*other as usize] - x[v as usize]).norm());
        }
        // The first of the farthest.
        next = (0..near.len()).rev().max_by(|a, b| apart[*a].total_cmp(&apart[*b]));
    }
    chosen
}
