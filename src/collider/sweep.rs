//! The first place on a segment that is within a margin of a solid.

use super::Touch;
use crate::Vec3;

/// Newton doubles the digits of a crossing and halves the distance where the way just grazes: more would find nothing new.
const NEWTON: usize = 64;
/// Of the lengths at hand: closer than this to the margin is there.
const ROUNDING: f64 = 1e-14;

/// Newton along the segment. The distance of a convex solid is a convex function, so that its tangent lies below it: a step never
/// passes the place, and where the distance no longer falls there is none.
pub(super) fn convex(touch_at: impl Fn(&Vec3) -> Touch, from: &Vec3, to: &Vec3, margin: f64) -> Option<(f64, Touch)> {
    let way = to - from;
    let mut share = 0.0;
    let mut touch = touch_at(from);
    if touch.distance <= margin {
        return None;
    }
    let close = ROUNDING * (from.amax() + to.amax() + margin.abs());
    for _ in 0..NEWTON {
        let slope = touch.normal.dot(&way);
        let gap = touch.distance - margin;
        if gap <= close {
            break;
        }
        let next = share - gap / slope;
        if slope >= 0.0 || next > 1.0 || next.is_nan() {
            return None;
        }
        (share, touch) = (next, touch_at(&(from + next * way)));
    }
    Some((share, touch))
}
