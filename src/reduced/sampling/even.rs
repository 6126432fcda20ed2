//! An even choice among the elements of a mesh.

/// Elements that are chosen together, and the golden ratio less 1.
const TOGETHER: usize = 3;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The numbers of at most so many of `n` elements, evenly chosen, three neighbours at a time: a triangle of a sheet has three strains of its membrane, and
/// three of its bending, one behind the other. The list is cut into equal stretches. Where in its stretch a choice is goes by the golden ratio: by an equal
/// step it might meet the same kind of triangle each time, as meshes repeat themselves.
pub fn even_choice(n: usize, most: usize) -> Vec<usize> {
    if n <= most {
        return (0..n).collect();
    }
    let (parts, wanted) = (n.div_ceil(TOGETHER), (most / TOGETHER).max(1));
    let part = |k: usize| {
        let [first, end] = [k, k + 1].map(|k| (k as u64 * parts as u64 / wanted as u64) as usize);
        first + ((k as f64 * GOLDEN).fract() * (end - first) as f64) as usize
    };
    (0..wanted).flat_map(|k| (TOGETHER * part(k)..n).take(TOGETHER)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the list repeats, each kind has its share of the choice; and nothing is chosen twice.
    #[test]
    fn choices_are_even_however_a_mesh_repeats_itself() {
        for (n, most) in [(12_000, 6_000), (17_280, 6_000), (17_281, 5_760), (80_000, 1_500), (9, 6), (2, 1)] {
            let kept = even_choice(n, most);
            assert!(kept.is_sorted_by(|a, b| a < b) && kept.iter().all(|e| *e < n) && !kept.is_empty());
            assert!(kept.len() <= most.max(TOGETHER), "{n} {most}");
            for period in (2..=12).filter(|_| n > 1000) {
                let count = |kind: usize| kept.iter().filter(|e| **e % period == kind).count() as f64;
                let even = kept.len() as f64 / period as f64;
                // A step of 3 or 6 would have 0 of some kinds, and several times as many of others.
                assert!((0..period).all(|kind| (count(kind) / even - 1.0).abs() < 0.1), "{n} {most} {period}");
            }
        }
        assert_eq!(even_choice(7, 7), [0, 1, 2, 3, 4, 5, 6]);
    }
}
