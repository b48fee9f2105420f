//! Distance between convex hulls, by the algorithm of Gilbert, Johnson and Keerthi.

use nalgebra::{Matrix3, Point3, Vector3};

/// Largest number of steps of the search, which takes four to ten.
const STEPS: usize = 50;
/// Share of the distance by which the result may be too large.
const ACCURACY: f64 = 1e-6;

/// Least squared volume, area or length between corners, as a share of that of the box with the same edges.
const FLAT: f64 = 1e-10;

/// The distance between the convex hulls of two sets of points (m); 0 if they overlap, infinite if one set is empty.
pub fn gap_m(a: &[Point3<f64>], b: &[Point3<f64>]) -> f64 {
    let (Some(first), Some(second)) = (a.first(), b.first()) else {
        return f64::INFINITY;
    };
    let mut nearest = first - second;
    let mut simplex = vec![nearest];
    for _ in 0..STEPS {
        let along = |p: &&Point3<f64>| p.coords.dot(&nearest);
        let least = a
            .iter()
            .min_by(|p, q| along(p).total_cmp(&along(q)))
            .unwrap_or(first);
        let most = b
            .iter()
            .max_by(|p, q| along(p).total_cmp(&along(q)))
            .unwrap_or(second);
        // The point of `a - b` that lies farthest against `nearest`.
        let next = least - most;
        let squared = nearest.norm_squared();
        if squared < 1e-18 {
            return 0.0;
        }
        if squared - nearest.dot(&next) <= ACCURACY * squared {
            break;
        }
        simplex.push(next);
        (nearest, simplex) = nearest_of(&simplex);
    }
    nearest.norm()
}

/// The point of a simplex that lies nearest to the origin, and the corners between which it lies.
fn nearest_of(simplex: &[Vector3<f64>]) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let parts = 1_usize..1 << simplex.len();
    let candidates = parts.filter_map(|part| {
        let corners: Vec<_> = (0..simplex.len())
            .filter(|i| part >> i & 1 == 1)
            .map(|i| simplex[i])
            .collect();
        // At most four corners are kept: either four enclose the origin, or one of them is not needed.
        (corners.len() <= 4)
            .then(|| nearest_between(&corners))
            .flatten()
            .map(|point| (point, corners))
    });
    let best = candidates.min_by(|a, b| a.0.norm_squared().total_cmp(&b.0.norm_squared()));
    best.unwrap_or_else(|| (simplex[0], vec![simplex[0]]))
}

/// The point nearest to the origin on the plane through up to four corners; None if it does not lie between them.
fn nearest_between(corners: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let edges: Vec<Vector3<f64>> = corners[1..]
        .iter()
        .map(|corner| corner - corners[0])
        .collect();
    let mut gram = Matrix3::identity();
    let mut right = Vector3::zeros();
    for (i, edge) in edges.iter().enumerate() {
        right[i] = -edge.dot(&corners[0]);
        for (k, other) in edges.iter().enumerate() {
            gram[(i, k)] = edge.dot(other);
        }
    }
    // Of corners that lie almost in one plane or line, fewer suffice; their inverse is made of rounding errors.
    let box_of_edges: f64 = edges.iter().map(|edge| edge.norm_squared()).product();
    if gram.determinant() <= FLAT * box_of_edges {
        return None;
    }
    let shares = gram.try_inverse()? * right;
    let is_between =
        shares.iter().take(edges.len()).all(|share| *share >= 0.0) && shares.sum() <= 1.0;
    is_between.then(|| {
        edges
            .iter()
            .zip(shares.iter())
            .fold(corners[0], |point, (edge, share)| point + edge * *share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    fn cube(at: &Isometry3<f64>, half: f64) -> Vec<Point3<f64>> {
        let sign = |k: usize, axis: usize| if k >> axis & 1 == 1 { half } else { -half };
        (0..8)
            .map(|k| at * Point3::new(sign(k, 0), sign(k, 1), sign(k, 2)))
            .collect()
    }

    #[test]
    fn gaps_of_cubes_by_face_edge_and_corner() {
        let still = cube(&Isometry3::identity(), 0.5);
        let turned = |x: f64, y: f64, z: f64, turn: Vector3<f64>| {
            cube(
                &Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::new(turn)),
                0.5,
            )
        };
        let quarter = std::f64::consts::FRAC_PI_4;
        for (other, expected) in [
            (turned(1.5, 0.3, -0.2, Vector3::zeros()), 0.5),
            (turned(1.3, 1.4, 0.0, Vector3::zeros()), 0.5),
            (turned(1.2, 1.3, 1.6, Vector3::zeros()), 0.7),
            (
                turned(2.0, 0.0, 0.0, Vector3::z() * quarter),
                1.5 - 0.5_f64.sqrt(),
            ),
            (turned(0.9, 0.9, 0.9, Vector3::zeros()), 0.0),
            (turned(0.1, 0.0, 0.0, Vector3::x()), 0.0),
        ] {
            let gap = gap_m(&still, &other);
            assert!((gap - expected).abs() < 1e-9, "{gap}, not {expected}");
            assert!((gap_m(&other, &still) - expected).abs() < 1e-9);
        }
        assert_eq!(gap_m(&still, &[]), f64::INFINITY);
    }
}
