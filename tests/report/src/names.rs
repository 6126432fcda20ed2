//! Where names stand in a plot.

/// Of a letter of the legend and of names beside series, on the safe side.
pub const LETTER: i32 = 8;

/// A box in the picture, pixels: left, top, right, bottom.
pub type Box4 = [i32; 4];

fn overlap(a: Box4, b: Box4) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Where names stand: each by the end of its curve, on no other name, on no point and within `area`.
pub fn places(names: &[(String, (i32, i32))], points: &[(i32, i32)], area: Box4) -> Vec<(i32, i32)> {
    let mut taken: Vec<Box4> = vec![];
    let mut all = vec![];
    for (name, end) in names {
        let width = LETTER * name.chars().count() as i32;
        // From near to far, above and below: the box's left and top. On a curve is better than nowhere.
        let around = (0..24).flat_map(|k| {
            [8, -width / 2, -width - 8].into_iter().flat_map(move |dx| [(dx, -9 - 9 * k), (dx, -9 + 9 * k)])
        });
        let boxes = around.map(|(dx, dy)| [end.0 + dx, end.1 + dy, end.0 + dx + width, end.1 + dy + 18]);
        let inside = |b: &Box4| b[0] >= area[0] && b[1] >= area[1] && b[2] <= area[2] && b[3] <= area[3];
        let free = |b: &Box4| !taken.iter().any(|t| overlap(*b, *t));
        let clear = |b: &Box4| !points.iter().any(|p| overlap(*b, [p.0 - 4, p.1 - 4, p.0 + 4, p.1 + 4]));
        let boxes: Vec<Box4> = boxes.filter(inside).filter(free).collect();
        let place = boxes.iter().copied().find(clear).or(boxes.first().copied());
        let place = place.unwrap_or([end.0, end.1, end.0 + width, end.1 + 18]);
        taken.push(place);
        all.push((place[0], place[1]));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Box4 = [0, 0, 900, 500];

    fn boxes(names: &[(String, (i32, i32))], points: &[(i32, i32)]) -> Vec<Box4> {
        let of =
            |((name, _), (x, y)): (&(String, _), (i32, i32))| [x, y, x + LETTER * name.chars().count() as i32, y + 18];
        names.iter().zip(places(names, points, AREA)).map(of).collect()
    }

    #[test]
    fn names_lie_on_no_other_name_nor_on_points_and_inside() {
        // Eight curves that end within a few pixels of one another, some by the right edge.
        let ends = [(880, 250), (878, 252), (870, 255), (500, 250), (505, 251), (510, 252), (4, 4), (896, 496)];
        let names: Vec<_> = ends.iter().map(|e| ("warp by virtual work".to_owned(), *e)).collect();
        let all = boxes(&names, &ends);
        for (i, a) in all.iter().enumerate() {
            assert!(a[0] >= 0 && a[1] >= 0 && a[2] <= 900 && a[3] <= 500, "{a:?}");
            assert!(!ends.iter().any(|p| overlap(*a, [p.0 - 3, p.1 - 3, p.0 + 3, p.1 + 3])), "{a:?}");
            assert!(!all[..i].iter().any(|b| overlap(*a, *b)), "{a:?}");
        }
    }
}
